"""Guards and states of modes under a law: polynomials on a step, certified passage, divided guards, peaks.

The accelerations at the start, the nodes and the end of a step make a polynomial of degree nine, positions one of degree
eleven.  Steps for polynomials are short (`TIGHT`), so that zeros found on them are as good as the state; steps that are
only proved free of events are long, with the defect as a bound on what the polynomial may miss.

One file, because it is the counterpart of `flow.affine` for modes under a law: the twins of all kernels take their guards,
jumps and peaks from it by name.
"""
import numpy as np

from ..._jit import njit
from ...compose.tables import ORDER
from ..affine.engine import forcing_rate
from ..affine.polynomial import EPS, SMALLEST, fourth, highest, horner
from ..chatter import CLOSE, DURATION, EXCESS, WAY
from .calls import (
    ACTING,
    COUNT,
    ERROR,
    FIRST,
    FORCES,
    KICK,
    KICK_SLOPE,
    KICKS,
    LEVELS,
    OWNER,
    REST,
    REST_MOVE,
    REST_SLOPE,
    RESTS,
    SLOPE,
    SOURCE,
    WATCH,
    WIDTH,
    WISH,
    WORST,
    ask,
    longest,
    rate,
    scratch_of,
    slopes,
    step,
    values,
)
from .engine import DEFECT, field, integrate, propagate
from .gauss import DOUBLE, MOMENTS, NODES, POWERS, SINGLE, WEIGHTS, C

ENGINE = ("reach", "guard_series", "guard_value", "guard_gradient", "guard_divided", "state_series", "free_steps",
          "bend", "curved_closure", "segment_peak", "land", "terms_size", "arrival", "leaves",
          "curved_jump", "curved_kick", "curved_rest", "curved_project", "curved_hold", "all_series")
TIGHT = 1e-10  # defect aimed at in the steps of polynomials, and 3 times that allowed
ZERO = 64.0 * EPS  # of the sum of its terms: a smaller value is zero
FITTED = 1e4  # rounding of a coefficient that comes from the polynomial, against one of the field
LAWFUL = 0.35  # of the Taylor tables' step: where guards are laws, their values are interpolated, not their accelerations
WIDE = 8.0  # durations: on a step so long the third derivative of an interpolated law has the rounding of its quotient
SMALL = 0.05  # of the Taylor tables' step: shorter ones make the series of a law no better
LANDINGS = 4  # Newton steps in time onto a guard that is a law
PARTS = 8  # of a step, where its own control points lie outside a circle


@njit
def fitted(T, m, x, limit, acc, force, x1, X, accs, scratch):
    """Take a step of at most ``limit`` from ``x`` (nx,) on which polynomials are good; return its length.

    ``scratch`` keeps the length that the next step may have.  See `step`.
    """
    return step(T, m, x, min(limit, min(longest_fit(T, m), scratch[WISH])), TIGHT, x1, acc, force, X, 1, accs, scratch)


@njit
def longest_fit(T, m):
    """Longest step on which polynomials can be good."""
    return min(longest(T.harmonics, T.flat[0]), T.step[m] if T.LU.shape[0] == T.stages[ACTING] else LAWFUL * T.step[m])


@njit
def integrated(gamma, h, times, a):
    """Add the polynomial through ``gamma`` (NODES + 2,) on [0, h], integrated ``times`` times, to ``a`` (ORDER + 1,)."""
    unit = 1.0
    for j in range(NODES + 2):
        total = 0.0
        for k in range(NODES + 2):
            total += POWERS[j, k] * gamma[k]
        total *= unit
        if times > 0:
            total /= j + 1
        if times > 1:
            total /= j + 2
        a[j + times] += total
        unit /= h


@njit
def series(T, m, g, x, n, h, acc, force, forced, a):
    """Write guard ``g`` along ``x`` (ns or more,) with accelerations ``acc`` as a polynomial ``a``; memory stays as it is.

    ``forced`` = 0 leaves forcing and the laws' own weights out: a variation of the state.
    """
    G, LG = T.G, T.LG
    rows = LG.shape[2]
    ns = G.shape[2] - 1 - 2 * T.harmonics.size
    gamma = np.empty(NODES + 2)
    for j in range(ORDER + 1):
        a[j] = 0.0
    for times in range(1, 3):
        some = False
        for j in range(NODES + 2):
            gamma[j] = 0.0
        for i in range(n):
            w = G[m, g, i] if times == 2 else G[m, g, n + i]
            if w != 0.0:
                some = True
                for j in range(NODES + 2):
                    gamma[j] += w * acc[i, j]
        if some:
            integrated(gamma, h, times, a)
    for c in range(ns):
        a[0] += G[m, g, c] * x[c]
    for i in range(n):
        a[1] += G[m, g, i] * x[n + i]
    if forced == 0:
        return
    for r in range(rows):
        if LG[m, g, r] != 0.0:
            for j in range(NODES + 2):
                gamma[j] = LG[m, g, r] * force[r, j]
            integrated(gamma, h, 0, a)
    a[0] += G[m, g, ns]
    for k in range(T.harmonics.size):
        omega = T.harmonics[k] * T.flat[0]
        c = ns + 1 + 2 * k
        even = G[m, g, c] * x[c] + G[m, g, c + 1] * x[c + 1]
        odd = G[m, g, c + 1] * x[c] - G[m, g, c] * x[c + 1]
        unit = 1.0
        for j in range(0, ORDER + 1, 2):
            a[j] += unit * even
            unit *= omega / (j + 1)
            if j < ORDER:
                a[j + 1] += unit * odd
            unit *= -omega / (j + 2)


