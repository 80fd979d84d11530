"""Hard and bad cases of contacts on circles, one after the other of those that a rub can meet: against closed forms, and motions
of scipy's DOP853."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import bifurc as bf
from bifurc import System
from bifurc import elements as el
from bifurc.elements import ElasticStator, RigidStator
from studies.elastic_to_rigid import ORBITS, PARAMETERS, RESTITUTION, damping_ratio
from tests.elements.test_bearings import pressure

PLANE = np.eye(2)
TIGHT = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}


@pytest.mark.parametrize(("builder", "changes", "named"), [
    ("jeffcott_rotor", {"offset": 1.01}, "offset"), ("rigid_stator_rotor", {"offset": -1.5}, "offset"),
    ("oil_film_rub_rotor", {"clearance": -0.1}, "clearance"), ("snubber_rotor", {"preload": -0.2}, "preload"),
    ("jeffcott_rotor", {"stiffness": 0.0, "contact_damping": 0.4}, "stiffness"),
    ("snubber_rotor", {"stiffness": 0.0, "contact_damping": 0.4}, "stiffness"),
    ("rotating_frame_rotor", {"stiffness": 0.0, "contact_damping": 0.4}, "stiffness"),
    ("rigid_stator_rotor", {"restitution": 1.2}, "restitution"), ("jeffcott_rotor", {"friction": -0.1}, "friction"),
    ("rotor_in_casing", {"casing_mass": 0.0}, "casing_mass"), ("oil_film_rotor", {"load": np.nan}, "load")])
def test_what_no_rotor_can_have_is_refused_by_name(builder, changes, named):
    with pytest.raises(ValueError, match=f"{named} = "):
        getattr(bf.systems, builder)(**changes)


@pytest.mark.parametrize("surface_speed", [3.0, -1.0])
@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_at_rest_on_a_stator_whose_centre_lies_outside(surface_speed, friction):
    # |z - d| = r with d = 1.5: the spring pulls to z = 0, beyond the wall, and the rub holds against the pull along it
    d, stiffness, sign = 1.5, 30.0, np.sign(surface_speed)

    def balance(angle, radius):  # force along the wall, friction taken off; radial force of the wall
        z = d + radius * np.exp(1j * angle)
        f = -z * np.exp(-1j * angle)
        return f.imag - sign * friction * f.real, f.real

    angle = brentq(lambda a: balance(a, 1.0)[0], np.pi - 1.0, np.pi + 1.0, xtol=1e-15)
    known = d + np.exp(1j * angle)
    assert balance(angle, 1.0)[1] > 0.0
    system = System(PLANE, 0.1 * PLANE, PLANE, [RigidStator(centre_x=d, friction=friction, surface_speed=surface_speed)])
    rest = bf.find_equilibrium(system)
    assert rest.success and rest.stable and rest.contacts["rigid_stator"] == ("slip+" if sign > 0.0 else "slip-")
    assert np.abs(rest.state - [known.real, known.imag, 0.0, 0.0]).max() < 1e-12
    slope = (balance(angle + 1e-5, 1.0)[0] - balance(angle - 1e-5, 1.0)[0]) / 2e-5
    assert rest.eigenvalues == pytest.approx(np.roots([1.0, 0.1, -slope]), abs=1e-8)

    def elastic(y):
        z = complex(*y) - d
        n = z / abs(z)
        return -(z + d) - stiffness * (abs(z) - 1.0) * n * (1.0 + 1j * sign * friction)

    soft = bf.find_equilibrium(System(PLANE, 0.1 * PLANE, PLANE, [ElasticStator(stiffness=stiffness, centre_x=d, friction=friction,
                                                                                surface_speed=surface_speed)]))
    assert soft.success and soft.stable and abs(elastic(soft.state[:2])) < 1e-12


def test_a_start_beyond_a_rigid_wall_is_told_how_far():
    system = System(PLANE, 0.1 * PLANE, PLANE, [RigidStator(centre_x=1.5)])
    with pytest.raises(ValueError, match="y0 lies 0.5 beyond the stop 'rigid_stator'"):
        bf.simulate(system, (0.0, 0.0, 0.0, 0.0), duration=1.0)
    with pytest.raises(ValueError, match="y0 lies 0.3 beyond"):
        bf.find_orbit(bf.systems.rigid_stator_rotor(), guess=(1.8, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(("release", "ratio"), [("force", 0.45098), ("penetration", 0.37233)])
@pytest.mark.parametrize("stiffness", [1.0, 1e9])
def test_restitution_of_a_damped_contact_depends_on_where_it_ends(release, ratio, stiffness):
    beta = 0.3
    b = np.sqrt(1.0 - beta**2)
    turn = np.arctan2(2.0 * beta * b, 2.0 * beta**2 - 1.0) if release == "force" else np.pi
    known = np.exp(-beta / b * turn)
    assert known == pytest.approx(ratio, abs=6e-6)
    root = np.sqrt(stiffness)
    system = System(PLANE, 0.0 * PLANE, 0.0 * PLANE, [ElasticStator(stiffness=stiffness, damping=2.0 * beta * root, friction=0.0,
                                                                    release=release)])
    motion = bf.simulate(system, (0.6, 0.0, 0.8, 0.0), duration=0.5 + 4.0 / root)
    assert motion.final[2] == pytest.approx(-0.8 * known, abs=1e-10) and motion.final[3] == 0.0
    ends = [event.time for event in motion.events]
    assert ends[1] - ends[0] == pytest.approx(turn / (root * b), rel=1e-6)


def two_walls(y0, duration, zeta, nu, size, stiffness):
    """Return the state (2,) of x'' + 2 zeta x' + x + stiffness (|x| - 1)+ sgn x = size cos nu t after a time, by DOP853."""
    def field(t, y, side):
        return [y[1], size * np.cos(nu * t) - 2.0 * zeta * y[1] - y[0] - (stiffness * (y[0] - side) if side else 0.0)]

    def wall(t, y, side):
        return (y[0] - 1.0) * (y[0] + 1.0) if side == 0.0 else side * y[0] - 1.0

    t, y, side = 0.0, np.array(y0, float), 0.0 if abs(y0[0]) < 1.0 else np.sign(y0[0])
    while True:
        wall.terminal, wall.direction = True, -1 if side else 1
        part = solve_ivp(field, (t, duration), y, args=(side,), events=wall, max_step=0.1, **TIGHT)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            return y
        side = 0.0 if side else float(np.sign(y[0]))


