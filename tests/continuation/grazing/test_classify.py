"""Grazings classified: closed forms of s_k and births, verdicts, short simulations, degenerate cases."""
import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.continuation.grazing import GrazingVerdict
from bifurc.continuation.grazing.classify import classified
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.system import System

CASES = {  # builder, parameters, bounds of the amplitude, grazing, s_1 .. s_4, signs of births, verdict, period and speed at 1e-4
    "overdamped": ("impact_oscillator", {"zeta": 1.25, "omega": 2.0, "restitution": 0.7}, (1.0, 7.0), 5.83095189484530,
                   (0.1373, 0.0288, 0.0060, 0.0012), (1, 1, 1, 1), "period_adding", 4, 0.0211),
    "underdamped": ("impact_oscillator", {"zeta": 0.05, "omega": 1.5, "restitution": 0.7}, (0.1, 1.4), 1.25896783120142,
                    (-0.7011, 0.5738, -0.0084, -0.3706), (-1, 1, -1, -1), "jump", 1, 3.57),
    "two stops": ("two_sided_impact_oscillator", {"zeta": 0.1, "omega": 2.0, "restitution": 0.7}, (1.0, 4.0), 3.02654919008432,
                  (-0.8589, 0.0116, 0.6272, -0.0169), (-1, 1, 1, -1), "jump", 1, 2.28),
    "two masses": ("impact_chain", {"n": 2, "damping": 0.1, "omega": 0.9, "restitution": 0.7}, (0.1, 0.8), 0.650546988457,
                   (-1.0107, 0.6295, 0.2928, -0.6831), (-1, 1, 1, -1), "jump", 1, 1.84),
}


def grazing_point(builder, parameters, bounds, name="amplitude"):
    system = getattr(bf.systems, builder)(**parameters, amplitude=bounds[0])
    return bf.trace(bf.find_orbit(system), name, bounds=bounds).special_points.of("grazing")[0]


@pytest.mark.parametrize("name", CASES)
def test_cases_of_every_class(name):
    builder, parameters, bounds, force, s, births, verdict, period, speed = CASES[name]
    point = grazing_point(builder, parameters, bounds)
    grazing = point.grazing
    assert point.parameter == pytest.approx(force, abs=2e-12 if name != "two masses" else 1e-12)
    assert grazing.apex == pytest.approx(-parameters["omega"]**2, rel=1e-12)
    np.testing.assert_allclose(grazing.s[:4], s, atol=6e-5)
    assert np.sign(grazing.births[:4]).tolist() == list(births)
    assert grazing.verdict is GrazingVerdict(verdict)
    assert grazing.confirmed
    last = grazing.confirmation[-1]
    assert last.eps == 1e-4 and last.period == period
    assert last.speed == pytest.approx(speed, rel=3e-3)
    assert point.grazing is grazing
    assert grazing.hysteresis == (verdict == "jump")


def test_impacts_of_the_overdamped_oscillator_in_closed_form():
    grazing = grazing_point(*CASES["overdamped"][:3]).grazing
    k = np.arange(1, grazing.s.size + 1)
    period = np.pi
    np.testing.assert_allclose(grazing.s, (np.exp(-0.5 * k * period) - np.exp(-2.0 * k * period)) / 1.5, rtol=1e-9)
    assert grazing.multiplier == pytest.approx(np.exp(-0.5 * period), rel=1e-13)
    # birth number of one degree of freedom: e12(nT) / det(I - E^n)
    det = (1.0 - np.exp(-0.5 * k * period)) * (1.0 - np.exp(-2.0 * k * period))
    np.testing.assert_allclose(grazing.births, (grazing.s / det)[:grazing.births.size], rtol=1e-10)
    assert grazing.admissible.all()
    assert 10 <= k[-1] <= 16  # until |E^k| < 1e-8


