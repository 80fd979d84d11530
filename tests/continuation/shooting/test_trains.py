"""Trains of impacts, on plain numbers: where they complete, how they are lengthened and shortened, what rests at their end."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.shooting import completion, train_length
from bifurc.continuation.shooting.completion import Completion, ratio
from bifurc.orbits.shooting.signature import Signature

R = 0.4
RHO = ratio(R)
AXIS = np.array([0.0, 1.0])  # impacts change the velocity


class Scene:
    """Modes 0 (free) and 1 (rest), mirrored 2 and 3; guard 0 is the stop, guard 1 another element's; of mode 1 guard 0 lets go."""

    n, ns = 1, 2

    def mirror(self, mode):
        return (mode + 2) % 4

    def mirror_guard(self, mode, guard):
        return 1 - guard

    def guard(self, mode, guard):
        return SimpleNamespace(element=guard)

    def guards_of(self, mode, element):
        return [element]

    def event_kind(self, mode, guard):
        return completion.EventKind.RELEASE if mode == 1 else completion.EventKind.IMPACT


class Problem:
    """An orbit whose impacts arrive with the velocity of their state; its restitution is the parameter."""

    scale = np.ones(99)

    def __init__(self, nodes, span=1.0, closure=1, clock=0.0):
        nodes = np.array(nodes, np.int64)
        self.sequence, self.scene = Signature(nodes, np.zeros(len(nodes)), span, closure, clock), Scene()
        self.equations = SimpleNamespace(numbers_at=self.numbers, kernel=None)

    def numbers(self, p):
        kick = np.array([[1, 0]] * 4)
        return SimpleNamespace(ratio=np.full((4, 2), p), kick=kick, ends_in=np.where(kick, 1, -1), B=np.tile(AXIS, (4, 2, 1)),
                               D=np.full((4, 2, 1), 7.0))

    def arriving(self, node, unknowns):
        return float(unknowns[-1])


@pytest.fixture(autouse=True)
def nothing_is_held(monkeypatch):
    monkeypatch.setattr(completion, "moved_row", lambda T, m, g: -1)
    monkeypatch.setattr(completion, "flight_mode", lambda T, m, g: (m, -1))


HIT, LAST, GO = [0, 0, 0, 0, 2], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0]


def boundary(count, release=0.9, first=0.5, speed=0.3):
    """Return times and speeds of impacts on the boundary: times left fall by rho, speeds by its square."""
    k = np.arange(count)
    return release - first * RHO**k, speed * RHO**(2 * k)


def packed(times, speeds, p=R, places=0.2):
    return np.append(np.column_stack([times, np.full(len(times), places), speeds]).ravel(), p)


# places

def test_nodes_of_other_periods_are_the_same_later_and_mirrored_where_half_a_period_is_listed():
    nodes = [[0, 0, 0, 0, 2], [0, 1, 1, 0, 1], [1, 0, 0, 0, 0]]
    whole, half = Problem(nodes, 2.0), Problem(nodes, 0.5, -1)
    x = packed([0.1, 0.3, 0.45], [1.0, 2.0, 3.0])
    assert [completion.node_at(whole, k) for k in (-3, 1, 5)] == [[0, 0, 0, 0, 2], [0, 1, 1, 0, 1], [1, 0, 0, 0, 0]]
    assert completion.node_at(half, 3) == [2, 1, 2, 0, 2] and completion.node_at(half, -2) == [2, 0, 3, 0, 1]
    assert completion.node_at(half, 6) == completion.node_at(half, 0) == nodes[0]
    assert [completion.time_of(whole, x, k) for k in (1, 4, -2)] == pytest.approx([0.3, 2.3, -1.7])
    assert [completion.time_of(half, x, k) for k in (2, 5, -1)] == pytest.approx([0.45, 0.95, -0.05])
    assert completion.state_at(half, x, 4).tolist() == [-0.2, -2.0] and completion.state_at(half, x, 7).tolist() == [0.2, 2.0]
    assert completion.state_at(whole, x, 4).tolist() == [0.2, 2.0]
    free = Problem(nodes, 0.0, 1, 1.0)  # the first unknown is the period 1.7, its node is at time zero
    x[0] = 1.7
    assert [completion.time_of(free, x, k) for k in (0, 1, 3, 5, -1)] == pytest.approx([0.0, 0.3, 1.7, 2.15, -1.25])


