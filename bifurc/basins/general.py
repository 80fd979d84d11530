"""Labels of many starts of any scene: on the general march `bifurc.flow.scan.run`, or its twin written around laws."""
import numpy as np

from .._jit import njit
from ..elements import EventKind
from ..flow.scan import BEFORE, DONE, EVENTS, FULL, GUARD, KIND, LIMIT, LOST, MODE, PASSED, STATE, TAU, run, workspace
from .near import STAY, boxed, nearest
from .states import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED

CONTACT = EventKind.CONTACT.code
ROWS = 64  # of the record from which impacts are counted


@njit
def label(T, modes, X, limit, most, inverse, points, squares, owner, width, keys, keepers, labels, periods, impacts,
          states):
    """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed.

    ``inverse`` to ``keepers`` see `bifurc.basins.near`.  Writes label (-1: none), periods, impacts and state of each;
    starts with a negative mode are left to the caller.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    kick, kind = T.kick, T.kind
    ints, floats = workspace(T)
    rows = np.zeros((ROWS, 5), np.int64)
    record = np.zeros((ROWS, STATE + 2 * ns))
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
        impacts[i] = 0
        stay = 0
        guest = -1
        for k in range(1, most + 1):
            code = FULL
            while code == FULL:
                code = run(T, ints, floats, x, k, 0.0, limit, rows, record)
                for e in range(ints[EVENTS]):
                    if rows[e, KIND] != PASSED and rows[e, GUARD] >= 0:
                        m, g = rows[e, BEFORE], rows[e, GUARD]
                        impacts[i] += 1 if kick[m, g] == 1 or kind[m, g] == CONTACT else 0
                ints[EVENTS] = 0
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
        for c in range(ns):
            X[i, c] = x[c]
