"""Statics of a stiffness matrix: what it leaves free, constraint shapes, flexibility, with the digits that the matrix has.

A fine mesh is soft against its own entries: n elements of a beam bend n^4 times easier than one of them, and an eigenvalue
solver, whose errors are relative to the highest frequency, cannot tell the bending of 100 elements from a rigid motion.
Two things can.  Cholesky's elimination with pivots measures each coordinate in its own stiffness; where little is left of it
the coordinate is made a support, so that spans between supports are short.  And the strain energy of the shapes of the
supports, v^T K v, against the sum of the sizes of its terms, |v|^T |K| |v|: the entries of K are known to rounding, so a
shape whose energy is rounding of its own terms has none.  Energies cancel to that level and are summed in slices without
rounding errors (Ozaki, Ogita, Oishi, Rump 2012).
"""
import numpy as np
from scipy.linalg import cho_solve
from scipy.linalg.lapack import dpstrf

SOFT = 1e-4  # of a coordinate's own stiffness: less is left of it, and it becomes a support; solutions between keep 11 digits
ROUNDED = 8.0 * np.finfo(float).eps  # energy over the sizes of its terms: entries are sums of a few rounded numbers
WRONG = 1e-9  # the same of a negative energy: what is left of condensations and of files with few digits
SLICES = 4  # of 21 bits for 2000 coordinates: 84 bits


class Held:
    """A stiffness matrix with some coordinates held.

    Parameters
    ----------
    K : ndarray (n, n)
        Symmetric.
    kept : sequence of int
        Coordinates that are held, b of them.

    Attributes
    ----------
    null : ndarray (n, r)
        Independent motions without strain while the kept coordinates rest.
    negative : int or None
        A coordinate that moves in a motion of negative strain energy: K is not positive semidefinite.
    shapes : ndarray (n, b)
        Constraint shapes: each kept coordinate moved by one, the others held.
    stiffness : ndarray (b, b)
        Of the kept coordinates, the others free.
    """

    def __init__(self, K: np.ndarray, kept=()):
        n, b = len(K), len(kept)
        own = np.abs(np.diag(K))
        self._scale = scale = np.exp2(np.rint(0.5 * np.log2(np.where(own > 0.0, own, 1.0))))  # powers of two round nothing
        K = K / np.outer(scale, scale)
        rest = np.setdiff1d(np.arange(n), kept)
        factor, order, rank = _eliminated(K[np.ix_(rest, rest)], SOFT)
        self._held, self._factor = held, factor = rest[order[:rank]], factor
        support = np.concatenate((np.asarray(kept, int), rest[order[rank:]]))
        shapes = np.zeros((n, len(support)))
        shapes[support] = np.eye(len(support))
        shapes[held] = -cho_solve((factor, True), K[np.ix_(held, support)])
        forces = product(K, shapes)
        shapes[held] -= cho_solve((factor, True), forces[held])
        energy = forces[support] + shapes[held].T @ forces[held]  # of the shapes as they are now: of second order in their errors
        energy = 0.5 * (energy + energy.T)
        terms = np.sqrt(np.maximum(np.einsum("ij,ij->j", np.abs(shapes), np.abs(K) @ np.abs(shapes)), 1e-300))
        ratio = energy[b:, b:] / np.outer(terms[b:], terms[b:])
        own_factor, order, rank = _eliminated(ratio, ROUNDED)
        elastic, loose = b + order[:rank], b + order[rank:]
        self._soft, self._soft_factor = shapes[:, elastic], own_factor * terms[elastic, None]
        along = self._solved(energy[elastic])  # what the soft supports do for the others
        left = energy - energy[:, elastic] @ along
        self.null = (shapes[:, loose] - self._soft @ along[:, loose]) / scale[:, None]
        below = np.flatnonzero(np.diag(left)[loose] < -WRONG * terms[loose]**2)
        self.negative = int(support[loose[below[0]]]) if below.size else None
        lift = scale[np.asarray(kept, int)]
        self.shapes = (shapes[:, :b] - self._soft @ along[:, :b]) * lift / scale[:, None]
        self.shapes[np.asarray(kept, int)] = np.eye(b)
        self.stiffness = 0.5 * (left[:b, :b] + left[:b, :b].T) * np.outer(lift, lift)

    def _solved(self, forces: np.ndarray) -> np.ndarray:
        return cho_solve((self._soft_factor, True), forces) if len(self._soft_factor) else forces

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Return deflections (n, k) under forces (n, k), which must do no work on the motions without strain."""
        forces = forces / self._scale[:, None]
        found = self._soft @ self._solved(self._soft.T @ forces)
        found[self._held] += cho_solve((self._factor, True), forces[self._held])
        return found / self._scale[:, None]


def _eliminated(K: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Return Cholesky's factor (m, m) of the m coordinates of which more than ``least`` is left, all in order, and m."""
    if not np.diag(K).max(initial=0.0) > least:  # LAPACK takes the first one unseen
        return np.zeros((0, 0)), np.arange(len(K)), 0
    factor, order, rank, _ = dpstrf(K, tol=least, lower=1)
    return np.tril(factor[:rank, :rank]), order - 1, int(rank)


def product(A: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Return A X with errors of 1e-25 of the largest terms, whatever cancels.

    Both are cut into slices of so few bits that products of slices are exact in any order of summation.
    """
    bits = (52 - int(np.ceil(np.log2(A.shape[1])))) // 2 if A.size else 1
    left, right = _slices(A, 1, bits), _slices(X, 0, bits)
    total, rest = np.zeros((len(A), X.shape[1])), np.zeros((len(A), X.shape[1]))
    for level in range(SLICES):
        for i in range(level + 1):
            term = left[i] @ right[level - i]
            new = total + term
            part = new - total
            rest += (total - (new - part)) + (term - part)  # what the sum has lost (Knuth)
            total = new
    return total + rest


def _slices(A: np.ndarray, axis: int, bits: int) -> list[np.ndarray]:
    """Return slices that sum to A; entries of one are multiples of one power of two along the axis."""
    found = []
    for _ in range(SLICES):
        top = np.abs(A).max(axis, keepdims=True, initial=0.0)
        unit = np.exp2(np.ceil(np.log2(np.where(top > 0.0, top, 1.0))) + 53 - bits)
        found.append((A + unit) - unit)
        A = A - found[-1]
    return found


def deflection(held: Held, M: np.ndarray, modes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the deflection (n, b) under unit loads at coordinates, less the share of modes.

    Parameters
    ----------
    held : Held
        Without kept coordinates.
    M : ndarray (n, n)
    modes : ndarray (n, m)
        Of unit mass, all rigid-body modes among them.
    at : ndarray of int (b,)
    """
    loads = -M @ (modes @ modes[at].T)
    loads[at, np.arange(len(at))] += 1.0
    found = held.solve(loads)
    return found - modes @ (modes.T @ (M @ found))


def of_unit_mass(M: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """Return motions (n, r) turned and scaled to phi^T M phi = 1."""
    size = np.sqrt(np.einsum("ij,ij->j", motions, M @ motions))
    motions = motions / np.where(size > 0.0, size, 1.0)
    values, turned = np.linalg.eigh(motions.T @ M @ motions)
    return motions @ (turned / np.sqrt(values))
