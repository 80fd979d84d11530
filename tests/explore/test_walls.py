"""Walls in the pictures of the explorer, on numbers written out."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.elements import RigidStop
from bifurc.explore.pictures import _walls


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_walls_of_the_explorer_are_seen(unit):
    stops = (RigidStop(gap=2.0 * unit, restitution=0.7), RigidStop(gap=0.5 * unit, restitution=0.7, side=-1))
    system = SimpleNamespace(elements=stops, omega=1.0, n=1, parameters={})
    t, x = np.linspace(0.0, 3.0, 7), unit * np.linspace(-0.2, 0.8, 7)
    low, high, walls = _walls(SimpleNamespace(system=system), 0, t, x, 3.0)
    margin = 0.06 * unit
    assert (low, high) == pytest.approx((-0.5 * unit - margin, 2.0 * unit + margin))
    assert walls["x0"] == pytest.approx([2.0 * unit, -0.5 * unit])
    assert walls["x1"][0] > high and walls["x1"][1] < low
    for ts, xs, place in zip(walls["ts"], walls["xs"], walls["x0"], strict=True):
        assert ts[0] == 0.0 and ts[len(t) - 1] == ts[len(t)] == 1.0 and ts[-1] == 0.0
        assert xs[:len(t)] == pytest.approx([place] * len(t))
    assert walls["hatch"] == ["right_diagonal_line"] * 2 and walls["fixed"] == [True, True]
