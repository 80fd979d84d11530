"""One compiled call a continuation step: Newton in the bordered system, the tangent, the determinant, margins of events.

The same iteration as `continuation.problem.Problem.correct`, whose stopping rules it shares.
"""
from typing import NamedTuple

import numpy as np

from .._jit import both, leaf
from ..solve.dense import lu, lu_solve
from .contacts.common import FOLLOWED, Contact, Segments
from .contacts.margins import FAR, margins
from .residual import kept, linearised, motion
from .tables import Grid, Room, Series, expressions, numbers_at, structure

EPS = 2.220446049250313e-16
MAX_ITERATIONS = 10
SMALL = 1e-10  # a correction this small is followed by one of the order of its square
CONVERGED, NOT_CONVERGED, NOT_FINITE, SINGULAR, CONTACTS, OTHER_ORDER = 1, 0, -1, -2, -3, -4
ITERATIONS, RESIDUAL, CONTRACTION, DISTANCE, DET_SIGN, DET_LOG, STATUS, INFO = 0, 1, 2, 3, 4, 5, 6, 7


class Found(NamedTuple):
    """Arrays that `correct` writes."""

    x: np.ndarray  # (size + 1,) point
    new: np.ndarray  # (size + 1,) unit tangent there, in scaled unknowns
    info: np.ndarray  # (INFO,)
    events: np.ndarray  # (KINDS, FIELDS) margins of events at the point


@both
def correct(S, R, along: Series, grid: Grid, listed, room: Room, start, tangent, fixed, scale, found: Found):
    """Correct ``start`` (size + 1,) onto the branch; write what is ``found``.

    Parameters
    ----------
    S, R
        Structure, see `tables`, and rows.
    along : Series
        Numbers of the system along the parameter.
    tangent : (size + 1,)
        Unit, in scaled unknowns.
    fixed : bool
        Keep the parameter.
    scale : (size + 1,)
        Natural sizes.
    listed : int (nc,)
        Events of each contact in the order that is followed, -1: as they come; see `residual.followed`.
    found : Found
        Overwritten.

    Returns
    -------
    int
        CONVERGED, or what went wrong; CONVERGED with ``info[DET_SIGN]`` zero: the tangent is not unique, the given one stays.
    """
    x, new, info, events = found
    size = start.size - 1
    flat, dflat = np.empty_like(along.base), np.empty_like(along.base)
    matrix, right = np.empty((size + 1, size + 1)), np.empty(size + 1)
    pivot = np.empty(size + 1, np.int64)
    x[:] = start
    new[:] = tangent
    old, contraction, biggest = np.inf, 0.0, 0.0
    for i in range(size + 1):
        biggest = max(biggest, abs(x[i] / scale[i]))
    rounding = 4.0 * EPS * (1.0 + biggest)
    sign, log, size_log, count = 0.0, 0.0, 0.0, 0
    slopes = size > 0  # a literal would compile everything again
    info[CONTRACTION], info[DISTANCE], info[DET_SIGN], info[DET_LOG] = 0.0, np.inf, 0.0, -np.inf
    for count in range(MAX_ITERATIONS + 1):
        numbers_at(along, x[size], flat, dflat)
        room.spectra[:], room.F[:], room.J[:] = 0.0, 0.0, 0.0
        status = linearised(S, R, flat, dflat, x[:size], grid, slopes, listed, room)
        info[ITERATIONS], info[STATUS], info[RESIDUAL] = count, status, np.inf
        if status != FOLLOWED:
            return CONTACTS
        biggest, small, size_log = 0.0, True, 0.0
        for i in range(size):
            floor, f, top = 0.0, abs(room.f[i]), 1e-300
            for j in range(size + 1):
                w = room.wide[i, j]
                floor += abs(w * x[j])
                w *= scale[j]
                matrix[i, j] = w
                top = max(top, abs(w))
            size_log += np.log(top)
            if not np.isfinite(f + floor):
                return NOT_FINITE
            if f > EPS * floor:
                small = False
            biggest = max(biggest, f)
        info[RESIDUAL] = biggest
        bordered(matrix, tangent, fixed)
        sign, log = lu(matrix, pivot)
        if small or old <= max(rounding, SMALL) or (
                count > 1 and contraction < 0.1 and contraction * contraction * old < 0.1 * rounding):
            break
        if sign == 0.0:
            return SINGULAR
        if count == MAX_ITERATIONS:
            return NOT_CONVERGED
        for i in range(size):
            right[i] = room.f[i]
        right[size] = 0.0
        lu_solve(matrix, pivot, right)
        length = np.sqrt(np.sum(right * right))
        if not np.isfinite(length):
            return SINGULAR
        if count > 0:
            contraction = length / old
            if contraction > 2.0 and length > 1e-8:
                return NOT_CONVERGED
        old = length
        p = x[size]
        for i in range(size + 1):
            x[i] -= scale[i] * right[i]
        if fixed:
            x[size] = p
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
        lu_solve(matrix, pivot, right)
        length = np.sqrt(np.sum(right * right))
        if 0.0 < length < 1.0 / EPS:
            new[:] = right / length
            log += np.log(length)
        else:
            sign, log = 0.0, -np.inf
    moved = 0.0
    for i in range(size + 1):
        moved += ((x[i] - start[i]) / scale[i])**2
    # the determinant of rows of unit size: that of the plain one grows by orders in a step, with the squares of harmonics
    info[CONTRACTION], info[DISTANCE], info[DET_SIGN], info[DET_LOG] = contraction, np.sqrt(moved), sign, log - size_log
    watched(S, R, flat, dflat, x[:size], grid, room, events)
    return CONVERGED


@leaf
def bordered(matrix, tangent, fixed):
    """Write the last row: the tangent, or the parameter alone."""
    size = tangent.size - 1
    for j in range(size + 1):
        matrix[size, j] = (1.0 if j == size else 0.0) if fixed else tangent[j]


@both
def watched(S, R, flat, dflat, x, grid: Grid, room: Room, events):
    """Write the margins of events along the motion ``x`` whose contacts were followed."""
    events[:, 0], events[:, 1], events[:, 2] = 0.0, FAR, -FAR
    waves, _, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    signals, a, slopes = np.empty((4, len(R), waves.size)), np.empty(waves.size), np.empty(grid.cosines.shape[1])
    z = np.empty(room.zs.shape[2])
    c, v, cp, vp = signals[0], signals[1], signals[2], signals[3]
    motion(S, R, flat, dflat, x, c, v, cp, vp)
    for k in range(len(contacts)):
        margins(Contact(waves, excited, contacts[k], X[k], loose[k], c, v),
                Segments(room.paths[k], room.ends[k], room.zs[k], room.sources[k], room.counts[k]), grid, events, a, slopes, z)