@njit
def weighed(T, m, g):
    """Whether guard ``g`` depends on what laws give."""
    for r in range(T.LG.shape[2]):
        if T.LG[m, g, r] != 0.0:
            return True
    return False


@njit
def moved_series(T, m, g, x, X, h, acc, accs, a):
    """Add to ``a`` (count, ORDER + 1) what laws add to the series of guard ``g`` along the variations ``X`` (count, ns) of the
    motion from ``x``: its gradient at the start, the nodes and the end of the step, along the variations there.
    """
    n, nx, ns = T.LP.shape[2], T.A.shape[2], T.A.shape[1]
    now, row, move = x.copy(), np.empty(nx), np.empty(ns)
    gamma = np.empty((X.shape[0], NODES + 2))
    for j in range(NODES + 2):
        t = 0.0 if j == 0 else h if j == NODES + 1 else h * C[j - 1]
        for i in range(n):
            at(x, acc[i], i, n, h, j, now)
        for k in range(T.harmonics.size):
            angle = T.harmonics[k] * T.flat[0] * t
            c = ns + 1 + 2 * k
            now[c] = np.cos(angle) * x[c] - np.sin(angle) * x[c + 1]
            now[c + 1] = np.cos(angle) * x[c + 1] + np.sin(angle) * x[c]
        guard_and_gradient(T, m, g, now, row)
        for k in range(X.shape[0]):
            for c in range(ns):
                move[c] = X[k, c]
            for i in range(n):
                at(X[k], accs[k, i], i, n, h, j, move)
            total = 0.0
            for c in range(ns):
                total += (row[c] - T.G[m, g, c]) * move[c]
            gamma[k, j] = total
    for k in range(X.shape[0]):
        integrated(gamma[k], h, 0, a[k])


@njit
def at(x, acc, i, n, h, j, out):
    """Write position and velocity of coordinate ``i`` at point ``j`` of a step, from its accelerations there, into ``out``."""
    if j == 0:
        out[i], out[n + i] = x[i], x[n + i]
        return
    once, twice = 0.0, 0.0
    for k in range(NODES):
        once += (WEIGHTS[k] if j == NODES + 1 else SINGLE[j - 1, k]) * acc[k + 1]
        twice += (MOMENTS[k] if j == NODES + 1 else DOUBLE[j - 1, k]) * acc[k + 1]
    share = 1.0 if j == NODES + 1 else C[j - 1]
    out[i] = x[i] + h * (share * x[n + i] + h * twice)
    out[n + i] = x[n + i] + h * once


@njit
def reach(T, m, x):
    """Duration from ``x`` on which the series of guards and states are good."""
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    return fitted(T, m, x, np.inf, np.empty((n, NODES + 2)), np.empty((rows, NODES + 2)), np.empty(nx), np.empty((0, 2)),
                  np.empty((0, n, NODES + 2)), scratch_of(T, 0))


@njit
def guard_series(T, m, g, x, a):
    """Write the polynomial (ORDER+1,) of guard ``g`` along the flow from ``x``; good up to `reach`."""
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    acc, force = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2))
    h = fitted(T, m, x, np.inf, acc, force, np.empty(nx), np.empty((0, 2)), np.empty((0, n, NODES + 2)), scratch_of(T, 0))
    series(T, m, g, x, n, h, acc, force, 1, a)


@njit
def all_series(T, m, x, orders, a):
    """Write the polynomials (guards, ORDER+1) of the guards with a zero of known order below ORDER; return their reach."""
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    acc, force = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2))
    h = fitted(T, m, x, np.inf, acc, force, np.empty(nx), np.empty((0, 2)), np.empty((0, n, NODES + 2)), scratch_of(T, 0))
    for g in range(T.n_guards[m]):
        if orders[g] != ORDER:
            series(T, m, g, x, n, h, acc, force, 1, a[g])
    return h


@njit
def state_series(T, m, i, x, a):
    """Write the polynomial (ORDER+1,) of state ``i`` along the flow from ``x``; good up to `reach`."""
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    acc, force = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2))
    h = fitted(T, m, x, np.inf, acc, force, np.empty(nx), np.empty((0, 2)), np.empty((0, n, NODES + 2)), scratch_of(T, 0))
    for j in range(ORDER + 1):
        a[j] = 0.0
    if i < n:
        integrated(acc[i], h, 2, a)
        a[1] += x[n + i]
    elif i < 2 * n:
        integrated(acc[i - n], h, 1, a)
    a[0] += x[i]


@njit
def guard_value(T, m, g, x):
    """Value of guard ``g`` of mode ``m`` at ``x``."""
    row = np.empty(x.size)
    return guard_and_gradient(T, m, g, x, row)


@njit
def guard_gradient(T, m, g, x, row):
    """Write the derivative of guard ``g`` in ``x`` into ``row`` (nx,)."""
    guard_and_gradient(T, m, g, x, row)


