"""The search of an atlas: probe with starts, trace what is found, switch, look where something is missing, until nothing is new."""
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..basins.attractors.attractors import SampledAttractor
from ..basins.attractors.records import packed, packed_points, unpacked_points
from ..basins.sweeps.points import sweep_points
from ..continuation.branches.branch import Branch
from ..jobs.executors import run_chunks
from ..jobs.store import ChunkStore
from ..orbits.orbit import PeriodicOrbit
from ..system import System
from .identity import nodes_of, on_branch, orbits_at, periods_of
from .jobs import trace_orbits
from .records import unpacked_branches
from .stability import gaps, stable_intervals

ROUNDS = 12  # of probing gaps and checking, at most
HALVINGS = 4  # of the distance between a chaotic probe and its neighbour that is not
GAP = 1e-3  # of the range: stretches without a stable motion that are shorter are not probed
TRACES = 4  # orbits handed to the executor at a time


@dataclass
class Probe:
    """What starts at one parameter value led to.

    Attributes
    ----------
    value : float
    branches : list of int
        Number of the branch of each periodic attractor; -1: not traced (its period is too long, or no branch could start).
    periods : list of int or None
        Forcing periods of each attractor; None: chaotic.
    exponents : list of float or None
        Largest Lyapunov exponent, per time, of the chaotic ones.
    counts : list of int
        Starts that led to each.
    starts, unresolved, outside : int
    why : str
        "first", "gap", "check", or "edge" (of chaos).
    continua : list of dict
        Of each attractor that is a continuum: state (index) -> least and largest value with which it may rest.
    """

    value: float
    branches: list
    periods: list
    exponents: list
    counts: list
    starts: int
    unresolved: int
    outside: int
    why: str
    continua: list = field(default_factory=list)

    @property
    def chaos(self) -> float | None:
        """Largest exponent of a chaotic attractor; None without one."""
        return max((e for e in self.exponents if e is not None), default=None)


