"""Curves of special points of algebraic equations: in other units, mirrored and shifted; what a curve reads beside its branch."""
import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import Monitor, Problem, SpecialPointKind, StopReason, trace, trace_curve
from bifurc.continuation.curves import leaving
from bifurc.continuation.curves.problem import BOUND, CurveProblem, zero_with
from bifurc.continuation.curves.tracing import TOGETHER, renamed
from bifurc.continuation.families import family_of
from bifurc.continuation.kinds import CorrectorStatus

K = SpecialPointKind


class Snap(Problem):
    """u^3 - b u - a: folds where 27 a^2 = 4 b^3, u^2 = b / 3."""

    parameter = "a"

    def __init__(self, u=-1.5, b=1.0, size=1.0):
        super().__init__(u, u**3 - b * u, scale_u=size, scale_p=1.0)
        self.b = b

    def residual(self, u, a):
        return u**3 - self.b * u - a

    def jacobian(self, u, a):
        return np.array([[3.0 * float(u[0])**2 - self.b]]), np.array([-1.0])


class Arc(Problem):
    """u = a + b with the monitor u^2 + a^2 - 1: zero on an ellipse of (a, b)."""

    parameter = "a"
    monitors = (Monitor(K.USER, "touch"),)

    def __init__(self):
        super().__init__(0.1, -0.9, scale_u=1.0, scale_p=1.0)
        self.b = 1.0

    def residual(self, u, a):
        return u - a - self.b

    def jacobian(self, u, a):
        return np.eye(1), np.array([-1.0])

    def monitor_values(self, u, a, tangent):
        return np.array([float(u[0])**2 + a * a - 1.0])


class Fork(Problem):
    """u^3 - (a - b^2) u: branch points at a = b^2."""

    parameter = "a"

    def __init__(self):
        super().__init__(0.0, -1.0, scale_u=1.0, scale_p=1.0)
        self.b = 0.5

    def residual(self, u, a):
        return u**3 - (a - self.b**2) * u

    def jacobian(self, u, a):
        return np.array([[3.0 * float(u[0])**2 - a + self.b**2]]), -u


class Image(Problem):
    """The equations of ``inner`` for u' = scale u, a' = first (a, c -> c[0] a + c[1]) and b' = second, in sizes that go with it."""

    parameter = "a"

    def __init__(self, inner, scale=1.0, first=(1.0, 0.0), second=(1.0, 0.0)):
        self.inner, self.k, self.first, self.second = inner, scale, first, second
        self.size, self.scale = inner.size, inner.scale * np.append(np.full(inner.size, scale), abs(first[0]))
        self.x0 = np.append(scale * inner.x0[:-1], first[0] * inner.x0[-1] + first[1])
        self.monitors, self.b = inner.monitors, second[0] * inner.b + second[1]

    def own(self, u, a):
        self.inner.b = (self.b - self.second[1]) / self.second[0]
        return u / self.k, (a - self.first[1]) / self.first[0]

    def residual(self, u, a):
        return self.inner.residual(*self.own(u, a))

    def jacobian(self, u, a):
        fu, fa = self.inner.jacobian(*self.own(u, a))
        return fu / self.k, fa / self.first[0]

    def monitor_values(self, u, a, tangent):
        return self.inner.monitor_values(*self.own(u, a), tangent)


CURVES = {"fold": (Snap, "fold", (-3.0, 3.0), (-2.0, 3.0), (-2.0, 2.0)),
          "zero": (Arc, "user", (-2.0, 2.0), (-1.6, 1.3), (-3.0, 3.0)),
          "branch point": (Fork, "branch_point", (-2.0, 2.0), (-1.0, 2.0), (-3.0, 3.0)),
          "cut in a": (Snap, "fold", (-3.0, 3.0), (-2.0, 3.0), (-0.5, 0.8))}


def along(values, numbers):
    return tuple(sorted(numbers[0] * value + numbers[1] for value in values))


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("scale, first, second", [(1.0, (-1.0, 0.0), (-1.0, 0.0)), (1.0, (1.0, 4.0), (1.0, -3.0)),
                                                  (256.0, (1.0, 0.0), (1.0, 0.0)), (1.0, (64.0, 0.0), (1.0 / 64.0, 0.0))],
                         ids=["mirrored", "shifted", "unknown", "parameters"])
