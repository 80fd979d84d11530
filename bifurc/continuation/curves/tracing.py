"""`trace_curve`: folds, grazings, flips, peaks followed in two parameters on one augmented system.

That is an ordinary `Problem` in the second parameter (`problem`), so that steps, bounds, location of special points, saving
and extending are those of `trace`.
"""
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ... import plotting
from ...checks import checked, either, many, mapping, of, pair, word
from ..branches.branch import Branch
from ..branches.special import SpecialPoint
from ..families import family_of
from ..grazing.following import Touching, touching
from ..kinds import SpecialPointKind
from ..monitors import WithMonitors
from ..shooting.completion import completion_near
from ..tracing import DS, DS_MIN, MAX_STEPS, ordered_bounds, trace
from ..watching import Watching, bare
from .problem import BOUND, CurveProblem
from .unfolding import Unfolded, unfolded

STILL = 1e-6  # both components of the unit tangent in the plane of the parameters at a cusp
TOGETHER = 1e-5  # arclength within which the extrema of both are the same cusp
ASIDE, BROKEN = 1e-4, 1e-7  # scaled change of a second parameter; and of a distance along an orbit, which is not constant then
APART = 1e-6  # by which a unit step along a curve of branch points may part the branches


class ParameterCurve(Branch):
    """A curve of special points in two parameters, as returned by `trace_curve`: a `Branch` with one more column.

    Attributes
    ----------
    parameters : tuple of str
        Both names, in the order in which they were asked for.
    kind : SpecialPointKind
        What is followed.
    name : str
        That of a user's monitor; empty for other kinds.

    Notes
    -----
    Special points: ``extremum`` (``name`` is the parameter that turns back, or the measure that is stationary along a
    curve of peaks), ``cusp``, and those at which the followed orbit ends. The second parameter of a point is in
    ``point.parameters``.
    """

    def __init__(self, parameter, problems, arrays, special_points, ends, bounds, options, unresolved=()):
        points = renamed(parameter, special_points)
        super().__init__(parameter, problems, arrays, points, ends, bounds, options, unresolved)
        self.parameters = tuple(options.get("parameters") or (problems[0].base_parameter, parameter))
        self.kind = problems[0].kind
        self.name = problems[0].name if self.kind == SpecialPointKind.USER else ""

    def __repr__(self) -> str:
        a, b = (self.column(name) for name in self.parameters)
        found = ", ".join(point.kind.value + (f" of {point.name}" if point.name else "") for point in self.special_points)
        return (f"ParameterCurve({self.kind.value}: {self.parameters[0]} {a.min():.6g} to {a.max():.6g}, {self.parameters[1]} "
                f"{b.min():.6g} to {b.max():.6g}, {len(self)} points, {found or 'no special points'}, "
                f"ends: {self.ends[0].reason.value}, {self.ends[1].reason.value})")

    @checked()
    def plot(self, ax=None):
        """Draw the curve in the plane of the two parameters; returns the axes."""
        return plotting.plot_curve(self, ax=ax)

    def to_record(self):
        """See `Branch.to_record`."""
        header, arrays = super().to_record()
        return {**header, "kind": "curve"}, arrays


def renamed(parameter, points):
    """Special points in the words of a curve: extrema of either parameter; both at once are a cusp."""
    points = [replace(point, kind=SpecialPointKind.EXTREMUM, name=parameter) if point.kind is SpecialPointKind.FOLD else point
              for point in points if point.name != BOUND]
    kept: list = []
    for point in points:
        still = point.kind is SpecialPointKind.EXTREMUM and float(np.abs(point.tangent[-2:]).max()) <= STILL
        if still:
            point = replace(point, kind=SpecialPointKind.CUSP, name="")
        twin = any(other.kind is SpecialPointKind.CUSP and abs(other.s - point.s) <= TOGETHER for other in kept)
        if not (still and twin):
            kept.append(point)
    return kept


