"""One compiled call for one continuation step or many: Newton in the bordered system, tangent, determinant, margins of events.

The same iteration as `continuation.problem.Problem.correct`, but that a correction next to rounding ends it, and that behind a
small one chords follow: the residual with the same events, moved to where they are now, and the same factors (modified Newton;
Kelley 1995, section 5.4).  They are not counted as iterations.  The first step may begin with the events of a motion nearby; the
last is always a full one.  And steps in which nothing lies, one after the other, by the rules of `solve.steprun`; and zeros of
tests, beside which chords with the factors of one point are enough for its neighbours.

One file, because a correction, a run of steps and the search of a zero are one problem's answers to `continuation`, with the same
arguments and arrays.
"""
from typing import NamedTuple

import numpy as np

from .._jit import WHOLE, apart, both, leaf, njit
from ..solve.dense import inner, lu, lu_solve_wide
from ..solve.steprun import (
    BACK,
    BEYOND,
    CORNER,
    HIGH,
    LAST_ROW,
    LENGTH,
    LOW,
    MADE,
    MOST,
    aside,
    beside,
    between,
    foretold,
    looked_at,
    remembered,
    taken,
)
from ..solve.zeros import AT, DONE, PARAMETER, TRIED, VALUE, enclosing, polishing
from .contacts.common import FOLLOWED, Contact, Segments
from .contacts.margins import FAR, MISS, OVERSHOOT, margins
from .residual import Tools, followed_in, kept, linearised_in, moved_rows, tools, work
from .tables import INTERNAL, Grid, Room, Series, expressions, numbers_at, structure

EPS = 2.220446049250313e-16
MAX_ITERATIONS = 10
SMALL = 1e-10  # a correction this small is followed by one of the order of its square
TAIL = 100.0  # times rounding: a correction this small is the last, and leaves derivatives and tangent as they are
LEFT = 10.0  # times rounding: what is left to the step behind chords
NEAR, STEADY, CHORDS = 1e-2, 0.1, 4  # correction behind which events are taken for the same; of it the next at most; their number
FINE = 16.0  # parts of half a shortest wave: events that move by less have the same ones beside them
CLOSE = 1e-3  # part of a step within which the factors of one point serve another
AROUND = 0.25  # rad: by which events may have moved along a branch where a correction begins with them
SPRUNG = 0.5  # rad: an event that is farther from all of a row before has taken the place of another one, see `sprung`
UNSEEN = -0.05  # monitors are cut off below: far from zero they are constant, so that no pair of zeros is looked for
CONVERGED, NOT_CONVERGED, NOT_FINITE, SINGULAR, CONTACTS, OTHER_ORDER = 1, 0, -1, -2, -3, -4
ITERATIONS, RESIDUAL, CONTRACTION, DISTANCE, DET_SIGN, DET_LOG, STATUS, INFO = 0, 1, 2, 3, 4, 5, 6, 7


class Equations(NamedTuple):
    """What is corrected: the equations of a balance along a parameter."""

    S: np.ndarray  # structure, see `tables`
    R: np.ndarray  # rows
    along: Series  # numbers of the system along the parameter
    grid: Grid
    listed: np.ndarray  # int (nc,): events of each contact in the order that is followed, -1: as they come; `residual.followed`
    room: Room
    scale: np.ndarray  # (size + 1,) natural sizes


class Found(NamedTuple):
    """Arrays that `correct` writes."""

    x: np.ndarray  # (size + 1,) point
    new: np.ndarray  # (size + 1,) unit tangent there, in scaled unknowns
    info: np.ndarray  # (INFO,)
    events: np.ndarray  # (KINDS, FIELDS) margins of events at the point


class Place(NamedTuple):
    """Where a correction begins, and the plane that it stays in; each (size + 1,)."""

    start: np.ndarray
    plane: np.ndarray  # a point of the plane
    tangent: np.ndarray  # unit, in scaled unknowns: orthogonal to the plane


