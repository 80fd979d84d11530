"""Harmonic balance with set-valued dry friction: the Galerkin equations themselves, solved from any start.

    R(x) = Z x - f + ... + sum_j w_j <r_j> = 0,   r_j(t) in [lower_j, upper_j], at a bound where the speed s_j is not zero

A trigonometric speed vanishes at isolated instants or always, so the coefficients <r_j> of a slipping contact are exact
integrals of a sign pattern (`setvalued_pattern`): no samples, hence none of the roots that sampling loses or invents (Li
2019 by the published way finds 9 of 84; at alpha = 1.4 there is nothing to find).  A contact that never slips keeps
s_j = 0 with its force inside the bounds.  For positive damping the equations are strongly monotone in the speeds: the
solution is unique.

The way there: r = clip(s/width, lower, upper) is once differentiable in the coefficients, so Newton's method with halving
converges from anywhere; its width is brought down, and when every contact has only proper reversals the last Newton
iteration runs on the set-valued law.  Every stop is on the residual.
"""
from collections.abc import Callable

import numpy as np
import scipy.linalg

from ...solve.broyden import BroydenStatus, broyden
from ..layout import Layout
from .equations import Balance, Contact, SetValuedResult, SetValuedStatus
from .full_stick import at_rest

NARROWER = 0.25  # next width over the last, where it goes well
NARROWEST = 1e-10  # width over the first; a speed that small beside the first is none
FINISH_FROM = 0.1  # width over the first from which the set-valued law is tried
COARSE = 1e-4  # residual over the force scale at widths that are only passed
TOLERANCE = 1e-12  # residual over the force scale at the end; rounding of large terms always suffices
ITERATIONS = 60  # of one width
LEVELS = 60  # widths tried
SMALLEST_DAMPING = 1e-7
PATIENCE = 3  # damped steps in succession of the last iteration: it starts close, or not at all


def solve(layout: Layout, omega: float, rest: Callable, contacts, x0=None, tolerance: float = TOLERANCE, first_width: float = 1.0,
          iterations: int = ITERATIONS, solver: str = "newton") -> SetValuedResult:
    """Solve a balance with set-valued contacts.

    Parameters
    ----------
    layout : Layout
    omega : float
        Excitation frequency.
    rest : callable
        Everything but the contacts: ``rest(x) -> (residual, jacobian)``.
    contacts : sequence of Contact
        Those whose bounds vanish are ignored.
    x0 : array (size,), optional
        Guess; default zero.
    tolerance : float
        Of the residual over the force scale (the largest of loads and limits).
    first_width : float
        Width to begin with over the natural one (1 over the impedance of the contact); small for a good guess.
    iterations : int
        Limit for one width.
    solver : {"newton", "broyden"}
        What solves for one width: Newton with halving, or Broyden's method from the exact Jacobian.

    Returns
    -------
    SetValuedResult
    """
    contacts = [contact for contact in contacts if contact.limit > 0.0]
    balance = Balance(layout, omega, rest, contacts)
    iterate = _broyden if solver == "broyden" else _newton
    x = np.zeros(layout.size) if x0 is None else np.array(x0, float)
    r0, j0 = rest(np.zeros(layout.size))
    scale = max([float(np.abs(r0).max()), *(contact.limit * float(np.abs(contact.row).max()) for contact in contacts)])
    scale = scale or 1.0
    if not contacts:
        x, size, failed, count = iterate(balance, x, np.zeros(0), tolerance * scale, iterations)
        return SetValuedResult(x, failed or SetValuedStatus.CONVERGED, size, count, balance.evaluations, np.zeros(0), ())
    still = at_rest(balance, tolerance * scale, iterations)
    if still is not None:
        return still
    first = first_width * np.array([_natural_width(balance, j0, contact, scale) for contact in contacts])
    total, path, factor, ratio = 0, [], 1.0, NARROWER
    passed: list[tuple[float, np.ndarray]] = []
    status: SetValuedStatus | None = None
    for _ in range(LEVELS):
        widths = factor * first
        guess = _predicted(balance, passed, factor, x, widths)
        trial, size, status, count = iterate(balance, guess, widths, COARSE * scale, iterations)
        total += count
        path.append((factor, count, size))
        if status is None:
            x = trial
            passed = [*passed[-1:], (factor, x)]
            if factor <= FINISH_FROM and _reversing(balance.patterns):
                done = _finish(balance, iterate, x, first, tolerance * scale)
                total += done[3]
                path.append((0.0, done[3], done[1]))
                if done[2] is None:
                    return _result(balance, done[0], SetValuedStatus.CONVERGED, done[1], total, done[4], path)
            if factor <= NARROWEST:
                break
            factor, ratio = factor * ratio, max(NARROWER, ratio * ratio)
        elif status is SetValuedStatus.STUCK and passed:
            ratio = np.sqrt(ratio)
            factor = passed[-1][0] * ratio
        else:
            break
    if status is None:  # every width down to the least: slow contacts hold
        x, size, status, count = iterate(balance, x, widths, tolerance * scale, iterations)
        total += count
        if status is None or size <= 1e-8 * scale:
            status = SetValuedStatus.HELD if all(_slow(balance, x, contact, width) for contact, width in
                                                 zip(contacts, widths, strict=True)) else SetValuedStatus.CONVERGED
    return _result(balance, x, status, size, total, widths, path)


