"""Impacts that follow each other at one instant: whether they are infinitely many, and what is left of them.

Each impact is Newton's, of one contact; of several that close the first in the order of the elements comes first.  Some such sequences
are infinite, as between three masses of which the middle one is thrown to and fro with little restitution; others only look so: a
row of balls passes a speed on by as many impacts as it likes.  So the sequence is written out, in the closing speeds alone.  Either
no contact closes any more; or all that still meet do so with next to nothing of the first speed, as it is in a geometric sequence;
or neither is seen, and nothing is concluded.
"""
import numpy as np

from .affine.polynomial import EPS
from .chatter import UNSEEN

WRITTEN = 20000  # impacts that are written out, at most: a hundredth of a second
SPENT = 64.0 * EPS  # of the first closing speeds: what is left of an infinite sequence
LATE = 1e-8  # of the first closing speeds: contacts that still meet with less belong to an infinite sequence
FLAT = 8.0  # times the height that rounding hides (`chatter.UNSEEN`): flights so low are none


def impacts(W, ratios, w):
    """Write out the impacts of contacts that close with the speeds ``w`` (k,).

    Parameters
    ----------
    W : ndarray (k, k)
        Change of all speeds by the impact of a contact, its column, that changes its own by 1.
    ratios : ndarray (k,)
        Restitutions.

    Returns
    -------
    lasting : list of int
        Contacts whose impacts never end; empty: there are none, or they are not shown.
    sums : ndarray (k,)
        How much all impacts of each contact have changed its own speed.
    over : bool
        Whether no contact closes any more.
    """
    w, sums, late = np.array(w, float), np.zeros(len(w)), dict[int, None]()
    first = float(np.abs(w).max(initial=0.0))
    for _ in range(WRITTEN):
        closing = np.flatnonzero(w > SPENT * first)
        if not len(closing):
            return ([*late] if len(late) > 1 else []), sums, True
        k = int(closing[0])
        if w[k] <= LATE * first:
            late[k] = None
        change, own = -(1.0 + ratios[k]) * w[k], -ratios[k] * w[k]
        w += change * W[:, k]
        w[k] = own
        sums[k] += change
    return [], sums, False


def lasting(scene, m, x, touching):
    """Return the guards among those ``touching`` in mode ``m`` at ``x`` (nx,) whose impacts never end, and the state to rest from.

    Without an infinite sequence those are returned whose flights are so low that rounding hides them; none, and ``x``, where any
    rises or nothing is shown.
    """
    T = scene.tables
    B, rates = T.B[m, touching], T.GT[m, touching, :, 1]
    found, sums, over = impacts(rates[:, :scene.ns] @ B.T, T.ratio[m, touching], rates @ x)
    y = x.copy()
    y[:scene.ns] += sums @ B
    if found:
        return [touching[k] for k in found], y
    sizes = np.abs(T.G[m, touching]) @ np.abs(x)
    push = float((2.0 * T.GT[m, touching, :, 2] @ y).max())
    low = (rates @ y)**2 <= 2.0 * FLAT * UNSEEN * EPS * sizes * push
    return ([g for g, flat in zip(touching, low, strict=True) if flat], x) if over and push > 0.0 else ([], x)
