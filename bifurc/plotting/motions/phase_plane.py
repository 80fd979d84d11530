"""One motion: its phase plane with the stops, and its time history with the events."""
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ...checks import MOVING, checked, like, of, whole
from .. import style
from .rotors import draw_rotor, relative, ring_of

_JUMPS = ("impact", "chatter", "reset")  # kinds of event at which a velocity or a state jumps


@style.styled
@checked(orbit=like("a periodic orbit, see find_orbit", "sample", "system", "period", "periods"),
         samples=of(whole, least=2, most=10**8))
def plot_orbit(orbit: Any, axes: Sequence[Axes] | None = None, dof: int = 0, samples: int = 4000) -> list[Axes]:
    """Draw a periodic orbit: phase plane with the stops, and one period against time with the events marked.

    Of a rotor in a stator the path in the plane is drawn, and its distance from the centre of the stator.  Section points, one a
    forcing period, are dots.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Anything with ``sample(n) -> t (n,), y (n, 2 dofs)``, ``events`` (rows with ``time``, ``kind``), ``period``,
        ``periods``, ``stable`` and ``system``.
    axes : two matplotlib.axes.Axes, optional
    dof : int
        Displacement that is drawn.
    samples : int

    Returns
    -------
    list of two matplotlib.axes.Axes
    """
    t, y = orbit.sample(samples)
    unit = orbit.period / orbit.periods if _forced(orbit.system) else 1.0
    axes = _draw(t, y, orbit.events, orbit.system, axes, dof, unit)
    axes[1].set_xlim(t[0] / unit, (t[0] + orbit.period) / unit)
    forced = _forced(orbit.system)
    _sections(axes[0], orbit.system, t, y, t[0] + unit * np.arange(orbit.periods if forced else 1), dof,
              "section point, phase 0" if forced else "time 0")
    _legend(axes[0])
    stable = {True: ", stable", False: ", unstable", None: ""}[orbit.stable]
    legend = axes[1].get_legend()
    if legend is None:
        axes[1].set_title(describe(orbit) + stable, loc="right", fontsize=8)
    else:  # above the entries, which lie above the axes
        legend.set_title(describe(orbit) + stable)
        legend.get_title().set_fontsize(8)
        legend.set_alignment("left")
    return axes


@style.styled
@checked(trajectory=MOVING)
def plot_trajectory(trajectory: Any, axes: Sequence[Axes] | None = None, dof: int = 0,
                    samples: int = 8000) -> list[Axes]:
    """Draw a simulated motion: phase plane with the stops, and time history with the events.

    Parameters
    ----------
    trajectory : Trajectory
        Anything with ``sample(n) -> t (n,), y (n, 2 dofs)``, ``events`` and ``system``.
    axes : two matplotlib.axes.Axes, optional
    dof : int
        Displacement that is drawn.
    samples : int

    Returns
    -------
    list of two matplotlib.axes.Axes
    """
    t, y = trajectory.sample(samples)
    unit = 2 * math.pi / trajectory.system.omega if _forced(trajectory.system) else 1.0
    axes = _draw(t, y, trajectory.events, trajectory.system, axes, dof, unit)
    if t[-1] > t[0]:
        axes[1].set_xlim(t[0] / unit, t[-1] / unit)
    if _forced(trajectory.system) and ring_of(trajectory.system) is not None:
        whole = np.arange(math.ceil(t[0] / unit - 1e-9), math.floor(t[-1] / unit + 1e-9) + 1)
        _sections(axes[0], trajectory.system, t, y, whole * unit, dof, "section points, phase 0")
        _legend(axes[0])
    return axes


def _sections(ax: Axes, system: Any, t: np.ndarray, y: np.ndarray, times: np.ndarray, dof: int, words: str) -> None:
    """Mark where a motion is at some times: in the plane of a rotor, or in the phase plane."""
    ring = ring_of(system)
    path = _plane(system, t, y, dof)[0].T if ring is None else relative(ring, y)
    ax.plot(np.interp(times, t, path[:, 0]), np.interp(times, t, path[:, 1]), "k.", zorder=6, label=words,
            markersize=6 if len(times) < 20 else 3)


@checked(attractor=like("an orbit or an attractor", "regime"))
def describe(attractor: Any) -> str:
    """Return words for an attractor: its period in forcing periods, its impacts and its contacts with what gives way."""
    if attractor.regime:
        return attractor.regime
    kinds = [str(row.kind) for row in attractor.events]
    counts = {"impact": kinds.count("impact") + kinds.count("chatter"), "contact": kinds.count("contact")}
    hits = [f"{count} {word}" + "s" * (count > 1) for word, count in counts.items() if count]
    walls = [element.surface for element in attractor.system.elements if element.surface is not None]
    elastic = len(walls) > 0 and not any(wall.rigid for wall in walls)
    if attractor.autonomous:
        return ", ".join([f"cycle of {attractor.period:.4g}", *hits])
    return ", ".join([f"period {attractor.periods}", *(hits or ["no contact" if elastic else "no impact"])])


class Wall(NamedTuple):
    """A stop as a picture shows it."""

    position: float  # mean position of its surface
    side: int  # +1: the wall is above, -1: below
    rigid: bool
    swing: Callable[[np.ndarray], np.ndarray] | None  # displacement of a moving wall over time


