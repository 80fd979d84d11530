"""Micro-slip contacts a second time: closed forms of continua, and implicit incremental solves that know no modes."""
import numpy as np


def ring_work(n, amplitude, load, length, stiffness, area_contact):
    """Energy a cycle of a ring of n blocks (odd) in full slip: the trapezoidal rule of the continuum, in closed form.

    ``load`` is the friction force of the whole ring, ``stiffness`` E A, ``area_contact`` the contact stiffness of the ring.
    """
    u_s, u_e = load / area_contact, load * length / (8.0 * stiffness)
    return 4.0 * load * (amplitude - u_s - 2.0 / 3.0 * u_e * (1.0 - 1.0 / n**2))


def bar_force(drive, span):
    """Force of an infinitely fine bar over its friction force, for a virgin drive over its elastic limit (Menq 1986).

    ``span`` is the length over that on which a displacement dies out.
    """
    out = []
    for U in np.atleast_1d(drive):
        if U <= 1.0:
            out.append(U * np.tanh(span) / span)
        elif U >= 1.0 + 0.5 * span**2:
            out.append(1.0)
        else:  # the slip length by bisection
            low, high = 0.0, 1.0
            for _ in range(200):
                x = 0.5 * (low + high)
                value = 1.0 + span * x * np.tanh(span * (1.0 - x)) + 0.5 * (span * x) ** 2
                low, high = (x, high) if value < U else (low, x)
            out.append(x + np.tanh(span * (1.0 - x)) / span)
    return np.array(out)


def masing(virgin, drive, top):
    """Force at a drive on the way down from ``top`` and up from ``-top``, from the virgin curve (Masing 1926)."""
    down = virgin(top) - 2.0 * virgin(0.5 * (top - drive))
    return down, -virgin(top) + 2.0 * virgin(0.5 * (drive + top))


def slider(u, limit, stiffness):
    """Force of one elastic slider by return mapping over samples of its drive and limit (below zero: apart)."""
    w, out = u[0], []
    for now, most in zip(u, limit, strict=True):
        f = stiffness * (now - w)
        f = np.clip(f, -most, most) if most > 0.0 else 0.0
        w = now - f / stiffness
        out.append(f)
    return np.array(out)


def chain(u, limits, spring, contact, closed=False):
    """March a chain of blocks through samples of the drive; every step solved implicitly by a semi-smooth Newton method.

    Parameters
    ----------
    u : ndarray, shape (N,)
    limits : ndarray, shape (N, n)
        Of the contacts at every sample; below zero: apart.

    Returns
    -------
    force : ndarray, shape (N,)
    sliders : ndarray, shape (N, n)
    """
    n = limits.shape[1]
    K = np.zeros((n, n))
    for i in range(n if closed and n > 1 else n - 1):
        j = (i + 1) % n
        K[[i, j, i, j], [i, j, j, i]] += spring * np.array([1.0, 1.0, -1.0, -1.0])
    x, w = np.full(n, u[0]), np.full(n, u[0])
    forces, sliders = [], []
    for now, limit in zip(u, limits, strict=True):
        most = np.maximum(limit, 0.0)
        x[0] = now
        for _ in range(100):
            trial = contact * (x - w)
            f = np.clip(trial, -most, most)
            slope = contact * (np.abs(trial) < most)
            if n == 1:
                break
            r = K[1:] @ x + f[1:]
            step = np.linalg.solve(K[1:, 1:] + np.diag(slope[1:]), r)
            x[1:] -= step
            if np.abs(step).max() < 1e-14 * np.abs(u).max():
                break
        else:
            raise AssertionError("the Newton method does not end")
        f = np.clip(contact * (x - w), -most, most)
        w = x - f / contact
        forces.append(K[0] @ x + f[0])
        sliders.append(w)
    return np.array(forces), np.array(sliders)
