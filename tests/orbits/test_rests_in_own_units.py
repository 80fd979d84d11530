"""Linearisations of states of rest in the units of the system, and friction without kinetic part."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_linearisation_is_the_jacobian_of_the_system(scale):
    """Of (velocities, accelerations) by the state, with a cubic spring that is loaded: 3 beta q^2 more stiffness at its rest."""
    M, C, K = np.diag([4.0, 1.0]), np.array([[0.3, -0.1], [-0.1, 0.2]]), scale * np.array([[200.0, -90.0], [-90.0, 300.0]])
    rest = bf.find_equilibrium(bf.System(M, C, K, [ConstantForce(40.0 * scale, dof=0), CubicSpring(50.0 * scale, dof=1)]))
    K = K + np.diag([0.0, 150.0 * scale * rest.state[1] ** 2])
    known = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    np.testing.assert_allclose(rest.linearisation, known, rtol=1e-9, atol=1e-9 * np.abs(known).max())
    np.testing.assert_allclose(rest.directions, np.eye(4), atol=1e-12)
    top = np.sort_complex(np.linalg.eigvals(known))
    np.testing.assert_allclose(np.sort_complex(rest.eigenvalues), top, rtol=1e-9)


def test_a_mass_that_sticks_is_left_out_of_a_linearisation():
    """The one that stands may do so anywhere, and takes .3 of that along: what is left is across (1, .3), by k (-.3, 1)."""
    system = bf.System(np.diag([4.0, 2.0]), [[0.3, -0.1], [-0.1, 0.2]], [[200.0, -90.0], [-90.0, 300.0]], [Coulomb(1.0, dof=0)])
    rest = bf.find_equilibrium(system)
    k = 1.0 / np.hypot(1.0, 0.3)
    np.testing.assert_allclose(rest.linearisation, [[0.0, k], [-(0.3 * 90.0 + 300.0) * k / 2.0, -0.1]], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(rest.directions.T, [[-0.3 * k, k, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]], atol=1e-10)
    alone = np.sort_complex(np.roots([2.0, 0.2, 300.0]))
    np.testing.assert_allclose(np.sort_complex(rest.eigenvalues), alone, rtol=1e-10)


@pytest.mark.parametrize("speed, static", [(0.3, 1.0), (0.5, 0.7)])
def test_a_belt_without_kinetic_friction(speed, static):
    """Stick up to the limit, then a free arc of radius hypot(static, speed) to where the mass has the speed of the belt again."""
    system = bf.systems.belt_oscillator(zeta=0.0, kinetic=0.0, static=static, belt_speed=speed)
    orbit = bf.find_orbit(system, (0.0, speed))
    known = 2.0 * static / speed + math.pi + 2.0 * math.atan2(speed, static)
    assert orbit.success and orbit.period == pytest.approx(known, rel=1e-12)
    assert orbit.sample(2001)[1][:, 0].max() == pytest.approx(math.hypot(static, speed), rel=1e-5)


def test_static_friction_is_given_once():
    with pytest.raises(ValueError, match="static_ratio = 1.5 is not allowed beside static = 2.0"):
        Coulomb(1.0, static_ratio=1.5, static=2.0)
    with pytest.raises(ValueError, match="static = 0.5"):
        Coulomb(1.0, static=0.5)
    assert bf.find_orbit(bf.systems.belt_oscillator(kinetic=0.0, static=0.0)).status == "at_rest"
