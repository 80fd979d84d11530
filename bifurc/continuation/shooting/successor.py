"""What goes on behind the end of validity of an event sequence: the sequence that simulation finds on the far side.

The old equations are followed a little beyond their end, where their solution is no motion any more.  One period is
simulated from a state of it far from what changes; the rule of `flow.settle` decides every event, so that several that
begin, end, merge or change places together need no case of their own.  The equations of the sequence so read are solved,
their solution is taken back to where the new sequence begins, and is accepted only if it is the same motion there and if
simulation repeats it a little further on.

One file, because beyond, back and verified are steps of one search with one record of what failed.
"""
import dataclasses
import functools
import math
import operator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ...flow.scan import CHATTER, GRAZE, PASSED
from ...flow.settle import Inconsistent, Penetration
from ...flow.simulate import simulate
from ...orbits.least import half_of, mark_trains
from ...orbits.orbit import HELD
from ...orbits.repetition import middles, repetition
from ...orbits.shooting.instants import in_order
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, GUARD, RESTS, TOGETHER
from ...orbits.shooting.signature import divided, repeated, sections, translated
from ...solve.bordered import Factors, least_solution
from ...solve.steplaw import BOUNDARY_BAND, MANY
from ..resimulation import counted
from . import autonomous
from .directions import directions
from .last_member import last_member
from .vanishing import dropped, listed_speeds

BEYOND = (1e-6, 1e-5, 1e-7, 1e-4, 1e-8, 1e-3)  # scaled lengths by which the old equations are followed beyond their end
INSIDE = (1e-5, 1e-4, 1e-3, 1e-6, 1e-7, 1e-2)  # scaled lengths at which the new equations are tried
JUMPS, JUMP = (1e-6, 1e-10), 1e-6  # scaled lengths beyond an end, and a scaled miss that is none of them
VANISHED = (1e-7, 1e-6, 1e-5)  # scaled durations and speeds of events that may end together
BESIDE = (1e-7, 1e-6, 1e-5)  # scaled lengths from an end at which its index is looked up
STARTS = 2  # intervals from which a period is simulated
EPS = 2.2e-16
OF_FLOW = 100.0  # rounding of a flow to that of single products
STRETCH = 1e3  # times the way from the last row to an end: the farthest at which a motion before it is looked for
STILL = 1e-13  # speed of a held row that is none
LOOSER, FASTER = (10.0, 100.0, 1000.0), 2.0  # by how much other steps are longer, and how much faster a row moves that is not
ROUNDING = 1e-12  # value of a monitor that tells nothing
ZERO, FURTHER = 4.0 * EPS, 100.0  # of one that is zero but for rounding; how much farther away it is looked at again
NEWTON = 12  # steps onto the new equations
CONVERGED = 1e-11  # scaled residual
NEARBY, SECANTS = 1e-6, 60  # scaled length of a first secant; most of them
HALVINGS = 30  # of the length in which a short validity ends
ON_BOUNDARY = 1e-13  # scaled length to the beginning of the new sequence, in the last step
ASTRAY = 0.5  # of a length along a direction, by which a solution may lie beside it
ROUNDED = (1e-11, 1e-10, 1e-9, 1e-8)  # scaled lengths along a branch: where a test is zero is known no better, and one that is
# the square of the way less, as of several contacts that stop at once; beyond a completion other tests leap
VALID = 1e-9  # value of a monitor that is zero there
SETTLED = 1e-9  # the same, where rounding keeps the steps from becoming smaller
STAYS = 10.0  # times the last change of a value: a larger one has not changed
LISTED, HELD_ROWS = "listed", "held"  # names of the monitors of events and of rows that modes hold
ALIKE = 1e-3  # distance of two motions, as part of the way from the end, that makes them one
SAME, CREPT, UNKNOWN = 2e-6, 1e-5, 1e-3  # scaled distance of two motions that are one; most of one with another member of its
# family, and with the last one
NEARER, FALLS = 0.9, 1.1  # of the way to a limit, that is clearly nearer; factor within which a distance falls with the way
FURTHER_ON = 0.5  # of that way, by which another one is farther from it
PHASES, EXACT = 1000, 1e-12  # phases at which an orbit without a clock is looked for on another; scaled error of the one found
BEST = (False, 0.0)  # rank of equations that keep the index and begin where the old ones end
BESIDE_END = 0.9  # of `SAME`: how near to an end of the old equations new ones that are singular there are followed
SLOW = 1e-3  # scaled speed or duration of an event that may be about to begin
CLOSE = 1e-9  # scaled length from an end that lies on the beginning but for rounding
NEXT = 1e-9  # scaled difference of the parameter beyond which something else may lie between an end and a beginning


@dataclass
class Search:
    """Successors tried at one end: what each of them failed at, in words, each once; whether motions beyond complete
    fewer chatterings; equations of motions that complete more, which begin a little further on where a chattering just completes;
    whether a contact beyond slips in one direction only."""

    reasons: dict[str, None] = field(default_factory=dict)
    incomplete: bool = False
    completing: Any = None
    creeps: bool = False

    def say(self, reason: str) -> None:
        """Note why a candidate was not taken."""
        self.reasons[reason] = None

    @property
    def message(self) -> str:
        """The reasons as one sentence."""
        return "; ".join(self.reasons) or "simulation keeps the sequence of events"


