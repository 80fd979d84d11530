"""Many starts side by side, by batch steps over a period: to their attractors, or over so many periods.

This module is a template, written again around the batch step of a kind of scene: see `bifurc.ensemble.batch.writing`.

The image of a start is decided by the start alone, so that labels do not depend on neighbours, order, chunks or workers.
"""
import numpy as np

from ..._jit import NOTHING, apart, njit
from ...flow.scan import LIMIT, LOST
from ..outcomes import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED, Cells
from ..proximity import Targets, boxed
from ..scalar import room
from .step import AT_BEGUN, AT_CAP, AT_EVENTS, AT_FOUND, AT_HITS, AT_IDS, AT_LEAST, AT_LISTS, AT_STATE, NS, SIZE, period_step

FAR = 1e150  # of a state; beyond it the motion is lost
START, MODE, BEGAN, VISITS, GUEST, WHOLES = range(6)  # rows of what is known of those under way


@apart(NOTHING, counted=False)
def advance(given, W, index, active, modes, limit, spare):
    """Take the batch over a period; one that ends on the way keeps the state before it.  ``given`` are `packing.Numbers`."""
    for c in range(NS):
        for l in range(active):
            W[AT_BEGUN + c * AT_CAP + l] = W[c * AT_CAP + l]
    for l in range(active):
        W[AT_FOUND + l] = W[AT_EVENTS + l] = 0.0
    period_step(W, index, active, given, modes, limit, spare)
    for l in range(active):
        lost = False
        for c in range(NS):
            lost = lost | (not abs(W[c * AT_CAP + l]) < FAR)
        ended = -2.0 - LOST if lost else (-2.0 - LIMIT if W[AT_EVENTS + l] > limit else 0.0)
        W[AT_FOUND + l] = ended if W[AT_FOUND + l] == 0.0 else W[AT_FOUND + l]
    for c in range(NS):
        for l in range(active):
            W[c * AT_CAP + l] = W[c * AT_CAP + l] if W[AT_FOUND + l] == 0.0 else W[AT_BEGUN + c * AT_CAP + l]


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
    many = given.numbers.size
    W = lined(AT_LISTS + 2 * AT_STATE * many)
    index = np.zeros(AT_IDS + (AT_CAP + 1) * many, np.uint32)
    spare, own = room(given.T), np.zeros((WHOLES, SIZE), np.int64)
    y, begun, visits, guests = spare[0], own[BEGAN], own[VISITS], own[GUEST]
    following, active, now = 0, 0, 0
    while True:
        while following < X.shape[0] and active < SIZE:
            if modes[following] >= 0:
                own[START, active], own[MODE, active], begun[active] = following, modes[following], now
                visits[active], guests[active] = 0, -1
                for c in range(NS):
                    W[c * AT_CAP + active] = X[following, c]
                W[AT_HITS + active], W[AT_LEAST + active] = 0.0, np.inf
                active += 1
            following += 1
        if active == 0:
            return
        advance(given, W, index, active, own[MODE], limit, spare)
        now += 1
        for t in range(points.shape[0]):
            square, number = squares[t], 1.0 + owner[t]
            for l in range(active):
                away = 0.0
                for c in range(NS):
                    d = W[c * AT_CAP + l] * inverse[c] - points[t, c]
                    away += d * d
                close = (away <= square) & (W[AT_FOUND + l] == 0.0)
                W[AT_FOUND + l] = number if close else W[AT_FOUND + l]
        ended = 0
        for l in range(active):
            ended += (W[AT_FOUND + l] != 0.0) | (now - begun[l] >= most)
        l = active if ended > 0 or keys.shape[0] > 0 else 0
        while l > 0:
            l -= 1
            found = W[AT_FOUND + l]
            if found == 0.0 and keys.shape[0] > 0:
                for c in range(NS):
                    y[c] = W[c * AT_CAP + l]
                keeper = boxed(y, inverse, width, keys, keepers)
                visits[l] = visits[l] + 1 if keeper >= 0 and (keeper == guests[l] or visits[l] == 0) else 0
                guests[l] = keeper
                found = 1.0 + keeper if visits[l] >= stay else 0.0
            if found == 0.0 and now - begun[l] < most:
                continue
            i = own[START, l]
            labels[i] = np.int64(found) - 1 if found > 0.0 else -1
            states[i] = REACHED if found > 0.0 else (outcome(found) if found < 0.0 else UNSETTLED)
            periods[i], impacts[i], speeds[i] = now - begun[l], W[AT_HITS + l], W[AT_LEAST + l]
            for c in range(NS):
                X[i, c] = W[c * AT_CAP + l]
            active -= 1
            for c in range(NS + 2):  # hits and the least speed stand behind the states
                W[c * AT_CAP + l] = W[c * AT_CAP + active]
            own[:, l] = own[:, active]


def propagate(given, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, ns), in place, over forcing periods; write what became of each: `label` without attractors."""
    cells = Cells(np.empty_like(outcomes), np.empty_like(outcomes), impacts, outcomes, speeds)
    label(given, modes, X, limit, periods, Targets.none(NS), cells)
    outcomes[outcomes == UNSETTLED] = REACHED
