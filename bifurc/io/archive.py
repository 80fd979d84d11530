"""Reading an npz file that anybody may have changed: only what is asked for is unpacked, and no more of it than was said.

Type, shape and checksum of every array are told beforehand (`told`, from the header of the file); a member that does not say the
same, or is not as long, is refused before it is unpacked.
"""
import json
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np

# what zip and JSON readers say to bytes that somebody changed
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, LookupError, ValueError, TypeError, NotImplementedError,
          RuntimeError, MemoryError, ArithmeticError)
KINDS = "biufcSU"  # of numpy's types that are written: numbers, booleans, strings
START, _NPY = b"PK\x03\x04", b"\x93NUMPY\x01\x00"  # how an archive begins, and an array in it
_TEXT, _ARRAYS = 2**22, 2**27  # bytes of a text and of arrays that any file may hold
_RATIO = 100  # beyond them, times its size: zeros are packed 1000 times, and what is packed more than this is written as it is
_DIRECTORY = 2**23  # bytes of the list of members, of 100 each
_BLOCK = 2**20  # bytes that are unpacked at a time


class Archive(zipfile.ZipFile):
    """An npz file, whose arrays are known by their names.

    Raises
    ------
    DAMAGE
    """

    def __init__(self, file: BinaryIO):
        self.size = file.seek(-22, os.SEEK_END) + 22
        if int.from_bytes(file.read(22)[12:16], "little") > _DIRECTORY:
            raise ValueError("its list of members is too long")
        super().__init__(file)
        if len(self.NameToInfo) < len(self.filelist):
            raise ValueError("two of its members have one name")

    def __contains__(self, name: str) -> bool:
        return name + ".npy" in self.NameToInfo

    @property
    def names(self) -> list[str]:
        """Names of its arrays."""
        return [name.removesuffix(".npy") for name in self.NameToInfo if name.endswith(".npy")]

    def foreign(self, name: str) -> np.ndarray:
        """Return an array that another program wrote, of which nothing is known."""
        info = self.getinfo(name + ".npy")
        if info.file_size > max(_ARRAYS, _RATIO * self.size):
            raise ValueError(f"its {self.size} bytes cannot hold {info.file_size}")
        with self.open(info) as member:
            return np.lib.format.read_array(member, allow_pickle=False)

    def text(self, name: str) -> bytes:
        """Return the bytes of an array whose length only the archive knows."""
        length = self.getinfo(name + ".npy").file_size
        if length > max(_TEXT, _RATIO * self.size):
            raise ValueError(f"its header would have {length} bytes")
        return self.array(name, np.dtype("|u1"), None).tobytes()

    def arrays(self, written: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Return the arrays that the header lists; before one is unpacked all of them are as long as they say, and not too long."""
        kinds, packed, total = {}, 0, 0
        for name, (kind, shape, _) in written.items():
            if name not in self:
                raise ValueError(f"array {name!r} is missing")
            if not re.fullmatch(rf"[<>|][{KINDS}]\d{{1,9}}", kind) or not all(type(n) is int and n >= 0 for n in shape):
                raise ValueError(f"array {name!r} has no type or no shape that is written here")
            kinds[name] = np.dtype(kind)
            packed += self.getinfo(name + ".npy").compress_size
            total += kinds[name].itemsize * math.prod(shape)
        if total > max(_ARRAYS, _RATIO * self.size) or packed > self.size:
            raise ValueError(f"its {self.size} bytes cannot hold {total}")
        arrays = {name: self.array(name, kinds[name], tuple(shape)) for name, (_, shape, _) in written.items()}
        for name, array in arrays.items():
            if told(array) != written[name]:
                raise ValueError(f"array {name!r} is not as it was written")
        return arrays

    def array(self, name: str, kind: np.dtype, shape: tuple[int, ...] | None) -> np.ndarray:
        """Return a member of known type and shape (None: one axis, as long as the member); it is refused before it is unpacked
        unless it says the same, in the words of `numpy.save`, and is as long."""
        info = self.getinfo(name + ".npy")
        if info.flag_bits & 1 or info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"array {name!r} is encrypted, or packed as it never is here")
        with self.open(info) as member:
            start = member.read(10)
            length = 10 + int.from_bytes(start[8:], "little")
            said = member.read(length - 10).decode("latin-1").rstrip()
            shape = (info.file_size - length,) if shape is None else shape
            size = kind.itemsize * math.prod(shape)
            order = next((order for order, word in (("C", False), ("F", True)) if said ==
                          f"{{'descr': {kind.str!r}, 'fortran_order': {word}, 'shape': {shape}, }}"), None)
            if start[:8] != _NPY or order is None or info.file_size != length + size:
                raise ValueError(f"array {name!r} is not as it was written")
            content = np.empty(size, np.uint8)
            place = 0
            while place < size:
                got = np.frombuffer(member.read(_BLOCK), np.uint8)
                if not got.size:
                    raise ValueError(f"array {name!r} ends after {place} of {size} bytes")
                content[place:place + got.size] = got
                place += got.size
        flat: Any = content.view(kind)
        return flat.reshape(shape, order=order)


def modest(content: Mapping[str, np.ndarray], header: str, size: int) -> bool:
    """Return whether a file of this size may hold so much: what is written must be read again."""
    total = sum(array.nbytes for array in content.values())
    return content[header].nbytes <= max(_TEXT, _RATIO * size) and total <= max(_ARRAYS, _RATIO * size)


def told(array: np.ndarray) -> list:
    """Return type, shape and checksum of an array, as JSON keeps them."""
    return [array.dtype.str, list(array.shape), zlib.crc32(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)]


def read_json(text: bytes) -> Any:
    """Return what a JSON text says: no NaN, no number that no float holds, no name twice."""
    return json.loads(text.decode(), parse_constant=_no_number, parse_float=_finite, object_pairs_hook=_once)


def _no_number(word: str) -> None:
    raise ValueError(f"its header holds {word}, which is no JSON")


def _finite(text: str) -> float:
    """Return a number of a header, which is never larger than any float."""
    value = float(text)
    if math.isinf(value):
        _no_number(text)
    return value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a mapping of a header, in which no name stands twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name stands twice in its header")
    return found
