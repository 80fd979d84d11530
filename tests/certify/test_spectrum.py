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
