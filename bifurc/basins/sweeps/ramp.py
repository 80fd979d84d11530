"""Run-up and run-down: one motion while a parameter changes slowly, and the values at which it jumps to another.

The parameter is held for a whole number of forcing periods, and moved by a small step between them: the load is continuous there,
events between are those of the unchanged system, located as always, and what a machine does between two values is left out.
"""
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.ndimage import median_filter

from ... import io, plotting
from ...checks import checked, of, several, state, whole
from ...compose.scene import scene_of
from ...content import Content
from ...flow.simulate import simulate
from ...jobs.progress import Progress
from ...notebook import Notebook, Table
from ...orbits.standing import resting_start
from ...system import System, require_system, require_values
from .diagram import DIRECTIONS

SAMPLES = 128  # a forcing period, of which the extremes are taken; events besides
SUDDEN = 5.0  # times the median change of amplitude from one value to the next, nearby, belong to a jump
WIDEST = 41  # values that are near
LEAST = 0.03  # of the largest amplitude: a jump
QUIET = 3  # values without a sudden change end a jump


@dataclass(frozen=True, eq=False)
class Jump(Content):
    """A jump of a motion from one attractor to another.

    Attributes
    ----------
    direction : str
        "up" or "down".
    value : float
        Parameter at which the amplitude begins to change suddenly.
    settled : float
        Parameter at which that has ended.
    before, after : float
        Amplitudes, see `Ramp.amplitudes`.
    """

    direction: str
    value: float
    settled: float
    before: float
    after: float


class Jumps(Table):
    """Jumps, in the order of time; ``to_pandas()`` makes them a table."""

    __slots__ = ()
    _fields = ("direction", "value", "settled", "before", "after")


