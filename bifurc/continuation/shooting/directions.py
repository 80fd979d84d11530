"""Directions in which solutions leave the beginning of an event sequence.

Usually it is the one null vector of [F_u F_p].  Where a contact begins to slip both ways at once, the equations lose another rank:
to lowest order they ask for two durations of the same size, a^2 = b^2, and two branches of solutions cross, one of them with a
negative duration.  Any vector of the plane would be a null vector; which one a decomposition returns is chance.  And where a
slip is born with no speed at all, its duration alone may be any: along that direction there is one motion, on the boundary.
Where all that is near solves the equations to rounding, Newton ends anywhere, and no direction is told.
"""
import math

import numpy as np

from ...solve.bordered import kernel
from ...solve.steplaw import MANY

RANK = 1e-5  # least singular value of [F_u F_p] over the next, below which another rank is lost: along trains of impacts they fall
# by the same factor from one to the next
AROUND = 1e-4  # scaled length at which solutions are looked for round the beginning
NEARER = (1e-5, 1e-6)  # the same where a line bends within that length, as at the end of a sequence that is as short
ANGLES = 8  # vectors of the plane, half a circle
ASIDE, BACK = 0.1, 0.01  # part of that length by which a solution is left aside, and to which it is found again
ALIKE = 0.98  # cosine of two directions that are one


def directions(problem, x) -> list[np.ndarray]:
    """Return unit vectors (n + 1,) in scaled unknowns along which solutions of ``problem`` leave ``x`` (n + 1,), either way.

    Where [F_u F_p] has one null vector it is that; where it has a plane of them, the chords to the solutions found round ``x``;
    none where Newton wanders to such a solution or does not find it again.  A line has chords both ways that are one: where they
    are not, it may bend within their length, and shorter ones are its directions, once they are one or stay the same.
    """
    fu, fp = problem.jacobian(x[:-1], x[-1])
    rows = kernel(np.column_stack([fu, fp]) * problem.scale, RANK)
    if len(rows) < 2:
        return [rows[-1]]
    found, lost = chords(problem, x, rows, AROUND)
    before = found
    for nearer in NEARER if not straight(found) else ():
        made, _ = chords(problem, x, rows, nearer)
        settled = straight(made) and bool(made)
        if settled or all(any(abs(one @ other) > ALIKE for other in before) for one in made):
            found = made if settled else before
            break
        before = made
    lines: list[np.ndarray] = []
    for chord in found:
        if all(abs(chord @ other) < ALIKE for other in lines):
            lines.append(chord)
    return lines or ([] if lost else [rows[-1]])


def straight(found) -> bool:
    """Whether every unit vector of a list has an opposite one in it."""
    return all(any(one @ other < -ALIKE for other in found) for one in found)


def chords(problem, x, plane, around):
    """Return the unit vectors from ``x`` (n + 1,) to the solutions found at a distance ``around`` in a ``plane`` (2, n + 1) of null
    vectors, each once; and whether Newton wandered, or did not find one again."""
    found: list[np.ndarray] = []
    lost = False
    for angle in math.pi * np.arange(ANGLES) / ANGLES:
        v = math.cos(angle) * plane[-1] + math.sin(angle) * plane[-2]
        for sign in (1.0, -1.0):
            c = problem.correct(x + sign * around * problem.scale * v, sign * v)
            chord = (c.x - x) / problem.scale
            length = float(np.linalg.norm(chord)) if c.converged else 0.0
            if c.converged and c.iterations > MANY:
                lost = True
            elif 0.1 * around < length < 10.0 * around and leaves(problem, c) \
                    and all(chord @ other < ALIKE * length for other in found):
                if found_again(problem, x, chord / length, plane, around):
                    found.append(chord / length)
                else:
                    lost = True
    return found, lost


def found_again(problem, x, chord, plane, around=AROUND) -> bool:
    """Whether Newton comes back to the solution along the unit vector ``chord`` (n + 1,) a length ``around`` from ``x``, from
    either side of it in a ``plane`` (2, n + 1) of null vectors."""
    across = (plane @ chord) @ np.array([[0.0, 1.0], [-1.0, 0.0]]) @ plane
    here = problem.correct(x + around * problem.scale * chord, chord)
    for aside in (ASIDE, -ASIDE) if here.converged else ():
        c = problem.correct(x + around * problem.scale * (chord + aside * across), chord)
        if not (c.converged and c.iterations <= MANY):
            return False
        if np.abs((c.x - here.x) / problem.scale).max() > BACK * around:
            return False
    return bool(here.converged)


def leaves(problem, c) -> bool:
    """Whether a corrected point is off all boundaries, on either side, by more than rounding."""
    return all(abs(value) > problem.touch for value, monitor in zip(c.monitors, problem.monitors, strict=True) if monitor.boundary)
