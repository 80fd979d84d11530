"""Rows of a branch in the order of travel, and the curve between two of them."""
import math

import numpy as np

from ...solve.steprun import TOLD
from ..kinds import CorrectorStatus, SpecialPointKind
from ..problem import NO_MONITORS, Corrected


class Part:
    """A problem on the way, with what the tracer reads of it in every step.

    ``boundary`` and ``events`` are positions in ``Row.tests``: 0 is dp/ds, 1 + k monitor k.  ``born`` is the boundary
    monitor that is zero at the first row of the part, -1 if none.  ``corner`` is the angle in radians by which the branch may
    turn in a point, of problems that are only piecewise smooth; ``touch`` the largest value of a boundary's monitor at which the
    problem takes its solutions for valid; ``follows`` tells whether the problem makes steps itself.
    """

    def __init__(self, problem, index, born=-1):
        self.problem = problem
        self.index = index
        self.born = born
        self.scale = problem.scale
        self.corner = float(problem.corner)
        self.touch = float(problem.touch)
        self.follows = bool(problem.follows)
        self.monitors = tuple(problem.monitors)
        self.kinds = [SpecialPointKind.FOLD] + [SpecialPointKind(monitor.kind) for monitor in self.monitors]
        self.boundary = [1 + k for k, monitor in enumerate(self.monitors) if monitor.boundary]
        self.events = [0] + [1 + k for k, monitor in enumerate(self.monitors) if not monitor.boundary]
        self.count = 1 + len(self.monitors)

    def turned(self, values):
        """Return values of the monitors (k,) as seen in the other direction of travel."""
        return np.array([-value if monitor.odd else value for value, monitor in zip(values, self.monitors, strict=True)], float)


class Row:
    """One point of a branch: what the corrector returned, with its place on the branch."""

    __slots__ = ("x", "tangent", "det_sign", "det_log", "tests", "iterations", "residual", "singular", "part", "s", "p",
                 "angle", "bend", "misfit", "recorded", "signs", "ds", "turn")

    def __init__(self, c, part, s, angle, tests, ds):
        self.x = c.x
        self.tangent = c.tangent
        self.det_sign = c.det_sign
        self.det_log = c.det_log
        self.iterations = c.iterations
        self.residual = c.residual
        self.singular = c.status == CorrectorStatus.SINGULAR
        self.part = part
        self.s = s
        self.p = float(c.x[-1])
        self.angle = angle
        self.tests = tests
        self.bend = 0.0  # turn per length
        self.misfit = 0.0  # sideways distance of the step that its turn does not explain, as part of the step
        self.recorded = None
        self.signs = ()  # last clear signs of the tests, once the row is accepted
        self.ds = ds
        self.turn = math.inf  # angle by which the branch has turned since its first row, at most

    @property
    def direction(self) -> np.ndarray:
        """Change of ``x`` along the branch, per unit of arclength (n + 1,)."""
        return self.part.scale * self.tangent


def followed(row, lines, signs) -> list:
    """Return the rows behind ``row`` of steps that a problem made itself, see `Problem.follow`.

    Parameters
    ----------
    lines : ndarray (m, 2 (n + 1) + k + steprun.TOLD)
        Points, tangents, tests (dp/ds and the monitors) and what `steprun` tells of the steps.
    signs : tuple of int
    """
    made, width = [], row.x.size
    points, tangents = lines[:, :width], lines[:, width:2 * width]
    c = Corrected(row.x, row.tangent, True, CorrectorStatus.CONVERGED, 0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_MONITORS)  # of each in turn
    for c.x, c.tangent, numbers in zip(points, tangents, lines[:, 2 * width:].tolist(), strict=True):
        length, angle, misfit, after, iterations, c.residual, c.det_sign, c.det_log = numbers[-TOLD:]
        c.iterations = int(iterations)
        turn = row.turn + angle
        row = Row(c, row.part, row.s + length, angle, numbers[:-TOLD], after)
        row.bend, row.misfit, row.signs, row.turn = angle / length, misfit, signs, turn
        made.append(row)
    return made


