"""Pseudo-arclength continuation of one half of a branch: predict, correct, judge the step, look at what it crossed.

Keller (1977) for the bordered corrector; step law of `solve.steplaw` with the iteration count as ceiling.  A step is accepted
only if it turns little, if its sideways distance fits the arc that its turn describes, and if the oriented bordered determinant
keeps its sign or a branch point is found in it.  Steps in which nothing of interest lies may be made by the problem itself, many
in one call (`Problem.follow`), by the same rules.

One file, because predicting, correcting, judging and cutting a step are one loop over one state.
"""
import copy
import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...lazy import Later
from ...solve import steplaw
from ...solve.steplaw import BOUNDARY_BAND, MANY, MAX_ANGLE, STRAIGHT, TURNS, WANDERS
from ...solve.steprun import ON_BOUND
from ..kinds import ERRORS, CallbackError, CorrectorStatus, StopReason
from ..problem import ROUNDED
from . import detect, hidden
from .callbacks import asked, recorded, stops
from .inside import known_to
from .rows import Curve, Part, Point, Row, tests_of

ASIDE = (1e-5, 1e-4, 1e-6)  # lengths behind a boundary at which the equations beyond may begin
FARTHEST = 1e-3  # the same where several events are born at once, of which Newton finds the lengths no nearer
CLEAR = 1e-5  # arclength from a boundary at which a row tells from where the branch came
STARTS = 20  # last rows from which a point on a bound, or what goes on, is looked for
AT_BOUND, REACH = 1e-7, 1e-4  # scaled distance of the parameter, and of all unknowns, from a bound that no step reaches
OVER = 1.1  # of the way to a boundary, the step behind a row before it: none ends on the boundary itself, where tests are not known
FURTHER, FEW = 4.0, 5  # times the test of a boundary at the last few rows before it, that of one at least twice as far away
FALLEN = 1e-6  # of the largest value of a test, one that falls to nothing
NUDGE = 0.83  # factor for a step that lands on a branch point
SLOPE = 1e-9  # dp/ds that clearly leads out of the bounds
NOTHING_BEYOND = (StopReason.CHATTERING, StopReason.AT_REST, StopReason.HOMOCLINIC)  # ends behind which no single sequence goes on
BLOCK = 32  # steps that a problem makes in one call at most
arc_length, judged, next_length = (rule.py_func for rule in (steplaw.arc_length, steplaw.judged, steplaw.next_length))


@dataclass(frozen=True, slots=True)
class StepOptions:
    """Lengths of steps in scaled unknowns, their number, and the bounds of the parameter in its own units."""

    low: float
    high: float
    ds: float
    ds_min: float
    ds_max: float
    max_steps: int
    stop: object = None
    record: object = None
    progress: object = None
    audit: str = "full"