class Run(NamedTuple):
    """What a run of steps reads and writes, see `solve.steprun`."""

    before: np.ndarray  # (2, size + 1) point and tangent of the row before the one where it begins
    kinds: np.ndarray  # int (k,): of the events whose margins are monitors
    run: np.ndarray
    tests: np.ndarray  # (TESTS, 1 + 2 k)
    rows: np.ndarray  # (most, 2 (size + 1) + 1 + 2 k + TOLD)


class Bench(NamedTuple):
    """Arrays that corrections overwrite, made once for many of them."""

    tools: Tools
    flat: np.ndarray  # numbers of the system at a parameter, and their derivatives
    dflat: np.ndarray
    matrix: np.ndarray  # (size + 1, size + 1) factors of the bordered derivatives of the last correction, and its rows' order
    pivot: np.ndarray
    right: np.ndarray  # (size + 1,)


@njit
def bench_of(equations: Equations):
    """Return arrays for corrections."""
    base, n = equations.along.base, equations.scale.size
    return Bench(tools(equations.S, equations.grid, equations.room), np.empty_like(base), np.empty_like(base), np.empty((n, n)),
                 np.empty(n, np.int64), np.empty(n))


@both
def correct(equations: Equations, place: Place, fixed, found: Found, near):
    """Correct a point onto the branch; write what is ``found``.

    Parameters
    ----------
    equations : Equations
    place : Place
    fixed : bool
        Keep the parameter.
    found : Found
        Overwritten.
    near : bool
        The contacts were last followed along a motion near the start.

    Returns
    -------
    int
        CONVERGED, or what went wrong; CONVERGED with ``info[DET_SIGN]`` zero: the tangent is not unique, the given one stays.
    """
    return corrected(equations, place, fixed, found, near, bench_of(equations))


