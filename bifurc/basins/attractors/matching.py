"""Attractors from one parameter value to the next: continued by Newton, or what their motion becomes when they are lost."""
from collections.abc import Sequence

import numpy as np

from ...orbits.find import find_orbit
from ...orbits.orbit import PeriodicOrbit
from ...system import System
from .attractors import SampledAttractor, distance, examine, same, section_points

CLOSE = 0.2  # scaled distance of section points up to which a Newton solution counts as the same attractor, moved
COARSE = 0.05  # scaled boxes in which chaotic attractors of neighbouring parameters are compared
OVERLAP = 0.3  # of the smaller one
Key = tuple[int, int, int]  # system, attractor, step to the neighbour
End = tuple[int, bool] | None  # number of what it becomes there and whether it was continued; None: nothing


def follow(system: System, attractor, scale: np.ndarray):
    """Return what an attractor of neighbouring parameters becomes in ``system``, and whether it was continued.

    Parameters
    ----------
    system : System
    attractor : PeriodicOrbit or SampledAttractor
        Of a system of the same structure.
    scale : ndarray
        Sizes (ns,) of the states.

    Returns
    -------
    found : PeriodicOrbit, SampledAttractor or None
        A stable orbit or a chaotic attractor of ``system``; None where its motion settles on nothing.
    continued : bool
        The same attractor, moved a little; False: it was lost, and its motion went to ``found``.
    """
    try:
        if isinstance(attractor, PeriodicOrbit):
            orbit = find_orbit(system, guess=attractor, periods=attractor.periods)
            if orbit.success and orbit.stable:
                near = distance(section_points(orbit) / scale, attractor.state / scale) <= CLOSE
                return orbit, near and orbit.periods == attractor.periods
            found = examine(system, attractor.state, scale)
        else:
            found = examine(system, attractor.points[-1], scale)
    except ValueError:  # its state lies beyond a stop here
        return None, False
    return found, found is not None and alike(attractor, found, scale)


def alike(a, b, scale: np.ndarray) -> bool:
    """Return whether two attractors of neighbouring parameters may be one, from where they lie."""
    chaotic = [isinstance(item, SampledAttractor) for item in (a, b)]
    if not all(chaotic):
        return not any(chaotic) and a.periods == b.periods and distance(section_points(b) / scale, a.state / scale) <= CLOSE
    boxes = [{tuple(row) for row in np.floor(item.points / scale / COARSE)} for item in (a, b)]
    return len(boxes[0] & boxes[1]) > OVERLAP * min(len(boxes[0]), len(boxes[1]))


def place_of(item, known: Sequence, scale: np.ndarray) -> int | None:
    """Return the number of an attractor among those known of the same system, None when it is new."""
    for number, other in enumerate(known):
        if same(other, item, scale) or (isinstance(item, SampledAttractor) and isinstance(other, SampledAttractor)
                                        and alike(other, item, scale)):
            return number
    return None


class Links:
    """Attractors of a row of systems, spread to their neighbours until nothing new appears.

    Parameters
    ----------
    systems : sequence of System
    scales : sequence of ndarray
    attractors : list of list
        Those known of each system; grown in place.
    done : dict, optional
        Links that are known already, see `among`.

    Attributes
    ----------
    grown : set of int
        Systems for which attractors were added.
    """

    def __init__(self, systems: Sequence[System], scales: Sequence[np.ndarray], attractors: list[list],
                 done: dict[Key, End] | None = None):
        self.systems, self.scales, self.attractors = systems, scales, attractors
        self.grown: set[int] = set()
        self._done = {} if done is None else done

    def among(self) -> dict[Key, End]:
        """Return the links from attractors to those known of their neighbours, by (system, number, step).

        Those that lead to a new attractor are left out: a part of a row can tell them without changing what `spread`
        of the whole row gives.
        """
        for i, mine in enumerate(self.attractors):
            for step in (1, -1):
                for k in range(len(mine) if 0 <= i + step < len(self.systems) else 0):
                    found, continued = self._followed(i, k, step)
                    if found is None or isinstance(found, int):
                        self._done[i, k, step] = None if found is None else (found, continued)
        return self._done

    def spread(self) -> None:
        """Follow every attractor up and down, and those found on the way, until none is new."""
        count = -1
        while count != len(self._done):
            count = len(self._done)
            for step in (1, -1):
                rows = range(len(self.systems)) if step > 0 else range(len(self.systems) - 1, -1, -1)
                for i in rows:
                    if 0 <= i + step < len(self.systems):
                        for k in range(len(self.attractors[i])):
                            self.link(i, k, step)

    def link(self, i: int, k: int, step: int) -> tuple[int, bool] | None:
        """Return the number at ``i + step`` that attractor ``k`` of ``i`` becomes and whether it was continued there."""
        key = (i, k, step)
        if key not in self._done:
            found, continued = self._followed(i, k, step)
            if found is not None and not isinstance(found, int):
                self.attractors[i + step].append(found)
                self.grown.add(i + step)
                found = len(self.attractors[i + step]) - 1
            self._done[key] = None if found is None else (found, continued)
        return self._done[key]

    def _followed(self, i: int, k: int, step: int):
        """Return what attractor ``k`` of ``i`` becomes at ``i + step``, and whether it was continued: the number of a known one,
        a new attractor, or None."""
        j, item = i + step, self.attractors[i][k]
        known, scale = self.attractors[j], self.scales[j]
        if isinstance(item, SampledAttractor):  # costly to follow, seldom needed
            for place, other in enumerate(known):
                if isinstance(other, SampledAttractor) and alike(item, other, scale):
                    return place, True
        found, continued = follow(self.systems[j], item, scale)
        number = None if found is None else place_of(found, known, scale)
        return (found if number is None else number), continued

    def tracks(self) -> tuple[list[list[int]], dict[int, int]]:
        """Return the track number of every attractor of every system, and for tracks that begin where another is lost, that one."""
        numbers: list[list[int]] = [list(range(len(self.attractors[0])))] if self.systems else []
        count = len(self.attractors[0]) if self.systems else 0
        parents: dict[int, int] = {}
        for i in range(1, len(self.systems)):
            mine: list[int | None] = [None] * len(self.attractors[i])
            forward = [self.link(i - 1, k, 1) for k in range(len(self.attractors[i - 1]))]
            backward = [self.link(i, k, -1) for k in range(len(mine))]
            for k, found in enumerate(forward):  # the same both ways first
                if found and found[1] and mine[found[0]] is None and backward[found[0]] == (k, True):
                    mine[found[0]] = numbers[i - 1][k]
            for k, found in enumerate(forward):
                if found and found[1] and mine[found[0]] is None and numbers[i - 1][k] not in mine:
                    mine[found[0]] = numbers[i - 1][k]
            for n in range(len(mine)):
                if mine[n] is None:
                    mine[n] = count
                    came = [numbers[i - 1][k] for k, found in enumerate(forward) if found and found[0] == n]
                    if came:
                        parents[count] = came[0]
                    count += 1
            numbers.append([number for number in mine if number is not None])
        return numbers, parents
