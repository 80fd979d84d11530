"""The rule at an event: what jumps, and which mode may start (DESIGN "settle"), one place for all scalar engines.

The jump of a state through guard ``g`` of mode ``m`` is ``x -> (x+, dx+/dx)``.  In affine scenes it is a row of the tables,
``x+ = R x``; callers take state and derivative from here and assume no constant matrix.  A mode may start at ``x`` iff every
row it holds is at rest on its surface and every guard is inside: negative, or zero with its first non-zero derivative along
the mode's own flow negative.  What is zero is measured by the rounding of the terms that are added up.
"""

import numpy as np

from .._jit import FLAG, NOTHING, WHOLE, apart, both, leaf
from ..compose.tables import ORDER
from .affine.engine import curved_jump, curved_kick, curved_rest, guard_series
from .affine.hidden import HIDDEN, blurred, followed
from .affine.polynomial import EPS, SMALLEST
from .chatter import stilled, turned_back, undivided

NOISE = 64.0 * EPS  # of the sum of the terms: values below it are zero
JOINS = 16  # other elements that may join in one event


@apart(NOTHING, python=True)
def jump(T, m, g, closes, x, xp, P):
    """Write the state after an event into ``xp`` (nx,) and its derivative in the state before, ``x`` (nx,), into ``P`` (ns, nx).

    Where ``closes`` is not 0 the rest of a complete chattering ends here: the state that a plastic impact leaves.  From 2 on it
    says that the mode of rest is ``closes`` - 2.  With Q the projection along the kick, R = I - (1 + r) Q in the velocities,
    without rebound I - Q.
    """
    R, ratio = T.R, T.ratio
    ns, nx = P.shape
    n = T.LP.shape[2]
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            r = R[m, g, i, c]
            if closes > 0 and n <= i < 2 * n:
                one = 1.0 if i == c else 0.0
                r = one + (r - one) / (1.0 + ratio[m, g])
            P[i, c] = r
            total += r * x[c]
        xp[i] = total
    for c in range(ns, nx):
        xp[c] = x[c]
    if closes > 0 and T.n_holds[m] > 0 and not undivided(T, m, g):
        stilled(T, m, g, x, xp, P)
    elif closes > 0 and T.n_guards[m] > 1:
        turned_back(T, m, g, closes - 2, x, xp, P)
    curved_jump(T, m, g, closes > 0, x, xp, P)


@leaf
def jumped(T, m, g, x, arrive, xp):
    """Write the state after guard ``g`` of mode ``m`` into ``xp`` (nx,): `jump` without derivative; return the guard's new rate.

    ``arrive`` is the rate with which the guard was reached.  After a kick by restitution the new rate is known: speeds of
    complete chatterings keep their relative accuracy, a plastic impact leaves none.  NaN: it is not known.
    """
    B, GT, R = T.B, T.GT, T.R
    ns, nx = R.shape[2], x.size
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            total += R[m, g, i, c] * x[c]
        xp[i] = total
    for c in range(ns, nx):
        xp[c] = x[c]
    curved_kick(T, m, g, x, xp)
    if T.kick[m, g] == 0:
        return np.nan
    after = 0.0
    for c in range(nx):
        after += GT[m, g, c, 1] * xp[c]
    if T.ends_in[m, g] != -1:
        wanted = -T.ratio[m, g] * arrive
        for i in range(ns):
            xp[i] += B[m, g, i] * (wanted - after)
        after = wanted
    return after


@both
def inside(T, m, g, x, scale, a):
    """Sign of guard ``g`` just after ``x``: -1 inside, +1 outside or leaving, 0 zero; order of its zero at ``x``.

    Order ORDER: zero for as long as the mode lasts; above it the series does not tell the order, see `affine.hidden`.
    ``scale`` (nx,) see `sizes`, ``a`` (ORDER+1,) is room.
    """
    G, GT = T.G, T.GT
    nx = x.size
    total = 0.0
    size = 0.0
    for c in range(nx):
        total += G[m, g, c] * x[c]
        size += abs(G[m, g, c]) * scale[c]
    if total < -NOISE * size:
        return -1, 0
    if total > NOISE * size:
        return 1, 0
    guard_series(T, m, g, x, a)
    for j in range(1, ORDER + 1):
        size = 0.0
        for c in range(nx):
            size += abs(GT[m, g, c, j]) * scale[c]
        if abs(a[j]) > NOISE * size:
            return (-1 if a[j] < 0.0 else 1), (j if j < ORDER else HIDDEN)
    return followed(T, m, g, x, scale)


@both
def blur(T, m, x, scale):
    """Raise ``scale`` (nx,), see `sizes`, to what a flight in mode ``m`` adds up that led to ``x`` (nx,)."""
    blurred(T, m, x, scale)


