"""Attractors and the sizes of their basins over a parameter: found by sampling, followed both ways, matched.

At every value attractors are looked for from evenly spread starts; each is then followed to the neighbouring values (Newton
from the neighbour's orbit, or the motion of what was lost), so that an attractor whose basin is too small for the
sample is there all the same.  The share of starts is the basin stability of P. Menck et al. (2013).

One file, because the sweep, its tracks and the links between values are written and read as one file.
"""
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ... import io, plotting
from ...checks import array, checked, shown
from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.region import Region
from ...jobs.executors import run_chunks, user_parts
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...notebook import Notebook
from ...system import System, require_system, require_values
from ..attractors.matching import End, Key, Links
from ..attractors.records import packed_points, unpacked_points
from .points import sweep_points

BLOCK = 4  # parameter values a chunk
ROUNDS = 4  # of following and counting again
FOLLOWING = 0.1  # share of the progress bar


@dataclass(frozen=True, eq=False)
class Track(Content):
    """One attractor over a range of the parameter.

    Attributes
    ----------
    number : int
    values : ndarray
        Parameter values (k,) where it is there.
    attractors : tuple of PeriodicOrbit and ChaoticAttractor
        One a value.
    fractions : ndarray
        Share of the starts (k,) that it attracts.
    parent : int or None
        Track that is lost where this one begins, and whose motion goes to it (such as by period doubling).
    """

    number: int
    values: np.ndarray = field(repr=False)
    attractors: tuple = field(repr=False)
    fractions: np.ndarray = field(repr=False)
    parent: int | None = None

    def __repr__(self):
        periods = sorted({item.periods or 0 for item in self.attractors})
        kind = " and ".join(f"period {n}" if n else "chaotic" for n in periods)
        return (f"Track({self.number}: {kind}, {len(self.values)} values from {self.values[0]:.6g} to {self.values[-1]:.6g}, "
                f"share up to {self.fractions.max():.4f})")


