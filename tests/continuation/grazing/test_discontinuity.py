"""Discontinuity maps against exact root finding: orders of the errors and coefficients."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.grazing import section_map, zero_time_map
from bifurc.continuation.grazing.discontinuity import order
from bifurc.elements import ElasticStop, HarmonicForce
from bifurc.system import System
from tests.reference import low_impact

DEPTHS = {"rigid": (1e-6, 1e-7, 1e-8), "elastic": (1e-4, 1e-5, 1e-6)}


def touch_of(system, bounds):
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=bounds)
    return branch.special_points.of("grazing")[0].grazing.touch


@pytest.fixture(scope="module")
def rigid():
    return touch_of(bf.systems.impact_oscillator(zeta=0.05, omega=2.5, amplitude=0.5), (0.5, 6.0))


@pytest.fixture(scope="module")
def elastic():
    elements = (HarmonicForce(0.4), ElasticStop(1.0, 3.0, 0.4))
    system = System(1.0, 0.2, 1.0, elements, omega=1.7)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.4, 3.0))
    return branch.special_points.of("grazing")[0].grazing.touch


def slopes(errors, which):
    return np.diff(np.log(np.abs(errors)), axis=0) / np.diff(np.log(DEPTHS[which]))[:, None]


def case(touch, zeta, w):
    """Exact amplitude of the touching orbit's load, and an apex time aside of it, where the jerk is not zero."""
    force = float(touch.x[-1])
    return {"zeta": zeta, "w": w, "force": force, "gap": 1.0}, touch.time + 0.05


@pytest.mark.parametrize("which", ["rigid", "elastic"])
def test_error_of_the_zero_time_map_has_its_order_in_position_and_speed(which, request):
    touch = request.getfixturevalue(which)
    given, t = case(touch, *((0.05, 2.5) if which == "rigid" else (0.1, 1.7)))
    contact = {"r": 0.7} if which == "rigid" else {"k": 3.0, "c": 0.4}
    errors = []
    for psi in DEPTHS[which]:
        y = np.array([1.0 + psi, 0.0])
        exact = low_impact.zero_time(**given, y=y, t=t, **contact)
        errors.append([float(exact[i] - zero_time_map(touch, y, t)[i]) for i in range(2)])
    assert order(touch) == (1.5 if which == "rigid" else 2.0)
    np.testing.assert_allclose(slopes(errors, which), order(touch), atol=0.02)


@pytest.mark.parametrize("which", ["rigid", "elastic"])
def test_error_of_the_section_map_has_its_order(which, request):
    touch = request.getfixturevalue(which)
    given, t = case(touch, *((0.05, 2.5) if which == "rigid" else (0.1, 1.7)))
    contact = {"r": 0.7} if which == "rigid" else {"k": 3.0, "c": 0.4}
    errors = []
    for psi in DEPTHS[which]:
        y = np.array([1.0 + psi, 0.0])
        state, time = section_map(touch, y, t)
        exact, at = low_impact.section(**given, y=y, t=t, guess=time - t, **contact)
        errors.append([float(exact[0] - state[0]), float(at) - time])
    found = slopes(errors, which)
    assert np.all(found >= order(touch) - 0.03), found


def test_coefficient_of_the_square_root_is_exact(rigid):
    given, t = case(rigid, 0.05, 2.5)
    psi = 1e-10
    y = np.array([1.0 + psi, 0.0])
    psi = y[0] - 1.0
    exact = low_impact.zero_time(**given, y=y, t=t, r=0.7)
    acceleration = given["force"] * math.cos(2.5 * t) - y[0]
    assert zero_time_map(rigid, y, t)[1] / math.sqrt(psi) == pytest.approx(float(exact[1]) / math.sqrt(psi), rel=1e-9)
    leading = -(1.7) * math.sqrt(2.0 * abs(acceleration))
    assert zero_time_map(rigid, y, t)[1] / math.sqrt(psi) == pytest.approx(leading, rel=3e-5)


def test_position_behind_a_low_impact_is_minus_one_plus_two_r_times_the_depth(rigid):
    y = np.array([1.0 + 1e-8, 0.0])
    psi = y[0] - 1.0
    assert (zero_time_map(rigid, y, rigid.time)[0] - 1.0) / psi == pytest.approx(-(1.0 + 2.0 * 0.7), rel=1e-7)


def test_coefficient_of_a_short_contact_is_exact(elastic):
    given, t = case(elastic, 0.1, 1.7)
    y = np.array([1.0 + 1e-6, 0.0])
    psi, pieces = y[0] - 1.0, []
    for depth in (1e-6, 0.25e-6, 0.0625e-6):  # extrapolated in the square root of the depth
        y = np.array([1.0 + depth, 0.0])
        psi = low_impact.mp.mpf(y[0]) - 1
        exact = low_impact.zero_time(**given, y=y, t=t, k=3.0, c=0.4)
        pieces.append([float((exact[i] - low_impact.mp.mpf(y[i])) / psi**1.5) for i in range(2)])
    a, b, c = np.array(pieces)
    first, second = 2.0 * b - a, 2.0 * c - b
    limit = (4.0 * second - first) / 3.0
    acceleration = given["force"] * math.cos(1.7 * t) - 1.0
    size = 4.0 * math.sqrt(2.0) / 3.0 / math.sqrt(abs(acceleration))
    # spring k and dashpot c: -(k b + c A b), b = (0, 1), A b = (1, -2 zeta)
    expected = -size * np.array([0.4, 3.0 - 0.4 * 0.2])
    np.testing.assert_allclose(limit, expected, rtol=2e-9)
    np.testing.assert_allclose(elastic.B, [0.4, 3.0 - 0.4 * 0.2], rtol=1e-12)


def test_a_motion_that_does_not_reach_the_stop_is_left_alone(rigid):
    y = np.array([0.9, 0.1])
    np.testing.assert_array_equal(zero_time_map(rigid, y, 0.3), y)
    with pytest.raises(ValueError, match="shape"):
        zero_time_map(rigid, np.zeros(3), 0.0)
    with pytest.raises(ValueError, match="no maximum"):
        zero_time_map(rigid, np.array([1.0 + 1e-6, 0.0]), 0.0 * rigid.time)
