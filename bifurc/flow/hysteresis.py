"""Hysteresis of elements whose coordinate is prescribed (`bifurc.elements.Driven`): every event, closed forms between.

Within a mode force, guards and memory of an affine element are sums of harmonics of theta = omega t.  The integration finds
every zero of every guard (`bifurc.flow.periodic`), decides what follows by the rule of all events - the first candidate
whose guards are all inside, by value or by the first derivative that is not zero - and ends when a period repeats.

One file, because events, candidates and sums of harmonics of one integration stand on the same coefficients.
"""
from collections.abc import Hashable
from dataclasses import dataclass, field

import numpy as np

from .. import plotting
from ..checks import array, checked, of, whole
from ..content import Content
from ..elements import EventKind
from ..elements.driven import Driven
from ..elements.local import Frame, affine
from ..elements.mode import Algebraic
from ..enumerations import DescribedEnum
from ..notebook import Notebook
from ..system import System, require_system
from .periodic import NOISE, derivative, extrema, first_zero, product_integral, sign_after, states

TURN = 2.0 * np.pi
SAME = 1e-12  # of the motion: memories that differ by less after a period are the same
EVENTS = 200  # a period and slider, at most


class LoopStatus(DescribedEnum):
    """How the integration to a periodic loop ended."""

    PERIODIC = "periodic", "The loop repeats itself."
    NOT_SETTLED = "not_settled", "The memory still changes from period to period; raise max_periods."
    TOO_MANY_EVENTS = ("too_many_events", "There are more events a period than expected; the element may switch "
                                          "without end.")
    INCONSISTENT = "inconsistent", "No mode of the element may follow this event; its guards leave a gap."


@dataclass(frozen=True, eq=False)
class Piece(Content):
    """A part of the period in one mode; rows of coefficients as in `bifurc.flow.periodic`."""

    start: float  # angle, radians
    end: float
    key: Hashable
    force: np.ndarray = field(repr=False)  # (nw,) on the drive
    memory: np.ndarray = field(repr=False)  # (nz, nw)
    loaded: tuple[bool, ...] = field(repr=False)  # which sliders are; those of contacts that are apart are not


@dataclass(frozen=True, eq=False)
class LoopEvent(Content):
    """A change of mode: time in the period, angle omega t (radians), kind, and the keys before and after."""

    time: float
    angle: float
    kind: EventKind
    before: Hashable
    after: Hashable


