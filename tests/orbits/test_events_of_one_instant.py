"""Events of one instant: which of them a simulation lists first is no property of the motion."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import Coulomb, EventKind, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.shooting.instants import behind, in_order
from bifurc.orbits.shooting.sequence import AFTER, BEFORE, DIVIDE, ENDING, GUARD, TOGETHER
from bifurc.orbits.shooting.signature import divided

FRICTIONS = Jenkins(4.801778624055402, 0.11265964200863075), Coulomb(0.07629062913200309)


@pytest.fixture(scope="module", params=[(0, 1), (1, 0)], ids=["slider first", "friction first"])
def orbit(request):
    """A mass on a slider and a dry friction, which turn round at one instant, beside a stop on one side that it does not reach: the
    system is not symmetric, though the motion is."""
    frictions = [FRICTIONS[k] for k in request.param]
    system = bf.System(1.0, 0.05, 1.0, [HarmonicForce(2.4), *frictions, RigidStop(0.9, 0.17, side=-1)], omega=2.588)
    return bf.find_orbit(system)


def test_the_period_is_that_of_the_motion(orbit):
    motion = bf.simulate(orbit.system, orbit.state, periods=2)
    np.testing.assert_allclose(motion(orbit.forcing_period), motion(0.0), rtol=0.0, atol=1e-12)
    assert orbit.success and orbit.periods == 1


def test_both_turn_round_at_one_instant(orbit):
    events = [event for event in orbit.events if event.kind is EventKind.STICK]
    assert len(events) == 4 and [event.time for event in events[::2]] == [event.time for event in events[1::2]]
    assert TOGETHER in orbit.sequence.nodes[:, DIVIDE]


def test_any_order_is_brought_into_one(orbit):
    """From either order of both of its instants: the same nodes, and the same unknowns."""
    scene, nodes = orbit.scene, orbit.sequence.nodes
    rows = np.reshape(orbit.unknowns, (len(nodes), -1))
    for k in np.flatnonzero(nodes[:, DIVIDE] == TOGETHER):
        first, second = nodes[k - 1, :ENDING], nodes[k, :ENDING]
        one, two = (scene.guard(int(node[BEFORE]), int(node[GUARD])) for node in (first, second))
        middle = scene.combine(int(first[BEFORE]), two.element, scene.keys[second[AFTER]][two.element])
        other, states = nodes[:, :ENDING].copy(), rows.copy()
        other[k - 1] = first[BEFORE], scene.guards_of(int(first[BEFORE]), two.element)[two.number], middle, 0, 0
        other[k] = middle, scene.guards_of(middle, one.element)[one.number], second[AFTER], 0, 0
        states[k, 1:] = behind(scene, other[k - 1], rows[k - 1])
        signature, unknowns = in_order(scene, divided(scene, other), states, 1.0)
        assert one.element < two.element
        np.testing.assert_array_equal(signature.nodes, nodes)
        np.testing.assert_allclose(unknowns, orbit.unknowns, rtol=0.0, atol=1e-12)


def test_a_listing_may_begin_within_an_instant(orbit):
    """It is that of the orbit, begun behind the instant, which ends it: its second event is at the end, a period later."""
    scene, nodes = orbit.scene, orbit.sequence.nodes
    rows = np.reshape(orbit.unknowns, (len(nodes), -1))

    def begun_at(k):
        later = rows + np.eye(1, rows.shape[1])
        return np.roll(nodes[:, :ENDING], -k, axis=0), np.vstack([rows[k:], later[:k]])

    for k in np.flatnonzero(nodes[:, DIVIDE] == TOGETHER).tolist():
        turned, states = begun_at(k)
        found, unknowns = in_order(scene, divided(scene, turned), states, 1.0)
        wanted, expected = begun_at(k + 1)
        np.testing.assert_array_equal(found.nodes[:, :ENDING], wanted)
        np.testing.assert_allclose(unknowns, expected.ravel(), rtol=0.0, atol=1e-12)


def test_its_branch_has_the_points_of_the_other_order():
    """From a motion that does not reach its stop to one that does, with the elements in either order and from either end."""
    found = []
    for frictions in (FRICTIONS, FRICTIONS[::-1]):
        system = bf.System(1.0, 0.05, 1.0, [HarmonicForce(2.4), *frictions, RigidStop(0.75, 0.17, side=-1)], omega=2.588)
        branch = bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.35, 0.8))
        for traced in (branch, bf.trace(branch.orbits[0], "rigid_stop.gap", bounds=(0.35, 0.8))):
            (point,) = traced.special_points
            assert point.kind.value == "grazing" and traced.audit.ok
            assert {reason.value for reason in traced.stop_reason} == {"bound"}
            found.append(point)
    turns = -bf.find_orbit(system).minimum()  # of the motion that does not reach the stop
    assert all(abs(point.parameter - turns) <= point.error + 1e-15 < 1e-11 for point in found), found


@pytest.mark.parametrize("beyond", (1e-10, 1e-8, 1e-6, 1e-4))
def test_a_stop_that_is_passed_where_frictions_turn_is_passed(orbit, beyond):
    """The guard of a stop that is reached at the instant of two other events is none of theirs, however little it is passed."""
    turns = -orbit.minimum()
    problem = orbit_problem(orbit, "rigid_stop.gap", (0.3, 0.9))
    x = problem.x0.copy()
    for gap, sign in ((turns + beyond, -1.0), (turns - beyond, 1.0)):
        x[-1] = gap
        peaks = [k for k, monitor in enumerate(problem.monitors) if monitor.name == "unlisted"]  # of what moves, of what is held
        value = problem.monitor_values(x[:-1], gap, None)[peaks].max()
        assert value * sign == pytest.approx(beyond / orbit.weights[0], rel=1e-5)
