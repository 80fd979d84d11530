"""Events that appear in an orbit: the equations with an event more, at the point where it is born.

At a graze the event is inserted at the touching time with zero speed; a mode that is entered and left at once is inserted
with no duration.
"""
import dataclasses

import numpy as np

from ...compose.writer import kernels
from ...orbits.shooting import sequence
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, ENDING, FOREVER, GUARD, STARTS
from ...orbits.shooting.signature import Signature, divided

NEAR = 1e-8  # scaled; listed speeds and unlisted maxima this small take part in one graze
ASIDE = 1e-3  # of an interval, from a maximum: where others are looked for
ALL_ALONG = 12  # states at which an orbit without events is looked at: does it touch all along
SHARP = 1e-11  # the same, where a train of impacts has more than one slow impact


def touches(problem, x, near=NEAR):
    """Return (tau, mode, guard, state) of every unlisted maximum that touches its guard at ``x``, to ``near`` (scaled), in order
    of time."""
    e, s, scene = problem.equations, problem.sequence, problem.scene
    T = e.numbers_at(x[-1])
    period = 2.0 * np.pi / T.flat[0]
    found = []
    size = 1 + scene.ns
    joined, P = np.empty(T.A.shape[2]), np.empty((scene.ns, T.A.shape[2]))
    ends = np.append(x[:-1:size], x[0] + s.span)
    for i, node in enumerate(s.nodes):
        mode = int(node[AFTER])
        e.motion.start_of(T, s.nodes, x[:-1], i, P, joined)
        for q in range(int(T.n_guards[mode])):
            if node.size > STARTS and node[STARTS + q] == FOREVER:
                continue
            low = abs(int(node[STARTS + q])) if node.size > STARTS else 0
            row = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, q, joined, row)
            size = near * e.kernel.scale_of(row, e.weights)
            for at in tops(e, T, mode, q, joined, ends[i] * period, (ends[i + 1] - ends[i]) * period, low, size):
                y = np.empty(scene.ns)
                e.motion.advance(T, mode, joined, at, y)
                found.append((ends[i] + at / period, mode, q, y))
    return sorted(found, key=lambda item: item[0])


def tops(e, T, mode, guard, x, begin, length, low, size):
    """Return the times after ``begin`` of all maxima of a guard that are zero to ``size``, inside an interval from the state ``x``
    (nx,): an orbit that is its own image under reversal of time touches twice at once.

    A guard that is zero over a stretch has one there: what lies beside a maximum is looked at where it is clearly lower.
    """
    value, at = e.kernel.segment_peak(T, mode, guard, x, length, 1, low)
    if not abs(value) <= size:
        return []
    aside, found = ASIDE * length, [at]
    if at > 2.0 * aside and e.kernel.guard_value(T, mode, guard, moved(e, T, mode, x, begin, at - aside)) < -size:
        found = tops(e, T, mode, guard, x, begin, at - aside, low, size) + found
    if length - at > 2.0 * aside:
        after = moved(e, T, mode, x, begin, at + aside)
        if e.kernel.guard_value(T, mode, guard, after) < -size:
            found += [at + aside + later
                      for later in tops(e, T, mode, guard, after, begin + at + aside, length - at - aside, 0, size)]
    return found


def moved(e, T, mode, x, begin, time):
    """Return the joined state (nx,) a time after ``x`` (nx,), which is at the time ``begin``."""
    y, after = np.empty(e.scene.ns), x.copy()
    e.motion.advance(T, mode, x, time, y)
    after[:y.size] = y
    e.motion.forcing(T, begin + time, after)
    return after


