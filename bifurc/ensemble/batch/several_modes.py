"""The text of a one-period batch step through several modes: stops, elastic stops, dry friction, on one to three masses.

Every mode has a list of its own of the starts that are in it, so that a substep is the same straight line for all starts of
a list, with the numbers of that mode.  On the fixed substep number k the motion of a mode and its guards are

    q_i(s) = sum_c A_ic(s) y_c + C_k,i(s),     guard(s) = sum_c D_c(s) y_c + F_k(s),     polynomials of order ORDER in s,

with the state y = (q, v) at the start of the substep.  An event is a zero of a guard at s.  The candidates of the guard are
tried in order: the state at s is taken back to the start of the substep along the candidate's own motion, by A(-s), and
forward to its end; the guards at s and h and their bound decide of [s, h].  The start then moves to the list of its new mode.

Nothing is taken on trust.  A guard differs from the cubic through its values and slopes at both ends by at most h^4/384 times the
bound on its fourth derivative (Birkhoff and Priver 1967); a start stays in the batch only while that proves that it met no guard,
or one whose first zero is certain, that the candidates before the one taken are forbidden, and that no guard of the one taken is
met in the rest of the substep.  A guard that is zero at s must fall from there (a zero of first or second order: leaving a stop,
leaving stick).  For all others the scalar integrator takes the substep.  The numbers are those of `bifurc.ensemble.batch.tables`.

`LISTS` is also the text of the batch step under laws: a text of motion (here `_AFFINE`) gives it ``screen``, ``roots`` and
``onward``, and the words in which it differs.  One file, because it is the text of one kernel, in the order in which it runs.
"""
import numpy as np

from ...flow.affine.polynomial import SLOPE_ERROR
from .writing import MANY, Records, filled

SIZE = 576  # side by side: rows fill most of a first-level cache, and are not whole pages apart, where stores hold up loads
TURN = 0.6  # largest scaled angle of a substep: slopes of polynomials economised on it err by 1e-15
CONVERGED = 1e-6  # of a substep is the longest last step: what it leaves is its cube
TURNING = 1e-4  # of the slope at a zero is the largest change of slope over the last step
NOISE = 7e-15  # of the sum of all terms of the polynomial of a guard: values below it are zero
CANDIDATES = 6  # modes that are tried after an event
NOWHERE = 2**31  # in place of a mode: left to the scalar integrator


def guard_records(n: int, *own: tuple) -> tuple[list[tuple], list[tuple]]:
    """Return what any step reads of a guard, and of a guard on a substep.

    By every state: value; slope h/3; bound and noise, with what forcing adds to these; what the event adds, in proportion to
    ``kicks`` times the speed of arrival minus ``stops`` times the value of the guard, which has a constant.  Then whether the event
    counts as a hit, how many modes may follow it, and which.  Of the forcing: value and slope h/3 at both ends, and on the way.
    """
    ns = 2 * n
    return ([("value", float, ns), ("slope", float, ns), ("bound", float, ns), ("bound_all", float), ("noise", float, ns),
             ("noise_all", float), ("added", float, ns), ("kicks", float), ("stops", float), ("constant", float),
             ("hit", np.int64), ("many", np.int64), ("modes", np.int64, CANDIDATES), *own],
            [("ends", float, (2, 2)), ("value", float, MANY), ("slope", float, MANY)])


def records(n: int, guards: int) -> Records:
    """Return what the step reads of a mode, and of a mode on a substep, for ``n`` masses and so many guards.

    ``flow`` gives the state after the substep, ``place`` A(s) and C, ``back`` A(-s).  Of a guard also D and F; A(s) times what it
    adds, and by how much that raises the guards, its own bound instead of itself.
    """
    ns = 2 * n
    guard, forced = guard_records(n, ("series", float, (ns, MANY)), ("kicked", float, (n, MANY)), ("reach", float, (guards,)))
    mode = np.dtype([("h", float), ("count", np.int64), ("flow", float, (ns, ns)), ("place", float, (n, ns, MANY)),
                     ("back", float, (n, ns, MANY)), ("guards", guard, (guards,))])
    forced.append(("series", float, MANY))
    return mode, np.dtype([("flow", float, ns), ("place", float, (n, MANY)), ("guards", forced, (guards,))])


