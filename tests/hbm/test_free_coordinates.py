"""Balances of parts that nothing restores: the message names what is free."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce, LinearSpring

METHOD = bf.HarmonicBalance(harmonics=7)
BETWEEN = (1.0, -1.0)


def clearance(**where):
    return [ElasticStop(gap=0.5, stiffness=10.0, **where), ElasticStop(gap=0.5, stiffness=10.0, side=-1, **where)]


def test_a_loose_mass_without_a_spring_is_named():
    found = bf.find_orbit(bf.System(1.0, 0.0, 0.0, [HarmonicForce(1.0), *clearance()], omega=1.0), method=METHOD)
    assert found.status == "singular" and "Nothing restores q0:" in found.message


@pytest.mark.parametrize("guess", [None, (0.5, 0.1, 0.0, 0.0)])
@pytest.mark.parametrize("contacts, stiffness, free", [
    ([CubicSpring(1.0, row=BETWEEN)], 1.0, "q0 + q1"), (clearance(row=BETWEEN), 0.0, "q0"),
    ([LinearSpring(1.0, row=(1.0, -2.0)), CubicSpring(1.0, row=(1.0, -2.0))], 0.0, "q0 + 0.5 q1")])
def test_free_inertias_are_named(guess, contacts, stiffness, free):
    """A mean along the null vector of every row stretches nothing."""
    coupling = np.array([[1.0, -1.0], [-1.0, 1.0]])
    system = bf.System(np.eye(2), 0.1 * np.eye(2), stiffness * coupling, [HarmonicForce(1.0, dof=0), *contacts], omega=1.0)
    found = bf.find_orbit(system, guess, method=METHOD)
    assert not found.success and f"Nothing restores {free}" in found.message


def test_a_motion_inside_its_clearance_is_still_a_solution():
    """Of a free mass: amplitude F / omega^2 anywhere between the stops."""
    found = bf.find_orbit(bf.System(1.0, 0.0, 0.0, [HarmonicForce(0.2), *clearance()], omega=1.0), method=METHOD)
    assert found.success and abs(found.harmonic(1)) == pytest.approx(0.2, rel=1e-12)
