"""Pictures of control: growth over the gain with the stable intervals, and motions that are caught."""
import numpy as np
from matplotlib.axes import Axes

from ..checks import checked, like
from . import style


@style.styled
@checked(found=like("a FeedbackRange", "intervals", "gains"))
def plot_feedback(found, ax: Axes | None = None) -> Axes:
    """Draw the largest modulus of a multiplier over the gain; stable intervals are shaded, their ends marked.

    Parameters
    ----------
    found : FeedbackRange
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is None:
        (ax,) = style.shown_figure(5.2, 3.4)
    for low, high in found.intervals:
        ax.axvspan(low, high, color=style.SKY, alpha=0.25, linewidth=0, label="stable")
    ax.axhline(1.0, color=style.GREY, linewidth=0.8, zorder=1)
    ax.plot(found.gains, found.moduli, color=style.BLACK, linewidth=1.5, label="largest modulus")
    for end in found.ends:
        marker, face, word = style.POINTS.get(str(end.kind), ("o", "white", "order of impacts"))
        ax.plot([end.gain], [1.0], linestyle="none", marker=marker, markerfacecolor=face, markeredgecolor="black",
                markeredgewidth=0.8, markersize=6, label=word, zorder=5)
    if found.best_gain is not None:
        ax.plot([found.best_gain], [found.best_modulus], linestyle="none", marker="*", markersize=9, markerfacecolor=style.GREEN,
                markeredgecolor="black", markeredgewidth=0.6, label="best gain", zorder=6)
    if found.gains.size:
        ax.set_xlim(*found.bounds)
        ax.set_ylim(0.0, min(float(np.max(found.moduli)) * 1.05, 3.0))
    ax.set_xlabel(f"gain $K$ of the delayed {found.of}")
    ax.set_ylabel(r"growth a period, $\max|\lambda|$")
    style.legend(ax)
    return ax


@style.styled
@checked(motion=like("a ControlledMotion", "states", "corrections"))
def plot_controlled(motion, axes=None) -> list[Axes]:
    """Draw the first coordinate on the section and the corrections of the parameter over the periods.

    Parameters
    ----------
    motion : ControlledMotion
    axes : sequence of two Axes, optional

    Returns
    -------
    list of matplotlib.axes.Axes
    """
    if axes is None:
        axes = style.shown_figure(6.8, 2.9, columns=2)
    upper, lower = axes
    count = _sections(upper, motion.states)
    lower.plot(count[:len(motion.corrections)], motion.corrections, linestyle="none", marker=".", markersize=3,
               color=style.VERMILION)
    lower.set_ylabel(f"change of {style.parameter_label(motion.parameter)}")
    for ax in (upper, lower):
        ax.set_xlabel("period")
        ax.set_xlim(0, max(len(motion.states) - 1, 1))
    return [upper, lower]


@style.styled
@checked(motion=like("a motion with delayed feedback", "sections", "feedback"))
def plot_delayed(motion, axes=None) -> list[Axes]:
    """Draw the first coordinate at the forcing periods and the feedback force over time, of a motion with delayed feedback.

    Parameters
    ----------
    motion : DelayedMotion
    axes : sequence of two Axes, optional

    Returns
    -------
    list of matplotlib.axes.Axes
    """
    if axes is None:
        axes = style.shown_figure(6.8, 2.9, columns=2)
    left, right = axes
    count = _sections(left, motion.sections)
    left.set_xlabel("forcing period")
    t = np.linspace(motion.start, motion.stop, min(40 * len(count), 8000))
    right.plot(t, motion.feedback(t), color=style.VERMILION, linewidth=0.8)
    right.set_xlabel("time $t$")
    right.set_ylabel("feedback force")
    return [left, right]


def _sections(ax: Axes, states: np.ndarray) -> np.ndarray:
    """Draw the first coordinate of states (k, ns) on the section; return their numbers (k,)."""
    count = np.arange(len(states))
    ax.plot(count, states[:, 0], linestyle="none", marker=".", markersize=3, color=style.BLUE)
    ax.set_ylabel("$x$ on the section")
    return count
