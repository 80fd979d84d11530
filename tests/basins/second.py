"""Second implementation of the impact oscillator's section map: closed-form flights on numpy vectors, any float type.

x'' + 2 zeta x' + x = F cos(omega t), x <= gap, x'+ = -r x'-, gap < F.  Nothing is shared with the package: flights are
exponentials and cosines, events are bracketed on 64 pieces of a period by signs of position and velocity, and a slow
rebound against the load rests until F cos(omega t) falls to the gap.
"""
import numpy as np

PIECES = 64


class SectionMap:
    """Map of states over one forcing period from phase 0.

    Parameters
    ----------
    zeta, omega, force, gap, restitution : float
    kind : numpy float type
    """

    def __init__(self, zeta, omega, force, gap, restitution, kind=np.float64):
        self.kind = kind
        self.slow = 1e-5 if kind is np.float64 else 1e-7  # heights of flights must stay above rounding
        z, w, F = kind(zeta), kind(omega), kind(force)
        self.z, self.w, self.F, self.gap, self.r = z, w, F, kind(gap), kind(restitution)
        self.wd = np.sqrt(1 - z * z)
        self.period = 2 * np.arccos(kind(-1)) / w
        below = (1 - w * w) ** 2 + (2 * z * w) ** 2
        self.a, self.b = F * (1 - w * w) / below, F * 2 * z * w / below  # particular motion a cos + b sin

    def load(self, t):
        """Acceleration of a mass at rest on the stop."""
        return self.F * np.cos(self.w * t) - self.gap

    def flight(self, x, v, t, s):
        """State a time ``s`` after (x, v) at ``t``."""
        c0, s0, c1, s1 = np.cos(self.w * t), np.sin(self.w * t), np.cos(self.w * (t + s)), np.sin(self.w * (t + s))
        y = x - self.a * c0 - self.b * s0
        u = v + self.w * (self.a * s0 - self.b * c0)
        decay, cos, sin = np.exp(-self.z * s), np.cos(self.wd * s), np.sin(self.wd * s)
        lean = (u + self.z * y) / self.wd
        y1 = decay * (y * cos + lean * sin)
        u1 = decay * (u * cos - (self.z * u + y) / self.wd * sin)
        return y1 + self.a * c1 + self.b * s1, u1 - self.w * (self.a * s1 - self.b * c1)

    def root(self, x, v, t, low, high, of_velocity):
        """Zero of velocity, or of position - gap, between low (negative) and high (positive; velocity: any change)."""
        low, high = low.copy(), high.copy()
        sign = np.sign(self.flight(x, v, t, high)[1]) if of_velocity else 1
        for _ in range(12 if self.kind is np.float64 else 16):
            s = (low + high) / 2
            p, d = self.flight(x, v, t, s)
            up = (d * sign if of_velocity else p - self.gap) > 0
            low, high = np.where(up, low, s), np.where(up, s, high)
        s = (low + high) / 2
        for _ in range(6):
            p, d = self.flight(x, v, t, s)
            if of_velocity:
                p, d = d, self.F * np.cos(self.w * (t + s)) - 2 * self.z * d - p
            else:
                p = p - self.gap
            s = np.clip(s - p / np.where(d == 0, 1, d), low, high)
        return s

    def __call__(self, x, v):
        """Return states one period later, and the number of impacts."""
        x, v = np.array(x, self.kind), np.array(v, self.kind)
        t, rest, hits = np.zeros_like(x), np.zeros(x.shape, bool), np.zeros(x.shape, int)
        release = np.arccos(self.gap / self.F) / self.w
        for piece in range(1, PIECES + 1):
            end = self.period * piece / PIECES
            go = np.flatnonzero((t < end) & ~rest)
            while go.size:
                left = end - t[go]
                x1, v1 = self.flight(x[go], v[go], t[go], left)
                early = np.zeros_like(left)  # where the motion is below the stop for certain
                late = left.copy()
                turn = v[go] * v1 < 0
                if turn.any():
                    at = self.root(x[go][turn], v[go][turn], t[go][turn], early[turn], left[turn], True)
                    down = v[go][turn] < 0
                    early[turn] = np.where(down, at, 0)
                    late[turn] = np.where(down, late[turn], at)
                top = self.flight(x[go], v[go], t[go], late)[0]
                hit = top > self.gap
                free = go[~hit]
                x[free], v[free], t[free] = x1[~hit], v1[~hit], end
                go = go[hit]
                if go.size:
                    s = self.root(x[go], v[go], t[go], early[hit], late[hit], False)
                    v[go] = -self.r * self.flight(x[go], v[go], t[go], s)[1]
                    t[go] += s
                    x[go] = self.gap
                    hits[go] += 1
                    still = (-v[go] < self.slow) & (self.load(t[go]) > 0.01)
                    rest[go[still]] = True
                    v[go[still]] = 0
                    go = go[~still]
                go = go[t[go] < end]
            free = rest & (release >= end - self.period / PIECES) & (release < end) & (t <= release)
            rest[free], t[free] = False, release
            if free.any():  # the rest of this piece
                i = np.flatnonzero(free)
                x[i], v[i] = self.flight(x[i], v[i], t[i], end - t[i])
                t[i] = end
            t[rest] = end
        return x, v, hits
