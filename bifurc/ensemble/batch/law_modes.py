"""The text of a one-period batch step of one or two masses under laws, through modes: stops and dry friction beside them.

Lists and events are those of `several_modes`; a substep is one Runge-Kutta step of a whole list, and so is the way to an event and
on from it.  A guard follows the cubic through its values and slopes at both ends; the distance between the two is h^4/384 times
the fourth derivative (Birkhoff and Priver 1967), which is not bounded but estimated, from accelerations at four stages, and counts
`SAFETY` times.  A zero is first that of the polynomial which the cubic through these accelerations gives, then found by Newton's
method on Runge-Kutta steps from the start of the substep.  Modes with a guard that feels a law are left to the scalar integrator.
"""
import numpy as np

from ...compose.tables import Tables
from . import tables as plan
from .runge_kutta import nystrom
from .several_modes import EVENTS, LISTS, MANY, NOISE, dot, filled, horner, layout, place, strides
from .stages import Kind, Step, mode_numbers, stage_loads, stage_times

SAFETY = 3.0  # of the estimated fourth derivative
WITHIN, FINAL = 1e-2, 1e-6  # of a substep are the two steps to a zero; the last leaves its cube, by the series of second order
SAMPLED = (0.0, 0.25, 0.6, 1.0)  # of a step: accelerations there are those of stages that are nearly as accurate as its end
# rows of scratch: from when and how long a step goes; its accelerations at both ends, bounds on their second and third
# derivatives, the further coefficients of their cubic
STEPS = {"f0_": "A0", "b_": "A1", "second": "SECOND", "third": "THIRD", "slope": "LINEAR", "bend": "SQUARE", "d30_": "CUBE"}


def rows_of(kind: Kind, size: int) -> dict[str, float]:
    """Return `several_modes.layout` of the step."""
    numbers = layout(kind.n, kind.guards, size, (("TAU", 1), ("SPAN", 1), *((name, kind.n) for name in STEPS.values())))
    own = strides(kind.record, substep_of(kind))
    own["PER_MODE"] += len(Step(kind, kind.acts[0]).coefficients(1.0))
    if not kind.guards:  # the same vector code for every start, whatever a law calls
        numbers["BLOCK"] = 64
    return numbers | own | {"WITHIN": WITHIN, "FINAL": FINAL, "SAFETY": SAFETY / 384.0, "NOISE": NOISE}


def substep_of(kind: Kind) -> np.dtype:
    """Return what the step reads of a mode on a substep.

    That are the loads at all stages; of a guard what forcing gives to value and slope h/3 at both ends, and its polynomial; the
    polynomials of the loads.
    """
    guard = [("ends", float, (2, 2)), ("series", float, MANY)]
    return np.dtype([("stages", float, (len(nystrom(kind.method).c), kind.loads)), ("guards", guard, (kind.guards,)),
                     ("loads", float, (kind.loads, MANY))])


