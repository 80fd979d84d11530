"""Maps of several masses whose motion is chaotic: there is no union of boxes in a plane, a sample is all that is known."""
import numpy as np

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop


def test_two_masses_that_hit_a_stop_without_a_period():
    K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    system = bf.System(np.eye(2), 0.1 * K, K, [HarmonicForce(1.0, dof=0), RigidStop(0.63, 0.89, dof=1)], omega=1.63)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-0.3, 0.3, 4), v1=(-1.0, 1.0, 4)), max_periods=1000)
    (attractor,) = basins.attractors
    assert attractor.regime == "chaotic" and set(np.unique(basins.labels)) <= {-1, 0} and np.mean(basins.labels == 0) > 0.5
    # its exponent from two neighbouring motions, and from the exact derivative along another motion
    other = bf.lyapunov_exponents(system, np.array([-0.1, -0.1, 0.0, 0.0]), periods=2000, transient=200)
    error = np.hypot(attractor.exponent_error, other.errors[0])
    assert other.chaotic and abs(attractor.exponent - other.values[0]) < 4.0 * error < 0.5 * other.values[0]