@pytest.mark.parametrize("span, closure, clock", [(1.0, 1, 0.0), (0.95, -1, 0.0), (0.0, 1, 1.0)])
def test_the_condition_is_zero_on_the_boundary_and_its_gradient_that_of_differences(span, closure, clock):
    """Impacts 4, 5 and the first of the next period, with the release behind it."""
    nodes = [LAST, GO, *[HIT] * 4]
    problem = Problem(nodes, span, closure, clock)
    length = span or 1.3
    times, speeds = boundary(5, 1.4)
    x = packed([times[4] - length, 1.4 - length, *times[:4]], [0.1] * 6)
    if clock:
        x[:-1:3] -= x[0]
        x[0] = length
    own = Completion(problem, (4, 5, 6), 7)
    assert own.of(problem, x) == pytest.approx(0.0, abs=1e-12)
    moved = x.copy()
    moved[5 * 3] += 0.01  # by hand, off the boundary
    left = [completion.time_of(problem, moved, 7) - completion.time_of(problem, moved, k) for k in (4, 5, 6)]
    assert own.of(problem, moved) == pytest.approx((left[2] / left[1] - RHO * left[1] / left[0]) / (1.0 - RHO) - RHO)
    gradient = own.gradient(problem, moved)
    for i in range(x.size):
        h = np.zeros(x.size)
        h[i] = 1e-6
        assert gradient[i] == pytest.approx((own.of(problem, moved + h) - own.of(problem, moved - h)) / 2e-6, abs=1e-6)
    assert np.count_nonzero(np.abs(gradient[:-1]) > 1e-6) == 4


@pytest.mark.parametrize("span, closure, clock", [(1.0, 1, 0.0), (1.0, -1, 0.0), (0.0, 1, 1.0)])
def test_impacts_are_put_on_the_boundary_behind_a_good_one(span, closure, clock):
    """The two last impacts lie in the next period: their rows are those of a period before, of half a period mirrored."""
    problem = Problem([HIT, LAST, GO, *[HIT] * 3], span, closure, clock)
    length = span or 1.5
    times, speeds = boundary(5, 1.8)
    side = -1.0 if closure < 0 else 1.0
    rows = np.column_stack([[*(times[3:] - length), 1.8 - length, *times[:3]], [0.2 * side] * 3 + [0.2] * 3,
                            [*(side * speeds[3:]), side * 5.0, *speeds[:3]]])
    shift = 0.0
    if clock:
        shift = rows[0, 0]
        rows[:, 0] -= shift
        rows[0, 0] = length
    wanted = np.append(rows.ravel(), R)
    poor = rows.copy()
    poor[[0, 1], 2] *= 1.3
    poor[1, 0] += 0.02
    if not clock:
        poor[0, 0] -= 0.01
    found = completion.on_boundary(problem, np.append(poor.ravel(), R), [3, 4, 5, 6, 7], 8, 2)
    if clock:  # the first node has no time of its own, what is written there is nothing
        found[0] = wanted[0]
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    assert completion.falling(problem, wanted, [3, 4, 5, 6, 7], 8)
    assert not completion.falling(problem, wanted, [3, 5, 4, 6, 7], 8)
    assert not completion.falling(problem, wanted, [3, 4, 5, 6, 7], 7)


def test_motions_that_rest_are_made_of_a_train_that_never_does(monkeypatch):
    """All impacts lie on the boundary of the release at .9: the rest of the train follows them, down to next to no time left."""
    made = []
    monkeypatch.setattr(completion, "relisted", lambda *given: made.append(given) or given)
    times, speeds = boundary(8)
    problem = Problem([*[[0, 0, 0, 0, 0]] * 8, [0, 1, 0, 0, 0]])
    x = packed([*times, 0.95], [*speeds, 0.0])
    _, _, nodes, at, states = completion.resting(problem, x)
    deep = int(np.ceil(np.log(completion.DEEP[1] / 0.5) / np.log(RHO))) + 1
    more = np.array(boundary(deep)).T
    np.testing.assert_allclose(at[1:-1], more[:, 0], atol=1e-13)
    assert at[-1] == pytest.approx(0.9, abs=1e-13)
    np.testing.assert_allclose(np.array(states)[1:-1, 1], more[:, 1], rtol=1e-9)
    np.testing.assert_allclose(np.array(states)[1:-1, 0], 0.2)
    assert states[-1].tolist() == pytest.approx([0.2, 0.0], abs=1e-14)
    assert nodes[0] == [0, 1, 0, 0, 0] and at[0] == pytest.approx(-0.05)  # the other event, of the period before
    assert nodes[-2] == LAST and nodes[-1] == GO and all(node == HIT for node in nodes[1:-2])
    short = Problem([*[[0, 0, 0, 0, 0]] * 5, [0, 1, 0, 0, 0]])
    assert completion.resting(short, packed([*times[:5], 0.95], [*speeds[:5], 0.0])) is None
    slow = packed([*np.linspace(0.1, 0.8, 8), 0.95], [*speeds, 0.0])  # no geometric sequence
    assert completion.resting(problem, slow) is None