def successor(problem, point, through=False):
    """Return ((problem, x, tangent) of the equations that go on behind a boundary, or None; and the `Search`).

    Of several that do as motions the branch goes on with one that keeps the index of the period map (`balanced`) and begins where
    the old equations end; the others are branches that meet it there, or begin beyond another change that is near.

    Parameters
    ----------
    problem : OrbitProblem
        Whose equations end.
    point : Corrected
        On the boundary, with the tangent in the direction of travel.
    through : bool
        The boundary is one of the equations and not of the motion: the parameter goes on as before.
    """
    search = Search()
    tried, spare = [cycle(problem)], []
    for step in BEYOND:
        for x in _beyond(problem, point, step):
            for signature, unknowns in _read(problem, x, search):
                search.incomplete |= complete_chatters(signature) < complete_chatters(problem.sequence)
                if _cycle(problem.scene, signature) in tried:
                    continue
                found = _begun(problem, point, signature, np.append(unknowns, x[-1]), search, through)
                if found is None:
                    continue
                rank = preference(problem, point, *found, through)
                if rank == BEST and signature.closure <= problem.sequence.closure:  # half a period may begin from another step
                    return found, search
                tried.append(_cycle(problem.scene, signature))
                if signature.closure < 0:  # listed over the whole period these are the same motions, wherever rounding begins them
                    tried.append(over_whole(tried[-1]))
                    spare = [other for other in spare if cycle(other[1][0]) != tried[-1]]
                spare.append((rank, found))
    for near in () if problem.sequence.clock else VANISHED:  # several end at once: a simulation may take one of them alone
        made = dropped(problem, point.x, near)
        if made is not None and _cycle(problem.scene, made[0]) not in tried:
            tried.append(_cycle(problem.scene, made[0]))
            found = _begun(problem, point, *made, search, through)
            if found is not None:
                rank = preference(problem, point, *found, through)
                if rank == BEST:
                    return found, search
                spare.append((rank, found))
    return min(spare, key=operator.itemgetter(0))[1] if spare else None, search


def preference(problem, point, new, x, tangent, through) -> tuple[bool, float]:
    """Return what ranks equations that go on, least first: whether they change the index, and how far from the old end they begin
    (parameter, scaled; 0 where that is rounding).  Where only the equations change (``through``) all are alike."""
    if through:
        return BEST
    away = float(abs(x[-1] - point.x[-1])) / new.parameter_scale
    return not balanced(problem, point, new, x, tangent), away // NEXT * NEXT  # alike but for rounding: the first that was found


def _beyond(problem, point, step):
    """Yield solutions (n + 1,) of the old equations a little beyond their end, then their last one at other parameters: it
    may be a fold of them."""
    low, high = problem.path.low, problem.path.high
    c = problem.correct(point.x + step * problem.scale * point.tangent, point.tangent)
    if c.converged and low <= c.p <= high:
        yield c.x
    ahead = 1.0 if point.tangent[-1] >= 0.0 else -1.0
    for sign in (ahead, -ahead):
        x = point.x.copy()
        x[-1] += sign * step * problem.scale[-1]
        if low <= x[-1] <= high:
            yield x


def balanced(problem, point, new, x, tangent) -> bool:
    """Whether the index of the period map, the sign of det(1 - M), changes through the end ``point`` of ``problem`` only if the
    parameter turns back there; also where it cannot be told.

    The period map is continuous, so that of one branch the number of solutions at a parameter, counted with their index, is
    the same on both sides (di Bernardo et al. 2008, section 3.1, after Feigin).
    """
    half = problem.half_multipliers(point.x) is not None and new.half_multipliers(x) is not None
    before = index(problem, point.x, point.tangent, -1.0, half)
    return before == 0.0 or before * index(new, x, tangent, 1.0, half) >= 0.0


def index(problem, x, tangent, toward, half=False) -> float:
    """Return the sign of det(1 - M) dp/ds beside ``x`` (n + 1,), 0 where it cannot be told; ``tangent`` in the direction of travel,
    ``toward`` 1 ahead and -1 back; M is that of half a period followed by the mirror where ``half`` says so."""
    for step in BESIDE:
        c = problem.correct(x + toward * step * problem.scale * tangent, tangent)
        if not (c.converged and inside(problem, c)):
            continue
        numbers = counted(problem.half_multipliers(c.x) if half else problem.floquet_multipliers(c.x))
        if numbers is not None and abs(c.tangent[-1]) > BOUNDARY_BAND:
            return math.copysign(1.0, c.tangent[-1]) * (-1.0)**numbers[0]
    return 0.0


def jumps(problem, point) -> bool:
    """Whether motions beyond the end differ from it by an amount that does not fall with the distance from it."""
    missed = [[repetition(problem.motion(x)).miss for x in _beyond(problem, point, step)] for step in JUMPS]
    return any(np.isfinite(least) and least > max(JUMP, 0.3 * most) and np.isfinite(most)
               for most, least in zip(missed[0], missed[-1], strict=False))


