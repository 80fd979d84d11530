"""Throughput of the kernels of basin maps: starts x forcing periods a CPU-second on one core, and their accuracy.

x'' + .04 x' + x = cos(2.6 t), x <= 0, restitution .8 (a motion of period one and one of period three coexist), starts
at the cell centres of a grid over (-2.5, 0) x (-3, 3), sticking and complete chatterings included. Accuracy:
states after one and ten periods of random cells against 34-digit arithmetic. Smooth field: x'' + .15 x' - x + x^3 =
.3 cos t by 100 classical Runge-Kutta steps a period, and by the method of order 8 that basin maps take, each with its
error. Scenes of several modes (elastic stops, dry friction) run in batches through all modes, and once more by the scalar
integrator alone, from starts over (-2, 2.0371) x (-2, 1.9413); chains of two and three masses
from random starts. A measure of what the machine can do may be run beside: ``--limit SCRIPT`` names a program that prints one
JSON object with ``impact_f64`` and ``duffing_f64`` in 1e6 starts x periods a CPU-second of hand-written vectorised C; it runs in
turn with the kernels, and ratios are those of medians.
"""
import json
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit
from bifurc.basins import PeriodMap
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.ensemble.batch import packing, smooth
from bifurc.ensemble.initial_conditions import begin
from bifurc.flow.scan import DONE, MODE, STATE, TAU, run, workspace

from .common import Setting, parser, publish, table
from .one_degree import pack, period, scratch
from .reference import Oscillator

NUMBERS = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
BOX = ((-2.5, 0.0), (-3.0, 3.0))
CELLS, PERIODS = 160, 20
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 9}
CHECKED = {Setting.SMALL: (40, 6), Setting.FULL: (1500, 100)}  # cells after one and after ten periods
BOXED = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none"}
LEAST = 0.6  # of vectorised C is asked for with stops, LEAST_SMOOTH under smooth laws
LEAST_SMOOTH = 0.7
DUFFING = {"zeta": 0.075, "omega": 1.0, "amplitude": 0.3, "alpha": -1.0, "beta": 1.0}
DUFFING_BOX = ((-2.2, 2.2), (-2.2, 2.2))
IMPACTS, SMOOTH = "impact_f64", "duffing_f64"  # entries of the peer program
MODES_BOX = ((-2.0, 2.0371), (-2.0, 1.9413))  # no centre has a load that is the limit of friction to the last digit
TURNS = {Setting.SMALL: 1, Setting.FULL: 3}  # of the peer program


def scenes_of_modes() -> dict[str, bf.System]:
    """Return the scenes of several modes by name."""
    force, e = bf.elements.HarmonicForce(1.0), bf.elements
    return {"elastic stop": bf.systems.bilinear_oscillator(omega=1.29),
            "two elastic stops": bf.System(1.0, 0.1, 1.0, [force, e.ElasticStop(0.5, 4.0, damping=0.05),
                                                           e.ElasticStop(0.6, 9.0, side=-1)], omega=1.1),
            "dry friction": bf.System(1.0, 0.04, 1.0, [force, e.Coulomb(0.3)], omega=0.8),
            "friction and elastic stop": bf.System(1.0, 0.04, 1.0, [force, e.Coulomb(0.2), e.ElasticStop(0.5, 6.0)], omega=1.3),
            "two masses, stop": chain(2, e.RigidStop(0.6, 0.7, dof=1)),
            "two masses, stop and friction": chain(2, e.RigidStop(0.6, 0.7), e.Coulomb(0.15, dof=1)),
            "three masses, stop": chain(3, e.RigidStop(0.8, 0.7, dof=2))}


def scenes_of_laws() -> dict[str, bf.System]:
    """Return the scenes of laws beside stops and dry friction by name."""
    force, e = bf.elements.HarmonicForce(1.0), bf.elements
    belt = e.Stribeck(kinetic=0.5, static=1.0, speed=0.4, belt_speed=0.3)
    return {"stop beside a cubic spring": bf.System(1.0, 0.1, 1.0, [force, e.CubicSpring(0.5), e.RigidStop(0.6, 0.7)], omega=1.2),
            "Stribeck friction": bf.System(1.0, 0.05, 1.0, [e.HarmonicForce(0.3), belt], omega=2.0),
            "two masses, cubic springs": chain(2, e.CubicSpring(0.5), e.CubicSpring(0.5, row=(-1.0, 1.0))),
            "two masses, cubic coupling and stop": chain(2, e.CubicSpring(0.5, row=(-1.0, 1.0)), e.RigidStop(0.6, 0.7)),
            "two masses, Stribeck friction": chain(2, e.Stribeck(kinetic=0.2, static=0.3, speed=0.4, dof=1))}


