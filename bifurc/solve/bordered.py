"""Bordered linear systems of continuation: solutions, oriented determinants and null vectors of wide matrices.

A solution curve of F(x) = 0, F: R^(n+1) -> R^n, has the tangent t with J t = 0.  Bordering the wide Jacobian with a
row r gives the square matrix M = [J; r]; its determinant is (r.t) det[J; t], so its sign with an oriented t changes
exactly at simple branch points (Keller 1977; Allgower & Georg 1990, section 2.2).
"""
import math

import numpy as np
from scipy.linalg.lapack import dgeqrf, dgetrf, dgetrs, dormqr, dtrtri, dtrtrs
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from . import interrupts

FELT = 40  # unknowns from which on full rank is decided at less cost than by singular values
LARGE = 150  # unknowns from which on the time of a singular value decomposition is felt
SURE = 10.0  # of the limit of a ratio, from which on a rough one decides
FILLED = 0.1  # part of the entries of a large matrix below which those that are zero are passed over, as of long event sequences
ITERATIONS = 20


def factor(matrix):
    """Factor a square matrix by LU with partial pivoting.

    Parameters
    ----------
    matrix : ndarray (n, n)

    Returns
    -------
    lu : ndarray (n, n)
    pivots : ndarray (n,)
    sign : float
        Sign of the determinant; 0 for an exactly singular or non-finite matrix.
    log : float
        Logarithm of the absolute determinant; -inf when singular.
    """
    lu, pivots, info = interrupts.interruptible(len(matrix) >= interrupts.LARGE, None, dgetrf, matrix)
    diagonal = lu.diagonal()
    if info != 0 or not np.isfinite(diagonal).all():
        return lu, pivots, 0.0, -math.inf
    swaps = int(np.count_nonzero(pivots != np.arange(pivots.size)))
    negative = int(np.count_nonzero(diagonal < 0.0)) + swaps
    return lu, pivots, -1.0 if negative % 2 else 1.0, float(np.log(np.abs(diagonal)).sum())


def solve_factored(lu, pivots, right):
    """Return the solution of the factored system for the right-hand side(s) ``right`` (n,) or (n, k)."""
    return dgetrs(lu, pivots, right)[0]


class Factors:
    """A square matrix factored once: by LU of its entries that are not zero where it is large and those are few.

    Parameters
    ----------
    matrix : ndarray (n, n)

    Raises
    ------
    numpy.linalg.LinAlgError
        It is singular, or not finite.
    """

    def __init__(self, matrix):
        self.size = len(matrix)
        self._made = None
        if few(matrix):
            try:
                self._made = splu(csc_matrix(matrix), permc_spec="NATURAL")  # events are in order: neighbours stay so
            except RuntimeError as error:
                raise np.linalg.LinAlgError(str(error)) from None
        else:
            self._lu, self._pivots, sign, _ = factor(matrix)
            if sign == 0.0:
                raise np.linalg.LinAlgError("singular matrix")

    def solve(self, right, transposed=False):
        """Return the solution for ``right`` (n,) or (n, k)."""
        if self._made is None:
            return dgetrs(self._lu, self._pivots, right, trans=int(transposed))[0]
        return self._made.solve(np.asarray(right, float), "T" if transposed else "N")

    def largest(self, sizes) -> float:
        """Return the largest row sum of the absolute inverse, its columns times ``sizes`` (n,) that are not negative: by how much
        changes of the right-hand side by these move the solution.  Of a large matrix with few entries an estimate, hardly ever less
        (Higham and Tisseur 2000)."""
        if self._made is None:
            return float((np.abs(self.solve(np.eye(self.size))) @ sizes).max())
        operator = LinearOperator((self.size, self.size), matvec=lambda x: sizes * self.solve(np.ravel(x), True),
                                  rmatvec=lambda x: self.solve(sizes * np.ravel(x)), dtype=float)
        return float(onenormest(operator))


def few(matrix) -> bool:
    """Whether a matrix is large and most of its entries are zero."""
    return len(matrix) >= LARGE and np.count_nonzero(matrix) < FILLED * matrix.size


def bordered(wide):
    """Return the `Factors` of a wide matrix (n, n + 1), of full rank and with few entries, bordered with its unit null vector
    (n + 1,), and that; raises `numpy.linalg.LinAlgError` where rank is lost."""
    row = np.full(wide.shape[1], wide.shape[1]**-0.5)
    for _ in range(2):  # the second border makes of the first null vector, as good as its border, one to rounding
        made = Factors(np.vstack([wide, row]))
        row = made.solve(np.eye(1, row.size, row.size - 1)[0])
        row /= np.linalg.norm(row)
    if not np.isfinite(row).all():
        raise np.linalg.LinAlgError("singular matrix")
    return Factors(np.vstack([wide, row])), row


def null_vectors(wide, tolerance: float = 1e-10):
    """Return the null space of a wide matrix by singular values.

    Parameters
    ----------
    wide : ndarray (n, n + 1)
        In scaled columns, so that its singular values can be compared.
    tolerance : float
        Singular values below ``tolerance`` times the largest count as zero, dimensionless.

    Returns
    -------
    right : ndarray (k, n + 1)
        Orthonormal rows with ``wide @ right.T`` zero; k = 1 at a regular point.
    left : ndarray (k - 1, n)
        Orthonormal rows with ``left @ wide`` zero; none at a regular point.
    """
    n = wide.shape[0]
    if n >= FELT:
        reflections, _, last = reflected(wide)
        r = np.triu(reflections[:n])
        inverse, failed = dtrtri(r)
        if not failed and np.linalg.norm(r) * np.linalg.norm(inverse) * SURE * tolerance < 1.0:  # bounds on both singular values
            return last[None], np.empty((0, n))
    u, sigma, vt = np.linalg.svd(wide)
    rank = int(np.count_nonzero(sigma > tolerance * sigma[0])) if sigma.size and sigma[0] > 0.0 else 0
    return vt[rank:], u[:, rank:n].T


