"""One checker of the matrices of a linear structure M q'' + (C + G) q' + K q = f, which says what is wrong and what to write."""
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..checks import floats, refused
from ..content import Content
from .names import dof_names
from .statics import ROUNDED, Held

ROUNDING = 1e-9  # relative asymmetry that is one of rounding, and is taken out
ZERO = 1e-10  # negative eigenvalue of a scaled mass over the largest one that is rounding
LARGEST = 6000  # degrees of freedom of a dense matrix


@dataclass(frozen=True, eq=False)
class Structure(Content):
    """Checked matrices.

    Attributes
    ----------
    M, C, K, G : ndarray (n, n)
        Mass (symmetric, at least semidefinite), damping, stiffness, gyroscopic matrix.
    dofs : tuple of str, or None
    massless : tuple of int
        Coordinates without mass.
    rigid_body_modes : int
        Independent motions without strain.
    """

    M: np.ndarray = field(repr=False)
    C: np.ndarray = field(repr=False)
    K: np.ndarray = field(repr=False)
    G: np.ndarray = field(repr=False)
    dofs: tuple[str, ...] | None = field(default=None, repr=False)
    massless: tuple[int, ...] = ()
    rigid_body_modes: int = 0

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.M)

    @property
    def report(self) -> str:
        """What the matrices are, in a sentence."""
        rigid = {0: "no rigid-body mode: it is held", 1: "1 rigid-body mode"}.get(self.rigid_body_modes,
                                                                                  f"{self.rigid_body_modes} rigid-body modes")
        light = f", {len(self.massless)} coordinates without mass" if self.massless else ""
        return f"{self.n} degrees of freedom, {rigid}{light}"


def checked(M: Any, C: Any, K: Any, G: Any = None, dofs: Sequence | None = None, symmetric: bool = True) -> Structure:
    """Check matrices and return them as a `Structure`.

    Parameters
    ----------
    M, K : array or sparse matrix, shape (n, n)
        Mass and stiffness.
    C, G : array or sparse matrix, shape (n, n), or None
        Damping, and gyroscopic matrix (skew-symmetric, times the spin); None: zeros.
    dofs : sequence, optional
        Names, or pairs (node, direction).
    symmetric : bool
        False: K and C may have circulatory and gyroscopic parts.

    Raises
    ------
    ValueError
        Naming the matrix, what is wrong with it, and what to write instead.
    """
    mass, stiffness = dense("M", M), dense("K", K)
    n = len(mass)
    damping = np.zeros((n, n)) if C is None else dense("C", C)
    spin = np.zeros((n, n)) if G is None else dense("G", G)
    for name, matrix in (("K", stiffness), ("C", damping), ("G", spin)):
        if matrix.shape != mass.shape:
            raise ValueError(f"from_matrices: {name} has shape {matrix.shape}; it must be that of M, {mass.shape}")
    mass = even("M", mass)
    if symmetric:
        stiffness, damping = even("K", stiffness), even("C", damping)
    if np.abs(spin + spin.T).max(initial=0.0) > ROUNDING * max(np.abs(spin).max(initial=0.0), 1e-300):
        raise ValueError("from_matrices: G is not skew-symmetric; a gyroscopic matrix has G.T == -G. Dissipation belongs into C")
    massless = _massless(mass)
    return Structure(mass, damping, stiffness, spin, dof_names(dofs, n, "from_matrices"), massless, _rigid(stiffness))


