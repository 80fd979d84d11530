"""Maps of cells: labels, chances and densities, and the Morse graph."""
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.patches import Patch

from ..checks import COUNT, checked, like, whole
from ..structure.components import states_of
from . import style
from .basins import _COLORS, _component, _percent
from .motions.phase_plane import describe

_WHITE, _LEFT, _BEYOND = "#ffffff", "#bdbdbd", "#f2f2f2"


@style.styled
@checked(cells=like("a CellMap", "grid", "groups"))
def plot_cells(cells: Any, ax: Axes | None = None, field: str = "labels", group: int = 0) -> Axes:
    """Draw a map of cells over two components.

    Parameters
    ----------
    cells : CellMap
        Anything with ``labels``, ``fates`` (codes: attracted, unresolved, left, outside), ``grid``, ``attractors``, ``groups``,
        ``fractions``, ``audit``, ``absorption()`` and ``density(group)``.
    ax : matplotlib.axes.Axes, optional
    field : {"labels", "doubt", "time", "density"}
        Labels with attractors and spurious groups; 1 - the largest chance of absorption; the expected time of absorption; the
        stationary density of a group, per unit of area.
    group : int
        Of the density.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        For another field, or a map not over two components.
    """
    grid = cells.grid
    if len(grid.names) != 2:
        raise ValueError(f"a map of cells over {len(grid.names)} components cannot be drawn; it must be two")
    if field not in ("labels", "doubt", "time", "density"):
        raise ValueError(f"field = {field!r} is not allowed; it must be labels, doubt, time or density")
    if group:
        whole("plot_cells", "group", group, most=len(cells.groups) - 1)
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.4)
    (left, bottom), (right, top) = grid.low, grid.high
    drawn = {"origin": "lower", "extent": (left, right, bottom, top), "interpolation": "nearest", "aspect": "auto"}
    if field == "labels":
        _labels(cells, ax, drawn)
    else:
        _field(cells, ax, field, group, drawn)
    half = max(sum(name[0] == "q" for name in grid.names), 1)
    states = states_of(cells)
    across, up = (style.component_label(_component(name, half, states), half, states) for name in grid.names)
    ax.set(xlabel=f"{across} at phase 0", ylabel=f"{up} at phase 0", xlim=(left, right), ylim=(bottom, top))
    return ax


def _labels(cells: Any, ax: Axes, drawn: dict) -> None:
    count = len(cells.attractors)
    codes = np.where(cells.labels >= 0, cells.labels + 3, cells.fates - 1)
    tints = ListedColormap([_WHITE, _LEFT, _BEYOND, *(_COLORS[k % len(_COLORS)][0] for k in range(count))])
    ax.imshow(codes.T, cmap=tints, vmin=-0.5, vmax=count + 2.5, **drawn)
    handles: list[Any] = []
    for label, item in enumerate(cells.attractors):
        tint, color = _COLORS[label % len(_COLORS)]
        words = f"{describe(item)}: {_percent(cells.fractions[label])}"
        points = cells.points(label)
        ax.plot(points[:, 0], points[:, 1], linestyle="none", marker="o", markerfacecolor=color, markeredgecolor="white",
                markersize=6 if len(points) < 200 else 1.5, markeredgewidth=0.9 if len(points) < 200 else 0, zorder=5)
        handles.append(Patch(facecolor=tint, edgecolor=color, linewidth=0.8, label=words))
    for fate, tint, words in ((0, _WHITE, "no confirmed attractor"), (1, _LEFT, "leaves the grid"),
                              (2, _BEYOND, "beyond the stop")):
        if (codes == fate).any():
            handles.append(Patch(facecolor=tint, edgecolor="black", linewidth=0.6, label=words))
    spurious = [item for item in cells.groups if item.kind == "spurious"]
    if spurious:
        points = cells.grid.points(np.concatenate([item.cells for item in spurious]))
        handles += ax.plot(points[:, 0], points[:, 1], linestyle="none", marker="x", color="black", markersize=5,
                           markeredgewidth=1.0, zorder=6, label=f"{len(spurious)} spurious group{'s' * (len(spurious) > 1)}")
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.13), borderaxespad=0.0, ncols=2)
    kind = "simple" if cells.samples == 1 else "generalized"
    words = f"{kind} cell mapping, {cells.labels.shape[0]} x {cells.labels.shape[1]} cells, {cells.periods} periods a mapping"
    if cells.audit is not None:
        words += f"; wrong labels {100 * cells.audit.fraction:.2g} % (95 %: up to {100 * cells.audit.bounds[1]:.2g} %)"
    ax.set_title(words, loc="right", fontsize=7.5)


