"""Square-root maps of grazing: Nordmark's map of an impact oscillator and its one-dimensional limit.

Nordmark (1991) in the form of Chin, Ott, Nusse and Grebogi (1994):

    x' = alpha x + y + rho,        y' = -gamma x              where x <= 0 (no impact),
    x' = -sqrt(x) + y + rho,       y' = -gamma r^2 x          where x > 0 (impact),

alpha and gamma are trace and determinant of the linear map of the grazing orbit, r the restitution, rho the distance beyond the
grazing.  For strong contraction it tends to x' = lam x + mu (x <= 0), mu - sqrt(x) (x > 0).
"""
import math

import numpy as np

from .base import Map, Piece

FREE, IMPACT = "O", "I"  # symbols: nothing happens, impact


class _Free1(Piece):
    symbol = FREE

    def image(self, u, p):
        return np.array([p.lam * u[0] + p.mu]), np.array([[p.lam]])

    def inside(self, u):
        return float(u[0])


class _Impact1(Piece):
    symbol = IMPACT

    def place(self, u):
        return np.array([u[0] * u[0]]), np.array([[2.0 * u[0]]])

    def image(self, u, p):
        return np.array([p.mu - u[0]]), np.array([[-1.0]])

    def inside(self, u):
        return -float(u[0])

    def coordinates(self, x):
        return np.array([math.sqrt(max(x[0], 0.0))])


class SquareRootMap(Map):
    """x' = lam x + mu where x <= 0, mu - sqrt(x) where x > 0.

    Parameters
    ----------
    lam : float
        Leading multiplier of the grazing orbit, dimensionless.
    mu : float
        Distance beyond the grazing, in the unit of x.

    Examples
    --------
    >>> from bifurc.continuation.maps import SquareRootMap
    >>> cycle = SquareRootMap(lam=0.2, mu=0.05).find(2)
    >>> cycle.itinerary, cycle.stable
    ('IO', True)
    """

    dimension, names = 1, ("lam", "mu")
    pieces = {FREE: _Free1(), IMPACT: _Impact1()}
    lam: float
    mu: float

    def step(self, x):
        """See `Map.step`."""
        x = np.asarray(x, float)
        lam, mu = (np.asarray(value)[..., None] if np.ndim(value) else value for value in (self.lam, self.mu))
        return np.where(x > 0.0, mu - np.sqrt(np.abs(x)), lam * x + mu)

    def slope(self, x):
        """See `Map.slope`; infinite at the border from the side of impacts."""
        x = np.asarray(x, float)
        lam = np.asarray(self.lam)[..., None] if np.ndim(self.lam) else self.lam
        with np.errstate(divide="ignore"):
            return np.where(x > 0.0, -0.5 / np.sqrt(np.abs(x)), lam + 0.0 * x)[..., None]

    def piece_of(self, x):
        """See `Map.piece_of`."""
        return IMPACT if x[0] > 0.0 else FREE


class _Free2(Piece):
    symbol = FREE

    def image(self, u, p):
        return np.array([p.alpha * u[0] + u[1] + p.rho, -p.gamma * u[0]]), np.array([[p.alpha, 1.0], [-p.gamma, 0.0]])

    def inside(self, u):
        return float(u[0])


class _Impact2(Piece):
    symbol = IMPACT

    def place(self, u):
        return np.array([u[0] * u[0], u[1]]), np.array([[2.0 * u[0], 0.0], [0.0, 1.0]])

    def image(self, u, p):
        g = p.gamma * p.r2
        return np.array([-u[0] + u[1] + p.rho, -g * u[0] * u[0]]), np.array([[-1.0, 1.0], [-2.0 * g * u[0], 0.0]])

    def inside(self, u):
        return -float(u[0])

    def coordinates(self, x):
        return np.array([math.sqrt(max(x[0], 0.0)), x[1]])


class NordmarkMap(Map):
    """Nordmark's map in the form of Chin et al., see above.

    Parameters
    ----------
    alpha, gamma : float
        Trace and determinant of the linear map of the grazing orbit.
    r2 : float
        Square of the restitution.
    rho : float
        Distance beyond the grazing, in the unit of x.
    """

    dimension, names = 2, ("alpha", "gamma", "r2", "rho")
    pieces = {FREE: _Free2(), IMPACT: _Impact2()}
    alpha: float
    gamma: float
    r2: float
    rho: float

    def step(self, x):
        """See `Map.step`."""
        x = np.asarray(x, float)
        a, b, hit = x[..., 0], x[..., 1], x[..., 0] > 0.0
        first = np.where(hit, -np.sqrt(np.abs(a)), self.alpha * a) + b + self.rho
        return np.stack([first, np.where(hit, -self.gamma * self.r2 * a, -self.gamma * a)], axis=-1)

    def slope(self, x):
        """See `Map.slope`; infinite at the border from the side of impacts."""
        x = np.asarray(x, float)
        a, hit = x[..., 0], x[..., 0] > 0.0
        out = np.zeros((*x.shape, 2))
        with np.errstate(divide="ignore"):
            out[..., 0, 0] = np.where(hit, -0.5 / np.sqrt(np.abs(a)), self.alpha)
        out[..., 0, 1] = 1.0
        out[..., 1, 0] = np.where(hit, -self.gamma * self.r2, -self.gamma)
        return out

    def piece_of(self, x):
        """See `Map.piece_of`."""
        return IMPACT if x[0] > 0.0 else FREE
