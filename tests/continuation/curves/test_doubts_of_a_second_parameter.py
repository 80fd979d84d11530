"""What rounding makes of the second parameter of a curve, against the inverse of the matrix, and in other units."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.curves.problem import ROUNDINGS, CurveProblem


def doubt(wide, floor, tangent, scale, width=np.inf):
    known = SimpleNamespace(_linearised=lambda x: (None, wide, floor), scale=scale, _width=lambda *given: width)
    return CurveProblem.uncertainty(known, np.zeros(len(tangent)), tangent)


@pytest.mark.parametrize("n", [2, 5])
def test_rounding_moves_the_parameter_as_the_inverse_says(n, rng):
    wide, floor, tangent = rng.normal(size=(n, n + 1)), 1e-16 * rng.uniform(0.5, 2.0, n), rng.normal(size=n + 1)
    scale = 10.0**rng.uniform(-3.0, 3.0, n + 1)
    row = np.linalg.inv(np.vstack([wide * scale, tangent]))[-1]
    expected = scale[-1] * ROUNDINGS * np.abs(row[:-1]) @ floor
    assert doubt(wide, floor, tangent, scale) == pytest.approx(expected, rel=1e-9)
    for unit in (1e-6, 1e6):  # of the second parameter
        moved = np.append(np.ones(n), unit)
        assert doubt(wide / moved, floor, tangent, scale * moved) == pytest.approx(unit * expected, rel=1e-9)
    assert doubt(wide, floor, tangent, scale, 0.0) <= expected * (1.0 + 1e-9)
    order = rng.permutation(n)
    assert doubt(wide[order], floor[order], tangent, scale) == pytest.approx(expected, rel=1e-9)
    wide[0, 0] = np.nan
    assert doubt(wide, floor, tangent, scale) == np.inf
