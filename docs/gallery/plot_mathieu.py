r"""
Mathieu's tongues
=================

*Level: first steps. Time: 10 s.*

The state of rest of :math:`\ddot x + 2 \zeta \dot x + (a - 2 q \cos 2 t)\, x = 0` is shaken out of its stability where the
stiffness varies at twice a natural frequency, or at a part of that (Mathieu 1868). Without damping the edges are the characteristic
values :math:`a_n(q)` and :math:`b_n(q)`; damping closes the tips.
"""
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import mathieu_a, mathieu_b

import bifurc as bf

system = bf.systems.mathieu_oscillator(a=6.0, q=0.8)
branch = bf.trace(bf.find_orbit(system, (0.0, 0.0)), "a", bounds=(-1.0, 6.0))
for point in branch.special_points:
    print(f"{point.kind:16} a = {point.parameter:.12f}")
edges = sorted(point.parameter for point in branch.special_points)
exact = sorted([mathieu_a(0, 0.8), mathieu_b(1, 0.8), mathieu_a(1, 0.8), mathieu_b(2, 0.8), mathieu_a(2, 0.8)])
assert np.abs(np.array(edges) - exact).max() < 1e-9

# %%
# The first tongue, with damping: its edge is a curve of flips in stiffness and modulation.
figure, axes = plt.subplots(figsize=(4.6, 3.4), layout="constrained")
q = np.linspace(0.0, 1.5, 200)
for n, colour in ((1, "0.2"), (2, "0.6")):
    axes.plot(mathieu_b(n, q), q, color=colour, lw=0.8, ls=":", label=f"$b_{n}$, $a_{n}$ (no damping)")
    axes.plot(mathieu_a(n, q), q, color=colour, lw=0.8, ls=":")
for zeta in (0.02, 0.1, 0.2):
    damped = bf.systems.mathieu_oscillator(a=3.0, q=0.8, zeta=zeta)
    rest = bf.trace(bf.find_orbit(damped, (0.0, 0.0)), "a", bounds=(-1.0, 3.0))
    flips = [point for point in rest.special_points if point.kind == "period_doubling"]
    edge = bf.trace_curve(flips[-1], ("a", "q"), bounds={"a": (-1.0, 3.0), "q": (0.01, 1.5)}, ds_max=0.05)
    axes.plot(edge.column("a"), edge.column("q"), label=rf"$\zeta$ = {zeta:g}")
    # to first order the tip of the tongue is where the modulation makes up for the damping: q = 2 zeta
    assert abs(edge.column("q").min() - 2.0 * zeta) < 4.0 * zeta**2
axes.set(xlabel="stiffness $a$", ylabel="modulation $q$", xlim=(-0.5, 5.0), ylim=(0.0, 1.5))
axes.legend(fontsize=7, loc="lower right")
plt.show()
