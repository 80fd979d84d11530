"""LU of small dense matrices for compiled kernels: no library call, no threads, determinant as sign and logarithm.

Partial pivoting on rows scaled by their largest entry (implicit equilibration), so that a residual row in other units
does not spoil the pivot order.  Measured on 4 x 4: a threaded LAPACK call costs thirty times the arithmetic.
"""
import numpy as np

from .._jit import leaf, njit

BLOCKED = 24  # size from which on the arithmetic is more than the memory it walks through


@njit
def lu(a, pivot):
    """Factor ``a`` (n, n) in place, rows exchanged as ``pivot`` (n,) says; return (sign, log|det|), sign 0 if singular."""
    n = a.shape[0]
    scale = np.empty(n)
    for i in range(n):
        top = 0.0
        for j in range(n):
            top = max(top, abs(a[i, j]))
        if not (0.0 < top < np.inf):
            return 0.0, -np.inf
        scale[i] = 1.0 / top
    return factored(a, pivot, scale, 4 if n >= BLOCKED else n)


@leaf
def factored(a, pivot, scale, width):
    """Do what `lu` says, ``width`` columns at a time.

    With 4 each number is the same as with all n, but rows behind the columns are read and written a quarter as often.
    """
    n = a.shape[0]
    sign = 1.0
    log = 0.0
    for first in range(0, n, width):
        last = min(first + width, n)
        for k in range(first, last):
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
                    for j in range(k + 1, last):
                        a[i, j] -= r * a[k, j]
        if last == n:
            break
        for k in range(first + 1, last):
            for i in range(first, k):
                lessened(a[k, last:], a[k, i], a[i, last:])
        for i in range(last, n):
            lessened_by_four(a[i, last:], a[i, first:last], a[first, last:], a[first + 1, last:], a[first + 2, last:],
                             a[first + 3, last:])
    return sign, log


@leaf
def lessened(row, r, other):
    """Subtract a multiple of another row."""
    for j in range(row.size):
        row[j] -= r * other[j]


@leaf
def lessened_by_four(row, r, u0, u1, u2, u3):
    """Subtract multiples of four rows, one after the other."""
    r0, r1, r2, r3 = r[0], r[1], r[2], r[3]
    for j in range(row.size):
        row[j] = row[j] - r0 * u0[j] - r1 * u1[j] - r2 * u2[j] - r3 * u3[j]


@leaf
def inner(a, b):
    """Return the inner product of two vectors; four sums, as one would wait for itself."""
    n = a.size
    m = n - n % 4
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for j in range(0, m, 4):
        s0 += a[j] * b[j]
        s1 += a[j + 1] * b[j + 1]
        s2 += a[j + 2] * b[j + 2]
        s3 += a[j + 3] * b[j + 3]
    for j in range(m, n):
        s0 += a[j] * b[j]
    return (s0 + s1) + (s2 + s3)


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
