"""Orbits of systems with excitation: from a state, from a motion that settles, from the period map, from another orbit."""
import numpy as np

from ..compose.natural import natural_sizes
from ..compose.scene import Scene, scene_of
from ..compose.writer import kernels
from ..flow.scan import CHATTER, GRAZE, KIND, PASSED, PERIODS
from ..flow.settle import Inconsistent
from ..flow.simulate import simulate
from ..flow.trajectory import Trajectory
from ..system import System
from .kinds import OrbitStatus
from .least import closed, half_of, halved, mark_trains, reduced
from .orbit import PeriodicOrbit
from .shooting.instants import in_order
from .shooting.resting import middle, resting_intervals
from .shooting.sequence import AFTER, BEFORE, GUARD
from .shooting.signature import divided, sections, sticking
from .solving import solve
from .standing import resting_start

CHUNK = 40  # forcing periods simulated between attempts
MOST_PERIODS = 16  # longest period looked for when none is given
MAP_STEPS = 20
LOST = 100.0  # times the misfit and the sizes at the first of them: so far off full steps lead nowhere
AT_REST = 1e-8  # of the state to which a motion comes: its start was at rest, to half of the digits
EPS = float(np.finfo(float).eps)
CLOSE = 0.02  # scaled gap of the map below which the event sequence of the motion is tried
LONG = 600  # unknowns of a sequence above which Newton, in time and memory of their square, waits until the motion is so close
TOUCHING = 1e-7  # scaled duration or speed of an event that is none
CLEAR = 0.1  # of the interval before an event, within which it returns after a period
NEAR = 0.05  # scaled distance of the settled motion from the orbit that is accepted for it
CENTRED = 1e-12  # of the motion's size: a slider so near the middle stays
CENTRINGS = 12


def finished(orbit: PeriodicOrbit, closure: int | None) -> PeriodicOrbit:
    """Return the orbit reduced to its least period and solved with the closure asked for."""
    return closed(reduced(orbit), closure, halved)