def test_an_image_of_a_curve_has_the_same_points(name, scale, first, second):
    make, kind, bounds, of_b, of_a = CURVES[name]
    made = []
    for problem, one, two in ((make(), (1.0, 0.0), (1.0, 0.0)), (Image(make(), scale, first, second), first, second)):
        branch = trace(problem, bounds=along(bounds, one))
        points = sorted(branch.special_points.of(kind), key=lambda point: (point.parameter - one[1]) / one[0])
        made.append(trace_curve(points[0], ("a", "b"), bounds={"a": along(of_a, one), "b": along(of_b, two)}, ds_max=0.5))
    curve, image = made
    rows = np.column_stack([curve.column(c) for c in ("a", "b", "u_0")])
    own = np.column_stack([(image.column("a") - first[1]) / first[0], (image.column("b") - second[1]) / second[0],
                           image.column("u_0") / scale])
    way = slice(None) if np.abs(own[0] - rows[0]).max() < 1e-6 else slice(None, None, -1)
    if curve.closed:  # it begins the other way round
        assert image.closed and np.abs(own[:, 2]**2 + own[:, 0]**2 - 1.0).max() < 1e-9
    else:
        np.testing.assert_allclose(own[way], rows, atol=1e-6)
        assert [end.reason for end in image.ends][way] == [end.reason for end in curve.ends]
    points = list(image.special_points)
    assert sorted((p.kind, p.name) for p in points) == sorted((p.kind, p.name) for p in curve.special_points)
    for point in curve.special_points:
        a, b = point.parameters["a"], point.parameters["b"]
        assert min(abs((p.parameters["a"] - first[1]) / first[0] - a) + abs((p.parameters["b"] - second[1]) / second[0] - b)
                   for p in points if p.kind is point.kind) < 1e-6


# what a curve reads at the second parameter

class Hill(Problem):
    """u = b - (a - b)^2 in units of its own, measured by b u: greatest over a at a = b."""

    parameter, measure_names = "a", ("m",)

    def __init__(self):
        super().__init__(1.0, 0.0, scale_u=4.0, scale_p=0.5)
        self.b = 1.0

    def residual(self, u, a):
        return u - self.b + (a - self.b)**2

    def measure(self, name, xs):
        return self.b * xs[:, 0]

    def solution(self, x):
        return self.b, x


def hill(bounds_a=(-2.0, 4.0), interval=(0.25, 3.0)):
    return CurveProblem(family_of(Hill(), "b", interval), K.PEAK, "m", bounds_a, np.array([1.0, 1.0, 1.0]))


def test_the_slope_of_a_measure_along_a_curve_is_that_of_both_parameters(rng):
    """d(b u) = b du + u db along any direction in scaled unknowns."""
    curve = hill()
    for b in (0.5, 2.0):
        for _ in range(3):
            tangent = rng.normal(size=3)
            du, _, db = tangent * curve.scale
            values = curve.monitor_values(np.array([b, b]), b, tangent)
            assert values[0] == tangent[1] and values[1] == pytest.approx(b * du + b * db, rel=1e-6)
            assert curve._measure_slope(curve.family.at(b), np.array([0.7, 1.0]), b, tangent) == pytest.approx(b * du + 0.7 * db,
                                                                                                               rel=1e-6)


def test_values_and_solutions_are_those_at_the_second_parameter():
    curve = hill()
    xs = np.array([[1.0, 0.5, 2.0], [3.0, 0.75, 0.5]])
    np.testing.assert_array_equal(curve.measure("m", xs), [2.0, 1.5])
    np.testing.assert_array_equal(curve.measure("a", xs), [0.5, 0.75])
    assert curve.parameters(xs[0]) == {"a": 0.5, "b": 2.0} and curve.measure_names == ("a", "m")
    b, x = curve.solution(xs[0])
    assert b == 2.0 and x.tolist() == [1.0, 0.5]


def test_walls_of_the_first_parameter_are_negative_inside():
    for bounds, count in (((-2.0, 4.0), 2), ((-2.0, math.inf), 1), ((-math.inf, 4.0), 1)):
        curve = hill(bounds)
        names = [k for k, monitor in enumerate(curve.monitors) if monitor.name == BOUND and monitor.boundary]
        assert len(names) == count
        for a, outside in ((-2.5, -2.0), (0.0, None), (3.9, None), (4.5, 4.0)):
            walls = curve.monitor_values(np.array([1.0, a]), 1.0, np.ones(3))[names]
            assert bool(walls.max() > 0.0) is (outside is not None and outside in bounds)
    walls = hill((-2.0, 4.0)).monitor_values(np.array([1.0, 1.0]), 1.0, np.ones(3))[-2:]
    np.testing.assert_allclose(walls, [-0.5, -0.5])  # in parts of the width


