"""Li's Galerkin method with Broyden iteration for dry friction, as published (Li 2019): for study, not for use.

The sign of the speed is taken at H samples of the period, tau_j = 2 pi j/H, with sign(0) = 0; its coefficients are those of
the discrete Fourier transform; Broyden's good method runs with full steps from one Jacobian and stops on the increment.
Between the samples' sign changes such a residual is affine, so it has a root only if a sign pattern reproduces itself: with
N = 40, alpha = 1.6 that is so for 19 of 85 values of H between 82 and 256, and for alpha = 1.4 (stick-slip) no H is known
that works (`studies.broyden_map`).  The one thing added is that the residual is looked at when the iteration has stopped: a
small increment with a large residual is named false convergence.
"""
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np

from ...solve.broyden import BroydenResult, BroydenStatus, broyden
from ..status import BalanceStatus
from .equations import Balance, Contact
from .sign_pattern import evaluate

INCREMENT = 1e-8  # Euclidean norm of the step at which the published iteration stops
ITERATIONS = 400
STEP = 1e-6  # of a differenced first Jacobian
TOLERANCE = 1e-8  # of the residual over the force scale, for the judgement afterwards


class FirstJacobian(StrEnum):
    """What Broyden's method starts from; the publication does not say."""

    LINEAR = "linear"
    DIFFERENCES = "differences"


@dataclass(frozen=True)
class Sampled:
    """The published residual: Z x - f plus the transform of the sampled sign forces.

    Parameters
    ----------
    balance : setvalued.Balance
        Layout, linear rest, contacts.
    samples : int
        H, at least 2 top + 1.

    Raises
    ------
    ValueError
        For too few samples.
    """

    balance: Balance
    samples: int

    def __post_init__(self):
        if self.samples < 2 * self.balance.layout.top + 1:
            raise ValueError(f"samples = {self.samples!r} is not enough for harmonic {self.balance.layout.top}; give at least "
                             f"{2 * self.balance.layout.top + 1}")

    @cached_property
    def basis(self) -> tuple[np.ndarray, np.ndarray]:
        """Cosines and sines of the kept harmonics at the samples tau_j = 2 pi j/H, j = 1 .. H: (H, nh) each.

        Published as matrices and kept so: a speed that vanishes at a sample has the sign of its rounding there, which decides
        paths and even successes.
        """
        angle = np.multiply.outer(2.0 * np.pi * np.arange(1, self.samples + 1) / self.samples, self.balance.layout.positive)
        return np.cos(angle), np.sin(angle)

    def __call__(self, x) -> np.ndarray:
        """Return the residual (size,)."""
        layout = self.balance.layout
        total = self.balance.rest(x)[0].copy()
        first, (cosines, sines) = int(layout.mean), self.basis
        for contact in self.balance.contacts:
            r = self.force(x, contact)
            packed = np.zeros(layout.slots)
            if first:
                packed[0] = r.mean()
            packed[first::2], packed[first + 1::2] = (2.0 / self.samples) * (r @ cosines), (2.0 / self.samples) * (r @ sines)
            total += np.multiply.outer(packed, contact.row).ravel()
        return total

    def force(self, x, contact: Contact) -> np.ndarray:
        """Return the sampled force of a contact (H,)."""
        layout = self.balance.layout
        first, k, (cosines, sines) = int(layout.mean), layout.positive, self.basis
        u = layout.matrix(x) @ contact.row
        phases = 2.0 * np.pi * np.arange(1, self.samples + 1) / self.samples
        s = self.balance.rate * (cosines @ (k * u[first + 1::2]) - sines @ (k * u[first::2])) + evaluate(contact.speed, phases)
        up, low = evaluate(contact.upper, phases), evaluate(contact.lower, phases)
        r = np.where(s > 0.0, up, np.where(s < 0.0, low, 0.5 * (up + low)))
        return np.where(up < low, 0.0, r)


def galerkin_broyden(residual: Sampled, x0, first: FirstJacobian | str = FirstJacobian.LINEAR, step: float = STEP,
                     increment: float = INCREMENT, iterations: int = ITERATIONS, tolerance: float = TOLERANCE) -> BroydenResult:
    """Run the published iteration.

    Parameters
    ----------
    residual : Sampled
    x0 : array (size,)
        Guess.
    first : FirstJacobian
        The exact linear part Z, or differences of the whole residual with `step`.
    step, increment, iterations
        As named; `increment` stops the iteration.
    tolerance : float
        Of the residual over the force scale, for the judgement.

    Returns
    -------
    BroydenResult
        Its status is CONVERGED only if the residual is small.
    """
    size = residual.balance.layout.size
    start = residual.balance.rest(np.zeros(size))
    force = max([float(np.abs(start[0]).max()), *(contact.limit for contact in residual.balance.contacts)]) or 1.0
    jacobian = start[1] if FirstJacobian(first) is FirstJacobian.LINEAR else None
    return broyden(residual, x0, jacobian, size=force, tolerance=tolerance, iterations=iterations, step=step, increment=increment,
                   restarts=False)


def galerkin(core, contacts, rest, method, starts):
    """Return packed coefficients, what `how` says, and None or the status, for `HarmonicBalance(solver="galerkin-broyden")`.

    The first start that converges is taken; otherwise the smallest residual.
    """
    layout = core.layout
    omega = float(core.numbers.omega[0]) * layout.periods
    samples = method.samples or 2 * (layout.top + 1)
    residual = Sampled(Balance(layout, omega, rest, [contact for contact in contacts if contact.limit > 0.0]), samples)
    runs = [galerkin_broyden(residual, start) for start in starts]
    found = next((run for run in runs if run.success), min(runs, key=lambda run: run.residual))
    force = max([float(np.abs(core.numbers.E).max()), *(contact.limit for contact in contacts)]) or 1.0
    how = {"method": "Galerkin with sampled sign and Broyden iteration (Li 2019)", "statement": found.status.sentence,
           "harmonics": [k / layout.periods for k in layout.harmonics], "samples": samples, "iterations": found.iterations,
           "residual": found.residual / force, "increment": found.increment}
    if found.success:
        return found.x, how, None
    false = found.status is BroydenStatus.FALSE_CONVERGENCE
    return found.x, how, BalanceStatus.FALSE_CONVERGENCE if false else BalanceStatus.NOT_CONVERGED
