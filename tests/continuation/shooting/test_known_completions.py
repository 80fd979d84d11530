"""How far the parameter of a complete chattering is known."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.shooting.problem import OrbitProblem


@pytest.mark.parametrize("slope", [2.0, -2.0, 1e-6, -1e6])
def test_the_parameter_is_off_by_what_is_not_listed_over_the_rate_of_the_rest(slope):
    """The rest lasts slope p on, and 1e-9 of it is not listed: p is off by 1e-9 / |slope|, whichever way the rest grows."""
    here = np.array([0.0, 3.0])
    known = SimpleNamespace(_chatters=True, _released=lambda x: False, scale=np.array([1.0, 2.0]), _unlisted=lambda x: 1e-9,
                            _resting=lambda x: (0, 1e-10 + slope * (float(x[-1]) - 3.0)),
                            correct=lambda x, tangent: SimpleNamespace(converged=True, x=x, p=float(x[-1])))
    found = OrbitProblem.uncertainty(known, here, np.array([0.0, 1.0]))
    assert found == pytest.approx(1e-9 / abs(slope), rel=1e-6)
