"""The loop over steps by itself: what a correction is judged by, what is undone, and where other equations begin."""
import copy
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import SpecialPointKind, StopReason, trace
from bifurc.continuation.kinds import CorrectorStatus
from bifurc.continuation.problem import Corrected, Monitor
from bifurc.continuation.steps import arclength, detect
from bifurc.continuation.steps.arclength import ASIDE, FARTHEST, Half
from bifurc.continuation.steps.inside import known_to
from bifurc.continuation.steps.rows import Part, Row
from bifurc.continuation.steps.rows import tests_of as values_of
from bifurc.orbits.orbit import TOUCH
from bifurc.solve.steplaw import MAX_ANGLE
from tests.continuation.problems import Scalar, circle
from tests.continuation.steps.lines import Line, edge, user, walk

OPTIONS = SimpleNamespace(low=-9.0, high=9.0, ds=0.1, ds_min=1e-9, ds_max=0.5, max_steps=100, stop=None, record=None, progress=None)


def on_circle(part, radius, angle):
    """Return the correction of a step along the tangent at angle 0 to the point at ``angle``, and its row."""
    x = radius * np.array([math.cos(angle), math.sin(angle)])
    t = np.array([-math.sin(angle), math.cos(angle)])
    c = Corrected(x, t, True, CorrectorStatus.CONVERGED, 3, 0.0, radius * (1.0 - math.cos(angle)), 0.1, 1.0, 0.0, np.zeros(0))
    return c, Row(c, part, 0.0, 0.0, values_of(c), 0.1)


@pytest.mark.parametrize("radius", [0.25, 1.0, 8.0])
@pytest.mark.parametrize("angle", [0.01, 0.3])
def test_a_step_on_a_circle_has_its_arc_and_its_curvature(radius, angle):
    part = Part(circle(radius=radius, scale_u=1.0, scale_p=1.0), 0)
    _, row = on_circle(part, radius, 0.0)
    c, _ = on_circle(part, radius, angle)
    new, cause = Half(row, OPTIONS).judge(row, c, radius * math.sin(angle), False)
    assert cause is None and new.s == pytest.approx(radius * angle, rel=1e-9) and new.angle == pytest.approx(angle)
    assert new.bend == pytest.approx(1.0 / radius, rel=1e-9) and abs(new.misfit) < 1e-9


@pytest.mark.parametrize("angle", [0.36, 0.4, 0.45])
def test_a_step_that_turns_too_much_is_tried_again_with_one_that_does_not(angle):
    part = Part(circle(scale_u=1.0, scale_p=1.0), 0)
    _, row = on_circle(part, 1.0, 0.0)
    new, (reason, factor, _) = Half(row, OPTIONS).judge(row, on_circle(part, 1.0, angle)[0], math.sin(angle), False)
    assert new is None and reason is StopReason.DS_MIN and factor * angle < 0.8 * MAX_ANGLE


def test_a_point_on_a_bound_that_lies_behind_is_not_reached_by_going_ahead():
    half, row, new = walk(Line(), -0.3, 0.1, 0.9)
    half.options = OPTIONS
    ahead, behind = (Corrected(r.x, r.tangent, True, CorrectorStatus.CONVERGED, 2, 0.0, 0.0, 0.0, 1.0, 0.0, np.zeros(0))
                     for r in (new, half.rows[0]))
    made, cause = half.judge(row, ahead, 0.1, True)
    assert cause is None and made.s == pytest.approx(new.s)
    made, (reason, _, _) = half.judge(row, behind, 0.1, True)
    assert made is None and reason is StopReason.DS_MIN


def test_what_is_known_to_an_error_is_not_beyond_a_bound_within_it():
    half, row, _ = walk(Line(), -0.3, 0.1, 0.9)
    half.options = SimpleNamespace(low=-1.0, high=2.0)
    for inside in (-1.0, 0.5, 2.0):
        assert not half.beyond_bounds(inside, row.part)
    for sign, bound in ((1.0, 2.0), (-1.0, -1.0)):
        assert half.beyond_bounds(bound + sign * 1e-6, row.part) and not half.beyond_bounds(bound + sign * 1e-6, row.part, 2e-6)
        assert half.beyond_bounds(bound + sign * 1e-6, row.part, 5e-7)


