"""The Jacobian of an event sequence is the derivative of its residual, on the orbit and beside it."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.conditions import difference
from bifurc.elements import Coulomb, CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.orbits.sequence import DIVIDE
from bifurc.system import System

HIT = bf.systems.impact_oscillator(zeta=0.05, omega=2.4, amplitude=7.2, restitution=0.5)
SCENES = {"friction": bf.systems.dry_friction_oscillator(), "slider": bf.systems.jenkins_oscillator(omega=0.9, amplitude=2.0),
          "elastic stop": bf.systems.bilinear_oscillator(omega=1.29), "impacts": HIT,
          "elastic stop beside a law": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), CubicSpring(0.2), ElasticStop(0.3, 4.0)],
                                              omega=1.1),
          "stop and friction": System(1.0, 0.04, 1.0, [HarmonicForce(2.0), RigidStop(0.5, 0.6), Coulomb(0.2)], omega=0.8)}
DIVIDED = ("friction", "elastic stop", "impacts", "elastic stop beside a law")  # with a guard that is zero where its mode begins


@pytest.mark.parametrize("name", SCENES)
def test_beside_an_orbit(name):
    """Rows divided by a duration change with it: second derivatives (folds in two parameters) are taken beside the orbit."""
    guess = bf.simulate(HIT, (0.3, -1.0), periods=60).final if name == "impacts" else None
    orbit = bf.find_orbit(SCENES[name], guess=guess)
    assert orbit.success and orbit.sequence.events
    problem = bf.trace(orbit, "omega", bounds=(0.5 * orbit.system.omega, 2.0 * orbit.system.omega), max_steps=0).problems[0]
    assert (problem.sequence.nodes[:, DIVIDE] > 0).any() == (name in DIVIDED)
    rng = np.random.default_rng(3)
    for size in (0.0, 1e-4):
        x = problem.x0 + size * problem.scale * rng.uniform(-1.0, 1.0, problem.x0.size)
        J = problem.wide_jacobian(x)
        D = np.array([difference(lambda y: problem.residual(y[:-1], float(y[-1])), x, k, 1e-5) for k in range(x.size)]).T
        np.testing.assert_allclose(J, D, atol=3e-8 * np.abs(J).max())
