"""Concentric rotors in coordinates that turn with the spin: synchronous rub is an equilibrium, partial rub a limit cycle.

Against closed forms (Zhang 2008, sections 4.2 and 5.3) and eigenvalues of a second implementation by complex steps.
"""
import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from tests.reference import rub

SETS = {"S1": (0.05, 0.2, 25.0, 0.1), "S2": (0.05, 0.2, 4.0, 0.05), "S3": (0.1, 0.4, 30.0, 0.05),
        "own": (0.08, 0.35, 12.0, 0.15)}
KNOWN_FOLDS = {"S1": (3.33844085794, 1.65483746847), "S2": (1.79940624106, 2.19251442131), "S3": (4.98839393762, 4.28990934871)}


def parameters(name, nu=1.0):
    zeta, eccentricity, stiffness, friction = SETS[name]
    return {"zeta": zeta, "nu": nu, "eccentricity": eccentricity, "stiffness": stiffness, "friction": friction}


def radius(solution):
    return float(np.hypot(solution.state[0], solution.state[1]))


@pytest.fixture(scope="module")
def branches():
    made = {}
    for name in SETS:
        zeta, eccentricity, stiffness, friction = SETS[name]
        nu = np.linspace(1.0, 9.0, 1601)
        last = max(v for v in nu if len(rub.synchronous_rub(zeta, v, eccentricity, stiffness, friction)) > 0)
        system = bf.systems.rotating_frame_rotor(**parameters(name))
        made[name] = bf.trace(bf.find_equilibrium(system), "nu", bounds=(0.5, 1.1 * last)), last
    return made


@pytest.mark.parametrize("name", SETS)
def test_contact_begins_at_its_speeds(branches, name):
    branch, _ = branches[name]
    found = sorted(point.parameter for point in branch.special_points.of("boundary_equilibrium"))
    assert found == pytest.approx(rub.contact_speeds(SETS[name][0], SETS[name][1]), abs=1e-12)


@pytest.mark.parametrize("name", SETS)
def test_radii_of_synchronous_rub(branches, name):
    branch, _ = branches[name]
    zeta, eccentricity, stiffness, friction = SETS[name]
    for nu, x, y in zip(branch.column("nu"), branch.column("q_0"), branch.column("q_1"), strict=True):
        A = float(np.hypot(x, y))
        if A > 1.0 + 1e-9:
            a = 1.0 - nu**2 + stiffness + 1j * (2.0 * zeta * nu + friction * stiffness)
            assert abs(A * a - stiffness * (1.0 + 1j * friction)) == pytest.approx(eccentricity * nu**2, abs=1e-11)
        else:
            assert A == pytest.approx(eccentricity * nu**2 / abs(1.0 - nu**2 + 2j * zeta * nu), abs=1e-12)


@pytest.mark.parametrize("name", SETS)
def test_synchronous_rub_ends_in_a_fold(branches, name):
    branch, last = branches[name]
    zeta, eccentricity, stiffness, friction = SETS[name]
    (point,) = branch.special_points.of("fold")
    nu, A = rub.synchronous_fold(zeta, eccentricity, stiffness, friction, 0.95 * last, 1.05 * last)
    assert point.parameter == pytest.approx(nu, abs=1e-10) and radius(point.solution) == pytest.approx(A, abs=1e-9)
    if name in KNOWN_FOLDS:
        assert (point.parameter, radius(point.solution)) == pytest.approx(KNOWN_FOLDS[name], abs=1e-9)


def growth(name, nu, which):
    """Return the largest real part among the complex eigenvalues of the smaller (0) or larger (-1) synchronous rub."""
    zeta, eccentricity, stiffness, friction = SETS[name]
    A = rub.synchronous_rub(zeta, nu, eccentricity, stiffness, friction)[which]
    values = rub.synchronous_eigenvalues(zeta, nu, A, stiffness, friction)
    return max(value.real for value in values if abs(value.imag) > 1e-9)


