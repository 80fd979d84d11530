"""Derivative of the motion through an event: the saltation matrix, in one place for all that need it.

    S = R_y + (f+ - R_y f- - R_t) h_y / (h_y f- + h_t)

with the jump R of the event (kicks and memory writes, `bifurc.flow.rule`), its guard h, and the vector fields on both
sides.  It is singular where the guard is reached with zero rate (grazing): the rate is returned, and callers say so.

An event that always happens with the one before it, at which its own guard may begin with zero rate, has the time of that one.
Two kicks at one instant have a derivative only when both orders of the kicks agree (`order_gap`).
"""
import numpy as np

from .._jit import njit
from .affine.engine import field, forcing_rate, guard_gradient, guard_rate
from .affine.products import premultiply
from .rule import jump


@njit
def saltation(T, before, g, after, x, xp, P, when, S):
    """Write the derivative (ns, ns) of the state after the event in the state before into ``S``, that of the time of the event into
    ``when`` (ns,); return the rate of the guard.

    ``x`` and ``xp`` (nx,) are the states on both sides, ``P`` (ns, nx) is the derivative of the jump, see `rule.jump`.
    """
    ns, nx = P.shape
    f, dw, row, leap = np.empty(ns), np.empty(nx - ns), np.empty(nx), np.empty(ns)
    delayed(T, before, after, x, xp, P, f, dw, leap)
    guard_gradient(T, before, g, x, row)
    rate = guard_rate(row, f, dw)
    for c in range(ns):
        when[c] = -row[c] / rate
    for i in range(ns):
        for c in range(ns):
            S[i, c] = P[i, c] + leap[i] * when[c]
    return rate


@njit
def joined(T, before, after, x, xp, P, when, M, scratch):
    """M <- the derivative (ns, ns) of the state after an event that always happens with the one before it, in the variables of M.

    ``M`` is that of the state before it, ``when`` (ns,) that of the time of the event before; ``scratch`` (ns, ns) is room, other
    arguments as of `saltation`.
    """
    ns, nx = P.shape
    f, dw, leap = np.empty(ns), np.empty(nx - ns), np.empty(ns)
    delayed(T, before, after, x, xp, P, f, dw, leap)
    premultiply(P, M, scratch)
    for i in range(ns):
        for c in range(ns):
            M[i, c] += leap[i] * when[c]


@njit
def delayed(T, before, after, x, xp, P, f, dw, leap):
    """Write the derivative of the state after an event in its time into ``leap`` (ns,), the field before it into ``f`` (ns,) and
    the rates of the forcing into ``dw``; other arguments as of `saltation`."""
    ns, nx = P.shape
    fp = np.empty(ns)
    field(T, before, x, f)
    field(T, after, xp, fp)
    forcing_rate(T, x, dw)
    for i in range(ns):
        leap[i] = -fp[i]
        for c in range(nx):
            leap[i] += P[i, c] * (f[c] if c < ns else dw[c - ns])


def order_gap(scene, mode: int, first: int, second: int, x, tolerance: float = 1e-9):
    """Return how far the derivatives of two simultaneous kicks taken in both orders differ, relative to their size.

    Parameters
    ----------
    scene : Scene
    mode : int
    first, second : int
        Guards of `mode` that both arrive at `x`, each with a kick.
    x : ndarray
        State (nx,) with forcing, before the kicks.

    Returns
    -------
    gap : float
        0 where the derivative does not depend on the order; ``inf`` where even the states after the kicks differ.
    """
    T = scene.tables
    ns = scene.ns
    both = []
    for order in ((first, second), (second, first)):
        y = np.array(x, float)
        total = np.eye(ns)
        for g in order:
            P, S, z, when = np.empty((ns, y.size)), np.empty((ns, ns)), np.empty(y.size), np.empty(ns)
            jump(T, mode, g, 0, y, z, P)
            saltation(T, mode, g, mode, y, z, P, when, S)
            total = S @ total
            y = z
        both.append((y, total))
    (y1, S1), (y2, S2) = both
    if np.abs(y1 - y2).max() > tolerance * np.abs(y1).max():
        return np.inf
    return float(np.abs(S1 - S2).max() / max(np.abs(S1).max(), np.abs(S2).max()))
