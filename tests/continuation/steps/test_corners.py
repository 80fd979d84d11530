"""Corners of equations that are only piecewise smooth: the branch goes on with the tangent that its problem tells."""
import numpy as np
import pytest

from bifurc.continuation import Problem, trace
from bifurc.continuation.steps.arclength import Half, StepOptions


class Angle(Problem):
    """u = slope |p - 1|: at p = 1 the branch turns by more than any step may."""

    told_at_corner = True

    def residual(self, u, p):
        return u - 3.0 * abs(p - 1.0)

    def jacobian(self, u, p):
        return np.eye(1), np.array([-3.0 if p > 1.0 else 3.0])

    def beyond_corner(self, row):
        if not self.told_at_corner:
            return None
        way = 1.0 if row.tangent[-1] > 0.0 else -1.0
        behind = np.array([3.0 * way * (1.0 if row.p + way * 1e-6 > 1.0 else -1.0), way])
        return self, behind / np.linalg.norm(behind)


@pytest.mark.parametrize("start", [0.0, 2.0])
def test_a_corner_is_turned_from_both_sides(start):
    branch = trace(Angle(3.0, start, scale_u=1.0, scale_p=1.0), bounds=(0.0, 2.0))
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"] and len(branch.special_points) == 0
    p, u = branch.column("p"), branch.column("u_0")
    assert {p[0], p[-1]} == {0.0, 2.0} and np.abs(u - 3.0 * np.abs(p - 1.0)).max() < 1e-12
    assert u.min() < 1e-4


def test_without_a_tangent_behind_it_the_branch_ends_in_the_corner():
    problem = Angle(3.0, 0.0, scale_u=1.0, scale_p=1.0)
    problem.told_at_corner = False
    branch = trace(problem, bounds=(0.0, 2.0))
    assert "ds_min" in {str(reason) for reason in branch.stop_reason} and branch.column("p").max() == pytest.approx(1.0, abs=1e-6)


def test_a_part_behind_a_corner_begins_like_any_other():
    """The last row before the corner, known to lie on a boundary: the part behind it has a first row of its own, on none."""
    branch = trace(Angle(3.0, 0.0, scale_u=1.0, scale_p=1.0), bounds=(0.0, 0.9), max_steps=4)
    row, options = branch.rows()[-1], StepOptions(0.0, 2.0, 0.05, 1e-9, 0.2, 100)
    half = Half(row, options)
    half.edge, half.steps, half.slope, half.ds = 0.25, 3, row.tangent[-1], 1e-9
    back = np.array([3.0, -1.0]) / np.sqrt(10.0)
    row.part.problem.beyond_corner = lambda row: (row.part.problem, back)
    assert half.turned(row) and half.edge is None and half.ds == options.ds
    first = half.rows[-1]
    assert half.parts[-1] is first.part is not row.part and first.part.index == row.part.index + 1
    assert first.tangent @ back > 0.99 and 0.0 < first.s - row.s < 1e-2
    (corner,) = half.found  # the parameter turns back in it
    assert str(corner.kind) == "fold" and corner.name == "corner" and corner.x is row.x
    assert not half.turned(first)  # no second one without a step between