@apart(WHOLE, counted=False)
def corrected(equations: Equations, place: Place, fixed, found: Found, near, bench: Bench):
    """Do what `correct` says; ``bench`` is overwritten."""
    S, R, along, grid, listed, room, scale = equations
    x, new, info, events = found
    start, plane, tangent = place
    tools, flat, dflat, matrix, pivot, right = bench
    size = start.size - 1
    for j in range(size + 1):
        x[j], new[j] = start[j], tangent[j]
    old, contraction, rounding = np.inf, 0.0, rounding_of(x, scale)
    sign, log, size_log, count = 0.0, 0.0, 0.0, 0
    slopes = size > 0  # a literal would compile everything again
    next_to, far = near_to(equations), AROUND if near and grid.samples == 0 else 0.0
    info[CONTRACTION], info[DISTANCE], info[DET_SIGN], info[DET_LOG] = 0.0, np.inf, 0.0, -np.inf
    for count in range(MAX_ITERATIONS + 1):
        numbers_at(along, x[size], flat, dflat)
        room.spectra[:], room.F[:], room.J[:] = 0.0, 0.0, 0.0
        status = linearised_in(S, R, flat, dflat, x[:size], grid, slopes, listed, room, far, tools)
        if status != FOLLOWED and far > 0.0:
            far = 0.0
            status = linearised_in(S, R, flat, dflat, x[:size], grid, slopes, listed, room, far, tools)
        info[ITERATIONS], info[STATUS], info[RESIDUAL] = count, status, np.inf
        if status != FOLLOWED:
            return CONTACTS
        biggest, small, size_log = 0.0, True, 0.0
        for i in range(size):
            floor, top = scaled(room.wide[i], x, scale, matrix[i])
            f = abs(room.f[i])
            size_log += np.log(top)
            if not np.isfinite(f + floor):
                return NOT_FINITE
            if f > EPS * floor:
                small = False
            biggest = max(biggest, f)
        info[RESIDUAL] = biggest
        bordered(matrix, tangent, fixed)
        sign, log = lu(matrix, pivot)
        if small and far == 0.0 or old <= max(rounding, SMALL) or (
                count > 1 and contraction < 0.1 and contraction * contraction * old < 0.1 * rounding):
            break
        if sign == 0.0:
            return SINGULAR
        if count == MAX_ITERATIONS:
            return NOT_CONVERGED
        for i in range(size):
            right[i] = room.f[i]
        right[size] = 0.0
        lu_solve_wide(matrix, pivot, right)
        length = length_of(right)
        if not np.isfinite(length):
            return SINGULAR
        if count > 0:
            contraction = length / old
            if contraction > 2.0 and length > 1e-8:
                return NOT_CONVERGED
        old = length
        moved_by(x, scale, right, fixed)
        if length <= TAIL * rounding and far == 0.0:  # the next would be below rounding, and the derivatives are as good
            break
        far = 0.0
        if next_to == 0.0 or not LEFT * rounding < length * length < NEAR * NEAR:
            continue
        for _ in range(CHORDS):  # with the same factors and events: for a few per cent of a step of Newton's method
            if residual_at(equations, x, next_to, bench) != FOLLOWED:
                break
            lu_solve_wide(matrix, pivot, right)
            new_length = length_of(right)
            if not new_length < STEADY * length:
                break
            moved_by(x, scale, right, fixed)
            if new_length * new_length <= length * LEFT * rounding:  # the next is below what the last full step corrects
                break
            length = new_length
    if not kept(listed, room.sources, room.counts):
        return OTHER_ORDER
    if fixed and sign != 0.0:
        for i in range(size):
            for j in range(size + 1):
                matrix[i, j] = room.wide[i, j] * scale[j]
        bordered(matrix, tangent, False)
        sign, log = lu(matrix, pivot)
    if sign != 0.0:
        right[:] = 0.0
        right[size] = 1.0
        lu_solve_wide(matrix, pivot, right)
        length = length_of(right)
        if 0.0 < length < 1.0 / EPS:
            for j in range(size + 1):
                new[j] = right[j] / length
            log += np.log(length)
        else:
            sign, log = 0.0, -np.inf
    moved = 0.0
    for i in range(size + 1):
        moved += ((x[i] - plane[i]) / scale[i])**2
    # the determinant of rows of unit size: that of the plain one grows by orders in a step, with the squares of harmonics
    info[CONTRACTION], info[DISTANCE], info[DET_SIGN], info[DET_LOG] = contraction, np.sqrt(moved), sign, log - size_log
    watched(S, flat, grid, room, events)
    return CONVERGED


