"""Problems F(u, a, b) = 0 in two parameters: for every value of b the one-parameter problem in a.

`family_of(problem, name, bounds)` asks the problem (``problem.family_over(name, bounds)``: orbits answer with numbers of the
system that are sampled once over both intervals), and otherwise varies a plain number that the problem has as an attribute,
which is all that a hand-written problem needs.
"""
import copy
import math

import numpy as np

from ..compose.scene import beside
from ..orbits.shooting.path import CHECKS, DEGREES, NOISE, PAD, ROUNDING, TOLERANCE, ParameterPath, fitted, noise
from ..system import require_values
from .conditions import finite_scale

PLACES = ((-0.95, 0.211), (-0.187, -0.97), (0.417, -0.437), (0.975, 0.655))  # in [-1, 1]^2, where a product of series is checked


class Family:
    """Problems of one kind over a second parameter.

    Attributes
    ----------
    problem : Problem
        The one that was given.
    name : str
        The second parameter b.
    value : float
        Its value in ``problem``.
    interval : tuple of float
        Values of b that were asked for.
    scale : ndarray (n + 2,)
        Natural sizes of (u, a, b).
    """

    def __init__(self, problem, name, value, size, interval=(-math.inf, math.inf)):
        self.interval = interval
        self.problem, self.name, self.value = problem, name, float(value)
        first = finite_scale(problem.scale, problem.x0)
        self.scale = np.append(first, size)

    def at(self, value):
        """Return the problem in a at ``b = value``; it may be reused by the next call."""
        raise NotImplementedError

    def alone(self, value):
        """Return the problem in a at ``b = value`` as one that is kept."""
        return copy.copy(self.at(value))

    def over(self, low, high):
        """Return the family defined for b between two values."""
        return self


class AttributeFamily(Family):
    """b is an attribute of a hand-written problem."""

    def __init__(self, problem, name, size, interval):
        value = getattr(problem, name, None)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            numbers = [key for key, item in vars(problem).items() if isinstance(item, float) and not key.startswith("_")]
            raise ValueError(f"{type(problem).__name__} has no second parameter {name!r}: it must be a plain number that is an "
                             f"attribute of the problem; there are {', '.join(numbers) or 'none'}")
        super().__init__(problem, name, value, size, interval)
        self._copy = copy.copy(problem)

    def at(self, value):
        """See `Family.at`."""
        setattr(self._copy, self.name, float(value))
        return self._copy


class PathFamily(Family):
    """b moves the numbers of a system: Chebyshev series in a whose coefficients are Chebyshev series in b.

    Parameters
    ----------
    problem : Problem
        With ``path`` (a `ParameterPath` or alike: ``index``, ``series``, ``low``, ``high``) and
        ``on_path(path) -> Problem``, the same equations with other numbers.
    name : str
    value, size : float
    sample : callable
        ``sample(a, b) -> ndarray``, the packed numbers of the system.
    bounds : tuple of float
        Interval of b.
    make : callable
        ``make(index, series, low, high) -> path``.
    """

    def __init__(self, problem, name, value, size, sample, bounds, make):
        super().__init__(problem, name, value, size, bounds)
        self._sample, self._make = sample, make
        low, high = problem.path.low, problem.path.high
        self._a = (low, high)
        self._b, self._index, self._series = surface(sample, (low, high), bounds, name)
        self._last = (math.nan, None)

    def __reduce__(self):
        return family_of, (self.problem, self.name, self.interval)  # the numbers are sampled again: their builder travels

    def at(self, value):
        """See `Family.at`."""
        if value != self._last[0]:
            low, high = self._b
            z = (2.0 * value - low - high) / (high - low)
            order = np.arange(self._series.shape[2])
            weights = np.cos(order * math.acos(z)) if abs(z) <= 1.0 else np.cosh(order * math.acosh(abs(z))) * np.sign(z)**order
            series = np.ascontiguousarray(self._series @ weights)
            self._last = (value, self.problem.on_path(self._make(self._index, series, *self._a)))
        return self._last[1]

    def alone(self, value):
        """See `Family.alone`: with the system it belongs to, so that its solutions name the right one."""
        made = copy.copy(self.at(value))
        made.system = beside(made.system, self.name, float(value), 0.5 * sum(self._b))
        return made

    def of(self, problem) -> "PathFamily":
        """Return the same numbers under the equations of another problem."""
        other = copy.copy(self)
        other.problem, other._last = problem, (math.nan, None)
        return other

    def over(self, low, high):
        """See `Family.over`."""
        if self._b[0] <= low and high <= self._b[1]:
            return self
        bounds = (min(low, self._b[0]), max(high, self._b[1]))
        return PathFamily(self.problem, self.name, self.value, self.scale[-1], self._sample, bounds, self._make)


