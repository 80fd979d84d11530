"""Limits from inside, folds of a step on boundaries, errors and directions of what is located: against numbers known beforehand."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import CorrectorStatus, LocationStatus, SpecialPointKind
from bifurc.continuation.problem import Corrected
from bifurc.continuation.steps import detect, hidden, inside, tori
from bifurc.continuation.steps.arclength import Half
from bifurc.continuation.steps.branchpoint import Crossing, locate_crossing
from bifurc.continuation.steps.rows import Part, Row, followed
from bifurc.continuation.steps.rows import tests_of as values_of
from tests.continuation.problems import Scalar, near_miss, parabola
from tests.continuation.steps.lines import SPEED, Line, edge, row_at, user, walk

FOLD, USER = SpecialPointKind.FOLD, SpecialPointKind.USER
FLAT = 1e-2  # of a parameter that changes little, so that the arclength is that of the unknown


def corrected(x, tangent):
    return Corrected(np.array(x), np.array(tangent), True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0, 1.0, 0.0, np.zeros(0))


class Graph(Scalar):
    """p = FLAT g(u), with u for the arclength up to FLAT^2 / 2."""

    def __init__(self, g, slope, p_size=1.0):
        super().__init__(lambda u, p: p - p_size * FLAT * g(u), lambda u, p: (-p_size * FLAT * slope(u), 1.0), 0.0, 0.0,
                         scale_u=1.0, scale_p=p_size)
        self.g, self.slope = g, slope

    def row(self, part, u):
        t = np.array([1.0, FLAT * self.slope(u)]) / math.hypot(1.0, FLAT * self.slope(u))
        c = corrected([u, self.scale[-1] * FLAT * self.g(u)], t)
        return Row(c, part, u, 0.01, values_of(c), 0.1)


def step_of(g, slope, low=0.0, high=1.0, **more):
    problem = Graph(g, slope, **more)
    part = Part(problem, 0)
    row, new = problem.row(part, low), problem.row(part, high)
    half = Half(row, SimpleNamespace(low=-9.0, high=9.0))
    return half, row, new


def cut_at(new, known=1e-12):
    return detect.Cut(new, None, 1, SimpleNamespace(low=new.s - known, high=new.s + known, known=0.0))


# where the parameter stands still on a boundary, its slope is the way from there times what may turn

@pytest.mark.parametrize("p_size", [1.0, 1e3])
@pytest.mark.parametrize("born, dies", [(False, False), (True, False), (False, True), (True, True)])
@pytest.mark.parametrize("at, depth, turns", [(0.45, 1e-3, True), (0.55, 1e-3, True), (0.5, -0.5, False)])
def test_two_folds_of_a_step_from_or_to_a_boundary_are_where_the_other_factor_is_least(born, dies, at, depth, turns, p_size):
    """dp/du = u^born (1 - u)^dies ((u - at)^2 - depth): its last factor turns its sign twice about ``at``, or nowhere."""
    factor = np.polynomial.Polynomial([at * at - depth, -2.0 * at, 1.0])
    if born:
        factor *= np.polynomial.Polynomial([0.0, 1.0])
    if dies:
        factor *= np.polynomial.Polynomial([1.0, -1.0])
    g = factor.integ()
    half, row, new = step_of(g, factor, p_size=p_size)
    half.edge, half.signs = (1e-12 if born else None), [1]
    place, sign = hidden.turning(half, row, new, cut_at(new) if dies else None)
    assert sign == 1.0
    assert place == (pytest.approx(at, abs=0.02) if turns else -1.0)


def test_a_slope_that_does_not_begin_at_zero_is_no_birth():
    half, row, new = step_of(lambda u: u + u * u, lambda u: 1.0 + 2.0 * u)
    inner = half.rows[0].part.problem.row(row.part, 1e-3)
    assert not hidden.grows(row, inner) and not hidden.grows(row, row)
    half, row, new = step_of(lambda u: u * u, lambda u: 2.0 * u)
    assert hidden.grows(row, half.rows[0].part.problem.row(row.part, 1e-3))
    steep = step_of(lambda u: u + 80.0 * u * u, lambda u: 1.0 + 160.0 * u)[1]  # of half its slope at the end of the stretch only
    assert not hidden.grows(steep, steep.part.problem.row(steep.part, 1e-3))


# limits from inside

def test_a_limit_at_the_end_of_a_step_is_seen_on_the_chord_to_that_end():
    half, row, new = step_of(lambda u: -(1.0 - u)**2, lambda u: 2.0 * (1.0 - u))
    places = tuple(1.0 - t for t in inside.near(row, new, 0))
    found = inside.clear_inside(half, row, new, 0, places, {})
    assert found is not None and found.p == pytest.approx(-FLAT * (1.0 - found.x[0])**2, abs=1e-15)
    assert found.tests[0] == pytest.approx(2.0 * FLAT * (1.0 - found.x[0]), rel=1e-3) and 0.0 < 1.0 - found.s < 1e-2


@pytest.mark.parametrize("p_size", [1.0, 1e3])
def test_the_slope_beside_an_end_counts_where_its_chord_is_not_much_steeper(p_size):
    """Points beside the end are given: a slope with the sign of the chord, or not, and of its size, or made of rounding."""
    for chord, slope, counts in ((1e-3, 1e-3, True), (1e-3, -1e-3, False), (1e-3, 1e-5, False), (1e-3, 0.6e-3, True)):
        half, row, new = step_of(lambda u: u, lambda u: 1.0, p_size=p_size)
        t = 1e-2
        c = corrected([t, row.p + p_size * chord * t], [1.0, slope])
        assert (inside.clear_inside(half, row, new, 0, (t,), {t: c}) is not None) is counts


def test_a_row_just_inside_lies_where_its_part_of_the_step_ends():
    half, row, new = walk(Line(user(lambda p: p + 1.0)), 0.1, 0.9)
    new = row_at(row.part, 0.9)
    found = inside.clear_inside(half, half.rows[0], new, 1, (0.25,), {})
    assert found.p == pytest.approx(0.3) and found.s == pytest.approx(SPEED * 0.3)
    assert found.angle == pytest.approx(0.25 * new.angle)


def test_a_parameter_stands_still_where_its_slope_is_its_change_over_what_is_known_of_the_place():
    for length in (0.1, 1.0, 10.0):
        row, new = SimpleNamespace(s=0.0, tests=[1.0]), SimpleNamespace(s=length, tests=[0.0])
        for factor, still in ((0.9, True), (1.1, False)):
            new.tests[0] = 0.0
            at = SimpleNamespace(tests=[factor * 1e-3 / length])
            assert inside.stands(row, new, at, 1e-3) is still


def test_a_value_that_is_not_known_on_a_boundary_is_its_limit_from_inside():
    half, row, new = walk(Line(user(lambda p: p + 2.0 if p > 0.1 else math.nan)), 0.1, 0.9)
    half.edge, new = 1e-9, row_at(row.part, 0.9)
    first = half.rows[0]
    inner = inside.beginning(half, first, new, 1)
    assert inner is not first and first.tests[1] == inner.tests[1] == pytest.approx(2.1, abs=1e-4) and half.signs[1] == 1


# what is crossed

def test_a_jump_is_no_boundary():
    half, row, new = walk(Line(edge(lambda p: p - 0.5)), -0.3, 0.1, 0.9)
    assert detect.boundary(half, row, new)[1] is None
    row.det_sign = -1.0
    cut, cause = detect.boundary(half, row, new)
    assert cut is None and "jumps" in cause[2]


def test_what_a_problem_calls_a_zero_must_be_confirmed_too():
    for confirmed, count in (((USER,), 0), ((FOLD,), 0), ((USER, FOLD), 1)):
        line = Line(user(lambda p: p - 0.5), confirms=lambda kind, x, known=confirmed: kind in known)
        half, row, new = walk(line, -0.3, 0.1, 0.9)
        row.part.problem.kind_at = lambda monitor, x: FOLD
        found, cause = detect.crossed(half, row, new, None)
        assert cause is None and [special.kind for special in found] == [FOLD] * count


@pytest.mark.parametrize("value, slope", [(1e-9, 1.0), (0.3, 0.3), (-1e-9, 1.0)])
def test_the_slope_before_a_boundary_is_its_last_clear_one(value, slope):
    half, row, new = walk(Line(edge(lambda p: p - 0.9)), -0.3, 0.1, 0.9)
    cut = cut_at(new)
    cut.inside[0] = SimpleNamespace(tests=[value, 0.0])
    detect.crossed(half, row, new, cut)
    assert half.slope == slope


def test_a_zero_beside_a_row_is_not_on_it():
    for away, count in ((0.0, 1), (3e-9, 0), (-3e-9, 0)):
        half, row, _ = walk(Line(user(lambda p, at=0.2 + away: p - at)), 0.2, 0.9)
        half.sizes[1] = 1.0
        assert len(detect.at_end(half, row)) == count
    part = Part(parabola(scale_u=1.0, scale_p=1.0), 0)
    c = corrected([0.0, 0.0], [1.0, 0.0])
    row = Row(c, part, 0.0, 0.0, values_of(c), 0.1)
    (fold,) = detect.at_end(Half(row, SimpleNamespace(low=-9.0, high=9.0)), row)
    assert fold.kind is FOLD and fold.reverses


@pytest.mark.parametrize("p_size", [1.0, 1e-3, 1e3])
def test_the_error_of_a_guess_covers_what_the_parameter_does_inside(p_size):
    """p = FLAT p_size u (1 - u) is zero at both ends of the step, its fold is not."""
    half, row, new = step_of(lambda u: u * (1.0 - u), lambda u: 1.0 - 2.0 * u, p_size=p_size)
    special = detect.guessed(row.part, row, new, 0)
    assert special.status is LocationStatus.GUESS and special.error >= 0.25 * FLAT * p_size


@pytest.mark.parametrize("p_size", [1e-3, 1.0, 1e3])
def test_a_crossing_that_is_located_keeps_its_error_in_the_unit_of_the_parameter(monkeypatch, p_size):
    half, row, new = step_of(lambda u: u, lambda u: 1.0, p_size=p_size)
    along = row.tangent
    found = Crossing("located", row.part.problem.row(row.part, 0.25).x, np.array([along, [along[1], -along[0]]]), 1e-6)
    monkeypatch.setattr(detect, "locate_crossing", lambda problem, x: found)
    new.det_sign = -row.det_sign
    special, cause = detect.branch_point(row, new)
    assert cause is None and special.error == pytest.approx(1e-6 * p_size) and special.s == pytest.approx(0.25, abs=FLAT**2)
    assert special.low == pytest.approx(special.s - 1e-6) and special.high == pytest.approx(special.s + 1e-6)
    new.det_sign = row.det_sign  # without a change of sign only a crossing at the end of the step is one of this step
    assert detect.branch_point(row, new) == (None, None)
    found.x = new.x.copy()
    assert detect.branch_point(row, new)[0].s == pytest.approx(1.0, abs=FLAT**2)


@pytest.mark.parametrize("eps", [1e-3, -1e-3, 1e-5, -1e-5])
def test_branches_that_miss_each_other_on_either_side_do_not_cross(eps):
    for problem, status in ((near_miss(eps), "near_miss"), (near_miss(0.0), "located")):
        problem.scale[-1] = 1.0
        assert locate_crossing(problem, np.array([0.01, 0.02])).status == status


# what the ends of a step do not show

def test_a_step_that_is_all_of_its_part_is_looked_at_in_the_middle():
    for sign in (1.0, -1.0):
        half, row, _ = walk(Line(user(lambda p, sign=sign: sign * ((p - 0.5)**2 - 0.04))), 0.0, 1.0)
        found = hidden.alone(half, half.rows[0], row_at(row.part, 1.0), None)
        assert found.p == pytest.approx(0.5) and sign * found.tests[1] < 0.0
        half, row, _ = walk(Line(user(lambda p, sign=sign: sign * ((p - 0.5)**2 + 0.04))), 0.0, 1.0)
        assert hidden.alone(half, half.rows[0], row_at(row.part, 1.0), None) is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_test_may_be_least_at_a_row_exactly(sign):
    """The parabola through three rows has its least value at the middle one, where nothing new is to be seen."""
    half, row, new = walk(Line(user(lambda p: sign * ((p - 0.5)**2 + 0.04))), 0.0, 0.5, 1.0)
    assert hidden.dip(half, row, new) is None and half.unresolved == []
    half, row, new = walk(Line(user(lambda p: sign * (abs(p - 0.53) - 0.01))), 0.03, 0.5, 0.97)
    assert abs(hidden.dip(half, row, new).p - 0.53) < 0.01


@pytest.mark.parametrize("length, jumps", [(0.2, True), (3.0, False)])
def test_a_jump_is_told_from_its_distance_as_part_of_the_step(monkeypatch, length, jumps):
    """Two lines 3e-3 apart: from one to the other the middle of the step is as far away as no curve of its length is."""
    part = Part(Scalar(lambda u, p: u * (u - 3e-3), lambda u, p: (2.0 * u - 3e-3, 0.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0), 0)
    monkeypatch.setattr(hidden, "doubtful", lambda *told: hidden.UNCLEAR)

    def at(p, u, s):
        c = corrected([u, p], [0.0, 1.0])
        return Row(c, part, s, 0.0, values_of(c), 0.1)
    first, row = at(-0.1, 0.0, -0.1), at(0.0, 0.0, 0.0)
    half = Half(first, SimpleNamespace(low=-9.0, high=9.0))
    half.rows.append(row)
    assert hidden.jumped(half, row, at(length, 2.5e-3, length), False) is jumps


def test_the_place_of_a_boundary_is_told_in_scaled_units():
    half, row, new = walk(Line(edge(lambda p: 0.0)), -0.3, 0.1, 0.9)
    row.part.scale = np.array([2.0, 100.0])
    place = hidden.Edge(new, 1, 1e-6)
    for away, same in ((5e-5, True), (5e-4, False)):
        assert bool(place.holds(half, SimpleNamespace(x=np.array([0.0, new.p + away]), monitors=[0.0]))) is same


def test_the_turn_of_a_branch_adds_up_over_steps_made_in_one_call():
    half, row, _ = walk(Line(), -0.3, 0.1, 0.9)
    row.turn = 0.5
    lines = np.array([[*(row.x + k), *row.tangent, row.tests[0], 0.1, 0.02 * k, 0.0, 0.2, 3, 1e-15, 1.0, -2.0] for k in (1, 2, 3)])
    made = followed(row, lines, (1,))
    assert [new.turn for new in made] == pytest.approx([0.52, 0.56, 0.62])
    assert [new.s - row.s for new in made] == pytest.approx([0.1, 0.2, 0.3])


# multipliers

def test_beside_a_flip_the_multiplier_nearest_to_minus_one_may_have_passed():
    problem = Line(mu=lambda p: [-1.0, 1.3, 0.5] if p == 0.0 else [-1.0 - p, 1.3, 0.5])
    flip = SimpleNamespace(kind=SpecialPointKind.PERIOD_DOUBLING, x=np.zeros(2))
    for p in (0.1, -0.1):
        assert tori.next_to(problem, flip, np.array([0.0, p]))
    problem.mu = lambda p: [-1.0, 1.3, 0.5] if p == 0.0 else [-0.9, 0.8, 0.5]
    assert not tori.next_to(problem, flip, np.array([0.0, 0.1]))  # the other has passed as well
    fold = SimpleNamespace(kind=FOLD, x=np.zeros(2))
    problem.mu = lambda p: [1.0, -1.3, 0.5] if p == 0.0 else [0.9, -0.8, 0.5]
    assert not tori.next_to(problem, fold, np.array([0.0, 0.1]))
    problem.mu = lambda p: [1.0, -1.3, 0.5] if p == 0.0 else [0.9, -1.3, 0.5]
    assert tori.next_to(problem, fold, np.array([0.0, 0.1]))


def test_between_two_pairs_that_have_changed_sides_is_the_middle_of_their_passages():
    def pairs(one, two):
        return np.array([one * np.exp(1j), one * np.exp(-1j), two * np.exp(2j), two * np.exp(-2j)])
    for (low, high), (first, last), place in (((0.9, 1.1), (1.2, 0.95), 0.65), ((0.99, 1.09), (1.01, 0.91), 0.1),
                                              ((0.9, 1.3), (1.1, 0.7), 0.25), ((0.9, 0.95), (1.2, 1.1), 0.5)):
        assert tori.doubt(pairs(low, first), pairs(high, last))[1] == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("away, noted", [(1e-9, False), (1e-6, False), (1e-4, False), (0.2, True)])
def test_what_touches_zero_beside_the_birth_of_an_event_is_that_birth(away, noted):
    """Where an event is born other tests may begin at zero with the square of the way: no touch that is left unresolved."""
    half, row, new = walk(Line(edge(lambda p: 0.1 - p), user(lambda p: (p - 0.1 - away)**2)), 0.1, 0.5, 0.9, born=1)
    half.edge, half.sizes = 1e-9, [1.0, 1.0, 1.0]
    assert hidden.dip(half, row, new) is None and bool(half.unresolved) is noted
