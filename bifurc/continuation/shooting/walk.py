"""The event sequences that may go on where measures of one vanish: found by walking, at every instant of such a measure, all ways
from the mode before it to the mode behind it through guards that are zero there.

What is dropped, inserted, exchanged, parted or released at an instant is one such way; which one goes on as a motion is asked of
the equations (`signature_change`).  An impact may change the mode of other contacts that are at their limit in the same instant.
Memory written at an event is carried on to the later ones.

Not walked: the impacts of a complete chattering, whose number is no matter of one instant, and what a memory changes elsewhere.

One file, because measures, instants, ways and sequences are the steps of one walk along the same list of nodes.
"""
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compose.writer import kernels
from ...orbits.shooting import sequence
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, GUARD, TOGETHER
from ...orbits.shooting.signature import Signature, divided
from .appearing import touches
from .vanishing import free_of_events, listed_speeds

AT_ONCE = 1e-7  # periods: a maximum is known to half the digits
CLOCK = 1e-12  # periods: rounding of a time
SMALL = 1e-6  # scaled: measures that may be zero
CLEAR, SHORT = 100.0, 1e-4  # times what rounding leaves of a duration: one that is none; periods: the most that counts as rounding
FAST = 100.0  # scaled change of a state in a period
STATE = 1e-5  # scaled: difference of states behind an instant that are one
APART = 10.0  # factor between two measures of which only one is zero
ROUNDING = 1e-14  # scaled: of a measure
ZERO = 1e-11  # scaled value of a guard that may fire at an instant
MORE = 2  # events by which an instant may have more than before
VISITS, WAYS, MOST = 300, 24, 60  # modes looked at, ways kept of one instant, sequences made of all


@dataclass
class Listed:
    """An orbit's events over its span, begun behind its longest interval so that no instant lies on the cut.

    Attributes
    ----------
    nodes : ndarray (m, ENDING)
    rows : ndarray (m, 1 + ns)
        Times (periods) and states before the events.
    together : ndarray (m,)
        Whether a node always coincides with the one before it.
    span : float
    closure : int
    first : int
        Which node of the orbit the first one is.
    """

    nodes: np.ndarray
    rows: np.ndarray
    together: np.ndarray
    span: float
    closure: int
    first: int


def listed(problem, x) -> Listed:
    """Return the events of an orbit of given period at ``x`` (n + 1,), from behind its longest interval."""
    s, scene = problem.sequence, problem.scene
    nodes, rows = s.nodes[:, :ENDING].copy(), x[:-1].reshape(len(s.nodes), -1).copy()
    together = s.nodes[:, DIVIDE] == TOGETHER
    spans = rows[:, 0] - np.append(rows[-1, 0] - s.span, rows[:-1, 0])
    spans[together] = -1.0
    first = int(np.argmax(spans)) if (s.nodes[:, GUARD] >= 0).all() else 0
    nodes, rows = begun(scene, nodes, rows, first, s.span, s.closure, 1.0)
    return Listed(nodes, rows, np.roll(together, -first), s.span, s.closure, first)


def begun(scene, nodes, rows, first, span, closure, later):
    """Return nodes and rows (m, 1 + ns) listed from the node ``first`` on: those before it a span ``later`` (1), or those behind it
    a span earlier (-1); as mirror images where half a period is listed."""
    for i in range(first) if later > 0.0 else range(first, len(nodes)) if first else ():
        rows[i, 0] += later * span
        if closure < 0:
            rows[i, 1:] *= -1.0
            before, guard, after = nodes[i, :AFTER + 1].tolist()
            nodes[i, :AFTER + 1] = scene.mirror(before), scene.mirror_guard(before, guard), scene.mirror(after)
    return np.roll(nodes, -first, axis=0), np.roll(rows, -first, axis=0)


class Measure(NamedTuple):
    """A measure of a sequence that is small: a speed, a duration, an unlisted maximum, a rate with which a motion leaves, a margin
    by which an earlier mode is refused."""

    value: float  # multiples of what rounding leaves of it
    node: int | None  # None: within an interval
    time: float  # periods
    opens: bool  # whether events may be born of it; else listed ones vanish or meet


class Instant(NamedTuple):
    """An instant at which measures are zero, and the nodes that lie at it, in order."""

    time: float
    nodes: list[int]
    opens: bool


