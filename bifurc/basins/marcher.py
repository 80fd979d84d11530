"""From starts to labels: the compiled march where it serves, the general one behind it, Python for what both leave open."""
import itertools
import threading
from typing import NamedTuple

import numpy as np

from ..compose.scene import Scene
from ..flow import settle
from .near import STAY, boxed, nearest
from .starting import BEYOND, begin
from .states import ASK, CROWDED, DIVERGED, OUTSIDE, REACHED, STUCK, UNSETTLED

MOST_START_MODES = 64  # tried by the compiled start; more go to Python


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
    impacts: np.ndarray  # int64, impacts until then
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
        from ..flow.engine import engine_of
        self.scene, self.limit = scene, limit
        self._engine_of = engine_of
        self._lock = threading.Lock()
        self._candidates = np.array(list(itertools.islice(scene.start_modes(), MOST_START_MODES)), np.int64)
        self.lean = scene.closed_form and bool(single.fits(scene.tables))

    def label(self, X: np.ndarray, targets: Targets, most: int) -> Cells:
        """Follow the starts ``X`` (N, ns), in place, until they are near an attractor or ``most`` periods have passed."""
        cells = Cells(*(np.full(len(X), value, np.int64) for value in (-1, 0, 0, ASK)))
        modes = np.empty(len(X), np.int64)
        starts = X.copy()
        with self._lock:
            T = self.scene.tables
        begin(T, self._candidates, X, modes)
        cells.states[modes == BEYOND] = OUTSIDE
        if self.lean:
            from .lean import label
            from ..flow.single import pack
            label(*pack(T), modes, X, self.limit, most, *targets, *cells)
        else:
            self._general()(T, modes, X, self.limit, most, *targets, *cells)
        for i in np.flatnonzero(cells.states == ASK):
            with self._lock:
                X[i] = starts[i]
                self._follow(i, X, cells, targets, most)
        return cells

    def _general(self):
        if self.scene.closed_form:
            from .general import label
            return label
        from ..compose.writer import kernels
        return kernels(self.scene.laws, self.scene.n, "bifurc.basins.general").label

    def _follow(self, i: int, X: np.ndarray, cells: Cells, targets: Targets, most: int) -> None:
        """Follow one start with all decisions open to Python."""
        from ..flow.scan import COUNT, DONE, EVENTS, LIMIT, LOST, MODE, NEED, SINCE, STATE, TAU
        from ..flow.scan import AT_GUARD
        from ..flow.simulate import _forcing, _orders, _resize
        scene, engine = self.scene, self._engine_of(self.scene)
        x = np.zeros(scene.ns + scene.nw)
        x[:scene.ns] = X[i]
        _forcing(scene, 0.0, x)
        try:
            mode, x = settle.start(scene, x, engine.series)
        except settle.Penetration:
            cells.states[i] = OUTSIDE
            return
        except settle.Inconsistent:
            cells.states[i] = STUCK
            return
        T = scene.tables
        ints, floats = engine.workspace(T)
        ints[MODE], floats[TAU] = mode, 0.0
        _orders(engine.series, T, mode, x, ints, floats)
        rows, record = np.zeros((0, 5), np.int64), np.zeros((0, STATE + 2 * scene.ns))
        stay, guest, k = 0, -1, 1
        cells.labels[i], cells.states[i] = -1, UNSETTLED
        while k <= most:
            cells.periods[i] = k
            code = engine.run(T, ints, floats, x, k, 0.0, self.limit, rows, record)
            if code == DONE:
                y = x[:scene.ns]
                found = nearest(y, targets.inverse, targets.points, targets.squares, targets.owner)
                if found < 0 and targets.keys.size:
                    keeper = boxed(y, targets.inverse, targets.width, targets.keys, targets.keepers)
                    stay = stay + 1 if keeper >= 0 and keeper == guest else 0
                    guest = keeper
                    found = keeper if stay >= STAY else -1
                if found >= 0:
                    cells.labels[i], cells.states[i] = found, REACHED
                    break
                k += 1
                continue
            if code in (LIMIT, LOST):
                cells.states[i] = CROWDED if code == LIMIT else DIVERGED
                break
            m, g = int(ints[MODE]), int(ints[AT_GUARD])
            if code == NEED:
                T = scene.expand(m, g)
            else:
                try:
                    ints[MODE], x, _ = settle.decide(scene, m, g, x, floats[SINCE], engine.series)
                except settle.Inconsistent:
                    cells.states[i] = STUCK
                    break
                ints[EVENTS] += 1
                ints[COUNT] += 1
                T = scene.tables
            engine = self._engine_of(scene)
            ints, floats = _resize(engine, T, ints, floats)
            _orders(engine.series, T, int(ints[MODE]), x, ints, floats)
        cells.impacts[i] = ints[EVENTS]
        X[i] = x[:scene.ns]
