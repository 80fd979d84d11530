"""Progress of long work on the error stream: a tqdm bar where tqdm is installed, otherwise one plain line."""
import sys
import time
from types import TracebackType
from typing import Any

_BETWEEN = 0.2  # seconds between two showings of the plain line


class Progress:
    """A bar to be used as a context; silent unless it is shown.

    Parameters
    ----------
    label : str
        What is being done.
    total : float
        Amount of work, in any unit.
    shown : bool
        Silent when false: library calls are silent unless their ``progress=True``.

    Examples
    --------
    >>> with Progress("basins", total=3, shown=False) as progress:
    ...     for chunk in range(3):
    ...         progress.advance(1)
    """

    def __init__(self, label: str, total: float, shown: bool = True):
        if not isinstance(shown, bool) and shown is not None:
            raise ValueError(f"{label}: progress = {shown!r} is not allowed; it must be True or False")
        self.label, self.total, self.shown = label, total, bool(shown)
        self.done = 0.0
        self._bar: Any = None
        self._last = -_BETWEEN
        self._printed = False

    def __enter__(self) -> "Progress":
        if self.shown:
            try:
                from tqdm import tqdm
            except ImportError:
                return self
            form = "{desc}: {percentage:3.0f} %|{bar:30}| {elapsed}{postfix}"
            self._bar = tqdm(total=self.total, desc=self.label, file=sys.stderr, leave=False, bar_format=form)
        return self

    def advance(self, amount: float, note: str = "") -> None:
        """Add finished work; the amount may be zero, to show a new note."""
        self.done = min(self.done + amount, self.total)
        if self._bar is not None:
            if note:
                self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(self.done - self._bar.n)
        elif self.shown and sys.stderr.isatty() and time.monotonic() - self._last >= _BETWEEN:
            self._last = time.monotonic()
            percent = 100 * self.done / self.total if self.total else 100.0
            print(f"\r{self.label}: {percent:3.0f} % {note}".ljust(79), end="", file=sys.stderr, flush=True)
            self._printed = True

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.close()
        elif self._printed:
            print("\r" + " " * 79 + "\r", end="", file=sys.stderr, flush=True)
