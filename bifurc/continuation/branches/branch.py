"""A branch: rows in the order of arclength, special points, how it ended, audit, columns, saving and extending."""
import functools
import importlib
from dataclasses import replace
from typing import Any

import numpy as np

from ... import io, plotting
from ...checks import EQUATIONS, checked, floats, number, of, refused, whole, word
from ...content import Content
from ...notebook import Notebook
from ...structure.components import worded
from ..kinds import End, StopReason
from ..registry import EXTEND, named
from ..resimulation import EDGE
from ..steps.rows import reversed_row
from .audit import Audit, audit_branch
from .records import branch_record, from_arrays, rows_of, to_arrays
from .solutions import Solutions
from .special import SpecialPoints, special_point, unique
from .stability_changes import stability_changes


class Branch(Content, Notebook):
    """A branch of solutions, as returned by `trace`.

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    special_points : SpecialPoints
        In the order of arclength.
    stop_reason : tuple of StopReason
        Of the end at small and at large arclength.
    ends : tuple of End
        The same with details.
    bounds : tuple of float
        Low and high, own units.
    problems : list
        Problems in the order of arclength; more than one where the equations changed on the way.

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), guess=(1.0, 0.2))
    >>> branch = bf.trace(orbit, "omega", bounds=(1.45, 1.55))
    >>> bool((branch.column("rms_0") > 0.0).all())
    True
    """

    _facts = ("parameter", "bounds", "stop_reason")

    def __init__(self, parameter, problems, arrays, special_points, ends, bounds, options, unresolved=()):
        self.parameter = parameter
        self.problems = problems
        self._points = SpecialPoints(special_points)
        self.ends = ends
        self.bounds = bounds
        self.options = options
        self.unresolved = tuple(unresolved)
        self._arrays = arrays
        self._columns: dict[str, np.ndarray] = {}
        self._audit: Audit | None = None
        self._certificate: Any = None

    def _content(self) -> tuple:
        told = tuple((type(problem).__name__, problem.system, problem.signature) for problem in self.problems)
        return self.parameter, told, self._arrays, tuple(self._points), self.ends, tuple(self.bounds), self.options, self.unresolved

    # ---- made of halves ----------------------------------------------------------------------------------------------

    @classmethod
    def of_halves(cls, plus, minus, options) -> "Branch":
        """Join two halves that start at the same row."""
        return cls._joined([], [], [], plus, minus, options, (0, 0), [])

    def joined(self, rows, plus, minus, options) -> "Branch":
        """Return this branch with what two halves added at its ends."""
        rejected = (self.ends[0].rejected, self.ends[1].rejected)
        return self._joined(rows, self._points, self.problems, plus, minus, options, rejected, self.unresolved)

    @classmethod
    def _joined(cls, rows, points, problems, plus, minus, options, rejected, unresolved):
        before = [part.problem for part in reversed(minus.parts[1:])]
        middle = list(problems) if problems else [plus.parts[0].problem]
        every = before + middle + [part.problem for part in plus.parts[1:]]
        shift, last = len(before), len(before) + len(middle) - 1
        index = [row.part.index + shift for row in rows]
        if not rows:
            rows, index = [plus.rows[0]], [shift]
        first = plus.parts[0].index, minus.parts[0].index  # problems of special points alone may stand beside them
        tail = [last + row.part.index - first[0] if row.part.index > first[0] else shift + first[0] for row in plus.rows[1:]]
        head = [shift - (row.part.index - first[1]) if row.part.index > first[1] else shift + first[1] for row in minus.rows[:0:-1]]
        turned = [reversed_row(row) for row in minus.rows[:0:-1]]
        arrays = to_arrays(turned + rows + plus.rows[1:], head + index + tail)
        here = [special_point(found, 1) for found in plus.found]
        there = [special_point(found, -1) for found in minus.found]
        unresolved = [*((kind, -s, p) for kind, s, p in minus.unresolved), *unresolved, *plus.unresolved]
        ends = tuple(End(half.reason, half.message, half.rows[-1].p, half.ds, half.rejected + old)
                     for half, old in zip((minus, plus), rejected, strict=True))
        stored = {"ds": options.ds, "ds_min": options.ds_min, "ds_max": options.ds_max, "max_steps": options.max_steps,
                  "audit": options.audit}
        return cls(every[0].parameter, every, arrays, unique([*there, *points, *here]), ends,
                   (options.low, options.high), stored, unresolved)

    @checked(low=of(number, finite=False), high=of(number, finite=False))
    def reaching(self, low, high) -> "Branch":
        """Return the branch with problems that are defined between two values of the parameter."""
        made: dict = {}
        problems = [problem.bounded(low, high, made) for problem in self.problems]
        if all(new is old for new, old in zip(problems, self.problems, strict=True)):
            return self
        place = {id(old): new for old, new in zip(self.problems, problems, strict=True)}
        points = [replace(point, problem=place.get(id(point.problem), point.problem),
                          successor=place.get(id(point.successor), point.successor)) for point in self._points]
        return Branch(self.parameter, problems, self._arrays, points, self.ends, self.bounds, self.options,
                      self.unresolved)

    def rows(self) -> list:
        """Return the rows as the tracer uses them."""
        return rows_of(self._arrays, self.problems)

    @functools.cached_property
    def special_points(self) -> SpecialPoints:
        """Special points in the order of arclength.

        Changes of stability on branches of harmonic balance are looked for when this is first asked for: their multipliers
        are no part of a step.
        """
        made = stability_changes(self, self._points)
        return SpecialPoints(unique([*self._points, *made])) if made else self._points

    # ---- reading -----------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return self._arrays["s"].size

    def __repr__(self) -> str:
        p = self._arrays["parameter"]
        counts: dict[str, int] = {}
        for point in self.special_points:
            counts[point.kind.value] = counts.get(point.kind.value, 0) + 1
        found = ", ".join(f"{count} {kind}" for kind, count in counts.items()) or "no special points"
        return (f"Branch({self.parameter} from {p.min():.6g} to {p.max():.6g}, {len(self)} points, {found}, "
                f"ends: {self.ends[0].reason.value}, {self.ends[1].reason.value})")

    @property
    def stop_reason(self) -> tuple[StopReason, StopReason]:
        """Why the branch ends at small and at large arclength."""
        return self.ends[0].reason, self.ends[1].reason

    @property
    def closed(self) -> bool:
        """Whether the branch is a closed loop; its last row repeats the first."""
        return StopReason.CLOSED in self.stop_reason

    @property
    def orbits(self) -> Solutions:
        """Solutions of the rows, made when looked up: ``branch.orbits[i]``."""
        return Solutions(self)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names that `column` knows."""
        names = ["step", "s", self.parameter, *self._measure_names(), *self._recorded()]
        return tuple(dict.fromkeys([*names, "iterations", "residual", "angle"]))

    @checked(name=word)
    def column(self, name: str) -> np.ndarray:
        """Return one column (m,), in the order of arclength; measures are computed when first asked for.

        The parameter is known by its full name, by the last part of it where no measure has that name, and as "parameter".

        Where a branch passes through several problems and one does not know a measure, its rows are NaN.
        """
        arrays = self._arrays
        if name == "step":
            return np.arange(len(self))
        if name == self.parameter or name == "parameter":
            return arrays["parameter"].copy()
        if name in ("s", "iterations", "residual", "angle"):
            return arrays[name].copy()
        if name in self._recorded():
            return arrays["recorded/" + name].copy()
        name = worded(name, self.states)
        if name not in self._measure_names():
            if self.parameter.endswith("." + name):  # as `trace` was asked for it
                return arrays["parameter"].copy()
            raise KeyError(f"no column {name!r}; there are {', '.join(self.column_names)}")
        if name not in self._columns:
            self._columns[name] = self._measured(name)
        return self._columns[name].copy()

    def x(self, i: int) -> np.ndarray:
        """Return unknowns and parameter of row ``i`` (n + 1,), own units."""
        i = whole("Branch.x", "i", i, least=-len(self), most=len(self) - 1) % len(self)
        start, stop = self._arrays["offsets"][i:i + 2]
        return self._arrays["x"][start:stop].copy()

    def _unknowns(self, rows) -> np.ndarray:
        """Return unknowns and parameter (m, n + 1) of rows, by their numbers in order, that follow each other in one problem."""
        offsets = self._arrays["offsets"]
        return self._arrays["x"][offsets[rows[0]]:offsets[rows[-1] + 1]].reshape(len(rows), -1)

    def to_pandas(self):
        """Return all columns as a pandas DataFrame."""
        import pandas  # optional

        return pandas.DataFrame({name: self.column(name) for name in self.column_names})

    @property
    def audit(self) -> Audit:
        """Checks of the whole branch: parity of its reversing points, angles, residuals, rejected steps.

        Every orbit is simulated again over its period, and the numbers of multipliers outside the unit circle are balanced
        with the special points, unless the branch was traced with ``audit="fast"``.
        """
        if self._audit is None:
            self._audit = audit_branch(self, self._arrays)
        return self._audit

    @checked()
    def certify(self, precision: int | None = None, stretches: bool = True):
        """Prove rows, special points, and what lies between the rows, in ball arithmetic; see `bifurc.certify.certify_branch`.

        Needs the extra ``certify`` (python-flint).
        """
        self._certificate = importlib.import_module("bifurc.certify").certify_branch(self, precision, stretches)
        return self._certificate

    @property
    def certificate(self) -> Any:
        """What the last `certify` proved, None before; pictures mark it."""
        return self._certificate

    @checked()
    def plot(self, ax=None, measure=None, names=None, points=None):
        """Draw a measure over the parameter; return the axes. ``names`` gives labels: ``{"omega": "speed (rad/s)"}``.

        ``points`` (k, 2), measured or foreign pairs (parameter, measure), are laid over; the legend tells their `distance`.
        """
        ax = plotting.plot_branch(self, ax=ax, measure=measure, names=names)
        return ax if points is None else plotting.plot_over(ax, points, self.distance(points, measure or "rms_0"))

    @checked(points=None)
    def distance(self, points, measure: str = "rms_0") -> np.ndarray:
        """Return how far points (k, 2) of (parameter, measure) lie above or below the nearest part of the branch, (k,).

        In the unit of the measure, between rows linearly; infinite where the branch does not reach the parameter.
        """
        found = floats(points)
        if found is None:
            raise refused("distance", "points", points, "pairs (parameter, measure), shape (k, 2)")
        if found.ndim != 2 or found.shape[1] != 2 or not np.isfinite(found).all():
            raise ValueError(f"points has shape {found.shape}; it must hold finite pairs (parameter, measure), shape (k, 2)")
        p, y = self.column("parameter"), self.column(measure)
        away = np.full(len(found), np.inf)
        for k, (value, seen) in enumerate(found):
            here = np.flatnonzero((p[:-1] - value) * (p[1:] - value) <= 0.0)
            rise = p[here + 1] - p[here]
            share = np.where(rise == 0.0, 0.0, (value - p[here]) / np.where(rise == 0.0, 1.0, rise))
            away[k] = np.abs(y[here] + share * (y[here + 1] - y[here]) - seen).min(initial=np.inf)
        return away

    # ---- going on and saving ---------------------------------------------------------------------------------------

    @checked()
    def extend(self, bounds=None, **options) -> "Branch":
        """Return the branch continued at both ends; see `trace` for the options.

        Parameters
        ----------
        bounds : tuple of float, optional
            New bounds, own units, which must hold the old ends. Ends that stopped for another reason go on as well.
        **options
            ``ds_max``, ``max_steps``, ``stop``, ``record``, ``progress``.
        """
        return named(EXTEND)(self, bounds, **options)

    @checked()
    def save(self, path):
        """Write the branch to a file; it is renamed into place when complete."""
        return io.write(path, *self.to_record())

    def to_record(self) -> tuple[dict, dict]:
        """Return the JSON-able header and the arrays that hold the branch."""
        return branch_record(self, self._arrays)

    @classmethod
    def from_record(cls, header, arrays, problem=None, elements=()) -> "Branch":
        """Rebuild a branch.

        Parameters
        ----------
        header, arrays : dict
            As given by `to_record`.
        problem : Problem, optional
            For algebraic problems, whose code is not stored: an instance of the class that was traced.
        elements : iterable of type
            User elements and laws of the systems in the file.
        """
        return from_arrays(cls, header, arrays, problem, elements)

    @classmethod
    @checked(problem=EQUATIONS)
    def load(cls, path, problem=None, elements=()) -> "Branch":
        """Read a branch from a file; see `from_record`."""
        header, arrays = io.read(path)
        if header.get("kind") not in ("branch", "curve"):
            raise io.FileFormatError(f"{path} holds a {header.get('kind')!r}, expected a 'branch'")
        return io.made(path, functools.partial(cls.from_record, problem=problem, elements=elements), header, arrays)

    # ---- private -----------------------------------------------------------------------------------------------------

    @functools.cached_property
    def _on_boundary(self) -> np.ndarray:
        """Whether a row lies on a boundary of its event sequence (m,)."""
        places = np.array([point.s for point in self._points if point.on_boundary])
        return np.abs(self._arrays["s"][:, None] - places).min(axis=1, initial=np.inf) <= EDGE

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a system of first order, see `System.states`."""
        return getattr(self.problems[0], "states", ())

    def _measure_names(self):
        return list(dict.fromkeys(name for problem in self.problems for name in problem.measure_names))

    def _recorded(self):
        return [name[len("recorded/"):] for name in self._arrays if name.startswith("recorded/")]

    def _measured(self, name):
        parts, pieces = self._arrays["part"], []
        groups: list[tuple] = []  # a problem, and rows that follow each other whose measure it gives
        for k, problem in enumerate(self.problems):
            rows = np.flatnonzero(parts == k)
            if rows.size and groups and problem.measures_as(groups[-1][0], name):
                groups[-1] = groups[-1][0], np.concatenate([groups[-1][1], rows])
            elif rows.size:
                groups.append((problem, rows))
        for problem, rows in groups:
            known = name in problem.measure_names
            pieces.append(np.asarray(problem.measure(name, self._unknowns(rows))) if known else np.full(rows.size, np.nan))
        return np.concatenate(pieces)
