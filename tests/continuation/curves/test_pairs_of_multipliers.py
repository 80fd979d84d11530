"""The angle of a pair on the unit circle is that of two multipliers, whatever real ones lie near the circle."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.curves.codimension_two import cosines


@pytest.mark.parametrize("theta", [0.3, 1.3, 2.9])
@pytest.mark.parametrize("real", [[1.0, 0.2], [-1.0, 0.2], [1.01, -0.99], []])
def test_a_real_multiplier_on_the_circle_is_no_pair(theta, real):
    """Without a clock one is always 1."""
    pair = 0.97 * np.exp(1j * theta)
    values = np.array([*real, pair, np.conj(pair)], complex)
    for order in (values, values[::-1], np.roll(values, 1)):
        problem = SimpleNamespace(pencil=lambda x: None, multipliers_at=lambda x, order=order: order)
        if len(real) and abs(real[0] * real[1] - 1.0) < abs(0.97**2 - 1.0):
            continue
        c = 0.97 * np.cos(theta)
        np.testing.assert_allclose(cosines(problem, np.zeros(2)), [c - 1.0, -1.0 - c, c + 0.5, c], rtol=0, atol=1e-12)
