"""Hard cases of discovery and labelling: each ends in a clear label or a clear sentence."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins import CellState, ChaoticAttractor

DUFFING = bf.systems.duffing_oscillator(zeta=0.075, omega=1.0, amplitude=0.3, alpha=-1.0, beta=1.0)


@pytest.mark.slow
def test_chaotic_and_periodic_side_by_side():
    """On this grid boxes around the chaotic attractor reach over the boundary of basins: they must not take the other one in."""
    found = bf.basins_of_attraction(DUFFING, bf.Grid(q0=(-2.2, 2.2, 100), v0=(-2.2, 2.2, 100)))
    assert [type(item) is ChaoticAttractor for item in found.attractors] == [False, True]
    assert abs(found.fractions[0] - 0.3728) < 0.003 and found.fractions[-1] == 0.0
    for seed in (1, 2):
        again = bf.basins_of_attraction(DUFFING, bf.Grid(q0=(-2.2, 2.2, 20), v0=(-2.2, 2.2, 20)), seed=seed)
        assert len(again.attractors) == 2 and abs(again.fractions[0] - 0.3728) < 0.02


def test_a_map_that_settles_slowly_is_unsettled_in_words():
    """Damping 1e-5 takes thousands of periods; after ten, cells are unsettled and the report says what to do."""
    system = bf.systems.impact_oscillator(zeta=1e-5, omega=0.4, amplitude=0.1, gap=10.0)
    grid = bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4))
    found = bf.basins_of_attraction(system, grid, max_periods=10)
    assert found.counts[CellState.UNSETTLED] == 16 and len(found.attractors) <= 1
    assert "raise max_periods" in found.report()


def test_a_motion_without_damping_is_no_attractor():
    """Quasi-periodic for ever: no attractor is invented, no exponent is positive."""
    system = bf.systems.impact_oscillator(zeta=0.0, omega=0.5 * np.sqrt(2.0), amplitude=0.1, gap=10.0)
    found = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 3), v0=(-1, 1, 3)), max_periods=300)
    assert found.attractors == () and found.counts[CellState.UNSETTLED] == 9


def test_an_interval_of_rest_is_one_attractor_not_many():
    """Load below the friction limit: the mass stays wherever it stops, |q| <= friction - amplitude; every start ends there."""
    system = bf.systems.dry_friction_oscillator(amplitude=0.5)
    found = bf.basins_of_attraction(system, bf.Grid(q0=(-2, 2, 8), v0=(-2, 2, 8)))
    assert len(found.attractors) == 1 and found.attractors[0].intervals[0] == pytest.approx((-0.5, 0.5), abs=1e-12)
    assert found.fractions == {0: 1.0, -1: 0.0}
    assert "stands for a continuum of motions" in found.report() and "coordinate 0 in [-0.5, 0.5]" in found.report()
