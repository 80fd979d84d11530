"""Checks of arguments; every error names owner, argument, value, and what is allowed."""
import math
import numbers

import numpy as np


def number(owner: str, name: str, value, *, least: float | None = None, above: float | None = None,
           most: float | None = None) -> float:
    """Return ``value`` as a float, or raise ValueError unless it is finite and within the limits given."""
    real = type(value) is float or (isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_)))
    if (real and math.isfinite(value) and (least is None or value >= least) and (above is None or value > above)
            and (most is None or value <= most)):
        return float(value)
    allowed = "a finite number"
    if least is not None and most is not None:
        allowed = f"a number from {least:g} to {most:g}"
    elif least is not None:
        allowed = f"a finite number, at least {least:g}"
    elif above is not None:
        allowed = f"a finite number above {above:g}"
    raise ValueError(f"{owner}: {name} = {value!r} is not allowed; it must be {allowed}")


def whole(owner: str, name: str, value, *, least: int, most: int | None = None) -> int:
    """Return ``value`` as an int, or raise ValueError unless it is a whole number within the limits."""
    good = type(value) is int or (isinstance(value, numbers.Integral) and not isinstance(value, (bool, np.bool_)))
    if not good or value < least or (most is not None and value > most):
        limits = f"at least {least}" + ("" if most is None else f" and at most {most}")
        raise ValueError(f"{owner}: {name} = {value!r} is not allowed; it must be a whole number, {limits}")
    return int(value)


def choice(owner: str, name: str, value, allowed: tuple):
    """Return ``value`` when it is one of ``allowed``, else raise ValueError."""
    if value not in allowed:
        listed = ", ".join(map(repr, allowed))
        raise ValueError(f"{owner}: {name} = {value!r} is not allowed; it must be one of {listed}")
    return value


def state(name: str, value, sizes: tuple[int, ...]) -> np.ndarray:
    """Return ``value`` as a finite float array of one of the lengths ``sizes``, else raise ValueError."""
    try:
        found = np.array(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} is not allowed; it must be a state of {sizes[-1]} numbers: positions, then "
                         "velocities") from None
    if found.shape not in {(size,) for size in sizes}:
        raise ValueError(f"{name} has shape {found.shape}; a state of this system has shape ({sizes[-1]},): positions, then "
                         "velocities")
    if not np.isfinite(found).all():
        raise ValueError(f"{name} = {value!r} must be finite")
    return found


def tolerance_of(owner: str, value) -> float:
    """Return a tolerance of basins: above 0 and at most 0.1, else raise ValueError."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real) or not 0.0 < float(value) <= 0.1:
        raise ValueError(f"{owner}: tolerance = {value!r} is not allowed; it must be above 0 and at most 0.1")
    return float(value)


def following(owner: str, seed, tolerance, max_periods, max_events) -> dict:
    """Return the options of finding attractors and following starts to them, checked, as results keep them."""
    return {"seed": whole(owner, "seed", seed, least=0), "tolerance": tolerance_of(owner, tolerance),
            "max_periods": whole(owner, "max_periods", max_periods, least=1),
            "max_events": whole(owner, "max_events", max_events, least=1)}


def switch(owner: str, name: str, value):
    """Return ``value`` when it is True, False, None or a function (as ``progress=`` takes it), else raise ValueError."""
    if value is not None and not isinstance(value, bool) and not callable(value):
        raise ValueError(f"{owner}: {name} = {value!r} is not allowed; it must be True, False, or a function")
    return value


def vector(owner: str, name: str, value) -> tuple[float, ...]:
    """Return ``value`` as a tuple of finite floats, not empty, else raise ValueError."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim != 1 or array.size == 0 or not np.isfinite(array).all():
        raise ValueError(f"{owner}: {name} = {value!r} is not allowed; it must be a list of finite numbers")
    return tuple(float(item) for item in array)
