"""Where the event signature of an orbit changes: the equations that go on behind it.

The equations of the new signature are regular there; their null vector is the tangent of the impacting orbit, and the
side on which it is admissible is found by a step to either side, never assumed: the orbit may live on the impacting or the
non-impacting side.

One file, because what is constructed, asked of the rule, verified and named at a change is one decision.
"""
import collections
import dataclasses
import functools
import math
import operator
from itertools import pairwise

import numpy as np

from ...compose.writer import kernels
from ...elements import EventKind, Shift
from ...elements.friction.dry import STICK
from ...orbits.repetition import LASTING, middles
from ...orbits.shooting import sequence
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, GUARD, TOGETHER
from ...orbits.shooting.signature import since
from ..kinds import SpecialPointKind, StopReason
from . import autonomous, sliding
from .appearing import NEAR, SHARP, inserted, parted, passed_whole
from .completion import UNITS, ratio
from .directions import directions
from .several import goes_on, star
from .successor import CREPT, LISTED, SAME, allowed, complete_chatters, cycle, jumps, kicks, onto, successor, verified
from .vanishing import dropped

AHEAD = (1e-3, 1e-4, 1e-5)  # scaled lengths at which an orbit is compared with itself a part of its period later
ALIKE = 1e-2  # their difference, as part of the way there, that is none
ONE = 1e-9  # their scaled difference that is none also where the parameter does not move the orbit: it is rounding
TRAIN, LEFT = 4, 0.1  # impacts a period of the orbit that may be those of a sequence just completed; part of the time left to them
AT_ONCE = 1e-3  # periods between events that change places, at most: on the boundary there are none
TRIALS = (1e-5, 1e-4, 1e-3, 1e-6)  # scaled steps with which a side is tried
UNLISTED, LEAVING, MERGES = "unlisted", "leaving", "merges"  # names of monitors
COMPLETES, CLOSURE, REFUSED = "completes", "closure", "refused"
KINDS = {EventKind.STICK: SpecialPointKind.STICK_ONSET, EventKind.SLIP: SpecialPointKind.SLIP_ONSET,
         EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}
INSTANTS = {EventKind.CLOCK, EventKind.RESET}
ORDER = [SpecialPointKind.STICK_ONSET, SpecialPointKind.SLIP_ONSET, SpecialPointKind.SEPARATION, SpecialPointKind.GRAZING]
ENDS = {EventKind.STICK: SpecialPointKind.SLIP_ONSET, EventKind.SLIP: SpecialPointKind.STICK_ONSET,
        EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}


def through_grazing(problem, point, monitor):
    """Return (problem, x, tangent) behind a change of the event signature, or a sentence why none goes on.

    The usual changes of one event are constructed, and those of several impacts at once; what simulation does not repeat, and
    everything else, is left to `successor`.
    """
    silent = problem.silent(monitor, point.x)
    meeting = [] if silent or problem.system.symmetry == -1 else star(problem, point, admissible_side)
    answer = goes_on(problem, meeting) if meeting else None
    if answer is not None and verified(problem, point, *answer):
        return answer
    tried = [cycle(problem)]
    for found in constructed(problem, point.x, monitor.name):
        new = problem.with_sequence(*found)
        events = cycle(new)
        if events in tried:
            continue
        tried.append(events)
        side = admissible_side(new, new.x0)
        if side is not None and solves(new, new.x0, side) and verified(problem, point, new, new.x0, side):
            return new, new.x0, side
    answer, search = successor(problem, point, silent)
    lost = search.incomplete if answer is None else loses(problem, answer[0])
    if monitor.name == CLOSURE and lost:
        return StopReason.CHATTERING  # it is released before it completes
    if answer is None and search.completing is not None and accumulates(problem.sequence, search.completing):
        return StopReason.CHATTERING  # changes of the number of impacts accumulate between here and where it completes
    if answer is None and search.creeps:
        return StopReason.STICKING
    if answer is None and jumps(problem, point):
        return StopReason.JUMP
    return f"no equations go on behind {monitor.kind!s} {monitor.name}: {search.message}" if answer is None else answer


