"""Error of simple and generalized cell mapping over cell size and periods a mapping, and what its graphs cost.

Problem A of `label_noise`. Labels of cell maps are compared with those of every cell's own motion; cells that leave the grid on
their way are undecided. The graph of a million cells with nine samples each is taken apart by scipy.
"""
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.basins import GroupKind
from bifurc.basins.cells.generalized import components, transition

from .common import Setting, parser, publish, table
from .label_noise import problem

SIDES = {Setting.SMALL: (60,), Setting.FULL: (100, 200, 400)}
PERIODS = {Setting.SMALL: (1, 30), Setting.FULL: (1, 3, 10, 30, 60)}
LARGE = {Setting.SMALL: 100, Setting.FULL: 1000}  # cells a side of the graph
SAMPLES = 3


@dataclass(frozen=True)
class Errors:
    """One map of cells against direct labels."""

    side: int
    periods: int
    samples: int
    wrong: float
    undecided: float
    attractors: int
    spurious: int
    cpu: float


@dataclass(frozen=True)
class GraphCost:
    """The graph of a large generalized map."""

    cells: int
    edges: int  # samples, before equal ones are summed
    build: float  # CPU seconds: images and matrix
    parts: float  # strongly connected components, classified, of the graph and of one with nine different edges a cell
    whole: float
    edges_whole: int
    scipy: float  # scipy's share of that
    absorb: float  # absorption probabilities and times of all cells
    morse: float


def errors(side: int, periods: int, samples: int, direct: bf.BasinMap) -> Errors:
    """Map cells and compare labels."""
    system, _ = problem("A")
    start = time.process_time()
    found = bf.cell_mapping(system, direct.grid, periods=periods, samples=samples, audit=0)
    cpu = time.process_time() - start
    number = {k: next((j for j, other in enumerate(direct.attractors) if other.periods == item.periods), -2)
              for k, item in enumerate(found.attractors)}
    labels = np.array([number.get(k, -1) for k in range(-1, len(found.attractors))])[found.labels + 1]
    wrong = np.mean((found.labels >= 0) & (labels != direct.labels))
    spurious = sum(group.kind is GroupKind.SPURIOUS for group in found.groups)
    return Errors(side, periods, samples, float(wrong), float(np.mean(found.labels < 0)), len(found.attractors), spurious, cpu)


def graph_cost(side: int) -> GraphCost:
    """Take the graph of a generalized map of side x side cells apart."""
    from scipy.sparse import csgraph
    system, (across, up) = problem("A")
    start = time.process_time()
    found = bf.cell_mapping(system, bf.Grid(q0=(*across, side), v0=(*up, side)), periods=1, samples=SAMPLES, audit=0)
    built = time.process_time() - start
    size = side * side
    first = found.matrix.indices[found.matrix.indptr[:-2]]
    around = (np.arange(-1, 2)[:, None] * side + np.arange(-1, 2)).ravel()
    wide = transition(np.repeat(np.arange(size), around.size), (first[:, None] + around).ravel(), size)  # no edge counts twice
    parts, whole = _least(lambda: components(found.matrix)), _least(lambda: components(wide))
    scipy = _least(lambda: csgraph.connected_components(wide, directed=True, connection="strong"))
    absorb = _least(lambda: (found.__dict__.pop("_absorption", None), found.absorption()))
    morse = _least(lambda: (found.__dict__.pop("morse", None), found.morse))
    return GraphCost(side * side, int(side * side * SAMPLES**2), built, parts, whole, wide.nnz, scipy, absorb, morse)


def _least(call, rounds: int = 3) -> float:
    times = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return float(np.median(times))


def run(setting: Setting = Setting.FULL) -> tuple[list[Errors], GraphCost]:
    """Measure everything."""
    system, (across, up) = problem("A")
    found = []
    for side in SIDES[setting]:
        direct = bf.basins_of_attraction(system, bf.Grid(q0=(*across, side), v0=(*up, side)))
        found += [errors(side, periods, samples, direct) for samples in (1, SAMPLES) for periods in PERIODS[setting]]
    return found, graph_cost(LARGE[setting])


def report(found: list[Errors], cost: GraphCost) -> str:
    """Return the tables."""
    rows = [(f"{item.side} x {item.side}, {item.samples**2} a cell", item.periods, f"{100 * item.wrong:.3g}",
             f"{100 * item.undecided:.3g}", item.attractors, item.spurious, item.cpu) for item in found]
    text = table("labels of cell maps of problem A, %", ("cells", "periods a mapping", "wrong", "undecided", "attractors",
                                                        "spurious groups", "CPU s"), rows)
    costs = [("images and matrix", cost.build), ("components, classified", cost.parts),
             (f"the same of {cost.edges_whole:.3g} different edges", cost.whole), ("of that scipy", cost.scipy),
             ("absorption of all cells", cost.absorb), ("Morse graph", cost.morse)]
    return f"{text}\n\n" + table(f"graph of {cost.cells:.3g} cells, {cost.edges:.3g} images", ("step", "CPU s"), costs)


def picture(found: list[Errors], cost: GraphCost):
    """Draw the shares of wrong labels over the periods a mapping."""
    from bifurc.plotting.style import BLUE, GREEN, VERMILION, figure
    made, (ax,) = figure(5.8, 3.8)
    least = 0.5 / max(item.side for item in found) ** 2
    for side, color in zip(sorted({item.side for item in found}), (GREEN, VERMILION, BLUE), strict=False):
        for samples, line, words in ((1, "o-", "simple"), (SAMPLES, "s--", "generalized")):
            mine = [item for item in found if item.side == side and item.samples == samples]
            shares = [max(item.wrong + item.undecided, least) for item in mine]
            ax.loglog([item.periods for item in mine], shares, line, color=color, markersize=4,
                      markerfacecolor=color if samples == 1 else "white", label=f"{words}, {side} a side")
    ax.axhline(least, color="0.6", linewidth=0.7)
    ax.text(0.6, least * 1.1, "none", transform=ax.get_yaxis_transform(), ha="right", fontsize=7, color="0.4")
    ax.set_xlabel("forcing periods a mapping")
    ax.set_ylabel("share of wrong or undecided labels")
    ax.legend(loc="lower left")
    return made


def main(arguments=None) -> tuple[list[Errors], GraphCost]:
    """Run the study."""
    options = parser(__doc__).parse_args(arguments)
    found, cost = run(options.setting)
    publish(options, "cell_mapping", report(found, cost), lambda: picture(found, cost))
    return found, cost


if __name__ == "__main__":
    main()
