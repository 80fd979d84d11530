"""LU of small dense matrices for compiled kernels: no library call, no threads, determinant as sign and logarithm.

Partial pivoting on rows scaled by their largest entry (implicit equilibration), so that a residual row in other units
does not spoil the pivot order.  Measured on 4 x 4: a threaded LAPACK call costs thirty times the arithmetic.
"""
import numpy as np

from .._jit import PAIR, apart, leaf, njit

BLOCKED = 24  # size from which on the arithmetic is more than the memory it walks through
FILLED = 0.2  # part of the entries that are not zero, below which it pays to pass over the others
TILE = 8  # columns that are zero together, or not


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
    if n < BLOCKED:
        return factored(a, pivot, scale, n)
    filled = 0
    for i in range(n):
        for j in range(n):
            filled += a[i, j] != 0.0
    return sparse(a, pivot, scale) if filled < FILLED * n * n else factored(a, pivot, scale, 4)


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


@apart(PAIR)
def sparse(a, pivot, scale):
    """Do what `lu` does where most entries are zero, as of a long sequence of events, in which each row knows two neighbours and
    the parameter: each number is the same, but only rows that reach a column are looked at, and of the pivot's row only `TILE`
    columns that are not all zero."""
    n = a.shape[0]
    tiles = (n + TILE - 1) // TILE
    holds = np.zeros((n, tiles), np.int8)
    first, begin = np.empty(n, np.int64), np.empty(n, np.int64)  # tile, and column to eliminate, in which a row begins
    for i in range(n):
        for t in range(tiles - 1, -1, -1):
            if held(a[i, t * TILE:min((t + 1) * TILE, n)]):
                holds[i, t] = 1
                first[i] = t
        begin[i] = first[i] * TILE
    low, high, reach = np.empty(tiles, np.int64), np.empty(tiles, np.int64), np.empty(n, np.int64)
    sign = 1.0
    log = 0.0
    for k in range(n):
        best, row, count = -1.0, k, 0
        for i in range(k, n):
            if begin[i] <= k:
                reach[count] = i
                count += 1
                size = abs(a[i, k]) * scale[i]
                if size > best:
                    best, row = size, i
        pivot[k] = row
        if row != k:
            sign = -sign
            scale[row] = scale[k]
            start = min(first[k], first[row])
            for t in range(start, tiles):
                if holds[k, t] + holds[row, t] > 0:
                    holds[k, t], holds[row, t] = holds[row, t], holds[k, t]
                    for j in range(t * TILE, min((t + 1) * TILE, n)):
                        a[k, j], a[row, j] = a[row, j], a[k, j]
            first[k], first[row] = first[row], first[k]
            begin[k], begin[row] = begin[row], begin[k]
        d = a[k, k]
        if d == 0.0 or not np.isfinite(d):
            return 0.0, -np.inf
        if d < 0.0:
            sign = -sign
        log += np.log(abs(d))
        pieces = 0
        for t in range((k + 1) // TILE, tiles):
            if holds[k, t] > 0:
                start = max(k + 1, t * TILE)
                if pieces > 0 and high[pieces - 1] == start:
                    pieces -= 1
                else:
                    low[pieces] = start
                high[pieces] = min((t + 1) * TILE, n)
                pieces += 1
        for m in range(count):
            i = reach[m]
            if i == k or begin[i] > k:  # the pivot's row, and the one that has changed places with it
                continue
            begin[i] = k + 1
            r = a[i, k] / d
            a[i, k] = r
            if r != 0.0:
                for t in range(pieces):
                    lessened(a[i, low[t]:high[t]], r, a[k, low[t]:high[t]])
                    for j in range(low[t] // TILE, (high[t] - 1) // TILE + 1):
                        holds[i, j] = 1
    return sign, log


@leaf
def held(entries):
    """Whether one of a few entries is not zero."""
    total = 0
    for j in range(entries.size):
        total += entries[j] != 0.0
    return total > 0


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


@leaf
def exchanged(pivot, b):
    """Put the rows of ``b`` (n,) in the order in which `lu` took those of the matrix."""
    for k in range(b.size):
        row = pivot[k]
        if row != k:
            b[k], b[row] = b[row], b[k]


@njit
def lu_solve(a, pivot, b):
    """Solve with the factors of `lu`; ``b`` (n,) is overwritten by the solution."""
    n = a.shape[0]
    exchanged(pivot, b)
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


@leaf
def lu_solve_wide(a, pivot, b):
    """Do what `lu_solve` does, with four sums at once: faster from some twenty unknowns on."""
    n = a.shape[0]
    exchanged(pivot, b)
    for i in range(1, n):
        b[i] -= inner(a[i, :i], b[:i])
    for i in range(n - 1, -1, -1):
        b[i] = (b[i] - inner(a[i, i + 1:], b[i + 1:])) / a[i, i]
