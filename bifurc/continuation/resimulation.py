"""Checks of the rows of a finished branch that cost a simulation or multipliers: is each a motion, and does every change of
its multipliers have a special point?

Between two rows of one sequence of events a real multiplier passes +1 at a fold or a branch point, -1 at a period doubling,
and a pair leaves the unit circle at a Neimark-Sacker point (Kuznetsov 2004, chapters 4 and 5).  Where the sequence changes,
multipliers jump, but the period map stays continuous: its index, the sign of det(1 - M), changes where the parameter turns back
and only there (di Bernardo et al. 2008, section 3.1, after Feigin).  Orbits that are their own mirror image on both sides are fixed
points of half a period followed by the mirror, and it is the index of that map that they keep: in a graze, which touches both
stops at once, its multiplier may pass -1 (orbits without the symmetry are born), and that of the whole period +1.
"""
import time
from dataclasses import dataclass, field

import numpy as np

from ..content import Content
from ..solve.steplaw import BOUNDARY_BAND
from .kinds import SpecialPointKind

ON_CIRCLE = 1e-6  # | |multiplier| - 1 | below which a row is passed over
ROUNDED = 64.0 * float(np.finfo(float).eps)  # of the largest multiplier: rounding of the others, beside a graze more than 1
ALONG = 1.0 - 1e-5  # cosine of the tangents of two neighbours on one curve; less where rounding turns them, as it does multipliers
EDGE = 1e-9  # arclength: a row so near a change of the sequence of events lies on it, where both sides are right
# arclengths from a change of the sequence of events at which multipliers are counted
BESIDE = (1e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4)
PLUS = (SpecialPointKind.FOLD, SpecialPointKind.BRANCH_POINT)


@dataclass(frozen=True, eq=False)
class Resimulated(Content):
    """What re-simulation and multipliers say of a branch.

    Attributes
    ----------
    rows : int
        Rows simulated over their period.
    not_repeated : tuple of (float, float)
        Arclength and parameter of rows that are not admissible or that simulation does not repeat.
    unexplained : tuple of (float, float, str)
        Arclength intervals over which numbers of multipliers (beyond +1, beyond -1, outside the unit circle) change otherwise than
        the special points in them say, and which numbers.
    seconds : float
        CPU time.
    """

    rows: int
    not_repeated: tuple[tuple[float, float], ...]
    unexplained: tuple[tuple[float, float, str], ...]
    seconds: float = field(compare=False)


def resimulated(branch, arrays) -> Resimulated:
    """Simulate every row of a branch over its period and balance the multipliers; nothing where the problem has no motions."""
    clock = time.process_time()
    edges = changes(branch)
    count, wrong = 0, []
    for i, (s, part) in enumerate(zip(arrays["s"], arrays["part"], strict=True)):
        if np.abs(edges - s).min() <= EDGE:
            continue
        good = branch.problems[int(part)].is_motion(branch.x(i))
        if good is not None:
            count += 1
            if not good:
                wrong.append((float(s), float(arrays["parameter"][i])))
    return Resimulated(count, tuple(wrong), unexplained(branch, arrays), time.process_time() - clock)


def changes(branch) -> np.ndarray:
    """Return the arclengths at which the sequence of events changes, or ends: there the motion may go on in another one."""
    rows = branch.column("s")
    found = [point.s for point in branch.special_points
             if point.successor is not None or min(abs(point.s - rows[0]), abs(point.s - rows[-1])) <= EDGE]
    return np.array(found or [np.inf])


def unexplained(branch, arrays) -> tuple[tuple[float, float, str], ...]:
    """Return the intervals in which the multipliers beyond +1, beyond -1 or outside the unit circle change otherwise than the
    special points in them say."""
    found, before = [], None
    for after in samples(branch, arrays):
        if before is not None:
            text = mismatch(branch, before, after)
            if text:
                found.append((before[0], after[0], text))
        before = after
    return tuple(found)


def samples(branch, arrays):
    """Yield (arclength, part, numbers of multipliers) of rows in order; of a row on a change of the sequence of events, where an
    event has no speed or duration and the multipliers are not continuous, those of a point a little inside its sequence."""
    edges, places, parts = changes(branch), arrays["s"], arrays["part"]
    for i, (s, part) in enumerate(zip(places, parts, strict=True)):
        problem = branch.problems[int(part)]
        if np.abs(edges - s).min() > EDGE:
            step, numbers = 0.0, numbers_at(problem, branch.x(i))
        else:
            first, last = i == 0 or parts[i - 1] != part, i == len(parts) - 1 or parts[i + 1] != part
            if first == last:
                continue
            tangent = arrays["tangent"][arrays["offsets"][i]:arrays["offsets"][i + 1]]
            step, numbers = numbers_beside(problem, branch.x(i), tangent, places[i + 1 if first else i - 1] - s)
        if numbers is not None:
            yield float(s) + step, int(part), numbers


