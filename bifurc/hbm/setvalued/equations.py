"""Contacts, linear part, residual and Jacobian of a balance with set-valued friction, and what solving it returns."""
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...enumerations import DescribedEnum
from ..layout import Layout
from .sign_pattern import Pattern, added, derivative_matrix, pattern


class SetValuedStatus(DescribedEnum):
    """How the solution of a balance with set-valued friction ended."""

    CONVERGED = "converged", "The balance is solved with the set-valued law; the residual is at rounding level."
    RESTS = ("rests", "No contact ever slips: the load stays within the friction limits, and the position is "
                      "arbitrary within an interval.")
    HELD = ("held", "Within the kept harmonics friction holds every contact, although the load exceeds the limits: "
                    "the true motion slips briefly. Give more harmonics, or polish with find_orbit(system, guess=...).")
    SINGULAR = ("singular", "The Jacobian is singular: the linear part has a free motion that friction does not see. "
                            "Add damping, or stiffness.")
    NOT_FINITE = "not_finite", "The residual is NaN or infinite; check the forces."
    STUCK = ("stuck", "No damped step reduces the residual at some width of the regularisation; give more harmonics, "
                      "or another start.")


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
