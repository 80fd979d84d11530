"""Rubbing Jeffcott rotors integrated by scipy's DOP853, events by its root finder: a second implementation of the equations."""
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

TIGHT = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-14}


def elastic_rotor(y0, duration, *, zeta, nu, eccentricity, stiffness, friction, disk_radius, contact_damping=0.0, offset=0.0,
                  gravity=0.0):
    """Return the state (4,) of the elastic rub after a time from phase 0; contact begins at r = 1 and ends at zero force."""
    def parts(y):
        p = np.array([y[0] - offset, y[1]])
        r = np.hypot(*p)
        n = p / r
        return r, n, n @ y[2:], n[0] * y[3] - n[1] * y[2]

    def load(y):
        r, _, u, _ = parts(y)
        return stiffness * (r - 1.0) + contact_damping * u

    def field(t, y, touching):
        f = eccentricity * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - 2.0 * zeta * y[2:] - y[:2] - [0.0, gravity]
        if touching:
            _, n, _, w = parts(y)
            f = f - load(y) * (n + friction * np.sign(w + disk_radius * nu) * np.array([-n[1], n[0]]))
        return np.concatenate([y[2:], f])

    t, y, touching = 0.0, np.array(y0, float), load(y0) > 0.0 and parts(y0)[0] > 1.0
    while True:
        def ends(t, y, touching=touching):
            return load(y) if touching else parts(y)[0] - 1.0
        ends.terminal, ends.direction = True, -1 if touching else 1
        part = solve_ivp(lambda t, y, state=touching: field(t, y, state), (t, duration), y, events=ends, **TIGHT)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            return y
        touching = not touching


def synchronous_rub(zeta, nu, eccentricity, stiffness, friction):
    """Return the radii of synchronous rub without offset, ascending: |A (1 - nu^2 + k + i (2 zeta nu + mu k)) - k (1 + i mu)|
    = eccentricity nu^2."""
    a = 1.0 - nu**2 + stiffness + 1j * (2.0 * zeta * nu + friction * stiffness)
    b = stiffness * (1.0 + 1j * friction)
    roots = np.roots([abs(a)**2, -2.0 * (a * b.conjugate()).real, abs(b)**2 - (eccentricity * nu**2)**2])
    return np.sort(roots[(roots.imag == 0.0) & (roots.real > 1.0)].real)


def synchronous_eigenvalues(zeta, nu, radius, stiffness, friction):
    """Return the eigenvalues in the rotating frame of a synchronous rub of this radius (Zhang 2008, section 4.2)."""
    z, a, b = 2.0 * zeta, 1.0 - nu**2 + stiffness, 1.0 - nu**2 + stiffness * (1.0 - 1.0 / radius)
    c, d = 2.0 * zeta * nu + friction * stiffness * (1.0 - 1.0 / radius), 2.0 * zeta * nu + friction * stiffness
    product = np.polymul([1.0, z, a], [1.0, z, b])
    return np.roots(np.polyadd(product, np.polymul([2.0 * nu, c], [2.0 * nu, d])))


def contact_speeds(zeta, eccentricity, offset=0.0):
    """Return the speeds, ascending, at which the whirl without rub reaches the stator: the roots of
    (1 - g^2) nu^4 + (4 zeta^2 - 2) nu^2 + 1, g = eccentricity / (1 - |offset|)."""
    g = eccentricity / (1.0 - abs(offset))
    half, rest = 1.0 - 2.0 * zeta**2, 1.0 - g**2
    root = math.sqrt(half**2 - rest)
    return [math.sqrt(1.0 / (half + root)), math.sqrt((half + root) / rest)]


def synchronous_fold(zeta, eccentricity, stiffness, friction, low, high):
    """Return speed and radius of the fold of synchronous rub between two speeds: where the quadratic has a double root."""
    def coefficients(nu):
        a = 1.0 - nu**2 + stiffness + 1j * (2.0 * zeta * nu + friction * stiffness)
        b = stiffness * (1.0 + 1j * friction)
        return abs(a)**2, (a * b.conjugate()).real, abs(b)**2 - (eccentricity * nu**2)**2

    def left(nu):
        a, b, c = coefficients(nu)
        return b * b - a * c
    nu = brentq(left, low, high, xtol=1e-15, rtol=1e-15)
    a, b, _ = coefficients(nu)
    return nu, b / a


def rotating_rates(w, *, zeta, nu, eccentricity, stiffness, friction, casing_mass=None, casing_damping=0.0, casing_stiffness=0.0):
    """Return the rates of the state in the frame that turns with the spin, in contact and sliding forward: positions (x, y) of
    the rotor, and of the casing where it has a mass, then their velocities."""
    n = 1 if casing_mass is None else 2
    p, v = w[:2 * n].reshape(n, 2), w[2 * n:].reshape(n, 2)
    d = p[0] - (p[1] if n == 2 else 0.0)
    r = (d @ d) ** 0.5
    load = stiffness * (r - 1.0) * (d + friction * np.array([-d[1], d[0]])) / r
    bodies = [(1.0, 2.0 * zeta, 1.0, np.array([eccentricity * nu**2, 0.0]) - load),
              (casing_mass, casing_damping, casing_stiffness, load)]
    out = []
    for (m, c, k, f), x, u in zip(bodies[:n], p, v, strict=True):
        across, turned = np.array([-x[1], x[0]]), np.array([-u[1], u[0]])
        out.append((f - c * (u + nu * across) - k * x) / m + nu**2 * x - 2.0 * nu * turned)
    return np.concatenate([v.ravel(), *out])


def rotating_eigenvalues(w, **parameters):
    """Return the eigenvalues of `rotating_rates` at a state, the derivatives by complex steps."""
    h = 1e-30
    steps = (np.eye(len(w)) * 1j * h) + w
    return np.linalg.eigvals(np.array([rotating_rates(step, **parameters).imag / h for step in steps]).T)


def casing_radii(zeta, nu, eccentricity, stiffness, friction, casing_mass, casing_damping, casing_stiffness):
    """Return the relative radii above 1, ascending, of synchronous rub in an elastic casing (Zhang 2008, section 5.3)."""
    rotor = 1.0 - nu**2 + 2j * zeta * nu
    casing = casing_stiffness - casing_mass * nu**2 + 1j * casing_damping * nu
    a = rotor + stiffness * (1.0 + 1j * friction) * (1.0 + rotor / casing)
    b = stiffness * (1.0 + 1j * friction) * (1.0 + rotor / casing)
    roots = np.roots([abs(a)**2, -2.0 * (a * b.conjugate()).real, abs(b)**2 - (eccentricity * nu**2)**2])
    return np.sort(roots[(roots.imag == 0.0) & (roots.real > 1.0)].real)