def test_a_curve_that_is_read_has_its_own_bounds_and_sizes():
    for bounds_a, interval in (((-2.0, 4.0), (0.25, 3.0)), ((-math.inf, 4.0), (0.25, 3.0)), ((-2.0, math.inf), (0.25, math.inf))):
        curve = hill(bounds_a, interval)
        curve.family.scale = curve.scale = np.array([7.0, 5.0, 3.0])
        read = CurveProblem.from_record(curve.to_record(), Hill())
        assert read.bounds_a == bounds_a and read.family.interval == interval and read.scale.tolist() == [7.0, 5.0, 3.0]
        assert (read.kind, read.name, read.x0.tolist()) == (K.PEAK, "m", [1.0, 1.0, 1.0])


def test_ends_of_curves_are_named():
    curve = hill()
    point = SimpleNamespace(x=curve.x0, tangent=np.ones(3), p=1.0)
    assert curve.switch(point, SimpleNamespace(name=BOUND, kind=K.USER)) is StopReason.BOUND
    assert "codimension two" in curve.switch(point, SimpleNamespace(name="", kind=K.GRAZING))
    curve.kind = K.NEIMARK_SACKER
    assert "becomes real" in curve.switch(point, SimpleNamespace(name="", kind=K.RESONANCE_1_2))
    curve._beyond, curve._close = lambda x: "a grazing", lambda x: 0
    assert curve.named_end(curve.x0, StopReason.BOUND, "here") == (StopReason.BOUND, "here")
    reason, message = curve.named_end(curve.x0, StopReason.DS_MIN, "")
    assert reason is StopReason.NO_SUCCESSOR and "meets a grazing" in message
    curve._beyond = lambda x: None
    assert curve.named_end(curve.x0 + 1.0, StopReason.DS_MIN, "so") == (StopReason.DS_MIN, "so")
    curve._close = lambda x: int(x[0])  # more pairs of instants together than at the start
    assert "another change" in curve.named_end(curve.x0 + 1.0, StopReason.DS_MIN, "")[1]
    assert curve.named_end(curve.x0 - 1.0, StopReason.DS_MIN, "so") == (StopReason.DS_MIN, "so")


@pytest.mark.parametrize("instants, pairs", [((0.1, 0.5, 0.9), 0), ((0.1, 0.101, 0.9), 1), ((0.9995, 0.0005, 0.5), 1),
                                             ((0.1, 0.101, 0.102), 2), ((), 0), ((0.3,), 0)])
def test_pairs_of_instants_are_counted_round_the_period(instants, pairs):
    curve = hill()
    curve.condition = SimpleNamespace(instants=lambda problem, x: np.array(instants))
    assert curve._close(curve.x0) == pairs


def test_points_aside_lie_on_the_side_that_is_asked_for_and_within_the_interval():
    curve = hill(interval=(0.25, 3.0))
    point = SimpleNamespace(x=np.array([1.0, 1.0, 1.0]))
    for sign in (1.0, -1.0):
        (first, c), (second, d) = curve.aside(point, sign, (0.1, 0.2))
        assert (first, second) == (0.1, 0.2)
        for distance, made in ((first, c), (second, d)):
            b = 1.0 + sign * distance * curve.scale[-1]
            np.testing.assert_allclose(made.x, [b, b, b], atol=1e-9)
    assert [distance for distance, _ in curve.aside(point, -1.0, (0.1, 0.8))] == [0.1]  # below the interval
    assert [distance for distance, _ in curve.aside(point, 1.0, (0.1, 1.8))] == [0.1]


def test_a_correction_in_noise_leaves_no_noise_behind_and_tells_the_condition_what_it_reached(monkeypatch):
    curve, floors, reached = hill(), [], []
    curve.condition = SimpleNamespace(reached=lambda family, x: reached.append(x))
    status = {False: CorrectorStatus.NOT_CONVERGED, True: CorrectorStatus.CONVERGED}

    def correct(self, x, tangent, fixed=False):
        floors.append(self._noisy)
        return SimpleNamespace(converged=self._noisy, status=status[self._noisy], x=x)
    monkeypatch.setattr(Problem, "correct", correct)
    for _ in range(2):
        assert curve.correct("here", None).converged
    assert floors == [False, True] * 2 and reached == ["here", "here"]
    status[False] = CorrectorStatus.NOT_FINITE  # noise is no reason for that
    assert not curve.correct("here", None).converged and floors[-1] is False and len(reached) == 2