@both
def follow(equations: Equations, start, tangent, found: Found, steps: Run):
    """Go step by step along the branch until one needs a look.

    The run begins at ``start`` with the tangent there; arguments else as of `correct`.  At the end ``found`` belongs to the step
    that needs a look.

    Returns
    -------
    int
        As `correct`; BEYOND, LAST_ROW.
    """
    before, kinds, run, tests, rows = steps
    scale = equations.scale
    x, new, info, events = found
    most = rows.shape[0]
    last, old, n = start.copy(), tangent.copy(), start.size - 1
    predicted, guess, values = start.copy(), start.copy(), np.empty(tests.shape[1])
    spare = Found(np.empty(n + 1), np.empty(n + 1), np.empty_like(info), np.empty_like(events))
    past, lengths = np.zeros((4, n + 1)), np.zeros(2)
    past[:2], lengths[0] = before, run[BACK] if run[BACK] < np.inf else 0.0
    bench = bench_of(equations)
    phases = np.empty(equations.room.ends.shape[:2])
    residual_at(equations, last, 0.0, bench)
    noted(equations.room, phases)
    for made in range(most):
        run[MADE] = made
        run[LENGTH] = min(run[LENGTH], run[MOST])
        foretold(past, last, old, scale, lengths, run[LENGTH], predicted, guess)
        if predicted[n] > run[HIGH] or predicted[n] < run[LOW]:
            return BEYOND
        status = corrected(equations, Place(guess, predicted, old), False, found, made > 0, bench)
        if status != CONVERGED or info[DET_SIGN] == 0.0 or sprung(equations.room, phases):
            return status
        noted(equations.room, phases)
        values[0] = new[n]
        for k in range(kinds.size):
            values[1 + 2 * k], values[2 + 2 * k] = monitored(events, kinds[k], MISS), monitored(events, kinds[k], OVERSHOOT)
        count, sign, log = int(info[ITERATIONS]), info[DET_SIGN], info[DET_LOG]
        length, angle, misfit = looked_at(last, old, x, predicted, new, scale, values, count, sign, log, run, tests)
        if length == 0.0:
            return status
        if length < 0.0:  # as `continuation.steps.hidden.jumped`
            between(last, old, x, new, scale, -length, guess, spare.new)
            direction = spare.new.copy()
            middle = corrected(equations, Place(guess, guess, direction), False, spare, True, bench)
            if middle != CONVERGED or aside(guess, spare.x, scale, -length, run[CORNER]):
                return status
        taken(x, new, values, (abs(length), angle, misfit), (count, info[RESIDUAL], sign, log), run, tests, rows[made])
        remembered(past, lengths, last, old, run[BACK])
        last[:], old[:] = x, new
    run[MADE] = most
    return LAST_ROW


@both
def exchanged(S, R, grid: Grid, listed, room: Room, points, numbers):
    """Return whether, between two points of a branch, events have taken the places of others, see `sprung`.

    Parameters
    ----------
    points : ndarray (2, size)
        Packed motions.
    numbers : ndarray (2, .)
        Numbers of the system there.
    """
    space, line, phases = work(S, grid, room), np.empty(S[INTERNAL]), np.empty(room.ends.shape[:2])
    c, v, cp, vp = room.rows[0], room.rows[1], room.rows[2], room.rows[3]
    for i in range(2):
        moved_rows(S, R, numbers[i], numbers[i], points[i], c, v, cp, vp, line)
        if followed_in(S, numbers[i], grid, c, v, listed, room, space) != FOLLOWED:  # on a boundary rounding may forbid all modes
            return False
        if i == 0:
            noted(room, phases)
    return sprung(room, phases)


@leaf
def noted(room, phases):
    """Write the phases of the events of the contacts that were followed, (nc, segments), NaN behind them."""
    for k in range(len(phases)):
        events = room.counts[k, 0] - 1
        for n in range(phases.shape[1]):
            phases[k, n] = room.ends[k, n, 0] if n < events else np.nan


@leaf
def sprung(room, phases):
    """Return whether an event of the contacts that were followed has no other near the ``phases`` that were `noted`.

    Of more events than are followed the least are ignored: one may grow and another one shrink until they change places, and no
    margin passes zero there.
    """
    for k in range(len(phases)):
        if not phases[k, 0] >= 0.0:
            continue
        for n in range(room.counts[k, 0] - 1):
            least, i = np.pi, 0
            while i < phases.shape[1] and phases[k, i] >= 0.0:
                away = abs(room.ends[k, n, 0] - phases[k, i])
                least, i = min(least, away, 2.0 * np.pi - away), i + 1
            if least > SPRUNG:
                return True
    return False


class Sought(NamedTuple):
    """The curve beside which the zero of a test is looked for, and arrays for places of it (n + 1,)."""

    hermite: np.ndarray
    miss: np.ndarray  # how far the last point was from the curve, scaled
    place: Place
    known: np.ndarray  # (1,) where on the curve the derivatives were made whose factors are known, NaN: nowhere