def layout(n: int, guards: int, extra: tuple[tuple[str, int], ...] = ()) -> dict[str, float]:
    """Return by name where rows of scratch begin, and other numbers of the text; ``extra`` are further rows.

    Of the driver: the states, impacts, least speed of arrival; the states at the start of the period, what ended the motion (0:
    nothing, -2 - status; then a label), events of the period.  ``LISTS`` and ``IDS`` are followed by two lists and numbers of
    starts for each mode, and by the lengths of the lists.
    """
    ns, cap, first = 2 * n, SIZE + 8, 0
    numbers = {"CAP": cap, "STATE": ns * cap, "LISTED": ns + 2, "ALLOW": 16.0 / 3.0, "STEEP": float(128.0 * SLOPE_ERROR),
               "CONVERGED": CONVERGED, "TURNING": TURNING, "NOWHERE": NOWHERE}
    for name, many in (("NOW", ns), ("HITS", 1), ("LEAST", 1), ("BEGUN", ns), ("FOUND", 1), ("EVENTS", 1),
                       ("S", 1), ("SPEED", 1), ("VERDICT", 1), ("FATE", 1), ("EY", ns), ("LY", ns), ("LS", 1), ("LSPEED", 1),
                       ("BY", ns), ("LE", ns), ("MY", ns), *extra, ("NEAR", 1), ("TOPS", guards), ("LISTS", 0)):
        numbers[name] = first
        first += many * cap
    return numbers | {name: i * cap for i, name in enumerate(("LIST", "PLACE", "WAITING", "GONE", "INTO", "IDS"))}


def modes_text(n: int, guards: int) -> str:
    """Return the source of ``period_step`` for ``n`` masses and so many guards of a mode."""
    return filled(_AFFINE + LISTS, WORDS, records(n, guards), n, layout(n, guards), f"SIZE, NS = {SIZE}, {2 * n}\n\n")


