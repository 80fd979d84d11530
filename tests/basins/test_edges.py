"""Edge states: the saddle of problem A to rounding, what its unstable set reaches, third basins, hopeless cases."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.boundaries.search import EdgeStatus, Search
from bifurc.ensemble.period_map import PeriodMap

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)


@pytest.fixture(scope="module")
def basins():
    return bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0, 50), v0=(-3, 3, 50)))


@pytest.fixture(scope="module")
def edge(basins):
    return bf.edge_state(basins)


def test_the_saddle_is_found_to_rounding_with_one_multiplier_outside(edge):
    saddle = edge.saddle
    assert edge.success and saddle.periods == 3 and saddle.residual <= 1e-12
    end = PeriodMap(A).apply(saddle.state[None], 3).ends[0]
    np.testing.assert_allclose(end, saddle.state, rtol=0, atol=1e-12)
    assert edge.unstable_directions == 1
    # each kick multiplies areas by r^2, the flow by exp(-2 zeta t)
    np.testing.assert_allclose(np.prod(saddle.multipliers).real, 0.8**6 * np.exp(-0.04 * saddle.period), rtol=1e-9)


def test_the_multipliers_are_those_of_differences_of_the_map(edge):
    h, y, period_map = 1e-6, edge.saddle.state, PeriodMap(A)
    X = y + h * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    ends = period_map.apply(X, 3).ends
    D = np.array([ends[0] - ends[1], ends[2] - ends[3]]).T / (2 * h)
    found = np.sort(np.linalg.eigvals(D).real)[::-1]
    np.testing.assert_allclose(found, edge.saddle.multipliers.real, rtol=1e-6)


def test_the_motion_on_the_boundary_stays_between_the_two(edge, basins):
    """Just beside each point on either side along the unstable direction labels differ (points are within LOOSE of it)."""
    search = Search(basins, (0, 1))
    found = edge.unstable_set(periods=3)
    assert {found.labels[0], found.labels[1]} == {(0,), (1,)}
    assert edge.gap < 1e-4 and edge.third == {} and edge.jumps == 0
    for y in edge.points[::12]:
        labels = search.label(y + 5e-6 * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]))
        assert set(labels.tolist()) == {0, 1}


def test_the_unstable_set_reaches_both_attractors_without_a_gap(edge, basins):
    found = edge.unstable_set(periods=80)
    assert found.complete and found.breaks == 0
    points = [orbit.sample(orbit.periods + 1)[1] for orbit in basins.attractors]
    for cycle in points:
        assert min(np.abs(found.points - y).max(axis=1).min() for y in cycle) < 1e-3
    for side in (0, 1):
        for number in np.unique(found.curves[found.sides == side]):
            piece = found.points[found.curves == number] / basins.scale
            assert np.linalg.norm(np.diff(piece, axis=0), axis=1).max(initial=0.0) <= 0.01
    assert "manifold" in found.message


def test_given_starts_and_the_pair_the_other_way_round_lead_to_the_same_saddle(basins, edge):
    labels = basins.labels.ravel()
    starts = basins.grid.starts(1, 2)
    ends = starts[[np.flatnonzero(labels == 1)[-1], np.flatnonzero(labels == 0)[0]]]
    other = bf.edge_state(basins, (1, 0), starts=ends)
    assert other.success
    points = edge.saddle.sample(4)[1][:-1]
    assert np.abs(points - other.saddle.state).max(axis=1).min() < 1e-10


def test_a_fractal_boundary_has_a_saddle_too():
    system = bf.systems.impact_oscillator(zeta=0.05, omega=4.25, amplitude=1.0, gap=0.1, restitution=0.8)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.4, 0.1, 30), v0=(-3, 3, 30)))
    found = bf.edge_state(basins)
    assert found.status in (EdgeStatus.SADDLE, EdgeStatus.NO_RETURN)
    if found.success:
        assert found.unstable_directions >= 1 and found.saddle.residual <= 1e-12


def test_a_smooth_law_is_served_as_well():
    basins = bf.basins_of_attraction(bf.systems.duffing_oscillator(omega=1.5), bf.Grid(q0=(-2, 2, 8), v0=(-3, 3, 8)))
    found = bf.edge_state(basins)
    assert found.success and found.unstable_directions == 1 and found.saddle.periods == 1
    assert "immersed manifold" in found.unstable_set(periods=12).message


def test_three_basins_report_hits_in_the_third():
    """Rest, bouncing and a third motion: whatever lies between a pair is named."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=6.25, amplitude=1.0, gap=0.1, restitution=0.8)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.4, 0.1, 30), v0=(-3, 3, 30)))
    assert len(basins.attractors) == 3
    found = bf.edge_state(basins, (1, 2), max_periods=60)
    assert found.third.keys() <= {-1, 0} and found.message.startswith(found.status.sentence)
    assert sum(found.third.values()) > 0 and "label 0" in found.message


def test_bad_requests(basins, edge):
    with pytest.raises(ValueError, match=r"pair = \(0, 2\) is not allowed; it must be two different labels of the map, 0 to 1"):
        bf.edge_state(basins, (0, 2))
    with pytest.raises(ValueError, match="basins = 3 is not allowed; it must be a BasinMap"):
        bf.edge_state(3)
    with pytest.raises(ValueError, match="the map has 1 attractor: there is no boundary between two basins"):
        bf.edge_state(bf.basins_of_attraction(bf.systems.impact_oscillator(omega=0.5), bf.Grid(q0=(-1, 1, 3), v0=(-1, 1, 3))))
    with pytest.raises(ValueError, match="lead to"):
        bf.edge_state(basins, starts=np.zeros((2, 2)) - 0.5)
    with pytest.raises(ValueError, match="must be a table of finite numbers"):
        bf.edge_state(basins, starts=np.zeros(2))
    assert "\n" not in repr(edge)
