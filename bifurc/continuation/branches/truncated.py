"""Changes of stability along balances that no special point explains: folds and multipliers of truncated equations differ.

The multipliers of a balance are those of its motion, and pass +1 where the motion has its fold; the branch turns where the balance
has its own.  Both are one point in the limit of many harmonics.  Rows between the two tell a stability that is not that of the
branch.
"""
import math
from dataclasses import replace

import numpy as np

from ...hbm.layout import Layout
from ..kinds import ERRORS
from ..resimulation import EDGE

FINER = (2, 4)  # times as many harmonics, that are tried
AROUND = 3  # rows on either side that are looked at: a fold of other equations is not between the same ones


def truncated(branch) -> tuple[tuple[float, float, int | None], ...]:
    """Return arclength intervals between two rows over which stability changes without a special point, and the highest harmonic
    with which it does no more: that many would decide; None: more than are tried."""
    if not any(problem.truncates for problem in branch.problems):
        return ()
    s, marks = branch.column("s"), np.array([point.s for point in branch.special_points])
    told = [(i, bool(stable)) for i, stable in enumerate(branch.column("stable")) if stable is not None]
    found = []
    for (a, before), (b, after) in zip(told[:-1], told[1:], strict=True):
        if before != after and not np.any((marks >= s[a] - EDGE) & (marks <= s[b] + EDGE)):
            found.append((float(s[a]), float(s[b]), deciding(branch, a, b)))
    return tuple(found)


def deciding(branch, a: int, b: int) -> int | None:
    """Return the highest harmonic of a finer balance whose stability changes about rows ``a`` to ``b`` only where it turns; None
    where none that is tried does."""
    rows = range(max(a - AROUND, 0), min(b + AROUND, len(branch) - 1) + 1)
    orbits, x = [branch.orbits[i] for i in rows], branch._arrays["parameter"][list(rows)]
    bounds = float(x.min() - np.ptp(x)), float(x.max() + np.ptp(x))
    for factor in FINER:
        layout = finer(orbits[0].layout, factor)
        method = replace(orbits[0].method, harmonics=tuple(k / layout.periods for k in layout.harmonics), condense=False)
        try:
            every = [stability_of(*pair) for pair in branch.problems[0].on_layout(method, layout, orbits, x, bounds)]
        except ERRORS:
            continue
        told = [one for one in every if one is not None]
        agree = all((one[0] != other[0]) == (one[1] * other[1] < 0.0) for one, other in zip(told[:-1], told[1:], strict=True))
        if agree and len(told) == len(every):
            return int(layout.top // layout.periods)
    return None


def finer(layout: Layout, factor: int) -> Layout:
    """Return a layout with the same kind of harmonics up to about ``factor`` times the highest."""
    positive = [k for k in layout.harmonics if k]
    step = math.gcd(*(k - positive[0] for k in positive)) or positive[0]
    more = range(positive[-1] + step, factor * (positive[-1] + step) - step + 1, step)
    return Layout((*layout.harmonics, *more), layout.n, layout.periods)


def stability_of(problem, c) -> tuple[bool, float] | None:
    """Return whether a corrected point is stable, and its dp/ds; None where either is not known."""
    stable = problem.measure("stable", c.x[None])[0] if c.converged else None
    return None if stable is None else (bool(stable), float(c.tangent[-1]))
