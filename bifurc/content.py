"""What all results are: equal when their content is equal, hashable, copied and pickled as they are, with arrays nobody can write.

Content is the fields of a dataclass (those with ``compare=False`` left out), or what a class names in ``_content``.  Arrays are
equal when shape, type and values are, NaN beside NaN.  Only parts of the content that cost nothing enter the hash.
"""
import dataclasses
import functools
import numbers
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


class Content:
    """A result, known by its content.

    Dataclasses among its subclasses are written with ``eq=False``.  Fields that are arrays are held as read-only views: what an
    array was made in stays as it is.  Those that go into kernels, which compile again for read-only arrays, are `handed_out`.
    """

    __slots__ = ()

    def __post_init__(self):
        kind: Any = type(self)
        for name in _array_fields(kind):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def __setstate__(self, state: dict) -> None:
        self.__dict__.update(state)
        if dataclasses.is_dataclass(self):
            self.__post_init__()

    def _content(self) -> tuple:
        """Return what makes it equal to another of its class."""
        kind: Any = type(self)
        return tuple(getattr(self, name) for name in _compared(kind))

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self is other or alike(self._content(), other._content())

    def __hash__(self) -> int:
        return hash((type(self).__name__, digest(self._content())))


def kept(function: Callable[[Any], Any]) -> property:
    """Make a property of what a function returns when it is asked for first, an array or None; it is handed out as a copy."""
    place = f"_kept_{function.__name__}"

    @functools.wraps(function)
    def get(self):
        if place not in self.__dict__:
            self.__dict__[place] = function(self)
        return copy_of(self.__dict__[place])

    return property(get)


def copy_of(value: Any) -> Any:
    """Return an array as a copy, a sparse matrix, which may be large, as one that cannot be written; None as it is."""
    if isinstance(value, np.ndarray):
        return value.copy()
    return None if value is None else read_only(value)


def handed_out(*names: str) -> Callable[[Any], Any]:
    """Return the decorator of a class whose fields ``names``, see `copy_of`, are handed out as copies."""
    def dressed(kind: Any) -> Any:
        for name in names:
            def get(self, name=name):
                return copy_of(self.__dict__[name])

            def put(self, value, name=name):
                self.__dict__[name] = value

            setattr(kind, name, property(get, put))
        return kind

    return dressed


def by_content(kind: Any) -> Any:
    """Make a named tuple equal and hashed by its content: the decorator of those that hold arrays."""
    kind.__eq__ = lambda self, other: type(other) is kind and alike(tuple(self), tuple(other))
    kind.__ne__ = lambda self, other: not self == other
    kind.__hash__ = lambda self: digest(tuple(self))
    return kind


@functools.cache  # one entry a class
def _array_fields(kind: Any) -> tuple[str, ...]:
    return tuple(item.name for item in dataclasses.fields(kind)
                 if "ndarray" in str(item.type) and not isinstance(getattr(kind, item.name, None), property))


@functools.cache  # one entry a class
def _compared(kind: Any) -> tuple[str, ...]:
    return tuple(item.name for item in dataclasses.fields(kind) if item.compare)


def read_only(value: Any) -> Any:
    """Return an array as a view that cannot be written, a sparse matrix as one of such, tuples and lists of arrays as tuples of
    such; anything else as it is."""
    if isinstance(value, np.ndarray):
        view = value.view()
        view.flags.writeable = False
        return view
    if hasattr(value, "indptr"):
        parts = read_only((value.data, value.indices, value.indptr))
        return type(value)(parts, shape=value.shape, copy=False)
    if type(value) in (tuple, list) and any(isinstance(item, np.ndarray) for item in value):
        return tuple(read_only(item) for item in value)
    return value


def alike(one: Any, other: Any) -> bool:
    """Return whether two values are equal, arrays and what holds them by content, NaN equal to NaN."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        if type(one) is not type(other) or one.shape != other.shape or one.dtype != other.dtype:
            return False
        if one.dtype.hasobject:
            return all(map(alike, one.ravel(), other.ravel()))
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))
    if isinstance(one, numbers.Number) and isinstance(other, numbers.Number):
        return bool(one == other or (one != one and other != other))
    if type(one) is not type(other):
        return False
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(alike(value, other[key]) for key, value in one.items())
    if isinstance(one, functools.partial):
        return alike((one.func, one.args, one.keywords), (other.func, other.args, other.keywords))
    if hasattr(one, "tocsr"):  # a sparse matrix
        return one.shape == other.shape and (one != other).nnz == 0
    return bool(one == other)


def digest(value: Any) -> int:
    """Return a hash that is the same for values that are `alike`, from what is quick to look at."""
    if isinstance(value, np.ndarray):
        return hash((value.shape, value.dtype.str))
    if isinstance(value, numbers.Number):
        return hash(value) if value == value else 0
    if isinstance(value, tuple | list):
        return hash((type(value).__name__, *map(digest, value)))
    if isinstance(value, Mapping):
        return len(value)
    try:
        return hash(value)
    except TypeError:  # an object of the user's
        return hash(type(value).__name__)
