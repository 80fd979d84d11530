"""Numbers of a scene: local expressions of elements become rows of the joined vector, held rows are eliminated.

One file, because it is one packer: rows of forces, guards, jumps and held rows are eliminated with the same factors.
"""
import itertools
from collections.abc import Callable, Hashable, Iterable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..elements import Affine, Algebraic, Circle, Frame, Guard, Law, Mode, Rate, Rows, WatchedCore
from ..elements.friction.together import mode_of
from ..system import System
from . import pieces as parts
from .jointly import Resting, joint_guards, resting
from .pieces import Piece, SceneLaw
from .tables import Tables

EMPTY = np.empty((0, 0))
RANK = 1e-12  # held rows whose normalised Gram matrix has a smaller singular value are dependent
REFINED = 3  # times that speeds are put to rest: each leaves of them what a light mass beside a heavy one makes of rounding
CANCELLED = 4e-15  # of what a number is the sum of, below which it is the rounding of a zero


class DependentHolds(ValueError):
    """A combination of modes holds rows that depend on each other."""


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


def cancelled(values, sizes):
    """Return the ``values`` without those that are rounding of the terms, of ``sizes`` together, whose sum they are.

    What holds cancel would else be a number that no parameter changes smoothly.
    """
    return np.where(np.abs(values) <= CANCELLED * sizes, 0.0, values)


def determined(J):
    """Return the coordinates that held rows ``J`` (holds, n) determine, and how they move with the rows (coordinates, holds).

    A row of one coordinate does, or of one beside others that are determined; as many rows as coordinates determine all.
    """
    holds, n = J.shape
    if holds == n:
        return list(range(n)), np.linalg.inv(J)
    if not (np.count_nonzero(J, axis=1) == 1).any():
        return [], np.zeros((0, holds))
    fixed: dict[int, np.ndarray] = {}
    for _ in range(holds):
        known = len(fixed)
        for k, row in enumerate(J):
            places = [int(c) for c in row.nonzero()[0] if int(c) not in fixed]
            if len(places) == 1:
                others = sum((row[c] * moves for c, moves in fixed.items()), np.zeros(holds))
                fixed[places[0]] = (np.eye(holds)[k] - others) / row[places[0]]
        if len(fixed) == known:
            break
    return list(fixed), np.array(list(fixed.values())).reshape(-1, holds)


def scaled_inverse(M):
    """Return the inverse of a mass matrix, in units in which each mass is about 1: pivots compare like with like."""
    unit = 2.0 ** -np.round(0.5 * np.log2(np.diagonal(M)))
    return np.linalg.inv(M * np.outer(unit, unit)) * np.outer(unit, unit)


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


def is_surface(value) -> bool:
    """Return whether a guard is an affine surface: coordinates, and what moves them, only."""
    if not isinstance(value, Affine):
        return False
    names = value.names
    return "u" in names and not names & {"s", "z", "lam"}


def is_stop(value) -> bool:
    """Return whether an affine guard is that of a speed: sliding that stops."""
    if not isinstance(value, Affine):
        return False
    names = value.names
    return "s" in names and not names & {"u", "z", "lam"}


def unmoved(R, direction, row):
    """Return the rows ``R`` (n, nx) without what moves ``row`` (nx,) along the ``direction`` (n,)."""
    moved = direction[:, None] * row
    return cancelled(R - moved, np.abs(R) + np.abs(moved))


class Placed(NamedTuple):
    """A site in a frame: rows of an element, and how impulses meet it."""

    site: Rows
    J: np.ndarray  # (rows, n)
    U: np.ndarray  # (rows, nx)
    S: np.ndarray  # (rows, nx)
    rest: np.ndarray  # (rows, nx) part of s' that is not J a
    X: np.ndarray  # (n, rows) M^-1 J^T
    curved: bool  # a circle: rows are those of the plane, and every expression is a law


class Block(NamedTuple):
    """Values of a law in a mode of its element, in the tables' ``law``."""

    law: int  # number of the law
    key: Hashable
    beside: tuple[tuple[int, Hashable], ...]  # elements whose straight rows are held with a row of a circle on the same masses
    first: int
    end: int


