"""Velocity feedback at a rigid stop: growth of perturbations where the return map is not differentiable.

The velocity jumps at an impact, and the delayed velocity one delay after the last one.  Between the two the feedback is
finite, for a time of first order: a pulse of first-order area K jump dl, dl = dt_k - dt_(k-1).  It acts before the impact, and
is reflected with it, for dl > 0, and after it for dl < 0.  The linearised map is therefore piecewise linear and homogeneous:
one characteristic equation gives wrong gains.

Two answers are given.  For a pattern of signs that repeats every two periods the growth Lambda over two periods is a root of one
determinant of two coupled flights,

    y1' = A y1 + K b (s1 - s2/Lambda),    y2' = A y2 + K b (s2 - s1),    y1(0) = y2(T)/Lambda,  y2(0) = y1(T),

valid where its null vector has the signs that were assumed.  And the piecewise linear map itself is iterated, which asks for
no pattern.
"""
import itertools

import numpy as np
from scipy.optimize import brentq

from .linearization import NODES, Kick, Linearization, NotSupported, flow, gauss

MOST_JUMPS = 3  # impacts a period: 2^(m - 1) (2^m + 1) patterns
GRID = np.geomspace(1e-2, 1e4, 97)  # growths over two periods between which roots are bracketed
STARTS, SETTLE, MEASURE = 8, 150, 150  # of the iteration: random starts, periods before and while growth is measured
Pattern = tuple[tuple[int, ...], tuple[int, ...]]


