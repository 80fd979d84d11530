"""Morse graph of a map of cells: its recurrent groups, and which leads to which.

C. Conley, Isolated Invariant Sets and the Morse Index (1978); on cells: Z. Arai et al., SIAM J. Appl. Dyn. Syst. 8 (2009).
Everything on cells is done in arrays; networkx holds the small condensed graph for reports and pictures.
"""
from typing import Any

import numpy as np

from ..._jit import njit
from .generalized import period

MOST = 1024  # groups that become nodes: all closed ones, then the largest


def morse_graph(cells: Any):
    """Return the Morse graph of a `CellMap`.

    Parameters
    ----------
    cells : CellMap

    Returns
    -------
    networkx.DiGraph
        Nodes are recurrent groups, numbered so that edges lead to lower numbers; "left" is the sink outside the grid (if
        anything leads there).  Attributes of a node: ``cells`` (int), ``closed`` (bool), ``period`` (in mappings),
        ``attractor`` (int, -1: none), ``kind`` (that of the closed group, otherwise "transient"), ``low``, ``high`` (bounds
        of the centres of its cells), ``numbers`` (its cells).  An edge says that motions lead from one group to the other; edges
        that follow from others are left out.  ``graph["omitted"]`` counts small transient groups beyond 1024.
    """
    import networkx  # heavy, for this graph alone

    parts, matrix, grid = cells._components, cells._chain, cells.grid
    sink = int(parts.label[grid.size])
    nodes = np.flatnonzero(parts.recurrent)
    weight = np.where(parts.closed[nodes], parts.size.max() + parts.size[nodes], parts.size[nodes])
    weight[nodes == sink] = 3 * parts.size.max()
    chosen = np.sort(nodes[np.argsort(-weight, kind="stable")[:MOST]])
    number = np.full(parts.total, -1)
    number[chosen] = np.arange(len(chosen))
    words = (len(chosen) + 63) // 64
    grid.require(8.0 * words, "the Morse graph")
    first = np.zeros((parts.total, words), np.uint64)
    order = np.argsort(parts.label, kind="stable")
    _reach(matrix.indptr, matrix.indices, order, parts.label, number, first)
    owners = {int(item.cells[0]): item for item in cells.groups}
    begin = np.searchsorted(parts.label[order], np.arange(parts.total + 1))
    graph = networkx.DiGraph(omitted=len(nodes) - len(chosen))
    names = [("left" if item == sink else k) for k, item in enumerate(chosen)]
    for name, item in zip(names, chosen.tolist(), strict=True):
        if name == "left":
            graph.add_node(name, cells=0, closed=True, period=1, attractor=-1, kind="left", low=None, high=None,
                           numbers=np.empty(0, np.int64))
            continue
        mine = order[begin[item]:begin[item + 1]]
        centres = grid.points(mine)
        owner = next((owners[cell] for cell in mine.tolist() if cell in owners), None) if parts.closed[item] else None
        graph.add_node(name, cells=len(mine), closed=bool(parts.closed[item]), period=period(matrix, mine),
                       attractor=-1 if owner is None else owner.attractor, kind="transient" if owner is None else str(owner.kind),
                       low=tuple(centres.min(axis=0).tolist()), high=tuple(centres.max(axis=0).tolist()), numbers=np.sort(mine))
    bits = np.unpackbits(first[chosen].view(np.uint8), axis=1, bitorder="little")[:, :len(chosen)]
    for tail, head in zip(*np.nonzero(bits), strict=True):
        if tail != head:
            graph.add_edge(names[tail], names[head])
    reduced = networkx.transitive_reduction(graph)
    graph.remove_edges_from([edge for edge in list(graph.edges) if edge not in reduced.edges])
    if "left" in graph and graph.degree("left") == 0 and not (parts.label[matrix.indices] == sink).sum() > 1:
        graph.remove_node("left")
    return graph


@njit
def _reach(indptr, indices, order, label, number, first):
    """Write the chosen groups (as bits) that the cells of each component meet first; cells come by rising component."""
    words = first.shape[1]
    for place in range(order.shape[0]):
        i = order[place]
        own = label[i]
        for edge in range(indptr[i], indptr[i + 1]):
            other = label[indices[edge]]
            if other == own:
                continue
            if number[other] >= 0:
                first[own, number[other] // 64] |= np.uint64(1) << np.uint64(number[other] % 64)
            else:
                for w in range(words):
                    first[own, w] |= first[other, w]
