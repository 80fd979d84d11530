"""What the explorer shows and the commands on it.  Knows no web library; every command is a function of what is shown.

A command returns a dictionary of what it changes, so that it may run beside others in a thread; `Session` puts changes
into what is shown by then, and keeps the way back.

One file, because it is one session: every command reads and changes the same record of what is shown.
"""
import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import bifurc as bf

from ..checks import checked, floats, instance, refused
from ..compose.scene import scene_of
from ..continuation import ContinuationError
from ..orbits.base import Orbit
from ..structure.components import component_names, place_of, worded
from ..system import require_values
from .script import Made, Script, grid_text

COARSE, FINE = 100, 400  # cells a side of a basin slice: at once, and then
POINT_SHARE = 0.02  # of the diagram's diagonal, within which a click means a special point and not the row beside it
REACH = 1.6  # a first slice of starts reaches so far around the orbit
BOTH = 2  # starts behind a special point that are traced


@dataclass(frozen=True)
class Shown:
    """Everything on the page.

    Attributes
    ----------
    system : System
        At the parameters of the orbit.
    parameter : str
        That branches are traced in.
    bounds : tuple of float
        Its range.
    branches : tuple of Made
    orbit : Made or None
    place : tuple of int, or None
        Branch and row that the orbit was picked from; a special point is (branch, -1 - its index).
    basins : Made or None
    window : dict of str to (low, high)
        Components and ranges of the slice of starts.
    measure : str
        Column on the vertical axis of the branch diagram.
    message : str
        What the last command has to say.
    """

    system: Any
    parameter: str
    bounds: tuple[float, float]
    branches: tuple[Made, ...] = ()
    orbit: Made | None = None
    place: tuple[int, int] | None = None
    basins: Made | None = None
    window: dict = field(default_factory=dict)
    measure: str = "rms_0"
    message: str = ""

    def fits(self, branch: Made) -> bool:
        """Whether a branch belongs to the system as it is now: all parameters but the traced one are the same."""
        mine, other = self.system.parameters, branch.value.orbits[0].system.parameters
        return {**mine, branch.value.parameter: 0} == {**other, branch.value.parameter: 0}

    @property
    def special_point(self) -> Any:
        """The special point that was picked, or None."""
        if self.place is None or self.place[1] >= 0:
            return None
        return self.branches[self.place[0]].value.special_points[-1 - self.place[1]]


class Session:
    """What is shown, and the way back.

    Parameters
    ----------
    first : Shown
    """

    @checked(first=instance("bifurc.explore.model:Shown", "what is shown of a system, a `Shown`"))
    def __init__(self, first: Shown):
        self.first, self.now = first, first
        self._before: list[tuple[str, Shown]] = []

    def put(self, change: Mapping, step: str = "") -> Shown:
        """Apply a change; ``step`` names the action: successive changes of one step (a drag) are one way back."""
        if step and (not self._before or self._before[-1][0] != step):
            self._before.append((step, self.now))
        self.now = dataclasses.replace(self.now, **change)
        return self.now

    def rest(self) -> None:
        """End a step: the next change of the same name is a new one."""
        if self._before:
            self._before[-1] = ("", self._before[-1][1])

    def back(self) -> Shown:
        """Return to what was shown before the last step."""
        if self._before:
            self.now = self._before.pop()[1]
        return self.now

    def reset(self) -> Shown:
        """Return to the first page."""
        self._before.clear()
        self.now = self.first
        return self.now

    @property
    def can_go_back(self) -> bool:
        """Whether there is something to go back to."""
        return bool(self._before)


# ---- beginnings --------------------------------------------------------------------------------------------------------


def of_system(system: Any, parameter: str | None = None, bounds: Sequence[float] | None = None,
              window: Mapping | None = None) -> Shown:
    """Return the first page of a system: nothing is computed yet.

    Parameters
    ----------
    system : System
        With an excitation.
    parameter : str, optional
        Default: ``omega``.
    bounds : pair of float, optional
        Default: half to twice the value.
    window : dict of str to (low, high), optional
        Two components of the start.

    Raises
    ------
    ValueError
        Autonomous systems, unknown parameters, ranges that are empty or reversed.
    """
    if system.period is None:
        raise ValueError(f"{system!r} is autonomous; the explorer needs an excitation (omega)")
    parameter = system.parameter_name(parameter or "omega")
    value = system.parameter(parameter)
    low, high = reach(value) if bounds is None else ascending("bounds", bounds)
    require_values(system, "bounds", parameter, (low, high))
    for name in window or ():
        place_of(name, system.n, scene_of(system).ns, "window", system.states)
    system = system.with_parameters(**{parameter: min(max(value, low), high)})
    return Shown(system, parameter, (low, high), measure=worded("rms_0", system.states), window={
        name: ascending(f"window[{name!r}]", part) for name, part in dict(window or {}).items()})


