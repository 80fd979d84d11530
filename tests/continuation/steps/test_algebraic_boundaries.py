"""Branches that change their equations on the way: boundaries are located first, tests are one-sided."""
import math

import numpy as np
import pytest

from bifurc.continuation import Monitor, Problem, StopReason, trace
from bifurc.continuation.balance.problem import BalanceProblem
from bifurc.continuation.equilibria import EquilibriumProblem
from bifurc.continuation.kinds import NUMERICAL
from bifurc.continuation.shooting.problem import OrbitProblem
from tests.continuation.problems import GRAZE, P_GRAZE, Free, Hit, Scalar

SERIES = {  # p - P_GRAZE = c1 w + c2 w^2 + c3 w^3 behind the boundary
    "contact is born with dp/ds = 0 and turns back": (0.0, -1.0, 4.0),
    "a fold at once behind the birth": (0.0, -1.0, 200.0),
    "a fold within 1e-9 of the birth": (0.0, -1.0, 1.3e4),
    "contact is born with dp/ds = 0 and goes on": (0.0, 1.0, 0.5),
    "goes on with another slope": (0.5, 0.0, 1.0),
    "turns back with a corner": (-0.5, 0.0, 6.0),
}
steps = pytest.mark.parametrize("ds_max", [0.02, 0.05, 0.1, 0.2, 0.5, 1.0])


def expected(series):
    """Special points of the whole branch, sorted: from c1 + 2 c2 w + 3 c3 w^2 = 0 on w > 0, and the flip at w = 0.3."""
    c1, c2, c3 = series
    points = [("grazing", P_GRAZE)]
    for w in np.roots([3 * c3, 2 * c2, c1]):
        if abs(w.imag) < 1e-12 and w.real > 1e-12 and abs(P_GRAZE + c1 * w + c2 * w**2 + c3 * w**3) < 1.0:
            points.append(("fold", float((P_GRAZE + c1 * w + c2 * w**2 + c3 * w**3).real)))
    p = P_GRAZE + 0.3 * c1 + 0.09 * c2 + 0.027 * c3
    if abs(p) < 1.0:
        points.append(("period_doubling", p))
    return sorted(points)


def check(branch, series):
    truth = expected(series)
    found = sorted(branch.special_points, key=lambda point: (point.kind.value, point.parameter))
    assert [point.kind.value for point in found] == [kind for kind, _ in truth], branch.special_points
    for point, (_, p) in zip(found, truth, strict=True):
        assert abs(point.parameter - p) <= min(point.error, 1e-13)
    assert branch.audit.ok, branch.audit
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert len(branch.problems) == 2
    for i in range(len(branch)):
        x = branch.x(i)
        if x.size == 2:
            assert x[0] <= 0.2 + 1e-13
            assert abs(x[0] - x[1] - 0.3 * x[1]**2) < 1e-14
        else:
            assert x[1] >= -1e-13


@steps
@pytest.mark.parametrize("name", SERIES)
def test_through_a_boundary_and_back(name, ds_max):
    series = SERIES[name]
    branch = trace(Free(-0.9 + 0.3 * 0.81, -0.9, series), bounds=(-1, 1), ds_max=ds_max)
    check(branch, series)
    (graze,) = branch.special_points.of("grazing")
    assert (graze.before, graze.after) == ("free", "hit")
    assert graze.reverses == (series[0] < 0.0 or (series[0] == 0.0 and series[1] < 0.0))
    end = branch.problems[-1].restarted(branch.x(len(branch) - 1))
    back = trace(end, bounds=(-1, 1), ds_max=ds_max)
    check(back, series)
    (graze,) = back.special_points.of("grazing")
    assert sorted((graze.before, graze.after)) == ["free", "hit"]
    assert graze.reverses == branch.special_points.of("grazing")[0].reverses


def test_two_rows_lie_on_a_boundary():
    branch = trace(Free(0.0, 0.0, (0.5, 0.0, 1.0)), bounds=(-1, 1))
    s = branch.column("s")
    (graze,) = branch.special_points.of("grazing")
    assert np.count_nonzero(s == graze.s) == 2
    assert branch.column("p")[s == graze.s] == pytest.approx([P_GRAZE, P_GRAZE], abs=1e-15)
    assert np.isnan(branch.column("u_1")[s < graze.s]).all()
    assert np.isfinite(branch.column("u_1")[s > graze.s]).all()


