"""Taylor tables against the matrix exponential, their steps, and the bound on fourth derivatives of guards."""
import copy

import numpy as np
import pytest
from scipy.linalg import expm

from bifurc import elements as el
from bifurc import systems
from bifurc.compose import scene_of
from bifurc.compose.tables import ORDER, rebuild
from bifurc.system import System

SCENES = {
    "impact oscillator": systems.impact_oscillator(omega=1.5),
    "undamped at resonance": systems.impact_oscillator(omega=1.0, zeta=0.0),
    "overdamped": systems.impact_oscillator(zeta=3.0),
    "free mass": systems.bouncing_ball(),
    "stiff stop": systems.bilinear_oscillator(stiffness_ratio=1e10),
    "chain": systems.impact_chain(),
    "autonomous": System(1.0, 0.1, 2.0, [el.RigidStop(0.5)]),
    "high harmonics": System(1.0, 0.1, 2.0, [el.HarmonicForce(0.3, harmonic=7), el.RigidStop(0.5)], omega=0.4),
    "nothing moves": System(1.0, 0.0, 0.0, [el.RigidStop(0.5)]),
}
each = pytest.mark.parametrize("system", SCENES.values(), ids=SCENES.keys())


def joined(scene, mode):
    """Return the matrix of x' = A x, forcing states included."""
    bottom = np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])
    return np.vstack([scene.tables.A[mode], bottom])


@each
def test_a_step_is_the_matrix_exponential(system):
    scene = scene_of(system)
    T = scene.tables
    for m in range(len(scene.keys)):
        h = T.step[m]
        exact = expm(joined(scene, m) * h)
        scale = np.ones(scene.ns + scene.nw)  # velocities in units of the fastest rate: what the truncation is small in
        scale[scene.n:scene.ns] = 1.0 / max(1.0, np.sqrt(np.abs(T.A[m]).max()))
        error = scale[:scene.ns, None] * (T.E[m] - exact[:scene.ns]) / scale
        assert np.abs(error).max() < 5e-15
        for k, harmonic in enumerate(scene.harmonics):
            angle = harmonic * scene.omega * h
            assert T.turn[m, 1 + 2 * k:3 + 2 * k] == pytest.approx([np.cos(angle), np.sin(angle)], abs=1e-16)


@each
def test_taylor_rows_are_the_derivatives(system):
    scene = scene_of(system)
    T = scene.tables
    for m in range(len(scene.keys)):
        X = joined(scene, m)
        rows, guards = np.eye(scene.ns, scene.ns + scene.nw), T.G[m, :T.n_guards[m]]
        for j in range(ORDER + 1):
            assert T.YT[m, :, :, j] == pytest.approx(rows, rel=1e-12, abs=1e-300)
            assert T.GT[m, :T.n_guards[m], :, j] == pytest.approx(guards, rel=1e-12, abs=1e-300)
            rows, guards = rows @ X / (j + 1), guards @ X / (j + 1)


@each
@pytest.mark.parametrize("changed", ["frequency", "stiffness", "gap"])
def test_rows_that_stand_are_those_of_new_tables(system, changed):
    """Where the frequency alone has changed only the columns of the harmonics are made again: nothing is left of the numbers
    before, whatever has changed since."""
    scene = scene_of(system)
    T = copy.deepcopy(scene.tables)
    if changed == "frequency":
        T.flat[0] *= 1.37
    elif changed == "stiffness":
        T.A[:, scene.n:2 * scene.n, :scene.n] *= 1.21
    else:
        T.G[:, :, scene.ns] += 0.125
    rebuild(T)
    new = copy.deepcopy(T)
    for name in ("YT", "GT", "E", "G4", "F", "turn", "step"):
        getattr(new, name)[:] = np.nan
    for m in range(len(new.n_guards)):  # of derivatives that vanish, and of places without a guard
        new.GT[m, new.n_guards[m]:] = T.GT[m, new.n_guards[m]:]
        new.G4[m, new.n_guards[m]:] = T.G4[m, new.n_guards[m]:]
    rebuild(new)
    for name in ("YT", "GT", "E", "G4", "F", "turn", "step"):
        assert np.array_equal(getattr(T, name), getattr(new, name)), name
    omega = T.flat[0]
    for m in range(len(scene.keys)):
        X = joined(scene, m)
        X[:scene.ns] = T.A[m]
        for k, harmonic in enumerate(scene.harmonics):
            c = scene.ns + 1 + 2 * k
            X[c, c + 1], X[c + 1, c] = -harmonic * omega, harmonic * omega
        rows, guards = np.eye(scene.ns, scene.ns + scene.nw), T.G[m, :T.n_guards[m]]
        for j in range(ORDER + 1):
            assert T.YT[m, :, :, j] == pytest.approx(rows, rel=1e-12, abs=1e-300)
            assert T.GT[m, :T.n_guards[m], :, j] == pytest.approx(guards, rel=1e-12, abs=1e-300)
            rows, guards = rows @ X / (j + 1), guards @ X / (j + 1)


@each
def test_steps_divide_the_period_and_turn_by_less_than_a_radian(system):
    scene = scene_of(system)
    for m, h in enumerate(scene.tables.step):
        assert h > 0.0
        if scene.period is not None:
            assert scene.period / h == pytest.approx(round(scene.period / h), rel=1e-12)
        assert np.abs(np.linalg.eigvals(joined(scene, m))).max() * h <= 0.8 * (1 + 1e-12)


@each
def test_fourth_derivatives_of_guards_are_bounded(system, rng):
    """The cubic Hermite polynomial of a guard on a step errs by at most G4 |x|: sampled densely, random states."""
    scene = scene_of(system)
    T, ns = scene.tables, scene.ns
    s = np.linspace(0.0, 1.0, 41)
    for m in range(len(scene.keys)):
        h, X = T.step[m], joined(scene, m)
        flows = [expm(X * h * part) for part in s]
        for g in range(T.n_guards[m]):
            for _ in range(5):
                x = rng.normal(size=ns + scene.nw)
                phase = rng.uniform(0.0, 6.3)
                waves = [f(k * phase) for k in scene.harmonics for f in (np.cos, np.sin)]
                x[ns:] = [1.0, *waves]
                value = np.array([T.G[m, g] @ flow @ x for flow in flows])
                slope = h * np.array([T.G[m, g] @ X @ flows[0] @ x, T.G[m, g] @ X @ flows[-1] @ x])
                cubic = (value[0] * (1 + 2 * s) * (1 - s)**2 + value[-1] * (3 - 2 * s) * s**2
                         + slope[0] * s * (1 - s)**2 - slope[1] * (1 - s) * s**2)
                bound = T.G4[m, g] @ np.abs(x)
                assert np.abs(cubic - value).max() <= bound + 1e-13 * np.abs(value).max()


def test_a_deep_copy_shares_nothing_and_a_copy_everything():
    scene = scene_of(systems.impact_oscillator())
    T = scene.tables
    deep, shallow = copy.deepcopy(T), copy.copy(T)
    for name in T.layout:
        own = getattr(T, name)
        if name == "bound" or not own.size:
            continue
        assert np.array_equal(getattr(deep, name), own) and not np.shares_memory(getattr(deep, name), own), name
        assert np.shares_memory(getattr(shallow, name), own), name
