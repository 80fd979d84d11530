"""Which groups of cells hold an attractor: the motion itself is asked, and Newton confirms; a map of cells is only a hint."""
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.grid import Grid
from ...ensemble.integrator import Integrator
from ...ensemble.outcomes import INFINITY, coded
from ...jobs.executors import user_parts
from ...jobs.store import ChunkStore
from ...motion import Motion
from ..attractors.attractors import SampledAttractor, section_points
from ..attractors.discovery import Discovery
from ..maps.labelling import Labeller, label_starts

NEUTRAL = 1e-8  # distance of multipliers from 1 that differences do not tell from none
DIFFERENCE = 1e-6  # of Jacobians of maps, relative to the grid
CLOSED = 1e-12  # relative residual of a cycle of a map
SETTLING = 512  # iterates before a cycle of a map is looked for
LONGEST = 64


@dataclass(frozen=True, eq=False)
class MapCycle(Content, Motion):
    """A cycle of a map given as a function, solved by Newton.

    Attributes
    ----------
    points : ndarray
        States (p, d), each the image of the one before.
    multipliers : ndarray of complex
        Of the p-th iterate, largest first; from differences of the map.
    residual : float
        Largest component of F^p(x) - x, in units of the grid's sides.
    """

    points: np.ndarray = field(repr=False)
    multipliers: np.ndarray
    residual: float

    @property
    def periods(self) -> int:
        """Number of points."""
        return len(self.points)

    @property
    def regime(self) -> str:
        """A cycle of so many points."""
        return f"cycle of {self.periods}"

    @property
    def sections(self) -> np.ndarray:
        """The points."""
        return self.points

    @property
    def state(self) -> np.ndarray:
        """First point (d,)."""
        return self.points[0]

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle, by more than their differences can err."""
        return bool(np.abs(self.multipliers).max() < 1.0 - NEUTRAL)


def cells_around(grid: Grid, points: np.ndarray) -> np.ndarray:
    """Return the cells that hold points (k, d), and their neighbours."""
    around = np.stack(np.meshgrid(*[(-1.0, 0.0, 1.0)] * len(grid.names), indexing="ij"), axis=-1).reshape(-1, len(grid.names))
    return np.unique(grid.cells_of((points[:, None] + around * grid.widths).reshape(-1, len(grid.names))))


class SystemJudge:
    """Finds and confirms the attractors of a system, and labels starts by following them.

    Parameters
    ----------
    system : System
    grid : Grid
    scale : ndarray
        Sizes (ns,) of the states.
    options : dict
        seed, tolerance, max_periods, max_events.
    workers : int
        Threads.
    """

    def __init__(self, system, grid: Grid, scale: np.ndarray, options: dict, run: dict, known=()):
        scene = scene_of(system)
        self.integrator = Integrator(scene, options["max_events"])
        self.found = Discovery(system, self.integrator, scale, options, list(known))
        self.labeller, self.store = Labeller(self.integrator, user_parts(system)), ChunkStore(None, {})
        self.scale, self.run, self.most = scale, run, options["max_periods"]
        self.places = list(grid.places(scene.n, scene.ns, scene.system.states))

    @property
    def attractors(self) -> list:
        """Those confirmed, in the order they were found."""
        return self.found.attractors

    def search(self, starts: np.ndarray) -> None:
        """Look for attractors where the motions from ``starts`` (k, ns) end."""
        self.found.search(starts)

    def label(self, starts: np.ndarray) -> np.ndarray:
        """Return the attractors (k,) that the motions from ``starts`` reach; -1: none, `NO_START`, `INFINITY`."""
        found = label_starts(self.labeller, starts, self.found.targets(), self.most, self.store, self.run)
        return coded(found.labels, found.states)

    def sort(self) -> None:
        """Number the attractors by period, impacts and size, those given first."""
        order = self.found.order()
        self.found.attractors[:] = [self.found.attractors[k] for k in order]
        self.found.radii[:] = [self.found.radii[k] for k in order]

    def points(self, number: int) -> np.ndarray:
        """Return the section points (k, d) of an attractor, the grid's components."""
        return section_points(self.attractors[number])[:, self.places]

    def contraction(self, number: int, periods: int) -> float:
        """Return by what a small distance from an attractor shrinks in so many periods, at the least; chaos: 0."""
        item = self.attractors[number]
        if isinstance(item, SampledAttractor):
            return 0.0
        return float(np.abs(item.multipliers).max() ** (periods / item.periods)) if len(item.multipliers) else 0.0


