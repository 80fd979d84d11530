"""Periodic orbits: found by simulation and event-sequence shooting, with multipliers and exact measures.

`find` decides how an orbit is looked for; `forced` and `autonomous` give its event signature, `shooting` solves the equations of
one, `orbit` is the result with its audit.  `balance` finds orbits by harmonic balance, `equilibria` states of rest; `lyapunov`
measures motions that are not periodic.  Start reading at `find`.
"""
from ..lazy import lazy

_NAMES = {"PeriodicOrbit": "orbit", "OrbitStatus": "kinds", "find_orbit": "find", "lyapunov_exponents": "lyapunov"}
__all__ = sorted(_NAMES)
__getattr__, __dir__ = lazy(__name__, _NAMES)
