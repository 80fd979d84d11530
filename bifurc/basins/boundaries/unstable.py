"""Unstable set of a saddle of the period map: grown from its unstable direction, point by point, with no gap left unseen.

The local unstable manifold is a curve where the orbit itself is not grazing.  Its images under the period map of a system
with impacts are continuous but need not be a manifold: they have corners where motions graze, and where motions come to
rest on a stop different histories merge and the map has no inverse.  What was met is counted and said.
"""
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...checks import POSITIVE, checked
from ...content import Content
from ...ensemble.period_map import MAPPED
from ..attractors.attractors import section_points
from .search import Search, reaches

if TYPE_CHECKING:
    from .edges import EdgeState

STEP = 1e-6  # scaled, of the differences that give the unstable direction
FIRST, LAST, LEAST = 1e-5, 1e-4, 1e-10  # scaled: where the curve begins, where its first piece ends if it can, least begin
ENDING = 0.1  # of the gap, to which the end of a curve is found
BISECTIONS = 48  # of a gap that does not close
TOUCHING = 1e-9  # scaled distance of neighbours whose images a period later are apart only if the map jumps


@dataclass(frozen=True, eq=False)
class ImageSet(Content):
    """Images of a short piece of an invariant direction of a saddle, on both sides.

    Attributes
    ----------
    points : ndarray
        Section points (k, ns), along each image in order.
    sides : ndarray of int
        Side (k,) of each: 0 or 1.
    curves : ndarray of int
        Number (k,) of the unbroken piece each belongs to; a piece is a curve to be drawn.
    """

    points: np.ndarray = field(repr=False)
    sides: np.ndarray = field(repr=False)
    curves: np.ndarray = field(repr=False)

    smooth: ClassVar[str]  # what is said of it where nothing was met on the way

    @property
    def message(self) -> str:
        """What of it is a manifold, in words."""
        parts, kind = self._met()
        words = [text for count, text in parts if count]
        return f"The set {', '.join(words)}: {kind}, not a manifold." if words else self.smooth

    def _met(self) -> tuple[list[tuple[int, str]], str]:
        """Return how much of what was met on the way, each in words, and what the set is then."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class UnstableSet(ImageSet):
    """Images of a short piece of the unstable direction, on both sides.

    Attributes
    ----------
    points, sides, curves
        See `ImageSet`.
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

    labels: tuple
    multiplier: float
    corners: int
    merging: int
    breaks: int
    complete: bool

    smooth = "Images of a smooth curve by smooth maps: an immersed manifold as far as it was grown."

    def _met(self):
        parts = [(self.corners, f"has corners where motions graze ({self.corners} met)"),
                 (self.merging, f"passes motions that come to rest on a stop or impact without end ({self.merging} points): there "
                                "different starts merge and the map has no inverse"),
                 (self.breaks, f"is torn at {self.breaks} places where the map jumps")]
        return parts, f"a piecewise smooth {'set' if self.breaks else 'curve'}"

    def __repr__(self):
        left, right = (" and ".join(map(str, side)) for side in self.labels)
        cut = "" if self.complete else ", cut short"
        return f"UnstableSet({len(self.points)} points{cut}, sides lead to {left} | {right}, multiplier {self.multiplier:.6g})"