def passed_whole(problem, x):
    """Yield (signature, x) without events in every mode behind a guard that an orbit without events touches all along, as the whirl
    of a rotor does in a concentric stator: what touches nowhere first changes mode as a whole."""
    e, s, scene = problem.equations, problem.sequence, problem.scene
    if s.events:
        return
    T, mode, ns = e.numbers_at(x[-1]), int(s.nodes[0, AFTER]), scene.ns
    whole, U = problem._whole(x)
    times = whole.span * np.arange(ALL_ALONG) / ALL_ALONG
    states, joined = np.empty((ALL_ALONG, ns)), np.empty(T.A.shape[2])
    e.motion.states(T, whole.nodes, whole.span, U, times, states)
    for guard in range(int(T.n_guards[mode])):
        sizes = []
        for time, y in zip(times, states, strict=True):
            joined[:ns] = y
            e.motion.forcing(T, time * 2.0 * np.pi / T.flat[0], joined)
            row = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, guard, joined, row)
            sizes.append(abs(e.kernel.guard_value(T, mode, guard, joined)) / e.kernel.scale_of(row, e.weights))
        if max(sizes) > NEAR:
            continue
        for other in sorted(set(scene.expand(mode, guard).then[mode, guard].tolist()) - {-1, mode}):
            yield dataclasses.replace(s, nodes=np.array([[other, -1, other, 0, 0]])), x


def event_nodes(scene, numbers, mode, guard, x):
    """Return the nodes of an event that is born at a touch at ``x`` (nx,), or None; ``numbers`` are the tables there.

    An impact is one node.  Elsewhere the mode that follows must end at once by a guard that leads back.
    """
    T = scene.tables
    if T.kick[mode, guard]:
        return [[mode, guard, mode, 0, 0]]
    owner = scene.guard(mode, guard).element
    T = scene.expand(mode, guard)
    for other in T.then[mode, guard].tolist():
        if other < 0 or other == mode:
            continue
        back = returning(scene, numbers, mode, guard, other, mode, owner, x)
        if back is not None:
            return [[mode, guard, other, 0, 0], [other, back, mode, 0, 0]]
    return None


def returning(scene, numbers, mode, guard, other, target, owner, x):
    """Return the guard of ``other`` that leads to ``target`` and vanishes at ``x`` after ``guard`` of ``mode``, or None."""
    if other >= len(numbers.n_guards):
        numbers = scene.tables  # of a mode that the branch has not met yet
    after = np.empty(x.size)
    kernels(scene, "bifurc.flow.rule").jump(numbers, mode, guard, 0, x, after, np.empty((scene.ns, x.size)))
    for back in scene.guards_of(other, owner):
        T = scene.expand(other, back)
        row = numbers.G[other, back]
        if target in T.then[other, back].tolist() and abs(row @ after) <= NEAR * (np.abs(row) @ np.maximum(np.abs(after), 1e-30)):
            return back
    return None


def inserted(problem, x, periods: int = 1, near=NEAR):
    """Return (signature, x) with the events inserted that touch to ``near`` (scaled), over ``periods`` repetitions of the orbit;
    only the first repetition gets them when there are several."""
    scene, s = problem.scene, problem.sequence
    born = touches(problem, x, near)
    if not born:
        if periods > 1:
            return None
        return begun_beyond(problem, x) or ended_beyond(problem, x)
    size = 1 + scene.ns
    rows = x[:-1].reshape(-1, size)
    items: list[tuple] = []
    for k in range(periods):
        for node, row in zip(s.nodes.tolist(), rows, strict=True):
            if node[GUARD] >= 0:
                items.append((row[0] + k * s.span, len(items), node[:ENDING], row[1:]))
    for tau, mode, guard, y in born:
        joined = np.concatenate([y, scene.forcing(np.array([tau * 2.0 * np.pi / problem.path.tables.flat[0]]))[0]])
        nodes = event_nodes(scene, problem.equations.numbers_at(x[-1]), mode, guard, joined)
        if nodes is None:
            return None
        for node in nodes:
            items.append((tau, len(items), node, y))
    items.sort(key=lambda item: item[:2])
    nodes = divided(scene, np.array([item[2] for item in items], np.int64), problem.tables_at(x[-1]), s.closure)
    unknowns = np.concatenate([np.concatenate([[item[0]], item[3]]) for item in items])
    signature = Signature(nodes, np.zeros(len(nodes)), s.span * periods, s.closure)
    return signature, np.append(unknowns, x[-1])


