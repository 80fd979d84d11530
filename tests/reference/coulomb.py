"""Den Hartog's oscillator in closed form, and an event-driven integrator that shares nothing with the package.

x'' + 2 xi x' + x + beta Sgn(x') = alpha sin(Omega t), in the phase tau = Omega t.  Between events the motion is the
elementary solution, written out here; events are the roots of smooth functions, bracketed on a grid and refined.
"""
import mpmath as mp
import numpy as np
from scipy.optimize import brentq


class SlipOnly:
    """The symmetric orbit whose stops are instants (Den Hartog 1931 with viscous damping), in 30 digits.

    The descending half cycle, with th = tau from the maximum and wd = sqrt(1 - xi^2) / Omega, is
    x = beta + e^(-xi th/Omega) (A cos wd th + B sin wd th) + alpha D sin(th + chi), with h(0) + h(pi) = -2 beta and
    h'(0) + h'(pi) = 0 for its decaying part h.

    Attributes
    ----------
    x_max : mpf
        Amplitude X.
    tau_max : mpf
        Phase at which x is largest; 0 <= tau_max < 2 pi.
    alpha_stick : mpf
        Least alpha without stick just after a reversal; an interior limit may be higher, see `interior`.
    """

    def __init__(self, omega, xi, alpha, beta=1):
        with mp.workdps(30):
            W, xi, alpha, beta = (mp.mpf(repr(v)) if isinstance(v, float) else mp.mpf(v) for v in (omega, xi, alpha, beta))
            self.W, self.xi, self.alpha, self.beta = W, xi, alpha, beta
            self.wd, self.loss = mp.sqrt(1 - xi**2) / W, xi / W
            e, c, s = mp.exp(-self.loss * mp.pi), mp.cos(self.wd * mp.pi), mp.sin(self.wd * mp.pi)
            wd, d = self.wd, self.loss
            # h(0) = A, h(pi) = e (A c + B s); h' = e^(-d th) ((B wd - d A) cos - (A wd + d B) sin)
            self.A, self.B = mp.lu_solve(
                mp.matrix([[1 + e * c, e * s], [-d - e * (d * c + wd * s), wd + e * (wd * c - d * s)]]),
                mp.matrix([-2 * beta, 0]))
            self.D = 1 / mp.sqrt((1 - W**2) ** 2 + (2 * xi * W) ** 2)
            self.slope0 = wd * self.B - d * self.A
            self.curve0 = (d**2 - wd**2) * self.A - 2 * d * wd * self.B
            self.alpha_stick = mp.sqrt(self.slope0**2 + self.curve0**2) / self.D
            cosine = -self.slope0 / (alpha * self.D)
            if abs(cosine) > 1:
                raise ValueError("no slip-only orbit: alpha is too small")
            self.chi = mp.acos(cosine)  # sin chi > 0
            self.x_max = beta + self.A + alpha * self.D * mp.sin(self.chi)
            lag = mp.atan2(2 * xi * W, 1 - W**2)  # x of the load alone is alpha D sin(tau - lag)
            self.tau_max = mp.fmod(lag + self.chi, 2 * mp.pi)
            if self.tau_max < 0:
                self.tau_max += 2 * mp.pi

    def descending(self, th):
        """Return x, dx/dtau and d2x/dtau2 at ``th`` from the maximum, 0 <= th <= pi."""
        e, c, s = mp.exp(-self.loss * th), mp.cos(self.wd * th), mp.sin(self.wd * th)
        A, B, d, wd = self.A, self.B, self.loss, self.wd
        a1, b1 = wd * B - d * A, -wd * A - d * B
        a2, b2 = wd * b1 - d * a1, -wd * a1 - d * b1
        forced = self.alpha * self.D
        return (self.beta + e * (A * c + B * s) + forced * mp.sin(th + self.chi),
                e * (a1 * c + b1 * s) + forced * mp.cos(th + self.chi),
                e * (a2 * c + b2 * s) - forced * mp.sin(th + self.chi))

    def state(self, tau):
        """Return x and dx/dtau at the phase ``tau``."""
        with mp.workdps(30):
            th = mp.fmod(mp.mpf(tau) - self.tau_max, 2 * mp.pi)
            th = th + 2 * mp.pi if th < 0 else th
            sign = 1 if th <= mp.pi else -1
            x, v, _ = self.descending(th if sign > 0 else th - mp.pi)
            return sign * x, sign * v

    def velocity_coefficients(self, harmonics):
        """Return complex c_n, dx/dtau = sum of c_n e^(i n tau) over odd n and -n; integrals in closed form."""
        found = []
        with mp.workdps(30):
            power = mp.mpc(-self.loss, self.wd)  # h' = Re(z e^(power th))
            a1, b1 = self.wd * self.B - self.loss * self.A, -self.wd * self.A - self.loss * self.B
            z = mp.mpc(a1, -b1)
            for n in harmonics:
                if n % 2 == 0:
                    found.append(0j)
                    continue
                total = mp.mpc(0)
                for weight, rate in ((z / 2, power), (mp.conj(z) / 2, mp.conj(power)),
                                     (self.alpha * self.D * mp.expj(self.chi) / 2, mp.mpc(0, 1)),
                                     (self.alpha * self.D * mp.expj(-self.chi) / 2, mp.mpc(0, -1))):
                    p = rate - mp.mpc(0, n)
                    total += weight * (mp.pi if abs(p) < mp.mpf(10) ** -25 else (mp.exp(p * mp.pi) - 1) / p)
                found.append(complex(total / mp.pi * mp.expj(-n * self.tau_max)))  # both halves give the same
        return np.array(found)

    def interior(self):
        """Return the largest dx/dtau strictly inside the descending half (negative: admissible)."""
        with mp.workdps(30):
            grid = [mp.pi * k / 400 for k in range(1, 400)]
            return max(self.descending(th)[1] for th in grid)


