"""A mass that carries a slider chatters on its stop: without rebound, and with less and less of it, the motion is the same."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, Jenkins, RigidStop


def motion(restitution, periods=2):
    """The slider slips until the impact turns its speed round, and stays at its place until it slips the other way."""
    system = bf.System([[1.29, 0.04], [0.04, 1.41]], [[0.17, 0.04], [0.04, 0.17]], [[1.79, 0.46], [0.46, 1.8]], [
        HarmonicForce(1.6, dof=1), HarmonicForce(0.6, harmonic=3, phase=5.1), Jenkins(6.7, 0.7, row=(-1.0, 1.0)),
        RigidStop(0.2, restitution, side=-1, dof=1)], omega=1.5)
    return bf.simulate(system, np.zeros(4), periods=periods)


@pytest.mark.parametrize("restitution", [1e-14, 1e-12, 1e-9, 1e-7])
def test_the_slider_sticks_at_the_first_impact(restitution):
    plastic, chattering = motion(0.0), motion(restitution)
    turned = [event for event in plastic.events if event.kind.value == "impact" and "slip-" in event.mode_before[1:]
              and "stick" in event.mode_after[1:]]
    assert turned
    np.testing.assert_allclose(chattering.final, plastic.final, atol=50.0 * restitution + 1e-12)
    kinds = [[event.kind.value for event in one.events if event.element == "jenkins"] for one in (plastic, chattering)]
    assert kinds[0] == kinds[1]
