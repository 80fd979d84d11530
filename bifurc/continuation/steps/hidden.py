"""What the ends of a step do not show: two zeros of one test in it, and a jump to another branch.

One file, because every search in it looks at the same step, beside the same boundaries at its ends.
"""
import math
from dataclasses import dataclass

from ...solve import steplaw
from ...solve.steplaw import ASIDE, AT_END, JUMPS, MONITOR_BAND, NEARLY_SINGULAR, SLOPE_BAND, UNCLEAR
from ..kinds import SpecialPointKind
from .inside import WIDE, beginning, ending, known_to
from .rows import Curve, Row, tests_of

FORETOLD = 0.25  # part of a value by which an interpolated one may be wrong
BEFORE_END = (0.9, 0.99, 0.999)  # of a step on whose end several boundaries are zero, where they are looked up
STATES = 1e-3  # of the test of a boundary, which is scaled: the least size of the states that it is made of
APART, LOOKS = 1e-4, 6  # part of a span within which two places are one; most that are looked at within a step
doubtful, two_folds, two_zeros = (rule.py_func for rule in (steplaw.doubtful, steplaw.two_folds, steplaw.two_zeros))


@dataclass(frozen=True)
class Edge:
    """The boundary at an end of a step: its row, the test that is zero there, and the arclength to which its place is known."""

    row: Row
    test: int
    known: float

    def holds(self, half, c):
        """Whether a corrected point of the step is that place, to rounding: while its own test is zero, others tell nothing."""
        away = abs(float(c.x[-1]) - self.row.p) / float(self.row.part.scale[-1])
        return away <= max(self.known, WIDE) and abs(float(c.monitors[self.test - 1])) <= self.noise(half)

    def noise(self, half) -> float:
        """Return the value of the test that tells nothing here: at the row, where it is zero, it has one too."""
        return max(rounding(half, self.test), min(2.0 * abs(self.row.tests[self.test]), self.row.part.touch))


def nearly_singular(rows, row, log, length):
    """Whether the logarithm of the determinant, ``log`` a ``length`` ahead of ``row``, has fallen to that of a singular point.

    That of a train of hundreds of impacts falls by as much from row to row without one: what the last step foretells
    is no such fall.  Towards a zero it foretells a small part of it.
    """
    fall = row.det_log - log
    if fall <= NEARLY_SINGULAR:
        return False
    if len(rows) < 2 or rows[-1] is not row or rows[-2].part is not row.part or not row.s > rows[-2].s:
        return True
    foretold = (rows[-2].det_log - row.det_log) * length / (row.s - rows[-2].s)
    return fall - max(foretold, 0.0) > NEARLY_SINGULAR


def growth(before, row, new):
    """Return at what rate the logarithm of the determinant grows over three rows alike, 0 where it has an extremum: a factor that
    has no zeros, and is not the parabola that zeros are looked for on."""
    first = (row.det_log - before.det_log) / (row.s - before.s) if row.s > before.s else 0.0
    second = (new.det_log - row.det_log) / (new.s - row.s)
    return sorted((first, second, 0.0))[1] if math.isfinite(first + second) else 0.0


def dip(half, row, new, cut=None):
    """Return a row between two zeros of one test in the step whose ends have the same sign; None if there is none, or if the step
    ends on a boundary by a ``cut`` and is no longer than the arclength to which that is known: then both of its ends are that
    place.

    Folds are looked for on the polynomial of the parameter, the others on the parabola through three rows, with the limits from
    inside on boundaries.  A minimum that touches zero to rounding is noted in ``half.unresolved``.  The row may lie before
    ``row``.
    """
    length, part = new.s - row.s, row.part
    ends = None if cut is None else Edge(new, cut.test, known_to(cut.special))
    if ends is not None and length <= ends.known:
        return None
    a = row.tests[0]
    t, sign = turning(half, row, new, cut)
    if t > 0.0:
        inner = between(half, row, new, 0, t, sign, ends=ends)
        if inner is not None:
            return inner
    inner = beyond(half, row, new)
    if inner is not None:
        return inner
    rows = half.rows
    if len(rows) < 2 or rows[-2].part is not part:
        return alone(half, row, new, cut) if cut is not None or new.p in (half.options.low, half.options.high) else None
    before = rows[-2]
    back = row.s - before.s
    falls = row.det_log < before.det_log or row.det_log < new.det_log
    rate = growth(before, row, new) if falls else 0.0
    for j in range(1, part.count + 1 if falls else part.count):
        end = limit(half, row, new, cut, j)
        if end is None:
            continue
        length = end.s - row.s
        if j < part.count:
            f0, a, b = before.tests[j], row.tests[j], end.tests[j]
            if max(abs(f0), abs(a), abs(b)) <= (rounding(half, j) if j in part.boundary else MONITOR_BAND * half.sizes[j]):
                continue  # as of impacts without restitution
        else:  # the determinant
            f0, a, b = (r.det_sign * math.exp(min(r.det_log - before.det_log - rate * (r.s - before.s), 50.0))
                        if r.det_sign else 0.0 for r in (before, row, new))
        t = two_zeros(f0, a, b, back, length)
        if t == 2.0:
            continue
        sign = 1.0 if a > 0.0 else -1.0
        told = None if j == part.count else sign * parabola(f0, a, b, back, length, t * (length if t > 0.0 else back))
        inner = (between(half, row, end, j, t, sign, rate, told, ends) if t > 0.0
                 else between(half, before, row, j, 1.0 + t, sign, rate, told))
        if inner is not None:  # between the last two rows: seen only now
            return inner
    return None


