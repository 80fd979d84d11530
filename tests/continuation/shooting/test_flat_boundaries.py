"""Boundaries whose tests are zero with some power of the way: their place is known as well as that of others, and alone there."""
import pytest

import bifurc as bf
from bifurc.continuation import StopReason
from bifurc.elements import ConstantForce, HarmonicForce, RigidStop

PRESSED, LOAD = 2.0, 1.0


@pytest.fixture(scope="module")
def branch():
    """A mass pressed on a plastic stop, which it leaves where the load pulls it off: the gap at which that begins is the difference
    of both forces over a stiffness of 1.  The release, and the impact behind it, are born with the cube of the way."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(LOAD), ConstantForce(PRESSED), RigidStop(1.1, 0.0)], omega=1.5)
    return bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.8, 1.3))


def test_a_release_begins_where_the_forces_balance_seen_from_anywhere(branch):
    """All that begins there is the release: no fold, and no multiplier of a mass that every impact stops."""
    for orbit in branch.orbits[::2]:
        other = bf.trace(orbit, "rigid_stop.gap", bounds=(0.8, 1.3))
        (point,) = other.special_points
        assert point.kind.value == "grazing", other.special_points
        assert abs(point.parameter - (PRESSED - LOAD)) <= point.error + 1e-15 < 1e-8
        assert other.stop_reason == (StopReason.BOUND, StopReason.BOUND) and other.audit.ok


def test_no_steps_creep_up_to_it(branch):
    assert len(branch) < 40
