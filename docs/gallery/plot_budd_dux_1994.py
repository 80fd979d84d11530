r"""
Budd and Dux 1994: chattering that completes
============================================

*Level: first steps. Time: 2 s.*

A mass that is pressed onto its stop bounces infinitely often in a finite time, with speeds that fall like powers of the
restitution, and then rests on the stop until the load lifts it off (C. J. Budd and F. Dux). bifurc closes the sequence
in one event: none of the infinitely many impacts has to be computed, and the instant at which it ends is exact.

The instants below were computed in 40-digit arithmetic, impact by impact.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

# restitution -> instant at which the mass comes to rest, for zeta 0.05, omega 0.2, load 1, stop at 0 (release 39.2699... a
# period on)
RESTS = {0.1: 24.14384814993352084974, 0.5: 25.40245910967655730046, 0.7: 26.51826799048526977498, 0.9: 30.10683026302001873233}
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
colours = ("#0072B2", "#009E73", "#E69F00", "#D55E00")
for (restitution, rest), colour in zip(RESTS.items(), colours, strict=True):
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.2, amplitude=1.0, gap=0.0, restitution=restitution)
    orbit = bf.find_orbit(system)
    chatter = [event for event in orbit.events if "chatter" in str(event.kind)]
    assert orbit.success and len(chatter) == 1
    period = 2.0 * np.pi / 0.2
    apart = (chatter[0].end - rest + 0.5 * period) % period - 0.5 * period
    print(f"r = {restitution}: comes to rest at {chatter[0].end:.12f}, {abs(apart):.1e} from the reference")
    assert abs(apart) < 1e-10
    motion = bf.simulate(system, orbit.state, periods=1)
    for ax, t in ((left, np.linspace(0.0, period, 2000)), (right, np.linspace(23.2, period, 4000))):
        ax.plot(t, motion(t)[:, 0], lw=1.0, color=colour, label=f"r = {restitution}")
    right.plot([rest], [0.0], "*", ms=8, mfc=colour, mec="k", mew=0.6, clip_on=False, zorder=5)

# %%
# One period, and its last quarter: the stars are the instants from which the mass rests on the stop.
left.set(xlabel="time", ylabel="displacement / static deflection", ylim=(-1.3, 0.1), xlim=(0.0, period))
left.legend(ncols=2, loc="lower left")
right.set(xlabel="time", ylabel="displacement / static deflection", ylim=(-0.055, 0.005), xlim=(23.2, period))
