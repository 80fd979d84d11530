"""Accuracy and missed grazing humps: the certified march misses none, integrators do."""
import numpy as np
import pytest

from studies import what_accuracy_costs as study
from studies.common import Setting
from studies.reference import Oscillator, mp


@pytest.fixture(scope="module")
def rows():
    """Return the rows of the small setting by method and tolerance."""
    return {(row.method, row.tolerance): row for row in study.costs(Setting.SMALL)}


def test_exact_engine(rows):
    """Ten periods with about ten impacts: 1e-12."""
    row = rows["exact engine", None]
    assert row.wrong == 0 and row.event_error <= 1e-12 and row.state_error <= 1e-12


def test_smooth_engine(rows):
    """The same oscillator under a law: integrated, not closed form."""
    row = rows["smooth engine", None]
    assert row.wrong == 0 and row.event_error <= 1e-10 and row.state_error <= 1e-10


def test_integrator_loses_an_impact(rows):
    """DOP853 at 1e-6 steps over an impact and is wrong by a third; at 1e-10 it is right."""
    assert rows["scipy DOP853", 1e-6].wrong == 1 and rows["scipy DOP853", 1e-6].state_error > 0.1
    assert rows["scipy DOP853", 1e-10].wrong == 0 and rows["scipy DOP853", 1e-10].state_error < 1e-7


def test_humps():
    """None missed by the certified march; nearly all of the shallow ones by every integrator."""
    found = study.humps(Setting.SMALL)
    assert all(row.missed == 0 for row in found if row.method == "exact engine")
    shallow = [row for row in found if row.method != "exact engine" and row.depth < 2e-6]
    assert all(row.missed > row.flights // 2 for row in shallow)
    assert "exact engine" in study.report([], found)


@pytest.mark.parametrize("depth", [1e-2, 1e-5, 1e-8])
def test_flights_pass_the_stop_once(depth, rng):
    """Place, depth and time of the hump are what they are said to be, in 34 digits."""
    starts, lengths, before = study.flights(6, depth, rng)
    exact = Oscillator(**study.HUMPS)
    assert np.all(before < lengths)
    for start, length, apex in zip(starts, lengths, before, strict=True):
        with mp.workdps(34):
            top, speed = exact.fly(*map(mp.mpf, start), mp.mpf(start[0]) + mp.mpf(apex))
            assert abs(top - 1 - depth) < 1e-13 and abs(speed) < 1e-13
            hit = exact.hit(*map(mp.mpf, start), mp.mpf(start[0] + length))
        assert hit is not None and 0.0 < start[0] + apex - hit[0] < 3.0 * np.sqrt(depth / 0.1)


def test_reference_against_the_closed_release():
    """A mass that comes to rest on the stop is let go when the load falls to the spring force."""
    exact = Oscillator(zeta=0.05, omega=0.2, amplitude=1.0, gap=0.0, restitution=0.3)
    q, v, impacts = exact.march(-0.5, 1.0, 0, exact.period * 0.2)
    assert (q, v) == (0, 0) and len(impacts) > 10
    ratios = [b[1] / a[1] for a, b in zip(impacts[-8:-1], impacts[-7:], strict=True)]
    assert max(abs(ratio - 0.3) for ratio in ratios) < 1e-5
    q, v, _ = exact.march(-0.5, 1.0, 0, exact.period * 0.26)  # released at a quarter of the period
    free = exact.fly(exact.period / 4, mp.mpf(0), mp.mpf(0), mp.mpf(float(exact.period * 0.26)))
    assert abs(q - free[0]) < 1e-15 and abs(v - free[1]) < 1e-14 and q < 0
