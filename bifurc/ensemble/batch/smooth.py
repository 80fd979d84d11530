"""Batch of one degree of freedom under smooth laws: Runge-Kutta steps of fixed length, the law's own text inside.

Its starts are independent, so that the steps of many of them are in flight at once and the chain of a method's stages costs
nothing.  The number of steps is measured, not assumed: see `measured`.
"""
from typing import NamedTuple

import numpy as np

from ...compose.lawtext import LawError, standalone
from ...compose.scene import Scene
from ...compose.tables import Tables
from .packing import MOST_HARMONICS, Numbers
from .runge_kutta import Method, nystrom
from .writing import SIZE, written

BLOCK = 64  # starts are taken in whole blocks: the same vector code for each of them
MOST_STEPS = 20000  # of a period
COARSE = 12  # steps tried first
SAMPLE = 128  # starts from which the error is measured
WISH = 1e-9  # error of one period, in units of the region: far below the radius of an attractor


class Kind(NamedTuple):
    """What the written module depends on."""

    method: Method
    laws: str  # their text
    rows: tuple[int, ...]  # of every law
    values: tuple[int, ...]  # parameters of every law
    plain: bool  # every law sees coordinate and velocity themselves, and its force is the acceleration


def kind_of(scene: Scene, method: Method = Method.RK8) -> Kind | None:
    """Return what batch a scene needs, None when it has none: it has more than one mode, guards, or memory."""
    T = scene.tables
    if scene.n != 1 or scene.ns != 2 or scene.closed_form or not scene.complete or scene.period is None:
        return None
    if len(T.n_guards) != 1 or T.n_guards[0] or T.n_holds[0] or len(scene.harmonics) > MOST_HARMONICS:
        return None
    if np.any(T.LU[:, 1:]) or np.any(T.LS[:, :1]) or np.any(T.LS[:, 2:]):  # the site moves
        return None
    try:
        laws = "\n\n".join(standalone(law.law.function, f"law_{i}") for i, law in enumerate(scene.laws))
    except LawError:
        return None
    plain = bool(np.all(T.LU[:, 0] == 1.0) and np.all(T.LS[:, 1] == 1.0) and np.all(T.LP == 1.0))
    return Kind(method, laws, tuple(law.rows for law in scene.laws), tuple(len(law.law.values) for law in scene.laws), plain)


def numbers_of(T: Tables, kind: Kind, steps: int) -> Numbers:
    """Return what the kernels read; ``steps`` a period."""
    method, omega = nystrom(kind.method), float(T.flat[0])
    h = 2.0 * np.pi / omega / steps
    c = method.c
    position, velocity = np.tril(method.position, -1), np.tril(method.velocity, -1)
    numbers = [h, T.A[0, 1, 0], T.A[0, 1, 1], *(h * c), *(h * h * position).ravel(), *(h * velocity).ravel(),
               *(h * h * method.last_position), *(h * method.last_velocity), *T.law, *T.LU[:, 0], *T.LS[:, 1], *T.LP[0, :, 0]]
    times = 2.0 * np.pi * (np.arange(steps)[:, None] + c) / steps
    grid = np.full(times.shape, T.A[0, 1, 2])
    for i, k in enumerate(T.harmonics):
        grid += T.A[0, 1, 3 + 2 * i] * np.cos(k * times) + T.A[0, 1, 4 + 2 * i] * np.sin(k * times)
    none = np.zeros(1)
    return Numbers(np.zeros((1, 1)), np.zeros((1, 1), np.int64), np.zeros(1, np.int64), none, none, 0, np.array(numbers), grid)


def module_of(kind: Kind):
    """Return the written module of a kind."""
    return written(step_text(kind), 2, 1, 1, None)


def images(T: Tables, kind: Kind, steps: int, X: np.ndarray, periods: int = 1) -> np.ndarray:
    """Return the starts ``X`` (N, 2) carried over forcing periods; NaN where the motion is lost."""
    Y = np.array(X, float, order="C")
    modes, codes, impacts = (np.full(len(Y), value, np.int64) for value in (0, 6, 0))
    module_of(kind).carry(*numbers_of(T, kind, steps), modes, Y, 1, periods, codes, impacts, np.full(len(Y), np.inf))
    Y[codes != 0] = np.nan
    return Y


def region(T: Tables, kind: Kind) -> np.ndarray:
    """Return sizes (2,) of coordinate and velocity where the scene lives: what starts from rest, and near it, come to."""
    omega = float(T.flat[0])
    unit, size = np.array([1.0, omega]), 0.0
    starts = np.zeros((1, 2))
    for fine in (512, 256):
        met = [starts := images(T, kind, fine, starts, 8) for _ in range(5)]
        found = np.abs(np.concatenate(met)) / unit
        size = max(size, float(found[np.isfinite(found).all(axis=1)].max(initial=0.0)))
        starts = np.random.default_rng(0).uniform(-2.0, 2.0, (SAMPLE, 2)) * (size or 1.0) * unit
    return (1.5 * size or 1.0) * unit


