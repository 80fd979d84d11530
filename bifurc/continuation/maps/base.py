"""A map x' = f(x; parameters), smooth or made of pieces: what its cycles, branches, diagrams and exponents need of it.

Every piece has coordinates u of its own in which it and the place of its points are smooth: place(u) = x, image(u) = f(x).  A
square root s = sqrt(x) is such a coordinate, so that cycles, and their derivatives, are regular at the border x = 0, where the
map has an infinite slope.
"""
import copy
import math
from typing import Any

import numpy as np

from ...checks import COUNT, checked, floats, number, of, refused, whole, word
from ...content import Content
from .ensemble import diagram, exponents
from .orbit import find_cycle


class Piece:
    """One smooth piece of a map.

    Attributes
    ----------
    symbol : str
        One letter; cycles are named by the symbols of their points.
    """

    symbol = "-"

    def place(self, u) -> tuple[np.ndarray, np.ndarray]:
        """Return the point x (d,) at the coordinates ``u`` (d,) and its derivative (d, d)."""
        return np.array(u, float), np.eye(np.size(u))

    def image(self, u, p) -> tuple[np.ndarray, np.ndarray]:
        """Return f (d,) at ``u`` (d,) and its derivative (d, d); ``p`` has the parameters as attributes."""
        raise NotImplementedError

    def inside(self, u) -> float:
        """Return a number that is negative where the piece holds, zero on its border; -inf without border."""
        return -math.inf

    def coordinates(self, x) -> np.ndarray:
        """Return u (d,) of a point x (d,) of this piece."""
        return np.array(x, float)


class Map(Content):
    """Base class of maps.  A subclass sets ``dimension``, ``names``, ``pieces`` and writes `step`, `slope` and `piece_of`.

    Parameters
    ----------
    **parameters : float
        Values of all ``names``; they are attributes.

    Raises
    ------
    ValueError
        For missing, unknown or non-finite parameters.
    """

    dimension = 1
    names: tuple[str, ...] = ()
    pieces: dict[str, Piece] = {}

    def __init__(self, **parameters):
        for name in self.names:
            if name not in parameters:
                raise ValueError(f"{type(self).__name__} needs {', '.join(self.names)}; {name!r} is missing")
        for name, value in parameters.items():
            if name not in self.names:
                raise ValueError(f"{type(self).__name__} has no parameter {name!r}; there are {', '.join(self.names)}")
            setattr(self, name, number(type(self).__name__, name, value))

    def _content(self) -> tuple:
        return tuple(self.parameters.items())

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name."""
        return {name: getattr(self, name) for name in self.names}

    def with_parameters(self, **parameters) -> "Map":
        """Return the map with other values of some parameters."""
        other = copy.copy(self)
        Map.__init__(other, **{**self.parameters, **parameters})
        return other

    def _spread(self, name, values) -> "Map":
        """Return the map with an array of values of one parameter, for `step` on as many points."""
        self.with_parameters(**{name: float(values[0])})  # says which names there are
        other = copy.copy(self)
        setattr(other, name, np.asarray(values, float))
        return other

    def step(self, x) -> np.ndarray:
        """Return f (..., d) at points (..., d)."""
        raise NotImplementedError

    def slope(self, x) -> np.ndarray:
        """Return the derivative of f (..., d, d) at points (..., d)."""
        raise NotImplementedError

    def piece_of(self, x) -> str:
        """Return the symbol of the piece that holds at a point (d,)."""
        raise NotImplementedError

    @checked(n=of(whole, least=0, most=10**8))
    def iterate(self, x0, n: int) -> np.ndarray:
        """Return x_0 .. x_n (n + 1, d)."""
        x = self._point(x0)
        found = np.empty((int(n) + 1, self.dimension))
        found[0] = x
        for k in range(int(n)):
            found[k + 1] = self.step(found[k])
        return found

    @checked(n=COUNT, itinerary=word)
    def find(self, n: int = 1, guess=None, itinerary: str | None = None) -> Any:
        """Return a cycle of period ``n``, see `orbit.MapOrbit`.

        Parameters
        ----------
        n : int
            Period.
        guess : array_like (d,), optional
            First point; default where the map has come to after 2000 iterations from the origin.
        itinerary : str, optional
            Symbols of the pieces in order; then the equations of these pieces are solved, and the orbit says whether its
            points lie in them. Default: the pieces that the iterates of the guess visit.
        """
        return find_cycle(self, n, guess, itinerary)

    @checked(iterations=of(whole, least=10), starts=of(whole, least=4))
    def exponents(self, x0=None, iterations: int = 4000, starts: int = 64, transient: int = 1000) -> Any:
        """Return the Lyapunov exponents an iteration, see `ensemble.exponents`."""
        return exponents(self, x0, iterations, starts, transient)

    @checked()
    def diagram(self, parameter: str, values, x0=None, transient: int = 2000, keep: int = 128) -> Any:
        """Return the iterates that are left after a transient over values of a parameter, see `ensemble.MapDiagram`."""
        return diagram(self, parameter, values, x0, transient, keep)

    def _point(self, x, name: str = "x0"):
        found = np.zeros(self.dimension) if x is None else floats(x)
        if found is None or np.atleast_1d(found).shape != (self.dimension,) or not np.isfinite(found).all():
            raise refused(type(self).__name__, name, x, f"a point of {self.dimension} finite numbers")
        return np.atleast_1d(found)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v:.6g}' for k, v in self.parameters.items())})"
