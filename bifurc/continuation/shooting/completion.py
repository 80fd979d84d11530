"""Where a complete chattering just completes: its infinitely many impacts end at the instant at which the stop would let go.

Let tau be the time left to that instant.  The acceleration that presses the mass on its stop falls to zero there, as
``c tau``, and near it a flight with the speed v before the impact, ``w = v/(c tau^2)``, leads from tau to ``rho tau``.  With
``sigma = 1 - rho`` and the restitution r

    r w = sigma/2 - sigma^2/6,      w' = (sigma/2 - sigma^2/3)/rho^2.

Motions with smaller w come to rest before the release, with larger w they never do.  Between them lies the fixed point w' = w,

    rho^3 + 2 rho^2 - 2 r rho - r = 0,      dw'/dw > 1,

whose stable set is the boundary: on it the times left of successive impacts have ratios q = rho + C tau + O(tau^2).  The
condition is that two successive ratios extrapolate to rho.  Deviations grow with dw'/dw from impact to impact, so that the
parameter is known to tau^2 over the product of all these slopes: to rounding after a dozen impacts.

Chattering that ends at the release: Nordmark and Kisitu (2003).  The cubic is derived in one line from the two flights above.
"""
import numpy as np

from ...elements import EventKind
from ...orbits.sequence import AFTER, BEFORE, CLOSES, GUARD
from ...orbits.signature import Signature, divided
from ..conditions import difference

IMPACTS = 6  # of a train, at least
LEFT = 1e-7  # periods left at the last impact whose ratio is used: rounding of times is 1e-9 of that
ROOM = 1e-2  # of that, down to which a train is written out
ALIKE = 0.03  # by which a ratio may differ from that of the boundary in a start
MAX_ITERATIONS = 30
TOLERANCE = 1e-12  # scaled step of Newton's method
STEP = 1e-6  # of the parameter, scaled, in the derivative of the restitution
NEAR = 1e-2  # of the parameter, scaled, to the last row of a branch that ends here


def ratio(restitution: float) -> float:
    """Return rho: by what factor the time left to the release falls from impact to impact.

    Parameters
    ----------
    restitution : float
        Between 0 and 1, dimensionless.
    """
    r = float(restitution)
    roots = np.roots([1.0, 2.0, -2.0 * r, -r])
    return float(max(roots[np.abs(roots.imag) < 1e-12].real))


def growth(restitution: float) -> float:
    """Return dw'/dw: by what factor deviations from the boundary grow from impact to impact."""
    rho = ratio(restitution)
    s = 1.0 - rho
    along = ((0.5 - 2.0 * s / 3.0) * rho + 2.0 * (0.5 * s - s * s / 3.0)) / rho**3
    return along * restitution / (0.5 - s / 3.0)


def train(problem, x):
    """Return (impacts, release) of the complete chattering with the shortest rest of an orbit at ``x`` (n + 1,): places of its
    listed impacts in the sequence, counted on below zero where they lie in the period before, and of the release that follows;
    None where there is none."""
    s, scene = problem.sequence, problem.scene
    if s.clock or s.closure < 0:
        return None
    count, found = len(s.nodes), None
    for i in np.flatnonzero(s.nodes[:, CLOSES] == 1).tolist():
        m, g = (int(v) for v in s.nodes[(i + 1) % count, :AFTER])
        if g < 0 or scene.event_kind(m, g) is not EventKind.RELEASE:
            continue
        own, impacts = tuple(s.nodes[i, :AFTER]), [i]
        for k in range(i - 1, i - count, -1):
            if s.nodes[k, CLOSES] != 2:
                break
            if tuple(s.nodes[k, :AFTER]) == own:
                impacts.insert(0, k)
        rest = time_of(problem, x, i + 1) - time_of(problem, x, i)
        if len(impacts) >= IMPACTS and (found is None or rest < found[0]):
            found = rest, impacts, i + 1
    return None if found is None else found[1:]


def time_of(problem, x, k) -> float:
    """Return the time of node ``k``, periods, which may be one of the period before or after."""
    s = problem.sequence
    turns, place = divmod(k, len(s.nodes))
    return float(x[place * (1 + problem.scene.ns)]) + turns * s.span


