"""Natural length and rate of a scene, read from its numbers: the measure of states where no motion gives one yet.

Starts that lie aside of a state at rest, samples of a law, distances from zero: a fixed number in their place would be large in
one set of units and small in another.
"""
import numpy as np

from .tables import TURN, Tables


def natural_rate(tables: Tables) -> float:
    """Return the forcing frequency, or without one the largest rate of change in any mode, 1/time; 1 where nothing changes."""
    return float(tables.flat[0]) or TURN / float(tables.step.min())


def natural_length(tables: Tables) -> float:
    """Return the largest of the lengths that the numbers of a scene tell; 1 where there is none.

    These are clearances; speeds of belts and walls over the rate of change; constant and periodic loads over its square.
    """
    T, rate = tables, natural_rate(tables)
    n, ns = T.LP.shape[2], T.A.shape[1]
    loads = np.abs(T.A[:, n:2 * n, ns:]).sum(axis=(1, 2)) / np.maximum(rate, TURN / T.step)**2
    rows = np.concatenate([T.G.reshape(-1, T.G.shape[2]), T.H.reshape(-1, T.H.shape[2]), T.LU, T.LS])
    offset = np.abs(rows[:, ns:]).sum(axis=1)
    per_length = np.maximum(np.abs(rows[:, :n]).max(axis=1, initial=0.0), rate * np.abs(rows[:, n:2 * n]).max(axis=1, initial=0.0))
    known = per_length > 0.0
    lengths = np.concatenate([loads, offset[known] / per_length[known]])
    return float(lengths.max(initial=0.0)) or 1.0
