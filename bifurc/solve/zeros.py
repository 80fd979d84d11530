"""The zero of a scalar test along a curve: which places to ask next, and what their values say.

The bracketing iteration is Chandrupatla's (Chandrupatla 1997): inverse quadratic where the three points allow it,
bisection otherwise.  Probes at a tiny distance then give the slope and, by their distance from a line, the noise.

Both searches are generators of places: whoever goes through one writes the value of the test, and the parameter, at the place that
he was given into ``box`` before he asks for the next.  The same text serves curves in Python (`py_func`) and compiled ones
(`orbits.shooting.sequence.locate`).
"""
import numba
import numpy as np

from .._jit import njit

PROBE = 1e-8  # distance of the probes, as part of the interval: curvature there is below rounding, noise is not
FARTHEST = 1e-4  # of the probes
REPEATS = 3  # refinements, of which the first is enough unless the slope changes within 1e-8
UNEVEN = 1.4  # of the probe above to that below, so that noise that is periodic does not look straight
FLAT, STRAIGHT = 1e-2, 0.1  # longest Newton step to a corner, part of the interval; part of a difference that is off a line
SAFETY = 32.0  # of a noise that is known from four samples
SUPERLINEAR = 30  # evaluations before giving up
ROUNDING = 1e-6  # of the values at the ends, below which one is rounding
LEVEL = 1e-9  # of the values at the ends of a bracket, at which it is shrunk enough
# places in a `box`: what the caller answers, value and parameter; then the best place so far with both, and whether it was asked;
# whether the search came to its end; of the zero the interval with the sign change, error of its place, slope, noise and second
# difference of the parameter, and whether the value is at the level of the noise; whether the place asked may have no point: the
# value is then NaN
(VALUE, PARAMETER, AT, LEAST, THERE, ASKED, DONE, LOW, HIGH, ERROR, SLOPE, P_NOISE, P_CURVE, SETTLED, TRIED, BOX) = range(16)
generator = numba.njit(error_model="numpy", nogil=True)  # kept on disk in its callers: numba loads no generator for a new one


@generator
def enclosing(box, a, fa, b, fb, guess):
    """Yield places that shrink a bracket until the test is `LEVEL` of its values at the ends.

    Parameters
    ----------
    box : ndarray (BOX,)
    a, b, fa, fb : float
        Bracket and values of opposite sign (one may be zero).
    guess : float
        First place to try, where it lies inside the bracket.
    """
    level = LEVEL * max(abs(fa), abs(fb))
    box[ASKED], box[DONE] = 0.0, 1.0
    if abs(fa) <= abs(fb):
        box[AT], box[LEAST] = a, fa
    else:
        box[AT], box[LEAST] = b, fb
    if box[LEAST] == 0.0:
        return
    if (fa > 0.0) == (fb > 0.0):  # nothing is enclosed: the end that is zero but for rounding is all there is
        box[DONE] = 1.0 if abs(box[LEAST]) <= ROUNDING * (abs(fa) + abs(fb)) else 0.0
        return
    t = guess if a < guess < b else a + (b - a) * fa / (fa - fb)
    t = min(max(t, a + 1e-3 * (b - a)), b - 1e-3 * (b - a))
    pa = pb = np.nan
    for _ in range(SUPERLINEAR):
        yield t
        value = box[VALUE]
        # keep (b, fb) on the other side of the new point, (c, fc) the point that drops out
        if (value > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc = b, fb
            b, fb, pb = a, fa, pa
        a, fa, pa = t, value, box[PARAMETER]
        # of the two that enclose it: what has dropped out may be small where the test is near zero for another reason
        if abs(fa) <= abs(fb):
            box[AT], box[LEAST], box[THERE], box[ASKED] = a, fa, pa, 1.0
        else:
            box[AT], box[LEAST], box[THERE], box[ASKED] = b, fb, pb, 1.0 if pb == pb else 0.0
        if abs(value) <= level:
            return
        width = b - a
        if abs(width) <= 1e-12:
            return
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb) if fc != fb else np.inf  # equal: a test at its floor
        if fc != fa and phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / width * fa / (fc - fa) * fb / (fc - fb)
        else:
            part = 0.5
        least = min(0.5, 1e-10 / abs(width))
        t = a + min(max(part, least), 1.0 - least) * width
    continuous = max(abs(fa), abs(fb)) <= 1e3 * level  # as a corner, on which few brackets shrink fast
    box[DONE] = 1.0 if continuous or abs(box[LEAST]) <= ROUNDING * (abs(fa) + abs(fb)) else 0.0


