"""Free vibration without damping: the energy of a motion, and orbits of a given energy.

Orbits of a conservative system form families along their energy E.  The equations of an orbit are then redundant by one:
what they ask of the energy is kept anyway.  An artificial damping ``unfolding`` (an acceleration -unfolding w v, w a
natural rate) is added as an unknown, and E(y_0) = E as an equation; at a solution the damping is zero, for it would
change the energy (Munoz-Almaraz, Freire, Galan, Doedel and Vanderbauwhede 2003).  The system of equations is square and
regular again.
"""
import numpy as np

from ..checks import checked, state
from ..compose.natural import natural_rate
from ..compose.scene import Scene, scene_of
from ..flow.linear import ModeField
from ..solve.newton import newton
from ..system import System
from .shooting.equations import TOLERANCE, Equations
from .shooting.path import ParameterPath
from .shooting.sequence import BEFORE
from .shooting.signature import Signature

ASIDE = 1e-5  # artificial damping with which its derivatives are differenced, of a motion that amplifies nothing


def conservative(system: System) -> bool:
    """Whether free motions of a system keep their energy: no excitation, no damping (gyroscopic terms are allowed), symmetric
    stiffness, and elements that store all they take."""
    if system.omega is not None or not np.array_equal(system.stiffness, system.stiffness.T) \
            or not np.array_equal(system.damping, -system.damping.T):
        return False
    return all(element.stored_energy(np.full(len(element.site(system.n).R), 0.37)) is not None for element in system.elements)


@checked()
def energy(system: System, y) -> float:
    """Return the energy of a state: kinetic, of the linear springs, and what the elements store.

    Parameters
    ----------
    system : System
        One that keeps its energy.
    y : array_like (2 n,)
        Positions and velocities.

    Returns
    -------
    float
        In units of the system's stiffness times length squared.

    Raises
    ------
    ValueError
        Where an element stores no energy, or loses it.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.System(1.0, 0.0, 1.0, [bf.elements.ElasticStop(gap=1.0, stiffness=4.0)])
    >>> bf.energy(system, (2.0, 0.0))
    4.0
    """
    n = system.n
    q, v = np.split(state("y", y, (2 * n,)), 2)
    total = 0.5 * float(v @ system.mass @ v) + 0.5 * float(q @ system.stiffness @ q)
    for label, element in zip(system.labels, system.elements, strict=True):
        stored = element.stored_energy(element.site(n).R @ q)
        if stored is None:
            raise ValueError(f"the energy of {system!r} is not defined: {label} does not keep it")
        total += stored
    return float(total)


def unfolding_path(scene: Scene, system: System) -> ParameterPath:
    """Return the path along an artificial damping, an acceleration -unfolding w v of every coordinate with the natural rate w of
    the scene, zero at the system."""
    tables = scene.refill(system)
    modes, ns, nx = tables.A.shape
    places = [1 + (m * ns + scene.n + i) * nx + scene.n + i for m in range(modes) for i in range(scene.n)]
    index = np.array(places, np.int64)
    series = np.column_stack([tables.flat[index], np.full(index.size, -natural_rate(tables))])
    return ParameterPath(tables, "unfolding", index, series, -1.0, 1.0)


class EnergyEquations:
    """Equations of an orbit of given energy: unknowns (U, unfolding), parameter E.

    Parameters
    ----------
    system : System
        Conservative.
    signature : Signature
        With the period unknown.
    weights : ndarray (ns,)
        Natural sizes of the states.
    """

    def __init__(self, system: System, signature: Signature, weights):
        self.system, self.scene = system, scene_of(system)
        self.equations = Equations(self.scene, unfolding_path(self.scene, system), signature, weights)
        self.size = self.equations.size + 1
        v = np.asarray(weights, float)[self.scene.n:2 * self.scene.n]
        self.unit = 0.5 * float(v @ np.abs(system.mass) @ v)  # natural size of the energy
        self._field = ModeField(self.scene, self.equations.path.tables, int(self.equations.signature.nodes[0, BEFORE]))

    def residual(self, u, E) -> np.ndarray:
        """Return the scaled residual (size,) at ``u`` (size,) and the energy E."""
        below = self.equations.residual(u)
        return np.append(below, (energy(self.system, u[1:1 + self.scene.ns]) - E) / self.unit)

    def jacobian(self, u) -> np.ndarray:
        """Return the derivative (size, size) by the unknowns."""
        e, ns = self.equations, self.scene.ns
        J = np.zeros((self.size, self.size))
        J[:-1, :-1] = e.jacobian(u)
        own = np.abs(J[:-1, :-1] * e.scale[:-1]).max()  # in natural sizes of the states
        h = ASIDE / max(1.0, float(own))  # next to a saddle deviations grow: the differences stay in proportion
        above, below = u.copy(), u.copy()
        above[-1] += h
        below[-1] -= h
        J[:-1, -1] = (e.residual(above) - e.residual(below)) / (2.0 * h)
        J[-1, 1:1 + ns] = self.gradient(u[1:1 + ns]) / self.unit
        return J

    def gradient(self, y) -> np.ndarray:
        """Return the derivative (ns,) of the energy by the state just before the first node."""
        n, v = self.scene.n, y[self.scene.n:2 * self.scene.n]
        out = np.zeros(self.scene.ns)
        out[:n] = -self.system.mass @ self._field.rate(y)[n:2 * n] - self.system.damping @ v
        out[n:2 * n] = self.system.mass @ v
        return out


def corrected(system: System, signature: Signature, unknowns, weights, E: float):
    """Return the `NewtonResult` for (unknowns, unfolding) of the orbit with the energy E near ``unknowns``."""
    equations = EnergyEquations(system, signature, weights)
    scale = np.append(equations.equations.scale[:-1], 1.0)
    made = newton(lambda u: equations.residual(u, E), equations.jacobian, np.append(unknowns, 0.0), scale,
                  noise=TOLERANCE)
    return made
