"""First zero and largest interior maximum of a guard on a step, certified.

Within a step a guard is a polynomial in time.  On a piece of it the cubic through values and slopes of both ends differs
from the guard by at most ``D4 L**4 / 384`` (its derivative by ``sqrt(3)/216 D4 L**3``, its second derivative by
``D4 L**2 / 12``; Birkhoff and Priver 1967), and lies within its Bernstein coefficients.  A piece is given up only when
these bounds prove that it holds no zero, one zero, or one maximum; otherwise it is halved.  Zeros that the start of the
step is known to have are divided out of the coefficients, never out of values.
"""
import numpy as np

from ..._jit import NOTHING, NUMBER, apart, leaf
from ...compose.tables import ORDER

EPS = 2.220446049250313e-16
SMALLEST = 2.2250738585072014e-308  # number with all its digits: what is smaller rounds like it
HALVINGS = 40
SLOPE_ERROR = np.sqrt(3.0) / 216.0
FALLING = tuple(float(k * (k - 1) * (k - 2) * (k - 3)) for k in range(ORDER + 1))


@leaf
def horner(a, low, s):
    """Value and slope at ``s`` of the polynomial with coefficients ``a[low:]``.

    Even and odd powers are two chains, since a chain waits for each of its sums.
    """
    u = s * s
    p, q = a[ORDER], a[ORDER - 1]
    dp, dq = 0.0, 0.0
    j = ORDER - 2
    while j > low:
        dp = dp * u + p
        p = p * u + a[j]
        dq = dq * u + q
        q = q * u + a[j - 1]
        j -= 2
    if j == low:
        dp = dp * u + p
        p = p * u + a[j]
    else:
        p, dp, q, dq = q, dq, p, dp
    return p + s * q, q + 2.0 * s * (dp + s * dq)


@leaf
def fourth(a, low, s):
    """Bound on the fourth derivative of ``a[low:]`` on [0, s]."""
    u = s * s
    total, other = 0.0, 0.0
    j = ORDER
    while j > low + 4:
        total = total * u + abs(a[j]) * FALLING[j - low]
        other = other * u + abs(a[j - 1]) * FALLING[j - low - 1]
        j -= 2
    if j == low + 4:
        return total * u + abs(a[j]) * FALLING[4] + s * other
    return s * total + other


@leaf
def curved(a, low, s):
    """Value, slope and half the second derivative at ``s`` of the polynomial with coefficients ``a[low:]``."""
    u = s * s
    p, q = a[ORDER], a[ORDER - 1]
    dp, dq, cp, cq = 0.0, 0.0, 0.0, 0.0
    j = ORDER - 2
    while j > low:
        cp = cp * u + dp
        dp = dp * u + p
        p = p * u + a[j]
        cq = cq * u + dq
        dq = dq * u + q
        q = q * u + a[j - 1]
        j -= 2
    if j == low:
        cp = cp * u + dp
        dp = dp * u + p
        p = p * u + a[j]
    else:
        p, dp, cp, q, dq, cq = q, dq, cq, p, dp, cp
    return p + s * q, q + 2.0 * s * (dp + s * dq), dp + 4.0 * u * (cp + s * cq) + 3.0 * s * dq


@leaf
def bracketed(a, low, left, right, pl, pr, dl, dr):
    """Only zero of ``a[low:]`` in (left, right], where pl < 0 <= pr, to rounding, and the slope there.

    Third-order steps (Chebyshev's) kept in the bracket: after a step of 1e-7 the next one is below rounding, and the
    slope is carried along it.
    """
    L = right - left
    rise = pr - pl
    u = -pl / rise
    s = left + L * u
    if dl * L > 0.25 * rise and dr * L > 0.25 * rise:  # inverse cubic interpolation
        v = 1.0 - u
        inner = left + L * u * u * (3.0 - 2.0 * u) + rise * u * v * (v / dl - u / dr)
        if left < inner < right:
            s = inner
    lo, hi = left, right
    d = dr
    for _ in range(200):
        p, d, c = curved(a, low, s)
        if p < 0.0:
            lo = s
        else:
            hi = s
        if d > 0.0:
            step = p / d
            bend = c / d * step
            if abs(bend) < 0.25:
                step *= 1.0 + bend
            new = s - step
            if abs(step) <= 1e-7 * s and abs(bend) <= 1e-7 or abs(step) <= EPS * s:
                return min(max(new, left), right), d - 2.0 * c * step
        else:
            new = lo
        if not lo < new < hi:
            new = 0.5 * (lo + hi)
            if new <= lo or new >= hi:
                return hi, d
        s = new
    return s, d


@leaf
def rounding(a, low, s):
    """Rounding level of the values of ``a[low:]`` on [0, s]: a piece that varies less is not worth halving."""
    total = 0.0
    for j in range(ORDER, low - 1, -1):
        total = total * s + abs(a[j])
    return 4.0 * EPS * total


