r"""
Galvanetto and Bishop 1999: friction that falls with speed
==========================================================

*Level: further on. Time: 5 s.*

U. Galvanetto and S. R. Bishop followed a mass on a belt whose friction falls with the speed of slip. On a fast belt it
slides steadily; on a slow one this is unstable, and it sticks and slips. What lies between depends on the law. With
:math:`F(u) = f_k + (f_s - f_k) e^{-u/v_s}` steady sliding loses its stability in a Hopf point at the belt speed

.. math:: V_H = v_s \ln \frac{f_s - f_k}{2 \zeta v_s}, \qquad \ell_1 = \frac{\zeta}{8 v_s^2} > 0

(H. Hetzler, D. Schwarzer, W. Seemann, 2007): an unstable cycle without stick is born towards higher speeds. It grows
until it just reaches the speed of the belt, at :math:`V_c`, where it meets the stable stick-slip cycle: a fold that has
a corner. With a cubic law the cycle is stable and turns into stick-slip without a fold.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

# V_c, its period and the cycle at V = 1.49395 were computed with Taylor series in 40 digits
CORNER, PERIOD = 1.83660097220793, 6.30401373105203
law = {"law": "exponential", "static": 1.0, "kinetic": 0.5, "decay_speed": 0.5, "zeta": 0.05}
hopf = law["decay_speed"] * np.log((law["static"] - law["kinetic"]) / (2.0 * law["zeta"] * law["decay_speed"]))

# %%
# Steady sliding is a state of rest; its branch over the speed of the belt has the Hopf point.
sliding = bf.trace(bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=2.5, **law)), "belt_speed", bounds=(0.3, 3.0))
point = sliding.special_points.of("hopf")[0]
print(point, point.solution.lyapunov_coefficient())
assert abs(point.parameter - hopf) < 1e-11
assert abs(point.solution.lyapunov_coefficient() / (law["zeta"] / (8.0 * law["decay_speed"]**2)) - 1.0) < 1e-7

# %%
# The cycles born there, through the corner, to stick-slip.
cycles = bf.trace(bf.switch_branch(point)[0], "belt_speed", bounds=(0.3, 3.0))
corner = cycles.special_points.of("stick_onset")[0]
print(cycles.special_points)
assert abs(corner.parameter - CORNER) < 1e-11 and corner.reverses
assert abs(corner.problem.solution(corner.x).period - PERIOD) < 1e-9
unstable = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=1.49395, **law), guess=(-0.6388, 0.0), period=6.29)
assert abs(unstable.minimum() + 0.638809967039895) < 1e-10 and abs(unstable.multipliers[0].real - 1.48317407194657) < 1e-10
stick_slip = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=0.4, **law))
times = {str(event.kind): event.time for event in stick_slip.events}
assert abs((times["stick"] - times["slip"]) % stick_slip.period - 4.92650766131036) < 1e-10

# %%
# The cubic law, for comparison: the cycle is born stable, and at V_c its first stick does not turn the branch.
cubic = {"law": "cubic", "static": 1.0, "falling": 0.4, "rising": 0.1, "zeta": 0.05}
smooth = bf.trace(bf.find_orbit(bf.systems.belt_oscillator(belt_speed=0.948369, **cubic)), "belt_speed", bounds=(0.3, 1.3))
first = smooth.special_points.of("stick_onset")[0]
assert abs(first.parameter - 0.8967386176534) < 1e-11 and not first.reverses
assert abs(smooth.special_points.of("hopf")[0].parameter - 1.0) < 1e-11

figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained", sharey=True)
names = {"belt_speed": "speed of the belt", "max_0": "largest displacement", "q_0": "largest displacement"}
speed = np.linspace(0.3, 2.1, 400)
friction = law["kinetic"] + (law["static"] - law["kinetic"]) * np.exp(-speed / law["decay_speed"])
for part, dash, word in ((speed > hopf, "-", "steady sliding, stable"), (speed < hopf, ":", "steady sliding, unstable")):
    axes[0].plot(speed[part], friction[part], dash, color="0.5", lw=1.2, label=word)
for ax, branch, title in ((axes[0], cycles, "exponential law"), (axes[1], smooth, "cubic law")):
    branch.plot(ax, measure="max_0", names=names)
    ax.set(title=title, ylim=(0.4, 3.4))
