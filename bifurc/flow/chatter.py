"""Complete chattering: what is left of infinitely many impacts, in closed form.

With the arriving speed v, the acceleration a toward the stop and its rate f' along the held motion it lasts, to second order in v,

    t_acc = t + 2 T (1 - (2/3) T (kappa / 2 + f'/a)),      T = r v / (a (1 - r)),

kappa the loss of a per unit of speed.  That holds where nothing changes between two impacts.  Friction may: that of the same row
turns round in every impact and at the top of every flight; friction that holds another mass slips in every impact, since a mass
matrix passes the impulse on, and sticks again before the next.  Then a flight has two parts, the second of which begins where a
sliding speed has come to zero, and speeds fall by another ratio: `flight`, of which the formula is the case without a first part.

Friction of another row that the impulses move turns as long as it is slower than they make it.  Where forces drive it on, its speed
over that of impact, u/v, has an unstable fixed point, since v falls and u does not: an impact that leaves it its direction is
followed by others that do, and the formula holds from there on (`turning`).  Where u and v vanish together every flight has a
reversal.  Along a parameter numbers of reversals change in geometric sequences towards that motion, from both sides.  So those of
one friction are written out, flight by flight, to first order (`reversals`); those of several, and what sticks, are left to the
simulation until they are over.

One file, because when a chattering closes and what it leaves are read from the same flight.
"""
import numpy as np

from .._jit import NOTHING, PAIR, WHOLES, apart, leaf, njit
from .affine.engine import bend, curved_closure, field, forcing_rate, guard_rate, terms_size
from .affine.polynomial import EPS

CLOSE = 2e-5  # rates times the remaining duration of a complete chattering below which it is closed
UNSEEN = 4.0  # roundings of the position: flights that rise no higher cannot be told from rest
PARALLEL = 1e-12  # of the squares of two rows: what is left of one beside the other
MOVED = 1e-9  # of the sum of the terms: a speed that an impulse changes by less is not changed
TURNING = 0.5  # of a sliding speed: where all impacts take away no more of it, none turns it
FLIGHTS = 20000  # of which reversals are written out, at most
LATE = 0.1  # of the first part of a flight: by so much it may end too late, where the orbit of a branch is on its boundary
STEP = 1e-6  # of a speed: for differences of what reversals do
SMALL = 1e-4  # of a step of the mode: for differences, which only weigh the second order
EXCESS, DURATION, WAY, SPENT, TURNS = range(5)  # places of what `sequence` finds
LATER, FASTER = range(2)  # places of what `flight` finds


@leaf
def closing(T, m, g, x, v, out):
    """Duration of the rest of a complete chattering whose impact at ``x`` (nx,), on the surface, arrives with speed ``v``.

    Returns 0 where it does not (yet) close.  ``out`` (nx,) receives the state that all its impacts leave.
    """
    r, push = T.ratio[m, g], pushed(T, m, g, x, v, out)
    if 2.0 * r * v > CLOSE * (1.0 - r) * push * T.step[m] > 0.0 and undivided(T, m, g) and \
            (r * v)**2 > 2.0 * push * UNSEEN * EPS * terms_size(T, m, g, out):  # most impacts: far from closing
        return 0.0
    excess, duration = closure(T, m, g, x, v, out)
    return duration if excess <= 1.0 else 0.0


@apart(PAIR, python=True)
def closure(T, m, g, x, v, out):
    """As `closing`: rates times the remaining duration in units of what closes a sequence (at most 1), and that duration."""
    found = np.zeros(5)
    if not curved_closure(T, m, g, x, v, out, found):
        sequence(T, m, g, x, v, out, found)
        if found[SPENT] != 0.0:
            change = np.empty(T.A.shape[1])
            against(T, m, g, int(found[TURNS]), out, change)
            for c in range(change.size):
                out[c] += found[SPENT] * change[c]
        if found[WAY] > 0.0:
            change = np.empty(T.A.shape[1])
            slipped(T, m, g, out, change)
            for c in range(change.size):
                out[c] += found[WAY] * v * v * change[c]
    return found[EXCESS], found[DURATION]


