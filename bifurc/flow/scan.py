"""Motion through events: the compiled march that finds every event with a bound and applies it.

Steps of the mode's length run freely from any time.  A step is passed when a bound proves that no guard reaches zero
(`coast`); otherwise the guards become polynomials and their first zero is isolated (`polynomial.first_zero`).  After an
event the candidates of the fired guard are tried in order by the rule of DESIGN ("settle"); what the quick rule cannot
decide goes back to `bifurc.flow.settle`.  An infinite sequence of impacts ends in the closed form of specs "chatter":
with the arriving speed v, the acceleration a toward the stop and its rate f' along the held motion,

    t_acc = t + 2 T (1 - (2/3) T (kappa / 2 + f'/a)),      T = r v / (a (1 - r)),

kappa the loss of a per unit of speed.
"""
import numpy as np

from .._jit import njit
from ..compose.tables import ORDER
from .affine import carry, forcing, guard_series
from .coast import coast
from .polynomial import EPS, first_zero, highest

DONE, NEED, SETTLE, LIMIT, FULL, LOST = range(6)  # what `run` returns
MODE, WHOLE, COUNT, EVENTS, AT_GUARD, INSTANT = range(6)  # places in `ints`; then one order a guard from ORDERS
ORDERS = 6
TAU, SINCE = range(2)  # places in `floats`; then one slope a guard from SLOPES
SLOPES = 2
BEFORE, GUARD, AFTER, KIND, PERIODS = range(5)  # columns of the integer record; GUARD -1: a section was passed
TIME, SPEED, SPAN, STATE = range(4)  # columns of the record; from STATE the state before, then the state after
PASSED, EVENT, CHATTER, GRAZE = range(4)  # what a recorded row is
NOISE = 64.0 * EPS  # of the sum of the terms: values below it are zero
CLOSE = 2e-5  # rates times the remaining duration of an infinite sequence below which it is closed
INSTANTS = 24  # events at one instant before the joint rule decides
PENETRATION = 1e-9  # of the sum of the terms: a guard violated by more is not put back on its surface


@njit
def workspace(T):
    """Return the integer and float state of a march, see the places above."""
    guards = T.G.shape[1]
    return np.zeros(ORDERS + guards, np.int64), np.full(SLOPES + guards, np.nan)


@njit
def inside(T, m, g, x, a):
    """Sign of guard ``g`` just after ``x``: -1 inside, +1 outside or leaving, 0 zero forever; order of its zero at ``x``."""
    A, G, GT = T.A, T.G, T.GT
    ns, nx = A.shape[1], A.shape[2]
    total = 0.0
    size = 0.0
    for c in range(nx):
        total += G[m, g, c] * x[c]
        size += abs(G[m, g, c]) * (abs(x[c]) if c < ns else 1.0)  # forcing has the rounding of its amplitude
    if total < -NOISE * size:
        return -1, 0
    if total > NOISE * size:
        return 1, 0
    guard_series(T, m, g, x, a)
    for j in range(1, ORDER + 1):
        size = 0.0
        for c in range(nx):
            size += abs(GT[m, g, c, j]) * (abs(x[c]) if c < ns else 1.0)
        if a[j] < -NOISE * size:
            return -1, j
        if a[j] > NOISE * size:
            return 1, j
    return 0, ORDER


@njit
def held(T, m, x, scale):
    """Whether the rows that mode ``m`` holds are at rest and on their surfaces at ``x``, to rounding of ``scale`` (nx,)."""
    H, S, n_holds = T.H, T.S, T.n_holds
    for k in range(n_holds[m]):
        speed, speeds, place, places = 0.0, 0.0, 0.0, 0.0
        for c in range(H.shape[2]):
            speed += H[m, k, c] * x[c]
            speeds += abs(H[m, k, c]) * scale[c]
            place += S[m, k, c] * x[c]
            places += abs(S[m, k, c]) * scale[c]
        if abs(speed) > NOISE * speeds or abs(place) > NOISE * places:
            return False
    return True


