"""Multipliers under delayed feedback by a second method: the monodromy operator of the delay equation, collocated.

The state of a delay equation is a function over one delay.  It is represented by its values at Gauss points of pieces that
are broken at the events (the solution is smooth in each, nowhere across them); one period maps these values, linear.  The
eigenvalues of the map are the multipliers (Breda, Maset, Vermiglio 2014; the break at events is what a smooth code lacks).
"""
import numpy as np

from .linearization import NODES, Kick, Linearization, gauss


class Collocated:
    """Monodromy operator over one period.

    Parameters
    ----------
    linear : Linearization
    memory : float
        R of the extended feedback.

    Notes
    -----
    The unknowns are the state at the end of the period, the values of the coordinate that is fed back at all Gauss points of
    the period, and, with memory, those of p.
    """

    def __init__(self, linear: Linearization, memory: float = 0.0):
        self.linear, self.memory = linear, memory
        self.states = linear.row.size
        self.points = NODES * len(linear.pieces)
        self.size = self.states + self.points * (2 if memory else 1)

    def matrix(self, gain: float) -> np.ndarray:
        """Return the operator (size, size) for one gain."""
        linear, ns, M = self.linear, self.states, self.points
        c = linear.row
        _, inner, ends = gauss()
        old_s = np.zeros((M, self.size))  # values one period ago, as rows on the unknowns
        old_s[:, ns:ns + M] = np.eye(M)
        old_p = np.zeros((M, self.size))
        if self.memory:
            old_p[:, ns + M:] = np.eye(M)
        delayed = self.memory * old_p - gain * old_s  # p = gain s + delayed
        y = np.zeros((ns, self.size))
        y[:, :ns] = np.eye(ns)
        new_s, new_p = np.empty((M, self.size)), np.empty((M, self.size))
        last = _last_values()
        for k, piece in enumerate(linear.pieces):
            if isinstance(piece.kick, Kick):
                kick = piece.kick
                before = (k - 1) % len(linear.pieces)  # the delayed signal at the event, from the piece that ends there
                p = gain * (c @ y) + last @ delayed[NODES * before:NODES * (before + 1)]
                y = kick.S @ y + np.outer(kick.push, p)
            elif piece.kick is not None:
                y = piece.kick @ y
            here = slice(NODES * k, NODES * (k + 1))
            A = piece.A + gain * np.outer(piece.b, c)
            system = np.eye(NODES * ns) - piece.span * np.einsum("ij,jab->iajb", inner, A).reshape(NODES * ns, NODES * ns)
            drive = np.einsum("a,jm->jam", piece.b, delayed[here])
            right = (y[None] + piece.span * np.einsum("ij,jam->iam", inner, drive)).reshape(NODES * ns, self.size)
            values = np.linalg.solve(system, right).reshape(NODES, ns, self.size)
            rate = np.einsum("jab,jbm->jam", A, values) + drive
            y = y + piece.span * np.einsum("j,jam->am", ends, rate)
            new_s[here] = np.einsum("a,jam->jm", c, values)
            new_p[here] = gain * new_s[here] + delayed[here]
        return np.vstack((y, new_s, new_p) if self.memory else (y, new_s))

    def multipliers(self, gain: float) -> np.ndarray:
        """Return the eigenvalues of the operator, largest modulus first; those that only label a continuum are left out."""
        M = self.matrix(gain)
        kept = self.linear.kept
        if kept:
            M = np.delete(np.delete(M, kept, 0), kept, 1)
        found = np.linalg.eigvals(M)
        return found[np.argsort(-np.abs(found), kind="stable")]


def _last_values() -> np.ndarray:
    """Return the weights (NODES,) that extrapolate Gauss values to the end of their piece."""
    points, _, _ = gauss()
    weights = np.array([1.0 / np.prod(points[j] - np.delete(points, j)) for j in range(NODES)])
    terms = weights / (1.0 - points)
    return terms / terms.sum()
