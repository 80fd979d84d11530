"""Files written out by hand, number by number: what a reader takes from them, and the words with which it refuses others."""

import tracemalloc
import types

import numpy as np
import pytest
from scipy.io import mmwrite, savemat

import bifurc as bf
from bifurc.models import reading

M = np.array([[2.0, 0.25, 0.0], [0.25, 3.0, 0.5], [0.0, 0.5, 5.0]])
K = np.array([[70.0, -11.0, 0.0], [-11.0, 60.0, -13.0], [0.0, -13.0, 50.0]])


def text(path, *lines):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("letter", "words"),
    [
        ("M", "M mass MAA mgg mff mxx mhh mred m2gg"),
        ("K", "K Stiffness kaa kgg kff kxx khh kred k2gg"),
        ("C", "C d damping baa bgg bff bxx b b2gg b2pp cred"),
        ("G", "G gyroscopic gyro"),
    ],
)
def test_names_by_which_a_matrix_is_known(letter, words):
    for word in words.split():
        assert list(reading.sort_out({"other": M, word: K, "n": 3.0, "m": np.ones(3)}, "x")) == [letter]


def test_content_without_a_matrix():
    for content, held in (({}, "nothing"), ({"x": M, "M": np.ones(3)}, "'x', 'M'"), ({"k": 2.0}, "'k'")):
        with pytest.raises(ValueError) as refused:
            reading.sort_out(content, "file")
        assert str(refused.value) == (
            f"read: file holds {held}; none is a matrix with a known name (mass, stiffness, d, gyroscopic)"
        )
    with pytest.raises(ValueError) as refused:
        reading.sort_out({"K": K, "y": 1, "kaa": K}, "file")
    assert str(refused.value) == "read: file has both 'K' and 'kaa'; write the one you mean to a file of its own"


def test_all_four_matrices_arrive_where_they_belong(tmp_path):
    C, G = 0.01 * K, np.array([[0.0, 1.5, 0.0], [-1.5, 0.0, 2.5], [0.0, -2.5, 0.0]])
    np.savez(tmp_path / "a.npz", g=G, k=K, d=C, mass=M, dofs=np.array(["a", "b", "c"]))
    savemat(tmp_path / "a.mat", {"g": G, "k": K, "d": C, "mass": M})
    for name, value in (("m", M), ("c", C), ("k", K), ("g", G)):
        np.save(tmp_path / f"{name}.npy", value)
    found = [
        bf.read(tmp_path / "a.npz"),
        bf.read(tmp_path / "a.mat"),
        bf.read(mass=tmp_path / "m.npy", damping=tmp_path / "c.npy", stiffness=tmp_path / "k.npy", gyroscopic=tmp_path / "g.npy"),
    ]
    for model, source, dofs in zip(found, ("a.npz", "a.mat", "m.npy"), (("a", "b", "c"), None, None), strict=True):
        for got, want in ((model.M, M), (model.C, C), (model.K, K), (model.G, G)):
            assert np.array_equal(got, want)
        assert model.source == str(tmp_path / source) and repr(model) == f"Model({model.source}: {model.structure.report})"
        assert model.dofs == dofs and model.structure.dofs == dofs
    assert bf.read(tmp_path / "a.npz", dofs=["x", "y", "z"]).dofs == ("x", "y", "z")
    np.savez(tmp_path / "counted.npz", M=M, K=K, dofs=np.array([4, 5, 12]))
    assert bf.read(tmp_path / "counted.npz").dofs == ("4", "5", "12")
    assert reading.read_all(tmp_path / "counted.npz")[1] == ["4", "5", "12"]
    bare = bf.read(mass=tmp_path / "m.npy", stiffness=tmp_path / "k.npy")
    assert not bare.C.any() and not bare.G.any()
    np.save(tmp_path / "turning.npy", K + G)
    with pytest.raises(ValueError, match="symmetric"):
        bf.read(mass=tmp_path / "m.npy", stiffness=tmp_path / "turning.npy")
    model = bf.read(mass=tmp_path / "m.npy", stiffness=tmp_path / "turning.npy", symmetric=False)
    assert np.allclose(model.K, K + G)


def test_abaqus_lines(tmp_path):
    path = text(
        tmp_path / "k.mtx",
        "** a comment",
        " *MATRIX, TYPE=STIFFNESS",
        "20,1,20,1, 70.",
        "",
        "3,6,20,1,-11.D0",
        "3,6,3,6,6d1",
        "3,6,20,7,-13.",
        "20,7,20,7,50.,",
    )
    matrix, names = reading.read_matrix(path)
    assert names == ["3.rz", "20.ux", "20.7"]
    assert np.array_equal(matrix, [[60.0, -11.0, -13.0], [-11.0, 70.0, 0.0], [-13.0, 0.0, 50.0]])
    both, _ = reading.read_matrix(text(tmp_path / "full.mtx", "1,1,1,1,2.", "1,1,1,2,3.", "1,2,1,1,4.", "1,2,1,2,5."))
    assert np.array_equal(both, [[2.0, 3.0], [4.0, 5.0]])  # both triangles: as written
    short = text(tmp_path / "short.mtx", "*MATRIX", "1,1,1,2.")
    with pytest.raises(ValueError) as refused:
        reading.read_matrix(short)
    assert str(refused.value) == f"read: {short}: line '1,1,1,2.' is not 'node,dof,node,dof,value'"


