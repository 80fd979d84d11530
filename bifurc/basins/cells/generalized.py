"""Generalized cell mapping: a cell has many images with probabilities, a Markov chain over cells.

C. S. Hsu, Cell-to-Cell Mapping (Springer 1987), chapters 10 to 12.  Strongly connected components of the chain's graph
are found by scipy; they are visited in topological order, so that absorption probabilities and times come by
substitution, with a small linear solve for each component of more than one cell.
"""
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph, linalg

from ..._jit import njit

DIRECT = 20000  # cells of a component up to which its equations are factorised; larger ones are iterated
TOLERANCE = 1e-13  # of iterated solutions
SWEEPS = 200000  # most of them


class Components(NamedTuple):
    """Strongly connected components of a chain of N cells and a sink, cell N."""

    label: np.ndarray  # (N + 1,) int64; an edge leads to a component of the same or a lower number
    total: int  # number of them
    size: np.ndarray  # (total,) cells
    recurrent: np.ndarray  # (total,) bool: a motion may come back (more than one cell, or an image of itself)
    closed: np.ndarray  # (total,) bool: nothing leads out


def transition(rows: np.ndarray, columns: np.ndarray, size: int) -> sparse.csr_matrix:
    """Return the matrix (size + 1, size + 1) of a chain from single images; row ``size`` is the sink's.

    Parameters
    ----------
    rows, columns : ndarray of int, shape (k,)
        Cell and image cell of each sample; a column outside 0 .. size - 1 is the sink.  A cell with no sample has no
        image: its row is empty but for the sink.
    size : int
        Number N of cells.

    Returns
    -------
    scipy.sparse.csr_matrix
        Rows sum to 1.
    """
    kind = np.int32 if size < 2**31 - 1 else np.int64
    columns = np.where((columns < 0) | (columns >= size), size, columns).astype(kind)
    counts = np.bincount(rows, minlength=size + 1)
    empty = np.flatnonzero(counts == 0)  # the sink among them
    rows = np.concatenate((rows.astype(kind), empty.astype(kind)))
    columns = np.concatenate((columns, np.full(empty.size, size, kind)))
    counts[empty] = 1
    matrix = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(size + 1, size + 1))  # sums repeated edges
    matrix.data /= np.repeat(counts, np.diff(matrix.indptr))
    return matrix


def components(matrix: sparse.csr_matrix) -> Components:
    """Return the strongly connected components of a chain, numbered so that edges lead to lower numbers."""
    count, label = csgraph.connected_components(matrix, directed=True, connection="strong")
    label = label.astype(np.int64)
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    tail, head = label[rows], label[matrix.indices]
    if (tail < head).any():  # scipy's order is topological (Pearce), which is not documented: checked, and made so
        label = _sorted(count, tail, head)[label]
        tail, head = label[rows], label[matrix.indices]
    size = np.bincount(label, minlength=count)
    closed = np.ones(count, bool)
    closed[tail[tail != head]] = False
    recurrent = size > 1
    recurrent[label[rows[rows == matrix.indices]]] = True
    return Components(label, int(count), size, recurrent, closed)