def verified(problem, point, new, x, tangent) -> bool:
    """Whether the orbits of the equations ``new`` a little inside from ``x`` (n + 1,) along ``tangent`` are admissible, other
    than those through which the end ``point`` of ``problem`` was reached, and repeated by simulation."""
    answer = False
    for step in () if rebounds(new) else INSIDE:
        c = along(new, x, tangent, step)
        if c is not None and inside_ahead(new, x, tangent, step, c):
            orbit = new.motion(c.x)
            if orbit.success and repetition(orbit).repeated:
                back = retraces(problem, point, new, c)
                answer = not back and determined(new, c) and not loosens(new, x, tangent, step, c)
                if back is not None or not answer:
                    break
    return answer


def loosens(problem, x, tangent, step, c) -> bool:
    """Whether a row is held by tolerance alone at ``c``, a ``step`` along ``tangent`` from ``x`` (n + 1,): it moves the more the
    farther the step, with some power of it.

    What a jump or the equations hold is held wherever they are solved.  A slip of no duration yet that an impact cuts short is not
    stick behind it.
    """
    held = next((k for k, monitor in enumerate(problem.monitors) if monitor.name == HELD_ROWS), None)
    if held is None:
        return False
    most = FASTER * max(c.monitors[held] + 0.5 * HELD, STILL)
    made = (problem.correct(x + longer * step * problem.scale * tangent, tangent) for longer in LOOSER)
    return any(further.converged and further.monitors[held] + 0.5 * HELD > most for further in made)


def determined(problem, c) -> bool:
    """Whether rounding tells every interval of a corrected point ``c`` that an event other than an impact opens or closes from
    none: at its place along the branch, which rounding moves no farther where the parameter turns.

    A contact that slips once a period and in one direction only slips by nothing: its slip is a root of third order in its
    duration, solved to rounding by any that is short enough, and the motion is one with stick all the time.  An event that nothing
    leads to may happen at any time.
    """
    if problem.sequence.creeping(problem.scene) or problem.sequence.unmoved(problem.scene):
        return False
    size, nodes = 1 + problem.scene.ns, problem.sequence.nodes
    kick = np.array([guard >= 0 and bool(problem.scene.tables.kick[mode, guard]) for mode, guard in nodes[:, :AFTER]])
    if len(nodes) == 1 or kick.all():
        return True
    x, n = c.x, c.x.size - 1
    J = np.column_stack(problem.jacobian(x[:-1], x[-1]))
    noise = EPS * (np.abs(J[:, :n]) @ np.abs(x[:-1]))
    try:
        times = np.eye(n + 1)[:, :n:size]
        moves = Factors(np.vstack([J, c.tangent / problem.scale])).solve(times, True)[:n].T.copy()  # of events, by residual;
    except np.linalg.LinAlgError:  # without a clock that of the period comes first
        return False
    s, U = problem.sequence.written_out(x[:-1])
    times = U[::size]
    spans = times - np.append(times[-1] - s.span, times[:-1])
    period = 0.0 if s.clock else moves[0].copy()
    moves[0] -= period
    apart = moves - np.roll(moves, 1, axis=0)  # what moves both ends of an interval alike does not change it
    apart[0] += period
    clear = (spans > OF_FLOW * np.abs(apart) @ noise) | (nodes[:, DIVIDE] == TOGETHER) | kick & np.roll(kick, 1)
    return bool(clear.all())


def retraces(problem, point, new, c) -> bool | None:
    """Whether ``c``, a point of the equations ``new`` near ``point``, is the motion that the old equations have before it; None
    where dp/ds of the branch is rounding and no such motion is found.

    Events that change places at one instant can be listed in either order: what is listed differently is no other motion.  Nor
    is one that is its own mirror image, listed over the whole period.
    """
    if problem.sequence.closure < 0 and over_whole(cycle(problem)) == cycle(new) and new.half_multipliers(c.x) is not None:
        return True
    if more_impacts(problem, new):
        return False
    came = -problem.scale * point.tangent if point.before is None else point.before - point.x
    if (c.p - point.x[-1]) * came[-1] < 0.0:
        return False  # its motions at that parameter lie ahead
    old = _before(problem, point, came, c.p)
    if old is None:
        return None if abs(point.tangent[-1]) <= BOUNDARY_BAND else False
    here, there = problem.motion(old.x), new.motion(c.x)
    return distance(here, there) <= ALIKE * max(distance(here, problem.motion(point.x)), SAME)


def _before(problem, point, came, p):
    """Return the solution of the old equations at a parameter on the way ``came`` (n + 1,) to their end ``point``; None where
    Newton does not find it.

    The parameter falls with the way or, where an event is born or several end at once, with its square.
    """
    away = p - float(point.x[-1])
    bend = math.sqrt(abs(away / (problem.scale[-1] if point.before is None else came[-1] or math.inf)))
    lengths = [min(away / came[-1], STRETCH), bend] if came[-1] else [bend]
    way = -came / problem.scale
    for length in lengths[::-1] if abs(point.tangent[-1]) <= BOUNDARY_BAND else lengths:
        x = point.x + length * came
        x[-1] = p
        found = problem.correct(x, way / np.linalg.norm(way), True)
        if found.converged and float((found.x - point.x) / problem.scale @ way) < 0.0:
            return found
    return None


def more_impacts(one, other) -> bool:
    """Whether one of two sequences has more impacts a period than the other, so that their motions cannot be the same.

    The listed impacts of a complete chattering may be any number of its first ones.
    """
    sequences = one.sequence, other.sequence
    if any(complete_chatters(s) > 0 for s in sequences):
        return False
    return round(kicks(one.scene, one.sequence), 9) != round(kicks(other.scene, other.sequence), 9)


