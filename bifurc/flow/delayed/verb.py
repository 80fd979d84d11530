"""What `simulate` does with a system that has delayed feedback: arguments checked, the past made callable."""
from functools import partial

import numpy as np

from ...compose.scene import scene_of
from ...motion import Motion
from ...system import System
from ..initial import checked_length, checked_state
from .integration import feedbacks_of, integrate, without_feedback
from .motion import DelayedMotion


def simulate_delayed(system: System, y0, periods, duration, t0, max_events, history) -> DelayedMotion:
    """Return the motion of a system with `DelayedFeedback`; the arguments are those of `simulate`.

    Raises
    ------
    ValueError
        As `simulate`; for delayed feedbacks with different delays, and for a history that does not reach one delay back.
    """
    feedbacks = feedbacks_of(system)
    free = scene_of(without_feedback(system))
    t0, length = checked_length(free, periods, duration, t0)
    y0 = checked_state(free, y0, t0)
    if periods is not None:
        length *= free.period or 1.0
    delay = feedbacks[0].delay_of(system.omega)
    past, events = past_of(history, t0, delay, y0.size)
    return integrate(system, y0, t0, t0 + length, past, events, max_events)


def past_of(history, t0: float, delay: float, ns: int):
    """Return the past as a callable that gives states (k, ns) at times (k,), and the times of its events."""
    if history is None:
        return None, []
    if isinstance(history, Motion):
        past, events = history.past(t0, delay)
    elif callable(history):
        past, events = history, []
    else:
        raise ValueError(f"history = {history!r} is not allowed; it must be a motion, an orbit, or a function of time")

    return partial(_states, history, past, ns), events


def _states(history, past, ns: int, t: np.ndarray) -> np.ndarray:
    """Return what a history gives at times ``t`` (k,), (ns,) or (k, ns), or raise ValueError when these are no states."""
    given = np.asarray(past(t))
    try:
        found = given.astype(float, casting="safe")
    except (TypeError, ValueError):
        raise ValueError(f"history = {history!r} gives {given!r:.60}; it must give states of real numbers") from None
    if found.shape not in ((ns,), (t.size, ns)):
        raise ValueError(f"history = {history!r} gives an array of shape {found.shape} at {t.size} times; it must give states "
                         f"({t.size}, {ns}), positions and then velocities, or one state ({ns},) that lasts")
    if not np.isfinite(found).all():
        raise ValueError(f"history = {history!r} gives numbers that are not finite at t = {t.min():g} to {t.max():g}")
    return found
