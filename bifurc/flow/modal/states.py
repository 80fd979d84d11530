"""States in modal coordinates: derivative of an arc, Taylor series of a state and how far they reach (`flow.modal.steps`)."""
import numpy as np

from ..._jit import njit
from ...compose.tables import ORDER
from ..affine.hidden import ROUNDING
from .steps import TRUNCATED, amplitudes, blur_of, from_modal, good_for, level_of, slow, to_modal, turn


@njit
def modal_arc(T, m, x, s, y1, Phi):
    """Write the state (ns,) after ``s``, and its derivative (ns, ns) in the state at the start: V exp(s Lambda) L."""
    ns, nx = y1.size, x.size
    p, r, d = T.blocks[m, 0], T.blocks[m, 1], T.blocks[m, 2]
    V, L = T.V, T.L
    xi, one, out = np.empty(nx), np.empty(nx), np.empty(nx)
    to_modal(T, m, x, xi)
    turn(T, m, s, xi)
    from_modal(T, m, xi, out)
    turned, block = np.zeros((2, nx)), np.zeros((d, d))  # rows of exp(s Lambda): a pair's are (c, -b), (b, c)
    one[:] = 0.0
    for j in range(p):
        one[2 * j] = 1.0
    one[2 * p:2 * p + r] = 1.0
    turn(T, m, s, one)
    for j in range(p):
        turned[0, 2 * j], turned[1, 2 * j] = one[2 * j], one[2 * j + 1]
    turned[0, 2 * p:2 * p + r] = one[2 * p:2 * p + r]
    for k in range(d):
        one[:] = 0.0
        one[2 * p + r + k] = 1.0
        slow(T, m, s, one)
        block[:, k] = one[2 * p + r:]
    moved = np.zeros((nx, ns))  # exp(s Lambda) L
    for j in range(p):
        c, b = turned[0, 2 * j], turned[1, 2 * j]
        for k in range(ns):
            moved[2 * j, k] = c * L[m, 2 * j, k] - b * L[m, 2 * j + 1, k]
            moved[2 * j + 1, k] = b * L[m, 2 * j, k] + c * L[m, 2 * j + 1, k]
    for j in range(2 * p, 2 * p + r):
        for k in range(ns):
            moved[j, k] = turned[0, j] * L[m, j, k]
    for i in range(d):
        for q in range(d):
            for k in range(ns):
                moved[2 * p + r + i, k] += block[i, q] * L[m, 2 * p + r + q, k]
    for i in range(ns):
        y1[i] = out[i]
        for k in range(ns):
            Phi[i, k] = 0.0
        for j in range(nx):
            v = V[m, i, j]
            if v != 0.0:
                for k in range(ns):
                    Phi[i, k] += v * moved[j, k]


@njit
def modal_reach(T, m, x):
    """Longest duration from ``x`` on which the series of every state are good."""
    nx, V, spin = x.size, T.V, T.spin
    p, r = T.blocks[m, 0], T.blocks[m, 1]
    xi, size = np.empty(nx), np.empty(nx)
    to_modal(T, m, x, xi)
    amplitudes(T, m, xi, size)
    least = np.inf  # of terms over terms times rate**(ORDER+1) / (ORDER+1)!
    rates = np.zeros(nx)
    for c in range(2 * p + r):
        rates[c] = np.hypot(spin[m, c, 0], spin[m, c, 1])
    rates[2 * p + r:] = spin[m, 2 * p + r, 0]
    factor = 1.0
    for j in range(1, ORDER + 2):
        factor *= j
    for c in range(nx):
        rates[c] = rates[c]**(ORDER + 1) / factor
    for i in range(T.A.shape[1]):
        terms, wrong = 0.0, 0.0
        for j in range(p):
            part = np.hypot(V[m, i, 2 * j], V[m, i, 2 * j + 1]) * size[2 * j]
            terms += part
            wrong += part * rates[2 * j]
        for c in range(2 * p, nx):
            part = abs(V[m, i, c]) * size[c]
            terms += part
            wrong += part * rates[c]
        if wrong > 0.0:
            least = min(least, TRUNCATED * terms / wrong)
    return T.level[m, level_of(T, m, least)]


@njit
def modal_state_series(T, m, i, x, a):
    """Write the Taylor coefficients (ORDER+1,) of state ``i`` from ``x`` (nx,)."""
    nx, V, spin, N = x.size, T.V, T.spin, T.N
    p, r, d = T.blocks[m, 0], T.blocks[m, 1], T.blocks[m, 2]
    xi = np.empty(nx)
    to_modal(T, m, x, xi)
    for j in range(ORDER + 1):
        a[j] = 0.0
    for j in range(p):
        b, w, g, h = spin[m, 2 * j, 0], spin[m, 2 * j, 1], V[m, i, 2 * j], V[m, i, 2 * j + 1]
        u, v = g * xi[2 * j] + h * xi[2 * j + 1], g * xi[2 * j + 1] - h * xi[2 * j]  # (g - i h) (xi_1 + i xi_2)
        for k in range(ORDER + 1):
            a[k] += u
            u, v = (b * u - w * v) / (k + 1), (w * u + b * v) / (k + 1)
    for j in range(2 * p, 2 * p + r):
        u = V[m, i, j] * xi[j]
        for k in range(ORDER + 1):
            a[k] += u
            u *= spin[m, j, 0] / (k + 1)
    begin, power, term = 2 * p + r, xi[2 * p + r:].copy(), np.empty(d)
    for k in range(ORDER + 1):
        for c in range(d):
            a[k] += V[m, i, begin + c] * power[c]
            total = 0.0
            for q in range(d):
                total += N[m, c, q] * power[q]
            term[c] = total / (k + 1)
        for c in range(d):
            power[c] = term[c]


@njit
def modal_hidden(T, m, g, x):
    """Whether guard ``g`` is zero to the rounding of the sum over the modes at ``x`` (nx,)."""
    xi, size, value = np.empty(x.size), np.empty(x.size), 0.0
    to_modal(T, m, x, xi)
    amplitudes(T, m, xi, size)
    for c in range(x.size):
        value += T.G[m, g, c] * x[c]
    return abs(value) <= blur_of(x.size) * good_for(T, m, g, size)[1]


@njit
def modal_blurred(T, m, x, scale):
    """Raise ``scale`` (nx,) to the sums over the modes that states of ``x`` (nx,) are, but for those that are exactly zero."""
    xi, size, p = np.empty(x.size), np.empty(x.size), T.blocks[m, 0]
    to_modal(T, m, x, xi)
    amplitudes(T, m, xi, size)
    for i in range(T.A.shape[1]):
        total = 0.0
        for j in range(p):
            total += np.hypot(T.V[m, i, 2 * j], T.V[m, i, 2 * j + 1]) * size[2 * j]
        for c in range(2 * p, x.size):
            total += abs(T.V[m, i, c]) * size[c]
        if x[i] != 0.0:
            scale[i] = max(scale[i], blur_of(x.size) / ROUNDING * total)
