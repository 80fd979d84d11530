"""What a written module brings to `bifurc.ensemble.batch.driver`: its literal numbers, and the batch step.  This one stands in."""
from ..._jit import njit

SIZE = 512  # starts that are carried side by side
NS = 2  # of a start
GUARDS = 1  # largest number of guards of a mode
FORCINGS = 3  # forcing states: 1, and cos and sin of every harmonic
FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = 0, 0, 0, 0  # of scratch that the batch step takes behind the scalar one


@njit
def period_step(W, index, count, P, numbers, grid, I, modes, limit):
    """Take the first ``count`` starts of ``W`` over a forcing period, see `one_mode`, `several_modes` and `smooth` beside it."""
