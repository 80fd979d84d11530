"""Branch points in two parameters: the unfolded equations whose solutions they are.

At a branch point of F(u, a) = 0 the matrix F_u is singular and F_a lies in its range.  These are two conditions, one more than a
curve in (a, b) can meet: in general b breaks the branch point into two branches that miss each other.  Where a symmetry, or a
solution that is there for all a, keeps it, the curve solves

    F(u, a, b) + beta w_0 = 0,    w^T F_a = 0,    F_u singular,

w the left null vector of F_u and w_0 that at the start, with beta = 0 all along (W. Govaerts, Numerical Methods for Bifurcations
of Dynamical Equilibria (2000), section 8; the beta of `branchpoint`).
"""
import copy

import numpy as np

from ..conditions import ALONG, Condition, finite_scale, smallest, weighted_second, wide_at
from ..families import Family, family_of
from ..kinds import SpecialPointKind
from ..problem import Monitor, Problem

BREAKS = "breaks"  # name of the monitor of beta
BROKEN = 1e-7  # beta, relative to the size of the residual's terms, with which branches no longer meet


class Unfolded(Problem):
    """F(u, a) + beta w_0 = 0 and w^T F_a = 0 with the unknowns (u, beta).

    Parameters
    ----------
    inner : Problem
        Of the branch.
    w0 : ndarray (n,)
        Unit left null vector of F_u at the branch point.
    x : ndarray (n + 1,)
        The branch point (u, a).
    """

    def __init__(self, inner, w0, x):
        self.inner, self.w0 = inner, w0
        self.parameter, self.signature = inner.parameter, inner.signature
        self.size = x.size
        self.x0 = np.concatenate([x[:-1], [0.0], x[-1:]])
        self.scale = np.insert(finite_scale(inner.scale, x), x.size - 1, 1.0)
        self._kept = [k for k, monitor in enumerate(inner.monitors) if monitor.boundary]
        self.monitors = (*(inner.monitors[k] for k in self._kept), Monitor(SpecialPointKind.BRANCH_POINT, BREAKS, boundary=True))

    def own(self, x):
        """Return the unknowns of the branch (u, ..., parameters) of a row of unknowns with beta."""
        return np.delete(x, self.size - 1)

    def _null(self, fu):
        """Left and right unit null vectors (n,) of the scaled F_u, oriented by ``w0``."""
        _, w, v = smallest(fu * self.scale[:-2])
        return (w, v) if w @ self.w0 >= 0.0 else (-w, -v)

    def residual(self, u, p):
        """Return F + beta w_0 and w^T F_a (n + 1,)."""
        f = np.reshape(np.asarray(self.inner.residual(u[:-1], p), float), self.size - 1)
        fu, fa = self.inner.jacobian(u[:-1], p)
        w, _ = self._null(np.reshape(fu, (f.size, f.size)))
        return np.append(f + u[-1] * self.w0, float(w @ np.reshape(fa, f.size)) * self.scale[-1])

    def jacobian(self, u, p):
        """Return the derivatives of `residual` in (u, beta) and in the parameter; those of w^T F_a hold at branch points.

        There w^T F_a = 0, so that F_u z = -F_a has a solution z, and the derivative is w^T d(F_a + F_u z).
        """
        n = self.size - 1
        fu, fa = self.inner.jacobian(u[:-1], p)
        fu, fa = np.reshape(fu, (n, n)), np.reshape(fa, n)
        w, _ = self._null(fu)
        scale = np.append(self.scale[:-2], self.scale[-1])
        z = -np.linalg.lstsq(fu * scale[:-1], fa, rcond=1e-9)[0] * scale[:-1]
        along = np.append(z, 1.0) * scale[-1]
        x, step = np.append(u[:-1], p), ALONG / max(1.0, float(np.linalg.norm(along / scale)))

        def wide(y):
            a, b = self.inner.jacobian(y[:-1], float(y[-1]))
            return np.column_stack([np.reshape(a, (n, n)), np.reshape(b, n)])
        slope = w @ (wide(x + step * along) - wide(x - step * along)) / (2.0 * step)
        full = np.zeros((n + 1, n + 1))
        full[:n, :n], full[:n, n], full[n, :n] = fu, self.w0, slope[:n]
        return full, np.append(fa, slope[n])

    def monitor_values(self, u, p, tangent):
        """Return the branch's own boundaries, and |beta| less what rounding leaves of it."""
        own = self.inner.monitor_values(u[:-1], p, np.delete(tangent, self.size - 1)) if self._kept else ()
        return np.array([*(own[k] for k in self._kept), abs(float(u[-1])) - BROKEN])

    def family_over(self, name, bounds):
        """Return the unfolded equations over a second parameter."""
        return UnfoldedFamily(self, family_of(self.inner, name, bounds))

    def restarted(self, x):
        """See `Problem.restarted`."""
        other = copy.copy(self)
        other.x0 = np.array(x, float)
        return other

    @property
    def states(self):
        """Those of the branch."""
        return self.inner.states

    @property
    def measure_names(self):
        """Those of the branch."""
        return self.inner.measure_names

    def measure(self, name, xs):
        """See `Problem.measure`."""
        return self.inner.measure(name, np.delete(xs, self.size - 1, axis=1))

    def solution(self, x):
        """Return the solution of the branch."""
        return self.inner.solution(self.own(x))

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        return {"kind": "unfolded", "of": self.inner.to_record(), "w0": self.w0.tolist(), "x0": self.own(self.x0).tolist()}


