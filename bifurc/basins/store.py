"""Unfinished basin maps on disk: what is labelled already, in a file beside the result, renamed into place."""
import hashlib
import json
import time
from pathlib import Path

import numpy as np

from .. import io

BETWEEN = 5.0  # seconds between two writings


class Store:
    """The partial file of a basin map; does nothing without a file.

    Parameters
    ----------
    file : path-like or None
        Where the finished map will be; the partial file is ``<file>.partial`` beside it.
    job : dict
        Everything the labels depend on, JSON-able; a file of another job is not used.
    """

    def __init__(self, file, job: dict):
        self.path = None if file is None else Path(file)
        self.partial = None if self.path is None else self.path.with_name(self.path.name + ".partial")
        text = json.dumps(job, sort_keys=True, default=str)
        self.key = hashlib.sha256(text.encode()).hexdigest()
        self._last = time.monotonic()

    def load(self) -> dict[str, np.ndarray] | None:
        """Return what was finished, or None."""
        if self.partial is None or not self.partial.exists():
            return None
        try:
            header, arrays = io.read(self.partial, "partial_basins")
        except io.FileFormatError:
            return None  # damaged: computed again
        return arrays if header.get("key") == self.key else None

    def save(self, arrays: dict[str, np.ndarray], now: bool = False) -> None:
        """Write what is finished, at most every few seconds unless ``now``."""
        if self.partial is not None and (now or time.monotonic() - self._last > BETWEEN):
            io.write(self.partial, {"kind": "partial_basins", "key": self.key}, arrays)
            self._last = time.monotonic()

    def finished(self) -> bool:
        """Return whether the result itself is there already."""
        if self.path is None or not self.path.exists():
            return False
        try:
            header, _ = io.read(self.path, "basins")
        except io.FileFormatError:
            return False
        return header.get("key") == self.key

    def remove(self) -> None:
        """Remove the partial file."""
        if self.partial is not None:
            self.partial.unlink(missing_ok=True)
