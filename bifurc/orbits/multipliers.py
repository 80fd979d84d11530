"""Floquet multipliers of a monodromy matrix without those that say nothing of stability.

A state that nothing changes in a period has the multiplier 1, and one that a shift takes away in every period 0.  Where nothing
depends on time a shift of the phase has it too: with the vector field f, M f = f.  All are taken out of the matrix, not out of
the list of eigenvalues, so that a multiplier that happens to be near 1 keeps its digits (Nayfeh & Balachandran 1995, section
3.2).
"""
import numpy as np

from ..elements.timed.shift import Shift
from .shooting.sequence import BEFORE

NEUTRAL = 1e-8  # | |multiplier| - 1 | below this: stability is not known


def attracting(multipliers) -> bool | None:
    """Return whether all multipliers lie inside the unit circle; None where the largest lies on it."""
    top = float(np.abs(multipliers).max(initial=0.0))
    return None if abs(top - 1.0) < NEUTRAL else top < 1.0


def nontrivial(equations, whole, U, M, labels, gradient=None) -> np.ndarray:
    """Return the multipliers, complex, largest modulus first; infinite where the matrix is.

    Parameters
    ----------
    equations : Equations
        Kernels, tables and weights of the orbit.
    whole : Signature
    U : ndarray (m (1 + ns),)
        The orbit over its full period, as `repeated` gives it.
    M : ndarray (ns, ns)
        Derivative of the map over a period just before the first node.
    labels : Labels
        What nothing changes.
    gradient : ndarray (ns,), optional
        Of an energy that the motion keeps, just before the first node: its multiplier 1 is left out as well.
    """
    M, moved = labels.reduced(M), directions(equations.scene.system.elements, labels.rows.shape[1])[labels.rest]
    if not np.isfinite(M).all():
        return np.full(len(M) - moved.shape[1] - (whole.clock > 0.0) - (gradient is not None), complex(np.inf))
    if moved.size:
        M = without(M, moved, equations.weights[labels.rest])
    if whole.clock:
        rest, row = labels.rest, None if gradient is None else labels.seen(gradient)
        M = without(M, field_before(equations, whole, U)[rest], equations.weights[rest], row)
    found = np.linalg.eigvals(M).astype(complex) if len(M) else np.empty(0, complex)
    return found[np.lexsort((-found.imag, -found.real, -np.abs(found).round(14)))]


def field_before(equations, whole, U) -> np.ndarray:
    """Return the rate (ns,) of the state just before the first node."""
    T, ns = equations.path.tables, equations.scene.ns
    x, f = np.zeros(T.A.shape[2]), np.empty(ns)
    x[:ns] = U[1:1 + ns]
    equations.kernel.forcing(T, U[0] * 2.0 * np.pi / T.flat[0], x)
    equations.kernel.field(T, int(whole.nodes[0, BEFORE]), x, f)
    return f


def directions(elements, ns: int) -> np.ndarray:
    """Return the directions (ns, k) along which motions are put back to zero in every period, see `compose.shifts`."""
    found = [element.direction for element in elements if isinstance(element, Shift) and element.by is None]
    return np.array([(*direction, *(0.0,) * (ns - len(direction))) for direction in found]).reshape(-1, ns).T


def without(M, direction, weights, row=None) -> np.ndarray:
    """Return the matrix of ``M`` (n, n) on the states modulo its eigenvector ``direction`` (n,), or several (n, k), and among them
    on those that its left eigenvector ``row`` (n,) does not see; the two are one Jordan block where M f = f and E M = E."""
    unit = (direction.T / weights).reshape(-1, len(weights)).T
    if not unit.any():
        return M
    Q = np.linalg.qr(unit, mode="complete")[0][:, unit.shape[1]:]
    if row is not None:
        Q = Q @ np.linalg.qr((Q.T @ (row * weights))[:, None], mode="complete")[0][:, 1:]
    return Q.T @ (M * weights / weights[:, None]) @ Q
