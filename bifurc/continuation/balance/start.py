"""Problems of harmonic orbits, whole or in the touched coordinates: from an orbit, and from a record."""
import numpy as np

from ...hbm.balance import Balance
from ...hbm.layout import Layout
from ...orbits.balance.harmonic_orbit import HarmonicOrbit
from ...orbits.balance.method import HarmonicBalance
from ...system import System
from .condensed import CondensedProblem, condensed_along
from .problem import BalanceProblem, path_over

NATURAL = 3.0  # natural size of the coefficients over the largest amplitude at the start


def balance_problem(orbit: HarmonicOrbit, parameter: str, bounds: tuple[float, float]) -> BalanceProblem:
    """Return the problem that continues a harmonic orbit in ``parameter`` over ``bounds``.

    Raises
    ------
    ValueError
        Unknown or discrete parameter; an orbit that is not converged; set-valued friction, whose balance has no derivative.
    """
    name = orbit.system.parameter_name(parameter)
    value = orbit.system.parameter(name)
    if not orbit.success:
        raise ValueError(f"the orbit cannot be continued, it is {orbit.status}: {orbit.message}")
    held = orbit.balance.parts.held
    if held:
        raise ValueError(f"{', '.join(item.name for item in held)}: a balance with set-valued friction is not continued; polish "
                         "the orbit (find_orbit(system, guess=orbit)) and trace that, or use RegularizedFriction")
    balance = orbit.balance
    path = path_over(balance, name, bounds)
    size = NATURAL * float(np.abs(orbit.coefficients).max()) or 1.0
    if orbit.condensed is not None:
        condensed = condensed_along(balance, path, orbit.condensed)
        scale = np.append(np.full(condensed.size, size), 0.5 * abs(bounds[1] - bounds[0]))
        return CondensedProblem(condensed, orbit.method, path, np.append(condensed.restricted(orbit.coefficients), value), scale)
    scale = np.append(np.full(balance.size, size), 0.5 * abs(bounds[1] - bounds[0]))
    return BalanceProblem(balance, orbit.method, path, np.append(orbit.coefficients, value), scale)


def from_record(record: dict, elements=()) -> BalanceProblem:
    """Return the problem whose ``to_record`` gave ``record``; ``elements`` are user classes and laws."""
    system = System.from_record(record["system"], elements)
    layout = Layout(tuple(record["harmonics"]), system.n, record["periods"])
    balance = Balance(system, layout, record["samples"], record["law_samples"])
    path = path_over(balance, record["parameter"], tuple(record["path"]), pad=0.0)
    method, x0, scale = HarmonicBalance.from_record(record["method"]), np.array(record["x0"]), np.array(record["scale"])
    listed = np.array(record["listed"], np.int64)
    if record.get("condensed"):
        return CondensedProblem(condensed_along(balance, path), method, path, x0, scale, listed)
    return BalanceProblem(balance, method, path, x0, scale, listed)
