r"""
Den Hartog 1931: forced vibration with dry friction
===================================================

*Level: first steps. Time: 4 s.*

J. P. Den Hartog solved the steady vibration of a mass with Coulomb friction in closed form. As long as the mass never
stops,

.. math:: X = \sqrt{V^2 - (f U)^2}, \qquad V = \frac{1}{1 - \beta^2}, \qquad U = \frac{\tan(\pi / 2 \beta)}{\beta},

with :math:`\beta = \omega / \omega_0` and :math:`f` the ratio of friction to load. Below resonance a large friction
makes the mass stop twice a period; then there is no closed form, and the event-driven orbit is the answer.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce


def den_hartog(beta, friction):
    """Amplitude of the motion without stops."""
    return np.sqrt((1.0 / (1.0 - beta**2))**2 - (friction * np.tan(np.pi / (2.0 * beta)) / beta)**2)


# %%
# The exact orbit at some frequencies, friction 0.3 of the load: it is found by simulation, and solved for its event
# sequence.
friction, betas = 0.3, np.array([0.6, 0.7, 0.8, 1.2, 1.4, 1.8])
found = []
for beta in betas:
    orbit = bf.find_orbit(bf.System(1.0, 0.0, 1.0, [HarmonicForce(1.0), Coulomb(friction)], omega=beta))
    assert orbit.success
    found.append(orbit.maximum())
np.testing.assert_allclose(found, den_hartog(betas, friction), rtol=1e-10)

# %%
# A branch over the frequency, and the onset of sticking. Den Hartog's boundary of motions that stop is the place where
# the acceleration just after a reversal vanishes.
start = bf.find_orbit(bf.System(1.0, 0.0, 1.0, [HarmonicForce(1.0), Coulomb(0.8)], omega=1.6))
branch = bf.trace(start, "omega", bounds=(0.7, 2.2))
for point in branch.special_points:
    print(point)

figure, ax = plt.subplots(figsize=(6.3, 3.8), layout="constrained")
grid = np.concatenate([np.linspace(0.55, 0.93, 200), [np.nan], np.linspace(1.07, 2.2, 200)])
ax.plot(grid, den_hartog(grid, friction), color="#0072B2", label="Den Hartog, friction 0.3")
ax.plot(betas, found, "o", ms=4.5, mfc="w", mec="#0072B2", label="bifurc, friction 0.3")
ax.plot(branch.column("omega"), branch.column("max_0"), color="#D55E00", label="bifurc, friction 0.8")
for point in branch.special_points.of("stick_onset"):
    size = np.interp(point.s, branch.column("s"), branch.column("max_0"))
    ax.plot([point.parameter], [size], "P", ms=6, mfc="#56B4E9", mec="k", mew=0.6, label="stops begin")
handles, labels = ax.get_legend_handles_labels()
shown = dict(zip(labels, handles, strict=True))  # one entry a word
ax.legend(shown.values(), shown.keys())
ax.set(xlabel="frequency / natural frequency", ylabel="amplitude / static deflection", xlim=(0.55, 2.2), ylim=(0, 6))
