"""Basins of attraction: attractors discovered and confirmed, then every start of a grid labelled by closeness."""
import os
from collections.abc import Sequence
from functools import partial

import numpy as np

from ... import __version__
from ...checks import checked, many, refused
from ...compose.natural import natural_sizes
from ...compose.scene import Scene, scene_of
from ...ensemble.grid import Grid
from ...ensemble.initial_conditions import states_at
from ...ensemble.integrator import Cells
from ...ensemble.outcomes import DIVERGED, REACHED, UNSETTLED, coded
from ...ensemble.section import Section
from ...jobs.executors import user_parts
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...orbits.autonomous import slowest
from ...orbits.equilibria.equilibrium import Equilibrium
from ...orbits.orbit import PeriodicOrbit
from ...system import System
from ..attractors.attractors import SampledAttractor, section_points
from ..attractors.clockless import integrator_of, required
from ..attractors.discovery import Discovery
from . import label_noise
from .basin_map import BasinMap
from .labelling import Labeller, label_starts

RANDOM_STARTS = 64  # from which attractors are looked for first
LOOKED = 16  # unsettled starts that are examined before the rest is labelled again
BESIDES = 23  # numbers a cell beside its start, twice: measured, 186 to 211 bytes a cell of one degree of freedom at the peak
NEW = -2  # label of a cell not done yet


@checked()
def basins_of_attraction(system: System, grid: Grid, *, attractors: Sequence | None = None, seed: int = 0,
                         workers: int | None = None, tolerance: float = 1e-4, max_periods: int = 2000,
                         max_events: int = 2000, executor=None, progress: bool = False, file=None,
                         section: Section | None = None) -> BasinMap:
    """Return which start of a grid leads to which attractor.

    Attractors are discovered from seeded random starts and from every start that comes near none of those known; each
    is confirmed by Newton on the map and by its multipliers (or, chaotic, by an exponent above zero) before it gets a
    number.  A start is labelled when its section point comes within the tolerance of a section point of a confirmed
    attractor.  Labels depend on system, grid and seed alone, not on the number of workers.

    Without excitation attractors are states of rest and orbits whose period is part of the solution; a motion is compared with
    them where it passes a `Section`, and with states of rest beside it now and then.

    Parameters
    ----------
    system : System
        With an excitation the section is phase 0; without, ``section`` says it.
    grid : Grid
        Two components of the start.
    attractors : sequence of PeriodicOrbit, ChaoticAttractor, QuasiperiodicAttractor or Equilibrium, optional
        Known attractors of the system, which get the first numbers; others are discovered all the same.
    seed : int
        Of the random starts.
    workers : int, optional
        Threads; default: one a processor.
    tolerance : float
        Distance at which a section point counts as on an attractor, in units of the largest start (velocities over
        omega); made smaller for an attractor whose neighbours at this distance do not all come back to it.
    max_periods : int
        After so many forcing periods a start is unsettled.
    max_events : int
        Largest number of events a forcing period.
    executor : Executor, dask.distributed.Client, function, or None
        Where starts are labelled; None: threads.  See `bifurc.sweep`.  No choice changes a label.
    progress : bool
        Show progress.
    file : path-like, optional
        Where the map is saved.  Finished chunks are kept in ``<file>.chunks`` until it is: after an interrupt or a kill
        the same call computes only what is missing; when the map is there already, it is read.
    section : Section, optional
        Of a system without excitation: where motions are compared.  All attractors but states of rest must pass it; the maxima
        of a coordinate, ``Section("v0", direction=-1)``, are a good one.  ``max_periods`` counts returns to it then, and
        ``max_events`` events in the slowest oscillation of a mode.

    Returns
    -------
    BasinMap

    Raises
    ------
    ValueError
        Autonomous system without a section, forced system with one, components the system has not, options out of range,
        attractors of another system.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=1.4)
    >>> basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 20), v0=(-4, 4, 20)))
    >>> len(basins.attractors)
    2
    """
    options = {"seed": seed, "tolerance": tolerance, "max_periods": max_periods, "max_events": max_events}
    job = Job(system, grid, attractors, options, workers, executor, section)

    def compute(store: ChunkStore, key: str) -> BasinMap:
        with Progress("basins", grid.size, progress) as bar:
            return job.map(grid, job.known, store, bar)

    return resumable("basins", file, job.record("basins"), partial(BasinMap.from_record, elements=job.elements), compute)


