"""Command line: ``bifurc trace SYSTEM``, ``bifurc basins SYSTEM``, ``bifurc info [SYSTEM]``.

Every command is the Python of the tutorial with names in place of variables.  Files are renamed into place as soon as
they are complete, so that an interrupt loses nothing that is finished.
"""
import argparse
import importlib.metadata
import inspect
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bifurc as bf
from bifurc.warm import warm_up

_INTERRUPTED = 130  # exit code of shells for a program that was interrupted
_BRANCHES = 12  # at most, followed from one start


@dataclass(frozen=True)
class Story:
    """What a system shows when nothing but its name is given."""

    parameter: str
    bounds: tuple[float, float]
    basin: dict[str, float]  # parameters of the basin map
    window: dict[str, tuple[float, float]]  # of the starts: two state components
    guess: tuple[float, ...] | None = None  # state at phase 0 near the motion, where rest is another one


_STORIES = {
    "impact_oscillator": Story("omega", (0.5, 2.0), {"omega": 1.4}, {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}),
    "moving_frame_impact_oscillator": Story("omega", (0.8, 2.5), {}, {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}),
    "two_sided_impact_oscillator": Story("amplitude", (0.6, 4.0), {"amplitude": 0.8},
                                         {"q0": (-1.0, 1.0), "v0": (-3.0, 3.0)}),
    "bilinear_oscillator": Story("omega", (0.5, 2.5), {"omega": 1.29}, {"q0": (-2.0, 2.0), "v0": (-3.0, 3.0)}),
    "duffing_oscillator": Story("omega", (0.5, 2.5), {"omega": 1.5}, {"q0": (-2.5, 2.5), "v0": (-4.0, 4.0)}),
    "bouncing_ball": Story("amplitude", (0.3, 1.2), {}, {"q0": (0.5, 8.0), "v0": (-4.0, 4.0)}, (2.487161, 2.368808)),
    "impact_chain": Story("amplitude", (0.3, 0.5), {}, {"q7": (-3.0, 1.0), "v7": (-2.0, 2.0)}),
}


