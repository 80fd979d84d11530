"""The equations of a curve of special points: those of a branch and one condition more, as a problem in a second parameter.

The unknowns of a point on the curve are (u, a, b): those of the branch on which the special point was found, its parameter
a, and a second parameter b.  The equations are those of the branch and one condition g = 0 (see `conditions`).

One file, because equations, boundaries and named ends are those of one problem.
"""
import copy
import math

import numpy as np

from ...solve.steplaw import MONITOR_BAND
from .. import conditions
from ..balance.problem import BESIDE
from ..branches.special import solution_at
from ..branches.stability_changes import confirmed, tests
from ..families import family_of
from ..grazing.following import Touching, touching
from ..kinds import BOUNDARIES, CorrectorStatus, SpecialPointKind, StopReason
from ..problem import EPS, Monitor, Problem
from ..shooting.completion import condition
from ..shooting.signature_change import LEAVING, UNLISTED
from ..steps.inside import AT_BOUNDARY
from .codimension_two import watched
from .leaving import curves_from
from .unfolding import BREAKS, Crossed, Unfolded

BOUND = "bound"  # name of the monitors that end a curve at the bounds of a
UNMOVED = 1e-8  # derivative in the second parameter, relative: differences have that much noise

# monitors at whose zeros the orbit's own equations are singular, and what to follow instead
SINGULAR = {"shrinks": "an orbit shrinks onto an equilibrium is followed as the Hopf point of that: trace the branch of "
                       "find_equilibrium(system)",
            "merges": "a doubled orbit merges with its parent is followed as the period doubling of the parent: trace that"}
RESONANCES = (SpecialPointKind.RESONANCE_1_1, SpecialPointKind.RESONANCE_1_2)
ALONG = 1e-6  # value of a boundary's monitor, at the start of a curve of another one, that is zero all along it
MEETING = 2e-3  # of a period (or of half of one that is symmetric), between two events
BEYOND = (1e-3, -1e-3, 1e-2, -1e-2)  # arclengths beside an end at which boundaries are looked up: maxima may grow like a cube
ROUNDINGS = 4.0  # of an equation, from its first-order terms, that its error may be
FARTHEST = 1e-2  # scaled distance from a point of a curve at which it is looked for another solution of the equations
NOISE = 1e-8  # scaled: of conditions whose derivatives jump (a contact that changes its order of events), at most


