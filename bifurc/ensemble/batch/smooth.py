"""Batch of one or two degrees of freedom under laws: Runge-Kutta steps of fixed length, the laws' own text inside.

Starts are independent, so that the steps of many of them are in flight at once and the chain of a method's stages costs
nothing.  The number of steps is measured, not assumed: see `steps_for`.  Guards and events are those of `law_modes`.
"""
import numpy as np

from ...compose.lawtext import LawError, standalone
from ...compose.pieces import FORCE
from ...compose.scene import Scene
from ...compose.tables import Tables
from ...compose.writer import bind
from ..initial_conditions import begin
from .law_modes import Acts, Kind, modes_text, pattern_of, seen, step_numbers
from .packing import Numbers, fits
from .writing import written

MOST_STEPS = 640  # of a period: beyond, steps whose length follows the motion cost less
MOST_MASSES, MOST_MODES, MOST_GUARDS = 2, 16, 4
COARSE = 12  # steps tried first
SAMPLE = 128  # starts from which the error is measured
PAYS = 10000  # forcing periods, over all starts, that cost about as much as that measurement
WISH = 1e-9  # error of one period, in units of the region: far below the radius of an attractor


def kind_of(scene: Scene, order: int = 8) -> Kind | None:
    """Return what batch a scene needs, by a method of an `nystrom` order, None when it has none: see `fits`, curved sites, guards
    that are laws."""
    T, n = scene.tables, scene.n
    if scene.closed_form or not fits(scene, MOST_MASSES, MOST_MODES, MOST_GUARDS):
        return None
    if any(law.stage != FORCE or law.curved for law in scene.laws):
        return None
    U, S = seen(T)
    if np.any(U[:, n:2 * n]) or np.any(S[:, :n]):
        return None
    try:
        laws = "\n\n".join(standalone(law.law.function, f"law_{i}") for i, law in enumerate(scene.laws))
        if T.n_guards.max():
            bind(scene)  # what is deferred is integrated by the compiled laws
    except LawError:
        return None
    acts = [Acts(tuple(np.flatnonzero(T.acts[m]).tolist()), pattern_of(T.LP[m])) for m in range(len(T.n_guards))]
    known = tuple(dict.fromkeys(acts))
    moving = tuple((which, r) for which, rows in enumerate((U, S)) for r in range(len(U)) if np.any(rows[r, 2 * n:]))
    return Kind(order, n, laws, tuple(law.rows for law in scene.laws), tuple(len(law.law.values) for law in scene.laws),
                pattern_of(U[:, :n]), pattern_of(S[:, n:2 * n]), moving, known,
                tuple(map(known.index, acts)), int(T.n_guards.max()))


def numbers_of(T: Tables, kind: Kind, steps: int) -> Numbers:
    """Return what the kernels read; ``steps`` a period."""
    return Numbers(T, *step_numbers(T, kind, steps))


def module_of(kind: Kind):
    """Return the written module of a kind."""
    return written(modes_text(kind), laws=True)


def images(scene: Scene, kind: Kind, steps: int, X: np.ndarray, periods: int = 1) -> np.ndarray:
    """Return the starts ``X`` (N, ns) carried over forcing periods; NaN where the motion is lost or no start is clear."""
    Y, T = np.array(X, float, order="C"), scene.tables
    codes, impacts = (np.full(len(Y), value, np.int64) for value in (6, 0))
    modes = np.empty(len(Y), np.int64)
    begin(T, np.array(list(scene.start_modes()), np.int64), Y, modes)
    module_of(kind).propagate(numbers_of(T, kind, steps), modes, Y, 2000, periods, codes, impacts, np.full(len(Y), np.inf))
    Y[codes != 0] = np.nan
    return Y


def region(scene: Scene, kind: Kind) -> np.ndarray:
    """Return sizes (ns,) of coordinates and velocities where the scene lives: what starts from rest, and near it, come to."""
    omega, n = float(scene.tables.flat[0]), scene.n
    unit, size = np.repeat([1.0, omega], n), 0.0
    starts = np.zeros((1, 2 * n))
    for fine in (512, 256):
        met = [starts := images(scene, kind, fine, starts, 8) for _ in range(5)]
        found = np.abs(np.concatenate(met)) / unit
        size = max(size, float(found[np.isfinite(found).all(axis=1)].max(initial=0.0)))
        starts = np.random.default_rng(0).uniform(-2.0, 2.0, (SAMPLE, 2 * n)) * (size or 1.0) * unit
    return (1.5 * size or 1.0) * unit


def steps_for(scene: Scene, kind: Kind, wish: float = WISH) -> tuple[int, float]:
    """Return steps a period with which the error of one period is at most ``wish``, and that error.

    The error is that of starts in the `region` and of their images after one period, in units of the region, against twice as many
    steps; its 99th percentile counts, since a step count for the rarest start would be paid by all.

    Raises
    ------
    ArithmeticError
        When `MOST_STEPS` do not suffice.
    """
    steps, scale = COARSE, region(scene, kind)
    starts = np.random.default_rng(1).uniform(-1.0, 1.0, (SAMPLE, scale.size)) * scale
    starts = np.concatenate((starts, images(scene, kind, 4 * COARSE, starts)))
    starts = starts[np.isfinite(starts).all(axis=1)]
    near = images(scene, kind, steps, starts)
    while steps <= MOST_STEPS:
        twice = images(scene, kind, 2 * steps, starts)
        away = np.abs((near - twice) / scale).max(axis=1)[np.isfinite(twice).all(axis=1)]
        away[np.isnan(away)] = np.inf
        error = float(np.quantile(away, 0.99, method="higher")) if away.size else np.inf
        if error <= wish:
            return steps, error
        rate = min(1.05 * (error / wish) ** (1.0 / kind.order), 2.0) if np.isfinite(error) else 2.0
        steps = max(int(np.ceil(steps * rate)), steps + 1)
        near = twice if rate == 2.0 else images(scene, kind, steps, starts)
    raise ArithmeticError(f"{MOST_STEPS} steps a period leave an error of {error:.1e} where {wish:g} is asked for")
