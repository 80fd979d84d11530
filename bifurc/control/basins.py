"""Which starts a delayed feedback brings to its orbit: `feedback_basins`.

Motions under delayed feedback have a past, so that a start is a state and what was before it.  A map over states needs a rule for
the past; there are three, and their maps differ.
"""
from functools import partial

import numpy as np

from ..checks import checked, choice, like, number, of, whole
from ..compose.scene import scene_of
from ..elements import DelayedFeedback
from ..ensemble.grid import Grid
from ..ensemble.initial_conditions import states_at
from ..ensemble.outcomes import CellState
from ..flow import settle
from ..flow.delayed.integration import feedbacks_of, integrate, without_feedback
from ..flow.delayed.verb import past_of
from ..flow.status import Status
from ..jobs.executors import user_parts
from ..jobs.progress import Progress
from ..jobs.resumable import resumable
from ..orbits.orbit import PeriodicOrbit
from ..system import System, require_system
from .feedback_map import KIND, FeedbackBasins, HeldMotion

PASTS = ("free", "constant", "orbit")
STAYED = 3  # delays for which a motion must stay near the orbit, or repeat
NEARER = 0.25  # of the distance at which it came near: to this it must fall
REPEATED = 1e-8  # scaled: sections that repeat are one motion
MOST = 8  # longest period, in forcing periods, that is recognised in other motions
SAME = 1e-3  # scaled distance of sections of one motion
CHUNK = 16  # starts a chunk

ENDED = {Status.DIVERGED: CellState.DIVERGED, Status.TOO_MANY_EVENTS: CellState.TOO_MANY_EVENTS,
         Status.INCONSISTENT: CellState.INCONSISTENT}