class CurveProblem(Problem):
    """F(u, a, b) = 0 and g(u, a, b) = 0 as a problem in b.

    Parameters
    ----------
    family : families.Family
        The branch's problem for every b.
    kind : SpecialPointKind
        What is followed.
    name : str
        Name of the monitor or measure that is followed; empty if there is one.
    bounds_a : tuple of float
        The curve ends where a reaches one of them.
    x0 : ndarray (n + 2,)
        Start (u, a, b).
    function : callable, optional
        ``function(solution) -> float`` whose zero is followed, of a user's monitor.
    """

    differenced = True
    _noisy = False
    _still = False  # nothing depends on the second parameter here: the measure has no slope whose noise could be searched

    def __init__(self, family, kind, name, bounds_a, x0, function=None):
        base = family.problem
        self.family, self.kind, self.name, self.bounds_a, self.function = family, kind, name, bounds_a, function
        self.base_parameter, self.parameter = base.parameter, family.name
        self.x0 = np.array(x0, float)
        self.size, self.scale = self.x0.size - 1, family.scale.copy()
        self.condition, self._followed = ((conditions.Number(base, function), -1) if function is not None else
                                          condition_of(base, kind, name, self.x0[:-1]))
        self.signature = base.signature
        monitors = [Monitor(SpecialPointKind.EXTREMUM, base.parameter, odd=True)]
        if kind is SpecialPointKind.PEAK:
            monitors.append(Monitor(SpecialPointKind.EXTREMUM, name, odd=True))
        # a graze that is followed as a listed event is also the touch of an unlisted one: what is zero with it is no boundary; but
        # the maximum behind a reversal whose rate is followed begins beside the curve, and is zero on that side only, by rounding
        still = self._followed >= 0 and function is None
        own = base.monitor_values(self.x0[:-2], float(self.x0[-2]), np.zeros(self.x0.size - 1)) if still else ()
        turns = still and base.monitors[self._followed].name == LEAVING
        self._inherited = [k for k, monitor in enumerate(base.monitors) if monitor.boundary
                           and not (still and (k == self._followed or monitor.kind == kind or abs(own[k]) <= ALONG
                                               and not (turns and monitor.name == UNLISTED)))]
        self._walls = [k for k in (0, 1) if math.isfinite(bounds_a[k])]
        for k in self._inherited:
            monitors.append(base.monitors[k])
        monitors.extend(Monitor(SpecialPointKind.USER, BOUND, boundary=True) for _ in self._walls)
        more, self._higher = watched(base, self.condition, kind)
        monitors.extend(more)
        self.monitors = tuple(monitors)

    # equations

    def residual(self, u, p):
        """Return F and g (n + 1,) at ``u`` = (u, a) and b = ``p``."""
        x = np.append(u, p)
        problem = self.family.at(float(p))
        f = np.reshape(np.asarray(problem.residual(u[:-1], float(u[-1])), float), self.size - 1)
        known = np.isfinite(f).all()  # contacts that cannot be followed have no derivatives that a condition could read
        return np.append(f, self.condition.value(self.family, x) if known else math.nan)

    def jacobian(self, u, p):
        """Return the derivatives of `residual` in (u, a) and in b."""
        _, wide, _ = self._linearised(np.append(u, p))
        return wide[:, :-1], wide[:, -1]

    def wide_jacobian(self, x):
        """See `Problem.wide_jacobian`."""
        return self._linearised(x)[1]

    def _linearised(self, x):
        n = self.size - 1
        inner = conditions.wide_at(self.family, x)
        f = np.empty(n + 1)
        f[:n] = np.reshape(self.family.at(float(x[-1])).residual(x[:n], float(x[n])), n)
        wide = np.empty((n + 1, n + 2))
        wide[:n, :n + 1] = inner
        h = conditions.ASIDE * self.scale[-1]

        def moved(y):
            return np.reshape(self.family.at(float(y[-1])).residual(y[:n], float(y[n])), n)
        wide[:n, n + 1] = conditions.difference(moved, x, n + 1, h)
        if not (np.isfinite(inner).all() and np.isfinite(wide[:n]).all() and np.isfinite(f[:n]).all()):
            f[n] = math.nan
            wide[n] = math.nan
            return f, wide, f
        f[n], wide[n] = self.condition.linearised(self.family, x, inner)
        floor = EPS * (np.abs(wide) @ np.abs(x))
        if self._noisy:
            floor = np.maximum(floor, NOISE * (np.abs(wide) @ self.scale))
        return f, wide, floor

    def correct(self, x, tangent, fixed=False):
        """See `Problem.correct`; where Newton cycles in the noise of differenced second derivatives, the noise is the floor."""
        c = super().correct(x, tangent, fixed)
        if not c.converged and c.status is CorrectorStatus.NOT_CONVERGED and not self._noisy:
            self._noisy = True
            try:
                c = super().correct(x, tangent, fixed)
            finally:
                self._noisy = False
        if c.converged:
            self.condition.reached(self.family, c.x)
        return c

    def uncertainty(self, x, tangent) -> float:
        """See `Problem.uncertainty`: what the rounding of the equations makes of the second parameter.

        Where two curves of solutions cross, as that of flips and that of all touches do where impacts lose their speed, derivatives
        lose rank, and what they alone tell of the place in the direction of the other curve has no bound.  The equations
        themselves tell it to the root of their rounding: what is farther away does not solve them (`_width`).
        """
        _, wide, floor = self._linearised(x)
        matrix, floor = np.vstack([wide * self.scale, tangent]), ROUNDINGS * np.append(floor, 0.0)
        if not np.isfinite(matrix).all():
            return math.inf
        left, sizes, right = np.linalg.svd(matrix)
        sizes = np.maximum(sizes, np.finfo(float).tiny)
        row = right[:, -1] / sizes * left  # of the inverse, one direction beside the other
        told = float(np.abs(row.sum(axis=1)) @ floor)
        noise = float(np.abs(left[:, -1]) @ floor)
        width = self._width(x, right[-1] * self.scale, left[:-1, -1], noise, noise / sizes[-1])
        seen = float(np.abs(row[:, :-1].sum(axis=1)) @ floor) + abs(float(right[-1, -1])) * width
        return float(self.scale[-1]) * min(told, seen)

    def _width(self, x, way, left, noise, width) -> float:
        """Return to which distance from ``x`` (n + 2,) along ``way`` (n + 2,), and back, the equations may have a solution:
        ``width`` (as their derivatives tell), or less where more than ``noise`` is left of them on both sides, in the direction
        ``left`` (n + 1,) of which they tell least."""
        def left_over(distance):
            try:
                y = x + distance * way
                return abs(float(left @ self.residual(y[:-1], float(y[-1]))))
            except ValueError:  # the parameter cannot have this value
                return math.nan

        reach = min(width, FARTHEST)
        while reach > noise and all(left_over(sign * reach / ROUNDINGS) > noise for sign in (1.0, -1.0)):
            reach /= ROUNDINGS
            width = reach
        return width

    def monitor_values(self, u, p, tangent):
        """Return da/ds, the slope of the measure along a curve of peaks, the branch's own boundaries, the bounds of a."""
        values = [-1.0 if self._still else float(tangent[-2])]  # what does not move has no extrema, only rounding
        problem, a = self.family.at(float(p)), float(u[-1])
        if self.kind is SpecialPointKind.PEAK:
            values.append(-1.0 if self._still else self._measure_slope(problem, u, p, tangent))
        if self._inherited:
            own = problem.monitor_values(u[:-1], a, tangent[:-1])
            values.extend(float(own[k]) for k in self._inherited)
        width = self.bounds_a[1] - self.bounds_a[0] if len(self._walls) == 2 else self.scale[-2]
        values.extend((self.bounds_a[0] - a if k == 0 else a - self.bounds_a[1]) / width for k in self._walls)
        if self._higher is not None:
            values.extend(self._higher(problem, np.append(u[:-1], a)))
        return np.array(values)

    def _measure_slope(self, problem, u, p, tangent):
        x = np.append(u, p)
        slope = np.empty(x.size)
        slope[:-1] = conditions.measure_gradient(problem, self.name, x[:-1])
        slope[-1] = conditions.difference(
            lambda y: float(np.real(self.family.at(float(y[-1])).measure(self.name, y[None, :-1])[0])), x, x.size - 1,
            conditions.ASIDE * self.scale[-1])
        return float(slope * self.scale @ tangent)

    def switch(self, point, monitor):
        """A bound ends the curve; so does the end of validity of the branch's equations."""
        if monitor.name == BOUND:
            return StopReason.BOUND
        renewed = self._renewed(point)
        if renewed is None and monitor.name == BREAKS:
            return f"{self.parameter} breaks the branch point here into two branches that miss each other"
        if renewed is None and self.kind is SpecialPointKind.NEIMARK_SACKER and monitor.kind in RESONANCES:
            return (f"the pair of multipliers becomes real here ({monitor.kind.value}): beyond, their product is 1 and there is "
                    "no torus")
        if renewed is None:
            return f"the followed {self.kind!s} meets a {monitor.kind!s} here, a point of codimension two"
        return renewed, point.x, point.tangent

    def named_end(self, x, reason, message):
        """See `Problem.named_end`: another change of the sequence happens together with the followed one where two instants of the
        orbit that were apart at the start meet, or where solutions a little beyond violate a boundary."""
        if reason is not StopReason.DS_MIN:
            return reason, message
        met = self._beyond(x)
        if met is None and self._close(x) > self._close(self.x0):
            met = "another change of the sequence of events"
        if met is None:
            return reason, message
        return StopReason.NO_SUCCESSOR, f"the followed {self.kind!s} meets {met} here, a point of codimension two"

    def _beyond(self, x) -> str | None:
        """Return the boundary that solutions just beside ``x`` (n + 2,) violate, None where they violate none."""
        tangent, _, _ = conditions.null_vector(self.wide_jacobian(x), self.scale)
        for step in BEYOND:
            c = self.correct(x + step * self.scale * tangent, tangent)
            if c.converged:
                for monitor, value in zip(self.monitors, c.monitors, strict=True):
                    if monitor.boundary and monitor.name != BOUND and value > MONITOR_BAND:
                        return f"a {monitor.kind!s}"
        return None

    def _close(self, x) -> int:
        """Return how many pairs of successive instants of the orbit at ``x`` (n + 2,) are hardly apart."""
        instants = np.sort(self.condition.instants(self.family.at(float(x[-1])), x[:-1]))
        return int(np.count_nonzero(np.diff(instants, append=instants[:1] + 1.0) < MEETING))

    def aside(self, point, sign, distances):
        """Yield distance and corrected point of this curve beside ``point``, at scaled distances of the second parameter on the
        side ``sign``; those beyond the bounds, or that do not converge, are left out."""
        row = np.zeros(point.x.size)
        row[-1] = 1.0
        for distance in distances:
            x = point.x + sign * distance * self.scale[-1] * row
            if self.family.interval[0] <= x[-1] <= self.family.interval[1] and (c := self.correct(x, row, True)).converged:
                yield distance, c

    def branches(self, point, n_max):
        """Return points on the curves that leave a codimension-2 point, see `leaving`."""
        return curves_from(self, point, n_max)

    def _renewed(self, point):
        """Return the problem for the order of events behind a boundary, where that is all that changes (balances), or None."""
        base = self.family.problem
        if not base.smooth_boundaries:
            return None
        for ahead in (1.0, 10.0, 100.0):
            x = point.x + ahead * BESIDE * self.scale * point.tangent
            listed = self.family.at(float(x[-1])).order_at(x[:-1])
            if not np.array_equal(listed, base.listed):
                other = CurveProblem(self.family.of(base.with_order(listed)), self.kind, self.name, self.bounds_a, point.x,
                                     self.function)
                other.scale = self.scale
                wide = other.wide_jacobian(x)[:-1] * self.scale
                other._still = bool(np.abs(wide[:, -1]).max() <= UNMOVED * np.abs(wide).max())
                return other
        return None

    # what is shown and stored

    @property
    def states(self) -> tuple[str, ...]:
        """See `Problem.states`."""
        return self.family.problem.states

    @property
    def measure_names(self) -> tuple[str, ...]:
        """The branch's parameter and measures."""
        return (self.base_parameter, *self.family.problem.measure_names)

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs`` (m, n + 2)."""
        if name == self.base_parameter:
            return xs[:, -2].copy()
        return np.array([self.family.at(float(x[-1])).measure(name, x[None, :-1])[0] for x in xs])

    def parameters(self, x) -> dict:
        """Return both parameters at ``x`` (n + 2,) by name."""
        return {self.base_parameter: float(x[-2]), self.parameter: float(x[-1])}

    def solution(self, x):
        """Return the solution of the branch's problem at ``x`` (n + 2,)."""
        return solution_at(self.family.alone(float(x[-1])), x[:-1], self.kind in BOUNDARIES)

    def restarted(self, x):
        """See `Problem.restarted`."""
        other = copy.copy(self)
        other.x0 = np.array(x, float)
        return other

    def bounded(self, low, high, made):
        """See `Problem.bounded`."""
        family = self.family.over(low, high)
        if family is self.family:
            return self
        other = CurveProblem(family, self.kind, self.name, self.bounds_a, self.x0, self.function)
        other.scale = self.scale
        return other

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        bounds = [value if math.isfinite(value) else None for value in self.bounds_a]
        interval = [value if math.isfinite(value) else None for value in self.family.interval]
        base = self.family.problem
        return {"kind": "curve", "class": type(base).__name__, "of": base.to_record(), "second": self.family.name,
                "interval": interval, "scale": self.scale.tolist(), "followed": self.kind.value, "name": self.name,
                "bounds_a": bounds, "x0": self.x0.tolist(), "function": self.function is not None}

    @classmethod
    def from_record(cls, record, base) -> "CurveProblem":
        """Make the problem that gave ``record``, with the problem of the branch it stands on."""
        if record.get("function"):
            raise ValueError(f"the curve follows the user's monitor {record['name']!r}, whose function is not stored")
        low, high = (inf if value is None else value for value, inf in zip(record["interval"], (-math.inf, math.inf), strict=True))
        walls = tuple(inf if value is None else value for value, inf in zip(record["bounds_a"], (-math.inf, math.inf), strict=True))
        family = family_of(base, record["second"], (low, high))
        family.scale = np.array(record["scale"], float)
        return cls(family, SpecialPointKind(record["followed"]), record["name"], walls, np.array(record["x0"], float))


