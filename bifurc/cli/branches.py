"""``bifurc trace SYSTEM``: follow a parameter, switch at grazings, draw."""
import argparse
import contextlib
import inspect
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bifurc as bf
from bifurc.orbits.concentric import concentric
from bifurc.warm import warm_up

from . import maps
from .common import UsageError, check_files, check_measure, folder_of, number, range_of, reason, say_saved, system_of

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
    trace.add_argument("--start", metavar="X", type=number, nargs="+",
                       help="state at phase 0 near the first orbit: coordinates, then velocities")
    trace.add_argument("--save", metavar="FILE", help="also write the first branch to this .npz file")
    trace.add_argument("--json", action="store_true", help="print the result as JSON; words go to the error stream")
    trace.add_argument("--no-basins", dest="basins", action="store_false", help="stop after the branches")
    trace.set_defaults(run=run_trace)


def run_trace(options: argparse.Namespace) -> int:
    """Trace a parameter, switch at grazings, print the special points, draw; then map the basins.

    Without excitation: states of rest first, the orbits born at their Hopf points, and the motion that starts from rest.  A rotor
    in a concentric stator is traced so in the frame that turns with it: whirl without rub and synchronous rub are states of rest
    there, and partial rub is an orbit.
    """
    if options.json:
        with contextlib.redirect_stdout(sys.stderr):
            code, result = traced(options)
        print(json.dumps(result, indent=1))
        return code
    return traced(options)[0]


def traced(options: argparse.Namespace) -> tuple[int, dict]:
    """Do the work of `run_trace`; return the exit code and the result as JSON knows it."""
    name, system, story = system_of(options)
    parameter = system.parameter_name(options.parameter or story.parameter)
    value = system.parameter(parameter)
    if options.measure is not None:
        check_measure(options.measure, system, ("period", "n_events"))
    if options.periods < 1:
        raise UsageError(f"--periods must be at least 1, got {options.periods}")
    if options.ds_max is not None and options.ds_max <= 0.0:
        raise UsageError(f"--ds-max must be above 0, got {options.ds_max:g}")
    if options.bounds and options.bounds[0] == options.bounds[1]:
        raise UsageError(f"--bounds must be two different numbers, got {options.bounds[0]:g} twice")
    if options.start is not None and len(options.start) != 2 * system.n:
        raise UsageError(f"--start takes {2 * system.n} numbers (coordinates, then velocities), got {len(options.start)}")
    if options.save is not None and (Path(options.save).suffix != ".npz" or not Path(options.save).absolute().parent.is_dir()):
        raise UsageError(f"--save {options.save}: it must be a .npz file in a folder that exists")
    low, high = range_of(options, system, story, parameter)
    start = system.with_parameters(**{parameter: min(max(value, low), high)})
    stem = f"{name}_{parameter}"
    folder = Path(options.out)
    check_files(*(folder / f"{stem}_{end}.npz" for end in (*range(1, BRANCHES + 1), "rest")),
                *([] if options.save is None else [Path(options.save)]),
                *([folder / f"{name}_basins.npz"] if options.basins else []))
    print(f"{system!r}: {parameter} from {low:g} to {high:g}", flush=True)
    warm_up()

    folder = folder_of(options.out)
    starts: list[Any] = []
    rests: list[Any] = []
    if concentric(start) and name == "jeffcott_rotor":
        start = turning(start, parameter)
    if start.omega is None:
        starts, rests = free_starts(start, parameter, (low, high), None if system.omega else options.start)
    else:
        starts = [forced_start(start, story, options)]
    for branch in rests:
        branch.save(folder / f"{stem}_rest.npz")
        print(f"states of rest: {len(branch.column('s'))}, ends: {reason(branch)}")
    branches: list[Any] = []
    for branch in follow(starts, parameter, (low, high), ds_max=options.ds_max, quiet=options.quiet):
        branches.append(branch)
        branch.save(folder / f"{stem}_{len(branches)}.npz")
        if options.save is not None and len(branches) == 1:
            branch.save(options.save)
        print(f"branch {len(branches)}: {len(branch.column('s'))} orbits, ends: {reason(branch)}")
    print(special_point_table(parameter, [*branches, *rests]))

    figure, (ax,) = bf.plotting.figure()
    bf.plotting.plot_branches([*rests, *branches], ax, measure=options.measure)
    say_saved(bf.plotting.save_figure(figure, folder / f"{stem}.{options.format}"))
    if any("interrupt" in reason(branch) for branch in branches):
        raise KeyboardInterrupt
    names = [*(str(k + 1) for k in range(len(branches))), *("rest" for _ in rests)]
    result = record(system, parameter, [*branches, *rests], [str(folder / f"{stem}_{end}.npz") for end in names])
    code = 0
    if options.basins and system.omega is not None:
        code = maps.map_basins(name, system.with_parameters(**story.basin), story.window, folder, options)
        result["basins"] = str(folder / f"{name}_basins.npz")
    return code, result


