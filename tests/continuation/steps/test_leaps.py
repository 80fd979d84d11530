"""Branches go on behind boundaries at which their equations lose rank; chattering while friction turns is read as it is."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import StopReason
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop
from bifurc.orbits.least import mark_trains
from bifurc.orbits.repetition import repetition
from bifurc.orbits.shooting.sequence import AFTER, CLOSES, FOREVER, STARTS, TOGETHER


def clearances(omega):
    """Three masses with two clearances that stay open at low frequency: the motion is symmetric there, the system is not."""
    K = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]
    return bf.System(np.eye(3), (0.05 * np.array(K)).tolist(), K, [
        HarmonicForce(0.462), ElasticStop(0.854, 25.6, row=(1.0, -1.0, 0.0)),
        ElasticStop(0.546, 25.6, row=(0.0, 1.0, -1.0)), Coulomb(0.216, dof=2)], omega=omega)


def chattering(restitution):
    """A mass that chatters to rest on its stop; between any two impacts dry friction turns."""
    return bf.System(1.0, 0.0236, 1.0, [HarmonicForce(1.0), RigidStop(0.386, restitution), Coulomb(0.145)], omega=0.408)


@pytest.fixture(scope="module")
def chatter_branch():
    """Return the branch of the chattering motion over its restitution."""
    return bf.trace(bf.find_orbit(chattering(0.329)), "rigid_stop.restitution", bounds=(0.079, 0.579), max_steps=250)


def test_two_sticks_that_end_at_one_parameter_are_passed_both_ways():
    """A symmetric motion of a system that is not: both its sticks lose their duration at once, and the equations two ranks."""
    places = {}
    for start in (0.66, 0.70):
        branch = bf.trace(bf.find_orbit(clearances(start)), "omega", bounds=(0.65, 0.72))
        assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
        assert branch.audit.ok, branch.audit
        places[start] = [(point.kind.value, point.parameter) for point in branch.special_points]
    kinds, values = zip(*places[0.66], strict=True)
    others, again = zip(*places[0.70], strict=True)
    assert kinds == others and "stick_onset" in kinds
    assert values == pytest.approx(again, abs=1e-9)


def test_chattering_with_friction_is_followed_over_its_restitution(chatter_branch):
    """The number of listed impacts follows the closed form of the end, up and down, and every row is a motion."""
    branch = chatter_branch
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    counts = branch.column("n_events")
    assert counts[-1] > counts[0] + 10
    assert {point.kind.value for point in branch.special_points} <= {"stick_onset"}  # no grazing: only equations change
    edges = np.array([point.s for point in branch.special_points] or [np.inf])
    for s, orbit in list(zip(branch.column("s"), branch.orbits, strict=True))[::4]:
        if np.abs(edges - s).min() > 1e-9:
            assert orbit.success and repetition(orbit).repeated, orbit
            assert orbit.closing_excess < 1.5


def test_what_a_rest_holds_is_no_event(chatter_branch):
    """While the mass rests on its stop its friction stays at zero speed, and while it sticks it touches the stop: neither guard
    can come nearer to zero than it is."""
    problem = chatter_branch.problems[0]
    nodes, scene = problem.sequence.nodes, problem.scene
    rest = next(node for node in nodes if scene.keys[node[AFTER]][1] == "rest")
    turns = [q for q in range(int(scene.tables.n_guards[rest[AFTER]])) if scene.guard(int(rest[AFTER]), q).element == 2]
    assert any(rest[STARTS + q] == FOREVER for q in turns)
    c = problem.correct(chatter_branch.x(1), problem.null_tangent(chatter_branch.x(1)))
    values = dict(zip((monitor.name for monitor in problem.monitors), c.monitors, strict=True))
    assert values["unlisted"] < 0.0


def test_impacts_between_turns_of_friction_are_one_train():
    """Mode 1 approaches the stop, mode 2 leaves it, guard 1 of mode 2 is the turn; the last impact closes the sequence."""
    nodes = np.array([[0, 2, 1, 0, 0], [1, 0, 2, 0, 0], [2, 1, 1, 0, 0], [1, 0, 2, 0, 0], [2, 1, 1, 0, 0], [1, 0, 3, 0, 1]])
    mark_trains(nodes, np.array([9.0, 1.0, 0.0, 0.1, 0.0, 0.01]))
    assert nodes[:, CLOSES].tolist() == [0, 2, 2, 2, 2, 1]
    slower = np.array([[1, 0, 2, 0, 0], [2, 1, 1, 0, 0], [1, 0, 3, 0, 1]])
    mark_trains(slower, np.array([0.001, 0.0, 0.01]))  # the one before is slower: no train
    assert slower[:, CLOSES].tolist() == [0, 0, 1]


def test_two_frictions_that_turn_round_at_one_instant_belong_to_each_flight_of_a_train():
    flight = [[3, 0, 9, 0, 0], [9, 1, 5, 0, 0], [5, 3, 3, TOGETHER, 0]]
    nodes = np.array([[8, 0, 3, 0, 0], *flight, *flight, *flight, [3, 0, 8, 0, 1]])
    mark_trains(nodes, np.array([0.0, 0.9, 0.0, 0.0, 0.3, 0.0, 0.0, 0.1, 0.0, 0.0, 0.033]))
    assert nodes[:, CLOSES].tolist() == [0, *[2] * 9, 1]
