"""What lies in a step: boundaries of validity, branch points, folds and zeros of monitors.

A boundary is located first and the step is cut there, so that every other test is one-sided.  A test counts as crossed
when its last clear sign changes; values at rounding level keep the old sign, so that a step that lands on a zero
neither loses it nor counts it twice.

One file, because every test of a step is bracketed, cut and polished by the same functions.
"""
import math
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any, SupportsFloat

import numpy as np

from ...lazy import Later
from ...solve import steplaw
from ...solve.steplaw import BOUNDARY_BAND, MONITOR_BAND, SLOPE_BAND
from ...solve.zeros import SAFETY
from ..kinds import CorrectorStatus, LocationStatus, SpecialPointKind, StopReason
from ..problem import ROUNDED, Corrected
from ..watching import bare
from .branchpoint import locate_crossing
from .hidden import jumped, nearly_singular, rounding
from .inside import AT_BOUNDARY, beginning, ending, known_to
from .roots import PROBE, Root, bracketed, enclose, off_line, polish
from .rows import Curve, Part, Point, Row, tests_of
from .tori import REAL, STABILITY, inner_change, next_to, on_circle, pair_on_circle, passes

crosses = steplaw.crosses.py_func
NEAR_EDGE = 0.1  # of a test in the row before: so little of it is left on a boundary that it is linear there
ASIDE_STEP = 1e-4  # arclength at which the size of a test is looked up behind a first row
ASIDE_VALUE = 1e-6  # of a test at a first row that may be a zero
ASIDE_NOISE, NOISE_AT = 1e-6, (1.0, 2.4, 4.0)  # arclength before a row, its multiples: there noise is looked up
NARROW = 1e-12  # part of a step in which a leap is enclosed: no smaller one is told from rounding
ENCLOSED = 1e-6  # arclength of a step in which a boundary that cannot be polished is enclosed by halving, also where it jumps
CREEPING = 1e-5  # value of a boundary's monitor below which a branch that takes no further step may be at it
SPANS = 16  # parts of a step in which a pair is looked for, at most
BESIDE = (0.05, 0.005, 5e-4, 5e-5)  # of the way from one special point to the next, at which multipliers are counted: the first of
# these where their number is one that the point itself allows
FLOW = 4e-14  # relative rounding of what makes the flow of a period: coefficients, their series, exponentials of matrices
LATE = 1e-3  # part of a step: a zero that small changes of the numbers move by less the opposite ones move as far
FLAT, CLEARLY = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3), 4.0  # arclengths from a zero at which a flat test is looked up; of its rounding
STRAIGHT, AS_SAID = (1e-3, 1e-2, 0.1), 2.0  # parts of a step from a zero at which a test is a line; factor to what its slope says
ASTRAY = 0.5  # of such a length, by which a point may lie beside the curve: far behind a short step that leads anywhere
AHEAD = (1e-4, 1e-5, 1e-6)  # arclengths behind a boundary to which equations are followed that tell its place
BLURRED = 0.1  # of the way to a boundary, by which rounding may move a solution there
EQUAL = 4e-15  # of a parameter and its scale: values that rounding makes of one
RESOLVED = (1e-7, 1e-6, 1e-5, 1e-4)  # lengths of such ways that are tried
SHORT = 1e-6  # step below which a sign change that cannot be polished is taken as it is


@dataclass(slots=True, eq=False)
class Found:
    """A special point on the way; ``s`` and the bracket in the direction of travel, ``bound`` what gives its error as a float,
    ``own`` the part of it that others nearby do not share, and ``reach`` the arclength to which the place of a flat test is known,
    where that is more than the bracket."""

    kind: SpecialPointKind
    name: str
    x: np.ndarray
    tangent: np.ndarray
    s: float
    low: float
    high: float
    bound: SupportsFloat
    part: Any
    status: LocationStatus = LocationStatus.LOCATED
    reverses: bool = False
    after: str = ""
    directions: np.ndarray | None = None
    successor: Any = None
    corrected: Any = None
    recorded: dict | None = None
    reach: Any = 0.0
    own: SupportsFloat | None = None

    @property
    def error(self) -> float:
        """Bound on the error of the parameter, own units."""
        return float(self.bound)

    @property
    def apart(self) -> float:
        """Error of the parameter that special points nearby do not share, own units."""
        return float(self.bound if self.own is None else self.own)

    @property
    def known(self) -> float:
        """Arclength to which the place is known, where that is more than the bracket."""
        return float(self.reach)

    def as_row(self, row):
        """The point as a row behind ``row``."""
        return Row(self.corrected, row.part, self.s, 0.0, tests_of(self.corrected), row.ds)

    def as_point(self):
        """The point as ``record=`` sees rows."""
        c = self.corrected
        if c is None:
            values = self.part.problem.monitor_values(self.x[:-1], float(self.x[-1]), self.tangent)
            c = Corrected(self.x, self.tangent, True, CorrectorStatus.CONVERGED, 0, 0.0, 0.0, 0.0, 0.0, 0.0,
                          np.asarray(values, float))
        return Point(Row(c, self.part, self.s, 0.0, tests_of(c), 0.0))


