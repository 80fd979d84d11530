"""What arguments may be: one place for the whole package.

A *kind* is a function ``(owner, name, value)`` that returns the value in its plain form, or raises a ValueError that names owner,
argument, value, and what is allowed.  `checked` looks most kinds up in `KINDS` by the name of the argument, which means the same
everywhere; a verb writes only what is special about it.  What needs more than the argument itself (a name among the parameters of
a system, a label among those of a map) is checked where it is known.

One file, because it is the one place: the kinds, what arguments mean by their names, and the decorator that joins them.
"""
import functools
import itertools
import math
import numbers
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

Kind = Callable[[str, str, Any], Any]
F = TypeVar("F", bound=Callable)


def shown(value) -> str:
    """Return a value as a message shows it: its repr, cut to what can be read, whatever the repr of a foreign class does."""
    try:
        text = repr(value)
    except Exception:  # a foreign class may raise anything
        text = f"<an object of class {type(value).__name__}>"
    return text if len(text) <= 240 else f"{text[:200]} ... {text[-20:]}"


def refused(owner: str, name: str, value, allowed: str) -> ValueError:
    """Return the error of a value that is not allowed."""
    return ValueError(f"{owner}{': ' if owner else ''}{name} = {shown(value)} is not allowed; it must be {allowed}")


def scalar(value):
    """Return an array without axes as its number, and anything else as it is."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value


def is_real(value) -> bool:
    """Return whether a value is a real number; True and False are none, nor is a span of time."""
    return type(value) is float or isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_, np.timedelta64))


def _flagged(value) -> bool:
    """Return whether True or False stands in lists of numbers, where numpy reads 1 and 0."""
    if isinstance(value, list | tuple):
        return any(type(item) is not float and _flagged(item) for item in value)
    return isinstance(value, bool) or getattr(value, "dtype", None) == np.dtype(bool)


def plain_text(value: str) -> str:
    """Return a text of any class as Python's own, which compares as texts do."""
    return value if type(value) is str else str.__str__(value)


def floats(value) -> np.ndarray | None:
    """Return real numbers of any shape as a new float array; None where else is among them (words, True, None, masked ones)."""
    if isinstance(value, bytes | bytearray | memoryview):
        return None
    try:
        given = np.asarray(value)
        if (given.dtype.kind in "iuf" or given.dtype.kind == "O" and all(map(is_real, given.flat))) and not (
                _flagged(value) or isinstance(value, np.ma.MaskedArray) and np.ma.getmaskarray(value).any()):
            return np.array(given, float)
    except Exception:  # ragged, too large, or what the conversion of a foreign class raises
        return None
    return None


def number(owner: str, name: str, value, *, least: float | None = None, above: float | None = None,
           most: float | None = None, finite: bool = True) -> float:
    """Return ``value`` as a float, or raise ValueError unless it is finite and within the limits given."""
    plain = value if type(value) is float else scalar(value)
    try:
        found = float(plain) if is_real(plain) else math.nan
    except OverflowError:  # a whole number of hundreds of digits
        found = math.nan
    if ((math.isfinite(found) or not finite and found == found) and (least is None or found >= least)
            and (above is None or found > above) and (most is None or found <= most)):
        return found
    low = f", at least {least:g}" if least is not None else f" above {above:g}" if above is not None else ""
    if most is None:
        raise refused(owner, name, value, f"a {'finite ' * finite}number{low}")
    if above is not None:
        raise refused(owner, name, value, f"{low[1:]} and at most {most:g}")
    raise refused(owner, name, value, f"a number from {least:g} to {most:g}" if low else f"a number at most {most:g}")


def whole(owner: str, name: str, value, *, least: int | None = None, most: int | None = None) -> int:
    """Return ``value`` as an int, or raise ValueError unless it is a whole number within the limits."""
    plain = value if type(value) is int else scalar(value)
    good = type(plain) is int or isinstance(plain, numbers.Integral) and is_real(plain)
    if not good or plain < (-LARGEST if least is None else least) or plain > (LARGEST if most is None else most):
        limits = " and ".join([f"at least {least}"] * (least is not None) + [f"at most {most}"] * (most is not None))
        raise refused(owner, name, value, f"a whole number{', ' * bool(limits)}{limits}")
    return int(plain)


def choice(owner: str, name: str, value, allowed: tuple):
    """Return that of ``allowed`` which ``value`` equals, else raise ValueError."""
    plain = scalar(value)
    if plain is None or isinstance(plain, str) or is_real(plain):
        told = plain_text(plain) if isinstance(plain, str) else plain
        for item in allowed:
            if item == told:
                return item
    raise refused(owner, name, value, f"one of {', '.join(map(repr, allowed))}")


