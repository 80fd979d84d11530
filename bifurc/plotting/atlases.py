"""Picture of an atlas: all branches, bands of coexistence and of chaos, and the probes."""
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from ..checks import checked, like
from . import style
from .branches import _value, pieces

_DASHES: dict = {1: "-", 0: (0, (4, 2)), -1: (0, (1, 1.5))}
_BAND = 0.05  # height of the band under the diagram, of the axes
_PALETTE = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.ORANGE, style.SKY, style.BLACK)
_INSET = (0.33, 0.36)  # width and height of an enlarged stretch, of the axes
_DENSE = 1000  # points of a branch in the search for empty places
_NARROW = 0.06  # of the range: a stretch with several branches that short is drawn again, enlarged
_MARKED = 2  # forcing periods up to which special points are marked: those of longer orbits crowd


@style.styled
@checked(found=like("an Atlas", "table", "branches"))
def plot_atlas(found, ax: Axes | None = None, measure: str | None = None) -> Axes:
    """Draw all branches of an atlas over its parameter.

    Colours tell the number of forcing periods, full lines are stable.  The band below the diagram tells how many stable
    motions are known, darker for more; chaos, where probes found it, is shaded; ticks under the band are the probes.  A narrow
    stretch in which several short branches lie is drawn again, enlarged, and its special points are marked there alone.

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
    curves = [_Curve(branch, row["periods"], measure) for branch, row in zip(found.branches, rows, strict=True)]
    window = _crowded(found, rows)
    handles += _draw(ax, curves, colors, lambda p: window is None or not window[0] <= p <= window[1])
    for low, high, _ in found.chaos:
        ax.axvspan(low, high, color=style.YELLOW, alpha=0.45, linewidth=0, zorder=0)
    if found.chaos:
        handles.append(Patch(color=style.YELLOW, alpha=0.45, label="chaos"))
    handles.append(Patch(color="0.55", label="number of stable motions"))
    _band(found, ax)
    ax.set_xlim(*found.bounds)
    ax.set_xlabel(style.parameter_label(found.parameter))
    ax.set_ylabel(style.measure_label(measure, single=found.system.n == 1))
    if window is not None:
        known = {handle.get_label() for handle in handles}
        handles += [handle for handle in _enlarged(ax, found, curves, colors, window) if handle.get_label() not in known]
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.005, 1.0, 0.1), mode="expand", ncols=4, borderaxespad=0.0)
    return ax


class _Curve:
    """What is drawn of a branch: its columns, its special points and their heights."""

    def __init__(self, branch, periods: int, measure: str):
        self.branch, self.periods = branch, periods
        self.s, self.x, self.y = (np.asarray(branch.column(name), float) for name in ("s", branch.parameter, measure))
        self.special = list(branch.special_points)
        self.heights = [_value(point, measure, self.s, self.y) for point in self.special]


def _draw(ax: Axes, curves: list, colors: dict, shown) -> list:
    """Draw branches, and their special points where ``shown(parameter)``; return handles of the kinds that were marked."""
    handles: list = []
    marked: dict[str, set] = {}
    for curve in curves:
        n = curve.periods
        for (_, stable), px, py in pieces(curve.branch, curve.s, curve.x, curve.y, curve.special, curve.heights):
            ax.plot(px, py, color=colors[n], linestyle=_DASHES[stable], linewidth=1.7 if stable == 1 else 0.9,
                    solid_capstyle="round", zorder=3 if stable == 1 else 2)
        for point, value in zip(curve.special, curve.heights, strict=True):
            kind, place = str(point.kind), (round(point.parameter, 9), round(float(value), 6))
            if place in marked.get(kind, ()) or n > _MARKED or not shown(point.parameter):
                continue
            marker, face, word = style.POINTS.get(kind, ("o", style.GREY, kind.replace("_", " ")))
            look: dict = {"linestyle": "none", "marker": marker, "markersize": 4.2, "markerfacecolor": face,
                          "markeredgecolor": "black", "markeredgewidth": 0.6}
            ax.plot([place[0]], [value], zorder=5, **look)
            if kind not in marked:
                handles.append(Line2D([], [], label=word, **look))
            marked.setdefault(kind, set()).add(place)
    return handles


def _crowded(found, rows) -> tuple[float, float] | None:
    """Return the narrow stretch of the parameter in which most of the short branches lie, None without at least three of them."""
    whole = found.bounds[1] - found.bounds[0]
    short = sorted((row["from"], row["to"]) for row in rows if 0.0 < row["to"] - row["from"] <= _NARROW * whole)
    groups: list[list[float]] = []
    for low, high in short:
        if groups and low <= groups[-1][1] and high - groups[-1][0] <= _NARROW * whole:
            groups[-1] = [groups[-1][0], max(high, groups[-1][1]), groups[-1][2] + 1]
        else:
            groups.append([low, high, 1])
    if not groups or max(group[2] for group in groups) < 3:
        return None
    low, high, _ = max(groups, key=lambda group: group[2])
    room = 0.12 * (high - low)
    return max(low - room, found.bounds[0]), min(high + room, found.bounds[1])


def _enlarged(ax: Axes, found, curves: list, colors: dict, window: tuple[float, float]) -> list:
    """Draw a stretch of the parameter again, enlarged, where the diagram is emptiest; return handles of what is marked there."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    dense = []
    for curve in curves:
        along = np.linspace(curve.s[0], curve.s[-1], _DENSE)
        across, up = (np.interp(along, curve.s, values) for values in (curve.x, curve.y))
        dense.append(np.column_stack([(across - left) / (right - left), (up - bottom) / (top - bottom)]))
    points = np.vstack(dense)
    points = 0.01 * np.unique(np.round(100.0 * points[np.isfinite(points).all(axis=1)]), axis=0)  # what is seen, not how often
    width, height = _INSET
    places = [(x, y) for y in (0.61, 0.18) for x in (0.06, 0.33, 0.64)]

    def covered(place) -> int:
        inside = (points >= np.subtract(place, 0.05)) & (points <= np.add(place, (width + 0.02, height + 0.02)))
        return int(np.count_nonzero(inside.all(axis=1)))
    x, y = min(places, key=covered)
    inset = ax.inset_axes((x, y, width, height), zorder=6)
    handles = _draw(inset, curves, colors, lambda p: window[0] <= p <= window[1])
    for low, high, _ in found.chaos:
        inset.axvspan(low, high, color=style.YELLOW, alpha=0.45, linewidth=0, zorder=0)
    heights = np.concatenate([curve.y[(curve.x >= window[0]) & (curve.x <= window[1])] for curve in curves])
    low, high = np.nanmin(heights), np.nanmax(heights)
    inset.set_xlim(*window)
    inset.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))
    inset.tick_params(labelsize=6.5, length=2.0)
    inset.locator_params(nbins=4)
    ax.indicate_inset_zoom(inset, edgecolor=style.GREY, linewidth=0.7)
    return handles


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
