"""BasinMap: labels of a grid of starts, the attractors behind them, and how far the labels can be trusted."""
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ... import io, plotting
from ...checks import SET, checked, pair
from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.grid import Grid
from ...ensemble.initial_conditions import states_at
from ...ensemble.outcomes import CellState, coded
from ...ensemble.section import Section
from ...jobs.executors import user_parts
from ...jobs.store import ChunkStore
from ...lazy import deprecated
from ...notebook import Notebook
from ...system import System
from ..attractors.attractors import partners, targets_of
from ..attractors.clockless import integrator_of
from ..attractors.records import packed, unpacked
from .entropy import BasinEntropy, basin_entropy
from .label_noise import LabelNoise
from .labelled import LabelledStarts
from .labelling import Labeller, label_starts
from .reliability import Reliability, reliability
from .uncertainty_exponent import RANGE, Uncertainty, uncertainty_exponent


@dataclass(frozen=True, eq=False)
class BasinMap(Content, LabelledStarts, Notebook):
    """Which start leads to which attractor.  Made by `basins_of_attraction`.

    Attributes
    ----------
    system : System
    grid : Grid
    labels : ndarray of int
        Number of the attractor of each cell (axis 0: first component of the grid), -1 where there is none; `states`
        says why.
    attractors : tuple of PeriodicOrbit, ChaoticAttractor, QuasiperiodicAttractor and Equilibrium
        Confirmed; label k is ``attractors[k]``.
    states : ndarray of int
        Code of the `CellState` of each cell.
    periods, impacts : ndarray of int
        Forcing periods, and impacts with rigid or contacts with elastic stops, until the motion was within `radii` of
        its attractor; a complete chattering counts once from where it was closed.
    radii : tuple of float
        Distance, in units of ``scale``, at which a section point counts as on its attractor.
    scale : ndarray
        Sizes (ns,) of the states that distances are measured with.
    noise : LabelNoise
    options : dict
        seed, tolerance, max_periods, max_events.
    speeds : ndarray
        Least speed of arrival at a stop until then; 0 after a complete chattering, infinity without an impact.
    section : Section or None
        Where motions without a clock were compared; `periods` are returns to it.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=1.4)
    >>> basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 20), v0=(-4, 4, 20)))
    >>> basins.labels.shape
    (20, 20)
    """

    _facts = ("fractions", "label_uncertainty", "radii")

    system: System
    grid: Grid
    labels: np.ndarray = field(repr=False)
    attractors: tuple
    states: np.ndarray = field(repr=False)
    periods: np.ndarray = field(repr=False)
    impacts: np.ndarray = field(repr=False)
    radii: tuple
    scale: np.ndarray = field(repr=False)
    noise: LabelNoise
    options: dict
    key: str = field(default="", repr=False)
    speeds: np.ndarray = field(default_factory=lambda: np.empty(0), repr=False)
    section: Section | None = None

    @property
    def counts(self) -> dict:
        """Cells of each label, and of each `CellState` that occurs among those without."""
        found: dict = {label: int(np.count_nonzero(self.labels == label)) for label in range(len(self.attractors))}
        found[-1] = int(np.count_nonzero(self.labels == -1))
        for state in list(CellState)[1:]:
            count = int(np.count_nonzero(self.states == state.code))
            if count:
                found[state] = count
        return found

    @property
    def starts(self) -> np.ndarray:
        """Cells that are starts: not beyond a rigid stop."""
        return self.states != CellState.OUTSIDE.code

    @property
    def fractions(self) -> dict:
        """Share of each label among the cells that are starts; -1: unresolved.  Infinity has a share of its own.

        `CellState.DIVERGED` is among the keys when motions leave all bounds.
        """
        total = max(int(np.count_nonzero(self.starts)), 1)
        lost = self.states == CellState.DIVERGED.code
        found: dict = {label: int(np.count_nonzero((self.labels == label) & self.starts & ~lost)) / total
                       for label in [*range(len(self.attractors)), -1]}
        if lost.any():
            found[CellState.DIVERGED] = int(np.count_nonzero(lost)) / total
        return found

    @property
    def label_uncertainty(self) -> float:
        """Predicted fraction of labels that the error of the computed motion could change, see `LabelNoise`."""
        return self.noise.at_error

    @cached_property
    def reliability(self) -> Reliability:
        """How far labels can be relied on: a kind, the expected number of wrong ones, fractions with errors, a statement."""
        return reliability(self)

    @property
    def trust(self) -> Reliability:
        """The old name of `reliability`."""
        deprecated("BasinMap.trust", "BasinMap.reliability")
        return self.reliability

    @checked()
    def entropy(self, side: int = 5) -> BasinEntropy:
        """Return basin entropy and boundary entropy over boxes of ``side`` cells; infinity counts as a label."""
        return basin_entropy(coded(self.labels, self.states), side, self.starts)

    @checked()
    def uncertainty(self, low: float = RANGE[0], high: float = RANGE[1], **options) -> Uncertainty:
        """Return the uncertainty exponent with its error, see `bifurc.basins.maps.uncertainty_exponent.uncertainty_exponent`."""
        return uncertainty_exponent(self, low, high, **options)

    @checked()
    def labeller(self, workers: int | None = None, executor=None) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function that labels points (k, d) of the grid's components by following their motions.

        Its answers are labels; -1: unresolved, -2: no start, -3: infinity.
        """
        scene = scene_of(self.system)
        integrator = integrator_of(self.system, self.options["max_events"], self.section)
        targets = targets_of(self.attractors, self.radii, self.scale, self.section)
        own = Labeller(integrator, user_parts(self.system))
        run = {"workers": workers or os.cpu_count() or 1, "executor": executor}

        def label(points: np.ndarray) -> np.ndarray:
            states = states_at(scene, self.grid.names, self.grid.at, np.asarray(points, float))
            found = label_starts(own, states, targets, self.options["max_periods"], ChunkStore(None, {}), run)
            return coded(found.labels, found.states)

        return label

    @checked()
    def zoom(self, cells: int | None = None, **ranges) -> "BasinMap":
        """Return the map of a part of the region, or of another one, with the same attractors and numbers.

        Parameters
        ----------
        cells : int, optional
            Along each component; default: as here.
        **ranges : (low, high)
            By component; those not named keep their range.

        Examples
        --------
        >>> closer = basins.zoom(q0=(-1.2, -0.8), v0=(0.5, 1.0))     # doctest: +SKIP
        """
        from ... import basins_of_attraction  # the public call: a map of a part is a new computation

        unknown = set(ranges) - set(self.grid.names)
        if unknown:
            raise ValueError(f"zoom: {', '.join(sorted(unknown))} is no component of {self.grid!r}; write ranges of "
                             f"{', '.join(self.grid.names)}")
        sides: dict = {}
        for axis, name in enumerate(self.grid.names):
            low, high = (pair("BasinMap.zoom", name, ranges[name]) if name in ranges
                         else (self.grid.low[axis], self.grid.high[axis]))
            sides[name] = (low, high, self.grid.shape[axis] if cells is None else cells)
        periodic = [name for name in self.grid.periodic if name not in ranges]
        return basins_of_attraction(self.system, Grid(at=self.grid.at, periodic=periodic, **sides), attractors=self.attractors,
                                    section=self.section, **self.options)

    @cached_property
    def partners(self) -> dict[int, int]:
        """Mirror images: label -> label of the attractor that -y(t + half a period) makes of it, in symmetric systems."""
        return partners(self.system, self.attractors, self.scale)

    def report(self) -> str:
        """Return attractors, fractions and label noise as text."""
        lines = [f"{self.grid!r}, {self.system!r}"]
        counts = self.counts
        for label, attractor in enumerate(self.attractors):
            mirror = self.partners.get(label)
            words = "" if mirror is None else ", symmetric" if mirror == label else f", mirror image of {mirror}"
            error = self.reliability.fractions[label][1]
            lines.append(f"{label:>4} {self.fractions[label]:>10.6f} +- {error:.1g}  {attractor!r}{words}")
        lines.append(f"{-1:>4} {self.fractions[-1]:>10.6f}  unresolved")
        for label, attractor in enumerate(self.attractors):
            if attractor.family:
                lines.append(f"     attractor {label} stands for a continuum of motions that attracts as a whole. "
                             f"{attractor.message}")
        lines += [f"     {counts[state]:>10d}  cells: {state.sentence}" for state in CellState if state in counts]
        noise = self.noise
        measured = ", ".join(f"{f:.2g} at {e:.0e}" for e, f in zip(noise.perturbations, noise.changed, strict=True))
        lines.append(f"labels changed by perturbations: {measured or 'not measured'} ({noise.samples} starts)")
        lines.append(f"uncertainty exponent {noise.exponent:.3f} +- {noise.exponent_error:.3f}; predicted fraction of "
                     f"untrustworthy labels {noise.at_error:.1e}")
        if min(self.labels.shape) >= 5:
            entropy = self.entropy()
            proof = " (above ln 2: fractal)" if entropy.fractal else ""
            lines.append(f"basin entropy {entropy.basin:.4f}, boundary entropy {entropy.boundary:.4f}{proof}, 5 cells a box side")
        lines.append(self.reliability.statement)
        return "\n".join(lines)

    @checked(saddle=None, unstable=SET, stable=SET)
    def plot(self, ax=None, saddle=None, unstable=None, field: str = "labels", stable=None, names=None):
        """Draw the map with its attractors; return the axes.

        ``saddle`` (an orbit, or the result of `edge_state`), its ``unstable`` and ``stable`` sets are drawn over it; ``field``
        "periods", "impacts" or "speeds" draws that of each cell instead.
        """
        if field == "labels":
            return plotting.plot_basins(self, ax, saddle, unstable, stable, names=names)
        return plotting.plot_field(self, field, ax, names=names)

    def to_xarray(self):
        """Return labels, states, periods, impacts and speeds as an xarray Dataset over the components of the grid."""
        import xarray  # optional

        names = self.grid.names
        fields = {name: getattr(self, name) for name in ("labels", "states", "periods", "impacts", "speeds")}
        return xarray.Dataset({name: (names, values) for name, values in fields.items() if values.shape == self.grid.shape},
                              {name: self.grid.centres(axis) for axis, name in enumerate(names)},
                              {"system": repr(self.system), "attractors": [repr(item) for item in self.attractors]})

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        headers, stored = packed(self.attractors)
        arrays = {"labels": self.labels, "states": self.states, "periods": self.periods, "impacts": self.impacts,
                  "radii": np.array(self.radii, float), "scale": self.scale, "speeds": self.speeds} | stored
        section = {} if self.section is None else {"section": self.section.to_record()}
        header = {"kind": "basins", **section, "system": self.system.to_record(), "grid": self.grid.to_record(),
                  "attractors": headers, "noise": self.noise.to_record(), "options": self.options, "key": self.key}
        return header, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "BasinMap":
        """Make the map that `to_record` described; ``elements`` are user classes and laws."""
        system, grid = System.from_record(header["system"], elements), Grid.from_record(header["grid"])
        io.fitted(arrays, {"labels": "whole grid", "states": "whole grid", "periods": "whole grid", "impacts": "whole grid",
                           "radii": "real k", "scale": "finite ns", "speeds?": "real grid"},
                  grid=grid.shape, k=len(header["attractors"]), ns=scene_of(system).ns)
        attractors = unpacked(header["attractors"], arrays, elements=elements)
        return cls(system, grid, arrays["labels"],
                   tuple(attractors), arrays["states"], arrays["periods"], arrays["impacts"],
                   tuple(float(radius) for radius in arrays["radii"]), arrays["scale"],
                   LabelNoise.from_record(header["noise"]), header["options"], header["key"],
                   arrays.get("speeds", np.empty(0)), Section(**header["section"]) if "section" in header else None)

    @checked()
    def save(self, path) -> None:
        """Write the map to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        shares = ", ".join(f"{self.fractions[label]:.4f}" for label in range(len(self.attractors)))
        return (f"BasinMap({' x '.join(map(str, self.labels.shape))} cells, {len(self.attractors)} attractors: {shares or 'none'}, "
                f"unresolved {self.fractions[-1]:.4f}, label noise {self.label_uncertainty:.1e})")
