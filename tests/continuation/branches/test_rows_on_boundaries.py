"""Rows and special points on boundaries of an event sequence: motions, whatever rounding says of their guards."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import HarmonicBalance, System, systems
from bifurc.continuation.branches.branch import Branch
from bifurc.continuation.branches.special import solution_at
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.hbm.status import BalanceStatus
from bifurc.orbits import OrbitStatus
from bifurc.orbits.repetition import repetition


def linear(omega, mass=1.0, damping=0.1, stiffness=1.0, force=1.0):
    """Amplitude of a linear oscillator."""
    return force / abs(stiffness - mass * omega**2 + 1j * damping * omega)


def stop(kind, gap=1.6, omega=0.5):
    made = RigidStop(gap, 0.7) if kind == "rigid" else ElasticStop(gap, 4.0)
    return System(1.0, 0.1, 1.0, [HarmonicForce(1.0), made], omega=omega)


@pytest.mark.parametrize(("kind", "method"), [("rigid", None), ("elastic", None), ("elastic", HarmonicBalance(9)),
                                              ("elastic", HarmonicBalance(9, aft="sampled"))])
def test_a_graze_is_a_success_on_a_boundary(kind, method, tmp_path):
    """Just there the motion is the linear one, whose amplitude is the gap."""
    orbit = bf.find_orbit(stop(kind), method=method) if method else bf.find_orbit(stop(kind))
    branch = bf.trace(orbit, "omega", bounds=(0.5, 0.75))
    branch.save(tmp_path / "branch.npz")
    status = BalanceStatus.ON_BOUNDARY if method else OrbitStatus.ON_BOUNDARY
    for here in (branch, Branch.load(tmp_path / "branch.npz")):
        (graze,) = here.special_points.of("grazing")
        assert linear(graze.parameter) == pytest.approx(1.6, rel=1e-9 if method is None or method.aft != "sampled" else 1e-4)
        at = np.flatnonzero(np.abs(here.column("s") - graze.s) < 1e-9)
        assert at.size == 2  # one on either side
        for orbit in (*(here.orbits[int(i)] for i in at), graze.solution):
            assert orbit.success and orbit.status is status and "boundary" in repr(orbit)
            assert orbit.maximum() == pytest.approx(1.6, rel=1e-4)
        others = [orbit for i, orbit in enumerate(here.orbits) if i not in at]
        assert all(orbit.success and orbit.status == "converged" for orbit in others)
    made = branch.orbits[int(at[0])]
    made.save(tmp_path / "orbit.npz")
    assert bf.load(tmp_path / "orbit.npz").status is status


@pytest.mark.parametrize("method", [None, HarmonicBalance(9)])
def test_an_onset_of_slip_is_a_success_on_a_boundary(method):
    """Up to there the slider sticks: a linear oscillator of both springs, whose amplitude times the slider's is the limit."""
    system = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Jenkins(1.0, 1.2)], omega=0.5)
    branch = bf.trace(bf.find_orbit(system, method=method) if method else bf.find_orbit(system), "omega", bounds=(0.5, 1.3))
    onset = branch.special_points.of("slip_onset")[0]
    assert linear(onset.parameter, stiffness=2.0) == pytest.approx(1.2, rel=1e-9)
    assert onset.solution.success and onset.solution.status == "on_boundary"
    assert all(orbit.success for orbit in branch.orbits)


def two(own, between):
    return [[own, -between], [-between, own]]


SCENES = {  # rounding put a guard of each on the wrong side, by 1e-13 to 1e-6
    "slips between impacts": (lambda: System(1.0, 0.0249, 1.0, [HarmonicForce(1.0), RigidStop(0.587, 0.339), Coulomb(0.2)],
                                             omega=0.764)),
    "slips of no duration": (lambda: System(1.0, 0.142, 1.0, [HarmonicForce(1.0), RigidStop(0.605, 0.299), Coulomb(0.13)],
                                            omega=0.651)),
    "a mass that just slips": (lambda: System(np.diag([1.0, 0.799]), two(0.135, 0.075), two(2.25, 1.25), [
        HarmonicForce(0.601), RigidStop(0.244, 0.305), Coulomb(0.565, dof=1)], omega=0.981)),
    "chattering between masses": (lambda: System(np.diag([1.0, 1.61]), [[0.1, -0.03], [-0.03, 0.08]], two(1.566, 0.566), [
        HarmonicForce(0.896), RigidStop(0.695, 0.392, row=(1.0, -1.0)), RigidStop(0.684, 0.31, row=(-1.0, 1.0))], omega=1.07)),
}


@pytest.mark.parametrize("name", SCENES)
def test_every_row_and_special_point_is_a_motion(name):
    system = SCENES[name]()
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.75 * system.omega, 1.3 * system.omega), max_steps=200, audit="fast")
    assert all(orbit.success for orbit in branch.orbits)
    boundaries = [point for point in branch.special_points if point.on_boundary]
    assert boundaries
    for point in boundaries:
        assert point.solution.success and point.solution.status is OrbitStatus.ON_BOUNDARY
        assert repetition(point.solution).miss < 1e-6


def test_what_passes_a_stop_is_no_motion_wherever_it_is_said_to_lie():
    branch = bf.trace(bf.find_orbit(stop("rigid")), "omega", bounds=(0.5, 0.75))
    (graze,) = branch.special_points.of("grazing")
    x = graze.x.copy()
    x[-1] += 1e-3  # the motion that knows nothing of the stop
    beyond = graze.problem.correct(x, np.append(np.zeros(x.size - 1), 1.0), True)
    assert beyond.converged and linear(beyond.p) > 1.6
    assert solution_at(graze.problem, beyond.x, True).status is OrbitStatus.INADMISSIBLE


def test_folds_and_doublings_are_no_boundaries():
    branch = bf.trace(bf.find_orbit(systems.duffing_oscillator()), "omega", bounds=(0.5, 2.5))
    assert not any(point.on_boundary for point in branch.special_points.of("fold"))
    assert all(point.solution.status is OrbitStatus.CONVERGED for point in branch.special_points.of("fold"))
    assert math.isfinite(branch.special_points.of("fold")[0].parameter)
