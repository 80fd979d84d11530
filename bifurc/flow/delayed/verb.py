"""What `simulate` does with a system that has delayed feedback: arguments checked, the past made callable."""
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
    t0, length = checked_length(free, periods, duration, t0, max_events)
    y0 = checked_state(free, y0, t0)
    if periods is not None:
        length *= free.period or 1.0
    delay = feedbacks[0].delay_of(system.omega)
    past, events = past_of(history, t0, delay)
    return integrate(system, y0, t0, t0 + length, past, events, max_events)


def past_of(history, t0: float, delay: float):
    """Return the past as a callable, and the times of its events."""
    if history is None:
        return None, []
    if isinstance(history, Motion):
        return history.past(t0, delay)
    if callable(history):
        return (lambda t: np.asarray(history(t), float)), []
    raise ValueError(f"history = {history!r} is not allowed; it must be a motion, an orbit, or a function of time")
