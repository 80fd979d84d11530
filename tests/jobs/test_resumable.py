"""Files of long jobs: nothing foreign is replaced, two processes with one folder both end well, one bad value fails alone."""
import os

import numpy as np
import pytest

import bifurc as bf
from bifurc import io
from bifurc.jobs.resumable import resumable
from bifurc.jobs.store import ChunkStore
from tests.basins.work import JOB

A = bf.systems.impact_oscillator(omega=1.4)
REGION = {"q0": (-1.0, 0.5), "v0": (-1.0, 1.0)}


class Made:
    """A result of the kind "made"."""

    def __init__(self, number):
        self.number = number

    def save(self, path):
        io.write(path, {"kind": "made", "key": self.key}, {"number": np.array(self.number)})


def job(file, number=3, kind="made", **options):
    def compute(store, key):
        made = Made(number)
        made.key = key
        return made

    return resumable(kind, file, {**JOB, "number": number}, lambda header, arrays: int(arrays["number"]), compute, **options)


def test_a_finished_result_is_read_and_that_of_another_job_replaced(tmp_path):
    file = tmp_path / "made.npz"
    assert job(file).number == 3 and job(file) == 3
    assert job(file, 4).number == 4 and job(file, 4) == 4
    assert [item.name for item in tmp_path.iterdir()] == ["made.npz"]


def test_what_only_the_result_depends_on_is_in_its_key_and_not_in_that_of_its_chunks(tmp_path):
    """A wider range of values is another result, made of the same chunks: the old one must not be handed out for it."""
    file, stores = tmp_path / "made.npz", []

    def made_of(values):
        def compute(store, key):
            stores.append(store.key)
            made = Made(len(values))
            made.key = key
            return made
        return resumable("made", file, JOB, lambda header, arrays: int(arrays["number"]), compute, part={"values": values})

    assert made_of(np.arange(3.0)).number == 3 and made_of(np.arange(3.0)) == 3
    assert made_of(np.arange(4.0)).number == 4 and made_of(np.arange(4.0)) == 4
    assert made_of(np.arange(4.0)[::-1]).number == 4
    assert len(stores) == 3 and len(set(stores)) == 1


def test_nothing_foreign_is_replaced(tmp_path):
    """A text, a foreign npz, another kind of result, a cut result, a folder, a device: each is left alone."""
    text, foreign, other, cut, folder = (tmp_path / name for name in ("thesis.txt", "own.npz", "other.npz", "cut.npz", "folder"))
    text.write_text("three years of work")
    np.savez(foreign, x=np.arange(3))
    io.write(other, {"kind": "branch"}, {"x": np.arange(3)})
    job(cut)
    cut.write_bytes(cut.read_bytes()[:-30])
    folder.mkdir()
    for file in (text, foreign, other, cut, folder, "/dev/null"):
        before = None if os.path.isdir(file) or file == "/dev/null" else file.read_bytes()
        with pytest.raises(FileExistsError, match="left alone"):
            job(file)
        assert before is None or file.read_bytes() == before
        assert not os.path.exists(f"{file}.chunks")
    with pytest.raises(FileExistsError, match="not a bifurc result"):
        io.write(text, {"kind": "branch"}, {})
    for file in (3, "", b""):
        with pytest.raises(ValueError, match="it must be a path"):
            job(file)


def test_what_comes_into_the_place_of_a_result_meanwhile_is_left_alone(tmp_path):
    file = tmp_path / "made.npz"

    def compute(store, key):
        file.write_text("somebody else's")
        return Made(3)

    with pytest.raises(FileExistsError):
        resumable("made", file, JOB, None, compute)
    assert file.read_text() == "somebody else's"


FOREIGN = {"a text under the name of a chunk": lambda path, name: (path / name).write_text("thesis"),
           "another npz": lambda path, name: np.savez(path / name, x=1),
           "another result": lambda path, name: io.write(path / name, {"kind": "branch"}, {"x": np.zeros(2)}),
           "a hidden draft": lambda path, name: (path / ".draft.tmp").write_text("thesis"),
           "a list of one's own": lambda path, name: (path / "manifest.json").write_text('{"files": []}'),
           "a text called a list": lambda path, name: (path / "manifest.json").write_bytes(b"\xff"),
           "a file beside": lambda path, name: np.savez(path / "mine.npz", x=1),
           "a pipe": lambda path, name: os.mkfifo(path / name),
           "a link": lambda path, name: (path / name).symlink_to(path.parent / "thesis.txt"),
           "a folder": lambda path, name: (path / name).mkdir()}


