"""Directions in which solutions leave the beginning of an event sequence.

Usually it is the one null vector of [F_u F_p].  Where a contact begins to slip both ways at once, the equations lose another rank:
to lowest order they ask for two durations of the same size, a^2 = b^2, and two branches of solutions cross, one of them with a
negative duration.  Any vector of the plane would be a null vector; which one a decomposition returns is chance.  And where a
slip is born with no speed at all, its duration alone may be any: along that direction there is one motion, on the boundary.
Where both lines are one (one duration begins with a higher power of the way than the other) the solutions leave in a cusp, which
has no direction that Newton could start along.
"""
import math

import numpy as np

from ...solve.steplaw import MANY

RANK = 1e-5  # least singular value of [F_u F_p] over the next, below which another rank is lost: along trains of impacts they fall
# by the same factor from one to the next
AROUND = 1e-4  # scaled length at which solutions are looked for round the beginning
ANGLES = 8  # vectors of the plane, half a circle
ONE_SIGN = 1e-2  # of what is largest round the beginning, the other sign below which there is but one
ALIKE = 0.98  # cosine of two directions that are one


def directions(problem, x) -> list[np.ndarray]:
    """Return unit vectors (n + 1,) in scaled unknowns along which solutions of ``problem`` leave ``x`` (n + 1,), either way.

    Where [F_u F_p] has one null vector it is that; where it has a plane of them, the chords to the solutions found round ``x``;
    none where no two lines cross.
    """
    fu, fp = problem.jacobian(x[:-1], x[-1])
    left, sizes, rows = np.linalg.svd(np.column_stack([fu, fp]) * problem.scale)
    if sizes.size < 2 or sizes[-1] > RANK * sizes[-2]:
        return [rows[-1]]
    if not cross(problem, x, left[:, -1], rows[-1], rows[-2]):
        return []
    found: list[np.ndarray] = []
    for angle in math.pi * np.arange(ANGLES) / ANGLES:
        v = math.cos(angle) * rows[-1] + math.sin(angle) * rows[-2]
        for sign in (1.0, -1.0):
            c = problem.correct(x + sign * AROUND * problem.scale * v, sign * v)
            chord = (c.x - x) / problem.scale
            length = float(np.linalg.norm(chord)) if c.converged else 0.0
            if 0.1 * AROUND < length < 10.0 * AROUND and c.iterations <= MANY and leaves(problem, c) \
                    and all(abs(chord @ other) < ALIKE * length for other in found):
                found.append(chord / length)
    return found or [rows[-1]]


def cross(problem, x, left, one, two) -> bool:
    """Whether two lines of solutions cross in the plane of two null vectors at ``x`` (n + 1,): what the equations make of it to
    lowest order, seen along the left null vector (n,) of [F_u F_p], has both signs round ``x``.  The order is even."""
    round_it = []
    for angle in math.pi * np.arange(ANGLES) / ANGLES:
        away = AROUND * problem.scale * (math.cos(angle) * one + math.sin(angle) * two)
        round_it.append(sum(float(left @ problem.residual(y[:-1], y[-1])) for y in (x + away, x - away)))
    return min(max(round_it), -min(round_it)) > ONE_SIGN * max(map(abs, round_it))


def leaves(problem, c) -> bool:
    """Whether a corrected point is off all boundaries, on either side, by more than rounding."""
    return all(abs(value) > problem.touch for value, monitor in zip(c.monitors, problem.monitors, strict=True) if monitor.boundary)
