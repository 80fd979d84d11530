"""Which start leads to which motion: basin maps over two components of the state."""
from .attractors import ChaoticAttractor
from .basinmap import BasinMap, CellState
from .grid import Grid
from .mapping import basins_of_attraction
from .periodmap import Kernel, PeriodMap
from .sweeps import Sweep, sweep

__all__ = ["BasinMap", "CellState", "ChaoticAttractor", "Grid", "Kernel", "PeriodMap", "Sweep", "basins_of_attraction",
           "sweep"]
