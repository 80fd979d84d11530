"""Branches of two masses with friction between them and static friction above kinetic on a floor: which mode is tried first tells.

At a stop several modes may follow: the mass may stick while the other one is let go, or both turn round.  Simulation tries what
sticks first; the equations of a branch must know where that ends them.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.elements import Coulomb, HarmonicForce
from studies import branch_audit as audits
from tests.reference.time_stepping import stepped


def rubbing(masses, springs, load, between, floor, static, omega):
    """Return two masses on springs to the walls and between them; the second is driven, the first rubs on the floor."""
    k = np.array(springs)
    K = [[k[0] + k[1], -k[1]], [-k[1], k[1] + k[2]]]
    return bf.System(np.diag(masses), (0.05 * np.array(K)).tolist(), K, [
        HarmonicForce(load, dof=1), Coulomb(between, row=(1.0, -1.0)), Coulomb(floor, static_ratio=static)], omega=omega)


def drawn(seed):
    """Return a random system of `rubbing`, one of its parameters and bounds."""
    rng = np.random.default_rng([seed, 77])
    between = rng.uniform(0.2, 0.5)
    system = rubbing((rng.uniform(0.5, 2.0), 1.0), rng.uniform(0.3, 2.0, 3), rng.uniform(0.5, 1.5), between,
                     between * rng.uniform(0.5, 1.0), rng.uniform(1.1, 1.8), rng.uniform(0.5, 2.8))
    name = ("omega", "coulomb.friction", "coulomb_2.friction", "harmonic_force.amplitude")[rng.integers(4)]
    value = system.parameter(name)
    return system, name, (0.5 * value, 1.5 * value)
