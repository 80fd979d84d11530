"""What a sweep over a parameter finds, how far its fractions are right, and what it costs.

Two hundred values of the excitation frequency, with the three-period motion born and dying, period doublings and chaos.  At
ten values an independent search from 4000 random starts, by nothing but the map itself, says which attractors there are,
and a map of 200 x 200 starts how large their basins are.  The last lines use the measured constants for a plan.
"""
import sys
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from studies.common import Setting, machine, parser, table

SYSTEM = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
REGION = {"q0": (-2.5, 0.0), "v0": (-3.0, 3.0)}
WINDOW = 2.45, 2.75
POINTS = {Setting.SMALL: 12, Setting.FULL: 200}
SAMPLES = {Setting.SMALL: 500, Setting.FULL: 4000}
AUDITS = {Setting.SMALL: 2, Setting.FULL: 10}
RANDOM = {Setting.SMALL: 300, Setting.FULL: 4000}
CELLS = {Setting.SMALL: 30, Setting.FULL: 200}
LONG, KEEP = 3000, 160  # forcing periods before an end counts, and looked at
PATIENCE = 30000  # further ones for motions that did not repeat: transients of several thousand periods occur after crises
TOLERANCE = 1e-5


def audit(system, starts: np.ndarray, scale: np.ndarray):
    """Return section points (KEEP, ns) of one motion of each attractor that random starts find, and their shares."""
    from bifurc.basins.sweeps.sections import groups, period_of, settled
    from bifurc.ensemble.period_map import MAPPED, PeriodMap
    points, outcomes, _ = settled(PeriodMap(system), starts, LONG, KEEP)
    good = np.flatnonzero(outcomes == MAPPED)
    periods = np.array([period_of(points[i], scale, TOLERANCE) for i in good])
    slow = np.flatnonzero(periods == 0)
    if slow.size:  # a transient, or chaos
        points[good[slow]] = settled(PeriodMap(system), points[good[slow], -1], PATIENCE, KEEP)[0]
        periods[slow] = [period_of(points[i], scale, TOLERANCE) for i in good[slow]]
    number = groups(points[good], periods, scale, TOLERANCE)
    firsts = [good[np.flatnonzero(number == k)[0]] for k in range(number.max() + 1)]
    return [(points[i], int(periods[np.flatnonzero(good == i)[0]])) for i in firsts], np.bincount(number) / len(good)


def found_in(row: np.ndarray, period: int, attractors, scale: np.ndarray) -> list[int]:
    """Return which attractors of the sweep a motion of the audit lies on."""
    from bifurc.basins.attractors.attractors import section_points
    found = []
    for k, item in enumerate(attractors):
        points = section_points(item) / scale
        away = np.sqrt(((row[-8:, None, :] / scale - points[None]) ** 2).sum(axis=2)).min(axis=1).max()
        chaotic = hasattr(item, "points")
        if (item.periods == period and away < 1e-4) or (chaotic and period == 0 and away < 0.02):
            found.append(k)
    return found


def study(setting: Setting) -> dict:
    """Return what was measured."""
    import bifurc as bf
    from bifurc.basins.attractors.attractors import same
    from bifurc.compose.scene import scene_of
    from bifurc.ensemble.region import Region
    system = bf.systems.impact_oscillator(**SYSTEM)
    bf.sweep(system, "omega", [2.59, 2.6], REGION, samples=50)  # compiled
    values = np.linspace(*WINDOW, POINTS[setting])
    wall, cpu = time.perf_counter(), time.process_time()
    found = bf.sweep(system, "omega", values, REGION, samples=SAMPLES[setting])
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    rng = np.random.default_rng(1)
    seen = missed = 0
    worst_random = worst_grid = 0.0
    for i in np.linspace(0, len(values) - 1, AUDITS[setting]).astype(int).tolist():
        there = system.with_parameters(omega=float(values[i]))
        scale = Region(REGION).sizes(scene_of(there))
        starts = rng.uniform([REGION["q0"][0], REGION["v0"][0]], [REGION["q0"][1], REGION["v0"][1]], (RANDOM[setting], 2))
        rows, shares = audit(there, starts, scale)
        own = found.fractions[i]
        for (row, period), share in zip(rows, shares, strict=True):
            mine = found_in(row, period, found.attractors[i], scale)
            seen += 1
            if not mine:
                missed += 1
                print(f"missed at {values[i]:.6g}: period {period}, share {share:.4f}")
            else:
                total = sum(own[found.numbers[i][k]] for k in mine)
                worst_random = max(worst_random, abs(total - share))
        fine = bf.basins_of_attraction(there, bf.Grid(q0=(*REGION["q0"], CELLS[setting]), v0=(*REGION["v0"], CELLS[setting])),
                                       attractors=[item for item in found.attractors[i] if not hasattr(item, "points")])
        for k, item in enumerate(fine.attractors):
            if not hasattr(item, "points"):
                share = sum(own[number] for number, other in zip(found.numbers[i], found.attractors[i], strict=True)
                            if same(other, item, scale))
                worst_grid = max(worst_grid, abs(share - fine.fractions[k]))
    return {"found": found, "wall s": wall, "CPU s": cpu, "attractors of the audits": seen, "missed by the sweep": missed,
            "largest difference of a share: random starts": worst_random, "of a share: fine map": worst_grid}


