"""Journals on a short oil film: rest, Hopf speed, orbits and multipliers against the pressure integrated, and closed forms."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import bifurc as bf
from tests.elements.test_bearings import pressure


def eccentricity(load):
    """Return the eccentricity at rest under a load, from Ocvirk's static force."""
    def left(e):
        return np.hypot(4.0 * e**2 / (1.0 - e**2) ** 2, np.pi * e / (1.0 - e**2) ** 1.5) - load
    return brentq(left, 1e-12, 1.0 - 1e-9, xtol=1e-16, rtol=1e-15)


@pytest.mark.parametrize(("load", "known"), [(0.1, 0.0317568729725), (2.0, 0.414795689696), (10.0, 0.704790370650),
                                             (5000.0, 0.985896315058), (20000.0, 0.992938527821), (0.7, None), (300.0, None)])
def test_the_journal_at_rest(load, known):
    rest = bf.find_equilibrium(bf.systems.oil_film_journal(speed_ratio=1.0, load=load, mass=1.0))
    e = float(np.hypot(*rest.state[:2]))
    assert rest.success and e == pytest.approx(eccentricity(load), abs=1e-12)
    assert known is None or e == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize(("load", "critical", "whirl"), [(0.1, 0.762643991573977, 0.500305512),
                                                         (2.0, 12.8936782078841, 0.523591257),
                                                         (10.0, 140.649741962245, 0.332915700)])
def test_the_mass_at_which_the_journal_whirls(load, critical, whirl):
    rest = bf.find_equilibrium(bf.systems.oil_film_journal(speed_ratio=1.0, load=load, mass=0.5 * critical))
    assert rest.stable
    (point,) = bf.trace(rest, "mass", bounds=(0.3 * critical, 1.6 * critical)).special_points
    assert point.kind == "hopf" and point.parameter == pytest.approx(critical, rel=1e-10)
    assert np.abs(point.solution.eigenvalues.imag).min() == pytest.approx(whirl, abs=1e-9) or \
        np.sort(np.abs(point.solution.eigenvalues.imag))[-1] == pytest.approx(whirl, abs=1e-9)


@pytest.mark.parametrize("load", [5000.0, 20000.0])
def test_a_heavily_loaded_journal_never_whirls(load):
    for mass in (1.0, 1e3, 1e6):
        rest = bf.find_equilibrium(bf.systems.oil_film_journal(speed_ratio=1.0, load=load, mass=mass))
        assert rest.success and rest.stable


def test_the_hopf_speed():
    branch = bf.trace(bf.find_equilibrium(bf.systems.oil_film_journal(speed_ratio=0.7)), "speed_ratio", bounds=(0.5, 1.5))
    (point,) = branch.special_points
    assert point.kind == "hopf" and point.parameter == pytest.approx(0.82212133384945, abs=1e-11)
    assert np.abs(point.solution.eigenvalues.imag).max() == pytest.approx(0.520038512, abs=1e-9)
    assert point.solution.lyapunov_coefficient() < 0.0
    (orbit,) = bf.switch_branch(point)  # oil whirl
    assert orbit.success and orbit.stable
    assert np.abs(journal(orbit.state, orbit.period, orbit.parameters["speed_ratio"], 0.0) - orbit.state).max() < 1e-9


def journal(y0, duration, speed_ratio, unbalance, load=1.0, mass=10.0):
    """Return the state (4,) after a time from phase 0, by DOP853 with the pressure integrated at every stage."""
    M = mass * speed_ratio

    def field(t, y):
        f = pressure(*y)
        return [y[2], y[3], f[0] / M + unbalance * np.cos(t), (f[1] - load / speed_ratio) / M + unbalance * np.sin(t)]
    return solve_ivp(field, (0.0, duration), y0, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]


@pytest.mark.parametrize(("speed_ratio", "unbalance", "multiplier"), [(1.0, 0.2, -1.46825)])
def test_orbits_under_unbalance(speed_ratio, unbalance, multiplier):
    system = bf.systems.oil_film_rotor(speed_ratio=speed_ratio, unbalance=unbalance)
    orbit = bf.find_orbit(system, guess=(0.2, -0.3, 0.0, 0.0), periods=1)
    assert orbit.success and orbit.periods == 1
    assert np.abs(journal(orbit.state, orbit.period, speed_ratio, unbalance) - orbit.state).max() < 1e-9
    if multiplier is not None:
        assert orbit.multipliers[0] == pytest.approx(multiplier, abs=1e-5) and orbit.stable is False
        assert bf.find_orbit(system).periods == 2  # half-speed whirl by a flip


def differences(end, y, h=1e-4):
    """Return the derivative (n, n) of a motion's end by its start, by differences of fourth order."""
    M = np.empty((len(y), len(y)))
    for k, e in enumerate(np.eye(len(y))):
        M[:, k] = (8.0 * (end(y + h * e) - end(y - h * e)) - end(y + 2.0 * h * e) + end(y - 2.0 * h * e)) / (12.0 * h)
    return M


