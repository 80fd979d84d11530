"""Damped Newton: quadratic convergence, singular solutions, honest failures."""
import numpy as np
import pytest

from bifurc.solve.newton import NewtonStatus, newton


def test_converges_quadratically():
    sizes = []

    def residual(x):
        sizes.append(abs(x[0] - np.sqrt(2.0)))
        return x * x - 2.0

    result = newton(residual, lambda x: np.diag(2.0 * x), [3.0])
    assert result.success and abs(result.x[0] - np.sqrt(2.0)) < 4e-16
    errors = [e for e in sizes if 1e-7 < e < 0.3]
    assert all(after < 0.5 * before**2 for before, after in zip(errors, errors[1:], strict=False))
    assert "\n" not in repr(result)


def test_damping_reaches_a_far_root():
    result = newton(lambda x: np.arctan(x), lambda x: np.diag(1.0 / (1.0 + x * x)), [20.0])
    assert result.success and abs(result.x[0]) < 1e-15


def test_system_in_bad_units():
    size = np.array([1e-6, 1.0, 1e9])

    def residual(x):
        a, b, c = x / size
        return np.array([a * b - 2.0, b * c - 6.0, a + b + c - 6.0])

    def jacobian(x):
        a, b, c = x / size
        return np.array([[b, a, 0.0], [0.0, c, b], [1.0, 1.0, 1.0]]) / size

    result = newton(residual, jacobian, size * [1.2, 1.7, 3.3], scale=size)
    assert result.success
    assert result.x / size == pytest.approx([1.0, 2.0, 3.0], abs=1e-14)


@pytest.mark.parametrize(("residual", "jacobian", "start", "status"), [
    (lambda x: x * x + 1.0, lambda x: np.diag(2.0 * x), [0.7], (NewtonStatus.STUCK, NewtonStatus.ITERATIONS)),
    (lambda x: x * x + 1.0, lambda x: np.diag(2.0 * x), [0.0], (NewtonStatus.SINGULAR,)),
    (lambda x: np.log(x), lambda x: np.diag(1.0 / x), [-1.0], (NewtonStatus.NOT_FINITE,)),
    (lambda x: x**5 - 1.0, lambda x: np.diag(1e-9 + 0.0 * x), [3.0], (NewtonStatus.STUCK,)),
])
def test_failures_say_why(residual, jacobian, start, status):
    result = newton(residual, jacobian, start)
    assert not result.success and result.status in status
    assert result.status.sentence.endswith(".")


def test_guess_is_kept_and_exact_guess_costs_nothing():
    guess = np.array([2.0])
    result = newton(lambda x: x - 2.0, lambda x: np.eye(1), guess)
    assert result.iterations == 0 and result.x[0] == 2.0
    newton(lambda x: x - 3.0, lambda x: np.eye(1), guess)
    assert guess[0] == 2.0
