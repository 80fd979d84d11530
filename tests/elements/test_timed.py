"""Elements that follow the excitation, against closed forms: square waves, pulses, stiffness that varies, any periodic load.

Meissner 1918, Mathieu (characteristic values as scipy has them), a gear mesh with backlash and varying stiffness.
"""
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.special import mathieu_a, mathieu_b

import bifurc as bf
from bifurc.elements import (
    ConstantForce,
    Coulomb,
    HarmonicForce,
    ParametricSpring,
    ParametricStop,
    PeriodicForce,
    Pulse,
    RigidStop,
    SquareForce,
    SquareSpring,
)


def held(stiffness, damping, force, time):
    """Return how (x, v, 1) goes on for a time under a constant force."""
    return expm(np.array([[0.0, 1.0, 0.0], [-stiffness, -damping, force], [0.0, 0.0, 0.0]]) * time)


def closed(flow):
    """Return the state (2,) that a map of (x, v, 1) leaves where it is."""
    return np.linalg.solve(np.eye(2) - flow[:2, :2], flow[:2, 2])


@pytest.mark.parametrize(("change", "damping"), [(0.4, 0.0), (0.7, 0.05), (-0.3, 0.2)])
def test_a_switched_spring_is_two_exponentials(change, damping):
    """Meissner: stiffer in the first half of a period."""
    system = bf.System(1.0, damping, 1.0, [SquareSpring(change, phase=-0.5 * math.pi)], omega=1.0)
    orbit = bf.find_orbit(system, [0.0, 0.0])
    flow = held(1.0 - change, damping, 0.0, math.pi) @ held(1.0 + change, damping, 0.0, math.pi)
    expected = np.linalg.eigvals(flow[:2, :2])
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), np.sort_complex(expected), rtol=0, atol=1e-12)
    if change == 0.4 and damping == 0.0:
        np.testing.assert_allclose(np.sort(orbit.multipliers.real), [0.805512258674, 1.241446035403], rtol=0, atol=1e-11)


@pytest.mark.parametrize(("duty", "phase", "harmonic"), [(0.5, 0.0, 1), (0.2, 0.3, 1), (0.9, -1.0, 2), (0.5, 2.0, 3)])
def test_a_square_wave_is_two_constant_forces(duty, phase, harmonic):
    omega, amplitude, damping = 0.8, 0.6, 0.1
    force = SquareForce(amplitude, harmonic=harmonic, phase=phase, duty=duty)
    system = bf.System(1.0, damping, 1.0, [force], omega=omega)
    orbit = bf.find_orbit(system)
    period = 2.0 * math.pi / (harmonic * omega)
    high, low = held(1.0, damping, amplitude, duty * period), held(1.0, damping, -amplitude, (1.0 - duty) * period)
    assert orbit.success
    middle = (-phase / (2.0 * math.pi) + 0.5 * duty) * period  # where the higher level ends
    expected = closed(high @ low)
    there = bf.simulate(system, orbit.state, duration=middle % orbit.period).final
    np.testing.assert_allclose(there, expected, rtol=0, atol=1e-12)


def test_stick_under_a_square_wave_is_told_by_its_levels():
    """Dry friction of limit .1 holds a free mass against +-.08, and not against +-.12: then it moves on for the first half of each
    level and brakes."""
    for amplitude, moves in ((0.08, False), (0.12, True)):
        system = bf.System(1.0, 0.0, 0.0, [SquareForce(amplitude), Coulomb(0.1)], omega=1.0)
        motion = bf.simulate(system, [0.0, 0.0], duration=1.0)
        assert motion.success and motion.final[0] == pytest.approx(0.5 * (amplitude - 0.1) if moves else 0.0, abs=1e-14)


@pytest.mark.parametrize(("harmonic", "phase"), [(1, 0.0), (1, 2.0), (2, 0.7), (3, -3.0)])
def test_pulses_close_with_the_free_decay_between_them(harmonic, phase):
    omega, impulse, mass, damping = 0.7, 0.4, 2.0, 0.1
    system = bf.System(mass, mass * damping, mass, [Pulse(impulse, harmonic=harmonic, phase=phase)], omega=omega)
    orbit = bf.find_orbit(system)
    period = 2.0 * math.pi / (harmonic * omega)
    behind = np.linalg.solve(np.eye(2) - held(1.0, damping, 0.0, period)[:2, :2], [0.0, impulse / mass])
    at = -phase / (2.0 * math.pi) * period % period
    pulse = min((event for event in orbit.events if event.after[1] != event.before[1]), key=lambda event: abs(event.time - at))
    assert orbit.success and pulse.kind == "clock"
    np.testing.assert_allclose(pulse.after[:2], behind, rtol=0, atol=1e-12)
    assert pulse.after[1] - pulse.before[1] == pytest.approx(impulse / mass, abs=1e-15)


