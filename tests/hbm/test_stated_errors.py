"""Stated errors of stick-slip balances against exact orbits: never too small, and not far too large in the median."""
import numpy as np

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce

CASES = ((0.5, 0.1, 0.4, 0.0), (0.8, 0.05, 0.7, 0.0), (1.7, 0.2, 0.3, 0.0), (0.7, 0.1, 0.3, 0.4), (1.4, 0.06, 0.5, 0.3))


def test_the_stated_error_holds_and_is_of_the_right_size():
    """Frequency, damping, friction and speed of the belt; the largest distance over a period, from the event-exact orbit."""
    phases = np.linspace(0.0, 1.0, 400, endpoint=False)
    ratios = []
    for omega, damping, mu, speed in CASES:
        system = bf.System(1.0, damping, 1.0, [HarmonicForce(1.0), Coulomb(mu, belt_speed=speed)], omega=omega)
        exact = bf.find_orbit(system)
        found = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=15))
        assert exact.success and exact.periods == 1 and found.success
        away = np.abs(found.layout.values(found._x, 2.0 * np.pi * phases)[:, 0] - exact._states(phases)[:, 0]).max()
        if away > 1e-9:
            ratios.append(found.how["error"][0] / away)
    assert len(ratios) >= 3 and min(ratios) > 1.0 and np.median(ratios) < 10.0, ratios
