"""Lyapunov exponents through impacts and stops, with their standard errors.

Perturbations are carried by the exact arcs and saltation matrices along an exact motion (Mueller 1995) and
orthonormalised after every arc and every event (Benettin et al. 1980).  Errors are those of batch means.
"""
import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ..checks import checked, number, whole
from ..compose.scene import scene_of
from ..compose.writer import kernels
from ..content import Content
from ..elements import EventKind
from ..flow.initial import checked_state
from ..flow.scan import CHATTER, EVENT
from ..flow.settle import Rule
from ..flow.simulate import integrate
from ..flow.trajectory import Trajectory
from ..notebook import Notebook
from ..solve.interrupts import interruptible
from ..system import System, require_system
from .autonomous import slowest
from .base import Orbit
from .orbit import PeriodicOrbit
from .shooting.signature import coincide
from .standing import resting_start

CHUNK = 256  # forcing periods of one recorded piece
TURNED = 64  # last periods of the transient in which directions are carried along, not measured
LEAST_BATCHES = 4  # from which a spread is read
FAINT = 1e-8  # of the largest multiplier, or of 1: what is left of one below it in a product over a period is rounding
LONG = 1e6  # products of numbers: milliseconds
ROUNDS, TURNS = 96, 32  # times that directions are carried round an orbit, of which the first turn them


@dataclass(frozen=True, eq=False)
class LyapunovExponents(Content, Notebook):
    """Exponents of a motion, largest first.

    Attributes
    ----------
    values : ndarray
        (ns,), per unit of time; ``-inf`` where a direction dies (a rest on a rigid stop forgets two, dry friction that sticks
        one, a slider that slips one).
    errors : ndarray
        (ns,), standard errors of `values` from batch means, at least one over the time of the average: by so much a direction
        and the measure of its length matter; 0 for ``-inf``.
    per_period : ndarray
        (ns,), `values` times the forcing period (without excitation: what counts as one).
    impacts : float
        Kicks a forcing period.
    sum_rule : float
        What the sum of `values` must be: mean divergence of the vector field, plus log|det| of the kicks, plus what dry
        friction that turns round squeezes together; ``-inf`` where a direction dies.
    state : ndarray
        (ns,), where the motion ended, at a whole forcing period: a start to go on from.
    periods : int
    """

    _facts = ("values", "errors", "per_period", "sum_rule", "chaotic")
    _panels = None

    values: np.ndarray
    errors: np.ndarray
    per_period: np.ndarray = field(repr=False)
    impacts: float
    sum_rule: float
    state: np.ndarray = field(repr=False)
    periods: int

    @property
    def chaotic(self) -> bool:
        """Whether the largest exponent is positive by more than four standard errors."""
        return bool(self.values[0] > 4.0 * self.errors[0] and self.values[0] > 0.0)


