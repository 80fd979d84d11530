"""A mechanical system: linear core M q'' + C q' + K q, elements acting on it, and its parameters by name.

One file, because it is one class and the decorator that makes builders of it.
"""
import dataclasses
import functools
import importlib
import inspect
import math
import re
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .checks import (
    DECLARED,
    ELEMENTS,
    KEPT,
    PLACE,
    POSITIVE,
    SYSTEM,
    checked,
    choice,
    floats,
    number,
    of,
    plain_text,
    refused,
    shown,
)
from .elements import Core, Element, Shift
from .elements.element import element_from, tupled
from .elements.friction.joint import joints
from .elements.friction.together import leaders
from .structure.names import dof_names, place_of

_BUILDERS: dict[str, Callable] = {}  # ready systems by name, filled by `builder`
SYMMETRIC = 1e-13  # of the largest entry: a mass matrix that differs from its transpose by less is symmetric
ENTRY = re.compile(r"(mass|damping|stiffness)\[(\d+),(\d+)\]")


class System:
    """M q'' + C q' + K q = forces of the elements.  Immutable; equal when the content is equal.

    Parameters
    ----------
    mass : float or array, shape (n, n)
        Symmetric and positive definite.
    damping, stiffness : float or array, shape (n, n)
        Any finite matrix: gyroscopic and circulatory parts are allowed, missing stiffness is.
    elements : iterable of Element
        What acts on the core.
    omega : float, optional
        Excitation frequency, above 0; None: autonomous.
    dofs : sequence of str or (node, direction), optional
        Names of the degrees of freedom, such as ``"tip.uy"``; elements may then sit on names.

    Raises
    ------
    ValueError
        Naming argument, value, and what is allowed.

    Examples
    --------
    >>> from bifurc import System, elements
    >>> System(1.0, 0.1, 1.0, [elements.HarmonicForce(0.52), elements.RigidStop(gap=1.0)], omega=0.5)
    System(n=1, omega=0.5, elements=[harmonic_force, rigid_stop])
    """

    core: Core
    n: int  # degrees of freedom
    elements: tuple[Element, ...]
    dofs: tuple[str, ...] | None  # names of the degrees of freedom
    reduction: Any  # `structure.reduction.Reduction` of a reduced model, or None
    _origin: tuple[Callable[..., "System"], dict] | None  # builder and its keywords
    _scene: Any  # kept by compose.scene_of
    _kin: Any  # the scene of the system that this one was made from, or the keys of modes in their order; see compose.scene_of

    @checked(elements=ELEMENTS, omega=POSITIVE)
    def __init__(self, mass, damping, stiffness, elements: Iterable[Element] = (), *, omega: float | None = None,
                 dofs: Iterable | None = None):
        M, C, K = _matrix("mass", mass), _matrix("damping", damping), _matrix("stiffness", stiffness)
        n = len(M)
        for name, value in (("damping", C), ("stiffness", K)):
            if value.shape != M.shape:
                raise ValueError(f"System: {name} has shape {value.shape}; it must be that of mass, {M.shape}")
        if n > 1 and not np.abs(M - M.T).max() <= SYMMETRIC * np.abs(M).max():
            raise ValueError(f"System: mass = {M.tolist()} is not allowed; it must be symmetric")
        if n > 1 and not np.array_equal(M, M.T):  # a product such as Q D Q^T is symmetric to rounding only
            M = _matrix("mass", 0.5 * (M + M.T))
        if not (M[0, 0] > 0.0 if n == 1 else np.linalg.eigvalsh(M)[0] > n * 1e-15 * np.abs(M).max() or _positive(M)):
            raise ValueError(f"System: mass = {M.tolist()} is not allowed; it must be positive definite")
        elements = tuple(elements)
        names = dof_names(dofs, n)
        elements = tuple(element.placed(lambda dof: place_of(dof, names, n)) for element in elements)
        self.__dict__.update(
            core=Core(M, C, K, omega),
            n=n, elements=elements, dofs=names, reduction=None, _origin=None, _scene=None, _kin=None)
        for label, element in zip(self.labels, elements, strict=True):
            try:
                harmonics = {*element.harmonics, *element.site(n).harmonics}
            except ValueError as error:
                raise ValueError(f"System: element {label!r}: {error}") from None
            if omega is None and harmonics:
                raise ValueError(f"System: omega = None is not allowed with {element!r}, which has harmonics of it")

    def __setattr__(self, name, value):
        raise AttributeError("a System is immutable; with_parameters(...) gives a changed copy")

    @classmethod
    @checked(elements=ELEMENTS, omega=POSITIVE)
    def from_matrices(cls, M, C, K, *, G=None, dofs=None, elements: Iterable[Element] = (), omega: float | None = None,
                      symmetric: bool = True) -> "System":
        """Return the system M q'' + (C + G) q' + K q = forces of checked matrices.

        Parameters
        ----------
        M, K : array or sparse matrix, shape (n, n)
            Mass (symmetric, at least semidefinite: coordinates without mass are condensed) and stiffness.
        C, G : array or sparse matrix, shape (n, n), or None
            Damping, and gyroscopic matrix (skew-symmetric, times the spin); None: zeros.
        dofs : sequence of str or (node, direction), optional
            Names of the degrees of freedom; elements may then sit on them: ``RigidStop(0.1, dof="tip.uy")``.
        elements, omega
            As for `System`.
        symmetric : bool
            False: K and C may have circulatory and gyroscopic parts.

        Raises
        ------
        ValueError
            What is wrong with a matrix, and what to write: triangles, asymmetry, negative mass, NaN.

        Examples
        --------
        >>> import numpy as np
        >>> import bifurc as bf
        >>> K = np.array([[2.0, -1.0], [-1.0, 1.0]])
        >>> bf.System.from_matrices(np.eye(2), 0.1 * K, K, dofs=[("mid", "ux"), ("tip", "ux")],
        ...                         elements=[bf.elements.RigidStop(1.0, dof="tip.ux")])
        System(n=2, omega=None, elements=[rigid_stop])
        """
        return importlib.import_module(".models.assembling", __package__).system_from_matrices(
            M, C, K, G=G, dofs=dofs, elements=elements, omega=omega, symmetric=symmetric)

    @checked(keep=KEPT, modes=PLACE, method=of(choice, allowed=("rubin", "craig-bampton", "massless")))
    def reduced(self, keep, modes: int = 12, method: str = "rubin") -> "System":
        """Return the system in some of its coordinates and a few modes, with its elements; `reduction` tells the errors.

        Parameters
        ----------
        keep : str, int, or a sequence of them and of pairs (node, direction)
            Coordinates that stay as they are: those of contacts and loads. Elements elsewhere act through the shapes.
        modes : int
            Number of modes beside them.
        method : {"rubin", "craig-bampton", "massless"}
            Free modes and residual flexibility (the most exact frequencies); constraint modes, and modes with the kept
            coordinates held; or the first without mass at the kept coordinates: stops and friction there act through the
            residual flexibility, without impacts.

        Returns
        -------
        System
            With ``reduction`` (`Reduction`: recovery, frequencies, errors); `recover` gives all coordinates again.

        Raises
        ------
        ValueError

        Examples
        --------
        >>> import bifurc as bf
        >>> small = bf.systems.impact_chain(n=8).reduced(keep=[7], modes=3)
        >>> small.n, small.reduction.static_error < 1e-12
        (4, True)
        """
        return importlib.import_module(".models.reducing", __package__).reduced_system(self, keep, modes, method)

    @checked()
    def dof(self, name: Any) -> int:
        """Return the number of a degree of freedom given by name, or by pair (node, direction)."""
        return place_of(name, self.dofs, self.n, "System.dof", "name")

    def recover(self, y: np.ndarray) -> np.ndarray:
        """Return states (..., 2 N) in all coordinates of the full model from states (..., ns) of a reduced one.

        Displacements first, then velocities. A system that is not reduced gives its own ones.
        """
        given = floats(y)
        if given is None or given.ndim == 0 or given.shape[-1] < 2 * self.n or not np.isfinite(given).all():
            raise refused("System.recover", "y", y, f"finite states, arrays of shape (..., {2 * self.n})")
        y = given
        T = np.eye(self.n) if self.reduction is None else self.reduction.recovery
        return np.concatenate([y[..., :self.n] @ T.T, y[..., self.n:2 * self.n] @ T.T], axis=-1)

    @property
    def measured(self) -> int:
        """How many components extremes and harmonics are taken of: the coordinates; of a system of first order its states."""
        return self.n or sum(len(element.memory) for element in self.elements)

    @property
    def builder(self) -> Callable[..., "System"] | None:
        """What makes systems like this one from the values of its parameters; None: it is made by hand."""
        return None if self._origin is None else self._origin[0]

    @property
    def mass(self) -> np.ndarray:
        """Mass matrix, shape (n, n)."""
        return self.core.mass

    @property
    def damping(self) -> np.ndarray:
        """Damping matrix, shape (n, n)."""
        return self.core.damping

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness matrix, shape (n, n)."""
        return self.core.stiffness

    @property
    def omega(self) -> float | None:
        """Excitation frequency; None: autonomous."""
        return self.core.omega

    @property
    def period(self) -> float | None:
        """Period 2 pi / omega of the excitation; None: autonomous."""
        return None if self.omega is None else 2.0 * np.pi / self.omega

    @functools.cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of the elements: their label, or the class name, numbered from the second on."""
        names: list[str] = []
        for element in self.elements:
            base = element.label or element.default_label()
            name, count = base, 1
            while name in names:
                count += 1
                name = f"{base}_{count}"
            names.append(name)
        return tuple(names)

    @property
    def parameters(self) -> dict:
        """Parameters by name: keywords of the builder, or ``label.field`` and ``mass[i,j]`` of a hand-made system."""
        if self._origin is not None:
            return dict(self._origin[1])
        values = {}
        for name in ("mass", "damping", "stiffness"):
            for (i, j), value in np.ndenumerate(getattr(self, name)):
                values[f"{name}[{i},{j}]"] = float(value)
        if self.omega is not None:
            values["omega"] = self.omega
        return {**values, **self._fields}

    @functools.cached_property
    def _fields(self) -> dict:
        """Parameters of the elements by name, ``label.field``."""
        return {f"{label}.{field}": value for label, element in zip(self.labels, self.elements, strict=True)
                for field, value in element.parameters.items()}

    def _values(self, name: str) -> dict:
        """Return parameters among which ``name`` is if there is one of that name; not all of them, matrices have many."""
        if self._origin is not None:
            return self._origin[1]
        entry = ENTRY.fullmatch(name)
        if entry:
            i, j = int(entry[2]), int(entry[3])
            return {f"{entry[1]}[{i},{j}]": float(getattr(self, entry[1])[i, j])} if max(i, j) < self.n else {}
        return {"omega": self.omega} if name == "omega" and self.omega is not None else self._fields

    def parameter_name(self, name: str) -> str:
        """Return the full name of a parameter; a short name (``gap`` for ``rigid_stop.gap``) must be unique.

        Raises
        ------
        ValueError
            Listing the names there are.
        """
        if not isinstance(name, str):
            raise ValueError(f"parameter {shown(name)} is not allowed; it must be a name, one of {', '.join(self.parameters)}")
        name = plain_text(name)
        if name in self._values(name):
            return name
        names = self.parameters
        ends = [full for full in names if full.endswith("." + name) or (self.n == 1 and full == name + "[0,0]")]
        if len(ends) != 1:
            what = "is ambiguous" if ends else "is unknown"
            raise ValueError(f"parameter {name!r} {what}; there are {', '.join(ends or names)}")
        return ends[0]

    def parameter(self, name: str) -> float:
        """Return the value of a parameter that can vary continuously.

        Raises
        ------
        ValueError
            When the name is unknown, or the value is not a float (a count, a choice).
        """
        full = self.parameter_name(name)
        value = self._values(full)[full]
        if type(value) is not float:
            names = [key for key, item in self.parameters.items() if type(item) is float]
            raise ValueError(f"parameter {name!r} = {value!r} cannot vary continuously; "
                             f"those that can: {', '.join(names)}")
        return value

    def with_parameters(self, **changes) -> "System":
        """Return the system built again with some parameters changed.

        Names that are no identifiers are given as ``with_parameters(**{"rigid_stop.gap": 0.5})``.
        """
        if self._origin is not None:
            build, values = self._origin
            for name in changes:
                if name not in values:
                    self.parameter_name(name)
            made = build(**{**values, **changes})
        else:
            made = self._changed({self.parameter_name(name): value for name, value in changes.items()})
        made.__dict__["_kin"] = self._kin if self._scene is None else self._scene
        return made

    @checked(elements=ELEMENTS)
    def with_elements(self, elements: Iterable[Element]) -> "System":
        """Return the system with more elements; its parameters keep their names, and theirs are ``label.field``.

        Examples
        --------
        >>> import bifurc as bf
        >>> system = bf.systems.impact_oscillator().with_elements([bf.elements.Coulomb(0.1)])
        >>> system.parameter("gap"), system.parameter("coulomb.friction")
        (1.0, 0.1)
        """
        made = System(self.mass, self.damping, self.stiffness, (*self.elements, *elements), omega=self.omega, dofs=self.dofs)
        made.__dict__["reduction"] = self.reduction
        if self._origin is not None:
            build, values = self._origin
            before = len(build.elements) if isinstance(build, Extended) else 0
            own = tuple(zip(made.labels, made.elements, strict=True))[len(self.elements) - before:]
            fields = {f"{label}.{field}": value for label, element in own for field, value in element.parameters.items()}
            made.__dict__["_origin"] = (Extended(getattr(build, "source", build), own), {**values, **fields})
        return made

    def but(self, name: str, value: float) -> Any:
        """Return what equals that of another system where the two differ in the parameter ``name`` alone; ``value`` is one that it
        may have."""
        if self._origin is None or name not in self._origin[1]:
            return self.with_parameters(**{name: value})
        build, values = self._origin
        return build, frozenset(item for item in values.items() if item[0] != name)

    def differs_in_omega_only(self, other: "System") -> bool:
        """Return whether the elements and matrices of another system are the same."""
        try:
            equal = other.elements == self.elements
        except (TypeError, ValueError):  # an element of the user's with an array in it
            return False
        return equal and all(map(np.array_equal, other.core[:3], self.core[:3]))

    def _changed(self, changes: dict) -> "System":
        """Return a hand-made system with full parameter names changed."""
        core = {name: getattr(self, name).copy() for name in ("mass", "damping", "stiffness")}
        omega = self.omega
        fields: dict[str, dict] = {}
        for name, value in changes.items():
            entry = ENTRY.fullmatch(name)
            if entry:
                matrix, i, j = core[entry[1]], int(entry[2]), int(entry[3])
                symmetric = entry[1] == "mass" or matrix[i, j] == matrix[j, i]
                matrix[i, j] = number("System", name, value)
                if symmetric:
                    matrix[j, i] = matrix[i, j]
            elif name == "omega":
                omega = value
            else:
                label, field = name.rsplit(".", 1)
                fields.setdefault(label, {})[field] = value
        elements = [element.with_parameters(**fields[label]) if label in fields else element
                    for label, element in zip(self.labels, self.elements, strict=True)]
        made = System(**core, elements=elements, omega=omega, dofs=self.dofs)
        if not any(ENTRY.fullmatch(name) for name in changes):
            made.__dict__["reduction"] = self.reduction
        return made

    @functools.cached_property
    def symmetry(self) -> int | None:
        """-1 when y(t) -> -y(t + half a period) maps motions to motions, found from the elements; None otherwise."""
        return -1 if self.mirror_order is not None else None

    @functools.cached_property
    def mirror_order(self) -> tuple[int, ...] | None:
        """For each element the index of its image under the symmetry; None: not symmetric."""
        left = dict(enumerate(element.with_parameters(label=None) for element in self.elements))
        order = []
        for element in self.elements:
            image = element.mirrored()
            image = None if image is None else image.with_parameters(label=None)
            partner = next((i for i, other in left.items() if other == image), None)
            if partner is None:
                return None
            del left[partner]
            order.append(partner)
        return tuple(order)

    def advances(self, rows: np.ndarray) -> bool:
        """Whether rows (k, n) move along with what its motions are seen up to, see `compose.shifts`."""
        return any((rows @ np.array(element.direction)[:self.n]).any() for element in self.elements if isinstance(element, Shift))

    @functools.cached_property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a system of first order, see `piecewise`; none of a system with degrees of freedom."""
        return () if self.n else tuple(name for element in self.elements for name in element.memory)

    @functools.cached_property
    def together(self) -> tuple[tuple[int, float], ...]:
        """For each element the first dry friction on its row, with which it rests and moves off, and how many times the row of that
        one its own is (-1: it runs the other way); itself where there is none.  That may be so at one value of a parameter only."""
        return leaders(self.elements, self.n)

    @functools.cached_property
    def joints(self) -> tuple:
        """Dry frictions whose rows depend on those of others, with which they rest and move off, see `friction.joint`."""
        return joints(self.labels, self.elements, self.together, self.n, self.core)

    @functools.cached_property
    def structure(self) -> tuple:
        """What a change of parameters cannot change."""
        return (self.n, self.omega is None, *(element.structure for element in self.elements))

    def to_record(self) -> dict:
        """Return the builder's name and keywords, or the whole content, ready for JSON."""
        if self._origin is not None:
            build, values = self._origin
            added: dict = {}
            if isinstance(build, Extended):
                values = {name: value for name, value in values.items() if name not in build.fields}
                added["added"] = [element.to_record() for _, element in build.elements]
            return {"builder": build.__name__, "parameters": {name: _plain(value) for name, value in values.items()}, **added}
        matrices = {name: getattr(self, name).tolist() for name in ("mass", "damping", "stiffness")}
        more: dict = {} if self.dofs is None else {"dofs": list(self.dofs)}
        if self.reduction is not None:
            more["reduction"] = self.reduction.to_record()
        return {**matrices, "omega": self.omega, "elements": [element.to_record() for element in self.elements], **more}

    @classmethod
    def from_record(cls, record: dict, elements: Iterable = ()) -> "System":
        """Make the system that gave ``record``.

        Parameters
        ----------
        record : dict
        elements : iterable of classes and functions
            Element classes, laws and builders that are not the package's own; nothing is imported from a record. Of a
            `PiecewiseSystem` it is the ``builder`` of one like it.
        """
        own = {item.__name__: item for item in elements}
        if "builder" in record:
            ready = importlib.import_module(".systems", __package__)  # stands on this module
            for name in ready.__all__:
                getattr(ready, name)  # read when first used: makes its builder known
            build = own.get(record["builder"]) or _BUILDERS.get(record["builder"])
            if build is None:
                raise ValueError(f"the record uses the builder {record['builder']!r}; hand it over in elements=[...]. "
                                 f"Known: {', '.join(sorted(_BUILDERS))}")
            system = build(**record["parameters"])
            if "added" in record:
                system = system.with_elements([element_from(item, own) for item in record["added"]])
            system.__dict__["_kin"] = tupled(record.get("modes"))
            return system
        made = [element_from(item, own) for item in record["elements"]]
        system = cls(record["mass"], record["damping"], record["stiffness"], made, omega=record["omega"], dofs=record.get("dofs"))
        if "reduction" in record:
            from .structure.reduction import Reduction  # building a system loads no scipy

            system.__dict__["reduction"] = Reduction.from_record(record["reduction"])
        system.__dict__["_kin"] = tupled(record.get("modes"))
        return system

    def __eq__(self, other):
        if not isinstance(other, System):
            return NotImplemented
        return (self.elements == other.elements and self.omega == other.omega and self.dofs == other.dofs
                and self._origin == other._origin
                and all(np.array_equal(a, b) for a, b in zip(self.core[:3], other.core[:3], strict=True)))

    def __hash__(self):
        return hash((self.elements, self.omega, self.mass.tobytes(), self.damping.tobytes(), self.stiffness.tobytes()))

    def __repr__(self):
        if self._origin is not None:
            build, values = self._origin
            return f"{build.__name__}({', '.join(f'{name}={_short(value)}' for name, value in values.items())})"
        omega = "None" if self.omega is None else f"{self.omega:g}"
        return f"System(n={self.n}, omega={omega}, elements=[{', '.join(self.labels)}])"

    def __getstate__(self):
        kin = self._kin if self._scene is None else self._scene
        return {**self.__dict__, "_scene": None, "_kin": getattr(kin, "keys", kin)}

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self


