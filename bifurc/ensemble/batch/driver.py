"""Many starts side by side, by batch steps over a period: to their attractors, or over so many periods.

This module is a template, written again around the batch step of a kind of scene: see `bifurc.ensemble.batch.packing`.

The image of a start is decided by the start alone, so that labels do not depend on neighbours, order, chunks or workers.
"""
import numpy as np

from ..._jit import NOTHING, apart, njit
from ...flow.scan import LIMIT, LOST
from ..outcomes import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED, Cells
from ..proximity import Targets, boxed
from ..scalar import room

# what is written in the place of the rest of this part: sizes, and the batch step
SIZE, NS = 576, 2  # starts that are carried side by side, and their states
FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = 0, 0, 0, 0  # of scratch that the batch step takes behind the rows below


@njit
def period_step(W, index, count, given, modes, limit, spare):
    """Take the first ``count`` starts of ``W`` over a forcing period, see `several_modes` and `smooth` beside it."""


# what is the same for all kinds
FAR = 1e150  # of a state; beyond it the motion is lost
# rows: the states, those at the start of the period, then impacts, least speed of arrival, what ended the motion (0: nothing,
# -2 - status; then a label), events of the period; behind these the batch step has its own, see `several_modes.layout`
BEGUN = NS * SIZE
HITS, LEAST, FOUND, EVENTS, _, ROWS = ((2 * NS + i) * SIZE for i in range(6))


@apart(NOTHING, counted=False)
def advance(given, W, index, active, modes, limit, spare):
    """Take the batch over a period; one that ends on the way keeps the state before it.  ``given`` are `packing.Numbers`."""
    for c in range(NS):
        for l in range(active):
            W[BEGUN + c * SIZE + l] = W[c * SIZE + l]
    for l in range(active):
        W[FOUND + l] = W[EVENTS + l] = 0.0
    period_step(W, index, active, given, modes, limit, spare)
    for l in range(active):
        lost = False
        for c in range(NS):
            lost = lost | (not abs(W[c * SIZE + l]) < FAR)
        ended = -2.0 - LOST if lost else (-2.0 - LIMIT if W[EVENTS + l] > limit else 0.0)
        W[FOUND + l] = ended if W[FOUND + l] == 0.0 else W[FOUND + l]
    for c in range(NS):
        for l in range(active):
            W[c * SIZE + l] = W[c * SIZE + l] if W[FOUND + l] == 0.0 else W[BEGUN + c * SIZE + l]


@njit
def lined(count):
    """Return ``count`` zeros that begin on a cache line: vectors across two of them cost three masses a fifth."""
    longer = np.zeros(count + 7)
    first = -(longer.ctypes.data // 8) % 8
    return longer[first:first + count]


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
    W = lined(ROWS + FLOATS + FLOATS_A_MODE * many)
    index = np.zeros(SIZE + 8 + WHOLES_USED + WHOLES_A_MODE * many, np.uint32)
    spare = room(given.T)
    y = spare[0]
    at, ids, begun = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    visits, guests = np.zeros(SIZE, np.int64), np.zeros(SIZE, np.int64)
    following, active, now = 0, 0, 0
    while True:
        while following < X.shape[0] and active < SIZE:
            if modes[following] >= 0:
                ids[active], at[active], begun[active], visits[active], guests[active] = following, modes[following], now, 0, -1
                for c in range(NS):
                    W[c * SIZE + active] = X[following, c]
                W[HITS + active], W[LEAST + active] = 0.0, np.inf
                active += 1
            following += 1
        if active == 0:
            return
        advance(given, W, index, active, at, limit, spare)
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
            periods[i], impacts[i], speeds[i] = now - begun[l], W[HITS + l], W[LEAST + l]
            active -= 1
            for c in range(NS):
                X[i, c], W[c * SIZE + l] = W[c * SIZE + l], W[c * SIZE + active]
            W[HITS + l], W[LEAST + l] = W[HITS + active], W[LEAST + active]
            ids[l], at[l], begun[l], visits[l], guests[l] = ids[active], at[active], begun[active], visits[active], guests[active]


def carry(given, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, ns), in place, over forcing periods; write what became of each: `label` without attractors."""
    cells = Cells(np.empty_like(outcomes), np.empty_like(outcomes), impacts, outcomes, speeds)
    label(given, modes, X, limit, periods, Targets.none(NS), cells)
    outcomes[outcomes == UNSETTLED] = REACHED
