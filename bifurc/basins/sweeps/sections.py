"""Rows of section points by brute force: settled, carried on, their period read off."""
import numpy as np

from ...ensemble.period_map import MAPPED, PeriodMap

APERIODIC = 0  # period of a row that does not repeat


def settled(period_map: PeriodMap, X: np.ndarray, transient: int, keep: int):
    """Return section points after a transient.

    Parameters
    ----------
    period_map : PeriodMap
    X : ndarray
        Starts (k, ns) at phase 0.
    transient, keep : int
        Forcing periods that are passed over, and recorded.

    Returns
    -------
    points : ndarray
        (k, keep, ns); NaN where a motion ended before.
    outcomes : ndarray of int
        (k,), `CellState` codes, 0: carried through.
    impacts : ndarray of int
        (k,), over the recorded periods.
    """
    points = np.full((len(X), keep, X.shape[1]), np.nan)
    impacts, outcomes = np.zeros(len(X), np.int64), np.full(len(X), MAPPED)
    y = X
    if transient > 0:
        images = period_map.apply(X, transient)
        y, outcomes = images.ends, images.outcomes.copy()
    for n in range(keep):
        alive = np.flatnonzero(outcomes == MAPPED)
        if not alive.size:
            break
        images = period_map.apply(y[alive], 1)
        y = y.copy()
        y[alive] = images.ends
        outcomes[alive] = images.outcomes
        impacts[alive] += images.impacts
        points[alive, n] = images.ends
    points[outcomes != MAPPED] = np.nan
    return points, outcomes, impacts


def period_of(row: np.ndarray, scale: np.ndarray, tolerance: float) -> int:
    """Return the least number of forcing periods after which a row of section points (keep, ns) repeats, or 0.

    A period must be seen twice: it is at most half the row.
    """
    scaled = row / scale
    for p in range(1, len(row) // 2 + 1):
        if np.linalg.norm(scaled[-1] - scaled[-1 - p]) <= tolerance and \
                np.linalg.norm(scaled[p:] - scaled[:-p], axis=1).max() <= tolerance:
            return p
    return APERIODIC


def groups(points: np.ndarray, periods: np.ndarray, scale: np.ndarray, tolerance: float) -> np.ndarray:
    """Return for each row of section points (k, keep, ns) the number of its attractor, in order of appearance.

    Periodic rows are one attractor when they pass through the same points, shifted or not; all rows that do not repeat
    count as one.
    """
    found = np.full(len(points), -1)
    heads: list[int] = []
    for i in range(len(points)):
        for number, head in enumerate(heads):
            if periods[i] != periods[head]:
                continue
            if periods[i] == APERIODIC:
                found[i] = number
                break
            cycle = points[head, -int(periods[head]):] / scale
            if np.linalg.norm(cycle - points[i, -1] / scale, axis=1).min() <= 10.0 * tolerance:
                found[i] = number
                break
        if found[i] < 0:
            found[i] = len(heads)
            heads.append(i)
    return found
