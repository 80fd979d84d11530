r"""
Peterka: a mass between two stops
=================================

*Level: further on. Time: 2 s.*

F. Peterka mapped the motions of a mass between two rigid stops in the 1970s. The motion with one impact on each side is
symmetric, :math:`x(t + nT/2) = -x(t)`; it loses its symmetry in a pitchfork, where a pair of asymmetric motions is
born. The motion without impacts coexists with it as long as the amplitude of the linear response is below the gap.
"""
import matplotlib.pyplot as plt

import bifurc as bf

system = bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=2.0, amplitude=2.0, gap=1.0, restitution=0.7)
orbit = bf.find_orbit(system)
assert orbit.success and len(orbit.events) == 2
branch = bf.trace(orbit, "amplitude", bounds=(1.5, 6.0))
print(branch.special_points)
pitchfork = branch.special_points.of("branch_point")[0]
pair = bf.switch_branch(pitchfork)
assert len(pair) == 2 and all(item.closure == 1 for item in pair)
asymmetric = bf.trace(pair[0], "amplitude", bounds=(3.0, 6.0))  # the other one is its mirror image
assert abs(pitchfork.parameter - 3.397988672) < 5e-10

# %%
# The free motion coexists with it up to its grazing, that of the linear response.
stiffness = 1.0 - 2.0**2 + 2j * 0.1 * 2.0
free = bf.find_orbit(system, guess=((2.0 / stiffness).real, -2.0 * (2.0 / stiffness).imag))
without = bf.trace(free, "amplitude", bounds=(1.5, 3.5))
grazing = without.special_points.of("grazing")[0]
assert abs(grazing.parameter - abs(stiffness)) < 1e-11

figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
for line in (branch, asymmetric, without):
    line.plot(ax)
ax.set_ylim(0.34, 0.95)
