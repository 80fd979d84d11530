"""Cell mapping: the state space as cells, the motion as a map or a Markov chain of cells, attractors confirmed by Newton."""
import math
import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...checks import PLACE, SYSTEM, checked, either, function
from ...ensemble.grid import Grid
from ...ensemble.outcomes import NO_START
from ...jobs.executors import user_parts
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...structure.components import component_names
from ...system import System
from ..attractors.attractors import ChaoticAttractor, SampledAttractor
from ..maps.compute import scale_of
from .cell_map import Audit, CellFate, CellMap, Group, GroupKind
from .confirmation import MapJudge, SystemJudge, cells_around
from .generalized import components, period, transition
from .images import Carrier, cell_images, representatives
from .simple import colour, cycles

RANDOM_STARTS = 64  # whose motions are followed too: an attractor may lie in no group of cells that are too large
MOST_GROUPS = 400  # closed groups whose motion is followed
TRIED = 16  # cells at which a map given as a function is tried
ASKED = 32  # cells of a group whose motion is followed
FARTHEST = 30.0  # cells: a group farther from its attractor is none of its neighbours
AUDIT_BATCH = 1024


@checked(system=either(SYSTEM, function, allowed="a System, or a map of points (k, n)"), audit=PLACE)
def cell_mapping(system: System | Callable, grid: Grid, *, periods: int = 1, samples: int = 1, audit: int = 2000, seed: int = 0,
                 workers: int | None = None, tolerance: float = 1e-4, max_periods: int = 2000, max_events: int = 2000,
                 executor=None, progress: bool = False, file=None) -> CellMap:
    """Return the map of cells of a system: its groups, what leads to them, and the attractors they hold.

    With one sample a cell this is simple cell mapping (each cell goes where its centre goes), with more it is generalized
    cell mapping (a Markov chain).  A cycle of cells need not be one of the motion: the motion from every closed group is
    followed, an attractor is reported only when Newton confirmed it (or, chaotic, its exponent is surely positive), and a
    group with no attractor in it is called spurious.  How many cells have a wrong label is measured on a random sample.

    Parameters
    ----------
    system : System, or callable
        With an excitation; or a map ``f(x) -> y`` of states (k, d) to states (k, d), d the number of the grid's components.
    grid : Grid
        Over all components of the state, memory too (``w0`` is where the first slider is).  What leaves it counts as gone: one
        sink.  Memory beyond a limit is put where the limit puts it: a cell stands for what its centre becomes at once.
    periods : int
        Forcing periods (iterates) a mapping.  Many make simple cell mapping accurate, one shows the order of an orbit.
    samples : int
        Points a cell along each component.
    audit : int
        Cells whose label is compared with the motion followed from their centres; 0: none.
    seed : int
        Of the audit.
    workers : int, optional
        Threads; default: one a processor.  Results do not depend on it.
    tolerance, max_periods, max_events
        Of following motions, see `basins_of_attraction`.
    executor : Executor, dask.distributed.Client, function, or None
        Where cells are mapped; None: threads.  See `bifurc.sweep`.  No choice changes a bit of the result.
    progress : bool
        Show progress.
    file : path-like, optional
        Where the map is saved.  Finished chunks are kept in ``<file>.chunks`` until it is: after an interrupt or a kill
        the same call computes only what is missing; when the map is there already, it is read.

    Returns
    -------
    CellMap

    Raises
    ------
    ValueError
        Autonomous system, a grid that does not cover the state, options out of range; a file for a map given as a function.
    RuntimeError
        When chunks fail; the others are kept where a file is given.
    MemoryError
        When the grid's cells would not fit in half of the machine's memory; the message says how much they need.

    Examples
    --------
    >>> import bifurc as bf
    >>> grid = bf.Grid(q0=(-2.5, 0.0, 60), v0=(-3, 3, 60))
    >>> system = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
    >>> found = bf.cell_mapping(system, grid, periods=30)
    >>> sorted(item.periods for item in found.attractors)
    [1, 3]
    """
    workers = workers or os.cpu_count() or 1
    options = {"seed": seed, "tolerance": tolerance, "max_periods": max_periods, "max_events": max_events}
    edges = samples ** len(grid.names)
    grid.require(8.0 * (4 * len(grid.names) + 12) + (60.0 if samples > 1 else 40.0) * edges, "a map of its cells")
    run = {"workers": workers, "executor": executor}
    carrier, judge = _source(system, grid, periods, options, run)
    elements, job = (), {"what": "cells", "grid": grid.to_record(), "periods": periods, "samples": samples, "options": options}
    if isinstance(system, System):
        elements = user_parts(system)
        job |= {"system": system.to_record(), "elements": elements}
    elif file is not None:
        raise ValueError(f"file = {file!r} is not allowed for the map {system!r}: files hold no code; leave it out")

    def compute(store: ChunkStore, key: str) -> CellMap:
        return _mapped(system, grid, periods, samples, audit, options, carrier, judge, store, key,
                       run, progress)

    return resumable("cells", file, job, partial(CellMap.from_record, elements=elements), compute, part={"audit": audit})


