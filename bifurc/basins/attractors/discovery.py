"""Attractors of a basin map: looked for where motions end, numbered, and given the radius in which they are recognised."""
import numpy as np

from ...ensemble.integrator import Integrator, Targets
from ...ensemble.outcomes import REACHED, UNSETTLED
from ...ensemble.section_integrator import SectionIntegrator
from ...orbits.equilibria.equilibrium import Equilibrium
from ...system import System
from .attractors import SampledAttractor, distance, examine, same, section_points, targets_of

SHELL = 8  # starts around each section point that must come back to it
ASKED = 4  # starts of a shell that did not come back in time, whose ends are examined
SHRINK = 4.0  # of a radius whose shell did not
COMES_BACK = 0.1  # of the radius is where the shell must arrive
LEAST = 1e-9  # scaled radius
TRANSIENT = 200  # forcing periods before the end of a motion is examined
FAILURES = 6  # ends that are no new attractor before the rest is left unsettled


class Discovery:
    """Confirmed attractors, growing.

    Parameters
    ----------
    system : System
    integrator : Integrator or SectionIntegrator
    scale : ndarray
        Sizes (ns,) of the states.
    options : dict
        seed, tolerance, max_periods.
    known : list
        Attractors that are given; they keep the first numbers.

    Attributes
    ----------
    attractors : list of PeriodicOrbit and SampledAttractor
    radii : list of float
        Scaled.
    seeds : list of ndarray
        States from which those not given were found: the same states give the same attractors.
    """

    def __init__(self, system: System, integrator: Integrator | SectionIntegrator, scale: np.ndarray, options: dict, known: list):
        self.system, self.integrator, self.scale, self.options = system, integrator, scale, options
        self.most, self.section = options["max_periods"], integrator.section
        self.attractors: list = []
        self.radii: list[float] = []
        self.seeds: list[np.ndarray] = []
        self.given = len(known)
        for item in known:
            self._admit(item)

    def targets(self) -> Targets:
        """Return the attractors as the kernels see them."""
        return targets_of(self.attractors, self.radii, self.scale, self.section)

    def repeat(self, seeds: np.ndarray) -> None:
        """Find again what an earlier run found from the states ``seeds`` (k, ns)."""
        for y in seeds:
            self._admit(examine(self.system, y, self.scale, self.section), y)

    def search(self, starts: np.ndarray) -> None:
        """Examine the ends of motions that come near no known attractor, one after the other."""
        left, failures = starts, 0
        while len(left) and failures < FAILURES:
            ends = left.copy()
            found = self.integrator.label(ends, self.targets(), min(self.most, TRANSIENT))
            away = np.flatnonzero(found.states == UNSETTLED)
            left, ends = left[away], ends[away]
            while len(left) and failures < FAILURES:
                attractor = examine(self.system, ends[0], self.scale, self.section)
                new = attractor is not None and self._admit(attractor, ends[0])
                left, ends = left[1:], ends[1:]
                if new:
                    break
                failures += 1

    def _admit(self, attractor, y=None) -> bool:
        """Give a confirmed attractor its number and radius; return False when it is known."""
        if any(same(item, attractor, self.scale, self.section) for item in self.attractors):
            return False
        self.attractors.append(attractor)
        self.radii.append(self.options["tolerance"])
        if not isinstance(attractor, SampledAttractor):
            self._shrink(attractor)
        if y is not None:
            self.seeds.append(np.array(y))
        return True

    def _shrink(self, orbit) -> None:
        """Make the radius of the last attractor so small that a shell of it around each section point comes back."""
        rng = np.random.default_rng([self.options["seed"], 2, len(self.attractors)])
        points = np.repeat(section_points(orbit, self.section) / self.scale, SHELL, axis=0)
        away = rng.normal(size=points.shape)
        away /= np.linalg.norm(away, axis=1)[:, None]
        own = len(self.attractors) - 1
        while self.radii[own] > LEAST:
            radii = [*self.radii[:own], COMES_BACK * self.radii[own]]
            shell = (points + self.radii[own] * away) * self.scale
            found = self.integrator.label(shell, targets_of(self.attractors, radii, self.scale, self.section), self.most)
            gone = (found.states == REACHED) & (found.labels != own)
            unsettled = np.flatnonzero(found.states == UNSETTLED)
            for i in unsettled:  # slow is allowed, farther is not
                gone[i] = distance(section_points(orbit, self.section) / self.scale, shell[i] / self.scale) > self.radii[own]
            for i in unsettled[~gone[unsettled]][:ASKED]:  # and settled beside it is not slow: another attractor lies in the shell
                other = examine(self.system, shell[i], self.scale, self.section)
                gone[i] = other is not None and not same(orbit, other, self.scale, self.section)
            if not gone.any():
                return
            self.radii[own] /= SHRINK

    def order(self) -> list[int]:
        """Return the order of the numbers: those given first, then by period, impacts and size; chaotic ones last."""
        def rank(i: int):
            item = self.attractors[i]
            if isinstance(item, SampledAttractor):
                return (1, 0, 0, 0.0)
            middle = section_points(item, self.section).mean(axis=0)[0] / self.scale[0]
            if isinstance(item, Equilibrium):
                return (0, 0, 0, round(float(middle), 6))
            return (0, item.periods, len(item.events), round(float(middle), 6))
        given = list(range(self.given))
        return given + sorted(range(self.given, len(self.attractors)), key=rank)
