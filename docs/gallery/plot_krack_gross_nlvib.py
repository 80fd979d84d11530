r"""
Krack and Gross: examples of NLvib
==================================

*Level: first steps. Time: 4 s.*

M. Krack and J. Gross publish NLvib, harmonic balance in MATLAB, beside their book (Harmonic Balance for Nonlinear
Vibration Problems, 2019). Three of its examples, with the numbers of an independent solver whose residual is below
:math:`10^{-11}`: Duffing's oscillator, two masses with cubic springs, and two masses of which one meets a stiff
one-sided spring. The last one is where harmonic balance converges slowly; the true motion is found by shooting through
the contacts.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce


def duffing(omega):
    return bf.System(1.0, 0.05, 1.0, [CubicSpring(0.1), HarmonicForce(0.18)], omega=omega)


def two_cubic(omega):
    return bf.System(np.diag([1.0, 0.05]), [[0.015, -0.013], [-0.013, 0.013]], [[1.0453, -0.0453], [-0.0453, 0.0453]], [
        CubicSpring(1.0, row=(1.0, 0.0)), CubicSpring(0.0042, row=(1.0, -1.0)), HarmonicForce(0.11)], omega=omega)


def one_sided(omega):
    return bf.System(np.eye(2), [[0.03, -0.03], [-0.03, 0.06]], [[1.0, -1.0], [-1.0, 2.0]], [
        ElasticStop(1.0, 100.0, row=(1.0, 0.0)), HarmonicForce(0.1, dof=1)], omega=omega)


# %%
# Peaks of the first harmonic with seven harmonics, refined.
figure, axes = plt.subplots(1, 3, figsize=(7.4, 3.0), layout="constrained")
for ax, make, bounds, amplitude, place in ((axes[0], duffing, (0.5, 1.6), 2.83019805945, 1.26871673621),
                                           (axes[1], two_cubic, (0.8, 1.4), 0.59180173339, 1.02699902753)):
    branch = bf.trace(bf.find_orbit(make(bounds[0]), method=bf.HarmonicBalance(7)), "omega", bounds=bounds, peaks="h1_0")
    peak = max(branch.special_points.of("peak"), key=lambda point: point.measures["h1_0"])
    print(f"{make.__name__}: peak {peak.measures['h1_0']:.11f} at {peak.parameter:.8f}")
    assert abs(peak.measures["h1_0"] / amplitude - 1.0) < 1e-10 and abs(peak.parameter - place) < 1e-6
    branch.plot(ax, measure="h1_0", names={"omega": "frequency", "h1_0": "first harmonic"})
    ax.set_ylim(0.0, 1.35 * amplitude)
    ax.set_title({"duffing": "Duffing", "two_cubic": "two masses, cubic"}[make.__name__])

# %%
# The one-sided spring at two frequencies: 21 harmonics, 1024 samples of the contact.
for omega, amplitude in ((0.78, 0.0861030032), (0.62, 0.6677689527)):
    orbit = bf.find_orbit(one_sided(omega), method=bf.HarmonicBalance(21, aft="sampled", samples=1024))
    print(f"one-sided spring at {omega}: first harmonic of the second mass {abs(orbit.harmonic(1, 1)):.10f}")
    assert abs(abs(orbit.harmonic(1, 1)) / amplitude - 1.0) < 1e-9

# %%
# The true motion at 0.62, and how harmonic balance approaches it.
true = bf.find_orbit(one_sided(0.62), guess=orbit)
assert true.success
counts, errors = (5, 10, 20, 40, 80), []
for count in counts:
    balance = bf.find_orbit(one_sided(0.62), guess=true, method=bf.HarmonicBalance(count))
    assert balance.success
    errors.append(abs(balance.harmonic(1, 1) - true.harmonic(1, 1)))
assert errors[-1] < 1e-4 * errors[0]
axes[2].loglog(counts, errors, "o-", color="#0072B2", mfc="w", ms=5)
axes[2].set_xticks(counts, counts)
axes[2].xaxis.set_minor_locator(plt.NullLocator())
axes[2].set(xlabel="harmonics", ylabel="error of the first harmonic", title="one-sided spring, 0.62")
