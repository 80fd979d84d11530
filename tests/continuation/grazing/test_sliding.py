"""Sliding bifurcations named at onsets of stick and slip."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.continuation.grazing import SlidingClass, sliding
from bifurc.continuation.shooting.completion import begun_at
from bifurc.elements import Coulomb, HarmonicForce
from tests.reference.coulomb import SlipOnly, interior_limit


def points(parameter, bounds, guess=(0.0, 0.0), **parameters):
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(**parameters), guess)
    return bf.trace(orbit, parameter, bounds=bounds).special_points


@pytest.mark.parametrize("side", [0.9, 1.1], ids=["stick dies", "stick is born"])
def test_stick_in_the_reversal_is_crossing_sliding(side):
    """Den Hartog's boundary: the mass stops for a moment where it turns round."""
    want = float(SlipOnly(0.8, 0.1, 100.0).alpha_stick)
    found = points("amplitude", (0.8 * want, 1.2 * want), omega=0.8, zeta=0.1, amplitude=side * want)
    point = min(found, key=lambda p: abs(p.parameter - want))
    assert point.parameter == pytest.approx(want, rel=1e-12) and point.sliding is SlidingClass.CROSSING


@pytest.mark.parametrize("start", [8.0, 11.0], ids=["stick dies", "stick is born"])
def test_stick_inside_the_half_cycle_is_grazing_sliding(start):
    """The speed touches zero while the mass goes on in its direction."""
    want = float(interior_limit(0.4, 0.1))
    found = points("amplitude", (0.85 * want, 1.25 * want), omega=0.4, zeta=0.1, amplitude=start / 9.25 * want)
    point = max(found.of("stick_onset"), key=lambda p: p.parameter)
    assert point.parameter == pytest.approx(want, abs=1e-11) and point.sliding is SlidingClass.GRAZING


def test_sticks_that_join_are_adding_sliding():
    found = points("omega", (0.1, 0.6), omega=0.5, amplitude=2.0)
    assert [p.sliding for p in found.of("slip_onset")] == [SlidingClass.ADDING] * 2
    assert all(kind.sentence for kind in SlidingClass)


@pytest.mark.parametrize(("omega", "low", "high", "wanted"), [
    (0.8, 1.4, 1.7, SlidingClass.CROSSING), (0.4, 8.5, 10.0, SlidingClass.GRAZING)])
def test_the_class_does_not_depend_on_where_the_half_period_begins(omega, low, high, wanted):
    """Listed from any event on: what comes before the first is the mirror image of the last."""
    listed = [point for point in points("amplitude", (low, high), omega=omega, zeta=0.1, amplitude=low) if point.name == "listed"]
    assert {point.sliding for point in listed} == {wanted}
    for point in listed:
        assert point.problem.sequence.closure == -1
        for first in range(len(point.problem.sequence.nodes)):
            problem, x = begun_at(point.problem, point.x, first)
            assert sliding._of_vanishing(problem, x) is point.sliding


@pytest.mark.parametrize("side", [0.97, 1.03], ids=["slip is born", "slip dies"])
def test_a_slip_before_the_stick_is_switching_sliding(side):
    """The mass stops where the force has just come back to its limit from the other side; the landing by scipy's DOP853."""
    omega, first, second, phase, name = 0.6242, 1.5419, 2.1007, 1.4105, "harmonic_force_2.amplitude"
    loads = (HarmonicForce(first), HarmonicForce(side * second, harmonic=3, phase=phase))
    branch = bf.trace(bf.find_orbit(bf.System(1.0, 0.2, 1.0, (*loads, Coulomb(1.0)), omega=omega)), name,
                      bounds=(0.95 * second, 1.05 * second))
    (point,) = branch.special_points
    assert point.kind == "slip_onset" and point.sliding is SlidingClass.SWITCHING

    def load(t):
        return first * np.cos(omega * t) + point.parameter * np.cos(3.0 * omega * t + phase)
    release = next(event for event in point.solution.events if event.kind == "slip")
    t, y = release.time, np.array([release.after[0], 0.0])
    while True:  # slides, which may turn round, until the force is within its limits
        sign = np.sign(load(t) - y[0])

        def speed(t, y):
            return y[1]
        speed.terminal, speed.direction = True, -sign
        slide = solve_ivp(lambda t, y, sign=sign: (y[1], load(t) - y[0] - 0.2 * y[1] - sign), (t, t + 10.0),
                          y + np.array([0.0, 1e-300 * sign]), method="DOP853", rtol=1e-12, atol=1e-13, events=speed)
        t, y = slide.t[-1], np.array([slide.y[0, -1], 0.0])
        if abs(load(t) - y[0]) < 1.0 + 1e-6:
            break
    assert sign * (load(t) - y[0]) == pytest.approx(-1.0, abs=1e-9)


def test_other_points_have_no_sliding_class():
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 0.7))
    assert all(point.sliding is None for point in branch.special_points)
