"""Attractors without a clock on oscillators in closed form: where they pass a section, and on what they settle."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors import attractors, clockless
from bifurc.ensemble.section import Section


def oscillator(zeta=0.0, stiffness=1.0):
    return bf.System(1.0, 2.0 * zeta, stiffness, [])


@pytest.mark.parametrize("section, states", [
    (Section("q0", 0.0, 1), [(0.0, 1.0)]), (Section("q0", 0.0, -1), [(0.0, -1.0)]),
    (Section("q0", 0.0, 0), [(0.0, 1.0), (0.0, -1.0)]),  # in the order of time: half a period after the state, it rises first
    (Section("v0", 0.0, -1), [(1.0, 0.0)]), (Section("q0", 0.5, 1), [(0.5, 0.75**0.5)]),
    (Section("v0", 0.5, 0), [(-0.75**0.5, 0.5), (0.75**0.5, 0.5)])])
def test_an_orbit_passes_its_section_once_a_period(section, states):
    """q = cos t, from its maximum on; of 1.75 periods those behind the first half period count, up to one and a half."""
    orbit = SimpleNamespace(system=oscillator(), state=np.array([1.0, 0.0]), period=2.0 * math.pi)
    np.testing.assert_allclose(clockless.section_of(orbit, section), states, atol=1e-12)
    twice = SimpleNamespace(system=orbit.system, state=orbit.state, period=4.0 * math.pi)
    assert len(clockless.section_of(twice, section)) == 2 * len(states)
    with pytest.raises(ValueError, match="Section.* is not passed by .*; choose a section that all motions of interest pass"):
        clockless.section_of(orbit, Section("q0", 1.5))


@pytest.mark.parametrize("count", [5, 240, 300])
def test_states_in_a_section_go_on_from_motion_to_motion(count):
    """A damped oscillator from its maximum: every return is smaller by the same factor, across the end of each motion."""
    zeta = 1e-3
    wd = math.sqrt(1.0 - zeta**2)
    found = clockless.crossings_from(oscillator(zeta), np.array([1.0, 0.0]), Section("q0", 0.0, 1), count)
    times = (1.5 * math.pi + math.asin(zeta) + 2.0 * math.pi * np.arange(count)) / wd  # q ~ exp(-zeta t) cos(wd t - asin zeta)
    assert found.shape == (count, 2)
    np.testing.assert_allclose(found[:, 0], 0.0, atol=1e-10)
    np.testing.assert_allclose(found[:, 1], np.exp(-zeta * times), rtol=1e-8)


def test_a_section_that_is_met_no_more_and_a_motion_that_fails():
    assert clockless.crossings_from(oscillator(0.1), np.array([1.0, 0.0]), Section("q0", 5.0), 3) is None
    assert clockless.crossings_from(oscillator(0.1, -1.0), np.array([1.0, 0.0]), Section("q0", 0.0), 3) is None  # diverges
    shrinking = clockless.crossings_from(oscillator(0.1), np.array([1.0, 0.0]), Section("q0", 0.3), 50)
    assert shrinking is None  # two or three passes, and then below it


def test_motions_settle_on_rest_on_a_cycle_or_on_nothing():
    found, y = clockless.settles_on(oscillator(0.2), np.array([1.0, 0.0]), np.ones(2))
    assert found.state == pytest.approx([0.0, 0.0], abs=1e-12) and np.abs(y).max() < 0.03
    ends = clockless.settles_on(oscillator(), np.array([1.0, 0.0]), np.ones(2))
    turns = clockless.TURNS * clockless.ATTEMPTS  # as many periods: it comes back to where it began
    assert ends[0] is None and ends[1] == pytest.approx([1.0, 0.0], abs=1e-9 * turns)
    assert clockless.settles_on(oscillator(0.0, -1.0), np.array([1.0, 0.0]), np.ones(2)) == (None, None)
    belt = bf.systems.belt_oscillator()
    cycle, y = clockless.settles_on(belt, np.array([-0.5, 0.3]), np.ones(2))
    assert cycle.success and cycle.stable and cycle.period == pytest.approx(bf.find_orbit(belt).period, rel=1e-9)
    states = cycle.sample(4000)[1]
    assert np.linalg.norm(states - y, axis=1).min() < 0.03


def test_the_exponent_of_an_oscillator_is_its_damping():
    value, error, span = clockless.exponent_of(oscillator(0.03), np.array([1.0, 0.0]))
    assert value == pytest.approx(-0.03, abs=1e-4) and 0.0 <= error < 1e-3
    assert span == pytest.approx(clockless.EXPONENT_TURNS * 2.0 * math.pi, rel=0.01)


# what tells a torus


@pytest.mark.parametrize("period, place", [(2.5, 1), (None, 2)])
def test_a_torus_attracts_where_the_first_exponent_across_it_is_clearly_negative(period, place, monkeypatch):
    system = SimpleNamespace(period=period)
    unit = period or 4.0
    limit = -attractors.FOLDS / (attractors.LAW_PERIODS * unit)
    values = [0.0, 0.0, -9.0, -9.0]
    monkeypatch.setattr(attractors, "lyapunov_exponents", lambda system, y, periods, transient: SimpleNamespace(values=values))
    monkeypatch.setattr(attractors, "scene_of", lambda system: None)
    monkeypatch.setattr(attractors, "slowest", lambda scene: 4.0)
    for factor, answer in ((1.01, True), (0.99, False), (-5.0, False), (0.0, False)):
        values[place] = factor * limit
        assert attractors.attracts(system, None) is answer
    values[:] = [0.0] * place
    assert attractors.attracts(system, None) is False  # no direction is left


def test_members_of_a_family_that_rests_lie_so_near_that_none_is_missed(monkeypatch):
    def orbit(**more):
        return SimpleNamespace(**{"system": SimpleNamespace(n=1), "family": (0,), "intervals": {0: (-0.2, 0.3)},
                                  "scene": SimpleNamespace(closed_form=True)} | more)
    monkeypatch.setattr(attractors, "line_of_members", lambda orbit, values: np.column_stack([values, 0.0 * values]))
    scale, points = np.array([2.0, 5.0]), np.array([[0.1, 0.0]])
    found = attractors.resting(orbit(), points, 0.01, scale)
    assert found[0].tolist() == [-0.2, 0.0] and found[-1].tolist() == [0.3, 0.0] and not found[:, 1].any()
    steps = np.diff(found[:, 0])
    assert len(found) == 26 and steps == pytest.approx(0.02) and steps.max() <= 0.01 * 2.0 * (1.0 + 1e-12)
    for other, given in ((orbit(family=()), points), (orbit(family=(1,)), points), (orbit(intervals={}), points),
                         (orbit(scene=SimpleNamespace(closed_form=False)), points), (orbit(), np.repeat(points, 2, axis=0)),
                         (orbit(intervals={0: (0.3, 0.3)}), points), (orbit(intervals={0: (0.0, math.inf)}), points)):
        assert attractors.resting(other, given, 0.01, scale) is given
