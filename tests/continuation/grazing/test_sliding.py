"""Sliding bifurcations named at onsets of stick and slip."""
import pytest

import bifurc as bf
from bifurc.continuation.grazing import SlidingClass
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


def test_other_points_have_no_sliding_class():
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 0.7))
    assert all(point.sliding is None for point in branch.special_points)
