"""Orbits that branch off, on stand-ins: what two halves differ in, where they merge, what is tried and in which order."""
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.continuation.kinds import CorrectorStatus, SpecialPointKind
from bifurc.continuation.problem import Corrected
from bifurc.continuation.shooting import branching, vanishing
from bifurc.continuation.shooting import problem as problems
from bifurc.continuation.shooting.problem import OrbitProblem
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.shooting.sequence import AFTER, BEFORE, GUARD
from bifurc.orbits.shooting.signature import Signature

NS = 2
NODE = [[0, 1, 0, 0, 0], [0, 2, 1, 0, 0]]
SCALE = np.array([0.5, 2.0, 8.0, 0.5, 4.0, 1.0, 0.5, 2.0, 8.0, 0.5, 4.0, 1.0, 3.0])


def signature(span=2.0, nodes=NODE, closure=1, clock=0.0, twice=True):
    nodes = np.array(nodes * 2 if twice else nodes)
    return Signature(nodes, np.zeros(len(nodes)), span, closure, clock)


def doubled(first, second, span=2.0, p=0.7):
    """Return the unknowns of an orbit whose second half begins half its span later."""
    later = np.array(second, float)
    later[:, 0] += 0.5 * span
    return np.concatenate([np.ravel(first), later.ravel(), [p]])


FIRST = np.array([[0.1, 1.0, -2.0], [0.6, -0.5, 4.0]])


@pytest.mark.parametrize("span", [2.0, 4.0, 6.0])
def test_the_measure_of_two_halves(span, rng):
    s = signature(span)
    second = FIRST + 1e-2 * rng.normal(size=FIRST.shape)
    x0 = doubled(FIRST, second, span)
    difference = (FIRST - second).ravel() / SCALE[:6]
    np.testing.assert_allclose(branching.half_difference(s, x0, SCALE), difference, atol=1e-14)
    row, constant = branching.halves(s, x0, SCALE, None)

    def value(x):
        return float(row @ x) + constant
    assert value(x0) == pytest.approx(np.linalg.norm(difference))
    assert value(doubled(second, FIRST, span)) == pytest.approx(-np.linalg.norm(difference))  # begun half the span later
    assert value(doubled(FIRST + 0.3, FIRST + 0.3, span, p=9.0)) == pytest.approx(0.0, abs=1e-14)
    assert np.linalg.norm(row[:6] * SCALE[:6]) == pytest.approx(1.0) and row[-1] == 0.0
    other = doubled(FIRST, second + 1e-2 * rng.normal(size=FIRST.shape), span)
    assert value(other) == pytest.approx(branching.half_difference(s, other, SCALE) @ difference / np.linalg.norm(difference))


def test_halves_of_an_orbit_whose_period_is_unknown_have_periods_of_their_own(rng):
    """The first time among the unknowns is the period: a doubled orbit is one of 2.3 and one of 2.5, from 0 and from 2.3."""
    s, single = signature(0.0, clock=1.0), signature(0.0, clock=1.0, twice=False)
    first, second = np.array([[2.3, 1.0, -2.0], [0.6, -0.5, 4.0]]), np.array([[2.5, 1.1, -2.1], [0.7, -0.4, 4.2]])
    x = np.append(branching.joined(single, first.ravel(), second.ravel(), 0.0), 0.7)
    np.testing.assert_allclose(x[:-1].reshape(4, 3)[:, 0], [4.8, 0.6, 2.3, 3.0], rtol=1e-15)
    np.testing.assert_allclose(branching.parts(s, x, 0.0), [first.ravel(), second.ravel()], rtol=1e-14)
    difference = (first - second).ravel() / SCALE[:6]
    np.testing.assert_allclose(branching.half_difference(s, x, SCALE), difference, rtol=0, atol=1e-14)
    row, constant = branching.halves(s, x, SCALE, None)
    assert row @ x + constant == pytest.approx(np.linalg.norm(difference))
    twice = np.append(branching.joined(single, first.ravel(), first.ravel(), 0.0), 0.9)
    assert row @ twice + constant == pytest.approx(0.0, abs=1e-14)