@pytest.mark.parametrize(("speed_ratio", "unbalance", "load", "mass"), [(0.7, 0.1, 1.0, 10.0), (1.2, 0.3, 3.0, 6.0),
                                                                      (0.9, 0.05, 0.4, 2.5)])
def test_orbits_under_other_unbalances_and_loads(speed_ratio, unbalance, load, mass):
    system = bf.systems.oil_film_rotor(speed_ratio=speed_ratio, unbalance=unbalance, load=load, mass=mass)
    rest = bf.find_equilibrium(bf.systems.oil_film_journal(speed_ratio=speed_ratio, load=load, mass=mass))
    orbit = bf.find_orbit(system, guess=rest.state, periods=1)
    assert orbit.success

    def end(y):
        return journal(y, orbit.period, speed_ratio, unbalance, load, mass)

    assert np.abs(end(orbit.state) - orbit.state).max() < 1e-9
    known = np.linalg.eigvals(differences(end, orbit.state))
    assert np.abs(np.sort_complex(known) - np.sort_complex(orbit.multipliers)).max() < 1e-5


def rubbing_journal(y0, duration, *, speed_ratio, unbalance, load, journal_mass, disk_mass, shaft_stiffness, disk_damping,
                    journal_damping, clearance, stiffness, friction, disk_radius):
    """Return the state (8,) of journal and disk, positions first, after a time from phase 0, by DOP853 from contact to contact."""
    k, W = shaft_stiffness / speed_ratio, load / speed_ratio
    m1, m2 = journal_mass * speed_ratio, disk_mass * speed_ratio
    share = journal_mass / (journal_mass + disk_mass)

    def field(t, y, rubs):
        q1, q2, v1, v2 = y.reshape(4, 2)
        f1 = pressure(*q1, *v1) - journal_damping * v1 - k * (q1 - q2) - [0.0, share * W]
        f2 = m2 * unbalance * np.array([np.cos(t), np.sin(t)]) - disk_damping * v2 - k * (q2 - q1) - [0.0, (1.0 - share) * W]
        if rubs:
            r = np.hypot(*q2)
            n = q2 / r
            tangent = np.array([-n[1], n[0]])
            f2 = f2 - stiffness / speed_ratio * (r - clearance) * (n + friction * np.sign(tangent @ v2 + disk_radius) * tangent)
        return np.concatenate([v1, v2, f1 / m1, f2 / m2])

    def wall(t, y, rubs):
        return np.hypot(y[2], y[3]) - clearance

    t, y, events = 0.0, np.array(y0), 0
    rubs = wall(t, y, False) > 0.0
    while True:
        wall.terminal, wall.direction = True, -1 if rubs else 1
        part = solve_ivp(field, (t, duration), y, args=(rubs,), events=wall, method="DOP853", rtol=1e-12, atol=1e-12)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            return y, events
        rubs, events = not rubs, events + 1


@pytest.mark.parametrize(("changes", "beyond"), [({"speed_ratio": 0.5, "unbalance": 0.3, "load": 2.0}, 0.7),
                                                 ({"speed_ratio": 0.4, "clearance": 0.35}, 1.0)])
def test_eight_states_with_rub(changes, beyond):
    start = bf.find_orbit(bf.systems.oil_film_rub_rotor(**changes), periods=1)
    assert start.success and start.stable
    branch = bf.trace(start, "speed_ratio", bounds=(changes["speed_ratio"], beyond), direction=1)
    # contact begins and ends in grazings alone: the disk always slides
    assert {str(point.kind) for point in branch.special_points} <= {"grazing", "period_doubling"}
    assert branch.ends[1].reason == "bound"
    touched = 0
    for orbit in (start, branch.orbits[len(branch) // 2], branch.orbits[-1]):
        end, events = rubbing_journal(orbit.state, orbit.period, **orbit.parameters)
        assert np.abs(end - orbit.state).max() < 1e-10 and events == orbit.sequence.events
        touched += events
    assert touched >= 2


def test_the_flip_into_half_speed_whirl():
    orbit = bf.find_orbit(bf.systems.oil_film_rotor(), guess=(0.2, -0.3, 0.0, 0.0), periods=1)
    flips = bf.trace(orbit, "speed_ratio", bounds=(0.5, 1.2)).special_points.of("period_doubling")
    assert len(flips) == 2
    for flip in flips:
        assert np.abs(flip.solution.multipliers + 1.0).min() < 1e-9
        end = journal(flip.solution.state, flip.solution.period, flip.parameter, 0.2)
        assert np.abs(end - flip.solution.state).max() < 1e-9


def test_a_journal_under_load_is_told_what_it_needs():
    with pytest.raises(ValueError, match="speed_ratio"):
        bf.systems.oil_film_rotor(speed_ratio=0.0)
    with pytest.raises(ValueError, match="clearance"):
        bf.systems.oil_film_rub_rotor(clearance=-0.5)
