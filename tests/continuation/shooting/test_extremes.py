"""Tops of orbits and their derivatives: closed forms of a linear motion, differences along branches with impacts."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.directions import directions
from bifurc.continuation.shooting.extremes import extreme_gradient, top
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import HarmonicForce, RigidStop
from bifurc.system import System

ZETA, W, F = 0.07, 1.3, 0.8
PHASOR = F / (1.0 - W * W + 2j * ZETA * W)


def parameter_only(x):
    fixed = np.zeros(x.size)
    fixed[-1] = 1.0
    return fixed


def test_the_top_of_a_linear_motion_grows_with_the_load():
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), RigidStop(5.0, 0.6)), omega=W)
    problem = orbit_problem(bf.find_orbit(system), "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    x, size = problem.x0, abs(PHASOR)
    whole, U = problem._whole(x)
    e = problem.equations
    for sign in (1.0, -1.0):
        i, t = top(e, e.numbers_at(x[-1]), whole, U, 0, sign)
        rows = U.reshape(len(whole.nodes), -1)
        phase = W * t + 2.0 * np.pi * rows[i, 0] + np.angle(PHASOR)
        assert np.cos(phase) == pytest.approx(sign, abs=1e-12)
        along = np.concatenate([x[:-1] / x[-1], [1.0]])  # the motion is proportional to the load
        along[:-1:3] = 0.0
        assert extreme_gradient(problem, x, 0, sign) @ along == pytest.approx(sign * size / x[-1], rel=1e-10)


CASES = {
    "one stop": (lambda: bf.systems.impact_oscillator(zeta=0.05, omega=2.1, amplitude=2.0, restitution=0.7), "omega", 1),
    "two stops": (lambda: bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=1.2, amplitude=2.0, restitution=0.7), "omega", 1),
    "two masses": (lambda: bf.systems.impact_chain(n=2, damping=0.1, omega=0.9, restitution=0.7, amplitude=0.9), "amplitude", 2),
}


@pytest.mark.parametrize("name", CASES)
def test_extremes_change_along_a_branch_as_their_gradient_says(name):
    made, parameter, n = CASES[name]
    system = made()
    value = system.parameter(system.parameter_name(parameter))
    problem = orbit_problem(bf.find_orbit(system), parameter, (0.9 * value, 1.1 * value))
    here = problem.correct(problem.x0, parameter_only(problem.x0), True).x
    h = 1e-5
    sides = []
    for sign in (1.0, -1.0):
        there = here.copy()
        there[-1] += sign * h
        c = problem.correct(there, parameter_only(there), True)
        assert c.converged
        sides.append(c.x)
    along = (sides[0] - sides[1]) / (2.0 * h)
    for dof in range(n):
        for measure, sign in (("max", 1.0), ("min", -1.0)):
            gradient = extreme_gradient(problem, here, dof, sign)
            values = problem.measure(f"{measure}_{dof}", np.array(sides))
            slope = (values[0] - values[1]) / (2.0 * h)
            assert gradient @ along == pytest.approx(slope, abs=2e-6 * max(1.0, abs(slope)))


class Crossing:
    """a^2 = b^2 and p = a + b about the origin, with a corrector that solves in the plane through a guess."""

    scale, touch, monitors = np.ones(3), 1e-9, ()

    def __init__(self, rank=2):
        self.rank = rank

    def equations(self, x):
        a, b, p = x
        return np.array([a * a - b * b if self.rank == 1 else a - b, p])

    def jacobian(self, u, p):
        a, b = u
        fu = np.array([[2.0 * a, -2.0 * b], [0.0, 0.0]]) if self.rank == 1 else np.array([[1.0, -1.0], [0.0, 0.0]])
        return fu, np.array([0.0, 1.0])

    def correct(self, guess, tangent, fixed=False):
        x, count = guess.copy(), 0
        while count < 30:
            fu, fp = self.jacobian(x[:-1], x[-1])
            matrix = np.vstack([np.column_stack([fu, fp]), tangent])
            right = np.append(self.equations(x), tangent @ (x - guess))
            if abs(np.linalg.det(matrix)) < 1e-14 or np.abs(right).max() < 1e-15:
                break
            x, count = x - np.linalg.solve(matrix, right), count + 1
        good = np.abs(self.equations(x)).max() < 1e-14
        return type("Corrected", (), {"x": x, "converged": bool(good), "iterations": count, "monitors": ()})()


def test_directions_of_a_regular_and_of_a_crossing_start():
    [one] = directions(Crossing(), np.zeros(3))
    np.testing.assert_allclose(np.abs(one), [np.sqrt(0.5), np.sqrt(0.5), 0.0], atol=1e-14)
    assert one[0] * one[1] > 0.0
    found = directions(Crossing(1), np.zeros(3))
    assert len(found) == 2
    signs = set()
    for v in found:
        assert np.linalg.norm(v) == pytest.approx(1.0)
        np.testing.assert_allclose(np.abs(v), [np.sqrt(0.5), np.sqrt(0.5), 0.0], atol=1e-6)
        signs.add(v[0] * v[1] > 0.0)
    assert signs == {True, False}