def measures(problem, x, orbit: Listed, left) -> Iterator[Measure]:
    """Yield the small measures of a sequence at ``x`` (n + 1,); rounding leaves ``left`` (m,) of the interval before every node."""
    count, e, s = len(orbit.nodes), problem.equations, problem.sequence
    T, kick, info = e.numbers_at(x[-1]), e.path.tables.kick, np.zeros(sequence.INFO)

    def at(i, value, opens):
        node = (int(i) - orbit.first) % count
        return Measure(abs(value) / ROUNDING, node, float(orbit.rows[node, 0]), opens)

    for i, value in enumerate(listed_speeds(problem, x)):
        if value is not None and abs(value) <= SMALL and kick[s.nodes[i, BEFORE], s.nodes[i, GUARD]] and not s.nodes[i, CLOSES]:
            yield at(i, value, False)
    for k in range(1, count):
        lasted, known = abs(float(orbit.rows[k, 0] - orbit.rows[k - 1, 0])), left[k]
        flight = orbit.nodes[k, CLOSES] and kick[tuple(orbit.nodes[k, :AFTER])] and kick[tuple(orbit.nodes[k - 1, :AFTER])]
        if lasted <= max(SMALL, CLEAR * known) and not (orbit.together[k] or flight):
            yield Measure(lasted / known, k, float(orbit.rows[k, 0]), False)
    for time, mode, guard, y in touches(problem, x, SMALL):
        yield Measure(abs(scaled(problem, T, mode, guard, time, y)) / ROUNDING, None, float(time), True)
    e.kernel.monitor(T, s.nodes, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
    if abs(info[sequence.PEAK]) <= SMALL:
        yield Measure(abs(info[sequence.PEAK]) / ROUNDING, None, float(info[sequence.PEAK_TIME]), True)
    if info[sequence.LEAVING_AT] >= 0.0 and abs(info[sequence.LEAVING]) <= SMALL:
        yield at(info[sequence.LEAVING_AT], info[sequence.LEAVING], True)
    yield from (at(i, margin, True) for i, margin in problem._refusal.margins(x) if abs(margin) <= SMALL)


def lasting(problem, x, orbit: Listed) -> np.ndarray:
    """Return what rounding leaves of the interval before every node (m,), periods, at a given place of the branch; where none is
    short that is not asked."""
    if not (np.diff(orbit.rows[:, 0]) <= CLEAR * SHORT).any():
        return np.full(len(orbit.nodes), ROUNDING)
    size = 1 + problem.scene.ns
    _, wide, rounded = problem._linearised(x)
    try:
        moves = np.linalg.inv(np.vstack([wide * problem.scale, problem.null_tangent(x)]))[:-1:size, :-1] * problem.scale[0]
    except np.linalg.LinAlgError:
        return np.full(len(orbit.nodes), SHORT)
    left = np.clip(np.abs(moves - np.roll(moves, 1, axis=0)) @ rounded, ROUNDING, SHORT)
    return np.roll(left, -orbit.first)


def scaled(problem, T, mode, guard, time, y) -> float:
    """Return the scaled value of a guard at a time (periods) and a state (ns,)."""
    e, z = problem.equations, np.empty(T.A.shape[2])
    z[:y.size] = y
    e.motion.forcing(T, time * 2.0 * np.pi / T.flat[0], z)
    row = np.empty(z.size)
    e.kernel.guard_gradient(T, mode, guard, z, row)
    return float(e.kernel.guard_value(T, mode, guard, z)) / e.kernel.scale_of(row, e.weights)


def zero(found: list[Measure]) -> list[Measure]:
    """Return those measures that are zero: all below the widest gap between two of them, where one is wide."""
    found = sorted(found, key=lambda one: one.value)
    gaps = np.diff(np.log([max(one.value, 1.0) for one in found]))
    return found[:1 + int(np.argmax(gaps))] if gaps.size and gaps.max() > math.log(APART) else found


def instants(problem, x, orbit: Listed) -> list[Instant]:
    """Return the instants at which measures of the sequence are zero at ``x`` (n + 1,), in order."""
    left = lasting(problem, x, orbit)
    members, count = zero(list(measures(problem, x, orbit, left))), len(orbit.nodes)
    least, spans = max((one.value for one in members), default=1.0), np.diff(orbit.rows[:, 0], prepend=-np.inf)
    joined = (np.abs(spans) <= max(least, 1.0) * left) | orbit.together
    found: list[Instant] = []

    def add(time, nodes, opens):
        same = next((k for k, one in enumerate(found) if one.nodes == nodes and (nodes or abs(one.time - time) <= AT_ONCE)), None)
        if same is None:
            found.append(Instant(time, nodes, opens))
        elif opens:
            found[same] = found[same]._replace(opens=True)

    for one in members:
        node, time = one.node, one.time
        if node is None:
            time = orbit.rows[0, 0] + (time - orbit.rows[0, 0]) % orbit.span
            near = np.abs((orbit.rows[:, 0] - time + 0.5 * orbit.span) % orbit.span - 0.5 * orbit.span)
            if orbit.nodes[0, GUARD] >= 0 and near.min() <= AT_ONCE:
                node = int(np.argmin(near))
            if node is None or near[node] > CLOCK:
                add(float(time), [], True)  # within an interval, as near to its end as that may be
        if node is not None:
            begin = end = node
            while begin > 0 and joined[begin]:
                begin -= 1
            while end + 1 < count and joined[end + 1]:
                end += 1
            add(float(orbit.rows[begin, 0]), list(range(begin, end + 1)), one.opens)
    return sorted(found)


def followers(scene, e, T, mode, guard, z, row, lasts) -> set[int]:
    """Return the modes that may follow an event at the joined state ``z`` (nx,): of an impact also those in which contacts that are
    at a limit just then have changed with it."""
    kick, found = bool(T.kick[mode, guard]), {mode}
    for after in T.then[mode, guard].tolist():
        if after >= 0:
            found.add(after)
            if after != mode and not kick and scene.tables.n_holds[after] <= scene.tables.n_holds[mode]:
                break  # a mode that holds nothing more may start wherever it is tried: none behind it is
    for other in range(int(scene.tables.n_guards[mode])) if kick else ():
        if other == guard or T.kick[mode, other] or not is_zero(e, T, mode, other, z, row, lasts):
            continue
        element = scene.guard(mode, other).element
        for lead in scene.expand(mode, other).then[mode, other].tolist():
            if lead >= 0:
                joint = (scene.combine(base, element, scene.keys[lead][element]) for base in list(found))
                found |= {after for after in joint if after is not None}
    return found if kick else found - {mode}


def is_zero(e, T, mode, guard, z, row, lasts) -> bool:
    """Whether a guard is zero at the joined state ``z`` (nx,), as well as an instant is known that ``lasts`` for rounding."""
    e.kernel.guard_gradient(T, mode, guard, z, row)
    return bool(abs(e.kernel.guard_value(T, mode, guard, z)) <= (ZERO + FAST * lasts) * e.kernel.scale_of(row, e.weights))


def rests(e, T, mode, z, lasts) -> bool:
    """Whether every row that a mode holds is at rest at the joined state ``z`` (nx,), as well as an instant is known that ``lasts``
    for rounding."""
    rows = (row for k in range(int(T.n_holds[mode])) for row in (T.H[mode, k], T.S[mode, k]) if row[:e.weights.size].any())
    return all(abs(row @ z) <= (STATE + FAST * lasts) * e.kernel.scale_of(row, e.weights) for row in rows)


def ways(problem, x, orbit: Listed, instant: Instant) -> list[list]:
    """Return the lists of (node, state before) that lead from the mode before an instant to the mode behind it, and leave the state
    as it is."""
    time, own, most = instant.time, instant.nodes, len(instant.nodes) + (MORE if instant.opens else 0)
    e, scene = problem.equations, problem.scene
    ns, T = scene.ns, e.numbers_at(x[-1])
    period, nx = 2.0 * np.pi / T.flat[0], T.A.shape[2]
    z, P, y, row = np.empty(nx), np.empty((ns, nx)), np.empty(ns), np.empty(nx)
    n, lasts = 2 * scene.n, 0.01 * AT_ONCE
    if own:
        lasts = float(orbit.rows[own[-1], 0] - orbit.rows[own[0], 0])
        e.motion.start_of(T, orbit.nodes, orbit.rows.ravel(), own[-1], P, z)
        leaves = z[:n].copy()
        begin, goal, start = int(orbit.nodes[own[0], BEFORE]), int(orbit.nodes[own[-1], AFTER]), orbit.rows[own[0], 1:].copy()
        time = float(orbit.rows[own[0], 0])
    else:
        i = int(np.searchsorted(orbit.rows[:, 0], time, side="right")) - 1
        begin = goal = int(orbit.nodes[i, AFTER])
        e.motion.start_of(T, orbit.nodes, orbit.rows.ravel(), i, P, z)
        e.motion.advance(T, begin, z, (time - orbit.rows[i, 0]) * period, y)
        start, leaves = y.copy(), y[:n].copy()
    rule, found, visits = kernels(scene, "bifurc.flow.rule"), [], 0

    def walk(mode, y, way):
        nonlocal T, visits
        visits += 1
        if mode == goal and (np.abs(y[:n] - leaves) <= (STATE + FAST * lasts) * e.weights[:n]).all():
            found.append(way)
        if len(way) == most or len(found) > WAYS or visits > VISITS:
            return
        z = np.empty(nx)
        z[:ns] = y
        if mode >= len(T.n_guards):
            T = problem.tables_at(x[-1])
        e.motion.forcing(T, time * period, z)
        for guard in range(int(T.n_guards[mode])):
            if not is_zero(e, T, mode, guard, z, row, lasts):
                continue
            scene.expand(mode, guard)
            T = problem.tables_at(x[-1])
            after = z.copy()
            rule.jump(T, mode, guard, False, z, after, np.empty((ns, nx)))
            for other in sorted(followers(scene, e, T, mode, guard, z, row, lasts)):
                if other >= len(T.n_guards):
                    T = problem.tables_at(x[-1])
                step = [mode, guard, other, 0, 0]
                if any(node.tolist() == step for node, _ in way) or not rests(e, T, other, after, lasts):
                    continue
                walk(other, after[:ns].copy(), [*way, (np.array(step), y)])

    walk(begin, start, [])
    return found


def located(problem, x) -> tuple[Listed, list[Instant]]:
    """Return the events of an orbit of given period at ``x`` (n + 1,) and the instants at which measures of it are zero."""
    orbit = listed(problem, x)
    return orbit, instants(problem, x, orbit)


def sequences(problem, x, known=None):
    """Yield (signature, x) of all sequences that the instants of vanishing measures allow at ``x`` (n + 1,); what `located` returns
    may be ``known``.

    First those in which events are born of an unlisted maximum, and vanish elsewhere.
    """
    orbit, groups = known or located(problem, x)
    choices: list[list] = []
    for one in groups:
        if (orbit.nodes[one.nodes, CLOSES] == 1).any():
            choices.append([None])
            continue
        old, count = [orbit.nodes[i, :AFTER + 1].tolist() for i in one.nodes], len(one.nodes)
        found = [way for way in ways(problem, x, orbit, one) if [node[:AFTER + 1].tolist() for node, _ in way] != old]
        found.sort(key=lambda way, one=one, count=count: abs(len(way) - count) if one.opens else len(way))
        choices.append([*found, None])
    for pick in itertools.islice(itertools.product(*choices), MOST):
        if any(way is not None for way in pick):
            made = assembled(problem, x, orbit, groups, pick)
            if made is not None:
                yield made


def assembled(problem, x, orbit: Listed, groups, pick):
    """Return (signature, x) with the ways that are picked, one for each instant, None where it stays; None where modes do not
    join."""
    scene, items = problem.scene, []
    gone = {i for one, way in zip(groups, pick, strict=True) if way is not None for i in one.nodes}
    for i in range(len(orbit.nodes)):
        if i not in gone and orbit.nodes[i, GUARD] >= 0:
            items.append((orbit.rows[i, 0], (i, 0, 0), orbit.nodes[i], orbit.rows[i, 1:]))
    for later, ((time, own, _), way) in enumerate(zip(groups, pick, strict=True)):
        at = own[0] if own else int(np.searchsorted(orbit.rows[:, 0], time, side="right")) - 0.5
        for k, (node, y) in enumerate(way or ()):
            items.append((orbit.rows[own[0], 0] if own else time, (at, later, k), node, y))
    if not items:
        return free_of_events(problem, x)
    items.sort(key=lambda item: item[1])
    nodes = np.array([item[2] for item in items], np.int64)
    joins = np.append(nodes[1:, BEFORE], nodes[0, BEFORE] if orbit.closure > 0 else scene.mirror(int(nodes[0, BEFORE])))
    if (nodes[:, AFTER] != joins).any():
        return None
    rows = np.array([np.append(item[0], item[3]) for item in items])
    behind = sum(item[1][0] < len(orbit.nodes) - orbit.first for item in items)
    nodes, rows = begun(scene, nodes, rows, behind % len(nodes), orbit.span, orbit.closure, -1.0)
    nodes = divided(scene, nodes, problem.tables_at(x[-1]), orbit.closure)
    if scene.ns > 2 * scene.n:
        carried(problem, x, nodes, rows, orbit)
    return Signature(nodes, np.zeros(len(nodes)), orbit.span, orbit.closure), np.append(rows.ravel(), x[-1])


def carried(problem, x, nodes, rows, orbit: Listed) -> None:
    """Write the memory that nothing changes between events into ``rows`` (m, 1 + ns), from event to event."""
    e, scene, T = problem.equations, problem.scene, problem.tables_at(x[-1])
    n, period = 2 * scene.n, 2.0 * np.pi / T.flat[0]
    z, P, y = np.empty(T.A.shape[2]), np.empty((scene.ns, T.A.shape[2])), np.empty(scene.ns)
    for i in [*range(len(rows)), *range(len(rows))]:
        e.motion.start_of(T, nodes, rows.ravel(), i, P, z)
        k = (i + 1) % len(rows)
        lasts = rows[k, 0] - rows[i, 0] + (orbit.span if k == 0 else 0.0)
        e.motion.advance(T, int(nodes[i, AFTER]), z, max(lasts, 0.0) * period, y)
        rows[k, 1 + n:] = (orbit.closure if k == 0 else 1.0) * y[n:]
