"""`trace`: a branch of solutions from a start, both ways, with its special points.

One file, because a branch is begun, run both ways and extended under the same options.
"""
import copy
import logging
import math
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from ..checks import checked, choice, function, number, of, pair, whole
from ..jobs.progress import Progress
from ..solve.bordered import null_vectors
from ..solve.newton import newton
from .branches.branch import Branch
from .kinds import ERRORS, PASSED_ON, ContinuationError, CorrectorStatus, SpecialPointKind, StopReason
from .maps.orbit import MapOrbit
from .monitors import with_monitors
from .peaks import checked_peaks, with_peaks
from .problem import Corrected, Problem
from .registry import OF_ENERGY, OF_START, of_class
from .steps import detect, inside
from .steps.arclength import SLOPE, Half, StepOptions, outward
from .steps.branchpoint import first_direction, locate_crossing, wide
from .steps.roots import polish
from .steps.rows import Part, Row, reversed_row, tests_of
from .steps.tori import STABILITY
from .watching import Watching

LOG = logging.getLogger(__name__)
STANDS = 1e-3  # slope of the parameter at a start, below which it may be that of another branch next to it
ON_BOUNDARY = 1e-10  # value of a boundary monitor that counts as zero at the start
BESIDE = (1e-7, 1e-6, 1e-5, 1e-4)  # arclengths at which the side of a boundary is looked up: the first that tells
INSIDE = 1e-2  # of that length, on the side before: there dp/ds is asked
TELLS = 1e-9  # change of a boundary monitor that is no rounding
KNOWN = 1e-12  # of a parameter: so well a start knows one that is measured from its solution, such as its energy
DS, DS_MIN, DS_MAX, MAX_STEPS = 0.02, 1e-11, 0.2, 2000
HANDED_ON = {"ds": DS, "ds_max": None, "ds_min": DS_MIN, "max_steps": MAX_STEPS, "peaks": None, "audit": "full"}  # by other verbs


@checked(audit=of(choice, allowed=("full", "fast")))
def trace(start, parameter=None, bounds=None, direction=None, *, ds=DS, ds_max=None, ds_min=DS_MIN, max_steps=MAX_STEPS,
          stop=None, record=None, progress=None, peaks=None, monitors=None, audit="full") -> Branch:
    """Trace the branch of solutions through a start by pseudo-arclength continuation.

    Lengths are measured in scaled unknowns: a length of 1 is one natural size of the unknowns, or half the width of the
    bounds in the parameter (see `Problem`).

    Parameters
    ----------
    start : PeriodicOrbit, Equilibrium or Problem
        A `Problem` starts at its ``x0``, corrected at fixed parameter.
    parameter : str, optional
        Name of the parameter; a `Problem` has only its own.
    bounds : tuple of float, optional
        Two values of the parameter in any order, own units; each half ends exactly on its own.
    direction : {None, 1, -1}
        Both ways, or only with the parameter growing (1) or falling (-1) at first.
    ds, ds_max, ds_min : float
        First, largest and smallest step, dimensionless. ``ds_max`` is by default 0.2, or ``ds`` if that is larger.
    max_steps : int
        Largest number of steps of each half.
    stop : callable, optional
        ``stop(point) -> bool`` ends a half after the point for which it is true; see `rows.Point`.
    record : callable, optional
        ``record(point) -> dict of float``: further columns. It is asked at rows in the order of travel, and at the special points
        in the end, where `SpecialPoint.measures` has its values.
    progress : bool or callable, optional
        True shows a bar if tqdm is installed; a callable gets ``(parameter, count)`` after every step.
    peaks : str or sequence of str, optional
        Measures (columns such as ``max_0``, ``h1_0``, ``rms_0``) whose maxima along the branch become special points of
        kind ``peak``, located like folds. Default none: each costs the gradient of its measure at every step.
    monitors : dict of str to callable, optional
        The user's own numbers of a solution: ``{"clearance": lambda orbit: 1.0 - orbit.maximum()}``. Where one is zero is a
        special point of kind ``user`` with its name, which `trace_curve` follows.
    audit : {"full", "fast"}
        What `Branch.audit` does when it is asked for: "full" also simulates every orbit again over its period and balances
        multipliers with special points, and says what that cost.

    Returns
    -------
    Branch
        Also when the trace is interrupted from the keyboard: then with the points so far.

    Raises
    ------
    ContinuationError
        If the start cannot be corrected onto a branch or is not valid.
    ValueError
        For bounds that are empty or do not hold the start, and step lengths that are not positive.

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), guess=(1.0, 0.2))
    >>> branch = bf.trace(orbit, "omega", bounds=(1.45, 1.55))
    >>> [str(reason) for reason in branch.stop_reason]
    ['bound', 'bound']
    """
    low, high = ordered_bounds(bounds)
    problem = with_monitors(with_peaks(problem_of(start, parameter, bounds), peaks), monitors)
    options = step_options(low, high, ds, ds_max, ds_min, max_steps, stop, record, None, audit)
    p0 = float(problem.x0[-1])
    if not low - KNOWN * abs(p0) <= p0 <= high + KNOWN * abs(p0):
        raise ValueError(f"the start has {problem.parameter} = {p0:.12g}, outside the bounds ({low:.12g}, {high:.12g})")
    problem = with_scale(problem, low, high)
    first, singular = start_row(problem, options)
    first.ds = options.ds
    with points_shown(progress, problem.parameter) as shown:
        options = replace(options, progress=shown)
        plus, minus = Half(first, options, origin=first), Half(reversed_row(first), options)
        minus.origin = minus.rows[0]
        here = start_points(plus, first, singular)
        plus.ask_user(first)
        minus.rows[0].recorded = first.recorded
        if plus.reason is not None:
            minus.stop(StopReason.STOPPED if plus.reason is StopReason.STOPPED else plus.reason, plus.message)
        for half in (plus, minus):
            kept(half, begin_on_boundary, half)
        run_halves(plus, minus, direction, singular is None and first.singular)
        plus.found[:0] = here
        for half in (plus, minus):
            half.record_points()
    return Branch.of_halves(plus, minus, options)


