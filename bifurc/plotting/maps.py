"""Iterates of maps over a parameter."""
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..checks import checked, like, whole
from . import style


@style.styled
@checked(diagram=like("a MapDiagram", "points", "values"))
def plot_map_diagram(diagram: Any, ax: Axes | None = None, component: int = 0) -> Axes:
    """Draw a component of the iterates of a map over its parameter.

    Parameters
    ----------
    diagram : MapDiagram
        Anything with ``parameter``, ``values`` (m,) and ``points`` (m, keep, d).
    ax : matplotlib.axes.Axes, optional
    component : int

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    values = diagram.points[:, :, whole("plot_map_diagram", "component", component, most=diagram.points.shape[2] - 1)]
    x = np.repeat(diagram.values, values.shape[1])
    ax.plot(x, values.ravel(), linestyle="none", marker=".", markersize=0.9, markeredgewidth=0.0, color=style.BLUE, rasterized=True)
    ax.set_xlabel(style.parameter_label(diagram.parameter))
    ax.set_ylabel("$x$" if component == 0 else f"$x_{component + 1}$")
    return ax