def chain(n: int, *elements) -> bf.System:
    """Return a chain of unit masses and springs, fixed at its first mass, which is forced."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return bf.System(np.eye(n), 0.05 * K + 0.02 * np.eye(n), K, [bf.elements.HarmonicForce(1.0, dof=0), *elements], omega=1.3)


def starts_of(system: bf.System, cells: int) -> np.ndarray:
    """Return as many starts as a grid has: its centres for one mass, random ones within the stops for several."""
    if system.n == 1:
        return grid(cells, MODES_BOX)
    X = np.random.default_rng(3).uniform(-1.0, 1.0, (cells**2, 2 * system.n))
    X[:, :system.n] *= 0.55
    return X


@njit
def lean(P, I, length, modes, X, periods, limit):
    """March the starts ``X`` (N, 2) in place over forcing periods by the period kernel; return those set aside."""
    work = scratch()
    counts = np.zeros(2, np.int64)
    aside = 0
    for i in range(X.shape[0]):
        m = modes[i]
        y = X[i]
        for _ in range(periods):
            code, m = period(P, I, length, m, y, work, counts, limit)
            if code != DONE:
                aside += 1
                y[:] = np.nan
                break
    return aside


@njit
def general(T, modes, X, periods, limit):
    """March the starts ``X`` (N, ns) in place over forcing periods by the general march; return those set aside."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    ints, floats = workspace(T)
    rows, record = np.zeros((0, 5), np.int64), np.zeros((0, STATE + 2 * ns))
    x = np.empty(nx)
    aside = 0
    for i in range(X.shape[0]):
        x[:ns] = X[i]
        for c in range(ns, nx):
            x[c] = 1.0 if c == ns or (c - ns) % 2 == 1 else 0.0
        ints[:] = 0
        floats[:] = np.nan
        ints[MODE], floats[TAU] = modes[i], 0.0
        code = DONE
        for k in range(1, periods + 1):
            code = run(T, ints, floats, x, k, 0.0, limit, rows, record)
            if code != DONE:
                aside += 1
                break
        for c in range(ns):
            X[i, c] = x[c] if code == DONE else np.nan
    return aside


def side_by_side(module, numbers, X: np.ndarray, periods: int, modes: np.ndarray | None = None) -> int:
    """Carry the starts ``X`` (N, ns) in place in a batch; return those left to the caller."""
    codes = np.full(len(X), 6)
    modes = np.zeros(len(X), np.int64) if modes is None else modes
    module.propagate(numbers, modes, X, 2000, periods, codes, np.zeros(len(X), np.int64), np.full(len(X), np.inf))
    return int(np.count_nonzero(codes))


def grid(cells: int = CELLS, box=BOX) -> np.ndarray:
    """Return the cell centres (cells**2, 2)."""
    q, v = (low + (np.arange(cells) + 0.5) * (high - low) / cells for low, high in box)
    return np.column_stack([axis.ravel() for axis in np.meshgrid(q, v, indexing="ij")])


