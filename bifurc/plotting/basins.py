"""Basin maps: which start leads to which attractor, the attractors, and how far the labels can be trusted."""
import re
import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.transforms import ScaledTranslation

from ..checks import SADDLE, SET, checked, either, like, many, of
from ..structure.components import states_of
from . import style
from .motions.phase_plane import describe

# (tint of the basin, colour of the attractor's marker); after eight attractors the tints repeat and the markers tell
_COLORS = [("#9ecae6", style.BLUE), ("#f6c9a6", style.VERMILION), ("#a9dcc6", style.GREEN), ("#ecc9dc", style.PURPLE),
           ("#f7ef9a", "#8a8200"), ("#f3d595", style.ORANGE), ("#cfe7f6", style.SKY), ("#d9d9d9", style.BLACK)]
_MARKERS = "osD^vP*X"
_UNDER_LABELS = 34.0  # points from the axes to the legend: tick labels and the label of the axis lie between
_TWO_COLUMNS = 4.0  # inches of axes on which two columns of the legend fit
_BEYOND = 2  # code of cells beyond a stop in ``states``
_SPECIAL = [(None, "#ffffff", None, "unresolved"), (_BEYOND, "#f2f2f2", "////", "beyond the stop"),  # code, tint, hatch, words
            (3, "#303030", None, "to infinity")]


@style.styled
@checked(basins=like("a map of basins", "labels", "grid", "attractors"), unstable=SET, stable=SET,
         saddle=either(SADDLE, of(many, of=SADDLE), allowed="an orbit, an EdgeState, or several"))
def plot_basins(basins: Any, ax: Axes | None = None, saddle: Any = None, unstable: Any = None, stable: Any = None) -> Axes:
    """Draw a basin map with its attractors, the share of each basin, boundary entropy and how reliable its labels are.

    Cells beyond a stop are hatched, motions to infinity black, unresolved ones white.

    Parameters
    ----------
    basins : BasinMap
        Anything with ``labels`` (int, [i0, i1], -1 unresolved), ``grid`` (``names``, ``low``, ``high``: two each),
        ``attractors`` and ``points(label)`` (k, ns), their states at phase 0, ``system``, ``fractions`` (dict label ->
        fraction), and what may be None: ``states`` (codes), ``section``, ``label_uncertainty``, ``entropy()``, ``reliability``.
    ax : matplotlib.axes.Axes, optional
    saddle : PeriodicOrbit, EdgeState or a sequence of them, optional
        Drawn as white crosses.
    unstable, stable : UnstableSet, StableSet, optional
        Anything with ``points`` (k, ns) and ``curves`` (k,): black, and white.

    Returns
    -------
    matplotlib.axes.Axes
    """
    labels, grid = np.asarray(basins.labels), basins.grid
    if labels.ndim != 2:
        raise ValueError(f"a map over {labels.ndim} components cannot be drawn; draw a map over two, with the others fixed by at=")
    fresh = ax is None
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.6)
    count = len(basins.attractors)
    states = basins.states
    codes, special = cell_codes(basins)
    tints = ListedColormap(tints_of(count))
    (left, bottom), (right, top) = grid.low, grid.high
    ax.imshow(codes.T, origin="lower", extent=(left, right, bottom, top), interpolation="nearest", aspect="auto",
              cmap=tints, vmin=-0.5, vmax=count + len(_SPECIAL) - 0.5, zorder=1)
    handles: list[tuple[tuple, str]] = _attractors(ax, basins)
    starts = labels.size if states is None else max(int(np.count_nonzero(states != _BEYOND)), 1)
    for tint, hatch, words, beyond, mine in special:
        patch = Patch(facecolor=tint, edgecolor="black" if hatch is None else style.GREY, linewidth=0.6, hatch=hatch)
        share = "" if beyond is not None else f": {_percent(np.count_nonzero(mine) / starts)}"
        handles.append(((patch,), words + share))
        if hatch is not None and min(labels.shape) > 1:
            with matplotlib.rc_context({"hatch.linewidth": 0.5}):
                across, up = (low + (np.arange(cells) + 0.5) * (high - low) / cells for low, high, cells in
                              zip(grid.low, grid.high, labels.shape, strict=True))
                ax.contourf(across, up, mine.T, levels=[0.5, 1.5], colors="none", hatches=[hatch], zorder=1.5)
    handles += _saddles(ax, grid, basins.system.n, states_of(basins), saddle, unstable, stable)
    if handles:
        below = ScaledTranslation(0.0, -_UNDER_LABELS / 72.0, ax.figure.dpi_scale_trans)
        ax.legend([group for group, _ in handles], [words for _, words in handles],
                  handler_map={tuple: HandlerTuple(ndivide=None, pad=0.4)}, loc="upper left",
                  bbox_to_anchor=(0.0, 0.0), bbox_transform=ax.transAxes + below, borderaxespad=0.0,
                  ncols=2 if len(handles) > 1 and _width(ax) > _TWO_COLUMNS else 1, handlelength=2.8)
    _said(ax, basins, labels, fresh)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    across, up = (style.component_label(k, basins.system.n, states_of(basins)) for k in _places(basins))
    when = " at the start" if basins.section is not None else " at phase 0"
    ax.set_xlabel(across + when)
    ax.set_ylabel(up + when)
    return ax


