"""Exact motion of a linear oscillator with one harmonic load, with a rigorous search for its first arrival at a level.

    x'' + 2 zeta x' + stiffness x = force cos(omega t + phase) + constant

Everything is closed form in mpmath.  Under-, over- and undamped, resonant (zeta = 0, omega**2 = stiffness) and free
(stiffness = 0) oscillators are covered.
"""
from dataclasses import dataclass, replace

from mpmath import mp, mpc, mpf

mp.dps = 40


def number(value):
    """Return the value as an mpf: a string is read as the decimal number, a float as the binary number it is."""
    return mpf(value)


@dataclass(frozen=True)
class Oscillator:
    """One degree of freedom between impacts; all fields dimensionless and of mpmath type after construction."""

    zeta: object
    omega: object
    force: object
    stiffness: object = 1
    constant: object = 0
    phase: object = 0

    def __post_init__(self):
        for name in ("zeta", "omega", "force", "stiffness", "constant", "phase"):
            object.__setattr__(self, name, number(getattr(self, name)))

    def with_(self, **changes):
        """Return a copy with some fields changed."""
        return replace(self, **changes)

    @property
    def period(self):
        """Forcing period 2 pi / omega."""
        return 2 * mp.pi / self.omega

    @property
    def resonant(self):
        """Whether the steady response is unbounded."""
        return self.zeta == 0 and self.stiffness == self.omega**2

    @property
    def receptance(self):
        """Complex response x = Re(receptance force e^{i(omega t + phase)}) to a unit load."""
        return 1 / mpc(self.stiffness - self.omega**2, 2 * self.zeta * self.omega)

    @property
    def amplitude(self):
        """Amplitude of the steady response."""
        return abs(self.force * self.receptance)

    def load(self, t):
        """Load force cos(omega t + phase) + constant, and its first derivative in time."""
        angle = self.omega * t + self.phase
        return self.force * mp.cos(angle) + self.constant, -self.force * self.omega * mp.sin(angle)

    def particular(self, t):
        """One solution (x, v) at time t: the steady response where there is one."""
        angle = self.omega * t + self.phase
        if self.resonant:
            half = self.force / (2 * self.omega)
            x, v = half * t * mp.sin(angle), half * (mp.sin(angle) + self.omega * t * mp.cos(angle))
        else:
            z = self.force * self.receptance * mpc(mp.cos(angle), mp.sin(angle))
            x, v = z.real, -self.omega * z.imag
        if self.stiffness != 0:
            x = x + self.constant / self.stiffness
        elif self.zeta == 0:
            x, v = x + self.constant * t**2 / 2, v + self.constant * t
        else:
            x, v = x + self.constant * t / (2 * self.zeta), v + self.constant / (2 * self.zeta)
        return x, v

    def homogeneous(self, t):
        """Matrix (e11, e12, e21, e22) of the unforced flow over a time t."""
        root = mp.sqrt(mpc(self.zeta**2 - self.stiffness))
        if root == 0:
            decay = mp.exp(-self.zeta * t)
            c, s = decay, decay * t
        else:
            decay = mp.exp(-self.zeta * t)
            c, s = (decay * mp.cosh(root * t)).real, (decay * mp.sinh(root * t) / root).real
        return c + self.zeta * s, s, -self.stiffness * s, c - self.zeta * s

    def flow(self, t0, x0, v0, t):
        """State (x, v) at time t of the motion that is at (x0, v0) at time t0."""
        a, b = self.particular(t0)
        p, q = self.particular(t)
        e11, e12, e21, e22 = self.homogeneous(t - t0)
        return p + e11 * (x0 - a) + e12 * (v0 - b), q + e21 * (x0 - a) + e22 * (v0 - b)

    def acceleration(self, t, x, v):
        """x'' at a state."""
        return self.load(t)[0] - 2 * self.zeta * v - self.stiffness * x

    def bounds(self, t0, x0, v0, t1):
        """Bounds on |x''| and |x'''| over [t0, t1], from the energy of the motion that starts at (x0, v0)."""
        p, q = self.particular(t0)
        span = t1 - t0
        if self.stiffness > 0 and not self.resonant:
            energy = mp.sqrt((v0 - q) ** 2 + self.stiffness * (x0 - p) ** 2)  # of the homogeneous part; never grows
            steady = self.amplitude
            x = energy / mp.sqrt(self.stiffness) + steady + abs(self.constant / self.stiffness)
            v = energy + steady * self.omega
        else:
            v = abs(v0) + (abs(self.force) + abs(self.constant) + self.stiffness * abs(x0)) * span
            v = v * mp.exp(self.stiffness * span**2 / 2 + 1)
            x = abs(x0) + v * span
        second = abs(self.force) + abs(self.constant) + 2 * self.zeta * v + self.stiffness * x
        third = abs(self.force) * self.omega + 2 * self.zeta * second + self.stiffness * v
        return second, third


