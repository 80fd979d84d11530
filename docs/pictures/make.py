"""Make the three pictures of the README and of the start page: ``python docs/pictures/make.py``.

The impact oscillator of the README's first command: a branch through its grazings, the two motions that coexist at
omega = 1.4, and the starts that lead to them.
"""
import pathlib

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import bifurc as bf

FOLDER = pathlib.Path(__file__).parent
LARGEST = 150_000  # bytes


def pictures():
    """Yield names and figures."""
    system = bf.systems.impact_oscillator()
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.0))
    basins = bf.basins_of_attraction(system.with_parameters(omega=1.4), bf.Grid(q0=(-3, 1, 400), v0=(-4, 4, 400)))
    size = {"figsize": (4.2, 3.3), "layout": "constrained"}

    figure, axes = pyplot.subplots(**size)
    branch.plot(axes, names={"omega": r"$\omega$", "rms_0": r"rms of $x$"})
    yield "branch", figure

    figure, axes = pyplot.subplots(**size)
    for orbit, color in zip(basins.attractors, ("#0072b2", "#d55e00"), strict=True):
        t, y = orbit.sample(1000)
        axes.plot(y[:, 0], y[:, 1], color=color, lw=1.5, label=f"{len(orbit.events) or 'no'} impact a period")
    axes.axvspan(1.0, 1.12, color="0.85", lw=0, hatch="////", ec="0.6")
    axes.axvline(1.0, color="black", lw=1.0)
    axes.set(xlabel="$x$", ylabel=r"$\dot x$", xlim=(-2.1, 1.12), ylim=(-1.8, 2.9))
    axes.legend(loc="upper left", frameon=False, fontsize=8)
    yield "motions", figure

    figure, axes = pyplot.subplots(**size)
    basins.plot(axes).set_title("", loc="right")
    yield "basins", figure


if __name__ == "__main__":
    for name, figure in pictures():
        file = FOLDER / f"{name}.png"
        figure.savefig(file, dpi=150)
        pyplot.close(figure)
        size = file.stat().st_size
        print(f"{file.name}: {size // 1000} kB")
        assert size < LARGEST, name
