"""Throughput of the scalar kernel of basin maps: starts x forcing periods a CPU-second on one core, and its accuracy.

x'' + .04 x' + x = cos(2.6 t), x <= 0, restitution .8 (a motion of period one and one of period three coexist), starts
at the cell centres of a grid over (-2.5, 0) x (-3, 3), sticking and infinite sequences of impacts included. Accuracy:
states after one and ten periods of random cells against 34-digit arithmetic. A measure of what the machine can do may
be run beside: ``--limit SCRIPT`` names a program that prints one JSON object with ``impact_f64`` in 1e6 starts x
periods a CPU-second of hand-written vectorised C.
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
from bifurc.basins.starting import begin
from bifurc.compose.scene import scene_of
from bifurc.flow.scan import DONE, MODE, STATE, TAU, run, workspace
from bifurc.flow.single import pack, period, scratch

from .common import Setting, parser, publish, table
from .reference import Oscillator

NUMBERS = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
BOX = ((-2.5, 0.0), (-3.0, 3.0))
CELLS, PERIODS = 160, 20
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 9}
CHECKED = {Setting.SMALL: (40, 6), Setting.FULL: (1500, 100)}  # cells after one and after ten periods
BOXED = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none"}
LEAST = 2.5  # 1e6 starts x periods a CPU-second that are asked for


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


def grid(cells: int = CELLS) -> np.ndarray:
    """Return the cell centres (cells**2, 2)."""
    q, v = (low + (np.arange(cells) + 0.5) * (high - low) / cells for low, high in BOX)
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
        Periods -> (N,) errors of checked cells, length.
    limit : float or None
        The same rate of vectorised C.
    """

    rates: dict
    aside: dict
    errors: dict
    limit: float | None

    def rate(self, kernel: str) -> float:
        """Return the median rate of a kernel."""
        return statistics.median(self.rates[kernel])


def errors(setting: Setting, periods: int, X: np.ndarray) -> np.ndarray:
    """Return the errors (N,) of the period kernel at random cells."""
    exact = Oscillator(**NUMBERS)
    many = CHECKED[setting][0 if periods == 1 else 1]
    starts = X[np.random.default_rng(7).choice(len(X), many, replace=False)]
    right = np.array([[float(value) for value in exact.march(q, v, 0, periods * exact.period)[:2]] for q, v in starts])
    _, packed, modes = prepared(starts)
    lean(*packed, modes, starts, periods, 2000)
    return np.abs(starts - right).max(axis=1)


def study(setting: Setting = Setting.FULL, limit: float | None = None) -> Result:
    """Return rates and errors."""
    X = grid(CELLS if setting is Setting.FULL else 40)
    T, packed, modes = prepared(X)
    calls = {"period kernel": lambda Y, n: lean(*packed, modes, Y, n, 2000),
             "general march": lambda Y, n: general(T, modes, Y, n, 2000)}
    aside = {name: call(X.copy(), PERIODS) for name, call in calls.items()}
    rates: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS[setting]):
        for name, call in calls.items():
            Y = X.copy()
            start = time.process_time()
            call(Y, PERIODS)
            rates[name].append(len(X) * PERIODS / 1e6 / (time.process_time() - start))
    return Result(rates, aside, {n: errors(setting, n, X) for n in (1, 10)}, limit)


def limit_of(script: str, python: str) -> float:
    """Return the rate that the peer program measures."""
    done = subprocess.run([python, script], capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout.strip().splitlines()[-1])["impact_f64"])


def report(result: Result) -> str:
    """Return the tables."""
    limit = result.limit
    rows = [(name, f"{result.rate(name):.2f}", f"{min(rates):.2f}-{max(rates):.2f}",
             "-" if limit is None else f"{result.rate(name) / limit:.2f}", result.aside[name])
            for name, rates in result.rates.items()]
    if limit is not None:
        rows.append(("vectorised C (no sticking)", f"{limit:.2f}", "", "1", ""))
    text = table("1e6 starts x forcing periods a CPU-second, one core, float64",
                 ("kernel", "median", "range", "of C", "set aside"), rows)
    if limit is None:
        text += "\nC limit: not run (give --limit SCRIPT)"
    accuracy = table("error of the state against 34 digits", ("periods", "cells", "median", "99 %", "largest"),
                     [(n, found.size, f"{np.median(found):.1e}", f"{np.quantile(found, 0.99):.1e}",
                       f"{found.max():.1e}") for n, found in result.errors.items()])
    return f"{text}\n\n{accuracy}"


def picture(result: Result):
    """Return the figure: rates, and how errors are distributed."""
    from bifurc.plotting import style
    made, (left, right) = style.figure(6.3, 2.8, columns=2)
    bars = {name: result.rate(name) for name in result.rates}
    if result.limit is not None:
        bars["vectorised C"] = result.limit
    colours = (style.BLUE, style.SKY, style.GREY)
    left.barh(list(bars), list(bars.values()), color=colours[:len(bars)], height=0.55)
    for place, (name, value) in enumerate(bars.items()):
        spread = result.rates.get(name, [value])
        left.plot([min(spread), max(spread)], [place, place], color=style.BLACK, lw=1.0)
        left.text(1.15 * max(spread), place, f"{value:.2f}", va="center", fontsize=8, bbox=BOXED)
    left.axvline(LEAST, color=style.VERMILION, ls="--", lw=1.0, zorder=0)
    left.text(LEAST, len(bars) - 0.45, "asked for ", color=style.VERMILION, fontsize=8, va="center", ha="right")
    left.set(xlabel=r"$10^6$ starts $\times$ periods / CPU s", xscale="log",
             xlim=(0.1, 4.0 * max(LEAST, *bars.values())), ylim=(-0.6, len(bars) - 0.3))
    left.tick_params(axis="y", which="both", length=0)
    for (n, found), colour, line in zip(result.errors.items(), (style.BLUE, style.VERMILION), ("-", "--"), strict=True):
        values = np.sort(np.maximum(found, 1e-17))
        right.step(values, np.linspace(0.0, 100.0, values.size), color=colour, ls=line,
                   label=f"{n} period{'s' if n > 1 else ''}, {found.size} cells")
    right.set(xscale="log", xlabel="error of the state, length", ylabel="cells with a smaller error, %",
              xlim=(5e-18, 2e-13), ylim=(0.0, 100.0))
    style.legend(right, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    line = parser(__doc__)
    line.add_argument("--limit", metavar="SCRIPT", help="program that measures vectorised C, see the head of this file")
    line.add_argument("--limit-python", default=sys.executable, help="Python that runs it")
    given = line.parse_args(arguments)
    result = study(given.setting, None if given.limit is None else limit_of(given.limit, given.limit_python))
    publish(given, "kernel_throughput", report(result), lambda: picture(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