def loses(problem, other) -> bool:
    """Whether motions of the problem ``other`` complete fewer chatterings than those of ``problem``, but for such as have lost all
    their impacts at once."""
    if complete_chatters(other.sequence) >= complete_chatters(problem.sequence):
        return False
    beside = dataclasses.replace(problem.sequence, nodes=problem.sequence.nodes[problem.sequence.nodes[:, CLOSES] == 0])
    return kicks(other.scene, other.sequence) > kicks(problem.scene, beside)


def fewer_chatters(problem, x) -> bool:
    """Whether at ``x`` (n + 1,) a complete chattering has lost its duration, with the speed of all its impacts: the equations lose
    as many ranks there, and what rounding makes of them is none."""
    near = max(NEAR, min(problem.moved_by_rounding(x, problem.null_tangent(x)), CREPT))
    made = autonomous.changed(dropped, problem, x, near)
    return made is not None and complete_chatters(made[0]) < complete_chatters(problem.sequence)


def solves(problem, x, tangent) -> bool:
    """Whether ``x`` (n + 1,), constructed for the equations of ``problem``, solves them: where an event moves by a leap what
    another one waits for, the two do not change places at one instant, however near each other they are.  The corrector along the
    ``tangent`` there tells at once, or a little farther on where the equations are singular."""
    for step in (0.0, SAME):
        c = problem.correct(x + step * problem.scale * tangent, tangent)
        if c.converged and c.distance <= SAME:
            return True
    found = onto(problem, x)
    return found is not None and float(np.abs((found - x) / problem.scale).max()) <= SAME


def accumulates(signature, other) -> bool:
    """Whether one of two sequences, the second that of the problem ``other``, completes chattering where the
    other lists its impacts: between the two lie infinitely many changes of their number, and a step over them is luck."""
    fewer, more = sorted((other.sequence, signature), key=complete_chatters)
    if complete_chatters(fewer) == complete_chatters(more):
        return False
    least = resolved(other, more) / max(1.0, signature.span * (2.0 if signature.closure < 0 else 1.0))
    return kicks(other.scene, fewer) >= max(least, 0.5 * kicks(other.scene, more))


def resolved(problem, signature) -> float:
    """Return how many impacts a period, `TRAIN` at most, may be those of a complete chattering that ``signature`` completes: as
    many as bring the times left to the release of a just completed one down to `LEFT`."""
    T = problem.equations.numbers_at(float(problem.x0[-1]))
    ends = signature.nodes[signature.nodes[:, CLOSES] == 1][:, :AFTER]
    ratios = [float(T.ratio[mode, guard]) for mode, guard in ends]
    return min([TRAIN, *(math.log(LEFT) / math.log(ratio(r)) for r in ratios if 0.0 < r < 1.0)])


def merges(problem, x, tangent) -> bool:
    """Whether the orbit at a boundary ``x`` (n + 1,) runs through one of a part of its period, which those behind it, along
    ``tangent``, do not: at the grazing of an orbit all branches meet on which only some of its turns have an impact more."""
    s = problem.sequence
    turns = 0 if s.clock else round(s.span * (2.0 if s.closure < 0 else 1.0))
    for step in AHEAD if turns > 1 else ():
        c = problem.correct(x - step * problem.scale * tangent, tangent)
        if c.converged:
            pairs = ((unlike(problem, x, part), unlike(problem, c.x, part)) for part in range(1, turns) if turns % part == 0)
            return any(at <= ALIKE * behind > ALIKE * ONE for at, behind in pairs)
    return False


def unlike(problem, x, part, sign=1.0) -> float:
    """Return the scaled difference of the orbit at ``x`` (n + 1,) from itself ``part`` forcing periods later, or with the ``sign``
    -1 from its mirror image; in intervals that last for something: on a boundary an event may part what stays what it was."""
    orbit = problem.motion(x)
    at, spans = middles(orbit)
    at = at[spans > LASTING]
    return float((np.abs(orbit._states(at) - sign * orbit._states(at + part)) / orbit.weights).max())


def mirrors(problem, x, tangent) -> bool:
    """Whether the orbits of ``problem`` ahead of ``x`` (n + 1,) along ``tangent`` are their own images in half a period."""
    s = problem.sequence
    if s.closure < 0:
        return True
    if s.clock or problem.system.symmetry != -1 or round(s.span) % 2 == 0:
        return False
    for step in AHEAD:
        c = problem.correct(x + step * problem.scale * tangent, tangent)
        if not (c.converged and allowed(problem, c.p)):
            continue
        return unlike(problem, c.x, 0.5 * s.span, -1.0) <= nothing(problem, x, c.x)
    return False


