"""Periodic orbits as a continuation problem: one event signature, one parameter, many steps in one compiled call.

One file, because it is one class: residual, monitors, measures and hooks of a branch share its sequence, its numbers and its
kernels.
"""
import copy
import dataclasses
import math
from functools import partial
from itertools import pairwise

import numpy as np

from ...compose.modal import give_modal
from ...compose.scene import beside, given, numbered, scene_of
from ...elements import EventKind
from ...jobs.executors import user_parts
from ...orbits.energy import conservative
from ...orbits.multipliers import NEUTRAL, attracting, nontrivial
from ...orbits.orbit import INSTANT, TOUCH, PeriodicOrbit, closure_of
from ...orbits.repetition import repetition
from ...orbits.shooting import sequence
from ...orbits.shooting.equations import Equations
from ...orbits.shooting.path import SHAKEN, ParameterPath, fixed_path, kept, of_all_modes, parameter_path
from ...orbits.shooting.refused import Refusal, meet_modes
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, GUARD, NO_PEAK, STARTS
from ...orbits.shooting.signature import Signature, at_limits, divided, repeated, sections, since
from ...solve.bordered import Factors, kernel
from ...solve.steprun import SIZE, run_of
from ...structure.components import by_number, worded
from ...system import System
from ..conditions import ASIDE, difference
from ..families import orbit_family
from ..kinds import NUMERICAL, CorrectorStatus, SpecialPointKind, StopReason
from ..problem import ROUNDED, Corrected, EndPoint, Monitor, Problem
from ..steps.roots import root_of
from ..steps.rows import followed
from ..watching import bare
from . import autonomous, branching, signature_change
from .appearing import moved
from .completion import completion_near
from .extremes import extreme_gradient
from .linear import LinearMotion, is_linear
from .signature_change import CLOSURE, COMPLETES, LEAVING, MERGES, ONE, REFUSED, UNLISTED
from .successor import HELD_ROWS, LISTED, OF_FLOW
from .train_length import SLACK, SPARE, relengthened
from .vanishing import listed_speeds

ACCUMULATED = 1e-3  # speed of the last of a train of impacts to that of the first: it completes nearby
RESTING, BESIDE = 1e-2, 1e-4  # share of a period for which a mass rests behind a chattering that may just complete; and how far
# from there it does, of the natural size of the parameter
TOUCHED, AWAY = 1e-9, 1e-4  # scaled: value of a guard that is zero; length to a place where one that is zero by itself is so, too
STUCK = 1e-3  # share of a period for which a contact slips that soon does not slip at all
KNOWN = 8  # solutions whose multipliers are kept: those of a row are asked for by several tests
STATUS = {1: CorrectorStatus.CONVERGED, 0: CorrectorStatus.NOT_CONVERGED, -1: CorrectorStatus.SINGULAR}
monitored = sequence.monitored.py_func
FLIPS, FLIPS_OF = 0.02, 1e-7  # distance of a multiplier from -1 at a flip: absolute, and as part of the largest one
ROUNDING = 1e-10  # of the natural size of a parameter
FIRST_ORDER = 2.0  # of what is told by a rate alone, how much there may be
BETWEEN = 0.382  # of the path: a value of the parameter that is not special
BORN = 1e-12  # scaled speed or duration of a listed event, below which rounding decides even the signs of the multipliers
MIRRORED = 1e-8  # scaled difference of half an orbit and the mirror image of the other half,
SAME_FLOW = 1e-6  # and relative difference of the flow over the two, where they are the same
SHORT = 1e-6  # periods: so short a flight is verified by the speed at its end
FAR_ROUND = 0.1  # of the other part of a flight
# tests that the kernel makes: their places in its `info`, and their monitors
FLIP = sequence.FLIP, Monitor(SpecialPointKind.PERIOD_DOUBLING)
HALF_FLIP = sequence.FLIP, Monitor(SpecialPointKind.BRANCH_POINT)
HIT = sequence.LISTED, Monitor(SpecialPointKind.GRAZING, LISTED, boundary=True)
PASS = sequence.PEAK, Monitor(SpecialPointKind.GRAZING, UNLISTED, boundary=True)
APART = [(place, PASS[1]) for place in (sequence.MOVING, sequence.HOLDING)]  # the same of what moves, and of what is held
LEAVE = sequence.LEAVING, Monitor(SpecialPointKind.STICK_ONSET, LEAVING, boundary=True)
BREAK = sequence.BROKEN, Monitor(SpecialPointKind.USER, HELD_ROWS, boundary=True, silent=True)
SHORTEST = 1e-9  # forcing periods: contacts of a shorter time leave rounding alone in the multipliers


def orbit_problem(orbit: PeriodicOrbit, parameter: str, bounds: tuple[float, float]) -> "OrbitProblem":
    """Return the problem that continues ``orbit`` in ``parameter`` over ``bounds``.

    Raises
    ------
    ValueError
        Unknown or discrete parameter, or an orbit that is no motion of its system.
    """
    name = orbit.system.parameter_name(parameter)
    value = orbit.system.parameter(name)
    if not orbit.success:
        raise ValueError(f"the orbit cannot be continued, it is {orbit.status}: {orbit.message}")
    if orbit.autonomous and conservative(orbit.system):
        raise ValueError(f"{orbit.system!r} keeps its energy: its orbits form families along that; trace(orbit, 'energy', "
                         "bounds=...), for each value of a parameter that matters")
    path = parameter_path(orbit.scene, orbit.system, name, bounds)
    signature, unknowns = orbit.sequence, orbit.unknowns
    symmetric = signature.closure > 0 or signature.clock or kept(
        orbit.scene.sampled, orbit.system, name, bounds, "symmetric",
        lambda: all(orbit.system.with_parameters(**{name: end}).symmetry == -1 for end in bounds))
    if not symmetric:
        signature, unknowns = repeated(orbit.scene, signature, unknowns)  # the parameter breaks the symmetry
        if signature.events:
            signature = Signature(divided(orbit.scene, signature.nodes[:, :ENDING]), signature.fixed, signature.span)
        else:
            signature = sections(int(signature.nodes[0, AFTER]), signature.span)
            unknowns = unknowns[:1 + orbit.scene.ns]
    return OrbitProblem(orbit.system, path, signature, orbit.weights, np.append(unknowns, value), 0.5 * abs(bounds[1] - bounds[0]))


