"""Tests of the multipliers of a motion that one linear mode makes all along, from the eigenvalues of its matrix.

The multipliers are exp(lambda T).  Those of a chain of masses turn round the unit circle hundreds of times while the period
changes a little, and det(1 - M) = prod(1 - exp(lambda T)) with them: three rows say nothing of what lies between.  Yet
1 - exp(z) = -z (exp(z) - 1)/z, and the second factors of all eigenvalues together have one sign, as those of a pair are
conjugates and that of a real one is positive.  So the determinant changes its sign with det(-A), where a real eigenvalue passes
zero, det(1 + M) never, and prod(1 - mu_i mu_j) with prod(-lambda_i - lambda_j), where a pair passes the imaginary axis (or two
real ones become opposite): determinants of the matrix itself, which are as smooth as it is (bialternate product: Kuznetsov
2004, section 10.2.2).
"""
import math

import numpy as np

from ...orbits.multipliers import NEUTRAL
from ...orbits.shooting.sequence import AFTER

EPS = float(np.finfo(float).eps)
ROUNDING = 8.0 * EPS  # of the largest eigenvalue: sums of eigenvalues that are none


class LinearMotion:
    """The linear mode of an event-free forced motion along a path.

    Parameters
    ----------
    equations : Equations
    signature : Signature
        For which `is_linear` holds.
    start : float
        Value of the parameter of which determinants are parts.
    """

    def __init__(self, equations, signature, start: float):
        self.equations, self.mode = equations, int(signature.nodes[0, AFTER])
        self.span, self.closure = signature.span, signature.closure
        self._known, self._rates = np.empty(0), np.empty(0, complex)
        rates, self.unit = self.at(start)
        self.top = float(np.abs(rates).max())
        self._first = np.zeros(2)
        self._first[:] = [log for _, log in self._determinants(rates)]

    def at(self, value: float) -> tuple[np.ndarray, float]:
        """Return the eigenvalues (ns,), 1/time, and the time of the span at a value of the parameter."""
        T = self.equations.numbers_at(value)
        A = T.A[self.mode][:, :T.A.shape[1]]
        if not np.array_equal(A, self._known):
            self._known, self._rates = A.copy(), np.linalg.eigvals(A).astype(complex)
        return self._rates, self.span * 2.0 * math.pi / float(T.flat[0])

    def _determinants(self, rates):
        """Return (sign, logarithm of the size, of that at the start) of prod(-lambda) and of prod(-lambda_i - lambda_j); a factor
        that is rounding counts as zero, or is left out where the start has it."""
        i, j = np.triu_indices(rates.size, 1)
        made, least = [], ROUNDING * self.top
        for factors, first in zip((-rates, -(rates[i] + rates[j])), self._first, strict=True):
            sizes = np.abs(factors)
            clear = sizes > least
            odd = np.count_nonzero((factors.imag == 0.0) & (factors.real < 0.0)) % 2
            log = float(np.log(sizes[clear]).sum()) - float(first)
            made.append((0.0 if not clear.all() else -1.0 if odd else 1.0, log))
        return made

    def tests(self, value: float) -> tuple[float, float]:
        """Return the tests of the multiplier that the equations do not have as a zero of their own, -1 (of half a period: that
        breaks the symmetry), and of pairs on the circle, NaN where several are on it, so that rounding gives the sign."""
        rates, time = self.at(value)
        (sign, log), (sign_pairs, log_pairs) = self._determinants(rates)
        period = time if self.closure > 0 else 2.0 * time
        on_axis = np.count_nonzero(np.abs(np.expm1(rates.real[rates.imag > 0.0] * period)) < NEUTRAL)
        return (0.5 if self.closure > 0 else bounded(sign, log),
                math.nan if on_axis > 1 else bounded(sign_pairs, log_pairs))

    def without_turns(self, log: float, value: float) -> float:
        """Return the logarithm ``log`` of the determinant of the equations without the factors that have one sign and turn."""
        rates, time = self.at(value)
        z = rates * time
        if self.closure > 0:
            small = np.abs(z) < EPS
            factors = np.expm1(z) / np.where(small, 1.0, z) * (time / self.unit)
            factors[small] = time / self.unit
        else:
            factors = 1.0 + np.exp(z)
        return log - float(np.log(np.maximum(np.abs(factors), EPS)).sum())

    def without_angles(self, value: float) -> np.ndarray:
        """Return numbers (ns,) with the moduli of the multipliers of a period that do not turn with it, real where they are made
        by real eigenvalues."""
        rates, time = self.at(value)
        period = time if self.closure > 0 else 2.0 * time
        return np.exp(rates.real * period + 1j * np.arctan(rates.imag / self.top))


def is_linear(scene, signature, labels) -> bool:
    """Whether a motion is made by one linear mode all along, in states that are free."""
    modes, T = set(signature.nodes[:, AFTER].tolist()), scene.tables
    return not (signature.events or signature.clock or scene.laws or len(modes) > 1 or len(labels.rows)
                or T.n_holds[min(modes)])


def bounded(sign: float, log: float) -> float:
    """Return a determinant with its sign as a part of itself and one."""
    return sign / (1.0 + math.exp(min(-log, 700.0)))
