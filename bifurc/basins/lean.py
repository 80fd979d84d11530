"""Labels of many starts, one degree of freedom under one harmonic: on the period march of `bifurc.flow.single`."""
import numpy as np

from .._jit import njit
from ..flow.scan import DONE, LIMIT
from ..flow.single import period, scratch
from .near import STAY, boxed, nearest
from .states import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED


@njit
def label(P, I, length, modes, X, limit, most, inverse, points, squares, owner, width, keys, keepers, labels, periods,
          impacts, states):
    """Follow the starts ``X`` (N, 2), in place, until they are near an attractor or ``most`` periods have passed.

    ``P, I, length`` are `bifurc.flow.single.pack`; ``inverse`` to ``keepers`` see `bifurc.basins.near`.  Writes label
    (-1: none), periods, impacts and state of each; starts with a negative mode are left to the caller.
    """
    work = scratch()
    counts = np.zeros(2, np.int64)
    for i in range(X.shape[0]):
        m = modes[i]
        if m < 0:
            continue
        labels[i] = -1
        states[i] = UNSETTLED
        counts[0] = 0
        counts[1] = 0
        stay = 0
        guest = -1
        y = X[i]
        for k in range(1, most + 1):
            code, m = period(P, I, length, m, y, work, counts, limit)
            periods[i] = k
            if code != DONE:
                states[i] = CROWDED if code == LIMIT else ASK
                break
            if not (abs(y[0]) < 1e150 and abs(y[1]) < 1e150):
                states[i] = DIVERGED
                break
            found = nearest(y, inverse, points, squares, owner)
            if found < 0 and keys.shape[0] > 0:
                keeper = boxed(y, inverse, width, keys, keepers)
                stay = stay + 1 if keeper >= 0 and keeper == guest else 0
                guest = keeper
                if stay >= STAY:
                    found = keeper
            if found >= 0:
                labels[i] = found
                states[i] = REACHED
                break
        impacts[i] = counts[1]
