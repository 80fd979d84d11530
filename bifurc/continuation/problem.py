"""What the tracer needs of a problem F(u, p) = 0, and a base class that gives all of it for a residual.

Every vector of unknowns is joined with the parameter to ``x = (u, p)``, n + 1 numbers in their own units.  ``scale``
holds their natural sizes; arclength, angles and tangents are measured in ``x / scale``.  A tangent has unit length
there, and a step of length ds is predicted as ``x + ds scale tangent``.

A problem may be any object with the attributes and methods of `Problem`; periodic orbits bring their own, compiled.

One file, because it is one interface: every hook that a problem may have stands here with its default.
"""
import copy
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..content import Content
from ..solve.bordered import factor, solve_factored
from ..structure.components import states_of
from .kinds import ERRORS, CorrectorStatus, SpecialPointKind

EPS = float(np.finfo(float).eps)
ROUNDED = 8.0 * EPS  # what is left of a sum of a few terms of size one
MAX_ITERATIONS = 10
SMALL = 1e-10  # a correction this small is followed by one of the order of its square


@dataclass(frozen=True, slots=True)
class Monitor:
    """A smooth scalar test along a branch, of which simple zeros are special points.

    Attributes
    ----------
    kind : SpecialPointKind
    name : str
        Which of several of a kind; empty if there is one.
    boundary : bool
        Negative where the equations of the problem are valid: its zero is the end of validity, where `Problem.switch`
        is asked for the equations that go on.
    odd : bool
        Changes its sign with the direction of travel, as derivatives along the branch do.
    falling : bool
        Only zeros at which it falls along the direction of travel are special: of a slope, the maxima.
    silent : bool
        A boundary that is one of the equations only and not of the motion: the branch goes on behind it without a special
        point.
    """

    kind: SpecialPointKind
    name: str = ""
    boundary: bool = False
    odd: bool = False
    falling: bool = False
    silent: bool = False


class Corrected:
    """A point as the corrector leaves it.

    Attributes
    ----------
    x : ndarray (n + 1,)
        Unknowns and parameter, own units.
    tangent : ndarray (n + 1,)
        Unit tangent of the branch at ``x`` in scaled unknowns, from the Jacobian at ``x``, oriented like the given one.
    converged : bool
    status : CorrectorStatus
        ``singular`` with ``converged``: ``x`` solves the equations but its tangent is not unique; the given one stays.
    iterations : int
    residual : float
        Largest residual at ``x``, in units of the residual.
    distance : float
        Scaled length from the guess to ``x``, dimensionless.
    contraction : float
        Ratio of the last two Newton corrections; 0 with fewer than two.
    det_sign, det_log : float
        Sign and logarithm of det [J; tangent] in scaled unknowns: the sign changes at branch points.
    monitors : ndarray (k,)
        Values of the problem's monitors.
    left : float
        Size of the largest scaled unknown of the correction that would come next; 0 where that is not known.
    before : ndarray (n + 1,) or None
        Of a point on a boundary the last one on the way there that is clear of it, where there is one.
    """

    __slots__ = ("x", "tangent", "converged", "status", "iterations", "residual", "distance", "contraction", "det_sign",
                 "det_log", "monitors", "left", "before")

    def __init__(self, x, tangent, converged, status, iterations, residual, distance, contraction, det_sign, det_log,
                 monitors, left=0.0):
        self.x = x
        self.tangent = tangent
        self.converged = converged
        self.status = status
        self.iterations = iterations
        self.residual = residual
        self.distance = distance
        self.contraction = contraction
        self.det_sign = det_sign
        self.det_log = det_log
        self.monitors = monitors
        self.left = left
        self.before = None

    @property
    def u(self) -> np.ndarray:
        """Unknowns (n,)."""
        return self.x[:-1]

    @property
    def p(self) -> float:
        """Parameter."""
        return float(self.x[-1])

    def __repr__(self) -> str:
        return f"Corrected(p={self.p:.10g}, {self.status}, {self.iterations} iterations, residual {self.residual:.1e})"


