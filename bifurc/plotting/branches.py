"""Branch diagrams: a measure over the parameter, with stability, contact and special points told apart."""
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import Normal, Stroke

from ..checks import ALL_DRAWN, DRAWN, array, checked, flag, of
from ..structure.components import worded
from . import style

_DASHES = {1: "-", 0: (0, (3.2, 1.6)), -1: (0, (1, 1.5))}
_FINE = 8  # drawn pieces of the smooth line between two rows
_WORDS = {1: "stable", 0: "unstable", -1: "stability unknown"}
# what motions without and with events are called, by the kinds of events there are
_CONTACTS = (({"impact", "release", "chatter", "graze"}, ("free, ", "impacting, ")),
             ({"contact", "separation", "graze"}, ("free, ", "in contact, ")),
             ({"stick", "slip"}, ("stuck, ", "slipping, ")))


@style.styled
@checked(branch=DRAWN, points=flag)
def plot_branch(branch: Any, ax: Axes | None = None, measure: str | None = None, points: bool = True) -> Axes:
    """Draw a branch: stable solid, unstable dashed, motions with and without events in two colours, special points marked.

    Parameters
    ----------
    branch : Branch
        Anything with ``parameter`` (str), ``column(name)`` for ``s``, the parameter, the measure and, where they exist,
        ``stable`` and ``n_events``, and ``special_points`` with ``kind``, ``parameter`` and ``s``; where there is
        ``n_events``, also ``orbits``, whose ``events`` have a ``kind``: the legend says what happens (impacting, in
        contact, slipping).
    ax : matplotlib.axes.Axes, optional
        Drawn on; several branches on the same axes share one legend.
    measure : str, optional
        Column on the vertical axis; by default ``rms_0``, because the largest displacement of a motion that hits a
        rigid stop is the gap all along the branch, or ``u_0`` for an algebraic problem.
    points : bool
        Whether special points are marked.

    After ``branch.certify()`` proved rows carry dots, and proved special points rings.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(6.3, 3.9)
    measure = worded(measure or default_measure(branch), getattr(branch, "states", ()))
    lines, at_points = runs(branch, measure)
    for word, contact, stable, px, py in lines:
        color = style.BLACK if contact is None else (style.IMPACTING if contact else style.FREE)
        # dashes lie above full lines and have a light edge: an unstable motion is seen where a stable one covers it
        (line,) = ax.plot(px, py, color=color, linestyle=_DASHES[stable], linewidth=1.6 if stable == 1 else 1.2,
                          label=word, solid_capstyle="round", zorder=3 if stable == 1 else 3.5)
        if stable != 1:
            line.set_path_effects([Stroke(linewidth=3.0, foreground="white"), Normal()])
    certificate = branch.certificate
    if certificate is not None:
        _mark_proved(ax, branch, certificate, measure, at_points if points else [])
    if points:
        for point, value in zip(branch.special_points, at_points, strict=True):
            kind = str(point.kind)
            marker, face, word = style.POINTS.get(kind, ("o", style.GREY, kind.replace("_", " ")))
            ax.plot([point.parameter], [value], linestyle="none", marker=marker, markersize=6.5 if marker == "*" else 5,
                    markerfacecolor=face, markeredgecolor="black", markeredgewidth=0.8, label=word, zorder=5)
    ax.set_xlabel(style.parameter_label(branch.parameter))
    ax.set_ylabel(style.measure_label(measure, single=_column(branch, "rms_1") is None))
    style.legend(ax)
    return ax


def _mark_proved(ax: Axes, branch: Any, certificate: Any, measure: str, at_points) -> None:
    """Mark proved rows by dots, and proved special points by rings."""
    x, y = (np.asarray(branch.column(name), float) for name in (branch.parameter, measure))
    proved = certificate.proved_rows
    ax.plot(x[proved], y[proved], linestyle="none", marker=".", markersize=6, color=style.GREEN, zorder=4, label="proved")
    for point, value, found in zip(branch.special_points, at_points, certificate.points, strict=False):
        if found.proved:
            ax.plot([point.parameter], [value], linestyle="none", marker="o", markersize=11, markerfacecolor="none",
                    markeredgecolor=style.GREEN, markeredgewidth=1.2, zorder=4)


@checked(branches=ALL_DRAWN)
def plot_branches(branches: Iterable[Any], ax: Axes | None = None, measure: str | None = None) -> Axes:
    """Draw several branches of one parameter on the same axes; see `plot_branch`."""
    branches = list(branches)
    parameters = {branch.parameter for branch in branches}
    if len(parameters) != 1:
        raise ValueError(f"branches must share one parameter, got {sorted(parameters) or 'no branch'}")
    for branch in branches:
        ax = plot_branch(branch, ax, measure)
    assert ax is not None
    return ax


def default_measure(branch: Any) -> str:
    """Return the column that a diagram shows when none is named."""
    return "rms_0" if _column(branch, "rms_0") is not None else "u_0"


def runs(branch: Any, measure: str) -> tuple[list[tuple[str, bool | None, int, np.ndarray, np.ndarray]], list[float]]:
    """Return the lines ``(words, contact, stable, x, y)`` of a branch, and the measure at its special points."""
    s, x, y = (np.asarray(branch.column(name), float) for name in ("s", branch.parameter, measure))
    special = list(branch.special_points)
    at_points = [_value(point, measure, s, y) for point in special]
    words = _contact_words(branch)
    rest = "at rest, " if _column(branch, "eigenvalue_0") is not None else ""
    return [((rest if contact is None else words[contact]) + _WORDS[stable], contact, stable, px, py)
            for (contact, stable), px, py in pieces(branch, s, x, y, special, at_points)], at_points


def pieces(branch: Any, s, x, y, special, at_points) -> list[tuple[tuple[bool | None, int], np.ndarray, np.ndarray]]:
    """Return the runs of equal style ``((contact, stable), x, y)``; a style changes exactly at a special point.

    Between a row and a special point the style is the row's; where it changes with no special point between two rows,
    it changes half way. Within a stretch of equal contact the lines are smooth; where contact begins they may have a
    corner.
    """
    keys = list(zip(_contact(branch, s.size), _stable(branch, s.size), strict=True))
    nodes, styles = _nodes(s, x, y, keys, special, at_points)
    runs = []
    start = 0
    for i in range(1, len(styles) + 1):
        if i < len(styles) and styles[i][0] == styles[start][0]:
            continue
        curve = _smooth(nodes[start:i + 1])
        first = start
        for k in range(start + 1, i + 1):
            if k == i or styles[k] != styles[first]:
                line = curve[(first - start) * _FINE:(k - start) * _FINE + 1]
                runs.append((styles[first], line[:, 0], line[:, 1]))
                first = k
        start = i
    return runs


def _nodes(s, x, y, keys, special, at_points) -> tuple[np.ndarray, list]:
    """Return rows and special points in one line ``(s, x, y)`` (m, 3), and the style of each interval between them."""
    marked = {point.s for point in special}
    order = np.argsort([point.s for point in special], kind="stable")
    nodes: list[tuple[float, float, float, int | None]] = []  # s, x, y, row
    k = 0
    for row in range(s.size):
        while k < len(order) and special[order[k]].s <= s[row]:
            point = order[k]
            nodes.append((special[point].s, special[point].parameter, at_points[point], None))
            k += 1
        if row and keys[row] != keys[row - 1] and nodes[-1][3] is not None and s[row - 1] not in marked:
            nodes.append(((s[row - 1] + s[row]) / 2, (x[row - 1] + x[row]) / 2, (y[row - 1] + y[row]) / 2, None))
        nodes.append((s[row], x[row], y[row], row))
    nodes += [(special[i].s, special[i].parameter, at_points[i], None) for i in order[k:]]

    kept, styles = nodes[:1], []
    last = keys[0] if keys else (None, -1)
    for before, after in zip(nodes, nodes[1:], strict=False):
        if after[3] is not None:
            last = keys[after[3]]
        elif before[3] is not None:
            last = keys[before[3]]
        if after[0] - kept[-1][0] > 1e-12 * (nodes[-1][0] - nodes[0][0]):
            kept.append(after)
            styles.append(last)
        elif after[3] is None:  # a row on a special point: the point is the more exact
            kept[-1] = after
    return np.array([node[:3] for node in kept], float), styles


def _smooth(nodes: np.ndarray) -> np.ndarray:
    """Return points ``(x, y)``, `_FINE` an interval, of monotone cubics over s: between two nodes no value beyond theirs.

    Slopes of parabolas, limited as by Fritsch & Carlson (1980): a row that was stored next to a fast change does not swing.
    """
    h = np.diff(nodes[:, 0])
    if len(h) < 2:
        return np.linspace(nodes[0, 1:], nodes[-1, 1:], len(h) * _FINE + 1)
    chord = np.diff(nodes[:, 1:], axis=0) / h[:, None]
    slope = np.empty((len(nodes), 2))
    left, right = h[:-1, None], h[1:, None]
    slope[1:-1] = (right * chord[:-1] + left * chord[1:]) / (left + right)
    slope[0], slope[-1] = 2 * chord[0] - slope[1], 2 * chord[-1] - slope[-2]
    before, after = np.vstack([chord[:1], chord]), np.vstack([chord, chord[-1:]])
    steepest = np.where(before * after > 0.0, 3.0 * np.minimum(np.abs(before), np.abs(after)), 0.0)
    slope = np.where(slope * before > 0.0, np.sign(slope) * np.minimum(np.abs(slope), steepest), 0.0)
    t = (np.arange(_FINE) / _FINE)[None, :, None]
    a, b = nodes[:-1, None, 1:], nodes[1:, None, 1:]
    da, db = (part[:, None] * h[:, None, None] for part in (slope[:-1], slope[1:]))
    curve = a + (b - a) * t * t * (3 - 2 * t) + t * (1 - t) * ((1 - t) * da - t * db)
    curve = np.clip(curve, np.minimum(a, b), np.maximum(a, b))  # but for rounding it lies there
    return np.vstack([curve.reshape(-1, 2), nodes[-1:, 1:]])


def _value(point: Any, measure: str, s, y) -> float:
    """Return the measure at a special point: its own if it carries one, otherwise between the rows around it."""
    if measure in point.measures:
        return float(point.measures[measure])
    return float(np.interp(point.s, s, y))


def _contact(branch: Any, n: int) -> list[bool | None]:
    counts = _column(branch, "n_events")
    if counts is None:
        return [None] * n
    found = np.asarray(counts) > 0
    ends = np.flatnonzero(np.diff(found.astype(int))) + 1
    for rows in np.split(np.arange(n), ends):  # of motions without events one tells whether all of them touch
        if not found[rows[0]] and len(branch.orbits) > 0:
            found[rows] = "in contact" in branch.orbits[int(rows[len(rows) // 2])].signature
    return [bool(touches) for touches in found]


def _contact_words(branch: Any) -> tuple[str, str]:
    """Return what the legend calls motions without and with events."""
    counts = _column(branch, "n_events")
    orbits: Any = () if counts is None else branch.orbits
    moves = len(orbits) > 0 and orbits[0].autonomous  # without excitation nothing that is stuck vibrates
    if counts is None or not np.any(counts > 0):
        if len(orbits) > 0 and _one_mode(orbits[0]):
            return "", ""
        touches = len(orbits) > 0 and "in contact" in orbits[0].signature
        return ("vibrating, ", "") if moves else _CONTACTS[int(touches)][1]
    most = np.flatnonzero(counts == np.max(counts))  # the middle one: the first may lie on an onset, with nothing seen yet
    kinds = {str(event.kind) for event in branch.orbits[int(most[len(most) // 2])].events}
    for allowed, words in _CONTACTS:
        if kinds <= allowed:
            return ("sliding, ", "stick-slip, ") if moves and "stick" in kinds else words
    return "without events, ", "with events, "


def _one_mode(orbit: Any) -> bool:
    """Return whether no element of the orbit's system has a second mode, so that nothing can happen on any motion."""
    return all(tuple(element.start) == ("always",) for element in orbit.system.elements)