def test_calculix_lines(tmp_path):
    path = text(tmp_path / "a.sti", "1 1 70.", "2 1 -11.", "2 2 60.", "3 2 -13.")
    matrix, names = reading.read_matrix(path)
    assert names is None and np.array_equal(matrix, [[70.0, -11.0, 0.0], [-11.0, 60.0, -13.0], [0.0, -13.0, 0.0]])
    text(tmp_path / "a.dof", "4.1", "4.6", "7.2", "7.3")
    matrix, names = reading.read_matrix(path)
    assert names == ["4.ux", "4.rz", "7.uy", "7.uz"] and matrix.shape == (4, 4) and not matrix[3].any()
    assert np.array_equal(reading.read_matrix(text(tmp_path / "b.mas", "1 1 2."))[0], [[2.0]])
    bad = text(tmp_path / "b.dam", "1 2")
    with pytest.raises(ValueError) as refused:
        reading.read_matrix(bad)
    assert str(refused.value) == f"read: {bad} has 2 numbers a line; a CalculiX matrix has row, column, value"


def test_files_of_another_kind(tmp_path):
    path = text(tmp_path / "a.txt", "µ and ü: " + 60 * "x")
    with pytest.raises(ValueError) as refused:
        reading.read_matrix(path)
    assert str(refused.value) == (
        f"read: {path} is no Matrix Market, Abaqus or CalculiX matrix (it begins with {('µ and ü: ' + 60 * 'x')[:40]!r})"
    )
    path.write_bytes(b"\xff\xfe rest\n")  # no text at all
    with pytest.raises(ValueError, match="is no Matrix Market, Abaqus or CalculiX matrix"):
        reading.read_matrix(path)
    for reader in (reading.read_matrix, reading.read_all):
        with pytest.raises(FileNotFoundError) as missing:
            reader(tmp_path / "no.npy")
        assert str(missing.value) == f"read: there is no file {tmp_path / 'no.npy'}"
    for ending, hint in ((".mtx", "; a file with one matrix is read with mass=, stiffness=, damping="), (".txt", "")):
        other = text(tmp_path / f"one{ending}", "x")
        with pytest.raises(ValueError) as refused:
            reading.read_all(other)
        assert str(refused.value) == (
            f"read: {other} has an ending that is not known; files with all matrices end in .mat, .npz, "
            f".op4, .bdf, .dat, .pch, .dmig{hint}"
        )
    for arguments in ({}, {"path": path, "mass": path}):
        with pytest.raises(ValueError, match=r"write read\(path\) for a file with all matrices, or read\(mass="):
            bf.read(**arguments)
    for content, words in (
        ({"M": M}, "has no stiffness matrix; it holds M"),
        ({"c": K, "k": K}, "has no mass matrix; it holds C, K"),
    ):
        np.savez(tmp_path / "some.npz", **content)
        with pytest.raises(ValueError) as refused:
            bf.read(tmp_path / "some.npz")
        assert str(refused.value) == f"read: {tmp_path / 'some.npz'} {words}"


def test_names_of_files_that_are_read_together(tmp_path):
    a, b = ["a", "b"], ["b", "a"]
    assert reading._same_names(None, None, "x") is None
    assert (
        reading._same_names(a, None, "x") == a
        and reading._same_names(None, b, "x") == b
        and reading._same_names(a, list(a), "x") == a
    )
    with pytest.raises(ValueError) as refused:
        reading._same_names(a, ["a", "b", "c"], "x")
    assert str(refused.value) == (
        "read: x has other degrees of freedom than the file before it (3 and 2); write all matrices with the same ones"
    )
    assert reading._same_names(("a", "b"), a, "x") == ("a", "b") and reading._same_names(a, ("a", "b"), "x") == a
    with pytest.raises(ValueError, match="other degrees of freedom"):
        reading._same_names(a, b, "x")
    mass = text(tmp_path / "m.mas", "1 1 2.", "2 2 3.")
    text(tmp_path / "m.dof", "1.1", "1.2")
    mmwrite(tmp_path / "k.mtx", np.diag([5.0, 7.0]))  # without names
    model = bf.read(mass=mass, stiffness=tmp_path / "k.mtx")
    assert model.dofs == ("1.ux", "1.uy") and np.array_equal(model.K, np.diag([5.0, 7.0]))
    assert bf.read(mass=tmp_path / "k.mtx", stiffness=mass).dofs == ("1.ux", "1.uy")
    with pytest.raises(ValueError, match="m.mas has other degrees"):
        bf.read(mass=text(tmp_path / "m.mtx", "3,1,3,1,2.", "3,2,3,2,3."), stiffness=mass)