def rebounds(problem) -> bool:
    """Whether an impact with rebound is listed as one after which the row is held: only a complete chattering ends so."""
    T = problem.scene.tables
    for before, guard, after, _, closes in problem.sequence.nodes[:, :ENDING].tolist():
        if guard >= 0 and T.kick[before, guard] and closes != 1 and T.ratio[before, guard] > 0.0:
            speed = T.GT[before, guard, :, 1]
            for row in T.H[after, :int(T.n_holds[after])]:
                size = math.sqrt(float(row @ row) * float(speed @ speed))
                if abs(abs(float(row @ speed)) - size) <= 1e-12 * size:
                    return True
    return False


def inside(problem, c) -> bool:
    """Whether a corrected point lies where the equations of the problem are valid, its parameter where elements allow it."""
    return allowed(problem, c.p) and all(c.monitors[k] < 0.0 for k in boundaries(problem))


def inside_ahead(problem, x, tangent, step, c) -> bool:
    """Whether a corrected point ``c``, a ``step`` along ``tangent`` from ``x`` (n + 1,), lies `inside`, also where a guard is zero
    by itself, of either sign of its rounding: it is so farther away as well."""
    doubtful = [k for k in boundaries(problem) if not c.monitors[k] < 0.0]
    if not doubtful or not allowed(problem, c.p):
        return not doubtful and allowed(problem, c.p)
    if any(problem.monitors[k].name == LISTED or c.monitors[k] > ZERO for k in doubtful):
        return False  # an event that has no speed by itself is none
    further = problem.correct(x + FURTHER * step * problem.scale * tangent, tangent)
    return further.converged and bool((np.abs(further.monitors[doubtful]) <= ZERO).all())


def allowed(problem, p: float) -> bool:
    """Whether a value of the parameter lies on the path of a problem: beyond, its elements may refuse it."""
    return bool(problem.path.low <= p <= problem.path.high)


def boundaries(problem) -> list[int]:
    """Return the numbers of the monitors that bound the validity."""
    return [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]


def complete_chatters(signature) -> float:
    """Return the number of complete chatterings (Zeno: infinitely many impacts) a forcing period."""
    return round(np.count_nonzero(signature.nodes[:, CLOSES] == 1) / (signature.span or 1.0), 9)


def kicks(scene, signature) -> float:
    """Return the number of impacts a forcing period."""
    events = signature.nodes[signature.nodes[:, GUARD] >= 0][:, :AFTER].T
    return float(np.count_nonzero(scene.tables.kick[tuple(events)])) / (signature.span or 1.0)


def cycle(problem):
    """Return what tells the cyclic event sequences of two problems apart: which event is listed first is chance, and of those that
    always happen at one instant which one comes before the other."""
    return _cycle(problem.scene, problem.sequence)


def over_whole(half):
    """Return the `cycle` of a sequence of half a period that is listed over the whole one."""
    rows, span, _ = half
    return rows, 2.0 * span, 1


def rolled(rows: list, begin: int) -> list:
    """Return a cycle of rows from one of them on."""
    return rows[begin:] + rows[:begin]


def _cycle(scene, signature):
    nodes = signature.nodes
    if signature.closure < 0:
        nodes = repeated(scene, signature, np.zeros(len(nodes) * (1 + scene.ns)))[0].nodes
    begin = next((k for k, node in enumerate(nodes) if node[DIVIDE] != TOGETHER), 0)
    rows: list[tuple] = []
    for before, guard, after, order, closes in rolled(nodes[:, :ENDING].tolist(), begin):
        event = (scene.guard(before, guard).element if guard >= 0 else -1, guard, int(closes == 1))
        if order == TOGETHER and rows:
            first, events, _ = rows.pop()
            rows.append((first, tuple(sorted((*((element,) for element, *_ in events), event[:1]))), after))
        else:
            rows.append((before, (event,), after))
    return min(rolled(rows, k) for k in range(len(rows))), signature.span, signature.closure


def _read(problem, x, search):
    """Yield signatures and unknowns of the motions that simulation makes of the solution ``x`` (n + 1,) of the old equations."""
    orbit = problem.motion(x)
    at, spans = middles(orbit)
    states = orbit._states(at)
    seen = []
    for k in np.argsort(-spans, kind="stable")[:STARTS]:
        begin = at[k] % 1.0
        try:
            span = {"t0": begin * orbit.forcing_period,
                    **({"duration": orbit.period} if orbit.autonomous else {"periods": orbit.periods})}
            motion = simulate(orbit.system, states[k], **span)
            if orbit.scene.disordered(states[k][None]):  # a slider held beyond its limit: a period later it has slipped
                motion = simulate(orbit.system, motion.final, **span)
        except (Penetration, Inconsistent, ValueError) as error:
            search.say(f"simulation does not start beyond: {error}")
            continue
        if not motion.success:
            search.say(f"simulation beyond ends: {motion.message}")
            continue
        made = sequence_of(orbit, motion, np.floor(at[k]))
        if made is None:
            search.say("the motion beyond does not come back to its mode in a period")
            continue
        signature, unknowns = made
        candidates = [made]
        if orbit.closure < 0:
            half = half_of(orbit.scene, signature, unknowns)
            if half is not None:
                candidates.insert(0, (half[0], half[1].ravel()))
        for signature, unknowns in candidates:
            signature = translated(signature, orbit.scene, problem.scene)
            if orbit.autonomous:
                at = np.append(unknowns, x[-1])
                signature, at = autonomous.released(problem.with_sequence(signature, at), signature, at)
                unknowns = at[:-1]
            key = _cycle(problem.scene, signature)
            if key not in seen:
                seen.append(key)
                yield signature, unknowns


