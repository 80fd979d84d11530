"""Alternating frequency-time with a Jenkins slider by displacement increments, all matrices dense: the textbook way.

Griffin 1980; Krack & Gross 2019, section 2.4.  Independent of the package: no modes, no events, no spectra.
"""
import numpy as np


def basis(H, N):
    """Return synthesis (N, 2H+1) and analysis (2H+1, N) matrices of [mean, cos 1, sin 1, ...]."""
    theta = 2.0 * np.pi * np.arange(N) / N
    columns = [np.ones(N)]
    for k in range(1, H + 1):
        columns += [np.cos(k * theta), np.sin(k * theta)]
    B = np.array(columns).T
    weight = np.full(2 * H + 1, 2.0 / N)
    weight[0] = 1.0 / N
    return B, (B * weight).T


def jenkins(u, stiffness, limit, periods=2):
    """Return force of the slider on the mass at samples and its dense derivative (N, N), after some periods."""
    N = len(u)
    w, dw = u.mean(), np.full(N, 1.0 / N)
    f, df = np.empty(N), np.empty((N, N))
    for _ in range(periods):
        for n in range(N):
            trial = stiffness * (u[n] - w)
            e = np.zeros(N)
            e[n] = 1.0
            if abs(trial) > limit:
                f[n], df[n] = -np.sign(trial) * limit, 0.0
                w, dw = u[n] - np.sign(trial) * limit / stiffness, e
            else:
                f[n], df[n] = -trial, -stiffness * (e - dw)
    return f, df


def stop(u, s, gap, stiffness):
    """Return force and slopes (N,) of a one-sided spring."""
    inside = u > gap
    return np.where(inside, -stiffness * (u - gap), 0.0), np.where(inside, -stiffness, 0.0)
