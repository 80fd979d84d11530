"""Balances of parts that nothing restores: the message names what is free."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, CubicSpring, ElasticStop, HarmonicForce, LinearSpring

METHOD = bf.HarmonicBalance(harmonics=7)
BETWEEN = (1.0, -1.0)


def clearance(**where):
    return [ElasticStop(gap=0.5, stiffness=10.0, **where), ElasticStop(gap=0.5, stiffness=10.0, side=-1, **where)]


def test_a_loose_mass_without_a_spring_is_solved_where_contacts_hold_it():
    """Nothing takes out energy, so that the load cos t puts none in over a period: the motion has no part sin t."""
    found = bf.find_orbit(bf.System(1.0, 0.0, 0.0, [HarmonicForce(1.0), *clearance()], omega=1.0), method=METHOD)
    assert found.success and found.maximum() > 0.5 and found.minimum() < -0.5
    t, y = found.sample(65)
    assert abs((y[:-1, 0] * np.sin(t[:-1])).mean()) < 1e-12


@pytest.mark.parametrize("guess", [None, (0.5, 0.1, 0.0, 0.0)])
@pytest.mark.parametrize("contacts, stiffness, free", [
    ([CubicSpring(1.0, row=BETWEEN)], 1.0, "q0 + q1"), (clearance(row=BETWEEN), 0.0, "q0"),
    ([LinearSpring(1.0, row=(1.0, -2.0)), CubicSpring(1.0, row=(1.0, -2.0))], 0.0, "q0 + 0.5 q1")])
def test_free_inertias_are_named(guess, contacts, stiffness, free):
    """A mean along the null vector of every row stretches nothing."""
    coupling = np.array([[1.0, -1.0], [-1.0, 1.0]])
    system = bf.System(np.eye(2), 0.1 * np.eye(2), stiffness * coupling, [HarmonicForce(1.0, dof=0), *contacts], omega=1.0)
    found = bf.find_orbit(system, guess, method=METHOD)
    assert not found.success and f"Nothing restores {free}" in found.message


def test_a_motion_inside_its_clearance_is_still_a_solution():
    """Of a free mass: amplitude F / omega^2 anywhere between the stops."""
    found = bf.find_orbit(bf.System(1.0, 0.0, 0.0, [HarmonicForce(0.2), *clearance()], omega=1.0), method=METHOD)
    assert found.success and abs(found.harmonic(1)) == pytest.approx(0.2, rel=1e-12)


def pushed(*elements, n=1, omega=1.0):
    return bf.System(np.eye(n), 0.1 * np.eye(n), np.zeros((n, n)), elements, omega=omega)


def gear():
    both = [ElasticStop(0.5, 10.0, row=[1, -1]), ElasticStop(0.5, 10.0, row=[-1, 1])]
    held = [ConstantForce(0.2, dof=0), ConstantForce(-0.2, dof=1), LinearSpring(1.0, 0.0, dof=1)]
    return pushed(HarmonicForce(0.5), *held, *both, n=2)


@pytest.mark.parametrize("system", [
    pushed(HarmonicForce(0.5), ElasticStop(0.1, 20.0), ElasticStop(0.1, 20.0, side=-1), omega=2.0),
    pushed(HarmonicForce(0.5), ConstantForce(1.0), ElasticStop(1.0, 4.0)),
    pushed(HarmonicForce(0.3), ConstantForce(-2.0), ElasticStop(0.2, 9.0, side=-1), omega=1.7),
    gear()], ids=["between stops", "onto a stop", "onto the other", "a pair of gears"])
def test_what_only_contacts_hold_is_solved_without_a_guess(system):
    """A simulated period from its state is the same motion."""
    found = bf.find_orbit(system, method=bf.HarmonicBalance(63))
    assert found.success, found.message
    motion = bf.simulate(system, found.state, periods=1)
    t, y = found.sample(65)
    np.testing.assert_allclose(motion(t)[:, :system.n], y[:, :system.n], atol=3e-3 * np.abs(found.state).max())


def test_what_nothing_holds_is_named():
    both = [ElasticStop(0.5, 10.0, row=[1, -1]), ElasticStop(0.5, 10.0, row=[-1, 1])]
    found = bf.find_orbit(pushed(HarmonicForce(2.0), *both, n=2), method=bf.HarmonicBalance(7))
    assert not found.success and found.how["free"] == "q0 + q1" and "Nothing restores q0 + q1" in found.message
