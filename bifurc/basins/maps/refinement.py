"""Adaptive refinement of a basin map: cells far from boundaries inherit labels, after it was measured that this pays.

A coarse lattice of the fine grid's own cells is labelled; each halving of its step labels the cells between lattice points that
differ, then every cell beside a difference, until no inherited label touches another one.  Tongues thinner than the coarse
step that end nowhere near a found boundary are missed: how many is measured on random cells.
"""
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from ... import io
from ...checks import checked
from ...content import Content
from ...ensemble.grid import Grid
from ...ensemble.initial_conditions import states_at
from ...ensemble.integrator import Cells, Integrator
from ...ensemble.outcomes import REACHED, UNSETTLED, coded
from ...enumerations import DescribedEnum
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...system import System
from ..attractors.attractors import targets_of
from ..cells.cell_map import Audit
from .basin_map import BasinMap
from .compute import Job
from .labelling import Labeller, label_starts

COARSE = 96  # cells a side of the first lattice, at least
PAYS = 0.6  # predicted share of evaluations up to which refinement is worth its misses
CHECKED = 0.005  # of the cells are looked at again as seeds of missed tongues, and as many to count what is still missed


class RefinementStatus(DescribedEnum):
    """Whether a map was refined."""

    REFINED = "refined", "Cells far from boundaries inherited their labels."
    DECLINED = "declined", "Every cell was labelled: so many cells lie beside a boundary that refinement would not pay."
    NOT_DIVISIBLE = ("not_divisible", "Every cell was labelled: the numbers of cells cannot be halved down to a "
                                      "coarse lattice; write multiples of 8, and at least 192 cells a side.")


