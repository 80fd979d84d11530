"""One degree of freedom and few guards: certified integration over a forcing period, for starts that the batch step defers.

This module is a template, written again around the literal numbers of a kind of scene: see `bifurc.ensemble.batch.packing`.

The integration is that of `bifurc.flow.scan.run` without a record: on the substeps of the batch while a bound proves that no
guard is met, otherwise through the events of a substep one by one.
"""
import numpy as np

from ..._jit import leaf, njit
from ...compose.tables import ORDER
from ...flow.affine.polynomial import EPS, first_zero, horner
from ...flow.rule import NOISE
from ...flow.scan import CLOSE, DONE, LIMIT
from .blank import FORCINGS, GUARDS

ASIDE = 100  # what `period` does not decide: the caller takes the simulation
NX = 2 + FORCINGS
TERMS = ORDER + 1
# numbers of a mode: blocks over (q, v, forcing states), the guards' one after the other; Taylor rows at the end
STEP, OMEGA, REACH = 0, 1, 2  # substep of the batch, frequency, step of the mode's own tables
RATIOS, KAPPAS, FLOW = 3, 3 + GUARDS, 3 + 2 * GUARDS
VALUE = FLOW + 2 * NX
SLOPE = VALUE + GUARDS * NX
BOUND = SLOPE + GUARDS * NX
RESET = BOUND + GUARDS * NX  # coordinate and velocity
PUSH = RESET + 2 * GUARDS * NX
PUSH_RATE = PUSH + GUARDS * NX  # along the motion held after a complete chattering
HOLD = PUSH_RATE + GUARDS * NX
PLACE = HOLD + NX
STATES = PLACE + NX
SERIES = STATES + NX * TERMS
NUMBERS = SERIES + GUARDS * NX * TERMS
# integers of a mode, then those of its guards; candidates from THEN
GUARDED, HELD, CANDIDATES = 0, 1, 2
KICK, SURFACE, ENDS, HIT, THEN = range(5)  # KICK 2: one whose guard is the same in all modes that may follow and do not rest
WHOLES = 3
ORDERS, KNOWN, NEW_ORDERS, ENDS_OF, OPEN = (i * GUARDS for i in (0, 1, 2, 3, 5))  # places in `due`
DUE = OPEN + 1
FORCED = 2 + 2 * GUARDS  # numbers of a mode and substep in `forced`
EVENTS, HITS, LEAST = range(3)  # tally: events, impacts and contacts, least speed of arrival


@njit
def row(P, m, at, q, v, w):
    """Value of a row at a state under the forcing ``w`` (FORCINGS,)."""
    total = P[m, at] * q + P[m, at + 1] * v
    for c in range(FORCINGS):
        total += P[m, at + 2 + c] * w[c]
    return total


@njit
def size(P, m, at, q, v):
    """Sum of the sizes of the terms of a row; forcing counts with its amplitude."""
    total = abs(P[m, at] * q) + abs(P[m, at + 1] * v)
    for c in range(FORCINGS):
        total += abs(P[m, at + 2 + c])
    return total


@njit
def expand(P, m, at, q, v, w, a):
    """Write the Taylor coefficients of the series at ``at`` into ``a`` (TERMS,)."""
    for j in range(TERMS):
        total = P[m, at + j] * q + P[m, at + TERMS + j] * v
        for c in range(FORCINGS):
            total += P[m, at + (2 + c) * TERMS + j] * w[c]
        a[j] = total


@njit
def inside(P, m, g, q, v, w, a):
    """Sign of guard ``g`` just after a state, -1: inside, and the order of its zero there."""
    value = row(P, m, VALUE + g * NX, q, v, w)
    if abs(value) > NOISE * size(P, m, VALUE + g * NX, q, v):
        return (-1 if value < 0.0 else 1), 0
    at = SERIES + g * NX * TERMS
    expand(P, m, at, q, v, w, a)
    for j in range(1, TERMS):
        total = abs(P[m, at + j] * q) + abs(P[m, at + TERMS + j] * v)
        for c in range(FORCINGS):
            total += abs(P[m, at + (2 + c) * TERMS + j])
        if abs(a[j]) > NOISE * total:
            return (-1 if a[j] < 0.0 else 1), j
    return 0, ORDER


@njit
def may_start(P, I, c, q, v, w, a, due, skipped):
    """Whether mode ``c`` may follow at a state; writes the orders of its guards but that of guard ``skipped``."""
    if I[c, HELD] > 0:
        if abs(row(P, c, HOLD, q, v, w)) > NOISE * size(P, c, HOLD, q, v):
            return False
        if abs(row(P, c, PLACE, q, v, w)) > NOISE * size(P, c, PLACE, q, v):
            return False
    for g in range(I[c, GUARDED]):
        if g != skipped:
            sign, order = inside(P, c, g, q, v, w, a)
            if sign > 0:
                return False
            due[NEW_ORDERS + g] = order
    return True


