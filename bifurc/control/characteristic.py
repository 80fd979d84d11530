"""Multipliers of an orbit under delayed feedback: one scalar equation, counted by the argument principle.

    p = K (s(t) - s(t - T)) + R p(t - T)

(Pyragas 1992; with memory R, 0 <= R < 1, extended: Socolar, Sukow and Gauthier 1994).  A perturbation with the multiplier
lambda = 1/mu has s(t - T) = mu s(t), so that p = kappa s with kappa = K (1 - mu)/(1 - R mu), and

    F(mu) = det(I - mu Phi(kappa)) = 0,

with Phi the transition matrix over the period, events included.  F is analytic in the unit disc and F(0) = 1: its winding
number along |mu| = 1 is the number of multipliers outside the unit circle.
"""
import numpy as np

from .linearization import Linearization

POINTS = 64  # on the half circle, first
TURN = 0.7  # largest change of the argument of F between two points
FINEST = 1e-9  # of the circle: closer than that to a zero the count is not told
NEWTON = 60
CLOSE = 1e-13  # last correction of a root, relative
AROUND = np.linspace(0.0, np.pi, 5)  # angles at which the size of F on the circle is looked up
ROUNDING = 64.0 * 2.2e-16  # of F, in parts of that size: transition matrices of an orbit that is itself known to rounding


class OnCircle(ArithmeticError):
    """F vanishes on the circle to rounding: a multiplier lies on it."""


class Characteristic:
    """F(mu) = det(I - mu Phi(kappa)) of an orbit and a feedback.

    Parameters
    ----------
    linear : Linearization
        Without jumps of the coordinate that is fed back.
    memory : float
        R, 0 <= R < 1.
    """

    def __init__(self, linear: Linearization, memory: float = 0.0):
        self.linear, self.memory = linear, memory

    def __call__(self, mu, gain) -> np.ndarray:
        """Return F (k,) at ``mu`` (k,) and gains (k,) or a single one; complex."""
        mu = np.atleast_1d(np.asarray(mu, complex))
        kappa = gain * (1.0 - mu) / (1.0 - self.memory * mu)
        Phi = self.linear.reduced(self.linear.transition(kappa))
        return np.linalg.det(np.eye(Phi.shape[-1]) - mu[:, None, None] * Phi)

    def count(self, gain: float, radius: float = 1.0) -> int:
        """Return the number of multipliers with |lambda| > 1/radius (zeros with |mu| < radius), by the argument principle.

        Raises
        ------
        OnCircle
            When a multiplier lies on the circle to rounding.
        """
        if self.memory * radius >= 1.0:
            raise ValueError(f"radius = {radius!r} is not allowed; with memory {self.memory:g} it must be below "
                             f"{1.0 / self.memory:g}")
        angle = np.linspace(0.0, np.pi, POINTS + 1)
        value = self(radius * np.exp(1j * angle), gain)
        while True:  # points are added where the argument turns fast
            with np.errstate(divide="ignore", invalid="ignore"):
                turn = np.abs(np.angle(value[1:] / value[:-1]))
            coarse = np.flatnonzero(~(turn < TURN))
            if not coarse.size:
                break
            if np.min(angle[coarse + 1] - angle[coarse]) < FINEST or not np.isfinite(value).all() or not value.all():
                raise OnCircle(f"a multiplier lies on the circle of radius {1.0 / radius:g} to rounding at the gain {gain:.12g}, "
                               "or the characteristic function is lost in rounding there; choose a larger "
                               "circle")
            middle = 0.5 * (angle[coarse] + angle[coarse + 1])
            angle = np.insert(angle, coarse + 1, middle)
            value = np.insert(value, coarse + 1, self(radius * np.exp(1j * middle), gain))
        # F is real on the real axis and F(conj mu) = conj F(mu): the lower half turns as much as the upper one
        return round(float(np.angle(value[1:] / value[:-1]).sum()) / np.pi)

    def root(self, mu: complex, gain: float) -> complex | None:
        """Return the zero of F near ``mu``, by Newton; None where it does not converge."""
        real = abs(complex(mu).imag) < 1e-9 * abs(mu)
        for _ in range(NEWTON):
            step = 1e-5 * abs(mu)
            around = np.array([mu, mu + step, mu - step])
            value, up, down = self(around, gain)
            slope = (up - down) / (2.0 * step)
            if slope == 0.0 or not np.isfinite(value):
                return None
            change = value / slope
            mu = mu - change
            if real:
                mu = complex(mu.real, 0.0)
            if abs(change) <= CLOSE * abs(mu):
                return mu
        return None

    def crossing(self, angle: float, gain: float, size: float) -> tuple[float, float, float] | None:
        """Return (angle, gain, error) where a multiplier exp(i angle) lies on the circle, by Newton from near values.

        A flip keeps the angle pi.  ``size`` is the largest gain between which and another the multiplier crosses.  The error of the
        gain is the last correction, and what the rounding of the function, of a size that it has on the circle, makes of it.
        """
        flip = abs(abs(angle) - np.pi) < 1e-6
        for _ in range(NEWTON):
            da, dk = 1e-5, 1e-5 * size
            angles = angle + np.array([0.0, da, -da, 0.0, 0.0])
            gains = gain + np.array([0.0, 0.0, 0.0, dk, -dk])
            value = self(np.exp(-1j * angles), gains)
            by_gain = (value[3] - value[4]) / (2.0 * dk)
            if flip:
                angle = np.pi
                change = np.array([0.0, (value[0] / by_gain).real])
                answer = 1.0 / abs(by_gain)
            else:
                by_angle = (value[1] - value[2]) / (2.0 * da)
                slope = np.array([[by_angle.real, by_gain.real], [by_angle.imag, by_gain.imag]])
                if not np.isfinite(slope).all() or np.linalg.matrix_rank(slope) < 2:
                    return None
                change = np.linalg.solve(slope, [value[0].real, value[0].imag])
                answer = float(np.abs(np.linalg.inv(slope)[1]).sum())
            if not np.isfinite(change).all():
                return None
            angle, gain = angle - change[0], gain - change[1]
            if abs(change[0]) <= CLOSE * 10 and abs(change[1]) <= CLOSE * 10 * size:
                around = np.abs(self(np.exp(1j * AROUND), np.full(AROUND.size, gain))).max()
                return float(angle), float(gain), float(abs(change[1])) + ROUNDING * answer * float(around)
        return None