class MapJudge:
    """The same for a map given as a function of states (k, d)."""

    def __init__(self, iterate: Callable, grid: Grid, options: dict):
        self.iterate, self.grid, self.most = iterate, grid, options["max_periods"]
        self.span = np.array(grid.high) - np.array(grid.low)
        self.tolerance = options["tolerance"]
        self.attractors: list[MapCycle] = []

    def _gap(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the scaled difference of states, the short way round on periodic components."""
        gap = (a - b) / self.span
        for axis, name in enumerate(self.grid.names):
            if name in self.grid.periodic:
                gap[..., axis] -= np.round(gap[..., axis])
        return gap

    def _power(self, x: np.ndarray, count: int) -> np.ndarray:
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(count):
                x = np.asarray(self.iterate(x), float)
        return x

    def search(self, starts: np.ndarray) -> None:
        """Follow each start until it settles; accept a stable cycle that Newton confirms."""
        for start in starts:
            y = self._power(start[None], SETTLING)
            if not np.isfinite(y).all():
                continue
            walk = [y[0]]
            for _ in range(LONGEST):
                walk.append(self._power(walk[-1][None], 1)[0])
            if not np.isfinite(walk).all():
                continue
            gaps = np.abs(self._gap(np.array(walk[1:]), walk[0])).max(axis=1)
            close = np.flatnonzero(gaps <= max(2.0 * gaps.min(), 1e-9))
            cycle = self.solve(y[0], int(close[0]) + 1)
            if cycle is not None and cycle.stable and not self._known(cycle):
                self.attractors.append(cycle)

    def solve(self, x: np.ndarray, count: int) -> MapCycle | None:
        """Return the cycle of ``count`` points near ``x``, or None when Newton does not settle."""
        jacobian = np.eye(len(x))
        for _ in range(30):
            steps = DIFFERENCE * np.diag(self.span)
            around = self._power(np.vstack((x[None], x + steps, x - steps)), count)
            if not np.isfinite(around).all():
                return None
            d = len(x)
            jacobian = (self._gap(around[1:d + 1], around[d + 1:]) / (2 * DIFFERENCE)).T  # scaled by the sides
            gap = self._gap(around[0], x)
            if np.abs(gap).max() <= CLOSED:
                break
            try:
                change = np.linalg.solve(np.eye(d) - jacobian, gap)
            except np.linalg.LinAlgError:
                return None
            if np.abs(change).max() > 0.1:
                return None
            x = self.grid.wrapped((x + change * self.span)[None])[0]
        else:
            return None
        points = [x]
        for _ in range(count - 1):
            points.append(self.grid.wrapped(self._power(points[-1][None], 1))[0])
        for least in range(1, count):
            if count % least == 0 and np.abs(self._gap(points[least], x)).max() <= 1e-9:
                return self.solve(x, least)
        values = np.linalg.eigvals(jacobian).astype(complex)
        return MapCycle(np.array(points), values[np.argsort(-np.abs(values))], float(np.abs(gap).max()))

    def _known(self, cycle: MapCycle) -> bool:
        return any(np.abs(self._gap(item.points, cycle.state)).max(axis=1).min() < 1e-8 for item in self.attractors)

    def label(self, starts: np.ndarray) -> np.ndarray:
        """Return the attractors (k,) that the iterates of ``starts`` reach; -1: none, `INFINITY`."""
        labels, x, left = np.full(len(starts), -1), np.array(starts, float), np.arange(len(starts))
        for _ in range(self.most):
            if not left.size:
                break
            x = self._power(x, 1)
            lost = ~np.isfinite(x).all(axis=1)
            labels[left[lost]] = INFINITY
            left, x = left[~lost], x[~lost]
            for number, item in enumerate(self.attractors):
                near = np.zeros(len(x), bool)
                for point in item.points:
                    near |= np.abs(self._gap(x, point)).max(axis=1) <= self.tolerance
                labels[left[near]] = number
                left, x = left[~near], x[~near]
        return labels

    def sort(self) -> None:
        """Number the attractors by period and place; begin each at its least point."""
        for k, item in enumerate(self.attractors):
            least = min(range(item.periods), key=lambda i: tuple(item.points[i].round(9).tolist()))
            self.attractors[k] = MapCycle(np.roll(item.points, -least, axis=0), item.multipliers, item.residual)
        self.attractors.sort(key=lambda item: (item.periods, tuple(item.state.round(9).tolist())))

    def points(self, number: int) -> np.ndarray:
        """Return the points (k, d) of a cycle."""
        return self.attractors[number].points

    def contraction(self, number: int, periods: int) -> float:
        """Return by what a small distance from a cycle shrinks in so many iterates, at the least."""
        item = self.attractors[number]
        return float(np.abs(item.multipliers).max() ** (periods / item.periods))
