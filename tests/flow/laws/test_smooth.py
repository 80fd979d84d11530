"""Motion under laws that are not affine, against exact solutions and Taylor series in 30 digits."""
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import differenced, kernels
from bifurc.elements import Coulomb, CubicSpring, Force, HarmonicForce, RigidStator, RigidStop
from bifurc.flow.laws.calls import scratch_of, step
from bifurc.flow.laws.gauss import NODES
from tests.flow.taylor import Duffing


def parts(system):
    """Engine, tables and a function that makes the joined state."""
    scene = scene_of(system)
    engine = kernels(scene)

    def joined(y, t=0.0):
        x = np.zeros(scene.ns + scene.nw)
        x[:scene.ns] = y
        engine.forcing(scene.tables, t, x)
        return x

    return engine, scene.tables, joined


def moved(engine, T, x, s):
    y, Phi = np.empty(T.A.shape[1]), np.empty((T.A.shape[1],) * 2)
    engine.arc(T, 0, x, s, y, Phi)
    return y, Phi


def duffing(**parameters):
    return bf.systems.duffing_oscillator(**parameters)


@pytest.mark.parametrize("amplitude", [1e-3, 0.5, 2.0, 20.0])
def test_free_cubic_oscillator_is_a_jacobi_function(amplitude):
    engine, T, joined = parts(duffing(zeta=0.0, amplitude=0.0, omega=1.0))
    rate, m = math.sqrt(1.0 + amplitude**2), amplitude**2 / (2.0 + 2.0 * amplitude**2)
    for s in (1e-6, 0.3, 2.0, 11.0):
        sn, cn, dn, _ = ellipj(rate * s, m)
        y, Phi = moved(engine, T, joined((amplitude, 0.0)), s)
        error = abs(y - [amplitude * cn, -amplitude * rate * sn * dn])
        assert error[0] < 2e-14 * amplitude * (1.0 + rate * s), s
        assert error[1] < 2e-14 * amplitude * rate * (1.0 + rate * s), s
        assert abs(np.linalg.det(Phi) - 1.0) < 1e-11 * (1.0 + abs(Phi).max())


@pytest.mark.parametrize("omega, y", [(0.5, (0.1, -0.3)), (1.5, (1.3, 0.4)), (1.75, (2.1, 0.2)), (3.0, (-0.7, 4.0))])
def test_forced_period_against_taylor(omega, y):
    engine, T, joined = parts(duffing(omega=omega))
    period = 2.0 * np.pi / omega
    exact, _ = Duffing(omega=omega).run(y, 0.0, period)
    found, Phi = moved(engine, T, joined(y), period)
    assert abs(found - np.array(exact, float)).max() < 1e-13
    plain = np.empty(2)
    engine.advance(T, 0, joined(y), period, plain)
    assert np.array_equal(plain, found)
    assert abs(np.linalg.det(Phi) / math.exp(-0.1 * period) - 1.0) < 2e-13  # Liouville
    for i in range(2 if omega > 1.6 else 0):  # the reference is slow
        shift = 1e-9 * np.eye(2)[i]
        up, down = (Duffing(omega=omega).run(y + d, 0.0, period)[0] for d in (shift, -shift))
        column = np.array([float((a - b) / 2e-9) for a, b in zip(up, down, strict=True)])
        assert abs(Phi[:, i] - column).max() < 1e-7 * abs(Phi).max()


@pytest.mark.parametrize("name", ["omega", "amplitude", "zeta", "alpha", "beta"])
def test_change_by_other_numbers_against_taylor(name):
    """Of a state after half a period, where one number is another: the forcing ends at the same phase, also where it is faster."""
    values = {"omega": 1.3, "amplitude": 0.3, "zeta": 0.05, "alpha": 1.0, "beta": 1.0}
    system, unit, y = duffing(**values), 1e-6, (0.8, -0.3)
    engine, T, joined = parts(system)
    beside = [{**values, name: values[name] + d} for d in (unit, -unit)]
    ends = [Duffing(**numbers).run(y, 0.0, np.pi / numbers["omega"])[0] for numbers in beside]
    exact = np.array([float((a - b) / (2.0 * unit)) for a, b in zip(*ends, strict=True)])
    numbers = scene_of(system).refill(system.with_parameters(**{name: values[name] + 1e-7})).flat
    x, s = joined(y), np.pi / values["omega"]
    plain, Psi = moved(engine, T, x, s)
    end, Phi, change = np.empty(2), np.empty((2, 2)), np.empty(2)
    engine.arc_beside(T, 0, x, s, numbers, end, Phi, change)
    assert np.array_equal(end, plain) and np.array_equal(Phi, Psi)
    np.testing.assert_allclose(change / 1e-7, exact, rtol=0.0, atol=2e-7 * abs(exact).max())


