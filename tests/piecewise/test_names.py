"""States are known by the names that the user gave them: starts, grids, sections, regions, columns and pictures."""
from dataclasses import replace

import numpy as np
import pytest

import bifurc as bf
from bifurc.cli.common import UsageError, check_measure
from bifurc.explore import model, pictures

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


def test_special_points_peaks_and_curves_go_by_names():
    branch = bf.trace(bf.find_orbit(belt(V=0.95)), "omega", bounds=(0.7, 1.6), peaks="max_v")
    assert branch.special_points.of("peak") and {point.name for point in branch.special_points.of("peak")} == {"max_v"}
    for point in branch.special_points:
        assert "rms_x" in point.measures and "max_1" in point.measures and "max_2" not in point.measures
        assert point.measures["max_v"] == point.measures["max_1"] == pytest.approx(point.solution.maximum(1))
    curve = bf.trace_curve(branch.special_points.of("peak")[0], ("omega", "V"), bounds={"omega": (0.7, 1.6), "V": (0.93, 0.97)})
    assert np.array_equal(curve.column("max_v"), curve.column("max_1")) and "rms_x" in curve.column_names


def test_the_explorer_shows_names(tmp_path):
    session = model.Session(model.of_system(belt(), "V", (0.85, 0.95), window={"x": (-1.0, 1.0), "v": (-1.0, 1.0)}))
    for step in (model.begin, model.trace_here):
        session.put(step(session.now))
    assert session.now.measure == "rms_x" and set(model.around(session.now)) == {"x", "v"}
    for measure in ("rms_x", "max_v"):
        shown = replace(session.now, measure=measure)
        branch = shown.branches[0].value
        lines = pictures.diagram(shown)["lines"]
        assert sum(map(len, lines["xs"])) >= len(branch) and np.isin(branch.column(measure), np.concatenate(lines["ys"])).all()
        assert model.pick(shown, branch.column("V")[3], branch.column(measure)[3], (0.1, 1.0))["place"] == (0, 3)
    branch.save(tmp_path / "branch.npz")
    again = model.of_result(bf.load(tmp_path / "branch.npz", elements=[belt().builder]), "branch.npz")
    assert again.measure == "rms_x" and pictures.diagram(again)["lines"]["xs"]


def test_the_command_line_knows_names():
    for measure in ("max_v", "h1_x", "rms_1"):
        assert check_measure(measure, belt()) == measure
    for measure in ("max_q", "rms_2", "v"):
        with pytest.raises(UsageError, match=r"there are max_x \.\. max_v, min_x"):
            check_measure(measure, belt())


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
