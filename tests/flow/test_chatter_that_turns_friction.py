"""Complete chattering whose impulses turn the friction of other rows: impact by impact in closed form, without springs and damping.

Accelerations are constant between events, so that flights are made of parabolas.  The sliding speed over the speed of impact, u/v,
follows a map with an unstable fixed point: on one side of it the friction turns in a few flights and then keeps one direction, on
the other the other one; numbers of reversals change in a geometric sequence towards it, from both sides.
"""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, RigidStop

SPEED = 1e-2
DEEP = 1e-17  # speed of the last impact
AWAY = 10.0**-np.arange(1.0, 10.0, 0.5)
ALLOWED = 1e-13  # rounding


class Scene:
    """One or two masses with friction, which forces overcome at any time, and one more; a stop moves all of them."""

    def __init__(self, restitution, sliders, gap=0.0):
        self.r, self.n, self.gap = restitution, sliders + 1, gap
        self.M = np.array([[1.0, 0.3, 0.1], [0.3, 1.4, 0.2], [0.1, 0.2, 1.2]])[np.ix_(*2 * [[0, 1] if sliders == 1 else [0, 2, 1]])]
        self.row = np.array([1.0, 0.5] if sliders == 1 else [0.2, 0.2, 0.3])
        self.F = np.array([2.0, 0.6] if sliders == 1 else [2.5, 2.0, 0.6])
        self.frictions = [0.3, 0.2][:sliders]
        self.known = {}
        self.span = 2.0 * restitution * SPEED / (1.7 * (1.0 - restitution)) + 0.02  # longer than impacts go on

    def system(self):
        """Return the system, whose stop is at ``gap``."""
        zero, parts = np.zeros((self.n, self.n)), [ConstantForce(force, dof=dof) for dof, force in enumerate(self.F)]
        sliders = [Coulomb(friction, dof=dof) for dof, friction in enumerate(self.frictions)]
        return bf.System(self.M, zero, zero, [*parts, RigidStop(self.gap, self.r, row=tuple(self.row)), *sliders])

    def start(self, *u):
        """Return a state that meets the stop with `SPEED`, where sliders have the speeds ``u``."""
        last = (SPEED - self.row[:-1] @ u) / self.row[-1]
        return np.array([*[0.0] * (self.n - 1), self.gap / self.row[-1], *u, last])

    def accelerations(self, signs, held=False):
        """Return those of all masses where frictions slip with ``signs``, and where the stop is ``held`` as well."""
        key = (*signs, held)
        if key not in self.known:
            a = np.linalg.solve(self.M, self.F - np.append(np.array(signs) * self.frictions, 0.0))
            way = np.linalg.solve(self.M, self.row)
            self.known[key] = a - way * (self.row @ a) / (self.row @ way) if held else a
        return self.known[key]

    def after(self, state):
        """Return the state `span` after the impact at ``state``, signs of sliding speeds when the impacts end, and the number of
        reversals until then."""
        n, way = self.n, np.linalg.solve(self.M, self.row)
        q, w, t, turns = state[:n].copy(), state[n:].copy(), 0.0, 0
        speed, y = SPEED, 0.0  # toward the stop, and place: known to rounding of their own
        while speed > DEEP:
            w -= (1.0 + self.r) * speed * way / (self.row @ way)
            speed *= -self.r
            flying = True
            while flying:
                a = self.accelerations(np.sign(w[:-1]))
                push = self.row @ a
                ends = (math.sqrt(speed * speed - 2.0 * push * y) - speed) / push
                flying, ends, i = self.reversal(w, a, ends)
                q, w, t = q + (w + 0.5 * a * ends) * ends, w + a * ends, t + ends
                y, speed = (y + (speed + 0.5 * push * ends) * ends, speed + push * ends) if flying else (0.0, speed + push * ends)
                turns += flying
                self.turn(w, a, i)
        signs = np.sign(w[:-1])
        assert t < self.span
        while t < self.span:
            a = self.accelerations(np.sign(w[:-1]), held=True)
            _, ends, i = self.reversal(w, a, self.span - t)
            q, w, t = q + (w + 0.5 * a * ends) * ends, w + a * ends, t + ends if i >= 0 else self.span
            self.turn(w, a, i)
        return np.concatenate([q, w]), signs, turns

    def reversal(self, w, a, ends):
        """Return whether a slider stops before ``ends``, then or ``ends``, and which (-1: none)."""
        times = [-w[k] / a[k] if w[k] * a[k] < 0.0 else math.inf for k in range(self.n - 1)]
        i = int(np.argmin(times))
        return (True, times[i], i) if times[i] < ends else (False, ends, -1)

    def turn(self, w, a, i):
        """Let slider ``i`` go on in the direction of its acceleration: forces overcome its friction."""
        if i >= 0:
            w[i] = math.copysign(1e-300, a[i])

    def limit(self, *others):
        """Return the speed of the first slider at which it turns in every flight, as far as numbers tell."""
        low, high = 0.0, 2.0 * SPEED
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.after(self.start(middle, *others))[1][0] < 0.0 else (low, middle)
        return 0.5 * (low + high)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("restitution", [0.05, 0.1, 0.3, 0.5])
def test_turns_of_friction_in_the_last_flights_are_part_of_the_motion(restitution, side):
    """However many they are."""
    counts, scene = [], Scene(restitution, 1)
    system, at = scene.system(), scene.limit()
    for away in AWAY:
        state = scene.start(at + side * away * SPEED)
        motion = bf.simulate(system, state, duration=scene.span)
        exact, _, turns = scene.after(state)
        assert motion.success and np.abs(motion.final - exact).max() < ALLOWED
        counts.append(turns)
    assert counts == sorted(counts) and counts[-1] >= 5  # ever more of them on the way to the limit


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("restitution", [0.1, 0.4])
def test_places_far_from_zero_leave_their_rounding(restitution, side):
    """A flight with the speed v is known to eps/v beside v, of which a sliding speed takes its part."""
    scene = Scene(restitution, 1, gap=1.0)
    system, at = scene.system(), scene.limit()
    for away in AWAY:
        state = scene.start(at + side * away * SPEED)
        motion = bf.simulate(system, state, duration=scene.span)
        assert np.abs(motion.final - scene.after(state)[0]).max() < 1e-10


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("restitution", [0.1, 0.4])
@pytest.mark.parametrize("other", [0.3, 0.7, 1.3, 4.0])
def test_turns_of_two_frictions(other, restitution, side):
    """Each by the impulses of one stop."""
    scene = Scene(restitution, 2)
    system, at = scene.system(), scene.limit(other * SPEED)
    for away in AWAY[:9]:
        state = scene.start(at + side * away * SPEED, other * SPEED)
        motion = bf.simulate(system, state, duration=scene.span)
        assert motion.success and np.abs(motion.final - scene.after(state)[0]).max() < ALLOWED