def test_orbits_that_are_no_doubled_ones_have_no_halves():
    x0 = doubled(FIRST, FIRST + 0.01)
    for s in (signature(1.0), signature(3.0), signature(closure=-1),
              signature(nodes=[*NODE, [0, 1, 0, 0, 0], [0, 3, 1, 0, 0]], twice=False)):
        assert branching.halves(s, x0, SCALE, None) is None
    three = signature(nodes=[*NODE, NODE[0]], twice=False)
    assert branching.halves(three, np.zeros(10), np.ones(10), None) is None


def test_where_the_halves_are_alike_what_leaves_tells_them_apart(rng):
    """The solutions of [F_u F_p] are the branch of the single orbit, run through twice, and the direction in which it doubles."""
    along, apart = rng.normal(size=6), rng.normal(size=6)
    plane = np.array([np.concatenate([along, along, [0.4]]), np.concatenate([apart, -apart, [0.0]])])
    rest = np.linalg.svd(plane)[2][2:]
    wide = np.vstack([rng.normal(size=(11, 11)) @ rest, np.zeros(13)])
    x0 = doubled(FIRST, FIRST)
    row, constant = branching.halves(signature(), x0, SCALE, lambda: wide)
    cosine = row[:6] * SCALE[:6] @ apart / np.linalg.norm(apart)
    assert abs(cosine) == pytest.approx(1.0, abs=1e-9)
    assert row @ x0 + constant == pytest.approx(0.0, abs=1e-12)
    single = np.linalg.svd(plane[:1])[2][1:]
    assert branching.halves(signature(), x0, SCALE, lambda: rng.normal(size=(12, 12)) @ single) is None


def test_directions_along_which_the_halves_come_apart(rng):
    one = signature(nodes=NODE[:1])
    along, apart = rng.normal(size=3), rng.normal(size=3)
    same, other = np.concatenate([along, along, [0.5]]), np.concatenate([apart, -apart, [0.0]])
    given = np.array([same / np.linalg.norm(same), other / np.linalg.norm(other)])
    np.testing.assert_array_equal(branching.splitting(one, given), given[1:])
    np.testing.assert_array_equal(branching.splitting(one, given[::-1]), given[1:])
    np.testing.assert_array_equal(branching.splitting(one, given[:1]), given[:1])  # none: all
    mixed = np.array([(given[0] + given[1]) / math.sqrt(2.0), given[0]])
    np.testing.assert_array_equal(branching.splitting(one, mixed), mixed[:1])


def test_a_difference_that_turns_is_told_from_one_that_passes_zero():
    problem = SimpleNamespace(sequence=signature(), scale=SCALE)
    step = np.zeros((2, 3))
    step[0, 1], away = 1e-3, np.zeros((2, 3))
    away[1, 2] = 1e-2
    a = doubled(FIRST, FIRST + step)
    assert branching.turned(problem, a, doubled(FIRST, FIRST + 3.0 * step))
    assert not branching.turned(problem, a, doubled(FIRST, FIRST - step))
    assert not branching.turned(problem, a, doubled(FIRST, FIRST + away))
    assert not branching.turned(problem, a, doubled(FIRST, FIRST))
    for cosine, answer in ((0.45, False), (0.55, True)):
        sine = math.sqrt(1.0 - cosine**2)
        b = cosine * step + sine * away * (1e-3 / 2.0) / (1e-2 / 1.0)
        assert branching.turned(problem, a, doubled(FIRST, FIRST + b)) is answer
        assert branching.turned(problem, doubled(FIRST, FIRST + b), a) is answer


