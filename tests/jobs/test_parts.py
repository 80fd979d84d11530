"""Parts of long work one by one: what a bar is told, what is kept between chunks, who runs them, what a name depends on."""
import io
import json
import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc import io as files
from bifurc.jobs import executors, progress, resumable, store
from bifurc.jobs.executors import Kept, SerialExecutor, run_chunks, user_parts
from bifurc.jobs.store import ChunkStore, fingerprint, finished
from tests.basins.work import JOB, payloads, squares


class Bar:
    def __init__(self):
        self.seen = []

    def advance(self, amount, note=""):
        self.seen.append((amount, note))


def test_a_bar_is_told_what_comes_from_files_and_what_is_computed(tmp_path):
    run_chunks(ChunkStore(tmp_path / "c", JOB), squares, payloads(2), workers=1)
    bar = Bar()
    found = run_chunks(ChunkStore(tmp_path / "c", JOB), squares, payloads(4, at3={"fails": True}), workers=1, bar=bar,
                       weights=[1.0, 2.0, 4.0, 8.0], note="squares")
    assert bar.seen == [(3.0, "from files"), (4.0, "squares"), (8.0, "squares")]
    assert (found.kept, found.computed, list(found.failures)) == (2, 1, [3])
    plain = Bar()
    run_chunks(ChunkStore(None, JOB), squares, payloads(2), workers=1, bar=plain)
    assert plain.seen == [(1.0, ""), (1.0, "")]
    manifest = json.loads((tmp_path / "c" / store.MANIFEST).read_text())
    names = [ChunkStore(None, JOB).name(payload) for payload in payloads(4, at3={"fails": True})]
    assert manifest["total"] == 4 and manifest["finished"] == names[:3] and manifest["missing"] == names[3:]
    assert manifest["failed"] == {names[3]: "ValueError: no square of 3"} and manifest["key"] == ChunkStore(None, JOB).key
    assert run_chunks(ChunkStore(None, JOB), squares, []).results == []


def test_who_runs_chunks(monkeypatch):
    monkeypatch.setattr(executors.os, "cpu_count", lambda: 3)
    for given, count, threads in ((None, 9, 3), (None, 2, 2), (5, 4, 4), (2, 9, 2), (1, 9, 1), (None, 1, 1)):
        make, owned = executors._maker(None, given, count)
        pool = make()
        assert owned and pool._max_workers == threads and isinstance(pool, SerialExecutor if threads == 1 else ThreadPoolExecutor)
        pool.shutdown()
    own = SerialExecutor()
    make, owned = executors._maker(own, None, 3)
    assert make() is own and not owned
    make, owned = executors._maker(SerialExecutor, None, 3)  # a class makes executors, as a function does
    assert isinstance(make(), SerialExecutor) and owned
    assert run_chunks(ChunkStore(None, JOB), squares, payloads(2), executor=SerialExecutor).computed == 2

    class Client:
        submit = None

        def get_executor(self, pure):
            return "pool" if pure is False else None

    make, owned = executors._maker(Client(), None, 3)
    assert make() == "pool" and not owned
    failed = own.submit(lambda: 1 / 0)
    assert isinstance(failed.exception(), ZeroDivisionError) and own.submit(lambda a, b: a - b, 5, b=2).result() == 3


def test_windows_of_pools():
    """Twice as many chunks as workers are handed over, one at a time to this thread, many where workers are not told."""
    most = {}

    class Counting(SerialExecutor):
        def __init__(self, workers, name):
            self._max_workers, self.name, self.open = workers, name, []

        def submit(self, fn, *args):
            from concurrent.futures import Future

            future = Future()
            self.open.append((future, fn, args))
            most[self.name] = max(most.get(self.name, 0), len(self.open))
            if len(self.open) >= self.limit:
                for waiting, work, given in self.open:
                    waiting.set_result(work(*given))
                self.open = []
            return future

    class Pool(Counting):
        pass

    Pool.__mro__  # noqa: B018
    for workers, limit, name in ((2, 4, "two"), (3, 6, "three")):
        pool = Counting(workers, name)
        pool.limit = limit
        executor = type("Plain", (), {"submit": pool.submit, "_max_workers": workers})()
        run_chunks(ChunkStore(None, JOB), squares, payloads(2 * limit), executor=executor)
        assert most[name] == limit


