"""Where several impacts are born at one point of a branch: all branches that meet there, and which of them go on as one.

An orbit that touches k stops at once is one of up to 2^k that meet there: to first order the speeds v_i >= 0 of the impacts and
the depths w_i >= 0 to which the other touches fall short solve a linear complementarity problem, w = q p + M v, w . v = 0, in the
parameter p (Cottle, Pang and Stone 1992).  Each set of touches that are impacts has one direction in which it is a motion.  How
many multipliers lie beyond +1 is not told by the touches one by one, det M is no product of its diagonal; but the solutions at a
parameter, counted with the index of their period map, are as many on both sides (Feigin).  So they can be put in pairs, each of
which keeps the index or turns back.  Small changes of the gaps make two passing branches of them, in one of several ways: here
the way is that in which the orbit with the fewest impacts goes on as the first that it can.
"""
import collections

import numpy as np

from ...orbits.shooting.sequence import AFTER, GUARD
from .appearing import NEAR
from .successor import cycle, index
from .vanishing import listed_speeds
from .walk import located, sequences

CUT = 0.382  # periods: the phase at which times begin to be put in order, where no symmetry puts a touch


def star(problem, point, side_of, known=None):
    """Return the branches that begin at a boundary ``point`` of ``problem``, where several impacts have no speed; empty where fewer
    have, or where something else ends as well.

    Parameters
    ----------
    problem : OrbitProblem
    point : Corrected
    side_of : callable
        ``side_of(problem, x)``: the unit tangent at ``x`` along which orbits are motions, or None.
    known : tuple, optional
        What `walk.located` returns at the point.

    Returns
    -------
    list of (OrbitProblem, x, tangent, float)
        Equations, where they begin, the way in, and the sign of det(1 - M) dp/ds along it; in an order that does not depend on
        ``problem``.
    """
    known = known or located(problem, point.x)
    if len(known[1]) < 2 or not problem.scene.tables.kick.any():
        return []
    branches = []
    for made in ((problem.sequence, point.x), *sequences(problem, point.x, known)):
        new = problem.with_sequence(*made)
        if others(new) != others(problem):
            return []
        way = side_of(new, new.x0)
        if way is not None:
            branches.append((impacts(new), (new, new.x0, way, index(new, new.x0, way, 1.0))))
    return [branch for _, branch in sorted(branches, key=lambda item: item[0])]


def others(problem) -> collections.Counter:
    """Return how often every event of a sequence that is no impact is listed."""
    return collections.Counter(node for node in map(tuple, problem.sequence.nodes[:, :AFTER].tolist())
                               if node[GUARD] >= 0 and not problem.scene.tables.kick[node])


def slow_impacts(problem, x) -> list[int]:
    """Return the nodes that are impacts of no speed at ``x`` (n + 1,)."""
    kick = problem.scene.tables.kick
    return [k for k, (node, speed) in enumerate(zip(problem.sequence.nodes.tolist(), listed_speeds(problem, x), strict=True))
            if node[GUARD] >= 0 and kick[tuple(node[:AFTER])] and abs(speed) <= NEAR]


def impacts(problem) -> tuple[int, list]:
    """Return how many impacts of no speed a sequence begins with, and which, in an order of modes, guards and phases."""
    nodes, times = problem.sequence.nodes, np.ravel(problem.x0)[:-1:1 + problem.scene.ns]
    slow = sorted((*nodes[k, :AFTER].tolist(), (float(times[k]) - CUT) % 1.0) for k in slow_impacts(problem, problem.x0))
    return len(slow), slow


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
