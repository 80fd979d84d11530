"""`switch_branch`: starts on the other branches that meet in a special point."""
import numpy as np

from ..checks import checked
from .kinds import SpecialPointKind
from .problem import Corrected
from .steps.branchpoint import other_direction
from .switched import Switched

AWAY = 1e-2  # scaled distance of the new start from the branch point, reduced when the corrector does not go there


@checked()
def switch_branch(point, n_max: int = 3, distance: float = AWAY) -> Switched:
    """Return starts on the other branches through a special point, which `trace` takes.

    Parameters
    ----------
    point : SpecialPoint
        A branch point, or any point for which the problem knows branches (orbits: period doubling, grazing).
    n_max : int
        Largest number of periods of the new orbits, for problems that have them.
    distance : float
        Scaled distance from the special point at which the general rule for branch points starts.

    Returns
    -------
    Switched
        A tuple, possibly empty; ``.status`` says why.

    Examples
    --------
    >>> import bifurc as bf
    >>> duffing = bf.systems.duffing_oscillator()
    >>> branch = bf.trace(bf.find_orbit(duffing), "omega", bounds=(0.5, 2.5))
    >>> fold = [point for point in branch.special_points if point.kind == "fold"][0]
    >>> bf.switch_branch(fold)            # nothing leaves a fold
    Switched(0 starts: no other branch is known at a fold)
    """
    own = point.problem.branches(point, n_max)
    if own is not None:
        known = tuple(own)
        return own if isinstance(own, Switched) else Switched(
            known, f"{len(known)} {'start' if len(known) == 1 else 'starts'} of other motions")
    if point.kind is not SpecialPointKind.BRANCH_POINT or point.directions is None:
        return Switched((), f"no other branch is known at a {point.kind.value}")
    problem = point.problem
    direction = other_direction(point.directions, point.tangent)
    starts: list[object] = []
    for sign in (1.0, -1.0):
        start = beside(problem, point, sign * direction, distance)
        if start is not None:
            starts.append(start)
    if starts:
        return Switched(starts, f"{len(starts)} starts on the crossing branch")
    return Switched((), "the corrector returned to the old branch at every distance; try another `distance`")


def beside(problem, point, direction, distance):
    """Return the problem restarted on the other branch about ``distance`` from the point, None if not reached."""
    while distance > 1e-7:
        try:
            c = problem.correct(point.x + distance * problem.scale * direction, direction)
        except problem.errors:  # nearer the point the problem may exist
            c = None
        if c is not None and c.converged and isinstance(c.x, np.ndarray) and leads_away(problem, point, c, distance):
            return problem.restarted(c.x)
        distance *= 0.25
    return None


def leads_away(problem, point, c: Corrected, distance):
    """Whether a corrected point lies on the other branch and not on the one that is known."""
    moved = (c.x - point.x) / problem.scale
    length = float(np.sqrt(moved @ moved))
    known = abs(float(moved @ point.tangent)) / length
    return 0.5 * distance < length < 2.0 * distance and known < abs(float(moved @ c.tangent)) / length - 1e-6
