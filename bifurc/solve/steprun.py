"""Many steps of a branch in one compiled call: where the next point is foretold, and whether nothing lies in a step.

The rules are those of `steplaw`; what a step is looked at for is what `continuation.steps` looks at, so that a step in which
nothing lies is accepted there too.  Kernels of problems that make steps themselves (`Problem.follow`) share these functions.
"""
import math

import numpy as np

from .._jit import inlined, leaf
from .steplaw import (
    ASIDE,
    CLEAR,
    CREDIBLE,
    JUMPS,
    MANY,
    MONITOR_BAND,
    NEARLY_SINGULAR,
    SLOPE_BAND,
    STRAIGHT,
    arc_length,
    crosses,
    doubtful,
    judged,
    next_length,
    two_folds,
    two_zeros,
)

# places in the `run` array: length of the step and its limit, bounds of the parameter and the place at which a closed branch ends,
# the angle by which it has turned since then, angle of corners, bend of the last step, its length, and the determinants at the last
# two rows; steps made
(LENGTH, MOST, LOW, HIGH, ORIGIN, TURN, CORNER, BEND, BACK, LOG_BEFORE, SIGN_BEFORE, LOG, SIGN, MADE, RUN) = range(15)
# rows of `tests`: last two values, last clear sign, largest size, largest value at which a boundary counts as zero (-1: none)
EARLIER, LATEST, CLEARLY, SIZE, TOUCHED, TESTS = range(6)
# numbers behind point, tangent and tests in a row: length, angle and misfit of the step, length of the next, iterations, residual,
# sign and logarithm of the determinant
TOLD = 8
ON_BOUND = 8.0 * float(np.finfo(float).eps)  # of an arclength: scaled distance of the parameter from a bound that is none
BEYOND, LAST_ROW = 2, 3  # status of a run: the next step leaves the bounds; all rows are filled


def run_of(before, row, ds, limits, origin, corner) -> np.ndarray:
    """Return the ``run`` array of a run that begins behind two rows; arguments as of `Problem.follow`.

    A first row is its own row before, infinitely far back: what is looked for through three rows is nowhere then.  What comes so
    near to a bound that it lies on it, to rounding, is left to the single step.
    """
    room = ON_BOUND * (1.0 + row.s) * float(row.part.scale[-1])
    back = math.inf if before is row else row.s - before.s
    return np.array([ds, limits.ds_max, limits.low + room, limits.high - room, origin, row.turn, corner, row.bend, back,
                     before.det_log, before.det_sign, row.det_log, row.det_sign, 0.0])


@leaf
def foretold(past, last, old, scales, lengths, ahead, predicted, guess):
    """Write the end of the tangent at ``last`` into ``predicted`` (n + 1,), and into ``guess`` where the branch may be.

    The guess is the polynomial through the last points with their tangents, in the plane orthogonal to the tangent a length
    ``ahead``: of two points the cubic, of three that of fifth degree; of one it is the end of the tangent.

    Parameters
    ----------
    past : ndarray (4, n + 1)
        Point and tangent of the row before ``last``, whose tangent is ``old``, and of the one before that.
    lengths : ndarray (2,)
        Lengths of the last two steps; the second is 0 where only two points are known, both where it is one.
    """
    b, c = lengths[0], lengths[1]
    if b == 0.0:
        for j in range(last.size):
            predicted[j] = last[j] + ahead * (scales[j] * old[j])
            guess[j] = predicted[j]
        return
    s, rest = ahead, 0.0
    for turn in range(2):  # where the polynomial has come ahead: the parts of its terms along the tangent
        one, two = s * s, s * s * (s + b)
        three, four = two * (s + b), two * (s + b) * (s + b + c)
        along = s
        for j in range(last.size):
            A, E, G, H = differences(past, last, old, scales, b, c, j)
            along += old[j] * (one * A + two * E + three * G + four * H)
        rest = ahead - along
        if turn == 0:
            s += rest
    one, two = s * s, s * s * (s + b)
    three, four = two * (s + b), two * (s + b) * (s + b + c)
    for j in range(last.size):
        A, E, G, H = differences(past, last, old, scales, b, c, j)
        predicted[j] = last[j] + ahead * (scales[j] * old[j])
        guess[j] = last[j] + scales[j] * ((s + rest) * old[j] + one * A + two * E + three * G + four * H)