@pytest.mark.parametrize(
    ("count", "n", "names"),
    [
        (4, 8, [f"{node}.{way}" for node in (0, 1) for way in ("x", "y", "alpha", "beta")]),
        (6, 6, [f"0.{way}" for way in ("x", "y", "z", "alpha", "beta", "theta")]),
        (4, 6, None),
        (5, 5, None),
        (None, 4, 4),
    ],
)
def test_rotors_of_any_size(count, n, names):
    ground = np.random.default_rng(n).standard_normal((n, n))
    mass, turn, bearing = ground @ ground.T + n * np.eye(n), ground - ground.T, 40.0 * np.eye(n) + ground
    rotor = types.SimpleNamespace(
        M=lambda w: mass * (1.0 + w),
        K=lambda w: bearing * (2.0 + w),
        C=lambda w: (3.0 + w) * np.eye(n),
        G=lambda: turn.tolist(),
        **({} if count is None else {"number_dof": count}),
    )
    model = bf.from_ross(rotor, speed=2.5)
    if names == 4:
        names = ["0.x", "0.y", "0.alpha", "0.beta"]
    assert model.dofs == (None if names is None else tuple(names)) and model.source == "rotor at 2.5 rad/time"
    assert np.allclose(model.M, 3.5 * mass) and np.allclose(model.K, 4.5 * bearing)
    assert np.allclose(model.C + model.G, 5.5 * np.eye(n) + 2.5 * turn)
    for speed in (np.nan, np.inf):
        with pytest.raises(ValueError) as refused:
            bf.from_ross(rotor, speed)
        assert str(refused.value) == f"from_ross: speed = {speed!r} is not allowed; it must be a finite number"


BAD = {
    "a.mat": [b"", b"MATLAB 5.0 MAT-file" + bytes(300), b"\xff" * 200],
    "a.npz": [b"", b"PK\x03\x04" + bytes(50), b"\x93NUMPY\x01\x00", b"\x80\x04N."],
    "a.npy": [b"", b"\x93NUMPY\x01\x00\xff\xff{", b"\x80\x04N.", b"\x93NUMPY\x01\x00\x10\x00" + b"{'descr': '<f8'}",
              b"\x93NUMPY\x01\x00\x46\x00" + b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }\n"],
    "a.mtx": [b"%%MatrixMarket matrix array real general\nx y\n", b"%%MatrixMarket matrix coordinate real general\n2 2 9\n1 1 1\n",
              b"%%MatrixMarket nothing\n", b"1,1,1,1,x\n", b"1,1,1\n", b"1,1,1,1,\xff\n", b"*MATRIX\n", b""],
    "a.sti": [b"", b"1 2\n", b"1 1 x\n", b"0 0 nan\n1 2 inf\n"],
}


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("name", "content"), [(name, content) for name, bad in BAD.items() for content in bad])
def test_whatever_cannot_be_read_names_the_file(tmp_path, name, content):
    """And never the option of numpy that would run what the file says."""
    path, good = tmp_path / name, tmp_path / "good.npy"
    path.write_bytes(content)
    np.save(good, M)
    single = name not in ("a.mat", "a.npz")
    with pytest.raises(ValueError) as refused:
        bf.read(mass=path, stiffness=good) if single else bf.read(path)
    said = str(refused.value)
    assert said.startswith("read: ") and str(path) in said and "pickle" not in said and refused.value.__class__ is ValueError
    assert "\n" not in said


def test_matrices_that_are_none_name_their_files(tmp_path):
    """What the checker of matrices says of them, and what a file holds that is no number."""
    np.savez(tmp_path / "some.npz", M=M, K=np.diag([1.0, np.nan, 2.0]))
    np.savez(tmp_path / "objects.npz", M=np.array([[{}]], dtype=object), K=K)
    np.save(tmp_path / "objects.npy", np.array([[{}]], dtype=object))
    np.save(tmp_path / "small.npy", np.eye(2))
    np.save(tmp_path / "good.npy", M)
    for read, words in ((lambda: bf.read(tmp_path / "some.npz"), ["some.npz", "K"]),
                        (lambda: bf.read(tmp_path / "objects.npz"), ["objects.npz holds Python objects"]),
                        (lambda: bf.read(mass=tmp_path / "objects.npy", stiffness=tmp_path / "good.npy"),
                         ["objects.npy holds Python"]),
                        (lambda: bf.read(mass=tmp_path / "good.npy", stiffness=tmp_path / "small.npy"), ["small.npy", "shape"])):
        with pytest.raises(ValueError) as refused:
            read()
        assert all(word in str(refused.value) for word in words) and "allow_pickle" not in str(refused.value)
        assert refused.value.__suppress_context__ or "objects" not in str(refused.value)


def test_of_a_foreign_archive_only_matrices_are_unpacked(tmp_path):
    """A hundred megabytes of zeros beside them, and a pickle, are left packed."""
    path = tmp_path / "some.npz"
    np.savez_compressed(path, M=M, K=K, bomb=np.zeros(12_500_000), evil=np.array([{}], dtype=object))
    tracemalloc.start()
    try:
        assert np.array_equal(bf.read(path).M, M) and tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()
    np.savez_compressed(path, M=np.zeros((4200, 4200)))
    with pytest.raises(ValueError, match=r"some\.npz cannot be read: its \d+ bytes cannot hold 141120128"):
        bf.read(path)
