"""Flight in modal coordinates: steps as long as the amplitudes that are there allow, each with a bound (`compose.modal`).

A guard is a sum over modes, ``g(s) = Re sum c_j exp(lambda_j s)``.  Its Taylor series of degree n about any time is wrong by
at most ``sum |c_j| |lambda_j s|**(n+1) / (n+1)!``, since no mode grows (for those that do the steps are short): amplitudes,
not frequencies alone, say how far a series reaches, and a mode that has decayed costs nothing.
"""
import numpy as np

from ..._jit import njit
from ...compose.tables import ORDER, TURN
from ..affine.hidden import HIDDEN
from ..affine.peak import zeros
from ..affine.polynomial import EPS, first_zero, highest
from ..affine.products import product

TRUNCATED = 0.25 * EPS  # of the sum of a guard's terms
SUMMED = 16.0 * EPS  # of a sum over the modes, and of every mode in it: its coordinate, and the error of its eigenvalue with time


@njit
def to_modal(T, m, x, xi):
    """Write the modal coordinates of ``x`` (nx,) into ``xi`` (nx,)."""
    product(T.L, m, x, xi)


@njit
def from_modal(T, m, xi, x):
    """Write the joined state of modal coordinates ``xi`` (nx,) into ``x`` (nx,)."""
    product(T.V, m, xi, x)


@njit
def turn(T, m, s, xi):
    """Advance ``xi`` (nx,) in place by any time ``s``."""
    p, r, spin = T.blocks[m, 0], T.blocks[m, 1], T.spin
    for j in range(p):
        grown, angle = np.exp(spin[m, 2 * j, 0] * s), spin[m, 2 * j, 1] * s
        c, d = grown * np.cos(angle), grown * np.sin(angle)
        a, b = xi[2 * j], xi[2 * j + 1]
        xi[2 * j], xi[2 * j + 1] = c * a - d * b, d * a + c * b
    for j in range(2 * p, 2 * p + r):
        xi[j] *= np.exp(spin[m, j, 0] * s)
    slow(T, m, s, xi)


@njit
def turn_level(T, m, level, xi):
    """Advance ``xi`` (nx,) in place by a step of a level."""
    p, r, turns = T.blocks[m, 0], T.blocks[m, 1], T.turns
    for j in range(p):
        c, d = turns[m, level, 2 * j], turns[m, level, 2 * j + 1]
        a, b = xi[2 * j], xi[2 * j + 1]
        xi[2 * j], xi[2 * j + 1] = c * a - d * b, d * a + c * b
    for j in range(2 * p, 2 * p + r):
        xi[j] *= turns[m, level, j]
    slow(T, m, T.level[m, level], xi)


@njit
def slow(T, m, s, xi):
    """Advance the block of what is not diagonal by ``s``: Taylor series, of four terms where N^4 = 0."""
    begin, d, N = 2 * T.blocks[m, 0] + T.blocks[m, 1], T.blocks[m, 2], T.N
    if d == 1:
        return
    rate = T.spin[m, begin, 0]
    terms, parts = (3, 1) if rate == 0.0 else (ORDER, 1 + int(rate * s / TURN))
    power, term = np.empty(d), np.empty(d)
    for _ in range(parts):
        for i in range(d):
            power[i] = xi[begin + i]
        for k in range(1, terms + 1):
            for i in range(d):
                total = 0.0
                for c in range(d):
                    total += N[m, i, c] * power[c]
                term[i] = total * (s / parts) / k
            for i in range(d):
                power[i] = term[i]
                xi[begin + i] += term[i]


@njit
def amplitudes(T, m, xi, size):
    """Write the amplitudes of the coordinates into ``size`` (nx,): those of a pair in its first place."""
    p = T.blocks[m, 0]
    for j in range(p):
        size[2 * j] = np.sqrt(xi[2 * j] * xi[2 * j] + xi[2 * j + 1] * xi[2 * j + 1])
        size[2 * j + 1] = 0.0
    for c in range(2 * p, xi.size):
        size[c] = abs(xi[c])


@njit
def rows_series(T, m, g, xi, a):
    """Write the Taylor coefficients (ORDER+1,) of guard ``g`` from ``xi``."""
    GS = T.GS
    for j in range(ORDER + 1):
        a[j] = 0.0
    for c in range(xi.size):
        r = xi[c]
        for j in range(ORDER + 1):
            a[j] += GS[m, g, c, j] * r


@njit
def good_for(T, m, g, size):
    """Return the level of the longest step on which the series of guard ``g`` is good, and the sum of the guard's terms."""
    tail, terms, wrong = T.tail, 0.0, 0.0
    for c in range(size.size):
        terms += tail[m, g, c, 0] * size[c]
        wrong += tail[m, g, c, 1] * size[c]
    return level_of(T, m, TRUNCATED * terms / wrong if wrong > 0.0 else np.inf), terms


@njit
def level_of(T, m, ratio):
    """Return the longest level with ``s**(ORDER+1) <= ratio``; the first one where none is."""
    last = T.blocks[m, 3] - 1
    if ratio == np.inf:
        return last
    if not ratio > 0.0:
        return 0
    return max(0, min(last, int(np.floor(2.0 * (np.log2(ratio) / (ORDER + 1) - np.log2(T.level[m, 0]))))))


