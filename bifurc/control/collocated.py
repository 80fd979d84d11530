"""Multipliers under delayed feedback by a second method: the monodromy operator of the delay equation, collocated.

The state of a delay equation is a function over one delay.  It is represented by its values at Gauss points of pieces that
are broken at the events (the solution is smooth in each, nowhere across them); one period maps these values, linear.  The
eigenvalues of the map are the multipliers (Breda, Maset, Vermiglio 2014; the break at events is what a smooth code lacks).
"""
import numpy as np
from scipy.sparse.linalg import ArpackError, eigs

from .linearization import NODES, Kick, Linearization, gauss

DENSE = 300  # size from which only the leading eigenvalues are computed
LEADING = 6  # of them


class Collocated:
    """Monodromy operator over one period.

    Parameters
    ----------
    linear : Linearization
    memory : float
        R of the extended feedback.

    Notes
    -----
    The unknowns are the state at the end of the period, the values of the coordinates that are fed back at all Gauss points of
    the period, and, with memory, those of p.
    """

    def __init__(self, linear: Linearization, memory: float = 0.0):
        self.linear, self.memory = linear, memory
        self.rows, self.states = linear.rows.shape
        self.points = self.rows * NODES * len(linear.pieces)
        self.size = self.states + self.points * (2 if memory else 1)

    def matrix(self, gain: float) -> np.ndarray:
        """Return the operator (size, size) for one gain."""
        linear, ns, M, m = self.linear, self.states, self.points, self.rows
        C = linear.rows
        _, inner, ends = gauss()
        old_s = np.zeros((M, self.size))  # values one period ago, as rows on the unknowns
        old_s[:, ns:ns + M] = np.eye(M)
        old_p = np.zeros((M, self.size))
        if self.memory:
            old_p[:, ns + M:] = np.eye(M)
        delayed = (self.memory * old_p - gain * old_s).reshape(-1, m, self.size)  # p = gain s + delayed
        y = np.zeros((ns, self.size))
        y[:, :ns] = np.eye(ns)
        new_s, new_p = np.empty_like(delayed), np.empty_like(delayed)
        last = _last_values()
        for k, piece in enumerate(linear.pieces):
            if isinstance(piece.kick, Kick):
                kick = piece.kick
                before = (k - 1) % len(linear.pieces)  # the delayed signal at the event, from the piece that ends there
                p = gain * (C @ y) + np.einsum("j,jrm->rm", last, delayed[NODES * before:NODES * (before + 1)])
                y = kick.S @ y + kick.push @ p
            elif piece.kick is not None:
                y = piece.kick @ y
            here = slice(NODES * k, NODES * (k + 1))
            A = piece.A + gain * (piece.b @ C)
            system = np.eye(NODES * ns) - piece.span * np.einsum("ij,jab->iajb", inner, A).reshape(NODES * ns, NODES * ns)
            drive = np.einsum("ar,jrm->jam", piece.b, delayed[here])
            right = (y[None] + piece.span * np.einsum("ij,jam->iam", inner, drive)).reshape(NODES * ns, self.size)
            values = np.linalg.solve(system, right).reshape(NODES, ns, self.size)
            rate = np.einsum("jab,jbm->jam", A, values) + drive
            y = y + piece.span * np.einsum("j,jam->am", ends, rate)
            new_s[here] = np.einsum("ra,jam->jrm", C, values)
            new_p[here] = gain * new_s[here] + delayed[here]
        held = (y, new_s.reshape(M, self.size), new_p.reshape(M, self.size))
        return np.vstack(held if self.memory else held[:2])

    def multipliers(self, gain: float) -> np.ndarray:
        """Return the eigenvalues of the operator, largest modulus first; those that only label a continuum are left out."""
        return _ordered(np.linalg.eigvals(self._reduced(gain)))

    def leading(self, gain: float) -> complex:
        """Return the eigenvalue of the largest modulus.

        The operator is compact (but for memory, which adds R), so that Arnoldi's method finds it from few products where the
        matrix is large; one of a complex pair is returned.
        """
        return complex(self.outside(gain, np.inf)[0])

    def outside(self, gain: float, least: float) -> np.ndarray:
        """Return at least the eigenvalues with a modulus above ``least``, and the leading one; largest modulus first."""
        M = self._reduced(gain)
        count, start = LEADING, np.random.default_rng(0).normal(size=len(M))
        while len(M) > DENSE and count < len(M) // 4:
            try:
                found = _ordered(eigs(M, k=count, which="LM", v0=start, return_eigenvectors=False))
            except ArpackError:  # a cluster: all of them, then
                break
            if abs(found[-1]) < least:
                return found
            count *= 2
        return _ordered(np.linalg.eigvals(M))

    def _reduced(self, gain: float) -> np.ndarray:
        """Return the operator without the states that only label a continuum."""
        return self.linear.labels.reduced(self.matrix(gain))


def _ordered(values: np.ndarray) -> np.ndarray:
    return values[np.argsort(-np.abs(values), kind="stable")]


def _last_values() -> np.ndarray:
    """Return the weights (NODES,) that extrapolate Gauss values to the end of their piece."""
    points, _, _ = gauss()
    weights = np.array([1.0 / np.prod(points[j] - np.delete(points, j)) for j in range(NODES)])
    terms = weights / (1.0 - points)
    return terms / terms.sum()
