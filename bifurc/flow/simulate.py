"""Simulate a system through its events."""
import numpy as np

from ..checks import LARGEST, RATIO, checked, number, of
from ..compose.modal import give_modal
from ..compose.scene import scene_of
from ..compose.tables import paced
from ..models.cost import warn_if_slow
from ..system import System, require_system
from . import settle
from .affine.zeno import accumulation
from .delayed.verb import simulate_delayed
from .engine import engine_of
from .initial import checked_length, checked_mode, checked_state
from .scan import (
    AFTER,
    AT_GUARD,
    BOUND,
    COUNT,
    DONE,
    EVENT,
    EVENTS,
    FULL,
    INSTANT,
    INSTANTS,
    LACKS,
    LIMIT,
    LOST,
    LOW,
    MODE,
    NEED,
    ORDERS,
    PERIODS,
    SINCE,
    SLOPES,
    SPAN,
    SPEED,
    STATE,
    TAU,
    TIME,
    WHOLE,
)
from .status import Status
from .trajectory import Recorded, Trajectory

ROWS, MOST_ROWS = 1024, 16384  # of the first record, doubled while it is full; and of what is added to it at most
AT_ONCE = 64  # events of a system of first order at one instant
NEAR_SURFACE = 1e-12  # of its terms: a surface that a motion is on where nothing follows
# a compiled call looks at no signal: it comes back after so many events, and so many steps, the fewer the more states there are
WORK, LAW_STEPS = 2e7, 5000.0


@checked(periods=of(number, least=0.0, most=LARGEST), duration=RATIO, mode=None)
def simulate(system: System, y0, periods: float | None = None, duration: float | None = None, t0: float = 0.0,
             max_events: int = 2000, history=None, mode=None):
    """Return the motion from a state, through all its events.

    Between events the motion is closed form; events are isolated with a bound, none is stepped over.

    Parameters
    ----------
    system : System
    y0 : array_like, or dict of str to float
        State (2 n,) or (ns,): positions, velocities, and memory where there is any (left out: virgin, springs of sliders
        without force); or its components by name, such as ``{"v": 12.0, "i": 0.6}``, where those not named are 0.
    periods, duration : float
        How long: forcing periods or time; exactly one of them.
    t0 : float
        Start time; the excitation is cos(k omega t + phase).
    max_events : int
        Largest number of events a forcing period (autonomous: in all).  A complete chattering is one.
    history : Trajectory, PeriodicOrbit or callable, optional
        For systems with a `DelayedFeedback`: the motion before the start (a callable gives states (k, ns) at times (k,),
        or one state (ns,) that lasts). None: the feedback begins one delay after the start.
    mode : tuple, optional
        Modes of all elements at the start, as ``orbit.mode`` gives them: with hysteresis a state does not tell which field acts.
        None: the first that may begin.

    Returns
    -------
    Trajectory
        A `DelayedMotion` for systems with a `DelayedFeedback`.

    Raises
    ------
    ValueError
        For a state of the wrong shape or not finite, a start beyond a rigid stop, or a length that is not given once.

    Examples
    --------
    >>> import bifurc as bf
    >>> motion = bf.simulate(bf.systems.impact_oscillator(), y0=(0.0, 0.0), periods=50)
    >>> motion.success
    True
    """
    require_system(system)
    if any(element.delayed for element in system.elements):
        return simulate_delayed(system, y0, periods, duration, t0, max_events, history)
    if history is not None:
        raise ValueError(f"history is not allowed; {system!r} has no delayed feedback")
    scene = scene_of(system)
    t0, length = checked_length(scene, periods, duration, t0)
    y0 = checked_state(scene, y0, t0)
    if not scene.tables.V.size:  # in modal coordinates a fast motion that has decayed costs nothing
        warn_if_slow(system)
    period = scene.period
    if period is None:
        begin, end = (0, t0), (0, t0 + length)
    else:
        begin = _split(t0, period)
        if periods is not None:
            whole = int(np.floor(length))
            end = _carry(begin[0] + whole, begin[1] + (length - whole) * period, period)
        else:
            whole = int(np.floor(length / period))
            end = _carry(begin[0] + whole, begin[1] + (length - whole * period), period)
    try:
        return integrate(scene, y0, begin, end, max_events, None if mode is None else checked_mode(scene, mode))
    except settle.Inconsistent as error:
        if scene.n:
            raise
        raise settle.Penetration(f"y0 = {y0.tolist()} lies in no mode; {error}") from None


