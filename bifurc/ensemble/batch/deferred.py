"""What a batch step defers: a substep with several events, or one that is not clear, by the scalar integrator."""
import numpy as np

from ..._jit import leaf, njit
from ...flow import scan
from ...flow.affine.engine import forcing
from ...flow.scan import COUNT, DONE, MODE, STATE, TAU  # noqa: F401 (DONE for the written step)
from ..scalar import ROWS, begin_at, integrate


@njit
def workspace(T):
    """Return what `substep` works on: state (ns,), tally (events, impacts and contacts, least speed of arrival), room."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    ints, floats = scan.workspace(T)
    return np.zeros(ns), np.zeros(3), np.zeros(nx), floats, np.zeros((ROWS, STATE + 2 * ns)), ints, np.zeros((ROWS, 5), np.int64)


@leaf
def substep(T, k, steps, h, m, room, limit):
    """Integrate ``room[0]`` (ns,) in place over substep ``k`` of a period; return status and mode; write the tally."""
    y, tally, x, floats, record, ints, rows = room
    last = k + 1 == steps
    begin_at(m, y, ints, floats, x)
    floats[TAU] = k * h
    forcing(T, k * h, x)
    tally[1], tally[2] = 0.0, np.inf
    status = integrate(T, ints, floats, x, 1 if last else 0, 0.0 if last else (k + 1) * h, limit, rows, record, tally[1:])
    tally[0] = ints[COUNT]
    for c in range(y.size):
        y[c] = x[c]
    return status, ints[MODE]