@njit
def project(T, m, x):
    """Put the held rows of mode ``m`` to rest and on their surfaces (corrections of rounding size)."""
    A, H, S, n_holds = T.A, T.H, T.S, T.n_holds
    ns, nx = A.shape[1], A.shape[2]
    for k in range(n_holds[m]):
        place, square = 0.0, 0.0
        for c in range(nx):
            place += S[m, k, c] * x[c]
            if c < ns:
                square += S[m, k, c] * S[m, k, c]
        if square > 0.0:
            for c in range(ns):
                x[c] -= S[m, k, c] * (place / square)
        speed, square = 0.0, 0.0
        for c in range(nx):
            speed += H[m, k, c] * x[c]
            if c < ns:
                square += H[m, k, c] * H[m, k, c]
        if square > 0.0:
            for c in range(ns):
                x[c] -= H[m, k, c] * (speed / square)


@njit
def enter(T, old, g, c, x, scale, slope, orders, slopes, a):
    """Try mode ``c`` after guard ``g`` of mode ``old`` fired: True if it may start at ``x``; its orders and slopes.

    ``slope`` is the known slope of the fired guard after a kick (NaN: unknown).  Guards of other elements may be at zero
    and leaving: they fire at once, each with its own candidates.
    """
    element, n_guards = T.element, T.n_guards
    if not held(T, c, x, scale):
        return False
    owner = element[old, g]
    for i in range(n_guards[c]):
        slopes[i] = np.nan
        if c == old and i == g and slope < 0.0:
            orders[i] = 1
            slopes[i] = slope
            continue
        sign, order = inside(T, c, i, x, a)
        if sign > 0:
            if element[c, i] == owner:
                return False
            order = 0
        orders[i] = order
    return True


@njit
def closing(T, m, g, x, v, out):
    """Duration of the rest of an infinite sequence whose impact at ``x`` (nx,), on the surface, arrives with speed ``v``.

    Returns 0 where it does not (yet) close.  ``out`` (nx,) receives the state with the speed taken away.
    """
    A, B, GT, ratio, step, ends_in, flat, harmonics = T.A, T.B, T.GT, T.ratio, T.step, T.ends_in, T.flat, T.harmonics
    ns, nx = A.shape[1], A.shape[2]
    r = ratio[m, g]
    push = 0.0
    for c in range(nx):
        push += GT[m, g, c, 2] * x[c]
    push *= 2.0
    if push <= 0.0 or 2.0 * r * v * 0.5 > CLOSE * (1.0 - r) * push * step[m]:
        return 0.0
    loss = 0.0
    for c in range(nx):
        out[c] = x[c]
    for c in range(ns):
        out[c] -= B[m, g, c] * v
        loss -= 2.0 * GT[m, g, c, 2] * B[m, g, c]
    push = 0.0
    for c in range(nx):
        push += 2.0 * GT[m, g, c, 2] * out[c]
    if push <= 0.0:
        return 0.0
    rest = ends_in[m, g]
    rate = 0.0
    if rest >= 0:
        for i in range(ns):
            if GT[m, g, i, 2] != 0.0:
                f = 0.0
                for c in range(nx):
                    f += A[rest, i, c] * out[c]
                rate += 2.0 * GT[m, g, i, 2] * f
    for k in range(harmonics.size):
        c = ns + 1 + 2 * k
        w = harmonics[k] * flat[0]
        rate += 2.0 * w * (GT[m, g, c + 1, 2] * out[c] - GT[m, g, c, 2] * out[c + 1])
    unit = r * v / (push * (1.0 - r))
    if 2.0 * unit * max(abs(loss), abs(rate) / push) > CLOSE:
        return 0.0
    return 2.0 * unit * (1.0 - (2.0 / 3.0) * unit * (0.5 * loss + rate / push))


