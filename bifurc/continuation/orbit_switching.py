"""Where the event signature of an orbit changes, and the orbits that branch off.

At a graze the event is inserted at the touching time with zero speed.  The equations of the new signature are regular
there; their null vector is the tangent of the impacting orbit, and the side on which it is admissible is found by a step
to either side, never assumed: the orbit may live on the impacting or the non-impacting side.
"""
import numpy as np

from ..orbits import sequence
from ..orbits.sequence import AFTER, BEFORE, CLOSES, GUARD, STARTS
from ..orbits.signature import Signature, divided, repeated, sections
from .branchpoint import other_direction
from .kinds import CorrectorStatus, SpecialPointKind
from .problem import Corrected

NEAR = 1e-8  # scaled; listed speeds and unlisted maxima this small take part in one graze
TRIALS = (1e-5, 1e-4, 1e-3, 1e-6)  # scaled steps with which a side is tried
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
    """Return (problem, x, tangent) behind a grazing, or None when no side is admissible."""
    found = dropped(problem, point.x) if monitor.name == "listed" else inserted(problem, point.x)
    if found is None:
        return None
    new = problem.with_sequence(*found)
    side = admissible_side(new, new.x0)
    return None if side is None else (new, new.x0, side)


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


def event_nodes(scene, mode, guard):
    """Return the nodes of an event that is born at a graze: an impact, or the entry and exit of a contact; None if neither."""
    T = scene.tables
    if T.kick[mode, guard]:
        return [[mode, guard, mode, 0, 0]]
    for other in T.then[mode, guard].tolist():
        if other == -2:
            T = scene.expand(mode, guard)
            return event_nodes(scene, mode, guard)
        if other < 0 or other == mode:
            continue
        for back in range(int(T.n_guards[other])):
            a, b = T.G[mode, guard], T.G[other, back]
            size = np.sqrt((a @ a) * (b @ b))
            if mode in T.then[other, back].tolist() and T.element[other, back] == T.element[mode, guard] \
                    and abs(size + a @ b) <= 1e-12 * size:
                return [[mode, guard, other, 0, 0], [other, back, mode, 0, 0]]
    return None


def inserted(problem, x, periods: int = 1):
    """Return (signature, x) with the touching events inserted, over ``periods`` repetitions of the orbit; only the first
    repetition gets them when there are several."""
    scene, s = problem.scene, problem.sequence
    born = touches(problem, x)
    if not born:
        return None
    size = 1 + scene.ns
    rows = x[:-1].reshape(-1, size)
    items: list[tuple] = []
    for k in range(periods):
        for node, row in zip(s.nodes.tolist(), rows, strict=True):
            if node[GUARD] >= 0:
                items.append((row[0] + k * s.span, len(items), node[:STARTS], row[1:]))
    for tau, mode, guard, y in born:
        nodes = event_nodes(scene, mode, guard)
        if nodes is None:
            return None
        for node in nodes:
            items.append((tau, len(items), node, y))
    items.sort(key=lambda item: item[:2])
    nodes = divided(scene, np.array([item[2] for item in items], np.int64), problem.path.tables, s.closure)
    unknowns = np.concatenate([np.concatenate([[item[0]], item[3]]) for item in items])
    signature = Signature(nodes, np.zeros(len(nodes)), s.span * periods, s.closure)
    return signature, np.append(unknowns, x[-1])


# events that vanish

def dropped(problem, x):
    """Return (signature, x) without the listed events that have lost speed or duration."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    T = e.numbers_at(x[-1])
    size = 1 + scene.ns
    rows = x[:-1].reshape(-1, size)
    gone = set()
    speeds = listed_speeds(problem, x)
    for i, (node, speed) in enumerate(zip(s.nodes, speeds, strict=True)):
        if node[GUARD] < 0 or speed is None or abs(speed) > NEAR:
            continue
        gone.add(i)
        if not T.kick[node[BEFORE], node[GUARD]]:  # an interval of no duration, between this event and one of its neighbours
            apart = [min(abs(rows[i, 0] - rows[k, 0]), s.span - abs(rows[i, 0] - rows[k, 0]))
                     for k in ((i - 1) % len(rows), (i + 1) % len(rows))]
            gone.add((i - 1 if apart[0] <= apart[1] else i + 1) % len(rows))
    if not gone:
        return None
    kept = [i for i in range(len(rows)) if i not in gone]
    if not kept:
        return free_of_events(problem, x)
    nodes = s.nodes[kept].copy()
    for k, node in enumerate(nodes):
        node[AFTER] = nodes[(k + 1) % len(nodes), BEFORE] if s.closure > 0 or k + 1 < len(nodes) else node[AFTER]
    nodes = divided(scene, nodes, problem.path.tables, s.closure)
    return Signature(nodes, s.fixed[kept], s.span, s.closure), np.append(rows[kept].ravel(), x[-1])


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
