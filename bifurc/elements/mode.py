"""Modes of an element and what ends them: forces, constrained rows, memory, guards, impact laws."""
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .kinds import EventKind
from .local import Affine


@dataclass(frozen=True)
class Law:
    """A force that is not affine: scalars in, one scalar force a row out.

    Parameters
    ----------
    function : callable
        ``f(u0, ..., s0, ..., *values)``: force on the row, or a tuple of forces when the site has several rows.
        It is compiled: plain arithmetic and `math` only.
    values : tuple of float
        Parameters, handed over in this order.
    jacobian : callable, optional
        Same arguments; returns df/du0, ..., df/ds0, ... of the first force, then of the second, ...  Differenced when
        missing.
    """

    function: Callable
    values: tuple[float, ...] = ()
    jacobian: Callable | None = None


@dataclass(frozen=True)
class Hold:
    """A row whose speed stays zero in the mode.

    Parameters
    ----------
    row : int
        Row of the site with s[row] = 0.
    push : tuple of float
        Direction of the reaction in the rows of the site; the reaction is R^T push lam.
    surface : Affine, optional
        Must vanish for the mode to be entered (the stop is where the row is held); None: held anywhere.
    """

    row: int
    push: tuple[float, ...]
    surface: Affine | None = None


@dataclass(frozen=True)
class Algebraic:
    """An algebraic internal variable: memory that follows local values; written when the mode is left."""

    value: Affine


@dataclass(frozen=True)
class Rate:
    """Memory with a rate z' = value."""

    value: Affine


class Kick(Protocol):
    """An impulse at an event, given only when the guard arrives with a positive rate."""

    affine: bool  # the impulse is affine in the speeds

    def impulse(self, s: np.ndarray, W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return impulse P, shape (rows,), and dP/ds, shape (rows, rows); v+ = v- + M^-1 R^T P.

        Parameters
        ----------
        s : ndarray, shape (rows,)
            Speeds of the site before the event.
        W : ndarray, shape (rows, rows)
            R M^-1 R^T.
        """


@dataclass(frozen=True)
class Restitution:
    """Newton's law in all rows of the site: s+ = -ratio s-, P = -(1 + ratio) W^-1 s."""

    ratio: float
    affine = True

    def impulse(self, s, W):
        """Return impulse and derivative, see `Kick`."""
        slope = -(1.0 + self.ratio) * (np.linalg.inv(W) if len(W) > 1 else 1.0 / W)
        return slope @ s, slope


@dataclass(frozen=True)
class Guard:
    """A condition of a mode: `value` is negative inside; what follows when it no longer is.

    Parameters
    ----------
    value : Affine or Law
        In u, s, z, lam, constants and harmonics; or a law that returns one number, and its derivatives by u0, ..., s0, ...
    kind : EventKind
    then : tuple of keys, or callable
        Modes of the element, tried in this order; the mode being left is always added as the last (a touch).  A block of
        many contacts may decide jointly: ``then(value)`` returns the keys, ``value(expression)`` being the value of an
        expression of the element at the event.
    kick : Kick or Law, optional
        A law gives one impulse a row from coordinates and speeds before the event; its first value is the ratio of speeds
        after and before, for which 0 is put where complete chattering ends.
    silent : bool
        Both sides have the same force law: no unknown of an orbit.
    accumulates : (ratio, key), optional
        Complete chattering: the event repeats with this ratio of successive speeds and accumulates, after which the mode
        `key` holds (never when the ratio is 1).
    reset : tuple of Affine, optional
        Memory after the event, one entry a memory, in what there is before it; empty: as it is.
    displaced : (direction, Affine), optional
        What the event adds to the state of the system: a value in what there is before it times a direction, a factor for each
        of the first states; it must change nothing that any element feels.
    """

    value: Affine | Law
    kind: EventKind
    then: tuple[Hashable, ...] | Callable[[Callable[[Affine], float]], tuple[Hashable, ...]]
    kick: Kick | Law | None = None
    silent: bool = False
    accumulates: tuple[float, Hashable] | None = None
    reset: tuple[Affine, ...] = ()
    displaced: tuple[tuple[float, ...], Affine] | None = None


@dataclass(frozen=True)
class Mode:
    """One way an element acts.

    Parameters
    ----------
    force : tuple of Affine or float, or Law
        One entry a row of the site, or one law; empty: no force.
    hold : tuple of Hold
    memory : tuple of Algebraic, Rate or None
        One entry a memory; None (and an empty tuple) is frozen.
    guards : tuple of Guard
    bounds : tuple of (Affine, Affine)
        Of a set-valued law: least and largest multiplier of every held row, what harmonic balance projects on; the flow
        goes by the guards.  Empty: the holds are no set-valued force law.
    """

    force: tuple | Law = ()
    hold: tuple[Hold, ...] = ()
    memory: tuple = ()
    guards: tuple[Guard, ...] = ()
    bounds: tuple[tuple[Affine, Affine], ...] = ()

    @property
    def law(self) -> Law | None:
        """The law, when the force is not affine."""
        return self.force if isinstance(self.force, Law) else None

    @property
    def entries(self) -> tuple:
        """The affine force, one entry a row; empty when there is none, or a law."""
        return () if isinstance(self.force, Law) else self.force
