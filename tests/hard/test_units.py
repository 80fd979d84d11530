"""Results in other units of time, mass and length are the same: nothing may compare a state, a time or a parameter with 1."""
import functools

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, RigidStop, Stribeck

ONES = (1.0, 1.0, 1.0)
UNITS = [(1e6, 1.0, 1.0), (1.0, 1.0, 1e-9), (1e-3, 1e4, 1e-6), (3e-5, 2e3, 7e2)]  # of time, mass, length


def made(units, elements, mass=1.0, damping=0.1, stiffness=1.0, omega=None):
    """A system in other units; ``elements`` are given those of force, stiffness, length and speed."""
    T, M, L = units
    return bf.System(mass * M, damping * M / T, stiffness * M / T**2, elements(M * L / T**2, M / T**2, L, L / T),
                     omega=None if omega is None else omega / T)


@pytest.mark.parametrize("units", UNITS)
def test_stick_slip_on_a_belt(units):
    """Closed form (Coulomb, no damping): slip 2 pi - 2 atan(d/V), stick 2 d/V, d = fs - fk."""
    T = units[0]
    system = made(units, lambda F, K, L, V: [Coulomb(0.6 * F, static_ratio=1.0 / 0.6, belt_speed=0.3 * V)], damping=0.0)
    orbit = bf.find_orbit(system)
    assert orbit.success and abs(orbit.period / T - (2.0 * np.pi - 2.0 * np.arctan(0.4 / 0.3) + 0.8 / 0.3)) < 1e-13


@pytest.mark.parametrize("units", UNITS)
def test_steady_sliding_its_hopf_point_and_criticality(units):
    """x = F(V), eigenvalues of l^2 + (2 zeta + F'(V)) l + 1 = 0, V_H = v_s ln((fs - fk)/(2 zeta v_s)), l1 = zeta/(8 v_s^2)."""
    T, _, L = units
    system = made(units, lambda F, K, L, V: [Stribeck(0.5 * F, F, 0.5 * V, belt_speed=1.6 * V)])
    rest = bf.find_equilibrium(system)
    fall = 0.5 * np.exp(-3.2)
    assert rest.success and rest.stable and rest.residual < 1e-14
    assert rest.state / L == pytest.approx([0.5 + fall, 0.0], abs=1e-14)
    roots = np.sort_complex(np.roots([1.0, 0.1 - fall / 0.5, 1.0]))
    assert np.sort_complex(rest.eigenvalues * T) == pytest.approx(roots, abs=1e-13)
    branch = bf.trace(rest, "stribeck.belt_speed", bounds=(0.5 * L / T, 2.0 * L / T))
    point, = branch.special_points
    assert point.kind == "hopf" and point.parameter / (L / T) == pytest.approx(0.5 * np.log(10.0), rel=1e-11)
    assert point.solution.lyapunov_coefficient() * L**2 * T == pytest.approx(0.025, rel=1e-6)


@pytest.mark.parametrize("units", [(1e6, 1.0, 1.0), (1.0, 1.0, 1e-5), (1.0, 1.0, 1e-6)])
def test_orders_of_births_under_a_law(units):
    """Which derivatives vanish behind an event under a law is asked at states of the size that the motion has."""
    def elements(F, K, L, V):
        return [HarmonicForce(1.1 * F), Stribeck(0.3 * F, 0.5 * F, 0.4 * V)]
    one, other = (bf.find_orbit(made(u, elements, 1.3, 0.11, 0.9, omega=0.63)) for u in (ONES, units))
    T, _, L = units
    assert one.success and other.success and other.signature == one.signature
    assert other.state / [L, L / T] == pytest.approx(one.state, abs=1e-12)


@pytest.mark.parametrize("units", UNITS)
def test_nonlinear_mode(units):
    """Bilinear, gap 1, stiffness 4 in contact, energy 2: 2 pi / T = 1.170544 (closed form)."""
    T, M, L = units
    system = made(units, lambda F, K, L, V: [ElasticStop(L, 4.0 * K)], damping=0.0)
    w = np.sqrt(5.0)
    period = 2.0 * (np.pi - np.arccos(0.5)) + 2.0 / w * np.arctan2(w * np.sqrt(3.0), 1.0)
    assert bf.nonlinear_mode(system, energy=2.0 * M * L**2 / T**2).period / T == pytest.approx(period, rel=1e-12)


@pytest.mark.parametrize("units", UNITS)
def test_a_start_at_rest_beside_a_preloaded_stop(units):
    """The motion that is found is the same one of several."""
    def elements(F, K, L, V):
        return [HarmonicForce(0.7 * F), RigidStop(-0.3 * L, 0.65)]
    one, other = (bf.find_orbit(made(u, elements, 1.3, 0.11, 0.9, omega=1.3)) for u in (ONES, units))
    T, _, L = units
    assert one.success and other.state / [L, L / T] == pytest.approx(one.state, abs=1e-11)


@pytest.mark.parametrize("units", UNITS)
def test_a_diagram_by_simulation(units):
    T, _, L = units
    shown = []
    for u in (ONES, units):
        system = made(u, lambda F, K, L, V: [HarmonicForce(0.52 * F), RigidStop(L, 0.7)], omega=1.1)
        shown.append(bf.bifurcation_diagram(system, "omega", np.array([0.7, 0.9, 1.0, 1.1]) / u[0], transient=100, keep=8))
    assert np.array_equal(*(item.periods for item in shown)) and set(shown[0].periods.ravel()) > {1}