def test_a_monitor_that_is_not_zero_here_is_not_zero_with_another():
    problem = SimpleNamespace(monitors=(Monitor(K.GRAZING, "one"), Monitor(K.GRAZING, "two")),
                              monitor_values=lambda u, p, tangent: np.array([1e-3, 1e-12]))
    assert zero_with(problem, np.zeros(3), "two") == 1
    assert zero_with(problem, np.zeros(3), "one") is None and zero_with(problem, np.zeros(3), "three") is None


def test_monitors_that_are_zero_all_along_a_curve_end_it_nowhere():
    class Watched(Arc):
        monitors = tuple(Monitor(kind, name, boundary=True) for kind, name in (
            (K.GRAZING, "followed"), (K.GRAZING, "same kind"), (K.SLIP_ONSET, "zero with it"), (K.SLIP_ONSET, "other")))

        def monitor_values(self, u, a, tangent):
            return np.array([0.0, -1.0, 1e-9, -0.5])
    curve = CurveProblem(family_of(Watched(), "b", (0.0, 2.0)), K.GRAZING, "followed", (-math.inf, math.inf),
                         np.array([0.1, -0.9, 1.0]))
    assert [monitor.name for monitor in curve.monitors if monitor.boundary] == ["other"]


# points in the words of a curve

@dataclass(frozen=True)
class Named:
    kind: K
    name: str
    tangent: np.ndarray
    s: float


def test_where_one_parameter_turns_is_an_extremum_and_where_both_do_a_cusp():
    still, turns = np.array([1.0, 1e-8, 1e-9]), np.array([0.8, 0.6, 0.0])
    points = [Named(K.FOLD, "", turns, 0.0), Named(K.FOLD, "", still, 1.0), Named(K.EXTREMUM, "a", still, 1.0 + 0.5 * TOGETHER),
              Named(K.EXTREMUM, "a", turns[[0, 2, 1]], 1.0), Named(K.FOLD, "", still, 1.0 + 3.0 * TOGETHER),
              Named(K.USER, BOUND, turns, 2.0), Named(K.FOLD_FLIP, "", turns, 3.0)]
    found = [(point.kind, point.name, point.s) for point in renamed("b", points)]
    assert found == [(K.EXTREMUM, "b", 0.0), (K.CUSP, "", 1.0), (K.EXTREMUM, "a", 1.0), (K.CUSP, "", 1.0 + 3.0 * TOGETHER),
                     (K.FOLD_FLIP, "", 3.0)]


# curves that leave

def test_what_leaves_a_point_of_the_same_orbit_is_the_other_of_the_two_that_meet():
    for (here, at), there in leaving.SAME_ORBIT.items():
        assert here is not there
        assert at in (K.FOLD_FLIP, K.RESONANCE_1_1, K.RESONANCE_1_2) and leaving.SAME_ORBIT[(there, at)] is here
    meeting = {K.FOLD_FLIP: {K.FOLD, K.PERIOD_DOUBLING}, K.RESONANCE_1_1: {K.FOLD, K.NEIMARK_SACKER},
               K.RESONANCE_1_2: {K.PERIOD_DOUBLING, K.NEIMARK_SACKER}}
    assert all({here, there} == meeting[at] for (here, at), there in leaving.SAME_ORBIT.items())


@pytest.mark.parametrize("E, h, B, periods, good", [
    (np.diag([0.5, 0.1]), (1.0, 1.0), (1.0, 1.0), 3, True), (np.diag([0.5, -0.6]), (1.0, 3.0), (1.0, 1.0), 3, False),
    (np.array([[0.2, 0.9], [-0.9, 0.2]]), (1.0, 0.0), (1.0, 0.5), 2, True),
    (np.diag([-0.5, 0.1]), (1.0, 0.0), (1.0, 0.0), 2, False),
    (np.diag([-0.5, 0.1]), (1.0, 0.0), (1.0, 0.0), 1, True)])
def test_an_orbit_with_one_impact_in_some_periods_stays_below_the_stop_in_between(E, h, B, periods, good):
    """Summed up as the impacts of all former periods: the sum over m of h E^(k + m n) B is positive in every period k between."""
    sums = [sum(np.array(h) @ np.linalg.matrix_power(E, k + m * periods) @ np.array(B) for m in range(200))
            for k in range(1, periods)]
    assert all(value > 0.0 for value in sums) is good
    condition = SimpleNamespace(top=lambda problem, x: (0.0, 0.25), linear_map=lambda problem, x, tau: (tau, None, (
        E, np.array(h), np.array(B))))
    curve = SimpleNamespace(condition=condition, family=SimpleNamespace(alone=lambda b: None))
    assert leaving.passes(curve, SimpleNamespace(x=np.zeros(3)), periods) is good
