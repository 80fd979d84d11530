"""Maps as systems of their own: the square-root maps of grazing, and a user's smooth map; cycles, branches, diagrams, exponents."""
from importlib import import_module

_NAMES = {
    "CycleProblem": "problem", "Map": "base", "MapDiagram": "ensemble", "MapExponents": "ensemble", "MapOrbit": "orbit",
    "MapOrbitStatus": "orbit", "NordmarkMap": "square_root", "Piece": "base", "SmoothMap": "smooth",
    "SquareRootMap": "square_root",
}
__all__ = [*sorted(_NAMES)]


def __getattr__(name):
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_NAMES[name]}"), name)


def __dir__():
    return __all__