def reversed_row(row):
    """Return a row seen in the other direction of travel."""
    c = Corrected(row.x, -row.tangent, True, CorrectorStatus.SINGULAR if row.singular else CorrectorStatus.CONVERGED,
                  row.iterations, row.residual, 0.0, 0.0, -row.det_sign, row.det_log, row.part.turned(row.tests[1:]))
    other = Row(c, row.part, 0.0 - row.s, row.angle, tests_of(c), row.ds)
    other.recorded = row.recorded
    return other


class Point:
    """What ``stop=`` and ``record=`` see of a row: unknowns, parameter, arclength, monitors, the solution on demand."""

    __slots__ = ("_row",)

    def __init__(self, row):
        self._row = row

    @property
    def x(self) -> np.ndarray:
        """Unknowns and parameter (n + 1,), own units."""
        return self._row.x

    @property
    def u(self) -> np.ndarray:
        """Unknowns (n,), own units."""
        return self._row.x[:-1]

    @property
    def parameter(self) -> float:
        """Parameter, own units."""
        return self._row.p

    @property
    def s(self) -> float:
        """Arclength from the first point in scaled unknowns; positive in the direction of travel."""
        return self._row.s

    @property
    def monitors(self) -> list[float]:
        """Values of the problem's monitors."""
        return self._row.tests[1:]

    @property
    def solution(self):
        """The solution object, as in ``branch.orbits``."""
        return self._row.part.problem.solution(self._row.x)


def tests_of(c):
    """Return the values watched along the branch: dp/ds and the monitors."""
    return [float(c.tangent[-1]), *c.monitors.tolist()]


class Curve:
    """Cubic Hermite curve between two rows; ``at(t)``, t in [0, 1], is its point corrected onto the branch."""

    def __init__(self, a, b):
        self.problem = a.part.problem
        self.scale = a.part.scale
        self.length = b.s - a.s
        self.xa = a.x
        self.chord = b.x - a.x
        self.da = self.length * a.direction
        self.db = self.length * b.direction

    def place(self, t):
        """Point of the Hermite curve (n + 1,), own units."""
        return self.xa + (t * t * (3.0 - 2.0 * t)) * self.chord + (t * (1.0 - t)) * ((1.0 - t) * self.da - t * self.db)

    def tangent(self, t):
        """Unit tangent of the Hermite curve in scaled unknowns (n + 1,)."""
        d = (6.0 * t * (1.0 - t)) * self.chord + (1.0 - t) * (1.0 - 3.0 * t) * self.da + t * (3.0 * t - 2.0) * self.db
        d /= self.scale
        return d / math.sqrt(float(np.dot(d, d)))

    def parameter_bend(self):
        """Largest second derivative of the parameter by ``t`` along the Hermite curve, own units."""
        chord, da, db = float(self.chord[-1]), float(self.da[-1]), float(self.db[-1])
        return max(abs(6.0 * chord - 4.0 * da - 2.0 * db), abs(6.0 * chord - 2.0 * da - 4.0 * db))

    def at(self, t):
        """Corrected point at ``t``; None where the corrector or the problem's own formulas fail."""
        try:
            c = self.problem.correct(self.place(t), self.tangent(t))
        except self.problem.errors:
            return None
        return c if c.converged else None

    def test(self, j):
        """Return ``f(t) -> (value of test j, point)`` for the root finder."""
        def value(t):
            c = self.at(t)
            if c is None:
                return None
            v = float(c.tangent[-1]) if j == 0 else float(c.monitors[j - 1])
            return (v, c) if math.isfinite(v) else None
        return value

    def nearest(self, x):
        """Position on the Hermite curve nearest to ``x`` and its scaled distance."""
        t = 0.5
        for _ in range(20):
            d = self.tangent(t)
            step = float(np.dot((x - self.place(t)) / self.scale, d)) / self.length
            t = min(max(t + step, -0.5), 1.5)
            if abs(step) < 1e-15:
                break
        gap = (x - self.place(t)) / self.scale
        return t, math.sqrt(float(np.dot(gap, gap)))
