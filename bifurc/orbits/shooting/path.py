"""How the numbers of a scene depend on one parameter: Chebyshev series, so that a corrector changes it without Python.

A builder may do anything with its keywords; between two bounds its packed numbers are almost always polynomials (omega,
omega**2, 2 zeta) or analytic.  They are sampled through the builder and the series is checked at further points to
rounding level before it is trusted.
"""
import copy
import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from ...compose.modal import give_modal
from ...compose.scene import Scene
from ...compose.tables import Tables
from ...system import System, require_values

DEGREES = (4, 8, 16, 32, 64)
STEPS = 1e-9, 1.7e-9, 2.3e-9  # of half an interval, over which the rounding of numbers is looked at,
NOISE = 4.0  # and how much more there may be of it
CHECKS = (-0.873, -0.311, 0.537, 0.941)  # in [-1, 1], between the nodes of every degree
TOLERANCE = 2e-15  # relative; the sampled numbers carry an ulp or two
ROUNDING = 4.0 * 2.2e-16  # of a sum of many terms, for each root of their number
HALVINGS, LEAP = 40, 1e-3  # of the interval in which numbers leap; relative difference over what is left that is one
KEPT = 16  # series kept for systems that differ in the value of their parameter only: the branches of one diagram
FARTHEST = 10.0  # of a parameter, or of half the interval of its path: where a line through its numbers ends
SHAKEN = 1e-12  # relative change of all numbers that shows how a solution depends on them: twenty times what rounding makes of its
# flow, which blurs it by a twentieth, and no more, so that the solution stays within its sequence of events where that is short
EVEN = (0.6180339887498949, 0.7548776662466927)  # steps of sequences that fill (0, 1) evenly
PAD = 0.02  # of the interval, so that a predictor may look a little beyond a bound


