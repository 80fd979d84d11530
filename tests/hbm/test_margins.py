"""Margins of events along a given motion, against maxima of the guards written out, and the correctors that report them."""
import numpy as np
import pytest

from bifurc import System
from bifurc.elements import ElasticStop, EventKind, HarmonicForce, Iwan, Jenkins
from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts.margins import COUNT, FAR, FIELDS, KINDS, MISS, OVERSHOOT
from bifurc.hbm.corrector import watched
from bifurc.hbm.layout import Layout
from bifurc.hbm.status import ContactStatus

CONTACT, SEPARATION, STICK, SLIP = (k.code for k in (EventKind.CONTACT, EventKind.SEPARATION, EventKind.STICK, EventKind.SLIP))


def margins(element, x, harmonics, samples=0, omega=1.0, listed=None):
    """Number, least overshoot and largest miss of each kind of event of one element along the motion ``x`` of one coordinate."""
    system = System(1.0, 0.1, 1.0, (HarmonicForce(1.0), element), omega=omega)
    balance = Balance(system, Layout(tuple(range(harmonics + 1)), 1), samples)
    x, parts = np.asarray(x, float), balance.parts
    status, _, _ = balance.linearised(x, listed=listed)
    assert status is ContactStatus.FOLLOWED
    events = np.full((KINDS, FIELDS), np.nan)
    watched(parts.structure, parts.flat, balance.grid, balance.room, events)
    return events


def none_but(events, *kinds):
    """Assert that no other kind of event was seen."""
    for k in set(range(KINDS)) - set(kinds):
        assert tuple(events[k]) == (0.0, FAR, -FAR)