def step_numbers(T: Tables, kind: Kind, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `Kind.record` and coefficients of all modes, and `substep_of` of all modes on the substeps of a period, flat."""
    ns, modes, omega = 2 * kind.n, len(T.n_guards), float(T.flat[0])
    h = 2.0 * np.pi / omega / steps
    numbers: list[np.ndarray] = []
    grid = np.zeros((modes, steps), substep_of(kind))
    times, ends = stage_times(kind, steps), 2.0 * np.pi * np.arange(steps + 1) / steps
    coefficients = Step(kind, kind.acts[0], given=True).coefficients(h)
    for m in range(modes):
        own, loads = mode_numbers(T, kind, m, h)
        grid[m]["stages"], grid[m]["loads"] = stage_loads(T, loads, times), _polynomials(T, loads, steps, h)
        own["guards"]["constant"] = grid["guards"]["ends"][m, :, :, :, 0] = -1.0  # a place without a guard
        for g in range(T.n_guards[m]):
            guard, row, rise, fourth = own["guards"][0, g], T.G[m, g], np.zeros(kind.forcings), 0.0
            for i, k in enumerate(T.harmonics):
                c = 1 + 2 * i
                rise[c], rise[c + 1] = k * omega * row[ns + c + 1], -k * omega * row[ns + c]
                fourth += np.hypot(row[ns + c], row[ns + c + 1]) * (k * omega) ** 4
            guard["value"], guard["constant"], guard["fourth"] = row[:ns], row[ns], fourth
            guard["least"], guard["added"] = NOISE * np.abs(row[ns:]).sum(), plan.added(T, m, g)
            both = stage_loads(T, np.array([row[ns:], rise]), ends) * [1.0, h / 3.0]
            grid[m]["guards"]["ends"][:, g] = np.stack((both[:-1], both[1:]), axis=1)
            grid[m]["guards"]["series"][:, g] = _polynomials(T, row[None, ns:], steps, h)[:, 0]
        numbers += [own.view(float).ravel(), np.array(coefficients)]
    return np.concatenate(numbers), grid.view(float).ravel()


def _polynomials(T: Tables, loads: np.ndarray, steps: int, h: float) -> np.ndarray:
    """Return the coefficients (steps, loads, MANY) of polynomials in time on every substep, through Chebyshev's points."""
    u = 0.5 - 0.5 * np.cos(np.pi * (np.arange(MANY) + 0.5) / MANY)
    values = stage_loads(T, loads, 2.0 * np.pi * (np.arange(steps)[:, None] + u) / steps)
    found = np.linalg.solve(np.vander(u, increasing=True), values) / h ** np.arange(MANY)[:, None]
    return found.transpose(0, 2, 1)


def modes_text(kind: Kind, size: int) -> str:
    """Return the source of the laws, and of ``period_step`` for ``size`` starts in a batch."""
    n, ns, numbers = kind.n, 2 * kind.n, rows_of(kind, size)
    made = [_screen(kind, numbers, v) for v in range(len(kind.acts))]
    if not kind.guards:
        return filled(LISTS, n, numbers, {"MEET": ["begun = c"]}, "\n\n\n".join([kind.laws, *made, _choice(kind, "screen"), "\n"]))
    made += [_along(kind, v) for v in range(len(kind.acts))]
    head = "\n\n\n".join((f"{kind.laws}\n\nACTS = np.array({list(kind.modes)})\n"
                         f"WATCHED = np.array({[acts.watched for acts in kind.acts]})[ACTS]", *made,
                         _choice(kind, "screen"), _choice(kind, "along"), "\n"))

    def rate(state: str, acc: str) -> str:
        """What state and accelerations give to the slope of a guard."""
        return dot([f"g{c}" for c in range(ns)], [*(f"{state}{n + c}" for c in range(n)), *(f"{acc}{c}" for c in range(n))])

    def row(parts: str) -> str:
        """Sum over the part of a guard's row that sees coordinates ("q") or velocities."""
        return dot([f"g{c if parts[0] == 'q' else n + c}" for c in range(n)], [f"{parts[1:]}{c}" for c in range(n)])

    terms = {0: "(left - p)", 1: rate("y", "a"), 2: f"0.5 * ({row('qa')}) + 0.5 * per * ({row('vl')})",
             3: f"per / 6.0 * ({row('ql')}) + per**2 / 3.0 * ({row('vw')})",
             4: f"per**2 / 12.0 * ({row('qw')}) + per**3 / 4.0 * ({row('vk')})", 5: f"per**3 / 20.0 * ({row('qk')})"}
    return filled(_TEXT + EVENTS + LISTS, n, numbers, {
        "LOAD_ROW": [f"{', '.join(f'g{c}' for c in range(ns))}, constant, fourth, least = "
                     f"{', '.join(f'N[i + {c}]' for c in range(ns + 3))}",
                     "p, slope0, n, slope1 = F[j], F[j + 1], F[j + 2], F[j + 3]",
                     *(f"f_{k} = F[j + {4 + k}]" for k in range(MANY))],
        "TAKE_STEP": [f"{short}{c} = W[AT_{name} + {c} * AT_CAP + l]"
                      for short, name in zip("aebtlwk", STEPS.values(), strict=True) for c in range(n)],
        "MOVE": [f"x{c}, x{n + c} = x{c} + step * (x{n + c} + 0.5 * step * e{c}), x{n + c} + step * e{c}" for c in range(n)],
        "RISE0": [f"rise0 = slope0 + third * ({rate('y', 'a')})"], "RISE1": [f"rise1 = slope1 + third * ({rate('x', 'e')})"],
        "BOUND": ["bound = AT_SAFETY * (fourth * span**4 + " + " + ".join(
            f"span**2 * abs(g{c}) * b{c} + span * abs(g{n + c}) * t{c}" for c in range(n)) + ")"],
        "NOISE": ["noise = SUM[ AT_NOISE * abs(g{c} * y{c}) ; least ]"],
        "SUM_GUARD": [f"g_{k} = f_{k}" + (f" + {terms[k]}" if k in terms else "") for k in range(MANY)],
        "LOAD_PLACE": [], "STATE_AT": ["x{k} = y{k}"], "BOUNCE": ["stays = False"],
        "FORCED_AT": horner("f", "s", "value", "slope"),
        "SLOPE_Y": [f"slope = slope + ({rate('y', 'a')})"], "SLOPE_X": [f"slope = slope + ({rate('x', 'e')})"],
    }, head)


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


def _screen(kind: Kind, numbers: dict[str, float], v: int) -> str:
    """Return the function that takes a list over a substep."""
    step, n, ns = Step(kind, kind.acts[v], given=True), kind.n, 2 * kind.n
    last = step.nearest(1.0)
    head = ["h = N[o]", *step.head, *step.products,
            *(f"g{i}_{c} = F[t + {i * kind.loads + c}]" for i in range(len(step.method.c)) for c in range(kind.loads))]
    for g in range(kind.guards):
        i, j = (f"{numbers[place] + g * numbers[size]}" for place, size in (("GUARDS", "OF_GUARD"), ("FORCED", "OF_GUARD_FORCED")))
        head += [*(f"row{g}_{c} = N[o + {i} + {c}]" for c in range(ns)), f"fourth{g} = N[o + {i} + {ns + 1}] * hh * hh",
                 *(f"{name}{g} = F[t + {j} + {k}]" for k, name in enumerate(("left", "rise", "right", "fall")))]
    body = [*(f"y{c} = old[{c} * AT_CAP + l]" for c in range(ns)), *step.body,
            *([*_ends(kind, step, f"g{last}"), "most = -np.inf"] if kind.guards else [])]
    for g in range(kind.guards):
        for side, state, acc, add in (("left", "y", "f0_", "rise"), ("right", "z", "b_", "fall")):
            body += [f"{side} = {side}{g} + " + " + ".join(f"row{g}_{c} * {state}{c}" for c in range(ns)),
                     f"{add} = {add}{g} + h / 3.0 * (" + " + ".join(
                         f"row{g}_{c} * {state}{n + c} + row{g}_{n + c} * {acc}{c}" for c in range(n)) + ")"]
        bound = " + ".join(f"hh * abs(row{g}_{c}) * second{c} + h * abs(row{g}_{n + c}) * third{c}" for c in range(n))
        body += [f"largest = max(max(left, right), max(left + rise, right - fall)) + AT_SAFETY * (fourth{g} + {bound})",
                 *(["largest = np.inf"] if kind.acts[v].watched else []),
                 f"top[{g} * AT_CAP + l], most = largest, max(most, largest)"]
    body += [*(f"new[{c} * AT_CAP + l] = z{c}" for c in range(ns)), *(["top[AT_MOST + l] = most"] if kind.guards else [])]
    return _function(f"screen_{v}(full, old, new, top, N, o, F, t)",
                     "Carry a list over a substep; write the largest values that the guards may take.",
                     head, ["for l in range(full):", *(f"    {line}" for line in body)])


def _along(kind: Kind, v: int) -> str:
    """Return the function that takes a list over times of its own within a substep."""
    step, n, ns = Step(kind, kind.acts[v]), kind.n, 2 * kind.n
    times, loads = step.method.c.tolist(), place(substep_of(kind), "loads")
    head = [*step.head, *(f"load{c}_{j} = F[t + {loads + c * MANY + j}]" for c in range(kind.loads) for j in range(MANY))]
    body = ["tau, h = W[AT_TAU + l], W[AT_SPAN + l]", *step.products]
    for i, time in enumerate(times):
        first = times.index(time)
        body += [f"s = tau + {time!r} * h"] if first == i else []
        for c in range(kind.loads):
            body += horner(f"load{c}", "s", f"g{i}_{c}") if first == i else [f"g{i}_{c} = g{first}_{c}"]
    body += [*(f"y{c} = W[source + {c} * AT_CAP + l]" for c in range(ns)), *step.body,
             *_ends(kind, step, f"g{step.nearest(1.0)}"), *(f"W[target + {c} * AT_CAP + l] = z{c}" for c in range(ns)),
             *(f"W[AT_{row} + {c} * AT_CAP + l] = {name}{c}" for name, row in STEPS.items() for c in range(n))]
    return _function(f"along_{v}(W, full, source, target, N, o, F, t)",
                     "Carry rows of states from TAU over SPAN; write accelerations and bounds.", head,
                     ["for l in range(full):", *(f"    {line}" for line in body)])


def _choice(kind: Kind, name: str) -> str:
    """Return the function that takes the step of a mode."""
    own = {"screen": "full, old, new, top, N, o, F, t", "along": "W, full, source, target, N, o, F, t"}[name]
    outer = own.replace("full, old", "full, guards, old")
    if len(kind.acts) == 1:
        body = [f"{name}_0({own})"]
    else:
        body = [line for v in range(len(kind.acts)) for line in (f"if ACTS[m] == {v}:", f"    {name}_{v}({own})")]
    return _function(f"{name}(m, {outer})", "Take the step of mode ``m``.", [], body, "@njit")


def _function(signature: str, sentence: str, head: list[str], body: list[str], decorator: str = "@fused") -> str:
    return "\n".join([decorator, f"def {signature}:", f'    """{sentence}"""', *(f"    {line}" for line in [*head, *body])])


_TEXT = '''@fused
def crossing(W, full, g, N, o, F, t):
    """Find the zero of guard ``g`` along the cubic of the accelerations of a step; verdicts as in `roots`."""
    h = span = N[o]
    third, per = h / 3.0, 1.0 / h
    i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
    LOAD_ROW
    for l in range(full):
        y{k} = W[AT_EY + {k} * AT_CAP + l]
        x{k} = W[AT_BY + {k} * AT_CAP + l]
        TAKE_STEP
        GUARD_OVER
        ROOT
        W[AT_VERDICT + l] = 1.0 if found else (0.0 if none else -1.0)
        W[AT_SPAN + l] = min(max(s, 0.0), h)


@fused
def refine(W, full, g, within, N, o, F, t):
    """Take a step of Newton's method from the ends of steps to a zero, which may be so long; write state, time and speed there."""
    h = N[o]
    i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
    LOAD_ROW
    for l in range(full):
        s = W[AT_SPAN + l]
        x{k} = W[AT_BY + {k} * AT_CAP + l]
        TAKE_STEP
        FORCED_AT
        value = SUM[ g{c} * x{c} ; value ]
        SLOPE_X
        step = -value / slope
        s = s + step
        MOVE
        FORCED_AT
        SLOPE_X
        close = (abs(step) <= within * h) & (s >= 0.0) & (s <= h) & (slope > 0.0)
        W[AT_VERDICT + l] = -1.0 if (W[AT_VERDICT + l] > 0.0) & (not close) else W[AT_VERDICT + l]
        W[AT_S + l], W[AT_SPEED + l], W[AT_SPAN + l] = s, slope, min(max(s, 0.0), h)
        W[AT_LE + {k} * AT_CAP + l] = x{k}


@njit
def roots(W, m, full, g, N, o, F, t):
    """Find the zero of guard ``g``, and put the state there in place of that at the start; verdicts as in `several_modes`."""
    for l in range(full):
        W[AT_VERDICT + l], W[AT_TAU + l], W[AT_SPAN + l] = -1.0, 0.0, N[o]
    if WATCHED[m]:
        return
    along(m, W, full, AT_EY, AT_BY, N, o, F, t)
    crossing(W, full, g, N, o, F, t)
    for within in (AT_WITHIN, AT_FINAL):
        along(m, W, full, AT_EY, AT_BY, N, o, F, t)
        refine(W, full, g, within, N, o, F, t)
    for l in range(full):
        W[AT_EY + {k} * AT_CAP + l] = W[AT_LE + {k} * AT_CAP + l]


@fused
def admit(W, full, g, N, o, F, t):
    """Whether guard ``g`` of the mode that follows stays inside from s on; fate 1: proved so far, -1: outside at s, 0: unclear."""
    h = N[o]
    third, per = h / 3.0, 1.0 / h
    i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
    LOAD_ROW
    for l in range(full):
        s, span = W[AT_TAU + l], W[AT_SPAN + l]
        y{k} = W[AT_LY + {k} * AT_CAP + l]
        x{k} = W[AT_LE + {k} * AT_CAP + l]
        TAKE_STEP
        FORCED_AT
        value = SUM[ g{c} * y{c} ; value ]
        SLOPE_Y
        BOUND
        NOISE
        right = SUM[ g{c} * x{c} ; n ]
        RISE1
        inner, outer, later = span * slope / 3.0, right - span * per * rise1, bound
        JUDGE


@njit
def onward(W, m, full, guards, N, o, F, t):
    """Take states at s to the end of the substep in mode ``m``; write their fate, see `admit`."""
    for l in range(full):
        W[AT_TAU + l], W[AT_SPAN + l], W[AT_FATE + l] = W[AT_LS + l], N[o] - W[AT_LS + l], 0.0 if WATCHED[m] else 1.0
    if WATCHED[m]:
        return
    along(m, W, full, AT_LY, AT_LE, N, o, F, t)
    for g in range(guards):
        admit(W, full, g, N, o, F, t)


'''
