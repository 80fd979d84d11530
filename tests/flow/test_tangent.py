"""Small perturbations along recorded motions: how many directions are left where rows are held, from the first instant on."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, RigidStop


def left(system, motion, stop):
    """Return directions (ns, k) that are left where row ``stop`` of the record begins, just before its event, and their mode."""
    scene, R, ns = scene_of(system), motion.recorded, scene_of(system).ns
    Q, alive, sums = np.eye(ns), np.array([ns], np.int64), np.zeros((1, ns))
    kernels(scene, "bifurc.flow.tangent").grow(scene.tables, R.rows[:stop], R.times[:stop], R.before[:stop], R.after[:stop],
                                               int(R.rows[stop, 4]), float(R.times[stop]), system.period, 0, Q, alive, sums)
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
