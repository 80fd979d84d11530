"""Engine of modes under a law that is not affine: the functions of `bifurc.flow.affine.engine`, by the steps of `collocation`.

The state after a time takes long steps whose defect, the interpolated against the true acceleration at the ends of the
step, is small; the state errs like its square.  Guards become polynomials on shorter steps (`guards`).
"""
import numpy as np

from ..._jit import leaf, njit
from ...compose.pointer import WORD
from .calls import ALIKE, BESIDE, HIGHER, WISH, longest, rate, scratch_of, step
from .gauss import NODES

ENGINE = ("field", "advance", "propagate", "arc", "arc_beside", "leap", "KNOWS_BESIDE")
KNOWS_BESIDE = True
DEFECT = 2e-8  # aimed at in a step


@njit
def field(T, m, x, f):
    """Write y' of mode ``m`` into ``f`` (ns,)."""
    rate(T, m, x, f, np.empty((4, T.LU.shape[0], 1)))


@njit
def integrate(T, m, x, s, x1, X):
    """Joined state after the time ``s`` from ``x`` (nx,) into ``x1`` (nx,); rows of ``X`` (count, ns) are carried along."""
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], x.size
    integrated(T, m, x, s, x1, X, scratch_of(T, X.shape[0]), np.empty((n + rows) * (NODES + 2)), np.empty(nx))


@leaf
def integrated(T, m, x, s, x1, X, scratch, room, now):
    """Do what `integrate` says; ``scratch`` is that of `step`, ``room`` takes its accelerations and forces, ``now`` (nx,) is
    overwritten."""
    nx = x.size
    acc, force = room, room[T.LP.shape[2] * (NODES + 2):]
    for c in range(nx):
        now[c] = x1[c] = x[c]
    top = longest(T.harmonics, T.flat[0])
    left = s
    count = int(np.ceil(abs(s) / min(top, T.step[m])))
    while count > 0:
        tried = left / count
        h = step(T, m, now, tried, DEFECT, x1, acc, force, X, 0, room, scratch)
        left -= h
        count -= 1
        if h == tried and count == 0 or not abs(x1[0]) < np.inf:
            return
        for c in range(nx):
            now[c] = x1[c]
        wish = scratch[WISH]
        if h != tried or wish < 0.8 * abs(h) or wish > 1.6 * abs(h):
            count = int(np.ceil(abs(left) / min(wish, top)))


@leaf
def leap(T, m):
    """See `bifurc.flow.affine.engine.leap`: a step of the affine part, under a law it may be many."""
    return T.step[m]


@njit
def propagate(T, m, x, s, out):
    """Write the joined state (state and forcing) after ``s`` into ``out`` (nx,)."""
    integrate(T, m, x, s, out, np.empty((0, 2)))


@njit
def advance(T, m, x, s, y1):
    """Write the state at time ``s`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    x1 = np.empty(x.size)
    integrate(T, m, x, s, x1, np.empty((0, 2)))
    for i in range(y1.size):
        y1[i] = x1[i]


@njit
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start."""
    ns = y1.size
    x1, X = np.empty(x.size), np.eye(ns)
    integrate(T, m, x, s, x1, X)
    for i in range(ns):
        y1[i] = x1[i]
        for c in range(ns):
            Phi[i, c] = X[c, i]


@njit
def arc_beside(T, m, x, s, numbers, y1, Phi, change):
    """Like `arc`, with the ``change`` (ns,) of the state at the same phase of the forcing, to first order, where ``numbers`` near
    those of the tables stand in their place."""
    n, rows, nx, ns = T.LP.shape[2], T.LU.shape[0], x.size, y1.size
    x1, X, scratch = np.empty(nx), np.eye(ns + 1)[:, :ns].copy(), scratch_of(T, ns + 1)
    flat, scratch[BESIDE] = T.flat, ALIKE
    scratch[HIGHER] = numbers[0] / flat[0] - 1.0 if flat[0] > 0.0 else 0.0
    for k in range(1, flat.size):
        if numbers[k] != flat[k]:
            scratch[BESIDE] = (numbers.ctypes.data - flat.ctypes.data) // WORD
            break
    integrated(T, m, x, s, x1, X, scratch, np.empty((n + rows) * (NODES + 2)), np.empty(nx))
    for i in range(ns):
        y1[i], change[i] = x1[i], X[ns, i]
        for c in range(ns):
            Phi[i, c] = X[c, i]
