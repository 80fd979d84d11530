"""A slider that slipped until its mass struck a stop, and slips no more: in every impact it is at its limit, and never beyond.

Its motions are a family, of which the branch keeps this member: the guard of its limit is zero in every impact, of either sign of
its rounding, and tells nothing until the other limit is reached as well.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import StopReason
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.shooting.sequence import FOREVER, STARTS

LOAD, BOUNDS = "harmonic_force.amplitude", (0.5, 3.0)
STIFFNESS, GAP = 3.0, 0.2


@pytest.fixture(scope="module", params=[(0.0, 1.5, 2.0), (0.3, 1.0, 1.5)], ids=["plastic stop", "rebound"])
def branch(request):
    """From loads under which the slider slips both ways down to those under which it sticks."""
    restitution, limit, omega = request.param
    slider = Jenkins(STIFFNESS, limit)
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(2.0), RigidStop(GAP, restitution), slider], omega=omega)
    return bf.trace(bf.find_orbit(system), LOAD, bounds=BOUNDS)


def stuck(branch):
    return [orbit for orbit in branch.orbits if orbit.family and "jenkins" not in repr(orbit)
            and any(event.kind.value == "impact" for event in orbit.events)]


def test_it_is_at_its_limit_in_every_impact(branch):
    """Its spring is as long in each of them as its limit stretches it."""
    found = stuck(branch)
    assert len(found) > 2
    for orbit in found:
        length = orbit.system.elements[2].limit / STIFFNESS
        stretched = [event.before[0] - orbit.state[2] for event in orbit.events if event.kind.value == "impact"]
        np.testing.assert_allclose(stretched, length, rtol=1e-12)


def test_where_it_sticks_no_limit_is_near(branch):
    """What the test of unlisted events says there is the distance from the other limit, clear of rounding."""
    points = np.array([point.parameter for point in branch.special_points])
    for orbit in stuck(branch):
        if np.abs(points - orbit.system.parameter(LOAD)).min() < 1e-6:
            continue  # on the onset itself
        problem = orbit_problem(orbit, LOAD, BOUNDS)
        peaks = [k for k, monitor in enumerate(problem.monitors) if monitor.name == "unlisted"]  # of what moves, of what is held
        assert (problem.monitor_values(problem.x0[:-1], float(problem.x0[-1]), None)[peaks] < -1e-6).all()


def test_from_there_the_branch_is_the_same(branch):
    (onset,) = branch.special_points.of("slip_onset")
    for orbit in stuck(branch)[1:4]:
        other = bf.trace(orbit, LOAD, bounds=BOUNDS)
        (again,) = other.special_points.of("slip_onset")
        assert abs(again.parameter - onset.parameter) <= again.error + onset.error + 1e-12
        assert other.stop_reason == (StopReason.BOUND, StopReason.BOUND) and other.audit.ok


def test_along_the_gap_its_limit_is_none_of_the_impacts(branch):
    """The gap moves where the mass strikes, and the slider with it: there its limit is reached, and told."""
    orbit = stuck(branch)[-2]
    along = {name: orbit_problem(orbit, name, bounds) for name, bounds in ((LOAD, BOUNDS), ("rigid_stop.gap", (0.15, 0.25)))}
    marked = [np.count_nonzero(problem.sequence.nodes[:, STARTS:] == FOREVER) for problem in along.values()]
    assert marked[0] > marked[1]


def test_a_slider_that_an_impact_stopped_begins_no_slip_in_the_next_one():
    """Beyond the end of its slip between two impacts the slider comes back to the stop at its limit: whether it slips there before
    the impact turns it round is rounding, which a simulation may list.  The branch goes on, and is found from beyond; there the
    force of the slider is its limit in both impacts."""
    def system(stiffness):
        return bf.System(1.0, 0.0298, 1.0, [HarmonicForce(1.14), RigidStop(0.392, 0.749), Jenkins(stiffness, 0.21)], omega=0.813)

    found = []
    for start in (0.7, 0.62):
        branch = bf.trace(bf.find_orbit(system(start)), "jenkins.stiffness", bounds=(0.6, 0.72))
        assert branch.audit.ok and [str(end.reason) for end in branch.ends] == ["bound", "bound"]
        found.append([p.parameter for p in branch.special_points if p.kind == "slip_onset"])
    assert len(found[0]) == len(found[1]) == 1 and abs(found[0][0] - found[1][0]) < 1e-11
    orbit = bf.find_orbit(system(0.64))
    assert [event.kind.value for event in orbit.events].count("slip") == 2
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    for event in (event for event in orbit.events if event.kind == "impact"):
        x, _, slider = motion(event.time)
        assert abs(0.64 * (x - slider)) == pytest.approx(0.21, abs=1e-12) and x == pytest.approx(0.392, abs=1e-12)