@both
def locate(equations: Equations, hermite, bracket, test, found: Found, box):
    """Find the zero of a test on the branch beside a cubic curve, as `solve.zeros` does; return whether it is found.

    Points next to one that was corrected need its factors and the residual alone; at the zero all is made anew.

    Parameters
    ----------
    equations : Equations
    hermite : ndarray (4, n + 1)
        Start and chord of the curve, and its derivatives at both ends, own units; the curve is run through from 0 to 1.
    bracket : tuple of float
        The test at both ends, and the place to try first.
    test : tuple of int
        Kind of the events and field of their margin that is a monitor; kind -1 for the slope of the parameter.
    found : Found
        Receives the solution.
    box : ndarray (BOX,)
        Receives what is known of the zero.
    """
    first, last, guess = bracket
    n = equations.scale.size
    sought = Sought(hermite, np.zeros(n), Place(np.empty(n), np.empty(n), np.empty(n)), np.full(1, np.nan))
    bench = bench_of(equations)
    for t in enclosing(box, 0.0, first, 1.0, last, guess):
        if not tested(equations, sought, t, test, found, box, bench):
            return False
    if box[DONE] == 0.0:
        return False
    for t in polishing(box):
        if not tested(equations, sought, t, test, found, box, bench):
            if box[TRIED] == 0.0:
                return False
            box[VALUE] = np.nan
    if box[DONE] == 0.0:
        return False
    if sought.known[0] == box[AT]:
        return True
    near = Place(found.x.copy(), sought.place.plane, sought.place.tangent)
    return (corrected(equations, near, False, found, False, bench) == CONVERGED
            or corrected(equations, sought.place, False, found, True, bench) == CONVERGED)


@njit
def tested(equations, sought, t, test, found, box, bench):
    """Correct the point at ``t`` of a curve, see `locate`, and write the test there into ``box``; return whether that is known."""
    hermite, miss, place, known = sought
    scale, n = equations.scale, equations.scale.size - 1
    kind, field = test
    beside(hermite, t, miss, scale, place.plane, place.start, place.tangent)
    if kind < 0 or not abs(t - known[0]) <= CLOSE or not settled(equations, place, found, bench):
        if corrected(equations, place, False, found, known[0] == known[0], bench) != CONVERGED:
            return False
        known[0] = t
    for j in range(n + 1):
        miss[j] = (found.x[j] - place.plane[j]) / scale[j]
    box[VALUE], box[PARAMETER] = found.new[n] if kind < 0 else monitored(found.events, kind, field), found.x[n]
    return np.isfinite(box[VALUE])


@leaf
def settled(equations, place, found, bench):
    """Correct a point next to that of the last correction with its factors; return whether that is enough.

    Tangent and derivatives stay those of that correction.  What is left of the equations is rounding: neighbours of a zero tell its
    error by their noise.
    """
    S, _, _, grid, listed, room, scale = equations
    x, right, old, rounding = found.x, bench.right, NEAR, rounding_of(place.start, scale)
    for j in range(x.size):
        x[j] = place.start[j]
    far = near_to(equations)
    for _ in range(CHORDS):
        status = residual_at(equations, x, far, bench)
        if status != FOLLOWED and far > 0.0:
            far = 0.0
            status = residual_at(equations, x, far, bench)
        if status != FOLLOWED:
            return False
        lu_solve_wide(bench.matrix, bench.pivot, right)
        aslant = inner(place.tangent, right) / inner(place.tangent, found.new)  # the factors are bordered with another plane
        for j in range(right.size):
            right[j] -= aslant * found.new[j]
        length = length_of(right)
        noise = length <= TAIL * rounding
        done = far == 0.0 and (length <= rounding or noise and length > 0.5 * old)
        if done and kept(listed, room.sources, room.counts):  # at a zero rounding says which events there are: it may say otherwise
            watched(S, bench.flat, grid, room, found.events)
            return True
        if not (noise or length < STEADY * old):
            return False
        moved_by(x, scale, right, False)
        old, far = length, 0.0
    return False


