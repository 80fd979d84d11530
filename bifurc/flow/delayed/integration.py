"""Integrate a system with delayed feedback: collocated pieces that end at events, and wherever an event was one delay ago.

The method of steps (Bellman 1963), with breaking points: an event at t leaves a corner or a jump in the feedback at t + tau,
a weaker one at t + 2 tau, and so on (Baker, Paul, Wille 1995).  Near a periodic orbit the piece between an impact and the
delayed impact is as short as the distance from the orbit; it carries the impulse of the feedback and is never dropped.
Collocation is in the integrated form, whose rows do not grow as a piece shrinks.

One file, because it is one integration: pieces, breaking points and events share its past.
"""
import heapq
import math

import numpy as np

from ...compose.scene import Scene, scene_of
from ...compose.tables import rebuild
from ...compose.writer import kernels
from ...elements import ConstantForce, DelayedFeedback, LinearSpring
from ...system import System
from .. import settle
from ..status import Status
from ..trajectory import Event
from .history import COUNT, History, collocation, interpolation, points
from .motion import DelayedMotion

AGES = 4  # times that a breaking point is carried on: the derivative that then jumps is of order AGES or higher
ANGLE = 1.0  # largest scaled angle of a piece
ITERATIONS = 40
CLOSED = 4e-15  # relative change of the last iteration under a law
SAME = 4e-16  # relative distance of times that are one
CORRECTIONS, NEAR = 4, 1e-3  # of an event's time on a curve, and their largest size, of a step
ON_SURFACE = 64 * 2.2e-16  # of the sizes of its terms: a guard so small at the start of a piece is zero there
ORDERS = 3  # rates of a guard that may vanish with it at the start of a piece
SHARE = 1e-9  # of the terms of a guard's unknown rate: what rounding may hide of it at most, however short a piece is


def integrate(system: System, y0: np.ndarray, start: float, stop: float, history=None, breaks=(),
              max_events: int = 2000, watch=None) -> DelayedMotion:
    """Return the motion of a system with `DelayedFeedback` of one delay from ``y0`` (ns,) at ``start``.

    Parameters
    ----------
    history : callable or None
        States (k, ns) at times (k,) before the start; None: the feedback begins one delay after it.
    breaks : sequence of float
        Times of the events of that history.
    watch : callable, optional
        ``watch(state) -> bool`` at the whole periods of a forced system; true ends the motion there.
    """
    return _Integration(system, start, history, breaks).run(np.array(y0, float), stop, max_events, watch)


def without_feedback(system: System) -> System:
    """Return the system without its delayed feedback, as a hand-made one."""
    kept = [element for element in system.elements if not isinstance(element, DelayedFeedback)]
    return System(system.mass, system.damping, system.stiffness, kept, omega=system.omega)


def feedbacks_of(system: System) -> list[DelayedFeedback]:
    """Return the delayed feedbacks of a system, or raise ValueError when they have different delays."""
    found = [element for element in system.elements if isinstance(element, DelayedFeedback)]
    if len({element.delay for element in found}) != 1:
        delays = ", ".join(f"{element.delay:g}" for element in found)
        raise ValueError(f"{system!r} has delayed feedbacks with the delays {delays}; simulate treats one delay")
    return found


