"""Where the event signature of an orbit changes, and the orbits that branch off.

At a graze the event is inserted at the touching time with zero speed.  The equations of the new signature are regular
there; their null vector is the tangent of the impacting orbit, and the side on which it is admissible is found by a step
to either side, never assumed: the orbit may live on the impacting or the non-impacting side.
"""
import numpy as np

from ..elements import EventKind
from ..orbits import sequence
from ..orbits.find import finished, from_state, touching
from ..orbits.sequence import AFTER, BEFORE, DIVIDE, ENDING, GUARD, STARTS, TOGETHER
from ..orbits.signature import Signature, divided, repeated, sections, translated
from .branchpoint import other_direction
from .kinds import CorrectorStatus, SpecialPointKind
from .problem import Corrected

NEAR = 1e-8  # scaled; listed speeds and unlisted maxima this small take part in one graze
TRIALS = (1e-5, 1e-4, 1e-3, 1e-6)  # scaled steps with which a side is tried
BEHIND = (1e-6, 1e-5, 1e-4, 1e-3)  # parts of the parameter's size behind a point at which motions are simulated
LISTED, UNLISTED, LEAVING, MERGES = "listed", "unlisted", "leaving", "merges"  # names of monitors
KINDS = {EventKind.STICK: SpecialPointKind.STICK_ONSET, EventKind.SLIP: SpecialPointKind.SLIP_ONSET,
         EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}
ENDS = {EventKind.STICK: SpecialPointKind.SLIP_ONSET, EventKind.SLIP: SpecialPointKind.STICK_ONSET,
        EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}
OUT = (1e-3, 1e-4, 1e-2, 1e-5)  # scaled steps to the orbits that are handed out


def halves(signature: Signature, x0, scale):
    """Return (covector (n + 1,), constant) of the measure in which the two halves of a doubled orbit differ, or None.

    It is positive at ``x0`` (n + 1,) and vanishes where the orbit becomes twice an orbit of half the period.
    """
    nodes = signature.nodes
    count = len(nodes) // 2
    if signature.closure < 0 or len(nodes) % 2 or abs(signature.span % 2.0) > 1e-9:
        return None
    if not np.array_equal(nodes[:count], nodes[count:]):
        return None
    half = (len(x0) - 1) // 2
    shift = np.zeros(half)
    shift[::half // count] = 0.5 * signature.span
    difference = (x0[:half] - x0[half:-1] + shift) / scale[:half]
    norm = np.sqrt(difference @ difference)
    if norm == 0.0:
        return None
    row = difference / (norm * scale[:half])
    return np.concatenate([row, -row, [0.0]]), float(row @ shift)


def through_grazing(problem, point, monitor):
    """Return (problem, x, tangent) behind a change of the event signature, or None when no side is admissible."""
    found = {LISTED: dropped, UNLISTED: inserted, LEAVING: parted}[monitor.name](problem, point.x)
    if found is not None:
        new = problem.with_sequence(*found)
        side = admissible_side(new, new.x0)
        if side is not None:
            return new, new.x0, side
    return by_motion(problem, point)


def by_motion(problem, point):
    """Return (problem, x, tangent) of the signature that motions a little behind the point have, or None.

    For changes of several events at once.  The orbit a little behind is taken to the point itself where Newton can: the new
    equations hold there too.
    """
    if problem.scene.ns == 2 * problem.scene.n and not np.any(problem.scene.tables.n_holds):
        return None  # without stick and memory every change is one of single events
    state = problem.solution(point.x).state
    ahead = 1.0 if point.tangent[-1] >= 0.0 else -1.0
    periods = round(problem.sequence.span * (2 if problem.sequence.closure < 0 else 1))
    low, high = problem.path.low, problem.path.high
    for step in BEHIND:
        value = float(point.x[-1]) + ahead * step * problem.parameter_scale
        if not low <= value <= high:
            continue
        system = problem.system.with_parameters(**{problem.parameter: value})
        orbit = finished(from_state(system, state, periods), problem.sequence.closure)
        if not orbit.success or touching(orbit):
            continue
        signature = translated(orbit.sequence, orbit.scene, problem.scene)
        if np.array_equal(signature.nodes[:, :ENDING], problem.sequence.nodes[:, :ENDING]):
            continue
        new = problem.with_sequence(signature, np.append(orbit.unknowns, value))
        tangent = new.null_tangent(new.x0)
        tangent *= ahead * (1.0 if tangent[-1] >= 0.0 else -1.0)
        there = new.correct(np.append(orbit.unknowns, point.x[-1]), tangent, True)
        if there.converged and np.abs((there.x - new.x0) / new.scale).max() < 0.1:
            side = admissible_side(new, there.x)
            if side is not None:
                return problem.with_sequence(signature, there.x), there.x, side
        return new, new.x0, tangent
    return None


def admissible_side(problem, x):
    """Return the unit tangent at ``x`` that points to admissible orbits, or None."""
    tangent = problem.null_tangent(x)
    boundary = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    for step in TRIALS:
        good = []
        for sign in (1.0, -1.0):
            c = problem.correct(x + sign * step * problem.scale * tangent, sign * tangent)
            if c.converged and all(c.monitors[k] < 0.0 for k in boundary):
                good.append(sign)
        if len(good) == 1:
            return good[0] * tangent
    return None


# events that appear

def touches(problem, x):
    """Return (tau, mode, guard, state) of every unlisted maximum that touches its guard at ``x``, in order of time."""
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
            value, at = e.kernel.segment_peak(T, mode, q, joined, (ends[i + 1] - ends[i]) * period, 1,
                                                     abs(int(node[STARTS + q])) if node.size > STARTS else 0)
            row = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, q, joined, row)
            if abs(value) <= NEAR * e.kernel.scale_of(row, e.weights):
                y = np.empty(scene.ns)
                e.motion.advance(T, mode, joined, at, y)
                found.append((ends[i] + at / period, mode, q, y))
    return sorted(found, key=lambda item: item[0])