def several(owner: str, name: str, value, *, allowed: tuple[str, ...]) -> tuple[str, ...]:
    """Return one word, or a list of words, as a tuple of different ones of ``allowed``, else raise ValueError."""
    found = (value,) if isinstance(value, str) else tuple(listed(value) or ()) if isinstance(value, list | tuple) else ()
    found = tuple(plain_text(item) if isinstance(item, str) else "" for item in found)
    if not found or not set(found) <= set(allowed) or len(set(found)) < len(found):
        raise refused(owner, name, value, f"{', '.join(map(repr, allowed))}, or {'both' if len(allowed) == 2 else 'several'}")
    return found


def state(name: str, value, sizes: tuple[int, ...]) -> np.ndarray:
    """Return ``value`` as a finite float array of one of the lengths ``sizes``, else raise ValueError."""
    found = floats(value)
    if found is None:
        raise refused("", name, value, f"a state of {sizes[-1]} numbers: positions, then velocities")
    if found.shape not in {(size,) for size in sizes}:
        raise ValueError(f"{name} has shape {found.shape}; a state of this system has shape ({sizes[-1]},): "
                         "positions, then velocities")
    if not np.isfinite(found).all():
        raise ValueError(f"{name} = {shown(value)} must be finite")
    return found


def switch(owner: str, name: str, value):
    """Return ``value`` when it is True, False, None or a function (as ``progress=`` takes it), else raise ValueError."""
    plain = scalar(value)
    if value is None or callable(value) and not isinstance(value, type):
        return value
    if isinstance(plain, bool | np.bool_):
        return bool(plain)
    raise refused(owner, name, value, "True, False, or a function")


def flag(owner: str, name: str, value) -> bool:
    """Return ``value`` when it is True or False, else raise ValueError."""
    plain = scalar(value)
    if isinstance(plain, bool | np.bool_):
        return bool(plain)
    raise refused(owner, name, value, "True or False")


def word(owner: str, name: str, value) -> str:
    """Return ``value`` when it is a text that is not empty, else raise ValueError."""
    if not isinstance(value, str) or not value:
        raise refused(owner, name, value, "a name, in quotes")
    return plain_text(value)


def path(owner: str, name: str, value):
    """Return ``value`` when it names a file, else raise ValueError."""
    try:
        text = os.fspath(value)
    except Exception:  # no path, or what the method of a foreign class raises
        text = None
    if not isinstance(text, str) or not text or "\0" in text:
        raise refused(owner, name, value, "the path of a file")
    return value


def function(owner: str, name: str, value, *, classes: bool = False):
    """Return ``value`` when it can be called, else raise ValueError; a class is no function, where it is not asked for."""
    if callable(value) and (classes or not isinstance(value, type)):
        return value
    raise refused(owner, name, value, "a class or a function" if classes else "a function")


def text(owner: str, name: str, value) -> str:
    """Return ``value`` when it is a text, empty or not, else raise ValueError."""
    if not isinstance(value, str):
        raise refused(owner, name, value, "a text")
    return plain_text(value)


