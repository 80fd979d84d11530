"""Which start leads to which motion.

`attractors` finds and confirms motions, `maps` labels grids of starts and says how far the labels can be trusted, `cells` maps
cells of the state space, `boundaries` finds saddles between basins and their sets, `sweeps` runs over parameters.
Start reading at `maps.compute`.
"""
from ..ensemble.grid import Grid
from ..ensemble.period_map import Kernel, PeriodMap
from ..ensemble.section import Section
from .attractors.attractors import ChaoticAttractor, QuasiperiodicAttractor
from .boundaries.edges import EdgeState, EdgeStatus, edge_state
from .boundaries.stable import StableSet, stable_set
from .boundaries.unstable import UnstableSet, unstable_set
from .cells.cell_map import CellFate, CellMap, GroupKind
from .cells.compute import cell_mapping
from .cells.confirmation import MapCycle
from .maps.basin_map import BasinMap, CellState
from .maps.compute import basins_of_attraction
from .maps.refinement import Refinement, refined_basins
from .sweeps.attractor_sweep import Sweep, Track, sweep
from .sweeps.chart import ParameterChart, parameter_chart
from .sweeps.diagram import BifurcationDiagram, bifurcation_diagram
from .sweeps.ramp import Jump, Ramp, ramp

__all__ = ["BasinMap", "BifurcationDiagram", "CellFate", "CellMap", "CellState", "ChaoticAttractor", "EdgeState",
           "EdgeStatus", "Grid", "GroupKind", "Jump", "Kernel", "MapCycle", "ParameterChart", "PeriodMap",
           "QuasiperiodicAttractor", "Ramp", "Refinement", "Section", "StableSet", "Sweep", "Track", "UnstableSet",
           "basins_of_attraction", "bifurcation_diagram", "cell_mapping", "edge_state", "parameter_chart", "ramp",
           "refined_basins", "stable_set", "sweep", "unstable_set"]
