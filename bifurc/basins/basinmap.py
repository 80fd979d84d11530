"""BasinMap: labels of a grid of starts, the attractors behind them, and how far the labels can be trusted."""
from dataclasses import dataclass, field

import numpy as np

from ..orbits.orbit import PeriodicOrbit
from ..system import System
from .attractors import ChaoticAttractor
from .grid import Grid
from .noise import LabelNoise
from .states import CellState


@dataclass(frozen=True, eq=False)
class BasinMap:
    """Which start leads to which attractor.  Made by `basins_of_attraction`.

    Attributes
    ----------
    system : System
    grid : Grid
    labels : ndarray of int
        Number of the attractor of each cell (axis 0: first component of the grid), -1 where there is none; `states`
        says why.
    attractors : tuple of PeriodicOrbit and ChaoticAttractor
        Confirmed; label k is ``attractors[k]``.
    states : ndarray of int
        Code of the `CellState` of each cell.
    periods, impacts : ndarray of int
        Forcing periods, and impacts with rigid or contacts with elastic stops, until the motion was within `radii` of
        its attractor; a completed infinite sequence counts once from where it was closed.
    radii : tuple of float
        Distance, in units of ``scale``, at which a section point counts as on its attractor.
    scale : ndarray
        Sizes (ns,) of the states that distances are measured with.
    noise : LabelNoise
    options : dict
        seed, tolerance, max_periods, max_events.
    """

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
    def fractions(self) -> dict[int, float]:
        """Share of each label among the cells that are starts (not beyond a rigid stop); -1: unresolved."""
        starts = self.states != CellState.OUTSIDE.code
        total = max(int(np.count_nonzero(starts)), 1)
        return {label: int(np.count_nonzero((self.labels == label) & starts)) / total
                for label in [*range(len(self.attractors)), -1]}

    @property
    def label_uncertainty(self) -> float:
        """Predicted fraction of labels that rounding could change, see `LabelNoise`."""
        return self.noise.at_rounding

    def report(self) -> str:
        """Return attractors, fractions and label noise as text."""
        lines = [f"{self.grid!r}, {self.system!r}"]
        counts = self.counts
        for label, attractor in enumerate(self.attractors):
            lines.append(f"{label:>4} {self.fractions[label]:>10.6f}  {attractor!r}")
        lines.append(f"{-1:>4} {self.fractions[-1]:>10.6f}  unresolved")
        lines += [f"     {counts[state]:>10d}  cells: {state.sentence}" for state in CellState if state in counts]
        noise = self.noise
        measured = ", ".join(f"{f:.2g} at {e:.0e}" for e, f in zip(noise.perturbations, noise.changed, strict=True))
        lines.append(f"labels changed by perturbations: {measured or 'not measured'} ({noise.samples} starts)")
        lines.append(f"uncertainty exponent {noise.exponent:.3f} +- {noise.exponent_error:.3f}; predicted fraction of "
                     f"untrustworthy labels {noise.at_rounding:.1e}")
        return "\n".join(lines)

    def plot(self, ax=None):
        """Draw the map with its attractors; return the axes."""
        from ..plotting import plot_basins

        return plot_basins(self, ax)

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        headers = []
        arrays = {"labels": self.labels, "states": self.states, "periods": self.periods, "impacts": self.impacts,
                  "radii": np.array(self.radii, float), "scale": self.scale}
        for number, attractor in enumerate(self.attractors):
            header, mine = attractor.to_record()
            headers.append(header)
            arrays |= {f"attractor_{number}_{name}": values for name, values in mine.items()}
        header = {"kind": "basins", "system": self.system.to_record(), "grid": self.grid.to_record(),
                  "attractors": headers, "noise": self.noise.to_record(), "options": self.options, "key": self.key}
        return header, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "BasinMap":
        """Make the map that `to_record` described; ``elements`` are user classes and laws."""
        attractors = []
        for number, mine in enumerate(header["attractors"]):
            start = f"attractor_{number}_"
            content = {name.removeprefix(start): values for name, values in arrays.items() if name.startswith(start)}
            reader = ChaoticAttractor if mine["kind"] == "chaotic_attractor" else PeriodicOrbit
            attractors.append(reader.from_record(mine, content, elements))
        return cls(System.from_record(header["system"], elements), Grid.from_record(header["grid"]), arrays["labels"],
                   tuple(attractors), arrays["states"], arrays["periods"], arrays["impacts"],
                   tuple(float(radius) for radius in arrays["radii"]), arrays["scale"],
                   LabelNoise.from_record(header["noise"]), header["options"], header["key"])

    def save(self, path) -> None:
        """Write the map to an npz file."""
        from .. import io

        io.write(path, *self.to_record())

    def __repr__(self):
        shares = ", ".join(f"{self.fractions[label]:.4f}" for label in range(len(self.attractors)))
        across, up = self.labels.shape
        return (f"BasinMap({across} x {up} cells, {len(self.attractors)} attractors: {shares or 'none'}, "
                f"unresolved {self.fractions[-1]:.4f}, label noise {self.label_uncertainty:.1e})")
