"""Events that begin and end in a sequence, on stand-ins: where, when, in which modes; what simulation makes of a motion."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.continuation.shooting import appearing, successor
from bifurc.continuation.shooting.appearing import inserted, returning
from bifurc.continuation.shooting.vanishing import dropped
from bifurc.elements import Coulomb, HarmonicForce
from bifurc.elements.friction.dry import SLIP_DOWN, SLIP_UP, STICK
from bifurc.flow.scan import CHATTER, EVENT, GRAZE, PASSED
from bifurc.orbits.shooting import instants, sequence
from bifurc.orbits.shooting.sequence import TOGETHER
from bifurc.orbits.shooting.signature import Signature, divided

from .test_changes import W, touching


@pytest.fixture(autouse=True)
def plain_nodes(monkeypatch):
    """Orders of trivial zeros are none of these tests."""
    for module in (appearing, instants, successor):
        monkeypatch.setattr(module, "divided", lambda scene, nodes, *more: np.asarray(nodes, np.int64))


# events that begin

class Scene:
    """Modes 0 to 3; element 0 has guards 0 and 1, element 1 guards 2 and 3; every guard leads to mode 2 or 3."""

    ns = 2

    def __init__(self):
        self.tables = SimpleNamespace(n_guards=np.full(4, 4), kick=np.zeros((4, 4), int))

    def guard(self, mode, guard):
        return SimpleNamespace(element=guard // 2)

    def guards_of(self, mode, element):
        return [2 * element, 2 * element + 1]

    def expand(self, mode, guard):
        return SimpleNamespace(then=np.tile(np.array([mode, 2, 3, -1]), (4, 4, 1)))

    def forcing(self, t):
        return np.array([[1.0, np.cos(W * t[0]), np.sin(W * t[0])]])


def problem_of(nodes, times, span=1.0, info=()):
    """Return a problem, its unknowns, and what its monitor says."""
    def monitor(T, nodes, fixed, span, closure, U, weights, out):
        for place, value in info:
            out[place] = value
    T = SimpleNamespace(flat=np.array([W]), A=np.zeros((4, 2, 5)), n_guards=np.full(4, 4))
    x = np.append(np.array([[t, 10.0 * k, k] for k, t in enumerate(times)]).ravel(), 7.0)
    kernel = SimpleNamespace(monitor=monitor, scale_of=lambda row, weights: 1.0)
    motion = SimpleNamespace(start_of=lambda T, nodes, U, i, P, out: out.__setitem__(slice(None), [100.0 + i, -1.0, 1.0, 1.0, 0.0]))
    e = SimpleNamespace(numbers_at=lambda p: T, kernel=kernel, weights=np.ones(2), closure=1, motion=motion)
    s = Signature(np.array(nodes), np.zeros(len(nodes)), span)
    return SimpleNamespace(scene=Scene(), sequence=s, equations=e, tables_at=lambda p: T, path=SimpleNamespace(tables=T)), x


def test_of_several_repetitions_the_first_one_gets_what_touches(monkeypatch):
    """An orbit of two periods, run through three times: its events two periods later each time, the born one in its place."""
    problem, x = problem_of([[0, 1, 1, 0, 0], [1, -1, 1, 0, 0], [1, 3, 0, 0, 0]], [0.3, 1.0, 1.6], 2.0)
    monkeypatch.setattr(appearing, "touches", lambda problem, x, near: [(0.9, 1, 2, np.array([5.0, 6.0]))])
    monkeypatch.setattr(appearing, "event_nodes", lambda *given: [[1, 2, 3, 0, 0], [3, 3, 1, 0, 0]])
    signature, at = inserted(problem, x, 3)
    rows = at[:-1].reshape(-1, 3)
    assert signature.span == 6.0 and at[-1] == 7.0
    assert rows[:, 0].tolist() == pytest.approx([0.3, 0.9, 0.9, 1.6, 2.3, 3.6, 4.3, 5.6])  # sections are left out
    assert signature.nodes[:, 1].tolist() == [1, 2, 3, 3, 1, 3, 1, 3]
    assert rows[1:3, 1:].tolist() == [[5.0, 6.0]] * 2 and rows[5].tolist() == pytest.approx([3.6, 20.0, 2.0])


def test_what_is_held_from_the_start_at_its_limit_is_first_not_held(monkeypatch):
    """The interval behind node 1 begins in mode 2 on the limit of guard 3: it goes through mode 3 before."""
    facts = [(sequence.PEAK_SEGMENT, 1), (sequence.PEAK_GUARD, 3), (sequence.PEAK, 1e-10), (sequence.PEAK_TIME, 0.6)]
    nodes, times = [[0, 1, 1, 0, 0], [1, 2, 2, 0, 0]], [0.2, 0.6]
    problem, x = problem_of(nodes, times, info=facts)
    monkeypatch.setattr(appearing, "event_nodes", lambda *given: [[2, 3, 3, 0, 0], [3, 2, 2, 0, 0]])
    signature, at = appearing.begun_beyond(problem, x)
    assert signature.nodes.tolist() == [[0, 1, 1, 0, 0], [1, 2, 3, 0, 0], [3, 2, 2, 0, 0]]
    assert at.tolist() == [0.2, 0.0, 0.0, 0.6, 10.0, 1.0, 0.6, 101.0, -1.0, 7.0]
    for place, value in ((sequence.PEAK_TIME, 0.61), (sequence.PEAK, 1e-6), (sequence.PEAK_SEGMENT, -1)):
        other, x = problem_of(nodes, times, info=[*facts, (place, value)])
        assert appearing.begun_beyond(other, x) is None
    monkeypatch.setattr(appearing, "event_nodes", lambda *given: [[2, 3, 2, 0, 0]])
    assert appearing.begun_beyond(problem, x) is None


def test_between_the_sides_of_a_reversal_a_mode_is_put_that_leads_on(monkeypatch):
    """Of the modes that may follow neither side of it counts; the guard that leads back is asked for."""
    asked = []

    def back(scene, T, mode, guard, middle, after, owner, joined):
        asked.append((mode, guard, middle, after, owner, joined.tolist()))
        return 1
    monkeypatch.setattr(appearing, "returning", back)
    problem, x = problem_of([[0, 3, 1, 0, 0], [1, 1, 2, 0, 0], [2, 3, 0, 0, 0]], [0.2, 0.6, 0.8], info=[(sequence.LEAVING_AT, 1)])
    signature, at = appearing.parted(problem, x)
    assert signature.nodes.tolist() == [[0, 3, 1, 0, 0], [1, 1, 3, 0, 0], [3, 1, 2, 0, 0], [2, 3, 0, 0, 0]]
    assert at.tolist() == pytest.approx([0.2, 0, 0, 0.6, 10, 1, 0.6, 10, 1, 0.8, 20, 2, 7])
    angle = 0.6 * 2.0 * np.pi
    assert len(asked) == 1 and asked[0][:5] == (1, 1, 3, 2, 0)
    assert asked[0][5] == pytest.approx([10.0, 1.0, 1.0, np.cos(angle), np.sin(angle)])
    assert appearing.parted(*problem_of([[0, 3, 1, 0, 0]], [0.2], info=[(sequence.LEAVING_AT, -1)])) is None


@pytest.mark.parametrize("value, found", [(1e-10, True), (1e-6, False)])
def test_a_guard_met_at_the_end_of_an_interval_is_put_before_it(value, found, monkeypatch):
    """Node 1 fires guard 1 of mode 1; guard 0 of its element is zero there too (to rounding): 1 -> 2 -> 3."""
    problem, x = problem_of([[3, 2, 1, 0, 0], [1, 1, 3, 0, 0]], [0.2, 0.6])

    def gradient(T, mode, guard, joined, row):
        row[:] = 0.0
        row[2] = value if (mode, guard) == (1, 0) else 5.0
    problem.equations.kernel.guard_gradient = gradient
    monkeypatch.setattr(appearing, "returning", lambda scene, T, mode, guard, other, target, owner, joined: 1 if (
        mode, guard, other, target, owner) == (1, 0, 2, 3, 0) else None)
    made = appearing.ended_beyond(problem, x)
    assert (made is not None) is found
    if found:
        assert made[0].nodes.tolist() == [[3, 2, 1, 0, 0], [1, 0, 2, 0, 0], [2, 1, 3, 0, 0]]
        assert made[1].tolist() == pytest.approx([0.2, 0.0, 0.0, 0.6, 10.0, 1.0, 0.6, 10.0, 1.0, 7.0])


@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_a_mode_leads_back_where_its_guard_vanishes_in_any_unit(size):
    """Slip ends with the load at its top: stick begins to slide back where spring and load pull with the friction, .3."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, (HarmonicForce(size), Coulomb(0.3 * size)), omega=W))
    up, stick, down = (scene.index((scene.keys[0][0], key)) for key in (SLIP_UP, STICK, SLIP_DOWN))
    for mode, guard in ((up, 0), (stick, 0), (stick, 1)):
        scene.expand(mode, guard)
    for place, want in ((1.3, 1), (1.3 + 1e-6, None), (0.7, None), (1.0, None)):
        assert returning(scene, scene.tables, up, 0, stick, down, 1, np.array([place * size, 0.0, 1.0, 1.0, 0.0])) == want
    assert returning(scene, scene.tables, down, 0, stick, up, 1, np.array([0.7 * size, 0.0, 1.0, 1.0, 0.0])) == 0