@leaf
def maximum(a, low, left, right):
    """Time of the zero of the slope of ``a[low:]`` in [left, right], where it falls from positive to negative."""
    lo, hi = left, right
    s = 0.5 * (lo + hi)
    for _ in range(200):
        p, d, c = curved(a, low, s)
        if d > 0.0:
            lo = s
        else:
            hi = s
        new = s - 0.5 * d / c if c < 0.0 else lo
        if not lo < new < hi:
            new = 0.5 * (lo + hi)
        if abs(new - s) <= 2.0 * EPS * s:
            return new
        s = new
    return s


@apart(NOTHING, counted=False)
def first_zero(a, low, s, noise, out, stack):
    """Find the first zero in (0, s] of the guard ``a`` (ORDER+1,), whose zero of order ``low`` at 0 is divided out.

    ``out`` receives time (inf: none) and slope of the guard at the zero, and the time of the last maximum before it that
    touches zero within ``noise`` (inf: none).  ``stack`` (HALVINGS+1,) is scratch.
    """
    out[0] = np.inf
    out[1] = 0.0
    out[2] = np.inf
    pl, dl = a[low], a[low + 1]
    if pl >= 0.0:
        out[0] = 0.0
        out[1] = a[1]
        return
    D4 = fourth(a, low, s)
    flat = rounding(a, low, s)
    left = 0.0
    depth = 0
    stack[0] = s
    while depth >= 0:
        right = stack[depth]
        pr, dr = horner(a, low, right)
        L = right - left
        b1 = pl + L / 3.0 * dl
        b2 = pr - L / 3.0 * dr
        e = D4 * L**4 / 384.0
        last = depth == HALVINGS or max(max(abs(b1 - pl), abs(b2 - b1)), max(abs(pr - b2), e)) <= flat
        if max(max(pl, pr), max(b1, b2)) + e >= 0.0:
            bend0, bend1 = pl - 2.0 * b1 + b2, b1 - 2.0 * b2 + pr  # second derivative, times L**2 / 6
            allow = D4 * L**4 / 72.0
            concave = bend0 < -allow and bend1 < -allow
            if pr >= 0.0:
                single = concave or (bend0 > allow and bend1 > allow)
                if not single:
                    rising = SLOPE_ERROR * D4 * L**4 / 3.0
                    single = b1 - pl > rising and b2 - b1 > rising and pr - b2 > rising
                if single or last:
                    root, d = bracketed(a, low, left, right, pl, pr, dl, dr)
                    out[0] = root
                    out[1] = d if low == 0 else d * root**low
                    return
            elif concave:
                if dl > 0.0 and dr < 0.0:
                    top = maximum(a, low, left, right)
                    pt, dt = horner(a, low, top)
                    if pt > 0.0 and pt * top**low > noise:
                        root, d = bracketed(a, low, left, top, pl, pt, dl, dt)
                        out[0] = root
                        out[1] = d if low == 0 else d * root**low
                        return
                    if abs(pt) * top**low <= noise:
                        out[2] = top
            elif bend0 > allow and bend1 > allow:
                pass  # convex, negative at both ends
            elif not last:
                depth += 1
                stack[depth] = 0.5 * (left + right)
                continue
            elif (pr if pr > pl else pl) * right**low >= -noise:
                out[2] = right
            if pr >= 0.0 and not last:
                depth += 1
                stack[depth] = 0.5 * (left + right)
                continue
        left, pl, dl = right, pr, dr
        depth -= 1


@apart(NUMBER, counted=False)
def highest(a, s, best, out, stack):
    """Return the largest interior maximum of the guard ``a`` on [0, s] above ``best``, else ``best``; time in ``out[0]``."""
    D4 = fourth(a, 0, s)
    flat = rounding(a, 0, s)
    left, pl, dl = 0.0, a[0], a[1]
    depth = 0
    stack[0] = s
    while depth >= 0:
        right = stack[depth]
        pr, dr = horner(a, 0, right)
        L = right - left
        b1 = pl + L / 3.0 * dl
        b2 = pr - L / 3.0 * dr
        last = depth == HALVINGS or max(max(abs(b1 - pl), abs(b2 - b1)), max(abs(pr - b2), D4 * L**4 / 384.0)) <= flat
        if max(max(pl, pr), max(b1, b2)) + D4 * L**4 / 384.0 > best:
            bend0, bend1 = pl - 2.0 * b1 + b2, b1 - 2.0 * b2 + pr
            allow = D4 * L**4 / 72.0
            slope = SLOPE_ERROR * D4 * L**4 / 3.0
            rising = b1 - pl > slope and b2 - b1 > slope and pr - b2 > slope
            falling = b1 - pl < -slope and b2 - b1 < -slope and pr - b2 < -slope
            if (bend0 < -allow and bend1 < -allow) or last:
                if dl > 0.0 and dr <= 0.0:
                    top = maximum(a, 0, left, right)
                    p, d = horner(a, 0, top)
                    if p > best:
                        best = p
                        out[0] = top
            elif not (rising or falling or (bend0 > allow and bend1 > allow)):
                depth += 1
                stack[depth] = 0.5 * (left + right)
                continue
        left, pl, dl = right, pr, dr
        depth -= 1
    return best
