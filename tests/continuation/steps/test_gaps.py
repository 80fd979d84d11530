"""Boundaries next to which Newton finds nothing, because the equations lose ranks there: solutions go on smoothly through them."""
import math

import numpy as np
import pytest

from bifurc.continuation import Monitor, Problem, StopReason, trace
from bifurc.continuation.kinds import CorrectorStatus
from bifurc.continuation.steps import detect, rows
from bifurc.continuation.steps.rows import Curve, Part, Row

AT = 0.137


class Gap(Problem):
    """u = sin(2 p), valid up to p = `AT`, with a second test that has a corner there; no solution is found within ``gap`` of it,
    and none is known better than ``noise`` over its distance."""

    monitors = (Monitor("grazing", "ends", True), Monitor("grazing", "corner", True))

    def __init__(self, gap, noise=0.0, beyond=math.inf):
        super().__init__(math.sin(-0.6), -0.3)
        self.gap, self.noise, self.beyond = gap, noise, beyond

    def residual(self, u, p):
        return u - math.sin(2.0 * p)

    def jacobian(self, u, p):
        return np.eye(1), np.array([-2.0 * math.cos(2.0 * p)])

    def correct(self, x, tangent, fixed=False):
        c = super().correct(x, tangent, fixed)
        away = abs(c.x[-1] - AT)
        if away <= self.gap or c.x[-1] > AT + self.beyond:
            return self._failed(c.x, tangent, CorrectorStatus.NOT_CONVERGED, 1, 0.0)
        c.left = self.noise / away
        c.x[-1] += c.left * math.sin(1e9 * c.x[-1])
        return c

    def monitor_values(self, u, p, tangent):
        return np.array([math.sinh(p - AT), 30.0 * (p - AT) if p > AT else 0.2 * (p - AT)])


@pytest.mark.parametrize("ds_max", (0.02, 0.1, 0.2))
@pytest.mark.parametrize("gap", (1e-7, 1e-5, 1e-4))
def test_the_boundary_is_where_both_sides_meet(gap, ds_max):
    branch = trace(Gap(gap), bounds=(-0.5, 0.5), ds_max=ds_max)
    (point,) = branch.special_points
    assert abs(point.parameter - AT) <= point.error < 1e-9
    assert point.tangent[-1] == pytest.approx(1.0 / math.hypot(1.0, 2.0 * math.cos(2.0 * AT) * branch.problems[0].scale[-1]
                                                               / branch.problems[0].scale[0]), rel=1e-2)
    assert branch.stop_reason == (StopReason.BOUND, StopReason.NO_SUCCESSOR)


def step(problem):
    """Return the rows at the ends of a step over the boundary, and the problem's part."""
    part, ends = Part(problem, 0), []
    for s, p in ((0.0, AT - 0.05), (0.1, AT + 0.06)):
        slope = np.array([2.0 * math.cos(2.0 * p), 1.0]) / problem.scale
        c = problem.correct(np.array([math.sin(2.0 * p), p]), slope / np.linalg.norm(slope), True)
        ends.append(Row(c, part, s, 0.0, rows.tests_of(c), 0.1))
    ends[1].s = float(np.linalg.norm((ends[1].x - ends[0].x) / problem.scale))
    return part, *ends


@pytest.mark.parametrize("noise", (0.0, 1e-16, 1e-15))
def test_what_is_not_known_next_to_it_is_asked_farther_away(noise):
    problem = Gap(1e-6, noise)
    problem.scale[-1] = 1.0
    part, a, b = step(problem)
    root = detect.beside_gap(part, Curve(a, b), 1, a.tests[1])
    assert abs(root.point.p - AT) <= root.error * (b.s - a.s) + root.p_noise + 1e-16 <= 1e-9
    assert abs(root.point.monitors[1]) <= 1e-9  # from the valid side, where it has no corner


def test_one_side_alone_tells_nothing():
    problem = Gap(1e-4, beyond=2e-4)
    problem.scale[-1] = 1.0
    part, a, b = step(Gap(1e-4))
    curve = Curve(a, b)
    curve.problem = problem
    curve.scale = part.scale = problem.scale
    assert detect.beside_gap(part, curve, 1, a.tests[1]) is None


def test_without_a_gap_there_is_nothing_to_bridge():
    problem = Gap(0.0)
    problem.scale[-1] = 1.0
    part, a, b = step(problem)
    assert detect.beside_gap(part, Curve(a, b), 1, a.tests[1]) is None
