"""What stands between a page and the commands: workers that compute, the session that keeps, pages that are notified.

Knows no web library: a page is a function that is called, in any thread, when something has changed.
"""
import os
import tempfile
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..jobs.store import fingerprint
from . import model
from .model import Session, Shown
from .work import Newest, Ticket, Worker

FEW = 1e-9  # of its width: a window that moved less has not moved


class Desk:
    """One explorer: a session, its workers, and the pages that show it.

    Parameters
    ----------
    first : Shown
    out : path-like
        Folder of what is saved.
    workers : int, optional
        Threads of a basin map; default one a processor.
    fine, coarse : int
        Cells a side of a slice.
    """

    def __init__(self, first: Shown, out="bifurc-results", workers: int | None = None, fine: int = model.FINE,
                 coarse: int = model.COARSE):
        self.session = Session(first)
        self.out, self.workers = Path(out), workers or os.cpu_count() or 1
        self.fine, self.coarse = fine, min(coarse, fine)
        self._cache = tempfile.TemporaryDirectory(prefix="bifurc-explore-")
        self._lock = threading.RLock()
        self._pages: list[Callable[[], None]] = []
        self._begun = False
        self.orbits, self.branches, self.maps = (Worker(name, self._tell) for name in ("orbit", "branch", "map"))

    # pages

    def attach(self, page: Callable[[], None]) -> None:
        """Add a page; the first one starts the work."""
        with self._lock:
            self._pages.append(page)
            begun, self._begun = self._begun, True
        if not begun:
            self.begin()

    def detach(self, page: Callable[[], None]) -> None:
        """Remove a page that was closed."""
        with self._lock:
            if page in self._pages:
                self._pages.remove(page)

    @property
    def now(self) -> Shown:
        """What is shown."""
        return self.session.now

    @property
    def busy(self) -> list[str]:
        """What is being computed."""
        return [worker.name for worker in (self.orbits, self.branches, self.maps) if worker.busy]

    def close(self) -> None:
        """End the workers and remove the cache."""
        for worker in (self.orbits, self.branches, self.maps):
            worker.close()
        self._cache.cleanup()

    # actions

    def begin(self) -> None:
        """Find the first orbit, then its branch, unless a saved result brought them."""
        def first(result: Any) -> None:
            self._put(result, "")
            with self._lock:
                self.session.first = self.session.now

        def then(result: Any) -> None:
            first(result)
            if not self.now.branches and self.now.orbit is not None:
                self.branches.ask(lambda ticket: model.trace_here(self.now), first)

        self.orbits.ask(lambda ticket: model.begin(self.now), then)
        self._tell()

    def pick(self, x: float, y: float, span: tuple[float, float]) -> None:
        """Show the orbit at a place of the branch diagram."""
        self._ask(self.orbits, lambda shown: model.pick(shown, x, y, span), "pick")

    def change(self, name: str, value: float, done: bool = False) -> None:
        """Give a parameter another value; ``done`` ends a drag. A slice that is shown follows."""
        follow = self.now.basins is not None

        def then(result: Any) -> None:
            self._put(result, f"drag {name}")
            if done:
                self.session.rest()
            if follow:
                self.map(dict(self.now.window), step="", fine=done)

        self.orbits.ask(lambda ticket: model.change_parameters(self.now, {name: value}), then)
        self._tell()

    def trace(self) -> None:
        """Trace the branch through the orbit."""
        self._ask(self.branches, model.trace_here, "trace")

    def switch(self) -> None:
        """Trace the branches that leave the special point."""
        self._ask(self.branches, model.switch_here, "switch")

    def settle_on(self, x: float, y: float) -> None:
        """Show the motion to which a start leads."""
        self._ask(self.orbits, lambda shown: model.settle_on(shown, x, y), "settle")

    def map(self, window: Mapping | None = None, step: str = "map", fine: bool = True) -> None:
        """Map a slice of starts: coarse at once, then fine."""
        def work(ticket: Ticket) -> Mapping:
            shown = self.now
            ranges = dict(window or shown.window or model.around(shown))
            change: Mapping = {}
            for cells in dict.fromkeys((self.coarse, self.fine) if fine else (self.coarse,)):
                if not ticket.valid:
                    break
                pool = Newest(ticket, self.workers)
                try:
                    change = model.map_here(shown, ranges, cells, self._file(shown, ranges, cells), pool)
                finally:
                    pool.shutdown(wait=False, cancel_futures=True)
                if ticket.valid and cells != self.fine:
                    self._put(change, step)
            return change

        self.maps.ask(work, lambda result: self._put(result, step))
        self._tell()

    def zoom(self, window: Mapping) -> None:
        """Map another slice, unless it is the one that is shown."""
        old = self.now.window
        if self.now.basins is None or (set(old) == set(window) and all(
                max(abs(a - b) for a, b in zip(old[name], window[name], strict=True)) <= FEW * abs(old[name][1] - old[name][0])
                for name in old)):
            return
        self.session.rest()
        self.map(window, step="zoom")

    def show_measure(self, name: str) -> None:
        """Put another column on the vertical axis."""
        self._put({"measure": name}, "")

    def back(self) -> None:
        """Return to what was shown before; what is being computed is dropped."""
        self._drop()
        with self._lock:
            self.session.back()
        self._tell()

    def reset(self) -> None:
        """Return to the first page."""
        self._drop()
        with self._lock:
            self.session.reset()
        self._tell()

    def save(self) -> None:
        """Write script, results and pictures of what is shown."""
        def write(shown: Shown) -> dict:
            files = model.save(shown, self.out)
            return {"message": f"saved {', '.join(file.name for file in files)} in {self.out.resolve()}"}

        self._ask(self.orbits, write, "")

    # private

    def _ask(self, worker: Worker, command: Callable[[Shown], Mapping], step: str) -> None:
        def then(result: Any) -> None:
            self._put(result, step)
            self.session.rest()

        worker.ask(lambda ticket: command(self.now), then)
        self._tell()

    def _put(self, change: Any, step: str) -> None:
        if isinstance(change, Exception):
            change, step = {"message": f"{type(change).__name__}: {change}"}, ""
        with self._lock:
            self.session.put(change, step)
        self._tell()

    def _tell(self) -> None:
        with self._lock:
            pages = list(self._pages)
        for page in pages:
            page()

    def _drop(self) -> None:
        for worker in (self.orbits, self.branches, self.maps):
            worker.drop()

    def _file(self, shown: Shown, window: Mapping, cells: int) -> Path:
        known = [] if shown.basins is None or shown.basins.value.system != shown.system else \
            [attractor.to_record()[0] for attractor in shown.basins.value.attractors]
        return Path(self._cache.name) / f"{fingerprint([shown.system.to_record(), dict(window), cells, len(known)])[:24]}.npz"
