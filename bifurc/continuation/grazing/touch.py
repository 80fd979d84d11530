"""The instant at which a periodic orbit touches a guard, and the linear map of the orbit about it.

With the guard h(y, t), negative inside, the field f of the mode in which it is touched, and the direction B of the kick
(scaled so that it changes the rate of the guard by 1), a touch has h = 0, dh/dt = 0 and the apex acceleration
A_g = d2h/dt2 < 0.  The monodromy E starts and ends just before the touch.  Where a symmetric orbit touches two stops that
answer each other, E is that of half a period times the symmetry, -E(T/2): one map from touch to touch.
"""
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...content import Content
from ...orbits.shooting.sequence import AFTER, CLOSES, GUARD
from ...orbits.shooting.signature import repeated
from ..shooting.appearing import NEAR, touches
from ..shooting.vanishing import dropped
from .guards import field_slope, guard_series, guard_size, of_law

ALIKE = 1e-6  # scaled difference of a touch and the mirror image of the other
SAMPLES = 512  # of the guard a forcing period
NEARBY = 1e-2  # scaled depth below which a sampled maximum is no touch
SLOW = 1e-3  # speed, in natural sizes, of an impact that stands for a touch
SHALLOW = 1e-4  # depth, in natural sizes, of a contact that stands for its beginning
LINEAR = 1e-9  # misfit, relative, of a change of field that is taken for a linear spring and dashpot


@dataclass(frozen=True, eq=False)
class Touch(Content):
    """A touch of an orbit at a guard.

    Attributes
    ----------
    element : str
        Label of the element that is touched.
    time : float
        Of the touch, from phase 0, time.
    state : ndarray (ns,)
        There.
    h : ndarray (ns,)
        Gradient of the guard in the state, 1 per length for a stop.
    B : ndarray (ns,)
        Rigid: direction of the kick, dh/dt changes by 1 along it.  Elastic: change of the field per depth, so that a short
        contact changes the state by -B times the integral of the depth; a dashpot enters in the positions.
    apex : float
        A_g, second derivative of the guard in time, negative at a touch from inside.
    jerk : float
        Third derivative.
    restitution : float or None
        Of the kick; None for an elastic contact.
    E : ndarray (ns, ns)
        Linear map from touch to touch; with the sign of the symmetry where ``symmetric``.
    symmetric : bool
        Whether the orbit touches two stops in turn, half a period apart.
    """

    element: str
    time: float
    state: np.ndarray = field(repr=False)
    h: np.ndarray = field(repr=False)
    B: np.ndarray = field(repr=False)
    apex: float
    jerk: float
    restitution: float | None
    E: np.ndarray = field(repr=False)
    symmetric: bool
    problem: Any = field(repr=False)
    x: np.ndarray = field(repr=False)
    mode: int = field(repr=False)
    guard: int = field(repr=False)
    contact: int | None = field(repr=False)

    @property
    def tables(self):
        """Numbers of the scene at the parameter of the touch."""
        return self.problem.equations.numbers_at(self.x[-1])

    def joined(self, y, t) -> np.ndarray:
        """Return the state ``y`` (ns,) joined with the forcing at the time ``t`` (nx,)."""
        return np.concatenate([y, _forcing(self.tables, np.asarray(y).size, t)])


def touches_of(point) -> tuple[Touch, ...]:
    """Return the touches of the orbit at a grazing point of a branch of periodic orbits, in order of time.

    Mirror images of each other are one touch with ``symmetric``.  Empty where the orbit that touches is not known.
    """
    problem, x = unlisted(point.problem, point.x)
    if problem is None:
        return ()
    return _mirrored(problem, x, [touch_at(problem, x, *item) for item in every_touch(problem, x)])


def every_touch(problem, x):
    """Return (tau, mode, guard, state) of every unlisted maximum that touches its guard, several of an interval too.

    `touches` knows the highest maximum of every interval; others as high are looked for between samples of the guard.
    """
    found = touches(problem, x)
    for tau, mode, q, value, y in maxima(problem, x, [item[:3] for item in found]):
        if abs(value) <= NEAR:
            found.append((tau, mode, q, y))
    return sorted(found, key=lambda item: item[0])


