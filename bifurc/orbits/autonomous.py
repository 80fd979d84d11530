"""Periodic orbits of systems without excitation: where a motion returns, its period and its states are solved for together.

A motion returns where one of its events happens again with the same modes on both sides, or, without events, where a
coordinate has a maximum again.  Between two such returns lies a guess of the period; the equations are those of any event
sequence, with the period in the place of the first time (`sequence`), the phase being fixed by the event or by the section
through the maximum.

One file, because searches from rest, from a state and from an orbit share what a return is and how a search ends.
"""
import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import eig
from scipy.optimize import brentq

from ..compose.natural import natural_length, natural_sizes
from ..compose.scene import Scene, scene_of
from ..compose.tables import TURN, paced
from ..flow import settle
from ..flow.initial import start_of
from ..flow.scan import CHATTER, GRAZE, PASSED
from ..flow.simulate import simulate
from ..flow.trajectory import Trajectory
from ..system import System
from .energy import conservative, corrected, energy
from .equilibria.equilibrium import find_equilibrium
from .kinds import OrbitStatus
from .least import closed, half_of, mark_trains
from .orbit import PeriodicOrbit
from .shooting.instants import in_order
from .shooting.sequence import AFTER, BEFORE, GUARD
from .shooting.signature import Signature, divided, sections
from .solving import solve
from .standing import resting_start

CHUNK = 24  # slowest periods simulated between attempts
LONGEST = 2**20  # of them, in which something must come again
FIRST = 6  # slowest periods simulated from a guess
SAMPLES = 64  # points a fastest period, at which the slope of a coordinate is looked at
MOST_SAMPLES = 200_000  # of one motion
MANY = 100_000  # events of one simulation
NEAR = 0.25  # scaled distance of two returns that are taken for a guess
MOST = 12  # returns of one motion that are compared
SWINGS = 4 * MOST  # looked at of a motion that is fast
TRIALS = 6  # pairs of them that Newton starts from
CLOSE = 0.05  # scaled distance of the settled motion from the orbit that is accepted for it
SHORTEST = 1e-2  # of the guess of the period: every state comes back after no time
ASIDE = 1e-3  # of the size of the states: how far beside an unstable state of rest a search begins
STILL = 1e-7  # of the size at the start: a motion that has become so small has come to rest
LINEAR, ALIKE = 1e-2, 0.1  # of a state of rest: so near it is the one meant; a motion dies out as its eigenvalue says, to a tenth
SAME = 1e-8  # scaled difference of repeated parts of an orbit


class Return(NamedTuple):
    """A passage of a motion that may come again: its time, what happens, the state before."""

    time: float
    node: tuple  # mode before, guard, mode after, 0, closing; guard -1: a maximum
    state: np.ndarray
    speed: float
    dof: int = -1  # of which it is a maximum


def autonomous_orbit(system: System, guess, closure, transient: int, period: float | None) -> PeriodicOrbit:
    """Return an orbit of a system without excitation; the arguments are those of `find_orbit`."""
    if guess is None:
        found = settled(system, transient, aside(system, resting_start(system)))
    else:
        if isinstance(guess, PeriodicOrbit):
            first, found = guess.state, from_orbit(system, guess)
        else:
            scene = scene_of(system)
            first = start_of(scene, "guess", guess)
            if not scene.laws:
                paced(scene.tables, first, 0.0)
            if not first[scene.n:2 * scene.n].any():
                first = aside(system, first)
            found = from_state(system, first, period)
        done = found.success or found.status is OrbitStatus.AT_REST or period is not None or conservative(system)
        if not done:  # far from the orbit: it may lead there all the same
            later = settled(system, transient, first)
            found = later if later.success or later.status is OrbitStatus.AT_REST else found
    return symmetric(found, closure) if found.success else found


def symmetric(orbit: PeriodicOrbit, closure: int | None) -> PeriodicOrbit:
    """Return the orbit solved with the closure asked for."""
    return closed(orbit, closure, halved)