def limit(half, row, new, cut, j):
    """Return the row at whose end of a step test ``j`` is known: just inside a boundary, None where it is not; of boundaries
    themselves and of the determinant the last row itself."""
    return new if cut is None or j not in row.part.events else ending(half, row, cut, j)


def turning(half, row, new, cut):
    """Return the place in (0, 1) at which the parameter may turn twice in a step, -1 where it does not, and the sign of its slope.

    On a boundary the parameter may stand still, as where a contact is born: its slope is the part of the step from there times
    what may turn, whose value on the boundary a row just inside tells.
    """
    length = new.s - row.s
    a, b = row.tests[0], new.tests[0]
    mean = (new.p - row.p) / (float(row.part.scale[-1]) * length)
    first, last = beginning(half, row, new, 0), limit(half, row, new, cut, 0)
    if last is None:
        return -1.0, 0.0
    born, dies = grows(row, first), grows(new, last)
    a = first.tests[0] * length / (first.s - row.s) if born else first.tests[0]
    b = last.tests[0] * length / (new.s - last.s) if dies else last.tests[0]
    if born and dies:
        mean = 5.0 * mean + (a + b) / 12.0
    elif born or dies:
        mean = 2.0 * mean + (a - b if born else b - a) / 6.0
    return two_folds(a, b, mean), 1.0 if a > 0.0 else -1.0


def grows(at, inner):
    """Whether the slope of the parameter grows from zero between the boundary ``at`` and a row just ``inner``: the chord has half
    the slope there."""
    if inner is at:
        return False
    chord = (inner.p - at.p) / (float(at.part.scale[-1]) * (inner.s - at.s))
    return abs(chord) < 0.75 * abs(inner.tests[0])


def alone(half, row, new, cut):
    """Return a row as `dip` does in a step that is all of its part: its middle is the third row that a parabola needs."""
    part = row.part
    curve = Curve(row, new)
    c = curve.at(0.5)
    if c is None:
        return None
    middle = Row(c, part, row.s + 0.5 * curve.length, 0.5 * new.angle, tests_of(c), 0.5 * curve.length)
    for j in part.events[1:]:
        first, last = beginning(half, row, new, j), limit(half, row, new, cut, j)
        if last is None:
            continue
        f0, a, b = first.tests[j], middle.tests[j], last.tests[j]
        if f0 * b > 0.0 > a * b:
            return middle
        t = two_zeros(f0, a, b, middle.s - first.s, last.s - middle.s)
        if t == 2.0:
            continue
        inner = between(half, *((middle, last, j, t) if t > 0.0 else (first, middle, j, 1.0 + t)), 1.0 if a > 0.0 else -1.0)
        if inner is not None:
            return inner
    return None