def maxima(problem, x, known, nearby=NEARBY):
    """Yield (tau, mode, guard, scaled value, state) of the maxima of all guards above ``-nearby`` that are not ``known``.

    ``known`` lists (tau, mode, guard).  Maxima are bracketed by samples of the guard and then located exactly.
    """
    e, s, scene = problem.equations, problem.sequence, problem.scene
    T = e.numbers_at(x[-1])
    period = 2.0 * np.pi / T.flat[0]
    count = int(SAMPLES * max(1.0, s.span))
    tau = x[0] + s.span * np.arange(count + 2) / count  # the last two begin the next period
    y = np.empty((count + 2, scene.ns))
    e.motion.states(T, s.nodes, s.span, x[:-1], tau[:count], y[:count])
    y[count:] = y[:2]
    joined = np.hstack([y, scene.forcing(tau * 2.0 * np.pi / (scene.omega or 1.0))])
    at = np.searchsorted(x[:-1:1 + scene.ns], np.append(tau[:count], tau[:2]), side="right") - 1
    modes = s.nodes[at, AFTER]
    single = len(s.nodes) == 1 and s.closure > 0  # an orbit without events: its only section is no end
    width = s.span / count
    for mode in np.unique(modes):
        there = np.flatnonzero(modes == mode)
        for q in range(int(T.n_guards[mode])):
            size = guard_size(e, T, mode, q, joined[there[0]])
            value = np.full(count + 2, -np.inf)
            value[there] = ([e.kernel.guard_value(T, mode, q, x) for x in joined[there]] if of_law(T, mode, q)
                            else joined[there] @ T.G[mode, q])
            if not single:
                value[count:] = -np.inf
            tops = np.flatnonzero((value[1:-1] >= value[:-2]) & (value[1:-1] > value[2:]) & (value[1:-1] > -nearby * size)) + 1
            for k in tops:
                if at[k - 1] != at[k] or at[k + 1] != at[k] or any(
                        abs((item[0] - tau[k] + 0.5 * s.span) % s.span - 0.5 * s.span) <= 2.0 * width and item[1:] == (mode, q)
                        for item in known):
                    continue
                top, when = e.kernel.segment_peak(T, mode, q, joined[k - 1].copy(), 2.0 * width * period, 1, 0)
                z = np.empty(scene.ns)
                e.motion.advance(T, mode, joined[k - 1].copy(), when, z)
                yield tau[k - 1] + when / period, int(mode), q, float(top) / size, z


def unlisted(problem, x):
    """Return (problem, x) of the touching orbit with its touches not listed; (None, None) where that is not known."""
    less = dropped(problem, x)
    if less is None:
        return (problem, x) if touches(problem, x) else (None, None)
    other = problem.with_sequence(*less)
    fixed = np.zeros(other.x0.size)
    fixed[-1] = 1.0
    c = other.correct(other.x0, fixed, True)  # at the same parameter: the orbit is regular there
    return (other, c.x) if c.converged else (None, None)


def touch_at(problem, x, tau, mode, guard, y) -> Touch:
    """Return the touch of a guard at the time ``tau`` (periods) and the state ``y`` (ns,)."""
    scene, e = problem.scene, problem.equations
    T = e.numbers_at(x[-1])
    ns, nx = T.A.shape[1], T.A.shape[2]
    time = tau * 2.0 * np.pi / T.flat[0]
    joined = np.concatenate([y, _forcing(T, ns, time)])
    row = np.empty(nx)
    e.kernel.guard_gradient(T, mode, guard, joined, row)
    apex, jerk = rates(e, T, mode, guard, joined)
    contact, restitution = None, None
    if T.kick[mode, guard] and of_law(T, mode, guard):
        B, restitution = _kicked(e, T, mode, guard, joined, row)
    elif T.kick[mode, guard]:
        B = T.B[mode, guard].copy()
        restitution = -float(T.GT[mode, guard, :ns, 1] @ (T.R[mode, guard, :, :ns] @ B))
    else:
        contact = next((int(m) for m in scene.expand(mode, guard).then[mode, guard] if m >= 0 and m != mode), None)
        T = e.numbers_at(x[-1])
        B = np.full(ns, np.nan) if contact is None else _compliance(e, T, mode, guard, contact, joined)
    return Touch(scene.element_name(mode, guard), float(time), np.array(y), row[:ns].copy(), B, apex, jerk, restitution,
                 _map_from(problem, x, tau, problem.sequence.closure < 0), problem.sequence.closure < 0, problem, x, int(mode),
                 int(guard), contact)


