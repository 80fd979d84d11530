"""n degrees of freedom with one rigid stop: one impact in n forcing periods in closed form, multipliers, torus points.

    M q'' + C q' + K q = load cos(omega t),   q[site] <= gap,   v+ = (I - (1 + r) b c^T) v-

With z- the state before the impact at phase phi, z_p the steady state, E the unforced flow over n periods and R the
impact, z- = (I - E R)^-1 (I - E) z_p(phi): linear in (cos phi, sin phi), so q[site] = gap gives phi by one arccos.
"""
from dataclasses import dataclass

from mpmath import matrix, mp, mpf

from .oscillator import number


@dataclass(frozen=True)
class ChainOrbit:
    """Impact time in [0, T), speed and state (2 N) before it, multipliers by decreasing modulus, admissibility."""

    time: object
    speed: object
    before: object
    multipliers: tuple
    admissible: bool


class Chain:
    """M, C, K, load amplitude per degree of freedom, forcing frequency, and the stop on coordinate ``site``."""

    def __init__(self, mass, damping, stiffness, load, omega, site, gap, restitution):
        self.n = len(load)
        self.m, self.c, self.k = matrix(mass), matrix(damping), matrix(stiffness)
        self.load = matrix([number(p) for p in load])
        self.omega, self.gap, self.r = number(omega), number(gap), number(restitution)
        self.site = site
        inverse = self.m**-1
        n = self.n
        self.a = mp.zeros(2 * n)
        stiff, damp = inverse * self.k, inverse * self.c
        for i in range(n):
            self.a[i, n + i] = mpf(1)
            for j in range(n):
                self.a[n + i, j] = -stiff[i, j]
                self.a[n + i, n + j] = -damp[i, j]
        self.drive = mp.zeros(2 * n, 1)
        forced = inverse * self.load
        for i in range(n):
            self.drive[n + i] = forced[i]
        dynamic = self.k - self.omega**2 * self.m + mp.mpc(0, 1) * self.omega * self.c
        self.response = mp.lu_solve(dynamic, self.load)
        column = mp.zeros(n, 1)
        column[site] = 1
        b = inverse * column
        self.b = b / b[site]
        self.reset = mp.eye(2 * n)
        for i in range(n):
            self.reset[n + i, n + site] -= (1 + self.r) * self.b[i]
        self._values, self._right = mp.eig(self.a)
        self._left = self._right**-1

    @property
    def period(self):
        """Forcing period."""
        return 2 * mp.pi / self.omega

    def flow_matrix(self, t):
        """Unforced flow over t by eigenvectors (A is diagonalisable in the cases used)."""
        m = self._right * mp.diag([mp.exp(z * t) for z in self._values]) * self._left
        return m.apply(lambda z: z.real)

    def steady(self, t):
        """Steady response (q, v) at time t."""
        turn = mp.mpc(mp.cos(self.omega * t), mp.sin(self.omega * t))
        z = mp.zeros(2 * self.n, 1)
        for i in range(self.n):
            value = self.response[i] * turn
            z[i], z[self.n + i] = value.real, (mp.mpc(0, 1) * self.omega * value).real
        return z

    def flow(self, t0, z0, t):
        """State at time t of the motion at z0 at time t0."""
        return self.steady(t) + self.flow_matrix(t - t0) * (z0 - self.steady(t0))

    def rate(self, t, z):
        """Time derivative of the state."""
        return self.a * z + self.drive * mp.cos(self.omega * t)

    def saltation(self, t, before):
        """Saltation matrix of the impact."""
        after = self.reset * before
        f0, f1 = self.rate(t, before), self.rate(t, after)
        jump = (f1 - self.reset * f0) / before[self.n + self.site]
        s = self.reset.copy()
        for i in range(2 * self.n):
            s[i, self.site] += jump[i]
        return s

    def grazing_scale(self):
        """Factor of the load at which the steady response touches the stop."""
        return self.gap / abs(self.response[self.site])

    def orbits(self, n=1, samples=600):
        """All n-1 orbits with positive impact speed, by increasing speed."""
        size = 2 * self.n
        e = self.flow_matrix(n * self.period)
        pull = (mp.eye(size) - e * self.reset) ** -1 * (mp.eye(size) - e)
        cosine = pull * self.steady(0)
        sine = pull * self.steady(self.period / 4)
        a, b = cosine[self.site], sine[self.site]
        if mp.hypot(a, b) < self.gap:
            return []
        lag, open_ = mp.atan2(b, a), mp.acos(self.gap / mp.hypot(a, b))
        found = []
        for phi in (lag - open_, lag + open_):
            before = cosine * mp.cos(phi) + sine * mp.sin(phi)
            speed = before[self.n + self.site]
            if speed <= 0:
                continue
            t = (phi % (2 * mp.pi)) / self.omega
            values, _ = mp.eig(e * self.saltation(t, before))
            values = sorted(values, key=lambda z: (-abs(z), -mp.im(z)))
            found.append(ChainOrbit(t, speed, before, tuple(values), self._free(t, self.reset * before, n, samples)))
        return sorted(found, key=lambda o: o.speed)

    def at_phase_zero(self, orbit):
        """Return the state (2 n,) of floats a forcing period after phase 0 of an orbit with one impact a period."""
        after = self.reset * orbit.before
        after[self.site] = self.gap
        return [float(z) for z in self.flow(orbit.time, after, self.period)]

    def _free(self, t, after, n, samples):
        """Dense check that the arc stays inside; interior maxima refined."""
        span = n * self.period
        step = self.flow_matrix(span / samples)
        z = after - self.steady(t)
        previous = None
        for i in range(1, samples):
            z = step * z
            s = t + span * i / samples
            now = z + self.steady(s)
            if now[self.site] >= self.gap:
                return False
            speed = now[self.n + self.site]
            if previous is not None and previous[1] > 0 >= speed:
                top = mp.findroot(lambda u, s=s, z=now: self.flow(s, z, u)[self.n + self.site],
                                  (s - span / samples, s), solver="anderson", tol=mpf(10) ** -20)
                if self.flow(s, now, top)[self.site] >= self.gap:
                    return False
            previous = (s, speed)
        return True


def spring_chain(n, omega, force, restitution, gap=1, damping_ratio="0.1", stiffness=1, damping=None):
    """Unit masses wall-1-2-...-n with unit springs, free end loaded by force cos(omega t) and stopped; C = ratio K."""
    k = mp.zeros(n)
    for i in range(n):
        k[i, i] = 2 * number(stiffness) if i < n - 1 else number(stiffness)
        if i:
            k[i, i - 1] = k[i - 1, i] = -number(stiffness)
    load = [0] * (n - 1) + [force]
    c = number(damping_ratio) * k if damping is None else matrix(damping)
    return Chain(mp.eye(n), c, k, load, omega, n - 1, gap, restitution)


def torus_loads(n_masses, omega, restitution, guesses, gap=1, damping_ratio="0.1", upper=True):
    """Loads at which the leading complex pair of the 1-1 branch has modulus one (secant in mpmath from each guess)."""
    def test(f):
        orbit = spring_chain(n_masses, omega, f, restitution, gap, damping_ratio).orbits(samples=2)[-1 if upper else 0]
        complex_ones = [abs(z) for z in orbit.multipliers if abs(mp.im(z)) > mpf(10) ** -10]
        return max(complex_ones) - 1

    return [mp.findroot(test, (number(g), number(g) * (1 + mpf(10) ** -4)), solver="secant", tol=mpf(10) ** -40)
            for g in guesses]
