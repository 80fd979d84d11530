"""From starts to labels: the compiled integration, and the simulation with its joint decisions for what that leaves open."""
import itertools
import threading
from contextlib import nullcontext
from functools import partial
from typing import NamedTuple

import numpy as np
from numba.core.errors import NumbaError

from ..compose.scene import Scene
from ..compose.tables import Tables
from ..compose.writer import kernels
from ..elements import EventKind
from ..flow import settle
from ..flow.engine import engine_of
from ..flow.scan import CHATTER, PASSED
from ..flow.simulate import integrate
from ..flow.status import Status
from ..flow.trajectory import Trajectory
from ..solve.interrupts import interruptible
from . import scalar
from .batch import packing, smooth
from .initial_conditions import begin, unloaded
from .outcomes import ASK, BEYOND, CROWDED, DEFERRED, DIVERGED, OUTSIDE, REACHED, STOPPED, STUCK, UNCLEAR, UNSETTLED, Cells
from .proximity import Targets, boxed, nearest

MOST_START_MODES = 64  # tried by the compiled start; more go to Python
# periods of all starts together that take some milliseconds: of a batch, of scalar steps in closed form, under laws
LEAN, CLOSED, LAW = 5000, 500, 50
BLOCK = 32  # forcing periods that the general integration does at a time
FAILED = {Status.TOO_MANY_EVENTS: CROWDED, Status.DIVERGED: DIVERGED}  # all else stays where no mode may follow


def failed(status: Status) -> int:
    """Return the code of the `CellState` of a motion that ended with a status."""
    return FAILED.get(status, STUCK)


class Images(NamedTuple):
    """Where starts went, one entry each."""

    ends: np.ndarray  # (N, ns) states after the periods; where the outcome is not MAPPED, the last section point
    outcomes: np.ndarray  # (N,) int64, MAPPED (0) or the code of the `CellState` that ended the motion
    impacts: np.ndarray  # (N,) int64, impacts and elastic contacts on the way; a complete chattering counts once
    speeds: np.ndarray  # (N,) least speed of arrival at a stop; 0: a complete chattering; inf: no impact


