"""Douglas-Rachford splitting for set-valued friction in the frequency domain (Lions & Mercier 1979).

    0 in A(r) + N(r):   A(r) = Y P r - s_free (linear, one small solve a harmonic),   N the normal cone of the bounds (samples)

z = 2 A's resolvent - ... alternates between a projection on the bounds in time and a linear solve in which every contact has
a dashpot gamma, so undamped resonances and redundant contacts are no special cases.  It needs no Jacobian, costs O(H log H)
a step and converges for any start (both parts are monotone), in stick-slip slowly: it gives starts to `setvalued.solve`.
"""
from typing import NamedTuple

import numpy as np

from ..layout import Layout
from .sign_pattern import grid_size, on_grid

SAMPLES = 8  # a wave of the highest harmonic
ITERATIONS = 300
TOLERANCE = 1e-6  # change of the forces over the largest limit


class Split(NamedTuple):
    """Where the splitting ended.

    Attributes
    ----------
    x : ndarray (size,)
        Packed coefficients.
    forces : ndarray (contacts, H)
        Samples of the contact forces, within their bounds.
    change : float
        Largest difference of the two halves of a step over the largest limit.
    iterations : int
    """

    x: np.ndarray
    forces: np.ndarray
    change: float
    iterations: int


def split(layout: Layout, omega: float, mass, damping, stiffness, load, contacts, gamma: float | None = None,
          iterations: int = ITERATIONS, tolerance: float = TOLERANCE) -> Split:
    """Return an approximate solution of a balance with set-valued contacts and an otherwise linear system.

    Parameters
    ----------
    layout : Layout
    omega : float
        Excitation frequency.
    mass, damping, stiffness : array (n, n)
    load : array (size,)
        Packed coefficients.
    contacts : sequence of setvalued.Contact
    gamma : float, optional
        Force over speed; default: the impedance of the first contact at the lowest harmonics.
    iterations, tolerance
        Limit, and where to stop before.
    """
    n, nu = layout.n, omega / layout.periods
    M, C, K = (np.reshape(np.asarray(a, float), (n, n)) for a in (mass, damping, stiffness))
    rows = np.array([contact.row for contact in contacts])
    count = grid_size(layout.top) * SAMPLES // 8
    upper = np.array([on_grid(contact.upper, count) for contact in contacts])
    lower = np.array([on_grid(contact.lower, count) for contact in contacts])
    apart = upper < lower
    upper, lower = np.where(apart, 0.0, upper), np.where(apart, 0.0, lower)
    k = np.array(layout.harmonics)
    w = k * nu
    Z = K - w[:, None, None]**2 * M + 1j * w[:, None, None] * C
    if gamma is None:
        low = Z[k > 0][:2]
        size = [abs(rows[0] @ z @ rows[0]) / (v * (rows[0] @ rows[0])**2) for z, v in zip(low, w[k > 0], strict=False)]
        gamma = max(size) or 1.0
    damped = Z + gamma * 1j * w[:, None, None] * (rows.T @ rows)
    if k[0] == 0:
        damped[0] = K  # not used for the speeds; the mean position follows at the end
    ready = np.array([np.linalg.inv(z) if v or np.linalg.cond(z) < 1e15 else np.linalg.pinv(z)
                      for z, v in zip(damped, k, strict=True)])
    F = np.zeros((len(k), n), complex)
    for i, h in enumerate(k):
        slot = layout.slot(int(h)) * n
        F[i] = load[slot:slot + n] - (1j * load[slot + n:slot + 2 * n] if h else 0.0)
    given = np.array([on_grid(np.asarray(contact.speed, complex), count) for contact in contacts])
    z = np.zeros((len(rows), count))
    limit = float(max(upper.max(), -lower.min(), 1e-300))
    change, number, q = np.inf, 0, np.zeros((len(k), n), complex)
    factor = np.where(k == 0, 1.0, 2.0) / count
    r = np.clip(z, lower, upper)
    for _ in range(iterations):
        number += 1
        r = np.clip(z, lower, upper)
        g = 2.0 * r - z + gamma * given
        spectrum = np.fft.rfft(g, axis=1)
        phasors = spectrum[:, k].T * factor[:, None]  # (harmonics, contacts)
        q = np.einsum("hij,hj->hi", ready, F - phasors @ rows)
        added = gamma * 1j * w[:, None] * (q @ rows.T) / factor[:, None]
        spectrum[:, k] += added.T
        half = np.fft.irfft(spectrum, count, axis=1)
        z = z + half - r
        change = float(np.abs(half - r).max()) / limit
        if change <= tolerance:
            break
    means = np.fft.rfft(r, axis=1)[:, 0].real / count
    if k[0] == 0:
        q[0] = ready[0] @ (F[0] - means @ rows)
    return Split(layout.pack({int(h): value for h, value in zip(k, q, strict=True)}), r, change, number)
