"""Numbers of a scene: local expressions of elements become rows of the joined vector, held rows are eliminated."""
from collections.abc import Callable, Hashable
from typing import NamedTuple

import numpy as np

from ..elements import Affine, Frame, Guard, Law, Mode, Rate, Slaved
from ..system import System
from .tables import Tables

EMPTY = np.empty((0, 0))
RANK = 1e-12  # held rows whose normalised Gram matrix has a smaller singular value are dependent


class DependentHolds(ValueError):
    """A combination of modes holds rows that depend on each other."""


class SceneLaw(NamedTuple):
    """A law of a scene: ``v' = A x + sum LP f``, ``f = function(u..., s..., *values)`` with u = LU x, s = LS x."""

    element: int
    name: str  # label of the element
    key: Hashable  # mode of the element in which the law acts
    rows: int
    law: Law


class Views(NamedTuple):
    """The named parts of a flat vector, see `Tables`."""

    A: np.ndarray
    G: np.ndarray
    R: np.ndarray
    B: np.ndarray
    D: np.ndarray
    H: np.ndarray
    S: np.ndarray
    ratio: np.ndarray
    law: np.ndarray
    LU: np.ndarray
    LS: np.ndarray
    LP: np.ndarray
    LG: np.ndarray


def layout(like: Tables) -> list[tuple[slice, tuple[int, ...]]]:
    """Return place and shape of each part of ``like.flat``."""
    parts, start = [], 1
    for name in Views._fields:
        part = getattr(like, name)
        parts.append((slice(start, start + part.size), part.shape))
        start += part.size
    return parts


def views(flat: np.ndarray, parts: list[tuple[slice, tuple[int, ...]]]) -> Views:
    """Return the parts of ``flat``, laid out by `layout`."""
    return Views(*[flat[place].reshape(shape) for place, shape in parts])


def is_surface(value: Affine) -> bool:
    """Return whether a guard is a surface: coordinates, and what moves them, only."""
    names = value.names
    return "u" in names and not names & {"s", "z", "lam"}


def is_stop(value: Affine) -> bool:
    """Return whether a guard is that of a speed: sliding that stops."""
    names = value.names
    return "s" in names and not names & {"u", "z", "lam"}


class Placed(NamedTuple):
    """A site in a frame: rows of an element, and how impulses meet it."""

    J: np.ndarray  # (rows, n)
    U: np.ndarray  # (rows, nx)
    S: np.ndarray  # (rows, nx)
    rest: np.ndarray  # (rows, nx) part of s' that is not J a
    X: np.ndarray  # (n, rows) M^-1 J^T


class Held(NamedTuple):
    """The rows a mode holds."""

    owners: list  # (element, Hold) of each
    J: np.ndarray  # (holds, n)
    D: np.ndarray  # (n, holds) J^T push
    solve: np.ndarray  # (holds, holds) (J M^-1 D)^-1
    lam: np.ndarray  # (holds, nx) multipliers
    fixed: list[int]  # coordinates that are held themselves, not in a combination


