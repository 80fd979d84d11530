"""Structures without damping: all their multipliers lie on the unit circle, where rounding says nothing of a torus."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce


@pytest.mark.parametrize("n, omega", [(3, 0.31), (6, 0.11)])
def test_a_chain_without_damping_has_no_torus_points(n, omega):
    """Multipliers are exp(+-2 pi i w_k / omega), w_k = 2 sin(k pi / (2 n + 2)), whatever the parameter is."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    system = bf.System(np.eye(n), np.zeros((n, n)), K, [HarmonicForce(1.0)], omega=omega)
    orbit = bf.find_orbit(system, np.zeros(2 * n), closure=1)
    known = np.exp(2j * np.pi / omega * 2.0 * np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2)))
    np.testing.assert_allclose(np.sort(orbit.multipliers.real), np.sort(np.repeat(known.real, 2)), atol=1e-9)
    branch = bf.trace(orbit, "omega", bounds=(0.97 * omega, 1.03 * omega), max_steps=12)
    assert len(branch) > 3 and not branch.special_points.of("neimark_sacker")