def test_the_critical_vector_is_the_kernel_in_own_units(rng):
    v = rng.normal(size=6)
    kernel = np.linalg.svd(v[None])[2][1:]
    J = np.vstack([rng.normal(size=(5, 5)) @ kernel, np.zeros(6)])
    asked = []
    problem = SimpleNamespace(scale=SCALE[6:], wrapped_jacobian=lambda x, mu: asked.append((x, mu)) or J)
    found = branching.critical(problem, "x")
    assert asked == [("x", -1.0)]
    assert abs(found @ v) == pytest.approx(np.linalg.norm(found) * np.linalg.norm(v), rel=1e-12)
    assert np.linalg.norm(found / SCALE[6:-1]) == pytest.approx(1.0)


# steps to what branches off

class Tried:
    """A problem whose corrections are told in advance, with what was asked."""

    def __init__(self, answers, scale):
        self.answers, self.scale, self.asked = list(answers), scale, []

    def correct(self, x, tangent, fixed=False):
        self.asked.append((x.copy(), tangent.copy(), fixed))
        return self.answers.pop(0)

    def solution(self, x):
        return SimpleNamespace(x=x, success=x[0] > 0.0)


def answer(x, converged=True, valid=True):
    return SimpleNamespace(x=np.array(x, float), converged=converged, valid=valid)


def test_the_first_good_step_out_is_taken(monkeypatch):
    monkeypatch.setattr(branching, "inside", lambda problem, c: c.valid)
    monkeypatch.setattr(branching, "reduced", lambda orbit: ("least", orbit.x[0]))
    scale, x, direction = np.array([2.0, 0.5, 4.0]), np.array([1.0, 2.0, 3.0]), np.array([6.0, 0.0, 16.0])
    problem = Tried([answer([1.0], converged=False), answer([2.0], valid=False), answer([-3.0]), answer([4.0])], scale)
    assert branching.stepped_out(problem, x, direction) == ("least", 4.0)
    lengths = []
    for guess, tangent, _ in problem.asked:
        np.testing.assert_allclose(tangent, [0.6, 0.0, 0.8])
        moved = (guess - x) / scale
        lengths.append(float(moved @ tangent))
        np.testing.assert_allclose(moved, lengths[-1] * tangent, atol=1e-15)
    assert all(0.0 < length <= 0.05 for length in lengths) and len(set(np.round(lengths, 12))) == 4
    bad = Tried([answer([1.0], converged=False)] * 4, scale)
    assert branching.stepped_out(bad, x, direction) is None and not bad.answers


@pytest.fixture
def steps(monkeypatch):
    """Orbits stepped out to are what was asked: (problem, start, direction)."""
    asked = []

    def stepped_out(problem, x, direction):
        asked.append((problem, x.copy(), direction.copy()))
        return None if len(asked) in asked_none else f"orbit {len(asked)}"
    asked_none: list[int] = []
    monkeypatch.setattr(branching, "stepped_out", stepped_out)
    monkeypatch.setattr(branching, "critical", lambda problem, x: np.arange(1.0, len(x)))
    return SimpleNamespace(asked=asked, none=asked_none)


class Single:
    """A problem of an orbit of two nodes that is given other sequences."""

    def __init__(self, closure=1, span=1.0):
        self.sequence = Signature(np.array(NODE), np.array([0.2, 0.3]), span, closure)
        self.scale, self.scene, self.made = SCALE[6:], "scene", []

    def with_sequence(self, sequence, start):
        self.made.append((sequence, np.array(start)))
        return SimpleNamespace(sequence=sequence, x0=np.array(start), scale=np.ones(len(start)), with_sequence=self.with_sequence)