@njit
def blur_of(nx):
    """Return what part of the sum of its terms rounding leaves of a guard that is zero, after flights in ``nx`` coordinates."""
    return SUMMED * nx


@njit
def quiet(T, m, level, a, noise):
    """Return the longest level up to ``level`` on which a hidden guard, with the series ``a``, stays within ``noise``."""
    while level > 0:
        top = 0.0
        for j in range(ORDER, 0, -1):
            top = (top + abs(a[j])) * T.level[m, level]
        if top <= noise:
            break
        level -= 1
    return level


@njit
def modal_series(T, m, x, orders, a):
    """Write the series (guards, ORDER+1) of the guards with a zero of known order below ORDER; return their reach."""
    xi, size = np.empty(x.size), np.empty(x.size)
    to_modal(T, m, x, xi)
    amplitudes(T, m, xi, size)
    level = T.blocks[m, 3] - 1
    for g in range(T.n_guards[m]):
        if orders[g] != ORDER:
            rows_series(T, m, g, xi, a[g])
            found, terms = good_for(T, m, g, size)
            level = min(level, found)
            if orders[g] == HIDDEN:
                level = quiet(T, m, level, a[g], blur_of(x.size) * terms)
    return T.level[m, level]


@njit
def modal_land(T, m, x, s, out):
    """Write the joined state after any ``s >= 0`` into ``out`` (nx,)."""
    xi = np.empty(x.size)
    to_modal(T, m, x, xi)
    turn(T, m, s, xi)
    from_modal(T, m, xi, out)


@njit
def modal_coast(T, m, x, limit, orders, slopes):
    """Advance ``x`` (nx,) in place by up to ``limit``; return the time that was proved free of events and of touches.

    ``orders`` (guards,) and ``slopes`` as for `free_steps`; zeros of any known order are divided out.
    """
    nx, guards, first = x.size, T.n_guards[m], T.level[m, 0]
    xi, size, out, stack = np.empty(nx), np.empty(nx), np.empty(3), np.empty(64)
    series = np.empty((guards, ORDER + 1))
    noise = np.empty(guards)
    to_modal(T, m, x, xi)
    done, fresh, clear = 0.0, True, True
    while limit - done >= first:
        amplitudes(T, m, xi, size)
        level = T.blocks[m, 3] - 1
        for g in range(guards):
            if orders[g] == ORDER:
                continue
            rows_series(T, m, g, xi, series[g])
            found, terms = good_for(T, m, g, size)
            noise[g] = 4.0 * EPS * terms
            level = min(level, found)
            if orders[g] == HIDDEN:
                if abs(series[g, 0]) > blur_of(x.size) * terms:
                    clear = False
                level = quiet(T, m, level, series[g], blur_of(x.size) * terms)
            if fresh and slopes[g] == slopes[g]:
                series[g, 1] = slopes[g]
        if not clear:
            break
        while T.level[m, level] > limit - done and level > 0:
            level -= 1
        s = T.level[m, level]
        for g in range(guards):
            if orders[g] >= ORDER:
                continue
            low = orders[g] if fresh else 0
            top = 0.0
            for j in range(ORDER, low, -1):
                top = (top + abs(series[g, j])) * s
            if series[g, low] + top < -noise[g] and low == 0:
                continue
            first_zero(series[g], low, s, noise[g], out, stack)
            if out[0] < np.inf or out[2] < np.inf:
                clear = False
                break
        if not clear:
            break
        turn_level(T, m, level, xi)
        done += s
        fresh = False
    if done > 0.0:
        from_modal(T, m, xi, x)
    return done


@njit
def modal_peak(T, m, g, x, s, closing, low):
    """As `bifurc.flow.affine.peak.segment_peak`, on steps as long as the amplitudes allow."""
    nx = x.size
    xi, size = np.empty(nx), np.empty(nx)
    a, out, stack = np.empty(ORDER + 1), np.empty(3), np.empty(64)
    best, where, t, rising = -np.inf, 0.0, 0.0, False
    to_modal(T, m, x, xi)
    rows_series(T, m, g, xi, a)
    for j in range(zeros(T, m, g, x, low)):  # the zero at the start is exact: rounding is no maximum beyond it
        a[j] = 0.0
    while t < s:
        amplitudes(T, m, xi, size)
        level = good_for(T, m, g, size)[0]
        while level > 0 and T.level[m, level] > s - t:
            level -= 1
        whole = T.level[m, level] <= s - t
        h = T.level[m, level] if whole else s - t
        if rising and a[1] <= 0.0 and a[0] > best:  # a maximum on the border of two steps
            best, where = a[0], t
        top = 0.0
        for j in range(ORDER, 0, -1):
            top = (top + abs(a[j])) * h
        if a[0] + top > best:
            found = highest(a, h, best, out, stack)
            if found > best:
                best, where = found, t + out[0]
        if whole:
            turn_level(T, m, level, xi)
        else:
            turn(T, m, h, xi)
        rising = a[1] > 0.0
        rows_series(T, m, g, xi, a)
        t = t + h if whole else s
    if closing == 0 and a[0] > best and not (low > 0 and a[1] < 0.0):
        best, where = a[0], s
    return best, where
