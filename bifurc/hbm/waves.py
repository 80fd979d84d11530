"""Trigonometric polynomials in compiled kernels: internal slots are mean, then cosine and sine of each listed harmonic."""
import numpy as np

from .._jit import separate_leaf


@separate_leaf
def powers(theta, count, out):
    """Write e^{i l theta}, l = 0 .. count - 1, into ``out`` (count, 2) as cosine and sine.

    The list is doubled by one product until it is full: its error is that of rounding l theta.
    """
    out[0, 0], out[0, 1] = 1.0, 0.0
    if count > 1:
        out[1, 0], out[1, 1] = np.cos(theta), np.sin(theta)
    known = 2
    while known < count:
        half = known // 2
        c0, s0 = out[half, 0], out[half, 1]
        c, s = c0 * c0 - s0 * s0, 2.0 * c0 * s0
        for l in range(min(known, count - known)):
            out[known + l, 0], out[known + l, 1] = out[l, 0] * c - out[l, 1] * s, out[l, 1] * c + out[l, 0] * s
        known *= 2


@separate_leaf
def turned(waves, a, out):
    """Write the coefficients of the derivative by phase of the polynomial ``a`` (mi,) into ``out`` (mi,)."""
    out[0] = 0.0
    for j in range(1, a.size, 2):
        k = waves[j]
        out[j], out[j + 1] = k * a[j + 1], -k * a[j]


@separate_leaf
def jet(waves, a, p):
    """Return value and the first three derivatives by phase of the polynomial ``a`` (mi,); ``p`` from `powers`."""
    g0, g1, g2, g3 = a[0], 0.0, 0.0, 0.0
    for j in range(1, a.size, 2):
        k = waves[j]
        c, s = p[k, 0], p[k, 1]
        even, odd = a[j] * c + a[j + 1] * s, a[j + 1] * c - a[j] * s
        g0 += even
        g1 += k * odd
        g2 -= k * k * even
        g3 -= k * k * k * odd
    return g0, g1, g2, g3


@separate_leaf
def height(waves, a, p):
    """Return the value of the polynomial ``a`` (mi,); ``p`` from `powers`."""
    total = a[0]
    for j in range(1, a.size, 2):
        k = waves[j]
        total += a[j] * p[k, 0] + a[j + 1] * p[k, 1]
    return total


@separate_leaf
def value(waves, a, theta):
    """Return value and first derivative by phase of the polynomial ``a`` (mi,) at one phase."""
    g0, g1 = a[0], 0.0
    c1, s1 = np.cos(theta), np.sin(theta)
    n = a.size // 2
    if waves[a.size - 1] == n:  # all harmonics: odd and even ones in turn, so that neither waits for the other
        h0, h1 = 0.0, 0.0
        c2, s2 = c1 * c1 - s1 * s1, 2.0 * c1 * s1
        ca, sa, cb, sb = c1, s1, c2, s2
        for j in range(1, a.size - 2, 4):
            k = waves[j]
            g0 += a[j] * ca + a[j + 1] * sa
            g1 += k * (a[j + 1] * ca - a[j] * sa)
            h0 += a[j + 2] * cb + a[j + 3] * sb
            h1 += (k + 1) * (a[j + 3] * cb - a[j + 2] * sb)
            ca, sa = ca * c2 - sa * s2, sa * c2 + ca * s2
            cb, sb = cb * c2 - sb * s2, sb * c2 + cb * s2
        if n % 2 == 1:
            j = a.size - 2
            g0 += a[j] * ca + a[j + 1] * sa
            g1 += n * (a[j + 1] * ca - a[j] * sa)
        return g0 + h0, g1 + h1
    c, s, last = 1.0, 0.0, 0
    for j in range(1, a.size, 2):
        k = waves[j]
        if k - last == 1:
            c, s = c * c1 - s * s1, s * c1 + c * s1
        else:
            c, s = np.cos(k * theta), np.sin(k * theta)
        last = k
        g0 += a[j] * c + a[j + 1] * s
        g1 += k * (a[j + 1] * c - a[j] * s)
    return g0, g1


