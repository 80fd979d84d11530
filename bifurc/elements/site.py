"""Sites: where an element sits.  Nothing outside a site forms a coordinate from the positions of the system."""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checks import number
from .local import Affine, Frame


@dataclass(frozen=True, eq=False)
class Rows:
    """Straight site: u = R q + base(t), s = R v + drift + base'(t).

    Forces enter as R^T f, impulses meet W = R M^-1 R^T.

    Parameters
    ----------
    R : array, shape (rows, n)
        One row a local coordinate; dimensionless factors of the coordinates.
    base : sequence of Affine, optional
        Motion added to each coordinate, in constants and harmonics of the excitation.
    drift : sequence of float, optional
        Speed added to each row beyond that of its coordinate (a belt: minus its speed).
    """

    R: np.ndarray
    base: tuple[Affine, ...] = ()
    drift: tuple[float, ...] = ()

    @classmethod
    def of(cls, where, n: int, base=(), drift=()) -> "Rows":
        """Make a site from a degree of freedom (int), one row of n factors, or several rows.

        Raises
        ------
        ValueError
            When the degree of freedom or the length does not fit n degrees of freedom, or a row is zero.
        """
        if type(where) is int or isinstance(where, np.integer):
            if not 0 <= where < n:
                raise ValueError(f"site: degree of freedom {where} is not allowed; there are 0 to {n - 1}")
            R = np.zeros((1, n))
            R[0, where] = 1.0
        else:
            R = np.atleast_2d(np.array(where, float))
            if R.ndim != 2 or R.shape[1] != n or not np.isfinite(R).all() or not R.any(axis=1).all():
                raise ValueError(f"site: row {where!r} is not allowed; it must be {n} finite factors, not all zero")
        base, drift = tuple(base), tuple(drift)
        if len(base) not in (0, len(R)) or len(drift) not in (0, len(R)):
            raise ValueError(f"site: base and drift must have one entry a row ({len(R)}), or none")
        return cls(R, base, drift)

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.R)

    @property
    def harmonics(self) -> set[int]:
        """Harmonics of the base motion."""
        return {k for motion in self.base for k in motion.harmonics}

    def rows(self, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, each of shape (rows, nx): coordinates u, speeds s, and the part of s' that is not J a."""
        n, ns = frame.n, frame.ns
        U = np.zeros((len(self.R), frame.nx))
        S = np.zeros((len(self.R), frame.nx))
        rest = np.zeros((len(self.R), frame.nx))
        U[:, :n] = self.R
        S[:, n:2 * n] = self.R
        for i, motion in enumerate(self.base):
            U[i] += frame.row(motion)
        if self.base:
            S[:, ns:] = U[:, ns:] @ frame.W
            rest[:, ns:] = S[:, ns:] @ frame.W
        if self.drift:
            S[:, ns] += self.drift
        return U, S, rest


@dataclass(frozen=True, eq=False)
class Circle(Rows):
    """Curved site: a point p = R q - centre seen from a circle, u(0) = |p| - radius, along the normal n and the tangent t.

    Laws and expressions of an element on it are in u(0), the radial speed s(0) = n . p', and the speed s(1) = t . p' +
    surface_speed along the surface (t is n turned by +90 degrees); u(1) is 0.  Forces are radial (outwards) and tangential.

    Parameters
    ----------
    R, base, drift
        See `Rows`: two rows, and no motion of their own.
    centre : tuple of float
        Length.
    radius : float
        Length, above 0.
    surface_speed : float
        What the surface of the moving body adds to its tangential speed: its own radius times its spin.
    spin : float
        Rate at which the frame of the coordinates turns: spin |p| is added to s(1), the sliding against what does not turn.
    """

    centre: tuple[float, float] = (0.0, 0.0)
    radius: float = 1.0
    surface_speed: float = 0.0
    spin: float = 0.0

    @classmethod
    def around(cls, rows, n: int, centre=(0.0, 0.0), radius: float = 1.0, surface_speed: float = 0.0,
               spin: float = 0.0) -> "Circle":
        """Make a circle seen by two rows of n factors: those of the coordinates along x and along y.

        Raises
        ------
        ValueError
            When rows do not fit n degrees of freedom, the centre is no point, or the radius is not positive.
        """
        straight = Rows.of(rows, n)
        x, y = (number("Circle", "centre", part) for part in centre)
        if straight.count != 2 or np.linalg.matrix_rank(straight.R) != 2:
            raise ValueError(f"Circle: rows = {rows!r} is not allowed; it must be two independent rows of {n} factors")
        return cls(straight.R, (), (), (x, y), number("Circle", "radius", radius, above=0.0),
                   number("Circle", "surface_speed", surface_speed), number("Circle", "spin", spin))


class Surface(NamedTuple):
    """A plane surface that limits a coordinate, as a picture shows it: at position + amplitude cos(harmonic omega t + phase)."""

    dof: int | None  # the degree of freedom it limits; None: a combination of several
    position: float  # length
    side: int  # +1: it lies above, -1: below
    rigid: bool
    amplitude: float = 0.0
    harmonic: int = 0
    phase: float = 0.0


class Ring(NamedTuple):
    """A round surface around a body that moves in a plane, as a picture shows it."""

    centre: tuple[float, float]
    radius: float  # clearance, length
    dofs: tuple[int, int]  # x and y of the body
    against: tuple[int, int] | None  # of the body that carries it
    rigid: bool
