"""The checker of matrices says what is wrong and what to write."""
import numpy as np
import pytest
from scipy.sparse import csr_matrix

import bifurc as bf
from bifurc.structure.checks import checked
from bifurc.structure.names import place_of

K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
M = np.diag([1.0, 2.0, 3.0])


def test_good_matrices_pass_and_the_report_tells_rigid_bodies():
    found = checked(M, None, csr_matrix(K))
    assert found.report == "3 degrees of freedom, no rigid-body mode: it is held"
    free = K.copy()
    free[0, 0] = 1.0
    assert checked(M, None, free).rigid_body_modes == 1
    assert "1 rigid-body mode" in checked(M, None, free).report
    assert checked(M, None, np.zeros((3, 3))).rigid_body_modes == 3
    noisy = K.copy()
    noisy[0, 1] *= 1.0 + 1e-12
    assert np.array_equal(checked(M, None, noisy).K, checked(M, None, noisy).K.T)


def test_units_do_not_make_rigid_bodies():
    scale = np.diag([1.0, 1e5, 1e-4])
    assert checked(scale @ M @ scale, None, scale @ K @ scale).rigid_body_modes == 0


@pytest.mark.parametrize(("change", "words"), [
    ({"K": np.triu(K)}, r"upper triangle of a matrix; write K \+ K.T - np.diag\(np.diag\(K\)\)"),
    ({"C": np.tril(K)}, "lower triangle"),
    ({"K": K + np.array([[0, 1, 0], [0, 0, 0], [0, 0, 0.0]])},
     r"K\[0, 1\] = 0, K\[1, 0\] = -1; a skew-symmetric part belongs into G"),
    ({"K": K[:2]}, r"K has shape \(2, 3\); it must be square"),
    ({"K": K[:2, :2]}, r"it must be that of M, \(3, 3\)"),
    ({"M": np.diag([1.0, -1.0, 1.0])}, "not positive semidefinite .* mostly in coordinate 1"),
    ({"M": np.ones((3, 3))}, "singular in a direction that is no single coordinate"),
    ({"K": K * 1j}, "structural damping"),
    ({"K": np.where(K == 2.0, np.nan, K)}, r"K\[0, 0\] = nan"),
    ({"G": K}, "not skew-symmetric"),
    ({"dofs": ["a", "b"]}, "dofs has 2 names; there are 3"),
    ({"dofs": ["a", "b", "a"]}, "names a more than once"),
])
def test_what_is_wrong_is_said(change, words):
    arguments = {"M": M, "C": None, "K": K, **change}
    with pytest.raises(ValueError, match=words):
        bf.System.from_matrices(**arguments)


def test_circulatory_matrices_are_taken_when_asked_for():
    circulatory = K + np.array([[0.0, 0.3, 0.0], [-0.3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    system = bf.System.from_matrices(M, None, circulatory, symmetric=False)
    assert np.array_equal(system.stiffness, circulatory)


def test_damping_helpers():
    C = bf.rayleigh_damping(M, K, alpha=0.1, beta=0.2)
    assert np.array_equal(C, 0.1 * M + 0.2 * K)
    squares, modes = np.linalg.eigh(np.diag(1.0 / np.sqrt(np.diag(M))) @ K @ np.diag(1.0 / np.sqrt(np.diag(M))))
    modes = np.diag(1.0 / np.sqrt(np.diag(M))) @ modes
    omega = np.sqrt(squares)
    C = bf.rayleigh_damping(M, K, ratios=(0.02, 0.03), frequencies=omega[:2])
    assert np.diag(modes.T @ C @ modes)[:2] / (2.0 * omega[:2]) == pytest.approx([0.02, 0.03])
    C = bf.modal_damping(M, K, (0.01, 0.05))
    assert modes.T @ C @ modes == pytest.approx(np.diag(2.0 * np.array([0.01, 0.05, 0.05]) * omega), abs=1e-12)
    with pytest.raises(ValueError, match="modal_damping"):
        bf.rayleigh_damping(M, K, ratios=(0.001, 0.5), frequencies=(1.0, 1.1))
    with pytest.raises(ValueError, match="alpha= and beta="):
        bf.rayleigh_damping(M, K)
    with pytest.raises(ValueError, match="ratios"):
        bf.modal_damping(M, K, -0.1)


def test_a_name_that_is_not_there_meets_those_of_its_node_first():
    names = tuple(f"n{i}.{axis}" for i in range(9) for axis in ("ux", "uy"))
    with pytest.raises(ValueError, match=r"'n8\.rz'; there are n8\.ux, n8\.uy \.\.\.$"):
        place_of("n8.rz", names, len(names), "stop")
    with pytest.raises(ValueError, match=r"there are n0\.ux, .*, n3\.uy \.\.\."):
        place_of("elsewhere", (*names,), len(names), "stop")
    assert place_of("n8.uy", names, len(names), "stop") == 17
