"""Hysteresis loops: force over displacement with the events, and what the contact does over a period."""
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ...checks import checked, like
from .. import style

SHADES = {"stick": "#FFFFFF", "slip+": "#FBD7B5", "slip-": "#CFE3F2", "apart": "#DDDDDD"}  # modes of a contact


@style.styled
@checked(loop=like("a loop of hysteresis(...)", "sample", "displacement", "force"))
def plot_loop(loop: Any, ax: Axes | None = None, samples: int = 1440, **options) -> Axes:
    """Draw one loop with its events.

    Parameters
    ----------
    loop : Loop
        Anything with ``sample(n) -> t, displacement, force``, ``displacement(t)``, ``force(t)`` and ``events`` (rows with
        ``time``, ``kind``).
    ax : matplotlib.axes.Axes, optional
    samples : int
    **options
        Of the line.

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = style.shown_figure(3.6, 3.0)[0] if ax is None else ax
    _, u, f = loop.sample(samples)
    ax.plot(u, f, **{"color": style.BLUE, "zorder": 3, **options})
    for kind, (marker, colour, words) in style.EVENTS.items():
        times = np.array([event.time for event in loop.events if event.kind == kind])
        if 0 < times.size <= 40:
            ax.plot(loop.displacement(times), loop.force(times), ls="none", marker=marker, mfc=colour, mec=style.BLACK, mew=0.5,
                    ms=4.5, label=words, zorder=5)
    ax.set(xlabel="displacement", ylabel="force")
    return ax


@style.styled
@checked(loop=like("a loop of hysteresis(...)", "sample", "pieces", "omega"))
def plot_states(loop: Any, ax: Axes | None = None, samples: int = 1440) -> Axes:
    """Draw force and displacement (dashed, scaled) over one period; what one contact does shades the background.

    Parameters
    ----------
    loop : Loop
        As for `plot_loop`, with ``pieces`` (rows with ``start``, ``end``, ``key``) and ``omega``.
    ax : matplotlib.axes.Axes, optional
    samples : int

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = style.shown_figure(4.2, 2.6)[0] if ax is None else ax
    t, u, f = loop.sample(samples)
    turn = 0.5 * loop.omega / np.pi
    for piece in loop.pieces:
        if piece.key in SHADES and piece.key != "stick":
            ax.axvspan(0.5 * piece.start / np.pi, 0.5 * piece.end / np.pi, color=SHADES[piece.key], lw=0.0,
                       label={"slip+": "slip forward", "slip-": "slip back", "apart": "apart"}[piece.key])
    top = np.abs(f).max() or 1.0
    ax.plot(turn * t, u * top / np.abs(u).max(), color=style.GREY, ls="--", lw=1.0, label="displacement, scaled")
    ax.plot(turn * t, f, color=style.BLUE, label="force")
    ax.set(xlabel="time over period", ylabel="force", xlim=(0.0, 1.0))
    return ax