class Window(Problem):
    """u = p with boundary and other monitors that are polynomials of p; `answer` is what `switch` returns."""

    def __init__(self, tests, boundaries=(), answer=None):
        super().__init__(-1.0, -1.0)
        self.tests, self.answer = tests, answer
        self.monitors = tuple(Monitor("grazing" if k in boundaries else "user", f"m{k}", k in boundaries)
                              for k in range(len(tests)))

    def residual(self, u, p):
        return u - p

    def jacobian(self, u, p):
        return np.eye(1), -np.ones(1)

    def monitor_values(self, u, p, tangent):
        return np.array([test(p) for test in self.tests])

    def switch(self, point, monitor):
        return self.answer


@pytest.mark.parametrize("ds_max", [0.02, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("gap", [0.3, 1e-2, 1e-3, 1e-4])
def test_a_pair_of_zeros_in_one_step(ds_max, gap):
    """A monitor that dips below zero between two rows: both zeros are found at every step length."""
    branch = trace(Window([lambda p: (p - 0.137)**2 - (0.5 * gap)**2]), bounds=(-1, 1), ds_max=ds_max)
    assert len(branch.special_points) == 2
    for point, truth in zip(branch.special_points, (0.137 - gap / 2, 0.137 + gap / 2), strict=True):
        assert abs(point.parameter - truth) <= point.error <= 1e-14 + 1e-15 / gap


@pytest.mark.parametrize("seed", range(12))
def test_zeros_of_wavy_monitors(seed):
    """Sums of sines up to six radians per unit: all zeros at every step up to a tenth of a wave."""
    rng = np.random.default_rng(seed)
    size, rate, phase = rng.normal(size=5), rng.uniform(1, 6, size=5), rng.uniform(0, 6, size=5)

    def test(p):
        return float(np.sum(size * np.sin(rate * p + phase)))

    grid = np.linspace(-1, 1, 20001)
    values = np.sum(size[:, None] * np.sin(rate[:, None] * grid + phase[:, None]), axis=0)
    zeros = grid[:-1][values[:-1] * values[1:] < 0.0]
    for ds_max in (0.02, 0.1, 0.2):
        branch = trace(Window([test]), bounds=(-1, 1), ds_max=ds_max)
        assert [point.parameter for point in branch.special_points] == pytest.approx(zeros, abs=2e-4)
        assert all(abs(test(point.parameter)) < 1e-12 for point in branch.special_points)


@pytest.mark.parametrize("ds_max", [0.02, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("depth", [0.0, 1e-14])
def test_a_touch_is_reported_as_unresolved(ds_max, depth):
    branch = trace(Window([lambda p: (p - 0.137)**2 - depth]), bounds=(-1, 1), ds_max=ds_max)
    assert branch.special_points == ()
    ((kind, _, p),) = branch.audit.unresolved
    assert kind == "user" and p == pytest.approx(0.137, abs=1e-5)
    assert not branch.audit.ok


@pytest.mark.parametrize("ds_max", [0.02, 0.1, 0.5, 1.0])
def test_the_earliest_of_several_boundaries_counts(ds_max):
    late, early, other = (lambda p: p - 0.31), (lambda p: p - 0.3), (lambda p: p - 0.305)
    branch = trace(Window([late, early, other], boundaries=(0, 1)), bounds=(-1, 1), ds_max=ds_max)
    assert [(point.kind.value, point.name) for point in branch.special_points] == [("grazing", "m1")]
    assert branch.special_points[0].parameter == pytest.approx(0.3, abs=1e-14)
    assert branch.stop_reason[1] is StopReason.NO_SUCCESSOR
    assert "grazing" in branch.ends[1].sentence


@pytest.mark.parametrize("ds_max", [0.02, 0.5])
def test_two_special_points_at_one_place_are_both_listed(ds_max):
    branch = trace(Window([lambda p: p - 0.25, lambda p: np.expm1(0.25 - p)]), bounds=(-1, 1), ds_max=ds_max)
    assert [point.name for point in branch.special_points] in (["m0", "m1"], ["m1", "m0"])
    assert [point.parameter for point in branch.special_points] == pytest.approx([0.25, 0.25], abs=1e-14)


@pytest.mark.parametrize("root", [-1.0, 1.0])
@pytest.mark.parametrize("slope", [1.0, -1.0, 1e-9, 1e9])
def test_zero_of_a_monitor_at_a_bound_counts_once(root, slope):
    branch = trace(Window([lambda p: slope * (p - root) * (p + 5.0)]), bounds=(-1, 1))
    assert [point.parameter for point in branch.special_points] == pytest.approx([root], abs=1e-14)


@pytest.mark.parametrize("function", [np.sin, np.tanh, lambda x: x**3 + x, lambda x: np.arctan(50 * x), np.expm1])
@pytest.mark.parametrize("noise", [0.0, 1e-13, 1e-10])
def test_the_error_encloses_the_truth(function, noise):
    """Zeros of monitors with deterministic noise of known size, at many places."""
    roots = np.random.default_rng(1).uniform(-0.95, 0.95, 12)

    def test(p, root):
        return function(p - root) + noise * math.sin(1e17 * (p - root))

    for root in roots:
        branch = trace(Window([lambda p, root=root: test(p, root)]), bounds=(-1, 1), ds_max=0.5)
        (point,) = branch.special_points
        assert abs(point.parameter - root) <= point.error
        if noise == 0.0:
            assert point.error < 1e-11


def test_answers_that_do_not_lead_on():
    start = Window([lambda p: p], boundaries=(0,))
    for answer, reason in ((None, "no equations"), ("chatter is complete", "chatter is complete"), (3, "TypeError")):
        start.answer = answer
        branch = trace(start, bounds=(-1, 1))
        assert branch.stop_reason[1] is StopReason.NO_SUCCESSOR
        assert reason in branch.ends[1].message
        assert branch.special_points[0].parameter == pytest.approx(0.0, abs=1e-15)


def test_mistakes_in_formulas_that_are_not_the_users_are_passed_on():
    start = Window([lambda p: p], boundaries=(0,))
    start.errors = NUMERICAL
    start.answer = 3
    with pytest.raises(TypeError):
        trace(start, bounds=(-1, 1))
    assert all(kind.errors == NUMERICAL for kind in (OrbitProblem, EquilibriumProblem, BalanceProblem))
    assert not issubclass(TypeError, NUMERICAL) and issubclass(np.linalg.LinAlgError, NUMERICAL)


@pytest.mark.parametrize("name", SERIES)
@pytest.mark.parametrize("offset", [0.0, 1e-15, -1e-15])
def test_a_start_on_the_boundary_goes_on_to_both_sides(name, offset):
    series = SERIES[name]
    check(trace(Hit([0.2, offset], P_GRAZE, series), bounds=(-1, 1)), series)
    check(trace(Free([0.2], P_GRAZE + offset, series), bounds=(-1, 1)), series)


class Grazing(Scalar):
    """u = p, valid where its monitor, of size 1 at first and then 1e-12 p, is at most 2e-13: no row may lie beyond."""

    monitors = (Monitor("grazing", boundary=True),)
    touch = 2e-13

    def monitor_values(self, u, p, tangent):
        return np.array([1e-12 * p - max(-p - 0.5, 0.0)])


def test_no_row_lies_beyond_what_its_problem_takes_for_valid():
    """A boundary that is passed slowly is none of rounding, however large its monitor was before."""
    branch = trace(Grazing(lambda u, p: u - p, lambda u, p: (1.0, -1.0), -1.0, -1.0), bounds=(-1, 1))
    values = [Grazing.monitor_values(None, None, p, None)[0] for p in branch.column("p")]
    assert max(values) <= Grazing.touch
    assert branch.stop_reason == (StopReason.BOUND, StopReason.DS_MIN)


class Unknown(Free):
    """As `Free`, with a flip that cannot be told on the boundary itself: 0 / 0, as where a contact has no duration."""

    monitors = (*Free.monitors, Monitor("period_doubling"))

    def __init__(self, u0, p0, series, before, **scales):
        super().__init__(u0, p0, series, **scales)
        self.before = before

    def monitor_values(self, u, p, tangent):
        away = GRAZE - u[0]
        return np.array([-away, away - self.before if abs(away) > 1e-12 else math.nan])


@steps
@pytest.mark.parametrize("before", [1e-2, 1e-5, 2e-7])
def test_a_flip_just_before_a_boundary_on_which_it_is_not_known(before, ds_max):
    """Found from the side that ends in the boundary."""
    series = SERIES["goes on with another slope"]
    branch = trace(Unknown(-0.9 + 0.3 * 0.81, -0.9, series, before), bounds=(-1, 1), ds_max=ds_max)
    at = (-1.0 + math.sqrt(1.0 + 1.2 * (GRAZE - before))) / 0.6
    flip = branch.special_points.of("period_doubling")[0]
    assert flip.parameter == pytest.approx(at, abs=1e-12)


class Strip(Problem):
    """p = P(u) for 0 < u < 1, a boundary at either end; the monitor is not known on both, 0 / 0, as where a contact has no time, or
    is what rounding leaves of it."""

    monitors = (Monitor("grazing", "low", boundary=True), Monitor("grazing", "high", boundary=True), Monitor("user"))

    def __init__(self, u0, parameter, test, edge=math.nan):
        self.parameter_of, self.test, self.edge = parameter, test, edge
        super().__init__(u0, parameter(u0), 1.0, 1.0)

    def residual(self, u, p):
        return p - self.parameter_of(u)

    def jacobian(self, u, p):
        return -np.array([self.parameter_of.deriv()(u)]), np.ones(1)

    def monitor_values(self, u, p, tangent):
        u = float(u[0])
        return np.array([-u, u - 1.0, self.test(u) if min(abs(u), abs(1.0 - u)) > 1e-12 else self.edge])


def kinds_and_places(branch):
    return [(point.kind.value, float(point.x[0])) for point in branch.special_points if point.kind.value != "grazing"]


@pytest.mark.parametrize("edge", [math.nan, 1.0, -1.0])
@pytest.mark.parametrize("ds", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("start", [0.02, 0.3, 0.7, 0.98])
@pytest.mark.parametrize("places", [(0.9, 0.96), (0.93, 0.99), (0.05, 0.1), (0.01, 0.06), (1e-3,), (0.999,)])
def test_zeros_beside_a_boundary_on_which_their_test_is_not_known(places, start, ds, edge):
    """One or two, between the boundary and the row next to it, before the one and behind the other."""
    test = np.polynomial.Polynomial.fromroots(places)
    problem = Strip(start, np.polynomial.Polynomial([0.0, 1.0]), test, edge)
    branch = trace(problem, bounds=(-2.0, 2.0), ds=ds, ds_max=ds)
    assert kinds_and_places(branch) == [("user", pytest.approx(u, abs=1e-9)) for u in places]


@pytest.mark.parametrize("edge", [math.nan, 1.0, -1.0])
@pytest.mark.parametrize("ds", [0.2, 0.5])
@pytest.mark.parametrize("places", [(0.93, 0.99), (0.05, 0.1), (1e-3,), (0.999,), (0.4,)])
def test_zeros_of_a_stretch_that_a_branch_enters(places, ds, edge):
    """From either boundary, on which the next equations begin."""
    test = np.polynomial.Polynomial.fromroots(places)
    for start in (0.0, 1.0):
        branch = trace(Strip(start, np.polynomial.Polynomial([0.0, 1.0]), test, edge), bounds=(-2.0, 2.0), ds=ds, ds_max=ds)
        assert kinds_and_places(branch) == [("user", pytest.approx(u, abs=1e-9)) for u in places]


@pytest.mark.parametrize("ends", [(1, 1), (0, 1), (1, 0)])
@pytest.mark.parametrize("start", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("pair", [(0.7, 0.8), (0.85, 0.95), (0.2, 0.3), (0.05, 0.12)])
def test_a_pair_of_folds_beside_a_boundary_on_which_the_parameter_stands_still(pair, start, ends):
    """dp/du = u^k (1 - u)^m (u - a) (u - b), at most 1: where a contact is born and dies, and turns twice on the way."""
    u = np.polynomial.Polynomial([0.0, 1.0])
    slope = u**ends[0] * (1.0 - u)**ends[1] * (u - pair[0]) * (u - pair[1])
    slope /= np.abs(slope(np.linspace(0.0, 1.0, 101))).max()
    branch = trace(Strip(start, slope.integ(), lambda u: 1.0), bounds=(-3.0, 3.0), ds=0.5, ds_max=0.5)
    assert kinds_and_places(branch) == [("fold", pytest.approx(u, abs=1e-7)) for u in pair]


class Between(Problem):
    """u = p, valid between two zeros of its one boundary; nothing goes on behind it."""

    monitors = (Monitor("grazing", boundary=True),)

    def __init__(self, p0, wide):
        super().__init__([p0], p0)
        self.wide = wide

    def residual(self, u, p):
        return u - p

    def jacobian(self, u, p):
        return np.eye(1), np.array([-1.0])

    def monitor_values(self, u, p, tangent):
        return np.array([p * (p - self.wide)])

    def switch(self, point, monitor):
        return None


@pytest.mark.parametrize("wide", [0.3, 0.01])
@pytest.mark.parametrize("off", [0.0, 5e-11, -5e-11])
@pytest.mark.parametrize("far_end", [False, True])
def test_a_step_off_a_boundary_ends_on_the_next_one(wide, off, far_end):
    """Both are zeros of the same test: the one at the start is left behind, whatever side of it rounding has put the start."""
    start = wide + off if far_end else off
    branch = trace(Between(start, wide), bounds=(-1.0, 1.0), ds=0.5, direction=-1 if far_end else 1)
    there = 0.0 if far_end else wide
    end = branch.ends[0 if far_end else 1]
    assert end.reason is StopReason.NO_SUCCESSOR and abs(end.p - there) < 1e-12, branch
