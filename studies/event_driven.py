"""A second event-driven integrator of linear systems with contacts, for comparison: it shares nothing with the package.

Coordinates are normalised by the Cholesky factor of the mass matrix and time by the fastest rate.  Between events the state, with
the excitation as two more states, moves by its matrix exponential; guards are looked at 60 times a fastest period and at the minima
between, and their zeros are bracketed on the Taylor polynomial of the step.  All numbers are long doubles.  What follows an event
is the first combination of contact states, those that hold first, whose reactions are within their limits and whose guards begin
inwards.  One file, because it is one program, to be read beside the package.

Rules: `docs/explanation/how_it_works.md` (Newton's impact law, impacts of one instant one after another; set-valued friction, which
plays no part in impacts; elastic sliders with a memory).
"""
import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

LONG = np.longdouble
ORDER = 26  # of Taylor polynomials
STEP = 0.1  # over the fastest rate
BLOCK = 32  # steps at a time
NOTHING = LONG(1e-15)  # relative: what is zero
SLOW = LONG(1e-13)  # over the largest speed: an impact that is the end of a chattering
MOST_IMPACTS = 2000  # of one instant, before it is asked whether they die out
MOST_EVENTS = 800  # beyond them it is no comparison of events any more, but of roundings
TOO_MANY = "too many events"


class Undecided(Exception):
    """The reference has no answer."""


@dataclass(frozen=True)
class Contact:
    """One contact: kind ``rigid`` (gap, restitution), ``elastic`` (gap, stiffness, damping), ``dry`` (friction, static),
    ``slider`` (stiffness, limit), on a row."""

    kind: str
    row: tuple[float, ...]
    side: int = 1
    gap: float = 0.0
    restitution: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    static: float = 1.0


