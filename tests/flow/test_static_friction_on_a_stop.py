"""Static friction of a mass that rests on a stop: it lets go beyond the static limit; closed forms of the instants."""
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, Jenkins, RigidStop, Stribeck

OMEGA, KINETIC, STATIC = 0.1, 0.3, 0.42
LOADS = (ConstantForce(-1.0), HarmonicForce(2.0, phase=math.pi))  # -1 - 2 cos(omega t): on the stop at first
ROUGH = Coulomb(KINETIC, static_ratio=STATIC / KINETIC)
FREE = np.zeros((2, 2))


def load(t):
    return -1.0 - 2.0 * math.cos(OMEGA * t)


def instant(limit):
    """When the load reaches a limit, which may be a function of time."""
    return brentq(lambda t: load(t) - (limit(t) if callable(limit) else limit), 5.0, 31.0, xtol=1e-13)


def moves_off(system, y0=None, dof=0):
    """The first time at which the mass has moved by 1e-7, that of its constant state before."""
    motion = bf.simulate(system, np.zeros(2 * system.n) if y0 is None else y0, duration=35.0)
    assert motion.success
    for event in motion.events:
        if abs(motion([event.time + 1e-3])[0, dof]) > 1e-13:
            return event.time
    return None


def on_one_row(stops, *others, **options):
    return bf.System(1.0, options.get("damping", 0.0), options.get("stiffness", 0.0), [*LOADS, *others, *stops], omega=OMEGA)


ROWS = {
    "plastic": on_one_row([RigidStop(0.0, 0.0, side=-1)], ROUGH),
    "rebound": on_one_row([RigidStop(0.0, 0.6, side=-1)], ROUGH),
    "stop first": bf.System(1.0, 0.0, 0.0, [RigidStop(0.0, 0.5, side=-1), ROUGH, *LOADS], omega=OMEGA),
    "row of another length": on_one_row([RigidStop(0.0, 0.5, row=(-2.0,))], ROUGH),
    "two stops": on_one_row([RigidStop(0.0, 0.5, side=-1), RigidStop(0.0, 0.0, side=-1)], ROUGH),
    "spring and dashpot": on_one_row([RigidStop(0.0, 0.3, side=-1)], ROUGH, damping=0.2, stiffness=0.7),
    "given static limit": on_one_row([RigidStop(0.0, 0.3, side=-1)], Coulomb(KINETIC, 0.1, static=STATIC)),
    "law": on_one_row([RigidStop(0.0, 0.5, side=-1)], Stribeck(KINETIC, STATIC, 0.5)),
    "hyperbolic law": on_one_row([RigidStop(0.0, 0.5, side=-1)], Stribeck(KINETIC, STATIC, 0.5, curve="hyperbolic")),
    "two masses on stops, friction between them": bf.System(
        np.eye(2), FREE, FREE, [*LOADS, ConstantForce(-1.0, dof=1), RigidStop(0.0, 0.5, side=-1),
                                RigidStop(0.0, 0.5, side=-1, dof=1), Coulomb(KINETIC, static_ratio=1.4, row=(1.0, -1.0))],
        omega=OMEGA),
}


@pytest.mark.parametrize("name", ROWS)
def test_a_mass_on_a_stop_moves_off_where_the_load_exceeds_static_friction(name):
    assert moves_off(ROWS[name]) == pytest.approx(math.acos(-(1.0 + STATIC) / 2.0) / OMEGA, abs=1e-9)


def test_static_friction_equal_to_kinetic_lets_go_in_one_event():
    motion = bf.simulate(on_one_row([RigidStop(0.0, 0.5, side=-1)], Coulomb(KINETIC)), (0.0, 0.0), duration=30.0)
    assert [(event.element, event.kind.value) for event in motion.events] == [("rigid_stop", "release")]
    assert motion.events[0].time == pytest.approx(instant(KINETIC), abs=1e-10)


def test_no_load_moves_a_mass_without_a_clearance():
    system = on_one_row([RigidStop(0.0, 0.5, side=-1), RigidStop(0.0, 0.0)], ROUGH)
    assert moves_off(system) is None


