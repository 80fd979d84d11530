"""Special points made from closed forms, true or moved, for certificates to judge."""
import numpy as np

from bifurc.compose.scene import scene_of
from bifurc.continuation import SpecialPointKind
from bifurc.continuation.branches.special import SpecialPoint
from bifurc.continuation.kinds import LocationStatus
from bifurc.continuation.shooting.problem import OrbitProblem
from bifurc.orbits.shooting.path import parameter_path
from bifurc.orbits.shooting.signature import Signature, divided, sections
from tests.certify.orbits_made import random_cases, system_of
from tests.reference import one_stop
from tests.reference.oscillator import Oscillator


def point_of(system, signature, unknowns, kind, force) -> SpecialPoint:
    """A special point of the oscillator with one stop along its load."""
    name = system.parameter_name("amplitude")
    path = parameter_path(scene_of(system), system, name, (0.5 * force, 1.5 * force))
    x = np.append(unknowns, force)
    problem = OrbitProblem(system, path, signature, np.ones(2), x, force)
    return SpecialPoint(SpecialPointKind(kind), force, 0.0, 0.0, (0.0, 0.0), x, np.zeros(x.size), LocationStatus.LOCATED,
                        problem=problem)


def folds_and_flips(count, seed):
    """Yield (closed form of the load, point) of folds and flips, formal or not."""
    found = 0
    for zeta, omega, _, gap, r, n in random_cases(10**6, seed):
        zeta = 0.02 + zeta
        for kind, (force, v) in one_stop.special_forces(zeta, omega, gap, r, n).items():
            if not (0.02 < float(v) < 20.0 and 0.02 < float(force) < 50.0) or found == count:
                continue
            found += 1
            time = one_stop.impact_time(Oscillator(zeta, omega, force), one_stop.number(gap), one_stop.number(r), n, v)
            system = system_of(zeta, omega, float(force), gap, r)
            scene = scene_of(system)
            mode = scene.index(("always", "free"))
            signature = Signature(divided(scene, np.array([[mode, 0, mode, 0, 0]])), np.zeros(1), float(n))
            yield force, point_of(system, signature, [float(time) / system.period, gap, float(v)], kind, float(force))
        if found == count:
            return


def grazings(count, seed):
    """Yield (closed form of the load, point) where the free motion touches the stop."""
    found = 0
    for zeta, omega, _, gap, r, _ in random_cases(10**6, seed):
        if abs(gap) < 0.05 or gap < 0.0:
            continue
        force = one_stop.grazing_force(zeta + 0.02, omega, gap)
        system = system_of(zeta + 0.02, omega, float(force), gap, r)
        scene = scene_of(system)
        answer = Oscillator(zeta + 0.02, omega, 1).receptance * force
        state = [0.0, float(answer.real), float(-omega * answer.imag)]
        signature = sections(scene.index(("always", "free")), 1.0)
        found += 1
        yield force, point_of(system, signature, state, "grazing", float(force))
        if found == count:
            return


def moved(point: SpecialPoint, shift: float) -> SpecialPoint:
    """The point at a load that is wrong by a share of it."""
    x = point.x.copy()
    x[-1] *= 1.0 + shift
    return SpecialPoint(point.kind, float(x[-1]), 0.0, 0.0, (0.0, 0.0), x, point.tangent, point.status, problem=point.problem)


