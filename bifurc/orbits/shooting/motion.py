"""Motion along an event sequence: states at given times, extrema, mean products, and the monodromy matrix.

Between events a coordinate is its own Taylor series a step; maxima are roots of its slope and integrals are Gauss sums
of 16 points a step, so both are exact to rounding.
"""
import numpy as np

from ..._jit import both
from ...compose.tables import ORDER
from ...flow.affine.engine import advance, arc, forcing, propagate, reach, state_series  # noqa: F401  advance is read from here
from ...flow.affine.polynomial import highest
from ...flow.affine.products import premultiply
from ...flow.dense import sample
from ...flow.saltation import joined, saltation
from .sequence import AFTER, BEFORE, DIVIDE, GUARD, TOGETHER, closed_in, reset

_ROOTS, _FACTORS = np.polynomial.legendre.leggauss(16)
NODES, WEIGHTS = tuple(0.5 * (_ROOTS + 1.0)), tuple(0.5 * _FACTORS)  # on (0, 1)


@both
def start_of(T, nodes, U, i, P, x):
    """Write the joined state just after node ``i`` into ``x`` (nx,), the derivative of its jump into ``P`` (ns, nx)."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    base = i * (1 + ns)
    y = np.empty(nx)
    for c in range(ns):
        y[c] = U[base + 1 + c]
    forcing(T, U[base] * 2.0 * np.pi / T.flat[0], y)
    reset(T, nodes[i, BEFORE], nodes[i, GUARD], closed_in(nodes[i]), y, x, P)


@both
def states(T, nodes, span, U, tau, out):
    """Write the states at the sorted times ``tau`` (k,) in [tau_0, tau_0 + span) into ``out`` (k, ns); after an event on it."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    count = nodes.shape[0]
    period = 2.0 * np.pi / T.flat[0]
    x, P = np.empty(nx), np.empty((ns, nx))
    modes, starts, begun = np.empty(count, np.int64), np.empty(count), np.empty((count, ns))
    for i in range(count):
        start_of(T, nodes, U, i, P, x)
        modes[i], starts[i] = nodes[i, AFTER], U[i * (1 + ns)] * period
        for c in range(ns):
            begun[i, c] = x[c]
    index, spans = np.empty(tau.size, np.int64), np.empty(tau.size)
    i = 0
    for k in range(tau.size):
        while i < count - 1 and tau[k] >= U[(i + 1) * (1 + ns)]:
            i += 1
        index[k], spans[k] = i, max(tau[k] - U[i * (1 + ns)], 0.0) * period
    sample(T, modes, starts, begun, index, spans, out)


@both
def measures(T, nodes, span, U, dof, h, out):
    """Write maximum, minimum, mean square, and cosine and sine coefficient at ``h`` omega of a coordinate into ``out`` (5,)."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    count = nodes.shape[0]
    omega = T.flat[0]
    period = 2.0 * np.pi / omega
    x = np.empty(nx)
    after = np.empty(nx)
    a, found, stack = np.empty(ORDER + 1), np.empty(3), np.empty(64)
    P = np.empty((ns, nx))
    top, low, square, cosine, sine = -np.inf, np.inf, 0.0, 0.0, 0.0
    for i in range(count):
        start_of(T, nodes, U, i, P, x)
        m = nodes[i, AFTER]
        begin = U[i * (1 + ns)]
        s = ((U[(i + 1) * (1 + ns)] if i < count - 1 else U[0] + span) - begin) * period
        t = 0.0
        while t < s:
            step = min(reach(T, m, x), s - t)
            state_series(T, m, dof, x, a)
            top, low = max(top, a[0]), min(low, a[0])
            top = highest(a, step, top, found, stack)
            for j in range(ORDER + 1):
                a[j] = -a[j]
            low = -highest(a, step, -low, found, stack)
            for j in range(ORDER + 1):
                a[j] = -a[j]
            for k in range(len(NODES)):
                at = NODES[k] * step
                q = 0.0
                for j in range(ORDER, -1, -1):
                    q = q * at + a[j]
                angle = h * (2.0 * np.pi * begin + omega * (t + at))
                square += WEIGHTS[k] * step * q * q
                cosine += WEIGHTS[k] * step * q * np.cos(angle)
                sine += WEIGHTS[k] * step * q * np.sin(angle)
            propagate(T, m, x, step, after)
            for c in range(nx):
                x[c] = after[c]
            t += step
        top, low = max(top, x[dof]), min(low, x[dof])
    whole = span * period
    factor = 1.0 if h == 0.0 else 2.0
    out[0], out[1], out[2] = top, low, square / whole
    out[3], out[4] = factor * cosine / whole, factor * sine / whole


@both
def monodromy(T, nodes, span, U, M):
    """Write the derivative of the period map at node 0, product of arcs and saltations, into ``M`` (ns, ns).

    Returns the least rate with which a guard is reached; infinite without events.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    count = nodes.shape[0]
    period = 2.0 * np.pi / T.flat[0]
    x = np.empty(nx)
    xp = np.empty(nx)
    y = np.empty(ns)
    P = np.empty((ns, nx))
    S = np.empty((ns, ns))
    Phi = np.empty((ns, ns))
    scratch, when = np.empty((ns, ns)), np.empty(ns)
    moved = np.empty(ns)  # derivative of the time of the last event in the first state
    least = np.inf
    for i in range(ns):
        for c in range(ns):
            M[i, c] = 1.0 if i == c else 0.0
    for i in range(count):
        base = i * (1 + ns)
        before, g, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
        start_of(T, nodes, U, i, P, xp)
        if g >= 0:
            for c in range(ns):
                x[c] = U[base + 1 + c]
            for c in range(ns, nx):
                x[c] = xp[c]
            if i > 0 and nodes[i, DIVIDE] == TOGETHER:
                joined(T, before, after, x, xp, P, moved, M, scratch)
            else:
                least = min(least, saltation(T, before, g, after, x, xp, P, when, S))
                for c in range(ns):
                    moved[c] = 0.0
                    for k in range(ns):
                        moved[c] += when[k] * M[k, c]
                premultiply(S, M, scratch)
        else:
            for r in range(ns):
                for c in range(ns):
                    S[r, c] = P[r, c]
            premultiply(S, M, scratch)
        s = ((U[(i + 1) * (1 + ns)] if i < count - 1 else U[0] + span) - U[base]) * period
        arc(T, after, xp, s, y, Phi)
        premultiply(Phi, M, scratch)
    return least