@njit
def guard_and_gradient(T, m, g, x, row):
    """Return guard ``g`` at ``x``; its derivative goes into ``row`` (nx,)."""
    A, G, LU, LS, LG = T.A, T.G, T.LU, T.LS, T.LG
    rows = LU.shape[0]
    total = 0.0
    weight = 0.0
    for c in range(x.size):
        row[c] = G[m, g, c]
        total += G[m, g, c] * x[c]
    for r in range(rows):
        weight += abs(LG[m, g, r])
    if weight > 0.0:
        n, forces, firsts, counts = T.LP.shape[2], T.stages[FORCES], T.owners[FIRST], T.owners[COUNT]
        one, f = np.empty((4, rows, 1)), np.empty(A.shape[1])
        rate(T, m, x, f, one)
        values(T, WATCH, m, one)
        edge = slopes(T, SLOPE, m, one)
        for r in range(rows):
            if LG[m, g, r] == 0.0:
                continue
            total += LG[m, g, r] * one[2, r, 0]
            for b in range(counts[r]):
                other = firsts[r] + b
                for c in range(x.size):
                    row[c] += LG[m, g, r] * (edge[0, r, b, 0] * LU[other, c] + edge[1, r, b, 0] * LS[other, c])
                if r >= forces and edge[2, r, b, 0] != 0.0:  # by accelerations without reactions
                    for i in range(n):
                        by = LG[m, g, r] * edge[2, r, b, 0] * LU[other, i]
                        if by == 0.0:
                            continue
                        for c in range(x.size):
                            row[c] += by * A[m, n + i, c]
                        for q in range(forces):
                            for d in range(counts[q]):
                                at = firsts[q] + d
                                for c in range(x.size):
                                    row[c] += by * T.LP[m, q, i] * (edge[0, q, d, 0] * LU[at, c] + edge[1, q, d, 0] * LS[at, c])
    return total


@njit
def guard_divided(T, m, g, x, s, order, row):
    """Return guard ``g`` at ``s`` after ``x`` over ``s**order``, and its derivative in ``s``; that in ``x`` is ``row``.

    The first ``order`` terms of its series vanish at an orbit and are left out.  In the forcing states ``row`` is right
    along their own motion only, which is all that a start time can change.
    """
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    ns = T.A.shape[1]
    acc, force, x1 = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2)), np.empty(nx)
    X, accs = np.eye(ns), np.empty((ns, n, NODES + 2))
    f0, dw, a, unit = np.empty(ns), np.empty(nx - ns), np.empty(ORDER + 1), np.empty(ns)
    field(T, m, x, f0)
    forcing_rate(T, x, dw)
    start = X.copy()
    lawful = weighed(T, m, g)
    h = 0.0
    near = WIDE * abs(s) if lawful else abs(s)  # on steps no longer than that the quotient itself has fewer roundings
    if near <= longest_fit(T, m):
        limit = max(near, SMALL * T.step[m]) if lawful else np.inf
        h = fitted(T, m, x, limit, acc, force, x1, X, accs, scratch_of(T, ns))
    if near <= h:
        series(T, m, g, x, n, h, acc, force, 1, a)
        value, slope, later = 0.0, 0.0, 0.0
        for j in range(ORDER, order - 1, -1):
            slope = slope * s + value
            value = value * s + a[j]
            later = later * s + (a[j + 1] * (j + 1) if j < ORDER else 0.0)
        moved = np.zeros((ns, ORDER + 1))
        for c in range(ns):
            for i in range(ns):
                unit[i] = 1.0 if i == c else 0.0
            series(T, m, g, unit, n, h, accs[c], force, 0, moved[c])
        if lawful:
            moved_series(T, m, g, x, start, h, acc, accs, moved)
        for c in range(ns):
            e = 0.0
            for j in range(ORDER, order - 1, -1):
                e = e * s + moved[c, j]
            row[c] = e
    else:
        f, end = np.empty(ns), np.empty(nx)
        integrate(T, m, x, s, x1, start)
        field(T, m, x1, f)
        value = guard_and_gradient(T, m, g, x1, end) / s**order
        forcing_rate(T, x1, dw)
        later = 0.0
        for c in range(ns):
            later += end[c] * f[c]
            row[c] = 0.0
            for i in range(ns):
                row[c] += end[i] * start[c, i] / s**order
        for k in range(1, nx - ns):
            later += end[ns + k] * dw[k]
        later /= s**order
        slope = later - order * value / s
        forcing_rate(T, x, dw)
    size = 0.0
    for c in range(ns):  # a later start along the motion: the series moves on by what it does in time
        later -= row[c] * f0[c]
    for k in range(nx - ns):
        size += dw[k] * dw[k]
    for k in range(nx - ns):
        row[ns + k] = later * dw[k] / size if size > 0.0 else 0.0
    return value, slope


