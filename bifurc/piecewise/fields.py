"""Affine fields, surfaces and resets of systems of first order, and their numbers as rows over (states, 1, harmonics).

Each number may be a function of the system's parameters: ``AffineField(lambda k, c: [[0, 1], [-k, -c]], [0, 1])``.
"""
import inspect
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import floats, refused, shown
from ..elements.local import Affine, Frame


def frozen(value):
    """Return numbers in arrays and lists as nested tuples, so that what holds them can be compared; all else as it is."""
    found = None if callable(value) else floats(value)
    return value if found is None else nested(found.tolist())


def nested(items):
    """Return nested lists as nested tuples."""
    return tuple(map(nested, items)) if isinstance(items, list) else items


def read(owner: str, name: str, value, shape: tuple[int, ...], parameters: dict[str, float]) -> np.ndarray:
    """Return a number, an array, or what a function of parameters returns, as finite floats of a shape, or raise ValueError."""
    if callable(value):
        wanted = inspect.signature(value).parameters
        for missing in (key for key in wanted if key not in parameters):
            raise ValueError(f"{owner}: {name} takes a parameter {missing!r}, which the system does not have; "
                             f"there are {', '.join(parameters) or 'none'}")
        value = value(**{key: parameters[key] for key in wanted})
    found = floats(value)
    if found is not None and found.shape != shape and found.ndim == 0:
        found = np.full(shape, found) if found == 0.0 or shape == () else found
    if found is None or found.shape != shape or not np.isfinite(found).all():
        raise refused(owner, name, value, f"finite numbers of shape {shape}")
    return found


@dataclass(frozen=True, init=False)
class AffineExpressions:
    """Rows ``A x + b + sum over k of cos[k] cos(k omega t) + sin[k] sin(k omega t)``."""

    A: Any
    b: Any
    cos: Any
    sin: Any

    def __init__(self, A, b=0.0, *, cos: dict | None = None, sin: dict | None = None):
        for name, value in (("cos", cos), ("sin", sin)):
            if value is not None and not (isinstance(value, dict) and all(type(k) is int and k > 0 for k in value)):
                raise refused(type(self).__name__, name, value, "None or a dict of whole numbers from 1 on to amplitudes")
        for name, value in (("A", A), ("b", b)):
            object.__setattr__(self, name, frozen(value))
        for name, part in (("cos", cos or {}), ("sin", sin or {})):
            object.__setattr__(self, name, tuple((k, frozen(part[k])) for k in sorted(part)))

    @property
    def harmonics(self) -> set[int]:
        """Harmonics of the excitation that occur."""
        return {k for part in (self.cos, self.sin) for k, _ in part}

    def numbers(self, owner: str, rows: tuple[int, ...], n: int, harmonics, parameters) -> np.ndarray:
        """Return the numbers (*rows, n + 1 + 2 len(harmonics)): columns of the states, 1, cos and sin of each harmonic."""
        out = np.zeros((*rows, n + 1 + 2 * len(harmonics)))
        out[..., :n] = read(owner, "A", self.A, (*rows, n), parameters)
        out[..., n] = read(owner, "b", self.b, rows, parameters)
        for first, part, name in ((n + 1, self.cos, "cos"), (n + 2, self.sin, "sin")):
            for k, value in part:
                out[..., first + 2 * harmonics.index(k)] = read(owner, f"{name}[{k}]", value, rows, parameters)
        return out


class AffineField(AffineExpressions):
    """The field x' = A x + b + sum over k of cos[k] cos(k omega t) + sin[k] sin(k omega t).  Its flow is known in closed form.

    Parameters
    ----------
    A : array (n, n), or function of parameters
        1/time.
    b : array (n,), or function of parameters
        Constant part, state/time; 0: none.
    cos, sin : dict of int to array (n,) or function of parameters, optional
        Amplitudes of harmonics of the excitation.

    Examples
    --------
    >>> import bifurc as bf
    >>> heating = bf.AffineField(lambda tau: [[-1 / tau]], lambda tau: [30 / tau])
    """


class AffineSurface(AffineExpressions):
    """The surface h = 0 of h = A . x + b + sum over k of cos[k] cos(k omega t) + sin[k] sin(k omega t).

    Parameters
    ----------
    A : array (n,), or function of parameters
        Its normal.
    b : float, or function of parameters
    cos, sin : dict of int to float or function of parameters, optional

    Examples
    --------
    >>> import bifurc as bf
    >>> belt = bf.AffineSurface([0, 1], lambda speed: -speed)
    """


class AffineReset(AffineExpressions):
    """The reset x+ = A x + b + sum over k of cos[k] cos(k omega t) + sin[k] sin(k omega t).

    Parameters
    ----------
    A : array (n, n), or function of parameters
    b : array (n,), or function of parameters
    cos, sin : dict of int to array (n,) or function of parameters, optional

    Examples
    --------
    >>> import bifurc as bf
    >>> rebound = bf.AffineReset(lambda restitution: [[1, 0], [0, -restitution]])
    """


class Columns:
    """Columns (states, 1, cos k omega t, sin k omega t, ...) of a system, its expressions, and their rates."""

    def __init__(self, n: int, harmonics: tuple[int, ...], omega: float | None):
        self.n, self.harmonics = n, harmonics
        frame = Frame(0, n, harmonics, omega)
        self.names, self.W = [*(("z", i) for i in range(n)), *frame.columns], frame.W

    def rate(self, row: np.ndarray, field: np.ndarray) -> np.ndarray:
        """Return the rate (nx,) of an expression ``row`` (nx,) along a ``field`` (n, nx)."""
        out = row[:self.n] @ field
        out[self.n:] += row[self.n:] @ self.W
        return out

    def expression(self, row: np.ndarray) -> Affine:
        """Return numbers (nx,) as an expression of an automaton."""
        return Affine(dict(zip(self.names, row.tolist(), strict=True)))

    def expressions(self, rows: np.ndarray) -> tuple[Affine, ...]:
        """Return numbers (rows, nx) as expressions."""
        return tuple(map(self.expression, rows))


def affine(owner: str, name: str, value, kind: type):
    """Return ``value`` where it is an affine expression of a kind, or raise ValueError."""
    if callable(value):
        raise ValueError(f"{owner}: {name} = {shown(value)} is not allowed; fields, surfaces and resets are affine so far: give an "
                         f"{kind.__name__}, whose numbers may be functions of the parameters")
    if not isinstance(value, kind):
        raise refused(owner, name, value, f"an {kind.__name__}")
    return value
