"""Labels and fractions against a second implementation, closed forms and measured references (specs/global, impact)."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import targets_of
from bifurc.compose.scene import scene_of
from bifurc.ensemble.integrator import Integrator

from .second import SectionMap

A = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
B = {"zeta": 0.05, "omega": 4.25, "amplitude": 1.0, "gap": 0.1, "restitution": 0.8}


def marched(system, starts, periods):
    """States after some periods by the label kernel, with nothing to be near to."""
    ends = starts.copy()
    cells = Integrator(scene_of(system), 2000).label(ends, targets_of([], [], np.ones(starts.shape[1])), periods)
    return ends, cells


def second_of(parameters, kind=np.float64):
    return SectionMap(parameters["zeta"], parameters["omega"], parameters["amplitude"], parameters["gap"],
                      parameters["restitution"], kind)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1.1e-19, reason="the reference needs 80-bit floats")
def test_one_period_of_the_kernel_against_extended_precision():
    starts = bf.Grid(q0=(-2.5, 0, 80), v0=(-3, 3, 80)).starts(1, 2)
    ends, cells = marched(bf.systems.impact_oscillator(**A), starts, 1)
    q, v, hits = second_of(A, np.longdouble)(*starts.T)
    error = np.maximum(abs(ends[:, 0] - q), abs(ends[:, 1] - v)).astype(float)
    assert error.max() <= 1e-13 and np.median(error) <= 2e-15
    inside = hits < 20  # of a complete chattering only the listed impacts are counted
    np.testing.assert_array_equal(cells.impacts[inside], hits[inside])


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1.1e-19, reason="the reference needs 80-bit floats")
@pytest.mark.parametrize("system", [
    bf.systems.impact_oscillator(**A),
    bf.systems.moving_frame_impact_oscillator(**{**A, "amplitude": 1.0 / 2.6**2}),
])
def test_ten_periods_from_three_starts(system):
    starts = np.array([[-1.0, 0.5], [-0.3, 1.2], [-2.0, -1.5]])
    ends, _ = marched(system, starts, 10)
    q, v = starts.T
    step = second_of(A, np.longdouble)
    for _ in range(10):
        q, v, _ = step(q, v)
    np.testing.assert_allclose(ends.T, np.array([q, v], float), rtol=0, atol=1e-12)


@pytest.fixture(scope="module")
def problem_a():
    return bf.basins_of_attraction(bf.systems.impact_oscillator(**A), bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400)))


def test_every_label_of_problem_a_is_right(problem_a, rng):
    assert problem_a.fractions == {0: 0.4286875, 1: 0.5713125, -1: 0.0}
    assert [item.periods for item in problem_a.attractors] == [1, 3]
    np.testing.assert_allclose(problem_a.attractors[0].state, [-0.6575133778, 0.0413666341], rtol=0, atol=1e-10)
    chosen = rng.choice(160000, 1500, replace=False)
    q, v = problem_a.grid.starts(1, 2)[chosen].T
    step = second_of(A)
    third = np.array([[-1.0220227055, 0.2057415990]])
    for _ in range(2):
        third = np.vstack((third, np.array(step(*third[-1:].T)[:2]).T))
    labels = np.full(1500, -1)
    for _ in range(200):
        q, v, _ = step(q, v)
        near_one = np.hypot(q + 0.6575133778, v - 0.0413666341) < 1e-5
        near_three = np.hypot(q[:, None] - third[:, 0], v[:, None] - third[:, 1]).min(axis=1) < 1e-5
        labels = np.where(labels >= 0, labels, np.where(near_one, 0, np.where(near_three, 1, -1)))
        if (labels >= 0).all():
            break
    np.testing.assert_array_equal(problem_a.labels.ravel()[chosen], labels)


def test_the_noise_of_problem_a_is_that_of_a_smooth_boundary(problem_a):
    assert abs(problem_a.noise.exponent - 0.92) <= 0.12
    assert problem_a.label_uncertainty < 1e-11


def test_problem_b_tells_how_far_its_labels_can_be_trusted():
    basins = bf.basins_of_attraction(bf.systems.impact_oscillator(**B), bf.Grid(q0=(-2.4, 0.1, 200), v0=(-3, 3, 200)))
    assert [item.periods for item in basins.attractors] == [1, 5]
    np.testing.assert_allclose(basins.attractors[0].state, [-0.0585717190, 0.0062004494], rtol=0, atol=1e-10)
    assert abs(basins.fractions[0] - 0.442525) <= 0.01  # a quarter of the reference's cells of a fractal map
    assert abs(basins.noise.exponent - 0.077) <= max(0.02, 2.0 * basins.noise.exponent_error)
    assert 0.045 / 1.5 <= basins.label_uncertainty <= 0.045 * 1.5  # measured: double against long double


@pytest.mark.slow
def test_fractions_of_problem_b():
    basins = bf.basins_of_attraction(bf.systems.impact_oscillator(**B), bf.Grid(q0=(-2.4, 0.1, 400), v0=(-3, 3, 400)))
    assert abs(basins.fractions[0] - 0.442525) <= 0.005


@pytest.mark.parametrize(("parameters", "fractions"), [
    ({"omega": 1.5, "amplitude": 0.9}, (0.0628, 0.9372)), ({"omega": 2.5, "amplitude": 2.0}, (0.3128, 0.6872)),
])
def test_free_and_impacting_motion_of_the_reference(parameters, fractions):
    system = bf.systems.impact_oscillator(zeta=0.05, gap=1.0, restitution=0.7, **parameters)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 50), v0=(-4, 4, 50)))
    assert tuple(basins.fractions[k] for k in (0, 1)) == fractions
    assert len(basins.attractors[0].events) == 0 and len(basins.attractors[1].events) == 1


def test_the_linear_oscillator_has_one_basin_and_counts_its_periods():
    """Without events the distance from the orbit is known: E^k y, labelled at the first k inside the radius."""
    zeta, omega = 0.1, 1.3
    system = bf.System(1.0, 2 * zeta, 1.0, [bf.elements.HarmonicForce(1.0)], omega=omega)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 3, 12), v0=(-3, 3, 10)))
    assert basins.fractions == {0: 1.0, -1: 0.0} and basins.label_uncertainty == 0.0
    a = (1 - omega**2) / ((1 - omega**2) ** 2 + (2 * zeta * omega) ** 2)
    b = 2 * zeta * omega / ((1 - omega**2) ** 2 + (2 * zeta * omega) ** 2)
    wd, time = np.sqrt(1 - zeta**2), 2 * np.pi / omega
    away = basins.grid.starts(1, 2) - [a, omega * b]
    count = np.zeros(len(away), int)
    for k in range(1, 200):
        c, s = np.cos(wd * k * time), np.sin(wd * k * time)
        E = np.exp(-zeta * k * time) * np.array([[c + zeta / wd * s, s / wd], [-s / wd, c - zeta / wd * s]])
        near = np.linalg.norm(away @ E.T / basins.scale, axis=1) <= basins.radii[0]
        count[near & (count == 0)] = k
    np.testing.assert_array_equal(basins.periods.ravel(), count)


def test_starts_beyond_the_stop_are_no_starts():
    system = bf.systems.impact_oscillator(omega=1.4)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(0, 2, 20), v0=(-1, 1, 6)))
    assert (basins.labels[10:] == -1).all() and (basins.labels[:10] >= 0).all()
    assert basins.counts[bf.basins.CellState.OUTSIDE] == 60
    assert sum(basins.fractions.values()) == pytest.approx(1.0) and basins.fractions[-1] == 0.0


def test_a_start_on_the_stop():
    """At rest on the stop under a pull, arriving with a speed, leaving: all three begin."""
    system = bf.systems.impact_oscillator(omega=1.4)
    integrator = Integrator(scene_of(system), 2000)
    starts = np.array([[1.0, 0.0], [1.0, 0.5], [1.0, -0.5], [1.0, -0.35]])
    targets = targets_of([], [], np.ones(2))
    cells = integrator.label(starts, targets, 3)
    assert (cells.states == 1).all()
    np.testing.assert_allclose(starts[1], starts[3], rtol=0, atol=1e-13)  # restitution 0.7


def test_two_masses_without_contacts_have_one_basin():
    K = [[2.0, -1.0], [-1.0, 2.0]]
    system = bf.System(np.eye(2), (0.2 * np.array(K)).tolist(), K, [bf.elements.HarmonicForce(1.0)], omega=1.3)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 3, 5), v1=(-3, 3, 4)))
    assert basins.fractions == {0: 1.0, -1: 0.0}
