"""The stable set of a saddle: its tangent, the labels on its two sides, the boundary cells of a map, and what has no past."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import bifurc as bf
from bifurc.basins.attractors.attractors import section_points
from bifurc.basins.boundaries.stable import StableSet
from bifurc.basins.boundaries.time_reversal import Backwards, reversed_system
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, LinearSpring, RigidStop
from bifurc.ensemble.outcomes import NO_START
from bifurc.ensemble.period_map import PeriodMap

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
DUFFING = bf.systems.duffing_oscillator(zeta=0.075, omega=1.0, amplitude=0.3, alpha=-1.0, beta=1.0)
UNSTABLE = bf.System(1.0, 0.3, -1.0, [HarmonicForce(0.2, phase=0.4), LinearSpring(0.25, 0.1)], omega=1.3)


@pytest.fixture(scope="module")
def edge():
    return bf.edge_state(bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400))))


@pytest.fixture(scope="module")
def duffing():
    return bf.edge_state(bf.basins_of_attraction(DUFFING, bf.Grid(q0=(-2.2, 2.2, 100), v0=(-2.2, 2.2, 100))))


def test_the_set_separates_the_basins_of_problem_a_everywhere(edge):
    found = edge.stable_set()
    assert found.separates(1000) >= 0.999
    assert found.multiplier == pytest.approx(np.abs(edge.saddle.multipliers).min(), rel=1e-6)
    assert "corners where motions graze" in found.message and "no single past" not in found.message


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e4])
def test_it_separates_in_any_unit_of_length(unit):
    """Without gap the oscillator knows no length: in micrometres and in kilometres the same points have the same two labels."""
    system = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=unit, gap=0.0, restitution=0.8)
    grid = bf.Grid(q0=(-2.5 * unit, 0.0, 60), v0=(-3.0 * unit, 3.0 * unit, 60))
    found = bf.edge_state(bf.basins_of_attraction(system, grid)).stable_set(periods=15)
    assert found.separates(200) >= 0.99


def test_it_passes_within_a_cell_of_every_boundary_cell(edge):
    """Asked: 99 % of the boundary cells of the 400 x 400 map.  Distances in cells, along each axis."""
    found, grid, labels = edge.stable_set(), edge.basins.grid, edge.basins.labels
    beside = np.zeros(labels.shape, bool)
    for axis in (0, 1):
        low, high = np.split(np.arange(labels.shape[axis]), [0])[1][:-1], np.arange(1, labels.shape[axis])
        differ = np.take(labels, low, axis) != np.take(labels, high, axis)
        for place in (low, high):
            view = np.moveaxis(beside, axis, 0)
            view[place] |= np.moveaxis(differ, axis, 0)
    dense = []
    for number in np.unique(found.curves):
        piece = found.points[found.curves == number] / grid.widths
        steps = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(piece, axis=0)).max(axis=1))))
        at = np.linspace(0.0, steps[-1], int(10 * steps[-1]) + 2)
        dense.append(np.column_stack([np.interp(at, steps, column) for column in piece.T]))
    away = cKDTree(np.concatenate(dense)).query(grid.starts(1, 2)[beside.ravel()] / grid.widths, p=np.inf)[0]
    assert np.mean(away <= 1.0) >= 0.99


def test_its_motions_go_to_the_saddle(edge):
    found = edge.stable_set(periods=15)
    points = section_points(edge.saddle)
    images = PeriodMap(A).apply(found.points[::40], 21)  # errors grow by 2.25 every three periods
    assert (images.outcomes == 0).all()
    assert np.abs(images.ends[:, None] - points).max(axis=2).min(axis=1).max() < 1e-4


def test_tangent_and_multiplier_at_the_saddle_of_a_smooth_system(duffing):
    found = duffing.stable_set()
    saddle, scale = duffing.saddle, duffing.basins.scale
    values, vectors = np.linalg.eig(saddle.monodromy)
    least = int(np.argmin(np.abs(values)))
    tangent = vectors[:, least] / scale
    tangent /= np.linalg.norm(tangent)
    assert abs(tangent[0] * found.direction[1] - tangent[1] * found.direction[0]) <= 1e-8
    assert found.multiplier == pytest.approx(values[least], rel=1e-8)
    assert found.separates() == 1.0 and found.merging == 0
    x = section_points(saddle)[0]
    near = found.points[np.argsort(np.linalg.norm((found.points - x) / scale, axis=1))[:8]]
    along = (near - x) / scale
    assert np.abs(along[:, 0] * tangent[1] - along[:, 1] * tangent[0]).max() <= 1e-8


def test_a_linear_saddle_has_its_eigenvectors_in_closed_form():
    """Without events the set of the linear saddle is a line through its periodic point: both maps, back and forth."""
    period_map = PeriodMap(UNSTABLE)
    rates, vectors = np.linalg.eig([[0.0, 1.0], [0.75, -0.4]])
    least = int(np.argmin(rates))
    amplitude = 0.2 * np.exp(0.4j) / (-0.75 - 1.3**2 + 0.4j * 1.3)
    x = np.array([amplitude.real, (1.3j * amplitude).real])
    back = Backwards(period_map, np.ones(2), np.full(2, -np.inf), np.full(2, np.inf))
    start = x + np.outer([1e-3, -2e-3, 0.05], vectors[:, least])
    images = back.apply(start, 1)
    assert (images.outcomes == 0).all()
    growth = np.exp(-rates[least] * UNSTABLE.period)
    np.testing.assert_allclose(images.ends - x, growth * (start - x), rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("stop", [RigidStop(gap=0.3, restitution=0.8), RigidStop(gap=0.4, restitution=0.6, side=-1, amplitude=0.1,
                                                                                 harmonic=1, phase=0.5),
                                  ElasticStop(0.3, 4.0, damping=0.2)])
def test_motions_are_undone(stop, rng):
    """Forward and back through impacts, moving walls and dashpots, where nothing comes to rest."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0, phase=0.3), stop], omega=1.7)
    forward = PeriodMap(system)
    X = rng.uniform(-0.25, 0.25, (60, 2)) * [1.0, 8.0]
    there = forward.apply(X, 1)
    good = (there.outcomes == 0) & (there.speeds > 1e-3)
    assert np.count_nonzero(good) >= 40 and there.impacts.max() > 0
    back = Backwards(forward, np.ones(2), np.full(2, -np.inf), np.full(2, np.inf)).apply(there.ends[good], 1)
    assert (back.outcomes == 0).mean() >= 0.95
    kept = back.outcomes == 0
    np.testing.assert_allclose(back.ends[kept], X[good][kept], rtol=0, atol=1e-9)