@apart(NOTHING, python=True)
def stilled(T, m, g, x, xp, P):
    """Change the state ``xp`` (nx,) that a plastic impact leaves, and its derivative ``P`` (ns, nx), into what all impacts leave.

    They differ where the impacts let a held friction slip: it sticks again in the end, after some way.
    """
    row, v, found, out, change = moved_row(T, m, g), 0.0, np.zeros(5), np.empty(x.size), np.empty(T.A.shape[1])
    for c in range(x.size):
        v += T.GT[m, g, c, 1] * x[c]
    sequence(T, m, g, x, v, out, found)
    slipped(T, m, g, out, change)
    for c in range(change.size):
        more, way = T.B[m, g, c] - resting(T, m, g, row, c), found[WAY] * change[c]
        xp[c] += more * v + way * v * v
        for k in range(x.size):
            P[c, k] += (more + 2.0 * way * v) * T.GT[m, g, k, 1]


@njit
def slipped(T, m, g, out, change):
    """Write into ``change`` (ns,) how a way of one unit that a held friction slips (`sequence`) moves the state ``out`` (nx,) at
    rest: the coordinates by that way, the velocities by the forces of damping along it."""
    n, ns, rest, row = T.LP.shape[2], change.size, T.ends_in[m, g], moved_row(T, m, g)
    moved, f, still = np.empty(out.size), np.empty(ns), np.empty(ns)
    for c in range(ns):
        change[c] = resting(T, m, g, row, c) - T.B[m, g, c]
    shifted(out, change, SMALL, moved)
    field(T, rest, out, still)
    field(T, rest, moved, f)
    for c in range(n):
        change[c], change[n + c] = change[n + c], (f[n + c] - still[n + c]) / SMALL


@leaf
def pushed(T, m, g, x, v, out):
    """Write the state with the arriving speed ``v`` at ``x`` taken away into ``out`` (nx,); return the push to the stop."""
    row = moved_row(T, m, g)
    for c in range(x.size):
        out[c] = x[c]
    for c in range(T.B.shape[2]):
        out[c] -= resting(T, m, g, row, c) * v
    return bend(T, m, g, out)


@leaf
def resting(T, m, g, row, c):
    """Entry ``c`` of the direction in which all impacts together move the state, with the rate of the guard 1.

    One impact moves it along B.  Where that moves a held ``row`` (-1: none), this is at rest again in the end: D says how positions
    change with the guard where no held row moves; of the two impulses one is that of friction.
    """
    n = T.LP.shape[2]
    return T.D[m, g, c - n] if row >= 0 and n <= c < 2 * n else T.B[m, g, c]


@leaf
def moved_row(T, m, g):
    """Row that mode ``m`` holds and an impact at guard ``g`` moves; -1: none; -2: several."""
    row = -1
    for k in range(T.n_holds[m]):
        change, size = 0.0, 0.0
        for c in range(T.B.shape[2]):
            change += T.H[m, k, c] * T.B[m, g, c]
            size += abs(T.H[m, k, c] * T.B[m, g, c])
        if abs(change) > MOVED * size:
            row = k if row == -1 else -2
    return row


