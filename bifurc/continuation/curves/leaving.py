"""Curves that leave a codimension-2 point of a curve of special points: where they start, as points that `trace_curve` takes."""
import copy
from dataclasses import replace

import numpy as np

from ..grazing.following import Touching
from ..grazing.touch import every_touch
from ..kinds import ContinuationError, LocationStatus, SpecialPointKind
from ..shooting.appearing import inserted
from ..shooting.branching import stepped_out
from ..shooting.signature_change import admissible_side
from ..switched import Switched
from ..tracing import trace
from .resonant import PERIODS, of_periods

ASIDE = (1e-2, 3e-3, 3e-2)  # distances in the second parameter, scaled, at which curves of other orbits are met
K = SpecialPointKind
SAME_ORBIT = {(K.FOLD, K.FOLD_FLIP): K.PERIOD_DOUBLING, (K.PERIOD_DOUBLING, K.FOLD_FLIP): K.FOLD,
              (K.FOLD, K.RESONANCE_1_1): K.NEIMARK_SACKER, (K.NEIMARK_SACKER, K.RESONANCE_1_1): K.FOLD,
              (K.PERIOD_DOUBLING, K.RESONANCE_1_2): K.NEIMARK_SACKER,
              (K.NEIMARK_SACKER, K.RESONANCE_1_2): K.PERIOD_DOUBLING}
CHANGES = (K.GRAZING, K.STICK_ONSET, K.SLIP_ONSET, K.SEPARATION, K.CHATTER_COMPLETION)  # that end a followed orbit
SAME_TOP = 1e-6  # periods
NO_CURVE = {
    K.CUSP: "two parts of this curve meet in a cusp: no other curve of folds, flips or tori leaves it",
    K.DEGENERATE_GRAZING: "the touch is flat here: beyond, two tops touch at once or none does, and no curve goes on",
}


def curves_from(curve, point, n_max: int):
    """Return special points on the curves that leave a point of ``curve`` (a `CurveProblem`); None where none are known.

    Curves of the same orbit (at fold-flips, resonances 1:1 and 1:2, grazings of an orbit with a multiplier 1 or -1, and where a
    followed orbit ends at a grazing or another change of its events) start at the point itself; those of other orbits (folds and
    flips of orbits with one impact in n periods at a resonant grazing, folds of doubled orbits at a generalised flip) and of
    another touch of the same orbit (at a double grazing) at points a little aside, on whichever side they are; so do those of
    orbits of three and four periods at the resonances 1:3 and 1:4 (see `resonant`).
    """
    b = float(point.x[-1])
    other = SAME_ORBIT.get((curve.kind, point.kind))
    if point.kind is K.RESONANT_GRAZING and not point.name.startswith("s_"):
        flip = curve.family.problem.monitors[0].kind  # period doubling, or the breaking of a symmetry
        other = K.FOLD if point.name == "fold" else flip
    if other is not None:
        problem = curve.family.alone(b)
        known = [monitor for monitor in problem.monitors if monitor.kind == other]
        if other is not K.FOLD and not known:
            return ()
        return (at(problem, point, other, point.x[:-1]),)
    if point.kind in CHANGES and point.kind is not curve.kind:
        return (replace(at(curve.family.alone(b), point, point.kind, point.x[:-1]), name=point.name),)
    if point.kind is K.RESONANT_GRAZING:
        periods = int(point.name[2:])

        def born(problem, x):
            return impacting(problem, x, periods)
        if periods > n_max:
            return Switched((), f"curves of orbits with one impact in {periods} periods leave here: give n_max = {periods}")
        found = beside(curve, point, born, (K.FOLD, K.PERIOD_DOUBLING))
        return found if found or passes(curve, point, periods) else Switched((), (
            f"no motion has one impact in {periods} periods near here: its orbit would go through the stop in between"))
    if point.kind is K.DOUBLE_GRAZING:
        return other_touches(curve, point)
    if point.kind in PERIODS and curve.family.problem.wraps:
        return of_periods(curve, point)
    if point.kind is K.GENERALIZED_FLIP:
        def doubled(problem, x):
            return problem.branches(at(problem, point, K.PERIOD_DOUBLING, x), n_max)
        return beside(curve, point, doubled, (K.FOLD,))
    return Switched((), NO_CURVE[point.kind]) if point.kind in NO_CURVE else None


def passes(curve, point, periods: int) -> bool:
    """Whether the orbit with one impact in some periods that is born near a resonant grazing stays inside in between.

    In the period k behind its impact its apex lies below the stop by a positive multiple of h (I - E^n)^-1 E^k B.
    """
    problem, x = curve.family.alone(float(point.x[-1])), point.x[:-1]
    _, _, (E, h, B) = curve.condition.linear_map(problem, x, curve.condition.top(problem, x)[1])
    left = np.linalg.solve((np.eye(len(h)) - np.linalg.matrix_power(E, periods)).T, h)
    return all(left @ np.linalg.matrix_power(E, k) @ B > 0.0 for k in range(1, periods))


def other_touches(curve, point):
    """Return grazings on the curves of the other tops that touch at a double grazing, each on the side where it touches first."""
    problem, b = curve.family.alone(float(point.x[-1])), float(point.x[-1])
    followed = curve.condition.top(problem, point.x[:-1])[1]
    span = problem.sequence.span
    found = []
    for item in every_touch(problem, point.x[:-1]):
        if abs((item[0] - followed + 0.5 * span) % span - 0.5 * span) <= SAME_TOP:
            continue
        other = copy.copy(curve)
        for sign in (1.0, -1.0):
            other.condition = Touching(curve.family.problem, point.x[:-1], item)
            _, c = next(other.aside(point, sign, ASIDE[:1]), (None, None))
            if c is not None and other.condition.values(other.family.at(float(c.x[-1])), c.x[:-1])[1] < 0.0:
                beside = replace(at(other.family.alone(float(c.x[-1])), point, K.GRAZING, c.x[:-1]), name="unlisted")
                found.append(beside)
                break
    return tuple(found) if found else Switched((), f"no other top touches first on either side of {curve.parameter} = {b:.12g}")


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
    found = []
    for sign in (1.0, -1.0):
        for distance, c in curve.aside(point, sign, ASIDE):
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
