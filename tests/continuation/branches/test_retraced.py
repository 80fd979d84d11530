"""Rows that lie on an earlier stretch of their branch, of curves in closed form that a problem sends back or round again."""
import copy
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Monitor, Problem
from bifurc.continuation.branches.branch import Branch
from tests.continuation.problems import Scalar, circle, close_pair, hysteresis, near_miss, parabola


class Sent(Scalar):
    """A curve f(u, p) = 0 with an edge behind which it goes on as another problem: onwards (way 1), or back where it came from."""

    def __init__(self, f, df, u0, p0, edge, way, **scales):
        self.edge, self.way = edge, way
        super().__init__(f, df, u0, p0, **scales)
        self.monitors = (Monitor("user", "edge", boundary=True),)

    def monitor_values(self, u, p, tangent):
        return np.array([self.edge(float(u[0]), p)])

    def switch(self, point, monitor):
        other = copy.copy(self)
        other.monitors, other.monitor_values = (), lambda u, p, tangent: np.empty(0)
        return other, point.x, self.way * point.tangent


CURVES = {
    "line": (lambda u, p: u - 2.0 * p, lambda u, p: (1.0, -2.0), -2.0, -1.0, lambda u, p: p - 0.5),
    "sine": (lambda u, p: u - math.sin(4.0 * p), lambda u, p: (1.0, -4.0 * math.cos(4.0 * p)), math.sin(-4.0), -1.0,
             lambda u, p: p - 0.6),
    "behind a fold": (lambda u, p: p + u * u, lambda u, p: (2.0 * u, 1.0), -1.0, -1.0, lambda u, p: u - 0.7),
    "cubic": (lambda u, p: u**3 - u - p, lambda u, p: (3.0 * u * u - 1.0, -1.0), -1.3247179572447460, -1.0,
              lambda u, p: u - 0.9),
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("ds_max", [0.02, 0.2])
def test_a_curve_that_runs_back_is_not_ok(name, ds_max, tmp_path):
    f, df, u0, p0, edge = CURVES[name]
    problem = Sent(f, df, u0, p0, edge, -1.0)
    branch = bf.trace(problem, bounds=(-1.0, 1.0), ds_max=ds_max)
    s, end = branch.column("s"), max(point.s for point in branch.special_points if point.kind == "user")
    back = s > end + 1e-4  # all of these lie where the way there was: the curve is one and the same
    assert back.sum() >= 3 and not branch.audit.ok
    assert {at for at, _ in branch.audit.retraced} == set(s[back].tolist())
    for at, before in branch.audit.retraced:  # as far behind the edge as before it
        assert before == pytest.approx(2.0 * end - at, abs=2e-3)
    assert "rows on an earlier stretch" in repr(branch.audit)
    branch.save(tmp_path / "back.npz")
    for loaded in (Branch.load(tmp_path / "back.npz"), Branch.load(tmp_path / "back.npz", problem=problem)):
        assert len(loaded.audit.retraced) == len(branch.audit.retraced)


@pytest.mark.parametrize("name", CURVES)
def test_the_same_curve_sent_onwards_is_ok(name):
    f, df, u0, p0, edge = CURVES[name]
    branch = bf.trace(Sent(f, df, u0, p0, edge, 1.0), bounds=(-1.0, 1.0), ds_max=0.05)
    assert branch.audit.ok and branch.audit.retraced == ()


@pytest.mark.parametrize("radius", [0.3, 1.0])
def test_a_circle_walked_more_than_once_is_not_ok(radius):
    """Behind the edge the problem is another one, which does not know that it closes."""
    problem = Sent(lambda u, p: u * u + p * p - radius**2, lambda u, p: (2 * u, 2 * p), radius, 0.0, lambda u, p: p - 0.5 * radius,
                   1.0, scale_p=1.0)
    branch = bf.trace(problem, bounds=(-2.0, 2.0), direction=1, max_steps=120, ds_max=0.1)
    s = branch.column("s")
    again = s > 2.0 * math.pi * radius + 1e-3
    assert again.sum() > 20 and [at for at, _ in branch.audit.retraced] == s[again].tolist() and not branch.audit.ok
    turns = np.array([(at - before) / (2.0 * math.pi * radius) for at, before in branch.audit.retraced])
    assert np.abs(turns - np.round(turns)).max() < 1e-2 and turns.min() > 0.9


@pytest.mark.parametrize("made", [
    lambda: circle(), lambda: circle(radius=0.1, scale_p=1.0), lambda: hysteresis(), lambda: parabola(u0=-1.0, p0=-1.0, delta=1e-3),
    lambda: parabola(u0=-1.0, p0=-1.0, delta=1e3), lambda: near_miss(1e-8), lambda: close_pair(1e-3)])
def test_curves_that_come_near_themselves_do_not_repeat(made):
    branch = bf.trace(made(), bounds=(-1.01, 1.01))
    assert branch.audit.retraced == () and branch.audit.ok


@pytest.mark.parametrize("apart", [1e-2, 1e-3, 1e-4])
def test_windings_of_a_spiral_are_told_apart(apart):
    """The angle itself is an unknown in units so large that neighbouring windings differ by ``apart`` alone."""
    t0 = 2.0 * math.pi / apart

    class Spiral(Problem):
        def residual(self, u, p):
            t = float(u[0]) * t0
            return np.array([u[1] - math.cos(t), p - math.sin(t)])

        def jacobian(self, u, p):
            t = float(u[0]) * t0
            return np.array([[t0 * math.sin(t), 1.0], [-t0 * math.cos(t), 0.0]]), np.array([0.0, 1.0])
    problem = Spiral([0.0, 1.0], 0.0, scale_u=[1.0, 1.0], scale_p=1.0)
    branch = bf.trace(problem, bounds=(-2.0, 2.0), direction=1, max_steps=200)
    assert branch.column("s")[-1] > 12.0  # at least two windings
    assert branch.audit.retraced == ()
