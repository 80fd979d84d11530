"""Taylor forms along a curve: a0 + a1 d + a2 d^2 for |d| <= h, where the last ball takes up all that is of higher order.

The value of a form at every d lies in what its balls give there: sums, products, quotients and circular functions keep that.  What
varies with d is so carried through long products, where intervals would be turned over and over and grow (wrapping).  Forms of
order one have no a2.  (K. Makino, M. Berz, Taylor models and other validated functional inclusion methods, Int. J. Pure Appl.
Math. 4 (2003), 379-456, in one variable and with the remainder as a coefficient.)
"""
from typing import Any

from .balls import flint


class Reach:
    """The range of d: a ball that holds it, one that holds its square, and the order of the forms on it."""

    __slots__ = ("d", "order", "square")

    def __init__(self, h: float, order: int):
        arb = flint().arb
        self.d, self.order = arb(0, h), order
        half = arb(h) * arb(h) / 2
        self.square = half + half * arb(0, 1)


class Form:
    """A number, or a matrix, along a curve; parts None are zero, the first is never None."""

    __slots__ = ("parts", "reach")

    def __init__(self, reach: Reach, a0, a1=None, a2=None):
        self.reach, self.parts = reach, (a0, a1, a2)

    @property
    def value(self) -> Any:
        """All values on the range."""
        a0, a1, a2 = self.parts
        if a1 is not None:
            a0 = a0 + a1 * self.reach.d
        return a0 if a2 is None else a0 + a2 * self.reach.square

    @property
    def slope(self) -> Any:
        """All values of a1 + a2 d, or None."""
        _, a1, a2 = self.parts
        if a2 is None:
            return a1
        return a2 * self.reach.d if a1 is None else a1 + a2 * self.reach.d

    def lower(self, reach: Reach) -> "Form":
        """Return the form of order one, on the same range with that order."""
        return Form(reach, self.parts[0], self.slope)

    def each(self, change) -> "Form":
        """Return the form of a linear change of every part."""
        return Form(self.reach, *[None if a is None else change(a) for a in self.parts])

    def __mul__(self, other: Any) -> "Form":
        if not isinstance(other, Form):
            return self.each(lambda a: a * other)
        a0, a1, a2 = self.parts
        b0, b1, b2 = other.parts
        if a1 is None and a2 is None:
            return Form(self.reach, a0 * b0, None if b1 is None else a0 * b1, None if b2 is None else a0 * b2)
        if b1 is None and b2 is None:
            return Form(self.reach, a0 * b0, None if a1 is None else a1 * b0, None if a2 is None else a2 * b0)
        if self.reach.order == 1:
            return Form(self.reach, a0 * b0, total(None if b1 is None else a0 * b1, None if a1 is None else a1 * other.value))
        first = total(None if b1 is None else a0 * b1, None if a1 is None else a1 * b0)
        slope = other.slope
        second = total(None if b2 is None else a0 * b2, None if a1 is None or slope is None else a1 * slope)
        return Form(self.reach, a0 * b0, first, total(second, None if a2 is None else a2 * other.value))

    def __rmul__(self, other: Any) -> "Form":
        return self.each(lambda a: other * a)

    def __add__(self, other: Any) -> "Form":
        if not isinstance(other, Form):
            return Form(self.reach, self.parts[0] + other, *self.parts[1:])
        return Form(self.reach, *[total(a, b) for a, b in zip(self.parts, other.parts, strict=True)])

    __radd__ = __add__

    def __neg__(self) -> "Form":
        return self.each(lambda a: a * -1)

    def __sub__(self, other: Any) -> "Form":
        return self + -other

    def __rsub__(self, other: Any) -> "Form":
        return -self + other

    def __truediv__(self, other: "Form") -> "Form":
        return self * other.reciprocal()

    def reciprocal(self) -> "Form":
        """Return one over a number: 1 - a (i0 + i1 d) is exactly of second order."""
        a0, a1, a2 = self.parts
        first = 1 / a0
        if a1 is None and a2 is None:
            return Form(self.reach, first)
        over = 1 / self.value
        if self.reach.order == 1:
            return Form(self.reach, first, -first * a1 * over)
        second = None if a1 is None else -first * a1 * first
        near = first if second is None else first + second * self.reach.d
        left = total(None if a1 is None or second is None else a1 * second, None if a2 is None else a2 * near)
        return Form(self.reach, first, second, None if left is None else -over * left)

    def sin_cos(self) -> tuple["Form", "Form"]:
        """Return sine and cosine of a number, by the sine of a sum and Lagrange's remainder."""
        t0, t1, t2 = self.parts
        s, c = t0.sin_cos()
        if t1 is None and t2 is None:
            return Form(self.reach, s), Form(self.reach, c)
        zero = flint().arb(0)
        t1, t2 = zero if t1 is None else t1, zero if t2 is None else t2
        slope = t1 + t2 * self.reach.d
        sine, cosine = (slope * self.reach.d).sin_cos()
        if self.reach.order == 1:  # mean value
            s1, c1 = s * cosine + c * sine, c * cosine - s * sine
            return Form(self.reach, s, c1 * slope), Form(self.reach, c, -s1 * slope)
        bend = slope * slope / 2
        even, odd = -bend * cosine, t2 - bend * sine
        return Form(self.reach, s, c * t1, s * even + c * odd), Form(self.reach, c, -s * t1, c * even - s * odd)

    def __getitem__(self, place) -> "Form":
        return self.each(lambda a: a[place])


def total(a, b):
    """Return the sum of two parts, None being zero."""
    return b if a is None else a if b is None else a + b


def hull(x) -> Any:
    """Return all values of a form on its range; balls are themselves."""
    return x.value if isinstance(x, Form) else x


def column(entries: list) -> Any:
    """Return the matrix (n, 1) of numbers that are all balls, or balls and forms; None is zero."""
    matrix, zero = flint().arb_mat, flint().arb(0)
    form = next((e for e in entries if isinstance(e, Form)), None)
    if form is None:
        return matrix(len(entries), 1, [zero if e is None else e for e in entries])
    rows = [e.parts if isinstance(e, Form) else (e, None, None) for e in entries]
    return Form(form.reach, *[None if k and all(row[k] is None for row in rows) else
                              matrix(len(rows), 1, [zero if row[k] is None else row[k] for row in rows]) for k in range(3)])
