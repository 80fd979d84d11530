"""Neimark-Sacker points that a product of multipliers does not show.

The product of 1 - mu_i mu_j over pairs changes its sign where a complex pair passes the unit circle, and also where two real
multipliers become each other's inverse, which is no bifurcation (Kuznetsov 2004, section 10.2).  Beside a graze one multiplier
grows without bound and is for a moment the inverse of each of the others: several zeros of the product lie in one step, and
one of them at most is a torus.  The number of multipliers outside the circle decides: what real ones that pass +1 and -1 do
not explain is a pair.
"""
import numpy as np
from scipy.optimize import linear_sum_assignment

from ..kinds import SpecialPointKind
from .roots import enclose, polish
from .rows import Curve

HALVINGS = 40
PLACES = 16  # parts of a step between two passages of the circle
COMPLEX = 1e-7  # imaginary part of a multiplier that is not real
REAL = (SpecialPointKind.FOLD, SpecialPointKind.BRANCH_POINT, SpecialPointKind.PERIOD_DOUBLING)
STABILITY = (*REAL, SpecialPointKind.NEIMARK_SACKER)  # kinds at which multipliers pass the unit circle


def pair_on_circle(part, a, b, found):
    """Return (curve, root) of the point between the rows ``a`` and ``b`` where a complex pair passes the unit circle; None without
    one. ``found`` are the special points of real multipliers in the step."""
    curve = Curve(a, b)
    places = [(point.s - a.s) / curve.length for point in found if point.kind in REAL]
    first = outside(part.problem, a.x)

    def passed(t, x):
        """Whether more multipliers have left or reached the circle up to ``t`` than real ones did."""
        count = outside(part.problem, x)
        return None if count is None else abs(count - first) > sum(0.0 < place < t for place in places)

    if first is None or not curve.length > 0.0 or not passed(1.0, b.x):
        return None
    low, high = 0.0, 1.0
    value = curve_value(part.problem, curve)
    for _ in range(HALVINGS):
        ends = value(low), value(high)
        if None not in ends and ends[0][0] * ends[1][0] <= 0.0 and high - low < 0.1:
            made = enclose(value, low, ends[0][0], high, ends[1][0])
            root = None if made is None else polish(value, *made)
            if root is not None and abs(value(root.at)[0]) < 1e-6:
                return curve, root
        t = 0.5 * (low + high)
        c = curve.at(t)
        decided = None if c is None else passed(t, c.x)
        if decided is None:
            return None
        low, high = (low, t) if decided else (t, high)
    return None


def inner_change(part, a, b):
    """Return a corrected point between the rows ``a`` and ``b``, and its position in (0, 1), where more or fewer multipliers are
    outside the circle than at both; None where none is found.

    Two complex pairs may change sides one after the other, or a pair passes and comes back.  Which pair has become which is told by
    their distance; one that stays on its side is looked at if it is nearer to the circle than it moves in the step.
    """
    pairs = [complex_pairs(part.problem, row.x) for row in (a, b)]
    if pairs[0] is None or pairs[1] is None or len(pairs[0]) != len(pairs[1]) or len(pairs[0]) == 0:
        return None
    one, two = linear_sum_assignment(np.abs(pairs[0][:, None] - pairs[1][None]))
    first, last = (np.abs(mu[k])**2 - 1.0 for mu, k in zip(pairs, (one, two), strict=True))
    turned = first * last < 0.0
    if turned.any():
        passed = first[turned] / (first[turned] - last[turned])
        places = [0.5 * float(passed.min() + passed.max()), *(k / PLACES for k in range(1, PLACES))]
    elif np.any(np.minimum(np.abs(first), np.abs(last)) < np.abs(last - first)):
        places = [0.5, 0.25, 0.75]
    else:
        return None
    curve, count = Curve(a, b), outside(part.problem, a.x)
    for t in places:
        c = curve.at(t)
        if c is not None and outside(part.problem, c.x) not in (None, count):
            return c, t
    return None


def complex_pairs(problem, x):
    """Return the complex multipliers at ``x`` (n + 1,) with positive imaginary parts; None where they are not known."""
    mu = problem.floquet_multipliers(x)
    return None if mu is None or not np.isfinite(mu).all() else mu[mu.imag > COMPLEX]


def outside(problem, x):
    """Return the number of multipliers outside the unit circle at ``x`` (n + 1,); None where they are not known."""
    mu = problem.floquet_multipliers(x)
    return None if mu is None or not np.isfinite(mu).all() else int(np.count_nonzero(np.abs(mu) > 1.0))


def curve_value(problem, curve):
    """Return ``f(t) -> (|mu|^2 - 1, point)`` for the complex pair nearest to the circle; None where there is none."""
    def value(t):
        c = curve.at(t)
        mu = None if c is None else problem.floquet_multipliers(c.x)
        if mu is None or not np.isfinite(mu).all():
            return None
        pairs = np.abs(mu[mu.imag > COMPLEX])**2 - 1.0
        return (float(pairs[np.argmin(np.abs(pairs))]), c) if pairs.size else None
    return value
