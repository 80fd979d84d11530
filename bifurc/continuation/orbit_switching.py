"""Where the event signature of an orbit changes: the equations that go on behind it.

The equations of the new signature are regular there; their null vector is the tangent of the impacting orbit, and the
side on which it is admissible is found by a step to either side, never assumed: the orbit may live on the impacting or the
non-impacting side.
"""
import numpy as np

from ..elements import EventKind
from ..orbits import sequence
from ..orbits.find import finished, from_state, touching
from ..orbits.sequence import AFTER, ENDING, GUARD
from ..orbits.signature import translated
from .appearing import inserted, parted
from .kinds import SpecialPointKind
from .vanishing import dropped

TRIALS = (1e-5, 1e-4, 1e-3, 1e-6)  # scaled steps with which a side is tried
BEHIND = (1e-6, 1e-5, 1e-4, 1e-3)  # parts of the parameter's size behind a point at which motions are simulated
LISTED, UNLISTED, LEAVING, MERGES = "listed", "unlisted", "leaving", "merges"  # names of monitors
KINDS = {EventKind.STICK: SpecialPointKind.STICK_ONSET, EventKind.SLIP: SpecialPointKind.SLIP_ONSET,
         EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}
ENDS = {EventKind.STICK: SpecialPointKind.SLIP_ONSET, EventKind.SLIP: SpecialPointKind.STICK_ONSET,
        EventKind.SEPARATION: SpecialPointKind.SEPARATION, EventKind.CONTACT: SpecialPointKind.SEPARATION}


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
