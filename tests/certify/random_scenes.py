"""Random scenes with every kind of contact, and the orbits that the package finds in them."""
import numpy as np

import bifurc as bf
from bifurc import System
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop


def _impact(rng):
    return System(1.0, float(rng.uniform(0.05, 0.4)), 1.0,
                  [HarmonicForce(float(rng.uniform(0.3, 2.0))),
                   RigidStop(float(rng.uniform(0.0, 1.0)), float(rng.uniform(0.2, 0.9)))],
                  omega=float(rng.uniform(0.6, 2.5)))


def _impacts_of_masses(rng):
    n = int(rng.integers(2, 5))
    link = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K = link * float(rng.uniform(0.5, 2.0)) + 0.5 * np.eye(n)
    return System(np.diag(rng.uniform(0.5, 2.0, n)), 0.05 * K + 0.05 * np.eye(n), K,
                  [HarmonicForce(float(rng.uniform(0.5, 2.0)), dof=int(rng.integers(n))),
                   RigidStop(float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.2, 0.9)), dof=int(rng.integers(n)))],
                  omega=float(rng.uniform(0.5, 2.5)))


def _elastic(rng):
    return System(1.0, float(rng.uniform(0.05, 0.4)), 1.0,
                  [HarmonicForce(float(rng.uniform(0.3, 2.0))),
                   ElasticStop(float(rng.uniform(0.0, 1.0)), float(rng.uniform(1.0, 20.0)), damping=float(rng.choice([0.0, 0.3])))],
                  omega=float(rng.uniform(0.5, 2.5)))


def _dry(rng):
    return System(1.0, float(rng.uniform(0.05, 0.4)), 1.0,
                  [HarmonicForce(float(rng.uniform(0.5, 2.0))),
                   Coulomb(float(rng.uniform(0.1, 0.8)), static_ratio=float(rng.choice([1.0, 1.2])))],
                  omega=float(rng.uniform(0.2, 2.0)))


def _slider(rng):
    return System(1.0, float(rng.uniform(0.05, 0.4)), 1.0,
                  [HarmonicForce(float(rng.uniform(0.5, 2.0))),
                   Jenkins(float(rng.uniform(0.5, 4.0)), float(rng.uniform(0.1, 0.8)))],
                  omega=float(rng.uniform(0.3, 2.0)))


KINDS = {"rigid stop": _impact, "stop on several masses": _impacts_of_masses, "elastic stop": _elastic, "dry friction": _dry,
         "elastic slider": _slider}


def orbits(kind, count, seed):
    """Yield audited orbits of random scenes of a kind; complete chattering, which is refused by name, is left out."""
    rng = np.random.default_rng(seed)
    found = 0
    while found < count:
        orbit = bf.find_orbit(KINDS[kind](rng))
        if not orbit.success or "..." in orbit.signature:
            continue
        found += 1
        yield orbit
