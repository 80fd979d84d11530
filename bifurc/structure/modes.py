"""Natural modes of a structure, the low ones with the digits of its statics."""
import numpy as np
from scipy.linalg import eigh

from .statics import Held, deflection, of_unit_mass

SPARE = 8  # modes beside those wanted: iterated subspaces converge with the ratio of the last wanted to the first left out
ROUNDS = 12  # at most; started from an eigenvalue solver, two or three are enough


def natural_modes(M: np.ndarray, K: np.ndarray, count: int, held: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return squares (n,) of the natural frequencies, rising, and modes (n, n) of unit mass.

    An eigenvalue solver is right to rounding of the highest square.  The low ones, up to the geometric mean of the lowest
    and the highest and as far as ``count`` of them are wanted, come from iterations of the subspace (Bathe and Wilson 1972) with
    static solutions, whose errors are relative to the lowest.

    Parameters
    ----------
    M, K : ndarray (n, n)
        M positive definite, K positive semidefinite.
    count : int
        How many of the lowest are wanted.
    held : Held
        Of K; its motions without strain are the first modes, with exact zeros.
    """
    squares, modes = eigh(K, M)
    rigid, n = held.null.shape[1], len(M)
    squares[:rigid] = 0.0
    if rigid:
        modes[:, :rigid] = of_unit_mass(M, held.null)
    if rigid == n:
        return squares, modes
    rough = squares.copy()
    size = max(min(count, n) - rigid, 1)
    start = _elastic(M, modes[:, :rigid], modes[:, rigid:min(rigid + size + SPARE, n)])
    low, inner = _subspace(M, held, modes[:, :rigid], start[:, :1])  # the lowest square to its order
    meeting = np.sqrt(low[0] * max(squares[-1], low[0]))
    block = min(size + SPARE, 1 + int(np.count_nonzero(rough[rigid:] <= meeting)) + SPARE, start.shape[1])
    found, inner = _subspace(M, held, modes[:, :rigid], start[:, :block])
    taken = min(size, int(np.count_nonzero(found <= meeting)))
    squares[rigid:rigid + taken], modes[:, rigid:rigid + taken] = found[:taken], inner[:, :taken]
    squares[rigid + taken:] = np.maximum(squares[rigid + taken:], found[taken - 1] if taken else 0.0)
    return squares, modes


def residual_shapes(M: np.ndarray, squares: np.ndarray, modes: np.ndarray, at: np.ndarray, count: int, held: Held) -> np.ndarray:
    """Return the deflection (n, b) under unit loads at coordinates, less the share of the first ``count`` modes.

    While the first mode left out is a low one it is a static solution, later the sum over the modes that are left.
    """
    rigid = held.null.shape[1]
    first = squares[min(rigid, len(squares) - 1)]
    if count < len(squares) and squares[count]**2 > first * squares[-1] and count > rigid:
        left = modes[:, count:]
        return (left / squares[count:]) @ left[at].T
    return deflection(held, M, modes[:, :count], at)


def _elastic(M: np.ndarray, rigid: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """Return motions without their share of rigid-body modes."""
    return motions - rigid @ (rigid.T @ (M @ motions))


def _subspace(M: np.ndarray, held: Held, rigid: np.ndarray, motions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return squares (k,) of the lowest frequencies, and modes (n, k), from a start (n, k)."""
    squares = np.zeros(motions.shape[1])
    for _ in range(ROUNDS):
        forces = M @ motions
        moved = _elastic(M, rigid, held.solve(forces - M @ (rigid @ (rigid.T @ forces))))
        strain, kinetic = moved.T @ forces, moved.T @ M @ moved
        inverse, mixed = eigh(0.5 * (kinetic + kinetic.T), 0.5 * (strain + strain.T))
        inverse, mixed = inverse[::-1], mixed[:, ::-1]
        motions = (moved @ mixed) / np.sqrt(inverse)
        last, squares = squares, np.einsum("ij,ij->j", motions, forces @ mixed) / np.sqrt(inverse)
        if np.abs(squares - last).max() <= 4.0 * np.finfo(float).eps * len(squares) * squares.max():
            break
    return squares, motions
