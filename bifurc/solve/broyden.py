"""Broyden's methods for f(x) = 0 (Broyden 1965): the Jacobian is kept as a QR factorisation and updated, never formed again.

"good" changes the Jacobian least such that it explains the last step, J+ = J + (df - J dx) dx^T/(dx^T dx); "bad" changes its
inverse least, J+^-1 = J^-1 + (dx - J^-1 df) df^T/(df^T df).  Both are rank-one updates of the QR factors (Gill, Golub, Murray
& Saunders 1974), O(n^2).  The first Jacobian decides nearly everything where f has kinks (differences with a small step see
one piece only), so it is the exact one, or a given one, where there is one.  It stops on the residual: a small increment
is no convergence.  Where the residual no longer falls the Jacobian is computed again; where that does not help either, it
says so.
"""
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg

from ..enumerations import DescribedEnum
from .interrupts import LARGE, interruptible

TOLERANCE = 1e-12  # of the residual over its size at the guess, or over the natural size that is given
ITERATIONS = 400
STALL = 8  # steps without a clearly smaller residual, after which the Jacobian is computed again
FALL = 0.5  # what counts as clearly smaller
LEAST_FALL = 0.99  # a new Jacobian that gains less than this is the last
BACKTRACKS = 8  # halvings of a step that does not shrink the residual; the shortest is taken anyway: Broyden is not monotone
GROWTH = 10.0  # a step may raise the residual by this before it is halved
STEP = 1e-7  # of differences, over the natural size of the unknowns


class BroydenStatus(DescribedEnum):
    """How the iteration ended."""

    CONVERGED = "converged", "The residual is below the tolerance."
    STALLED = ("stalled", "The residual no longer falls, not even with a new Jacobian; start closer, or use Newton's "
                          "method with the exact Jacobian.")
    SINGULAR = "singular", "The Jacobian is singular; start elsewhere, or give another first Jacobian."
    NOT_FINITE = "not_finite", "The residual is NaN or infinite at the guess; start closer to the solution."
    ITERATIONS = "iterations", "The iteration limit was reached; start closer or allow more iterations."
    FALSE_CONVERGENCE = ("false_convergence", "The increment is small, but the residual is not: this is no solution. "
                                              "Stop on the residual instead (increment=None).")


@dataclass(frozen=True, slots=True)
class BroydenResult:
    """Outcome of `broyden`.

    Attributes
    ----------
    x : ndarray (n,)
        Where the residual was smallest.
    status : BroydenStatus
    iterations, evaluations, jacobians : int
        Steps; residuals, those for differences included; Jacobians computed.
    residual : float
        Euclidean norm.
    increment : float
        Euclidean norm of the last step.
    history : tuple of float
        Norm of the residual after each step, first that at the guess.
    """

    x: np.ndarray
    status: BroydenStatus
    iterations: int
    evaluations: int
    jacobians: int
    residual: float
    increment: float
    history: tuple[float, ...]

    @property
    def success(self) -> bool:
        """Whether the iteration converged."""
        return self.status is BroydenStatus.CONVERGED

    def __repr__(self) -> str:
        return (f"BroydenResult({self.status.value}, {self.iterations} iterations, {self.evaluations} evaluations, "
                f"residual {self.residual:.2e})")


class Factors:
    """A Jacobian as Q R; R is triangular at all times.

    Parameters
    ----------
    jacobian : array (n, n)
    """

    def __init__(self, jacobian):
        matrix = np.asarray(jacobian, float)
        self.q, self.r = interruptible(len(matrix) >= LARGE, None, partial(scipy.linalg.qr, check_finite=False), matrix)

    @property
    def singular(self) -> bool:
        """Whether a pivot is zero beside the largest."""
        d = np.abs(np.diag(self.r))
        return not (d.min() > 1e-15 * d.max())

    def solve(self, b):
        """Return J^-1 b."""
        return scipy.linalg.solve_triangular(self.r, self.q.T @ b, check_finite=False)

    def times(self, b):
        """Return J b."""
        return self.q @ (self.r @ b)

    def update(self, u, v):
        """Add u v^T to the Jacobian."""
        self.q, self.r = scipy.linalg.qr_update(self.q, self.r, u, v, check_finite=False)


