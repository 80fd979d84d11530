"""The graph of a diagram: special points and ends are nodes, the pieces of branches between them are edges.

A node of two branches is one: a doubled orbit ends on the orbit that doubles, an impacting one on the orbit that touches, a
crossing branch at the branch point.  They are recognised by the parameter and by the section points, which agree as sets.
"""
from collections.abc import Sequence

import networkx as nx

from ..continuation.branches.branch import Branch
from ..orbits.orbit import PeriodicOrbit
from .identity import CLOSE, PARAMETER, periods_of, same_points

AT_POINT = ("no_successor", "stopped")  # reasons of an end for which a special point beside it is that end


def graph_of(branches: Sequence[Branch], bounds: tuple[float, float]) -> nx.MultiGraph:
    """Return the graph of some branches over one parameter.

    Nodes have ``kind`` (of the special point, or why a branch ends), ``parameter``, ``measures`` (dict) and ``branches``.
    Edges have ``branch`` (number), ``periods``, ``stable`` (bool), ``low`` and ``high`` (parameter), ``points`` (rows).
    """
    graph = nx.MultiGraph()
    tolerance = PARAMETER * (bounds[1] - bounds[0])
    orbits: dict[int, PeriodicOrbit] = {}

    def node(kind: str, value: float, orbit, branch: int, measures: dict) -> int:
        for n, data in graph.nodes(data=True):
            if abs(data["parameter"] - value) <= tolerance and (branch not in data["branches"] or data["kind"] == kind) \
                    and same_points(orbit, orbits[n], CLOSE):
                data["branches"] = sorted({*data["branches"], branch})
                if kind not in data["kind"].split(" + "):
                    data["kind"] += f" + {kind}"
                return n
        n = graph.number_of_nodes()
        graph.add_node(n, kind=kind, parameter=value, measures=measures, branches=[branch])
        orbits[n] = orbit
        return n

    for k, branch in enumerate(branches):
        s, p, stable = branch.column("s"), branch.column("parameter"), branch.column("stable")
        points = sorted(branch.special_points, key=lambda point: point.s)
        marks = [(point.s, str(point.kind), point.parameter, point.solution, dict(_measures(point))) for point in points]
        closed = branch.closed
        if not closed:
            ends: list[tuple] = [(float(s[i]), str(branch.ends[side].reason), float(p[i]), branch.orbits[i], {})
                                 for side, i in ((0, 0), (1, -1))]
            for end in ends:  # a special point at the very end is the end
                if not any(abs(mark[0] - end[0]) <= 1e-3 * (s[-1] - s[0] + 1e-300) and abs(mark[2] - end[2]) <= 1e-4 * (
                        bounds[1] - bounds[0]) and end[1] in AT_POINT for mark in marks):
                    marks.append(end)
            marks.sort(key=lambda mark: mark[0])
        elif not marks:
            marks = [(float(s[0]), "closed", float(p[0]), branch.orbits[0], {})]
        made = [node(kind, value, orbit, k, measures) for _, kind, value, orbit, measures in marks]
        stretches = list(zip(made, made[1:], marks, marks[1:], strict=False))
        if closed:
            stretches.append((made[-1], made[0], marks[-1], marks[0]))
        for a, b, first, last in stretches:
            inside = (s >= first[0]) & (s <= last[0]) if last[0] > first[0] else (s >= first[0]) | (s <= last[0])
            rows = [i for i in range(len(s)) if inside[i]]
            values = [float(p[i]) for i in rows] + [first[2], last[2]]
            share = [stable[i] == 1 for i in rows if first[0] < s[i] < last[0]] or [stable[i] == 1 for i in rows]
            graph.add_edge(a, b, branch=k, periods=periods_of(branch), stable=bool(share) and sum(share) * 2 > len(share),
                           low=min(values), high=max(values), points=len(rows))
    return graph


def _measures(point):
    """Yield the measures of a special point that a table shows."""
    for name in ("max_0", "min_0", "rms_0"):
        if name in point.measures:
            yield name, float(point.measures[name])
