"""Bracketed root of a scalar test along a curve, with an error that is measured: superlinear, then two close probes.

The bracketing iteration is Chandrupatla's (Chandrupatla 1997): inverse quadratic where the three points allow it,
bisection otherwise.  Probes at a tiny distance then give the slope and, by their distance from a line, the noise.
"""
import math
from dataclasses import dataclass
from typing import Any

PROBE = 1e-8  # distance of the probes, as part of the interval: curvature there is below rounding, noise is not
REPEATS = 3  # refinements, of which the first is enough unless the slope changes within 1e-8
UNEVEN = 1.4  # of the probe above to that below, so that noise that is periodic does not look straight
FLAT, STRAIGHT = 1e-2, 0.1  # longest Newton step to a corner, part of the interval; part of a difference that is off a line
SAFETY = 32.0  # of a noise that is known from four samples
SUPERLINEAR = 30  # evaluations before giving up
HALVINGS, NARROW, WIDE = 40, 1e-9, 1e-2  # of a bracket that cannot be polished: most, and width that is enough, or too much


@dataclass(slots=True)
class Root:
    """A root: position in the interval, point, interval with the sign change, error of the position, slope, noise and
    second difference of the parameter, and whether the value is at the level of the noise."""

    at: float
    point: Any
    low: float
    high: float
    error: float
    slope: float
    p_noise: float
    p_curve: float
    settled: bool


def enclose(f, a, fa, b, fb, guess=None):
    """Shrink a bracket until the test is 1e-9 of its values at the ends.

    Parameters
    ----------
    f : callable
        ``f(t) -> (value, point)`` or None where the curve cannot be computed.
    a, b, fa, fb : float
        Bracket and values of opposite sign (one may be zero).
    guess : float, optional
        First position to try, inside the bracket.

    Returns
    -------
    tuple (t, value, point) or None
        ``point`` is None if the root is an end of the bracket that was never evaluated here.
    """
    level = 1e-9 * max(abs(fa), abs(fb))
    best = (a, fa, None) if abs(fa) <= abs(fb) else (b, fb, None)
    if best[1] == 0.0:
        return best
    t = guess if guess is not None and a < guess < b else a + (b - a) * fa / (fa - fb)
    t = min(max(t, a + 1e-3 * (b - a)), b - 1e-3 * (b - a))
    for _ in range(SUPERLINEAR):
        made = f(t)
        if made is None:
            return None
        value, point = made
        if abs(value) <= abs(best[1]):
            best = (t, value, point)
        if abs(value) <= level:
            return best
        # keep (b, fb) on the other side of the new point, (c, fc) the point that drops out
        if (value > 0.0) == (fa > 0.0):
            c, fc = a, fa
            a, fa = t, value
        else:
            c, fc = b, fb
            b, fb = a, fa
            a, fa = t, value
        width = b - a
        if abs(width) <= 1e-12:
            return best
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb) if fc != fb else math.inf  # equal: a test at its floor
        if fc != fa and phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / width * fa / (fc - fa) * fb / (fc - fb)
        else:
            part = 0.5
        least = min(0.5, 1e-10 / abs(width))
        t = a + min(max(part, least), 1.0 - least) * width
    continuous = max(abs(fa), abs(fb)) <= 1e3 * level  # as a corner, on which few brackets shrink fast
    return best if continuous or abs(best[1]) <= 1e-6 * (abs(fa) + abs(fb)) else None


def bracketed(f, a, fa, b, fb):
    """Return the `Root` that halving a bracket leaves, where the test is too near to its rounding to be polished; or None.

    ``fa`` and ``fb`` have opposite signs.  The error is what is left of the bracket: its middle may have no point.
    """
    found = None
    for _ in range(HALVINGS):
        t = 0.5 * (a + b)
        made = f(t)
        if made is None:
            break
        if (made[0] > 0.0) == (fb > 0.0):
            b, fb = t, made[0]
        else:
            a, fa = t, made[0]
        found = t, made[1]
        if b - a < NARROW or made[0] == 0.0:
            break
    if found is None or b - a > WIDE:
        return None
    return Root(*found, a, b, b - a, (fb - fa) / (b - a), 0.0, 0.0, False)


def polish(f, t, value, point):
    """Refine a root known to about 1e-9 and measure its error; see `Root`.

    ``f`` as in `enclose`; ``point`` may be None and is then computed.  Returns None where the slope vanishes.
    """
    if point is None:
        made = f(t)
        if made is None:
            return None
        value, point = made
    for _ in range(REPEATS):
        step = probed(f, t, value, point)
        if step is None:
            return None
        (t, (value, point)), root = step
        if root.settled:
            break
    return root


def probed(f, t, value, point):
    """One refinement of `polish`; returns ``((t, (value, point)), Root)``, None where it fails.

    Where the test has a corner in its zero, that is known by the steep side alone: Newton steps on the
    flat one, or from beyond, lead to it.
    """
    probe, corrections = PROBE, REPEATS
    while True:
        below, above = f(t - probe), f(t + UNEVEN * probe)
        if below is None or above is None:
            return None
        slope = (above[0] - below[0]) / ((1.0 + UNEVEN) * probe)
        if slope == 0.0:
            return None
        shift = -value / slope
        if abs(shift) <= probe and (above[0] > 0.0) != (below[0] > 0.0):
            break
        straight = off_line((-1.0, 0.0, UNEVEN), (below[0], value, above[0])) <= STRAIGHT * abs(above[0] - below[0])
        if straight and corrections and abs(shift) <= FLAT:
            corrections -= 1
            nearer = f(t + shift)
            if nearer is not None and (abs(nearer[0]) <= STRAIGHT * abs(value) or (nearer[0] > 0.0) != (value > 0.0)):
                t, (value, point) = t + shift, nearer
                continue
        probe *= 10.0
        if probe > 1e-4:
            return None
    made = f(t + shift)
    if made is None:
        return None
    places = (-1.0, 0.0, shift / probe, UNEVEN)
    noise = off_line(places, (below[0], value, made[0], above[0]))
    p_noise = off_line(places, [float(q.x[-1]) for q in (below[1], point, made[1], above[1])])
    error = (abs(made[0]) + SAFETY * noise) / abs(slope) + 4e-16
    settled = abs(made[0]) <= 2.0 * noise and probe == PROBE
    root = Root(t + shift, made[1], t - probe, t + UNEVEN * probe, error, slope, SAFETY * p_noise, p_noise / probe**2,
                settled)
    return (t + shift, made), root


def off_line(places, values):
    """Largest distance of the values at ``places`` from the straight line that fits them best."""
    centre, middle = sum(places) / len(places), sum(values) / len(values)
    spread = sum((place - centre)**2 for place in places)
    slope = sum((place - centre) * value for place, value in zip(places, values, strict=True)) / spread
    return max(abs(value - middle - slope * (place - centre)) for place, value in zip(places, values, strict=True))
