"""A simulated motion: events, and the exact state at any time between them."""
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from .. import plotting
from ..checks import array, checked
from ..compose.scene import scene_of
from ..content import Content, read_only
from ..elements import EventKind
from ..motion import Motion
from ..notebook import Notebook, Table
from ..system import System
from .engine import engine_of
from .scan import CHATTER, GRAZE, PASSED
from .status import Status

PER_PERIOD = 64  # default rows of `t`, `y` a forcing period


@dataclass(frozen=True, eq=False)
class Event(Content):
    """One event of a motion.

    Attributes
    ----------
    time : float
        Of the event; of the first impact of a complete chattering.
    element : str
        Label of the element.
    kind : EventKind
    speed : float
        Rate of the guard on arrival (an impact: the speed relative to the stop, length per time); 0 for a touch.
    before, after : ndarray
        States (ns,) on both sides.
    ratio, end : float or None
        Of a complete chattering: the ratio of successive speeds and the time when it has completed.
    mode_before, mode_after : tuple or None
        Keys of all elements on both sides, in the order of the system's elements: an impact that turns friction round, or a
        slip that is reversed in one instant, differs so from a rest.  None where an event concerns its own contact only.
    """

    time: float
    element: str
    kind: EventKind
    speed: float
    before: np.ndarray = field(repr=False)
    after: np.ndarray = field(repr=False)
    ratio: float | None = None
    end: float | None = None
    mode_before: tuple | None = None
    mode_after: tuple | None = None


class Events(Table):
    """Events in the order of time; ``to_pandas()`` makes them a table."""

    __slots__ = ()
    _fields = ("time", "element", "kind", "speed", "ratio", "end")


def past(motion, t0: float, delay: float):
    """Return a simulated motion before ``t0`` as a function of time, and the times of its events, see `Motion.past`."""
    slack = 1e-9 * delay
    if motion.start > t0 - delay + slack or motion.stop < t0 - slack:
        raise ValueError(f"history must reach from {t0 - delay:g} to {t0:g}, one delay back from the start; it is known from "
                         f"{motion.start:g} to {motion.stop:g}")
    return partial(_clipped, motion), [e.time for e in motion.events if e.time > t0 - delay]


def _clipped(motion, t):
    return motion(np.clip(t, motion.start, motion.stop))


@dataclass(frozen=True, eq=False)
class Recorded(Content):
    """What the integration wrote: segments between events and passed sections, exact times as whole periods plus a rest."""

    rows: np.ndarray  # (N, 5) mode before, guard, mode after, what it is, whole periods
    times: np.ndarray  # (N,) local time in the period
    speeds: np.ndarray  # (N,)
    spans: np.ndarray  # (N,) remaining duration of a complete chattering
    before: np.ndarray  # (N, ns)
    after: np.ndarray  # (N, ns)

    def __post_init__(self):
        """Leave the arrays as they are: kernels read them, and would compile again for read-only ones."""


