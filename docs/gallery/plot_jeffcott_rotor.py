r"""
A Jeffcott rotor that rubs
==========================

*Level: further on. Time: 3 s.*

A disk with eccentricity :math:`\varepsilon` on a flexible shaft whirls with the amplitude :math:`\varepsilon \nu^2 / |1
- \nu^2 + 2 i \zeta \nu|` at the speed :math:`\nu`, until it touches its stator; with the stator shifted by d that is
where the amplitude reaches 1 - d. Beyond, the rotor rubs: F. Chu and Z. Zhang (1998) and many others found periodic,
quasi-periodic and chaotic motions. The motion with two rubs a turn doubles its period at :math:`\nu = 1.0854564383082`
(the number was found by an independent program).
"""
import matplotlib.pyplot as plt

import bifurc as bf

rotor = bf.systems.jeffcott_rotor(zeta=0.05, nu=1.04, eccentricity=0.2, stiffness=30.0, friction=0.02, disk_radius=20.0,
offset=0.6)
orbit = bf.find_orbit(rotor)
print(orbit)
assert orbit.success and orbit.stable and orbit.periods == 1
branch = bf.trace(orbit, "nu", bounds=(1.02, 1.12))
print(branch.special_points)
assert abs(branch.special_points.of("period_doubling")[0].parameter - 1.0854564383082) < 1e-8

# %%
# The path of the disk in its stator, which gives way where it is touched, and the distance from the middle of the stator.
assert sum(str(event.kind) == "contact" for event in orbit.events) == 2
figure, axes = plt.subplots(1, 2, figsize=(7.0, 3.6), layout="constrained")
orbit.plot(axes)
axes[0].set(xlabel="x / clearance", ylabel="y / clearance")
axes[1].set(xlabel="time / turn", ylabel="distance from the middle / clearance")
