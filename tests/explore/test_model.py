"""Commands of the explorer without a browser: every result on the page comes with the lines that make it again."""
import runpy

import numpy as np
import pytest

import bifurc as bf
from bifurc.explore import model
from bifurc.explore.script import Script

SPAN = (1.5, 1.2)


@pytest.fixture(scope="module")
def traced():
    shown = model.of_system(bf.systems.impact_oscillator(), bounds=(0.5, 2.0), window={"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)})
    session = model.Session(shown)
    session.put(model.begin(shown))
    session.put(model.trace_here(session.now))
    return session.now


def test_pick_takes_the_nearest_row_and_special_points_first(traced):
    branch = traced.branches[0].value
    row = 20
    x, y = branch.column("omega")[row], branch.column("rms_0")[row]
    change = model.pick(traced, x, y, SPAN)
    assert change["place"] == (0, row)
    assert np.array_equal(change["orbit"].value.unknowns, branch.orbits[row].unknowns)
    fold = branch.special_points.of("fold")[0]
    change = model.pick(traced, fold.parameter + 0.003, fold.measures["rms_0"], SPAN)
    index = list(branch.special_points).index(fold)
    assert change["place"] == (0, -1 - index)
    assert change["system"].omega == pytest.approx(1.527621, abs=1e-6)


@pytest.mark.parametrize("span", [SPAN, (1.5, 40.0), (60.0, 1.2)])
def test_a_click_is_judged_on_the_screen_in_both_directions(traced, span, rng):
    """Distances are parts of the visible widths: whatever the axes show, all special points and rows against all."""
    branch = traced.branches[0].value
    rows = np.column_stack([branch.column("omega"), branch.column("rms_0")]) / span
    points = np.array([[point.parameter, point.measures["rms_0"]] for point in branch.special_points]) / span
    taken = 0
    for k, click in enumerate([*points, *points] + [rows[i] for i in rng.integers(0, len(rows), 20)]):
        click = click + rng.uniform(-1.0, 1.0, 2) * (0.018 if k < len(points) else 0.05)
        near = np.hypot(*(points - click).T)
        place = model.pick(traced, *(click * span), span)["place"]
        if near.min() < model.POINT_SHARE:
            assert place == (0, -1 - int(near.argmin()))
            taken += 1
        else:
            away = np.hypot(*(rows - click).T)
            assert place[0] == 0 and away[place[1]] < away.min() + 1e-12  # on a boundary two rows are at one place
    assert 0 < taken < 2 * len(points) + 20


def test_a_changed_parameter_moves_the_orbit(traced):
    change = model.change_parameters(traced, {"omega": 0.6})
    # free vibration below the stop: the closed form of the linear oscillator
    amplitude = 0.52 / abs(1.0 - 0.6**2 + 2j * 0.05 * 0.6)
    assert change["orbit"].value.maximum() == pytest.approx(amplitude, rel=1e-12)
    assert change["place"] is None


def test_switching_needs_a_special_point_and_traces_what_is_born_there(traced):
    assert "special point" in model.switch_here(traced)["message"]
    point = traced.branches[0].value.special_points.of("period_doubling")[1]
    index = list(traced.branches[0].value.special_points).index(point)
    session = model.Session(traced)
    session.put(model.take(traced, 0, -1 - index))
    change = model.switch_here(session.now)
    assert len(change["branches"]) > 1
    assert {branch.value.orbits[0].periods for branch in change["branches"][1:]} == {2}


def test_maps_reuse_the_attractors_and_starts_lead_to_them(traced):
    session = model.Session(traced)
    session.put(model.change_parameters(traced, {"omega": 1.4}))
    session.put(model.map_here(session.now, cells=30))
    first = session.now.basins.value
    session.put(model.map_here(session.now, {"q0": (-1.0, 0.0), "v0": (0.0, 1.0)}, cells=20))
    closer = session.now.basins.value
    assert closer.grid == bf.Grid(q0=(-1.0, 0.0, 20), v0=(0.0, 1.0, 20))
    assert [a.unknowns.tolist() for a in closer.attractors] == [a.unknowns.tolist() for a in first.attractors]
    point = closer.grid.points(np.array([37]))[0]
    change = model.settle_on(session.now, *point)
    assert change["orbit"].value is closer.attractors[closer.labels.flat[37]]
    assert "no attractor" in model.settle_on(session.now, 50.0, 0.0)["message"]
    branch = session.now.branches[0]
    assert session.now.fits(branch) and not traced.__class__.fits(model.Session(session.now).put(
        model.change_parameters(session.now, {"amplitude": 0.6})), branch)


def test_the_script_makes_everything_again_bit_for_bit(traced, tmp_path, monkeypatch, capsys):
    session = model.Session(traced)
    point = list(traced.branches[0].value.special_points).index(traced.branches[0].value.special_points.of("grazing")[0])
    session.put(model.take(session.now, 0, -1 - point))
    session.put(model.change_parameters(session.now, {"omega": 1.4}))
    session.put(model.map_here(session.now, cells=20))
    session.put(model.map_here(session.now, {"q0": (-1.0, 0.5), "v0": (-1.0, 1.0)}, cells=25))
    shown = session.put(model.settle_on(session.now, 0.0, 0.0))
    files = model.save(shown, tmp_path / "out")
    assert [file.name for file in files] == ["explored.py", "branch_1.npz", "orbit_2.npz", "basins_2.npz", "branches.png",
                                             "orbit.png", "basins.png"]
    monkeypatch.chdir(tmp_path)
    made = runpy.run_path(str(files[0]))
    assert np.array_equal(made["branch_1"].column("rms_0"), shown.branches[0].value.column("rms_0"))
    assert np.array_equal(made["orbit_2"].unknowns, shown.orbit.value.unknowns)
    assert np.array_equal(made["basins_2"].labels, shown.basins.value.labels)
    assert (tmp_path / "basins.png").exists()
    assert "BasinMap" in capsys.readouterr().out


def test_scripts_write_systems_made_by_hand_with_their_elements():
    from bifurc import elements

    system = bf.System(np.diag([1.0, 2.0]), 0.1 * np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0 / 3.0]]),
                       [elements.HarmonicForce(0.3, dof=1), elements.RigidStop(0.7, 0.9, side=-1, label="left")], omega=1.1)
    text = Script(()).system(system)
    assert eval(text, {"bf": bf}) == system
    chain = bf.systems.impact_chain(n=3, omega=0.1 + 0.2)
    assert eval(Script(()).system(chain), {"bf": bf}) == chain


