"""A second implementation for oscillators with a cubic spring: Taylor series of 26 terms in 30 digits, stops by Newton."""
import mpmath as mp

TERMS = 26


def series(t0, x, v, zeta, omega, amplitude, alpha, beta):
    """Taylor coefficients in t - t0 of the solution of x'' + 2 zeta x' + alpha x + beta x^3 = amplitude cos(omega t)."""
    a, square = [mp.mpf(x), mp.mpf(v)], []
    load = amplitude * mp.expj(omega * t0)
    for k in range(TERMS):
        square.append(mp.fsum(a[i] * a[k - i] for i in range(k + 1)))
        cube = mp.fsum(square[i] * a[k - i] for i in range(k + 1))
        a.append((load.real - 2 * zeta * (k + 1) * a[k + 1] - alpha * a[k] - beta * cube) / ((k + 1) * (k + 2)))
        load *= 1j * omega / (k + 1)
    return a


def value(a, s):
    """Value and slope of the series."""
    p, d = mp.mpf(0), mp.mpf(0)
    for c in reversed(a):
        d = d * s + p
        p = p * s + c
    return p, d


class Duffing:
    """Motion of the oscillator, x <= gap with restitution if a gap is given; parameters are taken as the doubles they are."""

    def __init__(self, zeta=0.05, omega=0.5, amplitude=0.3, alpha=1.0, beta=1.0, gap=None, restitution=0.7, step=0.06):
        self.numbers = tuple(mp.mpf(p) for p in (zeta, omega, amplitude, alpha, beta))
        self.gap, self.restitution, self.step = gap, restitution, mp.mpf(step)

    def run(self, y, t0, t1, slowest=0.0):
        """State at t1 from y at t0, and the impacts as (time, arriving speed), up to the first slower than ``slowest``."""
        with mp.workdps(30):
            t, (x, v), impacts = mp.mpf(t0), map(mp.mpf, y), []
            t1 = mp.mpf(t1)
            while t < t1:
                h = min(self.step, t1 - t)
                a = series(t, x, v, *self.numbers)
                hit = None if self.gap is None else self._hit(a, h)
                if hit is None:
                    x, v = value(a, h)
                    t = t1 if h == t1 - t else t + h
                    continue
                t += hit
                x, v = mp.mpf(self.gap), value(a, hit)[1]
                impacts.append((t, v))
                if v < slowest:
                    break
                v = -mp.mpf(self.restitution) * v
            return (x, v), impacts

    def _hit(self, a, h):
        """First time in (0, h] at which the series reaches the gap from below."""
        gap = mp.mpf(self.gap)
        start = 0
        if a[0] == gap:
            if a[1] >= 0:
                raise ValueError("the motion stays on the stop")
            a, start = a[1:], 1
        target = gap if start == 0 else mp.mpf(0)
        if start == 1 and a[0] + abs(a[1]) * h < 0 and value(a, h)[0] < 0:
            return None
        low, pieces = mp.mpf(0), 64
        for k in range(1, pieces + 1):
            high = h * k / pieces
            if value(a, high)[0] >= target:
                s = (low + high) / 2
                for _ in range(200):
                    p, d = value(a, s)
                    if p < target:
                        low = s
                    else:
                        high = s
                    new = s - (p - target) / d
                    new = new if low < new < high else (low + high) / 2
                    if abs(new - s) < mp.mpf(10) ** -26:
                        break
                    s = new
                return s
            low = high
        return None
