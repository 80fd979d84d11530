"""Touches of a linear motion that only just reaches its stop: instant, state, rates, kick and linear map in closed form."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.continuation.grazing.following import Touching, stationary, touching
from bifurc.continuation.grazing.touch import every_touch, maxima, rates, touch_at
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.system import System

ZETA, W, F = 0.07, 1.3, 0.8
LINEAR = np.array([[0.0, 1.0], [-1.0, -2.0 * ZETA]])
PHASOR = F / (1.0 - W * W + 2j * ZETA * W)  # q = Re(PHASOR exp(i W t)) under F cos W t
SIZE = math.hypot(PHASOR.real, PHASOR.imag)
TOP = SIZE * (1.0 + 1e-10)  # of the stop: one that is met by rounding is an event


def problem_of(*stops):
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), *stops), omega=W)
    orbit = bf.find_orbit(system, guess=(PHASOR.real, -W * PHASOR.imag))  # impacts are other motions
    problem = orbit_problem(orbit, "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    return problem, problem.x0


@pytest.mark.parametrize("gap, count", [(TOP, 1), (TOP * (1.0 + 1e-3), 0)])
def test_the_one_touch_of_a_linear_motion(gap, count):
    problem, x = problem_of(RigidStop(gap, 0.6))
    found = every_touch(problem, x)
    assert len(found) == count
    if not count:
        [(tau, mode, guard, value, y)] = maxima(problem, x, [])
        assert value == pytest.approx((TOP - gap) / problem.weights[0], rel=1e-6)
        assert not list(maxima(problem, x, [(tau, mode, guard)]))  # it is known
        assert not list(maxima(problem, x, [], nearby=1e-4))  # too far
        return
    touch = touch_at(problem, x, *found[0])
    period = 2.0 * np.pi / W
    assert touch.time % period == pytest.approx((-np.angle(PHASOR) / W) % period, abs=1e-7)
    np.testing.assert_allclose(touch.state, [TOP, 0.0], atol=1e-7)
    np.testing.assert_allclose(touch.h, [1.0, 0.0])
    np.testing.assert_allclose(touch.B, [0.0, 1.0])
    assert touch.apex == pytest.approx(-W * W * TOP, rel=1e-9) and touch.jerk == pytest.approx(0.0, abs=1e-6)
    assert touch.restitution == pytest.approx(0.6) and not touch.symmetric and touch.contact is None
    np.testing.assert_allclose(touch.E, expm(LINEAR * period), atol=1e-12)
    t = touch.time + 0.3
    joined = touch.joined(touch.state, t)
    np.testing.assert_allclose(joined, [*touch.state, 1.0, math.cos(W * t), math.sin(W * t)], atol=1e-15)


def test_rates_of_a_guard_anywhere_on_a_motion():
    """Second and third derivative: of the equation of motion, with and without a law."""
    for beta in (0.0, 0.4):
        elements = (RigidStop(2.0 * TOP, 0.6), *((CubicSpring(beta),) if beta else ()))
        system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), *elements), omega=W)
        problem = orbit_problem(bf.find_orbit(system), "omega", (0.9 * W, 1.1 * W))
        e, T = problem.equations, problem.equations.numbers_at(W)
        for t, q, v in ((0.3, 0.2, -0.5), (2.0, -0.7, 0.4)):
            joined = np.concatenate([[q, v], problem.scene.forcing(np.array([t]))[0]])
            force, dforce = F * math.cos(W * t), -F * W * math.sin(W * t)
            a = force - 2.0 * ZETA * v - q - beta * q**3
            jerk = dforce - 2.0 * ZETA * a - v - 3.0 * beta * q * q * v
            np.testing.assert_allclose(rates(e, T, 0, 0, joined), (a, jerk), rtol=1e-6 if beta else 1e-12)


@pytest.mark.parametrize("k, c", [(3.0, 0.4), (0.5, 0.0)])
def test_what_a_soft_contact_changes_is_its_spring_and_its_dashpot_in_the_positions(k, c):
    """-(k b + c A b) with b = (0, -1): the depth d pushes by -(k d + c d')."""
    problem, x = problem_of(ElasticStop(TOP, k, c))
    touch = touch_at(problem, x, *every_touch(problem, x)[0])
    assert touch.restitution is None and touch.contact is not None
    b = np.array([0.0, 1.0])
    np.testing.assert_allclose(touch.B, k * b + c * LINEAR @ b, atol=1e-12)


def test_a_stop_on_either_side_is_touched_in_turn():
    problem, x = problem_of(RigidStop(TOP, 0.6), RigidStop(TOP, 0.6, side=-1))
    half = problem.sequence.closure < 0
    found = every_touch(problem, x)
    assert len(found) == (1 if half else 2)
    touch = touch_at(problem, x, *found[0])
    assert touch.symmetric == half
    time = np.pi / W if half else 2.0 * np.pi / W
    np.testing.assert_allclose(touch.E, (-1.0 if half else 1.0) * expm(LINEAR * time), atol=1e-12)


def test_a_touch_that_is_followed_is_the_maximum_of_the_motion():
    """The value is (amplitude - gap) in natural size, and grows with the load like the amplitude."""
    problem, x = problem_of(RigidStop(TOP, 0.6))
    other, at, item = touching(problem, x)
    condition = Touching(other, at, item)
    for share in (0.97, 1.0, 1.02):
        moved = np.append(at[:-1], at[-1])
        moved[1:3] *= share
        moved[-1] *= share
        value, tau = condition.top(other, moved)
        assert value == pytest.approx((share * SIZE - TOP) / problem.weights[0], abs=1e-12)
        assert (tau - item[0] + 0.5) % 1.0 - 0.5 == pytest.approx(0.0, abs=1e-6)
        assert condition.apex(other, moved, tau) == pytest.approx(-W * W * share * TOP, rel=1e-8)
    t = 2.0 * np.pi / W * (item[0] + 0.01)
    q = SIZE * np.cos(W * t + np.angle(PHASOR))
    series = condition.series(other, at, item[0] + 0.01)
    v = -W * SIZE * np.sin(W * t + np.angle(PHASOR))
    np.testing.assert_allclose(series[:5], [q - TOP, v, -W * W * q / 2.0, -W * W * v / 6.0, W**4 * q / 24.0], atol=1e-12)
    values = condition.values(other, at)
    eye, E = np.eye(2), expm(LINEAR * 2.0 * np.pi / W)
    assert values[0] == pytest.approx(-W * W * TOP / (problem.weights[0] * max(1.0, W * W)), rel=1e-8)
    assert values[1] == -1.0  # there is no other maximum
    assert values[2:4] == pytest.approx([np.linalg.det(E - eye), np.linalg.det(E + eye)], abs=1e-12)
    powers, M = [], np.eye(2)
    for _ in range(6):
        M = M @ E
        powers.append(M[0, 1])  # h E^k B
    ratio = np.array(values[4:]) / powers[:len(values[4:])]
    np.testing.assert_allclose(ratio, np.full(6, ratio[0]), rtol=1e-9)
    assert ratio[0] > 0.0


@pytest.mark.parametrize("unit", [1e-10, 1.0, 1e8])
@pytest.mark.parametrize("second", [0.0, 1e-3, 0.1])
def test_the_bend_at_the_top_is_that_of_the_motion_in_any_unit_of_time(unit, second):
    """Two harmonics: where the second is there, the motion is not symmetric about its top, by however little."""
    loads, phases = {1: F, 2: second}, {1: 0.0, 2: 0.9}
    q = {k: loads[k] * np.exp(1j * phases[k]) / (1.0 - (k * W)**2 + 2j * ZETA * k * W) for k in loads}

    def motion(t, order=0):
        return sum(float(((1j * k * W)**order * q[k] * np.exp(1j * k * W * t)).real) for k in q)
    t = -np.angle(q[1]) / W
    for _ in range(20):
        t -= motion(t, 1) / motion(t, 2)
    elements = [HarmonicForce(loads[k] * unit**2, harmonic=k, phase=phases[k], label=f"load{k}") for k in loads if loads[k]]
    system = System(1.0, 2.0 * ZETA * unit, unit**2, (*elements, RigidStop(motion(t) * (1.0 + 1e-10), 0.6)), omega=W * unit)
    orbit = bf.find_orbit(system, guess=(motion(0.0), motion(0.0, 1) * unit))
    problem = orbit_problem(orbit, "load1.amplitude", (0.5 * F * unit**2, 2.0 * F * unit**2))
    other, at, item = touching(problem, problem.x0)
    condition = Touching(other, at, item)
    value, tau = condition.top(other, at)
    assert value == pytest.approx(0.0, abs=1e-9)
    assert condition.apex(other, at, tau) / unit**2 == pytest.approx(motion(t, 2), rel=1e-9)


@pytest.mark.parametrize("shift", [0.0, 0.3, -0.2])
def test_the_stationary_point_next_to_the_origin(shift):
    """Of (t - shift)^2 (1 + t) + 2; no farther than the reach, on the side where it lies."""
    a = np.polynomial.polynomial.polyadd(np.polynomial.polynomial.polymul([shift**2, -2.0 * shift, 1.0], [1.0, 1.0]), [2.0])
    assert stationary(a, 1.0) == pytest.approx(shift, abs=1e-14)
    if shift:
        assert stationary(a, 0.1) == math.copysign(0.1, shift)
    assert stationary(np.array([1.0, 2.0]), 0.5) == 0.0  # a line has none


def test_two_tops_of_one_motion_are_two_touches_in_order_of_time():
    P = F / (1.0 - 4.0 * W * W + 4j * ZETA * W)
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F, harmonic=2), RigidStop(abs(P) * (1.0 + 1e-10), 0.6)), omega=W)
    orbit = bf.find_orbit(system, guess=(P.real, -2.0 * W * P.imag), periods=1)
    problem = orbit_problem(orbit, "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    found = every_touch(problem, problem.x0)
    assert len(found) == 2
    np.testing.assert_allclose(found[1][0] - found[0][0], 0.5, atol=1e-7)
    for item in found:
        touch = touch_at(problem, problem.x0, *item)
        np.testing.assert_allclose(touch.state, [abs(P), 0.0], atol=1e-6)
        np.testing.assert_allclose(touch.E, expm(LINEAR * 2.0 * np.pi / W), atol=1e-12)
    known = [item[:3] for item in found]
    assert not list(maxima(problem, problem.x0, known)) and len(list(maxima(problem, problem.x0, known[:1]))) == 1


@pytest.mark.parametrize("phase", [-0.8, 0.0, 0.8])
def test_beside_the_top_that_touches_the_highest_of_the_others_is_told(phase):
    """q = Re(P1 exp(i W t) + P3 exp(3 i W t)) has three tops of different heights."""
    f3 = 6.0
    P3 = f3 * np.exp(1j * phase) / (1.0 - 9.0 * W * W + 6j * ZETA * W)

    def motion(t, order=0):
        return np.real((1j * W)**order * PHASOR * np.exp(1j * W * t) + (3j * W)**order * P3 * np.exp(3j * W * t))
    t = 2.0 * np.pi / W * np.arange(20000) / 20000
    q = motion(t)
    tops = t[(q > np.roll(q, 1)) & (q > np.roll(q, -1))]
    for _ in range(5):
        tops = tops - motion(tops, 1) / motion(tops, 2)
    heights = np.sort(motion(tops))[::-1]
    assert len(tops) == 3 and np.diff(heights).max() < -1e-2
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), HarmonicForce(f3, harmonic=3, phase=phase, label="third"), RigidStop(
        heights[0] * (1.0 + 1e-10), 0.6)), omega=W)
    orbit = bf.find_orbit(system, guess=(float(motion(0.0)), float(motion(0.0, 1))))
    problem = orbit_problem(orbit, "third.amplitude", (0.5 * f3, 2.0 * f3))
    other, at, item = touching(problem, problem.x0)
    condition = Touching(other, at, item)
    assert condition.values(other, at)[1] == pytest.approx((heights[1] - heights[0]) / problem.weights[0], rel=1e-6)