def test_back_undoes_a_drag_as_a_whole_and_reset_returns_to_the_first_page(traced):
    session = model.Session(traced)
    for omega in (0.51, 0.52, 0.53):
        session.put(model.change_parameters(session.now, {"omega": omega}), "drag omega")
    session.rest()
    session.put(model.change_parameters(session.now, {"omega": 0.6}), "drag omega")
    assert session.back().system.omega == 0.53
    assert session.back() is traced
    assert not session.can_go_back and session.back() is traced
    session.put({"measure": "max_0"}, "measure")
    assert session.reset() is traced


def test_saved_results_open(traced, tmp_path):
    traced.branches[0].value.save(tmp_path / "branch.npz")
    shown = model.of_result(bf.load(tmp_path / "branch.npz"), str(tmp_path / "branch.npz"))
    assert shown.bounds == (0.5, 2.0) and shown.orbit.value.system.omega == 0.5
    assert model.script(shown).count("bf.load(") == 1
    with pytest.raises(ValueError, match="opens branches, orbits and basin maps"):
        model.of_result(np.ones(3), "x.npz")
    with pytest.raises(ValueError, match="autonomous"):
        model.of_system(bf.System(1.0, 0.1, 1.0))


@pytest.mark.parametrize("wrong", [(2.0, 1.0), (1.0, 1.0), (np.nan, 1.0), (0.0, np.inf), (1.0,), (1.0, 2.0, 3.0), 3.0, "ab"])
def test_ranges_are_two_numbers_in_their_order(wrong):
    """Of the parameter and of the starts; nothing is turned round, nothing is served."""
    system, said = bf.systems.impact_oscillator(), f"= {wrong!r} is not allowed; it must be two finite numbers, the lower one first"
    for name, options in (("bounds", {"bounds": wrong}), ("window['q0']", {"window": {"q0": wrong, "v0": (-1.0, 1.0)}})):
        with pytest.raises(ValueError) as refused:
            bf.explore.serve(system, browser=False, **options)
        assert str(refused.value) == f"{name} {said}"
