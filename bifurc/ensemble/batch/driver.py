"""Many starts side by side: batch steps over a period, and the scalar integrator for the starts that they defer.

This module is a template, written again around the batch step of a kind of scene: see `bifurc.ensemble.batch.packing`.

The image of a start is that of the batch step or that of `period`; which one is decided by the start alone, so labels do not
depend on neighbours, order, chunks or workers.
"""
import numpy as np

from ..._jit import NOTHING, apart, njit
from ...flow.scan import DONE, LIMIT, LOST
from ..outcomes import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED, Cells
from ..proximity import Targets, boxed
from .blank import FLOATS, FLOATS_A_MODE, NS, SIZE, WHOLES_A_MODE, WHOLES_USED, period_step
from .deferred import EVENTS, HITS, LEAST, period, scratch
from .several_modes import FAR

# rows that the batch step does not know; it knows those before: see `bifurc.ensemble.batch.several_modes.layout`
# the states, then those at the start of the period
BEGUN = NS * SIZE
STEP_HITS, STEP_LEAST, DEFERRED = ((2 * NS + i) * SIZE for i in range(3))
ALL_HITS, ALL_LEAST, FOUND, ROWS = ((2 * NS + i) * SIZE for i in range(10, 14))


@apart(NOTHING)
def advance(given, W, index, active, modes, room, limit):
    """Take the batch over a period: by its step, those that it defers by `period`, which also takes those with too many events.

    ``given`` are `packing.Numbers`, ``room`` is `scratch`.  The row FOUND becomes 0, -2 - status where `period` fails.
    """
    y, tally = room[0], room[1]
    for c in range(NS):
        for l in range(active):
            W[BEGUN + c * SIZE + l] = W[c * SIZE + l]
    if given.scalar:
        for l in range(active):
            W[DEFERRED + l] = 1.0
    else:
        period_step(W, index, active, given.T, given.numbers, given.grid, given.I, modes, limit)
    count = 0
    for l in range(active):
        lost = not W[STEP_HITS + l] <= limit
        for c in range(NS):
            lost = lost | (not abs(W[c * SIZE + l]) < FAR)
        W[DEFERRED + l] = 1.0 if lost else W[DEFERRED + l]
        W[FOUND + l] = 0.0
        count += W[DEFERRED + l] > 0.0
    for l in range(active if count > 0 else 0):
        if W[DEFERRED + l] > 0.0:
            for c in range(NS):
                y[c] = W[BEGUN + c * SIZE + l]
            tally[EVENTS], tally[HITS], tally[LEAST] = 0.0, 0.0, np.inf
            status, modes[l] = period(given, modes[l], room, limit)
            W[STEP_HITS + l], W[STEP_LEAST + l] = tally[HITS], tally[LEAST]
            for c in range(NS):
                if status == DONE and not abs(y[c]) < FAR:
                    status = LOST
            for c in range(NS):
                W[c * SIZE + l] = y[c] if status == DONE else W[BEGUN + c * SIZE + l]
            if status != DONE:
                W[FOUND + l] = -2.0 - status
    for l in range(active):
        W[ALL_HITS + l] += W[STEP_HITS + l]
        W[ALL_LEAST + l] = min(W[ALL_LEAST + l], W[STEP_LEAST + l])


@njit
def outcome(found):
    """Code of what ended the motion of a start whose FOUND is -2 - status."""
    status = -2.0 - found
    return CROWDED if status == LIMIT else (DIVERGED if status == LOST else ASK)


@njit
def label(given, modes, X, limit, most, targets, cells):
    """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed.

    ``given`` are `packing.Numbers`, ``targets`` and ``cells`` the records `Targets` and `Cells`.  Writes what became of each start;
    those with a negative mode are left to the caller.  The column of a start that is done takes the next one.
    """
    inverse, points, squares, owner, width, keys, keepers, stay = targets
    labels, periods, impacts, states, speeds = cells
    many = given.I.shape[0]
    W = np.zeros(ROWS + FLOATS + FLOATS_A_MODE * many)
    index = np.zeros(SIZE + 8 + WHOLES_USED + WHOLES_A_MODE * many, np.int64)
    room = scratch()
    y = room[0]
    at, ids, begun = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    visits, guests = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    following, active, now = 0, 0, 0
    while True:
        while following < X.shape[0] and active < SIZE:
            if modes[following] >= 0:
                ids[active], at[active], begun[active], visits[active], guests[active] = following, modes[following], now, 0, -1
                for c in range(NS):
                    W[c * SIZE + active] = X[following, c]
                W[ALL_HITS + active], W[ALL_LEAST + active] = 0.0, np.inf
                active += 1
            following += 1
        if active == 0:
            return
        advance(given, W, index, active, at, room, limit)
        now += 1
        for t in range(points.shape[0]):
            square, number = squares[t], 1.0 + owner[t]
            for l in range(active):
                away = 0.0
                for c in range(NS):
                    d = W[c * SIZE + l] * inverse[c] - points[t, c]
                    away += d * d
                close = (away <= square) & (W[FOUND + l] == 0.0)
                W[FOUND + l] = number if close else W[FOUND + l]
        ended = 0
        for l in range(active):
            ended += (W[FOUND + l] != 0.0) | (now - begun[l] >= most)
        l = active if ended > 0 or keys.shape[0] > 0 else 0
        while l > 0:
            l -= 1
            found = W[FOUND + l]
            if found == 0.0:
                if keys.shape[0] > 0:
                    for c in range(NS):
                        y[c] = W[c * SIZE + l]
                    keeper = boxed(y, inverse, width, keys, keepers)
                    visits[l] = visits[l] + 1 if keeper >= 0 and (keeper == guests[l] or visits[l] == 0) else 0
                    guests[l] = keeper
                    if visits[l] >= stay:
                        found = 1.0 + keeper
                if found == 0.0 and now - begun[l] < most:
                    continue
            i = ids[l]
            labels[i], states[i] = -1, UNSETTLED
            if found > 0.0:
                labels[i], states[i] = np.int64(found) - 1, REACHED
            elif found < 0.0:
                states[i] = outcome(found)
            periods[i], impacts[i], speeds[i] = now - begun[l], W[ALL_HITS + l], W[ALL_LEAST + l]
            active -= 1
            for c in range(NS):
                X[i, c], W[c * SIZE + l] = W[c * SIZE + l], W[c * SIZE + active]
            W[ALL_HITS + l], W[ALL_LEAST + l] = W[ALL_HITS + active], W[ALL_LEAST + active]
            ids[l], at[l], begun[l], visits[l], guests[l] = ids[active], at[active], begun[active], visits[active], guests[active]


def carry(given, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, ns), in place, over forcing periods; write what became of each: `label` without attractors."""
    cells = Cells(np.empty_like(outcomes), np.empty_like(outcomes), impacts, outcomes, speeds)
    label(given, modes, X, limit, periods, Targets.none(NS), cells)
    outcomes[outcomes == UNSETTLED] = REACHED
