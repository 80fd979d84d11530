"""Orbits of a given event sequence: its equations solved, and what is reported of the result."""
import numpy as np

from ..compose.pieces import FORCE
from ..compose.scene import scene_of
from ..compose.writer import difference_error, differenced
from ..system import System
from .kinds import OrbitStatus
from .orbit import PeriodicOrbit
from .shooting.equations import TOLERANCE, Equations
from .shooting.path import constant_path
from .shooting.signature import Signature

DIFFERENCED = 17  # states of an orbit at which the error of differenced derivatives is estimated


def solve(system: System, signature: Signature, unknowns, weights, how) -> PeriodicOrbit:
    """Return the orbit of an event signature near ``unknowns``, by Newton at fixed parameters."""
    scene = scene_of(system)
    equations = Equations(scene, constant_path(scene, system), signature, weights)
    tangent = np.zeros(equations.size + 1)
    tangent[-1] = 1.0
    status, x, _, info = equations.correct(np.append(unknowns, 0.0), tangent, False)
    how = {"method": "event sequence, Newton", "tolerance": TOLERANCE, "iterations": int(info[0]), **how}
    if differenced(scene.laws):
        how["differenced Jacobians"] = list(differenced(scene.laws))
    if status != 1:
        return PeriodicOrbit(system, signature, unknowns, weights, how, OrbitStatus.NOT_CONVERGED)
    found = PeriodicOrbit(system, signature, x[:-1], weights, how)
    if differenced(scene.laws):
        found.how["error of differenced Jacobians"] = error_of_differences(found)
    return found


def error_of_differences(orbit: PeriodicOrbit) -> float:
    """Return the largest relative error, as estimated along the orbit, of derivatives that laws do not give themselves."""
    scene = orbit.scene
    t, y = orbit.sample(DIFFERENCED)
    joined = np.hstack([y, scene.forcing(t)])
    T, worst, row = scene.tables, 0.0, 0
    for law in scene.laws:
        rows = slice(row, row + law.rows)
        if law.law.jacobian is None and law.stage == FORCE and not law.curved:
            worst = max(worst, difference_error(law, np.hstack([joined @ T.LU[rows].T, joined @ T.LS[rows].T])))
        row += law.rows
    return worst
