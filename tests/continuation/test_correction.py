"""What a correction says of the equations where it ends: the tangent, and the determinant that it borders."""
import numpy as np
import pytest

from bifurc.continuation import Problem


class Coupled(Problem):
    """Three equations without any symmetry, unknowns and parameter of very different sizes."""

    scales = np.array([1e-3, 2.0, 40.0, 0.3])

    def __init__(self):
        super().__init__([1e-3, -1.0, 20.0], 0.2, scale_u=self.scales[:3], scale_p=self.scales[3])

    def residual(self, u, p):
        a, b, c, q = np.append(u, p) / self.scales
        return np.array([a * b + 0.7 * c + q**2 - 0.3, a - 0.4 * b * c + q, b**2 - np.exp(-c) + 0.5 * a * q])

    def jacobian(self, u, p):
        a, b, c, q = np.append(u, p) / self.scales
        wide = np.array([[b, a, 0.7, 2.0 * q], [1.0, -0.4 * c, -0.4 * b, 1.0], [0.5 * q, 2.0 * b, np.exp(-c), 0.5 * a]])
        return wide[:, :3] / self.scales[:3], wide[:, 3] / self.scales[3]


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_a_correction_tells_the_determinant_bordered_by_its_tangent(fixed, seed):
    problem, rng = Coupled(), np.random.default_rng(seed)
    start = problem.correct(problem.x0, np.array([0.0, 0.0, 0.0, 1.0]), True)
    assert start.converged
    tangent = start.tangent + 0.1 * rng.normal(size=4)
    tangent /= np.linalg.norm(tangent)
    c = problem.correct(start.x + 0.01 * problem.scale * rng.normal(size=4), tangent, fixed)
    assert c.converged and np.abs(problem.residual(c.x[:-1], c.x[-1])).max() < 1e-12
    wide = problem.wide_jacobian(c.x) * problem.scale
    np.testing.assert_allclose(wide @ c.tangent, 0.0, atol=1e-12)
    assert np.linalg.norm(c.tangent) == pytest.approx(1.0) and c.tangent @ tangent > 0.0
    sign, log = np.linalg.slogdet(np.vstack((wide, c.tangent)))
    assert c.det_sign == sign and c.det_log == pytest.approx(log, abs=1e-8)
