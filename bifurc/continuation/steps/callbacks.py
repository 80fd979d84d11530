"""The caller's functions along a branch (``stop=``, ``record=``, ``progress=``, ``monitors=``): what they raise, or return that
they must not, is named as theirs, so that a branch can end with it and keep its rows."""
import numbers
from collections.abc import Mapping

import numpy as np

from ..kinds import PASSED_ON, CallbackError

NUMBERS = "biufc"  # kinds of dtypes that are numbers


def asked(name: str, function, *arguments):
    """Return ``function(*arguments)``; what it raises becomes a `CallbackError` that names it; limits of time and memory pass."""
    try:
        return function(*arguments)
    except PASSED_ON:
        raise
    except Exception as error:  # a user's own class of errors, too
        raise CallbackError(f"{name} raised {type(error).__name__}: {error}") from error


def stops(function, point) -> bool:
    """Return what a function says that ends a half of a branch; nothing is no."""
    told = asked("stop=", function, point)
    if told is None or isinstance(told, np.bool_) or (isinstance(told, numbers.Real) and told == told):
        return bool(told)
    raise CallbackError(f"stop= returned {told!r}; it must return True or False")


def recorded(function, point) -> dict:
    """Return what a function records of a point, a dict of names and numbers; nothing is an empty one, and NaN a number."""
    told = asked("record=", function, point)
    if told is None:
        return {}
    if not isinstance(told, Mapping):
        raise CallbackError(f"record= returned {told!r}; it must return a dict of names and numbers")
    for name, value in told.items():
        if not isinstance(name, str) or np.ndim(value) or np.asarray(value).dtype.kind not in NUMBERS:
            raise CallbackError(f"record= returned {name!r}: {value!r}; it must return a dict of names and numbers")
    return dict(told)


def value_of(name: str, function, solution) -> float:
    """Return ``function(solution)`` of a monitor as a float; NaN where it is not defined, which is never a zero."""
    value = asked(f"monitor {name!r}", function, solution)
    if not isinstance(value, str | bytes):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass
    raise CallbackError(f"monitor {name!r} must return a number, got {value!r}")