def test_what_is_kept_between_chunks_is_the_newest():
    kept = Kept(2)
    for key in "abc":
        kept.put(key, key.upper())
    assert [kept.get(key) for key in "abc"] == [None, "B", "C"]
    kept.put("b", 1)
    kept.put("d", 2)
    assert [kept.get(key) for key in "bcd"] == [1, None, 2] and Kept()._most == 4


def own_law(u, s):
    return -u


class OwnStop(bf.elements.RigidStop):
    pass


def test_what_workers_need_of_a_user():
    assert user_parts(bf.systems.impact_oscillator()) == ()
    system = bf.System(1.0, 0.0, 1.0, [bf.elements.Force(own_law), OwnStop(), bf.elements.RigidStop(), OwnStop(2.0)])
    assert user_parts(system) == (own_law, OwnStop)
    build = bf.systems.builder(own_builder)
    assert user_parts(build())[0] is build


def own_builder(*, gap: float = 1.0) -> bf.System:
    return bf.System(1.0, 0.0, 1.0, [bf.elements.RigidStop(gap)])


def test_names_tell_nested_values_apart():
    values = [[1, [2]], [[1], 2], [[1, 2]], [[1], [2]], [[[1]], 2],
              {"a": 1}, {"a": "1"}, "1", 1, 1.0, True, None, [], {}, [[]], {"a": [1]}, {"b": 1}, float("nan"),
              np.arange(2), np.arange(2.0), [0, 1], own_law, OwnStop, "x"]
    assert len({fingerprint(value) for value in values}) == len(values) - 0
    assert fingerprint(np.int64(3)) == fingerprint(3) and fingerprint((1, 2)) == fingerprint([1, 2])
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1}) and len(fingerprint(1)) == 64
    name = ChunkStore(None, JOB).name({"n": 1})
    assert name.endswith(".npz") and len(name) == 36 and ChunkStore(None, JOB).load(name) is None
    ChunkStore(None, JOB).save(name, {}, {})
    ChunkStore(None, JOB).clear()


def test_a_chunk_is_that_of_its_job_name_and_content(tmp_path):
    own = ChunkStore(tmp_path / "c", JOB)
    name = own.name({"n": 1})
    own.save(name, {"a": (1, 2)}, {"x": [1.0, 2.0]})
    meta, arrays = own.load(name)
    assert meta == {"a": [1, 2]} and arrays["x"].tolist() == [1.0, 2.0]
    header, arrays = files.read(own.folder / name)
    for change in ({"key": "x"}, {"name": "x"}, {"content": "x"}, {"meta": 3}, {"kind": "other"}):
        files.write(own.folder / name, {**header, **change}, arrays, careful=False)
        assert own.load(name) is None, change
    files.write(own.folder / name, header, arrays, careful=False)
    assert own.load(name) is not None
    (own.folder / "mine.txt").write_text("x")
    own.clear()
    assert [path.name for path in own.folder.iterdir()] == ["mine.txt"]


def test_a_finished_result_is_told_by_its_key(tmp_path):
    path = tmp_path / "r.npz"
    assert finished(None, "made", "k") is None and finished(path, "made", "k") is None
    files.write(path, {"kind": "made", "key": "k"}, {"a": [1]})
    assert finished(path, "made", "k")[1]["a"].tolist() == [1]
    assert finished(path, "made", "other") is None and finished(path, "kind", "k") is None


class Result:
    def __init__(self, path_key="k"):
        self.key = path_key

    def save(self, path):
        files.write(path, {"kind": "made", "key": self.key}, {}, careful=False)


