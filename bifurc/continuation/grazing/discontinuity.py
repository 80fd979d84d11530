"""Discontinuity maps of a grazing orbit: what a low impact adds to the motion that ignores the stop.

Near a touch let the free motion (as if there were no stop) reach its apex at (y, t) with the depth psi = h(y, t) > 0.  The
zero-time map sends y to the state at the same t that continues the real motion behind the impact, the section map to the
place where that motion, followed back freely, has dh/dt = 0 again.  With u = sqrt(2 psi / |A|), A and J the second and third
derivative of the guard in time, F the derivative of the field in the state, all at (y, t), and rigid stops (class I)

    y' = y - (1 + r) [(|A| u + J u^2 / 3) B + |A| u^2 F B] + O(psi^(3/2)),

and for springs and dashpots that begin to act (class III)

    y' = y - B (4 sqrt(2) / 3) psi^(3/2) / sqrt|A| + O(psi^2).

References
----------
A. B. Nordmark, J. Sound Vib. 145 (1991) 279; M. di Bernardo, C. Budd, A. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical
Systems (2008), sections 2.5 and 6.2-6.4.  The coefficients are derived for the equations above: the impact is found in powers
of u on the free arc, the kick is applied there, and the free motion carries it to the apex.
"""
import numpy as np

from ..conditions import difference
from .guards import field_slope, guard_series, of_law
from .touch import rates

ASIDE = 1e-5  # scaled step of differences of a rate in the state
ORDERS = {"I": 1.5, "III": 2.0}  # of the error in the depth psi


def order(touch) -> float:
    """Return the order in the depth of the error of both maps: 3/2 for rigid stops, 2 for elastic ones."""
    return ORDERS["III" if touch.restitution is None else "I"]


def zero_time_map(touch, y, t):
    """Return the state (ns,) behind the impact, at the same time.

    Parameters
    ----------
    touch : Touch
        Of a grazing orbit: ``point.grazing.touch``.
    y : array_like (ns,)
        State of the free motion at its apex, own units.
    t : float
        Time of the apex, from phase 0.

    Returns
    -------
    ndarray (ns,)
        ``y`` itself where the apex does not lie beyond the stop.
    """
    y = np.array(y, float)
    made = _local(touch, y, t)
    return y if made is None else y + kicked(touch, *made[:3], made[5])


def section_map(touch, y, t):
    """Return (state, time) at which the motion behind the impact, followed freely, crosses dh/dt = 0 near the apex.

    Parameters and errors as for `zero_time_map`; the state is (ns,), the time own units.
    """
    y = np.array(y, float)
    made = _local(touch, y, t)
    if made is None:
        return y, float(t)
    u, apex, jerk, f, f2, F = made
    change = kicked(touch, u, apex, jerk, F)
    row = rate_gradient(touch)
    size = abs(apex)
    if touch.restitution is None:
        move = float(row @ change) / size
        return y + change + f * move, t + move
    r, kappa = touch.restitution, float(row @ (F @ touch.B))
    first = -(1.0 + r) * u
    move = first + (1.0 + r) * u * u * (r * kappa - jerk / (3.0 * size) + (1.0 + r) * jerk / (2.0 * size))
    bent = -(1.0 + r) * size * u * (F @ touch.B)
    return y + change + f * move + bent * first + 0.5 * f2 * first * first, t + move


def rate_gradient(touch):
    """Derivative of dh/dt in the state (ns,)."""
    T = touch.tables
    if not of_law(T, touch.mode, touch.guard):
        return T.GT[touch.mode, touch.guard, :T.A.shape[1], 1]

    def rate(x):
        return guard_series(touch.problem.equations, T, touch.mode, touch.guard, x)[1]
    here = touch.joined(touch.state, touch.time)
    return np.array([difference(rate, here, c, ASIDE * weight) for c, weight in enumerate(touch.problem.weights)])


def kicked(touch, u, apex, jerk, F):
    """Return what the contact adds to the state (ns,) at an apex with depth |A| u^2 / 2; F (ns, ns) is the field's derivative."""
    size = abs(apex)
    if touch.restitution is None:
        return -touch.B * (2.0 / 3.0) * size * u**3  # integral of the depth over the contact
    kick = size * u + jerk * u * u / 3.0
    return -(1.0 + touch.restitution) * (kick * touch.B + size * u * u * (F @ touch.B))


def _local(touch, y, t):
    """Return (u, A, J, field, its rate in time, its derivative in the state) at an apex beyond the stop; None inside.

    Raises
    ------
    ValueError
        For a state that is no apex.
    """
    e, T = touch.problem.equations, touch.tables
    if y.shape != (T.A.shape[1],) or not np.isfinite(y).all():
        raise ValueError(f"y must be a finite state of shape ({T.A.shape[1]},), got {y!r}")
    x = touch.joined(y, t)
    depth = float(e.kernel.guard_value(T, touch.mode, touch.guard, x))
    if depth <= 0.0:
        return None
    apex, jerk = rates(e, T, touch.mode, touch.guard, x)
    if apex >= 0.0:
        raise ValueError(f"the guard has no maximum at y = {y!r}, t = {t!r}: its acceleration is {apex:.6g}, not negative")
    ns = y.size
    f, dw = np.empty(ns), np.empty(x.size - ns)
    e.kernel.field(T, touch.mode, x, f)
    e.kernel.forcing_rate(T, x, dw)
    F = field_slope(e, T, touch.mode, x)
    f2 = F[:, :ns] @ f + F[:, ns:] @ dw
    return np.sqrt(2.0 * depth / abs(apex)), apex, jerk, f, f2, F[:, :ns]
