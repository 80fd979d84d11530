"""What a period of simulation costs, estimated before it is paid."""
import functools
import warnings

import numpy as np

from ..system import System

SLOW = 2e8  # multiplications a period from which a simulation takes about a second


class StiffModelWarning(UserWarning):
    """A model whose fastest modes make simulation slow; the message says what to do."""


def fastest(system: System) -> float:
    """Return the frequency of the fastest motion of the linear core, radians per time."""
    return float(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness))).max()))


@functools.lru_cache(maxsize=32)
def period_cost(system: System) -> float:
    """Return the multiplications that one period of simulation takes, about; 0 for few degrees of freedom.

    Steps of Taylor series reach about one radian of the fastest motion; each costs 16 products of state matrix and state.
    """
    if system.period is None or system.n < 3:
        return 0.0
    return 16.0 * (2.0 * system.n)**2 * max(fastest(system) * system.period, 1.0)


def warn_if_slow(system: System, stacklevel: int = 3) -> None:
    """Warn when a period of simulation takes longer than about a second, and say what to do."""
    if system.n >= 3 and period_cost(system) > SLOW:
        top = fastest(system)
        warnings.warn(StiffModelWarning(
            f"{system.n} degrees of freedom with motions up to {top:.3g} rad/time against omega = {system.omega:.3g}: every period "
            f"takes {top * (system.period or 0.0):.2g} steps and more. Keep the coordinates of the contacts and a few modes: "
            "system.reduced(keep=[...], modes=12)"), stacklevel=stacklevel)
