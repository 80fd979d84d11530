"""Pictures: branch diagrams, orbits, trajectories, basin maps. The only place that imports matplotlib.

The functions take anything with the attributes that they name; they know no class of the package. Each takes the axes
to draw on (``ax=None`` makes a figure with pyplot) and returns them, so that everything can be changed afterwards.
All take ``names``, a mapping of parameters, columns and components to the labels of axes: ``{"omega": "speed (rad/s)",
"rms_0": "rms (mm)", "q0": "x (mm)"}``.
"""
import importlib

_HOMES = {
    "atlases": ("plot_atlas",),
    "backbones": ("plot_backbone",),
    "basins": ("plot_basins", "plot_field"),
    "branches": ("plot_branch", "plot_branches", "plot_over"),
    "cells": ("plot_cells", "plot_morse"),
    "control": ("plot_controlled", "plot_delayed", "plot_feedback"),
    "curves": ("plot_curve",),
    "maps": ("plot_map_diagram",),
    "motions.animation": ("animate_orbit",),
    "motions.loops": ("plot_loop",),
    "motions.phase_plane": ("describe", "plot_orbit", "plot_trajectory"),
    "motions.rotors": ("full_spectrum", "plot_full_spectrum"),
    "responses": ("plot_peaks", "plot_responses"),
    "style": ("figure", "save_figure"),
    "sweeps": ("plot_chart", "plot_diagram", "plot_edge", "plot_ramp", "plot_sweep"),
    "thumbnails": ("drawn",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str):
    """Import a module of pictures, and matplotlib with it, when one of its functions is first asked for."""
    if name in _HOMES or name == "motions":
        return importlib.import_module(f".{name}", __name__)
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(importlib.import_module(f".{_HOME_OF[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
