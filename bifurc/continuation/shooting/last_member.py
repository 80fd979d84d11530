"""The last member of a family of motions that stick: where a contact just reaches its limits both ways.

What sticks all the time may stand at any place of an interval.  Motions that slip both ways come from where that interval is left
with one place, at which the contact is brought to its limits once each way.  Their slips vanish there together, with some power of
the way: their equations lose ranks, and rounding moves solutions more than they differ.  Those of the family are regular: with its
labels unknown as well, and a limit reached for each of them and the parameter, they tell the place to rounding.
"""
from dataclasses import dataclass

import numpy as np

from ...elements import EventKind
from ...orbits.shooting.sequence import AFTER, BEFORE, ENDING, GUARD, STARTS
from ..problem import EPS

STEP, FAR = 1e-6, 1e-2  # scaled: of differences; of a step of Newton's method that leads away
ITERATIONS, CONVERGED = 12, 1e-12  # of it, and its last step
ROUNDING = 100.0 * EPS  # of a guard's maximum


@dataclass(frozen=True)
class Member:
    """Unknowns and parameter ``x`` (n + 1,) of one motion of a family, and the error of the parameter, own units."""

    x: np.ndarray
    error: float


def last_member(problem, new, x) -> Member | None:
    """Return the member next to ``x`` (n + 1,) of the family of ``new`` that just reaches all limits beyond which motions of
    ``problem`` slip and its own do not; None where these are not as many as its labels more and the parameter.  What sticks all the
    time in both stays where it is."""
    limits, labels, ns = sorted(slips(problem) - slips(new)), new.equations.labels, new.scene.ns
    if new.sequence.closure < 0 or new.sequence.clock or len(limits) != 1 + new.free - problem.free:
        return None
    units = np.append(new.weights[list(labels.places)], new.scale[-1])
    ways = moved_alone(labels.rows, problem.equations.labels.rows, units[:-1])
    begin, tangent = np.append(labels.values(x[1:1 + ns]), x[-1]), np.eye(1, x.size, x.size - 1)[0]

    def member(at, near):
        """Return the solution (n + 1,) a way ``at`` (k + 1,) from the first, found from the one ``near``; None without one."""
        guess, place = near.copy(), begin + units * (ways @ at)
        guess[-1] = place[-1]
        rows = guess[:-1].reshape(-1, 1 + ns)
        rows[:, 1:] = labels.moved(rows[:, 1:], place[:-1])
        c = new.correct(guess, tangent, True)
        return c.x if c.converged else None

    at = np.zeros(len(limits))
    for _ in range(ITERATIONS):
        x = member(at, x)
        beside = [None if x is None else member(at + STEP * unit, x) for unit in np.eye(at.size)]
        if any(one is None for one in beside):
            return None
        values = reached(new, x, limits)
        slopes = np.column_stack([(reached(new, one, limits) - values) / STEP for one in beside])
        if not np.isfinite(slopes).all():
            return None
        try:
            inverse = np.linalg.inv(slopes)
        except np.linalg.LinAlgError:
            return None
        step = -inverse @ values
        away = float(np.abs(step).max())
        if not away <= FAR:
            return None
        at = at + step
        if away <= CONVERGED * max(1.0, float(np.abs(inverse).max())):
            last = member(at, x)
            return None if last is None else Member(last, float(units[-1] * (ROUNDING * np.abs(inverse[-1]).sum() + abs(step[-1]))))
    return None


def moved_alone(rows, kept, units) -> np.ndarray:
    """Return the combinations (k + 1, m + 1) of the labels ``rows`` (k, ns), in their ``units`` (k,), and the parameter that leave
    the labels ``kept`` (k - m, ns) as they are."""
    through = np.linalg.lstsq(rows.T, kept.T, rcond=None)[0].T * units  # of a change of the labels, what those kept change by
    still = np.linalg.svd(through)[2][len(kept):] if len(kept) else np.eye(len(rows))
    ways = np.zeros((len(rows) + 1, len(still) + 1))
    ways[:-1, :-1], ways[-1, -1] = still.T, 1.0
    return ways


def slips(problem) -> set[tuple[int, int]]:
    """Return mode and guard of the events of a problem's sequence that begin a slip."""
    scene = problem.scene
    return {(int(m), int(g)) for m, g in problem.sequence.nodes[:, [BEFORE, GUARD]]
            if g >= 0 and scene.event_kind(int(m), int(g)) is EventKind.SLIP}


def reached(problem, x, limits) -> np.ndarray:
    """Return the largest value in a period of each of the ``limits`` (mode, guard), scaled, at ``x`` (n + 1,); -inf of those in no
    mode of it."""
    e, s, ns = problem.equations, problem.sequence, problem.scene.ns
    T = e.numbers_at(float(x[-1]))
    period, found = 2.0 * np.pi / T.flat[0], dict.fromkeys(limits, -np.inf)
    begins = np.append(x[:-1:1 + ns], x[0] + s.span)
    start, P, row = np.empty(T.A.shape[2]), np.empty((ns, T.A.shape[2])), np.empty(T.A.shape[2])
    for i, node in enumerate(s.nodes):
        for mode, guard in limits:
            if mode != node[AFTER]:
                continue
            e.motion.start_of(T, s.nodes, x[:-1], i, P, start)
            e.kernel.guard_gradient(T, mode, guard, start, row)
            low = abs(int(node[STARTS + guard])) if node.size > STARTS + guard else 0
            listed = int(node.size > ENDING and node[ENDING] == guard)
            top = e.kernel.segment_peak(T, mode, guard, start, (begins[i + 1] - begins[i]) * period, listed, low)[0]
            found[mode, guard] = max(found[mode, guard], top / e.kernel.scale_of(row, e.weights))
    return np.array([found[limit] for limit in limits])
