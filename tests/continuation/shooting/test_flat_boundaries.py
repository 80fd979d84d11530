"""Boundaries whose tests are zero with some power of the way: their place is known as well as that of others, and alone there."""
import pytest

import bifurc as bf
from bifurc.continuation import StopReason
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, RigidStop

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


# a mass that a stop and friction hold by turns

PULL, STIFFNESS, GAP, FRICTION = 0.566, 1.37, 0.133, 0.0474
HELD = PULL - STIFFNESS * GAP  # what presses the mass on its stop, without the load


def held_by_turns(amplitude, restitution):
    """Return a mass pressed on a stop, where friction acts on it as well."""
    return bf.System(1.0, 0.05, STIFFNESS, [HarmonicForce(amplitude), ConstantForce(PULL), RigidStop(GAP, restitution),
                                            Coulomb(FRICTION)], omega=1.287)


@pytest.mark.parametrize("share", [-0.9, 0.0, 0.9])
@pytest.mark.parametrize("restitution", [0.0, 0.667])
def test_a_mass_that_friction_holds_while_its_stop_does_not_stands_still(restitution, share):
    """The stop lets go while the load leaves less than the friction, which is at its limit before and after: no slip is one."""
    orbit = bf.find_orbit(held_by_turns(HELD + share * FRICTION, restitution))
    assert orbit.success and orbit.stable and [str(event.kind) for event in orbit.events] == ["release", "slip"]
    _, y = orbit.sample(50)
    assert abs(y[:, 0] - GAP).max() < 1e-15 and abs(y[:, 1]).max() < 1e-15


@pytest.mark.parametrize("start", [0.3, 0.4, 0.6])
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_it_begins_to_be_held_by_turns_and_to_slip_where_the_forces_balance(restitution, start):
    branch = bf.trace(bf.find_orbit(held_by_turns(start, restitution)), "harmonic_force.amplitude", bounds=(0.25, 0.65))
    assert [end.reason for end in branch.ends] == [StopReason.BOUND, StopReason.BOUND] and branch.audit.ok
    turns, slips = branch.special_points[:2]
    for point, force in ((turns, HELD - FRICTION), (slips, HELD + FRICTION)):
        assert abs(point.parameter - force) <= point.error + 1e-15 < 1e-8
    assert (turns.kind.value, slips.kind.value) == ("stick_onset", "grazing") and len(branch.special_points) == 3
