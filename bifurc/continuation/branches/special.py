"""Special points of a branch and the list of them."""
import importlib
from dataclasses import dataclass, field
from typing import Any, ClassVar, SupportsFloat

import numpy as np

from ...checks import checked, choice
from ...content import Content, handed_out
from ...lazy import Later
from ...notebook import Notebook, Table
from ...orbits.base import Orbit
from ...structure.components import worded
from ..grazing import grazing_of, sliding_class
from ..kinds import BOUNDARIES, LocationStatus, SpecialPointKind


@handed_out("x", "tangent", "directions")
@dataclass(frozen=True, eq=False)
class SpecialPoint(Content, Notebook):
    """A point where something happens to a branch.

    Attributes
    ----------
    kind : SpecialPointKind
    parameter : float
        Value of the parameter, own units.
    error : float
        Bound on the distance of ``parameter`` to the true value, own units: final bracket, measured noise of the test
        and of the corrector, and their effect on the parameter; inf where it is not known; found when first asked for.
    s : float
        Arclength, scaled unknowns.
    bracket : tuple of float
        Arclength interval in which the test changes its sign.
    x : ndarray (n + 1,)
        Unknowns and parameter, own units.
    tangent : ndarray (n + 1,)
        Unit tangent in scaled unknowns, along growing ``s``.
    status : LocationStatus
    reverses : bool
        Whether the parameter turns back here.
    name : str
        Which monitor, if there are several of the kind.
    before, after : str
        Signature of the equations on either side, along growing ``s``.
    directions : ndarray (2, n + 1) or None
        Unit tangents, in scaled unknowns, of the branches that cross at a branch point.
    recorded : dict of str to float
        What ``record=`` of `trace` gives at this point.

    Examples
    --------
    >>> import bifurc as bf
    >>> duffing = bf.systems.duffing_oscillator()
    >>> branch = bf.trace(bf.find_orbit(duffing), "omega", bounds=(0.5, 2.5))
    >>> fold = [point for point in branch.special_points if point.kind == "fold"][0]
    >>> fold.error < 1e-9
    True
    """

    _facts: ClassVar = ("kind", "name", "parameter", "error", "status", "before", "after")
    _panels: ClassVar = None

    kind: SpecialPointKind
    parameter: float
    _error: SupportsFloat = field(repr=False, compare=False)
    s: float
    bracket: tuple[float, float]
    x: np.ndarray = field(repr=False)
    tangent: np.ndarray = field(repr=False)
    status: LocationStatus = LocationStatus.LOCATED
    reverses: bool = False
    name: str = ""
    before: str = ""
    after: str = ""
    directions: np.ndarray | None = field(default=None, repr=False)
    problem: Any = field(default=None, repr=False, compare=False)
    successor: Any = field(default=None, repr=False, compare=False)
    recorded: dict[str, float] = field(default_factory=dict, repr=False, compare=False)
    _made: dict = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def error(self) -> float:
        """Bound on the distance of ``parameter`` to the true value, own units."""
        return float(self._error)

    @property
    def grazing(self) -> Any:
        """What is known of a grazing of periodic orbits (`grazing.Grazing`: verdict, births, ...); None at other points."""
        if "grazing" not in self._made:
            self._made["grazing"] = grazing_of(self)
        return self._made["grazing"]

    @property
    def sliding(self) -> Any:
        """Which sliding bifurcation an onset of stick or slip is (`grazing.SlidingClass`); None at other points."""
        if "sliding" not in self._made:
            self._made["sliding"] = sliding_class(self)
        return self._made["sliding"]

    @property
    def u(self) -> np.ndarray:
        """Unknowns (n,), own units."""
        return self.x[:-1]

    @property
    def solution(self) -> Any:
        """The solution at this point, as in ``branch.orbits``, from the side on which the equations know it."""
        made = solution_at(self.problem, self.x, self.on_boundary)
        if self.successor is None or getattr(made, "success", True):
            return made
        beyond = np.asarray(self.successor.x0, float)
        near = abs(float(beyond[-1]) - self.parameter) <= self.error
        other = solution_at(self.successor, beyond, True) if near else made
        return other if getattr(other, "success", True) else made

    @property
    def on_boundary(self) -> bool:
        """Whether the equations of one event sequence end here."""
        return self.successor is not None or self.kind in BOUNDARIES

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name: one, or both at a point of a curve in two parameters."""
        return self.problem.parameters(self.x)

    @checked()
    def certify(self, precision: int | None = None):
        """Prove the point in ball arithmetic, transversality included; see `bifurc.certify.certify_point`.

        Needs the extra ``certify`` (python-flint).
        """
        return importlib.import_module("bifurc.certify").certify_point(self, precision)

    @property
    def measures(self) -> "Measures":
        """The problem's measures at this point, computed when looked up, and what was recorded there."""
        return Measures(self.problem, self.x, self.recorded)

    def __repr__(self) -> str:
        label = f"{self.kind.value} {self.name}".strip()
        turn = ", reverses" if self.reverses else ""
        doubt = "" if self.status is LocationStatus.LOCATED else f", {self.status.value}"
        return f"SpecialPoint({label} at {self.parameter:.12g} +- {self.error:.1e}, s = {self.s:.6g}{turn}{doubt})"