def stops(system: Any, dof: int) -> list[Wall]:
    """Return the stops that limit one displacement: the ``surface`` of its elements."""
    found = []
    for surface in (element.surface for element in system.elements):
        if surface is None or surface.dof != dof:
            continue
        swing = partial(_wave, surface.amplitude, surface.harmonic * system.omega, surface.phase) if surface.amplitude else None
        found.append(Wall(surface.position, surface.side, surface.rigid, swing))
    return found


def _wave(amplitude: float, frequency: float, phase: float, t: np.ndarray) -> np.ndarray:
    return amplitude * np.cos(frequency * t + phase)


def _forced(system: Any) -> bool:
    return system.omega is not None


def _draw(t, y, events, system, axes, dof, unit) -> list[Axes]:
    phase, history = style.shown_figure(6.9, 3.1, columns=2, width_ratios=(1, 1.35)) if axes is None else axes
    ring = ring_of(system)
    if ring is not None:
        draw_rotor(ring, t, y, events, (phase, history), unit, "time / forcing period" if _forced(system) else "time")
        _legend(history)
        return [phase, history]
    (x, v), labels = _plane(system, t, y, dof, events)
    jumps = np.array([row.time for row in events if str(row.kind) in _JUMPS])
    cuts = np.searchsorted(t, jumps)
    cuts = np.unique(cuts[(cuts > 0) & (cuts < t.size)])
    for first, last in zip([0, *cuts], [*cuts, t.size], strict=True):
        phase.plot(x[first:last], v[first:last], color=style.BLUE, linewidth=1.2, zorder=3)
    for cut in cuts:
        phase.plot(x[cut - 1:cut + 1], v[cut - 1:cut + 1], color=style.VERMILION, linewidth=1.6,
                   linestyle=(0, (1.2, 0.9)), label="impact" if getattr(system, "n", 1) else "reset", zorder=4)
    history.plot(t / unit, x, color=style.BLUE, linewidth=1.2, zorder=3)
    for row in events:
        if t[0] <= row.time <= t[-1]:
            kind = str(row.kind)
            marker, color, word = style.EVENTS.get(kind, ("o", style.GREY, kind))
            history.plot(row.time / unit, np.interp(row.time, t, x), linestyle="none", marker=marker, markersize=4.5,
                         markerfacecolor=color, markeredgecolor="black", markeredgewidth=0.6, label=word, zorder=5)
    _walls(phase, history, stops(system, dof), t, unit)
    phase.set_xlabel(labels[0])
    phase.set_ylabel(labels[1])
    history.set_xlabel("time / forcing period" if _forced(system) else "time")
    history.set_ylabel(labels[0])
    phase.xaxis.set_major_locator(MaxNLocator(6))
    _legend(phase)
    _legend(history)
    return [phase, history]


def _plane(system, t, y, dof, events=()) -> tuple[np.ndarray, tuple[str, str]]:
    """Return what the phase plane shows (2, N), and the labels: a displacement and its velocity; of a system of first order a state
    and the next one, or its rate where there is no other."""
    if getattr(system, "n", 1):
        n = y.shape[1] // 2
        dof = whole("", "dof", dof, most=n - 1)
        return y[:, [dof, n + dof]].T, (style.component_label(dof, n), style.component_label(n + dof, n))
    names = [style.component_label(k, 0, system.states) for k in range(len(system.states))]
    dof = whole("", "dof", dof, most=len(names) - 1)
    if len(names) > 1:
        other = (dof + 1) % len(names)
        return y[:, [dof, other]].T, (names[dof], names[other])
    step = np.diff(t)
    rate = np.divide(np.diff(y[:, 0]), step, out=np.full(step.size, np.nan), where=step > 0.0)
    jumps = np.array([row.time for row in events if str(row.kind) in _JUMPS])
    over = np.searchsorted(t, np.append(jumps, jumps[jumps <= t[0]] + t[-1] - t[0]), side="left") - 1  # the intervals of resets
    rate[over[(over >= 0) & (over < rate.size)]] = np.nan
    return np.array([y[:, 0], np.append(rate, np.nan)]), (names[0], f"rate of {names[0]}")


def _legend(ax: Axes) -> None:
    """Draw the legend above the axes, where it hides nothing."""
    style.legend(ax, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=3)


def _walls(phase: Axes, history: Axes, walls: list[Wall], t, unit: float) -> None:
    """Hatch what lies behind each stop (an elastic one is only shaded), and leave a margin so that it is seen."""
    (left, right), (low, high) = phase.get_xlim(), history.get_ylim()
    low, high = min(low, left), max(high, right)
    margin = 0.06 * (high - low)
    swings = [np.zeros_like(t) if wall.swing is None else wall.swing(t) for wall in walls]
    for wall, swing in zip(walls, swings, strict=True):
        if wall.side > 0:
            high = max(high, wall.position + swing.max() + margin)
        else:
            low = min(low, wall.position + swing.min() - margin)
    for wall, swing in zip(walls, swings, strict=True):
        look: dict[str, Any] = {"facecolor": "#e6e6e6", "edgecolor": "#a0a0a0", "hatch": "////" if wall.rigid else "",
                                "linewidth": 0.0, "zorder": 0.5}
        end = high if wall.side > 0 else low
        history.fill_between(t / unit, wall.position + swing, end, **look)
        history.plot(t / unit, wall.position + swing, color="black", linewidth=0.9, zorder=1)
        if wall.swing is None:  # a moving wall has no place in the phase plane
            phase.axvspan(min(wall.position, end), max(wall.position, end), **look)
            phase.axvline(wall.position, color="black", linewidth=0.9, zorder=1)
    phase.set_xlim(low, high)
    history.set_ylim(low, high)
