r"""
Two motions share the starts: a basin map
=========================================

*Level: first steps. Time: 3 s.*

At :math:`\omega = 2.6` the oscillator with the stop at its rest position has two periodic motions, with one and with
three periods (J. M. T. Thompson and colleagues drew such basins in the 1980s). The share of starts that lead to each
was found by a second implementation, closed-form flights from impact to impact: 0.4286875 and 0.5713125 of 400 x 400
cells.
"""
import matplotlib.pyplot as plt

import bifurc as bf

system = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.5, 0.0, 400), v0=(-3.0, 3.0, 400)))
print(basins.report())
assert sorted(item.periods for item in basins.attractors) == [1, 3]
assert {round(basins.fractions[0], 7), round(basins.fractions[1], 7)} == {0.4286875, 0.5713125}

# %%
# The boundary is the stable set of a saddle between them.
edge = bf.edge_state(basins, (0, 1))
print(edge)
figure, ax = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
basins.plot(ax, saddle=edge)
