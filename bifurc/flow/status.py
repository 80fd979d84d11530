"""How a motion ended."""
from enum import StrEnum


class Status(StrEnum):
    """Outcome of a simulation; `sentence` says what to try."""

    COMPLETED = "completed"
    TOO_MANY_EVENTS = "too_many_events"
    INCONSISTENT = "inconsistent"
    DIVERGED = "diverged"

    @property
    def sentence(self) -> str:
        """What it means, and what to try."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.COMPLETED: "The motion reached its end time.",
    Status.TOO_MANY_EVENTS: "A period held more events than max_events; raise max_events, or lower the restitution if an "
                            "infinite sequence with a ratio near 1 is meant to complete.",
    Status.INCONSISTENT: "No combination of modes may follow an event; the contacts contradict each other at this state.",
    Status.DIVERGED: "The state left the finite numbers; lower the excitation, or add the damping or the stop that bounds it.",
}