@dataclass(frozen=True, eq=False)
class Loop(Content, Notebook):
    """Periodic force of one driven element over its prescribed motion.

    Attributes
    ----------
    label : str
        Of the element.
    omega : float
    events : tuple of LoopEvent
        Of the last period, in the order of time.
    pieces : tuple of Piece
    periods : int
        Periods integrated, the last one included.
    status : LoopStatus
    message : str
    """

    _facts = ("work", "force_max", "force_min", "status")

    label: str
    omega: float
    events: tuple[LoopEvent, ...] = field(repr=False)
    pieces: tuple[Piece, ...] = field(repr=False)
    periods: int
    status: LoopStatus
    message: str = field(repr=False)
    harmonics: tuple[int, ...] = field(repr=False)
    motion: np.ndarray = field(repr=False)  # (nw,)

    def __repr__(self):
        return (f"Loop({self.label!r}, work={self.work:.9g}, force_max={self.force_max:.9g}, events={len(self.events)}, "
                f"periods={self.periods}, status={self.status.value!r})")

    @property
    def success(self) -> bool:
        """Whether the loop is periodic."""
        return self.status == LoopStatus.PERIODIC

    @property
    def work(self) -> float:
        """Energy a period that the drive puts in, force times length: closed form between events."""
        speed = derivative(self.harmonics, self.motion)
        return sum(product_integral(self.harmonics, piece.force, speed, piece.start, piece.end) for piece in self.pieces)

    @property
    def force_max(self) -> float:
        """Largest force on the drive, at events or in between."""
        return max(self._extreme(piece.force, piece).max() for piece in self.pieces)

    @property
    def force_min(self) -> float:
        """Smallest force on the drive."""
        return min(self._extreme(piece.force, piece).min() for piece in self.pieces)

    @property
    def slip(self) -> np.ndarray:
        """Range over which each slider slides in a period, peak to peak, length; shape (sliders,)."""
        found = []
        for i in range(len(self.pieces[0].memory)):
            values = [self._extreme(piece.memory[i], piece) for piece in self.pieces if piece.loaded[i]]
            found.append(np.ptp(np.concatenate(values)) if values else 0.0)
        return np.array(found)

    @checked(t=of(array, axes=(0, 1)))
    def displacement(self, t) -> np.ndarray:
        """Return the prescribed coordinate at times ``t``, same shape."""
        return states(self.harmonics, self.omega * np.asarray(t, float)) @ self.motion

    @checked(t=of(array, axes=(0, 1)))
    def force(self, t) -> np.ndarray:
        """Return the force on the drive (what moves it, minus the force of the element) at times ``t``, same shape."""
        return self._rows(t, np.array([piece.force[None] for piece in self.pieces]))[..., 0]

    @checked(t=of(array, axes=(0, 1)))
    def sliders(self, t) -> np.ndarray:
        """Return the positions of the sliders at times ``t``, shape of ``t`` and then sliders."""
        return self._rows(t, np.array([piece.memory for piece in self.pieces]))

    @checked()
    def sample(self, n: int = 720) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return times (m,), displacements and forces of one period: n equal steps and all events."""
        t = np.unique(np.concatenate((np.linspace(0.0, TURN / self.omega, n + 1), [event.time for event in self.events])))
        return t, self.displacement(t), self.force(t)

    @checked()
    def plot(self, ax=None):
        """Draw force over displacement; return the Axes."""
        return plotting.plot_loop(self, ax)

    def _extreme(self, c, piece) -> np.ndarray:
        inner = piece.start + (extrema(self.harmonics, c) - piece.start) % TURN
        angles = np.concatenate(([piece.start, piece.end], inner[inner < piece.end]))
        return states(self.harmonics, angles) @ c

    def _rows(self, t, rows):
        angle = self.omega * np.asarray(t, float)
        whole = TURN * np.floor(angle / TURN)
        index = np.searchsorted([piece.start for piece in self.pieces], angle - whole, side="right") - 1
        return np.einsum("...w,...kw->...k", states(self.harmonics, angle), rows[np.maximum(index, 0)])


@dataclass(frozen=True, eq=False)
class Hysteresis(Content, Notebook):
    """Loops of the driven elements of a system; ``result[label]`` is one of them.

    Attributes
    ----------
    system : System
    loops : tuple of Loop
    """

    _facts = ("work", "success")

    system: System
    loops: tuple[Loop, ...]

    def __getitem__(self, label: str) -> Loop:
        for loop in self.loops:
            if loop.label == label:
                return loop
        raise KeyError(f"there is no driven element {label!r}; there are {', '.join(loop.label for loop in self.loops)}")

    @property
    def work(self) -> float:
        """Energy a period of all loops together, force times length."""
        return sum(loop.work for loop in self.loops)

    @property
    def success(self) -> bool:
        """Whether all loops are periodic."""
        return all(loop.success for loop in self.loops)

    @checked()
    def plot(self, ax=None):
        """Draw all loops; return the Axes."""
        for loop in self.loops:
            ax = loop.plot(ax)
        return ax


@checked()
def hysteresis(system: System, element: str | None = None, max_periods: int = 100) -> Hysteresis:
    """Return the periodic force-displacement loops of the driven elements of a system.

    Sliders start in the virgin state; the motion is followed to the first period that repeats itself.  Forces and
    energies have the units of the elements: with N and mm, energies are N mm.

    Parameters
    ----------
    system : System
        With elements `bifurc.elements.Driven`, such as `bifurc.systems.micro_slip_ring()`.
    element : str, optional
        Label of one of them; None: all.
    max_periods : int
        To wait for a loop that repeats.

    Returns
    -------
    Hysteresis

    Raises
    ------
    ValueError
        When nothing is driven, or a driven element has a law that is not affine.

    Examples
    --------
    >>> import bifurc as bf
    >>> loop = bf.hysteresis(bf.systems.macro_slip_contact(case=1))["x"]
    >>> round(loop.work, 9)
    40.529433022
    """
    require_system(system)
    max_periods = whole("hysteresis", "max_periods", max_periods, least=1)
    labels = [name for name, item in zip(system.labels, system.elements, strict=True) if isinstance(item, Driven)]
    if not labels:
        raise ValueError(f"{system!r} has no element that is driven by a displacement; put one into bf.elements.Driven, or see "
                         "bf.systems.macro_slip_contact")
    if element is not None and element not in labels:
        raise ValueError(f"element = {element!r} is not allowed; driven elements of {system!r}: {', '.join(labels)}")
    if system.omega is None:
        raise ValueError(f"{system!r} has no frequency; a driven element needs one")
    chosen = labels if element is None else [element]
    return Hysteresis(system, tuple(_Integration(system, system.labels.index(name)).run(max_periods) for name in chosen))


class _Inconsistent(ArithmeticError):
    """No mode may follow."""


class _Integration:
    """One driven element on its way to a periodic loop."""

    def __init__(self, system: System, index: int):
        self.system, self.element, self.label = system, system.elements[index], system.labels[index]
        site = self.element.site(system.n)
        self.harmonics = tuple(sorted({*self.element.harmonics, *site.harmonics}))
        self.nz = len(self.element.memory)
        self.frame = Frame(system.n, self.nz, self.harmonics, system.omega)
        self.U, self.S, _ = site.rows(self.frame)
        self.z = slice(2 * system.n, 2 * system.n + self.nz)
        self.local = {"u": self.U, "s": self.S, "z": self.frame.eye[self.z]}
        self._modes: dict = {}

    def mode(self, key):
        """Return force (nx,), guards (G, nx), memory rows, meanings: what a mode says, made once."""
        if key not in self._modes:
            mode = self.element.mode(key, self.system.core)
            if mode.law is not None:
                raise ValueError(f"{self.label}, mode {key!r}: its law is not affine; hysteresis knows closed forms only")
            force = -self.frame.row(mode.entries[0] if mode.entries else affine(0.0), self.local)
            guards = np.array([self.frame.row(guard.value, self.local) for guard in mode.guards]).reshape(-1, self.frame.nx)
            algebraic = {i: self.frame.row(item.value, self.local) for i, item in enumerate(mode.memory)
                         if isinstance(item, Algebraic)}
            self._modes[key] = force, guards, algebraic, mode.guards
        return self._modes[key]

    def sums(self, rows, z):
        """Return rows (., nx) at a memory as sums of harmonics (., nw), and the sizes of the terms of their constants."""
        c = rows[..., self.frame.ns:].copy()
        size = np.abs(c[..., 0]) + np.abs(rows[..., self.z]) @ np.abs(z)
        c[..., 0] += rows[..., self.z] @ z
        return c, size

    def written(self, key, z, theta):
        """Return the memory with what follows local values in a mode put in."""
        algebraic = self.mode(key)[2]
        if not algebraic:
            return z
        z, old = z.copy(), z
        w = states(self.harmonics, theta)
        for i, row in algebraic.items():
            z[i] = self.sums(row, old)[0] @ w
        return z

    def leaving(self, key, z, theta):
        """Return guards that forbid a mode at an angle: (number, whether it is at zero now)."""
        _, rows, _, _ = self.mode(key)
        c, size = self.sums(rows, z)
        w = states(self.harmonics, theta)
        found = []
        for g in range(len(rows)):
            if sign_after(self.harmonics, c[g], size[g], theta) > 0:
                found.append((g, c[g] @ w <= NOISE * (size[g] + np.abs(c[g, 1:]).sum())))
        return found

    def settle(self, key, guards, z, theta):
        """Return mode and memory after guards of a mode fired; breadth first through what fires at the same instant."""
        z = self.written(key, z, theta)
        waiting = [(other, z) for g in guards for other in self.then(key, g, z, theta)] + [(key, z)]
        seen = set()
        for other, memory in waiting:  # grows while it is walked
            if other in seen:
                continue
            seen.add(other)
            why = self.leaving(other, memory, theta)
            if not why:
                return other, memory
            if all(at_zero for _, at_zero in why):
                memory = self.written(other, memory, theta)
                waiting += [(next_, memory) for g, _ in why for next_ in self.then(other, g, memory, theta)]
        raise _Inconsistent(f"{self.label} at the angle {theta:.12g}: tried {', '.join(map(repr, seen))}.")

    def then(self, key, g, z, theta):
        """Return the candidates after a guard."""
        found = self.mode(key)[3][g].then
        if not callable(found):
            return found
        w = states(self.harmonics, theta)
        return found(lambda expression: self.sums(self.frame.row(expression, self.local), z)[0] @ w)

    def start(self):
        """Return the mode and memory of a virgin start at angle 0."""
        w = states(self.harmonics, 0.0)
        z = np.zeros(self.nz)
        for i, value in enumerate(self.element.virgin):
            z[i] = self.frame.row(value, {"u": self.U, "s": self.S})[self.frame.ns:] @ w
        for key in self.element.start:
            if not self.leaving(key, z, 0.0):
                return key, z
        raise _Inconsistent(f"{self.label} at a virgin start: tried {', '.join(map(repr, self.element.start))}.")

    def run(self, max_periods: int) -> Loop:
        """Integrate until a period repeats."""
        status, extra, pieces, events, period = LoopStatus.NOT_SETTLED, "", [], [], 0
        motion = self.sums(self.U[0], np.zeros(self.nz))[0]
        scale = np.abs(motion).sum()
        try:
            key, z = self.start()
            while period < max_periods:
                period += 1
                before = key, self.written(key, z, 0.0)
                key, z, pieces, events, complete = self.period(key, z)
                if not complete:
                    status = LoopStatus.TOO_MANY_EVENTS
                    break
                if key == before[0] and np.abs(self.written(key, z, 0.0) - before[1]).max(initial=0.0) <= SAME * scale:
                    status = LoopStatus.PERIODIC
                    break
        except _Inconsistent as error:
            status, extra = LoopStatus.INCONSISTENT, f" {error}"
        assert self.system.omega is not None
        return Loop(self.label, self.system.omega, tuple(events), tuple(pieces), period, status, status.sentence + extra,
                    self.harmonics, motion)

    def period(self, key, z):
        """Integrate through one period; return mode, memory, pieces, events, and whether the end was reached."""
        theta, pieces, events = 0.0, [], []
        for _ in range(EVENTS * (1 + self.nz)):
            force, rows, algebraic, guards = self.mode(key)
            c, size = self.sums(rows, z)
            now = [g for g, _ in self.leaving(key, z, theta)]
            at = theta
            if not now:
                hits = [first_zero(self.harmonics, c[g], size[g], theta, TURN) for g in range(len(rows))]
                times = [TURN if hit is None else hit for hit in hits]
                at = min(times, default=TURN)
                now = [] if at >= TURN else [g for g, hit in enumerate(times) if hit == at]
            memory = np.zeros((self.nz, 1 + 2 * len(self.harmonics)))
            memory[:, 0] = z
            for i, row in algebraic.items():
                memory[i] = self.sums(row, z)[0]
            if at > theta:
                pieces.append(Piece(theta, at, key, self.sums(force, z)[0], memory,
                                    tuple(self.element.loaded(key, i) for i in range(self.nz))))
            theta = at
            if not now:
                return key, self.written(key, z, TURN), pieces, events, True
            new, z = self.settle(key, now, z, theta)
            if new != key:
                events.append(LoopEvent(theta / self.system.omega, theta, guards[now[0]].kind, key, new))
            key = new
        return key, z, pieces, events, False
