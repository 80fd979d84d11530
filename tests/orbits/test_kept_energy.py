"""Free motions that keep their energy are told from those that do not, by their simulations; they attract nothing."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, ElasticStop, Force, HarmonicForce, Jenkins
from bifurc.orbits.energy import conservative

M, K, G = np.array([[1.0, 0.2], [0.2, 2.0]]), np.array([[3.0, -1.0], [-1.0, 2.0]]), np.array([[0.0, 0.4], [-0.4, 0.0]])
STOP = ElasticStop(gap=0.3, stiffness=5.0)


def drive(u, s, a):
    return -a * s


@pytest.mark.parametrize(("system", "kept"), [
    (bf.System(M, 0.0 * K, K), True), (bf.System(M, G, K, [STOP, ConstantForce(0.4, dof=1)]), True),
    (bf.System(M, 0.0 * K, K + np.array([[0.0, 0.3], [0.0, 0.0]])), False),  # a load that follows: no energy belongs to it
    (bf.System(M, G + 0.01 * np.eye(2), K, [STOP]), False), (bf.System(M, np.diag([0.05, -0.05]), K), False),
    (bf.System(M, np.array([[0.0, 0.1], [0.1, 0.0]]), K), False)])
def test_what_keeps_its_energy_is_told(system, kept):
    assert conservative(system) is kept
    motion = bf.simulate(system, (0.7, -0.4, 0.3, 0.5), duration=20.0)
    values = [bf.energy(system, y) for y in motion.sample(101)[1]]
    assert bool(np.ptp(values) < 1e-11 * max(values)) is kept


@pytest.mark.parametrize("element", [Force(drive, a=0.1), Jenkins(1.0, 0.1), HarmonicForce(0.3)])
def test_elements_that_put_in_or_take_out_energy_keep_none(element):
    omega = 1.3 if isinstance(element, HarmonicForce) else None
    assert conservative(bf.System(1.0, 0.0, 1.0, [STOP, element], omega=omega)) is False


@pytest.mark.parametrize("start", [(0.9, 0.0), (0.0, 0.5)])
def test_a_free_vibration_of_one_mass_attracts_nothing_and_repels_nothing(start):
    """Each energy has a period of its own: neighbours neither come nearer nor go away, and no multiplier is left to tell."""
    system = bf.System(1.0, 0.0, 1.0, [STOP])
    orbit = bf.find_orbit(system, guess=start)
    assert orbit.success and orbit.multipliers.size == 0 and orbit.stable is None
    beside = bf.simulate(system, np.multiply(start, 1.001), duration=50.0 * orbit.period)
    assert bf.energy(system, beside.final) == pytest.approx(bf.energy(system, np.multiply(start, 1.001)), rel=1e-11)