@dataclass(frozen=True, eq=False)
class ParameterPath:
    """Numbers of a scene along a parameter.

    Parameters
    ----------
    tables : Tables
        Working tables, rewritten by every correction.
    name : str or None
        Parameter; None: all numbers are constant.
    index : ndarray (k,) of int
        Places in ``tables.flat`` that change.
    series : ndarray (k, degree + 1)
        Chebyshev coefficients on [low, high].
    low, high : float
    """

    tables: Tables
    name: str | None
    index: np.ndarray
    series: np.ndarray
    low: float
    high: float

    def line(self, value: float) -> "ParameterPath":
        """Return a path on which the numbers are those at a value of the parameter and change as they begin to there, over the
        distance 0 from it: at most `FARTHEST` of the value, or until the frequency has lost half of itself."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        z, columns = (value - middle) / half, self.series.T
        here, rate = np.asarray(chebval(z, columns)), np.asarray(chebval(z, chebder(columns))) / half
        far = FARTHEST * max(abs(value), half)
        if self.index[0] == 0 and rate[0]:
            far = min(far, 0.5 * abs(here[0] / rate[0]))
        return dataclasses.replace(self, series=np.ascontiguousarray(np.stack([here, far * rate], 1)), low=-far, high=far)

    @functools.cached_property
    def _shaken(self) -> dict[tuple[int, int], "ParameterPath"]:
        return {}

    def shaken(self, way: int, sign: int) -> "ParameterPath":
        """Return a path whose numbers differ from these by the part `SHAKEN`, up or down without a pattern; ``way`` is 0 or 1,
        ``sign`` -1 turns it round."""
        if (way, sign) not in self._shaken:
            steps = np.arange(1, self.tables.flat.size + 1) * EVEN[way]
            factors = 1.0 + sign * SHAKEN * np.where(steps % 1.0 < 0.5, -1.0, 1.0)
            factors[0] = 1.0  # the frequency is a unit of time
            tables = copy.deepcopy(self.tables)
            tables.flat[:] *= factors
            self._shaken[way, sign] = dataclasses.replace(self, tables=tables, series=self.series * factors[self.index][:, None])
        return self._shaken[way, sign]


def constant_path(scene: Scene, system: System) -> ParameterPath:
    """Return the path on which nothing changes."""
    if system is scene.system:
        give_modal(scene.tables)  # once for the scene: its simulations need them too
    tables = scene.refill(system)
    give_modal(tables)
    return fixed_path(tables)


def fixed_path(tables: Tables) -> ParameterPath:
    """Return the path on which these tables never change."""
    return ParameterPath(tables, None, np.empty(0, np.int64), np.empty((0, 1)), 0.0, 1.0)


def parameter_path(scene: Scene, system: System, name: str, bounds: tuple[float, float], pad: float = PAD) -> ParameterPath:
    """Return the path of ``system`` along ``name`` over ``bounds`` (unordered pair, parameter's unit).

    ``pad`` widens the interval on both sides by this part of its width, where the builder allows it.

    Raises
    ------
    ValueError
        When the builder refuses a bound, or the numbers do not depend on the parameter smoothly enough to be followed.
    """
    modes = None if scene.complete else tuple(scene.keys)  # their order is chance where they are met one by one
    return ParameterPath(scene.refill(system), name, *sampled_over(scene.sampled, system, name, bounds, scene.flat_of, pad,
                                                                   modes=modes))


def of_all_modes(scene: Scene, path: ParameterPath) -> ParameterPath:
    """Return a path, or the same one of all modes where the scene has met more since it was made."""
    if len(path.tables.n_guards) == len(scene.keys):
        return path
    if path.name is None:
        return constant_path(scene, scene.system)
    return parameter_path(scene, scene.system, path.name, (path.low, path.high), pad=0.0)


def sampled_over(known: dict, system: System, name: str, bounds, flat_of, pad: float = PAD, degrees=DEGREES, modes=None):
    """Return what `series_over` does; what is ``known`` of systems with the same other numbers, and ``modes``, is not sampled."""
    return kept(known, system, name, bounds, (pad, modes), lambda: series_over(system, name, bounds, flat_of, pad, degrees))


def kept(known: dict, system: System, name: str, bounds, what, find):
    """Return what ``find()`` does, which is the same for systems that differ in the parameter ``name`` alone, where it is not
    ``known`` yet; ``what`` tells such things apart."""
    key = system.but(name, min(bounds)), name, min(bounds), max(bounds), what
    try:
        found = known.get(key)
    except TypeError:  # an element of the user's that has no hash: nothing is kept
        return find()
    if found is None:
        if len(known) >= KEPT:
            known.pop(next(iter(known)))
        found = known[key] = find()
    return found


def series_over(system: System, name: str, bounds: tuple[float, float], flat_of, pad: float = PAD, degrees=DEGREES):
    """Return places (k,), Chebyshev series (k, degree + 1) and interval of the packed numbers that change with ``name``.

    ``flat_of(system)`` packs the numbers, ``degrees`` are tried in turn; see `parameter_path` for the rest.
    """
    low, high = min(bounds), max(bounds)
    wide = max(high - low, 1e-3 * max(abs(low), abs(high)))

    def sample(value):
        return flat_of(system.with_parameters(**{name: float(value)}))

    a, b = low - pad * wide, high + pad * wide
    if not math.isfinite(b - a):
        raise ValueError(f"bounds = {bounds!r} is not allowed; {name} needs two finite numbers")
    try:
        for end in (a, b):
            system.with_parameters(**{name: end})
    except ValueError:
        a, b = low, high
        require_values(system, "bounds", name, (a, b))
    if not b > a:
        raise ValueError(f"bounds = {bounds!r}: {name} must have room to move; give two different numbers")
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    checks = np.array([sample(middle + half * z) for z in CHECKS])
    made = fitted(sample, middle, half, checks, degrees, 0.0)
    if made is None:  # numbers in which larger ones cancel carry more than their own rounding
        made = fitted(sample, middle, half, checks, degrees, NOISE * noise(sample, middle, half))
    if made is None:
        at = leap(sample, a, b)
        raise ValueError(f"{name} between {low:g} and {high:g}: the system's numbers are no smooth function of it " + (
            f"(no polynomial of degree {degrees[-1]} fits to rounding); choose narrower bounds" if at is None else
            f"(they leap at {at:.9g}, as where sliders begin to slip in another order); choose bounds on one side of that"))
    return *made, a, b


def leap(sample, low: float, high: float) -> float | None:
    """Return a place between two values at which the numbers ``sample(value)`` leap, or there are others altogether; None where
    bisection finds none."""
    one, two = sample(low), sample(high)
    size = np.maximum(np.abs(one), np.abs(two)) + 1e-300
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        try:
            between = sample(middle)
        except ValueError:  # at this one value, as where two sliders are one group
            return middle
        size = np.maximum(size, np.abs(between))
        if np.max(np.abs(between - one) / size) > np.max(np.abs(two - between) / size):
            high, two = middle, between
        else:
            low, one = middle, between
    return 0.5 * (low + high) if np.max(np.abs(two - one) / size) > LEAP else None


def fitted(sample, middle: float, half: float, checks, degrees, noise):
    """Return places and Chebyshev series of what changes over middle +- half, by the least degree that fits to rounding and to a
    ``noise`` (one a number, or 0); None where none does."""
    for degree in degrees:
        angle = math.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)
        values = np.array([sample(middle + half * z) for z in np.cos(angle)])
        index = np.flatnonzero(np.any(values != checks[0], axis=0) | np.any(checks != checks[0], axis=0))
        values = values[:, index]
        order = np.arange(degree + 1)
        series = 2.0 / (degree + 1) * np.cos(np.outer(order, angle)) @ values
        series[0] *= 0.5
        size = np.abs(values).max(axis=0, initial=0.0) + np.abs(checks[:, index]).max(axis=0, initial=0.0)
        series[np.abs(series) < 4e-16 * size] = 0.0
        found = np.cos(np.outer(np.arccos(CHECKS), order)) @ series
        allowed = max(TOLERANCE, ROUNDING * math.sqrt(degree + 1.0) if degree > DEGREES[0] else 0.0)
        own = noise[index] if np.ndim(noise) else noise
        if np.all(np.abs(found - checks[:, index]) <= allowed * size + own + 1e-300):
            used = int(np.max(np.nonzero(np.any(series != 0.0, axis=1))[0], initial=0)) + 1
            return index, np.ascontiguousarray(series[:used].T)
    return None


def slope(function, low: float, high: float, at: float) -> tuple[np.ndarray, float]:
    """Return the derivative of ``function(value)`` (ndarray), analytic in a parameter between two values, at one of them, and its
    error: that of its Chebyshev series, of the degree whose last coefficients, truncation or rounding, leave least of it."""
    middle, half, found, least = 0.5 * (low + high), 0.5 * (high - low), np.empty(0), math.inf
    for degree in DEGREES[1:-1]:
        angle = math.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)
        values = np.array([function(middle + half * z) for z in np.cos(angle)])
        series = 2.0 / (degree + 1) * np.tensordot(np.cos(np.outer(np.arange(degree + 1), angle)), values, 1)
        error = max(np.abs(series[-3:]).max(initial=0.0), TOLERANCE * np.abs(values).max(initial=0.0)) * degree / half
        if not found.size or error < least:
            found, least = np.asarray(chebval((at - middle) / half, chebder(series))) / half, error
    return found, least


def noise(sample, middle: float, half: float) -> np.ndarray:
    """Return the rounding that the numbers ``sample(value)`` carry, one a number: second differences over steps so small that
    nothing smooth is seen in them, at all places but the worst, which may be a leap."""
    found = []
    for z in (*CHECKS, 0.0):
        made = [[sample(middle + half * (z + k * step)) for k in (-1, 0, 1)] for step in STEPS]
        found.append(np.max([np.abs(above - 2.0 * here + below) for below, here, above in made], axis=0))
    return np.sort(found, axis=0)[-2]
