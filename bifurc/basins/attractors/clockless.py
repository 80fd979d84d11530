"""Attractors of systems without excitation: states of rest, orbits whose period is part of the solution, and chaos."""
import numpy as np

from ...compose.scene import scene_of
from ...ensemble.integrator import Integrator
from ...ensemble.section import Section
from ...ensemble.section_integrator import SectionIntegrator
from ...flow.simulate import simulate
from ...orbits.autonomous import distance_to, from_motion, returns, slowest
from ...orbits.equilibria.equilibrium import Equilibrium, find_equilibrium
from ...orbits.lyapunov import lyapunov_exponents
from ...system import System

TURNS = 24  # natural periods between attempts
ATTEMPTS = 6
NEAR = 0.03  # scaled distance of the settled motion from the attractor that is accepted for it
EXPONENT_TURNS = 1000
EVENTS = 100_000  # of one simulation
MEMBERS = 10_000  # of a continuum that kernels compare with


def integrator_of(system: System, limit: int, section: Section | None):
    """Return what labels starts: at whole forcing periods, or where motions pass the section."""
    scene = scene_of(system)
    return Integrator(scene, limit) if section is None else SectionIntegrator(scene, limit, section, slowest(scene))


def required(system: System, section, what: str) -> Section | None:
    """Return the section on which motions of a system are compared; None: phase 0 of its excitation.

    Raises
    ------
    ValueError
        A section of a forced system, no section of another, or a component that it has not.
    """
    if system.period is not None:
        if section is not None:
            raise ValueError(f"section = {section!r} is not allowed; {system!r} has an excitation: its section is phase 0")
        return None
    if not isinstance(section, Section):
        raise ValueError(f"{system!r} is autonomous; {what} needs a section on which its motions are compared, such as "
                         f"section=bf.Section('v0', direction=-1), the maxima of q0 (section = {section!r} was given)")
    section.place(scene_of(system))
    return section


def section_of(orbit, section: Section) -> np.ndarray:
    """Return the states (k, ns) at which an orbit without a clock passes a section, in the order of time.

    Raises
    ------
    ValueError
        When it does not pass it.
    """
    motion = simulate(orbit.system, orbit.state, duration=1.75 * orbit.period, max_events=EVENTS)
    times, states = section.crossings(motion)
    inside = (times > 0.5 * orbit.period) & (times <= 1.5 * orbit.period)
    if not inside.any():
        raise ValueError(f"{section!r} is not passed by {orbit!r}; choose a section that all motions of interest pass, such as the "
                         "maxima of a coordinate")
    return states[inside]


def settles_on(system: System, y: np.ndarray, scale: np.ndarray):
    """Return the state of rest or the stable orbit on which a motion settles, or None, and where it ended (ns,)."""
    unit = slowest(scene_of(system))
    for _ in range(ATTEMPTS):
        motion = simulate(system, y, duration=TURNS * unit, max_events=EVENTS)
        if not motion.success:
            return None, None
        y = motion.final
        rest = find_equilibrium(system, y)
        if rest.success and rest.stable is not False and np.linalg.norm((rest.state - y) / scale) <= NEAR:
            return rest, y
        for orbit in from_motion(system, returns(motion, early=False), None, early=False):
            if orbit.success and orbit.stable and distance_to(orbit, y) <= NEAR:
                return orbit, y
    return None, y


def exponent_of(system: System, y: np.ndarray) -> tuple[float, float, float]:
    """Return the largest exponent of the motion from ``y``, its error, and over how long it was measured."""
    measured = lyapunov_exponents(system, y, periods=EXPONENT_TURNS, transient=0)
    return float(measured.values[0]), float(measured.errors[0]), EXPONENT_TURNS * slowest(scene_of(system))


def crossings_from(system: System, y: np.ndarray, section: Section, count: int) -> np.ndarray | None:
    """Return ``count`` states at which the motion from ``y`` passes the section, or None when it fails or does so no more."""
    unit, pieces, have = slowest(scene_of(system)), [], 0
    while have < count:
        motion = simulate(system, y, duration=10 * TURNS * unit, max_events=10 * EVENTS)
        states = section.crossings(motion)[1]
        if not motion.success or not len(states):
            return None
        pieces.append(states)
        have, y = have + len(states), motion.final
    return np.concatenate(pieces)[:count]


def members(rest: Equilibrium, radius: float, scale: np.ndarray) -> np.ndarray:
    """Return the states (k, ns) of an equilibrium, or of those of its continuum so near to each other that none is missed."""
    if not rest.intervals:
        return rest.state[None]
    (place, (low, high)), = rest.intervals.items()
    if not np.isfinite(high - low):
        return rest.state[None]
    direction = rest.continuum[0] / rest.continuum[0][place]
    count = int(np.clip(np.ceil((high - low) / (radius * scale[place])) + 1, 2, MEMBERS))
    return rest.state + (np.linspace(low, high, count) - rest.state[place])[:, None] * direction
