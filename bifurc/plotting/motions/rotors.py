"""Pictures of a rotor: its path in the stator, its distance from the centre, and its full spectrum (forward and backward)."""
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ...checks import MOVING, PLACE, POSITIVE, checked, many, of
from .. import style


def ring_of(system: Any) -> Any:
    """Return the first stator of a system (`bifurc.elements.Ring`), or None."""
    return next((element.ring for element in system.elements if element.ring is not None), None)


def relative(ring: Any, y: np.ndarray) -> np.ndarray:
    """Return the path (N, 2) of the rotor as seen from the body that carries the stator, from states (N, ns)."""
    path = y[:, list(ring.dofs)]
    return path if ring.against is None else path - y[:, list(ring.against)]


def draw_rotor(ring: Any, t, y, events, axes, unit: float, time_label: str) -> list[Axes]:
    """Draw the path in the stator and the distance from its centre against time."""
    plane, history = axes
    path = relative(ring, y)
    distance = np.hypot(*(path - ring.centre).T)
    look: dict[str, Any] = {"facecolor": "#e6e6e6", "edgecolor": "#a0a0a0", "hatch": "////" if ring.rigid else "", "linewidth": 0.0}
    reach = 1.12 * max(ring.radius, float(distance.max()))
    plane.add_patch(Circle(ring.centre, 1.5 * reach, zorder=0.4, **look))
    plane.add_patch(Circle(ring.centre, ring.radius, facecolor="white", edgecolor="black", linewidth=0.9, zorder=0.6))
    plane.plot(*path.T, color=style.BLUE, linewidth=1.2, zorder=3)
    plane.plot(*ring.centre, "+", color="black", markersize=5, zorder=2)
    history.plot(t / unit, distance, color=style.BLUE, linewidth=1.2, zorder=3)
    low, high = min(0.0, float(distance.min())), max(1.06 * ring.radius, 1.04 * float(distance.max()))
    history.fill_between(t / unit, ring.radius, high, zorder=0.5, **look)
    history.axhline(ring.radius, color="black", linewidth=0.9, zorder=1)
    for row in events:
        if t[0] <= row.time <= t[-1]:
            marker, color, word = style.EVENTS.get(str(row.kind), ("o", style.GREY, str(row.kind)))
            mark: dict[str, Any] = {"linestyle": "none", "marker": marker, "markersize": 4.5, "markerfacecolor": color,
                                    "markeredgecolor": "black", "markeredgewidth": 0.6, "zorder": 5}
            history.plot(row.time / unit, np.interp(row.time, t, distance), label=word, **mark)
            plane.plot(np.interp(row.time, t, path[:, 0]), np.interp(row.time, t, path[:, 1]), **mark)
    plane.set_aspect("equal")
    plane.set_xlim(ring.centre[0] - reach, ring.centre[0] + reach)
    plane.set_ylim(ring.centre[1] - reach, ring.centre[1] + reach)
    plane.set_xlabel("x" if ring.against is None else "x relative to the casing")
    plane.set_ylabel("y" if ring.against is None else "y relative to the casing")
    history.set_ylim(low, high)
    history.set_xlabel(time_label)
    history.set_ylabel("distance from the centre")
    return [plane, history]


@style.styled
@checked(motion=MOVING, dofs=of(many, of=PLACE, count=2), most=POSITIVE)
def plot_full_spectrum(motion: Any, ax: Axes | None = None, dofs: tuple[int, int] = (0, 1), samples: int = 4096,
                       most: float = 5.0) -> Axes:
    """Draw the full spectrum of a rotor: amplitudes of z = x + i y, forward whirl at positive, backward at negative frequencies.

    Parameters
    ----------
    motion : PeriodicOrbit or Trajectory
        Anything with ``sample(n) -> t (n,), y (n, ns)``, equally spaced, and ``system``.  An orbit gives lines; of a simulated
        motion let the transient die out, a Hann window keeps what is not periodic in it from leaking.
    ax : matplotlib.axes.Axes, optional
    dofs : two ints
        Degrees of freedom x and y.
    samples : int
    most : float
        Largest frequency shown, in multiples of the spin (autonomous: of the largest line).

    Returns
    -------
    matplotlib.axes.Axes
    """
    frequency, amplitude = full_spectrum(motion, dofs, samples)
    if ax is None:
        ax = style.shown_figure(5.2, 2.6)[0]
    omega = motion.system.omega or 2.0 * np.pi * abs(frequency[np.argmax(amplitude)])
    ratio = 2.0 * np.pi * frequency / omega
    shown = np.abs(ratio) <= most
    if motion.periodic:
        ax.vlines(ratio[shown], 0.0, amplitude[shown], color=style.BLUE, linewidth=1.6)
    else:
        ax.plot(ratio[shown], amplitude[shown], color=style.BLUE, linewidth=1.0)
    ax.axvline(0.0, color="black", linewidth=0.6)
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(-most, most)
    ax.set_xlabel("frequency / spin (negative: backward whirl)")
    ax.set_ylabel("amplitude")
    return ax


@checked(motion=MOVING, dofs=of(many, of=PLACE, count=2))
def full_spectrum(motion: Any, dofs: tuple[int, int] = (0, 1), samples: int = 4096) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (N,), in cycles per time, ascending, and the amplitudes (N,) of z = x + i y."""
    t, y = motion.sample(samples + 1)
    z = (y[:, dofs[0]] + 1j * y[:, dofs[1]])[:samples]
    window = np.ones(samples) if motion.periodic else np.hanning(samples) * 2.0
    found = np.fft.fft(z * window) / samples
    frequency = np.fft.fftfreq(samples, (t[-1] - t[0]) / samples)
    order = np.argsort(frequency)
    return frequency[order], np.abs(found[order])
