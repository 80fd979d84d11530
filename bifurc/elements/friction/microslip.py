"""Sets of elastic sliders that act as one: parallel (Iwan) and along an elastic bar or ring (micro-slip).

Under constant limits and one driven coordinate the sliders of such a set slip in a fixed order after every reversal, the
order of the virgin curve: the stiffness matrix of the stuck rest is an M-matrix, so that no slider stops before the drive
does (Masing 1926; specs: Zhao & Lin 2015, sections 2 and 3, derived again).  A mode is therefore a direction and how many
groups of sliders slip: 2 n + 1 modes with two guards each instead of 3^n, and a reversal is one event.

Memory that no drive leaves (of other limits, or as somebody gave it) breaks that order.  What starts with such has modes that name
the sliders that slip, with the guards of all that stick; when the drive turns in order again, or all slip, the usual ones follow.

One file, because order, modes, words and the two sets are one statics.
"""
import dataclasses
import functools
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from ...checks import number
from ..kinds import EventKind
from ..local import ONE, Affine, s
from ..mode import Algebraic, Guard, Mode
from .sliders import Sliders

STICK = "stick"
STUCK = "s"
TURNED = str.maketrans("+-", "-+")
TIES = 1e-10  # of the drive: sliders whose turns differ by less slip together
DISORDER = 1e-9  # of the lengths in it: memory so far from its order is in order
CLOSE = 1e-11  # of the limit: sliders so near to theirs are at it


class Response(NamedTuple):
    """Positions of the sliders' places while some slip: x = drive u + held w + pushed f; force on the drive likewise."""

    drive: np.ndarray  # (n,)
    held: np.ndarray  # (n, n) by memory of the stuck; zero columns of the others
    pushed: np.ndarray  # (n, n) by the forces of the slipping
    force_drive: float
    force_held: np.ndarray  # (n,)
    force_pushed: np.ndarray  # (n,)


