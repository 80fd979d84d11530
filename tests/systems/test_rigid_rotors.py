"""Rotors in a rigid stator: orbits to 12 digits of a 20-digit computation, an exact flow between impacts, chatter into sliding."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import bifurc as bf
from tests.reference.rub import contact_speeds


def exact_rotor(y0, duration, *, zeta, nu, eccentricity, restitution, friction, disk_radius, offset=0.0, gravity=0.0):
    """Return the state (4,) after a time from phase 0, and the speeds of the impacts: flights by the matrix exponential."""
    A = np.zeros((7, 7))
    A[:2, 2:4] = np.eye(2)
    A[2:4, :2], A[2:4, 2:4] = -np.eye(2), -2.0 * zeta * np.eye(2)
    A[2:4, 4:6], A[3, 6] = eccentricity * nu**2 * np.eye(2), -gravity
    A[4, 5], A[5, 4] = -nu, nu
    x, t, speeds = np.array([*y0, 1.0, 0.0, 1.0]), 0.0, []

    def gap(s, x):
        p = (expm(A * s) @ x)[:2]
        return np.hypot(p[0] - offset, p[1]) - 1.0

    while True:
        step, s, found = 0.01, 1e-7, None
        while s < duration - t:
            end = min(s + step, duration - t)
            if gap(end, x) >= 0.0:
                found = brentq(gap, s, end, args=(x,), xtol=1e-15, rtol=1e-15)
                break
            s = end
        if found is None:
            return (expm(A * (duration - t)) @ x)[:4], speeds
        x = expm(A * found) @ x
        t += found
        n = (x[:2] - [offset, 0.0]) / np.hypot(x[0] - offset, x[1])
        tangent = np.array([-n[1], n[0]])
        u, slide = n @ x[2:4], tangent @ x[2:4] + disk_radius * nu
        x[2:4] -= (1.0 + restitution) * u * n + np.sign(slide) * min(friction * (1.0 + restitution) * u, abs(slide)) * tangent
        speeds.append(u)


CASES = [  # changes, guess, strobe, speeds of the impacts
    ({"nu": 1.1}, (0.614748, -0.786382, 0.479129, 0.409780), (0.697139, 0.580959, 0.219927)),
    ({"nu": 1.1}, (0.549840, -0.870811, 0.426325, 0.318274), (0.7776, 0.6500)),
    ({"nu": 1.7}, (0.1086, -0.3676, 0.8083, -1.1052), None),
    ({"nu": 1.0, "restitution": 0.8, "friction": 0.05, "disk_radius": 10.0}, (0.63373, -0.42636, 0.24671, 0.41158), None)]


@pytest.mark.parametrize(("changes", "guess", "speeds"), CASES)
def test_impacting_orbits(changes, guess, speeds):
    system = bf.systems.rigid_stator_rotor(**changes)
    orbit = bf.find_orbit(system, guess=guess)
    assert orbit.success and np.abs(orbit.state - guess).max() < 3e-4
    end, found = exact_rotor(orbit.state, orbit.period, **system.parameters)
    assert np.abs(end - orbit.state).max() < 1e-11
    assert np.abs(np.array([event.speed for event in bf.simulate(system, orbit.state, periods=1).events]) - found).max() < 1e-10
    if speeds is not None:
        assert np.abs(np.array(speeds) - found).max() < 5.1e-5
    h, M = 1e-6, np.empty((4, 4))
    for k in range(4):
        moved = [exact_rotor(orbit.state + sign * h * np.eye(4)[k], orbit.period, **system.parameters)[0] for sign in (1, -1)]
        M[:, k] = (moved[0] - moved[1]) / (2.0 * h)
    ours = np.sort_complex(orbit.multipliers)
    assert np.abs(np.sort_complex(np.linalg.eigvals(M)) - ours).max() < 1e-7


def test_the_wall_is_reached_and_followed():
    system = bf.systems.rigid_stator_rotor(nu=1.7)
    motion = bf.simulate(system, (0.5, 0.0, 0.0, 0.0), periods=60)
    assert motion.success and motion.modes[-1][-1] == "slip+"
    t, y = motion.sample(400)
    late = t > motion.events[-1].end + 1.0
    p, since = y[late, :2] - [0.5, 0.0], t[late] - motion.events[-1].end
    # between events the constraint is kept by its acceleration: rounding adds up in proportion to the time
    assert (np.abs(np.hypot(*p.T) - 1.0) / since).max() < 5e-13
    assert (np.abs((p * y[late, 2:]).sum(axis=1)) / since).max() < 5e-13


def test_sliding_on_the_wall_obeys_its_equation():
    system = bf.systems.rigid_stator_rotor(nu=1.7)
    motion = bf.simulate(system, (0.5, 0.0, 0.0, 0.0), periods=60)
    start = motion.events[-1].end + 2.0
    zeta, nu, ecc, mu, disk, d = (system.parameters[k] for k in ("zeta", "nu", "eccentricity", "friction", "disk_radius", "offset"))

    def rate(t, s):
        angle, w = s
        n, tangent = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        f = ecc * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - 2.0 * zeta * w * tangent - np.array([d, 0.0]) - n
        normal = f @ n + w * w
        assert normal > 0.0
        return [w, f @ tangent - mu * normal * np.sign(w + disk * nu)]

    a, b = motion(start), motion(start + 5.0)
    angle = np.arctan2(a[1], a[0] - d)
    w = -np.sin(angle) * a[2] + np.cos(angle) * a[3]
    end = solve_ivp(rate, (start, start + 5.0), [angle, w], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    assert abs(b[0] - d - np.cos(end[0])) < 1e-10 and abs(b[1] - np.sin(end[0])) < 1e-10
    assert abs(-np.sin(end[0]) * b[2] + np.cos(end[0]) * b[3] - end[1]) < 1e-10


def chattering_rotor(y0, *, zeta, nu, eccentricity, restitution, friction, disk_radius, offset, gravity=0.0, slow=1e-6):
    """Return the state (4,) a period after phase 0: flights by DOP853, impacts down to the speed ``slow``, then sliding along
    the wall in its angle until the wall no longer pushes."""
    period, short = 2.0 * np.pi / nu, np.inf
    t, y, sliding = 0.0, np.array(y0, float), abs(np.hypot(y0[0] - offset, y0[1]) - 1.0) < 1e-12
    tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}

    def load(t, x, v):
        return eccentricity * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - [0.0, gravity] - 2.0 * zeta * v - x

    def flight(t, y):
        return np.concatenate([y[2:], load(t, y[:2], y[2:])])

    def wall(t, s):
        n = np.array([np.cos(s[0]), np.sin(s[0])])
        f = load(t, np.array([offset, 0.0]) + n, s[1] * np.array([-n[1], n[0]]))
        return n @ f + s[1] ** 2, n[0] * f[1] - n[1] * f[0]

    def slide(t, s):
        push, along = wall(t, s)
        return [s[1], along - friction * push * np.sign(s[1] + disk_radius * nu)]

    def leaves(t, s):
        return wall(t, s)[0]

    def hits(t, y):
        return np.hypot(y[0] - offset, y[1]) - 1.0

    hits.terminal, hits.direction = True, 1
    leaves.terminal, leaves.direction = True, -1
    while True:
        if sliding:
            angle = np.arctan2(y[1], y[0] - offset)
            n = np.array([np.cos(angle), np.sin(angle)])
            part = solve_ivp(slide, (t, period), [angle, n[0] * y[3] - n[1] * y[2]], events=leaves, **tight)
            a, w = part.y[:, -1]
            y = np.array([offset + np.cos(a), np.sin(a), -w * np.sin(a), w * np.cos(a)])
        else:
            part = solve_ivp(flight, (t, period), y, events=hits, max_step=short, **tight)
            y = part.y[:, -1].copy()
        t = part.t[-1]
        if part.status == 0:
            return y
        n = (y[:2] - [offset, 0.0]) / np.hypot(y[0] - offset, y[1])
        tangent = np.array([-n[1], n[0]])
        y[:2] -= 1e-15 * n  # behind the wall, for the next root
        short = np.inf
        if sliding:
            sliding = False
            continue
        u, rub = n @ y[2:], tangent @ y[2:] + disk_radius * nu
        y[2:] -= (1.0 + restitution) * u * n + np.sign(rub) * min(friction * (1.0 + restitution) * u, abs(rub)) * tangent
        sliding = u < slow
        back = -(n @ load(t, y[:2], y[2:]) + (tangent @ y[2:]) ** 2)
        if u < 0.05 and back < 0.0:  # thrown back at once: no step over the short flight
            short = 0.3 * restitution * u / -back


@pytest.mark.parametrize("changes", [{"nu": 1.4}, {"nu": 1.3}])
def test_orbits_that_chatter_into_sliding(changes):
    system = bf.systems.rigid_stator_rotor(**changes)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable and "..." in orbit.sequence.text(orbit.scene)
    assert np.sort(np.abs(orbit.multipliers))[:2] == pytest.approx(0.0, abs=1e-9)  # what sliding has forgotten
    end = chattering_rotor(orbit.state, **system.parameters)
    assert np.abs(end - orbit.state).max() < 1e-7


def steady(nu, digits=50, zeta=0.1, eccentricity=0.3):
    """Return the free motion at phase 0 as complex numbers of mpmath, displacement and velocity."""
    import mpmath as mp

    with mp.workdps(digits):
        nu = mp.mpf(nu)
        z = mp.mpf(eccentricity) * nu**2 / (1 - nu**2 + 2j * mp.mpf(zeta) * nu)
        return z, 1j * nu * z


def entry_speed(nu, zeta=0.1, eccentricity=0.3, offset=0.5):
    """Return the radial speed with which the free motion |z e^{i nu t} - d| = 1 first leaves the circle, a number of mpmath."""
    import mpmath as mp

    A, d = abs(steady(nu, 50, zeta, eccentricity)[0]), mp.mpf(offset)
    return A * d * mp.mpf(nu) * mp.sin(mp.acos((A * A + d * d - 1) / (2 * A * d)))


@pytest.mark.parametrize("exponent", range(-12, -1))
@pytest.mark.parametrize("changes", [{}, {"zeta": 0.04, "eccentricity": 0.25, "offset": 0.3}])
def test_speeds_just_past_grazing(exponent, changes):
    import mpmath as mp

    zeta, eccentricity, offset = (changes.get(k, v) for k, v in (("zeta", 0.1), ("eccentricity", 0.3), ("offset", 0.5)))
    step = 10.0**exponent
    nu = contact_speeds(zeta, eccentricity, offset)[0] * (1.0 + step)
    system = bf.systems.rigid_stator_rotor(nu=nu, **changes)
    z, v = steady(nu, 50, zeta, eccentricity)
    motion = bf.simulate(system, [float(part) for part in (z.real, z.imag, v.real, v.imag)], periods=1)
    found = motion.events[0].speed
    with mp.workdps(50):
        # the speed is a square root: it moves by eps / (2 step) of itself where nu, or the height 1, is rounded
        low, high = (float(entry_speed(mp.mpf(nu) * (1 + sign * 3 * mp.mpf(2) ** -53), zeta, eccentricity, offset))
                     for sign in (-1, 1))
        known = float(entry_speed(nu, zeta, eccentricity, offset))
    assert low * (1.0 - 1e-9) <= found <= high * (1.0 + 1e-9)
    assert step < 0.9e-10 or found == pytest.approx(known, rel=1e-6)
    assert changes or step > 1e-4 or known == pytest.approx(0.88665951 * step**0.5, rel=10.0 * step + 1e-7 + 1.2e-16 / step)


@pytest.mark.parametrize("changes", [{}, {"offset": 0.3, "eccentricity": 0.2, "zeta": 0.05}])
def test_branches_begin_at_the_speed_of_grazing(changes):
    parameters = {"offset": 0.5, "eccentricity": 0.3, "zeta": 0.1, **changes}
    known = contact_speeds(parameters["zeta"], parameters["eccentricity"], parameters["offset"])[0]
    orbit = bf.find_orbit(bf.systems.rigid_stator_rotor(nu=0.95 * known, **changes))
    branch = bf.trace(orbit, "nu", bounds=(0.9 * known, 1.02 * known))
    assert branch.special_points.of("grazing")[0].parameter == pytest.approx(known, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("y0", [(0.0, 0.0, 0.0, 0.0), (0.3, 0.2, 0.0, 0.1)])
def test_chaos_between_rigid_impacts(y0):
    # three runs of another implementation gave .0893, .0902, .0892, each with a standard error of .002; 2.43 impacts a turn
    zeta, nu, restitution = 0.05, 1.2, 0.9
    system = bf.systems.rigid_stator_rotor(zeta=zeta, nu=nu, eccentricity=0.3, offset=0.6, restitution=restitution, friction=0.0)
    found = bf.lyapunov_exponents(system, y0, periods=4000, transient=200)
    assert found.chaotic and abs(found.values[0] - 0.0895) < 3.0 * np.hypot(found.errors[0], 0.0012)
    impacts = (found.values.sum() + 4.0 * zeta) / (2.0 * np.log(restitution)) * 2.0 * np.pi / nu  # each contracts by e^2
    assert impacts == pytest.approx(2.43, abs=0.03)


@pytest.mark.parametrize("nu", [1.0465, 1.0468, 1.0469])
def test_a_short_release_with_fifty_impacts_behind_it_is_an_orbit_with_the_multipliers_of_its_simulation(nu):
    """Sustained rub that lets go for a moment: the flights are short and say little about the distance from the wall."""
    offset = 0.159
    rotor = bf.systems.rigid_stator_rotor(zeta=0.0804, nu=nu, eccentricity=0.459, restitution=0.815, friction=0.12,
                                          disk_radius=9.43, offset=offset)
    settled = bf.simulate(rotor, (1.0091, -0.5264, 0.4436, 0.7164), periods=60)
    orbit = bf.find_orbit(rotor, guess=settled(60 * rotor.period))
    assert orbit.success and len(orbit.events) > 50
    back = bf.simulate(rotor, orbit.state, periods=1)(rotor.period)
    np.testing.assert_allclose(back, orbit.state, atol=1e-13)
    turn = np.array([[np.cos(1e-4), -np.sin(1e-4)], [np.sin(1e-4), np.cos(1e-4)]])  # a start that stays on the wall
    beside = np.concatenate((turn @ (orbit.state[:2] - [offset, 0.0]) + [offset, 0.0], turn @ orbit.state[2:]))
    motion = bf.simulate(rotor, beside, periods=4)
    d = [motion(k * rotor.period) - orbit.state for k in range(4)]
    total, product = np.linalg.lstsq(np.column_stack((np.concatenate(d[1:3]), -np.concatenate(d[:2]))), np.concatenate(d[2:4]),
                                     rcond=None)[0]
    slow = sorted(orbit.multipliers, key=abs)[-2:]
    np.testing.assert_allclose((sum(slow), np.prod(slow)), (total, product), rtol=1e-3)
    assert abs(sum(slow) - total) < 1e-4
