"""Events that vanish from an orbit: the equations without those that have lost their speed or their duration."""
import numpy as np

from ...elements import EventKind
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, GUARD, TOGETHER
from ...orbits.shooting.signature import Signature, divided, sections
from .appearing import NEAR

LEAPS = {EventKind.RESET, EventKind.CLOCK}


def dropped(problem, x, near=NEAR, staying=frozenset()):
    """Return (signature, x) without the listed events that have lost speed or duration, to ``near`` (scaled); the nodes
    ``staying`` are left in."""
    scene, s = problem.scene, problem.sequence
    size = 1 + scene.ns
    rows = x[:-1].reshape(-1, size)
    speeds = listed_speeds(problem, x)
    T = problem.equations.numbers_at(x[-1])
    items = [[node[:ENDING].copy(), row.copy(), not T.kick[node[BEFORE], node[GUARD]] if node[GUARD] >= 0 else True]
             for node, row in zip(s.nodes, rows, strict=True)]
    kept = [item for k, (item, speed) in enumerate(zip(items, speeds, strict=True))
            if k in staying or not (item[0][GUARD] >= 0 and not item[2] and speed is not None and abs(speed) <= near)]
    changed = len(kept) < len(items)
    if changed and kept:  # impacts that have lost their speed
        join(kept, s)
        kept = [item for item in kept if item[0][GUARD] < 0 or not item[2] or item[0][BEFORE] != item[0][AFTER]]
    while len(kept) > 1:
        short = [i for i in range(len(kept)) if vanishing(kept, s, i, near)]
        if not short:
            break
        changed = True
        i = short[0]
        if i == 0:  # the interval reaches round the period: begin one node earlier
            kept = turned(scene, kept, s)
            continue
        merged = merging_nodes(scene, kept[i - 1][0], kept[i][0], () if scene.n else leaps(scene, kept[i - 1][0], kept[i][0]))
        if merged is None:
            return None
        kept[i - 1:i + 1] = [[np.array(node, np.int64), kept[i - 1][1], True] for node in merged]
        if len(merged) > 1:  # they changed places and meet still
            kept[i][1] = kept[i - 1][1].copy()
            break
    if not changed:
        return None
    if not kept:
        return free_of_events(problem, x)
    fixed = s.fixed[[i for i in range(len(rows)) if s.nodes[i, GUARD] < 0] or [0] * 0]
    fixed = np.zeros(len(kept)) if not fixed.size else np.resize(fixed, len(kept))
    nodes = divided(scene, np.array([item[0] for item in kept], np.int64), problem.tables_at(x[-1]), s.closure)
    return Signature(nodes, fixed, s.span, s.closure), np.append(np.concatenate([item[1] for item in kept]), x[-1])


def join(items, s):
    """Make every node end in the mode in which the next begins, where nodes between them are gone."""
    for k, item in enumerate(items):
        if s.closure > 0 or k + 1 < len(items):
            item[0][AFTER] = items[(k + 1) % len(items)][0][BEFORE]


def vanishing(items, s, i, near=NEAR) -> bool:
    """Whether the interval that node ``i`` closes has no duration, and is no pair of kicks or coinciding stops.

    A complete chattering that ends in the mode from which it was released has none where all its impacts have no speed.
    """
    node, before = items[i][0], items[i - 1][0]
    if node[GUARD] < 0 or before[GUARD] < 0 or node[DIVIDE] == TOGETHER or not items[i - 1][2]:
        return False
    if not items[i][2] and not (node[CLOSES] == 1 and node[AFTER] == before[BEFORE]):
        return False
    return bool(abs(items[i][1][0] - items[i - 1][1][0] + (s.span if i == 0 else 0.0)) <= near)


def turned(scene, items, s):
    """Return the nodes with the last one first, a half-period orbit with its mirror image."""
    node, row, free = items[-1]
    node, row = node.copy(), row.copy()
    row[0] -= s.span
    if s.closure < 0:
        row[1:] = -row[1:]
        before, guard = int(node[BEFORE]), int(node[GUARD])
        node[GUARD] = scene.mirror_guard(before, guard)
        node[BEFORE], node[AFTER] = scene.mirror(before), scene.mirror(int(node[AFTER]))
    return [[node, row, free], *items[:-1]]


def leaps(scene, *nodes) -> set:
    """Return the kinds of those of some events at which states of first order jump: they do so also where the others are gone."""
    return {scene.event_kind(int(node[BEFORE]), int(node[GUARD])) for node in nodes} & LEAPS


def merging_nodes(scene, first, second, kinds=()):
    """Return the nodes that replace two at the same instant: none, one, or two in the other order; None: not known.  ``kinds`` see
    `leaps`."""
    if second[AFTER] == first[BEFORE] and not kinds:
        return []
    a, b = scene.guard(int(first[BEFORE]), int(first[GUARD])), scene.guard(int(second[BEFORE]), int(second[GUARD]))
    if a.element == b.element:
        leading = [g for g in (int(first[GUARD]), *scene.guards_of(int(first[BEFORE]), a.element))
                   if int(second[AFTER]) in scene.expand(int(first[BEFORE]), g).then[int(first[BEFORE]), g].tolist()
                   and (not kinds or kinds == {scene.event_kind(int(first[BEFORE]), g)})]
        return [[first[BEFORE], leading[0], second[AFTER], 0, 0]] if leading else None
    own = scene.guards_of(int(first[BEFORE]), b.element)
    middle = scene.combine(int(first[BEFORE]), b.element, scene.keys[int(second[AFTER])][b.element])
    if middle is None or b.number >= len(own):
        return None
    other = scene.guards_of(middle, a.element)
    if a.number >= len(other):
        return None
    return [[first[BEFORE], own[b.number], middle, 0, 0], [middle, other[a.number], second[AFTER], 0, 0]]


def listed_speeds(problem, x):
    """Return the scaled arriving speed, or duration of the interval it closes, of every node; None for sections."""
    e, (s, U) = problem.equations, problem.sequence.written_out(x[:-1])
    found = np.empty(len(s.nodes))
    e.kernel.listed_speeds(e.numbers_at(x[-1]), s.nodes, s.span, U, e.weights, found)
    return [None if node[GUARD] < 0 else float(value) for node, value in zip(s.nodes, found, strict=True)]


def free_of_events(problem, x):
    """Return (signature, x) of the orbit whose last event has vanished: one section at phase 0, least period."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    T = e.numbers_at(x[-1])
    rows = x[:-1].reshape(len(s.nodes), 1 + scene.ns)
    k = int(np.argmax(rows[:, 0] - np.append(rows[-1, 0] - s.span, rows[:-1, 0])))  # it ends the interval that stays
    tau, mode = rows[k, 0], int(s.nodes[k, BEFORE])
    joined = np.empty(T.A.shape[2])
    joined[:scene.ns] = rows[k, 1:]
    period = 2.0 * np.pi / T.flat[0]
    e.kernel.forcing(T, tau * period, joined)
    y = np.empty(scene.ns)
    span = s.span if s.closure < 0 else 1.0
    e.motion.advance(T, mode, joined, (np.ceil(tau) - tau) * period, y)
    return sections(mode, span, s.closure), np.concatenate([[0.0], y, x[-1:]])
