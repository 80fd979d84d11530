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

Where a mass matrix passes the impulse on to a mass that friction holds, that mass slips behind each impact until friction has taken
the impulse away.  The slip lasts as long as tau^2 does, the flight as tau: near the boundary it is a second impulse in the same
instant, and r in the above is what it leaves of the restitution (`rebound`).

Where friction of the mass itself turns at the top of every flight, it brakes the way up and the way back by turns: the release is
where the push no longer overcomes it, and ``c tau`` is what moves the mass back alone.  Then tau falls to ``C tau^(4/3)``, no ratio
is that of the boundary, and a few impacts are as slow as rounding: where the rest vanishes is known as far as those are listed.

One file, because listing, condition and descent share the places of the impacts of a train.
"""
import math
from itertools import pairwise

import numpy as np

from ...elements import EventKind
from ...flow.chatter import flight_mode, moved_row
from ...orbits.autonomous import wound
from ...orbits.shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE
from ...orbits.shooting.signature import Signature, divided
from ..conditions import Condition, difference

IMPACTS = 6  # of a train, at least
UNITS = (1, 2, 3)  # nodes of a flight of a train: one friction or two may have an event in each
DEEP = 1e-7, 1e-9  # periods left at the last impact whose ratio is used, of which rounding of times is 1e-9; and at the last one
# that is written out
DEEP_SLIPS = 1e-4, 1e-6  # the same where friction has an event in every flight: its end is no longer divided by its duration, and
# known to the rounding of a position over the speed, which falls as the square of the time left
ALIKE = 0.03  # by which a ratio may differ from that of the boundary in a start
MAX_ITERATIONS, FAR = 30, 1.0  # of Newton's method; a scaled step of it that leads away
TOLERANCE = 1e-12  # scaled step of Newton's method
CALM, RESIDUAL = 1e-6, 1e-12  # twice a scaled step so small at equations solved to that: the rest is rounding of short flights
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
    listed impacts in the sequence, counted on below zero where they lie in the span before, and of the release that follows;
    None where there is none."""
    s, scene = problem.sequence, problem.scene
    count, found = len(s.nodes), None
    for i in np.flatnonzero(s.nodes[:, CLOSES] == 1).tolist():
        m, g = node_at(problem, i + 1)[:AFTER]
        if g < 0 or scene.event_kind(m, g) is not EventKind.RELEASE:
            continue
        own, impacts = node_at(problem, i)[:AFTER], [i]
        for k in range(i - 1, i - count, -1):
            if s.nodes[k, CLOSES] != 2:
                break
            if node_at(problem, k)[:AFTER] == own:
                impacts.insert(0, k)
        rest = time_of(problem, x, i + 1) - time_of(problem, x, i)
        if len(impacts) > 1 and impacts[-1] - impacts[-2] > 1 and moved_row(problem.equations.numbers_at(float(x[-1])), *own) < 0:
            continue  # friction turns in every flight
        if len(impacts) >= IMPACTS and (found is None or rest < found[0]):
            found = rest, impacts, i + 1
    return None if found is None else found[1:]


def node_at(problem, k) -> list[int]:
    """Return mode before, guard, mode after, 0 and the closing of node ``k``, which may be one of the span before or after: of a
    motion solved on its half period the mirror image."""
    s, scene = problem.sequence, problem.scene
    turns, place = divmod(k, len(s.nodes))
    before, guard, after, _, closes = (int(v) for v in s.nodes[place, :CLOSES + 1])
    if s.closure < 0 and turns % 2:
        guard = scene.mirror_guard(before, guard) if guard >= 0 else guard
        before, after = scene.mirror(before), scene.mirror(after)
    return [before, guard, after, 0, closes]


def state_at(problem, x, k) -> np.ndarray:
    """Return the state (ns,) before node ``k`` of the orbit at ``x`` (n + 1,), see `node_at`."""
    s = problem.sequence
    turns, place = divmod(k, len(s.nodes))
    return (-1.0 if s.closure < 0 and turns % 2 else 1.0) * x[:-1].reshape(len(s.nodes), -1)[place, 1:]


def slope_of_time(problem, k) -> list[tuple[int, float]]:
    """Return by which unknowns the time of node ``k`` is given, and their factors; what else there is of it is a number."""
    s = problem.sequence
    turns, place = divmod(k, len(s.nodes))
    own = [(place * (1 + problem.scene.ns), 1.0)]
    if not s.clock:
        return own
    return [(0, float(turns)), *(own if place else [])]  # the first unknown holds the period, its node is at time zero


def time_of(problem, x, k) -> float:
    """Return the time of node ``k``, periods (of a motion without a clock its unit of time), see `node_at`."""
    turns = k // len(problem.sequence.nodes)
    return turns * problem.sequence.span + sum(factor * float(x[place]) for place, factor in slope_of_time(problem, k))