def measured(T: Tables, kind: Kind, X: np.ndarray, scale: np.ndarray, wish: float) -> tuple[int, float]:
    """Return steps a period with which the error of one period is at most ``wish``, and that error.

    The error is that of the starts ``X`` (N, 2) and of their images after one period, in units of ``scale`` (2,), against
    twice as many steps; its 99th percentile counts, since a step count for the rarest start would be paid by all.

    Raises
    ------
    ArithmeticError
        When `MOST_STEPS` do not suffice.
    """
    order, steps = nystrom(kind.method).order, COARSE
    starts = np.concatenate((X, images(T, kind, 4 * COARSE, X)))
    starts = starts[np.isfinite(starts).all(axis=1)]
    near = images(T, kind, steps, starts)
    while steps <= MOST_STEPS:
        twice = images(T, kind, 2 * steps, starts)
        away = np.abs((near - twice) / scale).max(axis=1)[np.isfinite(twice).all(axis=1)]
        away[np.isnan(away)] = np.inf
        error = float(np.quantile(away, 0.99, method="higher")) if away.size else np.inf
        if error <= wish:
            return steps, error
        rate = min(1.05 * (error / wish) ** (1.0 / order), 2.0) if np.isfinite(error) else 2.0
        steps = max(int(np.ceil(steps * rate)), steps + 1)
        near = twice if rate == 2.0 else images(T, kind, steps, starts)
    raise ArithmeticError(f"{MOST_STEPS} steps a period leave an error of {error:.1e} where {wish:g} is asked for")


def steps_for(T: Tables, kind: Kind, wish: float = WISH) -> tuple[int, float]:
    """Return steps a period, and the error of one period that is measured with them, for starts in the `region`."""
    scale = region(T, kind)
    starts = np.random.default_rng(1).uniform(-1.0, 1.0, (SAMPLE, 2)) * scale
    return measured(T, kind, starts, scale, wish)


def step_text(kind: Kind) -> str:
    """Return the source of the laws and of ``period_step``.

    ``numbers`` holds step, stiffness and damping rates, then the method's coefficients times powers of the step, then
    parameters of the laws, what their rows see of coordinate and velocity, and their accelerations per force.
    """
    method = nystrom(kind.method)
    stages, rows = len(method.c), sum(kind.rows)
    place = {}
    at = 3
    for name, size in (("c", stages), ("p", stages * stages), ("v", stages * stages), ("lp", stages), ("lv", stages),
                       ("law", sum(kind.values)), ("u", rows), ("s", rows), ("m", rows)):
        place[name], at = at, at + size
    head, body = ["h, kq, kv = numbers[0], numbers[1], numbers[2]"], []
    number = lambda name, i: f"numbers[{place[name] + i}]"  # noqa: E731
    for i in range(sum(kind.values)):
        head.append(f"w{i} = {number('law', i)}")
    if not kind.plain:
        head += [f"{name}{i} = {number(name, i)}" for name in ("u", "s", "m") for i in range(rows)]

    known: dict[tuple[str, float], str] = {}

    def factor(name: str, weight: float, i: int) -> str:
        """Name a coefficient; equal ones share a name, so that equal products are formed once."""
        kind_of_power = {"p": "lp", "v": "lv"}.get(name, name)
        if (kind_of_power, weight) not in known:
            known[kind_of_power, weight] = f"{name}_{i}"
            head.append(f"{name}_{i} = {number(name, i)}")
        return known[kind_of_power, weight]

    def summed(start: str, name: str, weights: np.ndarray, offset: int) -> str:
        for j, weight in enumerate(weights.tolist()):
            if weight != 0.0:
                start = f"{start} + {factor(name, weight, offset * stages + j)} * f{j}"
        return start

    known["c", 1.0] = "h"
    for i in range(stages):
        if i == 0:
            body.append("xs, vs = x, v")
        else:
            start = f"x + {factor('c', float(method.c[i]), i)} * v"
            body.append(f"xs = {summed(start, 'p', method.position[i, :i], i)}")
            body.append(f"vs = {summed('v', 'v', method.velocity[i, :i], i)}")
        body.append(f"f{i} = {_force(kind, f'g{i}')}")
    body.append(f"W[Q + l] = {summed('x + h * v', 'lp', method.last_position, 0)}")
    body.append(f"W[V + l] = {summed('v', 'lv', method.last_velocity, 0)}")
    forces = "\n".join(f"        g{i} = grid[k, {i}]" for i in range(stages))
    return f'''from bifurc._jit import _compiled


{kind.laws}

def period_step(W, index, count, P, numbers, grid, I, modes, limit):
    """Take starts over a forcing period by Runge-Kutta steps."""
    Q, V, HITS, LEAST, ASIDE = 0, {SIZE}, {4 * SIZE}, {5 * SIZE}, {6 * SIZE}
{chr(10).join(f"    {line}" for line in dict.fromkeys(head))}
    for l in range(count):
        W[HITS + l] = 0.0
        W[LEAST + l] = np.inf
        W[ASIDE + l] = 0.0
    full = (count + {BLOCK - 1}) // {BLOCK} * {BLOCK}
    for k in range(grid.shape[0]):
{forces}
        for l in range(full):
            x, v = W[Q + l], W[V + l]
{chr(10).join(f"            {line}" for line in body)}


# Products and sums are fused here: no sign is tested between the ends of a period.
period_step = _compiled(period_step, fastmath={{"contract"}})
'''


def _force(kind: Kind, load: str) -> str:
    """Return the acceleration at (xs, vs) under the load of the excitation."""
    text = f"kq * xs + (kv * vs + {load})"
    row = value = 0
    for i, (rows, values) in enumerate(zip(kind.rows, kind.values, strict=True)):
        own = range(row, row + rows)
        seen = [*("xs" if kind.plain else f"u{r} * xs" for r in own), *("vs" if kind.plain else f"s{r} * vs" for r in own)]
        call = f"law_{i}({', '.join([*seen, *(f'w{value + k}' for k in range(values))])})"
        if kind.plain and rows == 1:
            text = f"{text} + {call}"
        elif rows == 1:
            text = f"{text} + m{row} * {call}"
        else:
            text = text + "".join(f" + {'' if kind.plain else f'm{r} * '}{call}[{r - row}]" for r in own)
        row, value = row + rows, value + values
    return text
