"""The orbit of one impact a period past its flip: where its numbers come from, by the closed form of Shaw and Holmes."""
import numpy as np
from scipy.linalg import expm

import bifurc as bf

ZETA, OMEGA, GAP, RATIO, FORCE = 0.05, 2.5, 1.0, 0.7, 12.0


def closed_form(zeta=ZETA, omega=OMEGA, gap=GAP, ratio=RATIO, force=FORCE, periods=1):
    """Return speed before the impact and time of the impact of the n-1 orbit with the larger speed."""
    T = periods * 2.0 * np.pi / omega
    E = expm(np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]) * T)
    tr, D = np.trace(E), np.linalg.det(E)
    lam = (1.0 + ratio) * E[0, 1] / (tr - 1.0 - D)
    gam = 1.0 - (1.0 + ratio) * (E[1, 1] - D) / (tr - 1.0 - D)
    size = force / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    Q = lam**2 + gam**2 / omega**2
    v = (gap * lam + np.sqrt(gap**2 * lam**2 - Q * (gap**2 - size**2))) / Q
    psi = np.arctan2(-gam * v / (size * omega), (gap - lam * v) / size)
    return v, (psi + np.arctan2(2.0 * zeta * omega, 1.0 - omega**2)) / omega % (2.0 * np.pi / omega)


def impacting():
    """Return the unstable orbit with one impact a period at F = 12."""
    system = bf.systems.impact_oscillator(zeta=ZETA, omega=OMEGA, amplitude=FORCE, gap=GAP, restitution=RATIO)
    v, t = closed_form()
    period = 2.0 * np.pi / OMEGA
    start = bf.simulate(system, (GAP, -RATIO * v), duration=period - t, t0=t).final
    return bf.find_orbit(system, guess=start)
