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
from .affine import carry, forcing, guard_series, reach
from .coast import coast
from .polynomial import EPS, first_zero

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
BOUND = 1e200  # of a state; beyond it the motion is lost
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
def held(H, S, holds, m, x, scale):
    """Whether the rows that mode ``m`` holds are at rest and on their surfaces at ``x``, to rounding of ``scale`` (nx,)."""
    for k in range(holds):
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
def project(H, S, holds, ns, m, x):
    """Put the held rows of mode ``m`` to rest and on their surfaces (corrections of rounding size)."""
    nx = x.size
    for k in range(holds):
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
def closing(T, m, g, x, v, out):
    """Duration of the rest of an infinite sequence whose impact at ``x`` (nx,), on the surface, arrives with speed ``v``.

    Returns 0 where it does not (yet) close.  ``out`` (nx,) receives the state with the speed taken away.
    """
    A, B, GT, harmonics = T.A, T.B, T.GT, T.harmonics
    r, h, rest, omega = T.ratio[m, g], T.step[m], T.ends_in[m, g], T.flat[0]
    ns, nx = A.shape[1], A.shape[2]
    loss, push, rate = 0.0, 0.0, 0.0
    for c in range(ns):
        out[c] = x[c] - B[m, g, c] * v
        loss -= 2.0 * GT[m, g, c, 2] * B[m, g, c]
    for c in range(ns, nx):
        out[c] = x[c]
    for c in range(nx):
        push += 2.0 * GT[m, g, c, 2] * out[c]
    unit = CLOSE * (1.0 - r) * push
    if push <= 0.0 or 2.0 * r * v > unit * h or 2.0 * r * v * abs(loss) > unit:
        return 0.0
    for i in range(ns):
        f = 0.0
        if rest >= 0:
            for c in range(nx):
                f += A[rest, i, c] * out[c]
        rate += 2.0 * GT[m, g, i, 2] * f
    for k in range(harmonics.size):
        c = ns + 1 + 2 * k
        rate += 2.0 * harmonics[k] * omega * (GT[m, g, c + 1, 2] * out[c] - GT[m, g, c, 2] * out[c + 1])
    if 2.0 * r * v * abs(rate) > unit * push:
        return 0.0
    span = r * v / (push * (1.0 - r))
    return 2.0 * span * (1.0 - (2.0 / 3.0) * span * (0.5 * loss + rate / push))