@dataclass(frozen=True, kw_only=True)
class SliderSet(Sliders):
    """Sliders with constant limits that one row drives; what a set must define is `stiffness_of` and `response`.

    Modes: "stick", and "slip+k", "slip-k": the first k groups of `order` slip in that direction; from memory that is not
    `ordered` a word with one letter a slider, "s" sticks, "+" and "-" slip.  The memory holds the positions of the sliders, each
    where its spring would carry no force.

    Attributes
    ----------
    order : tuple of tuple of int
        Groups of sliders in the order in which they slip on virgin loading; those without a limit are in none.
    """

    @property
    def start(self):
        """Keys of a start."""
        return (STICK, *(f"slip{sign}{k}" for k in range(1, len(self.order) + 1) for sign in "+-"))

    @property
    def structure(self):
        """Class, number of sliders, which of them have a limit, number of groups."""
        fields = {field.name for field in dataclasses.fields(self)} - {"label", *self.tuples, *super().parameters}
        present = tuple(limit > 0.0 for limit in self.limits)
        return (type(self), *(getattr(self, name) for name in sorted(fields)), present, len(self.order))

    def stiffness_of(self, slider: int) -> float:
        """Return the stiffness of the spring of a slider, force per length."""
        raise NotImplementedError

    def response(self, slips: tuple[int, ...]) -> Response:
        """Return where the places of the sliders are while those of ``slips`` slip."""
        raise NotImplementedError

    def loading(self, slips: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        """Return slope and rest of the places (n,), and of the force, on virgin loading while those of ``slips`` slip."""
        now, limits = self.response(slips), np.array(self.limits)
        return now.drive, now.pushed @ limits, (now.force_drive, float(now.force_pushed @ limits))

    @functools.cached_property
    def order(self) -> tuple[tuple[int, ...], ...]:
        """Groups of sliders in the order of virgin loading."""
        return tuple(group for group, _ in self._virgin)

    @functools.cached_property
    def thresholds(self) -> np.ndarray:
        """Drive at which each group of `order` starts to slip on virgin loading, length."""
        return np.array([drive for _, drive in self._virgin])

    @functools.cached_property
    def _virgin(self) -> list[tuple[tuple[int, ...], float]]:
        slips: tuple[int, ...] = ()
        left = [i for i, limit in enumerate(self.limits) if limit > 0.0]
        reach = np.array([self.limits[i] / self.stiffness_of(i) for i in range(self.count)])
        found = []
        while left:
            drive, rest, _ = self.loading(slips)
            with np.errstate(divide="ignore"):  # a place that the drive does not move any more never slips
                turns = (reach[left] - rest[left]) / drive[left]
            first = turns.min()
            if not np.isfinite(first):
                break
            group = tuple(i for i, turn in zip(left, turns, strict=True) if turn <= first * (1.0 + TIES))
            found.append((group, float(first)))
            slips += group
            left = [i for i in left if i not in group]
        return found

    @property
    def unordered(self):
        """Word of a start with memory that is not `ordered`: all stick."""
        return STUCK * self.count

    @functools.cached_property
    def _room(self) -> tuple[np.ndarray, np.ndarray]:
        """W and c of |W z| <= c: every slider turns after those before it in `order`, whichever way the drive goes."""
        rows, room = [], []
        slips: tuple[int, ...] = ()
        for group, threshold in zip(self.order, self.thresholds, strict=True):
            now, first = self.response(slips), group[0]
            turns = (np.eye(self.count) - now.held) / np.where(now.drive != 0.0, now.drive, np.inf)[:, None]
            for i in sorted({j for later in self.order for j in later} - {first, *slips}):
                if now.drive[i] != 0.0:
                    reach = self.limits[i] / self.stiffness_of(i) - now.pushed[i] @ np.array(self.limits)
                    rows.append(turns[i] - turns[first])
                    room.append(max(reach / now.drive[i] - threshold, 0.0))
            slips += group
        return np.array(rows).reshape(-1, self.count), np.array(room)

    def virgin_force(self, drive) -> np.ndarray:
        """Return the force for a drive that grows from the virgin state, same shape as ``drive`` (at least 0)."""
        drive = np.asarray(drive, float)
        index = np.searchsorted(self.thresholds, drive, side="right")
        lines = np.array([self.loading(sum(self.order[:k], ()))[2] for k in range(len(self.order) + 1)])
        return lines[index, 0] * drive + lines[index, 1]

    def expressions(self, sign: float, slips: tuple[int, ...], wanted) -> tuple[Affine, dict[int, Affine]]:
        """Return the force on the drive and the places of the ``wanted`` sliders while those of ``slips`` slip to ``sign``."""
        now = self.response(slips)
        pushes = sign * np.array(self.limits)
        absent = [i for i, limit in enumerate(self.limits) if limit == 0.0]
        stuck = [i for i in range(self.count) if i not in slips and i not in absent]

        def expression(drive, held, pushed):
            terms = {("u", 0): float(drive), ONE: float(pushed[list(slips)] @ pushes[list(slips)])}
            return Affine(terms | {("z", i): float(held[i]) for i in stuck})

        places = {i: expression(now.drive[i], now.held[i], now.pushed[i]) for i in wanted}
        return expression(now.force_drive, now.force_held, now.force_pushed), places

    def mode(self, key, core):
        """Return "stick", "slip+k", "slip-k", or the mode of a word."""
        return _mode(self, key)

    def _made(self, key: str) -> Mode:
        """Return the mode of a key, made anew."""
        if set(key) <= {STUCK, "+", "-"}:
            return self._worded(key)
        sign, k = (0.0, 0) if key == STICK else (1.0 if key[4] == "+" else -1.0, int(key[5:]))
        slips = sum(self.order[:k], ())
        following = self.order[k][:1] if k < len(self.order) else ()
        force, places = self.expressions(sign, slips, (*slips, *following))
        guards = []
        if k:
            guards.append(Guard(-sign * s(0), EventKind.STICK, (STICK,)))
        for i in following:
            spring = self.stiffness_of(i) * (places[i] - Affine({("z", i): 1.0}))
            for way in (1.0, -1.0) if key == STICK else (sign,):
                guards.append(Guard(way * spring - self.limits[i], EventKind.SLIP, (f"slip{'+' if way > 0.0 else '-'}{k + 1}",)))
        return Mode(force=(-force,), memory=self._followed(sign, slips, places), guards=tuple(guards))

    def _followed(self, sign: float, slips: tuple[int, ...], places: dict[int, Affine]) -> tuple[Algebraic | None, ...]:
        """Return the memory while those of ``slips`` slip: theirs stays a limit behind their places."""
        return tuple(Algebraic(places[i] - sign * self.limits[i] / self.stiffness_of(i)) if i in slips else None
                     for i in range(self.count))

    def _worded(self, word: str) -> Mode:
        """Return the mode in which the sliders slip that a word names, whatever the memory of the others."""
        slips = tuple(i for i, letter in enumerate(word) if letter != STUCK)
        sign = 0.0 if not slips else 1.0 if word[slips[0]] == "+" else -1.0
        left = tuple(i for group in self.order for i in group if i not in slips)
        force, places = self.expressions(sign, slips, (*slips, *left))
        springs = {i: self.stiffness_of(i) * (places[i] - Affine({("z", i): 1.0})) for i in left}
        memory = self._followed(sign, slips, places)
        guards = [Guard(-sign * s(0), EventKind.STICK, _Stopping(self, memory))] if slips else []
        for i in left:
            for way in (1.0, -1.0):  # against the motion none slips, but a start may be beyond that limit
                guards.append(Guard(way * springs[i] - self.limits[i], EventKind.SLIP,
                                    _Slipping(self, i, way, slips if way == sign else (), springs)))
        return Mode(force=(-force,), memory=memory, guards=tuple(guards))

    def ordered(self, z):
        """Return whether every slider turns after those before it in `order`, but for rounding."""
        W, room = self._room
        size = np.abs(z) @ np.abs(W).T + room + np.max(room, initial=0.0)
        return np.all(np.abs(z @ W.T) - room <= DISORDER * size, axis=-1)

    def key_of(self, slips, way: float) -> str:
        """Return the key of the mode in which some sliders slip; all that ever slip are in order."""
        letter = "+" if way > 0.0 else "-"
        if {i for group in self.order for i in group} <= set(slips):
            return f"slip{letter}{len(self.order)}"
        return "".join(letter if i in slips else STUCK for i in range(self.count))

    def mirrored(self):
        """Its own image."""
        return self

    def mirrored_key(self, key):
        """Slip turns round."""
        return key if key == STICK else key.translate(TURNED)

    def mirrored_guard(self, key, guard):
        """The two limits of what sticks change places."""
        if key.startswith("slip"):
            return guard
        first = 0 if key in (STICK, self.unordered) else 1  # the reversal
        return guard if guard < first else first + (guard - first ^ 1)


@dataclass(frozen=True)
class _Stopping:
    """What follows where the drive turns: all stick, in order where the memory is by now."""

    sliders: SliderSet
    memory: tuple[Algebraic | None, ...]

    def __call__(self, value) -> tuple[str, ...]:
        """Return the keys."""
        z = [value(Affine({("z", i): 1.0}) if follows is None else follows.value) for i, follows in enumerate(self.memory)]
        return (STICK, self.sliders.unordered) if self.sliders.ordered(np.array(z)) else (self.sliders.unordered,)


@dataclass(frozen=True)
class _Slipping:
    """What follows where a slider of a set that is not in order reaches its limit: all that are at theirs slip."""

    sliders: SliderSet
    slider: int
    way: float
    slips: tuple[int, ...]
    springs: dict[int, Affine]

    def __call__(self, value) -> tuple[str, ...]:
        """Return the keys."""
        limits = self.sliders.limits
        at_limit = [i for i, spring in self.springs.items() if self.way * value(spring) >= limits[i] * (1.0 - CLOSE)]
        return tuple(dict.fromkeys(self.sliders.key_of((*self.slips, *more), self.way)
                                   for more in ((self.slider, *at_limit), (self.slider,))))


@dataclass(frozen=True)
class Iwan(SliderSet):
    """Parallel set of elastic sliders (Iwan 1966): force -sum stiffness_i (u - w_i), each within +-limit_i.

    Parameters
    ----------
    stiffnesses : sequence of float
        Of each spring, force per length, above 0.
    limits : sequence of float
        Largest force of each slider, at least 0; 0: that slider is absent.
    dof, row
        What slides, see `AtRow`.

    Examples
    --------
    >>> from bifurc.elements import Iwan
    >>> Iwan(stiffnesses=(1.0, 2.0), limits=(0.5, 3.0)).virgin_force([0.25, 1.0, 2.0])
    array([0.75, 2.5 , 3.5 ])

    References
    ----------
    W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, J. Appl. Mech. 33 (1966),
    893-900.
    """

    stiffnesses: tuple[float, ...] = (1.0,)
    limits: tuple[float, ...] = (1.0,)

    tuples: ClassVar = {"stiffnesses": {"above": 0.0}, "limits": {"least": 0.0}}

    def __post_init__(self):
        super().__post_init__()
        if len(self.stiffnesses) != len(self.limits):
            raise ValueError(f"Iwan: {len(self.stiffnesses)} stiffnesses and {len(self.limits)} limits were given; "
                             "every slider needs one of each")

    def stiffness_of(self, slider):
        """Return the stiffness of a slider."""
        return self.stiffnesses[slider]

    def response(self, slips):
        """All sliders sit at the drive."""
        n = self.count
        k = np.array(self.stiffnesses)
        stuck = np.array([i not in slips and self.limits[i] > 0.0 for i in range(n)], float)
        pushed = np.array([i in slips for i in range(n)], float)
        return Response(np.ones(n), np.zeros((n, n)), np.zeros((n, n)), float(k @ stuck), -k * stuck, pushed)


@dataclass(frozen=True)
class MicroSlip(SliderSet):
    """Elastic bar or ring on elastic sliders with constant limits, driven at its first block.

    n blocks in a row, joined by equal springs, each with a contact to the ground that sticks elastically and slips at its
    own limit.  Blocks have no mass.  Modes as those of every `SliderSet`; the memory holds where each contact grips.

    Parameters
    ----------
    spring : float
        Between neighbours (E A over the length of a block), force per length, above 0.
    contact : float
        Tangential stiffness of each contact, force per length, above 0.
    limits : sequence of float
        Largest force of each contact (mu times its normal load), at least 0; 0: no contact there.  Their number is that of
        the blocks.
    closed : bool
        A ring: the last block is joined to the first.
    dof, row
        What drives the first block, see `AtRow`.

    References
    ----------
    C.-H. Menq, J. Bielak, J. H. Griffin, The influence of microslip on vibratory response, J. Sound Vib. 107 (1986).
    Zhao & Lin, J. NUDT 37 (2015), with the corrections of its end blocks.
    """

    spring: float = 1.0
    contact: float = 1.0
    limits: tuple[float, ...] = (1.0,)
    closed: bool = False

    def __post_init__(self):
        super().__post_init__()
        number("MicroSlip", "spring", self.spring, above=0.0)
        number("MicroSlip", "contact", self.contact, above=0.0)

    def stiffness_of(self, slider):
        """Return the stiffness of every contact."""
        return self.contact

    def response(self, slips):
        """Solve the statics of the blocks behind the driven one."""
        n, k = self.count, self.contact
        K = chain_stiffness(n, self.spring, self.closed)
        stuck = np.array([i not in slips and self.limits[i] > 0.0 for i in range(n)], float)
        drive, held, pushed = np.ones(n), np.zeros((n, n)), np.zeros((n, n))
        flexible = along(np.diagonal(K)[1:] + k * stuck[1:], -self.spring, np.eye(n - 1))
        drive[1:] = -flexible @ K[1:, 0]
        held[1:, 1:] = flexible * (k * stuck[1:])
        slipping = np.array([i in slips for i in range(n)], float)
        pushed[1:, 1:] = -flexible * slipping[1:]
        own = np.eye(n)[0]
        return Response(drive, held, pushed, float(K[0] @ drive + k * stuck[0]), K[0] @ held - k * stuck[0] * own,
                        K[0] @ pushed + slipping[0] * own)

    def loading(self, slips):
        """Solve the statics for the drive and the forces only: with the driven block cut out every chain is open."""
        n, k = self.count, self.contact
        load = np.zeros((n, 2))
        load[list(slips), 1] = [-self.limits[i] for i in slips]
        stuck = np.array([k if i not in slips and self.limits[i] > 0.0 else 0.0 for i in range(n)])
        diagonal = 2.0 * self.spring + stuck
        places = np.zeros((n, 2))
        places[0, 0] = 1.0
        neighbours = ()
        if n > 1:
            load[1, 0] += self.spring
            load[n - 1, 0] += self.spring if self.closed else 0.0
            diagonal[n - 1] -= 0.0 if self.closed else self.spring
            places[1:] = along(diagonal[1:], -self.spring, load[1:])
            neighbours = (1, n - 1) if self.closed else (1,)
        force = stuck[0] * places[0] - load[0]
        for j in neighbours:
            force = force + self.spring * (places[0] - places[j])
        return places[:, 0], places[:, 1], (float(force[0]), float(force[1]))

    def iwan(self) -> Iwan:
        """Return the parallel set with the same force: its stiffnesses are the slope drops of the virgin curve."""
        slopes = [self.loading(sum(self.order[:k], ()))[2][0] for k in range(len(self.order))]
        drops = -np.diff([*slopes, 0.0])  # when all contacts slip the chain follows the drive: no spring remains
        return Iwan(tuple(drops), tuple(drops * self.thresholds), dof=self.dof, row=self.row, label=self.label)


@functools.lru_cache(maxsize=1024)
def _mode(sliders: SliderSet, key: str) -> Mode:
    """Return a mode of a set: along a branch every row has a system of its own with an equal set."""
    return sliders._made(key)


def along(diagonal: np.ndarray, beside: float, load: np.ndarray) -> np.ndarray:
    """Solve a symmetric tridiagonal system with equal entries beside the diagonal (m,); load and answer (m, columns)."""
    m = len(diagonal)
    if m == 0:
        return load
    pivots, x = diagonal.copy(), load.copy()
    for i in range(1, m):
        factor = beside / pivots[i - 1]
        pivots[i] -= factor * beside
        x[i] -= factor * x[i - 1]
    x[-1] /= pivots[-1]
    for i in range(m - 2, -1, -1):
        x[i] = (x[i] - beside * x[i + 1]) / pivots[i]
    return x


def chain_stiffness(n: int, spring: float, closed: bool) -> np.ndarray:
    """Return the stiffness matrix (n, n) of n blocks in a row, or in a ring, without contacts."""
    K = np.zeros((n, n))
    for i in range(n if closed and n > 1 else n - 1):
        j = (i + 1) % n
        K[i, i] += spring
        K[j, j] += spring
        K[i, j] -= spring
        K[j, i] -= spring
    return K