class Packer:
    """Fills the numbers of scene modes for one system."""

    def __init__(self, system: System, frame: Frame, slices: list[slice]):
        self.system, self.frame, self.slices = system, frame, slices
        M, C, K, _ = system.core
        n = system.n
        self.inverse = 1.0 / M if n == 1 else np.linalg.inv(M)
        if n > 1 and not np.any(M - np.diag(np.diagonal(M))):
            self.inverse = np.diag(1.0 / np.diagonal(M))
        self.core_rows = np.zeros((n, frame.nx))
        self.core_rows[:, :n] = -self.inverse @ K
        self.core_rows[:, n:2 * n] = -self.inverse @ C
        self.sites = [self._place(element) for element in system.elements]
        self._modes: dict[tuple[int, Hashable], Mode] = {}
        self._loads: dict[tuple[int, Hashable], np.ndarray | None] = {}

    def _place(self, element) -> Placed:
        site = element.site(self.system.n)
        U, S, rest = site.rows(self.frame)
        return Placed(site.R, U, S, rest, self.inverse @ site.R.T)

    def mode(self, element: int, key: Hashable) -> Mode:
        """Return a mode of an element, made once."""
        try:
            return self._modes[element, key]
        except KeyError:
            found = self._modes[element, key] = self.system.elements[element].mode(key, self.system.core)
        return found

    def reader(self, element: int, x: np.ndarray) -> Callable[[Affine], float]:
        """Return a function that gives the value of an expression of an element (without multipliers) at ``x`` (nx,)."""
        site = self.sites[element]
        local = {"u": site.U, "s": site.S, "z": self.frame.eye[self.slices[element]]}
        return lambda expression: float(self.frame.row(expression, local) @ x)

    def check(self, element: int, key: Hashable) -> None:
        """Raise ValueError unless a mode fits its site."""
        mode = self.mode(element, key)
        rows = len(self.sites[element].J)
        name = f"{self.system.labels[element]}, mode {key!r}"
        if not isinstance(mode, Mode):
            raise ValueError(f"{name}: mode(...) returned {mode!r}; it must be a Mode")
        if len(mode.entries) not in (0, rows):
            raise ValueError(f"{name}: force has {len(mode.entries)} entries; the site has {rows} rows")
        for hold in mode.hold:
            if not 0 <= hold.row < rows or len(hold.push) != rows:
                raise ValueError(f"{name}: {hold!r} does not fit a site of {rows} rows")
        if len(mode.memory) not in (0, len(self.system.elements[element].memory)):
            raise ValueError(f"{name}: memory has {len(mode.memory)} entries; the element names "
                             f"{len(self.system.elements[element].memory)}")
        for guard in mode.guards:
            if guard.kick is not None and not guard.kick.affine:
                raise ValueError(f"{name}: the kick {guard.kick!r} is not affine in the speeds; "
                                 "only affine ones can be composed")

    def slaved(self, keys: tuple) -> list[tuple[int, np.ndarray]]:
        """Return place and row (nx,) of every memory state that follows local values in the mode of these keys."""
        found = []
        for e, key in enumerate(keys):
            local = {"u": self.sites[e].U, "s": self.sites[e].S, "z": self.frame.eye[self.slices[e]]}
            for i, memory in enumerate(self.mode(e, key).memory):
                if isinstance(memory, Slaved):
                    found.append((self.slices[e].start + i, self.frame.row(memory.value, local)))
        return found

    def relaxed(self) -> list[tuple[int, np.ndarray]]:
        """Return place and row (nx,) of every memory state that has a relaxed value other than zero."""
        found = []
        for e, element in enumerate(self.system.elements):
            local = {"u": self.sites[e].U, "s": self.sites[e].S}
            for i, value in enumerate(element.relaxed):
                found.append((self.slices[e].start + i, self.frame.row(value, local)))
        return found

    def independent(self, keys: tuple) -> bool:
        """Return whether the rows held by all elements together are independent."""
        H, D, _ = self._held(keys)
        if len(H) <= 1:
            return True
        gram = H @ self.inverse @ D
        scale = np.sqrt(np.abs(np.diagonal(H @ self.inverse @ H.T)))
        other = np.sqrt(np.abs(np.diagonal(D.T @ self.inverse @ D)))
        return bool(np.linalg.svd(gram / np.outer(scale, other), compute_uv=False)[-1] > RANK)

    def laws(self, all_keys: list[tuple]) -> tuple[SceneLaw, ...]:
        """Return the laws that act in any of the modes, in the order they are met."""
        places = dict.fromkeys((e, key) for keys in all_keys for e, key in enumerate(keys))
        return tuple(SceneLaw(e, self.system.labels[e], key, len(self.sites[e].J), law)
                     for e, key in places if (law := self.mode(e, key).law) is not None)

    def _held(self, keys: tuple) -> tuple[np.ndarray, np.ndarray, list]:
        """Return held rows J (holds, n), pushes J^T push (n, holds), and the (element, hold) pairs."""
        owners = [(e, hold) for e, key in enumerate(keys) for hold in self.mode(e, key).hold]
        J, D = np.empty((len(owners), self.frame.n)), np.empty((self.frame.n, len(owners)))
        for i, (e, hold) in enumerate(owners):
            J[i] = self.sites[e].J[hold.row]
            D[:, i] = hold.push @ self.sites[e].J
        return J, D, owners

    def fill(self, flat: np.ndarray, T: Views, all_keys: list[tuple], laws: tuple[SceneLaw, ...]) -> None:
        """Write the numbers of all modes into ``flat`` through its views."""
        flat[0] = 0.0 if self.system.omega is None else self.system.omega
        row = value = 0
        for law in laws:
            site, own = self.sites[law.element], self.mode(law.element, law.key).law
            values = () if own is None else own.values
            T.LU[row:row + law.rows] = site.U
            T.LS[row:row + law.rows] = site.S
            T.law[value:value + len(values)] = values
            row += law.rows
            value += len(values)
        n, ns, eye = self.frame.n, self.frame.ns, self.frame.eye
        T.A[:, :n, n:2 * n] = eye[:n, :n]
        T.A[:, n:2 * n] = self.core_rows
        T.R[:, :, :, :ns] = eye[:ns, :ns]
        for m, keys in enumerate(all_keys):
            self._fill_mode(T, m, keys, laws)

    def _fill_mode(self, T: Views, m: int, keys: tuple, laws: tuple[SceneLaw, ...]) -> None:
        frame, n = self.frame, self.frame.n
        free = T.A[m, n:2 * n]
        for e, key in enumerate(keys):
            load = self._load(e, key)
            if load is not None:
                free += load
        hold = self._eliminate(T, m, keys)
        g = 0
        for e, key in enumerate(keys):
            mode, site = self.mode(e, key), self.sites[e]
            if not (mode.guards or mode.hold or mode.memory):
                continue
            own = [i for i, (owner, _) in enumerate(hold.owners) if owner == e]
            local = {"u": site.U, "s": site.S, "lam": hold.lam[own], "z": frame.eye[self.slices[e]]}
            for i in own:
                if hold.owners[i][1].surface is not None:
                    T.S[m, i] = frame.row(hold.owners[i][1].surface, local)
            for i, memory in enumerate(mode.memory):
                if isinstance(memory, Rate):
                    T.A[m, self.slices[e].start + i] = frame.row(memory.value, local)
            for guard in mode.guards:
                T.G[m, g] = frame.row(guard.value, local)
                self._fill_reset(T, m, g, e, mode, guard, local)
                if laws and own:
                    weights = np.array([guard.value.terms.get(("lam", k), 0.0) for k in range(len(own))])
                    T.LG[m, g] = weights @ self._reaction(hold, own, keys, laws)
                g += 1
        row = 0
        for law in laws:
            if keys[law.element] == law.key:
                push = self.sites[law.element].X
                if hold.owners:
                    push = push - self.inverse @ (hold.D @ (hold.solve @ (hold.J @ push)))
                    push[hold.fixed] = 0.0
                T.LP[m, row:row + law.rows, :n] = push.T
            row += law.rows

    def _eliminate(self, T: Views, m: int, keys: tuple) -> "Held":
        """Take the held rows out of the accelerations of mode ``m``; return multipliers and projection."""
        J, D, owners = self._held(keys)
        if not owners:
            return Held(owners, J, D, EMPTY, EMPTY, [])
        free = T.A[m, self.frame.n:2 * self.frame.n]
        sites = [(self.sites[e], hold.row) for e, hold in owners]
        X = self.inverse @ D
        solve = 1.0 / (J @ X) if len(owners) == 1 else np.linalg.inv(J @ X)
        rest = np.array([site.rest[row] for site, row in sites])
        lam = -solve @ (J @ free + rest)
        free += X @ lam
        fixed = []
        for i, row in enumerate(J):  # a held coordinate stays exactly: no rounding is left in its acceleration
            places = row.nonzero()[0]
            if places.size == 1:
                fixed.append(places[0])
                free[places[0]] = 0.0 - rest[i] / row[places[0]]
        T.H[m, :len(owners)] = [site.S[row] for site, row in sites]
        return Held(owners, J, D, solve, lam, fixed)

    def _reaction(self, hold: "Held", own: list[int], keys: tuple, laws: tuple[SceneLaw, ...]) -> np.ndarray:
        """Return own multipliers by unit forces of all laws, (own, rows of laws)."""
        meets = -hold.solve[own] @ hold.J
        return np.hstack([meets @ self.sites[law.element].X * (keys[law.element] == law.key) for law in laws])

    def _load(self, e: int, key: Hashable) -> np.ndarray | None:
        """Return the accelerations by the affine force of an element, (n, nx); None when it gives none."""
        if (e, key) not in self._loads:
            force, site = self.mode(e, key).entries, self.sites[e]
            load = None
            if force:
                local = {"u": site.U, "s": site.S, "z": self.frame.eye[self.slices[e]]}
                rows = [self.frame.row(entry, local) for entry in force]
                load = site.X * rows[0] if len(rows) == 1 else site.X @ np.array(rows)
            self._loads[e, key] = load
            return load
        return self._loads[e, key]

    def _fill_reset(self, T: Views, m: int, g: int, e: int, mode: Mode, guard: Guard, local: dict) -> None:
        """Write the state after a guard: identity, position on the surface, kick, memory of the mode that is left."""
        n, ns = self.frame.n, self.frame.ns
        site, row, R = self.sites[e], T.G[m, g], T.R[m, g]
        surface = is_surface(guard.value) and row[:n].any()  # a driven row has no coordinate to put right
        if surface:
            direction = self.inverse @ row[:n]
            direction /= row[:n] @ direction
            T.D[m, g, :n] = direction
            R[:n] -= direction[:, None] * row
        elif is_stop(guard.value) and row[n:2 * n].any():  # rounding must leave no speed that stick would break on
            direction = self.inverse @ row[n:2 * n]
            direction /= row[n:2 * n] @ direction
            T.D[m, g, n:2 * n] = direction
            R[n:2 * n] -= direction[:, None] * row
        if guard.kick is not None:
            W = site.J @ site.X
            constant, slope = guard.kick.impulse(np.zeros(len(W)), W)
            P = slope @ site.S
            P[:, ns] += constant
            R[n:2 * n] += site.X @ P
            direction = site.X[:, 0]
            if len(W) > 1:
                end = None if guard.accumulates is None else self.mode(e, guard.accumulates[1])
                direction = site.X @ (end.hold[0].push if end and end.hold else slope @ site.J @ row[:n])
            slope_of = row[:n] if surface else row[:n] + row[n:2 * n] @ T.A[m, n:2 * n, n:2 * n]
            T.B[m, g, n:2 * n] = direction / (slope_of @ direction)
        if guard.accumulates is not None:
            T.ratio[m, g] = guard.accumulates[0]
        for i, memory in enumerate(mode.memory):
            if isinstance(memory, Slaved):
                R[self.slices[e].start + i] = self.frame.row(memory.value, local)