@dataclass(frozen=True, eq=False)
class EndPoint(Content):
    """A special point that steps approach but never reach: kind, name of its monitor, unknowns and parameter (n + 1,) there, bound
    on the error of the parameter in own units; the problem that has these unknowns, None: that of the branch."""

    kind: SpecialPointKind
    name: str
    x: np.ndarray
    error: float
    problem: "Problem | None" = None


@dataclass(frozen=True, eq=False)
class Solution(Content):
    """A solution of an algebraic problem: unknowns ``u`` (n,) and parameter ``p``, own units."""

    u: np.ndarray
    p: float

    def __repr__(self) -> str:
        return f"Solution(p={self.p:.10g}, u={np.array2string(self.u, precision=6, threshold=6)})"


NO_MONITORS = np.empty(0)


class Problem:
    """Base class of problems F(u, p) = 0 with one parameter: write ``residual`` and, for speed, ``jacobian``.

    Parameters
    ----------
    u0 : float or array (n,)
        Unknowns at the start, own units; a guess is corrected at fixed parameter.
    p0 : float
        Parameter at the start, own units.
    scale_u : float or array (n,), optional
        Natural size of the unknowns; default max(1, |u0|) sqrt(n), so that lengths are root mean squares.
    scale_p : float, optional
        Natural size of the parameter; default half the width of the bounds given to `trace`, otherwise max(1, |p0|).

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    monitors : tuple of Monitor
        Tests whose values ``monitor_values`` returns, in this order.
    measure_names : tuple of str
        Names that `measure` can turn into columns.
    signature : str
        Names the equations; shown before and after a change of equations.

    Examples
    --------
    >>> class Parabola(Problem):
    ...     def residual(self, u, p):
    ...         return p + u**2
    >>> from bifurc.continuation import trace
    >>> trace(Parabola(0.0, 0.0), bounds=(-1, 1)).special_points[0].kind.value
    'fold'
    """

    errors: tuple[type[Exception], ...] = ERRORS  # what of its formulas becomes a status of a branch; others are passed on
    parameter = "p"
    monitors: tuple[Monitor, ...] = ()
    signature = ""
    touch = math.inf  # value of a boundary's monitor beyond which a solution is not valid, whatever the size of the monitor
    corner = 0.0  # angle in radians by which a branch may turn in a point: of equations that are only piecewise smooth
    same_tangent = 0.99  # cosine to the tangent that `switch` gives up to which the one found at a boundary is taken for the same
    exact_tangent = False  # whether the corrector's derivative in the parameter is exact to rounding, not a rough difference
    smooth_boundaries = False  # whether the equations are smooth across boundaries, at which only the order of events changes
    monitors_read_tangent = True  # whether `monitor_values` does
    differenced = False  # whether monitors are made of differences, whose noise changes its sign where one is zero all along
    follows = False  # whether `follow` makes steps
    truncates = False  # whether its solutions are those of truncated equations, whose multipliers belong to the whole motion
    free = 0  # how many quantities no equation decides: what sticks all the time may stand anywhere in an interval
    placed = None  # error of the parameter of ``x0``, own units, where more than the equations tells it
    wraps = False  # whether `wrapped_jacobian` gives the multipliers as singularities of the equations

    # What the solutions are motions of: None for algebraic equations.
    system: Any = None  # System: any of the family; its other parameters hold along the branch
    path: Any = None  # ParameterPath: the coefficients of the system as functions of the parameter, on an interval
    sequence: Any = None  # Signature: sequence of contact states of an orbit that is solved event by event

    def __init__(self, u0, p0, scale_u=None, scale_p=None):
        u0 = np.array(u0, float, ndmin=1)
        if u0.ndim != 1 or u0.size == 0 or not np.isfinite(u0).all():
            raise ValueError(f"u0 must be one or more finite numbers, got {u0!r}")
        if not math.isfinite(p0):
            raise ValueError(f"p0 must be finite, got {p0!r}")
        self.size = u0.size
        self.x0 = np.append(u0, float(p0))
        if scale_u is None:
            scale_u = max(1.0, float(np.abs(u0).max())) * math.sqrt(self.size)
        self.scale = np.empty(self.size + 1)
        self.scale[:-1] = _positive(scale_u, "scale_u")
        self.scale[-1] = math.nan if scale_p is None else _positive(scale_p, "scale_p")

    # ---- written by the user -----------------------------------------------------------------------------------

    def residual(self, u, p):
        """Return F(u, p) (n,); ``u`` (n,) must not be changed."""
        raise NotImplementedError(f"{type(self).__name__} must define residual(u, p)")

    def jacobian(self, u, p):
        """Return F_u (n, n) and F_p (n,); by default by fourth-order central differences (2 to 3 digits lost)."""
        x = np.append(u, p)
        wide = np.empty((self.size, self.size + 1))
        for i in range(self.size + 1):
            h = DIFFERENCE * max(abs(x[i]), self._size(i))
            total = 0.0
            for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
                moved = x.copy()
                moved[i] += k * h
                total = total + weight * np.asarray(self.residual(moved[:-1], float(moved[-1])), float)
            wide[:, i] = total / (12.0 * h)
        return wide[:, :-1], wide[:, -1]

    def monitor_values(self, u, p, tangent):
        """Return the values of ``monitors`` (k,) at a solution."""
        return NO_MONITORS

    def monitor_value(self, index: int, x, tangent) -> float:
        """Return the value of one of ``monitors`` at ``x`` (n + 1,), as curves do that keep it at zero.

        ``tangent()`` gives the unit tangent (n + 1,) in scaled unknowns; it costs more than most monitors.
        """
        return float(self.monitor_values(x[:-1], float(x[-1]), tangent() if self.monitors_read_tangent else None)[index])

    # ---- what happens at special points --------------------------------------------------------------------------

    def silent(self, monitor, x) -> bool:
        """Return whether a boundary at ``x`` (n + 1,) is one of the equations only and no special point."""
        return monitor.silent

    def switch(self, point, monitor):
        """Return ``(problem, x, tangent)`` with which the branch goes on behind a boundary, or None to stop.

        Parameters
        ----------
        point : Corrected
            On the boundary, with the tangent in the direction of travel.
        monitor : Monitor
            The boundary monitor that became zero.
        """
        return None

    def beyond_corner(self, row):
        """Return ``(problem, tangent)`` with which the branch goes on where no step is accepted behind a row, or None.

        For equations that are only piecewise smooth, whose branches have corners; the tangent (n + 1,) is that of the piece
        behind, in the direction of travel.  A third number is the arclength behind the row at which it holds, where it does not
        at once.
        """
        return None

    def named_end(self, x, reason, message):
        """Return reason and message of an end at ``x`` (n + 1,), which the problem may know better than the tracer."""
        return reason, message

    def end_point(self, x, reason):
        """Return the `EndPoint` that a branch which ends at ``x`` (n + 1,) approaches without reaching it, or None."""
        return None

    def zero(self, curve, test, ends, guess):
        """Return the zero of a test on a `steps.rows.Curve` in a tuple, (None,) where it cannot be found, or None for the general
        search.

        Parameters
        ----------
        curve : steps.rows.Curve
        test : int
            0: the slope of the parameter, 1 + k: monitor k.
        ends : tuple of float
            Values of the test at both ends.
        guess : float or None
            Place to try first, in (0, 1).

        Returns
        -------
        tuple of one steps.roots.Root, or None
        """
        return None

    def locate(self, kind, a, b):
        """Return the `Corrected` point of a kind between two rows where the equations are singular at it, or None for the general
        search."""
        return None

    @property
    def derived_beside(self) -> bool:
        """Whether `jacobian` is the derivative of `residual` beside solutions too, not only on them: second derivatives are
        symmetric then."""
        return True

    def uncertainty(self, x, tangent) -> float:
        """Return how uncertain the parameter of a special point at ``x`` (n + 1,) is beside the rounding of its location, own
        units."""
        return 0.0

    def test_uncertainty(self, found: Corrected) -> float:
        """Return how far off the monitors are at a point as it was ``found``; 0: not known.

        By the rounding of their terms, and by what is left of the equations: points side by side share both.
        """
        return 0.0

    def blur(self, found: Corrected) -> float:
        """Return how far rounding moves a solution across its branch, scaled, as it was ``found``; 0: not known."""
        return 0.0

    def shaken(self):
        """Return a small part, and pairs of functions that make problems with the same equations whose numbers all differ by it,
        one way and the other: they tell what the rounding of numbers does to a special point. None by default."""
        return 1.0, ()

    def own_directions(self, directions):
        """Return those of the directions (m, n + 1) at a branch point along which solutions of this problem lie; all by default."""
        return directions

    def branches(self, point, n_max):
        """Return start objects on the branches that meet this one in a special point, or None for the general rule."""
        return None

    # ---- what is shown and stored --------------------------------------------------------------------------------

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a system of first order, which its measures go by; none of anything else."""
        return states_of(self)

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns that `measure` offers: the unknowns, if they are at most 12."""
        return tuple(f"u_{i}" for i in range(self.size)) if self.size <= 12 else ("norm",)

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs`` (m, n + 1)."""
        return np.sqrt((xs[:, :-1]**2).mean(axis=1)) if name == "norm" else xs[:, int(name[2:])].copy()

    def measures_as(self, other, name) -> bool:
        """Whether `measure` of ``other`` gives the column ``name`` for rows of this problem too: then it is asked once."""
        return other is self

    def measure_gradient(self, name, x):
        """Return the gradient (n + 1,) of a measure at ``x`` (n + 1,), own units; None: it is differenced."""
        return None

    def parameters(self, x) -> dict[str, float]:
        """Return the parameters at ``x`` (n + 1,) by name."""
        return {self.parameter: float(x[-1])}

    def solution(self, x):
        """Return what ``branch.orbits[i]`` shows for ``x`` (n + 1,)."""
        return Solution(x[:-1].copy(), float(x[-1]))

    def __copy__(self):
        made = object.__new__(type(self))
        made.__dict__.update(self.__dict__)
        return made

    def to_record(self) -> dict:
        """Return a JSON-able description; an algebraic problem is recognised by its class name."""
        return {"kind": "problem", "class": type(self).__name__, "x0": self.x0.tolist(), "scale": self.scale.tolist()}

    def restarted(self, x):
        """Return a copy that starts at ``x`` (n + 1,)."""
        other = copy.copy(self)
        other.x0 = np.array(x, float)
        return other

    def confirm(self, kind, x) -> bool:
        """Whether a zero of a monitor at ``x`` (n + 1,) is what its kind says."""
        return True

    def kind_at(self, monitor, x):
        """Return the kind of the special point where a monitor is zero at ``x`` (n + 1,)."""
        return monitor.kind

    def change(self, kind, x, successor):
        """Return the kind of the boundary at ``x`` (n + 1,) behind which ``successor`` goes on; ``kind`` is what this side
        calls it."""
        return kind

    def is_motion(self, x) -> bool | None:
        """Whether the solution at ``x`` (n + 1,) is a motion that simulation repeats; None where there is nothing to simulate."""
        return None

    def floquet_multipliers(self, x):
        """Return the Floquet multipliers at ``x`` (n + 1,), complex, or None where there are none to be balanced."""
        return None

    def followed_multipliers(self, x):
        """Return numbers (k,) that lie inside the unit circle as the Floquet multipliers at ``x`` (n + 1,) do, and are real as
        their exponents are, None as those: the tracer follows them from row to row, where angles of a linear motion turn."""
        return self.floquet_multipliers(x)

    def half_multipliers(self, x):
        """Return the multipliers of half a period followed by the mirror, complex, of solutions that are their own mirror image
        after half a period; None of others."""
        return None

    def multipliers_of_rows(self, xs):
        """Return the Floquet multipliers (m, k) of rows ``xs`` (m, n + 1), NaN where they are not known, of problems that do not
        watch them in every step; None of others."""
        return None

    def multipliers_at(self, x):
        """Return the multipliers (k,) at a solution ``x`` (n + 1,), complex, as the problem has them; None where it has none."""
        rows = self.multipliers_of_rows(x[None])
        return None if rows is None else rows[0]

    def wrapped_jacobian(self, x, mu):
        """Return F_u (n, n) with the factor ``mu`` on the columns that close the orbit; where `wraps`.

        det F_u(mu) = 0 exactly where mu is a multiplier.
        """
        raise NotImplementedError(f"{type(self).__name__} does not know its multipliers from its equations")

    def pencil(self, x):
        """Return the coefficients (k + 1,) of the characteristic polynomial of the multipliers, constant first, where the problem
        has it in closed form; None elsewhere."""
        return None

    def family_over(self, name, bounds):
        """Return the same equations as a `families.Family` over a second parameter between ``bounds``; None: an attribute of the
        problem is varied."""
        return None

    def bounded(self, low, high, made):
        """Return the problem defined on [low, high]; ``made`` is a dict shared by the problems of a branch."""
        return self

    def same(self, other) -> bool:
        """Whether ``other`` has the same equations and unknowns, so that a branch may close in it."""
        return self is other

    def alike(self, x, near):
        """Return the solution ``x`` (n + 1,) in the form that is next to ``near`` (n + 1,); ``x`` itself where it has one form."""
        return x

    # ---- corrector -------------------------------------------------------------------------------------------------

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """Newton in the plane through ``x`` orthogonal to ``tangent`` (or at fixed parameter), then the tangent there.

        Parameters
        ----------
        x : ndarray (n + 1,)
            Guess; not changed.
        tangent : ndarray (n + 1,)
            Unit, in scaled unknowns; orients the new tangent.
        fixed : bool
            Keep the parameter instead of the plane.

        Returns
        -------
        Corrected
        """
        scale = self.scale if math.isfinite(self.scale[-1]) else np.append(self.scale[:-1], 1.0)  # `trace` has not sized it yet
        row = tangent
        if fixed:
            row = np.zeros_like(tangent)
            row[-1] = 1.0
        start, x, old, contraction = x, x.copy(), math.inf, 0.0
        rounding = 4.0 * EPS * (1.0 + float(np.abs(x / scale).max()))
        matrix = np.empty((scale.size, scale.size))
        right = np.zeros(scale.size)
        with np.errstate(all="ignore"):
            for count in range(MAX_ITERATIONS + 1):
                f, wide, floor = self._linearised(x)
                size_f = float(np.abs(f).max())
                if not (math.isfinite(size_f) and np.isfinite(wide).all()):
                    return self._failed(x, tangent, CorrectorStatus.NOT_FINITE, count, size_f)
                matrix[:-1] = wide * scale
                matrix[-1] = row
                lu, pivots, sign, log = factor(matrix)
                if (np.abs(f) <= floor).all() or old <= max(rounding, SMALL) or (
                        count > 1 and contraction < 0.1 and contraction * contraction * old < 0.1 * rounding):
                    break  # the next quadratic correction would be below rounding
                if sign == 0.0:
                    return self._failed(x, tangent, CorrectorStatus.SINGULAR, count, size_f)
                if count == MAX_ITERATIONS:
                    return self._failed(x, tangent, CorrectorStatus.NOT_CONVERGED, count, size_f)
                right[:-1] = f
                step = solve_factored(lu, pivots, right)
                length = math.sqrt(float(step @ step))
                if not math.isfinite(length):
                    return self._failed(x, tangent, CorrectorStatus.SINGULAR, count, size_f)
                if count > 0:
                    contraction = length / old
                    if contraction > 2.0 and length > 1e-8:
                        return self._failed(x, tangent, CorrectorStatus.NOT_CONVERGED, count, size_f)
                old = length
                p = x[-1]
                x -= scale * step
                if fixed:
                    x[-1] = p
            new, sign, log = self._tangent(matrix, tangent, lu, pivots, sign, log, fixed)
            moved = (x - start) / scale
            status = CorrectorStatus.CONVERGED if sign else CorrectorStatus.SINGULAR
            values = np.asarray(self.monitor_values(x[:-1], float(x[-1]), new), float)
        distance = math.sqrt(float(moved @ moved))
        return Corrected(x, new, True, status, count, size_f, distance, contraction, sign, log, values)

    def follow(self, before, row, signs, sizes, ds, most, limits, origin):
        """Make up to ``most`` steps in which nothing lies that needs a look; for problems that do it faster than step by step.

        Parameters
        ----------
        before, row : Row
            The last two rows of the branch, both of this problem; a first row twice.
        signs, sizes : list
            Last clear sign and largest size of every test (dp/ds and the monitors); the sizes are kept up.
        ds : float
            Length of the next step.
        most : int
        limits : StepOptions
            Lengths of steps and bounds of the parameter.
        origin : float
            Parameter of the point at which a closed branch ends, NaN where there is none.

        Returns
        -------
        made : list of Row
            Behind the last row, in order (`steps.rows.followed`); see `solve.steprun` for the rules. No sign changes in them.
        corrected : Corrected or None
            Correction of the step that comes next, which needs a look; None where it was not tried.
        """
        return [], None

    def leaves(self, a, b) -> float:
        """Return the place in (0, 1) between two rows, ``a`` and ``b``, at which a boundary may be passed twice, -1 where none is.

        For problems with a monitor that is the least of many numbers: the rows tell of those alone that are least there.
        """
        return -1.0

    def wide_jacobian(self, x):
        """Return [F_u F_p] (n, n + 1) at ``x`` (n + 1,)."""
        fu, fp = self.jacobian(x[:-1], float(x[-1]))
        wide = np.empty((self.size, self.size + 1))
        wide[:, :-1] = np.reshape(fu, (self.size, self.size))
        wide[:, -1] = np.reshape(fp, self.size)
        return wide

    def joined_residual(self, x):
        """Return F (n,) at ``x`` (n + 1,)."""
        return np.reshape(np.asarray(self.residual(x[:-1], float(x[-1])), float), self.size)

    def _linearised(self, x):
        """Residual, wide Jacobian, and the rounding level of each residual, estimated from its first-order terms."""
        f = self.joined_residual(x)
        wide = self.wide_jacobian(x)
        return f, wide, EPS * (np.abs(wide) @ np.abs(x))

    def _tangent(self, matrix, tangent, lu, pivots, sign, log, fixed):
        """Null vector of the matrix' first n rows, oriented, with sign and log of the determinant bordered by it."""
        if fixed:
            matrix[-1] = tangent
            lu, pivots, sign, log = factor(matrix)
        if sign == 0.0:
            return tangent, 0.0, -math.inf
        right = np.zeros(tangent.size)
        right[-1] = 1.0
        new = solve_factored(lu, pivots, right)
        length = math.sqrt(float(new @ new))
        if not 0.0 < length < 1.0 / EPS:
            return tangent, 0.0, -math.inf
        return new / length, sign, log + math.log(length)  # det [J; new] = det [J; old] / (old . new)

    def _failed(self, x, tangent, status, count, size_f):
        """Return what is left of a guess from which no solution was reached: its last point and its largest residual."""
        return Corrected(x, tangent, False, status, count, size_f, math.inf, math.inf, 0.0, -math.inf, NO_MONITORS)

    def _size(self, i):
        return self.scale[i] if math.isfinite(self.scale[i]) else 1.0


def at_end(problem, row, zero) -> np.ndarray:
    """Return values of the monitors (k,) where the equations of a problem are singular, at an end near ``row``: 0 for the number
    ``zero``, NaN for what is no boundary; the tracer looks that up beside."""
    values = np.array(row.tests[1:])
    for k in range(values.size):
        if k >= len(problem.monitors) or not problem.monitors[k].boundary:
            values[k] = np.nan
    values[zero] = 0.0
    return values


DIFFERENCE = 7e-4  # EPS**(1/5): truncation h^4 and rounding EPS/h balance


def _positive(value, name):
    array = np.asarray(value, float)
    if not (np.isfinite(array).all() and (array > 0.0).all()):
        raise ValueError(f"{name} must be finite and positive, got {value!r}")
    return array