def _mapped(system, grid: Grid, periods: int, samples: int, audit: int, options: dict, carrier: Carrier, judge, store: ChunkStore,
            key: str, run: dict, progress) -> CellMap:
    """Map the cells, find the groups, ask the motion about each, and compare labels with it."""
    with Progress("cells", grid.size, progress) as bar:
        images = cell_images(carrier, samples, int(options["max_events"]), store, run, bar)
    judge.store = store  # what is asked of the motion is filed too
    embed = carrier.states

    def standing(cells: np.ndarray) -> np.ndarray:
        return representatives(carrier, cells, samples, images.special)

    matrix = transition(images.rows, images.columns, grid.size)
    if samples == 1:
        image = np.full(grid.size, -1)
        image[images.rows] = images.columns
        found = colour(image)
        lists = [cells for cells in cycles(found, image)[1:]]
        lengths = [len(cells) for cells in lists]
        group_of, steps = found.group[:-1] - 1, found.steps[:-1]
    else:
        parts = components(matrix)
        order = np.argsort(parts.label[:-1], kind="stable")
        begin = np.searchsorted(parts.label[order], np.arange(parts.total + 1))
        closed = np.flatnonzero(parts.closed & (np.arange(parts.total) != parts.label[-1]))
        lists = [order[begin[item]:begin[item + 1]] for item in closed]
        lengths = [period(matrix, cells) for cells in lists]
        group_of = steps = np.empty(0, np.int64)
    kept = [k for k, cells in enumerate(lists) if images.starts[cells].all()]
    rng = np.random.default_rng(int(options["seed"]))
    judge.search(embed(rng.uniform(grid.low, grid.high, (RANDOM_STARTS, len(grid.names)))))
    groups = _judged(judge, grid, periods, samples == 1, [lists[k] for k in kept], [lengths[k] for k in kept], standing)
    number = np.full(len(lists) + 1, -1)
    number[kept] = np.arange(len(kept))
    owner = np.array([group.attractor for group in groups] + [-1])
    if samples == 1:
        group_of = np.where(group_of >= 0, number[group_of], -1)
        labels = owner[group_of]
        fates = np.where(labels >= 0, CellFate.ATTRACTED.code,
                         np.where(group_of >= 0, CellFate.UNRESOLVED.code, CellFate.LEFT.code))
        labels[~images.starts], fates[~images.starts] = -1, CellFate.OUTSIDE.code
        made = CellMap(system, grid, periods, samples, tuple(judge.attractors), tuple(groups), matrix, labels, fates, group_of,
                       np.where(images.starts, steps, 0), None, images.lost, options, key)
    else:
        made = CellMap(system, grid, periods, samples, tuple(judge.attractors), tuple(groups), matrix, np.empty(0, np.int64),
                       np.where(images.starts, CellFate.UNRESOLVED.code, CellFate.OUTSIDE.code), None, None, None, images.lost,
                       options, key).with_labels()
    if audit:
        made = made.with_audit(_audit(judge, made, embed, audit))
    return made


def _source(system, grid: Grid, periods: int, options: dict, run: dict) -> tuple[Carrier, Any]:
    """Return what carries states over mappings, and the judge of groups."""
    if not isinstance(system, System):
        if grid.at:
            raise ValueError(f"grid = {grid!r} fixes components; a map given as a function has those of the grid only")
        mapped = Carrier(system, grid, periods, options["max_events"])
        cells = np.unique(np.linspace(0, grid.size - 1, TRIED).astype(int))
        ends = np.concatenate([mapped.images(grid.points(cells[i:i + 1]))[0] for i in range(len(cells))])  # says when it is no map
        if np.isnan(ends).all():
            raise ValueError(f"system = {system!r} gives NaN wherever it was tried, as from {grid.points(cells[:1])[0].tolist()}")
        return mapped, MapJudge(system, grid, options)
    if system.period is None:
        raise ValueError(f"{system!r} is autonomous; a map of cells needs the phase of an excitation (omega)")
    carrier = Carrier(system, grid, periods, options["max_events"])
    assert carrier.map is not None
    scene = carrier.map.scene
    n, ns = scene.n, scene.ns
    places = grid.places(n, ns, system.states)
    if sorted(places) != list(range(ns)):
        have = component_names(n, ns, system.states)
        missing = [name for place, name in enumerate(have) if place not in places]
        raise ValueError(f"grid = {grid!r} does not cover the state of {system!r}: a map of cells runs over all of "
                         f"{', '.join(have)}; missing: {', '.join(missing)}. Over a slice write basins_of_attraction")
    scale = scale_of(scene, carrier.states(np.array([grid.low, grid.high])))
    return carrier, SystemJudge(system, grid, scale, options, run)


