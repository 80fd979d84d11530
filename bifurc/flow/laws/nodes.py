"""What a step does with its accelerations at the nodes, whatever the law: the parts of `collocation` that do not know it.

They are compiled once on a machine, and linked into what is compiled for a law.
"""
import numpy as np

from ..._jit import separate
from ..affine.polynomial import SMALLEST
from .gauss import EDGES, MOMENTS, NODES, ONTO_DOUBLE, ONTO_SINGLE, WEIGHTS, C

LOW = 2.0**-400  # numbers between it and its inverse have squares


@separate
def remembered(A, m, i, n, x):
    """Acceleration of coordinate ``i`` by the memory in the state (or its variation) ``x``."""
    total = 0.0
    for c in range(2 * n, A.shape[1]):
        total += A[m, n + i, c] * x[c]
    return total


@separate
def prepare(harmonics, omega, h, turn):
    """Fill the turns of the forcing states at the nodes and the end of a step ``h``."""
    for k in range(harmonics.size):
        angle = harmonics[k] * omega * h
        for j in range(NODES):
            turn[1 + 2 * k, j] = np.cos(angle * C[j])
            turn[2 + 2 * k, j] = np.sin(angle * C[j])
        turn[1 + 2 * k, NODES] = np.cos(angle)
        turn[2 + 2 * k, NODES] = np.sin(angle)


@separate
def spread(x, i, n, h, a, q, v):
    """Positions and velocities of coordinate ``i`` at the nodes, from its accelerations there."""
    x0, v0 = x[i], x[n + i]
    a0, a1, a2, a3, a4, a5, a6, a7 = a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5], a[i, 6], a[i, 7]
    D, S = ONTO_DOUBLE, ONTO_SINGLE
    for j in range(NODES):  # sums written out, node beside node and pair by pair: few wait for another
        twice = (D[0, j] * a0 + D[1, j] * a1) + (D[2, j] * a2 + D[3, j] * a3)
        once = (S[0, j] * a0 + S[1, j] * a1) + (S[2, j] * a2 + S[3, j] * a3)
        twice = twice + ((D[4, j] * a4 + D[5, j] * a5) + (D[6, j] * a6 + D[7, j] * a7))
        once = once + ((S[4, j] * a4 + S[5, j] * a5) + (S[6, j] * a6 + S[7, j] * a7))
        q[i, j] = x0 + h * (C[j] * v0 + h * twice)
        v[i, j] = v0 + h * once


@separate
def finish(x, i, n, h, a):
    """Move coordinate ``i`` and its velocity in ``x`` to the end of the step."""
    once, twice = 0.0, 0.0
    for k in range(NODES):
        twice += MOMENTS[k] * a[i, k]
        once += WEIGHTS[k] * a[i, k]
    x[i] += h * (x[n + i] + h * twice)
    x[n + i] += h * once


@separate
def squarable(n, x, f0, base):
    """Return the power of two in units of which the numbers of a step are so large or small that their squares are numbers too."""
    top = largest(n, base)
    for i in range(n):
        top = max(top, max(max(abs(x[i]), abs(x[n + i])), abs(f0[n + i])))
    if LOW <= top <= 1.0 / LOW or top == 0.0:
        return 1.0
    return LOW if top > 1.0 else 1.0 / LOW if top > LOW * LOW else 1.0 / (LOW * LOW)


@separate
def rounding(n, scale, top, stiff, q):
    """Return the rounding of accelerations up to ``top`` at places ``q`` (n, NODES), in units of 1 / ``scale``."""
    return 2e-15 * scale * (top + SMALLEST + stiff * (largest(n, q) + SMALLEST))