def least_solution(wide, right, tolerance: float = 1e-13):
    """Return the least solution of an underdetermined system.

    Parameters
    ----------
    wide : ndarray (n, n + 1)
        In scaled columns.
    right : ndarray (n,)
    tolerance : float
        Singular values below ``tolerance`` times the largest count as zero, dimensionless.

    Returns
    -------
    ndarray (n + 1,)
        Of all x with ``wide @ x = right`` that of least length; where there is none, that of the least error.
    """
    if few(wide):
        try:
            made, row = bordered(wide)
        except np.linalg.LinAlgError:
            return np.linalg.lstsq(wide, right, rcond=tolerance)[0]
        found = made.solve(np.append(right, 0.0))
        if np.abs(found).max() * SURE * tolerance * np.linalg.norm(wide) <= np.abs(right).max():
            return found - row * (row @ found)
    elif len(wide) >= LARGE:  # a factorisation by reflections takes a tenth of the time
        q, r = np.linalg.qr(wide.T)
        sizes = np.abs(r.diagonal())
        if sizes.min() > SURE * tolerance * sizes.max():
            along, failed = dtrtrs(r, right, trans=1)
            if not failed and np.abs(along).max() * SURE * tolerance * sizes.max() <= np.abs(right).max():
                return q @ along
    return np.linalg.lstsq(wide, right, rcond=tolerance)[0]


def across(wide) -> tuple[np.ndarray, float]:
    """Return a unit vector (n + 1,) orthogonal to the rows of a wide matrix (n, n + 1), whatever its rank, and the sign of the
    determinant of the matrix bordered with it; 0: singular.

    By reflections, for a tenth of what singular values cost.  Each that is not the identity turns the determinant round.
    """
    reflections, factors, last = reflected(wide)
    diagonal = reflections.diagonal()
    if not diagonal.all():
        return last, 0.0
    return last, -1.0 if np.count_nonzero(np.append(diagonal < 0.0, factors != 0.0)) % 2 else 1.0


def reflected(wide) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the reflections (n + 1, n) that make the transpose of a wide matrix triangular, their factors (n,), and a unit vector
    (n + 1,) orthogonal to its rows."""
    reflections, factors, _, _ = dgeqrf(wide.T)
    last = np.zeros((wide.shape[1], 1), order="F")
    last[-1] = 1.0
    return reflections, factors, dormqr("L", "N", reflections, factors, last, 64)[0][:, 0]


def kernel(wide, rank: float):
    """Return the right singular vectors of a wide matrix that its solutions leave along.

    Parameters
    ----------
    wide : ndarray (n, n + 1)
        In scaled columns.
    rank : float
        The least singular value over the next, dimensionless, up to which another rank is lost.

    Returns
    -------
    ndarray (k, n + 1)
        The unit null vector last; before it, where another rank is lost, the vector of the least singular value.
    """
    n = wide.shape[0]
    if few(wide):
        row = lonely(wide, SURE * rank)
        if row is not None:
            return row[None]
    elif n >= LARGE:  # a factorisation by reflections takes a tenth of the time
        q, r = np.linalg.qr(wide.T, mode="complete")
        if least_ratio(r[:n]) > SURE * rank:
            return q[:, -1:].T
    _, sizes, rows = np.linalg.svd(wide)
    return rows[-1:] if n < 2 or sizes[-1] > rank * sizes[-2] else rows[-2:]


def lonely(wide, least):
    """Return the unit null vector (n + 1,) of a wide matrix (n, n + 1) with few entries, None where it is not the only one: the
    ratio of its least two singular values is not above ``least``."""
    try:
        made, row = bordered(wide)
    except np.linalg.LinAlgError:
        return None

    def solved(right, transposed):
        return made.solve(right, True)[:-1] if transposed else made.solve(np.vstack([right, np.zeros(right.shape[1])]))
    return row if ratio_by_iteration(solved, len(wide)) > least else None


def least_ratio(r) -> float:
    """Return the least singular value of a triangular matrix (n, n) over the next, roughly; 0 where it is singular."""
    def solved(right, transposed):
        found, failed = dtrtrs(r, right, trans=int(transposed))
        return np.full_like(found, np.nan) if failed else found
    return ratio_by_iteration(solved, len(r))


def ratio_by_iteration(solved, n) -> float:
    """Return the least singular value of a matrix over the next, roughly, by inverse iteration; 0 where that finds no number.

    ``solved(right, transposed)`` makes of vectors (n, k) what the matrix makes them of, or its transpose the result of that.
    """
    found, old = np.random.default_rng(0).standard_normal((n, 3)), 0.0
    for _ in range(ITERATIONS):
        found = np.linalg.qr(found)[0]
        with np.errstate(all="ignore"):
            ahead = solved(found, False)
            back = solved(ahead, True)
        if not np.isfinite(back).all():
            return 0.0
        sizes = np.linalg.svd(ahead, compute_uv=False)
        found, ratio = back, float(sizes[1] / sizes[0])
        if abs(ratio - old) <= 0.01 * ratio:
            break
        old = ratio
    return ratio