@apart(NOTHING)
def sequence(T, m, g, x, v, out, found):
    """Write excess and duration, see `closure`, into ``found`` (5,), the way that friction slips in all, per speed squared and
    unit of `resting` - B, and how much longer than at rest another friction, that of guard ``TURNS``, slips the other way.
    ``out`` (nx,) receives the state at rest, but for these.

    A flight whose impact arrives with v at a time t lasts T v + c t v + d v^2 and arrives with rho v + c' t v + d' v^2.  So the
    sum of all is T/(1 - rho) v to first order, and that of the terms of second order is a geometric sum as well.
    """
    r, h, rest = T.ratio[m, g], T.step[m], T.ends_in[m, g]
    other, slides = flight_mode(T, m, g)
    found[EXCESS], found[DURATION], found[WAY], found[SPENT], found[TURNS] = np.inf, 0.0, 0.0, 0.0, -1.0
    push = pushed(T, m, g, x, v, out)
    if other < 0 or push <= 0.0:
        return
    if r == 0.0 and T.n_holds[other] == T.n_holds[m]:  # the first impact is the last
        found[EXCESS] = 0.0
        return
    small, ns, row = SMALL * h, T.A.shape[1], moved_row(T, m, g)
    moved, along, across = np.empty((3, x.size)), np.zeros(ns), np.zeros(ns)
    later(T, m if rest < 0 else rest, out, small, moved[0])
    for c in range(ns):
        along[c] = resting(T, m, g, row, c)
    shifted(out, along, push * small, moved[1])
    first, second, way = np.zeros(9), np.zeros(3), 0.0  # of the parts of a flight: push, its rate, its slopes; then of sliding
    second[0] = push
    second[1] = (bend(T, m, g, moved[0]) - push) / small
    second[2] = (bend(T, m, g, moved[1]) - push) / (push * small)
    fastest = max(1.0 / h, abs(second[2]), abs(second[1]) / push)
    if other != m:
        hit, falls = stop_of(T, m, g, other), 0.0
        for c in range(ns):
            across[c] = along[c] - T.B[m, g, c]
            falls += T.G[other, slides, c] * T.B[m, g, c]
            way -= T.G[other, slides, c] * (along[c] - (1.0 + r) * T.B[m, g, c])
        shifted(out, across, push * small / falls, moved[2])
        first[0], first[4] = bend(T, other, hit, out), slope(T, other, slides, out)
        for k, unit in enumerate((small, push * small, push * small)):
            first[1 + k] = (bend(T, other, hit, moved[k]) - first[0]) / unit
            first[5 + k] = (slope(T, other, slides, moved[k]) - first[4]) / unit
        first[8] = way
        if not (way > 0.0 and first[4] > 0.0):
            return
        for k in range(3):
            fastest = max(fastest, abs(first[1 + k]) / (push if k == 0 else 1.0), abs(first[5 + k]) / (first[4] if k == 0 else 1.0))
    here, there = np.empty(2), np.empty(2)
    unit, rho = flight(r, first, second, 0.0, here)
    if not 0.0 < rho < 1.0:
        return
    flight(r, first, second, 1.0, there)
    total = unit / (1.0 - rho)
    by_time = (there[LATER] - here[LATER] + total * (there[FASTER] - here[FASTER])) / (1.0 - rho)
    squares = (here[LATER] + total * here[FASTER] + by_time * unit * rho) / (1.0 - rho**2)
    size = terms_size(T, m, g, out)
    found[EXCESS] = total * v * fastest / CLOSE
    found[DURATION] = total * v + squares * v * v
    share, turns = turning(T, m, g, x, v, out, total * v, other, slides)
    if share > TURNING:
        spent = np.zeros(2)
        if turns >= 0 and other == m and reversals(T, m, g, turns, x, v, out, -1, spent):
            found[SPENT], found[TURNS] = spent[0] * v, turns
            found[DURATION] = spent[1] * v
        else:
            found[EXCESS] = max(found[EXCESS], share / TURNING)
    if size > 0.0:
        found[EXCESS] = min(found[EXCESS], height(r, first, push) * v * v / (UNSEEN * EPS * size))
    if T.n_holds[other] < T.n_holds[m]:
        found[WAY] = (1.0 + r) * way / (2.0 * first[4] * (1.0 - rho**2))
    if strikes(T, m, g, x, (1.0 + r) * v, found[DURATION]):
        found[EXCESS] = np.inf


@leaf
def strikes(T, m, g, x, v, span):
    """Whether impacts at guard ``g`` of mode ``m``, which take the speed ``v`` from it at most, may drive another contact into its
    own stop within a ``span`` from ``x`` (nx,): one that touches takes part in every impact."""
    for k in range(T.n_guards[m]):
        if k == g or T.kick[m, k] == 0:
            continue
        value, change, size = 0.0, 0.0, 0.0
        for c in range(T.B.shape[2]):
            change -= T.GT[m, k, c, 1] * T.B[m, g, c]
            size += abs(T.GT[m, k, c, 1] * T.B[m, g, c])
        for c in range(x.size):
            value += T.G[m, k, c] * x[c]
        if change > MOVED * size and not -value > v * change * span:
            return True
    return False