@dataclass(slots=True)
class Cut:
    """A step that ends on a boundary: its last row, the corrected point, the test that is zero, the special point; of the rows just
    inside what is known by test, and the points looked up for them by place, see `inside.ending`."""

    row: Row
    corrected: Any
    test: int
    special: Found
    inside: dict = field(default_factory=dict)
    looked: dict = field(default_factory=dict)

    @property
    def silent(self) -> bool:
        """Whether it is a boundary of the equations only."""
        return self.row.part.problem.silent(self.row.part.monitors[self.test - 1], self.corrected.x)


def clear_slope(v):
    """Whether dp/ds is clearly not zero."""
    return abs(v) > BOUNDARY_BAND


def remember(half, row, before, fresh=False):
    """Update the last clear sign and the largest value of every test."""
    signs, sizes, born = half.signs, half.sizes, row.part.born
    for j, value in enumerate(row.tests):
        size = abs(value)
        if size > sizes[j] and size != math.inf:
            sizes[j] = size
        if j == 0:
            if size <= (BOUNDARY_BAND if fresh or not before else SLOPE_BAND):
                continue
        elif size <= MONITOR_BAND * (1.0 if fresh else sizes[j]) or (fresh and j == born) or value != value:
            continue
        signs[j] = 1 if value > 0.0 else -1


def zero_band(half, new, j):
    """Return the value at which the boundary test ``j`` counts as zero in the step to ``new``.

    A test that was never more than what an orbit may touch is zero by itself, as of a slider that stands at its limit where nothing
    moves it: the sign of its rounding tells nothing.
    """
    touch = half.rows[-1].part.touch
    if half.sizes[j] <= touch < np.inf:
        return touch
    return min(max(rounding(half, j), MONITOR_BAND * abs(new.tests[j])), touch)


def boundary(half, row, new):
    """Return ``(cut, None)`` where a boundary is crossed, ``(None, None)`` if none is, ``(None, cause)`` to reject."""
    part = row.part
    if not part.boundary:
        return None, None
    if part.born > 0 and begins(half):
        part.born = born_on(row, new, row.s - half.rows[-2].s if len(half.rows) > 1 else 0.0)
    cut = None
    for _ in range(2 * len(part.boundary)):  # the earliest of several: locate one, look at the others before it
        end = new if cut is None else cut.row
        for j in part.boundary:
            if end.tests[j] > zero_band(half, new, j) and (cut is None or j != cut.test):
                break
        else:
            if cut is not None and (cut.row.singular or nearly_singular(half.rows, row, cut.row.det_log, cut.row.s - row.s)):
                cut.special.reach = max(cut.special.known, resolved_from(row, cut.row))
            return cut, None
        a = beginning(half, row, new, j)
        if half.signs[j] >= 0:
            if row.tests[j] > 0.0 and half.signs[j] > 0:
                return None, (StopReason.INADMISSIBLE, 0.5, "the branch does not enter the region of validity")
            return None, (StopReason.NO_SUCCESSOR, 0.5, "the equations behind the boundary are valid on neither side")
        found = zero_between(part, a if a.tests[j] < 0.0 and a.s < end.s else row, end, j)
        if found is None:
            return None, (StopReason.DS_MIN, 0.5, f"the boundary {part.monitors[j - 1].kind!s} could not be located")
        c = found.corrected
        if c.det_sign * row.det_sign < 0.0 and new.det_sign * row.det_sign < 0.0 and found.s - row.s > SHORT:
            return None, (StopReason.DS_MIN, 0.5, "the branch jumps in every step")
        s = max(found.s, row.s)  # of a row on the boundary itself, rounding may have it behind the row
        cut = Cut(Row(c, part, s, new.angle * (s - row.s) / (new.s - row.s), tests_of(c), half.ds), c, j, found)
    return cut, None


def resolved_from(row, edge) -> float:
    """Return the arclength before a boundary, on which the row ``edge`` lies, from which on solutions are resolved on the way
    from ``row``: where equations lose several ranks rounding moves those next to it more than they differ."""
    curve = Curve(row, edge)
    for length in RESOLVED:
        if length > 0.5 * curve.length:
            return 0.5 * curve.length
        c = curve.at(1.0 - length / curve.length)
        if c is not None and row.part.problem.blur(c) <= BLURRED * length:
            return length
    return RESOLVED[-1]


