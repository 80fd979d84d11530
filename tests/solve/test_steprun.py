"""Where the next point of a branch is foretold, and the blocks of the LU that runs of steps call."""
import numpy as np
import pytest

from bifurc.solve.dense import BLOCKED, lu, lu_solve
from bifurc.solve.steprun import foretold


def on_curve(s, scales):
    """Return a point of a clothoid-like curve in the plane, in its own units, and the unit tangent in scaled ones."""
    turn = 0.8 * s + 0.3 * s**2
    t = np.linspace(0.0, s, 2001)
    angles = 0.8 * t + 0.3 * t**2
    x = np.array([np.trapezoid(np.cos(angles), t), np.trapezoid(np.sin(angles), t)])
    return scales * x, np.array([np.cos(turn), np.sin(turn)])


@pytest.mark.parametrize("ratio", [0.7, 1.0, 2.0])
def test_guess_lies_on_the_curve_to_the_fourth_order_and_in_the_plane(ratio):
    scales, errors = np.array([3.0, 0.2]), []
    for h in (0.1, 0.05):
        before, early = on_curve(0.5 - h, scales)
        last, old = on_curve(0.5, scales)
        predicted, guess = np.empty(2), np.empty(2)
        foretold(before, early, last, old, scales, h, ratio * h, predicted, guess)
        np.testing.assert_allclose(predicted, last + ratio * h * scales * old, rtol=1e-14)
        assert abs((guess - predicted) / scales @ old) <= 1e-14
        near = np.array([on_curve(0.5 + ratio * h * (1.0 + e), scales)[0] for e in np.linspace(0.0, 0.2 * h, 201)])
        errors.append(np.linalg.norm((near - guess) / scales, axis=1).min())
    assert errors[1] < 2e-5 and np.log2(errors[0] / errors[1]) > 3.0


@pytest.mark.parametrize("n", [1, 5, BLOCKED - 1, BLOCKED, BLOCKED + 1, 37, 104])
def test_factors_solve_and_tell_the_determinant(n):
    rng = np.random.default_rng(n)
    A, b = rng.standard_normal((n, n)) * 10.0 ** rng.integers(-6, 6, (n, 1)), rng.standard_normal(n)
    factors, pivot, x = A.copy(), np.empty(n, np.int64), b.copy()
    sign, log = lu(factors, pivot)
    lu_solve(factors, pivot, x)
    assert np.abs((A @ x - b) / (np.abs(A) @ np.abs(x))).max() <= 1e-14
    true = np.linalg.slogdet(A)
    assert sign == true[0] and log == pytest.approx(true[1], abs=1e-9)


def chain(rng, blocks, size):
    """Return rows that know their own and the last block, a full column and a full row: of events one after the other."""
    whole = np.kron(np.eye(blocks) + np.roll(np.eye(blocks), -1, 1), np.ones((size, size)))
    A = np.ones((blocks * size + 1,) * 2)
    A[:-1, :-1] = whole
    return A * rng.standard_normal(A.shape) * 10.0 ** rng.integers(-3, 3, (len(A), 1))


@pytest.mark.parametrize("made", [lambda rng: rng.standard_normal((4, 4)), lambda rng: rng.standard_normal((40, 40)),
                                  lambda rng: chain(rng, 12, 3), lambda rng: chain(rng, 17, 5),
                                  lambda rng: chain(rng, 12, 4) * (rng.random((49, 49)) < 0.9)])
def test_blocks_give_the_same_numbers_as_one_column_at_a_time(made):
    """Elimination by the textbook, in Python: each entry of the factors is the same to the last bit, of full matrices by four
    columns and of those that are mostly zero."""
    A = made(np.random.default_rng(3))
    n = len(A)
    factors, pivot, own = A.copy(), np.empty(n, np.int64), A.copy()
    lu(factors, pivot)
    for k in range(n):
        own[[k, pivot[k]]] = own[[pivot[k], k]]
        own[k + 1:, k] /= own[k, k]
        for i in range(k + 1, n):
            own[i, k + 1:] -= own[i, k] * own[k, k + 1:]
    assert np.array_equal(factors, own)
    singular = A.copy()
    singular[n // 2] = singular[0]
    sign, log = lu(singular, pivot)
    assert sign == 0.0 or log < np.linalg.slogdet(A)[1] - 20.0
