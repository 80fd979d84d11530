"""Which start leads to which motion: basin maps over two components of the state."""
from .attractors import ChaoticAttractor
from .basinmap import BasinMap, CellState
from .cellmap import CellFate, CellMap, GroupKind
from .cells import cell_mapping
from .confirming import MapCycle
from .edges import EdgeState, EdgeStatus, edge_state
from .grid import Grid
from .mapping import basins_of_attraction
from .periodmap import Kernel, PeriodMap
from .refine import Refinement, refined_basins
from .sweeps import Sweep, sweep

__all__ = ["BasinMap", "CellFate", "CellMap", "CellState", "ChaoticAttractor", "EdgeState", "EdgeStatus", "Grid", "GroupKind", "Kernel",
           "MapCycle", "PeriodMap", "Refinement", "Sweep", "basins_of_attraction", "cell_mapping", "edge_state", "refined_basins", "sweep"]
