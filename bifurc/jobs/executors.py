"""One seam for where chunks are computed: this thread, threads, processes, or a cluster, with the same bits from each.

Anything of the shape of `concurrent.futures.Executor` serves; results are collected by the driver, which alone writes
chunk files, so that workers need no disk and a killed driver loses only what was not handed in.
"""
import inspect
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import checks
from .progress import Progress
from .store import ChunkStore

Result = tuple[dict, dict[str, np.ndarray]]  # what a chunk gives: plain values, and arrays
Work = Callable[[Mapping], Result]
WINDOW = 256  # chunks handed to an executor that does not tell its number of workers
DEATHS = 2  # times that a chunk may kill a worker, the second time alone in its pool, before it is given up


@dataclass
class Outcome:
    """What became of chunks.

    Attributes
    ----------
    results : list
        One a chunk, None where it failed.
    failures : dict
        Number of a chunk that failed -> why.
    kept, computed : int
        Chunks read from their files, and chunks computed.
    """

    results: list[Result | None] = field(repr=False)
    failures: dict[int, str]
    kept: int = 0
    computed: int = 0


class SerialExecutor(Executor):
    """Runs at once, in the thread of the caller: for debugging, and where threads are not wanted."""

    _max_workers = 1

    def submit(self, fn, /, *args, **kwargs) -> Future:
        """Run and return the finished future."""
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def run_chunks(store: ChunkStore, work: Work, payloads: Sequence[Mapping], *, executor=None, workers: int | None = None,
               bar: Progress | None = None, weights: Sequence[float] | None = None, note: str = "") -> Outcome:
    """Compute chunks that have no file yet, wherever the executor runs them, and file each as it comes in.

    Parameters
    ----------
    store : ChunkStore
    work : function of a module
        Takes a payload, returns plain values (JSON) and arrays.  It and the payload are pickled for processes: no
        closures.
    payloads : sequence of dict
        Plain values, arrays, and user classes or functions.
    executor : Executor, dask.distributed.Client, function, or None
        None: threads (``workers``; one: this thread).  A function without arguments that makes an executor lets a
        broken pool be made again: a chunk that kills its workers is then found and reported while the others finish.
    workers : int, optional
        Threads; default one a processor.
    bar : Progress, optional
    weights : sequence of float, optional
        Progress that each chunk is worth; default 1.
    note : str
        Shown beside the bar.

    Returns
    -------
    Outcome

    Raises
    ------
    KeyboardInterrupt
        After chunks that were running came in and were filed (a second interrupt does not wait).
    OSError
        When a chunk cannot be filed.
    RuntimeError
        When a given executor broke: a worker died and took the pool with it.
    """
    names = [store.name(payload) for payload in payloads] if store.folder is not None else [""] * len(payloads)
    outcome = Outcome([store.load(name) for name in names], {})
    outcome.kept = sum(item is not None for item in outcome.results)
    share = [1.0] * len(payloads) if weights is None else list(weights)
    if bar is not None and outcome.kept:
        bar.advance(sum(w for w, item in zip(share, outcome.results, strict=True) if item is not None), "from files")
    open_ = [i for i, item in enumerate(outcome.results) if item is None]
    if not open_:
        return outcome
    run = _Run(store, work, payloads, names, outcome, bar, share, note)
    make, owned = _maker(executor, workers, len(open_))
    try:
        _with_pools(run, open_, make, owned, _makes(executor))
    finally:
        store.manifest(names, outcome.failures, len(names))
    return outcome


def check_executor(executor) -> None:
    """Raise ValueError unless chunks can be handed to it."""
    if executor is not None:
        checks.executor("", "executor", executor)


def _makes(executor) -> bool:
    """Return whether an executor is to be made by a call: a function, or a class of executors."""
    return isinstance(executor, type) or callable(executor) and not hasattr(executor, "submit")


def _maker(executor, workers: int | None, count: int) -> tuple[Callable[[], Executor], bool]:
    """Return what gives the pool, and whether it is to be shut down here."""
    check_executor(executor)
    if executor is None:
        threads = min(workers or os.cpu_count() or 1, count)
        return (SerialExecutor if threads == 1 else lambda: ThreadPoolExecutor(threads)), True
    if _makes(executor):
        return lambda: _made(executor), True
    if hasattr(executor, "get_executor"):  # a dask.distributed.Client
        return lambda: executor.get_executor(pure=False), False
    return lambda: executor, False


def _made(executor: Callable[[], Executor]) -> Executor:
    """Return the executor that a function makes, or raise ValueError when it makes none."""
    try:
        pool = executor()
    except TypeError as error:  # as of a function that wants an argument
        raise checks.refused("", "executor", executor, f"{checks.EXECUTOR}; called without arguments it says: {error}") from error
    if not hasattr(pool, "submit"):
        raise checks.refused("", "executor", executor, f"{checks.EXECUTOR}; it made {checks.shown(pool)}")
    return pool


