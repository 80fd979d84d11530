"""Products of matrices that take four rows at a time are the plain ones."""
import numpy as np
import pytest

from bifurc.flow.affine.products import multiply, premultiply, product


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7, 8, 13])
def test_products_are_those_of_plain_sums(n):
    rng = np.random.default_rng(n)
    a, wide, b = rng.normal(size=(n, n)), rng.normal(size=(n, n + 3)), rng.normal(size=(n, n))
    made, room = a.copy(), np.empty((n, n))
    multiply(made, b, room)
    np.testing.assert_allclose(made, a @ b, rtol=0.0, atol=1e-14)
    multiply(made, made, room)
    np.testing.assert_allclose(made, a @ b @ a @ b, rtol=0.0, atol=1e-12)
    made = b.copy()
    premultiply(wide, made, room)
    np.testing.assert_allclose(made, wide[:, :n] @ b, rtol=0.0, atol=1e-14)
    x, out = rng.normal(size=n + 3), np.empty(n)
    product(np.stack([wide, 2.0 * wide]), 1, x, out)
    np.testing.assert_allclose(out, 2.0 * wide @ x, rtol=0.0, atol=1e-13)
