"""Rules for a step of pseudo-arclength continuation, in plain numbers: is it credible, how long is the next, what may it hide.

The same text serves problems in Python (`py_func`) and compiled runs of steps (`orbits.shooting.sequence.follow`).  Step law by
turning angle and predicted distance (as COCO: Dankowicz & Schilder 2013); a step is credible only if it turns little and if its
sideways distance fits the arc that its turn describes: an angle law alone jumps between branches that nearly touch.
"""
import math

from .._jit import inlined

TARGET_ANGLE = 0.2  # radians a step
MAX_ANGLE = 0.35  # radians; a step that turns more is rejected
MISFIT = 0.1  # sideways distance not explained by the turn, as part of the step
FEW, MANY = 4, 6  # Newton iterations up to which steps may grow; above MANY a step is rejected: Newton has wandered
WANDERS = 1e3  # least steps above which it may have
GROWTH = 2.0  # of the curvature from step to step, at most, that the step length foresees
NEARLY_SINGULAR = 16.0  # fall of log det in one step that means a singular point
SLOPE_BAND = 1e-11  # |dp/ds| of rounding: a vertical branch has no folds
BOUNDARY_BAND = 1e-7  # the same where equations end or begin: an elastic graze has dp/ds = 0 and is no fold
MONITOR_BAND = 1e-12  # of the largest value seen
DIP = 0.15  # a fold test whose interpolated extremum falls below this part of its ends is looked at
SHALLOW = 0.9  # the same for tests that are interpolated through three rows, which is much less certain
FALLEN = 0.4  # of the values at both neighbours, that at the middle row: a peak may be sharper than a corner too
LOOSE = 0.03  # part of the larger end value by which the interpolated extremum may be wrong
AT_END = 1e-3  # part of a step: a minimum so near an end of it that lies on a boundary of the equations is that end
DOUBT = 0.01  # misfit of a step that is looked at
ASIDE = 2e-3  # distance of the middle of a step from its Hermite curve, as part of the step, that is a jump
DECAY = 0.5  # part to which the determinant falls in a step that is looked at
STRAIGHT = 1.0  # radians; a branch that has turned by less (even a quarter turn) still leads away from where it began
REFLECTION = 0.2  # determinant with the wrong sign, as part of its linear extrapolation, that is taken for a jump
CREDIBLE, TURNS, LEADS_AWAY = 0, 1, 2
CLEAR, JUMPS, UNCLEAR = 0, 1, 2


@inlined
def arc_length(chord, angle):
    """Length of the circular arc over ``chord`` that turns by ``angle``."""
    half = 0.5 * angle
    return chord * (half / math.sin(half) if half > 1e-4 else 1.0 + half * half / 6.0)


@inlined
def judged(cosine, along, sideways, singular):
    """Return (verdict, angle, misfit): whether a step that turns by an angle with ``cosine`` follows the arc of that turn.

    ``along`` and ``sideways`` are the parts of the step along the old tangent and across it; where the new tangent is not known
    (``singular``) the arc tells the angle.
    """
    if cosine >= 1.0:
        angle = 0.0
    elif cosine > 0.9:
        angle = math.acos(cosine)
    else:
        return TURNS, math.pi, 0.0
    if singular:
        angle = 2.0 * math.atan2(sideways, along)
    if angle > MAX_ANGLE:
        return TURNS, angle, 0.0
    misfit = sideways / along - math.tan(0.5 * angle)
    return LEADS_AWAY if abs(misfit) > MISFIT else CREDIBLE, angle, misfit


@inlined
def next_length(ds, bend, before, iterations, most):
    """Length of the next step, up to ``most``, from the curvature of this one and the last, and from what this one cost."""
    if bend > before > 0.0:  # it grows: expect it to grow on
        bend *= min(bend / before, GROWTH)
    turn = bend * ds
    factor = min(max(TARGET_ANGLE / turn, 0.5), 2.0) if turn > 0.5 * TARGET_ANGLE else 2.0
    if iterations == MANY:
        factor = min(factor, 0.5)
    elif iterations > FEW:
        factor = min(factor, 1.2)
    return min(ds * factor, most)


@inlined
def crosses(value, sign, band):
    """Whether a test that had a clear sign is beyond zero now."""
    return sign != 0 and abs(value) > band and (value > 0.0) != (sign > 0)


