"""Many starts of one degree of freedom: laps of lanes side by side, a certified march for those that are set aside.

This module is a template, written again around the lap of a kind of scene: see `bifurc.basins.lanes`.

The image of a start is that of the lap or that of `period`; which one is decided by the start alone, so labels do not
depend on neighbours, order, chunks or workers.
"""
import numpy as np

from .._jit import njit
from ..flow.scan import DONE, LIMIT, LOST
from .lanesblank import FLOATS, FLOATS_A_MODE, LANES, WHOLES_A_MODE, WHOLES_USED, lap
from .lanesmodes import ANY, FAR, NONE
from .lanesperiod import EVENTS, HITS, LEAST, period, scratch
from .near import boxed
from .states import ASK, CROWDED, DIVERGED, REACHED, UNSETTLED

# rows of lanes that the lap does not know; it knows those before: see `bifurc.basins.lanestext.ROWS`
Q, V, Q0, V0, LAP_HITS, LAP_LEAST, SET_ASIDE = (i * LANES for i in range(7))
ALL_HITS, ALL_LEAST, FOUND, ROWS = 14 * LANES, 15 * LANES, 16 * LANES, 17 * LANES


@njit
def load(W, l, q, v):
    """Put a start into lane ``l``."""
    W[Q + l], W[V + l] = q, v
    W[ALL_HITS + l], W[ALL_LEAST + l] = 0.0, np.inf


@njit
def move(W, to, source):
    """Copy a lane."""
    for at in (Q, V, ALL_HITS, ALL_LEAST):
        W[at + to] = W[at + source]


@njit
def around(W, index, active, numbers, grid, I, home, strangers, modes, limit):
    """Carry all lanes over a period by the lap; return how many are set aside: also other modes, too many events, the lost.

    ``home`` is the mode of the lap, ANY, or NONE.
    """
    if home == NONE:
        for l in range(active):
            W[Q0 + l], W[V0 + l], W[SET_ASIDE + l], W[FOUND + l] = W[Q + l], W[V + l], 1.0, 0.0
        return active
    for l in range(active):
        W[Q0 + l], W[V0 + l] = W[Q + l], W[V + l]
    lap(W, index, active, numbers, grid, I, modes, limit)
    if strangers and home != ANY:
        for l in range(active):
            if modes[l] != home:
                W[SET_ASIDE + l] = 1.0
    count = 0
    for l in range(active):
        lost = not ((abs(W[Q + l]) < FAR) & (abs(W[V + l]) < FAR) & (W[LAP_HITS + l] <= limit))
        W[SET_ASIDE + l] = 1.0 if lost else W[SET_ASIDE + l]
        W[FOUND + l] = 0.0
        count += W[SET_ASIDE + l] > 0.0
    return count


@njit
def mend(P, I, harmonics, phases, forced, home, modes, W, active, y, a, out, stack, force, due, tally, limit):
    """Take the period of all lanes that are set aside again; the row FOUND gets -2 - status where it fails.

    Returns whether any lane is now in another mode than that of the lap, and how many failed.
    """
    strangers, failed = False, 0
    for l in range(active):
        if W[SET_ASIDE + l] > 0.0:
            y[0], y[1] = W[Q0 + l], W[V0 + l]
            tally[EVENTS], tally[HITS], tally[LEAST] = 0.0, 0.0, np.inf
            status, mode = period(P, I, harmonics, phases, forced, modes[l], y, a, out, stack, force, due, tally, limit)
            modes[l] = mode
            strangers = strangers or mode != home
            W[LAP_HITS + l], W[LAP_LEAST + l] = tally[HITS], tally[LEAST]
            if status == DONE and not (abs(y[0]) < FAR and abs(y[1]) < FAR):
                status = LOST
            if status == DONE:
                W[Q + l], W[V + l] = y[0], y[1]
            else:
                W[Q + l], W[V + l] = W[Q0 + l], W[V0 + l]
                W[FOUND + l] = -2.0 - status
                failed += 1
    return strangers, failed


@njit
def counted(W, active):
    """Add impacts and speeds of the lap to those of the start."""
    for l in range(active):
        W[ALL_HITS + l] += W[LAP_HITS + l]
        W[ALL_LEAST + l] = min(W[ALL_LEAST + l], W[LAP_LEAST + l])


@njit
def outcome(found):
    """Code of what ended the motion of a lane whose FOUND is -2 - status."""
    status = -2.0 - found
    return CROWDED if status == LIMIT else (DIVERGED if status == LOST else ASK)


