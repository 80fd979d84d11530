"""Many starts side by side: batch steps over a period, and the scalar integrator for the starts that they defer.

This module is a template, written again around the batch step of a kind of scene: see `bifurc.ensemble.batch.packing`.

The image of a start is that of the batch step or that of `period`; which one is decided by the start alone, so labels do not
depend on neighbours, order, chunks or workers.
"""
import numpy as np
from numba.core.types import Tuple

from ..._jit import FLAG, WHOLE, apart, njit
from ...flow.scan import DONE, LIMIT, LOST
from ..outcomes import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED
from ..proximity import boxed
from .blank import FLOATS, FLOATS_A_MODE, NS, SIZE, WHOLES_A_MODE, WHOLES_USED, period_step
from .certified import EVENTS, HITS, LEAST, period, scratch
from .several_modes import ANY, FAR, NONE

# rows that the batch step does not know; it knows those before: see `bifurc.ensemble.batch.several_modes.layout`
# the states, then those at the start of the period
BEGUN = NS * SIZE
STEP_HITS, STEP_LEAST, DEFERRED = ((2 * NS + i) * SIZE for i in range(3))
ALL_HITS, ALL_LEAST, FOUND, ROWS = ((2 * NS + i) * SIZE for i in range(10, 14))


@njit
def load(W, l, X, i):
    """Put start ``i`` into column ``l`` of the batch."""
    for c in range(NS):
        W[c * SIZE + l] = X[i, c]
    W[ALL_HITS + l], W[ALL_LEAST + l] = 0.0, np.inf


@njit
def move(W, to, source):
    """Copy a column."""
    for c in range(NS):
        W[c * SIZE + to] = W[c * SIZE + source]
    for at in (ALL_HITS, ALL_LEAST):
        W[at + to] = W[at + source]


@njit
def unload(W, l, X, i):
    """Write the state in column ``l`` to start ``i``."""
    for c in range(NS):
        X[i, c] = W[c * SIZE + l]


@apart(WHOLE)
def around(W, index, active, P, numbers, grid, I, home, strangers, modes, limit):
    """Take the batch over a period by its step; return how many are deferred: also other modes, too many events, the lost.

    ``home`` is the mode of the batch step, ANY, or NONE.
    """
    for c in range(NS):
        for l in range(active):
            W[BEGUN + c * SIZE + l] = W[c * SIZE + l]
    if home == NONE:
        for l in range(active):
            W[DEFERRED + l], W[FOUND + l] = 1.0, 0.0
        return active
    period_step(W, index, active, P, numbers, grid, I, modes, limit)
    if strangers and home != ANY:
        for l in range(active):
            if modes[l] != home:
                W[DEFERRED + l] = 1.0
    count = 0
    for l in range(active):
        lost = not W[STEP_HITS + l] <= limit
        for c in range(NS):
            lost = lost | (not abs(W[c * SIZE + l]) < FAR)
        W[DEFERRED + l] = 1.0 if lost else W[DEFERRED + l]
        W[FOUND + l] = 0.0
        count += W[DEFERRED + l] > 0.0
    return count


@apart(Tuple((FLAG, WHOLE)))
def mend(given, modes, W, active, room, limit):
    """Take the period of all starts that are deferred again; the row FOUND gets -2 - status where it fails.

    ``given`` are `packing.Numbers`, ``room`` is `scratch`.  Returns whether any start is now in another mode than that of the batch
    step, and how many failed.
    """
    y, tally = room[0], room[6]
    strangers, failed = False, 0
    for l in range(active):
        if W[DEFERRED + l] > 0.0:
            for c in range(NS):
                y[c] = W[BEGUN + c * SIZE + l]
            tally[EVENTS], tally[HITS], tally[LEAST] = 0.0, 0.0, np.inf
            status, mode = period(given, modes[l], room, limit)
            modes[l] = mode
            strangers = strangers or mode != given.home
            W[STEP_HITS + l], W[STEP_LEAST + l] = tally[HITS], tally[LEAST]
            for c in range(NS):
                if status == DONE and not abs(y[c]) < FAR:
                    status = LOST
            for c in range(NS):
                W[c * SIZE + l] = y[c] if status == DONE else W[BEGUN + c * SIZE + l]
            if status != DONE:
                W[FOUND + l] = -2.0 - status
                failed += 1
    return strangers, failed


@njit
def counted(W, active):
    """Add impacts and speeds of the batch step to those of the start."""
    for l in range(active):
        W[ALL_HITS + l] += W[STEP_HITS + l]
        W[ALL_LEAST + l] = min(W[ALL_LEAST + l], W[STEP_LEAST + l])


@njit
def outcome(found):
    """Code of what ended the motion of a start whose FOUND is -2 - status."""
    status = -2.0 - found
    return CROWDED if status == LIMIT else (DIVERGED if status == LOST else ASK)


