"""Springs and dashpots: linear ones between coordinates, polynomial ones, and force laws of the user."""
import dataclasses
import inspect
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..checks import checked, flag, floats, function, number, refused, vector, whole, word
from .atrow import AtRow
from .element import Element
from .local import s, u
from .mode import Law, Mode
from .site import Rows

TRIED = (0.1, -0.1, 0.7, 0.0)  # values of coordinates and speeds at which a law is tried


@dataclass(frozen=True)
class LinearSpring(AtRow):
    """Linear spring and dashpot along a row: force -(stiffness u + damping s).

    Parameters
    ----------
    stiffness : float
        Force per length.
    damping : float
        Force per speed.
    dof, row
        Where it acts, see `AtRow`.
    """

    stiffness: float = 1.0
    damping: float = 0.0

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=(-self.stiffness * u(0) - self.damping * s(0),))

    def stored_energy(self, u):
        """Energy of the spring; none is kept beside a dashpot."""
        return 0.5 * self.stiffness * u[0] ** 2 if self.damping == 0.0 else None

    def mirrored(self):
        """Its own image."""
        return self


def cubic(u, s, beta):
    """Force of a cubic spring."""
    return -beta * u * u * u


def cubic_slope(u, s, beta):
    """Derivatives of `cubic` by u and s."""
    return -3.0 * beta * u * u, 0.0


@dataclass(frozen=True)
class CubicSpring(AtRow):
    """Cubic spring: force -beta u^3.

    Parameters
    ----------
    beta : float
        Force per cubed length; negative softens.
    dof, row
        Where it acts, see `AtRow`.
    """

    beta: float = 1.0

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(cubic, (self.beta,), cubic_slope))

    def stored_energy(self, u):
        """Energy of the spring."""
        return 0.25 * self.beta * u[0] ** 4

    def mirrored(self):
        """Its own image."""
        return self


def polynomial(u, s, c2, c3, c4, c5):
    """Force of a polynomial spring."""
    return -u * u * (c2 + u * (c3 + u * (c4 + u * c5)))


def polynomial_slope(u, s, c2, c3, c4, c5):
    """Derivatives of `polynomial` by u and s."""
    return -u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5))), 0.0


@dataclass(frozen=True)
class PolynomialSpring(AtRow):
    """Polynomial spring: force -(c2 u^2 + c3 u^3 + c4 u^4 + c5 u^5); the linear part belongs to the stiffness matrix.

    Parameters
    ----------
    c2, c3, c4, c5 : float
        Force per power of length.
    dof, row
        Where it acts, see `AtRow`.
    """

    c2: float = 0.0
    c3: float = 1.0
    c4: float = 0.0
    c5: float = 0.0

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(polynomial, (self.c2, self.c3, self.c4, self.c5), polynomial_slope))

    def stored_energy(self, u):
        """Energy of the spring."""
        return u[0] ** 3 * (self.c2 / 3.0 + u[0] * (self.c3 / 4.0 + u[0] * (self.c4 / 5.0 + u[0] * self.c5 / 6.0)))

    def mirrored(self):
        """Even powers change sign."""
        return dataclasses.replace(self, c2=0.0 - self.c2, c4=0.0 - self.c4)


