"""Orbits of unknown period where their event sequence changes, and where it can only end.

The rules for changes (`appearing`, `vanishing`) and the simulation that tells what follows (`successor`) know orbits with a given
period.  At the point of the change the period is a number: the orbit is written out with it, changed, and its period made unknown
again.

A stick that is reached tangentially ends the orbit.  In forced and autonomous systems alike the arc of slip before it then
misses the speed of the surface beyond, while the stick still lasts: there is nothing near that could go on.
"""
import dataclasses
import math

import numpy as np
from scipy.optimize import brentq

from ...orbits.autonomous import wound
from ...orbits.equilibria.equilibrium import find_equilibrium
from ...orbits.shooting import sequence
from ...orbits.shooting.sequence import AFTER, DIVIDE, SHORT, TOGETHER
from ..kinds import CorrectorStatus, SpecialPointKind
from ..problem import Corrected, at_end
from ..registry import EQUILIBRIA, named
from .appearing import inserted, parted
from .vanishing import dropped

SHRINKS = "shrinks"  # name of the monitor of the extent of an orbit without events
SMALL = 1e-6  # scaled extent of an orbit that has shrunk onto an equilibrium,
SHRINKING = 1e-4  # and of one with events that steps bring no nearer to it: its equations lose all their ranks there
SLOW, LINGERING = 0.1, 0.1  # of its fastest pace; scaled distance from a saddle: where an orbit lingers
SECANTS = 30
SAMPLES = 96  # states of an orbit without events among which its maximum is looked for
PHASE = 0.381966  # of a period: where an orbit without events begins for a change
CHANGES = {"listed": dropped, "unlisted": inserted, "leaving": parted}  # by the name of the monitor


def written_out(problem, x):
    """Return the problem and its unknowns with the period as a number; both as they are where it is given."""
    if not problem.sequence.clock:
        return problem, x
    signature, U = problem.sequence.written_out(x[:-1])
    at = np.append(U, x[-1])
    return problem.with_sequence(signature, at), at


def changed(change, problem, x, *arguments):
    """Return (signature, x) that ``change(problem, x, *arguments)`` makes of the orbit with its period as a number, the period
    unknown again; None where it makes none."""
    plain, at = written_out(problem, x)
    if plain is not problem and not plain.sequence.events:
        at = shifted(plain, at)
    found = change(plain, at, *arguments)
    if found is None or plain is problem:
        return found
    return released(plain, *found)


def released(plain, signature, at):
    """Return signature and unknowns (n + 1,) of an orbit with its period unknown; there, and in ``plain``, it is a number."""
    made, U = wound(signature, at[:-1], plain.sequence.clock, None) if signature.events else free(plain, signature, at)
    return made, np.append(U, at[-1])


def shifted(plain, x):
    """Return ``x`` with the start of an orbit without events at another phase: its section lies at a maximum, where just now
    something may touch."""
    e, T = plain.equations, plain.equations.numbers_at(x[-1])
    start, y = np.zeros(T.A.shape[2]), np.empty(plain.scene.ns)
    start[:y.size] = x[1:1 + y.size]
    e.motion.forcing(T, 0.0, start)
    e.motion.advance(T, int(plain.sequence.nodes[0, AFTER]), start, PHASE * plain.sequence.span * 2.0 * np.pi / T.flat[0], y)
    return np.concatenate([x[:1], y, x[-1:]])


def free(plain, signature, x):
    """Return signature and unknowns of an orbit without events: it begins at the maximum of its widest coordinate."""
    e, scene = plain.equations, plain.scene
    T, ns, n = e.numbers_at(x[-1]), scene.ns, scene.n
    period = 2.0 * np.pi / T.flat[0]
    span, mode = plain.sequence.span, int(signature.nodes[0, AFTER])
    start, y = np.zeros(T.A.shape[2]), np.empty(ns)
    start[:ns] = x[1:1 + ns]
    e.motion.forcing(T, 0.0, start)

    def state(tau):
        e.motion.advance(T, mode, start, tau * period, y)
        return y.copy()

    times = np.linspace(0.0, 2.0 * span, 2 * SAMPLES + 1)
    states = np.array([state(tau) for tau in times])
    i = n + int(np.argmax(np.ptp(states[:, :n], axis=0)))
    k = next(k for k in range(2 * SAMPLES) if states[k, i] > 0.0 >= states[k + 1, i])
    top = state(float(brentq(lambda tau: state(tau)[i], times[k], times[k + 1], xtol=1e-15)))
    plane = np.zeros(ns + 1)
    plane[i] = 1.0 / plain.weights[i]
    whole = dataclasses.replace(signature, span=span)
    return wound(whole, np.append(0.0, top), plain.sequence.clock, plane)


def extent(problem, x) -> float:
    """Return the scaled rate at which an orbit without events crosses its section: negative, and zero where it has shrunk to
    an equilibrium; or where its section touches it."""
    e, s, ns = problem.equations, problem.sequence, problem.scene.ns
    T, start, f = e.numbers_at(x[-1]), np.zeros(e.path.tables.A.shape[2]), np.empty(ns)
    start[:ns] = x[1:1 + ns]
    e.kernel.forcing(T, 0.0, start)
    e.kernel.field(T, int(s.nodes[0, AFTER]), start, f)
    return float(s.fixed[:ns] @ f) * s.clock / (2.0 * np.pi)