def nothing(problem, x, ahead) -> float:
    """Return the scaled difference that is none between parts of the orbit ``ahead`` (n + 1,) of ``x``."""
    return max(ALIKE * float(np.abs((ahead - x) / problem.scale)[:-1].max()), ONE)


def constructed(problem, x, name):
    """Yield (signature, x) of the usual changes of one event: first of what is zero to rounding alone, since the last but one of a
    train of impacts is nearly as slow as the last; then of all that is slow."""
    if name == UNLISTED:
        yield from passed_whole(problem, x)
    for near in (SHARP, NEAR):
        found = None
        if name in (LISTED, CLOSURE):  # of a chattering whose impacts all lose their speed either may be zero first
            found = autonomous.changed(dropped, problem, x, near)
        elif name == UNLISTED:
            found = autonomous.changed(functools.partial(inserted, near=near), problem, x)
        elif name == LEAVING and near == NEAR:
            found = autonomous.changed(parted, problem, x)
        if found is not None:
            yield found


def admissible_side(problem, x):
    """Return the unit tangent at ``x`` that points to admissible orbits, or None."""
    lines = directions(problem, x)
    boundary = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    for step in TRIALS:
        good = []
        for way in (sign * line for line in lines for sign in (1.0, -1.0)):
            c = problem.correct(x + step * problem.scale * way, way)
            if c.converged and all(c.monitors[k] < 0.0 for k in boundary):
                good.append(way)
        if len(good) == 1:
            return good[0]
    return None


def beyond_section(problem, point):
    """Return why an orbit without events ends at its Hopf point; or (problem, x, tangent) with a new section where only the
    section touches it."""
    if autonomous.small(problem, point.x):
        return StopReason.HOPF
    made = autonomous.changed(lambda plain, x: (plain.sequence, x), problem, point.x)
    new = problem.with_sequence(*made)
    side = admissible_side(new, new.x0)
    return StopReason.NO_SUCCESSOR if side is None else (new, new.x0, side)


def changed(problem, x, other):
    """Return the kind of the change from the sequence of ``problem``, which ends at ``x`` (n + 1,), to that of ``other``; None
    where the events do not tell."""
    if problem.scene.n == 0:
        return sliding.change(problem, x, other, intervals)
    kind = exchanged(problem, x, other, True)
    if kind is not None:
        return kind
    one, two, apart = differ(problem, other, [listed(problem), listed(other)])
    if not apart and (kind := exchanged(problem, x, other)) is not None:
        return kind
    completes = complete_chatters(problem.sequence) == complete_chatters(other.sequence) > 0
    if completes:
        told = differ(problem, other, as_long(problem, other))
        impacts = {kind for _, kind in apart} <= {EventKind.IMPACT.value}
        if told[2] and (impacts or len(told[2]) < len(apart)):  # which events count as leading to the completion differs, too
            one, two, apart = told
    if not apart:
        return leapt(problem, x, other)
    kinds = {EventKind(kind) for _, kind in apart}
    if kinds != {EventKind.IMPACT} and completes:
        kinds.discard(EventKind.IMPACT)  # more or fewer of those that lead to the completion
    if EventKind.IMPACT in kinds:
        return SpecialPointKind.GRAZING
    if kinds == {EventKind.RELEASE}:
        return SpecialPointKind.SEPARATION  # between an impact and a rest on the stop
    more = sum(two[event] - one[event] for event in apart if EventKind(event[1]) in kinds)
    richer, at = (other, other.x0) if more > 0 else (problem, x)
    if kinds == {EventKind.SLIP}:
        return cut_short(richer, at)
    if kinds == {EventKind.SLIP, EventKind.RELEASE}:
        return by_turns(richer, at)
    if kinds == {EventKind.STICK}:
        return beside_stick(richer, at, {element for element, kind in apart if EventKind(kind) is EventKind.STICK})
    if kinds == {EventKind.STICK, EventKind.SLIP}:
        return shortest(richer, at, {element for element, _ in apart})
    if kinds == {EventKind.CONTACT, EventKind.SEPARATION}:
        return brief_contact(richer, at, {element for element, kind in apart if EventKind(kind) is EventKind.CONTACT})
    return None


