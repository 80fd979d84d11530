"""The eighteen algebraic problems: every special point found, none invented, no jump, at every largest step."""
import math

import numpy as np
import pytest

from bifurc.continuation import Monitor, Problem, SpecialPointKind, StopReason, switch_branch, trace
from bifurc.continuation.kinds import CorrectorStatus
from bifurc.continuation.problem import Corrected
from bifurc.continuation.steps import detect, hidden
from bifurc.continuation.steps import rows as branch_rows
from bifurc.continuation.steps.arclength import Half, StepOptions
from bifurc.continuation.steps.rows import Part, Row
from tests.continuation.problems import (
    STEPS,
    Bratu,
    Product,
    Scalar,
    circle,
    close_pair,
    hysteresis,
    near_miss,
    parabola,
    pitchfork,
    transcritical,
)

FOLD = 2.0 / (3.0 * math.sqrt(3.0))
steps = pytest.mark.parametrize("ds_max", STEPS)


def listed(branch):
    """Kinds with parameters, after the checks that hold for every branch."""
    assert branch.audit.ok, branch.audit
    assert branch.column("residual").max() < 1e-12
    assert (np.diff(branch.column("s")) >= 0.0).all()
    return [(point.kind.value, point.parameter) for point in branch.special_points]


def check(branch, expected, tolerance=1e-13):
    """The special points are exactly ``expected``, within ``tolerance`` and within the errors that they claim."""
    found = listed(branch)
    assert [kind for kind, _ in found] == [kind for kind, _ in expected], branch.special_points
    for point, (_, truth) in zip(branch.special_points, expected, strict=True):
        assert abs(point.parameter - truth) <= min(tolerance, point.error)
        low, high = point.bracket
        assert low <= point.s <= high


@steps
def test_pitchfork_from_the_trivial_branch(ds_max):
    branch = trace(pitchfork(), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [("branch_point", 0.0)])
    assert not branch.special_points[0].reverses
    assert np.abs(branch.column("u_0")).max() == 0.0
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)


@steps
def test_pitchfork_from_the_side_branch_touches_and_is_no_fold(ds_max):
    branch = trace(pitchfork(1.0, 1.0), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [("branch_point", 0.0)])
    assert branch.special_points[0].reverses
    assert branch.column("u_0").min() == pytest.approx(-1.0, abs=1e-14)
    assert branch.column("u_0").max() == pytest.approx(1.0, abs=1e-14)


@steps
def test_transcritical(ds_max):
    branch = trace(transcritical(), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [("branch_point", 0.0)])
    others = switch_branch(branch.special_points[0])
    assert len(others) == 2
    for start in others:
        other = trace(start, bounds=(-1, 1), ds_max=ds_max)
        check(other, [("branch_point", 0.0)])
        assert np.abs(other.column("u_0") - other.column("p")).max() < 1e-13


@steps
@pytest.mark.parametrize("direction", [None, 1, -1])
def test_started_at_the_fold(ds_max, direction):
    branch = trace(parabola(), bounds=(-1, 1), ds_max=ds_max, direction=direction)
    check(branch, [("fold", 0.0)])
    assert branch.special_points[0].s == 0.0
    ends = branch.column("u_0")[[0, -1]]
    assert sorted(np.abs(ends)) == pytest.approx([1.0, 1.0] if direction is None else [0.0, 1.0], abs=1e-14)


@steps
def test_two_folds(ds_max):
    check(trace(hysteresis(), bounds=(-1, 1), ds_max=ds_max), [("fold", FOLD), ("fold", -FOLD)])


@steps
def test_a_missing_jacobian_costs_few_digits(ds_max):
    check(trace(hysteresis(differenced=True), bounds=(-1, 1), ds_max=ds_max), [("fold", FOLD), ("fold", -FOLD)], 1e-12)


@steps
@pytest.mark.parametrize("start", [(1.0, 0.0), (0.0, 1.0), (-0.6, 0.8), (0.6, -0.8)])
@pytest.mark.parametrize("direction", [None, -1])
def test_a_closed_branch_is_listed_once(ds_max, start, direction):
    branch = trace(circle(*start, scale_u=1.0, scale_p=1.0), bounds=(-2, 2), ds_max=ds_max, direction=direction)
    assert branch.closed
    assert sorted(listed(branch)) == [("fold", pytest.approx(-1.0, abs=1e-14)), ("fold", pytest.approx(1.0, abs=1e-14))]
    assert branch.x(0).tolist() == branch.x(len(branch) - 1).tolist()
    s = branch.column("s")
    assert s[-1] - s[0] == pytest.approx(2.0 * math.pi, abs=1e-3)
    angles = np.unwrap(np.arctan2(branch.column("u_0"), branch.column("p")))
    assert abs(angles[-1] - angles[0]) == pytest.approx(2.0 * math.pi, abs=1e-12)
    assert (np.diff(angles) > 0.0).all() or (np.diff(angles) < 0.0).all()


