"""Frequency responses for several values of a second parameter, and the curves of their peaks."""
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..checks import ALL_DRAWN, array, checked, like, many, mapping, of, refused, word
from . import style

_LINES = ("-", (0, (5, 1.5)))  # of the variants in a picture of peaks

CURVE = like("a ParameterCurve, see trace_curve", "column", "special_points")


@style.styled
@checked(branches=ALL_DRAWN, name=word, curve=CURVE, measured=of(array, axes=(2,)))
def plot_responses(branches: Sequence[Any], values: Sequence[float], name: str, ax: Axes | None = None, measure: str = "max_0",
                   curve: Any = None, measured: np.ndarray | None = None) -> Axes:
    """Draw branches over their parameter, one a value of a second parameter, with their peaks and the curve through them.

    Parameters
    ----------
    branches : sequence of Branch
        With ``parameter``, ``column(name)`` and ``special_points``.
    values : sequence of float
        Of the second parameter, one a branch.
    name : str
        The second parameter.
    ax : matplotlib.axes.Axes, optional
    measure : str
        Column on the vertical axis.
    curve : ParameterCurve, optional
        Of the peaks.
    measured : array (k, 2), optional
        Points of an experiment, or of another program: parameter and measure.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if measured is not None and measured.shape[1] != 2:
        raise refused("plot_responses", "measured", measured, "a table of two columns: parameter and measure")
    if len(values) != len(branches):
        raise refused("plot_responses", "values", values, f"{len(branches)} numbers, one a branch")
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    colors = style.sequence(len(branches))
    for branch, value, color in zip(branches, values, colors, strict=True):
        p, y = branch.column(branch.parameter), branch.column(measure)
        stable = np.asarray(branch.column("stable"), float)
        ax.plot(p, np.where(stable == 0, np.nan, y), color=color, linewidth=1.3, label=f"{value:g}")
        if np.any(stable == 0):
            ax.plot(p, np.where(stable == 0, y, np.nan), color=color, linewidth=1.1, linestyle=(0, (3.2, 1.6)))
        for point in branch.special_points:
            if point.kind == "peak":
                ax.plot(point.parameter, point.measures[measure], marker="o", markersize=3.5, color=color, zorder=4)
    if curve is not None:
        ax.plot(curve.column(branches[0].parameter), curve.column(measure), color=style.GREY, linewidth=0.8,
                linestyle=(0, (1, 1.5)), zorder=3)
    if measured is not None:
        ax.plot(measured[:, 0], measured[:, 1], linestyle="none", marker="o", markersize=3.5, markerfacecolor="none",
                markeredgecolor="black", markeredgewidth=0.8, label="measured", zorder=6)
    high = max(float(np.nanmax(branch.column(measure))) for branch in branches)
    shown = np.concatenate([branch.column(branch.parameter)[branch.column(measure) > 0.1 * high] for branch in branches])
    ax.set_xlim(shown.min(), shown.max())  # where something is to be seen
    ax.set_xlabel(style.parameter_label(branches[0].parameter))
    ax.set_ylabel(style.measure_label(measure, single="max_1" not in branches[0].column_names))
    ax.legend(title=style.parameter_label(name), fontsize=7, title_fontsize=7.5, loc="best")
    return ax


@style.styled
@checked(curves=mapping, name=word)
def plot_peaks(curves: dict[str, tuple[Any, Sequence[tuple[float, float]]]], name: str, ax: Axes | None = None,
               measure: str = "max_0") -> Axes:
    """Draw the height of peaks over a parameter, one line a variant, with the extrema marked.

    Parameters
    ----------
    curves : dict of str to (ParameterCurve, sequence of (float, float))
        By the name of the variant (an empty name is not shown): the curve, and peaks of single responses, in order; drawn
        as points, joined beyond the end of the curve.
    name : str
        Parameter on the horizontal axis.
    ax : matplotlib.axes.Axes, optional
    measure : str
        Measure whose peaks were followed.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    for label, drawn in curves.items():
        name_of = f"curves[{label!r}]"
        both = many("plot_peaks", name_of, drawn, of=lambda owner, name, value: value, count=2)
        CURVE("plot_peaks", f"{name_of}[0]", both[0])
        many("plot_peaks", f"{name_of}[1]", both[1], of=of(array, count=2))
    for number, (label, (curve, peaks)) in enumerate(curves.items()):
        color = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)[number % 4]
        x, y = curve.column(name), curve.column(measure)
        ax.plot(x, y, color=color, linestyle=_LINES[number % 2], label=label or None)
        ax.plot([at for at, _ in peaks], [height for _, height in peaks], linestyle="none", marker="o", markersize=3,
                markerfacecolor="white", markeredgecolor=color, zorder=4)
        last = int(np.argmax(x))
        beyond = [(x[last], y[last]), *((at, height) for at, height in peaks if at > x[last])]
        if len(beyond) > 1:
            ax.plot([at for at, _ in beyond], [height for _, height in beyond], color=color, linewidth=0.8, linestyle=(0, (1, 1.5)))
        for point in curve.special_points:
            if point.kind == "extremum" and point.name == measure:
                at = point.parameters[name]
                height = point.measures[measure]
                ax.plot(at, height, marker="o", markersize=5, markerfacecolor=color, markeredgecolor="white", zorder=5)
                ax.annotate(f"{at:.4g}", (at, height), textcoords="offset points", xytext=(8, 3 - 10 * (number % 2)), fontsize=7.5)
    ax.set_xlabel(style.parameter_label(name))
    ax.set_ylabel("peak of " + style.measure_label(measure))
    style.legend(ax)
    return ax