def test_a_boundary_gives_way_to_a_bound_at_the_same_place_only():
    half, _, new = walk(Line(edge(lambda p: p - 0.9)), -0.3, 0.1, 0.9)
    for bounds, first in (((-1.0, 0.9), True), ((0.9, 2.0), True), ((-1.0, 2.0), False)):
        half.options = SimpleNamespace(low=bounds[0], high=bounds[1])
        for away, error, same in ((0.0, 0.0, True), (1e-6, 0.0, False), (1e-6, 1e-5, True)):
            cut = SimpleNamespace(row=SimpleNamespace(p=new.p + away), special=SimpleNamespace(bound=error))
            assert bool(half.bound_first(new, cut)) is (first and same)


# what is undone

def test_a_step_taken_back_leaves_the_half_as_it_was_before():
    half, row, new = walk(Line(user(lambda p: p - 0.5)), -0.3, 0.1, 0.9)
    half.options = OPTIONS
    row.signs, here, there = tuple(half.signs), SimpleNamespace(s=row.s), SimpleNamespace(s=new.s - 0.1)
    half.found = [here]
    half.take(row, new, [there])
    assert half.signs[1] == 1 and half.rows[-1] is new and half.found == [here, there] and half.steps == 1
    assert half.take_back() is row
    assert half.signs == [1, -1] == list(row.signs) and half.rows[-1] is row and half.found == [here] and half.steps == 0


@pytest.mark.parametrize("edges", [(0.2, 5.0), (5.0, 0.2), (0.4, 0.2)])
def test_rows_outside_of_any_boundary_are_no_motions_where_the_branch_ends_there(edges):
    half, row, new = walk(Line(*(edge(lambda p, at=at: p - at) for at in edges)), -0.3, 0.1, 0.3, 0.5, 0.9)
    half.options = OPTIONS
    half.stop(StopReason.INADMISSIBLE, "outside")
    half.run()
    assert [made.p for made in half.rows] == [-0.3, 0.1] and half.reason is StopReason.INADMISSIBLE
    half, *_ = walk(Line(*(edge(lambda p, at=at: p - at) for at in edges)), -0.3, 0.1, 0.3, 0.5, 0.9)
    half.stop(StopReason.DS_MIN)
    half.run()
    assert len(half.rows) == 4  # of another end nothing is known


def test_a_function_that_stops_on_a_bound_does_not_hide_the_bound():
    made = trace(Scalar(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0), bounds=(-1, 1), stop=lambda point: True)
    assert made.stop_reason == (StopReason.STOPPED, StopReason.STOPPED)
    made = trace(Scalar(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0), bounds=(-1, 1),
                 stop=lambda point: abs(point.parameter) == 1.0)
    assert made.stop_reason == (StopReason.BOUND, StopReason.BOUND)


# bounds that steps creep up to

@pytest.mark.parametrize("bound, beside", [(2.0, 2.0 - 1e-9), (1.0, 1.0 + 1e-9)])
def test_where_the_slope_is_rounding_the_nearest_bound_is_reached(bound, beside):
    half, row, _ = walk(Line(), beside, beside)
    half.options = SimpleNamespace(**{**vars(OPTIONS), "low": 1.0, "high": 2.0})
    row.tests[0] = 0.0
    assert half.reach(row) and half.rows[-1].p == bound and half.reason is StopReason.BOUND and half.steps == 1


