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
    ESCAPING = ("escaping", "The motion is where the fields of both sides leave the surface: it may leave it at any time, to "
                            "either side; begin a little aside.")
    TWO_FOLD = ("two_fold", "The motion comes to a two-fold, where the fields of both sides are tangent to the surface: they do "
                            "not determine how it goes on; begin a little aside.")
    ZENO = ("zeno", "Infinitely many events come to an end in a finite time, and nothing says how the motion goes on: give what "
                    "holds then a mode, or begin behind it.")
    NO_TARGET = ("no_target", "No mode may follow here: both fields lead to a surface on which sliding is not allowed, or a reset "
                              "lands where no mode may begin.")
    CODIMENSION_TWO = ("codimension_two", "The motion meets several surfaces at once, on which the fields of their sides do not "
                                          "determine how it goes on.")
    DIVERGED = ("diverged", "The state left the finite numbers; lower the excitation, or add the damping or the stop "
                            "that bounds it.")
