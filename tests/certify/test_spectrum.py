"""How many zeros of a characteristic polynomial lie inside the unit circle, in balls."""
import numpy as np
import pytest

from bifurc.certify import spectrum

flint = pytest.importorskip("flint")


def balls(zeros, radius):
    """Return the ascending coefficients of the polynomial with some zeros, with balls round them."""
    return [flint.arb(float(c.real), radius) for c in np.poly(zeros)[::-1]]


@pytest.mark.parametrize("others", [[0.5], [-0.5], [0.5, -0.3], [0.2, 0.4, -0.6], []])
def test_a_pair_on_the_circle_is_undecided_and_a_zero_beyond_it_is_not(others):
    """Of any degree, and on either side."""
    on = [np.exp(0.7j), np.exp(-0.7j)]
    assert spectrum.stable(balls([*on, *others], 1e-10)) is None
    for beyond in (1.5, -1.5):
        assert spectrum.stable(balls([*on, beyond, *others], 1e-10)) is False
        assert spectrum.stable(balls([beyond, *others], 1e-10)) is False
    assert spectrum.stable(balls([0.9 * on[0], 0.9 * on[1], *others], 1e-10)) is True


def counted(zeros):
    return int((np.abs(zeros) < 1.0).sum())


def test_zeros_inside_the_circle_are_counted(rng):
    """Real ones and pairs, at zero, inside and outside, of degrees up to seven."""
    for _ in range(60):
        pairs, reals = rng.integers(0, 3), rng.integers(1, 4)
        z = rng.uniform(0.2, 1.8, pairs) * np.exp(1j * rng.uniform(0.2, 3.0, pairs))
        zeros = np.concatenate([z, z.conj(), rng.uniform(-1.8, 1.8, reals), np.zeros(rng.integers(0, 2))])
        if (np.abs(np.abs(zeros) - 1.0) < 0.02).any():
            continue
        coefficients = balls(zeros, 0.0)
        assert spectrum.inside_count(coefficients) == counted(zeros)
        assert spectrum.stable(coefficients) is (counted(zeros) == len(zeros))
    assert spectrum.inside_count(balls([0.0, 0.0, 0.5, 3.0], 0.0)) == 3
    assert spectrum.inside_count([flint.arb(1)]) == 0
    assert spectrum.inside_count(balls([1.0], 0.0)) is None and spectrum.inside_count(balls([0.5], 0.6)) is None


def test_one_real_zero_beyond_the_circle_is_told_without_a_count():
    """Where one other zero lies on the circle, by the sign of the polynomial at 1 and -1."""
    for degree, zeros in ((2, [1.0, 1.5]), (2, [-1.0, -1.5]), (2, [1.0, -1.5]), (3, [1.0, 0.1, -1.5]), (3, [-1.0, 0.1, 1.5])):
        assert len(zeros) == degree and spectrum.stable(balls(zeros, 1e-12)) is False
    assert spectrum.stable(balls([1.0, 0.5], 1e-12)) is None and spectrum.stable(balls([-1.0, 0.5, 0.2], 1e-12)) is None


@pytest.mark.parametrize("size", [0, 1, 2, 3, 5])
def test_eigenvalues_lie_in_their_enclosures(size, rng):
    for _ in range(4):
        A = rng.normal(size=(size, size))
        M = flint.arb_mat(size, size, [flint.arb(float(v), 1e-12) for v in A.ravel()])
        found = spectrum.eigenvalues(M)
        assert len(found) == size
        for value in np.linalg.eigvals(A) if size else ():
            inside = [z for z in found if (z + flint.acb(flint.arb(0, 1e-13), flint.arb(0, 1e-13))).contains(
                flint.acb(float(value.real), float(value.imag)))]
            assert len(inside) == 1
            assert float(inside[0].real.rad()) < 1e-8 and float(inside[0].imag.rad()) < 1e-8
        if size:
            assert [float(c.mid()) for c in spectrum.characteristic(M)] == pytest.approx(np.poly(A)[::-1], abs=1e-10)


def test_eigenvalues_that_cannot_be_told_apart_have_wide_enclosures():
    double = flint.arb_mat(2, 2, [flint.arb(0.5, 1e-8), flint.arb(0, 1e-8), flint.arb(0, 1e-8), flint.arb(0.5, 1e-8)])
    for z in spectrum.eigenvalues(double):
        assert z.contains(flint.acb(0.5)) and z.contains(flint.acb(0.5 + 1e-8, 0.0)) and z.contains(flint.acb(0.5, 0.9e-8))
        assert float(z.real.rad()) < 1e-7
    blurred = flint.arb_mat(3, 3, [flint.arb(0.5 * (i == j), 1.0) for i in range(3) for j in range(3)])
    for z in spectrum.eigenvalues(blurred):
        assert all(z.contains(flint.acb(value)) for value in (0.5, -2.4, 3.4))


def test_the_derivative_over_a_period_is_the_product_of_its_parts_without_what_is_kept(rng):
    parts = rng.normal(size=(6, 4, 4))
    made = [flint.arb_mat(4, 4, part.ravel().tolist()) for part in parts]
    product = np.eye(4)
    for flow, jump in zip(parts[:3], parts[3:], strict=True):
        product = flow @ jump @ product
    for kept, places in (((), [0, 1, 2]), ((1,), [0, 2])):
        M = spectrum.monodromy(made[:3], made[3:], 3, kept, [[flint.arb(v) for v in row] for row in np.eye(3)[list(kept)].tolist()])
        found = [[float(M[i, j].mid()) for j in range(len(places))] for i in range(len(places))]
        np.testing.assert_allclose(found, product[np.ix_(places, places)], rtol=1e-13)
