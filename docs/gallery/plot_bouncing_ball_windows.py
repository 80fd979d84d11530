r"""
Pieranski 1985: windows of the ball on a vibrating table
========================================================

*Level: first steps. Time: 1 s.*

A ball that bounces on a table moving as :math:`a \cos \omega t` may bounce once in every n-th period of the table. P.
Pieranski saw such motions in an experiment, A. C. J. Luo and R. P. S. Han (1996) gave their exact conditions: the
flight over n periods takes off with :math:`V = \pi n g / \omega` and returns with :math:`-V`, so that the table must
move with :math:`V (1 - r)/(1 + r)` at the bounce. The motion is born in a fold and doubles its period in a flip at

.. math:: a_n = \frac{n \pi g}{\omega^2} \frac{1 - r}{1 + r}, \qquad
   b_n = \sqrt{a_n^2 + \Big(\frac{2 g (1 + r^2)}{(1 + r)^2 \omega^2}\Big)^2}.

The windows overlap: at one amplitude of the table several motions wait for the right start.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

omega, r, gravity = 1.0, 0.8, 1.0
T = 2.0 * np.pi / omega


def window(n):
    """Amplitudes of fold and flip of the motion with one bounce in n periods."""
    birth = n * np.pi * gravity / omega**2 * (1.0 - r) / (1.0 + r)
    return birth, np.hypot(birth, 2.0 * gravity * (1.0 + r**2) / ((1.0 + r)**2 * omega**2))


def bouncing(n, a):
    """The stable motion with one bounce in n periods, started before a bounce."""
    speed = np.pi * n * gravity / omega
    time = np.arcsin(-speed * (1.0 - r) / ((1.0 + r) * a * omega)) / omega % T  # of the bounce
    start = (a * np.cos(omega * time) + speed * time - 0.5 * gravity * time**2, -speed + gravity * time)
    system = bf.systems.bouncing_ball(omega=omega, amplitude=a, restitution=r, gravity=gravity)
    orbit = bf.find_orbit(system, guess=start, periods=n)
    assert orbit.success and orbit.stable and len(orbit.events) == 1 and orbit.periods == n
    return orbit


# %%
# Each motion is traced over the amplitude through its window; the doubled motion that is born at the flip as well.
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
colours = ("#0072B2", "#D55E00", "#009E73")
for n, colour in zip((1, 2, 3), colours, strict=True):
    birth, flip = window(n)
    branch = bf.trace(bouncing(n, 0.5 * (birth + flip)), "amplitude", bounds=(0.8 * birth, 1.08 * flip))
    fold, doubling = (branch.special_points.of(kind)[0] for kind in ("fold", "period_doubling"))
    print(f"n = {n}: born at {fold.parameter:.12f}, flip at {doubling.parameter:.12f}")
    assert abs(fold.parameter - birth) < 1e-10 and abs(doubling.parameter - flip) < 1e-10
    a, top, stable = (branch.column(name) for name in ("amplitude", "max_0", "stable"))
    left.plot(np.where(stable > 0, a, np.nan), top, color=colour)
    left.annotate(f"n = {n}", (a.max(), top.max()), (3, -3), textcoords="offset points", color=colour)
    left.plot(a, top, "--", color=colour, lw=0.8)
    for point, marker, face, word in ((fold, "o", "w", "born in a fold"), (doubling, "D", colour, "period doubling")):
        left.plot([point.parameter], [np.interp(point.s, branch.column("s"), top)], marker, mfc=face, mec="k", ms=4.5,
                  zorder=4, ls="none", label=word if n == 1 else None)
left.set(xlabel=r"amplitude of the table $a\,\omega^2/g$",
         ylabel=r"highest position $x\,\omega^2/g$", xlim=(0.2, 2.0), ylim=(0.0, 58.0))
left.legend(loc="upper left")

# %%
# At the amplitude 1.06 all three are stable.
a = 1.06
t = np.linspace(0.0, 3.0 * T, 1500)
for n, colour in zip((1, 2, 3), colours, strict=True):
    right.plot(t / T, bf.simulate(bouncing(n, a).system, bouncing(n, a).state, periods=3)(t)[:, 0], color=colour, lw=1.2)
right.fill_between(t / T, a * np.cos(omega * t), -1.6, color="0.75", lw=0)
right.set(xlabel="time / period of the table", ylabel=r"height $x\,\omega^2/g$", xlim=(0.0, 3.0), ylim=(-1.6, 50.0))
