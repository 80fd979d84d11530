"""Motion through events: the compiled integration that finds every event with a bound and applies it.

Steps of the mode's length run freely from any time.  A step is passed when a bound proves that no guard reaches zero
(`free_steps`); otherwise the guards become polynomials and their first zero is isolated (`polynomial.first_zero`).  After an
event the candidates of the fired guard are tried in order by `bifurc.flow.rule`; what they leave open goes back to
`bifurc.flow.settle`.  A complete chattering ends in closed form, `bifurc.flow.chatter`.
"""
import numpy as np

from .._jit import NOTHING, apart, leaf, njit
from .._jit import WHOLE as STATUS
from ..compose.tables import ORDER
from .affine.engine import all_series, arrival, curved_project, forcing, land, leaves, terms_size
from .affine.event_free import free_steps
from .affine.hidden import HIDDEN, blurred, hidden
from .affine.polynomial import EPS, SMALLEST, first_zero, horner
from .chatter import UNSEEN, closing, multiple
from .rule import broken_hold, inside, join, jumped, sizes, taken_along

DONE, NEED, SETTLE, LIMIT, FULL, LOST = range(6)  # what `run` returns
MODE, WHOLE, COUNT, EVENTS, AT_GUARD, INSTANT, LOW, LACKS = range(8)  # places in `ints`; then one order a guard from ORDERS
ORDERS = 8
TAU, SINCE, FLIGHT = range(3)  # places in `floats`; then one slope a guard from SLOPES
SLOPES = 3
BEFORE, GUARD, AFTER, KIND, PERIODS = range(5)  # columns of the integer record; GUARD -1: a section was passed
TIME, SPEED, SPAN, STATE = range(4)  # columns of the record; from STATE the state before, then the state after
PASSED, EVENT, CHATTER, GRAZE = range(4)  # what a recorded row is
INSTANTS = 24  # events at one instant, or kicks after flights that cannot be told from rest, before the joint rule decides
BOUND = 1e200  # of a state; beyond it the motion is lost
PENETRATION = 1e-9  # of the sum of the terms: a guard violated by more is not put back on its surface


@njit
def workspace(T):
    """Return the integer and float state of an integration, see the places above."""
    guards = T.G.shape[1]
    return np.zeros(ORDERS + guards, np.int64), np.full(SLOPES + guards, np.nan)


@leaf
def project(H, S, holds, ns, m, x):
    """Put the held rows of mode ``m`` to rest and on their surfaces (corrections of rounding size)."""
    put(S, holds, ns, m, x)
    put(H, holds, ns, m, x)


@njit
def share(x, c, largest):
    """What a correction of entry ``c`` of ``x`` (nx,) is weighed by, see `put`."""
    return max(abs(x[c]), EPS * EPS * largest)


@apart(NOTHING)
def put(rows, holds, ns, m, x):
    """Move the state in ``x`` (nx,) so that ``rows[m, :holds] @ x`` vanishes, each entry by its share of the rounding.

    The rounding of an entry is in proportion to its size: a small one beside large ones stays as it is, to its own digits.  One
    that is zero counts as what rounding leaves of the rounding of the largest.
    """
    largest = SMALLEST
    for c in range(ns):
        largest = max(largest, abs(x[c]))
    if holds == 1:
        value, square = 0.0, 0.0
        for c in range(x.size):
            value += rows[m, 0, c] * x[c]
            if c < ns:
                square += rows[m, 0, c] * rows[m, 0, c] * share(x, c, largest)
        if square > 0.0:
            for c in range(ns):
                x[c] -= rows[m, 0, c] * share(x, c, largest) * (value / square)
        return
    Q, size = rows[m, :holds].copy(), np.empty(ns)  # each row cleared of the ones before it, which it then leaves as they are
    for c in range(ns):
        size[c] = share(x, c, largest)
    for k in range(holds):
        whole = 0.0
        for c in range(ns):
            whole += Q[k, c] * size[c] * Q[k, c]
        for _ in range(2):
            for j in range(k):
                dot, square = 0.0, 0.0
                for c in range(ns):
                    dot += Q[k, c] * size[c] * Q[j, c]
                    square += Q[j, c] * size[c] * Q[j, c]
                if square > 0.0:
                    for c in range(x.size):
                        Q[k, c] -= Q[j, c] * (dot / square)
        value, square = 0.0, 0.0
        for c in range(x.size):
            value += Q[k, c] * x[c]
            if c < ns:
                square += Q[k, c] * size[c] * Q[k, c]
        if square > (x.size * EPS)**2 * whole:  # more than rounding of what the rows before it say already
            for c in range(ns):
                x[c] -= Q[k, c] * size[c] * (value / square)