def test_change_by_other_numbers_against_differences_of_steps():
    """Coupled inertia, a law of two rows, two harmonics: all numbers move at once, and so do those of the law."""
    def system(d):
        forces = HarmonicForce(0.5 + d), HarmonicForce(0.2 - d, harmonic=3, dof=1), Force(coupled, site=np.eye(2), a=0.9 + d)
        return bf.System([[1.0 + d, 0.3], [0.3, 0.8]], [[0.1, -0.5 + d], [0.6, 0.05]], [[2.0, -0.4], [-0.4, 1.0 - 2.0 * d]],
                         forces, omega=1.3 - d)

    engine, T, joined = parts(system(0.0))
    scene, y, phase = scene_of(system(0.0)), np.array([0.4, -0.7, 0.2, 0.5]), 2.0
    ends = []
    for d in (1e-5, -1e-5):
        other = parts(system(d))
        ends.append(moved(other[0], other[1], other[2](y), phase / (1.3 - d))[0])
    end, Phi, change = np.empty(4), np.empty((4, 4)), np.empty(4)
    engine.arc_beside(T, 0, joined(y), phase / 1.3, scene.refill(system(1e-7)).flat, end, Phi, change)
    np.testing.assert_allclose(change / 1e-7, (ends[0] - ends[1]) / 2e-5, rtol=0.0, atol=1e-6 * abs(change / 1e-7).max())


def test_backward_undoes_forward():
    engine, T, joined = parts(duffing(omega=1.5))
    y, back = np.empty(2), np.empty(2)
    engine.advance(T, 0, joined((1.0, 0.5), 0.3), 2.0, y)
    engine.advance(T, 0, joined(y, 2.3), -2.0, back)
    assert abs(back - [1.0, 0.5]).max() < 1e-13


def test_order_is_sixteen():
    _, T, joined = parts(duffing(zeta=0.0, amplitude=0.0, omega=1.0))
    amplitude, s = 2.0, 2.0
    rate = math.sqrt(1.0 + amplitude**2)
    sn, cn, dn, _ = ellipj(rate * s, amplitude**2 / (2.0 + 2.0 * amplitude**2))
    steps, errors = (3, 4, 5, 6), []
    for count in steps:
        x, x1, scratch = joined((amplitude, 0.0)), np.empty(5), scratch_of(T, 0)
        for _ in range(count):
            h = step(T, 0, x, s / count, 1e3, x1, np.empty((1, NODES + 2)), np.empty((1, NODES + 2)),
                     np.empty((0, 2)), 0, np.empty((0, 1, NODES + 2)), scratch)
            assert h == s / count
            x = x1.copy()
        errors.append(np.hypot(x[0] - amplitude * cn, x[1] + amplitude * rate * sn * dn))
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert errors[-1] > 1e-14 and 14.0 < slope < 19.0


def coupled(u0, u1, s0, s1, a):
    return -a * u0 * u1 - 0.7 * s1 * s1 - 0.2 * s0, -0.3 * s0 * u1 - a * u1 * u1 * u1


