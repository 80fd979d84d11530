"""Which starts a delayed feedback brings to its orbit, against simulations of the delay equation that are followed to their end."""
import numpy as np
import pytest
from matplotlib.figure import Figure

import bifurc as bf
from bifurc.control import basins
from tests.reference.impacting_orbit import impacting


@pytest.fixture(scope="module")
def orbit():
    return impacting()


@pytest.fixture(scope="module")
def held(orbit):
    system = orbit.system
    feedback = bf.elements.DelayedFeedback(0.04)
    return bf.System(system.mass, system.damping, system.stiffness, (*system.elements, feedback), omega=system.omega)


def test_starts_next_to_the_orbit_are_held_and_starts_beyond_the_stop_are_none(orbit, held):
    q, v = orbit.state
    near = bf.control.feedback_basins(held, orbit, bf.Grid(q0=(q - 0.1, q + 0.1, 2), v0=(v - 0.1, v + 0.1, 1)), past="orbit")
    assert near.labels.tolist() == [[0], [0]] and near.held == 1.0 and (near.periods < 100).all()
    beyond = bf.control.feedback_basins(held, orbit, bf.Grid(q0=(1.1, 1.5, 2), v0=(v, v + 0.1, 1)))
    assert (beyond.labels == -1).all() and beyond.held == 0.0
    assert [tuple(bf.basins.CellState)[code] for code in beyond.states.ravel()] == ["outside", "outside"]
    (label,) = [text.get_text() for text in near.plot(ax=Figure().subplots()).get_legend().get_texts()]
    assert "100" in label


def test_what_cannot_be_asked_is_said(orbit, held):
    grid = bf.Grid(q0=(-3, 1, 2), v0=(-1, 1, 2))
    with pytest.raises(ValueError, match="past"):
        bf.control.feedback_basins(held, orbit, grid, past="rest")
    with pytest.raises(ValueError, match="whole number"):
        odd = bf.System(1.0, 0.1, 1.0, (*orbit.system.elements, bf.elements.DelayedFeedback(0.04, delay=1.3)), omega=2.5)
        bf.control.feedback_basins(odd, orbit, grid)
    with pytest.raises(ValueError, match="DelayedFeedback"):
        bf.control.feedback_basins(orbit.system, orbit, grid)


def test_an_interrupted_map_goes_on_and_its_file_holds_it(orbit, held, tmp_path, monkeypatch):
    grid, options = bf.Grid(q0=(-7.5, -2.5, 3), v0=(-3.0, 9.0, 3)), {"past": "orbit", "max_periods": 12}
    monkeypatch.setattr(basins, "CHUNK", 3)
    whole = bf.control.feedback_basins(held, orbit, grid, **options)
    counted, followed = [], basins.followed

    def stopped(*arguments):
        if len(counted) == 2:
            raise KeyboardInterrupt
        counted.append(len(arguments[-1]))
        return followed(*arguments)
    file = tmp_path / "held.npz"
    monkeypatch.setattr(basins, "followed", stopped)
    with pytest.raises(KeyboardInterrupt):
        bf.control.feedback_basins(held, orbit, grid, file=file, **options)
    assert not file.exists() and counted == [3, 3]
    monkeypatch.setattr(basins, "followed", lambda *arguments: counted.append(len(arguments[-1])) or followed(*arguments))
    found = bf.control.feedback_basins(held, orbit, grid, file=file, **options)
    assert counted == [3, 3, 3]
    loaded = bf.control.FeedbackBasins.load(file)
    again = bf.control.feedback_basins(held, orbit, grid, file=file, **options)
    assert counted == [3, 3, 3]
    for other in (found, loaded, again):
        assert np.array_equal(other.labels, whole.labels) and np.array_equal(other.periods, whole.periods)
        assert len(other.attractors) == len(whole.attractors) and other.fractions == whole.fractions
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(FileExistsError, match="left alone"):
        bf.control.feedback_basins(held, orbit, grid, file=tmp_path / "note.txt", **options)


@pytest.mark.slow
@pytest.mark.parametrize("past", ["free", "constant", "orbit"])
def test_labels_are_what_long_simulations_of_the_delay_equation_end_on(orbit, held, past):
    """Each start again, far longer and from its own call, with the past given as a function."""
    grid = bf.Grid(q0=(-7.5, -2.5, 3), v0=(-3.0, 9.0, 3))
    found = bf.control.feedback_basins(held, orbit, grid, past=past, max_periods=150)
    pasts = {"free": lambda y: None, "constant": lambda y: lambda t: np.tile(y, (len(t), 1)), "orbit": lambda y: orbit}
    assert 0.0 < found.held < 1.0
    for start, label in zip(grid.points(np.arange(grid.size)), found.labels.ravel(), strict=True):
        motion = bf.simulate(held, start, periods=220 if label == 0 else 150, history=pasts[past](start))
        away = np.abs((motion.sections[-5:] - orbit.state) / orbit.weights).max()
        assert away < 1e-4 if label == 0 else away > 1e-3
