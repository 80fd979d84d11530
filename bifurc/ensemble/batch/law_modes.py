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
from .several_modes import FUSED, LISTS, MANY, NOISE, dot, filled, horner, layout, loaded
from .stages import Kind, Step, mode_numbers, stage_loads, stage_times

BLOCK = 64  # smooth starts are taken in whole blocks: the same vector code for each of them
SAFETY = 3.0  # of the estimated fourth derivative
WITHIN, FINAL = 1e-2, 1e-6  # of a substep are the two steps to a zero; the last leaves its cube, by the series of second order
SAMPLED = (0.0, 0.25, 0.6, 1.0)  # of a step: accelerations there are those of stages that are nearly as accurate as its end
# rows of scratch: from when and how long a step goes; its accelerations at both ends, bounds on their second and third
# derivatives, the further coefficients of their cubic
STEPS = {"f0_": "A0", "b_": "A1", "second": "SECOND", "third": "THIRD", "slope": "LINEAR", "bend": "SQUARE", "d30_": "CUBE"}


def rows_of(kind: Kind, size: int) -> dict[str, float]:
    """Return `several_modes.layout` of the step."""
    numbers = layout(kind.n, kind.guards, size, (("TAU", 1), ("SPAN", 1), *((name, kind.n) for name in STEPS.values())))
    return numbers | {"WITHIN": WITHIN, "FINAL": FINAL, "SAFETY": SAFETY / 384.0, "NOISE": NOISE}


