"""Sweeps, brute-force bifurcation diagrams and charts over two parameters."""
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap

from ..checks import ALL_DRAWN, SET, checked, choice, like, whole
from ..structure.components import states_of, worded
from . import style
from .basins import _COLORS, _places, draw_sets, plot_basins, section_points
from .branches import plot_branch
from .motions.phase_plane import describe

_MEASURES = {"max": "maximum", "min": "minimum", "rms": "rms"}  # of an orbit, by the first part of a column's name
_SHOWN = 6  # families with a colour of their own: those that hold the largest shares
_LEFT = 0.005  # share of unresolved starts that is drawn
_FIELDS = {"periods": "period of the motion most starts reach", "impacts": "impacts a forcing period",
           "attractors": "motions reached", "exponents": "largest Lyapunov exponent"}


def _measured(owner: str, measure: str, names: tuple[str, ...], n: int) -> list[str]:
    """Return name and coordinate of a measure, or raise ValueError unless it is one of those drawn."""
    return choice(owner, "measure", measure, tuple(f"{name}_{dof}" for name in names for dof in range(n))).split("_")


@style.styled
@checked(sweep=like("a Sweep", "tracks", "fractions"), branches=ALL_DRAWN)
def plot_sweep(sweep: Any, axes: Sequence[Axes] | None = None, branches: Sequence[Any] = (),
               measure: str = "rms_0") -> Sequence[Axes]:
    """Draw the attractors of a sweep on the branches of `trace`, above the share of the starts that each attracts.

    Parameters
    ----------
    sweep : Sweep
        Anything with ``parameter``, ``values`` (m,), ``tracks`` (``number``, ``values``, ``attractors``, ``fractions``),
        ``families`` (tuples of track numbers) and ``fractions`` (m, tracks).
    axes : two matplotlib.axes.Axes, optional
    branches : sequence of Branch
        Of the same parameter.
    measure : str
        ``max_i``, ``min_i`` or ``rms_i``: vertical axis of the upper picture.  Chaotic attractors have none: they are
        marked at its lower edge.

    Returns
    -------
    two matplotlib.axes.Axes
    """
    if axes is None:
        from matplotlib import pyplot  # opens a window system where there is one: only for figures of our own

        _, axes = pyplot.subplots(2, 1, figsize=(6.3, 5.4), layout="constrained", sharex=True)
    above, below = axes
    name, dof = _measured("plot_sweep", measure, tuple(_MEASURES), sweep.system.n)
    tracks = {track.number: track for track in sweep.tracks}
    for branch in branches:
        plot_branch(branch, above, measure, points=False)
    shares = sweep.fractions
    families = sorted(sweep.families, key=lambda family: -float(shares[:, list(family)].sum()))
    own, others = families[:_SHOWN], families[_SHOWN:]
    for k, family in enumerate(families):
        color = _COLORS[k][1] if k < _SHOWN else style.GREY
        for track in (tracks[number] for number in family):
            chaotic = [not item.periodic for item in track.attractors]
            heights = [getattr(item, _MEASURES[name])(int(dof)) for item in track.attractors if item.periodic]
            above.plot(track.values[~np.array(chaotic)], heights, linestyle="none", marker="o", markersize=2.2, color=color,
                       zorder=4)
            chaos = track.values[np.array(chaotic)]
            above.plot(chaos, np.full(len(chaos), 0.02), linestyle="none", marker="|", markersize=6, color=color,
                       transform=above.get_xaxis_transform(), zorder=4)
    stack = [shares[:, list(family)].sum(axis=1) for family in own]
    words = [_family([tracks[number] for number in family]) for family in own]
    for k in [k for k, word in enumerate(words) if words.count(word) > 1]:  # motions of one period differ by what happens in it
        words[k] = describe(tracks[own[k][0]].attractors[0])
    tints, edges = [tint for tint, _ in _COLORS[:len(own)]], [color for _, color in _COLORS[:len(own)]]
    if others:
        stack.append(sum(shares[:, list(family)].sum(axis=1) for family in others))
        words.append(f"{len(others)} other{'s' * (len(others) > 1)}")
        tints.append("#d9d9d9")
        edges.append(style.GREY)
    if (left := 1.0 - shares.sum(axis=1)).max() > _LEFT:
        stack.append(np.maximum(left, 0.0))
        words.append("unresolved")
        tints.append("white")
        edges.append("black")
    areas = below.stackplot(sweep.values, np.array(stack), colors=tints, labels=words) if stack else []
    for area, edge in zip(areas, edges, strict=True):
        area.set_edgecolor(edge)
        area.set_linewidth(0.6)
    below.set_xlim(np.min(sweep.values), np.max(sweep.values))
    below.set_ylim(0.0, 1.0)
    below.set_xlabel(style.parameter_label(sweep.parameter))
    below.set_ylabel("share of starts")
    above.set_xlabel("" if above.get_shared_x_axes().joined(above, below) else style.parameter_label(sweep.parameter))
    single = all(item.sections.shape[1] == 2 for track in tracks.values() for item in track.attractors)
    above.set_ylabel(style.measure_label(measure, single))
    if stack:
        below.legend(loc="upper left", bbox_to_anchor=(0.0, -0.22), borderaxespad=0.0, ncols=2)
    return axes


