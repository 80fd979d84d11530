"""Names of what can happen at an event."""
from enum import StrEnum


class EventKind(StrEnum):
    """Kind of an event; the position in ``tuple(EventKind)`` is the code that kernels carry: to them a known time is a reset."""

    IMPACT = "impact"  # a rigid stop is hit and its impact law acts
    RELEASE = "release"  # a held row is let go: the contact force of a rest has fallen to zero
    CONTACT = "contact"  # a deformable contact begins
    STICK = "stick"  # sliding stops
    SLIP = "slip"  # sticking ends
    CHATTER = "chatter"  # chattering has completed
    GRAZE = "graze"  # a surface was touched with zero speed
    SEPARATION = "separation"  # a deformable contact ends
    CROSS = "cross"  # a surface is passed, behind which another field acts
    SLIDE_BEGIN = "slide_begin"  # a surface is met, along which the motion slides
    SLIDE_END = "slide_end"  # a slide along a surface ends
    RESET = "reset"  # a reset acts
    CLOCK = "clock"  # a known time has come

    @property
    def code(self) -> int:
        """The integer of the tables."""
        return _CODES[self]


_CODES = {kind: code for code, kind in enumerate(EventKind)} | {EventKind.CLOCK: list(EventKind).index(EventKind.RESET)}
