"""Where friction turns just as a complete chattering ends, changes of the sequence accumulate from both sides.

A branch lists those before the chattering is closed and goes on.  Onsets of the last reversals fall geometrically on either side,
and have one limit.
"""
import pytest

import bifurc as bf
from tests.hard.test_settled_motions import drawn

BOUNDS, AGREED = (1.4440, 1.4468), 3e-8
SCENE = 9028  # three masses; friction, whose load varies, and a stop act on rows that share a mass


@pytest.fixture(scope="module")
def branch():
    system = drawn(SCENE)
    rest = bf.find_orbit(system).state
    system = system.with_parameters(omega=1.4441)
    orbit = bf.find_orbit(system, bf.simulate(system, rest, periods=300).final)
    return bf.trace(orbit, "omega", bounds=BOUNDS, max_steps=200)


def test_branch_goes_on_from_bound_to_bound(branch):
    assert [end.reason.value for end in branch.ends] == ["bound", "bound"] and branch.audit.ok


def test_limits_of_the_changes_on_both_sides_are_one(branch):
    """Differences of three onsets in a row have the ratio of the whole sequence."""
    onsets = sorted(point.parameter for point in branch.special_points if point.kind.value == "slip_onset")
    below, above = onsets[:3], onsets[:-4:-1]
    limits = [c + (c - b)**2 / ((b - a) - (c - b)) for a, b, c in (below, above)]
    assert limits[0] == pytest.approx(limits[1], abs=AGREED)
    assert onsets[2] < limits[0] < onsets[-3]