@dataclass(frozen=True, eq=False)
class Sweep(Content, Notebook):
    """Attractors and basin fractions over a parameter.  Made by `sweep`.

    Attributes
    ----------
    system : System
    parameter : str
    values : ndarray
        (m,), as given.
    attractors : tuple of tuple
        At each value; chaotic ones with a thinned sample.
    numbers : tuple of tuple of int
        Track of each.
    counts : tuple of tuple of int
        Starts that each attracts.
    unresolved, outside, starts : ndarray of int
        (m,): starts that came near no attractor, that lie beyond a stop, and all.
    parents : dict
        Track -> the track it came from.
    region : Region
    options : dict
    failures : dict
        Number of a value that could not be computed -> why; its other entries are empty.
    """

    _facts = ("parameter",)
    _panels = (2, 1)

    system: System
    parameter: str
    values: np.ndarray = field(repr=False)
    attractors: tuple = field(repr=False)
    numbers: tuple = field(repr=False)
    counts: tuple = field(repr=False)
    unresolved: np.ndarray = field(repr=False)
    outside: np.ndarray = field(repr=False)
    starts: np.ndarray = field(repr=False)
    parents: dict
    region: Region
    options: dict
    failures: dict = field(default_factory=dict)
    key: str = field(default="", repr=False)

    @property
    def fractions(self) -> np.ndarray:
        """Share of each track at each value (m, tracks) among the starts not beyond a stop; 0 where it is not."""
        found = np.zeros((len(self.values), self._count))
        for i, (numbers, counts) in enumerate(zip(self.numbers, self.counts, strict=True)):
            for number, count in zip(numbers, counts, strict=True):
                found[i, number] = count / max(int(self.starts[i] - self.outside[i]), 1)
        return found

    @property
    def errors(self) -> np.ndarray:
        """Standard errors (m, tracks) that as many random starts would have; evenly spread ones have less."""
        shares = self.fractions
        inside = np.maximum(self.starts - self.outside, 1)[:, None]
        return np.sqrt(np.maximum(shares * (1.0 - shares), 0.25 / inside) / inside)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Attractors matched over the parameter, in the order in which they appear."""
        shares, found = self.fractions, []
        for number in range(self._count):
            rows = [i for i, numbers in enumerate(self.numbers) if number in numbers]
            items = tuple(self.attractors[i][self.numbers[i].index(number)] for i in rows)
            found.append(Track(number, self.values[rows], items, shares[rows, number], self.parents.get(number)))
        return tuple(found)

    @property
    def families(self) -> tuple[tuple[int, ...], ...]:
        """Tracks that came from each other, such as by period doubling, first ones first."""
        root: dict[int, int] = {}
        for number in range(self._count):
            root[number] = root.get(self.parents.get(number, -1), number)
        return tuple(tuple(n for n in root if root[n] == first) for first in dict.fromkeys(root.values()))

    @property
    def _count(self) -> int:
        return 1 + max((number for numbers in self.numbers for number in numbers), default=-1)

    def report(self) -> str:
        """Return the tracks, and what was not resolved, as text."""
        lines = [repr(self)]
        lines += [f"  {track!r}{'' if track.parent is None else f', from track {track.parent}'}" for track in self.tracks]
        if self.unresolved.any():
            worst = int(np.argmax(self.unresolved))
            lines.append(f"  unresolved starts at {np.count_nonzero(self.unresolved)} values, at most {self.unresolved[worst]} of "
                         f"{self.starts[worst]} (at {self.values[worst]:.6g})")
        lines += [f"  not computed: {self.parameter} = {self.values[i]:.6g}: {text}" for i, text in sorted(self.failures.items())]
        return "\n".join(lines)

    @checked()
    def plot(self, axes=None, branches: Sequence = (), measure: str = "rms_0", names=None):
        """Draw the attractors over the parameter, beside ``branches`` of `trace`, above the shares; return the two axes."""
        return plotting.plot_sweep(self, axes, branches, measure, names=names)

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        headers, arrays = packed_points(self.attractors)
        arrays |= {"values": self.values, "unresolved": self.unresolved, "outside": self.outside, "starts": self.starts}
        return {"kind": "sweep", "system": self.system.to_record(), "parameter": self.parameter, "attractors": headers,
                "numbers": self.numbers, "counts": self.counts, "parents": {str(k): v for k, v in self.parents.items()},
                "region": self.region.to_record(), "options": self.options,
                "failures": {str(k): v for k, v in self.failures.items()}, "key": self.key}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Sweep":
        """Make the sweep that `to_record` described; ``elements`` are user classes and laws."""
        items = tuple(tuple(mine) for mine in unpacked_points(header["attractors"], arrays, elements))
        io.fitted(arrays, {"values": "finite m", "unresolved": "whole m", "outside": "whole m", "starts": "whole m"}, m=len(items))
        return cls(System.from_record(header["system"], elements), header["parameter"], arrays["values"], items,
                   _nested(header["numbers"]), _nested(header["counts"]), arrays["unresolved"], arrays["outside"], arrays["starts"],
                   {int(k): v for k, v in header["parents"].items()}, Region.from_record(header["region"]), header["options"],
                   {int(k): v for k, v in header["failures"].items()}, header["key"])

    @checked()
    def save(self, path) -> None:
        """Write the sweep to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        left = f", {len(self.failures)} values failed" if self.failures else ""
        return (f"Sweep({self.parameter} at {len(self.values)} values from {self.values[0]:.6g} to {self.values[-1]:.6g}, "
                f"{self._count} tracks, {int(self.starts.max(initial=0))} starts each{left})")


