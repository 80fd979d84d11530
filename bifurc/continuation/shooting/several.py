"""Where several impacts are born at one point of a branch: all branches that meet there, and which of them go on as one.

An orbit that touches k stops at once is one of up to 2^k that meet there: to first order the speeds v_i >= 0 of the impacts and
the depths w_i >= 0 to which the other touches fall short solve a linear complementarity problem, w = q p + M v, w . v = 0, in the
parameter p (Cottle, Pang and Stone 1992).  Each set of touches that are impacts has one direction in which it is a motion.  How
many multipliers lie beyond +1 is not told by the touches one by one, det M is no product of its diagonal; but the solutions at a
parameter, counted with the index of their period map, are as many on both sides (Feigin).  So they can be put in pairs, each of
which keeps the index or turns back.  Small changes of the gaps make two passing branches of them, in one of several ways: here
the way is that in which the orbit with the fewest impacts goes on as the first that it can.
"""
import itertools

import numpy as np

from ...orbits.shooting.sequence import AFTER, GUARD
from .appearing import NEAR, inserted, touches
from .successor import cycle, index
from .vanishing import dropped, listed_speeds

CUT = 0.382  # periods: the phase at which times begin to be put in order, where no symmetry puts a touch
MOST = 4  # impacts born at once of which the 2^k orbits are looked for


def whole(problem, x):
    """Return (problem, x, slow nodes) with every touch at ``x`` (n + 1,) an impact of no speed; None where fewer than two are, or
    where something else ends as well."""
    kick = problem.scene.tables.kick
    if problem.sequence.clock or not kick.any():
        return None
    slow = slow_impacts(problem, x)
    if len(slow) + len(touches(problem, x)) < 2:
        return None
    fewest, at = problem, x
    if slow:  # a listed impact of no speed is a touch as well: all are looked for where none is listed
        made = dropped(problem, x)
        if made is None or made[0].events + len(slow) != problem.sequence.events:
            return None
        fewest, at = problem.with_sequence(*made), made[1]
    touched = touches(fewest, at)
    if not max(2, len(slow)) <= len(touched) <= MOST or not all(kick[mode, guard] for _, mode, guard, _ in touched):
        return None
    full = problem.with_sequence(*inserted(fewest, at))
    slow = slow_impacts(full, full.x0)
    return (full, full.x0, slow) if len(slow) == len(touched) else None


def slow_impacts(problem, x) -> list[int]:
    """Return the nodes that are impacts of no speed at ``x`` (n + 1,)."""
    kick = problem.scene.tables.kick
    return [k for k, (node, speed) in enumerate(zip(problem.sequence.nodes.tolist(), listed_speeds(problem, x), strict=True))
            if node[GUARD] >= 0 and kick[tuple(node[:AFTER])] and abs(speed) <= NEAR]


def star(problem, point, side_of):
    """Return the branches that begin at a boundary ``point`` of ``problem``, where several impacts have no speed; empty where fewer
    have.

    Parameters
    ----------
    problem : OrbitProblem
    point : Corrected
    side_of : callable
        ``side_of(problem, x)``: the unit tangent at ``x`` along which orbits are motions, or None.

    Returns
    -------
    list of (OrbitProblem, x, tangent, float)
        Equations, where they begin, the way in, and the sign of det(1 - M) dp/ds along it; in an order that does not depend on
        ``problem``.
    """
    found = whole(problem, point.x)
    if found is None:
        return []
    full, at, slow = found
    nodes, times = full.sequence.nodes, np.ravel(at)[:-1:1 + full.scene.ns]
    slow.sort(key=lambda k: (*nodes[k, :AFTER].tolist(), (float(times[k]) - CUT) % 1.0))
    branches = []
    for size in range(len(slow) + 1):
        for staying in itertools.combinations(slow, size):
            made = (full.sequence, at) if size == len(slow) else dropped(full, at, staying=frozenset(staying))
            if made is None:
                continue
            new = problem.with_sequence(*made)
            way = side_of(new, new.x0)
            if way is not None:
                branches.append((new, new.x0, way, index(new, new.x0, way, 1.0)))
    return branches


def goes_on(problem, branches):
    """Return the (problem, x, tangent) that goes on from the branch of ``problem`` among the ``branches`` of a `star`; None where
    there is none."""
    left = list(branches)
    while left:
        one = left.pop(0)
        other = next((k for k, branch in enumerate(left) if branch[3] * one[3] < 0.0), None)
        if other is None:
            continue
        pair = one, left.pop(other)
        for this, beyond in (pair, pair[::-1]):
            if cycle(this[0]) == cycle(problem):
                return beyond[:3]
    return None