@njit
def turning(T, m, g, x, v, out, span, other, slides):
    """Largest part of a guard of another element, in mode ``m``, that one impact or all of them take away from what it is at
    ``x`` (nx,); from 1 on the element has an event, and flights are not what they are in mode ``m``.  And its number, -1 where more
    than one lose more than `TURNING`.

    Of guards that impulses change: speeds of sliding, and forces of damping.  The part of `flight` in mode ``other``, which ends at
    guard ``slides``, is no such event.  All impacts, with the speed ``v`` of the first, leave ``out`` (nx,) and last for ``span``.
    Behind each of them a guard is what it is in the end plus a multiple of the speed, and speeds fall: so the first and the end
    bound all the others.
    """
    r, rest, most, turns, ns = T.ratio[m, g], T.ends_in[m, g], 0.0, -1, T.A.shape[1]
    for k in range(T.n_guards[m]):
        if k == g or T.kick[m, k] == 1 or multiple(T.G[m, k], T.GT[m, g, :, 1]) != 0.0:
            continue
        if other != m and T.element[m, k] == T.element[other, slides]:
            continue
        value, change, size, end = 0.0, 0.0, 0.0, 0.0
        for c in range(ns):
            change -= T.G[m, k, c] * T.B[m, g, c]
            size += abs(T.G[m, k, c] * T.B[m, g, c])
        if abs(change) <= MOVED * size:
            continue
        for c in range(x.size):
            value += T.G[m, k, c] * x[c]
            end += T.G[m, k, c] * out[c]
        f, dw = np.empty(ns), np.empty(x.size - ns)
        field(T, m if rest < 0 else rest, out, f)
        forcing_rate(T, out, dw)
        change = max((1.0 + r) * v * change, end - value + span * guard_rate(T.G[m, k], f, dw))
        if change <= 0.0:
            continue
        share = change / -value if -value > MOVED * change else 1.0 / MOVED
        if share > TURNING:
            turns = k if most <= TURNING else -1
        most = max(most, share)
    return most, turns


@njit
def against(T, m, g, k, x, change):
    """Write how the rate of the state ``x`` (nx,) at rest on the stop of guard ``g`` changes where the friction of guard ``k`` of
    mode ``m`` acts the other way into ``change`` (ns,); return the mode of that, -1 without one."""
    c, n, slope = reversed_mode(T, m, k, g, m), T.LP.shape[2], 0.0
    if c < 0:
        return -1
    here, there = np.empty(change.size), np.empty(change.size)
    field(T, m, x, here)
    field(T, c, x, there)
    for i in range(change.size):
        change[i] = there[i] - here[i] if n <= i < 2 * n else 0.0
        slope += T.GT[m, g, i, 1] * change[i]
    for i in range(n, 2 * n):
        change[i] -= T.B[m, g, i] * slope
    return c


@njit
def reversals(T, m, g, k, x, v, out, after, spent):
    """Write into ``spent`` (2,) what impacts from the speed 1 do that turn the friction of guard ``k`` of mode ``m``: how much
    longer it acts the other way than it does at rest on the stop, from the same state; and how long they last.  Return whether it
    is known: it is not where the friction sticks.

    To first order: in each flight accelerations are those at ``out`` (nx,), the state at rest.  ``x`` (nx,) is that before the
    first impact, which arrives with the speed ``v``; ``after`` the mode of rest, -1 where the speed at once tells it.
    """
    ns, r = T.A.shape[1], T.ratio[m, g]
    f, dw = np.empty(ns), np.empty(x.size - ns)
    c = reversed_mode(T, m, k, g, m)
    if c < 0:
        return False
    push, slopes, rests, kick, u = np.empty(2), np.empty(2), np.empty(2), 0.0, 0.0
    for i in range(x.size):
        u -= T.G[m, k, i] * x[i]
    for i in range(ns):
        kick += T.G[m, k, i] * T.B[m, g, i]
    forcing_rate(T, out, dw)
    for side in range(2):
        mode = c if side else m
        push[side] = bend(T, mode, g, out)
        field(T, mode, out, f)
        slopes[side] = -guard_rate(T.G[m, k], f, dw)
        rests[side] = slopes[side] + kick * push[side]
    hit = stop_of(T, m, g, c)
    stays = 0 if after == T.ends_in[m, g] else 1 if hit >= 0 and after == T.ends_in[c, hit] else -1
    return back_and_forth(r, kick, push, slopes, rests, u / v, stays if after >= 0 else -1, spent)


