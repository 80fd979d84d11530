"""The text of a one-period batch step of one or two masses under laws, with or without modes: stops and dry friction beside them.

A mode moves by v' = K q + D v + load(t) + sum over rows of P f, with forces f = law(u, s) of the rows' coordinates u = U q + ...
and speeds s = S v + ....  Coefficients of U, S, P that are 0 or 1 are not written; a new pattern of them is a new text.
A substep is one Runge-Kutta step of fixed length h.

Lists and events are those of `several_modes`; the way to an event and on from it is a Runge-Kutta step, too, of a length r h.  The
distance between a guard and its cubic is h^4/384 times the fourth derivative (Birkhoff and Priver 1967), which is not bounded but
estimated, from accelerations at four stages, and counts `SAFETY` times.  A zero is first that of the cubic, then found by Newton's
method on Runge-Kutta steps from the start of the substep.  A guard that feels a law has no bound: the scalar integrator is asked.

One file, because it is the text of one kernel, with the numbers that it reads.
"""
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from ...compose.tables import Tables
from ...flow.laws.calls import SOURCE
from .several_modes import LISTS, NOISE, SIZE, WORDS, guard_records, layout
from .tables import event_numbers, phases_of
from .writing import MANY, Records, dot, filled, horner

NONE, ONE, NUMBER = range(3)  # what is written of a coefficient: nothing, no factor, a number
Pattern = tuple[tuple[int, ...], ...]
SAFETY = 3.0  # of the estimated fourth derivative
WITHIN, FINAL = 1e-2, 1e-6  # of a substep are the two steps to a zero; the last leaves its cube, by the series of second order
SAMPLED = (0.0, 0.25, 0.6, 1.0)  # of a step: accelerations there are those of stages that are nearly as accurate as its end
STEP = ("begun", "ended", "second", "third")  # accelerations at both ends of a step, bounds on their derivatives over u = s / h


class Nystrom(NamedTuple):
    """An explicit Runge-Kutta method for x'' = f(t, x, x') with a step of 1, written so that only the values of f are kept.

    With the stages' velocities V_i = v + sum_j a_ij f_j put into X_i = x + sum_j a_ij V_j,

        X_i = x + c_i v + sum_j (a^2)_ij f_j,    x(1) = x + v + sum_j (b a)_j f_j,    v(1) = v + sum_j b_j f_j.
    """

    c: np.ndarray  # (stages + 1,) times, the last one 1
    position: np.ndarray  # (stages + 1, stages) a^2, then b a
    velocity: np.ndarray  # (stages + 1, stages) a, then b

    @property
    def weights(self) -> dict[tuple[int, float], str]:
        """Names of its coefficients, each with the power of the step that it goes with: equal ones once."""
        parts = ((1, self.c), (1, self.velocity), (2, self.position))
        known = {(power, weight): None for power, array in parts for weight in array.ravel().tolist() if weight != 0.0}
        return {weight: f"mode_weights_{i}" for i, weight in enumerate(known)}

    def nearest(self, time: float) -> int:
        """Return the last of the stages that are nearest to a part of the step."""
        away = np.abs(self.c[:-1] - time)
        return int(np.flatnonzero(away == away.min())[-1])


def nystrom(order: int) -> Nystrom:
    """Return the method of order 4, the classical one, or that of order 8 of Dormand and Prince, with 12 stages.

    The latter's coefficients are in scipy (Hairer, Norsett, Wanner, Solving ordinary differential equations I, 1993, code DOP853).
    """
    a, b = {4: (np.diag([0.5, 0.5, 1.0], -1), np.array([1.0, 2.0, 2.0, 1.0]) / 6.0), 8: (DOP853.A, DOP853.B)}[order]
    return Nystrom(np.append(a.sum(axis=1), 1.0), np.vstack([a @ a, b @ a]), np.vstack([a, b]))


class Acts(NamedTuple):
    """What the text of a mode depends on."""

    laws: tuple[int, ...]  # that act
    pushes: Pattern  # (rows, n) of accelerations per force


