"""Starts side by side under laws: against an independent integration, the scalar integrator, simulations; labels of a basin."""
import ast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.basins import Kernel, PeriodMap
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.ensemble.batch import law_modes, smooth
from bifurc.ensemble.integrator import Cells, Integrator, Targets

e = bf.elements
FORCE = e.HarmonicForce(1.0)


def chain(n, *elements, omega=1.3):
    """A chain of unit masses and springs, forced at its first mass."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return bf.System(np.eye(n), 0.05 * K + 0.02 * np.eye(n), K, [e.HarmonicForce(1.0, dof=0), *elements], omega=omega)


SCENES = {
    "cubic spring and stop": bf.System(1.0, 0.1, 1.0, [FORCE, e.CubicSpring(0.5), e.RigidStop(0.6, 0.7)], omega=1.2),
    "Stribeck friction on a belt": bf.System(1.0, 0.05, 1.0, [
        e.HarmonicForce(0.3), e.Stribeck(kinetic=0.5, static=1.0, speed=0.4, belt_speed=0.3)], omega=2.0),
    "cubic spring and two stops": bf.System(1.0, 0.1, 1.0, [FORCE, e.CubicSpring(0.5), e.RigidStop(0.6, 0.7),
                                                            e.RigidStop(0.8, 0.6, side=-1)], omega=1.2),
    "two masses, cubic coupling and stop": chain(2, e.CubicSpring(0.5, row=(-1.0, 1.0)), e.RigidStop(0.6, 0.7)),
    "two masses, one under Stribeck friction": chain(2, e.Stribeck(kinetic=0.2, static=0.3, speed=0.4, dof=1)),
}
SMOOTH = chain(2, e.CubicSpring(0.5, dof=0), e.CubicSpring(0.5, row=(-1.0, 1.0)))
slow = pytest.mark.slow  # each kind of scene compiles a kernel of its own
NAMES = [name if name in ("cubic spring and stop", "two masses, one under Stribeck friction") else pytest.param(name, marks=slow)
         for name in SCENES]


def alone(integrator, X, periods):
    """Carry starts by the scalar integrator alone; return states, outcomes, impacts, least speeds."""
    Y = X.copy()
    T, modes = integrator.begin(Y)
    scalar = kernels(integrator.scene, "bifurc.ensemble.scalar")
    codes, impacts, speeds = np.full(len(Y), 6), np.zeros(len(Y), np.int64), np.full(len(Y), np.inf)
    scalar.map_starts(T, integrator._followers(T), integrator._candidates, modes, Y, 2000, periods, codes, impacts, speeds)
    return Y, codes, impacts, speeds


@pytest.mark.parametrize("name", SCENES)
def test_names_of_a_written_step_mean_one_thing(name):
    """What a function of the text loads before its loop over starts, it loads once and the loop leaves alone."""
    tree = ast.parse(law_modes.modes_text(smooth.kind_of(scene_of(SCENES[name]))))

    def named(statements):
        return [node.id for line in statements if isinstance(line, ast.Assign) for node in ast.walk(line)
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]

    functions = [part for part in tree.body if isinstance(part, ast.FunctionDef) and part.name.startswith(("fixed_", "along_"))]
    for function in functions:
        before, loop = named(function.body), next(line for line in function.body if isinstance(line, ast.For))
        assert len(set(before)) == len(before) and not set(before) & set(named(loop.body))


@pytest.mark.parametrize("name", NAMES)
def test_the_batch_agrees_with_the_scalar_integrator(name, rng):
    """One period: same impacts, states to the error that was measured for the steps; a start that all but grazes may differ."""
    period_map = PeriodMap(SCENES[name])
    assert period_map.kernel == Kernel.SMOOTH
    X = rng.uniform(-0.55, 0.55, (1500, period_map.scene.ns))
    X[:, period_map.scene.n:] *= 2.0
    found, (ends, codes, impacts, speeds) = period_map.apply(X), alone(period_map._integrator, X, 1)
    done = codes == 0
    assert done.mean() > 0.9
    np.testing.assert_array_equal(found.outcomes[done], 0)
    assert np.count_nonzero(found.impacts[done] != impacts[done]) <= 1
    error = np.abs(found.ends - ends)[done].max(axis=1)
    assert np.quantile(error, 0.99) <= 1e-8 and np.median(error) <= 1e-9
    same = done & (found.impacts == impacts) & np.isfinite(speeds)
    if same.any():
        assert np.quantile(np.abs(found.speeds[same] - speeds[same]), 0.99) <= 1e-8


def test_a_cubic_spring_with_a_stop_against_an_integration_with_events(rng):
    """scipy's method of order 8 at a tolerance of 1e-12, its own search of roots, impacts by hand."""
    period = 2.0 * np.pi / 1.2
    X = rng.uniform((-1.5, -1.5), (0.5, 1.5), (12, 2))

    def rate(t, y):
        return [y[1], np.cos(1.2 * t) - 0.1 * y[1] - y[0] - 0.5 * y[0] ** 3]

    def gap(t, y):
        return y[0] - 0.6

    gap.terminal, gap.direction = True, 1.0
    right, counts = [], []
    for start in X:
        t, y, count = 0.0, start, 0
        while t < period:
            made = solve_ivp(rate, (t, period), y, "DOP853", events=gap, rtol=1e-12, atol=1e-13)
            t, y = made.t[-1], made.y[:, -1].copy()
            if made.status == 1:
                y[:] = 0.6 - 1e-15, -0.7 * y[1]
                count += 1
        right.append(y)
        counts.append(count)
    images = PeriodMap(SCENES["cubic spring and stop"]).apply(X)
    assert max(counts) >= 1
    np.testing.assert_array_equal(images.impacts, counts)
    np.testing.assert_allclose(images.ends, right, rtol=0, atol=5e-9)


