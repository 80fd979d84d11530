"""Contacts along a motion in closed form, in an order of events that is kept beyond where it holds: touches and what is ignored."""
import numpy as np
import pytest

from bifurc import System
from bifurc.elements import ElasticStop, HarmonicForce, Jenkins
from bifurc.hbm.balance import Balance
from bifurc.hbm.layout import Layout
from bifurc.hbm.residual import TOUCH, kept, order_of
from bifurc.hbm.status import ContactStatus

OMEGA, STIFF, LIMIT, GAP, PHI = 0.8, 2.0, 0.7, 0.5, 0.6
LAYOUT = Layout((0, 1, 2), 1)


def balance_of(element, samples):
    return Balance(System(1.0, 0.0, 1.0, [HarmonicForce(1.0), element], omega=OMEGA), LAYOUT, samples)


def swing(a, mean=0.0):
    """Return mean + a cos(theta - PHI)."""
    return np.array([mean, a * np.cos(PHI), a * np.sin(PHI), 0.0, 0.0])


def force_of(balance, x, listed):
    """Return the coefficients of the contact's force along ``x`` and whether it has the events that are asked for."""
    listed = np.array([listed])
    status, f, _ = balance.linearised(x, listed=listed)
    assert status is ContactStatus.FOLLOWED
    w = LAYOUT.waves * OMEGA
    linear = (1.0 - w * w) * x - np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    return linear - f, bool(kept(listed, balance.room.sources, balance.room.counts)), order_of(balance.room)[0]


def coefficients(values, count):
    return LAYOUT.analysis(np.reshape(values, (count, 1)))


def slider(a, z):
    """Coefficients of -k (u - z(theta)), z behind the maximum and -z behind the minimum: a square wave along sin(theta - PHI)."""
    square = 4.0 / np.pi * STIFF * z
    return -STIFF * swing(a) + square * np.array([0.0, -np.sin(PHI), np.cos(PHI), 0.0, 0.0])


@pytest.mark.parametrize("samples", [0, 512])
@pytest.mark.parametrize("share", [0.98, 0.9])
def test_a_slider_that_hardly_sticks_touches_its_limits(samples, share):
    """Four events, two at each turn: memory is as slip would write it there, u -+ limit/k, also where it is not reached."""
    a = share * LIMIT / STIFF
    balance = balance_of(Jenkins(STIFF, LIMIT), samples)
    found, good, order = force_of(balance, swing(a), 4)
    assert good and order == 4
    z = a - LIMIT / STIFF
    np.testing.assert_allclose(found, slider(a, z), atol=2e-9 if not samples else 2e-2 * STIFF * abs(z))
    free, good, order = force_of(balance, swing(a), -1)
    assert good and order == 0
    np.testing.assert_allclose(free, -STIFF * swing(a), atol=1e-12)
    assert force_of(balance, swing(a), 0)[1]


@pytest.mark.parametrize("samples", [0, 512])
def test_an_order_is_not_kept_where_the_motion_is_far_from_it(samples):
    balance = balance_of(Jenkins(STIFF, LIMIT), samples)
    assert not force_of(balance, swing(0.2 * LIMIT / STIFF), 4)[1]
    stop = balance_of(ElasticStop(GAP, 5.0), samples)
    assert not force_of(stop, swing(0.3 * GAP), 2)[1] and not force_of(stop, swing(0.9 * GAP), 4)[1]


@pytest.mark.parametrize("samples", [0, 512])
@pytest.mark.parametrize("share", [0.999, 0.9, 0.5])
def test_a_stop_that_is_nearly_met_counts_as_touched(samples, share):
    """Two events at the maximum that exert no force; farther than half of the guard's size they are none."""
    stop = balance_of(ElasticStop(GAP, 5.0), samples)
    found, good, _ = force_of(stop, swing(share * GAP), 2)
    np.testing.assert_allclose(found, 0.0, atol=1e-13)
    height = (1.0 - share) / (1.0 + share)  # of a cos - gap over the size of its terms
    assert good == (height < TOUCH)
    assert not force_of(stop, swing(share * GAP), 4)[1]