@pytest.mark.parametrize("count", [1, 2, 3])
def test_all_tops_that_touch_at_once_are_found(count):
    """The guard is -sin^2, of which each maximum is zero; states are the time and the angle."""
    def guard(t):
        return -np.sin(np.pi * count * (t - 0.11)) ** 2

    def peak(T, mode, q, x, length, first, low):
        t = x[0] + np.linspace(0.0, length, 20001)
        k = int(np.argmax(guard(t)))
        return guard(t[k]), t[k] - x[0]
    e = SimpleNamespace(scene=SimpleNamespace(ns=1),
                        kernel=SimpleNamespace(segment_peak=peak, guard_value=lambda T, m, q, x: guard(x[0])),
                        motion=SimpleNamespace(advance=lambda T, m, x, t, y: y.__setitem__(0, x[0] + t),
                                               forcing=lambda T, t, x: x.__setitem__(1, t)))
    found = appearing.tops(e, None, 0, 0, np.array([0.3, 0.3]), 0.3, 1.0, 0, 1e-7)
    np.testing.assert_allclose(np.array(found) + 0.3, [t for t in 0.11 + np.arange(9) / count if 0.3 < t < 1.3], atol=1e-4)
    after = appearing.moved(e, None, 0, np.array([0.3, 0.3]), 0.3, 0.25)
    assert after.tolist() == pytest.approx([0.55, 0.55])
    flat = SimpleNamespace(scene=e.scene, motion=e.motion, kernel=SimpleNamespace(
        segment_peak=lambda *a: (0.0, 0.5), guard_value=lambda *a: 0.0))
    assert appearing.tops(flat, None, 0, 0, np.array([0.3, 0.3]), 0.3, 1.0, 0, 1e-7) == [0.5]  # zero over a stretch: one