# more and fewer impacts

Q = 0.55


@pytest.fixture
def listing(monkeypatch):
    monkeypatch.setattr(train_length, "relisted",
                        lambda problem, x, nodes, times, states: (nodes, np.array(times), np.array(states)))


def falling_train(count, unit):
    """Return a problem, and times and states of ``count`` flights of ``unit`` nodes: all that is left falls by Q."""
    turn = [0, 1, 0, 0, 2]
    nodes = [[0, 1, 0, 0, 0]]
    for _ in range(count - 1):
        nodes += [HIT] if unit == 1 else [HIT, turn]
    nodes.append(LAST)
    k = np.arange(len(nodes) - 1)
    left = 0.6 * Q**(k // unit) * np.where(k % unit, 0.8, 1.0)
    times, speeds = np.append(0.05, 0.95 - left), np.append(9.0, 0.3 * Q**(k // unit) * np.where(k % unit, -0.4, 1.0))
    return Problem(nodes), times, speeds


@pytest.mark.parametrize("unit", [1, 2])
@pytest.mark.parametrize("change", [1, 3])
def test_a_train_is_lengthened_and_shortened_by_its_own_factor(unit, change, listing):
    for count, other, function in ((4, 4 + change, train_length.longer), (6, 6 - change, train_length.shorter)):
        problem, times, speeds = falling_train(count, unit)
        want, at, v = falling_train(other, unit)
        nodes, found, states = function(problem, packed(times, speeds), change)
        assert nodes == want.sequence.nodes.tolist()
        np.testing.assert_allclose(found, at, atol=1e-13)
        np.testing.assert_allclose(states, np.column_stack([np.full(len(at), 0.2), v]), atol=1e-13)


@pytest.mark.parametrize("unit, most", [(1, 3), (2, 2)])
def test_no_more_impacts_are_left_out_than_the_train_has(unit, most, listing):
    """Of a train with an event of friction in every flight one flight stays: it says which event comes first."""
    problem, times, speeds = falling_train(4, unit)
    assert train_length.shorter(problem, packed(times, speeds), most) is not None
    assert train_length.shorter(problem, packed(times, speeds), most + 1) is None
    alone = Problem([[0, 1, 0, 0, 0], LAST])
    assert train_length.shorter(alone, packed([0.1, 0.4], [1.0, 2.0])) is None
    assert train_length.longer(alone, packed([0.1, 0.4], [1.0, 2.0])) is None
    rising = packed(times, speeds[::-1])
    if unit == 1:
        assert train_length.longer(problem, rising) is None


@pytest.mark.parametrize("rests", [(0.1, 0.02), (0.02, 0.1)])
@pytest.mark.parametrize("first", [0, 3, 8])
def test_of_several_trains_of_a_period_the_one_with_the_shortest_rest_is_told(rests, first):
    """Two trains of six impacts, each with its rest; the period may begin within one of them.  A seventh impact before the
    second train is none of it, and a train of five is none at all."""
    inside, last, release, before = [0, 0, 0, 0, 2], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0], [0, 0, 0, 0, 0]
    nodes = [*[inside] * 5, last, release, before, *[inside] * 5, last, release]
    times, t = [], 0.0
    for rest in rests:
        times += [t + 0.05 * k for k in range(1 if rest is rests[0] else 0, 7)] + [t + 0.3 + rest]
        t = 0.5
    places = {0: [0, 1, 2, 3, 4, 5], 1: [8, 9, 10, 11, 12, 13]}[int(np.argmin(rests))]
    nodes, times = nodes[first:] + nodes[:first], np.array(times[first:] + [value + 1.0 for value in times[:first]])
    x = np.append(np.column_stack([times, np.zeros((len(nodes), 2))]).ravel(), R)
    impacts, let_go = completion.train(Problem(nodes), x)
    count = len(nodes)
    assert [k % count for k in impacts] == [(k - first) % count for k in places] and np.all(np.diff(impacts) == 1)
    assert let_go == impacts[-1] + 1 and impacts[-1] >= 0
    short = Problem([*[inside] * 4, last, release])
    assert completion.train(short, np.append(np.column_stack([0.1 * np.arange(6), np.zeros((6, 2))]).ravel(), R)) is None
