"""LU of small dense matrices for compiled kernels: no library call, no threads, determinant as sign and logarithm.

Partial pivoting on rows scaled by their largest entry (implicit equilibration), so that a residual row in other units
does not spoil the pivot order.  Measured on 4 x 4: a threaded LAPACK call costs thirty times the arithmetic.
"""
import numpy as np

from .._jit import njit


@njit
def lu(a, pivot):
    """Factor ``a`` (n, n) in place, rows exchanged as ``pivot`` (n,) says; return (sign, log|det|), sign 0 if singular."""
    n = a.shape[0]
    sign = 1.0
    log = 0.0
    scale = np.empty(n)
    for i in range(n):
        top = 0.0
        for j in range(n):
            top = max(top, abs(a[i, j]))
        if not (0.0 < top < np.inf):
            return 0.0, -np.inf
        scale[i] = 1.0 / top
    for k in range(n):
        best, row = -1.0, k
        for i in range(k, n):
            size = abs(a[i, k]) * scale[i]
            if size > best:
                best, row = size, i
        pivot[k] = row
        if row != k:
            sign = -sign
            scale[row] = scale[k]
            for j in range(n):
                a[k, j], a[row, j] = a[row, j], a[k, j]
        d = a[k, k]
        if d == 0.0 or not np.isfinite(d):
            return 0.0, -np.inf
        if d < 0.0:
            sign = -sign
        log += np.log(abs(d))
        for i in range(k + 1, n):
            r = a[i, k] / d
            a[i, k] = r
            if r != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= r * a[k, j]
    return sign, log


@njit
def lu_solve(a, pivot, b):
    """Solve with the factors of `lu`; ``b`` (n,) is overwritten by the solution."""
    n = a.shape[0]
    for k in range(n):
        row = pivot[k]
        if row != k:
            b[k], b[row] = b[row], b[k]
    for i in range(1, n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]
