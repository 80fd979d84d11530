"""Continuation: branches of solutions in a parameter, their special points, and branches that cross them.

`tracing` is the verb: it takes `steps` (predict, correct, judge, what lies in a step) of a `problem` and gives one of the
`branches`.  What is continued: event sequences (`shooting`), harmonic balance (`balance`), `maps`, `equilibria`,
`free_vibration`; `curves` follow special points in two parameters, `grazing` classifies a touch.  Start reading at `tracing`.
"""
from ..lazy import lazy

_NAMES = {
    "Branch": "branches.branch", "ContinuationError": "kinds", "Corrected": "problem", "CorrectorStatus": "kinds",
    "deflated_orbits": "deflation", "deflated_solutions": "deflation", "isolas": "deflation", "LocationStatus": "kinds",
    "Monitor": "problem", "ParameterCurve": "curves.tracing", "Problem": "problem", "SpecialPoint": "branches.special",
    "SpecialPointKind": "kinds", "SpecialPoints": "branches.special", "StopReason": "kinds", "switch_branch": "switching",
    "trace": "tracing", "trace_curve": "curves.tracing",
}
_MODULES = ("grazing", "maps")
__all__ = [*sorted(_NAMES), *_MODULES]
__getattr__, __dir__ = lazy(__name__, _NAMES, _MODULES)
