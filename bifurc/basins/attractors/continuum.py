"""Continua of orbits: a slider that never slips may stand anywhere in an interval, and each place gives another orbit.

As a whole they are one attractor; of each member the multiplier along the others is 1.
"""
import functools

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from ...orbits.orbit import PeriodicOrbit
from ...orbits.solving import solve

FIRST, LEAST, TRIALS = 1e-2, 1e-9, 80  # of the size of a state: steps along a continuum, and how many
NODES = (9, 17, 33, 65)  # of the interpolation
EXACT = 0.1  # of the distance of two members: how well they are interpolated


class Continuum:
    """The orbits with the event sequence of one of them, by the memory that labels them.

    Parameters
    ----------
    orbit : PeriodicOrbit
        With one state in its `family`, a memory.

    Attributes
    ----------
    place : int
        The state that labels the members.
    low, high : float
        Values between which they have this sequence, own unit.
    """

    def __init__(self, orbit: PeriodicOrbit):
        (self.place,), self.known = orbit.family, {}
        self.known[self.value(orbit)] = orbit
        self.low, self.high = (self._edge(orbit, way) for way in (-1.0, 1.0))

    def value(self, orbit: PeriodicOrbit) -> float:
        """Return the label of an orbit."""
        return float(orbit.state[self.place])

    def member(self, value: float) -> PeriodicOrbit | None:
        """Return the stable orbit with this label, or None."""
        if value not in self.known:
            found = relabelled(self.known[min(self.known, key=lambda at: abs(at - value))], [value])
            if found is None:
                return None
            self.known[value] = found
        return self.known[value]

    def _edge(self, orbit: PeriodicOrbit, way: float) -> float:
        """Return the last label of a member on one side."""
        size = float(orbit.weights[self.place])
        value, step = self.value(orbit), FIRST * size
        for _ in range(TRIALS):
            if step < LEAST * size:
                break
            if self.member(value + way * step) is None:
                step *= 0.25
            else:
                value, step = value + way * step, 1.5 * step
        return value

    @functools.cached_property
    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Labels (N,) of members and their section points (N, k, ns), between which polynomials tell the others."""
        for count in NODES:
            values = 0.5 * (self.low + self.high) - 0.5 * (self.high - self.low) * np.cos(np.pi * np.arange(count) / (count - 1))
            values[0], values[-1] = self.low, self.high
            kept = [(value, found.sections) for value in values if (found := self.member(float(value))) is not None]
            labels, points = np.array([value for value, _ in kept]), np.array([sections for _, sections in kept])
            middles = 0.5 * (labels[1:] + labels[:-1])[::max(1, len(labels) // 8)]
            missed = [np.abs(found.sections - BarycentricInterpolator(labels, points)(value)).max() for value in middles
                      if (found := self.member(float(value))) is not None]
            self.error = max(missed, default=0.0)
            if self.error <= 1e-8 * float(np.abs(points).max()):
                break
        return labels, points

    def points(self, apart: float, scale: np.ndarray, most: int) -> tuple[np.ndarray, float]:
        """Return section points (n, ns) of members, ``apart`` from one to the next (scaled) or so far that ``most`` are enough, and
        that distance."""
        labels, points = self.nodes
        length = float(np.linalg.norm(np.diff(points / scale, axis=0), axis=2).sum(axis=0).max())
        apart = max(apart, length / most)
        if length == 0.0 or self.error > EXACT * apart * float(scale.min()):
            return points.reshape(-1, points.shape[2]), apart
        members = BarycentricInterpolator(labels, points)(np.linspace(labels[0], labels[-1], int(np.ceil(length / apart)) + 1))
        return members.reshape(-1, points.shape[2]), apart


def relabelled(orbit: PeriodicOrbit, values) -> PeriodicOrbit | None:
    """Return the stable orbit with the event sequence of one and other ``values`` of the states of its `family`, or None."""
    rows = np.reshape(orbit.unknowns, (len(orbit.sequence.nodes), -1)).copy()
    rows[:, 1:] = orbit.labels.moved(rows[:, 1:], values)
    found = solve(orbit.system, orbit.sequence, rows.ravel(), orbit.weights, orbit.how)
    return found if found.success and found.stable else None


def continuum(attractor) -> Continuum | None:
    """Return the continuum of an orbit whose label is one memory; None for others."""
    if not isinstance(attractor, PeriodicOrbit) or not attractor.success or not attractor.stable:
        return None
    return _made(attractor) if len(attractor.family) == 1 and attractor.family[0] >= 2 * attractor.system.n else None


_made = functools.lru_cache(maxsize=256)(Continuum)
