"""What goes on behind a change of the event sequence is constructed: against closed forms, and of systems whose parts do not
see each other against the parts."""
import logging

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.walk import SMALL, Measure, zero
from bifurc.elements import Coulomb, HarmonicForce, Jenkins, RigidStop


@pytest.fixture
def served(caplog):
    """Return how the changes of sequence were served so far."""
    caplog.set_level(logging.DEBUG, "bifurc.continuation")
    return lambda: [record.getMessage().rpartition(": ")[2] for record in caplog.records]


@pytest.mark.parametrize(("omega", "zeta", "stiffness"), [(0.7, 0.1, 0.4), (1.3, 0.05, 1.5), (2.7, 0.02, 0.2)])
def test_slips_both_ways_are_born_where_the_stuck_motion_reaches_the_limit(omega, zeta, stiffness, served):
    """A slider that sticks is a spring: its force is k |X|, and both slips, with their memory, begin where that is the limit."""
    load = 0.8
    force = stiffness * load / abs(1.0 + stiffness - omega**2 + 2j * zeta * omega)
    system = bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(load), Jenkins(stiffness, 1.1 * force)], omega=omega)
    branch = bf.trace(bf.find_orbit(system), "jenkins.limit", bounds=(0.8 * force, 1.2 * force), max_steps=60)
    (point,) = branch.special_points.of("slip_onset")
    assert abs(point.parameter - force) <= max(point.error, 1e-14 * force) and point.error < 1e-9 * force
    assert served() == ["constructed"] and branch.audit.ok


@pytest.mark.parametrize(("omega", "friction"), [(0.6, 0.5), (0.8, 0.2)])
def test_events_of_masses_that_do_not_see_each_other_change_places(omega, friction, served):
    """Of two masses without coupling one hits a stop and one sticks in friction: where their events fall on one instant they change
    places, and the motion of each stays what it is alone."""
    stop, dry = RigidStop(0.6, 0.4, dof=0), Coulomb(friction, dof=1)
    loads = [HarmonicForce(1.0, dof=0), HarmonicForce(1.1, dof=1)]
    system = bf.System(np.eye(2), 0.2 * np.eye(2), np.diag([1.0, 1.7]), [*loads, stop, dry], omega=omega)
    alone = (bf.System(1.0, 0.2, 1.0, [HarmonicForce(1.0), RigidStop(0.6, 0.4)], omega=omega),
             bf.System(1.0, 0.2, 1.7, [HarmonicForce(1.1), Coulomb(friction)], omega=omega))
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(omega, 1.25 * omega), max_steps=200)
    assert branch.audit.ok and "simulated" not in served()
    middle = branch.orbits[len(branch) // 2]
    for dof, part in enumerate(alone):
        other = bf.find_orbit(part.with_parameters(omega=middle.system.omega))
        np.testing.assert_allclose(middle.sample(50)[1][:, [dof, 2 + dof]], other.sample(50)[1][:, :2], atol=1e-9)


def test_zero_is_told_from_small_by_the_widest_gap():
    """Speeds of a train of impacts fall geometrically: the one that is zero lies below all of them, whatever their size."""
    train = [Measure(1e-9 * 0.3**k / 1e-14, k, 0.1 * k, False) for k in range(6)]
    last = Measure(3.0, 6, 0.7, False)
    assert zero([*train, last]) == [last] and zero([last]) == [last] and zero([]) == []
    pair = [Measure(0.0, 1, 0.1, False), Measure(80.0, None, 0.1, True)]
    assert zero([*pair, Measure(0.1 * SMALL / 1e-14, 4, 0.3, False)]) == pair
