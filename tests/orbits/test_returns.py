"""Where a motion without a clock comes again: maxima and events against closed forms, pairs of them that are tried, sizes."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, Coulomb, RigidStop
from bifurc.flow.scan import CHATTER, EVENT, GRAZE, PASSED
from bifurc.orbits import autonomous
from bifurc.orbits.autonomous import Return
from bifurc.orbits.shooting.signature import Signature

FREE = bf.System(np.diag([1.0, 1.0]), np.zeros((2, 2)), np.diag([1.0, 9.0]))  # frequencies 1 and 3, each of its own mass


def test_maxima_are_those_of_the_widest_coordinate():
    """q = (.4 cos(t - 1), 1.5 cos(3 t + .5)): the second, where its speed falls through zero."""
    start = (0.4 * np.cos(1.0), 1.5 * np.cos(0.5), 0.4 * np.sin(1.0), -4.5 * np.sin(0.5))
    motion = bf.simulate(FREE, start, duration=20.0)
    known = (2.0 * np.pi * np.arange(1, 10) - 0.5) / 3.0
    for begin, stop in ((0.0, 20.0), (3.0, 11.0)):
        found = autonomous.maxima(motion, begin, stop, True)
        inside = known[(known > begin) & (known < stop)]
        assert [item.time for item in found] == pytest.approx(inside, abs=1e-10)
        for item in found:
            assert item.dof == 1 and item.node == (0, -1, 0, 0, 0) and item.speed == 0.0
            other = 0.4 * np.cos(item.time - 1.0), 1.5, -0.4 * np.sin(item.time - 1.0), 0.0
            assert item.state == pytest.approx(other, abs=1e-9)
    assert autonomous.returns(motion, True)[0].time == pytest.approx(known[0])
    assert autonomous.maxima(motion, 4.0, 4.0, True) == []
    slow = bf.simulate(FREE, (1.0, 0.0, 0.0, 0.1), duration=20.0)
    found = [item.time for item in autonomous.maxima(slow, 0.0, 20.0, True)]
    assert found == pytest.approx(2.0 * np.pi * np.arange(1, 4), abs=1e-8)
    plane = autonomous.section(scene_of(FREE), 1, np.array([2.0, 2.0, 4.0, 5.0]))
    assert plane.tolist() == [0.0, 0.0, 0.0, 0.2, 0.0]


def test_natural_times_are_those_of_the_modes():
    scene = scene_of(FREE)
    assert autonomous.slowest(scene) == pytest.approx(2.0 * np.pi)
    assert autonomous.fastest(scene) <= 2.0 * np.pi / 3.0 * (1.0 + 1e-12)
    faster = scene_of(bf.System(FREE.mass, FREE.damping, 4.0 * np.asarray(FREE.stiffness)))
    assert autonomous.fastest(faster) == pytest.approx(0.5 * autonomous.fastest(scene))
    body = scene_of(bf.System(np.eye(2), 0.0 * np.eye(2), [[1.0, -1.0], [-1.0, 1.0]]))  # its rigid motion has no period
    assert autonomous.slowest(body) == pytest.approx(2.0 * np.pi / np.sqrt(2.0))
    states = [np.array([0.5, -1.0, 0.3, 2.0]), np.array([0.0, 0.0, -6.0, 0.0])]
    weights = autonomous.sizes(scene, states, np.pi, 1.0)
    assert weights.tolist() == [3.0, 3.0, 6.0, 6.0]  # the largest speed is that of a length of 3 at the rate 2
    assert autonomous.sizes(scene, states, np.pi, 8.0).tolist() == [8.0, 8.0, 16.0, 16.0]
    assert autonomous.sizes(scene, [np.zeros(4)], np.pi, 0.0).tolist() == [1.0, 1.0, 2.0, 2.0]


def test_events_that_come_again_are_the_returns():
    """A ball on a floor: every impact but none of what is no event; it does not repeat where only one happened."""
    ball = bf.System(1.0, 0.0, 0.0, [ConstantForce(1.0), RigidStop(0.5, 0.8)])
    motion = bf.simulate(ball, (0.0, 0.0), duration=5.0)
    found = autonomous.returns(motion, False)
    known = [1.0, 1.0 + 1.6, 1.0 + 1.6 + 1.28, 1.0 + 1.6 + 1.28 + 1.024]  # 2 v r^k between impacts
    assert [item.time for item in found] == pytest.approx(known, abs=1e-12) and autonomous.repeated(found)
    assert [item.speed for item in found] == pytest.approx([1.0, 0.8, 0.64, 0.512]) == [item.state[1] for item in found]
    assert all(item.node[0] == item.node[2] and item.node[3:] == (0, 0) and item.dof == -1 for item in found)
    once = bf.simulate(ball, (0.0, 0.0), duration=1.5)
    assert len(autonomous.listed(once)) == 1 and not autonomous.repeated(autonomous.listed(once))
    rested = bf.simulate(ball, (0.0, 0.0), duration=12.0)
    assert autonomous.listed(rested)[-1].node[4] == 1  # the end of a complete chattering
    assert autonomous.at_rest(rested, (0.0, 0.0)) and not autonomous.at_rest(motion, (0.0, 0.0))


def test_sections_and_touches_are_no_returns():
    rows = np.array([[0, -1, 0, PASSED, 0], [0, 1, 2, EVENT, 0], [2, 0, 2, GRAZE, 0], [2, 1, 3, CHATTER, 0], [3, -1, 3, PASSED, 0]])
    R = SimpleNamespace(rows=rows, times=np.arange(5.0), before=np.arange(10.0).reshape(5, 2), speeds=np.arange(5.0) / 10.0)
    found = autonomous.listed(SimpleNamespace(recorded=R))
    assert [(item.time, item.node, item.state.tolist(), item.speed) for item in found] == [
        (1.0, (0, 1, 2, 0, 0), [2.0, 3.0], 0.1), (3.0, (2, 1, 3, 0, 1), [6.0, 7.0], 0.3)]


def test_rest_is_told_from_a_slow_death():
    """Of speeds in the last fifth, beside the largest of the motion and of its start."""
    damped = bf.System(1.0, 0.4, 1.0)
    for duration, rests in ((30.0, False), (150.0, True)):
        motion = bf.simulate(damped, (1.0, 0.0), duration=duration)
        assert autonomous.at_rest(motion, (1.0, 0.0)) == rests
    motion = bf.simulate(damped, (1e-9, 0.0), duration=20.0)
    assert not autonomous.at_rest(motion, (1e-9, 0.0)) and autonomous.at_rest(motion, (1.0, 0.0))
    near = bf.System(1.0, 0.4, 1.0, [ConstantForce(1.0)])
    dies = bf.simulate(near, (1.3, 0.0), duration=60.0)
    assert autonomous.dies_out(dies)
    assert not autonomous.dies_out(bf.simulate(near, (1.3, 0.0), duration=10.0))  # not near yet
    assert not autonomous.dies_out(bf.simulate(bf.System(1.0, 0.0, 1.0, [ConstantForce(1.0)]), (1.3, 0.0), duration=60.0))
    stopped = bf.System(1.0, 0.4, 1.0, [ConstantForce(1.0), RigidStop(1.2, 0.5)])
    assert not autonomous.dies_out(bf.simulate(stopped, (0.0, 0.0), duration=60.0))  # it hit the stop on its way


def item(time, position, node=(0, 1, 0, 0, 0)):
    return Return(time, node, np.array([position, 1.0]), 1.0)


@pytest.fixture
def tried(monkeypatch):
    pairs = []
    monkeypatch.setattr(autonomous, "scene_of", lambda system: SimpleNamespace(n=1, ns=2))
    monkeypatch.setattr(autonomous, "between", lambda system, chosen, T, weights: pairs.append(([c.time for c in chosen], T)))

    def made(found, period=None, early=False):
        pairs.clear()
        list(autonomous.from_motion(None, found, period, early))
        return pairs
    return made


def test_nearest_pairs_of_one_event_are_tried_first(tried):
    found = [item(0.0, 1.0), item(1.0, 1.2), item(2.0, 1.21), item(3.0, 1.11)]
    assert tried(found) == [([1.0], 1.0), ([2.0], 1.0), ([0.0], 1.0)]
    assert tried(found, early=True) == [([0.0], 1.0), ([1.0], 1.0), ([2.0], 1.0)]
    assert tried([item(0.0, 1.0), item(1.0, 0.0)]) == []  # it has not come back
    assert tried([item(0.0, 1.0), item(1.0, 0.0)], period=1.0) == [([0.0], 1.0)]  # though that was said
    assert tried([item(0.0, 1.0), item(1.7, 0.0)], period=1.0) == tried([item(0.0, 1.0), item(0.5, 0.0)], period=1.0) == []
    assert tried([item(1.0, 1.0), item(1.0, 1.0)]) == []  # no time has passed


def test_between_two_returns_lies_what_happened_in_between(tried):
    """The same event with the same modes; the one before it leads there."""
    there, back = (0, 1, 2, 0, 0), (2, 0, 0, 0, 0)
    found = [item(0.0, 1.0, there), item(0.4, 0.5, back), item(1.0, 1.0, there), item(1.5, 0.5, back)]
    assert sorted(tried(found)) == [([0.0, 0.4], 1.0), ([0.4, 1.0], 1.1)]
    lost = [item(0.0, 1.0, there), item(0.4, 0.5, (2, 0, 1, 0, 0)), item(1.0, 1.0, there)]
    assert tried(lost) == []
    many = [item(float(k), 1.0 + 0.01 * k) for k in range(40)]
    late, early = tried(many), None
    assert len(late) == autonomous.TRIALS and min(times[0] for times, _ in late) >= 40 - autonomous.MOST
    early = tried(many, early=True)
    assert [times[0] for times, _ in early] == list(range(autonomous.TRIALS))


def test_an_orbit_with_its_period_as_a_number_is_that_with_it_unknown(rng):
    """Wound and written out again."""
    nodes = np.array([[0, 1, 0, 0, 0], [0, 0, 0, 0, 0]])
    rows = rng.normal(size=(2, 3))
    rows[:, 0] = [0.0, 0.7]
    whole = Signature(nodes, np.zeros(2), 1.3, clock=2.0)
    unknown, U = autonomous.wound(whole, rows.ravel(), 2.0, np.zeros(3))
    assert unknown.span == 0.0 and U[0] == 1.3 and U[3] == 0.7 and unknown.clock == 2.0
    again, V = unknown.written_out(U)
    assert again.span == 1.3 and np.array_equal(V, rows.ravel()) and np.array_equal(again.nodes, nodes)
    rows[:, 0] += 0.25  # begun at another time
    later, W = autonomous.wound(whole, rows.ravel(), 2.0, np.zeros(3))
    assert pytest.approx(U) == W
    plane = np.array([0.0, 1.0, 0.0])
    free = Signature(np.array([[0, -1, 0, 0, 0]]), np.zeros(1), 1.3, clock=2.0)
    assert np.array_equal(autonomous.wound(free, rows[0], 2.0, plane)[0].fixed, plane)


def test_a_motion_that_comes_to_rest_is_told_with_its_place():
    """Under a belt that is faster than its arc of slip a mass comes to rest where spring and kinetic friction balance."""
    belt = bf.System(1.0, 0.1, 1.0, [Coulomb(0.5, belt_speed=0.3, static_ratio=1.5)])
    found = bf.find_orbit(belt)
    assert not found.success and found.status == "at_rest" and found.signature != "carried / T"
    assert found.state == pytest.approx([0.5, 0.0], abs=1e-5)