def interior_limit(omega, xi, beta=1.0):
    """Return the alpha at which the speed touches zero inside the half cycle (where that governs, low Omega)."""
    with mp.workdps(30):
        first = SlipOnly(omega, xi, 40 * beta, beta)

        def touching(th):
            """alpha for which the speed vanishes at th: v = decaying(th) + alpha D cos(th + chi), chi from alpha."""
            e, c, s = mp.exp(-first.loss * th), mp.cos(first.wd * th), mp.sin(first.wd * th)
            a1 = first.wd * first.B - first.loss * first.A
            b1 = -first.wd * first.A - first.loss * first.B
            decaying = e * (a1 * c + b1 * s)
            # alpha D cos(th + chi) = -slope0 cos th - sqrt((alpha D)^2 - slope0^2) sin th
            root = (decaying - first.slope0 * mp.cos(th)) / mp.sin(th)
            return root  # sqrt((alpha D)^2 - slope0^2) that is needed at th

        best = max((touching(mp.pi * k / 2000), k) for k in range(20, 1980))
        top = mp.findroot(lambda th: mp.diff(touching, th), mp.pi * best[1] / 2000)
        return mp.sqrt(touching(top) ** 2 + first.slope0**2) / first.D


class EventDriven:
    """March x'' + 2 xi x' + x + beta(tau) Sgn = alpha sin tau from event to event, in the phase tau (doubles).

    Parameters
    ----------
    limits : callable or pair
        tau -> (beta for dx > 0, beta for dx < 0), constant pair allowed.  Only constant limits have the closed form;
        varying ones are given as (mean, amplitude, phase) with `varying`.
    """

    def __init__(self, omega, xi, alpha, up=1.0, down=None, load=(0.0, 0.0), static=1.0):
        self.W, self.xi, self.alpha = omega, xi, alpha
        self.up, self.down = up, up if down is None else down
        self.rho, self.phase = load
        self.static = static
        self.wd, self.loss = np.sqrt(1.0 - xi * xi) / omega, xi / omega

    def load(self, tau):
        """Relative normal load, not clipped."""
        return 1.0 + self.rho * np.cos(tau + self.phase)

    def forced(self, tau, sign):
        """Particular solution and its derivative for x' of this sign (0: apart)."""
        G = 1.0 / complex(1.0 - self.W**2, 2.0 * self.xi * self.W)
        limit = {1: self.up, -1: self.down, 0: 0.0}[sign]
        z = (-1j * self.alpha - sign * limit * self.rho * np.exp(1j * self.phase)) * G * np.exp(1j * tau)
        return z.real - sign * limit, (1j * z).real

    def slip(self, tau0, x0, v0, sign):
        """Return functions x(tau), v(tau) = dx/dtau from a state."""
        p, dp = self.forced(tau0, sign)
        a = x0 - p
        b = (v0 - dp + self.loss * a) / self.wd

        def x(tau):
            t = tau - tau0
            return np.exp(-self.loss * t) * (a * np.cos(self.wd * t) + b * np.sin(self.wd * t)) + self.forced(tau, sign)[0]

        def v(tau):
            t = tau - tau0
            e, c, s = np.exp(-self.loss * t), np.cos(self.wd * t), np.sin(self.wd * t)
            return e * ((self.wd * b - self.loss * a) * c - (self.wd * a + self.loss * b) * s) + self.forced(tau, sign)[1]

        return x, v

    def march(self, tau, x, v, end, grid=2000):
        """Return the list of (tau, x, v, mode entered) and the last state at ``end``; modes "stick", +1, -1, 0."""
        def demand(at):  # force that rest asks of the contact
            return self.alpha * np.sin(at) - x

        def entered(at):
            """Mode that a state of rest enters."""
            level = self.load(at)
            eps = 1e-7
            if level <= 0.0 and self.load(at + eps) <= 0.0:
                return 0
            now, limit = demand(at), max(level, 0.0)
            if -self.static * self.down * limit * (1 + 1e-13) <= now <= self.static * self.up * limit * (1 + 1e-13):
                later, limit = demand(at + eps), max(self.load(at + eps), 0.0)
                if -self.static * self.down * limit <= later <= self.static * self.up * limit or self.static == 1.0 \
                        and abs(later) <= abs(now):
                    return "stick"
            return 1 if now > 0 else -1

        def first_root(functions, a, b):
            """Earliest sign change to >= 0 of any function on (a, b], on a grid of the phase."""
            step = 2 * np.pi / grid
            left = a + 1e-9
            while left < b:
                right = min(left + step, b)
                hits = []
                for name, f in functions.items():
                    fl, fr = f(left), f(right)
                    if fl < 0.0 <= fr:
                        hits.append((brentq(f, left, right, xtol=1e-15, rtol=8.9e-16), name))
                if hits:
                    return min(hits)
                left = right
            return None

        events = []
        mode = entered(tau) if v == 0.0 else (int(np.sign(v)) if self.load(tau) > 0.0 else 0)
        while tau < end:
            if mode == "stick":
                functions = {1: lambda at: demand(at) - self.static * self.up * self.load(at),
                             -1: lambda at: -demand(at) - self.static * self.down * self.load(at)}
                if self.rho:
                    functions[0] = lambda at: -self.load(at)
                found = first_root(functions, tau, end)
                if found is None:
                    return events, (x, 0.0)
                tau, mode = found
                events.append((tau, x, 0.0, mode))
                continue
            xs, vs = self.slip(tau, x, v, mode)
            functions = {"stop": lambda at, f=vs, m=mode: -m * f(at)} if mode else {}
            if self.rho:
                functions["load"] = (lambda at: -self.load(at)) if mode else self.load
            found = first_root(functions, tau, end)
            if found is None:
                return events, (float(xs(end)), float(vs(end)))
            tau, what = found
            x, v = float(xs(tau)), float(vs(tau))
            if what == "stop":
                v = 0.0
                mode = entered(tau)
            else:
                mode = 0 if mode else int(np.sign(v))
            events.append((tau, x, v, mode))
        return events, (x, v)

    def orbit(self, x=0.0, v=0.0, cycles=60):
        """Return the events of the cycle from a whole phase and the state there, after ``cycles`` cycles."""
        for k in range(cycles):
            events, (x, v) = self.march(2 * np.pi * k, x, v, 2 * np.pi * (k + 1))
        return [(tau - 2 * np.pi * (cycles - 1), *rest) for tau, *rest in events], (x, v)
