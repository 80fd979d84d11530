"""Two tests of a branch that are nearly zero at one place: what is there does not depend on the direction of travel."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import StopReason
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop

K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
MU = 0.056


def chain(omega):
    """Three masses of which the last rubs, with clearances that stay open."""
    return bf.System(np.eye(3), (0.05 * K).tolist(), K.tolist(), [
        HarmonicForce(0.338), ElasticStop(0.649, 45.3, row=(1.0, -1.0, 0.0)), ElasticStop(0.906, 45.3, row=(0.0, 1.0, -1.0)),
        Coulomb(MU, dof=2)], omega=omega)


def ends_of_slip(orbit):
    """Return times (k,) and states (k, 2 n) at which the contact ends to slip."""
    ends = [event for event in orbit.events if event.kind == "stick"]
    return np.array([event.time for event in ends]), np.array([event.before for event in ends])


def test_a_slip_that_turns_back_begins_from_both_sides():
    """Where the force on the mass at the end of its slip is the friction limit, it begins to slide back instead of sticking.

    The direction after the reversal and the duration of the slip back are zero at one place; what begins there is slip,
    seen from the side that sticks and from the side that slips.  The force is that of springs and dampers at a mass at rest.
    """
    points = []
    for omega, direction in ((0.6185, 1), (0.6195, -1)):
        branch = bf.trace(bf.find_orbit(chain(omega)), "omega", bounds=(0.618, 0.62), direction=direction)
        assert branch.stop_reason[1 if direction == 1 else 0] is StopReason.BOUND
        points.append([p for p in branch.special_points if p.parameter < 0.619385])  # then it never sticks any more
    assert [[p.kind.value for p in found] for found in points] == [["slip_onset"], ["slip_onset"]]
    (one,), (other,) = points
    assert one.parameter == pytest.approx(other.parameter, abs=1e-11)
    _, y = ends_of_slip(one.solution)
    force = -y[:, :3] @ K[2] - 0.05 * y[:, 3:] @ K[2]
    assert np.abs(y[:, 5]).max() < 1e-12
    assert np.abs(np.abs(force) - MU).min() < 1e-10


def stopped(gap):
    """One mass with dry friction whose impacts become ever slower."""
    return bf.System(1.0, 0.068, 1.0, [HarmonicForce(1.0), RigidStop(gap, 0.349), Coulomb(0.395)], omega=0.788)


def test_a_start_beside_a_slow_impact_is_not_on_a_boundary():
    """Behind an impact of speed 2e-5 every test is small, and none is zero: the branch begun there is the whole branch."""
    whole = bf.trace(bf.find_orbit(stopped(0.29)), "gap", bounds=(0.268235, 0.3), direction=-1)
    assert whole.stop_reason[0] is StopReason.BOUND
    begun = bf.trace(whole.orbits[0], "gap", bounds=(0.1926, 0.4494))
    assert begun.stop_reason == (StopReason.CHATTERING, StopReason.BOUND)
    mine, theirs = ([(p.kind.value, p.parameter) for p in branch.special_points if 0.268235 < p.parameter < 0.29]
                    for branch in (whole, begun))
    assert len(mine) == 4
    assert [kind for kind, _ in mine] == [kind for kind, _ in theirs] == ["grazing", "slip_onset", "grazing", "slip_onset"]
    assert [p for _, p in mine] == pytest.approx([p for _, p in theirs], abs=1e-10)
    for onset in begun.special_points:
        if onset.kind.value == "slip_onset" and 0.268235 < onset.parameter < 0.29:
            t, y = ends_of_slip(onset.solution)
            force = np.cos(0.788 * t) - y[:, 0]  # on the mass at rest
            assert np.abs(np.abs(force) - 0.395).min() < 1e-12