def test_a_result_that_is_not_whole_keeps_its_chunks(tmp_path):
    path = tmp_path / "r.npz"

    def compute(own, key):
        own.save(own.name({"n": 1}), {}, {})
        made = Result(key)
        return made

    resumable.resumable("made", path, JOB, None, compute, whole=lambda found: False)
    assert not path.exists() and len(list((tmp_path / "r.npz.chunks").glob("*.npz"))) == 1
    resumable.resumable("made", path, JOB, None, compute)
    assert path.exists() and not (tmp_path / "r.npz.chunks").exists()
    read = resumable.resumable("made", path, JOB, lambda header, arrays: header["key"], compute)
    assert read == ChunkStore(None, JOB).key
    assert isinstance(resumable.resumable("made", None, JOB, None, lambda own, key: key), str)
    path.write_bytes(path.read_bytes()[:40])  # a cut file is replaced beside chunks of its own alone
    with pytest.raises(FileExistsError):
        resumable.replaceable(path, "made")
    (tmp_path / "r.npz.chunks").mkdir()
    resumable.replaceable(path, "made")
    path.write_text("text")
    with pytest.raises(FileExistsError):
        resumable.replaceable(path, "made")
    np.savez(path, mine=np.arange(3.0))  # whole, and somebody else's
    with pytest.raises(FileExistsError):
        resumable.replaceable(path, "made")
    assert np.load(path)["mine"].tolist() == [0.0, 1.0, 2.0]


class Screen(io.StringIO):
    def isatty(self):
        return True