def dense(name: str, matrix: Any) -> np.ndarray:
    """Return a square matrix of finite floats; sparse ones are filled.

    Raises
    ------
    ValueError
    """
    try:
        sparse, kind = hasattr(matrix, "toarray"), np.asarray(matrix).dtype.kind
    except Exception:  # what a foreign class raises
        sparse, kind = False, "O"
    if sparse:
        if max(matrix.shape) > LARGEST:
            raise ValueError(f"from_matrices: {name} has shape {matrix.shape}; up to {LARGEST} degrees of freedom are taken. "
                             "Reduce the model where it was made (a superelement of its contact nodes) and read that")
        matrix = matrix.toarray()
        kind = matrix.dtype.kind
    if kind == "c":
        raise ValueError(f"from_matrices: {name} is complex; structural damping has no free motion in time. Give viscous damping "
                         "(bf.modal_damping) and the real stiffness")
    array = floats(matrix)
    if array is None:
        raise refused("from_matrices", name, matrix, "a matrix of numbers")
    if array.ndim == 0:
        array = array.reshape(1, 1)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
        raise ValueError(f"from_matrices: {name} has shape {array.shape}; it must be square")
    if not np.isfinite(array).all():
        i, j = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"from_matrices: {name}[{i}, {j}] = {array[i, j]}; all entries must be finite")
    return array


def even(name: str, matrix: np.ndarray) -> np.ndarray:
    """Return a matrix that is symmetric but for rounding as an exactly symmetric one.

    Raises
    ------
    ValueError
        For one triangle, and for anything else that is not symmetric.
    """
    size = np.abs(matrix).max(initial=0.0)
    apart = np.abs(matrix - matrix.T).max(initial=0.0)
    if apart <= ROUNDING * size:
        return 0.5 * (matrix + matrix.T)
    upper, lower = np.triu(matrix, 1), np.tril(matrix, -1)
    if not lower.any() or not upper.any():
        which = "upper" if not lower.any() else "lower"
        raise ValueError(f"from_matrices: {name} is the {which} triangle of a matrix; write {name} + {name}.T - "
                         f"np.diag(np.diag({name}))")
    i, j = np.unravel_index(np.abs(matrix - matrix.T).argmax(), matrix.shape)
    rest = "" if name == "M" else ("; a skew-symmetric part belongs into G, a circulatory one needs from_matrices(..., "
                                   "symmetric=False)")
    raise ValueError(f"from_matrices: {name} is not symmetric: {name}[{i}, {j}] = {matrix[i, j]:.6g}, {name}[{j}, {i}] = "
                     f"{matrix[j, i]:.6g}{rest}")


def _rigid(stiffness: np.ndarray) -> int:
    """Return the number of independent motions without strain."""
    if np.array_equal(stiffness, stiffness.T):
        held = Held(stiffness)
        if held.negative is None:
            return held.null.shape[1]
    size = np.sqrt(np.abs(stiffness).max(axis=0) * np.abs(stiffness).max(axis=1))  # buckled or circulatory: no energy to judge by
    size = np.where(size > 0.0, size, 1.0)
    strain = np.linalg.svd(stiffness / np.outer(size, size), compute_uv=False)
    return int(np.count_nonzero(strain <= ROUNDED * len(stiffness) * strain[0]))


def _massless(mass: np.ndarray) -> tuple[int, ...]:
    """Return the coordinates without mass.

    Raises
    ------
    ValueError
        When the mass is negative in some direction, or zero in one that is not a coordinate.
    """
    empty = ~mass.any(axis=1)
    rest = mass[np.ix_(~empty, ~empty)]
    size = np.sqrt(np.abs(np.diag(rest)))
    if rest.size:
        values, vectors = np.linalg.eigh(rest / np.outer(size, size) if size.all() else rest)
        if values[0] < -ZERO * abs(values[-1]):
            where = int(np.flatnonzero(~empty)[np.abs(vectors[:, 0]).argmax()])
            raise ValueError(f"from_matrices: M is not positive semidefinite (smallest scaled eigenvalue {values[0]:.3g}, mostly "
                             f"in "
                             f"coordinate {where}); a mass cannot be negative: look at the sign and the units there")
        if values[0] <= 1e-14 * values[-1]:
            where = int(np.flatnonzero(~empty)[np.abs(vectors[:, 0]).argmax()])
            raise ValueError(f"from_matrices: M is singular in a direction that is no single coordinate (mostly {where}); give "
                             f"these "
                             "coordinates mass, or tie them together where the model was made")
    return tuple(int(i) for i in np.flatnonzero(empty))
