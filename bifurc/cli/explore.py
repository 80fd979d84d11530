"""``bifurc explore SYSTEM|FILE``: branches, orbits and basin maps on one page in the browser."""
import argparse
import importlib.util
import inspect
from pathlib import Path

import bifurc as bf
from bifurc.warm import warm_up

from .common import STORIES, Parser, UsageError, no_story, number, set_values, system_name


def add(commands) -> None:
    """Add the command to the parser."""
    explore: Parser = commands.add_parser("explore", help="branches, orbits and basin maps in the browser",
                                          description=inspect.getdoc(run_explore))
    explore.add_argument("what", metavar="SYSTEM|FILE", help="name of a ready system, or a saved branch, orbit or basin map")
    explore.add_argument("--set", metavar="NAME=VALUE", nargs="+", action="extend", default=[], help="parameter values")
    explore.add_argument("--parameter", metavar="NAME", help="the parameter that varies")
    explore.add_argument("--bounds", metavar=("A", "B"), type=number, nargs=2, help="its range")
    explore.add_argument("--out", metavar="DIR", default="bifurc-results", help="of what is saved (default: %(default)s)")
    explore.add_argument("--workers", metavar="N", type=int, default=None, help="threads (default: one a processor)")
    explore.add_argument("--no-browser", dest="browser", action="store_false", help="only print the address")
    explore.set_defaults(run=run_explore)


def run_explore(options: argparse.Namespace) -> int:
    """Show a system or a saved result in the browser: click orbits, drag parameters, zoom basins, save the script."""
    if Path(options.what).is_file():
        if options.set or options.parameter or options.bounds:
            raise UsageError("--set, --parameter and --bounds belong to a system; a saved result has its own")
        what, window = bf.load(options.what), None
        parameter = bounds = None
    elif Path(options.what).suffix or len(Path(options.what).parts) > 1:
        raise UsageError(f"there is no file {options.what}")
    else:
        name = system_name(options.what)
        story = STORIES.get(name)
        if story is None:
            raise no_story(name)
        what, window = getattr(bf.systems, name)(**set_values(name, options.set)), story.window
        parameter = what.parameter_name(options.parameter or story.parameter)
        bounds = sorted(options.bounds or ()) or (story.bounds if parameter == story.parameter else None)
    if importlib.util.find_spec("bokeh") is None:
        raise UsageError("the explorer needs bokeh: python -m pip install 'bifurc[explore]'")
    warm_up()
    bf.explore.serve(what, parameter, bounds, window=window, path=str(Path(options.what).resolve()), out=options.out,
                     workers=options.workers, browser=options.browser, say=lambda text: print(text, flush=True))
    return 0