def test_a_doubled_orbit_begins_as_the_orbit_run_through_twice(steps):
    problem = Single(span=3.0)
    x = np.append(FIRST.ravel(), 0.7)
    point = SimpleNamespace(x=x, kind=SpecialPointKind.PERIOD_DOUBLING)
    assert branching.doubled(problem, point) == ("orbit 1",)
    (s, guess), (_, start, direction) = problem.made[0], steps.asked[0]
    assert s.span == 6.0 and s.closure == 1 and s.nodes.tolist() == NODE * 2
    np.testing.assert_allclose(s.fixed, [0.2, 0.3, 3.2, 3.3])
    np.testing.assert_allclose(start, doubled(FIRST, FIRST, 6.0))
    v = np.arange(1.0, 7.0)
    np.testing.assert_allclose(direction, [*v, *-v, 0.0])
    assert 0.0 < np.abs(guess - start).max() < 1e-4
    np.testing.assert_allclose(branching.half_difference(s, guess, SCALE) * SCALE[:6], 2e-6 * v, rtol=1e-6)
    steps.none.append(2)
    assert branching.doubled(problem, point) == ()


def test_mirror_images_and_crossing_branches_are_tried_to_both_sides(steps, monkeypatch):
    problem = Single(closure=-1, span=0.5)
    x, whole = np.append(FIRST.ravel(), 0.7), signature(1.0)
    monkeypatch.setattr(branching, "repeated", lambda scene, s, U: (whole, np.concatenate([U, -U])))
    point = SimpleNamespace(x=x)
    assert branching.symmetry_broken(problem, point) == ("orbit 1", "orbit 2")
    (_, start, plus), (_, _, minus) = steps.asked
    np.testing.assert_allclose(start, [*x[:-1], *-x[:-1], 0.7])
    v = np.arange(1.0, 7.0)
    other = np.array([-1.0, 2.0, 3.0, -4.0, 5.0, 6.0])  # states of the mirror image move alike, its times the other way
    np.testing.assert_allclose(plus, [*v, *other, 0.0])
    np.testing.assert_array_equal(minus, -plus)
    steps.asked.clear()
    steps.none.append(1)
    one, two = np.eye(7)[[0, 3]]
    point = SimpleNamespace(x=x, directions=np.array([one, two]), tangent=one)
    assert branching.crossing(problem, point) == ("orbit 2",)
    for sign, (p, at, direction) in zip((1.0, -1.0), steps.asked, strict=True):
        assert p is problem and at is not None
        np.testing.assert_allclose(direction * np.sign(steps.asked[0][2][3]), sign * two * problem.scale)


def test_orbits_born_at_a_graze_are_asked_for_each_period_and_on_the_side_that_is_valid(steps, monkeypatch):
    problem, x = Single(), np.arange(7.0)
    sides = {1: np.array([0.0, 1.0]), 2: None, 3: np.array([0.0, -1.0])}
    asked = []

    def changed(how, problem, x, *periods):
        asked.append((how, problem, x.tolist(), *periods))
        if how is branching.dropped:
            return "less", np.array([4.0, 0.5])
        return None if periods == (4,) else (periods[0], np.array([10.0 * periods[0], 0.5]))
    monkeypatch.setattr(branching, "changed", changed)
    monkeypatch.setattr(branching, "admissible_side", lambda new, start: sides[new.sequence])
    point = SimpleNamespace(x=x, name="")
    assert branching.grazing_orbits(problem, point, 4) == ("orbit 1", "orbit 2")
    assert [item[3] for item in asked] == [1, 2, 3, 4] and all(item[1] is problem for item in asked)
    assert [item[1][0] for item in steps.asked] == [10.0, 30.0]
    assert [item[2][1] for item in steps.asked] == [1.0, -1.0]
    asked.clear()
    point.name = "listed"  # the event that grazes is taken out first
    assert len(branching.grazing_orbits(problem, point, 1)) == 1
    assert asked[0][0] is branching.dropped and asked[1][1].sequence == "less" and asked[1][2] == [4.0, 0.5]
    assert branching.grazing_orbits(problem, point, 0) == ()