@leaf
def differences(past, last, old, scales, b, c, j):
    """Return divided differences of unknown ``j``, of second to fifth order, over the points of `foretold`, each counted twice."""
    chord, tangent = (last[j] - past[0, j]) / (scales[j] * b), past[1, j]
    A, B = (old[j] - chord) / b, (chord - tangent) / b
    E = (A - B) / b
    if c == 0.0:
        return A, E, 0.0, 0.0
    chord = (past[0, j] - past[2, j]) / (scales[j] * c)
    C, D = (tangent - chord) / c, (chord - past[3, j]) / c
    F = (B - C) / (b + c)
    G = (E - F) / (b + c)
    return A, E, G, (G - (F - (C - D) / c) / (b + c)) / (b + c)


@leaf
def remembered(past, lengths, last, old, length):
    """Note that ``last`` and its tangent ``old`` (n + 1,) are those of the row before now, a ``length`` back; see `foretold`."""
    for j in range(last.size):
        past[2, j], past[3, j] = past[0, j], past[1, j]
        past[0, j], past[1, j] = last[j], old[j]
    lengths[1], lengths[0] = lengths[0], length


@leaf
def between(last, old, point, tangent, scales, length, middle, direction):
    """Write the middle of the cubic between two points with their tangents, and its unit tangent there (n + 1,)."""
    size = 0.0
    for j in range(last.size):
        chord = (point[j] - last[j]) / scales[j]
        middle[j] = last[j] + scales[j] * (0.5 * chord + 0.125 * length * (old[j] - tangent[j]))
        direction[j] = 1.5 * chord - 0.25 * length * (old[j] + tangent[j])
        size += direction[j]**2
    size = math.sqrt(size)
    for j in range(last.size):
        direction[j] /= size


@leaf
def aside(middle, point, scales, length, corner):
    """Return whether the ``middle`` of a step and the solution that was found from there are so far apart that the step jumps."""
    distance = 0.0
    for j in range(point.size):
        distance += ((point[j] - middle[j]) / scales[j])**2
    return not math.sqrt(distance) <= (ASIDE + 0.25 * corner) * length


@leaf
def beside(hermite, t, miss, scales, place, guess, tangent):
    """Write the ``place`` at ``t`` of a cubic curve, its unit tangent, and a ``guess`` where the branch is beside it (n + 1,).

    ``hermite`` (4, n + 1) are start and chord of the curve, and its derivatives at both ends, own units; ``miss`` (n + 1,) is how
    far the last point was from the curve, scaled: the next one misses it by nearly the same.
    """
    size, along = 0.0, 0.0
    for j in range(place.size):
        start, chord, one, two = hermite[0, j], hermite[1, j], hermite[2, j], hermite[3, j]
        place[j] = start + t * t * (3.0 - 2.0 * t) * chord + t * (1.0 - t) * ((1.0 - t) * one - t * two)
        tangent[j] = (6.0 * t * (1.0 - t) * chord + (1.0 - t) * (1.0 - 3.0 * t) * one + t * (3.0 * t - 2.0) * two) / scales[j]
        size += tangent[j]**2
    size = math.sqrt(size)
    for j in range(place.size):
        tangent[j] /= size
        along += tangent[j] * miss[j]
    for j in range(place.size):
        guess[j] = place[j] + scales[j] * (miss[j] - along * tangent[j])


