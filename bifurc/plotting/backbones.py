"""Pictures of backbone curves: amplitude over frequency, damping over amplitude."""
from matplotlib.axes import Axes

from ..checks import checked, like
from . import style


@style.styled
@checked(found=like("a Backbone", "omega", "amplitude", "damping"))
def plot_backbone(found, axes=None) -> list[Axes]:
    """Draw amplitude over frequency and, beside it, the modal damping ratio over amplitude.

    Parameters
    ----------
    found : Backbone
    axes : sequence of two Axes, optional

    Returns
    -------
    list of matplotlib.axes.Axes
    """
    if axes is None:
        axes = style.shown_figure(6.6, 3.0, columns=2)
    left, right = axes
    left.plot(found.omega, abs(found.amplitude), color=style.BLUE)
    left.set_xlabel(r"frequency $\omega$")
    left.set_ylabel("amplitude")
    right.plot(abs(found.amplitude), found.damping, color=style.VERMILION)
    right.set_xlabel("amplitude")
    right.set_ylabel("modal damping ratio $D$")
    return [left, right]
