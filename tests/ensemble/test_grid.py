"""Grids of starts: centres, order, fixed components, and requests that cannot be met."""
import numpy as np
import pytest

import bifurc as bf


def test_cells_stand_for_their_centres_and_the_first_component_is_the_first_axis():
    grid = bf.Grid(v1=(-1, 1, 4), q0=(0.0, 3.0, 3), at={"q1": 0.25})
    starts = grid.starts(2, 4).reshape(4, 3, 4)
    np.testing.assert_array_equal(starts[:, 0, 3], [-0.75, -0.25, 0.25, 0.75])
    np.testing.assert_array_equal(starts[0, :, 0], [0.5, 1.5, 2.5])
    assert (starts[..., 1] == 0.25).all() and (starts[..., 2] == 0.0).all()
    assert (grid.shape, grid.size, grid.names) == ((4, 3), 12, ("v1", "q0"))


def test_record_and_line():
    grid = bf.Grid(q0=(-3, 1, 400), v0=(-4, 4, 300))
    assert bf.Grid.from_record(grid.to_record()) == grid
    assert hash(bf.Grid.from_record(grid.to_record())) == hash(grid)
    assert repr(grid) == "Grid(q0=(-3, 1, 400), v0=(-4, 4, 300))"


@pytest.mark.parametrize(("keywords", "said"), [
    ({}, "no components are given"),
    ({"q0": (-1, 1, 3), "periodic": ("v0",)}, "periodic = 'v0' is not allowed; it must be one of 'q0'"),
    ({"q-1": (-1, 1, 3), "v0": (-1, 1, 3)}, "component 'q-1' is unknown"),
    ({"q0": (1, 1, 3), "v0": (-1, 1, 3)}, "low bound must be below"),
    ({"q0": (2, 1, 3), "v0": (-1, 1, 3)}, "low bound must be below"),
    ({"q0": (float("nan"), 1, 3), "v0": (-1, 1, 3)}, "must be a finite number"),
    ({"q0": (-1, float("inf"), 3), "v0": (-1, 1, 3)}, "must be a finite number"),
    ({"q0": (-1, 1, 0), "v0": (-1, 1, 3)}, "number of cells"),
    ({"q0": (-1, 1, 2.5), "v0": (-1, 1, 3)}, "number of cells"),
    ({"q0": (-1, 1, True), "v0": (-1, 1, 3)}, "number of cells"),
    ({"q0": (-1, 1), "v0": (-1, 1, 3)}, "must be (low, high, cells)"),
    ({"q0": "wide", "v0": (-1, 1, 3)}, "must be (low, high, cells)"),
    ({"q0": (-1, 1, 3), "v0": (-1, 1, 3), "at": {"q0": 1.0}}, "which the grid runs over"),
    ({"q0": (-1, 1, 3), "v0": (-1, 1, 3), "at": {"q1": float("nan")}}, "must be a finite number"),
])
def test_impossible_grids_are_named(keywords, said):
    with pytest.raises(ValueError) as error:
        bf.Grid(**keywords)
    assert said in str(error.value)


@pytest.mark.parametrize("grid", [
    bf.Grid(q0=(-1, 1, 2), v1=(-1, 1, 2)), bf.Grid(q0=(-1, 1, 2), v0=(-1, 1, 2), at={"q3": 0.0}),
])
def test_components_the_system_has_not(grid):
    with pytest.raises(ValueError, match="unknown to this system; it has 1 degree of freedom: q0 .. q0 and v0 .. v0, no memory"):
        bf.basins_of_attraction(bf.systems.impact_oscillator(), grid)


@pytest.mark.parametrize(("keywords", "said"), [
    ({"workers": 0}, "workers = 0"), ({"tolerance": 0.0}, "tolerance = 0.0"),
    ({"tolerance": np.nan}, "tolerance = nan"),
    ({"max_periods": 0}, "max_periods = 0"), ({"seed": -1}, "seed = -1"), ({"max_events": 1.5}, "max_events = 1.5"),
    ({"attractors": [3]}, "it must be a PeriodicOrbit, ChaoticAttractor, QuasiperiodicAttractor or Equilibrium"),
])
def test_options_out_of_range(keywords, said):
    with pytest.raises(ValueError) as error:
        bf.basins_of_attraction(bf.systems.impact_oscillator(), bf.Grid(q0=(-1, 1, 2), v0=(-1, 1, 2)), **keywords)
    assert said in str(error.value)


def test_an_autonomous_system_has_no_section():
    system = bf.System(1.0, 0.1, 1.0, [bf.elements.RigidStop(gap=1.0)])
    with pytest.raises(ValueError, match="autonomous"):
        bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 2), v0=(-1, 1, 2)))


def test_a_grid_must_be_a_grid():
    with pytest.raises(ValueError, match="it must be a Grid"):
        bf.basins_of_attraction(bf.systems.impact_oscillator(), {"q0": (-1, 1, 2), "v0": (-1, 1, 2)})


def test_cells_of_points_in_three_dimensions_one_of_them_round(rng):
    grid = bf.Grid(q0=(-np.pi, np.pi, 7), v0=(-1, 2, 5), q1=(0, 1, 3), periodic="q0", at={"v1": 0.5})
    cells = np.arange(grid.size)
    np.testing.assert_array_equal(grid.cells_of(grid.points(cells)), cells)
    for offset in (1e-9, 1 - 1e-9, rng.uniform(0.01, 0.99, 3)):
        points = grid.points(cells, offset)
        np.testing.assert_array_equal(grid.cells_of(points + [2 * np.pi * 3, 0, 0]), cells)
    np.testing.assert_array_equal(grid.points(cells), grid.starts(2, 4)[:, [0, 2, 1]])
    assert (grid.starts(2, 4)[:, 3] == 0.5).all()
    outside = np.array([[0, -1.001, 0.5], [0, 0, 1.0], [0, np.nan, 0.5], [np.inf, 0, 0.5], [-1e-17 - np.pi, -1.0, 0.0]])
    np.testing.assert_array_equal(grid.cells_of(outside) >= 0, [False, False, False, False, True])
    assert bf.Grid.from_record(grid.to_record()) == grid and "periodic=('q0',)" in repr(grid)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.0, 2.0 * np.pi), (-1.0, 0.3), (0.1, 7.0)])
def test_next_below_the_beginning_of_a_round_component_lies_its_last_cell(low, high):
    """However near: the remainder of a number that is negative by less than rounding is the whole turn."""
    grid = bf.Grid(q0=(low, high, 10), periodic="q0")
    near = [np.nextafter(low, -np.inf), low - 1e-18, low - 1e-9, np.nextafter(low, np.inf), low]
    cells = grid.cells_of(np.array(near)[:, None])
    assert cells[2:].tolist() == [9, 0, 0] and set(cells[:2]) <= {0, 9}
    assert low != 0.0 or cells[:2].tolist() == [9, 9]


def test_the_memory_of_an_enormous_grid_is_said_before_it_is_taken():
    grid = bf.Grid(q0=(-1, 1, 10**7), v0=(-1, 1, 10**7))
    with pytest.raises(MemoryError, match=r"1e\+14 cells; a basin map needs about .* TB.*write at most"):
        bf.basins_of_attraction(bf.systems.impact_oscillator(), grid)


def test_one_cell_is_a_grid():
    grid = bf.Grid(q0=(-1, 3, 1), v0=(0, 2, np.int64(2)))
    assert grid.shape == (1, 2) and grid.points(np.arange(2)).tolist() == [[1.0, 0.5], [1.0, 1.5]]