def test_shares_are_reported_and_lines_are_not_shown_too_often(monkeypatch):
    seen = []
    with progress.Progress("x", 4.0, seen.append) as bar:
        for amount in (1.0, 0.0, 2.0, 9.0):
            bar.advance(amount, "note")
    assert seen == [0.25, 0.25, 0.75, 1.0] and bar.done == 4.0
    with progress.Progress("x", None, seen.append) as bar:
        bar.advance(3.0)
        bar.advance(4.0)
    assert seen[4:] == [3.0, 7.0]
    with progress.Progress("x", 0.0, seen.append) as bar:
        bar.advance(0.0)
    assert seen[6:] == [0.0]
    for wrong in (1, "yes", []):
        with pytest.raises(ValueError, match="x: progress = .* is not allowed; it must be True, False or a function"):
            progress.Progress("x", 1.0, wrong)
    assert not progress.Progress("x", 1.0, None).shown and progress.Progress("x", 1.0).shown
    monkeypatch.setitem(sys.modules, "tqdm", None)
    now = [10.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    for total, first in ((4.0, "\rx:  25 % a"), (None, "\rx: 1 a"), (0.0, "\rx: 100 % a")):
        screen = Screen()
        monkeypatch.setattr(sys, "stderr", screen)
        with progress.Progress("x", total) as bar:
            bar.advance(1.0, "a")
            bar.advance(1.0, "too soon")
            now[0] += 0.21
            bar.advance(1.0, "b")
        lines = screen.getvalue().split("\r")[1:]
        assert screen.getvalue().startswith(first.ljust(79)) and "too soon" not in screen.getvalue() and " b" in lines[1]
        assert lines[-2:] == [" " * 79, ""]
        now[0] += 9.0
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    with progress.Progress("x", 4.0):
        pass
    assert screen.getvalue() == ""


class Broken(executors.BrokenExecutor):
    pass


def opened(count, **attributes):
    """Return a run of ``count`` chunks and its futures, none finished."""
    from concurrent.futures import Future

    bar, store_ = Bar(), ChunkStore(None, JOB)
    run = executors._Run(store_, squares, payloads(count), [""] * count, executors.Outcome([None] * count, {}), bar,
                         [10.0 + i for i in range(count)], "noted")
    for name, value in attributes.items():
        setattr(run, name, value)
    futures = [Future() for _ in range(count)]
    return run, bar, futures, {future: i for i, future in enumerate(futures)}


def test_what_is_finished_when_a_pool_breaks_is_kept():
    run, bar, futures, running = opened(5)
    made = squares(payloads(5)[1])
    futures[1].set_result(made)
    futures[2].cancel()
    futures[3].set_exception(KeyError("x"))
    assert run._broken(Broken("it died"), running, [7]) == ("it died", [7, 0, 2, 3, 4])
    assert run.outcome.results[1] is not None and run.outcome.computed == 1 and not run.outcome.failures
    assert [run.done(i) for i in range(5)] == [False, True, False, False, False] and bar.seen == [(11.0, "noted")]
    assert run._broken(Broken(), {}, []) == ("Broken", [])


def test_what_a_future_brings():
    """A result, an error of the chunk, or that of the pool; beside others on shared workers nobody is blamed at once."""
    run, bar, futures, running = opened(4)
    futures[0].set_exception(KeyError("x"))
    futures[1].set_exception(Broken("gone"))
    futures[2].cancel()
    futures[2].set_running_or_notify_cancel()
    assert run._take(futures[0], running) is None and run.outcome.failures == {0: "KeyError: 'x'"} and run.done(0)
    assert str(run._take(futures[1], running)) == "gone" and isinstance(run._take(futures[2], running), executors.CancelledError)
    assert list(running.values()) == [3] and bar.seen == [(10.0, "noted")] and run.outcome.computed == 0 and run.blamed == []
    for shared, alone, name, blamed in ((True, False, "KeyError", True), (True, True, "KeyError", False),
                                        (False, False, "KilledWorker", True), (False, True, "KilledWorker", False)):
        run, bar, futures, running = opened(2, shared=shared, alone=alone)
        futures[1].set_exception(type(name, (Exception,), {})("z"))
        assert run._take(futures[1], running) is None
        assert run.blamed == [1] * blamed and run.outcome.failures == ({} if blamed else {1: f"{name}: z"})
        assert bar.seen == ([] if blamed else [(11.0, "noted")]) and run.done(1) is not blamed
    run, _, futures, running = opened(3)
    run.bar = None
    futures[0].set_result(squares(payloads(3)[0]))
    futures[1].set_running_or_notify_cancel()
    futures[1].set_result(squares(payloads(3)[1]))
    run._save_what_runs(running)  # after an interrupt: the third waits and is dropped
    assert futures[2].cancelled() and not running and [run.done(i) for i in range(3)] == [True, True, False]
    assert run.outcome.computed == 2


def test_names_tell_how_lists_and_mappings_are_nested():
    for one, other in (([[1, 2], 3], [[1], 2, 3]), ([[1, 2]], [[1], 2]), ([1, 2], [12]), ([[[]]], [[], []]), ([[], 1], [[1]]),
                       ({"a": {"b": 1, "c": 2}}, {"a": {"b": 1}, "c": 2}), (["a", "b"], ["ab"]), ({"a": [1]}, [{"a": 1}]),
                       (np.zeros((2, 3)), np.zeros((3, 2))), (np.zeros(2), [0.0, 0.0])):
        assert fingerprint(one) != fingerprint(other)
    turned = np.arange(6.0).reshape(2, 3)
    assert fingerprint(turned.T) == fingerprint(turned.T.copy()) != fingerprint(turned)


def test_executors_are_made_by_functions_and_classes_and_used_as_they_are():
    class Callable(Executor):
        def __call__(self):
            raise AssertionError("it is one already")
    assert all(executors._makes(item) for item in (lambda: None, ThreadPoolExecutor, Callable))
    assert not any(executors._makes(item) for item in (Callable(), SerialExecutor(), None))


@pytest.mark.parametrize("module, theirs", [("bifurc_tools.laws", True), ("mine", True), ("bifurc.elements.stops", False)])
def test_a_module_whose_name_begins_like_the_package_is_the_users(module, theirs):
    """Its classes go along to workers, which could not rebuild the system without them."""
    kind = type("Special", (), {"__module__": module})
    assert (kind in user_parts(SimpleNamespace(_origin=None, elements=(kind(),)))) is theirs
