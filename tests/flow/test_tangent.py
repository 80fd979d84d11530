"""Small perturbations along recorded motions: how many directions are left where rows are held, from the first instant on."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, RigidStop
from bifurc.flow import tangent
from tests.reference.plain import plain


def left(system, motion, stop):
    """Return directions (ns, k) that are left where row ``stop`` of the record begins, just before its event, and their mode."""
    scene, R, ns = scene_of(system), motion.recorded, scene_of(system).ns
    Q, alive, sums = np.eye(ns), np.array([ns, 0], np.int64), np.zeros((1, ns))
    kernels(scene, "bifurc.flow.tangent").grow(scene.tables, R.rows[:stop], R.times[:stop], R.before[:stop], R.after[:stop],
                                               np.zeros(stop, bool), (int(R.rows[stop, 4]), float(R.times[stop])), system.period,
                                               0, Q, alive, sums)
    return Q[:, :alive[0]], int(R.rows[stop - 1, 2])


def held(scene, mode):
    """Return the rows (k, ns) that a mode holds: speeds, and places on surfaces."""
    T = scene.tables
    rows = np.concatenate([T.H[mode, :T.n_holds[mode], :scene.ns], T.S[mode, :T.n_holds[mode], :scene.ns]])
    return rows[np.abs(rows).max(axis=1) > 0.0]


def test_directions_keep_to_what_a_mode_holds_from_its_beginning_on(rng):
    """Three masses with coupled inertia: where sliders stick or a mass rests, also at the start, what is left obeys the constraint
    and has no more directions than that leaves."""
    seen = set()
    for k in range(10):
        A, B = rng.normal(size=(2, 3, 3))
        K = 2.0 * np.eye(3) + 0.3 * B @ B.T
        stop = [RigidStop(0.3, 0.0, dof=2)] if k % 2 else []
        system = bf.System(np.eye(3) + 0.2 * A @ A.T, 0.1 * K, K, [
            HarmonicForce(1.0), Coulomb(0.6, dof=1), Coulomb(0.5, row=tuple(rng.normal(size=3))), *stop], omega=1.1)
        motion, scene = bf.simulate(system, np.zeros(6), periods=6), scene_of(system)
        for place in range(1, len(motion.recorded.times)):
            Q, mode = left(system, motion, place)
            rows = held(scene, mode)
            rank = np.linalg.matrix_rank(rows) if len(rows) else 0
            assert Q.shape[1] <= 6 - rank
            assert not len(rows) or np.abs(rows @ Q).max() < 1e-9 * np.abs(rows).max()
            seen.add((rank, place == 1))
    assert {(2, True), (2, False), (0, False)} <= seen


@pytest.mark.parametrize(("y0", "fall"), [((0.5, 0.0), False), ((0.2, 0.0), True)])
def test_a_mass_that_rests_on_its_stop_has_no_direction_left(y0, fall):
    """Placed there, or fallen onto it in a complete chattering: position and speed are given by the stop."""
    system = bf.System(1.0, 0.1, 1.0, [ConstantForce(2.0), HarmonicForce(0.1), RigidStop(0.5, 0.5)], omega=1.0)
    motion = bf.simulate(system, y0, periods=3.0)
    assert any(event.kind == "chatter" for event in motion.events) == fall
    assert left(system, motion, len(motion.recorded.times) - 1)[0].shape == (2, 0)


def test_lengths_are_those_of_the_orthonormal_columns_and_one_that_is_gone_gives_its_place_away(rng):
    new = rng.normal(size=(4, 4))
    Q, alive, sums = np.zeros((4, 4)), np.array([4], np.int64), np.full(4, 0.5)
    upper = np.linalg.qr(new)[1]
    plain(tangent.orthonormal)(new.copy(), alive, Q, sums)
    np.testing.assert_allclose(Q.T @ Q, np.eye(4), atol=1e-14)
    np.testing.assert_allclose(np.abs(Q.T @ new), np.abs(upper), atol=1e-13)
    np.testing.assert_allclose(sums, 0.5 + np.log(np.abs(np.diag(upper))), atol=1e-13)
    assert alive[0] == 4
    lost = new.copy()
    lost[:, 1] = -3.0 * lost[:, 0]
    sums = np.zeros(4)
    plain(tangent.orthonormal)(lost.copy(), alive, Q, sums)
    assert alive[0] == 3
    upper = np.linalg.qr(lost[:, [0, 3, 2]])[1]  # the last one stands in its place
    np.testing.assert_allclose(sums, [*np.log(np.abs(np.diag(upper))), 0.0], atol=1e-12)
    np.testing.assert_allclose(Q[:, :3].T @ Q[:, :3], np.eye(3), atol=1e-14)


def test_a_mode_in_which_a_motion_begins_forgets_speeds_and_places_that_it_holds(rng):
    """What sticks forgets its speed, what rests on a surface its place as well; nothing is counted as growth."""
    H, S = np.zeros((2, 2, 6)), np.zeros((2, 2, 6))
    H[1, 0, 2:4], H[1, 1, 2:4], S[1, 0, :2] = (1.0, 2.0), (2.0, 4.0), (3.0, -1.0)
    T = SimpleNamespace(H=H, S=S, n_holds=np.array([0, 2]))
    assert [plain(tangent.forgotten)(T, m) for m in (0, 1)] == [0, 3]
    T.n_holds[1] = 1
    assert plain(tangent.forgotten)(T, 1) == 2
    Q, alive = np.linalg.qr(rng.normal(size=(4, 4)))[0], np.array([4], np.int64)
    before = Q.copy()
    plain(tangent.rested)(T, 0, Q, alive, np.empty((4, 4)))
    assert (Q == before).all() and alive[0] == 4
    plain(tangent.rested)(T, 1, Q, alive, np.empty((4, 4)))
    left = Q[:, :alive[0]]
    assert alive[0] == 2 and np.abs(np.array([H[1, 0, :4], S[1, 0, :4]]) @ left).max() < 1e-13
    np.testing.assert_allclose(left.T @ left, np.eye(2), atol=1e-14)