def _family(tracks: Sequence[Any]) -> str:
    """Return the periods of a family in words, in order of appearance."""
    kinds = list(dict.fromkeys(item.periods or 0 for track in tracks for item in track.attractors))
    text = [str(kind) if kind else "chaotic" for kind in kinds]
    text = text if len(text) <= 5 else [*text[:4], "..."]
    return ("period " if kinds[0] else "") + r" $\to$ ".join(text)


@style.styled
@checked(ramp=like("a Ramp", "maximum", "directions"), branches=ALL_DRAWN)
def plot_ramp(ramp: Any, ax: Axes | None = None, measure: str = "max_0", branches: Sequence[Any] = ()) -> Axes:
    """Draw the largest or least displacement of a motion while a parameter runs up and down, and where it jumps.

    Parameters
    ----------
    ramp : Ramp
        Anything with ``parameter``, ``directions``, ``values`` (directions, m), ``maximum`` and ``minimum`` (directions, m, n),
        and ``jumps`` with ``direction`` and ``value``.
    ax : matplotlib.axes.Axes, optional
    measure : str
        ``max_i`` or ``min_i``, i the coordinate.
    branches : sequence of Branch
        Of the same parameter, drawn in the same measure.

    Returns
    -------
    matplotlib.axes.Axes
    """
    name, dof = _measured("plot_ramp", measure, ("max", "min"), ramp.maximum.shape[-1])
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    heights = (ramp.maximum if name == "max" else ramp.minimum)[..., int(dof)]
    for branch in branches:
        plot_branch(branch, ax, measure)
    for k, direction in enumerate(ramp.directions):
        color, marker = (style.BLUE, "^") if direction == "up" else (style.VERMILION, "v")
        ax.plot(ramp.values[k], heights[k], color=color, linewidth=1.0, alpha=0.9, zorder=6,
                label=f"run-{direction}, jumps marked", marker=marker, markersize=5, markeredgecolor="white",
                markeredgewidth=0.5, markevery=[int(np.argmin(np.abs(ramp.values[k] - jump.value))) for jump in ramp.jumps
                                                if jump.direction == direction])
    ax.set_xlim(ramp.values.min(), ramp.values.max())
    ax.set_xlabel(style.parameter_label(ramp.parameter))
    ax.set_ylabel(style.measure_label(measure, heights is not None and ramp.maximum.shape[-1] == 1))
    style.legend(ax)
    return ax


