"""Families of motions without events: how far a slider that never slips, or a mass that always sticks, may stand elsewhere.

Such a state is no unknown of an orbit: nothing changes it in a period, it labels a family.  The family ends where a guard is
touched.  In affine scenes a shift of the state shifts the whole motion by a constant, which gives the ends in closed form;
beside a law that is not affine each motion of the family is another one, and the ends are zeros of the largest guard.
"""
import math

import numpy as np
from scipy.optimize import brentq

from ...compose.writer import kernels
from . import motion
from .equations import Equations
from .sequence import AFTER
from .signature import sections

FIRST = 0.25  # step along a family, relative to the distance that its tangent gives
CURVED = 0.1  # of a step: the largest distance from the tangent
FINEST = 1e-7  # shortest step
MOST = 200  # steps; an end beyond them there is not
EXACT = 4e-15  # relative, of an end


def resting_intervals(orbit) -> dict[int, tuple[float, float]]:
    """Return for every state (index) of the family of an orbit without events the values (least, largest) up to which there is
    no event, the other states of the family as they are.

    An orbit that has passed an end already is given the ends of the line through it, so that a search can go there.
    """
    family = Family(orbit)
    found = {}
    for c in orbit.family:
        value = family.value(c, family.unknowns)
        slopes = family.slopes(c)
        with np.errstate(divide="ignore", invalid="ignore"):
            away = -family.tops / slopes
        low = float(away[slopes < 0.0].max(initial=-math.inf))
        high = float(away[slopes > 0.0].min(initial=math.inf))
        if not orbit.scene.closed_form and family.tops.max(initial=-1.0) < 0.0:
            low, high = family.end(c, low), family.end(c, high)
        found[c] = (value + low, value + high)
    return found


def line_of_members(orbit, values) -> np.ndarray:
    """Return the states (k, ns) of the members of a family without events with ``values`` (k, labels), where all forces are linear
    and they lie on a line, in a plane, and so on."""
    family = Family(orbit)
    along = np.array([family.tangent(c, family.unknowns)[1:] for c in orbit.family])
    return orbit.state + (values - orbit.labels.values(orbit.state)) @ along


def middle(orbit) -> dict[int, float]:
    """Return how far every memory of the family (index) has to move for the guards on its two sides to be equally near, by the
    tangents at the orbit: in affine scenes the middle of its interval.  Empty where there is no memory, or one has no end on a
    side."""
    kept = [c for c in orbit.family if c >= 2 * orbit.scene.n]
    if not kept:
        return {}
    family = Family(orbit)
    slopes = np.array([family.slopes(c) for c in kept]).T
    rows, away = [], []
    for rates in slopes.T:
        up, down = np.flatnonzero(rates > 0.0), np.flatnonzero(rates < 0.0)
        if not up.size or not down.size:
            return {}
        ends = (up[np.argmin(-family.tops[up] / rates[up])], down[np.argmin(family.tops[down] / rates[down])])
        rows.append(sum(slopes[g] / rates[g] for g in ends))
        away.append(-sum(family.tops[g] / rates[g] for g in ends))
    return dict(zip(kept, np.linalg.lstsq(np.array(rows), np.array(away))[0].tolist(), strict=True))


class Family:
    """The motions without events near one of them.

    Attributes
    ----------
    tops : ndarray (guards,)
        Largest value of every guard along the orbit.
    """

    def __init__(self, orbit):
        scene, self.path, self.weights = orbit.scene, orbit.equations.path, orbit.weights
        whole = orbit._whole[0]
        self.mode = int(whole.nodes[0, AFTER])
        self.signature = sections(self.mode, whole.span)
        self.length = whole.span * orbit.forcing_period
        self.equations = Equations(scene, self.path, self.signature, orbit.weights)
        self.kernel, self.motion = self.equations.kernel, kernels(scene, motion.__name__)
        self.ns = scene.ns
        self.unknowns = np.append(0.0, orbit.state)
        self.tops = self.largest(self.unknowns)

    def start(self, unknowns) -> np.ndarray:
        """Return the joined state (nx,) at phase 0."""
        T = self.path.tables
        x, P = np.empty(T.A.shape[2]), np.empty((self.ns, T.A.shape[2]))
        self.motion.start_of(T, self.signature.nodes, unknowns, 0, P, x)
        return x

    def largest(self, unknowns) -> np.ndarray:
        """Return the largest value of every guard along the motion from the unknowns (1 + ns,)."""
        T, x = self.path.tables, self.start(unknowns)
        return np.array([max(self.kernel.segment_peak(T, self.mode, g, x, self.length, 0, 0)[0],
                             self.kernel.guard_value(T, self.mode, g, x)) for g in range(int(T.n_guards[self.mode]))])

    def row(self, c: int) -> np.ndarray:
        """Return the label (ns,) at the place ``c``."""
        labels = self.equations.labels
        return labels.rows[labels.places.index(c)]

    def value(self, c: int, unknowns) -> float:
        """Return the value of the label at the place ``c``."""
        return float(self.row(c) @ unknowns[1:])

    def tangent(self, c: int, unknowns) -> np.ndarray:
        """Return the rates (1 + ns,) of the unknowns by state ``c`` along the family."""
        unit = np.zeros(1 + self.ns)
        unit[1 + c] = 1.0 / (np.abs(self.row(c)) @ self.weights)  # the equation that keeps this label
        return np.linalg.solve(self.equations.jacobian(np.append(unknowns, 0.0)), unit)

    def slopes(self, c: int) -> np.ndarray:
        """Return the rates (guards,) of the guards at phase 0 by state ``c`` along the family."""
        T, x = self.path.tables, self.start(self.unknowns)
        along = np.zeros(x.size)
        along[:self.ns] = self.tangent(c, self.unknowns)[1:]
        rates = np.empty(self.tops.size)
        for g in range(rates.size):
            row = np.empty(x.size)
            self.kernel.guard_gradient(T, self.mode, g, x, row)
            rates[g] = row @ along
        return rates

    def at(self, c: int, value: float, guess) -> np.ndarray | None:
        """Return the unknowns of the motion with this value of state ``c``, by Newton from a guess; None: it finds none."""
        moved, tangent = guess.copy(), np.zeros(self.ns + 2)
        moved[1 + c] += value - self.value(c, guess)
        tangent[-1] = 1.0
        status, x, _, _ = self.equations.correct(np.append(moved, 0.0), tangent, False)
        return x[:-1] if status == 1 else None

    def end(self, c: int, away: float) -> float:
        """Return how far state ``c`` may move; ``away`` says in which direction, and roughly how far.

        Steps that follow the tangent closely stay on this family.  Where it turns back before it comes to an event, the fold
        is the end.
        """
        if not math.isfinite(away):
            return away
        value, done, step, near = self.value(c, self.unknowns), 0.0, FIRST * away, self.unknowns
        along = self.tangent(c, near)
        for _ in range(MOST):
            x = self.at(c, value + done + step, near + step * along)
            if x is None or np.abs((x - near - step * along)[1:] / self.weights).max() > CURVED * abs(step) * np.abs(
                    along[1:] / self.weights).max():
                step *= 0.5
                if abs(step) < FINEST * abs(away):
                    return done
                continue
            if self.largest(x).max() > 0.0:
                break
            near, done, along, step = x, done + step, self.tangent(c, x), 1.5 * step
        else:
            return math.copysign(math.inf, away)

        def top(share):
            between = self.at(c, value + done + share * step, near + share * (x - near))
            return abs(self.tops.max()) if between is None else self.largest(between).max()

        return done + step * float(brentq(top, 0.0, 1.0, xtol=EXACT, rtol=EXACT))