def turning(system: Any, parameter: str) -> Any:
    """Return a concentric rotor in the frame that turns with the spin."""
    names = inspect.signature(bf.systems.rotating_frame_rotor).parameters
    if parameter not in names:
        raise UsageError(f"--parameter {parameter}: a concentric rotor is traced in the frame that turns with it, which has no "
                         f"{parameter}")
    print("concentric: traced in the frame that turns with the spin (rotating_frame_rotor), where whirl without rub and "
          "synchronous rub are states of rest")
    return bf.systems.rotating_frame_rotor(**{key: value for key, value in system.parameters.items() if key in names})


def record(system: Any, parameter: str, branches: Sequence[Any], files: Sequence[str]) -> dict:
    """Return branches and their special points as JSON knows them."""
    return {"system": system.to_record(), "parameter": parameter, "branches": [
        {"file": file, "rows": len(branch.column("s")),
         "from": float(branch.column(parameter).min()), "to": float(branch.column(parameter).max()),
         "ends": [str(item) for item in branch.stop_reason],
         "special_points": [{"kind": str(point.kind), "name": point.name, "parameter": point.parameter,
                             "error": point.error if math.isfinite(point.error) else None,
                             "reverses": point.reverses, "status": str(point.status)} for point in branch.special_points]}
        for file, branch in zip(files, branches, strict=True)]}


def forced_start(system: Any, story: Any, options: argparse.Namespace) -> Any:
    """Return the orbit from which the branches of a forced system start."""
    orbit = bf.find_orbit(system, guess=options.start or (None if options.set else story.guess), periods=options.periods)
    if not orbit.success:
        raise UsageError(f"no orbit to start from: {orbit.message}")
    return orbit


def free_starts(system: Any, parameter: str, bounds: tuple[float, float], guess=None) -> tuple[list[Any], list[Any]]:
    """Return the orbits from which the branches of a system without excitation start, and the branch of its states of rest."""
    rest, rests = bf.find_equilibrium(system), []
    orbit = bf.find_orbit(system, guess=guess)
    starts = [orbit] if orbit.success else []
    if rest.success:
        rests.append(bf.trace(rest, parameter, bounds=bounds))
        for point in rests[0].special_points.of("hopf"):
            starts += bf.switch_branch(point)
    if not starts and not rests:
        raise UsageError(f"no orbit to start from: {orbit.message}")
    return starts, rests


def follow(starts: list[Any], parameter: str, bounds: tuple[float, float], ds_max: float | None = None, quiet: bool = True):
    """Yield the branches of some orbits, and those that leave them at grazings with orbits of the same period.

    Every branch is traced once: an orbit offered by a switch that lies on a known branch is left out.

    Parameters
    ----------
    starts : list of PeriodicOrbit
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
    starts = list(starts)
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
                starts += [other for other in bf.switch_branch(point) if other.periods == start.periods]


def _on_branch(orbit: Any, branch: Any) -> bool:
    """Whether an orbit lies on a branch: the row next to it, polished at its parameters, becomes the same orbit."""
    values = branch.column(branch.parameter)
    value = orbit.parameters[branch.parameter]
    between = [i for i in range(len(values) - 1) if (values[i] - value) * (values[i + 1] - value) <= 0]
    for i in between:
        nearest = i if abs(values[i] - value) <= abs(values[i + 1] - value) else i + 1
        if branch.column("n_events")[nearest] != len(orbit.events):
            continue
        periods = None if orbit.system.omega is None else orbit.periods
        polished = bf.find_orbit(orbit.system, guess=branch.orbits[nearest], periods=periods)
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
