"""Branch points located from beside them: place and both directions of curves that cross at any angle, in closed form."""
import numpy as np
import pytest

from bifurc.continuation import Problem
from bifurc.continuation.steps.branchpoint import locate_crossing


class Crossing(Problem):
    """(c . z)(d . z) + a^3 = miss and b - e . z + a p = 0 with z = (a, p) - z0: two curves through a = a0, p = p0 along c . z = 0
    and d . z = 0, which miss each other on one or the other side."""

    def __init__(self, c, d, e, a0, p0, scale, miss=0.0):
        super().__init__([a0, 0.0], p0, scale_u=scale[:2], scale_p=scale[2])
        self.c, self.d, self.e, self.at = c, d, e, (a0, p0)
        self.miss = miss

    def residual(self, u, p):
        z = np.array([u[0] - self.at[0], p - self.at[1]])
        return np.array([(self.c @ z) * (self.d @ z) + z[0]**3 - self.miss, u[1] - self.e @ z + z[0] * z[1]])

    def jacobian(self, u, p):
        z = np.array([u[0] - self.at[0], p - self.at[1]])
        first = self.c * (self.d @ z) + self.d * (self.c @ z) + [3.0 * z[0]**2, 0.0]
        second = -self.e + z[::-1]
        return np.array([[first[0], 0.0], [second[0], 1.0]]), np.array([first[1], second[1]])


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 0.5, 3.0)])
def test_both_directions_of_curves_that_cross_at_any_angle(scale, rng):
    scale = np.array(scale)
    for _ in range(20):
        first, second = rng.uniform(0.0, np.pi, 2)
        if min((first - second) % np.pi, (second - first) % np.pi) < 0.2:
            continue
        c, d = (np.array([np.cos(angle), np.sin(angle)]) * size for angle, size in ((first, 1.3), (second, 0.7)))
        e, (a0, p0) = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0, 2)
        problem = Crossing(c, d, e, a0, p0, scale)
        found = locate_crossing(problem, np.array([a0, 0.0, p0]) + 1e-3 * rng.uniform(-1.0, 1.0, 3) * scale)
        assert found.status == "located"
        np.testing.assert_allclose(found.x, [a0, 0.0, p0], atol=1e-10)
        wanted = []
        for normal in (c, d):
            z = np.array([normal[1], -normal[0]])
            way = np.array([z[0], e @ z, z[1]]) / scale
            wanted.append(way / np.linalg.norm(way))
        cosines = np.abs(found.directions @ np.transpose(wanted))
        np.testing.assert_allclose(np.sort(cosines, axis=1)[:, 1], 1.0, atol=1e-10)
        assert set(cosines.argmax(axis=1)) == {0, 1}


@pytest.mark.parametrize("size", [1e-4, 1e-7])
def test_curves_that_miss_each_other_do_not_cross_on_whichever_side_they_pass(size):
    """Two perturbations of one crossing, of either sign; from either side of it."""
    c, d, e = np.array([1.3, 0.4]), np.array([-0.2, 0.7]), np.array([0.5, -0.3])
    for miss in (size, -size):
        problem = Crossing(c, d, e, 0.2, -0.4, np.ones(3), miss)
        for side in (1e-3, -1e-3):
            assert locate_crossing(problem, np.array([0.2, 0.0, -0.4]) + side).status == "near_miss"