@njit
def flies(T, m):
    """Whether no law acts in mode ``m``, and guards are affine, or tell that a circle around the position is reached."""
    LG, LP, owners, stages = T.LG, T.LP, T.owners, T.stages
    for r in range(stages[ACTING]):
        for i in range(LP.shape[2]):
            if LP[m, r, i] != 0.0:
                return False
    for g in range(T.n_guards[m]):
        law = -1
        for r in range(LG.shape[2]):
            law += owners[FIRST, r] == r
            if LG[m, g, r] != 0.0 and (r < stages[ACTING] or r >= stages[LEVELS] or not T.law[T.acts[m, law] + 1] > 0.0):
                return False
    return True


@njit
def glide(T, m, x, count, room):
    """Do what `free_steps` does in a mode that `flies`, by whole steps of the tables.

    A position on a step is compared with the cubic through its values and speeds at both ends, as affine guards are
    (`affine.event_free`), and the cubic lies within its four control points.
    """
    A, E, G, G4, GT, LG, LU, LS, harmonics, h, ng = (
        T.A, T.E, T.G, T.G4, T.GT, T.LG, T.LU, T.LS, T.harmonics, T.step[m], T.n_guards[m])
    n, ns, nx, rows = T.LP.shape[2], A.shape[1], A.shape[2], LU.shape[0]
    x1, wrong, off = room[2 * ng:], np.zeros((n, nx)), np.empty(n)
    for i in range(n):
        for c in range(nx):
            for j in range(ORDER, 3, -1):
                wrong[i, c] = wrong[i, c] * h + abs(T.YT[m, i, c, j]) * (j * (j - 1) * (j - 2) * (j - 3))
            wrong[i, c] *= h**4 / 384.0
    x1[ns] = 1.0
    for k in range(count):
        for i in range(ns):
            total = 0.0
            for c in range(nx):
                total += E[m, i, c] * x[c]
            x1[i] = total
        for q in range(harmonics.size):
            c = ns + 1 + 2 * q
            cos, sin = T.turn[m, 1 + 2 * q], T.turn[m, 2 + 2 * q]
            x1[c] = cos * x[c] - sin * x[c + 1]
            x1[c + 1] = sin * x[c] + cos * x[c + 1]
        for i in range(n):
            off[i] = 0.0
            for c in range(nx):
                off[i] += wrong[i, c] * abs(x[c])
        for g in range(ng):
            round_, law = -1, -1
            for r in range(T.stages[ACTING] if rows > 0 else 0, T.stages[LEVELS]):
                if LG[m, g, r] != 0.0:
                    round_ = r
            if round_ < 0:
                g0, g1, d0, d1, e = 0.0, 0.0, 0.0, 0.0, 0.0
                for c in range(nx):
                    g0 += G[m, g, c] * x[c]
                    g1 += G[m, g, c] * x1[c]
                    d0 += GT[m, g, c, 1] * x[c]
                    d1 += GT[m, g, c, 1] * x1[c]
                    e += G4[m, g, c] * abs(x[c])
                if not max(max(g0, g1), max(g0 + h / 3.0 * d0, g1 - h / 3.0 * d1)) + e < 0.0:
                    return k * h
                continue
            for r in range(round_ + 1):
                law += T.owners[FIRST, r] == r
            first = T.acts[m, law] - 1
            radius, e = T.law[first + 3], 0.0
            px, vx = -T.law[first], 0.0
            py, vy = -T.law[first + 1], 0.0
            qx, wx, qy, wy = px, 0.0, py, 0.0
            for c in range(nx):
                px += LU[round_, c] * x[c]
                py += LU[round_ + 1, c] * x[c]
                qx += LU[round_, c] * x1[c]
                qy += LU[round_ + 1, c] * x1[c]
                vx += h * LS[round_, c] * x[c]
                vy += h * LS[round_ + 1, c] * x[c]
                wx += h * LS[round_, c] * x1[c]
                wy += h * LS[round_ + 1, c] * x1[c]
            for i in range(n):
                e += (abs(LU[round_, i]) + abs(LU[round_ + 1, i])) * off[i]
            if not within(px, vx, qx, wx, py, vy, qy, wy, radius - e):
                return k * h
        for c in range(nx):
            x[c] = x1[c]
    return count * h


@njit
def within(px, vx, qx, wx, py, vy, qy, wy, radius):
    """Whether the plane cubic from p with the speed v to q with the speed w, in unit time, is proved to stay within a circle around
    the origin: by its control points, or those of its parts."""
    if max(max(px * px + py * py, qx * qx + qy * qy), max(
            (px + vx / 3.0)**2 + (py + vy / 3.0)**2, (qx - wx / 3.0)**2 + (qy - wy / 3.0)**2)) < radius * radius and radius > 0.0:
        return True
    if not max(px * px + py * py, qx * qx + qy * qy) < radius * radius or not radius > 0.0:
        return False
    third = 1.0 / (3.0 * PARTS)
    for k in range(PARTS + 1):
        s = k / PARTS
        x, dx = hermite(px, vx, qx, wx, s)
        y, dy = hermite(py, vy, qy, wy, s)
        far = max((x + third * dx)**2 + (y + third * dy)**2, (x - third * dx)**2 + (y - third * dy)**2)
        if not max(far, x * x + y * y) < radius * radius:
            return False
    return True


@njit
def hermite(p, v, q, w, s):
    """Value and slope at ``s`` of the cubic on [0, 1] from ``p`` with the slope ``v`` to ``q`` with the slope ``w``."""
    c2, c3 = 3.0 * (q - p) - 2.0 * v - w, 2.0 * (p - q) + v + w
    return p + s * (v + s * (c2 + s * c3)), v + s * (2.0 * c2 + 3.0 * s * c3)