@checked()
def lyapunov_exponents(system: System, y0=None, periods: int = 2000, transient: int = 200, batches: int = 20,
                       max_events: int = 2000, period: float | None = None) -> LyapunovExponents:
    """Return the Lyapunov exponents of the motion from a state.

    Without excitation one exponent of a motion that does not come to rest is zero: that of a shift along it.

    Parameters
    ----------
    system : System
    y0 : array_like, Trajectory, PeriodicOrbit, HarmonicOrbit, or None
        State (2 n,) or (ns,) at phase 0; a motion, which goes on from its last section; a periodic orbit, whose exponents are
        the logarithms of its multipliers, stable or not, with no error (those of multipliers below the rounding of a period
        come from tangent vectors that are orthonormalised along the orbit, with an error); a harmonic orbit, whose state at
        phase 0 is the start; None: rest.
    periods : int
        Forcing periods that are averaged over, a multiple of `batches` at least 2 `batches`.
    transient : int
        Forcing periods before that.
    batches : int
        Batches of the standard error, at least 4.
    max_events : int
        Largest number of events a forcing period.
    period : float, optional
        Of a system without excitation: the time that counts as a period; default: that of the slowest oscillation of a mode.

    Returns
    -------
    LyapunovExponents

    Raises
    ------
    ValueError
        For impossible counts, or a ``period`` where the excitation gives it.
    ArithmeticError
        When the motion does not complete; the message is that of the simulation.

    References
    ----------
    P. C. Mueller, Chaos, Solitons and Fractals 5 (1995) 1671; G. Benettin et al., Meccanica 15 (1980) 9.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=2.8, amplitude=1.0, gap=0.0, restitution=0.8)
    >>> bf.lyapunov_exponents(system, (-0.5, 0.0), periods=400).chaotic
    True
    """
    scene = scene_of(require_system(system))
    if isinstance(y0, PeriodicOrbit):
        return of_orbit(system, y0)
    if scene.period is not None and period is not None:
        raise ValueError(f"period = {period!r} is not allowed; the excitation of {system!r} gives it")
    if period is not None:
        number("lyapunov_exponents", "period", period, above=0.0)
    unit = scene.period or period or slowest(scene)
    forced = scene.period is not None
    check = partial(whole, "lyapunov_exponents")
    batches, transient = check("batches", batches, least=4), check("transient", transient, least=0)
    periods, max_events = check("periods", periods, least=2 * batches), check("max_events", max_events, least=1)
    periods -= periods % batches
    y = _start(scene, y0)
    now, turned = 0, max(0, transient - TURNED)
    while now < turned:
        step = min(CHUNK, turned - now)
        y = _checked(integrate(scene, y, *_span(forced, now, step, unit), max_events * (1 if forced else step))).final
        now += step
    ns = scene.ns
    Q, alive = np.eye(ns), np.array([ns, 0], np.int64)
    sums = np.zeros((periods, ns))
    kicks, logs = 0, 0.0
    begin, end = transient, transient + periods
    while now < end:
        step = min(CHUNK, (begin if now < begin else end) - now) if forced else 1
        span = _span(forced, now, step, unit)
        motion = _checked(integrate(scene, y, *span, max_events))
        R = motion.recorded
        turning = now < begin  # the directions turn to where they belong before they are measured
        into = np.zeros((step, ns)) if turning else sums if forced else sums[now - begin:now - begin + 1]
        first = now if turning else begin
        _grow(scene, R, span[1], unit, first if forced else 0, Q, alive, into)
        if turning:
            y = motion.final
            now += step
            continue
        count, log = _contraction(scene, R, span[1][0] * unit + span[1][1])
        kicks, logs = kicks + count, logs + log
        y = motion.final
        now += step
    per_period = sums.mean(axis=0)
    errors = errors_of(sums, batches) / unit
    per_period[alive[0]:], errors[alive[0]:] = -np.inf, 0.0
    if alive[0] < ns:
        logs = -np.inf
    order = np.argsort(-per_period, kind="stable")
    return LyapunovExponents(per_period[order] / unit, errors[order], per_period[order], kicks / periods,
                             logs / (periods * unit), y, periods)


