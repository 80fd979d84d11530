"""Files: written and read back bit for bit; a broken write leaves nothing; foreign or damaged files are named."""
import enum
import json
import multiprocessing
import os
import socket
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import bifurc as bf
from bifurc import cli, io


class Kind(enum.StrEnum):
    FOLD = "fold"


ARRAYS = {
    "float": np.array([0.1, np.nan, -np.inf, 5e-324, -0.0]),
    "complex": np.array([[1 + 2j], [np.pi - 1e-300j]]),
    "labels": np.arange(-6, 6, dtype=np.int32).reshape(3, 4),
    "flags": np.array([True, False]),
    "names": np.array(["impact", "grazing, ü"]),
    "empty": np.zeros((0, 3)),
    "scalar": np.float64(0.1),
}


def test_arrays_come_back_bit_for_bit(tmp_path):
    path = io.write(tmp_path / "x.npz", {"kind": "branch"}, ARRAYS)
    _, arrays = io.read(path)
    assert list(arrays) == list(ARRAYS)
    for name, values in ARRAYS.items():
        assert arrays[name].dtype == np.asarray(values).dtype
        assert arrays[name].shape == np.shape(values)
        assert arrays[name].tobytes() == np.asarray(values).tobytes()


def test_header_comes_back_with_format_and_version(tmp_path):
    header = {"kind": "branch", "bounds": (0.5, np.float64(2.0)), "n": np.int64(3), "point": Kind.FOLD, "x": 0.1 + 0.2,
              "text": "ζ", "matrix": np.eye(2), "nothing": None, "ok": np.bool_(True)}
    path = io.write(tmp_path / "x.npz", header, {})
    back, arrays = io.read(path, kind="branch")
    assert arrays == {}
    assert back == {"kind": "branch", "bounds": [0.5, 2.0], "n": 3, "point": "fold", "x": 0.1 + 0.2, "text": "ζ",
                    "matrix": [[1.0, 0.0], [0.0, 1.0]], "nothing": None, "ok": True, "format": "bifurc", "version": 1}
    assert "format" not in header  # inputs are not mutated


