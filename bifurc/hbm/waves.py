"""Trigonometric polynomials in compiled kernels: internal slots are mean, then cosine and sine of each listed harmonic."""
import numpy as np

from .._jit import leaf


@leaf
def powers(theta, count, out):
    """Write e^{i l theta}, l = 0 .. count - 1, into ``out`` (count, 2) as cosine and sine.

    Every eighth is computed, the others follow by rotation: no error grows along the list.
    """
    c1, s1 = np.cos(theta), np.sin(theta)
    c, s = 1.0, 0.0
    for l in range(count):
        if l % 8 == 0:
            c, s = np.cos(l * theta), np.sin(l * theta)
        out[l, 0], out[l, 1] = c, s
        c, s = c * c1 - s * s1, s * c1 + c * s1


@leaf
def turned(waves, a, out):
    """Write the coefficients of the derivative by phase of the polynomial ``a`` (mi,) into ``out`` (mi,)."""
    out[0] = 0.0
    for j in range(1, a.size, 2):
        k = waves[j]
        out[j], out[j + 1] = k * a[j + 1], -k * a[j]


@leaf
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


@leaf
def value(waves, a, theta):
    """Return value and first derivative by phase of the polynomial ``a`` (mi,) at one phase."""
    g0, g1 = a[0], 0.0
    c1, s1 = np.cos(theta), np.sin(theta)
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


@leaf
def turn(waves, a, theta):
    """Return the first two derivatives by phase of the polynomial ``a`` (mi,) at one phase."""
    g1, g2 = 0.0, 0.0
    c1, s1 = np.cos(theta), np.sin(theta)
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


@leaf
def size(a):
    """Return a bound on the polynomial ``a`` (mi,)."""
    total = abs(a[0])
    for j in range(1, a.size, 2):
        total += np.sqrt(a[j] * a[j] + a[j + 1] * a[j + 1])
    return total


@leaf
def spectrum_row(T, waves, a, out):
    """Write how multiplication by a signal with spectrum ``T`` acts on slot ``a``: ``out`` (mi,), Toeplitz and Hankel parts.

    T (L, 2) holds (1/2 pi) times the integrals of signal cos l theta and signal sin l theta, l up to twice the top harmonic.
    """
    j = waves[a]
    if a == 0:
        out[0] = T[0, 0]
        for b in range(1, waves.size, 2):
            k = waves[b]
            out[b] = T[k, 0]
            out[b + 1] = T[k, 1]
    elif a % 2 == 0:  # sine
        out[0] = 2.0 * T[j, 1]
        for b in range(1, waves.size, 2):
            k = waves[b]
            d = j - k
            out[b] = T[j + k, 1] + (T[d, 1] if d >= 0 else -T[-d, 1])
            out[b + 1] = T[abs(d), 0] - T[j + k, 0]
    else:
        out[0] = 2.0 * T[j, 0]
        for b in range(1, waves.size, 2):
            k = waves[b]
            d = k - j
            out[b] = T[abs(d), 0] + T[j + k, 0]
            out[b + 1] = T[j + k, 1] + (T[d, 1] if d >= 0 else -T[-d, 1])