@leaf
def back_and_forth(r, kick, push, slopes, rests, u, stays, spent):
    """As `reversals`, for accelerations ``push`` (2,) toward the stop and ``slopes`` (2,) of the sliding speed, each in flight with
    the friction of either side, first that of a positive speed; ``rests`` (2,) are slopes at rest on the stop; ``u`` is the
    sliding speed before the first impact, and ``kick`` how it changes where a speed of impact 1 is taken away.

    At rest the friction turns once more, as long as the impacts last, where the speed that they leave is against that in the end;
    not where it is that of side ``stays`` from the first, as in equations that list no such turn (-1: it does turn).
    """
    v, total, other = 1.0, 0.0, 0.0
    for _ in range(FLIGHTS):
        side = 0 if u > 0.0 else 1
        if not push[side] > 0.0:
            return False
        left = 2.0 * r * v / ((1.0 - r) * push[side])
        u0, u = u, u + (1.0 + r) * kick * v
        if u * u0 > 0.0 and (u0 + (1.0 + r) / (1.0 - r) * kick * v + slopes[side] * left) * u0 > 0.0:  # it turns no more
            u = u0 + (1.0 + r) / (1.0 - r) * kick * v + slopes[side] * left
            total, other, v = total + left, other + side * left, 0.0
            break
        side = 0 if u > 0.0 else 1
        way, speed = 0.0, -r * v  # toward the stop
        turn = -u / slopes[side] if u * slopes[side] < 0.0 else np.inf
        if not push[side] > 0.0:
            return False
        if turn < 2.0 * r * v / push[side]:
            if not slopes[side] * slopes[1 - side] > 0.0:
                return False
            way, speed, u = (speed + 0.5 * push[side] * turn) * turn, speed + push[side] * turn, 0.0
            total, other, side = total + turn, other + side * turn, 1 - side
            if not push[side] > 0.0:
                return False
        last = (np.sqrt(speed * speed - 2.0 * push[side] * way) - speed) / push[side]
        u, total, other = u + slopes[side] * last, total + last, other + side * last
        speed += push[side] * last
        if not speed < v:
            return False
        v = speed
        if v < EPS * EPS:
            break
    if v > EPS:
        return False
    side, rest = 0 if u > 0.0 else 1, total  # from the end back to the state at rest that comes to it
    if side != stays and u * (u - rests[side] * total) < 0.0:
        if not rests[side] * rests[1 - side] > 0.0:
            return False
        rest = u / rests[side]
    spent[0], spent[1] = other - (side * rest + (1 - side) * (total - rest)), total
    return True


@apart(NOTHING, python=True)
def turned_back(T, m, g, after, x, xp, P):
    """Change the state ``xp`` (nx,) that a plastic impact leaves, and its derivative ``P`` (ns, nx), into what all impacts leave.

    They differ where the impacts turn the friction of another row, see `reversals`.  The time that it spends is v times a function
    of u/v.
    """
    v, u, found, out, change, spent = 0.0, 0.0, np.zeros(5), np.empty(x.size), np.empty(T.A.shape[1]), np.zeros(2)
    for c in range(x.size):
        v += T.GT[m, g, c, 1] * x[c]
    if not v > 0.0:
        return
    sequence(T, m, g, x, v, out, found)
    if found[TURNS] < 0.0 or not reversals(T, m, g, int(found[TURNS]), x, v, out, after, spent) or spent[0] == 0.0:
        return
    k, near, more, less = int(found[TURNS]), np.empty(x.size), np.zeros(2), np.zeros(2)
    against(T, m, g, k, out, change)
    size = 0.0
    for c in range(x.size):
        u -= T.G[m, k, c] * x[c]
        size += T.G[m, k, c]**2
    step = STEP * max(v, abs(u))
    for c in range(x.size):
        near[c] = x[c] + step * T.G[m, k, c] / size
    if not reversals(T, m, g, k, near, v, out, after, less):
        return
    for c in range(x.size):
        near[c] = x[c] - step * T.G[m, k, c] / size
    if not reversals(T, m, g, k, near, v, out, after, more):
        return
    by_u = (more[0] - less[0]) * v / (2.0 * step)
    by_v = spent[0] - u * by_u / v
    for c in range(change.size):
        xp[c] += spent[0] * v * change[c]
        for i in range(x.size):
            P[c, i] += change[c] * (by_v * T.GT[m, g, i, 1] - by_u * T.G[m, k, i])


