"""``bifurc trace SYSTEM``: follow a parameter, switch at grazings, draw."""
import argparse
import inspect
import math
from collections.abc import Sequence
from typing import Any

import bifurc as bf
from bifurc.warm import warm_up

from . import maps
from .common import UsageError, folder_of, number, reason, say_saved, system_of

BRANCHES = 12  # at most, followed from one start


def add(commands, shared) -> None:
    """Add the command to the parser."""
    trace = commands.add_parser("trace", parents=[shared], help="trace a parameter, then map the basins",
                                description=inspect.getdoc(run_trace))
    trace.add_argument("--parameter", metavar="NAME", help="the parameter that varies")
    trace.add_argument("--bounds", metavar=("A", "B"), type=number, nargs=2, help="its range")
    trace.add_argument("--periods", metavar="N", type=int, default=1, help="forcing periods of the motion (default: 1)")
    trace.add_argument("--measure", metavar="COLUMN", default=None, help="vertical axis (default: rms_0)")
    trace.add_argument("--ds-max", metavar="DS", type=number, default=None, help="largest step along the branch")
    trace.add_argument("--no-basins", dest="basins", action="store_false", help="stop after the branches")
    trace.set_defaults(run=run_trace)


def run_trace(options: argparse.Namespace) -> int:
    """Trace a parameter, switch at grazings, print the special points, draw; then map the basins."""
    name, system, story = system_of(options)
    parameter = options.parameter or story.parameter
    value = system.parameter(parameter)
    low, high = sorted(options.bounds or (story.bounds if parameter == story.parameter else _around(parameter, value)))
    start = system.with_parameters(**{parameter: min(max(value, low), high)})
    stem = f"{name}_{parameter}"
    print(f"{system!r}: {parameter} from {low:g} to {high:g}", flush=True)
    warm_up()

    guess = None if options.set else story.guess
    orbit = bf.find_orbit(start, guess=guess, periods=options.periods)
    if not orbit.success:
        raise UsageError(f"no orbit to start from: {orbit.message}")
    folder = folder_of(options.out)
    branches: list[Any] = []
    for branch in follow(orbit, parameter, (low, high), ds_max=options.ds_max, quiet=options.quiet):
        branches.append(branch)
        branch.save(folder / f"{stem}_{len(branches)}.npz")
        print(f"branch {len(branches)}: {len(branch.column('s'))} orbits, ends: {reason(branch)}")
    print(special_point_table(parameter, branches))

    figure, (ax,) = bf.plotting.figure()
    bf.plotting.plot_branches(branches, ax, measure=options.measure)
    say_saved(bf.plotting.save_figure(figure, folder / f"{stem}.{options.format}"))
    if any("interrupt" in reason(branch) for branch in branches):
        raise KeyboardInterrupt
    if options.basins:
        return maps.map_basins(name, system.with_parameters(**story.basin), story.window, folder, options)
    return 0


def follow(orbit: Any, parameter: str, bounds: tuple[float, float], ds_max: float | None = None, quiet: bool = True):
    """Yield the branch of an orbit, and those that leave it at grazings with orbits of the same period.

    Every branch is traced once: an orbit offered by a switch that lies on a known branch is left out.

    Parameters
    ----------
    orbit : PeriodicOrbit
    parameter : str
    bounds : pair of float
    ds_max : float, optional
        Largest step of the tracer.
    quiet : bool
        No progress bar.

    Yields
    ------
    Branch
    """
    starts = [orbit]
    known: list[Any] = []
    step = {} if ds_max is None else {"ds_max": ds_max}
    while starts and len(known) < BRANCHES:
        start = starts.pop(0)
        if any(_on_branch(start, branch) for branch in known):
            continue
        branch = bf.trace(start, parameter, bounds=bounds, progress=not quiet, **step)
        known.append(branch)
        yield branch
        if "interrupt" in reason(branch):
            return
        for point in branch.special_points:
            if str(point.kind) == "grazing":
                starts += [other for other in bf.switch_branch(point) if other.periods == orbit.periods]


def _on_branch(orbit: Any, branch: Any) -> bool:
    """Whether an orbit lies on a branch: the row next to it, polished at its parameters, becomes the same orbit."""
    values = branch.column(branch.parameter)
    value = orbit.parameters[branch.parameter]
    between = [i for i in range(len(values) - 1) if (values[i] - value) * (values[i + 1] - value) <= 0]
    for i in between:
        nearest = i if abs(values[i] - value) <= abs(values[i + 1] - value) else i + 1
        if branch.column("n_events")[nearest] != len(orbit.events):
            continue
        polished = bf.find_orbit(orbit.system, guess=branch.orbits[nearest], periods=orbit.periods)
        if polished.success and max(abs(polished.state - orbit.state)) <= 1e-7 * (1 + max(abs(orbit.state))):
            return True
    return False


def special_point_table(parameter: str, branches: Sequence[Any]) -> str:
    """Return the special points of all branches, one a line; a point where two branches meet is listed once."""
    rows: list[tuple[str, float, str, str]] = []
    for count, branch in enumerate(branches, 1):
        for point in branch.special_points:
            near = [row for row in rows if row[0] == point.kind and math.isclose(row[1], point.parameter, rel_tol=1e-9)]
            if not near:
                rows.append((str(point.kind), point.parameter, f"{point.error:.1e}", str(count)))
    if not rows:
        return "no special points"
    head = f"{'special point':<20}{parameter:>18}{'error below':>14}{'branch':>8}"
    lines = [head, "-" * len(head)]
    lines += [f"{kind.replace('_', ' '):<20}{at:>18.12f}{error:>14}{number:>8}" for kind, at, error, number in rows]
    return "\n".join(lines)


def _around(parameter: str, value: float) -> tuple[float, float]:
    """Return half and twice the value of a parameter that has no story."""
    if value == 0:
        raise UsageError(f"--bounds is needed: {parameter} is 0, which tells no range")
    return value / 2, 2 * value