@inlined
def two_folds(a, b, mean):
    """Return the place in (0, 1) at which the parameter may turn twice in a step, -1 where it does not.

    ``a``, ``b`` are dp/ds at the ends, ``mean`` its average: the slope of the cubic between has its extremum there.
    """
    if not a * b > 0.0 or min(abs(a), abs(b)) <= BOUNDARY_BAND:
        return -1.0
    if a < 0.0:
        mean = -mean
    a, b = abs(a), abs(b)
    c2, c1 = 3.0 * (a + b) - 6.0 * mean, 6.0 * mean - 4.0 * a - 2.0 * b
    if c2 > 0.0 and 0.0 < -c1 < 2.0 * c2 and a - 0.25 * c1 * c1 / c2 < DIP * min(a, b) + LOOSE * max(a, b):
        return -0.5 * c1 / c2
    return -1.0


@inlined
def lowest(a, b, slope_a, slope_b):
    """Return the place in (0, 1) at which a number that is not negative at the ends of a step may be zero, -1 where it is not.

    Of a number whose rates are known, by ``slope_a`` and ``slope_b`` a step, the cubic tells a minimum to the fourth order.
    """
    c2, c3 = 3.0 * (b - a) - 2.0 * slope_a - slope_b, 2.0 * (a - b) + slope_a + slope_b
    root = c2 * c2 - 3.0 * c3 * slope_a
    if root <= 0.0:
        return -1.0
    root = math.sqrt(root)
    if c2 > 0.0:
        t = -slope_a / (c2 + root)
    elif c3 != 0.0:
        t = (root - c2) / (3.0 * c3)
    else:
        return -1.0
    if not AT_END < t < 1.0 - AT_END:
        return -1.0
    least = a + t * (slope_a + t * (c2 + t * c3))
    return t if least < DIP * min(a, b) + LOOSE * max(a, b) else -1.0


@inlined
def two_zeros(f0, a, b, back, length):
    """Return the place at which a test may have two zeros: in (0, 1) of this step, in (-1, 0] of the one before, 2 where not.

    The parabola goes through the test ``f0``, ``a``, ``b`` at three rows, ``back`` and ``length`` apart.  Where it has none, a
    sharper peak may, as of a multiplier that comes to -1 and goes back within two steps: it is looked for where a corner reaches
    zero that has the slope of the other step on both sides, and where the middle row has fallen so far that it may be a cusp.
    """
    if not (a * b > 0.0 and f0 * a > 0.0 and (abs(a) < abs(f0) or abs(a) < abs(b))):
        return 2.0
    sign = 1.0 if a > 0.0 else -1.0
    first, second = sign * (a - f0) / back, sign * (b - a) / length
    bend = (second - first) / (back + length)
    if bend <= 0.0:
        return 2.0
    slope = first + bend * back  # at the middle row
    least = -math.inf if abs(a) < FALLEN * min(abs(f0), abs(b)) else abs(a) - 0.25 * slope * slope / bend
    if slope < 0.0 < slope + 2.0 * bend * length and least < SHALLOW * min(abs(a), abs(b)):
        return -0.5 * slope / (bend * length)
    if slope - 2.0 * bend * back < 0.0 <= slope and least < SHALLOW * min(abs(a), abs(f0)):
        return -0.5 * slope / (bend * back)
    if abs(a) + abs(b) <= -first * length:
        return 0.5 * (1.0 + second / first)
    if abs(a) + abs(f0) <= second * back:
        return -0.5 * (1.0 + first / second)
    return 2.0


@inlined
def doubtful(misfit, corner, a, b, back, length, same_sign):
    """Return whether the ends of a step may lie on different branches that cross or nearly touch at a small angle.

    Such a jump shows little turn, little misfit and sometimes no change of sign of the determinant, which was 1, ``a`` and ``b``
    (in size) at three rows ``back`` and ``length`` apart.  `UNCLEAR`: some misfit is seen or the determinant heads for zero.
    """
    heading = a - (1.0 - a) * length / back
    if abs(misfit) < DOUBT + 0.5 * corner and heading > DECAY * a and b > DECAY * a:
        return CLEAR
    if heading < 0.0 and same_sign and b > REFLECTION * -heading:
        return JUMPS  # it was heading for zero and came back
    return UNCLEAR
