"""How far the parameter of a complete chattering is known, and events that are left in though they have lost their speed."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.shooting.problem import OrbitProblem
from bifurc.continuation.shooting.vanishing import dropped
from bifurc.orbits.shooting.signature import GUARD
from tests.continuation.shooting.test_changes import inserted, touching


@pytest.mark.parametrize("slope", [2.0, -2.0, 1e-6, -1e6])
def test_the_parameter_is_off_by_what_is_not_listed_over_the_rate_of_the_rest(slope):
    """The rest lasts slope p on, and 1e-9 of it is not listed: p is off by 1e-9 / |slope|, whichever way the rest grows."""
    here = np.array([0.0, 3.0])
    known = SimpleNamespace(_chatters=True, _released=lambda x: False, scale=np.array([1.0, 2.0]), _unlisted=lambda x: 1e-9,
                            _resting=lambda x: (0, 1e-10 + slope * (float(x[-1]) - 3.0)),
                            correct=lambda x, tangent: SimpleNamespace(converged=True, x=x, p=float(x[-1])))
    found = OrbitProblem.uncertainty(known, here, np.array([0.0, 1.0]))
    assert found == pytest.approx(1e-9 / abs(slope), rel=1e-6)


def test_an_impact_without_speed_stays_where_it_shall():
    """Two impacts that touch: without the first, without the second, and without both."""
    problem, x, _ = touching("rigid", 2)
    new = problem.with_sequence(*inserted(problem, x))
    events = [k for k, node in enumerate(new.sequence.nodes) if node[GUARD] >= 0]
    each = len(events) // 2
    for part in (events[:each], events[each:]):
        signature, at = dropped(new, new.x0, 1e-5, staying=frozenset(part))
        left = [k for k, node in enumerate(signature.nodes) if node[GUARD] >= 0]
        assert len(left) == each
        times, old = at[:-1].reshape(len(signature.nodes), -1)[left, 0], new.x0[:-1].reshape(len(new.sequence.nodes), -1)[part, 0]
        np.testing.assert_allclose(times, old, rtol=0, atol=1e-9)
    assert dropped(new, new.x0, 1e-5, staying=frozenset(events)) is None
