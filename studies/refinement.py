"""What adaptive refinement of basin maps saves and misses, on a smooth and on a fractal boundary.

Problems A and B of `label_noise`; every refined map is compared with one of which every cell was followed.
"""
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf

from .common import Setting, parser, publish, table
from .label_noise import problem

SIDES = {Setting.SMALL: (192,), Setting.FULL: (200, 400, 800, 1600)}


@dataclass(frozen=True)
class Gain:
    """One map."""

    name: str
    side: int
    status: str
    predicted: float
    share: float
    missed: float  # fraction of all cells with another label
    bound: float  # what the refined map itself says at most, 95 % confidence
    cpu: float  # over that of following every cell
    message: str
    evaluated: np.ndarray


def measured(name: str, side: int) -> Gain:
    """Refine one map and compare it."""
    system, (across, up) = problem(name)
    grid = bf.Grid(q0=(*across, side), v0=(*up, side))
    start = time.process_time()
    found = bf.refined_basins(system, grid)
    middle = time.process_time()
    direct = bf.basins_of_attraction(system, grid, attractors=found.basins.attractors)
    end = time.process_time()
    bound = found.missed.bounds[1] * (1.0 - found.share) if found.share < 1.0 else 0.0
    missed = float(np.mean(found.basins.labels != direct.labels))
    return Gain(name, side, str(found.status), found.predicted, found.share, missed, bound, (middle - start) / (end - middle),
                found.message, found.evaluated)


def run(setting: Setting = Setting.FULL) -> list[Gain]:
    """Measure both problems on all grids, after one that compiles."""
    measured("A", 192)
    return [measured(name, side) for name in "AB" for side in SIDES[setting]]


def report(found: list[Gain]) -> str:
    """Return the table and what the maps say."""
    rows = [(f"{item.name} {item.side} x {item.side}", item.status, item.predicted, item.share, item.missed, item.bound, item.cpu)
            for item in found]
    said = "\n".join(f"{item.name} {item.side}: {item.message}" for item in found)
    header = ("map", "status", "predicted share", "share followed", "missed", "missed, own bound", "CPU / all cells")
    return table("refinement", header, rows) + "\n\n" + said


def picture(found: list[Gain]):
    """Draw the shares over the number of cells."""
    from bifurc.plotting.style import BLUE, VERMILION, figure
    made, (ax,) = figure(5.6, 3.6)
    for name, color in (("A", BLUE), ("B", VERMILION)):
        mine = [item for item in found if item.name == name]
        words = "smooth" if name == "A" else "fractal"
        side = [item.side for item in mine]
        ax.semilogx(side, [item.share for item in mine], "o-", color=color, label=f"{name} ({words}): followed")
        ax.semilogx(side, [item.predicted for item in mine], "x", color=color, label=f"{name}: predicted")
    sides = sorted({item.side for item in found})
    ax.set_xticks(sides, [str(side) for side in sides])
    ax.minorticks_off()
    ax.set_xlabel("cells a side")
    ax.set_ylabel("share of the cells that are followed")
    ax.set_ylim(0, 1.05)
    ax.legend(loc="center right")
    return made


def main(arguments=None) -> list[Gain]:
    """Run the study."""
    options = parser(__doc__).parse_args(arguments)
    found = run(options.setting)
    publish(options, "refinement", report(found), lambda: picture(found))
    return found


if __name__ == "__main__":
    main()