@steps
def test_small_isola_around_a_seed(ds_max):
    branch = trace(circle(1e-3, 0.0, radius=1e-3), bounds=(-1, 1), ds_max=ds_max)
    assert branch.closed
    check(branch, [("fold", 1e-3), ("fold", -1e-3)])


@steps
@pytest.mark.parametrize("eps", [1e-2, 1e-4, 1e-8])
def test_near_miss_neither_jumps_nor_invents(ds_max, eps):
    branch = trace(near_miss(eps), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [])
    assert branch.column("u_0").min() > 0.0
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert branch.column("p")[[0, -1]].tolist() == [-1.0, 1.0]


@steps
@pytest.mark.parametrize("delta", [1e-1, 1e-3, 1e-6])
def test_sharp_fold(ds_max, delta):
    branch = trace(parabola(math.sqrt(delta), -1.0, delta), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [("fold", 0.0)])
    assert branch.column("u_0")[[0, -1]] == pytest.approx([math.sqrt(delta), -math.sqrt(delta)], rel=1e-12)


@steps
def test_two_folds_a_millionth_apart(ds_max):
    a = (1e-6 / 4.0)**(1.0 / 3.0)
    branch = trace(close_pair(a), bounds=(-1, 1), ds_max=ds_max)
    check(branch, [("fold", 2 * a**3), ("fold", -2 * a**3)])


@steps
def test_a_pair_below_resolution_is_reported(ds_max):
    branch = trace(close_pair(1e-7), bounds=(-1, 1), ds_max=ds_max)
    count = len(branch.special_points)
    assert count == 2 or (count == 0 and branch.audit.unresolved and not branch.audit.ok)


@pytest.mark.parametrize("ds_max", [0.1, 0.5])
def test_bratu(ds_max):
    branch = trace(Bratu(), bounds=(0, 4), ds_max=ds_max, direction=1, stop=lambda point: point.u.max() > 6.0)
    (fold,) = branch.special_points
    assert fold.kind.value == "fold"
    assert abs(fold.parameter - 3.513647903969339) <= min(1e-12, fold.error)


@pytest.mark.parametrize("ds", [0.1, 0.25, 0.5])
def test_a_step_exactly_on_a_fold(ds):
    """On the unit circle, from a start whose third step of equal turn ends on the fold to rounding."""
    k = 3
    turn = math.asin(ds)  # a step ds along the tangent, corrected in its plane, turns by this
    start = 0.5 * math.pi - k * turn
    branch = trace(circle(math.cos(start), math.sin(start), scale_u=1.0, scale_p=1.0), bounds=(-2, 2), ds=ds, ds_max=ds)
    assert branch.closed
    assert sorted(p for _, p in listed(branch)) == pytest.approx([-1.0, 1.0], abs=1e-14)


@pytest.mark.parametrize("offset", [0.0, 1e-17, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, -1e-15, -1e-11, -1e-8])
def test_starts_beside_a_fold_list_it_once(offset):
    branch = trace(parabola(offset, -offset * offset), bounds=(-1, 1), ds_max=0.1)
    check(branch, [("fold", 0.0)])


@steps
@pytest.mark.parametrize("make", [pitchfork, transcritical])
@pytest.mark.parametrize("start", [-1.0, 0.0])
def test_branch_point_at_a_bound(ds_max, make, start):
    branch = trace(make(0.0, start), bounds=(0, -1), ds_max=ds_max)
    check(branch, [("branch_point", 0.0)])
    assert branch.column("p")[-1] == 0.0


@steps
def test_fold_at_a_bound(ds_max):
    branch = trace(parabola(1.0, -1.0), bounds=(-1, 0), ds_max=ds_max)
    assert [kind for kind, _ in listed(branch)] == ["fold"]
    assert abs(branch.special_points[0].parameter) < 1e-15


@steps
def test_scaled_unknowns_and_parameter(ds_max):
    plain = trace(hysteresis(), bounds=(-1, 1), ds_max=ds_max)
    scaled = trace(hysteresis(1e6, 1e-3), bounds=(-1e-3, 1e-3), ds_max=ds_max)
    check(scaled, [("fold", 1e-3 * FOLD), ("fold", -1e-3 * FOLD)], 1e-16)
    assert len(plain) == len(scaled)
    assert scaled.column("u_0") / 1e6 == pytest.approx(plain.column("u_0"), rel=1e-9)


