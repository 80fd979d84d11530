"""Where friction turns just as a complete chattering ends, changes of the sequence accumulate from both sides.

A branch lists those before the chattering is closed and goes on, from either side.  Onsets of the last reversals fall geometrically
on either side, and have one limit: where friction turns at the very end of the impacts that are not listed.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from tests.hard.test_settled_motions import drawn

BOUNDS, AGREED = (1.4440, 1.4468), 3e-8
SCENE = 9028  # three masses; friction, whose load varies, and a stop act on rows that share a mass


@pytest.fixture(scope="module", params=[1.4441, 1.4467])
def branch(request):
    system = drawn(SCENE)
    rest = bf.find_orbit(system).state
    system = system.with_parameters(omega=request.param)
    orbit = bf.find_orbit(system, bf.simulate(system, rest, periods=300).final)
    return bf.trace(orbit, "omega", bounds=BOUNDS, max_steps=200)


@pytest.mark.slow
def test_branch_goes_on_from_bound_to_bound(branch):
    assert [end.reason.value for end in branch.ends] == ["bound", "bound"] and branch.audit.ok


@pytest.mark.slow
def test_limits_of_the_changes_on_both_sides_are_one(branch):
    """Differences of three onsets in a row have the ratio of the whole sequence."""
    points = sorted(branch.special_points.of("slip_onset"), key=lambda point: point.parameter)
    onsets = [point.parameter for point in points]
    below, above = onsets[:3], onsets[:-4:-1]
    limits = [c + (c - b)**2 / ((b - a) - (c - b)) for a, b, c in (below, above)]
    assert limits[0] == pytest.approx(limits[1], abs=AGREED)
    [last] = points[3:-3]
    unsure = abs(limits[0] - limits[1])  # of what three onsets in a row tell
    off = [abs(last.parameter - limit) for limit in limits]
    assert min(off) <= last.error < 2e-7 and max(off) <= min(AGREED, last.error + unsure)


def test_changes_of_a_train_fall_with_the_restitution():
    """Impacts of a complete chattering overtake a stick one after the other, nearer to their end by the restitution each.  The
    equations between the first two changes are valid over less than the length at which equations are begun that are singular
    at their boundary."""
    restitution = 0.243
    system = bf.System(np.diag([1.2933, 0.9296]), [[0.1257, -0.0366], [-0.0366, 0.1361]], [[1.6345, -0.9306], [-0.9306, 2.3366]], [
        HarmonicForce(1.7, dof=1), RigidStop(0.135, restitution), Coulomb(0.0432, row=(1.0, -1.0), belt_speed=0.0586)], omega=0.841)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.84, 0.93))
    assert branch.audit.ok and [end.reason.value for end in branch.ends] == ["bound", "bound"]
    onsets = np.array([point.parameter for point in branch.special_points])
    for places in (onsets[-9:-3:2], onsets[-10:-4:2]):  # an impact is before the stick, at it, behind it
        assert np.diff(places)[1] * restitution == pytest.approx(np.diff(places)[0], rel=0.02)
