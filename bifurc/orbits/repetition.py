"""Whether simulation repeats an orbit: one period from one of its own states, compared in the middle of every interval.

The event-sequence equations know only the events that they list; simulation knows none of them and decides everything by
the rule of `flow.settle`.  An orbit that it does not repeat is a solution of equations and no motion.
"""
from dataclasses import dataclass

import numpy as np

from ..flow.scan import CHATTER, KIND, PERIODS
from ..flow.settle import Inconsistent, Penetration
from ..flow.simulate import simulate

ALLOWED = 1e-6  # scaled miss for each unit of the largest multiplier
MOST = 0.02  # scaled miss that is never rounding
GROWTH = 1e10  # largest multiplier above which rounding alone may miss by as much
LASTING = 1e-6  # forcing periods: what an interval that is shorter holds may be rounding
STARTS = 3  # states tried: where a held row or a slider begins, rounding may put one start on the wrong side


@dataclass(frozen=True, slots=True)
class Repetition:
    """How simulation repeats an orbit.

    Attributes
    ----------
    miss : float
        Largest scaled difference (dimensionless, natural sizes of the states) after a period and in the middle of the
        intervals between events; infinite where the simulation failed.
    allowed : float
        What rounding may make of it: 1e-6, and where that is not enough 1e-6 times the largest multiplier, at most .02;
        infinite where the multipliers are infinite or too large to tell.
    message : str
        How the simulation failed; empty if it did not.
    """

    miss: float
    allowed: float
    message: str = ""

    @property
    def repeated(self) -> bool:
        """Whether the motion is that of the orbit."""
        return self.miss <= self.allowed


def repetition(orbit) -> Repetition:
    """Return how simulation repeats a `PeriodicOrbit` over one period.

    Examples
    --------
    >>> import bifurc as bf
    >>> repetition(bf.find_orbit(bf.systems.impact_oscillator())).repeated
    True
    """
    best, allowed, message = np.inf, ALLOWED, ""
    at, spans = middles(orbit)
    states = orbit._states(at)
    for k in np.argsort(-spans, kind="stable")[:STARTS]:
        miss, message = _missed(orbit, at, spans, states, int(k))
        best = min(best, miss)
        if best > allowed == ALLOWED:
            allowed = _growing(orbit)
        if best <= allowed:
            return Repetition(best, allowed)
    return Repetition(best, allowed, message if best == np.inf else "")


def _growing(orbit) -> float:
    """Return the miss that rounding may grow to in a period of an orbit."""
    with np.errstate(all="ignore"):
        top = float(np.abs(orbit.multipliers).max(initial=1.0))
    return min(ALLOWED * max(top, 1.0), MOST) if top <= GROWTH else np.inf


def middles(orbit):
    """Return the middles (k,) of the intervals between events, forcing periods, and their durations."""
    whole, unknowns = orbit._whole
    times = unknowns.reshape(len(whole.nodes), -1)[:, 0]
    spans = np.diff(np.append(times, times[0] + whole.span))
    return times + 0.5 * spans, spans


def _missed(orbit, at, spans, states, k: int) -> tuple[float, str]:
    """Return the scaled miss of the motion from state ``k`` and what went wrong with it."""
    period = orbit.forcing_period
    begin = at[k] % 1.0
    span = orbit._whole[0].span
    length = {"duration": orbit.period} if orbit.autonomous else {"periods": orbit.periods}
    try:
        motion = simulate(orbit.system, states[k], t0=begin * period, **length)
    except (Penetration, Inconsistent, ValueError) as error:
        return np.inf, str(error)
    if not motion.success:
        return np.inf, motion.message
    later = np.mod(at - at[k], span)
    known = spans > LASTING
    known[k] = False
    known &= ~closed(motion, (begin + later) * period, period)
    there = [motion((begin + late) * period) for late in later[known]]
    found = np.array([*there, motion.final])
    wanted = np.concatenate([states[known], states[k][None]])
    return float((np.abs(found - wanted) / orbit.weights).max()), ""


def closed(motion, moments, period: float) -> np.ndarray:
    """Return at which moments (k,) a motion is in the rest of a complete chattering, which it does not resolve: there it
    has lost speeds that an orbit with more of them listed still shows, and what counts is its end."""
    R = motion.recorded
    rows = R.rows[:, KIND] == CHATTER
    begins = R.rows[rows, PERIODS] * period + R.times[rows]
    inside = (begins <= moments[:, None]) & (moments[:, None] < begins + R.spans[rows])
    return inside.any(axis=1)