@steps
def test_tracing_back_finds_the_same(ds_max):
    branch = trace(hysteresis(), bounds=(-1, 1), ds_max=ds_max)
    end = branch.problems[0].restarted(branch.x(len(branch) - 1))
    back = trace(end, bounds=(-1, 1), ds_max=ds_max)
    there, here = (sorted(point.parameter for point in b.special_points) for b in (branch, back))
    assert there == pytest.approx(here, abs=1e-14)
    u, p = back.column("u_0"), back.column("p")
    assert np.abs(u**3 - u - p).max() < 1e-14
    assert back.column("u_0")[[0, -1]] == pytest.approx(branch.column("u_0")[[0, -1]], abs=1e-13)


@pytest.mark.parametrize("n", [1, 3])
def test_a_vertical_branch_has_no_folds(n):
    """p = 0 for every u: dp/ds is rounding, of any sign."""
    from bifurc.continuation import Problem

    class Vertical(Problem):
        def residual(self, u, p):
            return np.append(p * (1.0 + u[0]**2), u[1:] - np.sin(u[0]))

        def jacobian(self, u, p):
            fu, fp = np.eye(u.size), np.zeros(u.size)
            fu[0, 0], fp[0] = 2.0 * p * u[0], 1.0 + u[0]**2
            fu[1:, 0] -= np.cos(u[0])
            return fu, fp

    branch = trace(Vertical(np.zeros(n), 0.0), bounds=(-1, 1), max_steps=60)
    assert branch.special_points == ()
    assert branch.stop_reason == (StopReason.MAX_STEPS, StopReason.MAX_STEPS)


@pytest.mark.parametrize("seed", range(12))
def test_branches_that_cross(seed):
    """On w = a(p) every crossing with w = b(p) is a branch point; the tracer stays on w = a(p)."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=4), rng.normal(size=3)
    roots = np.roots(np.polysub(a, b))
    crossings = np.sort(roots[np.abs(roots.imag) < 1e-12].real)
    crossings = crossings[np.abs(crossings) < 1.0]
    for ds_max in STEPS[1:]:
        problem = Product(a, b, 0.0, 1 + seed % 4, rng)
        branch = trace(problem, bounds=(-1, 1), ds_max=ds_max)
        check(branch, [("branch_point", p) for p in crossings], 1e-12)
        for i in range(len(branch)):
            x = branch.x(i)
            assert abs((problem.inverse @ x[:-1])[0] - np.polyval(a, x[-1])) < 1e-11


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("eps", [1e-3, 1e-5, 1e-7])
def test_branches_that_nearly_cross(seed, eps):
    """The perturbed crossing has no branch points; the sheet of the start is kept through every near miss."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=4), rng.normal(size=3)
    side = np.sign(np.polyval(a, -1.0) - np.polyval(b, -1.0))
    problem = Product(a, b, eps, 1 + seed % 3, rng)
    branch = trace(problem, bounds=(-1, 1), ds_max=0.3)
    check(branch, [])
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    for i in range(len(branch)):
        x = branch.x(i)
        w = (problem.inverse @ x[:-1])[0]
        assert side * (2.0 * w - np.polyval(a, x[-1]) - np.polyval(b, x[-1])) > 0.0


@pytest.mark.parametrize("deep", [1.05, 1.3])
def test_two_folds_in_one_step(deep):
    """dp/du = 1 - deep (1 - u^2)^2 is 1 at u = -1 and 1 and negative between: the cubic through both ends has a dip above zero."""
    class Dip(Problem):
        def residual(self, u, p):
            return u - deep * (u - 2.0 * u**3 / 3.0 + u**5 / 5.0) - p

    problem = Dip(-1.0, -1.0 + deep * 8.0 / 15.0, scale_u=1.0, scale_p=10.0)
    part, rows = Part(problem, 0), []
    for u in (-1.0, 1.0):
        c = problem.correct(np.array([u, u * (1.0 - deep * 8.0 / 15.0)]), np.array([1.0, 0.0]))
        rows.append(Row(c, part, u, 0.1, branch_rows.tests_of(c), 0.1))
    half = Half(rows[0], StepOptions(-1.0, 1.0, 0.1, 1e-9, 0.5, 10))
    assert rows[0].tests[0] > 0.0 and rows[1].tests[0] > 0.0
    inner = hidden.dip(half, *rows)
    assert inner is not None and inner.tests[0] < 0.0
    assert abs(float(inner.x[0])) < np.sqrt(1.0 - np.sqrt(1.0 / deep))


