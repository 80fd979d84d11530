"""Harmonic orbits as a continuation problem: one compiled call a step, changes of the order of events as special points.

One file, because it is one class: residual, monitors, measures and hooks of a branch share its layout and its numbers.
"""
import copy
import functools
import math
from dataclasses import dataclass

import numpy as np

from ...elements import EventKind
from ...hbm import corrector
from ...hbm.balance import Balance
from ...hbm.condensation.condensed import Condensed
from ...hbm.contacts.margins import FIELDS, KINDS, MISS, OVERSHOOT
from ...hbm.corrector import INFO, UNSEEN, watched
from ...hbm.floquet.stability import multipliers_along
from ...hbm.measures import measure_gradient
from ...hbm.parts import event_kind
from ...hbm.residual import events_of, kept, order_of
from ...hbm.status import ContactStatus
from ...hbm.tables import Series, numbers_at
from ...orbits.balance.harmonic_orbit import HarmonicOrbit, largest
from ...orbits.balance.method import HarmonicBalance
from ...orbits.multipliers import attracting
from ...orbits.shooting.path import DEGREES, PAD, sampled_over
from ...solve.bordered import across
from ...solve.interrupts import MANY, interruptible, spoil
from ...solve.steprun import MADE, SIZE, TOLD, run_of
from ...solve.zeros import BOX
from ...system import require_values
from ..families import PathFamily
from ..kinds import NUMERICAL, CorrectorStatus, SpecialPointKind
from ..problem import NO_MONITORS, ROUNDED, Corrected, Monitor, Problem
from ..steps.roots import root_of
from ..steps.rows import followed

BIRTH, DEATH = "birth", "death"
AHEAD = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # arclengths behind a boundary at which the new order of events is read
BESIDE = 1e-5  # arclength behind a boundary at which the new order must hold
LENGTHS = BESIDE, 1e-4, 1e-3  # the same of sampled contacts, of which it may hold only a little later
CLEARLY = 1e-3  # of a shorter arclength: margins beyond that are not those of rounding
POINT = {EventKind.SLIP: SpecialPointKind.SLIP_ONSET, EventKind.STICK: SpecialPointKind.STICK_ONSET,
         EventKind.CONTACT: SpecialPointKind.GRAZING, EventKind.SEPARATION: SpecialPointKind.SEPARATION}
CORNER = 4.0  # most of these parts, seen


@dataclass(frozen=True, eq=False)
class BalancePath:
    """Numbers of the parts along a parameter: those that change, as Chebyshev series on [low, high]; see `orbits.shooting.path`."""

    base: np.ndarray
    name: str
    index: np.ndarray
    series: np.ndarray
    low: float
    high: float

    @property
    def numbers(self) -> Series:
        """The same for kernels."""
        return Series(self.base, self.index, self.series, self.low, self.high)


def path_over(balance: Balance, name: str, bounds, pad: float | None = None) -> BalancePath:
    """Return the numbers of a balance along a parameter."""
    parts, degrees = balance.parts, (2, *DEGREES)  # forces and frequencies: two more samples are half of its time
    index, series, low, high = sampled_over(parts.sampled, balance.system, name, bounds, parts.flat_of,
                                            PAD if pad is None else pad, degrees)
    return BalancePath(balance.parts.flat.copy(), name, index, series, low, high)


