"""Dry friction backward whirl without unbalance: the slipping threshold, and rolling, against closed forms (Zhang 2008, 4.2)."""
import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.elements import ElasticStator
from tests.reference import rub


def rotor(zeta, stiffness, friction, surface_speed):
    """Return the rotor without unbalance in the fixed frame: nothing in it has a clock."""
    stator = ElasticStator(stiffness=stiffness, friction=friction, surface_speed=surface_speed, label="stator")
    return bf.System(np.eye(2), 2.0 * zeta * np.eye(2), np.eye(2), [stator])


def threshold(zeta, stiffness, friction):
    """Return rate and radius of the slipping whirl."""
    rate = zeta / friction + np.sqrt(1.0 + (zeta / friction) ** 2)
    return rate, 1.0 / (1.0 - 2.0 * zeta * rate / (friction * stiffness))


def rolling(stiffness, surface_speed):
    """Return rate and radius of the rolling whirl: rate radius = surface speed, radius = stiffness / (stiffness + 1 - rate^2)."""
    rate = brentq(lambda O: O * stiffness - surface_speed * (stiffness + 1.0 - O * O), 0.0, np.sqrt(stiffness + 1.0), xtol=1e-15)
    return rate, stiffness / (stiffness + 1.0 - rate * rate)


@pytest.mark.parametrize(("zeta", "stiffness", "friction"), [(0.05, 25.0, 0.1), (0.08, 40.0, 0.2), (0.03, 10.0, 0.05)])
def test_the_slipping_whirl_is_the_unstable_threshold(zeta, stiffness, friction):
    rate, radius = threshold(zeta, stiffness, friction)
    if (zeta, stiffness, friction) == (0.05, 25.0, 0.1):
        assert (rate, radius, rate * radius / 20.0) == pytest.approx((1.6180339887498949, 1.0692000830, 0.0865001037536), abs=1e-10)
    orbit = bf.find_orbit(rotor(zeta, stiffness, friction, 3.0 * rate * radius), guess=(radius, 0.0, 0.0, -rate * radius),
                          period=2.0 * np.pi / rate)
    assert orbit.success and orbit.stable is False
    assert orbit.period == pytest.approx(2.0 * np.pi / rate, abs=1e-10)
    assert np.abs(np.hypot(*orbit.sample(40)[1][:, :2].T) - radius).max() < 1e-10
    values = rub.rotating_eigenvalues(np.array([radius, 0.0, 0.0, 0.0]), zeta=zeta, nu=-rate, eccentricity=0.0,
                                      stiffness=stiffness, friction=friction)
    known = np.exp(values[np.abs(values) > 1e-7] * orbit.period)  # without the shift along the whirl
    assert np.abs(np.sort_complex(known) - np.sort_complex(orbit.multipliers)).max() < 1e-8


@pytest.mark.parametrize(("zeta", "stiffness", "friction", "surface_speed"), [(0.05, 25.0, 0.1, 4.0), (0.05, 25.0, 0.1, 42.0),
                                                                            (0.1, 60.0, 0.3, 8.0)])
def test_rolling(zeta, stiffness, friction, surface_speed):
    rate, radius = rolling(stiffness, surface_speed)
    ratio = 2.0 * zeta * rate / (rate**2 - 1.0)
    assert ratio < friction
    y0 = np.array([radius, 0.0, 0.0, -rate * radius])
    motion = bf.simulate(rotor(zeta, stiffness, friction, surface_speed), y0, duration=5.0 * 2.0 * np.pi / rate)
    assert motion.success and len(motion.events) == 0 and motion.modes[-1] == ("roll",)
    assert np.abs(motion.final - y0).max() < 1e-10


@pytest.mark.parametrize(("zeta", "stiffness", "friction"), [(0.05, 25.0, 0.1), (0.08, 40.0, 0.2)])
def test_rolling_begins_at_its_speed(zeta, stiffness, friction):
    rate, radius = threshold(zeta, stiffness, friction)
    for factor, rolls in ((1.0 + 1e-8, True), (1.0 - 1e-8, False)):
        O, A = rolling(stiffness, factor * rate * radius)
        motion = bf.simulate(rotor(zeta, stiffness, friction, factor * rate * radius), (A, 0.0, 0.0, -O * A), duration=1.0)
        assert motion.success and (motion.modes[0] == ("roll",)) == rolls