@pytest.mark.parametrize(("zeta", "nu", "size", "stiffness", "guess"), [(0.1, 0.9, 0.6, 6.0, None),
                                                                       (0.08, 1.2, 0.9, 14.0, (1.1757, 0.0, 0.7541, 0.0))])
def test_an_orbit_through_the_centre_of_the_stator(zeta, nu, size, stiffness, guess):
    # loaded along x alone, without friction: through r = 0 from wall to wall; the second is unstable aside
    system = System(PLANE, 2.0 * zeta * PLANE, PLANE, [el.HarmonicForce(size), ElasticStator(stiffness=stiffness, friction=0.0)],
                    omega=nu)
    orbit = bf.find_orbit(system, guess=guess)
    assert orbit.success and orbit.stable is (guess is None)
    _, y = orbit.sample(400)
    assert np.abs(y[:, [1, 3]]).max() == 0.0 and y[:, 0].min() < -1.0 and y[:, 0].max() > 1.0
    assert np.abs(two_walls(orbit.state[[0, 2]], orbit.period, zeta, nu, size, stiffness) - orbit.state[[0, 2]]).max() < 1e-11


@pytest.mark.parametrize(("name", "constant"), [("one impact, nu = 1.7", 7.95825), ("three impacts, nu = 1.1", 0.56583)])
def test_orbits_of_a_stator_of_stiffness_1e9(name, constant):
    nu, guess = ORBITS[name]
    stiffness = 1e9
    rigid = bf.find_orbit(bf.systems.rigid_stator_rotor(nu=nu, restitution=RESTITUTION, **PARAMETERS), guess=guess)
    damping = 2.0 * damping_ratio(RESTITUTION) * stiffness**0.5
    system = bf.systems.jeffcott_rotor(nu=nu, stiffness=stiffness, contact_damping=damping, **PARAMETERS)
    orbit = bf.find_orbit(system, guess=rigid.state)
    assert rigid.success and orbit.success
    assert np.abs(orbit.state - rigid.state).max() * stiffness**0.5 == pytest.approx(constant, rel=2e-4)


def test_a_journal_that_passes_exact_half_speed_whirl():
    # x - 2 y' = y + 2 x' = 0: no pressure anywhere, the direction of the force is that of what comes next
    system, y0 = bf.systems.oil_film_rotor(), (0.3, 0.4, -0.2, 0.15)
    motion = bf.simulate(system, y0, periods=1)

    def field(t, y):
        f = pressure(*y)
        return [y[2], y[3], f[0] / 10.0 + 0.2 * np.cos(t), (f[1] - 1.0) / 10.0 + 0.2 * np.sin(t)]

    known = solve_ivp(field, (0.0, system.period), y0, **TIGHT).y[:, -1]
    assert motion.success and np.abs(motion.final - known).max() < 1e-10


