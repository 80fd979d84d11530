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
from .several_modes import FUSED, LISTS, MANY, NOISE, filled, horner, layout, loaded
from .stages import Kind, Step, mode_numbers, stage_loads, stage_times

BLOCK = 64  # smooth starts are taken in whole blocks: the same vector code for each of them
SAFETY = 3.0  # of the estimated fourth derivative
WITHIN, FINAL = 1e-2, 1e-6  # of a substep are the two steps to a zero; the last leaves its cube, by the series of second order
SAMPLED = (0.0, 0.25, 0.6, 1.0)  # of a step: accelerations there are those of stages that are nearly as accurate as its end
# of a step: accelerations at both ends, bounds on their second and third derivatives, the further coefficients of their cubic
STEP = ("begun", "ended", "second", "third", "linear", "square", "cube")


def rows_of(kind: Kind, size: int) -> dict[str, float]:
    """Return `several_modes.layout` of the step."""
    numbers = layout(kind.n, kind.guards, size, (("TAU", 1), ("SPAN", 1), *((name.upper(), kind.n) for name in STEP)))
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
    head = "\n\n\n".join([kind.laws, f"WATCHED = {tuple(kind.acts[v].watched for v in kind.modes)}",
                         *_steps(kind, "fixed", "fixed(W, m, full, old, new, N, o, F, t)"),
                         *_steps(kind, "along", "along(W, m, full, old, new, N, o, F, t)"), "\n"])
    return filled(_TEXT + LISTS, kind.records, kind.n, rows_of(kind, size), _WORDS, head)


def _ends(kind: Kind, step: Step) -> list[str]:
    """Lines that name the numbers of `STEP`, by Newton's divided differences through the accelerations of `SAMPLED`."""
    lines = step.field([f"z{c}" for c in range(2 * kind.n)], "ended", step.nearest(1.0))
    for c in range(kind.n):
        nodes = [f"f0_{c}", *(f"f{step.nearest(time)}_{c}" for time in SAMPLED[1:-1]), f"ended_{c}"]
        times = [0.0, *(float(step.method.c[step.nearest(time)]) for time in SAMPLED[1:-1]), 1.0]
        for order in range(1, 4):
            names = [f"d{order}{i}_{c}" for i in range(4 - order)]
            lines += [f"{name} = ({nodes[i + 1]} - {nodes[i]}) * {1.0 / (times[i + order] - times[i])!r}"
                      for i, name in enumerate(names)]
            nodes = names
        one, two = times[1:3]
        lines += [f"begun_{c}, cube_{c} = f0_{c}, d30_{c}", f"third_{c} = 6.0 * abs(cube_{c})",
                  f"second_{c} = 2.0 * max(abs(d20_{c}), abs(d21_{c})) + third_{c}",
                  f"linear_{c} = d10_{c} - {one!r} * d20_{c} + {one * two!r} * cube_{c}",
                  f"square_{c} = d20_{c} - {one + two!r} * cube_{c}"]
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
             *(f"W[AT_{name.upper()} + {c} * AT_CAP + l] = {name}_{c}" for name in STEP for c in range(n))]
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


# words of this text, and those that it has in place of `several_modes.WORDS`
_WORDS = "\n".join(["TAKE_STEP:", *(f"{name}_{{i}} = W[AT_{name.upper()} + {{i}} * AT_CAP + l]" for name in STEP)]) + '''
LOAD_GUARD:
h = span = N[o]
per = 1.0 / h
LOAD guard value fourth least
LOAD forced ends series
RATE0:
dy{i}, dy{n+i} = y{n+i}, begun_{i}
rate0 = SUM[ guard_value_{c} * dy{c} ]
RATE1:
dx{i}, dx{n+i} = x{n+i}, ended_{i}
rate1 = SUM[ guard_value_{c} * dx{c} ]
RISE0:
RATE0
rise0 = forced_ends_0_1 + h / 3.0 * rate0
RISE1:
RATE1
rise1 = forced_ends_1_1 + h / 3.0 * rate1
BOUND:
curved = SUM[ span**2 * abs(guard_value_{p}) * second_{p} + span * abs(guard_value_{n+p}) * third_{p} ]
bound = AT_SAFETY * (guard_fourth * span**4 + curved)
GUARD_OVER:
TAKE_STEP
left = SUM[ guard_value_{c} * y{c} ; forced_ends_0_0 ]
RIGHT
RISE0
RISE1
BOUND
SERIES:
g_{j} = forced_series_{j}
g_0 = g_0 + (left - forced_ends_0_0)
g_1 = g_1 + rate0
g_2 = g_2 + 0.5 * (SUM[ guard_value_{p} * begun_{p} ]) + 0.5 * per * (SUM[ guard_value_{n+p} * linear_{p} ])
g_3 = g_3 + per / 6.0 * (SUM[ guard_value_{p} * linear_{p} ]) + per**2 / 3.0 * (SUM[ guard_value_{n+p} * square_{p} ])
g_4 = g_4 + per**2 / 12.0 * (SUM[ guard_value_{p} * square_{p} ]) + per**3 / 4.0 * (SUM[ guard_value_{n+p} * cube_{p} ])
g_5 = g_5 + per**3 / 20.0 * (SUM[ guard_value_{p} * cube_{p} ])
FORCED_AT:
HORNER forced_series s value slope
LOAD_AT_S:
VALUES_AT_S:
y{k} = m{k}
span = W[AT_SPAN + l]
TAKE_STEP
FORCED_AT
value = SUM[ guard_value_{c} * y{c} ; value ]
RATE0
BOUND
rise, later = h / 3.0 * (slope + rate0), bound
noise = SUM[ AT_NOISE * abs(guard_value_{c} * y{c}) ; guard_least ]
LOAD_PLACE:
STATE_AT:
x{k} = y{k}
ROOTS:
roots(W, m, full, g, numbers, o, grid, t)
'''
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
        RATE1
        step = -value / (slope + rate1)
        s = s + step
        x{i}, x{n+i} = x{i} + step * (x{n+i} + 0.5 * step * ended_{i}), x{n+i} + step * ended_{i}
        FORCED_AT
        RATE1
        slope = slope + rate1
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