@njit
def free_steps(T, m, x, count, orders, slopes_known, room):
    """Advance ``x`` (nx,) in place by up to ``count`` steps of the tables; return the time that was proved free of events.

    Inside such a step go as many long steps of the collocation as are needed; on each the guards' polynomials must stay
    below zero by more than the defect allows them to be wrong.
    """
    G, LG, unit, guards = T.G, T.LG, T.step[m], T.n_guards[m]
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], x.size
    for g in range(guards):
        if orders[g] > 0:
            return 0.0
    if flies(T, m):
        proved = glide(T, m, x, count, room)
        if proved > 0.0:
            return proved
        count = 1  # close to a circle: the next steps may be clear of it again
    acc, force, p = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2)), np.empty(ORDER + 1)
    x1, none, accs = np.empty(nx), np.empty((0, 2)), np.empty((0, n, NODES + 2))
    scratch = scratch_of(T, 0)
    top = min(longest(T.harmonics, T.flat[0]), unit)
    wish, proved = top, 0.0
    for k in range(count):
        left = unit
        steps = int(np.ceil(left / wish))
        while steps > 0:
            tried = left / steps
            h = step(T, m, x, tried, DEFECT, x1, acc, force, none, 0, accs, scratch)
            e = scratch[ERROR]
            if not e <= WORST * DEFECT:
                return proved
            most, largest = 0.0, 0.0
            for i in range(n):
                most = max(most, abs(x1[n + i] / h))
                for j in range(NODES + 2):
                    most = max(most, abs(acc[i, j]))
            for r in range(rows):
                for j in range(NODES + 2):
                    largest = max(largest, abs(force[r, j]))
            for g in range(guards):
                series(T, m, g, x, n, h, acc, force, 1, p)
                wrong = fourth(p, 0, h) * h**4 / 384.0
                for i in range(n):
                    wrong += e * most * h * (abs(G[m, g, i]) * h + abs(G[m, g, n + i]))
                for r in range(rows):
                    wrong += e * largest * abs(LG[m, g, r])
                g1, d1 = horner(p, 0, h)
                if not max(max(p[0], g1), max(p[0] + h / 3.0 * p[1], g1 - h / 3.0 * d1)) + wrong < 0.0:
                    return proved
            for c in range(nx):
                x[c] = x1[c]
            left -= h
            steps -= 1
            wish = min(scratch[WISH], top)
            if h != tried or steps > 0 and (wish < 0.8 * h or wish > 1.6 * h):
                steps = int(np.ceil(left / wish)) if left > 1e-14 * unit else 0
            proved = (k + 1) * unit if steps == 0 else k * unit + (unit - left)
    return proved


@njit
def gradient_sizes(T, m, g, x, f, scale, pull, size):
    """Return value and rate of guard ``g`` at ``x`` (nx,) under the field ``f`` (ns,); what their rounding is measured by, the
    gradient times the sizes of the states and times the largest of their rates, is added to ``size[0]`` and ``size[1]``.

    ``scale`` (nx,) are the sizes, ``pull`` (n,) those of the terms of the accelerations: what is held has forces that cancel.
    """
    n, ns, nx = T.LP.shape[2], f.size, x.size
    row, dw = np.empty(nx), np.empty(nx - ns)
    value = guard_and_gradient(T, m, g, x, row)
    forcing_rate(T, x, dw)
    total, place, speed = 0.0, 0.0, 0.0
    for c in range(nx):
        total += row[c] * (f[c] if c < ns else dw[c - ns])
        size[0] += abs(row[c]) * (abs(scale[c]) if c < ns else 1.0)
        if c >= ns:
            size[1] += abs(row[c] * dw[c - ns])
    for i in range(n):
        place += abs(row[i])
        speed = max(speed, abs(scale[n + i]))
    for i in range(n):
        size[1] += abs(row[n + i]) * pull[i]
    size[1] += place * speed
    return value, total


@njit
def force_sizes(T, m, scale, local):
    """Return what the rounding of the laws' forces (rows,), and of accelerations (n,), is measured by, with the states' ``scale``.

    A force is as uncertain as what it sees, times its slope: that of a stiff stator is small beside its stiffness times the place.
    ``local`` (4, rows, 1) are coordinates, speeds, forces and accelerations of the rows, see `calls.rate`.
    """
    n, nx, forces = T.LP.shape[2], T.A.shape[2], T.stages[FORCES]
    sizes, pull, edge = np.abs(local[2, :, 0]), np.zeros(n), slopes(T, SLOPE, m, local)
    for i in range(n):
        for c in range(nx):
            pull[i] += abs(T.A[m, n + i, c]) * scale[c]
    free = pull
    for r in range(T.stages[ACTING]):
        free = pull.copy() if r == forces else free
        for b in range(T.owners[COUNT, r]):
            other = T.owners[FIRST, r] + b
            for c in range(nx):
                sizes[r] += (abs(edge[0, r, b, 0] * T.LU[other, c]) + abs(edge[1, r, b, 0] * T.LS[other, c])) * scale[c]
            for i in range(n if r >= forces else 0):  # by accelerations without reactions
                sizes[r] += abs(edge[2, r, b, 0] * T.LU[other, i]) * free[i]
        for i in range(n):
            pull[i] += abs(T.LP[m, r, i]) * sizes[r]
    return sizes, pull