@leaf
def flight(r, first, second, t, found):
    """Duration and arriving speed of a flight behind an impact that arrives with speed 1, to first order; 0, 0 where the first
    part ends behind it.

    Parameters
    ----------
    r : float
        Restitution.
    first : ndarray (9,)
        Of the first part: acceleration toward the stop, its rate, its slopes in speed toward the stop and in sliding speed; the
        loss of sliding speed per time, its rate and slopes; and the sliding speed behind the impact (0: no first part).
    second : ndarray (3,)
        Of the second: acceleration toward the stop, its rate, its slope in speed.
    t : float
        Time of the impact.
    found : ndarray (2,)
        Receives what terms of second order add to both, ``LATER`` and ``FASTER``.
    """
    a, rate, by_speed, by_slip, slip = first[0], first[1], first[2], first[3], first[8]
    loss, loss_rate, loss_by_speed, loss_by_slip = first[4], first[5], first[6], first[7]
    push, rise, by = second[0], second[1], second[2]
    s = slip / loss if slip > 0.0 else 0.0
    v, y, way = a * s - r, (0.5 * a * s - r) * s, (slip - 0.5 * loss * s) * s  # behind the first part; y < 0 off the stop
    if not v * v > 2.0 * push * y:
        return 0.0, 0.0
    dv = dy = ds = 0.0
    if slip > 0.0:
        y_sum, way_sum = (a * s / 6.0 - 0.5 * r) * s * s, (0.5 * slip - loss * s / 6.0) * s * s
        ds = -(loss_rate * s * (t + 0.5 * s) + loss_by_speed * y + loss_by_slip * way) / loss
        dv = rate * s * (t + 0.5 * s) + by_speed * y + by_slip * way + a * ds
        dy = rate * s * s * (0.5 * t + s / 6.0) + by_speed * y_sum + by_slip * way_sum + v * ds
    arrives = np.sqrt(v * v - 2.0 * push * y)
    q = (arrives - v) / push
    if q < -LATE * s:
        return 0.0, 0.0
    rest = (0.5 * v + push * q / 6.0) * q * q
    miss = dy + dv * q + rise * q * q * (0.5 * (t + s) + q / 6.0) + by * rest
    dq = -miss / arrives
    found[LATER] = ds + dq
    found[FASTER] = dv + push * dq + rise * q * (t + s + 0.5 * q) + by * (v + 0.5 * push * q) * q
    return s + q, arrives


@leaf
def height(r, first, push):
    """Largest distance from the stop in a `flight` behind an impact that arrives with speed 1, to first order; ``push`` is the
    acceleration toward the stop in the second part: towards the release of the stop it falls to nothing, and flights rise the
    higher."""
    a = first[0]
    s = first[8] / first[4] if first[8] > 0.0 else 0.0
    if a * s >= r:
        return 0.5 * r * r / a
    return (r - 0.5 * a * s) * s + 0.5 * (r - a * s)**2 / push


@njit
def slope(T, m, g, x):
    """First time derivative at ``x`` (nx,) of a guard of speeds."""
    ns = T.A.shape[1]
    f, dw = np.empty(ns), np.empty(x.size - ns)
    field(T, m, x, f)
    forcing_rate(T, x, dw)
    return guard_rate(T.G[m, g], f, dw)


