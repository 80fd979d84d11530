"""The equations of motion of a system in a field (rationals or balls), read from M, C, K and the modes of its elements anew.

Nothing is taken from the packed tables of the engine.  With the joined state x = (q, v, z, 1, cos k theta, sin k theta, ...) and
the phase theta = omega t as time, every mode is dx/dtheta = B x with a constant matrix, every guard a row G, every event a
matrix R.  Held rows are eliminated by lam = -(J M^-1 D)^-1 (J a_free + base''), D = J^T push.

One file, because it is the model read anew, whole, so that it can be read beside the engine's tables.
"""
from collections.abc import Hashable, Iterable
from dataclasses import fields
from typing import Any, NamedTuple

from ..elements import Algebraic, Guard, Hold, Law, Mode, Rate, Restitution, Rows
from ..elements.friction.together import mode_of
from ..elements.local import affine
from ..system import System
from .arithmetic.balls import Recorder

KNOWN = {Rows: {"R", "base", "drift"}, Hold: {"row", "push", "surface"}, Mode: {"force", "hold", "memory", "guards", "bounds"},
         Guard: {"value", "kind", "then", "kick", "silent", "accumulates"}}  # what the equations below take account of


class Refused(ValueError):
    """The system has something that no proof is made for; the message names it."""


class Term(NamedTuple):
    """One term of an affine expression in local values."""

    name: str
    place: int
    weight: Any


class GuardRow(NamedTuple):
    """A guard of a mode: its owner, its number there, its row in the joined state, and what the element says of it."""

    element: int
    number: int
    row: list
    guard: Any


class HeldRow(NamedTuple):
    """A held row: its speed and (or None) its surface, both zero while the mode lasts, and its row in the coordinates."""

    element: int
    speed: list
    surface: list | None
    J: list
    driven: bool  # it has a drift or a base motion


class Dynamics(NamedTuple):
    """A mode of the system."""

    B: Any  # (nx, nx) generator per radian
    guards: list[GuardRow]
    holds: list[HeldRow]


class _Site(NamedTuple):
    J: list  # rows (n)
    U: list  # rows (nx)
    S: list
    rest: list
    X: Any  # (n, rows) M^-1 J^T


