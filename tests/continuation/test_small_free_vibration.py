"""The orbit on a linear mode that a free vibration begins with, against the closed form of linear systems."""
import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc.continuation.free_vibration import linear_mode


@pytest.mark.parametrize("time", [1.0, 1e-4, 1e5])
@pytest.mark.parametrize("mode", [0, 1])
def test_the_first_orbit_has_the_energy_and_the_shape_of_the_mode(mode, time):
    M, K = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[3.0, -1.0], [-1.0, 2.0]]) / time**2
    system = bf.System(M, np.zeros((2, 2)), K)
    squares, shapes = eigh(K, M)
    omega, shape, E = np.sqrt(squares[mode]), shapes[:, mode], 1e-3
    q = np.concatenate([shape, 1j * omega * shape]) * (0.7 + 0.4j)
    orbit = linear_mode(system, bf.find_equilibrium(system), q, omega, E)
    assert orbit.period == pytest.approx(2.0 * np.pi / omega, rel=1e-9)
    y = np.array([orbit.state, *orbit.sample(7)[1]])
    np.testing.assert_allclose([bf.energy(system, each) for each in y], E, rtol=1e-9)
    top = y[0, :2]
    np.testing.assert_allclose(top / np.abs(top).max(), shape / shape[np.argmax(np.abs(shape))], rtol=1e-9)
    assert np.abs(top @ K @ top) == pytest.approx(2.0 * E, rel=1e-9)  # all of it is stored in the springs there