@njit
def guard_terms(T, m, g, x, scale, a, size):
    """Write the polynomial (ORDER+1,) of guard ``g`` along the flow from ``x`` and what its rounding is measured by.

    Derivatives up to the second for positions, the first for speeds, the value for reactions are exact to rounding of
    their terms, which are added up in ``size`` (ORDER+1,) with the sizes ``scale`` (nx,) of the states; from the next on they
    come from the polynomial.
    """
    A, G, GT, LG, LP = T.A, T.G, T.GT, T.LG, T.LP
    n, nx = LP.shape[2], A.shape[2]
    rows = LG.shape[2]
    one, acc, force = np.empty((4, rows, 1)), np.empty((n, NODES + 2)), np.empty((rows, NODES + 2))
    f = np.empty(A.shape[1])
    rate(T, m, x, f, one)
    values(T, WATCH, m, one)
    h = fitted(T, m, x, np.inf, acc, force, np.empty(nx), np.empty((0, 2)), np.empty((0, n, NODES + 2)), scratch_of(T, 0))
    series(T, m, g, x, n, h, acc, force, 1, a)
    exact = 2
    for i in range(n):
        if G[m, g, n + i] != 0.0:
            exact = 1
    for j in range(ORDER + 1):
        size[j] = 0.0
        for c in range(nx):
            size[j] += abs(GT[m, g, c, j]) * scale[c]
    sizes, pull = force_sizes(T, m, scale, one)
    for r in range(rows):
        if LG[m, g, r] != 0.0:
            exact = 0
        size[0] += abs(LG[m, g, r]) * sizes[r]
        for i in range(n if r < T.stages[ACTING] else 0):
            force_size = abs(LP[m, r, i]) * sizes[r]
            size[1] += abs(G[m, g, n + i]) * force_size
            size[2] += 0.5 * abs(G[m, g, i]) * force_size
    if exact == 0 or rows > T.stages[ACTING] and weighed(T, m, g):  # the gradient makes value and rate exact
        a[0], a[1] = gradient_sizes(T, m, g, x, f, scale, pull, size)
        exact = 1
    for j in range(exact + 1, ORDER + 1):
        size[j] = max(size[j], size[j - 1] / h)
    for j in range(exact + 1, ORDER + 1):
        size[j] *= FITTED


@njit
def land(T, m, g, x, hit, out):
    """Write the joined state after ``hit`` from ``x`` (nx,) into ``out``; return ``hit``, corrected where guard ``g`` is a law.

    A zero on the polynomial of a law is as good as its interpolation; Newton in time on the law itself takes it to rounding.
    """
    propagate(T, m, x, hit, out)
    if g < 0 or hit == 0.0 or not weighed(T, m, g):
        return hit
    f, size = np.empty(T.A.shape[1]), np.zeros(ORDER + 1)
    for _ in range(LANDINGS):
        field(T, m, out, f)
        value, speed = gradient_sizes(T, m, g, out, f, out, f[T.LP.shape[2]:], size)
        if not abs(speed) > 0.0 or abs(value) <= EPS * size[0]:
            break
        change = -value / speed
        if not abs(change) <= 1e-6 * T.step[m] or not hit + change > 0.0:
            break
        hit += change
        propagate(T, m, x, hit, out)
    return hit


@njit
def arrival(T, m, g, x, known):
    """Return the rate with which guard ``g`` is reached at ``x`` (nx,): exact for a law, whose series is interpolated."""
    if known == 0.0 or not weighed(T, m, g):
        return known
    f, size = np.empty(T.A.shape[1]), np.zeros(ORDER + 1)
    field(T, m, x, f)
    return max(gradient_sizes(T, m, g, x, f, x, f[T.LP.shape[2]:], size)[1], 0.0)


@njit
def leaves(order, a):
    """Return the rate with which a guard leaves a zero of a known ``order``, from what `inside` wrote into ``a``: exact, where the
    interpolated series may have the other sign; NaN: that rate is zero, or the order is none."""
    return a[1] if order == 1 else np.nan


@njit
def local_at(T, x):
    """Return room for the laws (4, rows, 1) with the coordinates and speeds that their rows see at ``x`` (nx,)."""
    rows = T.LU.shape[0]
    local = np.zeros((4, rows, 1))
    for r in range(rows):
        if T.owners[SOURCE, r] == r:
            for c in range(x.size):
                local[0, r, 0] += T.LU[r, c] * x[c]
                local[1, r, 0] += T.LS[r, c] * x[c]
    return local


@njit
def impulses(T, m, g, closes, x):
    """Return coordinates, speeds and impulses (4, rows, 1) of the rows that give an impulse at guard ``g`` of mode ``m``."""
    local = local_at(T, x)
    ask(T, KICK, m, T.element[m, g], int(closes), local, local)
    return local


