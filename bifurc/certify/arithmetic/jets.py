"""Balls and matrices of balls with nilpotent parts: a + b e1 + c e2 + d e1 e2, e1^2 = e2^2 = 0, for exact derivatives.

The parts of a product follow Leibniz' rule; the exponential of a matrix with parts is that of a block triangular matrix
(R. Mathias, A chain rule for matrix functions and applications, SIAM J. Matrix Anal. Appl. 17 (1996), 610-620).
"""
import math
from typing import Any

from .balls import Field, flint, size
from .forms import Form, hull

SMALL = 0.25  # norm of a matrix whose exponential is summed; larger ones are halved
SWEEPS, FAR = 8, 400  # of the balancing of a matrix; largest power of two
REST = 2.0**-52  # of the sum: what is left is small beside the width of any form
PAIRS = {1: ((0, 0, 0),), 2: ((0, 0, 0), (1, 0, 1), (1, 1, 0)),
         4: ((0, 0, 0), (1, 0, 1), (1, 1, 0), (2, 0, 2), (2, 2, 0), (3, 0, 3), (3, 1, 2), (3, 2, 1), (3, 3, 0))}


class Jet:
    """Parts (1, 2 or 4, numbered by the bits of their generators) that are balls, or matrices of balls; None is zero."""

    __slots__ = ("parts",)

    def __init__(self, *parts):
        self.parts = parts

    def like(self, *parts) -> "Jet":
        """Return a jet with as many parts; those left out are zero."""
        return Jet(*parts, *[None] * (len(self.parts) - len(parts)))

    @property
    def value(self) -> Any:
        """The part without generators, over the whole range of a form."""
        return hull(self.parts[0])

    def circular(self, k: int) -> tuple["Jet", "Jet"]:
        """Return cosine and sine of k times a number."""
        t = self.parts
        s, c = (t[0] * k).sin_cos()
        if len(t) == 1:
            return Jet(c), Jet(s)
        zero = flint().arb(0)
        slopes = [(zero if part is None else part) * k for part in t[1:]]
        found = []
        for f, df in ((c, -s), (s, c)):
            parts = [f, *[df * slope for slope in slopes]]
            if len(t) > 2:
                parts[3] = parts[3] - f * slopes[0] * slopes[1]
            found.append(Jet(*parts))
        return found[0], found[1]

    def __mul__(self, other: "Jet") -> "Jet":
        a, b = self.parts, other.parts
        if len(a) == 1:
            return Jet(a[0] * b[0])
        out: list[Any] = [None] * len(a)
        for place, i, j in PAIRS[len(a)]:
            if a[i] is not None and b[j] is not None:
                term = a[i] * b[j]
                out[place] = term if out[place] is None else out[place] + term
        return Jet(*out)

    def __add__(self, other: "Jet") -> "Jet":
        return Jet(*[b if a is None else a if b is None else a + b for a, b in zip(self.parts, other.parts, strict=True)])

    def __neg__(self) -> "Jet":
        return Jet(*[None if a is None else a * -1 for a in self.parts])

    def __sub__(self, other: "Jet") -> "Jet":
        return self + -other

    def entry(self, part: int, i: int, j: int, zero):
        """Return one entry of a part of a matrix."""
        found = self.parts[part]
        return zero if found is None else found[i, j]

    def times(self, number) -> "Jet":
        """Return every part times a number."""
        return self.like(*[None if a is None else a * number for a in self.parts])

    def flow(self, s: "Jet") -> "Jet":
        """Return exp(B s) of a generator; a wide duration enters as a factor of its own, which commutes and is near one."""
        if isinstance(s.parts[0], Form):
            return (self * s).exp()
        middle = s.parts[0].mid()
        rest = s.like(s.parts[0] - middle, *s.parts[1:])
        whole = (self * s.like(middle)).exp()
        if rest.parts[0] == flint().arb(0) and all(part is None for part in rest.parts[1:]):
            return whole
        return whole * (self * rest).exp()

    def exp(self) -> "Jet":
        """Return the exponential of a square matrix.

        What is left out is bounded by a norm, the same for all entries: it is taken in units in which these are of one size.
        """
        whole = self.value
        n = whole.nrows()
        if not math.isfinite(norm_of(whole)):
            return self.times(flint().arb("nan"))
        drives = driven([hull(part) for part in self.parts if part is not None])
        exponents = balancing(whole, drives)
        if not any(exponents):
            return self._exponential(drives)
        arb, matrix = flint().arb, flint().arb_mat
        units, back = (matrix(n, n, [arb(2) ** (sign * exponents[i]) if i == j else arb(0) for i in range(n) for j in range(n)])
                       for sign in (1, -1))
        return self._between(back, units)._exponential(drives)._between(units, back)

    def _between(self, left, right) -> "Jet":
        """Return every part of a matrix between two matrices."""
        return Jet(*[None if a is None else a.each(lambda b: left * b * right) if isinstance(a, Form) else left * a * right
                     for a in self.parts])

    def _exponential(self, drives: list[set[int]]) -> "Jet":
        """Return the exponential of a matrix with entries of one size; ``drives`` as `driven` tells it."""
        parts = self.parts
        if isinstance(parts[0], Form):
            return self._summed(drives)
        if len(parts) == 1:
            return Jet(parts[0].exp())
        n, count = parts[0].nrows(), len(parts)
        zero = flint().arb(0)
        rows = []
        for block in range(count):
            for i in range(n):
                row = []
                for other in range(count):
                    part = parts[other ^ block] if other & block == block else None
                    row += [zero] * n if part is None else [part[i, j] for j in range(n)]
                rows += row
        whole = flint().arb_mat(count * n, count * n, rows).exp()
        return Jet(*[flint().arb_mat(n, n, [whole[i, other * n + j] for i in range(n) for j in range(n)])
                     for other in range(count)])

    def _summed(self, drives: list[set[int]]) -> "Jet":
        """Return the exponential of a matrix with one or two parts that are forms: Taylor's sum and its remainder, then squares.

        Nothing is left out where one state does not drive the other.
        """
        arb, matrix = flint().arb, flint().arb_mat
        n = self.parts[0].parts[0].nrows()
        norm = norm_of(self.value)
        halvings = max(0, math.ceil(math.log2(norm / SMALL))) if norm > 0.0 else 0
        part = self.times(arb(1) / 2**halvings)
        small = norm / 2.0**halvings * (1.0 + 1e-12)
        order, left = 1, small  # left: the first term that is not summed
        while left > REST or order < 3:
            order += 1
            left *= small / order
        eye = self.like(matrix(n, n, [arb(int(i == j)) for i in range(n) for j in range(n)]))
        found = eye
        for k in range(order - 1, 0, -1):
            found = eye + part * found.times(arb(1) / k)
        rests = [2.0 * left]  # a geometric series: small / (order + 1) < 1/2
        if len(self.parts) > 1 and self.parts[1] is not None:
            rests.append(2.0 * left * order / small * norm_of(hull(part.parts[1])))
        found = found + self.like(*[matrix(n, n, [arb(0, rest) if i in drives[j] else arb(0) for i in range(n) for j in range(n)])
                                    for rest in rests])
        for _ in range(halvings):
            found = found * found
        return found