class Job:
    """A request for a basin map, checked."""

    def __init__(self, system: System, grid: Grid, attractors, options: dict, workers: int | None, executor,
                 section: Section | None = None):
        self.section = required(system, section, "a basin map")
        self.system, self.grid, self.scene = system, grid, scene_of(system)
        grid.require(8.0 * (2 * self.scene.ns + BESIDES), "a basin map")
        states_at(self.scene, grid.names, grid.at, np.empty((0, len(grid.names))))  # names the components it has not
        self.run = {"workers": workers or os.cpu_count() or 1, "executor": executor}
        self.options = options
        self.known = _known(system, attractors)
        self.elements = user_parts(system)

    def record(self, what: str) -> dict:
        """Return what all chunks of this job depend on."""
        return {"what": what, "version": __version__, "system": self.system.to_record(), "grid": self.grid.to_record(),
                "options": self.options, "known": [section_points(item, self.section).tolist() for item in self.known],
                "elements": self.elements, **({} if self.section is None else {"section": self.section.to_record()})}

    def map(self, grid: Grid, known: list, store: ChunkStore, bar: Progress) -> BasinMap:
        """Return the map of a grid, that of the request or another one."""
        return _Work(self.system, self.scene, grid, self.options, known, self.run, store, bar, self.section).map()


