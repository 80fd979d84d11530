"""Orbits in which something is held all the time while others hit, rub and slip: a mass on its stop, a slider that sticks."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, Jenkins, RigidStop

OMEGA, SHIFT, WALL = 1.3, 0.4, 0.1
CONTACTS = {"friction": Coulomb(0.2), "elastic stop": ElasticStop(0.1, 5.0), "rigid stop": RigidStop(0.1, 0.6)}


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("moving", [False, True])
def test_a_mass_that_is_pressed_on_its_stop_all_the_time_is_a_wall(contact, moving):
    """The other mass moves as one alone, on springs to a wall that stands or moves as the stop does."""
    wall = {"amplitude": WALL, "harmonic": 1, "phase": SHIFT} if moving else {}
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    both = bf.System(np.eye(2), 0.1 * K, K, [HarmonicForce(1.0), ConstantForce(4.0, dof=1), RigidStop(0.2, 0.5, dof=1, **wall),
                                             CONTACTS[contact]], omega=OMEGA)
    drive = [HarmonicForce(WALL * math.hypot(1.0, 0.1 * OMEGA), phase=SHIFT + math.atan(0.1 * OMEGA))] if moving else []
    alone = bf.System(1.0, 0.2, 2.0, [HarmonicForce(1.0), ConstantForce(0.2), *drive, CONTACTS[contact]], omega=OMEGA)
    one, two = bf.find_orbit(alone), bf.find_orbit(both)
    assert one.success and two.success and two.stable == one.stable and len(two.events) == len(one.events) > 0
    times = np.linspace(0.0, 1.0, 7, endpoint=False)
    np.testing.assert_allclose(two._states(times)[:, [0, 2]], one._states(times), atol=1e-11)
    own = np.sort(np.abs(two.multipliers))[::-1]
    np.testing.assert_allclose(own[:len(one.multipliers)], np.sort(np.abs(one.multipliers))[::-1], atol=1e-10)
    assert not own[len(one.multipliers):].any()
    branches = [bf.trace(orbit, "harmonic_force.amplitude", bounds=(0.95, 1.05)) for orbit in (one, two)]
    assert all(branch.audit.ok and branch.stop_reason == ("bound", "bound") for branch in branches)
    ends = [branch.orbits[-1]._states(times) for branch in branches]
    np.testing.assert_allclose(ends[1][:, [0, 2]], ends[0], atol=1e-10)


def differences(system, orbit, phase=0.37):
    """Moduli of the multipliers by differences of simulated motions over the period, largest first."""
    begin, h, y = phase * system.period, 1e-6, orbit._states(np.array([phase]))[0]
    columns = [(bf.simulate(system, y + e, periods=orbit.periods, t0=begin).final
                - bf.simulate(system, y - e, periods=orbit.periods, t0=begin).final) / (2.0 * h) for e in h * np.eye(y.size)]
    return np.sort(np.abs(np.linalg.eigvals(np.array(columns).T)))[::-1]


def test_a_slider_that_sticks_labels_a_family_where_a_mass_leaves_its_stop_beside_a_law():
    """Each place at which the slider may stand gives an orbit; its multiplier 1 is left out."""
    K = np.array([[1.6, -0.5], [-0.5, 1.5]])
    system = bf.System(np.array([[1.2, 0.1], [0.1, 1.1]]), 0.05 * K, K, [
        HarmonicForce(1.7), ConstantForce(0.26, dof=1), Jenkins(5.5, 4.0, dof=1), RigidStop(-0.21, 0.06, side=-1, dof=1),
        CubicSpring(1.8)], omega=1.8)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.family == [4] and "release" in [event.kind for event in orbit.events]
    left = next(event.time for event in orbit.events if event.kind == "release") / system.period
    seen = differences(system, orbit, left + 0.02)
    assert abs(seen[0] - 1.0) < 1e-6
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers))[::-1], seen[1:], atol=1e-6)
    with_other = orbit.state.copy()
    with_other[4] += 1e-3
    other = bf.find_orbit(system, guess=with_other)
    assert other.success and abs(other.state[4] - orbit.state[4]) > 5e-4


def test_what_lets_one_contact_slip_turns_another_round_in_the_same_instant():
    """Where the second mass stops against a friction of its own, the force between the masses leaps: what stuck there begins to
    slip, and a slider that slipped the other way sticks at once, always."""
    system = bf.System([[1.229, 0.231], [0.231, 1.393]], [[0.007, 0.0], [0.0, 0.01]], [[1.159, 0.047], [0.047, 1.573]], [
        HarmonicForce(1.607), HarmonicForce(0.37, harmonic=3, phase=4.459), Coulomb(0.792, row=(-1.0, 1.0), belt_speed=-0.266),
        Coulomb(0.255, row=(1.0, -1.0)), Jenkins(1.93, 0.118, row=(1.0, -1.0)), Coulomb(0.494, dof=1)], omega=1.508)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable
    seen = differences(system, orbit)
    own = np.sort(np.abs(orbit.multipliers))[::-1]
    np.testing.assert_allclose(own, seen[:own.size], atol=1e-6)
