"""Rolling, sliding and flying inside a ring: against an independent event-driven point, closed forms of rolling, at all scales."""
import itertools

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStator, HarmonicForce, RigidStator
from tests.reference import whirl

EYE = np.eye(2)


def ring(damping=0.1, load=0.0, nu=1.0, radius=1.0, rate=1.0, mass=1.0, **stator):
    """Return a point of some mass and natural rate in a rigid ring; ``load`` turns with ``nu``."""
    forces = () if load == 0.0 else (HarmonicForce(load, dof=0), HarmonicForce(load, dof=1, phase=-0.5 * np.pi))
    return bf.System(mass * EYE, mass * damping * rate * EYE, mass * rate**2 * EYE, [*forces, RigidStator(radius=radius, **stator)],
                     omega=None if load == 0.0 else nu)


SHARED = ("damping", "load", "nu", "restitution", "friction", "surface_speed")


def drawn(number):
    """Return numbers of a ring, a start, and whether that is on the wall."""
    rng = np.random.default_rng(number)
    given = {"damping": rng.uniform(0.02, 0.5), "load": rng.choice([0.0, rng.uniform(0.5, 2.0)]), "nu": rng.uniform(0.5, 2.5),
             "restitution": rng.choice([0.0, 0.3, 0.6]), "friction": rng.choice([0.05, 0.2, 1.0]),
             "surface_speed": rng.choice([-1.0, 1.0]) * rng.uniform(0.0, 4.0)}
    angle, on_wall = rng.uniform(-3.0, 3.0), bool(rng.integers(2))
    n, s = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    start = np.concatenate([n, rng.uniform(-3.0, 3.0) * s]) if on_wall else np.concatenate([rng.uniform(0.0, 0.9) * n,
                                                                                            rng.normal(size=2)])
    return {name: float(value) for name, value in given.items()}, start, on_wall


@pytest.mark.parametrize("number", range(8))
def test_motions_inside_a_ring_are_those_of_an_independent_integration(number):
    given, start, on_wall = drawn(number)
    ours = bf.simulate(ring(**given), start, duration=7.0)
    final, mode, _ = whirl.motion(start, 7.0, on_wall=on_wall, **given)
    assert ours.success and ours.modes[-1][-1] == mode
    assert np.abs(ours.final - final).max() < 1e-8


SCALES = list(itertools.product((1e-6, 1.0, 1e6), (1e-3, 1.0, 1e4)))


@pytest.mark.parametrize(("radius", "rate"), SCALES)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_start_on_a_ring_within_rounding_rolls_on_it(radius, rate, way):
    # rolling backward at the rate 1.94: press = 1.94^2 - 1, friction 2 * .05 * 1.94 below .1 of it
    system = ring(radius=radius, rate=rate, mass=1e-3, restitution=0.5, friction=0.1, surface_speed=way * 1.94 * radius * rate)
    period = 2.0 * np.pi / (1.94 * rate)
    for angle, off in ((0.0, 3e-14), (1.0, 0.0), (2.5, 3e-14), (-2.0, 1e-12)):
        n, s = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        start = np.concatenate([(1.0 + off) * radius * n, -way * 1.94 * radius * rate * s])
        motion = bf.simulate(system, start, duration=5.0 * period)
        assert motion.success and not len(motion.events) and motion.modes[-1] == ("roll",)
        unit = np.array([radius, radius, radius * rate, radius * rate])
        assert np.abs((motion.final - start) / unit).max() < 1e-11
    with pytest.raises(ValueError, match="beyond the stop"):
        bf.simulate(system, np.concatenate([(1.0 + 1e-6) * radius * n, 0.0 * s]), duration=period)


@pytest.mark.parametrize("surface_speed", [1.94, -2.5])
def test_a_whirl_that_rolls_is_found_with_its_period(surface_speed):
    system = ring(restitution=0.5, friction=0.1, surface_speed=surface_speed)
    orbit = bf.find_orbit(system, (1.0, 0.0, 0.0, -surface_speed))
    assert orbit.success and orbit.stable
    assert orbit.period == pytest.approx(2.0 * np.pi / abs(surface_speed), abs=1e-11)
    assert np.abs(np.hypot(*orbit.sample(20)[1][:, :2].T) - 1.0).max() < 1e-12


ONSET = 0.5 + np.sqrt(1.25)  # damping .1 = 2 zeta, friction .1: rate at which 2 zeta rate = friction (rate^2 - 1)
NEAR = [sign * size for size in (1e-9, 1e-11, 1e-12, 3e-13, 1e-13, 1e-14, 1e-15, 0.0) for sign in (1.0, -1.0)]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_rolling_near_its_limit_goes_on_or_slides(way):
    for off in NEAR:
        speed = way * (ONSET + off)
        motion = bf.simulate(ring(restitution=0.5, friction=0.1, surface_speed=speed), (1.0, 0.0, 0.0, -speed), duration=20.0)
        assert motion.success and len(motion.events) <= 20
        # sliding leaves the limit as exp(rate t) times its distance: either way the motion is near the rolling one
        turned = -speed * 20.0
        rolled = np.array([np.cos(turned), np.sin(turned), speed * np.sin(turned), -speed * np.cos(turned)])
        assert np.abs(motion.final - rolled).max() < 1e-12 + 1e4 * abs(off)
        if abs(off) >= 3e-13:  # the friction asked for differs from its limit by sqrt(5) / 10 off, of forces of size 1
            assert motion.modes[0] == (("roll",) if off > 0.0 else ("slip+",) if way > 0.0 else ("slip-",))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_rolling_in_an_elastic_ring_near_its_limit_goes_on_or_slides(way):
    stiffness, zeta, friction = 40.0, 0.05, 0.1
    rate = zeta / friction + np.sqrt(1.0 + (zeta / friction)**2)
    radius = 1.0 / (1.0 - 2.0 * zeta * rate / (friction * stiffness))  # Zhang 2008, section 4.2
    for off in NEAR:
        speed = way * rate * radius * (1.0 + off)
        # at another speed the rolling whirl has another radius: stiffness / (stiffness + 1 - rate^2)
        at = rolling_radius(stiffness, abs(speed))
        system = bf.System(EYE, 2.0 * zeta * EYE, EYE, [ElasticStator(stiffness=stiffness, friction=friction, surface_speed=speed)])
        motion = bf.simulate(system, (at, 0.0, 0.0, -speed), duration=15.0)
        assert motion.success and len(motion.events) <= 40
        turned = -speed / at * 15.0
        rolled = np.array([at * np.cos(turned), at * np.sin(turned), speed * np.sin(turned), -speed * np.cos(turned)])
        assert np.abs(motion.final - rolled).max() < 1e-11 + 1e4 * abs(off)


def rolling_radius(stiffness, speed):
    """Return the radius of the rolling whirl: r (stiffness + 1 - (speed / r)^2) = stiffness."""
    r = 1.0
    for _ in range(100):
        r = (stiffness + speed**2 / r) / (stiffness + 1.0)
    return r
