"""Many starts of any scene: on the general integration `bifurc.flow.scan.run`; and what batch steps defer to it."""
import numpy as np

from .._jit import leaf, njit
from ..compose.tables import ORDER
from ..elements.kinds import EventKind
from ..flow.affine.engine import forcing
from ..flow.rule import admit, sizes
from ..flow.scan import (
    BEFORE,
    CHATTER,
    COUNT,
    DONE,
    EVENTS,
    FULL,
    GUARD,
    KIND,
    LIMIT,
    LOST,
    MODE,
    ORDERS,
    PASSED,
    SPEED,
    STATE,
    TAU,
    run,
    workspace,
)
from .outcomes import ASK, CROWDED, DIVERGED, REACHED, STOPPED, UNCLEAR, UNSETTLED, Cells
from .proximity import Targets, boxed, nearest

CONTACT = EventKind.CONTACT.code
ROWS = 64  # of the record from which impacts are counted


@njit
def begin_at(m, y, ints, floats, x):
    """Write the start ``y`` (ns,) at phase 0 in mode ``m`` into the workspace."""
    ns, nx = y.size, x.size
    for c in range(ns):
        x[c] = y[c]
    for c in range(ns, nx):
        x[c] = 1.0 if c == ns or (c - ns) % 2 == 1 else 0.0
    ints[:] = 0
    floats[:] = np.nan
    ints[MODE], floats[TAU] = m, 0.0


@njit
def decided(T, candidates, ints, x, scale, signs, a):
    """Write the first mode whose holds and guards all allow the state ``x`` (nx,); return whether there is one.

    The rule of `bifurc.flow.settle.start`, without its corrections and its arrivals: those go to the simulation.
    """
    sizes(T, x, scale)
    for m in candidates:
        if admit(T, m, x, scale, signs, ints[ORDERS:], a):
            ints[MODE] = m
            return True
    return False


@njit
def started(T, candidates, m, y, ints, floats, x, scale, signs, a):
    """Write the start ``y`` (ns,) into the workspace; return whether its mode is known."""
    if m < 0 and m != UNCLEAR:
        return False
    begin_at(max(m, 0), y, ints, floats, x)
    return m >= 0 or decided(T, candidates, ints, x, scale, signs, a)


@njit
def integrate(T, ints, floats, x, whole, tau, limit, rows, record, tally):
    """Integrate ``x`` (nx,) to the time ``tau`` after section number ``whole``; return the status of `run`.

    ``tally`` (2,) receives the number of impacts and contacts, added to [0], and the least speed of arrival, in [1].
    """
    kick, kind = T.kick, T.kind
    ints[COUNT] = 0  # an integration that ends on a section leaves the events of its last period there
    code = FULL
    while code == FULL:
        code = run(T, ints, floats, x, whole, tau, limit, rows, record)
        for e in range(ints[EVENTS]):
            m, g = rows[e, BEFORE], rows[e, GUARD]
            if rows[e, KIND] != PASSED and g >= 0 and (kick[m, g] == 1 or kind[m, g] == CONTACT):
                tally[0] += 1.0
                tally[1] = min(tally[1], 0.0 if rows[e, KIND] == CHATTER else record[e, SPEED])
        ints[EVENTS] = 0
    return code


@njit
def room(T):
    """Return what `substep` works on: state (ns,), tally (events, impacts and contacts, least speed of arrival), room."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    ints, floats = workspace(T)
    return np.zeros(ns), np.zeros(3), np.zeros(nx), floats, np.zeros((ROWS, STATE + 2 * ns)), ints, np.zeros((ROWS, 5), np.int64)


@leaf
def substep(T, k, steps, h, m, spare, limit):
    """Integrate ``spare[0]`` (ns,) in place over substep ``k`` of a period; return status and mode; write the tally.

    What a batch step defers: several events, or one that is not clear.  ``spare`` is the `room`.
    """
    y, tally, x, floats, record, ints, rows = spare
    last = k + 1 == steps
    begin_at(m, y, ints, floats, x)
    floats[TAU] = k * h
    forcing(T, k * h, x)
    tally[1], tally[2] = 0.0, np.inf
    status = integrate(T, ints, floats, x, 1 if last else 0, 0.0 if last else (k + 1) * h, limit, rows, record, tally[1:])
    tally[0] = ints[COUNT]
    for c in range(y.size):
        y[c] = x[c]
    return status, ints[MODE]


@njit
def recall(F, m, x, first):
    """Write the memory of ``x`` (nx,) as mode ``m`` has it: what follows the motion is kept up when its mode is left only.

    ``F`` (modes, nz, nx): a row for every memory, which begin at ``first``.
    """
    for i in range(F.shape[1]):
        total = 0.0
        for c in range(x.shape[0]):
            total += F[m, i, c] * x[c]
        x[first + i] = total


@njit
def label(T, F, candidates, modes, X, limit, most, targets, cells):
    """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed.

    ``F`` see `recall`, ``candidates`` are the modes tried where that of a start is unclear, ``targets`` and ``cells`` the records
    `Targets` and `Cells`.  Writes what became of each start; where a motion ends early, ``X`` is its last section point; starts
    whose mode cannot be told are left to the caller.
    """
    inverse, points, squares, owner, width, keys, keepers, stay = targets
    labels, periods, impacts, states, speeds = cells
    ns, nx = T.A.shape[1], T.A.shape[2]
    ints, floats = workspace(T)
    rows = np.zeros((ROWS, 5), np.int64)
    record = np.zeros((ROWS, STATE + 2 * ns))
    x, scale, signs, a = np.empty(nx), np.empty(nx), np.empty(ints.size, np.int64), np.empty(ORDER + 1)
    y = x[:ns]
    tally = np.empty(2)
    for i in range(X.shape[0]):
        if not started(T, candidates, modes[i], X[i], ints, floats, x, scale, signs, a):
            continue
        tally[0], tally[1] = 0.0, np.inf
        labels[i] = -1
        states[i] = UNSETTLED
        visits = 0
        guest = -1
        for k in range(1, most + 1):
            if modes[i] == STOPPED:
                return
            code = integrate(T, ints, floats, x, k, 0.0, limit, rows, record, tally)
            periods[i] = k
            if code != DONE:
                states[i] = CROWDED if code == LIMIT else (DIVERGED if code == LOST else ASK)
                break
            recall(F, ints[MODE], x, ns - F.shape[1])
            for c in range(ns):
                X[i, c] = x[c]
            found = nearest(y, inverse, points, squares, owner)
            if found < 0 and keys.shape[0] > 0:
                keeper = boxed(y, inverse, width, keys, keepers)
                visits = visits + 1 if keeper >= 0 and (keeper == guest or visits == 0) else 0
                guest = keeper
                if visits >= stay:
                    found = keeper
            if found >= 0:
                labels[i] = found
                states[i] = REACHED
                break
        impacts[i], speeds[i] = tally[0], tally[1]


def map_starts(T, F, candidates, modes, X, limit, periods, outcomes, impacts, speeds):
    """Carry the starts ``X`` (N, ns), in place, over forcing periods; write what became of each: `label` without attractors.

    Starts whose mode cannot be told are left to the caller.
    """
    cells = Cells(np.empty_like(outcomes), np.empty_like(outcomes), impacts, outcomes, speeds)
    label(T, F, candidates, modes, X, limit, periods, Targets.none(X.shape[1]), cells)
    outcomes[outcomes == UNSETTLED] = REACHED
