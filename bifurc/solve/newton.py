"""Damped Newton iteration with an exact Jacobian (Deuflhard 2004, section 2.1: natural monotonicity test).

The step is halved until the simplified Newton correction shrinks; near a solution the full step is taken and the
iteration converges quadratically.  It ends when the correction is at rounding level, or, where the Jacobian is singular
in the solution, when the residual is.
"""
from dataclasses import dataclass

import numpy as np

from ..enumerations import DescribedEnum
from .bordered import factor, solve_factored

ITERATIONS = 50
SMALLEST_DAMPING = 1.0 / 1024.0


class NewtonStatus(DescribedEnum):
    """How the iteration ended."""

    CONVERGED = "converged", "The correction is at rounding level."
    SINGULAR = "singular", "The Jacobian is singular on the way; start elsewhere, or border it near a fold."
    NOT_FINITE = "not_finite", "The residual is NaN or infinite; start closer to the solution."
    STUCK = "stuck", "No damped step reduces the correction; the guess is probably not near a solution."
    ITERATIONS = "iterations", "The iteration limit was reached; start closer or allow more iterations."


@dataclass(frozen=True, slots=True)
class NewtonResult:
    """Outcome of `newton`: ``x`` (n,), iterations, Euclidean norm of the residual and of the last scaled correction."""

    x: np.ndarray
    status: NewtonStatus
    iterations: int
    residual: float
    correction: float

    @property
    def success(self) -> bool:
        """Whether the iteration converged."""
        return self.status is NewtonStatus.CONVERGED

    def __repr__(self) -> str:
        return f"NewtonResult({self.status.value}, {self.iterations} iterations, residual {self.residual:.2e})"


def newton(residual, jacobian, x, scale=1.0, tolerance: float = 1e-14, iterations: int = ITERATIONS,
           noise: float = 0.0) -> NewtonResult:
    """Solve ``residual(x) = 0``.

    Parameters
    ----------
    residual : callable
        ``residual(x) -> (n,)``.
    jacobian : callable
        ``jacobian(x) -> (n, n)``.
    x : array (n,)
        The guess; not changed.
    scale : float or array (n,)
        Natural size of the unknowns, in their units.
    tolerance : float
        Wanted size of the scaled correction, dimensionless; corrections at rounding level of ``x`` always suffice.
    iterations : int
        Limit.
    noise : float
        Norm of the residual below which a step that gains nothing on the last one is due to rounding: the iteration has converged.

    Returns
    -------
    NewtonResult

    Examples
    --------
    >>> import numpy as np
    >>> newton(lambda x: x * x - 2.0, lambda x: np.diag(2.0 * x), [1.0]).x
    array([1.41421356])
    """
    x = np.array(x, float, ndmin=1)
    scale = np.broadcast_to(np.asarray(scale, float), x.shape)
    correction = np.inf
    with np.errstate(all="ignore"):
        f = np.asarray(residual(x), float)
        for count in range(iterations):
            if not np.isfinite(f).all():
                return NewtonResult(x, NewtonStatus.NOT_FINITE, count, _norm(f), correction)
            j = np.asarray(jacobian(x), float)
            if not np.isfinite(j).all():
                return NewtonResult(x, NewtonStatus.NOT_FINITE, count, _norm(f), correction)
            if (np.abs(f) <= 2.0 * np.finfo(float).eps * (np.abs(j) @ np.abs(x))).all() or not f.any():
                last = 0.0 if correction == np.inf else correction
                return NewtonResult(x, NewtonStatus.CONVERGED, count, _norm(f), last)
            lu, pivots, sign, _ = factor(j * scale)
            if sign == 0.0:
                return NewtonResult(x, NewtonStatus.SINGULAR, count, _norm(f), correction)
            step = -solve_factored(lu, pivots, f)
            size = _norm(step)
            rounding = 4.0 * np.finfo(float).eps * _norm(x / scale)
            if size <= max(rounding, tolerance):
                x = x + scale * step
                return NewtonResult(x, NewtonStatus.CONVERGED, count + 1, _norm(residual(x)), size)
            if _norm(f) <= noise and size > 0.5 * correction:  # steps that do not shrink any more
                return NewtonResult(x, NewtonStatus.CONVERGED, count, _norm(f), size)
            damping = 1.0
            while True:
                trial = x + damping * scale * step
                f_trial = np.asarray(residual(trial), float)
                if np.isfinite(f_trial).all():
                    simplified = _norm(solve_factored(lu, pivots, f_trial))
                    if simplified <= (1.0 - 0.5 * damping) * size or simplified <= 16.0 * rounding:
                        break
                if _norm(f) <= noise:  # rounding of terms that cancel in the residual, which J does not show
                    return NewtonResult(x, NewtonStatus.CONVERGED, count, _norm(f), size)
                damping *= 0.5
                if damping < SMALLEST_DAMPING:
                    return NewtonResult(x, NewtonStatus.STUCK, count, _norm(f), size)
            x, f, correction = trial, f_trial, damping * size
    return NewtonResult(x, NewtonStatus.ITERATIONS, iterations, _norm(f), correction)


def _norm(vector) -> float:
    return float(np.sqrt(np.dot(vector, vector)))