class BalanceProblem(Problem):
    """Harmonic balance along one parameter.

    The problem keeps the number of events of each contact that it starts with and goes on smoothly, a little, beyond the
    point where that changes: where a pair of events is born or dies lies a special point (slip_onset, stick_onset, grazing,
    separation by its kind), and the branch, which may have a corner there, goes on with a problem for the new number.

    Parameters
    ----------
    balance : Balance
    method : HarmonicBalance
    path : BalancePath
    x0 : ndarray (n + 1,)
        Coefficients of the start and the parameter.
    scale : ndarray (n + 1,)
        Natural sizes.
    listed : ndarray (contacts,), optional
        Events of each contact; default those at ``x0``.

    Attributes
    ----------
    whole : Balance
        Of all coordinates; here the balance itself, see `condensed_problem`.
    """

    whole: Balance

    truncates = True
    errors = NUMERICAL
    exact_tangent = True  # the derivative in the parameter is exact, see `numbers_at`
    monitors_read_tangent = False
    smooth_boundaries = True  # the equations are the same on both sides
    same_tangent = 1.0 - 1e-5  # one-sided tangents are known: on a corner itself the corrector may take the other one

    def __init__(self, balance: Balance, method: HarmonicBalance, path: BalancePath, x0, scale, listed=None):
        self.balance, self.method, self.path = balance, method, path
        self.whole = balance
        self.system, self.layout = balance.system, balance.layout
        self.parameter = path.name
        self.size = balance.size
        self.scale = np.array(scale, float)
        self.x0 = np.array(x0, float)
        # a sampled event that passes a sample turns the branch by a part of the distance of samples
        self.corner = CORNER * 2.0 * math.pi / balance.samples if balance.samples and len(balance.contacts) else 0.0
        self._info, self._events = np.zeros(INFO), np.zeros((KINDS, FIELDS))
        self._law, self._size_log = bool(balance.parts.laws), 0.0
        self.follows = not self._law  # what is sampled in Python is looked up in every step
        self._multipliers: tuple[bytes, BalancePath, np.ndarray | None] | None = None
        self._flat, self._dflat = np.empty_like(path.base), np.empty_like(path.base)
        shape = balance.parts.shape
        kinds = sorted({int(shape.kinds[k, m, g]) for k in range(len(shape.modes)) for m in range(int(shape.modes[k]))
                        for g in range(int(shape.guards[k, m])) if not shape.silent[k, m, g]})
        self._kinds = np.array([kind for kind in kinds if tuple(EventKind)[kind] in POINT], np.int64)
        self.monitors = tuple(Monitor(POINT[tuple(EventKind)[kind]], name, boundary=True)
                              for kind in self._kinds.tolist() for name in (BIRTH, DEATH))
        self.listed = np.array(listed, np.int64) if listed is not None else self._counted(self.x0)
        self.signature = self._words()

    # equations

    def numbers(self, p: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of the system at ``p`` and their derivatives; overwritten by the next call."""
        numbers_at(self.path.numbers, float(p), self._flat, self._dflat)
        return self._flat, self._dflat

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`; one compiled call where no law is sampled."""
        if self._law:
            return self._in_order(super().correct(x, tangent, fixed))
        found = self._found()
        x = np.ascontiguousarray(x, float)
        status = self._heard((found.x,), corrector.correct, corrector.Place(x, x, tangent), fixed, found, False)
        return self._corrected(tangent, status, found)

    def _heard(self, read, kernel, *given):
        """Return what a compiled corrector does; a signal may end it, by NaN in the arrays ``read``."""
        return interruptible(self.size >= MANY, functools.partial(spoil, read), kernel, self._equations(), *given)

    def _found(self) -> corrector.Found:
        """Return arrays for what `hbm.corrector` finds; the last two are overwritten by the next call."""
        return corrector.Found(np.empty(self.size + 1), np.empty(self.size + 1), self._info, self._events)

    def _equations(self) -> corrector.Equations:
        """Return what `hbm.corrector` corrects."""
        balance, parts = self.balance, self.balance.parts
        return corrector.Equations(parts.structure, parts.shape.R, self.path.numbers, balance.grid, self.listed, balance.room,
                                   self.scale)

    def _corrected(self, tangent, status, found) -> Corrected:
        """Return what `hbm.corrector` found."""
        point, new = found.x, found.new
        count, residual, contraction, distance, sign, log, _ = self._info.tolist()
        if status != corrector.CONVERGED:
            failed = {corrector.NOT_CONVERGED: CorrectorStatus.NOT_CONVERGED, corrector.SINGULAR: CorrectorStatus.SINGULAR,
                      corrector.OTHER_ORDER: CorrectorStatus.INADMISSIBLE}
            return self._failed(point, tangent, failed.get(status, CorrectorStatus.NOT_FINITE), int(count), residual)
        why = CorrectorStatus.CONVERGED if sign else CorrectorStatus.SINGULAR
        return Corrected(point, new, True, why, int(count), residual, distance, contraction, sign, log, self._values())

    def follow(self, before, row, signs, sizes, ds, most, limits, origin):
        """See `Problem.follow`; one compiled call."""
        if not (row.det_sign and before.det_sign and all(signs)):
            return [], None
        boundary = [self.touch] * len(self.monitors)
        tests = np.array([before.tests, row.tests, signs, sizes, [-1.0, *boundary]])
        run = run_of(before, row, ds, limits, origin, self.corner)
        rows = np.empty((most, 2 * row.x.size + tests.shape[1] + TOLD))
        steps = corrector.Run(np.array([before.x, before.tangent]), self._kinds, run, tests, rows)
        found = self._found()
        status = self._heard((found.x, run), corrector.follow, row.x, row.tangent, found, steps)
        made = followed(row, rows[:int(run[MADE])], tuple(signs))
        sizes[:] = tests[SIZE].tolist()
        # what fails from a guess ahead is tried again from the tangent
        return made, self._corrected(row.tangent, status, found) if status == corrector.CONVERGED else None

    def zero(self, curve, test, ends, guess):
        """See `Problem.zero`; one compiled call."""
        if not self.follows:
            return None
        hermite, box, found = np.array([curve.xa, curve.chord, curve.da, curve.db]), np.zeros(BOX), self._found()
        place = (int(self._kinds[(test - 1) // 2]), OVERSHOOT if (test - 1) % 2 else MISS) if test else (-1, 0)
        ends = (*ends, math.nan if guess is None else guess)
        if not self._heard((found.x, hermite), corrector.locate, hermite, ends, place, found, box):
            return (None,)
        return (root_of(box, self._corrected(found.new, corrector.CONVERGED, found)),)

    def _in_order(self, found: Corrected) -> Corrected:
        """Return what the general corrector found as `hbm.corrector` does: determinants of rows of unit size, no other order."""
        found.det_log -= self._size_log
        room = self.balance.room
        if found.converged and not kept(self.listed, room.sources, room.counts):
            found.converged, found.status = False, CorrectorStatus.INADMISSIBLE
        return found

    def _linearised(self, x):
        """See `Problem._linearised`; residual and derivatives in one go, for balances with laws."""
        status, f, wide = self.balance.linearised(x[:-1], *self.numbers(x[-1]), listed=self.listed)
        if status is not ContactStatus.FOLLOWED:
            f = np.full(self.size, np.nan)
        self._size_log = float(np.log(np.abs(wide * self.scale).max(axis=1) + 1e-300).sum())
        return f.copy(), wide, 2.220446049250313e-16 * (np.abs(wide) @ np.abs(x))

    def residual(self, u, p):
        """Return the residual (n,), force."""
        status, f, _ = self.balance.linearised(u, *self.numbers(p), slopes=False, listed=self.listed)
        return f.copy() if status is ContactStatus.FOLLOWED else np.full(self.size, np.nan)

    def jacobian(self, u, p):
        """Return F_u (n, n) and F_p (n,), exact."""
        status, _, wide = self.balance.linearised(u, *self.numbers(p), listed=self.listed)
        wide = wide.copy() if status is ContactStatus.FOLLOWED else np.full_like(wide, np.nan)
        return wide[:, :-1], wide[:, -1]

    # order of events

    def monitor_values(self, u, p, tangent):
        """Return the values of ``monitors`` at a solution."""
        if not len(self._kinds):
            return NO_MONITORS
        self._margins(np.append(u, p), self.listed)
        return self._values()

    def _margins(self, x, listed) -> None:
        flat, dflat = self.numbers(x[-1])
        u = np.ascontiguousarray(x[:self.layout.size])
        status, _, _ = self.balance.linearised(u, flat, dflat, slopes=False, listed=listed)
        if status is not ContactStatus.FOLLOWED:
            raise ValueError(status.sentence)
        parts = self.balance.parts
        watched(parts.structure, flat, self.balance.grid, self.balance.room, self._events)

    def leaves(self, a, b) -> float:
        """See `Problem.leaves`: where other events are followed than at the row before, there may be more of them in between."""
        if not len(self.listed):
            return -1.0
        balance, parts, size = self.balance, self.balance.parts, self.layout.size
        points = np.array([a.x[:size], b.x[:size]])
        numbers = np.array([self.numbers(a.p)[0].copy(), self.numbers(b.p)[0]])
        found = corrector.exchanged(parts.structure, parts.shape.R, balance.grid, self.listed, balance.room, points, numbers)
        return 0.5 if found else -1.0

    def _counted(self, x) -> np.ndarray:
        """Return the order of events at ``x``, as they come, see `hbm.residual.order_of`."""
        if not len(self.balance.contacts):
            return np.zeros(0, np.int64)
        self._margins(np.asarray(x, float), None)
        return order_of(self.balance.room)

    def _values(self) -> np.ndarray:
        """Return the monitors: for each kind the largest near miss, and minus the least overshoot; both negative inside."""
        if not len(self._kinds):
            return NO_MONITORS
        events = self._events.tolist()
        return np.array([max(value, UNSEEN) for kind in self._kinds.tolist() for value in (events[kind][2], -events[kind][1])])

    def _words(self) -> str:
        """Return how many events a period has."""
        return f"{events_of(self.listed)} events" if len(self.listed) else ""

    def switch(self, point, monitor):
        """Return the problem for the number of events behind a boundary."""
        found = None
        for ahead in AHEAD:
            behind = point.x + ahead * self.scale * point.tangent
            listed = self._counted(behind)
            if np.array_equal(listed, self.listed) and (found or ahead < AHEAD[-1]):
                continue
            other = self.with_order(listed)
            other.x0 = point.x.copy()
            tangent, holds = other._inward(point, behind, ahead)
            if holds:
                return other, point.x, tangent
            beside = other._clear_of_samples(point, tangent, ahead)
            if beside is not None:
                return other, beside.x, beside.tangent
            found = found or (other, point.x, tangent)  # so near, rounding may have made it
        return found

    def change(self, kind, x, successor) -> SpecialPointKind:
        """See `Problem.change`: a surface in space is grazed from either side, and a contact that its load opens or ends is a
        separation, as branches of `OrbitProblem` have it."""
        if kind not in (SpecialPointKind.GRAZING, SpecialPointKind.SEPARATION):
            return kind
        changed = np.flatnonzero(self.listed != successor.listed)
        surfaces = {self._are_surfaces(k) for k in (changed.tolist() or range(len(self.listed)))} - {None}
        if len(surfaces) != 1:
            return kind
        return SpecialPointKind.GRAZING if surfaces == {True} else SpecialPointKind.SEPARATION

    def _are_surfaces(self, contact) -> bool | None:
        """Return whether contact and separation of a contact are surfaces in space: by positions alone; None without any."""
        parts = self.balance.parts
        numbers, guards = parts.numbers, parts.shape.guards[contact]
        found = [(m, g) for m, count in enumerate(guards) for g in range(count)
                 if event_kind(parts.shape, contact, m, g) in (EventKind.CONTACT, EventKind.SEPARATION)]
        if not found:
            return None
        return all(numbers.GU[contact, m, g].any() and not numbers.GS[contact, m, g].any() and not numbers.GZ[contact, m, g].any()
                   for m, g in found)

    def _inward(self, point, behind, ahead=BESIDE) -> tuple[np.ndarray, bool]:
        """Return the tangent at a point of the boundary of this order of events that leads to where it holds, and whether it does.

        At the point itself rounding decides from which side the Jacobian is taken: the one of this order is that at
        ``behind`` (n + 1,), where its events are clearly there.  The branch may turn back in its corner: it goes on where the
        new order holds, not where the old one came from.  The Jacobians of two orders differ by one rank, so that the sign of
        the bordered determinant says which way that is; of several changes at one point too, as the degree of the map is kept.
        Behind a graze it may turn within less than `BESIDE`: then its order holds next to the place ``ahead`` where the tangent
        is taken, and a margin is seen there that grows from zero.
        """
        tangent, det_sign = self._null_vector(behind)
        if not det_sign:
            return point.tangent, False
        way = 1.0 if det_sign * point.det_sign > 0.0 else -1.0
        inside = (BESIDE, -math.inf, 0.0), (ahead, UNSEEN, -CLEARLY * ahead)
        for near, low, high in inside[:2 if ahead < BESIDE else 1]:
            beside = self.correct(point.x + way * near * self.scale * tangent, way * tangent)
            if beside.converged and low < beside.monitors.max(initial=-1.0) < high:
                return way * tangent, True
        return way * tangent, False

    def _clear_of_samples(self, point, tangent, ahead) -> Corrected | None:
        """Return the point of this order of events ``ahead`` of one on its boundary where it holds, of contacts that are sampled.

        The last near miss and the first overshoot are told by different samples: between the two no order holds by its margins.
        """
        if not self.balance.samples:
            return None
        beside = self.correct(point.x + ahead * self.scale * tangent, tangent)
        clear = beside.converged and UNSEEN < beside.monitors.max(initial=-1.0) < -CLEARLY * ahead
        return beside if clear and np.array_equal(self._counted(beside.x), self.listed) else None

    def beyond_corner(self, row):
        """See `Problem.beyond_corner`: sampled contacts make a corner wherever an event passes a sample, and events may be born at
        a sample before the near miss between samples, of which the monitors know, has come to zero.

        As at a boundary, the Jacobian is that of the piece behind the corner, and the sign of its bordered determinant says
        which of its two directions goes on.
        """
        for ahead in AHEAD:
            behind = row.x + ahead * row.direction
            other = self.with_order(self._counted(behind))
            tangent, det_sign = other._null_vector(behind)
            smooth = np.array_equal(other.listed, self.listed) and abs(float(tangent @ row.tangent)) > self.same_tangent
            if not det_sign or smooth:
                continue
            if det_sign * row.det_sign < 0.0:
                tangent = -tangent
            for length in LENGTHS if self.balance.samples else LENGTHS[:1]:
                beside = other.correct(row.x + length * self.scale * tangent, tangent)
                if beside.converged and beside.monitors.max(initial=-1.0) < 0.0 \
                        and np.array_equal(other._counted(beside.x), other.listed):
                    return other, tangent, length
        return None

    def _null_vector(self, x) -> tuple[np.ndarray, float]:
        """Return the tangent (n + 1,) at ``x``, which need not solve the equations, and the sign of the bordered determinant."""
        wide = self.wide_jacobian(x) * self.scale
        if not np.isfinite(wide).all():
            return np.zeros(self.size + 1), 0.0
        right, sign = across(wide)
        return right, sign * self._rest_sign(x[-1])

    def _rest_sign(self, p) -> float:
        """Return the sign of the determinant of what is not among the unknowns."""
        return 1.0

    def test_uncertainty(self, found: Corrected) -> float:
        """See `Problem.test_uncertainty`: margins are parts of the size of a guard."""
        return ROUNDED

    def order_at(self, x) -> np.ndarray:
        """Return the number of events of each contact at ``x`` (n + 1,), as they come."""
        return self._counted(x)

    def with_order(self, listed) -> "BalanceProblem":
        """Return the problem for another number of events of each contact."""
        other = copy.copy(self)
        other.listed = np.array(listed, np.int64)
        other.signature = other._words()
        return other

    def on_layout(self, method, layout, orbits, values, bounds):
        """Yield pairs (problem, `Corrected`) of balances on another layout: the points beside ``orbits``, rows of a branch in
        order, in the planes across the way from each to the next; ``values`` (m,) are their parameters, within ``bounds``."""
        balance = method.balance(self.system, layout)
        path = path_over(balance, self.parameter, bounds)
        sizes = np.append(np.full(balance.size, float(self.scale[0])), float(self.scale[-1]))
        points = np.array([np.append(orbit.layout.moved(orbit.coefficients, layout), p)
                           for orbit, p in zip(orbits, values, strict=True)])
        for k, x in enumerate(points):
            made = BalanceProblem(balance, method, path, x, sizes)
            tangent = made._null_vector(x)[0]
            way = (points[min(k + 1, len(points) - 1)] - points[max(k - 1, 0)]) / sizes
            yield made, made.correct(x, tangent if float(tangent @ way) >= 0.0 else -tangent)

    def same(self, other) -> bool:
        """Whether two problems have the same equations and order of events."""
        return (isinstance(other, BalanceProblem) and self.layout == other.layout and self.parameter == other.parameter
                and np.array_equal(self.listed, other.listed))

    # other numbers

    def bounded(self, low, high, made):
        """Return the problem with its path reaching over [low, high]; ``made`` keeps the paths already widened."""
        path = self.path
        if path.low <= low and high <= path.high:
            return self
        if path not in made:
            made[path] = path_over(self.whole, path.name, (min(low, path.low), max(high, path.high)))
        return self.on_path(made[path])

    def on_path(self, path) -> "BalanceProblem":
        """Return the problem with the numbers of another path along the same parameter."""
        other = copy.copy(self)
        other.path = path
        return other

    def family_over(self, name: str, bounds: tuple[float, float]):
        """Return the same equations over a second parameter, see `families`."""
        name = self.system.parameter_name(name)
        value = self.system.parameter(name)
        if name == self.parameter:
            raise ValueError(f"the two parameters must differ, got {name!r} twice")
        low, high = bounds
        if not (math.isfinite(low) and math.isfinite(high)):
            raise ValueError(f"bounds of {name!r} must be finite, got {bounds!r}")
        require_values(self.system, "bounds", name, bounds)

        def sample(a, b):
            return self.whole.parts.flat_of(self.system.with_parameters(**{self.parameter: float(a), name: float(b)}))

        base = self.path.base

        def make(index, series, a, b):
            return BalancePath(base, self.parameter, index, series, a, b)
        return PathFamily(self, name, value, 0.5 * (high - low), sample, bounds, make)

    # what is shown and stored

    def motions(self, xs) -> np.ndarray:
        """Return the packed coefficients of all coordinates (m, whole.size) for rows ``xs`` (m, n + 1)."""
        return np.asarray(xs)[:, :-1]

    def whole_numbers(self, p: float) -> np.ndarray:
        """Return the numbers of the whole balance at ``p``; overwritten by the next call."""
        return self.numbers(p)[0]

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns on demand."""
        n = self.whole.layout.n
        memory = sum(len(element.memory) for element in self.system.elements)
        each = [f"{name}_{i}" for i in range(n) for name in ("max", "min", "rms", "h1")]
        return (*each, "period", "n_events", "stable", *(f"multiplier_{k}" for k in range(2 * n + memory)))

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs`` (m, n + 1)."""
        if name == "n_events":
            return np.full(len(xs), events_of(self.listed))
        if name == "period":
            return np.array([2.0 * np.pi / self.numbers(x[-1])[0][0] for x in xs])
        if name == "stable" or name.startswith("multiplier_"):
            return self._stability(name, xs)
        kind, dof = name.rsplit("_", 1)
        layout, dof = self.whole.layout, int(dof)
        q = self.motions(xs).reshape(len(xs), layout.slots, layout.n)[:, :, dof]
        if kind == "h1":
            first = layout.slot(layout.periods) if layout.periods in layout.harmonics else None
            return np.zeros(len(xs)) if first is None else np.hypot(q[:, first], q[:, first + 1])
        if kind == "rms":
            return np.sqrt(q * q @ np.where(layout.waves == 0, 1.0, 0.5))
        sign = 1.0 if kind == "max" else -1.0
        return sign * np.array([largest(layout, sign * row) for row in q])

    def measures_as(self, other, name) -> bool:
        """See `Problem.measures_as`: problems of a branch differ in the order of events alone."""
        return (isinstance(other, BalanceProblem) and other.balance is self.balance and other.path is self.path
                and name != "n_events")

    def measure_gradient(self, name, x):
        """Return the gradient (n + 1,) of a measure, in closed form; None for measures that are no amplitude."""
        made = measure_gradient(self.layout, name, x[:-1])
        return None if made is None else np.append(made, 0.0)

    def multipliers_of_rows(self, xs):
        """See `Problem.multipliers_of_rows`."""
        xs = np.ascontiguousarray(xs, float)
        if len(xs) == 1:
            return multipliers_along(self, xs)
        key = xs.tobytes()
        if self._multipliers is None or self._multipliers[:2] != (key, self.path):  # all columns of a table ask for the same
            self._multipliers = key, self.path, multipliers_along(self, xs)
        return self._multipliers[2]

    def _stability(self, name, xs):
        """Return a column of multipliers, or of stability as orbits tell it: None on the unit circle and where it is not known."""
        mu = self.multipliers_of_rows(xs)
        if name == "stable":
            told = [None] * len(xs) if mu is None else [attracting(row) if np.isfinite(row).all() else None for row in mu]
            return np.array(told, object if None in told else bool)
        if mu is None:
            return np.full(len(xs), np.nan)
        k = int(name[11:])
        return mu[:, k].copy() if k < mu.shape[1] else np.zeros(len(xs), complex)

    def solution(self, x) -> HarmonicOrbit:
        """Return the orbit at ``x`` (n + 1,)."""
        system, layout = self.system.with_parameters(**{self.parameter: float(x[-1])}), self.whole.layout
        harmonics = [k / layout.periods for k in layout.harmonics]
        how: dict[str, object] = {"method": "harmonic balance, newton", "harmonics": harmonics, "aft": self.method.aft,
                                  "parameter": self.parameter, **self._how()}
        if self._law:
            how["law samples"] = self.balance.law_samples
        return HarmonicOrbit(system, self.method, layout, self.motions(x[None])[0], how, None, self.whole.at(system), self._like())

    def _how(self) -> dict[str, object]:
        """Return what more an orbit says of how it was found."""
        return {}

    def _like(self) -> Condensed | None:
        """Return what an orbit shares of its linear part."""
        return None

    @functools.cached_property
    def memory(self) -> int:
        """Number of memory states."""
        return sum(len(element.memory) for element in self.system.elements)

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        return {"kind": "balance", "system": self.system.to_record(), "parameter": self.parameter,
                "path": [self.path.low, self.path.high], "method": self.method.to_record(),
                "harmonics": list(self.layout.harmonics), "periods": self.layout.periods, "samples": self.balance.samples,
                "condensed": self.whole is not self.balance,
                "law_samples": self.balance.law_samples, "listed": self.listed.tolist(), "scale": self.scale.tolist(),
                "x0": self.x0.tolist()}
