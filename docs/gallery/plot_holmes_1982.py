r"""
Holmes 1982: a ball on a vibrating table
========================================

*Level: first steps. Time: 2 s.*

P. J. Holmes studied a ball that bounces on a table moving as :math:`a \cos \omega t`. The exact ball (without his
high-bounce approximation) has an orbit that bounces once a period from

.. math:: a_0 = \frac{\pi g}{\omega^2} \frac{1 - r}{1 + r},

where it is born in a fold, to its flip at :math:`a_1 = \sqrt{a_0^2 + (2 g (1 + r^2) / ((1 + r)^2 \omega^2))^2}`.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

omega, r, gravity = 1.0, 0.8, 1.0
birth = np.pi * gravity / omega**2 * (1.0 - r) / (1.0 + r)
flip = np.hypot(birth, 2.0 * gravity * (1.0 + r**2) / ((1.0 + r)**2 * omega**2))

# %%
# The orbit with one bounce a period, from the state just before a bounce.
a = 0.5
angle = np.arcsin(-np.pi * gravity / omega * (1.0 - r) / (1.0 + r) / (a * omega))
time, speed = angle / omega % (2.0 * np.pi / omega), np.pi * gravity / omega
rest = 2.0 * np.pi / omega - time
start = (a * np.cos(angle) + speed * rest - 0.5 * gravity * rest**2, speed - gravity * rest)
system = bf.systems.bouncing_ball(omega=omega, amplitude=a, restitution=r, gravity=gravity)
orbit = bf.find_orbit(system, guess=start)
assert orbit.success and len(orbit.events) == 1
branch = bf.trace(orbit, "amplitude", bounds=(0.2, 1.2))
print(branch.special_points)
assert abs(branch.special_points.of("fold")[0].parameter - birth) < 1e-10
assert abs(branch.special_points.of("period_doubling")[0].parameter - flip) < 1e-10

figure, ax = plt.subplots(figsize=(6.3, 3.8), layout="constrained")
branch.plot(ax, names={"amplitude": r"amplitude of the table $a\,\omega^2/g$", "rms_0": r"rms height $x\,\omega^2/g$"})
