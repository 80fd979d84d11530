"""The certified sign of every guard on a segment: Bernstein coefficients of Taylor polynomials with enclosed remainders.

On a step of phase h the guard is sum_k (G B^k h^k/k!) x t^k, t in [0, 1], k <= ORDER, with the coefficient of the remainder
enclosed over the step (Lagrange). A polynomial lies in the hull of its Bernstein coefficients; steps where that does not decide
are halved (de Casteljau). A zero of known order at the start, or of order one at the end, is divided out.
"""
import functools
import math
from typing import Any, NamedTuple

from .arithmetic.balls import above, below, flint
from .arithmetic.jets import Jet

ORDER = 12
TURN = 0.7  # largest scaled angle of a step
HALVINGS = 40  # of a step, before it is left undecided
PARTS = 120  # of a step that are looked at: balls too wide to decide are not cut for ever
MOST_STEPS = 4000


class Sign(NamedTuple):
    """What is known of a guard on a segment: ``margin`` is a lower bound of its distance from zero where it is not listed."""

    proved: bool
    violated: bool
    margin: float
    at: float  # phase behind the start where it is violated, undecided, or nearest


def rate(B) -> float:
    """Return a bound on the size of what steps must resolve, per radian: scaled norm of the generator."""
    size = B.nrows()
    rows = [[float(B[i, j].abs_upper()) for j in range(size)] for i in range(size)]
    scale = [1.0] * size
    for _ in range(6):  # balance, so that stiffness counts by its root
        for i in range(size):
            out = sum(rows[i][j] * scale[j] for j in range(size) if j != i)
            into = sum(rows[j][i] / scale[j] for j in range(size) if j != i)
            if out > 0.0 and into > 0.0:
                scale[i] *= math.sqrt(out / scale[i] / (into * scale[i]))
                scale[i] = min(max(scale[i], 1e-12), 1e12)
    return max(sum(rows[i][j] * scale[j] for j in range(size)) / scale[i] for i in range(size)) if size else 0.0


_BERNSTEIN: dict[int, list] = {}
_BALLS: dict[tuple[int, int], Any] = {}  # by order and precision


def bernstein_matrix(order: int) -> list:
    """Return the rational matrix from monomial to Bernstein coefficients on [0, 1]: b_i = sum_k C(i,k)/C(order,k) a_k."""
    if order not in _BERNSTEIN:
        fmpq = flint().fmpq
        _BERNSTEIN[order] = [[fmpq(math.comb(i, k), math.comb(order, k)) for k in range(order + 1)] for i in range(order + 1)]
    return _BERNSTEIN[order]


def bernstein_balls(order: int):
    """Return `bernstein_matrix` as a matrix of balls."""
    key = order, flint().ctx.prec
    if key not in _BALLS:
        rows = bernstein_matrix(order)
        _BALLS[key] = flint().arb_mat(flint().fmpq_mat(order + 1, order + 1, [v for row in rows for v in row]))
    return _BALLS[key]