def mapping(owner: str, name: str, value):
    """Return ``value`` when it is a mapping of names, else raise ValueError."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise refused(owner, name, value, "a mapping of names, such as {'q0': ...}")
    return value


def array(owner: str, name: str, value, *, axes: tuple[int, ...] = (1,), least: int = 1, count: int | None = None) -> np.ndarray:
    """Return ``value`` as a new array of finite floats, or raise ValueError unless it has so many axes and numbers."""
    found = floats(value)
    if (found is None or found.ndim not in axes or found.size < least or not np.isfinite(found).all()
            or (count is not None and found.size != count)):
        many = f"{count} " if count is not None else ""
        few = ", at least one" if found is not None and found.size < least == 1 else ""
        allowed = ("finite numbers, one or a list" if 0 in axes else "a table of finite numbers" if axes == (2,)
                   else f"a list of {many}finite numbers")
        raise refused(owner, name, value, allowed + few)
    return found


def vector(owner: str, name: str, value) -> tuple[float, ...]:
    """Return ``value`` as a tuple of finite floats, not empty, else raise ValueError."""
    return tuple(array(owner, name, value).tolist())


def pair(owner: str, name: str, value) -> tuple[float, float]:
    """Return ``value`` as two different numbers in their order; the ends of a range may be infinite."""
    found = floats(value)
    if found is None or found.shape != (2,) or not found[0] != found[1] or np.isnan(found).any():
        raise refused(owner, name, value, "two different numbers, (low, high)")
    return float(found[0]), float(found[1])


def listed(value) -> list | None:
    """Return what stands in a list, or in what can be gone through; None for sets, which have no order, and without an end."""
    try:
        items = None if isinstance(value, NO_LIST) else list(itertools.islice(value, MOST + 1))
    except Exception:  # no list, or what a foreign class raises
        return None
    return None if items is None or len(items) > MOST else items


def many(owner: str, name: str, value, *, of: Kind, count: int | None = None) -> list:
    """Return a list of what is of one kind, else raise ValueError."""
    items = listed(value)
    if items is None or count is not None and len(items) != count:
        raise refused(owner, name, value, f"a list{'' if count is None else f' of {count}'}")
    return [of(owner, f"{name}[{i}]", item) for i, item in enumerate(items)]


def either(*kinds: Kind, allowed: str) -> Kind:
    """Return the kind of what is of any of some kinds."""
    def kind(owner: str, name: str, value):
        for one in kinds:
            try:
                return one(owner, name, value)
            except ValueError:
                pass
        raise refused(owner, name, value, allowed)
    return kind


def instance(where: str, allowed: str) -> Kind:
    """Return the kind of objects of a class, given as ``module:Class``; nothing is imported: what is one has loaded its module."""
    module, _, name = where.partition(":")

    def kind(owner: str, argument: str, value):
        cls = getattr(sys.modules.get(module), name, None)
        if cls is None or not isinstance(value, cls):
            raise refused(owner, argument, value, allowed)
        return value
    return kind


def like(allowed: str, *names: str) -> Kind:
    """Return the kind of anything with attributes of these names, as pictures take it."""
    def kind(owner: str, argument: str, value):
        try:
            good = not isinstance(value, type) and all(hasattr(value, name) for name in names)
        except Exception:  # what the attributes of a foreign class raise
            good = False
        if not good:
            raise refused(owner, argument, value, allowed)
        return value
    return kind


def executor(owner: str, name: str, value):
    """Return ``value`` when chunks of work can be handed to it or to what it makes, else raise ValueError."""
    if callable(value) and not isinstance(value, type) or isinstance(value, type) and hasattr(value, "submit"):
        return value
    return like(EXECUTOR, "submit")(owner, name, value)


def of(kind: Callable, **limits) -> Kind:
    """Return a kind within limits: ``of(whole, least=1)``."""
    return functools.partial(kind, **limits)


def checked(**special: Kind | None) -> Callable[[F], F]:
    """Return the decorator of a public verb, method or record that checks arguments before the body sees them.

    An argument without a default is always checked; one that is its default is not, so that None is allowed where it is one.

    Parameters
    ----------
    **special
        Kinds of arguments where they differ from those of their names in `KINDS`; None: the body checks it.
    """
    def decorate(made):
        if isinstance(made, type):
            made.__init__ = decorate(made.__init__)
            return made
        code, owner = made.__code__, made.__qualname__.removesuffix(".__init__")
        count, keys = code.co_argcount, code.co_varnames[:code.co_argcount + code.co_kwonlyargcount]
        defaults = dict(zip(keys[count - len(made.__defaults__ or ()):count], made.__defaults__ or (), strict=True))
        defaults |= made.__kwdefaults__ or {}
        kinds = {key: (kind, defaults.get(key, NOTHING)) for key in keys if (kind := special.get(key, KINDS.get(key))) is not None}
        first = [(key, *kinds.get(key, (None, NOTHING))) for key in keys[:count]]

        @functools.wraps(made)
        def verb(*given, **named):
            if given:
                given = (*[value if kind is None or value is default else kind(owner, key, value)
                           for value, (key, kind, default) in zip(given, first, strict=False)], *given[len(first):])
            for key, value in named.items():
                if key in kinds and value is not kinds[key][1]:
                    named[key] = kinds[key][0](owner, key, value)
            return made(*given, **named)

        return verb

    return decorate


NOTHING = object()
EXECUTOR = ("a concurrent.futures.Executor (or have its submit), a dask.distributed.Client, a function that makes one, or None for "
            "threads")
NO_LIST = Mapping | set | frozenset | str | bytes | bytearray | memoryview | np.generic
MOST = 10**6  # of a list of things
LARGEST = 10**12  # a count beyond it is a mistake; what is made of it must fit the integers of compiled loops

SYSTEM = instance("bifurc.system:System", "a System, such as bifurc.systems.impact_oscillator(omega=0.6)")
ORBIT = instance("bifurc.orbits.orbit:PeriodicOrbit", "a PeriodicOrbit, see find_orbit")
BALANCE = instance("bifurc.orbits.balance.harmonic_orbit:HarmonicOrbit", "a HarmonicOrbit")
MOTION = instance("bifurc.motion:Motion", "a motion: of simulate, find_orbit, an attractor of a map")
TRAJECTORY = instance("bifurc.flow.trajectory:Trajectory", "a Trajectory, see simulate")
BRANCH = instance("bifurc.continuation.branches.branch:Branch", "a Branch, see trace")
POINT = instance("bifurc.continuation.branches.special:SpecialPoint",
                 "a special point of a branch, such as branch.special_points[0]")
GRID = instance("bifurc.ensemble.grid:Grid", "a Grid, such as Grid(q0=(-3, 1, 200), v0=(-4, 4, 200))")
SECTION = instance("bifurc.ensemble.section:Section", "a Section, such as Section('q0')")
BASINS = instance("bifurc.basins.maps.basin_map:BasinMap", "a BasinMap, see basins_of_attraction")
EDGE = like("an EdgeState, see edge_state", "saddle", "unstable_directions")
METHOD = instance("bifurc.orbits.balance.method:HarmonicBalance", "a HarmonicBalance, such as HarmonicBalance(harmonics=7)")
AXES = instance("matplotlib.axes:Axes", "Axes of matplotlib")
ELEMENTS = of(many, of=instance("bifurc.elements.element:Element", "an instance of Element"))
COUNT, PLACE = of(whole, least=1), of(whole, least=0)
MOVING = like("a motion, such as simulate and find_orbit give it", "sample", "system")
DRAWN = like("a branch, such as trace gives it", "column", "parameter", "special_points")
ALL_DRAWN = of(many, of=DRAWN)
SADDLE = like("an orbit or an EdgeState", "sections")
SET = like("an UnstableSet or a StableSet", "points", "curves")
EQUATIONS = like("a Problem, see bifurc.continuation.Problem", "x0", "scale", "residual", "jacobian", "correct")
UNKNOWNS = of(array, axes=(0, 1))
_ONE = either(PLACE, word, allowed="a number or a name")
KEPT = either(_ONE, of(many, of=either(_ONE, of(many, of=_ONE, count=2), allowed="a number, a name or a pair (node, direction)")),
              allowed="degrees of freedom: numbers, names or pairs (node, direction)")
FED = of(choice, allowed=("displacement", "velocity"))
POINTS = of(whole, least=1, most=10**8)  # as many as a memory holds
POSITIVE = of(number, above=0.0)
RATIO = of(number, least=0.0)

# what arguments mean by their names
KINDS: dict[str, Kind] = {name: kind for kind, names in (
    (SYSTEM, "system"), (ORBIT, "orbit"), (BRANCH, "branch"), (POINT, "point"), (GRID, "grid"), (SECTION, "section"),
    (BASINS, "basins"), (EDGE, "edge"), (METHOD, "method"), (MOTION, "motion"), (AXES, "ax"), (of(many, of=AXES, count=2), "axes"),
    (of(many, of=BRANCH), "branches"), (of(many, of=of(function, classes=True)), "elements"),
    (word, "parameter second measure field element of past"),
    (number, "value gain t0 amplitude energy"), (POSITIVE, "ds ds_max ds_min distance period gap low high"),
    (of(number, above=0.0, most=0.1), "tolerance"), (pair, "bounds"), (array, "values"),
    (of(whole, least=0, most=2**63), "seed"), (PLACE, "dof mode transient max_steps component group"),
    (COUNT, "workers max_periods max_events periods chunk keep most longest starts batches steps n_max cells count side probes "
            "most_branches frames rate"), (of(whole, least=64, most=100_000), "precision"),
    (POINTS, "n samples"), (of(choice, allowed=(1, -1)), "direction closure"),
    (switch, "progress"), (flag, "stretches exponents symmetric browser"), (function, "stop record"), (executor, "executor"),
    (path, "file path"), (mapping, "at region window"),
) for name in names.split()}

# how a field of a record or an argument is declared: its kind, and whether it may be None
DECLARED: dict[Any, tuple[Kind, bool]] = {
    declared: (kind, optional)
    for cls, kind in ((float, number), (int, whole), (bool, flag))
    for optional, both in ((False, (cls, cls.__name__)), (True, (cls | None, f"{cls.__name__} | None"))) for declared in both}
DECLARED |= {str | None: (word, True), "str | None": (word, True)}