def blurred(rows) -> float:
    """Return the arclength from the last of ``rows``, next to a boundary, back to which they are not resolved."""
    edge = rows[-1]
    known, noise = min(edge.part.problem.blur(edge), RESOLVED[-1]), EQUAL * (abs(edge.p) + float(edge.part.scale[-1]))
    for row in rows[-2::-1]:
        length = edge.s - row.s
        alike = length <= SHORT and abs(row.p - edge.p) <= noise
        if row.part is not edge.part or not alike and row.part.problem.blur(row) <= BLURRED * length:
            break
        known = max(known, length)
    return known


def creeping(half, row):
    """Return the cut at a last row beside a boundary that no step reaches, or None where no boundary is near."""
    part = row.part
    near = [(abs(row.tests[j]) / max(half.sizes[j], 1e-300), j) for j in part.boundary if abs(row.tests[j]) < CREEPING]
    if not near or len(half.rows) < 2:
        return None
    j = min(near)[1]
    c = Corrected(row.x, row.tangent, True, CorrectorStatus.CONVERGED, row.iterations, row.residual, 0.0, 0.0, row.det_sign,
                  row.det_log, np.array(row.tests[1:]))
    special = Found(*named(part, j, row.x), row.x, row.tangent, row.s, row.s - AT_BOUNDARY, row.s + AT_BOUNDARY,
                    1e-15 * (abs(row.p) + float(part.scale[-1])), part, corrected=c, reach=blurred(half.rows))
    return Cut(row, c, j, special)


def behind(half, row):
    """Take in the special point a little behind the last row, which steps approach but never reach, if the problem knows one."""
    try:
        end = row.part.problem.end_point(row.x, half.reason)
    except row.part.problem.errors:
        return
    if end is None or not half.options.low <= end.x[-1] <= half.options.high:
        return
    part, tangent, length = row.part, row.tangent, abs(float(end.x[-1]) - row.p) / row.part.scale[-1]
    if end.problem is None:
        length = float(np.linalg.norm((end.x - row.x) / part.scale))
    else:
        part = Part(end.problem, part.index + 1)
        half.parts.append(part)
        tangent = np.zeros(end.x.size)
        tangent[-1] = math.copysign(1.0, end.x[-1] - row.p)
    half.found.append(Found(end.kind, end.name, end.x, tangent, row.s + length, row.s, row.s + 2.0 * length, end.error, part))


def crossed(half, row, new, cut):
    """Return ``(special points in the step, None)`` or ``(None, cause)`` to reject it; ``cut`` is that of a step that ends on a
    boundary, or None."""
    part, at_boundary = row.part, cut is not None
    if jumped(half, row, new, at_boundary):
        return None, (StopReason.DS_MIN, 0.5, "the branch jumps in every step")
    found = []
    crossing = None
    first = begins(half)

    def at_end(s):
        return at_boundary and beside_edge(new, row, cut.test, s, known_to(cut.special))

    def at_start(s):
        return first and (beside_edge(row, new, part.born, s, half.edge or AT_BOUNDARY) if part.born > 0
                           else abs(s - row.s) < AT_BOUNDARY)
    if row.det_sign * new.det_sign < 0.0 or new.singular or (
            nearly_singular(half.rows, row, new.det_log, new.s - row.s) and not row.singular):
        crossing, cause = branch_point(row, new)
        if cause is not None:
            return None, cause
        if crossing is not None and (at_end(crossing.s) or at_start(crossing.s)):
            crossing = None  # an interval of no duration makes the equations singular on the boundary itself
        if crossing is not None:
            found.append(crossing)
            v0, v1 = row.tests[0], new.tests[0]
            crossing.reverses = v0 * v1 < 0.0 and abs(crossing.tangent[-1]) < 1e-5
    for j in part.events:
        a = beginning(half, row, new, j)
        b = ending(half, row, cut, j) if at_boundary else new
        if b is None:
            half.slope = float(half.signs[0])
            continue
        value, sign = b.tests[j], half.signs[j]
        if value != value:
            continue
        if j == 0 and at_boundary:
            half.slope = value if clear_slope(value) else float(sign)  # just before the boundary
        band = MONITOR_BAND * max(half.sizes[j], abs(value)) if j else (BOUNDARY_BAND if at_boundary else SLOPE_BAND)
        if not crosses(value, sign, band):
            continue
        if j == 0 and crossing is not None and crossing.reverses:
            continue
        if j and sign < 0 and part.monitors[j - 1].falling:
            continue
        if j and part.problem.differenced and flat(half, b, j, a.tests[j], value):
            continue
        if not a.tests[j] * sign > 0.0:
            a, b = earlier_pair(half, row, new, j, sign)
        if a.tests[j] != a.tests[j] or b.tests[j] != b.tests[j]:
            continue  # not known on this side: nothing can be enclosed
        special = zero_between(part, a, b, j)
        if special is None:
            if part.kinds[j] is SpecialPointKind.NEIMARK_SACKER and passes(part, a, b, found) is False:
                continue  # of real multipliers, one of which may be as small as the rounding of the largest
            if new.s - row.s > SHORT:
                return None, (StopReason.DS_MIN, 0.5, f"a {part.kinds[j]!s} could not be located")
            special = guessed(part, a, b, j)
        if j and not part.problem.confirm(part.kinds[j], special.x):
            continue
        # the parameter stands still where an event is born: whether it turns, both sides tell
        if j == 0 and (at_end(special.s) or at_boundary and one_with(special, new, cut.special.apart)):
            half.slope = float(sign)
            continue
        if j == 0 and part.born > 0 and (at_start(special.s) or first and one_with(special, row, told_apart(half, row))):
            half.signs[0] = 0
            continue
        if j == 0:
            special.reverses = True
        elif special.kind is not part.kinds[j] and not part.problem.confirm(special.kind, special.x):
            continue
        if not any(other.kind is special.kind and other.name == special.name and abs(other.s - special.s) < 1e-9
                   for other in half.found):
            found.append(special)
    if SpecialPointKind.NEIMARK_SACKER in part.kinds:
        found += torus(half, row, new, cut, found)
    found.sort(key=lambda special: special.s)
    return found, None