def sequence_of(orbit, motion, first):
    """Return (signature, unknowns) of one simulated period of the system of an orbit; None if it does not close in its mode.

    ``first`` is the forcing period of the orbit in which the motion, which counts from zero, began: of an orbit of several, the
    same a forcing period later is another solution of the equations.
    """
    scene, R, period, whole = orbit.scene, motion.recorded, orbit.forcing_period, orbit._whole[0]
    listed = [i for i in range(1, len(R.rows)) if R.rows[i, 3] not in (PASSED, GRAZE)]
    if not listed:
        mode = int(R.rows[0, AFTER])
        if orbit.autonomous:
            return dataclasses.replace(sections(mode, whole.span), clock=whole.clock), np.append(0.0, motion(motion.start))
        return sections(mode, 1.0), np.append(0.0, motion(np.ceil(motion.t[0] / period - 1e-12) * period))
    nodes = np.array([[*R.rows[i, :3], 0, int(R.rows[i, 3] == CHATTER)] for i in listed], np.int64)
    if nodes[-1, AFTER] != nodes[0, BEFORE] or np.any(nodes[1:, BEFORE] != nodes[:-1, AFTER]):
        return None
    times = R.rows[listed, 4] + R.times[listed] / period
    turn = int(np.argmax(np.diff(np.append(times, times[0] + whole.span))))  # begin behind the longest interval
    order = [*range(turn + 1, len(listed)), *range(turn + 1)]
    times[:turn + 1] += whole.span
    times = times[order] + first
    times -= np.floor(times[0] / whole.span) * whole.span
    nodes = divided(scene, nodes[order])
    mark_trains(nodes, R.speeds[listed][order])
    return in_order(scene, nodes, np.column_stack([times, remembered(R, listed, scene.n)[order]]), float(whole.span), whole.clock)


def remembered(R, listed, n):
    """Return the states (k, ns) before the ``listed`` events (indices, k) of a recorded period, with the memory of a motion that
    came from the period before: what is written in a period begins with the value that it ends with.

    A simulation begins with what memory shows at its start, as of a slider in the middle of a slip, and keeps that until it sticks.
    """
    before = R.before[listed].copy()
    for place in range(2 * n, before.shape[1]):
        last = R.after[listed[-1], place]
        written = np.flatnonzero(np.append(before[:, place], last) != before[0, place])
        if written.size:
            before[:written[0], place] = last
    return before


def _begun(problem, point, signature, x, search, through):
    """Return (problem, x, tangent) where the new sequence begins, at the old end, if it goes on from there as a motion."""
    name = signature.text(problem.scene)
    new = problem.with_sequence(signature, x)
    if signature.creeping(problem.scene):
        search.creeps = True
        search.say(f"in {name!r} a contact slips in one direction only, which is no periodic motion")
        return None
    if rebounds(new):
        search.say(f"in {name!r} an impact with rebound ends in rest, as only a complete chattering does")
        return None
    x = onto(new, x)
    if x is None:
        search.say(f"no orbit {name!r} near")
        return None
    if not allowed(problem, x[-1]):
        search.say(f"the orbit {name!r} lies beyond the values that {problem.parameter} may have")
        return None
    begin = at_beginning(new, x, float(point.x[-1]), through)
    if begin is None:
        search.say(f"the orbit {name!r} does not begin here")
    else:
        if complete_chatters(signature) > complete_chatters(problem.sequence) and just_completes(new, begin):
            search.completing = new
        member = last_member(problem, new, begin) if new.free > problem.free and not through else None
        found = None if member is None else _from(problem, point, signature, member.x, False, placed=member.error)
        if found is not None:
            return found
        found = _from(problem, point, signature, begin, through, farther=x)
        if found is not None and leads_back(point, *found):
            found = _nearer(problem, point, new, signature, found)
        if found is not None:
            return found
        search.say(f"the orbit {name!r} is no motion on either side")
    # at their very beginning the equations may be singular (a swing of no amplitude lasts any time): next to it they are not
    return None if through else _from(problem, point, signature, _approached(problem, point, new, x), False, True)


def _approached(problem, point, new, x):
    """Return the solution ``x`` (n + 1,) of equations that slip where those of ``problem`` stick all the time, followed to where
    it may be next to the old end ``point``; or as near as Newton's method leads, and any other one as it is.

    Slips that are born at once last for a root of the way: those that rounding leaves nothing of are no start, and what simulation
    finds farther on is a way off."""
    if new.free >= problem.free:
        return x
    end, most = float(point.x[-1]), SAME * problem.parameter_scale
    tangent = np.eye(1, x.size, x.size - 1)[0]
    while abs(x[-1] - end) > most:
        guess, away = x.copy(), float(x[-1] - end)
        guess[-1] = end + math.copysign(max(0.5 * abs(away), BESIDE_END * most), away)
        c = new.correct(guess, tangent, True)
        if not (c.converged and inside(new, c)):
            break
        x = c.x
    return x