class _Integration:
    """State of an integration."""

    def __init__(self, system: System, start: float, history, breaks):
        feedbacks = feedbacks_of(system)
        self.system, self.delay = system, feedbacks[0].delay_of(system.omega)
        self.gain = np.array([feedback.gain for feedback in feedbacks])
        self.repeat = np.array([feedback.repeat for feedback in feedbacks])
        where = [{"dof": feedback.dof} if feedback.row is None else {"row": feedback.row} for feedback in feedbacks]
        shown = [feedback.of == "displacement" for feedback in feedbacks]
        present = [LinearSpring(stiffness=feedback.gain if place else 0.0, damping=0.0 if place else feedback.gain, **at)
                   for feedback, place, at in zip(feedbacks, shown, where, strict=True)]
        free = without_feedback(system)

        def loaded(forces):
            constant = [ConstantForce(force, **at) for force, at in zip(forces, where, strict=True)]
            return System(free.mass, free.damping, free.stiffness, (*free.elements, *present, *constant), omega=free.omega)

        self.scene: Scene = scene_of(loaded(np.zeros(len(feedbacks))))
        self.ones = [loaded(forces) for forces in np.eye(len(feedbacks))]
        n = self.scene.n
        self.rows = np.zeros((len(feedbacks), self.scene.ns))
        for row, place, spring in zip(self.rows, shown, present, strict=True):
            row[slice(0, n) if place else slice(n, 2 * n)] = spring.site(n).R[0]
        self.history = History(history, start, self.scene.ns, len(feedbacks))
        self.start = start
        self.breaks = [(start + self.delay, 1), *((t + self.delay, 1) for t in breaks if t + self.delay > start)]
        heapq.heapify(self.breaks)
        self._take()

    def _take(self) -> None:
        """Read the tables again: they grow when a new mode is reached."""
        T = self.T = self.scene.tables
        self.still = T.flat.copy()
        self.change = np.array([self.scene.flat_of(one) - self.still for one in self.ones])
        ns = self.scene.ns
        pushed = [self.scene.refill(one) for one in self.ones]
        self.push = np.stack([one.A[:, :, ns] - T.A[:, :, ns] for one in pushed], axis=-1)  # (modes, ns, m) rate per unit of force
        self.felt = np.stack([one.G[:, :, ns] - T.G[:, :, ns] for one in pushed], axis=-1)  # (modes, guards, m): of reactions
        self.engine = kernels(self.scene)

    def run(self, y: np.ndarray, stop: float, max_events: int, watch=None) -> DelayedMotion:
        """Integrate to ``stop``, or until ``watch(state)`` (ns,) at a whole period is true."""
        scene, t, period = self.scene, self.start, self.scene.period
        events: list[Event] = []
        status, message, count, since = Status.COMPLETED, Status.COMPLETED.sentence, 0, -1
        first = self._joined(np.array([t]), y[None])[0]
        mode, x = self._settled(lambda t, x: settle.start(scene, x), t, first)
        y = x[:scene.ns].copy()
        passed = math.floor(self.start / period) if period is not None else 0
        while t < stop:
            while watch is not None and period is not None and (passed + 1) * period <= t:
                passed += 1
                if watch(self.history.at(np.array([passed * period]))[0][0]):
                    stop = t
            if t >= stop:
                break
            h, broken = self._reach(mode, t, stop)
            piece = self._piece(mode, t, h, y)
            if piece is None:
                status, message = Status.DIVERGED, Status.DIVERGED.sentence
                break
            values, end, delayed = piece
            hit = self._first(mode, t, h, y, values, delayed)
            if hit is not None and hit[0] < 1.0:
                if broken is not None:
                    heapq.heappush(self.breaks, broken)
                h, piece = self._until(mode, hit[1], t, hit[0] * h, y)
                if piece is None:
                    status, message = Status.DIVERGED, Status.DIVERGED.sentence
                    break
                values, end, delayed = piece
            if h > 0.0:
                states = scene.shown(np.full(COUNT + 1, mode), np.vstack((y[None], values)), t + h * points())
                self.history.append(t, h, states, delayed, mode)
            if hit is None:
                t = broken[0] if broken is not None else min(t + h, stop)
                if broken is not None:
                    self._carry_on(broken)
                y = end
                continue
            t, g = t + h, hit[1]
            turn = 0 if period is None else math.floor(t / period)
            count, since = (count + 1 if turn == since else 1), turn
            if count > max_events:
                status, message = Status.TOO_MANY_EVENTS, (f"{Status.TOO_MANY_EVENTS.sentence} Element "
                                                           f"{scene.element_name(mode, g)!r} at t = {t:.12g}.")
                break
            try:
                mode, y = self._event(events, mode, g, t, end)
            except settle.Inconsistent as error:
                status, message = Status.INCONSISTENT, f"{Status.INCONSISTENT.sentence} {error}"
                break
            heapq.heappush(self.breaks, (t + self.delay, 1))
        final = scene.shown(np.array([mode]), y[None], np.array([t]))[0].copy()
        return DelayedMotion(self.system, self.start, t, final, status, message, tuple(events), self.history,
                             self.gain, self.rows)

    # parts of a step

    def _reach(self, mode: int, t: float, stop: float):
        """Return how long the next piece may be, and the breaking point at its end, if there is one."""
        while self.breaks and self.breaks[0][0] <= t * (1.0 + math.copysign(SAME, t)):
            self._carry_on(heapq.heappop(self.breaks))
        h = min(float(self.T.step[mode]) * ANGLE / 0.8, self.delay, stop - t)  # what is fed back must have been
        if self.breaks and self.breaks[0][0] <= t + h:
            broken = heapq.heappop(self.breaks)
            return broken[0] - t, broken
        return h, None

    def _carry_on(self, broken: tuple[float, int]) -> None:
        if broken[1] < AGES:
            heapq.heappush(self.breaks, (broken[0] + self.delay, broken[1] + 1))

    def _past(self, t: np.ndarray) -> np.ndarray:
        """Return what the past adds to the forces (k, m) at times ``t`` (k,)."""
        states, delayed, known = self.history.at(t - self.delay)
        seen = self.gain * (states @ self.rows.T)
        force = seen + self.repeat * (delayed - seen)
        return np.where(known[:, None], force, 0.0)

    def _after(self, t: float) -> float:
        """Return ``t`` and a rounding: what arrives at the end of its delay has arrived."""
        return t + 4 * SAME * (abs(t) + self.delay)

    def _joined(self, t: np.ndarray, states: np.ndarray) -> np.ndarray:
        period = self.scene.period
        return np.hstack((states, self.scene.forcing(t if period is None else t % period)))

    def _piece(self, mode: int, t: float, h: float, y: np.ndarray):
        """Return states (COUNT, ns) at the Gauss points, the state at the end, and the delayed forces (COUNT + 1, m); None
        where they are not finite."""
        c, inner, ends = collocation()
        ns, T = y.size, self.T
        times = t + h * c
        delayed = self._past(t + h * points())
        delayed[0] = self._past(np.array([min(self._after(t), t + h)]))[0]
        drive = delayed[1:] @ self.push[mode].T
        forcing = self._joined(times, np.zeros((COUNT, 0)))
        A = T.A[mode, :, :ns]
        fixed = forcing @ T.A[mode, :, ns:].T + drive
        system = np.eye(COUNT * ns) - h * np.kron(inner, A)
        values = np.linalg.solve(system, (y[None] + h * inner @ fixed).ravel()).reshape(COUNT, ns)
        if T.acts.shape[1] and T.acts[mode].any():
            solved = self._with_laws(mode, h, y, values, fixed, forcing, system, inner)
            if solved is None:
                return None
            values, rate = solved
        else:
            rate = values @ A.T + fixed
        end = y + h * ends @ rate
        return (values, end, delayed) if np.isfinite(end).all() else None

    def _with_laws(self, mode, h, y, values, fixed, forcing, system, inner):
        """Iterate the collocation equations under a law: the affine part is solved, the law is taken from the last values."""
        ns, T, A = y.size, self.T, self.T.A[mode, :, :y.size]
        f = np.empty(ns)
        size = np.abs(values).max() + 1e-300
        rate = np.zeros_like(values)
        for _ in range(ITERATIONS):
            for j in range(COUNT):
                x = np.concatenate((values[j], forcing[j]))
                self.engine.field(T, mode, x, f)
                rate[j] = f - T.A[mode] @ x  # of the laws alone
            new = np.linalg.solve(system, (y[None] + h * inner @ (fixed + rate)).ravel()).reshape(values.shape)
            change = np.abs(new - values).max()
            values = new
            if not np.isfinite(change):
                return None
            if change <= CLOSED * size:
                break
        return values, values @ A.T + fixed + rate

    # events

    def _first(self, mode: int, t: float, h: float, y: np.ndarray, values: np.ndarray, delayed: np.ndarray):
        """Return (part of the piece, guard) of the first guard that fires, or None."""
        c, _, _ = collocation()
        ns = y.size
        inside = self._joined(t + h * c, values)
        begin = self._joined(np.array([t]), y[None])[0]
        plain = settle.plain(begin, ns)
        gradient, rates, moved = np.empty(begin.size), np.empty(begin.size), np.zeros(begin.size)
        self._rates(mode, begin, delayed[0], rates)
        moved[:ns] = np.abs(self.T.A[mode]) @ plain + np.abs(self.push[mode]) @ np.abs(delayed[0])
        first = None
        for g in range(self.T.n_guards[mode]):
            value = np.array([self.engine.guard_value(self.T, mode, g, x) for x in inside]) + delayed[1:] @ self.felt[mode, g]
            start = float(self.engine.guard_value(self.T, mode, g, begin)) + float(delayed[0] @ self.felt[mode, g])
            self.engine.guard_gradient(self.T, mode, g, begin, gradient)  # guards on curves have no row of their own
            sizes = np.abs(gradient)
            rate = None if self.felt[mode, g].any() else (h * float(gradient @ rates), h * ON_SURFACE * float(sizes @ moved))
            root = first_root(value, start, ON_SURFACE * float(sizes @ (plain + h * moved)), rate)
            if root is not None and (first is None or root < first[0]):
                first = root, g
        return first

    def _rates(self, mode: int, x: np.ndarray, delayed: np.ndarray, rates: np.ndarray) -> None:
        """Write the rates (nx,) of states and forcing at ``x`` (nx,) under delayed forces (m,)."""
        ns = self.scene.ns
        self.engine.field(self.T, mode, x, rates[:ns])
        rates[:ns] += self.push[mode] @ delayed
        self.engine.forcing_rate(self.T, x, rates[ns:])

    def _until(self, mode: int, g: int, t: float, h: float, y: np.ndarray):
        """Return the duration after which a guard vanishes, and the piece that ends there.

        Guards on curves are no polynomials of the degree of a piece: the root of the interpolated one is corrected by Newton.
        """
        ns, T = y.size, self.T
        gradient, rates = np.empty(T.G.shape[2]), np.empty(T.G.shape[2])
        for _ in range(CORRECTIONS):
            piece = self._piece(mode, t, h, y)
            if piece is None or self.felt[mode, g].any():  # reactions are affine
                break
            x = self._joined(np.array([t + h]), piece[1][None])[0]
            self.engine.guard_gradient(T, mode, g, x, gradient)
            value = float(self.engine.guard_value(T, mode, g, x))
            if abs(value) <= 0.25 * ON_SURFACE * float(np.abs(gradient) @ settle.plain(x, ns)):
                break
            self._rates(mode, x, (interpolation(np.ones(1)) @ piece[2])[0], rates)
            slope = float(gradient @ rates)
            change = -value / slope if slope else 0.0
            if not (abs(change) < NEAR * float(T.step[mode]) and h + change > 0.0):  # a touch, or no simple root: as interpolated
                break
            h += change
        return h, piece

    def _event(self, events: list, mode: int, g: int, t: float, y: np.ndarray):
        """Note an event and return mode and state (ns,) after it."""
        scene = self.scene
        if scene.expand(mode, g) is not self.T:
            self._take()
        x = self._joined(np.array([t]), y[None])[0]
        value = float(self.engine.guard_value(self.T, mode, g, x))
        x[:scene.ns] -= self.T.D[mode, g] * value if not self.felt[mode, g].any() else 0.0
        before = x[:scene.ns].copy()
        speed = 0.0

        def decided(t, x):
            nonlocal speed
            speed = settle.Rule(scene).rate(mode, g, x)[0]
            return settle.decide(scene, mode, g, x, speed)

        new, z = self._settled(decided, t, x)
        left, entered = scene.shown(np.array([mode, new]), np.array((before, z[:scene.ns])), np.full(2, t))
        events.append(Event(t, scene.element_name(mode, g), scene.event_kind(mode, g), speed, left, entered,
                            mode_before=self._keys(mode), mode_after=self._keys(new)))
        return new, z[:scene.ns].copy()

    def _keys(self, mode: int) -> tuple:
        """Return the keys of the system's elements; a feedback has that of the spring or damper that is its undelayed part."""
        keys, own = self.scene.keys[mode], len(self.system.elements) - len(self.gain)
        plain, fed = iter(keys[:own]), iter(keys[own:])
        return tuple(next(fed if isinstance(element, DelayedFeedback) else plain) for element in self.system.elements)

    def _settled(self, decide, t: float, x: np.ndarray):
        """Return what ``decide(t, x)`` says while the delayed parts of the forces act as constant ones."""
        force = self._past(np.array([self._after(t)]))[0]
        if force.any():
            self.T.flat[:] = self.still + force @ self.change
            rebuild(self.T)
        try:
            return decide(t, x)
        finally:
            self.T.flat[:] = self.still
            if force.any():
                rebuild(self.T)
            if self.scene.tables is not self.T:
                self._take()


