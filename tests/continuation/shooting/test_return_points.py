"""Return-point memory: sliders on one row that stuck at one instant slip again at one instant, where they stuck."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import StopReason
from bifurc.elements import EventKind, HarmonicForce, Iwan, Jenkins
from bifurc.orbits.shooting.sequence import TOGETHER


def looping(omega, third, length=1.0):
    """A mass on two sliders, whose load has a third harmonic: in every half period it turns round twice and comes back."""
    loads = HarmonicForce(length), HarmonicForce(third * length, harmonic=3)
    return bf.System(1.0, 0.05, 1.0, (*loads, Jenkins(2.0, 0.3 * length), Jenkins(1.0, 0.25 * length)), omega=omega)


@pytest.fixture(scope="module")
def branches():
    """From one bound to the other: of an orbit in a unit of length and in another, and one with small loops in which one slips."""
    return [bf.trace(bf.find_orbit(looping(omega, third, length)), "omega", bounds=(0.8 * omega, 1.2 * omega))
            for omega, third, length in ((0.3, 0.4, 1.0), (0.3, 0.4, 1e-9), (0.2, 0.45, 1.0))]


def test_they_slip_where_they_stuck(branches):
    """Two events at one instant and place, that of the reversal of both; the period is not that of their order."""
    for branch in branches:
        orbit = branch.orbits[len(branch) // 2]
        assert orbit.success and orbit.periods <= 1
        size, returns = abs(orbit.maximum(0)), 0
        events = list(orbit.events)
        for one, two in zip(events, events[1:], strict=False):
            if one.kind is two.kind is EventKind.SLIP and two.time - one.time < 1e-9:
                stuck = [event for event in events if event.kind is EventKind.STICK]
                assert min(abs(event.before[0] - one.before[0]) for event in stuck) <= 1e-12 * size
                returns += 1
        assert returns > 0 and TOGETHER in orbit.sequence.nodes[:, 3]


def test_their_branches_end_on_the_bounds(branches):
    for branch in branches:
        assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
        assert branch.audit.ok, branch.audit


def test_their_special_points_are_those_of_any_unit(branches):
    one, other = ([(point.kind, point.parameter) for point in branch.special_points] for branch in branches[:2])
    assert [kind for kind, _ in one] == [kind for kind, _ in other] and len(one) >= 2
    np.testing.assert_allclose([p for _, p in one], [p for _, p in other], rtol=1e-12)


def test_sliders_of_one_element_have_the_special_points_of_two(branches):
    """The same model as one element, whose sliders are told apart by its modes; every row is a motion."""
    for branch in (branches[0], branches[2]):
        system = branch.orbits[0].system
        loads = [element for element in system.elements if not isinstance(element, Jenkins)]
        one = bf.System(1.0, 0.05, 1.0, (*loads, Iwan(stiffnesses=(2.0, 1.0), limits=(0.3, 0.25))), omega=system.omega)
        bounds = branch.column("omega")
        other = bf.trace(bf.find_orbit(one), "omega", bounds=(bounds.min(), bounds.max()))
        assert other.audit.ok and all(orbit.success for orbit in other.orbits), other.audit
        np.testing.assert_allclose([point.parameter for point in other.special_points],
                                   [point.parameter for point in branch.special_points], rtol=1e-12)


def test_sliders_that_stuck_one_after_the_other_slip_so():
    """Without loops each slider slips once a way, at a place of its own: nothing coincides but the sticks."""
    orbit = bf.find_orbit(looping(0.3, 0.05))
    slips = np.sort([event.time for event in orbit.events if event.kind is EventKind.SLIP])
    assert orbit.success and slips.size == 4 and np.diff(slips).min() > 0.1