def test_a_bound_on_which_the_slope_falls_to_nothing_is_looked_for_at_twice_the_way():
    """p = 1 - (1 - u)^2: at u = 1 - d the slope tells the way d / 2, and the bound lies at d."""
    def level(u, p):
        return p - 1.0 + (1.0 - u)**2
    problem = Scalar(level, lambda u, p: (-2.0 * (1.0 - u), 1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
    part, d, asked = Part(problem, 0), 2e-5, []
    t = np.array([1.0, 2.0 * d]) / math.hypot(1.0, 2.0 * d)
    c = Corrected(np.array([1.0 - d, 1.0 - d * d]), t, True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0, 1.0, 0.0, np.zeros(0))
    row = Row(c, part, 0.0, 0.0, values_of(c), 0.1)
    half, correct = Half(row, OPTIONS), problem.correct
    problem.correct = lambda x, tangent, fixed=False: asked.append(x.copy()) or correct(x, tangent, fixed)
    half.beside_bound(row, row, 1.0)
    np.testing.assert_allclose(asked[0], [1.0, 1.0], atol=1e-8)


# closed branches

def test_a_branch_closes_in_its_first_row_and_on_its_own_sheet_only():
    part = Part(circle(scale_u=1.0, scale_p=1.0), 0)
    first, row, new = (on_circle(part, 1.0, angle)[1] for angle in (0.0, -0.1, 0.2))
    new.s = 0.3
    row.turn = 2.0 * math.pi - 0.1
    for sign, closes in ((1.0, True), (-1.0, False)):
        half = Half(row, OPTIONS, origin=copy.copy(first))
        half.origin.det_sign = sign * part.problem.correct(first.x, first.tangent).det_sign
        last = half.closed_by(row, new)
        assert (last is not new) is closes
        if closes:
            assert last.x is half.origin.x and last.s == pytest.approx(0.1, abs=1e-4)


# other equations

class Beyond(Line):
    """Goes on behind its boundary with two boundaries of which the second is zero there."""

    def switch(self, point, monitor):
        other = Line(edge(lambda p: p - 5.0, name="far"), edge(lambda p: 0.4 - p, name="here"), user(lambda p: p - 7.0))
        return other, point.x, 3.0 * point.tangent


def test_behind_a_boundary_the_equations_begin_on_the_one_that_is_zero_there():
    half, row, new = walk(Beyond(edge(lambda p: p - 0.4)), -0.3, 0.1, 0.9)
    half.options, half.slope = OPTIONS, 0.9
    cut, _ = detect.boundary(half, row, new)
    cut.special.low, cut.special.high = cut.special.s - 1e-5, cut.special.s + 3e-5
    half.cross(cut.row, cut)
    first, part = half.rows[-1], half.parts[-1]
    assert part.index == 1 and part.born == 2 and first.part is part and first.p == pytest.approx(0.4, abs=1e-9)
    assert half.edge == pytest.approx(2e-5) == known_to(cut.special)
    assert half.signs == [1, -1, 0, -1] and len(half.sizes) == 4 and first.signs == tuple(half.signs)
    assert cut.special.successor is part.problem and not cut.special.reverses
    assert np.linalg.norm(first.tangent) == pytest.approx(1.0)


def asked_problem(answers, scale=(64.0, 0.25)):
    """A problem of which every correction is one of ``answers`` (status, cosine to the given tangent, how far rounding moves
    it, value of its boundary); what was asked is kept."""
    problem = SimpleNamespace(scale=np.array(scale), same_tangent=0.99, asked=[])

    def correct(x, tangent):
        converged, cosine, *more = answers[min(len(problem.asked), len(answers) - 1)]
        problem.asked.append(x.copy())
        t = cosine * tangent + math.sqrt(1.0 - cosine**2) * np.array([-tangent[1], tangent[0]])
        blur, beyond = (*more, *(0.0, -1.0)[len(more):])
        return SimpleNamespace(x=x, tangent=t, converged=converged, blur=blur, monitors=np.array([1.0, beyond]))
    problem.monitors = Monitor(SpecialPointKind.FOLD), Monitor(SpecialPointKind.GRAZING, boundary=True)
    problem.correct, problem.blur, problem.touch = correct, lambda found: found.blur, TOUCH
    return problem


def test_equations_that_are_singular_where_they_begin_are_solved_a_little_inside():
    x, t = np.array([3.0, 1.0]), np.array([0.6, 0.8])
    for answers, step in (([(True, 1.0)], 0.0), ([(False, 1.0), (True, 1.0)], ASIDE[0]),
                          ([(True, 0.5), (True, 0.5), (True, 1.0)], ASIDE[1]),
                          ([(True, 0.5), (False, 1.0), (True, 0.5)], ASIDE[1]),  # none the same: the first inside
                          # the first that rounding does not move by as much as the way, also with another tangent
                          ([(True, 1.0, 1e-3), (True, 1.0, 1e-5), (True, 1.0, 1e-6)], ASIDE[1]),
                          ([(True, 1.0, 1e-3)] * 4 + [(True, 0.5, 1e-6)], FARTHEST), ([(True, 1.0, 1e-3)], 0.0),
                          # not beyond another boundary, if there is a place before it
                          ([(True, 0.5), (True, 1.0, 0.0, 1e-3), (True, 1.0, 0.0, 1e-2), (True, 1.0)], ASIDE[2]),
                          ([(True, 0.5), (True, 1.0, 0.0, 1e-3), (False, 1.0)], ASIDE[0])):
        problem = asked_problem(answers)
        c, along = Half.begun(problem, x, t)
        assert c.converged and along == step
        np.testing.assert_allclose(c.x, x + step * problem.scale * t, rtol=0, atol=1e-15)


def test_behind_a_corner_the_branch_goes_on_a_little_further_in_its_own_units():
    half, row, _ = walk(Line(), -0.3, 0.1, 0.9)
    half.options, problem = OPTIONS, Line()
    problem.scale = np.array([64.0, 0.25])
    t, asked = np.array([0.8, -0.6]), []

    def correct(x, tangent):
        asked.append(x.copy())
        return Corrected(x, tangent, True, CorrectorStatus.CONVERGED, 1, 0.0, 0.0, 0.0, 1.0, 0.0, np.zeros(0))
    problem.correct = correct
    row.part.problem.beyond_corner = lambda row: (problem, t)
    assert half.turned(row)
    np.testing.assert_allclose(asked[0], row.x + ASIDE[0] * problem.scale * t, rtol=0, atol=1e-15)
    assert half.rows[-1].part.index == 1 and half.signs == [-1]
    (special,) = half.found  # the parameter turns back in it
    assert special.kind is SpecialPointKind.FOLD and special.name == "corner" and special.s == row.s and special.reverses
    assert not half.turned(half.rows[-1])  # no step since


def test_a_first_clear_slope_behind_a_boundary_tells_whether_the_parameter_turns():
    for before, slope, turns in ((0.5, 0.1, False), (0.5, -0.1, True), (-0.5, -0.1, False), (-0.5, 0.1, True)):
        half, *_ = walk(Line(), -0.3, 0.1, 0.9)
        special = SimpleNamespace(reverses=None)
        half.pending = before, special
        half.decide(1e-9)
        assert special.reverses is None and half.pending is not None  # rounding
        half.decide(slope)
        assert special.reverses is turns and half.pending is None


def test_a_row_leaves_through_the_bound_on_which_it_lies():
    options = SimpleNamespace(low=-1.0, high=2.0)
    for p, slope, leaves in ((2.0, 0.1, True), (2.0, -0.1, False), (-1.0, -0.1, True), (-1.0, 0.1, False), (0.0, 0.1, False),
                             (2.0, 1e-12, False), (-1.0, -1e-12, False), (2.0 - 1e-15, 0.1, True), (1e-15 - 1.0, -0.1, True),
                             (2.0 - 1e-11, 0.1, False)):
        row = SimpleNamespace(p=p, s=0.0, tests=[slope], part=SimpleNamespace(scale=np.ones(2)))
        assert arclength.outward(row, options) is leaves


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_point_on_a_bound_is_looked_for_where_the_step_crosses_it(way):
    """p = u: from 0 to 1 (or back to -1) the bound at .75 is crossed there, and the search begins there."""
    problem = Scalar(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
    part, t, asked = Part(problem, 0), way * np.array([1.0, 1.0]) / math.sqrt(2.0), []
    row, beyond = (Row(Corrected(way * np.array([at, at]), t, True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0, 1.0, 0.0,
                                 np.zeros(0)), part, math.sqrt(2.0) * at, 0.0, [t[1]], 0.1) for at in (0.0, 1.0))
    half, correct = Half(row, SimpleNamespace(**{**vars(OPTIONS), "low": -0.75, "high": 0.75})), problem.correct
    problem.correct = lambda x, tangent, fixed=False: asked.append(x.copy()) or correct(x, tangent, fixed)
    new, cause = half.onto_bound(row, beyond)
    assert cause is None and new.p == way * 0.75 and new.s == pytest.approx(0.75 * math.sqrt(2.0))
    np.testing.assert_allclose(asked[0], [way * 0.75] * 2, atol=1e-8)


@pytest.mark.parametrize("ulps", [-5000, -7, -1, 0, 1, 7, 5000])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_bound_that_a_row_misses_by_rounding_is_that_row(ulps, direction):
    """Along u = p steps have round lengths: one that would be shorter than the rounding of the arclength is none."""
    def line():
        return Scalar(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 3.0, 3.0, scale_u=1.0, scale_p=1.0)

    rows = trace(line(), bounds=(-6.0, 9.0)).column("p")
    aim = rows[np.argsort(abs(rows - 3.0 - direction * 2.0))[0]]
    bound = aim + ulps * np.spacing(aim)
    bounds = (-6.0, bound) if direction > 0 else (bound, 9.0)
    branch = trace(line(), bounds=bounds)
    assert [end.reason.value for end in branch.ends] == ["bound", "bound"]
    ends = branch.column("p")[[0, -1]]
    assert ends == pytest.approx(bounds, abs=1e-12) and (np.diff(branch.column("s")) > 0.0).all()