class Half:
    """The branch from its first row in one direction; rows in the order of travel.

    Attributes
    ----------
    rows : list of Row
    found : list of detect.Found
        Special points, in the order of travel.
    reason : StopReason or None
    message : str
        Details of the reason.
    rejected : int
        Steps that were not accepted.
    """

    def __init__(self, row, options, signs=None, sizes=None, origin=None):
        part = row.part
        self.rows = [row]
        self.found = []
        self.parts = [part]
        self.options = options
        self.ds = row.ds
        self.reason = None
        self.message = ""
        self.rejected = 0
        self.steps = 0
        self.unresolved = []  # (kind, s, p) of pairs that cannot be told from none
        self.origin = origin  # row at which a closed branch ends
        self.slope = 0.0  # dp/ds just before the last boundary
        self.corner = -1  # number of steps at the last corner
        self.edge = None  # arclength to which the boundary is known on which the first row of the last part lies
        self.just_inside = None, {}, {}  # row ahead, rows and points just behind the first one: `inside.beginning`
        self.pending = None  # boundary point whose `reverses` the next clear dp/ds decides
        self.signs = [0] * part.count if signs is None else list(signs)
        self.sizes = [0.0] * part.count if sizes is None else list(sizes)
        if signs is None:
            detect.remember(self, row, (), fresh=part.born >= 0)
        row.signs = tuple(self.signs)
        if origin is None or origin is row:
            row.turn = 0.0

    def run(self):
        """Step until a reason to stop."""
        while self.reason is None:
            self.step()
        if self.reason is StopReason.INADMISSIBLE:
            self.come_inside()
        last, crept = self.rows[-1], self.reason is StopReason.DS_MIN
        self.reason, self.message = last.part.problem.named_end(last.x, self.reason, self.message)
        if crept and self.reason is StopReason.CHATTERING:
            last = self.come_inside()
        if self.reason is StopReason.SHRUNK:  # the equations lose all their ranks: a last step that turns is rounding
            while len(self.rows) > 2 and float(np.dot(self.rows[-1].tangent, self.rows[-2].tangent)) < math.cos(MAX_ANGLE):
                last = self.take_back()
        if self.reason is not StopReason.INTERRUPTED:
            detect.behind(self, last)

    def stop(self, reason, message=""):
        """End this half."""
        self.reason = reason
        self.message = message

    def step(self):
        """Make one accepted step, with everything that lies in it, or stop."""
        options = self.options
        self.ds = min(self.ds, options.ds_max)
        c = self.follow()
        row = self.rows[-1]
        if self.steps >= options.max_steps:
            return self.stop(StopReason.MAX_STEPS)
        if outward(row, options):
            return self.stop(StopReason.BOUND)
        nudges = 0
        cause = None
        while True:
            new, cause = self.attempt(row, self.ds, c)
            c = None
            if new is None and cause is None:  # landed on a branch point
                nudges += 1
                if nudges <= 4:
                    self.ds *= NUDGE
                    continue
                cause = (StopReason.SINGULAR, 0.5, "")
            if new is not None:
                try:
                    cause = self.accept(row, new)
                except row.part.problem.errors as error:
                    if self.rows[-1] is not row:  # no step that could be refused
                        raise
                    cause = raised(error)
                if cause is None:
                    return None
            self.rejected += 1
            self.ds *= cause[1]
            if self.meets(row):
                return None
            if self.ds < options.ds_min:
                return None if self.turned(row) or self.leap(row) or self.reach(row) else self.stop(cause[0], cause[2])

    def follow(self):
        """Take the steps that the problem makes in one call; return the correction of the first one that needs a look, or None."""
        options, rows = self.options, self.rows
        row = before = rows[-1]
        part, most = row.part, min(BLOCK, options.max_steps - self.steps)
        if len(rows) > 1 and rows[-2].part is part:
            before = rows[-2]
        elif self.edge is not None or outward(row, options) or not all(abs(row.tests[j]) > BOUNDARY_BAND for j in part.events):
            return None  # what the tests are just behind it is looked up, see `inside.beginning`
        if (most < 1 or not part.follows or row.singular or self.pending is not None or options.record is not None
                or options.stop is not None or options.progress is not None):
            return None
        origin = math.nan if self.origin is None else self.origin.p
        try:
            made, c = part.problem.follow(before, row, self.signs, self.sizes, self.ds, most, options, origin)
        except part.problem.errors:  # the single step says what
            return None
        if made:
            self.rows += made
            self.steps += len(made)
            self.ds = made[-1].ds
        return c

    def attempt(self, row, ds, c=None):
        """Return ``(new row, None)``, ``(None, (reason, factor, message))`` or ``(None, None)`` for a nudge.

        ``c`` is the correction of this step, where it was made before.
        """
        options = self.options
        part = row.part
        x = row.x + ds * row.direction
        p = x[-1]
        fixed = (p > options.high and row.p < options.high) or (p < options.low and row.p > options.low)
        if fixed:  # go straight to the bound: the problem may not exist behind it
            bound = options.high if p > options.high else options.low
            ds *= (bound - row.p) / (p - row.p)
            x = row.x + ds * row.direction
            x[-1] = bound
        try:
            if fixed:
                c = part.problem.correct(x, row.tangent, fixed)
            elif c is None:
                c = part.problem.correct(x, row.tangent)
        except part.problem.errors as error:
            return None, raised(error)
        new, cause = self.judge(row, c, ds, fixed)
        beside = new is not None and not fixed and options.low < new.p < options.high and outward(new, options)
        if beside or new is not None and not fixed and not options.low <= new.p <= options.high:
            if options.low < row.p < options.high:
                return self.onto_bound(row, new)
            return None, (StopReason.BOUND, 0.5, "the branch leaves through the bound on which it starts")
        return new, cause

    def judge(self, row, c, ds, fixed):
        """Turn a correction into a row if the step to it is credible; returns as `attempt`."""
        if not c.converged:
            reason = StopReason.NOT_FINITE if c.status == CorrectorStatus.NOT_FINITE else StopReason.DS_MIN
            return None, (reason, 0.4, f"the corrector ended with {c.status!s}")
        if c.iterations > MANY and ds > WANDERS * self.options.ds_min:
            return None, (StopReason.DS_MIN, 0.5, "Newton wanders in every step")
        if fixed:
            moved = (c.x - row.x) / row.part.scale
            along = float(np.dot(moved, row.tangent))
            sideways = math.sqrt(max(float(np.dot(moved, moved)) - along * along, 0.0))
            if along <= 0.0:
                return None, (StopReason.DS_MIN, 0.5, "the branch does not reach the bound here")
        else:
            along, sideways = ds, c.distance
        singular = c.status == CorrectorStatus.SINGULAR
        if (singular or hidden.nearly_singular(self.rows, row, c.det_log, ds)) and not row.singular and not fixed:
            return None, None
        verdict, angle, misfit = judged(float(np.dot(row.tangent, c.tangent)), along, sideways, singular)
        if verdict == TURNS:
            factor = max(0.3, 0.7 * MAX_ANGLE / angle) if angle < math.pi else 0.5
            return None, (StopReason.DS_MIN, factor, "the branch turns too much in every step")
        if verdict:
            return None, (StopReason.DS_MIN, 0.5, "the corrector leads away from the prediction in every step")
        length = arc_length(math.hypot(along, sideways), angle)
        new = Row(c, row.part, row.s + length, angle, tests_of(c), ds)
        new.bend, new.misfit = angle / length, misfit
        new.ds = next_length(ds, new.bend, row.bend, c.iterations, self.options.ds_max)
        return new, None

    def onto_bound(self, row, beyond):
        """Replace a row on or beyond a bound by the first point on it; returns as `attempt`."""
        bound = self.options.high if beyond.p > row.p else self.options.low
        curve = Curve(row, beyond)
        low, high = 0.0, 1.0
        rising = beyond.p > row.p
        for _ in range(60):  # on the Hermite polynomial: costs nothing
            t = 0.5 * (low + high)
            if (curve.place(t)[-1] > bound) == rising:
                high = t
            else:
                low = t
            if high - low < 1e-9:
                break
        x = curve.place(high)
        x[-1] = bound
        tangent = curve.tangent(high)
        try:
            c = row.part.problem.correct(x, tangent, True)
        except row.part.problem.errors as error:
            return None, raised(error)
        if c.converged and float(np.dot(c.tangent, row.tangent)) < 0.0:
            return None, (StopReason.DS_MIN, 0.5, "the branch does not reach the bound here")
        return self.judge(row, c, high * curve.length, True)

    def accept(self, row, new):
        """Take a credible row in, with the special points of the step; returns None or a cause to reject it."""
        cut, cause = detect.boundary(self, row, new)
        if cause is not None:
            return cause
        if cut is not None and self.beyond_bounds(cut.row.p, row.part, cut.special.bound):
            return self.accept_bound(row, cut.row)
        if cut is not None and self.bound_first(new, cut):
            cut = None
        if cut is not None:
            new = cut.row
        elif self.closing(row, new):
            new = self.closed_by(row, new)
            if new is None:
                return StopReason.DS_MIN, 0.5, "the branch comes near its start but does not close"
        inner = hidden.dip(self, row, new, cut)
        if inner is not None:
            if cut is not None and inner.s > row.s:
                inner.ds = OVER * (new.s - inner.s)
            return self.accept_inner(row, inner)
        found, cause = detect.crossed(self, row, new, cut)
        if cause is not None:
            return cause
        for special in found:  # a fold behind a bound: the bound comes first
            if special.s > row.s and self.beyond_bounds(float(special.x[-1]), row.part, special.bound):
                return self.accept_bound(row, special.as_row(row))
        silent = cut is None or cut.silent
        self.take(row, new, found if silent else [*found, cut.special])
        if cut is not None:
            self.cross(new, cut)
        return None

    def accept_inner(self, row, inner):
        """Take a row in that lies before the end of a step from ``row``, or before that: then it takes its place; returns as
        `accept`."""
        back = None
        if inner.s <= row.s:
            back, found, row = row, self.found, self.take_back()
        try:
            cause = self.accept_bound(row, inner) if self.beyond_bounds(inner.p, row.part) else self.accept(row, inner)
        except ERRORS as error:
            if back is None or self.rows[-1] is not row:
                raise
            cause = raised(error)
        if back is not None and cause is not None:  # the next try begins where this one did
            self.rows.append(back)
            self.signs, self.found, self.steps = list(back.signs), found, self.steps + 1
        return cause

    def beyond_bounds(self, p, part, error=0.0):
        """Whether a parameter, known to an ``error`` (as a float), lies behind a bound."""
        low, high, room = self.options.low, self.options.high, 1e-12 * part.scale[-1]
        if low - room <= p <= high + room:  # whatever its error
            return False
        room += decides(error)
        return not low - room <= p <= high + room

    def accept_bound(self, row, beyond):
        """Take the point on the bound in that comes before a row ``beyond`` it; returns as `accept`."""
        inner, cause = self.onto_bound(row, beyond)
        return (cause or (StopReason.DS_MIN, 0.5, "")) if inner is None else self.accept(row, inner)

    def bound_first(self, new, cut):
        """Whether a row lies on a bound, and a boundary of the equations on it too, to rounding: the branch ends on the bound."""
        return new.p in (self.options.low, self.options.high) and (
            abs(cut.row.p - new.p) <= 1e-12 * new.part.scale[-1] + decides(cut.special.bound))

    def take(self, row, new, found):
        """Append an accepted row and its special points; ask the user's functions."""
        self.decide(self.signs[0])
        detect.remember(self, new, (row,))
        self.decide(new.tests[0])
        self.found.extend(found)
        self.rows.append(new)
        new.signs, new.turn = tuple(self.signs), row.turn + new.angle
        self.steps += 1
        self.ds = new.ds
        options = self.options
        if new.p == options.low or new.p == options.high:
            self.found.extend(detect.at_end(self, new))
            self.stop(StopReason.BOUND)
        if self.origin is not None and new.x is self.origin.x:
            self.stop(StopReason.CLOSED)
        self.ask_user(new)

    def decide(self, slope):
        """Say with the first clear dp/ds behind a boundary whether the parameter turns back there."""
        if self.pending is not None and detect.clear_slope(slope):
            before, special = self.pending
            special.reverses = before * slope < 0.0
            self.pending = None

    def take_back(self):
        """Undo the last step; returns the row before it."""
        self.rows.pop()
        row = self.rows[-1]
        self.signs = list(row.signs)
        self.found = [special for special in self.found if special.s <= row.s]
        self.steps -= 1
        return row

    def come_inside(self):
        """Undo the steps behind the last row that has no test beyond a boundary, or if there is none by more than rounding; returns
        it, or the first row, on the boundary itself, where the equations have none.

        Outside the region of validity, that steps did not enter again, rows are no motions.  Where changes of the sequence
        accumulate, steps creep over one whose test stays below what an orbit may touch by: the event that it lists no more, or not
        yet, is missing in their rows.
        """
        part = self.rows[-1].part
        mine = [row for row in reversed(self.rows) if row.part is part]
        inside = next((row for most in (0.0, ROUNDED) for row in mine if not any(row.tests[j] > most for j in part.boundary)),
                      mine[-1])
        while self.rows[-1] is not inside:
            self.take_back()
        return inside

    def ask_user(self, row):
        """Call ``record``, ``stop`` and ``progress``; where one fails the branch ends with the row kept."""
        options = self.options
        try:
            if options.record is not None:
                row.recorded = recorded(options.record, Point(row))
            if options.stop is not None and stops(options.stop, Point(row)) and self.reason is None:
                self.stop(StopReason.STOPPED)
            if options.progress is not None:
                asked("progress=", options.progress, row.p, len(self.rows))
        except CallbackError as error:
            self.stop(StopReason.CALLBACK_FAILED, f"{error} (at {row.part.problem.parameter} = {row.p:.12g})")

    def record_points(self):
        """Call ``record`` at the special points as well; where it fails the branch ends as at a row."""
        if self.options.record is None or self.reason in (StopReason.INTERRUPTED, StopReason.EXCEPTION, StopReason.CALLBACK_FAILED):
            return
        try:
            for special in self.found:
                if special.recorded is None:
                    special.recorded = recorded(self.options.record, special.as_point())
        except KeyboardInterrupt:
            self.stop(StopReason.INTERRUPTED)
        except ERRORS as error:
            reason, _, text = raised(error)
            self.stop(reason, f"at a special point: {text}")

    def turned(self, row):
        """Go on behind a corner of equations that are only piecewise smooth; returns whether there is one."""
        if self.steps == self.corner:  # no step since the last one
            return False
        try:
            answer = row.part.problem.beyond_corner(row)
            if answer is None:
                return False
            problem, tangent, *length = answer
            step = length[0] if length else ASIDE[0]
            c = problem.correct(row.x + step * problem.scale * tangent, tangent)
        except row.part.problem.errors:
            return False
        if not c.converged or float(np.dot(c.tangent, tangent)) < problem.same_tangent:
            return False
        self.corner = self.steps
        successor = Part(problem, row.part.index + 1)
        first = Row(c, successor, row.s + step, 0.0, tests_of(c), self.options.ds)
        self.parts.append(successor)
        self.rows.append(first)
        slope = float(self.signs[0])
        self.signs, self.sizes = [0] * successor.count, [0.0] * successor.count
        detect.remember(self, first, (), fresh=True)
        if slope * first.tests[0] < 0.0:  # the parameter turns back in the corner
            self.found.append(detect.Found(detect.SpecialPointKind.FOLD, "corner", row.x, row.tangent, row.s, row.s, first.s,
                                           abs(first.p - row.p), row.part, detect.LocationStatus.GUESS, True))
        old = row.part
        if problem.signature != old.problem.signature and old.boundary:  # a change that no monitor has seen in time
            kind, name = detect.named(old, min(old.boundary, key=lambda j: abs(row.tests[j])), row.x)
            kind = old.problem.change(kind, row.x, problem)
            self.found.append(detect.Found(kind, name, row.x, row.tangent, row.s, row.s, first.s, abs(first.p - row.p), old,
                                           detect.LocationStatus.GUESS, after=problem.signature, successor=problem))
        first.signs = tuple(self.signs)
        self.ds, self.edge = first.ds, None
        return True

    def leap(self, row):
        """Whether the branch goes on behind a boundary that steps only creep up to: its equations lose rank there, as where
        several events end at once. The equations behind it tell the parameter.  They are looked for from the last few rows, of
        which those so near to it are rounding."""
        if self.ends_in(row) in NOTHING_BEYOND:
            return False
        return any(self.leap_from(row, start) for start in self.rows[:-STARTS - 1:-1] if start.part is row.part)

    def leap_from(self, row, start):
        """Whether the branch goes on behind ``row`` with the equations that are found from the row ``start``."""
        cut = detect.creeping(self, start)
        if cut is None:
            return False
        before = self.slope, self.signs, self.sizes, self.edge, self.pending
        earlier = next((one for one in self.rows[-2:-1] if one.part is row.part), row)
        chord = row.p - earlier.p
        self.slope = chord if chord * row.tests[0] < 0.0 else row.tests[0]  # so near to a singular end its sign is rounding
        self.cross(row, cut)
        if self.reason is not None:
            if self.reason is not StopReason.NO_SUCCESSOR:
                return True
            self.reason, self.message, self.slope = None, "", before[0]
            return False
        if self.ends_in(self.rows[-1]) is not StopReason.DS_MIN:  # what creeps up to the same end goes nowhere
            self.rows.pop()
            self.parts.pop()
            self.slope, self.signs, self.sizes, self.edge, self.pending = before
            return False
        first = self.rows[-1]
        special = cut.special
        if first.part.problem.placed is None:
            special.bound = special.error + abs(first.p - row.p)
            if first.part.problem.free > row.part.problem.free:  # where it stands is known as well as where steps end
                special.bound += crept(self.rows[:-1], row, before[2])
            special.x = np.append(row.x[:-1], first.p)
        if not cut.silent:
            self.found.append(special)
        self.ds = min(self.options.ds, self.options.ds_max)
        return True

    def meets(self, row):
        """Whether the bound is just ahead, and the equations are singular on it: an interval lasts no time there, as flights behind
        a plastic impact.  Steps would only creep into what is rounding."""
        bound = self.options.high if row.tests[0] > 0.0 else self.options.low
        new = self.beside_bound(row, row, bound)
        if new is None or not hidden.on_boundary(self, new):
            return False
        part = row.part
        if any(self.signs[j] * new.tests[j] < 0.0 for j in range(1, part.count) if j not in part.boundary):
            return False
        return self.ends_on(new)

    def reach(self, row):
        """Whether the branch ends on a bound that steps only creep up to, because it meets it at no angle: it does where the point
        on the bound is next to the last row.  It is looked for from the last few, of which so near to it some are rounding; where
        the slope of the parameter is rounding too, on the nearest bound."""
        part, options, slope = row.part, self.options, row.tests[0]
        leads = slope if abs(slope) > SLOPE else 2.0 * row.p - options.low - options.high
        bound = options.high if leads > 0.0 else options.low
        new = next(filter(None, (self.beside_bound(row, start, bound) for start in reversed(self.rows[-STARTS:])
                                 if start.part is part)), None)
        return new is not None and self.ends_on(new)

    def ends_on(self, new):
        """End on a bound with the row ``new``; returns True."""
        self.rows.append(new)
        self.steps += 1
        self.stop(StopReason.BOUND)
        self.ask_user(new)
        return True

    def beside_bound(self, row, start, bound):
        """Return the point on a bound next to ``row``, looked for from the row ``start``; None where there is none.

        Where the slope of the parameter falls to nothing on the bound, that is behind the start by twice what the slope tells. The
        equations are singular there: Newton's method starts from that place, because it stalls on its way to it.
        """
        part = row.part
        gap, slope = (bound - start.p) / part.scale[-1], start.tests[0]
        behind = 2.0 * gap / slope if abs(slope) > SLOPE else 0.0
        near = 0.0 < behind <= REACH
        if abs(gap) > AT_BOUND and not near:
            return None
        for length in (behind, 0.0) if near else (0.0,):
            x = start.x + length * start.direction
            x[-1] = bound
            try:
                c = part.problem.correct(x, start.tangent, True)
            except part.problem.errors:
                continue
            away = float(np.linalg.norm((c.x - row.x) / part.scale))
            new = Row(c, part, row.s + away, 0.0, tests_of(c), self.ds) if c.converged and away <= REACH else None
            inside = new is not None and all(new.tests[j] <= part.touch for j in part.boundary)
            if inside and part.problem.is_motion(c.x) is not False:  # rounding may leave the wrong root of a flight of no duration
                return new
        return None

    @staticmethod
    def ends_in(row):
        """Return the name of the end that steps creep up to at a row, `DS_MIN` where it has none."""
        return row.part.problem.named_end(row.x, StopReason.DS_MIN, "")[0]

    def cross(self, row, cut):
        """Go on with the problem behind a boundary."""
        if self.reason is not None:
            return None
        part = row.part
        monitor = part.monitors[cut.test - 1]
        clear = max(known_to(cut.special), CLEAR)
        cut.corrected.before = next((one.x for one in reversed(self.rows) if one.part is part and row.s - one.s > clear
                                     and np.any(one.x != cut.corrected.x)), None)
        try:
            answer = part.problem.switch(cut.corrected, monitor)
            if not isinstance(answer, tuple) and self.reach(row):  # what is so near to the bound lies on it
                self.found = [special for special in self.found if special is not cut.special]
                return None
            if answer is None:
                label = f"{monitor.kind!s} {monitor.name}".strip()
                return self.stop(StopReason.NO_SUCCESSOR, f"no equations go on behind {label}")
            if isinstance(answer, StopReason):
                return self.stop(answer)
            if isinstance(answer, str):
                return self.stop(StopReason.NO_SUCCESSOR, answer)
            problem, x, tangent = answer
            successor = Part(problem, part.index + 1)
            tangent = np.asarray(tangent, float)
            tangent /= math.sqrt(float(np.dot(tangent, tangent)))
            c, along = self.begun(problem, np.asarray(x, float), tangent)
        except part.problem.errors as error:
            reason, _, text = raised(error)
            return self.stop(reason if reason is StopReason.CALLBACK_FAILED else StopReason.NO_SUCCESSOR, text)
        if not c.converged:
            return self.stop(StopReason.NO_SUCCESSOR, f"the equations behind {monitor.kind!s} ended with {c.status!s}")
        tests = tests_of(c)
        if along:  # dp/ds so near to the beginning is rounding
            tests[0] = 0.0
        first = Row(c, successor, row.s + along, 0.0, tests, min(self.ds, self.options.ds_max))
        successor.born = min(successor.boundary, key=lambda j: abs(tests[j]), default=-1)
        cut.special.bound = Later(partial(detect.error_behind, cut.special, cut.special.bound, first, along))
        self.drop_beside(row, cut.special, 0.0 if problem.placed is None else abs(float(x[-1]) - row.p))
        self.parts.append(successor)
        self.rows.append(first)
        self.signs = [0] * successor.count
        self.sizes = [0.0] * successor.count
        detect.remember(self, first, (), fresh=True)
        first.signs = tuple(self.signs)
        cut.special.successor = problem
        cut.special.after = problem.signature
        off = problem.uncertainty(np.asarray(x, float), tangent)
        if off > 0.0:  # else nothing asks for the error yet; what both equations are off by is in it
            own = part.problem.uncertainty(cut.corrected.x, cut.corrected.tangent)
            cut.special.bound = cut.special.error + (off - own if off > own else 0.0)
        if problem.placed is not None:
            cut.special.x, cut.special.bound = np.append(cut.special.x[:-1], float(x[-1])), problem.placed
        kind = part.problem.change(cut.special.kind, cut.corrected.x, problem)
        if kind is None:
            self.found = [special for special in self.found if special is not cut.special]
        cut.special.kind = kind or cut.special.kind
        self.edge = known_to(cut.special)
        self.pending = self.slope, cut.special
        cut.special.reverses = self.slope * self.signs[0] < 0.0  # unless the first step shows it to be rounding

    def drop_beside(self, row, special, astray):
        """Undo the steps to points that differ from a boundary, on which ``row`` lies, by rounding: where several events end at
        once steps creep up to it, and what lies between those points says nothing.  Where their parameter is ``astray`` of the
        boundary's, as others tell it, nor do those that are no farther from them."""
        rows, known = self.rows, special.known
        count = len(rows)
        while len(rows) > 2 and rows[-3].part is row.part and (
                row.s - rows[-2].s <= known or astray > 0.0 and abs(rows[-2].p - row.p) < astray):
            self.steps -= 1
            known = max(known, row.s - rows.pop(-2).s)
        if known > 0.0:
            self.found = [other for other in self.found if other.part is not row.part or other.successor is not None
                          or other is special or row.s - other.s > known]
        if len(rows) < count:
            turns = sum(other.reverses for other in self.found if other.part is row.part and rows[-2].s < other.s < row.s)
            self.slope = rows[-2].tests[0] * (-1.0)**turns

    @staticmethod
    def begun(problem, x, tangent):
        """Return the first corrected point of new equations and its distance from their beginning.

        Where they are singular there, or two branches of them meet, it is a little inside, where the tangent is that known, and no
        farther than they are valid; and farther where rounding moves solutions by a part of the way: which of them Newton finds is
        chance, and no step from it goes on.
        """
        made, boundaries = [], [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
        for step in (0.0, *ASIDE, FARTHEST):
            c = problem.correct(x + step * problem.scale * tangent, tangent)
            if not c.converged:
                continue
            same = float(np.dot(c.tangent, tangent)) > problem.same_tangent
            told = problem.blur(c) <= detect.BLURRED * max(step, ASIDE[0])
            valid = step == 0.0 or all(c.monitors[k] <= problem.touch for k in boundaries)
            if same and told and valid:
                return c, step
            if same or step:
                made.append((not valid, not (told and step), not same, len(made), c, step))
        return min(made)[-2:] if made else (c, step)

    def closing(self, row, new):
        """Whether the first point of the branch may lie in this step (cheap tests first)."""
        origin = self.origin
        if origin is None or row.turn < STRAIGHT or len(self.rows) < 3:
            return False
        length = new.s - row.s
        part = row.part
        if abs(origin.p - row.p) > 1.1 * length * part.scale[-1] or origin.x.size != row.x.size:
            return False
        place = part.problem.alike(origin.x, row.x)
        if place is not origin.x:
            origin = self.origin = copy.copy(origin)
            origin.x = place
        if part is not origin.part and not part.problem.same(origin.part.problem):
            return False
        gap = (origin.x - row.x) / part.scale
        along = float(np.dot(gap, row.tangent))
        return 0.0 < along <= 1.05 * length and float(np.dot(gap, gap)) <= (1.1 * length)**2

    def closed_by(self, row, new):
        """Return the first row as the last of a closed branch, ``new`` if the branch passes by, None to try shorter."""
        origin = self.origin
        curve = Curve(row, new)
        t, distance = curve.nearest(origin.x)
        if t > 1.0 or t <= 0.0 or float(np.dot(curve.tangent(t), origin.tangent)) < math.cos(MAX_ANGLE):
            return new
        if distance > 0.05 * curve.length:
            return new
        x = curve.place(t)
        gap = (origin.x - x) / row.part.scale  # into the plane through the first point, orthogonal to its tangent
        x = x + row.part.scale * (float(np.dot(gap, origin.tangent)) * origin.tangent)
        try:
            c = row.part.problem.correct(x, origin.tangent)
        except row.part.problem.errors:
            return None
        if not c.converged:
            return None
        miss = (c.x - origin.x) / row.part.scale
        if math.sqrt(float(np.dot(miss, miss))) > 1e-8 or c.det_sign * origin.det_sign < 0.0:
            return new
        last = Row(c, row.part, row.s + t * curve.length, new.angle * t, list(origin.tests), self.ds)
        last.x, last.tangent, last.p, last.det_sign, last.det_log = (
            origin.x, origin.tangent, origin.p, origin.det_sign, origin.det_log)
        return last


def raised(error) -> tuple[StopReason, float, str]:
    """Return the cause to reject a step in which ``error`` was raised: the caller's function, or the problem's code."""
    if isinstance(error, CallbackError):
        return StopReason.CALLBACK_FAILED, 0.25, str(error)
    return StopReason.EXCEPTION, 0.25, f"{type(error).__name__}: {error}"


def decides(error) -> float:
    """Return the error (as a float) of a value within which it counts as another one: none where that is not known."""
    found = float(error)
    return found if found < math.inf else 0.0


def outward(row, options):
    """Whether a row lies on a bound, but for the rounding of the arclength, and its branch leaves through it."""
    room, slope = ON_BOUND * (1.0 + row.s) * float(row.part.scale[-1]), row.tests[0]
    return bool(row.p >= options.high - room and slope > SLOPE or row.p <= options.low + room and slope < -SLOPE)


def crept(rows, row, sizes) -> float:
    """Return how far the parameter of a last ``row``, of ``rows`` whose tests had at most the ``sizes``, may be from a boundary
    that they creep up to.

    A test that is zero there with at most the square of the way is `FURTHER` times as large twice as far away.  Rounding may leave
    nearly nothing of one: of the last few rows the largest counts, and of the tests that fall to nothing the one that tells most.
    """
    mine, found = [other for other in rows if other.part is row.part], 0.0
    for j in row.part.boundary:
        near = max(abs(other.tests[j]) for other in mine[-FEW:])
        if near < FALLEN * sizes[j]:
            away = (abs(other.p - row.p) for other in reversed(mine) if abs(other.tests[j]) >= FURTHER * near)
            found = max(found, next(away, 0.0))
    return found