def ascending(name: str, part: Any) -> tuple[float, float]:
    """Return a range as it was given, or raise ValueError: two finite numbers, the lower one first."""
    found = floats(part)
    if found is None or found.shape != (2,) or not np.isfinite(found).all() or not found[0] < found[1]:
        raise refused("", name, part, "two finite numbers, the lower one first")
    return float(found[0]), float(found[1])


def of_result(result: Any, path: str) -> Shown:
    """Return the first page of a saved branch, orbit or basin map; ``path`` is its file, for the script."""
    def write(script: Script) -> str:
        return f"bf.load({str(path)!r})"

    if isinstance(result, bf.Branch):
        made = Made(result, "branch", write)
        orbit = Made(result.orbits[0], "orbit", lambda script, branch: f"{branch}.orbits[0]", (made,))
        first = worded("rms_0", result.states)
        return Shown(orbit.value.system, result.parameter, result.bounds, (made,), orbit, (0, 0),
                     measure=first if first in result.column_names else result.column_names[3])
    if isinstance(result, bf.BasinMap):
        made = Made(result, "basins", write)
        start = of_system(result.system)
        window = {name: (low, high) for name, low, high in zip(result.grid.names, result.grid.low, result.grid.high, strict=True)}
        return dataclasses.replace(start, basins=made, window=window)
    if isinstance(result, Orbit):
        return dataclasses.replace(of_system(result.system), orbit=Made(result, "orbit", write))
    raise ValueError(f"{path} holds a {type(result).__name__}; the explorer opens branches, orbits and basin maps")


# ---- commands ------------------------------------------------------------------------------------------------------------


def begin(shown: Shown) -> dict:
    """Find the first orbit, if there is none: the motion from rest."""
    return {} if shown.orbit is not None else change_parameters(shown, {})


def pick(shown: Shown, x: float, y: float, span: tuple[float, float]) -> dict:
    """Take the orbit of the row, or of the special point, nearest to a place in the branch diagram.

    Parameters
    ----------
    x, y : float
        In the units of the axes.
    span : tuple of float
        Visible widths of both axes: distances are compared on the screen.
    """
    best, place = math.inf, None
    for number, branch in enumerate(shown.branches):
        rows = np.column_stack([branch.value.column(branch.value.parameter), branch.value.column(shown.measure)])
        far = np.hypot((rows[:, 0] - x) / span[0], (rows[:, 1] - y) / span[1])
        row = int(np.argmin(far))
        if far[row] < best:
            best, place = float(far[row]), (number, row)
    closest = POINT_SHARE
    for number, branch in enumerate(shown.branches):
        for index, point in enumerate(branch.value.special_points):
            away = math.hypot((point.parameter - x) / span[0], (point.measures[shown.measure] - y) / span[1])
            if away < closest:
                closest, place = away, (number, -1 - index)
    return {"message": "there is no branch yet"} if place is None else take(shown, *place)


def take(shown: Shown, number: int, row: int) -> dict:
    """Take the orbit of a row of a branch (row >= 0), or of its special point -1 - row."""
    branch = shown.branches[number]
    if row >= 0:
        where, orbit = f"orbits[{row}]", branch.value.orbits[row]
        message = f"branch {number + 1}, row {row} of {len(branch.value)}"
    else:
        point = branch.value.special_points[-1 - row]
        where, orbit = f"special_points[{-1 - row}].solution", point.solution
        message = repr(point)
    made = Made(orbit, "orbit", lambda script, name: f"{name}.{where}", (branch,))
    return {"orbit": made, "place": (number, row), "system": orbit.system, "message": message}


def change_parameters(shown: Shown, values: Mapping[str, float]) -> dict:
    """Give parameters other values and find the orbit there, from the state of the one that is shown."""
    system = shown.system.with_parameters(**values)
    if shown.orbit is None:
        guesses: list[tuple[Any, int | None]] = [(None, None)]
    else:
        old = shown.orbit.value
        guesses = [(tuple(float(item) for item in old.state), int(old.periods)), (None, None)]
    orbit = None
    for guess, periods in guesses:
        try:
            orbit = bf.find_orbit(system, guess=guess, periods=periods)
        except ValueError:  # the old state lies beyond a stop that has moved
            continue
        if orbit.success:
            break
    if orbit is None or not orbit.success:
        why = "no orbit was found" if orbit is None else orbit.message
        return {"system": system, "orbit": None, "place": None, "message": why}
    hint = "" if guess is None else f", guess={guess!r}, periods={periods}"
    made = Made(orbit, "orbit", lambda script: f"bf.find_orbit({script.system(system)}{hint})")
    return {"system": system, "orbit": made, "place": None, "message": orbit.message}