def rebound(problem, x, k) -> float:
    """Return what of its arriving speed impact ``k`` of the orbit at ``x`` (n + 1,) leaves to the flight behind it, dimensionless:
    the restitution, less what goes with the impulse of a friction that the impact lets slip.

    That impulse, beside that of the stop, is along what friction adds to the accelerations once it slips, and ends the slip.
    """
    T, n, kernel = problem.equations.numbers_at(float(x[-1])), problem.scene.n, problem.equations.kernel
    node = node_at(problem, k)
    m, g = node[:BEFORE + 2]
    r = float(T.ratio[m, g])
    other, slides = flight_mode(T, m, g)
    if moved_row(T, m, g) < 0 or other < 0:
        return r
    time = time_of(problem, x, k)
    direction, _, still = apart(problem, float(x[-1]), node, time, state_at(problem, x, k))
    z, held, slips = problem._joined(np.append(time, still)), np.empty(problem.scene.ns), np.empty(problem.scene.ns)
    kernel.field(T, m, z, held)
    kernel.field(T, other, z, slips)
    force, own = slips[n:2 * n] - held[n:2 * n], slice(n, 2 * n)
    begins = T.G[other, slides, own] @ (direction - (1.0 + r) * T.B[m, g])[own]
    return r + float(T.GT[m, g, own, 1] @ force) * float(begins / (T.G[other, slides, own] @ force))


def apart(problem, p, node, time, state):
    """Return how impacts move the state (ns,) where they stop the speed 1, see `flow.chatter`, the speed at which a ``node`` is
    reached at a ``time`` with a ``state`` (ns,), and that state with the speed put to rest."""
    T, n = problem.equations.numbers_at(p), problem.scene.n
    m, g = node[:AFTER]
    direction = T.B[m, g].copy()
    if moved_row(T, m, g) >= 0:
        direction[n:2 * n] = T.D[m, g, :n]
    arriving = problem.arriving(node, np.append(time, state))
    return direction, arriving, state - arriving * direction


def relisted(problem, x, nodes, times, states):
    """Return (problem, x) with the orbit at ``x`` (n + 1,) listed as ``nodes`` (m, 5) over one span, at ``times`` (m,) and with the
    ``states`` (m, ns) before them; a motion without a clock begins at the first."""
    s, scene = problem.sequence, problem.scene
    span = float(x[0]) if s.clock else s.span
    rows = divided(scene, np.array(nodes, np.int64), problem.equations.numbers_at(x[-1]), s.closure)
    signature = Signature(rows, np.zeros(len(nodes)), span, s.closure)
    unknowns = np.column_stack([times, states]).ravel()
    if s.clock:
        signature, unknowns = wound(signature, unknowns, s.clock, None)
    start = np.append(unknowns, x[-1])
    return problem.with_sequence(signature, start), start


def begun_at(problem, x, first):
    """Return (problem, x) with the orbit at ``x`` (n + 1,) listed from node ``first`` on."""
    places = range(first, first + len(problem.sequence.nodes))
    return relisted(problem, x, [node_at(problem, k) for k in places], [time_of(problem, x, k) for k in places],
                    [state_at(problem, x, k) for k in places])


class Completion(Condition):
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
        super().__init__(problem)
        self.impacts, self.release = tuple(impacts), release

    def ratio(self, problem, x) -> float:
        """Return that of successive times left on the boundary."""
        return ratio(rebound(problem, x, self.impacts[0]))

    def of(self, problem, x) -> float:
        """Return the value of the condition at ``x`` = (u, a) (n + 1,), dimensionless."""
        a, b, c = (time_of(problem, x, self.release) - time_of(problem, x, k) for k in self.impacts)
        rho = self.ratio(problem, x)
        return (c / b - rho * b / a) / (1.0 - rho) - rho

    def gradient(self, problem, x) -> np.ndarray:
        """Return the derivatives of `of` (n + 1,), own units."""
        a, b, c = (time_of(problem, x, self.release) - time_of(problem, x, k) for k in self.impacts)
        rho = self.ratio(problem, x)
        slopes = np.array([rho * b / a**2, -c / b**2 - rho / a, 1.0 / b]) / (1.0 - rho)
        out = np.zeros(x.size)
        for k, slope in [*zip(self.impacts, -slopes, strict=True), (self.release, slopes.sum())]:
            for place, factor in slope_of_time(problem, k):
                out[place] += factor * slope
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


def deep(impacts) -> tuple[float, float]:
    """Return `DEEP` of a train with ``impacts`` (places)."""
    return DEEP if impacts[-1] - impacts[-2] == 1 else DEEP_SLIPS


