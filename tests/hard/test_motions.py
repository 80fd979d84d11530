"""Hard starts and long accumulations of simulated motions, against closed forms; `specs` numbers are those of Zhang 2008."""
import mpmath as mp
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements

stop = bf.systems.impact_oscillator


def kinds(motion):
    return [str(event.kind) for event in motion.events]


def free_flight(zeta, y0, t):
    """Unforced x'' + 2 zeta x' + x = 0 in closed form."""
    wd = np.sqrt(1 - zeta**2)
    e, c, s = np.exp(-zeta * t), np.cos(wd * t), np.sin(wd * t)
    x = e * (y0[0] * c + (y0[1] + zeta * y0[0]) / wd * s)
    v = e * (y0[1] * c - (y0[0] + zeta * y0[1]) / wd * s)
    return np.array([x, v])


def test_start_on_the_stop_with_positive_speed_is_an_impact_now():
    motion = bf.simulate(stop(gap=1.0, restitution=0.6, amplitude=0.0), (1.0, 0.5), duration=0.1)
    assert kinds(motion)[0] == "impact" and motion.events[0].time == 0.0
    assert motion.events[0].speed == 0.5
    np.testing.assert_allclose(motion.events[0].after, [1.0, -0.3], rtol=0, atol=1e-16)


def test_start_on_the_stop_with_negative_speed_leaves():
    motion = bf.simulate(stop(zeta=0.05, gap=1.0, amplitude=0.0), (1.0, -0.5), duration=0.7)
    assert motion.events == ()
    np.testing.assert_allclose(motion.final, free_flight(0.05, (1.0, -0.5), 0.7), rtol=0, atol=2e-16)


def test_start_at_rest_on_the_stop_leaves_or_stays_by_its_acceleration():
    pulled = bf.simulate(stop(zeta=0.05, gap=1.0, amplitude=0.0), (1.0, 0.0), duration=0.5)
    assert "rest" not in str(pulled.modes) and pulled.events == ()
    np.testing.assert_allclose(pulled.final, free_flight(0.05, (1.0, 0.0), 0.5), rtol=0, atol=2e-16)
    pushed = bf.simulate(stop(gap=0.2, amplitude=1.0, omega=0.5), (0.2, 0.0), periods=0.1)
    assert "rest" in str(pushed.modes[0]) and pushed.events == ()
    np.testing.assert_array_equal(pushed.final, [0.2, 0.0])


@pytest.mark.parametrize("gap, amplitude, omega", [(0.0, 1.0, 0.2), (0.2, 1.0, 0.5), (-0.3, 0.7, 0.4), (0.35, 0.9, 1.1)])
def test_release_from_rest_is_where_the_push_ends(gap, amplitude, omega):
    """At rest on the stop the wall pushes while F cos(omega t) > gap."""
    system = stop(gap=gap, amplitude=amplitude, omega=omega)
    motion = bf.simulate(system, (gap, 0.0), periods=0.9 * np.arccos(gap / amplitude) / np.pi)
    release = [event for event in motion.events if event.kind == "release"]
    assert abs(release[0].time - np.arccos(gap / amplitude) / omega) <= 1e-14 / omega
    np.testing.assert_allclose(release[0].after, [gap, 0.0], rtol=0, atol=1e-15)


def test_penetration_is_refused_by_name():
    with pytest.raises(ValueError, match="stop"):
        bf.simulate(stop(gap=1.0), (1.01, 0.0), periods=1)


@pytest.mark.parametrize("y0", [(np.nan, 0.0), (0.0, np.inf), (0.0,), (0.0, 0.0, 0.0)])
def test_starts_that_are_no_states(y0):
    with pytest.raises(ValueError, match="y0"):
        bf.simulate(stop(), y0, periods=1)


def test_elastic_impacts_keep_the_energy():
    motion = bf.simulate(stop(zeta=0.0, gap=0.3, amplitude=0.0, restitution=1.0), (-1.0, 0.4), duration=400.0)
    energy = 0.5 * (motion.final @ motion.final)
    assert len(motion.events) > 80
    assert abs(energy - 0.58) <= 1e-12


def test_plastic_impact_comes_to_rest_at_once():
    motion = bf.simulate(stop(gap=0.0, amplitude=1.0, omega=0.2, restitution=0.0), (-0.1, 0.0), periods=0.2)
    assert kinds(motion)[0] in ("impact", "stick", "chatter") and "rest" in str(motion.modes[1])


def test_undamped_resonance_grows_linearly():
    """x'' + x = F cos t from rest: x = F t sin(t) / 2; the particular solution does not exist."""
    motion = bf.simulate(stop(zeta=0.0, omega=1.0, amplitude=0.01, gap=10.0), (0.0, 0.0), periods=20)
    t = 40.0 * np.pi
    np.testing.assert_allclose(motion.final, [0.005 * t * np.sin(t), 0.005 * (np.sin(t) + t * np.cos(t))], rtol=0, atol=1e-13)


