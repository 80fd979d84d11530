"""Where a shown result comes from, as lines of Python that make it again bit for bit.

Every result carries how its line is written and the results which that line names.  A script is the lines of what is
shown and of everything below it, each once, what is needed first.
"""
import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .. import elements, systems
from ..system import Extended, System


@dataclasses.dataclass(frozen=True, eq=False)
class Made:
    """A result and its origin.

    Attributes
    ----------
    value : object
        Orbit, branch, start or basin map.
    kind : str
        What its variable is called; scripts add a number.
    write : callable
        ``write(script, *names)`` returns the right-hand side that makes it, from the names of what it needs.
    needs : tuple of Made
    """

    value: Any
    kind: str
    write: Callable[..., str] = dataclasses.field(repr=False)
    needs: tuple["Made", ...] = dataclasses.field(default=(), repr=False)


class Script:
    """Lines that make results again.

    Parameters
    ----------
    shown : iterable of Made

    Attributes
    ----------
    lines : list of str
        One assignment a result, what is needed first.
    modules : set of str
        Modules of the user's own that the lines name.
    """

    def __init__(self, shown: Iterable[Made]):
        self.lines: list[str] = []
        self.modules: set[str] = set()
        self._names: dict[int, str] = {}
        self._counts: dict[str, int] = {}
        for item in shown:
            self.add(item)

    def add(self, item: Made) -> str:
        """Write the lines of a result and of what it needs, where they are not there yet; return its name."""
        if id(item) not in self._names:
            names = [self.add(needed) for needed in item.needs]
            text = item.write(self, *names)
            self._counts[item.kind] = self._counts.get(item.kind, 0) + 1
            self._names[id(item)] = f"{item.kind}_{self._counts[item.kind]}"
            self.lines.append(f"{self._names[id(item)]} = {text}")
        return self._names[id(item)]

    @property
    def head(self) -> list[str]:
        """Import lines."""
        return ["import bifurc as bf", *(f"import {module}" for module in sorted(self.modules))]

    def literal(self, value: Any) -> str:
        """Return plain values, elements and laws as Python text that gives them back exactly.

        Raises
        ------
        ValueError
            For a value that has no such text.
        """
        if isinstance(value, np.ndarray | np.generic):
            return self.literal(value.tolist())
        if isinstance(value, float) and not math.isfinite(value):
            return f"float({str(value)!r})"
        if value is None or isinstance(value, bool | int | float | str):
            return repr(value)
        if isinstance(value, list):
            return f"[{', '.join(map(self.literal, value))}]"
        if isinstance(value, tuple):
            return f"({', '.join(map(self.literal, value))}{',' * (len(value) == 1)})"
        if isinstance(value, dict):
            return f"{{{', '.join(f'{self.literal(key)}: {self.literal(item)}' for key, item in value.items())}}}"
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            inside = [f"{field.name}={self.literal(getattr(value, field.name))}" for field in dataclasses.fields(value)
                      if field.init and not _default(field, getattr(value, field.name))]
            return f"{self.place(type(value))}({', '.join(inside)})"
        if callable(value):
            return self.place(value)
        raise ValueError(f"{value!r} cannot be written as a line of Python")

    def system(self, system: System) -> str:
        """Return the call that builds a system again."""
        if system._origin is not None:
            build, values = system._origin
            more = ""
            if isinstance(build, Extended):
                values = {name: value for name, value in values.items() if name not in build.fields}
                more = f".with_elements({self.literal([element for _, element in build.elements])})"
                build = build.source
            return f"{self.place(build)}({', '.join(f'{name}={self.literal(value)}' for name, value in values.items())}){more}"
        matrices = ", ".join(self.literal(getattr(system, name)) for name in ("mass", "damping", "stiffness"))
        return f"bf.System({matrices}, {self.literal(list(system.elements))}, omega={self.literal(system.omega)})"

    def place(self, item: Any) -> str:
        """Return how a script reaches a class or a function."""
        own = item.__name__
        for name, module in (("elements", elements), ("systems", systems)):
            if getattr(module, own, None) is item:
                return f"bf.{name}.{own}"
        self.modules.add(item.__module__)
        return f"{item.__module__}.{item.__qualname__}"


def grid_text(grid: Any) -> str:
    """Return the call that makes a grid again, every digit kept."""
    sides = [f"{name}=({low!r}, {high!r}, {cells})" for name, low, high, cells in
             zip(grid.names, grid.low, grid.high, grid.shape, strict=True)]
    sides += [f"{name}={value!r}" for name, value in (("at", grid.at), ("periodic", grid.periodic)) if value]
    return f"bf.Grid({', '.join(sides)})"


def _default(field: dataclasses.Field, value: Any) -> bool:
    return field.default is not dataclasses.MISSING and type(field.default) is type(value) and field.default == value