def _kicked(e, T, mode, guard, joined, row):
    """Return direction (ns,) and restitution of a kick that is a law, from one that is slow: it is linear in a small speed."""
    ns, nx, n = T.A.shape[1], joined.size, T.LP.shape[2]
    push = row[:n] / float(row[:n] @ row[:n])  # changes the rate of the guard by 1
    speed = SLOW * float(np.abs(e.weights[n:2 * n]).max() / np.abs(push).max())
    dw = np.empty(nx - ns)
    e.kernel.forcing_rate(T, joined, dw)
    rate = float(row[:n] @ joined[n:2 * n] + row[ns:] @ dw)  # rounding
    before, after, P = joined.copy(), np.empty(nx), np.empty((ns, nx))
    before[n:2 * n] += (speed - rate) * push
    e.kernel.reset(T, mode, guard, 0, before, after, P)
    change = after[:ns] - before[:ns]
    change[:n] = 0.0  # the position is put onto the surface, by rounding
    rate = float(row[:n] @ change[n:2 * n])
    return change / rate, -(speed + rate) / speed


def _forcing(T, ns, time):
    """Forcing states (nw,) at a time."""
    found = np.ones(T.A.shape[2] - ns)
    angle = T.harmonics * T.flat[0] * time
    found[1::2], found[2::2] = np.cos(angle), np.sin(angle)
    return found


def rates(e, T, mode, guard, joined):
    """Second and third derivative of a guard in time at a joined state (nx,)."""
    if of_law(T, mode, guard):
        a = guard_series(e, T, mode, guard, joined)
        return 2.0 * float(a[2]), 6.0 * float(a[3])
    ns = T.A.shape[1]
    row = T.GT[mode, guard, :, 1]  # of the first derivative: kinematics, whatever laws act

    def second(x):
        f, dw = np.empty(ns), np.empty(x.size - ns)
        e.kernel.field(T, mode, x, f)
        e.kernel.forcing_rate(T, x, dw)
        return float(row @ np.concatenate([f, dw])), f, dw
    apex, f, dw = second(joined)
    if T.LU.shape[0] == 0:
        return 2.0 * float(T.GT[mode, guard, :, 2] @ joined), 6.0 * float(T.GT[mode, guard, :, 3] @ joined)
    step = 1e-4 / T.flat[0]
    rate = np.concatenate([f, dw])
    return apex, (second(joined + step * rate)[0] - second(joined - step * rate)[0]) / (2.0 * step)


def _compliance(e, T, mode, guard, contact, joined):
    """Change of the field per depth (ns,) where a contact begins softly; NaN where it is no spring and dashpot.

    The field changes by -b (k d + c d') with the depth d of the guard; after partial integration a contact that ends at d = 0
    changes the state by -(k b + c A b) times the integral of d.
    """
    ns = T.A.shape[1]
    if of_law(T, mode, guard):
        by_depth, by_rate = _begins(e, T, mode, guard, contact, joined)
        return -(by_depth + field_slope(e, T, mode, joined)[:, :ns] @ by_rate)
    change = T.A[contact] - T.A[mode]
    if T.LU.shape[0] and np.any(T.LP[contact] != T.LP[mode]):
        return np.full(ns, np.nan)
    rows = T.GT[mode, guard, :, :2]
    fitted, *_ = np.linalg.lstsq(rows, change.T, rcond=None)
    if np.abs(rows @ fitted - change.T).max() > LINEAR * max(np.abs(change).max(), 1e-300):
        return np.full(ns, np.nan)
    return -(fitted[0] + T.A[mode, :, :ns] @ fitted[1])