def errors_of(sums: np.ndarray, batches: int) -> np.ndarray:
    """Return the standard errors (ns,) of the means of a record (periods, ns) of growths.

    Growths may follow each other slowly: of batches, pairs of them, pairs of pairs, as long as there are four, the largest error
    counts. What a direction grows by depends on how lengths are measured, and on where it turns to in the last period: a factor of
    the order of e in all, which no spread of batches shows.
    """
    periods, ns = sums.shape
    batch = sums.reshape(batches, -1, ns).mean(axis=1)
    found = np.zeros(ns)
    while len(batch) >= LEAST_BATCHES:
        found = np.maximum(found, batch.std(axis=0, ddof=1) / np.sqrt(len(batch)))
        batch = batch[:len(batch) // 2 * 2].reshape(len(batch) // 2, 2, ns).mean(axis=1)
    return np.hypot(found, 1.0 / periods)


def _span(forced: bool, now: int, step: int, unit: float) -> tuple[tuple[int, float], tuple[int, float]]:
    """Return begin and end, (whole periods, local time) each, of some periods; without excitation time begins anew."""
    return ((now, 0.0), (now + step, 0.0)) if forced else ((0, 0.0), (0, step * unit))


def of_orbit(system: System, orbit) -> LyapunovExponents:
    """Return the exponents of a periodic orbit: ln |multiplier| over its period; 0 for states that nothing changes in it."""
    if not orbit.success:
        raise ValueError(f"y0 = {orbit!r} is not allowed; it must be an orbit that was found ({orbit.message})")
    if orbit.system != system:
        raise ValueError("y0: the orbit is one of another system (or of other parameters); give an orbit of this one")
    scene = scene_of(system)
    sizes = np.sort(np.concatenate([np.abs(orbit.multipliers), np.ones(scene.ns - len(orbit.multipliers))]))[::-1]
    if not np.isfinite(sizes).all():
        raise ArithmeticError(f"the orbit has no multipliers: {orbit.message}")
    clear = sizes > FAINT * max(1.0, sizes[0])
    logs, errors = np.log(np.where(clear, sizes, 1.0)), np.zeros(len(sizes))
    kicks = sum(event.kind in (EventKind.IMPACT, EventKind.CHATTER) for event in orbit.events)
    total = float(logs.sum())
    if not clear.all():  # gone, or faint: directions carried arc by arc tell
        grown, spread, total = _round(scene, orbit)
        logs[~clear], errors[~clear] = grown[~clear], spread[~clear]
    values = logs / orbit.period
    return LyapunovExponents(values, errors / orbit.period, values * (orbit.period / orbit.periods), kicks / orbit.periods,
                             total / orbit.period, orbit.state, orbit.periods)


def _round(scene, orbit) -> tuple[np.ndarray, np.ndarray, float]:
    """Return how much directions grow along an orbit (ns,), largest first and as logarithms, with standard errors, and volumes."""
    forced, unit = scene.period is not None, scene.period or orbit.period
    span = _span(forced, 0, orbit.periods, unit)
    R = _checked(integrate(scene, orbit.state, *span, 2000 * orbit.periods)).recorded
    Q, alive, sums = np.eye(scene.ns), np.array([scene.ns, 0], np.int64), np.zeros((ROUNDS, scene.ns))
    for row in sums:
        into = np.zeros((orbit.periods, scene.ns))
        _grow(scene, R, span[1], unit, 0, Q, alive, into)
        row[:] = into.sum(axis=0)
    grown, errors = sums[TURNS:].mean(axis=0), errors_of(sums[TURNS:], LEAST_BATCHES)
    total = _contraction(scene, R, span[1][0] * unit + span[1][1])[1]
    grown[alive[0]:], errors[alive[0]:] = -np.inf, 0.0
    order = np.argsort(-grown, kind="stable")
    return grown[order], errors[order], -np.inf if alive[0] < scene.ns else total


def _grow(scene, R, end, unit: float, first: int, Q, alive, into) -> None:
    """Carry the directions ``Q`` (ns, ns) along a record up to ``end`` and add the logarithms of their growth to ``into``."""
    tangent = kernels(scene, "bifurc.flow.tangent")
    long = len(R.rows) * scene.ns**3 > LONG
    interruptible(long, partial(alive.__setitem__, 1, 1), tangent.grow, scene.tables, R.rows, R.times, R.before, R.after,
                  _together(scene, R), end, unit, first, Q, alive, into)


def _start(scene, y0) -> np.ndarray:
    """Return the state (ns,) at phase 0 that `lyapunov_exponents` starts from."""
    if y0 is None:
        return resting_start(scene.system)
    if isinstance(y0, Trajectory):
        _checked(y0)
        if scene.period is None:
            return y0.final
        if not len(y0.sections):
            raise ValueError("y0: the motion passes no section (a whole forcing period); simulate it further")
        return y0.sections[-1]
    return checked_state(scene, y0.state if isinstance(y0, Orbit) else y0, 0.0)


def _checked(motion):
    if not motion.success:
        raise ArithmeticError(motion.message)
    return motion


def _together(scene, R) -> np.ndarray:
    """Return which events of a record (N,) always happen at the instant of the one before."""
    found, known = np.zeros(len(R.rows), bool), {}
    for i in np.flatnonzero((np.diff(R.times) == 0.0) & (np.diff(R.rows[:, 4]) == 0)).tolist():
        first, then = R.rows[i, :4].tolist(), R.rows[i + 1, :4].tolist()
        if first[3] == then[3] == EVENT and first[2] == then[0]:
            pair = (*first[:3], then[1])
            if pair not in known:
                known[pair] = coincide(scene, scene.tables, first[:3], then[1])
            found[i + 1] = known[pair]
    return found


def _contraction(scene, R, end) -> tuple[int, float]:
    """Return the number of impacts of a record up to the time ``end``, and the logarithm of the factor that changes volumes."""
    T, ns, n = scene.tables, scene.ns, scene.n
    starts = R.rows[:, 4] * (scene.period or 0.0) + R.times
    spans = np.diff(np.append(starts, end))
    if scene.closed_form:
        traces = np.array([np.trace(T.A[m, :, :ns]) for m in range(len(scene.keys))])
        total = float(spans @ traces[R.rows[:, 2]])
    else:  # the divergence depends on the state: volumes of the arcs
        total = sum(_volume(scene, *arc) for arc in zip(R.rows[:, 2], R.after, R.times, spans, strict=True))
    before, guard, after, what = R.rows[:, :4].T
    collapsed = np.flatnonzero((what == CHATTER) | (what == EVENT) & (T.n_holds[after] > T.n_holds[before]))
    events = np.flatnonzero((what == EVENT) | (what == CHATTER))  # a complete chattering counts once
    kicks = events[T.kick[before[events], guard[events]] != 0]
    if collapsed.size:
        return kicks.size, -np.inf
    turns = [i for i in np.setdiff1d(events, kicks).tolist() if _meets_speeds(T, R.rows[i], n)]
    total += sum(_folding(scene, R, i) for i in turns)
    if not kicks.size:
        return 0, total
    rule = Rule(scene)
    states = np.hstack([R.before[kicks], scene.forcing(R.times[kicks])])
    slopes = [rule.jump(m, g, x)[1][n:2 * n, n:2 * n] for m, g, x in zip(before[kicks], guard[kicks], states, strict=True)]
    with np.errstate(divide="ignore"):
        return kicks.size, total + 2.0 * float(np.log(np.abs(np.linalg.det(np.array(slopes)))).sum())


def _volume(scene, m: int, y, tau: float, span: float, halvings: int = 12) -> float:
    """Return the logarithm of the factor by which an arc changes volumes, of parts in which no direction is lost in rounding."""
    y1, Phi = np.empty(scene.ns), np.empty((scene.ns, scene.ns))
    x = np.concatenate([y, scene.forcing(np.array([tau]))[0]])
    kernels(scene).arc(scene.tables, m, x, max(span, 0.0), y1, Phi)
    if halvings and np.linalg.cond(Phi) > 1.0 / FAINT:
        half = 0.5 * span
        kernels(scene).arc(scene.tables, m, x, half, y1, Phi)
        return _volume(scene, m, y, tau, half, halvings - 1) + _volume(scene, m, y1, tau + half, half, halvings - 1)
    return float(np.linalg.slogdet(Phi)[1])


def _meets_speeds(T, row, n: int) -> bool:
    """Whether the guard of an event looks at speeds or at forces, whose rates the event may change; a release forgets nothing."""
    before, guard, after = row[:3].tolist()
    return T.n_holds[before] == T.n_holds[after] and bool(T.G[before, guard, n:2 * n].any() or T.LG[before, guard].any())


def _folding(scene, R, i: int) -> float:
    """Return the logarithm of the factor by which an event without a kick changes volumes: rates of its guard, behind over before.

    It is 0 where forces are continuous.  Dry friction that turns round in one instant pushes from both sides.
    """
    T, kernel, ns = scene.tables, kernels(scene), scene.ns
    before, guard, after = R.rows[i, :3].tolist()
    forcing = scene.forcing(R.times[i:i + 1])[0]
    rates, f, dw, row = [], np.empty(ns), np.empty(len(forcing)), np.empty(ns + len(forcing))
    for mode, y in ((before, R.before[i]), (after, R.after[i])):
        x = np.concatenate([y, forcing])
        kernel.field(T, mode, x, f)
        kernel.forcing_rate(T, x, dw)
        kernel.guard_gradient(T, before, guard, x, row)
        rates.append(float(row[:ns] @ f + row[ns:] @ dw))
    return math.log(abs(rates[1] / rates[0])) if rates[0] and rates[1] else -math.inf
