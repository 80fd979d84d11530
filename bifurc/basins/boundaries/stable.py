"""Stable set of a saddle of the period map: the branch of the boundary of basins that runs through it.

It is grown as the unstable set is, by the map backwards in time (`time_reversal`): the images of a short piece of the
stable direction.  Every point is carried forward again: where it does not come back, different histories merge (rest on a
stop, complete chattering), the map has no inverse, and the branch ends there.  A map without an inverse may have further pieces
that lead to the saddle; they are not found, and it is said.
"""
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...checks import POINTS, POSITIVE, checked
from ...ensemble.outcomes import NO_START, CellState
from ..attractors.attractors import section_points
from .search import Search
from .time_reversal import Backwards
from .unstable import ImageSet, both_sides, direction_of, joined

if TYPE_CHECKING:
    from .edges import EdgeState

BESIDE = 1e-6  # scaled distance from the set at which starts are labelled


@dataclass(frozen=True, eq=False)
class StableSet(ImageSet):
    """Images of a short piece of the stable direction backwards in time, on both sides.

    Attributes
    ----------
    points, sides, curves
        See `ImageSet`.
    multiplier : float
        Along the stable direction, of one period of the orbit.
    direction : ndarray
        Of the set at the saddle (ns,), unit length in units of the map's scale.
    corners, merging, breaks : int
        Neighbours with different numbers of impacts; points whose past is not unique, where the set ends; gaps that did not
        close: a motion that just meets a stop and one that just does not have pasts far apart.
    complete : bool
        Whether it was followed for all its periods within the region.
    edge : EdgeState
    """

    multiplier: float
    direction: np.ndarray = field(repr=False)
    corners: int
    merging: int
    breaks: int
    complete: bool
    edge: "EdgeState" = field(repr=False)

    smooth = "Images of a smooth curve by smooth inverse maps: an immersed manifold as far as it was followed."

    def _met(self):
        parts = [(self.corners, f"has corners where motions graze ({self.corners} met)"),
                 (self.breaks, f"is torn at {self.breaks} places, at the stop or at the rim of the region"),
                 (self.merging, f"ends where motions come to rest or impact without end ({self.merging} points have no single "
                                "past): further pieces may lead to the saddle that are not found")]
        return parts, "pieces of curves"

    @checked(count=POINTS)
    def separates(self, count: int = 400, distance: float = BESIDE) -> float:
        """Return the share of points of the set, evenly spread within the map's grid, on whose two sides labels differ.

        Parameters
        ----------
        count : int
            Largest number of points asked.
        distance : float
            From the set, scaled.

        Raises
        ------
        ValueError
            When no piece of it lies in the grid.
        """
        basins, scale = self.edge.basins, self.edge.basins.scale
        grid, places = basins.grid, list(basins.grid.places(1, 2))
        steps = np.linalg.norm(np.diff(self.points, axis=0) / scale, axis=1)
        joined = (self.curves[1:] == self.curves[:-1]) & (steps > 10.0 * distance)
        inside = np.all((self.points[:, places] > grid.low) & (self.points[:, places] < grid.high), axis=1)
        joined = joined & inside[1:] & inside[:-1]
        if not joined.any():
            raise ValueError(f"{self!r} has no piece within {grid!r}")
        length = np.cumsum(np.where(joined, steps, 0.0))
        chosen = np.unique(np.searchsorted(length, (np.arange(count) + 0.5) / count * length[-1]))
        along = (self.points[chosen + 1] - self.points[chosen]) / scale
        along /= np.linalg.norm(along, axis=1)[:, None]
        across = distance * np.column_stack((-along[:, 1], along[:, 0])) * scale
        label = basins.labeller()
        left, right = (label((self.points[chosen] + side * across)[:, places]) for side in (1.0, -1.0))
        asked = (left != NO_START) & (right != NO_START)
        return float(np.mean((left != right)[asked]))

    def __repr__(self):
        cut, pieces = "" if self.complete else ", cut short", len(np.unique(self.curves))
        return f"StableSet({len(self.points)} points in {pieces} pieces{cut}, multiplier {self.multiplier:.6g})"


@checked(gap=POSITIVE)
def stable_set(edge: "EdgeState", *, periods: int = 60, gap: float = 0.01, most: int = 20000) -> StableSet:
    """Return the stable set of the saddle of an edge state, within the region of its map and half as much around.

    Parameters
    ----------
    edge : EdgeState
        With a saddle of one unstable and one stable direction: one degree of freedom.
    periods : int
        Forcing periods for which its beginning is carried back.
    gap : float
        Largest scaled distance of neighbouring points.
    most : int
        Largest number of points a side.

    Raises
    ------
    ValueError
        No saddle, another number of directions, or elements whose motions merge everywhere (dry friction).
    """
    if edge.saddle is None or edge.unstable_directions != 1 or edge.basins.scale.size != 2:
        raise ValueError(f"{edge!r} has {edge.unstable_directions} unstable directions of {edge.basins.scale.size}; a stable set "
                         "is drawn for one of two")
    search = Search(edge.basins, edge.pair)
    grid, places = edge.basins.grid, list(edge.basins.grid.places(1, 2))
    low, high = np.full(2, -np.inf), np.full(2, np.inf)
    low[places], high[places] = grid.low, grid.high
    back = Backwards(search.map, search.scale, low, high)
    x, k = section_points(edge.saddle)[0], edge.saddle.periods
    direction, inverse = direction_of(back.apply, search.scale, x, k)
    growth = abs(inverse) ** (1 if inverse > 0.0 else 2)
    sides = both_sides(back.apply, search.scale, x, direction, growth, strict=False)
    complete = all([side.propagate(periods, gap, most) for side in sides])
    merging = sum(side.ended[CellState.INCONSISTENT.code] for side in sides)
    return StableSet(*joined(sides), 1.0 / inverse, direction, sum(side.corners for side in sides), merging,
                     sum(side.breaks for side in sides), complete, edge)


