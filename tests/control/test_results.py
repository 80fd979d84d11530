"""Results of control: what their status means, when a motion was caught, and that they draw themselves."""
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import bifurc as bf
from bifurc import plotting
from bifurc.control.feedback_map import FeedbackBasins, HeldMotion
from bifurc.control.ogy_motion import ControlledMotion
from bifurc.control.results import FeedbackRange, FeedbackStatus
from bifurc.ensemble.outcomes import CellState


@pytest.mark.parametrize("status", list(FeedbackStatus))
def test_a_range_is_a_success_where_some_gain_holds(status):
    found = FeedbackRange(SimpleNamespace(), "velocity", (-1.0, 1.0), 0.0, (), (), None, None, status, np.empty(0), np.empty(0))
    assert found.success == (status in (FeedbackStatus.FOUND, FeedbackStatus.EVERYWHERE))
    assert found.message == status.sentence


def test_results_draw_themselves(monkeypatch):
    axes = Figure().subplots(2)
    for name, kind, given in (("plot_feedback", FeedbackRange, axes[0]), ("plot_controlled", ControlledMotion, list(axes))):
        monkeypatch.setattr(plotting, name, lambda *arguments: arguments)
        found = object.__new__(kind)
        assert found.plot(given) == (found, given) and found.plot() == (found, None)


@pytest.mark.parametrize("active, first", [([1, 1, 1], 0), ([0, 1, 1], 1), ([1, 0, 1], 2), ([0, 0, 0], None), ([1, 1, 0], None)])
def test_a_motion_is_caught_from_where_the_controller_stays_on(active, first):
    motion = ControlledMotion(np.zeros((4, 2)), np.zeros(3), np.array(active, bool), np.zeros(4), True, "", "omega")
    assert motion.captured == first


def test_shares_of_a_map_with_feedback_are_those_of_what_may_start():
    """Of nine cells three lie beyond a stop; of the six others three end on the orbit, two on another motion."""
    labels = np.array([[0, 0, 1], [-1, 0, 1], [-1, -1, -1]])
    states = np.zeros((3, 3), np.int8)
    states[1, 0], states[2] = CellState.UNSETTLED.code, CellState.OUTSIDE.code
    found = FeedbackBasins(None, None, None, "", labels, states, np.ones((3, 3), int), (None, None))
    assert found.fractions == {0: 0.5, 1: pytest.approx(1.0 / 3.0)} and found.held == 0.5


@pytest.mark.parametrize("periods", [(), (2,), (1, 3, 2)])
def test_a_map_of_held_motions_comes_back_with_all_of_them(periods, tmp_path):
    system = bf.systems.impact_oscillator(omega=1.4)
    orbit, grid, rng = bf.find_orbit(system), bf.Grid(q0=(0.0, 1.0, 3), v0=(0.0, 1.0, 3)), np.random.default_rng(1)
    others = tuple(HeldMotion(rng.normal(size=(count, 2)), count) for count in periods)
    numbers = rng.integers(0, 4, (3, 3))
    made = FeedbackBasins(system, orbit, grid, "orbit", numbers - 1, numbers, numbers + 2, (orbit, *others), "a key")
    made.save(tmp_path / "a.npz")
    again = FeedbackBasins.load(tmp_path / "a.npz")
    assert [other.periods for other in again.attractors[1:]] == list(periods)
    for mine, other in zip(again.attractors[1:], others, strict=True):
        np.testing.assert_array_equal(mine.points, other.points)
    for name in ("labels", "states", "periods"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name))
    assert (again.system, again.grid, again.past, again.key) == (system, grid, "orbit", "a key")
    np.testing.assert_array_equal(again.orbit.unknowns, orbit.unknowns)
