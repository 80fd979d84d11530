"""How far the parameter of a complete chattering is known, and events that are left in though they have lost their speed."""
import numpy as np

from bifurc.continuation.shooting.vanishing import dropped
from bifurc.orbits.shooting.signature import GUARD
from tests.continuation.shooting.test_changes import inserted, touching


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