@pytest.mark.parametrize(("speed", "right"), [(0.1, -KINETIC), (-0.1, KINETIC)])
def test_on_a_belt_that_runs_it_slips(speed, right):
    """The friction of slip pushes one way all the time; what lets go is the stop."""
    belt = Coulomb(KINETIC, static_ratio=1.4, belt_speed=speed)
    assert moves_off(on_one_row([RigidStop(0.0, 0.5, side=-1)], belt)) == pytest.approx(instant(right), abs=1e-10)


def test_a_load_on_the_friction_that_varies_is_taken_at_the_instant():
    rough = Coulomb(KINETIC, static_ratio=1.4, load_amplitude=0.5)
    found = moves_off(on_one_row([RigidStop(0.0, 0.5, side=-1)], rough))
    assert found == pytest.approx(instant(lambda t: STATIC * (1.0 + 0.5 * math.cos(OMEGA * t))), abs=1e-9)


def test_a_second_friction_under_a_load_that_varies_adds_its_limit():
    system = on_one_row([RigidStop(0.0, 0.5, side=-1)], ROUGH, Coulomb(0.2, load_amplitude=0.5))
    found = moves_off(system)
    assert found == pytest.approx(instant(lambda t: STATIC + 0.2 * (1.0 + 0.5 * math.cos(OMEGA * t))), abs=1e-9)


def test_masses_coupled_by_inertia():
    """Row 0 is held, mass 1 is free: a1 = F1/m11, and row 0 carries F0 - m01 a1."""
    mass, other = np.array([[2.0, 0.5], [0.5, 1.0]]), 0.2
    system = bf.System(mass, FREE, FREE, [*LOADS, ConstantForce(other, dof=1), ROUGH, RigidStop(0.0, 0.5, side=-1)], omega=OMEGA)
    assert moves_off(system) == pytest.approx(instant(STATIC + 0.5 * other), abs=1e-9)


def test_masses_coupled_by_a_spring():
    """Mass 1 swings freely, as cos t, and pulls at the one that rests."""
    system = bf.System(np.eye(2), FREE, [[1.0, -0.3], [-0.3, 1.0]], [*LOADS, ROUGH, RigidStop(0.0, 0.5, side=-1)], omega=OMEGA)
    times = np.linspace(20.0, 25.0, 5001)  # the pull swings: the first time
    first = times[np.argmax([load(t) + 0.06 * math.cos(t) > STATIC for t in times])]
    right = brentq(lambda t: load(t) + 0.06 * math.cos(t) - STATIC, first - 1e-3, first, xtol=1e-13)
    assert moves_off(system, [0.0, 0.2, 0.0, 0.0]) == pytest.approx(right, abs=1e-9)


def test_an_elastic_slider_on_a_stop_yields_before_its_limit():
    """Its spring has no force while the mass rests: the stop lets go where the load vanishes."""
    system = on_one_row([RigidStop(0.0, 0.5, side=-1)], Jenkins(1.0, STATIC))
    assert moves_off(system) == pytest.approx(instant(0.0), abs=1e-10)


@pytest.mark.parametrize(("weight", "ratio", "sticks"), [(0.5, 2.0, True), (0.25, 1.0, True), (0.7, 2.0, False), (0.5, 1.0, False)])
def test_a_wall_that_moves_away_leaves_a_mass_that_sticks(weight, ratio, sticks):
    """It carries the mass up to where it turns round; the weight is then within the static limit, or not."""
    wall = RigidStop(0.0, 0.5, side=-1, amplitude=0.1, harmonic=1, phase=math.pi)
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(-weight), Coulomb(KINETIC, static_ratio=ratio), wall], omega=1.0)
    motion = bf.simulate(system, (-0.1, 0.0), duration=6.0)
    q = motion(np.linspace(math.pi, 6.0, 50))[:, 0]
    expected = 0.1 if sticks else -0.1 * np.cos(np.linspace(math.pi, 6.0, 50))
    assert motion.success and np.abs(q - expected).max() < 1e-12
