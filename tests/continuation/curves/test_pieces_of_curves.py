"""What is tested along curves of special points, on pencils and maps with known numbers."""
import math

import numpy as np
import pytest

from bifurc.continuation.curves.codimension_two import cosines, cubic_coefficient, double, second
from bifurc.continuation.maps import CycleProblem, MapOrbit, MapOrbitStatus, SmoothMap


class Pencil:
    """J(mu) of two unknowns; the closing columns carry mu."""

    scale = np.array([2.0, 0.5, 1.0])

    def __init__(self, multipliers, pencil=None):
        self.A, self.of, self.poly = np.array([[1.0, 0.7], [0.3, 2.0]]), multipliers, pencil

    def wrapped_jacobian(self, x, mu):
        return self.A - mu * np.array([[0.4, x[0]], [0.0, 0.6]])

    def pencil(self, x):
        return self.poly

    def multipliers_at(self, x):
        return np.array(self.of, complex)


def test_tests_of_a_further_and_of_a_double_multiplier():
    problem, x = Pencil([]), np.array([0.2, 0.0, 0.0])
    for mu in (1.0, -1.0):
        J = problem.wrapped_jacobian(x, mu) * problem.scale[:2]
        sigma = np.linalg.svd(J, compute_uv=False)
        assert second(mu)(problem, x) == pytest.approx(np.linalg.det(J) / sigma[0])
        C = -np.array([[0.4, 0.2], [0.0, 0.6]]) * problem.scale[:2]
        u, _, vt = np.linalg.svd(J)
        sign = np.linalg.det(u) * np.linalg.det(vt)
        assert double(mu)(problem, x) == pytest.approx(sign * u[:, -1] @ C @ vt[-1])


def test_cosines_of_the_pair_nearest_to_the_circle():
    x, theta = np.zeros(3), 2.0 * np.pi / 3.0
    for size in (1.0, 1.1):
        problem = Pencil([0.2, size * np.exp(1j * theta), size * np.exp(-1j * theta)])
        want = size * math.cos(theta)
        np.testing.assert_allclose(cosines(problem, x), [want - 1.0, -1.0 - want, want + 0.5, want], atol=1e-12)
    quadratic = Pencil(None, np.array([1.0, -2.0 * 0.4 * 3.0, 3.0]))  # 3 z^2 - 2.4 z + 1
    np.testing.assert_allclose(cosines(quadratic, x), [0.4 - 1.0, -1.4, 0.9, 0.4], atol=1e-12)
    cubic = np.poly([0.1, np.exp(1j), np.exp(-1j)]).real[::-1]
    assert cosines(Pencil(None, cubic), x)[3] == pytest.approx(math.cos(1.0))


def test_the_cubic_coefficient_of_a_flip_is_zero_where_it_is_generalised():
    """x' = -x + b x^2 + c x^3 doubles to x - 2 (b^2 + c) x^3: the coefficient vanishes at c = -b^2 and has its sign."""
    values = []
    for c in (-0.5, -0.36, 0.2):
        made = SmoothMap(lambda x, a, c=c: -(1.0 + a) * x + 0.6 * x * x + c * x**3, 1, a=0.0)
        cycle = MapOrbit(made, "-", np.array([[0.0]]), MapOrbitStatus.CONVERGED, 0.0)
        problem = CycleProblem(cycle, "a", (-0.5, 0.5))
        values.append(cubic_coefficient(problem, np.array([0.0, 0.0])))
    assert values[1] == pytest.approx(0.0, abs=1e-9)
    assert values[0] / values[2] == pytest.approx((0.36 - 0.5) / (0.36 + 0.2), rel=1e-6)