def test_what_branches_off_is_told_by_the_kind(monkeypatch):
    for name in ("doubled", "symmetry_broken", "crossing"):
        monkeypatch.setattr(branching, name, lambda problem, point, name=name: name)
    monkeypatch.setattr(branching, "grazing_orbits", lambda problem, point, n: ("graze", n))
    kinds = SpecialPointKind

    def asked(kind, closure=1, clock=0.0, directions=None):
        problem = SimpleNamespace(sequence=SimpleNamespace(closure=closure, clock=clock, events=0))
        return branching.branches(problem, SimpleNamespace(kind=kind, directions=directions), 5)
    assert asked(kinds.PERIOD_DOUBLING) == "doubled" and asked(kinds.GRAZING) == ("graze", 5)
    assert asked(kinds.BRANCH_POINT, -1) == "symmetry_broken" == asked(kinds.BRANCH_POINT, -1, directions=np.eye(2))
    assert asked(kinds.BRANCH_POINT, directions=np.eye(2)) == "crossing" and asked(kinds.BRANCH_POINT) is None
    assert asked(kinds.FOLD) is None and asked(kinds.GRAZING, clock=1.0) == ("graze", 5)
    for kind, closure in ((kinds.PERIOD_DOUBLING, 1), (kinds.BRANCH_POINT, -1)):
        found = asked(kind, closure, clock=1.0)
        assert not len(tuple(found)) and found is not None
    assert asked(kinds.BRANCH_POINT, 1, 1.0, np.eye(2)) == "crossing"


# where doubled orbits merge

FLIP = 0.7153


class Doubled:
    """Doubled orbits of a single one u(p) = (FIRST + p) whose multiplier is -1 at FLIP."""

    def __init__(self, moves=1.0, bend=40.0):
        self.sequence, self.scale, self._merges, self.single, self.moves, self.bend = signature(), SCALE, 3, None, moves, bend

    def with_sequence(self, s, start):
        self.single = SimpleNamespace(sequence=s, x0=np.array(start), scale=SCALE[6:], correct=self.corrected,
                                      null_tangent=lambda x: np.eye(7)[-1])
        return self.single

    def of(self, p):
        return FIRST.ravel() + self.moves * p

    def corrected(self, x, tangent):
        """Into the plane through ``x`` across ``tangent``."""
        line = np.append(np.full(6, self.moves), 1.0) / SCALE[6:]
        p = float(x[-1] + tangent @ ((x - np.append(self.of(x[-1]), x[-1])) / SCALE[6:]) / (tangent @ line))
        tangent, d = line / np.linalg.norm(line), p - FLIP
        return Corrected(np.append(self.of(p), p), tangent, True, CorrectorStatus.CONVERGED, 2, 1e-15, 0.0, 0.0, 1.0, 0.0,
                         np.array([d * (2.0 + self.bend * d), 0.0]))


def rows(problem, apart, low, high):
    found = []
    for p, sign in ((low, 1.0), (high, 0.6)):
        half = problem.of(p).reshape(2, 3)
        x = doubled(half + sign * apart, half - sign * apart, p=p)
        found.append(SimpleNamespace(x=x, tangent=np.arange(13.0), p=p, det_sign=-1.0, det_log=-4.0))
    return found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_doubled_orbits_merge_at_the_flip_of_the_single_one(sign, monkeypatch):
    problem = Doubled()
    v = sign * np.arange(1.0, 7.0)
    monkeypatch.setattr(branching, "critical", lambda single, x: v)
    monkeypatch.setattr(branching, "at_end", lambda problem, row, place: np.array([place, row.det_log]))
    a, b = rows(problem, np.full((2, 3), 1e-3), 0.70, 0.72)
    found = branching.merging(problem, a, b, 0.6)
    assert found.x[-1] == pytest.approx(FLIP, abs=1e-14)
    half = problem.of(found.x[-1]).reshape(2, 3)
    np.testing.assert_allclose(found.x, doubled(half, half, p=FLIP), atol=1e-13)
    np.testing.assert_allclose(branching.half_difference(problem.sequence, found.x, SCALE), 0.0, atol=1e-14)
    assert problem.single.sequence.span == 1.0 and problem.single.sequence.nodes.tolist() == NODE
    np.testing.assert_allclose(problem.single.x0[:-1], problem.of(0.712), atol=1e-12)  # mean of the halves, at its own times
    along = np.concatenate([v, -v, [0.0]]) / SCALE
    assert found.tangent @ a.tangent > 0.0 and np.linalg.norm(found.tangent) == pytest.approx(1.0)
    assert abs(found.tangent @ along) == pytest.approx(np.linalg.norm(along))
    assert found.converged and found.monitors.tolist() == [3.0, -4.0] and (found.det_sign, found.det_log) == (-1.0, -4.0)


