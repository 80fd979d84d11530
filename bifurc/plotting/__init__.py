"""Pictures: branch diagrams, orbits, trajectories, basin maps. The only place that imports matplotlib.

The functions take anything with the attributes that they name; they know no class of the package. Each takes the axes
to draw on (``ax=None`` makes a figure with pyplot) and returns them, so that everything can be changed afterwards.
All take ``names``, a mapping of parameters, columns and components to the labels of axes: ``{"omega": "speed (rad/s)",
"rms_0": "rms (mm)", "q0": "x (mm)"}``.
"""
from .animation import animate_orbit
from .basins import plot_basins
from .branches import plot_branch, plot_branches, plot_over
from .cells import plot_cells, plot_morse
from .curves import plot_curve
from .maps import plot_map_diagram
from .motions import describe, plot_orbit, plot_trajectory
from .responses import plot_peaks, plot_responses
from .rotors import full_spectrum, plot_full_spectrum
from .style import figure, save_figure
from .sweeps import plot_chart, plot_diagram, plot_edge, plot_ramp, plot_sweep

__all__ = ["animate_orbit", "describe", "figure", "full_spectrum", "plot_basins", "plot_branch", "plot_branches", "plot_over",
           "plot_cells", "plot_chart", "plot_curve", "plot_diagram", "plot_edge", "plot_full_spectrum",
           "plot_map_diagram", "plot_morse", "plot_orbit", "plot_peaks", "plot_ramp", "plot_responses", "plot_sweep",
           "plot_trajectory", "save_figure"]
