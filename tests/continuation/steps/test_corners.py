"""Corners of equations that are only piecewise smooth: the branch goes on with the tangent that its problem tells."""
import numpy as np
import pytest

from bifurc.continuation import Problem, trace


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
