"""Hard and bad cases of rotors that rub: each ends in the right motion, a named status, or one clear sentence."""
import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.orbits.concentric import concentric
from tests.reference.rub import contact_speeds, elastic_rotor


def test_a_motion_through_the_centre_of_the_stator():
    # r = 0: nothing has a direction to turn, and nothing happens
    zeta, x0 = 0.05, 0.8
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=1.0, eccentricity=0.0, offset=0.0)
    motion = bf.simulate(system, (x0, 0.0, 0.0, 0.0), periods=2)
    t, y = motion.sample(200)
    wd = np.sqrt(1.0 - zeta**2)
    known = x0 * np.exp(-zeta * t) * (np.cos(wd * t) + zeta / wd * np.sin(wd * t))
    assert motion.success and np.abs(y[:, 0] - known).max() < 1e-12 and np.abs(y[:, 1]).max() == 0.0


@pytest.mark.parametrize("y0", [(0.6, 1.5, 0.3, 0.0), (1.9, 0.0, -0.2, 0.4), (0.6, -1.2, 0.0, 0.0)])
def test_a_start_inside_the_elastic_wall(y0):
    system = bf.systems.jeffcott_rotor()
    motion = bf.simulate(system, y0, periods=1)
    assert motion.success
    assert np.abs(elastic_rotor(np.array(y0), system.period, **system.parameters) - motion.final).max() < 1e-9


def test_a_stiff_stator():
    system = bf.systems.jeffcott_rotor(stiffness=1e6)
    motion = bf.simulate(system, (0.3, 0.2, 0.0, 0.0), periods=3)
    assert motion.success and np.isfinite(motion.final).all()
    depth = np.hypot(motion.sample(400)[1][:, 0] - 0.6, motion.sample(400)[1][:, 1]) - 1.0
    assert depth.max() < 3e-3  # the speed over the frequency of the contact


@pytest.mark.parametrize("builder", [bf.systems.jeffcott_rotor, bf.systems.rigid_stator_rotor, bf.systems.rotor_in_casing])
def test_spin_zero_is_refused_where_it_is_the_clock(builder):
    with pytest.raises(ValueError, match="nu"):
        builder(nu=0.0)


def test_spin_zero_is_a_rotor_at_rest_in_the_other_frame():
    rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(nu=0.0))
    assert rest.success and rest.stable and np.abs(rest.state).max() == 0.0


def test_concentric_rotors_are_told_from_others():
    s = bf.systems
    assert concentric(s.jeffcott_rotor(offset=0.0)) and concentric(s.rotor_in_casing()) and concentric(s.oil_film_rotor(load=0.0))
    assert concentric(s.rigid_stator_rotor(offset=0.0)) and concentric(s.jeffcott_rotor(offset=0.0, eccentricity=0.0))
    for system in (s.jeffcott_rotor(), s.jeffcott_rotor(offset=0.0, gravity=0.1), s.oil_film_rotor(), s.impact_oscillator(),
                   s.snubber_rotor()):
        assert not concentric(system)


def test_partial_rub_of_a_concentric_rotor_is_not_looked_for_by_turns():
    system = bf.systems.jeffcott_rotor(offset=0.0, nu=1.05, stiffness=25.0, friction=0.1)
    orbit = bf.find_orbit(system)
    assert not orbit.success and orbit.status == "concentric" and "rotating_frame_rotor" in orbit.message
    for nu, friction, stiffness in ((1.5, 0.1, 25.0), (1.0, 0.05, 4.0)):  # no rub, and synchronous rub, are orbits of one turn
        orbit = bf.find_orbit(system.with_parameters(nu=nu, friction=friction, stiffness=stiffness))
        assert orbit.success and orbit.sequence.events == 0
        r = np.hypot(*orbit.sample(50)[1][:, :2].T)
        assert np.ptp(r) < 1e-12


@pytest.mark.parametrize("step", [1e-4, 1e-8, 1e-12])
def test_two_crossings_of_the_wall_in_one_step_are_not_stepped_over(step):
    # the whirl without rub reaches the wall at nu; a little faster it is beyond it for a time of the root of the step
    nu = contact_speeds(0.05, 0.2, 0.6)[0] * (1.0 + step)
    system = bf.systems.jeffcott_rotor(nu=nu)
    z = 0.2 * nu**2 / (1.0 - nu**2 + 0.1j * nu)
    motion = bf.simulate(system, (z.real, z.imag, (1j * nu * z).real, (1j * nu * z).imag), periods=1)
    kinds = [str(event.kind) for event in motion.events]
    assert motion.success and kinds == ["contact", "separation"]
    assert 0.5 * step**0.5 < motion.events[1].time - motion.events[0].time < 20.0 * step**0.5


