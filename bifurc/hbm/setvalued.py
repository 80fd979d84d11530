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
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import scipy.linalg

from ..solve.broyden import BroydenStatus, broyden
from .layout import Layout
from .setvalued_pattern import Pattern, added, derivative_matrix, evaluate, grid_size, on_grid, pattern

NARROWER = 0.25  # next width over the last, where it goes well
NARROWEST = 1e-10  # width over the first; a speed that small beside the first is none
FINISH_FROM = 0.1  # width over the first from which the set-valued law is tried
COARSE = 1e-4  # residual over the force scale at widths that are only passed
TOLERANCE = 1e-12  # residual over the force scale at the end; rounding of large terms always suffices
ITERATIONS = 60  # of one width
LEVELS = 60  # widths tried
SMALLEST_DAMPING = 1e-7
PATIENCE = 3  # damped steps in succession of the last iteration: it starts close, or not at all


class SetValuedStatus(StrEnum):
    """How the solution of a balance with set-valued friction ended."""

    CONVERGED = "converged"
    RESTS = "rests"
    HELD = "held"
    SINGULAR = "singular"
    NOT_FINITE = "not_finite"
    STUCK = "stuck"

    @property
    def sentence(self) -> str:
        """What it means, and what to try."""
        return {
            "converged": "The balance is solved with the set-valued law; the residual is at rounding level.",
            "rests": "No contact ever slips: the load stays within the friction limits, and the position is arbitrary within an "
                     "interval.",
            "held": "Within the kept harmonics friction holds every contact, although the load exceeds the limits: the true "
                    "motion slips briefly. Give more harmonics, or polish with find_orbit(system, guess=...).",
            "singular": "The Jacobian is singular: the linear part has a free motion that friction does not see. Add damping, or "
                        "stiffness.",
            "not_finite": "The residual is NaN or infinite; check the forces.",
            "stuck": "No damped step reduces the residual at some width of the regularisation; give more harmonics, or another start.",
        }[self.value]


@dataclass(frozen=True)
class Contact:
    """A set-valued friction contact along one row.

    Parameters
    ----------
    row : array (n,)
        The speed is s = row . q' + prescribed part; the force -r row acts on the coordinates.
    upper, lower : array, complex
        Phasors (constant first) of r while s > 0 and while s < 0, forces; apart where upper < lower.
    speed : array, complex
        Phasors of the prescribed part of s (belt, moving base).
    label : str
        For messages.
    """

    row: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    speed: np.ndarray = field(default_factory=lambda: np.zeros(1, complex))
    label: str = "contact"

    @property
    def limit(self) -> float:
        """Natural size of its force."""
        return 0.5 * float(np.abs(added(self.upper, -self.lower)).sum())


@dataclass(frozen=True)
class Linear:
    """The linear part of a balance: Z x - f, its Jacobian, and how large its terms are.

    Parameters
    ----------
    blocks : array (slots, n, slots, n) or (size, size)
        Dynamic stiffness in the packed layout.
    load : array (size,)
        Packed coefficients of the load.
    """

    blocks: np.ndarray
    load: np.ndarray

    def __call__(self, x):
        """Return residual (size,) and Jacobian (size, size)."""
        return self.blocks @ x - self.load, self.blocks

    @classmethod
    def of(cls, layout: Layout, omega: float, mass, damping, stiffness, load) -> "Linear":
        """Return the dynamic stiffness of M, C, K at the harmonics of a layout.

        Parameters
        ----------
        layout : Layout
        omega : float
            Excitation frequency.
        mass, damping, stiffness : array (n, n)
        load : array (size,)
        """
        n, slots, first = layout.n, layout.slots, int(layout.mean)
        M, C, K = (np.reshape(np.asarray(a, float), (n, n)) for a in (mass, damping, stiffness))
        Z = np.zeros((slots, n, slots, n))
        if first:
            Z[0, :, 0, :] = K
        for i, k in enumerate(layout.positive):
            w, j = k * omega / layout.periods, first + 2 * i
            Z[j, :, j, :] = Z[j + 1, :, j + 1, :] = K - w * w * M
            Z[j, :, j + 1, :], Z[j + 1, :, j, :] = w * C, -w * C
        return cls(Z.reshape(layout.size, layout.size), np.asarray(load, float))