def of_states(elements: Iterable[Element], omega: float | None) -> System:
    """Return a system without degrees of freedom, whose states are the memory of its elements; see `piecewise`."""
    system, nothing = object.__new__(System), np.zeros((0, 0))
    nothing.flags.writeable = False
    system.__dict__.update(core=Core(nothing, nothing, nothing, omega), n=0, elements=tuple(elements), dofs=None, reduction=None,
                           _origin=None, _scene=None, _kin=None)
    return system


@dataclasses.dataclass(frozen=True)
class Extended:
    """A builder whose systems have more elements, see `System.with_elements`."""

    source: Callable[..., System]  # builds the system without them
    elements: tuple[tuple[str, Element], ...]  # with their labels

    @property
    def __name__(self) -> str:
        return self.source.__name__

    @property
    def fields(self) -> dict[str, tuple[str, str]]:
        """Label and field of the parameters of its elements, by name."""
        return {f"{label}.{field}": (label, field) for label, element in self.elements for field in element.parameters}

    def __call__(self, **values) -> System:
        changes: dict[str, dict] = {label: {} for label, _ in self.elements}
        for name, (label, field) in self.fields.items():
            if name in values:
                changes[label][field] = values.pop(name)
        return self.source(**values).with_elements(
            [element.with_parameters(**changes[label]) for label, element in self.elements])