@checked(past=of(choice, allowed=PASTS), executor=like("a concurrent.futures.Executor (or have its map), or None", "map"))
def feedback_basins(system: System, orbit: PeriodicOrbit, grid: Grid, *, past: str = "free", tolerance: float = 1e-3,
                    max_periods: int = 400, max_events: int = 2000, executor=None, file=None, progress=False) -> FeedbackBasins:
    """Return which starts of a grid a delayed feedback brings to an orbit.

    Every start is simulated with events on its own past, until it stays near the orbit and comes nearer, repeats otherwise, leaves
    all bounds, or ``max_periods`` have passed.

    Parameters
    ----------
    system : System
        Forced, with `elements.DelayedFeedback`.
    orbit : PeriodicOrbit
        Of the system without feedback; its period divides the delay.
    grid : Grid
        Two components of the start, or more.
    past : {"free", "constant", "orbit"}
        What was before the start. "free": the motion without feedback, which is switched on one delay after the start;
        "constant": the start itself; "orbit": the orbit, from which the start departs by a blow.
    tolerance : float
        Distance from the orbit, in its natural sizes at whole periods, below which a motion may count as held: for three delays,
        in which it falls to a quarter.
    max_periods : int
    max_events : int
        Largest number of events a forcing period.
    executor : Executor, optional
        With the shape of `concurrent.futures.Executor`; None: this thread.
    file : path-like, optional
        Where the map is saved; finished starts are kept beside it until then, so that an interrupted call goes on.
    progress : bool or callable

    Returns
    -------
    FeedbackBasins

    Raises
    ------
    ValueError
        System without forcing or feedback, a delay that is no multiple of the orbit's period, arguments out of range.
    FileExistsError
        When ``file`` is something else than such a map.

    References
    ----------
    K. Pyragas, Phys. Lett. A 170 (1992) 421; on basins under delayed feedback K. Yamasue and T. Hikihara, Phys. Rev. E 73 (2006)
    036209.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=2.5, amplitude=12.0)
    >>> orbit = bf.find_orbit(system, guess=(-4.0, 8.4))
    >>> feedback = bf.elements.DelayedFeedback(0.06)
    >>> held = bf.System(system.mass, system.damping, system.stiffness, (*system.elements, feedback), omega=2.5)
    >>> basins = bf.control.feedback_basins(held, orbit, bf.Grid(q0=(-7.0, -5.0, 2), v0=(-2.0, 2.0, 2)))
    >>> basins.labels.shape
    (2, 2)
    """
    delayed = any(isinstance(element, DelayedFeedback) for element in require_system(system).elements)
    if not delayed or system.period is None:
        raise ValueError(f"{system!r} is not allowed: it must be forced and have DelayedFeedback")
    if not isinstance(orbit, PeriodicOrbit) or not orbit.success:
        raise ValueError(f"orbit = {orbit!r} is not allowed; it must be an orbit of the system without feedback")
    if not isinstance(grid, Grid):
        raise ValueError(f"grid = {grid!r} is not allowed; it must be a Grid, such as Grid(q0=(-3, 1, 20), v0=(-4, 4, 20))")
    feedbacks = feedbacks_of(system)
    turns = feedbacks[0].delay_of(system.omega) / orbit.period
    if abs(turns - round(turns)) > 1e-9 or round(turns) < 1:
        raise ValueError(f"the delay is {turns:.9g} periods of the orbit; it must be a whole number, or the feedback does not "
                         "vanish on it")
    past = choice("feedback_basins", "past", past, PASTS)
    tolerance = number("feedback_basins", "tolerance", tolerance, above=0.0)
    whole("feedback_basins", "max_periods", max_periods, least=1)
    whole("feedback_basins", "max_events", max_events, least=1)
    free = scene_of(without_feedback(system))
    starts = states_at(free, grid.names, grid.at, grid.points(np.arange(grid.size)))
    work = partial(followed, system, orbit, past, tolerance, max_periods, max_events, round(turns))
    chunks = np.array_split(starts, max(1, -(-len(starts) // CHUNK)))
    header, arrays = orbit.to_record()
    job = {"what": KIND, "system": system.to_record(), "orbit": [header, arrays], "past": past, "tolerance": tolerance,
           "max_periods": max_periods, "max_events": max_events, "elements": user_parts(system)}

    def compute(store, key) -> FeedbackBasins:
        names = [store.name({"starts": chunk}) for chunk in chunks]
        found = {k: unpacked(*kept) for k, name in enumerate(names) if (kept := store.load(name)) is not None}
        missing = [k for k in range(len(chunks)) if k not in found]
        with Progress("basins under feedback", len(starts), progress) as bar:
            bar.advance(sum(len(chunks[k]) for k in found))
            parts = (map if executor is None else executor.map)(work, [chunks[k] for k in missing])  # one by one: each is kept
            for k, part in zip(missing, parts, strict=True):
                store.save(names[k], *packed(part))
                found[k] = part
                bar.advance(len(part))
        return _numbered(system, orbit, grid, past, [each for k in range(len(chunks)) for each in found[k]], key)

    return resumable(KIND, file, job, partial(FeedbackBasins.from_record, elements=user_parts(system)), compute,
                     part={"grid": grid.to_record()})


def packed(part) -> tuple[dict, dict]:
    """Return what `followed` found as header and arrays of a chunk."""
    cycles = [np.empty((0, 0)) if cycle is None else cycle for _, _, cycle in part]
    rows = [row for cycle in cycles for row in cycle]
    return ({"states": [state.value for state, _, _ in part], "periods": [count for _, count, _ in part],
             "counts": [None if cycle is None else len(cycle) for _, _, cycle in part]}, {"rows": np.array(rows)})


def unpacked(meta, arrays) -> list[tuple]:
    """Return what `packed` stored."""
    found, at = [], 0
    for state, periods, count in zip(meta["states"], meta["periods"], meta["counts"], strict=True):
        cycle = None if count is None else arrays["rows"][at:at + count]
        at += count or 0
        found.append((CellState(state), periods, cycle))
    return found


def followed(system, orbit, past, tolerance, max_periods, max_events, turns, starts) -> list[tuple]:
    """Return (state, periods, sections that repeat or None) of each of some starts (k, ns)."""
    free = scene_of(without_feedback(system))
    period, delay = system.period, turns * orbit.period
    places = orbit._states(np.arange(orbit.periods, dtype=float))
    found: list[tuple] = []
    for y in starts:
        if not admissible(free, y):
            found.append((CellState.OUTSIDE, 0, None))
            continue
        before, breaks = {"free": (None, []), "constant": (partial(constant, y), []),
                          "orbit": past_of(orbit, 0.0, delay, orbit.state.size)}[past]
        late = round(delay / period)  # forcing periods
        watch = Watch(places, orbit.weights, tolerance, STAYED * late, 1 if past != "free" else 1 + late)
        motion = integrate(system, y, 0.0, max_periods * period, before, breaks, max_events, watch)
        found.append((ENDED.get(motion.status, watch.state), len(watch.sections), watch.cycle))
    return found


def constant(y, t):
    """Return the same state (k, ns) at all times (k,)."""
    return np.tile(y, (len(t), 1))


def admissible(scene, y) -> bool:
    """Whether a motion may start at ``y`` (ns,): not beyond a stop."""
    try:
        settle.start(scene, np.append(y, scene.forcing(np.zeros(1))[0]))
    except settle.Penetration:
        return False
    return True


class Watch:
    """Tells at whole periods when it is known where a motion ends.

    Parameters
    ----------
    places : ndarray (p, ns)
        States of the orbit at whole periods.
    weights : ndarray (ns,)
        Natural sizes.
    tolerance : float
    stay : int
        Periods for which a motion must stay near the orbit, or repeat.
    blind : int
        Periods at the start that do not count: the feedback is not complete yet.
    """

    def __init__(self, places, weights, tolerance, stay, blind):
        self.places, self.weights, self.tolerance, self.stay, self.blind = places / weights, weights, tolerance, stay, blind
        self.sections: list[np.ndarray] = []
        self.near: list[list[float]] = [[] for _ in places]  # distances in a row, by which state of the orbit began the row
        self.state, self.cycle = CellState.UNSETTLED, None

    def __call__(self, state) -> bool:
        y = state / self.weights
        self.sections.append(y)
        if len(self.sections) <= self.blind:
            return False
        count = len(self.places)
        for shift, row in enumerate(self.near):
            distance = float(np.linalg.norm(y - self.places[(len(self.sections) + shift) % count]))
            row.append(distance) if distance <= self.tolerance else row.clear()
            if len(row) >= max(self.stay, 2 * count) and max(row[-count:]) <= NEARER * max(row[:count]):
                self.state, self.cycle = CellState.ATTRACTED, np.empty((0, y.size))
                return True
            if row:
                return False
        return self._repeats()

    def _repeats(self) -> bool:
        """Whether the last sections repeat with a period of a few, for longer than the delay."""
        for q in range(1, MOST + 1):
            need = self.stay + q
            if len(self.sections) - self.blind < need:
                return False
            last = np.array(self.sections[-need:])
            if np.abs(last[q:] - last[:-q]).max() <= REPEATED:
                self.state, self.cycle = CellState.ATTRACTED, last[-q:] * self.weights
                return True
        return False


def _numbered(system, orbit, grid, past, found, key) -> FeedbackBasins:
    """Return the map with numbers for the motions that were met, in the order of the starts."""
    attractors: list = [orbit]
    labels = np.full(len(found), -1)
    for i, (_, _, cycle) in enumerate(found):
        if cycle is None:
            continue
        if not len(cycle):
            labels[i] = 0
            continue
        for k, other in enumerate(attractors[1:], 1):
            apart = np.abs((other.points[:, None] - cycle[None]) / orbit.weights).max(axis=-1)
            if len(other.points) == len(cycle) and apart.min(axis=1).max() <= SAME:
                labels[i] = k
                break
        else:
            attractors.append(HeldMotion(cycle, len(cycle)))
            labels[i] = len(attractors) - 1
    states = np.array([state.code for state, _, _ in found], np.int8)
    periods = np.array([count for _, count, _ in found], np.int32)
    return FeedbackBasins(system, orbit, grid, past, labels.reshape(grid.shape), states.reshape(grid.shape),
                          periods.reshape(grid.shape), tuple(attractors), key)
