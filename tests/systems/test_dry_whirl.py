"""Dry friction backward whirl without unbalance: the slipping threshold, and rolling, against closed forms (Zhang 2008, 4.2)."""
import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.compose.curve import put_at_rest, rest_slope
from bifurc.elements import ElasticStator
from bifurc.system import builder
from tests.reference import rub


@builder
def rotor(*, zeta=0.05, stiffness=25.0, friction=0.1, surface_speed=4.0):
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
    system = rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=3.0 * rate * radius)
    orbit = bf.find_orbit(system, guess=(radius, 0.0, 0.0, -rate * radius), period=2.0 * np.pi / rate)
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
    system = rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=surface_speed)
    motion = bf.simulate(system, y0, duration=5.0 * 2.0 * np.pi / rate)
    assert motion.success and len(motion.events) == 0 and motion.modes[-1] == ("roll",)
    assert np.abs(motion.final - y0).max() < 1e-10


@pytest.mark.parametrize(("zeta", "stiffness", "friction"), [(0.05, 25.0, 0.1), (0.08, 40.0, 0.2)])
def test_rolling_begins_at_its_speed(zeta, stiffness, friction):
    rate, radius = threshold(zeta, stiffness, friction)
    for factor, rolls in ((1.0 + 1e-8, True), (1.0 - 1e-8, False)):
        O, A = rolling(stiffness, factor * rate * radius)
        system = rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=factor * rate * radius)
        motion = bf.simulate(system, (A, 0.0, 0.0, -O * A), duration=1.0)
        assert motion.success and (motion.modes[0] == ("roll",)) == rolls


ROLLING = [(0.05, 25.0, 0.1, 4.0), (0.05, 25.0, 0.1, 42.0), (0.1, 60.0, 0.3, 8.0), (0.02, 5.0, 0.08, 1.8)]


@pytest.mark.parametrize(("zeta", "stiffness", "friction", "surface_speed"), ROLLING)
def test_the_rolling_orbit(zeta, stiffness, friction, surface_speed):
    rate, radius = rolling(stiffness, surface_speed)
    assert 2.0 * zeta * rate / (rate**2 - 1.0) < friction
    orbit = bf.find_orbit(rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=surface_speed),
                          guess=(1.001 * radius, 0.0, 0.0, -1.001 * rate * radius), period=2.0 * np.pi / rate)
    assert orbit.success and orbit.stable and orbit.sequence.events == 0
    assert orbit.period == pytest.approx(2.0 * np.pi / rate, abs=1e-10)
    _, y = orbit.sample(60)
    assert np.abs(np.hypot(*y[:, :2].T) - radius).max() < 1e-10
    assert np.abs(y[:, 0] * y[:, 3] - y[:, 1] * y[:, 2] + surface_speed * radius).max() < 1e-10
    # r'' + 2 zeta r' + r + stiffness (r - 1) = surface_speed^2 / r; what rolls has lost a direction
    values = np.exp(np.roots([1.0, 2.0 * zeta, stiffness + 1.0 + rate**2]) * orbit.period)
    known = np.append(values, 0.0)
    assert np.abs(np.sort_complex(known) - np.sort_complex(orbit.multipliers)).max() < 1e-10


@pytest.mark.parametrize(("zeta", "stiffness", "friction", "factor"), [(0.05, 25.0, 0.1, 2.0), (0.08, 40.0, 0.2, 2.0),
                                                                       (0.09, 50.0, 0.04, 3.0), (0.106, 53.7, 0.0638, 1.5)])
def test_the_rolling_orbit_is_followed_to_its_onset(zeta, stiffness, friction, factor):
    """There it meets the whirl that slides, which no surface speed moves: 2 zeta O = friction (O^2 - 1), unstable, beyond the same
    onset."""
    rate, radius = threshold(zeta, stiffness, friction)
    onset = rate * radius
    O, A = rolling(stiffness, factor * onset)
    orbit = bf.find_orbit(rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=factor * onset),
                          guess=(A, 0.0, 0.0, -O * A), period=2.0 * np.pi / O)
    branch = bf.trace(orbit, "surface_speed", bounds=(0.5 * onset, 1.2 * factor * onset))
    assert branch.stop_reason == ("bound", "bound")
    rows = zip(branch.column("surface_speed"), branch.column("period"), branch.column("stable"), strict=True)
    kinds = []
    for value, period, stable in rows:
        away = [abs(period - 2.0 * np.pi / each) for each in (rolling(stiffness, value)[0], rate)]
        assert min(away) < 1e-10
        if value > 1.001 * onset:
            kinds.append(bool(away[0] < away[1]))
            assert stable == kinds[-1]
    assert set(kinds) == {True, False} and np.count_nonzero(np.diff(kinds)) == 1
    point = branch.special_points[0]
    assert point.parameter == pytest.approx(onset, abs=1e-11) and abs(point.parameter - onset) <= point.error
    assert branch.column("surface_speed").min() == pytest.approx(onset, abs=1e-10)


@pytest.mark.parametrize(("zeta", "stiffness", "friction", "factor"), [
    (0.1072195468024335, 76.58466866630077, 0.0448144765942548, 1.2021594304562915), (0.101, 5.9, 0.122, 2.46),
    (0.021, 0.3, 0.283, 2.72)])
def test_the_onset_is_known_to_its_stated_error(zeta, stiffness, friction, factor):
    """Beside the onset the force grows so little that what Newton leaves of the equations, the same in all points nearby, tells."""
    rate, radius = threshold(zeta, stiffness, friction)
    onset = rate * radius
    O, A = rolling(stiffness, factor * onset)
    orbit = bf.find_orbit(rotor(zeta=zeta, stiffness=stiffness, friction=friction, surface_speed=factor * onset),
                          guess=(A, 0.0, 0.0, -O * A), period=2.0 * np.pi / O)
    point = bf.trace(orbit, "surface_speed", bounds=(0.5 * onset, 1.2 * factor * onset)).special_points[0]
    assert abs(point.parameter - onset) <= point.error < 1e-9


@pytest.mark.parametrize("rows", [0.0, 1.0, 2.0])
def test_what_a_curve_holds_is_put_on_it_with_its_derivative(rows):
    rng, h = np.random.default_rng(int(rows)), 1e-5
    for y in rng.normal(size=(20, 4)):
        circle = (*rng.normal(size=2) * 0.3, 0.8, 1.3, 0.4, rows)

        def move(y, circle=circle):
            return np.array(put_at_rest(*y, *circle))

        assert np.abs(move(y + move(y))).max() < 1e-14  # once is enough
        found = np.array([(8.0 * (move(y + h * e) - move(y - h * e)) - move(y + 2 * h * e) + move(y - 2 * h * e)) / (12.0 * h)
                          for e in np.eye(4)]).T
        place, across, speed = np.reshape(rest_slope(*y, *circle), (3, 2, 2))
        whole = np.block([[place, np.zeros((2, 2))], [across, speed]])
        assert np.abs(found - whole).max() < 1e-8 * np.abs(whole).max()
