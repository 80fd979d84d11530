"""A motion as a moving picture: the point in the phase plane and the time history as it grows."""
import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter

from ...checks import MOVING, checked, of, whole
from .. import style
from .phase_plane import plot_orbit, plot_trajectory


@style.styled
@checked(motion=MOVING, frames=of(whole, least=2, most=10**5))
def animate_orbit(motion: Any, path: str | os.PathLike | None = None, dof: int = 0, frames: int = 120,
                  rate: int = 30) -> FuncAnimation:
    """Animate a periodic orbit or a simulated motion.

    Parameters
    ----------
    motion : PeriodicOrbit, HarmonicOrbit or Trajectory
        Anything with ``sample(n)``, ``events`` and ``system``.
    path : path-like, optional
        A ``.gif`` that is written.
    dof : int
        Displacement that is drawn.
    frames : int
        Pictures, equally spaced in time, at least 2.
    rate : int
        Pictures a second of the file.

    Returns
    -------
    matplotlib.animation.FuncAnimation
        In a notebook ``HTML(animation.to_jshtml())`` shows it.

    Raises
    ------
    ValueError
        Fewer than two frames, a path that is no ``.gif``.
    """
    if not isinstance(frames, int) or frames < 2:
        raise ValueError(f"animate_orbit: frames = {frames!r} is not allowed; it must be a whole number of at least 2")
    if path is not None and Path(path).suffix.lower() != ".gif":
        raise ValueError(f"animate_orbit: path = {str(path)!r} is not allowed; it must end in .gif")
    made, axes = style.figure(6.9, 3.1, columns=2, width_ratios=(1, 1.35))
    periodic = motion.periodic
    (plot_orbit if periodic else plot_trajectory)(motion, axes, dof)
    t, y = motion.sample(frames + 1 if periodic else frames)
    t, y = t[:frames], y[:frames]
    forced = motion.system.omega is not None
    unit = 2.0 * np.pi / motion.system.omega if forced else 1.0
    n = motion.system.n
    (point,) = axes[0].plot([], [], "o", color=style.VERMILION, markersize=8, markeredgecolor="black", zorder=9)
    (hand,) = axes[1].plot([], [], "o", color=style.VERMILION, markersize=8, markeredgecolor="black", zorder=9)
    now = axes[1].axvline(t[0] / unit, color=style.GREY, linewidth=0.8, zorder=1)

    def draw(k: int):
        point.set_data([y[k, dof]], [y[k, n + dof]])
        hand.set_data([t[k] / unit], [y[k, dof]])
        now.set_xdata([t[k] / unit, t[k] / unit])
        return point, hand, now

    animation = FuncAnimation(made, draw, frames=frames, interval=1000.0 / rate, blit=False)
    if path is not None:
        animation.save(os.fspath(path), writer=PillowWriter(fps=rate), dpi=80)
    return animation
