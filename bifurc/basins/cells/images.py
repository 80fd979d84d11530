"""Where the cells of a grid go: their samples mapped in chunks, wherever an executor runs them."""
import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...ensemble.grid import Grid
from ...ensemble.initial_conditions import states_at
from ...ensemble.outcomes import OUTSIDE
from ...ensemble.period_map import PeriodMap
from ...jobs.executors import Kept, run_chunks, user_parts
from ...jobs.progress import Progress
from ...jobs.store import ChunkStore, fingerprint
from ...structure.components import states_of
from ...system import System

PIECE = 2048  # samples that a thread maps at a time where nothing is filed
LEAN, GENERAL = 250_000, 60_000  # samples x periods of a chunk that is filed: about half a second, with a batch kernel and without
_carriers = Kept()


class CellImages(NamedTuple):
    """Images of the samples of all cells."""

    rows: np.ndarray  # (k,) cell of each sample that is a start, ascending
    columns: np.ndarray  # (k,) image cell, -1: outside the grid
    starts: np.ndarray  # (N,) bool: the cell holds a start
    special: dict  # cells represented by a state of their own: number -> state
    lost: int  # samples whose motion was lost (infinity, too many events)


class Carrier:
    """Carries points of a grid over mappings.

    Parameters
    ----------
    system : System, or function of states (k, d)
    grid : Grid
    periods : int
        Forcing periods (iterates) a mapping.
    max_events : int
    """

    def __init__(self, system: System | Callable, grid: Grid, periods: int, max_events: int):
        self.system, self.grid, self.periods = system, grid, periods
        self.map = PeriodMap(system, max_events=max_events) if isinstance(system, System) else None

    @property
    def lean(self) -> bool:
        """Whether a period costs less than a microsecond."""
        return self.map is None or self.map.kernel in ("batch", "smooth")

    def states(self, points: np.ndarray) -> np.ndarray:
        """Return the states (k, ns) of points (k, d)."""
        if self.map is None:
            return np.array(points)
        return states_at(self.map.scene, self.grid.names, self.grid.at, points)

    def images(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return image points (k, d), outcomes (k,) and image cells (k,) of states (k, ns)."""
        if self.map is None:
            ends, outcomes = self._iterated(states)
        else:
            found, scene = self.map.apply(states, self.periods), self.map.scene
            ends, outcomes = found.ends[:, list(self.grid.places(scene.n, scene.ns, states_of(scene)))], found.outcomes
        good = outcomes == 0
        return ends, outcomes, np.where(good, self.grid.cells_of(np.where(good[:, None], ends, np.nan)), -1)

    def _iterated(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert callable(self.system)
        shape = X.shape
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(self.periods):
                X = np.asarray(self.system(X), float)
        if X.shape != shape:
            raise ValueError(f"system returned an array of shape {X.shape}; it must return states (k, {shape[1]}), here {shape}")
        return X, np.where(np.isfinite(X).all(axis=1), 0, 3)


def offsets_of(grid: Grid, samples: int) -> np.ndarray:
    """Return the places (s, d) of the samples in a cell, 0 .. 1."""
    ticks = (np.arange(samples) + 0.5) / samples
    return np.stack(np.meshgrid(*[ticks] * len(grid.names), indexing="ij"), axis=-1).reshape(-1, len(grid.names))


def map_cells(payload: Mapping, function: Callable | None = None) -> tuple[dict, dict[str, np.ndarray]]:
    """Map the samples of some cells: the work of a chunk.

    Parameters
    ----------
    payload : dict
        ``system`` (record, None: the function), ``elements``, ``grid`` (record), ``periods``, ``samples``, ``max_events``,
        ``key`` of these, ``cells`` (first, after the last).
    function : callable, optional
        A map given as one; it travels beside the payload, whose hash names chunks.

    Returns
    -------
    meta, arrays
        ``lost``; ``rows`` and ``columns`` of `CellImages`.
    """
    carrier = _carriers.get(payload["key"]) if function is None else None
    if carrier is None:
        system = System.from_record(payload["system"], payload["elements"]) if function is None else function
        carrier = Carrier(system, Grid.from_record(payload["grid"]), payload["periods"], payload["max_events"])
        if function is None:
            _carriers.put(payload["key"], carrier)
    cells, offsets, grid = np.arange(*payload["cells"]), offsets_of(carrier.grid, payload["samples"]), carrier.grid
    _, outcomes, columns = carrier.images(carrier.states(spread(grid, cells, offsets)))
    good = outcomes != OUTSIDE
    return {"lost": int(np.count_nonzero(outcomes[good]))}, {"rows": np.repeat(cells, len(offsets))[good], "columns": columns[good]}


def spread(grid: Grid, cells: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the samples (k s, d) of cells (k,)."""
    return (grid.points(cells)[:, None] + (offsets - 0.5) * grid.widths).reshape(-1, len(grid.names))


def representatives(carrier: Carrier, cells: np.ndarray, samples: int, special: Mapping) -> np.ndarray:
    """Return a state (k, ns) for each of some cells: its own in ``special``, or the start nearest to the centre among centre and
    samples.  A centre beyond a rigid stop stands for no motion, though other parts of the cell do."""
    grid = carrier.grid
    states = carrier.states(grid.points(cells))
    if samples > 1:
        offsets = offsets_of(grid, samples)
        nearest = offsets[np.argsort(((offsets - 0.5)**2).sum(axis=1), kind="stable")]
        offsets = np.vstack((np.full((1, len(grid.names)), 0.5), nearest))
        mine = carrier.states(spread(grid, np.asarray(cells), offsets))
        starts = (carrier.images(mine)[1] != OUTSIDE).reshape(len(states), len(offsets))
        states = mine.reshape(*starts.shape, -1)[np.arange(len(states)), np.argmax(starts, axis=1)]
    for place, cell in enumerate(np.asarray(cells).tolist()):
        if cell in special:
            states[place] = special[cell]
    return states


def cell_images(carrier: Carrier, samples: int, max_events: int, store: ChunkStore, run: Mapping, bar: Progress) -> CellImages:
    """Map the samples of all cells, then one state of each cell that is reached but holds no sample that is a start.

    Raises
    ------
    RuntimeError
        When chunks fail; the others are kept where a file is given.
    """
    grid, system = carrier.grid, carrier.system
    common: dict[str, Any] = {"system": None, "elements": (), "grid": grid.to_record(), "periods": carrier.periods,
                              "samples": samples, "max_events": max_events}
    work: Callable = map_cells
    if isinstance(system, System):
        common |= {"system": system.to_record(), "elements": user_parts(system)}
        common["key"] = fingerprint(common)
        _carriers.put(common["key"], carrier)
    else:
        work, common["key"] = functools.partial(map_cells, function=system), ""
    offsets = offsets_of(grid, samples)
    filed = (LEAN if carrier.lean else GENERAL) // carrier.periods
    step = max((filed if store.folder is not None or run["executor"] is not None else PIECE) // len(offsets), 1)
    parts = [(first, min(first + step, grid.size)) for first in range(0, grid.size, step)]
    outcome = run_chunks(store, work, [{**common, "cells": part} for part in parts], bar=bar,
                         weights=[float(after - first) for first, after in parts], **run)
    if outcome.failures:
        chunk, why = next(iter(outcome.failures.items()))
        raise RuntimeError(f"{len(outcome.failures)} of {len(parts)} chunks of cells failed; the others are finished, and kept "
                           f"where a file is given. Chunk {chunk}, cells {parts[chunk][0]} to {parts[chunk][1] - 1}: {why}")
    results = [result for result in outcome.results if result is not None]
    rows, columns = (np.concatenate([arrays[name] for _, arrays in results]) for name in ("rows", "columns"))
    return _completed(carrier, rows, columns, offsets, sum(meta["lost"] for meta, _ in results))


def _completed(carrier: Carrier, rows: np.ndarray, columns: np.ndarray, offsets: np.ndarray, lost: int) -> CellImages:
    """Give a state to each cell whose samples all lie beyond a stop but that is reached: the first that arrives."""
    grid = carrier.grid
    starts = np.zeros(grid.size, bool)
    starts[rows] = True
    special: dict[int, np.ndarray] = {}
    fresh_rows, fresh = rows, columns
    while True:
        landing = np.flatnonzero((fresh >= 0) & ~starts[fresh])
        if not landing.size:
            break
        reached, first = np.unique(fresh[landing], return_index=True)
        for cell, row in zip(reached.tolist(), fresh_rows[landing[first]].tolist(), strict=True):
            sources = special[row][None] if row in special else carrier.states(spread(grid, np.array([row]), offsets))
            ends, _, arrived = carrier.images(sources)
            special[cell] = carrier.states(ends[arrived == cell][:1])[0]
        starts[reached] = True
        _, outcomes, fresh = carrier.images(np.array([special[cell] for cell in reached.tolist()]))
        fresh_rows = reached
        lost += int(np.count_nonzero(outcomes))
        rows, columns = np.concatenate((rows, fresh_rows)), np.concatenate((columns, fresh))
    order = np.argsort(rows, kind="stable")
    return CellImages(rows[order], columns[order], starts, special, lost)