class ImpactOrder:
    """Growth of perturbations of an orbit with impacts under feedback of the velocity that jumps there.

    Parameters
    ----------
    linear : Linearization
        With jumps of the coordinate that is fed back.

    Raises
    ------
    NotSupported
        For more than three such impacts a period, and for feedback of more than one row.
    """

    def __init__(self, linear: Linearization):
        self.linear = linear
        if len(linear.rows) > 1:
            raise NotSupported(f"velocity feedback of {len(linear.rows)} rows where the velocity jumps (impact of "
                               f"{linear.jumping[0].label!r}) is not treated; feed one row or the displacement back, or simulate")
        self.count = len(linear.jumping)
        if self.count > MOST_JUMPS:
            raise NotSupported(f"the orbit has {self.count} impacts a period; velocity feedback at rigid stops is treated for up "
                               f"to {MOST_JUMPS} (feed the displacement back, or simulate)")
        self._jumps = [id(kick) for kick in linear.jumping]

    # one pattern of signs

    @property
    def patterns(self) -> list[Pattern]:
        """Signs of dl in two successive periods, one of each pair in which the two periods have changed places.

        Impacts that come later and later, and those that come earlier and earlier, are two patterns: the pulses lie on other sides.
        """
        return list(itertools.combinations_with_replacement(itertools.product((1, -1), repeat=self.count), 2))

    def matrix(self, growth: np.ndarray, gain: float, pattern: Pattern) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrices I - (closing)(flights) (k, 2 ns, 2 ns) at ``growth`` (k,) over two periods, and rows (k, 2 m, 2 ns)
        that give dl of both periods."""
        linear, ns = self.linear, self.linear.rows.shape[1]
        k = len(growth)
        total = np.broadcast_to(np.eye(2 * ns), (k, 2 * ns, 2 * ns))
        couple = np.zeros((k, 2, 2))  # feedback of (1, 2) on (s1, s2) per gain
        couple[:, 0, 0] = couple[:, 1, 1] = 1.0
        couple[:, 0, 1], couple[:, 1, 0] = -1.0 / growth, -1.0
        signs, j, shifts = np.array(pattern), 0, []
        last, step = None, total
        for piece in linear.pieces:
            if isinstance(piece.kick, Kick):
                kick = piece.kick
                jump = np.broadcast_to(np.kron(np.eye(2), kick.S), (k, 2 * ns, 2 * ns)).copy()
                jump += gain * np.einsum("kab,ij->kaibj", couple, kick.push @ linear.rows).reshape(k, 2 * ns, 2 * ns)
                if id(kick) in self._jumps:
                    later = np.einsum("kab,j->kabj", couple, kick.arrival).reshape(k, 2, 2 * ns)  # dl of both periods
                    shifts.append(later @ total)
                    for period in (0, 1):
                        where = kick.before if signs[period, j] > 0 else kick.after
                        jump[:, period * ns:(period + 1) * ns] += -gain * kick.jump * where * later[:, period, None]
                    j += 1
                total = jump @ total
            elif piece.kick is not None:
                total = np.kron(np.eye(2), piece.kick) @ total
            if last is None or piece.A is not last.A:
                A = np.einsum("nij,ab->naibj", piece.A, np.eye(2)).reshape(1, NODES, 2 * ns, 2 * ns) + gain * np.einsum(
                    "kab,ij->kaibj", couple, piece.b @ linear.rows).reshape(k, 1, 2 * ns, 2 * ns)
                step = flow(piece, A)
            last, total = piece, step @ total
        closing = np.zeros((k, 2 * ns, 2 * ns))
        closing[:, :ns, ns:] = np.eye(ns) / growth[:, None, None]
        closing[:, ns:, :ns] = np.eye(ns)
        return np.eye(2 * ns) - closing @ total, np.concatenate(shifts, axis=1)

    def determinant(self, growth, gain: float, pattern: Pattern) -> np.ndarray:
        """Return the determinant (k,) whose roots ``growth`` (k,) are growths over two periods."""
        return np.linalg.det(self.matrix(np.atleast_1d(np.asarray(growth, float)), gain, pattern)[0])

    def consistent(self, growth: float, gain: float, pattern: Pattern) -> bool:
        """Return whether the perturbation of a root has the signs that its pattern assumes."""
        matrix, shifts = self.matrix(np.array([growth]), gain, pattern)
        null = np.linalg.svd(matrix[0])[2][-1]
        dl = (shifts[0] @ null).reshape(self.count, 2).T
        wanted = np.sign(dl) * np.array(pattern)
        return bool(np.all(wanted > 0) or np.all(wanted < 0))

    def growths(self, gain: float) -> list[tuple[float, Pattern]]:
        """Return (growth over two periods, pattern) of all consistent patterns, largest growth first."""
        found = []
        for pattern in self.patterns:
            value = self.determinant(GRID, gain, pattern)
            for i in np.flatnonzero(np.sign(value[1:]) * np.sign(value[:-1]) < 0):
                root = brentq(lambda growth, pattern=pattern: float(self.determinant(growth, gain, pattern)[0]),
                              GRID[i], GRID[i + 1], xtol=1e-14, rtol=1e-14)
                if self.consistent(root, gain, pattern):
                    found.append((float(root), pattern))
        return sorted(found, key=lambda item: -item[0])

    def end(self, low: float, high: float) -> tuple[float, Pattern] | None:
        """Return the gain between two in which a consistent pattern keeps its size (growth 1), and the pattern, or None."""
        for pattern in self.patterns:
            def value(gain, pattern=pattern):
                return float(self.determinant(1.0, gain, pattern)[0])
            if value(low) * value(high) < 0.0:
                gain = float(brentq(value, low, high, xtol=1e-15, rtol=1e-14))
                if self.consistent(1.0, gain, pattern):
                    return gain, pattern
        return None

    # no pattern

    def iterated(self, gain: float, seed: int = 0) -> float:
        """Return the growth per period of the fastest of some random perturbations, by iterating the piecewise linear map."""
        linear, ns = self.linear, self.linear.rows.shape[1]
        c = linear.rows[0]
        pieces = [_responses(piece, c, gain) for piece in linear.pieces]
        rng = np.random.default_rng(seed)
        y = rng.normal(size=(ns, STARTS))
        s = rng.normal(size=(len(pieces), NODES, STARTS))
        p_end = np.zeros((len(pieces), STARTS))
        times = np.zeros((len(linear.kicks), STARTS))
        logs = np.zeros(STARTS)
        total = np.zeros(STARTS)
        for period in range(SETTLE + MEASURE):
            event = 0
            for k, (piece, (from_y, from_d, end_y, end_d)) in enumerate(zip(linear.pieces, pieces, strict=True)):
                kick = piece.kick
                if isinstance(kick, Kick):
                    moved = kick.S @ y + kick.push * (gain * (c @ y) - gain * p_end[k])
                    p_end[k] = c @ y
                    if id(kick) in self._jumps:
                        now = kick.arrival @ y
                        dl = now - times[event]
                        moved -= gain * kick.jump * dl * np.where(dl > 0.0, kick.before, kick.after)
                        times[event] = now
                    y = moved
                    event += 1
                elif kick is not None:
                    y = kick @ y
                delayed = -gain * s[k]
                s[k] = from_y @ y + from_d @ delayed
                y = end_y @ y + end_d @ delayed
            y = linear.labels.moved(y.T, 0.0).T
            size = np.sqrt((y**2).sum(axis=0) + (s**2).mean(axis=(0, 1)))
            size = np.where(size > 0.0, size, 1.0)
            logs += np.log(size)
            y, s, p_end, times = y / size, s / size, p_end / size, times / size
            if period == SETTLE - 1:
                total = logs.copy()
        return float(np.exp(((logs - total) / MEASURE).max()))


def _responses(piece, c: np.ndarray, gain: float):
    """Return how values (NODES,) and end (ns,) of a piece follow from its start (ns,) and the delayed part of p (NODES,)."""
    ns = c.size
    _, inner, ends = gauss()
    A = piece.A + gain * np.outer(piece.b[:, 0], c)
    system = np.eye(NODES * ns) - piece.span * np.einsum("ij,jab->iajb", inner, A).reshape(NODES * ns, NODES * ns)
    drive = np.einsum("a,jm->jam", piece.b[:, 0], np.eye(NODES))
    right = np.concatenate((np.tile(np.eye(ns), (NODES, 1)),
                            piece.span * np.einsum("ij,jam->iam", inner, drive).reshape(NODES * ns, NODES)), axis=1)
    values = np.linalg.solve(system, right).reshape(NODES, ns, ns + NODES)
    rate = np.einsum("jab,jbm->jam", A, values)
    rate[:, :, ns:] += drive
    end = piece.span * np.einsum("j,jam->am", ends, rate)
    end[:, :ns] += np.eye(ns)
    shown = np.einsum("a,jam->jm", c, values)
    return shown[:, :ns], shown[:, ns:], end[:, :ns], end[:, ns:]
