"""Labels of many starts of any scene: on the general march `bifurc.flow.scan.run`, or its twin written around laws."""
import numpy as np

from .._jit import njit
from ..flow.scan import COUNT, DONE, EVENTS, INSTANT, LIMIT, LOST, MODE, ORDERS, SLOPES, STATE, TAU, WHOLE, run, workspace
from .near import STAY, boxed, nearest
from .states import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED


@njit
def label(T, modes, X, limit, most, inverse, points, squares, owner, width, keys, keepers, labels, periods, impacts, states):
    """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed.

    ``inverse`` to ``keepers`` see `bifurc.basins.near`.  Writes label (-1: none), periods, impacts and state of each;
    starts with a negative mode are left to the caller.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    ints, floats = workspace(T)
    rows = np.zeros((0, 5), np.int64)
    record = np.zeros((0, STATE + 2 * ns))
    x = np.empty(nx)
    y = x[:ns]
    for i in range(X.shape[0]):
        m = modes[i]
        if m < 0:
            continue
        for c in range(ns):
            x[c] = X[i, c]
        for c in range(ns, nx):
            x[c] = 1.0 if c == ns or (c - ns) % 2 == 1 else 0.0
        ints[:] = 0
        floats[:] = np.nan
        ints[MODE], floats[TAU] = m, 0.0
        labels[i] = -1
        states[i] = UNSETTLED
        stay = 0
        guest = -1
        for k in range(1, most + 1):
            code = run(T, ints, floats, x, k, 0.0, limit, rows, record)
            periods[i] = k
            if code != DONE:
                states[i] = CROWDED if code == LIMIT else (DIVERGED if code == LOST else ASK)
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
        impacts[i] = ints[EVENTS]
        for c in range(ns):
            X[i, c] = x[c]
