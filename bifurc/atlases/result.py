"""What an atlas holds: branches, probes, the graph that connects them, bands, a table, and how sure 'nothing else' is."""
import functools
from dataclasses import dataclass, field

import networkx as nx

from .. import io, plotting
from ..checks import checked
from ..content import Content
from ..continuation.branches.branch import Branch
from ..ensemble.region import Region
from ..enumerations import DescribedEnum
from ..system import System
from .graph import graph_of
from .identity import orbits_at, periods_of, symmetric
from .records import packed_branches, unpacked_branches
from .search import Probe, Search
from .stability import gaps, layers, stable_intervals

SURE = 0.95  # confidence of the statement


class AtlasStatus(DescribedEnum):
    """How the search ended."""

    NOTHING_NEW = "nothing_new", "The last check found nothing new."
    MOST_BRANCHES = ("most_branches", "The search ended at most_branches; raise it, lower `periods`, or narrow the "
                                      "bounds.")
    STILL_FINDING = ("still_finding", "Every check still found something new; there is more than was found. Narrow "
                                      "the bounds, or raise samples and checks.")
    FAILED = ("failed", "Parts of the work raised, and what they would have found is missing: `failures` has their messages. "
                        "Mend what they name; with file= the same call then computes these parts alone.")
    NO_MOTION = ("no_motion", "No start led to a periodic or chaotic motion: the system diverges there, or needs "
                              "another region.")


