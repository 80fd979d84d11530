r"""
Popp and Stelter 1990: a mass on a moving belt
==============================================

*Level: further on. Time: 2 s.*

A mass on a belt sticks, is carried along, tears loose, slips back, and sticks again (K. Popp and P. Stelter; U.
Galvanetto). With Coulomb friction, static limit 1 and kinetic 0.6, the cycle is piecewise linear. Without damping its
slip lasts :math:`2\pi - 2\arctan(d/V)` and its stick :math:`2 d / V` with :math:`d = f_s - f_k`; with damping it dies,
with a stick of positive length, at the belt speed at which the slip comes back tangent to the speed of the belt.
"""
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import bifurc as bf

d, V = 0.4, 0.3
free = bf.find_orbit(bf.systems.belt_oscillator(zeta=0.0, belt_speed=V, static=1.0, kinetic=0.6))
assert abs(free.period - (2.0 * np.pi - 2.0 * np.arctan(d / V) + 2.0 * d / V)) < 1e-10

# %%
# With damping the cycle is followed in the belt speed to its end.
zeta = 0.05
wd = np.sqrt(1.0 - zeta**2)
s = brentq(lambda t: np.exp(zeta * t) * (np.cos(wd * t) - zeta / wd * np.sin(wd * t)) - 1.0, 1.5 * np.pi / wd + 1e-9,
           2.0 * np.pi / wd - 1e-9, xtol=1e-15)
end = -d * wd * np.exp(-zeta * s) / np.sin(wd * s)
cycle = bf.find_orbit(bf.systems.belt_oscillator(zeta=zeta, belt_speed=0.2, static=1.0, kinetic=0.6))
branch = bf.trace(cycle, "belt_speed", bounds=(0.1, 0.8))
print(branch.special_points)
assert abs(branch.column("belt_speed").max() - end) < 1e-8

figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.2), layout="constrained")
branch.plot(axes[0], measure="max_0", names={"belt_speed": "speed of the belt", "max_0": "largest displacement"})
axes[0].axvline(end, color="0.6", lw=0.8, zorder=0)
motion = bf.simulate(cycle.system, cycle.state, duration=2.0 * cycle.period)
t = np.linspace(0.0, 2.0 * cycle.period, 1200)
axes[1].plot(motion(t)[:, 0], motion(t)[:, 1], color="#0072B2")
axes[1].axhline(0.2, color="0.6", lw=0.8, zorder=0)
axes[1].text(0.64, 0.21, "stuck to the belt", ha="center", va="bottom", fontsize=7.5)
axes[1].set(xlabel="displacement", ylabel="velocity", ylim=(-0.45, 0.28))