@njit
def closing(P, m, g, q, w, v, u):
    """Whether the rest of a complete chattering closes at an impact that arrives with ``v``; ``u`` is the held velocity.

    The rule of `bifurc.flow.scan.closing`.
    """
    push = row(P, m, PUSH + g * NX, q, u, w)
    if push <= 0.0:
        return False
    r = P[m, RATIOS + g]
    span = 2.0 * r * v
    unit = CLOSE * (1.0 - r) * push
    return span <= unit * P[m, REACH] and span * abs(P[m, KAPPAS + g]) <= unit and (
        span * abs(row(P, m, PUSH_RATE + g * NX, q, u, w)) <= unit * push)


@njit
def hold(P, m, q, v, w):
    """Held row: the coordinate on its surface, at rest against it (corrections of rounding size)."""
    if P[m, PLACE] != 0.0:
        q -= row(P, m, PLACE, q, v, w) / P[m, PLACE]
    return q, v - row(P, m, HOLD, q, v, w) / P[m, HOLD + 1]


@leaf
def through(given, k, m, q, v, room, limit):
    """Carry a state over substep ``k`` through its events; return status, mode and state.

    ``given`` are `packing.Numbers`, ``room`` is `scratch`: ``due`` (DUE,) in it holds orders and known slopes of the zeros that the
    guards have at its start where its OPEN is 1; it is 1 in the end when an event at the end of the substep has left some.  Arrays
    are passed whole, with places in them, and no literal numbers are: a slice costs more than what is done with it, a literal
    compiles the function once more.  A leaf: counting the references of the records' arrays costs a fifth.
    """
    P, I, harmonics, phases = given.P, given.I, given.harmonics, given.phases
    _, a, out, stack, force, due, tally = room
    h, omega = P[m, STEP], P[m, OMEGA]
    for c in range(FORCINGS):
        force[c] = phases[k * FORCINGS + c]
    time, instants = 0.0, 0
    if due[OPEN] == 0.0:
        for g in range(GUARDS):
            due[ORDERS + g], due[KNOWN + g] = 0.0, np.nan
    while True:
        left = h - time
        if left <= 4.0 * EPS * h:
            due[OPEN] = 1.0
            return DONE, m, q, v
        g, hit, arrive = np.int64(-1), left, 0.0
        for i in range(I[m, GUARDED]):
            expand(P, m, SERIES + i * NX * TERMS, q, v, force, a)
            if due[KNOWN + i] == due[KNOWN + i]:
                a[1] = due[KNOWN + i]
            first_zero(a, np.int64(due[ORDERS + i]), hit, 4.0 * EPS * size(P, m, VALUE + i * NX, q, v), out, stack)
            if out[0] < hit or (out[0] == hit and g < 0):
                g, hit, arrive = i, out[0], out[1]
        at = WHOLES + g * (THEN + I[m, CANDIDATES])
        kicked = g >= 0 and I[m, at + KICK] > 0
        if not kicked:
            expand(P, m, STATES, q, v, force, a)
            q, v = horner(a, 0, hit)
        if g < 0:
            due[OPEN] = 0.0
            return DONE, m, q, v
        instants = instants + 1 if hit == 0.0 else 0
        time += hit
        tally[EVENTS] += 1.0
        if tally[EVENTS] > limit:
            return LIMIT, m, q, v
        if instants > 3 or (kicked and not arrive > 0.0):
            return ASIDE, m, q, v
        for i in range(harmonics.size):
            angle = harmonics[i] * omega * (k * h + time)
            force[1 + 2 * i], force[2 + 2 * i] = np.cos(angle), np.sin(angle)
        if I[m, HELD] > 0:
            q, v = hold(P, m, q, v, force)
        elif kicked or I[m, at + SURFACE] == 1:
            q = -row(P, m, VALUE + g * NX, 0.0, v, force) / P[m, VALUE + g * NX]
        after, rested, unit, first = np.nan, 0.0, 1.0, THEN
        if kicked:
            r = P[m, RATIOS + g]
            unit = P[m, SLOPE + g * NX + 1]
            rested = -row(P, m, SLOPE + g * NX, q, 0.0, force) / unit
            v = rested + arrive / unit
            if I[m, at + ENDS] != -1 and 0.0 < r < 1.0 and closing(P, m, g, q, force, arrive, rested):
                first = ENDS  # tried first
            if r > 0.0:
                after = -r * arrive
                v = rested + after / unit
        if not after < 0.0:
            jumped = RESET + 2 * g * NX
            q, v = row(P, m, jumped, q, v, force), row(P, m, jumped + NX, q, v, force)
            if kicked:
                after = row(P, m, SLOPE + g * NX, q, v, force)
        target, i, back = -1, first, False
        while i < THEN + I[m, CANDIDATES]:
            c = I[m, at + i]
            if c == -2:
                return ASIDE, m, q, v
            # a rebound with a known speed: into the same mode, or where friction turns round
            back = c >= 0 and after < 0.0 and (c == m or (I[m, at + KICK] == 2 and I[c, HELD] == 0))
            if back or (c >= 0 and (i == ENDS or I[c, HELD] == 0 or not after < 0.0)):
                if may_start(P, I, c, q, rested if i == ENDS else v, force, a, due, g if back else np.int64(-1)):
                    target = c
                    break
            i = THEN if i == ENDS else i + 1
        if target < 0:
            return ASIDE, m, q, v
        if i == ENDS:
            v = rested
        if I[m, at + HIT] == 1:
            tally[HITS] += 1.0
            tally[LEAST] = min(tally[LEAST], 0.0 if i == ENDS else arrive)
        for c in range(GUARDS):
            due[ORDERS + c], due[KNOWN + c] = due[NEW_ORDERS + c], np.nan
        if back:
            due[ORDERS + g], due[KNOWN + g] = 1.0, after
            if target != m:  # two events at one instant
                tally[EVENTS] += 1.0
        m = target
        if I[m, HELD] > 0:
            q, v = hold(P, m, q, v, force)


