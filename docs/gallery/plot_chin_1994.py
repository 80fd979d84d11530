r"""
Chin, Ott, Nusse and Grebogi 1994: period adding at a grazing
=============================================================

*Level: further on. Time: 1 s.*

Near a grazing an impacting system follows a map with a square root (Nordmark 1991). W. Chin and colleagues found what
it does: for a leading multiplier below 1/4 windows of period n = 2, 3, 4, ... add up towards the grazing and overlap,
between 1/4 and 2/3 they alternate with chaos, above 2/3 there is chaos at once. In one dimension,

.. math:: x' = \lambda x + \mu \ (x \le 0), \qquad x' = \mu - \sqrt{x} \ (x > 0),

the orbit of period n with one impact is stable between its flip :math:`\frac34 \lambda^{2n-2} (1 - \lambda)/(1 -
\lambda^n)` and its border :math:`\lambda^{2n-4} (1 - \lambda)^2 / (1 - \lambda^{n-1})^2`.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf
from bifurc.continuation.maps import SquareRootMap

lam = 0.2


def window(n):
    """Closed form: flip and border of period n."""
    return 0.75 * lam**(2 * n - 2) * (1 - lam) / (1 - lam**n), lam**(2 * n - 4) * (1 - lam)**2 / (1 - lam**(n - 1))**2


# %%
# Cycles of the map are found, continued, and located like orbits of an oscillator.
for n in (2, 3, 4):
    low, high = window(n)
    cycle = SquareRootMap(lam=lam, mu=np.sqrt(low * high)).find(n)
    branch = bf.trace(cycle, "mu", bounds=(0.5 * low, 2.0 * high))
    found = {str(p.kind): p.parameter for p in branch.special_points}
    print(n, found)
    assert abs(branch.special_points.of("period_doubling")[0].parameter / low - 1.0) < 1e-12
    assert min(abs(p.parameter / high - 1.0) for p in branch.special_points) < 1e-12

# %%
# The brute-force diagram over the logarithm of the distance from the grazing, with x over the square root of it: each factor of
# lambda squared adds one to the period. Bars are the windows of the closed form; they overlap.
mu = np.geomspace(1e-5, 1.0, 1200)
diagram = SquareRootMap(lam=lam, mu=0.1).diagram("mu", mu)
figure, ax = plt.subplots(figsize=(6.3, 3.8), layout="constrained")
scaled = diagram.points[:, :, 0] / np.sqrt(mu)[:, None]
ax.plot(np.repeat(mu, scaled.shape[1]), scaled.ravel(), ".", ms=1.5, mew=0.0, color="#0072B2")
for n, colour in zip((2, 3, 4, 5), ("#D55E00", "#009E73", "#CC79A7", "#E69F00"), strict=True):
    low, high = window(n)
    ax.plot([max(low, 1e-5), high], [1.02 + 0.07 * n] * 2, lw=3.0, color=colour, solid_capstyle="butt")
    ax.text(np.sqrt(max(low, 1e-5) * high), 1.03 + 0.07 * n, f"n = {n}", ha="center", va="bottom", fontsize=7, color=colour)
ax.set(xscale="log", xlim=(1e-5, 1.0), ylim=(-1.1, 1.5), xlabel=r"distance from the grazing $\mu$", ylabel=r"$x / \sqrt{\mu}$")
