"""The compiled LU against numpy, on rows and columns of very different sizes."""
import numpy as np
import pytest

from bifurc.solve.dense import lu, lu_solve, lu_solve_wide


@pytest.mark.parametrize("n", (1, 2, 3, 5, 9, 31))
def test_solution_and_determinant(rng, n):
    for _ in range(10):
        rows, columns = 10.0**rng.uniform(-8.0, 8.0, n), 10.0**rng.uniform(-3.0, 3.0, n)
        plain = rng.normal(size=(n, n))
        x = rng.normal(size=n)
        a, pivot, b = plain * np.outer(rows, columns), np.empty(n, np.int64), rows * (plain @ x)
        whole, right = a.copy(), b.copy()
        sign, log = lu(a, pivot)
        expected = np.linalg.slogdet(plain)
        assert sign == expected[0]
        assert log == pytest.approx(expected[1] + np.log(rows).sum() + np.log(columns).sum(), abs=1e-9)
        wide = b.copy()
        lu_solve(a, pivot, b)
        lu_solve_wide(a, pivot, wide)
        assert b * columns == pytest.approx(x, abs=1e-12 * np.linalg.cond(plain))
        assert wide * columns == pytest.approx(x, abs=1e-12 * np.linalg.cond(plain))
        assert np.abs(whole @ b - right).max() <= 1e-12 * (np.abs(whole) @ np.abs(b) + np.abs(right)).max()


def test_a_small_row_is_not_passed_over_for_a_large_one():
    """Rows in units of their own: the pivot is the largest entry of its row, not of its column."""
    a, pivot = np.array([[1e9, 2e15], [1.0, 1.0]]), np.empty(2, np.int64)
    lu(a, pivot)
    assert pivot[0] == 1 and a[0].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("a", ([[1.0, 2.0], [2.0, 4.0]], [[0.0, 0.0], [1.0, 1.0]], [[np.inf, 1.0], [1.0, 1.0]],
                              [[np.nan, 1.0], [1.0, 1.0]], [[1.0, 1.0], [1.0, np.nan]]), ids=str)
def test_singular_and_not_finite_have_no_sign(a):
    assert lu(np.array(a), np.empty(2, np.int64)) == (0.0, -np.inf)