def beyond(half, row, new):
    """Return a row of the step at which a boundary is passed though it is at neither end, where the problem knows of such a place
    (`Problem.leaves`); None if there is none."""
    part, spans = row.part, [(row, new)]
    ends = [j for j in part.boundary if abs(new.tests[j]) <= rounding(half, j)]
    for t in BEFORE_END if len(ends) > 1 and part.touch < math.inf else ():  # which is first is seen before all are zero
        c = Curve(row, new).at(t)
        if c is not None and any(float(c.monitors[j - 1]) > part.touch for j in ends):
            return Row(c, part, row.s + t * (new.s - row.s), new.angle * t, tests_of(c), (1.0 - t) * (new.s - row.s))
    looks = 0
    while spans and looks < LOOKS:
        a, b = spans.pop(0)
        t = part.problem.leaves(a, b)
        looks += t > 0.0
        c = Curve(a, b).at(t) if t > 0.0 else None
        if c is None:
            continue
        s = a.s + t * (b.s - a.s)
        middle = Row(c, part, s, new.angle * (s - row.s) / (new.s - row.s), tests_of(c), b.s - s)
        if any(middle.tests[j] > min(rounding(half, j), part.touch) for j in part.boundary):
            return middle
        spans += [(a, middle), (middle, b)]
    return None


def jumped(half, row, new, at_boundary):
    """Whether the two ends of the step lie on different branches that cross or nearly touch at a small angle.

    Such a jump shows little turn, little misfit and sometimes no change of sign of the determinant.  Where some misfit is seen or
    the determinant heads for zero, as it does ``at_boundary`` where an interval has no duration, the middle of the step is
    corrected: on a smooth arc it lies on the Hermite curve to the fourth order, between two branches it does not.
    """
    rows = half.rows
    if len(rows) < 2 or rows[-2].part is not row.part or row.singular:
        return False
    before = rows[-2]
    length, back = new.s - row.s, row.s - before.s
    a = math.exp(min(row.det_log - before.det_log, 50.0))
    b = math.exp(min(new.det_log - before.det_log, 50.0))
    told = doubtful(new.misfit, row.part.corner, a, b, back, length, row.det_sign * new.det_sign > 0.0)
    if told != UNCLEAR and not (told == JUMPS and at_boundary):
        return told == JUMPS
    curve = Curve(row, new)
    c = curve.at(0.5)
    if c is None:
        return row.det_sign * new.det_sign > 0.0  # a middle on a branch point has no tangent
    return c.distance > (ASIDE + 0.25 * row.part.corner) * length


def parabola(f0, a, b, back, length, at):
    """Return the value ``at`` a length behind the middle of three rows, ``back`` and ``length`` apart, whose values are ``f0``,
    ``a`` and ``b``."""
    first, second = (a - f0) / back, (b - a) / length
    bend = (second - first) / (back + length)
    return a + at * (first + bend * (at + back))