def generic(scene, path: ParameterPath, signature: Signature) -> Signature:
    """Return a signature with the orders at the starts of its intervals that hold along the path, where its first value is
    special: a plastic impact of a restitution that varies."""
    T = path.tables
    kicks = signature.nodes[signature.nodes[:, GUARD] >= 0][:, :AFTER].T
    if path.name is None or not signature.events or not np.any(T.ratio[tuple(kicks)] == 0.0):
        return signature
    sequence.set_parameter(T, path.index, path.series, path.low, path.high, 0.5 * (path.low + path.high))
    if not np.any(T.ratio[tuple(kicks)] > 0.0):
        return signature
    return dataclasses.replace(signature, nodes=divided(scene, signature.nodes, T, signature.closure))


def along(path: ParameterPath, value: float):
    """Yield the tables of a path at a parameter that is not special, and at a value of it."""
    for at in (BETWEEN * path.low + (1.0 - BETWEEN) * path.high, value):
        sequence.set_parameter(path.tables, path.index, path.series, path.low, path.high, at)
        yield path.tables


def watched(scene, signature: Signature) -> tuple[np.ndarray, list[Monitor]]:
    """Return the places in the kernel's `info` of the tests that it makes of a sequence, and their monitors."""
    nodes = signature.nodes
    found = [FLIP if signature.closure > 0 else HALF_FLIP]
    if signature.events:
        found.append(HIT)
    T = scene.tables
    kinds = {int(T.kind[mode, guard]) in (sequence.RELEASED, sequence.SLIPS) for mode in set(nodes[:, AFTER].tolist())
             for guard in range(int(T.n_guards[mode]))}
    found += APART if len(kinds) > 1 else [PASS]
    if np.any(nodes[:, STARTS:] < 0):
        found.append(LEAVE)
    if np.any((nodes[:, GUARD] >= 0) & (scene.tables.n_holds[nodes[:, AFTER]] > 0)):
        found.append(BREAK)
    places, monitors = zip(*found, strict=True)
    return np.array(places), list(monitors)


