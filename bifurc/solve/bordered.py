"""Bordered linear systems of continuation: solutions, oriented determinants and null vectors of wide matrices.

A solution curve of F(x) = 0, F: R^(n+1) -> R^n, has the tangent t with J t = 0.  Bordering the wide Jacobian with a
row r gives the square matrix M = [J; r]; its determinant is (r.t) det[J; t], so its sign with an oriented t changes
exactly at simple branch points (Keller 1977; Allgower & Georg 1990, section 2.2).
"""
import math

import numpy as np
from scipy.linalg.lapack import dgeqrf, dgetrf, dgetrs, dormqr, dtrtri, dtrtrs

from . import interrupts

FELT = 40  # unknowns from which on full rank is decided at less cost than by singular values
LARGE = 150  # unknowns from which on the time of a singular value decomposition is felt
SURE = 10.0  # of the limit of a ratio, from which on a rough one decides
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
    if len(wide) >= LARGE:  # a factorisation by reflections takes a tenth of the time
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
    if n >= LARGE:  # a factorisation by reflections takes a tenth of the time
        q, r = np.linalg.qr(wide.T, mode="complete")
        if least_ratio(r[:n]) > SURE * rank:
            return q[:, -1:].T
    _, sizes, rows = np.linalg.svd(wide)
    return rows[-1:] if n < 2 or sizes[-1] > rank * sizes[-2] else rows[-2:]


def least_ratio(r) -> float:
    """Return the least singular value of a triangular matrix (n, n) over the next, roughly, by inverse iteration; 0 where it is
    singular."""
    found, old = np.random.default_rng(0).standard_normal((len(r), 3)), 0.0
    for _ in range(ITERATIONS):
        found = np.linalg.qr(found)[0]
        with np.errstate(all="ignore"):
            ahead, failed = dtrtrs(r, found)
            back, also = dtrtrs(r, ahead, trans=1)
        if failed or also or not np.isfinite(back).all():
            return 0.0
        sizes = np.linalg.svd(ahead, compute_uv=False)
        found, ratio = back, float(sizes[1] / sizes[0])
        if abs(ratio - old) <= 0.01 * ratio:
            break
        old = ratio
    return ratio
