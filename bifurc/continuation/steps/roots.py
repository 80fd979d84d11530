"""Bracketed root of a scalar test along a curve, with an error that is measured; the searches themselves are `solve.zeros`."""
import math
import types
from dataclasses import dataclass
from typing import Any

from ...solve import zeros
from ...solve.zeros import PROBE

__all__ = ["PROBE", "Root", "bracketed", "enclose", "off_line", "polish", "root_of"]

HALVINGS, NARROW, WIDE = 40, 1e-9, 1e-2  # of a bracket that cannot be polished: most, and width that is enough, or too much
LAST = 10  # points next to such a root that show the rounding of the parameter
CONTINUOUS = 1e-6  # of the values at its ends, which are left of one that does not jump
off_line = zeros.off_line.py_func
enclosing = zeros.enclosing.py_func
polishing = types.FunctionType(zeros.polishing.py_func.__code__, {**vars(zeros), "off_line": off_line})  # nothing compiled in it


@dataclass(slots=True)
class Root:
    """A root: position in the interval, point, interval with the sign change, error of the position, slope, noise and
    second difference of the parameter, and whether the value is at the level of the noise."""

    at: float
    point: Any
    low: float
    high: float
    error: float
    slope: float
    p_noise: float
    p_curve: float
    settled: bool


def root_of(box, point) -> Root:
    """Return the root that a search has left in its ``box``, see `solve.zeros`, with its point."""
    at, low, high, error, slope, p_noise, p_curve, settled = (float(box[place]) for place in (
        zeros.AT, zeros.LOW, zeros.HIGH, zeros.ERROR, zeros.SLOPE, zeros.P_NOISE, zeros.P_CURVE, zeros.SETTLED))
    return Root(at, point, low, high, error, slope, p_noise, p_curve, settled > 0.0)


def enclose(f, a, fa, b, fb, guess=None):
    """Shrink a bracket until the test is 1e-9 of its values at the ends.

    Parameters
    ----------
    f : callable
        ``f(t) -> (value, point)`` or None where the curve cannot be computed.
    a, b, fa, fb : float
        Bracket and values of opposite sign (one may be zero).
    guess : float, optional
        First position to try, inside the bracket.

    Returns
    -------
    tuple (t, value, point) or None
        ``point`` is None if the root is an end of the bracket that was never evaluated here.
    """
    box, points = [0.0] * zeros.BOX, {}
    for t in enclosing(box, a, fa, b, fb, math.nan if guess is None else guess):
        made = f(t)
        if made is None:
            return None
        box[zeros.VALUE], points[t] = made
    if not box[zeros.DONE]:
        return None
    return box[zeros.AT], box[zeros.LEAST], points[box[zeros.AT]] if box[zeros.ASKED] else None


def bracketed(f, a, fa, b, fb, jumps=True, narrow=NARROW):
    """Return the `Root` that halving a bracket leaves, where the test is too near to its rounding to be polished, as one is that is
    zero with some power of the way; or None.  Halved until it is ``narrow``.

    ``fa`` and ``fb`` have opposite signs.  The error is what is left of the bracket: its middle may have no point.  Where the test
    ``jumps`` over zero that is no root unless it may.  So near to rounding that of the parameter may count more than the bracket.
    """
    near, least = [], CONTINUOUS * max(abs(fa), abs(fb))
    for _ in range(HALVINGS):
        t = 0.5 * (a + b)
        made = f(t)
        if made is None:
            break
        if (made[0] > 0.0) == (fb > 0.0):
            b, fb = t, made[0]
        else:
            a, fa = t, made[0]
        near.append((t, made[1]))
        if b - a < narrow or made[0] == 0.0:
            break
    if not near or b - a > WIDE or not jumps and max(abs(fa), abs(fb)) > least:
        return None
    slope = (fb - fa) / (b - a) or math.copysign(1e-300, fb)
    noise = 2.0 * aside([(t, float(point.x[-1])) for t, point in near[-LAST:]])  # it moves the place of the root as well
    return Root(*near[-1], a, b, b - a, slope, noise, 0.0, False)


def aside(points) -> float:
    """Return how far the parameters of points (t, p) that close in on the last one lie beside a line from that to the first."""
    (first, p0), (last, p1) = points[0], points[-1]
    slope = (p1 - p0) / (last - first) if last != first else 0.0
    return max(abs(p - p1 - slope * (t - last)) for t, p in points)


def polish(f, t, value, point):
    """Refine a root known to about 1e-9 and measure its error; see `Root`.

    ``f`` as in `enclose`; ``point`` may be None and is then computed.  Returns None where the slope vanishes.
    """
    box = [0.0] * zeros.BOX
    box[zeros.AT] = t
    if point is not None:
        box[zeros.LEAST], box[zeros.THERE], box[zeros.ASKED] = value, float(point.x[-1]), 1.0
    for place in polishing(box):
        made = f(place)
        if made is None and box[zeros.TRIED]:
            box[zeros.VALUE] = math.nan
            continue
        if made is None:
            return None
        box[zeros.VALUE], point = made
        box[zeros.PARAMETER] = float(point.x[-1])
    return root_of(box, point) if box[zeros.DONE] else None