def flat(half, row, j, *values) -> bool:
    """Whether ``values`` of test ``j`` are no larger than its noise at a row, as of one that is zero all along a curve: from then
    on values of that size have no sign.

    Tests that are made of differences have more noise than the part of their largest value that is the rounding of others.
    """
    made = [tested(row, j, -place * ASIDE_NOISE) for place in NOISE_AT]
    if None in made:
        return False
    noise = SAFETY * off_line((0.0, *NOISE_AT), [row.tests[j], *made])
    if max(map(abs, values)) > noise:
        return False
    half.sizes[j], half.signs[j] = max(half.sizes[j], noise / MONITOR_BAND), 0
    return True


def tested(row, j, length):
    """Return the value of test ``j`` at an arclength behind a row; None where there is none."""
    try:
        c = row.part.problem.correct(row.x + length * row.direction, row.tangent)
    except row.part.problem.errors:
        return None
    return tests_of(c)[j] if c.converged else None


def one_with(special, edge, apart) -> bool:
    """Whether a fold is next to a row ``edge`` on a boundary, and its parameter that of the boundary, but for the errors that the
    two do not share: ``apart`` that of the boundary."""
    return abs(special.s - edge.s) <= SHORT and abs(float(special.x[-1]) - edge.p) <= special.apart + apart


def told_apart(half, row) -> float:
    """Return by how much the parameter of a first ``row`` on a boundary differs from the one that the equations before it tell."""
    return 0.0 if half.pending is None else abs(row.p - float(half.pending[1].x[-1]))


def beside_edge(edge, inner, j, s, known) -> bool:
    """Whether a place ``s`` is that of the boundary on which the row ``edge`` lies, ``known`` to an arclength: between it and the
    zero of the test ``j``, of which the row may have a little more or less."""
    a, b = inner.tests[j], edge.tests[j]
    zero = inner.s + (edge.s - inner.s) * a / (a - b) if abs(b) < NEAR_EDGE * abs(a) else edge.s
    return min(zero, edge.s) - known < s < max(zero, edge.s) + known


