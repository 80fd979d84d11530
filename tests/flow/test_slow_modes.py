"""Modes whose own motion takes far longer than a flight: what their steps would add up is no rounding of the state."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, RigidStop


@pytest.mark.parametrize("gap", [1e-3, 1.0, 572.0])
@pytest.mark.parametrize(("damping", "stiffness"), [(1e-152, 0.0), (0.0, 1e-14), (0.0, 1e-20), (1e-9, 0.0), (0.0, 0.0)])
def test_a_load_drives_a_mass_to_its_stop_however_soft_its_spring(damping, stiffness, gap):
    """Uniform acceleration: it falls for sqrt(2 gap), and stays on a plastic stop."""
    system = bf.System(1.0, damping, stiffness, [ConstantForce(-1.0), RigidStop(gap, 0.0, side=-1)])
    time = np.sqrt(2.0 * gap)
    motion = bf.simulate(system, (0.0, 0.0), duration=3.0 * time)
    assert motion.success and [event.element for event in motion.events] == ["rigid_stop"]
    assert motion.events[0].time == pytest.approx(time, rel=1e-7 if damping == 1e-9 else 1e-10)
    np.testing.assert_allclose(motion(np.array([0.5, 2.0]) * time)[:, 0], [-0.25 * gap, -gap], rtol=1e-7)
