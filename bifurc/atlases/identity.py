"""Whether two orbits are one up to phase and symmetry, whether an orbit lies on a branch, and what a branch is at a value.

Phases differ by whole forcing periods: the section points of an orbit are a set.  With the symmetry y(t) -> -y(t + T/2) the
mirror image of an orbit counts as the same.
"""
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..continuation.branches.branch import Branch
from ..continuation.branches.records import to_arrays
from ..continuation.kinds import End, StopReason
from ..orbits.orbit import PeriodicOrbit

SAME = 1e-6  # of the sizes of the states
CLOSE = 1e-4  # where an orbit is degenerate: at ends of branches
REACH = 0.05  # scaled: a correction that goes farther has left the branch
EDGE = 1e-9  # of a step
JOINED = "it joins a branch of shorter period"
PARAMETER = 1e-7  # of the range: special points of two branches this close may be one


def points_of(orbit: PeriodicOrbit) -> np.ndarray:
    """Return the states (periods, ns) at phase 0, one a forcing period, in sizes of the states."""
    return orbit._states(np.arange(orbit.periods, dtype=float)) / orbit.weights


def mirrored_points(orbit: PeriodicOrbit) -> np.ndarray | None:
    """Return those of the mirror image -y(t + half a forcing period); None where the system is not symmetric."""
    if orbit.system.symmetry != -1:
        return None
    return -orbit._states(np.arange(orbit.periods, dtype=float) + 0.5) / orbit.weights


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest distance of a point of one set from the other set, both ways."""
    distances = np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2))
    return float(max(distances.min(axis=0).max(), distances.min(axis=1).max()))


def same_orbit(a: PeriodicOrbit, b: PeriodicOrbit, tolerance: float = SAME) -> bool:
    """Return whether two orbits of one system are the same up to phase and symmetry."""
    if a.periods != b.periods or a.scene.ns != b.scene.ns:
        return False
    return same_points(a, b, tolerance)


def same_points(a: PeriodicOrbit, b: PeriodicOrbit, tolerance: float) -> bool:
    """Return whether two orbits go through the same section points: a doubled orbit and the one it is born from, too."""
    points = b._states(np.arange(b.periods, dtype=float)) / a.weights
    image = mirrored_points(a)
    return apart(points_of(a), points) <= tolerance or (image is not None and apart(image, points) <= tolerance)


def symmetric(orbit: PeriodicOrbit) -> bool:
    """Return whether an orbit is its own mirror image."""
    image = mirrored_points(orbit)
    return image is not None and apart(points_of(orbit), image) <= SAME


def periods_of(branch: Branch) -> int:
    """Return the number of forcing periods of the orbits of a branch."""
    sequence = branch.problems[int(branch._arrays["part"][len(branch) // 2])].sequence
    return round(sequence.span * (2 if sequence.closure < 0 else 1))


class Node(NamedTuple):
    """A row or special point of a branch."""

    s: float
    parameter: float
    x: np.ndarray
    tangent: np.ndarray  # own units per arclength
    part: int  # number of the problem


def nodes_of(branch: Branch) -> list[Node]:
    """Return rows and special points in the order of arclength."""
    place = {id(problem): k for k, problem in enumerate(branch.problems)}
    found = [Node(row.s, row.p, row.x, row.tangent * branch.problems[row.part.index].scale, row.part.index)
             for row in branch.rows()]
    found += [Node(point.s, point.parameter, point.x, point.tangent * point.problem.scale, place[id(point.problem)])
              for point in branch.special_points if id(point.problem) in place]
    return sorted(found, key=lambda node: (node.part, node.s))  # where equations change, both sides have the same s


def orbits_at(branch: Branch, value: float, nodes=None) -> Iterator[PeriodicOrbit]:
    """Yield the orbits of a branch at a value of its parameter, corrected there from cubics between its rows."""
    nodes = nodes_of(branch) if nodes is None else nodes
    known: list[np.ndarray] = []
    for first, last in zip(nodes, nodes[1:], strict=False):
        for part, guess in _guesses(first, last, value):
            problem = branch.problems[part]
            up = np.zeros(guess.size)
            up[-1] = 1.0
            corrected = problem.correct(guess, up, True)
            if not corrected.converged or np.abs((corrected.x - guess) / problem.scale).max() > REACH:
                continue
            if any(x.size == guess.size and np.abs((corrected.x - x) / problem.scale).max() < SAME for x in known):
                continue
            orbit = problem.solution(corrected.x)
            if orbit.success:
                known.append(corrected.x)
                yield orbit


def _guesses(first: Node, last: Node, value: float) -> Iterator[tuple[int, np.ndarray]]:
    """Yield number of the problem and unknowns (n + 1,) where the branch may pass a value between two nodes."""
    step = last.s - first.s
    if first.part != last.part or step <= 0.0:
        for node in (first, last):
            if min(first.parameter, last.parameter) <= value <= max(first.parameter, last.parameter):
                guess = node.x.copy()
                guess[-1] = value
                yield node.part, guess
        return
    rise, change = last.x - first.x, np.array([first.tangent, last.tangent]) * step
    cubic = np.array([change[0] + change[1] - 2.0 * rise, 3.0 * rise - 2.0 * change[0] - change[1], change[0], first.x])
    top = np.abs(cubic[:3, -1]).sum()
    if abs(first.parameter - value) > top:
        return
    terms = cubic[:, -1].copy()
    terms[-1] -= value
    terms[np.abs(terms) < 1e-15 * np.abs(terms).max(initial=1e-300)] = 0.0
    for root in np.roots(terms) if terms.any() else (0.0,):
        if abs(root.imag) < 1e-6 and -EDGE <= root.real <= 1.0 + EDGE:
            z = float(root.real)
            guess = ((cubic[0] * z + cubic[1]) * z + cubic[2]) * z + cubic[3]
            guess[-1] = value
            yield first.part, guess


def on_branch(orbit: PeriodicOrbit, branch: Branch, nodes=None) -> bool:
    """Return whether an orbit lies on a branch, up to phase and symmetry."""
    if orbit.periods != periods_of(branch):
        return False
    value = orbit.system.parameter(branch.parameter)
    return any(same_orbit(orbit, other) for other in orbits_at(branch, value, nodes))


def repeats(orbit: PeriodicOrbit) -> bool:
    """Return whether an orbit is one of a shorter period, written out several times."""
    n = orbit.periods
    states = points_of(orbit)
    return any(np.abs(np.roll(states, -k, axis=0) - states).max() < SAME for k in range(1, n) if n % k == 0)


def trimmed(branch: Branch, periods: int) -> Branch | None:
    """Return a branch without the rows at its ends whose orbits have a shorter least period: there it has joined another branch.

    None when no row is left.
    """
    rows = branch.rows()
    size = len(rows)

    def foreign(i):
        orbit = branch.orbits[i]
        return orbit.periods != periods or repeats(orbit)

    low, high = 0, size - 1
    while low <= high and foreign(low):
        low += 1
    while high >= low and foreign(high):
        high -= 1
    if low > high:
        return None
    s = branch.column("s")
    marks = np.array([point.s for point in branch.special_points])
    near = 1e-9 * max(1.0, float(s[-1] - s[0]))
    if low and marks.size and np.abs(marks - s[low - 1]).min() <= near:  # the point where it joins is its end
        low -= 1
    if high + 1 < size and marks.size and np.abs(marks - s[high + 1]).min() <= near:
        high += 1
    begin, end = s[low - 1] if low else -np.inf, s[high + 1] if high + 1 < size else np.inf
    if (low, high) == (0, size - 1):
        return branch
    points = [point for point in branch.special_points if begin <= point.s <= end]
    kept = rows[low:high + 1]
    ends = tuple(old if untouched else End(StopReason.STOPPED, JOINED, float(row.p), old.ds, old.rejected)
                 for old, untouched, row in zip(branch.ends, (low == 0, high == size - 1), (kept[0], kept[-1]), strict=True))
    arrays = to_arrays(kept, [row.part.index for row in kept])
    return Branch(branch.parameter, branch.problems, arrays, points, ends, branch.bounds, branch.options, branch.unresolved)
