r"""
Shaw and Holmes 1983: an oscillator with a stop
===============================================

*Level: first steps. Time: 2 s.*

S. W. Shaw and P. J. Holmes studied :math:`\ddot x + 2 \zeta \dot x + x = F \cos \omega t`, :math:`x \le \sigma`, with
restitution :math:`r`. The orbit with one impact in n periods is known in closed form, and so are its folds and flips:
with the homogeneous flow over n periods (entries :math:`e_{12}`, trace, determinant :math:`D`), the impact speed there
is

.. math:: v = \frac{(1 + r)\, e_{12}\, \omega^2 \sigma}{K \mp (1 + r^2 D)}

(minus: fold, plus: flip). The branch that bifurc traces must have exactly these points.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

zeta, omega, sigma, r = 0.05, 2.5, 1.0, 0.7


def special_force(n, sign):
    """Force at the fold (sign -1) or flip (+1) of the orbit with one impact in n periods."""
    t, wd = 2.0 * np.pi * n / omega, np.sqrt(1.0 - zeta**2)
    decay, c, s = np.exp(-zeta * t), np.cos(wd * t), np.sin(wd * t)
    e12, e22 = decay * s / wd, decay * (c - zeta * s / wd)
    trace, D = 2.0 * decay * c, decay**2
    lam = (1.0 + r) * e12 / (trace - 1.0 - D)
    gam = 1.0 - (1.0 + r) * (e22 - D) / (trace - 1.0 - D)
    K = -r * trace + (1.0 + r) * e12 * (2.0 * zeta * gam - (1.0 - omega**2) * lam)
    v = (1.0 + r) * e12 * omega**2 * sigma / (K + sign * (1.0 + r**2 * D))
    response = np.hypot(sigma - lam * v, gam * v / omega)
    return response * np.hypot(1.0 - omega**2, 2.0 * zeta * omega)


# %%
# The orbit with one impact a period, from a force where it is stable, down to its birth at the grazing of the free
# motion.
system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=13.5, gap=sigma, restitution=r)
branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(5.0, 14.0))
flip = branch.special_points.of("period_doubling")[0]
grazing = branch.special_points.of("grazing")[-1]
assert abs(flip.parameter - special_force(1, 1.0)) < 1e-10
assert abs(min(p.parameter for p in branch.special_points.of("grazing"))
           - sigma * np.hypot(1.0 - omega**2, 2.0 * zeta * omega)) < 1e-10
print(branch.special_points)

# %%
# At the flip an orbit of twice the period is born: two impacts in two periods.
doubled = bf.trace(bf.switch_branch(flip)[0], "amplitude", bounds=(9.0, 14.0))
assert doubled.orbits[len(doubled) // 2].periods == 2

figure, ax = plt.subplots(figsize=(6.0, 3.8), layout="constrained")
branch.plot(ax)
doubled.plot(ax)
