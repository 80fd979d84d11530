"""What an element sees: affine expressions in a few local values, and the frame that turns them into rows of numbers.

Local values are the coordinates ``u`` and speeds ``s`` of the element's own site, its memory ``z``, the multipliers
``lam`` of its own held rows, the constant 1 and the harmonics ``cos k omega t``, ``sin k omega t`` of the excitation.
"""
import math
from typing import NamedTuple

import numpy as np

ONE = ("one", 0)  # name of the constant


class Core(NamedTuple):
    """The linear core of a system, for elements whose forces follow from it (moving frames, unbalance)."""

    mass: np.ndarray  # (n, n)
    damping: np.ndarray  # (n, n)
    stiffness: np.ndarray  # (n, n)
    omega: float | None  # excitation frequency; None: autonomous


class WatchedCore(Core):
    """A core that notes whether anything but its matrices is read: numbers made without it hold at every frequency."""

    read = False

    def __new__(cls, core: Core):
        return super().__new__(cls, *core)

    def __getnewargs__(self):
        return (Core(*self),)

    def __getattribute__(self, name: str):
        if name == "omega":
            self.read = True
        return super().__getattribute__(name)

    def __getitem__(self, place):
        self.read = True
        return super().__getitem__(place)

    def __iter__(self):
        self.read = True
        return super().__iter__()


class Affine:
    """Affine expression in local values: ``2.0 * u(0) - gap + amplitude * cos(1)``.  Immutable.

    ``terms`` maps (name, index) to the coefficient; the constant is ``("one", 0)``.  Coefficients that happen to be
    zero are kept: which terms there are is structure, what they weigh is a number.
    """

    __slots__ = ("terms",)

    def __init__(self, terms: dict):
        self.terms = terms

    def __add__(self, other):
        terms = dict(self.terms)
        for key, weight in (other.terms if type(other) is Affine else {ONE: float(other)}).items():
            terms[key] = terms.get(key, 0.0) + weight
        return Affine(terms)

    __radd__ = __add__

    def __neg__(self):
        return Affine({key: -weight for key, weight in self.terms.items()})

    def __sub__(self, other):
        return self + -other

    def __rsub__(self, other):
        return -self + other

    def __mul__(self, factor):
        factor = float(factor)
        return Affine({key: factor * weight for key, weight in self.terms.items()})

    __rmul__ = __mul__

    def __truediv__(self, divisor):
        return self * (1.0 / float(divisor))

    def __eq__(self, other):
        return isinstance(other, Affine) and self.terms == other.terms

    def __hash__(self):
        return hash(frozenset(self.terms.items()))

    def __repr__(self):
        parts = [f"{weight:g}" if name == "one" else f"{weight:g}*{name}({index})"
                 for (name, index), weight in self.terms.items()]
        return " + ".join(parts) or "0"

    @property
    def names(self) -> set[str]:
        """Names of the local values that occur."""
        return {name for name, _ in self.terms}

    @property
    def harmonics(self) -> set[int]:
        """Harmonics of the excitation that occur."""
        return {index for name, index in self.terms if name in ("cos", "sin")}


def affine(value) -> Affine:
    """Return a number as a constant expression; an expression as it is."""
    return value if isinstance(value, Affine) else Affine({ONE: float(value)})


def u(row: int = 0) -> Affine:
    """Coordinate of a row of the site."""
    return Affine({("u", row): 1.0})


def s(row: int = 0) -> Affine:
    """Speed of a row of the site, drift and base motion included."""
    return Affine({("s", row): 1.0})


def z(index: int = 0) -> Affine:
    """Own memory."""
    return Affine({("z", index): 1.0})


def lam(hold: int = 0) -> Affine:
    """Multiplier of an own held row."""
    return Affine({("lam", hold): 1.0})


def cos(harmonic: int = 1) -> Affine:
    """cos(harmonic * omega * t)."""
    return Affine({("cos", harmonic): 1.0})


def sin(harmonic: int = 1) -> Affine:
    """sin(harmonic * omega * t)."""
    return Affine({("sin", harmonic): 1.0})


def wave(amplitude: float, harmonic: int = 1, phase: float = 0.0) -> Affine:
    """amplitude * cos(harmonic * omega * t + phase)."""
    return Affine({("cos", harmonic): amplitude * math.cos(phase), ("sin", harmonic): -amplitude * math.sin(phase)})


def rate(wave_: Affine, omega: float) -> Affine:
    """Time derivative of an expression in harmonics and constants."""
    terms: dict = {}
    for (name, k), weight in wave_.terms.items():
        if name == "cos":
            terms["sin", k] = terms.get(("sin", k), 0.0) - k * omega * weight
        elif name == "sin":
            terms["cos", k] = terms.get(("cos", k), 0.0) + k * omega * weight
    return Affine(terms)


class Frame:
    """Columns of the joined vector x = (q[n], v[n], z[nz], 1, cos k1 theta, sin k1 theta, ...), theta = omega t.

    Attributes
    ----------
    n, nz, ns, nx : int
        Degrees of freedom, memory, states 2 n + nz, and all columns.
    harmonics : tuple of int
        The k, ascending.
    omega : float or None
    W : ndarray, shape (nw, nw)
        Matrix of the forcing states, w' = W w.
    eye : ndarray, shape (nx, nx)
    read : bool
        The frequency was read: rows made from this frame hold at no other.
    """

    __slots__ = ("n", "nz", "ns", "nx", "harmonics", "_omega", "columns", "eye", "read")

    def __init__(self, n: int, nz: int, harmonics: tuple[int, ...], omega: float | None):
        self.n, self.nz, self.harmonics, self._omega, self.read = n, nz, harmonics, omega, False
        self.ns = 2 * n + nz
        self.nx = self.ns + 1 + 2 * len(harmonics)
        self.columns = {ONE: self.ns}
        self.eye = np.eye(self.nx)
        for i, k in enumerate(harmonics):
            c = 1 + 2 * i
            self.columns["cos", k] = self.ns + c
            self.columns["sin", k] = self.ns + c + 1

    def at(self, omega: float | None) -> "Frame":
        """Return the same columns at another frequency."""
        if omega == self._omega or omega is None or self._omega is None:
            return self
        other = object.__new__(Frame)
        for name in Frame.__slots__:
            setattr(other, name, getattr(self, name))
        other._omega, other.read = omega, False
        return other

    @property
    def omega(self) -> float | None:
        self.read = True
        return self._omega

    @property
    def W(self) -> np.ndarray:
        omega = self.omega or 0.0
        found = np.zeros((self.nx - self.ns, self.nx - self.ns))
        for i, k in enumerate(self.harmonics):
            found[1 + 2 * i, 2 + 2 * i] = -k * omega
            found[2 + 2 * i, 1 + 2 * i] = k * omega
        return found

    def row(self, expression, local: dict | None = None) -> np.ndarray:
        """Return an expression as a row, shape (nx,).

        Parameters
        ----------
        expression : Affine or float
        local : dict
            Rows, shape (., nx), of the names "u", "s", "z", "lam" that may occur.
        """
        row = np.zeros(self.nx)
        rows: dict = local or {}
        columns = self.columns
        for key, weight in affine(expression).terms.items():
            if key in columns:
                row[columns[key]] += weight
            else:
                name, index = key
                try:
                    row += weight * rows[name][index]
                except (KeyError, IndexError):
                    raise ValueError(f"the expression {expression!r} uses {name}({index}), which is not there; "
                                     f"harmonics must be listed in `harmonics` of the element") from None
        return row
