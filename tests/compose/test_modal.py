"""Modal coordinates of many degrees of freedom: the particular solution under loads of any phase."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop


@pytest.mark.parametrize("phase", [0.0, 0.8, np.pi / 2])
def test_the_forced_motion_of_a_chain_is_that_of_its_dynamic_stiffness(phase):
    """A stop out of reach makes the scene one of modes; the load is cosine and sine."""
    n, omega = 6, 0.9
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.2 * K + np.diag(0.05 * np.arange(n))
    system = bf.System(np.eye(n), C, K, [HarmonicForce(0.7, phase=phase, dof=2), RigidStop(1e3, 0.5)], omega=omega)
    q = np.linalg.solve(K - omega**2 * np.eye(n) + 1j * omega * C, 0.7 * np.exp(1j * phase) * np.eye(n)[2])
    start = np.concatenate([q.real, -omega * q.imag])
    motion = bf.simulate(system, start, periods=2)
    t = np.linspace(0.0, motion.stop, 9)
    np.testing.assert_allclose(motion(t)[:, :n], (np.exp(1j * omega * t)[:, None] * q).real, rtol=0, atol=1e-12)
