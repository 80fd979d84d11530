"""The numbers of a system along one parameter, as polynomials in balls.

A builder is a program of floats; what it computes between two values of a parameter cannot be enclosed.  Its numbers are sampled
and read as constants, as the parameter itself, or as polynomials, checked at further values to rounding; a ball of a few units
in the last place is put around each.  That they are these polynomials between the samples is assumed, and said.
"""
import math

import numpy as np

from ..arithmetic.balls import Balls, flint
from ..arithmetic.jets import SeriesField
from ..model import Model, Refused, floats_of

DEGREES = (1, 2, 4, 8, 16)
ULPS = 32.0 * 2.3e-16  # of the largest value on the range


class Family:
    """A system over a range of one of its parameters.

    Parameters
    ----------
    system : System
    name : str
        Full name of the parameter.
    low, high : float
        Range; where it is a single value, a small one around it is taken.
    places : list of (int, key)
        Modes of elements that are read.

    Raises
    ------
    Refused
        When the numbers do not depend on the parameter as polynomials.
    """

    def __init__(self, system, name: str, low: float, high: float, places):
        self.system, self.name, self.places = system, name, list(places)
        pad = 1e-3 * (max(abs(low), abs(high)) or 1.0)
        if high - low < pad:
            low, high = low - pad, high + pad
        self.low, self.high = low, high
        for degree in DEGREES:
            if self._fits(degree):
                return
        raise Refused(f"the numbers of the system are no polynomials of {name} to rounding; no proof is made along it")

    def _fits(self, degree: int) -> bool:
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        z = np.concatenate([nodes, [-0.91, -0.37, 0.23, 0.79]])
        p = [0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * float(v) for v in z]
        rows = np.array([floats_of(self.system.with_parameters(**{self.name: v}), self.places) for v in p])
        self.constant = (rows == rows[0]).all(axis=0)
        self.identical = ~self.constant & (rows == np.array(p)[:, None]).all(axis=0)
        self.first = rows[0]
        self.series: dict[int, tuple[list[float], float]] = {}
        x = (np.array(p) - 0.5 * (self.low + self.high)) / (0.5 * (self.high - self.low))
        for k in np.flatnonzero(~(self.constant | self.identical)):
            values = rows[:, k]
            fit = np.polynomial.polynomial.polyfit(x[:degree + 1], values[:degree + 1], degree)
            size = ULPS * float(np.abs(values).max())
            if np.abs(np.polynomial.polynomial.polyval(x, fit) - values).max() > size:
                return False
            self.series[int(k)] = ([float(c) for c in fit], size)
        return True

    def numbers(self, p, parts: int = 2) -> list[list]:
        """Return the Taylor coefficients of every number, ``parts`` of them, about every point of a ball of the parameter."""
        arb = flint().arb
        zero = arb(0)
        half = (arb(self.high) - arb(self.low)) / 2
        z = (p - (arb(self.high) + arb(self.low)) / 2) / half
        rest = [zero] * parts
        out = []
        for k, value in enumerate(self.first):
            if self.constant[k]:
                out.append([arb(float(value)), *rest[1:]])
            elif self.identical[k]:
                out.append([p, arb(1), *rest[2:]][:parts])
            else:
                fit, size = self.series[k]
                found = list(rest)
                for c in reversed(fit):  # Horner on coefficients: each is a ball of rounding
                    found = [(found[j - 1] if j else zero) + found[j] * z for j in range(parts)]
                    found[0] = found[0] + arb(c, size)
                out.append([v / half**j for j, v in enumerate(found)])
        return out

    def model(self, p, parts: int = 2) -> Model:
        """Return the model with Taylor coefficients over a ball of the parameter."""
        return Model(self.system, SeriesField(self.numbers(p, parts), parts), self.places)

    def balls(self, p) -> Model:
        """Return the model over a ball of the parameter."""
        return Model(self.system, Balls([value for value, in self.numbers(p, 1)]), self.places)

    def at(self, p: float):
        """Return the system at a value of the parameter."""
        if not math.isfinite(p):
            raise Refused(f"{self.name} = {p} is no number")
        return self.system.with_parameters(**{self.name: p})