@leaf
def period(given, m, room, limit):
    """Integrate ``room[0]`` (2,) in place over the forcing period that starts at phase 0; return status and mode.

    ``phases`` (FORCINGS (substeps + 1),) are the forcing states on the grid, one after the other, ``forced`` for every mode
    and substep what they add to the state after it, and to values and slopes of the guards at its start.  ``tally`` (3,) receives
    the number of events, the number of impacts and contacts, both added to what is there, and the least speed of arrival.
    Status DONE, LIMIT or ASIDE; in the last two ``y`` is of no use.
    """
    P, I, phases, forced, y, due = given.P, given.I, given.phases, given.forced, room[0], room[5]
    q, v = y[0], y[1]
    steps = phases.size // FORCINGS - 1
    third = P[0, STEP] / 3.0
    due[OPEN], fresh = 0.0, True
    for k in range(steps):
        if due[OPEN] == 0.0:
            t = (m * (steps + 1) + k) * FORCED
            q1 = P[m, FLOW] * q + (P[m, FLOW + 1] * v + forced[t])
            v1 = P[m, FLOW + NX] * q + (P[m, FLOW + NX + 1] * v + forced[t + 1])
            clear = True
            for g in range(I[m, GUARDED]):
                at, o = g * NX, t + 2 + 2 * g
                if fresh:
                    due[ENDS_OF + 2 * g] = P[m, VALUE + at] * q + (P[m, VALUE + at + 1] * v + forced[o])
                    due[ENDS_OF + 2 * g + 1] = (P[m, SLOPE + at] * q + (P[m, SLOPE + at + 1] * v + forced[o + 1])) * third
                b0 = due[ENDS_OF + 2 * g]
                b1 = b0 + due[ENDS_OF + 2 * g + 1]
                b3 = P[m, VALUE + at] * q1 + (P[m, VALUE + at + 1] * v1 + forced[o + FORCED])
                rise = (P[m, SLOPE + at] * q1 + (P[m, SLOPE + at + 1] * v1 + forced[o + FORCED + 1])) * third
                bound = P[m, BOUND + at] * abs(q) + (P[m, BOUND + at + 1] * abs(v) + P[m, BOUND + at + 2])
                clear = clear and max(max(b0, b3), max(b1, b3 - rise)) + bound < 0.0
                due[ENDS_OF + 2 * g], due[ENDS_OF + 2 * g + 1] = b3, rise
            fresh = False
            if clear:
                q, v = q1, v1
                continue
            fresh = True
        status, m, q, v = through(given, k, m, q, v, room, limit)
        if status != DONE:
            return status, m
    y[0], y[1] = q, v
    return DONE, m


@njit
def scratch():
    """Return what `period` works on: its arrays from the state to the tally."""
    return np.zeros(2), np.zeros(TERMS), np.zeros(3), np.zeros(64), np.zeros(FORCINGS), np.zeros(DUE), np.zeros(3)