def between(half, row, new, j, t, sign, rate=0.0, told=None, ends=None):
    """Search the minimum of ``sign`` times a test in a step; return a row where it is negative, None if nowhere.  The determinant
    is looked at without its `growth` by ``rate``.

    Where the value at ``t`` is not the one that was ``told``, the parabola that says there is no zero is not believed either: the
    middles of the two parts are looked at first.  Places that are an end of the step on a boundary, to rounding, are none of its
    inside: beside the birth of a slip, where the equations are singular, there is a line of them, and what is zero there with the
    cube of the way is rounding long before.
    """
    part = row.part
    curve = Curve(row, new)
    if j < part.count:
        value = curve.test(j)
        outer = sign * row.tests[j], sign * new.tests[j]
    else:
        def value(t):
            c = curve.at(t)
            log = 0.0 if c is None else c.det_log - row.det_log - rate * t * curve.length
            return None if c is None else (c.det_sign * math.exp(min(log, 50.0)) if c.det_sign else 0.0, c)
        outer = 1.0, math.exp(min(new.det_log - row.det_log - rate * curve.length, 50.0))
    band = SLOPE_BAND if j == 0 else MONITOR_BAND * max(*outer, half.sizes[j] if j < part.count else 0.0)
    edges = first_edge(half, row), ends
    if j in part.boundary:
        band = max(band, rounding(half, j), *(edge.noise(half) for edge in edges if edge is not None and edge.test == j))
    zero = [on_boundary(half, end) and abs(v) <= band for end, v in zip((row, new), outer, strict=True)]
    low, high, least, aside = 0.0, 1.0, math.inf, []
    t = min(max(t, APART), 1.0 - APART)  # a least value at an end is looked for beside it: what the end has is known
    points = [(low, outer[0]), (high, outer[1])]

    def is_end(k, t, f, c):
        """Whether a place of the step is its end ``k`` on a boundary: equations say so, or the test is zero from there to it."""
        if edges[k] is not None and edges[k].holds(half, c):
            return True
        if not (zero[k] and abs(f) <= band):
            return False
        made = value(0.5 * (t + (low, high)[k]))
        return made is None or abs(made[0]) <= band

    for count in range(25):
        made = value(t)
        if made is None:
            return None
        f = sign * made[0]
        end = next((k for k in (0, 1) if is_end(k, t, f, made[1])), None)
        if end is None and f < -band:
            rest = (1.0 - t) * curve.length
            return Row(made[1], part, row.s + t * curve.length, new.angle * t, tests_of(made[1]), rest)
        if end is None:
            least = min(least, f)
            points = sorted([*points, (t, f)])
        else:
            low, high = (low, t) if end else (t, high)
            points = [(low, outer[0]), *(point for point in points if low < point[0] < high), (high, outer[1])]
            if len(points) == 2:
                t = 0.5 * (low + high)
                continue
        if count == 0 and told is not None and abs(f - told) > FORETOLD * abs(f):
            aside = [0.5 * t, 0.5 * (1.0 + t)]
        if aside:
            t = aside.pop(0)
            continue
        k = min(range(1, len(points) - 1), key=lambda i: points[i][1])
        (t0, f0), (t1, f1), (t2, f2) = points[k - 1:k + 2]
        d01, d12 = (f1 - f0) / (t1 - t0), (f2 - f1) / (t2 - t1)
        bend = (d12 - d01) / (t2 - t0)
        if bend <= 0.0:
            return None
        t = 0.5 * (t0 + t1) - 0.5 * d01 / bend
        lowest = f1 - bend * (t - t1)**2
        if lowest > 0.5 * f1 and f1 > 1e-9 * max(outer):
            t = cornered(points, k)
            if t is None:
                return None
        if min(abs(t - t0), abs(t - t1), abs(t - t2)) < APART * (t2 - t0):  # a golden step keeps the three points apart
            t = t1 + 0.1 * ((t2 - t1) if t2 - t1 > t1 - t0 else (t0 - t1))
        if not low < t < high:  # least at an end, as of a test that is zero where its equations begin
            return None
        if t2 - t0 < 1e-7:
            break
    if least <= 1e-9 * max(outer):
        kind = part.kinds[j] if j < part.count else SpecialPointKind.BRANCH_POINT
        s = row.s + t * curve.length
        known = any(other[0] == kind.value and abs(other[1] - s) < AT_END * curve.length for other in half.unresolved)
        at_end = any(at < max(AT_END, 0.0 if edge is None else edge.known / curve.length) and (edge or on_boundary(half, end))
                     for at, edge, end in ((t, edges[0], row), (1.0 - t, edges[1], new)))
        if not (known or at_end):  # where an event is born, other tests may begin at zero with the square of the way
            half.unresolved.append((kind.value, s, float(curve.place(t)[-1])))
    return None


def cornered(points, k):
    """Return the place beside the least of ``points`` (t, f), at index ``k``, where a corner would be negative; None where no
    corner is: the sharpest goes on with the slope behind the point, and comes back with that or the one seen beyond."""
    (t0, f0), (t1, f1), (t2, f2) = points[k - 1:k + 2]
    fall, rise = (f0 - f1) / (t1 - t0), (f2 - f1) / (t2 - t1)
    steep = max(fall, rise)
    after = max(steep, (points[k + 2][1] - f2) / (points[k + 2][0] - t2)) if k + 2 < len(points) else steep
    before = max(steep, (points[k - 2][1] - f0) / (t0 - points[k - 2][0])) if k > 1 else steep
    found = []
    if fall > 0.0:
        t = (fall * t1 + f1 + after * t2 - f2) / (fall + after)
        found.append((f1 - fall * (t - t1), t))
    if rise > 0.0:
        t = (rise * t1 - f1 + before * t0 + f0) / (rise + before)
        found.append((f1 - rise * (t1 - t), t))
    least, t = min(found, default=(0.0, t1))
    return t if least < 0.0 and t0 < t < t2 else None


def first_edge(half, row):
    """Return the `Edge` on which a row lies that is the first of its equations, or None."""
    part = row.part
    first = next((other for other in half.rows if other.part is part), None) is row
    return Edge(row, part.born, half.edge or 0.0) if first and part.born > 0 else None


def on_boundary(half, row) -> bool:
    """Whether a row lies on a boundary of its equations, to rounding."""
    return any(abs(row.tests[j]) <= rounding(half, j) for j in row.part.boundary)


def rounding(half, j) -> float:
    """Return the value of the test of a boundary that tells nothing: it is a difference of states, and not smaller where all of its
    values are."""
    return MONITOR_BAND * max(half.sizes[j], STATES)
