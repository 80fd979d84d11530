"""Matrices written by other libraries come back equal."""
import types

import numpy as np
import pytest
from scipy.io import mmwrite, savemat
from scipy.sparse import csc_matrix

import bifurc as bf
from tests.reference.beam import cantilever


@pytest.fixture(scope="module")
def beam():
    M, K, names = cantilever(3)
    return M, 0.01 * K + 0.1 * M, K, [f"{node}.{direction}" for node, direction in names]


def same(model, beam):
    assert np.array_equal(model.M, beam[0]) and np.array_equal(model.C, beam[1]) and np.array_equal(model.K, beam[2])


def test_matlab_files(beam, tmp_path):
    M, C, K, names = beam
    savemat(tmp_path / "beam.mat", {"M": M, "C": C, "K": csc_matrix(K), "dofs": np.array(names, dtype=object), "note": "x"})
    model = bf.read(tmp_path / "beam.mat")
    same(model, beam)
    assert model.dofs == tuple(names)
    system = model.system([bf.elements.RigidStop(1.0, dof="tip.uy")], omega=1.0)
    assert system.elements[0].dof == 4


def test_npz_files(beam, tmp_path):
    M, C, K, names = beam
    np.savez(tmp_path / "beam.npz", mass=M, damping=C, stiffness=K, dofs=np.array(names))
    same(bf.read(tmp_path / "beam.npz"), beam)
    np.savez(tmp_path / "two.npz", M=M, mass=M, K=K)
    with pytest.raises(ValueError, match="both 'M' and 'mass'"):
        bf.read(tmp_path / "two.npz")
    np.savez(tmp_path / "none.npz", M=M)
    with pytest.raises(ValueError, match="no stiffness matrix"):
        bf.read(tmp_path / "none.npz")


def test_matrix_market_files(beam, tmp_path):
    M, C, K, names = beam
    for name, matrix in (("M", M), ("C", C), ("K", K)):
        mmwrite(tmp_path / f"{name}.mtx", csc_matrix(matrix), symmetry="symmetric", precision=17)
    same(bf.read(mass=tmp_path / "M.mtx", damping=tmp_path / "C.mtx", stiffness=tmp_path / "K.mtx", dofs=names), beam)


def test_op4_files(beam, tmp_path):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    op4.write(str(tmp_path / "beam.op4"), {"maa": beam[0], "baa": beam[1], "kaa": beam[2]})
    same(bf.read(tmp_path / "beam.op4"), beam)


def test_dmig_files(beam, tmp_path):
    pytest.importorskip("pyyeti")
    import pandas
    from pyyeti.nastran import bulk

    index = pandas.MultiIndex.from_tuples([(node, place) for node in (1, 2, 3) for place in (2, 6)], names=["id", "dof"])
    frames = {name: pandas.DataFrame(matrix, index=index, columns=index)
              for name, matrix in zip(("MAA", "BAA", "KAA"), beam, strict=False)}
    bulk.wtdmig(str(tmp_path / "beam.dmig"), frames)
    model = bf.read(tmp_path / "beam.dmig")
    for got, want in zip((model.M, model.C, model.K), beam, strict=False):
        assert got == pytest.approx(want, rel=1e-9)  # sixteen columns of text
    assert model.dofs == ("1.uy", "1.rz", "2.uy", "2.rz", "3.uy", "3.rz")


@pytest.mark.parametrize("triangle", [True, False])
def test_abaqus_files(beam, tmp_path, triangle):
    places = [(node, place) for node in (1, 2, 3) for place in (2, 6)]
    for name, matrix in zip("MCK", beam, strict=False):
        rows = [f"{a},{b}, {c},{d}, {matrix[i, j]!r}" for i, (a, b) in enumerate(places) for j, (c, d) in enumerate(places)
                if matrix[i, j] and (j <= i or not triangle)]
        (tmp_path / f"{name}.mtx").write_text("\n".join(row.replace("np.float64(", "").replace(")", "") for row in rows))
    model = bf.read(mass=tmp_path / "M.mtx", damping=tmp_path / "C.mtx", stiffness=tmp_path / "K.mtx")
    same(model, beam)
    assert model.dofs[0] == "1.uy"


def test_calculix_files(beam, tmp_path):
    for ending, matrix in zip((".mas", ".dam", ".sti"), beam, strict=False):
        rows = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}" for i in range(6) for j in range(i, 6) if matrix[i, j]]
        (tmp_path / f"beam{ending}").write_text("\n".join(rows))
    (tmp_path / "beam.dof").write_text("1.2\n1.6\n2.2\n2.6\n3.2\n3.6\n")
    model = bf.read(mass=tmp_path / "beam.mas", damping=tmp_path / "beam.dam", stiffness=tmp_path / "beam.sti")
    same(model, beam)
    assert model.dofs[-1] == "3.rz"


def test_rotors_by_their_face():
    M, K = np.diag([2.0, 2.0, 0.1, 0.1]), np.diag([5.0, 6.0, 1.0, 1.0])
    K[0, 1], K[1, 0] = 0.3, -0.3  # of a bearing
    G = np.zeros((4, 4))
    G[2, 3], G[3, 2] = 0.2, -0.2
    rotor = types.SimpleNamespace(M=lambda w: M, K=lambda w: K, C=lambda w: 0.1 * w * np.eye(4), G=lambda: G, number_dof=4)
    model = bf.from_ross(rotor, 3.0)
    assert np.array_equal(model.M, M) and np.array_equal(model.K, K) and np.array_equal(model.C, 0.1 * 3.0 * np.eye(4))
    assert np.array_equal(model.G, 3.0 * G)
    assert model.dofs == ("0.x", "0.y", "0.alpha", "0.beta")
    assert np.array_equal(model.system().damping, 0.1 * 3.0 * np.eye(4) + 3.0 * G)


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "x.txt").write_text("hello")
    with pytest.raises(ValueError, match="ending that is not known"):
        bf.read(tmp_path / "x.txt")
    with pytest.raises(FileNotFoundError, match="no file"):
        bf.read(tmp_path / "y.mat")
    with pytest.raises(ValueError, match="no Matrix Market, Abaqus or CalculiX matrix"):
        bf.read(mass=tmp_path / "x.txt", stiffness=tmp_path / "x.txt")
    with pytest.raises(ValueError, match=r"read\(path\)"):
        bf.read()
