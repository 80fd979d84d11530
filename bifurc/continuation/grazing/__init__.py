"""Grazings classified: what touches, what is born there, what a motion does beyond, and the discontinuity maps."""
from importlib import import_module

_NAMES = {
    "Grazing": "classify", "GrazingVerdict": "verdicts", "LocalMotion": "local", "Seen": "confirm", "SlidingClass": "sliding",
    "Touch": "touch", "grazing_of": "classify", "local_motion": "local", "section_map": "discontinuity",
    "sliding_class": "sliding", "touches_of": "touch", "zero_time_map": "discontinuity",
}
__all__ = [*sorted(_NAMES)]


def __getattr__(name):
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__():
    return __all__
