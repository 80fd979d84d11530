"""Small kernels of harmonic balance by name, as the Python they are written in: against numpy and sums written out."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.hbm import corrector, residual
from bifurc.hbm.contacts import common, event_driven
from bifurc.solve import zeros
from tests.reference.plain import plain


def room_of(*phases):
    """Room in which contacts have had events at ``phases``, one list each, and hold the numbers of older ones behind them."""
    ends = np.full((len(phases), 4, 2), 9.0)
    for k, mine in enumerate(phases):
        ends[k, :len(mine), 0] = mine
    return SimpleNamespace(ends=ends, counts=np.array([[len(mine) + 1, 0] for mine in phases]))


def test_phases_of_events_are_noted():
    phases = np.zeros((2, 4))
    plain(corrector.noted)(room_of([0.5, 2.0], []), phases)
    np.testing.assert_array_equal(phases, [[0.5, 2.0, np.nan, np.nan], [np.nan] * 4])


@pytest.mark.parametrize("contact", [0, 1])
def test_an_event_far_from_all_others_has_sprung(contact, rng):
    """By angles in the complex plane, over random phases: also across phase 0, and whichever comes first."""
    seen = set()
    for _ in range(200):
        old, new = np.sort(rng.uniform(0.0, 2.0 * np.pi, 3)), np.sort(rng.uniform(0.0, 2.0 * np.pi, 2))
        apart = np.abs(np.angle(np.exp(1j * np.subtract.outer(new, old)))).min(axis=1)
        before, after = [[], []], [[1.0], [1.0]]  # a contact without events before tells nothing
        before[contact], after[contact] = old, new
        phases = np.zeros((2, 4))
        plain(corrector.noted)(room_of(*before), phases)
        known = bool(apart.max() > corrector.SPRUNG)
        assert plain(corrector.sprung)(room_of(*after), phases) == known
        seen.add(known)
    assert seen == {False, True}
    for row, angle, known in (([0.0, np.nan], 1.0, True), ([0.0, np.nan], 0.1, False), ([2.0, 0.0], 0.1, False),
                              ([0.0, 1.0], 3.0, True)):
        assert plain(corrector.sprung)(room_of([angle]), np.array([row])) == known
    phases = np.full((1, 4), np.nan)
    phases[0, 0] = 0.1
    for angle, known in ((2.0 * np.pi - 0.3, False), (2.0 * np.pi - 0.45, True), (0.55, False), (0.65, True), (3.3, True)):
        assert plain(corrector.sprung)(room_of([angle]), phases) == known


def test_lengths_and_rounding_of_points(rng):
    x, scale = rng.normal(size=7), rng.uniform(0.1, 3.0, 7)
    assert plain(corrector.length_of)(x) == pytest.approx(np.linalg.norm(x), rel=1e-14)
    for sign in (1.0, -1.0):
        assert plain(corrector.rounding_of)(sign * x, scale) == pytest.approx(
            4.0 * np.finfo(float).eps * (1.0 + np.linalg.norm(x / scale, np.inf)), rel=1e-14, abs=0.0)
    assert plain(corrector.rounding_of)(0.0 * x, scale) == 4.0 * np.finfo(float).eps


@pytest.mark.parametrize("kind", [-1, 0, 2])
@pytest.mark.parametrize("case", ["first", "near, settles", "near, does not", "far", "fails"])
def test_a_point_of_a_curve_is_corrected_once_where_its_neighbour_serves(kind, case):
    """What serves is corrected by the factors of its neighbour; without events, or farther away, all is made anew."""
    calls = []

    def beside(hermite, t, miss, scale, plane, start, tangent):
        plane[:], start[:] = [t, 2.0], [t, 2.0]

    def settled(equations, place, found, bench):
        calls.append("settled")
        found.x[:] = [1.5, 4.0]
        return case == "near, settles"

    def corrected(equations, place, fixed, found, near, bench):
        calls.append(("corrected", bool(near)))
        found.x[:], found.new[:] = [2.5, 6.0], [0.25, -0.75]
        return corrector.CONVERGED + (case == "fails")

    was = np.nan if case == "first" else 0.3 if case == "far" else 0.5 + 0.5 * corrector.CLOSE
    place = SimpleNamespace(plane=np.zeros(2), start=np.zeros(2), tangent=None)
    sought = SimpleNamespace(hermite=None, miss=np.zeros(2), place=place, known=np.array([was]))
    found = SimpleNamespace(x=np.zeros(2), new=np.zeros(2), events="events")
    box, scale = np.zeros(zeros.BOX), np.array([0.5, 4.0])
    answer = plain(corrector.tested, beside=beside, settled=settled, corrected=corrected,
                   monitored=lambda events, which, field: 10.0 * which + field)(
        SimpleNamespace(scale=scale), tuple(vars(sought).values()), 0.5, (kind, 1), found, box, None)
    near = case in ("near, settles", "near, does not", "fails") and kind >= 0
    anew = not (near and case == "near, settles")
    assert calls == ["settled"] * near + [("corrected", case != "first")] * anew
    assert answer == (case != "fails")
    if answer:
        x = np.array([2.5, 6.0] if anew else [1.5, 4.0])
        assert sought.miss == pytest.approx((x - [0.5, 2.0]) / scale, rel=1e-14)
        assert box[zeros.VALUE] == (10.0 * kind + 1.0 if kind >= 0 else -0.75) and box[zeros.PARAMETER] == x[1]
        assert sought.known[0] == (0.5 if anew else was)


@pytest.mark.parametrize("waves", [(0, 1, 1, 2, 2, 3, 3), (0, 1, 1, 3, 3, 7, 7)])
def test_a_zero_where_a_polynomial_rises(waves):
    """Of a + b sin(theta - c): its zeros are known; where it falls, has none, or is farther away, there is no answer."""
    waves, a = np.array(waves), np.zeros(7)
    a[0], a[1], a[2] = 0.3, -np.sin(0.4), np.cos(0.4)  # 0.3 + sin(theta - 0.4)
    root = 0.4 - np.arcsin(0.3)
    risen = plain(event_driven.risen)
    for guess in (root, root - 0.2, root + 0.2):
        assert risen(waves, a, guess, 0.25) == pytest.approx(root, abs=1e-12)
    assert risen(waves, a, root - 0.3, 0.25) == np.inf
    assert risen(waves, a, 0.4 + np.pi, 0.5) == np.inf  # it falls there
    a[0] = 1.2
    assert risen(waves, a, 0.4 - 0.5 * np.pi, 1.0) == np.inf


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("waves", [(0, 1, 1, 2, 2), (0, 1, 1, 4, 4), (0, 3, 3)])
def test_rows_on_a_grid_and_their_derivatives(waves, twice, rng):
    """Sums of cosines and sines, differentiated by hand."""
    waves = np.array(waves)
    c, last = rng.normal(size=(2, waves.size)), 12
    theta, k = 2.0 * np.pi * np.arange(last + 1) / last, waves[1::2, None]
    cosines, sines = np.cos(k * theta), np.sin(k * theta)
    U, dU, ddU = (np.full((2, last + 1), np.nan) for _ in range(3))
    plain(residual.synthesised)(waves, cosines, sines, c, U, dU, ddU, twice, np.full((6, last // 2 + 1), np.nan),
                                np.full((6, len(k)), np.nan))
    a, b = c[:, 1::2], c[:, 2::2]
    np.testing.assert_allclose(U, c[:, :1] + a @ cosines + b @ sines, atol=1e-12)
    np.testing.assert_allclose(dU, (b * k.T) @ cosines - (a * k.T) @ sines, atol=1e-12)
    np.testing.assert_allclose(ddU, -(a * k.T**2) @ cosines - (b * k.T**2) @ sines if twice else np.full((2, last + 1), np.nan),
                               atol=1e-11)


def test_expressions_on_a_grid(rng):
    """The constant counts once, or not with derivatives; rows of the coordinates follow the excitation, place and speed in turn."""
    own = np.ones(16, np.int64)
    own[common.WIDTH], own[common.ROWS:common.ROWS + 2] = 2, (2, 0)
    U, V, excite, row = rng.normal(size=(3, 5)), rng.normal(size=(3, 5)), rng.normal(size=(3, 5)), rng.normal(size=7)
    row[[1, 3, 6]] = 1.0
    for constant in (0, 1):
        out = np.full(5, np.nan)
        plain(common.filled)(row, own, U, V, excite, constant, out)
        known = constant * row[0] + row[1:3] @ excite[1:] + row[3] * U[2] + row[4] * V[2] + row[5] * U[0] + row[6] * V[0]
        np.testing.assert_allclose(out, known, atol=1e-13)


def test_choices_of_contacts_that_close_and_open():
    """Mode 0 closes by its guards 0 and 1, where it tries to stick (mode 1); mode 1 opens by guard 0, up, and guard 1, down."""
    A = np.zeros((2, 3, 40), np.int64)
    A[0, 1:, common.CHOICE], A[0, 1:, common.TRIAL] = 1, 1
    A[1, 1, common.CHOICE], A[1, 2, common.CHOICE] = 2, 3
    path = np.zeros((10, common.FIELDS), np.int64)
    path[:9, :3] = [(0, 0, 1), (1, 0, 0), (0, 1, 2), (1, 1, 0), (0, 0, 3), (1, 1, 0), (0, 1, 3), (1, 0, 0), (0, 1, 1)]
    choices = plain(common.choices)
    assert choices(A, path, 10) == (3, 2, 4)  # the last is the end of the period
    assert choices(A, path, 7) == (2, 2, 3) and choices(A, path, 4) == (1, 0, 1) and choices(A, path, 1) == (0, 0, 0)