@njit
def carry(P, I, harmonics, phases, forced, home, numbers, grid, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, 2), in place, over forcing periods; write what became of each.

    ``P`` to ``grid`` are `bifurc.basins.lanes.Numbers`.  Starts with a negative mode are left to the caller; where a motion
    ends early, ``X`` is its last section point.
    """
    W = np.zeros(ROWS + FLOATS + FLOATS_A_MODE * I.shape[0])
    index = np.zeros(LANES + 8 + WHOLES_USED + WHOLES_A_MODE * I.shape[0], np.int64)
    y, a, out, stack, force, due, tally = scratch()
    at, ids = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    following = 0
    while following < X.shape[0]:
        active, strangers = 0, False
        while following < X.shape[0] and active < LANES:
            if modes[following] >= 0:
                ids[active], at[active] = following, modes[following]
                strangers = strangers or at[active] != home
                load(W, active, X[following, 0], X[following, 1])
                active += 1
            following += 1
        for _ in range(periods):
            count, failed = around(W, index, active, numbers, grid, I, home, strangers, at, limit), 0
            if count > 0:
                strangers, failed = mend(P, I, harmonics, phases, forced, home, at, W, active, y, a, out, stack, force, due,
                                         tally, limit)
            counted(W, active)
            l = active if failed > 0 else 0
            while l > 0:  # those that failed go, the last lane takes their place
                l -= 1
                if W[FOUND + l] < 0.0:
                    i = ids[l]
                    X[i, 0], X[i, 1] = W[Q + l], W[V + l]
                    impacts[i], speeds[i], outcomes[i] = W[ALL_HITS + l], W[ALL_LEAST + l], outcome(W[FOUND + l])
                    active -= 1
                    ids[l], at[l] = ids[active], at[active]
                    move(W, l, active)
        for l in range(active):
            i = ids[l]
            X[i, 0], X[i, 1] = W[Q + l], W[V + l]
            impacts[i], speeds[i], outcomes[i] = W[ALL_HITS + l], W[ALL_LEAST + l], REACHED


@njit
def label(P, I, harmonics, phases, forced, home, numbers, grid, modes, X, limit, most, inverse, points, squares, owner, width, keys,
          keepers, stay, labels, periods, impacts, states, speeds):
    """Follow the starts ``X`` (N, 2), in place, until they are near an attractor or ``most`` periods have passed.

    ``P`` to ``grid`` are `bifurc.basins.lanes.Numbers`; ``inverse`` to ``stay`` see `bifurc.basins.near`.  Writes label
    (-1: none), periods, impacts, state and least speed of arrival of each; starts with a negative mode are left to the
    caller.  A lane that is done takes the next start.
    """
    W = np.zeros(ROWS + FLOATS + FLOATS_A_MODE * I.shape[0])
    index = np.zeros(LANES + 8 + WHOLES_USED + WHOLES_A_MODE * I.shape[0], np.int64)
    y, a, out, stack, force, due, tally = scratch()
    at, ids, ages = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    visits, guests = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    following, active, strangers = 0, 0, False
    x_unit, v_unit = inverse[0], inverse[1]
    while True:
        while following < X.shape[0] and active < LANES:
            if modes[following] >= 0:
                ids[active], at[active], ages[active], visits[active], guests[active] = following, modes[following], 0, 0, -1
                strangers = strangers or at[active] != home
                load(W, active, X[following, 0], X[following, 1])
                active += 1
            following += 1
        if active == 0:
            return
        if around(W, index, active, numbers, grid, I, home, strangers, at, limit) > 0:
            strangers, _ = mend(P, I, harmonics, phases, forced, home, at, W, active, y, a, out, stack, force, due, tally, limit)
        counted(W, active)
        for t in range(points.shape[0]):
            x, z, square, number = points[t, 0], points[t, 1], squares[t], 1.0 + owner[t]
            for l in range(active):
                dx, dz = W[Q + l] * x_unit - x, W[V + l] * v_unit - z
                close = (dx * dx + dz * dz <= square) & (W[FOUND + l] == 0.0)
                W[FOUND + l] = number if close else W[FOUND + l]
        l = active
        while l > 0:
            l -= 1
            i, found = ids[l], W[FOUND + l]
            ages[l] += 1
            if found == 0.0:
                if keys.shape[0] > 0:
                    y[0], y[1] = W[Q + l], W[V + l]
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
            X[i, 0], X[i, 1] = W[Q + l], W[V + l]
            active -= 1
            ids[l], at[l], ages[l], visits[l], guests[l] = ids[active], at[active], ages[active], visits[active], guests[active]
            move(W, l, active)
