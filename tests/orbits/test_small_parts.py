"""Small kernels and choices of orbits one by one, against numpy and sums written out."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.orbits import lyapunov
from bifurc.orbits.equilibria.equilibrium import _kernel
from bifurc.orbits.shooting import motion, sequence, signature
from tests.reference.plain import plain


def test_numbers_of_a_series_at_a_value():
    """Chebyshev sums between the ends; what is rounding of the mean is zero."""
    series = np.array([[2.0, -1.0, 0.5, 0.25], [1.0, -1.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]])
    T = SimpleNamespace(flat=np.full(6, 9.0))
    plain(sequence.set_numbers)(T, np.array([4, 1, 2]), series, 1.0, 5.0, 4.2)
    known = np.polynomial.chebyshev.chebval(0.6, series.T)
    assert T.flat[[4, 1, 2]] == pytest.approx(known, rel=1e-14) and T.flat[[0, 3, 5]].tolist() == [9.0] * 3
    plain(sequence.set_numbers)(T, np.array([4, 1, 2]), series, 1.0, 5.0, 5.0)
    assert T.flat[1] == 0.0
    series[1, 0] += 2e-16 * 4
    plain(sequence.set_numbers)(T, np.array([4, 1, 2]), series, 1.0, 5.0, 5.0)
    assert T.flat[1] == series[1, 0] - 1.0 > 0.0


@pytest.mark.parametrize("guard", [-1, 0])
@pytest.mark.parametrize("holds", [0, 2])
def test_the_state_behind_a_node(guard, holds, rng):
    """What is held is put on its surface and to rest first, then an event jumps: matrices one after the other."""
    S, H = np.zeros((1, 2, 5)), np.zeros((1, 2, 5))
    S[0, 0], H[0, 0], H[0, 1] = [1.0, 0, 0, 0, 0.4], [0.0, 0, 1.0, 0, -0.3], [0.0, 0, 0.5, 1.0, 0.0]
    J = rng.normal(size=(4, 5))
    T = SimpleNamespace(n_holds=np.array([holds]), S=S, H=H)

    def jump(T_, m, g, closes, x, xp, P):
        assert (m, g, closes) == (0, 0, True)
        P[:], xp[:4], xp[4:] = J, J @ x, x[4:]

    x, xp, P = rng.normal(size=5), np.full(5, np.nan), np.full((4, 5), np.nan)
    plain(sequence.reset, jump=jump, curved_hold=lambda *args: None)(T, 0, guard, 1, x, xp, P)
    Q = np.eye(4, 5)
    if holds:
        rows = np.array([S[0, 0], H[0, 0], H[0, 1]])
        states = rows[:, :4]
        Q = Q - np.linalg.pinv(states) @ rows  # the nearest state with the rows at zero
    held = np.append(Q @ x, x[4])
    known, slope = (held[:4], Q) if guard < 0 else (J @ held, J[:, :4] @ Q + np.outer(J[:, 4], np.eye(5)[4]))
    assert xp == pytest.approx(np.append(known, x[4]), abs=1e-13) and P == pytest.approx(slope, abs=1e-13)


def test_natural_sizes_of_guards():
    scale = plain(sequence.scale_of)
    assert scale(np.array([1.0, -2.0, 50.0]), np.array([3.0, 4.0])) == 11.0
    assert scale(np.array([0.0, 0.0, 5.0, -7.0]), np.array([3.0, 4.0])) == 12.0


def test_the_end_of_an_arc_by_what_was_kept(rng):
    arc, xp, y = rng.normal(size=(2, 5)), rng.normal(size=4), np.empty(2)
    plain(sequence.moved_end)(arc, xp, y)
    assert y == pytest.approx(arc[:, :2] @ (xp[:2] - arc[:, 2]) + arc[:, 3] + arc[:, 4], abs=1e-13)


def test_a_guard_waits_for_events_of_its_row_at_one_instant():
    G = np.zeros((2, 3, 2))
    G[0, 0], G[1, 0], G[1, 1], G[1, 2] = [1.0, -2.0], [-1.0, 2.0], [1.0, 2.5], [3.0, 0.0]
    T = SimpleNamespace(G=G)
    row = np.zeros(5, np.int64)

    def node(guard, together=False):
        made = row.copy()
        made[sequence.BEFORE], made[sequence.GUARD] = 1, guard
        made[sequence.DIVIDE] = sequence.TOGETHER if together else 0
        return made

    waits = plain(sequence.waits)
    assert waits(T, np.array([node(0)]), 0, 0, 0) and not waits(T, np.array([node(1)]), 0, 0, 0)
    assert waits(T, np.array([node(1), node(0, True)]), 0, 0, 0) and not waits(T, np.array([node(1), node(0)]), 0, 0, 0)
    assert waits(T, np.array([node(0, True), node(2), node(1)]), 2, 0, 0)  # round the period
    assert not waits(T, np.array([node(1), node(-1, True), node(0, True)]), 0, 0, 0)  # not beyond a section
    assert waits(T, np.array([node(2), node(1, True), node(0, True)]), 0, 0, 0)


def test_labels_that_stray_from_a_foretold_point():
    closure = np.zeros((3, 2))
    closure[0] = [sequence.KEPT, sequence.KEPT]
    closure[1], closure[2] = [2.0, 0.0], [1.0, -4.0]
    F, U, foretold, weights = np.ones(5), np.array([9.0, 0.5, 0.7]), np.array([7.0, 0.4, 0.2, 3.0]), np.array([1.0, 2.0])
    plain(sequence.astray)(closure, U, foretold, weights, F)
    assert F == pytest.approx([1.0, 1.0, 1.0, 1.0 + 0.2 / 2.0, 1.0 + (0.1 - 2.0) / 9.0], rel=1e-12)
    closure[0] = [sequence.ODD, sequence.KEPT]
    F[:] = 0.0
    plain(sequence.astray)(closure, U, foretold, weights, F)
    assert F == pytest.approx([0.0, 0.0, 0.0, 0.0, -1.9 / 9.0], rel=1e-12)
    plain(sequence.astray)(closure[:1], U, foretold, weights, F)
    assert F[-1] == pytest.approx(-1.9 / 9.0)


def test_tests_that_stand_in_numbers_of_an_orbit():
    info, value = np.arange(100.0, 100.0 + sequence.INFO), plain(sequence.monitored)
    assert value(info, sequence.LISTED) == -info[sequence.LISTED] and value(info, sequence.PEAK) == info[sequence.PEAK]
    assert value(info, sequence.BROKEN) == info[sequence.BROKEN] - 0.5 * sequence.HELD
    info[sequence.LISTED], info[sequence.PEAK] = np.inf, -np.inf
    assert value(info, sequence.LISTED) == value(info, sequence.PEAK) == sequence.NO_PEAK
    other = next(k for k in range(sequence.INFO) if k not in (sequence.LISTED, sequence.PEAK, sequence.BROKEN))
    assert value(info, other) == info[other]


def test_the_start_of_an_arc_is_that_behind_its_node():
    nodes, U = np.array([[0] * 5, [0] * 5]), np.array([9.0, 9.0, 9.0, 0.25, 3.0, 4.0])
    nodes[1, [sequence.BEFORE, sequence.GUARD, sequence.AFTER, sequence.CLOSES]] = 5, 6, 3, 1
    T, told = SimpleNamespace(A=np.zeros((1, 2, 3)), flat=np.array([np.pi])), []
    plain(motion.start_of, forcing=lambda T_, t, y: y.__setitem__(2, t),
          reset=lambda T_, m, g, closes, y, x, P: told.append((m, g, closes, y.tolist(), x, P)))(T, nodes, U, 1, "P", "x")
    assert told == [(5, 6, 2 + 3, [3.0, 4.0, 0.5], "x", "P")]  # a complete chattering that rests in mode 3


def test_rows_that_are_combinations_of_others(rng):
    held = rng.normal(size=(2, 6))
    row = 2.0 * held[0] - 5.0 * held[1]
    assert signature.combined_of(row, held, 4) and signature.combined_of(row, np.vstack([held, np.zeros(6)]), 4)
    for c in (0, 5):
        assert not signature.combined_of(row + 1e-6 * np.eye(6)[c], held, 4)
    assert not signature.combined_of(np.zeros(6), held, 4) and not signature.combined_of(row, held[:1], 4)


def test_bases_of_scaled_rows_and_null_spaces(rng):
    rows, size = rng.normal(size=(2, 4)), np.array([1.0, 10.0, 0.1, 3.0])
    found = signature._basis([rows[0], rows[1], rows[0] - 3.0 * rows[1], np.zeros(4)], size)
    assert found.shape == (2, 4) and found @ found.T == pytest.approx(np.eye(2), abs=1e-13)
    scaled = rows * size
    assert scaled @ found.T @ found == pytest.approx(scaled, rel=1e-12)
    more = signature._basis([rng.normal(size=4)], size, found)
    assert more.shape == (3, 4) and np.array_equal(more[:2], found) and more @ more.T == pytest.approx(np.eye(3), abs=1e-13)
    null = _kernel(rows)
    assert null.shape == (2, 4) and np.abs(rows @ null.T).max() < 1e-13 and null @ null.T == pytest.approx(np.eye(2), abs=1e-13)
    assert _kernel(np.vstack([rows, rows[0] + rows[1]])).shape == (2, 4) and _kernel(np.zeros((1, 3))).shape == (3, 3)
    assert np.array_equal(_kernel(np.zeros((0, 3))), np.eye(3))


def test_errors_of_means_by_batches(rng):
    """Of eight batches of two, then of pairs of them: the largest error, and one in all periods."""
    sums = rng.normal(size=(16, 3)) * [1.0, 5.0, 0.0]
    assert lyapunov.LEAST_BATCHES == 4
    batch = sums.reshape(8, 2, 3).mean(axis=1)
    pairs = batch.reshape(4, 2, 3).mean(axis=1)
    spread = [b.std(axis=0, ddof=1) / np.sqrt(len(b)) for b in (batch, pairs)]
    known = np.hypot(np.maximum(*spread), 1.0 / 16.0)
    assert lyapunov.errors_of(sums, 8) == pytest.approx(known, rel=1e-12)
