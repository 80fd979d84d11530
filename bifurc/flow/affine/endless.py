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

WRITTEN = 4096  # impacts that are written out before it is asked whether they repeat
BLOCKS = 250  # as many times, at most: a tenth of a second
CYCLE = 64  # longest sequence of contacts, in impacts, that is found to repeat
DOUBLINGS = 40  # of the number of cycles that are left out: what has not fallen then does so by rounding, if at all (1e12 EPS)
SPENT = 64.0 * EPS  # of the first closing speeds: what is left of an infinite sequence
LATE = 1e-8  # of the first closing speeds: contacts that still meet with less belong to an infinite sequence
CAUGHT = 1e-9  # of the closing speeds: what no impulses take away
FLAT = 8.0  # times the height that rounding hides (`chatter.UNSEEN`): flights so low are none


@both
def impacts(W, ratios, w, first, largest, sums, late, order):
    """Write out the impacts of contacts that close with the speeds ``w`` (k,), in place; return how many it takes until no contact
    closes any more, as many as there is room for where that is more.

    ``W`` (k, k): change of all speeds by the impact of a contact, its column, that changes its own by 1; ``ratios`` (k,) are the
    restitutions, ``first`` is the first speed.  Of several contacts that close the first comes first, or with ``largest`` the
    fastest.  ``sums`` (k,) receives how much all impacts of each contact have changed its own speed, ``late`` (k,) whether its last
    impacts had next to no speed, ``order`` (impacts,) the contacts.
    """
    for many in range(order.size):
        k, most = -1, SPENT * first
        for i in range(w.size):
            if w[i] > most:
                k = i
                if not largest:
                    break
                most = w[i]
        if k < 0:
            return many
        late[k] = w[k] <= LATE * first
        change, own = -(1.0 + ratios[k]) * w[k], -ratios[k] * w[k]
        for i in range(w.size):
            w[i] += change * W[i, k]
        w[k] = own
        sums[k] += change
        order[many] = k
    return order.size


def repeats(order):
    """Return the contacts (impacts,) that the last impacts of an ``order`` repeat, three times at least; empty: none."""
    for length in range(1, CYCLE + 1):
        if np.array_equal(order[-3 * length:-length], order[-2 * length:]):
            return order[-length:]
    return order[:0]


def left_out(W, ratios, w, first, largest, sums, late, cycle):
    """Leave out as many repetitions of a ``cycle`` (impacts,) as there are, in place as in `impacts`; return whether speeds fall.

    The cycle takes the speeds to ``P w``: so many cycles, doubled again and again, take them to a power of P, as long as the next
    cycle there is still the same one.  Powers of P are small among the speeds that impulses change, of a basis Q; what these do not
    change is nothing, or the speeds do not fall.
    """
    Q, sizes, _ = np.linalg.svd(W)
    Q = Q[:, sizes > SPENT * sizes[0]]
    start = Q.T @ w
    if np.abs(w - Q @ start).max() > SPENT * first:
        return True
    P, C = Q, np.zeros_like(Q)
    for k in cycle:
        C[k] -= (1.0 + ratios[k]) * P[k]
        P = P - (1.0 + ratios[k]) * np.outer(W[:, k], P[k])
    P, some, done, order = Q.T @ P, np.eye(Q.shape[1]), np.zeros(len(w)), np.empty_like(cycle)
    for _ in range(DOUBLINGS):
        after = Q @ (P @ start)
        spent = np.abs(after).max() <= SPENT * first
        impacts(W, ratios, after.copy(), first, largest, np.zeros(len(w)), np.zeros(len(w), bool), order)
        if not spent and not np.array_equal(order, cycle):
            break
        w[:], done = after, C @ (some @ start)
        if spent:
            late[cycle] = True
            break
        some, P = some + some @ P, P @ P
    else:
        return False
    sums += done
    return True


def written_out(W, ratios, w):
    """Return what `impacts` finds in the order of the elements; where that has no end, as where two contacts strike for ever before
    a third has its turn, the fastest contact strikes first.

    Returns whether it is over, which contacts never end (k,), which part (k,), the sums (k,), and whether the fastest struck first.
    """
    first, order = np.abs(w).max(), np.empty(WRITTEN, np.int64)
    for largest in (False, True):
        after, sums, late = w.copy(), np.zeros(len(w)), np.zeros(len(w), bool)
        for _ in range(BLOCKS):
            over = impacts(W, ratios, after, first, largest, sums, late, order) < WRITTEN
            cycle = order[:0] if over else repeats(order)
            if over or len(cycle) and not left_out(W, ratios, after, first, largest, sums, late, cycle.copy()):
                break
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
        return found, parted, y if reordered or sums[~found].any() else x  # what rests is put to rest from the first speeds
    sizes = np.abs(T.G[m, touching]) @ np.abs(x)
    push = float((2.0 * T.GT[m, touching, :, 2] @ y).max())
    return (rates @ y)**2 <= 2.0 * FLAT * UNSEEN * EPS * sizes * push if push > 0.0 else none, none, x