@dataclass(frozen=True, eq=False)
class Ramp(Content, Notebook):
    """A motion while a parameter runs up and down.  Made by `ramp`.

    Attributes
    ----------
    system : System
    parameter : str
    directions : tuple of str
        "up", "down", in the order of time.
    values : ndarray
        (directions, m), in the order of time.
    maximum, minimum : ndarray
        (directions, m, n), of every coordinate over the last forcing period at each value; NaN after a motion that failed.
    events : ndarray
        (directions, m), events in that period.
    states : ndarray
        (directions, m, ns), at the end of each value.
    message : str
        How it ended.

    Examples
    --------
    >>> import bifurc as bf
    >>> run = bf.ramp(bf.systems.duffing_oscillator(amplitude=0.2), "omega", (0.8, 1.8), steps=200, periods=8)
    >>> run.maximum.shape
    (2, 200, 1)
    """

    _facts = ("parameter", "directions", "jumps")

    system: System
    parameter: str
    directions: tuple
    values: np.ndarray = field(repr=False)
    maximum: np.ndarray = field(repr=False)
    minimum: np.ndarray = field(repr=False)
    events: np.ndarray = field(repr=False)
    states: np.ndarray = field(repr=False)
    message: str = "The motion went through all values."

    @property
    def success(self) -> bool:
        """Whether the motion went through all values."""
        return bool(np.isfinite(self.states).all())

    @property
    def amplitudes(self) -> np.ndarray:
        """(directions, m): half of the way of the coordinates, the root of the sum of squares."""
        return 0.5 * np.sqrt(((self.maximum - self.minimum) ** 2).sum(axis=-1))

    @cached_property
    def jumps(self) -> Jumps:
        """Where the amplitude changes suddenly, by a thirtieth of its largest value or more."""
        return Jumps([jump for k, item in enumerate(self.directions)
                      for jump in jumps_of(item, self.values[k], self.amplitudes[k])])

    @checked()
    def nearest(self, branches: Iterable) -> list[tuple]:
        """Return (jump, special point, distance of the parameter) for each jump: the nearest special point of some branches."""
        points = [point for branch in branches for point in branch.special_points]
        return [(jump, point, abs(point.parameter - jump.value)) for jump in self.jumps
                for point in [min(points, key=lambda item: abs(item.parameter - jump.value), default=None)] if point is not None]

    @checked()
    def plot(self, ax=None, measure: str = "max_0", branches=(), names=None):
        """Draw ``max_i`` or ``min_i`` over the parameter, up and down, with ``branches`` of `trace`; return the axes."""
        return plotting.plot_ramp(self, ax, measure, branches, names=names)

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        arrays = {name: getattr(self, name) for name in ("values", "maximum", "minimum", "events", "states")}
        return {"kind": "ramp", "system": self.system.to_record(), "parameter": self.parameter, "directions": self.directions,
                "message": self.message}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Ramp":
        """Make what `to_record` described."""
        system = System.from_record(header["system"], elements)
        io.fitted(arrays, {"values": "finite d m", "maximum": "real d m n", "minimum": "real d m n", "events": "whole d m",
                           "states": "real d m ns"}, d=len(header["directions"]), n=system.n)
        return cls(system, header["parameter"], tuple(header["directions"]), **arrays,
                   message=header["message"])

    @checked()
    def save(self, path) -> None:
        """Write it to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        found = ", ".join(f"{jump.direction} {jump.value:.5g}" for jump in self.jumps)
        return f"Ramp({self.parameter} {' and '.join(self.directions)}, {self.values.shape[1]} values, jumps: {found or 'none'})"


@checked(steps=of(whole, least=2), directions=of(several, allowed=DIRECTIONS))
def ramp(system: System, parameter: str, bounds, *, steps: int = 400, periods: int = 4, directions=DIRECTIONS, start=None,
         max_events: int = 2000, progress: bool = False) -> Ramp:
    """Return the motion while a parameter runs slowly up, and then down again: the run-up and run-down of a machine.

    Each value begins with the state in which the one before ended.  Where the attractor ends that the motion is on, it jumps to
    another, up and down at different values where attractors coexist; it does so later the faster the parameter moves.

    Parameters
    ----------
    system : System
        With an excitation.
    parameter : str
        Name of a float parameter, such as the spin ``nu`` of a rotor.
    bounds : (low, high)
        Range of the parameter.
    steps : int
        Values in each direction, at least 2, equally spaced.
    periods : int
        Forcing periods at each value: the rate is (high - low) / (steps periods) a period.
    directions : tuple of str
        "up", "down", or both, in the order of time: the second goes on from where the first ended.
    start : array_like, optional
        State (2 n,) or (ns,) at phase 0 of the first value; default: rest, followed there for 100 periods.
    max_events : int
        Largest number of events a forcing period.
    progress : bool
        Show progress.

    Returns
    -------
    Ramp
        ``jumps`` lists where the amplitude changes suddenly.  A motion that fails is reported in ``message``, not raised.

    Raises
    ------
    ValueError
        Autonomous system, unknown parameter or direction, bounds that are no range, a start of the wrong shape.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.duffing_oscillator(amplitude=0.2)
    >>> run = bf.ramp(system, "omega", (0.8, 1.8), steps=200, periods=8)
    >>> [jump.direction for jump in run.jumps]
    ['up', 'down']
    """
    if require_system(system).period is None:
        raise ValueError(f"{system!r} is autonomous; a run-up needs an excitation (omega)")
    parameter = system.parameter_name(parameter)
    system.parameter(parameter)
    low, high = bounds
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"bounds = {bounds!r} is not allowed; it must be (low, high) with low below high")
    require_values(system, "bounds", parameter, bounds)
    rising = np.linspace(low, high, steps)
    values = np.array([rising if item == "up" else rising[::-1] for item in directions])
    first = system.with_parameters(**{parameter: float(values[0, 0])})
    scene = scene_of(first)
    if start is None:
        motion = simulate(first, resting_start(first), periods=100, max_events=max_events)
        y = motion.final
    else:
        y = state("start", start, (2 * scene.n, scene.ns))
    n, shape = scene.n, values.shape
    maximum, minimum = np.full((*shape, n), np.nan), np.full((*shape, n), np.nan)
    states, events = np.full((*shape, scene.ns), np.nan), np.zeros(shape, np.int64)
    message = "The motion went through all values."
    with Progress("ramp", values.size, progress) as bar:
        for place, value in np.ndenumerate(values):
            moved = system.with_parameters(**{parameter: float(value)})
            try:
                motion = simulate(moved, y, periods=periods, max_events=max_events)
            except ValueError as error:  # a start beyond a stop that has moved
                message = f"{parameter} = {value:.6g}: {error}"
                break
            if not motion.success:
                message = f"{parameter} = {value:.6g}: {motion.message}"
                break
            y = states[place] = motion.final
            last = motion(np.linspace(motion.stop - moved.period, motion.stop, SAMPLES + 1))
            mine = [event for event in motion.events if event.time > motion.stop - moved.period]
            last = np.concatenate([last[:, :n], *(event.before[None, :n] for event in mine)])
            maximum[place], minimum[place], events[place] = last.max(axis=0), last.min(axis=0), len(mine)
            bar.advance(1)
    return Ramp(system, parameter, directions, values, maximum, minimum, events, states, message)


def jumps_of(direction: str, values: np.ndarray, amplitudes: np.ndarray) -> list[Jump]:
    """Return the jumps along amplitudes (m,): sudden changes beside each other, that add up to a part `LEAST` of the largest."""
    good = np.isfinite(amplitudes)
    values, amplitudes = values[good], amplitudes[good]
    if len(values) < 3:
        return []
    change = np.abs(np.diff(amplitudes))
    top = float(amplitudes.max())
    usual = median_filter(change, size=int(np.clip(len(change) // 8, 5, WIDEST)) | 1, mode="nearest")
    sudden = np.flatnonzero(change > np.maximum(SUDDEN * usual, 0.1 * LEAST * top))
    found = []
    for group in np.split(sudden, np.flatnonzero(np.diff(sudden) > QUIET) + 1) if sudden.size else []:
        before, after = float(amplitudes[group[0]]), float(amplitudes[group[-1] + 1])
        if abs(after - before) >= LEAST * top:
            found.append(Jump(direction, float(values[group[0]]), float(values[group[-1] + 1]), before, after))
    return found
