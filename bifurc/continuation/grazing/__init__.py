"""Grazings classified: what touches, what is born there, what a motion does beyond, and the discontinuity maps."""
from ...lazy import lazy

_NAMES = {
    "Grazing": "classify", "GrazingVerdict": "verdicts", "LocalMotion": "local", "Seen": "confirm", "SlidingClass": "sliding",
    "Touch": "touch", "grazing_of": "classify", "local_motion": "local", "section_map": "discontinuity",
    "sliding_class": "sliding", "touches_of": "touch", "zero_time_map": "discontinuity",
}
__all__ = [*sorted(_NAMES)]
__getattr__, __dir__ = lazy(__name__, _NAMES)