@separate
def taken(new, i, a, scale):
    """Put row ``i`` of ``new`` (n, NODES) in the place of that of ``a``; return the sum of the squares of what that changes, in
    units of 1 / ``scale``."""
    d0, d1, d2, d3 = new[i, 0] - a[i, 0], new[i, 1] - a[i, 1], new[i, 2] - a[i, 2], new[i, 3] - a[i, 3]
    d4, d5, d6, d7 = new[i, 4] - a[i, 4], new[i, 5] - a[i, 5], new[i, 6] - a[i, 6], new[i, 7] - a[i, 7]
    d0, d1, d2, d3 = scale * d0, scale * d1, scale * d2, scale * d3
    d4, d5, d6, d7 = scale * d4, scale * d5, scale * d6, scale * d7
    for j in range(NODES):
        a[i, j] = new[i, j]
    return (d0 * d0 + d1 * d1 + (d2 * d2 + d3 * d3)) + (d4 * d4 + d5 * d5 + (d6 * d6 + d7 * d7))


@separate
def farthest(new, i, a):
    """Do what `taken` does; return the largest change."""
    d0, d1, d2, d3 = abs(new[i, 0] - a[i, 0]), abs(new[i, 1] - a[i, 1]), abs(new[i, 2] - a[i, 2]), abs(new[i, 3] - a[i, 3])
    d4, d5, d6, d7 = abs(new[i, 4] - a[i, 4]), abs(new[i, 5] - a[i, 5]), abs(new[i, 6] - a[i, 6]), abs(new[i, 7] - a[i, 7])
    for j in range(NODES):
        a[i, j] = new[i, j]
    return max(max(max(d0, d1), max(d2, d3)), max(max(d4, d5), max(d6, d7)))


@separate
def largest(n, a):
    """Largest magnitude in ``a`` (n, NODES)."""
    top = 0.0
    for i in range(n):
        b0, b1, b2, b3 = abs(a[i, 0]), abs(a[i, 1]), abs(a[i, 2]), abs(a[i, 3])
        b4, b5, b6, b7 = abs(a[i, 4]), abs(a[i, 5]), abs(a[i, 6]), abs(a[i, 7])
        top = max(top, max(max(max(b0, b1), max(b2, b3)), max(max(b4, b5), max(b6, b7))))
    return top


@separate
def defect(n, h, f0, f1, top, a):
    """Interpolated against true accelerations at both ends of a step, relative to the largest force and speed.

    NaN where one of them is no finite number: comparisons leave out what is none.
    """
    worst = none = 0.0
    for i in range(n):
        a0, a1 = 0.0, 0.0
        for k in range(NODES):
            a0 += EDGES[0, k] * a[i, k]
            a1 += EDGES[1, k] * a[i, k]
        worst = max(worst, abs(a0 - f0[n + i]), abs(a1 - f1[n + i]))
        none += 0.0 * (a1 + f0[n + i] + f1[n + i])
        top = max(top, abs(f1[i] / h))
    return worst / top + none if top > 0.0 else none


@separate
def frequency(K, D):
    """Bound on the rate at which variations turn under the derivatives ``K`` and ``D`` (n, n, 1) of the acceleration."""
    stiff = damp = 0.0
    for i in range(K.shape[0]):
        stiffness = damping = 0.0
        for c in range(K.shape[0]):
            stiffness += abs(K[i, c, 0])
            damping += abs(D[i, c, 0])
        stiff, damp = max(stiff, stiffness), max(damp, damping)
    return np.sqrt(stiff) + damp


@separate
def quicken(n, eps, room, D, load):
    """Add to ``load`` (n, NODES) what a frequency changes that is higher by the part ``eps``.

    The step ends at the same phase, after a shorter time.  In the time that it has now, the variation q of the places obeys q' = s,
    s' = K q + D s + load, where the speeds v change by s + eps v.
    """
    v, a = room[1], room[2]
    for i in range(n):
        for j in range(NODES):
            total = -2.0 * a[i, j]
            for c in range(n):
                total += D[i, c, j] * v[c, j]
            load[i, j] += eps * total


@separate
def wished(h, e, aim):
    """Step that would have the defect ``aim``, from one with the defect ``e``."""
    if e == np.inf:
        return 0.25 * h
    return h * min(2.0, max(0.1, 0.9 * (aim / max(e, 1e-30)) ** (1.0 / NODES)))