class Completion:
    """The ratios of the times left at three successive impacts extrapolate to that of the boundary.

    Parameters
    ----------
    problem : OrbitProblem
    impacts : sequence of int
        The three, as of `train`.
    release : int
        Place of the release.
    """

    def __init__(self, problem, impacts, release):
        self.problem, self.impacts, self.release = problem, tuple(impacts), release
        self.hit = tuple(int(v) for v in problem.sequence.nodes[impacts[0] % len(problem.sequence.nodes), [BEFORE, GUARD]])

    def restitution(self, problem, p) -> float:
        """Return that of the stop at the parameter ``p``."""
        return float(problem.equations.numbers_at(p).ratio[self.hit])

    def of(self, problem, x) -> float:
        """Return the value of the condition at ``x`` = (u, a) (n + 1,), dimensionless."""
        a, b, c = (time_of(problem, x, self.release) - time_of(problem, x, k) for k in self.impacts)
        rho = ratio(self.restitution(problem, float(x[-1])))
        return (c / b - rho * b / a) / (1.0 - rho) - rho

    def gradient(self, problem, x) -> np.ndarray:
        """Return the derivatives of `of` (n + 1,), own units."""
        a, b, c = (time_of(problem, x, self.release) - time_of(problem, x, k) for k in self.impacts)
        rho = ratio(self.restitution(problem, float(x[-1])))
        slopes = np.array([rho * b / a**2, -c / b**2 - rho / a, 1.0 / b]) / (1.0 - rho)
        out, size, count = np.zeros(x.size), 1 + problem.scene.ns, len(problem.sequence.nodes)
        for k, slope in zip(self.impacts, slopes, strict=True):
            out[k % count * size] -= slope
            out[self.release % count * size] += slope
        out[-1] = difference(lambda y: self.of(problem, y), x, x.size - 1, STEP * problem.scale[-1])
        return out

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        return self.of(family.at(float(x[-1])), x[:-1])

    def linearised(self, family, x, wide):
        """As `conditions.Fold.linearised`."""
        gradient = np.append(self.gradient(family.at(float(x[-1])), x[:-1]),
                             difference(lambda y: self.value(family, y), x, x.size - 1, STEP * family.scale[-1]))
        return self.value(family, x), gradient


def condition(problem, x):
    """Return the condition of the completion of an orbit near ``x`` (n + 1,), None without a train of impacts."""
    found = train(problem, x)
    if found is None:
        return None
    impacts, release = found
    last = max((k for k, place in enumerate(impacts)
                if time_of(problem, x, release) - time_of(problem, x, place) > LEFT), default=0)
    return Completion(problem, impacts[last - 2:last + 1], release) if last >= IMPACTS - 1 else None


def completed(problem, x):
    """Return (problem, x, error of the parameter) of the completion next to the last solution ``x`` (n + 1,) of a branch, or None.

    The problem is the given one, or if that never comes to rest, the one of motions that do.
    """
    found = train(problem, x)
    if found is None:
        made = resting(problem, x)
        found = None if made is None else train(*made)
        if found is None:
            return None
        problem, x = made
    impacts, release = found
    left = np.array([time_of(problem, x, release) - time_of(problem, x, k) for k in impacts])
    rho = ratio(Completion(problem, impacts[:3], release).restitution(problem, float(x[-1])))
    first = max(3, int(np.argmin(np.abs(left[1:] / left[:-1] - rho))))
    deepest = int(np.clip(first + np.log(LEFT / max(left[first], LEFT)) / np.log(rho), first, len(impacts) - 1))
    for path in ([deepest - 2, deepest - 1, deepest], range(first, deepest + 1)):
        values = down(problem, x, impacts, release, first, path)
        if len(values) >= 3 and abs(values[-1][-1] - x[-1]) <= NEAR * problem.scale[-1]:
            error = float(np.ptp([value[-1] for value in values[-3:]]))
            return problem, values[-1], error + 1e-15 * (abs(float(values[-1][-1])) + float(problem.scale[-1]))
    return None


def down(problem, x, impacts, release, first, path) -> list:
    """Return the solutions with the condition at impacts ``path`` of a train, one after the other, as far as they go.

    From ``x`` (n + 1,), whose impacts up to the ``first`` lie on the boundary.  A condition deep in the train leaves nothing to be
    amplified below it; one at its beginning is nearer to a poor start.
    """
    values: list = []
    at, known = x, first
    for k in path:
        own = Completion(problem, impacts[k - 2:k + 1], release)
        new = solved(problem, on_boundary(problem, at, impacts, release, known), own)
        if new is None or not falling(problem, new, impacts[:k + 1], release):
            break
        values.append(new)
        at, known = new, k
    return values


def falling(problem, x, impacts, release) -> bool:
    """Whether the times left at the impacts of a train fall, none below zero."""
    left = np.array([time_of(problem, x, release) - time_of(problem, x, k) for k in impacts])
    return bool(left[-1] > 0.0 and (np.diff(left) < 0.0).all())