class Held(NamedTuple):
    """The rows a mode holds."""

    owners: list  # (element, Hold) of each
    J: np.ndarray  # (holds, n)
    D: np.ndarray  # (n, holds) J^T push
    solve: np.ndarray  # (holds, holds) (J M^-1 D)^-1
    lam: np.ndarray  # (holds, nx) multipliers
    fixed: list[int]  # coordinates that the rows determine, see `determined`


class Packer:
    """Fills the numbers of scene modes for one system, in which these contacts rest ``together`` (`friction.together`), and
    where there are ``joints`` those that depend on each other jointly (`friction.joint`)."""

    def __init__(self, system: System, frame: Frame, slices: list[slice], together: tuple[tuple[int, float], ...], joints: tuple):
        self.system, self.frame, self.slices, self.together, self.joints = system, frame, slices, together, joints
        self.core = WatchedCore(system.core)
        M, C, K, _ = system.core
        n = system.n
        self.inverse = 1.0 / M if n == 1 else scaled_inverse(M)
        if n > 1 and not np.any(M - np.diag(np.diagonal(M))):
            self.inverse = np.diag(1.0 / np.diagonal(M))
        self.core_rows = np.zeros((n, frame.nx))
        self.core_rows[:, :n] = -self.inverse @ K
        self.core_rows[:, n:2 * n] = -self.inverse @ C
        self.sites = [self._place(element) for element in system.elements]
        self._modes: dict[tuple[int, Hashable], Mode] = {}
        self._loads: dict[tuple[int, Hashable], np.ndarray | None] = {}
        self._pieces: dict[tuple[int, Hashable, tuple], list[Piece]] = {}
        self._laws: dict[tuple[int, Hashable, tuple], dict[tuple, tuple[SceneLaw, Piece]]] = {}
        self._resting: dict[tuple, Resting] = {}
        self.carries: dict[tuple, tuple[tuple[int, Hashable], ...]] = {}  # see `jointly.carried`

    @property
    def reads_omega(self) -> bool:
        """Whether anything that was packed follows the frequency, but the frequency itself."""
        return self.core.read or self.frame.read

    def _place(self, element) -> Placed:
        site = element.site(self.system.n)
        U, S, rest = site.rows(self.frame)
        return Placed(site, site.R, U, S, rest, self.inverse @ site.R.T, isinstance(site, Circle))

    def mode(self, element: int, key: Hashable) -> Mode:
        """Return a mode of an element, made once."""
        try:
            return self._modes[element, key]
        except KeyError:
            found = self._modes[element, key] = mode_of(self.system, self.together, element, key, self.core)
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
            if guard.kick is not None and not isinstance(guard.kick, Law) and (not guard.kick.affine or self.sites[element].curved):
                raise ValueError(f"{name}: the impact law {guard.kick!r} is not affine in the speeds; "
                                 "only affine ones on straight sites can be composed; give a Law of the impulses instead")

    def algebraic(self, keys: tuple) -> list[tuple[int, np.ndarray]]:
        """Return place and row (nx,) of every memory state that follows local values in the mode of these keys."""
        return [item for e, key in enumerate(keys) for item in self._algebraic(e, key)]

    def _algebraic(self, e: int, key: Hashable) -> list[tuple[int, np.ndarray]]:
        local = {"u": self.sites[e].U, "s": self.sites[e].S, "z": self.frame.eye[self.slices[e]]}
        return [(self.slices[e].start + i, self.frame.row(memory.value, local))
                for i, memory in enumerate(self.mode(e, key).memory) if isinstance(memory, Algebraic)]

    def virgin(self) -> list[tuple[int, np.ndarray]]:
        """Return place and row (nx,) of every memory state whose virgin value is other than zero."""
        found = []
        for e, element in enumerate(self.system.elements):
            local = {"u": self.sites[e].U, "s": self.sites[e].S}
            for i, value in enumerate(element.virgin):
                found.append((self.slices[e].start + i, self.frame.row(value, local)))
        return found

    @cached_property
    def meeting_circles(self) -> list[tuple[int, int]]:
        """Pairs of elements on circles of which a force on one accelerates the other; their reactions are not solved together."""
        curved = [e for e, site in enumerate(self.sites) if site.curved]
        return [(e, other) for e, other in itertools.combinations(curved, 2) if np.any(self.sites[e].J @ self.sites[other].X)]

    def independent(self, keys: tuple) -> bool:
        """Return whether the rows held by all elements together are independent, and of circles on one body one holds rows."""
        if any(self.mode(e, keys[e]).hold and self.mode(other, keys[other]).hold for e, other in self.meeting_circles):
            return False
        H, D, _ = self.held(enumerate(keys))
        if len(H) <= 1:
            return True
        gram = H @ self.inverse @ D
        scale = np.sqrt(np.abs(np.diagonal(H @ self.inverse @ H.T)))
        other = np.sqrt(np.abs(np.diagonal(D.T @ self.inverse @ D)))
        return bool(np.linalg.svd(gram / np.outer(scale, other), compute_uv=False)[-1] > RANK)

    def put_to_rest(self, keys: tuple, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``x`` (nx,) with velocities moved along M^-1 J^T push until the rows held by these keys have no speed.

        Also what its rounding is measured by (nx,): the sum of the sizes of all that was added.
        """
        owners = sorted([*self.held(enumerate(keys))[2], *((e, hold) for e, key in enumerate(keys) if self.sites[e].curved
                                                           for hold in self.mode(e, key).hold)], key=lambda owner: owner[0])
        held = [(hold, *self._met(e, x)) for e, hold in owners]
        y, sizes, n = x.copy(), np.abs(x), self.frame.n
        if held:
            J = np.array([rows[hold.row] for hold, rows, _ in held])
            X = self.inverse @ np.array([hold.push @ rows for hold, rows, _ in held]).T
            solve = np.linalg.inv(J @ X)
            impulses = solve @ [speeds[hold.row] for hold, _, speeds in held]
            for _ in range(REFINED):
                y[n:2 * n] -= X @ impulses
                sizes[n:2 * n] += np.abs(X) @ np.abs(impulses)
                impulses = solve @ [self._met(e, y)[1][hold.row] for e, hold in owners]
        return y, sizes

    def _met(self, element: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows (rows, n) of an element at ``x`` (nx,), radial and tangential on a circle, and their speeds (rows,)."""
        placed = self.sites[element]
        if not isinstance(circle := placed.site, Circle):
            return placed.J, placed.S @ x
        p = placed.U @ x - circle.centre
        away = np.hypot(*p)
        turned = np.array([[p[0], p[1]], [-p[1], p[0]]]) / away
        return turned @ placed.J, turned @ (placed.S @ x) + [0.0, circle.surface_speed + circle.spin * away]

    def still(self, keys: tuple) -> list[int]:
        """Return for every guard of a mode the derivative from which on it vanishes because rows are held; 0: none does.

        The speed of a contact on a row that another one holds stays what it is, to the last digit; so does how far a slider under
        it is from its limit, while its memory stands still.
        """
        found, (H, _, _) = [], self.held(enumerate(keys))
        for e, _, guard in self.guards(keys):
            mode, value, order = self.mode(e, keys[e]), guard.value, 0
            if isinstance(value, Affine) and len(H) and not self.moving(e, keys) and value.names <= {"u", "s", "z", "one"} \
                    and value.names & {"u", "s"} and all(
                        name != "z" or not mode.memory or mode.memory[i] is None for name, i in value.terms):
                order = 2 if "u" in value.names else 1
                for part in sorted(value.names & {"u", "s"}):
                    row = sum(weight * self.sites[e].J[i] for (name, i), weight in value.terms.items() if name == part)
                    left = row - np.linalg.lstsq(H.T, row, rcond=None)[0] @ H
                    if not np.abs(left).max() <= RANK * np.abs(row).max():
                        order = 0
            found.append(order)
        return found

    def moving(self, element: int, keys: tuple) -> bool:
        """Return whether the site of an element, or of one that holds a row, is curved or moves by more than a constant speed."""
        own = [element, *(e for e, key in enumerate(keys) if self.mode(e, key).hold)]
        return any(self.sites[e].curved or self.sites[e].rest.any() for e in own)

    def pieces(self, element: int, key: Hashable, beside: tuple = ()) -> list[Piece]:
        """Return what of a mode is not affine, made once; ``beside`` as in `Block`."""
        found = self._pieces.get((element, key, beside))
        if found is None:
            site, mode = self.sites[element], self.mode(element, key)
            found = self._pieces[element, key, beside] = [] if not (mode.force or mode.guards or mode.hold) else parts.pieces(
                site.site, mode, f"{self.system.labels[element]}, mode {key!r}", self._meets(element, beside))
        return found

    def _meets(self, element: int, beside: tuple) -> np.ndarray:
        """Return what forces on the rows of an element give to their accelerations (rows, rows), while others hold theirs."""
        site = self.sites[element]
        W = site.J @ site.X
        if not beside:
            return W
        J, D, _ = self.held(beside)
        taken = (site.J @ self.inverse @ D) @ np.linalg.solve(J @ self.inverse @ D, J @ site.X)
        return cancelled(W - taken, np.abs(W) + np.abs(taken))

    def blocks(self, all_keys: list[tuple], laws: tuple[SceneLaw, ...]) -> list[Block]:
        """Return where the values of laws stand: for all their modes by themselves, then beside what others hold."""
        wanted: list[tuple[int, Hashable, tuple]] = [(i, key, ()) for i, law in enumerate(laws) for key in law.keys]
        wanted += [(i, keys[law.element], beside) for keys in all_keys for i, law in enumerate(laws)
                   if keys[law.element] in law.keys and (beside := self.beside(law.element, keys))]
        found: list[Block] = []
        first = 0
        for i, key, beside in dict.fromkeys(wanted):
            found.append(Block(i, key, beside, first, first := first + len(laws[i].law.values)))
        return found

    def beside(self, element: int, keys: tuple) -> tuple[tuple[int, Hashable], ...]:
        """Return the elements with straight rows that are held on masses where an element holds one of a circle; see `Block`."""
        site = self.sites[element]
        if not site.curved or not self.mode(element, keys[element]).hold:
            return ()
        others = tuple((e, key) for e, key in enumerate(keys) if not self.sites[e].curved and self.mode(e, key).hold)
        return others if np.any(self.held(others)[0] @ site.X) else ()

    def acts(self, keys: tuple, laws: tuple[SceneLaw, ...], first: dict[tuple, int]) -> list[int]:
        """Return 1 + the place of the values of every law in the mode of these keys; 0 where it does not act.

        ``first`` gives the places of the `Block`s by law, key and what is held beside.
        """
        return [1 + first[i, keys[law.element], self.beside(law.element, keys)] if keys[law.element] in law.keys else 0
                for i, law in enumerate(laws)]

    def laws(self, modes: Iterable[tuple[int, Hashable]]) -> tuple[SceneLaw, ...]:
        """Return the laws of some modes of elements, (element, key) each: forces, reactions, guards, in the order given."""
        return parts.joined([law for e, key in dict.fromkeys(modes) for law, _ in self._scene_laws(e, key).values()])

    def _scene_laws(self, e: int, key: Hashable, beside: tuple = ()) -> dict[tuple, tuple[SceneLaw, Piece]]:
        """Return the laws of one mode of an element with their pieces, by `SceneLaw.group`; made once."""
        found = self._laws.get((e, key, beside))
        if found is None:
            found = self._laws[e, key, beside] = {}
            for piece in self.pieces(e, key, beside):
                what = Law(piece.function, piece.values, piece.jacobian)
                law = SceneLaw(e, self.system.labels[e], (key,), len(self.sites[e].J), what, piece.stage, 0, piece.curved)
                while law.group in found:
                    law = law._replace(slot=law.slot + 1)
                found[law.group] = law, piece
        return found

    def acting(self, law: SceneLaw, keys: tuple) -> Piece | None:
        """Return the piece that a law of the scene is in the mode of these keys; None where it does not act."""
        key = keys[law.element]
        return self._scene_laws(law.element, key)[law.group][1] if key in law.keys else None

    @cached_property
    def frictions(self) -> list[int]:
        """Elements that hold a row by a set-valued law, of those that rest together the first; none where nothing rests jointly."""
        return [e for e, element in enumerate(self.system.elements) if self.joints and self.together[e][0] == e
                and any(self.mode(e, key).bounds for key in element.start)]

    def guards(self, keys: tuple) -> list[tuple[int, int, Guard]]:
        """Return element, number and meaning of every guard of a mode; contacts that rest jointly have theirs at the end."""
        found = [(e, number, guard) for e, key in enumerate(keys) for number, guard in enumerate(self.mode(e, key).guards)]
        if not self.joints:
            return found
        rests, owners = self._rests(enumerate(keys))
        jointly = {owners[i][0] for places, _ in rests.groups for i in places}
        return [one for one in found if not (one[0] in jointly and isinstance(one[2].value, Affine) and "lam" in one[2].value.names)
                ] + joint_guards(self, keys, owners, rests)

    def _rests(self, modes: Iterable[tuple[int, Hashable]]) -> tuple[Resting, list]:
        """Return which straight rows that (element, key) hold rest jointly, and the (element, hold) pairs of all."""
        modes = tuple(modes)
        owners = [(e, hold) for e, key in modes if not self.sites[e].curved for hold in self.mode(e, key).hold]
        if modes not in self._resting:
            self._resting[modes] = resting(self, owners)
        return self._resting[modes], owners

    def held(self, modes: Iterable[tuple[int, Hashable]]) -> tuple[np.ndarray, np.ndarray, list]:
        """Return straight rows J (holds, n) that (element, key) hold, pushes J^T push (n, holds), and the (element, hold) pairs.

        Of rows that rest jointly those that hold the others too.
        """
        if self.joints:
            rests, owners = self._rests(modes)
            owners = [owner for i, owner in enumerate(owners) if i not in rests.redundant]
        else:
            owners = [(e, hold) for e, key in modes if not self.sites[e].curved for hold in self.mode(e, key).hold]
        J, D = np.empty((len(owners), self.frame.n)), np.empty((self.frame.n, len(owners)))
        for i, (e, hold) in enumerate(owners):
            J[i] = self.sites[e].J[hold.row]
            D[:, i] = hold.push @ self.sites[e].J
        return J, D, owners

    def fill(self, flat: np.ndarray, T: Views, all_keys: list[tuple], laws: tuple[SceneLaw, ...], blocks: list[Block],
             first: int = 0) -> None:
        """Write the numbers of all modes, from the mode ``first`` on, into ``flat`` through its views."""
        flat[0] = 0.0 if self.system.omega is None else self.system.omega
        row = 0
        for law in laws:
            site = self.sites[law.element]
            T.LU[row:row + law.rows] = site.U
            T.LS[row:row + law.rows] = site.S
            row += law.rows
        for block in blocks:
            law = laws[block.law]
            T.law[block.first:block.end] = self._scene_laws(law.element, block.key, block.beside)[law.group][1].values
        n, ns, eye = self.frame.n, self.frame.ns, self.frame.eye
        T.A[:, :n, n:2 * n] = eye[:n, :n]
        T.A[:, n:2 * n] = self.core_rows
        T.R[:, :, :, :ns] = eye[:ns, :ns]
        for m in range(first, len(all_keys)):
            self._fill_mode(T, m, all_keys[m], laws)

    def _fill_mode(self, T: Views, m: int, keys: tuple, laws: tuple[SceneLaw, ...]) -> None:
        frame = self.frame
        n = frame.n
        loads = [load for e, key in enumerate(keys) if (load := self._load(e, key)) is not None]
        hold = self._eliminate(T, m, keys, loads)
        guards = {(e, number): (g, guard) for g, (e, number, guard) in enumerate(self.guards(keys))}
        for e, key in enumerate(keys):
            mode, site = self.mode(e, key), self.sites[e]
            if not (mode.guards or mode.hold or mode.memory):
                continue
            own = [i for i, (owner, _) in enumerate(hold.owners) if owner == e]
            local = {"u": site.U, "s": site.S, "lam": hold.lam[own], "z": frame.eye[self.slices[e]]}
            watched = {piece.guard for piece in self.pieces(e, key) if piece.stage == parts.GUARD}
            for i in own:
                if hold.owners[i][1].surface is not None:
                    T.S[m, i] = frame.row(hold.owners[i][1].surface, local)
            for i, memory in enumerate(mode.memory):
                if isinstance(memory, Rate):
                    T.A[m, self.slices[e].start + i] = frame.row(memory.value, local)
            for number in range(len(mode.guards)):
                if (e, number) not in guards:
                    continue
                g, guard = guards.pop((e, number))
                if number in watched:
                    self._fill_watched(T, m, g, e, number, keys, laws)
                else:
                    T.G[m, g] = frame.row(guard.value, local)
                self._fill_reset(T, m, g, e, mode, guard, hold, keys)
                if laws and own and isinstance(guard.value, Affine):
                    self._fill_reaction(T, m, g, guard.value, hold, own, keys, laws)
        for (e, _), (g, guard) in guards.items():
            T.G[m, g] = frame.row(guard.value, {"lam": hold.lam})
            self._fill_reset(T, m, g, e, self.mode(e, keys[e]), guard, hold, keys)
            if laws and isinstance(guard.value, Affine):
                self._fill_reaction(T, m, g, guard.value, hold, list(range(len(hold.owners))), keys, laws)
        row = 0
        for law in laws:
            if law.stage != parts.GUARD and self.acting(law, keys):
                push = self.sites[law.element].X
                if hold.owners and law.stage != parts.KICK:
                    for _ in range(2):  # the second takes away what rounding of the first has left
                        push = push - self.inverse @ (hold.D @ (hold.solve @ (hold.J @ push)))
                    push[hold.fixed] = 0.0
                if law.stage == parts.REST:  # how the coordinates move for the rows to move by one, as far as others let them
                    push = push @ np.linalg.pinv(self.sites[law.element].J @ push)
                T.LP[m, row:row + law.rows, :n] = push.T
            row += law.rows

    def _eliminate(self, T: Views, m: int, keys: tuple, loads: list[np.ndarray]) -> "Held":
        """Add the ``loads`` (n, nx) to the accelerations of mode ``m`` without what the held rows take up; return the multipliers.

        Each load loses it for itself: what one along a held row leaves is zero, not its rounding in the sum with others, that
        may be far smaller.
        """
        J, D, owners = self.held(enumerate(keys))
        free = T.A[m, self.frame.n:2 * self.frame.n]
        if not owners:
            for load in loads:
                free += load
            return Held(owners, J, D, EMPTY, EMPTY, [])
        sites = [(self.sites[e], hold.row) for e, hold in owners]
        X = self.inverse @ D
        solve = 1.0 / (J @ X) if len(owners) == 1 else np.linalg.inv(J @ X)
        rest = np.array([site.rest[row] for site, row in sites])
        terms = np.array([self.core_rows, *loads])
        sizes = np.abs(solve) @ (np.abs(J) @ np.abs(terms))
        taken, moved = cancelled(-solve @ (J @ terms), sizes), solve @ rest
        lam = cancelled(taken.sum(axis=0) - moved, sizes.sum(axis=0) + np.abs(moved))
        alone = [(i, int(places[0])) for i, row in enumerate(J) if (places := row.nonzero()[0]).size == 1]
        fixed, moves = ([place for _, place in alone], None) if len(alone) == len(owners) else determined(J)
        if len(fixed) < self.frame.n:
            left = cancelled(terms + X @ taken, np.abs(terms) + np.abs(X) @ np.abs(taken))
            free[:] = left.sum(axis=0) - X @ moved
        if moves is None:  # a held coordinate stays exactly: no rounding is left in its acceleration
            for i, place in alone:
                free[place] = 0.0 - rest[i] / J[i, place]
        else:
            free[fixed] = 0.0 - moves @ rest
            if len(fixed) < self.frame.n:  # nor in that of a light mass beside a heavy one, of which little is left
                free -= np.where(free, X @ (solve @ (J @ free + rest)), 0.0)
        T.H[m, :len(owners)] = [site.S[row] for site, row in sites]
        return Held(owners, J, D, solve, lam, fixed)

    def _reaction(self, hold: "Held", own: list[int], keys: tuple, laws: tuple[SceneLaw, ...]) -> np.ndarray:
        """Return own multipliers by unit forces of all laws, (own, rows of laws)."""
        meets = -hold.solve[own] @ hold.J
        return np.hstack([meets @ self.sites[law.element].X * (law.stage <= parts.REACTION and keys[law.element] in law.keys)
                          for law in laws])

    def _fill_reaction(self, T: Views, m: int, g: int, value: Affine, hold: "Held", own: list[int], keys: tuple,
                       laws: tuple[SceneLaw, ...]) -> None:
        """Write how forces of laws change guard ``g`` through the multipliers of the rows ``own``."""
        weights = np.array([value.terms.get(("lam", k), 0.0) for k in range(len(own))])
        T.LG[m, g] = weights @ self._reaction(hold, own, keys, laws)

    def _fill_watched(self, T: Views, m: int, g: int, e: int, number: int, keys: tuple, laws: tuple[SceneLaw, ...]) -> None:
        """Make guard ``g`` the value of its law."""
        row = 0
        for law in laws:
            if law.element == e and law.stage == parts.GUARD:
                piece = self.acting(law, keys)
                if piece is not None and piece.guard == number:
                    T.LG[m, g, row] = 1.0
            row += law.rows

    def _load(self, e: int, key: Hashable) -> np.ndarray | None:
        """Return the accelerations by the affine force of an element, (n, nx); None when it gives none."""
        if (e, key) not in self._loads:
            force, site = self.mode(e, key).entries, self.sites[e]
            load = None
            if force and not site.curved:
                local = {"u": site.U, "s": site.S, "z": self.frame.eye[self.slices[e]]}
                rows = [self.frame.row(entry, local) for entry in force]
                load = site.X * rows[0] if len(rows) == 1 else site.X @ np.array(rows)
            self._loads[e, key] = load
            return load
        return self._loads[e, key]

    def _fill_reset(self, T: Views, m: int, g: int, e: int, mode: Mode, guard: Guard, hold: "Held", keys: tuple) -> None:
        """Write the state after a guard: identity, position on the surface, kick, memory of the modes that are left.

        A kick may turn other elements round in the same instant: the memory of all is written.
        """
        n, ns = self.frame.n, self.frame.ns
        site, row, R = self.sites[e], T.G[m, g], T.R[m, g]
        surface = is_surface(guard.value) and row[:n].any()  # a driven row has no coordinate to put right
        if surface:
            direction = self._beside(hold, row[:n])
            T.D[m, g, :n] = direction
            R[:n] = unmoved(R[:n], direction, row)
        elif is_stop(guard.value) and row[n:2 * n].any():  # rounding must leave no speed that stick would break on
            direction = self._beside(hold, row[n:2 * n])
            T.D[m, g, n:2 * n] = direction
            R[n:2 * n] = unmoved(R[n:2 * n], direction, row)
        if guard.kick is not None and not isinstance(guard.kick, Law):
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
        for place, value in self.algebraic(keys) if guard.kick is not None else self._algebraic(e, keys[e]):
            R[place] = value
        if guard.reset:
            local = {"u": site.U, "s": site.S, "z": self.frame.eye[self.slices[e]]}
            R[self.slices[e]] = [self.frame.row(value, local) for value in guard.reset]

    def _beside(self, hold: "Held", row: np.ndarray) -> np.ndarray:
        """Return the direction (n,) that changes ``row`` (n,) by 1 and no held row, by inertia; zeros where there is none."""
        direction = self.inverse @ row
        if hold.owners:
            size = row @ direction
            drawn = self.inverse @ (hold.D @ (hold.solve @ (hold.J @ direction)))
            direction = cancelled(direction - drawn, np.abs(direction) + np.abs(drawn))
            direction[hold.fixed] = 0.0
            if not row @ direction > RANK * size:
                return np.zeros(len(row))
        return direction / (row @ direction)
