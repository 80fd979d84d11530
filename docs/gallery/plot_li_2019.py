r"""
Li 2019: dry friction by Galerkin's method
==========================================

*Level: first steps. Time: 2 s.*

P. Li balanced 40 harmonics of an oscillator with dry friction by Broyden's method. The exact orbit is known in closed
form as long as the mass does not stick (Den Hartog with viscous damping): at load 1.6, friction 1, damping ratio 0.1,
resonance, its maximum is 1.62291754679770128, and it would begin to stick at the load 1.48820269035416898.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

system = bf.systems.dry_friction_oscillator(zeta=0.1, omega=1.0, amplitude=1.6, friction=1.0)
orbit = bf.find_orbit(system)
assert abs(orbit.maximum() - 1.62291754679770128) < 1e-12

# %%
# The onset of sticking is located on the branch over the load.
branch = bf.trace(orbit, "amplitude", bounds=(1.1, 1.8))
print(branch.special_points)
assert abs(branch.special_points.of("stick_onset")[0].parameter - 1.48820269035416898) < 1e-11

# %%
# Harmonic balance converges to it; the error of the velocity falls like the first power of the number of
# harmonics where the friction force jumps.
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
counts, errors = (5, 10, 20, 40), []
t = np.linspace(0.0, 2.0 * np.pi, 1200)
velocity = bf.simulate(system, orbit.state, periods=1)(t)[:, 1]
left.plot(t / (2.0 * np.pi), velocity, color="k", lw=2.0, label="exact orbit")
for harmonics, colour in zip(counts, ("#D55E00", "#E69F00", "#56B4E9", "#0072B2"), strict=True):
    balance = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=harmonics))
    assert balance.success
    parts = [balance.harmonic(k, 0) for k in range(1, harmonics + 1)]
    series = sum((1j * k * part * np.exp(1j * k * t)).real for k, part in enumerate(parts, start=1))
    errors.append(np.sqrt(np.mean((series - velocity)**2) / np.mean(velocity**2)))
    left.plot(t / (2.0 * np.pi), series, color=colour, lw=0.9, label=f"{harmonics} harmonics")
print(dict(zip(counts, errors, strict=True)))
# by an independent Galerkin solver with very many samples
assert np.allclose(errors, (5.50e-2, 3.21e-2, 1.57e-2, 7.74e-3), rtol=0.02)
left.set(xlabel="time / period", ylabel="velocity", xlim=(0.0, 1.0))
left.legend(loc="upper right")
right.loglog(counts, errors, "o-", color="#0072B2", mfc="w")
right.loglog(counts, errors[-1] * 40.0 / np.array(counts), "--", color="0.6", lw=0.8, label="first power")
right.set(xlabel="harmonics", ylabel="rms error of the velocity")
right.set_yticks((0.01, 0.02, 0.05), ("0.01", "0.02", "0.05"))
right.yaxis.set_minor_formatter(plt.NullFormatter())
right.set_xticks(counts, counts)
right.xaxis.set_minor_locator(plt.NullLocator())
right.legend()
