"""Columns of the derivative in scaled unknowns are differences along steps of the natural sizes."""
import numpy as np
import pytest

from bifurc.continuation.problem import Problem
from bifurc.continuation.steps.branchpoint import wide


class Two(Problem):
    """Two equations whose unknowns and parameter have sizes of their own."""

    def residual(self, u, p):
        return np.array([u[0] * u[1] - p, u[0]**2 + 3.0 * p * u[1]])

    def jacobian(self, u, p):
        return np.array([[u[1], u[0]], [2.0 * u[0], 3.0 * p]]), np.array([-1.0, 3.0 * u[1]])


@pytest.mark.parametrize("sizes", [(1.0, 1.0), (1e-3, 50.0), (20.0, 1e-4)])
def test_a_column_is_what_a_step_of_natural_size_does(sizes):
    problem = Two([0.4, -1.3], 0.7, scale_u=sizes[0], scale_p=sizes[1])
    x, found = problem.x0, wide(problem, problem.x0)
    assert found.shape == (2, 3)
    for k in range(3):
        h = 1e-5 / problem.scale[k]
        ends = [problem.residual(y[:2], y[2]) for y in (x + sign * h * problem.scale[k] * np.eye(3)[k] for sign in (1.0, -1.0))]
        np.testing.assert_allclose(found[:, k], (ends[0] - ends[1]) / (2.0 * h), rtol=1e-8, atol=1e-9 * problem.scale[k])