def builder(build: Callable[..., System]) -> Callable[..., System]:
    """Make a function with keyword-only parameters a builder: its keywords become the parameters of its systems.

    Keywords whose default is a float must be finite and are stored as floats; all others are structure.  They are what they
    are declared: numbers, whole numbers, words.
    """
    given = inspect.signature(build).parameters
    defaults = {name: item.default for name, item in given.items()}
    kinds = {name: DECLARED.get(float if type(item.default) is float else item.annotation) for name, item in given.items()}

    @functools.wraps(build)
    def made(**keywords) -> System:
        values = dict(defaults)
        for name, value in keywords.items():
            if name not in defaults:
                raise ValueError(f"{build.__name__}: parameter {name!r} is unknown; there are {', '.join(defaults)}")
            kind, optional = kinds[name] or (None, True)
            values[name] = value if kind is None or value is None and optional else kind(build.__name__, name, value)
        try:
            system = build(**values)
        except ValueError as error:  # of a matrix or an element that is made of keywords
            given = [f"{name}={shown(values[name])}" for name in keywords if values[name] is not defaults[name]]
            if str(error).startswith(build.__name__) or not given:
                raise
            raise ValueError(f"{build.__name__}({', '.join(given)}): {error}") from None
        system.__dict__["_origin"] = (made, values)
        return system

    _BUILDERS[build.__name__] = made
    return made


