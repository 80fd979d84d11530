"""Fractions, known attractors, absorption and carriers of maps on small arrays; what a boundary's search returns."""
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import bifurc as bf
from bifurc.basins.boundaries import search, unstable
from bifurc.basins.cells import cell_map, images
from bifurc.basins.cells.cell_map import CellFate, CellMap, Group, GroupKind
from bifurc.basins.cells.images import Carrier, offsets_of
from bifurc.basins.maps.basin_map import BasinMap
from bifurc.basins.maps.compute import _known
from bifurc.ensemble.outcomes import DIVERGED, OUTSIDE, REACHED, UNSETTLED, CellState
from bifurc.jobs.progress import Progress
from bifurc.jobs.store import ChunkStore

SYSTEM = bf.systems.impact_oscillator(omega=0.7, amplitude=0.1)


def fractions(labels, states, count=2):
    stand_in = SimpleNamespace(labels=np.array(labels), states=np.array(states), attractors=[None] * count)
    stand_in.starts = BasinMap.starts.fget(stand_in)
    return BasinMap.fractions.fget(stand_in)


def test_shares_are_those_of_the_starts():
    found = fractions([0, 0, 1, -1, -1, -1, 0, 1], [REACHED, REACHED, REACHED, UNSETTLED, OUTSIDE, DIVERGED, OUTSIDE, REACHED])
    assert found == {0: 2 / 6, 1: 2 / 6, -1: 1 / 6, CellState.DIVERGED: 1 / 6}
    assert fractions([0, 1], [REACHED, REACHED]) == {0: 0.5, 1: 0.5, -1: 0.0}
    assert fractions([-1, -1], [OUTSIDE, OUTSIDE]) == {0: 0.0, 1: 0.0, -1: 0.0}


def test_known_attractors_are_stable_orbits_of_the_system():
    orbit = bf.find_orbit(SYSTEM)
    assert _known(SYSTEM, None) == [] and _known(SYSTEM, (orbit,)) == [orbit]
    with pytest.raises(ValueError, match="list"):
        _known(SYSTEM, 3)
    with pytest.raises(ValueError, match="another system"):
        _known(SYSTEM.with_parameters(amplitude=0.2), [orbit])
    with pytest.raises(ValueError, match="must be a PeriodicOrbit"):
        _known(SYSTEM, ["orbit"])
    for success, stable in ((False, True), (True, False), (False, False)):
        class Stand(type(orbit)):
            def __init__(self):
                self.system = SYSTEM
        other = Stand()
        other.__dict__.update(success=success, stable=stable)
        type(other).success, type(other).stable = success, stable
        type(other).__repr__ = lambda self: "an orbit"
        with pytest.raises(ValueError, match="no attractor"):
            _known(SYSTEM, [other])


@pytest.mark.parametrize("chance", [0.3, 0.6])
def test_chances_and_times_of_a_gambler(chance):
    """Cells 0 .. 4: the ends hold the attractors, one step a mapping; from cell 3 a tenth leaves the grid."""
    grid = bf.Grid(q0=(0.0, 5.0, 5))
    P = np.zeros((6, 6))
    P[0, 0] = P[4, 4] = P[5, 5] = 1.0
    for k in (1, 2):
        P[k, k + 1], P[k, k - 1] = chance, 1.0 - chance
    P[3, 4], P[3, 2], P[3, 5] = 0.9 * chance, 0.9 * (1.0 - chance), 0.1
    fates = np.full(5, CellFate.UNRESOLVED.code)
    groups = (Group(np.array([0]), GroupKind.PERIODIC, 1, 0), Group(np.array([4]), GroupKind.PERIODIC, 1, 1))
    made = CellMap(SYSTEM, grid, 2, 4, (None, None), groups, csr_matrix(P), np.empty(0, np.int64), fates, None, None, None, 0, {},
                   "")
    Q, R = P[1:4, 1:4], P[1:4][:, [0, 4, 5]]
    want = np.linalg.solve(np.eye(3) - Q, R)
    found = made.absorption()
    np.testing.assert_allclose(found.probability[1:4], want[:, :2], atol=1e-10)
    np.testing.assert_allclose(found.left[1:4], want[:, 2], atol=1e-10)
    np.testing.assert_allclose(found.unresolved, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.time[1:4], 2.0 * np.linalg.solve(np.eye(3) - Q, np.ones(3)), atol=1e-9)  # in periods
    assert found.probability[0].tolist() == [1.0, 0.0] and found.probability[4].tolist() == [0.0, 1.0]
    labelled = made.with_labels()
    np.testing.assert_array_equal(labelled.labels.ravel()[1:4], np.argmax(want[:, :2], axis=1))
    unknown = dataclasses.replace(made, groups=(groups[0],))  # of the other end nothing is confirmed
    np.testing.assert_allclose(unknown.absorption().unresolved[1:4], want[:, 1], atol=1e-10)


