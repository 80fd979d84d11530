"""States of a recorded motion at any times: closed form from the last recorded state."""
import numpy as np

from .._jit import njit
from .affine import advance, forcing


@njit
def sample(T, modes, starts, states, index, spans, out):
    """Write the states (count, ns) at the times ``spans`` after the starts of the segments ``index`` into ``out``.

    ``modes``, ``starts`` (local time in the period) and ``states`` (segments, ns) describe the segments.
    """
    ns = states.shape[1]
    x = np.empty(T.A.shape[2])
    y1 = np.empty(ns)
    for i in range(index.size):
        k = index[i]
        for c in range(ns):
            x[c] = states[k, c]
        forcing(T, starts[k], x)
        advance(T, modes[k], x, spans[i], y1)
        for c in range(ns):
            out[i, c] = y1[c]
