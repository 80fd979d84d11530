"""Predicted and measured label noise: how many labels change when the same motions are rounded another way.

Three impact oscillators x'' + 2 z x' + x = cos(w t), x <= gap, restitution .8, 400 x 400 starts: A with a smooth boundary, B and C
with fractal ones. Multiplied by 3 all lengths of a problem give the same motions in real numbers but other roundings: labels that
differ are decided by rounding. Moved by one unit in the last place, starts tell the same. The prediction is that of every basin
map: labels changed by larger perturbations, extrapolated to rounding by the uncertainty exponent.
"""
from dataclasses import dataclass

import numpy as np

import bifurc as bf

from .common import Setting, parser, publish, table

PROBLEMS = {
    "A": ({"zeta": 0.02, "omega": 2.6, "gap": 0.0}, ((-2.5, 0.0), (-3.0, 3.0))),
    "B": ({"zeta": 0.05, "omega": 4.25, "gap": 0.1}, ((-2.4, 0.1), (-3.0, 3.0))),
    "C": ({"zeta": 0.05, "omega": 6.25, "gap": 0.1}, ((-2.4, 0.1), (-3.0, 3.0))),
}
CELLS = {Setting.SMALL: 60, Setting.FULL: 400}
LENGTH = 3.0  # not a power of 2


@dataclass(frozen=True)
class Noise:
    """One problem."""

    predicted: float
    rescaled: float  # fraction of labels that differ in a problem of other lengths
    moved: float  # and of starts moved by one unit in the last place
    exponent: float
    error: float
    basins: bf.BasinMap


def problem(name: str, length: float = 1.0) -> tuple[bf.System, tuple]:
    """Return a problem with all lengths multiplied."""
    numbers, box = PROBLEMS[name]
    system = bf.systems.impact_oscillator(**{**numbers, "gap": length * numbers["gap"]}, amplitude=length, restitution=0.8)
    return system, tuple((length * low, length * high) for low, high in box)


def measured(name: str, cells: int) -> Noise:
    """Return the predicted and the measured noise of a problem."""
    maps = []
    for length in (1.0, LENGTH):
        system, (across, up) = problem(name, length)
        maps.append(bf.basins_of_attraction(system, bf.Grid(q0=(*across, cells), v0=(*up, cells))))
    one, other = maps
    points = [item.sample(item.periods + 1)[1] for item in other.attractors]
    number = {k: int(np.argmin([np.abs(some - LENGTH * item.state).max(axis=1).min() for some in points]))
              for k, item in enumerate(one.attractors)}
    again = np.array([number.get(k, -1) for k in range(-1, len(one.attractors))])[one.labels + 1]
    moved = one.labeller()(np.nextafter(one.grid.starts(1, 2), np.inf)).reshape(one.labels.shape)
    found = one.uncertainty()
    return Noise(one.label_uncertainty, float(np.mean(again != other.labels)), float(np.mean(moved != one.labels)), found.exponent,
                 found.error, one)


def run(setting: Setting = Setting.FULL) -> dict[str, Noise]:
    """Measure all problems."""
    return {name: measured(name, CELLS[setting]) for name in PROBLEMS}


def report(found: dict[str, Noise]) -> str:
    """Return the table."""
    rows = []
    for name, item in found.items():
        entropy = item.basins.entropy()
        rows.append((name, item.predicted, item.rescaled, item.moved, f"{item.exponent:.3f} +- {item.error:.3f}", entropy.basin,
                     entropy.boundary, str(item.basins.reliability.kind)))
    return table("fraction of labels that rounding decides",
                 ("problem", "predicted", "lengths x 3", "starts + 1 ulp", "uncertainty exponent", "basin entropy",
                  "boundary entropy", "promise"), rows)


def picture(found: dict[str, Noise]):
    """Draw the fractions of changed labels over the perturbation, with prediction and measurement at rounding."""
    from bifurc.basins.maps.label_noise import ROUNDING
    from bifurc.plotting.style import BLUE, GREEN, VERMILION, figure
    made, (ax,) = figure(6.0, 3.8)
    for (name, item), color in zip(found.items(), (BLUE, VERMILION, GREEN), strict=True):
        noise = item.basins.noise
        some = noise.changed > 0
        ax.loglog(noise.perturbations[some], noise.changed[some], "o", color=color, markersize=4,
                  label=f"{name}: measured by perturbations")
        line = np.geomspace(ROUNDING, noise.perturbations[some].max(), 50)
        ax.loglog(line, item.predicted * (line / ROUNDING) ** noise.exponent, "--", color=color, linewidth=0.9)
        if item.rescaled > 0:
            ax.loglog([ROUNDING], [item.rescaled], "s", color=color, markerfacecolor="white", markersize=7,
                      label=f"{name}: other roundings")
    ax.set_ylim(1e-6, 1.2)
    ax.set_xlabel("perturbation of the start, scaled")
    ax.set_ylabel("fraction of labels changed")
    ax.legend(loc="lower right")
    return made


def main(arguments=None) -> dict[str, Noise]:
    """Run the study."""
    options = parser(__doc__).parse_args(arguments)
    found = run(options.setting)
    publish(options, "label_noise", report(found), lambda: picture(found))
    return found


if __name__ == "__main__":
    main()
