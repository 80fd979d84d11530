"""The text of a one-period batch step of one or two masses under laws, through modes: stops and dry friction beside them.

Every mode has a list of its own of the starts that are in it, and a substep is one Runge-Kutta step of a whole list.  A guard
follows the cubic through its values and slopes at both ends; the distance between the two is h^4/384 times the fourth derivative
(Birkhoff and Priver 1967), which is not bounded but estimated, from accelerations at four stages, and counts `SAFETY` times.
A start whose guards stay below zero by that is done.  The others are taken one by one: the root is found by Newton's method on
Runge-Kutta steps to the event, each from the start of the substep, and the candidates of the guard are tried in order from there.

A start stays in the batch only where the same rules as in `several_modes` find each event, and what follows it, clear.  Otherwise
the scalar integrator takes the substep, or where that fails the period.  It also takes modes with a guard that feels a law.

One file, because it is the text of one kernel, written in the order in which it runs.
"""
import numpy as np

from ...compose.tables import Tables
from ...flow.affine.polynomial import SLOPE_ERROR
from . import tables as plan
from .several_modes import CANDIDATES, FAR, FUSED, GUESSES, KICKS, NOISE, STOPS, UNKNOWN
from .stages import Kind, Step, mode_numbers, stage_loads, stage_times

SAFETY = 3.0  # of the estimated fourth derivative
FINAL = 1e-6  # of a substep is the last step to a root: by the Taylor series of second order it leaves its cube
REFINED = 2  # steps to the root along the cubic acceleration, before it
TURNS = 6  # of Newton's method
MOST_EVENTS = 4  # of a start on a substep
SAMPLED = (0.0, 0.25, 0.6, 1.0)  # of a step: accelerations there are those of stages that are nearly as accurate as its end


def spaces(kind: Kind, size: int) -> tuple[int, int, int, int]:
    """Return the floats and whole numbers of scratch of the step: behind the rows of the driver, and those for each mode."""
    cap = size + 8
    return (4 * kind.n + 1) * cap, 2 * kind.n * cap, 3 * cap, cap + 1