@dataclass(frozen=True, eq=False)
class Trajectory(Content, Notebook, Motion):
    """A motion through its events.

    Attributes
    ----------
    system : System
    start, stop : float
        Times of the first and the last state.
    final : ndarray
        State (ns,) at `stop`.
    status : Status
    message : str
    t, y : ndarray
        Times (N,) and states (N, ns): 64 rows a forcing period (autonomous: 2000 in all), and both sides of every event.
    events : tuple of Event
    modes : tuple
        Element keys after every event, the start first.

    Examples
    --------
    >>> import bifurc as bf
    >>> motion = bf.simulate(bf.systems.impact_oscillator(), (0.0, 0.0), periods=20)
    >>> motion.success, motion.y.shape[1]
    (True, 2)
    """

    _facts = ("start", "stop", "status")
    _panels = (1, 2)

    system: System
    start: float
    stop: float
    final: np.ndarray = field(repr=False)
    status: Status
    message: str = field(repr=False)
    recorded: Recorded = field(repr=False)

    def __repr__(self):
        return (f"Trajectory(start={self.start:.6g}, stop={self.stop:.6g}, events={self._is_event.sum()}, "
                f"status={self.status.value!r})")

    @property
    def success(self) -> bool:
        """Whether the end time was reached."""
        return self.status == Status.COMPLETED

    @cached_property
    def _period(self) -> float:
        return 0.0 if self.system.period is None else self.system.period

    @cached_property
    def _is_event(self) -> np.ndarray:
        return self.recorded.rows[:, 3] != PASSED

    @cached_property
    def _starts(self) -> np.ndarray:
        return self.recorded.rows[:, 4] * self._period + self.recorded.times

    @cached_property
    def events(self) -> Events:
        """Events in the order of time."""
        scene, R, (left, entered) = scene_of(self.system), self.recorded, self._sides
        found = []
        for i in np.flatnonzero(self._is_event):
            before, g, after, what, _ = (int(v) for v in R.rows[i])
            kind = {CHATTER: EventKind.CHATTER, GRAZE: EventKind.GRAZE}.get(what) or scene.event_kind(before, g, after)
            ratio = end = None
            if what == CHATTER:
                ratio, end = float(scene.tables.ratio[before, g]), float(self._starts[i] + R.spans[i])
            found.append(Event(float(self._starts[i]), scene.element_name(before, g), kind, float(R.speeds[i]),
                               left[i], entered[i], ratio, end, scene.keys[before], scene.keys[after]))
        return Events(found)

    @cached_property
    def _sides(self) -> tuple[np.ndarray, np.ndarray]:
        """States (N, ns) before and after what was recorded, with the memory that follows local values in the modes there."""
        scene, R = scene_of(self.system), self.recorded
        return scene.shown(R.rows[:, 0], R.before, R.times), scene.shown(R.rows[:, 2], R.after, R.times)

    @cached_property
    def modes(self) -> tuple:
        """Element keys at the start and after every event."""
        keys = scene_of(self.system).keys
        return (keys[self.recorded.rows[0, 2]], *(keys[m] for m in self.recorded.rows[self._is_event, 2]))

    def __call__(self, t):
        """Return the states (..., ns) at times ``t``; at an event the state after it.

        Raises
        ------
        ValueError
            When a time lies outside the motion.
        """
        times = t if isinstance(t, np.ndarray) and t.dtype == float else array("", "t", t, axes=(0, 1, 2, 3), least=0)
        slack = 1e-12 * max(abs(self.start), abs(self.stop))
        if times.size and not (times.min() >= self.start - slack and times.max() <= self.stop + slack):
            raise ValueError(f"t must lie in [{self.start!r}, {self.stop!r}], the motion that was simulated")
        flat = np.clip(times.ravel(), self.start, self.stop)
        R, scene = self.recorded, scene_of(self.system)
        index = np.maximum(np.searchsorted(self._starts, flat, side="right") - 1, 0)
        if self._period:
            whole = np.floor(flat / self._period)
            spans = (whole - R.rows[index, 4]) * self._period + ((flat - whole * self._period) - R.times[index])
        else:
            spans = flat - R.times[index]
        out = np.empty((flat.size, R.after.shape[1]))
        engine_of(scene).sample(scene.tables, np.ascontiguousarray(R.rows[:, 2]), R.times, R.after, index,
                                np.maximum(spans, 0.0), out)
        out = scene.shown(R.rows[index, 2], out, flat)
        return out.reshape(*times.shape, out.shape[1])

    def passing(self, t: np.ndarray, y: np.ndarray, lengths: np.ndarray, place: int, value: float, ends: np.ndarray):
        """Return the times (k,) at which the component ``place`` of the motion passes a value, and the states (k, ns) there.

        Between the times ``t`` (k,), at which the motion has the states ``y`` (k, ns), and ``lengths`` (k,) behind them, no event
        being between: without going there from the beginning of a segment, which may be long.  ``ends`` (k, 2) are the differences
        from the value at both ends, of opposite signs.
        """
        scene, R = scene_of(self.system), self.recorded
        engine, T = engine_of(scene), scene.tables
        modes = np.ascontiguousarray(R.rows[np.maximum(np.searchsorted(self._starts, t, side="right") - 1, 0), 2])
        starts = t % self._period if self._period else t
        rows, spans, out = np.zeros((len(t), T.A.shape[2] + 1)), np.empty(len(t)), np.empty_like(y)
        rows[:, place], rows[:, -1] = 1.0, -value
        for mode in set(modes.tolist()) if place >= 2 * scene.n else ():
            for at, row in scene.algebraic(mode):  # memory that follows local values
                if at == place:
                    rows[modes == mode, :-1] = row
        engine.passages(T, modes, starts, y, lengths, rows, ends, spans)
        engine.sample(T, modes, starts, y, np.arange(len(t)), spans, out)
        return t + spans, scene.shown(modes, out, t + spans)

    @checked()
    def sample(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Return ``n`` equally spaced times from start to stop, and the states (n, ns)."""
        times = np.linspace(self.start, self.stop, n)
        return times, self(times)

    def past(self, t0: float, delay: float):
        """See `Motion.past`."""
        return past(self, t0, delay)

    @cached_property
    def _rows(self):
        span = self.stop - self.start
        count = int(np.ceil(PER_PERIOD * span / self._period)) if self._period else 2000
        times = np.linspace(self.start, self.stop, max(count, 1) + 1)
        hits = np.flatnonzero(self._is_event)
        t = np.concatenate((times, self._starts[hits], self._starts[hits]))
        left, entered = self._sides
        y = np.concatenate((self(times), left[hits], entered[hits]))
        kind = np.repeat((1, 0, 2), (times.size, hits.size, hits.size))
        order = np.lexsort((np.concatenate((np.zeros(times.size), np.arange(hits.size), np.arange(hits.size))), t))
        if hits.size:  # both sides of one event stay together
            order = order[np.lexsort((kind[order], t[order]))] if np.unique(self._starts[hits]).size == hits.size else order
        return read_only(t[order]), read_only(y[order])

    @property
    def t(self) -> np.ndarray:
        """Times (N,) of `y`."""
        return self._rows[0]

    @property
    def y(self) -> np.ndarray:
        """States (N, ns)."""
        return self._rows[1]

    @property
    def sections(self) -> np.ndarray:
        """States (K, ns) at the whole forcing periods from start to stop."""
        if not self._period:
            raise ValueError("sections need a forcing period; this system is autonomous")
        first = np.ceil(self.start / self._period - 1e-12)
        last = np.floor(self.stop / self._period + 1e-12)
        return self(np.clip(np.arange(first, last + 1) * self._period, self.start, self.stop))

    def plot(self, axes=None, names=None):
        """Plot phase plane and time history; return the axes. ``names`` gives labels: ``{"q0": "x (mm)"}``."""
        return plotting.plot_trajectory(self, axes, names=names)

    def animate(self, path=None, **options):
        """Return the motion as a matplotlib animation, written to a ``.gif`` when a path is given; see `animate_orbit`."""
        return plotting.animate_orbit(self, path, **options)