@njit
def later(T, m, x, small, out):
    """Write the state after a ``small`` time in mode ``m`` into ``out`` (nx,), to first order."""
    ns = T.A.shape[1]
    f, dw = np.empty(ns), np.empty(x.size - ns)
    field(T, m, x, f)
    forcing_rate(T, x, dw)
    for c in range(x.size):
        out[c] = x[c] + small * (f[c] if c < ns else dw[c - ns])


@leaf
def shifted(x, direction, size, out):
    """Write ``x`` (nx,) moved by ``size`` times a ``direction`` (ns,) into ``out`` (nx,)."""
    for c in range(x.size):
        out[c] = x[c]
    for c in range(direction.size):
        out[c] += size * direction[c]


@leaf
def undivided(T, m, g):
    """Whether a flight behind an impact at guard ``g`` of ``m`` has one part."""
    if T.n_holds[m] == 0 and T.n_guards[m] == 1:
        return True
    return flight_mode(T, m, g)[0] == m


@apart(WHOLES, python=True)
def flight_mode(T, m, g):
    """Return the mode of the flight behind an impact at guard ``g`` of ``m``, and its guard of the sliding speed that vanishes.

    ``m`` itself and -1 where neither friction turns round nor a held one slips; -1 and -1 where there is no such sequence (a
    contact that is no friction opens, two begin to slip) or the mode is not built yet.
    """
    row = moved_row(T, m, g)
    mode, own = turned(T, m, g)
    if row == -1:
        return mode, own
    if row < 0 or mode != m:
        return -1, -1
    for k in range(T.n_guards[m]):
        for i in range(T.then.shape[2]):
            c = T.then[m, k, i]
            if c < 0 or T.n_holds[c] != T.n_holds[m] - 1 or stop_of(T, m, g, c) < 0:
                continue
            for q in range(T.n_guards[c]):
                if T.kick[c, q] == 0 and T.element[c, q] == T.element[m, k] and multiple(T.G[c, q], T.H[m, row]) != 0.0:
                    falls = 0.0
                    for j in range(T.B.shape[2]):
                        falls += T.G[c, q, j] * T.B[m, g, j]
                    if falls > 0.0:  # the impact takes its speed away from zero
                        return c, q
    return -1, -1


@leaf
def turned(T, m, g):
    """As `flight_mode`, where no held row moves: every friction of the same speed is turned round."""
    mode, own = m, -1
    for k in range(T.n_guards[m]):
        if T.element[m, k] == T.element[m, g] or T.kick[m, k] == 1 or multiple(T.G[m, k], T.GT[m, g, :, 1]) == 0.0:
            continue
        found = reversed_mode(T, mode, k, g, m)
        if found < 0:
            return -1, -1
        mode, own = found, k
    return mode, own


@leaf
def reversed_mode(T, mode, k, g, m):
    """Mode behind guard ``k`` of ``mode`` in which that is against what it is in ``m``, and ``g`` is the same stop; -1: none."""
    for i in range(T.then.shape[2]):
        c = T.then[mode, k, i]
        if c < 0 or c == mode or T.n_holds[c] != T.n_holds[m] or T.n_guards[c] != T.n_guards[m]:
            continue
        both = 0.0
        for j in range(T.G.shape[2]):
            both += T.G[c, k, j] * T.G[m, k, j]
        if both < 0.0 and T.element[c, g] == T.element[m, g] and T.kick[c, g] == 1:
            return c
    return -1


@leaf
def stop_of(T, m, g, c):
    """Guard of mode ``c`` that is guard ``g`` of mode ``m``, a stop with an impact; -1 without one."""
    for q in range(T.n_guards[c]):
        if T.element[c, q] == T.element[m, g] and T.kick[c, q] == 1 and multiple(T.G[c, q], T.G[m, g]) != 0.0:
            return q
    return -1


@leaf
def multiple(a, b):
    """Factor f with a = f b of two rows (nx,), neither of them zero; 0 where there is none."""
    own, both, square = 0.0, 0.0, 0.0
    for c in range(a.size):
        own += a[c] * a[c]
        both += a[c] * b[c]
        square += b[c] * b[c]
    return both / square if own > 0.0 and square > 0.0 and both * both >= (1.0 - PARALLEL) * own * square else 0.0
