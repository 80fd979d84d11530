"""How many impacts of a complete chattering are listed before the rest is closed in closed form, where the period is unknown.

The closing (`OrbitProblem.closure`) asks for one impact more where it comes too early, for one less where the last ones are nothing
but rounding.  Forced motions are read from simulation there (`successor`), which has no period to go by without a clock.
"""
import numpy as np

from ...orbits.shooting.sequence import AFTER, CLOSES, DIVIDE
from .completion import apart, begun_at, node_at, relisted, state_at, time_of

AHEAD = (1e-5, 1e-4, 1e-3)  # scaled lengths of the step behind the change at which the new equations must hold


def relengthened(problem, point):
    """Return (problem, x, tangent) with one impact more or less in a complete chattering of the orbit at ``point``; None where
    neither is admissible ahead."""
    boundary = [k for k, monitor in enumerate(problem.monitors) if monitor.boundary]
    for i in np.flatnonzero(problem.sequence.nodes[:, CLOSES] == 1).tolist():
        at, x = begun_at(problem, point.x, i + 1)
        for change in (longer, shorter):
            found = change(at, x)
            if found is None:
                continue
            new, guess = found
            c = new.correct(guess, new.null_tangent(guess), True)
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


def longer(problem, x):
    """Return (problem, guess) with one impact more at the end of the train that the last node closes, or None."""
    nodes, times, states, earlier = listed(problem, x)
    if earlier is None:
        return None
    p, closing = float(x[-1]), nodes[-1]
    r = float(problem.equations.numbers_at(p).ratio[tuple(closing[:AFTER])])
    gradient, arriving, still = apart(problem, p, closing, states[-1])
    nodes[-1] = [*nodes[earlier][:DIVIDE], 0, 2]
    nodes.append(closing)
    times.append(times[-1] + r * (times[-1] - times[earlier]))
    states.append(still + r * arriving * gradient)
    return relisted(problem, x, nodes, times, states)


def shorter(problem, x):
    """Return (problem, guess) with the last impact left out of the train that the last node closes, or None."""
    nodes, times, states, earlier = listed(problem, x)
    if earlier is None or earlier != len(nodes) - 2:  # another contact changes between the last two
        return None
    closing = nodes.pop()
    nodes[-1] = [*nodes[-1][:DIVIDE], 0, 1]
    nodes[-1][AFTER] = closing[AFTER]
    return relisted(problem, x, nodes, times[:-1], states[:-1])
