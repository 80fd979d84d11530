"""Existence and uniqueness of a zero in a box: Krawczyk's operator with a floating-point preconditioner.

    K(X) = m - Y F(m) + (I - Y J(X)) (X - m);      K(X) inside the interior of X proves one zero, and only one, in X.

R. Krawczyk, Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken, Computing 4 (1969), 187-201.
"""
from typing import Any, NamedTuple

import numpy as np

from .balls import flint, middle, radius

TIGHTENINGS = 6
FINE = 1e-18  # scaled: a wider enclosure is made once more, about its middle
REPEATS = 3
SINGULAR = 1e12  # of the inverse of a Jacobian with rows and columns of size one: beyond it floats precondition nothing


class Zero(NamedTuple):
    """What a box holds: ``inside`` one zero and only one, ``empty`` none; ``box`` encloses it (entries arb)."""

    inside: bool
    empty: bool
    box: list


def preconditioner(J: list):
    """Return the inverse (arb_mat) of the midpoints of a Jacobian (rows of arb), in floats; None where it is singular."""
    rows = np.array([[middle(v) for v in row] for row in J])
    if not np.isfinite(rows).all():
        return None
    left = np.abs(rows).max(axis=1)
    left[left == 0.0] = 1.0
    rows = rows / left[:, None]
    right = np.abs(rows).max(axis=0)
    right[right == 0.0] = 1.0
    try:
        inverse = np.linalg.inv(rows / right)
    except np.linalg.LinAlgError:
        return None
    if not np.abs(inverse).max() < SINGULAR:
        return None
    inverse = inverse / right[:, None] / left
    size = len(J)
    return flint().arb_mat(size, size, inverse.ravel().tolist())


def krawczyk(m: list, X: list, F: list, J: list, Y=None, known: bool = False) -> Zero:
    """Return what is proved of a box.

    Parameters
    ----------
    m : list of arb
        Middle, balls of radius zero.
    X : list of arb
        The box, which holds m.
    F : list of arb
        Enclosure of the residual at m.
    J : list of list of arb
        Enclosure of the Jacobian over the box.
    Y : arb_mat, optional
        Preconditioner; `preconditioner` of J by default.
    known : bool
        The box is known to hold one zero, and only one: it is made smaller.
    """
    size = len(m)
    Y = preconditioner(J) if Y is None else Y
    if Y is None:
        return Zero(False, False, X)
    matrix = flint().arb_mat
    identity = matrix(size, size, [flint().arb(int(i == j)) for i in range(size) for j in range(size)])
    C = identity - Y * matrix(size, size, [v for row in J for v in row])
    shift = Y * matrix(size, 1, F)
    box = X
    inside = False
    for turn in range(TIGHTENINGS):
        wide = C * matrix(size, 1, [x - c for x, c in zip(box, m, strict=True)])
        new = [c - shift[i, 0] + wide[i, 0] for i, c in enumerate(m)]
        if not all(v.is_finite() for v in new):
            return Zero(False, False, X)
        if turn == 0:
            if any(not k.overlaps(x) for k, x in zip(new, X, strict=True)):
                return Zero(False, True, X)
            inside = known or all(x.contains_interior(k) for x, k in zip(X, new, strict=True))
            if not inside:
                return Zero(False, False, X)
            box = [meet(k, x) for k, x in zip(new, X, strict=True)]
            continue
        new = [meet(k, x) for k, x in zip(new, box, strict=True)]
        if not all(float(k.rad()) < 0.5 * float(x.rad()) for k, x in zip(new, box, strict=True) if float(x.rad()) > 0.0):
            box = new
            break
        box = new
    return Zero(inside, False, box)


def tightened(zero: Zero, scale, residual, jacobian, Y) -> Zero:
    """Return the box of a proved zero made smaller about its own middle, until its scaled radius is `FINE` or it shrinks no more.

    Parameters
    ----------
    zero : Zero
        Proved.
    scale : sequence of float
        Natural sizes of the unknowns.
    residual, jacobian : callable
        Of a list of arb.
    Y : arb_mat
        Preconditioner.
    """
    for _ in range(REPEATS):
        wide = max(radius(b) / float(s) for b, s in zip(zero.box, scale, strict=True))
        if wide <= FINE:
            break
        middles = [b.mid() for b in zero.box]
        new = krawczyk(middles, zero.box, residual(middles), jacobian(zero.box), Y, known=True)
        if not new.inside or max(radius(b) / float(s) for b, s in zip(new.box, scale, strict=True)) > 0.5 * wide:
            break
        zero = new
    return zero


def meet(a, b) -> Any:
    """Return the smaller of two balls that both enclose the same number."""
    return a if a.rad() < b.rad() else b


def bound(C) -> float:
    """Return a bound of the norm (largest row sum) of a matrix of balls."""
    return max(float(sum((abs(C[i, j]).upper() for j in range(C.ncols())), flint().arb(0)).upper()) for i in range(C.nrows()))
