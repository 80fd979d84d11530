"""CellMap: the groups of a map of cells, what leads to them, the attractors they hold, and how far it can be trusted.

One file, because it is one result with the small records that its questions return.
"""
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.stats import beta

from ... import io, plotting
from ...checks import COUNT, checked, whole
from ...compose.scene import scene_of
from ...content import Content, by_content, handed_out, read_only
from ...ensemble.grid import Grid
from ...enumerations import DescribedEnum
from ...notebook import Notebook
from ...orbits.find import find_orbit
from ...system import System
from ..attractors.attractors import section_points
from ..attractors.records import packed, unpacked
from ..maps.labelled import NONE, numbered
from .confirmation import cells_around
from .generalized import components, solved, stationary
from .images import Carrier, representatives
from .morse import morse_graph


class GroupKind(DescribedEnum):
    """What a group of cells is."""

    PERIODIC = "periodic", "A periodic attractor lies here; Newton on the map confirmed it."
    CHAOTIC = "chaotic", "A chaotic attractor lies here; its largest exponent is positive by four standard errors."
    MERGED = ("merged", "Motions from its cells reach several attractors: the cells are too large, or too few points "
                        "a cell tell them apart; take smaller cells or more periods a mapping.")
    SPURIOUS = ("spurious", "The cells map to each other but the motion is no such cycle: no attractor. Its cells are "
                            "given to the attractor that the motion reaches; take smaller cells or more periods a "
                            "mapping.")
    UNCONFIRMED = "unconfirmed", "The motion settled on nothing that could be confirmed; look at it with simulate."


class CellFate(DescribedEnum):
    """What became of a cell; the position in ``tuple(CellFate)`` is the code in `CellMap.fates`."""

    ATTRACTED = "attracted", "The cell leads to a group that is given to a confirmed attractor."
    UNRESOLVED = "unresolved", "The cell leads to a group in which no attractor could be confirmed."
    LEFT = "left", "The cell leads out of the grid, or to infinity; enlarge the grid, or take more periods a mapping."
    OUTSIDE = "outside", "The cell lies beyond a rigid stop and no motion arrives in it: it is no start."

    @property
    def code(self) -> int:
        """Position of the fate."""
        return list(CellFate).index(self)


@by_content
class Group(NamedTuple):
    """A closed group of cells: a cycle of a simple, a persistent group of a generalized map."""

    cells: np.ndarray  # (k,) numbers; of a cycle in the order they are visited
    kind: GroupKind
    period: int  # in mappings
    attractor: int  # the attractor that its motion reaches, -1: none confirmed


class Audit(NamedTuple):
    """Labels of random cells compared with the motion followed from their centres."""

    cells: int
    wrong: int  # given to another attractor than the motion reaches, or to one where it reaches none
    undecided: int = 0  # given to none where the motion reaches one: it leaves the grid on its way, or a group is unresolved

    @property
    def fraction(self) -> float:
        """Measured share of wrong labels."""
        return self.wrong / max(self.cells, 1)

    @property
    def bounds(self) -> tuple[float, float]:
        """Interval that holds the true share with 95 % confidence (Clopper and Pearson 1934)."""
        low = beta.ppf(0.025, self.wrong, self.cells - self.wrong + 1) if self.wrong else 0.0
        high = beta.ppf(0.975, self.wrong + 1, self.cells - self.wrong) if self.wrong < self.cells else 1.0
        return float(low), float(high)


@by_content
class Absorption(NamedTuple):
    """Where a Markov chain of cells ends."""

    probability: np.ndarray  # (*shape, attractors) of ending in a group of each attractor
    unresolved: np.ndarray  # (*shape,) of ending in a group with no confirmed attractor
    left: np.ndarray  # (*shape,) of leaving the grid
    time: np.ndarray  # (*shape,) expected forcing periods until then