def torus(half, row, new, cut, found):
    """Return the Neimark-Sacker points of a step in a list that multipliers tell and no test showed.

    A pair that leaves the circle and comes back in one step is seen where it is looked for: between the ends and what has been
    found, the changes of real multipliers, beside which it often does, or one of the two.  There the number of multipliers outside
    changes by pairs alone; over a real one that goes the other way a pair would look like a single one.
    """
    part, kind = row.part, SpecialPointKind.NEIMARK_SACKER
    j = part.kinds.index(kind)
    a, b = beginning(half, row, new, j), new if cut is None else ending(half, row, cut, j)
    if b is None:
        return []
    known = [special for special in found if special.kind is kind]
    curve = Curve(a, b)
    points = {t: s for s in found if s.kind in (*REAL, kind) and 0.0 < (t := (s.s - a.s) / curve.length) < 1.0}
    places = [0.0, *sorted(points), 1.0]

    def at(c, t):
        return Row(c, part, a.s + t * curve.length, new.angle * t, tests_of(c), new.ds)

    def beside(t, other):
        """Return a row next to a special point at ``t``, on the side of ``other``, so near that nothing passes the circle between
        the two; the end of the step itself."""
        if t in (0.0, 1.0):
            return a if t == 0.0 else b
        for part_of_way in BESIDE:
            aside = t + part_of_way * (other - t)
            c = curve.at(aside)
            if c is None or t not in points or next_to(part.problem, points[t], c.x):
                break
        return None if c is None else at(c, aside)

    tori, spans = [], [(beside(low, high), beside(high, low)) for low, high in pairwise(places)]
    for _ in range(SPANS):
        if not spans:
            break
        low, high = spans.pop(0)
        if low is None or high is None or not high.s > low.s:
            continue
        made = pair_on_circle(part, low, high, found)
        if made is None:
            inner = inner_change(part, low, high)
            if inner is not None:
                middle = at(inner[0], (low.s + inner[1] * (high.s - low.s) - a.s) / curve.length)
                spans += [(low, middle), (middle, high)]
            continue
        special = located(part, low, high, j, *made)
        if special is not None and all(np.abs((other.x - special.x) / part.scale).max() > SHORT for other in (*known, *tori)):
            tori.append(special)
            t, start, stop = ((s - a.s) / curve.length for s in (special.s, low.s, high.s))
            spans += [(low, beside(t, start)), (beside(t, stop), high)]  # several pairs
    return tori


def earlier_pair(half, row, new, j, sign):
    """The adjacent rows between which a test left its old sign, where the last row is at rounding level."""
    after = row
    for before in reversed(half.rows[:-1]):
        if before.part is not row.part:
            break
        if before.tests[j] * sign > 0.0:
            return before, after
        after = before
    return row, new


def zero_between(part, a, b, j):
    """Locate the zero of test ``j`` between two rows; None if that fails."""
    curve = Curve(a, b)
    fa, fb = a.tests[j], b.tests[j]
    c = part.problem.locate(part.kinds[j], a, b)
    if c is not None:  # where the equations are singular: nothing is gained by probing the curve there
        t, _ = curve.nearest(c.x)
        noise = 4e-16 * (1.0 + abs(float(c.x[-1])) / part.scale[-1])
        root = Root(t, c, t - PROBE, t + PROBE, 1e-13, 1.0, noise * part.scale[-1], 0.0, True)
        return located(part, a, b, j, curve, root)
    guess = None
    if j == 0 and curve.length > 0.0:  # the parameter is known with its slope: root of the derivative of its cubic
        mean = (b.p - a.p) / (float(part.scale[-1]) * curve.length)
        c2, c1 = 3.0 * (fa + fb) - 6.0 * mean, 6.0 * mean - 4.0 * fa - 2.0 * fb
        root = c1 * c1 - 4.0 * c2 * fa
        if root > 0.0:
            q = -0.5 * (c1 + math.copysign(math.sqrt(root), c1))
            for t in (q / c2 if c2 else -1.0, fa / q if q else -1.0):
                if 0.0 < t < 1.0:
                    guess = t
    value = curve.test(j)
    found = part.problem.zero(curve, j, (fa, fb), guess)
    if found is None:
        made = enclose(value, 0.0, fa, 1.0, fb, guess)
        root = None if made is None else polish(value, *made)
    else:
        root = found[0]
    if root is None and j in part.boundary and fa * fb < 0.0:
        root = bracketed(value, 0.0, fa, 1.0, fb, curve.length < ENCLOSED)
    elif root is not None and j in part.boundary and tests_of(root.point)[j] > part.touch and leaps(root, fa, fb):
        root = at_leap(value, root, part.touch) or root  # what a touch of its boundary is not is no zero
    return located(part, a, b, j, curve, root)


def leaps(root, fa, fb) -> bool:
    """Whether most of the way of a test from ``fa`` to ``fb`` lies in what is left of its bracket round a root."""
    return not root.settled and abs(root.slope) * (root.high - root.low) > 0.5 * (abs(fa) + abs(fb))


def at_leap(value, root, touch):
    """Return the `Root` where a test leaps to zero or from it, as the largest value of a guard does that begins to have one inside
    of an interval; None where it leaps over zero, by more than a ``touch``.

    Behind the leap the test may be zero with some power of the way, and its sign there rounding: which side a place is on the size
    of the leap tells.  The point is that of the side on which the test is zero: there what begins is seen.
    """
    ends = value(root.low), value(root.high)
    if None in ends:
        return None
    (below, _), (above, _) = ends
    middle = 0.5 * (below + above)

    def side(t):
        made = value(t)
        return None if made is None else (made[0] - middle, made[1])
    made = bracketed(side, root.low, below - middle, root.high, above - middle, narrow=NARROW)
    beside = [] if made is None else [(t, value(t)) for t in (made.low, made.high)]
    if not beside or None in [found for _, found in beside]:
        return None
    at, (least, point) = min(beside, key=lambda item: abs(item[1][0]))
    return replace(made, at=at, point=point) if abs(least) <= touch else None