def test_two_masses_against_the_matrix_exponential():
    grazing = grazing_point(*CASES["two masses"][:3]).grazing
    K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -0.1 * K]])
    E = expm(A * 2.0 * np.pi / 0.9)
    h, B = np.array([0.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(grazing.E, E, atol=1e-12)
    np.testing.assert_allclose(grazing.s, [h @ np.linalg.matrix_power(E, k + 1) @ B for k in range(grazing.s.size)], atol=1e-12)
    power = np.linalg.matrix_power(E, 3)
    assert grazing.births[2] == pytest.approx(h @ np.linalg.solve(np.eye(4) - power, power @ B), rel=1e-11)


@pytest.mark.parametrize(("omega", "verdict"), [(2.0, "period_adding"), (5.0, "windows_and_chaos"), (10.0, "immediate_chaos")])
def test_overdamped_classes_by_the_leading_multiplier(omega, verdict):
    grazing = grazing_point("impact_oscillator", {"zeta": 1.25, "omega": omega}, (1.0, 120.0)).grazing
    assert grazing.verdict == verdict and grazing.multiplier == pytest.approx(np.exp(-np.pi / omega), rel=1e-12)
    assert grazing.confirmed


def test_two_sided_overdamped_touches_jump():
    grazing = grazing_point("two_sided_impact_oscillator", {"zeta": 1.25, "omega": 2.0}, (1.0, 8.0)).grazing
    half = (np.exp(-0.25 * np.pi) - np.exp(-np.pi)) / 1.5
    assert grazing.touch.symmetric and grazing.s[0] == pytest.approx(-half, rel=1e-12)
    assert grazing.verdict is GrazingVerdict.JUMP and grazing.confirmed is not False


def test_symmetric_orbit_traced_over_the_whole_period_is_classified_alike():
    system = bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=2.0, amplitude=1.0)
    orbit = bf.find_orbit(system, closure=1)
    grazing = bf.trace(orbit, "amplitude", bounds=(1.0, 4.0)).special_points.of("grazing")[0].grazing
    assert grazing.touch.symmetric and grazing.s[0] == pytest.approx(-0.8589, abs=6e-5)


def test_first_impact_helps_and_the_second_throws_back():
    grazing = grazing_point("impact_oscillator", {"zeta": 0.05, "omega": 2.2}, (0.3, 5.0)).grazing
    assert grazing.s[0] > 0.0 > grazing.s[1] and grazing.births[0] > 0.0
    assert grazing.verdict is GrazingVerdict.JUMP and not grazing.hysteresis and grazing.confirmed


SMALL_JUMPS = [("impact_oscillator", {"zeta": 0.18, "omega": 0.76, "restitution": 0.52}, (0.01, 2.0)),
               ("two_sided_impact_oscillator", {"zeta": 1.57, "omega": 0.635, "restitution": 0.86}, (0.5, 3.0)),
               ("impact_chain", {"n": 2, "damping": 0.22, "omega": 1.2285, "restitution": 0.31}, (0.1, 4.0))]


@pytest.mark.parametrize(("builder", "parameters", "bounds"), SMALL_JUMPS)
def test_how_far_a_small_jump_has_led_at_a_distance(builder, parameters, bounds):
    """Where |s_k| is small a motion is not yet thrown far at 1e-4: the map foretells its speed, simulation shows it."""
    grazing = grazing_point(builder, parameters, bounds).grazing
    assert grazing.verdict is GrazingVerdict.JUMP and grazing.confirmed
    for seen in grazing.confirmation[1:]:
        expected = grazing.expected(seen.eps)
        assert expected.first == pytest.approx(seen.first, rel=1e-12)
        if expected.small:
            assert seen.small and seen.speed == pytest.approx(expected.speed, rel=0.03)
        elif expected.speed > 15.0 * expected.first:
            assert not seen.small
    assert grazing.expected(1e-4).small


def test_expected_motion_of_the_overdamped_oscillator():
    """Period adding: the map repeats the speeds that simulation shows at every distance."""
    grazing = grazing_point(*CASES["overdamped"][:3]).grazing
    for seen in grazing.confirmation:
        assert grazing.expected(seen.eps).speed == pytest.approx(seen.speed, rel=5.0 * np.sqrt(seen.eps))
    elastic = grazing_point("bilinear_oscillator", {"omega": 0.8}, (0.05, 0.5)).grazing
    assert elastic.expected(1e-4) is None


def test_elastic_stop_goes_on_with_a_term_of_order_three_halves():
    system = bf.systems.bilinear_oscillator(amplitude=0.05, omega=0.8)
    point = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.05, 0.5)).special_points.of("grazing")[0]
    grazing = point.grazing
    assert grazing.verdict is GrazingVerdict.PERSISTENCE and grazing.confirmed
    np.testing.assert_allclose(grazing.B, [0.0, 4.0], atol=1e-12)
    gaps = []
    for eps in (1e-6, 1e-7):
        other = bf.find_orbit(system.with_parameters(amplitude=point.parameter * (1.0 + eps)), guess=point.solution)
        gaps.append(np.abs(other.state - point.solution.state * (1.0 + eps)).max())
    assert np.log10(gaps[0] / gaps[1]) == pytest.approx(1.5, abs=0.01)