class _Work:
    """One basin map in the making."""

    def __init__(self, system: System, scene: Scene, grid: Grid, options: dict, known: list, run: dict,
                 store: ChunkStore, bar: Progress, section: Section | None = None):
        self.section = section
        self.system, self.scene, self.grid, self.options = system, scene, grid, options
        self.store, self.bar = store, bar
        self.run = run
        self.starts = states_at(scene, grid.names, grid.at, grid.points(np.arange(grid.size)))
        self.scale = scale_of(scene, self.starts)
        self.most = options["max_periods"]
        self.integrator = integrator_of(system, options["max_events"], section)
        self.labeller = Labeller(self.integrator, user_parts(system))
        self.found = Discovery(system, self.integrator, self.scale, options, known)

    def map(self) -> BasinMap:
        """Discover, label, look at what is unsettled, label again."""
        size = self.grid.size
        cells = Cells.blank(size, NEW, UNSETTLED)
        seen = np.full(size, -1)  # attractors that were known when a cell was labelled
        self.found.search(self._random_starts())
        while True:
            self._label(cells, seen)
            unsettled = np.flatnonzero(cells.states == UNSETTLED)
            before = len(self.found.attractors)
            if not unsettled.size:
                break
            chosen = unsettled[np.linspace(0, unsettled.size - 1, min(LOOKED, unsettled.size)).astype(int)]
            self.found.search(self.starts[chosen])
            if len(self.found.attractors) == before:
                break
        order = self.found.order()
        number = np.empty(len(order) + 1, np.int64)
        number[order], number[-1] = np.arange(len(order)), -1
        measured = self._noise(cells)
        shape = self.grid.shape
        return BasinMap(
            self.system, self.grid, number[cells.labels].reshape(shape), tuple(self.found.attractors[i] for i in order),
            cells.states.astype(np.int8).reshape(shape), cells.periods.astype(np.int32).reshape(shape),
            cells.impacts.astype(np.int64).reshape(shape), tuple(self.found.radii[i] for i in order), self.scale, measured,
            self.options, self.store.key, cells.speeds.reshape(shape), self.section)

    def _random_starts(self) -> np.ndarray:
        rng = np.random.default_rng(self.options["seed"])
        grid = self.grid
        points = np.column_stack([rng.uniform(low, high, RANDOM_STARTS) for low, high in zip(grid.low, grid.high, strict=True)])
        return states_at(self.scene, grid.names, grid.at, points)

    # labels

    def _label(self, cells: Cells, seen: np.ndarray) -> None:
        """Label the cells that are new, or unsettled since fewer attractors were known."""
        targets, count = self.found.targets(), len(self.found.attractors)
        waiting = np.flatnonzero((cells.labels == NEW) | ((cells.states == UNSETTLED) & (seen < count)))
        fresh = (cells.labels[waiting] == NEW).astype(float)
        found = label_starts(self.labeller, self.starts[waiting], targets, self.most, self.store, self.run, self.bar, fresh,
                             f"{count} attractors")
        for mine, values in zip(cells, found, strict=True):
            mine[waiting] = values
        seen[waiting] = count

    # noise

    def _noise(self, cells: Cells) -> label_noise.LabelNoise:
        """Measure how labels change with the start."""
        counted = np.flatnonzero((cells.states == REACHED) | (cells.states == UNSETTLED) | (cells.states == DIVERGED))
        labels = coded(cells.labels, cells.states)
        if len(self.found.attractors) < 2 and np.all(labels[counted] == labels[counted][:1]):
            return label_noise.LabelNoise(np.empty(0), np.empty(0), 0, 1.0, 0.0, 0.0)
        rng = np.random.default_rng([self.options["seed"], 1])
        mean = cells.periods[counted].mean()
        size = self.scene.n or 0.5 * self.scene.ns  # of systems of first order half the states
        budget = max(label_noise.SHARE * mean * self.grid.size, 4e5 if self.integrator.lean else 4e4 / size)
        samples = int(np.clip(budget / (6.0 * max(mean, 1.0)), *label_noise.SAMPLES))
        chosen = np.sort(rng.choice(counted, min(samples, counted.size), replace=False))
        targets = self.found.targets()
        steps = np.zeros(self.scene.ns)
        places = list(self.grid.places(self.scene.n, self.scene.ns, self.system.states))
        steps[places] = self.scale[places]

        def relabel(starts: np.ndarray) -> np.ndarray:
            found = label_starts(self.labeller, starts, targets, self.most, self.store, self.run)
            return coded(found.labels, found.states)

        error = label_noise.ROUNDING if self.scene.closed_form else max(self.integrator.error, label_noise.INTEGRATED)
        return label_noise.measure(relabel, self.starts[chosen], labels[chosen], steps, rng, error)


def scale_of(scene: Scene, starts: np.ndarray) -> np.ndarray:
    """Return the sizes (ns,) of states: one length, its velocity at the frequency of the excitation or the slowest oscillation."""
    n, omega = scene.n, float(scene.omega or 2.0 * np.pi / slowest(scene))
    if n == 0:
        return natural_sizes(scene.tables, starts, 2.0 * np.pi / omega)
    length = max(float(np.abs(starts[:, :n]).max()), float(np.abs(starts[:, n:2 * n]).max()) / omega)
    scale = np.full(scene.ns, length)
    scale[n:2 * n] *= omega
    return scale


def _attractor(owner: str, name: str, value):
    if isinstance(value, (PeriodicOrbit, SampledAttractor, Equilibrium)):
        return value
    raise refused(owner, name, value, "a PeriodicOrbit, ChaoticAttractor, QuasiperiodicAttractor or Equilibrium")


def _known(system: System, attractors) -> list:
    known = [] if attractors is None else many("", "attractors", attractors, of=_attractor)
    for item in known:
        if item.system != system:
            raise ValueError(f"attractors contain {item!r} of another system, {item.system!r}")
        if not isinstance(item, SampledAttractor) and not (item.success and item.stable):
            raise ValueError(f"attractors contain {item!r}, which is no attractor; it must be a stable orbit")
    return known