@both
def sizes(T, x, scale):
    """Write what the rounding of the entries of ``x`` (nx,) is measured by into ``scale`` (nx,).

    The largest of the terms that a step of any mode adds up to them: a speed that has come to zero, or is held there by
    forces that cancel, is as uncertain as those that took part; forcing has the rounding of its amplitude.
    """
    F = T.F
    ns, nx = F.shape[0], F.shape[1]
    for c in range(ns, nx):
        scale[c] = 1.0
    for c in range(ns):
        total = max(abs(x[c]), SMALLEST)
        for k in range(nx):
            total = max(total, F[c, k] * (abs(x[k]) if k < ns else 1.0))
        scale[c] = total


@both
def loose(T, m, k, x, scale):
    """Whether row ``k`` that mode ``m`` holds is not at rest on its surface at ``x``, beyond rounding of ``scale`` (nx,)."""
    H, S = T.H, T.S
    speed, speeds, place, places = 0.0, 0.0, 0.0, 0.0
    for c in range(H.shape[2]):
        speed += H[m, k, c] * x[c]
        speeds += abs(H[m, k, c]) * scale[c]
        place += S[m, k, c] * x[c]
        places += abs(S[m, k, c]) * scale[c]
    return abs(speed) > NOISE * speeds or abs(place) > NOISE * places


@leaf
def broken_hold(T, m, x, scale):
    """Number of the first row that mode ``m`` holds and that is `loose` at ``x``; -1: all are held.

    Behind the rows come the elements that hold rows on curves.
    """
    for k in range(T.n_holds[m]):
        if loose(T, m, k, x, scale):
            return k
    owner = curved_rest(T, m, x, scale)
    return -1 if owner < 0 else T.n_holds[m] + owner


@both
def admit(T, m, x, scale, signs, orders, a):
    """Return whether mode ``m`` may start at ``x`` (nx,): its holds hold and its guards are inside.

    ``scale`` see `sizes`; ``signs`` and ``orders`` (guards,) receive what `inside` says of every guard, ``a`` (ORDER+1,) is
    room.  Where a hold is broken signs and orders are not written.
    """
    if broken_hold(T, m, x, scale) >= 0:
        return False
    good = True
    for g in range(T.n_guards[m]):
        signs[g], orders[g] = inside(T, m, g, x, scale, a)
        good = good and signs[g] <= 0
    return good


@leaf
def foreign(T, m, c, k):
    """Number in mode ``m`` of guard ``k`` of mode ``c``, which differs in the keys of other elements only; -1: there is none."""
    element, owner, number = T.element, T.element[c, k], 0
    for j in range(k):
        if element[c, j] == owner:
            number += 1
    for j in range(T.n_guards[m]):
        if element[m, j] == owner:
            if number == 0:
                return j
            number -= 1
    return -1


@apart(FLAG)
def taken_along(T, m, g, c, k, kicked, order, x, scale, a):
    """Whether guard ``k`` of mode ``c``, of another element and outside, is so by the event of guard ``g`` of mode ``m`` at ``x``.

    Then its element joins in: an impact that turns a speed round turns the friction on it in the same instant.  A guard that
    was about to fire by itself is an event of its own, as are a kick (a stop that is met without speed joins) and, without a
    kick, a memory that is written.
    """
    if T.element[c, k] == T.element[m, g] or T.kick[c, k] == 1 and order < 2:
        return False
    if kicked and order == 0:
        return True
    R = T.R
    ns = R.shape[2]
    for i in range(2 * T.LP.shape[2], ns):
        for j in range(R.shape[3]):
            if not kicked and R[c, k, i, j] != (1.0 if i == j else 0.0):
                return False
    before = foreign(T, m, c, k)
    return before < 0 or inside(T, m, before, x, scale, a)[0] <= 0


@apart(WHOLE)
def join(T, m, g, c, kicked, x, xp, scale, signs, orders, a):
    """Mode after an event of guard ``g`` of mode ``m`` when the other elements that it takes along (`taken_along`) join in.

    ``x`` and ``xp`` (nx,) are the states on both sides, ``c`` is a mode that the element of the guard may take; ``signs``,
    ``orders`` (guards,) are of `admit` there, and of the mode returned then; there the guards of the event's own element are
    inside.  Returns -1 where no candidate of a joining element may start; where one comes first that is not built yet, -2 minus
    the place in `then` of the guard that leads to it.
    """
    own, then = T.element[m, g], T.then
    for _ in range(JOINS):
        beyond = -1
        for k in range(T.n_guards[c]):
            if beyond < 0 and signs[k] > 0 and taken_along(T, m, g, c, k, kicked, orders[k], x, scale, a):
                beyond = k
        if beyond < 0:
            return c
        owner, found = T.element[c, beyond], -1
        for i in range(then.shape[2]):
            d = then[c, beyond, i]
            if d == -2:
                return -2 - (c * then.shape[1] + beyond)
            if d < 0 or d == c or broken_hold(T, d, xp, scale) >= 0:
                continue
            good = True
            for k in range(T.n_guards[d]):
                signs[k], orders[k] = inside(T, d, k, xp, scale, a)
                good = good and (signs[k] <= 0 or T.element[d, k] != owner and T.element[d, k] != own)
            if good:
                found = d
                break
        if found < 0:
            return -1
        c = found
    return -1