def broyden(residual, x, jacobian=None, kind: str = "good", scale=1.0, size: float | None = None, tolerance: float = TOLERANCE,
            iterations: int = ITERATIONS, step: float = STEP, increment: float | None = None,
            restarts: bool = True) -> BroydenResult:
    """Solve ``residual(x) = 0``.

    Parameters
    ----------
    residual : callable
        ``residual(x) -> (n,)``.
    x : array (n,)
        The guess; not changed.
    jacobian : callable or array (n, n), optional
        ``jacobian(x)``, used at the guess and at restarts; an array is the first Jacobian (of a neighbouring problem), differences
        are taken at restarts; None: differences.
    kind : {"good", "bad"}
        Which of Broyden's updates.
    scale : float or array (n,)
        Natural size of the unknowns, in their units; updates and increments are measured in it.
    size : float, optional
        Natural size of the residual (Euclidean norm); default: its norm at the guess.
    tolerance : float
        Wanted norm of the residual over `size`, dimensionless.  A residual at rounding level of the Jacobian's terms always
        suffices.
    iterations : int
        Limit.
    step : float
        Of differences, over `scale`.
    increment : float, optional
        Stop when, and only when, the scaled step is shorter than this, as published methods do; the residual is then judged
        and the status is "false_convergence" if it is above `tolerance`.
    restarts : bool
        False: one Jacobian, updated for ever (as published).

    Returns
    -------
    BroydenResult

    Examples
    --------
    >>> import numpy as np
    >>> broyden(lambda x: x * x - 2.0, [1.0], jacobian=lambda x: np.diag(2.0 * x)).x
    array([1.41421356])
    """
    if kind not in ("good", "bad"):
        raise ValueError(f"broyden: kind = {kind!r} is not allowed; it must be 'good' or 'bad'")
    x = np.array(x, float, ndmin=1)
    scale = np.broadcast_to(np.asarray(scale, float), x.shape)
    count = {"evaluations": 0, "jacobians": 0}

    def f_of(at):
        count["evaluations"] += 1
        return np.asarray(residual(at), float)

    def factors_at(at, f, given):
        count["jacobians"] += 1
        if callable(jacobian):
            J = np.asarray(jacobian(at), float)
        elif given and jacobian is not None:
            J = np.array(jacobian, float)
        else:
            J = np.empty((len(f), len(at)))
            for i in range(len(at)):
                h = step * scale[i]
                moved = at.copy()
                moved[i] += h
                J[:, i] = (f_of(moved) - f) / h
        return Factors(J * scale) if np.isfinite(J).all() else None

    with np.errstate(all="ignore"):
        f = f_of(x)
        norm = float(np.linalg.norm(f))
        history = [norm]
        last = np.inf

        def result(status, at, residual_norm, steps):
            return BroydenResult(at, status, steps, count["evaluations"], count["jacobians"], residual_norm, last, tuple(history))

        if not np.isfinite(norm):
            return result(BroydenStatus.NOT_FINITE, x, norm, 0)
        wanted = tolerance * (norm if size is None else size)
        if norm <= wanted or norm == 0.0:
            return result(BroydenStatus.CONVERGED, x, norm, 0)
        factors = factors_at(x, f, True)
        if factors is None:
            return result(BroydenStatus.NOT_FINITE, x, norm, 0)
        best, best_norm, mark, since, fresh, renewed = x, norm, norm, 0, True, np.inf
        for number in range(1, iterations + 1):
            if factors.singular:
                if fresh or not restarts:
                    return result(BroydenStatus.SINGULAR, best, best_norm, number - 1)
                factors, fresh, since = factors_at(x, f, False), True, 0
                if factors is None or factors.singular:
                    return result(BroydenStatus.SINGULAR, best, best_norm, number - 1)
            dx = -factors.solve(f)
            trial, f_trial, damping = x, f, 1.0
            for halvings in range(BACKTRACKS + 1):
                damping = 0.5**halvings
                trial = x + damping * scale * dx
                f_trial = f_of(trial)
                norm_trial = float(np.linalg.norm(f_trial))
                if not restarts and np.isfinite(norm_trial):
                    break  # as published: the full step
                if norm_trial <= (1.0 if fresh else GROWTH) * norm:
                    break
            if not np.isfinite(norm_trial):
                return result(BroydenStatus.STALLED, best, best_norm, number)
            dx = damping * dx
            last = float(np.linalg.norm(dx))
            df = f_trial - f
            x, f, norm = trial, f_trial, norm_trial
            history.append(norm)
            if norm < best_norm:
                best, best_norm = x, norm
            rounding = 4.0 * np.finfo(float).eps * float(np.linalg.norm(np.abs(factors.r) @ np.abs(x / scale)))
            solved = norm <= max(wanted, rounding)
            if increment is not None and last < increment:
                return result(BroydenStatus.CONVERGED if solved else BroydenStatus.FALSE_CONVERGENCE, x, norm, number)
            if (increment is None and solved) or norm == 0.0:
                return result(BroydenStatus.CONVERGED, x, norm, number)
            fresh = False
            since = 0 if norm <= FALL * mark else since + 1
            mark = min(mark, norm) if norm <= FALL * mark else mark
            if restarts and since >= STALL:
                if best_norm > LEAST_FALL * renewed:
                    return result(BroydenStatus.STALLED, best, best_norm, number)
                renewed = best_norm
                x = best
                f = f_of(x)
                norm = best_norm
                factors = factors_at(x, f, False)
                if factors is None:
                    return result(BroydenStatus.NOT_FINITE, best, best_norm, number)
                mark, since, fresh = norm, 0, True
                continue
            _learn(factors, kind, dx, df)
        return result(BroydenStatus.ITERATIONS, best, best_norm, iterations)


def _learn(factors: Factors, kind: str, dx, df) -> None:
    """Update the factors by a step and what it changed."""
    if kind == "good":
        length = float(np.linalg.norm(dx))
        if length > 0.0:
            factors.update((df - factors.times(dx)) / length, dx / length)
        return
    # the same as a change of J: with H the inverse, H+ = H + a b^T -> J+ = J - (J a)(b^T J)/(1 + b^T J a) (Sherman-Morrison)
    length = float(df @ df)
    if length == 0.0:
        return
    jdx = factors.times(dx)
    a = jdx - df  # J (dx - H df)
    row = (factors.r.T @ (factors.q.T @ df)) / length  # b^T J
    denominator = float(df @ jdx) / length  # 1 + b^T (J dx - df)
    if denominator != 0.0 and np.isfinite(denominator):
        factors.update(-a / denominator, row)