def meets_clock(problem, other) -> bool | None:
    """Return whether what events meet between two sequences is a known instant, and does something; None: nothing there does.

    Such sequences are the same but for the places of those instants.  Where the clock does something (a level, a pulse) that is a
    border collision; where forces do not feel it (a motion that is put back by its shift, the half of a period between two pulses)
    it is no special point.
    """
    scene = problem.scene
    if scene.n == 0 or not (scene.tables.kind == EventKind.RESET.code).any():  # that of a clock, too
        return False

    def events(end) -> list[tuple]:
        places = end.sequence.nodes[listed(end)][:, :AFTER].tolist()
        if end.sequence.closure < 0:
            places += [[scene.mirror(mode), scene.mirror_guard(mode, guard)] for mode, guard in places]
        named = []
        for mode, guard in places:
            element, kind = scene.guard(mode, guard).element, scene.event_kind(mode, guard)
            idle = scene.guard(mode, guard).guard.silent or isinstance(scene.system.elements[element], Shift)
            named.append((kind in INSTANTS, idle, element, kind.value, str(scene.keys[mode][element])))
        return named

    one, two = events(problem), events(other)
    if not any(event[0] for event in one) or sorted(one) != sorted(two) or turns(one) & turns(two):
        return False
    felt, beside = ([[event for event in whole if not event[kind]] for whole in (one, two)] for kind in (1, 0))
    return None if turns(felt[0]) & turns(felt[1]) else bool(turns(beside[0]) & turns(beside[1]))


def leapt(problem, x, other):
    """Return the kind of the change between two sequences of the same events that differ by the place of one; None without it.

    An event moves by a leap where what it waits for does not happen before a stay: a mass comes to rest just where a surface is,
    and parts from it before that, or only when it slips again.  The interval that vanishes is another one from either side, what
    moves is one event.
    """
    one, two = named_events(problem), named_events(other)
    if turns(one) & turns(two):
        return None
    moved = {event for event in one if without(one, event) & without(two, event)}
    kinds = [of_surface(problem, x, {element}, EventKind(kind)) if EventKind(kind) in (EventKind.CONTACT, EventKind.SEPARATION)
             else KINDS.get(EventKind(kind), SpecialPointKind.GRAZING) for element, kind in moved]
    return min(kinds, key=ORDER.index, default=None)


def turns(events) -> set:
    """Return the cycle of ``events`` as tuples, begun at each of them."""
    return {tuple(events[k:] + events[:k]) for k in range(len(events))} or {()}


def without(events, event) -> set:
    """Return the cycles of ``events`` that are left without one ``event``, each as its first turn in order."""
    return {min(turns(events[i + 1:] + events[:i])) for i, other in enumerate(events) if other == event}


def differ(problem, other, masks):
    """Return how often each event is listed in two problems' sequences, of those that ``masks`` (nodes,) say, and which of them
    are so more often in one."""
    halves = [end.sequence.closure < 0 for end in (problem, other)]
    one, two = (collections.Counter(named_events(end, mask) * (2 if half and not all(halves) else 1))
                for end, mask, half in zip((problem, other), masks, halves, strict=True))
    return one, two, [event for event in {**one, **two} if one[event] != two[event]]


def cut_short(problem, x):
    """Return what a slip more at ``x`` (n + 1,) is: the onset of the stick before it, between the two sides of a reversal, or that
    of the slip behind it, which an impact cuts short; of the two the shorter."""
    spans, nodes = intervals(problem, x), problem.sequence.nodes
    slips = np.array([g >= 0 and problem.scene.event_kind(m, g) is EventKind.SLIP for m, g in nodes[:, :AFTER].tolist()])
    return (SpecialPointKind.SLIP_ONSET if np.roll(spans, -1)[slips].min() < spans[slips].min()
            else SpecialPointKind.STICK_ONSET)