def _positive(M: np.ndarray) -> bool:
    """Return whether a mass matrix is positive definite whatever its units: inertias of a mesh in metres lie far apart."""
    size = np.sqrt(np.abs(np.diag(M)))
    return bool(size.all() and np.linalg.eigvalsh(M / np.outer(size, size))[0] > len(M) * 1e-15)


def _matrix(name: str, value) -> np.ndarray:
    """Return a read-only square matrix of finite floats."""
    matrix = floats(value)  # True is no mass, and "1" is no number
    if matrix is None:
        raise refused("System", name, value, "a number or a square matrix of numbers")
    if matrix.ndim == 0:
        matrix = matrix.reshape(1, 1)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.size == 0:
        raise ValueError(f"System: {name} has shape {matrix.shape}; it must be a number or a square matrix")
    if not (math.isfinite(matrix.item()) if matrix.size == 1 else np.isfinite(matrix).all()):
        raise refused("System", name, value, "finite")
    matrix.flags.writeable = False
    return matrix


def _plain(value):
    """Return a value as JSON knows it."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _short(value) -> str:
    """Return a float in few digits, anything else as it is."""
    return f"{value:g}" if isinstance(value, float) else repr(value)


def require_values(system: System, argument: str, name: str, values, *, least: int | None = None) -> None:
    """Raise ValueError, naming the argument that gave them, unless a system can have all, or at ``least`` some, of the values of a
    parameter."""
    system.parameter(name)
    why = []
    for value in map(float, values):
        try:
            system.with_parameters(**{name: value})
        except ValueError as error:  # the builder's own words
            why.append(f"{argument}: {value!r} is not allowed; {error}")
    if len(why) > (0 if least is None else len(values) - least):
        raise ValueError(why[0])


def require_system(value) -> System:
    """Return ``value`` when it is a `System`, else raise ValueError."""
    return value if isinstance(value, System) else SYSTEM("", "system", value)