class Force(Element):
    """A force law of your own, on one row or several.

    Parameters
    ----------
    law : callable
        ``law(u, s, *values)`` for one row: force that acts on the coordinate.  For several rows
        ``law(u0, u1, ..., s0, s1, ..., *values)`` returning one force a row.  It is compiled: plain arithmetic and
        `math` only, no state.  The values are the keyword parameters below, by the names of the law's arguments.
    jacobian : callable, optional
        Same arguments; returns df/du, df/ds (for several rows: of the first force by u0, u1, ..., s0, s1, ..., then of
        the second, ...).  Without it derivatives are differenced, and results say so.
    site : int, str or sequence
        Degree of freedom or its name, one row of n factors, or several rows.
    odd : bool
        law(-u, -s) = -law(u, s): allows solutions on half a period.
    **parameters : float
        One a remaining argument of the law.

    Examples
    --------
    >>> from bifurc.elements import Force
    >>> Force(lambda u, s, mu: mu * (1.0 - u * u) * s, site=0, mu=0.2, odd=True).parameters
    {'mu': 0.2}
    """

    @checked(law=function, jacobian=function, site=None, odd=flag, label=word)
    def __init__(self, law: Callable, jacobian: Callable | None = None, *, site=0, odd: bool = False,
                 label: str | None = None, **parameters: float):
        rows = None if isinstance(site, str) else floats(site)
        where = site if isinstance(site, str) else whole("Force", "site", site, least=0) if rows is None or rows.ndim == 0 else \
            _tuples(rows)
        if rows is not None and rows.ndim and not (rows.ndim < 3 and rows.size and np.isfinite(rows).all()
                                                   and rows.any(axis=-1).all()):
            raise refused("Force", "site", site, "a degree of freedom or its name, or rows of finite factors, none all zero")
        count = 1 if np.ndim(where) < 2 else np.shape(where)[0]
        names = list(inspect.signature(law).parameters)[2 * count:]
        if set(names) != set(parameters):
            raise ValueError(f"Force: the law takes the parameters {names}, but {sorted(parameters)} were given")
        set_ = object.__setattr__
        set_(self, "label", label)
        set_(self, "law", law)
        set_(self, "jacobian", jacobian)
        set_(self, "where", where)
        set_(self, "odd", odd)
        set_(self, "values", {name: number("Force", name, parameters[name]) for name in names})
        if _always_nan(law, 2 * count, self.parameters.values()):
            raise ValueError(f"Force: law = {law!r} is not allowed; it gives NaN wherever it was tried, as at {TRIED[0]}")

    def __eq__(self, other):
        return type(other) is type(self) and self.structure == other.structure and self.values == other.values \
            and self.label == other.label

    def __hash__(self):
        return hash((self.structure, tuple(self.values.items())))

    def __repr__(self):
        values = "".join(f", {name}={value:g}" for name, value in self.values.items())
        return f"Force({self.law.__name__}, site={self.where!r}{values})"

    @property
    def parameters(self):
        """The keyword parameters of the law."""
        return dict(self.values)

    @property
    def structure(self):
        """Law, Jacobian and place."""
        return (type(self), self.law, self.jacobian, self.where, self.odd, tuple(self.values))

    def with_parameters(self, **changes):
        """Return a copy with some parameters of the law (or the label) changed."""
        label = changes.pop("label", self.label)
        return Force(self.law, self.jacobian, site=self.where, odd=self.odd, label=label, **{**self.values, **changes})

    def placed(self, place):
        """Return the force at a number instead of a name."""
        return self.seated(place(self.where)) if isinstance(self.where, str) else self

    def seated(self, site):
        """Return the force at another site."""
        return Force(self.law, self.jacobian, site=site, odd=self.odd, label=self.label, **self.values)

    def site(self, n):
        """Return the rows it acts on."""
        return Rows.of(self.where, n)

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(self.law, tuple(self.values.values()), self.jacobian))

    def stored_energy(self, u):
        """Work against the law on the way from zero; known for laws of one row that do not depend on its speed."""
        from scipy.integrate import quad  # building a system loads no scipy

        values = tuple(self.values.values())
        if len(u) != 1 or any(self.law(at, 0.0, *values) != self.law(at, speed, *values)
                              for at in (0.5 * u[0], u[0]) for speed in (-1.3, 0.7)):
            return None
        # as near to rounding as it comes: with its full output quad does not warn that it came no nearer
        work = quad(lambda at: self.law(at, 0.0, *values), 0.0, u[0], epsabs=0.0, epsrel=2e-14, limit=200, full_output=True)[0]
        return -float(work)

    def mirrored(self):
        """Its own image when declared odd."""
        return self if self.odd else None

    def to_record(self):
        """Return names of law and Jacobian, place and parameters, ready for JSON."""
        return {"class": "Force", "label": self.label, "law": self.law.__name__, "odd": self.odd, "site": self.where,
                "jacobian": None if self.jacobian is None else self.jacobian.__name__, "parameters": dict(self.values)}

    @classmethod
    def from_record(cls, record, functions=None):
        """Make the element that gave ``record``; its functions are looked up by name in ``functions``."""
        found = []
        for name in (record["law"], record["jacobian"]):
            if name is not None and name not in (functions or {}):
                raise ValueError(f"the record uses the law {name!r}; hand it over in elements=[{name}]")
            found.append(None if name is None else functions[name])
        where = record["site"] if isinstance(record["site"], int) else np.array(record["site"])
        return cls(*found, site=where, odd=record["odd"], label=record["label"], **record["parameters"])


def _tuples(rows: np.ndarray) -> tuple:
    """Return one row as a tuple, several as a tuple of tuples."""
    return vector("Force", "site", rows) if rows.ndim == 1 else tuple(vector("Force", "site", row) for row in rows)


def _always_nan(law, count: int, values) -> bool:
    """Whether a law gives NaN at every place where it can be called from Python."""
    found = []
    for place in TRIED:
        try:
            found.append(np.isnan(np.asarray(law(*[place] * count, *values), float)).any())
        except (ArithmeticError, TypeError, ValueError):  # beyond its domain, or only the compiler understands it
            continue
    return bool(found) and all(found)