def _width(ax: Axes) -> float:
    """Return the width of axes before they are laid out, inches."""
    return float(ax.get_position().width * ax.figure.bbox.width / ax.figure.dpi)


def tints_of(count: int) -> list[str]:
    """Return the colours of the codes of `cell_codes` for so many attractors."""
    return [*(tint for _, tint, _, _ in _SPECIAL), *(_COLORS[k % len(_COLORS)][0] for k in range(count))]


def marker_color(label: int) -> str:
    """Return the colour of an attractor's marker."""
    return _COLORS[label % len(_COLORS)][1]


def cell_codes(basins: Any) -> tuple[np.ndarray, list]:
    """Return a code of each cell (0 unresolved, 1 beyond a stop, 2 to infinity, 3 the first attractor, ...).

    With them the rows (tint, hatch, words, share, cells) of the codes without an attractor that occur.
    """
    labels = np.asarray(basins.labels)
    states = basins.states
    codes, special = labels + len(_SPECIAL), []
    for place, (code, tint, hatch, words) in enumerate(_SPECIAL[:1] if states is None else _SPECIAL):
        mine = (labels == -1) & ((states == code) if states is not None and code is not None else labels == -1)
        if code is None and states is not None:
            mine &= ~np.isin(states, [other for other, *_ in _SPECIAL if other is not None])
        if mine.any():
            codes = np.where(mine, place, codes)
            special.append((tint, hatch, words, mine.mean() if code == _BEYOND else None, mine))
    return codes, special


def _attractors(ax: Axes, basins: Any) -> list[tuple[tuple, str]]:
    """Draw the attractors; return their entries for the legend."""
    handles = []
    for label, attractor in enumerate(basins.attractors):
        tint, color = _COLORS[label % len(_COLORS)]
        marker = _MARKERS[label % len(_MARKERS)]
        words = f"{describe(attractor)}: {_percent(basins.fractions.get(label, 0.0))}"
        every = np.atleast_2d(basins.points(label))
        points = every[:, _places(basins)]
        size, edge = (1.5, 0.0) if len(points) > 200 else (6.0, 0.9)
        (drawn,) = ax.plot(points[:, 0], points[:, 1], linestyle="none", marker=marker, markerfacecolor=color,
                           markeredgecolor="white", markersize=size, markeredgewidth=edge, zorder=5)
        handles.append(((Patch(facecolor=tint, edgecolor=color, linewidth=0.8), drawn), words))
    return handles


def draw_sets(ax: Axes, grid: Any, n: int, unstable: Any, stable: Any, states: Sequence[str] = ()) -> list[tuple[tuple, str]]:
    """Draw an unstable set in black and a stable set in white with grey rims; return their entries for the legend."""
    handles: list[tuple[tuple, str]] = []
    rim: dict[str, Any] = {"color": "white", "linewidth": 1.0, "zorder": 3,
                           "path_effects": [withStroke(linewidth=1.7, foreground=style.GREY)]}
    thin: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.7, "zorder": 4}
    for item, look, words in ((unstable, thin, "unstable set of the saddle"), (stable, rim, "stable set of the saddle")):
        if item is None or not len(item.points):
            continue
        i, j = (_component(name, n, states) for name in grid.names)
        ends = np.flatnonzero(np.diff(item.curves)) + 1  # a line of NaN between pieces: one line for all
        points = np.insert(item.points, ends, np.nan, axis=0)
        (line,) = ax.plot(points[:, i], points[:, j], **look)
        handles.append(((line,), words))
    return handles


