"""Events that meet the clock: known instants change places with what the motion does.

Where the clock does something (a level, a pulse) that is a border collision.  Where it does nothing that forces feel (a motion that is
put back by its shift, the half of a period that separates two pulses) it is no special point.
"""
from ...elements import EventKind, Shift
from ...orbits.shooting.sequence import AFTER
from .signature_change import listed, named_events, turns, without

KNOWN = {EventKind.CLOCK.value, EventKind.RESET.value}
ACTING, IDLE = "acting", "idle"


def met(problem, other) -> str | None:
    """Return how an event changes places with a clock between the sequences of two problems: `ACTING` or `IDLE`; None: it does not."""
    one, two = (named_events(end, listed(end), True) for end in (problem, other))
    if problem.scene.n == 0 or not any(event[1] in KNOWN for event in one) or sorted(one) != sorted(two) or turns(one) & turns(two):
        return None
    moved = {event for event in one if without(one, event) & without(two, event)}
    if not any(event[1] in KNOWN for event in moved):
        return None
    return IDLE if moved & idle(problem) else ACTING


def idle(problem) -> set[tuple]:
    """Return the events of a sequence, see `signature_change.named_events`, that change no force."""
    scene, nodes = problem.scene, problem.sequence.nodes
    chosen = nodes[listed(problem)]
    names = named_events(problem, listed(problem), True)
    return {name for name, (mode, guard) in zip(names, chosen[:, :AFTER].tolist(), strict=True)
            if (scene.guard(mode, guard).guard.silent or isinstance(scene.system.elements[name[0]], Shift))}
