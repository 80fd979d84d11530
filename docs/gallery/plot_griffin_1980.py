r"""
Griffin 1980: a friction damper with one harmonic
=================================================

*Level: first steps. Time: 2 s.*

J. H. Griffin described turbine-blade dampers by an elastic slider (Jenkins element) and one harmonic. For an amplitude
:math:`a > L / k` the slider acts as stiffness and damping

.. math:: \omega^2 \Rightarrow 1 + \frac{k}{\pi} (\theta - \sin\theta \cos\theta), \qquad
   \text{loss} = \frac{4 L}{\pi a} \Big(1 - \frac{L}{k a}\Big), \qquad \theta = \arccos(1 - 2 L / k a).

Harmonic balance with one harmonic must reproduce this to rounding; the true motion differs by what the formula leaves
out.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

zeta, omega, k, limit, load = 0.01, 1.1, 1.0, 1.0, 1.0
system = bf.systems.jenkins_oscillator(zeta=zeta, omega=omega, amplitude=load, stiffness=k, limit=limit)
one = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=1))
a = abs(one.harmonic(1, 0))
theta = np.arccos(1.0 - 2.0 * limit / (k * a))
real = 1.0 + k / np.pi * (theta - np.sin(theta) * np.cos(theta)) - omega**2
imaginary = 2.0 * zeta * omega + 4.0 * limit / (np.pi * a) * (1.0 - limit / (k * a))
assert abs(a * np.hypot(real, imaginary) - load) < 1e-11
true = bf.find_orbit(system, guess=bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=21)))
print(f"one harmonic {a:.6f}, true first harmonic {abs(true.harmonic(1, 0)):.6f}")

# %%
# The response over the frequency for some slip limits: between the free and the stuck blade lies a best damper.
figure, ax = plt.subplots(figsize=(6.3, 3.8), layout="constrained")
for value, colour in zip((0.5, 1.0, 1.5, 2.0), ("#56B4E9", "#0072B2", "#009E73", "#D55E00"), strict=True):
    start = bf.find_orbit(system.with_parameters(limit=value, omega=0.7), method=bf.HarmonicBalance(harmonics=7))
    branch = bf.trace(start, "omega", bounds=(0.7, 1.8))
    ax.plot(branch.column("omega"), branch.column("max_0"), color=colour, label=f"slip limit {value}")
w = np.linspace(0.7, 1.8, 500)
ax.plot(w, 1.0 / np.hypot(1.0 - w**2, 2.0 * zeta * w), ":", color="0.5", lw=1.0, label="no damper")
ax.plot(w, 1.0 / np.hypot(1.0 + k - w**2, 2.0 * zeta * w), "--", color="0.5", lw=1.0, label="stuck damper")
ax.set(xlabel="frequency / natural frequency", ylabel="amplitude / static deflection", yscale="log", xlim=(0.7, 1.8),
       ylim=(0.4, 250))
ax.legend(ncols=2)