class Steps:
    """Steps over a segment of one mode: flow of a step, and for each guard the rows of its coefficients, forwards and backwards.

    Parameters
    ----------
    generator : Jet of arb_mat (nx, nx)
    guards : list of arb_mat (1, nx)
    span : Jet of arb
        Phase of the segment.
    """

    def __init__(self, generator: Jet, guards, span: Jet, known_rate: float | None = None):
        arb = flint().arb
        B, duration = generator.value, span.value
        length = above(duration)
        wanted = math.ceil(length * (rate(B) if known_rate is None else known_rate) / TURN)
        self.count = min(max(2, wanted), MOST_STEPS)
        self.too_many = wanted > MOST_STEPS
        self.h = duration / self.count
        self.duration = duration
        self.B, self.guards = B, guards
        self.E = generator.flow(span.times(arb(1) / self.count))
        self.inside = (B * (self.h * arb(0.5, 0.5))).exp()  # the flow at any time of a step
        self.forward = [self._rows(row, self.h, self.inside) for row in guards]
        to_hull = bernstein_balls(ORDER + 1)
        self.hulls = [to_hull * rows for rows in self.forward]

    @functools.cached_property
    def inside_back(self):
        """The flow back from the end of the last step to any time of it."""
        return (self.B * (self.h * flint().arb(-0.5, 0.5))).exp()

    def _rows(self, row, h, inside):
        """Return the monomial rows (ORDER + 2, nx) of a guard on a step of signed length ``h``."""
        rows, nx = [], row.ncols()
        for k in range(ORDER + 2):
            if k:
                row = row * self.B * (h / k)
            held = row * inside if k == ORDER + 1 else row
            rows += [held[0, j] for j in range(nx)]
        return flint().arb_mat(ORDER + 2, nx, rows)

    def states(self, start: Jet) -> list:
        """Return the joined states (arb_mat) at the beginnings of the steps."""
        found, power = [start.value], self.E
        for step in range(1, self.count):  # powers of the step act on the start: a box is not turned over and over
            found.append((power * start).value)
            if step < self.count - 1:
                power = self.E * power
        return found

    def sign(self, q: int, states: list, end, order: int, ends_here: bool) -> Sign:
        """Return what is known of the sign of guard ``q``, with a zero of ``order`` at the start and, if it ends the segment,
        a simple one at its end."""
        h = below(self.h)
        margin, nearest = math.inf, 0.0
        last = self.count - 1
        for step, x in enumerate(states):
            listed = True
            if ends_here and step == last:
                b = hull(column(self._rows(self.guards[q], -self.h, self.inside_back) * end)[1:])
            elif step == 0 and order:
                b = hull(column(self.forward[q] * x)[order:])
            else:
                listed = False
                b = column(self.hulls[q] * x)
            if not negative(b) or not listed and -above_all(b) < margin:
                proved, violated, low, at = searched(b, 0.0 if listed else -margin)
                where = h * (step + (1.0 - at if ends_here and step == last else at))
                if not proved:
                    return Sign(False, violated, 0.0, where)
                if not listed and low < margin:
                    margin, nearest = low, where
        return Sign(True, False, margin, nearest)


def column(matrix) -> list:
    """Return a matrix of one column as a list."""
    return [matrix[i, 0] for i in range(matrix.nrows())]


def hull(a: list) -> list:
    """Return the Bernstein coefficients on [0, 1] of a polynomial."""
    return [sum((w * v for w, v in zip(row, a, strict=True) if w != 0), flint().arb(0)) for row in bernstein_matrix(len(a) - 1)]


def above_all(b: list) -> float:
    """Return a float above all Bernstein coefficients."""
    return max(above(v) for v in b)


def negative(b: list) -> bool:
    """Return whether all coefficients are negative."""
    return all(v < 0 for v in b)


def searched(b: list, floor: float) -> tuple[bool, bool, float, float]:
    """Return whether a polynomial is negative on [0, 1], whether it is positive somewhere, a lower bound of its distance from zero
    (searched to a few percent, and only where it comes nearer than ``-floor``), and the place.

    ``floor`` is the largest value seen so far elsewhere.
    """
    stack = [(b, 0.0, 1.0, 0)]
    top = floor  # largest certified value found
    worst, place = -math.inf, 0.0  # largest upper bound of what was left
    looked = 0
    while stack:
        b, low, width, depth = stack.pop()
        looked += 1
        for v, at in ((b[0], low), (b[-1], low + width)):
            if v > 0:
                return False, True, 0.0, at
            if below(v) > top:
                top = below(v)
        high = above_all(b)
        if high < 0.0 and (high <= top * 0.97 or depth >= HALVINGS or looked > PARTS // 2):
            if high > worst:
                worst, place = high, low + 0.5 * width
            continue
        if depth >= HALVINGS or looked > PARTS:
            return False, False, 0.0, low + 0.5 * width
        left, right = halves(b)
        stack += [(left, low, 0.5 * width, depth + 1), (right, low + 0.5 * width, 0.5 * width, depth + 1)]
    return True, False, -worst, place


def halves(b: list) -> tuple[list, list]:
    """Return the Bernstein coefficients on both halves (de Casteljau)."""
    left, right, row = [b[0]], [b[-1]], b
    while len(row) > 1:
        row = [(p + q) / 2 for p, q in zip(row[:-1], row[1:], strict=True)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]
