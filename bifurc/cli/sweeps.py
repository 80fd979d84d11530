"""``bifurc sweep SYSTEM [PARAMETER]``: attractors and the sizes of their basins over a parameter."""
import argparse
import inspect
from typing import Any

import numpy as np

import bifurc as bf
from bifurc.warm import warm_up

from .common import UsageError, add_window, folder_of, number, range_of, say_saved, system_of, window_of
from .maps import forget

_BRANCHES = 4  # families of which a branch is traced for the picture
_TRIES = 3  # orbits of a family from which it is tried


def add(commands, shared) -> None:
    """Add the command to the parser."""
    sweep = commands.add_parser("sweep", parents=[shared], help="follow attractors and basin fractions over a parameter",
                                description=inspect.getdoc(run_sweep))
    sweep.add_argument("parameter", metavar="PARAMETER", nargs="?", help="the parameter that varies")
    sweep.add_argument("--bounds", metavar=("A", "B"), type=number, nargs=2, help="its range")
    sweep.add_argument("--points", metavar="N", type=int, default=100, help="values (default: %(default)s)")
    sweep.add_argument("--samples", metavar="N", type=int, default=1000, help="starts at each value (default: %(default)s)")
    add_window(sweep)
    sweep.add_argument("--resume", action=argparse.BooleanOptionalAction, default=True,
                       help="go on from the chunk files of an interrupted run (default); --no-resume removes them first")
    sweep.add_argument("--no-branches", dest="branches", action="store_false", help="trace no branches for the picture")
    sweep.set_defaults(run=run_sweep)


def run_sweep(options: argparse.Namespace) -> int:
    """Follow all attractors and the sizes of their basins over a parameter; after an interrupt the same command goes on."""
    name, system, story = system_of(options)
    parameter = system.parameter_name(options.parameter or story.parameter)
    low, high = range_of(options, system, story, parameter)
    if low == high:
        raise UsageError(f"--bounds must be two different numbers, got {low:g} twice")
    if options.points < 2:
        raise UsageError(f"--points must be at least 2, got {options.points}")
    if options.samples < 1:
        raise UsageError(f"--samples must be at least 1, got {options.samples}")
    region = window_of(options, story)
    folder = folder_of(options.out)
    stem = f"{name}_{parameter}_sweep"
    print(f"{system!r}: {parameter} at {options.points} values from {low:g} to {high:g}, {options.samples} starts each", flush=True)
    warm_up()
    if not options.resume:
        forget(folder / f"{stem}.npz", "sweep")
    found = bf.sweep(system, parameter, np.linspace(low, high, options.points), region, samples=options.samples,
                     workers=options.workers, progress=not options.quiet, file=folder / f"{stem}.npz")
    print(found.report())
    branches = traced(found, (low, high), options.quiet) if options.branches else []
    figure, axes = bf.plotting.figure(6.3, 5.8, rows=2, sharex=True)
    bf.plotting.plot_sweep(found, axes, branches)
    say_saved(bf.plotting.save_figure(figure, folder / f"{stem}.{options.format}"))
    return 1 if found.failures else 0


def traced(found: Any, bounds: tuple[float, float], quiet: bool) -> list:
    """Return branches of the families that hold the largest shares, each from the first orbit that can be continued."""
    from bifurc.continuation import ContinuationError  # the command line starts without numba

    tracks = {track.number: track for track in found.tracks}
    families = sorted(found.families, key=lambda family: -sum(float(tracks[k].fractions.sum()) for k in family))
    branches = []
    for family in families[:_BRANCHES]:
        for orbit in [item for k in family for item in tracks[k].attractors if item.periodic][:_TRIES]:
            try:
                branches.append(bf.trace(orbit, found.parameter, bounds=bounds, progress=not quiet))
                break
            except ContinuationError:  # superstable, or of very many impacts: the next one
                continue
    return branches
