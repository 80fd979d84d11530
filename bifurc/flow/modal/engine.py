"""Engine of many degrees of freedom: the functions of `bifurc.flow.affine.engine` that move a state, in modal coordinates.

They take the place of those of the affine engine (`engine`, `event_free` and `peak` of `flow.affine`) in the kernels of scenes
with room for modal coordinates (`bifurc.compose.writer.twin`).  A mode whose eigenvectors do not allow them goes by the
tables, as with few degrees of freedom.
"""
import numpy as np

from ..._jit import both, njit
from ..affine import engine as affine
from ..affine import event_free, peak
from ..affine import hidden as at_zero
from .states import modal_arc, modal_blurred, modal_hidden, modal_reach, modal_state_series
from .steps import modal_coast, modal_land, modal_peak, modal_series

ENGINE = ("advance", "all_series", "arc", "leap", "propagate", "free_steps", "reach", "segment_peak", "state_series", "hidden",
          "blurred")


@njit
def is_modal(T, m):
    """Whether mode ``m`` has modal coordinates now."""
    return T.blocks[m, 3] > 0


@njit
def propagate(T, m, x, s, out):
    """Write the joined state (state and forcing) after ``s >= 0`` into ``out`` (nx,); by the tables up to a step."""
    if is_modal(T, m):
        modal_land(T, m, x, s, out)
    else:
        affine.propagate(T, m, x, s, out)


@njit
def advance(T, m, x, s, y1):
    """Write the state at time ``s >= 0`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    if is_modal(T, m):
        moved = np.empty(x.size)
        modal_land(T, m, x, s, moved)
        for i in range(y1.size):
            y1[i] = moved[i]
    else:
        affine.advance(T, m, x, s, y1)


@njit
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start."""
    if is_modal(T, m):
        modal_arc(T, m, x, s, y1, Phi)
    else:
        affine.arc(T, m, x, s, y1, Phi)


@njit
def leap(T, m):
    """See `bifurc.flow.affine.engine.leap`: modal coordinates are known after any time."""
    return np.inf if is_modal(T, m) else affine.leap(T, m)


@njit
def reach(T, m, x):
    """Duration from ``x`` on which the series of guards and states are good."""
    return modal_reach(T, m, x) if is_modal(T, m) else affine.reach(T, m, x)


@njit
def state_series(T, m, i, x, a):
    """Write the Taylor coefficients (ORDER+1,) of state ``i`` along the flow from ``x``; good up to `reach`."""
    if is_modal(T, m):
        modal_state_series(T, m, i, x, a)
    else:
        affine.state_series(T, m, i, x, a)


@njit
def all_series(T, m, x, orders, a):
    """Write the series (guards, ORDER+1) of the guards with a zero of known order below ORDER; return their reach."""
    return modal_series(T, m, x, orders, a) if is_modal(T, m) else affine.all_series(T, m, x, orders, a)


@njit
def free_steps(T, m, x, count, orders, slopes, room):
    """Advance ``x`` (nx,) in place by up to ``count`` steps of the tables; return the time that was proved free of events."""
    if is_modal(T, m):
        return modal_coast(T, m, x, count * T.step[m], orders, slopes)
    return event_free.free_steps(T, m, x, count, orders, slopes, room)


@both
def segment_peak(T, m, g, x, s, closing, low):
    """Largest interior maximum (value, time) of guard ``g`` on a segment, as `bifurc.flow.affine.peak.segment_peak`."""
    if is_modal(T, m):
        return modal_peak(T, m, g, x, s, closing, low)
    return peak.segment_peak(T, m, g, x, s, closing, low)


@njit
def hidden(T, m, g, x):
    """Whether guard ``g`` of mode ``m`` is zero to rounding at ``x`` (nx,), where a step has led."""
    return modal_hidden(T, m, g, x) if is_modal(T, m) else at_zero.hidden(T, m, g, x)


@njit
def blurred(T, m, x, scale):
    """Raise ``scale`` (nx,), see `rule.sizes`, to what a flight in mode ``m`` adds up that led to ``x`` (nx,); exact zeros stay."""
    if is_modal(T, m):
        modal_blurred(T, m, x, scale)
