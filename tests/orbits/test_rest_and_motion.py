"""Searches without a clock tell rest from motion: where the motion goes decides, not on what Newton's method comes out."""
import math
import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.elements import ConstantForce, CubicSpring, ElasticStator, ElasticStop, HarmonicForce, RigidStop


def whirling(coupling, stiffness=20.0, friction=0.05):
    """A rotor driven by a circulatory force, inside an elastic stator."""
    return bf.System(np.eye(2), 0.1 * np.eye(2), [[1.0, coupling], [-coupling, 1.0]],
                     [ElasticStator(radius=1.0, stiffness=stiffness, friction=friction)])


def whirl(coupling, stiffness, friction):
    """Radius and frequency w of the backward whirl: w^2 r = r + k (r - 1) and .1 w r = coupling r - friction k (r - 1)."""
    low, high = 1.0, 3.0
    for _ in range(200):
        r = 0.5 * (low + high)
        push = stiffness * (r - 1.0) / r
        w = math.sqrt(1.0 + push)
        low, high = (r, high) if 0.1 * w < coupling - friction * push else (low, r)
    return r, w


@pytest.mark.parametrize("coupling", [0.16, 0.13])
@pytest.mark.parametrize("guess", [(0.9, 0.0, 0.0, -1.2), (0.0, 0.0, 0.0, 0.0), (1e-9, 0.0, 0.0, 0.0), (0.1, 0.0, 0.0, 0.0), None])
def test_a_rotor_leaves_its_unstable_rest_for_the_whirl(coupling, guess):
    orbit = bf.find_orbit(whirling(coupling), guess)
    r, w = whirl(coupling, 20.0, 0.05)
    assert orbit.success and orbit.stable
    assert orbit.period == pytest.approx(2.0 * math.pi / w, rel=1e-9)
    np.testing.assert_allclose(np.hypot(*orbit.sample(50)[1][:, :2].T), r, rtol=1e-9)
    if coupling == 0.16:
        assert r == pytest.approx(1.03302, abs=1e-5)


@pytest.mark.parametrize("guess", [(0.9, 0.0, 0.0, -1.2), (0.0, 0.0, 0.0, 0.0), (0.1, 0.0, 0.0, 0.0), None])
def test_a_rotor_comes_to_its_stable_rest(guess):
    """Eigenvalues: l^2 + .1 l + 1 = +-.06 i, all with negative real parts."""
    assert np.roots([1.0, 0.1, 1.0 - 0.06j]).real.max() < 0.0
    assert bf.find_orbit(whirling(0.06), guess).status == "at_rest"


def growth(q):
    """Largest real part of the eigenvalues at the rest ``q`` of the system below; a push to one side makes its springs differ."""
    K = np.array([[1.0, 0.2], [-0.2, 1.0]]) + 3.0 * np.diag(q**2)
    return np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -0.1 * np.eye(2)]])).real.max()


@pytest.mark.parametrize("guess", [0.0, 1e-9])
def test_a_push_that_detunes_the_springs_keeps_the_swing_at_rest(guess):
    """K' = [[1 + 3 a^2, .2], [-.2, 1 + 3 b^2]] swings up only while .1 w < the imaginary part of its eigenvalue."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[1.0, 0.2], [-0.2, 1.0]],
                       [CubicSpring(1.0, dof=0), CubicSpring(1.0, dof=1), ConstantForce(0.4, dof=0)])
    rest = bf.find_equilibrium(system)
    assert growth(rest.state[:2]) < 0.0 and rest.stable is True
    found = bf.find_orbit(system, np.append(rest.state[:2] + (guess, 0.0), (0.0, 0.0)))
    assert found.status == "at_rest" and found.state == pytest.approx(rest.state, abs=1e-6)


@pytest.mark.parametrize("place", [0.0, 0.2])
@pytest.mark.parametrize("guess", [0.0, 1e-9, 0.5, 3.0])
def test_a_swing_without_a_clock_is_reached_from_both_sides(place, guess):
    """A circulatory force drives two coordinates with hardening springs; an integration comes back after the period."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[1.0, 0.2], [-0.2, 1.0]],
                       [CubicSpring(1.0, dof=0), CubicSpring(1.0, dof=1), ConstantForce(place, dof=0)])
    rest = bf.find_equilibrium(system)
    assert growth(rest.state[:2]) > 0.0 and rest.stable is False
    start = np.append(rest.state[:2] + (guess, 0.0), (0.0, 0.0))
    orbit = bf.find_orbit(system, start)

    def rate(t, y):
        x, v = y[:2], y[2:]
        return [*v, *(-0.1 * v - np.array([[1.0, 0.2], [-0.2, 1.0]]) @ x - x**3 + (place, 0.0))]

    later = solve_ivp(rate, (0.0, orbit.period), orbit.state, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
    assert orbit.success and orbit.stable
    np.testing.assert_allclose(later.y[:, -1], orbit.state, atol=1e-8)
    assert np.ptp(later.sol(np.linspace(0.0, orbit.period, 200))[0]) > 1.0


@pytest.mark.parametrize("guess, well", [
    ((0.0, 0.0), None), ((1e-9, 0.0), None), ((-1e-9, 0.0), None), ((1.0, 0.0), 1.0), ((-1.1, 0.0), -1.0), ((2.0, 1.0), None)])
def test_of_several_states_of_rest_a_stable_one_is_reached(guess, well):
    system = bf.System(1.0, 0.1, -1.0, [CubicSpring(1.0)])
    found = bf.find_orbit(system, guess)
    assert found.status == "at_rest"
    assert abs(found.state[0]) == pytest.approx(1.0, abs=1e-2)
    if well is not None:
        assert found.state[0] == pytest.approx(well, abs=1e-2)


def test_a_start_on_a_stable_rest_beside_zero_is_at_rest():
    rest = bf.find_equilibrium(bf.systems.belt_oscillator())
    found = bf.find_orbit(rest.system, rest.state)
    assert found.status == "at_rest" and found.state == pytest.approx([0.6, 0.0])


@pytest.mark.parametrize("periods", [1, 40, 41, 64, 200])
def test_any_number_of_periods_is_looked_for(periods):
    found = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), periods=periods)
    assert found.success and found.periods == 1
    np.testing.assert_allclose(bf.simulate(found.system, found.state, periods=periods).final, found.state, atol=1e-9)


@pytest.mark.parametrize("omega, damping, restitution, gaps, force, driven, stopped", [
    (0.7546582253801896, 0.002, 0.95, (-0.1, 0.1), 3.0, 1, 0), (0.2604376612007703, 0.0, 0.3, (0.5, 0.5), 3.0, 0, 1)])
def test_long_sequences_of_three_masses_between_stops_take_no_minutes(omega, damping, restitution, gaps, force, driven, stopped):
    """Newton's method on thousands of unknowns waits until the motion comes back; what is found comes back in a simulation."""
    K = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    system = bf.System(np.eye(3), damping * K, K, [
        HarmonicForce(force, dof=driven), RigidStop(gaps[0], restitution, dof=stopped),
        ElasticStop(gaps[1], 50.0, side=-1, dof=stopped)], omega=omega)
    bf.find_orbit(system, transient=40)  # compiles
    clock = time.thread_time()
    found = bf.find_orbit(system)
    assert time.thread_time() - clock < 20.0
    assert found.success or found.status == "not_found"
    if found.success:
        np.testing.assert_allclose(bf.simulate(system, found.state, periods=found.periods).final, found.state, atol=1e-6)