@pytest.mark.parametrize("later", [0.0, 1.0])
def test_an_orbit_of_two_periods_that_loses_its_last_event_has_one(later):
    """One impact of no speed in two periods, in the first or the second of them: what is left is the motion at phase zero."""
    problem, x, P = touching("rigid")
    T = problem.tables_at(x[-1])
    signature, at = inserted(problem, x, 2)
    assert signature.span == 2.0 and len(signature.nodes) == 1
    signature = Signature(divided(problem.scene, signature.nodes, T), signature.fixed, 2.0)
    at[0] += later
    new = problem.with_sequence(signature, at)
    left, y = dropped(new, new.x0, 1e-5)
    assert left.span == 1.0 and y[0] == 0.0 and left.nodes[:, 1].tolist() == [-1]
    np.testing.assert_allclose(y[1:3], [P.real, -W * P.imag], atol=1e-7)


# what simulation makes of a motion

def recorded(rows, times, before, speeds=None, after=None):
    return SimpleNamespace(rows=np.array(rows), times=np.array(times), before=np.array(before, float),
                           after=np.array(before if after is None else after, float), speeds=np.array(speeds or [0.0] * len(rows)))


def test_the_sequence_of_a_simulated_period_begins_behind_its_longest_interval():
    """From phase .25 of the second period of an orbit of two: events at 1.3, 2.1 and 2.9 forcing periods of length 2."""
    R = recorded([[0, -1, 0, PASSED, 0], [0, 1, 1, EVENT, 0], [1, -1, 1, PASSED, 1], [1, 0, 1, EVENT, 1], [1, 2, 1, GRAZE, 1],
                  [1, 3, 0, CHATTER, 1]], [0.5, 0.6, 0.0, 0.2, 1.0, 1.8], [[k, -k] for k in range(6)])
    orbit = SimpleNamespace(scene=SimpleNamespace(n=1, ns=2), forcing_period=2.0, autonomous=False,
                            _whole=(SimpleNamespace(span=2.0, clock=0.0),))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(successor, "mark_trains", lambda nodes, speeds: None)
        patch.setattr(instants, "over", lambda scene, nodes, rows, span: (nodes, rows))
        signature, unknowns = successor.sequence_of(orbit, SimpleNamespace(recorded=R), 1.0)
    rows = unknowns.reshape(-1, 3)  # gaps are .8, .8 and .4: the first of the longest lies before the second event
    assert rows[:, 0].tolist() == pytest.approx([0.1, 0.9, 1.3]) and rows[:, 1].tolist() == [3.0, 5.0, 1.0]
    assert signature.nodes.tolist() == [[1, 0, 1, 0, 0], [1, 3, 0, 0, 1], [0, 1, 1, 0, 0]] and signature.span == 2.0
    R.rows[-1, 2] = 2  # it does not come back to its mode
    assert successor.sequence_of(orbit, SimpleNamespace(recorded=R), 1.0) is None