def driven(parts: list) -> list[set[int]]:
    """Return for each state which states it drives, itself and others, in a generator or in one of its derivatives: what may not be
    zero in its exponential."""
    n = parts[0].nrows()
    drives = [{j} | {i for i in range(n) if not all(found[i, j] == 0 for found in parts)} for j in range(n)]
    for k in range(n):  # what a state drives, and what that drives
        for own in drives:
            if k in own:
                own |= drives[k]
    return drives


def balancing(found, drives: list[set[int]]) -> list[int]:
    """Return exponents k of powers of two with which the entries a_ij 2**(k_j - k_i) of a matrix of balls are of one size.

    States that drive each other are balanced (B. N. Parlett, C. Reinsch, Numer. Math. 13 (1969), 293-304); those that drive others
    and are driven by none of them, such as an excitation, get the unit in which they do so with factors of the size of these.
    """
    n = found.nrows()
    whole = [[float(found[i, j].abs_upper()) for j in range(n)] for i in range(n)]
    sizes = [[v if i != j else 0.0 for j, v in enumerate(row)] for i, row in enumerate(whole)]
    unit = [0.0] * n  # logarithms
    placed: list[int] = []
    for j in sorted(range(n), key=lambda k: len(drives[k])):
        if j in placed:
            continue
        group = [i for i in sorted(drives[j]) if j in drives[i]]
        for _ in range(SWEEPS):
            largest = 0.0
            for i in group:
                out = sum(sizes[i][k] * 2.0 ** (unit[k] - unit[i]) for k in group)
                into = sum(sizes[k][i] * 2.0 ** (unit[i] - unit[k]) for k in group)
                change = max(-FAR, min(FAR, 0.5 * math.log2(out / into))) if out and into else 0.0
                unit[i] += change
                largest = max(largest, abs(change))
            if largest < 0.5:
                break
        into = max((sizes[k][i] * 2.0 ** (unit[i] - unit[k]) for i in group for k in placed), default=0.0)
        own = max((whole[k][i] * 2.0 ** (unit[i] - unit[k]) for i in placed for k in placed), default=0.0)
        if into and own:
            for i in group:
                unit[i] -= math.log2(into / own)
        placed += group
    return [round(max(-FAR, min(FAR, k))) for k in unit]


