"""Derivative of the motion through an event: the saltation matrix, in one place for all that need it.

    S = R_y + (f+ - R_y f- - R_t) h_y / (h_y f- + h_t)

with the jump R of the event (kicks and memory writes, `bifurc.flow.rule`), its guard h, and the vector fields on both
sides.  It is singular where the guard is reached with zero rate (grazing): the rate is returned, and callers say so.

Two kicks at one instant have a derivative only when both orders of the kicks agree (`order_gap`).
"""
import numpy as np

from .._jit import njit
from .affine.engine import field, forcing_rate, guard_gradient
from .rule import jump


@njit
def saltation(T, before, g, after, x, xp, P, S):
    """Write the derivative (ns, ns) of the state after the event in the state before into ``S``; return the rate of the guard.

    ``x`` and ``xp`` (nx,) are the states on both sides, ``P`` (ns, nx) is the derivative of the jump, see `rule.jump`.
    """
    ns, nx = P.shape
    f, fp = np.empty(ns), np.empty(ns)
    dw, row = np.empty(nx - ns), np.empty(nx)
    field(T, before, x, f)
    field(T, after, xp, fp)
    forcing_rate(T, x, dw)
    guard_gradient(T, before, g, x, row)
    rate = 0.0
    for c in range(nx):
        rate += row[c] * (f[c] if c < ns else dw[c - ns])
    for i in range(ns):
        jump = fp[i]
        for c in range(nx):
            jump -= P[i, c] * (f[c] if c < ns else dw[c - ns])
        for c in range(ns):
            S[i, c] = P[i, c] + jump * row[c] / rate
    return rate


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
            P, S, z = np.empty((ns, y.size)), np.empty((ns, ns)), np.empty(y.size)
            jump(T, mode, g, False, y, z, P)
            saltation(T, mode, g, mode, y, z, P, S)
            total = S @ total
            y = z
        both.append((y, total))
    (y1, S1), (y2, S2) = both
    if np.abs(y1 - y2).max() > tolerance * np.abs(y1).max():
        return np.inf
    return float(np.abs(S1 - S2).max() / max(np.abs(S1).max(), np.abs(S2).max()))
