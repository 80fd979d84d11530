"""Linear chains of unit masses that hit a rigid stop once a period, and where their multipliers pass the unit circle.

Between impacts the motion is y_p + exp(A t) c, in closed form but for the instant of the impact, which Newton's method finds
together with the parameter (S. W. Shaw, P. J. Holmes, J. Sound Vib. 90 (1983), 129-155; A. B. Nordmark, J. Sound Vib. 145
(1991), 279-297).
"""
import mpmath as mp
import numpy as np

DIGITS = 40


class OneImpact:
    """M = 1, ``C``, ``K`` (n, n), load cos(omega t) and stop on mass ``place``; of amplitude and omega the one not given varies."""

    def __init__(self, C, K, place, gap, restitution, omega=None, amplitude=None):
        self.n, self.place, self.gap, self.restitution = len(K), place, mp.mpf(gap), mp.mpf(restitution)
        self.omega, self.amplitude, self._known = omega, amplitude, {}
        blocks = np.block([[np.zeros_like(K), np.eye(self.n)], [-np.asarray(K), -np.asarray(C)]])
        self.A = mp.matrix(blocks.tolist())

    def linear(self, omega):
        """Return response to a unit load and flow of a period."""
        if omega not in self._known:
            load = mp.zeros(2 * self.n, 1)
            load[self.n + self.place] = 1
            self._known[omega] = (mp.lu_solve(mp.mpc(0, 1) * omega * mp.eye(2 * self.n) - self.A, load),
                                  mp.expm(self.A * 2 * mp.pi / omega).apply(mp.re))
        return self._known[omega]

    def motion(self, phase, p):
        """Return what is left of the gap at the impact, and the derivative of the map of a period there."""
        i, v = self.place, self.n + self.place
        omega = mp.mpf(p if self.omega is None else self.omega)
        size = mp.mpf(p if self.amplitude is None else self.amplitude)
        response, flow = self.linear(omega)
        forced = (response * size * mp.expj(phase)).apply(mp.re)
        R = mp.eye(2 * self.n)
        R[v, v] = -self.restitution
        y = mp.lu_solve(mp.eye(2 * self.n) - flow * R, forced - flow * forced)

        def field(z):
            d = self.A * z
            d[v] += size * mp.cos(phase)
            return d
        saltation, jump = R.copy(), field(R * y) - R * field(y)
        for k in range(2 * self.n):
            saltation[k, i] += jump[k] / y[v]
        return y[i] - self.gap, flow * saltation

    def special(self, point):
        """Return the parameter at which a multiplier passes, from that of a special point."""
        orbit, (event,) = point.solution, point.solution.events
        start = [2.0 * np.pi * event.time / orbit.forcing_period, point.parameter]
        if point.kind == "neimark_sacker":
            mu = np.array([value for value in orbit.multipliers if value.imag > 1e-7])
            start.append(float(np.angle(mu[np.argmin(abs(abs(mu) - 1.0))])))

        def equations(phase, p, angle=None):
            left, M = self.motion(phase, p)
            if angle is None:
                return [left, mp.det(M - (1 if point.kind == "fold" else -1) * mp.eye(2 * self.n))]
            value = mp.det(M - mp.expj(angle) * mp.eye(2 * self.n))
            return [left, value.real, value.imag]
        with mp.workdps(DIGITS):
            return newton(equations, start)[1]


def newton(f, start):
    """Return the root of ``f`` next to ``start``, with derivatives by differences of many digits."""
    x, h = mp.matrix([mp.mpf(float(value)) for value in start]), mp.mpf(10)**-18
    for _ in range(12):
        F, J = mp.matrix(f(*x)), mp.zeros(len(x))
        for k in range(len(x)):
            beside = x.copy()
            beside[k] += h
            J[:, k] = (mp.matrix(f(*beside)) - F) / h
        step = mp.lu_solve(J, F)
        x -= step
        if mp.norm(step) < mp.mpf(10)**-28:
            return x
    raise ValueError("Newton did not converge")
