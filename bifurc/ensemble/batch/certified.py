"""One mass with one rigid stop: certified integration over a forcing period, for starts that the batch step defers.

This module is a template, written again around the step of a kind of scene (`bifurc.ensemble.batch.packing`): with the number of
states and forcing states known, rest on a stop is taken in four fifths of the time.

The rule at an event is that of `bifurc.flow.scan.run`, for modes of one guard and without a record: on the substeps of the batch
while a bound proves that the guard is not met, otherwise through the events of a substep one by one.
"""
import numpy as np

from ..._jit import WHOLES, apart, leaf, njit
from ...compose.tables import ORDER
from ...flow.affine.engine import forcing, terms_size
from ...flow.affine.polynomial import EPS, first_zero, horner
from ...flow.chatter import closing
from ...flow.rule import broken_hold, inside, jumped, sizes
from ...flow.scan import DONE, LIMIT, project
from .blank import NX
from .several_modes import records, strides

ASIDE = 100  # what `period` does not decide: the caller takes the simulation
PER_MODE, PER_STEP, OF_GUARDS, FORCED, *_ = strides(*records(1, 1)).values()
COUNTED, STRUCK, SLOWEST = range(3)  # tally: events, impacts, least speed of arrival


@njit
def expand(rows, m, x, a):
    """Write the Taylor coefficients of the first of the ``rows`` of a mode, at ``x`` (nx,), into ``a``."""
    for j in range(ORDER + 1):
        a[j] = 0.0
    for c in range(NX):
        for j in range(ORDER + 1):
            a[j] += rows[m, 0, c, j] * x[c]


@leaf
def through(T, begin, h, m, order, known, room, limit):
    """Carry ``x`` over the substep from ``begin`` through its events; return status, mode, and what is known of the guard then.

    That is the order of its zero, -1 where the end is no event, and its slope, NaN where it is not known.  A leaf: counting the
    references of arrays costs a fifth.
    """
    _, tally, x, xp, rested, scale, a, out, stack = room
    GT, ratio, then, ends_in = T.GT, T.ratio, T.then, T.ends_in
    forcing(T, begin, x)
    time, instants = 0.0, 0
    while True:
        left = h - time
        if left <= 4.0 * EPS * h:
            return DONE, m, order, known
        met, hit, arrive = False, left, 0.0
        if T.n_guards[m] > 0:
            expand(GT, m, x, a)
            if known == known:
                a[1] = known
            first_zero(a, max(order, 0), hit, 4.0 * EPS * terms_size(T, m, 0, x), out, stack)
            if out[0] <= hit:
                met, hit, arrive = True, out[0], out[1]
        kicked = met and T.kick[m, 0] == 1
        if not kicked:
            expand(T.YT, m, x, a)
            x[0], x[1] = horner(a, 0, hit)
        if not met:
            return DONE, m, -1, np.nan
        instants = instants + 1 if hit == 0.0 else 0
        time += hit
        tally[COUNTED] += 1.0
        if tally[COUNTED] > limit:
            return LIMIT, m, order, known
        if instants > 3 or (kicked and not arrive > 0.0):
            return ASIDE, m, order, known
        forcing(T, begin + time, x)
        closes = False
        if kicked:  # on the surface, with the speed of arrival
            x[0] = x[1] = rate = value = 0.0
            for c in range(1, NX):
                value += T.G[m, 0, c] * x[c]
            x[0] = -value / T.G[m, 0, 0]
            for c in range(NX):
                rate += GT[m, 0, c, 1] * x[c]
            x[1] = (arrive - rate) / GT[m, 0, 1, 1]
            closes = ends_in[m, 0] != -1 and 0.0 < ratio[m, 0] < 1.0 and closing(T, m, 0, x, arrive, rested) > 0.0
        elif T.n_holds[m] > 0:
            project(T.H, T.S, T.n_holds[m], 2, m, x)
        after, target, sized = jumped(T, m, 0, x, arrive, xp), -1, False
        for i in range(-1 if closes else 0, then.shape[2]):  # a complete chattering that closes comes first
            c, y = (ends_in[m, 0], rested) if i < 0 else (then[m, 0, i], xp)
            if i >= 0 and c == m and after < 0.0:
                target, order, known = c, 1, after
                break
            if c == -2:
                return ASIDE, m, order, known
            if c < 0:
                continue
            if not sized:
                sizes(T, x, scale)
                sized = True
            if broken_hold(T, c, y, scale) >= 0:
                continue
            sign, order, known = -1, 0, np.nan
            if T.n_guards[c] > 0:
                sign, order = inside(T, c, 0, y, scale, a)
            if sign <= 0:
                target = c
                break
        if target < 0:
            return ASIDE, m, order, known
        x[0], x[1] = y[0], y[1]
        if kicked:
            tally[STRUCK] += 1.0
            tally[SLOWEST] = min(tally[SLOWEST], 0.0 if i < 0 else arrive)
        m = target
        if T.n_holds[m] > 0:
            project(T.H, T.S, T.n_holds[m], 2, m, x)


@apart(WHOLES, counted=False)
def period(given, m, room, limit):
    """Integrate ``room[0]`` (2,) in place over the forcing period that starts at phase 0; return status and mode.

    The tally, ``room[1]``, receives the number of events and that of impacts, both added to what is there, and the least speed of
    arrival.  Status DONE, LIMIT or ASIDE; in the last two the state is of no use.
    """
    T, N, F = given.T, given.numbers, given.grid
    y, x, modes, h = room[0], room[2], T.n_guards.size, N[0]
    q, v = y[0], y[1]
    steps = F.size // (modes * PER_STEP)
    order, known, fresh, right, rise1 = -1, np.nan, True, 0.0, 0.0
    for k in range(steps):
        o, t = m * PER_MODE, (m * steps + k) * PER_STEP
        i, j = o + OF_GUARDS, t + FORCED
        if order < 0:
            q1 = N[o + 1] * q + (N[o + 2] * v + F[t])
            v1 = N[o + 3] * q + (N[o + 4] * v + F[t + 1])
            left, rise0 = right, rise1
            if fresh:
                left = N[i] * q + (N[i + 1] * v + F[j])
                rise0 = N[i + 2] * q + (N[i + 3] * v + F[j + 1])
            right = N[i] * q1 + (N[i + 1] * v1 + F[j + 2])
            rise1 = N[i + 2] * q1 + (N[i + 3] * v1 + F[j + 3])
            bound = N[i + 4] * abs(q) + (N[i + 5] * abs(v) + N[i + 6])
            if T.n_guards[m] == 0 or max(max(left, right), max(left + rise0, right - rise1)) + bound < 0.0:
                q, v, fresh = q1, v1, False
                continue
        fresh = True
        x[0], x[1] = q, v
        status, m, order, known = through(T, k * h, h, m, order, known, room, limit)
        if status != DONE:
            return status, m
        q, v = x[0], x[1]
    y[0], y[1] = q, v
    return DONE, m


@njit
def workspace(T):
    """Return what `period` works on: the state, the tally, and room."""
    return (np.zeros(2), np.zeros(3), np.zeros(NX), np.zeros(NX), np.zeros(NX), np.zeros(NX), np.zeros(ORDER + 1), np.zeros(3),
            np.zeros(64))