@checked()
def sweep(system: System, parameter: str, values, region: Mapping, *, at: Mapping | None = None, samples: int = 2000, seed: int = 0,
          tolerance: float = 1e-4, max_periods: int = 2000, max_events: int = 2000, executor=None, workers: int | None = None,
          chunk: int = BLOCK, progress: bool = False, file=None) -> Sweep:
    """Return the attractors of a forced system over a parameter, and the shares of starts that lead to each.

    Parameters
    ----------
    system : System
    parameter : str
        Name of a float parameter.
    values : array_like
        (m,), increasing or decreasing.
    region : mapping of str to (low, high)
        Components of the start and their ranges, any number of them.
    at : mapping of str to float, optional
        Values of other components of the start.
    samples : int
        Starts at each value, the same evenly spread ones everywhere.
    seed : int
        Of their shift.
    tolerance, max_periods, max_events
        As for `basins_of_attraction`.
    executor : Executor, dask.distributed.Client, function, or None
        Where chunks are computed; None: threads.  A function without arguments that makes an executor lets a broken
        pool be made again.  No choice changes a bit of the result.
    workers : int, optional
        Threads; default one a processor.
    chunk : int
        Values a chunk.
    progress : bool
    file : path-like, optional
        Where the sweep is saved.  Finished chunks are kept in ``<file>.chunks`` until it is: after an interrupt or a
        kill the same call computes only what is missing; when the sweep is there already, it is read.

    Returns
    -------
    Sweep
        Values that failed are in its ``failures``; their chunks are tried again by the same call.

    Raises
    ------
    ValueError
        Autonomous system, unknown or whole-number parameter, values that do not rise or fall, unknown components.
    OSError
        When files cannot be written; what is finished is kept.

    References
    ----------
    P. J. Menck, J. Heitzig, N. Marwan, J. Kurths, Nature Physics 9 (2013) 89; G. Datseris, K. L. Rossi, A. Wagemakers,
    Chaos 33 (2023) 073151.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator()
    >>> found = bf.sweep(system, "omega", [1.3, 1.4, 1.5], {"q0": (-3, 1), "v0": (-4, 4)}, samples=100)
    >>> [track.attractors[0].periods for track in found.tracks]
    [1, 1, 1]
    """
    if require_system(system).period is None:
        raise ValueError(f"{system!r} is autonomous; a sweep needs the phase of an excitation (omega)")
    parameter = system.parameter_name(parameter)
    system.parameter(parameter)
    values = _values(values)
    require_values(system, "values", parameter, values, least=1)  # each other one fails alone
    box = Region(region, at)
    box.starts(scene_of(system), 1, 0)
    options = {"seed": seed, "tolerance": tolerance, "max_periods": max_periods, "max_events": max_events}
    job = {"what": "sweep", "system": system.to_record(), "elements": user_parts(system), "parameter": parameter,
           "region": box.to_record(), "samples": samples, "options": options}

    def compute(store: ChunkStore, key: str) -> Sweep:
        with Progress("sweep", len(values) * (1.0 + FOLLOWING), progress) as bar:
            return _swept(system, values, job, store, key, {"executor": executor, "workers": workers, "bar": bar}, chunk)

    return resumable("sweep", file, job, partial(Sweep.from_record, elements=job["elements"]), compute, part={"values": values},
                     whole=lambda found: not found.failures)


