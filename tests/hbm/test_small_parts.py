"""Small functions of harmonic balance one by one: rows, first order forms, phases and guards, against numpy."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.hbm.balance import GRID, LEAST_GRID, Balance
from bifurc.hbm.condensation.condensed import _independent
from bifurc.hbm.condensation.receptance import _first_order
from bifurc.hbm.contacts import event_driven, sampled
from bifurc.hbm.contacts.common import PAIRS
from bifurc.hbm.floquet import monodromy
from tests.reference.plain import plain


def test_independent_rows_and_all_rows_by_them(rng):
    B = rng.normal(size=(2, 5)) * [[1.0], [1e5]]
    R = np.array([B[0], np.zeros(5), 3.0 * B[0] - 1e-5 * B[1], B[1]])
    rows, S = _independent(R)
    assert rows.shape == (2, 5) and all(any(np.array_equal(row, other) for other in R) for row in rows)
    np.testing.assert_allclose(S @ rows, R, rtol=1e-12, atol=1e-9)
    kept = [next(i for i, other in enumerate(R) if np.array_equal(row, other)) for row in rows]
    assert kept == sorted(kept) and np.array_equal(S[kept], np.eye(2)) and not S[1].any()
    rows, S = _independent(B)
    assert np.array_equal(rows, B) and rows is not B and np.array_equal(S, np.eye(2))


@pytest.mark.parametrize("free", [False, True])
def test_a_first_order_form_has_the_poles_of_the_masses(free, rng):
    """Also where stiffness is not symmetric and a mass is free, whose size is that of the stiffest mode."""
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    K = np.array([[1.0, -1.0], [-1.0, 1.0]]) if free else np.array([[5.0, -1.3], [-0.9, 2.0]])
    C = 0.1 * rng.normal(size=(2, 2))
    A, shapes, size = _first_order(M, C, K)
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]))

    def order(values):
        return sorted(values, key=lambda z: (round(z.imag, 6), round(z.real, 6)))

    np.testing.assert_allclose(order(np.linalg.eigvals(A)), order(poles), atol=1e-7 if free else 1e-12)
    assert shapes.T @ M @ shapes == pytest.approx(np.eye(2), abs=1e-13)
    even = np.diag(shapes.T @ (0.5 * (K + K.T)) @ shapes)
    assert size**2 == pytest.approx([even.max()] * 2 if free else even, rel=1e-12)
    assert A[:2, 2:] == pytest.approx(np.diag(size), rel=1e-14) and not A[:2, :2].any()


def test_a_matrix_in_another_unit_of_time(rng):
    A, n, rate = rng.normal(size=(5, 5)), 2, 3.0
    D = np.diag([1.0, 1.0, rate, rate, 1.0])
    known = np.linalg.inv(D) @ A @ D
    plain(monodromy.similar)(A, n, rate)
    assert A == pytest.approx(known, rel=1e-13)


def test_phases_of_steps_and_events_in_their_order():
    """Of each contact the ends of all segments but the last; what coincides is there once."""
    turn = 2.0 * np.pi
    ends = np.array([[[0.9, 9.0], [0.2, 9.0], [5.0, 9.0]], [[0.25 * turn, 9.0], [turn, 9.0], [0.0, 9.0]]])
    out = np.empty(20)
    count = plain(monodromy.cut)(ends, np.array([[3, 0], [2, 0]]), 4, out)
    assert out[:count] == pytest.approx([0.0, 0.2, 0.9, 0.25 * turn, 0.5 * turn, 0.75 * turn, turn], rel=1e-15)
    assert plain(monodromy.cut)(ends, np.array([[1, 0]]), 1, out) == 2 and out[:2].tolist() == [0.0, turn]


def test_a_guard_at_a_sample_is_that_without_memory_and_what_memory_adds(rng):
    values, X, A = rng.normal(size=(2, 3, 4)), rng.normal(size=(2, 9, 12)), np.zeros((3, 1, 8), np.int64)
    A[2, 0, PAIRS] = 2
    z = np.array([0.5, -1.5])
    found = plain(sampled.guard_at)(values, X, A, 3, 1, 2, z, 3)
    assert found == pytest.approx(values[1, 2, 3] + X[1, 4, 7] * 0.5 - X[1, 4, 8] * 1.5, rel=1e-14)


@pytest.mark.parametrize("first, values, slopes, add, found", [
    (1, [-1, -1, -1, -1], [0, 0, 0, 0], 0.0, 4), (1, [-1, -1, 0, -1], [0, 0, 0, 0], 0.0, 2),
    (3, [-1, -1, 0, -1], [0, 0, 0, 0], 0.0, 4),
    (1, [-1, -1, -1, -1], [0, 0, 0, 0], 1.0, 1), (1, [1, -1, -1, 1], [0, 0, 0, 0], -0.5, 3),
    (1, [-1, -1, -1, -1], [-1, 1, -1, 1], 0.0, 2), (1, [-1, -1, -1, -1], [1, 0, -1, 1], 0.0, 4),
    (1, [-1] * 4, [1, -1, 1, -1], 0.0, 1)])
def test_the_first_cell_in_which_a_guard_may_be_zero(first, values, slopes, add, found):
    """A value that is not below zero, or a top between two samples; of two guards the first; at once where one is ignored."""
    quiet = [-9.0] * 4
    unquiet = plain(event_driven.unquiet)
    for guards in ((values, quiet), (quiet, values)):
        rates = np.array([slopes if own is values else [0.0] * 4 for own in guards], float)
        offset = np.array([add if own is values else 0.0 for own in guards])
        for ignored in ([0, 0], [-1, 0]):
            assert unquiet(2, np.array(guards, float), rates, offset, ignored, first) == found
        assert unquiet(2, np.array(guards, float), rates, offset, [0, 1], first) == first
    assert unquiet(0, np.zeros((0, 4)), np.zeros((0, 4)), [], [], 1) == 4


@pytest.mark.parametrize("samples", [0, 12])
def test_the_grid_of_a_balance_is_fine_for_its_highest_harmonic(samples):
    """Waves and excitations at its nodes, the last one a period behind the first; derivatives by the angle."""
    waves, excited = np.array([0, 1, 1, 30, 30]), np.array([0, 1, 4])  # constant, cos 1, sin 30
    balance = SimpleNamespace(samples=samples, parts=SimpleNamespace(shape=SimpleNamespace(waves=waves, excited=excited)))
    grid = Balance.grid.func(balance)
    nodes = samples or max(LEAST_GRID, GRID * 30)
    angle = 2.0 * np.pi * np.arange(nodes + 1) / nodes
    assert grid.samples == samples
    for i, k in enumerate((1, 30)):
        assert grid.cosines[i] == pytest.approx(np.cos(k * angle), abs=1e-12)
        assert grid.sines[i] == pytest.approx(np.sin(k * angle), abs=1e-12)
    zero = np.zeros_like(angle)
    known = [zero, np.cos(angle), np.sin(30 * angle)], [zero, -np.sin(angle), 30 * np.cos(30 * angle)]
    np.testing.assert_allclose(grid.excite, known[0], atol=1e-12)
    np.testing.assert_allclose(grid.dexcite, known[1], atol=1e-10)