def integrate(scene, y0, begin, end, max_events=2000, keys=None) -> Trajectory:
    """Return the motion from ``y0`` (ns,) at ``begin`` to ``end``, both (whole periods, local time).

    ``keys`` see `settle.start`.
    """
    period = scene.period or 0.0
    engine = engine_of(scene)
    x = np.zeros(scene.ns + scene.nw)
    x[:scene.ns] = y0
    _forcing(scene, begin[1], x)
    given, span = x.copy(), (end[0] - begin[0]) * period + end[1] - begin[1] if end[0] != begin[0] else end[1] - begin[1]
    _paced(scene, given, span)
    try:
        mode, x = settle.start(scene, x, keys)
    except settle.Inconsistent as error:
        if keys is None:
            raise
        raise ValueError(f"simulate: mode = {keys!r} is not allowed; {error}") from None
    first = x[:scene.ns].copy()
    T = scene.tables
    give_modal(T)
    ints, floats = engine.workspace(T)
    ints[MODE], ints[WHOLE], floats[TAU] = mode, begin[0], begin[1]
    _orders(scene, mode, x, ints, floats)
    rows = np.zeros((ROWS, 5), np.int64)
    record = np.zeros((ROWS, STATE + 2 * scene.ns))
    status = Status(scene.ending(mode) or Status.COMPLETED.value)
    message = status.sentence
    while status is Status.COMPLETED:
        stop = _slice(scene, T, ints, floats, end, period)
        code = engine.run(T, ints, floats, x, *stop, max_events, rows, record)
        if code == DONE and stop != end and (np.abs(x) < BOUND).all():
            continue
        if code == DONE:
            if not (np.abs(x) < BOUND).all():  # whole steps without an event look at no state
                status, message = Status.DIVERGED, Status.DIVERGED.sentence
            elif scene.ending(int(ints[MODE])) is not None:
                last = int(ints[EVENTS]) - 1  # it stands still from there on
                ints[WHOLE], floats[TAU] = rows[last, PERIODS], record[last, TIME]
                status = Status(scene.ending(int(ints[MODE])))
                message = status.sentence
            break
        m, g = int(ints[MODE]), int(ints[AT_GUARD])
        if code == FULL:
            rows = np.concatenate((rows, np.zeros_like(rows[:MOST_ROWS])))
            record = np.concatenate((record, np.zeros_like(record[:MOST_ROWS])))
        elif code == NEED:
            T = scene.expand(int(ints[LACKS]), g)
            _paced(scene, given, span)
            give_modal(T)
            engine = engine_of(scene)
            ints, floats = _resize(engine, T, ints, floats)
        elif code == LIMIT or (code != LOST and ints[COUNT] >= max_events):  # also of events that are decided here
            status = Status.TOO_MANY_EVENTS
            message = (f"{status.sentence} Element {scene.element_name(m, g)!r} at "
                       f"t = {ints[WHOLE] * period + floats[TAU]:.12g} fired event number {ints[COUNT]} of its period.")
            at_once = _at_once(ints, floats, rows, record)
            if at_once > INSTANTS:
                message += (f" {at_once} of them are at this instant: impacts that follow each other and are not shown to be "
                            "infinitely many; raise max_events.")
            break
        elif code == LOST:
            status, message = Status.DIVERGED, Status.DIVERGED.sentence
            break
        else:
            try:
                endless = scene.n > 0 and max(ints[INSTANT], ints[LOW]) > INSTANTS
                follows = settle.come_to_rest if endless else settle.decide
                if endless:  # looked at again after as many more
                    ints[INSTANT] = ints[LOW] = 0
                new, z = follows(scene, m, g, x, floats[SINCE])
            except settle.Inconsistent as error:
                n, at_once = int(ints[EVENTS]), _at_once(ints, floats, rows, record)
                ends = None if scene.n else accumulation(rows[:n], rows[:n, PERIODS] * period + record[:n, TIME])
                if ends is not None:
                    status = Status.ZENO
                    message = f"{status.sentence} They end at t = {ends[0]:.15g} (+- {ends[1]:.1g})."
                    floats[TAU] = ends[0] - ints[WHOLE] * period
                    break
                if scene.n or scene.region(m) or at_once >= AT_ONCE:
                    status = contradiction(scene, m, x)
                    message = f"{status.sentence} {error}"
                    if at_once >= AT_ONCE:
                        message += f"; after {at_once} events at this instant, to {_listed(scene, rows[n - at_once:n])}"
                    break
                new, z = settle.jumped_on(scene, m, g, x)
            T = scene.tables
            _paced(scene, given, span)
            give_modal(T)
            engine = engine_of(scene)
            ints, floats = _resize(engine, T, ints, floats)
            e = int(ints[EVENTS])
            rows[e] = m, g, new, EVENT, ints[WHOLE]
            record[e, TIME], record[e, SPEED], record[e, SPAN] = floats[TAU], floats[SINCE], 0.0
            record[e, STATE:STATE + scene.ns], record[e, STATE + scene.ns:] = x[:scene.ns], z[:scene.ns]
            ints[EVENTS] = e + 1
            ints[COUNT] += 1
            ints[MODE] = new
            x = z
        if code != FULL:
            _orders(scene, int(ints[MODE]), x, ints, floats)
    n = int(ints[EVENTS])
    head = np.array([[mode, -1, mode, 0, begin[0]]])
    rows = np.concatenate((head, rows[:n]))
    times = np.concatenate(([begin[1]], record[:n, TIME]))
    states = np.concatenate((np.hstack((first, first))[None], record[:n, STATE:]))
    recorded = Recorded(rows, times, np.concatenate(([0.0], record[:n, SPEED])), np.concatenate(([0.0], record[:n, SPAN])),
                        states[:, :scene.ns].copy(), states[:, scene.ns:].copy())
    stop = int(ints[WHOLE]) * period + floats[TAU]
    final = x[None, :scene.ns].copy()
    scene.show(int(ints[MODE]), final, floats[TAU:TAU + 1])
    return Trajectory(scene.system, begin[0] * period + begin[1], stop, final[0], status, message, recorded)