def test_chances_lie_between_none_and_all_whatever_rounding_says(monkeypatch):
    """Of three cells one leads to the attractor of the other; what the equations are solved to may be off at both ends."""
    P = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]])
    made = CellMap(SYSTEM, bf.Grid(q0=(0.0, 3.0, 3)), 1, 1, (None,), (Group(np.array([0]), GroupKind.PERIODIC, 1, 0),),
                   csr_matrix(P), np.empty(0, np.int64), np.full(3, CellFate.UNRESOLVED.code), None, None, None, 0, {}, "")
    solved = cell_map.solved
    monkeypatch.setattr(cell_map, "solved", lambda *given: solved(*given) * (1.0 + 1e-9) - 1e-10)
    found = made.absorption()
    for values, want in ((found.probability[:, 0], [1.0, 1.0, 0.0]), (found.left, [0.0, 0.0, 1.0]), (found.unresolved, [0.0] * 3)):
        assert values.tolist() == want


def test_images_are_read_in_the_components_of_the_grid(rng):
    calls = []

    class Map:
        scene = SimpleNamespace(n=1, ns=2)
        kernel = "batch"

        def apply(self, states, periods):
            calls.append(periods)
            return SimpleNamespace(ends=states * [2.0, -1.0], outcomes=np.array([0] * (len(states) - 1) + [3]))
    states = np.array([[0.1, 0.4], [0.3, -0.2], [0.2, 0.2]])
    for names in (("q0", "v0"), ("v0", "q0")):
        grid = bf.Grid(**dict.fromkeys(names, (-1.0, 1.0, 4)))
        carrier = Carrier(lambda x: x, grid, 3, 10)
        carrier.map = Map()
        ends, outcomes, cells = carrier.images(states)
        want = states * [2.0, -1.0]
        np.testing.assert_allclose(ends, want if names[0] == "q0" else want[:, ::-1])
        assert calls[-1] == 3 and outcomes.tolist() == [0, 0, 3] and cells[-1] == -1
        np.testing.assert_array_equal(cells[:2], grid.cells_of(ends[:2]))
        assert carrier.lean
    function = Carrier(lambda x: x + 1.0, bf.Grid(q0=(0.0, 10.0, 10)), 4, 10)
    ends, outcomes, cells = function.images(np.array([[0.5], [7.5], [np.inf]]))
    assert ends[:2].ravel().tolist() == [4.5, 11.5] and outcomes.tolist() == [0, 0, 3] and cells.tolist() == [4, -1, -1]
    np.testing.assert_allclose(offsets_of(bf.Grid(q0=(0, 1, 2), v0=(0, 1, 2)), 2), [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25],
                                                                                 [0.75, 0.75]])


def test_a_labeller_follows_points_as_their_map_did():
    """Also with its options, its fixed components and more workers."""
    oscillator = bf.systems.impact_oscillator(zeta=0.05, omega=0.5, amplitude=0.52, gap=1, restitution=0.7)
    for more in ({}, {"at": {"v0": 0.3}}):
        grid = bf.Grid(q0=(-3, 1, 6), **more) if more else bf.Grid(q0=(-3, 1, 6), v0=(-4, 4, 6))
        basins = bf.basins_of_attraction(oscillator, grid, max_periods=40)
        points = grid.points(np.arange(grid.size))
        assert basins.labeller(2)(points).tolist() == basins.labels.ravel().tolist()