def by_turns(problem, x):
    """Return what a release and a slip more at ``x`` (n + 1,) are, of a mass that a stop and friction hold by turns: the onset of
    the stick from the release to the slip, or that of the time at the limit from the slip to the release; the shorter."""
    nodes, spans = problem.sequence.nodes[:, :AFTER].tolist(), intervals(problem, x)
    times = np.cumsum(np.where(spans < np.inf, spans, 0.0))
    kinds = [problem.scene.event_kind(m, g) if g >= 0 else None for m, g in nodes]
    order = [i for i, kind in enumerate(kinds) if kind in (EventKind.SLIP, EventKind.RELEASE)]
    stays = [(times[j] - times[i] + (times[-1] if j <= i else 0.0), kinds[j])
             for i, j in pairwise([*order, order[0]]) if kinds[i] is not kinds[j]]
    last = min(stays, key=operator.itemgetter(0), default=(0.0, None))[1]
    return None if last is None else SpecialPointKind.STICK_ONSET if last is EventKind.SLIP else SpecialPointKind.SLIP_ONSET


def beside_stick(problem, x, elements):
    """Return what one more end of slip at ``x`` (n + 1,) is, of one of the ``elements``: the onset of stick or of slip,
    whichever the contact does in its shortest stay beside such an end.

    Two boundaries are zero there, the direction in which the contact goes on and a duration: which one a branch meets first is
    decided by rounding, what begins is not.
    """
    scene, nodes, spans = problem.scene, problem.sequence.nodes.tolist(), intervals(problem, x)
    found = []
    for i, (mode, guard, after, *_) in enumerate(nodes):
        element = scene.guard(mode, guard).element if guard >= 0 else None
        if element in elements and scene.event_kind(mode, guard) is EventKind.STICK:
            end = next(k for k in range(i + 1, i + 1 + len(nodes)) if is_left(scene, nodes, k, element)) % len(nodes)
            found += [(stay(scene, nodes, spans, i, element), scene.keys[mode][element] == STICK),
                      (stay(scene, nodes, spans, end, element), scene.keys[after][element] == STICK)]
    return SpecialPointKind.STICK_ONSET if min(found)[1] else SpecialPointKind.SLIP_ONSET


def brief_contact(problem, x, elements):
    """Return what a contact more at ``x`` (n + 1,) is, of one of the ``elements``: a grazing where it begins on a surface in space,
    also where something else happens within it (a stick, that goes on without it); else a change of the load, which ends it too."""
    return of_surface(problem, x, elements, EventKind.CONTACT)


def of_surface(problem, x, elements, kind):
    """Return what the first event of a ``kind`` at ``x`` (n + 1,) is, of one of the ``elements``: a grazing on a surface in space,
    else a separation."""
    scene, T, ns = problem.scene, problem.equations.numbers_at(float(x[-1])), problem.scene.ns
    at = next(i for i, (mode, guard, *_) in enumerate(problem.sequence.nodes.tolist()) if guard >= 0
              and scene.event_kind(mode, guard) is kind and scene.guard(mode, guard).element in elements)
    mode, guard = problem.sequence.nodes[at, :AFTER].tolist()
    place = at * (1 + ns) + 1
    return SpecialPointKind.GRAZING if is_surface(scene, T, mode, guard, x[place:place + ns]) else SpecialPointKind.SEPARATION


def shortest(problem, x, elements):
    """Return stick or slip onset after the shortest stay of ``x`` (n + 1,) in a mode of one of the ``elements`` that ends in slip
    or stick; None without one.

    Other contacts may have events meanwhile: where one begins to slip just as the stick of another breaks for a moment, the two
    parts of this moment are as long as rounding says, the whole is a slip.  Of two that last no time the one of fewer parts lies in
    the other.
    """
    scene, nodes, spans = problem.scene, problem.sequence.nodes.tolist(), intervals(problem, x)
    ending = []
    for i, (mode, guard, *_) in enumerate(nodes):
        element = scene.guard(mode, guard).element if guard >= 0 else None
        if element in elements and (kind := scene.event_kind(mode, guard)) in (EventKind.STICK, EventKind.SLIP):
            ending.append((stay(scene, nodes, spans, i, element), ENDS[kind]))
    return min(ending)[1] if ending else None


