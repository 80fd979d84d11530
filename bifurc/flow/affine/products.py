"""Products of matrices of many degrees of freedom, without a library call: four rows at a time, each number as in plain sums."""
from ..._jit import leaf, njit


@njit
def product(matrices, m, x, out):
    """Write ``matrices[m] @ x`` into ``out``; four rows at a time, since a sum waits for each of its terms."""
    rows, columns = matrices.shape[1], x.size
    i = 0
    while i + 4 <= rows:
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for k in range(columns):
            r = x[k]
            a += matrices[m, i, k] * r
            b += matrices[m, i + 1, k] * r
            c += matrices[m, i + 2, k] * r
            d += matrices[m, i + 3, k] * r
        out[i], out[i + 1], out[i + 2], out[i + 3] = a, b, c, d
        i += 4
    while i < rows:
        a = 0.0
        for k in range(columns):
            a += matrices[m, i, k] * x[k]
        out[i] = a
        i += 1


@leaf
def multiply(a, b, scratch):
    """a <- a b for square matrices, without a library call; ``a`` may be ``b``."""
    multiplied(a, b, scratch)
    for i in range(a.shape[0]):
        for j in range(a.shape[0]):
            a[i, j] = scratch[i, j]


@leaf
def premultiply(a, b, scratch):
    """b <- a b, of ``a`` (n, n or more) its first columns."""
    multiplied(a, b, scratch)
    for i in range(b.shape[0]):
        for j in range(b.shape[0]):
            b[i, j] = scratch[i, j]


@leaf
def multiplied(a, b, out):
    """Write a b into ``out`` (n, n), of ``a`` (n, n or more) its first columns; four rows of ``b`` at a time, one added after the
    other, so that a row of ``out`` is read and written a quarter as often."""
    n = out.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        k = 0
        while k + 4 <= n:
            r0, r1, r2, r3 = a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3]
            for j in range(n):
                out[i, j] = out[i, j] + r0 * b[k, j] + r1 * b[k + 1, j] + r2 * b[k + 2, j] + r3 * b[k + 3, j]
            k += 4
        while k < n:
            r = a[i, k]
            for j in range(n):
                out[i, j] += r * b[k, j]
            k += 1