def first_arrival(motion, t0, x0, v0, t1, level, side=1, from_surface=False, smallest=None):
    """First time in (t0, t1] at which side * (x - level) rises through zero, or None.

    Rigorous up to rounding in 40 digits: an interval [a, b] is dismissed when the chord plus M2 (b - a)^2 / 8 is
    negative; searched by bisection when the motion is monotone on it; split at its maximum when it is concave.
    Touches from inside (a maximum exactly at the level) are not arrivals.

    Parameters
    ----------
    motion : Oscillator
    t0, x0, v0 : start; with ``from_surface`` the start lies on the level and its trivial root does not count
    t1 : end of the search
    level, side : the guard is side * (x - level), negative inside
    smallest : intervals shorter than this, not yet decided, are taken as free of arrivals (1e-25)
    """
    second, third = motion.bounds(t0, x0, v0, t1)
    smallest = mpf(10) ** -25 if smallest is None else smallest

    def gap(t):
        x, v = motion.flow(t0, x0, v0, t)
        return side * (x - level), side * v

    def concave(a, b):
        middle = (a + b) / 2
        x, v = motion.flow(t0, x0, v0, middle)
        return side * motion.acceleration(middle, x, v) + third * (b - a) / 2 < 0

    def root(a, b):
        """Zero of the rising guard between a (negative) and b (not negative)."""
        t = b
        for _ in range(400):
            g, dg = gap(t)
            if g < 0:
                a = t
            else:
                b = t
            new = t - g / dg if dg != 0 else (a + b) / 2
            if not a < new < b:
                new = (a + b) / 2
            if abs(new - t) <= mpf(10) ** (6 - mp.dps) * max(1, abs(t)):
                return new
            t = new
        return t

    def search(a, b, ga, dga, gb, dgb, start):
        """First arrival in (a, b]; ga < 0, or start is true and ga = 0 with the motion leaving."""
        width = b - a
        if width < smallest:
            return None
        inside = ga < 0 or start
        if gb < 0 and inside:
            if start:
                if concave(a, b) and dga <= 0:
                    return None
                if max(dga, dgb) + second * width / 2 < 0:  # falls all the way
                    return None
            elif max(ga, gb) + second * width**2 / 8 < 0:
                return None
            elif concave(a, b) and (dga <= 0 or dgb >= 0):
                return None
        if gb >= 0 and ga < 0 and min(dga, dgb) - second * width / 2 > 0:
            return root(a, b)
        middle = (a + b) / 2
        gm, dgm = gap(middle)
        found = search(a, middle, ga, dga, gm, dgm, start)
        if found is not None:
            return found
        if gm >= 0 and not start:
            return root(a, middle)
        return search(middle, b, gm, dgm, gb, dgb, False)

    pieces = 8
    grid = [t0 + (t1 - t0) * i / pieces for i in range(pieces + 1)]
    values = [(mpf(0), side * v0) if from_surface else (side * (x0 - level), side * v0)]
    values += [gap(t) for t in grid[1:]]
    for i in range(pieces):
        found = search(grid[i], grid[i + 1], *values[i], *values[i + 1], from_surface and i == 0)
        if found is not None:
            return found
        if values[i + 1][0] >= 0:
            return root(grid[i], grid[i + 1])
    return None


def highest(motion, t0, x0, v0, t1, side=1, samples=400):
    """Largest interior maximum of side * x in (t0, t1), from dense samples, refined.  Returns (value, time)."""
    times = [t0 + (t1 - t0) * i / mpf(samples) for i in range(samples + 1)]
    states = [motion.flow(t0, x0, v0, t) for t in times]
    best = (-mp.inf, None)
    for i in range(samples):
        a, b = times[i], times[i + 1]
        if side * states[i][1] > 0 >= side * states[i + 1][1]:
            for _ in range(150):
                m = (a + b) / 2
                if side * motion.flow(t0, x0, v0, m)[1] > 0:
                    a = m
                else:
                    b = m
            value = side * motion.flow(t0, x0, v0, a)[0]
            if value > best[0]:
                best = (value, a)
    return best