@pytest.mark.parametrize("samples", [0, 4096])
@pytest.mark.parametrize("phase", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("side", [1, -1])
def test_a_stop_met_by_one_wave(phase, side, samples):
    wave = np.array([0.0, np.cos(phase), np.sin(phase)])
    near = 1e-12 if samples == 0 else 1e-6
    events = margins(ElasticStop(0.7, 3.0, side=side), 0.9 * wave, 1, samples)
    none_but(events, CONTACT, SEPARATION)
    assert events[CONTACT, COUNT] == events[SEPARATION, COUNT] == 1.0
    assert events[CONTACT, OVERSHOOT] == pytest.approx((0.9 - 0.7) / (0.9 + 0.7), abs=near)
    assert events[SEPARATION, OVERSHOOT] == pytest.approx(1.0, abs=near)  # it swings back as far as it can
    assert events[CONTACT, MISS] == events[SEPARATION, MISS] == -FAR  # there are no other maxima
    missed = margins(ElasticStop(0.7, 3.0, side=side), 0.6 * wave, 1, samples)
    none_but(missed, CONTACT)
    assert tuple(missed[CONTACT, [COUNT, OVERSHOOT]]) == (0.0, FAR)
    assert missed[CONTACT, MISS] == pytest.approx((0.6 - 0.7) / (0.6 + 0.7), abs=near)


def maxima(theta, g):
    """Indices of the maxima of a periodic signal."""
    return np.flatnonzero((g > np.roll(g, 1)) & (g >= np.roll(g, -1)))


@pytest.mark.parametrize("samples", [0, 8192])
@pytest.mark.parametrize("seed", range(8))
def test_a_stop_met_by_any_motion(seed, samples):
    rng = np.random.default_rng(seed)
    H = 5
    x = rng.standard_normal(2 * H + 1) / np.repeat(np.arange(H + 1) + 1.0, 2)[1:]
    theta = np.linspace(0.0, 2.0 * np.pi, 20001)[:-1]
    k = np.arange(1, H + 1)[:, None]
    u = x[0] + x[1::2] @ np.cos(k * theta) + x[2::2] @ np.sin(k * theta)
    gap = float(np.quantile(u, 0.75))
    size = abs(x[0] - gap) + np.hypot(x[1::2], x[2::2]).sum()
    events = margins(ElasticStop(gap, 2.0), x, H, samples, omega=1.7)
    none_but(events, CONTACT, SEPARATION)
    for kind, g in ((CONTACT, u - gap), (SEPARATION, gap - u)):
        g = g / size
        tops, up = maxima(theta, g), np.flatnonzero((g <= 0.0) & (np.roll(g, -1) > 0.0))
        first = [tops[np.argmin((tops - i) % g.size)] for i in up]  # behind each time that it passes zero
        assert events[kind, COUNT] == len(up) > 0
        assert events[kind, OVERSHOOT] == pytest.approx(g[first].min(), abs=1e-5)
        low = g[tops][g[tops] < 0.0]
        assert events[kind, MISS] == pytest.approx(low.max() if low.size else -FAR, abs=1e-5)


@pytest.mark.parametrize("phase", [0.3, 2.0, 4.0])
def test_a_slider_that_slips_and_one_that_nearly_does(phase):
    limit, kt, A = 0.4, 2.0, 1.0
    wave = np.array([0.0, np.cos(phase), np.sin(phase)])
    d = limit / kt
    events = margins(Jenkins(kt, limit), A * wave, 1)
    none_but(events, STICK, SLIP)
    assert events[SLIP, COUNT] == events[STICK, COUNT] == 2.0  # each a period
    # stuck from a reversal on, the force would rise to kt (2 A - d): by 2 (A - d) more than the limit
    assert events[SLIP, OVERSHOOT] == pytest.approx(2.0 * (A - d) / (A + abs(A - 2.0 * d)), abs=1e-9)
    assert events[STICK, OVERSHOOT] == pytest.approx(1.0, abs=1e-9)  # the speed turns round and grows
    held = margins(Jenkins(kt, limit), 0.9 * d * wave, 1)
    none_but(held, SLIP)
    assert held[SLIP, COUNT] == 0.0 and held[SLIP, MISS] == pytest.approx((0.9 - 1.0) / (0.9 + 1.0), abs=1e-12)


@pytest.mark.parametrize("share", [0.9, 0.65])
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("phase", [1.1, 4.0])
def test_a_slider_at_rest_where_it_slipped_would_have_slipped_from_a_virgin_start(share, way, phase):
    """u = a (cos + .4 cos 2): 1.4 a off the mean, where it slips once and never back; the margin is that of the virgin memory."""
    limit, kt, mean = 0.4, 2.0, 0.3
    a, d = way * share * limit / kt, limit / kt
    x = [mean, a * np.cos(phase), a * np.sin(phase), 0.4 * a * np.cos(2.0 * phase), 0.4 * a * np.sin(2.0 * phase)]
    wrote = 1 if way > 0.0 else 2  # slip forwards, backwards
    events = margins(Jenkins(kt, limit), x, 2, listed=np.array([-2 - wrote]))
    none_but(events, SLIP)
    assert events[SLIP, COUNT] == 0.0
    assert events[SLIP, OVERSHOOT] == pytest.approx((1.4 * abs(a) - d) / (1.4 * abs(a) + d), abs=1e-12)
    back, z = 0.7125 * abs(a), 1.4 * abs(a) - d  # the other turn, and memory, both measured from the mean
    assert events[SLIP, MISS] == pytest.approx((back + z - d) / (1.4 * abs(a) + abs(z - d)), abs=1e-12)


@pytest.mark.parametrize("phase", [0.3, 2.0])
def test_sliders_of_a_set_have_margins_of_their_own(phase):
    """Limits at displacements of .2 and .3: one slips a period or both do, each twice; what turns round turns together."""
    wave = np.array([0.0, np.cos(phase), np.sin(phase)])
    d1, d2 = 0.2, 0.3
    iwan = Iwan(stiffnesses=(1.0, 2.0), limits=(d1, 2.0 * d2))
    A = 0.5
    both = margins(iwan, A * wave, 1)
    none_but(both, STICK, SLIP)
    assert both[SLIP, COUNT] == 4.0 and both[STICK, COUNT] == 2.0
    assert both[SLIP, OVERSHOOT] == pytest.approx(2.0 * (A - d2) / (A + abs(A - 2.0 * d2)), abs=1e-9)
    A = 0.25
    one = margins(iwan, A * wave, 1)
    none_but(one, STICK, SLIP)
    assert one[SLIP, COUNT] == 2.0 and one[STICK, COUNT] == 2.0
    assert one[SLIP, OVERSHOOT] == pytest.approx(2.0 * (A - d1) / (A + abs(A - 2.0 * d1)), abs=1e-9)
    assert one[SLIP, MISS] == pytest.approx((A - d2) / (A + d2), abs=1e-9)  # the second, from its virgin state
    none = margins(iwan, 0.15 * wave, 1)
    none_but(none, SLIP)
    assert none[SLIP, COUNT] == 0.0 and none[SLIP, MISS] == pytest.approx((0.15 - d1) / (0.15 + d1), abs=1e-12)