@pytest.mark.parametrize("y0", [(0.8, 0.7, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)])
def test_a_journal_beyond_its_bearing_goes_nowhere(y0):
    motion = bf.simulate(bf.systems.oil_film_rotor(), y0, periods=1)
    assert not motion.success and motion.status == "diverged"


def test_friction_turns_with_the_sliding_of_a_slow_disk():
    # too little grip to roll: the sliding passes through zero in contact and friction turns round
    zeta, nu, stiffness, friction, disk = 0.02, 1.0, 8.0, 0.05, 0.4
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=nu, eccentricity=0.5, stiffness=stiffness, friction=friction, offset=0.3,
                                       disk_radius=disk)
    y0 = (1.2, 0.3, 0.5, -0.7)
    motion = bf.simulate(system, y0, duration=9.0)
    modes = [mode[-1] for mode in motion.modes]
    assert motion.success and {"slip+", "slip-"} <= set(modes)

    def parts(y):
        p = np.array([y[0] - 0.3, y[1]])
        r = np.hypot(*p)
        n = p / r
        return r, n, np.array([-n[1], n[0]])

    def field(t, y, touching, sign):
        r, n, tangent = parts(y)
        f = 0.5 * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - 2.0 * zeta * y[2:] - y[:2]
        return np.concatenate([y[2:], f - (stiffness * (r - 1.0) * (n + friction * sign * tangent) if touching else 0.0)])

    def wall(t, y, touching, sign):
        return parts(y)[0] - 1.0

    def slides(t, y, touching, sign):
        return parts(y)[2] @ y[2:] + disk * nu

    wall.terminal = slides.terminal = True
    t, y = 0.0, np.array(y0)
    touching, sign = wall(t, y, 0, 0) > 0.0, np.sign(slides(t, y, 0, 0))
    while True:
        wall.direction, slides.direction = -1 if touching else 1, -sign
        part = solve_ivp(field, (t, 9.0), y, args=(touching, sign), events=(wall, slides), max_step=0.05, **TIGHT)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            break
        touching, sign = (not touching, sign) if len(part.t_events[0]) else (touching, -sign)
    assert np.abs(motion.final - y).max() < 1e-9