@njit
def curved_jump(T, m, g, closes, x, xp, P):
    """Add what a jump that depends on the state ``x`` gives to ``xp`` (nx,) and its derivative to ``P`` (ns, nx).

    A guard that is a law is left on its surface, as affine guards are by their rows: what follows leaves out the terms that
    vanish there, and a distance from the surface would be free in all intervals at once.  Coordinates and velocities are moved;
    memory, which the event leaves as it is, only where nothing else moves the guard.
    """
    ns, on, count = P.shape[0], x, 2 * T.LP.shape[2]
    row, square, value = np.zeros(x.size), 0.0, 0.0
    if weighed(T, m, g):
        value = guard_and_gradient(T, m, g, x, row)
        for c in range(ns):
            if c == count and square == 0.0:
                count = ns
            square += row[c] * row[c] if c < count else 0.0
    if square > 0.0:
        on = x.copy()
        for c in range(count):
            on[c] -= row[c] * (value / square)
            for i in range(ns):
                xp[i] -= P[i, c] * (row[c] * (value / square))
    if T.stages[RESTS] != T.stages[KICKS] and T.kick[m, g] != 0:
        kick_and_slope(T, m, g, closes, on, xp, P)
    if square > 0.0:
        for i in range(ns):
            along = 0.0
            for c in range(count):
                along += P[i, c] * row[c]
            for c in range(x.size):
                P[i, c] -= row[c] * (along / square)


@njit
def kick_and_slope(T, m, g, closes, x, xp, P):
    """Add the impulses at ``x`` to ``xp`` (nx,) and their derivatives to ``P`` (ns, nx)."""
    n, firsts, counts = T.LP.shape[2], T.owners[FIRST], T.owners[COUNT]
    local, slope = impulses(T, m, g, closes, x), np.zeros((3, T.LU.shape[0], T.stages[WIDTH], 1))
    ask(T, KICK_SLOPE, m, T.element[m, g], int(closes), local, slope)
    for r in range(T.stages[KICKS], T.stages[RESTS]):
        for i in range(n):
            xp[n + i] += T.LP[m, r, i] * local[2, r, 0]
            for b in range(counts[r]):
                other = firsts[r] + b
                for c in range(x.size):
                    P[n + i, c] += T.LP[m, r, i] * (slope[0, r, b, 0] * T.LU[other, c] + slope[1, r, b, 0] * T.LS[other, c])


@njit
def curved_kick(T, m, g, x, xp):
    """As `curved_jump`, without the derivative."""
    if T.stages[RESTS] == T.stages[KICKS] or T.kick[m, g] == 0:
        return
    n, local = T.LP.shape[2], impulses(T, m, g, False, x)
    for r in range(T.stages[KICKS], T.stages[RESTS]):
        for i in range(n):
            xp[n + i] += T.LP[m, r, i] * local[2, r, 0]


@njit
def curved_rest(T, m, x, scale):
    """Number of the first element with a constraint on a curve that mode ``m`` cannot begin with at ``x``; -1: there is none.

    Speeds, the first row of a constraint, are zero below the rounding of what they are made of, see `rule.sizes` for ``scale``
    (nx,): after a plastic impact that friction stops nothing else is left.  To it belongs the speed of the curve itself.  It is
    no less than that of the rate of the curve's guard, see `gradient_sizes`: a mass neither arrives nor is at rest else.
    """
    if T.LU.shape[0] == T.stages[RESTS]:
        return -1
    local, firsts, counts, ns, fastest = local_at(T, x), T.owners[FIRST], T.owners[COUNT], T.A.shape[1], 0.0
    for i in range(T.LP.shape[2]):
        fastest = max(fastest, scale[T.LP.shape[2] + i])
    still = local.copy()
    still[1] = 0.0
    values(T, REST, m, local)
    values(T, REST, m, still)
    for r in range(T.stages[RESTS], T.LU.shape[0]):
        size = 1.0
        if r == firsts[r]:
            size = abs(still[2, r, 0])
            for b in range(counts[r]):
                for c in range(ns):
                    size += abs(T.LS[r + b, c]) * fastest
        if abs(local[2, r, 0]) > ZERO * size:
            return T.owners[OWNER, r]
    return -1


@njit
def curved_project(T, m, x):
    """Put what constraints on curves hold in mode ``m`` to rest and on its curve."""
    if T.LU.shape[0] == T.stages[RESTS]:
        return
    n, slope = T.LP.shape[2], slopes(T, REST_MOVE, m, local_at(T, x))
    for r in range(T.stages[RESTS], T.LU.shape[0]):
        for i in range(n):
            x[i] += T.LP[m, r, i] * slope[0, r, 0, 0]
            x[n + i] += T.LP[m, r, i] * slope[1, r, 0, 0]


