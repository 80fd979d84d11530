"""Rows over modal coordinates, against those over states: the same guards, eigenvalues and matrices in other coordinates."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.modal import give_modal
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, HarmonicForce, RigidStop


def chain(free, damping):
    n = 5
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    if free:
        K[0, 0] = K[-1, -1] = 1.0
    M = np.diag([1.0, 1.3, 0.9, 1.1, 1.2])
    C = damping * K
    return bf.System(M, C, K, [HarmonicForce(0.7, phase=0.4), ConstantForce(0.3, dof=1), HarmonicForce(0.2, 3, 0.3, dof=2),
                               RigidStop(50.0, dof=1), RigidStop(60.0, row=(0, 0, 1.0, -1.0, 0))], omega=1.3)


@pytest.mark.parametrize("free, damping", [(False, 0.0), (False, 0.05), (False, 2.5), (True, 0.05)])
def test_taylor_rows_of_guards_over_modes_are_those_over_states(free, damping, rng):
    """g = sum over j of (GT x) s^j with x = V xi; V and L are inverse, and turn the matrix of the mode into its blocks."""
    scene = scene_of(chain(free, damping))
    give_modal(scene.tables)
    T = scene.tables
    m = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    assert T.blocks[m, 3] > 0 and (not free or T.blocks[m, 2] > 1)
    A = np.vstack([T.A[m], np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])])
    assert T.V[m] @ T.L[m] == pytest.approx(np.eye(len(A)), abs=1e-10)
    for g in range(int(T.n_guards[m])):
        over = np.einsum("ic,ij->cj", T.V[m], T.GT[m, g])
        assert T.GS[m, g] == pytest.approx(over, rel=1e-8, abs=1e-11 * np.abs(over).max())
        x, row = rng.normal(size=len(A)), T.GS[m, g, :, 0]
        assert T.GS[m, g, :, 1] @ (T.L[m] @ x) == pytest.approx(T.G[m, g] @ A @ x, abs=1e-9)
        pairs = int(T.blocks[m, 0])
        assert T.tail[m, g, :2 * pairs:2, 0] == pytest.approx(np.hypot(row[:2 * pairs:2], row[1:2 * pairs:2]), rel=1e-12)
        assert T.tail[m, g, 2 * pairs:, 0] == pytest.approx(np.abs(row[2 * pairs:]), rel=1e-12)