@dataclass(frozen=True)
class Scene:
    """Matrices, a harmonic load (amplitude cos(omega t + phase)) and a constant one on each coordinate, contacts, a start."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    omega: float
    amplitude: np.ndarray
    phase: np.ndarray
    constant: np.ndarray
    contacts: tuple[Contact, ...]
    q: np.ndarray
    v: np.ndarray

    def shaken(self, rng, size) -> "Scene":
        """Return a scene whose coefficients are another by a relative ``size``; exact zeros, gaps and places stay."""
        def other(x):
            return np.array(x, LONG) * (1 + size * rng.uniform(-1, 1, np.shape(x)).astype(LONG))

        def even(X):
            X = other(X)
            return np.tril(X) + np.tril(X, -1).T
        contacts = tuple(replace(c, restitution=other(c.restitution) if c.restitution < 1 else c.restitution,
                                 **{name: other(getattr(c, name)) for name in ("stiffness", "damping", "friction")})
                         for c in self.contacts)
        return replace(self, M=even(self.M), C=even(self.C), K=even(self.K), amplitude=other(self.amplitude),
                       constant=other(self.constant), v=other(self.v), contacts=contacts)


def inverse(A):
    """Return the inverse in long doubles: that in doubles, refined."""
    A = np.array(A, LONG)
    scale = 1 / np.sqrt(np.abs(np.diag(A)))
    B = A * np.outer(scale, scale)
    X = np.linalg.inv(B.astype(float)).astype(LONG)
    for _ in range(4):
        X = X + X @ (np.eye(len(A), dtype=LONG) - B @ X)
    return X * np.outer(scale, scale)


def cholesky(A):
    """Return the lower factor in long doubles."""
    A = np.array(A, LONG)
    L = np.zeros_like(A)
    for j in range(len(A)):
        L[j, j] = np.sqrt(A[j, j] - L[j, :j] @ L[j, :j])
        for i in range(j + 1, len(A)):
            L[i, j] = (A[i, j] - L[i, :j] @ L[j, :j]) / L[j, j]
    return L


class Integrator:
    """Motions of a scene.

    Attributes
    ----------
    unit : longdouble
        Of time: one over the fastest rate.
    """

    def __init__(self, scene: Scene):
        self.scene = s = scene
        self.n = n = len(s.M)
        self.back = cholesky(s.M)  # q~ = L^T q
        self.L = np.array(self.back).T
        low = np.zeros((n, n), LONG)
        for j in range(n):  # inverse of L (forward substitution)
            e = np.zeros(n, LONG)
            e[j] = 1
            for i in range(n):
                low[i, j] = (e[i] - self.back[i, :i] @ low[:i, j]) / self.back[i, i]
        self.low = low
        self.rows = [low @ np.array(c.row, LONG) for c in s.contacts]
        K, C = low @ np.array(s.K, LONG) @ low.T, low @ np.array(s.C, LONG) @ low.T
        stiff, damp = K.copy(), C.copy()
        for c, row in zip(s.contacts, self.rows, strict=True):
            stiff += LONG(c.stiffness) * np.outer(row, row)
            damp += LONG(c.damping) * np.outer(row, row)
        rate = max(float(np.sqrt(np.abs(np.linalg.eigvalsh(stiff.astype(float))).max())),
                   float(np.abs(np.linalg.eigvalsh(damp.astype(float))).max()), s.omega)
        self.unit = 1 / LONG(rate)
        u = self.unit
        self.K, self.C = K * u * u, C * u
        self.sliders = [i for i, c in enumerate(s.contacts) if c.kind == "slider"]
        self.m = m = len(self.sliders)
        self.N = N = 2 * n + m + 3  # q~, v~, w~, 1, cos, sin
        self.base = np.zeros((n, N), LONG)
        self.base[:, :n], self.base[:, n:2 * n] = -self.K, -self.C
        amplitude, phase = np.array(s.amplitude, LONG), np.array(s.phase, LONG)
        self.base[:, -3] = low @ np.array(s.constant, LONG) * u * u
        self.base[:, -2] = low @ (amplitude * np.cos(phase)) * u * u
        self.base[:, -1] = low @ (-amplitude * np.sin(phase)) * u * u
        self.omega = LONG(s.omega) * u
        self._modes: dict = {}
        self.groups: list[list[int]] = []
        for i, c in enumerate(s.contacts):
            if c.kind in ("rigid", "dry"):
                for group in self.groups:
                    if self.parallel(group[0], i):
                        group.append(i)
                        break
                else:
                    self.groups.append([i])

    def parallel(self, i, j):
        """Whether two contacts are on one row, but for a factor."""
        a, b = np.array(self.scene.contacts[i].row), np.array(self.scene.contacts[j].row)
        return bool(np.abs(np.outer(a, b) - np.outer(b, a)).max() == 0)

    # ---- states

    def state(self, q, v, t=0.0):
        """Return the state of the scene: virgin memory."""
        z = np.zeros(self.N, LONG)
        z[:self.n] = self.back.T @ np.array(q, LONG)
        z[self.n:2 * self.n] = self.back.T @ np.array(v, LONG) * self.unit
        for k, i in enumerate(self.sliders):
            z[2 * self.n + k] = self.wscale(i) * (self.rows[i] @ z[:self.n])
        z[-3], z[-2], z[-1] = 1, np.cos(LONG(self.scene.omega) * LONG(t)), np.sin(LONG(self.scene.omega) * LONG(t))
        return z

    def wscale(self, i):
        return np.sqrt(LONG(self.scene.contacts[i].stiffness)) * self.unit

    def physical(self, z):
        """Return places and speeds."""
        return np.concatenate([self.low.T @ z[:self.n], self.low.T @ z[self.n:2 * self.n] / self.unit])

    # ---- functionals

    def place(self, i):
        g = np.zeros(self.N, LONG)
        g[:self.n] = self.rows[i]
        return g

    def speed(self, i):
        g = np.zeros(self.N, LONG)
        g[self.n:2 * self.n] = self.rows[i]
        return g

    def depth(self, i):
        c = self.scene.contacts[i]
        g = c.side * self.place(i)
        g[-3] -= LONG(c.gap)
        return g

    def stretch(self, i):
        """Spring of a slider, over its limit: +-1 at the limits."""
        c, g = self.scene.contacts[i], self.place(i)
        g[2 * self.n + self.sliders.index(i)] = -1 / self.wscale(i)
        return g * (LONG(c.stiffness) / LONG(c.friction))

    # ---- modes

    def mode(self, states):
        """Return generator, guards (functional, strict) and held groups of a combination of contact states."""
        if states not in self._modes:
            self._modes[states] = Mode(self, states)
        return self._modes[states]


class Mode:
    """One combination of contact states."""

    def __init__(self, integrator, states):
        I, self.states = integrator, states
        n, N, contacts, u = I.n, I.N, I.scene.contacts, I.unit
        force, self.guards, A = I.base.copy(), [], np.zeros((N, N), LONG)
        for i, (c, state) in enumerate(zip(contacts, states, strict=True)):
            row = I.rows[i]
            if c.kind == "elastic":
                if state == "in":
                    force -= np.outer(row, LONG(c.stiffness) * u * u * c.side * I.depth(i) + LONG(c.damping) * u * I.speed(i))
                self.guards.append((I.depth(i) if state == "in" else -I.depth(i), False, i))
            elif c.kind == "rigid" and state == "free":
                self.guards.append((-I.depth(i), False, i))
            elif c.kind == "dry" and state != "stick":
                force[:, -3] -= row * LONG(c.friction) * u * u * state
                self.guards.append((state * I.speed(i), True, i))
            elif c.kind == "slider":
                k = 2 * n + I.sliders.index(i)
                if state == "stick":
                    force -= np.outer(row, I.stretch(i) * LONG(c.friction) * u * u)
                    one = np.zeros(N, LONG)
                    one[-3] = 1
                    self.guards += [(one - I.stretch(i), False, i), (one + I.stretch(i), False, i)]
                else:
                    force[:, -3] -= row * LONG(c.friction) * u * u * state
                    A[k] = I.wscale(i) * I.speed(i)
                    self.guards.append((state * I.speed(i), True, i))
        self.owners = [(i,) for _, _, i in self.guards]
        self.held = [group for group in I.groups if any(states[i] in ("rest", "stick") for i in group)]
        if self.held:
            J = np.array([I.rows[group[0]] for group in self.held])
            G = inverse(J @ J.T)
            reaction, made_of = -G @ J @ force, np.abs(G) @ np.abs(J) @ np.abs(force)
            reaction[np.abs(reaction) < 1e-17 * made_of] = 0
            self.project = J.T @ G @ J
            for k, group in enumerate(self.held):
                low = high = LONG(0)
                sign = [1 if float(I.rows[i] @ I.rows[group[0]]) > 0 else -1 for i in group]
                for i, s in zip(group, sign, strict=True):
                    c = contacts[i]
                    if states[i] == "stick":
                        most = LONG(c.friction) * LONG(c.static) * u * u * np.sqrt((I.rows[i] @ I.rows[i]) / (J[k] @ J[k]))
                        low, high = low - most, high + most
                    elif states[i] == "rest":
                        if s * c.side > 0:
                            low = -LONG(np.inf)
                        else:
                            high = LONG(np.inf)
                for limit, way in ((low, 1), (high, -1)):
                    if np.isfinite(limit):
                        g = way * reaction[k]
                        g[-3] -= way * limit
                        self.guards.append((g, False, None))
                        self.owners.append(tuple(group))
            made_of = np.abs(force) + np.abs(J.T) @ made_of
            force = force + J.T @ reaction
            force[np.abs(force) < 1e-17 * made_of] = 0
        A[:n, n:2 * n] = np.eye(n)
        A[n:2 * n] = force
        A[-2, -1], A[-1, -2] = -I.omega, I.omega
        self.A = A
        self.functionals = np.array([g for g, _, _ in self.guards]).reshape(-1, N)
        self.rates = self.functionals @ A
        self.h = LONG(STEP) / max(LONG(1), I.omega)
        step, power = np.eye(N, dtype=LONG), np.eye(N, dtype=LONG)
        for k in range(1, ORDER + 1):
            power = power @ A * (self.h / k)
            step = step + power
        self.powers = [np.eye(N, dtype=LONG)]
        for _ in range(BLOCK):
            self.powers.append(step @ self.powers[-1])
        self.powers = np.array(self.powers)

    def series(self, z, A=None):
        """Return Taylor coefficients of the state (ORDER + 1, N)."""
        found, A = [z], self.A if A is None else A
        for k in range(1, ORDER + 1):
            found.append(A @ found[-1] / k)
        return np.array(found)

    def sizes(self, largest):
        """Return what the terms of these coefficients are made of, from the largest states (N,): they round to a part of it."""
        return self.series(largest, np.abs(self.A))

    def at(self, z, tau):
        """Return the state later by tau, at most a step."""
        return polynomial(self.series(z), tau)


def polynomial(c, tau):
    """Return the value of a polynomial by Horner's rule."""
    value = c[-1]
    for part in c[-2::-1]:
        value = value * tau + part
    return value


