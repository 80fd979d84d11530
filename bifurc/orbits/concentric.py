"""Systems in which no direction is special: turning every body about the origin is the same as waiting.

A rotor and its unbalance in a concentric stator.  Motions that rub part of the time then come in rings of equals, and most
are tori in the fixed frame: Newton on a stroboscopic map has no isolated solution (Zhang 2008, section 4.2).
"""
import numpy as np

from ..elements import Circle, ConstantForce, HarmonicForce
from ..system import System

EQUAL = 1e-12  # relative


def concentric(system: System) -> bool:
    """Return whether a turn of all bodies about the origin is known to be a shift in time: matrices that no turn changes,
    isotropic elements around the origin, and loads that turn with the excitation."""
    n = system.n
    turn = generator(system)
    if turn is None or any(np.abs(A @ turn - turn @ A).max() > EQUAL * np.abs(A).max()
                           for A in (system.mass, system.damping, system.stiffness)):
        return False
    constant = np.zeros(n)
    loads: dict[int, np.ndarray] = {}
    for element in system.elements:
        if isinstance(element, ConstantForce):
            constant += element.site(n).R.T @ [element.force]
        elif isinstance(element, HarmonicForce):
            load = element.site(n).R.T @ [element.amplitude * np.exp(1j * element.phase)]
            loads[element.harmonic] = loads.get(element.harmonic, 0.0) + load
        elif not element.isotropic:
            return False
    size = max([np.abs(load).max() for load in loads.values()], default=0.0)
    first = loads.pop(1, np.zeros(n))
    still = np.abs(constant).max() == 0.0 and all(np.abs(load).max() <= EQUAL * size for load in loads.values())
    return still and any(np.abs(turn @ first - way * first).max() <= EQUAL * size for way in (1j, -1j))


def generator(system: System) -> np.ndarray | None:
    """Return the rate (n, n) at which a turn moves the coordinates, from the planes that the elements act in; None: they have
    none, are not around the origin, or leave coordinates without a plane."""
    n = system.n
    turn = np.zeros((n, n))
    sites = [element.site(n) for element in system.elements if element.isotropic]
    for site in sites:
        if isinstance(site, Circle) and any(site.centre):
            return None
        for x, y in zip(np.flatnonzero(site.R[0]), np.flatnonzero(site.R[1]), strict=False):
            turn[y, x], turn[x, y] = 1.0, -1.0
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    fits = all(site.R.shape[0] == 2 and np.array_equal(site.R @ turn, quarter @ site.R) for site in sites)
    return turn if fits and sites and np.array_equal(turn @ turn, -np.eye(n)) else None