@functools.cache
def proof(units):
    """Return the certificate of a branch with one special point."""
    system = made(units, lambda F, K, L, V: [HarmonicForce(0.52 * F, label="load"), RigidStop(L, 0.7)], omega=0.8)
    F = units[1] * units[2] / units[0]**2
    branch = bf.trace(bf.find_orbit(system), "load.amplitude", bounds=(0.45 * F, 0.55 * F))
    point, = branch.special_points
    assert point.kind == "period_doubling" and point.parameter / F == pytest.approx(0.512672682, abs=1e-9)
    return branch.certify()


@pytest.mark.parametrize("units", UNITS)
def test_a_chain_of_proofs(units):
    """Every stretch is proved in as many pieces; a special point stands for as little of its stretch."""
    found = [proof(ONES), proof(units)]
    assert all(item.proved for item in found), [item.message for item in found]
    pieces = [[stretch.pieces for stretch in item.stretches] for item in found]
    assert max(abs(np.array(pieces[0]) - pieces[1])) <= 1 and min(pieces[1]) >= 1 and max(pieces[0]) > 5


@functools.cache
def gains(units):
    """Return the ends of the stabilising interval of an impact oscillator, without units."""
    system = made(units, lambda F, K, L, V: [HarmonicForce(12.0 * F), RigidStop(L, 0.7)], omega=2.5)
    T, M, L = units
    orbit = bf.find_orbit(system, guess=(-4.0 * L, 8.4 * L / T))
    found = bf.control.feedback_range(orbit, "displacement", (0.0, 0.2 * M / T**2))
    return tuple(end.gain * T**2 / M for end in found.ends)


@pytest.mark.parametrize("units", [UNITS[0], *(pytest.param(units, marks=pytest.mark.slow) for units in UNITS[1:])])
def test_gains_of_a_feedback(units):
    assert gains(ONES) == pytest.approx([0.008897, 0.112742], abs=1e-6)  # docs of feedback_range
    assert gains(units) == pytest.approx(gains(ONES), rel=1e-10)


@pytest.mark.parametrize("units", UNITS)
def test_a_duffing_branch_with_a_stop(units):
    points = []
    for u in (ONES, units):
        system = made(u, lambda F, K, L, V: [HarmonicForce(0.3 * F), CubicSpring(0.8 * K / L**2), RigidStop(1.2 * L, 0.8)],
                      omega=0.6)
        branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5 / u[0], 1.6 / u[0]))
        points.append([(point.kind.value, point.parameter * u[0]) for point in branch.special_points])
    assert points[0] and [kind for kind, _ in points[0]] == [kind for kind, _ in points[1]]
    assert np.array([p for _, p in points[1]]) == pytest.approx(np.array([p for _, p in points[0]]), rel=1e-9)


BOUNCES = [2.0**-30, 2.0**-20, 1e-3, 1.0, 2.0**20, 2.0**30]


@pytest.mark.parametrize("unit", BOUNCES)
@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5])
def test_a_ball_on_a_floor_knows_no_time_but_that_of_its_motion(unit, restitution):
    """Let fall from .5 under 1: impacts at 1, 1 + 2 r, 1 + 2 r + 2 r^2, ..., speeds 1, r, r^2, ...; the last at (1 + r)/(1 - r)."""
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(1.0 / unit**2), RigidStop(0.0, restitution)])
    motion = bf.simulate(system, (-0.5, 0.0), duration=4.7 * unit)
    assert motion.success
    flights = 2.0 * restitution**np.arange(60)
    impacts = np.append(1.0, 1.0 + np.cumsum(flights[1:]))
    if restitution == 0.5:  # all of them are over at 3
        assert motion.final * (1.0, unit) == pytest.approx([0.0, 0.0], abs=1e-12)
        assert [event.kind for event in motion.events][-1] == "chatter" and motion.events[-1].time / unit <= 3.0
        return
    times = np.array([event.time for event in motion.events]) / unit
    assert times == pytest.approx(impacts[impacts < 4.7], abs=1e-12)
    k = len(times)
    lasted = 4.7 - times[-1]
    speed = restitution**k
    assert motion.final * (1.0, unit) == pytest.approx([-speed * lasted + 0.5 * lasted**2, lasted - speed], abs=1e-12)


@pytest.mark.parametrize("unit", BOUNCES)
def test_two_free_masses_that_meet_know_no_time_but_that_of_their_motion(unit):
    """No load: at a distance of 1 with a relative speed of 1 they meet after 1, and exchange their speeds."""
    system = bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [RigidStop(0.0, 1.0, row=(1.0, -1.0))])
    motion = bf.simulate(system, (-1.0, 0.0, 1.0 / unit, 0.0), duration=3.0 * unit)
    event, = motion.events
    assert event.time / unit == pytest.approx(1.0, abs=1e-14)
    assert motion.final * (1.0, 1.0, unit, unit) == pytest.approx([0.0, 2.0, 0.0, 1.0], abs=1e-14)


@pytest.mark.parametrize("unit", BOUNCES)
def test_the_period_of_a_ball_that_bounces_for_ever(unit):
    """2 v / g = 2 sqrt(2 h / g)."""
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(1.0 / unit**2), RigidStop(0.0, 1.0)])
    orbit = bf.find_orbit(system, (-0.5, 0.0))
    assert orbit.success and orbit.period / unit == pytest.approx(2.0, abs=1e-13)
