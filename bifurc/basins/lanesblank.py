"""What the written lane module brings to `bifurc.basins.lanesmarch`: its literal numbers, and the lap.  This one stands in."""
from .._jit import njit

LANES = 512  # starts that are carried side by side
GUARDS = 1  # largest number of guards of a mode
FORCINGS = 3  # forcing states: 1, and cos and sin of every harmonic
FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = 0, 0, 0, 0  # of scratch that the lap takes behind that of the march


@njit
def lap(W, index, count, numbers, grid, I, modes, limit):
    """Carry the first ``count`` lanes of ``W`` over a forcing period, see `bifurc.basins.lanestext` and `.lanesmodes`."""
