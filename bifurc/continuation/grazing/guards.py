"""A guard and the field of its mode near a touch: rows of the tables where they are affine, kernels where they are laws."""
import numpy as np

from ...compose.tables import ORDER


def of_law(T, mode, guard) -> bool:
    """Whether a guard is a law itself, such as the clearance of a disk in a bore: its row in the tables is zero."""
    return bool(T.LG[mode, guard].any())


def guard_size(e, T, mode, guard, joined) -> float:
    """Return the natural size of a guard at a joined state (nx,), which only one that is a law reads."""
    row = T.G[mode, guard].copy()
    if of_law(T, mode, guard):
        e.kernel.guard_gradient(T, mode, guard, joined, row)
    return float(e.kernel.scale_of(row, e.weights))


def guard_series(e, T, mode, guard, joined) -> np.ndarray:
    """Return the Taylor coefficients (ORDER + 1,) of a guard along the motion from a joined state (nx,)."""
    if not of_law(T, mode, guard):
        return joined @ T.GT[mode, guard]
    a = np.empty(ORDER + 1)
    e.kernel.guard_series(T, mode, guard, joined, a)
    return a


def field_slope(e, T, mode, x):
    """Derivative of the field in the joined state (ns, nx): the table, or differences where a law acts."""
    ns = T.A.shape[1]
    if T.LU.shape[0] == 0:
        return T.A[mode]
    found = np.empty((ns, x.size))
    for c in range(x.size):
        step = 1e-6 * max(float(e.weights[c]) if c < ns else 1.0, abs(x[c]))
        sides = []
        for sign in (1.0, -1.0):
            moved, f = x.copy(), np.empty(ns)
            moved[c] += sign * step
            e.kernel.field(T, mode, moved, f)
            sides.append(f)
        found[:, c] = (sides[0] - sides[1]) / (2.0 * step)
    return found
