"""``bifurc atlas SYSTEM``: the whole diagram over a parameter."""
import argparse
import inspect

import bifurc as bf
from bifurc.warm import warm_up

from .common import add_window, check_measure, folder_of, number, range_of, say_saved, system_of, window_of
from .maps import forget


def add(commands, shared) -> None:
    """Add the command to the parser."""
    atlas = commands.add_parser("atlas", parents=[shared], help="find all motions over a parameter",
                                description=inspect.getdoc(run_atlas))
    atlas.add_argument("--parameter", metavar="NAME", help="the parameter that varies")
    atlas.add_argument("--bounds", metavar=("A", "B"), type=number, nargs=2, help="its range")
    atlas.add_argument("--samples", metavar="N", type=int, default=1000, help="starts at each probed value (default: %(default)s)")
    atlas.add_argument("--periods", metavar="N", type=int, default=8,
                       help="longest orbits taken from switching (default: %(default)s)")
    add_window(atlas)
    atlas.add_argument("--measure", metavar="COLUMN", default=None, help="vertical axis (default: rms_0)")
    atlas.add_argument("--resume", action=argparse.BooleanOptionalAction, default=True,
                       help="go on from the chunk files of an interrupted run (default); --no-resume removes them first")
    atlas.set_defaults(run=run_atlas)


def run_atlas(options: argparse.Namespace) -> int:
    """Find attractors from starts, trace and switch until nothing new appears; after an interrupt the same command goes on."""
    name, system, story = system_of(options)
    parameter = system.parameter_name(options.parameter or story.parameter)
    low, high = range_of(options, system, story, parameter)
    region = window_of(options, story)
    if options.measure is not None:
        check_measure(options.measure, system, ("period", "n_events"))
    folder = folder_of(options.out)
    stem = f"{name}_{parameter}_atlas"
    print(f"{system!r}: {parameter} from {low:g} to {high:g}", flush=True)
    warm_up()
    if not options.resume:
        forget(folder / f"{stem}.npz", "atlas")
    found = bf.atlas(system, parameter, (low, high), region, samples=options.samples, periods=options.periods,
                     workers=options.workers, file=folder / f"{stem}.npz")
    print(found.report())
    figure, (ax,) = bf.plotting.figure(6.3, 4.6)
    found.plot(ax, measure=options.measure)
    say_saved(bf.plotting.save_figure(figure, folder / f"{stem}.{options.format}"))
    return 1 if found.failures else 0