def test_a_motion_that_starts_at_a_pulse_starts_behind_it():
    system = bf.System(1.0, 0.0, 0.0, [Pulse(0.3)], omega=2.0 * math.pi)
    motion = bf.simulate(system, [0.0, 0.1], duration=1.5)
    assert motion.final == pytest.approx([0.1 + 0.5 * 0.4, 0.4], abs=1e-14)


def test_branches_of_pulses_against_a_stop_repeat():
    system = bf.System(1.0, 0.1, 1.0, [Pulse(0.4), RigidStop(0.5)], omega=0.7)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 1.0))
    assert branch.audit.ok and {"grazing", "period_doubling", "fold"} <= {point.kind.value for point in branch.special_points}


@pytest.mark.parametrize("q", [0.4, 1.0])
def test_the_tongues_of_mathieu(q):
    """x'' + (a - 2 q cos 2 t) x: period 2 pi at the odd characteristic values, pi at the even ones."""
    system = bf.System(1.0, 0.0, 0.0, [ParametricSpring(-2.0 * q, stiffness=2.2)], omega=2.0)
    branch = bf.trace(bf.find_orbit(system, [0.0, 0.0]), "parametric_spring.stiffness", bounds=(-1.0, 2.2))
    assert branch.audit.ok
    found = [(point.kind.value, point.parameter) for point in branch.special_points]
    assert [kind for kind, _ in found] == ["branch_point", "period_doubling", "period_doubling"]
    np.testing.assert_allclose([at for _, at in found], [mathieu_a(0, q), mathieu_b(1, q), mathieu_a(1, q)], rtol=0, atol=1e-10)


def test_mathieu_at_a_deep_modulation():
    system = bf.System(1.0, 0.0, 0.0, [ParametricSpring(-10.0, stiffness=-6.5)], omega=2.0)
    branch = bf.trace(bf.find_orbit(system, [0.0, 0.0]), "parametric_spring.stiffness", bounds=(-6.5, -5.5))
    flips = [point.parameter for point in branch.special_points if point.kind == "period_doubling"]
    assert np.abs(np.array(flips) - mathieu_b(1, 5.0)).min() < 1e-9


def test_a_damped_parametric_spring_keeps_liouvilles_product():
    """Whatever the stiffness does, the determinant of the map over a period is exp(-c T)."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]],
                       [ParametricSpring(0.8, row=(1.0, -1.0)), HarmonicForce(0.3)], omega=1.1)
    orbit = bf.find_orbit(system)
    assert orbit.success
    assert np.prod(orbit.multipliers).real == pytest.approx(math.exp(-0.2 * 2.0 * math.pi / 1.1), rel=1e-11)


def mesh(omega=0.9):
    """Teeth with backlash: x'' + .06 x' + (1 + .2 cos omega t) f(x) = .2, f zero for |x| < 1."""
    return bf.System(1.0, 0.06, 0.0, [ConstantForce(0.2), ParametricStop(1.0, 1.0, variation=0.2),
                                      ParametricStop(1.0, 1.0, side=-1, variation=0.2)], omega=omega)


def test_a_gear_mesh_with_backlash():
    orbit = bf.find_orbit(mesh(), [1.4, -0.28])
    assert orbit.success
    np.testing.assert_allclose(orbit.state, [1.408385547164, -0.277831474394], rtol=0, atol=1e-9)
    np.testing.assert_allclose([event.time for event in orbit.events], [1.191280702714, 4.167176713012], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.sort(orbit.multipliers.imag), [-0.605049925, 0.605049925], rtol=0, atol=1e-8)
    branch = bf.trace(orbit, "omega", bounds=(0.7, 1.2))
    assert branch.audit.ok and [point.kind.value for point in branch.special_points] == ["grazing"]


@pytest.mark.parametrize("element", [SquareForce(0.5), SquareForce(0.5, duty=0.3, harmonic=2), SquareSpring(0.3, phase=0.4),
                                     ParametricSpring(0.3), Pulse(0.4, phase=1.0), PeriodicForce((0.3, 0.0, 0.2), (0.1,), 0.05),
                                     ParametricStop(0.2, 2.0, variation=0.6, variation_phase=0.3, amplitude=0.1, harmonic=1)])