def test_accelerations_of_variations_against_differences_of_steps(rng):
    """At both ends of a step and at its nodes, with coupled inertia, gyroscopic terms and a law of two rows coupled through speeds:
    no matrix of the problem is symmetric."""
    system = bf.System([[1.0, 0.3], [0.3, 0.8]], [[0.1, -0.5], [0.6, 0.05]], [[2.0, -0.4], [-0.4, 1.0]],
                       [HarmonicForce(0.5), Force(coupled, site=np.eye(2), a=0.9)], omega=1.3)
    _, T, joined = parts(system)
    n, rows, h = 2, T.LU.shape[0], 0.05

    def stepped(y, X, edges):
        acc, x1 = np.empty((n, NODES + 2)), np.empty(T.A.shape[2])
        accs = np.full((len(X), n, NODES + 2), np.nan)
        assert step(T, 0, joined(y, 0.4), h, 1e3, x1, acc, np.empty((rows, NODES + 2)), X, edges, accs, scratch_of(T, len(X))) == h
        return acc, x1[:4], accs

    for _ in range(5):
        y, X = rng.uniform(-1.0, 1.0, 4), np.eye(4)
        _, _, accs = stepped(y, X, 1)
        for k in range(4):
            ends = [stepped(y + d * 1e-5 * np.eye(4)[k], np.empty((0, 4)), 0) for d in (1.0, -1.0)]
            np.testing.assert_allclose(accs[k], (ends[0][0] - ends[1][0]) / 2e-5, atol=1e-8)
            np.testing.assert_allclose(X[k], (ends[0][1] - ends[1][1]) / 2e-5, atol=1e-8)


@pytest.mark.parametrize("key", ["slip+", "slip-", "roll"])
def test_accelerations_of_variations_beside_the_force_of_a_wall(key):
    """Of a point that slides or rolls on a ring: the wall answers all other forces, along both coordinates."""
    system = bf.System(np.eye(2), [[0.1, -0.5], [0.6, 0.05]], [[2.0, -0.4], [-0.4, 1.0]], [
        HarmonicForce(0.5), RigidStator(restitution=0.5, friction=0.3, radius=1.0, surface_speed=0.7)], omega=1.3)
    _, T, joined = parts(system)
    m, n, rows, h = scene_of(system).index(("always", key)), 2, T.LU.shape[0], 0.02

    def stepped(y, X, edges):
        acc, x1, accs = np.empty((n, NODES + 2)), np.empty(T.A.shape[2]), np.full((len(X), n, NODES + 2), np.nan)
        assert step(T, m, joined(y, 0.4), h, 1e3, x1, acc, np.empty((rows, NODES + 2)), X, edges, accs, scratch_of(T, len(X))) == h
        return acc, accs

    place = np.array([math.cos(0.6), math.sin(0.6)])
    y = np.concatenate((place, 0.4 * np.array([-place[1], place[0]])))
    _, accs = stepped(y, np.eye(4), 1)
    assert np.abs(accs).max() > 0.5
    for k in range(4):
        ends = [stepped(y + d * 1e-5 * np.eye(4)[k], np.empty((0, 4)), 0)[0] for d in (1.0, -1.0)]
        np.testing.assert_allclose(accs[k], (ends[0] - ends[1]) / 2e-5, atol=1e-8)


