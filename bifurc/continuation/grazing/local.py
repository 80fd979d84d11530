"""What the discontinuity map of a touch makes of a motion beyond it: the verdict at a finite distance.

A verdict holds in the limit.  Where some s_k is below zero, a motion is thrown back until its impacts have the speed
2 |A_g| (1 + r) |s_k|, however near the grazing is; where that is small, a given distance does not tell it from the speed of a first
touch.  The deviation z of a motion from the free orbit, taken at the phase of the touch, is therefore followed with both orders of
the map.  The free motion has its apex at tau = g z / |A| (g: gradient of dh/dt) with the depth psi + h z + (g z)^2 / (2 |A|), there
it is changed by the zero-time map, and

    z -> E [z + (1 - tau F) change],    F the derivative of the field.

References
----------
A. B. Nordmark, J. Sound Vib. 145 (1991) 279; M. di Bernardo, C. Budd, A. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical
Systems (2008), section 6.3.
"""
import math
from dataclasses import dataclass

import numpy as np

from ...content import Content
from .confirm import FAR, apex_growth
from .discontinuity import kicked, rate_gradient
from .guards import field_slope

PERIODS = 3000  # iterated
LAST = 200  # looked at
OUT = 30.0  # speeds of a first touch beyond which the map has thrown the motion out


@dataclass(frozen=True, eq=False)
class LocalMotion(Content):
    """What the map of a touch does at a distance beyond it.

    Attributes
    ----------
    eps : float
        Distance beyond the grazing, relative to the parameter.
    speed : float
        Largest rate of the guard at an impact, after transients; above 30 of ``first`` the iteration has stopped.
    first : float
        That of a first touch.
    """

    eps: float
    speed: float
    first: float

    @property
    def small(self) -> bool:
        """Whether the map keeps the motion near, in the sense of `Seen.small`."""
        return self.speed <= FAR * self.first


def local_motion(touch, eps: float) -> LocalMotion | None:
    """Return what the discontinuity map of a rigid touch makes of the motion that starts on the touching orbit.

    Parameters
    ----------
    touch : Touch
    eps : float
        Distance beyond the grazing, relative to the parameter; either side may be beyond.

    Returns
    -------
    LocalMotion or None
        None for elastic contacts, and where no side is beyond.
    """
    growth = apex_growth(touch)
    if touch.restitution is None or growth == 0.0 or not math.isfinite(growth):
        return None
    p = float(touch.x[-1])
    depth = abs(growth) * eps * (abs(p) if p else touch.problem.parameter_scale)
    size, E, h, g = abs(touch.apex), touch.E, touch.h, rate_gradient(touch)
    x = touch.joined(touch.state, touch.time)
    F = field_slope(touch.problem.equations, touch.tables, touch.mode, x)[:, :touch.state.size]
    first = math.sqrt(2.0 * depth * size)
    z, largest = np.zeros(touch.state.size), 0.0
    for k in range(PERIODS):
        tau = float(g @ z) / size
        top = depth + float(h @ z) + 0.5 * size * tau * tau
        if top > 0.0:
            u = math.sqrt(2.0 * top / size)
            if k >= PERIODS - LAST or size * u > OUT * first:
                largest = max(largest, size * u)
                if largest > OUT * first:
                    break
            change = kicked(touch, u, touch.apex, touch.jerk, F)
            z = z + change - tau * (F @ change)
        z = E @ z
    return LocalMotion(eps, largest, first)