def stay(scene, nodes, spans, i, element) -> tuple[float, int]:
    """Return how long an element has been in the mode that node ``i`` ends, of the intervals ``spans`` (nodes,) before the nodes,
    and of how many; inf where that is always nothing."""
    begin = next(k for k in range(i - 1, i - 1 - len(nodes), -1) if is_left(scene, nodes, k, element))
    found = [spans[k] for k in range(begin + 1, i + 1)]
    return sum(max(span, 0.0) for span in found if span < math.inf) if min(found) < math.inf else math.inf, len(found)


def is_left(scene, nodes, k, element) -> bool:
    """Whether an element has an event, or another mode than before, at the node ``k`` of a cycle."""
    mode, guard, after = nodes[k % len(nodes)][:AFTER + 1]
    return guard >= 0 and scene.guard(mode, guard).element == element or scene.keys[mode][element] != scene.keys[after][element]


def exchanged(problem, x, other, trains=False):
    """Return the kind of the change between two sequences that differ in the order of events only, or None.

    Those that change places are as few as can be: two neighbours, a pair in each half of a period, or an event that overtakes
    several of one instant.  Of several choices it is that of the events nearest to each other in time at ``x`` (n + 1,).  With
    ``trains`` the impacts that lead to the end of a complete chattering count as well, as many on both sides: which of the events
    before them are told to belong to it differs, and how many are listed.
    """
    masks = as_long(problem, other) if trains else [listed(problem), listed(other)]
    halves = [end.sequence.closure < 0 for end in (problem, other)]
    one, two = (np.count_nonzero(mask) * (1 + half) for mask, half in zip(masks, halves, strict=True))
    if one != two:
        return None
    kinds = (changes_places(*by_instant(problem, x, masks[0], own), by_instant(other, other.x0, masks[1], own)[0], halves)
             for own in (True, False))  # events of one element look alike unless where they come from distinguishes them
    return next((kind for kind in kinds if kind is not None), None)


def changes_places(one, spans, two, halves):
    """Return the kind of a change of events, see `exchanged`, from the events ``one``, before which there are ``spans`` (periods),
    to ``two``; ``halves`` says which of the two are those of half a period."""
    if halves[0] != halves[1]:  # one of them is listed over half its period
        one, two = one * (1 + halves[0]), two * (1 + halves[1])
        spans = np.resize(spans, len(one))
    if sorted(one) != sorted(two):
        return None
    found = []
    for k in range(len(two)):
        turned = two[k:] + two[:k]
        apart = [i for i, (a, b) in enumerate(zip(one, turned, strict=True)) if a != b]
        if not apart:
            return None
        later, missing = [], collections.Counter()
        for i in np.roll(np.arange(len(one)), -int(np.argmax(np.where(np.isinf(spans), 0.0, spans)))).tolist():
            if any(missing.values()) and spans[i] < np.inf:  # it lies between events that change places
                later.append(spans[i])
            missing.update({one[i]: 1})
            missing.subtract({turned[i]: 1})
        if later and max(later) < AT_ONCE:
            kinds = [KINDS.get(EventKind(one[i][1]), SpecialPointKind.GRAZING) for i in apart]
            found.append((len(apart), max(later), ORDER.index(min(kinds, key=ORDER.index))))
    return ORDER[min(found)[2]] if found else None


def intervals(problem, x):
    """Return the times since the event before (nodes,) at ``x`` (n + 1,), forcing periods (without a clock: of the orbit); inf of
    those that are always none."""
    s, U = problem.sequence.written_out(x[:-1])  # without a clock the period stands in the place of the first time
    spans = since(np.ravel(U)[::1 + problem.scene.ns], s.span)
    spans[s.nodes[:, DIVIDE] == TOGETHER] = np.inf
    return spans


def listed(problem):
    """Return which nodes (nodes,) are events that `named_events` names."""
    nodes = problem.sequence.nodes
    return (nodes[:, GUARD] >= 0) & (nodes[:, CLOSES] != 2)