def test_a_saddle_is_returned_where_the_motion_comes_back_and_newton_agrees(monkeypatch):
    made = []

    def found(system, motion, phase, k):
        made.append(k)
        return SimpleNamespace(success=True, stable=False, k=k)
    monkeypatch.setattr(search, "simulate", lambda system, y, periods: periods)
    monkeypatch.setattr(search, "from_motion", found)
    monkeypatch.setattr(search, "section_points", lambda orbit: np.array([[1.0, 0.0]]))

    def returned(points, finish):
        monkeypatch.setattr(search, "finished", finish)
        stand_in = SimpleNamespace(points=[np.array(p, float) for p in points], scale=np.ones(2), system=None)
        return search.Search.returned(stand_in)
    cycle = [[1.0, 0.0], [2.0, 0.0]] * 3 + [[1.0, 0.0]]
    saddle = returned(cycle, lambda orbit, more: orbit)
    assert saddle.k == 2 and made[0] == 2
    assert returned([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], lambda orbit, more: orbit) is None
    assert returned([[1.0, 0.0]], None) is None
    assert returned(cycle, lambda orbit, more: SimpleNamespace(success=False)) is None
    assert returned(cycle, lambda orbit, more: SimpleNamespace(success=True, stable=True)) is None


@pytest.mark.parametrize("saddle, count", [(None, 1), (object(), 2), (object(), 0), (None, 0)])
def test_an_unstable_set_needs_a_saddle_of_one_unstable_direction(saddle, count):
    with pytest.raises(ValueError, match="exactly one"):
        unstable.unstable_set(SimpleNamespace(saddle=saddle, unstable_directions=count))


@pytest.mark.parametrize("ranges, cells", [({}, None), ({"v0": (0.0, 1.0)}, None), ({"q0": (0.5, 1.0)}, 7),
                                           ({"v0": (0.0, 1.0), "q1": (-0.5, 0.5)}, 3)])
def test_a_zoom_is_a_map_of_the_part_that_was_asked_for(ranges, cells, monkeypatch):
    """Ranges that are named change, the others stay, with the number of cells; what is a circle remains one while it is whole."""
    grid = bf.Grid(q0=(-3.0, 3.0, 6), v0=(-2.0, 2.0, 4), q1=(-1.0, 1.0, 5), at={"v1": 0.3}, periodic=["q0", "q1"])
    asked = {}

    def map_of(system, grid, **options):
        asked.update(options, system=system, grid=grid)
        return "map"

    monkeypatch.setattr(bf, "basins_of_attraction", map_of)
    whole = SimpleNamespace(system="system", grid=grid, attractors="attractors", section="section", options={"max_periods": 9})
    assert BasinMap.zoom(whole, cells=cells, **ranges) == "map"
    for bad in (object(), 3.0, (0.0,), (1.0, 1.0), "ab", None):
        with pytest.raises(ValueError, match="BasinMap.zoom: v0 = .* is not allowed; it must be two different numbers"):
            BasinMap.zoom(whole, v0=bad)
    part = asked.pop("grid")
    assert asked == {"system": "system", "attractors": "attractors", "section": "section", "max_periods": 9}
    known = {"q0": (-3.0, 3.0, 6), "v0": (-2.0, 2.0, 4), "q1": (-1.0, 1.0, 5)}
    for axis, name in enumerate(part.names):
        low, high, count = known[name]
        assert (part.low[axis], part.high[axis]) == ranges.get(name, (low, high))
        assert part.shape[axis] == (cells or count)
    assert part.names == grid.names and part.at == grid.at
    assert set(part.periodic) == {"q0", "q1"} - set(ranges)


@pytest.mark.parametrize("piece", [4, 12, 1000])
def test_images_of_all_cells_do_not_depend_on_how_they_are_shared_out(piece, monkeypatch):
    """A map of the plane that loses what starts to the right: rows, columns and losses of every sample, chunk by chunk."""
    grid = bf.Grid(q0=(-1.0, 1.0, 6), q1=(-1.0, 1.0, 5))

    def moved(X):
        return np.where(X[:, :1] > 0.3, np.inf, X @ np.array([[0.6, 0.5], [-0.7, 0.8]]))

    monkeypatch.setattr(images, "PIECE", piece)
    with Progress("cells", float(grid.size), False) as bar:
        found = images.cell_images(Carrier(moved, grid, 1, 10), 2, 10, ChunkStore(None, {}), {"workers": 1, "executor": None}, bar)
    samples = images.spread(grid, np.arange(grid.size), offsets_of(grid, 2))
    ends = moved(samples)
    lost = ~np.isfinite(ends).all(axis=1)
    assert found.lost == np.count_nonzero(lost) > 0
    assert np.array_equal(found.rows, np.repeat(np.arange(grid.size), len(samples) // grid.size))
    assert np.array_equal(found.columns, np.where(lost, -1, grid.cells_of(np.where(lost[:, None], np.nan, ends))))
    assert found.starts.all() and not found.special