@dataclass
class Search:
    """State of a search.

    Attributes
    ----------
    branches : list of Branch
    origins : list of str
        How the first orbit of each was found.
    probes : list of Probe
    untraced : list of (value, text)
        Attractors that no branch was traced from, and why.
    finished : bool
        A whole check found nothing new.
    """

    system: System
    parameter: str
    bounds: tuple[float, float]
    job: Mapping
    options: Mapping
    store: ChunkStore
    run: dict
    branches: list[Branch] = field(default_factory=list)
    origins: list[str] = field(default_factory=list)
    probes: list[Probe] = field(default_factory=list)
    untraced: list[tuple[float, str]] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    finished: bool = False
    full: bool = False

    def __post_init__(self):
        self._nodes: list = []
        self._stable: list[list[tuple[float, float]]] = []
        self._queue: list[tuple[PeriodicOrbit, str]] = []

    def go(self) -> None:
        """Run to the end."""
        self.look()
        for _ in range(HALVINGS):  # where chaos begins and ends
            edges = self.edges()
            if not edges or self.full:
                return
            self.probe(edges, "edge")
            self.drain()

    def edges(self) -> list[float]:
        """Return values half way between probes of which one found chaos and the next did not."""
        ordered = sorted(self.probes, key=lambda probe: probe.value)
        return [0.5 * (a.value + b.value) for a, b in zip(ordered, ordered[1:], strict=False)
                if (a.chaos is None) != (b.chaos is None)]

    def look(self) -> None:
        """Probe, trace and check until nothing is new."""
        low, high = self.bounds
        count = self.options["probes"]
        self.probe(list(low + (high - low) * (np.arange(count) + 0.5) / count), "first")
        self.drain()
        rng = np.random.default_rng(self.options["seed"])
        for _ in range(ROUNDS):
            if self.full:
                return
            missing = self.missing()
            if missing:
                self.probe(missing, "gap")
                self.drain()
                continue
            before = len(self.branches), len(self.untraced)
            self.probe(sorted(rng.uniform(low, high, self.options["checks"]).tolist()), "check")
            self.drain()
            if (len(self.branches), len(self.untraced)) == before and not self.missing():
                self.finished = True
                return

    # starts

    def probe(self, values: Sequence[float], why: str) -> None:
        """Find the attractors at some values from starts, those known included, and queue orbits of new ones."""
        payloads, known = [], []
        for value in values:
            mine = self.stable_at(value)
            headers, arrays = packed_points([[orbit for _, orbit in mine]])
            known.append([number for number, _ in mine])
            payloads.append({**self.job, "points": [{self.parameter: float(value)}], "known": headers, "arrays": arrays})
        outcome = run_chunks(self.store, sweep_points, payloads, **self.run)
        for n, (value, numbers, result) in enumerate(zip(values, known, outcome.results, strict=True)):
            if result is None:
                self.failures.append(f"{self.parameter} = {value:.6g}: {outcome.failures[n]}")
                continue
            meta, arrays = result
            point = meta["points"][0]
            (items,) = unpacked_points([point["attractors"]], arrays, self.job["elements"])
            places, periods, exponents, continua = [], [], [], []
            for k, item in enumerate(items):
                chaotic = isinstance(item, SampledAttractor)
                periods.append(None if chaotic else item.periods)
                exponents.append(item.exponent if chaotic else None)
                if not chaotic and item.intervals:
                    continua.append({str(c): [float(a), float(b)] for c, (a, b) in item.intervals.items()})
                places.append(numbers[k] if k < len(numbers) else None if chaotic else self.place(item, value))
            self.probes.append(Probe(float(value), places, periods, exponents, list(point["counts"]), point["starts"],
                                     point["unresolved"], point["outside"], why, continua))

    def place(self, orbit: PeriodicOrbit, value: float) -> int:
        """Return the branch of a new attractor if there is one, otherwise queue it; -1 then."""
        number = self.branch_of(orbit)
        if number is not None:
            return number
        if orbit.periods > self.options["longest"]:
            why = f"attractor of {orbit.periods} forcing periods: longer than longest = {self.options['longest']}"
            self.untraced.append((value, why))
        else:
            self._queue.append((orbit, f"starts at {self.parameter} = {value:.6g}"))
        return -1

    def stable_at(self, value: float) -> list[tuple[int, PeriodicOrbit]]:
        """Return number of the branch and orbit of every stable orbit known at a value."""
        found = []
        for number, branch in enumerate(self.branches):
            if any(low <= value <= high for low, high in self._stable[number]):
                found += [(number, orbit) for orbit in orbits_at(branch, value, self._nodes[number]) if orbit.stable]
        return found

    def missing(self) -> list[float]:
        """Return values in the middle of stretches without a known stable motion and without a probe."""
        low, high = self.bounds
        intervals = [interval for mine in self._stable for interval in mine]
        probed = sorted(probe.value for probe in self.probes)
        found = []
        for a, b in gaps(intervals, low, high):
            if b - a > GAP * (high - low) and not any(a <= value <= b for value in probed):
                found.append(0.5 * (a + b))
        return found

    # branches

    def drain(self) -> None:
        """Trace what is queued and what these branches offer, until the queue is empty."""
        while self._queue and not self.full:
            batch: list[tuple[PeriodicOrbit, str]] = []
            while self._queue and len(batch) < TRACES:
                orbit, origin = self._queue.pop(0)
                if self.branch_of(orbit) is None:
                    batch.append((orbit, origin))
            if not batch:
                break
            payloads = []
            for orbit, _ in batch:
                headers, arrays = packed([orbit])
                payloads.append({"orbits": headers, "arrays": arrays, "elements": self.job["elements"], "parameter": self.parameter,
                                 "bounds": list(self.bounds), "periods": self.options["periods"], "options": self.options["trace"]})
            outcome = run_chunks(self.store, trace_orbits, payloads, **self.run)
            for n, ((orbit, origin), result) in enumerate(zip(batch, outcome.results, strict=True)):
                if result is None:
                    self.failures.append(f"{origin}: {outcome.failures[n]}")
                    continue
                meta, arrays = result
                mine = meta["branches"][0]
                self.failures += [f"{origin}: {text}" for text in mine.get("failed", ())]
                if mine["header"] is None and mine["why"]:
                    self.untraced.append((orbit.system.parameter(self.parameter), mine["why"]))
                (branch,) = unpacked_branches([mine["header"]], arrays, self.job["elements"])
                if branch is not None and self.branch_of(orbit) is None:
                    self.admit(branch, origin)
                    (offers,) = unpacked_points([mine["offers"]], arrays, self.job["elements"])
                    self._queue += [(other, f"{self.parameter} = {at:.6g} on branch {len(self.branches) - 1}")
                                    for other, at in zip(offers, mine["at"], strict=True)]

    def admit(self, branch: Branch, origin: str) -> None:
        """Add a branch; one that it holds whole is replaced by it."""
        nodes = nodes_of(branch)
        for number, other in enumerate(self.branches):
            if periods_of(other) == periods_of(branch) and self._held(other, branch, nodes):
                self.branches[number], self._nodes[number] = branch, nodes
                self._stable[number] = stable_intervals(branch)
                return
        self.branches.append(branch)
        self.origins.append(origin)
        self._nodes.append(nodes)
        self._stable.append(stable_intervals(branch))
        self.full = len(self.branches) >= self.options["most_branches"]

    def _held(self, branch: Branch, longer: Branch, nodes) -> bool:
        """Return whether a branch lies on another one, from a row in its middle."""
        if len(branch) >= len(longer):
            return False
        orbit = branch.orbits[len(branch) // 2]
        return orbit.success and on_branch(orbit, longer, nodes)

    def branch_of(self, orbit: PeriodicOrbit) -> int | None:
        """Return the number of the branch on which an orbit lies, None where it is on none."""
        for number, branch in enumerate(self.branches):
            if on_branch(orbit, branch, self._nodes[number]):
                return number
        return None
