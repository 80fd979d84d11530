"""Bordered linear systems of continuation: solutions, oriented determinants and null vectors of wide matrices.

A solution curve of F(x) = 0, F: R^(n+1) -> R^n, has the tangent t with J t = 0.  Bordering the wide Jacobian with a
row r gives the square matrix M = [J; r]; its determinant is (r.t) det[J; t], so its sign with an oriented t changes
exactly at simple branch points (Keller 1977; Allgower & Georg 1990, section 2.2).
"""
import math

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs


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
    lu, pivots, info = dgetrf(matrix)
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
    u, sigma, vt = np.linalg.svd(wide)
    rank = int(np.count_nonzero(sigma > tolerance * sigma[0])) if sigma.size and sigma[0] > 0.0 else 0
    return vt[rank:], u[:, rank:n].T
