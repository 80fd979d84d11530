"""A long job with a file: read when it is finished, otherwise computed from its chunks and put into place.

Nothing but a result of the same kind is ever replaced.
"""
import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import io
from .store import ChunkStore, finished


def resumable(kind: str, file, job: Mapping, read: Callable, compute: Callable, *, part: Mapping | None = None,
              whole: Callable[[Any], bool] = lambda found: True) -> Any:
    """Return the result of a long job.

    Parameters
    ----------
    kind : str
        Of the result's file, see `bifurc.io`.
    file : path-like or None
        Where the result is saved; finished chunks are kept in ``<file>.chunks`` until it is.  None: memory only.
    job : mapping
        What all chunks depend on, see `ChunkStore`.
    read : callable
        Makes the result from the header and arrays of its file.
    compute : callable
        Takes the chunk store and the key of the result; returns the result, which has ``save(path)``.
    part : mapping, optional
        What the result depends on and its chunks do not.
    whole : callable
        Whether a result is complete; if not, its chunks are kept and no file is written.

    Raises
    ------
    ValueError
        When ``file`` is no path.
    FileExistsError
        When ``file`` is something else than a result of this kind: it is left alone, and nothing is computed.
    OSError
        When the folder cannot be written.
    """
    if file is not None:
        replaceable(file, kind)
    store = ChunkStore(None if file is None else f"{Path(file)}.chunks", job)
    key = store.key if part is None else store.name(part)
    ready = finished(file, kind, key)
    if ready is not None:
        store.clear()
        return io.made(file, read, *ready)
    found = compute(store, key)
    if file is not None and whole(found):
        replaceable(file, kind)  # what has come there meanwhile is not ours either
        store.publish(found, file)
    return found


def replaceable(file, kind: str) -> None:
    """Raise unless ``file`` is a path with nothing there, or with a result of the kind (or a cut one, beside its chunks)."""
    if not isinstance(file, str | os.PathLike) or not os.fspath(file):
        raise ValueError(f"file = {file!r} is not allowed; it must be a path, or None")
    try:
        io.replaceable(file, kind)
    except FileExistsError:
        if not (Path(f"{file}.chunks").is_dir() and _cut(Path(file))):
            raise


def _cut(path: Path) -> bool:
    """Whether a file begins like a result and is no archive: one that was cut, where chunks of its job lie beside it."""
    return bool(path.stat().st_size) and io.begun(path) and not zipfile.is_zipfile(path)
