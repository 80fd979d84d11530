"""Computing beside the page: one thread a worker, in which the newest request wins."""
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

_log = logging.getLogger("bifurc.explore")


class Superseded(RuntimeError):
    """A newer request has taken the place of this one."""


class Ticket:
    """A request on its way; ``valid`` until a newer one comes."""

    def __init__(self) -> None:
        self.valid = True


class Worker:
    """One thread that always works on the newest request; older ones that wait are dropped, one that runs is told.

    Parameters
    ----------
    name : str
    idle : callable, optional
        Called in the worker's thread when nothing is left to do.
    """

    def __init__(self, name: str, idle: Callable[[], None] | None = None):
        self.name, self._idle = name, idle
        self._condition = threading.Condition()
        self._next: tuple[Ticket, Callable[[Ticket], Any], Callable[[Any], None]] | None = None
        self._ticket = Ticket()
        self._open = True
        self.busy = False
        self._thread = threading.Thread(target=self._run, name=f"bifurc {name}", daemon=True)
        self._thread.start()

    def ask(self, work: Callable[[Ticket], Any], done: Callable[[Any], None]) -> Ticket:
        """Compute ``work(ticket)`` and hand its result, or the error it raised, to ``done``, unless a newer request comes.

        ``done`` runs in the worker's thread.
        """
        with self._condition:
            self._ticket.valid = False
            self._ticket = ticket = Ticket()
            self._next = ticket, work, done
            self.busy = True
            self._condition.notify()
        return ticket

    def drop(self) -> None:
        """Let go of whatever runs or waits."""
        with self._condition:
            self._ticket.valid = False
            self._next = None

    def close(self) -> None:
        """End the thread after what runs."""
        with self._condition:
            self._open = False
            self._ticket.valid = False
            self._condition.notify()

    def _run(self) -> None:
        while True:
            with self._condition:
                while self._next is None and self._open:
                    self._condition.wait()
                if not self._open:
                    return
                assert self._next is not None
                ticket, work, done = self._next
                self._next = None
            try:
                result: Any = work(ticket)
            except Exception as error:  # the thread must live on; the page shows what happened
                if ticket.valid:
                    _log.warning("%s: %s", self.name, error, exc_info=not isinstance(error, ValueError | RuntimeError))
                result = error
            if ticket.valid:
                done(result)
            with self._condition:
                self.busy = self._next is not None
            if not self.busy and self._idle is not None:
                self._idle()


class Newest(Executor):
    """Threads that refuse work as soon as the ticket of their request is no longer valid.

    Parameters
    ----------
    ticket : Ticket
    workers : int
    """

    def __init__(self, ticket: Ticket, workers: int):
        self.ticket = ticket
        self._max_workers = workers
        self._pool = ThreadPoolExecutor(workers)

    def submit(self, fn, /, *args, **kwargs) -> Future:
        """Run in a thread, if the request is still wanted by then."""
        def wanted():
            if not self.ticket.valid:
                raise Superseded("a newer request was made")
            return fn(*args, **kwargs)

        return self._pool.submit(wanted)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the threads."""
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)