@pytest.mark.parametrize("r", [0.1, 0.3, 0.5, 0.7, 0.9, 0.95])
def test_accumulation_on_a_wall_under_constant_load(r):
    """A free mass pushed by a constant force: t_acc = t + 2 r v / (a (1 - r)), exactly."""
    a, x0 = 0.8, -0.6
    system = bf.System(1.0, 0.0, 0.0, [elements.ConstantForce(a), elements.RigidStop(gap=0.0, restitution=r)])
    first, v = np.sqrt(-2 * x0 / a), np.sqrt(-2 * x0 * a)
    end = first + 2 * r * v / (a * (1 - r))
    motion = bf.simulate(system, (x0, 0.0), duration=end + 1.0)
    chatter = [event for event in motion.events if event.kind == "chatter"]
    assert len(chatter) == 1 and chatter[0].ratio == r
    assert abs(chatter[0].end - end) <= 1e-11
    assert len(motion.events) < 2000
    np.testing.assert_allclose(motion.final, [0.0, 0.0], rtol=0, atol=1e-14)


def test_a_graze_a_hair_from_the_stop():
    """The amplitude is 1e-12 above and below the graze: one impact of speed omega sqrt(A^2 - gap^2), or none."""
    zeta, omega, gap = 0.05, 0.8, 1.0
    compliance = np.sqrt((1 - omega**2)**2 + (2 * zeta * omega)**2)
    lag = np.arctan2(2 * zeta * omega, 1 - omega**2)
    for hair in (1e-12, -1e-12):
        A = gap * (1.0 + hair)
        start = (A * np.cos(-np.pi - 0.0), 0.0)  # the free response at its lowest point
        system = stop(zeta=zeta, omega=omega, amplitude=A * compliance, gap=gap)
        t0 = (lag + np.pi) / omega
        motion = bf.simulate(system, start, duration=1.9 * np.pi / omega, t0=t0)
        hits = [event for event in motion.events if event.kind == "impact"]
        if hair > 0:
            assert len(hits) >= 1
            speed = omega * np.sqrt(A * A - gap * gap)
            assert abs(hits[0].speed - speed) <= 0.02 * speed  # 1e-16 of position is 5e-5 of this speed; the lag rounds too
        else:
            assert hits == []


def test_two_stops_far_apart_in_time_scale():
    """A contact 1e10 times stiffer than the spring: half a period of sqrt(k), with the closed-form rebound."""
    k = 1e10
    system = bf.System(1.0, 0.0, 1.0, [elements.ElasticStop(gap=0.0, stiffness=k)])
    motion = bf.simulate(system, (0.0, 1.0), duration=1.0)
    contact = np.pi / np.sqrt(1.0 + k)
    release = [event for event in motion.events if event.speed and event.time > 0.0]
    assert abs(release[0].time - contact) <= 1e-9 * contact
    np.testing.assert_allclose(motion.final, [-np.sin(1.0 - contact), -np.cos(1.0 - contact)], rtol=0, atol=1e-11)


def test_many_events_end_in_a_status():
    motion = bf.simulate(stop(gap=0.0, amplitude=1.0, omega=0.2, restitution=0.9), (-0.5, 0.0), periods=1, max_events=5)
    assert not motion.success and "rigid_stop" in motion.message


def test_lyapunov_exponents_and_their_sum():
    """Zhang's finger attractor (zeta .05, omega 2.8, gap 0, r .8, F 1): .355(5) a period; the sum is ruled by Liouville."""
    system = stop(zeta=0.05, omega=2.8, gap=0.0, restitution=0.8, amplitude=1.0)
    found = bf.lyapunov_exponents(system, (-0.5, 0.0), periods=3000)
    assert found.chaotic
    assert abs(found.per_period[0] - 0.355) <= 0.005 + 4 * found.errors[0] * system.period
    liouville = 2 * np.log(0.8) * found.impacts / system.period - 2 * 0.05
    assert abs(found.values.sum() - liouville) <= 1e-12 * abs(liouville)
    assert abs(found.sum_rule - liouville) <= 1e-12 * abs(liouville)


def test_impacts_on_a_two_mass_chain_against_scipy_expm():
    """The state after a free flight of a chain is the matrix exponential; the stop is far away."""
    from scipy.linalg import expm

    system = bf.systems.impact_chain(n=3, amplitude=0.0, gap=50.0)
    n = 3
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -np.linalg.solve(system.mass, system.stiffness)
    A[n:, n:] = -np.linalg.solve(system.mass, system.damping)
    y0 = np.array([0.3, -0.2, 0.5, 0.1, 0.4, -0.3])
    motion = bf.simulate(system, y0, duration=17.3)
    np.testing.assert_allclose(motion.final, expm(17.3 * A) @ y0, rtol=0, atol=1e-14)


def test_first_impact_time_in_forty_digits():
    mp.mp.dps = 40
    z, w, F = mp.mpf("0.05"), mp.mpf("1.5"), mp.mpf("0.9")
    den = (1 - w**2)**2 + (2 * z * w)**2
    P, Q = F * (1 - w**2) / den, F * 2 * z * w / den
    wd = mp.sqrt(1 - z**2)
    a = -P
    b = (-Q * w + z * a) / wd

    def x(t):
        return mp.e**(-z * t) * (a * mp.cos(wd * t) + b * mp.sin(wd * t)) + P * mp.cos(w * t) + Q * mp.sin(w * t)

    motion = bf.simulate(stop(omega=1.5, amplitude=0.9), (0.0, 0.0), periods=6)
    time = motion.events[0].time
    exact = mp.findroot(lambda t: x(t) - 1, time)
    assert abs(float(exact - mp.mpf(time))) <= 4e-15
    assert abs(float(mp.diff(x, exact)) - motion.events[0].speed) <= 4e-15