def numbers_beside(problem, x, tangent, room):
    """Return (step, numbers of multipliers) beside ``x`` (n + 1,), where the next row is ``room`` away; numbers None: not told.

    Too near, rounding decides: where a branch ends in its parent the multiplier leaves 1 with the square of the step.  The
    nearest three successive points that agree are believed: of two both may be rounding.
    """
    before, earlier = None, None
    for length in BESIDE:
        if length > abs(room) / 2.0:
            break
        step = np.copysign(length, room)
        at = beside(problem, x, tangent, step)
        numbers = None if at is None else numbers_at(problem, at)
        if numbers is not None and numbers == before == earlier:
            return step, numbers
        before, earlier = numbers, before
    return 0.0, None


def beside(problem, x, tangent, step):
    """Return the solution (n + 1,) at a signed arclength ``step`` from ``x`` (n + 1,); None if its equations are not valid, or it
    is not known well enough: beside a merging point that of the parent is another solution, and where dp/ds is rounding a fold
    between it and ``x``, that is one with the change there, is none of the points that its multipliers would ask for."""
    try:
        c = problem.correct(x + step * problem.scale * tangent, tangent)
    except problem.errors:
        return None
    walls = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    along = c.converged and abs(float(c.tangent @ tangent)) > ALONG and abs(float(c.tangent[-1])) > BOUNDARY_BAND
    return c.x if along and all(c.monitors[k] < 0.0 for k in walls) else None


def counted(multipliers):
    """Return how many multipliers lie beyond +1, beyond -1 and outside the unit circle; None where that cannot be told, because
    one is too near to the circle or too small beside the largest."""
    if multipliers is None or not np.isfinite(multipliers).all():
        return None
    clear = max(ON_CIRCLE, ROUNDED * float(np.abs(multipliers).max(initial=0.0)))
    if np.any(np.abs(np.abs(multipliers) - 1.0) < clear):
        return None
    outside = multipliers[np.abs(multipliers) > 1.0]
    real = np.abs(outside.imag) <= 1e-12 * np.abs(outside)
    return int(np.sum(real & (outside.real > 0.0))), int(np.sum(real & (outside.real < 0.0))), len(outside)


def numbers_at(problem, x):
    """Return `counted` of the solution ``x`` (n + 1,) and the number beyond +1 over half a period, None where that says nothing."""
    whole, half = counted(problem.floquet_multipliers(x)), counted(problem.half_multipliers(x))
    return None if whole is None else (*whole, None if half is None else half[0])


def mismatch(branch, before, after) -> str:
    """Return what the special points between two samples do not explain; empty if all is.

    Pairs may leave or reach the real axis outside the unit circle, so that beyond +1 and beyond -1 only odd differences count.
    Where the sequence of events changes, multipliers jump; the number beyond +1 is then odd as often as the parameter turns back.
    """
    points = [point for point in branch.special_points if before[0] - EDGE <= point.s <= after[0] + EDGE]
    kinds = [point.kind for point in points]
    touched = sum(point.kind is SpecialPointKind.BRANCH_POINT and point.reverses for point in points)  # +1 is reached, not passed
    plus, minus = sum(kind in PLUS for kind in kinds) - touched, kinds.count(SpecialPointKind.PERIOD_DOUBLING)
    pairs = kinds.count(SpecialPointKind.NEIMARK_SACKER)
    turns = sum(point.reverses and point.kind not in PLUS for point in points)
    change = [b - a for a, b in zip(before[2][:3], after[2][:3], strict=True)]
    if before[1] != after[1]:
        index, at = change[0] - plus, 0
        if before[2][3] is not None and after[2][3] is not None:  # over half a period the symmetry is lost at -1
            at = 3
            index = after[2][at] - before[2][at] - sum(point.kind in PLUS and not touches(point) for point in points)
        if (index - turns) % 2:
            return (f"{before[2][at]} multipliers beyond +1 become {after[2][at]} through a change of the sequence of events with "
                    f"{plus} folds or branch points and {turns} reversals of the parameter")
        return ""
    if (change[0] - plus) % 2:
        return f"{before[2][0]} multipliers beyond +1 become {after[2][0]} with {plus} folds or branch points between"
    if (change[1] - minus) % 2:
        return f"{before[2][1]} multipliers beyond -1 become {after[2][1]} with {minus} period doublings between"
    if abs(change[2]) > plus + minus + 2 * pairs:
        return (f"{before[2][2]} multipliers outside the unit circle become {after[2][2]} with {plus} folds or branch points, "
                f"{minus} period doublings and {pairs} Neimark-Sacker points between")
    return ""


def touches(point) -> bool:
    """Whether a branch point is one at which no multiplier of this branch passes +1: orbits of less symmetry are born on it, or it
    is theirs and turns back there."""
    return point.kind is SpecialPointKind.BRANCH_POINT and (point.reverses or point.directions is None)