def resting(problem, x):
    """Return (problem, start) of motions that rest at the end of the longest train of impacts of the orbit at ``x`` (n + 1,), which
    does not; None where it has no such train."""
    s, scene = problem.sequence, problem.scene
    if s.clock or s.closure < 0:
        return None
    T, count, size = problem.equations.numbers_at(x[-1]), len(s.nodes), 1 + scene.ns
    hits = s.nodes[:, :AFTER].tolist()
    best: list[int] = []
    for first in range(count):
        m, g = hits[first]
        if g < 0 or not T.kick[m, g] or T.ends_in[m, g] < 0:
            continue
        rho, run = ratio(float(T.ratio[m, g])), [first, first + 1]
        while len(run) < count and hits[run[-1] % count] == [m, g]:
            spans = np.diff([time_of(problem, x, k) for k in (*run[-2:], run[-1] + 1)])
            if hits[(run[-1] + 1) % count] != [m, g] or abs(spans[1] / spans[0] - rho) > ALIKE * (1 if len(run) > IMPACTS else 6):
                break
            run.append(run[-1] + 1)
        best = max(best, run, key=len)
    if len(best) < IMPACTS:
        return None
    m, g = hits[best[0] % count]
    rest, rho = int(T.ends_in[m, g]), ratio(float(T.ratio[m, g]))
    element = scene.guard(m, g).element
    releases = [k for k in scene.guards_of(rest, element) if scene.event_kind(rest, k) is EventKind.RELEASE]
    if not releases:
        return None
    times = [time_of(problem, x, k) for k in best]
    release = times[-2] + (times[-1] - times[-2]) / (1.0 - rho)
    rows = x[:-1].reshape(count, size)
    speeds = T.B[m, g, :scene.ns]
    last = rows[best[-1] % count, 1:].copy()
    arriving = float(speeds @ last / (speeds @ speeds))
    behind = best[-1] + 1
    while time_of(problem, x, behind) < release + (release - times[-IMPACTS]) and hits[behind % count] == [m, g]:
        behind += 1  # impacts of the same train that have left the boundary
    kept = [k for k in range(best[-1] + 1 - count, best[-1] + 1) if k + count >= behind]
    nodes = [[*hits[k % count], int(s.nodes[k % count, AFTER]), 0, 2 if k in best else 0] for k in kept]
    states = [np.append(time_of(problem, x, k), rows[k % count, 1:]) for k in kept]
    left = release - times[-1]
    while left > LEFT * ROOM:
        left, arriving = rho * left, rho * rho * arriving
        nodes.append([m, g, nodes[-1][2], 0, 2])
        rested = last - float(speeds @ last / (speeds @ speeds)) * speeds
        states.append(np.append(release - left, rested + arriving * speeds))
    nodes[-1][2], nodes[-1][4] = rest, 1
    nodes.append([rest, releases[0], int(s.nodes[best[0] % count, BEFORE]), 0, 0])
    states.append(np.append(release, rested))
    signature = Signature(divided(scene, np.array(nodes, np.int64), T), np.zeros(len(nodes)), s.span)
    start = np.append(np.concatenate(states), x[-1])
    return problem.with_sequence(signature, start), start


def on_boundary(problem, x, impacts, release, k):
    """Return ``x`` (n + 1,) with the impacts of a train behind its ``k``-th put on the boundary, where two ratios extrapolate."""
    scene, count, size = problem.scene, len(problem.sequence.nodes), 1 + problem.scene.ns
    T = problem.equations.numbers_at(x[-1])
    m, g = (int(v) for v in problem.sequence.nodes[impacts[0] % count, [BEFORE, GUARD]])
    rho = ratio(float(T.ratio[m, g]))
    left = time_of(problem, x, release) - time_of(problem, x, impacts[k])
    out = x.copy()
    rows = out[:-1].reshape(count, size)
    speeds = T.B[m, g, :scene.ns]
    reference = rows[impacts[k] % count, 1:].copy()
    arriving = float(speeds @ reference / (speeds @ speeds))
    rest = reference - arriving * speeds
    for place in impacts[k + 1:]:
        left, arriving = rho * left, rho * rho * arriving
        turns, row = divmod(place, count)
        rows[row] = np.append(time_of(problem, x, release) - left - turns * problem.sequence.span, rest + arriving * speeds)
    return out


def solved(problem, x, own):
    """Return the solution of the orbit's equations and the condition ``own`` near ``x`` (n + 1,), or None."""
    x, scale = x.copy(), problem.scale
    for _ in range(MAX_ITERATIONS):
        fu, fp = problem.jacobian(x[:-1], float(x[-1]))
        matrix = np.vstack([np.column_stack([fu, fp]), own.gradient(problem, x)]) * scale
        value = np.append(problem.residual(x[:-1], float(x[-1])), own.of(problem, x))
        if not (np.isfinite(matrix).all() and np.isfinite(value).all()):
            return None
        try:
            step = np.linalg.solve(matrix, -value)
        except np.linalg.LinAlgError:
            return None
        x += scale * step
        if np.abs(step).max() < TOLERANCE:
            return x
    return None
