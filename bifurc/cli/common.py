"""What the commands share: systems by name and their stories, values and folders from the command line."""
import argparse
import math
import os
import re
import types
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bifurc as bf
from bifurc import io

from ..structure.components import by_number, worded


@dataclass(frozen=True)
class Story:
    """What a system shows when nothing but its name is given."""

    parameter: str
    bounds: tuple[float, float]
    basin: dict[str, float]  # parameters of the basin map
    window: dict[str, tuple[float, float]]  # of the starts: two state components
    guess: tuple[float, ...] | None = None  # state at phase 0 near the motion, where rest is another one
    cells: int = 400  # starts a side of the basin map: fewer where each start is simulated under laws


STORIES = {
    "impact_oscillator": Story("omega", (0.5, 2.0), {"omega": 1.4}, {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}),
    "moving_frame_impact_oscillator": Story("omega", (0.8, 2.5), {}, {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}),
    "two_sided_impact_oscillator": Story("amplitude", (0.6, 4.0), {"amplitude": 0.8},
                                         {"q0": (-1.0, 1.0), "v0": (-3.0, 3.0)}),
    "bilinear_oscillator": Story("omega", (0.5, 2.5), {"omega": 1.29}, {"q0": (-2.0, 2.0), "v0": (-3.0, 3.0)}),
    "duffing_oscillator": Story("omega", (0.5, 2.5), {"omega": 1.5}, {"q0": (-2.5, 2.5), "v0": (-4.0, 4.0)}),
    "bouncing_ball": Story("amplitude", (0.3, 1.2), {}, {"q0": (0.5, 8.0), "v0": (-4.0, 4.0)}, (2.487161, 2.368808)),
    "dry_friction_oscillator": Story("amplitude", (1.1, 2.0), {}, {"q0": (-2.0, 2.0), "v0": (-3.0, 3.0)}),
    "jenkins_oscillator": Story("omega", (0.4, 2.0), {}, {"q0": (-4.0, 4.0), "v0": (-4.0, 4.0)}),
    "friction_damped_oscillator": Story("omega", (90.0, 104.0), {}, {"q0": (-2.0, 2.0), "v0": (-200.0, 200.0)}),
    "belt_oscillator": Story("belt_speed", (0.05, 0.8), {}, {"q0": (-1.0, 2.0), "v0": (-1.5, 1.5)}),
    "jeffcott_rotor": Story("nu", (0.7, 2.0), {"nu": 1.7}, {"q0": (-0.4, 1.4), "v1": (-2.0, 2.0)}, cells=60),
    "rigid_stator_rotor": Story("nu", (0.7, 2.0), {"nu": 2.0}, {"q0": (-0.4, 1.4), "v1": (-3.0, 3.0)}, cells=60),
    "rotating_frame_rotor": Story("nu", (0.5, 3.6), {}, {"q0": (-1.5, 1.5), "v1": (-2.0, 2.0)}),
    "impact_chain": Story("amplitude", (0.3, 0.5), {}, {"q7": (-3.0, 1.0), "v7": (-2.0, 2.0)}),
}


