"""One degree of freedom under one harmonic: a forcing period with the tables' numbers in registers.

The same march as `bifurc.flow.scan.run`, for modes of at most one guard, with nothing recorded: for maps over many
starts.  What it does not decide by itself (instants with several events, modes not built) comes back as `ASIDE` with the
start untouched, and the caller takes `run`.

The tables are packed into one array and one of integers: a call with the tables themselves costs 400 ns (their 40
arrays are counted in and out), a period 300.
"""
import numpy as np

from bifurc._jit import njit
from bifurc.compose.tables import ORDER
from bifurc.elements import EventKind
from bifurc.flow.affine.polynomial import EPS, first_zero, horner
from bifurc.flow.chatter import CLOSE
from bifurc.flow.rule import NOISE
from bifurc.flow.scan import DONE, LIMIT

ASIDE = 100  # take the general march
CONTACT = EventKind.CONTACT.code
ROWS = ORDER + 1
# places in the numbers of a mode; blocks of 5 over (q, v, 1, cos, sin)
STEP, TURN1, TURN2, RATIO, KAPPA, E0, E1, G0, G1, BOUND, RQ, RV, HOLD, PLACE = 0, 1, 2, 3, 4, 5, 10, 15, 20, 25, 30, 35, 40, 45
PUSH, PUSH_RATE, SERIES, STATES = 50, 55, 60, 60 + 5 * ROWS  # PUSH_RATE is along the motion held after the sequence
NUMBERS = 60 + 10 * ROWS
GUARDED, HELD, KICK, SURFACE, ENDS, COUNT, HIT, THEN = range(8)  # places in the integers of a mode; candidates from THEN


@njit
def fits(T):
    """Whether `period` can march the scene."""
    if T.A.shape[1] != 2 or T.A.shape[2] != 5 or not T.flat[0] > 0.0 or T.harmonics[0] != 1:
        return False
    for m in range(T.n_guards.size):
        if T.n_guards[m] > 1 or T.n_holds[m] > 1:
            return False
    return True


@njit
def pack(T):
    """Return the numbers (modes, NUMBERS) and integers (modes, THEN + candidates) that `period` reads, and the period."""
    A, B, D, E, G, G4, GT, H, R, S, YT, ends_in, kick, then, turn = (
        T.A, T.B, T.D, T.E, T.G, T.G4, T.GT, T.H, T.R, T.S, T.YT, T.ends_in, T.kick, T.then, T.turn)
    modes = T.n_guards.size
    omega = T.flat[0]
    P = np.zeros((modes, NUMBERS))
    I = np.zeros((modes, THEN + then.shape[2]), np.int64)
    for m in range(modes):
        P[m, STEP] = T.step[m]
        P[m, TURN1], P[m, TURN2] = turn[m, 1], turn[m, 2]
        I[m, GUARDED], I[m, HELD] = T.n_guards[m], T.n_holds[m]
        for c in range(5):
            P[m, E0 + c], P[m, E1 + c] = E[m, 0, c], E[m, 1, c]
            for j in range(ROWS):
                P[m, STATES + c * ROWS + j] = YT[m, 0, c, j]
        if I[m, HELD] > 0:
            for c in range(5):
                P[m, HOLD + c], P[m, PLACE + c] = H[m, 0, c], S[m, 0, c]
        P[m, G0 + 2] = -1.0  # no guard: one that never fires
        if I[m, GUARDED] == 0:
            continue
        P[m, RATIO] = T.ratio[m, 0]
        I[m, KICK], I[m, ENDS] = kick[m, 0], ends_in[m, 0]
        I[m, HIT] = 1 if kick[m, 0] == 1 or T.kind[m, 0] == CONTACT else 0
        I[m, SURFACE] = 1 if D[m, 0, 0] != 0.0 else 0
        I[m, COUNT] = then.shape[2]
        for i in range(then.shape[2]):
            I[m, THEN + i] = then[m, 0, i]
        rest = ends_in[m, 0]
        for c in range(5):
            P[m, G0 + c], P[m, G1 + c], P[m, BOUND + c] = G[m, 0, c], GT[m, 0, c, 1], G4[m, 0, c]
            P[m, RQ + c], P[m, RV + c] = R[m, 0, 0, c], R[m, 0, 1, c]
            P[m, PUSH + c] = 2.0 * GT[m, 0, c, 2]
            for j in range(ROWS):
                P[m, SERIES + c * ROWS + j] = GT[m, 0, c, j]
        for i in range(2):
            P[m, KAPPA] -= P[m, PUSH + i] * B[m, 0, i]
            if rest >= 0:
                for c in range(5):
                    P[m, PUSH_RATE + c] += P[m, PUSH + i] * A[rest, i, c]
        P[m, PUSH_RATE + 3] += omega * P[m, PUSH + 4]
        P[m, PUSH_RATE + 4] -= omega * P[m, PUSH + 3]
    return P, I, 2.0 * np.pi / omega


