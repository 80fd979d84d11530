"""Two starts on both sides of a basin boundary, brought together by bisection and followed until their motion returns.

J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96 (2006) 174101.
"""
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ...ensemble.initial_conditions import states_at
from ...ensemble.integrator import Integrator, Targets
from ...ensemble.period_map import MAPPED, PeriodMap
from ...enumerations import DescribedEnum
from ...flow.simulate import simulate
from ...orbits.forced import finished, from_motion
from ...orbits.orbit import PeriodicOrbit
from ...system import System
from ..attractors.attractors import distance, section_points, targets_of
from ..maps.basin_map import BasinMap

PARTS = 16  # into which a segment is cut at a time
TIGHT, LOOSE = 1e-11, 1e-6  # scaled distances: brought together to, followed up to
TRIES = 24  # cuts of one segment
LONGEST = 64  # forcing periods of the longest saddle looked for
RETURN = 1e-3  # scaled distance of a return that Newton is tried from
NEAR = 0.03  # scaled distance of the saddle from the motion that led to it
JUMP = 0.05  # scaled distance of images of starts TIGHT apart that no slope explains: the map is broken there


class EdgeStatus(DescribedEnum):
    """What the search on a boundary came to."""

    SADDLE = "saddle", "The motion on the boundary settles on an unstable orbit, which Newton found."
    NO_BOUNDARY = "no_boundary", "The two basins have no cells in the map; widen its grid, or choose another pair."
    THIRD_BASIN = ("third_basin", "Other basins lie between the two wherever they come near each other; choose a pair "
                                  "with one of them.")
    NO_RETURN = ("no_return", "The motion on the boundary did not return to itself: it is chaotic or slow; raise "
                              "max_periods.")
    BROKEN = ("broken", "Starts on both sides that are as close as numbers allow part at once: the map jumps there, "
                        "and no motion stays on the boundary; choose another start.")


class Search:
    """Two starts on both sides of a boundary, kept together."""

    def __init__(self, basins: BasinMap, pair: tuple[int, int]):
        self.basins, self.pair = basins, pair
        self.system: System = basins.system
        self.map = PeriodMap(self.system, max_events=basins.options["max_events"])
        self.scale = basins.scale
        self.targets: Targets = targets_of(basins.attractors, basins.radii, basins.scale)
        self.integrator = Integrator(self.map.scene, basins.options["max_events"])
        self.points: list[np.ndarray] = []
        self.third: dict[int, int] = {}
        self.gap, self.jumps = 0.0, 0

    def label(self, X: np.ndarray) -> np.ndarray:
        """Return the labels of starts (N, ns)."""
        return self.integrator.label(X.copy(), self.targets, self.basins.options["max_periods"]).labels

    def closest_cells(self) -> np.ndarray | None:
        """Return the centres (2, ns) of neighbouring cells of the two labels, or of the closest ones."""
        labels = self.basins.labels
        grid = self.basins.grid
        starts = states_at(self.map.scene, grid.names, grid.at, grid.points(np.arange(grid.size)))
        sides = [starts[np.flatnonzero(labels.ravel() == label)] for label in self.pair]
        if not all(len(side) for side in sides):
            return None
        gaps, partner = cKDTree(sides[1] / self.scale).query(sides[0] / self.scale)
        best = np.flatnonzero(gaps <= gaps.min() * (1.0 + 1e-9))
        i = int(best[len(best) // 2])
        return np.array([sides[0][i], sides[1][partner[i]]])

    def squeeze(self, ends: np.ndarray) -> np.ndarray | None:
        """Return a start of each basin (2, ns), closer than TIGHT, on the segment between two; None: others lie between."""
        a, b = self.pair
        shares = np.arange(1, PARTS) / PARTS
        for _ in range(TRIES):
            size = float(np.linalg.norm((ends[1] - ends[0]) / self.scale))
            if size <= TIGHT:
                return ends
            inner = ends[0] + shares[:, None] * (ends[1] - ends[0])
            row = np.concatenate(([a], self.label(inner), [b]))
            every = np.concatenate((ends[:1], inner, ends[1:]))
            for label in row[(row != a) & (row != b)].tolist():
                self.third[label] = self.third.get(label, 0) + 1
            sides = np.flatnonzero((row == a) | (row == b))
            turns = np.flatnonzero(row[sides[:-1]] != row[sides[1:]])
            width = sides[turns + 1] - sides[turns]
            k = turns[np.argmin(width)]
            if width.min() == PARTS:
                return None
            ends = every[[sides[k], sides[k + 1]]]
            if row[sides[k]] == b:
                ends = ends[::-1]
        return None

    def track(self, ends: np.ndarray, most: int) -> tuple[PeriodicOrbit | None, EdgeStatus]:
        """Follow the boundary from two starts until its motion returns."""
        while len(self.points) < most:
            squeezed = self.squeeze(ends)
            if squeezed is None:
                return None, EdgeStatus.THIRD_BASIN
            ends, steps, away = squeezed, 0, 0.0
            while away < LOOSE and len(self.points) < most:
                self.points.append(ends.mean(axis=0))
                images = self.map.apply(ends)
                if (images.outcomes != MAPPED).any():
                    return None, EdgeStatus.NO_RETURN
                ends, steps = images.ends, steps + 1
                away = float(np.linalg.norm((ends[1] - ends[0]) / self.scale))
            self.gap = max(self.gap, away)
            if steps == 1 and away > JUMP:
                self.jumps += 1
                if self.jumps > 3:
                    return None, EdgeStatus.BROKEN
            saddle = self.returned()
            if saddle is not None:
                return saddle, EdgeStatus.SADDLE
        return None, EdgeStatus.NO_RETURN

    def returned(self) -> PeriodicOrbit | None:
        """Return the saddle when the motion has come back to itself and Newton agrees."""
        row = np.array(self.points[-LONGEST - 1:]) / self.scale
        back = [(float(np.linalg.norm(row[-1] - row[-1 - k])), k) for k in range(1, len(row))]
        if not back or min(back)[0] > RETURN:
            return None
        least = min(back)[0]
        for _, k in [item for item in back if item[0] <= max(2.0 * least, 1e-7)][:2]:
            y = self.points[-1]
            orbit = from_motion(self.system, simulate(self.system, y, periods=2 * k), 0, k)
            orbit = finished(orbit, None) if orbit.success else orbit
            if orbit.success and orbit.stable is False and distance(section_points(orbit) / self.scale, y / self.scale) <= NEAR:
                return orbit
        return None


def reaches(search_targets: Targets, integrator: Integrator, X: np.ndarray, most: int) -> Sequence[int]:
    """Return the labels that starts (N, ns) lead to, sorted."""
    return sorted(set(integrator.label(X.copy(), search_targets, most).labels.tolist()))
