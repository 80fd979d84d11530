"""Reactions of rows held on a circle: their derivatives against differences."""
import numpy as np
import pytest

from bifurc.compose import curve


@pytest.mark.parametrize("rows", [0.0, 1.0, 2.0])
def test_slopes_of_a_reaction_are_its_differences(rows):
    """By place, speed and acceleration; normal, tangential and both rows held, with coupled inertia."""
    moving = np.array([0.8, -0.5, 0.4, 1.3, -0.7, 0.6])
    fixed = (0.1, -0.2, 0.3, 0.7, rows, 1.2, 0.3, 0.9, -1.0, 0.25)
    found = np.array(curve.reaction_slope(*moving, *fixed)).reshape(2, 6)
    step = 1e-6
    for k in range(6):
        way = step * np.eye(6)[k]
        above, below = (np.array(curve.reaction(*(moving + sign * way), *fixed)) for sign in (1.0, -1.0))
        np.testing.assert_allclose(found[:, k], (above - below) / (2.0 * step), rtol=1e-7, atol=1e-8)
