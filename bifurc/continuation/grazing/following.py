"""One touch of an orbit as the condition of a curve in two parameters, and the numbers that single out points of it."""
import math
from collections import deque

import numpy as np

from ..conditions import ALONG, Condition, difference
from .classify import powers
from .guards import guard_series, guard_size, of_law
from .touch import every_touch, maxima, rates, touch_at, unlisted

POWERS = 6  # s_k that are watched
FAR = 5.0  # scaled depth below which no other maximum is looked for
MAX_ITERATIONS = 40
REMEMBERED = 8  # latest points of a curve
BESIDE = 2e-3  # periods between the five accelerations of a top beside a law
INSTANTS = 16  # of a period, at which a guard is looked up that may not change along it
ALIKE = 1e-10  # scaled difference of a guard along an orbit that is none: so well a special point is known at least
SYMMETRIC = 1e-12  # scaled rate of the guard at the zero of its third derivative


class Touching(Condition):
    """The maximum of a guard that is followed is zero: smooth through other maxima, unlike the largest of all.

    Which of several maxima is meant is told by the nearest of the latest points of the curve, and of the first: what Newton meets
    on its way to no solution is forgotten.

    Parameters
    ----------
    problem : OrbitProblem
        Of the touching orbit, which does not list the touch.
    x : ndarray (n + 1,)
        Unknowns and parameter of the touching orbit.
    item : tuple
        (tau, mode, guard, state) of the touch.
    """

    def __init__(self, problem, x, item):
        super().__init__(problem)
        self.mode, self.guard = int(item[1]), int(item[2])
        self.first = np.array(x, float), float(item[0])  # point (u, a) (n + 1,) of the curve, time of the touch (periods)
        self.latest: deque = deque(maxlen=REMEMBERED)
        self.passed = passed(problem, self.first[0], self.first[1])
        self.constant = self.varies(problem, x) <= ALIKE

    def varies(self, problem, x) -> float:
        """Return how much the guard varies along an orbit without events at ``x`` (n + 1,), scaled; infinite of others.

        That of a rotor which circles round the centre of its stator does not: the whole circle touches at once, no instant is a
        maximum, and every one tells the distance.
        """
        if problem.sequence.events:
            return math.inf
        span, tau = problem.sequence.span, self.first[1]
        values = [self.there(problem, x, tau + span * k / INSTANTS) for k in range(INSTANTS)]
        return (max(values) - min(values)) / self.size(problem, x, tau)

    def there(self, problem, x, tau) -> float:
        """Return the guard at ``tau`` (periods) on the orbit at ``x`` (n + 1,)."""
        e, state = problem.equations, self.joined(problem, x, tau)
        return float(e.kernel.guard_value(e.path.tables, self.mode, self.guard, state))

    def value(self, family, x) -> float:
        """Return the scaled maximum at ``x`` = (u, a, b) (n + 2,)."""
        return self.top(family.at(float(x[-1])), x[:-1])[0]

    def linearised(self, family, x, wide):
        """As `conditions.Fold.linearised`; the touch moves along.

        The guard is stationary in time there, so that its maximum changes as it does at the same instant.
        """
        value, tau = self.top(family.at(float(x[-1])), x[:-1])

        def there(y):
            problem = family.at(float(y[-1]))
            return self.there(problem, y[:-1], tau) / self.size(problem, y[:-1], tau)
        gradient = np.array([difference(there, x, i, ALONG * family.scale[i]) for i in range(x.size)])
        return value, gradient

    def reached(self, family, x) -> None:
        """See `Condition.reached`."""
        problem = family.at(float(x[-1]))
        _, tau = self.top(problem, x[:-1])
        if self.constant or float(self.series(problem, x[:-1], tau)[2]) < 0.0:  # a least value of the guard is another one
            self.latest.append((x[:-1].copy(), tau))

    def instants(self, problem, x) -> np.ndarray:
        """See `Condition.instants`: the touch is one of them."""
        return np.append(super().instants(problem, x), np.mod(self.top(problem, x)[1] / problem.sequence.span, 1.0))

    def size(self, problem, x, tau) -> float:
        """Natural size of the guard at ``tau`` (periods) on the orbit at ``x`` (n + 1,)."""
        e, T = problem.equations, problem.equations.path.tables
        here = self.joined(problem, x, tau) if of_law(T, self.mode, self.guard) else None
        return guard_size(e, T, self.mode, self.guard, here)

    def joined(self, problem, x, tau) -> np.ndarray:
        """Return the state, joined with the forcing (nx,), at ``tau`` (periods) on the orbit at ``x`` (n + 1,)."""
        e, s, scene = problem.equations, problem.sequence, problem.scene
        T = e.numbers_at(x[-1])
        joined = np.empty(T.A.shape[2])
        inside = x[0] + np.mod(tau - x[0], s.span)
        state = np.empty((1, scene.ns))
        e.motion.states(T, s.nodes, s.span, x[:-1], np.array([inside]), state)
        turns = 1.0 if s.closure > 0 or round((inside - tau) / s.span) % 2 == 0 else -1.0
        joined[:scene.ns] = turns * state[0]
        e.kernel.forcing(T, tau * 2.0 * np.pi / T.flat[0], joined)
        return joined

    def series(self, problem, x, tau) -> np.ndarray:
        """Return the Taylor coefficients of the guard in time about ``tau`` (periods) on the orbit at ``x`` (n + 1,).

        All that are kept where the motion is affine, and those of the fitted motion of a guard that is a law itself.  Of an affine
        guard beside a law the first three are exact (the guard and its rate are kinematics, its acceleration is that of the
        equations of motion), two more are those of the interpolated acceleration.
        """
        T = problem.equations.numbers_at(x[-1])
        here = self.joined(problem, x, tau)
        if not T.LU.shape[0] or of_law(T, self.mode, self.guard):
            return guard_series(problem.equations, T, self.mode, self.guard, here)
        own, width = here @ T.GT[self.mode, self.guard, :, :2], BESIDE * 2.0 * np.pi / T.flat[0]
        a = np.array([rates(problem.equations, T, self.mode, self.guard, self.joined(problem, x, tau + k * BESIDE))[0]
                      for k in (-2, -1, 0, 1, 2)])
        third = (a[0] - 8.0 * a[1] + 8.0 * a[3] - a[4]) / (12.0 * width)
        fourth = (16.0 * (a[1] + a[3]) - a[0] - a[4] - 30.0 * a[2]) / (12.0 * width**2)
        return np.array([*own, a[2] / 2.0, third / 6.0, fourth / 24.0])

    def top(self, problem, x):
        """Return (scaled value, tau) of the stationary point of the guard that is followed, at ``x`` (n + 1,)."""
        if self.constant:
            return self.there(problem, x, self.first[1]) / self.size(problem, x, self.first[1]), self.first[1]
        T = problem.equations.numbers_at(x[-1])
        period, reach = 2.0 * np.pi / T.flat[0], float(T.step[self.mode])
        tau = min((self.first, *self.latest), key=lambda point: float(np.linalg.norm((x - point[0]) / problem.scale)))[1]
        for _ in range(3):  # each on the series about the last place
            a = self.series(problem, x, tau)
            move = stationary(a, reach)
            tau += move / period
            if abs(move) < 1e-3 * reach:
                break
        value = float(np.polynomial.polynomial.polyval(move, a)) / self.size(problem, x, tau)
        return (value if passed(problem, x, tau) == self.passed else math.nan), tau  # behind another event it is another guard

    def apex(self, problem, x, tau) -> float:
        """Return the acceleration of the guard at its top ``tau`` (periods).

        Where the guard is symmetric about its top, the centre is the zero of the third derivative: that of the first is known
        to the cube root of rounding only where the top becomes flat.
        """
        T = problem.equations.numbers_at(x[-1])
        derivatives = [self.series(problem, x, tau)]
        for _ in range(3):
            derivatives.append(np.polynomial.polynomial.polyder(derivatives[-1]))
        centre = stationary(derivatives[2], 1e-2 * float(T.step[self.mode]))
        h1 = float(np.polynomial.polynomial.polyval(centre, derivatives[1]))
        if abs(h1) <= SYMMETRIC * self.size(problem, x, tau) * T.flat[0]:
            return float(np.polynomial.polynomial.polyval(centre, derivatives[2]))
        return float(derivatives[2][0])

    def linear_map(self, problem, x, tau):
        """Return the time (periods, within the orbit), the touch there, and its E, h, B in natural sizes."""
        e, s, scene = problem.equations, problem.sequence, problem.scene
        T = e.numbers_at(x[-1])
        inside = x[0] + np.mod(tau - x[0], s.span)
        y = np.empty((1, scene.ns))
        e.motion.states(T, s.nodes, s.span, x[:-1], np.array([inside]), y)
        touch = touch_at(problem, x, inside, self.mode, self.guard, y[0])
        weights = problem.weights
        return inside, touch, (touch.E * weights / weights[:, None], touch.h * weights, touch.B / weights)

    def values(self, problem, x):
        """Return A_g, the next maximum, det(E - I), det(E + I), s_1 .. s_6 scaled; NaN where there is none."""
        _, tau = self.top(problem, x)
        inside, touch, (E, h, B) = self.linear_map(problem, x, tau)
        T = problem.equations.numbers_at(x[-1])
        eye, size = np.eye(len(h)), float(np.linalg.norm(h))
        others = [item[3] for item in maxima(problem, x, [(inside, self.mode, self.guard)], FAR)]
        values = [self.apex(problem, x, tau) / (size * T.flat[0]**2), max(others, default=-1.0),
                  float(np.linalg.det(E - eye)), float(np.linalg.det(E + eye))]
        if touch.restitution is None:
            return values + [math.nan] * POWERS
        found = powers(E, h, B, POWERS)[0] / (size * float(np.linalg.norm(B)))
        return values + found.tolist() + [math.nan] * (POWERS - found.size)


