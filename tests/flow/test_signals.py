"""Long computations look at signals, and samples of long motions cost little."""
import signal
import time

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import CubicSpring, HarmonicForce, RigidStop


class Asked(Exception):
    """Raised by the signal."""


def ask(*_):
    raise Asked


STIFF = np.array([[1e12, -1e12], [-1e12, 1e12 + 1.0]])


@pytest.mark.parametrize("system, start, length", [
    (bf.System(np.eye(2), 0.01 * np.eye(2), STIFF, [HarmonicForce(1.0)], omega=1.0), (0.1, 0.1, 0.0, 0.0), {"periods": 300}),
    (bf.System(1.0, 0.0, 1.0, [RigidStop(0.0, 1.0)]), (-1.0, 0.0), {"duration": 1e8, "max_events": 10**8}),
    (bf.System(1.0, 0.0, 1.0), (-1.0, 0.0), {"duration": 1e10}),
    (bf.System(1.0, 0.0, 1.0, [CubicSpring(1.0)]), (-1.0, 0.0), {"duration": 1e8})])
def test_a_long_simulation_hears_a_signal(system, start, length):
    bf.simulate(system, start, **{**length, **({"periods": 0.01} if "periods" in length else {"duration": 0.1})})  # compiles
    before = signal.signal(signal.SIGALRM, ask)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    clock = time.thread_time()
    try:
        with pytest.raises(Asked):
            bf.simulate(system, start, **length)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert time.thread_time() - clock < 2.0


def test_a_motion_in_many_calls_is_the_same():
    """x = cos t over 2e6 radians: rounding of the steps adds up, the calls add nothing."""
    motion = bf.simulate(bf.System(1.0, 0.0, 1.0), (1.0, 0.0), duration=2e6)
    np.testing.assert_allclose(motion.final, [np.cos(2e6), -np.sin(2e6)], atol=1e-9)


def test_samples_of_a_stiff_structure_cost_no_more_than_their_number():
    """A chain of 30 masses on springs of 1e12: nothing goes there step by step.  Energy tells that they are right."""
    n, k = 30, 1e12
    K = k * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    system = bf.System(np.eye(n), np.zeros((n, n)), K, [HarmonicForce(0.0)], omega=1.0)
    motion = bf.simulate(system, np.append(np.full(n, 0.05), np.zeros(n)), periods=1)
    motion.sample(2)
    clock = time.thread_time()
    t, y = motion.sample(200)
    assert time.thread_time() - clock < 0.5
    energy = 0.5 * np.einsum("ti,ij,tj->t", y[:, :n], K, y[:, :n]) + 0.5 * (y[:, n:] ** 2).sum(axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)
