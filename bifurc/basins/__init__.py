"""Which start leads to which motion: basin maps over two components of the state."""
from .attractors import ChaoticAttractor
from .basinmap import BasinMap, CellState
from .cellmap import CellFate, CellMap, GroupKind
from .cells import cell_mapping
from .charts import ParameterChart, parameter_chart
from .confirming import MapCycle
from .diagrams import BifurcationDiagram, bifurcation_diagram
from .edges import EdgeState, EdgeStatus, edge_state
from .grid import Grid
from .mapping import basins_of_attraction
from .periodmap import Kernel, PeriodMap
from .refine import Refinement, refined_basins
from .stable import StableSet, stable_set
from .sweeps import Sweep, Track, sweep
from .unstable import UnstableSet, unstable_set

__all__ = ["BasinMap", "BifurcationDiagram", "CellFate", "CellMap", "CellState", "ChaoticAttractor", "EdgeState",
           "EdgeStatus", "Grid", "GroupKind", "Kernel", "MapCycle", "ParameterChart", "PeriodMap", "Refinement",
           "StableSet", "Sweep", "Track", "UnstableSet", "basins_of_attraction", "bifurcation_diagram", "cell_mapping",
           "edge_state", "parameter_chart", "refined_basins", "stable_set", "sweep", "unstable_set"]
