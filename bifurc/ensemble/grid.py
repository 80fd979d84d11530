"""Grid of starts: boxes over components of the state at phase 0, in any number of dimensions, some of them periodic."""
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import COUNT, POSITIVE, array, checked, choice, floats, listed, many, number, of, refused, text, whole, word
from ..structure.components import named, place_of

SHARE = 0.5  # of the machine's memory that a grid may need


@dataclass(frozen=True, init=False)
class Grid:
    """Cells over components of the start; a cell stands for its centre.

    Parameters
    ----------
    at : mapping of str to float, optional
        Values of other components of the start, such as ``{"q1": 0.2}``; those not named are 0, memory is that of the virgin state.
    periodic : iterable of str, optional
        Components that count modulo their range, such as an angle: ``periodic=("q0",)``.
    **ranges : (low, high, cells)
        Components by name (``q0`` is the first coordinate, ``v0`` its velocity, ``w0`` the first memory: where a slider is; of
        a system of first order its own names): bounds and number of cells.  The first named one is the first axis of ``labels``.

    Attributes
    ----------
    names : tuple of str
    low, high : tuple of float
        Bounds, in the unit of the component.
    shape : tuple of int
        Numbers of cells.
    at : dict
    periodic : tuple of str

    Raises
    ------
    ValueError
        No component, unknown names, an empty, reversed or infinite range, no cells.

    Examples
    --------
    >>> Grid(q0=(-3, 1, 400), v0=(-4, 4, 400)).shape
    (400, 400)
    """

    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    shape: tuple[int, ...]
    at: dict[str, float]
    periodic: tuple[str, ...]

    @checked(periodic=None)
    def __init__(self, *, at: Mapping[str, float] | None = None, periodic: Iterable[str] = (), **ranges):
        if not ranges:
            raise ValueError("Grid: no components are given; write for example Grid(q0=(-3, 1, 400), v0=(-4, 4, 400))")
        sides = [_side(name, value) for name, value in ranges.items()]
        fixed = {}
        for name, value in (at or {}).items():
            named(name, "Grid: at")
            if name in ranges:
                raise ValueError(f"Grid: at = {dict(at or {})!r} fixes {name}, which the grid runs over")
            fixed[name] = number("Grid", f"at[{name!r}]", value)
        if not isinstance(periodic, str | list | tuple | np.ndarray):
            raise refused("Grid", "periodic", periodic, "the name of a component that the grid runs over, or a list of them")
        wraps = (periodic,) if isinstance(periodic, str) else tuple(many("Grid", "periodic", periodic, of=word))
        for name in wraps:
            choice("Grid", "periodic", name, tuple(ranges))
        for field, content in (("names", tuple(ranges)), ("low", tuple(side[0] for side in sides)),
                               ("high", tuple(side[1] for side in sides)), ("shape", tuple(side[2] for side in sides)),
                               ("at", fixed), ("periodic", tuple(name for name in ranges if name in wraps))):
            object.__setattr__(self, field, content)

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @property
    def widths(self) -> np.ndarray:
        """Sides of a cell, one a component, shape (d,)."""
        return (np.array(self.high) - np.array(self.low)) / np.array(self.shape)

    def centres(self, axis: int) -> np.ndarray:
        """Return the centres of the cells along an axis, shape (cells,)."""
        axis = whole("Grid.centres", "axis", axis, least=0, most=len(self.names) - 1)
        low, high, cells = self.low[axis], self.high[axis], self.shape[axis]
        return low + (np.arange(cells) + 0.5) * ((high - low) / cells)

    @checked(cells=None, offset=of(array, axes=(0, 1, 2)))
    def points(self, cells: np.ndarray, offset=0.5) -> np.ndarray:
        """Return points (k, d) of the grid's own components in cells given by number.

        ``offset`` (scalar or d numbers in 0 .. 1) is the place in the cell: 0.5 its centre.
        """
        places: Any = np.empty(0) if floats(cells) is None else np.asarray(cells)
        if places.dtype.kind not in "iu" or places.size and not 0 <= places.min() <= places.max() < self.size:
            raise refused("Grid.points", "cells", cells, f"numbers of cells, 0 to {self.size - 1}")
        where = np.stack(np.unravel_index(places, self.shape), axis=-1)
        if np.min(offset) < 0.0 or np.max(offset) > 1.0:
            raise refused("Grid.points", "offset", offset, "from 0 to 1")
        if np.ndim(offset) and np.shape(offset)[-1] != len(self.names) or np.ndim(offset) > where.ndim:
            raise refused("Grid.points", "offset", offset, f"a number, or {len(self.names)} numbers a cell")
        return np.array(self.low) + (where + offset) * self.widths

    def _rows(self, points) -> np.ndarray:
        """Return points (k, d) of the grid's own components as floats, finite or not, or raise ValueError."""
        found = points if isinstance(points, np.ndarray) and points.dtype == float else floats(points)
        if found is None or found.ndim != 2 or found.shape[1] != len(self.names):
            raise refused("Grid", "points", points, f"numbers of shape (k, {len(self.names)}), points of the grid")
        return found

    def wrapped(self, points: np.ndarray) -> np.ndarray:
        """Return points (k, d) with periodic components brought into their range."""
        points = self._rows(points)
        if not self.periodic:
            return points
        points = np.array(points, float)
        for axis, name in enumerate(self.names):
            if name in self.periodic:
                low, span = self.low[axis], self.high[axis] - self.low[axis]
                points[:, axis] = low + np.mod(points[:, axis] - low, span)
        return points

    def cells_of(self, points: np.ndarray) -> np.ndarray:
        """Return the numbers (k,) of the cells that hold points (k, d) of the grid's own components; -1: outside.

        A cell holds its lower faces, not its upper ones.  Points that are not finite are outside.
        """
        points = self._rows(points)
        found = np.zeros(len(points), np.int64)
        inside = np.isfinite(points).all(axis=1)
        safe = self.wrapped(np.where(inside[:, None], points, 0.0))
        for axis, cells in enumerate(self.shape):
            place = np.floor((safe[:, axis] - self.low[axis]) / self.widths[axis])
            if self.names[axis] in self.periodic:
                place = np.minimum(place, cells - 1)  # rounding of the remainder may give the upper face itself
            inside &= (place >= 0) & (place < cells)
            found = found * cells + np.clip(place, 0, cells - 1).astype(np.int64)
        return np.where(inside, found, -1)

    @checked(n=of(whole, least=0), ns=COUNT)
    def places(self, n: int, ns: int, states: Sequence[str] = ()) -> tuple[int, ...]:
        """Return the places of the components in the state (q, v, w) of ``n`` degrees of freedom; ``states`` see `System.states`.

        Raises
        ------
        ValueError
            When the system has not this component.
        """
        return tuple(place_of(name, n, ns, "grid", states) for name in self.names)

    @checked(ns=COUNT)
    def base(self, n: int, ns: int, states: Sequence[str] = ()) -> np.ndarray:
        """Return the state (ns,) with the fixed components, 0 elsewhere."""
        state = np.zeros(ns)
        for name, value in self.at.items():
            state[place_of(name, n, ns, "grid", states)] = value
        return state

    @checked(ns=COUNT)
    def starts(self, n: int, ns: int, states: Sequence[str] = ()) -> np.ndarray:
        """Return the starts (cells, ns), the last axis fastest; memory that is not named is 0."""
        found = np.tile(self.base(n, ns, states), (self.size, 1))
        after = self.size
        for axis, place in enumerate(self.places(n, ns, states)):
            before = self.size // after
            after //= self.shape[axis]
            found[:, place] = np.tile(np.repeat(self.centres(axis), after), before)
        return found

    @checked(bytes_a_cell=POSITIVE, what=text)
    def require(self, bytes_a_cell: float, what: str) -> None:
        """Refuse work that would not fit: say the memory before it is taken.

        Raises
        ------
        MemoryError
            When ``bytes_a_cell`` times the number of cells exceeds half of the machine's memory.
        """
        need, have = bytes_a_cell * self.size, _memory()
        if need > SHARE * have:
            raise MemoryError(f"grid = {self!r} has {self.size:.3g} cells; {what} needs about {_bytes(need)}, and half of this "
                              f"machine's memory, {_bytes(SHARE * have)}, is allowed: write at most "
                              f"{int(SHARE * have / bytes_a_cell):.2g} cells, or map parts of the region one after the other")

    def to_record(self) -> dict:
        """Return the grid as JSON knows it."""
        return {"ranges": {name: [low, high, cells] for name, low, high, cells in
                           zip(self.names, self.low, self.high, self.shape, strict=True)},
                "at": self.at, **({"periodic": list(self.periodic)} if self.periodic else {})}

    @classmethod
    def from_record(cls, record: dict) -> "Grid":
        """Make the grid that `to_record` described."""
        return cls(at=record["at"], periodic=record.get("periodic", ()), **record["ranges"])

    def __hash__(self):
        return hash((self.names, self.low, self.high, self.shape, tuple(sorted(self.at.items())), self.periodic))

    def __repr__(self):
        sides = [f"{name}=({low:g}, {high:g}, {cells})" for name, low, high, cells in
                 zip(self.names, self.low, self.high, self.shape, strict=True)]
        sides += [f"at={self.at}"] * bool(self.at) + [f"periodic={self.periodic}"] * bool(self.periodic)
        return f"Grid({', '.join(sides)})"


def _memory() -> float:
    """Return the machine's memory in bytes; where it is not told, 8 GB."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return 8e9


def _bytes(number: float) -> str:
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if number >= size:
            return f"{number / size:.3g} {unit}"
    return f"{number / 1e3:.3g} kB"


def _side(name: str, value) -> tuple[float, float, int]:
    named(name, "Grid")
    given = listed(value)
    if given is None or len(given) != 3:
        raise refused("Grid", name, value, "(low, high, cells)")
    low, high = (number("Grid", name, item) for item in given[:2])
    if not low < high:
        raise refused("Grid", name, value, "(low, high, cells), and its low bound must be below its high bound")
    return low, high, whole("Grid", f"number of cells of {name}", given[2], least=1)
