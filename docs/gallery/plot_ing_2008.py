r"""
Ing, Pavlovskaia, Wiercigroch and Banerjee 2008: an elastic stop
================================================================

*Level: further on. Time: 2 s.*

J. Ing and colleagues built an oscillator that meets a stiff spring on one side, and compared it with the model

.. math:: \ddot x + 2 \zeta \dot x + x + \beta\, (x - e)_+ = a\, \omega^2 \sin \omega t, \qquad
   \zeta = 0.01,\ \beta = 29,\ e = 1.26,\ a = 0.7.

The free response touches the spring where :math:`a \omega^2 = e \sqrt{(1 - \omega^2)^2 + (2 \zeta \omega)^2}`. An
elastic contact has no square root: multipliers are continuous at the touch. But beyond it they change like the square
root of the distance times :math:`\sqrt\beta`, so fast that within a thousandth in the frequency the free motion has
lost its stability, and the experiment shows a narrow band of chaos.
"""
import os

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, root

import bifurc as bf
from bifurc.elements import BaseMotion, ElasticStop

QUICK = os.environ.get("QUICK") == "1"
zeta, beta, e, a = 0.01, 29.0, 1.26, 0.7


def free_amplitude(omega):
    return a * omega**2 / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)


# %%
# The branch of the motion of one period over the frequency, through the touch.
touch = brentq(lambda omega: free_amplitude(omega) - e, 0.7, 0.9, xtol=1e-15)
z = a * 0.75**2 / (1.0 - 0.75**2 + 2j * zeta * 0.75)
system = bf.System(1.0, 2.0 * zeta, 1.0, [BaseMotion(a), ElasticStop(e, beta)], omega=0.75)
branch = bf.trace(bf.find_orbit(system, guess=(z.real, -0.75 * z.imag)), "omega", bounds=(0.75, 1.1))
print(branch.special_points)
grazing, flips = branch.special_points.of("grazing")[0], branch.special_points.of("period_doubling")
assert abs(grazing.parameter - touch) < 1e-12 and len(flips) == 2


# %%
# The flips a second time, from exponentials of matrices: unknown are the times of contact and of separation, the speed
# of contact, and the frequency, at which the product of the two exponentials has the multiplier -1.
def conditions(unknowns):
    t1, t2, speed, omega = unknowns

    def flow(stiffness, t):
        return expm(np.array([[0.0, 1.0], [-stiffness, -2.0 * zeta]]) * t)

    def steady(stiffness, offset, t):
        part = a * omega**2 / (stiffness - omega**2 + 2j * zeta * omega) * np.exp(1j * omega * t)
        return np.array([part.real + offset, (1j * omega * part).real])

    inside, outside = flow(1.0 + beta, t2 - t1), flow(1.0, 2.0 * np.pi / omega - (t2 - t1))
    low, high = (lambda t: steady(1.0, 0.0, t)), (lambda t: steady(1.0 + beta, beta * e / (1.0 + beta), t))
    left = high(t2) + inside @ (np.array([e, speed]) - high(t1))
    back = low(t1) + outside @ (left - low(t2))
    M = outside @ inside
    return left[0] - e, back[0] - e, back[1] - speed, 1.0 + np.trace(M) + np.linalg.det(M)


for flip in flips:
    orbit = flip.problem.solution(flip.x)
    contact, separation = sorted(orbit.events, key=lambda event: str(event.kind))
    t2 = contact.time + (separation.time - contact.time) % orbit.period
    solved = root(conditions, (contact.time, t2, contact.speed, flip.parameter + 1e-6), tol=1e-14).x
    print(f"flip at {flip.parameter:.12f}, by exponentials {solved[3]:.12f}, {flip.parameter - touch:.6f} after the touch")
    assert abs(flip.parameter - solved[3]) < 1e-9
assert 0.0 < flips[0].parameter - touch < 2e-4

# %%
# Between the flips the motion of one period is unstable. Near the touch the simulated attractor is a narrow band.
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
branch.plot(left, measure="max_0", names={"omega": r"frequency $\omega$", "max_0": "largest displacement"})
left.axhline(e, color="0.6", lw=0.8, zorder=0)
values = np.linspace(touch - 2e-3, touch + 8e-3, 30 if QUICK else 160)
z = a * values[0]**2 / (1.0 - values[0]**2 + 2j * zeta * values[0])
state = np.array([z.real, -values[0] * z.imag])  # the free motion
for omega in values:
    motion = bf.simulate(system.with_parameters(omega=omega), state, periods=160)
    state = motion.final
    strobe = motion.sections[100:, 0]
    right.plot(np.full(strobe.size, omega), strobe, ".", color="k", ms=1.4, mew=0.0)
right.axvline(touch, color="#009E73", lw=0.8, zorder=0)
right.text(touch, 1.42, " touch", color="#009E73")
right.set(xlabel=r"frequency $\omega$", ylabel="displacement once a period", xlim=(values[0], values[-1]), ylim=(0.3, 1.5))
right.set_xticks(np.round(np.linspace(0.802, 0.808, 4), 3))
