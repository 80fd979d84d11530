"""Impacts that follow each other at one instant: whether they are infinitely many, and what is left of them.

Each impact is Newton's, of one contact; of several that close the first in the order of the elements comes first.  Some such
sequences are infinite, as between three masses of which the middle one is thrown to and fro with little restitution; others only
look so: a row of balls passes a speed on by as many impacts as it likes.  So the sequence is written out, in the closing speeds
alone.  Either no contact closes any more; or all that still meet do so with next to nothing of the first speed, as it is in a
geometric sequence; or neither is seen, and nothing is concluded.  Where no impulses whatever would open all contacts something is
caught between them.
"""
import numpy as np
from scipy.optimize import nnls

from ..._jit import both
from ..chatter import UNSEEN
from .polynomial import EPS

WRITTEN = 1000000  # impacts that are written out, at most: a tenth of a second
SPENT = 64.0 * EPS  # of the first closing speeds: what is left of an infinite sequence
LATE = 1e-8  # of the first closing speeds: contacts that still meet with less belong to an infinite sequence
CAUGHT = 1e-9  # of the closing speeds: what no impulses take away
FLAT = 8.0  # times the height that rounding hides (`chatter.UNSEEN`): flights so low are none


@both
def impacts(W, ratios, w, largest, sums, late):
    """Write out the impacts of contacts that close with the speeds ``w`` (k,), in place; return whether no contact closes any more.

    ``W`` (k, k): change of all speeds by the impact of a contact, its column, that changes its own by 1; ``ratios`` (k,) are the
    restitutions.  Of several contacts that close the first comes first, or with ``largest`` the fastest.  ``sums`` (k,) receives
    how much all impacts of each contact have changed its own speed, ``late`` (k,) whether its last impacts had next to no speed.
    """
    first = np.abs(w).max()
    for _ in range(WRITTEN):
        k, most = -1, SPENT * first
        for i in range(w.size):
            if w[i] > most:
                k = i
                if not largest:
                    break
                most = w[i]
        if k < 0:
            return True
        late[k] = w[k] <= LATE * first
        change, own = -(1.0 + ratios[k]) * w[k], -ratios[k] * w[k]
        for i in range(w.size):
            w[i] += change * W[i, k]
        w[k] = own
        sums[k] += change
    return False


def written_out(W, ratios, w):
    """Return what `impacts` finds in the order of the elements; where that has no end, as where two contacts strike for ever before
    a third has its turn, the fastest contact strikes first.

    Returns whether it is over, which contacts never end (k,), which part (k,), the sums (k,), and whether the fastest struck first.
    """
    for largest in (False, True):
        after, sums, late = w.copy(), np.zeros(len(w)), np.zeros(len(w), bool)
        over = bool(impacts(W, ratios, after, largest, sums, late))
        if over:
            break
    little = LATE * np.abs(w).max()
    late &= np.abs(after) <= little  # two contacts may have met for ever before a third drove them apart
    return over, late & (late.sum() > 1), after < -little, sums, largest


def lasting(scene, m, x, touching):
    """Return what becomes of the contacts of the guards ``touching`` of mode ``m`` at ``x`` (nx,): those whose impacts never end,
    those that part, and the state that finitely many impacts leave.

    Without an infinite sequence the flights so low that rounding hides them have an end, and the state is ``x``, as where nothing
    is shown.  All have where they can never open together.
    """
    T = scene.tables
    B, rates, none = T.B[m, touching], T.GT[m, touching, :, 1], np.zeros(len(touching), bool)
    W, w = rates[:, :scene.ns] @ B.T, rates @ x
    over, found, parted, sums, reordered = written_out(W, T.ratio[m, touching], w)
    if not over:
        caught = nnls(np.hstack((W, -W, np.eye(len(w)))), -w)[1] > CAUGHT * np.abs(w).max()
        return none | caught, none, x
    y = x.copy()
    y[:scene.ns] += sums @ B
    if found.any() or reordered:
        return found, parted, y
    sizes = np.abs(T.G[m, touching]) @ np.abs(x)
    push = float((2.0 * T.GT[m, touching, :, 2] @ y).max())
    return (rates @ y)**2 <= 2.0 * FLAT * UNSEEN * EPS * sizes * push if push > 0.0 else none, none, x