def _judged(judge, grid: Grid, periods: int, simple: bool, lists: list, lengths: list, standing) -> list[Group]:
    """Ask the motion about every closed group: the attractor it reaches, and whether that lies in the group."""
    if not lists:
        judge.sort()
        return []
    order = sorted(range(len(lists)), key=lambda k: (-len(lists[k]), int(lists[k][0])))[:MOST_GROUPS]
    judge.search(standing(np.concatenate([lists[k][:1] for k in order] + [_some(lists[k]) for k in order])))
    judge.sort()
    groups: list[Group] = []
    asked, near = set(order), {}
    for k, (cells, length) in enumerate(zip(lists, lengths, strict=True)):
        if k not in asked:
            groups.append(Group(cells, GroupKind.UNCONFIRMED, length, -1))
            continue
        answers = judge.label(standing(_some(cells)))
        values, counts = np.unique(answers, return_counts=True)
        owner = int(values[np.argmax(counts)])
        if simple and owner >= 0:
            near[k] = _apart(grid, judge.points(owner), cells)
            kind = GroupKind.SPURIOUS  # until it is among the nearest of its attractor, below
        elif owner >= 0:
            mine = np.isin(cells_around(grid, judge.points(owner)), cells).any()
            kind = GroupKind.SPURIOUS if not mine else _kind(judge, owner)
            if len(values) > 1 and mine:
                kind, owner = GroupKind.MERGED, -1
        else:
            kind, owner = (GroupKind.UNCONFIRMED if owner == -1 else GroupKind.SPURIOUS), -1
        groups.append(Group(cells, kind, length, owner))
    for owner, item in enumerate(judge.attractors if simple else []):
        own = [k for k in near if groups[k].attractor == owner]
        rate = judge.contraction(owner, periods)
        reach = min(1.0 + 0.5 * np.sqrt(len(grid.names)) / max(1.0 - rate, 1e-3), FARTHEST)
        if not isinstance(item, SampledAttractor):  # of period p it is gcd(p, m) cycles of p / gcd(p, m) cells
            shared = math.gcd(item.periods, periods)
            own = sorted((k for k in own if groups[k].period == item.periods // shared), key=lambda k: near[k])[:shared]
        for k in own:
            if near[k] <= reach:
                groups[k] = groups[k]._replace(kind=_kind(judge, owner))
    return groups


def _kind(judge, owner: int) -> GroupKind:
    return GroupKind.CHAOTIC if isinstance(judge.attractors[owner], ChaoticAttractor) else GroupKind.PERIODIC


def _some(cells: np.ndarray) -> np.ndarray:
    return cells[np.linspace(0, len(cells) - 1, min(ASKED, len(cells))).astype(int)]


def _apart(grid: Grid, points: np.ndarray, cells: np.ndarray) -> float:
    """Return the least distance, in cells, of points (k, d) from the centres of cells."""
    span = np.array([cells if name in grid.periodic else np.inf for name, cells in zip(grid.names, grid.shape, strict=True)])
    where = grid.points(cells) / grid.widths
    least = np.inf
    for point in points[:500] / grid.widths:
        gap = np.abs(where - point)
        gap = np.where(np.isfinite(span), np.minimum(np.mod(gap, span), span - np.mod(gap, span)), gap)
        least = min(least, float(np.sqrt((gap**2).sum(axis=1).min())))
    return least


def _audit(judge, made: CellMap, embed, count: int) -> Audit:
    """Compare labels of random cells with the motion followed from their centres."""
    rng = np.random.default_rng([made.options["seed"], 3])
    cells = np.flatnonzero(made.fates.ravel() != CellFate.OUTSIDE.code)
    cells = np.sort(rng.choice(cells, min(count, cells.size), replace=False))
    direct = np.concatenate([judge.label(embed(made.grid.points(cells[i:i + AUDIT_BATCH])))
                             for i in range(0, cells.size, AUDIT_BATCH)]) if cells.size else np.empty(0, int)
    good = direct != NO_START  # the centre lies beyond a stop: another state stands for the cell
    labels = made.labels.ravel()[cells]
    direct = np.maximum(direct, -1)[good]
    labels = labels[good]
    return Audit(len(labels), int(np.count_nonzero((labels >= 0) & (labels != direct))),
                 int(np.count_nonzero((labels < 0) & (direct >= 0))))
