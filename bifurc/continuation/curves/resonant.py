"""Orbits of three and four periods near the strong resonances 1:3 and 1:4 of a curve of torus points, and where they change.

At the resonance the pair of multipliers is exp(+-2 pi i / k): k repetitions of the map are the identity to first order in the
plane of the pair, so that orbits of k periods branch off there, at amplitudes of the order of the square root of the distance (1:4)
or of the distance (1:3), in sectors that the coefficients of the normal form decide (Kuznetsov 2004, sections 9.5.3 and 9.5.4;
Krauskopf 1994).  Newton's method on k repetitions of the equations is started round circles of these sizes at points on either side
of the torus curve, and what it finds is traced.
"""
import numpy as np

from ..kinds import NUMERICAL, LocationStatus, SpecialPointKind
from ..switched import Switched
from ..tracing import trace
from .codimension_two import pencil_at

PERIODS = {SpecialPointKind.RESONANCE_1_3: 3, SpecialPointKind.RESONANCE_1_4: 4}
KINDS = (SpecialPointKind.FOLD, SpecialPointKind.PERIOD_DOUBLING, SpecialPointKind.NEIMARK_SACKER)
ASIDE = (1e-2, 3e-2)  # distances from the resonance in the second parameter, scaled
ACROSS = (0.0, 0.3, -0.3, 1.0, -1.0, 3.0, -3.0)  # and from the torus curve in the first one, in those units
SIZES = (0.3, 1.0, 3.0)  # of the circle, in units of sqrt(distance) or distance
PLACES = 6  # of starts, on the part of the circle that repeats itself
APART = 0.1  # least distance of the repetitions of a solution, as part of the circle
WIDE = 40.0  # distances in the first parameter over which what is found is traced
STEPS = 200
SAME = 1e-8  # scaled difference of special points that are the same


def of_periods(curve, point):
    """Return special points on the branches of orbits of k periods beside a resonance 1:k of ``curve``, or, where these have none,
    the orbits."""
    times = PERIODS[point.kind]
    orbits, points = [], []
    for sign in (1.0, -1.0):
        for distance, c in curve.aside(point, sign, ASIDE):
            found = first(curve, c.x, times, distance)
            if found is None:
                continue
            orbit, a = found
            orbits.append(orbit)
            points += changes(curve, orbit, a, WIDE * distance * float(curve.scale[-2]))
            break
    if points:
        return Switched(points, f"{len(points)} points on branches of orbits of {times} periods")
    if orbits:
        return Switched(orbits, f"no curve leaves: orbits of {times} periods neither fold nor double nor become tori near here")
    return Switched((), f"no orbit of {times} periods was found near here")


def first(curve, x, times, distance):
    """Return (orbit, its first parameter) of ``times`` periods near the point ``x`` (n + 2,) of a curve of tori, or None."""
    problem, a = curve.family.alone(float(x[-1])), float(x[-2])
    row = np.zeros(x.size - 1)
    row[-1] = 1.0
    for across in ACROSS:
        at = x[:-1].copy()
        at[-1] = a + across * distance * float(curve.scale[-2])
        if not curve.bounds_a[0] <= at[-1] <= curve.bounds_a[1]:
            continue
        c = problem.correct(at, row, True)
        orbit = multiplied(problem, c.x, times, distance) if c.converged else None
        if orbit is not None:
            return orbit, float(at[-1])
    return None


def multiplied(problem, x, times, distance):
    """Return an orbit of ``times`` periods, not of one, near that of one period at ``x`` (n + 1,), or None."""
    mu = np.exp(2j * np.pi / times)
    v = np.linalg.svd(pencil_at(problem, x, mu)[0])[2][-1].conj()
    wide, start = problem.repeated(x, times)
    row = np.zeros(start.size)
    row[-1] = 1.0
    for size in SIZES:
        radius = size * (distance if times == 3 else np.sqrt(distance))
        for k in range(PLACES):
            turn = np.exp(2j * np.pi * k / (times * PLACES))
            circle = np.concatenate([np.real(radius * turn * mu**j * v) for j in range(times)])
            c = wide.correct(start + np.append(circle, 0.0) * wide.scale, row, True)
            if not c.converged:
                continue
            moved = ((c.x - start) / wide.scale)[:-1].reshape(times, -1)
            if APART * radius < np.abs(moved - moved[0]).max() and np.abs(moved).max() < 10.0 * radius:
                orbit = wide.solution(c.x)
                if orbit.success:
                    return orbit
    return None


def changes(curve, orbit, a, width):
    """Return the folds, flips and torus points of the branch of an orbit within ``width`` of the first parameter ``a``."""
    bounds = (max(curve.bounds_a[0], a - width), min(curve.bounds_a[1], a + width))
    try:
        branch = trace(orbit, curve.base_parameter, bounds=bounds, max_steps=STEPS)
    except NUMERICAL:  # the orbit is on no branch within these bounds
        return []
    found = []
    for point in branch.special_points:
        if point.kind in KINDS and not point.name and point.status is LocationStatus.LOCATED and not any(
                point.kind is other.kind and abs(point.parameter - other.parameter) <= SAME * width for other in found):
            found.append(point)
    return found