def _field(cells: Any, ax: Axes, field: str, group: int, drawn: dict) -> None:
    start = cells.fates != 3
    if field == "density":
        values = cells.density(group) / np.prod(cells.grid.widths)
        values = np.ma.masked_where(values <= 0, values)
        norm = LogNorm(max(values.min(), values.max() * 1e-4), values.max())
        image = ax.imshow(values.T, cmap="magma_r", norm=norm, **drawn)
        words = "stationary density"
    else:
        found = cells.absorption()
        if field == "time":
            values, words = found.time, "expected forcing periods until absorbed"
        else:
            best = np.concatenate((found.probability, found.unresolved[..., None], found.left[..., None]), axis=-1).max(axis=-1)
            values, words = 1.0 - best, "chance of another end"
        image = ax.imshow(np.ma.masked_where(~start, values).T, cmap="cividis" if field == "time" else "Greys", **drawn)
    ax.figure.colorbar(image, ax=ax, label=words)


@style.styled
@checked(cells=like("a CellMap", "morse", "groups"), least=COUNT)
def plot_morse(cells: Any, ax: Axes | None = None, least: int = 1) -> Axes:
    """Draw the Morse graph of a map of cells: recurrent groups, the closed ones at the bottom, arrows along the motion.

    Discs are transient groups, squares closed ones in the colour of their attractor; areas grow with the logarithm of the cells.

    Parameters
    ----------
    cells : CellMap
        Anything with ``morse`` (networkx.DiGraph, see `bifurc.basins.cells.morse.morse_graph`) and ``attractors``.
    ax : matplotlib.axes.Axes, optional
    least : int
        Transient groups of fewer cells are left out; what they connect stays connected.

    Returns
    -------
    matplotlib.axes.Axes
    """
    import networkx  # heavy, for this graph alone
    graph = cells.morse
    kept = [node for node, content in graph.nodes(data=True) if content["closed"] or content["cells"] >= least]
    closure = networkx.transitive_closure_dag(graph).subgraph(kept)
    graph = networkx.transitive_reduction(closure)
    graph.add_nodes_from((node, cells.morse.nodes[node]) for node in kept)
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.2)
    height: dict = {}
    for node in reversed(list(networkx.topological_sort(graph))):
        height[node] = 1 + max((height[after] for after in graph.successors(node)), default=-1)
    levels: dict[int, list] = {}
    for node, level in height.items():
        levels.setdefault(level, []).append(node)
    place: dict = {}
    for level in sorted(levels):
        def wish(node):
            after = [place[other][0] for other in graph.successors(node)]
            return np.mean(after) if after else (cells.morse.nodes[node]["low"] or (np.inf,))[0]
        row = sorted(levels[level], key=lambda node: (wish(node), str(node)))
        for k, node in enumerate(row):
            place[node] = ((k + 0.5) / len(row), float(level))
    for tail, head in sorted(graph.edges, key=str):  # sets of nodes have no order
        ax.annotate("", place[head], place[tail], zorder=1,
                    arrowprops={"arrowstyle": "-|>", "color": style.GREY, "linewidth": 0.9, "shrinkA": 11, "shrinkB": 13})
    for node, (x, y) in place.items():
        content = cells.morse.nodes[node]
        label = content["attractor"]
        color = _COLORS[label % len(_COLORS)][0] if label >= 0 else "white"
        size = 160 + 110 * np.log10(max(content["cells"], 1))
        ax.scatter([x], [y], s=size, marker="s" if content["closed"] else "o", facecolor=color, edgecolor="black",
                   linewidth=0.9, zorder=3)
        if node == "left":
            words = "left the grid"
        else:
            what = f"{content['cells']} cell{'s' * (content['cells'] > 1)}"
            turns = f", period {content['period']}" if content["period"] > 1 else ""
            named = f"\n{describe(cells.attractors[label])}" if label >= 0 else f"\n{content['kind']}" if content["closed"] else ""
            words = what + turns + named
        offset = (0, -13 - 0.028 * size) if content["closed"] else (13, 0)
        ax.annotate(words, (x, y), offset, textcoords="offset points", fontsize=7, ha="center" if content["closed"] else "left",
                    va="top" if content["closed"] else "center", zorder=4)
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(-0.75, max(height.values(), default=0) + 0.4)
    ax.set_xticks([])
    ax.set_yticks([])
    hidden = cells.morse.number_of_nodes() - len(kept)
    words = f"Morse graph, {cells.periods} period{'s' * (cells.periods > 1)} a mapping"
    ax.set_title(words + (f"; {hidden} transient groups below {least} cells not drawn" if hidden else ""), loc="right",
                 fontsize=7.5)
    return ax
