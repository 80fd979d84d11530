"""What the driver takes from the text of a batch step: the module that is written stands in the place of this one."""
from ..._jit import njit

NS, SIZE = 2, 0  # states of a start; starts that are carried side by side
AT_CAP = AT_HITS = AT_LEAST = AT_BEGUN = AT_FOUND = AT_EVENTS = AT_STATE = AT_LISTS = AT_IDS = 0  # see `several_modes.layout`


@njit
def period_step(W, index, count, given, modes, limit, spare):
    """Take the first ``count`` starts of ``W`` over a forcing period."""
