"""From starts to labels: the compiled march, and the simulation with its joint decisions for what that leaves open."""
import itertools
import threading
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

from ..compose.scene import Scene
from ..elements import EventKind
from ..flow import settle
from ..flow.status import Status
from .near import STAY, boxed, nearest
from .starting import BEYOND, begin
from .states import ASK, CROWDED, DIVERGED, OUTSIDE, REACHED, STUCK, UNSETTLED

MOST_START_MODES = 64  # tried by the compiled start; more go to Python
BLOCK = 32  # forcing periods that the general march does at a time
FAILED = {Status.TOO_MANY_EVENTS: CROWDED, Status.DIVERGED: DIVERGED, Status.INCONSISTENT: STUCK}


class Targets(NamedTuple):
    """Attractors as the kernels see them, see `bifurc.basins.near`."""

    inverse: np.ndarray  # (ns,) 1 / scale
    points: np.ndarray  # (P, ns) section points of periodic attractors, scaled
    squares: np.ndarray  # (P,) squared radii
    owner: np.ndarray  # (P,) label
    width: float  # of the boxes of chaotic attractors, scaled
    keys: np.ndarray  # (K,) sorted hashes of their boxes, uint64
    keepers: np.ndarray  # (K,) label


class Cells(NamedTuple):
    """What became of starts, one entry each."""

    labels: np.ndarray  # int64, -1: none
    periods: np.ndarray  # int64, forcing periods until it was near the attractor
    impacts: np.ndarray  # int64, impacts and elastic contacts until then
    states: np.ndarray  # int64, code of `CellState`


class Marcher:
    """Labels starts of one scene.  Safe to be called from several threads.

    Parameters
    ----------
    scene : Scene
    limit : int
        Largest number of events a forcing period.
    """

    def __init__(self, scene: Scene, limit: int):
        from ..flow import single
        self.scene, self.limit = scene, limit
        self._lock = threading.Lock()
        self._candidates = np.array(list(itertools.islice(scene.start_modes(), MOST_START_MODES)), np.int64)
        self.lean = scene.closed_form and bool(single.fits(scene.tables))

    def label(self, X: np.ndarray, targets: Targets, most: int) -> Cells:
        """Follow the starts ``X`` (N, ns), in place, until near an attractor or for ``most`` periods."""
        cells = Cells(*(np.full(len(X), value, np.int64) for value in (-1, 0, 0, ASK)))
        starts = X.copy()
        with self._lock:
            T = self.scene.tables
        modes = np.empty(len(X), np.int64)
        begin(T, self._candidates, X, modes)
        cells.states[modes == BEYOND] = OUTSIDE
        if self.lean:
            from ..flow.single import pack
            from .lean import label
            label(*pack(T), modes, X, self.limit, most, *targets, *cells)
        elif self.scene.closed_form:
            from .general import label as label_any
            label_any(T, modes, X, self.limit, most, *targets, *cells)
        # Under a law a period is long beside Python's share of it: the simulation serves, and nothing more is compiled.
        for i in np.flatnonzero(cells.states == ASK).tolist():
            with nullcontext() if self.scene.complete else self._lock:
                X[i] = starts[i]
                self._follow(i, X, cells, targets, most)
        return cells

    def _follow(self, i: int, X: np.ndarray, cells: Cells, targets: Targets, most: int) -> None:
        """Follow one start with all decisions open to Python."""
        from ..flow.scan import PASSED
        from ..flow.simulate import march
        y, stay, guest = X[i].copy(), 0, -1
        cells.labels[i], cells.states[i], cells.periods[i], cells.impacts[i] = -1, UNSETTLED, 0, 0
        for first in range(0, most, BLOCK):
            last = min(first + BLOCK, most)
            try:
                motion = march(self.scene, y, (first, 0.0), (last, 0.0), self.limit)
            except settle.Penetration:
                cells.states[i] = OUTSIDE
                return
            except settle.Inconsistent:
                cells.states[i] = STUCK
                return
            rows = motion.recorded.rows[motion.recorded.rows[:, 3] != PASSED]
            T, m, g = self.scene.tables, rows[:, 0], rows[:, 1]
            hits = rows[(T.kick[m, g] == 1) | (T.kind[m, g] == EventKind.CONTACT.code), 4]
            for k, y in enumerate(motion.sections[1:], first + 1):
                found = nearest(y, targets.inverse, targets.points, targets.squares, targets.owner)
                if found < 0 and targets.keys.size:
                    keeper = boxed(y, targets.inverse, targets.width, targets.keys, targets.keepers)
                    stay = stay + 1 if keeper >= 0 and keeper == guest else 0
                    guest = keeper
                    found = keeper if stay >= STAY else -1
                if found >= 0:
                    cells.labels[i], cells.states[i], cells.periods[i] = found, REACHED, k
                    cells.impacts[i] += np.count_nonzero(hits < k)
                    return
            cells.periods[i] = last
            cells.impacts[i] += hits.size
            X[i] = y
            if not motion.success:
                cells.states[i] = FAILED[motion.status]
                return