@handed_out("matrix")
@dataclass(frozen=True, eq=False)
class CellMap(Content, Notebook):
    """A map, or a Markov chain, of cells.  Made by `cell_mapping`.

    Attributes
    ----------
    system : System or callable
    grid : Grid
    periods : int
        Forcing periods a mapping.
    samples : int
        Points a cell along each component; 1: simple cell mapping.
    attractors : tuple of PeriodicOrbit, ChaoticAttractor and MapCycle
        Confirmed; label k is ``attractors[k]``.
    groups : tuple of Group
        Closed groups: cycles, or persistent groups.
    matrix : scipy.sparse.csr_matrix
        Transition probabilities (N + 1, N + 1); the last is the sink of all that leaves the grid.
    labels : ndarray of int
        The (for a chain: likeliest) attractor of each cell, -1: none; ``fates`` says why.
    fates : ndarray of int
        Code of the `CellFate` of each cell.
    group, steps : ndarray of int, or None
        Simple cell mapping: number of the group that a cell leads to (-1: the sink), mappings until it is on the cycle.
    audit : Audit or None
    lost : int
        Samples whose motion went to infinity or held too many events; they count as having left.
    options : dict

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
    >>> bf.cell_mapping(system, bf.Grid(q0=(-2.5, 0.0, 60), v0=(-3, 3, 60)), periods=30).labels.shape
    (60, 60)
    """

    _facts = ("samples", "periods", "lost")

    system: Any
    grid: Grid
    periods: int
    samples: int
    attractors: tuple
    groups: tuple
    matrix: Any = field(repr=False)
    labels: np.ndarray = field(repr=False)
    fates: np.ndarray = field(repr=False)
    group: np.ndarray | None = field(repr=False)
    steps: np.ndarray | None = field(repr=False)
    audit: Audit | None
    lost: int
    options: dict
    key: str = field(default="", repr=False)

    def __post_init__(self):
        for name in ("labels", "fates", "group", "steps"):
            values = getattr(self, name)
            if values is not None and values.size == self.grid.size:
                object.__setattr__(self, name, values.reshape(self.grid.shape))
        groups = tuple(item._replace(cells=read_only(item.cells)) for item in self.groups)
        object.__setattr__(self, "groups", groups)
        super().__post_init__()

    def with_audit(self, audit: Audit) -> "CellMap":
        """Return the same with its labels audited."""
        return self._changed(audit=audit)

    def with_labels(self) -> "CellMap":
        """Return the same with each cell given to the attractor that it most likely ends on."""
        found = self.absorption()
        chances = np.concatenate((found.probability, found.unresolved[..., None], found.left[..., None]), axis=-1)
        best = np.argmax(chances, axis=-1)
        count = len(self.attractors)
        start = self.fates != CellFate.OUTSIDE.code
        fates = np.where(best < count, CellFate.ATTRACTED.code,
                         np.where(best == count, CellFate.UNRESOLVED.code, CellFate.LEFT.code))
        return self._changed(labels=np.where((best < count) & start, best, -1), fates=np.where(start, fates, CellFate.OUTSIDE.code))

    def _changed(self, **fields) -> "CellMap":
        """Return a copy with other fields that keeps what was derived from the chain."""
        made = replace(self, **fields)
        derived = ("_components", "_absorption", "morse")
        made.__dict__.update({name: self.__dict__[name] for name in ("matrix", *derived) if name in self.__dict__})
        return made

    @property
    def components(self):
        """Strongly connected components of the graph, see `bifurc.basins.cells.generalized.Components`."""
        return self._components._make(map(read_only, self._components))

    @property
    def _chain(self):
        """`matrix` as it was made: kernels compile again for read-only arrays."""
        return self.__dict__["matrix"]

    @cached_property
    def _components(self):
        return components(self._chain)

    @cached_property
    def _absorption(self) -> Absorption:
        parts, count, size = self._components, len(self.attractors), self.grid.size
        ends = np.zeros((size + 1, count + 3))
        ends[size, count + 1] = 1.0
        closed = parts.closed[parts.label]
        closed[size] = False
        ends[closed, count] = 1.0
        for item in self.groups:
            if item.attractor >= 0:
                ends[item.cells, count] = 0.0
                ends[item.cells, item.attractor] = 1.0
        known = ends.copy()
        chances = solved(self._chain, parts, known[:, :count + 2], np.zeros(size + 1))
        time = solved(self._chain, parts, known[:, count + 2:], np.ones(size + 1))
        shape = self.grid.shape
        chances = np.clip(chances[:size], 0.0, 1.0)
        return Absorption(chances[:, :count].reshape(*shape, count), chances[:, count].reshape(shape),
                          chances[:, count + 1].reshape(shape), self.periods * time[:size, 0].reshape(shape))

    def absorption(self) -> Absorption:
        """Return the probabilities of ending on each attractor, and the expected time until then."""
        return self._absorption

    def points(self, label: int) -> np.ndarray:
        """Return the points (k, d) of an attractor at phase 0, in the components of the grid."""
        found = self.attractors[numbered("label", label, len(self.attractors), NONE)].sections
        return found[:, self._places] if isinstance(self.system, System) else found

    @property
    def _places(self) -> list[int]:
        return list(self.grid.places(self.system.n, scene_of(self.system).ns, self.system.states))

    @checked(group=None)
    def density(self, group: int | Group) -> np.ndarray:
        """Return the stationary probabilities of the cells of a closed group, zero elsewhere, in the shape of the grid."""
        item = group if isinstance(group, Group) else self.groups[numbered("group", group, len(self.groups), "-1 is the sink")]
        cells = np.sort(item.cells)
        field_ = np.zeros(self.grid.size)
        field_[cells] = stationary(self._chain, cells)
        return field_.reshape(self.grid.shape)

    @cached_property
    def morse(self):
        """Morse graph: the recurrent groups, and which leads to which, see `bifurc.basins.cells.morse.morse_graph`."""
        return morse_graph(self)

    @checked()
    def saddles(self, most: int = 20) -> tuple:
        """Return unstable periodic orbits in transient recurrent groups, confirmed by Newton; largest groups first.

        A transient group is a place that motions may return to before they leave: mostly a saddle.  Each of the ``most`` largest
        gives a guess; an orbit is accepted when it lies in the group or beside it and is not stable.

        Raises
        ------
        ValueError
            For a map given as a function.
        """
        if not isinstance(self.system, System):
            raise ValueError(f"saddles are solved for systems; the map is that of the function {self.system!r}")
        places = self._places
        carrier = Carrier(self.system, self.grid, self.periods, self.options["max_events"])
        groups = [content for _, content in self.morse.nodes(data=True) if content["kind"] == "transient"]
        found: list = []
        for content in sorted(groups, key=lambda content: -content["cells"])[:most]:
            cells = content["numbers"]
            inside = self._chain[cells][:, cells].sum(axis=1)
            guess = representatives(carrier, cells[[int(np.argmax(inside))]], self.samples, {})[0]
            orbit = find_orbit(self.system, guess=guess, periods=self.periods * max(content["period"], 1))
            if not orbit.success or orbit.stable is not False:
                continue
            points = section_points(orbit)
            near = np.isin(cells_around(self.grid, points[:, places]), cells).any()
            known = any(item.periods == orbit.periods and np.abs(section_points(item) - points[0]).max(axis=1).min() < 1e-8
                        for item in found)
            if near and not known:
                found.append(orbit)
        return tuple(found)

    @property
    def spurious(self) -> tuple:
        """Closed groups that hold no attractor."""
        return tuple(item for item in self.groups if item.kind is GroupKind.SPURIOUS)

    @property
    def fractions(self) -> dict[int, float]:
        """Share of each label among the cells that are starts; -1: none."""
        start = self.fates != CellFate.OUTSIDE.code
        total = max(int(np.count_nonzero(start)), 1)
        numbers = [*range(len(self.attractors)), -1]
        return {label: int(np.count_nonzero((self.labels == label) & start)) / total for label in numbers}

    def report(self) -> str:
        """Return attractors, groups, fractions and the audit as text."""
        kind = "simple" if self.samples == 1 else f"generalized ({self.samples} points a component)"
        lines = [f"{kind} cell mapping, {self.periods} periods a mapping, {self.grid!r}"]
        lines += [f"{label:>4} {self.fractions[label]:>10.6f}  {item!r}" for label, item in enumerate(self.attractors)]
        lines.append(f"  -1 {self.fractions[-1]:>10.6f}  no attractor")
        housed = {item.attractor for item in self.groups if item.kind is not GroupKind.SPURIOUS}
        homeless = set(range(len(self.attractors))) - housed
        if homeless:
            lines.append(f"     attractors in no group of cells of their own: {', '.join(map(str, sorted(homeless)))}; take "
                         "smaller cells, or more periods a mapping")
        for kind_ in GroupKind:
            count = sum(item.kind is kind_ for item in self.groups)
            if count:
                lines.append(f"     {count:>10d}  closed groups: {kind_.sentence}")
        for fate in list(CellFate)[1:]:
            count = int(np.count_nonzero(self.fates == fate.code))
            if count:
                lines.append(f"     {count:>10d}  cells: {fate.sentence}")
        if self.audit is not None:
            low, high = self.audit.bounds
            lines.append(f"labels wrong in {self.audit.wrong} of {self.audit.cells} random cells, "
                         f"{100 * self.audit.fraction:.2g} % ({100 * low:.2g} to {100 * high:.2g} % with 95 % confidence); "
                         f"{self.audit.undecided} more reach an attractor but have no label")
        return "\n".join(lines)

    @checked()
    def plot(self, ax=None, field: str = "labels", group: int = 0):
        """Draw the labels with the attractors, or the "doubt", "time" or "density" of each cell; return the axes."""
        group = whole("plot", "group", group, least=0, most=max(len(self.groups) - 1, 0))
        return plotting.plot_cells(self, ax, field, group)

    @checked(least=COUNT)
    def plot_morse(self, ax=None, least: int = 1):
        """Draw the Morse graph, without transient groups below ``least`` cells; return the axes."""
        return plotting.plot_morse(self, ax, least)

    def to_xarray(self):
        """Return labels and fates as an xarray Dataset over the components of the grid."""
        import xarray  # optional

        names = self.grid.names
        fields = {name: getattr(self, name) for name in ("labels", "fates", "group", "steps")}
        return xarray.Dataset({name: (names, values) for name, values in fields.items()
                               if values is not None and values.shape == self.grid.shape},
                              {name: self.grid.centres(axis) for axis, name in enumerate(names)}, {"system": repr(self.system)})

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`.

        Raises
        ------
        ValueError
            For a map given as a function: no code is written to a file.
        """
        if not isinstance(self.system, System):
            raise ValueError(f"a map of cells of the function {self.system!r} cannot be saved: files hold no code; save its arrays")
        headers, stored = packed(self.attractors)
        arrays = {"labels": self.labels, "fates": self.fates, "data": self._chain.data, "indices": self._chain.indices,
                  "indptr": self._chain.indptr} | stored
        for name in ("group", "steps"):
            if getattr(self, name) is not None:
                arrays[name] = getattr(self, name)
        groups = []
        for number, item in enumerate(self.groups):
            groups.append({"kind": str(item.kind), "period": item.period, "attractor": item.attractor})
            arrays[f"group_{number}"] = item.cells
        return {"kind": "cells", "system": self.system.to_record(), "grid": self.grid.to_record(), "periods": self.periods,
                "samples": self.samples, "attractors": headers, "groups": groups, "lost": self.lost,
                "options": self.options, "key": self.key,
                "audit": None if self.audit is None else list(self.audit)}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "CellMap":
        """Make the map that `to_record` described."""
        grid = Grid.from_record(header["grid"])
        cells = {f"group_{number}": f"whole {item['period'] if header['samples'] == 1 else '*'}"  # a cycle visits each cell once
                 for number, item in enumerate(header["groups"])}
        io.fitted(arrays, {"labels": "whole grid", "fates": "whole grid", "group?": "whole grid", "steps?": "whole grid",
                           "data": "finite k", "indices": "whole k", "indptr": "whole rows", **cells},
                  grid=grid.shape, rows=grid.size + 2)
        attractors = unpacked(header["attractors"], arrays, elements=elements)
        groups = tuple(Group(arrays[f"group_{number}"], GroupKind(item["kind"]), item["period"], item["attractor"])
                       for number, item in enumerate(header["groups"]))
        matrix = sparse.csr_matrix((arrays["data"], arrays["indices"], arrays["indptr"]), shape=(grid.size + 1, grid.size + 1))
        matrix.check_format()
        audit = None if header["audit"] is None else Audit(*header["audit"])
        return cls(System.from_record(header["system"], elements), grid, header["periods"], header["samples"], tuple(attractors),
                   groups, matrix, arrays["labels"], arrays["fates"], arrays.get("group"), arrays.get("steps"), audit,
                   header["lost"], header["options"], header.get("key", ""))

    @checked()
    def save(self, path) -> None:
        """Write the map to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        shares = ", ".join(f"{self.fractions[label]:.4f}" for label in range(len(self.attractors)))
        wrong = "" if self.audit is None else f", {100 * self.audit.fraction:.2g} % of {self.audit.cells} audited labels wrong"
        return (f"CellMap({' x '.join(map(str, self.grid.shape))} cells, {self.periods} periods, "
                f"{len(self.attractors)} attractors: {shares or 'none'}, {len(self.spurious)} spurious groups{wrong})")
