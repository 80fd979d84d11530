"""Least CPU times of scenes with straight contacts, as JSON; run as a file, so that any version of the package can be asked.

Only names that version 0.2.0 has, too, are used here; see `affine_cost`.
"""
import gc
import json
import sys
import time

import numpy as np

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce, RigidStop

MASS = np.diag([1.0, 1.44])
DAMPING = np.array([[0.11, -0.019], [-0.019, 0.11]])
STIFFNESS = np.array([[1.38, -0.38], [-0.38, 1.38]])
PERIODS = 400  # of a simulation
BOUNDS = {"impact": (0.5, 2.0), "bilinear": (0.5, 2.5), "Duffing": (0.5, 2.5)}


def branches(extra: float) -> dict:
    """Return systems whose branches are traced; ``extra`` is added to the load: a system that was not met before."""
    return {"impact": bf.systems.impact_oscillator(zeta=0.05, omega=0.5, amplitude=0.52 + extra, gap=1.0, restitution=0.7),
            "bilinear": bf.systems.bilinear_oscillator(zeta=0.05, omega=0.5, amplitude=0.3 + extra, gap=0.5, stiffness_ratio=5.0),
            "Duffing": bf.systems.duffing_oscillator(zeta=0.05, omega=0.5, amplitude=0.3 + extra)}


def motions(extra: float) -> dict:
    """Return systems that are simulated and whose orbits are found, as `branches`."""
    load = HarmonicForce(1.0 + extra)
    return {"impact": bf.systems.impact_oscillator(zeta=0.05, omega=1.0, amplitude=0.52 + extra, gap=1.0, restitution=0.7),
            "chatter": bf.System(1.0, 0.1, 1.0, [load, RigidStop(0.2, 0.3)], omega=0.6),
            "dry friction": bf.System(1.0, 0.05, 1.0, [load, Coulomb(0.4)], omega=0.5),
            "two masses, stop and friction": bf.System(MASS, DAMPING, STIFFNESS,
                                                       [load, RigidStop(0.5, 0.7, dof=0), Coulomb(0.1, dof=1)], omega=0.9)}


def least(call, rounds: int, prepare=lambda: None) -> float:
    """Return the least CPU milliseconds of ``rounds`` calls after one unmeasured, each on what ``prepare`` makes of nothing."""
    times = []
    for _ in range(rounds + 1):
        given = prepare()
        gc.collect()
        start = time.process_time()
        call(given)
        times.append(time.process_time() - start)
    return 1e3 * min(times[1:])


def measured(rounds: int, cells: int) -> dict[str, float]:
    """Return the least CPU milliseconds of every piece of work; maps have ``cells`` x ``cells`` starts."""
    found, count = {}, iter(range(10**9))

    def fresh(make, name):
        return make(1e-9 * next(count))[name]
    for name, system in motions(0.0).items():
        start = np.zeros(2 * len(np.atleast_2d(system.mass)))
        found[f"simulate, {name}"] = least(lambda _, s=system, y=start: bf.simulate(s, y, periods=PERIODS), rounds)
        found[f"find_orbit, {name}"] = least(bf.find_orbit, rounds, lambda name=name: fresh(motions, name))
    for name, bounds in BOUNDS.items():
        found[f"first branch, {name}"] = least(lambda orbit, b=bounds: bf.trace(orbit, "omega", bounds=b), rounds,
                                               lambda name=name: bf.find_orbit(fresh(branches, name)))
        orbit = bf.find_orbit(branches(0.0)[name])
        found[f"further branch, {name}"] = least(lambda _, o=orbit, b=bounds: bf.trace(o, "omega", bounds=b), rounds)
    grid = bf.Grid(q0=(-3.0, 1.0, cells), v0=(-4.0, 4.0, cells))
    for name, system in (("impact", branches(0.0)["impact"].with_parameters(omega=1.4)),
                         ("dry friction", motions(0.0)["dry friction"]),
                         ("bilinear", branches(0.0)["bilinear"].with_parameters(omega=0.9))):
        found[f"basin map, {name}"] = least(lambda _, s=system: bf.basins_of_attraction(s, grid), max(1, rounds // 4))
    return found


if __name__ == "__main__":
    gc.disable()
    sys.stdout.write(json.dumps(measured(int(sys.argv[1]), int(sys.argv[2]))))
