"""States of a recorded motion at any times, and the times at which a component of it passes a value: from recorded states."""
import numpy as np

from .._jit import njit
from .affine.engine import advance, forcing, leap

HALVINGS = 100  # of an interval at most, to rounding
EPS = float(np.finfo(float).eps)


@njit
def sample(T, modes, starts, states, index, spans, out):
    """Write the states (count, ns) at the times ``spans`` after the starts of the segments ``index`` into ``out``.

    ``modes``, ``starts`` (local time in the period) and ``states`` (segments, ns) describe the segments.  Times of one segment
    that rise cost no more together than the segment is long.
    """
    ns, last, mark = states.shape[1], -1, 0.0
    x = np.empty(T.A.shape[2])
    y1 = np.empty(ns)
    for i in range(index.size):
        k = index[i]
        if k != last or spans[i] < mark:
            last, mark = k, 0.0
            for c in range(ns):
                x[c] = states[k, c]
            forcing(T, starts[k], x)
        far = leap(T, modes[k])
        while spans[i] - mark > 2.0 * far:
            advance(T, modes[k], x, far, y1)
            mark += far
            for c in range(ns):
                x[c] = y1[c]
            forcing(T, starts[k] + mark, x)
        advance(T, modes[k], x, spans[i] - mark, y1)
        for c in range(ns):
            out[i, c] = y1[c]
        if spans[i] - mark > 0.5 * far:  # what follows does not go this way again
            mark = spans[i]
            for c in range(ns):
                x[c] = y1[c]
            forcing(T, starts[k] + mark, x)


@njit
def passages(T, modes, starts, states, lengths, rows, away, spans):
    """Write the times ``spans`` (k,) behind the ``states`` (k, ns) at which rows (k, nx + 1), the last number of which is added to
    the product with state and forcing, are zero.

    ``lengths`` (k,) enclose them, with values ``away`` (k, 2) of opposite signs at both ends; ``modes`` and ``starts`` as in
    `sample`.  By Chandrupatla (1997): a bisection, or a parabola through the last three points where that is steep enough; the
    first place is that of the chord.
    """
    ns, nx = states.shape[1], T.A.shape[2]
    x, xe, y1 = np.empty(nx), np.empty(nx), np.empty(ns)
    for i in range(lengths.size):
        for c in range(ns):
            x[c] = states[i, c]
        forcing(T, starts[i], x)
        a, b, fa, fb = 0.0, lengths[i], away[i, 0], away[i, 1]
        t, best = fa / (fa - fb), 0.0
        for _ in range(HALVINGS):
            s = a + t * (b - a)
            advance(T, modes[i], x, s, y1)
            for c in range(ns):
                xe[c] = y1[c]
            forcing(T, starts[i] + s, xe)
            value = rows[i, nx]
            for c in range(nx):
                value += rows[i, c] * xe[c]
            if (value > 0.0) == (fa > 0.0):
                c, fc = a, fa
            else:
                c, fc = b, fb
                b, fb = a, fa
            a, fa = s, value
            best = a if abs(fa) < abs(fb) else b
            width = abs(b - a)
            least = 2.0 * EPS * lengths[i] / max(width, 1e-300)
            if least > 0.5 or fa == 0.0 or fb == 0.0:
                break
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            t = 0.5
            if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
                t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            t = min(max(t, least), 1.0 - least) if np.isfinite(t) else 0.5
        spans[i] = best
