"""Edge states: the motion that stays on the boundary between two basins, and the saddle it settles on.

Two starts that lead to different attractors are brought together by bisection and followed; when they have parted, they
are brought together again (J. Skufca, J. Yorke, B. Eckhardt 2006).  The motion between them stays near the boundary
and settles on what attracts there: a saddle, which Newton on the event sequence then finds to rounding.
"""
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from ..orbits.orbit import PeriodicOrbit
from ..system import System
from .attractors import distance, section_points, targets_of
from .basinmap import BasinMap
from .marcher import Marcher, Targets
from .periodmap import MAPPED, PeriodMap
from .starting import states_at

PARTS = 16  # into which a segment is cut at a time
TIGHT, LOOSE = 1e-11, 1e-6  # scaled distances: brought together to, followed up to
TRIES = 24  # cuts of one segment
LONGEST = 64  # forcing periods of the longest saddle looked for
RETURN = 1e-3  # scaled distance of a return that Newton is tried from
NEAR = 0.03  # scaled distance of the saddle from the motion that led to it
JUMP = 0.05  # scaled distance of images of starts TIGHT apart that no slope explains: the map is broken there


class EdgeStatus(StrEnum):
    """What the search on a boundary came to."""

    SADDLE = "saddle"
    NO_BOUNDARY = "no_boundary"
    THIRD_BASIN = "third_basin"
    NO_RETURN = "no_return"
    BROKEN = "broken"

    @property
    def sentence(self) -> str:
        """What it means, and what to try."""
        return _SENTENCES[self]


_SENTENCES = {
    EdgeStatus.SADDLE: "The motion on the boundary settles on an unstable orbit, which Newton found.",
    EdgeStatus.NO_BOUNDARY: "The two basins have no cells in the map; widen its grid, or choose another pair.",
    EdgeStatus.THIRD_BASIN: "Other basins lie between the two wherever they come near each other; choose a pair with one of them.",
    EdgeStatus.NO_RETURN: "The motion on the boundary did not return to itself: it is chaotic or slow; raise max_periods.",
    EdgeStatus.BROKEN: "Starts on both sides that are as close as numbers allow part at once: the map jumps there, and no motion "
                       "stays on the boundary; choose another start.",
}


@dataclass(frozen=True, eq=False)
class EdgeState:
    """What lies on the boundary between two basins.  Made by `edge_state`.

    Attributes
    ----------
    basins : BasinMap
    pair : tuple of int
        The two labels.
    saddle : PeriodicOrbit or None
        Unstable; its multipliers tell in how many directions.
    status : EdgeStatus
    points : ndarray
        Section points (k, ns) of the motion along the boundary, one a forcing period.
    gap : float
        Largest scaled distance to which its two neighbours had parted.
    third : dict
        Other labels met between the two -> number of starts that led there.
    jumps : int
        Times that starts 1e-11 apart parted by more than any slope explains.
    """

    basins: BasinMap = field(repr=False)
    pair: tuple[int, int]
    saddle: PeriodicOrbit | None
    status: EdgeStatus
    points: np.ndarray = field(repr=False)
    gap: float
    third: dict
    jumps: int

    @property
    def success(self) -> bool:
        """Whether a saddle was found."""
        return self.status is EdgeStatus.SADDLE

    @property
    def message(self) -> str:
        """The status as a sentence, with what else was met."""
        met = ", ".join(f"label {label}: {count} starts" for label, count in sorted(self.third.items()))
        return self.status.sentence + (f" Met between them: {met}." if met else "")

    @property
    def unstable_directions(self) -> int:
        """Number of multipliers outside the unit circle; 1: its stable set can be the boundary."""
        return 0 if self.saddle is None else int(np.count_nonzero(np.abs(self.saddle.multipliers) > 1.0))

    def unstable_set(self, **options):
        """Return the unstable set of the saddle, see `bifurc.basins.unstable.unstable_set`."""
        from .unstable import unstable_set

        return unstable_set(self, **options)

    def stable_set(self, **options):
        """Return the stable set of the saddle: the boundary through it, see `bifurc.basins.stable.stable_set`."""
        from .stable import stable_set

        return stable_set(self, **options)

    def plot(self, ax=None, unstable=None, stable=None):
        """Draw the saddle, and its unstable and stable sets, on the basin map; return the axes."""
        from ..plotting.sweeps import plot_edge

        return plot_edge(self, ax, unstable, stable)

    def __repr__(self):
        met = f", {sum(self.third.values())} starts in other basins" if self.third else ""
        return f"EdgeState(between {self.pair[0]} and {self.pair[1]}: {self.status}, {self.saddle!r}{met})"


