"""Continuation: branches of solutions in a parameter, their special points, and branches that cross them."""
from ..lazy import lazy

_NAMES = {
    "Branch": "branch", "ContinuationError": "kinds", "Corrected": "problem", "CorrectorStatus": "kinds",
    "deflated_orbits": "deflation", "deflated_solutions": "deflation", "isolas": "deflation", "LocationStatus": "kinds",
    "Monitor": "problem", "ParameterCurve": "curves", "Problem": "problem", "SpecialPoint": "special",
    "SpecialPointKind": "kinds", "SpecialPoints": "special", "StopReason": "kinds", "switch_branch": "switching",
    "trace": "tracing", "trace_curve": "curves",
}
_MODULES = ("grazing", "maps")
__all__ = [*sorted(_NAMES), *_MODULES]
__getattr__, __dir__ = lazy(__name__, _NAMES, _MODULES)