def just_completes(problem, x) -> bool:
    """Whether a sequence begins to be valid at ``x`` (n + 1,) where a complete chattering ends at the instant of what follows."""
    info = problem._monitored(x[:-1], float(x[-1]))
    return bool(abs(info[RESTS]) <= VALID)


def _from(problem, point, signature, x, through, beside=False, farther=None, placed=None):
    """Return (problem, x, tangent) of a sequence whose orbit ``x`` (n + 1,) is at the old end, or ``beside`` it in its validity,
    where the orbits that follow are motions; or None.  Where no direction is known at ``x``, as where two slips are born of which
    one lasts far longer than the other, it is that to the solution ``farther`` (n + 1,) on.  ``placed`` is the error of the
    parameter of the `last_member` of a family."""
    new = problem.with_sequence(signature, x)
    new.placed = placed
    met = begins(problem, point, new, x, beside) if placed is None else is_limit(problem, point, new, x)
    if not (met and allowed(new, x[-1])):
        return None
    lines = directions(new, x)
    if not lines and farther is not None and new.free < problem.free:
        chord = (farther - x) / new.scale
        lines = [chord / length] if (length := float(np.linalg.norm(chord))) > CLOSE else []
    if not lines:
        return None
    doubtful = None  # what goes on, or back on the way on which the branch came
    here = new.correct(x, lines[0]) if beside else None
    if here is not None and not (here.converged and inside(new, here)):
        return None
    for step in INSIDE:
        good = []
        for way in (sign * line for line in lines for sign in (1.0, -1.0)):
            c = along(new, x, way, step)
            if c is not None and inside_ahead(new, x, way, step, c):
                good.append((way, c))
        if through or len(lines) == 1 and len(good) == 2:  # a change of the equations only: the branch goes on as it came
            if here is None:
                inward = [] if through else [(way, c) for way, c in good if not nears_beginning(point, new, x, way, c)]
                good = inward if len(inward) == 1 else [(way, c) for way, c in good if way[-1] * point.tangent[-1] > 0.0]
            else:
                good.sort(key=lambda item: (min(nearest(new, item[1]), -ROUNDING), leads_back(point, new, x, item[0])))
        elif len(lines) > 1:  # rounding may have put the beginning a little inside: away from it, not back through it
            good.sort(key=lambda item: nearest(new, item[1]))
        if beside:
            good = [(way, c) for way, c in good if not comes_back(problem, point, new, x, way, c)]
        for way, c in good[:1] if beside else good:
            orbit = new.motion(c.x)
            if not (orbit.success and repetition(orbit).repeated and determined(new, c)):
                continue
            back = retraces(problem, point, new, c)
            if back is None and doubtful is None and not loosens(new, x, way, step, c):
                doubtful = new, x, way
            elif back is False:
                return None if loosens(new, x, way, step, c) else (new, x, way)
    return doubtful


def begins(problem, point, new, x, beside) -> bool:
    """Whether the solution ``x`` (n + 1,) of the ``new`` equations is the motion at the old end ``point``, scaled to `SAME`.  What
    slips in the old equations and sticks all the time in the new ones may stand at any place of an interval, and does so where it
    stood at the old end: that is known to the rounding of the old equations there, where they are singular.  Slips that are born
    at once from the `last_member` of the old ones stand out from rounding only farther on: ``beside`` it they lead to it."""
    near = max(SAME, min(problem.blur(point), CREPT)) if new.free > problem.free else SAME
    away = abs(x[-1] - point.x[-1]) / problem.parameter_scale
    if away <= SAME and distance(problem.motion(point.x), new.motion(x)) <= near:
        return True
    member = last_member(new, problem, point.x) if beside and new.free < problem.free else None
    if member is None or abs(member.x[-1] - point.x[-1]) > SAME * problem.parameter_scale:
        return False
    c = at_parameter(new, x, float(x[-1] + FURTHER_ON * (x[-1] - point.x[-1])))
    return c is not None and leads_to(problem.motion(point.x), float(point.x[-1]), new, x, c.x)


def is_limit(problem, point, new, x) -> bool:
    """Whether the old motions, of which steps end at ``point``, lead to the last member ``x`` (n + 1,) of a family: its place is
    its own (`last_member`), the end is where rounding stops steps, and as near as that tells."""
    member, away = new.motion(x), abs(x[-1] - point.x[-1]) / problem.parameter_scale
    return bool(max(away, distance(problem.motion(point.x), member)) <= max(SAME, min(problem.blur(point), UNKNOWN))) or (
        point.before is not None and leads_to(member, float(x[-1]), problem, point.x, point.before))


def leads_to(limit, p, problem, x, before) -> bool:
    """Whether solutions of a problem, ``x`` (n + 1,) and one ``before`` it, lead to a motion at the parameter ``p``: their distance
    from it falls as the parameter comes nearer."""
    away, earlier = (abs(at[-1] - p) / problem.parameter_scale for at in (x, before))
    apart = distance(limit, problem.motion(x))
    return bool(max(away, apart) <= UNKNOWN and away <= NEARER * earlier
                and apart * earlier <= FALLS * away * distance(limit, problem.motion(before)))


