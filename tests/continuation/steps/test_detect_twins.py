"""What lies in a step, on a line whose monitors are given functions of the parameter, and on branches in closed form."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import CorrectorStatus, LocationStatus, SpecialPointKind, StopReason
from bifurc.continuation.problem import Corrected, Monitor
from bifurc.continuation.steps import detect, hidden, tori
from bifurc.continuation.steps.arclength import Half
from bifurc.continuation.steps.rows import Curve, Part, Row
from bifurc.continuation.steps.rows import tests_of as values_of
from tests.continuation.problems import Scalar, parabola, pitchfork, transcritical
from tests.continuation.steps.lines import GRAZING, SLIDE, SPEED, USER, Line, edge, row_at, user, walk

# boundaries

@pytest.mark.parametrize("order", [(0.35, 0.6), (0.6, 0.35), (0.35, 5.0), (5.0, 0.35)])
def test_a_step_is_cut_at_the_earliest_boundary(order):
    names = ["first", "second"]
    half, row, new = walk(Line(*(edge(lambda p, at=at: (p - at) * (1.0 + p), name=name)
                                 for at, name in zip(order, names, strict=True))), -0.3, 0.1, 0.9)
    cut, cause = detect.boundary(half, row, new)
    assert cause is None and cut.test == 1 + order.index(0.35)
    assert cut.row.p == pytest.approx(0.35, abs=1e-12) and cut.row.s == pytest.approx(SPEED * 0.35, abs=1e-9)
    assert cut.special.kind is GRAZING and cut.special.name == names[cut.test - 1] and cut.special.s == cut.row.s
    assert cut.special.low <= cut.special.s <= cut.special.high
    assert abs(cut.special.x[-1] - 0.35) <= cut.special.error < 1e-9
    assert cut.row.angle == pytest.approx(new.angle * 0.25 / 0.8, rel=1e-6)


def test_no_boundary_and_a_start_beyond_one():
    half, row, new = walk(Line(edge(lambda p: p - 2.0)), -0.3, 0.1, 0.9)
    assert detect.boundary(half, row, new) == (None, None)
    half, row, new = walk(Line(user(lambda p: p - 0.5)), -0.3, 0.1, 0.9)
    assert detect.boundary(half, row, new) == (None, None)
    half, row, new = walk(Line(edge(lambda p: p + 2.0)), -0.3, 0.1, 0.9)
    cut, (reason, factor, _) = detect.boundary(half, row, new)
    assert cut is None and reason is StopReason.INADMISSIBLE and 0.0 < factor < 1.0
    half, row, new = walk(Line(edge(lambda p: p)), 0.0, 0.5)
    assert detect.boundary(half, row, new)[1][0] is StopReason.NO_SUCCESSOR  # it begins on the boundary and leads out


def test_a_last_row_that_creeps_at_a_boundary():
    near, far = edge(lambda p: 1e-7 * (p - 2.0), name="near"), edge(lambda p: p - 2.0, SLIDE, "far")
    half, row, _ = walk(Line(far, near), -0.3, 0.1, 0.9)
    half.sizes = [1.0, 1.0, 1.0]
    cut = detect.creeping(half, row)
    assert cut.test == 2 and cut.special.name == "near" and cut.row is row and cut.special.low < row.s < cut.special.high
    row.tests[1:] = [-1e-6, -1e-7]
    for sizes, test in (([1.0, 1.0, 1.0], 2), ([1.0, 1.0, 1e-3], 1)):  # the nearest, for what each has been
        half.sizes = sizes
        assert detect.creeping(half, row).test == test
    half.sizes, half.rows = [1.0, 1.0, 1.0], half.rows[-1:]
    assert detect.creeping(half, row) is None  # the first row: nothing has crept


def test_a_point_behind_the_last_row():
    problem = Line()
    half, row, _ = walk(problem, -0.3, 0.1, 0.9)
    asked = []

    def end_point(x, reason):
        asked.append((float(x[-1]), reason))
        return end
    problem.end_point, half.reason = end_point, StopReason.DS_MIN
    end = SimpleNamespace(x=np.array([0.05 + 0.06, 0.1 + 0.04]), problem=None, kind=GRAZING, name="end", error=1e-3)
    detect.behind(half, row)
    (found,) = half.found
    assert asked == [(0.1, StopReason.DS_MIN)] and (found.kind, found.name, found.error) == (GRAZING, "end", 1e-3)
    assert found.s - row.s == pytest.approx(0.05) and (found.low, found.high) == (row.s, pytest.approx(row.s + 0.1))
    end = SimpleNamespace(x=np.array([7.0, 8.0, 0.1 - 0.04]), problem=Line(), kind=GRAZING, name="other", error=1e-3)
    detect.behind(half, row)
    assert half.found[1].tangent.tolist() == [0.0, 0.0, -1.0] and half.found[1].s - row.s == pytest.approx(0.04)
    assert half.parts[-1].problem is end.problem and half.found[1].part.index == half.parts[0].index + 1
    half.options = SimpleNamespace(low=0.07, high=9.0)
    detect.behind(half, row)
    end = None
    detect.behind(half, row)
    assert len(half.found) == 2


# zeros of monitors

def test_all_zeros_of_a_step_are_found_in_order():
    half, row, new = walk(Line(user(lambda p: math.sin(p - 0.8), "late"), user(lambda p: 0.3 - p**3, "early"),
                               user(lambda p: p - 3.0, "none")), -0.3, 0.1, 1.1)
    found, cause = detect.crossed(half, row, new, None)
    assert cause is None and [special.name for special in found] == ["early", "late"]
    for special, p in zip(found, (0.3**(1.0 / 3.0), 0.8), strict=True):
        assert special.kind is USER and special.status is LocationStatus.LOCATED and not special.reverses
        assert abs(special.x[-1] - p) <= special.error < 1e-10 and special.x[0] == pytest.approx(0.5 * p)
        assert special.low <= special.s <= special.high and special.s == pytest.approx(SPEED * p, abs=1e-9)
        back = special.as_row(row)
        assert back.p == special.x[-1] and back.s == special.s and abs(back.tests[found.index(special) and 1 or 2]) < 1e-9
    half.found = found
    assert detect.crossed(half, row, new, None)[0] == []  # known


def test_zeros_that_are_none_are_not_listed():
    for monitors, more in (
            ([user(lambda p: p - 0.8, falling=True)], {}),  # it rises
            ([user(lambda p: p - 0.8)], {"confirms": lambda kind, x: False}),
            ([user(lambda p: math.nan if p > 0.5 else p - 0.8)], {}),
            ([user(lambda p: math.nan if p < 0.5 else p - 0.8)], {}),
            ([user(lambda p: (p - 0.8)**2 + 1e-3)], {})):
        half, row, new = walk(Line(*monitors, **more), -0.3, 0.1, 1.1)
        assert detect.crossed(half, row, new, None) == ([], None)
    half, row, new = walk(Line(user(lambda p: 0.8 - p, falling=True)), -0.3, 0.1, 1.1)
    assert len(detect.crossed(half, row, new, None)[0]) == 1


def test_a_zero_that_a_row_hits_counts_once():
    problem = Line(user(lambda p: p - 0.4))
    half, row, new = walk(problem, -0.3, 0.1, 0.4)
    first = detect.crossed(half, row, new, None)[0]
    detect.remember(half, new, half.rows)
    half.rows.append(new)
    half.found += first
    later = row_at(new.part, 0.9)
    second = detect.crossed(half, new, later, None)[0]
    assert [special.x[-1] for special in first + second] == pytest.approx([0.4], abs=1e-12)
    half, row, new = walk(Line(user(lambda p: (p - 0.4)**2)), -0.3, 0.1, 0.4)  # touched, not crossed
    assert detect.crossed(half, row, new, None)[0] == []


def test_the_pair_of_rows_that_a_sign_changed_between():
    half, row, _ = walk(Line(user(lambda p: min(0.4 - p, 0.0) if p > 0.1 else 0.4 - p)), -0.3, 0.1, 0.3, 0.4, 0.9)
    last, (a, b, c, d) = row_at(row.part, 0.9), half.rows
    for r, value in zip((a, b, c, d, last), (0.7, 0.3, 0.0, 0.0, -0.5), strict=True):
        r.tests[1] = value
    assert detect.earlier_pair(half, d, last, 1, 1) == (b, c)
    c.part = Part(row.part.problem, 5)  # rows of other equations tell nothing
    assert detect.earlier_pair(half, d, last, 1, 1) == (d, last)


def test_a_guess_is_the_place_on_the_secant():
    part = Part(Line(user(lambda p: p**3 - 0.2, "mine")), 0)
    a, b = row_at(part, 0.2), row_at(part, 1.0)
    special = detect.guessed(part, a, b, 1)
    t = 0.192 / (0.192 + 0.8)
    assert special.status is LocationStatus.GUESS and special.name == "mine" and special.kind is USER
    assert special.x == pytest.approx([0.5 * (0.2 + 0.8 * t), 0.2 + 0.8 * t]) and special.s == pytest.approx(a.s + t * (b.s - a.s))
    assert (special.low, special.high) == (a.s, b.s) and special.error >= 0.8


def test_the_error_of_a_parameter_is_that_of_the_place_times_its_slope():
    part = Part(Line(user(lambda p: p - 0.4)), 0)
    a, b = row_at(part, 0.2), row_at(part, 1.0)
    curve = Curve(a, b)
    c = curve.at(0.25)
    for error in (1e-6, 1e-3):
        root = SimpleNamespace(at=0.25, error=error, slope=0.5, p_curve=0.0, p_noise=0.0)
        assert detect.parameter_error(part, c, root, 1, curve) == pytest.approx(0.8 * error, rel=1e-6)  # in parts of the step
        assert detect.parameter_error(part, c, root, 1) == pytest.approx(error / SPEED, rel=1e-6)  # in arclength
        bent = SimpleNamespace(at=0.25, error=error, slope=0.5, p_curve=3.0, p_noise=0.0)
        assert detect.parameter_error(part, c, bent, 1) == pytest.approx(error / SPEED + 1.5 * error**2, rel=1e-6)
        assert detect.parameter_error(part, c, bent, 1, curve) == pytest.approx(0.8 * error, rel=1e-6)  # no bend there
        noisy = SimpleNamespace(at=0.25, error=error, slope=0.5, p_curve=0.0, p_noise=0.5)
        assert detect.parameter_error(part, c, noisy, 1, curve) == pytest.approx(0.5 + 0.8 * error)
    part.problem.uncertainty = lambda x, tangent: 0.25
    assert detect.parameter_error(part, c, root, 1, curve) == pytest.approx(0.25 + 0.8 * error)
    part.problem.test_uncertainty = lambda found: 0.1  # of a test that grows by a half a step
    assert detect.parameter_error(part, c, root, 1, curve) == pytest.approx(0.25 + 0.8 * (error + 0.2))


@pytest.mark.parametrize("power", (3, 5))
def test_the_place_of_a_flat_zero_is_known_to_where_it_is_clear(power):
    """Of a test that is zero with a power of the way the slope in the root is rounding: what it says of the place is none."""
    part = Part(Line(user(lambda p: (p - 0.4)**power)), 0)
    curve = Curve(row_at(part, 0.2), row_at(part, 1.0))
    c = curve.at(0.25)
    part.problem.test_uncertainty = lambda found: 1e-16
    root = SimpleNamespace(at=0.25, error=0.3, slope=1e-16, p_curve=0.0, p_noise=0.0)
    place = 0.8 * detect.place_error(part, c, root, 1, curve)
    assert (4e-16)**(1.0 / power) < place * 2.0 and place <= 100.0 * (4e-16)**(1.0 / power)
    assert detect.place_error(part, c, root, 1) == pytest.approx(1.3)  # along the tangent of a row alone nothing is asked


@pytest.mark.parametrize("astray, slope, flat", [(True, 1e-17, False), (False, 1e-17, True), (False, 1e-14, False)])
def test_a_zero_is_not_flat_for_what_another_solution_has_there(monkeypatch, astray, slope, flat):
    """Far behind a step of 1e-5 Newton may end anywhere: what is found there counts only where it lies on the curve, and only where
    the slope at the root is not that of the line which the test is nearer to it."""
    part = Part(Line(user(lambda p: 1e-9 * (p - 0.4))), 0)
    curve, correct = Curve(row_at(part, 0.4 - 2e-6), row_at(part, 0.4 + 8e-6)), part.problem.correct
    part.problem.test_uncertainty = lambda found: 4e-12

    def elsewhere(x, tangent):
        made = correct(x, tangent)
        if abs(float(x[-1]) - 0.4) > 5e-4:
            made.monitors, made.distance = made.monitors + 1e-4, 1.0 if astray else 0.0
        return made
    monkeypatch.setattr(part.problem, "correct", elsewhere)
    root = SimpleNamespace(at=0.2, error=1e-12, slope=slope)
    found = detect.flat_to(part, curve.at(0.2), root, 1, curve)
    assert found == (pytest.approx(1e-3 / curve.length) if flat else 0.0)


def test_numbers_that_move_a_zero_belong_to_its_error():
    """A zero at p = k: changing k by the part h moves it by h k; a test that jumps beyond its zero tells it on one side alone."""
    part = Part(Line(user(lambda p: p - 0.4)), 0)
    a, b = row_at(part, 0.2), row_at(part, 1.0)
    curve = Curve(a, b)
    c = curve.at(0.25)
    for of in (lambda p, k: p - k, lambda p, k: p - k if p >= k else -1.0):
        pair = [lambda k=k, of=of: Line(user(lambda p: of(p, k))) for k in (0.4 * (1.0 + 1e-6), 0.4 * (1.0 - 1e-6))]
        part.problem.shaken = lambda pair=pair: (1e-6, (pair, pair))
        for length, slope in ((curve.length, 0.8), (1.0, SPEED)):
            found = detect.number_error(part, c, SimpleNamespace(slope=slope), 1, length)
            assert found == pytest.approx(detect.FLOW * 0.4, rel=1e-3)
    part.problem.shaken = lambda: (1e-6, ())
    assert detect.number_error(part, c, SimpleNamespace(slope=1.0), 1, 1.0) == 0.0


@pytest.mark.parametrize("step", [1e-6, 1e-5, 1e-3, 0.8])
@pytest.mark.parametrize("of, error", [
    (lambda p, k: p - k, 0.4), (lambda p, k: p - k if p >= k else math.nan, 0.4),
    (lambda p, k: p - k if p >= k else -1.0, 0.4), (lambda p, k: p - k if k == 0.4 else math.nan, math.inf)])
def test_in_a_short_step_numbers_move_a_zero_as_far(step, of, error):
    """However short the step in which it lies; what is known for no change of the numbers is not known, and not zero."""
    part = Part(Line(user(lambda p: p - 0.4)), 0)
    c = Curve(row_at(part, 0.4 - 0.25 * step), row_at(part, 0.4 + 0.75 * step)).at(0.25)
    pair = [lambda k=k: Line(user(lambda p: of(p, k))) for k in (0.4 * (1.0 + 1e-6), 0.4 * (1.0 - 1e-6))]
    part.problem.shaken = lambda: (1e-6, (pair, pair))
    found = detect.number_error(part, c, SimpleNamespace(slope=step), 1, step * SPEED)
    assert found == (math.inf if error == math.inf else pytest.approx(detect.FLOW * error, rel=1e-3))


@pytest.mark.parametrize("start", [0.2, 0.35, 0.45, 0.8])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_shallow_dip_is_found_from_afar(start, sign):
    """(p - .6)^2 (1 + p) - 1e-7, looked for from another place of the step; the same at a height is none."""
    for depth, seen in ((1e-7, True), (-1e-7, False)):
        half, row, new = walk(Line(user(lambda p, d=depth: sign * ((p - 0.6)**2 * (1.0 + p) - d))), -0.3, 0.1, 1.1)
        found = hidden.between(half, row, new, 1, start, sign, told=-depth)  # not what is met there
        assert (found is not None) is seen
        if seen:
            assert abs(found.p - 0.6) < 1e-3 and sign * found.tests[1] < 0.0 and found.s == pytest.approx(SPEED * found.p)
            assert found.ds == pytest.approx(new.s - found.s)


def test_a_zero_at_the_first_row_is_listed_once():
    half, row, _ = walk(Line(user(lambda p: p - 0.2, "here"), user(lambda p: p - 0.3, "not here")), 0.2, 0.9)
    (found,) = detect.at_end(half, row)
    assert found.name == "here" and abs(found.x[-1] - 0.2) <= found.error < 1e-10 and found.s == row.s and not found.reverses
    assert found.low <= row.s <= found.high
    half.found = [found]
    assert detect.at_end(half, row) == []


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_whether_a_first_row_is_a_zero_does_not_depend_on_the_size_of_a_test(size):
    for at, count in ((0.2, 1), (0.2 + 1e-3, 0)):
        half, row, _ = walk(Line(user(lambda p, at=at: size * (p - at))), 0.2, 0.9)
        assert len(detect.at_end(half, row)) == count


def test_the_size_of_a_test_beside_a_first_row_is_its_slope():
    half, row, _ = walk(Line(user(lambda p: 3.0 * (p - 0.2) + 5.0 * (p - 0.2)**2)), 0.2, 0.9)
    assert detect.size_beside(half, row, 1) == pytest.approx(3.0 / SPEED, rel=1e-3)
    half.sizes[1] = 1.0
    assert detect.size_beside(half, row, 1) == 0.0  # it is known
    half, row, _ = walk(Line(user(lambda p: 3.0 * (p - 0.2) + 1e-3)), 0.2, 0.9)
    assert detect.size_beside(half, row, 1) == 0.0  # no zero


# folds and branch points

def on_parabola(part, u):
    """Row of p = -u^2 at ``u``."""
    slope = np.array([1.0, -2.0 * u])
    t = slope / np.linalg.norm(slope)
    J = np.array([[2.0 * u, 1.0], t])
    c = Corrected(np.array([u, -u * u]), t, True, CorrectorStatus.CONVERGED, 3, 1e-15, 0.0, 0.0,
                  math.copysign(1.0, np.linalg.det(J)), math.log(abs(np.linalg.det(J))), np.zeros(0))
    s = 0.5 * (u * math.sqrt(1.0 + 4.0 * u * u) + 0.5 * math.asinh(2.0 * u))
    return Row(c, part, s, 0.05, values_of(c), 0.1)


@pytest.mark.parametrize("low, high", [(-0.1, 0.05), (-0.02, 0.11)])
def test_a_fold_is_where_the_parameter_turns(low, high):
    part = Part(parabola(scale_u=1.0, scale_p=1.0), 0)
    rows = [on_parabola(part, u) for u in (low - 0.1, low, high)]
    half = Half(rows[0], SimpleNamespace(low=-9.0, high=9.0))
    detect.remember(half, rows[1], half.rows)
    half.rows.append(rows[1])
    (found,), cause = detect.crossed(half, rows[1], rows[2], None)
    assert cause is None and found.kind is SpecialPointKind.FOLD and found.reverses and found.name == ""
    assert abs(found.x[-1]) <= found.error < 1e-9 and abs(found.x[0]) < 1e-6 and found.s == pytest.approx(0.0, abs=1e-5)
    assert found.low <= found.s <= found.high


@pytest.mark.parametrize("problem", [pitchfork, transcritical])
@pytest.mark.parametrize("low, high", [(-0.2, 0.3), (-0.35, 0.1)])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_branch_point_on_the_way(problem, low, high, way):
    part = Part(problem(scale_u=1.0, scale_p=1.0), 0)
    made = []
    for p in ((low, high) if way > 0.0 else (high, low)):
        c = Corrected(np.array([0.0, p]), np.array([0.0, way]), True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0,
                      math.copysign(1.0, p * way), math.log(abs(p)), np.zeros(0))
        made.append(Row(c, part, way * p, 0.0, values_of(c), 0.1))
    found, cause = detect.branch_point(*made)
    assert cause is None and found.kind is SpecialPointKind.BRANCH_POINT and found.status is LocationStatus.LOCATED
    assert np.abs(found.x).max() < 1e-6 and abs(found.x[-1]) <= max(found.error, 1e-9) and found.s == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(found.tangent, [0.0, way], atol=1e-6)
    other = found.directions[np.argmin(np.abs(found.directions @ [0.0, 1.0]))]
    wanted = np.array([1.0, 0.0]) if problem is pitchfork else np.array([1.0, 1.0]) / math.sqrt(2.0)
    assert abs(other @ wanted) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("known, apart", [(1e-9, True), (1e-7, True), (1e-5, False)])
@pytest.mark.parametrize("at_start", [True, False])
def test_a_branch_point_as_near_to_a_boundary_as_that_is_known_is_the_boundary(monkeypatch, known, apart, at_start):
    """Where an event is born the equations may be singular on the boundary itself, and what is singular beside it is rounding."""
    places = (0.0, 0.1) if at_start else (-0.1, 0.0)
    half, row, new = walk(Line(edge(lambda p: -abs(p))), *places, born=1 if at_start else -1)
    new.det_sign = -1.0
    found = SimpleNamespace(kind=SpecialPointKind.BRANCH_POINT, name="", x=row.x, tangent=row.tangent, s=1e-6 * (at_start or -1.0))
    monkeypatch.setattr(detect, "branch_point", lambda a, b: (found, None))
    half.edge = known if at_start else None
    cut = SimpleNamespace(test=1, inside={0: new}, special=SimpleNamespace(low=0.0, high=2.0 * known, known=0.0, bound=0.0))
    assert detect.crossed(half, row, new, None if at_start else cut)[0] == [found] * apart


def test_a_branch_point_is_looked_for_where_the_determinant_passes_zero(monkeypatch):
    """By the chord of the determinant: from 3 to -1, and from 1 to -3; without a change of sign at the end of the step."""
    asked = []
    monkeypatch.setattr(detect, "locate_crossing",
                        lambda problem, x: asked.append(float(x[-1])) or SimpleNamespace(status="near_miss"))
    for sizes, sign, place in (((3.0, 1.0), -1.0, 1.75), ((1.0, 3.0), -1.0, 1.25), ((1e300, 1e300), -1.0, 1.5),
                               ((3.0, 1.0), 1.0, 2.0)):
        part = Part(Line(), 0)
        a, b = row_at(part, 1.0), row_at(part, 2.0)
        a.det_log, b.det_log = (math.log(size) for size in sizes)
        b.det_sign = sign * a.det_sign
        found, cause = detect.branch_point(a, b)
        assert found is None and (cause is None) == (sign > 0.0) and asked[-1] == pytest.approx(place)


def test_a_sign_of_the_determinant_that_changes_without_a_branch_point_is_a_jump():
    part = Part(Line(), 0)
    a, b = row_at(part, 0.1), row_at(part, 0.5)
    b.det_sign = -1.0
    found, (reason, factor, _) = detect.branch_point(a, b)
    assert found is None and reason is StopReason.DS_MIN and 0.0 < factor < 1.0
    b.det_sign = 1.0
    assert detect.branch_point(a, b) == (None, None)


# pairs of multipliers

NS = (Monitor(SpecialPointKind.NEIMARK_SACKER), lambda p: 0.0)


def pair(size, angle=1.0):
    return [size * np.exp(1j * angle), size * np.exp(-1j * angle)]


@pytest.mark.parametrize("mu, at", [
    (lambda p: [*pair(1.0 + 0.3 * (p - 0.3)), *pair(1.0 - 0.2 * (p - 0.7), 2.0)], [0.3, 0.7]),
    (lambda p: [*pair(1.0 + 0.3 * (p - 0.3)), *pair(1.0 + 0.2 * (p - 0.7), 2.0)], [0.3, 0.7]),
    (lambda p: [*pair(1.0 - (p - 0.3) * (p - 0.9)), 0.2], [0.3, 0.9]),
    (lambda p: [*pair(0.8), 0.2], []),
    (lambda p: [*pair(1.0 + 0.3 * (p - 0.62)), *pair(0.7, 2.0)], [0.62]),
])
@pytest.mark.parametrize("begin", [0.0, 7.0])
def test_every_pair_that_passes_the_circle_in_a_step_is_found(mu, at, begin):
    """Wherever on the branch the step lies."""
    half, row, new = walk(Line(NS, mu=lambda p: mu(p - begin)), begin - 0.4, begin, begin + 1.0)
    found = detect.torus(half, row, new, None, [])
    assert sorted(special.x[-1] - begin for special in found) == pytest.approx(at, abs=1e-9)
    for special in found:
        assert special.kind is SpecialPointKind.NEIMARK_SACKER and special.s == pytest.approx(SPEED * special.x[-1], abs=1e-9)
        again = [other for other in found if other is not special]
        assert not any(abs(other.x[-1] - special.x[-1]) < 1e-9 for other in detect.torus(half, row, new, None, [special])), again


def test_a_pair_beside_a_real_multiplier_that_passes_is_told_apart():
    """A real one leaves at .5, a pair comes in at .3 or at .8; the fold is listed already."""
    for at in (0.3, 0.8):
        half, row, new = walk(Line(NS, mu=lambda p, at=at: [*pair(1.0 - 0.3 * (p - at)), 0.75 + 0.5 * p]), -0.4, 0.0, 1.0)
        fold = SimpleNamespace(kind=SpecialPointKind.FOLD, s=SPEED * 0.5, x=np.array([0.25, 0.5]))
        found = detect.torus(half, row, new, None, [fold])
        assert [special.x[-1] for special in found] == pytest.approx([at], abs=1e-9)
    half, row, new = walk(Line(NS, mu=lambda p: [*pair(0.5), 0.75 + 0.5 * p]), -0.4, 0.0, 1.0)
    assert detect.torus(half, row, new, None, [fold]) == []


def test_what_real_multipliers_explain_depends_on_where_they_pass():
    """The bisection counts those that have passed so far, and no more."""
    for fold_at, at in ((0.2, 0.6), (0.85, 0.4)):
        part = Part(Line(NS, mu=lambda p, f=fold_at, at=at: [*pair(1.0 + 0.4 * (p - at)), 1.0 + 0.5 * (p - f)]), 0)
        a, b = row_at(part, 0.0), row_at(part, 1.0)
        fold = SimpleNamespace(kind=SpecialPointKind.FOLD, s=SPEED * fold_at)
        _, root = tori.pair_on_circle(part, a, b, [fold])
        assert root.point.x[-1] == pytest.approx(at, abs=1e-9)
        before = SimpleNamespace(kind=SpecialPointKind.FOLD, s=SPEED * -0.2)  # of another step
        quiet = Part(Line(NS, mu=lambda p: [*pair(0.5), 0.3]), 0)
        assert tori.pair_on_circle(quiet, row_at(quiet, 0.0), row_at(quiet, 1.0), [before]) is None


def test_real_multipliers_of_other_places_explain_nothing_here():
    """A pair passes at .4, before two real ones do, or behind two that did in the step before."""
    def folds(*places):
        return [SimpleNamespace(kind=SpecialPointKind.FOLD, s=SPEED * at) for at in places]
    part = Part(Line(NS, mu=lambda p: [*pair(1.0 + 0.4 * (p - 0.4)), 1.0 + 0.5 * (p - 0.8), 1.0 + 0.5 * (p - 0.9)]), 0)
    _, root = tori.pair_on_circle(part, row_at(part, 0.0), row_at(part, 1.0), folds(0.8, 0.9))
    assert root.point.x[-1] == pytest.approx(0.4, abs=1e-9)
    part = Part(Line(NS, mu=lambda p: [*pair(1.0 + 0.4 * (p - 0.4)), 0.2]), 0)
    _, root = tori.pair_on_circle(part, row_at(part, 0.0), row_at(part, 1.0), folds(-0.3, -0.1))
    assert root.point.x[-1] == pytest.approx(0.4, abs=1e-9)


# what the ends of a step do not show

class Cubic(Scalar):
    """p = u^3 - e u: two folds at u = +-sqrt(e / 3)."""

    def __init__(self, e):
        super().__init__(lambda u, p: u**3 - e * u - p, lambda u, p: (3.0 * u * u - e, -1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
        self.e = e


def on_cubic(problem, *us):
    part = Part(problem, 0)
    dense = np.linspace(us[0], us[-1], 20001)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(dense), np.diff(dense**3 - problem.e * dense)))])
    rows = []
    for u in us:
        t = np.array([1.0, 3.0 * u * u - problem.e])
        t /= np.linalg.norm(t)
        det = np.linalg.det(np.array([[3.0 * u * u - problem.e, -1.0], t]))
        c = Corrected(np.array([u, u**3 - problem.e * u]), t, True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0,
                      math.copysign(1.0, det), math.log(abs(det)), np.zeros(0))
        rows.append(Row(c, part, float(np.interp(u, dense, length)), 0.1, values_of(c), 0.1))
    half = Half(rows[0], SimpleNamespace(low=-9.0, high=9.0))
    half.rows += rows[1:-1]
    return half, rows


@pytest.mark.parametrize("e, low, high", [(0.03, -0.3, 0.35), (0.003, -0.2, 0.25), (0.03, -0.4, 0.3)])
def test_two_folds_in_one_step_are_seen(e, low, high):
    half, rows = on_cubic(Cubic(e), low - 0.2, low, high)
    found = hidden.dip(half, rows[1], rows[2])
    assert abs(found.x[0]) < math.sqrt(e / 3.0) and found.tests[0] < 0.0
    assert rows[1].s < found.s < rows[2].s and found.ds == pytest.approx(rows[2].s - found.s)
    assert found.angle == pytest.approx(rows[2].angle * (found.s - rows[1].s) / (rows[2].s - rows[1].s))
    half, rows = on_cubic(Cubic(-e), low - 0.2, low, high)  # none
    assert hidden.dip(half, rows[1], rows[2]) is None


@pytest.mark.parametrize("at", [0.30, 0.45, 0.62])
def test_a_corner_is_where_both_sides_meet(at):
    """|t - at| - .02 seen at four places of which two are beside the corner."""
    places = [(t, abs(t - at) - 0.02) for t in (0.0, 0.2, 0.7, 1.0)]
    for k in (1, 2):
        assert hidden.cornered(places, k) == pytest.approx(at, abs=0.02 + 1e-9)
        assert hidden.cornered([(t, f + 0.1) for t, f in places], k) is None  # passed at a distance


def test_a_jump_to_a_branch_beside_is_seen_in_the_middle(monkeypatch):
    """(u - p^3)(u - p^3 - d) = 0: a step from one branch to the other has its middle on neither Hermite curve."""
    d = 0.05

    def both(u, p):
        return (u - p**3) * (u - p**3 - d)

    def slopes(u, p):
        total = 2.0 * (u - p**3) - d
        return total, -3.0 * p * p * total
    part = Part(Scalar(both, slopes, 0.0, 0.0, scale_u=1.0, scale_p=1.0), 0)

    def at(p, above, s):
        t = np.array([3.0 * p * p, 1.0])
        t /= np.linalg.norm(t)
        c = Corrected(np.array([p**3 + above, p]), t, True, CorrectorStatus.CONVERGED, 3, 0.0, 0.0, 0.0, 1.0, 0.0, np.zeros(0))
        return Row(c, part, s, 0.05, values_of(c), 0.1)
    monkeypatch.setattr(hidden, "doubtful", lambda *told: hidden.UNCLEAR)
    a, b = at(0.0, 0.0, 0.0), at(0.2, 0.0, 0.2)
    half = Half(a, SimpleNamespace(low=-9.0, high=9.0))
    half.rows.append(b)
    assert not hidden.jumped(half, b, at(0.4, 0.0, 0.2 + math.hypot(0.2, 0.056)), False)
    assert hidden.jumped(half, b, at(0.4, d, 0.2 + math.hypot(0.2, 0.106)), False)
    for told, answer in ((hidden.JUMPS, True), (0, False)):
        monkeypatch.setattr(hidden, "doubtful", lambda *given, told=told: told)
        assert hidden.jumped(half, b, at(0.4, d, 0.43), False) is answer
    monkeypatch.setattr(hidden, "doubtful", lambda *told: hidden.JUMPS)  # a determinant may be zero there: the middle tells
    assert not hidden.jumped(half, b, at(0.4, 0.0, 0.2 + math.hypot(0.2, 0.056)), True)
    assert hidden.jumped(half, b, at(0.4, d, 0.2 + math.hypot(0.2, 0.106)), True)
    half.rows = half.rows[1:]
    assert not hidden.jumped(half, b, at(0.4, d, 0.43), False)  # the first step: nothing is known before it


def test_what_a_jump_is_told_from(monkeypatch):
    told = []
    monkeypatch.setattr(hidden, "doubtful", lambda *given: told.append(given) or 0)
    half, row, new = walk(Line(), -0.4, 0.1, 0.7)
    for r, log in zip((half.rows[0], row, new), (-1.0, -1.5, -3.0), strict=True):
        r.det_log = log
    new.misfit, new.det_sign = 0.02, -1.0
    hidden.jumped(half, row, new, False)
    (misfit, corner, a, b, back, length, alike), = told
    assert (misfit, corner, alike) == (0.02, 0.0, False)
    assert (a, b) == pytest.approx((math.exp(-0.5), math.exp(-2.0))) and (back, length) == pytest.approx((0.5 * SPEED, 0.6 * SPEED))


def test_a_boundary_that_is_left_and_come_back_to_is_looked_up_where_the_problem_says():
    """The monitor is above zero between .4 and .6; the problem knows the place only of short enough a span."""
    asked = []

    def leaves(a, b):
        asked.append((a.p, b.p))
        return 0.5 if b.p - a.p > 0.9 else 0.25 if a.p > 0.45 else -1.0
    bump = edge(lambda p: 0.01 - (p - 0.65)**2)
    half, row, new = walk(Line(bump, leaves=leaves), -0.5, 0.0, 1.0)
    found = hidden.beyond(half, row, new)
    assert [span for one in asked for span in one] == pytest.approx([0.0, 1.0, 0.0, 0.5, 0.5, 1.0])
    assert found.p == pytest.approx(0.625) and found.tests[1] > 0.0 and found.s == pytest.approx(SPEED * 0.625)
    assert found.angle == pytest.approx(new.angle * 0.625) and found.ds == pytest.approx(SPEED * 0.375)
    half, row, new = walk(Line(bump), -0.5, 0.0, 1.0)
    assert hidden.beyond(half, row, new) is None


def test_a_row_on_a_boundary_is_told_to_rounding():
    half, row, new = walk(Line(edge(lambda p: p - 0.5), user(lambda p: p)), 0.0, 0.2, 0.5)
    half.sizes = [1.0, 1.0, 1.0]
    assert hidden.on_boundary(half, new) and not hidden.on_boundary(half, row)
    new.tests[1] = 1e-9
    assert not hidden.on_boundary(half, new)
    half, row, _ = walk(Line(edge(lambda p: p)), 0.0, 0.3, 0.9, born=1)
    half.edge = 1e-6
    begun = hidden.first_edge(half, half.rows[0])
    assert begun.row is half.rows[0] and begun.test == 1 and begun.known == 1e-6 and hidden.first_edge(half, row) is None
    at = Curve(half.rows[0], row).at
    assert begun.holds(half, SimpleNamespace(x=np.array([0.0, 1e-7]), monitors=[0.0]))
    assert not begun.holds(half, SimpleNamespace(x=np.array([0.0, 1e-5]), monitors=[0.0]))
    assert not begun.holds(half, at(0.5))


@pytest.mark.parametrize("scale", [(2.0, 1.0), (1e-4, 1.0), (1e4, 10.0)])
@pytest.mark.parametrize("shift, kept", [(0.5, False), (-0.5, False), (2.0, True), (-2.0, True)])
def test_a_pair_that_is_known_is_told_by_its_distance_in_scaled_unknowns(monkeypatch, scale, shift, kept):
    """Points of the circle are one where every scaled unknown agrees to a millionth, whatever the units are."""
    kind = SpecialPointKind.NEIMARK_SACKER
    problem = SimpleNamespace(scale=np.array(scale))
    part = SimpleNamespace(problem=problem, scale=problem.scale, kinds=(kind,))
    a, b = (SimpleNamespace(part=part, s=s) for s in (0.0, 1.0))
    known = SimpleNamespace(kind=kind, s=0.5, x=np.array([0.3, 0.7]) * scale)
    other = SimpleNamespace(kind=SpecialPointKind.FOLD, s=0.25, x=known.x)  # of another kind: it may lie there
    place, asked = known.x.copy(), []
    place[0] += shift * detect.SHORT * scale[0]

    def located(part, low, high, j, *made):
        asked.append((low.s, high.s))
        return SimpleNamespace(kind=kind, s=0.4, x=place)
    monkeypatch.setattr(detect, "beginning", lambda half, row, new, j: a)
    monkeypatch.setattr(detect, "Curve", lambda a, b: SimpleNamespace(length=1.0, at=lambda t: SimpleNamespace(x=known.x)))
    monkeypatch.setattr(detect, "Row", lambda c, part, s, *rest: SimpleNamespace(part=part, s=s))
    monkeypatch.setattr(detect, "tests_of", lambda c: None)
    monkeypatch.setattr(detect, "located", located)
    monkeypatch.setattr(detect, "next_to", lambda problem, point, x: True)
    monkeypatch.setattr(detect, "pair_on_circle", lambda part, low, high, found: (1,) if low.s < 0.4 < high.s else None)
    monkeypatch.setattr(detect, "inner_change", lambda part, low, high: None)
    b.angle = b.ds = 0.0
    found = detect.torus(None, a, b, None, [other, known])
    assert [special.x.tolist() for special in found] == ([place.tolist()] if kept else [])
    assert asked[0][0] < 0.4 < asked[0][1]