def located(part, a, b, j, curve, root):
    """Turn a root on a curve into a special point with its error."""
    if root is None:
        return None
    c = root.point
    s = a.s + root.at * curve.length
    return Found(*named(part, j, c.x), c.x, c.tangent, s, a.s + root.low * curve.length,
                 a.s + root.high * curve.length, Later(partial(parameter_error, part, c, root, j, curve)), part, corrected=c,
                 reach=Later(lambda: curve.length * flat_to(part, c, root, j, curve)),
                 own=Later(partial(sampled_error, part, c, root, j, curve)))


def named(part, j, x):
    """Return kind and name of what lies where test ``j`` is zero, at ``x`` (n + 1,): what a boundary is, the problem says."""
    if j == 0:
        return part.kinds[0], ""
    monitor = part.monitors[j - 1]
    return SpecialPointKind(part.problem.kind_at(monitor, x)), monitor.name


def parameter_error(part, c, root, j, curve=None):
    """Bound on the error of the parameter at a root of test ``j`` on a curve, or on the tangent of a row, own units: what is seen
    there, and what probes as close as those of the root do not see, because they may all be off by the same."""
    length = 1.0 if curve is None else curve.length
    shared = part.problem.uncertainty(c.x, c.tangent) + number_error(part, c, root, j, length)
    return sampled_error(part, c, root, j, curve) + shared


def sampled_error(part, c, root, j, curve=None):
    """Bound on the part of `parameter_error` that special points nearby do not share.

    Probes as close as those of the root show a bend of the parameter that is nothing but noise where points are badly determined;
    along a step it is not larger than that of its cubic.
    """
    p_scale = float(part.scale[-1])
    place = place_error(part, c, root, j, curve)
    along = p_scale * abs(float(c.tangent[-1])) * (1.0 if curve is None else curve.length) * place
    bend = root.p_curve if curve is None else min(root.p_curve, curve.parameter_bend())
    return along + 0.5 * bend * place**2 + root.p_noise + 1e-15 * (abs(float(c.x[-1])) + p_scale)


def error_behind(special, bound, first, along) -> float:
    """Bound on the error of the parameter of a boundary, own units: its own ``bound``, and what the equations behind it tell, which
    begin there, a length ``along`` before their row ``first``.

    Equations may be singular on their boundary, as where several events end at once, and those behind it not: what is known
    better counts.  Two that contradict each other are off by as much; they do not where the test behind, which may be flat there,
    is zero to rounding at the parameter of the boundary, too.
    """
    part, own = first.part, float(bound)
    if part.problem.free > special.part.problem.free:  # one of many motions: each has its own place
        return own
    try:
        beyond = row_ahead(first) if part.boundary else None
        if beyond is None:
            return own
        curve, born = Curve(first, beyond), born_on(first, beyond, along)
        root = polish(curve.test(born), 0.0, first.tests[born], None)
        if root is None:
            return own
        behind = parameter_error(part, root.point, root, born, curve)
    except part.problem.errors:
        return own
    apart = abs(float(root.point.x[-1] - special.x[-1]))
    known = min(own, apart + behind) if apart <= own + behind or zero_there(special, part, root, born, curve) else apart + behind
    # what neither side lists, as the last impacts of a complete chattering, both may not see
    return max(known, *(problem.uncertainty(c.x, c.tangent) for problem, c in (
        (special.part.problem, special.corrected), (part.problem, root.point))))


def begins(half) -> bool:
    """Whether the last row is the first of its equations."""
    return len(half.rows) < 2 or half.rows[-2].part is not half.rows[-1].part


def born_on(first, ahead, along) -> int:
    """Return the boundary test that is zero where equations begin, a length ``along`` before their row ``first``.

    Of several that are zero there one that is zero by itself, at a row ``ahead`` as well, tells nothing.
    """
    part = first.part
    order = sorted(part.boundary, key=lambda j: abs(first.tests[j]))
    if part.touch < math.inf:
        for j in order:
            if not along and abs(first.tests[j]) > part.touch:
                break
            if max(abs(first.tests[j]), abs(ahead.tests[j])) > ROUNDED:
                return j
    return order[0]


