"""Corners of balance branches: onsets of slip, contacts that open and close, passed from both sides, wherever phase 0 lies."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import System, systems
from bifurc.continuation.balance.start import balance_problem
from bifurc.elements import ElasticStop, HarmonicForce, Jenkins
from tests.hbm.test_examples import three
from tests.reference.beam import cantilever


def ends(branch):
    return {str(reason) for reason in branch.stop_reason} - {"not_started"}


def damper(load, harmonics=21, start=90.0, **options):
    system = systems.friction_damped_oscillator(omega=start, normal_load=float(load), damper="macro")
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics))
    return bf.trace(orbit, "omega", bounds=(90.0, 104.0), peaks="max_0", **options)


def complete(branch):
    """Whether a response has its peak between an onset of slip and one of stick; both are where the stuck amplitude says."""
    return ends(branch) == {"bound"} and len(branch.special_points.of("peak")) == 1 \
        and len(branch.special_points.of("slip_onset")) == 2


@pytest.mark.parametrize("load", [80.0, 215.0, 220.0, 325.0])
def test_slip_begins_on_whichever_side_of_the_corner_rounding_lies(load):
    branch = damper(load)
    assert complete(branch)
    spring = branch.orbits[0].system.elements[-1].stiffness
    for point in branch.special_points.of("slip_onset"):  # the stuck amplitude times the spring is the limit
        stuck = 100.0 / abs(1e4 + spring - 1.07 * point.parameter**2 + 0.562j * point.parameter)
        assert stuck * spring == pytest.approx(0.5 * load, rel=1e-9)


@pytest.mark.parametrize(("load", "harmonics", "start", "options"), [
    (188.9, 3, 104.0, {"direction": -1, "ds_max": 0.4}), (343.6, 7, 104.0, {"direction": -1, "ds_max": 0.1}),
    (43.0, 15, 90.0, {"direction": 1, "ds_max": 0.4})])
def test_responses_do_not_depend_on_steps_and_direction(load, harmonics, start, options):
    assert complete(damper(load, harmonics, start, **options))


@pytest.mark.slow
def test_67_loads_complete_with_their_peak():
    heights = []
    for load in range(20, 351, 5):
        branch = damper(load)
        assert complete(branch), load
        heights.append(branch.special_points.of("peak")[0].measures["max_0"])
    known = {50: 1.360811, 100: 1.165604, 150: 1.184304, 200: 1.292366, 300: 1.596741}  # a half-period map without harmonics
    for load, height in known.items():
        assert heights[(load - 20) // 5] == pytest.approx(height, abs=2e-6)


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.0 * math.pi, 5)[:-1] + 0.3)
def test_an_elastic_stop_is_reached_wherever_phase_0_lies(phase):
    """The largest displacement passes phase 0 along the branch: between two rows of a grid that ends there it counts too."""
    system = System(1.0, 0.2, 1.0, [HarmonicForce(0.5, phase=float(phase)), ElasticStop(gap=1.0, stiffness=3.0)], omega=0.5)
    branch = bf.trace(bf.find_orbit(system, method=bf.HarmonicBalance(5)), "omega", bounds=(0.5, 1.6))
    graze = [math.sqrt(s) for s in np.roots([1.0, 0.2**2 - 2.0, 1.0 - 0.25])[::-1]]
    assert ends(branch) == {"bound"}
    assert branch.special_points.of("grazing")[0].parameter == pytest.approx(graze[0], abs=1e-10)


def beam(parts, omega, force=0.5, gap=0.5, stiffness=100.0, damping=0.02):
    """Two degrees of freedom a part, an elastic stop at the tip."""
    M, K, _ = cantilever(parts)
    tip = 2 * parts - 2
    elements = [HarmonicForce(force, dof=tip), ElasticStop(gap=gap, stiffness=stiffness, dof=tip)]
    return System(M, bf.modal_damping(M, K, damping), K, elements, omega=omega)


@pytest.mark.parametrize(("parts", "values", "harmonics"), [
    (5, (0.5, 0.5), 7), pytest.param(20, (0.5, 0.5), 7, marks=pytest.mark.slow),
    pytest.param(20, (0.55, 0.9, 160.0, 0.01), 5, marks=pytest.mark.slow)])
def test_a_beam_with_an_elastic_stop_is_one_branch(parts, values, harmonics):
    peaks = []
    for start in (2.5, 5.0):
        orbit = bf.find_orbit(beam(parts, start, *values), method=bf.HarmonicBalance(harmonics))
        branch = bf.trace(orbit, "omega", bounds=(2.5, 5.0), peaks=f"max_{2 * parts - 2}")
        assert ends(branch) == {"bound"}
        assert branch.column("omega").min() == 2.5 and branch.column("omega").max() == 5.0
        peaks.append(sorted(point.parameter for point in branch.special_points.of("peak")))
    assert peaks[0] == pytest.approx(peaks[1], abs=1e-6) and len(peaks[0]) >= 1


def clearances(omega, force=0.5, first=0.3, second=0.3, stop=10.0, limit=0.2, slider=5.0):
    """Three masses between walls, two elastic clearances between them, a slider on the last."""
    K = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    return System(np.eye(3), 0.05 * K, K, [
        HarmonicForce(force), ElasticStop(first, stop, row=(1.0, -1.0, 0.0)), ElasticStop(second, stop, row=(0.0, 1.0, -1.0)),
        Jenkins(slider, limit, dof=2)], omega=omega)


@pytest.mark.parametrize("start", [0.7, 1.2, 1.7])
def test_clearances_and_a_slider_are_one_branch_across_both_resonances(start):
    branch = bf.trace(bf.find_orbit(clearances(start), method=bf.HarmonicBalance(7)), "omega", bounds=(0.7, 2.2), peaks="max_0")
    omega = branch.column("omega")
    assert ends(branch) == {"bound"} and {omega[0], omega[-1]} == {0.7, 2.2}
    assert len(branch.special_points.of("peak")) >= 2 and branch.column("residual").max() < 1e-9


@pytest.mark.parametrize(("harmonics", "start", "values"), [
    (11, 0.9794, (0.2995, 0.1013, 0.5377, 31.6884, 0.2396, 1.037)),
    (7, 1.5179, (0.4104, 0.1636, 0.3431, 22.671, 0.4965, 19.8089)),
    (7, 0.7839, (0.4011, 0.3045, 0.3158, 12.9707, 0.5872, 13.415))])
def test_memory_of_a_slider_that_came_to_rest_is_that_of_the_limit_it_passed(harmonics, start, values):
    """At phase 0 the motion is beyond the slider's limit on one side and already on its way to the other."""
    orbit = bf.find_orbit(clearances(start, *values), method=bf.HarmonicBalance(harmonics))
    assert ends(bf.trace(orbit, "omega", bounds=(0.7, 2.2))) == {"bound"}


