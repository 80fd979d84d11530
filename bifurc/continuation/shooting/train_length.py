"""How many impacts of a complete chattering are listed before the rest is closed in closed form.

The closing (`OrbitProblem.closure`) asks for impacts more where it comes too early, for less where the last ones are nothing but
rounding.  Speeds fall by the restitution from impact to impact, and the closing with them: as many are listed as bring it nearly
to the other end of what it may be, so that a restitution near one does not change its list at every step.  Where that is not the
same motion the change is left to `successor`, which reads forced motions from simulation.
"""
import math

import numpy as np

from ...orbits.shooting.sequence import AFTER, CLOSES, DIVIDE
from .completion import apart, begun_at, node_at, relisted, state_at, time_of

SPARE = 0.7  # logarithm of the closure of the last impact but one below which the last is one too many
SLACK = 0.3  # logarithm by which a closure may pass its threshold: its error is of second order; orbits are found with next to none
ROOM = 0.9 * (SPARE + SLACK)  # logarithm by which a closure may change with the number of impacts
AHEAD = (1e-5, 1e-4, 1e-3)  # scaled lengths of the step behind the change at which the new equations must hold


def relengthened(problem, point):
    """Return (problem, x, tangent) with impacts more or less in a complete chattering of the orbit at ``point``; None where
    neither is admissible ahead."""
    boundary = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    T = problem.equations.numbers_at(float(point.x[-1]))
    for i in np.flatnonzero(problem.sequence.nodes[:, CLOSES] == 1).tolist():
        at, x = begun_at(problem, point.x, i + 1)
        r = float(T.ratio[tuple(problem.sequence.nodes[i, :AFTER].tolist())])
        most = max(1, int(ROOM / (-2.0 * math.log(r)))) if 0.0 < r < 1.0 else 1  # it falls with r, or with its square
        for change, count in ((change, count) for change in (longer, shorter) for count in sorted({most, 1}, reverse=True)):
            found = change(at, x, count)
            if found is None:
                continue
            new, guess = found
            c = new.correct(guess, np.eye(1, guess.size, guess.size - 1)[0], True)
            if not c.converged:
                continue
            tangent = c.tangent if c.tangent[-1] * point.tangent[-1] > 0.0 else -c.tangent
            for step in AHEAD:
                ahead = new.correct(c.x + step * new.scale * tangent, tangent)
                if ahead.converged and all(ahead.monitors[k] < 0.0 for k in boundary):
                    return new, c.x, tangent
    return None


def listed(problem, x):
    """Return nodes, times and states (lists) of the orbit at ``x`` (n + 1,), and the place of the last impact but one of its last
    train."""
    places = range(len(problem.sequence.nodes))
    nodes, times, states = ([of(k) for k in places] for of in (
        lambda k: node_at(problem, k), lambda k: time_of(problem, x, k), lambda k: state_at(problem, x, k)))
    own = nodes[-1][:AFTER]
    earlier = next((k for k in reversed(places[:-1]) if nodes[k][CLOSES] == 2 and nodes[k][:AFTER] == own), None)
    return nodes, times, states, earlier


def longer(problem, x, count=1):
    """Return (problem, guess) with ``count`` impacts more at the end of the train that the last node closes, or None."""
    nodes, times, states, earlier = listed(problem, x)
    if earlier is None:
        return None
    p, closing = float(x[-1]), nodes[-1]
    r = float(problem.equations.numbers_at(p).ratio[tuple(closing[:AFTER])])
    gradient, arriving, still = apart(problem, p, closing, states[-1])
    flight, leading = times[-1] - times[earlier], [*nodes[earlier][:DIVIDE], 0, 2]
    for k in range(1, count + 1):
        nodes[-1:] = [leading, closing]
        times.append(times[-1] + r**k * flight)
        states.append(still + r**k * arriving * gradient)
    return relisted(problem, x, nodes, times, states)


def shorter(problem, x, count=1):
    """Return (problem, guess) with the last ``count`` impacts left out of the train that the last node closes, or None."""
    nodes, times, states, _ = listed(problem, x)
    closing, left = nodes[-1], len(nodes) - count
    if left < 1 or any(node[CLOSES] != 2 or node[:AFTER] != closing[:AFTER] for node in nodes[left - 1:-1]):
        return None  # another contact changes between them, or there are not so many
    nodes = [*nodes[:left - 1], [*nodes[left - 1][:DIVIDE], 0, 1]]
    nodes[-1][AFTER] = closing[AFTER]
    return relisted(problem, x, nodes, times[:left], states[:left])