def test_hopf_points(branches):
    branch, _ = branches["S3"]
    upper = [point for point in branch.special_points.of("hopf") if point.parameter < 3.0]
    assert len(upper) == 1
    assert (upper[0].parameter, radius(upper[0].solution)) == pytest.approx((2.84898186863, 1.43738998232), abs=1e-8)
    for point in branch.special_points.of("hopf"):
        which = -1 if point is upper[0] else 0
        nu = brentq(lambda v, side=which: growth("S3", v, side), point.parameter - 0.01, point.parameter + 0.01, xtol=1e-14)
        assert point.parameter == pytest.approx(nu, abs=1e-10)
    assert not branches["S1"][0].special_points.of("hopf") and not branches["S2"][0].special_points.of("hopf")


@pytest.mark.parametrize("name", SETS)
def test_stability_along_the_branches(branches, name):
    branch, _ = branches[name]
    zeta, eccentricity, stiffness, friction = SETS[name]
    rows = branch.column("stable"), branch.column("nu"), branch.column("q_0"), branch.column("q_1")
    for stable, nu, x, y in zip(*rows, strict=True):
        A = float(np.hypot(x, y))
        if A > 1.0 + 1e-6:
            top = rub.synchronous_eigenvalues(zeta, nu, A, stiffness, friction).real.max()
            if abs(top) > 1e-7:
                assert bool(stable) == (top < 0.0)
    for stable, nu, x, y in zip(*rows, strict=True):
        A, roots = float(np.hypot(x, y)), rub.synchronous_rub(zeta, nu, eccentricity, stiffness, friction)
        if name in ("S1", "S2") and len(roots) and A > 1.0 + 1e-6 and nu > 0.94 and abs(A - roots[-1]) < 1e-9:
            assert bool(stable) == (name == "S2")  # on the branch that is real past the upper contact speed


@pytest.mark.parametrize(("name", "nu"), [("S1", 0.95), ("S1", 1.05), ("S2", 1.0), ("S3", 1.1), ("own", 1.05)])
def test_eigenvalues_of_synchronous_rub(name, nu):
    rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(**parameters(name, nu)))
    assert rest.success and rest.contacts["stator"] == "slip+"
    zeta, eccentricity, stiffness, friction = SETS[name]
    (A,) = rub.synchronous_rub(zeta, nu, eccentricity, stiffness, friction)
    assert radius(rest) == pytest.approx(A, abs=1e-11)
    known = rub.synchronous_eigenvalues(zeta, nu, A, stiffness, friction)
    assert np.abs(np.sort_complex(rest.eigenvalues) - np.sort_complex(known)).max() < 1e-10
    known = rub.rotating_eigenvalues(rest.state, **parameters(name, nu))
    assert np.abs(np.sort_complex(rest.eigenvalues) - np.sort_complex(known)).max() < 1e-10


def test_a_stiff_stator_loses_synchronous_rub_where_damping_meets_friction():
    # S3 with a stiffness of 1e9: fast instability near nu = zeta / friction
    system = bf.systems.rotating_frame_rotor(zeta=0.1, nu=1.25, eccentricity=0.4, stiffness=1e9, friction=0.05)
    start = bf.find_equilibrium(system)
    assert start.success and start.contacts["stator"] == "slip+"
    (point,) = bf.trace(start, "nu", bounds=(1.25, 2.1)).special_points.of("hopf")
    assert point.parameter == pytest.approx(2.0000000141, abs=2e-8)


CASING = {"zeta": 0.05, "eccentricity": 0.2, "stiffness": 100.0, "friction": 0.05, "casing_mass": 2.0, "casing_damping": 2.0,
          "casing_stiffness": 50.0}


