"""Charts over two parameters: period, impacts, exponent and number of attractors of every cell, by brute force."""
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ... import io, plotting
from ...checks import checked, mapping
from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.period_map import MAPPED, PeriodMap
from ...ensemble.region import Region
from ...jobs.executors import run_chunks, user_parts
from ...jobs.progress import Progress
from ...jobs.resumable import resumable
from ...jobs.store import ChunkStore
from ...notebook import Notebook
from ...orbits.lyapunov import lyapunov_exponents
from ...system import System, require_system, require_values
from .attractor_sweep import _values
from .sections import APERIODIC, groups, period_of, settled

TOLERANCE = 1e-5  # scaled distance of section points that count as one
PATIENCE = 4  # times the transient, for motions that did not repeat after it
EXPONENT_PERIODS = 400
FIELDS = {"periods": np.int64, "impacts": float, "attractors": np.int64, "settled": np.int64, "exponents": float, "errors": float}
BLANK = {"periods": -1, "impacts": 0.0, "attractors": 0, "settled": 0, "exponents": np.nan, "errors": np.nan}  # of no motion


@dataclass(frozen=True, eq=False)
class ParameterChart(Content, Notebook):
    """What motions a grid of two parameters has.  Made by `parameter_chart`.

    Attributes
    ----------
    system : System
    parameters : tuple of str
    values : tuple of ndarray
        Of the two parameters, (a,) and (b,).
    periods : ndarray of int
        (a, b): forcing periods of the motion that most starts reach; 0: it does not repeat within ``longest``; -1: no
        start could be followed, or the cell failed.
    impacts : ndarray
        (a, b): impacts a forcing period of that motion.
    attractors : ndarray of int
        (a, b): different motions reached; all that do not repeat count as one.
    settled : ndarray of int
        (a, b): starts that could be followed.
    exponents, errors : ndarray
        (a, b): largest Lyapunov exponent of that motion, per time, and its standard error; NaN unless asked for.
    options : dict
    failures : dict
        Cells that failed, by their number in the flat chart -> why.
    """

    _facts = ("parameters",)

    system: System
    parameters: tuple[str, str]
    values: tuple[np.ndarray, np.ndarray] = field(repr=False)
    periods: np.ndarray = field(repr=False)
    impacts: np.ndarray = field(repr=False)
    attractors: np.ndarray = field(repr=False)
    settled: np.ndarray = field(repr=False)
    exponents: np.ndarray = field(repr=False)
    errors: np.ndarray = field(repr=False)
    options: dict
    failures: dict = field(default_factory=dict)
    key: str = field(default="", repr=False)

    @checked()
    def plot(self, ax=None, field: str = "periods", names=None):
        """Draw ``periods``, ``impacts``, ``attractors`` or ``exponents`` over the two parameters; return the axes."""
        return plotting.plot_chart(self, ax, field, names=names)

    def to_xarray(self):
        """Return all fields as an xarray Dataset over the two parameters."""
        import xarray  # optional

        return xarray.Dataset({name: (self.parameters, getattr(self, name)) for name in FIELDS},
                              dict(zip(self.parameters, self.values, strict=True)), {"system": repr(self.system)})

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        arrays = {"values0": self.values[0], "values1": self.values[1], **{name: getattr(self, name) for name in FIELDS}}
        return {"kind": "chart", "system": self.system.to_record(), "parameters": self.parameters, "options": self.options,
                "failures": {str(k): v for k, v in self.failures.items()}, "key": self.key}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "ParameterChart":
        """Make the chart that `to_record` described."""
        io.fitted(arrays, {"values0": "finite a", "values1": "finite b",
                           **{name: f"{'whole' if kind is np.int64 else 'real'} a b" for name, kind in FIELDS.items()}})
        return cls(System.from_record(header["system"], elements), tuple(header["parameters"]),
                   (arrays["values0"], arrays["values1"]), options=header["options"],
                   failures={int(k): v for k, v in header["failures"].items()}, key=header["key"],
                   **{name: arrays[name] for name in FIELDS})

    @checked()
    def save(self, path) -> None:
        """Write the chart to an npz file."""
        io.write(path, *self.to_record())

    def __repr__(self):
        kinds = ", ".join(map(str, sorted(set(self.periods.ravel().tolist()))))
        several = np.count_nonzero(self.attractors > 1) / self.attractors.size
        left = f", {len(self.failures)} cells failed" if self.failures else ""
        return (f"ParameterChart({self.parameters[0]} x {self.parameters[1]}, {self.periods.shape[0]} x {self.periods.shape[1]} "
                f"cells, periods {kinds}, several attractors in {100 * several:.1f} % of them{left})")


def chart_cells(payload: Mapping) -> tuple[dict, dict[str, np.ndarray]]:
    """Compute some cells of a chart: the work of a chunk."""
    base = System.from_record(payload["system"], payload["elements"])
    region, o = Region.from_record(payload["region"]), payload["options"]
    rows = [_cell(base.with_parameters(**dict(zip(payload["parameters"], pair, strict=True))), region, o)
            for pair in payload["cells"].tolist()]
    return {}, {name: np.array([row[name] for row in rows], kind) for name, kind in FIELDS.items()}


