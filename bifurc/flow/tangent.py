"""Growth of small perturbations along a recorded motion: arcs and saltations, orthonormalised after each."""
import numpy as np

from .._jit import njit
from .affine.engine import arc, curved_hold, forcing
from .rule import jump
from .saltation import joined, saltation

EVENT, CHATTER = 1, 2  # what a recorded row is, as in `scan`
LOST = 1e-13  # of its length before: a direction that an event shortens to less is gone for good
SPREAD = 1e-5  # of the growth of another direction: one that grows by less within an arc is carried over a part of it
HALVINGS = 12  # of an arc


@njit
def grow(T, rows, times, before, after, together, end, period, begin, Q, alive, sums):
    """Carry the directions ``Q`` (ns, ns) along a motion, adding the logarithms of their growth to ``sums`` (bins, ns).

    ``rows`` (N, 5), ``times``, ``before``, ``after`` (N, ns) are the record; the motion ends at ``end``, whole periods
    and a time.  ``together`` (N,) says which events always happen at the instant of the one before.
    A bin is a period counted from ``begin``.  ``alive`` (2,) is the number of directions that are left, and whether to stop here.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    x, xp, y1 = np.empty(nx), np.empty(nx), np.empty(ns)
    P, S, new = np.empty((ns, nx)), np.empty((ns, ns)), np.empty((ns, ns))
    when = np.empty(ns)
    count = rows.shape[0]
    if count > 0:
        rested(T, rows[0, 2], Q, alive, new)
    for i in range(count):
        if alive[1] != 0:
            return
        if i > 0 and i + 1 < count and together[i + 1]:
            continue  # it was carried through with the event before
        for c in range(ns):
            x[c] = after[i, c]
        forcing(T, times[i], x)
        bin = sums[min(max(rows[i, 4] - begin, 0), sums.shape[0] - 1)]
        held(T, rows[i, 2], x, Q, alive, P, new, bin)
        if i + 1 < count:
            span = (rows[i + 1, 4] - rows[i, 4]) * period + (times[i + 1] - times[i])
        else:
            span = (end[0] - rows[i, 4]) * period + (end[1] - times[i])
        along(T, rows[i, 2], times[i], max(span, 0.0), x, y1, Q, alive, S, new, bin)
        if i + 1 == count or rows[i + 1, 3] != EVENT and rows[i + 1, 3] != CHATTER:
            continue
        least = ns
        for e in range(i + 1, count):
            if e > i + 1 and not together[e]:
                break
            m, g, k = rows[e, 0], rows[e, 1], rows[e, 2]
            for c in range(ns):
                x[c] = before[e, c]
            forcing(T, times[e], x)
            jump(T, m, g, 1 if rows[e, 3] == CHATTER else 0, x, xp, P)
            for c in range(ns):
                xp[c] = after[e, c]
            if e == i + 1:
                saltation(T, m, g, k, x, xp, P, when, S)
            else:
                joined(T, m, k, x, xp, P, when, S, new)
            least = min(least, ns - forgotten(T, k))
        carried(S, Q, alive, new, bin)
        alive[0] = min(alive[0], least)  # what is left behind those is rounding


@njit
def along(T, m, t, span, x, y1, Q, alive, S, new, sums):
    """Carry the directions ``Q`` along an arc of mode ``m`` that lasts for ``span`` from ``x`` (nx,) at the time ``t``.

    No direction dies within it, but in the product over a long arc those that shrink fast are lost in the rounding of the others:
    the arc is halved until they are not.  ``y1`` (ns,), ``S`` and ``new`` (ns, ns) are room.
    """
    ns = new.shape[0]
    made, parts, Q0, alive0, grown = 0, 1, np.empty((ns, ns)), np.empty(1, np.int64), np.empty(ns)
    while made < parts:
        arc(T, m, x, span / parts, y1, S)
        Q0[:], alive0[0] = Q, alive[0]
        grown[:] = 0.0
        carried(S, Q0, alive0, new, grown)
        seen, kept = grown[:alive0[0]], alive0[0] == alive[0]
        if parts < 2**HALVINGS and (not kept or seen.size > 0 and np.min(seen) < np.max(seen) + np.log(SPREAD)):
            made, parts = 2 * made, 2 * parts
            continue
        Q[:], alive[0] = Q0, alive0[0]
        for k in range(alive[0]):
            sums[k] += grown[k]
        made += 1
        for c in range(ns):
            x[c] = y1[c]
        forcing(T, t + span * made / parts, x)


@njit
def carried(S, Q, alive, new, sums):
    """Carry the directions ``Q`` by the first columns (ns, ns) of ``S``; ``sums`` as in `orthonormal`, ``new`` (ns, ns) is room."""
    ns = new.shape[0]
    for c in range(ns):
        for k in range(alive[0]):
            new[c, k] = 0.0
            for j in range(ns):
                new[c, k] += S[c, j] * Q[j, k]
    orthonormal(new, alive, Q, sums)


@njit
def rested(T, m, Q, alive, new):
    """Take out of the directions ``Q`` what mode ``m``, in which a motion begins, forgets at once: speeds of rows that it holds,
    and distances from the surfaces on which it holds them.  Nothing grows by that; where a motion goes on nothing changes.

    Which way they are taken out is no matter of what grows afterwards; ``new`` (ns, ns) is room.
    """
    ns = new.shape[0]
    rows, count = np.zeros((2 * T.H.shape[1], ns)), 0
    for k in range(T.n_holds[m]):
        for part in range(2):
            full = 0.0
            for c in range(ns):
                rows[count, c] = T.H[m, k, c] if part == 0 else T.S[m, k, c]
                full += rows[count, c] * rows[count, c]
            for _ in range(2):
                for j in range(count):
                    dot = 0.0
                    for c in range(ns):
                        dot += rows[j, c] * rows[count, c]
                    for c in range(ns):
                        rows[count, c] -= dot * rows[j, c]
            left = 0.0
            for c in range(ns):
                left += rows[count, c] * rows[count, c]
            if left > LOST * LOST * full:
                for c in range(ns):
                    rows[count, c] /= np.sqrt(left)
                count += 1
    if count == 0:
        return
    for k in range(alive[0]):
        for c in range(ns):
            new[c, k] = Q[c, k]
        for j in range(count):
            dot = 0.0
            for c in range(ns):
                dot += rows[j, c] * Q[c, k]
            for c in range(ns):
                new[c, k] -= dot * rows[j, c]
    orthonormal(new, alive, Q, np.empty(ns))
    alive[0] = min(alive[0], ns - forgotten(T, m))


@njit
def held(T, m, x, Q, alive, P, new, sums):
    """Take out of the directions ``Q`` what a constraint on a curve forgets where mode ``m`` begins at ``x`` (nx,): the constraint
    acts on accelerations, along which a distance from the curve would stay, and count as a direction that neither grows nor dies.

    ``P`` (ns, nx) and ``new`` (ns, ns) are room.
    """
    ns = new.shape[0]
    P[:] = 0.0
    for c in range(ns):
        P[c, c] = 1.0
    curved_hold(T, m, x, P)
    changed = False
    for c in range(ns):
        for j in range(ns):
            changed = changed or P[c, j] != (1.0 if c == j else 0.0)
    if not changed:
        return
    carried(P, Q, alive, new, sums)


@njit
def forgotten(T, m):
    """Number of directions that what a mode holds leaves no trace of: position and speed at rest on a surface, the speed of
    what sticks."""
    total = 0
    for k in range(T.n_holds[m]):
        total += 1
        for c in range(T.S.shape[2]):
            if T.S[m, k, c] != 0.0:
                total += 1
                break
    return total


@njit
def orthonormal(new, alive, Q, sums):
    """Make the columns of ``new`` orthonormal in ``Q``; add the logarithms of their lengths.

    A column that is gone gives its place to the last one: which direction an event takes away is no matter of their order.
    """
    ns = new.shape[0]
    k = 0
    while k < alive[0]:
        length = 0.0
        for c in range(ns):
            length += new[c, k] * new[c, k]
        full = np.sqrt(length)
        for _ in range(2):
            for j in range(k):
                dot = 0.0
                for c in range(ns):
                    dot += Q[c, j] * new[c, k]
                for c in range(ns):
                    new[c, k] -= dot * Q[c, j]
        length = 0.0
        for c in range(ns):
            length += new[c, k] * new[c, k]
        length = np.sqrt(length)
        if not length > LOST * max(full, LOST):
            alive[0] -= 1
            for c in range(ns):
                new[c, k] = new[c, alive[0]]
            continue
        for c in range(ns):
            Q[c, k] = new[c, k] / length
        sums[k] += np.log(length)
        k += 1
