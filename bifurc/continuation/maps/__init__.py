"""Maps as systems of their own: the square-root maps of grazing, and a user's smooth map; cycles, branches, diagrams, exponents."""
from ...lazy import lazy

_NAMES = {
    "CycleProblem": "problem", "Map": "base", "MapDiagram": "ensemble", "MapExponents": "ensemble", "MapOrbit": "orbit",
    "MapOrbitStatus": "orbit", "NordmarkMap": "square_root", "Piece": "base", "SmoothMap": "smooth",
    "SquareRootMap": "square_root",
}
__all__ = [*sorted(_NAMES)]
__getattr__, __dir__ = lazy(__name__, _NAMES)
