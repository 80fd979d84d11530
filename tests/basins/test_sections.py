"""Basins of motions without a clock: on a section, against what is known of their boundaries."""
import numpy as np
import pytest
from matplotlib.path import Path

import bifurc as bf

TOPS = bf.Section("v0", direction=-1)


@pytest.fixture(scope="module")
def belt():
    """Mass on a belt where steady sliding and stick-slip coexist, with the unstable cycle between them."""
    system = bf.systems.belt_oscillator(law="exponential", kinetic=0.5, belt_speed=2.5)
    sliding = bf.trace(bf.find_equilibrium(system), "belt_speed", bounds=(1.0, 3.0))
    (small,) = bf.switch_branch(sliding.special_points.of("hopf")[0])
    cycles = bf.trace(small, "belt_speed", bounds=(1.0, 3.0))
    speeds = cycles.column("belt_speed")
    near = int(np.argmin(np.where(cycles.column("n_events") == 0, np.abs(speeds - 1.49395), np.inf)))
    there = system.with_parameters(belt_speed=1.49395)
    unstable = bf.find_orbit(there, guess=cycles.orbits[near])
    return there, unstable


def test_the_unstable_cycle_is_the_boundary(belt):
    system, unstable = belt
    assert unstable.success and unstable.stable is False and abs(unstable.multipliers[0].real - 1.48317407194657) < 1e-7
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-1.5, 2.5, 12), v0=(-1.6, 1.4, 12)), section=TOPS, max_periods=400)
    assert [type(item).__name__ for item in basins.attractors] == ["Equilibrium", "PeriodicOrbit"]
    assert basins.counts[-1] == 0
    path = unstable.sample(2001)[1]
    cells = np.array(np.meshgrid(*(basins.grid.centres(axis) for axis in (0, 1)), indexing="ij")).reshape(2, -1).T
    inside = Path(path).contains_points(cells)
    distance = np.array([np.hypot(*(path - cell).T).min() for cell in cells])
    wrong = (basins.labels.ravel() == 1) == inside
    assert inside.sum() > 10 and not wrong[distance > 1e-2].any()


def test_a_map_on_a_section_comes_back_from_its_file(belt, tmp_path):
    system, _ = belt
    grid = bf.Grid(q0=(-1.0, 2.0, 3), v0=(-1.0, 1.0, 3))
    basins = bf.basins_of_attraction(system, grid, section=TOPS, file=tmp_path / "belt.npz", max_periods=300)
    again = bf.load(tmp_path / "belt.npz")
    assert again.section == TOPS and np.array_equal(again.labels, basins.labels)
    assert np.abs(again.attractors[0].state - basins.attractors[0].state).max() < 1e-12
    assert np.array_equal(again.labeller()(grid.points(np.arange(9))), basins.labels.ravel())
    assert "at rest" in [bf.plotting.describe(item) for item in again.attractors]
    basins.plot()


def test_crossings_of_a_known_motion():
    # x = cos t: maxima at 2 pi k, rises through 0.5 at 2 pi k - pi/3
    system = bf.System(1.0, 0.0, 1.0, [])
    motion = bf.simulate(system, (1.0, 0.0), duration=20.0)
    times, states = bf.Section("q0", 0.5).crossings(motion)
    assert np.abs(times - (2.0 * np.pi * np.arange(1, 4) - np.pi / 3.0)).max() < 1e-12
    assert np.abs(states - [0.5, np.sqrt(0.75)]).max() < 1e-12
    assert len(bf.Section("q0", 0.5, 0).crossings(motion)[0]) == 6 + 1
    assert not len(bf.Section("q0", 1.5, 0).crossings(motion)[0])


def test_an_impact_that_jumps_over_the_value_counts_with_the_state_before_it():
    system = bf.System(1.0, 0.0, 1.0, [bf.elements.RigidStop(0.5, 0.5)])
    motion = bf.simulate(system, (0.0, 1.0), duration=1.0)
    times, states = bf.Section("v0", direction=-1).crossings(motion)
    assert np.allclose(times, [np.pi / 6.0], atol=1e-12) and np.allclose(states, [[0.5, np.sqrt(0.75)]], atol=1e-12)


@pytest.mark.parametrize(("arguments", "words"), [
    ({"coordinate": "x"}, "component"), ({"coordinate": 3}, "name"), ({"coordinate": "q0", "value": np.nan}, "finite"),
    ({"coordinate": "q0", "direction": 2}, "direction")])
def test_impossible_sections(arguments, words):
    with pytest.raises(ValueError, match=words):
        bf.Section(**arguments)


def test_where_a_section_belongs():
    belt, forced = bf.systems.belt_oscillator(), bf.systems.impact_oscillator(omega=1.4)
    grid = bf.Grid(q0=(-1.0, 1.0, 2), v0=(-1.0, 1.0, 2))
    with pytest.raises(ValueError, match="autonomous.*section"):
        bf.basins_of_attraction(belt, grid)
    with pytest.raises(ValueError, match="phase 0"):
        bf.basins_of_attraction(forced, grid, section=TOPS)
    with pytest.raises(ValueError, match="unknown to this system"):
        bf.basins_of_attraction(belt, grid, section=bf.Section("q4"))