def step_numbers(T: Tables, kind: Kind, steps: int, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return ``numbers`` of the modes and ``grid`` of the substeps, flat: the loads at all stages, the guards at both ends."""
    ns, omega = 2 * kind.n, float(T.flat[0])
    numbers, grid = [], []
    times, ends = stage_times(kind, steps), 2.0 * np.pi * np.arange(steps + 1) / steps
    for m in range(len(T.n_guards)):
        own, loads = mode_numbers(T, kind, m, h)
        parts = [stage_loads(T, loads, times).reshape(steps, -1)]
        for g in range(kind.guards):
            if g < T.n_guards[m]:
                row, added = T.G[m, g], plan.added(T, m, g)
            else:  # a place without a guard
                row, added = np.zeros(T.G.shape[2]), np.zeros(ns)
                row[ns] = -1.0
            rise, fourth = np.zeros(kind.forcings), 0.0
            for i, k in enumerate(T.harmonics):
                c = 1 + 2 * i
                rise[c], rise[c + 1] = k * omega * row[ns + c + 1], -k * omega * row[ns + c]
                fourth += np.hypot(row[ns + c], row[ns + c + 1]) * (k * omega) ** 4
            own += [*row, *rise, fourth, *added]
            both = stage_loads(T, np.array([row[ns:], rise]), ends) * [1.0, h / 3.0]
            parts.append(np.hstack((both[:-1], both[1:])))
        numbers.append(own + Step(kind, kind.acts[0], given=True).coefficients(h))
        grid.append(np.hstack(parts))
    return np.array(numbers).ravel(), np.array(grid).ravel()


def modes_text(kind: Kind, size: int) -> str:
    """Return the source of the laws, and of ``period_step`` for ``size`` starts in a batch."""
    n, ns, w, cap, at = kind.n, 2 * kind.n, kind.forcings, size + 8, kind.places
    step = Step(kind, kind.acts[0])
    stages = len(step.method.c)
    first = (4 * n + 13) * size
    numbers = {"N": n, "NW": w, "HARMONICS": (w - 1) // 2, "RATES": at["RATES"], "CAP": cap, "MOST_GUARDS": kind.guards,
               "PER_MODE": at["SIZE"] + len(step.coefficients(1.0)), "OF_GUARDS": at["GUARDS"], "OF_GUARD": 4 * n + 2 * w + 1,
               "PER_STEP": stages * kind.loads + 4 * kind.guards, "WHOLE": 3 + CANDIDATES, "UNKNOWN": UNKNOWN, "KICKS": KICKS,
               "STOPS": STOPS, "GUESSES": GUESSES, "NOISE": NOISE, "ALLOW": 16.0 / 3.0, "STEEP": SLOPE_ERROR * 128.0,
               "FINAL": FINAL, "TURNS": TURNS, "REFINED": REFINED,
               "MOST_EVENTS": MOST_EVENTS, "SAFETY": SAFETY / 384.0, "FAR": FAR,
               "NEW": first, "MY": first + ns * cap, "TOP": first + 2 * ns * cap, "LISTS": first + (2 * ns + 1) * cap}
    numbers |= {name: i * cap for i, name in enumerate(("GONE", "INTO", "WAITING", "IDS"))}
    numbers |= {name: (2 * ns + i) * size for i, name in enumerate(("HITS", "LEAST", "ASIDE", "EVENTS"))}
    numbers |= {"SIZE": size, "STATE": ns * cap}
    head = "\n".join(f"AT_{name} = {value!r}" for name, value in numbers.items())
    made = "\n\n\n".join(_many(kind, v) + "\n\n\n" + _one(kind, v) for v in range(len(kind.acts)))
    return (f"{FUSED}\n\n{kind.laws}\n\n{head}\nACTS = np.array({list(kind.modes)})\n"
            f"WATCHED = np.array({[acts.watched for acts in kind.acts]})\n\n\n{_TURN}\n\n{made}\n\n\n{_choice(kind)}\n\n\n{_TEXT}")


def _ends(kind: Kind, step: Step, load: str) -> list[str]:
    """Lines for the accelerations b0, ... at the end, and bounds on their second and third derivatives over the step."""
    lines = step.field([f"z{c}" for c in range(2 * kind.n)], "b", load)
    for c in range(kind.n):
        nodes = [f"f0_{c}", *(f"f{step.nearest(time)}_{c}" for time in SAMPLED[1:-1]), f"b_{c}"]
        times = [0.0, *(float(step.method.c[step.nearest(time)]) for time in SAMPLED[1:-1]), 1.0]
        for order in range(1, 4):
            names = [f"d{order}{i}_{c}" for i in range(4 - order)]
            lines += [f"{name} = ({nodes[i + 1]} - {nodes[i]}) * {1.0 / (times[i + order] - times[i])!r}"
                      for i, name in enumerate(names)]
            nodes = names
        lines += [f"third{c} = 6.0 * abs(d30_{c})", f"second{c} = 2.0 * max(abs(d20_{c}), abs(d21_{c})) + third{c}"]
        first, second, third = (f"d{order}0_{c}" for order in (1, 2, 3))
        one, two = times[1], times[2]
        lines += [f"slope{c} = {first} - {one!r} * {second} + {one * two!r} * {third}",
                  f"bend{c} = {second} - {one + two!r} * {third}"]
    return lines


def _many(kind: Kind, v: int) -> str:
    """Return the function that takes a list over a substep."""
    step, n, ns, w = Step(kind, kind.acts[v], given=True), kind.n, 2 * kind.n, kind.forcings
    last = step.nearest(1.0)
    head = [*step.head, *(f"g{i}_{c} = F[t + {i * kind.loads + c}]" for i in range(len(step.method.c)) for c in range(kind.loads)),
            f"t += {len(step.method.c) * kind.loads}"]
    for g in range(kind.guards):
        i = kind.places["GUARDS"] + g * (4 * n + 2 * w + 1)
        head += [*(f"row{g}_{c} = N[o + {i + c}]" for c in range(ns)), f"fourth{g} = N[o + {i + ns + 2 * w}] * hh * hh",
                 *(f"{name}{g} = F[t + {4 * g + k}]" for k, name in enumerate(("left", "rise", "right", "fall")))]
    body = [*(f"y{c} = old[{c} * AT_CAP + l]" for c in range(ns)), *step.body, *_ends(kind, step, f"g{last}"), "most = -np.inf"]
    for g in range(kind.guards):
        for side, state, acc, add in (("left", "y", "f0_", "rise"), ("right", "z", "b_", "fall")):
            body += [f"{side} = {side}{g} + " + " + ".join(f"row{g}_{c} * {state}{c}" for c in range(ns)),
                     f"{add} = {add}{g} + third * (" + " + ".join(
                         f"row{g}_{c} * {state}{n + c} + row{g}_{n + c} * {acc}{c}" for c in range(n)) + ")"]
        bound = " + ".join(f"hh * abs(row{g}_{c}) * second{c} + h * abs(row{g}_{n + c}) * third{c}" for c in range(n))
        body += [f"most = max(most, max(max(left, right), max(left + rise, right - fall)) + AT_SAFETY * (fourth{g} + {bound}))"]
    body += [f"new[{c} * AT_CAP + l] = z{c}" for c in range(ns)]
    body += ["top[l] = np.inf" if kind.acts[v].watched else "top[l] = most"]
    return _function(f"ahead_{v}(full, old, new, top, N, o, F, t)",
                     "Carry a list over a substep; write the largest value that a guard may take.",
                     ["h = N[o]", "third = h / 3.0", *head], ["for l in range(full):", *(f"    {line}" for line in body)])


def _one(kind: Kind, v: int) -> str:
    """Return the function that takes one start over any time up to a substep."""
    step, n, ns, w, at = Step(kind, kind.acts[v]), kind.n, 2 * kind.n, kind.forcings, kind.places
    harmonics, last, lines = range((w - 1) // 2), step.nearest(1.0), []
    lines += [f"r{i} = h * N[o + {at['RATES'] + i}]" for i in harmonics]
    lines += [f"load{c}_{j} = N[o + {at['LOADS'] + c * w + j}]" for c in range(kind.loads) for j in range(w)]
    for i, time in enumerate(step.method.c.tolist()):
        same = step.method.c.tolist().index(time)
        if same < i:
            lines += [f"g{i}_{c} = g{same}_{c}" for c in range(kind.loads)]
            continue
        for j in harmonics:
            lines += [f"cos, sin = turn({time!r} * r{j})", f"e{j} = cos * w[{1 + 2 * j}] - sin * w[{2 + 2 * j}]",
                      f"o{j} = cos * w[{2 + 2 * j}] + sin * w[{1 + 2 * j}]"]
        lines += [f"g{i}_{c} = load{c}_0" + "".join(
            f" + load{c}_{1 + 2 * j} * e{j} + load{c}_{2 + 2 * j} * o{j}" for j in harmonics) for c in range(kind.loads)]
    lines += [f"y{c} = x[{c}]" for c in range(ns)] + step.head + step.body + _ends(kind, step, f"g{last}")
    lines += [f"out[{c}] = z{c}" for c in range(ns)]
    for k, name in enumerate(("f0_", "b_", "second", "third", "slope", "bend", "d30_")):
        lines += [f"out[{ns + k * n + c}] = {name}{c}" for c in range(n)]
    return _function(f"along_{v}(N, o, w, h, x, out)", "Carry a start from forcing states ``w`` over ``h``: state, accelerations, "
                     "bounds.", [], lines)


def _choice(kind: Kind) -> str:
    """Return the functions that take the step of a mode."""
    def dispatch(name: str, arguments: str) -> list[str]:
        return [line for v in range(len(kind.acts))
                for line in (f"{'el' if v else ''}if ACTS[m] == {v}:", f"    {name}_{v}({arguments})")]

    return "\n\n\n".join(
        _function(f"{name}(m, {arguments})", "Take the step of mode ``m``.", [], dispatch(name, arguments), "@njit")
        for name, arguments in (("ahead", "full, old, new, top, N, o, F, t"), ("along", "N, o, w, h, x, out")))


def _function(signature: str, sentence: str, head: list[str], body: list[str], decorator: str = "@fused") -> str:
    return "\n".join([decorator, f"def {signature}:", f'    """{sentence}"""', *(f"    {line}" for line in [*head, *body])])


_TURN = '''@fused
def turn(a):
    """Cosine and sine of a small angle, by their series."""
    if abs(a) > 0.7:
        return np.cos(a), np.sin(a)
    b = a * a
    cos = b * (1.0 / 182.0)
    for k in (132.0, 90.0, 56.0, 30.0, 12.0, 2.0):
        cos = b * (1.0 - cos) * (1.0 / k)
    sin = b * (1.0 / 210.0)
    for k in (156.0, 110.0, 72.0, 42.0, 20.0, 6.0):
        sin = b * (1.0 - sin) * (1.0 / k)
    return 1.0 - cos, a * (1.0 - sin)
'''
_TEXT = '''@fused
def forced(N, o, w, s, w1):
    """Write the forcing states a time ``s`` after ``w``."""
    w1[0] = 1.0
    for i in range(AT_HARMONICS):
        cos, sin = turn(N[o + AT_RATES + i] * s)
        w1[1 + 2 * i], w1[2 + 2 * i] = cos * w[1 + 2 * i] - sin * w[2 + 2 * i], cos * w[2 + 2 * i] + sin * w[1 + 2 * i]


@fused
def guard(N, i, x, out, a, w):
    """Value and slope of a guard at a state with accelerations ``out[a:]``."""
    value = slope = 0.0
    for c in range(AT_N):
        value += N[i + c] * x[c] + N[i + AT_N + c] * x[AT_N + c]
        slope += N[i + c] * x[AT_N + c] + N[i + AT_N + c] * out[a + c]
    for c in range(AT_NW):
        value += N[i + 2 * AT_N + c] * w[c]
        slope += N[i + 2 * AT_N + AT_NW + c] * w[c]
    return value, slope


@fused
def look(N, i, x, out, w, w1, h):
    """What a guard does over ``h``: -1: stays inside, else its root as a part of h; -2: outside at the start, -3: unclear."""
    left, rise0 = guard(N, i, x, out, 2 * AT_N, w)
    right, rise1 = guard(N, i, out, out, 3 * AT_N, w1)
    rise0, rise1 = rise0 * h / 3.0, rise1 * h / 3.0
    bound, noise = N[i + 2 * AT_N + 2 * AT_NW] * h * h * h * h, 0.0
    for c in range(AT_N):
        bound += h * h * abs(N[i + c]) * out[4 * AT_N + c] + h * abs(N[i + AT_N + c]) * out[5 * AT_N + c]
        noise += abs(N[i + c] * x[c]) + abs(N[i + AT_N + c] * x[AT_N + c])
    for c in range(AT_NW):
        noise += abs(N[i + 2 * AT_N + c])
    bound, noise = AT_SAFETY * bound, AT_NOISE * noise
    inner0, inner1, allow = left + rise0, right - rise1, AT_ALLOW * bound
    if left > noise:
        return -2.0
    if left >= -noise:
        return -1.0 if inner0 <= noise and inner1 + allow < -noise and right < -noise else -3.0
    if max(max(left, right), max(inner0, inner1)) + bound < 0.0:
        return -1.0
    bend0, bend1 = left - 2.0 * inner0 + inner1, inner0 - 2.0 * inner1 + right
    steep, middle = AT_STEEP * bound, inner1 - inner0
    concave, convex = bend0 < -allow and bend1 < -allow, bend0 > allow and bend1 > allow
    rising = rise0 > steep and middle > steep and rise1 > steep
    falling = rise0 < -steep and middle < -steep and rise1 < -steep
    if right < -bound and (convex or rising or falling or (concave and (rise0 <= 0.0 or rise1 >= 0.0))):
        return -1.0
    if not (concave or (right > bound and (convex or rising))):
        return -3.0
    d1, d2, d3 = 3.0 * rise0, 3.0 * bend0, bend1 - bend0  # the cubic
    u = -2.0 * left / (d1 + np.sqrt(max(d1 * d1 - 4.0 * (right - left - d1) * left, 0.0)))
    for _ in range(AT_GUESSES):
        u = u - (left + u * (d1 + u * (d2 + u * d3))) / (d1 + u * (2.0 * d2 + 3.0 * d3 * u))
        u = min(max(u, 0.0), 1.0)
    return u if u >= 0.0 else -3.0


@fused
def refined(N, o, i, x, out, w, u, h, w1):
    """Root near ``u`` of a guard along the motion whose acceleration is the cubic through that of four stages."""
    for _ in range(AT_REFINED):
        value = slope = 0.0
        for c in range(AT_N):
            a0, a1, a2, a3 = out[2 * AT_N + c], out[6 * AT_N + c], out[7 * AT_N + c], out[8 * AT_N + c]
            a = a0 + u * (a1 + u * (a2 + u * a3))
            v = x[AT_N + c] + h * u * (a0 + u * (a1 / 2.0 + u * (a2 / 3.0 + u * a3 / 4.0)))
            q = x[c] + h * u * (x[AT_N + c] + h * u * (a0 / 2.0 + u * (a1 / 6.0 + u * (a2 / 12.0 + u * a3 / 20.0))))
            value += N[i + c] * q + N[i + AT_N + c] * v
            slope += N[i + c] * v + N[i + AT_N + c] * a
        forced(N, o, w, u * h, w1)
        for c in range(AT_NW):
            value += N[i + 2 * AT_N + c] * w1[c]
            slope += N[i + 2 * AT_N + AT_NW + c] * w1[c]
        u = min(max(u - value / (h * slope), 0.0), 1.0)
    return u


@njit
def arrive(N, m, i, x, w, s, h, y, out, w1):
    """Take a start to the root of a guard near ``s``: state in ``y``; return time and slope there, the slope 0 where unclear."""
    o = m * AT_PER_MODE
    for _ in range(AT_TURNS):
        along(m, N, o, w, s, x, out)
        forced(N, o, w, s, w1)
        value, slope = guard(N, i, out, out, 3 * AT_N, w1)
        if not slope > 0.0:
            return s, 0.0
        step = -value / slope
        if abs(step) <= AT_FINAL * h:
            s += step
            for c in range(AT_N):
                y[c] = out[c] + step * (out[AT_N + c] + 0.5 * step * out[3 * AT_N + c])
                y[AT_N + c] = out[AT_N + c] + step * out[3 * AT_N + c]
            forced(N, o, w, s, w1)
            return s, guard(N, i, y, out, 3 * AT_N, w1)[1] if 0.0 <= s <= h else 0.0
        if not 0.0 <= s + step <= h:
            return s, 0.0
        s += step
    return s, 0.0


@njit
def cross(N, I, m, k, x, room, tally):
    """Carry the start ``x`` (ns,) over substep ``k`` through its events; return its mode then, -1 where one is not clear."""
    h = N[0]
    w, w1, w2, y, out = room[0], room[1], room[2], room[3], room[4]
    w[0] = 1.0
    for i in range(AT_HARMONICS):
        angle = N[AT_RATES + i] * h * k
        w[1 + 2 * i], w[2 + 2 * i] = np.cos(angle), np.sin(angle)
    along(m, N, m * AT_PER_MODE, w, h, x, out)
    for event in range(AT_MOST_EVENTS + 1):
        o = m * AT_PER_MODE
        forced(N, o, w, h, w1)
        g, s = -1, np.inf
        for j in range(I[m, 0]):
            u = look(N, o + AT_OF_GUARDS + j * AT_OF_GUARD, x, out, w, w1, h)
            if u < -1.5 or (u >= 0.0 and g >= 0):  # which of two comes first is left open
                return -1
            if u >= 0.0:
                g, s = j, u
        if g < 0:
            for c in range(2 * AT_N):
                x[c] = out[c]
            return m
        i, at = o + AT_OF_GUARDS + g * AT_OF_GUARD, 1 + g * AT_WHOLE
        what = I[m, at]
        if event == AT_MOST_EVENTS or what == AT_UNKNOWN:
            return -1
        s = h * refined(N, o, i, x, out, w, s, h, w1)
        s, speed = arrive(N, m, i, x, w, s, h, y, out, w1)
        if not speed > 0.0:
            return -1
        added, away = i + 2 * AT_N + 2 * AT_NW + 1, 0.0
        if what == AT_KICKS:
            away = speed
        elif what == AT_STOPS:
            away = -N[i + 2 * AT_N]
            for c in range(2 * AT_N):
                away -= N[i + c] * y[c]
        for c in range(2 * AT_N):
            x[c] = y[c] + away * N[added + c]
        h -= s
        target = -1
        for j in range(I[m, at + 2]):
            target = I[m, at + 3 + j]
            b = target * AT_PER_MODE
            along(target, N, b, w1, h, x, out)
            forced(N, b, w1, h, w2)
            for q in range(I[target, 0]):
                u = look(N, b + AT_OF_GUARDS + q * AT_OF_GUARD, x, out, w1, w2, h)
                if u == -3.0:
                    return -1
                if u == -2.0:
                    target = -1
                    break
            if target >= 0:
                tally[EVENTS] += 2.0 if j > 0 and what == AT_KICKS else 1.0  # friction turns round at the same instant
                break
        if target < 0:
            return -1
        if I[m, at + 1] == 1:
            tally[HITS] += 1.0
            tally[LEAST] = min(tally[LEAST], speed)
        m = target
        for c in range(AT_NW):
            w[c] = w1[c]
    return -1


@njit
def meet(W, index, c, e, m, k, steps, P, numbers, I, room, limit, spare):
    """Take entry ``e`` of the list of mode ``m`` through the events of substep ``k``; return how many starts leave their lists."""
    x, tally = spare[0], spare[1]
    l, a = index[AT_IDS + m * AT_CAP + e], AT_LISTS + m * AT_STATE + e
    for i in range(2 * AT_N):
        x[i] = W[a + i * AT_CAP]
    tally[EVENTS], tally[HITS], tally[LEAST] = 0.0, 0.0, np.inf
    target = -1 if WATCHED[ACTS[m]] else cross(numbers, I, m, k, x, room, tally)
    if target >= 0 and WATCHED[ACTS[target]]:
        target = -1
    if target < 0:
        for i in range(2 * AT_N):
            x[i] = W[a + i * AT_CAP]
        status, target = substep(P, k, steps, numbers[0], m, spare, limit)
        if status != DONE:
            target = -1
            W[AT_ASIDE + l] = 1.0
    W[AT_EVENTS + l] += tally[EVENTS]
    W[AT_HITS + l] += tally[HITS]
    W[AT_LEAST + l] = min(W[AT_LEAST + l], tally[LEAST])
    if target == m:
        for i in range(2 * AT_N):
            W[AT_NEW + i * AT_CAP + e] = x[i]
        return c
    for i in range(2 * AT_N):
        W[AT_MY + i * AT_CAP + c] = x[i]
    index[AT_GONE + c], index[AT_INTO + c], index[AT_WAITING + c] = e, target, l
    return c + 1


@njit
def period_step(W, index, count, P, numbers, grid, I, modes, limit):
    """Carry the first ``count`` starts of ``W`` over a forcing period; write the ``modes`` of those that are not deferred."""
    many, spare = I.shape[0], scratch()
    room = np.zeros((5, max(9 * AT_N, AT_NW)))
    steps, counts = grid.size // (many * AT_PER_STEP), AT_IDS + many * AT_CAP
    top, new = W[AT_TOP:AT_LISTS], W[AT_NEW:AT_MY]
    for m in range(many):
        index[counts + m] = 0
    for l in range(count):
        W[AT_HITS + l], W[AT_LEAST + l], W[AT_ASIDE + l], W[AT_EVENTS + l] = 0.0, np.inf, 0.0, 0.0
        m = modes[l]
        for i in range(2 * AT_N):
            W[AT_LISTS + m * AT_STATE + i * AT_CAP + index[counts + m]] = W[i * AT_SIZE + l]
        index[AT_IDS + m * AT_CAP + index[counts + m]] = l
        index[counts + m] += 1
    for k in range(steps):
        c = 0
        for m in range(many):
            n, a, ids, begun = index[counts + m], AT_LISTS + m * AT_STATE, AT_IDS + m * AT_CAP, c
            if n == 0:
                continue
            ahead(m, (n + 7) // 8 * 8, W[a:a + AT_STATE], new, top, numbers, m * AT_PER_MODE, grid, (m * steps + k) * AT_PER_STEP)
            for e in range(n):
                if top[e] >= 0.0:
                    c = meet(W, index, c, e, m, k, steps, P, numbers, I, room, limit, spare)
            for i in range(2 * AT_N):
                for e in range(n):
                    W[a + i * AT_CAP + e] = new[i * AT_CAP + e]
            for j in range(c - 1, begun - 1, -1):  # the last start fills the last gap
                n -= 1
                place = index[AT_GONE + j]
                for i in range(2 * AT_N):
                    W[a + i * AT_CAP + place] = W[a + i * AT_CAP + n]
                index[ids + place] = index[ids + n]
            index[counts + m] = n
        for j in range(c):
            m = index[AT_INTO + j]
            if m >= 0:
                n = index[counts + m]
                for i in range(2 * AT_N):
                    W[AT_LISTS + m * AT_STATE + i * AT_CAP + n] = W[AT_MY + i * AT_CAP + j]
                index[AT_IDS + m * AT_CAP + n] = index[AT_WAITING + j]
                index[counts + m] += 1
    for m in range(many):
        for e in range(index[counts + m]):
            l, near = index[AT_IDS + m * AT_CAP + e], True
            for i in range(2 * AT_N):
                value = W[AT_LISTS + m * AT_STATE + i * AT_CAP + e]
                near = near and abs(value) < AT_FAR
                W[i * AT_SIZE + l] = value
            if near and W[AT_EVENTS + l] <= limit:
                modes[l] = m
            else:
                W[AT_ASIDE + l] = 1.0
'''