def test_synchronous_rub_in_a_casing():
    for changes in ({"nu": 0.95}, {"nu": 1.05}, {"nu": 1.0, "casing_mass": 0.7, "friction": 0.12, "stiffness": 60.0}):
        given = {**CASING, **changes}
        rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(**given))
        assert rest.success and rest.contacts["stator"] == "slip+"
        reached = float(np.hypot(*(rest.state[:2] - rest.state[2:4])))
        assert reached == pytest.approx(rub.casing_radii(**given)[-1], abs=1e-11)
        assert np.abs(rub.rotating_rates(rest.state, **given)).max() < 1e-11
        known = rub.rotating_eigenvalues(rest.state, **given)
        assert np.abs(np.sort_complex(rest.eigenvalues) - np.sort_complex(known)).max() < 1e-8
        assert rest.stable


def test_the_larger_synchronous_rub_in_a_casing_is_followed_past_the_contact_speed():
    start = bf.find_equilibrium(bf.systems.rotating_frame_rotor(nu=1.05, **CASING))
    branch = bf.trace(start, "nu", bounds=(1.05, 1.6))
    for nu in (1.2, 1.5):
        at = int(np.argmin(np.abs(branch.column("nu") - nu)))
        rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(nu=nu, **CASING), guess=branch.orbits[at].state)
        reached = float(np.hypot(*(rest.state[:2] - rest.state[2:4])))
        assert rest.stable and reached == pytest.approx(rub.casing_radii(nu=nu, **CASING)[-1], abs=1e-11)
        known = rub.rotating_eigenvalues(rest.state, nu=nu, **CASING)
        assert np.abs(np.sort_complex(rest.eigenvalues) - np.sort_complex(known)).max() < 1e-8


PARTIAL = [  # set, nu; phase, radial and tangential speed where contact begins, duration of a cycle; multipliers
    ((0.05, 0.2, 25.0, 0.1), 1.05, (0.494991532551500, 0.399877697525815, 0.813385564365961), 2.27848135049533,
     (0.631 + 0.530j, 0.933)),
    ((0.05, 0.2, 25.0, 0.1), 1.5, (-0.120114075116678, 1.22979754603221, -0.343127462700508), 2.02815563570395,
     (0.594 + 0.666j, 0.837)),
    ((0.05, 0.4, 30.0, 0.05), 1.5, (0.056201521742793, 1.38616185219428, 1.05085777335450), 1.47285488997251,
     (0.508 + 0.714j, 0.970))]


def turning_state(nu, phase, radial, tangential):
    """Return the state in the rotating frame at |z| = 1 from phase nu t - arg z and the speeds in the fixed frame."""
    n = np.exp(-1j * phase)
    v = (radial + 1j * (tangential - nu)) * n
    return np.array([n.real, n.imag, v.real, v.imag])


@pytest.mark.parametrize(("given", "nu", "entry", "duration", "multipliers"), PARTIAL)
def test_partial_rub_is_an_orbit_of_the_rotating_frame(given, nu, entry, duration, multipliers):
    zeta, eccentricity, stiffness, friction = given
    system = bf.systems.rotating_frame_rotor(zeta=zeta, nu=nu, eccentricity=eccentricity, stiffness=stiffness, friction=friction)
    y0 = turning_state(nu, *entry)
    orbit = bf.find_orbit(system, guess=y0, period=duration)
    assert orbit.success and orbit.stable and orbit.sequence.events == 2
    assert orbit.period == pytest.approx(duration, abs=1e-12)
    motion = bf.simulate(system, orbit.state, duration=2.0 * duration)
    begins = [event for event in motion.events if event.kind == "contact"]
    assert np.abs(motion(begins[0].time) - y0).max() < 1e-11
    found = sorted(orbit.multipliers, key=lambda value: -value.imag)
    assert abs(found[0] - multipliers[0]) < 1e-3 and abs(found[1] - multipliers[1]) < 1e-3
    # in the fixed frame it comes back turned by nu T, in another implementation, and so do its neighbours
    numbers = {"zeta": zeta, "nu": nu, "eccentricity": eccentricity, "stiffness": stiffness, "friction": friction,
               "disk_radius": 20.0}
    y = fixed(next(y for y in orbit.sample(9)[1] if abs(np.hypot(*y[:2]) - 1.0) > 0.03), nu)
    h, M = 1e-4, np.empty((4, 4))
    for k, e in enumerate(np.eye(4)):
        near = [turned(rub.elastic_rotor(y + m * h * e, duration, **numbers), -nu * duration) for m in (1, -1, 2, -2)]
        M[:, k] = (8.0 * (near[0] - near[1]) - near[2] + near[3]) / (12.0 * h)
    known = np.linalg.eigvals(M)
    known = np.delete(known, np.argmin(np.abs(known - 1.0)))  # the shift along the orbit
    assert np.abs(np.sort_complex(known) - np.sort_complex(orbit.multipliers)).max() < 1e-6
    end = rub.elastic_rotor(fixed(orbit.state, nu), duration, **numbers)
    assert np.abs(end - turned(fixed(orbit.state, nu), nu * duration)).max() < 1e-10