@dataclass(frozen=True, eq=False)
class Refinement(Content):
    """A basin map of which not every cell was followed.

    Attributes
    ----------
    basins : BasinMap
        On the fine grid; cells that inherited their labels have ``periods`` -1, ``impacts`` -1 and ``speeds`` infinity.
    status : RefinementStatus
    evaluated : ndarray of bool
        Cells whose motion was followed.
    predicted : float
        Share of evaluations predicted from the coarse lattice; 1 where nothing could be saved.
    exponent : float
        With which the share of cells beside a boundary falls with the step, measured on the coarse lattice.
    missed : Audit
        Inherited labels compared with the motion on random cells.
    """

    basins: BasinMap
    status: RefinementStatus
    evaluated: np.ndarray = field(repr=False)
    predicted: float
    exponent: float
    missed: Audit

    @property
    def share(self) -> float:
        """Share of the cells whose motion was followed."""
        return float(self.evaluated.mean())

    @property
    def message(self) -> str:
        """What was done, and why, with numbers."""
        if self.status is RefinementStatus.REFINED:
            low, high = (bound * (1.0 - self.share) for bound in self.missed.bounds)
            return (f"{self.status.sentence} {100 * self.share:.3g} % were followed ({100 * self.predicted:.3g} % predicted); "
                    f"of all cells {100 * low:.2g} to {100 * high:.2g} % have a wrong label (95 % confidence).")
        if self.status is RefinementStatus.DECLINED:
            return (f"{self.status.sentence} {100 * self.predicted:.3g} % of the cells would have been followed, up to "
                    f"{100 * PAYS:.0f} % pays; the share beside a boundary falls with exponent {self.exponent:.2g} "
                    "(smooth boundaries: 1).")
        return self.status.sentence

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header, arrays = self.basins.to_record()
        header = {"kind": "refinement", "basins": header, "status": str(self.status), "predicted": self.predicted,
                  "exponent": self.exponent, "missed": list(self.missed), "key": self.basins.key}
        return header, arrays | {"evaluated": self.evaluated}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Refinement":
        """Make the refinement that `to_record` described; ``elements`` are user classes and laws."""
        basins, status = BasinMap.from_record(header["basins"], arrays, elements), RefinementStatus(header["status"])
        io.fitted(arrays, {"evaluated": "logical grid"}, grid=basins.grid.shape)
        return cls(basins, status, arrays["evaluated"], header["predicted"], header["exponent"], Audit(*header["missed"]))

    @checked()
    def save(self, path) -> None:
        """Write the refinement to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        return f"Refinement({self.status}, {100 * self.share:.3g} % of {self.evaluated.size} cells followed, {self.basins!r})"


@checked()
def refined_basins(system: System, grid: Grid, *, attractors: Sequence | None = None, seed: int = 0, workers: int | None = None,
                   tolerance: float = 1e-4, max_periods: int = 2000, max_events: int = 2000, executor=None, progress: bool = False,
                   file=None) -> Refinement:
    """Return the basin map of a fine grid at the cost of its boundaries, where that pays; otherwise of all its cells.

    Parameters
    ----------
    system : System
    grid : Grid
        Numbers of cells that can be halved several times, such as 800.
    attractors, seed, workers, tolerance, max_periods, max_events, executor, progress
        As for `basins_of_attraction`.
    file : path-like, optional
        Where the refinement is saved.  Finished chunks are kept in ``<file>.chunks`` until it is: after an interrupt or a
        kill the same call computes only what is missing; when it is there already, it is read.

    Returns
    -------
    Refinement
        Look at ``status`` and ``message``.

    Raises
    ------
    ValueError, RuntimeError, OSError
        As `basins_of_attraction`.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=1.4)
    >>> found = bf.refined_basins(system, bf.Grid(q0=(-3, 1, 80), v0=(-4, 4, 80)))
    >>> found.basins.labels.shape
    (80, 80)
    """
    options = {"seed": seed, "tolerance": tolerance, "max_periods": max_periods, "max_events": max_events}
    job = Job(system, grid, attractors, options, workers, executor)

    def compute(store: ChunkStore, key: str) -> Refinement:
        with Progress("refinement", grid.size, progress) as bar:
            return _refined(job, store, bar)

    return resumable("refinement", file, job.record("refinement"), partial(Refinement.from_record, elements=job.elements), compute)


def _refined(job: Job, store: ChunkStore, bar: Progress) -> Refinement:
    """Label a coarse lattice, see whether refinement pays, and refine it or label all."""
    grid, step = job.grid, 1
    while all(cells % (2 * step) == 0 and cells // (2 * step) >= COARSE for cells in grid.shape):
        step *= 2
    if step == 1:
        whole = job.map(grid, job.known, store, bar)
        return Refinement(whole, RefinementStatus.NOT_DIVISIBLE, np.ones(grid.shape, bool), 1.0, 1.0, Audit(0, 0))
    shift = 0.5 * (1 - step) * grid.widths  # centres of the coarse cells are centres of fine ones
    lattice = Grid(at=grid.at, periodic=grid.periodic, **{
        name: (grid.low[axis] + shift[axis], grid.high[axis] + shift[axis], grid.shape[axis] // step)
        for axis, name in enumerate(grid.names)})
    coarse = job.map(lattice, job.known, store, bar)
    predicted, exponent = prediction(coded(coarse.labels, coarse.states), grid, step)
    if predicted > PAYS:
        whole = job.map(grid, list(coarse.attractors), store, bar)
        return Refinement(whole, RefinementStatus.DECLINED, np.ones(grid.shape, bool), predicted, exponent, Audit(0, 0))
    work = _Refining(coarse, grid, step, job, store, bar)
    missed = work.refine()
    return Refinement(work.map(), RefinementStatus.REFINED, work.known.reshape(grid.shape), predicted, exponent, missed)


def prediction(codes: np.ndarray, grid: Grid, step: int) -> tuple[float, float]:
    """Return the share of evaluations to expect, and the exponent of the share of cells beside a boundary.

    The share of lattice points with a different neighbour, p(step), is counted at the step and at twice the step; it falls
    with the step like a power, and a lattice of a smaller step is labelled where the one before is mixed.
    """
    shares = [mixed(codes[tuple(slice(None, None, thin) for _ in codes.shape)], grid).mean() for thin in (1, 2)]
    if shares[0] == 0.0:
        return float(step ** -len(grid.shape)), 1.0
    exponent = float(np.clip(np.log2(shares[1] / shares[0]), 0.0, 1.0))
    total, share, s = step ** -float(len(grid.shape)), float(shares[0]), step
    while s > 1:
        s //= 2
        total += share * (s ** -float(len(grid.shape)) - (2 * s) ** -float(len(grid.shape)))
        share *= 2.0**-exponent
    return min(total, 1.0), exponent


def mixed(codes: np.ndarray, grid: Grid) -> np.ndarray:
    """Return which lattice points have a neighbour (corners included) of another label."""
    modes = ["wrap" if name in grid.periodic else "nearest" for name in grid.names]
    return maximum_filter(codes, 3, mode=modes) != minimum_filter(codes, 3, mode=modes)


class _Refining:
    """A fine map in the making."""

    def __init__(self, coarse: BasinMap, grid: Grid, step: int, job: Job, store: ChunkStore, bar: Progress):
        self.coarse, self.grid, self.step = coarse, grid, step
        self.scene, self.run, self.store, self.bar = job.scene, job.run, store, bar
        self.labeller = Labeller(Integrator(self.scene, coarse.options["max_events"]), job.elements)
        self.targets = targets_of(coarse.attractors, coarse.radii, coarse.scale)
        self.cells = Cells.blank(grid.size, -1, UNSETTLED)
        self.cells.periods[:], self.cells.impacts[:] = -1, -1
        self.known = np.zeros(grid.size, bool)
        at = np.arange(grid.size).reshape(grid.shape)[self._every(step)].ravel()
        for name in Cells._fields:
            getattr(self.cells, name)[at] = getattr(coarse, name).ravel()
        self.known[at] = True

    def _every(self, step: int) -> tuple:
        return tuple(slice(None, None, step) for _ in self.grid.shape)

    def codes(self, numbers: np.ndarray) -> np.ndarray:
        """Return the coded labels of cells by number."""
        return coded(self.cells.labels[numbers], self.cells.states[numbers])

    def follow(self, numbers: np.ndarray) -> None:
        """Follow the motions of cells by number."""
        states = states_at(self.scene, self.grid.names, self.grid.at, self.grid.points(numbers))
        most = self.coarse.options["max_periods"]
        found = label_starts(self.labeller, states, self.targets, most, self.store, self.run, self.bar, np.ones(len(numbers)))
        for mine, values in zip(self.cells, found, strict=True):
            mine[numbers] = values
        self.known[numbers] = True

    def refine(self) -> Audit:
        """Halve the step down to 1; then look at random cells, follow what they reveal, and count what is still missed."""
        numbers = np.arange(self.grid.size).reshape(self.grid.shape)
        step = self.step
        while step > 1:
            step //= 2
            near = mixed(self.codes(numbers[self._every(2 * step)]), self.grid)
            for axis, length in enumerate(numbers[self._every(step)].shape):
                place = np.arange(length)
                low, high = place // 2, np.minimum((place + 1) // 2, near.shape[axis] - 1)
                near = np.take(near, low, axis) | np.take(near, high, axis)
            here = numbers[self._every(step)]
            parent = here.ravel()
            source = self._parents(numbers, step)
            fresh = ~self.known[parent]
            for mine in (self.cells.labels, self.cells.states):
                mine[parent[fresh]] = mine[source[fresh]]
            self.follow(parent[near.ravel() & fresh])
            self._close(here)
        rng = np.random.default_rng([self.coarse.options["seed"], 5])
        self._look(rng)
        self._close(numbers)
        return self._look(rng)

    def _parents(self, numbers: np.ndarray, step: int) -> np.ndarray:
        """Return for each lattice point of a step the point of twice the step just below it."""
        found = numbers[self._every(2 * step)]
        for axis, length in enumerate(numbers[self._every(step)].shape):
            found = np.take(found, np.arange(length) // 2, axis)
        return found.ravel()

    def _close(self, here: np.ndarray) -> None:
        """Follow inherited cells beside a difference until none is left; ``here`` are the cells of the present lattice."""
        around = np.stack(np.meshgrid(*[(-1, 0, 1)] * here.ndim, indexing="ij"), axis=-1).reshape(-1, here.ndim)
        place = np.argwhere(mixed(self.codes(here), self.grid) & ~self.known[here])
        while len(place):
            waiting = here[tuple(place.T)]
            before = self.codes(waiting)
            self.follow(waiting)
            changed = self.codes(waiting) != before  # only these differ from neighbours that are not followed yet
            place = (place[changed][:, None] + around).reshape(-1, here.ndim)
            for axis, name in enumerate(self.grid.names):
                length = here.shape[axis]
                place[:, axis] = place[:, axis] % length if name in self.grid.periodic else np.clip(place[:, axis], 0, length - 1)
            flat = np.unique(np.ravel_multi_index(tuple(place.T), here.shape))
            place = np.stack(np.unravel_index(flat[~self.known[here.ravel()[flat]]], here.shape), axis=-1)

    def _look(self, rng) -> Audit:
        """Follow random inherited cells and return how many labels were wrong."""
        left = np.flatnonzero(~self.known)
        chosen = np.sort(rng.choice(left, min(int(np.ceil(CHECKED * self.grid.size)), left.size), replace=False))
        before = self.codes(chosen)
        self.follow(chosen)
        return Audit(int(chosen.size), int(np.count_nonzero(self.codes(chosen) != before)))

    def map(self) -> BasinMap:
        """Return the basin map of the fine grid."""
        shape, coarse, cells = self.grid.shape, self.coarse, self.cells
        labels = np.where(cells.states == REACHED, cells.labels, -1).reshape(shape)
        return BasinMap(coarse.system, self.grid, labels, coarse.attractors, cells.states.astype(np.int8).reshape(shape),
                        cells.periods.astype(np.int32).reshape(shape), cells.impacts.reshape(shape), coarse.radii, coarse.scale,
                        coarse.noise, coarse.options, coarse.key, cells.speeds.reshape(shape))
