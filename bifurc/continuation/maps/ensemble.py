"""Many iterations of a map at once: Lyapunov exponents with standard errors, diagrams over a parameter."""
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import plotting
from ...checks import checked
from ...content import Content


@dataclass(frozen=True, eq=False)
class MapExponents(Content):
    """Lyapunov exponents of a map an iteration.

    Attributes
    ----------
    values : ndarray (d,)
        Largest first; -inf where a direction dies.
    errors : ndarray (d,)
        Standard errors from independent starts.
    """

    values: np.ndarray
    errors: np.ndarray

    @property
    def chaotic(self) -> bool:
        """Whether the largest exponent is positive by more than four standard errors."""
        return bool(self.values[0] > max(0.0, 4.0 * self.errors[0]))


@dataclass(frozen=True, eq=False)
class MapDiagram(Content):
    """Iterates left after a transient over values of a parameter.

    Attributes
    ----------
    map : Map
    parameter : str
    values : ndarray (m,)
    points : ndarray (m, keep, d)
        NaN where the iterates left every bound.
    periods : ndarray of int (m,)
        After which they repeat; 0: not within half of ``keep``.
    """

    map: Any
    parameter: str
    values: np.ndarray = field(repr=False)
    points: np.ndarray = field(repr=False)
    periods: np.ndarray = field(repr=False)

    @checked()
    def plot(self, ax=None, component: int = 0):
        """Draw a component of the iterates over the parameter; return the axes."""
        return plotting.plot_map_diagram(self, ax, component)


def exponents(system, x0, iterations, starts, transient) -> MapExponents:
    """Return the exponents over ``iterations`` from ``starts`` points around ``x0`` after a transient.

    Raises
    ------
    ArithmeticError
        When iterates leave every bound.
    """
    if starts < 4 or iterations < 10:
        raise ValueError(f"starts = {starts!r} must be at least 4 and iterations = {iterations!r} at least 10")
    d = system.dimension
    first = system._point(x0)
    spread = 1e-3 * (1e-3 + np.abs(first)) * np.linspace(-1.0, 1.0, starts)[:, None]
    x = first + spread
    with np.errstate(all="ignore"):
        for _ in range(transient):
            x = system.step(x)
        Q = np.broadcast_to(np.eye(d), (starts, d, d)).copy()
        sums = np.zeros((starts, d))
        for _ in range(iterations):
            Q, R = np.linalg.qr(system.slope(x) @ Q)
            sums += np.log(np.abs(np.diagonal(R, axis1=1, axis2=2)))
            x = system.step(x)
    if not np.isfinite(x).all():
        raise ArithmeticError(f"iterates of {system!r} leave every bound; start elsewhere")
    each = sums / iterations
    values = each.mean(axis=0)
    return MapExponents(values, each.std(axis=0, ddof=1) / np.sqrt(starts))


def diagram(system, parameter, values, x0, transient, keep) -> MapDiagram:
    """See `Map.diagram`."""
    values = np.array(values, float, ndmin=1)
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise ValueError(f"values of {parameter!r} must be finite numbers, got {values!r}")
    many = system._spread(parameter, values)
    x = np.broadcast_to(system._point(x0), (values.size, system.dimension)).copy()
    points = np.empty((values.size, keep, system.dimension))
    with np.errstate(all="ignore"):
        for _ in range(transient):
            x = many.step(x)
        for k in range(keep):
            points[:, k] = x
            x = many.step(x)
    points[~np.isfinite(points).all(axis=(1, 2))] = np.nan
    size = np.nanmax(np.abs(points), initial=1e-300)
    periods = np.zeros(values.size, int)
    for n in range(keep // 2, 0, -1):
        same = np.abs(points[:, keep - n:] - points[:, keep - 2 * n:keep - n]).max(axis=(1, 2)) <= 1e-9 * size
        periods[same] = n
    return MapDiagram(system, parameter, values, points, periods)
