"""Small kernels of linear algebra and of zeros against numpy."""
import numpy as np
import pytest

from bifurc.solve import bordered, dense, zeros
from tests.reference.plain import plain


@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_vector_orthogonal_to_the_rows_of_a_wide_matrix(n, rng):
    wide = rng.normal(size=(n, n + 1))
    reflections, factors, last = bordered.reflected(wide.copy())
    assert np.abs(wide @ last).max() < 1e-13 and np.linalg.norm(last) == pytest.approx(1.0)
    assert reflections.shape == (n + 1, n) and factors.shape == (n,)
    assert np.abs(np.diag(reflections)) == pytest.approx(np.abs(np.diag(np.linalg.qr(wide.T)[1])))


@pytest.mark.parametrize("n", range(10))
def test_inner_products_of_any_length(n):
    a, b = 3.0 ** np.arange(n), 2.0 + np.arange(n) ** 2
    assert plain(dense.inner)(a, b) == sum(3**j * (2 + j * j) for j in range(n))


def test_rows_in_the_order_of_pivots():
    b = np.array([10.0, 11.0, 12.0, 13.0])
    plain(dense.exchanged)(np.array([2, 3, 2, 3]), b)
    assert b.tolist() == [12.0, 13.0, 10.0, 11.0]
    plain(dense.exchanged)(np.array([1, 2, 3, 3]), b)
    assert b.tolist() == [13.0, 10.0, 11.0, 12.0]


@pytest.mark.parametrize("n, width", [(1, 4), (3, 4), (4, 4), (9, 4), (9, 9)])
def test_factors_of_a_matrix_by_columns(n, width, rng):
    """Products of the factors are the rows in their order; the determinant is that of numpy; rows are scaled to be compared."""
    a, pivot, scale = rng.normal(size=(n, n)), np.zeros(n, np.int64), rng.uniform(0.1, 9.0, n)
    lu, first = a.copy(), int(np.argmax(np.abs(a[:, 0]) * scale))
    sign, log = plain(dense.factored)(lu, pivot, scale.copy(), width)
    order = np.arange(n)
    for k, row in enumerate(pivot):
        order[[k, row]] = order[[row, k]]
    assert order[0] == first
    assert (np.tril(lu, -1) + np.eye(n)) @ np.triu(lu) == pytest.approx(a[order], abs=1e-12)
    assert (sign, log) == pytest.approx(np.linalg.slogdet(a), abs=1e-12)
    a[:, -1] = 0.0
    assert plain(dense.factored)(a, pivot, scale, width) == (0.0, -np.inf)


def test_distance_from_the_best_straight_line(rng):
    places, values = rng.normal(size=6), rng.normal(size=6)
    fit = np.polyval(np.polyfit(places, values, 1), places)
    assert plain(zeros.off_line)(tuple(places), tuple(values)) == pytest.approx(np.abs(values - fit).max(), rel=1e-12)
    assert plain(zeros.off_line)((1.0, 2.0, 4.0), (3.0, 5.0, 9.0)) < 1e-15
