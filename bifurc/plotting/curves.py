"""Curves of special points in the plane of two parameters."""
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import PchipInterpolator

from ..checks import checked, flag, like
from . import style

_FINE = 12  # drawn pieces between two rows


@style.styled
@checked(curve=like("a ParameterCurve", "parameters", "column"), points=flag)
def plot_curve(curve: Any, ax: Axes | None = None, points: bool = True) -> Axes:
    """Draw a curve of special points over both parameters; extrema, cusps and ends are marked.

    Parameters
    ----------
    curve : ParameterCurve
        Anything with ``parameters`` (two names), ``kind``, ``column(name)`` for them and ``s``, and ``special_points``
        with ``kind``, ``name`` and ``parameters`` (a dict).
    ax : matplotlib.axes.Axes, optional
        Drawn on; several curves on the same axes share one legend.
    points : bool
        Whether special points are marked.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(5.4, 3.9)
    first, second = curve.parameters
    s, x, y = (np.asarray(curve.column(name), float) for name in ("s", first, second))
    if s.size > 3:
        fine = np.unique(np.concatenate([np.linspace(a, b, _FINE) for a, b in zip(s[:-1], s[1:], strict=True)]))
        x, y = PchipInterpolator(s, x)(fine), PchipInterpolator(s, y)(fine)
    word = curve.name or str(curve.kind).replace("_", " ")
    drawn = [line for line in ax.get_lines() if line.get_label() == word]
    ax.plot(x, y, linewidth=1.6, label=word, color=drawn[0].get_color() if drawn else None)  # one kind, one colour
    if points:
        for point in curve.special_points:
            values = point.parameters
            kind = str(point.kind)
            marker, face = ("*", style.ORANGE) if kind == "cusp" else style.POINTS.get(kind, ("o", "white"))[:2]
            word = f"extremum of {point.name}" if kind == "extremum" else kind.replace("_", " ")
            ax.plot([values[first]], [values[second]], linestyle="none", marker=marker, markersize=6.5 if marker == "*" else 5,
                    markerfacecolor=face, markeredgecolor="black", markeredgewidth=0.8, label=word, zorder=5)
    ax.set_xlabel(style.parameter_label(first))
    ax.set_ylabel(style.parameter_label(second))
    style.legend(ax)
    return ax