@pytest.mark.parametrize("samples", [0, 512])
def test_events_that_are_too_many_are_ignored_from_the_least_on(samples):
    """Met by a little once and by more once: with two events the lower peak is passed through, with none both are."""
    x = np.array([0.0, 0.1, 0.0, 0.6, 0.0])  # .1 cos + .6 cos 2: .7 at 0 and .5 at pi
    turned = x.copy()
    turned[1:3], turned[3:] = 0.1 * np.array([np.cos(PHI), np.sin(PHI)]), 0.6 * np.array([np.cos(2 * PHI), np.sin(2 * PHI)])
    stop = balance_of(ElasticStop(0.48, 5.0), samples)
    count = samples or 8192
    theta = 2.0 * np.pi * np.arange(count) / count
    u = LAYOUT.values(turned, theta)[:, 0]
    whole = -5.0 * np.maximum(u - 0.48, 0.0)
    high = np.where(np.abs(np.mod(theta - PHI + np.pi, 2.0 * np.pi) - np.pi) < 1.0, whole, 0.0)
    for listed, want in ((-1, whole), (4, whole), (2, high), (0, 0.0 * whole)):
        found, good, order = force_of(stop, turned, listed)
        np.testing.assert_allclose(found, coefficients(want, count), atol=1e-12 if samples else 1e-6)
        assert good and order == (4 if listed < 0 else listed)


@pytest.mark.parametrize("samples", [0, 256])
def test_stays_of_a_slider_in_its_modes(samples):
    """Slip begins where the force reaches its limit behind each turn, and ends at the next turn."""
    a = 1.7 * LIMIT / STIFF
    balance = balance_of(Jenkins(STIFF, LIMIT), samples)
    names = balance.contacts[0].keys
    (stays,) = balance.segments(swing(a))
    away = np.arccos(1.0 - 2.0 * LIMIT / (STIFF * a))
    want = np.sort(np.mod(PHI + np.array([0.0, away, np.pi, np.pi + away]), 2.0 * np.pi))
    ends = np.array([stay.stop for stay in stays[:-1]])
    np.testing.assert_allclose(ends, want, atol=1e-12 if not samples else 2.0 * np.pi / samples)
    assert stays[0].start == 0.0 and stays[-1].stop == pytest.approx(2.0 * np.pi) and stays[-1].guard is None
    for stay, after in zip(stays, stays[1:], strict=False):
        assert stay.stop == after.start and stay.mode != after.mode and stay.guard is not None
    stick = names.index("stick")
    inside = [0.5 * (stay.start + stay.stop) for stay in stays if stay.mode == stick]
    for middle in inside:
        phase = np.mod(middle - PHI, np.pi)
        assert phase < away + 1e-9
    for stay in stays:
        if stay.mode == stick:
            assert abs(stay.memory[0]) == pytest.approx(a - LIMIT / STIFF, abs=1e-12 if not samples else 1e-2)


def test_a_slider_that_rests_where_it_slipped_last():
    """A mean beyond the limits of a virgin start: memory is u -+ limit/k of the farther turn; the order tells who wrote it."""
    a, mean = 0.3 * LIMIT / STIFF, 5.0 * LIMIT / STIFF
    balance = balance_of(Jenkins(STIFF, LIMIT), 0)
    x = swing(a, mean)
    found, good, order = force_of(balance, x, -1)
    assert good and order == 0  # memory of a virgin start is the mean
    np.testing.assert_allclose(found[0], 0.0, atol=1e-13)
    np.testing.assert_allclose(found[1:], -STIFF * x[1:], atol=1e-12)


def test_derivatives_where_an_order_is_kept(rng):
    """Of the forces of touches, against differences."""
    balance = balance_of(Jenkins(STIFF, LIMIT), 0)
    x = swing(0.9 * LIMIT / STIFF) + 1e-3 * rng.standard_normal(5)
    listed = np.array([4])
    status, _, wide = balance.linearised(x, listed=listed)
    wide = wide.copy()
    assert status is ContactStatus.FOLLOWED and kept(listed, balance.room.sources, balance.room.counts)

    def residual(y):
        return balance.linearised(y, listed=listed)[1].copy()
    h = 1e-6
    slopes = np.array([(residual(x + h * e) - residual(x - h * e)) / (2.0 * h) for e in np.eye(5)]).T
    np.testing.assert_allclose(wide[:, :-1], slopes, atol=2e-4)