def test_two_masses_under_smooth_laws_against_simulations(rng):
    X = rng.uniform(-1.0, 1.0, (12, 4))
    period_map = PeriodMap(SMOOTH)
    assert period_map.kernel == Kernel.SMOOTH and scene_of(SMOOTH).n == 2
    for start, end in zip(X, period_map.apply(X, 3).ends, strict=True):
        np.testing.assert_allclose(end, bf.simulate(SMOOTH, start, periods=3).final, rtol=0, atol=1e-8)


def test_a_stop_that_is_rested_on_while_its_guard_feels_a_law(rng):
    """A slow load presses the mass on the stop; what holds it there feels the cubic spring: the scalar integrator takes over."""
    system = bf.System(1.0, 0.3, 1.0, [e.HarmonicForce(2.0), e.CubicSpring(0.5), e.RigidStop(0.6, 0.3)], omega=0.3)
    period_map, X = PeriodMap(system), rng.uniform(-0.5, 0.5, (20, 2))
    assert period_map.kernel == Kernel.SMOOTH
    images = period_map.apply(X, 2)
    for start, end, impacts, least in zip(X, images.ends, images.impacts, images.speeds, strict=True):
        motion = bf.simulate(system, start, periods=2)
        np.testing.assert_allclose(end, motion.final, rtol=0, atol=1e-8)
        met = [event for event in motion.events if event.kind in ("impact", "chatter")]
        assert impacts == len(met) and least == 0.0
        assert any(event.kind == "chatter" for event in met)


@pytest.mark.parametrize("name", [NAMES[0], pytest.param("two masses, one under Stribeck friction")])
def test_the_image_of_a_start_under_laws_does_not_depend_on_its_company(name, rng):
    """Bit by bit."""
    period_map = PeriodMap(SCENES[name])
    X = rng.uniform(-0.5, 0.5, (700, period_map.scene.ns))
    whole, order = period_map.apply(X, 2), rng.permutation(700)
    for mine, others in zip(whole, period_map.apply(X[order], 2), strict=True):
        np.testing.assert_array_equal(mine[order], others)
    cut = [period_map.apply(part, 2) for part in np.split(X, [1, 8, 37, 513])]
    for mine, parts in zip(whole, zip(*cut, strict=True), strict=True):
        np.testing.assert_array_equal(mine, np.concatenate(parts))


