"""Mode tables against source written for one scene: what tables cost in a march, and what they save at a change.

The kernels of the package know no scene: all they do is in the tables. The source of `straightline` is a monolith for
exactly one scene, one rigid stop and one or two degrees of freedom, that reads its numbers from an array, or has them
as literals (the best that generation can give, for one set of parameters). Same starts, same states to rounding, CPU
times taken in turn. The tables are refilled at a change of parameters in microseconds where source with literal
numbers has to be written and compiled again.
"""
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import rebuild
from bifurc.ensemble.initial_conditions import begin

from .common import Setting, interleaved, parser, publish, table
from .kernel_throughput import general, lean
from .one_degree import fits, pack
from .straightline import written

ONE = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
TWO = bf.systems.impact_chain(n=2, damping=0.1, omega=0.9, amplitude=0.8, gap=0.6, restitution=0.7)
CHAINS = (1, 2, 4, 8)
STARTS = {Setting.SMALL: 200, Setting.FULL: 6000}
PERIODS = 10
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 15}
REBUILDS = {Setting.SMALL: 200, Setting.FULL: 20_000}


@dataclass(frozen=True)
class Ratio:
    """One package kernel against straight-line source on one scene.

    Attributes
    ----------
    kernel : str
    dofs : int
    seconds, monolith, literal : float
        CPU time a start and period of the package kernel, of the source, and of the source with literal numbers.
    difference : float
        Largest difference of the states after one period, length.
    compiling : float
        CPU time to compile the source with literal numbers, which every change of a parameter costs.
    """

    kernel: str
    dofs: int
    seconds: float
    monolith: float
    literal: float
    difference: float
    compiling: float

    @property
    def ratio(self) -> float:
        """Package kernel over straight-line source that reads its numbers."""
        return self.seconds / self.monolith


@dataclass(frozen=True)
class Rebuild:
    """CPU time of a change of parameters for an impact chain.

    Attributes
    ----------
    dofs : int
    rebuild : float
        Taylor tables from the numbers, compiled.
    numbers : float
        New numbers of the scene from a new system, Python.
    compiled : int
        Kernels compiled by the change.
    """

    dofs: int
    rebuild: float
    numbers: float
    compiled: int


def starts(system, count: int, rng: np.random.Generator):
    """Return starts (count, ns) clear of the stop, and their modes."""
    scene = scene_of(system)
    X = np.empty((0, scene.ns))
    candidates = np.array(list(scene.start_modes()), np.int64)
    gap = -scene.tables.G[candidates[0], 0, scene.ns]
    while len(X) < count:
        more = rng.uniform(-2.0, 2.0, (count, scene.ns))
        X = np.concatenate((X, more[(more[:, :scene.n] < gap).all(axis=1)]))
    X = np.ascontiguousarray(X[:count])
    modes = np.empty(count, np.int64)
    begin(scene.tables, candidates, X, modes)
    return scene, X, modes


def monolith(T, literal: bool):
    """Return the compiled source of a scene, its numbers, and the CPU time of its compilation."""
    text, numbers = written(T, literal)
    names: dict = {}
    exec(compile(text, "<straight-line source>", "exec"), names)  # this study's own text
    begun = time.process_time()
    names["march"](np.zeros((0, T.A.shape[1])), 1, 1, numbers)
    return names["march"], numbers, time.process_time() - begun


def ratios(setting: Setting = Setting.FULL) -> list[Ratio]:
    """Return one row a kernel and scene."""
    rows = []
    for system in (ONE, TWO):
        scene, X, modes = starts(system, STARTS[setting], np.random.default_rng(3))
        T = scene.tables
        march, numbers, _ = monolith(T, False)
        best, nothing, compiling = monolith(T, True)
        kernels = {"general march": lambda Y, n, T=T, modes=modes: general(T, modes, Y, n, 2000)}
        if fits(T):
            packed = pack(T)
            kernels["period kernel"] = lambda Y, n, packed=packed, modes=modes: lean(*packed, modes, Y, n, 2000)
        calls = {name: (lambda kernel=kernel, X=X: kernel(X.copy(), PERIODS)) for name, kernel in kernels.items()}
        calls["source"] = lambda march=march, X=X, numbers=numbers: march(X.copy(), PERIODS, 2000, numbers)
        calls["literal"] = lambda best=best, X=X, nothing=nothing: best(X.copy(), PERIODS, 2000, nothing)
        seconds = interleaved(calls, ROUNDS[setting])
        right = X.copy()
        march(right, 1, 2000, numbers)
        for name, kernel in kernels.items():
            Y = X.copy()
            kernel(Y, 1)
            size = len(X) * PERIODS
            rows.append(Ratio(name, scene.n, seconds[name] / size, seconds["source"] / size,
                              seconds["literal"] / size, float(np.abs(Y - right).max()), compiling))
    return rows