def begun_beyond(problem, x):
    """Return (signature, x) where a row that begins to be held is at the limit of its reaction: it first goes on, without
    duration yet, and is held then."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    T, info = e.numbers_at(x[-1]), np.zeros(sequence.INFO)
    e.kernel.monitor(T, s.nodes, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
    at, guard = int(info[sequence.PEAK_SEGMENT]), int(info[sequence.PEAK_GUARD])
    if at < 0 or abs(info[sequence.PEAK]) > NEAR or s.nodes[at, GUARD] < 0:
        return None
    rows = x[:-1].reshape(len(s.nodes), 1 + scene.ns)
    if info[sequence.PEAK_TIME] != rows[at, 0]:
        return None
    mode = int(s.nodes[at, AFTER])
    joined, P = np.empty(T.A.shape[2]), np.empty((scene.ns, T.A.shape[2]))
    e.motion.start_of(T, s.nodes, x[:-1], at, P, joined)
    born = event_nodes(scene, T, mode, guard, joined)
    if born is None or len(born) != 2:
        return None
    nodes = [node[:ENDING].copy() for node in s.nodes]
    nodes[at][AFTER] = born[1][BEFORE]
    born[1][CLOSES] = 2 if nodes[at][CLOSES] == 2 else 0  # in a flight of a chattering, as that which begins it
    nodes.insert(at + 1, np.array(born[1], np.int64))
    signature = Signature(divided(scene, np.array(nodes), problem.tables_at(x[-1]), s.closure), np.zeros(len(nodes)), s.span,
                          s.closure)
    later = np.insert(rows, at + 1, rows[at], axis=0)
    later[at + 1, 1:] = joined[:scene.ns]
    return signature, np.append(later.ravel(), x[-1])


def ended_beyond(problem, x):
    """Return (signature, x) where a guard is reached at the very end of an interval: its event, and the end after it."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    T = e.numbers_at(x[-1])
    period = 2.0 * np.pi / T.flat[0]
    rows = x[:-1].reshape(len(s.nodes), 1 + scene.ns)
    for i, (node, row) in enumerate(zip(s.nodes, rows, strict=True)):
        mode, guard, after = (int(value) for value in node[:AFTER + 1])
        if guard < 0:
            continue
        owner = scene.guard(mode, guard).element
        joined = np.concatenate([row[1:], scene.forcing(np.array([row[0] * period]))[0]])
        for q in scene.guards_of(mode, owner):
            slope = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, q, joined, slope)
            if q == guard or abs(slope @ joined) > NEAR * e.kernel.scale_of(slope, e.weights):
                continue
            for other in scene.expand(mode, q).then[mode, q].tolist():
                back = None if other < 0 or other == mode else returning(scene, T, mode, q, other, after, owner, joined)
                if back is None:
                    continue
                nodes = [item[:ENDING].copy() for item in s.nodes]
                nodes[i:i + 1] = [np.array([mode, q, other, 0, 0]), np.array([other, back, after, 0, 0])]
                signature = Signature(divided(scene, np.array(nodes), problem.tables_at(x[-1]), s.closure), np.zeros(len(nodes)),
                                      s.span, s.closure)
                return signature, np.append(np.insert(rows, i, row, axis=0).ravel(), x[-1])
    return None


def parted(problem, x):
    """Return (signature, x) with the mode between the two sides of an event (stick at a reversal), of no duration yet."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    T, info = e.numbers_at(x[-1]), np.zeros(sequence.INFO)
    e.kernel.monitor(T, s.nodes, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
    if info[sequence.LEAVING_AT] < 0.0:
        return None
    at = int(info[sequence.LEAVING_AT])
    before, guard, after = (int(value) for value in s.nodes[at, :AFTER + 1])
    rows = x[:-1].reshape(len(s.nodes), 1 + scene.ns)
    joined = np.concatenate([rows[at, 1:], scene.forcing(np.array([rows[at, 0] * 2.0 * np.pi / T.flat[0]]))[0]])
    owner = scene.guard(before, guard).element
    for middle in scene.expand(before, guard).then[before, guard].tolist():
        if middle in (-1, -2, before, after):
            continue
        back = returning(scene, T, before, guard, middle, after, owner, joined)
        if back is not None:
            nodes = [node[:ENDING] for node in s.nodes]
            nodes[at:at + 1] = [np.array([before, guard, middle, 0, 0]), np.array([middle, back, after, 0, 0])]
            signature = Signature(divided(scene, np.array(nodes), problem.tables_at(x[-1]), s.closure), np.zeros(len(nodes)),
                                  s.span, s.closure)
            return signature, np.append(np.insert(rows, at, rows[at], axis=0).ravel(), x[-1])
    return None