def prepared(X: np.ndarray):
    """Return the scene's tables, packed numbers and the modes in which the starts begin."""
    scene = scene_of(bf.systems.impact_oscillator(**NUMBERS))
    modes = np.empty(len(X), np.int64)
    begin(scene.tables, np.array(list(scene.start_modes()), np.int64), X, modes)
    if (modes < 0).any():
        raise ValueError("a start of the grid has no clear mode")
    return scene.tables, pack(scene.tables), modes


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes
    ----------
    rates : dict
        Kernel -> list of 1e6 starts x periods a CPU-second, one entry a round.
    aside : dict
        Kernel -> starts that it left to the caller.
    errors : dict
        What -> (N,) errors of checked cells, in units of the state.
    limits : dict
        Entry of the peer program -> list of the same rates of vectorised C.
    """

    rates: dict
    aside: dict
    errors: dict
    limits: dict

    def rate(self, kernel: str) -> float:
        """Return the median rate of a kernel."""
        return statistics.median(self.rates[kernel])

    def share(self, kernel: str) -> float | None:
        """Return the rate of a kernel over that of vectorised C."""
        if kernel.endswith((", batch", ", march", ", simulation")):  # the peer program has no such scene
            return None
        found = self.limits.get(SMOOTH if "Runge" in kernel or "order 8" in kernel else IMPACTS)
        return self.rate(kernel) / statistics.median(found) if found else None


def errors(setting: Setting, periods: int, X: np.ndarray, propagate) -> np.ndarray:
    """Return the errors (N,) of a kernel at random cells."""
    exact = Oscillator(**NUMBERS)
    many = CHECKED[setting][0 if periods == 1 else 1]
    starts = X[np.random.default_rng(7).choice(len(X), many, replace=False)]
    right = np.array([[float(value) for value in exact.march(q, v, 0, periods * exact.period)[:2]] for q, v in starts])
    propagate(starts, periods)
    return np.abs(starts - right).max(axis=1)


def smooth_kernels(scene):
    """Return the calls of the smooth kernels, steps of the method of order 8 that the wished error takes, and its error."""
    T, calls = scene.tables, {}
    eight = smooth.kind_of(scene)
    steps, error = smooth.steps_for(scene, eight)
    for name, kind, count in (("Runge-Kutta, 100 steps", smooth.kind_of(scene, 4), 100),
                              (f"order 8, {steps} steps", eight, steps)):
        module, numbers = smooth.module_of(kind), smooth.numbers_of(T, kind, count)
        calls[name] = lambda Y, n, module=module, numbers=numbers: side_by_side(module, numbers, Y, n)
    return calls, error


def mode_kernels(cells: int, scenes: int | None = None) -> tuple[dict, dict]:
    """Return the calls of the batches through several modes, and of the scalar integrator alone, and their starts, of the first
    ``scenes``."""
    calls, starts = {}, {}
    for name, system in list(scenes_of_modes().items())[:scenes]:
        X = starts_of(system, cells)
        scene = scene_of(system)
        kind = packing.kind_of(scene)
        integrator = PeriodMap(system)._integrator
        given = packing.module_of(kind), packing.numbers_of(scene.tables, kind), integrator.begin(X)[1]
        calls[f"{name}, batch"] = lambda Y, n, given=given: side_by_side(*given[:2], Y, n, given[2])
        calls[f"{name}, march"] = alone(integrator)
        starts[f"{name}, batch"] = starts[f"{name}, march"] = X
    return calls, starts


def alone(integrator):
    """Return the call of the scalar integrator alone."""
    scalar = kernels(integrator.scene, "bifurc.ensemble.scalar")

    def march(Y, periods):
        T, modes = integrator.begin(Y)
        codes, impacts = (np.full(len(Y), value) for value in (6, 0))
        scalar.map_starts(T, integrator._followers(T), integrator._candidates, modes, Y, 2000, periods, codes, impacts,
                          np.full(len(Y), np.inf))
        return int(np.count_nonzero(codes))

    return march


def law_kernels(cells: int, scenes: int | None = None) -> tuple[dict, dict]:
    """Return the calls of batches under laws, of the scalar integrator and of simulations, and the starts of each: those that
    are slow get fewer; of the first ``scenes``."""
    calls, starts = {}, {}
    for name, system in list(scenes_of_laws().items())[:scenes]:
        X = np.random.default_rng(3).uniform(-0.55, 0.55, (cells**2, 2 * system.n))
        integrator = PeriodMap(system)._integrator

        def batch(Y, periods, integrator=integrator):
            return int(np.count_nonzero(integrator.propagate(Y, periods).outcomes))

        def simulations(Y, periods, system=system):
            return sum(not bf.simulate(system, y, periods=periods).success for y in Y)

        for what, call, share in (("batch", batch, 1), ("march", alone(integrator), 40), ("simulation", simulations, 400)):
            calls[f"{name}, {what}"], starts[f"{name}, {what}"] = call, X[:max(len(X) // share, 4)]
    return calls, starts


def study(setting: Setting = Setting.FULL, limit=None) -> Result:
    """Return rates and errors; ``limit`` returns the rates of vectorised C by name."""
    cells = CELLS if setting is Setting.FULL else 40
    X, D = grid(cells), grid(cells, DUFFING_BOX)
    T, packed, modes = prepared(X)
    scene = scene_of(bf.systems.impact_oscillator(**NUMBERS))
    kind = packing.kind_of(scene)
    module, numbers = packing.module_of(kind), packing.numbers_of(scene.tables, kind)
    calls = {"batch": lambda Y, n: side_by_side(module, numbers, Y, n),
             "period kernel": lambda Y, n: lean(*packed, modes, Y, n, 2000),
             "general march": lambda Y, n: general(T, modes, Y, n, 2000)}
    fields, _ = smooth_kernels(scene_of(bf.systems.duffing_oscillator(**DUFFING)))
    modal, theirs = mode_kernels(cells, None if setting is Setting.FULL else 2)  # each compiles a kernel of its own
    under, their_own = law_kernels(cells, None if setting is Setting.FULL else 1)
    starts = dict.fromkeys(calls, X) | dict.fromkeys(fields, D) | theirs | their_own
    calls |= fields | modal | under
    aside = {name: call(starts[name].copy(), PERIODS) for name, call in calls.items()}
    rates: dict[str, list[float]] = {name: [] for name in calls}
    limits: dict[str, list[float]] = {}
    for turn in range(ROUNDS[setting]):
        if limit is not None and turn < TURNS[setting]:
            for name, value in limit().items():
                limits.setdefault(name, []).append(value)
        for name, call in calls.items():
            Y = starts[name].copy()
            start = time.process_time()
            call(Y, PERIODS)
            rates[name].append(len(Y) * PERIODS / 1e6 / (time.process_time() - start))
    found = {f"batch, {n} period{'s' if n > 1 else ''}": errors(setting, n, X, calls["batch"]) for n in (1, 10)}
    right = D.copy()
    duffing = scene_of(bf.systems.duffing_oscillator(**DUFFING))
    right = smooth.images(duffing, smooth.kind_of(duffing), 400, right)
    for name in fields:
        Y = D.copy()
        calls[name](Y, 1)
        found[f"{name}, 1 period"] = np.abs(Y - right).max(axis=1)
    return Result(rates, aside, found, limits)


def limit_of(script: str, python: str) -> dict[str, float]:
    """Return the rates that the peer program measures."""
    done = subprocess.run([python, script], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.strip().splitlines()[-1])
    return {name: float(found[name]) for name in (IMPACTS, SMOOTH)}


def report(result: Result) -> str:
    """Return the tables."""
    rows = [(name, f"{result.rate(name):.2f}", f"{min(rates):.2f}-{max(rates):.2f}",
             "-" if result.share(name) is None else f"{result.share(name):.2f}", result.aside[name])
            for name, rates in result.rates.items()]
    for name, found in result.limits.items():
        what = "C: impacts, no sticking" if name == IMPACTS else "C: Runge-Kutta, 100 steps"
        rows.append((what, f"{statistics.median(found):.2f}", f"{min(found):.2f}-{max(found):.2f}", "1", ""))
    text = table("1e6 starts x forcing periods a CPU-second, one core, float64",
                 ("kernel", "median", "range", "of C", "set aside"), rows)
    if not result.limits:
        text += "\nC limit: not run (give --limit SCRIPT)"
    accuracy = table("error of the state: impacts against 34 digits, smooth field against 400 steps of order 8",
                     ("what", "cells", "median", "99 %", "largest"),
                     [(name, found.size, f"{np.median(found):.1e}", f"{np.quantile(found, 0.99):.1e}",
                       f"{found.max():.1e}") for name, found in result.errors.items()])
    return f"{text}\n\n{accuracy}"


def picture(result: Result):
    """Return the figure: rates, and how errors are distributed."""
    from bifurc.plotting import style
    made, (left, right) = style.figure(6.8, 3.2, columns=2)
    bars = {name: (result.rate(name), rates, style.BLUE) for name, rates in result.rates.items()}
    for name, found in result.limits.items():
        bars["C, impacts" if name == IMPACTS else "C, Runge-Kutta"] = (statistics.median(found), found, style.GREY)
    left.barh(list(bars), [value for value, _, _ in bars.values()], color=[colour for _, _, colour in bars.values()], height=0.55)
    for place, (value, spread, _) in enumerate(bars.values()):
        left.plot([min(spread), max(spread)], [place, place], color=style.BLACK, lw=1.0)
        left.text(1.15 * max(spread), place, f"{value:.2f}", va="center", fontsize=8, bbox=BOXED)
    left.set(xlabel=r"$10^6$ starts $\times$ periods / CPU s", xscale="log",
             xlim=(0.1, 6.0 * max(value for value, _, _ in bars.values())), ylim=(-0.6, len(bars) - 0.3))
    left.tick_params(axis="y", which="both", length=0)
    styles = zip(result.errors.items(), (style.BLUE, style.VERMILION, style.GREY, style.SKY), ("-", "--", ":", "-."), strict=True)
    for (name, found), colour, line in styles:
        values = np.sort(np.maximum(found, 1e-17))
        right.step(values, np.linspace(0.0, 100.0, values.size), color=colour, ls=line, label=name)
    right.set(xscale="log", xlabel="error of the state", ylabel="cells with a smaller error, %",
              xlim=(5e-18, 1e-1), ylim=(0.0, 100.0))
    style.legend(right, loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=1)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    line = parser(__doc__)
    line.add_argument("--limit", metavar="SCRIPT", help="program that measures vectorised C, see the head of this file")
    line.add_argument("--limit-python", default=sys.executable, help="Python that runs it")
    given = line.parse_args(arguments)
    result = study(given.setting, None if given.limit is None else lambda: limit_of(given.limit, given.limit_python))
    publish(given, "kernel_throughput", report(result), lambda: picture(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
