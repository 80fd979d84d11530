"""Scalar conditions that make a point of a branch special, with derivatives: what a curve in two parameters solves.

A curve of special points solves F(u, a, b) = 0 together with one condition g(u, a, b) = 0.  Each condition here is smooth
along the curve, needs no bordering vectors that would age, and gives its gradient with a few Jacobians of the problem:

* singular matrix K (folds: F_u; flips: the Jacobian with multiplier -1): g = det K / (product of all singular values but the
  smallest) = +- the smallest singular value, with gradient w^T (dK) v of its singular vectors (w carries the sign);
* extremum of a measure m along the branch in a: g = m' t with the unit null vector t of [F_u F_a]; with lambda that fits
  J^T lambda = m' in the plane orthogonal to t, dg = t^T (m'' - lambda^T F'') (Lagrange);
* zero of a monitor of the problem (grazing, stick onset, ...): its own value, differenced.

Second derivatives enter as differences of the exact Jacobian along one vector, which is all that Newton needs.

References: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000), sections 3.3, 4.1, 4.4.
"""
import math

import numpy as np

ALONG = 1e-5  # scaled step of Jacobian differences along a unit vector (central)
ASIDE = 3e-4  # scaled step of fourth-order differences of scalars and residuals


def wide_at(family, x):
    """Return [F_u F_a] (n, n + 1), own units, at ``x`` = (u, a, b) (n + 2,)."""
    problem = family.at(float(x[-1]))
    fu, fa = problem.jacobian(x[:-2], float(x[-2]))
    n = x.size - 2
    out = np.empty((n, n + 1))
    out[:, :n] = np.reshape(fu, (n, n))
    out[:, n] = np.reshape(fa, n)
    return out


CENTRAL = ((-2, 1.0 / 12.0), (-1, -2.0 / 3.0), (1, 2.0 / 3.0), (2, -1.0 / 12.0))
ONE_SIDED = ((0, -25.0 / 12.0), (1, 4.0), (2, -3.0), (3, 4.0 / 3.0), (4, -0.25))


def difference(function, x, i, step):
    """Fourth-order difference of ``function(x)`` in component ``i`` with ``step`` in its own units.

    Central; one-sided where the function refuses one of the points with a `ValueError` (a parameter at the end of its range).
    """
    def summed(weights, h):
        total = 0.0
        for k, weight in weights:
            moved = x.copy()
            moved[i] += k * h
            total = total + weight * function(moved)
        return total / h

    for weights, h in ((CENTRAL, step), (ONE_SIDED, step), (ONE_SIDED, -step)):
        try:
            return summed(weights, h)
        except ValueError as error:
            refused = error
    raise refused


def orthogonal_sign(q):
    """Determinant of an orthogonal matrix: 1 or -1."""
    return 1.0 if np.linalg.det(q) > 0.0 else -1.0


def smallest(matrix):
    """Return (g, w, v): det / (product of the other singular values), with g = w^T K v and unit w, v."""
    u, sigma, vt = np.linalg.svd(matrix)
    sign = orthogonal_sign(u) * orthogonal_sign(vt)
    return sign * float(sigma[-1]), sign * u[:, -1], vt[-1]


def null_vector(wide, scale):
    """Return the unit null vector of ``wide`` (n, n + 1) in scaled unknowns, oriented by det [J; t] > 0, and the factors
    (q, r) of the transposed scaled matrix."""
    q, r = np.linalg.qr((wide * scale).T, mode="complete")
    negative = int(np.count_nonzero(r.diagonal() < 0.0)) % 2
    return orthogonal_sign(q) * (-1.0 if negative else 1.0) * q[:, -1], q, r


class Condition:
    """One scalar g that is zero along a curve; subclasses give its value and gradient.

    Parameters
    ----------
    problem : Problem
        Of the branch on which the curve begins.
    """

    def __init__(self, problem):
        self.problem = problem

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        raise NotImplementedError

    def linearised(self, family, x, wide):
        """Return g and its gradient (n + 2,), own units; ``wide`` (n, n + 1) = [F_u F_a] there."""
        raise NotImplementedError

    def reached(self, family, x) -> None:
        """Take note of a point ``x`` = (u, a, b) (n + 2,) of the curve, where g is zero.  Here: nothing."""

    def instants(self, problem, x) -> np.ndarray:
        """Return the times (k,) of what happens in a period at ``x`` = (u, a) (n + 1,), parts of the span; none: not known."""
        s = problem.sequence
        if s is None or not s.events or s.span == 0.0:
            return np.empty(0)
        return np.mod(np.reshape(x[:-1], (len(s.nodes), -1))[:, 0] / s.span, 1.0)


class Fold(Condition):
    """F_u is singular."""

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        n = x.size - 2
        return smallest(wide_at(family, x)[:, :n] * family.scale[:n])[0]

    def linearised(self, family, x, wide):
        """Return g and its gradient (n + 2,), own units; ``wide`` (n, n + 1) = [F_u F_a] there."""
        n = x.size - 2
        scale = family.scale
        g, w, v = smallest(wide[:, :n] * scale[:n])
        return g, weighted_second(family, x, w, np.append(scale[:n] * v, 0.0))