def trace_here(shown: Shown) -> dict:
    """Trace the branch through the orbit that is shown."""
    if shown.orbit is None:
        return {"message": "there is no orbit to trace from"}
    return _traced(shown, shown.orbit)


def switch_here(shown: Shown) -> dict:
    """Trace the branches that leave the special point that is shown."""
    point = shown.special_point
    if point is None:
        return {"message": "click a special point first: branches are switched there"}
    branch = shown.branches[shown.place[0]]  # type: ignore[index]  # a special point has a place
    index = -1 - shown.place[1]  # type: ignore[index]
    switched = bf.switch_branch(point)
    if not switched:
        return {"message": f"no other branch here: {switched.status}"}
    others = Made(switched, "others", lambda script, name: f"bf.switch_branch({name}.special_points[{index}])", (branch,))
    found, said = shown.branches, []
    for k, start in enumerate(switched[:BOTH]):
        orbit = Made(start, "start", lambda script, name, k=k: f"{name}[{k}]", (others,))
        change = _traced(dataclasses.replace(shown, branches=found), orbit)
        found = change.get("branches", found)
        said.append(change["message"])
    return {"branches": found, "message": f"{switched.status}; {'; '.join(said)}"}


def map_here(shown: Shown, window: Mapping | None = None, cells: int = FINE, file=None, executor=None) -> dict:
    """Map the basins of the system that is shown over a slice of starts.

    Parameters
    ----------
    window : dict of str to (low, high), optional
        Default: that of the slice on the page, or around the orbit.  Over the components of the last map it
        lies in the same slice: at the same values of the others, and what was periodic is, where its range is the same.
    cells : int
        A side.
    file : path-like, optional
        Where the map and its chunks are kept.
    executor : Executor, optional

    Raises
    ------
    RuntimeError
        When the executor gave up.
    """
    system = shown.system
    ranges = dict(window or shown.window or around(shown))
    sides = {name: (float(low), float(high), int(cells)) for name, (low, high) in ranges.items()}
    last = None if shown.basins is None else shown.basins.value.grid
    if last is not None and set(last.names) == set(sides):
        whole = [name for name, low, high in zip(last.names, last.low, last.high, strict=True) if sides[name][:2] == (low, high)]
        grid = bf.Grid(at=last.at, periodic=[name for name in last.periodic if name in whole], **sides)
    else:
        grid = bf.Grid(**sides)
    root = shown.basins if shown.basins is not None and shown.basins.value.system == system else None
    while root is not None and root.needs and len(root.needs[0].value.attractors) == len(root.value.attractors):
        root = root.needs[0]  # later maps that found nothing new have its attractors
    attractors = None if root is None else root.value.attractors
    found = bf.basins_of_attraction(system, grid, attractors=attractors, file=file, executor=executor)

    def write(script: Script, *names: str) -> str:
        known = f", attractors={names[0]}.attractors" if names else ""
        return f"bf.basins_of_attraction({script.system(system)}, {grid_text(grid)}{known})"

    made = Made(found, "basins", write, () if root is None else (root,))
    shares = ", ".join(f"{bf.plotting.describe(item)} {100 * found.fractions[k]:.3g} %" for k, item in enumerate(found.attractors))
    return {"basins": made, "window": ranges, "message": shares or "no attractor was found"}


def settle_on(shown: Shown, x: float, y: float) -> dict:
    """Take the attractor to which a start of the basin slice leads."""
    if shown.basins is None:
        return {"message": "there is no basin map yet"}
    basins = shown.basins.value
    cell = int(basins.grid.cells_of(np.array([[x, y]]))[0])
    label = -1 if cell < 0 else int(basins.labels.flat[cell])
    if label < 0:
        return {"message": "no attractor is known for this start"}
    orbit = basins.attractors[label]
    if not orbit.periodic:
        return {"message": f"attractor {label} is {orbit.regime}: {orbit!r}"}
    made = Made(orbit, "orbit", lambda script, name: f"{name}.attractors[{label}]", (shown.basins,))
    return {"orbit": made, "place": None, "system": orbit.system, "message": f"attractor {label} of the basin map"}