def test_memory_that_is_written_in_a_simulated_period_begins_with_the_value_that_it_ends_with():
    """Of three memories one is never written, one twice, one by the last event alone: what it was at the start is stale."""
    R = recorded([[0, 0, 0, EVENT, 0]] * 4, [0.0] * 4, [[0, 0, 7, 9, 9], [1, 0, 7, 9, 9], [2, 0, 7, 4, 9], [3, 0, 7, 4, 9]],
                 after=[[0, 0, 7, 9, 9], [1, 0, 7, 4, 9], [2, 0, 7, 4, 9], [3, 0, 7, 5, 6]])
    found = successor.remembered(R, [1, 2, 3], 1)
    assert found.tolist() == [[1, 0, 7, 5, 6], [2, 0, 7, 4, 6], [3, 0, 7, 4, 6]]
    assert R.before[1].tolist() == [1, 0, 7, 9, 9]  # what was recorded is left as it is


def test_of_a_motion_without_events_the_state_at_the_next_section_is_taken():
    R = recorded([[4, -1, 4, PASSED, 0], [4, 0, 4, GRAZE, 0]], [0.0, 0.0], [[0, 0], [0, 0]])
    orbit = SimpleNamespace(scene=SimpleNamespace(n=1, ns=2), forcing_period=2.0, autonomous=False,
                            _whole=(SimpleNamespace(span=3.0, clock=0.0),))

    class Motion:
        recorded, t = R, [0.7]

        def __call__(self, t):
            return np.array([t, 10.0 * t])
    signature, unknowns = successor.sequence_of(orbit, Motion(), 0.0)
    assert unknowns.tolist() == pytest.approx([0.0, 2.0, 20.0]) and signature.span == 1.0
    assert signature.nodes.tolist() == [[4, -1, 4, 0, 0]]