def from_record(record, inner) -> Unfolded:
    """Make the problem that gave ``record``, with the problem of the branch it stands on."""
    return Unfolded(inner, np.array(record["w0"]), np.array(record["x0"]))


class UnfoldedFamily(Family):
    """Unfolded equations over a second parameter: those of the branch's own family."""

    def __init__(self, problem, inner):
        self.problem, self.inner = problem, inner
        self.name, self.value, self.interval = inner.name, inner.value, inner.interval
        problem.scale[:-2], problem.scale[-1] = inner.scale[:-2], inner.scale[-2]
        self.scale = np.insert(inner.scale, problem.size - 1, 1.0)

    def _around(self, inner):
        other = copy.copy(self.problem)
        other.inner = inner
        return other

    def at(self, value):
        """See `Family.at`."""
        return self._around(self.inner.at(value))

    def alone(self, value):
        """See `Family.alone`."""
        return self._around(self.inner.alone(value))

    def over(self, low, high):
        """See `Family.over`."""
        inner = self.inner.over(low, high)
        return self if inner is self.inner else UnfoldedFamily(self.problem, inner)


class Crossed(Condition):
    """F_u of the branch is singular at a solution of the unfolded equations: the condition of a curve of branch points."""

    def value(self, family, x) -> float:
        """Return g at ``x`` = (u, beta, a, b) (n + 3,)."""
        return self._null(family, x)[0]

    def linearised(self, family, x, wide):
        """As `conditions.Fold.linearised`."""
        g, w, v = self._null(family, x)
        inner, n = family.inner, x.size - 3
        slope = weighted_second(inner, self.problem.own(x), w, np.append(inner.scale[:n] * v, 0.0))
        return g, np.insert(slope, n, 0.0)

    def _null(self, family, x):
        inner, n = family.inner, x.size - 3
        return smallest(wide_at(inner, self.problem.own(x))[:, :n] * inner.scale[:n])


def unfolded(problem, x) -> Unfolded | None:
    """Return the unfolded equations about a branch point ``x`` (n + 1,); None where F_u is regular there."""
    fu, _ = problem.jacobian(x[:-1], float(x[-1]))
    n = x.size - 1
    scaled = np.reshape(fu, (n, n)) * np.where(np.isfinite(problem.scale[:-1]), problem.scale[:-1], 1.0)
    g, w, _ = smallest(scaled)
    return Unfolded(problem, w, x) if abs(g) <= 1e-6 * max(float(np.linalg.norm(scaled, 2)), 1e-300) else None