@leaf
def near_to(equations):
    """Return by which phase events may move for a motion next to one that was followed, 0 for contacts at samples."""
    return np.pi / (FINE * structure(equations.S)[0][-1]) if equations.grid.samples == 0 else 0.0


@leaf
def residual_at(equations, x, far, bench):
    """Write the right side of a correction with known factors at ``x``; return as `linearised`, which tells of ``far``."""
    S, R, along, grid, listed, room, _ = equations
    tools, flat, dflat, _, _, right = bench
    size = x.size - 1
    numbers_at(along, x[size], flat, dflat)
    room.spectra[:], room.F[:] = 0.0, 0.0
    status = linearised_in(S, R, flat, dflat, x[:size], grid, size < 0, listed, room, far, tools)
    for i in range(size):
        right[i] = room.f[i]
    right[size] = 0.0
    return status


@leaf
def rounding_of(x, scale):
    """Return the rounding of a point, in scaled unknowns."""
    biggest = 0.0
    for i in range(x.size):
        biggest = max(biggest, abs(x[i] / scale[i]))
    return 4.0 * EPS * (1.0 + biggest)


@leaf
def monitored(events, kind, field):
    """Return a monitor: the largest near miss of a kind of event, or minus its least overshoot; both are negative inside."""
    return max(events[kind, MISS] if field == MISS else -events[kind, OVERSHOOT], UNSEEN)


@leaf
def scaled(row, x, scale, out):
    """Write a row of derivatives by scaled unknowns; return the size of its terms at ``x``, and its largest entry."""
    n = out.size
    m = n - n % 4
    f0, f1, f2, f3 = 0.0, 0.0, 0.0, 0.0
    t0, t1, t2, t3 = 1e-300, 1e-300, 1e-300, 1e-300
    for j in range(0, m, 4):
        f0 += abs(row[j] * x[j])
        f1 += abs(row[j + 1] * x[j + 1])
        f2 += abs(row[j + 2] * x[j + 2])
        f3 += abs(row[j + 3] * x[j + 3])
    for j in range(m, n):
        f0 += abs(row[j] * x[j])
    for j in range(n):
        out[j] = row[j] * scale[j]
    for j in range(0, m, 4):
        t0, t1 = max(t0, abs(out[j])), max(t1, abs(out[j + 1]))
        t2, t3 = max(t2, abs(out[j + 2])), max(t3, abs(out[j + 3]))
    for j in range(m, n):
        t0 = max(t0, abs(out[j]))
    return (f0 + f1) + (f2 + f3), max(max(t0, t1), max(t2, t3))


@leaf
def length_of(step):
    """Return the length of a correction, in scaled unknowns."""
    total = 0.0
    for j in range(step.size):
        total += step[j] * step[j]
    return np.sqrt(total)


@leaf
def moved_by(x, scale, right, fixed):
    """Take a correction, in scaled unknowns, off a point; ``fixed``: not off its parameter."""
    for i in range(x.size - 1 if fixed else x.size):
        x[i] -= scale[i] * right[i]


@leaf
def bordered(matrix, tangent, fixed):
    """Write the last row: the tangent, or the parameter alone."""
    size = tangent.size - 1
    for j in range(size + 1):
        matrix[size, j] = (1.0 if j == size else 0.0) if fixed else tangent[j]


@both
def watched(S, flat, grid: Grid, room: Room, events):
    """Write the margins of events along the motion whose contacts were followed."""
    events[:, 0], events[:, 1], events[:, 2] = 0.0, FAR, -FAR
    waves, _, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    a, line, z = np.empty(waves.size), np.empty(grid.cosines.shape[1] if grid.samples else 0), np.empty(room.zs.shape[2])
    for k in range(len(contacts)):
        margins(Contact(waves, excited, contacts[k], X[k], loose[k], room.rows[0], room.rows[1]),
                Segments(room.paths[k], room.ends[k], room.zs[k], room.sources[k], room.counts[k]), grid, room.rates[k], events, a,
                line, z)