# words that stand for lines
WORDS = '''GUARD:
guard, forced = mode.guards[g], forcing.guards[g]
LOAD guard value slope bound bound_all
LOAD forced ends
GUARD_OVER:
TAKE_STEP
RATE0
left = SUM[ guard_value_{c} * y{c} ; forced_ends_0_0 ]
rise0 = SUM[ guard_slope_{c} * dy{c} ; forced_ends_0_1 ]
RIGHT
BOUND
RIGHT:
RATE1
right = SUM[ guard_value_{c} * x{c} ; forced_ends_1_0 ]
rise1 = SUM[ guard_slope_{c} * dx{c} ; forced_ends_1_1 ]
BOUND:
bound = SUM[ guard_bound_{c} * abs(y{c}) ; guard_bound_all ]
TAKE_STEP:
RATE0:
dy{k} = y{k}
RATE1:
dx{k} = x{k}
RATE_S:
dm{k} = m{k}
FROM_S:
y{k} = W[AT_BY + {k} * AT_CAP + l]
AT_S:
HORNER forced_value s value
value = SUM[ guard_value_{c} * m{c} ; value ]
RATE_S
HORNER forced_slope s rise
rise = SUM[ guard_slope_{c} * dm{c} ; rise ]
SERIES:
g_{j} = SUM[ guard_series_{c}_{j} * y{c} ; forced_series_{j} ]
POLYNOMIAL:
HORNER g s value slope bend
LOAD_FLOW:
LOAD mode flow
LOAD forcing flow
LOAD_PLACE:
LOAD mode place
LOAD forcing place
STATE_AT:
p{i}_{j} = SUM[ mode_place_{i}_{c}_{j} * y{c} ; forcing_place_{i}_{j} ]
HORNER p{i} s x{i} x{n+i}
LOAD_ZERO:
h = mode.h
GUARD
LOAD_FLOW
LOAD guard series
LOAD forced series
FLOW:
x{k} = SUM[ mode_flow_{k}_{c} * y{c} ; forcing_flow_{k} ]
ZERO:
y{k} = W[AT_EY + {k} * AT_CAP + l]
FLOW
GUARD_OVER
ROOT
verdict = 1.0 if found else (0.0 if none else -1.0)
W[AT_S + l], W[AT_SPEED + l] = s, speed
ROOT:
inner0, inner1 = left + rise0, right - rise1
SERIES
bend0, bend1, allow = left - 2.0 * inner0 + inner1, inner0 - 2.0 * inner1 + right, AT_ALLOW * bound
d1, d2, d3 = 3.0 * rise0, 3.0 * bend0, bend1 - bend0  # the cubic, over u = s / h
u = -2.0 * left / (d1 + np.sqrt(max(d1 * d1 - 4.0 * (right - left - d1) * left, 0.0)))
u = u - (left + u * (d1 + u * (d2 + u * d3))) / (d1 + u * (2.0 * d2 + 3.0 * d3 * u))  # the parabola's zero, a step of Newton's
s = h * min(max(u, 0.0), 1.0)
CHEBYSHEV
s = min(max(s - step, 0.0), h)
CHEBYSHEV
s = s - step
speed = slope - 2.0 * bend * step
steep, middle = AT_STEEP * bound, inner1 - inner0
concave, convex = (bend0 < -allow) & (bend1 < -allow), (bend0 > allow) & (bend1 > allow)
rising = (rise0 > steep) & (middle > steep) & (rise1 > steep)
falling = (rise0 < -steep) & (middle < -steep) & (rise1 < -steep)
# a concave guard rises through zero once at most, and may fall again in the same substep
found = ((left < 0.0) & (concave | ((right >= 0.0) & (convex | rising))) & (abs(step) <= AT_CONVERGED * h)
         & (abs(bend * step) <= AT_TURNING * slope) & (s >= 0.0) & (s <= h) & (speed > 0.0))
none = (left < 0.0) & (right < 0.0) & (convex | rising | falling | (concave & ((rise0 <= 0.0) | (rise1 >= 0.0))))
CHEBYSHEV:
POLYNOMIAL
unit = 1.0 / slope
step = value * unit
step = step * (1.0 + bend * unit * step)  # of third order
RAISED:
verdict = 1.0 if verdict == 2.0 and top + speed * guard.reach[other] >= 0.0 else verdict
REBOUND:
HORNER guard_kicked_{i} rest v{i} v{n+i}
x{k} = x{k} + v{k} * speed
RIGHT
rest_of = rest * per
later = AT_ALLOW * rest_of**4 * (bound + reach * abs(speed))
stays = (right < 0.0) & (right - rest_of * rise1 + later < 0.0)
'''
_AFFINE = '''@fused
def flow(W, full, old, new, mode, forcing):
    """Carry rows of states over a substep."""
    LOAD_FLOW
    for l in range(full):
        y{k} = old[{k} * AT_CAP + l]
        FLOW
        new[{k} * AT_CAP + l] = x{k}


@leaf
def screen(W, m, full, old, new, mode, forcing):
    """Carry the list of a mode over a substep; write the largest values that its guards may take."""
    flow(W, full, old, new, mode, forcing)
    for g in range(mode.count):
        look(W, full, g, old, new, mode, forcing)


@fused
def zero(W, full, g, mode, forcing):
    """Find the zero of guard ``g``; verdict 1: found, 0: proved that there is none, -1: unclear."""
    LOAD_ZERO
    for l in range(full):
        ZERO
        W[AT_VERDICT + l] = verdict


@fused
def bounce(W, full, g, mode, forcing):
    """Like `zero`, and take starts that the guard throws back to the end; verdict 2: found, and proved to stay inside."""
    LOAD_ZERO
    LOAD guard kicked
    per, reach = 1.0 / h, guard.reach[g]
    for l in range(full):
        ZERO
        rest = h - s
        REBOUND
        W[AT_LE + {k} * AT_CAP + l] = x{k}
        W[AT_VERDICT + l] = 2.0 if found & stays else verdict


@leaf
def roots(W, m, full, g, mode, forcing):
    """Find the zero of guard ``g``, and more where the mode itself is the first to follow its kick."""
    guard = mode.guards[g]
    if guard.kicks > 0.0 and guard.many > 0 and guard.modes[0] == m:
        bounce(W, full, g, mode, forcing)
    else:
        zero(W, full, g, mode, forcing)


@fused
def back(W, full, mode, forcing):
    """Take states at s back to the start of the substep along the motion of a mode, and to its end."""
    LOAD_FLOW
    LOAD mode back
    LOAD forcing place
    for l in range(full):
        s = W[AT_LS + l]
        m{k} = W[AT_LY + {k} * AT_CAP + l]
        HORNER forcing_place_{i} s v{i} v{n+i}
        m{k} = m{k} - v{k}
        HORNER mode_back_{i}_{k} s u{i}_{k} u{n+i}_{k}
        y{i} = SUM[ u{i}_{c} * m{c} ]
        y{n+i} = -(SUM[ u{n+i}_{c} * m{c} ])
        FLOW
        W[AT_BY + {k} * AT_CAP + l] = y{k}
        W[AT_LE + {k} * AT_CAP + l] = x{k}


@leaf
def onward(W, m, full, mode, forcing):
    """Take states at s to the end of the substep in mode ``m``; write their fate, see `admit`."""
    back(W, full, mode, forcing)
    for g in range(mode.count):
        admit(W, full, g, mode, forcing)


'''
LISTS = '''@fused
def look(W, full, g, old, new, mode, forcing):
    """Write the largest value that guard ``g`` may take over a substep, and how many starts may meet it."""
    near = 0
    top = W[AT_TOPS + g * AT_CAP:AT_TOPS + (g + 1) * AT_CAP]
    GUARD
    for l in range(full):
        y{k} = old[{k} * AT_CAP + l]
        x{k} = new[{k} * AT_CAP + l]
        GUARD_OVER
        top[l] = largest = max(max(left, right), max(left + rise0, right - rise1)) + bound
        near += largest >= 0.0
    W[AT_NEAR + g] = near


@fused
def admit(W, full, g, mode, forcing):
    """Whether guard ``g`` of the mode that follows stays inside from s on; fate 1: proved so far, -1: outside at s, 0: unclear."""
    per = 1.0 / mode.h
    GUARD
    LOAD guard noise noise_all
    LOAD forced value slope
    for l in range(full):
        s, rest_of = W[AT_LS + l], 1.0 - per * W[AT_LS + l]
        x{k} = W[AT_LE + {k} * AT_CAP + l]
        m{k} = W[AT_LY + {k} * AT_CAP + l]
        FROM_S
        AT_S
        RIGHT
        BOUND
        noise = SUM[ guard_noise_{c} * abs(y{c}) ; guard_noise_all ]
        later = (rest_of * rest_of) * (rest_of * rest_of) * bound
        inner, outer = rise * rest_of, right - rest_of * rise1
        apart = (value < -noise) & (max(max(value, right), max(value + inner, outer)) + later < 0.0)
        leaves = (abs(value) <= noise) & (inner <= noise) & (outer + AT_ALLOW * later < -noise) & (right < -noise)
        sign = 1.0 if apart | leaves else (-1.0 if value > noise else 0.0)
        W[AT_FATE + l] = min(W[AT_FATE + l], sign)


@leaf
def fill(W, first, rows, count):
    """Repeat the last entry of lists one after the other to a whole number of vectors; return that."""
    full = (count + 7) // 8 * 8
    for r in range(rows):
        at = first + r * AT_CAP
        for e in range(count, full):
            W[at + e] = W[at + count - 1]
    return full


@leaf
def tally(W, l, events, hits, speed):
    """Count events and hits of a start, and keep the least speed of arrival."""
    W[AT_EVENTS + l] += events
    W[AT_HITS + l] += hits
    W[AT_LEAST + l] = min(W[AT_LEAST + l], speed if hits > 0 else np.inf)


@leaf
def leave(index, c, ids, place, target):
    """Let the start at a place of a list wait for another mode, or (nowhere) for the scalar integrator; return how many wait."""
    index[AT_WAITING + c], index[AT_GONE + c], index[AT_INTO + c] = ids[place], place, target
    ids[place] = AT_NOWHERE
    return c + 1


@leaf
def follow(W, index, c, count, m, k, g, lists, numbers, grid):
    """Put the listed starts into the modes that follow their event, tried in order; return how many wait.

    A start that stays in its mode stays in its place.
    """
    old, new, ids = lists
    guard = numbers[m].guards[g]
    for j in range(guard.many):
        if count == 0:
            break
        target, left, full = guard.modes[j], 0, fill(W, AT_LY, AT_LISTED, count)
        for e in range(full):
            W[AT_FATE + e] = 1.0
        onward(W, target, full, numbers[target], grid[target, k])
        for e in range(count):
            place = index[AT_PLACE + e]
            if W[AT_FATE + e] > 0.0:  # the friction that an impact turns round is an event of the same instant
                tally(W, ids[place], 2.0 if j > 0 and guard.kicks > 0.0 else 1.0, guard.hit, W[AT_LSPEED + e])
                if target == m:
                    new[{k} * AT_CAP + place] = W[AT_LE + {k} * AT_CAP + e]
                else:
                    W[AT_MY + {k} * AT_CAP + c] = W[AT_LE + {k} * AT_CAP + e]
                    c = leave(index, c, ids, place, target)
            elif W[AT_FATE + e] == 0.0:
                c = leave(index, c, ids, place, AT_NOWHERE)
            else:
                index[AT_PLACE + left] = place
                for r in range(AT_LISTED):
                    W[AT_LY + r * AT_CAP + left] = W[AT_LY + r * AT_CAP + e]
                left += 1
        count = left
    for e in range(count):
        c = leave(index, c, ids, index[AT_PLACE + e], AT_NOWHERE)
    return c


@fused
def arrive(W, full, g, mode, forcing):
    """Take starts to s, where they meet guard ``g``, and let the event act on them."""
    guard = mode.guards[g]
    LOAD_PLACE
    LOAD guard value constant added kicks stops
    for l in range(full):
        y{k} = W[AT_LY + {k} * AT_CAP + l]
        s = W[AT_LS + l]
        STATE_AT
        amount = SUM[ guard_value_{c} * x{c} ; guard_constant ]
        amount = guard_kicks * W[AT_LSPEED + l] - guard_stops * amount
        W[AT_LY + {k} * AT_CAP + l] = x{k} + amount * guard_added_{k}


@leaf
def meet(W, index, c, n, m, k, g, lists, numbers, grid):
    """Take those of the ``n`` starts of mode ``m`` that may meet guard ``g`` through the event; return how many wait.

    ``lists`` are the mode's states before and after the substep, and which starts they are.
    """
    old, new, ids = lists
    mode, forcing, guard = numbers[m], grid[m, k], numbers[m].guards[g]
    count = todo = 0
    for i in range(n):
        index[count] = i
        count += W[AT_TOPS + g * AT_CAP + i] >= 0.0
    for e in range(count):
        W[AT_EY + {k} * AT_CAP + e] = old[{k} * AT_CAP + index[e]]
    roots(W, m, fill(W, AT_EY, AT_LISTED - 2, count), g, mode, forcing)
    for e in range(count):
        verdict, speed, place = W[AT_VERDICT + e], W[AT_SPEED + e], index[e]
        if verdict == 0.0 or ids[place] == AT_NOWHERE:
            continue
        for other in range(mode.count):
            if other != g:
                top = W[AT_TOPS + other * AT_CAP + place]
                RAISED
                verdict = -1.0 if top >= 0.0 else verdict
        if verdict == 2.0:
            tally(W, ids[place], 1.0, guard.hit, speed)
            new[{k} * AT_CAP + place] = W[AT_LE + {k} * AT_CAP + e]
        elif verdict < 0.0 or guard.many == 0:
            c = leave(index, c, ids, place, AT_NOWHERE)
        else:
            W[AT_LY + {k} * AT_CAP + todo] = W[AT_EY + {k} * AT_CAP + e]
            W[AT_LS + todo], W[AT_LSPEED + todo], index[AT_PLACE + todo] = W[AT_S + e], speed, place
            todo += 1
    if todo == 0:
        return c
    arrive(W, fill(W, AT_LY, AT_LISTED, todo), g, mode, forcing)
    return follow(W, index, c, todo, m, k, g, lists, numbers, grid)


@leaf
def enter(W, index, c, counts, now):
    """Put those that wait at the ends of the lists ``now`` of their modes."""
    for i in range(c):
        m = index[AT_INTO + i]
        n, a = index[counts + m], AT_LISTS + (2 * m + now) * AT_STATE
        W[a + {k} * AT_CAP + n] = W[AT_MY + {k} * AT_CAP + i]
        index[AT_IDS + m * AT_CAP + n] = index[AT_WAITING + i]
        index[counts + m] += 1


@leaf
def period_step(W, index, count, given, modes, limit, spare):
    """Carry the first ``count`` starts of ``W`` over a forcing period, and ``modes`` with them; write what the driver reads."""
    T, numbers, grid = given
    y, counted = spare[0], spare[1]
    many, steps = grid.shape
    counts, now = AT_IDS + many * AT_CAP, 0
    for m in range(many):
        index[counts + m] = 0
    for l in range(count):
        index[AT_WAITING + l], index[AT_INTO + l] = l, modes[l]
        W[AT_MY + {k} * AT_CAP + l] = W[{k} * AT_CAP + l]
    enter(W, index, count, counts, now)
    for k in range(steps):
        c = 0
        for m in range(many):
            n, begun = index[counts + m], c
            if n == 0:
                continue
            a, b = AT_LISTS + (2 * m + now) * AT_STATE, AT_LISTS + (2 * m + 1 - now) * AT_STATE
            old, new, ids = W[a:a + AT_STATE], W[b:b + AT_STATE], index[AT_IDS + m * AT_CAP:counts]
            screen(W, m, (n + 7) // 8 * 8, old, new, numbers[m], grid[m, k])
            for g in range(numbers[m].count):
                if W[AT_NEAR + g] > 0.0:
                    c = meet(W, index, c, n, m, k, g, (old, new, ids), numbers, grid)
            for i in range(begun, c):
                l, place = index[AT_WAITING + i], index[AT_GONE + i]
                if index[AT_INTO + i] == AT_NOWHERE:
                    index[AT_INTO + i] = m
                    y[{k}] = old[{k} * AT_CAP + place]
                    if W[AT_FOUND + l] == 0.0:
                        status, reached = substep(T, k, steps, numbers[0].h, m, spare, limit)
                        tally(W, l, counted[0], counted[1], counted[2])
                        if status == DONE:
                            index[AT_INTO + i] = reached
                        else:
                            W[AT_FOUND + l] = -2.0 - status
                    W[AT_MY + {k} * AT_CAP + i] = y[{k}]
                while n > 0 and ids[n - 1] == AT_NOWHERE:
                    n -= 1
                if place < n:  # the last start fills the gap
                    n -= 1
                    new[{k} * AT_CAP + place] = new[{k} * AT_CAP + n]
                    ids[place] = ids[n]
            index[counts + m] = n
        now = 1 - now
        enter(W, index, c, counts, now)
    for m in range(many):
        a = AT_LISTS + (2 * m + now) * AT_STATE
        for i in range(index[counts + m]):
            l = index[AT_IDS + m * AT_CAP + i]
            W[{k} * AT_CAP + l] = W[a + {k} * AT_CAP + i]
            modes[l] = m
'''
