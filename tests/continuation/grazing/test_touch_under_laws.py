"""Touches of a motion under a cubic spring: rates, Taylor series, linear map and top, against the equation of motion."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.continuation.grazing.classify import powers
from bifurc.continuation.grazing.following import Touching, touching
from bifurc.continuation.grazing.guards import field_slope
from bifurc.continuation.grazing.local import local_motion
from bifurc.continuation.grazing.touch import every_touch, maxima, touch_at
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.system import System

ZETA, W, F, BETA = 0.07, 1.3, 0.8, 0.4


def field(t, y, force=F):
    q, v = y
    return np.array([v, force * np.cos(W * t) - 2.0 * ZETA * v - q - BETA * q**3])


def free(force=F):
    """Return the orbit without a stop."""
    return bf.find_orbit(System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(force), CubicSpring(BETA)), omega=W))


@pytest.fixture(scope="module", params=["rigid", "elastic"])
def found(request):
    """The orbit that touches a stop at its top, its problem and its touch."""
    gap = free().maximum(0) * (1.0 + 1e-10)
    stop = RigidStop(gap, 0.6) if request.param == "rigid" else ElasticStop(gap, 3.0, 0.4)
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), CubicSpring(BETA), stop), omega=W)
    orbit = bf.find_orbit(system, guess=free().state)
    assert orbit.success and not orbit.sequence.events
    problem = orbit_problem(orbit, "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    (item,) = every_touch(problem, problem.x0)
    return request.param, gap, problem, problem.x0, item


def test_the_touch_of_a_nonlinear_motion(found):
    kind, gap, problem, x, item = found
    touch = touch_at(problem, x, *item)
    t, (q, v) = touch.time, touch.state
    assert q == pytest.approx(gap, abs=1e-8) and v == pytest.approx(0.0, abs=1e-6)
    a = F * np.cos(W * t) - 2.0 * ZETA * v - q - BETA * q**3
    jerk = -F * W * np.sin(W * t) - 2.0 * ZETA * a - (1.0 + 3.0 * BETA * q * q) * v
    assert a < 0.0 and touch.apex == pytest.approx(a, rel=1e-9) and touch.jerk == pytest.approx(jerk, rel=1e-6)
    np.testing.assert_allclose(touch.h, [1.0, 0.0])
    if kind == "rigid":
        np.testing.assert_allclose(touch.B, [0.0, 1.0])
        assert touch.restitution == pytest.approx(0.6) and touch.contact is None
    else:  # k b + c A b with b = (0, 1)
        np.testing.assert_allclose(touch.B, [0.4, 3.0 - 0.4 * 2.0 * ZETA], atol=1e-9)
        assert touch.restitution is None and touch.contact is not None


def test_the_linear_map_is_that_of_the_equations_of_variation(found):
    _, _, problem, x, item = found
    touch = touch_at(problem, x, *item)

    def varied(t, y):
        A = np.array([[0.0, 1.0], [-1.0 - 3.0 * BETA * y[0]**2, -2.0 * ZETA]])
        return np.concatenate([field(t, y[:2]), (A @ y[2:].reshape(2, 2)).ravel()])
    period = 2.0 * np.pi / W
    run = solve_ivp(varied, (touch.time, touch.time + period), [*touch.state, 1.0, 0.0, 0.0, 1.0], "DOP853", rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.y[:2, -1], touch.state, atol=1e-8)
    np.testing.assert_allclose(touch.E, run.y[2:, -1].reshape(2, 2), atol=1e-8)
    assert np.linalg.det(touch.E) == pytest.approx(np.exp(-2.0 * ZETA * period), rel=1e-8)
    joined = touch.joined(touch.state, touch.time)
    slope = field_slope(problem.equations, touch.tables, touch.mode, joined)
    np.testing.assert_allclose(slope[:, :2], [[0.0, 1.0], [-1.0 - 3.0 * BETA * touch.state[0]**2, -2.0 * ZETA]], atol=1e-8)


def condition_of(found):
    _, _, problem, x, _ = found
    other, at, item = touching(problem, x)
    return Touching(other, at, item), other, at, item


def test_the_series_of_the_guard_is_that_of_the_motion(found):
    gap = found[1]
    condition, other, at, item = condition_of(found)
    for shift in (0.0, 0.03, -0.2, 0.31):
        tau = item[0] + shift
        t = 2.0 * np.pi / W * tau
        q, v = condition.joined(other, at, tau)[:2]
        run = solve_ivp(field, (2.0 * np.pi / W * at[0], 2.0 * np.pi / W * (at[0] + np.mod(tau - at[0], 1.0))), at[1:3], "DOP853",
                        rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose([q, v], run.y[:, -1], atol=1e-8)
        a = field(t, (q, v))[1]
        slope = 1.0 + 3.0 * BETA * q * q
        jerk = -F * W * np.sin(W * t) - 2.0 * ZETA * a - slope * v
        snap = -F * W * W * np.cos(W * t) - 2.0 * ZETA * jerk - slope * a - 6.0 * BETA * q * v * v
        series = condition.series(other, at, tau)
        np.testing.assert_allclose(series[:3], [q - gap, v, 0.5 * a], atol=1e-10)
        np.testing.assert_allclose(series[3:5], [jerk / 6.0, snap / 24.0], rtol=1e-4, atol=1e-5)
    a = F * np.cos(W * 2.0 * np.pi / W * item[0]) - gap - BETA * gap**3
    assert condition.apex(other, at, item[0]) == pytest.approx(a, rel=1e-6)


def test_the_top_that_is_followed_is_that_of_the_motion_at_other_loads(found):
    gap = found[1]
    condition, other, at, item = condition_of(found)
    for force in (0.97 * F, 0.995 * F, 1.01 * F):
        orbit = free(force)
        moved = np.array([at[0], *orbit.state, force]) if at[0] == 0.0 else None
        value, tau = condition.top(other, moved)
        assert value * other.weights[0] == pytest.approx(orbit.maximum(0) - gap, abs=1e-8)
        assert abs((tau - item[0] + 0.5) % 1.0 - 0.5) < 0.05
    values = condition.values(other, at)
    touch = touch_at(*found[2:4], *found[4])
    assert values[2:4] == pytest.approx([np.linalg.det(touch.E - np.eye(2)), np.linalg.det(touch.E + np.eye(2))], rel=1e-5)
    assert values[0] < 0.0 and values[1] == -1.0
    if found[0] == "rigid":  # h E^k B in natural sizes
        weights = other.weights
        own = [touch.h @ np.linalg.matrix_power(touch.E, k) @ touch.B for k in range(1, 7)]
        size = np.linalg.norm(touch.h * weights) * np.linalg.norm(touch.B / weights)
        np.testing.assert_allclose(values[4:], np.array(own) / size, rtol=1e-5, atol=1e-8)
        np.testing.assert_allclose(powers(touch.E, touch.h, touch.B, 6)[0], own, rtol=1e-9)
    else:
        assert np.isnan(values[4:]).all()


def test_the_gradient_of_the_top_is_its_change(found):
    condition, other, at, _ = condition_of(found)
    family = SimpleNamespace(at=lambda b: other, scale=np.append(other.scale, 1.0))
    x = np.append(at, 0.3)
    value, gradient = condition.linearised(family, x, None)
    assert value == pytest.approx(condition.value(family, x), abs=1e-12) and abs(gradient[-1]) < 1e-15
    for i in range(1, x.size - 1):
        step = 1e-5 * family.scale[i]
        sides = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[i] += sign * step
            sides.append(condition.value(family, moved))
        assert gradient[i] == pytest.approx((sides[0] - sides[1]) / (2.0 * step), rel=1e-4, abs=1e-6)


def test_the_one_maximum_below_a_stop_is_told_by_its_depth():
    orbit = free()
    top = orbit.maximum(0)
    for kind in (lambda gap: RigidStop(gap, 0.6), lambda gap: ElasticStop(gap, 3.0, 0.4)):
        system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), CubicSpring(BETA), kind(top + 2e-3)), omega=W)
        problem = orbit_problem(bf.find_orbit(system, guess=orbit.state), "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
        assert every_touch(problem, problem.x0) == []
        ((tau, mode, guard, value, y),) = maxima(problem, problem.x0, [])
        assert value * problem.weights[0] == pytest.approx(-2e-3, abs=1e-9) and y == pytest.approx([top, 0.0], abs=1e-8)
        run = solve_ivp(field, (0.0, 2.0 * np.pi / W * (tau % 1.0)), orbit.state, "DOP853", rtol=1e-10, atol=1e-12)
        assert run.y[:, -1] == pytest.approx([top, 0.0], abs=1e-7)  # it is there at that time
        assert not list(maxima(problem, problem.x0, [(tau + 1.0, mode, guard)]))  # known, a period later


@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_a_motion_beyond_a_touch_is_measured_by_the_speed_of_its_first_touch(restitution):
    """Without a law: the amplitude is F / |Z|, its depth at (1 + eps) F is eps times itself, and the speed is W times the root of
    twice the depth times the amplitude; what throws the motion out at one distance does so at another."""
    Z = 1.0 - W * W + 2j * ZETA * W
    size = F / abs(Z)
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F), RigidStop(size * (1.0 + 1e-10), restitution)), omega=W)
    P = F / Z
    problem = orbit_problem(bf.find_orbit(system, guess=(P.real, -W * P.imag)), "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    touch = touch_at(problem, problem.x0, *every_touch(problem, problem.x0)[0])
    motions = [local_motion(touch, eps) for eps in (1e-8, 1e-10)]
    for motion, eps in zip(motions, (1e-8, 1e-10), strict=True):
        assert motion.eps == eps and motion.first == pytest.approx(W * size * np.sqrt(2.0 * eps), rel=1e-5)
        assert not motion.small and motion.speed > 12.0 * motion.first