@leaf
def struck(T, m, g, x, series, hit):
    """The guard with a kick that is reached with guard ``g`` of mode ``m`` after the time ``hit`` from ``x`` (nx,), and the ratio
    of their rates; -1 without one.

    In this mode the two differ by a multiple and a constant, and the constant is nothing: a slider that slipped up to the stop
    reaches its limit there again, and the impact turns it round in the same instant.  Which of the two zeros comes first is
    rounding; the impact does, and what it lets slip joins it.
    """
    for k in range(T.n_guards[m]):
        if T.kick[m, k] == 0 or T.element[m, k] == T.element[m, g]:
            continue
        factor = multiple(T.GT[m, k, :, 1], T.GT[m, g, :, 1])
        if factor <= 0.0:
            continue
        noise = 4.0 * EPS * (terms_size(T, m, k, x) + factor * terms_size(T, m, g, x))
        if abs(horner(series[k], 0, hit)[0]) <= noise:
            return k, factor
    return -1, 0.0


@apart(STATUS, python=True)
def run(T, ints, floats, x, whole_end, tau_end, limit, rows, record):
    """Integrate ``x`` (nx,) in place to the time ``whole_end`` periods + ``tau_end``; return a status.

    ``ints`` and ``floats`` (see `workspace`) hold mode, time, orders and slopes of the guards, so that an integration goes on
    where it stopped.  ``limit`` is the largest number of events a period (autonomous: in all).  ``rows`` (N, 5) and
    ``record`` (N, 3 + 2 ns) receive events and passed sections; N = 0 records nothing.
    """
    guards, nx = ints.size - ORDERS, x.size
    room = (np.empty(guards, np.int64), np.empty(guards), np.empty(guards, np.int64), np.empty((guards, ORDER + 1)),
            np.empty(ORDER + 1), np.empty(3), np.empty(64), np.empty(nx), np.empty(nx), np.empty(nx), np.empty(nx),
            np.empty(2 * guards + nx))
    return integrate(T, ints, floats, x, (whole_end, tau_end), limit, rows, record, room)