def _stable(branch: Any, n: int) -> list[int]:
    """Return 1 stable, 0 unstable, -1 unknown for each row."""
    column = _column(branch, "stable")
    if column is None:
        return [-1] * n
    return [-1 if value is None or value != value or value not in (0, 1) else int(value) for value in column]


def _column(branch: Any, name: str):
    try:
        return branch.column(name)
    except (KeyError, ValueError):  # an algebraic problem has neither events nor stability
        return None


@style.styled
@checked(points=of(array, axes=(2,)), away=None)
def plot_over(ax: Axes, points, away) -> Axes:
    """Lay points (k, 2) over a diagram; the legend tells their mean and largest distance ``away`` (k,) from it.

    Points that nothing reaches (infinite distance) are drawn hollow and counted apart.
    """
    found, away = np.asarray(points, float), np.asarray(away, float)
    near = np.isfinite(away)
    if near.any():
        word = f"points, distance {away[near].mean():.2g} (largest {away[near].max():.2g})"
        ax.plot(found[near, 0], found[near, 1], "x", color=style.BLACK, markersize=4.5, label=word, zorder=6)
    if not near.all():
        ax.plot(found[~near, 0], found[~near, 1], "o", markerfacecolor="none", markeredgecolor=style.BLACK, markersize=4.5,
                label=f"{int((~near).sum())} points beyond the branch", zorder=6)
    style.legend(ax)
    return ax
