"""Certificates of special points: closed forms lie in the enclosures, points that are none are not proved."""
import dataclasses

import numpy as np
import pytest
from mpmath import mp

import bifurc as bf
from bifurc.certify import Verdict
from bifurc.elements import HarmonicForce, RigidStop
from tests.certify.random_scenes import KINDS
from tests.reference import digits, one_stop

pytest.importorskip("flint")


def test_every_special_point_of_the_readme_is_proved(branch):
    for point in branch.special_points:
        found = point.certify()
        assert found.proved, found.message
        low, high = found.parameter
        assert low <= point.parameter + point.error and point.parameter - point.error <= high
        assert high - low < 1e-13


def test_grazings_of_the_free_motion_are_where_its_amplitude_is_the_gap(branch):
    """0.52 |receptance(omega)| = 1: a quadratic in omega^2."""
    x, load = mp.mpf(2) * mp.mpf(0.05), mp.mpf(0.52)
    b = x * x - 2
    root = mp.sqrt(b * b - 4 * (1 - load * load))
    exact = sorted(mp.sqrt((-b + sign * root) / 2) for sign in (-1, 1))
    found = sorted(point.certify().parameter for point in branch.special_points if point.kind == "grazing")
    for omega, (low, high) in zip(exact, found, strict=True):
        assert low <= omega <= high


def test_the_flip_has_a_multiplier_minus_one_in_closed_form(branch):
    for point in branch.special_points:
        if point.kind != "period_doubling":
            continue
        low, high = point.certify().parameter
        signs = []
        for omega in (low - 1e-12, high + 1e-12):
            orbits = one_stop.orbits(0.05, omega, 0.52, 1.0, 0.7, 1, samples=10)
            reference = min(orbits, key=lambda o: abs(float(abs(o.multipliers[0])) - 1.0))
            signs.append(reference.multipliers[0].real < -1)
        assert signs[0] != signs[1]


@pytest.mark.parametrize("shift", [1e-3, 1e-5])
def test_shifted_points_are_not_proved(branch, shift):
    for point in branch.special_points:
        if point.kind == "fold":
            continue
        x = point.x.copy()
        x[-1] += shift
        moved = dataclasses.replace(point, parameter=float(x[-1]), x=x)
        assert not moved.certify().proved


def test_a_symmetric_branch_point_is_proved_at_the_published_value():
    system = bf.systems.two_sided_impact_oscillator()
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(3.0, 3.6))
    points = [point for point in branch.special_points if point.kind == "branch_point"]
    assert points
    found = points[0].certify()
    assert found.proved, found.message
    assert abs(found.parameter[0] - 3.397988672) < 1e-9


@pytest.mark.slow
def test_a_torus_point_of_the_chain_is_proved_at_the_value_of_the_reference():
    """Eight masses; the value in 17 digits is that of an implementation of its own."""
    start = [-0.54, -1.001, -1.424, -1.805, -2.035, -2.046, -1.837, -1.472, -0.055, -0.01, 0.085, 0.159, 0.146, 0.058, -0.032,
             -0.088]
    orbit = bf.find_orbit(bf.systems.impact_chain(amplitude=0.45), start, periods=1)
    branch = bf.trace(orbit, "amplitude", bounds=(0.42, 0.45), audit="fast")
    (point,) = branch.special_points.of("neimark_sacker")
    found = point.certify()
    assert found.proved, found.message
    assert any(found.parameter[0] - 1e-15 <= value <= found.parameter[1] + 1e-15 for value in digits.CHAIN_TORUS)
    x = point.x.copy()
    x[-1] += 1e-5
    assert not dataclasses.replace(point, parameter=float(x[-1]), x=x).certify().proved


def test_point_certificates_are_stored(branch, tmp_path):
    found = branch.special_points[0].certify()
    found.save(tmp_path / "point.npz")
    assert bf.load(tmp_path / "point.npz") == found


def test_peaks_have_no_extended_system(branch):
    point = dataclasses.replace(branch.special_points[0], kind=bf.continuation.SpecialPointKind.PEAK)
    found = point.certify()
    assert found.exists is Verdict.UNDECIDED and "peak" in found.message


def test_points_of_a_motion_are_proved_in_any_unit_of_length():
    """Between two stops, one grazed while the other is hit: loads and gaps in units of 1, of 1e-6 and of 1e8."""
    found = []
    for unit in (1.0, 1e-6, 1e8):
        elements = (HarmonicForce(0.9 * unit), RigidStop(0.6 * unit, 0.5), RigidStop(0.75 * unit, 0.5, side=-1))
        system = bf.System(1.0, 0.2, 1.0, elements, omega=0.9)
        branch = bf.trace(bf.find_orbit(system), system.parameter_name("omega"), bounds=(0.5, 1.0))
        points = [point for point in branch.special_points if point.kind == "grazing"]
        assert len(points) == 3 and all(point.problem.sequence.events > 1 for point in points)
        made = [point.certify() for point in points]
        assert all(certificate.proved for certificate in made), [certificate.message for certificate in made]
        found.append([certificate.parameter for certificate in made])
    for other in found[1:]:
        for (low, high), (below, above) in zip(found[0], other, strict=True):
            assert max(low, below) <= min(high, above) and above - below < 1e-12


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_the_load_that_grazes_is_proved_and_one_beside_it_is_not_in_any_unit_of_length(unit):
    """gap |1 - omega^2 + 2 i zeta omega|; a millionth aside is another load, the last digits are not."""
    zeta, omega, gap = 0.05, 0.6, 0.8 * unit
    exact = gap * abs(1.0 - omega**2 + 2j * zeta * omega)
    system = bf.System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(0.9 * exact), RigidStop(gap, 0.5)), omega=omega)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.8 * exact, 1.02 * exact), max_steps=20)
    (point,) = branch.special_points.of("grazing")
    found = point.certify()
    assert found.proved, found.message
    assert found.parameter[0] <= exact * (1.0 + 1e-15) and exact * (1.0 - 1e-15) <= found.parameter[1]
    x = point.x.copy()
    x[-1] *= 1.0 + 1e-6
    assert not dataclasses.replace(point, parameter=float(x[-1]), x=x).certify().proved


def test_a_touch_beside_slow_impacts_is_proved_at_the_touch():
    """The last ones of eleven impacts are slower than what counts as a graze elsewhere: the touch is another event."""
    system = bf.System(1.0, 0.35, 1.0, [HarmonicForce(1.14), RigidStop(0.39, 0.325)], omega=0.7914)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.76, 0.8))
    touches = [point for point in branch.special_points if point.kind == "grazing"]
    assert len(touches) >= 4
    for point in touches:
        found = point.certify()
        assert found.exists is not Verdict.DISPROVED
        if found.exists:
            low, high = found.parameter
            assert low - point.error <= point.parameter <= high + point.error


@pytest.mark.slow
@pytest.mark.parametrize("seed", [18, 33])
def test_points_of_several_masses_lie_within_their_stated_errors(seed):
    """Rounding of the flow, the same at neighbouring points, moves them too."""
    system = KINDS["stop on several masses"](np.random.default_rng(seed))
    omega = system.omega
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.6 * omega, 1.7 * omega), max_steps=100)
    proved = 0
    for point in branch.special_points:
        found = point.certify()
        if found.exists:
            low, high = found.parameter
            assert low - point.error <= point.parameter <= high + point.error
            proved += 1
    assert proved > 5
