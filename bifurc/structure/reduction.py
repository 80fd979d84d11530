"""Component mode synthesis: a structure in the coordinates of its contacts and a few modes, with its errors.

References
----------
R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313 (fixed-interface modes and constraint modes).
S. Rubin, AIAA J. 13 (1975) 995 (free modes and residual flexibility).
R. H. MacNeal, Comput. Struct. 1 (1971) 581 (the same without the inertia of the residual: no mass at the boundary).
"""
from dataclasses import dataclass, field

import numpy as np

from ..checks import POSITIVE, checked
from ..content import Content
from .modes import natural_modes, residual_shapes
from .statics import Held, deflection, of_unit_mass

METHODS = ("craig-bampton", "rubin", "massless")
TOLERANCE = 1e-3  # relative error of a frequency up to which a reduced model counts as valid
NOTHING = 1e-12  # of the flexibility at kept coordinates, left by modes: rounding


@dataclass(frozen=True, eq=False)
class Reduction(Content):
    """How a reduced model stands for a full one.

    Attributes
    ----------
    method : str
    keep : tuple of int
        Coordinates of the full model that the reduced one has as its first ones.
    recovery : ndarray (n, m)
        T: full coordinates are T times reduced ones; velocities likewise.
    dofs : tuple of str, or None
        Names of the full coordinates.
    frequencies : ndarray
        Natural frequencies of the reduced model without damping, radians per time; 0 for rigid-body modes.
    full_frequencies : ndarray
        Those of the full model, as many.
    static_error : float
        Largest error of the static flexibility at the kept coordinates (of the elastic motions alone, when the structure can
        move as a rigid body), over the root of the flexibilities of the two coordinates concerned.
    residual : ndarray (b, b)
        Flexibility at the kept coordinates that carries no mass; zeros but for "massless".
    """

    method: str
    keep: tuple[int, ...]
    recovery: np.ndarray = field(repr=False)
    dofs: tuple[str, ...] | None = field(repr=False)
    frequencies: np.ndarray = field(repr=False)
    full_frequencies: np.ndarray = field(repr=False)
    static_error: float
    residual: np.ndarray = field(repr=False)

    @property
    def errors(self) -> np.ndarray:
        """Relative errors of the natural frequencies; rigid-body modes, which have none, are 0."""
        full, own = self.full_frequencies, self.frequencies
        rigid = full == 0.0
        return np.where(rigid, 0.0, np.abs(own - full) / np.where(rigid, 1.0, full))

    @checked(tolerance=POSITIVE)
    def valid_to(self, tolerance: float = TOLERANCE) -> float:
        """Return the frequency (radians per time) up to which all natural frequencies are within a relative tolerance.

        It is that of the last mode before the first one that is not; infinite where the model is complete.
        """
        wrong = np.flatnonzero(self.errors > tolerance)
        if not wrong.size:
            return float(self.full_frequencies[-1]) if len(self.frequencies) < len(self.recovery) else float("inf")
        return float(self.full_frequencies[wrong[0] - 1]) if wrong[0] else 0.0

    @property
    def message(self) -> str:
        """What the reduced model keeps, in a sentence."""
        n, m = self.recovery.shape
        return (f"{self.method}: {m} of {n} coordinates; statics at the {len(self.keep)} kept ones to {self.static_error:.1e}; "
                f"natural "
                f"frequencies to {TOLERANCE:g} up to {self.valid_to():.6g} rad/time")

    def to_record(self) -> dict:
        """Return the content as JSON knows it."""
        return {"method": self.method, "keep": list(self.keep), "dofs": None if self.dofs is None else list(self.dofs),
                "static_error": self.static_error,
                **{name: getattr(self, name).tolist() for name in ("recovery", "frequencies", "full_frequencies", "residual")}}

    @classmethod
    def from_record(cls, record: dict) -> "Reduction":
        """Make the reduction that gave ``record``."""
        arrays = {name: np.array(record[name], float) for name in ("recovery", "frequencies", "full_frequencies", "residual")}
        dofs = None if record["dofs"] is None else tuple(record["dofs"])
        return cls(method=record["method"], keep=tuple(record["keep"]), dofs=dofs, static_error=record["static_error"], **arrays)

    def __repr__(self):
        return f"Reduction({self.message})"