def test_the_turning_of_the_normal_is_in_the_multipliers():
    system = bf.systems.rigid_stator_rotor(nu=1.7)
    orbit = bf.find_orbit(system, guess=(0.1086, -0.3676, 0.8083, -1.1052))
    h, M = 1e-6, np.empty((4, 4))
    for k in range(4):  # differences of the motion know nothing of saltation
        ends = [bf.simulate(system, orbit.state + sign * h * np.eye(4)[k], periods=1).final for sign in (1, -1)]
        M[:, k] = (ends[0] - ends[1]) / (2.0 * h)
    assert np.abs(np.sort_complex(np.linalg.eigvals(M)) - np.sort_complex(orbit.multipliers)).max() < 1e-7


def test_friction_at_an_impact_that_could_reverse_the_sliding_stops_it():
    # the disk turns so slowly that friction (1 + e) u is more than the sliding speed
    system = bf.systems.rigid_stator_rotor(nu=1.0, eccentricity=0.0, offset=0.0, friction=0.5, disk_radius=0.1, zeta=0.0)
    motion = bf.simulate(system, (0.9, 0.0, 1.0, 0.05), duration=0.3)
    hit = motion.events[0]
    assert str(hit.kind) == "impact"
    n = hit.after[:2]
    assert abs(n[0] * hit.after[3] - n[1] * hit.after[2] + 0.1) < 1e-14  # what is left is the speed of rolling
    assert hit.after[2:] @ hit.after[2:] < hit.before[2:] @ hit.before[2:]


def test_rolling_holds_the_surface_speed():
    # friction is an unknown of the rolling mode, within its cone; dry whirl needs no load
    zeta, stiffness, friction, surface = 0.05, 25.0, 0.1, 4.0
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=surface / 20.0, eccentricity=0.0, stiffness=stiffness, friction=friction,
                                       offset=0.0)
    # turn A = surface, A = k / (k + 1 - turn^2)
    roots = np.roots([surface, stiffness, -surface * (stiffness + 1.0)])
    turn = float(roots[roots > 0.0][0])
    radius = surface / turn
    motion = bf.simulate(system, (radius, 0.0, 0.0, -surface), periods=1)
    _, y = motion.sample(200)
    r = np.hypot(y[:, 0], y[:, 1])
    sliding = (y[:, 0] * y[:, 3] - y[:, 1] * y[:, 2]) / r + surface
    assert motion.success and motion.modes[-1][-1] == "roll"
    assert np.abs(sliding).max() < 1e-10 and np.abs(r - radius).max() < 1e-9


@pytest.mark.parametrize("quarter", range(3))  # near -y it never is
def test_rolling_on_a_rigid_wall_ends_where_the_friction_cone_is_left(quarter):
    # nearly along x or y the tangential acceleration, which vanishes, is one coordinate's alone: forces of order one that cancel
    zeta, nu, eccentricity, friction, radius, offset = 0.1, 1.7, 0.3, 0.1, 2.0, 0.5
    system = bf.systems.rigid_stator_rotor(nu=nu)
    turn = -radius * nu

    def beyond(t, t1, angle):  # on the rolling motion that has this angle at t1
        turned = angle + turn * (t - t1)
        f = -2j * zeta * turn - 1.0 - offset * np.exp(-1j * turned) + eccentricity * nu**2 * np.exp(1j * (nu * t - turned))
        return abs(f.imag) - friction * (f.real + turn**2)

    tried = 0
    for away in (3e-2, 1e-3, 2.5e-4, -8.9e-4, -1e-5, 1e-7):
        angle = quarter * np.pi / 2.0 + away
        times = np.linspace(0.0, system.period, 60)
        values = [beyond(t, t, angle) for t in times]
        for t0, t1, v0, v1 in zip(times[:-1], times[1:], values[:-1], values[1:], strict=True):
            if v0 * v1 > 0.0:
                continue
            slips = brentq(lambda t, angle=angle: beyond(t, t, angle), t0, t1, xtol=1e-14)
            before = slips - 0.02
            if not (beyond(before, slips, angle) < 0.0 < beyond(slips + 1e-3, slips, angle)):
                continue
            q = np.exp(1j * (angle - turn * 0.02))
            v = 1j * turn * q
            motion = bf.simulate(system, (offset + q.real, q.imag, v.real, v.imag), duration=0.04, t0=before)
            assert motion.success and motion.modes[0][-1] == "roll" and str(motion.events[0].kind) == "slip"
            assert motion.events[0].time == pytest.approx(slips, abs=1e-12) and len(motion.events) == 1
            tried += 1
    assert tried >= 6
