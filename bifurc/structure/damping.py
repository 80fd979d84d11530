"""Damping matrices: proportional (Rayleigh) and modal."""
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh

from ..checks import RATIO, array, checked, floats, of, shown
from .checks import dense, even


@checked(alpha=RATIO, beta=RATIO, ratios=of(array, count=2), frequencies=of(array, count=2))
def rayleigh_damping(M, K, alpha: float | None = None, beta: float | None = None, *, ratios: Sequence[float] | None = None,
                     frequencies: Sequence[float] | None = None) -> np.ndarray:
    """Return C = alpha M + beta K.

    Parameters
    ----------
    M, K : array, shape (n, n)
    alpha : float, optional
        Of the mass, 1/time.
    beta : float, optional
        Of the stiffness, time.
    ratios, frequencies : pair of float, optional
        Instead of alpha and beta: damping ratios (dimensionless) at two angular frequencies.

    Returns
    -------
    ndarray (n, n)

    Raises
    ------
    ValueError
        Factors that are missing, doubled or negative, equal frequencies.

    Examples
    --------
    >>> import numpy as np
    >>> from bifurc import rayleigh_damping
    >>> rayleigh_damping(np.eye(1), 4.0 * np.eye(1), ratios=(0.05, 0.05), frequencies=(1.0, 2.0)).round(12).tolist()
    [[0.2]]
    """
    mass, stiffness = _pair(M, K)
    if (ratios is None) != (frequencies is None) or (ratios is None) == (alpha is None and beta is None):
        raise ValueError("rayleigh_damping: write alpha= and beta=, or ratios=(z1, z2) and frequencies=(w1, w2)")
    if ratios is not None and frequencies is not None:
        z, w = np.asarray(ratios, float), np.asarray(frequencies, float)
        if z.shape != (2,) or w.shape != (2,) or not (w > 0.0).all() or w[0] == w[1]:
            raise ValueError(f"rayleigh_damping: ratios = {ratios!r} and frequencies = {frequencies!r} are not allowed; they "
                             f"must be "
                             "two ratios at two different frequencies above 0")
        alpha, beta = (float(value) for value in np.linalg.solve(np.column_stack([0.5 / w, 0.5 * w]), z))
    alpha, beta = float(alpha or 0.0), float(beta or 0.0)
    if not (np.isfinite([alpha, beta]).all() and min(alpha, beta) >= 0.0):
        raise ValueError(f"rayleigh_damping: alpha = {alpha:.6g}, beta = {beta:.6g}; both must be at least 0 or some motions gain "
                         "energy. Two ratios that differ much at close frequencies ask for this: use modal_damping")
    return alpha * mass + beta * stiffness


@checked()
def modal_damping(M, K, ratios) -> np.ndarray:
    """Return the matrix C that damps every mode of (M, K) by itself: phi^T C phi = 2 zeta omega.

    Parameters
    ----------
    M, K : array, shape (n, n)
        Symmetric, M positive definite.
    ratios : float or sequence of float
        Damping ratios, dimensionless: of all modes, or of the first ones in the order of frequency (the last one given
        goes on for those above).

    Returns
    -------
    ndarray (n, n)

    Raises
    ------
    ValueError

    Examples
    --------
    >>> import bifurc as bf
    >>> bf.modal_damping([[2.0]], [[8.0]], 0.05)
    array([[0.4]])
    """
    mass, stiffness = _pair(M, K)
    found = floats(ratios)
    given = np.atleast_1d(np.empty(0) if found is None else found)
    if given.ndim != 1 or not given.size or given.size > len(mass) or not (np.isfinite(given) & (given >= 0.0)).all():
        raise ValueError(f"modal_damping: ratios = {shown(ratios)} is not allowed; "
                         f"it must be 1 to {len(mass)} numbers of at least 0")
    try:
        squares, modes = eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        raise ValueError("modal_damping: M must be positive definite; reduce or condense coordinates without mass first") from None
    zeta = np.append(given, np.full(len(mass) - given.size, given[-1]))
    weighted = mass @ modes
    return even("C", (weighted * (2.0 * zeta * np.sqrt(np.maximum(squares, 0.0)))) @ weighted.T)


def _pair(M, K) -> tuple[np.ndarray, np.ndarray]:
    """Return mass and stiffness, checked, or raise ValueError unless they are of one shape: none is spread over the other."""
    mass, stiffness = even("M", dense("M", M)), even("K", dense("K", K))
    if mass.shape != stiffness.shape:
        raise ValueError(f"K has shape {stiffness.shape}; it must be that of M, {mass.shape}")
    return mass, stiffness