def derivative(c):
    return c[1:] * np.arange(1, len(c), dtype=LONG)


def root(c, a, b):
    """Return the zero of a polynomial between places of other signs: Newton's steps that stay between, or halves."""
    d, up = derivative(c), polynomial(c, b) > 0
    x = (a + b) / 2
    for _ in range(200):
        value = polynomial(c, x)
        if (value > 0) == up:
            b = x
        else:
            a = x
        slope = polynomial(d, x)
        new = x - value / slope if slope else a
        if value == 0 or abs(new - x) <= 2e-19 * abs(x):
            return x
        if not a < new < b:
            new = (a + b) / 2
            if new in (a, b):
                return b
        x = new
    return x


GRID = np.linspace(LONG(0), LONG(1), 9)
POWERS = GRID[:, None] ** np.arange(ORDER + 1, dtype=LONG)


def first_zero(c, end):
    """Return the first place in (0, end] where a polynomial that begins positive falls through zero, or None.

    The derivative changes sign at most a few times on a step: it is looked at 8 times.
    """
    held = np.flatnonzero(c)
    if len(held) and c[held[0]] < 0:
        return LONG(0)
    scaled = c * end ** np.arange(ORDER + 1, dtype=LONG)
    if scaled[0] > np.abs(scaled[1:]).sum():
        return None
    d = derivative(scaled)
    slopes = POWERS[:, :ORDER] @ d
    if slopes[0] == 0:
        slopes[0] = next((x for x in d if x != 0), LONG(0))
    at = [LONG(0)]
    for k in range(8):
        if (slopes[k] > 0) != (slopes[k + 1] > 0):
            at.append(root(d, GRID[k] if k else start_of(d, GRID[1]), GRID[k + 1]))
        at.append(GRID[k + 1])
    values = [polynomial(scaled, place) for place in at]
    for k in range(1, len(at)):
        if values[k] < 0:
            return end * root(scaled, at[k - 1] if k > 1 else start_of(scaled, at[k]), at[k])
    return None