def test_a_step_that_leads_aside_without_a_turn_is_rejected():
    """The sideways distance must fit the arc that the turn describes, to a tenth of the step."""
    class Line(Problem):
        def residual(self, u, p):
            return u - p

    problem = Line(0.0, 0.0, scale_u=1.0, scale_p=1.0)
    tangent = np.array([1.0, 1.0]) / np.sqrt(2.0)
    part = Part(problem, 0)
    row = Row(Corrected(np.zeros(2), tangent, True, CorrectorStatus.CONVERGED, 1, 0.0, 0.0, 0.0, 1.0, 0.0, np.empty(0)), part, 0.0,
              0.0, [tangent[-1]], 0.1)
    half = Half(row, StepOptions(-1.0, 1.0, 0.1, 1e-9, 0.5, 10))

    def judged(distance):
        c = Corrected(0.1 * tangent, tangent, True, CorrectorStatus.CONVERGED, 1, 0.0, distance, 0.0, 1.0, 0.0, np.empty(0))
        return half.judge(row, c, 0.1, False)

    assert judged(0.009)[0] is not None
    assert judged(0.011)[0] is None and judged(0.011)[1][0] == "ds_min"


def test_a_row_taken_back_comes_back_where_nothing_takes_its_place(monkeypatch):
    """A pair of zeros between the last two rows is looked at from the one before; where that fails the shorter step begins where
    this one did, and no row is lost."""
    problem = Scalar(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
    tangent, part = np.array([1.0, 1.0]) / np.sqrt(2.0), Part(problem, 0)
    places = (0.0, 0.1, 0.05, 0.2)
    first, row, inner, new = (Row(problem.correct(np.array([s, s]) / np.sqrt(2.0), tangent), part, s, 0.0, [tangent[-1]], 0.1)
                              for s in places)
    half = Half(first, StepOptions(-1.0, 1.0, 0.1, 1e-9, 0.5, 10))
    half.take(first, row, [])
    signs, found = list(half.signs), half.found
    cause = StopReason.DS_MIN, 0.5, "not located"
    with monkeypatch.context() as patch:
        patch.setattr(hidden, "dip", lambda half, row, new, cut=None: inner if new is not inner else None)
        patch.setattr(detect, "crossed", lambda half, row, new, cut: (None, cause))
        assert half.accept(row, new) == cause
    assert half.rows == [first, row] and half.signs == signs and half.found is found and half.steps == 1
    with monkeypatch.context() as patch:
        patch.setattr(hidden, "dip", lambda half, row, new, cut=None: inner if new is not inner else None)
        assert half.accept(row, new) is None
    assert half.rows == [first, inner] and half.steps == 1


@pytest.mark.parametrize("complex_pair", [False, True])
def test_a_product_of_multipliers_that_is_rounding_is_no_torus_point(complex_pair):
    """One of them is as small as the rounding of the largest, so that their product passes 1 anywhere: only their number outside
    the circle tells, which a complex pair changes at p = .25."""
    class Rounding(Scalar):
        monitors = (Monitor(SpecialPointKind.NEIMARK_SACKER),)

        def monitor_values(self, u, p, tangent):
            return np.array([np.copysign(0.5, np.sin(1e9 * p))])

        def floquet_multipliers(self, x):
            pair = (0.75 + x[-1]) * np.exp(np.array([1j, -1j])) if complex_pair else np.array([0.5, 0.2])
            return np.array([1e12, *pair, 1e-12 * np.sin(1e9 * x[-1])])

        def confirm(self, kind, x):
            return bool(np.abs(np.abs(self.floquet_multipliers(x)[1]) - 1.0) < 1e-6)

    branch = trace(Rounding(lambda u, p: u - p, lambda u, p: (1.0, -1.0), -1.0, -1.0, scale_u=1.0, scale_p=1.0), bounds=(-1.0, 1.0))
    assert branch.stop_reason[1] == StopReason.BOUND and len(branch) < 40
    assert [p.parameter for p in branch.special_points] == pytest.approx([0.25] if complex_pair else [], abs=1e-9)


@pytest.mark.parametrize(("rate", "width"), [(-150.0, 0.03), (0.0, 0.03), (-150.0, -0.2), (0.0, -0.2), (150.0, -0.2)])
def test_determinants_that_grow_fast_hide_no_branch_points_and_make_none(rate, width):
    """On u = 0 the determinant is exp(rate p) ((p - .37)^2 - w |w|): a factor of e^30 a step is no fall to a singular point, and a
    parabola through three such rows no pair of zeros; the pair of the second factor is found in spite of it."""
    class Growing(Problem):
        def residual(self, u, p):
            return u * np.exp(rate * p) * ((p - 0.37)**2 - width * abs(width))

    problem = Growing(0.0, -1.0, scale_u=1.0, scale_p=1.0)
    branch = trace(problem, bounds=(-1.0, 1.0), ds_max=0.2)
    assert branch.stop_reason[1] == StopReason.BOUND and branch.unresolved == ()
    found = [point.parameter for point in branch.special_points]
    assert found == pytest.approx([0.34, 0.40] if width > 0.0 else [], abs=1e-9)
    if width < 0.0:
        assert len(branch) <= 15  # as many steps as without the factor
