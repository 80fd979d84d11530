r"""
Zhao and Lin 2015: the best friction damper
===========================================

*Level: further on. Time: 10 s.*

A friction damper that is pressed too lightly carries no force, one that is pressed too hard never slips: in between
lies a best normal load. L. Zhao and Z. Lin compared a damper that slips as a whole (macro-slip) with a strip of 15
blocks that slip one after another (micro-slip), on an oscillator of 1.07 kg and 10 kN/m under 100 N. The strip is a
little worse at its best, but far less sensitive to the load, which nobody knows exactly.

The peaks asserted here come from an exact half-period map that integrates no slider; the constants that the paper leaves
open are those of `bifurc.systems.friction_damped_oscillator`.
"""
import matplotlib.pyplot as plt
import numpy as np

import bifurc as bf

# peak of the response (m) over the normal load (N)
PEAKS = {"macro": {10: 1.726735, 50: 1.360811, 100: 1.165604, 150: 1.184304, 200: 1.292366, 300: 1.596741, 1100: 1.831392},
         "micro": {10: 1.727928, 50: 1.395364, 100: 1.282417, 150: 1.362148, 400: 1.477271, 1000: 1.827594, 1100: 1.831392}}
BEST = {"macro": (116.71, 1.155779), "micro": (95.3, 1.281491)}

# %%
# The response over the frequency under 100 N, by harmonic balance with contacts integrated between exact events; its
# peak is located, and then followed over the normal load. The least peak is an extremum of that curve.
figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.4), layout="constrained")
for damper, colour in (("macro", "#D55E00"), ("micro", "#0072B2")):
    system = bf.systems.friction_damped_oscillator(omega=94.0, normal_load=100.0, damper=damper)
    start = bf.find_orbit(system, method=bf.HarmonicBalance((1, 3, 5, 7)))
    response = bf.trace(start, "omega", bounds=(94.0, 100.0), peaks="max_0")
    peak = response.special_points.of("peak")[0]
    left.plot(response.column("omega"), response.column("max_0"), color=colour, label=damper)
    left.plot([peak.parameter], [peak.measures["max_0"]], "d", mfc="w", mec=colour, ms=5)
    curve = bf.trace_curve(peak, ("normal_load", "omega"), bounds={"normal_load": (10.0, 1100.0), "omega": (90.0, 104.0)})
    best = curve.special_points.of("extremum")[0]
    print(f"{damper}: best load {best.parameters['normal_load']:.2f} N, peak {best.measures['max_0']:.6f} m")
    assert abs(best.parameters["normal_load"] - BEST[damper][0]) < 0.05 and abs(best.measures["max_0"] - BEST[damper][1]) < 1e-6
    load, height = curve.column("normal_load"), curve.column("max_0")
    for end in (10, 1100):
        assert abs(height[np.argmin(np.abs(load - end))] - PEAKS[damper][end]) < 2e-6  # six digits are known
    right.plot(load, height, color=colour, label=f"{damper}, curve of peaks")
    right.plot(PEAKS[damper].keys(), PEAKS[damper].values(), "o", mfc="none", mec=colour, ms=4, label=f"{damper}, exact map")
    right.plot([best.parameters["normal_load"]], [best.measures["max_0"]], "*", color=colour, ms=9)
    for value, known in PEAKS[damper].items():  # between the points of the curve: to the eye
        assert abs(np.interp(value, *np.array(sorted(zip(load, height, strict=True))).T) - known) < 5e-3
left.set(xlabel="frequency (rad/s)", ylabel="amplitude (m)", xlim=(94.0, 100.0))
left.set_title("normal load 100 N")
right.set(xlabel="normal load (N)", ylabel="peak amplitude (m)", xlim=(0.0, 1100.0))
left.legend(title="slip")
right.legend(loc="lower right")