class Kind(NamedTuple):
    """What the written module depends on."""

    order: int  # of the method
    n: int  # masses
    laws: str  # their text
    rows: tuple[int, ...]  # of every law
    values: tuple[int, ...]  # parameters of every law
    coordinates: Pattern  # (rows, n) of U
    speeds: Pattern  # (rows, n) of S
    moving: tuple[tuple[int, int], ...]  # coordinates (0, row) and speeds (1, row) to which the site's own motion adds
    acts: tuple[Acts, ...]
    modes: tuple[int, ...]  # entry of ``acts`` of every mode
    guards: int  # largest number of guards of a mode

    @property
    def records(self) -> Records:
        """What the step reads of a mode, and of a mode on a substep: see `several_modes.guard_records`.

        ``field``, ``u``, ``s`` and ``p`` are (K, D), U, S and P; the method's weights are multiplied with powers of the step: the
        compiler takes them faster from there.  On a substep what time alone gives, at all stages, and as polynomials in time:
        accelerations, then coordinates and speeds of sites that move.
        """
        rows, n, loads, method = (sum(self.rows), self.n), self.n, self.n + len(self.moving), nystrom(self.order)
        guard, forced = guard_records(n)
        mode = [("h", float), ("count", np.int64), ("field", float, (n, 2 * n)), ("values", float, (sum(self.values),)),
                ("u", float, rows), ("s", float, rows), ("p", float, rows), ("weights", float, len(method.weights)),
                ("guards", guard, (self.guards,))]
        return np.dtype(mode), np.dtype([("stages", float, (len(method.c) - 1, loads)), ("loads", float, (loads, MANY)),
                                         ("guards", forced, (self.guards,))])


def pattern_of(matrix: np.ndarray) -> Pattern:
    """Return what is written of each coefficient."""
    return tuple(tuple(NONE if value == 0.0 else ONE if value == 1.0 else NUMBER for value in row) for row in matrix.tolist())


def seen(T: Tables) -> tuple[np.ndarray, np.ndarray]:
    """Return what every row of the laws sees of x: coordinates and speeds (rows, nx)."""
    return T.LU[T.owners[SOURCE]], T.LS[T.owners[SOURCE]]


