"""Rows that hold a light mass by a heavy one: no part of the load that the holds take up is left in their accelerations."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.numbers import determined
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, Coulomb, RigidStop


@pytest.mark.parametrize("ratio", [1.0, 1e6, 1.3e10, 1e15])
def test_a_light_mass_that_rests_on_a_heavy_one_moves_with_it(ratio):
    """Both fall with (F0 + F1)/(m0 + m1), whatever the load on the light one: to the last digits, however long."""
    mass, loads = np.diag([1.0, 1.0 / ratio]), (0.3, 0.9)
    system = bf.System(mass, np.zeros((2, 2)), np.zeros((2, 2)),
                       [ConstantForce(loads[0]), ConstantForce(loads[1], dof=1), RigidStop(0.0, 0.0, row=(-1.0, 1.0))])
    motion = bf.simulate(system, np.zeros(4), duration=100.0)
    fall = sum(loads) / (1.0 + 1.0 / ratio)
    np.testing.assert_allclose(motion.final, [5000.0 * fall, 5000.0 * fall, 100.0 * fall, 100.0 * fall], rtol=4e-15)


@pytest.mark.parametrize("ratio", [1e3, 1.3e10])
def test_what_rounding_leaves_to_the_light_mass_is_not_given_to_the_heavy_one(ratio):
    """A light mass chatters on a heavy one and rests: momentum and the centre of mass of both are those of the load."""
    mass = np.diag([1.0, 1.0 / ratio])
    system = bf.System(mass, np.zeros((2, 2)), np.zeros((2, 2)),
                       [ConstantForce(0.9, dof=1), RigidStop(0.4, 0.3, row=(-1.0, 1.0)), RigidStop(0.0, 0.0, row=(1.0, -1.0))])
    t = 10.0 * float(np.sqrt(0.8 / (0.9 * ratio)))  # ten times the first flight
    motion = bf.simulate(system, np.array([0.0, 0.0, 0.4, 0.1]), duration=t)
    start = 0.4 + 0.1 / ratio
    q, v = np.split(motion.final, 2)
    assert v @ np.diag(mass) == pytest.approx(start + 0.9 * t, rel=1e-14) and v[1] == pytest.approx(v[0], rel=1e-14)
    assert q @ np.diag(mass) == pytest.approx(t * start + 0.45 * t**2, rel=1e-13) and q[1] - q[0] == pytest.approx(0.4, rel=1e-14)


def test_coordinates_that_rows_hold_together_have_no_acceleration():
    """Stick of the first mass, and each of the others on the one before: rounding would be the slowest motion of the scene."""
    n = 3
    rng = np.random.default_rng(5)
    K = rng.uniform(0.1, 1.0, (n, n)) * 10.0 ** rng.uniform(-3, 3, (n, 1))
    stops = [RigidStop(0.0, 0.5, row=(-1.0, 1.0, 0.0)), RigidStop(0.0, 0.5, row=(0.0, -1.0, 1.0))]
    system = bf.System(np.diag([1.0, 1e-3, 1e-7]), np.zeros((n, n)), K, [Coulomb(1.0), *stops, ConstantForce(1.0, dof=2)])
    scene = scene_of(system)
    m = scene.index(("stick", "rest", "rest", "always"))
    assert not scene.tables.A[m, n:2 * n].any()


@pytest.mark.parametrize(("rows", "fixed"), [
    ([[2.0, 0.0, 0.0]], [0]), ([[1.0, -1.0, 0.0]], []), ([[0.0, 3.0, -1.0], [0.0, 0.0, 2.0]], [1, 2]),
    ([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0]], []), ([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 2.0]], [0, 1, 2]),
    ([[1e-13, 1.0, 0.0]], []), ([[1.0, 0.0, 0.0], [0.0, 0.0, -2.0]], [0, 2])])
def test_coordinates_that_held_rows_determine(rows, fixed):
    J = np.array(rows)
    found, moves = determined(J)
    assert sorted(found) == fixed
    speeds = np.random.default_rng(0).normal(size=3)
    np.testing.assert_allclose(moves @ (J @ speeds), speeds[found], rtol=0, atol=1e-13)