def surface(sample, first, second, name):
    """Return ((low, high) of b, index (k,), series (k, da, db)) of the numbers ``sample(a, b)`` that change.

    Raises
    ------
    ValueError
        When no product of polynomials fits them to rounding.
    """
    low, high = second
    wide = high - low
    a, b = low - PAD * wide, high + PAD * wide
    middle, half = 0.5 * (first[0] + first[1]), 0.5 * (first[1] - first[0])
    try:
        for end in (a, b):
            sample(middle, end)
    except ValueError:
        a, b = low, high
    centre, radius = 0.5 * (a + b), 0.5 * (b - a)

    def across(y):  # along a, at some values of b
        return np.concatenate([sample(y, centre + radius * z) for z in CHECKS])

    def along(z):  # along b, at some values of a
        return np.concatenate([sample(middle + half * y, z) for y in CHECKS])

    one, two = degree_of(across, middle, half), degree_of(along, centre, radius)
    if one is not None and two is not None:
        angles = [math.pi * (np.arange(degree + 1) + 0.5) / (degree + 1) for degree in (one, two)]
        values = np.array([[sample(middle + half * y, centre + radius * z) for z in np.cos(angles[1])] for y in np.cos(angles[0])])
        checks = np.array([sample(middle + half * y, centre + radius * z) for y, z in PLACES])
        index = np.flatnonzero(np.any(values != checks[0], axis=(0, 1)) | np.any(checks != checks[0], axis=0))
        values, checks = values[:, :, index], checks[:, index]
        transforms = [2.0 / angle.size * np.cos(np.outer(np.arange(angle.size), angle)) for angle in angles]
        for transform in transforms:
            transform[0] *= 0.5
        series = np.einsum("iy,jz,yzk->kij", *transforms, values)
        size = np.abs(values).max(axis=(0, 1), initial=0.0) + np.abs(checks).max(axis=0, initial=0.0)
        series[np.abs(series) < 4e-16 * size[:, None, None]] = 0.0
        waves = [np.cos(np.outer(np.arccos(place), np.arange(angle.size)))
                 for place, angle in zip(zip(*PLACES, strict=True), angles, strict=True)]
        found = np.einsum("kij,pi,pj->pk", series, *waves)
        allowed = 2.0 * max(TOLERANCE, ROUNDING * math.sqrt(one + two + 1.0)) * size + 1e-300
        away = np.abs(found - checks)
        if not np.all(away <= allowed):  # numbers in which larger ones cancel carry more than their own rounding
            allowed += NOISE * noise(across, middle, half).reshape(len(CHECKS), -1).max(axis=0)[index]
        if np.all(away <= allowed):
            used = [int(np.max(np.nonzero(np.any(series != 0.0, axis=axes))[0], initial=0)) + 1 for axes in ((0, 2), (0, 1))]
            return (a, b), index, np.ascontiguousarray(series[:, :used[0], :used[1]])
    raise ValueError(f"{name} between {low:g} and {high:g}: the system's numbers are no smooth function of both parameters "
                     "(no polynomial fits to rounding); choose narrower bounds")


def degree_of(sample, middle, half):
    """Return the degree of the polynomial that fits ``sample(value)`` over middle +- half to rounding, None where none does."""
    checks = np.array([sample(middle + half * z) for z in CHECKS])
    for exact in (True, False):  # numbers in which larger ones cancel carry more than their own rounding
        own = 0.0 if exact else NOISE * noise(sample, middle, half)
        for degree in DEGREES:
            if fitted(sample, middle, half, checks, (degree,), own) is not None:
                return degree
    return None


def family_of(problem, name, bounds):
    """Return the family of ``problem`` over ``name`` between ``bounds``, which may be infinite for hand-written problems."""
    own = problem.family_over(name, bounds)
    if own is not None:
        return own
    width = 0.5 * (bounds[1] - bounds[0])
    value = getattr(problem, name, 1.0)
    size = width if math.isfinite(width) else max(1.0, abs(value) if isinstance(value, (int, float)) else 1.0)
    return AttributeFamily(problem, name, size, bounds)


def orbit_family(problem, name, bounds):
    """Return the family of an orbit problem (``system``, ``scene``, ``path``, ``parameter``, ``on_path``)."""
    system, scene, first = problem.system, problem.scene, problem.parameter
    name = system.parameter_name(name)
    value = system.parameter(name)
    if name == first:
        raise ValueError(f"the two parameters must differ, got {name!r} twice")
    low, high = bounds
    if not (math.isfinite(low) and math.isfinite(high)):
        raise ValueError(f"bounds of {name!r} must be finite, got {bounds!r}")
    require_values(system, "bounds", name, bounds)

    def sample(a, b):
        return scene.flat_of(system.with_parameters(**{first: float(a), name: float(b)}))

    tables = scene.refill(system)  # its own: the numbers that b moves are constants of the problem's path

    def make(index, series, a, b):
        return ParameterPath(tables, first, index, series, a, b)
    return PathFamily(problem, name, value, 0.5 * (high - low), sample, bounds, make)
