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
from .several_modes import FUSED, LISTS, MANY, NOISE, dot, filled, horner, layout, place, strides
from .stages import Kind, Step, mode_numbers, nystrom, stage_loads, stage_times

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
    own = strides(kind.record, substep_of(kind))
    own["PER_MODE"] += len(Step(kind, kind.acts[0]).coefficients(1.0))
    return numbers | own | {"WITHIN": WITHIN, "FINAL": FINAL, "SAFETY": SAFETY / 384.0, "NOISE": NOISE}


def substep_of(kind: Kind) -> np.dtype:
    """Return what the step reads of a mode on a substep.

    That are the loads at all stages; of a guard what forcing gives to value and slope h/3 at both ends, and its polynomial; the
    polynomials of the loads.
    """
    guard = [("ends", float, (2, 2)), ("series", float, MANY)]
    return np.dtype([("stages", float, (len(nystrom(kind.order).c), kind.loads)), ("guards", guard, (kind.guards,)),
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
    watched = tuple(kind.acts[v].watched for v in kind.modes)
    head = "\n\n\n".join([kind.laws, f"WATCHED = {watched}", *_steps(kind, "fixed", "fixed(W, m, full, old, new, N, o, F, t)"),
                         *_steps(kind, "along", "along(W, m, full, old, new, N, o, F, t)"), "\n"])

    def rate(state: str, acc: str) -> str:
        """What state and accelerations give to the slope of a guard."""
        return dot([f"g{c}" for c in range(ns)], [*(f"{state}{n + c}" for c in range(n)), *(f"{acc}{c}" for c in range(n))])

    def row(parts: str) -> str:
        """Sum over the part of a guard's row that sees coordinates ("q") or velocities."""
        return dot([f"g{c if parts[0] == 'q' else n + c}" for c in range(n)], [f"{parts[1:]}{c}" for c in range(n)])

    terms = {0: "(left - p)", 1: rate("y", "a"), 2: f"0.5 * ({row('qa')}) + 0.5 * per * ({row('vl')})",
             3: f"per / 6.0 * ({row('ql')}) + per**2 / 3.0 * ({row('vw')})",
             4: f"per**2 / 12.0 * ({row('qw')}) + per**3 / 4.0 * ({row('vk')})", 5: f"per**3 / 20.0 * ({row('qk')})"}
    return filled(_TEXT + LISTS, n, numbers, {
        "LOAD_GUARD": ["h = span = N[o]", "third, per = h / 3.0, 1.0 / h", *(f"g{c} = N[i + {c}]" for c in range(ns)),
                       f"fourth, least = N[i + {ns + 1}], N[i + {ns + 2}]",
                       "p, slope0, n, slope1 = F[j], F[j + 1], F[j + 2], F[j + 3]",
                       *(f"f_{k} = F[j + {4 + k}]" for k in range(MANY))],
        "TAKE_STEP": [f"{short}{c} = W[AT_{name} + {c} * AT_CAP + l]"
                      for short, name in zip("aebtlwk", STEPS.values(), strict=True) for c in range(n)],
        "MOVE": [f"x{c}, x{n + c} = x{c} + step * (x{n + c} + 0.5 * step * e{c}), x{n + c} + step * e{c}" for c in range(n)],
        "RISE0": [f"rise0 = slope0 + third * ({rate('y', 'a')})"], "RISE1": [f"rise1 = slope1 + third * ({rate('x', 'e')})"],
        "BOUND": ["bound = AT_SAFETY * (fourth * span**4 + " + " + ".join(
            f"span**2 * abs(g{c}) * b{c} + span * abs(g{n + c}) * t{c}" for c in range(n)) + ")"],
        "GUARD_OVER": ["TAKE_STEP", "left = SUM[ g{c} * y{c} ; p ]", "right = SUM[ g{c} * x{c} ; n ]", "RISE0", "RISE1", "BOUND"],
        "LOAD_AT_S": [], "VALUES_AT_S": [
            "y{k} = m{k}", "span = W[AT_SPAN + l]", "TAKE_STEP", "FORCED_AT", "value = SUM[ g{c} * y{c} ; value ]",
            f"slope = slope + ({rate('y', 'a')})", "BOUND",
            "rise, later = third * slope, bound", "noise = SUM[ AT_NOISE * abs(g{c} * y{c}) ; least ]"],
        "SUM_GUARD": [f"g_{k} = f_{k}" + (f" + {terms[k]}" if k in terms else "") for k in range(MANY)],
        "LOAD_PLACE": [], "STATE_AT": ["x{k} = y{k}"], "ROOTS": ["roots(W, m, full, g, numbers, o, grid, t)"],
        "FORCED_AT": horner("f", "s", "value", "slope"),
        "SLOPE_X": [f"slope = slope + ({rate('x', 'e')})"],
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


def smooth_text(kind: Kind, size: int) -> str:
    """Return the source of the laws, and of ``period_step`` for one mode without guards: 1.1 times as fast as by a list."""
    step, ns = Step(kind, kind.acts[kind.modes[0]], given=True), 2 * kind.n
    lines = [*(f"y{c} = W[{c * size} + l]" for c in range(ns)), *step.body, *(f"W[{c * size} + l] = z{c}" for c in range(ns))]
    steps = [f"for k in range(F.size // {substep_of(kind).itemsize // 8}):", f"    t = k * {substep_of(kind).itemsize // 8}",
             *(f"    {line}" for line in _stage_loads(kind)), "    for l in range(full):", *(f"        {line}" for line in lines)]
    head = ["N, F, o = given.numbers, given.grid, 0", "h = N[o]", *step.head, *step.products,
            f"full = (count + {BLOCK - 1}) // {BLOCK} * {BLOCK}"]
    return "\n\n\n".join((FUSED, kind.laws, _function(
        "period_step(W, index, count, given, modes, limit, spare)", "Take starts over a forcing period.", head, steps)))


def _stage_loads(kind: Kind) -> list[str]:
    """Lines that name the loads at all stages of a substep."""
    return [f"g{i}_{c} = F[t + {i * kind.loads + c}]" for i in range(len(nystrom(kind.order).c)) for c in range(kind.loads)]


def _step(kind: Kind, name: str, v: int) -> str:
    """Return the function that takes a list over a substep ("fixed"), or over times of its own within it ("along")."""
    fixed, n, ns = name == "fixed", kind.n, 2 * kind.n
    step = Step(kind, kind.acts[v], given=fixed)
    loads, behind = range(kind.loads), place(substep_of(kind), "loads")
    if fixed:
        head, body = ["h = N[o]", *step.head, *step.products, *_stage_loads(kind)], []
    else:
        head = [*step.head, *(f"load{c}_{j} = F[t + {behind + c * MANY + j}]" for c in loads for j in range(MANY))]
        body, times = ["tau, h = W[AT_TAU + l], W[AT_SPAN + l]", *step.products], step.method.c.tolist()
        for i, time in enumerate(times):
            first = times.index(time)
            body += [f"s = tau + {time!r} * h"] if first == i else []
            for c in loads:
                body += horner(f"load{c}", "s", f"g{i}_{c}") if first == i else [f"g{i}_{c} = g{first}_{c}"]
    body += [*(f"y{c} = old[{c} * AT_CAP + l]" for c in range(ns)), *step.body,
             *(f"new[{c} * AT_CAP + l] = z{c}" for c in range(ns)), *_ends(kind, step, f"g{step.nearest(1.0)}"),
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
    i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
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
    i, j = o + AT_GUARDS + g * AT_OF_GUARD, t + AT_FORCED + g * AT_OF_GUARD_FORCED
    LOAD_GUARD
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
