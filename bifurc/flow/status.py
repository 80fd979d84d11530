"""How a motion ended."""
from ..enumerations import DescribedEnum


class Status(DescribedEnum):
    """Outcome of a simulation; `sentence` says what to try."""

    COMPLETED = "completed", "The motion reached its end time."
    TOO_MANY_EVENTS = ("too_many_events", "A period held more events than max_events; raise max_events, or lower the "
                                          "restitution if an chattering with a ratio near 1 is meant to "
                                          "complete.")
    INCONSISTENT = ("inconsistent", "No combination of modes may follow an event; the contacts contradict each other "
                                    "at this state.")
    DIVERGED = ("diverged", "The state left the finite numbers; lower the excitation, or add the damping or the stop "
                            "that bounds it.")
