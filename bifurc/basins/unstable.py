"""Unstable set of a saddle of the period map: grown from its unstable direction, point by point, with no gap left unseen.

The local unstable manifold is a curve where the orbit itself is not grazing.  Its images under the period map of a system
with impacts are continuous but need not be a manifold: they have corners where motions graze, and where motions come to
rest on a stop different histories merge and the map has no inverse.  What was met is counted and said.
"""
from dataclasses import dataclass, field

import numpy as np

from .attractors import section_points
from .edges import EdgeState, _Search, reaches
from .periodmap import MAPPED

STEP = 1e-6  # scaled, of the differences that give the unstable direction
FIRST, LAST, LEAST = 1e-5, 1e-4, 1e-10  # scaled: where the curve begins, where its first piece ends if it can, least begin
BISECTIONS = 48  # of a gap that does not close
TOUCHING = 1e-9  # scaled distance of neighbours whose images a period later are apart only if the map jumps


@dataclass(frozen=True, eq=False)
class UnstableSet:
    """Images of a short piece of the unstable direction, on both sides.

    Attributes
    ----------
    points : ndarray
        Section points (k, ns), along each image in order.
    sides : ndarray of int
        Side (k,) of each: 0 or 1.
    curves : ndarray of int
        Number (k,) of the unbroken piece each belongs to; a piece is a curve to be drawn.
    labels : tuple of tuple of int
        Attractors that each side leads to.
    multiplier : float
        Along the unstable direction, of one period of the orbit.
    corners, merging, breaks : int
        Neighbouring points with different numbers of impacts (grazing between them: a corner); points whose motion came to
        rest or whose impacts accumulated (different starts merge there); gaps that did not close.
    complete : bool
        Whether it was grown for all its periods; otherwise the next image would have needed too many points, or starts
        closer than numbers can tell apart.
    """

    points: np.ndarray = field(repr=False)
    sides: np.ndarray = field(repr=False)
    curves: np.ndarray = field(repr=False)
    labels: tuple
    multiplier: float
    corners: int
    merging: int
    breaks: int
    complete: bool

    @property
    def message(self) -> str:
        """What of it is a manifold, in words."""
        if not (self.corners or self.merging or self.breaks):
            return "Images of a smooth curve by smooth maps: an immersed manifold as far as it was grown."
        parts = []
        if self.corners:
            parts.append(f"has corners where motions graze ({self.corners} met)")
        if self.merging:
            parts.append(f"passes motions that come to rest on a stop or impact without end ({self.merging} points): there "
                         "different starts merge and the map has no inverse")
        if self.breaks:
            parts.append(f"is torn at {self.breaks} places where the map jumps")
        return f"The set {', '.join(parts)}: a piecewise smooth {'set' if self.breaks else 'curve'}, not a manifold."

    def __repr__(self):
        left, right = (" and ".join(map(str, side)) for side in self.labels)
        cut = "" if self.complete else ", cut short"
        return f"UnstableSet({len(self.points)} points{cut}, sides lead to {left} | {right}, multiplier {self.multiplier:.6g})"


