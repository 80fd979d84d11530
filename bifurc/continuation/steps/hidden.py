"""What the ends of a step do not show: two zeros of one test in it, and a jump to another branch."""
import math

from ..kinds import SpecialPointKind
from .rows import BOUNDARY_BAND, MONITOR_BAND, SLOPE_BAND, Curve, Row, tests_of

DIP = 0.15  # a fold test whose interpolated extremum falls below this part of its ends is looked at
SHALLOW = 0.9  # the same for tests that are interpolated through three rows, which is much less certain
DOUBT = 0.01  # misfit of a step that is looked at
DECAY = 0.5  # part to which the determinant falls in a step that is looked at
ASIDE = 2e-3  # distance of the middle of a step from its Hermite curve, as part of the step, that is a jump
LOOSE = 0.03  # part of the larger end value by which the interpolated extremum may be wrong
AT_END = 1e-3  # part of a step: a minimum so near an end of it that lies on a boundary of the equations is that end
REFLECTION = 0.2  # determinant with the wrong sign, as part of its linear extrapolation, that is taken for a jump


def dip(half, row, new):
    """Return a row between two zeros of one test in the step whose ends have the same sign; None if there is none.

    Folds are looked for on the cubic of the parameter, the others on the parabola through three rows.  A minimum that
    touches zero to rounding is noted in ``half.unresolved``.  The row may lie before ``row``.
    """
    length = new.s - row.s
    part = row.part
    if length <= 0.0:  # the row lies on the boundary that ends the step
        return None
    a, b = row.tests[0], new.tests[0]
    if a * b > 0.0 and min(abs(a), abs(b)) > BOUNDARY_BAND:
        sign = 1.0 if a > 0.0 else -1.0
        a, b = abs(a), abs(b)
        mean = sign * (new.p - row.p) / (part.scale[-1] * length)
        c2, c1 = 3.0 * (a + b) - 6.0 * mean, 6.0 * mean - 4.0 * a - 2.0 * b
        if c2 > 0.0 and 0.0 < -c1 < 2.0 * c2 and a - 0.25 * c1 * c1 / c2 < DIP * min(a, b) + LOOSE * max(a, b):
            inner = between(half, row, new, 0, -0.5 * c1 / c2, sign)
            if inner is not None:
                return inner
    rows = half.rows
    if len(rows) < 2 or rows[-2].part is not part:
        return None
    before = rows[-2]
    back = row.s - before.s
    falls = row.det_log < before.det_log or row.det_log < new.det_log
    for j in range(1, part.count + 1 if falls else part.count):
        if j < part.count:
            f0, a, b = before.tests[j], row.tests[j], new.tests[j]
        else:  # the determinant
            top = before.det_log
            f0, a, b = (r.det_sign * math.exp(min(r.det_log - top, 50.0)) if r.det_sign else 0.0
                        for r in (before, row, new))
        if not (a * b > 0.0 and f0 * a > 0.0 and (abs(a) < abs(f0) or abs(a) < abs(b))):
            continue
        sign = 1.0 if a > 0.0 else -1.0
        first, second = sign * (a - f0) / back, sign * (b - a) / length
        bend = (second - first) / (back + length)
        if bend <= 0.0:
            continue
        slope = first + bend * back  # at `row`
        least = abs(a) - 0.25 * slope * slope / bend
        if slope < 0.0 < slope + 2.0 * bend * length and least < SHALLOW * min(abs(a), abs(b)):
            inner = between(half, row, new, j, -0.5 * slope / (bend * length), sign)
            if inner is not None:
                return inner
        elif slope - 2.0 * bend * back < 0.0 <= slope and least < SHALLOW * min(abs(a), abs(f0)):
            inner = between(half, before, row, j, 1.0 - 0.5 * slope / (bend * back), sign)
            if inner is not None:  # between the last two rows: seen only now
                return inner
    return None


