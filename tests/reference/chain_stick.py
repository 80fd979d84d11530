"""A chain of masses of which one comes to rest on its stop: release map, its fixed point and multipliers, in mpmath.

While held, the other masses move with the held coordinate frozen; release is where the free acceleration of the held
coordinate falls through zero.  The state at release has 2 N - 3 free numbers and the time, so two of the 2 N
multipliers of the periodic orbit vanish and the others are those of the release map.
"""
from dataclasses import dataclass

from mpmath import matrix, mp, mpf

from .chain import Chain


@dataclass(frozen=True)
class StickOrbit:
    """Times of release, first impact, and rest; state at release; the multipliers that do not vanish."""

    release: object
    first_impact: object
    rest: object
    next_release: object
    state: object
    impacts: int
    multipliers: tuple


class HeldChain:
    """A chain in both its modes: all masses free, and with coordinate ``site`` held on the stop."""

    def __init__(self, mass, damping, stiffness, load, omega, site, gap, restitution):
        self.free = Chain(mass, damping, stiffness, load, omega, site, gap, restitution)
        f = self.free
        keep = [i for i in range(f.n) if i != site]
        self.keep = keep
        cut = [[f.m[i, j] for j in keep] for i in keep], [[f.c[i, j] for j in keep] for i in keep], \
            [[f.k[i, j] for j in keep] for i in keep]
        self.held = Chain(*cut, [f.load[i] for i in keep], omega, 0, gap, restitution)
        constant = matrix([-f.k[i, site] * f.gap for i in keep])
        self.shift = mp.lu_solve(self.held.k, constant)  # equilibrium of the rest of the chain

    def held_state(self, t0, z0, t):
        """Full state at t of the motion held since t0."""
        n, k = self.free.n, self.keep
        small = matrix([z0[i] for i in k] + [z0[n + i] for i in k])
        for i in range(len(k)):
            small[i] -= self.shift[i]
        moved = self.held.flow(t0, small, t)
        z = mp.zeros(2 * n, 1)
        z[self.free.site] = self.free.gap
        for i, j in enumerate(k):
            z[j], z[n + j] = moved[i] + self.shift[i], moved[len(k) + i]
        return z

    def push(self, t, z):
        """Free acceleration of the held coordinate."""
        return self.free.rate(t, z)[self.free.n + self.free.site]

    def first(self, function, t0, t1, samples, skip=False):
        """First rise of function(t) through zero on (t0, t1] on a sample grid, refined by bisection and secant."""
        step = (t1 - t0) / samples
        low, below = t0, True if skip else function(t0) < 0
        for i in range(1, samples + 1):
            high = t0 + i * step
            value = function(high)
            if value >= 0 and below:
                return mp.findroot(function, (low, high), solver="anderson", tol=mpf(10) ** (-2 * mp.dps + 20),
                                   maxsteps=200, verify=False)
            low, below = high, value < 0
        return None

    def release_map(self, t, z, tiny=None):
        """From a release to the next: (first impact, rest, release, state at it, number of impacts)."""
        tiny = mpf(10) ** (-mp.dps // 3) if tiny is None else tiny
        f = self.free
        n, s = f.n, f.site
        first, count, surface, span = None, 0, True, f.period
        while True:
            v = -z[n + s]
            push = self.push(t, z)
            if count and push > 0 and v < push * span / 5000:
                guess = 2 * v / push
                hit = t + mp.findroot(lambda d, t=t, z=z: (f.flow(t, z, t + d)[s] - f.gap) / d,
                                      (guess, guess * mpf("1.001")), solver="secant", tol=mpf(10) ** (-2 * mp.dps + 20),
                                      maxsteps=100, verify=False)
            else:
                hit = self.first(lambda u, t=t, z=z: f.flow(t, z, u)[s] - f.gap, t, t + span, 600, skip=surface)
            z = f.flow(t, z, hit)
            t, speed = hit, z[n + s]
            count += 1
            first = t if first is None else first
            z = f.reset * z
            z[s] = f.gap
            surface = True
            push = self.push(t, z)
            if push > 0 and (f.r == 0 or speed < tiny):
                left = 0 if f.r == 0 else 2 * f.r * speed / (push * (1 - f.r))
                rest = t + left
                z = f.flow(t, z, t) if left == 0 else self._carried(t, z, rest)
                break
        out = self.first(lambda u: -self.push(u, self.held_state(rest, z, u)), rest, rest + span, 600)
        return first, rest, out, self.held_state(rest, z, out), count

    def _carried(self, t, z, rest):
        """Close the sequence: the other masses move on as if held (error of the order of the closed impulse)."""
        z = z.copy()
        z[self.free.n + self.free.site] = 0
        return self.held_state(t, z, rest)

    def orbit(self, t, z, rounds=8):
        """Fixed point of the release map (release returns after one period) by iteration and Newton, two masses."""
        f = self.free
        other = self.keep[0]
        n = f.n

        def state(time, v):
            q = self._on_release(time, v)
            y = mp.zeros(2 * n, 1)
            y[f.site], y[other], y[n + other] = f.gap, q, v
            return y

        def image(time, v):
            out = self.release_map(time, state(time, v))
            return out[2] - f.period, out[3][n + other], out

        v = z[n + other]
        for _ in range(rounds):
            t, v, _ = image(t, v)
        h = mpf(10) ** (-mp.dps // 4)
        for _ in range(12):
            t1, v1, out = image(t, v)
            at, av, _ = image(t + h, v)
            bt, bv, _ = image(t - h, v)
            ct, cv, _ = image(t, v + h)
            dt, dv, _ = image(t, v - h)
            jac = matrix([[(at - bt) / (2 * h), (ct - dt) / (2 * h)], [(av - bv) / (2 * h), (cv - dv) / (2 * h)]])
            step = mp.lu_solve(mp.eye(2) - jac, matrix([t1 - t, v1 - v]))
            t, v = t + step[0], v + step[1]
            if mp.norm(step) < mpf(10) ** (-mp.dps // 2):
                break
        values = sorted(mp.eig(jac)[0], key=lambda x: -mp.im(x))
        return StickOrbit(t, out[0], out[1], out[2], state(t, v), out[4], tuple(values))

    def _on_release(self, time, v):
        """Position of the other mass at which the free acceleration of the held one vanishes."""
        f, other, n = self.free, self.keep[0], self.free.n
        y = mp.zeros(2 * n, 1)
        y[f.site], y[n + other] = f.gap, v
        base = self.push(time, y)
        y[other] = 1
        return -base / (self.push(time, y) - base)


def two_mass(restitution, omega="0.4", force="1.2", gap="0.3", damping_ratio="0.2"):
    """The two-mass example: M = I, K = [[2, -1], [-1, 1]], C = ratio K, load on the second mass, stop on the first."""
    k = matrix([[2, -1], [-1, 1]])
    return HeldChain(mp.eye(2), mpf(damping_ratio) * k, k, [0, force], omega, 0, gap, restitution)
