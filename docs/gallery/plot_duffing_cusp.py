r"""
Duffing's cusp
==============

*Level: further on. Time: 3 s.*

The two folds of the resonance of :math:`\ddot x + 0.1 \dot x + x + x^3 = F \cos \omega t` meet, at small load, in a
cusp: below it the response is single-valued. With all harmonics it lies at :math:`\omega = 1.09010950261775`, :math:`F
= 0.0513635020789036` (13 odd harmonics, 64 digits); with one harmonic at 1.0903455, 0.0515845.
"""
import matplotlib.pyplot as plt

import bifurc as bf

system = bf.systems.duffing_oscillator(zeta=0.05, omega=0.5, amplitude=0.3, alpha=1.0, beta=1.0)
branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.5))
folds = sorted(p.parameter for p in branch.special_points.of("fold"))
assert abs(folds[0] - 1.3242362007705655567) < 1e-11 and abs(folds[1] - 1.7797195242985731142) < 1e-11

# %%
# The fold is followed in frequency and load through the cusp.
bounds = {"omega": (0.9, 2.5), "amplitude": (0.02, 0.4)}
curve = bf.trace_curve(branch.special_points.of("fold")[0], ("omega", "amplitude"), bounds=bounds)
cusp = curve.special_points.of("cusp")[0]
print(cusp)
assert abs(cusp.parameters["omega"] - 1.0901095026177565469) < 1e-9
assert abs(cusp.parameters["amplitude"] - 0.0513635020789035622) < 1e-10

figure, axes = plt.subplots(1, 2, figsize=(6.6, 3.4), layout="constrained")
branch.plot(axes[0])
curve.plot(axes[1])
