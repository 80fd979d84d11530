"""Neimark-Sacker points that a product of multipliers does not show.

The product of 1 - mu_i mu_j over pairs changes its sign where a complex pair passes the unit circle, and also where two real
multipliers become each other's inverse, which is no bifurcation (Kuznetsov 2004, section 10.2).  Beside a graze one multiplier
grows without bound and is for a moment the inverse of each of the others: several zeros of the product lie in one step, and
one of them at most is a torus.  The number of multipliers outside the circle decides: what real ones that pass +1 and -1 do
not explain is a pair.
"""
import numpy as np
from scipy.optimize import linear_sum_assignment

from ...orbits.multipliers import NEUTRAL
from ..kinds import SpecialPointKind
from .roots import enclose, polish
from .rows import Curve

HALVINGS = 40
PLACES = 16  # in a step, at most, at which a pair that may have passed the circle and come back is looked at
EDGE = 0.1  # of the part of a step, from its ends, next to which it is not looked
ROUNDING, KNOWN = 1e-14, 0.1  # of the largest multiplier: error of all; up to which it makes no difference
COMPLEX = 1e-7  # imaginary part of a multiplier that is not real
NOT_REAL = 1e-6  # the same as part of its size, where the tests of all rows are made
ON_CIRCLE = NEUTRAL  # so near to the circle it is not known whether a multiplier lies outside, as of a motion that nothing damps
REAL = (SpecialPointKind.FOLD, SpecialPointKind.BRANCH_POINT, SpecialPointKind.PERIOD_DOUBLING)
STABILITY = (*REAL, SpecialPointKind.NEIMARK_SACKER)  # kinds at which multipliers pass the unit circle


def pair_on_circle(part, a, b, found):
    """Return (curve, root) of the point between the rows ``a`` and ``b`` where a complex pair passes the unit circle; None without
    one. ``found`` are the special points of real multipliers in the step."""
    if not passes(part, a, b, found):
        return None
    curve, low, high = Curve(a, b), 0.0, 1.0
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
        decided = None if c is None else passes(part, a, b, found, t, c.x)
        if decided is None:
            return None
        low, high = (low, t) if decided else (t, high)
    return None


def passes(part, a, b, found, t=1.0, x=None) -> bool | None:
    """Return whether from the row ``a`` up to the part ``t`` of the way to ``b``, the point ``x`` (n + 1,), more multipliers leave
    or reach the unit circle than the real ones do that ``found`` tells; None where it is not known."""
    first, last, length = outside(part.problem, a.x), outside(part.problem, b.x if x is None else x), b.s - a.s
    if first is None or last is None or not length > 0.0:
        return None
    sure = max(last[0] - first[1], first[0] - last[1])
    return sure > sum(0.0 < (point.s - a.s) / length < t for point in found if point.kind in REAL)


def inner_change(part, a, b):
    """Return a corrected point between the rows ``a`` and ``b``, and its position in (0, 1), where more or fewer multipliers are
    outside the circle than at both; None where none is found.

    Two complex pairs may change sides one after the other, or a pair passes and comes back.  What has become of each multiplier is
    told by its distance.  Where one of a pair is nearer to the circle than it has moved, the part of the step is halved, the most
    doubtful one first.
    """
    mu = [multipliers(part.problem, row.x) for row in (a, b)]
    if mu[0] is None or mu[1] is None:
        return None
    curve, count = Curve(a, b), counts(mu[0])
    spans = [(*doubt(*mu), 0.0, 1.0, *mu)]
    for _ in range(PLACES):
        worst = max(range(len(spans)), key=lambda k: spans[k][0])
        doubtful, place, low, high, first, last = spans.pop(worst)
        if not doubtful > 1.0:
            return None
        t = low + place * (high - low)
        c = curve.at(t)
        middle = None if c is None else multipliers(part.problem, c.x)
        if middle is None:
            return None
        least, most = counts(middle)
        if least > count[1] or most < count[0]:
            return c, t
        spans += [(*doubt(first, middle), low, t, first, middle), (*doubt(middle, last), t, high, middle, last)]
    return None


