r"""
Shaw 1986, Hong and Liu 2000: how often does a rubbing mass stop?
=================================================================

*Level: first steps. Time: 4 s.*

A mass with dry friction under a harmonic load reverses, and may stand still for a while at each reversal. S. W. Shaw
(1986) studied when it stops at all and how stable its motion is; H.-K. Hong and C.-S. Liu (2000) counted the stops per
cycle: none, two, or at low frequency four, six, and more, because the free vibration dies out between the turns of the
load.

Without stops the motion is known in closed form. With :math:`h(\theta)` the decaying part of half a cycle, which does
not depend on the load, the mass begins to stop below the load

.. math:: \frac{\alpha_s}{\beta} = \frac{1}{D} \sqrt{h'(0)^2 + h''(0)^2}, \qquad D = [(1 - \Omega^2)^2 + (2 \zeta \Omega)^2]^{-1/2}.
"""
import os

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

import bifurc as bf

QUICK = os.environ.get("QUICK") == "1"


def onset(omega, zeta):
    """Load over friction below which the mass stops just after a reversal; the friction is 1."""
    wd, loss = np.sqrt(1.0 - zeta**2) / omega, zeta / omega
    e, cos, sin = np.exp(-loss * np.pi), np.cos(wd * np.pi), np.sin(wd * np.pi)
    A, B = np.linalg.solve([[1.0 + e * cos, e * sin],
                            [-loss - e * (loss * cos + wd * sin), wd + e * (wd * cos - loss * sin)]], [-2.0, 0.0])
    slope, bend = wd * B - loss * A, (loss**2 - wd**2) * A - 2.0 * loss * wd * B
    return np.hypot(slope, bend) * np.hypot(1.0 - omega**2, 2.0 * zeta * omega)


def motion(omega, zeta, load):
    return bf.find_orbit(bf.systems.dry_friction_oscillator(omega=omega, zeta=zeta, amplitude=load, friction=1.0))


def stops(orbit):
    """Intervals of rest per cycle."""
    return sum("stick" in event.mode_after for event in orbit.events) // orbit.periods


# %%
# The onset of stopping along the load, at three frequencies.
for omega, zeta, wanted in ((0.5, 0.1, 3.94319458595741668), (0.8, 0.1, 1.52890556878138916), (2.0, 0.1, 1.76667041633174530)):
    assert abs(onset(omega, zeta) - wanted) < 1e-12
    branch = bf.trace(motion(omega, zeta, 1.1 * wanted), "amplitude", bounds=(0.9 * wanted, 1.2 * wanted))
    located = branch.special_points.of("stick_onset")[0].parameter
    print(f"omega = {omega}: stops begin below the load {located:.14f}")
    assert abs(located - wanted) < 1e-11

# %%
# Motions that an independent event-driven program computed: largest displacement and stops per cycle.
for omega, zeta, load, largest, count in ((1.0 / 3.0, 0.1, 2.0, 1.61166144684, 2), (0.2, 0.02, 5.0, 4.72013539569, 2),
                                          (0.06, 0.02, 2.0, 1.03199125, 6), (1.0, 0.1, 1.6, 1.62291754679770128, 0)):
    orbit = motion(omega, zeta, load)
    print(f"omega = {omega:.2f}, load {load}: {stops(orbit)} stops, largest displacement {orbit.maximum():.10f}")
    assert stops(orbit) == count and abs(orbit.maximum() - largest) < 6e-9

# %%
# The chart of stops per cycle at a damping ratio of 0.02. At low frequency the number of stops is not monotone in
# anything.
frequencies = np.linspace(0.06, 0.5, 5 if QUICK else 23)
loads = np.linspace(1.25, 7.25, 4 if QUICK else 13)
chart = np.array([[stops(motion(omega, 0.02, load)) for omega in frequencies] for load in loads])
assert set(np.unique(chart)) <= {0, 2, 4, 6, 8}
print({int(count): int(np.sum(chart == count)) for count in np.unique(chart)})

figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
colours = ListedColormap(["#FFFFFF", "#CFE3F2", "#7fb8d6", "#1f78b4", "#08306b"])
norm = BoundaryNorm([-1, 1, 3, 5, 7, 9], 5)
shown = left.pcolormesh(frequencies, loads, chart, cmap=colours, norm=norm, shading="nearest")
figure.colorbar(shown, ax=left, label="stops per cycle", ticks=[0, 2, 4, 6, 8])
omegas = np.linspace(0.06, 0.5, 600)
left.plot(omegas, [onset(omega, 0.02) for omega in omegas], color="#D55E00", lw=1.2, label="closed form")
left.legend(loc="upper left", frameon=True)
left.set(xlabel=r"frequency $\Omega$", ylabel=r"load / friction $\alpha/\beta$", ylim=(1.0, 7.5))
orbit = motion(0.06, 0.02, 2.0)
t = np.linspace(0.0, orbit.system.period, 4000)
right.plot(t / orbit.system.period, bf.simulate(orbit.system, orbit.state, periods=1)(t)[:, 1], color="#0072B2", lw=1.0)
right.set(xlabel="time / period", ylabel="velocity / (friction / stiffness)", xlim=(0.0, 1.0))
right.set_title(r"six stops: $\Omega$ = 0.06, $\alpha/\beta$ = 2")
