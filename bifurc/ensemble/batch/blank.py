"""What a written module brings to `bifurc.ensemble.batch.driver`: its literal numbers, and the batch step.  This one stands in."""
import numpy as np

from ..._jit import njit

SIZE = 512  # starts that are carried side by side
NS, NX = 2, 5  # states, and with forcing states: 1, and cos and sin of every harmonic
FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = 0, 0, 0, 0  # of scratch that the batch step takes behind the scalar one


@njit
def workspace(T):
    """Return room for the scalar integrator behind the step; its first array is a state."""
    return (np.zeros(NS),)


@njit
def period_step(W, index, count, given, modes, limit, spare):
    """Take the first ``count`` starts of ``W`` over a forcing period, see `several_modes` and `smooth` beside it."""
