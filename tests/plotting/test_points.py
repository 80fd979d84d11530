"""Foreign points over a branch: the distance is that of the closed form, and the legend tells it."""
import numpy as np
import pytest

import bifurc as bf


def test_points_of_the_closed_form_lie_on_the_branch_and_shifted_ones_beside_it():
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.4, 0.6), ds_max=0.01)
    omega = np.array([0.45, 0.5, 0.55])
    rms = 0.52 / np.hypot(1.0 - omega**2, 0.1 * omega) / np.sqrt(2.0)
    assert branch.distance(np.column_stack((omega, rms))).max() < 1e-4
    points = np.column_stack((np.append(omega, 0.9), np.append(rms + 0.01, 0.5)))
    np.testing.assert_allclose(branch.distance(points), [0.01, 0.01, 0.01, np.inf], atol=1e-4)
    words = [text.get_text() for text in branch.plot(points=points).get_legend().get_texts()]
    assert any(word.startswith("points, distance 0.01") for word in words) and "1 points beyond the branch" in words
    with pytest.raises(ValueError, match="points has shape"):
        branch.distance([1.0, 2.0])