def first_root(value: np.ndarray, start: float, noise: float, rate: tuple[float, float] | None = None) -> float | None:
    """Return where in (0, 1] a guard first becomes positive, from its values (COUNT,) at the Gauss points of a piece.

    ``start`` is its value at 0: within ``noise`` it is zero there (a mass that has just hit its stop), which is divided out, and so
    is its rate where that is zero too (a slider that has just stopped).  0 where it is positive, or becomes so at once.  ``rate``
    are the rate at 0, of a unit of the piece, and its noise, if known: a short piece hides it in the rounding of its values.
    Where it says that the guard goes inside, the guard comes back after it was seen there: zeros before are rounding.
    """
    c, _, _ = collocation()
    if start > noise:
        return 0.0
    first, level, terms, clear = start, noise, _legendre() @ value, 0.0
    for order in range(ORDERS):
        if abs(first) > level:
            break
        inner, value = value, value / c
        terms = _legendre() @ value
        if order == 0 and rate is not None:
            first, level = rate
            clear = _clear(inner, noise) if first < -level else 0.0
        else:
            first = float(np.polynomial.legendre.legval(-1.0, terms))
            level = noise / c[0]**(order + 1)
            if rate is None:
                level = min(level, SHARE * float(np.abs(terms).sum()))
    if first > level:
        return 0.0
    if terms[0] + np.abs(terms[1:]).sum() < 0.0:
        return None
    slope = np.polynomial.legendre.legder(terms)
    found = []
    for root in np.polynomial.legendre.legroots(terms):
        if abs(root.imag) > 1e-7 or not -1.0 < root.real <= 1.0 + 1e-12:
            continue
        at = float(root.real)
        for _ in range(3):
            rise = np.polynomial.legendre.legval(at, slope)
            at -= float(np.polynomial.legendre.legval(at, terms) / rise) if rise else 0.0
        if -1.0 < at <= 1.0 and 0.5 * (at + 1.0) > clear and np.polynomial.legendre.legval(at, slope) > 0.0:
            found.append(0.5 * (at + 1.0))
    if start < -noise and value[0] > 0.0 and min(found, default=1.0) > c[0]:  # it crosses before the first point, hidden by the
        found.append(float(c[0] * start / (start - value[0])))  # error of the interpolation: a piece that begins at the event
    return min(found, default=None)


def _clear(value: np.ndarray, noise: float) -> float:
    """Return where in a piece its first value (COUNT,) beyond ``noise`` lies, if that is negative; infinity without one."""
    seen = np.flatnonzero(np.abs(value) > noise)
    if not seen.size:
        return math.inf
    return float(collocation()[0][seen[0]]) if value[seen[0]] < 0.0 else 0.0


def _legendre() -> np.ndarray:
    """Return the matrix (COUNT, COUNT) from values at the Gauss points to coefficients of Legendre polynomials."""
    if not _MATRIX:
        roots, weights = np.polynomial.legendre.leggauss(COUNT)
        _MATRIX.append((np.polynomial.legendre.legvander(roots, COUNT - 1) * weights[:, None] * (2 * np.arange(COUNT) + 1) / 2.0).T)
    return _MATRIX[0]


_MATRIX: list[np.ndarray] = []  # filled once