def step_numbers(T: Tables, kind: Kind, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `Kind.records` of all modes, and of all modes on the substeps of a period, flat."""
    ns, modes, omega = 2 * kind.n, len(T.n_guards), float(T.flat[0])
    h = 2.0 * np.pi / omega / steps
    numbers, grid = (np.zeros(shape, record) for shape, record in zip((modes, (modes, steps)), kind.records, strict=True))
    times, ends = stage_times(kind, steps), 2.0 * np.pi * np.arange(steps + 1) / steps
    for m in range(modes):
        own, loads = numbers[m], mode_numbers(T, kind, m, h, numbers)
        grid[m]["stages"], grid[m]["loads"] = stage_loads(T, loads, times), _polynomials(T, loads, steps, h)
        own["guards"]["constant"] = grid["guards"]["ends"][m, :, :, :, 0] = -1.0  # a place without a guard
        for g in range(T.n_guards[m]):
            guard, row, rise, fourth = own["guards"][g], T.G[m, g], np.zeros(kind.forcings), 0.0
            for i, k in enumerate(T.harmonics):
                c = 1 + 2 * i
                rise[c], rise[c + 1] = k * omega * row[ns + c + 1], -k * omega * row[ns + c]
                fourth += np.hypot(row[ns + c], row[ns + c + 1]) * (k * omega) ** 4
            guard["value"], guard["constant"], guard["fourth"] = row[:ns], row[ns], fourth
            guard["least"], guard["added"] = NOISE * np.abs(row[ns:]).sum(), plan.added(T, m, g)
            both = stage_loads(T, np.array([row[ns:], rise]), ends) * [1.0, h / 3.0]
            grid[m]["guards"]["ends"][:, g] = np.stack((both[:-1], both[1:]), axis=1)
            grid[m]["guards"]["series"][:, g] = _polynomials(T, row[None, ns:], steps, h)[:, 0]
    return numbers.view(float).ravel(), grid.view(float).ravel()


def _polynomials(T: Tables, loads: np.ndarray, steps: int, h: float) -> np.ndarray:
    """Return the coefficients (steps, loads, MANY) of polynomials in time on every substep, through Chebyshev's points."""
    u = 0.5 - 0.5 * np.cos(np.pi * (np.arange(MANY) + 0.5) / MANY)
    values = stage_loads(T, loads, 2.0 * np.pi * (np.arange(steps)[:, None] + u) / steps)
    found = np.linalg.solve(np.vander(u, increasing=True), values) / h ** np.arange(MANY)[:, None]
    return found.transpose(0, 2, 1)


def modes_text(kind: Kind, size: int) -> str:
    """Return the source of the laws, and of ``period_step`` for ``size`` starts in a batch."""
    n, ns, numbers = kind.n, 2 * kind.n, rows_of(kind, size)
    watched = tuple(kind.acts[v].watched for v in kind.modes)
    head = "\n\n\n".join([kind.laws, f"WATCHED = {watched}", *_steps(kind, "fixed", "fixed(W, m, full, old, new, N, o, F, t)"),
                         *_steps(kind, "along", "along(W, m, full, old, new, N, o, F, t)"), "\n"])

    def rate(state: str, acc: str) -> str:
        """What state and accelerations give to the slope of a guard."""
        return dot([f"guard_value_{c}" for c in range(ns)], [*(f"{state}{n + c}" for c in range(n)), *(f"{acc}{c}" for c in range(n))])

    def row(parts: str) -> str:
        """Sum over the part of a guard's row that sees coordinates ("q") or velocities."""
        return dot([f"guard_value_{c if parts[0] == 'q' else n + c}" for c in range(n)], [f"{parts[1:]}{c}" for c in range(n)])

    terms = {0: "(left - forced_ends_0_0)", 1: rate("y", "a"), 2: f"0.5 * ({row('qa')}) + 0.5 * per * ({row('vl')})",
             3: f"per / 6.0 * ({row('ql')}) + per**2 / 3.0 * ({row('vw')})",
             4: f"per**2 / 12.0 * ({row('qw')}) + per**3 / 4.0 * ({row('vk')})", 5: f"per**3 / 20.0 * ({row('qk')})"}
    return filled(_TEXT + LISTS, kind.records, n, numbers, {
        "LOAD_GUARD": ["h = span = N[o]", "third, per = h / 3.0, 1.0 / h", "LOAD guard value fourth least",
                       "LOAD forced ends series"],
        "TAKE_STEP": [f"{short}{c} = W[AT_{name} + {c} * AT_CAP + l]"
                      for short, name in zip("aebtlwk", STEPS.values(), strict=True) for c in range(n)],
        "MOVE": [f"x{c}, x{n + c} = x{c} + step * (x{n + c} + 0.5 * step * e{c}), x{n + c} + step * e{c}" for c in range(n)],
        "RISE0": [f"rise0 = forced_ends_0_1 + third * ({rate('y', 'a')})"], "RISE1": [f"rise1 = forced_ends_1_1 + third * ({rate('x', 'e')})"],
        "BOUND": ["bound = AT_SAFETY * (guard_fourth * span**4 + " + " + ".join(
            f"span**2 * abs(guard_value_{c}) * b{c} + span * abs(guard_value_{n + c}) * t{c}" for c in range(n)) + ")"],
        "GUARD_OVER": ["TAKE_STEP", "left = SUM[ guard_value_{c} * y{c} ; forced_ends_0_0 ]", "RIGHT", "RISE0", "RISE1", "BOUND"],
        "LOAD_AT_S": [], "VALUES_AT_S": [
            "y{k} = m{k}", "span = W[AT_SPAN + l]", "TAKE_STEP", "FORCED_AT", "value = SUM[ guard_value_{c} * y{c} ; value ]",
            f"slope = slope + ({rate('y', 'a')})", "BOUND",
            "rise, later = third * slope, bound", "noise = SUM[ AT_NOISE * abs(guard_value_{c} * y{c}) ; guard_least ]"],
        "SUM_GUARD": [f"g_{k} = forced_series_{k}" + (f" + {terms[k]}" if k in terms else "") for k in range(MANY)],
        "LOAD_PLACE": [], "STATE_AT": ["x{k} = y{k}"], "ROOTS": ["roots(W, m, full, g, numbers, o, grid, t)"],
        "FORCED_AT": horner("forced_series", "s", "value", "slope"),
        "SLOPE_X": [f"slope = slope + ({rate('x', 'e')})"],
    }, head)


def _ends(kind: Kind, step: Step) -> list[str]:
    """Lines for the accelerations b0, ... at the end, and bounds on their second and third derivatives over the step."""
    lines = step.field([f"z{c}" for c in range(2 * kind.n)], "b", step.nearest(1.0))
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


def smooth_text(kind: Kind, size: int) -> str:
    """Return the source of the laws, and of ``period_step`` for one mode without guards: 1.1 times as fast as by a list."""
    step, ns, per_step = Step(kind, kind.acts[kind.modes[0]], given=True), 2 * kind.n, kind.records[1].itemsize // 8
    lines = [*(f"y{c} = W[{c * size} + l]" for c in range(ns)), *step.body, *(f"W[{c * size} + l] = z{c}" for c in range(ns))]
    steps = [f"for k in range(F.size // {per_step}):", f"    t = k * {per_step}",
             *(f"    {line}" for line in loaded(kind.records, "substep", "stages")),
             "    for l in range(full):", *(f"        {line}" for line in lines)]
    head = ["N, F, o = given.numbers, given.grid, 0", "h = N[o]", *step.head, *step.products,
            f"full = (count + {BLOCK - 1}) // {BLOCK} * {BLOCK}"]
    return "\n\n\n".join((FUSED, kind.laws, _function(
        "period_step(W, index, count, given, modes, limit, spare)", "Take starts over a forcing period.", head, steps)))


def _step(kind: Kind, name: str, v: int) -> str:
    """Return the function that takes a list over a substep ("fixed"), or over times of its own within it ("along")."""
    fixed, n, ns = name == "fixed", kind.n, 2 * kind.n
    step = Step(kind, kind.acts[v], given=fixed)
    if fixed:
        head, body = ["h = N[o]", *step.head, *step.products, *loaded(kind.records, "substep", "stages")], []
    else:
        head = [*step.head, *loaded(kind.records, "substep", "loads")]
        body, times = ["tau, h = W[AT_TAU + l], W[AT_SPAN + l]", *step.products], step.method.c.tolist()
        for i, time in enumerate(times):
            first = times.index(time)
            body += [f"s = tau + {time!r} * h"] if first == i else []
            for c in range(kind.loads):
                load = f"substep_stages_{i}_{c}"
                body += horner(f"substep_loads_{c}", "s", load) if first == i else [f"{load} = substep_stages_{first}_{c}"]
    body += [*(f"y{c} = old[{c} * AT_CAP + l]" for c in range(ns)), *step.body,
             *(f"new[{c} * AT_CAP + l] = z{c}" for c in range(ns)), *_ends(kind, step),
             *(f"W[AT_{row} + {c} * AT_CAP + l] = {made}{c}" for made, row in STEPS.items() for c in range(n))]
    return _function(f"{name}_{v}(full, old, new, W, N, o, F, t)", "Carry rows of states; write accelerations and bounds.", head,
                     ["for l in range(full):", *(f"    {line}" for line in body)])


def _steps(kind: Kind, name: str, signature: str) -> list[str]:
    """Return the functions `_step` of all modes, and that which takes the one of a mode."""
    acts = range(len(kind.acts))
    calls = [f"{name}_{v}(full, old, new, W, N, o, F, t)" for v in acts]
    body = calls if len(acts) == 1 else [f"if {kind.modes}[m] == {v}:\n        {call}" for v, call in enumerate(calls)]
    return [*(_step(kind, name, v) for v in acts),
            _function(signature, "Take the step of mode ``m``.", [], body, "@leaf")]


def _function(signature: str, sentence: str, head: list[str], body: list[str], decorator: str = "@fused") -> str:
    return "\n".join([decorator, f"def {signature}:", f'    """{sentence}"""', *(f"    {line}" for line in [*head, *body])])


_TEXT = '''@leaf
def screen(W, m, full, guards, old, new, N, o, F, t):
    """Carry the list of a mode over a substep; write the largest values that its guards may take."""
    fixed(W, m, full, old, new, N, o, F, t)
    for g in range(guards):
        if WATCHED[m]:
            W[AT_NEAR + g] = full
            W[AT_TOPS + g * AT_CAP:AT_TOPS + (g + 1) * AT_CAP] = np.inf
        else:
            look(W, full, g, old, new, N, o, F, t)


@fused
def crossing(W, full, g, N, o, F, t):
    """Find the zero of guard ``g`` along the cubic of the accelerations of a step; verdicts as in `roots`."""
    FIND_GUARD
    LOAD_GUARD
    for l in range(full):
        y{k} = W[AT_EY + {k} * AT_CAP + l]
        x{k} = W[AT_BY + {k} * AT_CAP + l]
        GUARD_OVER
        ROOT
        W[AT_VERDICT + l] = 1.0 if found else (0.0 if none else -1.0)
        W[AT_SPAN + l] = min(max(s, 0.0), h)


@fused
def refine(W, full, g, within, N, o, F, t):
    """Take a step of Newton's method from the ends of steps to a zero, which may be so long; write state, time and speed there."""
    FIND_GUARD
    LOAD_GUARD
    for l in range(full):
        s = W[AT_SPAN + l]
        x{k} = W[AT_BY + {k} * AT_CAP + l]
        TAKE_STEP
        FORCED_AT
        value = SUM[ guard_value_{c} * x{c} ; value ]
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


@leaf
def roots(W, m, full, g, N, o, F, t):
    """Find the zero of guard ``g``, and put the state there in place of that at the start; verdicts as in `several_modes`."""
    for l in range(full):
        W[AT_VERDICT + l], W[AT_TAU + l], W[AT_SPAN + l] = -1.0, 0.0, N[o]
    if WATCHED[m]:
        return
    begin, end = W[AT_EY:AT_EY + AT_STATE], W[AT_BY:AT_BY + AT_STATE]
    along(W, m, full, begin, end, N, o, F, t)
    crossing(W, full, g, N, o, F, t)
    for within in (AT_WITHIN, AT_FINAL):
        along(W, m, full, begin, end, N, o, F, t)
        refine(W, full, g, within, N, o, F, t)
    for l in range(full):
        W[AT_EY + {k} * AT_CAP + l] = W[AT_LE + {k} * AT_CAP + l]


@leaf
def onward(W, m, full, guards, N, o, F, t):
    """Take states at s to the end of the substep in mode ``m``; write their fate, see `admit`."""
    for l in range(full):
        W[AT_TAU + l], W[AT_SPAN + l], W[AT_FATE + l] = W[AT_LS + l], N[o] - W[AT_LS + l], 0.0 if WATCHED[m] else 1.0
    if WATCHED[m]:
        return
    along(W, m, full, W[AT_LY:AT_LY + AT_STATE], W[AT_LE:AT_LE + AT_STATE], N, o, F, t)
    for g in range(guards):
        admit(W, full, g, N, o, F, t)


'''