@dataclass(frozen=True)
class SetValuedResult:
    """Outcome of `solve`.

    Attributes
    ----------
    x : ndarray (size,)
        Packed coefficients.
    status : SetValuedStatus
    residual : float
        Largest entry of the residual with the law of the end, a force.
    iterations, evaluations : int
        Newton steps and residuals over all widths.
    widths : ndarray (contacts,)
        Regularisation left: 0, or tiny for contacts that never slip.
    patterns : tuple of Pattern
        At the end, one a contact.
    path : tuple
        Widths passed: (over the first, Newton steps, residual); 0 is the set-valued law.
    room : tuple of (float, float)
        At rest: how far the mean force of each contact may be shifted, down and up.
    """

    x: np.ndarray
    status: SetValuedStatus
    residual: float
    iterations: int
    evaluations: int
    widths: np.ndarray
    patterns: tuple[Pattern, ...]
    path: tuple = ()
    room: tuple[tuple[float, float], ...] = ()

    @property
    def success(self) -> bool:
        """Whether the balance is solved."""
        return self.status in (SetValuedStatus.CONVERGED, SetValuedStatus.RESTS, SetValuedStatus.HELD)

    def __repr__(self) -> str:
        return (f"SetValuedResult({self.status.value}, {self.iterations} iterations, {self.evaluations} evaluations, "
                f"residual {self.residual:.2e})")


class Balance:
    """Residual and Jacobian of the balance for given widths.

    Parameters
    ----------
    layout : Layout
    omega : float
        Excitation frequency.
    rest : callable
        ``rest(x) -> (residual (size,), jacobian (size, size))`` of everything but the contacts (`Linear`, or more).
    contacts : sequence of Contact
    """

    def __init__(self, layout: Layout, omega: float, rest: Callable, contacts):
        self.layout, self.rest = layout, rest
        self.contacts = tuple(contacts)
        self.rate = omega / layout.periods  # of the slowest harmonic 1
        self.evaluations = 0
        self.patterns: tuple[Pattern, ...] = ()

    def speed(self, x, contact: Contact) -> np.ndarray:
        """Return the phasors 0 .. top of the speed of a contact."""
        first, k = int(self.layout.mean), self.layout.positive
        u = self.layout.matrix(x) @ contact.row
        c = np.zeros(self.layout.top + 1, complex)
        c[k] = self.rate * k * 1j * (u[first::2] - 1j * u[first + 1::2])
        return added(c, contact.speed) if np.any(contact.speed) else c

    def force(self, x, widths, jacobian: bool = True):
        """Return the packed forces <r_j> summed over the contacts (size,), and their derivative or None."""
        layout = self.layout
        first, k, n, slots = int(layout.mean), layout.positive, layout.n, layout.slots
        total = np.zeros((slots, n))
        derivative = np.zeros((slots, n, slots, n)) if jacobian else None
        found = []
        for contact, width in zip(self.contacts, widths, strict=True):
            p = pattern(self.speed(x, contact), contact.upper, contact.lower, width, layout.top, 2 * layout.top if jacobian else 0)
            found.append(p)
            r = np.zeros(slots)
            if first:
                r[0] = p.force[0].real
            r[first::2], r[first + 1::2] = p.force[k].real, -p.force[k].imag
            total += np.multiply.outer(r, contact.row)
            if derivative is not None:
                t = derivative_matrix(p.slope, layout.waves, layout.is_sine)
                by_x = np.zeros((slots, slots))
                by_x[:, first + 1::2] = self.rate * k * t[:, first::2]
                by_x[:, first::2] = -self.rate * k * t[:, first + 1::2]
                if n == 1:
                    derivative[:, 0, :, 0] += contact.row[0] ** 2 * by_x
                else:
                    derivative += by_x[:, None, :, None] * np.multiply.outer(contact.row, contact.row)[None, :, None, :]
        self.patterns = tuple(found)
        return total.ravel(), None if derivative is None else derivative.reshape(layout.size, layout.size)

    def residual(self, x, widths) -> np.ndarray:
        """Return R (size,)."""
        self.evaluations += 1
        return self.rest(x)[0] + self.force(x, widths, False)[0]

    def both(self, x, widths):
        """Return R (size,) and dR/dx (size, size)."""
        self.evaluations += 1
        r, j = self.rest(x)
        f, df = self.force(x, widths)
        return r + f, j + df


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
        x, size, status, count = iterate(balance, x, np.zeros(0), tolerance * scale, iterations)
        return SetValuedResult(x, status or SetValuedStatus.CONVERGED, size, count, balance.evaluations, np.zeros(0), ())
    still = _at_rest(balance, j0, tolerance * scale, iterations)
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
    found = broyden(lambda at: balance.residual(at, widths), x, lambda at: balance.both(at, widths)[1], size=1.0, tolerance=tolerance,
                    iterations=4 * iterations)
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


