"""Coefficients of the collocation at the Gauss points of [0, 1], in the form for q'' = a(t, q, q').

With the accelerations ``a`` at the nodes ``c`` of a step h from (q, v),

    v(c h) = v + h SINGLE a,         q(c h) = q + h c v + h**2 DOUBLE a,
    v(h) = v + h WEIGHTS . a,        q(h) = q + h v + h**2 MOMENTS . a,

of order 2 NODES (Kuntzmann 1961, Butcher 1964; Hairer, Norsett, Wanner, Solving ODE I, II.7 and II.14).  Everything
follows from the nodes in rational arithmetic and is rounded once.
"""
from fractions import Fraction

import numpy as np

NODES = 8


def lagrange(points):
    """Return for each point the coefficients of the powers of the polynomial that is 1 there and 0 at the others."""
    rows = []
    for k, own in enumerate(points):
        polynomial, scale = [Fraction(1)], Fraction(1)
        for j, other in enumerate(points):
            if j != k:
                polynomial = [a - other * b for a, b in zip([Fraction(0), *polynomial], [*polynomial, Fraction(0)],
                                                         strict=True)]
                scale *= own - other
        rows.append([c / scale for c in polynomial])
    return rows


def _integrals(rows, end, times):
    """Integrals of the polynomials from 0 to ``end``, repeated ``times`` times."""
    out = []
    for row in rows:
        total = Fraction(0)
        for j in range(len(row) - 1, -1, -1):
            part = row[j] / (j + 1) if times == 1 else row[j] / ((j + 1) * (j + 2))
            total = total * end + part
        out.append(float(total * end**times))
    return out


_nodes = [Fraction((1.0 + x) / 2.0) for x in np.polynomial.legendre.leggauss(NODES)[0]]
_basis = lagrange(_nodes)

C = np.array([float(c) for c in _nodes])  # (NODES,)
SINGLE = np.array([_integrals(_basis, c, 1) for c in _nodes])  # (NODES, NODES)
DOUBLE = np.array([_integrals(_basis, c, 2) for c in _nodes])  # (NODES, NODES)
ONTO_SINGLE, ONTO_DOUBLE = SINGLE.T.copy(), DOUBLE.T.copy()  # row k: what the acceleration at node k gives to all
WEIGHTS = np.array(_integrals(_basis, Fraction(1), 1))  # (NODES,)
MOMENTS = np.array(_integrals(_basis, Fraction(1), 2))  # (NODES,)
EDGES = np.array([[float(row[0]) for row in _basis], [float(sum(row)) for row in _basis]])  # values at 0 and at 1
POWERS = np.array([[float(c) for c in row] for row in lagrange([Fraction(0), *_nodes, Fraction(1)])]).T.copy()
"""(NODES + 2, NODES + 2): row j gives the coefficient of (t/h)**j from the values at 0, the nodes, and 1."""
