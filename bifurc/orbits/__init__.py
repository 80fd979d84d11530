"""Periodic orbits: found by simulation and event-sequence shooting, with multipliers and exact measures."""
from importlib import import_module

_NAMES = {"PeriodicOrbit": "orbit", "OrbitStatus": "kinds", "find_orbit": "find", "lyapunov_exponents": "lyapunov"}
__all__ = sorted(_NAMES)


def __getattr__(name):
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__():
    return __all__
