"""Held rows are put right at events by the rounding of each coordinate: a small one beside large ones keeps its digits."""
import mpmath
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, RigidStop


def closed(masses, springs, speeds, t):
    """Place and speed of the third coordinate of three whose sum is held, from rest places, in 40 digits."""
    with mpmath.workdps(40):
        m, k, v = ([mpmath.mpf(part) for part in parts] for parts in (masses, springs, speeds))
        M = mpmath.matrix([[m[0] + m[1], m[1]], [m[1], m[2] + m[1]]])
        K = mpmath.matrix([[k[0] + k[1], k[1]], [k[1], k[2] + k[1]]])
        A, rates = mpmath.zeros(4), -M ** -1 * K
        A[0, 2] = A[1, 3] = 1
        for i in range(2):
            for j in range(2):
                A[2 + i, j] = rates[i, j]
        y = mpmath.expm(A * mpmath.mpf(t)) * mpmath.matrix([0, 0, v[0], v[2]])
        return float(y[1]), float(y[3])


@pytest.mark.parametrize(("fast", "slow"), [(1.0, 1.0), (1e3, 1e-6), (1e6, 1e-3), (1e6, 1.0)])
def test_a_slow_heavy_mass_beside_fast_ones_in_one_held_row_keeps_its_digits(fast, slow):
    """Friction that never slips holds q0 + q1 + q2; a fourth mass between two stops makes 5000 events."""
    masses, springs = (1.0, 1.0, 1e6), (1.0, 1.0, 0.25e6)
    system = bf.System(np.diag([*masses, 1.0]), np.zeros((4, 4)), np.diag([*springs, 0.0]), [
        Coulomb(1e12, row=(1, 1, 1, 0)), RigidStop(1.0, 1.0, dof=3), RigidStop(1.0, 1.0, side=-1, dof=3)])
    first, second = fast, -(fast + slow)
    third = -(first + second)
    motion = bf.simulate(system, np.array([0.0, 0.0, 0.0, 0.0, first, second, third, 50.0]), duration=200.0, max_events=10 ** 6)
    assert motion.success and len(motion.events) == 5000
    place, speed = closed(masses, springs, (first, second, third), 200.0)
    assert abs(motion.final[2] - place) < 1e-9 * slow and abs(motion.final[6] - speed) < 1e-9 * slow