@njit
def scratch():
    """Return the scratch array of `period`."""
    return np.empty(ROWS + 3 + 64)


@njit
def row(p, place, q, v, w1, w2):
    """Value of a row of five numbers at a state."""
    return p[place] * q + p[place + 1] * v + p[place + 2] + p[place + 3] * w1 + p[place + 4] * w2


@njit
def size(p, place, q, v):
    """Sum of the sizes of the terms of a row; forcing counts with its amplitude."""
    return (abs(p[place] * q) + abs(p[place + 1] * v) + abs(p[place + 2]) + abs(p[place + 3])
            + abs(p[place + 4]))


@njit
def expand(p, place, q, v, w1, w2, a):
    """Write the Taylor coefficients of the series at ``place``."""
    for j in range(ROWS):
        a[j] = ((p[place + j] * q + p[place + ROWS + j] * v)
                + (p[place + 2 * ROWS + j] + p[place + 3 * ROWS + j] * w1) + p[place + 4 * ROWS + j] * w2)


@njit
def starts(p, holds, q, v, w1, w2, a):
    """Whether mode ``m`` may start here, and the order of the zero of its guard."""
    if holds > 0:
        if abs(row(p, HOLD, q, v, w1, w2)) > NOISE * size(p, HOLD, q, v):
            return False, 0
        if abs(row(p, PLACE, q, v, w1, w2)) > NOISE * size(p, PLACE, q, v):
            return False, 0
    value = row(p, G0, q, v, w1, w2)
    if abs(value) > NOISE * size(p, G0, q, v):
        return value < 0.0, 0
    expand(p, SERIES, q, v, w1, w2, a)
    for j in range(1, ROWS):
        k = SERIES + j
        total = (abs(p[k] * q) + abs(p[k + ROWS] * v) + abs(p[k + 2 * ROWS]) + abs(p[k + 3 * ROWS])
                 + abs(p[k + 4 * ROWS]))
        if abs(a[j]) > NOISE * total:
            return a[j] < 0.0, j
    return True, ORDER


@njit
def closing(p, q, w1, w2, v, u):
    """Whether the rest of a complete chattering closes at an impact that arrives with ``v``; ``u`` is the held velocity.

    The rule of `bifurc.flow.chatter.closing`.
    """
    push = row(p, PUSH, q, u, w1, w2)
    if push <= 0.0:
        return False
    r = p[RATIO]
    span = 2.0 * r * v
    unit = CLOSE * (1.0 - r) * push
    return span <= unit * p[STEP] and span * abs(p[KAPPA]) <= unit and (
        span * abs(row(p, PUSH_RATE, q, u, w1, w2)) <= unit * push)


@njit
def hold(p, q, v, w1, w2):
    """Held row: the coordinate on its surface, at rest against it (corrections of rounding size)."""
    if p[PLACE] != 0.0:
        q = -(p[PLACE + 2] + p[PLACE + 3] * w1 + p[PLACE + 4] * w2) / p[PLACE]
    return q, -(p[HOLD] * q + p[HOLD + 2] + p[HOLD + 3] * w1 + p[HOLD + 4] * w2) / p[HOLD + 1]


