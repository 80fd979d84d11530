"""Modal coordinates against the matrix exponential: turns of any length, derivatives, series, blocks that have no eigenvectors."""
import math

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.modal import give_modal, separated
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import ORDER
from bifurc.elements import HarmonicForce, RigidStop
from bifurc.flow.modal import engine, states, steps


def system(kind):
    rng, n = np.random.default_rng(5), 5
    M = np.eye(n) + 0.1 * (lambda a: a @ a.T)(rng.normal(size=(n, n)))
    K = np.diag([3.0, 1.0, 6.0, 40.0, 2.0]) + 0.2 * rng.normal(size=(n, n))
    C = 0.1 * np.eye(n) + 0.05 * rng.normal(size=(n, n))
    if kind == "overdamped":
        C = C + np.diag([9.0, 0.0, 8.0, 0.0, 0.0])
    if kind == "free":
        K, C = np.zeros((n, n)), np.zeros((n, n))
        K[:2, :2] = [[2.0, -1.0], [-1.0, 2.0]]
        M = np.eye(n)
    return bf.System(M, C, K, [HarmonicForce(0.7, phase=0.4), HarmonicForce(0.2, 3, 0.3, dof=2), RigidStop(50.0, dof=1)], omega=1.3)


@pytest.fixture(scope="module", params=["plain", "overdamped", "free"])
def modes(request):
    scene = scene_of(system(request.param))
    give_modal(scene.tables)
    m = next(m for m in range(len(scene.keys)) if scene.tables.n_holds[m] == 0)
    A = np.vstack([scene.tables.A[m], np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])])
    assert scene.tables.blocks[m, 3] > 0
    return scene, m, A


def starts(scene, rng, count=3):
    for _ in range(count):
        yield np.concatenate([rng.normal(size=scene.ns), scene.forcing(rng.uniform(0.0, 9.0, 1))[0]])


def test_coordinates_there_and_back(modes, rng):
    scene, m, A = modes
    T = scene.tables
    assert T.V[m] @ T.L[m] == pytest.approx(np.eye(len(A)), abs=1e-9)
    for x in starts(scene, rng):
        xi, y = np.empty(x.size), np.empty(x.size)
        steps.to_modal(T, m, x, xi)
        steps.from_modal(T, m, xi, y)
        assert xi == pytest.approx(T.L[m] @ x, abs=1e-11) and y == pytest.approx(x, abs=1e-10)


@pytest.mark.parametrize("unit", [1e-5, 1.0, 1e5])
def test_the_series_of_one_mode_are_good_to_a_bound_over_its_eigenvalue(unit):
    """The first term left out is (|lambda| t)^(ORDER+1)/(ORDER+1)! of the motion: lengths of steps differ by the root of two."""
    slow = system("plain")
    scene = scene_of(bf.System(slow.mass, unit * slow.damping, unit**2 * slow.stiffness, slow.elements, omega=1.3 * unit))
    give_modal(scene.tables)
    T, m = scene.tables, next(m for m in range(len(scene.keys)) if scene.tables.n_holds[m] == 0)
    A = np.vstack([T.A[m], np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])])
    values, vectors = np.linalg.eig(A)
    levels, pairs, seen = T.level[m, :T.blocks[m, 3]], int(T.blocks[m, 0]), 0
    for value, vector in zip(values, vectors.T, strict=True):
        if np.abs(vector[scene.ns:]).max() > 1e-9 * np.abs(vector).max():  # what the load does
            continue
        x = np.ascontiguousarray(vector.real)
        bound = (steps.TRUNCATED * math.factorial(ORDER + 1))**(1.0 / (ORDER + 1)) / abs(value)
        found = states.modal_reach(T, m, x)
        assert found in levels and (found <= bound * (1.0 + 1e-9) or found == levels[0])
        assert found * math.sqrt(2.0) >= bound * (1.0 - 1e-9)
        seen += levels[0] < found
    assert pairs >= 5 and seen >= 6


def test_amplitudes_are_moduli_of_pairs(modes, rng):
    """The pairs of oscillating modes come first; what else there is counts by itself."""
    scene, m, _ = modes
    pairs, x, size = int(scene.tables.blocks[m, 0]), rng.normal(size=scene.ns + scene.nw), np.full(scene.ns + scene.nw, np.nan)
    steps.amplitudes(scene.tables, m, x, size)
    assert pairs > 0
    assert size[:2 * pairs:2] == pytest.approx(np.abs(x[:2 * pairs:2] + 1j * x[1:2 * pairs:2]), rel=1e-14)
    assert not size[1:2 * pairs:2].any() and size[2 * pairs:] == pytest.approx(np.abs(x[2 * pairs:]))


def test_a_step_is_the_longest_whose_series_is_good(modes, rng):
    """The next level, longer by the root of 2, would be wrong by more; where none is good the first, where all are the last one."""
    scene, m, _ = modes
    T = scene.tables
    levels = T.level[m, :T.blocks[m, 3]]
    for s in np.exp(rng.uniform(np.log(levels[0]), np.log(levels[-1]), 40)):
        k = steps.level_of(T, m, s**(ORDER + 1))
        assert levels[k] <= s * (1.0 + 1e-12) and (k + 1 == len(levels) or levels[k + 1] > s * (1.0 - 1e-12))
    assert steps.level_of(T, m, 0.0) == steps.level_of(T, m, (0.5 * levels[0])**(ORDER + 1)) == 0
    assert steps.level_of(T, m, np.inf) == steps.level_of(T, m, (3.0 * levels[-1])**(ORDER + 1)) == len(levels) - 1