class Model:
    """A system in a field.

    Parameters
    ----------
    system : System
        With an excitation frequency; all modes asked for must be affine.
    field : Rationals or Balls
    places : iterable of (int, key)
        Modes of elements that are read, in this order.

    Raises
    ------
    Refused
        Naming the law, impact law or decision that is not covered.
    """

    def __init__(self, system: System, field, places: Iterable[tuple[int, Hashable]]):
        if system.omega is None:
            raise Refused("the system is autonomous: certificates are for motions with the period of an excitation")
        self.system, self.field = system, field
        number = field.number
        n = self.n = system.n
        self.slices, nz = [], 0
        harmonics: set[int] = set()
        for element in system.elements:
            self.slices.append(slice(2 * n + nz, 2 * n + nz + len(element.memory)))
            nz += len(element.memory)
            harmonics |= {*element.harmonics, *element.site(n).harmonics}
        self.harmonics = tuple(sorted(harmonics))
        self.ns = 2 * n + nz
        self.nx = self.ns + 1 + 2 * len(self.harmonics)
        self.columns = {("one", 0): self.ns}
        for i, k in enumerate(self.harmonics):
            self.columns["cos", k], self.columns["sin", k] = self.ns + 1 + 2 * i, self.ns + 2 + 2 * i
        self.omega = number(system.omega)
        M, C, K = ([[number(float(v)) for v in row] for row in matrix] for matrix in system.core[:3])
        sites = [element.site(n) for element in system.elements]
        for label, element, site in zip(system.labels, system.elements, sites, strict=True):
            if element.delayed:
                raise Refused(f"{label!r} acts on what the motion was one delay ago; certificates are for motions without delay")
            understood(site, Rows, label)
        read_sites = [([[number(float(v)) for v in row] for row in site.R], [self._read(motion) for motion in site.base],
                       [number(float(v)) for v in site.drift]) for site in sites]
        self._modes: dict[tuple, dict] = {}
        for e, key in places:
            if (e, key) not in self._modes:
                self._modes[e, key] = self._read_mode(e, key)
        if not field.computes:  # a recorder has read all it wants
            return
        self.zero, self.one = field.scalar(0), field.scalar(1)
        self.W = self._forcing_generator()
        self.inverse = self._matrix(M).inv()
        self._core = self._rows(self.inverse * self._matrix([[-v for v in k] + [-v for v in c]
                                                             for k, c in zip(K, C, strict=True)]))
        self.sites = [self._site(*parts) for parts in read_sites]
        self._dynamics: dict[tuple, Dynamics] = {}

    # reading

    def _read(self, expression) -> list[Term]:
        return [Term(name, index, self.field.number(float(weight)))
                for (name, index), weight in affine(expression).terms.items()]

    def _read_mode(self, e: int, key) -> dict:
        system, number = self.system, self.field.number
        mode = mode_of(system, system.together, e, key, system.core)
        name = f"{system.labels[e]!r} in its mode {key!r}"
        if not isinstance(mode, Mode):
            raise Refused(f"{name} is not made of affine expressions")
        if isinstance(mode.force, Law):
            raise Refused(f"the force law {mode.force.function.__name__!r} of {name} is not affine; "
                          "certificates are for affine modes")
        understood(mode, Mode, name)
        guards = []
        for guard in mode.guards:
            understood(guard, Guard, name)
            if guard.kick is not None and type(guard.kick) is not Restitution:
                raise Refused(f"the impact law {guard.kick!r} of {name} is not Newton's")
            if not callable(getattr(guard.value, "__add__", None)):
                raise Refused(f"a guard of {name} is not an affine expression")
            ratio = None if guard.kick is None else number(float(guard.kick.ratio))
            guards.append((self._read(guard.value), ratio, guard))
        for hold in mode.hold:
            understood(hold, Hold, name)
        holds = [(hold.row, [number(float(v)) for v in hold.push], None if hold.surface is None else self._read(hold.surface))
                 for hold in mode.hold]
        memory = []
        for item in mode.memory:
            if item is not None and not isinstance(item, (Algebraic, Rate)):
                raise Refused(f"the memory {item!r} of {name} is neither frozen, nor algebraic, nor a rate")
            memory.append(None if item is None else (type(item), self._read(item.value)))
        return {"force": [self._read(entry) for entry in mode.entries], "guards": guards, "holds": holds, "memory": memory}

    # linear algebra in the field

    def _matrix(self, rows):
        return self.field.matrix(len(rows), len(rows[0]), [v for row in rows for v in row])

    @staticmethod
    def _rows(matrix) -> list[list]:
        return [[matrix[i, j] for j in range(matrix.ncols())] for i in range(matrix.nrows())]

    def _null(self) -> list:
        return [self.zero] * self.nx

    def _forcing_generator(self) -> list[list[int]]:
        size = self.nx - self.ns
        W = [[0] * size for _ in range(size)]
        for i, k in enumerate(self.harmonics):
            W[1 + 2 * i][2 + 2 * i] = -k
            W[2 + 2 * i][1 + 2 * i] = k
        return W

    def _row(self, terms, local=None) -> list:
        row = self._null()
        for name, index, weight in terms:
            column = self.columns.get((name, index))
            if column is not None:
                row[column] = row[column] + weight
                continue
            other = (local or {}).get(name, ())
            if index >= len(other):
                raise Refused(f"an expression uses {name}({index}), which is not there")
            row = [a + weight * b for a, b in zip(row, other[index], strict=True)]
        return row

    def forced_rate(self, row) -> list:
        """Return the derivative by time (not phase) of a row in forcing states only."""
        out = self._null()
        for k in self.harmonics:
            c, s = self.columns["cos", k], self.columns["sin", k]
            out[c] = row[s] * (self.omega * k)
            out[s] = -(row[c] * (self.omega * k))
        return out

    def _site(self, J, base, drift) -> _Site:
        n = self.n
        U, S, rest = [], [], []
        for i, factors in enumerate(J):
            u = [*factors, *self._null()[n:]]
            moved = self._row(base[i]) if base else self._null()
            first = self.forced_rate(moved)
            s = [*self._null()[:n], *factors, *self._null()[2 * n:]]
            s = [a + b for a, b in zip(s, first, strict=True)]
            if drift:
                s[self.ns] = s[self.ns] + drift[i]
            U.append([a + b for a, b in zip(u, moved, strict=True)])
            S.append(s)
            rest.append(self.forced_rate(first))
        X = self.inverse * self._matrix([list(column) for column in zip(*J, strict=True)])
        return _Site(J, U, S, rest, X)

    # what it is in a mode

    def mode(self, keys: tuple) -> Dynamics:
        """Return the mode of these element keys.

        Raises
        ------
        ZeroDivisionError
            When held rows depend on each other.
        """
        found = self._dynamics.get(keys)
        if found is None:
            found = self._dynamics[keys] = self._compose(keys)
        return found

    def _local(self, e: int) -> dict:
        site = self.sites[e]
        eye = []
        for c in range(self.slices[e].start, self.slices[e].stop):
            row = self._null()
            row[c] = self.one
            eye.append(row)
        return {"u": site.U, "s": site.S, "z": eye}

    def _compose(self, keys: tuple) -> Dynamics:
        n, nx = self.n, self.nx
        acceleration = [[*row, *self._null()[2 * n:]] for row in self._core]
        for e, key in enumerate(keys):
            force = self._modes[e, key]["force"]
            if force:
                local, X = self._local(e), self.sites[e].X
                for r, entry in enumerate(force):
                    row = self._row(entry, local)
                    for i in range(n):
                        weight = X[i, r]
                        acceleration[i] = [a + weight * b for a, b in zip(acceleration[i], row, strict=True)]
        owners = [(e, number, hold) for e, key in enumerate(keys) for number, hold in enumerate(self._modes[e, key]["holds"])]
        reactions: dict[int, list] = {}
        holds = []
        if owners:
            J = self._matrix([self.sites[e].J[row] for e, _, (row, _, _) in owners])
            D = self._matrix([[sum((p * self.sites[e].J[r][i] for r, p in enumerate(push)), self.zero)
                               for e, _, (_, push, _) in owners] for i in range(n)])
            X = self.inverse * D
            rest = self._matrix([self.sites[e].rest[row] for e, _, (row, _, _) in owners])
            lam = (J * X).inv() * (J * self._matrix(acceleration) + rest) * self.field.scalar(-1)
            acceleration = self._rows(self._matrix(acceleration) + X * lam)
            lam_rows = self._rows(lam)
            for i, (e, _, _) in enumerate(owners):
                reactions.setdefault(e, []).append(lam_rows[i])
            for e, _, (row, _, surface) in owners:
                site = self.sites[e]
                local = {**self._local(e), "lam": reactions[e]}
                speed = site.S[row]
                driven = any(not v == 0 for v in speed[2 * n:]) or any(not v == 0 for v in site.rest[row])
                holds.append(HeldRow(e, speed, None if surface is None else self._row(surface, local), site.J[row], driven))
        B = [self._null() for _ in range(nx)]
        for i in range(n):
            B[i][n + i] = self.one / self.omega
            B[n + i] = [v / self.omega for v in acceleration[i]]
        for i, row in enumerate(self.W):
            B[self.ns + i][self.ns:] = [self.field.scalar(v) for v in row]
        guards = []
        for e, key in enumerate(keys):
            mode = self._modes[e, key]
            if not (mode["guards"] or mode["memory"]):
                continue
            local = {**self._local(e), "lam": reactions.get(e, [])}
            for i, item in enumerate(mode["memory"]):
                if item is not None and item[0] is Rate:
                    B[self.slices[e].start + i] = [v / self.omega for v in self._row(item[1], local)]
            guards += [GuardRow(e, number, self._row(terms, local), guard)
                       for number, (terms, _, guard) in enumerate(mode["guards"])]
        return Dynamics(self._matrix(B), guards, holds)

    def writes(self, element: int, key) -> bool:
        """Return whether an element has memory that is written when it leaves a mode."""
        return any(item is not None and item[0] is Algebraic for item in self._modes[element, key]["memory"])

    def guard(self, keys: tuple, element: int, number: int) -> GuardRow:
        """Return a guard of a mode by its owner and its number there."""
        return next(g for g in self.mode(keys).guards if (g.element, g.number) == (element, number))

    def reset(self, keys: tuple, element: int, number: int):
        """Return the matrix (nx, nx) of the event that a guard makes: impulse, and memory of the mode that the element leaves.

        The state before lies on the guard, so that no position needs to be put right.
        """
        R = self._eye()
        mode = self._modes[element, keys[element]]
        ratio = mode["guards"][number][1]
        if ratio is not None:
            site, n = self.sites[element], self.n
            W = self._matrix(site.J) * site.X
            impulse = self._rows(site.X * (W.inv() * self._matrix(site.S)))
            for i in range(n):
                R[n + i] = [a - (self.one + ratio) * b for a, b in zip(R[n + i], impulse[i], strict=True)]
        local = self._local(element)
        for i, item in enumerate(mode["memory"]):
            if item is not None and item[0] is Algebraic:
                R[self.slices[element].start + i] = self._row(item[1], local)
        return self._matrix(R)

    def at_rest(self, keys: tuple):
        """Return the matrix (nx, nx) that puts what a mode holds on its surface and to rest: such rows are no unknowns."""
        rows = [row for hold in self.mode(keys).holds for row in (hold.speed, hold.surface) if row is not None]
        if not rows:
            return self._matrix(self._eye())
        N = self._matrix(rows)
        states = self._matrix([row[:self.ns] for row in rows])
        move = self._rows(states.transpose() * (states * states.transpose()).inv() * N)
        R = self._eye()
        for i in range(self.ns):
            R[i] = [a - b for a, b in zip(R[i], move[i], strict=True)]
        return self._matrix(R)

    def _eye(self) -> list[list]:
        rows = [self._null() for _ in range(self.nx)]
        for i in range(self.nx):
            rows[i][i] = self.one
        return rows


def understood(item: Any, kind: type, name: str) -> None:
    """Raise `Refused` unless an object is of a kind that is read completely: nothing that acts may be left out of a proof."""
    if type(item) is not kind:
        raise Refused(f"{name} has a {type(item).__name__}, which no proof is made for")
    for field in fields(kind):
        value = getattr(item, field.name)
        if field.name not in KNOWN[kind] and value is not None and value is not False and value != () and value != 0:
            raise Refused(f"{name} has {field.name} = {value!r}, which no proof takes account of")


def floats_of(system: System, places) -> list[float]:
    """Return the numbers of a system that its model reads, in the order they are read."""
    recorder = Recorder()
    Model(system, recorder, places)
    return recorder.floats
