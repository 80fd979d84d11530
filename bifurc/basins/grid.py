"""Grid of starts: a rectangle over two components of the state at phase 0."""
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, init=False)
class Grid:
    """Cells over two components of the start; a cell stands for its centre.

    Parameters
    ----------
    at : mapping of str to float, optional
        Values of other components of the start, such as ``{"q1": 0.2}``; those not named are 0.
    **ranges : (low, high, cells)
        Exactly two components by name (``q0`` is the first coordinate, ``v0`` its velocity): bounds and number of
        cells.  The first named one is the first axis of ``labels``.

    Attributes
    ----------
    names : tuple of str
    low, high : tuple of float
        Bounds, in the unit of the component.
    shape : tuple of int
        Numbers of cells.
    at : dict

    Raises
    ------
    ValueError
        Not two components, unknown names, an empty or infinite range, no cells.

    Examples
    --------
    >>> Grid(q0=(-3, 1, 400), v0=(-4, 4, 400)).shape
    (400, 400)
    """

    names: tuple[str, str]
    low: tuple[float, float]
    high: tuple[float, float]
    shape: tuple[int, int]
    at: dict[str, float]

    def __init__(self, *, at: Mapping[str, float] | None = None, **ranges):
        if len(ranges) != 2:
            raise ValueError(f"Grid: {len(ranges)} components are given ({', '.join(ranges) or 'none'}); a grid has "
                             "exactly two, such as Grid(q0=(-3, 1, 400), v0=(-4, 4, 400))")
        sides = [_side(name, value) for name, value in ranges.items()]
        fixed = {}
        for name, value in (at or {}).items():
            _named(name)
            if name in ranges:
                raise ValueError(f"Grid: at = {dict(at or {})!r} fixes {name}, which the grid runs over")
            fixed[name] = _number(f"at[{name!r}]", value)
        for field, content in (("names", tuple(ranges)), ("low", tuple(side[0] for side in sides)),
                               ("high", tuple(side[1] for side in sides)), ("shape", tuple(side[2] for side in sides)),
                               ("at", fixed)):
            object.__setattr__(self, field, content)

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    def centres(self, axis: int) -> np.ndarray:
        """Return the centres of the cells along an axis, shape (cells,)."""
        low, high, cells = self.low[axis], self.high[axis], self.shape[axis]
        return low + (np.arange(cells) + 0.5) * ((high - low) / cells)

    def places(self, n: int, ns: int) -> tuple[int, int]:
        """Return the places of the two components in the state (q, v, z) of ``n`` degrees of freedom.

        Raises
        ------
        ValueError
            When the system has not this component.
        """
        return tuple(_place(name, n) for name in self.names)  # type: ignore[return-value]

    def base(self, n: int, ns: int) -> np.ndarray:
        """Return the state (ns,) with the fixed components, 0 on the grid's own."""
        state = np.zeros(ns)
        for name, value in self.at.items():
            state[_place(name, n)] = value
        return state

    def starts(self, n: int, ns: int) -> np.ndarray:
        """Return the starts (cells, ns), the second axis fastest."""
        first, second = self.places(n, ns)
        states = np.tile(self.base(n, ns), (self.size, 1))
        states[:, first] = np.repeat(self.centres(0), self.shape[1])
        states[:, second] = np.tile(self.centres(1), self.shape[0])
        return states

    def to_record(self) -> dict:
        """Return the grid as JSON knows it."""
        return {"ranges": {name: [low, high, cells] for name, low, high, cells in
                           zip(self.names, self.low, self.high, self.shape, strict=True)}, "at": self.at}

    @classmethod
    def from_record(cls, record: dict) -> "Grid":
        """Make the grid that `to_record` described."""
        return cls(at=record["at"], **record["ranges"])

    def __hash__(self):
        return hash((self.names, self.low, self.high, self.shape, tuple(sorted(self.at.items()))))

    def __repr__(self):
        sides = [f"{name}=({low:g}, {high:g}, {cells})" for name, low, high, cells in
                 zip(self.names, self.low, self.high, self.shape, strict=True)]
        return f"Grid({', '.join(sides)}{f', at={self.at}' if self.at else ''})"


def _named(name: str) -> tuple[str, int]:
    match = re.fullmatch(r"([qv])(0|[1-9]\d*)", name)
    if match is None:
        raise ValueError(f"Grid: component {name!r} is unknown; components are q0, q1, ... (coordinates) and "
                         "v0, v1, ... (velocities)")
    return match[1], int(match[2])


def _place(name: str, n: int) -> int:
    kind, index = _named(name)
    if index >= n:
        raise ValueError(f"Grid: component {name!r} is unknown to this system; it has {n} degree{'s' * (n > 1)} of "
                         f"freedom: q0 .. q{n - 1} and v0 .. v{n - 1}")
    return index if kind == "q" else n + index


def _side(name: str, value) -> tuple[float, float, int]:
    _named(name)
    try:
        low, high, cells = value
    except (TypeError, ValueError):
        raise ValueError(f"Grid: {name} = {value!r} is not allowed; it must be (low, high, cells)") from None
    low, high = _number(name, low), _number(name, high)
    if not low < high:
        raise ValueError(f"Grid: {name} = {value!r} is not allowed; its low bound must be below its high bound")
    if isinstance(cells, bool) or not isinstance(cells, (int, np.integer)) or cells < 1:
        raise ValueError(f"Grid: {name} = {value!r} is not allowed; the number of cells must be a whole number of at "
                         "least 1")
    return low, high, int(cells)


def _number(name: str, value) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"Grid: {name} = {value!r} is not allowed; it must be a finite number") from None
    if not np.isfinite(number):
        raise ValueError(f"Grid: {name} = {value!r} is not allowed; it must be finite")
    return number