def solution_at(problem, x, on_boundary: bool):
    """Return the solution of a problem at ``x`` (n + 1,); an orbit ``on_boundary`` of its event sequence says so."""
    made = problem.solution(x)
    return made._on_boundary() if on_boundary and isinstance(made, Orbit) else made


class Measures:
    """Mapping from names to the measures of one solution and to what was recorded there."""

    def __init__(self, problem, x, recorded):
        self._problem = problem
        self._x = x
        self._recorded = recorded
        self._states = getattr(problem, "states", ())
        self._names = tuple(dict.fromkeys((*problem.measure_names, *recorded)))

    def __contains__(self, name) -> bool:
        return worded(name, self._states) in self._names

    def __getitem__(self, name):
        name = worded(name, self._states)
        if name in self._recorded:  # columns of a branch have the same order
            return self._recorded[name]
        if name not in self._names:
            raise KeyError(f"no measure {name!r}; there are {', '.join(self._names)}")
        return self._problem.measure(name, self._x[None])[0]

    def __iter__(self):
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class SpecialPoints(Table):
    """Special points in the order of arclength; ``of(kind)`` selects, ``to_pandas()`` makes them a table."""

    __slots__ = ()
    _fields = ("kind", "parameter", "error", "s", "status", "reverses", "name", "before", "after")

    def of(self, kind) -> "SpecialPoints":
        """Return the points of one kind."""
        kind = SpecialPointKind(choice("SpecialPoints.of", "kind", kind, tuple(item.value for item in SpecialPointKind)))
        return SpecialPoints(point for point in self if point.kind is kind)

    def __repr__(self) -> str:
        return "[" + ",\n ".join(repr(point) for point in self) + "]"


def special_point(found, sign):
    """Turn a `detect.Found` of the half in direction ``sign`` of growing arclength into a `SpecialPoint`."""
    problem = found.part.problem
    before = problem.signature
    after = before if found.successor is None else found.successor.signature
    low, high = found.low, found.high
    if sign < 0:
        low, high, before, after = 0.0 - high, 0.0 - low, after, before
    s, tangent = (found.s, found.tangent) if sign > 0 else (0.0 - found.s, -found.tangent)
    return SpecialPoint(found.kind, float(found.x[-1]), Later(lambda: found.error), s, (low, high), found.x, tangent,
                        found.status, bool(found.reverses), found.name, before, after, found.directions, problem,
                        found.successor, dict(found.recorded or {}))


def unique(points):
    """Sort by arclength and keep the first of points that were found from both sides of a row."""
    kept: list[SpecialPoint] = []
    for point in sorted(points, key=lambda point: point.s):
        for other in kept[-4:]:
            if (other.kind is point.kind and other.name == point.name and abs(other.s - point.s) < 1e-6
                    and abs(other.parameter - point.parameter) <= other.error + point.error
                    + 1e-12 * float(point.problem.scale[-1])):
                break
        else:
            kept.append(point)
    return kept
