"""Nonlinear modes over amplitude: closed forms with friction and without losses, exact decay, forced peaks."""
import numpy as np
import pytest
from scipy.special import ellipk

import bifurc as bf
from bifurc.backbones.modes import unloaded

EXACT = {2.0: (1.2258676901977, 0.113910367633112, 2.0007678091915, 0.982818583692610, 4.69463388998456),
         1.2: (1.37476086704814, 0.0536866555519206, 1.20469838397763, 0.978210062845716, 4.46658642328742)}


@pytest.mark.parametrize("amplitude", EXACT)
def test_extended_periodic_motion_of_a_slider_by_exact_arcs(amplitude):
    omega, damping, first, _, _ = EXACT[amplitude]
    found = bf.extended_mode(bf.systems.jenkins_oscillator(), amplitude)
    assert found.success
    np.testing.assert_allclose((found.omega, found.damping, found.first_harmonic), (omega, damping, first), rtol=1e-10)


@pytest.mark.parametrize("amplitude", EXACT)
def test_extended_periodic_motion_of_a_slider_in_one_harmonic(amplitude):
    found = bf.extended_mode(bf.systems.jenkins_oscillator(), amplitude, method=bf.HarmonicBalance(harmonics=(1,)))
    theta = np.arccos(1.0 - 2.0 / amplitude)
    square = 1.0 + (theta - np.sin(theta) * np.cos(theta)) / np.pi
    damping = 0.01 / np.sqrt(square) + 2.0 * (amplitude - 1.0) / (np.pi * square * amplitude**2)
    np.testing.assert_allclose((found.omega, found.damping), (np.sqrt(square), damping), rtol=1e-12)


def test_twenty_one_harmonics_are_near_the_exact_motion():
    omega, damping = EXACT[1.2][:2]
    found = bf.extended_mode(bf.systems.jenkins_oscillator(), 1.2, method=bf.HarmonicBalance(harmonics=21))
    assert found.success
    np.testing.assert_allclose((found.omega, found.damping), (omega, damping), atol=1e-5)


def test_only_the_difference_of_the_dampings_enters_the_motion():
    one, other = (bf.extended_mode(bf.systems.jenkins_oscillator(zeta=zeta), 2.0) for zeta in (0.01, 0.07))
    assert one.omega == pytest.approx(other.omega, rel=1e-12)
    assert one.xi - 0.02 == pytest.approx(other.xi - 0.14, rel=1e-10)


@pytest.mark.parametrize("amplitude", EXACT)
def test_free_decay_from_the_upper_peak(amplitude):
    _, _, _, peak, time = EXACT[amplitude]
    motion = bf.simulate(unloaded(bf.systems.jenkins_oscillator()), (amplitude, 0.0, amplitude - 1.0), duration=6.0)
    assert motion(time)[0] == pytest.approx(peak, abs=1e-11) and abs(motion(time)[1]) < 1e-11


def test_a_mode_is_the_forced_motion_at_phase_resonance():
    """A force xi omega a in quadrature holds the same single harmonic that the negative damping holds."""
    mode = bf.extended_mode(bf.systems.jenkins_oscillator(), 2.0, method=bf.HarmonicBalance(harmonics=(1,)))
    forced = bf.systems.jenkins_oscillator(omega=mode.omega, amplitude=mode.xi * mode.omega * 2.0)
    orbit = bf.find_orbit(forced, method=bf.HarmonicBalance(harmonics=(1,)))
    h = orbit.harmonic(1)
    assert abs(h) == pytest.approx(2.0, rel=1e-11) and np.angle(h) == pytest.approx(-0.5 * np.pi, abs=1e-11)


def test_duffing_by_elliptic_integrals():
    amplitudes = np.array([0.1, 0.4, 1.0])
    found = bf.backbone(bf.systems.duffing_oscillator(zeta=0.0), amplitudes)
    exact = np.pi * np.sqrt(1.0 + amplitudes**2) / (2.0 * ellipk(amplitudes**2 / (2.0 * (1.0 + amplitudes**2))))
    np.testing.assert_allclose(found.omega, exact, rtol=1e-12)
    assert found.omega[-1] == pytest.approx(1.31777606496553, abs=1e-13)
    assert not found.damping.any() and found.message == ""


@pytest.mark.parametrize("gap, omega", [(0.5, 1.170543785998911), (0.0, 1.381966011250105), (-0.3, 1.546765481832777)])
def test_bilinear_free_vibration(gap, omega):
    found = bf.extended_mode(bf.System(1.0, 0.0, 1.0, (bf.elements.ElasticStop(gap, 4.0),)), -1.0)
    assert found.success and found.omega == pytest.approx(omega, rel=1e-12) and found.xi == 0.0


@pytest.mark.parametrize("gap, omega", [(0.5, 1.5), (-0.5, 3.0)])
def test_free_vibration_against_an_elastic_impact(gap, omega):
    found = bf.extended_mode(bf.System(1.0, 0.0, 1.0, (bf.elements.RigidStop(gap, 1.0),)), -1.0)
    assert found.success and found.omega == pytest.approx(omega, rel=1e-11)


@pytest.mark.parametrize("omega, first, second", [(0.633855140326657, 0.652884687101919, 1.0527021489722),
                                                  (0.698291119726815, 0.918719990713214, 1.22813087593356),
                                                  (0.748744010746782, 1.70901518365391, 1.44991918509209)])
def test_mode_of_a_chain_with_a_stop(omega, first, second):
    chain = bf.System(np.eye(2), np.zeros((2, 2)), [[2.0, -1.0], [-1.0, 1.0]], (bf.elements.ElasticStop(1.0, 5.0, dof=1),))
    found = bf.backbone(chain, np.linspace(0.5, first, 5)).modes[-1]
    assert found.omega == pytest.approx(omega, rel=1e-10)
    assert found.state[1] == pytest.approx(second, rel=1e-9)


def test_bad_arguments_are_named():
    system = bf.systems.jenkins_oscillator()
    with pytest.raises(ValueError, match="amplitude = 0.0"):
        bf.extended_mode(system, 0.0)
    with pytest.raises(ValueError, match="dof = 1"):
        bf.extended_mode(system, 1.0, dof=1)
    with pytest.raises(ValueError, match="one sign"):
        bf.backbone(system, [-1.0, 1.0])
    with pytest.raises(ValueError, match="rests with a rigid constraint"):
        bf.extended_mode(bf.systems.dry_friction_oscillator(), 1.0)


def test_pictures():
    left, right = bf.backbone(bf.systems.jenkins_oscillator(), [0.5, 1.5]).plot()
    assert left.get_xlabel() and right.get_ylabel()
