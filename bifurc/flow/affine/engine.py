"""Engine of affine modes: vector field, state after a time and its derivative, in closed form from the Taylor tables.

With ``x = (y, w)`` the flow over a time ``s`` is ``y(s) = E(s) x``; a long time is whole steps of the table (their
product by repeated squaring where the derivative is wanted) and one Taylor remainder.  Laws that are not affine have a
written module with functions of the same names and signatures.
"""
import numpy as np

from ..._jit import NOTHING, PAIR, apart, leaf, njit
from ...compose.tables import ORDER
from .polynomial import SMALLEST
from .products import multiply, product

KNOWS_BESIDE = False
FAR = 64  # steps of a mode after which samples of a long segment are gone on with from there, not from its start


@leaf
def leap(T, m):
    """Duration after which samples of a long segment are gone on with from there, as it takes the longer the longer it is."""
    return FAR * T.step[m]


@leaf
def forcing(T, t, x):
    """Write the forcing states w(t) behind the state in ``x`` (nx,)."""
    A, flat, harmonics = T.A, T.flat, T.harmonics
    ns = A.shape[1]
    x[ns] = 1.0
    for k in range(harmonics.size):
        angle = harmonics[k] * flat[0] * t
        x[ns + 1 + 2 * k] = np.cos(angle)
        x[ns + 2 + 2 * k] = np.sin(angle)


@leaf
def field(T, m, x, f):
    """Write y' = A x of mode ``m`` into ``f`` (ns,)."""
    A = T.A
    ns, nx = A.shape[1], A.shape[2]
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            total += A[m, i, c] * x[c]
        f[i] = total


@leaf
def remainder(T, m, x, s, y1):
    """State after ``0 <= s <= step`` by the Taylor rows."""
    A, YT = T.A, T.YT
    ns, nx = A.shape[1], A.shape[2]
    for i in range(ns):
        total = 0.0
        for c in range(nx):
            e = 0.0
            for j in range(ORDER, -1, -1):
                e = e * s + YT[m, i, c, j]
            total += e * x[c]
        y1[i] = total


@njit
def integrate(T, m, x, k):
    """Advance ``x = (y, w)`` by ``k`` whole steps in place."""
    A, E, harmonics, turn = T.A, T.E, T.harmonics, T.turn
    ns = A.shape[1]
    y1 = np.empty(ns)
    for _ in range(k):
        product(E, m, x, y1)
        for i in range(ns):
            x[i] = y1[i]
        for q in range(harmonics.size):
            c = ns + 1 + 2 * q
            cos, sin = turn[m, 1 + 2 * q], turn[m, 2 + 2 * q]
            a, b = x[c], x[c + 1]
            x[c] = cos * a - sin * b
            x[c + 1] = sin * a + cos * b


@apart(NOTHING, python=True)
def propagate(T, m, x, s, out):
    """Write the joined state (state and forcing) after ``0 <= s <= step`` into ``out`` (nx,)."""
    A, flat, harmonics, step = T.A, T.flat, T.harmonics, T.step
    ns, nx = A.shape[1], A.shape[2]
    for c in range(nx):
        out[c] = x[c]
    if s == step[m]:
        integrate(T, m, out, int(s / step[m]))
        return
    remainder(T, m, x, s, out)
    for q in range(harmonics.size):
        c = ns + 1 + 2 * q
        angle = harmonics[q] * flat[0] * s
        cos, sin = np.cos(angle), np.sin(angle)
        out[c] = cos * x[c] - sin * x[c + 1]
        out[c + 1] = sin * x[c] + cos * x[c + 1]


@apart(NOTHING, python=True)
def advance(T, m, x, s, y1):
    """Write the state at time ``s >= 0`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    step = T.step
    k = int(s / step[m])
    if k == 0:
        remainder(T, m, x, s, y1)
        return
    moved = x.copy()
    integrate(T, m, moved, k)
    remainder(T, m, moved, max(s - k * step[m], 0.0), y1)


@apart(NOTHING, python=True)
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start.

    The derivatives in the times follow from the vector field f: ``f(y1)`` in the end time, ``-Phi f(x)`` in the start.
    """
    A, E, YT, step = T.A, T.E, T.YT, T.step
    ns = A.shape[1]
    k = int(s / step[m])
    moved = x.copy()
    if k > 0:
        integrate(T, m, moved, k)
        s = max(s - k * step[m], 0.0)
    remainder(T, m, moved, s, y1)
    for i in range(ns):
        for c in range(ns):
            e = 0.0
            for j in range(ORDER, -1, -1):
                e = e * s + YT[m, i, c, j]
            Phi[i, c] = e
    if k == 0:
        return
    square = np.empty((ns, ns))  # Phi <- Phi E^k by the binary digits of k; all factors commute
    scratch = np.empty((ns, ns))
    for i in range(ns):
        for c in range(ns):
            square[i, c] = E[m, i, c]
    while k > 0:
        if k & 1:
            multiply(Phi, square, scratch)
        k >>= 1
        if k > 0:
            multiply(square, square, scratch)


@njit
def arc_beside(T, m, x, s, numbers, y1, Phi, change):
    """Like `arc`; an engine that knows it (`KNOWS_BESIDE`) also writes the ``change`` (ns,) that other numbers make: here tables of
    these cost as much."""
    arc(T, m, x, s, y1, Phi)


