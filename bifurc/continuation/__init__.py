"""Continuation: branches of solutions in a parameter, their special points, and branches that cross them."""
from importlib import import_module

_NAMES = {
    "Branch": "branch", "ContinuationError": "kinds", "Corrected": "problem", "CorrectorStatus": "kinds",
    "deflated_orbits": "deflation", "deflated_solutions": "deflation", "isolas": "deflation", "LocationStatus": "kinds",
    "Monitor": "problem", "ParameterCurve": "curves", "Problem": "problem", "SpecialPoint": "special",
    "SpecialPointKind": "kinds", "SpecialPoints": "special", "StopReason": "kinds", "switch_branch": "switching",
    "trace": "tracing", "trace_curve": "curves",
}
_MODULES = ("grazing", "maps")
__all__ = [*sorted(_NAMES), *_MODULES]


def __getattr__(name):
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__():
    return __all__