def _predicted(balance: Balance, passed, factor: float, x, widths):
    """Return the better of the last solution and the line through the last two: what creeps is proportional to the width."""
    if len(passed) < 2:
        return x
    (f0, x0), (f1, x1) = passed
    line = x1 + (factor - f1) / (f1 - f0) * (x1 - x0)
    return min((line, x), key=lambda guess: float(np.linalg.norm(balance.residual(guess, widths))))


def _result(balance, x, status, size, total, widths, path) -> SetValuedResult:
    return SetValuedResult(x, status, size, total, balance.evaluations, widths, balance.patterns, tuple(path))


def _broyden(balance: Balance, x, widths, tolerance: float, iterations: int, patience: int = 0):
    """Return as `_newton`; Broyden's method from the exact Jacobian."""
    del patience
    found = broyden(lambda at: balance.residual(at, widths), x, lambda at: balance.both(at, widths)[1], size=1.0,
                    tolerance=tolerance, iterations=4 * iterations)
    r = balance.residual(found.x, widths)
    return found.x, float(np.abs(r).max()), _BROYDEN.get(found.status, SetValuedStatus.STUCK), found.iterations


_BROYDEN = {BroydenStatus.CONVERGED: None, BroydenStatus.SINGULAR: SetValuedStatus.SINGULAR,
            BroydenStatus.NOT_FINITE: SetValuedStatus.NOT_FINITE}


def _newton(balance: Balance, x, widths, tolerance: float, iterations: int, patience: int = 1000):
    """Return x, largest residual, None or why not converged, and the number of steps; the norm of R falls in each.

    ``patience`` is how many steps in succession may be damped before it is given up.
    """
    damped = 0
    r, j = balance.both(x, widths)
    size = float(np.abs(r).max())
    for count in range(iterations):
        if not (np.isfinite(size) and np.isfinite(j).all()):
            return x, size, SetValuedStatus.NOT_FINITE, count
        floor = 8.0 * np.finfo(float).eps * float((np.abs(j) @ np.abs(x)).max())
        if size <= max(tolerance, floor):
            return x, size, None, count
        lu, pivots = _factor(j)
        if lu is None:
            return x, size, SetValuedStatus.SINGULAR, count
        step = -scipy.linalg.lu_solve((lu, pivots), r, check_finite=False)
        norm, damping = float(np.linalg.norm(r)), 1.0
        while True:
            trial = x + damping * step
            r = balance.residual(trial, widths)
            if np.linalg.norm(r) <= (1.0 - 1e-4 * damping) * norm:
                break
            damping *= 0.5
            if damping < SMALLEST_DAMPING:
                return x, size, SetValuedStatus.STUCK, count
        x = trial
        r, j = balance.both(x, widths)
        size = float(np.abs(r).max())
        damped = damped + 1 if damping < 1.0 else 0
        if damped >= patience and size > tolerance:
            return x, size, SetValuedStatus.STUCK, count + 1
    return x, size, SetValuedStatus.STUCK, iterations


def _factor(j):
    """Return LU factors, or (None, None) where a pivot vanishes."""
    try:
        lu, pivots, info = scipy.linalg.lapack.dgetrf(j)
    except ValueError:
        return None, None
    return (lu, pivots) if info == 0 else (None, None)


def _natural_width(balance: Balance, j0, contact: Contact, scale: float) -> float:
    """Return a speed over a force: 1 over the impedance at the two lowest harmonics, wider for a weak contact."""
    layout = balance.layout
    first, n = int(layout.mean), layout.n
    Z = j0.reshape(layout.slots, n, layout.slots, n)
    w2 = float(contact.row @ contact.row)
    top = 0.0
    for i, k in enumerate(layout.positive[:2]):
        a = contact.row @ Z[first + 2 * i, :, first + 2 * i, :] @ contact.row
        b = contact.row @ Z[first + 2 * i, :, first + 2 * i + 1, :] @ contact.row
        top = max(top, float(np.hypot(a, b)) / (balance.rate * k * w2 * w2))
    return max(1.0, scale / contact.limit) / (top or 1.0)


def _reversing(patterns) -> bool:
    """Whether every contact passes from bound to bound through each narrow interval, and does slip."""
    for p in patterns:
        between = np.flatnonzero(p.kinds == 0)
        if len(p.instants) == 0:
            if len(between):
                continue  # never slips
            return True
        before, after = p.kinds[between - 1], p.kinds[(between + 1) % len(p.kinds)]
        if np.any(before == after):
            return False
    return any(len(p.instants) for p in patterns)


def _finish(balance: Balance, iterate, x, first, tolerance: float):
    """Return Newton's end with the set-valued law for contacts that slip, the least width for those that do not."""
    end = np.array([NARROWEST * f if len(p.instants) == 0 and p.kinds[0] == 0 else 0.0
                    for p, f in zip(balance.patterns, first, strict=True)])
    return (*iterate(balance, x, end, tolerance, 20, PATIENCE), end)


def _slow(balance: Balance, x, contact: Contact, width: float) -> bool:
    """Whether the speed of a contact is that of the regularisation only."""
    return float(np.abs(balance.speed(x, contact)).sum()) <= 1e3 * width * contact.limit
