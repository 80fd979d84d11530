r"""
Karagiannis and Pfeiffer 1991: gear rattle
==========================================

*Level: first steps. Time: 2 s.*

A loose gear wheel is thrown to and fro in its backlash by a wheel that does not turn evenly: it rattles. K. Karagiannis
and F. Pfeiffer computed such motions with rigid impacts between the teeth and oil drag in between. With the play
:math:`\pm c`, the driving flanks moving as :math:`A \cos \omega t`, and drag d per inertia, the motion with one impact
on each flank a period is known in closed form. It takes off with :math:`u = 2 (c + A \cos \varphi) / p`, where :math:`q
= e^{-d \pi/\omega}`, :math:`p = (1 - q)/d` and :math:`\varphi` is the phase of the impact, and the impact law asks for

.. math:: A (\sin \varphi - s \cos \varphi) = s\, c, \qquad s = \frac{2 (1 - r q)}{(1 + r)\, p\, \omega}.

So rattle of this kind begins, in a fold, at :math:`A_0 = s c / \sqrt{1 + s^2}`. Both flanks sound alike until the
symmetry breaks in a pitchfork, where the map from flank to flank has the multiplier -1.
"""
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import bifurc as bf
from bifurc.elements import RigidStop
from bifurc.system import builder

c, omega, r, d = 1.0, 1.0, 0.6, 0.1
q = np.exp(-d * np.pi / omega)
p = (1.0 - q) / d
s = 2.0 * (1.0 - r * q) / ((1.0 + r) * p * omega)
birth = s * c / np.hypot(1.0, s)


def amplitude(phase):
    """Amplitude at which the impacts have this phase."""
    return s * c / (np.sin(phase) - s * np.cos(phase))


def multiplier_is_minus_one(phase):
    """1 + trace + determinant of the map from flank to flank, in phase and speed of take-off."""
    A = amplitude(phase)
    u = 2.0 * (c + A * np.cos(phase)) / p
    slope, bend, rate = -A * np.sin(phase), -A * omega * np.cos(phase), u * q / omega
    turn = -(slope + rate) / (slope - rate)
    rise = r * q - (r * d * rate + (1.0 + r) * bend) * p / (slope - rate)
    return 1.0 + turn + rise + r**2 * q


# the fold lies where sin - s cos is largest; the stable motion has the smaller phase
fold_phase = np.pi - np.arctan(1.0 / s)
breaking = amplitude(brentq(multiplier_is_minus_one, np.arctan(s) + 1e-3, fold_phase - 1e-3, xtol=1e-15))


# %%
# The loose wheel is a mass without a spring between two moving flanks. As a builder, it has the amplitude of the flanks
# as one parameter.
@builder
def gear_pair(*, amplitude: float = 1.0) -> bf.System:
    flanks = [RigidStop(c, r, side=side, amplitude=amplitude, harmonic=1) for side in (1, -1)]
    return bf.System(1.0, d, 0.0, flanks, omega=omega)


phase = brentq(lambda angle: amplitude(angle) - 0.5 * (birth + breaking), np.arctan(s) + 1e-3, fold_phase, xtol=1e-15)
A = amplitude(phase)
x, u = c + A * np.cos(phase), 2.0 * (c + A * np.cos(phase)) / p  # where and how fast it takes off from a flank
rest = (np.pi - phase) / omega  # from the impact on the left flank to the end of the period
orbit = bf.find_orbit(gear_pair(amplitude=A), guess=(-x + u * (1.0 - np.exp(-d * rest)) / d, u * np.exp(-d * rest)))
assert orbit.success and orbit.stable and orbit.closure == -1  # the half-period symmetry
assert abs(orbit.events[0].speed - u * (1.0 + q) / (1.0 + r)) < 1e-11

# %%
# The branch begins in the fold. Beyond the pitchfork a pair of motions knocks harder on one flank than on the other.
branch = bf.trace(orbit, "amplitude", bounds=(0.8 * birth, 1.2))
fold, pitchfork = branch.special_points.of("fold")[0], branch.special_points.of("branch_point")[0]
print(branch.special_points)
assert abs(fold.parameter - birth) < 1e-11 and abs(pitchfork.parameter - breaking) < 1e-11
pair = [bf.trace(start, "amplitude", bounds=(breaking - 0.1, 1.04)) for start in bf.switch_branch(pitchfork)]
assert len(pair) == 2

figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
t = np.linspace(0.0, 4.0 * np.pi / omega, 1200)
flank = A * np.cos(omega * t)
left.plot(omega * t / (2.0 * np.pi), bf.simulate(orbit.system, orbit.state, periods=2)(t)[:, 0], lw=1.4, color="#0072B2")
for low, high in ((c + flank, 1.9 + 0.0 * t), (-1.9 + 0.0 * t, flank - c)):
    left.fill_between(omega * t / (2.0 * np.pi), low, high, color="0.8", lw=0)
left.set(xlabel="time / period", ylabel="position of the loose wheel / play $c$", xlim=(0.0, 2.0), ylim=(-1.9, 1.9))
for line in (branch, *pair):
    line.plot(right, measure="max_0", names={"amplitude": "amplitude of the flanks / play $A/c$",
                                             "max_0": "largest excursion / play"})
right.set_ylim(-0.1, 2.9)