def norm_of(found) -> float:
    """Return a bound of the largest sum of moduli in a row of a matrix of balls."""
    n, m = found.nrows(), found.ncols()
    return max(sum(size(found[i, j]) for j in range(m)) for i in range(n)) * (1.0 + 1e-12)


class Series:
    """A ball with its Taylor coefficients by a parameter, for a model along it."""

    __slots__ = ("parts",)

    def __init__(self, *parts):
        self.parts = parts

    def __add__(self, other):
        return Series(*[a + b for a, b in zip(self.parts, other.parts, strict=True)])

    def __sub__(self, other):
        return Series(*[a - b for a, b in zip(self.parts, other.parts, strict=True)])

    def __neg__(self):
        return Series(*[-a for a in self.parts])

    def __mul__(self, other):
        if not isinstance(other, Series):
            return Series(*[a * other for a in self.parts])
        return Series(*leibniz(self.parts, other.parts))

    def __truediv__(self, other):
        found: list = []
        for k, a in enumerate(self.parts):
            for j in range(k):
                a = a - found[j] * other.parts[k - j]
            found.append(a / other.parts[0])
        return Series(*found)

    def __eq__(self, other):
        return bool(self.parts[0] == other and all(a == 0 for a in self.parts[1:]))

    __hash__ = None  # type: ignore[assignment]


def leibniz(a, b) -> list:
    """Return the coefficients of a product, as many as both have; what is exactly zero is left out."""
    if all(v == 0 for v in a[1:]):
        return [a[0] * v for v in b]
    if all(v == 0 for v in b[1:]):
        return [v * b[0] for v in a]
    found = []
    for k in range(len(a)):
        term = a[0] * b[k]
        for j in range(1, k + 1):
            term = term + a[j] * b[k - j]
        found.append(term)
    return found


class SeriesMatrix:
    """A matrix of balls with its Taylor coefficients by a parameter."""

    def __init__(self, *parts):
        self.parts = parts

    def nrows(self):
        """Number of rows."""
        return self.parts[0].nrows()

    def ncols(self):
        """Number of columns."""
        return self.parts[0].ncols()

    def __getitem__(self, place):
        return Series(*[a[place] for a in self.parts])

    def __add__(self, other):
        return SeriesMatrix(*[a + b for a, b in zip(self.parts, other.parts, strict=True)])

    def __mul__(self, other):
        if not isinstance(other, SeriesMatrix | Series):
            return SeriesMatrix(*[a * other for a in self.parts])
        return SeriesMatrix(*[sum((self.parts[j] * other.parts[k - j] for j in range(1, k + 1)), self.parts[0] * other.parts[k])
                              for k in range(len(self.parts))])

    def transpose(self):
        """Return the transpose."""
        return SeriesMatrix(*[a.transpose() for a in self.parts])

    def inv(self):
        """Return the inverse."""
        inverse = self.parts[0].inv()
        found = [inverse]
        for k in range(1, len(self.parts)):
            found.append(inverse * sum((self.parts[j] * found[k - j] for j in range(2, k + 1)),
                                       self.parts[1] * found[k - 1]) * -1)
        return SeriesMatrix(*found)


class SeriesField(Field):
    """The field of balls with Taylor coefficients; ``values`` are lists of them in the order in which floats are read."""

    def __init__(self, values, parts: int):
        self._values, self.parts = iter(values), parts

    def scalar(self, value) -> Series:
        """Return a number that does not vary."""
        arb = flint().arb
        return Series(arb(value), *[arb(0)] * (self.parts - 1))

    def matrix(self, rows: int, columns: int, entries) -> SeriesMatrix:
        """Return the matrix of some numbers."""
        entries = list(entries)
        return SeriesMatrix(*[flint().arb_mat(rows, columns, [e.parts[k] for e in entries]) for k in range(self.parts)])

    def number(self, value: float) -> Series:
        """Return the next number."""
        return Series(*next(self._values))