def problem_of(start, parameter, bounds):
    """Return the problem of a start object; a periodic orbit needs the name of a parameter and bounds."""
    energy = parameter == "energy" and of_class(OF_ENERGY, start)
    if energy and start.autonomous:
        return energy(start)
    maker = of_class(OF_START, start)
    if maker is not None:
        if parameter is None or (bounds is None and not isinstance(start, MapOrbit)):
            raise ValueError(f"a start of class {type(start).__name__} is traced in a parameter between bounds: "
                             "trace(start, 'omega', bounds=(a, b))")
        return maker(start, parameter, None if bounds is None else ordered_bounds(bounds))
    if not isinstance(start, (Problem, Watching)):
        raise TypeError(f"start must be a PeriodicOrbit, an Equilibrium or a Problem, got {type(start).__name__}")
    if parameter is not None and parameter != start.parameter:
        raise ValueError(f"unknown parameter {parameter!r}; this problem has only {start.parameter!r}")
    return start


def ordered_bounds(bounds):
    """Return (low, high) of an unordered pair; None is unbounded."""
    a, b = (-math.inf, math.inf) if bounds is None else pair("", "bounds", bounds)
    return min(a, b), max(a, b)


def step_options(low, high, ds, ds_max, ds_min, max_steps, stop, record, progress, audit="full"):
    """Check the step lengths and join them with the bounds."""
    if audit not in ("full", "fast"):
        raise ValueError(f"audit must be 'full' or 'fast', got {audit!r}")
    for name, value in (("ds", ds), ("ds_max", DS_MAX if ds_max is None else ds_max), ("ds_min", ds_min)):
        number("", name, value, above=0.0)
    ds_max = max(DS_MAX, ds) if ds_max is None else ds_max
    if not ds_min <= ds_max:
        raise ValueError(f"ds_min = {ds_min!r} must not exceed ds_max = {ds_max!r}")
    whole("", "max_steps", max_steps, least=0)
    for name, value in (("stop", stop), ("record", record)):
        if value is not None:
            function("", name, value)
    return StepOptions(low, high, min(float(ds), float(ds_max)), float(ds_min), float(ds_max), int(max_steps), stop,
                       record, progress, audit)


def handed_on(owner: str, options, bounds, names) -> dict:
    """Return options that another verb hands on to `trace`, or raise ValueError: before any work, and naming the ``owner``.

    Parameters
    ----------
    owner : str
    options : mapping or None
    bounds : (float, float)
    names : sequence of str
        Measures that may be followed as ``peaks``.
    """
    if options is not None and not isinstance(options, Mapping):
        raise ValueError(f"{owner}: trace = {options!r} is not allowed; it must be a mapping with options of trace")
    options = dict(options or {})
    unknown = [name for name in options if name not in HANDED_ON]
    if unknown:
        raise ValueError(f"{owner}: trace has {', '.join(map(repr, unknown))}; options that are handed on to trace are "
                         f"{', '.join(HANDED_ON)}")
    try:
        steps = {name: options.get(name, value) for name, value in HANDED_ON.items() if name != "peaks"}
        low, high = bounds
        step_options(low, high, steps["ds"], steps["ds_max"], steps["ds_min"], steps["max_steps"], None, None, None, steps["audit"])
        checked_peaks(options.get("peaks"), names)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{owner}: trace = {options!r} is not allowed; {error}") from None
    return options


