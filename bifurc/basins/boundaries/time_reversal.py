"""A system seen backwards in time, where its motion has one past: y(-t) of a motion y(t) is a motion of it.

With q(-t) dampers push, phases change sign, and an impact gives back what it took: restitution r becomes 1/r (M. di
Bernardo et al., Piecewise-smooth Dynamical Systems, 2008, section 2.3).  Rest on a stop and dry friction have many pasts.
"""
import dataclasses
from dataclasses import dataclass

import numpy as np

from ...compose.scene import scene_of
from ...elements import (
    BaseMotion,
    ConstantForce,
    CubicSpring,
    ElasticStop,
    HarmonicForce,
    LinearSpring,
    PolynomialSpring,
    RigidStop,
)
from ...elements.stops import Wall
from ...ensemble.integrator import Images
from ...ensemble.outcomes import CellState
from ...ensemble.period_map import MAPPED, Kernel, PeriodMap
from ...system import System

UNDONE = 1e-6  # scaled distance from its start of a state carried back and forth, above which the past was not the only one
WINDOW = 1.5  # of its sides by which a region is widened on each side before a motion counts as gone


@dataclass(frozen=True)
class _Rebound(RigidStop):
    """A rigid stop seen backwards: any restitution above 0."""

    def __post_init__(self):
        Wall.__post_init__(self)


@dataclass(frozen=True)
class _Push(ElasticStop):
    """An elastic stop seen backwards: damping of any sign."""

    def __post_init__(self):
        Wall.__post_init__(self)


def reversed_system(system: System) -> System:
    """Return the system whose motions are those of ``system`` backwards.

    Raises
    ------
    ValueError
        When an element lets motions merge, or is none whose past is known; the message names it.
    """
    return System(system.mass, 0.0 - system.damping, system.stiffness, tuple(_reversed(element) for element in system.elements),
                  omega=system.omega)


def _reversed(element):
    """Return an element seen backwards."""
    kind = type(element)
    if kind in (ConstantForce, CubicSpring, PolynomialSpring):
        return element
    if kind is LinearSpring:
        return dataclasses.replace(element, damping=0.0 - element.damping)
    if kind in (HarmonicForce, BaseMotion):
        return dataclasses.replace(element, phase=0.0 - element.phase)
    values = {field.name: getattr(element, field.name) for field in dataclasses.fields(element)} if kind in (
        RigidStop, ElasticStop) else {}
    if values:
        values["phase"] = 0.0 - element.phase
    if kind is RigidStop and element.restitution > 0.0:
        return _Rebound(**{**values, "restitution": 1.0 / element.restitution})
    if kind is ElasticStop and element.release == "penetration":
        return _Push(**{**values, "damping": 0.0 - element.damping})
    raise ValueError(f"{element!r} has no motion backwards: different pasts may lead to one state, or its law is not known to be "
                     "free of them; the boundary of basins is seen in the map itself")


class Backwards:
    """Carries section points back over whole forcing periods: the inverse of the period map where there is one.

    Parameters
    ----------
    forward : PeriodMap
    scale : ndarray
        Sizes (ns,) of the states.
    low, high : ndarray
        Region (ns,) that is of interest; infinite where all is.

    Raises
    ------
    ValueError
        See `reversed_system`.
    """

    def __init__(self, forward: PeriodMap, scale: np.ndarray, low: np.ndarray, high: np.ndarray):
        self.forward, self.scale = forward, scale
        system = reversed_system(forward.system)
        steps = forward.steps if forward.kernel is Kernel.SMOOTH else None
        self.map = PeriodMap(scene_of(system), max_events=forward.max_events, steps=steps)
        self.turn = np.where(np.arange(scale.size) < forward.scene.n, 1.0, -1.0)
        margin = np.where(np.isfinite(high - low), WINDOW * (high - low), 0.0)
        self.low, self.high = low - margin, high + margin

    def apply(self, X: np.ndarray, periods: int = 1) -> Images:
        """Return where the motions through ``X`` (N, ns) were ``periods`` before.

        Other outcomes than `MAPPED`: outside, it left the region; inconsistent, what was found comes to rest on its way and does
        not lead back, the past is not unique; unsettled, it does not lead back for want of digits.
        """
        found = self.map.apply(X * self.turn, periods)
        ends, outcomes = found.ends * self.turn, found.outcomes.copy()
        with np.errstate(invalid="ignore"):
            gone = ~((ends >= self.low) & (ends <= self.high)).all(axis=1)
        outcomes[gone & (outcomes == MAPPED)] = CellState.OUTSIDE.code
        alive = np.flatnonzero(outcomes == MAPPED)
        if alive.size:
            again = self.forward.apply(ends[alive], periods)
            away = np.linalg.norm((again.ends - X[alive]) / self.scale, axis=1)
            wrong = (again.outcomes != MAPPED) | ~(away <= UNDONE)
            outcomes[alive[wrong]] = np.where(again.speeds[wrong] == 0.0, CellState.INCONSISTENT.code, CellState.UNSETTLED.code)
        return Images(ends, outcomes, found.impacts, found.speeds)