def along(problem, x, tangent, step):
    """Return the corrected point a length from ``x`` (n + 1,) along ``tangent``, `on_path` of ``step``; None where there is none.

    Where the equations lose another rank all that is near solves them to rounding, and Newton may end anywhere: where it wanders,
    or goes so far, it has not ended on the way.
    """
    length = on_path(problem, x, tangent, step)
    c = problem.correct(x + length * problem.scale * tangent, tangent)
    return c if c.converged and c.iterations <= MANY and c.distance <= ASTRAY * length else None


def on_path(problem, x, tangent, step) -> float:
    """Return a length along ``tangent`` from ``x`` (n + 1,), ``step`` or where that leads beyond the path half the way to its end:
    the last change before it may be as near to it as any."""
    rate = float(problem.scale[-1] * tangent[-1])
    if rate == 0.0 or allowed(problem, x[-1] + step * rate):
        return step
    return 0.5 * ((problem.path.high if rate > 0.0 else problem.path.low) - float(x[-1])) / rate


def nears_beginning(point, new, x, tangent, c) -> bool:
    """Whether a sequence begins to be valid a little ahead of ``c``, a point along ``tangent`` from ``x`` (n + 1,), where the
    parameter is that of the old end ``point``: its equations are singular there, and it was found a little inside."""
    here = new.correct(x, tangent, True)
    if not here.converged:
        return False
    f0, f1 = nearest(new, here), nearest(new, c)
    moved = (c.x - x) / new.scale
    ahead = f0 / (f0 - f1) if f1 > f0 else math.inf
    return ahead * float(np.linalg.norm(moved)) <= max(INSIDE) and abs(
        x[-1] + ahead * (c.x[-1] - x[-1]) - point.x[-1]) <= SAME * new.parameter_scale


def leads_back(point, new, x, tangent) -> bool:
    """Whether a sequence, followed along ``tangent`` from ``x`` (n + 1,), comes to the parameter of the old end ``point``: then
    it is valid in a short interval, of which ``x`` is the other end."""
    away = float(point.x[-1] - x[-1])
    return abs(away) > NEXT * new.parameter_scale and away * tangent[-1] > 0.0


def comes_back(problem, point, new, x, tangent, c) -> bool:
    """Whether a sequence, followed along ``tangent`` from ``x`` (n + 1,) beside the old end ``point`` to ``c``, comes nearer to the
    motion there, as it does to the parameter: that is the way to its beginning, behind which the branch would retrace itself."""
    if not leads_back(point, new, x, tangent):
        return False
    end = problem.motion(point.x)
    return distance(end, new.motion(c.x)) < distance(end, new.motion(x))


def _nearer(problem, point, new, signature, found):
    """Return what `_from` makes of the sequence of ``new`` from the other end of a short validity, where that is nearer to the
    parameter of the old end; ``found`` where it is not.

    It is looked for along the branch and not at that parameter: where an event is born dp/ds = 0, and what rounding leaves of the
    old end may lie beyond.
    """
    x, way = found[1:]
    made = {step: new.correct(x + step * new.scale * way, way) for step in sorted(INSIDE)}
    valid = [c.converged and inside(new, c) for c in made.values()]
    last = valid.index(False) if False in valid else 0
    if last == 0 or not list(made.values())[last].converged:
        return found
    low, high = list(made)[last - 1:last + 1]
    for _ in range(HALVINGS):
        c = new.correct(x + 0.5 * (low + high) * new.scale * way, way)
        if not c.converged:
            return found
        low, high = (0.5 * (low + high), high) if inside(new, c) else (low, 0.5 * (low + high))
    begin = _first_valid(new, c.x, float(point.x[-1]), CLOSE)
    if begin is None:
        return found
    away, further = (abs(at[-1] - point.x[-1]) for at in (begin, x))
    return _from(problem, point, signature, begin, False) or found if away < further - NEXT * new.parameter_scale else found


def nearest(problem, c) -> float:
    """Return the value of the monitor that is nearest to the end of validity of a problem, at a corrected point."""
    return float(max(c.monitors[k] for k in boundaries(problem) if problem.monitors[k].name != HELD_ROWS))


def onto(problem, x):
    """Return the solution nearest to ``x`` (n + 1,) on the branch of a problem, parameter free; None where Newton fails."""
    x = x.copy()
    old = np.inf
    for _ in range(NEWTON):
        f = problem.residual(x[:-1], x[-1])
        if not np.isfinite(f).all():
            return None
        fu, fp = problem.jacobian(x[:-1], x[-1])
        if not (np.isfinite(fu).all() and np.isfinite(fp).all()):
            return None
        step = least_solution(np.column_stack([fu, fp]) * problem.scale, -f)
        size = float(np.abs(step).max())
        if size > 1.0:
            return None
        x += problem.scale * step
        if size < CONVERGED or (old < 1e-7 and size >= old):
            return x
        old = size
    return None


def at_beginning(problem, x, p: float, through=False):
    """Return the point of a branch near ``x`` (n + 1,) at which its sequence begins to be valid; where it is valid on both
    sides (as it is ``through`` a change of the equations only), or a test that is nearly flat hides the one that is zero there,
    that at the parameter ``p``; or None."""
    at = None if through else _first_valid(problem, x, p)
    if at is not None:
        return at
    c = at_parameter(problem, x, p)
    valid = c is not None and allowed(problem, c.p) and all(c.monitors[k] <= VALID for k in boundaries(problem))
    return c.x if valid and (not through or inside(problem, c)) else None


