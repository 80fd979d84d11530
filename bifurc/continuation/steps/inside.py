"""Tests of a step just inside the boundaries on which it begins or ends, where they may be zero or not known.

On a boundary an event has no duration: what is divided by that is 0 / 0 or rounding, and where a contact is born the parameter
stands still.  The value that a test has there is its limit from inside.
"""
from ...solve.steplaw import BOUNDARY_BAND, MONITOR_BAND
from .rows import Curve, Row, tests_of

AT_BOUNDARY = 1e-9  # distance from a boundary, arclength
WIDE = 1e-7  # arclength to which the place of a boundary is known, when that is little
BESIDE_BOUNDARY = 1e-8  # arclength at which a test that is zero or not known on a boundary is looked up first
NEAR = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)  # parts of a step at which the sign behind a zero is looked up
STEEPER = 2.0  # of the slope of the parameter at a row, that of the chord from there to the end of its step: it may be a fold


def beginning(half, row, new, j):
    """Return the row, or where a test may be zero or not known at the first row of a part, a row just behind it that sets the old
    sign.

    A contact is born with dp/ds = 0, and a fold may follow at once.  Of a first row on a boundary the values are those behind it
    from then on.
    """
    if len(half.rows) > 1 and half.rows[-2].part is row.part:
        return row
    if half.edge is None and j in row.part.boundary and half.signs[j] < 0:  # it lies inside, however near: its sign is its own
        return row
    here = j == 0 and half.edge is not None and stands(row, new, row, half.edge)
    unknown = j > 0 and half.edge is not None and j in row.part.events
    if half.signs[j] and abs(row.tests[j]) > BOUNDARY_BAND and not here and not unknown:
        return row
    if half.just_inside[0] is not new:
        half.just_inside = new, {}, {}
    _, inside, looked = half.just_inside
    if j not in inside:
        inside[j] = clear_inside(half, row, new, j, outside_of(half.edge or 0.0, row, new, j), looked)
    inner = inside[j]
    if inner is None:
        return row
    half.signs[j] = 1 if inner.tests[j] > 0.0 else -1
    if unknown or row.tests[j] != row.tests[j]:
        row.tests[j] = inner.tests[j]
    return inner


def ending(half, row, cut, j):
    """Return the last row of a part, or where a test may be zero or not known there, a row just before it; None if it has no clear
    sign before either, in a step of that length.

    Where a boundary's test is zero with some power of the way its place is known to little, and what lies so near to it is the
    boundary itself.
    """
    if j not in cut.inside:
        new, reach = cut.row, known_to(cut.special)
        here = j == 0 and stands(row, new, new, reach)
        if not here and j == 0 and abs(new.tests[0]) > BOUNDARY_BAND:
            cut.inside[j] = new
        else:
            places = tuple(1.0 - t for t in outside_of(reach, row, new, j))
            inner = clear_inside(half, row, new, j, places, cut.looked)
            cut.inside[j] = inner if inner is not None or here or not places else new
    return cut.inside[j]


def known_to(special):
    """Return the arclength to which the place of a boundary is known."""
    return max(AT_BOUNDARY, 0.5 * (special.high - special.low), special.known)


def stands(row, new, at, reach):
    """Whether the parameter stands still at the end ``at`` of a step that lies on a boundary, within the arclength ``reach`` to
    which its place is known: there its slope is rounding, whatever its size."""
    return abs(at.tests[0]) * (new.s - row.s) <= reach * abs(new.tests[0] - row.tests[0])


def near(row, new, j):
    """Return parts of the step from ``row`` to ``new`` at which test ``j`` is looked up beside its ends; none in a step so short
    that all of it is as good as its ends."""
    if j == 0:
        return NEAR
    least = BESIDE_BOUNDARY / max(new.s - row.s, 1e-300)
    return (*(at for at in (least, 10.0 * least) if at < NEAR[0]), *(at for at in NEAR if at >= least))


def outside_of(reach, row, new, j):
    """Return the places of `near` that are no part of the boundary itself, whose place is known to an arclength ``reach``."""
    return tuple(t for t in near(row, new, j) if t * (new.s - row.s) > reach)


def clear_inside(half, row, new, j, places, looked):
    """Return a row of the step, at the first of ``places`` where a test is clearly not zero; None if it is nowhere.  The points
    that other tests have ``looked`` up are kept by their place.

    The tangent beside a singular end (where a doubled orbit merges with its parent) is made of rounding: the slope of the
    parameter counts only where the chord to that end has the same sign, and is not so much steeper that it is rounding itself.
    """
    curve = Curve(row, new)
    band = BOUNDARY_BAND if j == 0 else MONITOR_BAND * max(half.sizes[j], abs(new.tests[j]), abs(row.tests[j]))
    for t in places:
        if t not in looked:
            looked[t] = curve.at(t)
        c = looked[t]
        if c is not None:
            tests = tests_of(c)
            chord = float(c.x[-1]) - row.p if t < 0.5 else new.p - float(c.x[-1])
            most = STEEPER * float(row.part.scale[-1]) * min(t, 1.0 - t) * curve.length
            if abs(tests[j]) > band and (j or 0.0 < chord / tests[j] <= most):
                return Row(c, row.part, row.s + t * curve.length, new.angle * t, tests, new.ds)
    return None