class Wave:
    """A motion of one or more periods, cos and sin of an angle, with events at given times."""

    weights = np.array([2.0, 0.5])

    def __init__(self, times, periods=1, shift=0.0, bend=0.0, autonomous=False):
        self.periods, self.autonomous, self.shift, self.bend = periods, autonomous, shift, bend
        self._whole = (SimpleNamespace(span=float(periods), nodes=np.zeros((len(times), 5))),
                       np.array([[t, 0.0, 0.0] for t in times]).ravel())

    def _states(self, t):
        angle = 2.0 * np.pi * (np.asarray(t) - self.shift) / (self.periods if self.autonomous else 1.0)
        return np.column_stack([np.cos(angle), np.sin(angle) + self.bend * (np.floor(t) % 2)])


def test_motions_are_compared_in_the_middles_of_the_longer_intervals_of_both():
    one = Wave([0.1, 0.105, 0.6])
    assert successor.distance(one, Wave([0.2])) == 0.0
    other = Wave([0.2], shift=0.01)
    middles = np.array([0.3525, 0.85, 0.7])  # not that of the short one
    away = np.abs(one._states(middles) - other._states(middles)) / one.weights
    assert successor.distance(one, other) == pytest.approx(away.max())
    double = Wave([0.3, 0.9, 1.4], 2, bend=0.3)  # only the second period differs, where the other has none
    assert successor.distance(one, double) == pytest.approx(0.0, abs=1e-12)
    assert successor.distance(double, Wave([0.2, 1.2], 2)) == pytest.approx(0.3 / 0.5)


def test_orbits_without_a_clock_are_compared_where_they_are_alike():
    one, other = Wave([0.0, 0.4], 3, autonomous=True), Wave([0.0], 3, shift=1.234, autonomous=True)
    assert successor.ahead(one, other) % 3.0 == pytest.approx(1.234, abs=1e-6)
    assert successor.distance(one, other) == pytest.approx(0.0, abs=1e-5)
    assert successor.distance(one, Wave([0.0], 3, shift=1.234, bend=0.2, autonomous=True)) > 0.05


def test_orbits_without_a_clock_are_compared_in_the_middles_of_the_intervals_of_both(monkeypatch):
    """Each at its own time: those of the first are as much earlier as the second is ahead."""
    asked = {}

    class Seen(Wave):
        def _states(self, t):
            asked.setdefault(self.shift, []).extend(np.asarray(t).tolist())
            return super()._states(t)

    one, other = Seen([0.0, 0.4], 3, autonomous=True), Seen([0.5, 1.5], 3, shift=1.234, autonomous=True)
    monkeypatch.setattr(successor, "ahead", lambda one, other: 1.234)
    assert successor.distance(one, other) == pytest.approx(0.0, abs=1e-12)
    middles = np.array([0.2, 1.7, 1.0 - 1.234, 2.5 - 1.234])
    for times, wanted in ((asked[0.0], middles), (asked[1.234], middles + 1.234)):
        np.testing.assert_allclose(sorted(np.mod(times, 3.0)), sorted(np.mod(wanted, 3.0)), atol=1e-12)


# what is none

def kicked(ratio, closes, row):
    T = SimpleNamespace(kick=np.array([[1]]), ratio=np.array([[ratio]]), GT=np.zeros((1, 1, 3, 2)), n_holds=np.array([0, 1]),
                        H=np.zeros((2, 1, 3)))
    T.GT[0, 0, :, 1], T.H[1, 0] = [0.0, 2.0, 0.5], row
    return SimpleNamespace(scene=SimpleNamespace(tables=T), sequence=SimpleNamespace(nodes=np.array([[0, 0, 1, 0, closes]])))


@pytest.mark.parametrize("ratio, closes, row, wrong", [
    (0.5, 0, [0.0, -1.0, -0.25], True),  # held is the speed that the impact throws back
    (0.0, 0, [0.0, -1.0, -0.25], False), (0.5, 1, [0.0, -1.0, -0.25], False), (0.5, 0, [0.0, 1.0, -0.25], False)])
def test_an_impact_with_rebound_is_not_followed_by_rest(ratio, closes, row, wrong):
    assert successor.rebounds(kicked(ratio, closes, row)) is wrong