class Integrator:
    """Labels starts of one scene.  Safe to be called from several threads.

    Parameters
    ----------
    scene : Scene
    limit : int
        Largest number of events a forcing period.
    steps : int, optional
        Runge-Kutta steps a period under smooth laws; default: as many as the measured error asks for.
    work : float
        Forcing periods that will be asked for, over all starts: for little work under laws the error of steps is not measured,
        which would cost more, and starts are taken one after the other.

    Attributes
    ----------
    lean : bool
        Whether starts are taken in batches: a period costs less than a microsecond.
    chunk : int
        Starts that are best handed over at once.
    compiled : bool
        Whether starts are taken by compiled kernels, in batches or one after the other; else by simulation.
    section : None
        Motions are compared at phase 0.
    error : float
        Measured error of one period in units of the region where the scene lives; 0: rounding only.
    """

    section = None

    def __init__(self, scene: Scene, limit: int, steps: int | None = None, work: float = np.inf):
        self.scene, self.limit, self.steps, self.work, self.error = scene, limit, steps, work, 0.0
        self._lock = threading.Lock()
        self._candidates = np.array(list(itertools.islice(scene.start_modes(), MOST_START_MODES)), np.int64)
        self._rows = np.empty((0, 0, 0))
        self._module, self._numbers = self._batch()
        self.lean = self._module is not None
        self._scalar = None if self.lean else self._one_by_one()
        self.compiled = self.lean or self._scalar is not None
        self.chunk = 8192 if self.lean else 512

    def _batch(self):
        """Return written module and numbers of the batch, None where the scene has none."""
        kind = packing.kind_of(self.scene)
        if kind is not None:
            return packing.module_of(kind), packing.numbers_of(self.scene.tables, kind)
        law = smooth.kind_of(self.scene) if self.steps is not None or self.work > smooth.PAYS else None
        if law is not None:
            try:
                if self.steps is None:
                    self.steps, self.error = smooth.steps_for(self.scene, law)
                return smooth.module_of(law), smooth.numbers_of(self.scene.tables, law, self.steps)
            except (ArithmeticError, NumbaError):
                pass  # a law that needs tiny steps, or one that only the simulation can compile
        return None, None

    def _one_by_one(self):
        """Return the kernels of the scalar integrator for this scene, None where they cannot be compiled."""
        if self.scene.closed_form:
            return scalar
        if not self.scene.complete:  # its laws may grow
            return None
        try:
            engine_of(self.scene)
            return kernels(self.scene, scalar.__name__)
        except (ValueError, NumbaError):
            return None  # the simulation says why

    def begin(self, X: np.ndarray):
        """Return the tables and the modes (N,) in which the starts ``X`` (N, ns) begin; negative: unclear or outside.

        Memory beyond a limit is put, in ``X``, where the limit puts it.
        """
        with self._lock:
            unloaded(self.scene, X)
            T = self.scene.tables
        modes = np.empty(len(X), np.int64)
        begin(T, self._candidates, X, modes)
        for rows in self.scene.disordered(X).values():
            modes[rows] = DEFERRED
        if self.scene.region(0):  # on a surface of fields of first order regions are counted
            modes[modes == UNCLEAR] = DEFERRED
        return T, modes

    def _followers(self, T: Tables) -> np.ndarray:
        """Return the rows (modes, nz, nx) that memory has in every mode: itself where it is frozen."""
        if len(self._rows) < len(T.n_guards):
            with self._lock:
                first, nx = 2 * self.scene.n, T.A.shape[2]
                rows = np.tile(np.eye(nx)[first:self.scene.ns], (len(T.n_guards), 1, 1))
                for m in range(len(rows)):
                    for place, row in self.scene.algebraic(m):
                        rows[m, place - first] = row
                self._rows = rows
        return self._rows

    def label(self, X: np.ndarray, targets: Targets, most: int) -> Cells:
        """Follow the starts ``X`` (N, ns), in place, until near an attractor or for ``most`` periods."""
        cells = Cells.blank(len(X))
        starts = X.copy()
        T, modes = self.begin(X)
        cells.states[modes == BEYOND] = OUTSIDE
        if self._module is not None:
            self._heard(self._module.label, modes, most, self._numbers, modes, X, self.limit, most, targets, cells)
        elif self._scalar is not None:
            self._heard(self._scalar.label, modes, most, T, self._followers(T), self._candidates, modes, X, self.limit, most,
                        targets, cells)
        for i in np.flatnonzero(cells.states == ASK).tolist():
            with nullcontext() if self.scene.complete else self._lock:
                X[i] = starts[i]
                self._follow(i, X, cells, targets, most)
        return cells

    def propagate(self, X: np.ndarray, periods: int) -> Images:
        """Carry the starts ``X`` (N, ns), in place, over forcing periods."""
        outcomes, impacts = (np.full(len(X), value, np.int64) for value in (ASK, 0))
        images = Images(X, outcomes, impacts, np.full(len(X), np.inf))
        starts = X.copy()
        T, modes = self.begin(X)
        images.outcomes[modes == BEYOND] = OUTSIDE
        if self._module is not None:
            self._heard(self._module.propagate, modes, periods, self._numbers, modes, X, self.limit, periods, *images[1:])
        elif self._scalar is not None:
            self._heard(self._scalar.map_starts, modes, periods, T, self._followers(T), self._candidates, modes, X, self.limit,
                        periods, *images[1:])
        for i in np.flatnonzero(images.outcomes == ASK).tolist():
            with nullcontext() if self.scene.complete else self._lock:
                self._propagate(i, starts[i], images, periods)
        return images

    def _heard(self, kernel, modes: np.ndarray, most: int, *given) -> None:
        """Let a kernel follow starts in ``modes`` (N,) for up to ``most`` periods; a signal may stop it."""
        much = LEAN if self.lean else CLOSED if self.scene.closed_form else LAW
        interruptible(len(modes) * most > much, partial(modes.fill, STOPPED), kernel, *given)

    def _propagate(self, i: int, start: np.ndarray, images: Images, periods: int) -> None:
        """Carry one start with all decisions open to Python."""
        y, images.impacts[i], images.speeds[i], images.ends[i] = start, 0, np.inf, start
        for first in range(0, periods, BLOCK):
            last = min(first + BLOCK, periods)
            motion, code = integrated(self.scene, y, (first, 0.0), (last, 0.0), self.limit)
            if motion is None:
                images.outcomes[i] = code
                return
            _, speeds = self._arrivals(motion)
            images.impacts[i] += speeds.size
            images.speeds[i] = min(images.speeds[i], speeds.min(initial=np.inf))
            y = images.ends[i] = motion.sections[-1]
            if not motion.success:
                images.outcomes[i] = failed(motion.status)
                return
        images.outcomes[i] = REACHED

    def _arrivals(self, motion) -> tuple[np.ndarray, np.ndarray]:
        """Return whole periods and speeds of the impacts and contacts of a motion."""
        R, T = motion.recorded, self.scene.tables
        events = np.flatnonzero((R.rows[:, 3] != PASSED) & (R.rows[:, 1] >= 0))
        m, g = R.rows[events, 0], R.rows[events, 1]
        hits = events[(T.kick[m, g] == 1) | (T.kind[m, g] == EventKind.CONTACT.code)]
        return R.rows[hits, 4], np.where(R.rows[hits, 3] == CHATTER, 0.0, R.speeds[hits])

    def _follow(self, i: int, X: np.ndarray, cells: Cells, targets: Targets, most: int) -> None:
        """Follow one start with all decisions open to Python."""
        y, visits, guest = X[i].copy(), 0, -1
        cells.labels[i], cells.states[i], cells.periods[i], cells.impacts[i] = -1, UNSETTLED, 0, 0
        cells.speeds[i] = np.inf
        for first in range(0, most, BLOCK):
            last = min(first + BLOCK, most)
            motion, code = integrated(self.scene, y, (first, 0.0), (last, 0.0), self.limit)
            if motion is None:
                cells.states[i] = code
                return
            hits, speeds = self._arrivals(motion)
            for k, y in enumerate(motion.sections[1:], first + 1):
                found = nearest(y, targets.inverse, targets.points, targets.squares, targets.owner)
                if found < 0 and targets.keys.size:
                    keeper = boxed(y, targets.inverse, targets.width, targets.keys, targets.keepers)
                    visits = visits + 1 if keeper >= 0 and (keeper == guest or visits == 0) else 0
                    guest = keeper
                    found = keeper if visits >= targets.stay else -1
                if found >= 0:
                    cells.labels[i], cells.states[i], cells.periods[i] = found, REACHED, k
                    cells.impacts[i] += np.count_nonzero(hits < k)
                    cells.speeds[i] = min(cells.speeds[i], speeds[hits < k].min(initial=np.inf))
                    return
            cells.periods[i] = last
            cells.impacts[i] += hits.size
            cells.speeds[i] = min(cells.speeds[i], speeds.min(initial=np.inf))
            X[i] = y
            if not motion.success:
                cells.states[i] = failed(motion.status)
                return


def integrated(scene: Scene, y: np.ndarray, begin, end, limit: int) -> tuple[Trajectory | None, int]:
    """Return the motion from ``y`` (ns,), or None and the code of its state where no motion begins there or goes on."""
    try:
        return integrate(scene, y, begin, end, limit), REACHED
    except settle.Penetration:
        return None, OUTSIDE
    except settle.Inconsistent:
        return None, STUCK