@njit
def rebuild_often(T, count):
    """Rebuild tables again and again."""
    for _ in range(count):
        rebuild(T)


def rebuilds(setting: Setting = Setting.FULL) -> list[Rebuild]:
    """Return one row a chain."""
    rows = []
    count = REBUILDS[setting]
    scenes = {n: scene_of(bf.systems.impact_chain(n=n)) for n in CHAINS}
    for scene in scenes.values():
        rebuild_often(scene.tables, 1)
    for n, scene in scenes.items():
        changed = scene.system.with_parameters(omega=0.31, amplitude=0.4)
        kernels = len(rebuild.signatures)
        often = max(count // n**3, 20)
        times = interleaved({"rebuild": lambda scene=scene, often=often: rebuild_often(scene.tables, often),
                             "numbers": lambda scene=scene, changed=changed: scene.flat_of(changed)}, 5)
        rebuild(scene.refill(changed))
        rows.append(Rebuild(n, times["rebuild"] / often, times["numbers"],
                            len(rebuild.signatures) - kernels))
    return rows


def report(rows: list[Ratio], changes: list[Rebuild]) -> str:
    """Return the tables."""
    first = table("a start and forcing period: tables against straight-line source (monolith)",
                  ("kernel", "dofs", "tables us", "monolith us", "ratio", "literals us", "ratio", "states differ by",
                   "compiling literals s"),
                  [(r.kernel, r.dofs, f"{1e6 * r.seconds:.3f}", f"{1e6 * r.monolith:.3f}", f"{r.ratio:.2f}",
                    f"{1e6 * r.literal:.3f}", f"{r.seconds / r.literal:.2f}", f"{r.difference:.1e}",
                    f"{r.compiling:.1f}") for r in rows])
    second = table("a change of parameters with tables (chains of masses with one stop)",
                   ("dofs", "rebuild us", "numbers us (Python)", "kernels compiled"),
                   [(r.dofs, f"{1e6 * r.rebuild:.2f}", f"{1e6 * r.numbers:.0f}", r.compiled) for r in changes])
    return f"{first}\n\n{second}"


def picture(rows: list[Ratio], changes: list[Rebuild]):
    """Return the figure: ratios, and the cost of a change."""
    from matplotlib.ticker import NullLocator

    from bifurc.plotting import style
    made, (left, right) = style.figure(6.3, 2.8, columns=2)
    names = [f"{r.kernel},\n{r.dofs} dof" for r in rows]
    left.barh(names, [r.ratio for r in rows], height=0.55,
              color=[style.BLUE if r.kernel == "period kernel" else style.SKY for r in rows])
    for place, r in enumerate(rows):
        left.text(r.ratio, place, f" {r.ratio:.2f}", va="center", fontsize=8)
    left.axvline(1.0, color=style.BLACK, lw=0.8)
    left.set(xlabel="time with tables / time of the monolith", xlim=(0.0, 1.2 * max(r.ratio for r in rows)))
    left.tick_params(axis="y", which="both", length=0)
    dofs = [r.dofs for r in changes]
    right.plot(dofs, [r.rebuild for r in changes], color=style.BLUE, marker="o", ms=4.5, label="tables rebuilt")
    right.plot(dofs, [r.rebuild + r.numbers for r in changes], color=style.SKY, marker="s", ms=4.5,
               label="numbers and tables")
    right.plot([r.dofs for r in rows], [r.compiling for r in rows], color=style.VERMILION, marker="D", ms=4.5,
               label="source compiled again")
    right.set(xscale="log", yscale="log", xlabel="degrees of freedom", ylabel="CPU time of a change, s")
    right.set_xticks(dofs, [str(n) for n in dofs])
    right.xaxis.set_minor_locator(NullLocator())
    style.legend(right, loc="center right", bbox_to_anchor=(1.0, 0.66))
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    rows, changes = ratios(given.setting), rebuilds(given.setting)
    publish(given, "tables_or_generated", report(rows, changes), lambda: picture(rows, changes))
    return 0


if __name__ == "__main__":
    sys.exit(main())