def _cell(system: System, region: Region, o: Mapping) -> dict:
    """Return the fields of one cell."""
    scene = scene_of(system)
    scale, keep = region.sizes(scene), 2 * o["longest"]
    period_map = PeriodMap(system, max_events=o["max_events"], work=o["starts"] * (o["transient"] + keep))
    X = region.starts(scene, o["starts"], o["seed"])
    points, outcomes, hits = settled(period_map, X, o["transient"], keep)
    periods = np.array([period_of(row, scale, TOLERANCE) if code == MAPPED else -1
                        for row, code in zip(points, outcomes, strict=True)])
    slow = np.flatnonzero(periods == APERIODIC)
    if slow.size:  # slow, or truly without period
        points[slow], outcomes[slow], hits[slow] = settled(period_map, points[slow, -1], PATIENCE * o["transient"], keep)
        periods[slow] = [period_of(points[i], scale, TOLERANCE) if outcomes[i] == MAPPED else -1 for i in slow]
    good = np.flatnonzero(outcomes == MAPPED)
    if not good.size:
        return BLANK
    number = groups(points[good], periods[good], scale, TOLERANCE)
    top = good[number == np.bincount(number).argmax()][0]
    found = {**BLANK, "periods": int(periods[top]), "impacts": hits[top] / keep, "attractors": int(number.max()) + 1,
             "settled": good.size}
    if o["exponents"]:
        try:
            grown = lyapunov_exponents(system, points[top, -1], periods=EXPONENT_PERIODS, transient=0, max_events=o["max_events"])
            found["exponents"], found["errors"] = float(grown.values[0]), float(grown.errors[0])
        except ArithmeticError:
            pass
    return found


@checked(parameters=mapping)
def parameter_chart(system: System, parameters: Mapping, region: Mapping, *, at: Mapping | None = None, starts: int = 8,
                    seed: int = 0, transient: int = 300, longest: int = 16, exponents: bool = False, max_events: int = 2000,
                    executor=None, workers: int | None = None, chunk: int = 100, progress: bool = False,
                    file=None) -> ParameterChart:
    """Return what motions a system has over a grid of two parameters.

    Parameters
    ----------
    system : System
        With an excitation.
    parameters : mapping of str to array_like
        Two float parameters and their values, such as ``{"omega": np.linspace(1, 3, 200), "amplitude": [1.0, 1.1]}``.
    region : mapping of str to (low, high)
        Components of the start and their ranges.
    at : mapping of str to float, optional
        Values of other components of the start.
    starts : int
        Evenly spread starts of every cell.
    seed : int
        Of their shift.
    transient : int
        Forcing periods passed over; a motion that does not repeat then gets four times as many again.
    longest : int
        Longest period that is looked for.
    exponents : bool
        Also the largest Lyapunov exponent.
    max_events, executor, workers, progress, file
        As for `sweep`.
    chunk : int
        Cells a chunk.

    Returns
    -------
    ParameterChart

    Raises
    ------
    ValueError
        Autonomous system, not two parameters, unknown names.

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.parameter_chart(bf.systems.impact_oscillator(), {"omega": [1.3, 1.4], "amplitude": [0.9, 1.0]},
    ...                            {"q0": (-3, 1), "v0": (-4, 4)}, starts=2, transient=100)
    >>> [len(values) for values in found.values]
    [2, 2]
    """
    if require_system(system).period is None:
        raise ValueError(f"{system!r} is autonomous; a section needs the phase of an excitation (omega)")
    if len(parameters) != 2:
        raise ValueError(f"parameters = {parameters!r} is not allowed; it must name two parameters and their values, such as "
                         "{'omega': np.linspace(1, 3, 200), 'amplitude': np.linspace(0.5, 1, 100)}")
    names = tuple(system.parameter_name(name) for name in parameters)
    for name in names:
        system.parameter(name)
    values = tuple(_values(item, f"parameters[{name!r}]") for name, item in parameters.items())
    for name, item in zip(names, values, strict=True):
        require_values(system, f"parameters[{name!r}]", name, item, least=1)  # each other one fails alone
    box = Region(region, at)
    box.starts(scene_of(system), 1, 0)
    options = {"starts": starts, "seed": seed, "transient": transient, "longest": longest, "exponents": exponents,
               "max_events": max_events}
    common = {"system": system.to_record(), "elements": user_parts(system), "parameters": names, "region": box.to_record(),
              "options": options}
    cells = np.stack(np.meshgrid(*values, indexing="ij"), axis=-1).reshape(-1, 2)

    def compute(store: ChunkStore, key: str) -> ParameterChart:
        flat = {name: np.full(len(cells), BLANK[name], kind) for name, kind in FIELDS.items()}
        failures: dict[int, str] = {}
        with Progress("chart", len(cells), progress) as bar:
            parts = [np.arange(i, min(i + chunk, len(cells))) for i in range(0, len(cells), chunk)]
            while parts:
                outcome = run_chunks(store, chart_cells, [{**common, "cells": cells[part]} for part in parts], executor=executor,
                                     workers=workers, bar=bar, weights=[float(len(part)) for part in parts])
                alone: list[np.ndarray] = []  # cells of chunks that failed: one of them must not take its neighbours along
                for n, (part, result) in enumerate(zip(parts, outcome.results, strict=True)):
                    if result is not None:
                        for name in FIELDS:
                            flat[name][part] = result[1][name]
                    elif len(part) > 1:
                        alone += list(part[:, None])
                    else:
                        failures[int(part[0])] = outcome.failures[n]
                parts = alone
        fields: dict = {name: row.reshape(*map(len, values)) for name, row in flat.items()}
        return ParameterChart(system, names, values, **fields, options=options, failures=failures, key=key)  # type: ignore[arg-type]

    return resumable("chart", file, {"what": "chart", **common}, partial(ParameterChart.from_record, elements=common["elements"]),
                     compute, part={"values": values}, whole=lambda found: not found.failures)
