r"""
McDonald, Grebogi, Ott and Yorke 1985: basins whose boundary is fractal
=======================================================================

*Level: further on. Time: 4 s.*

A start near a basin boundary is uncertain: a small error of its state may change the motion that it leads to. S. W.
McDonald and colleagues showed that the share of uncertain starts falls like :math:`f(\varepsilon) \sim
\varepsilon^\alpha`, and that the boundary has the dimension :math:`2 - \alpha`. A smooth boundary has :math:`\alpha =
1`: ten times the accuracy leaves a tenth of the doubt. Where :math:`\alpha` is small, accuracy is no help at all.

Two impact oscillators, and numbers that a second program found in double, long double and quadruple precision: at
:math:`\omega = 2.6` the exponent is 0.92 (a smooth boundary with long folds), at :math:`\omega = 4.25` it is 0.077.
"""
import os

import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

QUICK = os.environ.get("QUICK") == "1"
cells = 200
systems = {"A": bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8),
           "B": bf.systems.impact_oscillator(zeta=0.05, omega=4.25, amplitude=1.0, gap=0.1, restitution=0.8)}
grids = {"A": bf.Grid(q0=(-2.5, 0.0, cells), v0=(-3.0, 3.0, cells)), "B": bf.Grid(q0=(-2.4, 0.1, cells), v0=(-3.0, 3.0, cells))}
share = {"A": 0.4286875, "B": 0.442525}  # of the motion with one period, on 400 x 400 cells
periods = {"A": [1, 3], "B": [1, 5]}
wanted, within = {"A": 0.92, "B": 0.077}, {"A": 0.06, "B": 0.01}

figure, panels = plt.subplot_mosaic("AB;CC", figsize=(7.0, 6.2), layout="constrained", height_ratios=(1.3, 1.0))
law = panels["C"]
names = {"q0": "displacement", "v0": "velocity"}
for case, colour in zip("AB", ("#009E73", "#CC79A7"), strict=True):
    basins = bf.basins_of_attraction(systems[case], grids[case])
    assert sorted(item.periods for item in basins.attractors) == periods[case]
    first = basins.fractions[[item.periods for item in basins.attractors].index(1)]
    assert abs(first - share[case]) < 0.01
    uncertainty = basins.uncertainty(samples=4000 if QUICK else None)
    print(f"{case}: share {first:.4f}, {uncertainty}, dimension of the boundary {uncertainty.boundary_dimension:.2f}")
    assert abs(uncertainty.exponent - wanted[case]) < within[case] + (0.05 if QUICK else 0.0)
    basins.plot(panels[case], names=names)
    panels[case].set_title("", loc="right")
    panels[case].set_title(rf"{case}: $\omega$ = {systems[case].omega}", loc="left")
    law.loglog(uncertainty.perturbations, uncertainty.changed, "o", color=colour, mfc="w", ms=5)
    line = np.array([0.7e-4, 4e-2])
    away = np.log(uncertainty.changed) - uncertainty.exponent * np.log(uncertainty.perturbations)
    level = np.exp(np.average(away, weights=uncertainty.changed))
    law.loglog(line, level * line**uncertainty.exponent, color=colour, lw=1.0,
               label=rf"{case}: $\alpha$ = {uncertainty.exponent:.3f}")
law.set(xlabel=r"error of the start $\varepsilon$", ylabel="share of uncertain starts")
law.legend()
