"""Refinement against maps of which every cell was followed: what it saves, what it misses, when it declines."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.maps.refinement import RefinementStatus, mixed, prediction

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
B = bf.systems.impact_oscillator(zeta=0.05, omega=4.25, amplitude=1.0, gap=0.1, restitution=0.8)


def test_a_smooth_boundary_pays_and_hardly_a_cell_is_missed():
    grid = bf.Grid(q0=(-2.5, 0, 800), v0=(-3, 3, 800))
    found = bf.refined_basins(A, grid)
    direct = bf.basins_of_attraction(A, grid, attractors=found.basins.attractors)
    assert found.status is RefinementStatus.REFINED and found.share <= 0.35
    wrong = np.mean(found.basins.labels != direct.labels)
    assert wrong <= 1e-3  # asked: 4e-3
    low, high = (bound * (1 - found.share) for bound in found.missed.bounds)
    assert low <= wrong <= high
    assert abs(found.predicted - found.share) <= 0.05 and "were followed" in found.message
    for name in ("labels", "periods", "impacts", "speeds", "states"):  # centres of the coarse cells are rounded another way
        mine, whole = (getattr(item, name)[found.evaluated] for item in (found.basins, direct))
        np.testing.assert_allclose(mine, whole, rtol=0, atol=1e-10)
    assert (found.basins.periods[~found.evaluated] == -1).all()


def test_a_fractal_boundary_is_declined_and_the_reason_given():
    found = bf.refined_basins(B, bf.Grid(q0=(-2.4, 0.1, 400), v0=(-3, 3, 400)))
    assert found.status is RefinementStatus.DECLINED and found.share == 1.0 and found.exponent < 0.2
    assert "would have been followed, up to 60 % pays" in found.message
    assert abs(found.basins.fractions[0] - 0.442525) <= 0.005


def test_stops_and_periodic_starts_are_kept():
    grid = bf.Grid(q0=(-2.5, 0.5, 400), v0=(-3, 3, 400))
    found = bf.refined_basins(A, grid)
    direct = bf.basins_of_attraction(A, grid)
    assert found.status is RefinementStatus.REFINED
    np.testing.assert_array_equal(found.basins.states == 2, direct.states == 2)
    assert np.mean(found.basins.labels != direct.labels) <= 2e-3


@pytest.mark.parametrize("cells", [(200, 400), (800, 400)])
def test_grids_that_are_longer_than_wide_and_wider_than_long(cells):
    """What is found beside a boundary is followed up to every edge of the grid; the boundaries are curves that reach them."""
    grid = bf.Grid(q0=(-2.5, 0, cells[0]), v0=(-3, 3, cells[1]))
    found = bf.refined_basins(A, grid)
    direct = bf.basins_of_attraction(A, grid, attractors=found.basins.attractors)
    assert found.status is RefinementStatus.REFINED and found.share < 0.7
    differ = found.basins.labels != direct.labels
    assert differ.mean() <= 2e-3
    open_ = mixed(found.basins.labels, grid) & ~found.evaluated  # what is inherited beside another label was looked up ...
    assert open_.sum() <= 8 * found.missed[1]  # ... but for the neighbours of what the last look found


def test_workers_change_no_bit():
    grid = bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400))
    one, two = (bf.refined_basins(A, grid, workers=workers) for workers in (1, 2))
    np.testing.assert_array_equal(one.basins.labels, two.basins.labels)
    np.testing.assert_array_equal(one.evaluated, two.evaluated)


def test_grids_that_cannot_be_halved_are_labelled_whole():
    found = bf.refined_basins(A, bf.Grid(q0=(-2.5, 0, 31), v0=(-3, 3, 40)))
    assert found.status is RefinementStatus.NOT_DIVISIBLE and "write multiples of 8" in found.message
    with pytest.raises(ValueError, match="must be a Grid"):
        bf.refined_basins(A, (3, 4))


def test_one_colour_is_cheap_and_noise_is_dear(rng):
    grid = bf.Grid(q0=(0, 1, 800), v0=(0, 1, 800))
    assert prediction(np.zeros((100, 100), int), grid, 8) == (1 / 64, 1.0)
    share, exponent = prediction(rng.integers(0, 2, (100, 100)), grid, 8)
    assert share > 0.97 and exponent < 0.02
    stripe = np.zeros((100, 100), int)
    stripe[:, 50:] = 1
    share, exponent = prediction(stripe, grid, 8)
    assert share < 0.05 and abs(exponent - 1.0) < 1e-12