@njit
def period(P, I, length, m, y, work, counts, limit):
    """March ``y`` (2,) in place over the forcing period that starts at phase 0; return status and mode.

    ``counts`` receives the number of events in [0], of impacts and contacts in [1], added to what is there.  Status DONE, LIMIT, or
    ASIDE with ``y`` as it was.
    """
    omega = 2.0 * np.pi / length
    a = work[:ROWS]
    out = work[ROWS:ROWS + 3]
    stack = work[ROWS + 3:]
    q, v, w1, w2 = y[0], y[1], 1.0, 0.0
    left = length
    tiny = 4.0 * EPS * length
    order = 0
    known = np.nan
    events, hits, instants = 0, 0, 0
    fresh = True
    loaded = -1
    p = P[m]
    begun = m
    status = DONE
    h = third = 0.0
    e00 = e01 = e02 = e03 = e04 = e10 = e11 = e12 = e13 = e14 = 0.0
    g0 = g1 = g2 = g3 = g4 = s0 = s1 = s2 = s3 = s4 = r0 = r1 = r2 = r3 = r4 = turn1 = turn2 = 0.0
    value = slope = 0.0
    while left > tiny:
        if loaded != m:
            loaded = m
            p = P[m]
            h = p[STEP]
            third = h / 3.0
            turn1, turn2 = p[TURN1], p[TURN2]
            e00, e01, e02, e03, e04 = p[E0], p[E0 + 1], p[E0 + 2], p[E0 + 3], p[E0 + 4]
            e10, e11, e12, e13, e14 = p[E1], p[E1 + 1], p[E1 + 2], p[E1 + 3], p[E1 + 4]
            g0, g1, g2, g3, g4 = p[G0], p[G0 + 1], p[G0 + 2], p[G0 + 3], p[G0 + 4]
            s0, s1, s2, s3, s4 = p[G1], p[G1 + 1], p[G1 + 2], p[G1 + 3], p[G1 + 4]
            r0, r1, r2, r3, r4 = p[BOUND], p[BOUND + 1], p[BOUND + 2], p[BOUND + 3], p[BOUND + 4]
        if fresh:
            value = g0 * q + g1 * v + g2 + g3 * w1 + g4 * w2
            slope = (s0 * q + s1 * v + s2 + s3 * w1 + s4 * w2) * third
            if order == 1:
                value = 0.0
                if known == known:
                    slope = known * third
        nq = e00 * q + e01 * v + e02 + e03 * w1 + e04 * w2
        nv = e10 * q + e11 * v + e12 + e13 * w1 + e14 * w2
        n1 = turn1 * w1 - turn2 * w2
        n2 = turn2 * w1 + turn1 * w2
        e = r0 * abs(q) + r1 * abs(v) + r2 + r3 * abs(w1) + r4 * abs(w2)
        new = g0 * nq + g1 * nv + g2 + g3 * n1 + g4 * n2
        slope1 = (s0 * nq + s1 * nv + s2 + s3 * n1 + s4 * n2) * third
        b1 = value + slope
        b2 = new - slope1
        if fresh and order > 0:
            clear = order == 1 and b1 < 0.0 and b2 + 16.0 / 3.0 * e < 0.0 and new < 0.0
        else:
            clear = max(max(value, new), max(b1, b2)) + e < 0.0
        if clear and left >= h:
            q, v, w1, w2 = nq, nv, n1, n2
            value, slope = new, slope1
            left -= h
            fresh = False
            continue
        s = min(h, left)
        if not clear:
            if not fresh:
                order, known = 0, np.nan
            expand(p, SERIES, q, v, w1, w2, a)
            if known == known:
                a[1] = known
            first_zero(a, order, s, 4.0 * EPS * size(p, G0, q, v), out, stack)
        found = not clear and out[0] < np.inf
        if not found and left >= h:
            q, v, w1, w2 = nq, nv, n1, n2
            value, slope = new, slope1
            left -= h
            fresh = False
            continue
        kicked = found and I[m, KICK] == 1
        if not kicked:
            expand(p, STATES, q, v, w1, w2, a)
            q, v = horner(a, 0, out[0] if found else s)
        if not found:
            break
        hit, arrive = out[0], out[1]
        instants = instants + 1 if hit == 0.0 else 0
        left -= hit
        events += 1
        if events > limit:
            status = LIMIT
            break
        if instants > 3 or (kicked and not arrive > 0.0):
            return ASIDE, begun
        angle = omega * (length - left)
        w1, w2 = np.cos(angle), np.sin(angle)
        if I[m, HELD] > 0:
            q, v = hold(p, q, v, w1, w2)
        elif kicked or I[m, SURFACE] == 1:
            q = -(g2 + g3 * w1 + g4 * w2) / g0
        after = np.nan
        rested = 0.0
        i = THEN
        if kicked:
            r = p[RATIO]
            rested = -(s0 * q + s2 + s3 * w1 + s4 * w2) / s1
            v = rested + arrive / s1
            if I[m, ENDS] != -1 and 0.0 < r < 1.0 and closing(p, q, w1, w2, arrive, rested):
                i = ENDS  # tried first
            if r > 0.0:
                after = -r * arrive
                v = rested + after / s1
            else:
                q, v = row(p, RQ, q, v, w1, w2), row(p, RV, q, v, w1, w2)
                after = s0 * q + s1 * v + s2 + s3 * w1 + s4 * w2
        else:
            q, v = row(p, RQ, q, v, w1, w2), row(p, RV, q, v, w1, w2)
        target = -1
        while i < THEN + I[m, COUNT]:
            c = I[m, i]
            if c == -2:
                return ASIDE, begun
            if c == m and after < 0.0:
                target, order, known = c, 1, after
                break
            if c >= 0 and (i == ENDS or I[c, HELD] == 0 or not after < 0.0):
                good, first = starts(P[c], I[c, HELD], q, rested if i == ENDS else v, w1, w2, a)
                if good:
                    target, order, known = c, first, np.nan
                    if i == ENDS:
                        v = rested
                    break
            i = THEN if i == ENDS else i + 1
        if target < 0:
            return ASIDE, begun
        hits += I[m, HIT]
        m = target
        if I[m, HELD] > 0:
            q, v = hold(P[m], q, v, w1, w2)
        fresh = True
    y[0] = q
    y[1] = v
    counts[0] += events
    counts[1] += hits
    return status, m
