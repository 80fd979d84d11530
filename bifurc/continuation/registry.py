"""Which problem continues what: classes of starts and kinds of records by name, their modules loaded when called for; and the
links of those that know each other (an orbit shrinks onto an equilibrium, which gives birth to orbits; a branch is extended).

A branch of impacts loads no harmonic balance, one of equilibria no maps.
"""
from importlib import import_module

OF_START = {
    "HarmonicOrbit": ("balance.start", "balance_problem"),
    "PeriodicOrbit": ("shooting.problem", "orbit_problem"),
    "Equilibrium": ("equilibria", "equilibrium_problem"),
    "MapOrbit": ("maps.problem", "CycleProblem"),
}
OF_ENERGY = {"PeriodicOrbit": ("free_vibration", "energy_problem")}  # free vibration over its energy
OF_RECORD = {
    "balance": ("balance.start", "from_record"),
    "free vibration": ("free_vibration", "EnergyProblem.from_record"),
    "equilibrium": ("equilibria", "EquilibriumProblem.from_record"),
    "orbit": ("shooting.problem", "OrbitProblem.from_record"),
    "curve": ("curves.problem", "CurveProblem.from_record"),
    "unfolded": ("curves.unfolding", "from_record"),
}
EQUILIBRIA = ("equilibria", "EquilibriumProblem")
EXTEND = ("tracing", "extend")


def named(place: tuple[str, str]):
    """Return what stands in a module of this folder under a name."""
    found = import_module(f".{place[0]}", __package__)
    for part in place[1].split("."):
        found = getattr(found, part)
    return found


def of_class(table: dict[str, tuple[str, str]], start):
    """Return the maker for a start by its class or a parent's, None where no class is in the table."""
    place = next((table[kind.__name__] for kind in type(start).__mro__ if kind.__name__ in table), None)
    return None if place is None else named(place)
