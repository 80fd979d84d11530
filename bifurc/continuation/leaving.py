"""Curves that leave a codimension-2 point of a curve of special points: where they start, as points that `trace_curve` takes."""
from dataclasses import replace

import numpy as np

from .kinds import ContinuationError, LocationStatus, SpecialPointKind
from .shooting.appearing import inserted
from .shooting.branching import stepped_out
from .shooting.signature_change import admissible_side
from .tracing import trace

ASIDE = (1e-2, 3e-3, 3e-2)  # distances in the second parameter, scaled, at which curves of other orbits are met
K = SpecialPointKind
SAME_ORBIT = {(K.FOLD, K.FOLD_FLIP): K.PERIOD_DOUBLING, (K.PERIOD_DOUBLING, K.FOLD_FLIP): K.FOLD,
              (K.FOLD, K.RESONANCE_1_1): K.NEIMARK_SACKER, (K.NEIMARK_SACKER, K.RESONANCE_1_1): K.FOLD,
              (K.PERIOD_DOUBLING, K.RESONANCE_1_2): K.NEIMARK_SACKER,
              (K.NEIMARK_SACKER, K.RESONANCE_1_2): K.PERIOD_DOUBLING}


def curves_from(curve, point, n_max: int):
    """Return special points on the curves that leave a point of ``curve`` (a `CurveProblem`); None where none are known.

    Curves of the same orbit (at fold-flips and resonances 1:1 and 1:2) start at the point itself; those of other orbits (folds
    and flips of orbits with one impact in n periods at a resonant grazing, folds of doubled orbits at a generalised flip) at
    points a little aside, on whichever side they are.
    """
    other = SAME_ORBIT.get((curve.kind, point.kind))
    b = float(point.x[-1])
    if other is not None:
        problem = curve.family.alone(b)
        known = [monitor for monitor in problem.monitors if monitor.kind == other]
        if other is not K.FOLD and not known:
            return ()
        return (at(problem, point, other, point.x[:-1]),)
    if point.kind is K.RESONANT_GRAZING and point.name.startswith("s_"):
        periods = int(point.name[2:])

        def born(problem, x):
            return impacting(problem, x, periods)
        return beside(curve, point, born, (K.FOLD, K.PERIOD_DOUBLING)) if periods <= n_max else ()
    if point.kind is K.GENERALIZED_FLIP:
        def doubled(problem, x):
            return problem.branches(at(problem, point, K.PERIOD_DOUBLING, x), n_max)
        return beside(curve, point, doubled, (K.FOLD,))
    return None


def at(problem, point, kind, x):
    """Return a special point of ``kind`` at ``x`` (n + 1,) of a problem in one parameter."""
    return replace(point, kind=kind, name="", problem=problem, successor=None, x=np.array(x), parameter=float(x[-1]),
                   tangent=np.append(np.zeros(x.size - 1), 1.0), before=problem.signature, after=problem.signature,
                   directions=None, reverses=False)


def impacting(problem, x, periods):
    """Return the orbit with one impact in some periods that is born at a grazing at ``x`` (n + 1,), as a one-tuple or empty."""
    found = inserted(problem, x, periods)
    if found is None:
        return ()
    new = problem.with_sequence(*found)
    side = admissible_side(new, new.x0)
    orbit = None if side is None else stepped_out(new, new.x0, side * new.scale)
    return () if orbit is None else (orbit,)


def beside(curve, point, starts, kinds):
    """Return the points of some kinds nearest to the point on branches of the orbits that ``starts`` gives a little aside of it."""
    a = curve.base_parameter
    row = np.zeros(point.x.size)
    row[-1] = 1.0
    found = []
    for sign in (1.0, -1.0):
        for distance in ASIDE:
            x = point.x + sign * distance * curve.scale[-1] * row
            if not curve.family.interval[0] <= x[-1] <= curve.family.interval[1]:
                continue
            c = curve.correct(x, row, True)
            if not c.converged:
                continue
            problem = curve.family.alone(float(c.x[-1]))
            here = []
            for start in starts(problem, c.x[:-1]) or ():
                width = 40.0 * distance * curve.scale[-2]
                bounds = (max(curve.bounds_a[0], c.x[-2] - width), min(curve.bounds_a[1], c.x[-2] + width))
                try:
                    branch = trace(start, a, bounds=bounds, ds=0.1 * distance, max_steps=200)
                except (ContinuationError, ValueError):  # not on a branch within these bounds
                    continue
                points = [p for p in branch.special_points if p.kind in kinds and not p.name
                          and p.status is LocationStatus.LOCATED]
                here += sorted(points, key=lambda p: abs(p.parameter - c.x[-2]))[:1]
            if here:
                found += here
                break
    return tuple(found)
