"""Random motions against time stepping: the rule at events, by a method that has no events.

A wrong rule agrees with itself, in simulation, orbits and audits alike; a difference to these steps that does not fall with them
is what shows it.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, CubicSpring, ElasticStator, HarmonicForce, RigidStator
from bifurc.orbits.standing import NoRoom, resting_start
from studies import branch_audit
from tests.reference.time_stepping import numbers_of, rubbed, stepped

from . import test_random_motions, test_settled_motions, test_sliders

PERIODS = 3
NEAR, FALLS = 1e-4, 0.5  # of places: near enough; by how much the difference must fall with a quarter of the step elsewhere


def strung(seed):
    """Return a random system of masses with contacts, and a cubic spring."""
    system = test_random_motions.drawn(seed)
    return bf.System(system.mass, system.damping, system.stiffness, [*system.elements, CubicSpring(0.5)],
                     omega=system.parameter("omega"))


def mixed(seed):
    """Return a random system of the study's kind that mixes all contacts."""
    return branch_audit.scene("mixed", seed)[0]


DRAWN = {"wide": test_settled_motions.drawn, "many masses": test_random_motions.drawn, "sliders": test_sliders.drawn,
         "mixed": mixed, "cubic": strung}


def pushed(motion):
    """Return whether two stops are hit at one instant: impacts follow one another, where time stepping takes them together."""
    hits = [(event.time, event.element) for event in motion.events if event.kind == "impact"]
    return any(after - before < 1e-12 and one != other for (before, one), (after, other) in zip(hits, hits[1:], strict=False))


def differences(system):
    """Return how far steps of a quarter of the length each are from the motion from rest; None where they cannot tell."""
    try:
        start = resting_start(system)
    except NoRoom:
        return None
    motion = bf.simulate(system, start, periods=PERIODS)
    if numbers_of(system) is None or pushed(motion):
        return None
    assert motion.success, motion.message
    return falling(motion, lambda steps: stepped(system, start, PERIODS, steps))


def falling(motion, stepping):
    """Return how far places are from those of a motion, with steps of a quarter of the length each, until they are near."""
    found = []
    for steps in (2000, 8000, 32000, 128000):
        found.append(float(np.abs(stepping(steps) - motion.final)[:len(motion.system.mass)].max()))
        if found[-1] < NEAR and len(found) > 2:
            break
    return found


def agree(found):
    """Return whether differences end near zero, or fall with the step."""
    return found[-1] < NEAR or found[-1] < FALLS * found[-2] < FALLS**2 * found[-3]


def rotor(seed):
    """Return a random rotor with unbalance in an elastic or a rigid stator, often plastic, the stator, and a start."""
    rng = np.random.default_rng([seed, 5])
    damping, omega = rng.uniform(0.01, 0.2), rng.uniform(0.3, 3.0)
    load = rng.uniform(0.05, 1.0) * omega**2
    weight = -rng.uniform(0.0, 0.3) if rng.random() < 0.5 else 0.0
    K = np.diag([1.0, 1.0 if rng.random() < 0.5 else rng.uniform(0.7, 1.3)])
    crossed = rng.uniform(-0.1, 0.1) if rng.random() < 0.3 else 0.0
    radius, friction = rng.uniform(0.3, 1.0), rng.uniform(0.0, 0.5)
    turning = rng.uniform(-1.0, 1.0) * radius * omega if rng.random() < 0.6 else 0.0
    wall = {"radius": radius, "friction": friction, "surface_speed": turning}
    if rng.random() < 0.6:
        stator = RigidStator(restitution=float(rng.choice([0.0, rng.uniform(0.05, 0.9)])), **wall)
    else:
        stator = ElasticStator(stiffness=rng.uniform(5.0, 100.0), damping=float(rng.choice([0.0, rng.uniform(0.0, 1.0)])), **wall)
    system = bf.System(np.eye(2), 2.0 * damping * np.eye(2), K + [[0.0, crossed], [-crossed, 0.0]], [
        HarmonicForce(load, dof=0), HarmonicForce(load, dof=1, phase=-0.5 * np.pi), ConstantForce(weight, dof=1), stator],
        omega=omega)
    return system, stator, np.array([*rng.uniform(-0.6, 0.6, 2) * radius, *0.3 * rng.normal(size=2)])


@pytest.mark.parametrize(("kind", "seed"), [pytest.param(kind, seed, marks=[pytest.mark.slow] if seed > 1 else [])
                                            for kind in DRAWN for seed in range(7)])
def test_motions_are_those_of_time_stepping(kind, seed):
    found = differences(DRAWN[kind](seed))
    assert found is None or agree(found), found


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=[pytest.mark.slow] if seed > 7 else []) for seed in range(20)])
def test_rotors_rub_as_time_stepping_says(seed):
    system, stator, start = rotor(seed)
    motion = bf.simulate(system, start, periods=PERIODS)
    assert motion.success, motion.message
    found = falling(motion, lambda steps: rubbed(system, stator, start, PERIODS, steps))
    assert agree(found), found


