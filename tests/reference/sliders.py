"""Masses with elastic sliders, elastic stops and any smooth force, a second time: Runge-Kutta of order 8 and located events.

Every contact is in a state of its own; the motion is integrated to the next change of one of them, which the dense output
locates, and started again there.  Nothing is known of modes, tables or series.
"""
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

STICK, UP, DOWN = 0, 1, -1


class Slider(NamedTuple):
    """Force stiffness (u - w) on the row u, never above the limit."""

    row: tuple
    stiffness: float
    limit: float


class Stop(NamedTuple):
    """Force stiffness (u - gap) on the row u where it is positive."""

    row: tuple
    stiffness: float
    gap: float


class Arrived(NamedTuple):
    """State (q, v), sliders, events (time, contact, what it became), and work of the load, viscous loss, loss of the sliders."""

    y: np.ndarray
    w: np.ndarray
    events: list
    energies: np.ndarray


class Marched:
    """M q'' + C q' + K q + sliders + stops + smooth(q) = load cos(omega t)."""

    def __init__(self, M, C, K, load, omega, smooth, sliders=(), stops=()):
        self.M, self.C, self.K = (np.atleast_2d(np.asarray(A, float)) for A in (M, C, K))
        self.n, self.load, self.omega, self.smooth = len(self.M), np.asarray(load, float).ravel(), omega, smooth
        self.contacts = [*(Slider(np.asarray(s.row), *s[1:]) for s in sliders), *(Stop(np.asarray(s.row), *s[1:]) for s in stops)]
        self.count = len(sliders)

    def rate(self, t, y, states, w):
        """Return q', v' and the three powers."""
        q, v = y[:self.n], y[self.n:2 * self.n]
        load = self.load * np.cos(self.omega * t)
        force, lost = load - self.C @ v - self.K @ q - self.smooth(q), 0.0
        for i, (c, state) in enumerate(zip(self.contacts, states, strict=True)):
            if i >= self.count:
                f = c.stiffness * (c.row @ q - c.gap) if state else 0.0
            elif state == STICK:
                f = c.stiffness * (c.row @ q - w[i])
            else:
                f = state * c.limit
                lost += f * (c.row @ v)
            force = force - f * c.row
        return np.concatenate((v, np.linalg.solve(self.M, force), [load @ v, v @ self.C @ v, lost]))

    def ends(self, i, state, w):
        """Return the functions of (t, y) that rise through zero where contact ``i`` changes, each with what it becomes."""
        c, n = self.contacts[i], self.n
        if i >= self.count:
            return [(lambda t, y: (-1.0 if state else 1.0) * (c.row @ y[:n] - c.gap), not state)]
        if state == STICK:
            return [(lambda t, y, way=way: way * c.stiffness * (c.row @ y[:n] - w[i]) - c.limit, way) for way in (UP, DOWN)]
        return [(lambda t, y: -state * (c.row @ y[n:2 * n]), STICK)]

    def run(self, y, w, t0, t1) -> Arrived:
        """Return the motion at ``t1`` from the state (q, v) and the sliders at ``t0``."""
        n, t, y, w, events = self.n, t0, np.concatenate((y, np.zeros(3))), np.array(w, float), []
        states = []
        for i, c in enumerate(self.contacts):
            if i >= self.count:
                states.append(bool(c.row @ y[:n] > c.gap))
                continue
            force, speed = c.stiffness * (c.row @ y[:n] - w[i]), c.row @ y[n:2 * n]
            slips = abs(force) > c.limit * (1.0 - 1e-12) and force * speed > 0.0
            states.append((UP if force > 0.0 else DOWN) if slips else STICK)
        while t < t1:
            watched = [(i, *end) for i, state in enumerate(states) for end in self.ends(i, state, w)]
            for _, function, _ in watched:
                function.terminal, function.direction = True, 1.0
            done = solve_ivp(lambda t, y: self.rate(t, y, states, w), (t, t1), y, "DOP853", rtol=2.3e-14, atol=1e-15,
                             max_step=0.05 / self.omega, events=[function for _, function, _ in watched])
            t, y = done.t[-1], done.y[:, -1]
            for i, (c, state) in enumerate(zip(self.contacts[:self.count], states, strict=False)):
                if state != STICK:
                    w[i] = c.row @ y[:n] - state * c.limit / c.stiffness
            for (i, _, new), times in zip(watched, done.t_events, strict=True):
                if times.size:
                    states[i] = new
                    events.append((t, i, new))
        return Arrived(y[:2 * n], w, events, y[2 * n:])

    def period(self, x) -> np.ndarray:
        """Return the state with sliders (2 n + sliders,) one period of the load after phase 0."""
        done = self.run(x[:2 * self.n], x[2 * self.n:], 0.0, 2.0 * np.pi / self.omega)
        return np.concatenate((done.y, done.w))
