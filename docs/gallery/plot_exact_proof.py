r"""
Krawczyk 1969: motions that are proved
======================================

*Level: further on. Time: 2 s.*

A computed orbit is a number with an error. R. Krawczyk's operator, evaluated in ball arithmetic, turns it into a
theorem: in this box there is exactly one solution, no event was overlooked, and the multipliers lie in these discs. The
orbit with one impact a period has the closed form of Shaw and Holmes (1983), in which the force at the flip follows
from the impact speed

.. math:: v = \frac{(1 + r)\, e_{12}\, \omega^2 \sigma}{K + (1 + r^2 D)},

so that the theorem can be checked: evaluated in 60 digits, the closed form must lie inside what was proved.

Needs the extra ``certify`` (python-flint).
"""
import matplotlib.pyplot as plt
from flint import arb, ctx

import bifurc as bf

ctx.dps = 60
zeta, omega, r = arb(0.05), arb(2.5), arb(0.7)  # the binary numbers that the program computes with


def closed_forms():
    """Forces at the grazing of the free response and at the flip of the orbit with one impact a period; the stop is at 1."""
    t, wd = 2 * arb.pi() / omega, (1 - zeta**2).sqrt()
    decay, c, s = (-zeta * t).exp(), (wd * t).cos(), (wd * t).sin()
    e12, e22, trace, D = decay * s / wd, decay * (c - zeta * s / wd), 2 * decay * c, decay**2
    lam = (1 + r) * e12 / (trace - 1 - D)
    gam = 1 - (1 + r) * (e22 - D) / (trace - 1 - D)
    K = -r * trace + (1 + r) * e12 * (2 * zeta * gam - (1 - omega**2) * lam)
    v = (1 + r) * e12 * omega**2 / (K + 1 + r**2 * D)
    stiffness = ((1 - omega**2)**2 + (2 * zeta * omega)**2).sqrt()
    return stiffness, ((1 - lam * v)**2 + (gam * v / omega)**2).sqrt() * stiffness


grazing, flip = closed_forms()
system = bf.systems.impact_oscillator(zeta=0.05, omega=2.5, amplitude=13.5, gap=1.0, restitution=0.7)
orbit = bf.find_orbit(system)
proof = orbit.certify()
print(proof)
assert proof.proved and proof.stable and proof.radius < 1e-12

# %%
# The branch through the flip and the grazing at which the impacts begin: all rows are proved but one that lies on a
# special point, and the special points are, with enclosures of their forces.
branch = bf.trace(orbit, "amplitude", bounds=(4.0, 14.0))
proved = branch.certify()
print(proved)
assert proved.proved and not proved.undecided
for kind, closed, known in (("grazing", grazing, 5.25594901), ("period_doubling", flip, 12.69994292)):
    low, high = next(item.parameter for item in proved.points if item.kind == kind)
    print(f"{kind} in [{low:.15f}, {high:.15f}], closed form {closed.str(20, radius=False)}")
    assert arb(low) < closed < arb(high) and high - low < 1e-12 and abs(low - known) < 1e-8

# %%
# How far the computed orbits are from the true ones, in what box they are the only ones, and how far from the stop they
# stay.
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
branch.plot(left)
force, rows = proved.values[proved.proved_rows], [row for row in proved.rows if row.proved]
right.semilogy(force, [row.radius for row in rows], "o", color="#0072B2", ms=4, label="true orbit within")
right.semilogy(force, [row.unique_in for row in rows], "s", color="#D55E00", ms=4, label="only orbit within")
right.semilogy(force, [row.grazing_distance for row in rows], "v", color="#009E73", ms=4, label="stop not touched by")
for closed in (grazing, flip):
    right.axvline(float(closed), color="0.6", lw=0.8)
right.set(xlabel="forcing amplitude", ylabel="proved bound (scaled)", ylim=(1e-17, 1e2))
right.legend(loc="center left", bbox_to_anchor=(0.0, 0.4))
