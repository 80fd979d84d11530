"""States are known by the names that the user gave them: starts, grids, sections, regions, columns and pictures."""
import numpy as np
import pytest

import bifurc as bf

F, S = bf.AffineField, bf.AffineSurface
A = [[0.0, 1.0], [-1.0, -0.1]]


def belt(names="x v", V=0.9):
    load = {1: [0.0, 1.0]}
    return bf.PiecewiseSystem(names, {"-": F(A, [0.0, 0.3], cos=load), "+": F(A, [0.0, -0.3], cos=load)},
                              [bf.Switch(S([0.0, 1.0], lambda V: -V))], omega=1.6, V=V)


@pytest.mark.parametrize("names", ["x v", "charge current", "w1 w0"])
def test_a_start_by_name_is_the_start_by_place(names):
    system, (one, two) = belt(names), names.split()
    assert system.states == (one, two)
    a, b = bf.simulate(system, {two: 0.2, one: -0.4}, periods=3), bf.simulate(system, (-0.4, 0.2), periods=3)
    assert np.array_equal(a.final, b.final) and np.array_equal(bf.simulate(system, {two: 0.2}, periods=3).final,
                                                                bf.simulate(system, (0.0, 0.2), periods=3).final)
    assert np.array_equal(bf.find_orbit(system, {one: 0.1, two: 0.2}).state, bf.find_orbit(system, (0.1, 0.2)).state)


def test_starts_of_systems_with_coordinates_have_names_too():
    system = bf.systems.impact_oscillator()
    assert system.states == ()
    assert np.array_equal(bf.simulate(system, {"v0": 0.3}, periods=2).final, bf.simulate(system, (0.0, 0.3), periods=2).final)
    with pytest.raises(ValueError, match="q0 .. q0 and v0 .. v0, no memory"):
        bf.simulate(system, {"x": 0.3}, periods=2)


def test_grids_regions_and_pictures():
    system = belt()
    named = bf.basins_of_attraction(system, bf.Grid(x=(-1, 1, 6), v=(-1, 1, 5)), seed=1)
    numbered = bf.basins_of_attraction(system, bf.Grid(w0=(-1, 1, 6), w1=(-1, 1, 5)), seed=1)
    assert np.array_equal(named.labels, numbered.labels) and named.counts == numbered.counts
    for basins in (named, numbered):
        axes = basins.plot()
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x at phase 0", "v at phase 0")
    line = bf.basins_of_attraction(system, bf.Grid(v=(-1, 1, 4), at={"x": 0.5}), seed=1)
    other = bf.basins_of_attraction(system, bf.Grid(w1=(-1, 1, 4), at={"w0": 0.5}), seed=1)
    assert np.array_equal(line.periods, other.periods)
    cells = bf.cell_mapping(system, bf.Grid(x=(-2, 2, 10), v=(-2, 2, 10)), periods=2, audit=0)
    assert cells.plot().get_xlabel() == "x at phase 0"
    diagram = bf.bifurcation_diagram(system, "V", [0.9, 1.0], transient=20)
    assert diagram.plot(component=1).get_ylabel() == "v at phase 0"
    chart = bf.parameter_chart(system, {"V": (0.9, 1.1, 2), "omega": (1.5, 1.7, 2)}, {"x": (-1, 1), "v": (-1, 1)}, starts=2,
                               transient=20)
    assert chart.system == system


def test_sections_and_columns():
    chua = bf.systems.chua_circuit(alpha=5.0)
    motion = bf.simulate(chua, {"x": 0.5}, duration=30.0)
    one, two = bf.Section("y", direction=0).crossings(motion), bf.Section("w1", direction=0).crossings(motion)
    assert len(one[0]) > 3 and np.array_equal(one[0], two[0])
    branch = bf.trace(bf.find_orbit(belt()), "V", bounds=(0.85, 0.95))
    assert {"max_x", "rms_v"} <= set(branch.column_names) and branch.states == ("x", "v")
    for kind in ("max", "min", "rms", "h1"):
        assert np.array_equal(branch.column(f"{kind}_v"), branch.column(f"{kind}_1"))
    assert branch.plot(measure="max_v").get_ylabel() == branch.plot(measure="max_1").get_ylabel() == "max v"
    rests = bf.trace(bf.find_equilibrium(chua, {"x": 1.4, "z": -1.4}), "alpha", bounds=(4.0, 6.0))
    np.testing.assert_allclose(rests.column("q_x"), 1.5)


@pytest.mark.parametrize("use", [
    lambda s: bf.simulate(s, {"q0": 1.0}, periods=1), lambda s: bf.find_orbit(s, {"y": 1.0}),
    lambda s: bf.basins_of_attraction(s, bf.Grid(x=(0, 1, 2), w2=(0, 1, 2))),
    lambda s: bf.basins_of_attraction(s, bf.Grid(x=(0, 1, 2), at={"y": 1.0})),
    lambda s: bf.cell_mapping(s, bf.Grid(x=(0, 1, 2), y=(0, 1, 2))),
    lambda s: bf.Section("y").crossings(bf.simulate(s, (0.0, 0.0), periods=1))])
def test_a_name_that_is_not_there_is_told_with_those_that_are(use):
    with pytest.raises(ValueError, match="has the states x, v"):
        use(belt())


def test_malformed_names():
    for name in ("x v", "1", "", 3, None):
        with pytest.raises(ValueError, match=r"component|name"):
            bf.Section(name)
    for name in ("x v", "1", ""):
        with pytest.raises(ValueError, match="component"):
            bf.Grid(**{name: (0, 1, 2)})
    with pytest.raises(ValueError, match="component"):
        bf.simulate(belt(), {3: 1.0}, periods=1)
    with pytest.raises(ValueError, match="y0"):
        bf.simulate(belt(), {"x": "a"}, periods=1)
    with pytest.raises(KeyError, match="max_x"):
        bf.trace(bf.find_orbit(belt()), "V", bounds=(0.89, 0.91)).column("max_y")
    with pytest.raises(ValueError, match="missing: v"):
        bf.cell_mapping(belt(), bf.Grid(x=(0, 1, 2)))