def with_scale(problem, low, high):
    """Return the problem with the natural size of its parameter filled in, if it left it open."""
    if math.isfinite(problem.scale[-1]):
        return problem
    problem = copy.copy(problem)
    problem.scale = problem.scale.copy()
    width = 0.5 * (high - low)
    problem.scale[-1] = width if math.isfinite(width) else max(1.0, abs(float(problem.x0[-1])))
    return problem


def start_row(problem, options):
    """Correct the start and find its tangent, also at a fold or a branch point; returns (row, Crossing or None)."""
    x = np.array(problem.x0, float)
    x[-1] = min(max(x[-1], options.low), options.high)
    n = x.size - 1
    j = wide(problem, x)
    if not np.isfinite(j).all():
        raise ContinuationError(f"the Jacobian at the start ({problem.parameter} = {x[-1]:.12g}) is not finite; bounds = "
                                f"({options.low:g}, {options.high:g}) are perhaps too wide for numbers that depend on it")
    right, _ = null_vectors(j)
    part = Part(problem, 0)
    if len(right) > 1:
        crossing = locate_crossing(problem, x)
        if crossing.status == "located" and float(np.abs((crossing.x - x) / problem.scale).max()) < 1e-6:
            tangent = first_direction(problem.own_directions(crossing.directions))
            at = crossing.x.copy()
            at[-1] = x[-1] if abs(at[-1] - x[-1]) <= 1e-12 * problem.scale[-1] else at[-1]
            residual = float(np.abs(problem.residual(at[:-1], float(at[-1]))).max())
            c = problem.correct(at, tangent)  # where it converges at all it errs more than the crossing
            monitors = c.monitors if c.converged else problem.monitor_values(at[:-1], float(at[-1]), tangent)
            c = Corrected(at, tangent, True, CorrectorStatus.SINGULAR, c.iterations, residual, 0.0, 0.0, 0.0, -math.inf, monitors)
            return Row(c, part, 0.0, 0.0, tests_of(c), options.ds), crossing
        c = problem.correct(x, oriented(right[-1]))  # the tangent, where the rank is only nearly lost
        if not c.converged:
            c = problem.correct(x, oriented(right[0]))
        if not c.converged:  # nearly singular only, next to where events meet: along the parameter there is a solution
            c = problem.correct(x, np.append(np.zeros(n), 1.0), True)
        if not c.converged:
            raise ContinuationError(f"the Jacobian at the start has lost {len(right) - 1} ranks and Newton ended with "
                                    f"{c.status!s}; start from a point next to this one")
        return Row(c, part, 0.0, 0.0, tests_of(c), options.ds), None
    tangent = oriented(right[0])
    c = None
    if abs(tangent[-1]) > 1e-6:
        c = problem.correct(x, tangent, True)
        if c.converged and abs(tangent[-1]) < STANDS and abs(float(np.dot(tangent, c.tangent))) < problem.same_tangent:
            c = problem.correct(x, tangent)  # where the parameter stands still, keeping it leads to another branch
        if not c.converged:
            solved = newton(lambda u: np.reshape(problem.residual(u, float(x[-1])), n),
                            lambda u: np.reshape(problem.jacobian(u, float(x[-1]))[0], (n, n)), x[:-1],
                            problem.scale[:-1])
            if solved.success:
                c = problem.correct(np.append(solved.x, x[-1]), tangent, True)
    if c is None or not c.converged:
        c = problem.correct(x, tangent)
    if not c.converged:
        raise ContinuationError(f"no solution was found near the start ({problem.parameter} = {x[-1]:.12g}): the "
                                f"corrector ended with {c.status!s}, residual {c.residual:.2e}; give a better guess")
    if not options.low <= c.p <= options.high:
        c.x[-1] = min(max(c.p, options.low), options.high)
    if float(np.dot(oriented(c.tangent), c.tangent)) < 0.0:
        flip(c, part)
    row = Row(c, part, 0.0, 0.0, tests_of(c), options.ds)
    k = broken(row)
    if k is None:
        return row, None
    inner = inside_boundary(row, options)
    if inner is None:
        raise ContinuationError(f"the start is not valid: its test for {part.kinds[k].value} is {row.tests[k]:.3g} > 0")
    return inner, None


