"""Engine of affine modes: vector field, state after a time and its derivative, in closed form from the Taylor tables.

With ``x = (y, w)`` the flow over a time ``s`` is ``y(s) = E(s) x``; a long time is whole steps of the table (their
product by repeated squaring where the derivative is wanted) and one Taylor remainder.  Laws that are not affine have a
written module with functions of the same names and signatures.
"""
import numpy as np

from .._jit import njit
from ..compose.tables import ORDER


@njit
def forcing(T, t, x):
    """Write the forcing states w(t) behind the state in ``x`` (nx,)."""
    ns = T.A.shape[1]
    x[ns] = 1.0
    for k in range(T.harmonics.size):
        angle = T.harmonics[k] * T.flat[0] * t
        x[ns + 1 + 2 * k] = np.cos(angle)
        x[ns + 2 + 2 * k] = np.sin(angle)


@njit
def field(T, m, x, f):
    """Write y' = A x of mode ``m`` into ``f`` (ns,)."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            total += T.A[m, i, c] * x[c]
        f[i] = total


@njit
def remainder(T, m, x, s, y1):
    """State after ``0 <= s <= step`` by the Taylor rows."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            e = 0.0
            for j in range(ORDER, -1, -1):
                e = e * s + T.YT[m, i, c, j]
            total += e * x[c]
        y1[i] = total


@njit
def march(T, m, x, k):
    """Advance ``x = (y, w)`` by ``k`` whole steps in place."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    y1 = np.empty(ns)
    for _ in range(k):
        for i in range(ns):
            total = 0.0
            for c in range(nx):
                total += T.E[m, i, c] * x[c]
            y1[i] = total
        for i in range(ns):
            x[i] = y1[i]
        for q in range(T.harmonics.size):
            c = ns + 1 + 2 * q
            cos, sin = T.turn[m, 1 + 2 * q], T.turn[m, 2 + 2 * q]
            a, b = x[c], x[c + 1]
            x[c] = cos * a - sin * b
            x[c + 1] = sin * a + cos * b


@njit
def advance(T, m, x, s, y1):
    """Write the state at time ``s >= 0`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    k = int(s / T.step[m])
    if k == 0:
        remainder(T, m, x, s, y1)
        return
    moved = x.copy()
    march(T, m, moved, k)
    remainder(T, m, moved, max(s - k * T.step[m], 0.0), y1)


@njit
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start.

    The derivatives in the times follow from the vector field f: ``f(y1)`` in the end time, ``-Phi f(x)`` in the start.
    """
    ns = T.A.shape[1]
    k = int(s / T.step[m])
    s -= k * T.step[m]
    if s < 0.0:
        s = 0.0
    for i in range(ns):
        for c in range(ns):
            e = 0.0
            for j in range(ORDER, -1, -1):
                e = e * s + T.YT[m, i, c, j]
            Phi[i, c] = e
    if k == 0:
        remainder(T, m, x, s, y1)
        return
    moved = x.copy()
    march(T, m, moved, k)
    remainder(T, m, moved, s, y1)
    square = T.E[m, :, :ns].copy()  # Phi <- Phi E^k by the binary digits of k; all factors commute
    scratch = np.empty((ns, ns))
    while k > 0:
        if k & 1:
            multiply(Phi, square, scratch)
            Phi[:] = scratch
        k >>= 1
        if k > 0:
            multiply(square, square, scratch)
            square[:] = scratch


@njit
def multiply(a, b, out):
    """out = a b for small square matrices, without a library call."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        for k in range(n):
            r = a[i, k]
            for j in range(n):
                out[i, j] += r * b[k, j]