def reduce(M: np.ndarray, K: np.ndarray, keep: tuple[int, ...], modes: int, method: str,
           dofs: tuple[str, ...] | None = None) -> tuple[np.ndarray, np.ndarray, Reduction]:
    """Return mass and stiffness of the reduced model, (m, m) each, and the `Reduction`.

    Parameters
    ----------
    M, K : ndarray (n, n)
        Symmetric, M positive definite, K positive semidefinite.
    keep : tuple of int
        Coordinates that stay, b of them.
    modes : int
        Number of modes beside them.
    method : {"craig-bampton", "rubin", "massless"}
    dofs : tuple of str, optional

    Raises
    ------
    ValueError
        Too few or too many coordinates and modes; a stiffness that lets the inner coordinates move.
    """
    n, b = len(M), len(keep)
    if method not in METHODS:
        raise ValueError(f"reduced: method = {method!r} is not allowed; it must be one of {', '.join(METHODS)}")
    if not 1 <= b < n or not 0 <= modes <= n - b:
        raise ValueError(f"reduced: keep = {keep!r} with modes = {modes!r} is not allowed; of {n} coordinates 1 to {n - 1} are "
                         f"kept, "
                         f"with 0 to {n - b} modes beside them")
    kept = np.array(keep)
    free = Held(K)
    if free.negative is not None:
        raise ValueError(f"reduced: K is not positive semidefinite: a motion with coordinate "
                         f"{free.negative if dofs is None else dofs[free.negative]} has a negative strain energy; buckled "
                         "structures have no static shapes to reduce with")
    squares, shapes = natural_modes(M, K, b + modes, free)
    rigid = free.null.shape[1]
    residual = np.zeros((b, b))
    if method == "craig-bampton":
        T, stiffness = _fixed_interface(M, K, kept, modes, free)
        mass = T.T @ M @ T
    else:
        if modes < rigid:
            raise ValueError(f"reduced: modes = {modes} is not allowed; the structure has {rigid} rigid-body modes, and method "
                             f"{method!r} needs them all")
        T, stiffness, own = _free_modes(M, squares, shapes, kept, modes, free)
        if method == "massless":
            mass, residual = np.diag(np.repeat((0.0, 1.0), (b, modes))), own
        else:
            mass = T.T @ M @ T
    mass, stiffness = 0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T)
    small, at = Held(stiffness), np.arange(b)
    if method == "massless":
        own_squares, own_rigid = squares[:modes], of_unit_mass(mass, small.null)
    else:
        own_squares, own_shapes = natural_modes(mass, stiffness, b + modes, small)
        own_rigid = own_shapes[:, :small.null.shape[1]]
    full_flexibility = deflection(free, M, shapes[:, :rigid], kept)[kept]
    flexibility = deflection(small, mass, own_rigid, at)[at]
    size = np.sqrt(np.maximum(np.diag(full_flexibility), 1e-300))
    error = float((np.abs(flexibility - full_flexibility) / np.outer(size, size)).max())
    made = Reduction(method, tuple(keep), T, dofs, np.sqrt(own_squares), np.sqrt(squares[:len(own_squares)]), error, residual)
    return mass, stiffness, made


def _free_modes(M: np.ndarray, squares: np.ndarray, shapes: np.ndarray, kept: np.ndarray, modes: int,
                free: Held) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shapes (n, b + modes) of unit kept coordinates and of free modes, their stiffness, the residual flexibility (b, b).

    Residual shapes A and modes phi are orthogonal in K, A^T K A = A[kept] and phi^T K phi = Lambda: so the stiffness of both
    follows without K, whose terms would cancel in the product.

    Raises
    ------
    ValueError
        When the modes are all that the kept coordinates can do.
    """
    b, phi = len(kept), shapes[:, :modes]
    attached = residual_shapes(M, squares, shapes, kept, modes, free)
    own = 0.5 * (attached[kept] + attached[kept].T)
    whole = np.diag(own) + (phi[kept]**2 / np.where(squares[:modes] > 0.0, squares[:modes], np.inf)).sum(axis=1)
    size = np.sqrt(np.maximum(np.diag(own), 0.0))
    if not (np.diag(own) > NOTHING * whole).all() or np.linalg.eigvalsh(own / np.outer(size, size))[0] < NOTHING:
        raise ValueError(f"reduced: the {modes} modes leave no flexibility to the kept coordinates; take fewer modes")
    inverse = np.linalg.inv(own / np.outer(size, size)) / np.outer(size, size)
    attached = attached @ inverse
    T = np.column_stack([attached, phi - attached @ phi[kept]])
    T[kept] = np.eye(b, b + modes)
    coupling = -inverse @ phi[kept]
    return T, np.block([[inverse, coupling], [coupling.T, np.diag(squares[:modes]) - phi[kept].T @ coupling]]), own


def _fixed_interface(M: np.ndarray, K: np.ndarray, kept: np.ndarray, modes: int,
                     free: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return constraint modes and fixed-interface modes (n, b + modes), and their stiffness.

    Rigid motions of the kept coordinates have none: what rounding leaves of it, which is of the entries of K and may be
    more than those of the condensed stiffness have, is taken out.

    Raises
    ------
    ValueError
        When the rest can move without strain.
    """
    n, b, held = len(M), len(kept), Held(K, kept)
    if held.null.size:
        raise ValueError("reduced: with the kept coordinates held the structure can still move as a rigid body; keep more "
                         "coordinates, or use method='rubin', which takes its free modes")
    inner = np.setdiff1d(np.arange(n), kept)
    T, stiffness = np.zeros((n, b + modes)), np.zeros((b + modes, b + modes))
    size = np.sqrt(np.diag(K)[kept])
    across = np.linalg.svd(free.null[kept] * size[:, None])[0][:, free.null.shape[1]:] / size[:, None]
    strained = across * np.square(size)[:, None]
    T[:, :b], stiffness[:b, :b] = held.shapes, strained @ (across.T @ held.stiffness @ across) @ strained.T
    if modes:
        inside = np.ix_(inner, inner)
        squares, shapes = natural_modes(M[inside], K[inside], modes, Held(K[inside]))
        T[inner, b:], stiffness[b:, b:] = shapes[:, :modes], np.diag(squares[:modes])
    return T, stiffness