def zero_there(special, part, root, born, curve) -> bool:
    """Whether the test ``born`` behind a boundary is zero to its rounding at the boundary's parameter, as at its own ``root``."""
    rate = float(part.scale[-1] * root.point.tangent[-1]) * curve.length
    if not abs(rate) > 0.0:
        return False
    made = curve.test(born)(root.at + float(special.x[-1] - root.point.x[-1]) / rate)
    return made is not None and abs(made[0]) <= part.problem.test_uncertainty(made[1])


def row_ahead(first):
    """Return a row a little ahead of the first one of its equations at which they are valid, however short that is; None without
    one."""
    part = first.part
    for length in AHEAD:
        c = part.problem.correct(first.x + length * first.direction, first.tangent)
        if c.converged and all(c.monitors[j - 1] <= part.touch for j in part.boundary):
            return Row(c, part, first.s + length, 0.0, tests_of(c), first.ds)
    return None


def place_error(part, c, root, j, curve=None) -> float:
    """Return the error of the place of a root of test ``j``, as part of the step: that of the search, and the rounding of the test
    over its slope, or to where a flat one is not clear."""
    return flat_to(part, c, root, j, curve) or root.error + rounding_error(part, c, root, j, curve)


def rounding_error(part, c, root, j, curve=None) -> float:
    """Return the part of the step by which the rounding that neighbours share moves the root of test ``j``.

    Numbers of the user have units of their own: what is rounded is the solution.  Products over all multipliers, as of a chain of
    masses, have any size: what is rounded is the multiplier that passes, and its slope counts.
    """
    problem, length = part.problem, 1.0 if curve is None else curve.length
    rounded, of_problem = problem.test_uncertainty(c), len(bare(problem).monitors)
    if not 0 < j <= of_problem or j in part.boundary or part.kinds[j] not in STABILITY or not rounded:
        return rounded / (length if j > of_problem else abs(root.slope))
    far, tests = min(ASIDE_STEP, NEAR_EDGE * length), []
    for sign in (-1.0, 1.0):
        beside = problem.correct(c.x + sign * far * problem.scale * c.tangent, c.tangent)
        mu = on_circle(problem, part.kinds[j], beside.x) if beside.converged else None
        if mu is None:
            return root.error
        tests.append(mu)
    (below, _), (above, size) = tests
    return rounded * (1.0 + size) * 2.0 * far / (max(abs(above - below), rounded) * length)


def flat_to(part, c, root, j, curve=None) -> float:
    """Return the part of the step at which a test that is zero with some power of the way, and hardly has a slope at its root, is
    clearly not zero, and more than its slope says: on both sides where it is known on both; 0 of others.

    The rounding of a flat test differs from point to point; that of others is shared by neighbours (`Problem.test_uncertainty`),
    whose distances from the root are known better than its place: a test that is as large as its slope says on both sides, at two
    lengths, is none of the flat ones, however small.  Farther on it may jump.
    """
    slope = abs(root.slope)
    rounded = slope * rounding_error(part, c, root, j, curve)
    known = root.error + rounded / slope

    def beside(aside):
        """Return the values on the two sides, with the sign of the side, of those that lie on the curve."""
        made = [(sign, curve.test(j)(root.at + sign * aside)) for sign in (1.0, -1.0)]
        return [sign * one[0] for sign, one in made if one is not None and one[1].distance <= ASTRAY * aside * curve.length]

    def straight(aside):
        values = [value / (root.slope * aside) for value in beside(aside)]
        return len(values) == 2 and 1.0 / AS_SAID < min(values) and max(values) < AS_SAID

    if curve is None or FLAT[0] / curve.length >= known:
        return 0.0
    if any(straight(near) and straight(far) for near, far in pairwise(STRAIGHT)):
        return 0.0
    for aside in (length / curve.length for length in FLAT):
        if aside >= known:
            break
        values = beside(aside)
        if values and min(map(abs, values)) > CLEARLY * max(rounded, slope * aside):
            return aside
    return 0.0


def number_error(part, c, root, j, length):
    """Return what the rounding of the system's numbers, and of the flow that is made of them, does to the parameter at a root of
    test ``j``: an error which neighbouring points share, so that probes do not show it.

    The place of the root answers in proportion to small changes of the numbers.  Some tests jump behind their zero, or are not
    known there: where it moves far the opposite change is asked too, and the lesser way is that in proportion.  Where neither is
    known, nor is the error; a change with which no solution is found so near tells nothing.
    """
    size, pairs = part.problem.shaken()
    found = 0.0
    for pair in pairs:
        answers = []
        for make in pair:
            made = make().correct(c.x, c.tangent)
            if not made.converged:
                continue
            late = (tests_of(made)[j] - tests_of(c)[j]) / root.slope
            moved = float(made.x[-1] - c.x[-1]) - late * length * float(part.scale[-1] * c.tangent[-1])
            answers.append((abs(late), abs(moved)) if abs(late) < math.inf else (math.inf, math.inf))
            if abs(late) < LATE:
                break
        found = max(found, min(answers, default=(0.0, 0.0))[1])
    return FLOW / size * found


