"""Chunk files: finished parts of long work, the only record from which an interrupted run goes on.

A chunk is one npz file, renamed into place when complete, and named by a hash of everything its content depends on:
problem, parameters, grid, options and the source of the package.  What is missing or unreadable is computed again; the
manifest beside the chunks is derived from them and never read.  What is not a chunk, a manifest, or one that was not finished, by
its content, is never replaced or removed, whatever it is called.
"""
import contextlib
import dataclasses
import functools
import hashlib
import inspect
import json
import logging
import os
import re
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np

from .. import __version__, io

_log = logging.getLogger("bifurc.jobs")

KIND = "chunk"
MANIFEST = "manifest.json"
TRIES = 10  # to write into a folder that others clear
_CHUNK, _HALF = re.compile(r"[0-9a-f]{32}\.npz"), re.compile(r"\..*\.tmp")
_PROBE = b"probe"
_TOLD = {"key", "total", "finished", "missing", "failed"}  # by a manifest
_PACKAGE = Path(__file__).resolve().parent.parent
# what numbers can depend on, by the order of imports
_COUNTS = ("elements", "system.py", "systems", "compose", "flow", "hbm", "orbits", "ensemble", "basins", "continuation", "atlases",
           "control", "solve", "io", "_jit.py")


@functools.cache
def code_hash() -> str:
    """Return 16 hexadecimal digits that change with the sources that numbers can depend on, and with numpy and numba."""
    digest = hashlib.sha256(f"{__version__} {np.__version__} {numba.__version__}".encode())
    for path in sorted(_PACKAGE.rglob("*.py")):
        if path.relative_to(_PACKAGE).parts[0] in _COUNTS:
            digest.update(path.relative_to(_PACKAGE).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def fingerprint(value: Any) -> str:
    """Return the SHA-256 of nested plain values, arrays, classes and functions (these by their source text)."""
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest, value) -> None:
    if isinstance(value, Mapping):
        digest.update(b"{")
        for key in sorted(value):
            _feed(digest, key)
            _feed(digest, value[key])
        digest.update(b"}")
    elif isinstance(value, np.ndarray):
        digest.update(f"a{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, list | tuple):
        digest.update(b"[")
        for item in value:
            _feed(digest, item)
        digest.update(b"]")
    elif inspect.isclass(value) or inspect.isfunction(value):
        try:
            text = inspect.getsource(value)
        except (OSError, TypeError):  # from a prompt: the name must do
            text = ""
        digest.update(f"c{value.__module__}.{value.__qualname__}:{text}".encode())
    elif dataclasses.is_dataclass(value):
        _feed(digest, [type(value).__qualname__, *(getattr(value, field.name) for field in dataclasses.fields(value))])
    else:
        plain = value.tolist() if isinstance(value, np.generic) else value
        digest.update(json.dumps(plain, allow_nan=True).encode())
        digest.update(b",")


class ChunkStore:
    """Folder of chunk files of one job; keeps everything in memory alone when there is no folder.

    Parameters
    ----------
    folder : path-like or None
        Created with the first chunk; its parent must exist.
    job : dict
        What all chunks depend on: plain values and arrays.

    Attributes
    ----------
    key : str
        Hash of the job and of the package's source.

    Raises
    ------
    OSError
        When the folder cannot be made or written to: raised before any work is done.
    """

    def __init__(self, folder, job: Mapping):
        self.folder = None if folder is None else Path(folder)
        self.key = fingerprint({"job": job, "code": code_hash()})
        if self.folder is not None:
            self._probe()

    def name(self, payload: Mapping) -> str:
        """Return the file name of a chunk: the hash of the job and of what the chunk computes."""
        return fingerprint([self.key, payload])[:32] + ".npz"

    def load(self, name: str) -> tuple[dict, dict[str, np.ndarray]] | None:
        """Return a finished chunk; None when it is missing, damaged, or of another job."""
        if self.folder is None:
            return None
        try:
            header, arrays = io.read(self.folder / name, KIND)
        except Exception:  # whatever a damaged file makes a reader say: it is computed again
            return None
        meta = header.get("meta")
        if not isinstance(meta, dict) or header.get("key") != self.key or header.get("name") != name \
                or header.get("content") != fingerprint([meta, arrays]):
            return None
        return meta, arrays

    def save(self, name: str, meta: dict, arrays: Mapping[str, np.ndarray]) -> None:
        """Write a finished chunk.

        Raises
        ------
        OSError
            When it cannot be written (full disk, folder gone); what was finished before stays.
        """
        folder = self.folder
        if folder is None:
            return
        meta = json.loads(json.dumps(meta))  # as it will be read
        arrays = {key: np.asarray(values) for key, values in arrays.items()}
        header = {"kind": KIND, "key": self.key, "name": name, "meta": meta, "content": fingerprint([meta, arrays])}
        if not _ours(folder / name):
            _log.warning("%s is no chunk: it is left alone, and the chunk that belongs there is not kept", folder / name)
            return
        try:
            self._writing(lambda: io.write(folder / name, header, arrays, compressed=False, careful=False))
        except OSError as error:
            raise OSError(error.errno, f"{error.strerror or error}: a chunk cannot be written into {self.folder}. The chunks "
                          "that are there are kept; make room and make the same call again: only what is missing is "
                          "computed") from error

    def manifest(self, names: Sequence[str], failures: Mapping[int, str], total: int) -> None:
        """Write which chunks are there; derived, never read back, and not worth an error."""
        if self.folder is None:
            return
        if not _ours(self.folder / MANIFEST):
            return
        there = {path.name for path in self.folder.glob("*.npz")}
        content = {"key": self.key, "total": total, "finished": [name for name in names if name in there],
                   "missing": [name for name in names if name not in there],
                   "failed": {names[i]: text for i, text in failures.items()}}
        temporary = self.folder / f".{MANIFEST}.{os.getpid()}.{secrets.token_hex(4)}.tmp"
        try:
            temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")
            os.replace(temporary, self.folder / MANIFEST)
        except OSError:
            temporary.unlink(missing_ok=True)

    def publish(self, result: Any, file: str | os.PathLike) -> None:
        """Save the finished result to its file by way of this folder, and remove the chunks.

        A writer that is killed then leaves nothing but what the next run of the same job takes away with the folder.

        Parameters
        ----------
        result : object with ``save(path)``
        file : path-like
            In the folder that holds the chunk folder: the result is renamed into place.
        """
        assert self.folder is not None
        temporary = self.folder / f".{secrets.token_hex(4)}.tmp"

        def put() -> None:
            result.save(temporary)
            os.replace(temporary, file)

        try:
            self._writing(put)
        finally:
            temporary.unlink(missing_ok=True)
        self.clear()

    def _writing(self, write: Callable[[], Any]) -> None:
        """Write into the folder; another process that finished the same job may take it away meanwhile, so more than once."""
        assert self.folder is not None
        for _ in range(TRIES):
            with contextlib.suppress(FileNotFoundError):
                self.folder.mkdir(exist_ok=True)
                write()
                return
        write()

    def clear(self) -> None:
        """Remove chunks, leftovers of killed writers, manifest, and the folder when it is empty then."""
        if self.folder is None or not self.folder.is_dir():
            return
        with contextlib.suppress(OSError):  # another process that ends the same job clears it too
            for path in self.folder.iterdir():
                if _ours(path):
                    path.unlink(missing_ok=True)
            self.folder.rmdir()

    def _probe(self) -> None:
        """Find out now, not after hours, whether the folder can be written."""
        folder = self.folder
        assert folder is not None
        probe = folder / f".{secrets.token_hex(4)}.tmp"
        try:
            folder.mkdir(exist_ok=True)
            probe.write_bytes(_PROBE)
            probe.unlink()
        except OSError as error:
            raise OSError(error.errno, f"{error.strerror or error}: chunk files cannot be written into {folder}; "
                          "give a file in a folder that exists and can be written") from error


def _ours(path: Path) -> bool:
    """Return whether a file of a folder of chunks was written by a job, as its content tells; one that is missing may be."""
    try:
        if path.is_symlink() or io.other_than_file(path):
            return False
        if path.name == MANIFEST:
            said = json.loads(path.read_text(encoding="utf-8"))
            return isinstance(said, dict) and set(said) == _TOLD
        if _HALF.fullmatch(path.name):
            return io.begun(path) or path.read_bytes() == _PROBE
        if not _CHUNK.fullmatch(path.name):
            return False
        try:
            return io.header(path)["kind"] == KIND
        except io.FileFormatError:
            return io.begun(path)  # cut or changed
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False


def finished(file, kind: str, key: str) -> tuple[dict, dict[str, np.ndarray]] | None:
    """Return the record of a whole result when it is there already and was made by the same job; None otherwise."""
    if file is None or not Path(file).exists():
        return None
    try:
        header, arrays = io.read(file, kind)
    except io.FileFormatError:
        return None
    return (header, arrays) if header.get("key") == key else None