def _sorted(count: int, tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Return new numbers (count,) of components so that edges lead to lower ones (Kahn, from the ends)."""
    away = tail != head
    edges = np.unique(np.stack((head[away], tail[away]), axis=1), axis=0)  # by head: who leads here
    begin = np.searchsorted(edges[:, 0], np.arange(count + 1))
    waits = np.bincount(edges[:, 1], minlength=count)
    number, ready, done = np.empty(count, np.int64), list(np.flatnonzero(waits == 0)[::-1]), 0
    while ready:
        item = ready.pop()
        number[item], done = done, done + 1
        for before in edges[begin[item]:begin[item + 1], 1]:
            waits[before] -= 1
            if waits[before] == 0:
                ready.append(before)
    return number


def solved(matrix: sparse.csr_matrix, found: Components, fixed: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Return x with x = P x + source on transient cells and x as given on those of closed components.

    Parameters
    ----------
    matrix : csr_matrix
        The chain P, (N + 1, N + 1).
    found : Components
    fixed : ndarray
        (N + 1, k): values on the cells of closed components; others are overwritten in a copy.
    source : ndarray
        (N + 1,): added on transient cells.
    """
    x = np.ascontiguousarray(fixed, float).copy()
    order = np.argsort(found.label, kind="stable")
    begin = np.searchsorted(found.label[order], np.arange(found.total + 1))
    blocks = np.flatnonzero((found.size > 1) & ~found.closed)
    where = np.zeros(len(order), np.int64)
    done = 0
    for block in [*blocks.tolist(), found.total]:
        _substitute(matrix.indptr, matrix.indices, matrix.data, order[begin[done]:begin[block]], found.closed, found.label,
                    x, source)
        if block < found.total:
            cells = np.sort(order[begin[block]:begin[block + 1]])
            _solve_block(matrix, cells, x, source, where)
        done = block + 1
    return x


@njit
def _substitute(indptr, indices, data, cells, closed, label, x, source):
    """Write x of single transient cells from those of their images, a chance to stay divided out."""
    for place in range(cells.shape[0]):
        i = cells[place]
        if closed[label[i]]:
            continue
        stay = 0.0
        for c in range(x.shape[1]):
            x[i, c] = source[i]
        for edge in range(indptr[i], indptr[i + 1]):
            j = indices[edge]
            if j == i:
                stay += data[edge]
            else:
                for c in range(x.shape[1]):
                    x[i, c] += data[edge] * x[j, c]
        for c in range(x.shape[1]):
            x[i, c] /= 1.0 - stay


def _solve_block(matrix, cells, x, source, where) -> None:
    """Write x of the cells of one transient component of several cells; all it leads to is known."""
    rows = matrix[cells]
    where[cells] = np.arange(1, len(cells) + 1)
    inner = where[rows.indices] > 0
    outside = rows.copy()
    outside.data = np.where(inner, 0.0, rows.data)
    inside = sparse.csr_matrix((rows.data * inner, np.where(inner, where[rows.indices] - 1, 0), rows.indptr),
                               shape=(len(cells), len(cells)))
    right = outside @ x + source[cells][:, None]
    if len(cells) <= DIRECT:
        x[cells] = linalg.splu((sparse.identity(len(cells)) - inside).tocsc()).solve(right)
    else:
        value = right.copy()
        for _ in range(SWEEPS):
            new = inside @ value + right
            change = np.abs(new - value).max()
            value = new
            if change <= TOLERANCE * max(np.abs(value).max(), 1e-300):
                break
        else:
            raise ArithmeticError(f"the equations of a transient group of {len(cells)} cells did not settle in {SWEEPS} "
                                  "sweeps: the group is left very slowly; take more samples a cell or more periods a map")
        x[cells] = value
    where[cells] = 0


def stationary(matrix: sparse.csr_matrix, cells: np.ndarray) -> np.ndarray:
    """Return the stationary probabilities (k,) of the cells (k,) of a closed component."""
    block = matrix[cells][:, cells].tocsr()
    count = len(cells)
    if count == 1:
        return np.ones(1)
    if count <= DIRECT:  # balance of flows, the last equation replaced by the sum: after removal of one cell it is regular
        system = (sparse.identity(count) - block.T).tocsc()
        part = linalg.splu(system[:-1, :-1]).solve(-system[:-1, -1].toarray().ravel())
        weights = np.append(part, 1.0)
    else:
        lazy = 0.5 * (sparse.identity(count) + block.T)  # periodic chains mix too
        value, vector = linalg.eigs(lazy, k=1, which="LM", v0=np.full(count, 1.0 / count), tol=1e-12)
        weights = np.abs(vector[:, 0].real)
    weights = np.maximum(weights, 0.0)
    return weights / weights.sum()


def period(matrix: sparse.csr_matrix, cells: np.ndarray) -> int:
    """Return the period of a recurrent component: the greatest common divisor of the lengths of its cycles."""
    block = matrix[cells][:, cells].tocsr()
    order, before = csgraph.breadth_first_order(block, 0, return_predecessors=True)
    depth = np.zeros(len(cells), np.int64)
    for cell in order[1:]:
        depth[cell] = depth[before[cell]] + 1
    rows = np.repeat(np.arange(len(cells)), np.diff(block.indptr))
    return int(np.gcd.reduce(depth[rows] + 1 - depth[block.indices]))