def fixed(y, nu):
    """Return the state in the fixed frame at the instant when both frames coincide."""
    return np.array([y[0], y[1], y[2] - nu * y[1], y[3] + nu * y[0]])


def turned(y, angle):
    """Return a state of the fixed frame turned by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * y[0] - s * y[1], s * y[0] + c * y[1], c * y[2] - s * y[3], s * y[2] + c * y[3]])


@pytest.mark.parametrize(("name", "nu"), [("S2", 1.0), ("S3", 1.0)])
def test_multipliers_of_synchronous_rub_in_the_fixed_frame(name, nu):
    zeta, eccentricity, stiffness, friction = SETS[name]
    orbit = bf.find_orbit(bf.systems.jeffcott_rotor(offset=0.0, **parameters(name, nu)))
    (A,) = rub.synchronous_rub(zeta, nu, eccentricity, stiffness, friction)
    assert orbit.success and np.abs(np.hypot(*orbit.sample(30)[1][:, :2].T) - A).max() < 1e-11
    known = np.exp(rub.synchronous_eigenvalues(zeta, nu, A, stiffness, friction) * orbit.period)
    assert np.abs(np.sort_complex(known) - np.sort_complex(orbit.multipliers)).max() < 1e-8


def test_guards_that_are_laws_are_measured_by_their_gradient():
    # r^2 - 1 relative to |r^2 - 1| + |gradient| |p|: a smooth function of the radius, not its sign
    rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(nu=0.3))
    for r in (0.2, 0.7, 1.0 - 1e-9, 1.0, 1.5):
        value = rest.field.guards(r * rest.state / radius(rest))
        assert value == pytest.approx([(r * r - 1.0) / (abs(r * r - 1.0) + 2.0 * r * r)], abs=1e-15)


@pytest.mark.parametrize("nu", [1.3, 0.7])
def test_motions_are_those_of_the_fixed_frame(nu):
    """z = w exp(i nu t) through contacts that rub on a small disk, where the turning of the frame weighs in the sliding speed."""
    given = {"zeta": 0.08, "nu": nu, "eccentricity": 0.4, "stiffness": 12.0, "friction": 0.3, "disk_radius": 0.6}
    z0, v0 = 0.9 + 0.5j, 0.4 - 0.8j
    fixed = bf.simulate(bf.systems.jeffcott_rotor(**given, offset=0.0), [z0.real, z0.imag, v0.real, v0.imag], periods=2)
    u0 = v0 - 1j * nu * z0
    times = np.linspace(0.0, 2.0, 9) * 2.0 * np.pi / nu
    turning = bf.simulate(bf.systems.rotating_frame_rotor(**given), [z0.real, z0.imag, u0.real, u0.imag], duration=times[-1])
    a, b = fixed(times), turning(times)
    assert len(fixed.events) >= 1
    assert (b[:, 0] + 1j * b[:, 1]) * np.exp(1j * nu * times) == pytest.approx(a[:, 0] + 1j * a[:, 1], abs=1e-8)