def _saddles(ax: Axes, grid: Any, n: int, states: Sequence[str], saddle: Any, unstable: Any,
             stable: Any) -> list[tuple[tuple, str]]:
    """Draw saddles, an unstable and a stable set; return their entries for the legend."""
    handles = draw_sets(ax, grid, n, unstable, stable, states)
    items = saddle if isinstance(saddle, (list, tuple)) else [] if saddle is None else [saddle]
    for number, item in enumerate(items):
        points = np.atleast_2d(item.sections)
        if not len(points):
            continue
        i, j = (_component(name, n, states) for name in grid.names)
        (drawn,) = ax.plot(points[:, i], points[:, j], linestyle="none", marker="P", markersize=7, markerfacecolor="white",
                           markeredgecolor="black", markeredgewidth=1.0, zorder=6)
        if number == 0:
            handles.append(((drawn,), "saddle" if len(items) == 1 else "saddles"))
    return handles


def _said(ax: Axes, basins: Any, labels: np.ndarray, fresh: bool) -> None:
    """Write above the map how fine and how mixed it is, and under the picture how reliable its labels are."""
    words = [f"{labels.shape[0]} x {labels.shape[1]} starts"]
    if min(labels.shape) >= 5 and len(basins.attractors) > 1 and (entropy := basins.entropy()) is not None:
        words.append(f"boundary entropy {entropy.boundary:.3f}")
    noise = basins.label_uncertainty
    if noise is not None:
        words.append(f"predicted label noise {_scientific(noise)}")
    ax.set_title("\n".join(textwrap.wrap(", ".join(words), max(20, int(18.0 * _width(ax))))), loc="right", fontsize=7.5)
    reliability = basins.reliability
    if fresh and reliability is not None:  # a figure of our own has room for it
        statement = reliability.statement.replace("+-", "\u00b1")
        ax.figure.supxlabel("\n".join(textwrap.wrap(statement, 108)), x=0.02, ha="left", fontsize=7)


_FIELDS = {"periods": ("forcing periods until near the attractor", "cividis"), "impacts": ("impacts until then", "cividis"),
           "speeds": ("least speed of arrival at a stop", "viridis")}


@style.styled
@checked(basins=like("a map of basins", "labels", "grid"))
def plot_field(basins: Any, field: str, ax: Axes | None = None) -> Axes:
    """Draw what else was recorded of each cell: ``periods``, ``impacts`` or ``speeds`` (logarithmic; grazes are dark).

    Raises
    ------
    ValueError
        For another field, or one that the map does not hold.
    """
    if field not in _FIELDS:
        raise ValueError(f"field = {field!r} is not allowed; it must be one of {', '.join(_FIELDS)}")
    values = np.asarray(getattr(basins, field), float)
    if values.shape != basins.labels.shape or values.ndim != 2:
        raise ValueError(f"field = {field!r}: this map holds no {field} over two components")
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.0)
    words, colors = _FIELDS[field]
    values = np.ma.masked_where(~np.isfinite(values) | (values < 0) | (np.asarray(basins.labels) < 0), values)
    (left, bottom), (right, top) = basins.grid.low, basins.grid.high
    positive = values.compressed()
    positive = positive[positive > 0]
    norm = LogNorm(max(positive.min(), 1e-3 * np.median(positive)), positive.max()) if positive.size else None
    least = float(norm.vmin or 0.0) if norm else 0.0
    image = ax.imshow(np.ma.maximum(values, least).T, origin="lower", extent=(left, right, bottom, top), norm=norm, cmap=colors,
                      interpolation="nearest", aspect="auto")
    ax.figure.colorbar(image, ax=ax, label=words)
    across, up = (style.component_label(k, basins.system.n, states_of(basins)) for k in _places(basins))
    ax.set_xlabel(across + " at phase 0")
    ax.set_ylabel(up + " at phase 0")
    return ax


def section_points(attractor: Any) -> np.ndarray:
    """Return the states of an attractor at phase 0, one row a forcing period."""
    return np.atleast_2d(attractor.sections)


def _places(basins: Any) -> list[int]:
    """Return the places of the components of a grid of starts in the state."""
    return [_component(name, basins.system.n, states_of(basins)) for name in basins.grid.names]


def _component(name: str, n: int, states: Sequence[str] = ()) -> int:
    """Return the place of ``q0``, ``v0`` or ``w0`` in the state (q, v, w) of ``n`` degrees of freedom, or of one of the states."""
    if name in states:
        return list(states).index(name)
    match = re.fullmatch(r"([qvw])(\d+)", name)
    if match is None:
        raise ValueError(f"a grid runs over state components such as 'q0' and 'v0', got {name!r}")
    return int(match[2]) + {"q": 0, "v": n, "w": 2 * n}[match[1]]


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.2f} %" if fraction < 0.1 else f"{100 * fraction:.1f} %"


def _scientific(value: float) -> str:
    if not value > 0:
        return "0"
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"${mantissa}\\times10^{{{int(exponent)}}}$" if int(exponent) < -2 else f"{100 * value:.1f} %"