@generator
def polishing(box):
    """Yield places that refine a zero known to about 1e-9, the best of ``box``, and measure its error; the last is the zero.

    `DONE` is 0 where the slope vanishes.  Where the test has a corner in its zero, that is known by the steep side alone: Newton
    steps on the flat one, or from beyond, lead to it.
    """
    box[DONE], box[TRIED] = 0.0, 0.0
    if box[ASKED] == 0.0:
        yield box[AT]
        box[LEAST], box[THERE] = box[VALUE], box[PARAMETER]
    for _ in range(REPEATS):
        box[DONE] = 0.0
        t, value, there = box[AT], box[LEAST], box[THERE]
        probe, corrections = PROBE, REPEATS
        while True:
            yield t - probe
            below, p_below = box[VALUE], box[PARAMETER]
            yield t + UNEVEN * probe
            above, p_above = box[VALUE], box[PARAMETER]
            slope = (above - below) / ((1.0 + UNEVEN) * probe)
            if slope == 0.0:  # as of a test that is little more than its rounding
                probe *= 10.0
                if probe > FARTHEST:
                    return
                continue
            shift = -value / slope
            if abs(shift) <= probe and (above > 0.0) != (below > 0.0):
                break
            straight = off_line((-1.0, 0.0, UNEVEN), (below, value, above)) <= STRAIGHT * abs(above - below)
            if straight and corrections > 0 and abs(shift) <= FLAT:
                corrections -= 1
                box[TRIED] = 1.0
                yield t + shift
                box[TRIED] = 0.0
                if abs(box[VALUE]) <= STRAIGHT * abs(value) or box[VALUE] * value < 0.0:
                    t, value, there = t + shift, box[VALUE], box[PARAMETER]
                    continue
            probe *= 10.0
            if probe > FARTHEST:
                return
        yield t + shift
        made, p_made = box[VALUE], box[PARAMETER]
        places = (-1.0, 0.0, shift / probe, UNEVEN)
        noise = off_line(places, (below, value, made, above))
        p_noise = off_line(places, (p_below, there, p_made, p_above))
        box[AT], box[LEAST], box[THERE], box[ASKED], box[DONE] = t + shift, made, p_made, 1.0, 1.0
        box[LOW], box[HIGH] = t - probe, t + UNEVEN * probe
        box[ERROR] = (abs(made) + SAFETY * noise) / abs(slope) + 4e-16
        box[SLOPE], box[P_NOISE], box[P_CURVE] = slope, SAFETY * p_noise, p_noise / probe**2
        box[SETTLED] = 1.0 if abs(made) <= 2.0 * noise and probe == PROBE else 0.0
        if box[SETTLED] > 0.0:
            return


@njit
def off_line(places, values):
    """Largest distance of the values at ``places`` from the straight line that fits them best; both tuples of floats."""
    count = len(places)
    centre, middle = 0.0, 0.0
    for k in range(count):
        centre += places[k]
        middle += values[k]
    centre, middle = centre / count, middle / count
    spread, slope = 0.0, 0.0
    for k in range(count):
        spread += (places[k] - centre)**2
        slope += (places[k] - centre) * values[k]
    slope /= spread
    worst = 0.0
    for k in range(count):
        worst = max(worst, abs(values[k] - middle - slope * (places[k] - centre)))
    return worst