def _swept(system: System, values: np.ndarray, job: dict, store: ChunkStore, key: str, run: dict, chunk: int) -> Sweep:
    """Look for attractors everywhere, follow them, count again where some were added."""
    common = {name: job[name] for name in ("system", "elements", "region", "samples", "options")}
    changes = [{job["parameter"]: float(value)} for value in values]
    blocks = [range(i, min(i + chunk, len(values))) for i in range(0, len(values), chunk)]
    rows: dict[int, dict] = {}
    failures: dict[int, str] = {}
    done: dict[Key, End] = {}  # links within chunks, by number of the value

    def count(parts: Sequence[Sequence[int]], known: dict[int, list] | None) -> None:
        alone: list[list[int]] = []  # values of chunks that failed: one of them must not take its neighbours along
        payloads = []
        for part in parts:
            payload = {**common, "points": [changes[i] for i in part]}
            if known is not None:
                payload["known"], payload["arrays"] = packed_points([known[i] for i in part])
            payloads.append(payload)
        weights = [float(len(part)) if known is None else 0.0 for part in parts]
        outcome = run_chunks(store, sweep_points, payloads, weights=weights, **run)
        for n, (part, result) in enumerate(zip(parts, outcome.results, strict=True)):
            if result is None and len(part) > 1:
                alone += [[i] for i in part]
                continue
            if result is None:
                failures[part[0]] = outcome.failures[n]
                continue
            meta, arrays = result
            done.update({(part[p], k, step): None if number < 0 else (number, bool(continued))
                         for p, k, step, number, continued in meta["links"]})
            items = unpacked_points([mine["attractors"] for mine in meta["points"]], arrays, common["elements"])
            for i, mine, attractors in zip(part, meta["points"], items, strict=True):
                rows[i] = {**mine, "attractors": attractors}
        if alone:
            count(alone, known)

    count(blocks, None)
    good = [i for i in range(len(values)) if i not in failures]
    scales = [Region.from_record(job["region"]).sizes(scene_of(system.with_parameters(**changes[i]))) for i in good]
    systems = [rows[i]["attractors"][0].system if rows[i]["attractors"] else system.with_parameters(**changes[i]) for i in good]
    place = {i: j for j, i in enumerate(good)}
    links = Links(systems, scales, [list(rows[i]["attractors"]) for i in good],
                  {(place[i], k, step): end for (i, k, step), end in done.items()})
    for _ in range(ROUNDS):
        links.spread()
        grown = sorted(links.grown)
        if not grown:
            break
        before = {j: len(links.attractors[j]) for j in grown}
        count([[good[j]] for j in grown], {good[j]: links.attractors[j] for j in grown})
        if any(good[j] in failures for j in grown):
            good = [i for i in good if i not in failures]
            return _swept_without(system, values, job, rows, failures, good, key)
        if all(len(rows[good[j]]["attractors"]) == before[j] for j in grown):
            break
        for j in grown:  # those known keep their numbers, and their links
            links.attractors[j] = list(rows[good[j]]["attractors"])
        links.grown.clear()
    run["bar"].advance(FOLLOWING * len(values))
    return _result(system, values, job, rows, failures, good, links, key)


def _swept_without(system, values, job, rows, failures, good, key) -> Sweep:
    """Return what can be said when counting again failed: those values are left out."""
    scales = [Region.from_record(job["region"]).sizes(scene_of(system.with_parameters(**{job["parameter"]: float(values[i])})))
              for i in good]
    systems = [system.with_parameters(**{job["parameter"]: float(values[i])}) for i in good]
    links = Links(systems, scales, [list(rows[i]["attractors"]) for i in good])
    return _result(system, values, job, rows, failures, good, links, key)


def _result(system, values, job, rows, failures, good, links: Links, key: str) -> Sweep:
    numbers, parents = links.tracks() if good else ([], {})
    place = {i: j for j, i in enumerate(good)}
    empty: dict = {"attractors": [], "counts": [], "unresolved": 0, "outside": 0, "starts": 0}
    found = [rows[i] if i in place else empty for i in range(len(values))]
    whole = {name: np.array([row[name] for row in found], np.int64) for name in ("unresolved", "outside", "starts")}
    return Sweep(system, job["parameter"], values, tuple(tuple(row["attractors"]) for row in found),
                 tuple(tuple(numbers[place[i]]) if i in place else () for i in range(len(values))),
                 tuple(tuple(row["counts"]) for row in found), whole["unresolved"], whole["outside"], whole["starts"], parents,
                 Region.from_record(job["region"]), job["options"], failures, key)


def _values(values, name: str = "values") -> np.ndarray:
    found = np.atleast_1d(array("", name, values, axes=(0, 1)))
    before, after = found[:-1], found[1:]
    if not ((after > before).all() or (after < before).all()):
        raise ValueError(f"{name} = {shown(values)} is not allowed; they must rise or fall, each only once")
    return found


def _nested(rows) -> tuple:
    return tuple(tuple(row) for row in rows)