class UsageError(argparse.ArgumentTypeError, ValueError):
    """A request that cannot be met; the message is shown in one line."""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, as all others of the program."""

    def error(self, message: str):
        raise UsageError(f"{message} ({self.prog} --help tells more)")


def shared() -> Parser:
    """Return the arguments that all commands on a system have."""
    common = Parser(add_help=False)
    common.add_argument("system", metavar="SYSTEM", help="name of a ready system (bifurc info lists them)")
    common.add_argument("--set", metavar="NAME=VALUE", nargs="+", action="extend", default=[], help="parameter values")
    common.add_argument("--out", metavar="DIR", default="bifurc-results", help="of the results (default: %(default)s)")
    common.add_argument("--format", choices=("png", "pdf", "svg"), default="png", help="of the pictures")
    common.add_argument("--cells", metavar="N", type=int, default=None, help="starts a side of the basin map (400; rotors 60)")
    common.add_argument("--workers", metavar="N", type=int, default=None, help="threads (default: one a processor)")
    common.add_argument("--quiet", action="store_true", help="no progress bars")
    return common


def system_name(system: str) -> str:
    """Return the name of a ready system."""
    name = system.replace("-", "_")
    if name not in bf.systems.__all__:
        raise UsageError(f"SYSTEM {system!r} is unknown; there are {', '.join(bf.systems.__all__)}")
    return name


def set_values(name: str, settings: list[str]) -> dict[str, Any]:
    """Return the values of ``NAME=VALUE`` by name, in the types that the builder declares.

    Lists of numbers are written with commas between them; ``None`` is what it is where the builder allows it.
    """
    kinds = typing.get_type_hints(getattr(bf.systems, name))
    changes: dict[str, Any] = {}
    for item in settings:
        key, equals, text = item.partition("=")
        if not equals:
            raise UsageError(f"--set takes NAME=VALUE, got {item!r}")
        declared = kinds.get(key, float)
        kind, *others = typing.get_args(declared) if isinstance(declared, types.UnionType) else (declared,)
        several = typing.get_origin(kind) is tuple
        try:
            if text == "None" and others:
                changes[key] = None
            else:
                changes[key] = tuple(float(part) for part in text.split(",")) if several else kind(text)
        except ValueError:
            words = "numbers with commas between them" if several else f"a value of type {kind.__name__}"
            raise UsageError(f"--set {key} takes {words}, got {text!r}") from None
    return changes


def system_of(options: argparse.Namespace) -> tuple[str, Any, Story]:
    """Return the name, the built system and its story."""
    name = system_name(options.system)
    if options.cells is not None and options.cells < 2:
        raise UsageError(f"--cells must be at least 2, got {options.cells}")
    if name not in STORIES:
        raise no_story(name)
    check_outputs(options)
    return name, getattr(bf.systems, name)(**set_values(name, options.set)), STORIES[name]


def no_story(name: str) -> UsageError:
    """Return the error of a command that a system without a story cannot serve."""
    if any(isinstance(element, bf.elements.Driven) for element in getattr(bf.systems, name)().elements):
        return UsageError(f"{name} is driven by a displacement: its motion is given; `bifurc hysteresis {name}` shows its forces")
    return UsageError(f"{name} has no ready story for the command line; in Python: "
                      f"bf.trace(bf.find_orbit(bf.systems.{name}()), ...)")


def range_of(options: argparse.Namespace, system: Any, story: Story, parameter: str) -> tuple[float, float]:
    """Return the bounds of a parameter in ascending order: those given, those of its story, or half to twice its value.

    Raises
    ------
    UsageError
        Where none were given and the value 0 tells no range.
    """
    if options.bounds is not None:
        bounds = options.bounds
    elif parameter == story.parameter:
        bounds = story.bounds
    else:
        value = system.parameter(parameter)
        if value == 0.0:
            raise UsageError(f"--bounds is needed: {parameter} is 0, which tells no range")
        bounds = value / 2.0, 2.0 * value
    low, high = sorted(bounds)
    return low, high


def add_window(command, words: str = "once a component") -> None:
    """Add ``--window`` to a command."""
    command.add_argument("--window", metavar=("NAME", "A", "B"), nargs=3, action="append",
                         help=f"a state component (q0, v0, ...) and its range; {words}")


def window_of(options: argparse.Namespace, story: Story) -> dict[str, tuple[float, float]]:
    """Return the components of the starts and their ranges: those given, or those of the story."""
    if not options.window:
        return story.window
    components = [component for component, *_ in options.window]
    if len({*components}) < len(components):
        raise UsageError(f"--window is given once a component, got {' and '.join(components)}")
    return {component: (number(low), number(high)) for component, low, high in options.window}


def check_outputs(options: argparse.Namespace) -> None:
    """Refuse, before any work, files that could not be written afterwards, and numbers that no work can use."""
    folder = Path(options.out)
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise UsageError(f"--out {options.out}: {folder} is {'not writable' if folder.is_dir() else 'a file'}")
    if options.workers is not None and options.workers < 1:
        raise UsageError(f"--workers must be at least 1, got {options.workers}")


def check_files(*files: Path) -> None:
    """Refuse, before any work, to write where something else than a result is.

    Raises
    ------
    FileExistsError
    """
    for file in files:
        io.replaceable(file)


def check_measure(name: str, system: Any, extra: tuple[str, ...] = ()) -> str:
    """Return a measure that branches of a system have.

    Raises
    ------
    UsageError
    """
    match = re.fullmatch(r"(max|min|rms|h1)_(0|[1-9]\d*)", by_number(name, system.states))
    if name not in extra and (match is None or int(match[2]) >= system.measured):
        known = [" .. ".join(dict.fromkeys(worded(f"{kind}_{k}", system.states) for k in (0, system.measured - 1)))
                 for kind in ("max", "min", "rms", "h1")]
        raise UsageError(f"--measure {name!r} is unknown; there are {', '.join((*known, *extra))}")
    return name


def folder_of(text: str) -> Path:
    """Return the folder of that name, created when missing."""
    folder = Path(text)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def number(text: str) -> float:
    """Return a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"a finite number is needed, got {text!r}")
    return value


def reason(branch: Any) -> str:
    """Return why the tracer stopped, for both ends, as one line."""
    return " and ".join(str(reason).replace("_", " ") for reason in branch.stop_reason)


def say_saved(path: Path) -> None:
    """Tell where a picture is."""
    print(f"picture: {path}")
