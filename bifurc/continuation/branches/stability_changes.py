"""Where the stability along a branch changes, of problems whose Floquet multipliers are not needed in every step.

Multipliers of all rows are known in one go after the trace; three tests of them change their sign between two rows where a
real multiplier passes -1 (period doubling) or +1, or a complex pair the unit circle (Neimark-Sacker).  Each is then located
on the curve between these rows, as any special point.  A multiplier passes +1 at folds and branch points, which the tracer
has found by the determinant; one that is left over belongs to motions that the equations cannot express (of even harmonics,
where only odd ones are balanced) and is a branch point as well.
"""
import math

import numpy as np

from ..kinds import SpecialPointKind
from ..steps.branchpoint import locate_crossing
from ..steps.rows import Curve
from ..steps.tori import NOT_REAL, circling, passing
from .special import SpecialPoint

ON_CIRCLE = 1e-6  # distance of a located multiplier from the unit circle
CLEAR = 1e-8  # a test that is nearer to zero has no sign: rounding of multipliers
NEAR_FOLD = 3  # rows: a multiplier passes +1 beside the fold of truncated equations, not in it
STAYS = 0.2  # and farther where it stays as near to +1: in a fold as sharp as the truncation error rows are dense
WIDTH = 1e-13  # of a step, to which a change is enclosed
HALVINGS = 60
REAL = ((SpecialPointKind.PERIOD_DOUBLING, -1.0), (SpecialPointKind.BRANCH_POINT, 1.0))


def stability_changes(branch, points) -> list:
    """Return special points (period doublings, Neimark-Sacker and branch points) that ``points`` of a branch does not have."""
    rows, made = None, []
    parts, s = branch._arrays["part"], branch._arrays["s"]
    known = np.array([point.s for point in points if point.kind in (SpecialPointKind.FOLD, SpecialPointKind.BRANCH_POINT)])
    for k, problem in enumerate(branch.problems):
        here = np.flatnonzero(parts == k)
        if here.size < 2:
            continue
        table = problem.multipliers_of_rows(branch._unknowns(here))
        if table is None or not table.shape[1]:
            continue
        for kind, test in tests():
            values = np.array([test(mu) if np.isfinite(mu).all() else math.nan for mu in table])
            clear = np.flatnonzero(np.abs(values) > CLEAR)  # a row on a change is passed over; without losses none is clear
            changes = [(i, j) for i, j in zip(clear[:-1].tolist(), clear[1:].tolist(), strict=True)
                       if values[i] * values[j] <= 0.0 and j - i <= 2 and np.isfinite(values[i:j + 1]).all()]
            for i, j in changes:
                a, b = int(here[i]), int(here[j])
                if kind is SpecialPointKind.BRANCH_POINT:
                    low, high = s[max(a - NEAR_FOLD, 0)], s[min(b + NEAR_FOLD, len(s) - 1)]
                    if np.any((known >= low) & (known <= high)) or of_a_fold(np.abs(values), s[here], changes, (i, j), known):
                        continue
                rows = branch.rows() if rows is None else rows
                found = enclosed(problem, Curve(rows[a], rows[b]), test, values[i], values[j], kind)
                if found is None:
                    continue
                c, t, width, error = found
                at = float(s[a] + t * (s[b] - s[a]))
                wide = width * float(s[b] - s[a])
                made.append(SpecialPoint(kind, float(c.x[-1]), error, at, (at - wide, at + wide), c.x, c.tangent,
                                         before=problem.signature, after=problem.signature, problem=problem,
                                         directions=crossing_of(problem, c.x) if kind is SpecialPointKind.BRANCH_POINT else None))
    return made


def of_a_fold(values, s, changes, change, known) -> bool:
    """Whether a multiplier passes +1 in this change because of a fold: it stays near there between them, and no other change is
    nearer to that fold.

    Parameters
    ----------
    values : ndarray (rows,)
        Distance of the nearest multiplier from +1 in the rows of a part.
    s : ndarray (rows,)
        Their arclengths.
    changes : list of pair of int
        Rows between which a multiplier passes +1.
    change : pair of int
        One of them.
    known : ndarray
        Arclengths of folds and branch points.
    """
    low, high = change
    while low > 0 and values[low - 1] < STAYS:
        low -= 1
    while high < len(s) - 1 and values[high + 1] < STAYS:
        high += 1
    middles = np.array([0.5 * (s[i] + s[j]) for i, j in changes])
    here = known[(known >= s[low]) & (known <= s[high])]
    return any(changes[int(np.abs(middles - place).argmin())] == change for place in here.tolist())


def tests():
    """Return pairs (kind, test of multipliers)."""
    return [*((kind, lambda mu, place=place: passing(mu, place)) for kind, place in REAL),
            (SpecialPointKind.NEIMARK_SACKER, circling)]


def crossing_of(problem, x):
    """Return the tangents (2, n + 1) of two branches of the problem that cross at ``x``; None where it knows only one."""
    crossing = locate_crossing(problem, x)
    near = crossing.status == "located" and float(np.abs((crossing.x - x) / problem.scale).max()) < ON_CIRCLE
    return crossing.directions if near else None


def enclosed(problem, curve, test, fa, fb, kind):
    """Return (corrected point, position, width, error of the parameter) of a change in a step; None where there is a jump only."""
    low, high, middle = 0.0, 1.0, None
    side = 0
    for _ in range(HALVINGS):
        t = low + (high - low) * fa / (fa - fb) if abs(fa - fb) < math.inf else 0.5 * (low + high)
        if not low < t < high or side > 2 or side < -2:
            t, side = 0.5 * (low + high), 0
        c = curve.at(t)
        if c is None:
            return None
        mu = problem.multipliers_of_rows(c.x[None])[0]
        if not np.isfinite(mu).all():
            return None
        value = test(mu)
        middle = c, t, mu
        if value * fa > 0.0:
            low, fa, side = t, value, max(side, 0) + 1
        else:
            high, fb, side = t, value, min(side, 0) - 1
        if value == 0.0 or high - low < WIDTH or abs(value) < 1e-14:
            break
    if middle is None:
        return None
    c, t, mu = middle
    if not confirmed(kind, mu):
        return None
    width = max(high - low, 1e-15) if abs(high - low) < 1e-6 else abs(test(mu)) * (high - low) / max(abs(fb - fa), 1e-300)
    scale = float(problem.scale[-1])
    error = scale * abs(float(c.tangent[-1])) * curve.length * width + 1e-13 * (abs(float(c.x[-1])) + scale)
    return c, t, width, error


def confirmed(kind, mu) -> bool:
    """Whether multipliers at a located point are what its kind says, and not those on one side of a jump."""
    if kind is SpecialPointKind.NEIMARK_SACKER:
        return bool(np.any((np.abs(mu.imag) > NOT_REAL) & (np.abs(np.abs(mu) - 1.0) < ON_CIRCLE)))
    return bool(np.any(np.abs(mu - (1.0 if kind is SpecialPointKind.BRANCH_POINT else -1.0)) < ON_CIRCLE))
