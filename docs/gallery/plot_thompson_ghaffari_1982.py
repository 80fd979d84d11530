r"""
Thompson and Ghaffari 1982: the bilinear oscillator
===================================================

*Level: first steps. Time: 3 s.*

J. M. T. Thompson and R. Ghaffari looked at the resonances of moored ships and of oscillators with two stiffnesses. A
mass that meets a stiffer spring at :math:`x = g` vibrates freely with the period

.. math:: T = 2(\pi - \arccos(g / a)) + \frac{2}{\omega_b} \arctan \frac{\omega_b \sqrt{a^2 - g^2}}{g},
   \qquad a = \sqrt{2 E},\quad \omega_b = \sqrt{1 + k},

at energy E. With :math:`g = 0` the frequency :math:`2 \omega_b / (1 + \omega_b)` does not depend on the energy;
subharmonic resonances stand near its multiples.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf
from bifurc.elements import ElasticStop

k, g = 4.0, 0.5
wb = np.sqrt(1.0 + k)


def period(energy):
    """Closed form, above the energy of touching."""
    a = np.sqrt(2.0 * energy)
    return 2.0 * (np.pi - np.arccos(g / a)) + 2.0 / wb * np.arctan2(wb * np.sqrt(a * a - g * g), g)


# %%
# The free vibration over its energy: a family of conservative orbits, with the grazing of the stop on it.
system = bf.System(1.0, 0.0, 1.0, [ElasticStop(gap=g, stiffness=k)])
orbit = bf.nonlinear_mode(system, energy=0.5)
assert abs(orbit.omega - 2.0 * np.pi / period(0.5)) < 1e-12
backbone = bf.trace(orbit, "energy", bounds=(0.15, 5.0))
energies = backbone.column("energy")
omegas = np.array([item.omega for item in backbone.orbits])
np.testing.assert_allclose(omegas, 2.0 * np.pi / period(energies), rtol=1e-11)

# %%
# The forced response bends along it.
forced = bf.systems.bilinear_oscillator(zeta=0.02, omega=0.8, amplitude=0.1, gap=g, stiffness_ratio=1.0 + k)
response = bf.trace(bf.find_orbit(forced), "omega", bounds=(0.8, 2.0))
figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
# largest displacement of the free vibration: the energy is (1 + k) x^2 / 2 - k g x + k g^2 / 2 beyond the gap
highest = (k * g + np.sqrt((k * g)**2 + (1.0 + k) * (2.0 * energies - k * g * g))) / (1.0 + k)
ax.plot(omegas, highest, color="0.5", lw=1.0, ls="-.", label="free vibration")
response.plot(ax, measure="max_0", names={"omega": "frequency / natural frequency", "max_0": "largest displacement"})
ax.set(xlim=(0.8, 2.0), ylim=(0.0, 2.0))