def centred(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """Return the member of a family without events whose sliders are equally near to slipping on both sides: where a motion let
    them stop is chance, and a branch of this member goes on until they slip in every period."""
    if orbit.sequence.events or not orbit.success:
        return orbit
    for _ in range(CENTRINGS):
        away = middle(orbit)
        if max(map(abs, away.values()), default=0.0) <= CENTRED * orbit.weights[0]:
            break
        y = orbit.state.copy()
        for c, step in away.items():
            y[c] += step
        moved = solve(orbit.system, sections(int(orbit.sequence.nodes[0, AFTER]), orbit.sequence.span), np.append(0.0, y),
                      orbit.weights, {**orbit.how, "note": "sliders that never slip stand equally near to both limits"})
        if not moved.success:
            break
        orbit = moved
    return orbit


def resting(system: System, tried: PeriodicOrbit, periods: int) -> PeriodicOrbit | None:
    """Return the motion in which every contact that can stick does so all the time, near the state of a failed search; None
    where there is none.

    Near it motions creep toward the edge of the resting interval and never stop, so that none of them shows it.
    """
    scene = scene_of(system)
    mode = next(scene.start_modes())
    if not scene.tables.n_holds[mode] or scene.tables.kick[mode].any():
        return None
    y = tried.state.copy()
    how = {"note": "the motion of permanent stick nearest to the guess"}
    for _ in range(1 + scene.n):
        orbit = solve(system, sections(mode, periods), np.append(0.0, y), tried.weights, how)
        if orbit.success or not orbit.residual < 1e-9:
            return orbit if orbit.success else None
        ends = [ends if ends[0] <= ends[1] else (-np.inf, np.inf) for ends in resting_intervals(orbit).values()]
        at = orbit.labels.values(orbit.state)
        inside = np.clip(at, *np.reshape(ends, (-1, 2)).T)
        if (inside == at).all():
            return None
        y = orbit.labels.moved(orbit.state, inside)
    return None


def from_state(system: System, y0, periods: int) -> PeriodicOrbit:
    """Return the orbit near a state at phase 0; the signature is that of the motion from it."""
    motion = simulate(system, y0, periods=2 * periods)
    if not motion.success:
        return unfound(system, y0, {"simulation": motion.message})
    found = from_motion(system, motion, 0, periods)
    if found.success and not touching(found):
        return found
    # a symmetric orbit is sought on the half period first: there no slider has a position of its own left to choose
    for half in ((True, False) if system.symmetry == -1 and periods % 2 else (False,)):
        nearer = from_map(system, y0, periods, half)
        if nearer is not None:
            return nearer
    if found.success:
        return found
    for wait in (1, 4, 16):  # a rough guess: let the motion come closer to what attracts it
        motion = simulate(system, y0, periods=(2 + wait) * periods)
        if not motion.success:
            break
        later = from_motion(system, motion, wait * periods, periods)
        if later.success:
            later.how["note"] = f"found from the motion {wait * periods} periods after the guess"
            return later
    return found


def touching(orbit: PeriodicOrbit) -> bool:
    """Whether an orbit of a system with memory has events of no duration: the edge of a family of orbits without them."""
    return orbit.scene.ns > 2 * orbit.scene.n and orbit._audit[0] < TOUCHING


def from_map(system: System, y0, periods: int, half: bool) -> PeriodicOrbit | None:
    """Return the orbit that Newton steps on the map over ``periods`` lead to from a state, or None.

    It needs no transient to die out and no event sequence of the guess to be that of the orbit: the derivative of the map is
    that of the motion from each state, whatever its events are.  Full steps are tried first (the map is piecewise smooth and
    its misfit need not fall in every step), damped ones then.  ``half``: on the map over half of it, turned round.
    """
    for dampings in ((1.0,), (1.0, 0.5, 0.25, 0.125, 0.0625)):
        mapped = period_map(system, np.array(y0, float), periods, half)
        farthest = np.inf if mapped is None else LOST * (mapped[3] + np.abs(mapped[1]))
        for k in range(MAP_STEPS):
            if mapped is None or (np.abs(mapped[1]) > farthest).any():  # exploding: motions under laws would take ages
                break
            y, gap, M, weights = mapped
            size = float(np.abs(gap / weights).max())
            if size < CLOSE:
                motion = simulate(system, y, periods=2 * periods)
                found = from_motion(system, motion, 0, periods) if motion.success else None
                near = found is not None and found.success and np.abs((found.state - y) / weights).max() < 0.5
                if found is not None and near and not (half and found.family and halved(found) is None):
                    found.how["map iterations"] = k
                    return found
            step = np.linalg.lstsq((np.eye(len(y)) - M) * weights, gap, rcond=1e-11)[0] * weights
            for damping in dampings:
                mapped = period_map(system, y + damping * step, periods, half)
                if mapped is not None and (len(dampings) == 1
                                           or np.abs(mapped[1] / weights).max() < (1.0 - 0.25 * damping) * size):
                    break
            else:
                break
    return None


def period_map(system: System, y, periods: int, half: bool):
    """Return the state (ns,) as a start takes it, how far the motion misses it after ``periods`` (``half``: its mirror image
    after half of them), the derivative of the map (ns, ns), and natural sizes (ns,) of the states; None when there is no such
    motion."""
    scene = scene_of(system)
    try:
        motion = simulate(system, y, periods=0.5 * periods if half else periods)
    except (ValueError, Inconsistent):
        return None  # beyond a stop, or in no mode
    if not motion.success or np.any(motion.recorded.rows[:, 3] == CHATTER):
        return None
    R, period = motion.recorded, scene.period
    assert period is not None and scene.omega is not None  # `find_orbit` refuses autonomous systems
    listed = [i for i in range(1, len(R.rows)) if R.rows[i, 3] not in (PASSED, GRAZE)]
    first = int(R.rows[0, 2])
    nodes = np.array([[first, -1, first, 0, 0], *([*R.rows[i, :3], 0, 0] for i in listed)], np.int64)
    start = motion(0.0)
    states = np.array([start, *(R.before[i] for i in listed)])
    times = np.array([0.0, *(R.rows[i, 4] + R.times[i] / period for i in listed)])
    M = np.empty((scene.ns, scene.ns))
    kernels(scene, "bifurc.orbits.shooting.motion").monodromy(
        scene.tables, nodes, (0.5 if half else 1.0) * periods, np.column_stack([times, states]).ravel(), M)
    if not np.isfinite(M).all():
        return None
    for place, row in scene.algebraic(int(nodes[-1, AFTER])):  # as the last state is shown
        M[place] = row[:scene.ns] @ M
    sign = -1.0 if half else 1.0
    return start, sign * motion.final - start, sign * M, sizes_of(scene, states)


def sizes_of(scene: Scene, states) -> np.ndarray:
    """Return natural sizes (ns,) of the states: one length for all coordinates, times omega for velocities."""
    n, omega = scene.n, scene.omega
    assert omega is not None  # `find_orbit` refuses autonomous systems
    if n == 0:
        return natural_sizes(scene.tables, states, 2.0 * np.pi / omega)
    length = max(float(np.abs(states[:, :n]).max()), float(np.abs(states[:, n:2 * n]).max()) / omega)
    left = EPS * float(np.abs(states[:, 2 * n:]).max(initial=0.0))  # below it coordinates are what damping has left of a start
    weights = np.full(scene.ns, length if length > left else 1.0)
    weights[n:2 * n] *= omega
    return weights


def from_motion(system: System, motion: Trajectory, first: int, periods: int) -> PeriodicOrbit:
    """Return the orbit near a simulated motion between the periods ``first`` and ``first + periods``.

    Slips of a contact in one direction only come to nothing over a period: the contact sticks.
    """
    scene = scene_of(system)
    signature, unknowns, weights = read_motion(scene, motion, first, periods)
    found = solve(system, signature, unknowns, weights, {"guess": "simulation"})
    if found.success and signature.creeping(scene):
        held = sticking(scene, signature, found.unknowns)
        return found if held is None else solve(system, *held, weights, {"guess": "simulation"})
    if not found.success and system.symmetry == -1 and periods % 2 and np.all(signature.nodes[:, GUARD] >= 0):
        # slow transients are those of the whole period: half of it, turned round, has no multiplier near 1
        half = half_of(scene, signature, unknowns)
        if half is not None:
            symmetric = solve(system, half[0], half[1].ravel(), weights, {"guess": "simulation"})
            return symmetric if symmetric.success else found
    return found


def read_motion(scene: Scene, motion: Trajectory, first: int, periods: int):
    """Return signature, unknowns and weights of a simulated motion that nearly closes after ``periods``."""
    R, period = motion.recorded, scene.period
    assert period is not None  # `find_orbit` refuses autonomous systems
    late = R.rows[1:, PERIODS] - first + R.times[1:] / period
    events = 1 + np.flatnonzero((late >= -1e-12) & (R.rows[1:, KIND] != PASSED) & (R.rows[1:, KIND] != GRAZE))
    listed = [(at, [m, g, after, 0, 1 if what == CHATTER else 0], before, speed)
              for at, (m, g, after, what, _), before, speed in zip(
                  late[events - 1].tolist(), R.rows[events].tolist(), R.before[events], R.speeds[events], strict=True)]
    chosen = [item for item in listed if item[0] < listed[0][0] + periods - 1e-7]
    if chosen and chosen[-1][1][AFTER] != chosen[0][1][BEFORE]:  # a period that does not close yet
        closed = window(listed, periods)
        chosen = listed[closed] if closed else chosen
        while len(chosen) > 1 and chosen[-1][1][AFTER] != chosen[0][1][BEFORE]:
            chosen.pop()
    start = motion(first * period)
    states = [start] + [item[2] for item in chosen]
    if np.abs(states).max() <= AT_REST * np.abs(motion.final).max():  # nothing, or its rounding, is no size of the orbit
        states.append(motion.final)
    weights = sizes_of(scene, np.array(states))
    if not chosen:
        mode = int(R.rows[np.searchsorted(R.rows[:, 4] + R.times / period, first, side="right") - 1, 2])
        return sections(mode, periods), np.concatenate([[0.0], start]), weights
    nodes = divided(scene, np.array([item[1] for item in chosen], np.int64))
    mark_trains(nodes, np.array([item[3] for item in chosen]))
    return *in_order(scene, nodes, np.array([[item[0], *item[2]] for item in chosen]), float(periods)), weights


def window(listed, periods: int) -> slice | None:
    """Return the part of the listed events that comes nearest to a closed period: its first event returns after it; or
    None.

    A motion that still settles may have one event more or less in a window of one period than the orbit.  It opens behind a long
    interval: in a train of impacts that comes a little later every period, an impact is nearest to another of the train.
    """
    best, found = (0.0, np.inf), None
    for i, first in enumerate(listed):
        for j in range(i + 1, len(listed)):
            late = listed[j][0] - first[0] - periods
            if late > 0.5 * periods:
                break
            if late <= -0.5 * periods or listed[j][1] != first[1] or listed[j - 1][1][AFTER] != first[1][BEFORE]:
                continue
            before = min(first[0] - listed[i - 1][0] if i else 0.0, listed[j][0] - listed[j - 1][0])
            clear = -before if abs(late) < CLEAR * before else 0.0
            away = abs(late) - 1e-3 * first[0] / periods  # among equals the later one
            if (clear, away) < best:
                best, found = (clear, away), slice(i, j)
    return found


def from_orbit(system: System, guess: PeriodicOrbit, periods: int | None) -> PeriodicOrbit:
    """Return the orbit of ``system`` near an orbit of other parameters, in its signature or one found by simulation."""
    if periods is None or periods == guess.periods:
        scene = scene_of(system)
        if scene.keys == guess.scene.keys and scene.same_structure(guess.system):
            found = solve(system, guess.sequence, guess.unknowns, guess.weights, {"guess": "orbit"})
            if found.success:
                return found
    return from_state(system, guess.state, int(periods or guess.periods))


def settled(system: System, periods: int | None, transient: int) -> PeriodicOrbit:
    """Return the orbit on which the motion from rest settles.

    A slider that slips less and less shakes down: what lists slips that lead nowhere has multipliers of its own, and is not what
    the motion settles on; where slips have no duration it is the edge of such motions, and taken where nothing else comes.
    """
    y, best, edge, done = resting_start(system), None, None, 0
    candidates = range(1, MOST_PERIODS + 1) if periods is None else [k for k in range(1, periods + 1) if periods % k == 0]
    chunk = max(CHUNK, candidates[-1])
    while done < transient:
        motion = simulate(system, y, periods=chunk)
        if not motion.success:
            return unfound(system, y, {"transient periods": done, "simulation": motion.message})
        sections_ = motion.sections
        y = sections_[-1]
        done += chunk
        crowd = len(motion.recorded.rows) / chunk * (1 + len(y))  # unknowns a period
        size = np.abs(sections_).max(axis=0) + 1e-300
        gaps = {k: float(np.abs((sections_[-1] - sections_[-1 - k]) / size).max()) for k in candidates}
        least = min(gaps.values())
        for k in [k for k in candidates if gaps[k] <= max(2.0 * least, 1e-6)][:2]:
            if k * crowd > LONG and gaps[k] > CLOSE:
                continue
            motions = ((begin, simulate(system, y, periods=begin + 2 * k)) for begin in (0, k))  # a start adds events of rounding
            found = next((o for begin, motion in motions if (o := from_motion(system, motion, begin, k)).success), None)
            if found is None or found.sequence.creeping(found.scene):
                continue
            if touching(found):
                edge = found
            else:
                away = float(np.abs((found.state - y) / found.weights).max())
                if found.stable is not False and away <= NEAR:
                    found.how["transient periods"] = done
                    return found
                if best is None:
                    best = found
    best = edge if best is None else best
    if best is not None and best.stable is not False:
        best.how["note"] = "the simulated motion had not yet come close to this stable orbit"
        return best
    return unfound(system, y, {"transient periods": done})


def unfound(system: System, y, how: dict) -> PeriodicOrbit:
    """Return what stands for an orbit that was not found: the state that was reached, and what is known."""
    scene = scene_of(system)
    y = np.concatenate([y, np.zeros(scene.ns - len(y))])
    return PeriodicOrbit(system, sections(0, 1.0), np.concatenate([[0.0], y]), np.maximum(np.abs(y), 1.0),
                         {"method": "simulation", **how}, OrbitStatus.NOT_FOUND)