def broken(row):
    """Return the first boundary that a start lies beyond, of which there is no zero next to it; None where it is valid."""
    return next((k for k in row.part.boundary if row.tests[k] > ON_BOUNDARY and not silent(row, k) and boundary_at(row, k) is None),
                None)


def inside_boundary(row, options):
    """Return the row just inside the boundary on which a start lies, when rounding has left it outside; None where none is valid.

    Outside of one boundary the tests of others are those of no motion: events that meet on it change their order there.
    """
    if not any(abs(row.tests[j]) <= ON_BOUNDARY for j in row.part.boundary):
        return None
    near = INSIDE * BESIDE[0]  # ten times what counts as zero there
    for length in (near, -near):
        c = stepped(row, length)
        if c is not None and options.low <= c.p <= options.high:
            inner = Row(c, row.part, 0.0, 0.0, tests_of(c), options.ds)
            if broken(inner) is None:
                return inner
    return None


def oriented(tangent):
    """Orient by growing parameter, where that stands still by the largest unknown."""
    k = -1 if abs(tangent[-1]) > SLOPE else int(np.argmax(np.abs(tangent)))
    return tangent if tangent[k] > 0.0 else -tangent


def flip(c, part):
    """Turn a corrected point round in place."""
    c.tangent = -c.tangent
    c.det_sign = -c.det_sign
    c.monitors = part.turned(c.monitors)


def start_points(half, row, crossing):
    """Special points exactly at the first row."""
    found = detect.at_end(half, row)
    if any(abs(row.tests[j]) <= ON_BOUNDARY for j in row.part.boundary):  # an event of no duration: dp/ds and multipliers there
        found = [special for special in found if special.kind not in STABILITY]  # are zero or rounding, and no bifurcation
    if crossing is not None and len(row.part.problem.own_directions(crossing.directions)) > 1:  # else a boundary tells it
        width = max(crossing.error, 1e-15)
        found.append(detect.Found(SpecialPointKind.BRANCH_POINT, "", crossing.x, row.tangent, 0.0, -width, width,
                                  crossing.error * float(row.part.scale[-1]), row.part, directions=crossing.directions))
    return found


def begin_on_boundary(half):
    """Where the first row lies on a boundary, note the sign behind it or go on at once with the equations beyond."""
    row = half.rows[0]
    part = row.part
    here = [j for j in part.boundary if row.tests[j] >= -ON_BOUNDARY]
    if not here or outward(row, half.options):  # it ends here
        return
    half.edge = inside.AT_BOUNDARY
    try:
        aside, changes = beside(row, here)
    except part.problem.errors:  # the first step will say what
        return
    for j, change in zip(here, changes, strict=True):
        if not abs(change) > TELLS:
            continue
        half.edge = max(half.edge, abs(row.tests[j] / change) * aside)  # what counts as zero may be as far from it as this
        if change < 0.0 and not (row.tests[j] > ON_BOUNDARY and silent(row, j)):  # there other equations are valid both ways
            half.signs[j] = -1
            continue
        reached = ahead(row, j)(BESIDE[0])
        if reached is not None and reached[0] < 0.0:  # small but clear, as behind a slow impact: the boundary lies ahead
            continue
        root = None if row.singular else boundary_at(row, j)  # a branch point is known better than what Newton finds next to it
        if root is None and not (row.singular or silent(row, j) or abs(row.tests[j]) <= part.touch < math.inf):
            continue
        cut = cut_at(row, j, root)
        if not cut.silent:
            half.found.append(cut.special)
        made = ahead(row, j)(-INSIDE * aside)  # dp/ds just before, on the side that is valid: on the boundary it may be zero
        half.slope = float(made[1].tangent[-1]) if made is not None else row.tests[0]
        half.cross(row, cut)
        if half.reason is not None:  # nothing goes on: it is named as after a step
            half.run()
        return


def stepped(row, s):
    """Return the point at arclength ``s`` along the tangent of a row, None where nothing is found there."""
    c = row.part.problem.correct(row.x + s * row.direction, row.tangent)
    return c if c.converged else None


def ahead(row, j):
    """Return ``f(s) -> (value of test j, point)``, see `stepped`."""
    def value(s):
        c = stepped(row, s)
        return None if c is None else (tests_of(c)[j], c)
    return value


def silent(row, j):
    """Whether boundary ``j`` of a row is one of the equations only: motions beyond are as good."""
    return row.part.problem.silent(row.part.monitors[j - 1], row.x)


