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
    """Return nodes, times and states (lists) of the orbit at ``x`` (n + 1,), and how many nodes its last train has for each impact:
    friction may have an event in every flight; 0 without a train."""
    places = range(len(problem.sequence.nodes))
    nodes, times, states = ([of(k) for k in places] for of in (
        lambda k: node_at(problem, k), lambda k: time_of(problem, x, k), lambda k: state_at(problem, x, k)))
    own = nodes[-1][:AFTER]
    earlier = next((k for k in reversed(places[:-1]) if nodes[k][CLOSES] != 2 or nodes[k][:AFTER] == own), 0)
    return nodes, times, states, places[-1] - earlier if nodes[earlier][CLOSES] == 2 and nodes[earlier][:AFTER] == own else 0


def longer(problem, x, count=1):
    """Return (problem, guess) with ``count`` impacts more at the end of the train that the last node closes, or None.

    All that is not yet at rest falls by the same factor from flight to flight.
    """
    nodes, times, states, unit = listed(problem, x)
    if not unit:
        return None
    p, closing = float(x[-1]), nodes[-1]
    _, arrived, _ = apart(problem, p, closing, times[-1 - unit], states[-1 - unit])
    _, arrives, still = apart(problem, p, closing, times[-1], states[-1])
    factor = arrives / arrived
    if not 0.0 < factor < 1.0:
        return None
    end = times[-1] + (times[-1] - times[-1 - unit]) * factor / (1.0 - factor)
    repeated = [[*node[:DIVIDE], 0, 2] for node in nodes[-1 - unit:-1]]
    nodes.pop()
    for _ in range(count):
        nodes += repeated
        for _ in range(unit):
            times.append(end - factor * (end - times[-unit]))
            states.append(still + factor * (states[-unit] - still))
    return relisted(problem, x, [*nodes, closing], times, states)


def shorter(problem, x, count=1):
    """Return (problem, guess) with the last ``count`` impacts left out of the train that the last node closes, or None."""
    nodes, times, states, unit = listed(problem, x)
    closing, left = nodes[-1], len(nodes) - count * unit
    last = left - (1 if unit == 1 else 1 + unit)  # where friction has an event in every flight, one flight stays: it orders them
    if not unit or last < 0 or any(node[CLOSES] != 2 or node[:DIVIDE] != nodes[-1 - unit + (k + 1) % unit][:DIVIDE]
                                   for k, node in enumerate(nodes[last:-1], last - left)):
        return None  # another contact changes between them, or there are not so many
    return relisted(problem, x, [*nodes[:left - 1], closing], times[:left], states[:left])