def edge_state(basins: BasinMap, pair: tuple[int, int] = (0, 1), *, starts=None, max_periods: int = 400) -> EdgeState:
    """Return the saddle on the boundary between two basins.

    Parameters
    ----------
    basins : BasinMap
    pair : tuple of int
        Labels of the two basins.
    starts : array_like, optional
        One start in each (2, ns); default: the closest cells of the two in the map.
    max_periods : int
        Forcing periods for which the motion on the boundary is followed.

    Returns
    -------
    EdgeState
        Look at ``success``, ``status`` and ``message``.

    Raises
    ------
    ValueError
        Labels the map has not, starts that do not lead to the two.

    References
    ----------
    J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96 (2006) 174101.
    """
    a, b = pair
    count = len(basins.attractors)
    if a == b or not (0 <= a < count and 0 <= b < count):
        raise ValueError(f"pair = {pair!r} is not allowed; it must be two different labels of the map, 0 to {count - 1}")
    search = _Search(basins, (int(a), int(b)))
    if starts is None:
        ends = search.closest_cells()
        if ends is None:
            return search.result(None, EdgeStatus.NO_BOUNDARY)
    else:
        ends = np.array(starts, float)
        if ends.shape != (2, search.scale.size) or not np.isfinite(ends).all():
            raise ValueError(f"starts = {starts!r} are not allowed; they must be two states (2, {search.scale.size})")
        if search.label(ends).tolist() != [a, b]:
            raise ValueError(f"starts = {starts!r} lead to {search.label(ends).tolist()}, not to the pair {pair!r}")
    return search.track(ends, max_periods)


class _Search:
    """Two starts on both sides of a boundary, kept together."""

    def __init__(self, basins: BasinMap, pair: tuple[int, int]):
        self.basins, self.pair = basins, pair
        self.system: System = basins.system
        self.map = PeriodMap(self.system, max_events=basins.options["max_events"])
        self.scale = basins.scale
        self.targets: Targets = targets_of(basins.attractors, basins.radii, basins.scale)
        self.marcher = Marcher(self.map.scene, basins.options["max_events"])
        self.points: list[np.ndarray] = []
        self.third: dict[int, int] = {}
        self.gap, self.jumps = 0.0, 0

    def label(self, X: np.ndarray) -> np.ndarray:
        """Return the labels of starts (N, ns)."""
        return self.marcher.label(X.copy(), self.targets, self.basins.options["max_periods"]).labels

    def result(self, saddle, status: EdgeStatus) -> EdgeState:
        """Return what was found."""
        points = np.array(self.points).reshape(-1, self.scale.size)
        return EdgeState(self.basins, self.pair, saddle, status, points, self.gap, self.third, self.jumps)

    def closest_cells(self) -> np.ndarray | None:
        """Return the centres (2, ns) of neighbouring cells of the two labels, or of the closest ones."""
        from scipy.spatial import cKDTree
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

    def track(self, ends: np.ndarray, most: int) -> EdgeState:
        """Follow the boundary from two starts until its motion returns."""
        while len(self.points) < most:
            squeezed = self.squeeze(ends)
            if squeezed is None:
                return self.result(None, EdgeStatus.THIRD_BASIN)
            ends, steps, away = squeezed, 0, 0.0
            while away < LOOSE and len(self.points) < most:
                self.points.append(ends.mean(axis=0))
                images = self.map.apply(ends)
                if (images.outcomes != MAPPED).any():
                    return self.result(None, EdgeStatus.NO_RETURN)
                ends, steps = images.ends, steps + 1
                away = float(np.linalg.norm((ends[1] - ends[0]) / self.scale))
            self.gap = max(self.gap, away)
            if steps == 1 and away > JUMP:
                self.jumps += 1
                if self.jumps > 3:
                    return self.result(None, EdgeStatus.BROKEN)
            saddle = self.returned()
            if saddle is not None:
                return self.result(saddle, EdgeStatus.SADDLE)
        return self.result(None, EdgeStatus.NO_RETURN)

    def returned(self) -> PeriodicOrbit | None:
        """Return the saddle when the motion has come back to itself and Newton agrees."""
        from ..flow.simulate import simulate
        from ..orbits.find import finished, from_motion
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


def reaches(search_targets: Targets, marcher: Marcher, X: np.ndarray, most: int) -> Sequence[int]:
    """Return the labels that starts (N, ns) lead to, sorted."""
    return sorted(set(marcher.label(X.copy(), search_targets, most).labels.tolist()))