def test_which_top_is_followed_is_told_by_the_latest_points_of_the_curve():
    """Two tops of one motion: the nearest point of the curve, in scaled unknowns, says which is meant."""
    condition = object.__new__(Touching)
    tables = SimpleNamespace(flat=np.array([2.0 * np.pi]), step=np.array([0.1]))
    problem = SimpleNamespace(scale=np.array([1.0, 100.0]), equations=SimpleNamespace(numbers_at=lambda p: tables),
                              sequence=SimpleNamespace(events=0, span=1.0))
    condition.mode, condition.constant, condition.passed, asked = 0, False, 0, []
    condition.series = lambda problem, x, tau: asked.append(tau) or np.array([0.5, 0.0, -1.0])
    condition.size = lambda problem, x, tau: 2.0
    condition.first, condition.latest = (np.array([0.0, 0.0]), 0.1), [(np.array([0.5, 10.0]), 0.4), (np.array([1.0, 20.0]), 0.7)]
    for x, tau in (((0.1, 15.0), 0.1), ((0.45, 0.0), 0.4), ((0.9, 0.0), 0.7), ((3.0, 15.0), 0.7)):
        asked.clear()
        assert condition.top(problem, np.array(x)) == (0.25, tau) and asked[0] == tau


@pytest.mark.parametrize(("system", "closure"), [
    (bf.systems.two_sided_impact_oscillator(omega=2.0, amplitude=3.0), -1), (bf.systems.impact_oscillator(omega=1.4), 1)])
def test_a_state_any_number_of_spans_away_is_that_state_or_its_mirror_image(system, closure):
    orbit = bf.find_orbit(system)
    problem = bf.trace(orbit, "amplitude", bounds=(0.9 * orbit.system.parameter("amplitude"), 4.0), max_steps=2).problems[0]
    span, scene = problem.sequence.span, problem.scene
    assert orbit.closure == closure
    for tau in (0.1, 0.37):
        for k in range(-3, 5):
            found = Touching.joined(None, problem, problem.x0, tau + k * span)
            np.testing.assert_allclose(found[:scene.ns], closure**k * orbit._states(np.array([tau]))[0], atol=1e-10)
            np.testing.assert_allclose(found[scene.ns:], scene.forcing(np.array([(tau + k * span) * system.period]))[0], atol=1e-12)
