"""Names of the changes of systems of first order: where a slide is born, or is parted by a flight, or is preceded by one.

Of two sequences the richer has an interval more, which lasts no time at the change: a slide or a stay in a region.  di Bernardo,
Budd, Champneys, Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 8.
"""
import numpy as np

from ...elements import EventKind
from ...orbits.shooting.sequence import AFTER, BEFORE, GUARD
from ..kinds import SpecialPointKind

K = SpecialPointKind


def change(problem, x, other, spans) -> SpecialPointKind:
    """Return the kind of the change from the sequence of ``problem``, which ends at ``x`` (n + 1,), to that of ``other``; ``spans``
    gives the durations of intervals."""
    richer, at = (problem, x) if problem.sequence.events > other.sequence.events else (other, other.x0)
    nodes, scene = richer.sequence.nodes, richer.scene
    shortest = int(np.argmin(spans(richer, at)))
    ends = [(int(nodes[i, BEFORE]), int(nodes[i, GUARD])) for i in (shortest - 1, shortest)]
    if any(guard >= 0 and scene.event_kind(mode, guard) is EventKind.CLOCK for mode, guard in ends):
        return K.BORDER_COLLISION  # an event meets the clock
    earlier, own, later = (int(mode) for mode in (nodes[shortest - 1, BEFORE], nodes[shortest, BEFORE], nodes[shortest, AFTER]))
    if scene.slides(own):  # between one region and itself a flight touches the surface, between two a crossing becomes a slide
        return K.GRAZING_SLIDING if earlier == later else K.CROSSING_SLIDING
    beside = scene.slides(earlier) + scene.slides(later)  # a crossing before a slide, a slide that is parted in two
    return (K.GRAZING, K.SWITCHING_SLIDING, K.ADDING_SLIDING)[beside]