@style.styled
@checked(diagram=like("a BifurcationDiagram", "points", "directions"), branches=ALL_DRAWN)
def plot_diagram(diagram: Any, ax: Axes | None = None, component: int = 0, branches: Sequence[Any] = ()) -> Axes:
    """Draw a component of the section points over the parameter: up in one colour, down in another.

    Parameters
    ----------
    diagram : BifurcationDiagram
        Anything with ``parameter``, ``values`` (m,), ``directions`` and ``points`` (directions, m, starts, keep, ns).
    ax : matplotlib.axes.Axes, optional
    component : int
        Of the state.
    branches : sequence of Branch
        With the recorded or measured column ``state_<component>``, if they have it; others are left out.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    ns = diagram.points.shape[-1]
    whole("plot_diagram", "component", component, most=ns - 1)
    for k, direction in enumerate(diagram.directions):
        values = diagram.points[k][..., component].reshape(len(diagram.values), -1)
        x = np.repeat(diagram.values, values.shape[1])
        good = np.isfinite(values.ravel())
        color, size = (style.VERMILION, 2.2) if direction == "down" and len(diagram.directions) > 1 else (style.BLUE, 0.9)
        ax.plot(x[good], values.ravel()[good], linestyle="none", marker=".", markersize=size, markeredgewidth=0.0, color=color,
                label=f"{direction}wards", rasterized=True, zorder=2 if direction == "down" else 3)
    for branch in branches:
        measure = worded(f"state_{component}", states_of(diagram))
        if measure in branch.column_names:
            plot_branch(branch, ax, measure, points=False)
    ax.set_xlim(diagram.values[0], diagram.values[-1]) if len(diagram.values) > 1 else None
    ax.set_xlabel(style.parameter_label(diagram.parameter))
    ax.set_ylabel(style.component_label(component, ns // 2, states_of(diagram)) + " at phase 0")
    style.legend(ax, markerscale=5)
    return ax


@style.styled
@checked(chart=like("a ParameterChart", "parameters", "values"))
def plot_chart(chart: Any, ax: Axes | None = None, field: str = "periods") -> Axes:
    """Draw one field of a chart over its two parameters.

    Parameters
    ----------
    chart : ParameterChart
        Anything with ``parameters`` (two names), ``values`` (two rows) and the field (a, b).
    ax : matplotlib.axes.Axes, optional
    field : {"periods", "impacts", "attractors", "exponents"}

    Returns
    -------
    matplotlib.axes.Axes
    """
    if field not in _FIELDS:
        raise ValueError(f"field = {field!r} is not allowed; it must be one of {', '.join(_FIELDS)}")
    if ax is None:
        (ax,) = style.shown_figure(6.3, 4.4)
    values = np.asarray(getattr(chart, field), float)
    x, y = (_edges(np.asarray(row, float)) for row in chart.values)
    if field in ("periods", "attractors"):
        kinds = sorted(set(values.astype(int).ravel().tolist()))
        order = [kind for kind in kinds if kind > 0][:10]
        rest = [kind for kind in kinds if kind > 0][10:]
        table = {kind: i for i, kind in enumerate(order)} | {kind: len(order) for kind in rest}
        words = [str(kind) for kind in order] + ([str(rest[0]) if len(rest) == 1 else f"{rest[0]}..{rest[-1]}"] if rest else [])
        colors = [_PALETTE[i % len(_PALETTE)] for i in range(len(words))]
        for kind, word, color in ((0, "none" if field == "periods" else "0", "#303030"), (-1, "ended", "#ffffff")):
            if kind in kinds:
                table[kind] = len(words)
                words.append(word)
                colors.append(color)
        shown = np.vectorize(table.get)(values.astype(int))
        norm = BoundaryNorm(np.arange(-0.5, len(words)), len(words))
        drawn = ax.pcolormesh(x, y, shown.T, cmap=ListedColormap(colors), norm=norm, rasterized=True)
        bar = ax.figure.colorbar(drawn, ax=ax, ticks=np.arange(len(words)))
        bar.ax.set_yticklabels(words)
        bar.ax.minorticks_off()
    else:
        finite = np.ma.masked_invalid(values)
        limit = float(np.abs(finite).max()) if finite.count() and field == "exponents" else None
        drawn = ax.pcolormesh(x, y, finite.T, cmap="RdBu_r" if field == "exponents" else "viridis", rasterized=True,
                              vmin=None if limit is None else -limit, vmax=limit)
        bar = ax.figure.colorbar(drawn, ax=ax)
        ax.set_facecolor("#d9d9d9")
    bar.set_label(_FIELDS[field])
    ax.set_xlabel(style.parameter_label(chart.parameters[0]))
    ax.set_ylabel(style.parameter_label(chart.parameters[1]))
    return ax


_PALETTE = [style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, style.YELLOW, "#8a8200", "#7f3b08",
            "#5e4fa2", style.GREY]


def _edges(centres: np.ndarray) -> np.ndarray:
    """Return the edges of cells around their centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]))


@style.styled
@checked(edge=like("an EdgeState", "basins", "saddle"), unstable=SET, stable=SET)
def plot_edge(edge: Any, ax: Axes | None = None, unstable: Any = None, stable: Any = None) -> Axes:
    """Draw a basin map with the saddle on the boundary of two basins, and its unstable and stable sets.

    Parameters
    ----------
    edge : EdgeState
        Anything with ``basins`` (`plot_basins`, when ``ax`` is not given) and ``saddle`` (an orbit, or None).
    ax : matplotlib.axes.Axes, optional
        With the map drawn.
    unstable, stable : UnstableSet, StableSet, optional
        Anything with ``points`` (k, ns) and ``curves`` (k,): black, and white.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        ax = plot_basins(edge.basins)
    n, (i, j) = edge.basins.system.n, _places(edge.basins)
    bounds = ax.get_xlim(), ax.get_ylim()
    draw_sets(ax, edge.basins.grid, n, unstable, stable, states_of(edge.basins))
    if edge.saddle is not None:
        points = section_points(edge.saddle)
        ax.plot(points[:, i], points[:, j], linestyle="none", marker="P", markersize=7, markerfacecolor="white",
                markeredgecolor="black", markeredgewidth=1.0, zorder=6, label="saddle")
    ax.set_xlim(bounds[0])
    ax.set_ylim(bounds[1])
    return ax
