"""Balls of arbitrary precision (python-flint) and exact rationals: the two number fields of a proof, and how floats enter them.

A float is an exact binary number: it enters without error.  Every operation on balls encloses the true result (F. Johansson,
Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Trans. Computers 66 (2017), 1281-1292).
"""
import contextlib
import importlib
import math
import sys
from typing import Any

PRECISION = 96  # bits of a proof that asks for none: twice that of a float less a few
INSTALL = ("certificates are computed in ball arithmetic, by python-flint, which is not installed; "
           "pip install 'bifurc[certify]' (or pip install 'python-flint>=0.6') brings it")


class NotInstalled(ImportError):
    """The extra `certify` is missing; the message says how to install it."""


def flint() -> Any:
    """Return the module `flint`.

    Raises
    ------
    NotInstalled
        Saying what to install.
    """
    found = sys.modules.get("flint")
    if found is not None:  # asked for very often
        return found
    try:
        return importlib.import_module("flint")
    except ImportError:
        raise NotInstalled(INSTALL) from None


@contextlib.contextmanager
def working(precision: int | None):
    """Compute with balls of ``precision`` bits inside the block; None: `PRECISION`."""
    context = flint().ctx
    before = context.prec
    context.prec = PRECISION if precision is None else precision
    try:
        yield
    finally:
        context.prec = before


class Field:
    """What a model reads the floats of a system into: ``number(value)`` takes them one by one."""

    computes = True  # whether the numbers can be computed with; False: they are only noted

    def number(self, value: float) -> Any:
        """Return a float as a number of the field."""
        raise NotImplementedError


class Rationals(Field):
    """The field of rationals: structure (what vanishes identically at an event) is decided exactly."""

    def __init__(self):
        found = flint()
        self.scalar, self.matrix = found.fmpq, found.fmpq_mat

    def number(self, value: float):
        """Return a float as the rational it is."""
        return self.scalar(*value.as_integer_ratio())


class Balls(Field):
    """Balls; ``values`` replaces the floats of the system, in the order they are read, by enclosures (of a parameter's range)."""

    def __init__(self, values=None):
        found = flint()
        self.scalar, self.matrix = found.arb, found.arb_mat
        self._values = None if values is None else iter(values)

    def number(self, value: float):
        """Return a float as the ball of radius zero that it is, or the next of the given enclosures."""
        return self.scalar(value) if self._values is None else next(self._values)


class Recorder(Field):
    """No field: lists the floats of a system in the order in which they are read."""

    computes = False

    def __init__(self):
        self.floats: list[float] = []

    def number(self, value: float) -> float:
        """Note the float."""
        self.floats.append(float(value))
        return float(value)


def middle(ball) -> float:
    """Return the float nearest to the middle of a ball."""
    return float(ball.mid())


def above(ball) -> float:
    """Return a float that is not below any number of the ball."""
    return math.nextafter(float(ball.upper()), math.inf)


def below(ball) -> float:
    """Return a float that is not above any number of the ball."""
    return math.nextafter(float(ball.lower()), -math.inf)


def size(ball) -> float:
    """Return a float that is not below the modulus of any number of the ball."""
    return math.nextafter(float(ball.abs_upper()), math.inf)


def radius(ball) -> float:
    """Return a float that is not below the radius of the ball."""
    return math.nextafter(float(ball.rad()), math.inf)


def ends(ball) -> tuple[float, float]:
    """Return floats below and above all numbers of the ball."""
    return below(ball), above(ball)