@leaf
def reach(T, m, x):
    """Duration from ``x`` on which the series of guards and states are good: a step of the tables."""
    return T.step[m]


@leaf
def guard_series(T, m, g, x, a):
    """Write the Taylor coefficients (ORDER+1,) of guard ``g`` along the flow from ``x``; good up to one step."""
    A, GT = T.A, T.GT
    for j in range(ORDER + 1):
        a[j] = 0.0
    for c in range(A.shape[2]):
        r = x[c]
        for j in range(ORDER + 1):
            a[j] += GT[m, g, c, j] * r


@leaf
def guard_value(T, m, g, x):
    """Value of guard ``g`` of mode ``m`` at ``x``."""
    G = T.G
    total = 0.0
    for c in range(G.shape[2]):
        total += G[m, g, c] * x[c]
    return total


@leaf
def guard_gradient(T, m, g, x, row):
    """Write the derivative of guard ``g`` in ``x`` into ``row`` (nx,)."""
    G = T.G
    for c in range(G.shape[2]):
        row[c] = G[m, g, c]


@apart(PAIR)
def guard_divided(T, m, g, x, s, order, row):
    """Return guard ``g`` at ``s`` after ``x`` over ``s**order``, and its derivative in ``s``; that in ``x`` is ``row``.

    The first ``order`` Taylor terms vanish at an orbit and are left out, so that the quotient is regular at ``s`` = 0.
    """
    GT = T.GT
    value, slope = 0.0, 0.0
    for c in range(GT.shape[2]):
        e, d = 0.0, 0.0
        for j in range(ORDER, order - 1, -1):
            d = d * s + e
            e = e * s + GT[m, g, c, j]
        row[c] = e
        value += e * x[c]
        slope += d * x[c]
    return value, slope


@leaf
def forcing_rate(T, x, dw):
    """Write the time derivative of the forcing states in ``x`` into ``dw`` (nw,)."""
    flat, harmonics = T.flat, T.harmonics
    ns = T.A.shape[1]
    dw[0] = 0.0
    for k in range(harmonics.size):
        rate = harmonics[k] * flat[0]
        dw[1 + 2 * k] = -rate * x[ns + 2 + 2 * k]
        dw[2 + 2 * k] = rate * x[ns + 1 + 2 * k]


@leaf
def state_series(T, m, i, x, a):
    """Write the Taylor coefficients (ORDER+1,) of state ``i`` along the flow from ``x``; good up to one step."""
    YT = T.YT
    for j in range(ORDER + 1):
        a[j] = 0.0
    for c in range(YT.shape[2]):
        r = x[c]
        for j in range(ORDER + 1):
            a[j] += YT[m, i, c, j] * r


@leaf
def all_series(T, m, x, orders, a):
    """Write the series (guards, ORDER+1) of the guards with a zero of known order below ORDER; return their reach."""
    for g in range(T.n_guards[m]):
        if orders[g] != ORDER:
            guard_series(T, m, g, x, a[g])
    return reach(T, m, x)


@leaf
def land(T, m, g, x, hit, out):
    """Write the joined state after ``0 <= hit <= step`` into ``out`` (nx,); return ``hit``: affine guards are zero there."""
    propagate(T, m, x, hit, out)
    return hit


@leaf
def terms_size(T, m, g, x):
    """Sum of the sizes of the terms of guard ``g`` at ``x`` (nx,)."""
    G = T.G
    total = SMALLEST
    for c in range(G.shape[2]):
        total += abs(G[m, g, c] * x[c])
    return total


@leaf
def arrival(T, m, g, x, known):
    """Return the rate with which guard ``g`` is reached at ``x``: of an affine guard it is known from its series."""
    return known


@leaf
def leaves(order, a):
    """Return the rate with which a guard leaves a zero of a known ``order``, from what `rule.inside` wrote into ``a``, where that
    is not what its series says: here it is."""
    return np.nan


@leaf
def curved_jump(T, m, g, closes, x, xp, P):
    """Add what a jump that depends on the state gives to ``xp`` (nx,) and its derivative to ``P`` (ns, nx): here nothing."""


@leaf
def curved_kick(T, m, g, x, xp):
    """As `curved_jump`, without the derivative."""


@leaf
def curved_rest(T, m, x, scale):
    """Number of the first element with a constraint on a curve that mode ``m`` cannot begin with at ``x``; -1: there is none."""
    return -1


@leaf
def curved_project(T, m, x):
    """Put what constraints on curves hold in mode ``m`` to rest and on its curve: here there is nothing."""


@leaf
def guard_rate(row, f, dw):
    """Rate of a guard with gradient ``row`` along the field ``f`` and the rates ``dw`` of the forcing."""
    total = 0.0
    for c in range(f.size):
        total += row[c] * f[c]
    for k in range(dw.size):
        total += row[f.size + k] * dw[k]
    return total


@leaf
def bend(T, m, g, x):
    """Second time derivative at ``x`` (nx,) of a guard of positions."""
    total = 0.0
    for c in range(x.size):
        total += 2.0 * T.GT[m, g, c, 2] * x[c]
    return total


@leaf
def curved_closure(T, m, g, x, v, out, found):
    """Write what `chatter.sequence` does for a guard on a curve, and return whether it is one: here there is none."""
    return False


@leaf
def curved_hold(T, m, x, P):
    """As `curved_project`, with the derivative: ``P`` (ns, nx) is that of ``x`` in an earlier state.  Here there is nothing."""
