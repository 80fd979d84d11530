"""Oscillator with a friction damper: frequency responses, and the largest amplitude against the normal load, macro and micro.

Zhao & Lin 2015, section 4, with the constants that the source leaves open fixed as in `systems.friction_damped_oscillator`.
Responses are branches of harmonic balance; peaks are those of exact orbits, each found from the one before.
"""
import sys
from typing import NamedTuple

import numpy as np

from bifurc import HarmonicBalance, find_orbit, systems, trace

from .common import Setting, parser, publish, table

LOADS = {Setting.SMALL: (100.0,), Setting.FULL: (10.0, 25.0, 50.0, 75.0, 95.3, 100.0, 116.71, 150.0, 200.0, 250.0, 300.0, 350.0,
                                                400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1006.0, 1008.0, 1100.0)}
DRAWN = (25.0, 100.0, 300.0, 1100.0)
HARMONICS = (1, 3, 5, 7, 9)
# specs, friction.md F: an exact half-period map that marches no slider
KNOWN = {10: (1.726735, 1.727928), 50: (1.360811, 1.395364), 100: (1.165604, 1.282417), 150: (1.184304, 1.362148),
         200: (1.292366, 1.377876), 300: (1.596741, 1.418471), 400: (1.831392, 1.477271), 600: (1.831392, 1.611970),
         1000: (1.831392, 1.827594), 1100: (1.831392, 1.831392)}


class Peak(NamedTuple):
    """Largest amplitude over frequency under one load."""

    damper: str
    load: float
    omega: float
    amplitude: float
    slips: int  # events a period


def symmetric(system):
    """Return the orbit on which sliders that never slip carry no force at rest; what a transient left in them is put off."""
    orbit = find_orbit(system)
    if orbit.closure == 1:
        state = orbit.state.copy()
        state[2:][np.ptp(orbit.sample(400)[1][:, 2:], axis=0) == 0.0] = 0.0
        orbit = find_orbit(system, guess=state)
    return orbit


def peak(damper: str, load: float, low: float = 96.3, high: float = 97.5) -> Peak:
    """Return the largest amplitude between two frequencies: golden section, then a parabola through the last three."""
    orbit = symmetric(systems.friction_damped_oscillator(damper=damper, normal_load=load, omega=0.5 * (low + high)))
    kept = {}

    def size(omega):
        nonlocal orbit
        found = find_orbit(orbit.system.with_parameters(omega=float(omega)), guess=orbit)
        if not found.success or found.closure == 1:
            found = symmetric(orbit.system.with_parameters(omega=float(omega)))
        orbit = found
        kept[omega] = found
        return found.maximum(0)

    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    fa, fb = size(a), size(b)
    while high - low > 2e-3:
        if fa > fb:
            high, b, fb = b, a, fa
            a = high - ratio * (high - low)
            fa = size(a)
        else:
            low, a, fa = a, b, fb
            b = low + ratio * (high - low)
            fb = size(b)
    middle = a if fa > fb else b
    h = 1e-3
    below, here, above = size(middle - h), size(middle), size(middle + h)
    middle += 0.5 * h * (below - above) / (below - 2.0 * here + above)
    return Peak(damper, load, middle, size(middle), len(kept[middle].events))


def peaks(setting: Setting) -> list[Peak]:
    """Return the peaks of both dampers under all loads."""
    return [peak(damper, load) for load in LOADS[setting] for damper in ("macro", "micro")]


def responses() -> dict:
    """Return branches over frequency by (damper, load)."""
    found = {}
    for damper in ("macro", "micro"):
        for load in DRAWN:
            system = systems.friction_damped_oscillator(damper=damper, normal_load=load, omega=94.0)
            orbit = find_orbit(system, method=HarmonicBalance(HARMONICS))
            found[damper, load] = trace(orbit, "omega", bounds=(94.0, 100.0))
    return found


def report(found: list[Peak]) -> str:
    """Return the table."""
    rows = []
    for macro, micro in zip(found[::2], found[1::2], strict=True):
        known = KNOWN.get(macro.load)
        off = [abs(p.amplitude / x - 1.0) for p, x in zip((macro, micro), known or (), strict=False)]
        worst = f"{max(off):.0e}" if off else "-"
        rows.append((f"{macro.load:g}", f"{macro.amplitude:.6f}", f"{macro.omega:.4f}", macro.slips, f"{micro.amplitude:.6f}",
                     f"{micro.omega:.4f}", micro.slips, worst))
    return table("largest amplitude over frequency, exact orbits",
                 ("load, N", "macro, m", "at rad/s", "events", "micro, m", "at rad/s", "events", "off the reference"), rows)


def picture(found: list[Peak], branches: dict):
    """Return the figure: responses of both dampers, and the peaks against the load."""
    from bifurc.plotting import style
    made, (left, middle, right) = style.figure(7.2, 3.2, columns=3)
    colours = dict(zip(DRAWN, (style.GREY, style.BLUE, style.GREEN, style.VERMILION), strict=True))
    lines = dict(zip(DRAWN, ("-.", "-", "--", ":"), strict=True))
    for (damper, load), branch in branches.items():
        ax = left if damper == "macro" else middle
        ax.plot(branch.column("omega"), branch.column("max_0"), color=colours[load], ls=lines[load], lw=1.2, label=f"{load:g} N")
    for ax, name in ((left, "macro-slip"), (middle, "micro-slip")):
        ax.set(xlabel="frequency, rad/s", xlim=(94.0, 100.0), ylim=(0.0, 2.0))
        ax.set_title(f"{name} damper", fontsize=8)
        style.legend(ax, loc="upper left", fontsize=6.5)
    left.set_ylabel("largest displacement, m")
    for damper, colour, marker in (("macro", style.VERMILION, "s"), ("micro", style.BLUE, "o")):
        mine = [p for p in found if p.damper == damper]
        right.plot([p.load for p in mine], [p.amplitude for p in mine], color=colour, marker=marker, ms=3, lw=1.0, label=damper)
    right.set(xlabel="normal load, N", ylabel="peak of the response, m", xlim=(0.0, 1150.0), ylim=(1.0, 2.0))
    right.set_title("peak against load", fontsize=8)
    style.legend(right, loc="lower right", fontsize=6.5)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    found = peaks(given.setting)
    publish(given, "friction_damper", report(found), lambda: picture(found, responses()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
