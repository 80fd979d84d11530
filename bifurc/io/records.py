"""Records in files: a header and arrays, written so that a file is there complete or not at all, and what is checked of them.

A record is a header (what it is, from which system, with which options) and named arrays.  The header lists type, shape and
checksum of every array: nothing else is unpacked, and nothing that is not as long as its type and shape say.  This module knows no
class: classes turn themselves into records (``to_record``) and back (``from_record``).
"""
import errno
import json
import os
import secrets
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import archive

FORMAT = "bifurc"
VERSION = 1  # of the file layout; raised when an older reader would misread a newer file
_TYPES = {"finite": "finite real numbers (float64)", "real": "real numbers (float64)", "whole": "whole numbers",
          "logical": "True or False"}
_HEADER = "__header__"  # name of the array that holds the UTF-8 bytes of the JSON header
_WRITTEN = "arrays"  # entry of the header: type, shape and checksum of every array
_SAID = 300  # characters of what a reader says
_OTHERS = {stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a named pipe", stat.S_ISSOCK: "a socket", stat.S_ISCHR: "a device",
           stat.S_ISBLK: "a device"}


class FileFormatError(ValueError):
    """A file is not a bifurc result, is damaged, or was written by a newer version; the message says which."""


def write(path: str | os.PathLike, header: Mapping[str, Any], arrays: Mapping[str, Any], compressed: bool = True,
          careful: bool = True) -> Path:
    """Write a record to one file; the file appears complete or not at all.

    Parameters
    ----------
    path : path-like
        The file, used as given (no suffix is added). Its folder must exist; an existing result is replaced.
    header : mapping
        JSON-able; ``kind`` (str) is required. ``format`` and ``version`` are filled in.
    arrays : mapping of str to array_like
        Any shapes; real, complex, boolean, integer or string, not objects.
    compressed : bool
        False: larger, and several times faster.
    careful : bool
        False: whatever is there is replaced; for folders of our own.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    TypeError, ValueError
        If the header cannot be written as JSON (NaN and infinity included), or an array holds objects.
    FileExistsError
        If something else than a bifurc result is there: it is left alone.
    """
    path = Path(path)
    if careful:
        replaceable(path)
    if not isinstance(header.get("kind"), str):
        raise ValueError(f"header['kind'] must name what the record is, got {header.get('kind')!r}")
    content, written = {}, {}
    for name, values in arrays.items():
        array = np.asarray(values)
        if array.dtype.kind not in archive.KINDS:
            held = "Python objects" if array.dtype.hasobject else str(array.dtype)
            raise TypeError(f"array {name!r} holds {held}; only numbers, booleans and strings are written")
        if name == _HEADER or "/" in name:
            raise ValueError(f"array name {name!r} is not allowed: no '/', and not {_HEADER!r}")
        content[name], written[name] = array, archive.told(array)
    text = json.dumps({**header, "format": FORMAT, "version": VERSION, _WRITTEN: written}, default=_plain, allow_nan=False)
    content = {_HEADER: np.frombuffer(text.encode(), np.uint8), **content}
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "there is no such folder", str(path.parent))
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{secrets.token_hex(4)}.tmp")
    try:
        with open(temporary, "xb") as file:
            (np.savez_compressed if compressed else np.savez)(file, allow_pickle=False, **content)
            if compressed and not archive.modest(content, _HEADER, file.tell()):
                file.seek(0)
                file.truncate()
                np.savez(file, allow_pickle=False, **content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def replaceable(path: str | os.PathLike, kind: str | None = None) -> None:
    """Raise FileExistsError unless nothing is at ``path``, or a bifurc result (of the kind, where one is given)."""
    path = Path(path)
    if not path.exists():
        return
    try:
        header(path, kind)
    except FileFormatError as error:
        raise FileExistsError(errno.EEXIST, f"{error}. It is left alone; give another name, or remove it") from None


def other_than_file(path: str | os.PathLike) -> str | None:
    """Return what is there in place of an ordinary file (a named pipe would wait for ever, a device has no end), or None.

    Raises
    ------
    FileNotFoundError
    """
    mode = os.stat(path).st_mode
    if stat.S_ISREG(mode):
        return None
    return next((words for is_it, words in _OTHERS.items() if is_it(mode)), "no ordinary file")


def begun(path: str | os.PathLike) -> bool:
    """Return whether a file begins as `write` begins one, whole or cut; an empty one does, other than files do not."""
    if os.path.islink(path) or other_than_file(path):
        return False
    with open(path, "rb") as file:
        start = file.read(30 + len(_HEADER))
    return archive.START.startswith(start[:4]) and _HEADER.encode().startswith(start[30:])


def header(path: str | os.PathLike, kind: str | None = None) -> dict[str, Any]:
    """Return the header of a record, without its arrays; raises as `read`."""
    return _open(path, kind, False)[0]


def read(path: str | os.PathLike, kind: str | None = None) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Read a record.

    Parameters
    ----------
    path : path-like
    kind : str, optional
        The kind that is expected.

    Returns
    -------
    header : dict
    arrays : dict of str to ndarray
        As they were written, bit for bit.

    Raises
    ------
    FileNotFoundError
    FileFormatError
        If the file is foreign, damaged, newer than this version, or of another kind.
    """
    return _open(path, kind, True)


def made(path: str | os.PathLike, read: Callable, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Any:
    """Return what ``read`` makes of the record of a file; whatever it says of a record that does not fit names the file.

    Raises
    ------
    FileFormatError
    """
    try:
        return read(header, arrays)
    except FileFormatError:
        raise
    except Exception as error:  # whatever a record that somebody changed, or another version, makes a reader say
        said = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        raise FileFormatError(f"{path} holds a {header['kind']!r} that cannot be read: {said}{_short(error)}") from error


def _short(error: Exception) -> str:
    """Return what an error says in one line of a moderate length: it may repeat what the file holds."""
    said = " ".join(str(error).split())
    return (said if len(said) <= _SAID else f"{said[:_SAID]} ...") or type(error).__name__


class Part(dict):
    """Arrays of a record inside another one, by their own names; ``start`` is what the names in the file begin with."""

    start = ""


def part(arrays: Mapping[str, np.ndarray], start: str) -> Part:
    """Return the arrays whose names begin with ``start``, without it."""
    found = Part({name.removeprefix(start): values for name, values in arrays.items() if name.startswith(start)})
    found.start = getattr(arrays, "start", "") + start
    return found


def fitted(arrays: Mapping[str, np.ndarray], shapes: Mapping[str, str], **sizes: int | tuple[int, ...]) -> None:
    """Raise unless arrays have the types and shapes that their class gives them.

    Parameters
    ----------
    arrays : mapping of str to ndarray
    shapes : mapping of str to str
        Name of an array (ending in ``?``: it may be missing) -> its type and its axes, such as ``"finite m 4"``.  Types are
        ``finite``, ``real`` (NaN and infinity may stand), ``whole``, ``logical`` and ``any``.  An axis is a length, ``*`` (any), or
        a name that stands for one length wherever it is met; ``name+1`` is one more than one that was met.
    **sizes
        Lengths that are known; several for a name that stands for several axes.

    Raises
    ------
    ValueError
        Naming the array.

    Examples
    --------
    >>> fitted({"x": np.zeros((3, 2)), "t": np.zeros(2)}, {"x": "finite m 2", "t": "finite m"})
    Traceback (most recent call last):
    ...
    ValueError: array 't' has the shape (2,); it must be (3,)
    """
    for name, words in shapes.items():
        kind, *axes = words.split()
        name, optional = name.removesuffix("?"), name.endswith("?")
        called = f"array {getattr(arrays, 'start', '') + name!r}"
        if name not in arrays:
            if optional:
                continue
            raise ValueError(f"{called} is missing")
        array = arrays[name]
        if not _of_type(array, kind):
            raise ValueError(f"{called} holds {array.dtype}{' with NaN or infinity' if kind == 'finite' else ''}; "
                             f"it must hold {_TYPES[kind]}")
        wanted = _wanted(axes, sizes, array.shape)
        if array.shape != wanted:
            raise ValueError(f"{called} has the shape {array.shape}; it must be {wanted}")


def _of_type(array: np.ndarray, kind: str) -> bool:
    if kind in ("finite", "real"):
        return array.dtype == np.float64 and (kind == "real" or bool(np.isfinite(array).all()))
    return kind == "any" or array.dtype.kind == {"whole": "i", "logical": "b"}[kind]


def _wanted(axes: list[str], sizes: dict, shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape that ``axes`` mean; names not met before take the lengths of ``shape``, and are met then."""
    found: list[int] = []
    for axis in axes:
        name, _, more = axis.partition("+")
        here = shape[len(found)] if len(found) < len(shape) else 0
        if axis == "*":
            size: int | tuple[int, ...] = here
        elif axis.isdigit():
            size = int(axis)
        else:
            size = sizes.setdefault(name, here)
        found += size if isinstance(size, tuple) else [size + int(more or 0)]
    return tuple(found)


def _open(path: str | os.PathLike, kind: str | None, whole: bool) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the header, and the arrays where the whole file is asked for."""
    path = Path(path)
    other = other_than_file(path)
    if other:
        raise FileFormatError(f"{path} is {other}, not a bifurc result")
    foreign = f"{path} is not a bifurc result"
    with open(path, "rb") as file:
        if file.read(4) != archive.START:
            raise FileFormatError(f"{foreign}: it is no npz file")
        try:
            with archive.Archive(file) as members:
                if _HEADER not in members:
                    raise FileFormatError(f"{foreign}: it is an npz file without a bifurc header")
                header = archive.read_json(members.text(_HEADER))
                _check(path, header, kind)
                written = header.pop(_WRITTEN)
                return header, members.arrays(written) if whole else {}
        except FileFormatError:
            raise
        except archive.DAMAGE as error:
            raise FileFormatError(f"{path} is damaged ({_short(error)}); results are renamed into place when complete, so it "
                                  "was changed or cut after it was written") from error


def _check(path: Path, header: Any, kind: str | None) -> None:
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise FileFormatError(f"{path} is not a bifurc result: its header names another format")
    version = header.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise FileFormatError(f"{path} has no valid layout version (got {version!r})")
    if version > VERSION:
        raise FileFormatError(f"{path} has layout version {version}, this bifurc reads up to {VERSION}; update bifurc")
    if not isinstance(header.get("kind"), str):
        raise FileFormatError(f"{path} does not say what it holds: its header has no 'kind'")
    if not isinstance(header.get(_WRITTEN), dict):
        raise FileFormatError(f"{path} does not say how its arrays were written: its header has no table {_WRITTEN!r} of their "
                              "types, shapes and checksums")
    if kind is not None and header["kind"] != kind:
        raise FileFormatError(f"{path} holds a {header['kind']!r}, expected a {kind!r}")


def _plain(value: Any) -> Any:
    """Return numpy scalars and small arrays as what JSON knows."""
    if isinstance(value, np.generic | np.ndarray) and not np.iscomplexobj(value):
        return value.tolist()
    raise TypeError(f"a header holds only JSON values, got {type(value).__name__}: {value!r}")
