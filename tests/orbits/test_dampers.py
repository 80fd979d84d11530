"""Periodic motions of the damped oscillator: exact orbits against a half-period map that marches no slider, and the table of
peak amplitudes (specs, Zhao & Lin 2015, section 4, with the recommended constants)."""
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import bifurc as bf
from tests.reference.damper import damped

PEAKS = {10: (1.726735, 1.727928), 50: (1.360811, 1.395364), 100: (1.165604, 1.282417), 150: (1.184304, 1.362148),
         200: (1.292366, 1.377876), 300: (1.596741, 1.418471), 400: (1.831392, 1.477271), 600: (1.831392, 1.611970),
         1000: (1.831392, 1.827594), 1100: (1.831392, 1.831392)}
SOME = [100, *(pytest.param(load, marks=pytest.mark.slow) for load in PEAKS if load != 100)]


def orbit_of(damper, load, omega):
    """Return the symmetric orbit: sliders that never slip carry no force at rest."""
    system = bf.systems.friction_damped_oscillator(damper=damper, normal_load=load, omega=omega)
    orbit = bf.find_orbit(system)
    if orbit.closure == 1:
        state = orbit.state.copy()
        state[2:][np.ptp(orbit.sample(400)[1][:, 2:], axis=0) == 0.0] = 0.0
        orbit = bf.find_orbit(system, guess=state)
    return orbit


@pytest.mark.parametrize("damper", ["macro", "micro"])
@pytest.mark.parametrize("load", [10.0, 100.0, 1000.0])
def test_orbits_are_those_of_the_half_period_map(damper, load):
    omega = 97.0
    X, phase = damped(load, damper).amplitude(omega)
    orbit = orbit_of(damper, load, omega)
    assert orbit.success and orbit.stable and orbit.closure == -1
    assert orbit.maximum(0) == pytest.approx(X, rel=1e-11)
    assert orbit.minimum(0) == pytest.approx(-X, rel=1e-11)
    at = (phase / omega) % orbit.system.period  # the load has this phase at the maximum
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    assert motion(at)[0] == pytest.approx(X, rel=1e-10) and abs(motion(at)[1]) < 1e-7 * omega * X
    assert np.allclose(motion.final, orbit.state, rtol=0.0, atol=1e-11 * omega)


def refined(damper, load):
    """Return the largest amplitude over frequency, each orbit from the one before."""
    low, middle, high = (float(x) for x in np.array([-0.02, 0.0, 0.02]) + damped(load, damper).peak(95.5, 98.0)[0])
    orbit = orbit_of(damper, load, middle)

    def size(omega):
        found = bf.find_orbit(orbit.system.with_parameters(omega=float(omega)), guess=orbit)
        assert found.success
        return -found.maximum(0)

    found = minimize_scalar(size, bracket=(low, middle, high), tol=1e-6)
    return -found.fun


@pytest.mark.slow
@pytest.mark.parametrize("load", PEAKS)
def test_the_map_gives_the_table(load):
    for damper, X in zip(("macro", "micro"), PEAKS[load], strict=True):
        assert damped(load, damper).peak(95.5, 98.0)[1] == pytest.approx(X, abs=6e-7)


@pytest.mark.parametrize("load", SOME)
def test_refined_peaks_of_exact_orbits(load):
    """Asked: 1e-5; the table has seven digits."""
    for damper, X in zip(("macro", "micro"), PEAKS[load], strict=True):
        assert refined(damper, load) == pytest.approx(X, abs=6e-7)


@pytest.mark.slow
@pytest.mark.parametrize("damper, load, X", [("macro", 116.71, 1.155779), ("micro", 95.3, 1.281491)])
def test_optimum_load(damper, load, X):
    found = minimize_scalar(lambda N: damped(N, damper).peak(95.5, 98.0)[1], bounds=(0.95 * load, 1.05 * load), method="bounded",
                            options={"xatol": 1e-4 * load})
    assert found.x == pytest.approx(load, rel=1e-3)
    assert found.fun == pytest.approx(X, abs=6e-7)


@pytest.mark.slow
def test_micro_is_flatter_and_slightly_worse_at_its_best():
    macro, micro = (np.array([damped(N, damper).peak(95.5, 98.0)[1] for N in (50, 100, 400)]) for damper in ("macro", "micro"))
    assert (micro[:2] > macro[:2]).all() and micro[2] < macro[2]
