r"""
Yang, Chu and Menq 1998: friction under a normal load that varies
=================================================================

*Level: first steps. Time: 1 s.*

Where two parts of a machine rub, their normal motion changes the load on the contact: it may slip early, stick late, or
part. B. D. Yang, M. L. Chu and C. H. Menq (1998) described the contact as a spring with a slider and gave the
conditions of each transition. A contact that slips forward sticks again not when its velocity is zero but when the
*slider* stops,

.. math:: \dot u = \mu \dot n / k,

and one that parts meets again stuck or slipping at once. L. Zhao and Z. Lin (2015) took three cases from it. The work
of each cycle below was found by integrating the contact with 200 000 steps a period.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf
from bifurc.plotting.motions.loops import plot_loop, plot_states

WORK = {1: (40.529433022, 0.0), 2: (31.579636645, 5.192307692), 3: (53.142857143, 157.418896819)}  # N m, in x and in y
TURNS = {1: (0.4858075299, 1.7359450042, 3.2971028287, 4.5472403030),
         2: (1.9655874465, 2.0839277102, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0, 4.3175978607, 6.0151026032)}

loops = {case: bf.hysteresis(bf.systems.macro_slip_contact(case=case)) for case in WORK}
for case, found in loops.items():
    for label, work in zip("xy", WORK[case], strict=True):
        print(f"case {case}, {label}: work {found[label].work:.9f}, steady after {found[label].periods - 1} cycles")
        assert found[label].success and abs(found[label].work - work) < 1e-9
    for event, angle in zip(found["x"].events, TURNS.get(case, ()), strict=case in TURNS):
        assert abs(event.angle - angle) < 1e-10

# %%
# Case 2 has all states: the contact is apart for a third of the cycle and slips back as soon as it closes.
assert [event.after for event in loops[2]["x"].events] == ["stick", "slip-", "apart", "slip-", "stick", "slip+"]

# %%
# The slider of case 1 stops where the closed form says: u = 3 sin t, n = 10 (2 + 0.5 cos t), k = 5, mu = 0.5.
stop = loops[1]["x"].events[1].angle
assert abs(3.0 * np.cos(stop) + 0.5 * 5.0 * np.sin(stop) / 5.0) < 1e-12

figure, axes = plt.subplots(2, 2, figsize=(7.0, 5.4), layout="constrained")
for ax, (case, label) in zip(axes.flat, ((1, "x"), (2, "x"), (3, "y")), strict=False):
    plot_loop(loops[case][label], ax)
    ax.set(title=f"case {case}, {label}: {loops[case][label].work:.2f} N m a cycle", xlabel="displacement (m)", ylabel="force (N)")
plot_states(loops[2]["x"], axes[1, 1])
axes[1, 1].set(title="case 2, x, over a cycle", ylabel="force (N)")
for k, place in ((1, "outside lower left"), (3, "outside lower right")):
    shown = dict(zip(*axes.flat[k].get_legend_handles_labels()[::-1], strict=True))  # one entry a word
    figure.legend(shown.values(), shown.keys(), loc=place, ncols=2 if k == 1 else 3)