def test_same_record_gives_same_bytes(tmp_path):
    for name in ("a.npz", "b.npz"):
        io.write(tmp_path / name, {"kind": "branch"}, ARRAYS)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_file_has_the_permissions_of_an_ordinary_file(tmp_path):
    (tmp_path / "plain").write_text("")
    path = io.write(tmp_path / "x.npz", {"kind": "branch"}, {})
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize(
    ("header", "arrays", "error", "said"),
    [
        ({}, {}, ValueError, "kind"),
        ({"kind": "x", "value": float("nan")}, {}, ValueError, "JSON"),
        ({"kind": "x", "value": object()}, {}, TypeError, "object"),
        ({"kind": "x", "value": 1j}, {}, TypeError, "complex"),
        ({"kind": "x"}, {"bad": np.array([object()])}, TypeError, "'bad'"),
        ({"kind": "x"}, {"a/b": np.zeros(1)}, ValueError, "'a/b'"),
        ({"kind": "x"}, {"__header__": np.zeros(1)}, ValueError, "__header__"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_the_old_file(tmp_path, header, arrays, error, said):
    path = io.write(tmp_path / "x.npz", {"kind": "old"}, {})
    with pytest.raises(error, match=said):
        io.write(path, header, arrays)
    assert io.read(path)[0]["kind"] == "old"
    assert os.listdir(tmp_path) == ["x.npz"]


def test_a_write_that_fails_half_way_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    path = io.write(tmp_path / "x.npz", {"kind": "old"}, ARRAYS)

    def disk_full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", disk_full)
    with pytest.raises(OSError, match="No space"):
        io.write(path, {"kind": "new"}, ARRAYS)
    assert io.read(path)[0]["kind"] == "old"
    assert os.listdir(tmp_path) == ["x.npz"]


def test_missing_file_and_missing_folder(tmp_path):
    with pytest.raises(FileNotFoundError):
        io.read(tmp_path / "none.npz")
    with pytest.raises(FileNotFoundError, match="there is no such folder: '.*none'"):
        io.write(tmp_path / "none" / "x.npz", {"kind": "x"}, {})


def test_foreign_files_are_named(tmp_path):
    text, empty, other, archive = (tmp_path / name for name in ("a.txt", "empty", "other.npz", "b.zip"))
    text.write_text("omega,x\n1,2\n")
    empty.write_bytes(b"")
    np.savez(other, x=np.zeros(3))
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("readme", "hello")
    for path in (text, empty, other, archive):
        with pytest.raises(io.FileFormatError, match="is not a bifurc result"):
            io.read(path)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ({"format": "other", "version": 1, "kind": "x"}, "another format"),
        ({"format": "bifurc", "version": 2, "kind": "x"}, "update bifurc"),
        ({"format": "bifurc", "version": "1", "kind": "x"}, "layout version"),
        ({"format": "bifurc", "version": True, "kind": "x"}, "layout version"),
        ({"format": "bifurc", "version": 1, "kind": "y", "arrays": {}}, "expected a 'x'"),
        ({"format": "bifurc", "version": 1, "arrays": {}}, "its header has no 'kind'"),
        ({"format": "bifurc", "version": 1, "kind": ["x"], "arrays": {}}, "its header has no 'kind'"),
        ({"format": "bifurc", "version": 1, "kind": "x"}, "its header has no table 'arrays' of their types, shapes and checksums"),
        ({"format": "bifurc", "version": 1, "kind": "x", "arrays": []}, "its header has no table 'arrays'"),
        ([1], "another format"),
    ],
)
def test_headers_are_checked(tmp_path, header, said):
    path = tmp_path / "x.npz"
    np.savez(path, __header__=np.frombuffer(json.dumps(header).encode(), np.uint8))
    with pytest.raises(io.FileFormatError, match=said):
        io.read(path, kind="x")


def test_every_cut_and_every_flipped_byte_is_an_error_or_harmless(tmp_path, rng):
    path = io.write(tmp_path / "x.npz", {"kind": "branch"}, {"a": np.arange(50.0), "b": np.ones(3, int)})
    whole = path.read_bytes()
    broken = tmp_path / "broken.npz"
    for cut in rng.integers(0, len(whole), 40):
        broken.write_bytes(whole[:cut])
        with pytest.raises(io.FileFormatError):
            io.read(broken)
    for place in rng.integers(0, len(whole), 200):
        changed = bytearray(whole)
        changed[place] ^= 1 << rng.integers(0, 8)
        broken.write_bytes(changed)
        try:  # a changed time stamp or name attribute of the archive does no harm; a changed number never passes
            _, arrays = io.read(broken)
        except io.FileFormatError:
            continue
        for values, true in zip(arrays.values(), (np.arange(50.0), np.ones(3, int)), strict=False):
            np.testing.assert_array_equal(values, true)


def test_pickles_are_never_opened(tmp_path):
    path = tmp_path / "x.npz"
    for told in (["|O", [1], 0], ["<f8", [1], 0]):
        text = json.dumps({"format": "bifurc", "version": 1, "kind": "x", "arrays": {"evil": told}})
        np.savez(path, __header__=np.frombuffer(text.encode(), np.uint8), evil=np.array([{"a": 1}], dtype=object))
        with pytest.raises(io.FileFormatError, match="array 'evil'") as refused:
            io.read(path)
        assert "allow_pickle" not in str(refused.value)


def other_than_files(folder):
    """Yield what is called like a file and is none, with the word for it."""
    os.mkfifo(folder / "pipe.npz")
    yield folder / "pipe.npz", "a named pipe"
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(str(folder / "s"))
    yield folder / "s", "a socket"
    yield folder, "a folder"
    yield Path("/dev/zero"), "a device"
    (folder / "link.npz").symlink_to(folder / "pipe.npz")
    yield folder / "link.npz", "a named pipe"


def test_what_is_no_ordinary_file_is_never_opened(tmp_path, monkeypatch, capsys):
    """A pipe without a writer would wait for ever, a device has no end."""
    monkeypatch.chdir(tmp_path)
    for path, said in other_than_files(Path()):
        for load in (bf.load, io.read, io.header, bf.Branch.load):
            with pytest.raises(io.FileFormatError) as refused:
                load(path)
            assert str(refused.value) == f"{path} is {said}, not a bifurc result"
        for read in (lambda path=path: bf.read(path), lambda path=path: bf.read(mass=path, stiffness=path)):
            with pytest.raises(ValueError) as refused:
                read()
            assert str(refused.value) == f"read: {path} is {said}, not a file"
        with pytest.raises(FileExistsError, match=f"is {said}"):
            io.write(path, {"kind": "x"}, {})
        assert cli.main(["certify", str(path)]) == 2
        assert capsys.readouterr().err == f"bifurc: error: {path} is {said}, not a bifurc result\n"


def test_what_the_header_does_not_list_is_not_unpacked(tmp_path):
    """A hundred megabytes of zeros beside a result cost nothing; those that it lists, but not so many, are refused, and those that
    a file of this size cannot hold."""
    path = io.write(tmp_path / "x.npz", {"kind": "x"}, {"a": np.arange(5.0)})
    zeros = bytes(10**8)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as file:
        file.writestr("bomb.npy", zeros)
        file.writestr("dir/bomb", zeros)
    assert most_of(lambda: io.read(path))[0][1]["a"].tolist() == [0, 1, 2, 3, 4]
    assert most_of(lambda: io.read(path))[1] < 10**7
    for told in (["<f8", [5], 0], ["<f8", [12_500_000 - 16], 0], ["<f8", [10**9], 0], ["<f8", [10**18], 0], ["<f8", [-1], 0]):
        text = json.dumps({"format": "bifurc", "version": 1, "kind": "x", "arrays": {"bomb": told}})
        np.savez(path, __header__=np.frombuffer(text.encode(), np.uint8))
        with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as file:
            file.writestr("bomb.npy", zeros)
        refused, most = most_of(lambda: pytest.raises(io.FileFormatError, io.read, path))
        assert most < 10**7 and "x.npz is damaged (" in str(refused.value)


def most_of(call):
    """Return what a call returns, and the most bytes that it held."""
    tracemalloc.start()
    try:
        return call(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_what_is_packed_more_than_a_reader_unfolds_is_written_as_it_is(tmp_path):
    """Zeros pack a thousand times; what bifurc writes it reads."""
    few, many = np.zeros(10**6), np.zeros(2**24 + 10)
    path = io.write(tmp_path / "few.npz", {"kind": "x"}, {"a": few})
    assert path.stat().st_size < few.nbytes / 500 and np.array_equal(io.read(path)[1]["a"], few)
    path = io.write(tmp_path / "many.npz", {"kind": "x"}, {"a": many})
    assert path.stat().st_size > many.nbytes and np.array_equal(io.read(path)[1]["a"], many)
    text = "x" * (2**22 + 1)
    assert io.header(io.write(tmp_path / "text.npz", {"kind": "x", "text": text}, {}))["text"] == text


def test_encrypted_members_and_two_of_one_name_are_refused(tmp_path):
    path = io.write(tmp_path / "x.npz", {"kind": "x"}, {"a": np.arange(5.0)})
    whole = path.read_bytes()
    with zipfile.ZipFile(path) as file:
        members = [(info.filename, file.read(info)) for info in file.infolist()]
    with zipfile.ZipFile(path, "w") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, content in (*members, members[-1]):
            file.writestr(name, content)
    with pytest.raises(io.FileFormatError, match="two of its members have one name"):
        io.read(path)
    flagged = bytearray(whole)
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        flagged[whole.rindex(mark) + place] |= 1
    path.write_bytes(flagged)
    with pytest.raises(io.FileFormatError, match="encrypted"):
        io.read(path)
    for method in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        with zipfile.ZipFile(path, "w", method) as file:
            for name, content in members:
                file.writestr(name, content)
        with pytest.raises(io.FileFormatError, match="packed as it never is here"):
            io.read(path)


def test_only_a_result_of_the_kind_may_be_replaced(tmp_path):
    """Where a kind is asked for a result of another kind is as foreign as a text; where none is, any result may be replaced."""
    path, text = io.write(tmp_path / "x.npz", {"kind": "branch"}, {}), tmp_path / "thesis.txt"
    text.write_text("three years of work")
    io.replaceable(tmp_path / "none.npz", "basins")
    io.replaceable(path)
    io.replaceable(path, "branch")
    for file, said in ((path, "holds a 'branch', expected a 'basins'"), (text, "not a bifurc result"), (tmp_path, "is a folder")):
        with pytest.raises(FileExistsError, match=said):
            io.replaceable(file, "basins")


def _write_for_ever(path):
    values = np.random.default_rng(0).random(200_000)
    while True:
        io.write(path, {"kind": "branch"}, {"values": values})


def test_killed_writers_leave_whole_files(tmp_path):
    path = tmp_path / "x.npz"
    true = np.random.default_rng(0).random(200_000)
    context = multiprocessing.get_context("fork")
    for delay in (0.15, 0.21, 0.33):
        writer = context.Process(target=_write_for_ever, args=(path,))
        writer.start()
        writer.join(delay)
        writer.kill()
        writer.join()
        if path.exists():
            np.testing.assert_array_equal(io.read(path)[1]["values"], true)


def test_load_names_unknown_kinds(tmp_path):
    path = io.write(tmp_path / "x.npz", {"kind": "recipe"}, {})
    with pytest.raises(io.FileFormatError, match="'recipe'.*basins, branch.*orbit"):
        bf.load(path)


@pytest.mark.parametrize("name", ["system", "closure", "nodes", "unknowns"])
def test_a_record_that_lacks_something_is_told_with_its_file(tmp_path, name):
    path = tmp_path / "orbit.npz"
    bf.find_orbit(bf.systems.impact_oscillator(omega=0.6)).save(path)
    header, arrays = io.read(path)
    assert (name in header) + (name in arrays) == 1
    for wrong in ("missing", None, "x"):
        changed = {key: value for key, value in header.items() if key != name}
        fewer = {key: value for key, value in arrays.items() if key != name}
        if wrong != "missing" and name in header:
            changed[name] = wrong
        elif wrong == "x":
            fewer[name] = np.array(["x"])
        io.write(path, changed, fewer)
        with pytest.raises(io.FileFormatError, match=r"orbit\.npz holds a 'orbit' that cannot be read: .*\w"):
            bf.load(path)