@pytest.mark.parametrize("what", FOREIGN)
def test_only_what_a_job_wrote_is_taken_away_or_replaced(tmp_path, what):
    """Its content tells, not its name: the folder is left with the one thing that was in it before, as it was."""
    def compute(store, key):
        assert store.load(name) is None
        store.save(name, {"k": 1}, {"x": np.arange(3)})
        store.save(store.name({"k": 2}), {"k": 2}, {"x": np.arange(3)})
        (store.folder / ".killed.tmp").write_bytes((store.folder / store.name({"k": 2})).read_bytes()[:70])
        (store.folder / store.name({"k": 3})).write_bytes(b"")  # of a writer that the machine's death stopped
        store.manifest([name], {}, 1)
        made = Made(3)
        made.key = key
        return made

    def seen():
        return {path.name: path.read_bytes() if path.is_file() else path.stat().st_mode for path in folder.iterdir()}

    (tmp_path / "thesis.txt").write_text("three years of work")
    folder = tmp_path / "made.npz.chunks"
    folder.mkdir()
    name = ChunkStore(folder, JOB).name({"k": 1})
    FOREIGN[what](folder, name)
    before = seen()
    resumable("made", tmp_path / "made.npz", JOB, None, compute)
    assert seen() == before and len(before) == 1
    assert (tmp_path / "thesis.txt").read_text() == "three years of work" and (tmp_path / "made.npz").is_file()


def test_a_cut_archive_of_somebody_else_is_no_result_of_ours(tmp_path):
    """Beside the chunks of a job, too: it begins as every zip file does, and not as a result."""
    file = tmp_path / "made.npz"
    (tmp_path / "made.npz.chunks").mkdir()
    np.savez(file, x=np.arange(100))
    for whole in (file.read_bytes()[:300], b""):
        file.write_bytes(whole)
        with pytest.raises(FileExistsError, match="left alone"):
            job(file)
        assert file.read_bytes() == whole
    file.unlink()
    job(file)
    (tmp_path / "made.npz.chunks").mkdir()
    file.write_bytes(file.read_bytes()[:-30])
    assert job(file).number == 3


def test_two_writers_of_one_job_end_well(tmp_path, monkeypatch):
    """One finishes and takes the folder away, twice, while the other writes its chunk, and while it puts the result into place."""
    mine, other = (ChunkStore(tmp_path / "made.npz.chunks", JOB) for _ in range(2))
    write, left = io.write, [2]

    def cleared(path, *args, **options):
        with open(path.with_name(".half.tmp"), "wb") as file:
            file.write(b"PK")
        if left[0]:
            left[0] -= 1
            other.clear()
            assert not mine.folder.exists()
        return write(path, *args, **options)

    monkeypatch.setattr(io, "write", cleared)
    name = mine.name({"k": 1})
    mine.save(name, {"k": 1}, {"x": np.arange(3)})
    assert left == [0] and mine.load(name)[0] == {"k": 1}
    left[0], made = 2, Made(3)
    made.key = mine.key
    mine.publish(made, tmp_path / "made.npz")
    assert left == [0] and [item.name for item in tmp_path.iterdir()] == ["made.npz"]


def test_one_invalid_value_fails_alone():
    """restitution above 1 is no system: its neighbours in the chunk are computed all the same."""
    found = bf.sweep(A, "restitution", [0.8, 0.9, 1.0, 1.1], REGION, samples=20, chunk=4)
    assert list(found.failures) == [3] and "restitution" in found.failures[3]
    assert found.starts.tolist() == [20, 20, 20, 0]
    chart = bf.parameter_chart(A, {"omega": [1.4, 1.5], "restitution": [0.9, 1.1]}, REGION, starts=2, transient=20, longest=2)
    assert sorted(chart.failures) == [1, 3] and (chart.settled[:, 0] == 2).all() and (chart.periods[:, 1] == -1).all()
    with pytest.raises(ValueError, match="restitution"):
        bf.bifurcation_diagram(A, "restitution", [0.9, 1.1])


@pytest.mark.parametrize("call", [
    lambda **o: bf.sweep(A, "omega", [1.4], REGION, **o), lambda **o: bf.bifurcation_diagram(A, "omega", [1.4], **o),
    lambda **o: bf.parameter_chart(A, {"omega": [1.4], "gap": [1.0]}, REGION, **o),
    lambda **o: bf.basins_of_attraction(A, bf.Grid(q0=(-1, 0, 4), v0=(-1, 1, 4)), **o),
    lambda **o: bf.cell_mapping(A, bf.Grid(q0=(-1, 0, 4), v0=(-1, 1, 4)), **o)])
def test_workers_executors_and_files_are_checked_everywhere(call, tmp_path):
    for workers in (0, -1, 1.5, True, "two"):
        with pytest.raises(ValueError, match="workers = .* is not allowed"):
            call(workers=workers)
    with pytest.raises(ValueError, match="executor = .* is not allowed"):
        call(executor=3)
    with pytest.raises(FileExistsError, match="left alone"):
        call(file="/dev/null")