def as_long(problem, other) -> list[np.ndarray]:
    """Return which nodes (nodes,) of both sequences are events, without the last impacts of a complete chattering that one of them
    lists beyond the number of the other, and what friction does between them."""
    masks = [end.sequence.nodes[:, GUARD] >= 0 for end in (problem, other)]
    impacts = [int(np.count_nonzero(end.scene.tables.kick[tuple(end.sequence.nodes[mask, :AFTER].T)]))
               for end, mask in zip((problem, other), masks, strict=True)]
    longer = int(impacts[1] > impacts[0])
    nodes = (problem, other)[longer].sequence.nodes
    ends = np.flatnonzero(nodes[:, CLOSES] == 1)
    if len(ends) == 1:
        rows = np.roll(nodes, -1 - int(ends[0]), axis=0)[:, [BEFORE, GUARD, CLOSES]]  # the end is the last
        unit = next((unit for unit in UNITS if len(rows) > unit and np.array_equal(rows[-1 - unit, :2], rows[-1, :2])), 1)
        for k in range(2, 2 + unit * abs(impacts[1] - impacts[0])):
            if k > len(rows) or rows[-k, 2] != 2 or k > unit and not np.array_equal(rows[-k, :2], rows[unit - k, :2]):
                break
            masks[longer][(int(ends[0]) + 1 - k) % len(nodes)] = False
    return masks


def named_events(problem, mask=None, own=False) -> list[tuple]:
    """Return element and kind of the events of a problem's sequence, in order, and the ``own`` mode of the element before them.

    Of a complete chattering those that lead to its end are left out, with what happens between them: how many of them
    are listed is a matter of accuracy.  Or those that ``mask`` (nodes,) says.
    """
    scene, nodes = problem.scene, problem.sequence.nodes
    events = [(int(m), int(g)) for m, g in nodes[listed(problem) if mask is None else mask][:, :AFTER]]
    named = [(scene.guard(m, g).element, scene.event_kind(m, g).value) for m, g in events]
    return [(*name, str(scene.keys[m][name[0]])) for name, (m, _) in zip(named, events, strict=True)] if own else named


def by_instant(problem, x, mask, own=False):
    """Return the `named_events` of a ``mask`` (nodes,), those that always fall on one instant in one order, and the `intervals`
    before them at ``x`` (n + 1,)."""
    events, spans = named_events(problem, mask, own), intervals(problem, x)[mask]
    apart = np.flatnonzero(problem.sequence.nodes[mask][:, DIVIDE] != TOGETHER).tolist() or [0]
    order = [*range(apart[0], len(events)), *range(apart[0])]  # an instant may be that of the last and the first
    cuts = [*(k - apart[0] for k in apart), len(order)]
    return [event for a, b in pairwise(cuts) for event in sorted(events[i] for i in order[a:b])], spans[order]


def kind_of(problem, name, x):
    """Return what kind of change of signature happens at ``x``: grazing, or the onset of stick, slip or separation."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    if name in (LEAVING, REFUSED):
        return SpecialPointKind.STICK_ONSET
    T, info = e.numbers_at(x[-1]), np.zeros(sequence.INFO)
    e.kernel.monitor(T, s.nodes, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
    if name == LISTED:
        at = int(info[sequence.LISTED_AT])
        if at < 0:
            return SpecialPointKind.GRAZING
        mode, guard = s.nodes[at, :GUARD + 1].tolist()
        kinds = ENDS  # of what ends the interval that vanishes
    else:
        kinds = KINDS
        at = int(info[sequence.PEAK_SEGMENT])
        if at < 0:
            return SpecialPointKind.GRAZING
        mode, guard = int(s.nodes[at, AFTER]), int(info[sequence.PEAK_GUARD])
    kind = scene.event_kind(mode, guard)
    place = at * (1 + scene.ns) + 1
    if kind in (EventKind.SEPARATION, EventKind.CONTACT) and is_surface(scene, T, mode, guard, x[place:place + scene.ns]):
        return SpecialPointKind.GRAZING
    return kinds.get(kind, SpecialPointKind.GRAZING)


def is_surface(scene, T, mode, guard, y):
    """Return whether a guard is a surface in space, straight or curved: at the state ``y`` (ns,) positions alone change it."""
    if T.D[mode, guard].any() or not T.LG[mode, guard].any():
        return bool(T.D[mode, guard].any())
    n, row = scene.n, np.empty(T.A.shape[2])
    kernels(scene).guard_gradient(T, mode, guard, np.append(y, np.eye(1, row.size - y.size)), row)
    return bool(row[:n].any() and not row[n:2 * n].any())
