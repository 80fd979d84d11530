"""Oscillator with a hysteretic damper a second time: half-period map of the symmetric motion, from the virgin curve alone.

The sliders are not marched.  On the way down from a maximum X the damper follows Masing's curve F(X) - 2 F((X - x)/2), F the
virgin curve, straight between its corners, so that the motion is known in closed form from corner to corner.  The unknowns are
X and the phase of the load at the maximum; after half a period x = -X and v = 0.
"""
import numpy as np
from scipy.optimize import brentq, minimize_scalar, root


class Damped:
    """M x'' + C x' + K x + damper = F cos(omega t) with a virgin curve of corners ``u`` (k,), slopes ``slopes`` (k + 1,)."""

    def __init__(self, M, C, K, F, u, slopes):
        self.M, self.C, self.K, self.F, self.u, self.slopes = M, C, K, F, np.asarray(u, float), np.asarray(slopes, float)
        corners = np.concatenate(([0.0], self.u))
        self.forces = np.concatenate(([0.0], np.cumsum(self.slopes[:-1] * np.diff(corners))))

    def virgin(self, x):
        """Return the virgin force at x >= 0."""
        j = np.searchsorted(self.u, x, side="right")
        corners = np.concatenate(([0.0], self.u))
        return self.forces[j] + self.slopes[j] * (x - corners[j])

    def fall(self, omega, X, phase):
        """Return x and v half a period after the maximum X, at which the load has this phase."""
        M, C, half = self.M, self.C, np.pi / omega
        corners = np.concatenate(([0.0], self.u))
        t, x, v = 0.0, X, 0.0
        top = self.virgin(X)
        for j, slope in enumerate(self.slopes):
            # damper = top - 2 forces_j - slope ((X - x) - 2 corner_j)
            constant = top - 2.0 * self.forces[j] - slope * (X - 2.0 * corners[j])
            k = self.K + slope
            particular = self.F / (k - M * omega**2 + 1j * C * omega)
            a = 0.5 * C / M
            b = np.sqrt(k / M - a * a)

            def motion(s, t=t, x=x, v=v, constant=constant, k=k, particular=particular, a=a, b=b):
                forced = particular * np.exp(1j * (omega * (t + s) + phase))
                start = particular * np.exp(1j * (omega * t + phase))
                c = x + constant / k - start.real
                d = (v - (1j * omega * start).real + a * c) / b
                wave, other = np.cos(b * s), np.sin(b * s)
                decay = np.exp(-a * s)
                return (forced.real - constant / k + decay * (c * wave + d * other),
                        (1j * omega * forced).real + decay * (-a * (c * wave + d * other) + b * (d * wave - c * other)))

            left = half - t
            if j < len(self.u):
                target = X - 2.0 * self.u[j]
                grid = np.linspace(0.0, left, 400)
                below = np.flatnonzero(motion(grid)[0][1:] < target)
                if below.size:
                    i = below[0]
                    s = brentq(lambda s, motion=motion, target=target: motion(s)[0] - target, grid[i], grid[i + 1],
                               xtol=1e-16, rtol=1e-15)
                    x, v = target, motion(s)[1]
                    t += s
                    continue
            x, v = motion(left)
            return x, v
        raise AssertionError

    def linearised(self, omega):
        """Return X and phase of the motion with the damper's first harmonic, the largest of up to several."""
        turn = np.linspace(0.0, np.pi, 2001)
        x = np.cos(turn)

        def load(X):
            force = self.virgin(X) - 2.0 * self.virgin(0.5 * X * (1.0 - x))
            first = 2.0 / np.pi * np.trapezoid(force * np.exp(-1j * turn), turn)
            return (self.K - self.M * omega**2 + 1j * self.C * omega) * X + first

        sizes = np.geomspace(1e-3, 3.0, 300)
        gaps = np.array([abs(load(X)) - self.F for X in sizes])
        i = np.flatnonzero((gaps[:-1] < 0.0) & (gaps[1:] >= 0.0))[-1]
        X = brentq(lambda X: abs(load(X)) - self.F, sizes[i], sizes[i + 1])
        return X, np.angle(load(X))

    def amplitude(self, omega, guess=None):
        """Return X and the phase of the load at the maximum."""
        guess = self.linearised(omega) if guess is None else guess

        def rest(y):
            x, v = self.fall(omega, y[0], y[1])
            return [x + y[0], v / omega]

        found = root(rest, guess, tol=1e-13)
        assert np.abs(rest(found.x)).max() < 1e-10, (omega, found)
        return found.x

    def peak(self, low, high):
        """Return the frequency and size of the largest amplitude between two frequencies."""
        grid = np.linspace(low, high, 25)
        sizes = [self.linearised(omega)[0] for omega in grid]
        i = int(np.clip(np.argmax(sizes), 1, 23))
        found = minimize_scalar(lambda omega: -self.amplitude(omega)[0], bracket=(grid[i - 1], grid[i], grid[i + 1]), tol=1e-9)
        return found.x, -found.fun


def damped(normal_load, damper, n=15, contact=18.328497, span=3.0, friction=0.5):
    """Return the damped oscillator of Zhao & Lin 2015, section 4; strip with equal loads, its corners from static solves."""
    spring = contact * (n / span) ** 2
    K = spring * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0] = K[-1, -1] = spring
    limit = friction * normal_load / n
    u, slopes = [], []
    for slipping in range(n + 1):  # with equal loads the blocks slip one after the other from the driven one
        stuck = contact * (np.arange(n) >= slipping)
        push = np.zeros(n)
        push[:slipping] = -limit
        inner = np.linalg.solve(K[1:, 1:] + np.diag(stuck[1:]), np.stack((-K[1:, 0], push[1:]), axis=1))
        slopes.append(K[0, 0] + stuck[0] + K[0, 1:] @ inner[:, 0])
        if slipping == 0:
            u.append(limit / contact)
        elif slipping < n:
            u.append((limit / contact - inner[slipping - 1, 1]) / inner[slipping - 1, 0])
    slopes[-1] = 0.0
    if damper == "macro":
        u, slopes = [friction * normal_load / slopes[0]], [slopes[0], 0.0]
    return Damped(1.07, 0.562, 1e4, 100.0, u, slopes)