@leaf
def integrate(T, ints, floats, x, end, limit, rows, record, room):
    """Integrate as `run`, to the ``end``, in arrays of its own: references to arrays need not be counted."""
    B, D, G, GT, H, S, step, n_guards, n_holds, then, kick, ends_in, ratio, element, omega = (
        T.B, T.D, T.G, T.GT, T.H, T.S, T.step, T.n_guards, T.n_holds, T.then, T.kick, T.ends_in, T.ratio, T.element, T.flat[0])
    ns, nx = T.A.shape[1], T.A.shape[2]
    period = 2.0 * np.pi / omega if omega > 0.0 else np.inf
    orders, slopes = ints[ORDERS:], floats[SLOPES:]
    new_orders, new_slopes, signs, series, a, out, stack, xm, xp, rested, scale, bounds = room
    whole_end, tau_end = end
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
        hit = free_steps(T, m, x, count, orders, slopes, bounds) if count > 0 else 0.0
        passed = hit > 0.0
        g, chosen, what = -1, m, PASSED
        arrive = span = 0.0
        if not passed:  # the guards as polynomials: the first zero, or a touch before it
            hit = min(all_series(T, m, x, orders, series), left)
            for i in range(n_guards[m]):
                if orders[i] >= ORDER:  # zero for as long as the mode lasts, or as far as rounding can tell in this step
                    continue
                if slopes[i] == slopes[i]:
                    series[i, 1] = slopes[i]
                first_zero(series[i], orders[i], hit, 4.0 * EPS * terms_size(T, m, i, x), out, stack)
                if out[2] < min(hit, out[0]):
                    g, hit, arrive, what = i, out[2], 0.0, GRAZE
                elif out[0] < hit or (out[0] == hit and g < 0):
                    g, hit, arrive, what = i, out[0], out[1], EVENT
            if what == EVENT and kick[m, g] == 0:
                strikes, factor = struck(T, m, g, x, series, hit)
                if strikes >= 0:
                    g, arrive = strikes, factor * arrive
            hit = land(T, m, g if what == EVENT else -1, x, hit, xm)
            for c in range(nx):
                x[c] = xm[c]
                if not abs(x[c]) < BOUND:
                    status = LOST
            if status == LOST:
                break
        ints[INSTANT] = ints[INSTANT] + 1 if g >= 0 and hit <= 4.0 * EPS * tau else 0
        floats[FLIGHT] += hit
        if not passed and hit == left:
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
        hides = False
        for i in range(n_guards[m]):
            if orders[i] != ORDER:  # a zero is left when rounding hides it no longer
                orders[i] = HIDDEN if orders[i] > 1 and hidden(T, m, i, x) else 0
                hides = hides or orders[i] == HIDDEN
            slopes[i] = np.nan
        if what == GRAZE:
            orders[g] = 2
        if what != EVENT:
            curved_project(T, m, x)  # constraints on curves are kept by their accelerations: rounding would add up with time
            if not recording or (what == PASSED and not crossed):
                continue
            for c in range(nx):
                xp[c] = x[c]
        else:
            if n_holds[m] > 0:
                project(H, S, n_holds[m], ns, m, x)
            curved_project(T, m, x)
            arrive = arrival(T, m, g, x, arrive)
            kicked = kick[m, g] == 1 and arrive > 0.0
            value, size, slope = 0.0, SMALLEST, 0.0
            for c in range(nx):
                value += G[m, g, c] * x[c]
                size += abs(G[m, g, c] * x[c])
            if hit > 0.0 or value <= PENETRATION * size:
                for c in range(ns):
                    x[c] -= D[m, g, c] * value
            if kicked:
                for c in range(nx):
                    slope += GT[m, g, c, 1] * x[c]
                for c in range(ns):
                    x[c] += B[m, g, c] * (arrive - slope)
                # contacts that take turns end a complete chattering together: from one kick to the next none of them has risen
                unseen = arrive * floats[FLIGHT] <= 4.0 * UNSEEN * EPS * size
                ints[LOW] = ints[LOW] + 1 if unseen else 0
                floats[FLIGHT] = 0.0
            sizes(T, x, scale)
            if hides:
                blurred(T, m, x, scale)
            r = ratio[m, g]
            first = 0
            if kicked and ends_in[m, g] != -1 and 0.0 < r < 1.0:
                span = closing(T, m, g, x, arrive, rested)
                first = -1 if span > 0.0 else 0
            after = np.nan
            chosen, caught = -1, False
            for i in range(first, then.shape[2]):  # a complete chattering that closes comes first
                if i < 0:
                    c = ends_in[m, g]
                    jumped(T, m, g, x, arrive, xp)  # writes the memory of what slipped until then
                    for k in range(2 * T.LP.shape[2]):
                        xp[k] = rested[k]
                elif i == 0:
                    span = 0.0
                    c = then[m, g, 0]
                    if kicked or kick[m, g] == 0:
                        after = jumped(T, m, g, x, arrive, xp)
                        if not kicked and hit == 0.0 and value > PENETRATION * size:
                            for k in range(ns):
                                xp[k] += D[m, g, k] * value  # passed at once by another's kick: nothing to put right
                    else:
                        for k in range(nx):
                            xp[k] = x[k]
                else:
                    c = then[m, g, i]
                if c == -2:
                    status = NEED
                    ints[LACKS], ints[AT_GUARD] = m, g
                    break
                if c < 0 or broken_hold(T, c, xp, scale) >= 0:
                    continue
                good, joining, shut = True, False, False
                for k in range(n_guards[c]):
                    new_slopes[k] = np.nan
                    if c == m and k == g and after < 0.0:
                        signs[k], new_orders[k], new_slopes[k] = -1, 1, after
                        continue
                    signs[k], new_orders[k] = inside(T, c, k, xp, scale, a)
                    new_slopes[k] = leaves(new_orders[k], a)
                    if signs[k] > 0:  # of another element: it joins in, or fires at once with its own candidates
                        good = good and element[c, k] != element[m, g]
                        shut = shut or element[c, k] < 0 and kick[m, g] == 0
                        joining = joining or taken_along(T, m, g, c, k, kicked, new_orders[k], x, scale, a)
                if shut:  # several contacts have this guard jointly: they do not rest, and nothing else may be beyond a guard
                    caught = True
                    continue
                if not good and (kick[m, g] == 1 or not joining):  # without a kick what lets go may relieve what would hold
                    continue
                if joining:
                    c = join(T, m, g, c, kicked, x, xp, scale, signs, new_orders, a)
                    if c < -1:
                        status = NEED
                        ints[LACKS], ints[AT_GUARD] = (-2 - c) // then.shape[1], (-2 - c) % then.shape[1]
                        break
                    if c < 0:
                        continue
                    for k in range(n_guards[c]):
                        new_slopes[k] = np.nan
                beyond = False
                for k in range(n_guards[c]):
                    if signs[k] > 0:
                        new_orders[k] = 0
                        beyond = True
                if caught and beyond:
                    continue
                chosen = c
                what = CHATTER if i < 0 else EVENT
                break
            if status == DONE and (chosen < 0 or ints[INSTANT] > INSTANTS or kicked and ints[LOW] > INSTANTS):
                status = SETTLE
            if status == DONE and ints[COUNT] >= limit:
                status = LIMIT
            if status != DONE:  # the state before the event stays: Python decides and goes on
                if status != NEED:
                    ints[AT_GUARD] = g
                floats[SINCE] = arrive
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
            curved_project(T, m, x)
    ints[MODE], ints[WHOLE], floats[TAU] = m, whole, tau
    return status
