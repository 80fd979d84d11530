"""Region: a box of starts over any components of the state, filled evenly and without a pattern."""
import math
from collections.abc import Mapping

import numpy as np

from ..checks import mapping, number, pair, refused
from ..compose.natural import natural_sizes
from ..compose.scene import Scene
from ..content import Content
from ..structure.components import named, place_of
from .initial_conditions import states_at


class Region(Content):
    """Starts within ranges of named components; all others are fixed.

    Parameters
    ----------
    ranges : mapping of str to (low, high)
        Such as ``{"q0": (-3, 1), "v0": (-4, 4)}``.
    at : mapping of str to float, optional
        Values of other components; those not named are 0, memory is that of the virgin state.

    Raises
    ------
    ValueError
        No range, unknown names, empty or infinite ranges.
    """

    def __init__(self, ranges: Mapping[str, tuple[float, float]], at: Mapping[str, float] | None = None):
        if not isinstance(ranges, Mapping) or not ranges:
            raise refused("", "region", ranges, "components and ranges of the start, such as {'q0': (-3, 1), 'v0': (-4, 4)}")
        self.ranges: dict[str, tuple[float, float]] = {}
        for name, value in mapping("", "region", ranges).items():
            named(name, "region")
            low, high = pair("region", name, value)
            if not (low < high and math.isfinite(high - low)):
                raise refused("region", name, value, "finite (low, high), and its low bound must be below its high bound")
            self.ranges[name] = low, high
        self.at = {name: number("at", name, value) for name, value in mapping("region", "at", {} if at is None else at).items()}
        for name in self.at:
            named(name, "at")
            if name in self.ranges:
                raise ValueError(f"region: at fixes {name}, which has a range")

    def _content(self) -> tuple:
        return tuple(self.ranges.items()), self.at

    def starts(self, scene: Scene, count: int, seed: int) -> np.ndarray:
        """Return starts (count, ns): the additive recurrence of M. Roberts (2018), of low discrepancy, with a seeded shift.

        The first k of a longer row are the row of k.
        """
        d, phi = len(self.ranges), 2.0
        for _ in range(60):  # the root of phi**(d + 1) = phi + 1
            phi = (1.0 + phi) ** (1.0 / (d + 1))
        steps = phi ** -np.arange(1.0, d + 1)
        unit = (np.random.default_rng(seed).random(d) + np.arange(1, count + 1)[:, None] * steps) % 1.0
        low, high = np.array(list(self.ranges.values())).T
        return states_at(scene, tuple(self.ranges), self.at, low + (high - low) * unit, "region")

    def sizes(self, scene: Scene) -> np.ndarray:
        """Return the sizes (ns,) of states that distances are measured with: one length, its velocity at omega."""
        n, omega = scene.n, float(scene.omega or 1.0)
        if n == 0:
            corners = states_at(scene, tuple(self.ranges), self.at, np.array(list(self.ranges.values())).T, "region")
            return natural_sizes(scene.tables, corners, 2.0 * np.pi / omega)
        length = 0.0
        for name, (low, high) in self.ranges.items():
            place = place_of(name, n, scene.ns, "region", scene.system.states)
            length = max(length, max(abs(low), abs(high)) / (omega if n <= place < 2 * n else 1.0))
        scale = np.full(scene.ns, length)
        scale[n:2 * n] *= omega
        return scale

    def to_record(self) -> dict:
        """Return the region as JSON knows it."""
        return {"ranges": {name: list(value) for name, value in self.ranges.items()}, "at": self.at}

    @classmethod
    def from_record(cls, record: dict) -> "Region":
        """Make the region that `to_record` described."""
        return cls(record["ranges"], record["at"])

    def __repr__(self):
        sides = ", ".join(f"{name}=({low:g}, {high:g})" for name, (low, high) in self.ranges.items())
        return f"Region({sides}{f', at={self.at}' if self.at else ''})"
