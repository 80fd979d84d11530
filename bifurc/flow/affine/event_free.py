"""Whole steps of an affine mode, passed while a bound proves that no guard reaches zero.

The guard on a step is compared with the cubic through values and slopes of both ends: below its Bernstein coefficients
plus ``e = sum G4 |x|``.  On the first step from a surface, where the guard is zero and falls, the trivial root is divided
out: ``b1 < 0, b2 + 16/3 e < 0, b3 < 0`` suffices, since the difference is at most ``16 e u**2 (1 - u)**2``.
"""
from ..._jit import NUMBER, apart


@apart(NUMBER, counted=False)
def free_steps(T, m, x, count, orders, slopes, room):
    """Advance ``x`` (nx,) in place by up to ``count`` steps; return the time that was proved free of events.

    ``orders`` (guards,) are the orders of the zeros that the guards are known to have at the start, ``slopes`` their
    known slopes (NaN: not known).  ``room`` (at least 2 guards + nx,) is overwritten.
    """
    A, E, G, G4, GT, n_guards, step, turn, harmonics = T.A, T.E, T.G, T.G4, T.GT, T.n_guards, T.step, T.turn, T.harmonics
    ns, nx = A.shape[1], A.shape[2]
    ng = n_guards[m]
    third = step[m] / 3.0
    g0, d0, x1 = room[:ng], room[ng:2 * ng], room[2 * ng:]
    for g in range(ng):
        value, slope = 0.0, 0.0
        for c in range(nx):
            value += G[m, g, c] * x[c]
            slope += GT[m, g, c, 1] * x[c]
        if orders[g] > 1:
            return 0.0
        if orders[g] == 1:
            value = 0.0
            if slopes[g] == slopes[g]:
                slope = slopes[g]
        elif not value < 0.0:
            return 0.0
        g0[g] = value
        d0[g] = slope * third
    x1[ns] = 1.0
    for k in range(count):
        for i in range(ns):
            total = 0.0
            for c in range(nx):
                total += E[m, i, c] * x[c]
            x1[i] = total
        for q in range(harmonics.size):
            c = ns + 1 + 2 * q
            cos, sin = turn[m, 1 + 2 * q], turn[m, 2 + 2 * q]
            x1[c] = cos * x[c] - sin * x[c + 1]
            x1[c + 1] = sin * x[c] + cos * x[c + 1]
        for g in range(ng):
            value, slope, e = 0.0, 0.0, 0.0
            for c in range(nx):
                value += G[m, g, c] * x1[c]
                slope += GT[m, g, c, 1] * x1[c]
                e += G4[m, g, c] * abs(x[c])
            slope *= third
            b1 = g0[g] + d0[g]
            b2 = value - slope
            if k == 0 and orders[g] == 1:
                if not (b1 < 0.0 and b2 + 16.0 / 3.0 * e < 0.0 and value < 0.0):
                    return 0.0
            elif not max(max(g0[g], value), max(b1, b2)) + e < 0.0:
                return k * step[m]
            g0[g] = value
            d0[g] = slope
        for c in range(nx):
            x[c] = x1[c]
    return count * step[m]
