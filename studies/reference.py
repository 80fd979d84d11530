"""The impact oscillator in any number of digits, independent of the package: the yardstick of the other studies.

    x'' + 2 zeta x' + x = amplitude cos(omega t),   x <= gap,   x'+ = -restitution x'-     (0 < zeta < 1)

Free flight is the textbook solution; the first hit is isolated by bisection with a bound on the fourth derivative, so
that no hit is lost; the bounces of a complete chattering are followed one by one until their speed is `SLOW`, below
which sticking forgets them.
"""
from dataclasses import dataclass

from mpmath import cos, exp, mp, mpf, pi, sin, sqrt

DIGITS = 34
PIECES = 48  # of a forcing period in the search
SLOW = mpf(10) ** -14


@dataclass(frozen=True)
class Oscillator:
    """Impact oscillator; the fields are those of `bifurc.systems.impact_oscillator`."""

    zeta: float
    omega: float
    amplitude: float
    gap: float
    restitution: float

    @property
    def period(self):
        """Forcing period."""
        return 2 * pi / mpf(self.omega)

    def forced(self, t):
        """Return place and speed of the steady free response."""
        z, w, f = mpf(self.zeta), mpf(self.omega), mpf(self.amplitude)
        size = (1 - w * w) ** 2 + (2 * z * w) ** 2
        a, b = f * (1 - w * w) / size, f * 2 * z * w / size
        return a * cos(w * t) + b * sin(w * t), w * (b * cos(w * t) - a * sin(w * t))

    def fly(self, t0, q, v, t):
        """Return the free motion at ``t`` from the state (q, v) at ``t0``."""
        z = mpf(self.zeta)
        d, s = sqrt(1 - z * z), t - t0
        p0, r0 = self.forced(t0)
        x, y = q - p0, v - r0
        e, c, k = exp(-z * s), cos(d * s), sin(d * s) / d
        p1, r1 = self.forced(t)
        return p1 + e * ((c + z * k) * x + k * y), r1 + e * (-k * x + (c - z * k) * y)

    def bound(self, t0, q, v):
        """Bound on the fourth derivative of the free motion after ``t0`` (the energy of its free part never grows)."""
        z, w, f = mpf(self.zeta), mpf(self.omega), mpf(self.amplitude)
        p, r = self.forced(t0)
        size = sqrt((q - p) ** 2 + (v - r) ** 2)
        return size * (1 + 4 * z + 4 * z * z + 8 * z**3) + w**4 * f / sqrt((1 - w * w) ** 2 + (2 * z * w) ** 2)

    def hit(self, t0, q, v, t1, leaving=False):
        """Return time and speed of the first hit in (t0, t1], or None; ``leaving``: the flight starts from the stop."""
        d4 = self.bound(t0, q, v)
        gap = mpf(self.gap)
        width = self.period / PIECES
        left, first = t0, leaving
        waiting = []
        gl, vl = (mpf(0), v) if leaving else (q - gap, v)
        while left < t1:
            right = waiting.pop() if waiting else min(left + width, t1)
            x, vr = self.fly(t0, q, v, right)
            gr = x - gap
            h = right - left
            b1, b2, e = gl + h * vl / 3, gr - h * vr / 3, d4 * h**4 / 384
            if first:  # the trivial zero divided out: the remainder of the cubic is at most 16 e u^2 (1 - u)^2
                clear = b1 < 0 and b2 + 16 * e / 3 < 0 and gr < 0
            else:
                clear = max(gl, gr, b1, b2) + e < 0
            if not clear:
                crossing = not first and gl < 0 <= gr
                slopes = min(vl, vr, (gr - gl) / h) - d4 * h**3 / 24 > 0  # crude: rising through
                if crossing and slopes:
                    return self.root(t0, q, v, left, right)
                if h > mpf(10) ** (8 - mp.dps) * (1 + abs(left)):
                    waiting.append(right)
                    waiting.append((left + right) / 2)
                    continue
                if crossing:
                    return right, vr
            left, gl, vl, first = right, gr, vr, False
        return None

    def root(self, t0, q, v, left, right):
        """Return time and speed of the only zero in (left, right], by Newton steps that stay in the bracket."""
        gap, t = mpf(self.gap), (left + right) / 2
        for _ in range(200):
            x, speed = self.fly(t0, q, v, t)
            if x < gap:
                left = t
            else:
                right = t
            new = t - (x - gap) / speed if speed > 0 else left
            if abs(new - t) < mpf(10) ** (3 - mp.dps) * (1 + abs(t)):
                return new, speed
            t = new if left < new < right else (left + right) / 2
        return t, speed

    def push(self, t):
        """Return the acceleration into the stop of a mass at rest on it."""
        return mpf(self.amplitude) * cos(mpf(self.omega) * t) - mpf(self.gap)

    def release(self, t):
        """Return when a mass at rest on the stop at ``t`` is let go."""
        w = mpf(self.omega)
        angle = mp.acos(mpf(self.gap) / mpf(self.amplitude)) / w
        while angle <= t:
            angle += self.period
        return angle

    def march(self, q, v, t, end):
        """Return the state at ``end`` and the list of (time, speed) of the impacts from the state (q, v) at ``t``.

        Bounces slower than `SLOW` are not listed: the mass rests until it is released.
        """
        with mp.workdps(DIGITS):
            q, v, t, end = mpf(q), mpf(v), mpf(t), mpf(end)
            gap, r = mpf(self.gap), mpf(self.restitution)
            impacts = []
            leaving = False
            while True:
                found = self.hit(t, q, v, end, leaving)
                if found is None:
                    return (*self.fly(t, q, v, end), impacts)
                t, speed = found
                impacts.append((t, speed))
                q, v, leaving = gap, -r * speed, True
                if r * speed < SLOW:
                    free = self.release(t)
                    if self.push(t) <= 0:
                        raise ArithmeticError("a bounce of vanishing speed where the mass does not rest")
                    if free >= end:
                        return gap, mpf(0), impacts
                    jerk = mpf(self.amplitude) * mpf(self.omega) * sin(mpf(self.omega) * free)
                    t = min(free + 2 * jerk / self.bound(free, gap, mpf(0)), end)  # so long it certainly moves away
                    q, v = self.fly(free, gap, mpf(0), t)
                    leaving = False