def test_a_flip_far_from_the_rows_is_not_between_them(monkeypatch):
    monkeypatch.setattr(branching, "critical", lambda single, x: np.ones(6))
    monkeypatch.setattr(branching, "at_end", lambda problem, row, place: np.zeros(1))
    problem = Doubled(bend=0.0)
    for low, high, near in ((0.712, 0.716, True),
                            (0.690, 0.702, False), (0.73, 0.735, False), (0.7140, 0.7130, False), (0.7, 0.711, True)):
        found = branching.merging(problem, *rows(problem, np.full((2, 3), 1e-6), low, high), 0.5)
        assert (found is not None) is near
    lost = Doubled()
    lost.corrected = lambda x, tangent: SimpleNamespace(converged=False, monitors=[0.0])
    assert branching.merging(lost, *rows(lost, np.full((2, 3), 1e-3), 0.7, 0.72), 0.5) is None


# events that vanish

def item(before, guard, after, tau, free=True, state=(1.0, -2.0)):
    return [np.array([before, guard, after, 0, 0]), np.array([tau, *state]), free]


class Scene:
    """Two elements with two guards a mode: guards 2 e and 2 e + 1 belong to element e; modes are pairs of states (0 or 1)."""

    keys = [(0, 0), (0, 1), (1, 0), (1, 1)]

    def guard(self, mode, guard):
        return SimpleNamespace(element=guard // 2, number=guard % 2)

    def guards_of(self, mode, element):
        return [2 * element, 2 * element + 1]

    def combine(self, mode, element, state):
        key = list(self.keys[mode])
        key[element] = state
        return self.keys.index(tuple(key))

    def expand(self, mode, guard):
        then = np.full((4, 4, 1), -1)
        for m in range(4):
            for g in range(4):
                then[m, g, 0] = self.combine(m, g // 2, 1 - self.keys[m][g // 2])
        return SimpleNamespace(then=then)

    def mirror_guard(self, mode, guard):
        return guard ^ 1

    def mirror(self, mode):
        return 3 - mode


def test_two_events_of_one_instant_change_places_or_go():
    """Element 0 changes 0 -> 2 and element 1 then 2 -> 3: the other way round it is 0 -> 1 -> 3."""
    scene = Scene()
    made = vanishing.merging_nodes(scene, item(0, 0, 2, 0.0)[0], item(2, 3, 3, 0.0)[0])
    assert [list(map(int, node)) for node in made] == [[0, 3, 1, 0, 0], [1, 0, 3, 0, 0]]
    assert vanishing.merging_nodes(scene, item(0, 0, 2, 0.0)[0], item(2, 1, 0, 0.0)[0]) == []  # back again
    one = vanishing.merging_nodes(scene, item(2, 1, 3, 0.0)[0], item(3, 0, 0, 0.0)[0])  # of one element: at once to the last mode
    assert [list(map(int, node)) for node in one] == [[2, 1, 0, 0, 0]]


def test_intervals_without_duration_close_between_free_events():
    s = SimpleNamespace(span=2.0, closure=1)
    items = [item(0, 0, 2, 0.3), item(2, 1, 0, 0.3 + 1e-12), item(0, 2, 1, 0.9), item(1, 3, 0, 2.3 + 1e-12)]
    assert [vanishing.vanishing(items, s, i, 1e-9) for i in range(4)] == [True, True, False, False]
    assert not vanishing.vanishing(items, s, 1, 1e-13)
    for k in (0, 1):  # an impact on either side, a section
        other = [list(part) for part in items]
        other[k][2] = False
        assert not vanishing.vanishing(other, s, 1, 1e-9)
        other = [[part[0].copy(), *part[1:]] for part in items]
        other[k][0][GUARD] = -1
        assert not vanishing.vanishing(other, s, 1, 1e-9)


@pytest.mark.parametrize("closure", [1, -1])
def test_an_orbit_begun_one_node_earlier(closure):
    s = SimpleNamespace(span=0.5, closure=closure)
    items = [item(0, 0, 2, 0.1), item(2, 1, 0, 0.4, state=(3.0, 5.0))]
    found = vanishing.turned(Scene(), items, s)
    assert found[1] is items[0] and items[1][1].tolist() == [0.4, 3.0, 5.0]  # those given stay
    np.testing.assert_allclose(found[0][1], [-0.1, 3.0 * closure, 5.0 * closure])
    assert found[0][0][:3].tolist() == ([2, 1, 0] if closure > 0 else [1, 0, 3])


@pytest.mark.parametrize("closure", [1, -1])
def test_nodes_are_joined_where_those_between_them_are_gone(closure):
    items = [item(0, 0, 9, 0.1), item(2, 1, 9, 0.2), item(3, 1, 9, 0.3)]
    vanishing.join(items, SimpleNamespace(closure=closure))
    assert [int(part[0][AFTER]) for part in items] == [2, 3, 0 if closure > 0 else 9]
    assert [int(part[0][BEFORE]) for part in items] == [0, 2, 3]


def test_a_motion_is_an_orbit_that_simulation_repeats(monkeypatch):
    problem = object.__new__(OrbitProblem)
    monkeypatch.setattr(problems, "repetition", lambda orbit: SimpleNamespace(repeated=orbit.again))
    for success in (True, False):
        for again in (True, False):
            monkeypatch.setattr(OrbitProblem, "solution", lambda self, x, s=success, a=again: SimpleNamespace(success=s, again=a))
            assert problem.is_motion(np.zeros(3)) is (success and again)


@pytest.mark.parametrize("contacts", [
    (RigidStop(0.3, restitution=0.0), Coulomb(0.2)), (Coulomb(0.2), Coulomb(0.1)), (Coulomb(0.2), RigidStop(0.3), Coulomb(0.1))])
def test_what_replaces_two_events_of_one_instant_leads_from_the_same_mode_to_the_same(contacts):
    """By guards that there are, whatever an event changes beside its own contact: a plastic impact stops friction as well, and
    two frictions on one row stick together; friction has one guard where it slips and two where it sticks."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [*contacts, HarmonicForce(1.0)], omega=1.3))
    counts = scene.tables.n_guards
    assert scene.complete and len(set(counts.tolist())) > 1
    lengths = set()
    for first in itertools.product(range(len(counts)), range(max(counts)), range(len(counts))):
        for guard, last in itertools.product(range(counts[first[2]]), range(len(counts))):
            if first[1] >= counts[first[0]]:
                continue
            second = (first[2], guard, last)
            made = vanishing.merging_nodes(scene, [*first, 0, 0], [*second, 0, 0])
            if made is None:
                continue
            lengths.add(len(made))
            chain = [first[0], *(int(node[AFTER]) for node in made)]
            assert [int(node[BEFORE]) for node in made] == chain[:-1] and chain[-1] == last
            assert all(0 <= node[GUARD] < counts[node[BEFORE]] for node in made)
            if len(made) == 2:
                owners = [[scene.guard(int(node[BEFORE]), int(node[GUARD])).element for node in pair] for pair in
                          ((first, second), made)]
                assert owners[0] == owners[1][::-1]
    assert lengths >= {0, 1}