class OrbitProblem(Problem):
    """Event-sequence equations along one parameter.

    Parameters
    ----------
    system : System
        Any system of the family; its other parameters hold along the branch.
    path : ParameterPath
    sequence : Signature
    weights : ndarray (ns,)
        Natural sizes of the states.
    x0 : ndarray (n + 1,)
        Unknowns of the start and the parameter.
    parameter_scale : float
        Natural size of the parameter.
    """

    errors = NUMERICAL
    touch = TOUCH  # as the audit of an orbit
    wraps = True
    monitors_read_tangent = False
    _linear: LinearMotion | None = None
    same_tangent = 1.0 - 1e-5  # two branches of the equations may meet where a sequence begins: there the corrector mixes them

    def __init__(self, system: System, path: ParameterPath, sequence: Signature, weights, x0, parameter_scale: float):
        self.system, self.path, self.sequence = system, path, sequence
        self.scene = scene_of(system)
        self.parameter = path.name or ""
        self.parameter_scale = parameter_scale
        sequence = generic(self.scene, of_all_modes(self.scene, path), sequence)
        self._earlier = meet_modes(self.scene, sequence)
        self.path = path = of_all_modes(self.scene, path)
        self._listed = sequence
        self.sequence = sequence = at_limits(self.scene, sequence, np.array(x0[1:1 + self.scene.ns]), along(path, float(x0[-1])))
        self.equations = Equations(self.scene, path, sequence, weights, parameter_scale)
        self._refusal = Refusal(self.equations, self._earlier, BETWEEN * path.low + (1.0 - BETWEEN) * path.high)
        if self._earlier:
            self.equations.numbers_at(float(x0[-1]))  # what is asked before the first correction is asked there
        self.weights = self.equations.weights
        self.size, self.scale = self.equations.size, self.equations.scale
        self.x0 = np.array(x0, float)
        self.signature = sequence.text(self.scene)
        self._labels = self.equations.labels
        self.free = len(self._labels.rows)
        self._known: dict[bytes, np.ndarray] = {}  # multipliers of the last solutions
        self._clear: tuple[np.ndarray, float] | None = None  # a solution and its test of the multiplier -1
        self._halves = branching.halves(self.sequence, self.x0, self.scale, lambda: self.wide_jacobian(self.x0) * self.scale)
        self._reads, monitors = watched(self.scene, sequence)
        self._beside = self._reads[1:].tolist()
        self._hits = sequence.events > 0
        if self._refusal:
            monitors.append(Monitor(SpecialPointKind.STICK_ONSET, REFUSED, boundary=True))
        self._chatters = bool(np.any(self.sequence.nodes[:, CLOSES] == 1))
        if self._chatters:
            monitors.append(Monitor(SpecialPointKind.CHATTER_COMPLETION, COMPLETES, boundary=True))
            monitors.append(Monitor(SpecialPointKind.CHATTER_COMPLETION, CLOSURE, boundary=True, silent=True))
        if self._halves is not None:
            self._merges = len(monitors)
            monitors.append(Monitor(SpecialPointKind.PERIOD_DOUBLING, MERGES, boundary=True))
        self._born = bool(sequence.clock) and not sequence.events
        if self._born:
            self._shrinks = len(monitors)
            monitors.append(Monitor(SpecialPointKind.HOPF, autonomous.SHRINKS, boundary=True))
        self._tori = self.scene.ns - len(self._labels.places) - (sequence.clock > 0.0) > 1 and self.scene.n != 1
        if self._tori:
            monitors.append(Monitor(SpecialPointKind.NEIMARK_SACKER))
        if self._tori and is_linear(self.scene, sequence, self._labels):
            self._linear = LinearMotion(self.equations, sequence, float(x0[-1]))
        self.monitors = tuple(monitors)
        self._bounds = np.array([monitor.boundary for monitor in monitors])
        self.follows = len(monitors) == len(self._reads)  # what the kernel does not know is looked up in every step
        self._touch = np.array([-1.0, *(self.touch if monitor.boundary else -1.0 for monitor in monitors)])

    # equations

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`; one compiled call."""
        return self._corrected(x, tangent, *self.equations.correct(x, tangent, not fixed))

    def _corrected(self, x, tangent, status, U, new, info) -> Corrected:
        """Return what the kernel made of the guess ``x`` (n + 1,), ``tangent`` (n + 1,): point, tangent and what it found."""
        told = info.tolist()
        iterations, residual = int(told[sequence.ITERATIONS]), told[sequence.RESIDUAL]
        if status != 1:
            return self._failed(U, tangent, STATUS[status], iterations, residual)
        if self._halves is not None and self._apart(U) <= ONE and self._apart(x) > branching.SEPARATE:
            # an orbit run through twice solves the same equations, and is met at the end of a doubled branch alone
            return self._failed(U, tangent, CorrectorStatus.NOT_CONVERGED, iterations, residual)
        moved = (U - x) / self.scale
        sign, log = told[sequence.DET_SIGN], told[sequence.DET_LOG]
        values = self._values(U, told)
        if self._chatters and self._backwards(U, bool((values[self._bounds] > 0.0).any())):
            return self._failed(U, tangent, CorrectorStatus.NOT_CONVERGED, iterations, residual)
        odd = self._merges if self._halves is not None else self._shrinks if self._born else None
        if odd is not None:  # det is odd in the difference of the halves, or in the amplitude: its zero is no crossing
            apart = -values[odd]
            size = abs(apart) if self._halves is None else self._apart(U)
            sign *= -1.0 if apart < -ROUNDING * size else 1.0
            log -= math.log(max(size, 1e-300) / (1.0 + size))
        if self._linear is not None:
            log = self._linear.without_turns(log, float(U[-1]))
        return Corrected(U, new, True, CorrectorStatus.CONVERGED, iterations, residual, math.sqrt(float(np.dot(moved, moved))),
                         told[sequence.CONTRACTION], sign, log, values, told[sequence.LEFT])

    def follow(self, before, row, signs, sizes, ds, most, limits, origin):
        """See `Problem.follow`; one compiled call."""
        if not (row.det_sign and before.det_sign and all(signs)):
            return [], None
        tests = np.array([before.tests, row.tests, signs, sizes, self._touch])
        run = run_of(before, row, ds, limits, origin, self.corner)
        status, U, predicted, tangent, info, rows = self.equations.follow(np.array([before.x, before.tangent]), row.x, row.tangent,
                                                                          self._reads, run, tests, most)
        made = followed(row, rows, tuple(signs))
        if made:
            self._clear = made[-1].x, made[-1].tests[1]
            sizes[:] = tests[SIZE].tolist()
        return made, None if status > 1 else self._corrected(predicted, tangent, status, U, tangent, info)

    def zero(self, curve, test, ends, guess):
        """See `Problem.zero`; one compiled call."""
        if not self.follows:
            return None
        hermite = np.array([curve.xa, curve.chord, curve.da, curve.db])
        bracket = (*ends, math.nan if guess is None else guess)
        place = int(self._reads[test - 1]) if test else -1
        status, U, predicted, tangent, info, box = self.equations.locate(hermite, bracket, place)
        if status == sequence.UNKNOWN:
            return None
        return (root_of(box, self._corrected(predicted, None, 1, U, tangent, info)) if status == 1 else None,)

    def leaves(self, a, b) -> float:
        """See `Problem.leaves`: of the duration of every interval value and rate are known at both rows."""
        if not self._hits:
            return -1.0
        s = self.sequence
        return sequence.emptied(self.scene.tables.kick, s.nodes, s.span, a.x, a.tangent, b.x, b.tangent, self.scale, b.s - a.s)

    def _values(self, x, info: list, flip: bool = True) -> np.ndarray:
        """Values of the monitors at a solution, from what the kernel found; NaN for the flip where it is not asked for."""
        values = [self._flip(x, info[sequence.FLIP]) if flip else math.nan, *[monitored(info, place) for place in self._beside]]
        if self._refusal:
            values.append(max(self._refusal.worst(x), NO_PEAK))
        if self._chatters:
            values.append(self._overtaken(x) - info[sequence.RESTS])
            values.append(self._closure(x))
        if self._halves is not None:
            values.append(-float(np.dot(self._halves[0], x)) - self._halves[1])
        if self._born:
            values.append(autonomous.extent(self, x))
        if self._tori:
            born = self._hits and info[sequence.LISTED] <= BORN
            values.append(math.nan if born or self._linear is not None else self._torus(x))
        if self._linear is not None:
            values[0], values[-1] = self._linear.tests(float(x[-1]))
        return np.array(values)

    def _flip(self, x, value: float) -> float:
        """Test of the multiplier -1 at ``x`` (n + 1,): ``value``, or where that is not known, beside the birth of a contact without
        duration, prod(1 + mu) with the sign that it has elsewhere on the same equations."""
        if self._chatters and self.sequence.closure > 0:  # flights hardly longer than rounding leave nothing else in `value`
            mu = self._multipliers(x)
            if np.isfinite(mu).all():
                value = float(np.real(np.prod(1.0 + mu)))
                return value / (1.0 + abs(value))
        if math.isfinite(value):
            self._clear = x, value
            return value
        if self._clear is None or self.sequence.closure < 0 or self._shortest(x) < SHORTEST:
            return math.nan
        here, there = (self._multipliers(y) for y in (x, self._clear[0]))
        if not (np.isfinite(here).all() and np.isfinite(there).all()):
            return math.nan
        sign = float(np.real(np.prod(1.0 + there))) * self._clear[1]
        value = math.copysign(1.0, sign) * float(np.real(np.prod(1.0 + here)))
        return value / (1.0 + abs(value)) if sign and math.isfinite(value) else math.nan

    def _shortest(self, x) -> float:
        """Return the shortest time between two events at ``x`` (n + 1,), forcing periods: at zero there is no monodromy."""
        whole, U = self._whole(x)
        times = U.reshape(len(whole.nodes), -1)[:, 0]
        return float(since(times, whole.span).min())

    def _torus(self, x) -> float:
        """Product of (1 - mu_i mu_j) over pairs i < j: changes sign where a complex pair crosses the unit circle.

        It also does for a real pair mu, 1/mu, which is no bifurcation: `confirm` tells.  Of several pairs on the circle at once, as
        of a structure without damping, signs are rounding: the test is not known.
        """
        mu = self._multipliers(x)
        if not np.isfinite(mu).all() or np.count_nonzero(np.abs(np.abs(mu[mu.imag > 0.0]) - 1.0) < NEUTRAL) > 1:
            return math.nan
        product = 1.0
        for i in range(len(mu)):
            for j in range(i):
                factor = 1.0 - mu[i] * mu[j]
                product *= factor / (1.0 + abs(factor))
        return float(np.real(product))

    def test_uncertainty(self, found: Corrected) -> float:
        """See `Problem.test_uncertainty`: tests are parts of the natural sizes of states, of which the scale is a multiple."""
        return ROUNDED + float(self.scale[1] / self.weights[0]) * found.left

    def uncertainty(self, x, tangent) -> float:
        """See `Problem.uncertainty`: the last listed impact of a complete chattering brings the mass to rest at once.  Another
        event that meets this instant meets the end of the impacts that are not listed, by which the parameter may be off."""
        if self._chatters and self._released(x):
            return self._incomplete(x, tangent)
        if not self._chatters or self._resting(x)[1] - self._overtaken(x) > self._unlisted(x):
            return 0.0
        beside = [c for sign in (-1.0, 1.0) if (c := self.correct(x + sign * AWAY * self.scale * tangent, tangent)).converged]
        rest = self._resting(x)[1]
        rate = max((abs((c.p - float(x[-1])) / (self._resting(c.x)[1] - rest)) for c in beside), default=0.0)
        # where the two meet friction may seem to turn; a rate beside tells the first order
        return FIRST_ORDER * rate * max(self._unlisted(at) for at in (x, *(c.x for c in beside)))

    def _incomplete(self, x, tangent) -> float:
        """Return how far from ``x`` (n + 1,) the parameter is of an orbit whose impacts are over before the stop lets go; inf where
        none is found, as of a parameter that does not move what chatters.

        The acceleration falls to zero over the rest.  Impacts that it would end within a quarter of the rest, were it constant,
        last at most twice as long; where the listed ones leave nothing of the rest, the others have no end.
        """
        def over(at):
            return self._resting(at)[1] > 4.0 * self._unlisted(at)
        if over(x):
            return 0.0
        for away in AWAY * 2.0**np.arange(-20, 20):
            beside = [self.correct(x + way * away * self.scale * tangent, tangent) for way in (-1.0, 1.0)]
            found = [abs(c.p - float(x[-1])) for c in beside if c.converged and over(c.x)]
            if found:
                return min(found)
        return math.inf

    def blur(self, found: Corrected) -> float:
        """See `Problem.blur`: at a given arclength, by the rounding of the flow."""
        return self.moved_by_rounding(found.x, found.tangent)

    def moved_by_rounding(self, x, tangent) -> float:
        """Return by how much rounding moves the solution ``x`` (n + 1,) across ``tangent``, scaled."""
        _, wide, rounded = self._linearised(x)
        try:
            return Factors(np.vstack([wide * self.scale, tangent])).largest(np.append(rounded, 0.0)) * OF_FLOW
        except np.linalg.LinAlgError:
            return math.inf

    def own_directions(self, directions):
        """See `Problem.own_directions`: of a doubled orbit those of the orbit that it merges with are none."""
        return directions if self._halves is None else branching.splitting(self.sequence, directions)

    def _apart(self, x) -> float:
        """How much the two halves of a doubled orbit differ at ``x`` (n + 1,), scaled."""
        return float(np.linalg.norm(branching.half_difference(self.sequence, x, self.scale)))

    def _backwards(self, x, outside=False) -> bool:
        """Whether an impact of a complete chattering comes before the last one at ``x`` (n + 1,), or again at the instant of it: a
        flight has the other root, too, from which it came, and the shorter it is, the nearer are the two.  There the mass moves
        away from its stop as fast as it does behind the last impact: of the two roots that is the nearer one.  Other events may
        change places with impacts: where a test says that the orbit lies ``outside``, only what turns round far counts."""
        s, unknowns = self.sequence.written_out(x[:-1])
        rows = unknowns.reshape(len(s.nodes), 1 + self.scene.ns)
        train = np.flatnonzero(s.nodes[:, CLOSES])
        for i, k in pairwise(train.tolist()):
            flight = rows[k, 0] - rows[i, 0]
            if s.nodes[i, CLOSES] != 2 or flight > SHORT:
                continue
            if not (self._kicks(s.nodes[i]) and self._kicks(s.nodes[k])):
                beside = rows[i, 0] - rows[i - 1, 0] if self._kicks(s.nodes[k]) else rows[(k + 1) % len(rows), 0] - rows[k, 0]
                turned = flight < -(FAR_ROUND * abs(beside) if outside else TOUCH)
            elif outside or flight < -SHORT:
                turned = not outside
            else:
                r = self.equations.path.tables.ratio[tuple(s.nodes[i, :AFTER])]
                turned = self.arriving(s.nodes[k], rows[k]) < -0.5 * r * self.arriving(s.nodes[i], rows[i])
            if turned:
                return True
        return False

    def _closure(self, x) -> float:
        """How much too early the impacts of a complete chattering end in closed form, or how many are listed too many: at most 0,
        logarithm of a ratio."""
        s, unknowns = self.sequence.written_out(x[:-1])
        rows = unknowns.reshape(len(s.nodes), 1 + self.scene.ns)
        worst = -np.inf
        for i in np.flatnonzero(s.nodes[:, CLOSES] == 1):
            worst = max(worst, self._excess(s.nodes[i], rows[i]))
            earlier = i - 1
            while s.nodes[earlier, CLOSES] == 2 and not self._kicks(s.nodes[earlier]):  # frictions that turn round in every flight
                earlier -= 1
            if s.nodes[earlier, CLOSES] == 2:  # one impact less closes it as well: soon the last ones are nothing but rounding
                worst = max(worst, math.exp(SLACK - SPARE) / max(self._excess(s.nodes[earlier], rows[earlier]), 1e-30))
        return math.log(min(max(worst, 1e-30), 1e30)) - SLACK

    def _kicks(self, node) -> bool:
        """Whether a node is an impact."""
        return node[GUARD] >= 0 and bool(self.scene.tables.kick[node[BEFORE], node[GUARD]])

    def _excess(self, node, row) -> float:
        """Return the first of `_closing`."""
        return float(self._closing(node, row)[0])

    def _closing(self, node, row):
        """Return the closure of an impact and how long the impacts behind it last, own units, see `flow.chatter.closure`; ``row``
        (1 + ns,) are its time and the state before."""
        z = self._joined(row)
        return closure_of(self.scene)(self.equations.path.tables, node[BEFORE], node[GUARD], z, self.arriving(node, row),
                                      np.empty(z.size))

    def arriving(self, node, row) -> float:
        """Return the rate of the guard of an event, own units; ``row`` (1 + ns,) are its time and the state before."""
        e, scene = self.equations, self.scene
        T, engine, z = e.path.tables, e.kernel, self._joined(row)
        f, dw, slope = np.empty(scene.ns), np.empty(scene.nw), np.empty(z.size)
        engine.field(T, node[BEFORE], z, f)
        engine.forcing_rate(T, z, dw)
        engine.guard_gradient(T, node[BEFORE], node[GUARD], z, slope)
        return float(engine.guard_rate(slope, f, dw))

    def _joined(self, row) -> np.ndarray:
        """Return states and forcing at the time and state of ``row`` (1 + ns,)."""
        T, scene = self.equations.path.tables, self.scene
        z = np.empty(T.A.shape[2])
        z[:scene.ns] = row[1:]
        self.equations.kernel.forcing(T, row[0] * 2.0 * np.pi / T.flat[0], z)
        return z

    def kind_at(self, monitor, x) -> SpecialPointKind:
        """Return what a zero of a monitor at ``x`` is: a change of the signature has the name of what begins or ends."""
        if monitor.name == autonomous.SHRINKS and not autonomous.small(self, x):
            return SpecialPointKind.USER
        if monitor.name not in (LISTED, UNLISTED):
            return monitor.kind
        if autonomous.ends(self, monitor.name, x):
            return SpecialPointKind.CYCLE_END
        plain, at = autonomous.written_out(self, x)
        return signature_change.kind_of(plain, monitor.name, at)

    def change(self, kind, x, successor) -> SpecialPointKind | None:
        """See `Problem.change`: what changes between the two sequences has one name from both sides."""
        other = bare(successor)
        meeting = signature_change.meets_clock(self, other)
        if meeting is None or meeting:
            return None if meeting is None else SpecialPointKind.BORDER_COLLISION
        return signature_change.changed(self, x, other) or kind

    def silent(self, monitor, x) -> bool:
        """See `Problem.silent`: the difference of the halves of a doubled orbit may turn away from that at the start, and is
        measured along another direction from there on; how many impacts a chattering lists changes nothing unless it vanishes."""
        if monitor.name == CLOSURE and signature_change.fewer_chatters(self, x):
            return False
        return monitor.silent or monitor.name == MERGES and self._apart(x) > branching.SEPARATE

    def confirm(self, kind, x) -> bool:
        """Whether a zero of a monitor is what its kind says: a torus point needs a complex pair on the circle, a flip -1."""
        if kind is SpecialPointKind.NEIMARK_SACKER:
            mu = self._multipliers(x)
            return bool(np.any((np.abs(mu.imag) > 1e-7) & (np.abs(np.abs(mu) - 1.0) < 1e-6)))
        if kind is not SpecialPointKind.PERIOD_DOUBLING or self.sequence.closure < 0:
            return True
        mu = self._multipliers(x)
        near = max(FLIPS, FLIPS_OF * float(np.abs(mu).max(initial=0.0)))
        return not np.isfinite(mu).all() or float(np.abs(mu + 1.0).min(initial=np.inf)) <= near

    def locate(self, kind, a, b):
        """Return the point between two rows where a doubled orbit merges with its orbit of half the period, or where an orbit
        shrinks onto an equilibrium; or None.

        There the equations are singular; the flip of the single orbit, the Hopf point of the equilibrium, are located instead.
        """
        if kind is SpecialPointKind.HOPF:
            return autonomous.shrunk(self, a, b)
        if kind is not SpecialPointKind.PERIOD_DOUBLING or self._halves is None or branching.turned(self, a.x, b.x):
            return None
        f0, f1 = (float(np.dot(self._halves[0], row.x)) + self._halves[1] for row in (a, b))
        return branching.merging(self, a, b, f0 / (f0 - f1)) if f0 * f1 <= 0.0 else None

    def monitor_values(self, u, p, tangent) -> np.ndarray:
        """Return the values of ``monitors`` at a solution; that of the flip is NaN, `wrapped_jacobian` decides it."""
        return self._values(np.append(u, p), self._monitored(u, p), flip=False)

    def monitor_value(self, index: int, x, tangent) -> float:
        """See `Problem.monitor_value`."""
        if 0 < index <= len(self._beside):
            return monitored(self._monitored(x[:-1], x[-1]), self._beside[index - 1])
        return super().monitor_value(index, x, tangent)

    def _monitored(self, u, p) -> list:
        """Return what the kernel finds at a solution beside its equations."""
        e, (s, U), info = self.equations, self.sequence.written_out(u), np.zeros(sequence.INFO)
        e.kernel.monitor(e.numbers_at(p), s.nodes, s.fixed, s.span, e.closure, U, e.weights, info)
        return info.tolist()

    def residual(self, u, p):
        """Return the scaled residual (n,)."""
        return self.equations.residual(np.append(u, p))

    def jacobian(self, u, p):
        """Return the scaled F_u (n, n) and F_p (n,)."""
        x = np.append(u, p)
        return self.wrapped_jacobian(x, 1.0), difference(self.equations.residual, x, x.size - 1, ASIDE * self.scale[-1])

    @property
    def derived_beside(self) -> bool:
        """See `Problem.derived_beside`: a row that is divided by a duration has no derivative of its divisor, which is zero on
        orbits and noise beside births of third order."""
        return not (self.sequence.nodes[:, DIVIDE] > 0).any()

    def wrapped_jacobian(self, x, mu):
        """See `Problem.wrapped_jacobian`: of the closing node."""
        return self.equations.jacobian(x, mu)

    def null_tangent(self, x) -> np.ndarray:
        """Return a unit null vector of [F_u F_p] in scaled unknowns (n + 1,)."""
        fu, fp = self.jacobian(x[:-1], x[-1])
        return kernel(np.column_stack([fu, fp]) * self.scale, 0.0)[-1]

    # other equations

    def bounded(self, low, high, made):
        """Return the problem with its path reaching over [low, high]; ``made`` keeps the paths already widened."""
        path = self.path
        if path.low <= low and high <= path.high:
            return self
        if path not in made:
            made[path] = parameter_path(self.scene, self.system, path.name, (min(low, path.low), max(high, path.high)))
        return OrbitProblem(self.system, made[path], self._listed, self.weights, self.x0, self.parameter_scale)

    def family_over(self, name: str, bounds: tuple[float, float]):
        """Return the same equations over a second parameter, see `families`."""
        return orbit_family(self, name, bounds)

    def on_path(self, path: ParameterPath) -> "OrbitProblem":
        """Return the problem with the numbers of another path along the same parameter."""
        other = copy.copy(self)
        other.path, other.equations, other._known = path, self.equations.on(path), {}
        other._refusal = self._refusal.on(other.equations)
        return other

    def shaken(self):
        """See `Problem.shaken`."""
        return SHAKEN, tuple(tuple(partial(self._shaken, way, sign) for sign in (1, -1)) for way in (0, 1))

    def _shaken(self, way, sign):
        return self.on_path(self.path.shaken(way, sign))

    def tables_at(self, value: float):
        """Return the tables of all modes that the scene has met; those of modes met since the last step at a value of the
        parameter."""
        path = of_all_modes(self.scene, self.path)
        if path is not self.path:
            self.path, self.equations = path, self.equations.on(path)
            self._refusal = self._refusal.on(self.equations)
            self.equations.numbers_at(value)
        return path.tables

    def with_sequence(self, signature: Signature, x0) -> "OrbitProblem":
        """Return the problem of another event signature along the same path."""
        return OrbitProblem(self.system, self.path, signature, self.weights, x0, self.parameter_scale)

    def switch(self, point, monitor):
        """Return the equations that go on behind a grazing, see `orbit_switching`."""
        ends = {MERGES: StopReason.MERGED, COMPLETES: StopReason.CHATTERING}
        if self.silent(monitor, point.x) and monitor.name == MERGES:
            return self.with_sequence(self._listed, point.x), point.x, point.tangent
        if monitor.name == COMPLETES and not self._released(point.x):
            answer = signature_change.through_grazing(self, point, monitor)  # another event meets the end of the impacts
            return answer if isinstance(answer, tuple) else StopReason.CHATTERING
        if monitor.name in ends:
            return ends[monitor.name]
        if monitor.name == autonomous.SHRINKS:
            return signature_change.beyond_section(self, point)
        found = relengthened(self, point) if monitor.name == CLOSURE else None
        if found is not None:
            return found
        if not monitor.silent and signature_change.merges(self, point.x, point.tangent):
            return StopReason.MERGED
        answer = signature_change.through_grazing(self, point, monitor)
        if isinstance(answer, tuple) and signature_change.accumulates(self.sequence, answer[0]):
            return StopReason.CHATTERING
        if isinstance(answer, tuple) and signature_change.mirrors(*answer) and not signature_change.mirrors(
                self, point.x, -point.tangent):
            return StopReason.MERGED
        return answer if isinstance(answer, tuple) or not autonomous.ends(self, monitor.name, point.x) else StopReason.CYCLE_END

    def named_end(self, x, reason, message):
        """See `Problem.named_end`: where the listed impacts fall like those of a complete chattering, or where one just completes,
        changes of their number accumulate; where a contact hardly slips any more, it sticks beyond; where an orbit without a clock
        hardly moves any more, it is a state of rest."""
        if reason in (StopReason.NO_SUCCESSOR, StopReason.DS_MIN, StopReason.INADMISSIBLE):
            if self.sequence.clock and self.sequence.events and autonomous.small(self, x, autonomous.SHRINKING):
                return StopReason.SHRUNK, ""
            if self.sequence.clock and autonomous.homoclinic(self.solution(x)):
                return StopReason.HOMOCLINIC, ""
            if self._train(x) or self._completing(x):
                return StopReason.CHATTERING, message
            if self._slip(x) < STUCK or self._stands_in_the_way(x):
                return StopReason.STICKING, message
        return reason, message

    def end_point(self, x, reason):
        """See `Problem.end_point`: where a chattering just completes."""
        found = completion_near(self, x) if reason is StopReason.CHATTERING else None
        if found is None:
            return None
        problem, at, error = found
        return EndPoint(SpecialPointKind.CHATTER_COMPLETION, COMPLETES, at, error, None if problem is self else problem)

    def _completing(self, x) -> bool:
        """Whether a chattering that is complete at ``x`` (n + 1,) completes just beside."""
        if not self._chatters or self._shortest_rest(x)[1] > RESTING:
            return False
        found = completion_near(self, x)
        return found is not None and abs(float(found[1][-1] - x[-1])) <= BESIDE * self.parameter_scale

    def _shortest_rest(self, x) -> tuple[int, float]:
        """Return the last node of the complete chattering with the shortest rest behind it, and that as part of the period."""
        i, rest = self._resting(x)
        return i, rest / self.sequence.written_out(x[:-1])[0].span

    def _resting(self, x) -> tuple[int, float]:
        """Return the last node of the complete chattering with the shortest rest behind it, and that in forcing periods."""
        s, U = self.sequence.written_out(x[:-1])
        times = U[::1 + self.scene.ns]
        ends = np.flatnonzero(s.nodes[:, CLOSES] == 1)
        rests = np.diff(np.append(times, times[0] + s.span))[ends]
        return int(ends[np.argmin(rests)]), float(rests.min())

    def _slip(self, x) -> float:
        """Least share of the period for which a contact slips that also sticks, 1 without such a contact."""
        s, U = self.sequence.written_out(x[:-1])
        times = U[::1 + self.scene.ns]
        spans, keys = np.diff(np.append(times, times[0] + s.span)), [self.scene.keys[m] for m in s.nodes[:, AFTER]]
        shares = [float(spans[[word != "stick" for word in words]].sum()) / s.span for words in zip(*keys, strict=True)
                  if "stick" in words and any(word != "stick" for word in words)]
        return min(shares, default=1.0)

    def _stands_in_the_way(self, x) -> bool:
        """Whether a contact reaches at ``x`` (n + 1,) a limit at which it is all the time there, where something stands as it once
        came to: a stop touches what stands, or has moved it as far as a slider on it holds."""
        if not len(self._labels.rows):
            return False
        beside = self.correct(x + AWAY * self.scale * self.null_tangent(x), self.null_tangent(x))
        return beside.converged and bool(self._touching(x) - self._touching(beside.x))

    def _touching(self, x) -> set:
        """Return the guards (element, mode of it, number) that are zero in all of the period at ``x`` (n + 1,)."""
        e, scene, T, (s, U) = self.equations, self.scene, self.equations.numbers_at(float(x[-1])), self.sequence.written_out(x[:-1])
        times, period, found = U[::1 + scene.ns], 2.0 * np.pi / T.flat[0], []
        begins, spans = period * times, period * np.roll(since(times, s.span), -1)
        z, P, row = np.empty(T.A.shape[2]), np.empty((scene.ns, T.A.shape[2])), np.empty(T.A.shape[2])
        for i, mode in enumerate(s.nodes[:, AFTER].tolist()):
            e.motion.start_of(T, s.nodes, U, i, P, z)
            states, zero = [z, *(moved(e, T, mode, z, begins[i], part * spans[i]) for part in (0.5, 1.0))], set()
            for guard in range(int(T.n_guards[mode])):
                e.kernel.guard_gradient(T, mode, guard, z, row)
                least = TOUCHED * e.kernel.scale_of(row, e.weights)
                if all(abs(e.kernel.guard_value(T, mode, guard, state)) <= least for state in states):
                    element, number, _ = scene.guard(mode, guard)
                    zero.add((element, scene.keys[mode][element], number))
            found.append(zero)
        return set.intersection(*found)

    def _unlisted(self, x) -> float:
        """Return how long the impacts last that are not listed of the complete chattering with the shortest rest at ``x`` (n + 1,),
        forcing periods."""
        (s, U), i, T = self.sequence.written_out(x[:-1]), self._resting(x)[0], self.equations.numbers_at(float(x[-1]))
        return float(self._closing(s.nodes[i], U.reshape(len(s.nodes), -1)[i])[1] * T.flat[0]) / (2.0 * np.pi)

    def _overtaken(self, x) -> float:
        """Return the shortest rest behind a complete chattering at ``x`` (n + 1,) that is one, forcing periods: the time of impacts
        that are not listed, where the last that is turns a friction, and the event that ends the rest turns it back; 0 for others.
        """
        s, i = self.sequence.written_out(x[:-1])[0], self._resting(x)[0]
        (mode, guard), (after, event) = s.nodes[i, :AFTER].tolist(), s.nodes[(i + 1) % len(s.nodes), :AFTER].tolist()
        if event < 0 or self._released(x):
            return 0.0
        element, keys = self.scene.guard(after, event).element, self.scene.keys
        turned = element != self.scene.guard(mode, guard).element and keys[mode][element] != keys[after][element]
        return self._unlisted(x) if turned else 0.0

    def _released(self, x) -> bool:
        """Whether the shortest rest behind a complete chattering at ``x`` (n + 1,) ends in the release of that stop."""
        s, i = self.sequence.written_out(x[:-1])[0], self._shortest_rest(x)[0]
        own, (mode, guard) = s.nodes[i, :AFTER].tolist(), s.nodes[(i + 1) % len(s.nodes), :AFTER].tolist()
        if s.closure < 0 and i + 1 == len(s.nodes):
            return True
        return (guard < 0 or self.scene.event_kind(mode, guard) is EventKind.RELEASE
                and self.scene.guard(mode, guard).element == self.scene.guard(*own).element)

    def _train(self, x) -> bool:
        """Whether the last of at least three impacts of one stop in a row is slower than the first by `ACCUMULATED`; friction may
        turn between them."""
        speeds, scene, kick = listed_speeds(self, x), self.scene, self.scene.tables.kick
        impacts = [(scene.guard(int(before), int(guard)).element, speed)
                   for (before, guard), speed in zip(self.sequence.nodes[:, :AFTER], speeds, strict=True)
                   if guard >= 0 and kick[before, guard]]
        for first, (element, fastest) in enumerate(impacts):
            if not fastest < math.inf:
                continue  # of a complete chattering itself
            run = [fastest]
            for other, speed in impacts[first + 1:] + impacts[:first]:
                if other != element or not speed < 0.97 * run[-1]:
                    break
                run.append(speed)
            if len(run) >= 3 and run[-1] < ACCUMULATED * run[0]:
                return True
        return False

    def branches(self, point, n_max):
        """Return the orbits that meet this branch in a special point."""
        return branching.branches(self, point, n_max)

    def alike(self, x, near):
        """Return the orbit at ``x`` (n + 1,) moved by the whole number of forcing periods that brings it next to ``near``."""
        if self.system.period is None or self.sequence.closure < 0 or np.any(self.sequence.nodes[:, GUARD] < 0):
            return x
        shift = round(float(near[0] - x[0]))
        if shift == 0:
            return x
        moved = x.copy()
        moved[:-1:1 + self.scene.ns] += shift
        return moved

    def same(self, other) -> bool:
        """Whether two problems have the same equations."""
        return self.sequence.key == other.sequence.key

    # what is shown and stored

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns on demand."""
        each = [worded(f"{name}_{i}", self.states) for i in range(self.system.measured) for name in ("max", "min", "rms", "h1")]
        count = self.scene.ns - len(self._labels.places) - (self.sequence.clock > 0.0)
        return (*each, "period", "n_events", "stable", *(f"multiplier_{k}" for k in range(count)))

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs`` (m, n + 1)."""
        if name == "n_events":
            return np.full(len(xs), self.sequence.events * (2 if self.sequence.closure < 0 else 1))
        if name == "period":
            return np.array([self._whole(x)[0].span * 2.0 * np.pi / self.equations.numbers_at(x[-1]).flat[0] for x in xs])
        if name == "stable":
            told = [self._stable(x) for x in xs]
            return np.array(told, object if None in told else bool)
        if name.startswith("multiplier_"):
            return np.array([self._told(x)[int(name[11:])] for x in xs])
        kind, dof = by_number(name, self.states).rsplit("_", 1)
        rows = np.array([self._measured(x, int(dof)) for x in xs])
        return {"max": lambda: rows[:, 0], "min": lambda: rows[:, 1], "rms": lambda: np.sqrt(rows[:, 2]),
                "h1": lambda: np.hypot(rows[:, 3], rows[:, 4])}[kind]()

    def measure_gradient(self, name, x):
        """Return the gradient (n + 1,) of the largest or least displacement; None for other measures: they are differenced."""
        kind, _, dof = name.rpartition("_")
        if kind not in ("max", "min") or self.scene.n == 0:
            return None
        return extreme_gradient(self, x, int(dof), 1.0 if kind == "max" else -1.0)

    def _whole(self, x):
        return repeated(self.scene, self.sequence, x[:-1])

    def _measured(self, x, dof) -> np.ndarray:
        whole, U = self._whole(x)
        out = np.empty(5)
        h = 1.0 / whole.span if whole.clock else 1.0
        self.equations.motion.measures(self.equations.numbers_at(x[-1]), whole.nodes, whole.span, U, dof, h, out)
        return out

    def multipliers_at(self, x) -> np.ndarray:
        """Return the multipliers at a solution, as those of `PeriodicOrbit`."""
        return self._multipliers(x)

    def repeated(self, x, times: int = 2):
        """Return the equations of the orbit run through several times, and their solution."""
        s = self.sequence
        rows = np.tile(x[:-1].reshape(len(s.nodes), -1), (times, 1))
        later = np.repeat(s.span * np.arange(times), len(s.nodes))
        rows[:, 0] += later
        start = np.append(rows.ravel(), x[-1])
        signature = Signature(np.tile(s.nodes, (times, 1)), np.tile(s.fixed, times) + later, times * s.span)
        return self.with_sequence(signature, start), start

    def _multipliers(self, x) -> np.ndarray:
        key = np.asarray(x, float).tobytes()
        if key not in self._known:
            whole, U = self._whole(x)
            s, half = self.sequence.written_out(x[:-1])
            M = self._flow(x, s, half) if s.closure < 0 else self._flow(x, whole, U)
            M = M @ M if s.closure < 0 else M  # over the other half it is the same
            if len(self._known) >= KNOWN:
                self._known.clear()
            self._known[key] = nontrivial(self.equations, whole, U, M, self._labels)
        return self._known[key].copy()

    def is_motion(self, x) -> bool:
        """See `Problem.is_motion`."""
        orbit = self.solution(x)
        return orbit.success and repetition(orbit).repeated

    def floquet_multipliers(self, x):
        """See `Problem.floquet_multipliers`; None where two impacts of one instant leave them undefined."""
        return None if self._together(x) else self._multipliers(x)

    def followed_multipliers(self, x):
        """See `Problem.followed_multipliers`."""
        return self.floquet_multipliers(x) if self._linear is None else self._linear.without_angles(float(x[-1]))

    def half_multipliers(self, x):
        """See `Problem.half_multipliers`.

        The equations may be solved on half a period.  A solution can also be its own mirror image though a part that it does not
        reach, as a stop on one side, breaks the symmetry of the system: then the flow over both halves is the same.
        """
        s, U = self.sequence.written_out(x[:-1])
        if s.closure < 0:
            return nontrivial(self.equations, s, U, -self._flow(x, s, U), self._labels)
        rows, count = U.reshape(len(s.nodes), -1), len(s.nodes) // 2
        if s.clock or count == 0 or len(s.nodes) % 2 or round(s.span) % 2 == 0:
            return None
        first, second = rows[:count], rows[count:]
        late, apart = second[:, 0] - first[:, 0] - 0.5 * s.span, (second[:, 1:] + first[:, 1:]) / self.weights
        if not np.abs(late).max() + np.abs(apart).max() < MIRRORED:
            return None
        halves = [Signature(nodes, s.fixed[:count], 0.5 * s.span) for nodes in (s.nodes[:count], s.nodes[count:])]
        here, there = (self._flow(x, half, part.ravel()) for half, part in zip(halves, (first, second), strict=True))
        if np.isfinite(here).all() and not np.abs(here - there).max() <= SAME_FLOW * np.abs(here).max():
            return None
        return nontrivial(self.equations, halves[0], first.ravel(), -here, self._labels)

    def _flow(self, x, signature, U) -> np.ndarray:
        """Derivative (ns, ns) of the flow over the span of a signature with the unknowns ``U``."""
        M = np.empty((self.scene.ns, self.scene.ns))
        self.equations.motion.monodromy(self.equations.numbers_at(x[-1]), signature.nodes, signature.span, U, M)
        return M

    def _together(self, x) -> bool:
        """Whether two impacts of different stops fall on one instant: then only the orbit tells its multipliers."""
        whole, U = self._whole(x)
        nodes, times = whole.nodes, U[::1 + self.scene.ns]
        apart = np.abs(times - np.append(times[-1] - whole.span, times[:-1])) <= INSTANT
        kick = [node[GUARD] >= 0 and bool(self.scene.tables.kick[node[BEFORE], node[GUARD]]) for node in nodes]
        return len(nodes) > 1 and any(near and a and b for near, a, b in zip(apart, kick, [kick[-1], *kick[:-1]], strict=True))

    def _told(self, x) -> np.ndarray:
        """Multipliers as the orbit at ``x`` tells them."""
        return self.solution(x).multipliers if self._together(x) else self._multipliers(x)

    def _stable(self, x) -> bool | None:
        """Stability as the orbit at ``x`` tells it."""
        return self.solution(x).stable if self._together(x) or self.sequence.clock else attracting(self._multipliers(x))

    def solution(self, x) -> PeriodicOrbit:
        """Return the orbit at ``x`` (n + 1,); a parameter beyond the end of its path by rounding is put onto it."""
        value, room = float(x[-1]), ROUNDING * self.parameter_scale
        if self.path.low - room <= value <= self.path.high + room:
            value = min(max(value, self.path.low), self.path.high)
        middle = 0.5 * (self.path.low + self.path.high)
        system = beside(self.system, self.parameter, value, float(self.x0[-1]) if self.x0[-1] != value else middle)
        return PeriodicOrbit(system, self._listed, x[:-1], self.weights, {"method": "event sequence", "parameter": self.parameter})

    def motion(self, x) -> PeriodicOrbit:
        """Return the orbit at ``x`` (n + 1,) with the numbers that the branch itself has there, exact to rounding: to be looked at
        once, and not handed out."""
        orbit = self.solution(x)
        if not self.sequence.clock:
            self.tables_at(x[-1])
            tables = copy.deepcopy(self.equations.numbers_at(x[-1]))
            give_modal(tables)
            given(orbit.system, tables)
            orbit.equations, orbit._earlier = self.equations.on(fixed_path(tables)), self._earlier
        return orbit

    def __reduce_ex__(self, protocol):
        return OrbitProblem.from_record, (self.to_record(), user_parts(self.system))  # what is compiled does not travel

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        s = self._listed
        return {"kind": "orbit", "system": numbered(self.system), "parameter": self.parameter,
                "path": [self.path.low, self.path.high], "nodes": s.nodes.tolist(), "fixed": s.fixed.tolist(), "span": s.span,
                "closure": s.closure, "clock": s.clock, "weights": self.weights.tolist(), "parameter_scale": self.parameter_scale,
                "x0": self.x0.tolist()}

    @classmethod
    def from_record(cls, record: dict, elements=()) -> "OrbitProblem":
        """Make the problem that gave ``record``."""
        system = System.from_record(record["system"], elements)
        signature = Signature(np.array(record["nodes"], np.int64), np.array(record["fixed"]), record["span"], record["closure"],
                              record.get("clock", 0.0))
        path = parameter_path(scene_of(system), system, record["parameter"], tuple(record["path"]), pad=0.0)
        return cls(system, path, signature, np.array(record["weights"]), np.array(record["x0"]), record["parameter_scale"])
