"""Rules of searches on stand-ins: middles of intervals, time to settle, halves of symmetric motions, what a solution says."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.flow.scan import CHATTER
from bifurc.hbm.setvalued.equations import SetValuedStatus
from bifurc.orbits import autonomous, forced, repetition
from bifurc.orbits.balance import setvalued
from bifurc.orbits.orbit import OrbitStatus


@pytest.mark.parametrize("times, span", [([0.1, 0.4, 0.9], 1.0), ([0.7], 2.0), ([-0.2, 0.3], 1.0)])
def test_middles_lie_half_way_to_the_next_event_round_the_period(times, span):
    times = np.array(times)
    unknowns = np.column_stack([times, np.full(len(times), 7.0), np.full(len(times), 9.0)]).ravel()
    whole = SimpleNamespace(nodes=np.zeros((len(times), 5), int), span=span)
    at, spans = repetition.middles(SimpleNamespace(_whole=(whole, unknowns)))
    assert spans.sum() == pytest.approx(span) and (spans > 0.0).all()
    np.testing.assert_allclose(at, times + 0.5 * spans)
    following = np.append(times[1:], times[0] + span)
    np.testing.assert_allclose(at, 0.5 * (times + following))


def test_moments_within_the_rest_of_a_chattering_are_told():
    rows = np.zeros((3, 5), int)
    rows[1, repetition.KIND], rows[2, repetition.KIND] = CHATTER, CHATTER
    rows[:, repetition.PERIODS] = [0, 1, 2]
    R = SimpleNamespace(rows=rows, times=np.array([0.0, 0.5, 0.25]), spans=np.array([0.0, 0.25, 0.5]))
    moments = np.array([1.9, 2.5, 2.7, 2.8, 4.2, 4.25, 4.6, 4.75])
    found = repetition.closed(SimpleNamespace(recorded=R), moments, 2.0)
    assert found.tolist() == [False, True, True, False, False, True, True, False]


# settling without a clock

class Motion:
    def __init__(self, duration, final):
        self.duration, self.final, self.success = duration, final, True


@pytest.fixture
def settling(monkeypatch):
    asked, answers = [], {"returns": lambda k: [1, 2], "orbits": lambda k: [], "rest": lambda k: False}

    def simulate(system, y, duration, max_events):
        asked.append((y, duration))
        return Motion(duration, y + 1)
    monkeypatch.setattr(autonomous, "scene_of", lambda system: None)
    monkeypatch.setattr(autonomous, "slowest", lambda scene: 2.0)
    monkeypatch.setattr(autonomous, "simulate", simulate)
    monkeypatch.setattr(autonomous, "returns", lambda motion, early: answers["returns"](len(asked)))
    monkeypatch.setattr(autonomous, "from_motion", lambda system, again, period, early: answers["orbits"](len(asked)))
    monkeypatch.setattr(autonomous, "dies_out", lambda motion: answers["rest"](len(asked)))
    monkeypatch.setattr(autonomous, "at_rest", lambda motion, first: False)
    monkeypatch.setattr(autonomous, "nothing", lambda motion, status: (motion.final, status))
    monkeypatch.setattr(autonomous, "failed", lambda motion, y: "failed")
    monkeypatch.setattr(autonomous, "distance_to", lambda orbit, y: orbit.away)
    return asked, answers


def found(away, success=True, stable=True):
    return SimpleNamespace(away=away, success=success, stable=stable, how={})


def test_the_orbit_is_that_to_which_the_motion_has_come_close(settling):
    asked, answers = settling
    near = found(0.0)
    answers["orbits"] = lambda k: [found(0.0, success=False), found(0.0, stable=False), near if k == 3 else found(9.0)]
    chunk = autonomous.CHUNK
    assert autonomous.settled(None, 100 * chunk, 0.0) is near
    assert [y for y, _ in asked] == [0.0, 1.0, 2.0] and all(duration == 2.0 * chunk for _, duration in asked)
    assert near.how == {"transient": 3 * chunk * 2.0}


def test_a_motion_that_hardly_comes_back_is_given_more_and_more_time(settling):
    asked, answers = settling
    answers["returns"] = lambda k: [1]
    autonomous.settled(None, 1, 0.0)
    chunks = [duration / 2.0 for _, duration in asked]
    assert chunks == [autonomous.CHUNK * 2**k for k in range(len(chunks))] and chunks[-1] <= autonomous.LONGEST < 2 * chunks[-1]


def test_a_motion_that_dies_out_is_at_rest_and_a_far_orbit_is_noted(settling):
    asked, answers = settling
    answers["rest"] = lambda k: k == 2
    assert autonomous.settled(None, 100 * autonomous.CHUNK, 0.0) == (2.0, OrbitStatus.AT_REST)
    answers["rest"] = lambda k: False
    far = found(9.0)
    answers["orbits"] = lambda k: [far]
    best = autonomous.settled(None, 1, 0.0)
    assert best is far and "not yet come close" in far.how["note"]


# symmetric motions

@pytest.mark.parametrize("symmetry, periods, good, halved, want", [
    (-1, 1, False, True, "half"), (-1, 1, True, True, "whole"), (0, 1, False, True, "whole"), (-1, 2, False, True, "whole"),
    (-1, 1, False, False, "whole"), (-1, 3, False, True, "half")])
def test_half_a_symmetric_motion_is_tried_where_the_whole_is_not_found(symmetry, periods, good, halved, want, monkeypatch):
    signature = SimpleNamespace(nodes=np.array([[0, 1, 0, 0, 0]]), creeping=lambda scene: [])
    half = SimpleNamespace(nodes=signature.nodes)
    monkeypatch.setattr(forced, "scene_of", lambda system: None)
    monkeypatch.setattr(forced, "read_motion", lambda scene, motion, first, n: (signature, np.zeros(3), np.ones(2)))
    monkeypatch.setattr(forced, "half_of", lambda scene, s, u: (half, np.zeros((1, 3))) if halved else None)
    monkeypatch.setattr(forced, "solve", lambda system, s, u, w, how: SimpleNamespace(
        success=good if s is signature else True, of="whole" if s is signature else "half"))
    assert forced.from_motion(SimpleNamespace(symmetry=symmetry), None, 0, periods).of == want
    sections = SimpleNamespace(nodes=np.array([[0, -1, 0, 0, 0]]))
    monkeypatch.setattr(forced, "read_motion", lambda scene, motion, first, n: (sections, np.zeros(3), np.ones(2)))
    monkeypatch.setattr(forced, "solve", lambda system, s, u, w, how: SimpleNamespace(success=False, of="whole"))
    assert forced.from_motion(SimpleNamespace(symmetry=symmetry), None, 0, periods).of == "whole"


def test_sizes_of_states_are_a_length_and_its_rate():
    scene = SimpleNamespace(n=2, ns=5, omega=4.0)
    states = np.array([[1.0, -2.0, 0.5, 3.0, 7.0], [0.5, 0.0, 0.0, -6.0, 7.0]])
    assert forced.sizes_of(scene, states).tolist() == [2.0, 2.0, 8.0, 8.0, 2.0]
    states[1, 3] = -12.0
    assert forced.sizes_of(scene, states).tolist() == [3.0, 3.0, 12.0, 12.0, 3.0]
    assert forced.sizes_of(scene, np.zeros((1, 5))).tolist() == [1.0, 1.0, 4.0, 4.0, 1.0]


# set-valued balances

@pytest.mark.parametrize("status", [SetValuedStatus.HELD, SetValuedStatus.CONVERGED, SetValuedStatus.RESTS])
@pytest.mark.parametrize("wide", [0.0, 0.1])
def test_a_solution_says_its_error_its_reversals_and_what_is_held(status, wide, monkeypatch):
    monkeypatch.setattr(setvalued, "estimated_error", lambda *a: (np.array([0.5, 0.1]), np.array([0.2, np.nan])))
    monkeypatch.setattr(setvalued, "from_twice", lambda *a: np.array([0.3, 0.4]))
    balance = SimpleNamespace(layout=SimpleNamespace(harmonics=(1, 3), periods=2), numbers=SimpleNamespace(
        E=np.array([[0.0, -2.0]]), omega=np.array([4.0])))
    contacts = [SimpleNamespace(limit=0.5, label="a"), SimpleNamespace(limit=0.0, label="gone")]
    result = SimpleNamespace(status=status, iterations=3, evaluations=5, residual=1e-8, widths=np.array([wide]), x=None,
                             patterns=[SimpleNamespace(instants=[1.0, 3.0])])
    how = setvalued.reported(balance, contacts, None, result, SimpleNamespace(solver="newton"))
    assert how["residual"] == 0.5e-8 and how["harmonics"] == [0.5, 1.5] and how["statement"] == status.sentence
    assert how["error of the first harmonic"] is None and (how["iterations"], how["evaluations"]) == (3, 5)
    if status is SetValuedStatus.RESTS:
        assert how["error"] == [0.5, 0.1] and "reversals" not in how
        return
    assert how["error"] == ([0.5, 0.4] if wide else [0.3, 0.4])
    assert how["reversals"] == {"a": [0.25, 0.75]} and how.get("held contacts") == (["a"] if wide else None)
    assert how.get("held") == (True if status is SetValuedStatus.HELD else None)