def unstable_set(edge: EdgeState, *, periods: int = 60, gap: float = 0.01, most: int = 20000) -> UnstableSet:
    """Return the unstable set of the saddle of an edge state.

    Parameters
    ----------
    edge : EdgeState
        With a saddle of one unstable direction.
    periods : int
        Forcing periods for which its beginning is carried on.
    gap : float
        Largest scaled distance of neighbouring points.
    most : int
        Largest number of points a side.

    Raises
    ------
    ValueError
        No saddle, or more than one unstable direction.
    """
    if edge.saddle is None or edge.unstable_directions != 1:
        raise ValueError(f"{edge!r} has {edge.unstable_directions} unstable directions; an unstable set is drawn for exactly one")
    search = _Search(edge.basins, edge.pair)
    scale, k = search.scale, edge.saddle.periods
    x = section_points(edge.saddle)[0]
    direction, multiplier = _direction(search, x, k)
    turns = k if multiplier > 0.0 else 2 * k
    growth = abs(multiplier) ** (turns // k)
    first = max(min(FIRST, LAST / growth), LEAST)
    points: list[np.ndarray] = []
    sides: list[np.ndarray] = []
    curves: list[np.ndarray] = []
    labels = []
    corners = merging = breaks = 0
    complete = True
    for side, sign in enumerate((1.0, -1.0)):
        grown = _Side(search, x, sign * first * direction * scale, growth)
        complete &= grown.carry(periods, gap, most)
        corners, merging, breaks = corners + grown.corners, merging + grown.merging, breaks + grown.breaks
        for piece in grown.pieces:
            curves.append(np.full(len(piece), 1 + (curves[-1][0] if curves else -1)))
            points.append(piece)
            sides.append(np.full(len(piece), side))
        labels.append(tuple(reaches(search.targets, search.marcher, grown.start(np.linspace(0.0, 1.0, 64)),
                                    edge.basins.options["max_periods"])))
    return UnstableSet(np.concatenate(points), np.concatenate(sides), np.concatenate(curves), tuple(labels), multiplier,
                       corners, merging, breaks, complete)


def _direction(search: _Search, x: np.ndarray, k: int) -> tuple[np.ndarray, float]:
    """Return the scaled unstable direction (ns,) of the map over k periods, and its multiplier."""
    ns = x.size
    steps = STEP * search.scale
    X = np.concatenate([x + np.diag(steps), x - np.diag(steps)])
    images = search.map.apply(X, k).ends
    D = ((images[:ns] - images[ns:]) / (2.0 * steps[:, None])).T * (search.scale / search.scale[:, None])
    values, vectors = np.linalg.eig(D)
    top = int(np.argmax(np.abs(values)))
    vector = np.real(vectors[:, top])
    return vector / np.linalg.norm(vector), float(np.real(values[top]))


class _Side:
    """The unstable set on one side, as images of its beginning x + d growth**s, 0 <= s <= 1."""

    def __init__(self, search: _Search, x: np.ndarray, d: np.ndarray, growth: float):
        self.search, self.x, self.d, self.growth = search, x, d, growth
        self.pieces: list[np.ndarray] = []
        self.corners = self.merging = self.breaks = 0

    def start(self, s: np.ndarray) -> np.ndarray:
        """Return points (len(s), ns) of the beginning."""
        return self.x + self.growth ** s[:, None] * self.d

    def carry(self, periods: int, gap: float, most: int) -> bool:
        """Grow the pieces period by period; where neighbours part, starts are put between them."""
        s = np.linspace(0.0, 1.0, 9)
        images = self.start(s)
        self.pieces.append(images)
        scale, total = self.search.scale, len(s)
        for number in range(1, periods + 1):
            step = self.search.map.apply(images)
            ends, hits, speeds, good = step.ends, step.impacts, step.speeds, step.outcomes == MAPPED
            for _ in range(BISECTIONS):
                far = np.linalg.norm(np.diff(ends, axis=0) / scale, axis=1) > gap
                far &= good[1:] & good[:-1] & (np.diff(s) > 1e-15)
                wide = np.flatnonzero(far)
                if not wide.size:
                    break
                if total + len(s) + wide.size > most:
                    return False
                new = 0.5 * (s[wide] + s[wide + 1])
                before = self.start(new) if number == 1 else self.search.map.apply(self.start(new), number - 1).ends
                more = self.search.map.apply(before)
                s, ends, hits, speeds, good = (np.insert(old, wide + 1, fresh, axis=0) for old, fresh in (
                    (s, new), (ends, more.ends), (hits, more.impacts), (speeds, more.speeds), (good, more.outcomes == MAPPED)))
            gaps = np.linalg.norm(np.diff(ends, axis=0) / scale, axis=1)
            torn = (gaps > gap) | ~good[1:] | ~good[:-1]
            if total + len(s) > most or not self.jumps(s, np.flatnonzero(gaps > gap), number):
                return False
            self.corners += int(np.count_nonzero(hits[1:] != hits[:-1]))
            self.merging += int(np.count_nonzero(speeds == 0.0))
            self.breaks += int(np.count_nonzero(torn))
            self.pieces += [piece for piece in np.split(ends, np.flatnonzero(torn) + 1) if len(piece)]
            total += len(s)
            images = ends
        return True

    def jumps(self, s: np.ndarray, wide: np.ndarray, number: int) -> bool:
        """Return whether all gaps left after ``number`` periods are jumps of the last one, not lost digits of the start."""
        if not wide.size:
            return True
        left, right = self.start(s[wide]), self.start(s[wide + 1])
        if number > 1:
            left, right = (self.search.map.apply(side, number - 1).ends for side in (left, right))
        return bool((np.linalg.norm((right - left) / self.search.scale, axis=1) <= TOUCHING).all())
