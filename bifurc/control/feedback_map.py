"""What `feedback_basins` returns: which starts end on the orbit, and the motions on which others end."""
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from .. import io, plotting
from ..basins.maps.labelled import LabelledStarts
from ..checks import checked
from ..content import Content
from ..ensemble.grid import Grid
from ..ensemble.outcomes import CellState
from ..motion import Motion
from ..orbits.orbit import PeriodicOrbit
from ..system import System

KIND = "feedback basins"


@dataclass(frozen=True, eq=False)
class HeldMotion(Content, Motion):
    """A periodic motion under feedback that is not the orbit.

    Attributes
    ----------
    points : ndarray (periods, ns)
        States at whole forcing periods.
    periods : int
    """

    points: np.ndarray = field(repr=False)
    periods: int

    @property
    def regime(self) -> str:
        """Its period; its events are not known."""
        return f"period {self.periods}"

    @property
    def sections(self) -> np.ndarray:
        """The points."""
        return self.points


@dataclass(frozen=True, eq=False)
class FeedbackBasins(Content, LabelledStarts):
    """Which starts end on the orbit under delayed feedback.

    Attributes
    ----------
    system : System
        With its feedback.
    orbit : PeriodicOrbit
        Label 0.
    grid : Grid
    past : str
        "free", "constant" or "orbit".
    labels : ndarray of int, shape of the grid
        0 the orbit, k > 0 ``attractors[k]``, -1 neither.
    states : ndarray of int, shape of the grid
        Codes of `CellState`.
    periods : ndarray of int, shape of the grid
        Forcing periods until that was known.
    attractors : tuple
        The orbit, and other periodic motions that were met (`HeldMotion`).
    key : str
        Of the job in its file.
    """

    system: System = field(repr=False)
    orbit: PeriodicOrbit = field(repr=False)
    grid: Grid
    past: str
    labels: np.ndarray = field(repr=False)
    states: np.ndarray = field(repr=False)
    periods: np.ndarray = field(repr=False)
    attractors: tuple = field(repr=False)
    key: str = field(default="", repr=False)

    @property
    def fractions(self) -> dict[int, float]:
        """Share of the starts that end on each attractor; starts beyond a stop are none."""
        starts = max(int(np.count_nonzero(self.states != CellState.OUTSIDE.code)), 1)
        return {k: float(np.count_nonzero(self.labels == k)) / starts for k in range(len(self.attractors))}

    @property
    def held(self) -> float:
        """Share of the starts that end on the orbit."""
        return self.fractions[0]

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        orbit, stored = self.orbit.to_record()
        others = self.attractors[1:]
        arrays = {"labels": self.labels, "states": self.states, "periods": self.periods,
                  "points": np.array([row for other in others for row in other.points]).reshape(-1, self.orbit.state.size),
                  "counts": np.array([other.periods for other in others], np.int64),
                  **{f"orbit.{name}": values for name, values in stored.items()}}
        return {"kind": KIND, "system": self.system.to_record(), "orbit": orbit, "grid": self.grid.to_record(), "past": self.past,
                "key": self.key}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "FeedbackBasins":
        """Make the map that `to_record` described; ``elements`` are user classes and laws."""
        grid = Grid.from_record(header["grid"])
        orbit = PeriodicOrbit.from_record(header["orbit"], io.part(arrays, "orbit."), elements)
        io.fitted(arrays, {"labels": "whole grid", "states": "whole grid", "periods": "whole grid", "counts": "whole k",
                           "points": "finite all ns"}, grid=grid.shape, all=int(arrays["counts"].sum()), ns=orbit.state.size)
        parts = np.split(arrays["points"], np.cumsum(arrays["counts"])[:-1]) if arrays["counts"].size else []
        return cls(System.from_record(header["system"], elements), orbit, grid, header["past"],
                   arrays["labels"], arrays["states"], arrays["periods"], (orbit, *(HeldMotion(part, len(part)) for part in parts)),
                   header["key"])

    @checked()
    def save(self, path) -> None:
        """Write the map to an npz file."""
        io.write(path, *self.to_record())

    @classmethod
    @checked()
    def load(cls, path, elements=()) -> "FeedbackBasins":
        """Read a map that `save`, or `feedback_basins` with ``file=``, has written."""
        return io.made(path, partial(cls.from_record, elements=elements), *io.read(path, KIND))

    @checked()
    def plot(self, ax=None):
        """Draw the map; return the axes."""
        return plotting.plot_basins(self, ax)
