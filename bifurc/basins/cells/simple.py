"""Simple cell mapping: every cell has one image; the functional graph falls into cycles and what leads to them.

C. S. Hsu, Cell-to-Cell Mapping (Springer 1987), chapters 4 and 8.  All cells outside the region are one sink cell.
"""
from typing import NamedTuple

import numpy as np

from ..._jit import njit


class Colouring(NamedTuple):
    """A functional graph, taken apart."""

    group: np.ndarray  # (N + 1,) int64, number of the cycle that a cell leads to; 0 is the sink's
    steps: np.ndarray  # (N + 1,) int64, mappings until it is on the cycle; 0: it belongs to the cycle
    total: int  # cycles, the sink's among them


def colour(image: np.ndarray) -> Colouring:
    """Return the cycles of a map of cells and the cells that lead to each.

    Parameters
    ----------
    image : ndarray of int, shape (N,)
        Number of the image cell; any number outside 0 .. N - 1 is the sink.

    Returns
    -------
    Colouring
        Cell N is the sink.  Cycles are numbered in the order of the first cell that leads to them.
    """
    size = len(image)
    image = np.append(np.where((image < 0) | (image >= size), size, image), size).astype(np.int64)
    group, steps = np.full(size + 1, -1, np.int64), np.zeros(size + 1, np.int64)
    count = _colour(image, group, steps, np.empty(size + 1, np.int64))
    return Colouring(group, steps, int(count))


def cycles(found: Colouring, image: np.ndarray) -> list[np.ndarray]:
    """Return the cells of each cycle in the order they are visited; the first list, of the sink, is empty."""
    size = len(image)
    on = np.flatnonzero(found.steps[:size] == 0)
    first = np.full(found.total, -1)
    first[found.group[on[::-1]]] = on[::-1]  # the last written is the lowest number
    lists: list[np.ndarray] = [np.empty(0, np.int64)]
    for cell in first[1:].tolist():
        walk = [cell]
        while image[walk[-1]] != cell:
            walk.append(int(image[walk[-1]]))
        lists.append(np.array(walk, np.int64))
    return lists


@njit
def _colour(image, group, steps, path):
    """Colour every cell by its cycle: follow the images until something coloured, or the own path, is met."""
    size = image.shape[0] - 1
    group[size] = 0
    count = 1
    for start in range(size):
        if group[start] >= 0:
            continue
        length, cell = 0, start
        while group[cell] == -1:
            group[cell] = -2  # on the present path
            path[length] = cell
            length += 1
            cell = image[cell]
        number, step = group[cell], steps[cell]
        if number == -2:  # the path ran into itself: a new cycle
            number, step = count, 0
            count += 1
            while True:
                length -= 1
                group[path[length]] = number
                steps[path[length]] = 0
                if path[length] == cell:
                    break
        while length > 0:
            length -= 1
            step += 1
            group[path[length]] = number
            steps[path[length]] = step
    return count