def at_parameter(problem, x, p: float):
    """Return the corrected point at the parameter ``p`` on the branch through ``x`` (n + 1,); None where Newton finds none, or the
    branch hardly leads there."""
    tangent = problem.null_tangent(x)
    if abs(tangent[-1]) < 1e-6:
        return None
    guess = x + problem.scale * tangent * ((p - x[-1]) / (problem.scale[-1] * tangent[-1]))
    guess[-1] = p
    c = problem.correct(guess, tangent, True)
    return c if c.converged else None


def _first_valid(problem, x, p, step=None):
    """Return the point near ``x`` (n + 1,) at which the sequence of a problem begins to be valid, or None; the scaled length
    ``step`` is the first that is tried.  A sequence may be valid in a short interval only: of its two ends that at the parameter
    ``p`` where the old equations end, or else the nearest.

    The largest of the monitors has corners, beyond which one that is nearly flat may hide one that is zero nearby: the zeros of
    each are looked for as well; and that of the listed events is itself the largest of many, so those of every slow impact and
    short interval.  A guard that is zero by itself, as long as nothing moves what it watches, has a zero everywhere and begins
    nothing.
    """
    keys = [k for k in boundaries(problem) if problem.monitors[k].name != HELD_ROWS]  # of rounding size where they are held
    tangent = problem.null_tangent(x)
    made: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def values(s):
        if s not in made:
            c = problem.correct(x + s * problem.scale * tangent, tangent)
            if not c.converged:
                return None
            made[s] = c.x, c.monitors[keys]
        return made[s][1]

    @functools.cache
    def speeds(s):
        return listed_speeds(problem, made[s][0])

    def event(s, i):
        value = None if values(s) is None else speeds(s)[i]
        return value if value is not None and math.isfinite(value) else None

    pair = [values(0.0), values(step or NEARBY)]
    left = [k for k in range(len(keys)) if any(pick is not None and abs(pick[k]) > ZERO for pick in pair)]
    tests = [lambda s, pick=pick: None if values(s) is None else float(np.max(values(s)[pick]))
             for pick in (left, *([k] for k in left)) if pick]
    tests += [functools.partial(event, i=i) for i, value in enumerate(listed_speeds(problem, x))
              if value is not None and abs(value) <= SLOW]
    found = []
    for test in tests:
        at = _zero(test, step)
        sides = [] if at is None else [at, *(at + sign * aside for aside in ROUNDED for sign in (-1.0, 1.0))]
        at = next((side for side in sides if values(side) is not None and values(side).max() <= VALID), None)
        if at is not None:
            found.append(at)
            if abs(at) <= CLOSE:
                break
    if not found:
        return None
    return made[min(found, key=lambda at: (abs(made[at][0][-1] - p) > NEXT * problem.parameter_scale, abs(at)))][0]


def _zero(value, step):
    """Return the zero of a function of the length nearest to 0 by secants, None without one; ``step`` is the first length.

    Over a leap of the function secants end beside it, whatever the value there: one that stays is no zero but of rounding.
    """
    s0, f0 = 0.0, value(0.0)
    if f0 is None:
        return None
    s1 = step or (NEARBY if abs(f0) < 1e-3 else 1e-4)
    f1 = value(s1)
    step = s1
    for _ in range(SECANTS):
        if f1 is None or f1 == f0:
            break
        step = -f1 * (s1 - s0) / (f1 - f0)
        if abs(step) > 0.3:
            return None
        s0, f0, s1 = s1, f1, s1 + step
        f1 = value(s1)
        if abs(step) <= ON_BOUNDARY:
            break
    if f1 is None or abs(f1) > VALID or abs(step) > SETTLED:
        return None
    return s1 if abs(f1) <= max(ROUNDING, STAYS * abs(f1 - f0)) else None


def distance(one, other) -> float:
    """Largest scaled distance of two orbits in the middles of the longer intervals of both."""
    away, later = 0.0, ahead(one, other) if one.autonomous else 0.0
    for orbit, back in ((one, 0.0), (other, later)):
        at, spans = middles(orbit)
        at = at[spans > 1e-2] - back
        if not one.autonomous:
            at = np.mod(at, min(one.periods, other.periods))
        if at.size:
            away = max(away, float((np.abs(one._states(at) - other._states(at + later)) / one.weights).max()))
    return away


def ahead(one, other) -> float:
    """Return by how much two orbits without a clock differ in phase, units of time: at the middle of its longest interval the first
    is where the second is that much later."""
    at, spans = middles(one)
    moment = at[[np.argmax(spans)]]
    state = one._states(moment)[0]

    def apart(t):
        return float((((other._states(np.array([t]))[0] - state) / one.weights)**2).sum())

    span = other._whole[0].span
    times = np.linspace(0.0, span, PHASES, endpoint=False)
    nearest_phase = int(np.argmin((((other._states(times) - state) / one.weights)**2).sum(axis=1)))
    around = (times[nearest_phase] - span / PHASES, times[nearest_phase] + span / PHASES)
    return float(minimize_scalar(apart, bounds=around, method="bounded", options={"xatol": EXACT}).x - moment[0])