def guessed(part, a, b, j):
    """A special point that is only enclosed."""
    t = abs(a.tests[j]) / (abs(a.tests[j]) + abs(b.tests[j]))
    curve = Curve(a, b)
    error = abs(b.p - a.p) + part.scale[-1] * curve.length**2
    return Found(*named(part, j, curve.place(t)), curve.place(t), curve.tangent(t),
                 a.s + t * curve.length, a.s, b.s, error, part, LocationStatus.GUESS)


def branch_point(row, new):
    """Return ``(special point or None, None)`` or ``(None, cause)`` where the determinant changes sign without one."""
    part = row.part
    curve = Curve(row, new)
    flips = row.det_sign * new.det_sign < 0.0
    jump = (StopReason.DS_MIN, 0.5, "the determinant changes its sign without a branch point in every step")
    if flips:
        top = max(row.det_log, new.det_log)
        da, db = math.exp(row.det_log - top), math.exp(new.det_log - top)
        crossing = locate_crossing(part.problem, curve.place(da / (da + db)))
    else:
        crossing = locate_crossing(part.problem, new.x)
    if crossing.status == "located":
        t, distance = curve.nearest(crossing.x)
        d = crossing.directions
        along = d @ curve.tangent(min(max(t, 0.0), 1.0))
        k = int(np.argmax(np.abs(along)))
        direction = d[k] if along[k] > 0.0 else -d[k]
        aside = distance > 0.05 * curve.length + 1e-7
        if not aside and -0.02 <= t <= 1.02 and abs(along[k]) > 0.93:
            if not flips and abs(t - 1.0) * curve.length > 1e-6:
                return None, None
            t = min(max(t, 0.0), 1.0)
            if abs(t - 1.0) * curve.length < 1e-6 and new.singular:
                new.x[:-1] = crossing.x[:-1]  # more digits than Newton at a singular point can give
            error = float(part.scale[-1]) * crossing.error
            width = max(crossing.error, 1e-15)
            s = row.s + t * curve.length
            return Found(SpecialPointKind.BRANCH_POINT, "", crossing.x, direction, s, s - width, s + width, error,
                         part, directions=d), None
        return (None, jump) if flips else (None, None)
    if not flips:
        return None, None
    if crossing.status == "failed" and curve.length < SHORT and new.angle < 1e-3:
        t = 0.5
        s = row.s + t * curve.length
        return Found(SpecialPointKind.BRANCH_POINT, "", curve.place(t), curve.tangent(t), s, row.s, new.s,
                     abs(new.p - row.p) + part.scale[-1] * curve.length**2, part, LocationStatus.GUESS), None
    return None, jump


def at_end(half, row):
    """Special points exactly at a first or last row, not yet found from the inside."""
    part = row.part
    found = []
    for j in part.events:
        value = row.tests[j]
        if not abs(value) <= (BOUNDARY_BAND if j == 0 else 1e-8 * max(half.sizes[j], size_beside(half, row, j), 1e-300)):
            continue
        if any(other.kind is part.kinds[j] and abs(other.s - row.s) < 1e-5 for other in half.found):
            continue

        def test(s, j=j):
            try:
                c = part.problem.correct(row.x + s * row.direction, row.tangent)
            except part.problem.errors:
                return None
            return (tests_of(c)[j], c) if c.converged else None

        if j and part.problem.differenced and flat(half, row, j, value, tested(row, j, ASIDE_STEP) or 0.0):
            continue
        root = polish(test, 0.0, 0.0, None)
        if root is None:
            continue
        c = root.point
        error = parameter_error(part, c, root, j)
        if abs(float(c.x[-1]) - row.p) <= 1e-12 * part.scale[-1] + error:
            found.append(Found(*named(part, j, c.x), c.x, c.tangent, row.s,
                               row.s + min(root.low, 0.0), row.s + max(root.high, 0.0), error, part,
                               reverses=j == 0, corrected=c))
    return found


def size_beside(half, row, j):
    """Size of test ``j`` as its slope at a first row says, whose own value may be a zero; 0 where there are other rows."""
    if len(half.rows) > 1 or half.sizes[j] > abs(row.tests[j]) or abs(row.tests[j]) > ASIDE_VALUE:
        return 0.0
    aside = tested(row, j, ASIDE_STEP)
    return 0.0 if aside is None else abs(aside - row.tests[j]) / ASIDE_STEP
