"""Which attractor a section point has reached: closeness to confirmed orbits, boxes of chaotic samples.

States are compared scaled, ``s = y / scale``.  A periodic attractor is its section points with a radius each.  A
chaotic one is the set of boxes that its sample visits, kept as sorted hashes of their whole-number places; only ``stay``
consecutive section points in its boxes count, since a trajectory may pass a few on its way elsewhere: one where nothing
leaves the boxes (`bifurc.basins.attractors.trapping`), STAY where that is not known.
"""
from typing import NamedTuple

import numpy as np

from .._jit import njit

STAY = 32  # consecutive section points in the boxes of a chaotic attractor before it is reached, if they may be left
_FACTOR = np.uint64(0x9E3779B97F4A7C15)  # of multiplicative hashing (Knuth), 2**64 / golden ratio


class Targets(NamedTuple):
    """Attractors as the kernels see them, see the head of this file."""

    inverse: np.ndarray  # (ns,) 1 / scale
    points: np.ndarray  # (P, ns) section points of periodic attractors, scaled
    squares: np.ndarray  # (P,) squared radii
    owner: np.ndarray  # (P,) label
    width: float  # of the boxes of chaotic attractors, scaled
    keys: np.ndarray  # (K,) sorted hashes of their boxes, uint64
    keepers: np.ndarray  # (K,) label
    stay: int = STAY  # consecutive section points in boxes before their attractor counts as reached

    @classmethod
    def none(cls, states: int) -> "Targets":
        """Return no attractors at all."""
        whole = np.zeros(0, np.int64)
        return cls(np.ones(states), np.zeros((0, states)), np.zeros(0), whole, 1.0, np.zeros(0, np.uint64), whole)


@njit
def nearest(y, inverse, points, squares, owner):
    """Return the owner of the first point within its radius of ``y`` (ns,), or -1.

    ``inverse`` (ns,) is 1 / scale, ``points`` (P, ns) are scaled, ``squares`` (P,) squared radii.
    """
    for p in range(points.shape[0]):
        total = 0.0
        for c in range(points.shape[1]):
            d = y[c] * inverse[c] - points[p, c]
            total += d * d
        if total <= squares[p]:
            return owner[p]
    return -1


@njit
def box_of(y, inverse, width):
    """Return the hash of the box that holds ``y``."""
    key = np.uint64(0)
    for c in range(y.shape[0]):
        place = np.int64(np.floor(y[c] * inverse[c] / width))
        key = (key ^ np.uint64(place)) * _FACTOR
        key ^= key >> np.uint64(29)
    return key


@njit
def boxed(y, inverse, width, keys, keepers):
    """Return the owner of the box that holds ``y``, or -1; ``keys`` (K,) are sorted, ``keepers`` (K,) their owners."""
    if keys.shape[0] == 0:
        return -1
    key = box_of(y, inverse, width)
    low, high = 0, keys.shape[0]
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    if low < keys.shape[0] and keys[low] == key:
        return keepers[low]
    return -1


@njit
def boxes(points, inverse, width, keys):
    """Write the hashes of the boxes of ``points`` (P, ns) into ``keys`` (P,)."""
    for p in range(points.shape[0]):
        keys[p] = box_of(points[p], inverse, width)
