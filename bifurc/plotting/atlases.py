"""Picture of an atlas: all branches, bands of coexistence and of chaos, and the probes."""
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from . import style
from .branches import _value, pieces

_DASHES: dict = {1: "-", 0: (0, (4, 2)), -1: (0, (1, 1.5))}
_BAND = 0.05  # height of the band under the diagram, of the axes
_PALETTE = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.ORANGE, style.SKY, style.BLACK)
_MARKED = 2  # forcing periods up to which special points are marked: those of longer orbits crowd


@style.styled
def plot_atlas(found, ax: Axes | None = None, measure: str | None = None) -> Axes:
    """Draw all branches of an atlas over its parameter.

    Colours tell the number of forcing periods, full lines are stable.  The band below the diagram tells how many stable
    motions are known, darker for more; chaos, where probes found it, is shaded; ticks under the band are the probes.

    Parameters
    ----------
    found : Atlas
    ax : matplotlib.axes.Axes, optional
    measure : str, optional
        Column on the vertical axis; default ``rms_0``.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.6)
    measure = measure or "rms_0"
    rows = found.table()
    periods = sorted({row["periods"] for row in rows})
    colors = {n: _PALETTE[min(k, len(_PALETTE) - 1)] for k, n in enumerate(periods)}
    handles: list = [Line2D([], [], color=colors[n], linewidth=1.7, label=f"{n} forcing period{'s' if n > 1 else ''}")
                     for n in periods]
    handles.append(Line2D([], [], color=style.GREY, linewidth=0.9, linestyle=_DASHES[0], label="unstable"))
    marked: dict[str, set] = {}
    for branch, row in zip(found.branches, rows, strict=True):
        n = row["periods"]
        s, x, y = (np.asarray(branch.column(name), float) for name in ("s", branch.parameter, measure))
        special = list(branch.special_points)
        at_points = [_value(point, measure, s, y) for point in special]
        for (_, stable), px, py in pieces(branch, s, x, y, special, at_points):
            ax.plot(px, py, color=colors[n], linestyle=_DASHES[stable], linewidth=1.7 if stable == 1 else 0.9,
                    solid_capstyle="round", zorder=3 if stable == 1 else 2)
        for point, value in zip(special, at_points, strict=True):
            kind, place = str(point.kind), (round(point.parameter, 9), round(float(value), 6))
            if place in marked.get(kind, ()) or n > _MARKED:
                continue
            marker, face, word = style.POINTS.get(kind, ("o", style.GREY, kind.replace("_", " ")))
            look: dict = {"linestyle": "none", "marker": marker, "markersize": 4.2, "markerfacecolor": face,
                          "markeredgecolor": "black", "markeredgewidth": 0.6}
            ax.plot([place[0]], [value], zorder=5, **look)
            if kind not in marked:
                handles.append(Line2D([], [], label=word, **look))
            marked.setdefault(kind, set()).add(place)
    for low, high, _ in found.chaos:
        ax.axvspan(low, high, color=style.YELLOW, alpha=0.45, linewidth=0, zorder=0)
    if found.chaos:
        handles.append(Patch(color=style.YELLOW, alpha=0.45, label="chaos"))
    handles.append(Patch(color="0.55", label="number of stable motions"))
    _band(found, ax)
    ax.set_xlim(*found.bounds)
    ax.set_xlabel(style.parameter_label(found.parameter))
    ax.set_ylabel(style.measure_label(measure, single=found.system.n == 1))
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.005, 1.0, 0.1), mode="expand", ncols=4, borderaxespad=0.0)
    return ax


def _band(found, ax: Axes) -> None:
    """Draw how many stable motions are known, and the probes, as a band below the diagram."""
    low, high = ax.get_ylim()
    height = _BAND * (high - low)
    bottom = low - height
    counts = [len(numbers) for *_, numbers in found.coexistence]
    most = max(counts, default=1) or 1
    for (a, b, _), count in zip(found.coexistence, counts, strict=True):
        if count:
            shade = 0.9 - 0.6 * count / most
            ax.add_patch(Rectangle((a, bottom), b - a, height, facecolor=str(shade), edgecolor="none", zorder=1))
            if b - a > 0.03 * (found.bounds[1] - found.bounds[0]):
                ax.text(0.5 * (a + b), bottom + 0.45 * height, str(count), ha="center", va="center", fontsize=6.5, zorder=4)
    ticks = [[(probe.value, bottom), (probe.value, bottom - 0.4 * height)] for probe in found.probes]
    ax.add_collection(LineCollection(ticks, colors=style.GREY, linewidths=0.6), autolim=False)
    ax.set_ylim(bottom - 0.6 * height, high)