def condition(problem, x):
    """Return the condition of the completion of an orbit near ``x`` (n + 1,), None without a train of impacts."""
    found = train(problem, x)
    if found is None:
        return None
    impacts, release = found
    last = max((k for k, place in enumerate(impacts)
                if time_of(problem, x, release) - time_of(problem, x, place) > deep(impacts)[0]), default=0)
    return Completion(problem, impacts[last - 2:last + 1], release) if last >= IMPACTS - 1 else None


def completion_near(problem, x):
    """Return (problem, x, error of the parameter) of the completion next to the last solution ``x`` (n + 1,) of a branch, or None.

    The problem is the given one, or if that never comes to rest, the one of motions that do.
    """
    found = train(problem, x)
    if found is not None and problem.sequence.clock and found[1] % len(problem.sequence.nodes):
        problem, x = begun_at(problem, x, found[1])  # the first node of such a motion has no time of its own that could be moved
        found = train(problem, x)
    if found is None:
        made = resting(problem, x)
        found = None if made is None else train(*made)
        if found is None:
            return None
        problem, x = made
    impacts, release = found
    left = np.array([time_of(problem, x, release) - time_of(problem, x, k) for k in impacts])
    rho = ratio(rebound(problem, x, impacts[0]))
    first = max(3, int(np.argmin(np.abs(left[1:] / left[:-1] - rho))))
    deepest = int(np.clip(first + np.log(deep(impacts)[0] / left[first]) / np.log(rho), IMPACTS - 1, len(impacts) - 1))
    first = min(first, deepest - 2)
    for path in ([deepest - 2, deepest - 1, deepest], range(first, deepest + 1)):
        values = down(problem, x, impacts, release, first, path)
        if len(values) < 3:
            continue
        error, k = min((float(np.ptp([value[-1] for value, _ in three])) + max(noise for _, noise in three), 2 + i)
                       for i, three in enumerate(zip(values, values[1:], values[2:], strict=False)))
        at = values[k][0]
        if abs(at[-1] - x[-1]) <= NEAR * problem.scale[-1]:
            return problem, at, error + 1e-15 * (abs(float(at[-1])) + float(problem.scale[-1]))
    return None


def down(problem, x, impacts, release, first, path) -> list:
    """Return the solutions with the condition at impacts ``path`` of a train, one after the other, as far as they go, each with
    the noise of its parameter.

    From ``x`` (n + 1,), whose impacts up to the ``first`` lie on the boundary.  A condition deep in the train leaves nothing to be
    amplified below it; one at its beginning is nearer to a poor start.
    """
    values: list = []
    at, known = x, first
    for k in path:
        own = Completion(problem, impacts[k - 2:k + 1], release)
        new, noise = solved(problem, on_boundary(problem, at, impacts, release, known), own)
        if new is None or not falling(problem, new, impacts[:k + 1], release):
            break
        values.append((new, noise))
        at, known = new, k
    return values


def falling(problem, x, impacts, release) -> bool:
    """Whether the times left at the impacts of a train fall, none below zero."""
    left = np.array([time_of(problem, x, release) - time_of(problem, x, k) for k in impacts])
    return bool(left[-1] > 0.0 and (np.diff(left) < 0.0).all())


def resting(problem, x):
    """Return (problem, start) of motions that rest at the end of the longest train of impacts of the orbit at ``x`` (n + 1,), which
    does not; None where it has no such train."""
    s, scene, p = problem.sequence, problem.scene, float(x[-1])
    count = len(s.nodes)
    best = max((run for first in range(count) for unit in UNITS if (run := falling_train(problem, x, first, unit))), key=len,
               default=[])
    if len(best) < IMPACTS:
        return None
    hit = node_at(problem, best[0])[:AFTER]
    m, g = hit
    rest, rho, unit = int(problem.equations.numbers_at(p).ends_in[m, g]), ratio(rebound(problem, x, best[0])), best[1] - best[0]
    element = scene.guard(m, g).element
    releases = [k for k in scene.guards_of(rest, element) if scene.event_kind(rest, k) is EventKind.RELEASE]
    if not releases:
        return None
    at = [time_of(problem, x, k) for k in best]
    release = at[-2] + (at[-1] - at[-2]) / (1.0 - rho)
    behind = best[-1] + 1
    while time_of(problem, x, behind) < release + (release - at[-IMPACTS]) and alike(problem, behind, unit):
        behind += 1  # impacts of the same train that have left the boundary
    if node_at(problem, behind)[BEFORE] != hit[BEFORE]:
        return None
    kept = range(behind - count, best[-1] + 1)
    nodes = [[*node_at(problem, k)[:DIVIDE], 0, 2 if best[0] <= k else 0] for k in kept]
    times, states = [time_of(problem, x, k) for k in kept], [state_at(problem, x, k) for k in kept]
    still = apart(problem, p, hit, at[-1], states[-1])[-1]
    for flight in flights(problem, x, best[-2], best[-1], release, still, rho):
        for node, time, state in flight:
            nodes.append([*node[:DIVIDE], 0, 2])
            times.append(time)
            states.append(state)
        if release - times[-1] <= deep(best)[1]:
            break
    nodes[-1][AFTER], nodes[-1][CLOSES] = rest, 1
    nodes.append([rest, releases[0], node_at(problem, best[0])[BEFORE], 0, 0])
    return relisted(problem, x, nodes, [*times, release], [*states, still])


