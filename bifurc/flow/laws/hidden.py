"""On which side of its surface a guard goes under a law, and how long the errors of the steps hide it: as `flow.affine.hidden`.

Rounding is followed by the defects that the steps of the collocation measure.
"""
import numpy as np

from ..._jit import WHOLES, apart, leaf, njit
from ...compose.tables import ORDER
from ..affine.hidden import HIDDEN
from .calls import ACTING, COUNT, ERROR, FIRST, FORCES, WATCH, rate, scratch_of, values
from .engine import field
from .gauss import NODES
from .guards import FITTED, TIGHT, ZERO, fitted, guard_and_gradient, guard_terms, longest_fit

ENGINE = ("inside", "hidden")
HIGHEST_ORDER = 5  # of a zero that the series tells


@njit
def inside(T, m, g, x, scale, a):
    """Sign of guard ``g`` just after ``x``: -1 inside, +1 outside or leaving, 0 zero; order of its zero, see `rule.inside`.

    Where it has no value, as a force along a circle whose normal another contact holds, the mode cannot start: it is outside.
    """
    size, known = np.empty(ORDER + 1), False
    guard_terms(T, m, g, x, scale, a, size)
    for j in range(HIGHEST_ORDER + 1):
        if j > 2 and not known:  # all accelerations are found together: from here on terms have the rounding of the largest
            widen(T, m, g, x, size)
            known = True
        if a[j] < -ZERO * size[j]:
            return -1, j
        if a[j] > ZERO * size[j] or not np.isfinite(a[j]):
            return 1, j
    return followed(T, m, g, x, scale)


@njit
def widen(T, m, g, x, size):
    """Raise ``size`` (ORDER+1,) from the third term of guard ``g`` on to what accelerations as large as any other would give."""
    n, h, f = T.LP.shape[2], longest_fit(T, m), np.empty(T.A.shape[1])
    field(T, m, x, f)
    fastest, weight = 0.0, 0.0
    for i in range(n):
        fastest = max(fastest, abs(f[n + i]))
        weight = max(weight, h * abs(T.G[m, g, i]), abs(T.G[m, g, n + i]))
    for j in range(3, ORDER + 1):
        size[j] = max(size[j], FITTED * weight * fastest / h**(j - 1))


@apart(WHOLES)
def followed(T, m, g, x, scale):
    """As `flow.affine.hidden.followed`, by steps of the collocation."""
    n, rows, ns, nx = T.LP.shape[2], T.LU.shape[0], T.A.shape[1], T.A.shape[2]
    if T.still[m, g] > 0:
        return 0, ORDER
    far, f = np.empty(nx, np.int64), np.empty(ns)
    depends(T, m, g, far)
    field(T, m, x, f)
    rests, most = True, 0
    for c in range(nx):
        if far[c] >= 0:
            most = max(most, far[c]) if x[c] != 0.0 else most
            rests = rests and c <= ns and (c == ns or f[c] == 0.0)
    if rests:
        return 0, ORDER
    acc, force, accs = np.empty((n, NODES + 2)), np.empty((rows, NODES + 2)), np.empty((0, n, NODES + 2))
    now, x1, row, scratch = x.copy(), np.empty(nx), np.empty(nx), scratch_of(T, 0)
    noise, place, speed = 0.0, 0.0, 0.0
    guard_and_gradient(T, m, g, x, row)
    for c in range(nx):
        noise += ZERO * abs(row[c]) * scale[c] if x[c] != 0.0 else 0.0
    for _ in range(most + 2):
        h = fitted(T, m, now, np.inf, acc, force, x1, np.empty((0, 2)), accs, scratch)
        fastest, missed, sizes = 0.0, scratch[ERROR] + ZERO, 0.0
        for i in range(n):
            for j in range(NODES + 2):
                fastest = max(fastest, abs(acc[i, j]))
        for r in range(rows):
            sizes += abs(T.LG[m, g, r] * force[r, NODES + 1])
        place += h * (speed + missed * fastest * h)
        speed += missed * fastest * h
        for c in range(nx):
            now[c] = x1[c]
        value, bound = guard_and_gradient(T, m, g, now, row), noise + missed * sizes
        for i in range(n):
            bound += abs(row[i]) * place + abs(row[n + i]) * speed
        if abs(value) > bound:
            return (-1 if value < 0.0 else 1), HIDDEN
    return 0, HIDDEN


@njit
def depends(T, m, g, far):
    """As `flow.affine.hidden.depends`: laws join what they see to what they push."""
    A, G, LG, LP = T.A, T.G, T.LG, T.LP
    n, rows, ns, nx = LP.shape[2], T.LU.shape[0], A.shape[1], A.shape[2]
    for c in range(nx):
        far[c] = 0 if G[m, g, c] != 0.0 else -1
    for r in range(rows):
        if LG[m, g, r] != 0.0:
            sees(T, r, 0, far)
    level, found = 0, True
    while found:
        for i in range(ns):
            if far[i] != level:
                continue
            for c in range(nx):
                if far[c] < 0 and A[m, i, c] != 0.0:
                    far[c] = level + 1
            for r in range(T.stages[ACTING] if n <= i < 2 * n else 0):
                if LP[m, r, i - n] != 0.0:
                    sees(T, r, level + 1, far)
        for k in range(ns + 1, nx):
            if far[k] == level:
                other = k + 1 if (k - ns) % 2 == 1 else k - 1
                far[other] = far[other] if far[other] >= 0 else level + 1
        level += 1
        found = False
        for c in range(nx):
            found = found or far[c] == level


@leaf
def sees(T, r, level, far):
    """Mark what row ``r`` of a law depends on as at ``level`` in ``far`` (nx,): a reaction sees accelerations too."""
    n = T.LP.shape[2]
    for q in range(T.owners[FIRST, r], T.owners[FIRST, r] + T.owners[COUNT, r]):
        for c in range(far.size):
            if far[c] < 0 and (T.LU[q, c] != 0.0 or T.LS[q, c] != 0.0):
                far[c] = level
            if r >= T.stages[FORCES] and c < n and T.LU[q, c] != 0.0 and far[n + c] < 0:
                far[n + c] = level


@njit
def hidden(T, m, g, x):
    """Whether guard ``g`` of mode ``m`` is zero at ``x`` (nx,), to what steps of polynomials may have missed."""
    n, rows, h = T.LP.shape[2], T.LU.shape[0], longest_fit(T, m)
    row, f, local = np.empty(x.size), np.empty(T.A.shape[1]), np.empty((4, rows, 1))
    value = guard_and_gradient(T, m, g, x, row)
    rate(T, m, x, f, local)
    values(T, WATCH, m, local)
    noise, fastest = 0.0, 0.0
    for i in range(n):
        fastest = max(fastest, abs(f[n + i]))
    for c in range(x.size):
        noise += ZERO * abs(row[c] * x[c])
    for i in range(n):
        noise += TIGHT * fastest * h * (abs(row[i]) * h + abs(row[n + i]))
    for r in range(rows):
        noise += TIGHT * abs(T.LG[m, g, r] * local[2, r, 0])
    return abs(value) <= noise