def start_of(c, b):
    """Return a place behind 0 where a polynomial has the sign with which it begins."""
    sign = next((x > 0 for x in c if x != 0), True)
    for k in range(200):
        place = b / LONG(2) ** k
        value = polynomial(c, place)
        if value != 0 and (value > 0) == sign:
            return place
    return LONG(0)


def cleaned(c, size):
    """Return Taylor coefficients of a guard without those that are rounding, at the beginning."""
    c = c.copy()
    for k in range(len(c)):
        if abs(c[k]) > NOTHING * size[k]:
            break
        c[k] = 0
    return c


class Motion:
    """One motion, followed from time to time."""

    def __init__(self, scene: Scene):
        self.I = Integrator(scene)
        self.z, self.t = self.I.state(scene.q, scene.v), LONG(0)
        self.largest = np.abs(self.z)
        self.seen(self.z)
        self.events, self.impacts, self.log = 0, 0, []
        self.ignored = LONG(0)  # largest speed, of coordinates with unit mass and time, that was taken for rest
        self.rounding = LONG(0)  # speed that rounding of places has made
        self.moved = LONG(0)  # largest way by which a mass that touches but for rounding was put on its wall
        self.struck = [-LONG("inf")] * len(scene.contacts)  # when each was struck last
        self.states = self.fired = None
        self.owners = ()
        self.settle()

    @property
    def y(self):
        return self.I.physical(self.z)

    def seen(self, Z):
        """Keep the largest places, speeds and memories."""
        n = self.I.n
        for part in (slice(0, n), slice(n, 2 * n), slice(2 * n, -3)):
            if part.start < self.I.N - 3:
                self.largest[part] = max(np.abs(Z[..., part]).max(), self.largest[part].max())

    def to(self, t):
        """Go on to a time."""
        left = LONG(t) / self.I.unit - self.t
        while left > 0:
            gone, event = self.advance(left)
            self.t += gone
            left -= gone
            if event:
                self.events += 1
                if self.events > MOST_EVENTS:
                    raise Undecided(TOO_MANY)
                self.settle()

    def advance(self, left):
        """Follow the mode up to an event or for ``left``; return the time that is gone and whether an event ends it."""
        mode = self.I.mode(self.states)
        gone = LONG(0)
        first, self.fresh = self.fresh, False  # behind an event; what goes on from some time has left its surfaces
        while left > gone:
            h = mode.h
            many = int(min(BLOCK, max(1, math.floor((left - gone) / h))))
            if left - gone < h:
                many, h = 1, left - gone
            Z = mode.powers[:many + 1] @ self.z if h == mode.h else np.array([self.z, mode.at(self.z, h)])
            sizes = mode.sizes(self.largest) if first else None  # of what has led here
            self.seen(Z)
            if len(mode.guards):
                G, D = Z @ mode.functionals.T, Z @ mode.rates.T
                reach = 4 * h * np.maximum(np.abs(D[:-1]), np.abs(D[1:]))
                suspect = (G[1:] < 0) | (D[:-1] < 0) & (D[1:] >= 0) & (G[:-1] < reach)
                if first:
                    suspect[0] = True
                for j in np.flatnonzero(suspect.any(axis=1)):
                    series = mode.series(Z[j])
                    best = None
                    for k in range(len(mode.guards)) if first and j == 0 else np.flatnonzero(suspect[j]):
                        g = mode.functionals[k]
                        c = series @ g
                        if first and j == 0:
                            c = self.beginning(c, sizes, *mode.guards[k])
                            if mode.guards[k][1] is False and not np.any(c):
                                continue
                        tau = first_zero(c, h)
                        if tau is not None and (best is None or tau < best[0]):
                            best = tau, mode.guards[k][2], mode.owners[k]
                    if best is not None:
                        self.z = polynomial(series, best[0])
                        self.fired, self.owners = best[1:]
                        return gone + j * h + best[0], True
            self.z, gone, first = Z[-1], gone + many * h, False
            if many == 1 and h != mode.h:
                break
        return left, False

    # ---- what follows an event

    def zero(self, g, extra=0.0):
        """Whether a functional of the state is zero, to rounding."""
        return abs(g @ self.z) <= NOTHING * (np.abs(g) @ self.largest) + extra

    def beginning(self, c, sizes, g, strict, i):
        """Return the polynomial of a guard at a start without what is rounding, or the speed with which a chattering ended."""
        c = cleaned(c, sizes @ np.abs(g))
        if i is not None and self.still(i):
            if strict:
                c[0] = 0
            elif c[0] == 0 and self.I.scene.contacts[i].kind in ("rigid", "elastic"):
                c[1] = 0
        return cleaned(c, sizes @ np.abs(g))

    def still(self, i):
        """Whether a row is at rest."""
        g, length = self.I.speed(i), np.sqrt(self.I.rows[i] @ self.I.rows[i])
        found = self.zero(g, SLOW * self.largest[self.I.n] * length)
        if found:
            self.ignored = max(self.ignored, abs(g @ self.z) / length)
        return found

    def settle(self):
        """Carry out the impacts of this instant, and find the states that follow."""
        I, contacts = self.I, self.I.scene.contacts
        n = I.n
        self.seen(self.z)
        touching = [i for i, c in enumerate(contacts) if c.kind == "rigid" and (
            self.zero(I.depth(i)) or self.states is not None and (self.states[i] == "rest" or self.fired == i and
                                                                  self.states[i] == "free"))]
        for i in (i for i, c in enumerate(contacts) if c.kind == "rigid"):
            if i not in touching and I.depth(i) @ self.z > 0:
                raise Undecided(f"stop {i} is passed by {float(I.depth(i) @ self.z)}")
        for i in touching:  # put back on the wall
            row, depth = I.rows[i], I.depth(i) @ self.z
            self.moved = max(self.moved, abs(depth) / np.sqrt(row @ row))
            self.z[:n] -= row * contacts[i].side * depth / (row @ row)
        hits: list = []
        fastest = False  # the first contact in their order strikes first; the fastest where that has no end
        while True:
            speeds = [(contacts[i].side * (I.speed(i) @ self.z) / np.sqrt(I.rows[i] @ I.rows[i]), i) for i in touching
                      if not self.still(i)]
            closing = [hit for hit in speeds if hit[0] > 0]
            if not closing:
                break
            if len(hits) == MOST_IMPACTS:
                if not self.dies_out(hits):
                    if fastest:
                        raise Undecided("impacts of one instant do not end")
                    fastest = True
                hits.clear()
                continue
            hit = max(closing) if fastest else closing[0]
            i = hit[1]
            row = I.rows[i]
            self.z[n:2 * n] -= row * (1 + LONG(contacts[i].restitution)) * (row @ self.z[n:2 * n]) / (row @ row)
            self.unresolved(i, hit[0])
            self.impacts += 1
            self.log.append((float(self.t * I.unit), i))
            hits.append(hit)
        options = [self.options(i, i in touching) for i in range(len(contacts))]
        held = [i for i, state in enumerate(self.states or ()) if state == "stick" and i not in self.owners
                and contacts[i].kind == "dry"]
        # a contact within its limit of stick does not let go by itself, though it might slip with the smaller force of slip
        for states in sorted(itertools.product(*options), key=lambda states: sum(states[i] != "stick" for i in held)):
            if self.begins(states):
                self.states, self.fresh = states, True
                return
        raise Undecided(f"no combination of {options} may follow")

    def unresolved(self, i, speed):
        """Add what rounding of the place makes of the speed of an impact: it over the time of the flight, at most all of it."""
        g, length = np.abs(self.I.depth(i)), np.sqrt(self.I.rows[i] @ self.I.rows[i])
        flight, self.struck[i] = self.t - self.struck[i], self.t
        if flight > 0:
            self.rounding += min(len(g) * np.finfo(LONG).eps * (g @ self.largest) / length / flight, speed)

    def dies_out(self, hits) -> bool:
        """Put to rest what impacts whose speeds fall as a geometric sequence leave: no speed of the rows that take turns."""
        n, quarter = self.I.n, len(hits) // 4
        parts = [hits[k * quarter:(k + 1) * quarter] for k in (1, 2, 3)]
        first, middle, last = (max(speed for speed, _ in part) for part in parts)
        taking = {i for _, i in parts[0]}
        if any({i for _, i in part} != taking for part in parts) or not last < middle < first \
                or abs(middle / first - last / middle) > 1e-3 * (1 - middle / first):
            return False
        rows = np.array([self.I.rows[group[0]] for group in self.I.groups if taking & {*group}])
        for _ in range(2):
            self.z[n:2 * n] -= rows.T @ (inverse(rows @ rows.T) @ (rows @ self.z[n:2 * n]))
        return True

    def options(self, i, touching):
        """Return the states that a contact may have now, those that hold first."""
        I, c = self.I, self.I.scene.contacts[i]
        if c.kind == "rigid":
            return (("rest", "free") if self.still(i) else ("free",)) if touching else ("free",)
        if c.kind == "dry":
            return ("stick", 1, -1) if self.still(i) else (1 if I.speed(i) @ self.z > 0 else -1,)
        if c.kind == "elastic":
            d = I.depth(i)
            if not self.zero(d):
                return ("in" if d @ self.z > 0 else "out",)
            return ("out", "in") if self.still(i) else ("in" if c.side * (I.speed(i) @ self.z) > 0 else "out",)
        full = I.stretch(i) @ self.z
        if abs(full) < 1 - 100 * NOTHING * (np.abs(I.stretch(i)) @ np.abs(self.z)):
            return ("stick",)
        way = 1 if full > 0 else -1
        return ("stick", way) if self.still(i) else (way if way * (I.speed(i) @ self.z) > 0 else "stick",)

    def begins(self, states):
        """Whether a combination may start here; if so its held rows are put to rest."""
        mode, n = self.I.mode(states), self.I.n
        z = self.z.copy()
        for group in mode.held:
            if not all(self.still(i) for i in group):
                return False
        if mode.held:
            z[n:2 * n] -= mode.project @ z[n:2 * n]
        series, sizes = mode.series(z), mode.sizes(self.largest)
        for g, strict, i in mode.guards:
            c = self.beginning(series @ g, sizes, g, strict, i)
            first = next((x for x in c if x != 0), LONG(0))
            if first < 0 or first == 0 and strict:
                return False
        self.z = z
        return True
