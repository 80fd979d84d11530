"""Small parts of basins and cell maps, on graphs and maps that are written out."""
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest
from scipy import sparse

from bifurc.basins.attractors.continuum import Continuum
from bifurc.basins.attractors.trapping import _one
from bifurc.basins.cells.generalized import components, solved
from bifurc.basins.cells.images import representatives
from bifurc.basins.cells.simple import colour, cycles
from bifurc.ensemble.grid import Grid
from bifurc.ensemble.outcomes import OUTSIDE, REACHED


@pytest.mark.parametrize("size", [1, 2, 7, 40])
def test_cells_of_a_random_map_are_those_of_its_graph(size, rng):
    """Group: the cycle that a walk ends in; steps: how many images lie before it."""
    for _ in range(10):
        image = rng.integers(-1, size + 1, size)
        found = colour(image)
        sink = (image < 0) | (image >= size)
        graph = nx.DiGraph([(cell, size if sink[cell] else int(image[cell])) for cell in range(size)] + [(size, size)])
        rings = [set(part) for part in nx.attracting_components(graph)]
        assert found.total == len(rings) and found.group[size] == found.steps[size] == 0
        for cell in range(size + 1):
            home = next(ring for ring in rings if nx.has_path(graph, cell, next(iter(ring))))
            assert found.group[cell] == found.group[next(iter(home))]
            assert found.steps[cell] == min(nx.shortest_path_length(graph, cell, other) for other in home)
        lists = cycles(found, image)
        assert not len(lists[0]) and {frozenset(map(int, each)) for each in lists[1:]} == {
            frozenset(ring) for ring in rings if size not in ring}
        for number, each in enumerate(lists[1:], 1):
            assert all(image[a] == b for a, b in zip(each, np.roll(each, -1), strict=True)) and each[0] == min(each)
            assert set(found.group[each]) == {number}


@pytest.mark.parametrize("columns", [1, 3])
def test_chances_and_times_solve_the_equations_of_the_chain(columns, rng):
    """With chances to stay, groups of several transient cells and two closed ones, against a dense solution."""
    n = 24
    P = np.where(rng.random((n, n)) < 0.12, rng.random((n, n)), 0.0)
    P[:, :4] += 0.05
    P[np.arange(n), np.arange(n)] += 0.3
    P[:2, 2:] = P[2:4, :2] = P[2:4, 4:] = 0.0
    P /= P.sum(axis=1, keepdims=True)
    matrix, fixed, source = sparse.csr_matrix(P), rng.normal(size=(n, columns)), rng.normal(size=n)
    found = components(matrix)
    x = solved(matrix, found, fixed, source)
    held = np.arange(n) < 4
    assert (found.closed[found.label] == held).all() and (found.size > 1).sum() > 2
    right = np.where(held[:, None], fixed, source[:, None])
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(n) - np.where(held[:, None], 0.0, P), right), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
@pytest.mark.parametrize("low, high", [(-0.3, 0.7), (0.0, 0.02), (-40.0, 3.0)])
def test_a_continuum_ends_where_its_members_do(low, high, unit):
    class Interval(Continuum):
        def member(self, value):
            return object() if low * unit <= value <= high * unit else None

    orbit = SimpleNamespace(family=(1,), state=np.array([5.0, 0.0]), weights=np.array([3.0, unit]))
    found = Interval(orbit)
    assert found.low >= low * unit and found.high <= high * unit
    assert abs(found.low - low * unit) < 1e-8 * unit and abs(found.high - high * unit) < 1e-8 * unit


def carried(rule):
    """Carrier of a map of states (k, 2)."""
    def propagate(starts, periods):
        ends = starts
        for _ in range(periods):
            ends = rule(ends)
        return SimpleNamespace(ends=ends, outcomes=np.where(np.isfinite(ends).all(axis=1), REACHED, REACHED + 1))
    return SimpleNamespace(propagate=propagate)


@pytest.mark.parametrize("scale", [np.ones(2), np.array([1e-6, 1e4])])
def test_a_union_belongs_to_one_sample_if_all_its_boxes_settle_there(scale):
    """The map halves what lies left of 1 towards 0, and what lies right of it towards 2."""
    width = 0.1
    two = carried(lambda x: np.where(x[:, :1] < scale[0], [0.0, 0.0], [2.0 * scale[0], 0.0]) * 0.5 + 0.5 * x)
    near, far = np.array([[-3, -3], [5, 8]]), np.array([[-3, -3], [14, 8]])
    assert _one(two, near, np.zeros((1, 2)), scale, width)
    assert not _one(two, far, np.zeros((1, 2)), scale, width)
    assert _one(two, far, np.array([[0.0, 0.0], [2.0, 0.0]]) * scale, scale, width)
    lost = carried(lambda x: np.where(x[:, :1] < scale[0], x * 0.5, np.inf))
    assert _one(lost, near, np.zeros((1, 2)), scale, width) and not _one(lost, far, np.zeros((1, 2)), scale, width)


@pytest.mark.parametrize("samples", [1, 9])
def test_a_cell_is_represented_by_the_start_next_to_its_centre(samples):
    """Starts above 0.85 stand beyond a stop; the middle of the last cell lies there, its lower part does not."""
    grid = Grid(q0=(-1.0, 1.3, 3), v0=(0.0, 4.0, 2))
    carrier = SimpleNamespace(grid=grid, states=lambda points: np.array(points, float),
                              images=lambda x: (x, np.where(x[:, 0] > 0.85, OUTSIDE, REACHED)))
    cells, special = np.array([0, 5, 3]), {3: np.array([7.0, 8.0])}
    found = representatives(carrier, cells, samples, special)
    centres = np.asarray(grid.points(cells))
    np.testing.assert_array_equal(found[[0, 2]], [centres[0], special[3]])
    if samples == 1:
        np.testing.assert_array_equal(found[1], centres[1])
    else:
        inside = np.abs(found[1] - centres[1]) / grid.widths
        assert found[1, 0] <= 0.85 and inside.max() < 0.5 and inside[1] < 0.2