def halved(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """Return the orbit solved on half its period with y -> -y, or None when it has not this symmetry."""
    s, U = orbit.sequence.written_out(orbit.unknowns)
    y0, y1 = orbit._states(np.array([0.0, 0.5 * s.span]))
    if np.abs((y1 + y0) / orbit.weights).max() > SAME:
        return None
    made = half_of(orbit.scene, s, U)
    if made is None:
        return None
    found = solution(orbit.system, *wound(made[0], made[1].ravel(), s.clock, orbit.sequence.fixed), orbit.weights, orbit.how)
    return found if found.success else None


def wound(signature: Signature, unknowns, clock: float, section) -> tuple[Signature, np.ndarray]:
    """Return signature and unknowns with the period unknown, from those with the period as a number; see
    `Signature.written_out`.  ``section`` (ns + 1,) is that of an orbit without events."""
    rows = np.array(unknowns, float).reshape(len(signature.nodes), -1)
    rows[:, 0] -= rows[0, 0]
    rows[0, 0] = signature.span
    fixed = np.zeros(len(rows)) if signature.events else np.array(section, float)
    return dataclasses.replace(signature, span=0.0, fixed=fixed, clock=clock), rows.ravel()


def solution(system: System, signature: Signature, unknowns, weights, how) -> PeriodicOrbit:
    """Return the orbit of an event signature near ``unknowns``; without damping that of the energy they have."""
    if not conservative(system):
        orbit = solve(system, signature, unknowns, weights, how)
        if orbit.unknowns[0] > SHORTEST * unknowns[0]:
            return orbit
        return PeriodicOrbit(system, signature, unknowns, weights, orbit.how, OrbitStatus.NOT_CONVERGED)
    E = energy(system, unknowns[1:1 + len(weights)])
    made = corrected(system, signature, unknowns, weights, E)
    how = {"method": "event sequence of given energy, Newton", "energy": E, "iterations": made.iterations, **how}
    if made.success and made.x[0] > SHORTEST * unknowns[0]:
        return PeriodicOrbit(system, signature, made.x[:-1], weights, how)
    return PeriodicOrbit(system, signature, unknowns, weights, how, OrbitStatus.NOT_CONVERGED)


# from a guess

def from_orbit(system: System, guess: PeriodicOrbit) -> PeriodicOrbit:
    """Return the orbit near an orbit of other parameters, in its signature or one found by simulation."""
    scene = scene_of(system)
    if guess.autonomous and scene.keys == guess.scene.keys and scene.same_structure(guess.system):
        found = solution(system, guess.sequence, guess.unknowns, guess.weights, {"guess": "orbit"})
        if found.success:
            return found
    return from_state(system, guess.state, guess.period)


def from_state(system: System, y0, period: float | None) -> PeriodicOrbit:
    """Return the orbit near the motion from a state: its first returns are tried first, later ones then."""
    slow = slowest(scene_of(system)) if period is None else period
    best = None
    for length in (FIRST, 4 * FIRST, 16 * FIRST):
        motion = simulate(system, y0, duration=length * slow, max_events=MANY)
        for found in from_motion(system, returns(motion, early=True), period, early=True):
            if found.success:
                return found
            best = best or found
        if not motion.success:
            break
        if at_rest(motion, y0):
            return failed(motion, y0)
    return best or failed(motion, y0)


def settled(system: System, transient: int, first) -> PeriodicOrbit:
    """Return the orbit on which the motion from the state ``first`` settles."""
    slow, y = slowest(scene_of(system)), first
    done, passed, chunk, best = 0, 0, CHUNK, None
    while done < max(transient, 1) and chunk <= LONGEST:
        motion = simulate(system, y, duration=chunk * slow, max_events=MANY)
        if motion.success and best is None and dies_out(motion):
            return nothing(motion, OrbitStatus.AT_REST)
        again = returns(motion, early=False)
        passed += chunk
        if len(again) < 2:
            chunk *= 2  # a cycle of relaxation may stick far longer than anything oscillates: no time to settle was given
        else:
            done += chunk
        for found in from_motion(system, again, None, early=False):
            if not found.success or found.stable is False:
                continue
            away = distance_to(found, motion.final)
            if away <= CLOSE:
                found.how["transient"] = passed * slow
                return found
            best = found
        y = motion.final
        if motion.success and at_rest(motion, first):
            y = aside(system, y, LINEAR)  # along its stable manifold a motion comes to a state of rest that is unstable
            if y is motion.final:
                break
        if not motion.success:
            break
    if best is not None:
        best.how["note"] = "the simulated motion had not yet come close to this stable orbit"
        return best
    return failed(motion, first)


def aside(system: System, y, near=STILL) -> np.ndarray:
    """Return a start; where ``y`` is an unstable state of rest, or as ``near`` to one (of the size of the motion), one a little
    beside that, in the direction that grows fastest, on the side of ``y``; where several fields lead away, one beside it."""
    rest, scene, n = find_equilibrium(system, y), scene_of(system), system.n
    if n:
        units, size = rest.field.units, max(natural_length(scene.tables), float(np.abs(y[:n]).max()))
    else:
        units, size = natural_sizes(scene.tables, np.array([y]), fastest(scene)), 1.0
        if scene.ending(settle.start(scene, np.append(y, 1.0))[0]) is not None:  # several fields lead away from a surface
            return y + ASIDE * units
    away = rest.state - np.append(y, np.zeros(len(units) - len(y)))
    if not rest.success or rest.stable is not False or np.abs(away / units)[:2 * n or None].max() > near * size:
        return y
    A, Z, coordinates = rest._small
    values, left, right = eig(A, left=True)
    k = int(np.argmax(values.real))
    side = -1.0 if np.real(np.conj(left[:, k]) @ (coordinates @ away)) > 0.0 else 1.0
    direction = side * Z @ np.real(right[:, k])
    return rest.state + ASIDE * size * direction / np.abs(direction / units).max()


def failed(motion: Trajectory, start) -> PeriodicOrbit:
    """Return what a search from the state ``start`` without result says: rest is what the motion has come to, if it would stay."""
    rests = motion.success and at_rest(motion, start) and aside(motion.system, motion.final, LINEAR) is motion.final
    return nothing(motion, OrbitStatus.AT_REST if rests else OrbitStatus.NOT_FOUND)


def nothing(motion: Trajectory, status: OrbitStatus) -> PeriodicOrbit:
    """Return the failure of a search by simulation, with the state in which the motion ended."""
    scene, y = scene_of(motion.system), motion.final
    mode = int(motion.recorded.rows[-1, AFTER])
    none = dataclasses.replace(sections(mode, 0.0), fixed=np.zeros(scene.ns + 1), clock=slowest(scene))
    return PeriodicOrbit(motion.system, none, np.append(1.0, y), np.maximum(np.abs(y), 1.0), {"method": "simulation"}, status)


def at_rest(motion: Trajectory, start) -> bool:
    """Whether all speeds have died, and memory stands, in the last fifth of a motion of a search that began at ``start``."""
    n = motion.system.n
    states = motion(np.linspace(motion.start, motion.stop, 257))
    speeds, first = np.abs(states[:, n:2 * n]).max(axis=1, initial=0.0), np.abs(np.asarray(start, float))
    rate = 2.0 * np.pi / slowest(scene_of(motion.system))
    size = max(rate * np.abs(states[:, :n]).max(initial=0.0), rate * first[:n].max(initial=0.0), speeds.max(),
               first[n:2 * n].max(initial=0.0))
    memory = states[:, 2 * n:]
    return bool(speeds[-52:].max() <= STILL * size and (np.ptp(memory[-52:], axis=0) <= STILL * np.abs(memory).max(axis=0)).all())


def dies_out(motion: Trajectory) -> bool:
    """Whether a motion without events comes near a stable state of rest as its slowest eigenvalue says, and so for ever."""
    if len(motion.events):
        return False
    rest = find_equilibrium(motion.system, motion.final)
    if not rest.success or not rest.stable or rest.on_boundary or len(rest.continuum):
        return False
    away = np.abs(motion(np.linspace(motion.start, motion.stop, 257)) - rest.state).max(axis=1)
    early, late = away[:52].max(), away[-52:].max()
    if not 0.0 < late < min(early, LINEAR * max(float(np.abs(rest.state).max()), 1e-300)):
        return False
    rate = np.log(early / late) / (0.8 * (motion.stop - motion.start))
    return bool(abs(rate / -rest.eigenvalues.real.max() - 1.0) < ALIKE)


def distance_to(orbit: PeriodicOrbit, y) -> float:
    """Return the scaled distance of a state from an orbit."""
    return float(np.abs((orbit.sample(400)[1] - y) / orbit.weights).max(axis=1).min())


# returns of a motion

def from_motion(system: System, found: list[Return], period: float | None, early: bool) -> Iterator[PeriodicOrbit]:
    """Yield the orbits that Newton finds between two returns of a motion, the nearest pairs first; ``early``: those at its
    beginning first."""
    scene = scene_of(system)
    found = found[:MOST] if early else found[-MOST:]
    length = float(max((np.abs(item.state[:scene.n]).max(initial=0.0) for item in found), default=0.0))
    pairs = []
    for i, first in enumerate(found):
        for j in range(i + 1, len(found)):
            if found[j].node != first.node or found[j - 1].node[AFTER] != first.node[BEFORE]:
                continue
            T = found[j].time - first.time
            if T <= 0.0 or (period is not None and not 0.6 < T / period < 1.6):
                continue
            weights = sizes(scene, [item.state for item in found[i:j + 1]], T, length)
            gap = float(np.abs((found[j].state - first.state) / weights).max())
            if gap < NEAR or period is not None:
                pairs.append((gap * (j - i), i if early else -i, i, j, weights))
            break
    for _, _, i, j, weights in sorted(pairs, key=lambda pair: pair[1] if early else pair[0])[:TRIALS]:
        yield between(system, found[i:j], found[j].time - found[i].time, weights)


def between(system: System, chosen: list[Return], T: float, weights) -> PeriodicOrbit:
    """Return the orbit that Newton finds from the returns of one period ``T``."""
    scene = scene_of(system)
    first = chosen[0]
    rows = np.array([np.append((item.time - first.time) / T, item.state) for item in chosen])
    rows[0, 0] = 1.0
    nodes = np.array([item.node for item in chosen], np.int64)
    if first.node[GUARD] < 0:
        plane = section(scene, first.dof, weights)
        signature = dataclasses.replace(sections(first.node[AFTER], 0.0), fixed=plane, clock=T)
    else:
        nodes = divided(scene, nodes)
        mark_trains(nodes, np.array([item.speed for item in chosen]))
        signature, rows = in_order(scene, nodes, rows, 0.0, T)
    found = solution(system, signature, rows.ravel(), weights, {"guess": "simulation"})
    return rested(found) if found.success else found


def rested(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """Return the orbit, as a failure where it is an equilibrium: that has any period, and says nothing of where the motion goes."""
    n, states = orbit.scene.n, orbit._states(np.linspace(0.0, orbit._whole[0].span, 64, endpoint=False))
    moves = np.abs(states[:, n:2 * n]).max() / orbit.weights[n:2 * n].max() if n else (np.ptp(states, axis=0) / orbit.weights).max()
    if moves > STILL:
        return orbit
    how = {**orbit.how, "note": "Newton's method led to a state of rest"}
    return PeriodicOrbit(orbit.system, orbit.sequence, orbit.unknowns, orbit.weights, how, OrbitStatus.NOT_CONVERGED)


def section(scene: Scene, dof: int, weights) -> np.ndarray:
    """Return normal and value (ns + 1,) of the section on which a coordinate, at its maximum, has no speed."""
    plane = np.zeros(scene.ns + 1)
    plane[scene.n + dof] = 1.0 / weights[scene.n + dof]
    return plane


def listed(motion: Trajectory) -> list[Return]:
    """Return the events of a motion that an orbit lists."""
    R = motion.recorded
    found = []
    for row, time, before, speed in zip(R.rows[1:].tolist(), R.times[1:], R.before[1:], R.speeds[1:], strict=True):
        m, g, after, what, _ = row
        if what not in (PASSED, GRAZE):
            found.append(Return(float(time), (m, g, after, 0, 1 if what == CHATTER else 0), before, float(speed)))
    return found


def repeated(found: list[Return]) -> bool:
    """Whether one of the events of a motion happens again."""
    return len({item.node for item in found}) < len(found)


def returns(motion: Trajectory, early: bool) -> list[Return]:
    """Return the listed events of a motion; where it has none that repeats, maxima of its widest coordinate, the first of them if
    ``early``, else the last."""
    found = listed(motion)
    if repeated(found):
        return found
    return maxima(motion, found[-1].time if found else motion.start, motion.stop, early)


def maxima(motion: Trajectory, begin: float, stop: float, early: bool) -> list[Return]:
    """Return maxima, between ``begin`` and ``stop``, of the coordinate with the largest extent: all of a slow motion, the first or
    the last of a fast one."""
    scene = scene_of(motion.system)
    if scene.n == 0:
        return []  # a system of first order with an affine field that swings for ever without an event is a centre
    short = fastest(scene)  # of the affine part: under a stiffening law the motion may be far faster
    while True:
        count = min(int(np.ceil(SAMPLES * (stop - begin) / short)), MOST_SAMPLES)
        if count < 2:
            return []
        t = np.linspace(begin, stop, count + 1)
        y = motion(t)
        i = scene.n + int(np.argmax(np.ptp(y[:, :scene.n], axis=0)))
        # a harmonic motion of this extent and largest speed has this period
        swing = np.pi * float(np.ptp(y[:, i - scene.n])) / max(float(np.abs(y[:, i]).max()), 1e-300)
        if not 0.0 < swing < 0.5 * short or count == MOST_SAMPLES:
            break
        short = swing
        begin, stop = (begin, min(stop, begin + SWINGS * swing)) if early else (max(begin, stop - SWINGS * swing), stop)
    mode = int(motion.recorded.rows[-1, 2])
    found = []
    for k in np.flatnonzero((y[:-1, i] > 0.0) & (y[1:, i] <= 0.0)).tolist():
        arc = simulate(motion.system, y[k], duration=t[k + 1] - t[k])  # from here: a motion without events is one long segment
        if y[k + 1, i] < 0.0 <= arc.final[i]:
            continue  # at rest speeds are rounding, and have no signs
        at = arc.stop if y[k + 1, i] == 0.0 else brentq(lambda s, arc=arc: float(arc(s)[i]), arc.start, arc.stop, xtol=1e-15)
        found.append(Return(float(t[k] + at - arc.start), (mode, -1, mode, 0, 0), arc(at), 0.0, i - scene.n))
    return found


# natural times and sizes

def sizes(scene: Scene, states, T: float, length: float) -> np.ndarray:
    """Return natural sizes (ns,) of the states: one length for all coordinates, times 2 pi / T for velocities."""
    n, omega = scene.n, 2.0 * np.pi / T
    if n == 0:
        return natural_sizes(scene.tables, np.array(states), T)
    length = max(length, max(float(np.abs(y[n:2 * n]).max()) for y in states) / omega)
    weights = np.full(scene.ns, length if length > 0.0 else 1.0)
    weights[n:2 * n] *= omega
    return weights


def slowest(scene: Scene) -> float:
    """Return the longest period of oscillation among the modes built so far (affine part), time."""
    T = scene.tables
    turns = np.concatenate([np.abs(np.linalg.eigvals(T.A[m, :, :scene.ns]).imag) for m in range(len(scene.keys))])
    turns = turns[turns > 1e-9 * turns.max(initial=0.0)]
    return 2.0 * np.pi / float(turns.min()) if turns.size else fastest(scene)


def fastest(scene: Scene) -> float:
    """Return the shortest period of oscillation that the step of the modes allows for, time."""
    return 2.0 * np.pi / TURN * float(scene.tables.step.min())