@pytest.mark.parametrize("samples", [64, 256])
def test_a_sampled_branch_turns_by_a_part_of_the_distance_of_samples(samples):
    """An event that passes a sample turns the branch, by the less the more samples there are: that much turn is no jump."""
    system = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(0.5, 3.0)], omega=1.1)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(5, aft="sampled", samples=samples))
    problem = balance_problem(orbit, "omega", (0.9, 1.3))
    x, only, tangents = problem.x0.copy(), np.append(np.zeros(problem.size), 1.0), []
    for omega in np.linspace(1.1, 1.15, 301):
        x[-1] = omega
        found = problem.correct(x, only, True)
        x = found.x.copy()
        tangents.append(found.tangent / np.linalg.norm(found.tangent))
    turns = np.arccos(np.clip(np.abs((np.array(tangents[1:]) * tangents[:-1]).sum(axis=1)), 0.0, 1.0))
    assert turns.max() > 5.0 * np.median(turns)  # a corner, no bend
    assert 0.05 * problem.corner < turns.max() < problem.corner < 1.0
    smooth = balance_problem(bf.find_orbit(system, method=bf.HarmonicBalance(5)), "omega", (0.9, 1.3))
    assert smooth.corner == 0.0


def test_rows_keep_their_order_of_events():
    """Eleven harmonics of example 07: an order of events that dies within a step of its birth is no corner that is jumped over."""
    branch = bf.trace(bf.find_orbit(three(1.83), method=bf.HarmonicBalance(11)), "omega", bounds=(1.0, 2.0))
    assert ends(branch) == {"bound"} and branch.column("omega").min() == 1.0
    counts = branch.column("n_events")
    seen = [sum(len(segments) - 1 for segments in orbit.segments) for orbit in branch.orbits]
    marks = np.array([point.s for point in branch.special_points])
    away = [i for i, s in enumerate(branch.column("s")) if np.abs(marks - s).min() > 1e-6]
    assert len(away) > 50 and [counts[i] for i in away] == [seen[i] for i in away]


def test_almost_full_stick_says_so_in_its_message():
    orbit = bf.find_orbit(systems.dry_friction_oscillator(amplitude=1.001), method=bf.HarmonicBalance(tuple(range(1, 16, 2))))
    assert orbit.success and "holds every contact" in orbit.message and "times the amplitude" in orbit.message
    clear = bf.find_orbit(systems.dry_friction_oscillator(amplitude=1.6), method=bf.HarmonicBalance(tuple(range(1, 16, 2))))
    assert clear.success and "times the amplitude" not in clear.message