def jumped(half, row, new):
    """Whether the two ends of the step lie on different branches that cross or nearly touch at a small angle.

    Such a jump shows little turn, little misfit and sometimes no change of sign of the determinant.  Where some misfit
    is seen or the determinant heads for zero, the middle of the step is corrected: on a smooth arc it lies on the
    Hermite curve to the fourth order, between two branches it does not.
    """
    rows = half.rows
    if len(rows) < 2 or rows[-2].part is not row.part or row.singular:
        return False
    before = rows[-2]
    length, back = new.s - row.s, row.s - before.s
    a = math.exp(min(row.det_log - before.det_log, 50.0))
    b = math.exp(min(new.det_log - before.det_log, 50.0))
    heading = a - (1.0 - a) * length / back
    if abs(new.misfit) < DOUBT + 0.5 * row.part.corner and heading > DECAY * a and b > DECAY * a:
        return False
    if heading < 0.0 < row.det_sign * new.det_sign and b > REFLECTION * -heading:
        return True  # it was heading for zero and came back
    curve = Curve(row, new)
    c = curve.at(0.5)
    if c is None:
        return row.det_sign * new.det_sign > 0.0  # a middle on a branch point has no tangent
    return c.distance > (ASIDE + 0.25 * row.part.corner) * length


def between(half, row, new, j, t, sign):
    """Search the minimum of ``sign`` times a test in a step; return a row where it is negative, None if nowhere."""
    part = row.part
    curve = Curve(row, new)
    if j < part.count:
        value = curve.test(j)
        ends = sign * row.tests[j], sign * new.tests[j]
    else:
        def value(t):
            c = curve.at(t)
            return None if c is None else (c.det_sign * math.exp(c.det_log - row.det_log) if c.det_sign else 0.0, c)
        ends = 1.0, math.exp(min(new.det_log - row.det_log, 50.0))
    band = SLOPE_BAND if j == 0 else MONITOR_BAND * max(*ends, half.sizes[j] if j < part.count else 0.0)
    points = [(0.0, ends[0]), (1.0, ends[1])]
    least = math.inf
    for _ in range(25):
        made = value(t)
        if made is None:
            return None
        f = sign * made[0]
        if f < -band:
            rest = (1.0 - t) * curve.length
            return Row(made[1], part, row.s + t * curve.length, new.angle * t, tests_of(made[1]), rest)
        if f < least:
            least = f
        points = sorted([*points, (t, f)])
        k = min(range(1, len(points) - 1), key=lambda i: points[i][1])
        (t0, f0), (t1, f1), (t2, f2) = points[k - 1:k + 2]
        d01, d12 = (f1 - f0) / (t1 - t0), (f2 - f1) / (t2 - t1)
        bend = (d12 - d01) / (t2 - t0)
        if bend <= 0.0:
            return None
        t = 0.5 * (t0 + t1) - 0.5 * d01 / bend
        lowest = f1 - bend * (t - t1)**2
        if lowest > 0.5 * f1 and f1 > 1e-9 * max(ends):
            return None
        if min(abs(t - t0), abs(t - t1), abs(t - t2)) < 1e-4 * (t2 - t0):  # a golden step keeps the three points apart
            t = t1 + 0.1 * ((t2 - t1) if t2 - t1 > t1 - t0 else (t0 - t1))
        if not 0.0 < t < 1.0:  # least at an end, as of a test that is zero where its equations begin
            return None
        if t2 - t0 < 1e-7:
            break
    if least <= 1e-9 * max(ends):
        kind = part.kinds[j] if j < part.count else SpecialPointKind.BRANCH_POINT
        s = row.s + t * curve.length
        known = any(other[0] == kind.value and abs(other[1] - s) < AT_END * curve.length for other in half.unresolved)
        begins = (t < AT_END and on_boundary(half, row)) or (1.0 - t < AT_END and on_boundary(half, new))
        if not (known or begins):  # where an event is born, other tests may begin at zero with the square of the way
            half.unresolved.append((kind.value, s, float(curve.place(t)[-1])))
    return None


def on_boundary(half, row) -> bool:
    """Whether a row lies on a boundary of its equations, to rounding."""
    return any(abs(row.tests[j]) <= MONITOR_BAND * max(half.sizes[j], 1e-3) for j in row.part.boundary)
