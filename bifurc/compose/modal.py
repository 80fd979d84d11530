"""Modal coordinates of an affine mode: ``x = V xi`` with eigenvalues in pairs, single decays, and a slow block.

With few degrees of freedom a step of the tables turns the fastest of them by `TURN`, and costs little.  With many the fastest
is thousands of times the slowest, and has mostly decayed: in modal coordinates the reach of a guard's Taylor series is known
from the amplitudes that are there, and a step costs one multiplication a coordinate.  The columns of V are

* pairs: ``xi_1 + i xi_2`` turns with ``exp(lambda t)``, the modes first, then one pair a harmonic of the forcing, whose column
  is the particular solution (exact frequency, beside the cosine and the sine themselves);
* single decays: real eigenvalues;
* the block ``xi' = N xi``: held and free coordinates, frozen memory, and the constant, with N^4 = 0 as a rule; modes whose
  eigenvectors are too close to each other (critical damping), and undamped resonance with its harmonic.
"""
import numpy as np
import scipy.linalg

from .tables import LEVELS, ORDER, TURN, Tables

SLOW = 1e-7  # of the largest frequency without damping: a free mass moves as slowly as rounding allows, the root of eps
APART = 1e-5  # of a harmonic's frequency: an eigenvalue that near resonates
ALIGNED = 1e-4  # cosine of left and right eigenvector, for the fastest eigenvalue: below it an eigenvalue is defective
CONDITION = 1e5  # growth of rounding there and back, |B| |B^-1| over the largest entries of the rows
NILPOTENT = 1e3 * 2.2e-16  # of the balanced matrix: smaller entries of N are rounding
ANGLE = 0.7  # of the fastest eigenvalue on the first level
GROWTH = 0.5  # of a growing motion on the last level, exponent


def give_modal(tables: Tables) -> None:
    """Fill the modal coordinates of all modes that have none yet and allow them; tables of few degrees of freedom, or beside laws,
    have no room for them (`tables.allocate`), and nothing is done."""
    for m in range(len(tables.V)):
        if tables.blocks[m, 3] == 0:
            parts = separated(tables, m)
            if parts is not None:
                _write(tables, m, *parts)
            else:
                tables.blocks[m, 3] = -1


def separated(tables: Tables, m: int):
    """Return V (nx, nx), eigenvalues of the pairs, of the single decays, N and its rate, of one mode; None: there are none."""
    A, omega = tables.A[m], tables.flat[0]
    ns, nx = A.shape
    nw = nx - ns
    balanced, (scale, _) = scipy.linalg.matrix_balance(A[:, :ns], permute=False, separate=True)
    values, left, vectors = scipy.linalg.eig(balanced, left=True)
    rates = 1j * omega * tables.harmonics
    size = np.abs(values).max()
    if size == 0.0:
        return None
    aligned = np.abs(np.sum(left.conj() * vectors, axis=0))
    n = tables.LP.shape[2]
    stiff = np.sqrt(np.abs(np.linalg.eigvals(A[n:2 * n, :n])).max())
    own = (np.abs(values) <= SLOW * min(stiff, size)) | (aligned < ALIGNED * np.abs(values) / size)
    near = np.abs(values[:, None] - rates) <= APART * rates.imag
    meets = near.any(axis=0)  # harmonics that a mode resonates with
    own |= near.any(axis=1)
    own |= np.isin(values, values[own].conj())
    dense = np.empty((ns, 0))
    if own.any():
        chosen = values[own]
        _, Q, found = scipy.linalg.schur(balanced, sort=lambda re, im: bool(
            np.abs(values - complex(re, im)).min() == np.abs(chosen - complex(re, im)).min()))
        dense = Q[:, :found]
        if found != own.sum():
            return None
    pairs, reals = np.flatnonzero(~own & (values.imag > 0.0)), np.flatnonzero(~own & (values.imag == 0.0))
    columns = [part for j in pairs for part in (vectors[:, j].real, -vectors[:, j].imag)]  # y = Re(v (xi_1 + i xi_2))
    B = np.column_stack([*columns, vectors[:, reals].real, dense])
    inverse, rows = np.linalg.inv(B), np.abs(B).max(axis=1)
    if not (np.abs(B) @ (np.abs(inverse) @ rows) <= CONDITION * rows).all():
        return None
    p, r, d = len(pairs), len(reals), dense.shape[1]
    q = 2 * p + r
    blocks = inverse @ balanced @ B
    blocks[q:, q:][np.abs(blocks[q:, q:]) <= NILPOTENT * np.abs(balanced).sum(axis=1).max()] = 0.0
    blocks[:q, q:] = blocks[q:, :q] = 0.0
    pushed = inverse @ (A[:, ns:] / scale[:, None])  # forcing on the coordinates, (ns, nw)
    W = np.zeros((nw, nw))
    for k, rate in enumerate(rates.imag):
        W[1 + 2 * k, 2 + 2 * k], W[2 + 2 * k, 1 + 2 * k] = -rate, rate
    answer, further = np.zeros((ns, nw)), []  # y = B (xi + answer w); forcing states that belong to the slow block
    for k, rate in enumerate(rates):  # Re(c exp(i k theta)): the particular solution
        both = [1 + 2 * k, 2 + 2 * k]
        c = np.zeros(ns, complex)
        kept = q if meets[k] else ns
        c[:kept] = np.linalg.solve(rate * np.eye(kept) - blocks[:kept, :kept], pushed[:kept, both] @ np.array([1.0, -1j]))
        answer[:, both] = np.column_stack([c.real, -c.imag])
        further += both if meets[k] else []
    answer[:q, 0] = -np.linalg.solve(blocks[:q, :q], pushed[:q, 0])
    further.append(0)
    free = [c for c in range(1, nw) if c not in further]
    block = np.zeros((d + len(further), d + len(further)))
    block[:d, :d] = blocks[q:, q:]
    block[:d, d:] = np.where(np.abs(pushed[q:, further]) <= NILPOTENT * np.abs(pushed).max(), 0.0, pushed[q:, further])
    block[d:, d:] = W[np.ix_(further, further)]
    block, (units, _) = scipy.linalg.matrix_balance(block, permute=False, separate=True)
    rate = np.abs(block).sum(axis=1).max() if np.abs(np.linalg.matrix_power(block, 4)).max() > 0.0 else 0.0
    first = 2 * p + len(free)
    V = np.zeros((nx, nx))
    V[:ns, :2 * p], V[:ns, first:first + r + d] = B[:, :2 * p], B[:, 2 * p:]
    V[:ns, 2 * p:first], V[:ns, first + r + d:] = B @ answer[:, free], B @ answer[:, further]
    V[:ns] *= scale[:, None]
    V[[ns + c for c in free], np.arange(2 * p, first)] = 1.0
    V[[ns + c for c in further], np.arange(first + r + d, nx)] = 1.0
    V[:, first + r:] *= units
    return V, np.concatenate([values[pairs], rates[~meets]]), values[reals].real, block, rate