def doubt(first, last):
    """Return how far a multiplier of a pair has moved between two points over its distance from the circle there, the largest over
    all; and where between them, 0 to 1, to look: between the passages of two pairs that have changed sides."""
    one, two = linear_sum_assignment(np.abs(first[:, None] - last[None]))
    pairs = (np.abs(first[one].imag) > COMPLEX) | (np.abs(last[two].imag) > COMPLEX)
    first, last = first[one][pairs], last[two][pairs]
    before, after = np.abs(first) - 1.0, np.abs(last) - 1.0
    if not before.size:
        return 0.0, 0.5
    near = np.maximum(np.minimum(np.abs(before), np.abs(after)), ON_CIRCLE)
    turned = before * after < 0.0
    place = 0.5
    if turned.any():
        passed = before[turned] / (before[turned] - after[turned])
        place = min(max(0.5 * float(passed.min() + passed.max()), EDGE), 1.0 - EDGE)
    moves = np.abs(last - first) * (np.maximum(np.abs(before), np.abs(after)) > ON_CIRCLE)  # else it stays on the circle
    return float((moves / near).max()), place


def next_to(problem, point, x):
    """Return whether as many multipliers are outside the unit circle at ``x`` (n + 1,) as there can be right beside a special point
    ``point``: those that are outside at it, without or with the one (two: Neimark-Sacker) that passes there."""
    here, there = (multipliers(problem, at) for at in (point.x, x))
    if here is None or there is None:
        return True
    passing = 2 if point.kind is SpecialPointKind.NEIMARK_SACKER else 1
    at = -1.0 if point.kind is SpecialPointKind.PERIOD_DOUBLING else 1.0
    away = np.abs(np.abs(here) - 1.0) if passing == 2 else np.abs(here - at)
    rest = int(np.count_nonzero(np.abs(here[np.argsort(away)[passing:]]) > 1.0))
    return int(np.count_nonzero(np.abs(there) > 1.0)) in (rest, rest + passing)


def passing(mu, place: float) -> float:
    """Return a test that changes its sign where a real multiplier passes ``place``: signed distance of the nearest."""
    real = mu.real[np.abs(mu.imag) <= NOT_REAL * (1.0 + np.abs(mu))] - place
    if not real.size:
        return 1.0
    return float(np.abs(mu - place).min()) * (-1.0 if np.count_nonzero(real < 0.0) % 2 else 1.0)


def circling(mu) -> float:
    """Return a test that changes its sign where a complex pair passes the unit circle: signed least |1 - mu_i mu_j|, i < j.

    It also does where two real multipliers become each other's inverse, which is no bifurcation.
    """
    i, j = np.triu_indices(len(mu), 1)
    factors = 1.0 - mu[i] * mu[j]
    if not factors.size:
        return 1.0
    real = factors.real[np.abs(factors.imag) <= 1e-12 * (1.0 + np.abs(factors))]
    return float(np.abs(factors).min()) * (-1.0 if np.count_nonzero(real < 0.0) % 2 else 1.0)


def on_circle(problem, kind, x):
    """Return the test of the multipliers at ``x`` (n + 1,) that is zero at a special point of a ``kind``, in their own size, and
    the modulus of the largest; None where they are not known."""
    half = problem.half_multipliers(x) if kind is SpecialPointKind.BRANCH_POINT else None  # of the mirrored half: -1 breaks it
    mu = multipliers(problem, x) if half is None else half
    if mu is None or not mu.size:
        return None
    test = circling(mu) if kind is SpecialPointKind.NEIMARK_SACKER else passing(mu, 1.0 if kind is SpecialPointKind.FOLD else -1.0)
    return test, float(np.abs(mu).max())


def multipliers(problem, x):
    """Return all multipliers at ``x`` (n + 1,), to be followed; None where they are not known."""
    mu = problem.followed_multipliers(x)
    return None if mu is None or not np.isfinite(mu).all() else mu


def outside(problem, x):
    """Return `counts` at ``x`` (n + 1,); None where they are not known: of a multiplier of size 1e16, next to a graze, the rounding
    is larger than the others."""
    mu = multipliers(problem, x)
    if mu is None:
        return None
    error = ROUNDING * np.abs(mu).max(initial=0.0)
    if error > KNOWN and np.abs(np.abs(mu) - 1.0).min() < error:
        return None
    return counts(mu)


def counts(mu) -> tuple[int, int]:
    """Return how many multipliers are outside the unit circle at least, and at most."""
    return int(np.count_nonzero(np.abs(mu) > 1.0 + ON_CIRCLE)), int(np.count_nonzero(np.abs(mu) > 1.0 - ON_CIRCLE))


def curve_value(problem, curve):
    """Return ``f(t) -> (|mu|^2 - 1, point)`` for the complex pair nearest to the circle; None where there is none."""
    def value(t):
        c = curve.at(t)
        mu = None if c is None else multipliers(problem, c.x)
        if mu is None:
            return None
        pairs = np.abs(mu[mu.imag > COMPLEX])**2 - 1.0
        return (float(pairs[np.argmin(np.abs(pairs))]), c) if pairs.size else None
    return value
