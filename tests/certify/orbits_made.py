"""Orbits made from closed forms, true or formal, for certificates to judge."""
import numpy as np

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.orbits.orbit import PeriodicOrbit
from bifurc.orbits.shooting.signature import Signature, divided


def one_impact(system, time, speed, periods, gap) -> PeriodicOrbit:
    """The orbit of an oscillator with one stop that hits it at ``time`` with ``speed`` once in ``periods``."""
    scene = scene_of(system)
    mode = scene.index(("always", "free"))
    nodes = divided(scene, np.array([[mode, 0, mode, 0, 0]]))
    unknowns = np.array([float(time) / system.period, float(gap), float(speed)])
    size = max(1.0, abs(gap), abs(float(speed)))
    return PeriodicOrbit(system, Signature(nodes, np.zeros(1), float(periods)), unknowns, np.full(2, size))


def random_cases(count, seed):
    """Parameters that nobody tuned for: zeta, omega, force, gap, restitution, periods."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield (float(rng.uniform(0.0, 0.4)), float(rng.uniform(0.4, 4.0)), float(np.exp(rng.uniform(-1.5, 2.5))),
               float(rng.uniform(-0.5, 1.5)), float(rng.uniform(0.05, 1.0)), int(rng.choice([1, 1, 2, 3])))


def system_of(zeta, omega, force, gap, restitution):
    """The impact oscillator of a case."""
    return bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=gap, restitution=restitution)
