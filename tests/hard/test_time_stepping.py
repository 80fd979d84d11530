"""Random motions against time stepping: the rule at events, by a method that has no events.

A wrong rule agrees with itself, in simulation, orbits and audits alike; a difference to these steps that does not fall with them
is what shows it.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import CubicSpring
from bifurc.orbits.standing import NoRoom, resting_start
from studies import branch_audit
from tests.reference.time_stepping import numbers_of, stepped

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
    n, found = len(system.mass), []
    for steps in (2000, 8000, 32000, 128000):
        found.append(float(np.abs(stepped(system, start, PERIODS, steps) - motion.final)[:n].max()))
        if found[-1] < NEAR and len(found) > 2:
            break
    return found


@pytest.mark.parametrize(("kind", "seed"), [pytest.param(kind, seed, marks=[pytest.mark.slow] if seed > 1 else [])
                                            for kind in DRAWN for seed in range(12)])
def test_motions_are_those_of_time_stepping(kind, seed):
    found = differences(DRAWN[kind](seed))
    if found is not None and found[-1] >= NEAR:
        assert found[-1] < FALLS * found[-2] < FALLS**2 * found[-3], found
