"""States of a recorded motion at any times: closed form from the last recorded state."""
import numpy as np

from .._jit import njit
from .affine.engine import advance, forcing, leap


@njit
def sample(T, modes, starts, states, index, spans, out):
    """Write the states (count, ns) at the times ``spans`` after the starts of the segments ``index`` into ``out``.

    ``modes``, ``starts`` (local time in the period) and ``states`` (segments, ns) describe the segments.  Times of one segment
    that rise cost no more together than the segment is long.
    """
    ns, last, mark = states.shape[1], -1, 0.0
    x = np.empty(T.A.shape[2])
    y1 = np.empty(ns)
    for i in range(index.size):
        k = index[i]
        if k != last or spans[i] < mark:
            last, mark = k, 0.0
            for c in range(ns):
                x[c] = states[k, c]
            forcing(T, starts[k], x)
        far = leap(T, modes[k])
        while spans[i] - mark > 2.0 * far:
            advance(T, modes[k], x, far, y1)
            mark += far
            for c in range(ns):
                x[c] = y1[c]
            forcing(T, starts[k] + mark, x)
        advance(T, modes[k], x, spans[i] - mark, y1)
        for c in range(ns):
            out[i, c] = y1[c]
