"""Branches of families: what labels their orbits keeps its value, however many rows the next one is foretold from."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, Iwan, RigidStop


@pytest.fixture(scope="module")
def branches():
    """A slider that never slips is a spring: the branch with one, and that of a spring."""
    def branch(spring, *elements):
        system = bf.System(1.0, 0.05, spring, (HarmonicForce(0.3), *elements, RigidStop(0.2, 0.5)), omega=0.9)
        return bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 3.0))
    return branch(1.0, Iwan(stiffnesses=(1.0,), limits=(10.0,))), branch(2.0)


def test_memory_that_nothing_writes_keeps_its_value(branches):
    memory = np.array([orbit.state[2] for orbit in branches[0].orbits])
    assert len(memory) > 50 and np.ptp(memory) <= 1e-15


def test_a_slider_that_never_slips_has_the_special_points_of_a_spring(branches):
    (kinds, places, errors), (of_spring, true, known) = (
        zip(*[(point.kind, point.parameter, point.error) for point in branch.special_points], strict=True) for branch in branches)
    assert kinds == of_spring and len(kinds) == 8
    assert np.all(np.abs(np.subtract(places, true)) <= np.add(errors, known))