@pytest.mark.parametrize(("key", "sign", "speed"), [("roll", 0.0, 0.7), ("slip+", -1.0, 1.4), ("slip-", 1.0, 0.1)])
def test_a_point_on_a_ring_moves_by_its_angle_alone(key, sign, speed):
    """r'' along the ring is the force along it and the friction of what the wall bears, v^2/R and the force outwards; a point that
    rolls goes with the surface whatever pushes it."""
    C, K, beta, mu = np.array([[0.1, -0.5], [0.6, 0.05]]), np.array([[2.0, -0.4], [-0.4, 1.0]]), -3.0, 0.3
    system = bf.System(np.eye(2), C, K, [HarmonicForce(0.5), CubicSpring(beta), RigidStator(
        restitution=0.5, friction=mu, radius=1.0, surface_speed=0.7)], omega=1.3)
    engine, T, joined = parts(system)
    m = scene_of(system).index(("always", "always", key))

    def along(t, y):
        out, way = np.array([math.cos(y[0]), math.sin(y[0])]), np.array([-math.sin(y[0]), math.cos(y[0])])
        force = np.array([0.5 * math.cos(1.3 * t) - beta * out[0]**3, 0.0]) - C @ way * y[1] - K @ out
        return [y[1], way @ force + sign * mu * (y[1]**2 + out @ force)] if sign else [speed, 0.0]
    for angle in (0.6, 2.5, -1.0):
        found = solve_ivp(along, (0.4, 0.4 + 0.25), (angle, speed), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        x, y = joined((math.cos(angle), math.sin(angle), -speed * math.sin(angle), speed * math.cos(angle)), 0.4), np.empty(4)
        engine.advance(T, m, x, 0.25, y)
        wanted = [math.cos(found[0]), math.sin(found[0]), -found[1] * math.sin(found[0]), found[1] * math.cos(found[0])]
        np.testing.assert_allclose(y, wanted, atol=1e-11)


def test_pendulum_from_a_users_law_with_differenced_derivatives():
    system = bf.System(1.0, 0.0, 1.0, (Force(lambda u, s, pull: pull * (u - math.sin(u)), pull=1.0),), omega=1.0)
    engine, T, joined = parts(system)
    assert differenced(scene_of(system).laws) == ("force",)
    k = math.sin(2.5 / 2.0)  # released at 2.5 radians
    quarter = ellipk(k * k)
    for s in (0.7, 5.0):
        sn, cn, dn, _ = ellipj(quarter - s, k * k)
        y, Phi = moved(engine, T, joined((2.5, 0.0)), s)
        assert abs(y - [2.0 * math.asin(k * sn), -2.0 * k * cn]).max() < 2e-13
        assert abs(np.linalg.det(Phi) - 1.0) < 1e-10
        up, down = np.empty(2), np.empty(2)
        engine.advance(T, 0, joined((2.5 + 1e-5, 0.0)), s, up)
        engine.advance(T, 0, joined((2.5 - 1e-5, 0.0)), s, down)
        assert abs((up - down) / 2e-5 - Phi[:, 0]).max() < 1e-8


def stopped(gap=0.5, restitution=0.7, **parameters):
    values = {"zeta": 0.05, "omega": 1.5, "amplitude": 0.3, **parameters}
    elements = (HarmonicForce(values["amplitude"]), CubicSpring(1.0), RigidStop(gap, restitution))
    system = bf.System(1.0, 2.0 * values["zeta"], 1.0, elements, omega=values["omega"])
    return system, Duffing(gap=gap, restitution=restitution, **values)


@pytest.mark.parametrize("gap, y", [(0.5, (0.1, 0.4)), pytest.param(0.0, (-0.4, 0.9), marks=pytest.mark.slow),
                                    pytest.param(1.2, (0.0, 4.0), marks=pytest.mark.slow)])
def test_impacts_of_a_cubic_oscillator_against_taylor(gap, y):
    system, reference = stopped(gap)
    motion = bf.simulate(system, y, periods=4)
    end, impacts = reference.run(y, 0.0, 4 * 2.0 * np.pi / 1.5)
    assert motion.success and len(motion.events) == len(impacts) > 1
    for event, (time, speed) in zip(motion.events, impacts, strict=True):
        assert abs(event.time - float(time)) < 1e-12
        assert abs(event.speed - float(speed)) < 1e-12
    assert abs(motion.y[-1] - np.array(end, float)).max() < 2e-12


def test_rest_on_the_stop_ends_when_the_law_says_so():
    gap, force = 0.1, 1.0
    system, reference = stopped(gap, restitution=0.4, omega=0.5, amplitude=force)
    motion = bf.simulate(system, (0.0, 0.3), periods=1)
    release = [event for event in motion.events if event.kind == "release"]
    chatter = [event for event in motion.events if event.kind == "chatter"]
    assert len(release) == 1 and chatter[0].end < release[0].time
    assert abs(release[0].time - math.acos((gap + gap**3) / force) / 0.5) < 1e-12  # load = alpha gap + beta gap^3
    _, impacts = reference.run((0.0, 0.3), 0.0, 2.0, slowest=1e-11)
    time, speed = impacts[-1]
    push = force * math.cos(0.5 * float(time)) - gap - gap**3
    accumulated = float(time) + 2.0 * 0.4 * float(speed) / (push * (1.0 - 0.4))
    assert abs(chatter[0].end - accumulated) < 1e-11


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9])
def test_grazing_hump_is_found_and_its_absence_too(depth):
    free, _ = stopped(5.0, amplitude=0.0, zeta=0.0)
    top = bf.simulate(free, (0.3, 1.1), duration=2.0)
    engine, T, joined = parts(free)
    times = np.linspace(0.0, 2.0, 2001)
    s = times[np.argmax(top(times)[:, 0])]
    y = np.empty(2)
    for _ in range(8):
        engine.advance(T, 0, joined((0.3, 1.1)), s, y)
        s += y[1] / (y[0] + y[0] ** 3)
    for sign in (-1.0, 1.0):
        system, _ = stopped(y[0] + sign * depth, amplitude=0.0, zeta=0.0)
        motion = bf.simulate(system, (0.3, 1.1), duration=s + 0.05)
        assert len(motion.events) == (1 if sign < 0 else 0)
        if sign < 0:
            early = math.sqrt(2.0 * depth / (y[0] + y[0] ** 3))
            assert abs(motion.events[0].time - (s - early)) < 0.02 * early + 1e-9