class UsageError(argparse.ArgumentTypeError, ValueError):
    """A request that cannot be met; the message is shown in one line."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        0; 2 for a request that cannot be met; 130 after an interrupt.
    """
    try:
        options = _parser().parse_args(arguments)
        return options.run(options)
    except (ValueError, LookupError, OSError) as error:
        message = error.args[0] if isinstance(error, KeyError) and error.args else error
        print(f"bifurc: error: {' '.join(str(message).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("bifurc: interrupted; what was finished is on disk", file=sys.stderr)
        return _INTERRUPTED


def run_trace(options: argparse.Namespace) -> int:
    """Trace a parameter, switch at grazings, print the special points, draw; then map the basins."""
    name, system, story = _system(options)
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
    folder = _folder(options.out)
    branches: list[Any] = []
    for branch in follow(orbit, parameter, (low, high), ds_max=options.ds_max, quiet=options.quiet):
        branches.append(branch)
        branch.save(folder / f"{stem}_{len(branches)}.npz")
        print(f"branch {len(branches)}: {len(branch.column('s'))} orbits, ends: {_reason(branch)}")
    print(special_point_table(parameter, branches))

    figure, (ax,) = bf.plotting.figure()
    bf.plotting.plot_branches(branches, ax, measure=options.measure)
    _say_saved(bf.plotting.save_figure(figure, folder / f"{stem}.{options.format}"))
    if any("interrupt" in _reason(branch) for branch in branches):
        raise KeyboardInterrupt
    if options.basins:
        return map_basins(name, system.with_parameters(**story.basin), story.window, folder, options)
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
    while starts and len(known) < _BRANCHES:
        start = starts.pop(0)
        if any(_on_branch(start, branch) for branch in known):
            continue
        branch = bf.trace(start, parameter, bounds=bounds, progress=not quiet, **step)
        known.append(branch)
        yield branch
        if "interrupt" in _reason(branch):
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
    for number, branch in enumerate(branches, 1):
        for point in branch.special_points:
            near = [row for row in rows if row[0] == point.kind and math.isclose(row[1], point.parameter, rel_tol=1e-9)]
            if not near:
                rows.append((str(point.kind), point.parameter, f"{point.error:.1e}", str(number)))
    if not rows:
        return "no special points"
    head = f"{'special point':<20}{parameter:>18}{'error below':>14}{'branch':>8}"
    lines = [head, "-" * len(head)]
    lines += [f"{kind.replace('_', ' '):<20}{at:>18.12f}{error:>14}{number:>8}" for kind, at, error, number in rows]
    return "\n".join(lines)


def run_basins(options: argparse.Namespace) -> int:
    """Map the basins of attraction over two components of the start."""
    name, system, story = _system(options)
    if not options.set:
        system = system.with_parameters(**story.basin)
    window = story.window
    if options.window:
        window = {component: (_number(low), _number(high)) for component, low, high in options.window}
        if len(window) != 2:
            raise UsageError(f"--window is given twice, once a component (such as q0 and v0), got {len(window)}")
    warm_up()
    return map_basins(name, system, window, _folder(options.out), options)


def map_basins(name: str, system: Any, window: dict[str, tuple[float, float]], folder: Path,
               options: argparse.Namespace) -> int:
    """Map, print, save and draw the basins of one system, and its attractors as motions."""
    print(f"{system!r}: basins of {options.cells} x {options.cells} starts")
    grid = bf.Grid(**{component: (*bounds, options.cells) for component, bounds in window.items()})
    basins = bf.basins_of_attraction(system, grid, workers=options.workers, progress=not options.quiet,
                                     file=folder / f"{name}_basins.npz")
    print(basin_table(basins))
    figure, (ax,) = bf.plotting.figure(6.3, 4.4)
    bf.plotting.plot_basins(basins, ax)
    _say_saved(bf.plotting.save_figure(figure, folder / f"{name}_basins.{options.format}"))
    motions = [attractor for attractor in basins.attractors if hasattr(attractor, "sample")][:4]
    if motions:
        figure, axes = bf.plotting.figure(6.9, 3.0 * len(motions), columns=2, rows=len(motions), width_ratios=(1, 1.35))
        for k, attractor in enumerate(motions):
            bf.plotting.plot_orbit(attractor, axes[2 * k:2 * k + 2])
        _say_saved(bf.plotting.save_figure(figure, folder / f"{name}_motions.{options.format}"))
    return 0


def basin_table(basins: Any) -> str:
    """Return the attractors with their basins' fractions, and how far the labels can be trusted."""
    head = f"{'label':>5}  {'attractor':<24}{'fraction':>10}  multipliers"
    lines = [head, "-" * len(head)]
    for label, attractor in enumerate(basins.attractors):
        multipliers = getattr(attractor, "multipliers", None)
        words = "" if multipliers is None else ", ".join(_complex(value) for value in multipliers[:4])
        fraction = basins.fractions.get(label, 0.0)
        lines.append(f"{label:>5}  {bf.plotting.describe(attractor):<24}{fraction:>10.6f}  {words}")
    lines.append(f"{-1:>5}  {'unresolved':<24}{basins.fractions.get(-1, 0.0):>10.6f}")
    lines.append(f"predicted fraction of untrustworthy labels: {basins.label_uncertainty:.1e}")
    return "\n".join(lines)


def run_info(options: argparse.Namespace) -> int:
    """Print a system's equation and parameters; without a system: versions, folders, and the systems there are."""
    if options.system is not None:
        name = _name(options.system)
        builder = getattr(bf.systems, name)
        print(f"{name}\n\n{inspect.getdoc(builder)}\n\nDefaults")
        for parameter, value in builder().parameters.items():
            print(f"  --set {parameter}={value}")
        return 0
    from ._cache import cache_folder

    print(f"bifurc {bf.__version__}, Python {sys.version.split()[0]}")
    for package in ("numpy", "scipy", "numba", "networkx", "matplotlib"):
        print(f"  {package} {importlib.metadata.version(package)}")
    print(f"compiled kernels: {cache_folder()}\nsystems (bifurc info SYSTEM tells more):")
    for name in bf.systems.__all__:
        print(f"  {name:<32}{(inspect.getdoc(getattr(bf.systems, name)) or '').splitlines()[0]}")
    return 0


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, as all others of the program."""

    def error(self, message: str):
        raise UsageError(f"{message} ({self.prog} --help tells more)")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="bifurc", description="Periodic motions of systems that hit, rub, stick and slip.")
    parser.add_argument("--version", action="version", version=f"bifurc {bf.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    common = _Parser(add_help=False)
    common.add_argument("system", metavar="SYSTEM", help="name of a ready system (bifurc info lists them)")
    common.add_argument("--set", metavar="NAME=VALUE", nargs="+", action="extend", default=[], help="parameter values")
    common.add_argument("--out", metavar="DIR", default="bifurc-results", help="of the results (default: %(default)s)")
    common.add_argument("--format", choices=("png", "pdf", "svg"), default="png", help="of the pictures")
    common.add_argument("--cells", metavar="N", type=int, default=400, help="starts a side of the basin map (400)")
    common.add_argument("--workers", metavar="N", type=int, default=None, help="threads (default: one a processor)")
    common.add_argument("--quiet", action="store_true", help="no progress bars")

    trace = commands.add_parser("trace", parents=[common], help="trace a parameter, then map the basins",
                                description=inspect.getdoc(run_trace))
    trace.add_argument("--parameter", metavar="NAME", help="the parameter that varies")
    trace.add_argument("--bounds", metavar=("A", "B"), type=_number, nargs=2, help="its range")
    trace.add_argument("--periods", metavar="N", type=int, default=1, help="forcing periods of the motion (default: 1)")
    trace.add_argument("--measure", metavar="COLUMN", default=None, help="vertical axis (default: rms_0)")
    trace.add_argument("--ds-max", metavar="DS", type=_number, default=None, help="largest step along the branch")
    trace.add_argument("--no-basins", dest="basins", action="store_false", help="stop after the branches")
    trace.set_defaults(run=run_trace)

    basins = commands.add_parser("basins", parents=[common], help="map basins of attraction",
                                 description=inspect.getdoc(run_basins))
    basins.add_argument("--window", metavar=("NAME", "A", "B"), nargs=3, action="append",
                        help="a state component (q0, v0, ...) and its range; given twice")
    basins.set_defaults(run=run_basins)

    info = commands.add_parser("info", help="tell about the installation, or about a system")
    info.add_argument("system", metavar="SYSTEM", nargs="?")
    info.set_defaults(run=run_info)
    return parser


def _name(system: str) -> str:
    name = system.replace("-", "_")
    if name not in bf.systems.__all__:
        raise UsageError(f"SYSTEM {system!r} is unknown; there are {', '.join(bf.systems.__all__)}")
    return name


def _system(options: argparse.Namespace) -> tuple[str, Any, Story]:
    """Return the name, the built system and its story."""
    name = _name(options.system)
    builder = getattr(bf.systems, name)
    kinds = {key: type(value) for key, value in builder().parameters.items()}
    changes = {}
    for item in options.set:
        key, equals, text = item.partition("=")
        if not equals:
            raise UsageError(f"--set takes NAME=VALUE, got {item!r}")
        kind = kinds.get(key, float)
        try:
            changes[key] = kind(text)
        except ValueError:
            raise UsageError(f"--set {key} takes a value of type {kind.__name__}, got {text!r}") from None
    if options.cells < 2:
        raise UsageError(f"--cells must be at least 2, got {options.cells}")
    return name, builder(**changes), _STORIES[name]


def _around(parameter: str, value: float) -> tuple[float, float]:
    """Return half and twice the value of a parameter that has no story."""
    if value == 0:
        raise UsageError(f"--bounds is needed: {parameter} is 0, which tells no range")
    return value / 2, 2 * value


def _folder(text: str) -> Path:
    folder = Path(text)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"a finite number is needed, got {text!r}")
    return value


def _reason(branch: Any) -> str:
    """Return why the tracer stopped, for both ends, as one line."""
    return " and ".join(str(reason).replace("_", " ") for reason in branch.stop_reason)


def _complex(value: complex) -> str:
    return f"{value.real:.6f}" if value.imag == 0 else f"{value.real:.6f}{value.imag:+.6f}i"


def _say_saved(path: Path) -> None:
    print(f"picture: {path}")


if __name__ == "__main__":
    sys.exit(main())
