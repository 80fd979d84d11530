"""bifurc: periodic motions of mechanical systems that hit, rub, stick and slip, found, followed, explained and mapped.

Names are loaded when they are first used (PEP 562), so that ``import bifurc`` costs next to nothing: numba, scipy,
networkx and matplotlib are imported by the work that needs them.

Examples
--------
>>> import bifurc as bf
>>> system = bf.systems.impact_oscillator(omega=0.6)
>>> orbit = bf.find_orbit(system)
>>> orbit.stable
True
"""
import importlib

__version__ = "0.2.0"

_MODULES = ("elements", "systems", "piecewise", "continuation", "control", "plotting", "explore")
_NAMES = {
    "System": ".system",
    "PiecewiseSystem": ".piecewise",
    "HybridSystem": ".piecewise",
    "AffineField": ".piecewise",
    "AffineSurface": ".piecewise",
    "AffineReset": ".piecewise",
    "Switch": ".piecewise",
    "Jump": ".piecewise",
    "simulate": ".flow.simulate",
    "hysteresis": ".flow.hysteresis",
    "Trajectory": ".flow.trajectory",
    "find_orbit": ".orbits.find",
    "PeriodicOrbit": ".orbits.orbit",
    "HarmonicBalance": ".orbits.balance.method",
    "HarmonicOrbit": ".orbits.balance.harmonic_orbit",
    "energy": ".orbits.energy",
    "nonlinear_mode": ".continuation.free_vibration",
    "find_equilibrium": ".orbits.equilibria.equilibrium",
    "Equilibrium": ".orbits.equilibria.equilibrium",
    "lyapunov_exponents": ".orbits.lyapunov",
    "trace": ".continuation",
    "trace_curve": ".continuation",
    "switch_branch": ".continuation",
    "Branch": ".continuation",
    "SpecialPoint": ".continuation",
    "basins_of_attraction": ".basins",
    "BasinMap": ".basins",
    "Grid": ".basins",
    "Section": ".basins",
    "cell_mapping": ".basins",
    "CellMap": ".basins",
    "refined_basins": ".basins",
    "sweep": ".basins",
    "atlas": ".atlases",
    "Atlas": ".atlases",
    "extended_mode": ".backbones",
    "backbone": ".backbones",
    "edge_state": ".basins.boundaries.edges",
    "bifurcation_diagram": ".basins.sweeps.diagram",
    "ramp": ".basins.sweeps.ramp",
    "Ramp": ".basins.sweeps.ramp",
    "parameter_chart": ".basins.sweeps.chart",
    "Certificate": ".certify",
    "load": ".loading",
    "read": ".models.reading",
    "from_ross": ".models.reading",
    "Model": ".models.reading",
    "StiffModelWarning": ".models.cost",
    "modal_damping": ".structure.damping",
    "rayleigh_damping": ".structure.damping",
}

__all__ = [*_MODULES, *_NAMES]


def __getattr__(name: str):
    if name in _NAMES:
        value = getattr(importlib.import_module(_NAMES[name], __name__), name)
    elif name in _MODULES:
        value = importlib.import_module("." + name, __name__)
    else:
        raise AttributeError(f"module 'bifurc' has no attribute {name!r}; it has {', '.join(sorted(__all__))}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
