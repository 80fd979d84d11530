"""Periodic orbits: found by simulation and event-sequence shooting, with multipliers and exact measures."""
from ..lazy import lazy

_NAMES = {"PeriodicOrbit": "orbit", "OrbitStatus": "kinds", "find_orbit": "find", "lyapunov_exponents": "lyapunov"}
__all__ = sorted(_NAMES)
__getattr__, __dir__ = lazy(__name__, _NAMES)
