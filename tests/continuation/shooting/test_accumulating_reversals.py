"""Where friction turns just as a complete chattering ends, changes of the sequence accumulate, and a branch ends there from both
sides: onsets of the last reversals fall geometrically, and their limit, extrapolated from three of them, is the place of both ends.
"""
import pytest

import bifurc as bf
from bifurc.continuation.kinds import StopReason
from tests.hard.test_settled_motions import drawn

BOUNDS, AGREED = (1.4440, 1.4462), 3e-8
SCENE = 9028  # three masses; friction, whose load varies, and a stop act on rows that share a mass


@pytest.fixture(scope="module")
def rest():
    return bf.find_orbit(drawn(SCENE)).state


@pytest.mark.parametrize("side", [0, 1])
def test_ends_lie_at_the_limit_of_the_changes(rest, side):
    system = drawn(SCENE).with_parameters(omega=(1.4441, 1.4461)[side])
    orbit = bf.find_orbit(system, bf.simulate(system, rest, periods=300).final)
    branch = bf.trace(orbit, "omega", bounds=BOUNDS, max_steps=200)
    end = branch.ends[-1 - side]
    onsets = [p.parameter for p in branch.special_points if p.kind.value == "slip_onset"][::1 - 2 * side]
    a, b, c = onsets[:3]
    assert end.reason is StopReason.CHATTERING and branch.audit.ok
    assert end.p == pytest.approx(c + (c - b)**2 / ((b - a) - (c - b)), abs=AGREED)