def _with_pools(run: "_Run", open_: list[int], make: Callable[[], Executor], owned: bool, again: bool) -> None:
    """Run all chunks; where pools can be made again, find the chunk that breaks them."""
    deaths: dict[int, int] = {}
    while open_:
        suspects = [i for i in open_ if deaths.get(i)]
        batch, window = (suspects[:1], 1) if suspects else (open_, None)  # a suspect runs alone
        run.alone = bool(suspects)
        pool, broken = make(), None
        try:
            broken = run.through(pool, batch, window)
        finally:
            if owned:
                left = list((getattr(pool, "_processes", None) or {}).values()) if broken else []
                pool.shutdown(wait=False, cancel_futures=True)
                for process in left:  # one that was just starting waits for ever on a lock of the one that died
                    process.kill()
        open_ = [i for i in open_ if not run.done(i)]
        for i in run.blamed:
            deaths[i] = deaths.get(i, 0) + 1
        run.blamed.clear()
        if not broken:
            continue
        if not again:
            raise RuntimeError(f"the executor broke ({broken[0]}): a worker died. {len(run.outcome.results) - len(open_)} of "
                               f"{len(run.outcome.results)} chunks are finished and kept; make the same call with a new executor, "
                               "or give a function that makes one: then the pool is made again and a chunk that kills its "
                               "workers is found")
        for i in broken[1]:
            deaths[i] = deaths.get(i, 0) + 1
            if window == 1 and deaths[i] >= DEATHS:
                run.outcome.failures[i] = f"its worker died {deaths[i]} times, the last time alone ({broken[0]})"
                open_.remove(i)


class _Run:
    """Chunks on their way through a pool."""

    def __init__(self, store: ChunkStore, work: Work, payloads, names, outcome: Outcome, bar: Progress | None, share, note: str):
        self.store, self.work, self.payloads, self.names = store, work, payloads, names
        self.outcome, self.bar, self.share, self.note = outcome, bar, share, note
        self.alone = False  # whether one chunk runs that is suspected of killing workers
        self.shared = False  # whether chunks share workers of dask, whose death takes others along, under errors of many names
        self.blamed: list[int] = []  # chunks that failed beside others on shared workers: run again alone

    def done(self, i: int) -> bool:
        """Whether a chunk is finished or given up."""
        return self.outcome.results[i] is not None or i in self.outcome.failures

    def through(self, pool: Executor, batch: Sequence[int], window: int | None) -> tuple[str, list[int]] | None:
        """Run a batch; return None, or why the pool broke and which chunks it had then."""
        known = getattr(pool, "_max_workers", None)
        self.shared = type(pool).__module__.startswith("distributed")
        if window is None:
            window = 1 if isinstance(pool, SerialExecutor) else 2 * known if known else WINDOW
        waiting: list[int] = list(reversed(batch))
        running: dict[Future, int] = {}
        try:
            while waiting or running:
                while waiting and len(running) < window:
                    i = waiting.pop()
                    try:
                        running[pool.submit(self.work, self.payloads[i])] = i
                    except (BrokenExecutor, ValueError, OSError) as error:  # or its pipes are closed while it starts a process
                        return self._broken(error, running, [i])
                    except RuntimeError as error:
                        raise RuntimeError(f"the executor takes no more work ({error}); give one that is open") from error
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    i = running[future]
                    broken = self._take(future, running)
                    if broken is not None:
                        return self._broken(broken, running, [i])
        except BaseException:
            self._save_what_runs(running)
            raise
        return None

    def _broken(self, error: BaseException, running: dict, lost: list[int]) -> tuple[str, list[int]]:
        """Take in what is finished; return why the pool broke and the chunks it was working on or was to work on."""
        for future in list(running):
            if future.done() and not future.cancelled() and future.exception() is None:
                self._take(future, running)
        return str(error) or type(error).__name__, [*lost, *running.values()]

    def _take(self, future: Future, running: dict) -> BaseException | None:
        """Take a finished chunk; return the error when it is the pool that broke."""
        i = running.pop(future)
        try:
            meta, arrays = future.result()
        except (BrokenExecutor, CancelledError) as error:
            return error
        except Exception as error:
            if (self.shared or type(error).__name__ == "KilledWorker") and not self.alone:  # it waited on a worker that died,
                # or had left its result there
                self.blamed.append(i)
                return None
            self.outcome.failures[i] = f"{type(error).__name__}: {error}"
        else:
            self.store.save(self.names[i], meta, arrays)
            self.outcome.results[i] = meta, arrays
            self.outcome.computed += 1
        if self.bar is not None:
            self.bar.advance(self.share[i], self.note)
        return None

    def _save_what_runs(self, running: dict) -> None:
        """After an interrupt: drop what waits, take in what runs.  A second interrupt ends the waiting."""
        for future in list(running):
            if future.cancel():
                del running[future]
        while running:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                try:
                    self._take(future, running)
                except OSError:  # the disk: said already
                    return


class Kept:
    """What a process keeps between chunks, by the key of their job: a scene is built once, not once a chunk.

    Parameters
    ----------
    most : int
        What was put in first goes when there are more.
    """

    def __init__(self, most: int = 4):
        self._most, self._lock = most, threading.Lock()
        self._items: OrderedDict[str, Any] = OrderedDict()

    def get(self, key: str) -> Any:
        """Return what is kept under a key, or None."""
        with self._lock:
            return self._items.get(key)

    def put(self, key: str, value: Any) -> None:
        """Keep a value."""
        with self._lock:
            self._items[key] = value
            self._items.move_to_end(key)
            while len(self._items) > self._most:
                self._items.popitem(last=False)


def user_parts(system: Any) -> tuple:
    """Return classes, laws and builder of a system that are not the package's own: workers need them to rebuild it."""
    own = "bifurc."
    found: list = []
    if system._origin is not None:
        found.append(getattr(system._origin[0], "source", system._origin[0]))
    for element in system.elements:
        found.append(type(element))
        found += [value for value in vars(element).values() if callable(value) and hasattr(value, "__name__")]
    return tuple(item for item in dict.fromkeys(found) if not str(getattr(item, "__module__", "")).startswith(own)
                 or not isinstance(item, type) and not inspect.isroutine(item))  # what holds the fields of a user
