"""``bifurc basins SYSTEM``: which starts lead to which motion."""
import argparse
import inspect
from pathlib import Path
from typing import Any

import bifurc as bf
from bifurc.warm import warm_up

from .common import STORIES, UsageError, add_window, folder_of, number, say_saved, system_of, window_of

LARGEST = 3  # basins whose boundaries are followed to their saddles


def add(commands, shared) -> None:
    """Add the command to the parser."""
    basins = commands.add_parser("basins", parents=[shared], help="map basins of attraction",
                                 description=inspect.getdoc(run_basins))
    add_window(basins, "given twice")
    basins.add_argument("--section", metavar="PART", nargs="+", default=None,
                        help="where motions without excitation are compared: a component (v0), the value it passes (0), and how "
                             "(rising, falling or both)")
    basins.add_argument("--resume", action=argparse.BooleanOptionalAction, default=True,
                        help="go on from the chunk files of an interrupted run, and read a map that is there (default); "
                             "--no-resume removes both first")
    basins.set_defaults(run=run_basins)


def run_basins(options: argparse.Namespace) -> int:
    """Map the basins of attraction over two components of the start."""
    name, system, story = system_of(options)
    if not options.set:
        system = system.with_parameters(**story.basin)
    section = section_of(options.section)
    if system.period is None and section is None:
        raise UsageError(f"{name} has no excitation whose phase tells when motions are compared; --section v0 compares them where "
                         "v0 rises through 0")
    if system.period is not None and section is not None:
        raise UsageError(f"--section is for systems without excitation; motions of {name} are compared once a forcing period")
    if section is not None:
        from bifurc.compose.scene import scene_of  # the command line starts without numba

        section.place(scene_of(system))
    window = window_of(options, story)
    if len(window) != 2:
        raise UsageError(f"--window is given twice, once a component (such as q0 and v0), got {len(window)}")
    warm_up()
    return map_basins(name, system, window, folder_of(options.out), options, not options.resume, section)


def section_of(parts: list[str] | None) -> Any:
    """Return the `Section` that ``--section`` tells; None: it was not given."""
    if parts is None:
        return None
    ways = {"rising": 1, "falling": -1, "both": 0}
    if len(parts) > 3 or len(parts) == 3 and parts[2] not in ways:
        raise UsageError(f"--section takes a component, a value, and rising, falling or both, got {' '.join(parts)}")
    return bf.Section(parts[0], number(parts[1]) if len(parts) > 1 else 0.0, ways[parts[2]] if len(parts) == 3 else 1)


def map_basins(name: str, system: Any, window: dict[str, tuple[float, float]], folder: Path,
               options: argparse.Namespace, fresh: bool = False, section: Any = None) -> int:
    """Map, print, save and draw the basins of one system, and its attractors as motions; ``fresh``: go on from nothing."""
    cells = options.cells or STORIES[name].cells
    print(f"{system!r}: basins of {cells} x {cells} starts")
    grid = bf.Grid(**{component: (*bounds, cells) for component, bounds in window.items()})
    file = folder / f"{name}_basins.npz"
    if fresh:
        forget(file, "basins")
    basins = bf.basins_of_attraction(system, grid, workers=options.workers, progress=not options.quiet, file=file,
                                     section=section)
    print(basin_table(basins))
    edges = saddles(basins) if section is None else []  # an edge state is followed from phase to phase
    for edge in edges:
        print(f"between {edge.pair[0]} and {edge.pair[1]}: {edge.message}")
        if edge.success:
            print(f"  saddle: {bf.plotting.describe(edge.saddle)}, multipliers {_listed(edge.saddle.multipliers)}")
    figure, (ax,) = bf.plotting.figure(6.3, 4.4)
    found = [edge for edge in edges if edge.success]
    single = [edge for edge in found if edge.unstable_directions == 1]
    sets = (single[0].unstable_set(), boundary(single[0])) if single else (None, None)
    bf.plotting.plot_basins(basins, ax, found, *sets)
    for edge in single[1:]:
        edge.plot(ax, unstable=edge.unstable_set(), stable=boundary(edge))
    say_saved(bf.plotting.save_figure(figure, folder / f"{name}_basins.{options.format}"))
    motions = [attractor for attractor in basins.attractors if attractor.periodic][:4]
    if motions:
        figure, axes = bf.plotting.figure(6.9, 3.0 * len(motions), columns=2, rows=len(motions), width_ratios=(1, 1.35))
        for k, attractor in enumerate(motions):
            bf.plotting.plot_orbit(attractor, axes[2 * k:2 * k + 2])
        say_saved(bf.plotting.save_figure(figure, folder / f"{name}_motions.{options.format}"))
    return 0


def boundary(edge: Any) -> Any:
    """Return the stable set of a saddle and say what it is; None where motions have no single past (dry friction)."""
    try:
        found = edge.stable_set()
    except ValueError as error:
        print(f"  no stable set: {error}")
        return None
    print(f"  {found!r}: {found.message}")
    return found


def forget(file: Path, kind: str) -> None:
    """Remove a result of a kind and the chunk files of its unfinished run; anything else is left alone, with an error."""
    from bifurc.jobs.resumable import replaceable  # the command line starts without numba
    from bifurc.jobs.store import ChunkStore  # likewise

    replaceable(file, kind)
    file.unlink(missing_ok=True)
    if Path(f"{file}.chunks").is_dir():
        ChunkStore(f"{file}.chunks", {}).clear()


def basin_table(basins: Any) -> str:
    """Return the attractors with their basins' fractions, and how far the labels can be trusted."""
    head = f"{'label':>5}  {'attractor':<24}{'fraction':>10}  multipliers"
    lines = [head, "-" * len(head)]
    for label, attractor in enumerate(basins.attractors):
        words = "" if attractor.multipliers is None else _listed(attractor.multipliers)
        fraction = basins.fractions.get(label, 0.0)
        lines.append(f"{label:>5}  {bf.plotting.describe(attractor):<24}{fraction:>10.6f}  {words}")
    lines.append(f"{-1:>5}  {'unresolved':<24}{basins.fractions.get(-1, 0.0):>10.6f}")
    lines.append(basins.reliability.statement)
    entropy = basins.entropy()
    if entropy.mixed:
        lines.append(f"basin entropy {entropy.basin:.4f}, boundary entropy {entropy.boundary:.4f} "
                     f"(boxes of {entropy.side} x {entropy.side} cells)")
    return "\n".join(lines)


def saddles(basins: Any) -> list:
    """Return the edge states between the first few basins, where the boundary is smooth enough to be followed."""
    count = min(len(basins.attractors), LARGEST)
    if basins.reliability.kind == "fractions":
        return []
    return [bf.edge_state(basins, (a, b)) for a in range(count) for b in range(a + 1, count)]


def _listed(multipliers: Any) -> str:
    return ", ".join(_complex(value) for value in multipliers[:4])


def _complex(value: complex) -> str:
    return f"{value.real:.6f}" if value.imag == 0 else f"{value.real:.6f}{value.imag:+.6f}i"