@njit
def carry(given, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, ns), in place, over forcing periods; write what became of each.

    ``given`` are `packing.Numbers`.  Starts with a negative mode are left to the caller; where a motion ends early, ``X`` is its
    last section point.
    """
    P, I, home, numbers, grid = given.P, given.I, given.home, given.numbers, given.grid
    W = np.zeros(ROWS + FLOATS + FLOATS_A_MODE * I.shape[0])
    index = np.zeros(SIZE + 8 + WHOLES_USED + WHOLES_A_MODE * I.shape[0], np.int64)
    room = scratch()
    at, ids = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    following = 0
    while following < X.shape[0]:
        active, strangers = 0, False
        while following < X.shape[0] and active < SIZE:
            if modes[following] >= 0:
                ids[active], at[active] = following, modes[following]
                strangers = strangers or at[active] != home
                load(W, active, X, following)
                active += 1
            following += 1
        for _ in range(periods):
            count, failed = around(W, index, active, P, numbers, grid, I, home, strangers, at, limit), 0
            if count > 0:
                strangers, failed = mend(given, at, W, active, room, limit)
            counted(W, active)
            l = active if failed > 0 else 0
            while l > 0:  # those that failed go, the last start takes their place
                l -= 1
                if W[FOUND + l] < 0.0:
                    i = ids[l]
                    unload(W, l, X, i)
                    impacts[i], speeds[i], outcomes[i] = W[ALL_HITS + l], W[ALL_LEAST + l], outcome(W[FOUND + l])
                    active -= 1
                    ids[l], at[l] = ids[active], at[active]
                    move(W, l, active)
        for l in range(active):
            i = ids[l]
            unload(W, l, X, i)
            impacts[i], speeds[i], outcomes[i] = W[ALL_HITS + l], W[ALL_LEAST + l], REACHED


@njit
def label(given, modes, X, limit, most, targets, cells):
    """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed.

    ``given`` are `packing.Numbers`, ``targets`` and ``cells`` the records `Targets` and `Cells` of `bifurc.ensemble.integrator`.
    Writes what became of each start; those with a negative mode are left to the caller.  The column of a start that is done takes
    the next one.
    """
    P, I, home, numbers, grid = given.P, given.I, given.home, given.numbers, given.grid
    inverse, points, squares, owner, width, keys, keepers, stay = targets
    labels, periods, impacts, states, speeds = cells
    W = np.zeros(ROWS + FLOATS + FLOATS_A_MODE * I.shape[0])
    index = np.zeros(SIZE + 8 + WHOLES_USED + WHOLES_A_MODE * I.shape[0], np.int64)
    room = scratch()
    y = room[0]
    at, ids, ages = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    visits, guests = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    following, active, strangers = 0, 0, False
    while True:
        while following < X.shape[0] and active < SIZE:
            if modes[following] >= 0:
                ids[active], at[active], ages[active], visits[active], guests[active] = following, modes[following], 0, 0, -1
                strangers = strangers or at[active] != home
                load(W, active, X, following)
                active += 1
            following += 1
        if active == 0:
            return
        if around(W, index, active, P, numbers, grid, I, home, strangers, at, limit) > 0:
            strangers, _ = mend(given, at, W, active, room, limit)
        counted(W, active)
        for t in range(points.shape[0]):
            square, number = squares[t], 1.0 + owner[t]
            for l in range(active):
                away = 0.0
                for c in range(NS):
                    d = W[c * SIZE + l] * inverse[c] - points[t, c]
                    away += d * d
                close = (away <= square) & (W[FOUND + l] == 0.0)
                W[FOUND + l] = number if close else W[FOUND + l]
        l = active
        while l > 0:
            l -= 1
            i, found = ids[l], W[FOUND + l]
            ages[l] += 1
            if found == 0.0:
                if keys.shape[0] > 0:
                    for c in range(NS):
                        y[c] = W[c * SIZE + l]
                    keeper = boxed(y, inverse, width, keys, keepers)
                    visits[l] = visits[l] + 1 if keeper >= 0 and (keeper == guests[l] or visits[l] == 0) else 0
                    guests[l] = keeper
                    if visits[l] >= stay:
                        found = 1.0 + keeper
                if found == 0.0 and ages[l] < most:
                    continue
            labels[i], states[i] = -1, UNSETTLED
            if found > 0.0:
                labels[i], states[i] = np.int64(found) - 1, REACHED
            elif found < 0.0:
                states[i] = outcome(found)
            periods[i], impacts[i], speeds[i] = ages[l], W[ALL_HITS + l], W[ALL_LEAST + l]
            unload(W, l, X, i)
            active -= 1
            ids[l], at[l], ages[l], visits[l], guests[l] = ids[active], at[active], ages[active], visits[active], guests[active]
            move(W, l, active)