def small(problem, x, size=SMALL) -> bool:
    """Whether the orbit at ``x`` (n + 1,) is no larger than ``size`` (scaled): an equilibrium."""
    n = problem.scene.n
    whole, U = problem._whole(x)
    states = np.empty((SAMPLES, problem.scene.ns))
    times = np.linspace(0.0, whole.span, SAMPLES, endpoint=False)
    problem.equations.motion.states(problem.equations.numbers_at(x[-1]), whole.nodes, whole.span, U, times, states)
    moves = states[:, n:2 * n] / problem.weights[n:2 * n] if n else np.ptp(states, axis=0) / problem.weights
    return bool(np.abs(moves).max() <= size)


def homoclinic(orbit, near=LINGERING) -> bool:
    """Whether an orbit without a clock spends most of its time, slowly, by an unstable state of rest, and comes so ``near`` to it
    (scaled)."""
    states = orbit.sample(SAMPLES)[1]
    pace = np.abs(np.diff(states, axis=0) / orbit.weights).max(axis=1)
    if np.median(pace) > SLOW * pace.max():
        return False
    rest = find_equilibrium(orbit.system, states[int(np.argmin(pace))])
    return rest.success and rest.stable is False and bool((np.abs(states - rest.state) / orbit.weights).max(axis=1).min() <= near)


def shrunk(problem, a, b):
    """Return the Hopf point at which the orbits between rows ``a`` and ``b`` shrink onto an equilibrium, as a corrected point; or
    None.

    The equilibrium in the middle of the orbit is followed to where its eigenvalues are imaginary (secants).
    """
    scene = problem.scene
    y = np.zeros(scene.ns)
    for i in range(scene.n):
        top, low = problem._measured(a.x, i)[:2]
        y[i] = 0.5 * (top + low)
    y[2 * scene.n:] = a.x[1 + 2 * scene.n:1 + scene.ns]
    mode = int(problem.sequence.nodes[0, AFTER])
    rest = named(EQUILIBRIA)(problem.system, problem.path, mode, y, a.p, problem.parameter_scale, float(problem.weights[0]))
    fixed = np.zeros(rest.scale.size)
    fixed[-1] = 1.0
    old = rest.correct(rest.x0, fixed, True)
    step = b.p - a.p or 1e-6 * problem.parameter_scale
    new = rest.correct(np.append(old.x[:-1], a.p + step), fixed, True)
    for _ in range(SECANTS):
        if not (old.converged and new.converged) or new.monitors[-1] == old.monitors[-1]:
            break
        step = -new.monitors[-1] * (new.p - old.p) / (new.monitors[-1] - old.monitors[-1])
        if not abs(step) < problem.parameter_scale:
            return None
        old, new = new, rest.correct(np.append(new.x[:-1], new.p + step), fixed, True)
        if abs(step) <= 1e-15 * problem.parameter_scale + 4e-16 * abs(new.p):
            break
    if not new.converged or not rest.confirm(SpecialPointKind.HOPF, new.x):
        return None
    period = 2.0 * np.pi / rest.frequency(new.x) / problem.sequence.clock * (0.5 if problem.sequence.closure < 0 else 1.0)
    if abs(period / a.x[0] - 1.0) > 0.2:
        return None
    x = np.concatenate([[period], rest.state(new.x[:-1]), new.x[-1:]])
    direction = (b.x - a.x) / problem.scale
    direction[-1] = 0.0  # the parameter is even in the amplitude
    direction /= np.sqrt(direction @ direction)
    # its equations are singular: what the determinant headed for is not known
    return Corrected(x, direction, True, CorrectorStatus.CONVERGED, 0, 0.0, 0.0, 0.0, a.det_sign, math.nan,
                     at_end(problem, a, problem._shrinks))


def ends(problem, name: str, x) -> bool:
    """Whether the orbit at ``x`` (n + 1,) reaches a stick tangentially, and leaves it later."""
    if name != "listed":
        return False
    plain, at = written_out(problem, x)
    e, s = plain.equations, plain.sequence
    T, info = e.numbers_at(at[-1]), np.zeros(sequence.INFO)
    e.kernel.monitor(T, s.nodes, s.fixed, s.span, e.closure, at[:-1], e.weights, info)
    i = int(info[sequence.LISTED_AT])
    if i < 0:
        return False
    before, guard, after = (int(value) for value in s.nodes[i, :AFTER + 1])
    if T.kick[before, guard] or s.nodes[i, DIVIDE] == TOGETHER or T.n_holds[after] <= T.n_holds[before]:
        return False
    times = at[:-1].reshape(len(s.nodes), -1)[:, 0]
    times = np.concatenate([[times[-1] - s.span], times, [times[0] + s.span]])
    return bool(times[i + 1] - times[i] > SHORT and times[i + 2] - times[i + 1] > SHORT)