def passed(problem, x, tau) -> int:
    """Return how many listed events of the orbit at ``x`` (n + 1,), from one of them on, come before ``tau`` (periods)."""
    s = problem.sequence
    if not s.events or not s.span:
        return 0
    return int(np.floor((tau - np.reshape(x[:-1], (len(s.nodes), -1))[:, 0]) / s.span).sum())


def stationary(a, reach) -> float:
    """Return the zero next to 0 of the derivative of the series ``a`` (k,), no farther than ``reach``."""
    slope = np.polynomial.polynomial.polyder(a)
    bend = np.polynomial.polynomial.polyder(slope)
    t: float = 0.0
    for _ in range(MAX_ITERATIONS):
        f, g = np.polynomial.polynomial.polyval(t, slope), np.polynomial.polynomial.polyval(t, bend)
        if g == 0.0:
            break
        step = float(f / g)
        t -= step
        if abs(t) > reach:
            return math.copysign(reach, t)
        if abs(step) <= 1e-16 * reach:
            break
    return float(t)


def touching(problem, x):
    """Return (problem, x, item) of the touch to follow from a grazing at ``x`` (n + 1,); None where it is not known."""
    other, at = unlisted(problem, x)
    if other is None:
        return None
    found = every_touch(other, at)
    return (other, at, found[0]) if found else None