def event_nodes(scene, mode, guard, x):
    """Return the nodes of an event that is born at a touch at ``x`` (nx,), or None.

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
        back = returning(scene, mode, guard, other, mode, owner, x)
        if back is not None:
            return [[mode, guard, other, 0, 0], [other, back, mode, 0, 0]]
    return None


def returning(scene, mode, guard, other, target, owner, x):
    """Return the guard of ``other`` that leads to ``target`` and vanishes at ``x`` after ``guard`` of ``mode``, or None."""
    T = scene.tables
    after = x.copy()
    after[:scene.ns] = T.R[mode, guard] @ x
    for back in scene.guards_of(other, owner):
        T = scene.expand(other, back)
        row = T.G[other, back]
        if target in T.then[other, back].tolist() and abs(row @ after) <= NEAR * (np.abs(row) @ np.maximum(np.abs(after), 1e-30)):
            return back
    return None


def inserted(problem, x, periods: int = 1):
    """Return (signature, x) with the touching events inserted, over ``periods`` repetitions of the orbit; only the first
    repetition gets them when there are several."""
    scene, s = problem.scene, problem.sequence
    born = touches(problem, x)
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
        nodes = event_nodes(scene, mode, guard, joined)
        if nodes is None:
            return None
        for node in nodes:
            items.append((tau, len(items), node, y))
    items.sort(key=lambda item: item[:2])
    nodes = divided(scene, np.array([item[2] for item in items], np.int64), problem.path.tables, s.closure)
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
    born = event_nodes(scene, mode, guard, joined)
    if born is None or len(born) != 2:
        return None
    nodes = [node[:ENDING].copy() for node in s.nodes]
    nodes[at][AFTER] = born[1][BEFORE]
    nodes.insert(at + 1, np.array(born[1], np.int64))
    signature = Signature(divided(scene, np.array(nodes), problem.path.tables, s.closure), np.zeros(len(nodes)), s.span, s.closure)
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
                back = None if other < 0 or other == mode else returning(scene, mode, q, other, after, owner, joined)
                if back is None:
                    continue
                nodes = [item[:ENDING].copy() for item in s.nodes]
                nodes[i:i + 1] = [np.array([mode, q, other, 0, 0]), np.array([other, back, after, 0, 0])]
                signature = Signature(divided(scene, np.array(nodes), problem.path.tables, s.closure), np.zeros(len(nodes)),
                                      s.span, s.closure)
                return signature, np.append(np.insert(rows, i, row, axis=0).ravel(), x[-1])
    return None


# events that vanish

def dropped(problem, x):
    """Return (signature, x) without the listed events that have lost speed or duration."""
    scene, s = problem.scene, problem.sequence
    size = 1 + scene.ns
    rows = x[:-1].reshape(-1, size)
    speeds = listed_speeds(problem, x)
    T = problem.equations.numbers_at(x[-1])
    items = [[node[:ENDING].copy(), row.copy(), not T.kick[node[BEFORE], node[GUARD]] if node[GUARD] >= 0 else True]
             for node, row in zip(s.nodes, rows, strict=True)]
    kept = [item for item, speed in zip(items, speeds, strict=True)
            if not (item[0][GUARD] >= 0 and not item[2] and speed is not None and abs(speed) <= NEAR)]
    changed = len(kept) < len(items)
    if changed and kept:  # impacts that have lost their speed
        join(kept, s)
    while len(kept) > 1:
        short = [i for i in range(len(kept)) if vanishing(kept, s, i)]
        if not short:
            break
        changed = True
        i = short[0]
        if i == 0:  # the interval reaches round the period: begin one node earlier
            kept = turned(scene, kept, s)
            continue
        merged = merging_nodes(scene, kept[i - 1][0], kept[i][0])
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
    nodes = divided(scene, np.array([item[0] for item in kept], np.int64), problem.path.tables, s.closure)
    return Signature(nodes, fixed, s.span, s.closure), np.append(np.concatenate([item[1] for item in kept]), x[-1])


def join(items, s):
    """Make every node end in the mode in which the next begins, where nodes between them are gone."""
    for k, item in enumerate(items):
        if s.closure > 0 or k + 1 < len(items):
            item[0][AFTER] = items[(k + 1) % len(items)][0][BEFORE]


def vanishing(items, s, i) -> bool:
    """Whether the interval that node ``i`` closes has no duration, and is no pair of kicks or coinciding stops."""
    node, before = items[i][0], items[i - 1][0]
    if node[GUARD] < 0 or before[GUARD] < 0 or not items[i][2] or node[DIVIDE] == TOGETHER or not items[i - 1][2]:
        return False
    return bool(abs(items[i][1][0] - items[i - 1][1][0] + (s.span if i == 0 else 0.0)) <= NEAR)


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


def merging_nodes(scene, first, second):
    """Return the nodes that replace two at the same instant: none, one, or two in the other order; None: not known."""
    if second[AFTER] == first[BEFORE]:
        return []
    a, b = scene.guard(int(first[BEFORE]), int(first[GUARD])), scene.guard(int(second[BEFORE]), int(second[GUARD]))
    if a.element == b.element:
        leading = [g for g in (int(first[GUARD]), *scene.guards_of(int(first[BEFORE]), a.element))
                   if int(second[AFTER]) in scene.expand(int(first[BEFORE]), g).then[int(first[BEFORE]), g].tolist()]
        return [[first[BEFORE], leading[0], second[AFTER], 0, 0]] if leading else None
    own = scene.guards_of(int(first[BEFORE]), b.element)
    middle = scene.combine(int(first[BEFORE]), b.element, scene.keys[int(second[AFTER])][b.element])
    if middle is None or b.number >= len(own):
        return None
    other = scene.guards_of(middle, a.element)
    if a.number >= len(other):
        return None
    return [[first[BEFORE], own[b.number], middle, 0, 0], [middle, other[a.number], second[AFTER], 0, 0]]


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
        back = returning(scene, before, guard, middle, after, owner, joined)
        if back is not None:
            nodes = [node[:ENDING] for node in s.nodes]
            nodes[at:at + 1] = [np.array([before, guard, middle, 0, 0]), np.array([middle, back, after, 0, 0])]
            signature = Signature(divided(scene, np.array(nodes), problem.path.tables, s.closure), np.zeros(len(nodes)),
                                  s.span, s.closure)
            return signature, np.append(np.insert(rows, at, rows[at], axis=0).ravel(), x[-1])
    return None


def kind_of(problem, name, x):
    """Return what kind of change of signature happens at ``x``: grazing, or the onset of stick, slip or separation."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    if name == LEAVING:
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
    if kind in (EventKind.SEPARATION, EventKind.CONTACT) and T.D[mode, guard].any():
        return SpecialPointKind.GRAZING  # a surface in space
    return kinds.get(kind, SpecialPointKind.GRAZING)