def step_numbers(T: Tables, kind: Kind, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `Kind.records` of modes (modes,), and of modes on the substeps of a period (modes, steps)."""
    n, ns, modes, omega, (U, S) = kind.n, 2 * kind.n, len(T.n_guards), float(T.flat[0]), seen(T)
    h, unit, angles = 2.0 * np.pi / omega / steps, 2.0 * np.pi / steps, np.arange(steps)[:, None]
    numbers, grid = (np.zeros(shape, record) for shape, record in zip((modes, (modes, steps)), kind.records, strict=True))
    for m in range(modes):
        own, on_grid, values = numbers[m], grid[m], list[float]()
        for acts, count in zip(T.acts[m].tolist(), kind.values, strict=True):
            values += T.law[acts - 1:acts - 1 + count].tolist() if acts else [0.0] * count
        own["h"], own["count"], own["values"], own["u"] = h, T.n_guards[m], values, U[:, :n]
        own["field"], own["s"], own["p"] = T.A[m, n:ns, :ns], S[:, n:ns], T.LP[m, :len(U)]
        own["weights"] = [weight * h**power for power, weight in nystrom(kind.order).weights]
        loads = np.vstack([T.A[m, n:ns, ns:], *((U, S)[which][row:row + 1, ns:] for which, row in kind.moving)])
        on_grid["stages"] = phases_of(T, unit * (angles + nystrom(kind.order).c[:-1])) @ loads.T
        on_grid["loads"] = _polynomials(T, loads, steps, h)
        for g in range(T.n_guards[m]):
            guard, forced, row, rise = own["guards"][g], on_grid["guards"][:, g], T.G[m, g], np.zeros(T.A.shape[2] - ns)
            rates = omega * T.harmonics
            rise[1::2], rise[2::2] = rates * row[ns + 2::2], -rates * row[ns + 1::2]
            fourth = np.hypot(row[ns + 1::2], row[ns + 2::2]) @ rates**4
            event_numbers(T, m, g, guard)
            guard["slope"], guard["bound_all"] = h / 3.0 * row[:ns], SAFETY / 384.0 * h**4 * fourth
            guard["bound"] = SAFETY / 384.0 * np.abs(row[:ns]) * np.repeat([h * h, h], n)
            guard["noise"], guard["noise_all"] = NOISE * np.abs(row[:ns]), NOISE * np.abs(row[ns:]).sum()
            if T.LG[m, g].any():
                guard["bound_all"] = guard["noise_all"] = np.inf
            both = np.array([row[ns:], h / 3.0 * rise])
            forced["ends"] = phases_of(T, unit * (angles + [0.0, 1.0])) @ both.T
            forced["value"], forced["slope"] = _polynomials(T, both, steps, h).transpose(1, 0, 2)
    return numbers, grid


def _polynomials(T: Tables, rows: np.ndarray, steps: int, h: float) -> np.ndarray:
    """Return the coefficients (steps, rows, MANY) of polynomials in time on every substep, through Chebyshev's points."""
    u = 0.5 - 0.5 * np.cos(np.pi * (np.arange(MANY) + 0.5) / MANY)
    values = phases_of(T, 2.0 * np.pi * (np.arange(steps)[:, None] + u) / steps) @ rows.T
    return (np.linalg.solve(np.vander(u, increasing=True), values) / h ** np.arange(MANY)[:, None]).transpose(0, 2, 1)


def modes_text(kind: Kind) -> str:
    """Return the source of the laws, and of ``period_step``."""
    numbers = layout(kind.n, kind.guards, (("TAU", 1), ("SPAN", 1), *((name.upper(), kind.n) for name in STEP)))
    names, known = ("fixed", "along") if kind.guards else ("fixed",), range(len(kind.acts))
    steps = [_step(kind, name, v) for name in names for v in known]
    for name in names:
        calls = "\n".join(f"    if {kind.modes}[m] == {v}:\n        {name}_{v}(W, full, old, new, mode, forcing)" for v in known)
        steps.append(f'@leaf\ndef {name}(W, m, full, old, new, mode, forcing):\n    """Take the step of mode ``m``."""\n{calls}')
    text = "\n\n\n".join([*steps, _TEXT + LISTS if kind.guards else _SMOOTH])
    return filled(text, WORDS + _WORDS, kind.records, kind.n, numbers | {"WITHIN": WITHIN, "FINAL": FINAL},
                  f"SIZE, NS = {SIZE}, {2 * kind.n}\n\n\n{kind.laws}\n\n")


def _step(kind: Kind, name: str, v: int) -> str:
    """Return the function that takes a list over a substep ("fixed"), or over times of its own within it ("along")."""
    n, ns, smooth = kind.n, 2 * kind.n, not kind.guards
    old, new = ("W", "W") if smooth else ("old", "new")  # two names of one row would look like two rows that overlap
    lines = [f"y{c} = {old}[{c} * AT_CAP + l]" for c in range(ns)]
    if name == "along":
        lines += ["tau, r = W[AT_TAU + l], W[AT_SPAN + l]", "over = 1.0 / r"]
        times = nystrom(kind.order).c.tolist()[:-1]
        for i, time in enumerate(times):
            first = times.index(time)
            lines += [f"s = tau + {time!r} * r * h"] if first == i else []
            for c in range(n + len(kind.moving)):
                load = f"forcing_stages_{i}_{c}"
                lines += horner(f"forcing_loads_{c}", "s", load) if first == i else [f"{load} = forcing_stages_{first}_{c}"]
    lines += [*_stages(kind, v, name == "along"), *(f"{new}[{c} * AT_CAP + l] = x{c}" for c in range(ns))]
    if not smooth:
        lines += [*_ends(kind, v), *(f"W[AT_{part.upper()} + {c} * AT_CAP + l] = {part}_{c}" for part in STEP for c in range(n))]
    head = ["h = mode.h", "LOAD mode field values u s p weights",
            *(["LOAD forcing stages", "r = over = 1.0"] if name == "fixed" else ["LOAD forcing loads"]),
            f"for l in range({'(full + 63) // 64 * 64' if smooth else 'full'}):"]  # of which no part is left to a slower loop
    return "\n".join(["@fused", f"def {name}_{v}(W, full, old, new, mode, forcing):",
                      '    """Carry rows of states; write accelerations and bounds."""', *(f"    {line}" for line in head),
                      *(f"        {line}" for line in lines)])


def _stages(kind: Kind, v: int, scaled: bool) -> list[str]:
    """Lines that take y0, y1, ... to x0, x1, ... by a step r h, ``scaled``, or h, with the stages' accelerations f0_0, ...."""
    n, method, known = kind.n, nystrom(kind.order), nystrom(kind.order).weights
    lines = [*(f"w{c} = r * y{n + c}" for c in range(n)), *field(kind, v, [f"y{c}" for c in range(2 * n)], "f0", 0)]

    def moved(start: str, power: int, weights: np.ndarray, c: int) -> str:
        terms = [f"{known[power, weight]} * f{j}_{c}" for j, weight in enumerate(weights.tolist()) if weight != 0.0]
        return f"{start} + {' * '.join('r' * power)} * ({' + '.join(terms)})" if scaled and terms else " + ".join([start, *terms])

    for i, time in enumerate(method.c.tolist()[1:], 1):
        for c in range(n):
            lines += [f"x{c} = {moved(f'y{c} + {known[1, time]} * w{c}', 2, method.position[i], c)}",
                      f"x{n + c} = {moved(f'y{n + c}', 1, method.velocity[i], c)}"]
        if i < len(method.c) - 1:
            lines += field(kind, v, [f"x{c}" for c in range(2 * n)], f"f{i}", i)
    return lines


def _ends(kind: Kind, v: int) -> list[str]:
    """Lines that name the numbers of `STEP`, by the cubic through the accelerations of `SAMPLED`."""
    n, method = kind.n, nystrom(kind.order)
    inner = [method.nearest(time) for time in SAMPLED[1:-1]]
    lines = field(kind, v, [f"x{c}" for c in range(2 * n)], "ended", method.nearest(1.0))
    cubic = np.linalg.inv(np.vander([0.0, *method.c[inner], 1.0], increasing=True))[2:, 1:]  # of differences to the first
    for c in range(n):
        square, cube = (" + ".join(f"{weight!r} * ({name}_{c} - f0_{c})" for weight, name in
                                   zip(weights, [*(f"f{i}" for i in inner), "ended"], strict=True)) for weights in cubic.tolist())
        lines += [f"begun_{c} = f0_{c}", f"third_{c} = over**3 * 6.0 * abs({cube})",
                  f"second_{c} = over**2 * 2.0 * abs({square}) + third_{c}"]
    return lines


def field(kind: Kind, v: int, state: list[str], name: str, stage: int) -> list[str]:
    """Lines for the accelerations ``name``_0, ... at a state under the loads of a stage, in modes that act as ``v``."""
    n, row, value, lines, acts = kind.n, 0, 0, [], kind.acts[v]
    force: dict[int, str] = {}
    moved = {row: f" + forcing_stages_{stage}_{n + e}" for e, row in enumerate(kind.moving)}
    for i, (rows, values) in enumerate(zip(kind.rows, kind.values, strict=True)):
        own = range(row, row + rows)
        if i in acts.laws:
            arguments = [_linear(pattern[r], f"mode_{part}_{r}_", state[n * which:n * which + n]) + moved.get((which, r), "")
                         for which, part, pattern in ((0, "u", kind.coordinates), (1, "s", kind.speeds)) for r in own]
            results = [f"{name}_of_{r}" for r in own]
            arguments += [f"mode_values_{value + k}" for k in range(values)]
            lines.append(f"{', '.join(results)} = law_{i}({', '.join(arguments)})")
            force |= dict(zip(own, results, strict=True))
        row, value = row + rows, value + values
    for c in range(n):
        text = dot([f"mode_field_{c}_{j} * {state[j]}" for j in range(2 * n)], f"forcing_stages_{stage}_{c}")
        for r, made in force.items():
            text += ("", f" + {made}", f" + mode_p_{r}_{c} * {made}")[acts.pushes[r][c]]
        lines.append(f"{name}_{c} = {text}")
    return lines


def _linear(pattern: tuple[int, ...], name: str, values: list[str]) -> str:
    """Return the text of a sum of products."""
    terms = [value if what == ONE else f"{name}{c} * {value}"
             for c, (what, value) in enumerate(zip(pattern, values, strict=True)) if what != NONE]
    return " + ".join(terms) or "0.0"


# words in the place of those of `several_modes`
_WORDS = "\n".join(["TAKE_STEP:", *(f"{name}_{{i}} = W[AT_{name.upper()} + {{i}} * AT_CAP + l]" for name in STEP)]) + '''
RATE0:
dy{i}, dy{n+i} = y{n+i}, begun_{i}
RATE1:
dx{i}, dx{n+i} = x{n+i}, ended_{i}
RATE_S:
dm{i}, dm{n+i} = m{n+i}, now_{i}
FROM_S:
TAKE_STEP
y{k} = m{k}
now_{i} = begun_{i}
BOUND:
bound = SUM[ guard_bound_{p} * second_{p} + guard_bound_{n+p} * third_{p} ; guard_bound_all ]
SERIES:
POLYNOMIAL:
u = per * s
value = left + u * (d1 + u * (d2 + u * d3))
slope, bend = per * (d1 + u * (2.0 * d2 + 3.0 * d3 * u)), per * per * (d2 + 3.0 * d3 * u)
RAISED:
LOAD_PLACE:
STATE_AT:
x{k} = y{k}
'''
_SMOOTH = '''@leaf
def period_step(W, index, count, given, modes, limit, spare):
    """Carry the first ``count`` starts of ``W`` over a forcing period in its only mode: 1.1 times as fast as in a list."""
    numbers, grid = given.numbers, given.grid
    for k in range(grid.shape[1]):
        fixed(W, 0, count, W, W, numbers[0], grid[0, k])
'''
_TEXT = '''@leaf
def screen(W, m, full, old, new, mode, forcing):
    """Carry the list of a mode over a substep; write the largest values that its guards may take."""
    fixed(W, m, full, old, new, mode, forcing)
    for g in range(mode.count):
        look(W, full, g, old, new, mode, forcing)


@fused
def crossing(W, full, g, mode, forcing):
    """Find the zero of the cubic of guard ``g``; verdict 1: it has one, 0: proved that there is none, -1: unclear."""
    h = mode.h
    per = 1.0 / h
    GUARD
    for l in range(full):
        y{k} = W[AT_EY + {k} * AT_CAP + l]
        x{k} = W[AT_BY + {k} * AT_CAP + l]
        GUARD_OVER
        ROOT
        W[AT_VERDICT + l] = 1.0 if found else (0.0 if none else -1.0)
        W[AT_SPAN + l] = min(max(per * s, 0.0), 1.0)


@fused
def refine(W, full, g, within, mode, forcing):
    """Take a step of Newton's method from the ends of steps to a zero, which may be so long; write state, time and speed there."""
    h = mode.h
    per = 1.0 / h
    GUARD
    LOAD forced value slope
    for l in range(full):
        s = h * W[AT_SPAN + l]
        m{k} = W[AT_BY + {k} * AT_CAP + l]
        TAKE_STEP
        now_{i} = ended_{i}
        AT_S
        step = -value / (3.0 * per * rise)
        s = s + step
        m{i}, m{n+i} = m{i} + step * (m{n+i} + 0.5 * step * ended_{i}), m{n+i} + step * ended_{i}
        AT_S
        speed = 3.0 * per * rise
        close = (abs(step) <= within * h) & (s >= 0.0) & (s <= h) & (speed > 0.0)
        W[AT_VERDICT + l] = -1.0 if (W[AT_VERDICT + l] > 0.0) & (not close) else W[AT_VERDICT + l]
        W[AT_S + l], W[AT_SPEED + l], W[AT_SPAN + l] = s, speed, min(max(per * s, 0.0), 1.0)
        W[AT_LE + {k} * AT_CAP + l] = m{k}


@leaf
def roots(W, m, full, g, mode, forcing):
    """Find the zero of guard ``g``, and put the state there in place of that at the start; verdicts as in `several_modes`."""
    for l in range(full):
        W[AT_TAU + l], W[AT_SPAN + l] = 0.0, 1.0
    begin, end = W[AT_EY:AT_EY + AT_STATE], W[AT_BY:AT_BY + AT_STATE]
    along(W, m, full, begin, end, mode, forcing)
    crossing(W, full, g, mode, forcing)
    for within in (AT_WITHIN, AT_FINAL):
        along(W, m, full, begin, end, mode, forcing)
        refine(W, full, g, within, mode, forcing)
    for l in range(full):
        W[AT_EY + {k} * AT_CAP + l] = W[AT_LE + {k} * AT_CAP + l]


@leaf
def onward(W, m, full, mode, forcing):
    """Take states at s to the end of the substep in mode ``m``; write their fate, see `admit`."""
    for l in range(full):
        W[AT_TAU + l], W[AT_SPAN + l] = W[AT_LS + l], 1.0 - W[AT_LS + l] / mode.h
    along(W, m, full, W[AT_LY:AT_LY + AT_STATE], W[AT_LE:AT_LE + AT_STATE], mode, forcing)
    for g in range(mode.count):
        admit(W, full, g, mode, forcing)


'''