# ---- saving --------------------------------------------------------------------------------------------------------------


def script(shown: Shown) -> str:
    """Return a program that makes everything on the page again, and draws it."""
    made = Script(_results(shown))
    branches = [made.add(branch) for branch in shown.branches]
    draw = [f"axes = bf.plotting.plot_branches([{', '.join(branches)}], measure={shown.measure!r})",
            'bf.plotting.save_figure(axes.figure, "branches.png")'] if branches else []
    if shown.orbit is not None:
        draw.append(f'bf.plotting.save_figure({made.add(shown.orbit)}.plot()[0].figure, "orbit.png")')
    if shown.basins is not None:
        draw.append(f'bf.plotting.save_figure({made.add(shown.basins)}.plot().figure, "basins.png")')
    said = [f"print({made.add(item)})" for item in _results(shown)]
    head = '"""What the explorer showed: every result is computed again."""'
    return "\n".join([head, *made.head, "", *made.lines, "", *said, "", *draw, ""])


def save(shown: Shown, folder) -> list[Path]:
    """Write script, results and pictures of what is shown into a folder; return the files.

    Raises
    ------
    OSError
        When the folder cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "explored.py"]
    files[0].write_text(script(shown), encoding="utf-8")
    names = Script(_results(shown))
    for item in _results(shown):
        files.append(folder / f"{names.add(item)}.npz")
        item.value.save(files[-1])
    if shown.branches:
        figure, (ax,) = bf.plotting.figure()
        bf.plotting.plot_branches([branch.value for branch in shown.branches], ax, measure=shown.measure)
        files.append(bf.plotting.save_figure(figure, folder / "branches.png"))
    if shown.orbit is not None:
        figure, axes = bf.plotting.figure(6.9, 3.1, columns=2, width_ratios=(1, 1.35))
        bf.plotting.plot_orbit(shown.orbit.value, axes)
        files.append(bf.plotting.save_figure(figure, folder / "orbit.png"))
    if shown.basins is not None:
        figure, (ax,) = bf.plotting.figure(6.3, 4.6)
        bf.plotting.plot_basins(shown.basins.value, ax)
        files.append(bf.plotting.save_figure(figure, folder / "basins.png"))
    return files


def _results(shown: Shown) -> list[Made]:
    return [*shown.branches, *(item for item in (shown.orbit, shown.basins) if item is not None)]


# ---- small things ----------------------------------------------------------------------------------------------------------


def reach(value: float) -> tuple[float, float]:
    """Return the range of a parameter that nobody gave: half to twice the value; -1 to 1 around zero."""
    return (-1.0, 1.0) if value == 0.0 else (min(0.5 * value, 2.0 * value), max(0.5 * value, 2.0 * value))


def parameters(system: Any) -> list[str]:
    """Return the names of the parameters that can vary."""
    return [name for name, value in system.parameters.items() if type(value) is float]


def around(shown: Shown) -> dict:
    """Return a slice of starts around the orbit: coordinate and velocity of the one that moves most."""
    n, names = shown.system.n, component_names(shown.system.n, scene_of(shown.system).ns, shown.system.states)
    if shown.orbit is None:
        return {name: (-2.0, 2.0) for name in (names[0], names[max(n, 1)])}
    _, y = shown.orbit.value.sample(200)
    if n == 0:
        return {names[k]: (-length, length) for k in np.sort(np.argsort(-np.ptp(y, axis=0))[:2])
                for length in (max(float(np.abs(y[:, k]).max()), 1e-12) * REACH,)}
    sizes = np.ptp(y[:, :n], axis=0)
    dof = int(np.argmax(sizes))
    length = max(float(np.abs(y[:, dof]).max()), 1e-12) * REACH
    speed = max(float(np.abs(y[:, n + dof]).max()), 1e-12) * REACH
    return {f"q{dof}": (-length, length), f"v{dof}": (-speed, speed)}


def _traced(shown: Shown, orbit: Made) -> dict:
    value = shown.system.parameter(shown.parameter)
    low, high = min(shown.bounds[0], value), max(shown.bounds[1], value)
    try:
        branch = bf.trace(orbit.value, shown.parameter, bounds=(low, high))
    except (ContinuationError, ValueError) as error:
        return {"message": str(error)}
    rest = f"{shown.parameter!r}, bounds=({low!r}, {high!r})"
    made = Made(branch, "branch", lambda script, name: f"bf.trace({name}, {rest})", (orbit,))
    return {"branches": (*shown.branches, made), "message": f"branch {len(shown.branches) + 1}: {branch!r}"}
