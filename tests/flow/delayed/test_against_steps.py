"""Delayed feedback beside contacts, against the method of steps by scipy: one sample of the past a piece, events by roots."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import bifurc as bf
from bifurc.elements import Coulomb, DelayedFeedback, HarmonicForce, RigidStop

DAMPING, LOAD, OMEGA = 0.1, 0.9, 0.6


class Steps:
    """One mass of stiffness 1 under a harmonic load: x'' = force(t, x, v) in free motion, x'' = x' = 0 where it is held."""

    def __init__(self, gain, delay, of):
        self.gain, self.delay, self.of, self.pieces = gain, delay, of, []

    def past(self, t):
        """Return displacement or velocity a delay before, by the piece in which the middle of the step was."""
        return float(self.before[2](t - self.delay)[self.of])

    def force(self, t, x, v):
        """Return all forces but those of the contact; the feedback begins a delay after the start."""
        fed = self.gain * (self.past(t) - (x, v)[self.of]) if self.fed else -self.gain * (x, v)[self.of]
        return LOAD * np.cos(OMEGA * t) - x - DAMPING * v + fed

    def breaks(self):
        """Return the times at which another piece of the past begins to act, no piece longer than a delay."""
        now = self.pieces[-1][1] if self.pieces else 0.0
        return [self.delay, now + 0.99 * self.delay, *(p[1] + self.delay for p in self.pieces)]

    def to(self, stop, y, contact, mode):
        """Return the events (time, mode after) up to ``stop`` and the last state."""
        t, events = 0.0, []
        while t < stop:
            end = min([b for b in self.breaks() if b > t + 1e-12] + [stop])
            self.fed = t >= self.delay - 1e-12
            self.before = next((p for p in self.pieces if p[0] <= 0.5 * (t + end) - self.delay <= p[1]), None)
            if mode == "held":
                values = [contact.released(self.force(s, *y)) for s in np.linspace(t, end, 40)]
                found = [k for k in range(39) if values[k] < 0.0 <= values[k + 1]]
                if found:
                    s = np.linspace(t, end, 40)[found[0]:found[0] + 2]
                    end = brentq(lambda s, y: contact.released(self.force(s, *y)), *s, args=(y,), xtol=1e-15)
                held = np.array(y)
                self.pieces.append((t, end, lambda s, held=held: held))
            else:
                def left(s, y, mode):
                    return contact.reached(mode, *y)
                left.terminal, left.direction = True, 1.0
                run = solve_ivp(lambda s, y, mode: (y[1], self.force(s, *y) + contact.push(mode)), (t, end), y, "DOP853",
                                args=(mode,), rtol=1e-12, atol=1e-14, events=left, dense_output=True)
                found, end, y = run.t_events[0].size, run.t[-1], run.y[:, -1]
                self.pieces.append((t, end, run.sol))
            t = end
            if found:
                mode, y = contact.after(mode, lambda y, t=t: self.force(t, *y), y)
                events.append((t, mode))
        return events, y


class Friction:
    """Dry friction: slip that ends at speed zero, stick up to the limit."""

    limit = 0.4

    def push(self, mode):
        return -self.limit * mode

    def reached(self, mode, x, v):
        return -mode * v

    def released(self, force):
        return abs(force) - self.limit

    def after(self, mode, force, y):
        y = y[0], 0.0
        return ("held" if mode != "held" and abs(force(y)) < self.limit else np.sign(force(y))), y


class Stop:
    """A plastic stop: an impact holds the mass until the force turns away from it."""

    gap = 0.2

    def push(self, mode):
        return 0.0

    def reached(self, mode, x, v):
        return x - self.gap

    def released(self, force):
        return -force

    def after(self, mode, force, y):
        y = self.gap, 0.0
        return ("held" if mode == "free" and force(y) > 0.0 else "free"), y


@pytest.mark.parametrize("of", [0, 1], ids=["displacement", "velocity"])
@pytest.mark.parametrize("gain, delay", [(0.3, 0.5), (-0.4, 1.3)])
@pytest.mark.parametrize("contact, element, mode", [(Friction(), Coulomb(0.4), 1.0), (Stop(), RigidStop(0.2, 0.0), "free")],
                         ids=["friction", "plastic stop"])
def test_a_held_mass_starts_when_its_delayed_force_lets_it(contact, element, mode, gain, delay, of):
    """Masses held by friction and by a plastic stop: the past decides when they go, and their next motion begins at rest."""
    events, final = Steps(gain, delay, of).to(16.0, (0.0, 0.3), contact, mode)
    feedback = DelayedFeedback(gain, delay=delay * OMEGA / (2.0 * np.pi), of=("displacement", "velocity")[of])
    motion = bf.simulate(bf.System(1.0, DAMPING, 1.0, (HarmonicForce(LOAD), element, feedback), omega=OMEGA), (0.0, 0.3),
                         duration=16.0)
    assert motion.success and len(events) >= 3
    np.testing.assert_allclose([e.time for e in motion.events], [e[0] for e in events], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion.final, final, rtol=0, atol=1e-9)


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("known", [False, True])
def test_the_first_root_of_a_polynomial(order, known, rng):
    """s^k q(s) of random roots on a piece: the first at which it rises, 0 where it rises from a zero of order k at the start."""
    from bifurc.flow.delayed.history import collocation
    from bifurc.flow.delayed.integration import first_root

    c = collocation()[0]
    for _ in range(60):
        roots = np.sort(rng.uniform(-0.4, 1.4, rng.integers(1, 6)))
        sign = rng.choice([-1.0, 1.0])
        rate = (sign * np.prod(-roots) * (order == 1), 1e-15) if known and order else None
        values = sign * c**order * np.prod(c[:, None] - roots, axis=1)
        found = first_root(values, sign * np.prod(-roots) * (order == 0), 1e-15, rate)
        inside = [r for k, r in enumerate(roots) if 0.0 < r <= 1.0 and sign * (-1.0) ** (roots.size - 1 - k) > 0.0]
        expected = 0.0 if sign * np.prod(-roots) > 0.0 else min(inside, default=None)
        assert found == (None if expected is None else pytest.approx(expected, abs=1e-9))