def _begins(e, T, mode, guard, contact, joined):
    """Return the change of the field per depth and per rate of depth (ns,) with which the contact of a guard that is a law begins;
    NaN where it jumps, or is not linear in a small depth."""
    ns, n = T.A.shape[1], T.LP.shape[2]
    row = np.empty(joined.size)
    e.kernel.guard_gradient(T, mode, guard, joined, row)
    push = row[:n] / float(row[:n] @ row[:n])
    found, doubt, top = [], 0.0, 0.0  # the last two as changes of the field
    for places in (slice(0, n), slice(n, 2 * n)):
        small = SHALLOW * float(e.weights[places].max() / np.abs(push).max())
        sides = []
        for part in (0.0, 1.0, 0.5, 0.25):
            x, fields = joined.copy(), np.empty((2, ns))
            x[places] += part * small * push
            for f, which in zip(fields, (contact, mode), strict=True):
                e.kernel.field(T, which, x, f)
            sides.append(fields[0] - fields[1])
        one, half, quarter = (side - sides[0] for side in sides[1:])
        coarse, fine = 4.0 * half - one, 8.0 * quarter - 2.0 * half  # free of the quadratic term, for the whole step
        doubt = max(doubt, float(np.abs(sides[0]).max()), float(np.abs(fine - coarse).max()))
        top = max(top, float(np.abs(fine).max()))
        found.append((4.0 * fine - coarse) / (3.0 * small))
    return found if doubt <= SHALLOW * top else [np.full(ns, np.nan)] * 2


def _map_from(problem, x, tau, half):
    """Linear map of the orbit from the time ``tau`` (periods) over its period, or half of it with the sign of the symmetry."""
    scene, e = problem.scene, problem.equations
    whole, U = repeated(scene, problem.sequence, x[:-1])
    T = e.numbers_at(x[-1])
    rows = U.reshape(len(whole.nodes), -1)
    nodes = whole.nodes.astype(np.int64)
    later = np.mod(rows[:, 0] - tau, whole.span)
    order = np.argsort(later, kind="stable")
    mode = int(nodes[order[-1], AFTER])
    first = np.zeros(nodes.shape[1], np.int64)
    first[:CLOSES + 1] = [mode, -1, mode, 0, 0]
    y = np.zeros(rows.shape[1])
    y[0] = tau
    state = np.empty((1, scene.ns))
    begin = U[0] + np.mod(tau - U[0], whole.span)
    e.motion.states(T, whole.nodes, whole.span, U, np.array([begin]), state)
    y[1:] = state[0]
    span = 0.5 * whole.span if half else whole.span
    keep = [i for i in order if later[i] < span and not (later[i] == 0.0 and nodes[i, GUARD] < 0)]
    listed = rows[keep].copy()
    listed[:, 0] = tau + later[keep]
    M = np.empty((scene.ns, scene.ns))
    e.motion.monodromy(T, np.ascontiguousarray(np.vstack([first[None], nodes[keep]])), span,
                       np.concatenate([y, listed.ravel()]), M)
    return -M if half else M


def _mirrored(problem, x, found):
    """Merge touches that are mirror images of each other half a period apart."""
    s, scene = problem.sequence, problem.scene
    if s.closure < 0 or len(found) != 2 or scene.system.mirror_order is None or round(2.0 * s.span) % 4 != 2:
        return tuple(found)
    a, b = found
    T = problem.equations.numbers_at(x[-1])
    half = 0.5 * s.span * 2.0 * np.pi / T.flat[0]
    weights = problem.weights
    if scene.mirror(a.mode) == b.mode and scene.mirror_guard(a.mode, a.guard) == b.guard \
            and abs(b.time - a.time - half) <= ALIKE * half and np.all(np.abs(a.state + b.state) <= ALIKE * weights):
        tau = a.time * T.flat[0] / (2.0 * np.pi)
        return (replace(a, E=_map_from(problem, x, tau, True), symmetric=True),)
    return tuple(found)
