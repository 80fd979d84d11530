"""Steps follow the rates of states with rates of their own, whatever their units: matrix exponentials are the right values."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc import elements as el
from bifurc.compose.scene import scene_of


@dataclass(frozen=True, kw_only=True)
class Follower(el.Element):
    """A force that follows the coordinate with a lag: z' = (u - z)/lag, force -stiffness z."""

    lag: float = 1e-3
    stiffness: float = 0.5
    memory: ClassVar = ("z",)

    def site(self, n):
        return el.Rows.of(0, n)

    def mode(self, key, core):
        return el.Mode(force=(-self.stiffness * el.local.z(0),),
                       memory=(el.Rate((el.local.u(0) - el.local.z(0)) / self.lag),))


@pytest.mark.parametrize("lag", [3.0, 0.1, 2e-3])
def test_a_force_that_lags(lag):
    """A step of sixteenth order is exact to rounding only where it is shorter than the lag."""
    motion = bf.simulate(bf.System(1.0, 0.1, 1.0, [Follower(lag=lag)]), (1.0, -0.4, 0.2), duration=7.0)
    A = [[0.0, 1.0, 0.0], [-1.0, -0.1, -0.5], [1.0 / lag, 0.0, -1.0 / lag]]
    np.testing.assert_allclose(motion.final, expm(7.0 * np.array(A)) @ [1.0, -0.4, 0.2], rtol=0.0, atol=1e-12)


def test_units_of_states_do_not_shorten_steps():
    """In units in which both entries are alike [[0, a], [b, 0]] has the rate sqrt(a b)."""
    def steps(unit):
        field = bf.AffineField([[-0.1, unit], [-1.0 / unit, 0.0]])
        system = bf.HybridSystem("x y", {"only": field}, [])
        motion = bf.simulate(system, (1.0, 0.0), duration=20.0)
        exact = expm(20.0 * np.array([[-0.1, 1.0], [-1.0, 0.0]])) @ [1.0, 0.0]
        np.testing.assert_allclose(motion.final, exact * [1.0, 1.0 / unit], rtol=1e-11)
        return float(scene_of(system).tables.step.min())
    assert steps(1e-6) == pytest.approx(steps(1.0), rel=0.05) and steps(1e7) == pytest.approx(steps(1.0), rel=0.05)