@njit
def run(T, ints, floats, x, whole_end, tau_end, limit, rows, record):
    """March ``x`` (nx,) in place to the time ``whole_end`` periods + ``tau_end``; return a status.

    ``ints`` and ``floats`` (see `workspace`) hold mode, time, orders and slopes of the guards, so that a march goes on
    where it stopped.  ``limit`` is the largest number of events a period (autonomous: in all).  ``rows`` (N, 5) and
    ``record`` (N, 3 + 2 ns) receive events and passed sections; N = 0 records nothing.
    """
    B, D, G, GT, H, R, S, step, n_guards, n_holds, then, kick, ends_in, ratio, element, omega = (
        T.B, T.D, T.G, T.GT, T.H, T.R, T.S, T.step, T.n_guards, T.n_holds, T.then, T.kick, T.ends_in, T.ratio, T.element,
        T.flat[0])
    ns, nx = R.shape[2], R.shape[3]
    period = 2.0 * np.pi / omega if omega > 0.0 else np.inf
    orders, slopes = ints[ORDERS:], floats[SLOPES:]
    new_orders, new_slopes = np.empty(orders.size, np.int64), np.empty(slopes.size)
    a, out, stack = np.empty(ORDER + 1), np.empty(3), np.empty(64)
    xm, xp, rested, scale = np.empty(nx), np.empty(nx), np.empty(nx), np.empty(nx)
    recording = rows.shape[0] > 0
    m, whole, tau = ints[MODE], ints[WHOLE], floats[TAU]
    status = DONE
    while True:
        if recording and ints[EVENTS] >= rows.shape[0]:
            status = FULL
            break
        left = tau_end - tau
        if whole != whole_end:
            left += (whole_end - whole) * period
        if left <= 0.0:
            break
        h = step[m]
        count = int(min(left / h, 1e9))
        if period < np.inf:
            count = min(count, int((period - tau) / h) + 1)
        passed = coast(T, m, x, count, orders, slopes) if count > 0 else 0
        g, chosen, what = -1, m, PASSED
        arrive = span = 0.0
        hit = passed * h
        if passed == 0:  # the guards as polynomials: the first zero, or a touch before it
            hit = min(reach(T, m, x), left)
            for i in range(n_guards[m]):
                if orders[i] == ORDER:  # zero for as long as the mode lasts
                    continue
                guard_series(T, m, i, x, a)
                if slopes[i] == slopes[i]:
                    a[1] = slopes[i]
                noise = 0.0
                for c in range(nx):
                    noise += abs(G[m, i, c] * x[c])
                first_zero(a, orders[i], hit, 4.0 * EPS * noise, out, stack)
                if out[2] < min(hit, out[0]):
                    g, hit, arrive, what = i, out[2], 0.0, GRAZE
                elif out[0] < hit or (out[0] == hit and g < 0):
                    g, hit, arrive, what = i, out[0], out[1], EVENT
            carry(T, m, x, hit, xm)
            for c in range(nx):
                x[c] = xm[c]
                if not abs(x[c]) < BOUND:
                    status = LOST
            if status == LOST:
                break
        ints[INSTANT] = ints[INSTANT] + 1 if g >= 0 and hit <= 4.0 * EPS * tau else 0
        if passed == 0 and hit == left:
            tau, whole = tau_end, whole_end
        else:
            tau += hit
        crossed = tau >= period
        if crossed:
            tau -= period
            whole += 1
            ints[COUNT] = 0
        if crossed or g >= 0:
            forcing(T, tau, x)
        for i in range(n_guards[m]):
            if orders[i] != ORDER:
                orders[i] = 0
            slopes[i] = np.nan
        if what == GRAZE:
            orders[g] = 2
        if what != EVENT:
            if not recording or (what == PASSED and not crossed):
                continue
            for c in range(nx):
                xp[c] = x[c]
        else:
            if n_holds[m] > 0:
                project(H, S, n_holds[m], ns, m, x)
            kicked = kick[m, g] == 1 and arrive > 0.0
            value = size = slope = 0.0
            for c in range(nx):
                value += G[m, g, c] * x[c]
                size += abs(G[m, g, c] * x[c])
                scale[c] = abs(x[c]) if c < ns else 1.0
            if hit > 0.0 or value <= PENETRATION * size:
                for c in range(ns):
                    x[c] -= D[m, g, c] * value
            if kicked:
                for c in range(nx):
                    slope += GT[m, g, c, 1] * x[c]
                for c in range(ns):
                    x[c] += B[m, g, c] * (arrive - slope)
            r = ratio[m, g]
            first = 0
            if kicked and ends_in[m, g] != -1 and 0.0 < r < 1.0:
                span = closing(T, m, g, x, arrive, rested)
                first = -1 if span > 0.0 else 0
            after = np.nan
            chosen = -1
            for i in range(first, then.shape[2]):  # an infinite sequence that closes comes first
                if i < 0:
                    c = ends_in[m, g]
                    for k in range(nx):
                        xp[k] = rested[k]
                elif i == 0:
                    span = 0.0
                    c = then[m, g, 0]
                    for k in range(nx):
                        xp[k] = x[k]
                    if kicked or kick[m, g] == 0:
                        for k in range(ns):
                            total = 0.0
                            for j in range(nx):
                                total += R[m, g, k, j] * x[j]
                            if not kicked and hit == 0.0 and value > PENETRATION * size:
                                total += D[m, g, k] * value  # passed at once by another's kick: nothing to put right
                            xp[k] = total
                    if kicked:
                        after = 0.0
                        for k in range(nx):
                            after += GT[m, g, k, 1] * xp[k]
                        if r > 0.0:  # the speeds of an infinite sequence keep their relative accuracy
                            for k in range(ns):
                                xp[k] -= B[m, g, k] * (r * arrive + after)
                            after = -r * arrive
                else:
                    c = then[m, g, i]
                if c == -2:
                    status = NEED
                    break
                good = c >= 0 and held(H, S, n_holds[c], c, xp, scale)
                if not good:
                    continue
                for k in range(n_guards[c]):
                    new_orders[k], new_slopes[k] = 1, np.nan
                    if c == m and k == g and after < 0.0:
                        new_slopes[k] = after
                    else:  # another element's guard may be leaving: it fires at once, with its own candidates
                        sign, new_orders[k] = inside(T, c, k, xp, a)
                        if sign > 0:
                            new_orders[k] = 0
                            good = good and element[c, k] != element[m, g]
                if good:
                    chosen = c
                    what = CHATTER if i < 0 else EVENT
                    break
            if status == DONE and (chosen < 0 or ints[INSTANT] > INSTANTS):
                status = SETTLE
            if status == DONE and ints[COUNT] >= limit:
                status = LIMIT
            if status != DONE:  # the state before the event stays: Python decides and goes on
                ints[AT_GUARD], floats[SINCE] = g, arrive
                break
            ints[COUNT] += 1
        if recording:
            e = ints[EVENTS]
            rows[e, BEFORE], rows[e, GUARD], rows[e, AFTER], rows[e, KIND], rows[e, PERIODS] = m, g, chosen, what, whole
            record[e, TIME], record[e, SPEED], record[e, SPAN] = tau, arrive, span
            for c in range(ns):
                record[e, STATE + c] = x[c]
                record[e, STATE + ns + c] = xp[c]
        ints[EVENTS] += 1
        if what == EVENT or what == CHATTER:
            m = chosen
            for c in range(nx):
                x[c] = xp[c]
            for i in range(n_guards[m]):
                orders[i] = new_orders[i]
                slopes[i] = new_slopes[i]
            if n_holds[m] > 0:
                project(H, S, n_holds[m], ns, m, x)
    ints[MODE], ints[WHOLE], floats[TAU] = m, whole, tau
    return status
