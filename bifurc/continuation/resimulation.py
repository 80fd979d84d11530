"""Checks of the rows of a finished branch that cost a simulation or multipliers: is each a motion, and does every change of
its multipliers have a special point?

Between two rows of one sequence of events a real multiplier passes +1 at a fold or a branch point, -1 at a period doubling,
and a pair leaves the unit circle at a Neimark-Sacker point (Kuznetsov 2004, chapters 4 and 5).
"""
import time
from dataclasses import dataclass

import numpy as np

from .kinds import SpecialPointKind

ON_CIRCLE = 1e-6  # | |multiplier| - 1 | below which a row is passed over
EDGE = 1e-9  # arclength: a row so near a change of the sequence of events lies on it, where both sides are right
PLUS = (SpecialPointKind.FOLD, SpecialPointKind.BRANCH_POINT)


@dataclass(frozen=True, slots=True)
class Resimulated:
    """What re-simulation and multipliers say of a branch.

    Attributes
    ----------
    rows : int
        Rows simulated over their period.
    not_repeated : tuple of (float, float)
        Arclength and parameter of rows that are not admissible or that simulation does not repeat.
    unexplained : tuple of (float, float, str)
        Arclength intervals over which numbers of multipliers change without a special point, and which numbers.
    seconds : float
        CPU time.
    """

    rows: int
    not_repeated: tuple[tuple[float, float], ...]
    unexplained: tuple[tuple[float, float, str], ...]
    seconds: float


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
    """Return the intervals between rows of one sequence in which multipliers cross the unit circle without a special point."""
    found, edges = [], changes(branch)
    before = None
    for i, (s, part) in enumerate(zip(arrays["s"], arrays["part"], strict=True)):
        if np.abs(edges - s).min() <= EDGE:  # an event without speed or duration: the multipliers are not continuous there
            continue
        numbers = counted(branch.problems[int(part)].floquet_multipliers(branch.x(i)))
        if numbers is None:
            continue
        if before is not None and before[1] == part:
            text = mismatch(branch, before, (float(s), part, numbers))
            if text:
                found.append((before[0], float(s), text))
        before = float(s), part, numbers
    return tuple(found)


def counted(multipliers):
    """Return how many multipliers lie beyond +1, beyond -1 and outside the unit circle; None where that cannot be told."""
    if multipliers is None or not np.isfinite(multipliers).all() or np.any(np.abs(np.abs(multipliers) - 1.0) < ON_CIRCLE):
        return None
    outside = multipliers[np.abs(multipliers) > 1.0]
    real = np.abs(outside.imag) <= 1e-12 * np.abs(outside)
    return int(np.sum(real & (outside.real > 0.0))), int(np.sum(real & (outside.real < 0.0))), len(outside)


def mismatch(branch, before, after) -> str:
    """Return what the special points between two rows do not explain; empty if all is."""
    kinds = [point.kind for point in branch.special_points if before[0] - EDGE <= point.s <= after[0] + EDGE]
    plus, minus = sum(kind in PLUS for kind in kinds), kinds.count(SpecialPointKind.PERIOD_DOUBLING)
    pairs = kinds.count(SpecialPointKind.NEIMARK_SACKER)
    change = [b - a for a, b in zip(before[2], after[2], strict=True)]
    if abs(change[2]) > plus + minus + 2 * pairs or (change[2] - plus - minus) % 2:
        return (f"{before[2][2]} multipliers outside the unit circle become {after[2][2]} with {plus} folds or branch points, "
                f"{minus} period doublings and {pairs} Neimark-Sacker points between")
    return ""
