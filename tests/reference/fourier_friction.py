"""Exact steady motion of the dry-friction oscillator by Newton on the half-period map, and its Fourier coefficients.

x'' + 2 xi x' + x + beta Sgn(x') = alpha sin(omega t) in physical time.  Between events the motion is elementary; events
are roots on a grid of phases, refined by bisection and Newton of scipy.  Coefficients are Gauss-Legendre integrals over the
arcs.  Nothing is shared with the package, and nothing waits for transients: Newton's method works on y(T/2) = -y(0).
"""
import numpy as np
from scipy.optimize import brentq

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


class SteadyFriction:
    """The half-wave symmetric orbit.

    Parameters
    ----------
    omega, xi, alpha, beta : float
        As in the equation above.
    start : (float, float)
        Guess of x and x' at t = 0.
    iterations : int
        Limit of Newton steps.

    Attributes
    ----------
    state : ndarray (2,)
    arcs : list of (t0, t1, x0, v0, sign)
        Of the half period; sign 0 is stick.
    closure : float
        |y(T/2) + y(0)|.
    """

    def __init__(self, omega, xi, alpha, beta=1.0, start=(0.0, 0.0), iterations=40):
        self.omega, self.xi, self.alpha, self.beta = omega, xi, alpha, beta
        self.wd = np.sqrt(1.0 - xi * xi)
        if omega == 1.0 and xi == 0.0:
            self.gain = None  # resonance: the response grows with time, see `forced`
        else:
            self.gain = -1j * alpha / complex(1.0 - omega**2, 2.0 * xi * omega)
        self.half = np.pi / omega
        y = np.array(start, float)
        best, self.closure = y, np.inf
        for _ in range(iterations):
            f = self.map(y) + y
            size = np.abs(f).max()
            if size < self.closure:
                best, self.closure = y, size
            if size < 1e-14 * max(1.0, np.abs(y).max()):
                break
            step = 1e-7 * max(np.abs(y).max(), 1e-7)
            jac = np.eye(2)
            for i in range(2):
                e = step * np.eye(2)[i]
                jac[:, i] += (self.map(y + e) - self.map(y - e)) / (2.0 * step)
            y = y - np.linalg.solve(jac, f)
            if np.abs(self.map(y) + y).max() > size:  # the map contracts: fall back on it
                for _ in range(5):
                    y = -self.map(-self.map(best))
        self.state = best
        self.map(best)

    def forced(self, t):
        """Particular solution without friction, and its derivative."""
        if self.gain is None:  # x'' + x = alpha sin t
            return -0.5 * self.alpha * t * np.cos(t), 0.5 * self.alpha * (t * np.sin(t) - np.cos(t))
        z = self.gain * np.exp(1j * self.omega * t)
        return z.real, (1j * self.omega * z).real

    def arc(self, t, t0, x0, v0, sign):
        """Displacement and velocity on an arc."""
        if sign == 0:
            return np.full(np.shape(t), x0), np.zeros(np.shape(t))
        p0, dp0 = self.forced(t0)
        a = x0 - p0 + sign * self.beta
        b = (v0 - dp0 + self.xi * a) / self.wd
        e, c, s = np.exp(-self.xi * (t - t0)), np.cos(self.wd * (t - t0)), np.sin(self.wd * (t - t0))
        p, dp = self.forced(t)
        return (e * (a * c + b * s) + p - sign * self.beta,
                e * ((self.wd * b - self.xi * a) * c - (self.wd * a + self.xi * b) * s) + dp)

    def map(self, y):
        """March half a period from t = 0; fills `arcs`."""
        t, x, v = 0.0, float(y[0]), float(y[1])
        self.arcs = []
        sign = int(np.sign(v)) if v else self.entered(t, x)
        count = 3000
        while True:
            grid = np.linspace(t, self.half, max(8, int(count * (self.half - t) / self.half)))
            if sign == 0:
                def leaves(at, x=x):
                    return np.abs(self.alpha * np.sin(self.omega * at) - x) - self.beta
                value = leaves(grid)
            else:
                def leaves(at, t=t, x=x, v=v, sign=sign):
                    return -sign * self.arc(at, t, x, v, sign)[1]
                value = leaves(grid)
            value[0] = -1.0
            if v == 0.0 and sign and value[1] >= 0.0:  # a slip shorter than the grid
                grid = np.concatenate([[t], t + (grid[1] - t) * np.logspace(-8, 0, 60)])
                value = leaves(grid)
                value[0] = -1.0
                if value[1] >= 0.0:
                    raise RuntimeError("no departure")
            out = np.flatnonzero(value >= 0.0)
            if not len(out):
                self.arcs.append((t, self.half, x, v, sign))
                x, v = (float(z) for z in self.arc(self.half, t, x, v, sign))
                return np.array([x, v])
            i = out[0]
            left = grid[i - 1]
            if leaves(left) >= 0.0:  # only at the start of an arc
                left = t + 1e-9 * (grid[i] - t)
            at = brentq(leaves, left, grid[i], xtol=1e-15, rtol=8.9e-16) if leaves(left) < 0.0 else grid[i]
            self.arcs.append((t, at, x, v, sign))
            x = float(self.arc(at, t, x, v, sign)[0])
            was, t, v = sign, at, 0.0
            sign = int(np.sign(self.alpha * np.sin(self.omega * t) - x)) if was == 0 else self.entered(t, x)

    def entered(self, t, x):
        """Sign of the motion that follows rest at t; 0 for stick."""
        demand = self.alpha * np.sin(self.omega * t) - x
        return 0 if abs(demand) <= self.beta else int(np.sign(demand))

    def integrals(self, harmonics, velocity=False, pieces=None):
        """Return phasors a - ib of x (or x') for odd harmonics, (len,), by quadrature over the arcs."""
        harmonics = np.asarray(harmonics)
        total = np.zeros(len(harmonics), complex)
        for t0, t1, x0, v0, sign in self.arcs:
            parts = pieces or 2 + int((t1 - t0) * max(self.omega * harmonics.max(), 1.0) / 3.0)
            edges = np.linspace(t0, t1, parts + 1)
            h = 0.5 * np.diff(edges)[:, None]
            t = (0.5 * (edges[1:] + edges[:-1])[:, None] + h * NODES).ravel()
            w = (h * WEIGHTS).ravel()
            total += np.exp(-1j * self.omega * np.multiply.outer(harmonics, t)) @ (w * self.arc(t, t0, x0, v0, sign)[velocity])
        return np.where(harmonics % 2 == 1, total * 2.0 / self.half, 0.0)

    def mean_square(self):
        """Return the mean of x'^2."""
        total = 0.0
        for t0, t1, x0, v0, sign in self.arcs:
            edges = np.linspace(t0, t1, 2 + int((t1 - t0) * max(self.omega, 1.0)))
            h = 0.5 * np.diff(edges)[:, None]
            t = (0.5 * (edges[1:] + edges[:-1])[:, None] + h * NODES).ravel()
            total += (h * WEIGHTS).ravel() @ self.arc(t, t0, x0, v0, sign)[1] ** 2
        return total / self.half

    def velocity_error(self, phasors):
        """Return the relative rms error of a velocity given by phasors of harmonics 0 .. H, by Parseval."""
        harmonics = np.arange(1, len(phasors), 2)
        c = self.integrals(harmonics, velocity=True)
        exact = self.mean_square()
        lost = exact - 0.5 * np.sum(np.abs(c) ** 2)
        wrong = 0.5 * np.sum(np.abs(phasors[1::2] - c) ** 2) + 0.5 * np.sum(np.abs(phasors[2::2]) ** 2) + abs(phasors[0]) ** 2
        return float(np.sqrt(max(lost, 0.0) + wrong) / np.sqrt(exact)), float(np.sqrt(max(lost, 0.0) / exact))