def falling_train(problem, x, first, unit) -> list[int]:
    """Return the places of impacts, every ``unit`` nodes one from node ``first`` on, as many as fall like those on the boundary of
    the orbit at ``x`` (n + 1,); empty where there is no such impact."""
    T, count, run = problem.equations.numbers_at(float(x[-1])), len(problem.sequence.nodes), [first, first + unit]
    hit = node_at(problem, first)[:AFTER]
    m, g = hit
    if g < 0 or not T.kick[m, g] or T.ends_in[m, g] < 0:
        return []
    rho = ratio(rebound(problem, x, first))
    while run[-1] - first + unit < count and alike(problem, run[-1], unit):
        spans = np.diff([time_of(problem, x, k) for k in (*run[-2:], run[-1] + unit)])
        if not all(alike(problem, run[-1] + k, unit) for k in range(1, unit + 1)) \
                or abs(spans[1] / spans[0] - rho) > ALIKE * (1 if len(run) > IMPACTS else 6):
            break
        run.append(run[-1] + unit)
    return run


def alike(problem, k, unit) -> bool:
    """Whether node ``k`` is the same event as the one ``unit`` nodes, a flight, before."""
    return node_at(problem, k)[:AFTER] == node_at(problem, k - unit)[:AFTER]


def flights(problem, x, before, last, release, still, rho):
    """Yield the nodes (node, time, state) of the flights behind impact ``last`` of a train of the orbit at ``x`` (n + 1,) on the
    boundary, as those of the flight from the impact ``before`` it: the times left fall by ``rho``, all that is not at rest by its
    square.  ``still`` (ns,) is the state at rest, ``release`` the time of its end."""
    begun, at = time_of(problem, x, before), time_of(problem, x, last)
    nodes = [(node_at(problem, k), time_of(problem, x, k) - begun, state_at(problem, x, k) - still)
             for k in range(before + 1, last + 1)]
    left, square = release - at, 1.0
    while True:
        square *= rho * rho
        found = [(node, release - left + square * later, still + square * moves) for node, later, moves in nodes]
        left *= rho
        found[-1] = nodes[-1][0], release - left, found[-1][-1]
        yield found


def on_boundary(problem, x, impacts, release, k):
    """Return ``x`` (n + 1,) with the impacts of a train behind its ``k``-th put on the boundary, where two ratios extrapolate."""
    s, p = problem.sequence, float(x[-1])
    hit, end = node_at(problem, impacts[0]), time_of(problem, x, release)
    still = apart(problem, p, hit, time_of(problem, x, impacts[k]), state_at(problem, x, impacts[k]))[-1]
    out = x.copy()
    rows, made = out[:-1].reshape(len(s.nodes), -1), flights(problem, x, impacts[k - 1], impacts[k], end, still,
                                                            ratio(rebound(problem, x, impacts[0])))
    for begin, last in pairwise(impacts[k:]):
        flight = next(made)
        for place, (_, time, state) in zip(range(last, begin, -1), reversed(flight), strict=False):
            turns, row = divmod(place, len(s.nodes))
            sign = -1.0 if s.closure < 0 and turns % 2 else 1.0
            rows[row] = np.append(time - turns * (x[0] if s.clock else s.span), sign * state)
    return out


def solved(problem, x, own):
    """Return the orbit's solution with the condition ``own`` near ``x`` (n + 1,), or None; and the parameter's last step."""
    scale, calm = problem.scale, 0
    for _ in range(MAX_ITERATIONS):
        fu, fp = problem.jacobian(x[:-1], float(x[-1]))
        matrix = np.vstack([np.column_stack([fu, fp]), own.gradient(problem, x)]) * scale
        value = np.append(problem.residual(x[:-1], float(x[-1])), own.of(problem, x))
        if not (np.isfinite(matrix).all() and np.isfinite(value).all()):
            break
        try:
            step = np.linalg.solve(matrix, -value)
        except np.linalg.LinAlgError:
            break
        size, x = np.abs(step).max(), x + scale * step
        if not size <= FAR:
            break
        calm = calm + 1 if np.abs(value[:-1]).max() <= RESIDUAL and max(size, abs(value[-1])) <= CALM else 0
        if size < TOLERANCE or calm > 1:
            return x, abs(float(scale[-1] * step[-1]))
    return None, math.inf
