"""Chains of masses and springs with a stop on one of them (Zhang 2008, section 3.1)."""
import numpy as np

from ..checks import whole
from ..elements import HarmonicForce, RigidStop
from ..system import System, builder


@builder
def impact_chain(*, n: int = 8, mass: float = 1.0, stiffness: float = 1.0, damping: float = 0.1, omega: float = 0.3,
                 amplitude: float = 0.45, gap: float = 1.0, restitution: float = 0.7, stopped: int = -1,
                 loaded: int = -1) -> System:
    """n equal masses in a row, springs wall-1, 1-2, ..., free end at mass n; a stop on one of them.

    M = mass I, C = damping K, load amplitude cos(omega t).  With the defaults the motion with one impact a period is
    stable; it is unstable, with tori around, between the Neimark-Sacker points 0.3680548439509 and 0.4271803952557 of
    `amplitude`.

    Parameters
    ----------
    n : int
        Number of masses.
    mass, stiffness : float
        Of each mass and each spring.
    damping : float
        Factor of the stiffness-proportional damping, time.
    omega, amplitude : float
        Frequency and size of the load.
    gap : float
        Distance of the stop from the mass at rest.
    restitution : float
        0 (plastic) to 1 (elastic).
    stopped, loaded : int
        Mass that hits the stop and mass that is loaded, from 0; negative ones count from the end.
    """
    whole("impact_chain", "n", n, least=1, most=10_000)
    places = [whole("impact_chain", name, place, least=-n, most=n - 1) % n
              for name, place in (("stopped", stopped), ("loaded", loaded))]
    K = stiffness * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[-1, -1] = stiffness
    elements = (HarmonicForce(amplitude, dof=places[1]), RigidStop(gap, restitution, dof=places[0]))
    return System(mass * np.eye(n), damping * K, K, elements, omega=omega)