def listed_speeds(problem, x):
    """Return the scaled arriving speed, or duration of the interval it closes, of every node; None for sections."""
    e, s = problem.equations, problem.sequence
    T = e.numbers_at(x[-1])
    found = []
    for i, node in enumerate(s.nodes):
        if node[GUARD] < 0:
            found.append(None)
            continue
        info = np.zeros(sequence.INFO)
        only = s.nodes.copy()
        only[only[:, sequence.CLOSES] == 0, sequence.CLOSES] = 2
        only[i, sequence.CLOSES] = node[sequence.CLOSES]
        e.kernel.monitor(T, only, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
        found.append(float(info[sequence.LISTED]))
    return found


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


# orbits that branch off

def branches(problem, point, n_max: int):
    """Return the audited orbits on the branches that meet at a special point; None for the general rule."""
    if point.kind is SpecialPointKind.PERIOD_DOUBLING:
        return doubled(problem, point)
    if point.kind is SpecialPointKind.BRANCH_POINT and problem.sequence.closure < 0:
        return symmetry_broken(problem, point)
    if point.kind is SpecialPointKind.BRANCH_POINT and point.directions is not None:
        return crossing(problem, point)
    if point.kind is SpecialPointKind.GRAZING:
        return grazing_orbits(problem, point, n_max)
    return None


def critical(problem, x):
    """Return the null vector (n,), own units, of the Jacobian with multiplier -1."""
    J, _ = problem.wrapped_jacobian(x, -1.0)
    return np.linalg.svd(J * problem.scale[:-1])[2][-1] * problem.scale[:-1]


def stepped_out(problem, x, direction):
    """Return the first audited orbit on the branch through ``x`` in ``direction`` (n + 1,, own units), or None."""
    tangent = direction / problem.scale
    tangent /= np.sqrt(tangent @ tangent)
    boundary = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    for step in OUT:
        c = problem.correct(x + step * problem.scale * tangent, tangent)
        if c.converged and all(c.monitors[k] < 0.0 for k in boundary):
            orbit = problem.solution(c.x)
            if orbit.success:
                return orbit
    return None


def doubled(problem, point):
    """Return the orbit of twice the period at a flip; a one-tuple, or empty when it is not admissible."""
    s, x = problem.sequence, point.x
    v = critical(problem, x)
    rows = x[:-1].reshape(len(s.nodes), -1)
    later = rows.copy()
    later[:, 0] += s.span
    signature = Signature(np.vstack([s.nodes, s.nodes]), np.concatenate([s.fixed, s.fixed + s.span]), 2.0 * s.span)
    direction = np.concatenate([v, -v, [0.0]])
    start = np.concatenate([rows.ravel(), later.ravel(), x[-1:]])
    new = problem.with_sequence(signature, start + 1e-6 * direction)
    orbit = stepped_out(new, start, direction)
    return () if orbit is None else (orbit,)


def merging(problem, a, b, t):
    """Return the corrected point where the doubled orbits between rows ``a`` and ``b`` merge, near the part ``t``; or None.

    It is the flip of the single orbit: secant on its flip test at fixed parameters, then written out twice.
    """
    s, x = problem.sequence, a.x + t * (b.x - a.x)
    half = (len(x) - 1) // 2
    count = len(s.nodes) // 2
    shift = np.zeros(half)
    shift[::half // count] = 0.5 * s.span
    single = problem.with_sequence(Signature(s.nodes[:count], s.fixed[:count], 0.5 * s.span),
                                   np.append(0.5 * (x[:half] + x[half:-1] - shift), x[-1]))
    tangent = np.zeros(half + 1)
    tangent[-1] = 1.0

    def flip(guess, p):
        c = single.correct(np.append(guess, p), tangent, True)
        return c if c.converged and np.isfinite(c.monitors[0]) else None

    old = flip(single.x0[:-1], x[-1])
    if old is None:
        return None
    new = flip(old.x[:-1], x[-1] + 1e-5 * problem.scale[-1])
    for _ in range(20):
        if new is None or new.monitors[0] == old.monitors[0]:
            break
        step = -new.monitors[0] * (new.p - old.p) / (new.monitors[0] - old.monitors[0])
        old, new = new, flip(new.x[:-1], new.p + step)
        if new is None or abs(step) <= 1e-15 * problem.scale[-1] + 4e-16 * abs(new.p):
            break
    if new is None:
        return None
    v = critical(single, new.x)
    direction = np.concatenate([v, -v, [0.0]]) / problem.scale
    direction /= np.sqrt(direction @ direction)
    if direction @ a.tangent < 0.0:
        direction = -direction
    joined = np.concatenate([new.x[:-1], new.x[:-1] + shift, new.x[-1:]])
    return Corrected(joined, direction, True, CorrectorStatus.CONVERGED, new.iterations, new.residual, 0.0, 0.0, a.det_sign,
                     a.det_log, np.where(np.arange(len(a.tests) - 1) == problem._merges, 0.0, a.tests[1:]))


def symmetry_broken(problem, point):
    """Return the two mirror orbits at a pitchfork of a half-period orbit."""
    s, x = problem.sequence, point.x
    v = critical(problem, x).reshape(len(s.nodes), -1)
    whole, U = repeated(problem.scene, s, x[:-1])
    other = v.copy()
    other[:, 0] = -v[:, 0]
    direction = np.append(np.vstack([v, other]).ravel(), 0.0)
    start = np.append(U, x[-1])
    new = problem.with_sequence(whole, start)
    found = [stepped_out(new, start, sign * direction) for sign in (1.0, -1.0)]
    return tuple(orbit for orbit in found if orbit is not None)


def crossing(problem, point):
    """Return the orbits on both sides of the branch that crosses this one at a branch point."""
    direction = other_direction(point.directions, point.tangent) * problem.scale
    found = [stepped_out(problem, point.x, sign * direction) for sign in (1.0, -1.0)]
    return tuple(orbit for orbit in found if orbit is not None)


def grazing_orbits(problem, point, n_max: int):
    """Return the orbits of 1 .. n_max times the period with one more event that are born at a graze."""
    x = point.x
    base = problem
    if point.name == "listed":
        found = dropped(problem, x)
        if found is None:
            return ()
        base = problem.with_sequence(*found)
        x = base.x0
    orbits = []
    for n in range(1, n_max + 1):
        found = inserted(base, x, n)
        if found is None:
            continue
        new = base.with_sequence(*found)
        side = admissible_side(new, new.x0)
        if side is None:
            continue
        orbit = stepped_out(new, new.x0, side * new.scale)
        if orbit is not None:
            orbits.append(orbit)
    return tuple(orbits)
