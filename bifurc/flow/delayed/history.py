"""The past of a delayed motion: polynomial pieces, broken where the motion is not smooth."""
from collections.abc import Callable

import numpy as np

from ...content import Content

COUNT = 16  # Gauss points of a piece; with its start they carry a polynomial of that degree


def points() -> np.ndarray:
    """Return the start and the Gauss points (COUNT + 1,) of a piece of unit length."""
    return _tables()[0]


def collocation() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Gauss points c (COUNT,), integrals a (COUNT, COUNT) up to them, and weights b (COUNT,), on (0, 1)."""
    nodes, inner, ends, _ = _tables()
    return nodes[1:], inner, ends


def interpolation(at: np.ndarray) -> np.ndarray:
    """Return the matrix (k, COUNT + 1) from values at the points of a piece to those at ``at`` (k,) in [0, 1]."""
    nodes, _, _, weights = _tables()
    apart = at[:, None] - nodes[None]
    hit = np.abs(apart) < 1e-300
    terms = weights / np.where(hit, 1.0, apart)
    found = terms / terms.sum(axis=1, keepdims=True)
    rows = hit.any(axis=1)
    found[rows] = hit[rows]
    return found


def _tables():
    if not _KEPT:
        roots, weights = np.polynomial.legendre.leggauss(COUNT)
        c = 0.5 * (roots + 1.0)
        values = np.polynomial.legendre.legvander(roots, COUNT)
        order = np.arange(COUNT)
        integrals = np.empty((COUNT, COUNT))
        integrals[:, 0] = c
        for k in range(1, COUNT):
            integrals[:, k] = 0.5 * (values[:, k + 1] - values[:, k - 1]) / (2 * k + 1)
        inner = integrals @ (values[:, :COUNT] * weights[:, None] * (2 * order + 1) / 2.0).T
        nodes = np.concatenate(([0.0], c))
        barycentric = np.array([1.0 / np.prod(nodes[j] - np.delete(nodes, j)) for j in range(nodes.size)])
        _KEPT.extend([nodes, inner, 0.5 * weights, barycentric / np.abs(barycentric).max()])
    return _KEPT


_KEPT: list[np.ndarray] = []  # filled once


class History(Content):
    """Pieces of a motion in order of time, and what was before it.

    Parameters
    ----------
    before : callable or None
        States (k, ns) at times (k,) before the start; None: nothing is fed back from there.
    start : float
    ns, rows : int
        States, and feedback forces.
    """

    def __init__(self, before: Callable | None, start: float, ns: int, rows: int):
        self.before, self.start, self.ns, self.rows = before, start, ns, rows
        self.starts: list[float] = []
        self.lengths: list[float] = []
        self.values: list[np.ndarray] = []  # (COUNT + 1, ns) states at the points of a piece
        self.delayed: list[np.ndarray] = []  # (COUNT + 1, rows) what the past added to the feedback forces there
        self.modes: list[int] = []
        self._times = np.empty(0)

    def _content(self) -> tuple:
        return self.start, self.starts, self.lengths, self.values, self.delayed, self.modes

    def append(self, start: float, length: float, values: np.ndarray, delayed: np.ndarray, mode: int) -> None:
        """Add a piece behind the last one."""
        self.starts.append(start)
        self.lengths.append(length)
        self.values.append(values)
        self.delayed.append(delayed)
        self.modes.append(mode)

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return states (k, ns), delayed parts of the forces (k, rows), and whether the past is known (k,), at times ``t`` (k,)."""
        if self._times.size != len(self.starts):
            self._times = np.array(self.starts)
        place = np.searchsorted(self._times, t, side="right") - 1
        states, delayed, known = np.zeros((t.size, self.ns)), np.zeros((t.size, self.rows)), place >= 0
        for i in np.unique(place):
            here = place == i
            if i < 0:
                if self.before is not None:
                    states[here], known[here] = self.before(t[here]), True
                continue
            inside = np.clip((t[here] - self.starts[i]) / self.lengths[i], 0.0, 1.0)
            matrix = interpolation(inside)
            states[here], delayed[here] = matrix @ self.values[i], matrix @ self.delayed[i]
        return states, delayed, known