def shared_out(setting: Setting) -> list:
    """Return (who computes, s, times one worker) of the sweep by one worker, two threads and two processes, the better of two runs
    each; raises where a bit of the results differs."""
    import bifurc as bf
    system, values = bf.systems.impact_oscillator(**SYSTEM), np.linspace(*WINDOW, POINTS[setting])
    best = {"one worker": np.inf, "two threads": np.inf, "two processes": np.inf}
    first = None
    with ProcessPoolExecutor(2) as pool:
        ways = dict(zip(best, ({"workers": 1}, {"workers": 2}, {"executor": pool}), strict=True))
        bf.sweep(system, "omega", values[:2], REGION, samples=50, executor=pool)  # both have imported and compiled
        for name, how in [*ways.items()] * 2:
            clock = time.perf_counter()
            found = bf.sweep(system, "omega", values, REGION, samples=SAMPLES[setting], **how)
            best[name] = min(best[name], time.perf_counter() - clock)
            first = found if first is None else first
            if any(not np.array_equal(a, b) for a, b in zip(found.fractions, first.fractions, strict=True)):
                raise AssertionError(f"{name} gives other fractions than one worker")
    return [[name, seconds, best["one worker"] / seconds] for name, seconds in best.items()]


def main(arguments=None) -> dict:
    """Print the table, and draw the sweep beside its branches."""
    chosen = parser(__doc__).parse_args(arguments)
    import bifurc as bf
    from bifurc.cli.sweeps import traced
    from bifurc.plotting.style import figure, save_figure
    seen = study(chosen.setting)
    found = seen.pop("found")
    points, samples = len(found.values), int(found.starts.max())
    asked = {"missed by the sweep": "0", "of a share: fine map": "0.01"}
    rows = [[name, asked.get(name), value] for name, value in seen.items()]
    each = seen["CPU s"] / points
    rows += [["CPU s a value", None, each], ["CPU us a start", None, 1e6 * each / samples]]
    text = table(f"sweep over omega: {points} values, {samples} starts each, {len(found.tracks)} tracks",
                 ["what", "asked", "measured"], rows)
    text += "\n\n" + table("the same sweep shared out", ["who computes", "s", "times one worker"], shared_out(chosen.setting))
    million = 1e6 * each
    chunk = 60.0 / each
    text += (f"\n\nplan for 1000 x 1000 parameters at this cost: {million / 3600:.1f} core hours, {million / 3600 / 256:.2f} h on "
             f"256 cores; chunks of {chunk:.0f} values take a minute each: {1e6 / chunk:.0f} files, "
             f"{1e6 / chunk / (million / 256):.2f} written a second by one driver (it can do 100).\nexecutor: "
             "dask.distributed.Client(SLURMCluster(...)); the chunk folder on a disk that the driver sees, workers need none.")
    text += f"\n\n{found.report()}\n\n{machine()}\n"
    sys.stdout.write(text)
    chosen.output.mkdir(parents=True, exist_ok=True)
    (chosen.output / "sweep_cost.txt").write_text(text, encoding="utf-8")
    made, axes = figure(6.3, 5.8, rows=2, sharex=True)
    bf.plotting.plot_sweep(found, axes, traced(found, WINDOW, True))
    save_figure(made, chosen.output / "sweep_cost.png")
    return seen


if __name__ == "__main__":
    main()