@pytest.mark.parametrize("slope, order, first, clear", [
    (1.0, 0, [0, 0], True), (1e-12, 0, [0, 0], False), (1e-12, TOGETHER, [0, 0], True), (1e-12, 0, [1, 1], True),
    (1e-12, 0, [0, 1], False)])
def test_an_interval_shorter_than_what_rounding_makes_of_its_end_is_not_determined(slope, order, first, clear):
    """The second time follows from an equation of a given slope: rounding of .5 * 2.2e-16 * slope has an effect of 1e-16/slope."""
    nodes = np.array([[0, 0, 0, 0, 0], [0, 1, 0, order, 0]])
    J = np.diag([1.0, 1.0, slope, 1.0])
    J[2, 1] = 1.0  # a term of size 1 in the equation
    scene = SimpleNamespace(ns=1, tables=SimpleNamespace(kick=np.array([first])))
    s = SimpleNamespace(nodes=nodes, span=1.0, creeping=lambda scene: [], unmoved=lambda scene: [],
                        written_out=lambda U: (SimpleNamespace(span=1.0, clock=1.0), U))
    problem = SimpleNamespace(sequence=s, scene=scene, jacobian=lambda u, p: (J, np.zeros(4)), scale=np.ones(5))
    tangent = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    assert successor.determined(problem, SimpleNamespace(x=np.array([0.3, 1.0, 0.3 + 1e-5, 1.0, 5.0]), tangent=tangent)) is clear
    s.creeping = lambda scene: [0]
    assert not successor.determined(problem, SimpleNamespace(x=np.array([0.3, 1.0, 0.8, 1.0, 5.0]), tangent=tangent))


@pytest.mark.parametrize("apart, clear", [(1e-7, True), (1e-9, True), (1e-16, False)])
def test_what_rounding_does_to_both_ends_of_an_interval_is_nothing_to_its_duration(apart, clear):
    """Both times follow from one badly determined number, to 1e-6: their difference is an equation of its own."""
    J = np.array([[1e-10, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    J[0, 1] = 1.0  # a term of size 1 in the equation of the first time
    s = SimpleNamespace(nodes=np.array([[0, 0, 0, 0, 0], [0, 1, 0, 0, 0]]), span=1.0, creeping=lambda scene: [],
                        unmoved=lambda scene: [], written_out=lambda U: (SimpleNamespace(span=1.0, clock=1.0), U))
    problem = SimpleNamespace(sequence=s, scene=SimpleNamespace(ns=1, tables=SimpleNamespace(kick=np.array([[0, 0]]))),
                              jacobian=lambda u, p: (J, np.zeros(4)), scale=np.ones(5))
    c = SimpleNamespace(x=np.array([0.3, 1.0, 0.3 + apart, 1.0, 5.0]), tangent=np.array([0.0, 0.0, 0.0, 0.0, 1.0]))
    assert successor.determined(problem, c) is clear


@pytest.mark.parametrize("slope", [1.0, 1e-6, 1e-13, 0.0])
def test_an_interval_is_determined_where_the_parameter_turns(slope):
    """The second time is s and the parameter slope * s + s**2 / 2: at fixed parameter rounding moves it by its inverse slope, along
    the branch, whose tangent is that of the time, by rounding alone."""
    J = np.diag([1.0, 1.0, slope, 1.0])
    problem = SimpleNamespace(
        sequence=SimpleNamespace(nodes=np.array([[0, 0, 0, 0, 0], [0, 1, 0, 0, 0]]), span=1.0, creeping=lambda scene: [],
                                 unmoved=lambda scene: [], written_out=lambda U: (SimpleNamespace(span=1.0, clock=1.0), U)),
        scene=SimpleNamespace(ns=1, tables=SimpleNamespace(kick=np.array([[0, 0]]))), scale=np.ones(5),
        jacobian=lambda u, p: (J, np.array([0.0, 0.0, -1.0, 0.0])))
    tangent = np.array([0.0, 0.0, 1.0, 0.0, slope]) / np.hypot(1.0, slope)
    assert successor.determined(problem, SimpleNamespace(x=np.array([0.3, 1.0, 0.3 + 1e-5, 1.0, 5.0]), tangent=tangent))
