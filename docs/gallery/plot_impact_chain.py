r"""
A chain of eight masses: a torus is born
========================================

*Level: further on. Time: 2 s.*

In one degree of freedom an impact oscillator has no Neimark-Sacker bifurcation: the determinant of its map is below
one. Eight masses in a row, the last hitting a stop, have two: at the loads 0.36805484395092 and 0.42718039529557 a pair
of complex multipliers crosses the unit circle, and motion on a torus is born. The numbers are those of the closed form
of the one-impact orbit in 40 digits.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

system = bf.systems.impact_chain(n=8, omega=0.3, amplitude=0.36, gap=1.0, restitution=0.7)
orbit = bf.find_orbit(system, periods=1)
branch = bf.trace(orbit, "amplitude", bounds=(0.3, 0.46))
tori = sorted(p.parameter for p in branch.special_points.of("neimark_sacker"))
print(tori)
for wanted in (0.3680548439509227513747, 0.4271803952557291606825):
    assert min(abs(value - wanted) for value in tori) < 1e-10

# %%
# The multipliers along the impacting motion that is stable, unstable, and stable again: a pair leaves the unit circle and
# comes back.
figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
branch.plot(axes[0])
angle = np.linspace(0.0, 2.0 * np.pi, 400)
axes[1].plot(np.cos(angle), np.sin(angle), color="0.7", lw=0.8)
along = [row for row in branch.orbits if row.events and min(tori) - 0.01 < row.system.parameter("amplitude") < max(tori) + 0.01]
for row in along:
    multipliers = np.asarray(row.multipliers)
    axes[1].scatter(multipliers.real, multipliers.imag, 6, np.full(multipliers.size, row.system.parameter("amplitude")),
                    cmap="viridis", vmin=min(tori) - 0.01, vmax=max(tori) + 0.01, linewidths=0)
figure.colorbar(axes[1].collections[-1], ax=axes[1], label="forcing amplitude", shrink=0.8)
axes[1].set(xlabel="real part", ylabel="imaginary part", aspect="equal", xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))
