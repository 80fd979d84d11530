"""Largest maximum of a guard along a segment of an affine mode: how near a motion comes to an event it does not have."""
import numpy as np

from ..._jit import PAIR, apart, njit
from ...compose.tables import ORDER
from .engine import guard_series, propagate
from .polynomial import EPS, highest

NOISE = 4.0 * EPS  # of the sum of its terms: a smaller rate is zero
RISEN = 1e-3  # of what a guard has fallen: a rate at the end that makes less of it in the whole segment is that of a minimum


@njit
def zeros(T, m, g, x, low):
    """Return how many coefficients of the series of guard ``g`` from ``x`` (nx,) are zero, where it has a zero of order ``low``.

    One more than ``low`` where the rate behind the zero is smaller than the rounding of its terms, as where a mass that turns
    round begins to rest: what such a rate makes of the guard is no maximum.
    """
    if not 0 < low < ORDER:
        return low
    rate, terms = 0.0, 0.0
    for c in range(x.size):
        rate += T.GT[m, g, c, low] * x[c]
        terms += abs(T.GT[m, g, c, low] * x[c])
    return low + 1 if abs(rate) <= NOISE * terms else low


@apart(PAIR, python=True)
def segment_peak(T, m, g, x, s, closing, low):
    """Largest interior maximum (value, time) of guard ``g`` on a segment of duration ``s`` from ``x`` (nx,), at the start of
    which it has a zero of order ``low``.

    A step whose Bernstein bound (cubic Hermite and its error) stays below the best value found is skipped.  The end
    value counts unless the guard is the one that ``closing`` (1) says ends the segment, or has its largest value, zero, at the
    start and has not risen since: behind a rebound of next to no speed that is the rounding of zero, and where friction turns
    at the farthest point of a flight its depth, with a rate whose sign is rounding.
    """
    G, GT, G4, step = T.G, T.GT, T.G4, T.step
    nx = x.size
    now, after = x.copy(), np.empty(nx)
    a, out, stack = np.empty(ORDER + 1), np.empty(3), np.empty(64)
    best, where, t, rising = -np.inf, 0.0, 0.0, False
    value, slope = 0.0, 0.0
    for c in range(nx):
        value += G[m, g, c] * x[c]
        slope += GT[m, g, c, 1] * x[c]
    if low > 0:
        value = 0.0
    known = zeros(T, m, g, x, low)
    if known > 1:
        slope = 0.0
    while t < s:
        h = min(step[m], s - t)
        propagate(T, m, now, h, after)
        value1, slope1, e = 0.0, 0.0, 0.0
        for c in range(nx):
            value1 += G[m, g, c] * after[c]
            slope1 += GT[m, g, c, 1] * after[c]
            e += G4[m, g, c] * abs(now[c])
        if rising and slope <= 0.0 and value > best:  # a maximum on the border of two steps
            best, where = value, t
        top = max(value + h * slope / 3.0, value1 - h * slope1 / 3.0) + e * (h / step[m])**4
        if top > best and ((slope > 0.0 and slope1 <= 0.0) or top > max(value, value1)):
            guard_series(T, m, g, now, a)
            if t == 0.0:  # the zero at the start is exact: rounding is no maximum beyond it
                for j in range(known):
                    a[j] = 0.0
            found = highest(a, h, best, out, stack)
            if found > best:
                best, where = found, t + out[0]
        rising = slope > 0.0
        for c in range(nx):
            now[c] = after[c]
        value, slope = value1, slope1
        t += h
    if closing == 0 and value > best and not (low > 0 and slope * s <= RISEN * max(-value, 0.0)):
        best, where = value, s
    return best, where
