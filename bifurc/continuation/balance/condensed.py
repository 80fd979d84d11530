"""Branches of harmonic orbits in the coordinates that contacts and laws touch; the others are recovered when they are shown.

The unknowns are those of `hbm.condensation.Condensed` with drives: touched coordinates, and where the load acts, so that steps
see the resonances of all modes.  Special points are those of the whole balance: its determinant is that of the condensed one
times that of the linear part, whose sign is that of the mean's stiffness.
"""
import copy

import numpy as np

from ...hbm.balance import Balance
from ...hbm.condensation.condensed import Condensed, Point
from ...hbm.condensation.receptance import Changed
from ...hbm.measures import measure_gradient
from ...hbm.parts import views
from ...hbm.tables import Series, numbers_at
from ...orbits.balance.find import condensing
from ...orbits.balance.method import HarmonicBalance
from ..problem import EPS, Corrected, Problem
from .problem import BalancePath, BalanceProblem

KEPT = 4  # sets of rows whose motions are kept, for the columns of a table


def condensed_along(balance: Balance, path: BalancePath, like: Condensed | None = None) -> Condensed:
    """Return the equations in few coordinates for a branch along ``path``."""
    changed = changed_along(balance, path)
    sweep = changed.few if _moves(balance, path) else bool((path.index == 0).any())
    return Condensed(balance, True, sweep, like, changed if _moves(balance, path) else None)


def _moves(balance: Balance, path: BalancePath) -> bool:
    """Return whether mass, damping or stiffness change along a path."""
    n = balance.layout.n  # they follow the frequency, see `hbm.parts.Numbers`
    return bool(((path.index > 0) & (path.index <= 3 * n * n)).any())


def changed_along(balance: Balance, path: BalancePath) -> Changed:
    """Return how mass, damping and stiffness change along a path, by the coefficients of its series."""
    n = balance.layout.n
    core = (path.index > 0) & (path.index <= 3 * n * n)
    entries = path.index[core] - 1
    matrices = np.zeros((path.series.shape[1], 3 * n * n))
    matrices[0] = path.base[1:1 + 3 * n * n]
    matrices[:, entries] = path.series[core].T
    coordinates = np.unique(np.concatenate([entries // n % n, entries % n]))
    return Changed(coordinates, tuple(matrices.reshape(-1, 3, n, n).swapaxes(0, 1)))


class Along:
    """Numbers of a condensed balance along a path, with what was asked last."""

    def __init__(self, condensed: Condensed, path: BalancePath):
        self.condensed, self.path, self.moved = condensed, path, _moves(condensed.balance, path)
        self.flat, self._dflat = path.base.copy(), np.zeros_like(path.base)
        shape = condensed.balance.parts.shape
        self._named = views(self.flat, shape), views(self._dflat, shape)
        self._order, self._start = np.arange(len(path.index)), path.base[path.index]
        self._values, self._slopes = np.empty(len(path.index)), np.empty(len(path.index))
        self._last: tuple[float, Point] | None = None
        self.shown: dict[bytes, np.ndarray] = {}

    def at(self, p: float) -> Point:
        """Return the point at a parameter; its arrays are overwritten by the next call."""
        p, path = float(p), self.path
        if self._last is None or self._last[0] != p:
            numbers_at(Series(self._start, self._order, path.series, path.low, path.high), p, self._values, self._slopes)
            self.flat[path.index], self._dflat[path.index] = self._values, self._slopes
            self._last = p, self.condensed.point(self.flat, self._dflat, self.moved, self._named)
        return self._last[1]


class CondensedProblem(BalanceProblem):
    """Harmonic balance along one parameter, condensed.

    Parameters
    ----------
    condensed : Condensed
        See `condensed_along`.
    method : HarmonicBalance
    path : BalancePath
        Of the whole balance.
    x0 : ndarray (n + 1,)
        Unknowns of the start and the parameter.
    scale : ndarray (n + 1,)
        Natural sizes.
    listed : ndarray (contacts,), optional
        Events of each contact; default those at ``x0``.
    """

    def __init__(self, condensed: Condensed, method: HarmonicBalance, path: BalancePath, x0, scale, listed=None):
        self.condensed, self._along = condensed, Along(condensed, path)
        super().__init__(condensed.forces, method, path, x0, scale, listed)
        self.whole, self.size, self.follows = condensed.balance, condensed.size, False

    # equations

    def numbers(self, p: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of contacts and laws at ``p`` and their derivatives."""
        point = self._along.at(p)
        return point.flat, point.dflat

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`."""
        found = self._in_order(Problem.correct(self, x, tangent, fixed))
        if found.converged:
            point = self._along.at(found.p)
            found.det_sign *= point.linear.sign
            found.det_log += self.condensed.linear.log_determinant(point.T, point.moved)
        return found

    def _linearised(self, x):
        _, f, wide = self.condensed.linearised(x[:-1], self._along.at(x[-1]), listed=self.listed)
        self._size_log = float(np.log(np.abs(wide * self.scale).max(axis=1) + 1e-300).sum())
        return f, wide, EPS * (np.abs(wide) @ np.abs(x))

    def _rest_sign(self, p):
        """See `BalanceProblem._rest_sign`."""
        return self._along.at(p).linear.sign

    def residual(self, u, p):
        """Return the residual (n,), in the units of the unknowns."""
        return self.condensed.residual(np.asarray(u, float), self._along.at(p), self.listed)

    def jacobian(self, u, p):
        """Return F_u (n, n) and F_p (n,), exact."""
        _, _, wide = self.condensed.linearised(np.asarray(u, float), self._along.at(p), listed=self.listed)
        return wide[:, :-1], wide[:, -1]

    def on_path(self, path) -> "CondensedProblem":
        """See `BalanceProblem.on_path`."""
        other = copy.copy(self)
        other.path, other._along = path, Along(self.condensed, path)
        return other

    # what is shown and stored

    def motions(self, xs) -> np.ndarray:
        """See `BalanceProblem.motions`; recovered from the linear part."""
        xs, shown = np.ascontiguousarray(xs, float), self._along.shown
        key = xs.tobytes()
        if key not in shown:
            if len(shown) >= KEPT:
                del shown[next(iter(shown))]
            shown[key] = np.array([self.condensed.expand(x[:-1], self._along.at(x[-1])) for x in xs]).reshape(-1, self.whole.size)
        return shown[key]

    def whole_numbers(self, p: float) -> np.ndarray:
        """See `BalanceProblem.whole_numbers`."""
        self._along.at(p)
        return self._along.flat

    def measure_gradient(self, name, x):
        """See `BalanceProblem.measure_gradient`."""
        made = measure_gradient(self.whole.layout, name, self.motions(x[None])[0])
        return None if made is None else self.condensed.gradient(made, x[:-1], self._along.at(x[-1]))

    def _how(self):
        return {"condensed": condensing(self.condensed)}

    def _like(self):
        return self.condensed