@njit
def curved_hold(T, m, x, P):
    """As `curved_project`, with the derivative: ``P`` (ns, nx) is that of ``x`` (nx,) in an earlier state."""
    if T.LU.shape[0] == T.stages[RESTS]:
        return
    n, rows, ns, nx = T.LP.shape[2], T.LU.shape[0], P.shape[0], x.size
    first, firsts, counts = T.stages[RESTS], T.owners[FIRST], T.owners[COUNT]
    slope, du, ds = slopes(T, REST_SLOPE, m, local_at(T, x)), np.empty(rows), np.empty(rows)
    for c in range(nx):
        for r in range(first, rows):
            du[r], ds[r] = (T.LU[r, c], T.LS[r, c]) if c >= ns else (0.0, 0.0)
            for i in range(ns):
                du[r] += T.LU[r, i] * P[i, c]
                ds[r] += T.LS[r, i] * P[i, c]
        for r in range(first, rows):
            for b in range(counts[r]):
                other = firsts[r] + b
                place = slope[0, r, b, 0] * du[other]
                speed = slope[1, r, b, 0] * du[other] + slope[2, r, b, 0] * ds[other]
                for i in range(n):
                    P[i, c] += T.LP[m, r, i] * place
                    P[n + i, c] += T.LP[m, r, i] * speed
    curved_project(T, m, x)


@njit
def terms_size(T, m, g, x):
    """Sum of the sizes of the terms of guard ``g`` at ``x`` (nx,)."""
    row, total = np.empty(x.size), SMALLEST
    guard_and_gradient(T, m, g, x, row)
    for c in range(x.size):
        total += abs(row[c] * x[c])
    return total


@njit
def bend(T, m, g, x):
    """Second time derivative at ``x`` (nx,) of a guard of positions."""
    G = T.G
    ns, n = T.A.shape[1], T.LP.shape[2]
    f = np.empty(ns)
    field(T, m, x, f)
    total = 0.0
    for i in range(n):
        total += G[m, g, i] * f[n + i]
    for k in range(T.harmonics.size):
        c = ns + 1 + 2 * k
        total -= (T.harmonics[k] * T.flat[0]) ** 2 * (G[m, g, c] * x[c] + G[m, g, c + 1] * x[c + 1])
    return total


@njit
def curved_closure(T, m, g, x, v, out, found):
    """Write what `chatter.sequence` does into ``found`` (3,) for a guard that is a law, and return whether it is one: ``out`` (nx,)
    is what a plastic impact leaves, with the friction of that.

    The friction of the impacts that follow is that of sliding under the same load: together (1 + r) / (1 - r) v.
    """
    if not weighed(T, m, g):
        return False
    ns, r = T.A.shape[1], T.ratio[m, g]
    P, a, size = np.zeros((ns, x.size)), np.empty(ORDER + 1), np.empty(ORDER + 1)
    for i in range(ns):
        out[i] = x[i]
    for c in range(ns, x.size):
        out[c] = x[c]
    curved_jump(T, m, g, True, x, out, P)
    guard_terms(T, m, g, out, np.abs(out), a, size)
    push = 2.0 * a[2]
    found[EXCESS], found[DURATION], found[WAY] = np.inf, 0.0, 0.0
    if push > 0.0:
        span = r * v / (push * (1.0 - r))
        found[EXCESS] = 2.0 * span * max(1.0 / T.step[m], 6.0 * abs(a[3]) / push) / CLOSE
        found[DURATION] = 2.0 * span * (1.0 - (2.0 / 3.0) * span * 6.0 * a[3] / push)
    return True


@njit
def segment_peak(T, m, g, x, s, closing_guard, low):
    """Largest interior maximum (value, time) of guard ``g`` on a segment of duration ``s`` from ``x``, at the start of which it
    has a zero of order ``low``.

    The end value counts unless the guard is the one that ``closing_guard`` (1) says ends the segment.
    """
    n, rows, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[2]
    acc, force, a = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2)), np.empty(ORDER + 1)
    now, x1, out, stack = x.copy(), np.empty(nx), np.empty(3), np.empty(64)
    none, accs, scratch = np.empty((0, 2)), np.empty((0, n, NODES + 2)), scratch_of(T, 0)
    best, where, t, rising = -np.inf, 0.0, 0.0, False
    top_of, inside = np.empty(nx), 0.0  # the step that has the largest maximum: its first state, and how far in it lies
    while s - t > 1e-14 * s:  # what rounding leaves of the segment is no step, and has no maximum of its own
        h = fitted(T, m, now, s - t, acc, force, x1, none, accs, scratch)
        series(T, m, g, now, n, h, acc, force, 1, a)
        if t == 0.0:
            for j in range(low):
                a[j] = 0.0
        if rising and a[1] <= 0.0 and a[0] > best:
            best, where, inside = a[0], t, 0.0
        top = highest(a, h, best, out, stack)
        if top > best:
            best, where, inside = top, t + out[0], out[0]
            for c in range(nx):
                top_of[c] = now[c]
        rising = horner(a, 0, h)[1] > 0.0
        for c in range(nx):
            now[c] = x1[c]
        t += h
        if not h > 1e-14 * s:
            break
    reacts = False
    for r in range(rows):
        if T.LG[m, g, r] != 0.0:
            reacts = True
    if reacts and inside > 0.0:  # between its nodes the polynomial of a law is as good as the step asks, no better
        left = inside
        while left > 1e-14 * s:
            h = fitted(T, m, top_of, left, acc, force, x1, none, accs, scratch)
            for c in range(nx):
                top_of[c] = x1[c]
            left -= h
        best = guard_value(T, m, g, top_of)
    if closing_guard == 0:
        value = guard_value(T, m, g, now)
        if value > best:
            best, where = value, s
    return best, where
