"""A mass on a spring that touches its stop once a turn: all touches are grazes, and the motion is that without the stop."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el


@pytest.mark.parametrize("size", [1.0, 0.7, 3.3, 1e-6, 1e6])
def test_a_mass_touches_once_a_turn(size):
    system = bf.System(1.0, 0.0, 1.0, (el.RigidStop(size, 0.8),))
    for start in np.linspace(0.3, 6.0, 9):
        motion = bf.simulate(system, size * np.array([np.cos(start), -np.sin(start)]), duration=20.0)
        assert {str(event.kind) for event in motion.events} <= {"graze"}
        turns = 2.0 * np.pi * np.arange(1, int((start + 20.0) / (2.0 * np.pi)) + 1) - start
        times = np.array([event.time for event in motion.events])  # rounding says which of them are listed, none of them twice
        nearest = np.abs(times[:, None] - turns).argmin(axis=1)
        assert len(set(nearest.tolist())) == len(times) and np.abs(times - turns[nearest]).max() < 1e-6
        t = np.linspace(0.0, 20.0, 37)
        np.testing.assert_allclose(motion(t)[:, 0], size * np.cos(t + start), rtol=0, atol=1e-10 * size)