def test_their_images_move_as_images_do(element):
    """What `mirrored` says: the negative of a motion, half a period later, is one of the image."""
    def system(parts):
        return bf.System(1.0, 0.1, 1.0, parts, omega=1.3)

    half, start = math.pi / 1.3, np.array([0.25, -0.1])
    motion = bf.simulate(system([element, HarmonicForce(0.2)]), start, duration=5.0)
    image = bf.simulate(system([element.mirrored(), HarmonicForce(0.2)]), -start, t0=half, duration=5.0)
    np.testing.assert_allclose(image.final, -motion.final, rtol=0, atol=1e-11)


def test_a_periodic_force_has_the_values_of_its_function():
    def load(theta):
        return math.exp(math.cos(theta)) * math.sin(theta + 0.4)

    theta = np.linspace(0.0, 2.0 * np.pi, 37)
    force = PeriodicForce.of(load, amplitude=0.7, phase=0.3)
    np.testing.assert_allclose(force.values(theta), [0.7 * load(at + 0.3) for at in theta], rtol=0, atol=1e-11)
    # the answer of an oscillator is the sum over its history
    system = bf.System(1.0, 0.2, 1.0, [force], omega=1.3)
    motion = bf.simulate(system, [0.0, 0.0], duration=4.0)
    w = math.sqrt(0.99)
    answer = quad(lambda t: 0.7 * load(1.3 * t + 0.3) * math.exp(-0.1 * (4.0 - t)) * math.sin(w * (4.0 - t)) / w, 0, 4,
                  epsabs=1e-13, epsrel=1e-13)[0]
    assert motion.final[0] == pytest.approx(answer, abs=1e-12)


def test_a_table_is_met_at_its_phases():
    values = np.random.default_rng(3).normal(size=15)
    force = PeriodicForce.of(values)
    np.testing.assert_allclose(force.values(2.0 * np.pi * np.arange(15) / 15), values, rtol=0, atol=1e-12)
    assert len(force.cosines) == 7


@pytest.mark.parametrize(("given", "said"), [
    (dict(load=lambda theta: theta), "must have the period"), (dict(load=lambda theta: abs(math.sin(theta))), "harmonics leave"),
    (dict(load=lambda theta: 1.0 / math.sin(theta)), "raised ZeroDivisionError"), (dict(load=[1.0, 2.0]), "at least three"),
    (dict(load=[1.0, math.nan, 2.0]), "at least three"), (dict(load=lambda theta: "a"), "at least three"),
    (dict(load=[1.0, 2.0, 3.0], harmonics=0), "harmonics = 0"), (dict(load=[1.0, 2.0, 3.0], error=0.0), "error = 0")])
def test_loads_that_are_none_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        PeriodicForce.of(**given)


def test_a_corner_needs_a_larger_error():
    force = PeriodicForce.of(lambda theta: abs(math.sin(theta)), error=0.02)
    theta = np.linspace(0.0, 2.0 * np.pi, 1001)
    left = np.abs(force.values(theta) - np.abs(np.sin(theta))).max()
    assert 1e-3 < left < 0.021 and len(force.cosines) <= 34


@pytest.mark.parametrize("made", [lambda: SquareForce(duty=1.0), lambda: SquareSpring(duty=0.0), lambda: Pulse(harmonic=0),
                                  lambda: ParametricSpring(harmonic=0), lambda: ParametricStop(variation_harmonic=0),
                                  lambda: ParametricStop(release="force"), lambda: PeriodicForce(cosines=())])
def test_bad_values_are_refused_by_name(made):
    with pytest.raises(ValueError, match=r"(SquareForce|SquareSpring|Pulse|ParametricSpring|ParametricStop|PeriodicForce): \w+ = "):
        made()


def test_a_reversal_meets_the_switch_at_the_damped_frequency():
    """Between levels a motion with dry friction decays with its own frequency: where an odd number of its halves fills that of a
    level, it turns just when the level changes."""
    system = bf.System(1.0, 0.02, 1.0, [SquareForce(0.4), Coulomb(0.1)], omega=1.3)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.3, 2.0))
    met = [point for point in branch.special_points if point.kind == "border_collision"]
    own = math.sqrt(1.0 - 0.01**2)
    assert branch.audit.ok and [point.parameter for point in met] == pytest.approx([own / 3.0, own], abs=1e-12)