@pytest.mark.parametrize("span", [0.0, 0.3, 2.0, 7.7])
def test_turns_are_the_matrix_exponential(modes, rng, span):
    scene, m, A = modes
    T, E = scene.tables, expm(A * span)
    size = np.abs(E).max()
    for x in starts(scene, rng):
        xi, y = T.L[m] @ x, np.empty(x.size)
        steps.turn(T, m, span, xi)
        steps.from_modal(T, m, xi, y)
        assert y == pytest.approx(E @ x, abs=1e-10 * size * np.abs(x).max())
        y1, Phi = np.empty(scene.ns), np.empty((scene.ns, scene.ns))
        states.modal_arc(T, m, x, span, y1, Phi)
        assert y1 == pytest.approx((E @ x)[:scene.ns], abs=1e-10 * size * np.abs(x).max())
        assert Phi == pytest.approx(E[:scene.ns, :scene.ns], abs=1e-10 * size)


def test_steps_of_levels(modes, rng):
    scene, m, A = modes
    T = scene.tables
    short = np.flatnonzero(T.level[m, :int(T.blocks[m, 3])] < 20.0)  # a longer turn has the rounding of its angle
    for level in {0, int(short[-1]) // 2, int(short[-1])}:
        for x in starts(scene, rng, 2):
            xi, y = T.L[m] @ x, np.empty(x.size)
            steps.turn_level(T, m, level, xi)
            steps.from_modal(T, m, xi, y)
            E = expm(A * T.level[m, level])
            assert y == pytest.approx(E @ x, abs=1e-9 * np.abs(E).max() * np.abs(x).max())


def test_series_of_states_hold_as_far_as_they_reach(modes, rng):
    scene, m, A = modes
    T, a = scene.tables, np.empty(ORDER + 1)
    for x in starts(scene, rng):
        reach = states.modal_reach(T, m, x)
        assert reach in T.level[m]
        later = expm(A * reach) @ x
        for i in range(scene.ns):
            states.modal_state_series(T, m, i, x, a)
            rows = [x[i], (A @ x)[i], 0.5 * (A @ A @ x)[i], (A @ A @ A @ x)[i] / 6.0]
            assert a[:4] == pytest.approx(rows, abs=1e-9 * max(1.0, np.abs(rows).max()))
            assert np.polyval(a[::-1], reach) == pytest.approx(later[i], abs=1e-9 * max(1.0, np.abs(later).max()))


def test_guards_over_modes_are_those_of_the_tables(modes, rng):
    scene, m, A = modes
    T = scene.tables
    for g in range(T.n_guards[m]):
        for x in starts(scene, rng, 2):
            xi = T.L[m] @ x
            row = T.G[m, g]
            for j in range(4):
                value = row @ np.linalg.matrix_power(A, j) @ x / np.prod(np.arange(1.0, j + 1))
                assert T.GS[m, g, :, j] @ xi == pytest.approx(value, abs=1e-8 * max(1.0, abs(value)))


def test_what_has_no_modal_coordinates():
    still = scene_of(bf.System(np.eye(5), np.zeros((5, 5)), np.zeros((5, 5)), [RigidStop(1.0)]))
    few = scene_of(bf.System(np.eye(4), np.eye(4), np.eye(4), [RigidStop(1.0)]))
    assert few.tables.V.size == 0 and still.tables.V.size
    m = still.index(("free",))
    assert separated(still.tables, m) is None
    give_modal(still.tables)
    assert still.tables.blocks[m, 3] == -1


def test_a_touch_at_the_start_is_no_maximum_beyond_it(modes, rng):
    """The guard and its rate are zero there to rounding, of whatever sign, and its second derivative is negative."""
    scene, m, A = modes
    T, (g,) = scene.tables, [g for g in range(int(scene.tables.n_guards[m])) if scene.tables.kick[m, g]]
    row, rate = T.G[m, g], T.G[m, g] @ A
    tried = 0
    for x in starts(scene, rng, 12):
        both = np.vstack((row, rate))
        free = both[:, :scene.ns]
        for noise in (1e-12, -1e-12):
            y = x.copy()
            y[:scene.ns] += np.linalg.lstsq(free, [noise, noise] - both @ y, rcond=None)[0]
            bend = rate @ A @ y
            if bend < -1e-2:
                tried += 1
                value, _ = engine.segment_peak(T, m, g, y, 1e-3, 1, 2)
                assert value == -np.inf
    assert tried > 4


def test_coasting_from_a_surface_ends_before_it_is_reached_again(modes, rng):
    """The zero at the start is divided out of the first step alone; the state is that of the matrix exponential."""
    scene, m, A = modes
    T, (g,) = scene.tables, [g for g in range(int(scene.tables.n_guards[m])) if scene.tables.kick[m, g]]
    both = np.vstack((T.G[m, g], T.G[m, g] @ A))
    inner, count = expm(A * 0.02), 1000
    returns = 0
    for x in starts(scene, rng, 40):
        x[:scene.ns] *= 200.0
        x[:scene.ns] += np.linalg.lstsq(both[:, :scene.ns], [0.0, -8.0] - both @ x, rcond=None)[0]
        values, z = [], x.copy()
        for _ in range(count):
            z = inner @ z
            values.append(T.G[m, g] @ z)
        beyond = np.flatnonzero(np.array(values) > 0.0)
        first = 0.02 * (beyond[0] + 1) if beyond.size else np.inf
        y, orders, slopes = x.copy(), np.zeros(int(T.n_guards[m]), np.int64), np.full(int(T.n_guards[m]), np.nan)
        orders[g], slopes[g] = 1, -8.0
        done = steps.modal_coast(T, m, y, 0.02 * count, orders, slopes)
        assert done < first and y == pytest.approx(expm(A * done) @ x, abs=1e-9 * np.abs(x).max())
        returns += bool(beyond.size) and done > 0.0
    assert returns > 3