def test_divergence_is_a_status():
    system = duffing(beta=-1.0, omega=1.0)
    motion = bf.simulate(system, (3.0, 3.0), periods=2)
    assert not motion.success and motion.status == "diverged"


@pytest.mark.parametrize("cubic", [0.0, 0.7])
@pytest.mark.parametrize("load, omega, phase", [(1.3, 0.8, 0.4), (0.9, 0.5, -1.1)])
def test_rates_at_the_events_of_dry_friction_are_those_of_its_forces(cubic, load, omega, phase):
    """What holds, F cos - K q - k q^3, changes with -F omega sin when it lets go; a slide ends with its own deceleration."""
    limit, springs = 0.5, [CubicSpring(cubic)] if cubic else []
    system = bf.System(2.0, 0.1, 1.0, [HarmonicForce(load, phase=phase), *springs, Coulomb(limit)], omega=omega)
    seen = []
    for y in ((0.6, 0.0), (-0.3, 0.0), (0.1, 0.0)):
        for event in bf.simulate(system, y, duration=20.0).events:
            q, angle = event.before[0], omega * event.time + phase
            force = load * np.cos(angle) - q - cubic * q**3
            if event.kind == "slip":
                assert abs(force) == pytest.approx(limit, rel=1e-12)
                assert event.speed == pytest.approx(abs(load * omega * np.sin(angle)), rel=1e-10)
            else:  # it slid with the force that is less than the friction, or against it
                rates = [abs(force - way * limit) / 2.0 for way in (-1.0, 1.0)]
                assert event.kind == "stick" and min(abs(event.speed - rate) for rate in rates) < 1e-8 * max(rates)
            seen.append(event.kind)
    assert seen.count("slip") > 1 and "stick" in seen


def test_rest_on_a_stop_ends_with_the_rate_of_its_reaction():
    system = bf.System(1.5, 0.2, 1.0, [HarmonicForce(2.0, phase=0.3), CubicSpring(0.4), RigidStop(0.2, 0.0)], omega=0.6)
    releases = [event for event in bf.simulate(system, (0.2, 0.0), duration=60.0).events if event.kind == "release"]
    assert len(releases) > 3
    for event in releases:
        angle = 0.6 * event.time + 0.3
        assert 2.0 * np.cos(angle) == pytest.approx(0.2 + 0.4 * 0.2**3, abs=1e-11)
        assert event.speed == pytest.approx(2.0 * 0.6 * abs(np.sin(angle)), rel=1e-10)


@pytest.mark.parametrize("k", [2, 7, 13, 16])
def test_a_motion_ends_where_its_law_is_no_number(k):
    """No state lies where the root of the law has none: a step that would go there is made shorter, or told."""
    system = bf.System(1.0, 0.05, 1.0, [HarmonicForce(1.5), Force(lambda u, s: -math.sqrt(0.7 - u), site=0)],
                       omega=0.9 + 0.01 * k)
    motion = bf.simulate(system, (-0.1 * (k % 7), 0.0), periods=10)
    assert not motion.success and "left the finite numbers" in motion.message
    assert motion.y[:, 0].max() <= 0.7 < motion.y[:, 0].max() + 1e-5
