"""Modes of Jenkins oscillators whose slider is stiff, or all that holds the mass, against an integration by parts."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.elements import Jenkins


def after_a_period(spring, k, limit, damping, state, period):
    """Return (q, v) a period after (q, v, z): q'' = -damping v - spring q - f with f = k (q - z), or the limit where it slips."""
    (q, v, z), t, slips = state, 0.0, 0.0
    slips = float(np.sign(q - z)) if abs(k * (q - z)) >= limit * (1.0 - 1e-12) and (q - z) * v > 0.0 else 0.0
    while t < period * (1.0 - 1e-14):
        def rate(_, y, slips=slips, z=z):
            return y[1], -damping * y[1] - spring * y[0] - (slips * limit if slips else k * (y[0] - z))

        def yields(_, y, z=z):
            return abs(k * (y[0] - z)) - limit

        def turns(_, y):
            return y[1]

        event = turns if slips else yields
        event.terminal, event.direction = True, -slips if slips else 1.0
        part = solve_ivp(rate, (t, period), (q, v), "DOP853", events=event, rtol=1e-12, atol=1e-14)
        (q, v), t = part.y[:, -1], part.t[-1]
        if part.status == 1:
            if slips:
                z, slips = q - slips * limit / k, 0.0
            else:
                slips = float(np.sign(q - z))
    return q, v


@pytest.mark.parametrize("spring, k, top, count", [(1.0, 100.0, 1000.0, 15), (1.0, 30.0, 30.0, 9), (0.0, 1.0, 5.0, 8)])
def test_a_backbone_by_shooting_goes_on_where_sliding_takes_most_of_a_swing(spring, k, top, count):
    """The damping ratio passes 1 on two of them, and small errors grow by thousands in a period."""
    system = bf.System(1.0, 0.0, spring, [Jenkins(k, 1.0)])
    found = bf.backbone(system, np.geomspace(1e-3, top, count))
    assert found.message == "" and len(found.modes) == count
    assert found.damping.max() > 0.5
    assert found.omega[0] == pytest.approx(np.sqrt(spring + k), rel=1e-12) and found.damping[0] == 0.0  # it sticks
    for mode in found.modes:
        grown = np.exp(mode.xi * mode.period)
        q, v = after_a_period(spring, k, 1.0, -mode.xi, mode.state, mode.period)
        assert q == pytest.approx(mode.amplitude, abs=1e-9 * grown * mode.amplitude)
        assert v == pytest.approx(0.0, abs=1e-9 * grown * mode.amplitude * mode.omega)


def test_a_backbone_that_sliding_ends_says_so():
    found = bf.backbone(bf.System(1.0, 0.0, 0.0, [Jenkins(1.0, 1.0)]), np.geomspace(0.1, 100.0, 13))
    assert found.damping[-1] > 1.0 and "contacts take out in a period more than the motion holds" in found.message