@dataclass(frozen=True, eq=False)
class Atlas(Content):
    """All motions of a system over a parameter that a search found.

    Attributes
    ----------
    system : System
    parameter : str
    bounds : tuple of float
    region : Region
        Of the starts.
    branches : tuple of Branch
    origins : tuple of str
        How the first orbit of each was found.
    probes : tuple of Probe
        What starts led to, one a value of the parameter, in the order they were made.
    untraced : tuple of (value, why)
        Periodic attractors without a branch.
    failures : tuple of str
        Parts of the work that raised.
    options : dict
    status : AtlasStatus

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.atlas(bf.systems.impact_oscillator(), "omega", (1.2, 1.6), {"q0": (-3, 1), "v0": (-4, 4)}, probes=3,
    ...                  checks=2, samples=50, periods=1)
    >>> found.graph.number_of_edges() >= 1
    True
    """

    system: System
    parameter: str
    bounds: tuple[float, float]
    region: Region = field(repr=False)
    branches: tuple[Branch, ...] = field(repr=False)
    origins: tuple[str, ...] = field(repr=False)
    probes: tuple[Probe, ...] = field(repr=False)
    untraced: tuple[tuple[float, str], ...] = field(repr=False)
    failures: tuple[str, ...] = field(repr=False)
    options: dict = field(repr=False)
    status: AtlasStatus
    key: str = field(repr=False)

    @classmethod
    def of(cls, search: Search, region: Region) -> "Atlas":
        """Make the result of a search."""
        status = AtlasStatus.NOTHING_NEW if search.finished else AtlasStatus.STILL_FINDING
        if search.full:
            status = AtlasStatus.MOST_BRANCHES
        if not search.branches and all(not any(probe.counts) for probe in search.probes):
            status = AtlasStatus.NO_MOTION
        if search.failures:
            status = AtlasStatus.FAILED
        options = {**search.options, "samples": search.job["samples"], **search.job["options"]}
        return cls(search.system, search.parameter, search.bounds, region, tuple(search.branches), tuple(search.origins),
                   tuple(search.probes), tuple(search.untraced), tuple(search.failures), options, status, search.store.key)

    # reading

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return self.status.sentence

    @functools.cached_property
    def graph(self) -> nx.MultiGraph:
        """Special points and ends as nodes, pieces of branches between them as edges; see `bifurc.atlases.graph`."""
        return graph_of(self.branches, self.bounds)

    @functools.cached_property
    def stable(self) -> tuple[tuple[float, float, int], ...]:
        """Intervals of the parameter in which a branch is stable: (low, high, number of the branch)."""
        return tuple((a, b, k) for k, branch in enumerate(self.branches) for a, b in stable_intervals(branch))

    @functools.cached_property
    def coexistence(self) -> tuple[tuple[float, float, tuple[int, ...]], ...]:
        """Bands (low, high, branches) in which these branches are stable together; chaos is in `chaos`."""
        return tuple(layers(self.stable, *self.bounds))

    @functools.cached_property
    def chaos(self) -> tuple[tuple[float, float, float], ...]:
        """Bands (low, high, largest exponent per time) of chaos: neighbouring probes that all found it, each band ending half way
        to a probe that did not."""
        ordered = sorted(self.probes, key=lambda probe: probe.value)
        found: list[tuple[float, float, float]] = []
        for k, probe in enumerate(ordered):
            if probe.chaos is None:
                continue
            low = self.bounds[0] if k == 0 else 0.5 * (ordered[k - 1].value + probe.value)
            high = self.bounds[1] if k + 1 == len(ordered) else 0.5 * (ordered[k + 1].value + probe.value)
            if found and found[-1][1] >= low:
                found[-1] = (found[-1][0], high, max(found[-1][2], probe.chaos))
            else:
                found.append((low, high, probe.chaos))
        return tuple(found)

    @checked()
    def orbits_at(self, value: float) -> list[tuple[int, object]]:
        """Return number of the branch and orbit of every periodic motion at a value of the parameter, stable or not."""
        return [(k, orbit) for k, branch in enumerate(self.branches) for orbit in orbits_at(branch, float(value))]

    def table(self) -> list[dict]:
        """Return one row a branch: number, periods, from, to, stable intervals, special points, ends, mirror image, origin."""
        rows = []
        for k, branch in enumerate(self.branches):
            reached = [*branch.column("parameter"), *(point.parameter for point in branch.special_points)]  # folds lie beyond rows
            kinds: dict[str, int] = {}
            for point in branch.special_points:
                kinds[str(point.kind)] = kinds.get(str(point.kind), 0) + 1
            orbit = branch.orbits[len(branch) // 2]
            mirrored = self.system.symmetry == -1 and not symmetric(orbit)
            rows.append({"branch": k, "periods": periods_of(branch), "from": float(min(reached)), "to": float(max(reached)),
                         "stable": [(a, b) for a, b, number in self.stable if number == k], "points": kinds,
                         "ends": tuple(str(reason) for reason in branch.stop_reason), "mirror_image": mirrored,
                         "origin": self.origins[k]})
        return rows

    def report(self) -> str:
        """Return table and statement as text."""
        lines = [f"{'branch':>6} {'T':>3} {'from':>12} {'to':>12}  {'stable':<34} special points"]
        for row in self.table():
            stable = ", ".join(f"{a:.6g}..{b:.6g}" for a, b in row["stable"]) or "-"
            points = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in row["points"].items()) or "-"
            twin = " (and its mirror image)" if row["mirror_image"] else ""
            lines.append(f"{row['branch']:>6} {row['periods']:>3} {row['from']:>12.8g} {row['to']:>12.8g}  {stable:<34} "
                         f"{points}{twin}")
        for low, high, exponent in self.chaos:
            lines.append(f" chaos     {low:>12.8g} {high:>12.8g}  largest exponent {exponent:.4g} per time")
        for value, why in self.untraced:
            lines.append(f" {self.parameter} = {value:.8g}: not traced: {why}")
        return "\n".join([*lines, "", self.statement])

    @property
    def statement(self) -> str:
        """What was searched, and how sure 'nothing else' is.

        n starts at a value miss an attractor that draws the share f of the region with the probability (1 - f)^n; values drawn
        at random miss one that exists on the part w of the range with (1 - w)^m.
        """
        n = max((probe.starts for probe in self.probes), default=0)
        checks = [probe for probe in self.probes if probe.why == "check"]
        m = min(len(checks), int(self.options["checks"]))
        text = (f"{sum(probe.starts for probe in self.probes)} starts at {len(self.probes)} values of {self.parameter} in "
                f"{self.region!r}; {len(self.branches)} branches (orbits from switching up to {self.options['periods']} forcing "
                "periods). ")
        if n:
            share = 1.0 - (1.0 - SURE) ** (1.0 / n)
            text += (f"At each of these values an attractor that draws {100 * share:.2g} % of the region or more was missed with a "
                     f"probability below {100 * (1 - SURE):.0f} %. ")
        if self.status is AtlasStatus.NOTHING_NEW and m:
            part = 1.0 - (1.0 - SURE) ** (1.0 / m)
            text += (f"The last {m} values, drawn at random, showed nothing new: with {100 * SURE:.0f} % confidence such "
                     f"attractors, if any were missed, exist on less than {100 * part:.0f} % of the range. ")
        text += self._continua()
        left = sum(probe.unresolved for probe in self.probes)
        outside = sum(probe.outside for probe in self.probes)
        if left or outside:
            text += f"{left} starts did not settle, {outside} diverged or began beyond a stop. "
        if self.failures:
            text += f"{len(self.failures)} parts of the work failed. "
        return text + self.message

    def _continua(self) -> str:
        """Say where motions form a continuum, which counts as one attractor; empty without any."""
        with_any = sorted((probe for probe in self.probes if probe.continua), key=lambda probe: probe.value)
        if not with_any:
            return ""
        n = self.system.n
        probe = with_any[-1]
        places = ", ".join(f"{f'q{c}' if c < n else f'state {c}'} anywhere in [{a:.4g}, {b:.4g}]"
                           for c, (a, b) in ((int(c), pair) for c, pair in probe.continua[0].items()))
        return (f"At {len(with_any)} of {len(self.probes)} values, from {with_any[0].value:.6g} to {probe.value:.6g}, motions form "
                f"a continuum, which counts as one attractor and one branch: at {probe.value:.6g} {places}. ")

    @property
    def unknown(self) -> list[tuple[float, float]]:
        """Parts of the range where no periodic motion is known to be stable."""
        return gaps([(a, b) for a, b, _ in self.stable], *self.bounds)

    @checked()
    def plot(self, ax=None, measure: str | None = None):
        """Draw the whole diagram with its bands; return the axes."""
        return plotting.plot_atlas(self, ax, measure)

    def __repr__(self):
        return (f"Atlas({self.parameter} from {self.bounds[0]:.6g} to {self.bounds[1]:.6g}, {len(self.branches)} branches, "
                f"{len(self.chaos)} bands of chaos, {len(self.probes)} probes, {self.status.value})")

    # files

    @checked()
    def save(self, path):
        """Write the atlas to a file; it is renamed into place when complete."""
        return io.write(path, *self.to_record())

    def to_record(self) -> tuple[dict, dict]:
        """Return the JSON-able header and the arrays."""
        headers, arrays = packed_branches(self.branches)
        header = {"kind": "atlas", "system": self.system.to_record(), "parameter": self.parameter, "bounds": list(self.bounds),
                  "region": self.region.to_record(), "branches": headers, "origins": list(self.origins),
                  "probes": [vars(probe) for probe in self.probes], "untraced": [list(item) for item in self.untraced],
                  "failures": list(self.failures), "options": self.options, "status": self.status.value, "key": self.key}
        return header, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Atlas":
        """Make the atlas that `to_record` described; ``elements`` are user classes and laws."""
        branches = [branch for branch in unpacked_branches(header["branches"], arrays, elements) if branch is not None]
        low, high = header["bounds"]
        probes = tuple(Probe(**probe) for probe in header["probes"])
        untraced = tuple((value, why) for value, why in header["untraced"])
        return cls(System.from_record(header["system"], elements), header["parameter"], (low, high),
                   Region.from_record(header["region"]), tuple(branches), tuple(header["origins"]), probes, untraced,
                   tuple(header["failures"]), header["options"], AtlasStatus(header["status"]), header["key"])
