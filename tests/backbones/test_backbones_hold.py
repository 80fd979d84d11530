"""Backbones that Newton must not lose: stiff sliders far beyond their limit, fine beams in any unit, and what ends one."""
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc.elements import ElasticStop, Jenkins
from tests.reference.beam import beam

AMPLITUDES = np.geomspace(0.1, 1000.0, 12)


def two_masses(stiffness, limit=1.0):
    return bf.System(np.eye(2), np.zeros((2, 2)), [[2.0, -1.0], [-1.0, 1.0]], [Jenkins(stiffness, limit, dof=0)])


def describing(stiffness, limit, amplitude, mode):
    """Return omega and D of one harmonic in closed form.

    The slider is a complex stiffness N(a) (a its amplitude; the real part by the angle at which it slips, the imaginary one by
    the energy 4 L (a - L/k) of a cycle), whatever the frequency.  With z = omega^2 + i omega xi the two equations
    (2 + N - z) a - b = 0 and -a + (1 - z) b = 0 are z^2 - (3 + N) z + 1 + N = 0.
    """
    ratio = limit / (stiffness * amplitude)
    theta = np.arccos(1.0 - 2.0 * ratio)
    N = stiffness + 0j
    if ratio < 1.0:
        N = (stiffness * (theta - np.sin(theta) * np.cos(theta)) + 4j * limit * (1.0 - ratio) / amplitude) / np.pi
    root = np.sqrt((3.0 + N)**2 - 4.0 * (1.0 + N))
    z = 0.5 * (3.0 + N + (root if mode else -root))
    return np.sqrt(z.real), z.imag / (2.0 * z.real)


@pytest.mark.parametrize("mode", [0, 1])
@pytest.mark.parametrize("stiffness, limit, amplitudes", [(100.0, 1.0, AMPLITUDES), (1e4, 2.0, AMPLITUDES), (3.0, 0.1, AMPLITUDES),
                                                         (100.0, 1.0, -AMPLITUDES)])
def test_one_harmonic_of_a_stiff_slider_by_its_describing_function(stiffness, limit, amplitudes, mode):
    found = bf.backbone(two_masses(stiffness, limit), amplitudes, mode=mode, method=bf.HarmonicBalance((1,)))
    exact = np.array([describing(stiffness, limit, abs(a), mode) for a in amplitudes])
    assert found.message == "" and found.amplitude == pytest.approx(amplitudes)
    assert found.omega == pytest.approx(exact[:, 0], rel=1e-9) and found.damping == pytest.approx(exact[:, 1], rel=1e-8)


@pytest.mark.parametrize("mode", [0, 1])
def test_seven_harmonics_of_a_stiff_slider(mode):
    found = bf.backbone(two_masses(100.0), AMPLITUDES, mode=mode, method=bf.HarmonicBalance(7))
    exact = np.array([describing(100.0, 1.0, a, mode) for a in AMPLITUDES])
    assert found.message == "" and len(found.modes) == 12 and max(item.residual for item in found.modes) < 1e-12
    assert found.omega[-5:] == pytest.approx(exact[-5:, 0], rel=2e-3)  # far beyond the limit the slider is a small force
    assert found.damping[-5:] == pytest.approx(exact[-5:, 1], rel=2e-2)
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    assert found.omega[-1] == pytest.approx(golden if mode else 1.0 / golden, rel=1e-5)


# a steel beam: length, bending stiffness and mass a length, in m, kg and in mm, t
BEAMS = {"m": (1.3, 2.1e11 * 0.05 * 0.01**3 / 12.0, 7.8e3 * 5e-4), "mm": (1.3e3, 2.1e5 * 50.0 * 10.0**3 / 12.0, 7.8e-9 * 500.0)}


@pytest.mark.parametrize("unit", BEAMS)
@pytest.mark.parametrize("count, way, mode", [(4, None, 0), (14, "balance", 0), (14, "balance", 2), (40, "balance", 0),
                                              pytest.param(14, None, 0, marks=pytest.mark.slow)])
def test_linear_beams_have_one_frequency_at_all_amplitudes(count, way, mode, unit):
    M, K, names = beam(count, "clamped", *BEAMS[unit])
    system = bf.System.from_matrices(M, None, K, dofs=names)
    method = bf.HarmonicBalance(3) if way else None
    amplitudes = BEAMS[unit][0] * np.geomspace(1e-7, 1e-1, 12 if count == 14 and not mode else 3)
    found = bf.backbone(system, amplitudes, dof=system.dof("tip.uy"), mode=mode, method=method)
    exact = 1.0 / np.sqrt(eigh(M, K, eigvals_only=True)[-1 - mode])  # of the inverse: the low ones are right to rounding
    assert found.message == "" and len(found.modes) == amplitudes.size
    assert found.omega == pytest.approx(exact, rel=1e-13 * count**4 + 1e-11)
    assert np.abs(found.damping).max() < 1e-13 * count**4 + 1e-11


def test_a_backbone_begins_where_the_linear_mode_does_not_lead():
    """At 100 times its limit a slider is far from stuck; the mode is that reached from small amplitudes."""
    system = bf.systems.jenkins_oscillator()
    far = bf.backbone(system, [100.0])
    near = bf.backbone(system, np.geomspace(0.5, 100.0, 30))
    assert far.message == near.message == ""
    assert far.omega[-1] == pytest.approx(near.omega[-1], rel=1e-11)
    assert far.damping[-1] == pytest.approx(near.damping[-1], rel=1e-9)


@pytest.mark.parametrize("method", [None, bf.HarmonicBalance(5)])
def test_a_guess_that_leads_nowhere_is_a_status(method):
    """A mode of another system, overdamped or beyond a stop, as a guess: no exception, and the residual says so."""
    stop = bf.System(1.0, 0.0, 1.0, [bf.elements.RigidStop(0.5, 1.0)])
    found = bf.extended_mode(stop, 2.0, method=None)  # beyond the wall
    assert not found.success and not np.isfinite(found.residual)
    system = bf.System(1.0, 0.0, 1.0, [ElasticStop(gap=1.0, stiffness=4.0)])
    good = bf.extended_mode(system, -1.0, method=method)
    for omega, xi in ((1e-9, 0.0), (1e9, 0.0), (1.0, 1e6), (1.0, -1e6)):
        bad = replace(good, omega=omega, xi=xi)
        new = bf.extended_mode(system, -2.0, guess=bad, method=method)
        assert new.success == (new.residual < 5e-12 and new.status.value == "converged")
