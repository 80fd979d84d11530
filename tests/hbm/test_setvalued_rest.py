"""Rest under set-valued friction: what bounds leave of a force, and motions that are tied at their contacts, by elimination."""
import numpy as np
import pytest

from bifurc.hbm.layout import Layout
from bifurc.hbm.setvalued.equations import Balance, Contact, Linear, SetValuedStatus
from bifurc.hbm.setvalued.full_stick import _tied, allowance, at_rest

M = np.array([[1.0, 0.2, 0.0], [0.2, 2.0, -0.3], [0.0, -0.3, 1.5]])
C = np.array([[0.3, -0.1, 0.0], [0.05, 0.2, 0.0], [0.0, 0.1, 0.4]])
K = np.array([[3.0, -1.0, 0.0], [-1.0, 4.0, -2.0], [0.0, -2.0, 6.0]])
OMEGA = 1.1


def constant(value):
    return np.array([complex(value)])


def test_how_far_a_force_may_be_shifted_inside_its_bounds():
    """r = .2 + .5 cos 2t: between -.3 and .7; bounds of -1 and 2, or 2 - .6 cos 2t, which is lowest where r is highest."""
    layout = Layout((0, 1, 2, 3), 1)
    force, row = np.zeros(7), np.array([1.0])
    force[0], force[3] = 0.2, 0.5
    low, high = allowance(layout, force, Contact(row, constant(2.0), constant(-1.0)))
    assert (low, high) == pytest.approx((-0.7, 1.3), abs=1e-12)
    low, high = allowance(layout, force, Contact(row, np.array([2.0, 0.0, -0.6 + 0j]), constant(-1.0)))
    assert (low, high) == pytest.approx((-0.7, 2.0 - 0.6 - 0.7), abs=1e-12)
    force[3], force[4] = 0.0, -0.5  # sines: the same a quarter of a wave later
    assert allowance(layout, force, Contact(row, constant(2.0), constant(-1.0))) == pytest.approx((-0.7, 1.3), abs=1e-3)
    for part, left in ((0.6j, 0.1), (-0.6j, 1.1)):  # of -.6 and .6 sin 2t
        _, high = allowance(layout, force, Contact(row, np.array([2.0, 0.0, part]), constant(-1.0)))
        assert high == pytest.approx(2.0 - 0.2 - left, abs=1e-3)
    low, high = allowance(layout, force, Contact(row, constant(0.3), constant(-0.3)))
    assert low > high  # it does not fit
    low, high = allowance(layout, 0.0 * force, Contact(row, constant(-0.1), constant(0.1)))
    assert low == high == 0.0  # apart all the time: no force, no freedom
    odd = Layout((1, 3), 1)
    assert allowance(odd, np.array([0.5, 0.0, 0.0, 0.0]), Contact(row, constant(2.0), constant(-1.0))) == pytest.approx((-0.5, 1.5))


@pytest.mark.parametrize("harmonics", [(0, 1, 2, 3), (1, 3)])
def test_tied_motions_are_those_of_the_masses_that_are_left(harmonics, rng):
    """Two contacts on three masses leave one coordinate, which is eliminated by hand; multipliers are the reactions."""
    layout, rows = Layout(harmonics, 3), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -1.0]])
    load = rng.normal(size=layout.size)
    rest, lam = Linear.of(layout, OMEGA, M, C, K, load), np.zeros((layout.slots, 2))
    if layout.mean:
        lam[0] = 0.3, -0.2
    x, found = _tied(layout, rest, rows, lam)
    x, packed, first = layout.matrix(x), layout.matrix(load), int(layout.mean)
    assert found.shape == (layout.slots - first, 2)
    free = np.array([0.0, 1.0, 1.0])  # the second and third mass move together
    for i, k in enumerate(k for k in harmonics if k):
        a, b = first + 2 * i, first + 2 * i + 1
        Z = K - (k * OMEGA)**2 * M + 1j * k * OMEGA * C
        e = packed[a] - 1j * packed[b]
        q = free * (free @ e) / (free @ Z @ free)
        assert x[a] - 1j * x[b] == pytest.approx(q, abs=1e-11)
        reaction = found[a - first] - 1j * found[b - first]
        assert Z @ q + rows.T @ reaction == pytest.approx(e, abs=1e-11)
    if layout.mean:
        assert K @ x[0] + rows.T @ lam[0] == pytest.approx(packed[0], abs=1e-11)


def test_rest_is_where_the_reactions_fit(rng):
    """Means of the reactions are in the middle of what the bounds leave; a tenth less of friction and one of them slips."""
    layout, rows = Layout((0, 1, 2, 3), 3), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -1.0]])
    load = rng.normal(size=layout.size)
    rest = Linear.of(layout, OMEGA, M, C, K, load)
    _, found = _tied(layout, rest, rows, np.zeros((layout.slots, 2)))
    t = np.linspace(0.0, 2.0 * np.pi, 20001)
    waves = np.array([wave(k * t) for k in (1, 2, 3) for wave in (np.cos, np.sin)])
    reactions = found.T @ waves
    extent = 0.5 * (reactions.max(axis=1) - reactions.min(axis=1))
    for share in (1.1, 0.9, np.array([0.9, 1.1]), np.array([1.1, 0.9])):
        limits = share * extent
        contacts = [Contact(row, constant(0.2 + limit), constant(0.2 - limit)) for row, limit in zip(rows, limits, strict=True)]
        result = at_rest(Balance(layout, OMEGA, rest, contacts), 1e-11, 30)
        if np.min(share) < 1.0:  # of one contact is enough
            assert result is None
            continue
        assert result.status is SetValuedStatus.RESTS and result.success
        assert np.array(result.room) == pytest.approx(np.transpose([-0.1 * extent, 0.1 * extent]), abs=1e-2 * extent.max())
        x = layout.matrix(result.x)
        assert np.abs(rows @ x[1:].T).max() < 1e-12
        means = np.linalg.lstsq(rows.T, layout.matrix(load)[0] - K @ x[0], rcond=None)[0]
        assert np.abs(rows.T @ means + K @ x[0] - layout.matrix(load)[0]).max() < 1e-10
        for mean, reaction, limit in zip(means, reactions, limits, strict=True):
            top, bottom = 0.2 + limit - (mean + reaction).max(), (mean + reaction).min() - (0.2 - limit)
            assert top == pytest.approx(bottom, abs=2e-2 * limit) and top > 0.0


def test_rest_without_a_mean_asks_for_the_load_itself_to_fit():
    """One mass at rest carries the whole load, 2 cos t - .6 sin 3t: in odd harmonics no mean shifts what does not fit."""
    layout, load = Layout((1, 3), 1), np.zeros(4)
    load[0], load[3] = 2.0, -0.6
    rest = Linear.of(layout, OMEGA, 1.0, 0.1, 1.0, load)
    t = np.linspace(0.0, 2.0 * np.pi, 100001)
    top = np.abs(2.0 * np.cos(t) - 0.6 * np.sin(3.0 * t)).max()
    for share, rests in ((1.001, True), (0.999, False)):
        for upper, lower in ((share, -share), (share, -1.5), (1.5, -share)):
            contact = Contact(np.ones(1), constant(upper * top), constant(lower * top))
            result = at_rest(Balance(layout, OMEGA, rest, [contact]), 1e-11, 30)
            assert (result is not None) is rests
