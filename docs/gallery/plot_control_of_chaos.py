r"""
Pyragas 1992, Ott, Grebogi and Yorke 1990: holding an unstable motion
=====================================================================

*Level: further on. Time: 3 s.*

A chaotic motion comes near unstable periodic motions again and again. K. Pyragas holds one of them by the force
:math:`K (x(t - T) - x(t))`, which vanishes on it; E. Ott, C. Grebogi and J. A. Yorke change a parameter by a little
once a period.

For the impact oscillator past its flip the motion with one impact a period has the closed form of Shaw and Holmes. A
perturbation that grows by :math:`\lambda` a period had the size :math:`1/\lambda` one period ago, so that it flies with
the stiffness :math:`1 + K (1 - 1/\lambda)`, and the multipliers under feedback solve

.. math:: \lambda^2 - \lambda\, \mathrm{tr}(E_\lambda S) + r^2 e^{-2 \zeta T} = 0.

The gains at which :math:`|\lambda| = 1` bound what works: between a flip and a Neimark-Sacker point.
"""
import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm
from scipy.optimize import root

import bifurc as bf

zeta, omega, gap, r, load = 0.05, 2.5, 1.0, 0.7, 12.0
T = 2.0 * np.pi / omega
system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=load, gap=gap, restitution=r)
orbit = bf.find_orbit(system, guess=(-4.0, 8.4))
impact = orbit.events[0]
assert abs(impact.speed - 4.53583258619301) < 1e-12
assert np.allclose(orbit.multipliers.real, (-1.16885409830315, -0.326051098548087), rtol=1e-11)

# %%
# Delayed feedback: which gains hold the motion? The closed form is solved for the gain and the angle of the multiplier.
found = bf.control.feedback_range(orbit, "displacement", (0.0, 0.2))
S = np.array([[-r, 0.0], [(1.0 + r) * (load * np.cos(omega * impact.time) - gap) / impact.speed, -r]])


def equation(unknowns, multiplier):
    gain, angle = unknowns
    value = multiplier(angle)
    E = expm(np.array([[0.0, 1.0], [-1.0 - gain * (1.0 - 1.0 / value), -2.0 * zeta]]) * T)
    h = value**2 - value * np.trace(E @ S) + r**2 * np.exp(-2.0 * zeta * T)
    return h.real, h.imag


for end, wanted in zip(found.ends, (0.00889700738219574, 0.112742011752238), strict=True):
    flip = str(end.kind) == "period_doubling"
    solved = root(equation, (end.gain * 1.01, np.pi if flip else np.angle(end.multiplier) + 0.01),
                  args=(lambda angle: np.exp(1j * angle),), tol=1e-14).x
    print(f"{end.kind}: K = {end.gain:.15f}, from the closed form {solved[0]:.15f}")
    assert abs(end.gain - wanted) < 1e-12 and abs(solved[0] - wanted) < 1e-12
assert abs(abs(np.angle(found.ends[1].multiplier)) - 1.9659569822698) < 1e-10

# %%
# Small changes of the load, once a period: the gain on the section half a period after the impact, and a chaotic motion
# that is caught.
section = (impact.time / T + 0.5) % 1.0
gain = bf.control.ogy(orbit, "amplitude", section=section).gain
assert np.allclose(gain, (0.514021444402009, 3.41010104228882), rtol=1e-9)
chaotic = system.with_parameters(amplitude=9.5)
controller = bf.control.ogy(bf.find_orbit(chaotic, guess=(-5.45, 0.0)), "amplitude", section=0.0)
start = bf.simulate(chaotic, (0.3, -1.0), periods=50).final
held = controller.simulate(start, 300, limit=0.5, noise=1e-3, seed=2, start=100)
print(f"caught in period {held.captured}")
assert held.captured is not None

figure = plt.figure(figsize=(7.4, 3.6), layout="constrained")
grid = figure.add_gridspec(2, 2)
found.plot(figure.add_subplot(grid[:, 0]))
upper, lower = held.plot([figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])])
upper.set(xlabel="", title="load changed once a period")
lower.set(ylabel="change of load")