def cut_at(row, j, root):
    """Return a first row as the end of a step on the boundary ``j``: at its zero ``root``, or itself where there is none."""
    part = row.part
    if root is None:
        low = high = error = 0.0
        c = Corrected(row.x, row.tangent, True, CorrectorStatus.CONVERGED, 0, row.residual, 0.0, 0.0, row.det_sign, row.det_log,
                      np.array(row.tests[1:]))
    else:
        c, low, high = root.point, min(root.low, 0.0), max(root.high, 0.0)
        error = detect.parameter_error(part, c, root, j)
    special = detect.Found(*detect.named(part, j, c.x), c.x, c.tangent, 0.0, low, high, error, part, corrected=c)
    return detect.Cut(row, c, j, special)


def boundary_at(row, j):
    """Return the zero of test ``j`` at a first row, to the arclength to which such places are known; None where there is none."""
    root = polish(ahead(row, j), 0.0, 0.0, None)
    return None if root is None or abs(root.at) > inside.WIDE else root


def beside(row, tests):
    """Return a length behind ``row`` and the changes of ``tests`` there, the least at which one of them is no rounding: the stretch
    behind a boundary may be short, and what another one says further on is not of this place."""
    aside, changes = 0.0, np.zeros(len(tests))
    for length in BESIDE:
        c = stepped(row, length)
        if c is not None:
            values = tests_of(c)
            aside, changes = length, np.array([values[j] - row.tests[j] for j in tests])
            if np.abs(changes).max() > TELLS:
                break
    return aside, changes


def run_halves(plus, minus, direction, lost):
    """Run the halves that were asked for; an interruption keeps what there is."""
    for half, wanted in ((plus, direction != -1), (minus, direction != 1)):
        if half.reason is not None:
            continue
        if not wanted:
            half.stop(StopReason.NOT_STARTED)
        elif lost:
            half.stop(StopReason.SINGULAR, "the Jacobian at the start has lost rank and no two branches cross there")
        elif half is minus and plus.reason is StopReason.CLOSED:
            half.stop(StopReason.CLOSED)
        elif half is minus and plus.reason is StopReason.INTERRUPTED:
            half.stop(StopReason.INTERRUPTED)
        else:
            kept(half, half.run)
    if minus.reason is StopReason.CLOSED:
        plus.stop(StopReason.CLOSED, plus.message)


def kept(half, work, *arguments) -> None:
    """Do a part of a trace; an interruption, and what formulas raise where no step can be refused for it, ends the half with the
    rows that it has. Of a caller's own problem that may be any class of errors; of others what is no number is a mistake here."""
    try:
        work(*arguments)
    except KeyboardInterrupt:
        half.stop(StopReason.INTERRUPTED)
    except PASSED_ON:
        raise
    except Exception as error:
        errors = half.rows[-1].part.problem.errors
        if errors is not ERRORS and not isinstance(error, errors):
            raise
        LOG.exception("a trace in %s ended at %.12g", half.rows[-1].part.problem.parameter, half.rows[-1].p)
        half.stop(StopReason.EXCEPTION, f"{type(error).__name__}: {error}")


@contextmanager
def points_shown(wanted, name):
    """``progress=`` of a branch as a function of (parameter, count), or None: a bar that counts points for True."""
    if wanted is not True:
        yield wanted or None
        return
    with Progress("branch", None) as bar:
        yield lambda p, count: bar.advance(1, f"{name} = {p:.6g}")


def extend(branch: Branch, bounds=None, *, ds_max=None, max_steps=MAX_STEPS, stop=None, record=None,
           progress=None) -> Branch:
    """Go on at both ends of a branch; see `Branch.extend`."""
    low, high = (branch.bounds if bounds is None else ordered_bounds(bounds))
    for end in branch.ends:
        if end.reason is StopReason.BOUND and not low <= end.p <= high:
            raise ValueError(f"the branch ends at {branch.parameter} = {end.p:.12g}, outside the bounds "
                             f"({low:.12g}, {high:.12g})")
    old = branch.options
    with points_shown(progress, branch.parameter) as shown:
        ds_max = old["ds_max"] if ds_max is None else ds_max
        options = step_options(low, high, old["ds"], ds_max, old["ds_min"], max_steps, stop, record, shown,
                               old.get("audit", "full"))
        branch = branch.reaching(low, high)
        rows = branch.rows()
        plus = Half(rows[-1], options, origin=rows[0] if len(rows) > 2 else None)
        minus = Half(reversed_row(rows[0]), options)
        for half, end in ((plus, branch.ends[1]), (minus, branch.ends[0])):
            half.ds = end.ds
            if end.reason in (StopReason.CLOSED, StopReason.NOT_STARTED):
                half.stop(end.reason, end.message)
        run_halves(plus, minus, None, False)
        for half in (plus, minus):
            half.record_points()
    return branch.joined(rows, plus, minus, options)
