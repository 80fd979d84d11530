"""Basin maps: which start leads to which attractor, the attractors, and how far the labels can be trusted."""
import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch

from . import style
from .motions import describe

# (tint of the basin, colour of the attractor's marker); after eight attractors the tints repeat and the markers tell
_COLORS = [("#9ecae6", style.BLUE), ("#f6c9a6", style.VERMILION), ("#a9dcc6", style.GREEN), ("#ecc9dc", style.PURPLE),
           ("#f7ef9a", "#8a8200"), ("#f3d595", style.ORANGE), ("#cfe7f6", style.SKY), ("#d9d9d9", style.BLACK)]
_MARKERS = "osD^vP*X"
_UNRESOLVED = "#ffffff"


@style.styled
def plot_basins(basins: Any, ax: Axes | None = None) -> Axes:
    """Draw a basin map with its attractors, the fraction of each basin, and the predicted label noise.

    Parameters
    ----------
    basins : BasinMap
        Anything with ``labels`` (int, [i0, i1], -1 unresolved), ``grid`` (``names``, ``low``, ``high``: two each),
        ``attractors`` (periodic orbits, or samples with ``points`` (k, 2 dofs)), ``fractions`` (dict label -> fraction)
        and ``label_uncertainty``.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.2)
    labels, grid = np.asarray(basins.labels), basins.grid
    count = len(basins.attractors)
    tints = ListedColormap([_UNRESOLVED, *(_COLORS[k % len(_COLORS)][0] for k in range(count))])
    (left, bottom), (right, top) = grid.low, grid.high
    ax.imshow(labels.T + 1, origin="lower", extent=(left, right, bottom, top), interpolation="nearest", aspect="auto",
              cmap=tints, vmin=-0.5, vmax=count + 0.5, zorder=1)
    handles: list[tuple[tuple, str]] = []
    for label, attractor in enumerate(basins.attractors):
        tint, color = _COLORS[label % len(_COLORS)]
        marker = _MARKERS[label % len(_MARKERS)]
        words = f"{describe(attractor)}: {_percent(basins.fractions.get(label, 0.0))}"
        points = section_points(attractor)[:, [_component(name, _states(attractor)) for name in grid.names]]
        size, edge = (1.5, 0.0) if hasattr(attractor, "points") else (6.0, 0.9)
        (drawn,) = ax.plot(points[:, 0], points[:, 1], linestyle="none", marker=marker, markerfacecolor=color,
                           markeredgecolor="white", markersize=size, markeredgewidth=edge, zorder=5)
        handles.append(((Patch(facecolor=tint, edgecolor=color, linewidth=0.8), drawn), words))
    unresolved = basins.fractions.get(-1, 0.0)
    if unresolved > 0:
        empty = Patch(facecolor=_UNRESOLVED, edgecolor="black", linewidth=0.6)
        handles.append(((empty,), f"unresolved: {_percent(unresolved)}"))
    if handles:
        ax.legend([group for group, _ in handles], [words for _, words in handles],
                  handler_map={tuple: HandlerTuple(ndivide=None, pad=0.4)}, loc="upper left",
                  bbox_to_anchor=(0.0, -0.13), borderaxespad=0.0, ncols=2 if count > 1 else 1, handlelength=2.8)
    noise = getattr(basins, "label_uncertainty", None)
    if noise is not None:
        words = f"{labels.shape[0]} x {labels.shape[1]} starts, predicted label noise {_scientific(noise)}"
        ax.set_title(words, loc="right", fontsize=7.5)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    half = _states(basins.attractors[0]) // 2 if count else 1
    across, up = (style.component_label(_component(name, 2 * half), half) for name in grid.names)
    ax.set_xlabel(across + " at phase 0")
    ax.set_ylabel(up + " at phase 0")
    return ax


def section_points(attractor: Any) -> np.ndarray:
    """Return the states of an attractor at phase 0, one row a forcing period."""
    if hasattr(attractor, "points"):
        return np.atleast_2d(attractor.points)
    return attractor.sample(attractor.periods + 1)[1][:-1]


def _states(attractor: Any) -> int:
    return attractor.points.shape[1] if hasattr(attractor, "points") else len(attractor.state)


def _component(name: str, states: int) -> int:
    """Return the place of ``q0`` or ``v0`` in the state (q, v)."""
    match = re.fullmatch(r"([qv])(\d+)", name)
    if match is None:
        raise ValueError(f"a grid runs over state components such as 'q0' and 'v0', got {name!r}")
    return int(match[2]) + (states // 2 if match[1] == "v" else 0)


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.2f} %" if fraction < 0.1 else f"{100 * fraction:.1f} %"


def _scientific(value: float) -> str:
    if not value > 0:
        return "0"
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"${mantissa}\\times10^{{{int(exponent)}}}$" if int(exponent) < -2 else f"{100 * value:.1f} %"
