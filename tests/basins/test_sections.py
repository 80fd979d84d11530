"""Basins of motions without a clock: on a section, against what is known of their boundaries."""
import numpy as np
import pytest

import bifurc as bf

TOPS = bf.Section("v0", direction=-1)


def test_steady_sliding_beside_stick_slip(tmp_path):
    zeta, speed, kinetic = 0.05, 0.3, 0.6
    system = bf.systems.belt_oscillator(zeta=zeta, belt_speed=speed, static=1.0, kinetic=kinetic)
    file = tmp_path / "belt.npz"
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 2, 12), v0=(-1.5, 1.5, 12)), section=TOPS, max_periods=200, file=file)
    assert [type(item).__name__ for item in basins.attractors] == ["Equilibrium", "PeriodicOrbit"]
    assert basins.counts == {0: 6, 1: 138, -1: 0}
    wd, t = np.sqrt(1.0 - zeta**2), np.linspace(0.0, 60.0, 20001)
    for i, x in enumerate(basins.grid.centres(0) - kinetic):  # it slides for ever where the speed never reaches that of the belt
        for j, v in enumerate(basins.grid.centres(1)):
            if v < speed:
                rate = np.exp(-zeta * t) * (v * np.cos(wd * t) - (x + zeta * v) / wd * np.sin(wd * t))
                assert (basins.labels[i, j] == 0) == (rate.max() < speed)
    again = bf.load(file)
    assert again.section == TOPS and np.array_equal(again.labels, basins.labels)
    assert np.abs(again.attractors[0].state - [kinetic, 0.0]).max() < 1e-12


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
    ({"coordinate": "x 1"}, "component"), ({"coordinate": 3}, "name"), ({"coordinate": "q0", "value": np.nan}, "finite"),
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