def test_where_motions_come_to_rest_the_past_is_not_unique():
    """A stop that holds the mass: many starts end alike; the set that is found stays clear of them and says so or never met one."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.3, amplitude=1.0, gap=0.1, restitution=0.6)
    forward = PeriodMap(system)
    X = np.column_stack((np.linspace(-0.5, 0.0, 20), np.full(20, 0.1)))
    there = forward.apply(X, 1)
    rested = there.speeds == 0.0
    assert np.count_nonzero(rested) > 5 and np.ptp(there.ends[rested], axis=0).max() < 1e-9  # they have merged
    back = Backwards(forward, np.ones(2), np.full(2, -np.inf), np.full(2, np.inf)).apply(there.ends[rested], 1)
    away = np.abs(back.ends - X[rested]).max(axis=1)
    assert ((back.outcomes != 0) | (away > 1e-3)).sum() >= rested.sum() - 1  # not more than one start is the one found


def test_points_beyond_which_there_is_no_start_say_nothing_of_separation():
    """A set along q0 = 0: below v0 = 0 both sides have one label, above it the right side lies beyond a stop."""
    def label(points):
        return np.where((points[:, 0] > 0.0) & (points[:, 1] > 0.0), NO_START, 3)
    basins = SimpleNamespace(scale=np.ones(2), grid=bf.Grid(q0=(-1, 1, 10), v0=(-1, 1, 10)), labeller=lambda: label)
    points = np.column_stack((np.zeros(41), np.linspace(-0.9, 0.9, 41)))
    found = StableSet(points, np.zeros(41, int), np.zeros(41, int), 0.5, np.array([0.0, 1.0]), 0, 0, 0, True,
                      SimpleNamespace(basins=basins))
    assert found.separates() == 0.0
    basins.labeller = lambda: lambda points: (points[:, 0] > 0.0).astype(int)
    assert found.separates() == 1.0


@pytest.mark.parametrize("ends", [(-1.5, -0.5), (0.5, 1.5), (-1.5, 1.5)])
def test_a_piece_that_leaves_the_grid_is_not_asked(ends):
    basins = SimpleNamespace(scale=np.ones(2), grid=bf.Grid(q0=(-1, 1, 10), v0=(-1, 1, 10)), labeller=lambda: lambda points: 0)
    found = StableSet(np.column_stack((np.zeros(2), ends)), np.zeros(2, int), np.zeros(2, int), 0.5, np.array([0.0, 1.0]), 0, 0, 0,
                      True, SimpleNamespace(basins=basins))
    with pytest.raises(ValueError, match="has no piece within"):
        found.separates()


def test_friction_and_unknown_laws_are_refused(edge):
    with pytest.raises(ValueError, match="has no motion backwards"):
        reversed_system(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.2)], omega=1.0))
    with pytest.raises(ValueError, match="has no motion backwards"):
        reversed_system(A.with_parameters(restitution=0.0))
    with pytest.raises(ValueError, match="a stable set is drawn for one of two"):
        import dataclasses
        dataclasses.replace(edge, saddle=None).stable_set()


def test_it_is_drawn(edge):
    found = edge.stable_set(periods=12)
    ax = edge.basins.plot(saddle=edge, unstable=edge.unstable_set(periods=20), stable=found)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "stable set of the saddle" in words and "unstable set of the saddle" in words
    assert edge.plot(stable=found).axes is not None and "\n" not in repr(found)
