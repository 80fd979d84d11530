"""What is to be proved: a periodic motion as a list of events with times and states, read from a solution of the package."""
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from ..elements.friction.together import mode_of
from ..orbits.shooting.labels import Labels
from ..orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, GUARD, TOGETHER
from ..orbits.shooting.signature import repeated
from ..system import System
from .model import Refused


@dataclass(frozen=True, eq=False)
class Event:
    """An instant of the sequence.

    Parameters
    ----------
    before, after : tuple of keys
        Modes of the elements on both sides.
    guards : tuple of (element, number)
        Guards that fire; several where elements wait on the same row; none: a section at a fixed time.
    middle : tuple of tuples of keys
        Modes between coinciding guards.
    """

    before: tuple[Hashable, ...]
    after: tuple[Hashable, ...]
    guards: tuple[tuple[int, int], ...]
    middle: tuple[tuple[Hashable, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class Candidate:
    """A motion that is claimed to be periodic.

    Parameters
    ----------
    system : System
    events : tuple of Event
    times : ndarray (m,)
        Of the events, forcing periods.
    states : ndarray (m, ns)
        Just before them.
    span : float
        Forcing periods after which it closes.
    closure : int
        1, or -1 when y(t + span) = -y(t).
    labels : Labels
        What nothing changes in a period; it labels a family and keeps the value of the candidate, which symmetry may make zero.
    weights : ndarray (ns,)
        Natural sizes of the states.
    """

    system: System
    events: tuple[Event, ...]
    times: np.ndarray
    states: np.ndarray
    span: float
    closure: int
    labels: Labels
    weights: np.ndarray

    @property
    def places(self) -> list:
        """Modes of elements that its proof reads: those it visits, and those that were tried before them."""
        found: dict = {}
        system = self.system
        for event in self.events:
            for keys in (event.before, *event.middle, event.after):
                found.update(dict.fromkeys(enumerate(keys)))
            for element, number in event.guards:
                modes = (event.before, *event.middle)
                for keys in modes:
                    guards = mode_of(system, system.together, element, keys[element], system.core).guards
                    if number < len(guards):
                        found.update(dict.fromkeys((element, key) for key in followers(guards[number])))
        return list(found)


def followers(guard) -> tuple:
    """Return the keys tried after a guard."""
    if callable(guard.then):
        raise Refused("what follows an event of the system is decided jointly by a function of its element")
    return guard.then


def candidate_of(orbit) -> Candidate:
    """Return the candidate that a periodic orbit is, written out over its full period.

    Raises
    ------
    Refused
        For complete chattering, and silent changes of modes.
    """
    signature, unknowns = repeated(orbit.scene, orbit.sequence, orbit.unknowns)
    return read(orbit.system, orbit.scene, signature, unknowns, orbit.weights)


def read(system, scene, signature, unknowns, weights) -> Candidate:
    """Return the candidate of a signature and its unknowns."""
    nodes = signature.nodes.tolist()
    rows = np.reshape(unknowns, (len(nodes), -1))
    keys = scene.keys
    events: list[Event] = []
    times, states = [], []
    if all(node[GUARD] < 0 and node[AFTER] == nodes[0][AFTER] for node in nodes):
        nodes, rows = nodes[:1], rows[:1]  # the motion has no events: one section is enough
    first = next((i for i, node in enumerate(nodes) if node[DIVIDE] != TOGETHER), 0)
    for i in [*range(first, len(nodes)), *range(first)]:
        node = nodes[i]
        if node[CLOSES] == 1:
            raise Refused(f"the motion has complete chattering at {scene.element_name(node[BEFORE], node[GUARD])!r}: "
                          "infinitely many impacts; no proof is made of it")
        before, after = keys[node[BEFORE]], keys[node[AFTER]]
        if events and events[-1].after != before:
            raise Refused(f"the motion changes silently from {events[-1].after} to {before}; no proof is made of it")
        fired = () if node[GUARD] < 0 else ((scene.guard(node[BEFORE], node[GUARD]).element,
                                            scene.guard(node[BEFORE], node[GUARD]).number),)
        if node[DIVIDE] == TOGETHER and events:
            last = events[-1]
            events[-1] = Event(last.before, after, last.guards + fired, (*last.middle, before))
            continue
        if node[DIVIDE] == TOGETHER:
            raise Refused("all events of the motion coincide")
        events.append(Event(before, after, fired))
        turn = signature.closure if i < first else 1
        times.append(rows[i, 0] + (signature.span if i < first else 0.0))
        states.append(rows[i, 1:] * turn)
    if events[-1].after != events[0].before and signature.closure > 0:
        raise Refused(f"the motion changes silently from {events[-1].after} to {events[0].before}; no proof is made of it")
    return Candidate(system, tuple(events), np.array(times), np.array(states), float(signature.span), int(signature.closure),
                     signature.labels(scene, velocities=True), np.array(weights, float))