class Extremum(Condition):
    """A measure is stationary along the branch in the problem's own parameter."""

    def __init__(self, problem, name):
        super().__init__(problem)
        self.name = name

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        t, _, _ = null_vector(wide_at(family, x), family.scale[:-1])
        problem = family.at(float(x[-1]))
        return float(measure_gradient(problem, self.name, x[:-1]) * family.scale[:-1] @ t)

    def linearised(self, family, x, wide):
        """As `Fold.linearised`."""
        n, scale = x.size - 2, family.scale
        t, q, r = null_vector(wide, scale[:-1])
        slope = measure_gradient(family.at(float(x[-1])), self.name, x[:-1]) * scale[:-1]
        multiplier = np.linalg.solve(r[:n], q[:, :n].T @ slope)
        along = scale[:-1] * t
        gradient = -weighted_second(family, x, multiplier, along)
        step = ALONG
        move = np.append(step * along, 0.0)
        above, below = x + move, x - move
        problem = family.at(float(x[-1]))
        gradient[:-1] += (measure_gradient(problem, self.name, above[:-1])
                          - measure_gradient(problem, self.name, below[:-1])) / (2.0 * step)
        h = ASIDE * scale[-1]

        def slope_at(b):
            return float(measure_gradient(family.at(b), self.name, x[:-1]) @ along)
        gradient[-1] += (slope_at(x[-1] + h) - slope_at(x[-1] - h)) / (2.0 * h)
        return float(slope @ t), gradient


class Flip(Condition):
    """The Jacobian with multiplier -1 over a period is singular."""

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        return smallest(self._matrix(family, x))[0]

    def linearised(self, family, x, wide):
        """As `Fold.linearised`."""
        g, w, v = smallest(self._matrix(family, x))
        gradient = np.array([difference(lambda y: float(w @ self._matrix(family, y) @ v), x, i, ASIDE * family.scale[i])
                             for i in range(x.size)])
        return g, gradient

    def _matrix(self, family, x):
        n = x.size - 2
        return family.at(float(x[-1])).wrapped_jacobian(x[:-1], -1.0) * family.scale[:n]


class Zero(Condition):
    """A monitor of the problem is zero."""

    def __init__(self, problem, index):
        super().__init__(problem)
        self.index = index

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        problem = family.at(float(x[-1]))
        return problem.monitor_value(self.index, x[:-1], lambda: null_vector(wide_at(family, x), family.scale[:-1])[0])

    def linearised(self, family, x, wide):
        """As `Fold.linearised`."""
        gradient = np.array([difference(lambda y: self.value(family, y), x, i, ALONG * family.scale[i]) for i in range(x.size)])
        return self.value(family, x), gradient


class Circle(Condition):
    """A multiplier or a pair of them lies on the unit circle, of problems that do not watch theirs in every step.

    Parameters
    ----------
    problem : Problem
    test : callable
        ``test(multipliers) -> float``, zero there, see `stability_changes`.
    """

    def __init__(self, problem, test):
        super().__init__(problem)
        self.test = test

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        return float(self.test(family.at(float(x[-1])).multipliers_of_rows(x[None, :-1])[0]))

    def linearised(self, family, x, wide):
        """As `Fold.linearised`."""
        gradient = np.array([difference(lambda y: self.value(family, y), x, i, ALONG * family.scale[i]) for i in range(x.size)])
        return self.value(family, x), gradient


class Number(Condition):
    """A function of the solution is zero: a user's monitor."""

    def __init__(self, problem, function):
        super().__init__(problem)
        self.function = function

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, a, b) (n + 2,)."""
        return float(self.function(family.alone(float(x[-1])).solution(x[:-1])))

    def linearised(self, family, x, wide):
        """As `Fold.linearised`; a function of orbits costs much more than their equations: simple differences do for Newton."""
        gradient = np.empty(x.size)
        for i in range(x.size):
            move = np.zeros(x.size)
            move[i] = ALONG * family.scale[i]
            gradient[i] = (self.value(family, x + move) - self.value(family, x - move)) / (2.0 * move[i])
        return self.value(family, x), gradient


def weighted_second(family, x, w, along):
    """Return w^T d(F_x along) (n + 2,), own units: ``along`` (n + 1,) is fixed and in own units of (u, a).

    The components of (u, a) follow from the symmetry of second derivatives with two Jacobians, where these are derivatives of
    the residual beside solutions too, otherwise from differences of F_x; that of b from differences of F_x in b.
    """
    out = np.empty(x.size)
    if family.problem.derived_beside:
        move = np.append(ALONG * along, 0.0)
        out[:-1] = w @ (wide_at(family, x + move) - wide_at(family, x - move)) / (2.0 * ALONG)
    else:
        out[:-1] = [difference(lambda y: float(w @ (wide_at(family, y) @ along)), x, i, ASIDE * family.scale[i])
                    for i in range(x.size - 1)]
    h = ASIDE * family.scale[-1]
    above, below = x.copy(), x.copy()
    above[-1] += h
    below[-1] -= h
    out[-1] = w @ ((wide_at(family, above) - wide_at(family, below)) @ along) / (2.0 * h)
    return out


def measure_gradient(problem, name, x):
    """Return the gradient (n + 1,) of a measure in unknowns and parameter, own units; the problem's own or differenced."""
    made = problem.measure_gradient(name, x)
    if made is not None:
        return made
    scale = np.where(np.isfinite(problem.scale), problem.scale, 1.0)

    def value(y):
        return float(np.real(problem.measure(name, y[None])[0]))
    return np.array([difference(value, x, i, ASIDE * scale[i]) for i in range(x.size)])


def finite_scale(scale, x):
    """Natural sizes with those that were left open set to max(1, |x|)."""
    return np.array([s if math.isfinite(s) else max(1.0, abs(float(value))) for s, value in zip(scale, x, strict=True)])