@checked(gap=POSITIVE)
def unstable_set(edge: "EdgeState", *, periods: int = 60, gap: float = 0.01, most: int = 20000) -> UnstableSet:
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
    search = Search(edge.basins, edge.pair)
    scale, k = search.scale, edge.saddle.periods
    x = section_points(edge.saddle)[0]
    direction, multiplier = direction_of(search.map.apply, scale, x, k)
    turns = k if multiplier > 0.0 else 2 * k
    growth = abs(multiplier) ** (turns // k)
    sides = both_sides(search.map.apply, scale, x, direction, growth)
    complete = all([side.propagate(periods, gap, most) for side in sides])
    labels = tuple(tuple(reaches(search.targets, search.integrator, side.start(np.linspace(0.0, 1.0, 64)),
                                 edge.basins.options["max_periods"])) for side in sides)
    return UnstableSet(*joined(sides), labels, multiplier, sum(side.corners for side in sides), sum(side.merging for side in sides),
                       sum(side.breaks for side in sides), complete)


def direction_of(apply: Callable, scale: np.ndarray, x: np.ndarray, k: int) -> tuple[np.ndarray, float]:
    """Return the scaled direction (ns,) in which the map over k periods grows most at ``x``, and its multiplier."""
    ns = x.size
    steps = STEP * scale
    X = np.concatenate([x + np.diag(steps), x - np.diag(steps)])
    images = apply(X, k).ends
    D = ((images[:ns] - images[ns:]) / (2.0 * steps[:, None])).T * (scale / scale[:, None])
    values, vectors = np.linalg.eig(D)
    top = int(np.argmax(np.abs(values)))
    vector = np.real(vectors[:, top])
    return vector / np.linalg.norm(vector), float(np.real(values[top]))


def both_sides(apply: Callable, scale, x, direction, growth: float, strict: bool = True) -> tuple["Side", "Side"]:
    """Return the beginnings of a set along its scaled direction (ns,) and against it, see `Side`."""
    d = max(min(FIRST, LAST / growth), LEAST) * direction * scale
    return Side(apply, scale, x, d, growth, strict), Side(apply, scale, x, -d, growth, strict)


def joined(sides) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (k, ns) of all pieces, and the numbers (k,) of the side and of the piece that each belongs to."""
    pieces = [piece for side in sides for piece in side.pieces]
    owners = [number for number, side in enumerate(sides) for _ in side.pieces]
    lengths = [len(piece) for piece in pieces]
    return np.concatenate(pieces), np.repeat(owners, lengths), np.repeat(np.arange(len(pieces)), lengths)


class Side:
    """One side of a set that grows, as images of its beginning x + d growth**s, 0 <= s <= 1, by the map ``apply``.

    Attributes
    ----------
    pieces : list of ndarray
        Unbroken, (k, ns) each.
    corners, merging, breaks : int
        See `UnstableSet`.
    ended : Counter
        Points that ended by their outcome.
    strict : bool
        Whether it ends where starts cannot be told apart any more; otherwise gaps stay there: further points still lie on it.
    """

    def __init__(self, apply: Callable, scale: np.ndarray, x: np.ndarray, d: np.ndarray, growth: float, strict: bool = True):
        self.apply, self.scale, self.x, self.d, self.growth, self.strict = apply, scale, x, d, growth, strict
        self.pieces: list[np.ndarray] = []
        self.corners = self.merging = self.breaks = 0
        self.ended: Counter[int] = Counter()

    def start(self, s: np.ndarray) -> np.ndarray:
        """Return points (len(s), ns) of the beginning."""
        return self.x + self.growth ** s[:, None] * self.d

    def propagate(self, periods: int, gap: float, most: int) -> bool:
        """Grow the pieces period by period; where neighbours part, starts are put between them."""
        s = np.linspace(0.0, 1.0, 9)
        ends, alive, whole = self.start(s), np.ones(9, bool), True
        self.pieces.append(ends)
        scale, total = self.scale, len(s)
        for number in range(1, periods + 1):
            before = ends
            ends, hits, speeds, good = self.step(before, alive)
            for _ in range(BISECTIONS):
                far = np.linalg.norm(np.diff(ends, axis=0) / scale, axis=1) > gap
                far &= good[1:] & good[:-1]
                ending = (good[1:] != good[:-1]) & alive[1:] & alive[:-1]  # one of two neighbours ended here: looked at closely
                far |= ending & (np.linalg.norm(np.diff(before, axis=0) / scale, axis=1) > ENDING * gap)
                wide = np.flatnonzero(far & (np.diff(s) > 1e-15))
                if not wide.size:
                    break
                if total + len(s) + wide.size > most:
                    return False
                new = 0.5 * (s[wide] + s[wide + 1])
                start, came = self.start(new), np.ones(new.size, bool)
                if number > 1:
                    start, _, _, came = self.step(start, came, number - 1)
                more = self.step(start, came)
                s, before, alive, ends, hits, speeds, good = (np.insert(old, wide + 1, fresh, axis=0) for old, fresh in zip(
                    (s, before, alive, ends, hits, speeds, good), (new, start, came, *more), strict=True))
            gaps = np.linalg.norm(np.diff(ends, axis=0) / scale, axis=1)
            torn = (gaps > gap) | ~good[1:] | ~good[:-1]
            if total + len(s) > most:
                return False
            if whole and not self.jumps(s, np.flatnonzero((gaps > gap) & good[1:] & good[:-1]), number):
                whole = False
                if self.strict:
                    return False
            self.corners += int(np.count_nonzero((hits[1:] != hits[:-1]) & ~torn))
            self.merging += int(np.count_nonzero((speeds == 0.0) & good))
            self.breaks += int(np.count_nonzero(torn & alive[1:] & alive[:-1] & (good[1:] | good[:-1])))
            places = np.split(np.arange(len(s)), np.flatnonzero(torn) + 1)
            self.pieces += [ends[place] for place in places if good[place[0]]]
            total += len(s)
            alive = good
            if not alive.any():
                break
        return whole

    def step(self, X: np.ndarray, alive: np.ndarray, periods: int = 1):
        """Return images (N, ns) of the points that are alive, their impacts and least speeds, and which go on."""
        ends, hits, speeds, good = X.copy(), np.zeros(len(X), np.int64), np.full(len(X), np.inf), np.zeros(len(X), bool)
        here = np.flatnonzero(alive)
        if here.size:
            found = self.apply(X[here], periods)
            good[here] = found.outcomes == MAPPED
            hits[here], speeds[here] = found.impacts, found.speeds
            ends[good] = found.ends[found.outcomes == MAPPED]
            self.ended.update(found.outcomes[found.outcomes != MAPPED].tolist())
        return ends, hits, speeds, good

    def jumps(self, s: np.ndarray, wide: np.ndarray, number: int) -> bool:
        """Return whether all gaps left after ``number`` periods are jumps of the last one, not lost digits of the start."""
        if not wide.size:
            return True
        left, right = self.start(s[wide]), self.start(s[wide + 1])
        if number > 1:
            left, right = (self.apply(side, number - 1).ends for side in (left, right))
        return bool((np.linalg.norm((right - left) / self.scale, axis=1) <= TOUCHING).all())