@inlined
def looked_at(last, old, point, predicted, tangent, scales, values, iterations, sign, log, run, tests):
    """Return length, angle and misfit of the step from ``last`` to ``point``; length 0: something in it needs a look; negative: its
    middle does, see `between`.

    ``old`` and ``tangent`` are the tangents there (n + 1,), ``values`` (k,) the tests at the point, the first of them dp/ds.
    """
    n, count, ds = point.size - 1, values.size, run[LENGTH]
    none = 0.0, 0.0, 0.0
    if iterations > MANY or not run[LOW] < point[n] < run[HIGH] or sign != run[SIGN] or log < run[LOG] - NEARLY_SINGULAR:
        return none
    cosine, distance = 0.0, 0.0
    for j in range(n + 1):
        cosine += old[j] * tangent[j]
        distance += ((point[j] - predicted[j]) / scales[j])**2
    distance = math.sqrt(distance)
    verdict, angle, misfit = judged(cosine, ds, distance, False)
    length = arc_length(math.hypot(ds, distance), angle)
    if verdict != CREDIBLE or run[TURN] >= STRAIGHT and abs(run[ORIGIN] - last[n]) <= 1.1 * length * scales[n]:
        return none
    for j in range(count):
        value = values[j]
        band = SLOPE_BAND if j == 0 else MONITOR_BAND * max(tests[SIZE, j], abs(value))
        touch = tests[TOUCHED, j]
        if not np.isfinite(value) or (value > min(band, touch) if touch >= 0.0 else crosses(value, tests[CLEARLY, j], band)):
            return none
        if j > 0 and two_zeros(tests[EARLIER, j], tests[LATEST, j], value, run[BACK], length) != 2.0:
            return none
    if two_folds(tests[LATEST, 0], values[0], (point[n] - last[n]) / (scales[n] * length)) > 0.0:
        return none
    a, b = math.exp(min(run[LOG] - run[LOG_BEFORE], 50.0)), math.exp(min(log - run[LOG_BEFORE], 50.0))
    falls = run[LOG] < run[LOG_BEFORE] or run[LOG] < log
    if falls and two_zeros(run[SIGN_BEFORE], run[SIGN] * a, sign * b, run[BACK], length) != 2.0:
        return none
    doubt = doubtful(misfit, run[CORNER], a, b, run[BACK], length, True)
    if doubt == JUMPS:
        return none
    return length if doubt == CLEAR else -length, angle, misfit


@leaf
def taken(point, tangent, values, step, correction, run, tests, row):
    """Write a step in which nothing lies into ``row``, and go on to its end.

    ``step`` is its length, angle and misfit, ``correction`` the iterations, the residual, sign and logarithm of the determinant.
    """
    length, angle, misfit = step
    iterations, residual, sign, log = correction
    n, count = point.size - 1, values.size
    for j in range(count):
        value, size = values[j], abs(values[j])
        tests[EARLIER, j], tests[LATEST, j] = tests[LATEST, j], value
        tests[SIZE, j] = max(tests[SIZE, j], size)
        if size > (SLOPE_BAND if j == 0 else MONITOR_BAND * tests[SIZE, j]):
            tests[CLEARLY, j] = 1.0 if value > 0.0 else -1.0
        row[2 * (n + 1) + j] = value
    bend = angle / length
    run[TURN] += angle
    run[LENGTH] = next_length(run[LENGTH], bend, run[BEND], int(iterations), run[MOST])
    run[BEND], run[BACK] = bend, length
    run[LOG_BEFORE], run[SIGN_BEFORE], run[LOG], run[SIGN] = run[LOG], run[SIGN], log, sign
    for j in range(n + 1):
        row[j], row[n + 1 + j] = point[j], tangent[j]
    told = row[2 * (n + 1) + count:]
    told[0], told[1], told[2], told[3], told[4] = length, angle, misfit, run[LENGTH], iterations
    told[5], told[6], told[7] = residual, sign, log