def _at_rest(balance: Balance, j0, tolerance: float, iterations: int):
    """Return the solution without any slip, if its forces fit between the bounds; None otherwise.

    The contacts are tied (s = 0 in the kept harmonics) by multipliers whose means, arbitrary there, are chosen in the
    middle of what the bounds leave.
    """
    layout, contacts = balance.layout, balance.contacts
    if any(np.any(contact.speed) for contact in contacts):
        return None
    rows = np.array([contact.row for contact in contacts])
    first, slots, n = int(layout.mean), layout.slots, layout.n
    x, lam = np.zeros(layout.size), np.zeros((slots, len(rows)))
    waving = np.arange(slots) >= first
    # tied speeds: rows of every slot but the mean
    ties = np.zeros((int(waving.sum()), len(rows), slots, n))
    for i, slot in enumerate(np.flatnonzero(waving)):
        ties[i, :, slot, :] = rows
    ties = ties.reshape(-1, layout.size)
    count = 0
    middle = np.array([0.5 * (contact.upper[0] + contact.lower[0]).real for contact in contacts])
    for _ in range(4):  # the means of the multipliers move the mean position only
        if first:
            lam[0] = middle
        for count in range(1, iterations + 1):
            r, j = balance.rest(x)
            if not (np.isfinite(r).all() and np.isfinite(j).all()):
                return None
            r = r + (lam @ rows).ravel()
            saddle = np.block([[j, ties.T], [ties, np.zeros((len(ties), len(ties)))]])
            right = -np.concatenate([r, ties @ x])
            step = np.linalg.lstsq(saddle, right, rcond=1e-13)[0]
            x = x + step[:layout.size]
            lam[waving] += step[layout.size:].reshape(-1, len(rows))
            if np.abs(right).max() <= tolerance or np.abs(step[:layout.size]).max() <= 1e-14 * (np.abs(x).max() + 1e-300):
                break
        r = balance.rest(x)[0] + (lam @ rows).ravel()
        size = float(np.abs(r).max())
        if size > 1e3 * tolerance:
            return None
        room, now = [], lam[0].copy() if first else np.zeros(len(rows))
        for i, contact in enumerate(contacts):
            low, high = allowance(layout, lam[:, i], contact)
            room.append((low, high))
            now[i] += 0.5 * (low + high) if np.isfinite(low + high) else 0.0
        if any(low > high for low, high in room):
            return None
        if not first:
            if any(low > 0.0 or high < 0.0 for low, high in room):
                return None
            break
        if np.abs(now - middle).max() <= 1e-12 * max(contact.limit for contact in contacts):
            break
        middle = now
    kinds = tuple(Pattern(np.zeros(1, complex), np.zeros(1, complex), np.zeros(0), np.zeros(1, int)) for _ in contacts)
    return SetValuedResult(x, SetValuedStatus.RESTS, size, count, balance.evaluations, np.zeros(len(contacts)), kinds, (),
                           tuple(room))


def allowance(layout: Layout, force, contact: Contact) -> tuple[float, float]:
    """Return how far the mean of a contact force (slots,) may be shifted down and up inside the bounds.

    The first exceeds the second when no shift fits.
    """
    first, k = int(layout.mean), layout.positive
    c = np.zeros(layout.top + 1, complex)
    if first:
        c[0] = force[0]
    c[k] = force[first::2] - 1j * force[first + 1::2]
    count = 4 * grid_size(max(layout.top, len(contact.upper)))
    r, up, low = on_grid(c, count), on_grid(contact.upper, count), on_grid(contact.lower, count)
    apart = up < low
    up, low = np.where(apart, 0.0, up), np.where(apart, 0.0, low)
    return float((low - r).max()), float((up - r).min())