@checked(parameters=of(many, of=word, count=2), bounds=None)
def trace_curve(point, parameters, bounds=None, direction=None, *, ds=DS, ds_max=None, ds_min=DS_MIN, max_steps=MAX_STEPS,
                stop=None, record=None, progress=None) -> ParameterCurve:
    """Follow a special point of a branch in two parameters.

    Parameters
    ----------
    point : SpecialPoint
        A fold, grazing, period doubling, torus point, branch point, peak, or any zero of a monitor, of a branch of periodic
        orbits, of harmonic balance, or of a `Problem`.
    parameters : (str, str)
        The branch's own parameter and a second one, in any order; the first is drawn on the horizontal axis. The second
        parameter of a hand-written `Problem` is an attribute of it.
    bounds : dict or sequence, optional
        Values between which the curve is followed: ``{"omega": (0.5, 2), "amplitude": (0, 1)}``, or two pairs in the order
        of ``parameters``. Orbits need those of the second parameter; those of the branch's own default to the bounds of
        its branch where known, for orbits.
    direction : {None, 1, -1}
        Both ways, or with the second parameter growing or falling at first.
    ds, ds_max, ds_min, max_steps, stop, record, progress
        As for `trace`.

    Returns
    -------
    ParameterCurve

    Raises
    ------
    ContinuationError
        If the point cannot be corrected onto a curve.
    ValueError
        For kinds that no curve follows, unknown parameters, and bounds that do not hold the start.

    Examples
    --------
    >>> import bifurc as bf
    >>> duffing = bf.systems.duffing_oscillator()
    >>> branch = bf.trace(bf.find_orbit(duffing), "omega", bounds=(0.5, 2.5))
    >>> fold = [point for point in branch.special_points if point.kind == "fold"][0]
    >>> len(bf.trace_curve(fold, ("omega", "zeta"), bounds=((0.5, 2.5), (0.01, 0.4))).special_points) > 0     # a cusp
    True
    """
    if not isinstance(point, SpecialPoint) or point.problem is None:
        raise ValueError(f"point = {point!r} is not allowed; it must be a special point of a branch, with its problem")
    problem = point.problem
    inner = bare(problem)
    kind, named, at = point.kind, point.name, point.x
    if isinstance(inner, CurveProblem):
        raise ValueError(f"the {kind.value} is a point of a curve in two parameters already; curves that leave it begin at "
                         "the points that switch_branch(point) gives")
    if kind is SpecialPointKind.GRAZING and inner.sequence is not None:
        touch = touching(inner, at)
        if touch is not None and touch[0] is not inner:  # follow the orbit that touches, from whichever side it was met
            inner, at, named = touch[0], touch[1], "unlisted"
    if kind is SpecialPointKind.CHATTER_COMPLETION and inner.sequence is not None:
        found = completion_near(inner, at)
        inner, at = (inner, at) if found is None else found[:2]
    names = tuple(full_name(inner, name) for name in parameters)
    if inner.parameter not in names:
        raise ValueError(f"parameters = {tuple(parameters)!r} must hold the parameter of the branch, {inner.parameter!r}")
    if names[0] == names[1]:
        raise ValueError(f"parameters must be two different names, got {parameters!r}")
    second = names[1] if names[0] == inner.parameter else names[0]
    table = bounds_by_name(inner, names, bounds)
    low, high = table[second]
    a = table[inner.parameter]
    path = inner.path
    if path is not None:
        if not math.isfinite(a[0] + a[1]):
            a = (path.low, path.high)
        elif a[0] < path.low or a[1] > path.high:
            inner = inner.bounded(*a, {})
    if not a[0] <= at[-1] <= a[1]:
        raise ValueError(f"the point has {inner.parameter} = {at[-1]:.12g}, outside the bounds {a!r}")
    if kind is SpecialPointKind.BRANCH_POINT and not any(m.kind is kind and m.name == named for m in inner.monitors):
        other = unfolded(inner, at)
        inner, at = (inner, at) if other is None else (other, other.x0)
    family = family_of(inner, second, (low, high))
    if not low <= family.value <= high:
        raise ValueError(f"the point has {second} = {family.value:.12g}, outside the bounds ({low:.12g}, {high:.12g})")
    function = watching_function(problem, kind, named)
    start = CurveProblem(family, kind, named, a, np.append(at, family.value), function)
    if isinstance(inner, Unfolded):
        kept_together(start)
    if isinstance(start.condition, Touching) and start.condition.constant:
        kept_concentric(start)
    made = trace(start, bounds=(low, high) if math.isfinite(low) or math.isfinite(high) else None, direction=direction, ds=ds,
                 ds_max=ds_max, ds_min=ds_min, max_steps=max_steps, stop=stop, record=record, progress=progress)
    return ParameterCurve(made.parameter, made.problems, made._arrays, made.special_points, made.ends, made.bounds,
                          {**made.options, "parameters": list(names)}, made.unresolved)


def kept_together(start):
    """Raise a `ValueError` where the second parameter breaks a branch point into two branches that miss each other."""
    tangent = np.zeros(start.x0.size)
    tangent[-1] = 1.0
    c = start.correct(start.x0, tangent)
    if c.converged and abs(float(c.tangent[-3])) > APART:
        raise ValueError(f"this branch point cannot be followed in two parameters: {start.parameter} breaks it into two branches "
                         "that miss each other, so that it exists in isolated points only; follow a fold of either branch")


def kept_concentric(start):
    """Raise a `ValueError` where the second parameter breaks a touch that lasts all the time into one of an instant."""
    tangent = np.zeros(start.x0.size)
    tangent[-1] = 1.0
    for sign in (1.0, -1.0):
        problem = start.family.at(at := float(start.x0[-1] + sign * ASIDE * start.scale[-1]))
        c = problem.correct(start.x0[:-1], tangent[1:], True)
        if c.converged and start.condition.varies(problem, c.x) > BROKEN:
            raise ValueError(f"this grazing cannot be followed in two parameters: the distance to the wall is constant along the "
                             f"orbit, which touches it all the time, and {start.parameter} = {at:.6g} ends that; give the stator "
                             "an offset on which the orbit touches at an instant, and follow the grazing there")


def watching_function(problem, kind, name):
    """Return the user's function whose zero is followed, or None."""
    while isinstance(problem, Watching):
        if kind is SpecialPointKind.USER and isinstance(problem, WithMonitors) and name in problem.functions:
            return problem.functions[name]
        problem = problem.inner
    return None


def full_name(problem, name):
    """Return the full name of a parameter of an orbit's system; that of a hand-written problem is what it is."""
    return name if problem.system is None else problem.system.parameter_name(name)


def bounds_by_name(problem, names, bounds):
    """Return {name: (low, high)}, unbounded where nothing was given."""
    table = dict.fromkeys(names, (-math.inf, math.inf))
    if bounds is None:
        return table
    if not isinstance(bounds, Mapping):
        bounds = dict(zip(names, either(of(many, of=_ends, count=2), allowed="a dict of pairs by name, or two pairs of different "
                                        "numbers in the order of the parameters")("", "bounds", bounds), strict=True))
    for name, ends in mapping("", "bounds", bounds).items():
        full = full_name(problem, name) if name not in table else name
        if full not in table:
            raise ValueError(f"bounds name {name!r}; the parameters are {names[0]!r} and {names[1]!r}")
        table[full] = ordered_bounds(_ends("", f"bounds[{name!r}]", ends))
    return table


def _ends(owner: str, name: str, value):
    """The kind of the bounds of one parameter: a pair, or None, which is unbounded."""
    return None if value is None else pair(owner, name, value)
