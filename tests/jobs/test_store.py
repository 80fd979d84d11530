"""Chunk files and executors: nothing finished is lost, nothing foreign or damaged is taken, a poison chunk is found."""
import json
import os
import subprocess
import sys
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from bifurc.jobs.executors import SerialExecutor, check_executor, run_chunks
from bifurc.jobs.store import MANIFEST, ChunkStore, code_hash, fingerprint
from tests.basins.work import JOB, payloads, squares


def spawned():
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def bits(outcome):
    return [None if item is None else fingerprint(list(item)) for item in outcome.results]


def test_any_executor_gives_the_same_bits(tmp_path):
    expected = bits(run_chunks(ChunkStore(None, JOB), squares, payloads(7), executor=SerialExecutor()))
    with ThreadPoolExecutor(3) as threads, spawned() as processes:
        for executor, workers in ((None, 1), (None, 2), (threads, None), (processes, None)):
            found = run_chunks(ChunkStore(None, JOB), squares, payloads(7), executor=executor, workers=workers)
            assert bits(found) == expected and not found.failures
    filed = run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(7))
    again = run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(7))
    assert bits(filed) == bits(again) == expected
    assert (filed.kept, filed.computed, again.kept, again.computed) == (0, 7, 7, 0)


def test_only_what_is_missing_or_unreadable_is_computed(tmp_path, rng):
    store = ChunkStore(tmp_path / "chunks", JOB)
    first = run_chunks(store, squares, payloads(6))
    names = [store.name(payload) for payload in payloads(6)]
    (store.folder / names[0]).unlink()
    content = bytearray((store.folder / names[1]).read_bytes())
    (store.folder / names[1]).write_bytes(content[:len(content) // 2])
    (store.folder / names[2]).write_bytes(b"")
    (store.folder / names[3]).write_bytes((store.folder / names[4]).read_bytes())  # another chunk under this name
    (store.folder / ".x.tmp").write_bytes(content[:100])  # left by a killed writer
    again = run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(6))
    assert (again.kept, again.computed) == (2, 4) and bits(again) == bits(first)
    store.clear()
    assert list(tmp_path.iterdir()) == []


def test_no_changed_byte_is_accepted(tmp_path, rng):
    """Every byte that is changed gives a chunk that is refused, or one whose content is the same."""
    store = ChunkStore(tmp_path / "chunks", JOB)
    expected = run_chunks(store, squares, payloads(1)).results[0]
    name = store.name(payloads(1)[0])
    whole = (store.folder / name).read_bytes()
    refused = 0
    for place in rng.choice(len(whole), 300, replace=False).tolist():
        broken = bytearray(whole)
        broken[place] ^= 1 << int(rng.integers(8))
        (store.folder / name).write_bytes(broken)
        found = store.load(name)
        refused += found is None
        assert found is None or fingerprint(list(found)) == fingerprint(list(expected))
    assert refused > 150  # the others lie in fields of the zip format that say nothing, such as dates


def test_what_is_filed_is_found_again_as_JSON_keeps_it(tmp_path):
    """Keys that are numbers become text, tuples lists: the content that a chunk vouches for is the one that is read."""
    store = ChunkStore(tmp_path / "chunks", JOB)
    store.save("0" * 32 + ".npz", {"counts": {10: 1.5, 9: 2}, "shape": (1, (2, 3))}, {"x": [1.0, 2.0]})
    meta, arrays = store.load("0" * 32 + ".npz")
    assert meta == {"counts": {"10": 1.5, "9": 2}, "shape": [1, [2, 3]]} and arrays["x"].tolist() == [1.0, 2.0]


def test_a_chunk_of_another_problem_is_refused(tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    run_chunks(store, squares, payloads(1))
    other = ChunkStore(tmp_path / "chunks", {**JOB, "problem": "cubes"})
    name, foreign = other.name(payloads(1)[0]), store.name(payloads(1)[0])
    assert name != foreign and other.load(name) is None
    os.rename(store.folder / foreign, store.folder / name)
    assert other.load(name) is None


def test_names_depend_on_everything_that_matters():
    store = ChunkStore(None, JOB)
    payload = {"number": 1, "starts": np.zeros(3), "elements": (ChunkStore,)}
    names = {store.name(p) for p in (payload, {**payload, "number": 2}, {**payload, "starts": np.zeros(4)},
                                     {**payload, "starts": np.full(3, -0.0)}, {**payload, "elements": (Path,)})}
    assert len(names) == 5
    assert store.name(dict(reversed(payload.items()))) == store.name(payload)
    assert len(code_hash()) == 16
    assert fingerprint([1, 2]) != fingerprint([12]) != fingerprint([1, [2]])


def test_a_chunk_that_raises_is_reported_and_the_others_finish(tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    found = run_chunks(store, squares, payloads(5, at2={"fails": True}))
    assert found.failures == {2: "ValueError: no square of 2"}
    assert [item is None for item in found.results] == [False, False, True, False, False]
    manifest = json.loads((store.folder / MANIFEST).read_text())
    assert len(manifest["finished"]) == 4 and list(manifest["failed"].values()) == ["ValueError: no square of 2"]
    again = run_chunks(store, squares, payloads(5, at2={"fails": True}))
    assert (again.kept, again.computed, again.failures) == (4, 0, found.failures)


def test_a_chunk_that_kills_its_worker_is_found_and_the_others_finish(tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    found = run_chunks(store, squares, payloads(6, at3={"dies": True}), executor=spawned)
    assert list(found.failures) == [3] and "its worker died" in found.failures[3]
    assert [item is None for item in found.results] == [i == 3 for i in range(6)]


@pytest.mark.parametrize(("name", "module"), [("KilledWorker", __name__), ("LostResult", "distributed.cfexecutor")])
def test_chunks_that_a_cluster_blames_wrongly_run_again_alone(tmp_path, name, module):
    """A dying worker of a cluster takes all with it that waited on it or had left their results: alone, the innocent finish."""
    error = type(name, (Exception,), {})

    class Cluster(SerialExecutor):
        seen = []
        __module__ = module

        def submit(self, work, payload):
            self.seen.append(payload["number"])
            future = Future()
            if payload["number"] == 2 or payload["number"] == 3 and self.seen.count(3) == 1:
                future.set_exception(error("died"))
            else:
                future.set_result(work(payload))
            return future

    found = run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(5), executor=Cluster())
    assert found.failures == {2: f"{name}: died"} and found.computed == 4
    assert sorted(Cluster.seen) == [0, 1, 2, 2, 3, 3, 4]


def test_a_given_pool_that_breaks_says_what_is_kept(tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    with pytest.raises(RuntimeError, match="chunks are finished and kept; make the same call with a new executor"):
        run_chunks(store, squares, payloads(6, at5={"dies": True}), executor=spawned())
    found = run_chunks(store, squares, payloads(5))
    assert found.kept + found.computed == 5


def test_a_closed_executor_and_something_else_are_named():
    closed = ThreadPoolExecutor(1)
    closed.shutdown()
    with pytest.raises(RuntimeError, match="takes no more work"):
        run_chunks(ChunkStore(None, JOB), squares, payloads(2), executor=closed)
    with pytest.raises(ValueError, match="executor = 4 is not allowed; it must be a concurrent.futures.Executor"):
        check_executor(4)


def test_an_interrupt_keeps_what_runs_and_a_second_call_goes_on(tmp_path):
    store, calls = ChunkStore(tmp_path / "chunks", JOB), []

    class Impatient(SerialExecutor):
        def submit(self, fn, /, *args, **kwargs):
            calls.append(1)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return super().submit(fn, *args, **kwargs)

    for _ in range(2):  # interrupted twice
        with pytest.raises(KeyboardInterrupt):
            calls.clear()
            run_chunks(store, squares, payloads(8), executor=Impatient())
    found = run_chunks(store, squares, payloads(8))
    assert (found.kept, found.computed) == (4, 4)


def test_a_folder_that_cannot_be_written_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OSError, match=r"chunk files cannot be written into .*; give a file in a folder that exists"):
        ChunkStore(tmp_path / "file" / "chunks", JOB)
    with pytest.raises(OSError, match="chunk files cannot be written"):
        ChunkStore(tmp_path / "missing" / "chunks", JOB)
    if os.geteuid():
        (tmp_path / "locked").mkdir(mode=0o555)
        with pytest.raises(OSError, match="chunk files cannot be written"):
            ChunkStore(tmp_path / "locked" / "chunks", JOB)


FULL = """
import resource, signal, sys
from bifurc.jobs.store import ChunkStore
from bifurc.jobs.executors import run_chunks
from tests.basins.work import JOB, payloads, squares
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
store = ChunkStore(sys.argv[1], JOB)
run_chunks(store, squares, payloads(3), workers=1)
resource.setrlimit(resource.RLIMIT_FSIZE, (200, 200))
try:
    run_chunks(store, squares, payloads(6), workers=1)
except OSError as error:
    print(error)
"""


def test_a_full_disk_keeps_what_is_finished(tmp_path):
    """The file size limit of the process stands for the disk: the write itself fails half way."""
    done = subprocess.run([sys.executable, "-c", FULL, str(tmp_path / "chunks")], capture_output=True, text=True, timeout=120,
                          cwd=Path(__file__).resolve().parents[2], check=True)
    assert "a chunk cannot be written" in done.stdout and "make room" in done.stdout
    assert not list((tmp_path / "chunks").glob("*.tmp"))
    found = run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(6))
    assert (found.kept, found.computed) == (3, 3)


def test_a_fingerprint_knows_the_shape():
    """The same bytes in other shapes, and in another type, are other arrays."""
    flat = np.arange(6.0)
    found = {fingerprint(flat), fingerprint(flat.reshape(2, 3)), fingerprint(flat.reshape(3, 2)), fingerprint(flat.view(np.int64))}
    assert len(found) == 4
    assert fingerprint(np.asfortranarray(flat.reshape(2, 3))) == fingerprint(flat.reshape(2, 3))