def _write(T: Tables, m: int, V, pairs, decays, N, rate) -> None:
    """Write modal coordinates, the rows of guards over them, and the levels of steps."""
    nx, p, r, d = len(V), len(pairs), len(decays), len(N)
    unit = np.abs(V).max(axis=1)  # rows in their own units
    T.V[m] = V
    T.L[m] = np.linalg.inv(V / unit[:, None]) / unit
    T.N[m, :d, :d] = N
    T.spin[m] = 0.0
    T.spin[m, :2 * p:2, 0], T.spin[m, :2 * p:2, 1] = pairs.real, pairs.imag
    T.spin[m, 2 * p:2 * p + r, 0], T.spin[m, 2 * p + r, 0] = decays, rate
    for g in range(T.n_guards[m]):
        row = T.G[m, g] @ V
        terms = np.zeros((nx, ORDER + 2))
        pair, single, slow = row[:2 * p:2] - 1j * row[1:2 * p:2], row[2 * p:2 * p + r].copy(), row[2 * p + r:].copy()
        for j in range(ORDER + 2):
            terms[:2 * p:2, j], terms[1:2 * p:2, j] = pair.real, -pair.imag
            terms[2 * p:2 * p + r, j], terms[2 * p + r:, j] = single, slow
            pair, single, slow = pair * pairs / (j + 1), single * decays / (j + 1), slow @ N / (j + 1)
        if T.still[m, g] > 0:
            terms[:, T.still[m, g]:] = 0.0
        T.GS[m, g] = terms[:, :ORDER + 1]
        sizes = np.abs(terms[:, [0, ORDER + 1]])
        T.tail[m, g, :2 * p:2] = np.hypot(sizes[:2 * p:2], sizes[1:2 * p:2])
        T.tail[m, g, 1:2 * p:2] = 0.0
        T.tail[m, g, 2 * p:] = sizes[2 * p:]
        T.tail[m, g, 2 * p + r:, 1] *= np.exp(TURN)
    every = np.concatenate([pairs, decays])
    level = ANGLE / np.abs(every).max() * 2.0 ** (0.5 * np.arange(LEVELS))
    growing = every.real.max()
    T.level[m] = level
    many = max(1, int(np.sum((level * growing <= GROWTH) & (level * rate <= TURN))))
    T.blocks[m] = p, r, d, many
    used, T.turns[m] = level[:many], 0.0  # on longer steps a growing motion has no number
    turned = np.exp(np.multiply.outer(used, pairs))
    turned[np.abs(turned) < 1e-60] = 0.0
    T.turns[m, :many, :2 * p:2], T.turns[m, :many, 1:2 * p:2] = turned.real, turned.imag
    faded = np.exp(np.multiply.outer(used, decays))
    T.turns[m, :many, 2 * p:2 * p + r] = np.where(faded < 1e-60, 0.0, faded)