def _at_once(ints, floats, rows, record) -> int:
    """Return how many of the recorded events are at the present instant."""
    n = int(ints[EVENTS])
    return int(np.sum((rows[:n, PERIODS] == ints[WHOLE]) & (record[:n, TIME] == floats[TAU])))


def _listed(scene, rows) -> str:
    """Return the modes that events (N, 5) led to, each once."""
    return ", ".join(map(repr, dict.fromkeys(key for row in rows for key in scene.keys[row[AFTER]])))


def contradiction(scene, m, x) -> Status:
    """Return what it is that no combination of modes may follow mode ``m`` at ``x`` (nx,)."""
    if scene.n:
        return Status.INCONSISTENT
    T = scene.tables
    G = T.G[m, :T.n_guards[m]]
    return Status.CODIMENSION_TWO if (np.abs(G @ x) <= NEAR_SURFACE * (np.abs(G) @ np.abs(x))).sum() > 1 else Status.NO_TARGET


def _slice(scene, T, ints, floats, end, period: float):
    """Return the end of the next compiled call, whole periods and the rest; ``end`` where there is no more work than one may do."""
    span = (LAW_STEPS if scene.laws else WORK / T.A[0].size) * float(T.step[ints[MODE]])
    whole, tau = int(ints[WHOLE]), float(floats[TAU])
    left = (end[0] - whole) * period + end[1] - tau if end[0] != whole else end[1] - tau
    if left <= 1.5 * span or tau + span <= tau:
        return end
    over = int((tau + span) // period) if period < np.inf and period > 0.0 else 0
    return (whole + over, max(tau + span - over * period, 0.0))


def _paced(scene, x: np.ndarray, span: float) -> None:
    """Measure a scene without a clock by the motion from ``x`` (nx,), which lasts for ``span``."""
    if scene.period is None and not scene.laws:
        paced(scene.tables, x, span)


def _split(t: float, period: float) -> tuple[int, float]:
    whole = int(np.floor(t / period))
    return _carry(whole, t - whole * period, period)


def _carry(whole: int, tau: float, period: float) -> tuple[int, float]:
    if tau < 0.0:
        tau = 0.0
    if tau >= period:
        return whole + 1, tau - period
    return whole, tau


def _forcing(scene, tau: float, x: np.ndarray) -> None:
    """Write the forcing states behind the state."""
    x[scene.ns] = 1.0
    for i, k in enumerate(scene.harmonics):
        angle = k * (scene.omega or 0.0) * tau
        x[scene.ns + 1 + 2 * i], x[scene.ns + 2 + 2 * i] = np.cos(angle), np.sin(angle)


def _orders(scene, mode, x, ints, floats) -> None:
    """Write the orders of the zeros that the guards have at ``x``; one that is leaving has none and fires at once."""
    rule = settle.Rule(scene)
    scale = rule.sizes(mode, x)
    for g in range(scene.tables.n_guards[mode]):
        sign, order, slope = rule.leaving(mode, g, x, scale)
        ints[ORDERS + g] = order if sign <= 0 else 0
        floats[SLOPES + g] = slope


def _resize(engine, T, ints, floats):
    """Return the state of an integration for tables that have grown."""
    more_ints, more_floats = engine.workspace(T)
    more_ints[:ORDERS], more_floats[:SLOPES] = ints[:ORDERS], floats[:SLOPES]
    return more_ints, more_floats