@pytest.mark.parametrize("name", [pytest.param("two masses, cubic coupling and stop", marks=slow),
                                  "two masses, one under Stribeck friction", pytest.param("cubic spring and stop", marks=slow)])
def test_labels_are_those_of_the_scalar_integrator(name, rng):
    """The attractors that starts come to, as targets: every start gets the same label, in the same number of periods."""
    system = SCENES[name]
    integrator = Integrator(scene_of(system), 2000)
    settled = np.unique(np.round(integrator.propagate(rng.uniform(-0.5, 0.5, (1500, integrator.scene.ns)), 200).ends, 5), axis=0)
    points = [settled[0]]
    for point in settled[1:]:
        if min(np.abs(point - other).max() for other in points) > 1e-3:
            points.append(point)
    points = np.array(points[:8])
    targets = Targets(np.ones(integrator.scene.ns), points, np.full(len(points), 1e-8), np.arange(len(points)), 1.0,
                      np.zeros(0, np.uint64), np.zeros(0, np.int64))
    X = rng.uniform(-0.5, 0.5, (300, integrator.scene.ns))
    fast, slowly = integrator.label(X.copy(), targets, 300), Cells.blank(len(X))
    Y = X.copy()
    T, modes = integrator.begin(Y)
    kernels(integrator.scene, "bifurc.ensemble.scalar").label(
        T, integrator._followers(T), integrator._candidates, modes, Y, 2000, 300, targets, slowly)
    told = slowly.states != 6
    assert told.mean() > 0.9 and (slowly.labels[told] >= 0).mean() > 0.98
    np.testing.assert_array_equal(fast.labels[told], slowly.labels[told])
    np.testing.assert_array_equal(fast.periods[told], slowly.periods[told])


def test_impacts_that_all_but_graze_are_met(rng):
    """Between starts without an impact in a period and starts with one lies a graze, wherever a substep has it: closely beyond it
    the stop is met, closely before it is not."""
    period_map = PeriodMap(SCENES["cubic spring and stop"])
    X = rng.uniform(-0.55, 0.55, (600, 2)) * [1.0, 2.0]
    _, codes, impacts, _ = alone(period_map._integrator, X, 1)
    count = 20
    without, hit = (X[(codes == 0) & (impacts == k)][:count] for k in (0, 1))
    assert len(without) == len(hit) == count
    low, high = np.zeros((count, 1)), np.ones((count, 1))  # places on the lines between
    for _ in range(27):
        middle = 0.5 * (low + high)
        beyond = alone(period_map._integrator, without + middle * (hit - without), 1)[2][:, None] > 0
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    for away in (1e-2, 1e-4, 1e-6):
        for place in (low - away, high + away):
            starts = without + place * (hit - without)
            _, codes, impacts, _ = alone(period_map._integrator, starts, 1)
            assert (codes == 0).mean() > 0.9
            np.testing.assert_array_equal(period_map.apply(starts).impacts[codes == 0], impacts[codes == 0])


def test_scenes_without_a_batch_take_the_compiled_scalar_integrator(rng):
    """Three masses under a law, and a law that sees a start in no clear mode: the same images as simulations."""
    system = chain(3, e.CubicSpring(0.5, dof=0), e.RigidStop(0.6, 0.7, dof=2))
    period_map = PeriodMap(system)
    assert period_map.kernel == Kernel.SCALAR
    X = rng.uniform(-0.5, 0.5, (6, 6))
    images = period_map.apply(X, 2)
    for start, end, impacts in zip(X, images.ends, images.impacts, strict=True):
        motion = bf.simulate(system, start, periods=2)
        np.testing.assert_allclose(end, motion.final, rtol=0, atol=1e-11)
        assert impacts == sum(event.kind in ("impact", "chatter") for event in motion.events)
