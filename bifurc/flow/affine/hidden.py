"""Guards on their surface whose Taylor series shows no term beyond rounding: what decides on which side they go.

Far from what drives it, as at the other end of a chain of masses, a guard has a zero of any order: no coefficient of a series says
that it stays zero.  It is proved to stay zero by structure only.  Else the motion is followed for some steps, with a bound on what
rounding has added up in every state, until the guard is larger than that; exact zeros have no rounding, so that a wave that
comes through a chain at rest is told by its sign however small it is.  What that leaves open is `HIDDEN`: the motion goes on, and
the guard is looked at again after every step until it shows.
"""
import numpy as np

from ..._jit import WHOLES, apart, leaf, njit
from ...compose.tables import ORDER
from .polynomial import EPS, SMALLEST

HIDDEN = ORDER + 1  # order of a zero that no term of the series tells
ROUNDING = 64.0 * EPS  # of the sum of the terms: values below it are zero
UNDERFLOW = 1e-150  # of a row: beyond it the next one may vanish by its smallness


@apart(WHOLES)
def followed(T, m, g, x, scale):
    """Sign of guard ``g`` of mode ``m`` just after ``x`` (nx,), where all terms of its series are zero to rounding, and its order.

    0 and ORDER: zero for as long as the mode lasts; 0 and `HIDDEN`: not told from zero.  ``scale`` (nx,) see `rule.sizes`.
    """
    if stays(T, m, g):
        return 0, ORDER
    ns, nx = T.A.shape[1], T.A.shape[2]
    far = np.empty(nx, np.int64)
    depends(T, m, g, far)
    rests, most = True, 0
    for c in range(nx):
        if far[c] < 0:
            continue
        if x[c] != 0.0:
            most = max(most, far[c])
        rests = rests and c <= ns
        if c < ns and rests:
            rate = 0.0
            for k in range(nx):
                rate += T.A[m, c, k] * x[k]
            rests = rate == 0.0
    if rests:  # an equilibrium, to the last digit, of all that the guard depends on
        return 0, ORDER
    now, doubt = x.copy(), np.zeros(nx)
    for c in range(nx):
        doubt[c] = ROUNDING * scale[c] if x[c] != 0.0 else 0.0
    for _ in range(most + 2):  # after most / ORDER steps what drives the guard has come through; after all of them beyond rounding
        stepped(T, m, now, doubt)
        value, noise = 0.0, 0.0
        for c in range(nx):
            value += T.G[m, g, c] * now[c]
            noise += abs(T.G[m, g, c]) * doubt[c]
        if abs(value) > noise:
            return (-1 if value < 0.0 else 1), HIDDEN
    return 0, HIDDEN


@leaf
def stays(T, m, g):
    """Whether the rows of the derivatives of guard ``g`` vanish from one on: by what is held, or since no force changes it."""
    if T.still[m, g] > 0:
        return True
    largest = 0.0
    for c in range(T.GT.shape[2]):
        largest = max(largest, abs(T.GT[m, g, c, 0]))
    for j in range(1, ORDER + 1):
        before, largest = largest, 0.0
        for c in range(T.GT.shape[2]):
            largest = max(largest, abs(T.GT[m, g, c, j]))
        if largest == 0.0:
            return before > UNDERFLOW
    return False


@leaf
def depends(T, m, g, far):
    """Write in which derivative of guard ``g`` each state appears at the earliest into ``far`` (nx,); -1: in none.

    States as they are joined by numbers that are not zero: an exact zero in a matrix is no path.
    """
    A, G = T.A, T.G
    ns, nx = A.shape[1], A.shape[2]
    for c in range(nx):
        far[c] = 0 if G[m, g, c] != 0.0 else -1
    level, found = 0, True
    while found:
        found = False
        for i in range(ns):
            if far[i] == level:
                for c in range(nx):
                    if far[c] < 0 and A[m, i, c] != 0.0:
                        far[c], found = level + 1, True
        for k in range(ns + 1, nx):
            if far[k] == level:
                other = k + 1 if (k - ns) % 2 == 1 else k - 1
                if far[other] < 0:
                    far[other], found = level + 1, True
        level += 1


@njit
def stepped(T, m, now, doubt):
    """Advance ``now`` (nx,) by a step of the tables in place, and the bound ``doubt`` (nx,) on its rounding."""
    E, turn, harmonics = T.E, T.turn, T.harmonics
    ns, nx = E.shape[1], E.shape[2]
    moved, grown = np.empty(ns), np.empty(ns)
    for i in range(ns):
        total, size = 0.0, 0.0
        for c in range(nx):
            total += E[m, i, c] * now[c]
            size += abs(E[m, i, c]) * (doubt[c] + ROUNDING * abs(now[c]))
        moved[i], grown[i] = total, size
    for i in range(ns):
        now[i], doubt[i] = moved[i], grown[i]
    for q in range(harmonics.size):
        c = ns + 1 + 2 * q
        cos, sin = turn[m, 1 + 2 * q], turn[m, 2 + 2 * q]
        a, b = now[c], now[c + 1]
        now[c], now[c + 1] = cos * a - sin * b, sin * a + cos * b
        doubt[c] = doubt[c + 1] = ROUNDING


@leaf
def hidden(T, m, g, x):
    """Whether guard ``g`` of mode ``m`` is zero to rounding at ``x`` (nx,), where a step of the tables has led."""
    F, G = T.F, T.G
    ns, nx = F.shape[0], F.shape[1]
    value, size = 0.0, 0.0
    for c in range(nx):
        weight = abs(G[m, g, c])
        if weight == 0.0:
            continue
        value += G[m, g, c] * x[c]
        added = max(abs(x[c]), SMALLEST)
        if c < ns:
            for k in range(nx):
                added = max(added, F[c, k] * abs(x[k]))
        size += weight * added
    return abs(value) <= ROUNDING * size


@leaf
def blurred(T, m, x, scale):
    """Raise ``scale`` (nx,), see `rule.sizes`, to what a flight in mode ``m`` adds up beyond a step of the tables: here nothing."""
