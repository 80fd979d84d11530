"""Rows of a branch that lie on an earlier stretch of it, in state and parameter: it runs back, or round once more.

Only a closed branch comes to where it was, with its last row.  Rows are compared with the cubic curves between earlier rows, found
by a tree of the rows, and what lies as near as the tracer takes a step for one curve is confirmed by the equations of that
stretch: their solution beside the row is the row itself.
"""
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from ...solve.steplaw import ASIDE, MAX_ANGLE
from ..kinds import ERRORS

EQUAL = 1e-8  # scaled: two solutions of the corrector that are one, as where a branch closes
HERE = 1e-5  # arclength: behind a boundary equations begin up to this far from where others end
COLUMNS = 8  # coordinates in which neighbours are looked for: of more, distances are not smaller
FEET = 8  # steps of Newton's method to the foot of a row on a curve
CHUNK = 4096  # pairs that are measured at a time


def retraced(branch, arrays) -> tuple[tuple[float, float], ...]:
    """Return arclengths (of a row, of the earlier place that it repeats) of a branch."""
    sizes, last = np.diff(arrays["offsets"]), arrays["s"].size - 1
    found: list[tuple[float, float]] = []
    for size in np.unique(sizes).tolist():
        rows = np.flatnonzero((sizes == size) & ~(branch.closed & (np.arange(last + 1) == last)))
        found += of_one_size(branch, arrays, rows)
    return tuple(sorted(found))


def of_one_size(branch, arrays, rows) -> list[tuple[float, float]]:
    """Return what `retraced` does, of rows (numbers, in order) that have equally many unknowns."""
    s, part, starts = arrays["s"], arrays["part"], arrays["offsets"][rows]
    width = int(arrays["offsets"][rows[0] + 1] - starts[0]) if rows.size else 0
    a = np.flatnonzero((np.diff(rows) == 1) & (part[rows[1:]] == part[rows[:-1]]) & (np.diff(s[rows]) > 0.0))  # curves begin here
    if not a.size:
        return []
    places = starts[:, None] + np.arange(width)
    x, scale = arrays["x"][places], branch.problems[int(part[rows[0]])].scale
    own = np.array([branch.problems[k].scale for k in part[rows].tolist()])
    x, rates = x / scale, arrays["tangent"][places] * own / scale
    lengths = np.linalg.norm(x[a + 1] - x[a], axis=1)
    widest = np.argsort(np.ptp(x, axis=0))[::-1][:COLUMNS]
    near = cKDTree(x[:, widest]).query_ball_point(0.5 * (x[a] + x[a + 1])[:, widest], (0.5 + MAX_ANGLE) * lengths + EQUAL)
    pairs = np.array([(k, i) for k, here in enumerate(near) for i in here if i > a[k] + 1], int).reshape(-1, 2)
    found = {}
    for first, stop in pairwise([*range(0, len(pairs), CHUNK), len(pairs)]):
        curve, i = pairs[first:stop].T
        j = a[curve]
        t, away, off = feet(x[i], x[j], x[j + 1], *((s[rows[j + 1]] - s[rows[j]])[:, None] * rates[k] for k in (j, j + 1)))
        at = s[rows[j]] + t * (s[rows[j + 1]] - s[rows[j]])
        good = (away <= ASIDE * lengths[curve] + EQUAL) & (off <= EQUAL) & (np.abs(s[rows[i]] - at) > HERE)
        for k in np.flatnonzero(good).tolist():
            row, place = int(rows[i[k]]), float(at[k])
            if row not in found and repeats(branch, arrays, row, int(rows[j[k]]), float(t[k])):
                found[row] = float(s[row]), place
    return list(found.values())


def feet(x, a, b, da, db):
    """Return the positions (m,) of the feet of points ``x`` (m, n) on cubic curves from ``a`` to ``b`` (m, n) with the derivatives
    ``da``, ``db`` there, kept in [0, 1], the distances (m,), and what of these is along the curves (m,): behind an end."""
    chord, off = b - a, np.zeros(len(x))
    t = np.clip((np.einsum("ij,ij->i", x - a, chord) / np.einsum("ij,ij->i", chord, chord))[:, None], 0.0, 1.0)
    for last in (False,) * FEET + (True,):
        away = x - on_cubic(t, a, b, da, db)
        rate = 6.0 * t * (1.0 - t) * chord + (1.0 - t) * (1.0 - 3.0 * t) * da + t * (3.0 * t - 2.0) * db
        along, size = np.einsum("ij,ij->i", away, rate), np.einsum("ij,ij->i", rate, rate)
        off = np.abs(along) / np.sqrt(size)
        if not last:
            t = np.clip(t + (along / size)[:, None], 0.0, 1.0)
    return t[:, 0], np.linalg.norm(away, axis=1), off


def on_cubic(t, a, b, da, db):
    """Return the place at ``t`` of a cubic curve from ``a`` to ``b`` with the derivatives ``da``, ``db`` there."""
    return a + t * t * (3.0 - 2.0 * t) * (b - a) + t * (1.0 - t) * ((1.0 - t) * da - t * db)


def repeats(branch, arrays, row, start, t) -> bool:
    """Whether the equations of the stretch from row ``start`` to the next have the ``row`` as their solution beside the place ``t``
    of it; of equations that are not in the file the distance alone tells."""
    problem, offsets = branch.problems[int(arrays["part"][start])], arrays["offsets"]
    here, a, b = (slice(*offsets[k:k + 2]) for k in (row, start, start + 1))
    x, tangent, length = arrays["x"], arrays["tangent"], arrays["s"][start + 1] - arrays["s"][start]
    da, db = (length * problem.scale * tangent[end] for end in (a, b))
    place = on_cubic(t, x[a], x[b], da, db)
    plane = tangent[here]
    place = place + float((x[here] - place) / problem.scale @ plane) * problem.scale * plane  # the plane through the row
    try:
        c = problem.correct(place, plane)
    except NotImplementedError:
        return True
    except ERRORS:
        return False
    known = EQUAL * (1.0 + float(np.abs(x[here] / problem.scale).max()))
    return bool(c.converged and np.abs((c.x - x[here]) / problem.scale).max() <= known)
