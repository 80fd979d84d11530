"""Progress of long work: a tqdm bar on the error stream, one plain line where tqdm is not installed, or a user's function."""
import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

_BETWEEN = 0.2  # seconds between two showings of the plain line


class Progress:
    """How far long work is, to be used as a context; silent unless it is shown.

    Parameters
    ----------
    label : str
        What is being done.
    total : float or None
        Amount of work, in any unit; None where it is not known.
    shown : bool, None or callable
        ``progress=`` of a library call: a bar for True; silent for False and None; a function is called with the share that is
        finished, from 0 to 1 (with the amount where the total is not known).

    Examples
    --------
    >>> with Progress("basins", total=3, shown=False) as progress:
    ...     for chunk in range(3):
    ...         progress.advance(1)
    """

    def __init__(self, label: str, total: float | None, shown: bool | Callable[[float], Any] | None = True):
        if not (isinstance(shown, bool) or shown is None or callable(shown)):
            raise ValueError(f"{label}: progress = {shown!r} is not allowed; it must be True, False or a function")
        self.label, self.total = label, total
        self.report = shown if callable(shown) else None
        self.shown = shown is True
        self.done = 0.0
        self._bar: Any = None
        self._last = -_BETWEEN
        self._printed = False

    def __enter__(self) -> "Progress":
        if self.shown:
            try:
                from tqdm import tqdm  # optional
            except ImportError:
                return self
            counted = "{desc}: {n:.0f} | {elapsed}{postfix}"
            form = counted if self.total is None else "{desc}: {percentage:3.0f} %|{bar:30}| {elapsed}{postfix}"
            self._bar = tqdm(total=self.total, desc=self.label, file=sys.stderr, leave=False, bar_format=form)
        return self

    def advance(self, amount: float, note: str = "") -> None:
        """Add finished work; the amount may be zero, to show a new note."""
        self.done += amount
        if self.total is not None:
            self.done = min(self.done, self.total)
        if self.report is not None:
            self.report(self.done / self.total if self.total else self.done)
        elif self._bar is not None:
            if note:
                self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(self.done - self._bar.n)
        elif self.shown and sys.stderr.isatty() and time.monotonic() - self._last >= _BETWEEN:
            self._last = time.monotonic()
            far = f"{self.done:.0f}" if self.total is None else f"{100 * self.done / self.total if self.total else 100.0:3.0f} %"
            print(f"\r{self.label}: {far} {note}".ljust(79), end="", file=sys.stderr, flush=True)
            self._printed = True

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.close()
        elif self._printed:
            print("\r" + " " * 79 + "\r", end="", file=sys.stderr, flush=True)
