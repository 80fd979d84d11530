"""Rules by which what goes on behind an end is chosen, on plain numbers: index, validity, where a sequence begins, zeros."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.compose.scene import scene_of
from bifurc.continuation.shooting import successor as rules
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.shooting.signature import Signature
from bifurc.system import System


class Line:
    """A branch (u, p) = a straight line of given slope, with monitors that are functions of p; multipliers of both sides."""

    scale, parameter_scale, touch = np.array([2.0, 0.5]), 0.5, 1e-9
    path = SimpleNamespace(low=0.0, high=10.0)
    sequence = SimpleNamespace(closure=1.0)

    def __init__(self, *monitors, multipliers=lambda p: np.array([0.5]), slope=1.0, names=()):
        self.tests, self.mu, self.slope = monitors, multipliers, slope
        names = (*names, *["listed"] * len(monitors))[:len(monitors)]
        self.monitors = [SimpleNamespace(boundary=True, name=name) for name in names]

    def null_tangent(self, x):
        t = np.array([self.slope, 1.0]) / self.scale
        return t / np.linalg.norm(t)

    def correct(self, x, tangent, fixed=False):
        t = self.null_tangent(x)
        if fixed:
            p = x[-1]
        else:  # where the line meets the plane through x across the tangent
            here = np.array([self.slope * x[-1], x[-1]]) / self.scale
            p = x[-1] + (tangent @ (x / self.scale - here)) / (tangent @ t) * t[-1] * self.scale[-1]
        at = np.array([self.slope * p, p])
        good = self.path.low - 5.0 < p < self.path.high + 5.0
        return SimpleNamespace(x=at, p=float(p), converged=good, tangent=t if t @ tangent > 0.0 else -t,
                               monitors=np.array([test(p) for test in self.tests]))

    def residual(self, u, p):
        return np.array([u[0] - self.slope * p])

    def jacobian(self, u, p):
        return np.array([[1.0]]), np.array([-self.slope])

    def floquet_multipliers(self, x):
        return self.mu(x[-1])

    def half_multipliers(self, x):
        return -self.mu(x[-1]) if self.sequence.closure < 0 else None


def at(p, slope=1.0):
    return np.array([slope * p, p])


# validity and index

def test_a_point_is_inside_where_all_boundaries_are_below_zero_and_the_path_allows_it():
    line = Line(lambda p: p - 3.0, lambda p: 1.0 - p)
    for p, good in ((2.0, True), (3.5, False), (0.5, False), (3.0, False)):
        assert rules.inside(line, line.correct(at(p), line.null_tangent(at(p)), True)) == good
    line.monitors[0].boundary = False
    assert rules.boundaries(line) == [1]
    assert rules.inside(line, line.correct(at(3.5), line.null_tangent(at(3.5)), True))
    assert [rules.allowed(line, p) for p in (-0.1, 0.0, 10.0, 10.1)] == [False, True, True, False]
    assert not rules.inside(line, line.correct(at(10.5), line.null_tangent(at(2.0)), True))
    both = Line(lambda p: -0.3, lambda p: -0.1, lambda p: -0.2, names=("x", "held"))
    assert rules.nearest(both, both.correct(at(1.0), both.null_tangent(at(1.0)))) == -0.2  # rows that are held are of rounding size


@pytest.mark.parametrize("mu, beyond", [([0.5, 0.3], 0), ([1.5, 0.3], 1), ([1.5, 2.5], 2), ([-1.5, 0.3], 0),
                                        ([1.5 + 1j, 1.5 - 1j], 0)])
def test_the_index_is_the_sign_of_det_one_less_the_monodromy(mu, beyond):
    line = Line(lambda p: -1.0, multipliers=lambda p: np.array(mu))
    t = line.null_tangent(at(2.0))
    sign = np.sign(np.prod(1.0 - np.array(mu)).real)
    assert sign == (-1.0)**beyond
    for way in (1.0, -1.0):
        assert rules.index(line, at(2.0), way * t, 1.0) == way * sign
    half = Line(lambda p: -1.0, multipliers=lambda p: -np.array(mu))
    half.sequence = SimpleNamespace(closure=-1.0)
    assert rules.index(half, at(2.0), t, 1.0, True) == sign
    unclear = Line(lambda p: -1.0, multipliers=lambda p: np.array([1.0, *mu]))
    assert rules.index(unclear, at(2.0), t, 1.0) == 0.0
    assert rules.index(Line(lambda p: 1.0, multipliers=lambda p: np.array(mu)), at(2.0), t, 1.0) == 0.0  # outside


def test_the_index_is_kept_unless_the_parameter_turns_back():
    def line(mu):
        return Line(lambda p: -1.0, multipliers=lambda p: np.array([mu]))
    t = line(0.5).null_tangent(at(2.0))
    end = SimpleNamespace(x=at(2.0), tangent=t)
    assert rules.balanced(line(0.5), end, line(-0.3), at(2.0), t)
    assert not rules.balanced(line(0.5), end, line(1.5), at(2.0), t)
    assert rules.balanced(line(0.5), end, line(1.5), at(2.0), -t)  # it turns back: as at a fold
    assert not rules.balanced(line(0.5), end, line(0.3), at(2.0), -t)
    assert rules.balanced(line(1.0), end, line(1.5), at(2.0), t)  # not to be told
    assert rules.preference(line(0.5), end, line(0.3), at(2.0), t, False) == rules.BEST
    assert rules.preference(line(0.5), end, line(0.3), at(2.3), t, False) == (False, pytest.approx(0.6))
    assert rules.preference(line(0.5), end, line(1.5), at(2.3), t, True) == rules.BEST
    assert rules.preference(line(0.5), end, line(1.5), at(2.0 + 1e-10), t, False) == (True, 0.0)


# where a sequence begins

@pytest.mark.parametrize("test, zero", [(lambda s: s - 1e-3, 1e-3), (lambda s: 2.0 * (s + 3e-4), -3e-4), (lambda s: s, 0.0),
                                        (lambda s: math.expm1(s) - 2e-3, math.log1p(2e-3))])
def test_zeros_next_to_a_length(test, zero):
    assert rules._zero(test, None) == pytest.approx(zero, abs=1e-12)
    assert rules._zero(test, 1e-9) == pytest.approx(zero, abs=1e-9)


def test_no_zero_is_made_up():
    assert rules._zero(lambda s: None, None) is None
    assert rules._zero(lambda s: 1.0, None) is None
    assert rules._zero(lambda s: 1.0 + s, None) is None  # farther than is looked
    assert rules._zero(lambda s: None if s else 1e-4, None) is None
    assert rules._zero(lambda s: s * s + 1e-4, None) is None
    assert rules._zero(lambda s: -8e-10 if s < 5e-7 else -2.6e-3, None) is None  # a leap, beside which it stays as it is


def test_a_solution_beside_a_guess_is_the_nearest():
    line = Line(lambda p: -1.0)
    x = np.array([2.3, 2.0])
    found = rules.onto(line, x)
    scaled = (found - x) / line.scale
    assert found[0] == pytest.approx(found[1], abs=1e-12)
    assert scaled @ line.null_tangent(x) == pytest.approx(0.0, abs=1e-12)  # across the line
    assert (x == [2.3, 2.0]).all() and rules.onto(line, np.array([np.nan, 1.0])) is None
    assert rules.onto(line, np.array([50.0, 1.0])) is None  # too far


@pytest.mark.parametrize("begin", [1.002, 0.999])
def test_a_sequence_begins_where_its_largest_monitor_is_zero(monkeypatch, begin):
    monkeypatch.setattr(rules, "listed_speeds", lambda problem, x: [None])
    line = Line(lambda p: begin - p, lambda p: -1.0)
    found = rules.at_beginning(line, at(1.0), 1.0)
    assert found[-1] == pytest.approx(begin, abs=1e-12) and found[0] == pytest.approx(begin, abs=1e-12)
    through = rules.at_beginning(Line(lambda p: -1.0), at(1.0), 1.003, True)
    assert through[-1] == pytest.approx(1.003, abs=1e-15)
    assert rules.at_beginning(Line(lambda p: 1.0), at(1.0), 1.003, True) is None  # not valid there


@pytest.mark.parametrize("other", [3e-12, 3e-10, 4e-9])
def test_a_sequence_begins_behind_the_last_of_two_places_that_rounding_tells_apart(monkeypatch, other):
    """As of two contacts that stop at once: of the second nothing is known but the sign."""
    monkeypatch.setattr(rules, "listed_speeds", lambda problem, x: [None])
    line = Line(lambda p: 1.001 - p, lambda p: -1.0 if p > 1.001 + other else 1e-6)
    found = rules._first_valid(line, at(1.0), 1.0)
    assert other <= found[-1] - 1.001 < 1e-8


def test_of_a_short_interval_the_end_at_the_old_parameter_is_taken_or_the_nearest(monkeypatch):
    monkeypatch.setattr(rules, "listed_speeds", lambda problem, x: [None])
    line = Line(lambda p: 1.001 - p, lambda p: p - 1.004)
    for here in (1.0015, 1.0035):
        for end in (1.001, 1.004):
            assert rules._first_valid(line, at(here), end)[-1] == pytest.approx(end, abs=1e-9)
    assert rules._first_valid(line, at(1.0015), 5.0)[-1] == pytest.approx(1.001, abs=1e-9)
    assert rules._first_valid(line, at(1.0035), 5.0)[-1] == pytest.approx(1.004, abs=1e-9)
    flat = Line(lambda p: -1.0)
    assert rules._first_valid(flat, at(1.0), 1.0) is None


@pytest.mark.parametrize("last", [2e-5, 3e-4, 7e-3])
@pytest.mark.parametrize("at_end, taken", [(1.0, True), (0.0, False)])
def test_a_short_validity_is_begun_at_the_end_that_is_nearer_to_the_old_parameter(last, at_end, taken, monkeypatch):
    """Valid for ``last`` of scaled length: the other end is enclosed by halving; the old end of the branch lies at either."""
    line = Line(lambda p: 1.0 - p, lambda p: p - stop)
    way = line.null_tangent(at(1.0))
    stop = 1.0 + last * line.scale[-1] * way[-1]
    looked = []

    def first_valid(new, x, p, step):
        looked.append((x[-1], p, step))
        return x
    monkeypatch.setattr(rules, "_first_valid", first_valid)
    monkeypatch.setattr(rules, "_from", lambda problem, point, signature, begin, through: ("from", begin))
    old = 1.0 + at_end * (stop - 1.0)
    found = (0.0, at(1.0), way)
    result = rules._nearer(None, SimpleNamespace(x=at(old)), line, None, found)
    assert looked == [(pytest.approx(stop, abs=1e-11), old, rules.CLOSE)]
    assert result is found if not taken else result[1][-1] == pytest.approx(stop, abs=1e-11)


def test_lengths_stay_on_the_path_and_ways_lead_back_or_not():
    line = Line(lambda p: -1.0)
    t = line.null_tangent(at(2.0))
    rate = line.scale[-1] * t[-1]
    assert rules.on_path(line, at(2.0), t, 0.1) == 0.1
    assert rules.on_path(line, at(9.99), t, 0.1) == pytest.approx(0.5 * 0.01 / rate)
    assert rules.on_path(line, at(0.01), -t, 0.1) == pytest.approx(0.5 * 0.01 / rate)
    assert rules.on_path(line, at(9.99), np.array([1.0, 0.0]), 0.1) == 0.1
    end = SimpleNamespace(x=at(2.0))
    assert rules.leads_back(end, line, at(1.9), t) and not rules.leads_back(end, line, at(1.9), -t)
    assert rules.leads_back(end, line, at(2.1), -t) and not rules.leads_back(end, line, at(2.0), t)


def test_a_beginning_that_is_near_is_told_from_one_that_is_far():
    line = Line(lambda p: p - 2.001)
    t = line.null_tangent(at(2.0))
    end = SimpleNamespace(x=at(2.001))
    c = line.correct(at(2.0005), t, True)
    assert rules.nears_beginning(end, line, at(2.0), t, c)
    assert not rules.nears_beginning(SimpleNamespace(x=at(2.5)), line, at(2.0), t, c)
    away = Line(lambda p: 1.0 - p)  # its monitor falls
    assert not rules.nears_beginning(end, away, at(2.0), t, away.correct(at(2.0005), t, True))
    far = Line(lambda p: p - 3.0)
    assert not rules.nears_beginning(SimpleNamespace(x=at(3.0)), far, at(2.0), t, far.correct(at(2.0005), t, True))


@pytest.mark.parametrize("p, off, more, known", [
    (2.1, 0.0, False, False),  # ahead of the end
    (1.9, 0.0, False, True), (1.9, 5e-5, False, True), (1.9, 5e-4, False, False),  # of a way of .1 back
    (1.9, 0.0, True, False)])  # with other impacts it is another motion
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_motion_before_the_end_is_no_successor(p, off, more, known, way, monkeypatch):
    """Motions are told apart by their place on the line; the new equations have theirs ``off`` beside it."""
    old, new = Line(lambda p: -1.0), Line(lambda p: -1.0)
    old.motion, new.motion = (lambda x: float(x[-1])), (lambda x: float(x[-1]) + off)
    monkeypatch.setattr(rules, "more_impacts", lambda one, other: more)
    monkeypatch.setattr(rules, "distance", lambda one, other: abs(one - other))
    end = SimpleNamespace(x=at(2.0), tangent=way * old.null_tangent(at(2.0)), before=None)
    here = 2.0 + way * (p - 2.0)
    assert rules.retraces(old, end, new, SimpleNamespace(x=at(here), p=here)) is known


@pytest.mark.parametrize("missed, jump", [
    ((1e-3, 1e-3), True), ((1e-3, 1e-7), False), ((1e-3, 2e-4), False), ((1e-3, 4e-4), True), ((5e-7, 5e-7), False),
    ((np.inf, 1e-3), False), ((1e-3, np.inf), False)])
def test_a_jump_is_a_miss_that_does_not_fall_with_the_distance(missed, jump, monkeypatch):
    far, near = rules.JUMPS
    monkeypatch.setattr(rules, "_beyond", lambda problem, point, step: [step])
    monkeypatch.setattr(rules, "repetition", lambda step: SimpleNamespace(miss=missed[0] if step == far else missed[1]))
    assert near < far and rules.jumps(SimpleNamespace(motion=lambda x: x), None) is jump


def test_solutions_beyond_an_end_stay_on_the_path():
    """Of the old equations a little further, then the last one at other parameters, ahead first."""
    line = Line(lambda p: -1.0)
    for way in (1.0, -1.0):
        end = SimpleNamespace(x=at(2.0), tangent=way * line.null_tangent(at(2.0)))
        found = list(rules._beyond(line, end, 1e-3))
        rate = line.scale[-1] * abs(end.tangent[-1])
        assert [x[-1] for x in found] == pytest.approx([2.0 + way * 1e-3 * rate, 2.0 + way * 5e-4, 2.0 - way * 5e-4], abs=1e-12)
        assert found[0][0] == pytest.approx(found[0][1]) and found[1][0] == found[2][0] == 2.0
    edge = SimpleNamespace(x=at(10.0), tangent=line.null_tangent(at(10.0)))
    assert [x[-1] for x in rules._beyond(line, edge, 1e-3)] == [pytest.approx(10.0 - 5e-4)]


@pytest.mark.parametrize("half, chosen", [(3, "half"), (99, "whole")])
def test_a_motion_of_half_a_period_goes_on_over_the_whole_one_where_half_of_it_never_begins(half, chosen, monkeypatch):
    """The equations over the whole period are as good for the first few steps only: there the half may not begin, later it does."""
    asked = []
    monkeypatch.setattr(rules, "cycle", lambda problem: ((), 0.5, -1))
    monkeypatch.setattr(rules, "_cycle", lambda scene, signature: (signature.name, signature.closure, signature.closure))
    monkeypatch.setattr(rules, "_beyond", lambda problem, point, step: [at(2.0)])
    monkeypatch.setattr(rules, "complete_chatters", lambda signature: 0.0)
    monkeypatch.setattr(rules, "preference", lambda *given: rules.BEST)
    monkeypatch.setattr(rules, "_read", lambda problem, x, search: [
        (SimpleNamespace(name=name, closure=closure), at(2.0)[:-1]) for name, closure in (("half", -1), ("whole", 1))])

    def begun(problem, point, signature, x, search, through):
        asked.append(signature.name)
        return (signature.name,) if signature.name == "whole" or asked.count("half") >= half else None
    monkeypatch.setattr(rules, "_begun", begun)
    problem = SimpleNamespace(scene=None, sequence=SimpleNamespace(closure=-1, clock=1.0))
    assert rules.successor(problem, SimpleNamespace(x=at(2.0)))[0] == (chosen,)


# sequences

def system():
    return System(np.eye(2), 0.1 * np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]),
                  (HarmonicForce(1.0, dof=0), RigidStop(0.5, 0.7, dof=0), Coulomb(0.3, dof=1)), omega=1.0)


def sequence(scene, steps, span=1.0, closure=1.0):
    nodes = np.zeros((len(steps), 5), np.int64)
    nodes[:, :len(steps[0])] = steps
    return Signature(nodes, np.zeros(len(steps)), span, closure)


@pytest.fixture(scope="module")
def scene():
    return scene_of(system())


def test_impacts_and_chatterings_are_counted_a_period(scene):
    m = next(m for m, keys in enumerate(scene.keys) if keys[1] == "free")
    hit = next(g for g in range(int(scene.tables.n_guards[m])) if scene.tables.kick[m, g])
    turn = next(g for g in range(int(scene.tables.n_guards[m])) if not scene.tables.kick[m, g])
    one = sequence(scene, [(m, hit, m, 0, 0), (m, turn, m, 0, 0), (m, hit, m, 0, 1)])
    assert rules.kicks(scene, one) == 2.0 and rules.complete_chatters(one) == 1.0
    twice = sequence(scene, [(m, hit, m, 0, 0), (m, turn, m, 0, 0), (m, hit, m, 0, 1)], 2.0)
    assert rules.kicks(scene, twice) == 1.0 and rules.complete_chatters(twice) == 0.5
    first = rules._cycle(scene, one)
    turned = sequence(scene, [(m, turn, m, 0, 0), (m, hit, m, 0, 1), (m, hit, m, 0, 0)])
    assert rules._cycle(scene, turned) == first != rules._cycle(scene, twice)
    assert rules._cycle(scene, sequence(scene, [(m, hit, m, 0, 1), (m, turn, m, 0, 0), (m, hit, m, 0, 0)])) != first
    plain = sequence(scene, [(m, hit, m, 0, 0)])
    more = sequence(scene, [(m, hit, m, 0, 0), (m, hit, m, 0, 0)])

    def of(s):
        return SimpleNamespace(scene=scene, sequence=s)
    assert rules.more_impacts(of(plain), of(more)) and not rules.more_impacts(of(plain), of(plain))
    assert not rules.more_impacts(of(plain), of(one))  # of a complete chattering any number is listed
    assert not rules.more_impacts(of(plain), of(sequence(scene, [(m, hit, m, 0, 0)] * 2, 2.0)))  # as many a period


def test_rows_that_move_the_more_the_farther_are_not_held():
    def line(rate):
        return Line(lambda p: -1.0, lambda p: rate(p - 2.0) - 0.5 * rules.HELD, names=("listed", "held"))
    t = line(abs).null_tangent(at(2.0))
    for rate, loose in ((lambda d: 1e-10 * abs(d) / 1e-5, True), (lambda d: 1e-10, False), (lambda d: 0.0, False)):
        problem = line(rate)
        c = problem.correct(at(2.0) + 1e-5 * problem.scale * t, t)
        assert rules.loosens(problem, at(2.0), t, 1e-5, c) == loose
    assert not rules.loosens(Line(lambda p: -1.0), at(2.0), t, 1e-5, c)


def test_the_search_says_each_reason_once():
    search = rules.Search()
    assert search.message == "simulation keeps the sequence of events"
    for reason in ("a", "b", "a"):
        search.say(reason)
    assert search.message == "a; b" and not search.incomplete and search.completing is None