def condition_of(problem, kind, name, x):
    """Return ``(condition, index of the followed monitor or -1)`` for a kind of special point at ``x`` (n + 1,).

    Raises
    ------
    ValueError
        For kinds that no curve follows.
    """
    if isinstance(problem, Unfolded):
        return Crossed(problem), -1
    if name in SINGULAR:
        raise ValueError(f"a {kind.value} where {SINGULAR[name]}")
    if kind is SpecialPointKind.FOLD:
        return conditions.Fold(problem), -1
    if kind is SpecialPointKind.PEAK:
        return conditions.Extremum(problem, name), -1
    # a change of the sequence of events may be called by what changes: its monitor is found by its own name
    followed = [k for k, monitor in enumerate(problem.monitors)
                if monitor.name == name and (monitor.kind == kind or monitor.boundary and name)]
    if len(followed) > 1:  # of several of one name that which is zero
        values = problem.monitor_values(x[:-1], float(x[-1]), np.zeros(x.size))
        followed = [min(followed, key=lambda k: abs(values[k]))]
    if kind is SpecialPointKind.PERIOD_DOUBLING and problem.wraps:
        return conditions.Flip(problem), -1
    if kind is SpecialPointKind.BRANCH_POINT and followed and problem.wraps:
        return conditions.Flip(problem), -1  # of the half period: the symmetry breaks
    if followed and name == UNLISTED and (rate := zero_with(problem, x, LEAVING)) is not None:
        followed = [rate]  # a mass that turns round begins to rest: behind it the maximum grows like the square of the rate
    elif followed and name == UNLISTED and problem.sequence is not None:
        touch = touching(problem, x)
        if touch is not None and touch[0] is problem:
            return Touching(problem, x, touch[2]), followed[0]
    if followed and kind is SpecialPointKind.CHATTER_COMPLETION and problem.sequence is not None:
        own = condition(problem, x)
        if own is None:
            raise ValueError("a chatter_completion cannot be followed in two parameters without a train of impacts, see the end of "
                             "the branch")
        return own, followed[0]
    if not followed:
        mu = problem.multipliers_of_rows(x[None])
        test = next((test for other, test in tests() if other is kind), None)
        if mu is not None and test is not None and confirmed(kind, mu[0]):
            return conditions.Circle(problem, test), -1
        raise ValueError(f"a {kind.value} cannot be followed in two parameters: its equations have no condition that stays zero "
                         "along a curve")
    return conditions.Zero(problem, followed[0]), followed[0]


def zero_with(problem, x, name) -> int | None:
    """Return the index of the monitor ``name`` if it is zero at ``x`` (n + 1,), to rounding."""
    index = next((k for k, monitor in enumerate(problem.monitors) if monitor.name == name), None)
    if index is None:
        return None
    value = problem.monitor_values(x[:-1], float(x[-1]), np.zeros(x.size))[index]
    return index if abs(value) <= AT_BOUNDARY else None