@separate_leaf
def turn(waves, a, theta):
    """Return the first two derivatives by phase of the polynomial ``a`` (mi,) at one phase."""
    g1, g2 = 0.0, 0.0
    c1, s1 = np.cos(theta), np.sin(theta)
    n = a.size // 2
    if waves[a.size - 1] == n:  # all harmonics, as in `value`
        h1, h2 = 0.0, 0.0
        c2, s2 = c1 * c1 - s1 * s1, 2.0 * c1 * s1
        ca, sa, cb, sb = c1, s1, c2, s2
        for j in range(1, a.size - 2, 4):
            k = waves[j]
            g1 += k * (a[j + 1] * ca - a[j] * sa)
            g2 -= k * k * (a[j] * ca + a[j + 1] * sa)
            h1 += (k + 1) * (a[j + 3] * cb - a[j + 2] * sb)
            h2 -= (k + 1) * (k + 1) * (a[j + 2] * cb + a[j + 3] * sb)
            ca, sa = ca * c2 - sa * s2, sa * c2 + ca * s2
            cb, sb = cb * c2 - sb * s2, sb * c2 + cb * s2
        if n % 2 == 1:
            j = a.size - 2
            g1 += n * (a[j + 1] * ca - a[j] * sa)
            g2 -= n * n * (a[j] * ca + a[j + 1] * sa)
        return g1 + h1, g2 + h2
    c, s, last = 1.0, 0.0, 0
    for j in range(1, a.size, 2):
        k = waves[j]
        if k - last == 1:
            c, s = c * c1 - s * s1, s * c1 + c * s1
        else:
            c, s = np.cos(k * theta), np.sin(k * theta)
        last = k
        g1 += k * (a[j + 1] * c - a[j] * s)
        g2 -= k * k * (a[j] * c + a[j + 1] * s)
    return g1, g2


@separate_leaf
def size(a):
    """Return a bound on the polynomial ``a`` (mi,)."""
    s0, s1, s2, s3 = abs(a[0]), 0.0, 0.0, 0.0
    last = 1 + (a.size - 1) // 8 * 8
    for j in range(1, last, 8):
        s0 += np.sqrt(a[j] * a[j] + a[j + 1] * a[j + 1])
        s1 += np.sqrt(a[j + 2] * a[j + 2] + a[j + 3] * a[j + 3])
        s2 += np.sqrt(a[j + 4] * a[j + 4] + a[j + 5] * a[j + 5])
        s3 += np.sqrt(a[j + 6] * a[j + 6] + a[j + 7] * a[j + 7])
    for j in range(last, a.size, 2):
        s0 += np.sqrt(a[j] * a[j] + a[j + 1] * a[j + 1])
    return (s0 + s1) + (s2 + s3)


@separate_leaf
def both_ways(T, even, odd):
    """Write a spectrum ``T`` (L, 2) for orders from 1 - L to L - 1: that with cosines, and that with sines (2 L - 1,)."""
    top = len(T) - 1
    for l in range(len(T)):
        even[top + l], even[top - l] = T[l, 0], T[l, 0]
        odd[top - l], odd[top + l] = -T[l, 1], T[l, 1]


@separate_leaf
def spectrum_row(even, odd, waves, a, out):
    """Write how multiplication by a signal acts on slot ``a``: ``out`` (mi,), Toeplitz and Hankel parts.

    ``even`` and ``odd``, see `both_ways`, hold (1/2 pi) times the integrals of signal cos l theta and signal sin l theta, l up to
    twice the top harmonic.
    """
    j, top, n = waves[a], even.size // 2, out.size // 2
    if a == 0:
        out[0] = even[top]
        for b in range(1, out.size, 2):
            k = waves[b]
            out[b] = even[top + k]
            out[b + 1] = odd[top + k]
        return
    sine = a % 2 == 0
    out[0] = 2.0 * (odd[top + j] if sine else even[top + j])
    if waves[waves.size - 1] == n:  # all harmonics lie side by side
        e0, o0, e1, o1 = even[top + 1 - j:], odd[top + 1 - j:], even[top + 1 + j:], odd[top + 1 + j:]
        if sine:
            for i in range(n):
                out[2 * i + 1] = o1[i] - o0[i]
                out[2 * i + 2] = e0[i] - e1[i]
        else:
            for i in range(n):
                out[2 * i + 1] = e0[i] + e1[i]
                out[2 * i + 2] = o1[i] + o0[i]
        return
    for b in range(1, out.size, 2):
        k = waves[b]
        e0, o0, e1, o1 = even[top + k - j], odd[top + k - j], even[top + k + j], odd[top + k + j]
        out[b] = o1 - o0 if sine else e0 + e1
        out[b + 1] = e0 - e1 if sine else o1 + o0