def test_a_rotor_in_a_casing_that_sticks_is_one_in_a_fixed_stator():
    """What the wall and what friction on the casing hold is one solve: without an impact the casing never moves."""
    def system(*held, **against):
        n = 4 if held else 2
        masses = np.diag([1.0, 1.0, 2.0, 2.0][:n])
        return bf.System(masses, 0.1 * np.eye(n), np.eye(n), [
            el.HarmonicForce(0.3, dof=0), el.ConstantForce(-3.0, dof=1),
            el.RigidStator(radius=0.4, restitution=0.3, friction=0.1, **against), *held], omega=1.3)
    place, along = 0.4 * np.array([np.cos(1.2), -np.sin(1.2)]), 0.3 * np.array([np.sin(1.2), np.cos(1.2)])
    fixed = bf.simulate(system(), [*place, *along], duration=3.0)
    casing = system(el.Coulomb(100.0, dof=2), el.Coulomb(100.0, dof=3), against_x=2, against_y=3)
    held = bf.simulate(casing, [*place, 0.0, 0.0, *along, 0.0, 0.0], duration=3.0)
    assert held.success and [e.time for e in held.events] == pytest.approx([e.time for e in fixed.events], abs=1e-12)
    assert len(fixed.events) == 3 and {e.kind for e in fixed.events} == {bf.elements.EventKind.STICK}
    np.testing.assert_allclose(held.final[[0, 1, 4, 5]], fixed.final, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(held.final[[2, 3, 6, 7]], 0.0)


def test_a_casing_that_is_pressed_onto_its_stop_passes_the_load_on():
    """A rotor that slides on the wall of a casing at rest on a stop: reaction of the stop from the equations of motion."""
    system = bf.System(np.eye(4), 0.05 * np.eye(4), np.eye(4), [
        el.HarmonicForce(0.2, dof=1), el.ConstantForce(2.0, dof=0), el.ConstantForce(1.5, dof=2),
        el.RigidStator(radius=0.4, restitution=0.0, friction=0.0, against_x=2, against_y=3),
        el.RigidStop(0.1, 0.0, dof=2)], omega=1.1)
    start = np.array([0.1 + 0.4 * np.cos(0.5), 0.4 * np.sin(0.5), 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    motion = bf.simulate(system, start, duration=2.0)
    assert motion.success
    t = np.linspace(0.0, 2.0, 41)
    q, h = motion(t)[:, :4], 1e-4
    gap = np.hypot(q[:, 0] - q[:, 2], q[:, 1] - q[:, 3]) - 0.4
    np.testing.assert_allclose(gap, 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(q[:, 2], 0.1, rtol=0, atol=1e-13)
    # on the casing in y acts what the wall gives, on the rotor its opposite: together they move as if there were none
    inner = t[1:-1]
    states = motion(inner)
    rates = (motion(inner + h)[:, 4:] - motion(inner - h)[:, 4:]) / (2.0 * h)
    load = 0.2 * np.cos(1.1 * inner) - 0.05 * (states[:, 5] + states[:, 7]) - states[:, 1] - states[:, 3]
    np.testing.assert_allclose(rates[:, 1] + rates[:, 3], load, rtol=0, atol=1e-6)
    normal = np.array([states[:, 0] - states[:, 2], states[:, 1] - states[:, 3]]) / 0.4
    push = np.array([rates[:, 0] - 2.0 + 0.05 * states[:, 4] + states[:, 0], -rates[:, 3] - 0.05 * states[:, 7] - states[:, 3]])
    np.testing.assert_allclose(push[0] * normal[1] - push[1] * normal[0], 0.0, rtol=0, atol=1e-6)  # along the wall's normal


def test_friction_on_a_mass_that_slides_round_a_wall_turns_with_it():
    """Where the wall is at its farthest, the speed along x is zero at an instant: friction there turns round and cannot hold."""
    friction, radius, speed, angle = 0.1, 0.5, 1.2, 0.6
    system = bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [
        el.HarmonicForce(0.0, dof=0), el.RigidStator(radius=radius, restitution=0.0, friction=0.0), el.Coulomb(friction, dof=0)],
        omega=1.0)
    start = [radius * np.cos(angle), -radius * np.sin(angle), speed * np.sin(angle), speed * np.cos(angle)]
    motion = bf.simulate(system, start, duration=0.8)
    assert motion.success and [(e.element, e.kind.value) for e in motion.events] == [("coulomb", "stick")]
    x, _, vx, vy = motion.final
    travelled = (radius - start[0]) + (radius - x)
    assert 0.5 * (vx**2 + vy**2) == pytest.approx(0.5 * speed**2 - friction * travelled, abs=1e-12)
    assert np.hypot(x, motion.final[1]) == pytest.approx(radius, abs=1e-14)


@pytest.mark.slow
def test_impacts_between_a_stop_and_a_rotor_come_to_rest_at_once():
    """A casing hits a plastic stop with the rotor on its wall: they throw each other to and fro until both rest."""
    system = bf.System(np.diag([1.0, 1.0, 0.7, 0.7]), np.zeros((4, 4)), np.zeros((4, 4)), [
        el.HarmonicForce(0.0, dof=0), el.RigidStator(radius=0.4, restitution=0.0, friction=0.0, against_x=2, against_y=3),
        el.RigidStop(0.1, 0.0, dof=2)], omega=1.0)
    angle, speed = 0.5, 0.3
    start = np.array([0.4 * np.cos(angle), 0.4 * np.sin(angle), 0.0, 0.0, speed, 0.0, speed, 0.0])
    motion = bf.simulate(system, start, duration=0.1 / speed + 1e-9)
    assert motion.success, motion.message
    vx, vy, cx, cy = motion.final[4:]
    # impulses along the normal n and along x: by inertia v - n P, casing + n P with its x at rest, and n . (v - casing) = 0
    n = np.array([np.cos(angle), np.sin(angle)])
    push = n[0] * speed / (1.0 + n[1]**2 / 0.7)
    np.testing.assert_allclose([vx, vy, cx, cy], [speed - n[0] * push, -n[1] * push, 0.0, n[1] * push / 0.7], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_two_rigid_walls_that_hold_one_ring_are_named():
    """Shaft, ring and housing: both walls hold the ring, which is not solved together. Until then no wall is passed."""
    system = bf.System(np.eye(4), 0.1 * np.eye(4), np.eye(4), [
        el.HarmonicForce(0.3, dof=0), el.ConstantForce(-3.0, dof=1), el.ConstantForce(-1.0, dof=3),
        el.RigidStator(radius=0.4, restitution=0.0, friction=0.1, against_x=2, against_y=3, label="ring"),
        el.RigidStator(radius=0.2, restitution=0.0, friction=0.1, x=2, y=3, label="housing")], omega=1.3)
    motion = bf.simulate(system, [0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], duration=2.0)
    assert not motion.success and "'ring' and 'housing' share a body" in motion.message
    x = motion(np.linspace(0.0, motion.stop, 99))
    assert np.hypot(x[:, 0] - x[:, 2], x[:, 1] - x[:, 3]).max() < 0.4 + 1e-12 and np.hypot(x[:, 2], x[:, 3]).max() < 0.2 + 1e-12