def test_flat_touch_is_degenerate():
    zeta, w, sigma = 0.05, 1.5, 1.0
    G = [1.0 - (k * w)**2 + 2j * zeta * k * w for k in (1, 2)]
    force = 4.0 * sigma / 3.0 * abs(G[0])
    second = HarmonicForce(sigma / 3.0 * abs(G[1]), harmonic=2, phase=np.angle(-G[1]) - 2.0 * np.angle(G[0]))
    elements = (HarmonicForce(force), second, RigidStop(sigma, 0.7))
    system = System(1.0, 2.0 * zeta, 1.0, elements, omega=w)
    assert elements[1].amplitude == pytest.approx(2.66854100795006, rel=1e-14)
    assert elements[1].phase % (2.0 * np.pi) == pytest.approx(0.201375415345015, abs=1e-14)
    start = bf.find_orbit(system.with_parameters(**{"rigid_stop.gap": 8.0}))
    point = bf.trace(start, "rigid_stop.gap", bounds=(0.8, 9.0)).special_points.of("grazing")[0]
    assert point.parameter == pytest.approx(1.0, abs=1e-11)
    assert point.grazing.verdict is GrazingVerdict.DEGENERATE and "flat" in point.grazing.sentence
    assert point.grazing.confirmation == () and point.grazing.confirmed is None


def test_two_tops_at_once_are_a_double_grazing():
    zeta, w, sigma = 0.05, 1.5, 1.0  # A2 below -A1/4: two equal tops
    G = [1.0 - (k * w)**2 + 2j * zeta * k * w for k in (1, 2)]
    a1, a2 = 1.0, -0.5
    level = -a1**2 / (8.0 * a2) - a2
    second = HarmonicForce(-a2 / level * abs(G[1]), harmonic=2, phase=np.angle(-G[1]) - 2.0 * np.angle(G[0]))
    elements = (HarmonicForce(a1 / level * abs(G[0])), second, RigidStop(sigma, 0.7))
    system = System(1.0, 2.0 * zeta, 1.0, elements, omega=w)
    start = bf.find_orbit(system.with_parameters(**{"rigid_stop.gap": 8.0}))
    point = bf.trace(start, "rigid_stop.gap", bounds=(0.8, 9.0)).special_points.of("grazing")[0]
    assert point.parameter == pytest.approx(1.0, abs=1e-11)
    assert point.grazing.verdict is GrazingVerdict.DEGENERATE and "2 times" in point.grazing.sentence


@pytest.fixture(scope="module")
def beside_a_stick():
    """A mass touches a stop while its neighbour is stuck."""
    system = System(np.eye(2), [[0.1, -0.05], [-0.05, 0.1]], [[2.0, -1.0], [-1.0, 2.0]], [
        HarmonicForce(0.5), Coulomb(0.3, dof=1), RigidStop(2.0, 0.7)], omega=0.5)
    return bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.25, 2.0)).special_points.of("grazing")[0]


def test_grazing_on_a_stick_interval(beside_a_stick):
    """The neighbour held, one degree of freedom with stiffness 2 and damping .1 is left: its closed form."""
    top = 0.5 / abs(2.0 - 0.25 + 0.05j)
    orbit, grazing = beside_a_stick.solution, beside_a_stick.grazing
    assert 0.5 * (orbit.maximum(0) - orbit.minimum(0)) == pytest.approx(top, rel=1e-12)
    assert orbit.maximum(0) == pytest.approx(beside_a_stick.parameter, rel=1e-12) and orbit.maximum(1) == orbit.minimum(1)
    assert grazing.apex == pytest.approx(-0.25 * top, rel=1e-11)
    E = expm(np.array([[0.0, 1.0], [-2.0, -0.1]]) * 4.0 * np.pi)
    np.testing.assert_allclose(grazing.s[:3], [np.linalg.matrix_power(E, k)[0, 1] for k in (1, 2, 3)], atol=1e-12)
    assert grazing.verdict is GrazingVerdict.JUMP and grazing.confirmed


@pytest.mark.parametrize(("modulus", "verdict", "word"), [(1.0, "degenerate", "unit circle"), (0.9999, "jump", "below 0"),
                                                          (1.0001, "unstable", "1.0001")])
def test_complex_multipliers_of_modulus_near_one(beside_a_stick, modulus, verdict, word):
    touch = beside_a_stick.grazing.touch
    E = np.zeros((4, 4))
    E[np.ix_([0, 2], [0, 2])] = modulus * np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    grazing = classified(dataclasses.replace(touch, E=E))
    assert grazing.verdict == verdict and word in grazing.sentence


def test_a_multiplier_at_one_is_degenerate(beside_a_stick):
    touch = beside_a_stick.grazing.touch
    grazing = classified(dataclasses.replace(touch, E=np.diag([1.0, 1.0, 0.3, 0.2])))
    assert grazing.verdict is GrazingVerdict.DEGENERATE and "meets a fold" in grazing.sentence


def test_orbits_of_higher_sequences_and_other_kinds():
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 1.0))
    for point in branch.special_points:
        assert (point.grazing is None) == (point.kind.value != "grazing")
    assert branch.special_points.of("grazing")[0].grazing.verdict in set(GrazingVerdict)
