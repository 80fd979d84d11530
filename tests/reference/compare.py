"""Differences between an orbit of the package and a reference, in plain numbers."""
import numpy as np


def impacts(orbit):
    """Impacts of an orbit as rows (time in [0, period), speed), by time."""
    rows = [(event.time % orbit.period, event.speed) for event in orbit.events if event.kind == "impact"]
    return np.array(sorted(rows)).reshape(-1, 2)


def worst_impact(orbit, times, speeds):
    """Largest difference of impact times (to the period) and speeds (to their size, at least 1)."""
    got = impacts(orbit)
    if len(got) != len(times):
        raise AssertionError(f"{len(got)} impacts, the reference has {len(times)}")
    period, worst = orbit.period, 0.0
    want = [(float(t) % period, float(v)) for t, v in zip(times, speeds, strict=True)]
    for t, v in want:
        nearest = min(got, key=lambda row, t=t: abs((row[0] - t + period / 2) % period - period / 2))
        apart = abs((nearest[0] - t + period / 2) % period - period / 2)
        worst = max(worst, apart / period, abs(nearest[1] - v) / max(1.0, abs(v)))
    return worst


def worst_multiplier(orbit, multipliers):
    """Largest difference between the sets of multipliers, to the size of each, at least 1."""
    got, worst = list(orbit.multipliers), 0.0
    if len(got) != len(multipliers):
        raise AssertionError(f"{len(got)} multipliers, the reference has {len(multipliers)}")
    for want in (complex(m) for m in multipliers):
        nearest = min(got, key=lambda m, want=want: abs(m - want))
        got.remove(nearest)
        worst = max(worst, abs(nearest - want) / max(1.0, abs(want)))
    return worst
