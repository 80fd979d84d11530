"""The phase of a maximum of a trigonometric polynomial, from the side on which it falls."""
import numpy as np
import pytest
from scipy.optimize import brentq

from bifurc.hbm.contacts.event_driven import summit
from bifurc.hbm.waves import turn

WAVES = np.array([0, 1, 1, 2, 2, 5, 5])


def rate(a, t):
    k = WAVES[1::2].astype(float)
    return float(np.sum(k * (a[2::2] * np.cos(k * t) - a[1::2] * np.sin(k * t))))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [1.0, 1e-9, 1e9])
def test_a_maximum_is_met_where_it_falls(seed, size):
    """Within 2e-9 behind the zero of the derivative, where it is not positive, not even by rounding; never behind the end."""
    a = size * np.random.default_rng(seed).normal(size=WAVES.size) / (1.0 + WAVES)
    grid = np.linspace(0.0, 2.0 * np.pi, 41)
    seen = 0
    for low, high in zip(grid, grid[1:], strict=False):
        rise, fall = rate(a, low), rate(a, high)
        if rise > 0.0 > fall:
            top = brentq(lambda t: rate(a, t), low, high, xtol=1e-15, rtol=1e-15)
            for end in (high, top + 0.3 * (high - top), top + 1e-10):
                found = summit(WAVES, a, low, end, rise, rate(a, end))
                assert top - 1e-15 < found <= end and found - top < 2.5e-9
                assert turn(WAVES, a, found)[0] <= 0.0
            seen += 1
    assert seen > 0