@njit
def run(T, ints, floats, x, whole_end, tau_end, limit, rows, record):
    """March ``x`` (nx,) in place to the time ``whole_end`` periods + ``tau_end``; return a status.

    ``ints`` and ``floats`` (see `workspace`) hold mode, time, orders and slopes of the guards, so that a march goes on
    where it stopped.  ``limit`` is the largest number of events a period (autonomous: in all).  ``rows`` (N, 5) and
    ``record`` (N, 3 + 2 ns) receive events and passed sections; N = 0 records nothing.
    """
    A, B, D, G, GT, R, step = T.A, T.B, T.D, T.G, T.GT, T.R, T.step
    n_guards, then, kick, ends_in, ratio, kind, n_holds, flat = (
        T.n_guards, T.then, T.kick, T.ends_in, T.ratio, T.kind, T.n_holds, T.flat)
    ns, nx = A.shape[1], A.shape[2]
    guards = G.shape[1]
    period = 2.0 * np.pi / flat[0] if flat[0] > 0.0 else np.inf
    orders = ints[ORDERS:]
    slopes = floats[SLOPES:]
    a = np.empty(ORDER + 1)
    out = np.empty(3)
    stack = np.empty(64)
    xm = np.empty(nx)
    xp = np.empty(nx)
    xh = np.empty(nx)
    scale = np.empty(nx)
    new_orders = np.empty(guards, np.int64)
    new_slopes = np.empty(guards)
    recording = rows.shape[0] > 0
    m, whole, tau = ints[MODE], ints[WHOLE], floats[TAU]
    while True:
        if recording and ints[EVENTS] + 3 > rows.shape[0]:
            ints[MODE], ints[WHOLE], floats[TAU] = m, whole, tau
            return FULL
        left = tau_end - tau
        if whole != whole_end:
            left += (whole_end - whole) * period
        h = step[m]
        if left <= 0.0:
            break
        count = int(min(left / h, 1e9))
        if period < np.inf:
            count = min(count, int((period - tau) / h) + 1)
        if count > 0:
            k = coast(T, m, x, count, orders, slopes)
            if k > 0:
                for g in range(n_guards[m]):
                    orders[g] = 0
                    slopes[g] = np.nan
                tau += k * h
                ints[INSTANT] = 0
                if tau >= period:
                    tau -= period
                    whole += 1
                    ints[COUNT] = 0
                    forcing(T, tau, x)
                    if recording:
                        e = ints[EVENTS]
                        rows[e, BEFORE], rows[e, GUARD], rows[e, AFTER], rows[e, KIND], rows[e, PERIODS] = m, -1, m, PASSED, whole
                        record[e, TIME], record[e, SPEED], record[e, SPAN] = tau, 0.0, 0.0
                        for c in range(ns):
                            record[e, STATE + c] = x[c]
                            record[e, STATE + ns + c] = x[c]
                        ints[EVENTS] = e + 1
                continue
        s = min(h, left)
        fired = -1
        hit = np.inf
        arrive = 0.0
        touched = -1
        touch = np.inf
        for g in range(n_guards[m]):
            guard_series(T, m, g, x, a)
            if slopes[g] == slopes[g]:
                a[1] = slopes[g]
            noise = 0.0
            for c in range(nx):
                noise += abs(G[m, g, c] * x[c])
            first_zero(a, orders[g], s, 4.0 * EPS * noise, out, stack)
            if out[0] < hit:
                fired, hit, arrive = g, out[0], out[1]
            if out[2] < touch:
                touched, touch = g, out[2]
        if touch < hit and recording:
            carry(T, m, x, touch, xm)
            e = ints[EVENTS]
            rows[e, BEFORE], rows[e, GUARD], rows[e, AFTER], rows[e, KIND], rows[e, PERIODS] = m, touched, m, GRAZE, whole
            record[e, TIME], record[e, SPEED], record[e, SPAN] = tau + touch, 0.0, 0.0
            for c in range(ns):
                record[e, STATE + c] = xm[c]
                record[e, STATE + ns + c] = xm[c]
            ints[EVENTS] = e + 1
        if fired < 0:
            carry(T, m, x, s, xm)
            bad = False
            for c in range(nx):
                x[c] = xm[c]
                bad = bad or not abs(x[c]) < 1e300
            for g in range(n_guards[m]):
                orders[g] = 0
                slopes[g] = np.nan
            ints[INSTANT] = 0
            if s == left:
                tau, whole = tau_end, whole_end
            else:
                tau += s
            if bad:
                ints[MODE], ints[WHOLE], floats[TAU] = m, whole, tau
                return LOST
            continue
        # the event
        g = fired
        carry(T, m, x, hit, xm)
        tau += hit
        ints[INSTANT] = ints[INSTANT] + 1 if hit <= 4.0 * EPS * tau else 1
        if tau >= period:
            tau -= period
            whole += 1
            ints[COUNT] = 0
        forcing(T, tau, xm)
        if n_holds[m] > 0:
            project(T, m, xm)
        value, size = 0.0, 0.0
        for c in range(nx):
            value += G[m, g, c] * xm[c]
            size += abs(G[m, g, c] * xm[c])
        if hit > 0.0 or value <= PENETRATION * size:
            for c in range(ns):
                xm[c] -= D[m, g, c] * value
        kicked = kick[m, g] == 1 and arrive > 0.0
        after = np.nan
        if kicked:
            slope = 0.0
            for c in range(nx):
                slope += GT[m, g, c, 1] * xm[c]
            for c in range(ns):
                xm[c] += B[m, g, c] * (arrive - slope)
        for c in range(nx):
            scale[c] = abs(xm[c]) if c < ns else 1.0
            xp[c] = xm[c]
        ints[COUNT] += 1
        chosen = -1
        row_kind = EVENT
        span = 0.0
        if kicked:
            r = ratio[m, g]
            if ends_in[m, g] != -1 and 0.0 < r < 1.0:
                span = closing(T, m, g, xm, arrive, xh)
                if span > 0.0:
                    rest = ends_in[m, g]
                    if rest == -2:
                        chosen = -2
                    else:
                        project(T, rest, xh)
                        if enter(T, m, g, rest, xh, scale, np.nan, new_orders, new_slopes, a):
                            chosen = rest
                            row_kind = CHATTER
                            for c in range(nx):
                                xp[c] = xh[c]
                        else:
                            span = 0.0
            if chosen == -1:
                for i in range(ns):
                    total = 0.0
                    for c in range(nx):
                        total += R[m, g, i, c] * xm[c]
                    xp[i] = total
                after = -r * arrive
                slope = 0.0
                for c in range(nx):
                    slope += GT[m, g, c, 1] * xp[c]
                for c in range(ns):
                    xp[c] += B[m, g, c] * (after - slope)
        elif kick[m, g] == 0:
            for i in range(ns):
                total = 0.0
                for c in range(nx):
                    total += R[m, g, i, c] * xm[c]
                xp[i] = total
        if chosen == -1:
            for i in range(then.shape[2]):
                c = then[m, g, i]
                if c == -2:
                    chosen = -2
                    break
                if c >= 0 and enter(T, m, g, c, xp, scale, after, new_orders, new_slopes, a):
                    chosen = c
                    break
        if chosen < 0 or ints[INSTANT] > INSTANTS or ints[COUNT] > limit:
            for c in range(nx):  # the state at the event, before it: Python decides and goes on
                x[c] = xm[c]
            ints[MODE], ints[WHOLE], floats[TAU], ints[AT_GUARD], floats[SINCE] = m, whole, tau, g, arrive
            if ints[COUNT] > limit:
                return LIMIT
            ints[COUNT] -= 1
            return NEED if chosen == -2 else SETTLE
        if n_holds[chosen] > 0:
            project(T, chosen, xp)
        if recording:
            e = ints[EVENTS]
            rows[e, BEFORE], rows[e, GUARD], rows[e, AFTER], rows[e, KIND], rows[e, PERIODS] = m, g, chosen, row_kind, whole
            record[e, TIME], record[e, SPEED], record[e, SPAN] = tau, arrive, span
            for c in range(ns):
                record[e, STATE + c] = xm[c]
                record[e, STATE + ns + c] = xp[c]
        ints[EVENTS] += 1
        m = chosen
        for c in range(nx):
            x[c] = xp[c]
        for i in range(n_guards[m]):
            orders[i] = new_orders[i]
            slopes[i] = new_slopes[i]
    ints[MODE], ints[WHOLE], floats[TAU] = m, whole, tau
    return DONE
