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
``onward``.  One file, because it is the text of one kernel, written in the order in which it runs.
"""
import re

import numpy as np

from ...flow.affine.polynomial import SLOPE_ERROR

TURN = 0.6  # largest scaled angle of a substep
CONVERGED = 1e-6  # of a substep is the longest last step: what it leaves is its cube
TURNING = 1e-4  # of the slope at a zero is the largest change of slope over the last step
ORDER = 11  # of the polynomials, economised on the substep: slopes err by 1e-15 on one that turns by TURN
MANY = ORDER + 1
NOISE = 7e-15  # of the sum of all terms of the polynomial of a guard: values below it are zero
# integers of a mode: its guards; then of each guard: what it does (KICKS, STOPS), whether it counts as a hit, its candidates,
# then they
CANDIDATES = 6
NOTHING, KICKS, STOPS, UNKNOWN = range(4)  # what an event does to the speeds; UNKNOWN: left to the scalar integrator
SINGLE = ("BUSY", "S", "SPEED", "VERDICT", "LS", "LSPEED", "FATE")  # rows of scratch; those below: one for each state
EACH = ("EY", "YS", "LY", "BY", "LE", "MY")


def records(n: int, guards: int) -> tuple[np.dtype, np.dtype]:
    """Return what the step reads of a mode, and of a mode on a substep, for ``n`` masses and so many guards.

    ``flow`` gives the state after the substep, ``place`` A(s) and C, ``back`` A(-s).  Of a guard, by every state, value, slope h/3,
    bound and noise, and what forcing adds to the last two; what the guard adds; the constant of its value; D; A(s) times what it
    adds, and by how much that raises the guards, its own bound instead of itself.  Of a guard on a substep what the forcing adds to
    value and slope h/3 at both ends; F; then what its states at s add to value and slope h/3 at s.
    """
    ns = 2 * n
    guard = [("value", float, ns), ("slope", float, ns), ("bound", float, ns), ("bound_all", float), ("noise", float, ns),
             ("noise_all", float), ("added", float, ns), ("constant", float), ("series", float, (ns, MANY)),
             ("kicked", float, (n, MANY)), ("reach", float, (guards,))]
    forced = [("ends", float, (2, 2)), ("series", float, MANY), ("value", float, MANY), ("slope", float, MANY)]
    mode = np.dtype([("h", float), ("flow", float, (ns, ns)), ("place", float, (n, ns, MANY)), ("back", float, (n, ns, MANY)),
                     ("guards", guard, (guards,))])
    return mode, np.dtype([("flow", float, ns), ("place", float, (n, MANY)), ("guards", forced, (guards,))])


def place(record: np.dtype, name: str) -> int:
    """Return how many numbers of a record stand in front of a part."""
    assert record.fields is not None
    return record.fields[name][1] // 8


def strides(mode: np.dtype, substep: np.dtype) -> dict[str, int]:
    """Return by name where lists and events find what they read of the records of a mode, and of a mode on a substep."""
    guard, forced = mode["guards"].base, substep["guards"].base
    return {"PER_MODE": mode.itemsize // 8, "PER_STEP": substep.itemsize // 8, "GUARDS": place(mode, "guards"),
            "FORCED": place(substep, "guards"), "OF_GUARD": guard.itemsize // 8, "OF_GUARD_FORCED": forced.itemsize // 8,
            "REACH": place(guard, "reach") if "reach" in (guard.names or ()) else 0}


def layout(n: int, guards: int, size: int, extra: tuple[tuple[str, int], ...] = ()) -> dict[str, float]:
    """Return by name the places and bounds that the text of a step for ``size`` starts in a batch has in common.

    ``extra`` are names and numbers of rows of scratch of a text's own.
    """
    ns, cap, first = 2 * n, size + 8, (4 * n + 5) * size
    numbers = {"NS": ns, "SIZE": size, "CAP": cap, "FIRST": first, "STATE": ns * cap,  "ALLOW": 16.0 / 3.0,
               "STEEP": SLOPE_ERROR * 128.0, "CONVERGED": CONVERGED, "TURNING": TURNING, "WHOLE": 3 + CANDIDATES,
               "UNKNOWN": UNKNOWN, "KICKS": KICKS, "STOPS": STOPS, "NOWHERE": 2**31}
    rows = (*((name, 1) for name in SINGLE), *((name, ns) for name in EACH), *extra, ("NEAR", 1), ("TOPS", guards), ("LISTS", 0))
    for name, many in rows:
        numbers[name] = first
        first += many * cap
    numbers |= {name: (2 * ns + i) * size for i, name in enumerate(("HITS", "LEAST", "FOUND", "EVENTS", "TAKEN"))}
    return numbers | {name: i * cap for i, name in enumerate(("LIST", "TODO", "PLACE", "WAITING", "GONE", "INTO", "IDS"))}


def modes_text(n: int, guards: int, size: int) -> str:
    """Return the source of ``period_step`` for ``n`` masses, so many guards of a mode, and ``size`` starts in a batch."""
    return filled(_AFFINE + LISTS, records(n, guards), n, layout(n, guards, size))


def spaces(numbers: dict[str, float]) -> tuple[int, int, int, int]:
    """Return the floats and whole numbers of scratch of the step: behind the rows of the driver, and those for each mode."""
    return int(numbers["LISTS"] - numbers["FIRST"]), int(2 * numbers["STATE"]), int(numbers["IDS"]), int(numbers["CAP"]) + 1


def filled(text: str, read: tuple[np.dtype, np.dtype], n: int, numbers: dict[str, float], words: str = "", head: str = "") -> str:
    """Return the source: names of ``numbers``, ``head``, then ``text`` for ``n`` masses, which reads the records ``read``.

    A line with {k} is written for every state, with {i} and {n+i} for every coordinate and its velocity, with {j} for every power
    of a polynomial.  SUM[ term ; last ] is a sum over states {c}, or coordinates {p} and velocities {n+p}, added from its end.
    LOAD names the numbers of parts of a record, see `loaded`; HORNER stands for the lines of `horner`; a word in capitals for those
    below it in ``words``, or else in `WORDS`.
    """
    lines = {name: inside.splitlines() for name, inside in _WORD.findall(WORDS + words)}

    def at(line: str, index: str, v: int) -> str:
        return line.replace(f"{{{index}}}", str(v)).replace(f"{{n+{index}}}", str(n + v))

    def summed(found: re.Match) -> str:
        index, many = ("c", 2 * n) if "{c}" in found[1] else ("p", n)
        return dot([at(found[1], index, v) for v in range(many)], found[2])

    def spelled(line: str) -> list[str]:
        for index, many in (("k", 2 * n), ("i", n), ("j", MANY)):
            if f"{{{index}}}" in line or f"{{n+{index}}}" in line:
                return [made for v in range(many) for made in spelled(at(line, index, v))]
        word, *rest = line.split() or [""]
        inside = loaded(read, *rest) if word == "LOAD" else horner(*rest) if word == "HORNER" else lines.get(line.strip())
        if inside is None:
            return [_SUM.sub(summed, line)]
        indent = line[:len(line) - len(line.lstrip())]
        return [made for inner in inside for made in spelled(indent + inner)]

    named = (f"AT_{name} = {value!r}" for name, value in (numbers | strides(*read)).items())
    return "\n".join([FUSED, *named, "\n", head, *(made for line in text.split("\n") for made in spelled(line))])


def loaded(read: tuple[np.dtype, np.dtype], owner: str, *parts: str) -> list[str]:
    """Return lines that name the numbers of parts of a record by owner, part and index.

    ``owner`` is mode, substep, guard, or forced, which is a guard on a substep; their numbers begin at o, t, i, j.
    """
    mode, substep = read
    record, start = {"mode": (mode, "N[o"), "substep": (substep, "F[t"), "guard": (mode["guards"].base, "N[i"),
                     "forced": (substep["guards"].base, "F[j")}[owner]
    return [f"{'_'.join((owner, part, *map(str, index)))} = {start} + {place(record, part) + at}]"
            for part in parts for at, index in enumerate(np.ndindex(record[part].shape))]


def dot(terms: list[str], last: str | None = None) -> str:
    """Return the text of a sum, added from its end."""
    *terms, text = terms if last is None else [*terms, last]
    for term in reversed(terms):
        text = f"{term} + ({text})"
    return text


def horner(name: str, at: str, value: str, slope: str = "", bend: str = "") -> list[str]:
    """Lines for the value of a polynomial, and for slope and half the second derivative if they have names."""
    lines = [f"{made} = {name}_{ORDER}" for made in (value, slope, bend) if made]
    for j in range(ORDER - 1, 0, -1):
        lines.append(f"{value} = {value} * {at} + {name}_{j}")
        if slope:
            lines.append(f"{slope} = {slope} * {at} + {value}")
        if bend and j > 1:
            lines.append(f"{bend} = {bend} * {at} + {slope}")
    return [*lines, f"{value} = {value} * {at} + {name}_0"]


_WORD = re.compile(r"^([A-Z0-9_]+):\n(.*?)(?=^[A-Z0-9_]+:$|\Z)", re.MULTILINE | re.DOTALL)
_SUM = re.compile(r"SUM\[ (.*?)(?: ; (.*?))? \]")
FUSED = "from bifurc._jit import fused, leaf\n\n"
# words that stand for lines
WORDS = '''GUARD_OVER:
left = SUM[ guard_value_{c} * y{c} ; forced_ends_0_0 ]
RIGHT
RISE0
RISE1
BOUND
SERIES:
g_{j} = SUM[ guard_series_{c}_{j} * y{c} ; forced_series_{j} ]
LARGEST:
GUARD_OVER
largest = max(max(left, right), max(left + rise0, right - rise1)) + bound
RIGHT:
right = SUM[ guard_value_{c} * x{c} ; forced_ends_1_0 ]
RISE0:
rise0 = SUM[ guard_slope_{c} * y{c} ; forced_ends_0_1 ]
RISE1:
rise1 = SUM[ guard_slope_{c} * x{c} ; forced_ends_1_1 ]
BOUND:
bound = SUM[ guard_bound_{c} * abs(y{c}) ; guard_bound_all ]
FIND_GUARD:
i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
LOAD_GUARD:
LOAD guard value slope bound bound_all
LOAD forced ends
LOAD_AT_S:
LOAD guard noise noise_all
LOAD forced value slope
LOAD_FLOW:
LOAD mode flow
LOAD substep flow
LOAD_PLACE:
LOAD mode place
LOAD substep place
STATE_AT:
p{i}_{j} = SUM[ mode_place_{i}_{c}_{j} * y{c} ; substep_place_{i}_{j} ]
HORNER p{i} s x{i} x{n+i}
LOAD_ZERO:
h = N[o]
FIND_GUARD
LOAD_FLOW
LOAD_GUARD
LOAD guard series
LOAD forced series
FLOW:
x{k} = SUM[ mode_flow_{k}_{c} * y{c} ; substep_flow_{k} ]
ZERO:
y{k} = W[AT_EY + {k} * AT_CAP + l]
FLOW
GUARD_OVER
ROOT
verdict = 1.0 if found else (0.0 if none else -1.0)
W[AT_S + l], W[AT_SPEED + l] = s, speed
rest = h - s
VALUES_AT_S:
HORNER forced_value s value
value = SUM[ guard_value_{c} * m{c} ; value ]
HORNER forced_slope s rise
rise = SUM[ guard_slope_{c} * m{c} ; rise ]
y{k} = W[AT_BY + {k} * AT_CAP + l]
BOUND
noise = SUM[ guard_noise_{c} * abs(y{c}) ; guard_noise_all ]
later = (rest_of * rest_of) * (rest_of * rest_of) * bound
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
HORNER g s value slope bend
unit = 1.0 / slope
step = value * unit
step = step * (1.0 + bend * unit * step)  # of third order
ROOTS:
if what == AT_KICKS and I[m, at + 2] > 0 and I[m, at + 3] == m:  # the mode itself is its first candidate
    bounce(W, full, g, numbers, o, grid, t)
else:
    roots(W, m, full, g, numbers, o, grid, t)
REBOUND:
HORNER guard_kicked_{i} rest v{i} v{n+i}
x{k} = x{k} + v{k} * speed
RIGHT
RISE1
rest_of = rest * per
later = AT_ALLOW * rest_of**4 * (bound + reach * abs(speed))
stays = (right < 0.0) & (right - rest_of * rise1 + later < 0.0)
'''
_AFFINE = '''@fused
def first(W, full, old, new, N, o, F, t):
    """Carry rows of states over a substep, and `look` at the first guard, or at what stands in place of it."""
    i, j = o + AT_GUARDS, t + AT_FORCED
    near = 0
    LOAD_FLOW
    LOAD_GUARD
    for l in range(full):
        y{k} = old[{k} * AT_CAP + l]
        FLOW
        new[{k} * AT_CAP + l] = x{k}
        LARGEST
        W[AT_TOPS + l] = largest
        near += largest >= 0.0
    W[AT_NEAR] = near


@leaf
def screen(W, m, full, guards, old, new, N, o, F, t):
    """Carry the list of a mode over a substep; write the largest values that its guards may take."""
    first(W, full, old, new, N, o, F, t)
    for g in range(1, guards):
        look(W, full, g, old, new, N, o, F, t)


@fused
def roots(W, m, full, g, N, o, F, t):
    """Find the zero of guard ``g``; verdict 1: found, 0: proved that there is none, -1: unclear."""
    LOAD_ZERO
    for l in range(full):
        ZERO
        W[AT_VERDICT + l] = verdict


@fused
def bounce(W, full, g, N, o, F, t):
    """Like `roots`, and take starts that the guard throws back to the end; verdict 2: found, and proved to stay inside."""
    LOAD_ZERO
    LOAD guard kicked
    per, reach = 1.0 / h, N[i + AT_REACH + g]
    for l in range(full):
        ZERO
        REBOUND
        W[AT_LE + {k} * AT_CAP + l] = x{k}
        W[AT_VERDICT + l] = 2.0 if found & stays else verdict


@fused
def back(W, full, N, o, F, t):
    """Take states at s back to the start of the substep along the motion of a mode, and to its end."""
    LOAD_FLOW
    LOAD mode back
    LOAD substep place
    for l in range(full):
        s = W[AT_LS + l]
        m{k} = W[AT_LY + {k} * AT_CAP + l]
        HORNER substep_place_{i} s v{i} v{n+i}
        m{k} = m{k} - v{k}
        HORNER mode_back_{i}_{k} s u{i}_{k} u{n+i}_{k}
        y{i} = SUM[ u{i}_{c} * m{c} ]
        y{n+i} = -(SUM[ u{n+i}_{c} * m{c} ])
        FLOW
        W[AT_BY + {k} * AT_CAP + l] = y{k}
        W[AT_LE + {k} * AT_CAP + l] = x{k}
        W[AT_FATE + l] = 1.0


@leaf
def onward(W, m, full, guards, N, o, F, t):
    """Take states at s to the end of the substep in mode ``m``; write their fate, see `admit`."""
    back(W, full, N, o, F, t)
    for g in range(guards):
        admit(W, full, g, N, o, F, t)


'''
LISTS = '''from bifurc.ensemble.scalar import DONE, substep


@fused
def look(W, full, g, old, new, N, o, F, t):
    """Write the largest value that guard ``g`` may take over a substep, and how many starts may meet it."""
    near = 0
    FIND_GUARD
    top = W[AT_TOPS + g * AT_CAP:AT_TOPS + (g + 1) * AT_CAP]
    LOAD_GUARD
    for l in range(full):
        y{k} = old[{k} * AT_CAP + l]
        x{k} = new[{k} * AT_CAP + l]
        LARGEST
        top[l] = largest
        near += largest >= 0.0
    W[AT_NEAR + g] = near


@fused
def admit(W, full, g, N, o, F, t):
    """Whether guard ``g`` of the mode that follows stays inside from s on; fate 1: proved so far, -1: outside at s, 0: unclear."""
    FIND_GUARD
    per = 1.0 / N[o]
    LOAD_GUARD
    LOAD_AT_S
    for l in range(full):
        s, rest_of = W[AT_LS + l], 1.0 - per * W[AT_LS + l]
        x{k} = W[AT_LE + {k} * AT_CAP + l]
        m{k} = W[AT_LY + {k} * AT_CAP + l]
        VALUES_AT_S
        RIGHT
        RISE1
        inner, outer = rise * rest_of, right - rest_of * rise1
        apart = (value < -noise) & (max(max(value, right), max(value + inner, outer)) + later < 0.0)
        leaves = (abs(value) <= noise) & (inner <= noise) & (outer + AT_ALLOW * later < -noise) & (right < -noise)
        sign = 1.0 if apart | leaves else (-1.0 if value > noise else 0.0)
        W[AT_FATE + l] = min(W[AT_FATE + l], sign)


@leaf
def fill(W, first, rows, count):
    """Repeat the last entry of lists one after the other to a whole number of vectors."""
    for r in range(rows):
        at = first + r * AT_CAP
        for e in range(count, (count + 7) // 8 * 8):
            W[at + e] = W[at + count - 1]


@leaf
def defer(W, index, c, l, place, k):
    """Leave a substep with more than one event, or one that is not clear, to the scalar integrator; return how many wait."""
    if W[AT_TAKEN + l] == k:  # two guards ask for it
        return c
    W[AT_TAKEN + l] = k
    index[AT_WAITING + c], index[AT_GONE + c], index[AT_INTO + c] = l, place, AT_NOWHERE
    return c + 1


@leaf
def follow(W, index, c, count, m, k, at, new, plan):
    """Put the starts of a list into the modes that follow their event; return how many wait for the end of the substep.

    ``at`` is the place of the event in the integers of mode ``m``, ``new`` the mode's list after the substep, ``c`` is how many
    starts wait already.  A start that stays in its mode stays in its place.
    """
    I, numbers, grid = plan
    steps = grid.size // (I.shape[0] * AT_PER_STEP)
    for j in range(I[m, at + 2]):
        if count == 0:
            break
        target = I[m, at + 3 + j]
        o, t = target * AT_PER_MODE, (target * steps + k) * AT_PER_STEP
        fill(W, AT_LY, AT_STATE // AT_CAP, count)
        fill(W, AT_LS, 1, count)
        full = (count + 7) // 8 * 8
        onward(W, target, full, I[target, 0], numbers, o, grid, t)
        left = 0
        for e in range(count):
            l, place = index[AT_TODO + e], index[AT_PLACE + e]
            if W[AT_FATE + e] > 0.0:
                W[AT_EVENTS + l] += 2.0 if j > 0 and I[m, at] == AT_KICKS else 1.0  # friction turns round at the same instant
                if I[m, at + 1] == 1:
                    W[AT_HITS + l] += 1.0
                    W[AT_LEAST + l] = min(W[AT_LEAST + l], W[AT_LSPEED + e])
                if target == m:
                    new[{k} * AT_CAP + place] = W[AT_LE + {k} * AT_CAP + e]
                else:
                    index[AT_WAITING + c], index[AT_GONE + c], index[AT_INTO + c] = l, place, target
                    W[AT_MY + {k} * AT_CAP + c] = W[AT_LE + {k} * AT_CAP + e]
                    c += 1
            elif W[AT_FATE + e] == 0.0:
                c = defer(W, index, c, l, place, k)
            else:
                index[AT_TODO + left], index[AT_PLACE + left] = l, place
                W[AT_LY + {k} * AT_CAP + left] = W[AT_LY + {k} * AT_CAP + e]
                W[AT_LS + left], W[AT_LSPEED + left] = W[AT_LS + e], W[AT_LSPEED + e]
                left += 1
        count = left
    for e in range(count):
        c = defer(W, index, c, index[AT_TODO + e], index[AT_PLACE + e], k)
    return c


@fused
def arrive(W, full, g, what, N, o, F, t):
    """Take starts to s, where they meet guard ``g``, and let the event act on them."""
    i = o + AT_GUARDS + g * AT_OF_GUARD
    LOAD_PLACE
    LOAD guard value constant added
    kicks, stops = 1.0 if what == AT_KICKS else 0.0, -1.0 if what == AT_STOPS else 0.0
    for l in range(full):
        y{k} = W[AT_LY + {k} * AT_CAP + l]
        s = W[AT_LS + l]
        STATE_AT
        amount = SUM[ guard_value_{c} * x{c} ; guard_constant ]
        amount = kicks * W[AT_LSPEED + l] + stops * amount  # of what the event adds
        W[AT_LY + {k} * AT_CAP + l] = x{k} + amount * guard_added_{k}


@leaf
def meet(W, index, c, n, m, k, g, lists, plan):
    """Take those of the ``n`` starts of mode ``m`` that may meet guard ``g`` through the event; return how many wait.

    ``lists`` are the mode's states before and after the substep, and which starts they are.
    """
    I, numbers, grid = plan
    old, new, ids = lists
    top = W[AT_TOPS + g * AT_CAP:AT_TOPS + (g + 1) * AT_CAP]
    count = 0
    for i in range(n):
        index[count] = i
        count += top[i] >= 0.0
    for e in range(count):
        W[AT_EY + {k} * AT_CAP + e] = old[{k} * AT_CAP + index[e]]
    fill(W, AT_EY, AT_STATE // AT_CAP, count)
    full, o, t = (count + 7) // 8 * 8, m * AT_PER_MODE, (m * (grid.size // (I.shape[0] * AT_PER_STEP)) + k) * AT_PER_STEP
    at, reach = 1 + g * AT_WHOLE, o + AT_GUARDS + g * AT_OF_GUARD + AT_REACH
    what, hit = I[m, at], I[m, at + 1]
    ROOTS
    todo = 0
    for e in range(count):
        verdict, speed, place = W[AT_VERDICT + e], W[AT_SPEED + e], index[e]
        if verdict == 0.0:
            continue
        l = ids[place]
        for other in range(I[m, 0]):
            if other != g:
                most = W[AT_TOPS + other * AT_CAP + place]
                verdict = 1.0 if verdict == 2.0 and most + speed * numbers[reach + other] >= 0.0 else verdict
                verdict = -1.0 if most >= 0.0 else verdict
        if verdict == 2.0:
            W[AT_EVENTS + l] += 1.0
            W[AT_HITS + l] += hit
            W[AT_LEAST + l] = min(W[AT_LEAST + l], speed)
            new[{k} * AT_CAP + place] = W[AT_LE + {k} * AT_CAP + e]
        elif verdict < 0.0 or what == AT_UNKNOWN:
            c = defer(W, index, c, l, place, k)
        else:
            W[AT_LY + {k} * AT_CAP + todo] = W[AT_EY + {k} * AT_CAP + e]
            W[AT_LS + todo], W[AT_LSPEED + todo] = W[AT_S + e], speed
            index[AT_TODO + todo], index[AT_PLACE + todo] = l, place
            todo += 1
    if todo == 0:
        return c
    fill(W, AT_LY, AT_STATE // AT_CAP, todo)
    fill(W, AT_LS, 2, todo)
    arrive(W, (todo + 7) // 8 * 8, g, what, numbers, o, grid, t)
    return follow(W, index, c, todo, m, k, at, new, plan)


@leaf
def period_step(W, index, count, given, modes, limit, spare):
    """Carry the first ``count`` starts of ``W`` over a forcing period, and ``modes`` with them; write what the driver reads."""
    T, I, numbers, grid = given
    y, tally, plan = spare[0], spare[1], (I, numbers, grid)
    many = I.shape[0]
    steps, counts = grid.size // (many * AT_PER_STEP), AT_IDS + many * AT_CAP
    present = 0
    for l in range(count):
        W[AT_TAKEN + l] = -1.0
        present |= 1 << modes[l]
    for m in range(many):
        n = 0
        if present >> m & 1:
            ids, start = AT_IDS + m * AT_CAP, AT_LISTS + 2 * m * AT_STATE
            for l in range(count):
                index[ids + n] = l
                n += modes[l] == m
            for i in range(n):
                W[start + {k} * AT_CAP + i] = W[{k} * AT_SIZE + index[ids + i]]
        index[counts + m] = n
    now = 0
    for k in range(steps):
        c = 0
        for m in range(many):
            n = index[counts + m]
            if n == 0:
                continue
            a, b = AT_LISTS + (2 * m + now) * AT_STATE, AT_LISTS + (2 * m + 1 - now) * AT_STATE
            full, o, t = (n + 7) // 8 * 8, m * AT_PER_MODE, (m * steps + k) * AT_PER_STEP
            old, new, ids = W[a:a + AT_STATE], W[b:b + AT_STATE], index[AT_IDS + m * AT_CAP:counts]
            screen(W, m, full, I[m, 0], old, new, numbers, o, grid, t)
            begun, lists = c, (old, new, ids)
            for g in range(I[m, 0]):
                if W[AT_NEAR + g] > 0.0:
                    c = meet(W, index, c, n, m, k, g, lists, plan)
            for i in range(begun, c):
                if index[AT_INTO + i] != AT_NOWHERE:
                    continue
                l, place, target = index[AT_WAITING + i], index[AT_GONE + i], m
                y[{k}] = old[{k} * AT_CAP + place]
                if W[AT_FOUND + l] == 0.0:
                    status, reached = substep(T, k, steps, numbers[0], m, spare, limit)
                    W[AT_EVENTS + l] += tally[0]
                    W[AT_HITS + l] += tally[1]
                    W[AT_LEAST + l] = min(W[AT_LEAST + l], tally[2])
                    if status == DONE:
                        target = reached
                    else:
                        W[AT_FOUND + l] = -2.0 - status
                index[AT_INTO + i] = target
                W[AT_MY + {k} * AT_CAP + i] = y[{k}]
            for i in range(begun + 1, c):  # places in order; they come in few runs that are in order
                place, j = index[AT_GONE + i], i
                while j > begun and index[AT_GONE + j - 1] > place:
                    index[AT_GONE + j] = index[AT_GONE + j - 1]
                    j -= 1
                index[AT_GONE + j] = place
            for i in range(c - 1, begun - 1, -1):  # the last start fills the last gap
                n -= 1
                place = index[AT_GONE + i]
                new[{k} * AT_CAP + place] = new[{k} * AT_CAP + n]
                ids[place] = ids[n]
            index[counts + m] = n
        for i in range(c):
            m = index[AT_INTO + i]
            n, b = index[counts + m], AT_LISTS + (2 * m + 1 - now) * AT_STATE
            W[b + {k} * AT_CAP + n] = W[AT_MY + {k} * AT_CAP + i]
            index[AT_IDS + m * AT_CAP + n] = index[AT_WAITING + i]
            index[counts + m] += 1
        now = 1 - now
    for m in range(many):
        a = AT_LISTS + (2 * m + now) * AT_STATE
        for i in range(index[counts + m]):
            l = index[AT_IDS + m * AT_CAP + i]
            W[{k} * AT_SIZE + l] = W[a + {k} * AT_CAP + i]
            modes[l] = m
'''
