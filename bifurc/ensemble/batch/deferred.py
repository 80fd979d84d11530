"""What the batch step of several masses defers: a substep with several events, or a whole period, by the scalar integrator.

This module is a template, written again around the literal numbers of a kind of scene: see `bifurc.ensemble.batch.packing`.
"""
import numpy as np

from ..._jit import njit
from ...flow.affine.engine import forcing
from ...flow.scan import COUNT, MODE, ORDERS, SLOPES, STATE, TAU
from ..scalar import ROWS as RECORDED
from ..scalar import begin_at, integrate
from .blank import FORCINGS, GUARDS, NS

EVENTS, HITS, LEAST = range(3)  # tally: events, impacts and contacts, least speed of arrival


@njit
def until(T, begin, whole, end, m, room, limit):
    """Integrate ``room[0]`` (ns,) in place from ``begin`` to the time ``end`` after section ``whole``; return status and mode.

    Writes the tally.
    """
    y, tally, x, floats, record, ints, rows = room
    begin_at(m, y, ints, floats, x)
    floats[TAU] = begin
    forcing(T, begin, x)
    tally[HITS], tally[LEAST] = 0.0, np.inf
    status = integrate(T, ints, floats, x, whole, end, limit, rows, record, tally[HITS:])
    tally[EVENTS] = ints[COUNT]
    for c in range(NS):
        y[c] = x[c]
    return status, ints[MODE]


@njit
def period(given, m, room, limit):
    """Integrate ``room[0]`` (ns,) in place over the forcing period that starts at phase 0; return status and mode."""
    return until(given.T, 0.0, 1, 0.0, m, room, limit)


@njit
def substep(T, k, steps, h, m, room, limit):
    """Integrate ``room[0]`` (ns,) in place over substep ``k`` of a period; return status and mode."""
    last = k + 1 == steps
    return until(T, k * h, 1 if last else 0, 0.0 if last else (k + 1) * h, m, room, limit)


@njit
def scratch():
    """Return what `period` works on: the state, the tally, and room."""
    return (np.zeros(NS), np.zeros(3), np.zeros(NS + FORCINGS), np.zeros(SLOPES + GUARDS), np.zeros((RECORDED, STATE + 2 * NS)),
            np.zeros(ORDERS + GUARDS, np.int64), np.zeros((RECORDED, 5), np.int64))
