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
    if n == 0:
        return float((np.abs(T.A[:, :, ns:]).sum(axis=(1, 2)) / rate).max(initial=0.0)) or 1.0
    loads = np.abs(T.A[:, n:2 * n, ns:]).sum(axis=(1, 2)) / np.maximum(rate, TURN / T.step)**2
    rows = np.concatenate([T.G.reshape(-1, T.G.shape[2]), T.H.reshape(-1, T.H.shape[2]), T.LU, T.LS])
    offset = np.abs(rows[:, ns:]).sum(axis=1)
    per_length = np.maximum(np.abs(rows[:, :n]).max(axis=1, initial=0.0), rate * np.abs(rows[:, n:2 * n]).max(axis=1, initial=0.0))
    known = per_length > 0.0
    lengths = np.concatenate([loads, offset[known] / per_length[known]])
    return float(lengths.max(initial=0.0)) or 1.0


def natural_sizes(tables: Tables, states: np.ndarray, time: float) -> np.ndarray:
    """Return sizes (ns,) of the states of a system of first order, each in its own unit.

    They are the largest of ``states`` (k, ns), and of one that is zero in all what it may change by in a ``time``.
    """
    largest = np.abs(states).max(axis=0)
    change = np.abs(tables.A).max(axis=0) @ np.append(largest, np.ones(tables.A.shape[2] - largest.size)) * time
    sizes = np.where(largest > 1e-6 * change, largest, change)
    return np.where(sizes > 0.0, sizes, sizes.max(initial=0.0) or 1.0)
