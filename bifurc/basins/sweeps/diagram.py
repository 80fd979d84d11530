"""Bifurcation diagrams by brute force: section points against a parameter, each value started where the last one ended."""
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ... import io, plotting
from ...checks import array, checked, floats, of, several, shown, whole
from ...compose.natural import natural_length, natural_sizes
from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.period_map import MAPPED, PeriodMap
from ...jobs.executors import run_chunks, user_parts
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...notebook import Notebook
from ...orbits.standing import resting_start
from ...system import System, require_system, require_values
from .attractor_sweep import _values
from .sections import period_of, settled

TOLERANCE = 1e-6  # scaled distance of section points that count as one
DIRECTIONS = ("up", "down")


@dataclass(frozen=True, eq=False)
class BifurcationDiagram(Content, Notebook):
    """Section points over a parameter.  Made by `bifurcation_diagram`.

    Attributes
    ----------
    system : System
    parameter : str
    values : ndarray
        (m,), increasing.
    directions : tuple of str
        "up", "down".
    points : ndarray
        (directions, m, starts, keep, ns); NaN where a motion ended, see `outcomes`.
    periods : ndarray of int
        (directions, m, starts): forcing periods after which the points repeat, 0: not within half of ``keep``.
    impacts : ndarray
        (directions, m, starts), a forcing period.
    outcomes : ndarray of int
        (directions, m, starts), `CellState` codes, 0: carried through; 64 more: started anew because the state carried
        over was no start at this value.
    options : dict
    """

    _facts = ("parameter", "directions")

    system: System
    parameter: str
    values: np.ndarray = field(repr=False)
    directions: tuple
    points: np.ndarray = field(repr=False)
    periods: np.ndarray = field(repr=False)
    impacts: np.ndarray = field(repr=False)
    outcomes: np.ndarray = field(repr=False)
    options: dict
    key: str = field(default="", repr=False)

    @checked()
    def plot(self, ax=None, component: int = 0, branches=(), names=None):
        """Draw a component of the section points over the parameter, with ``branches`` of `trace`; return the axes."""
        return plotting.plot_diagram(self, ax, component, branches, names=names)

    def to_xarray(self):
        """Return points, periods, impacts and outcomes as an xarray Dataset over direction, parameter, start, point and state."""
        import xarray  # optional

        dims = ("direction", self.parameter, "start", "kept", "state")
        fields = {name: getattr(self, name) for name in ("points", "periods", "impacts", "outcomes")}
        return xarray.Dataset({name: (dims[:values.ndim], values) for name, values in fields.items()},
                              {"direction": list(self.directions), self.parameter: self.values}, {"system": repr(self.system)})

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        arrays = {name: getattr(self, name) for name in ("values", "points", "periods", "impacts", "outcomes")}
        return {"kind": "diagram", "system": self.system.to_record(), "parameter": self.parameter, "directions": self.directions,
                "options": self.options, "key": self.key}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "BifurcationDiagram":
        """Make the diagram that `to_record` described."""
        io.fitted(arrays, {"values": "finite m", "points": "real d m starts keep ns", "periods": "whole d m starts",
                           "impacts": "real d m starts", "outcomes": "whole d m starts"}, d=len(header["directions"]))
        return cls(System.from_record(header["system"], elements), header["parameter"], directions=tuple(header["directions"]),
                   options=header["options"], key=header["key"], **arrays)

    @checked()
    def save(self, path) -> None:
        """Write the diagram to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        lost = int(np.count_nonzero(self.outcomes % RESTARTED != MAPPED))
        kinds = sorted(set(self.periods[self.outcomes % RESTARTED == MAPPED].tolist()))
        return (f"BifurcationDiagram({self.parameter} at {len(self.values)} values, {' and '.join(self.directions)}, periods "
                f"{', '.join(map(str, kinds))}{f', {lost} motions ended' if lost else ''})")


RESTARTED = 64  # added to the outcome of a motion that was started anew


def diagram_points(payload: Mapping) -> tuple[dict, dict[str, np.ndarray]]:
    """Carry starts through some parameter values, one after the other: the work of a chunk."""
    base = System.from_record(payload["system"], payload["elements"])
    name, transient, keep = payload["parameter"], payload["transient"], payload["keep"]
    X, first, scale = payload["state"].copy(), payload["starts"], payload["scale"]
    shape = (len(payload["values"]), len(X))
    points = np.empty((*shape, keep, X.shape[1]))
    outcomes, impacts, periods = np.empty(shape, np.int64), np.empty(shape), np.zeros(shape, np.int64)
    for v, value in enumerate(payload["values"]):
        period_map = PeriodMap(base.with_parameters(**{name: float(value)}), max_events=payload["max_events"],
                               work=len(X) * (transient + keep))
        points[v], outcomes[v], hits = settled(period_map, X, transient, keep)
        lost = np.flatnonzero(outcomes[v] != MAPPED)
        if lost.size:  # no start here, or it ended: from the given start again
            points[v, lost], again, hits[lost] = settled(period_map, first[lost], transient, keep)
            outcomes[v, lost] = again + RESTARTED
        impacts[v] = hits / keep
        for k in range(len(X)):
            alive = outcomes[v, k] % RESTARTED == MAPPED
            X[k] = points[v, k, -1] if alive else first[k]
            periods[v, k] = period_of(points[v, k], scale, TOLERANCE) if alive else 0
    return {}, {"points": points, "outcomes": outcomes, "impacts": impacts, "periods": periods, "state": X}


@checked(values=of(array, axes=(0, 1)), starts=None, keep=of(whole, least=2), directions=of(several, allowed=DIRECTIONS))
def bifurcation_diagram(system: System, parameter: str, values, starts=None, *, directions=DIRECTIONS, transient: int = 300,
                        keep: int = 64, max_events: int = 2000, executor=None, workers: int | None = None, chunk: int = 25,
                        progress: bool = False, file=None) -> BifurcationDiagram:
    """Return section points over a parameter, swept up and down.

    Parameters
    ----------
    system : System
        With an excitation.
    parameter : str
        Name of a float parameter.
    values : array_like
        (m,), swept in rising order for "up" and in falling order for "down".
    starts : array_like, optional
        Start (ns,), or several (k, ns), of the first value of each direction; default: rest.  At each further value a
        motion starts where it ended.
    directions : tuple of str
        "up", "down", or both.
    transient, keep : int
        Forcing periods passed over and recorded at each value.
    max_events, executor, workers, progress, file
        As for `sweep`.
    chunk : int
        Values a chunk file.

    Returns
    -------
    BifurcationDiagram

    Raises
    ------
    ValueError
        Autonomous system, unknown parameter or direction, starts of the wrong shape.
    RuntimeError
        When a chunk fails; those before it are kept.

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.bifurcation_diagram(bf.systems.impact_oscillator(), "omega", [1.3, 1.4, 1.5], transient=200, keep=20)
    >>> found.points.shape[1] >= 3
    True
    """
    if require_system(system).period is None:
        raise ValueError(f"{system!r} is autonomous; a section needs the phase of an excitation (omega)")
    parameter = system.parameter_name(parameter)
    system.parameter(parameter)
    values = np.sort(_values(np.sort(np.atleast_1d(values))))
    first = _starts(system, starts)
    scene = scene_of(system)
    length = max(natural_length(scene.tables), float(np.abs(first[:, :scene.n]).max(initial=0.0)))
    scale = np.full(scene.ns, length) if scene.n else natural_sizes(scene.tables, first, 2.0 * np.pi / float(scene.omega or 1.0))
    scale[scene.n:2 * scene.n] *= float(scene.omega or 1.0)
    common = {"system": system.to_record(), "elements": user_parts(system), "parameter": parameter, "starts": first, "scale": scale,
              "transient": transient, "keep": keep, "max_events": max_events}
    require_values(system, "values", parameter, values)

    def compute(store: ChunkStore, key: str) -> BifurcationDiagram:
        pieces = _swept(store, common, values, directions, chunk, {"executor": executor, "workers": workers}, progress)
        arrays = {name: np.stack([np.concatenate([piece[name] for piece in pieces[item]])[::1 if item == "up" else -1]
                                  for item in directions]) for name in ("points", "periods", "impacts", "outcomes")}
        return BifurcationDiagram(system, parameter, values, directions, **arrays, key=key,
                                  options={"transient": transient, "keep": keep, "starts": first.tolist()})

    return resumable("diagram", file, {"what": "diagram", **common},
                     partial(BifurcationDiagram.from_record, elements=common["elements"]), compute,
                     part={"values": values, "directions": directions})


def _swept(store: ChunkStore, common: dict, values, directions, chunk: int, run: dict, progress) -> dict[str, list]:
    """Return the pieces of each direction, one a chunk; both directions go side by side, a chunk begins where the last ended."""
    rows = {item: values if item == "up" else values[::-1] for item in directions}
    states = {item: common["starts"] for item in directions}
    pieces: dict[str, list] = {item: [] for item in directions}
    with Progress("diagram", len(values) * len(directions), progress) as bar:
        for begin in range(0, len(values), chunk):
            payloads = [{**common, "values": rows[item][begin:begin + chunk], "state": states[item]} for item in directions]
            outcome = run_chunks(store, diagram_points, payloads, bar=bar, weights=[len(payload["values"]) for payload in payloads],
                                 **run)
            if outcome.failures:
                why = next(iter(outcome.failures.values()))
                raise RuntimeError(f"a chunk of the diagram failed, those before it are kept: {why}")
            for item, result in zip(directions, outcome.results, strict=True):
                assert result is not None
                states[item] = result[1]["state"]
                pieces[item].append(result[1])
    return pieces


def _starts(system: System, starts) -> np.ndarray:
    ns = scene_of(system).ns
    given = floats(resting_start(system) if starts is None else starts)
    found = np.atleast_2d(np.empty((0, 0, 0)) if given is None else given)
    if found.ndim != 2 or found.shape[1] != ns or not len(found) or not np.isfinite(found).all():
        raise ValueError(f"starts = {shown(starts)} is not allowed; it must be a finite state ({ns},) or several (k, {ns})")
    return found
