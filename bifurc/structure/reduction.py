"""Component mode synthesis: a structure in the coordinates of its contacts and a few modes, with its errors.

References
----------
R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313 (fixed-interface modes and constraint modes).
S. Rubin, AIAA J. 13 (1975) 995 (free modes and residual flexibility).
R. H. MacNeal, Comput. Struct. 1 (1971) 581 (the same without the inertia of the residual: no mass at the boundary).
"""
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from ..checks import POSITIVE, checked

METHODS = ("craig-bampton", "rubin", "massless")
TOLERANCE = 1e-3  # relative error of a frequency up to which a reduced model counts as valid
ZERO = 1e-9  # square of a frequency over that of the highest: a rigid-body mode


@dataclass(frozen=True, eq=False)
class Reduction:
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
        Natural frequencies of the reduced model without damping, radians per time.
    full_frequencies : ndarray
        Those of the full model, as many.
    static_error : float
        Largest relative error of the static flexibility at the kept coordinates (of the elastic motions alone, when the
        structure can move as a rigid body).
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
        rigid = full <= np.sqrt(ZERO) * max(full.max(initial=0.0), 1e-300)
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
    squares, free = eigh(K, M)
    if squares[0] < -ZERO * squares[-1]:
        raise ValueError(f"reduced: K is not positive semidefinite (smallest eigenvalue of M^-1 K: {squares[0]:.3g}); buckled "
                         f"structures "
                         "have no static shapes to reduce with")
    full = np.sqrt(np.maximum(squares, 0.0))
    rigid = squares <= ZERO * squares[-1]
    residual = np.zeros((b, b))
    if method == "craig-bampton":
        T = _fixed_interface(M, K, keep, modes, eigh)
        mass, stiffness = T.T @ M @ T, T.T @ K @ T
    else:
        if modes < rigid.sum():
            raise ValueError(f"reduced: modes = {modes} is not allowed; the structure has {rigid.sum()} rigid-body modes, and "
                             f"method "
                             f"{method!r} needs them all")
        left = free[:, modes:]
        flexibility = (left / squares[modes:]) @ left[list(keep)].T  # residual flexibility of loads at the kept coordinates
        own = flexibility[list(keep)]
        if b > n - modes or np.linalg.cond(own) > 1e12:
            raise ValueError(f"reduced: the {modes} modes leave no flexibility to the kept coordinates; take fewer modes")
        attach = np.linalg.solve(own, flexibility.T).T
        T = np.column_stack([attach, free[:, :modes] - attach @ free[list(keep), :modes]])
        T[list(keep)] = np.eye(b, b + modes)
        stiffness = T.T @ K @ T
        if method == "massless":
            lift = np.column_stack([np.zeros((modes, b)), np.eye(modes)])
            mass, residual = lift.T @ lift, own
        else:
            mass = T.T @ M @ T
    mass, stiffness = 0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T)
    if method == "massless":
        own_frequencies = full[:modes]
    else:
        own_frequencies = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0.0))
    count = len(own_frequencies)
    error = _static_error(M, K, mass, stiffness, keep, int(rigid.sum()))
    made = Reduction(method, tuple(keep), T, dofs, own_frequencies, full[:count], error, residual)
    return mass, stiffness, made


def _fixed_interface(M: np.ndarray, K: np.ndarray, keep: tuple[int, ...], modes: int, eigh) -> np.ndarray:
    """Return constraint modes and fixed-interface modes (n, b + modes)."""
    n, b, kept = len(M), len(keep), np.array(keep)
    inner = np.setdiff1d(np.arange(n), kept)
    K_ii, M_ii = K[np.ix_(inner, inner)], M[np.ix_(inner, inner)]
    try:
        shapes = -np.linalg.solve(K_ii, K[np.ix_(inner, kept)])
    except np.linalg.LinAlgError:
        shapes = np.full((len(inner), b), np.nan)
    squares, vectors = eigh(K_ii, M_ii)
    if not np.isfinite(shapes).all() or squares[0] <= ZERO * squares[-1]:
        raise ValueError("reduced: with the kept coordinates held the structure can still move as a rigid body; keep more "
                         "coordinates, "
                         "or use method='rubin', which takes its free modes")
    T = np.zeros((n, b + modes))
    T[kept, :b] = np.eye(b)
    T[inner, :b] = shapes
    T[np.ix_(inner, np.arange(b, b + modes))] = vectors[:, :modes]
    return T


def _static_error(M: np.ndarray, K: np.ndarray, mass: np.ndarray, stiffness: np.ndarray, keep: tuple[int, ...],
                  rigid: int) -> float:
    """Return the largest relative error of the static flexibility at the kept coordinates.

    Of a structure with rigid-body modes, ``rigid`` of them, it is that of its elastic motions: the response to loads that
    are balanced by inertia.
    """
    b, kept = len(keep), np.array(keep)
    if not rigid:
        unit = np.zeros((len(K), b))
        unit[kept] = np.eye(b)
        full = np.linalg.solve(K, unit)[kept]
        own = np.linalg.solve(stiffness, np.eye(len(stiffness))[:, :b])[:b]
    else:
        full = _elastic_flexibility(M, K, kept)
        if not mass[:b].any():  # static at the kept coordinates, elastic in the modes
            soft = np.linalg.inv(stiffness[:b, :b])
            shift = -soft @ stiffness[:b, b:]
            squares = np.diag(stiffness[b:, b:] - stiffness[b:, :b] @ soft @ stiffness[:b, b:])  # of the modes, in their order
            own = soft + (shift[:, rigid:] / squares[rigid:]) @ shift[:, rigid:].T
        else:
            own = _elastic_flexibility(mass, stiffness, np.arange(b))
    return float(np.abs(own - full).max() / max(np.abs(full).max(), 1e-300))


def _elastic_flexibility(M: np.ndarray, K: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the flexibility (b, b) of the elastic modes at coordinates."""
    squares, modes = eigh(K, M)
    elastic = squares > ZERO * squares[-1]
    return (modes[at][:, elastic] / squares[elastic]) @ modes[at][:, elastic].T
