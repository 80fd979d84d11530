"""What an effect costs that is not there: time against a kernel that never heard of it, and what was built.

One oscillator, x'' + .04 x' + x = cos(2.6 t), with more and more around it. For each scene: its modes, guards,
numbers and kernels. Where nothing can happen, the kernels of the package are timed against a loop over the exact step
of the linear oscillator that knows no events, no modes and no tables. In processes of their own: which parts of the
package a job loads.
"""
import json
import subprocess
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit
from bifurc.compose.scene import scene_of
from bifurc.ensemble.initial_conditions import begin

from .common import Setting, interleaved, parser, publish, table
from .kernel_throughput import general, lean
from .one_degree import fits, pack

ZETA, OMEGA, AMPLITUDE = 0.02, 2.6, 1.0
STARTS = {Setting.SMALL: 200, Setting.FULL: 4000}
PERIODS = 20
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 15}
ABSENT = {"law kernels": ("bifurc.flow.laws.engine", "bifurc.flow.laws.guards", "bifurc.flow.laws.collocation"),
          "orbits": ("bifurc.orbits",), "continuation": ("bifurc.continuation",), "basins": ("bifurc.basins",),
          "pictures": ("matplotlib", "bifurc.plotting.style"), "graphs": ("networkx",)}
JOBS = {
    "import bifurc": "import bifurc as bf",
    "simulate, a stop": "import bifurc as bf; bf.simulate(bf.systems.impact_oscillator(), (0.0, 0.0), periods=2)",
    "orbit, a stop": "import bifurc as bf; bf.find_orbit(bf.systems.impact_oscillator())",
    "simulate, a cubic spring":
        "import bifurc as bf; bf.simulate(bf.systems.duffing_oscillator(), (0.0, 0.0), periods=2)",
}
_PROBE = """
import json, sys
{job}
print(json.dumps({{name: any(part in sys.modules for part in parts) for name, parts in {absent!r}.items()}}
                 | {{"numba": "numba" in sys.modules}}))
"""


def scenes() -> dict[str, bf.System]:
    """Return one oscillator with more and more around it."""
    load = bf.elements.HarmonicForce(AMPLITUDE)
    parts = {
        "free": (),
        "stop out of reach": (bf.elements.RigidStop(50.0, 0.8),),
        "stop": (bf.elements.RigidStop(0.0, 0.8),),
        "two stops": (bf.elements.RigidStop(1.0, 0.8), bf.elements.RigidStop(1.0, 0.8, side=-1)),
        "elastic stop": (bf.elements.ElasticStop(gap=0.5, stiffness=4.0),),
        "elastic and rigid stop": (bf.elements.ElasticStop(gap=0.5, stiffness=4.0), bf.elements.RigidStop(1.0, 0.8)),
        "cubic spring": (bf.elements.CubicSpring(1.0),),
    }
    return {name: bf.System(1.0, 2.0 * ZETA, 1.0, (load, *more), omega=OMEGA) for name, more in parts.items()}


@dataclass(frozen=True)
class Built:
    """What a scene consists of.

    Attributes
    ----------
    scene : str
    modes, guards, holds : int
        Modes, and the most guards and held rows of one.
    laws : int
        Laws that are not affine, for which kernels are written.
    numbers : int
        Parameters of all modes.
    tables : int
        Numbers derived from them for the kernels.
    lean : bool
        Whether the period kernel serves it in basin maps.
    """

    scene: str
    modes: int
    guards: int
    holds: int
    laws: int
    numbers: int
    tables: int
    lean: bool


def built() -> list[Built]:
    """Return one row a scene."""
    rows = []
    for name, system in scenes().items():
        scene = scene_of(system)
        T = scene.tables
        derived = sum(part.size for part in (T.step, T.YT, T.GT, T.E, T.turn, T.G4))
        rows.append(Built(name, len(scene.keys), int(T.n_guards.max()), int(T.n_holds.max()), len(scene.laws),
                          T.flat.size, derived, scene.closed_form and bool(fits(T))))
    return rows


@njit
def plain(E, turn1, turn2, steps, X, periods):
    """March the starts ``X`` (N, 2) of a linear oscillator in place by its exact step ``E`` (2, 5); nothing else."""
    e00, e01, e02, e03, e04 = E[0, 0], E[0, 1], E[0, 2], E[0, 3], E[0, 4]
    e10, e11, e12, e13, e14 = E[1, 0], E[1, 1], E[1, 2], E[1, 3], E[1, 4]
    for i in range(X.shape[0]):
        q, v = X[i, 0], X[i, 1]
        for _ in range(periods):
            w1, w2 = 1.0, 0.0
            for _ in range(steps):
                q, v = e00 * q + e01 * v + e02 + e03 * w1 + e04 * w2, e10 * q + e11 * v + e12 + e13 * w1 + e14 * w2
                w1, w2 = turn1 * w1 - turn2 * w2, turn2 * w1 + turn1 * w2
        X[i, 0], X[i, 1] = q, v


@dataclass(frozen=True)
class Cost:
    """CPU time of a start and period, and its ratio to the loop that knows nothing.

    Attributes
    ----------
    scene, kernel : str
    seconds : float
    ratio : float
    difference : float
        Largest difference of the states after all periods, length.
    """

    scene: str
    kernel: str
    seconds: float
    ratio: float
    difference: float


def costs(setting: Setting = Setting.FULL) -> list[Cost]:
    """Return the times of scenes in which nothing happens."""
    X = np.random.default_rng(5).uniform(-2.0, 2.0, (STARTS[setting], 2))
    system = scenes()
    T = scene_of(system["free"]).tables
    steps = round(2.0 * np.pi / OMEGA / T.step[0])
    linear = T.E[0].copy(), float(T.turn[0, 1]), float(T.turn[0, 2]), steps
    calls = {("free", "plain loop"): lambda Y: plain(*linear, Y, PERIODS)}
    for name in ("free", "stop out of reach"):
        scene = scene_of(system[name])
        modes = np.empty(len(X), np.int64)
        begin(scene.tables, np.array(list(scene.start_modes()), np.int64), X, modes)
        if fits(scene.tables):
            packed = pack(scene.tables)
            calls[name, "period kernel"] = lambda Y, packed=packed, modes=modes: lean(*packed, modes, Y, PERIODS, 100)
        calls[name, "general march"] = lambda Y, T=scene.tables, modes=modes: general(T, modes, Y, PERIODS, 100)
    seconds = interleaved({name: (lambda call=call: call(X.copy())) for name, call in calls.items()}, ROUNDS[setting])
    right = X.copy()
    plain(*linear, right, PERIODS)
    rows = []
    for (name, kernel), call in calls.items():
        Y = X.copy()
        call(Y)
        used = seconds[name, kernel]
        rows.append(Cost(name, kernel, used / (len(X) * PERIODS), used / seconds["free", "plain loop"],
                         float(np.abs(Y - right).max())))
    return rows


def loaded() -> dict[str, dict[str, bool]]:
    """Return which parts of the package each job loads, in a process of its own."""
    found = {}
    for name, job in JOBS.items():
        done = subprocess.run([sys.executable, "-c", _PROBE.format(job=job, absent=ABSENT)], capture_output=True,
                              text=True, check=True)
        found[name] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def report(rows: list[Built], times: list[Cost], parts: dict[str, dict[str, bool]]) -> str:
    """Return the tables."""
    first = table("what was built",
                  ("scene", "modes", "guards", "held rows", "laws", "numbers", "table numbers", "period kernel"),
                  [(r.scene, r.modes, r.guards, r.holds, r.laws, r.numbers, r.tables, "yes" if r.lean else "no")
                   for r in rows])
    second = table("a start and period in which nothing happens, against a loop that knows only the linear oscillator",
                   ("scene", "kernel", "ns", "ratio", "states differ by"),
                   [(r.scene, r.kernel, f"{1e9 * r.seconds:.0f}", f"{r.ratio:.2f}", f"{r.difference:.0e}")
                    for r in times])
    names = list(next(iter(parts.values())))
    third = table("what a job loads", ("job", *names),
                  [(job, *("yes" if found[name] else "no" for name in names)) for job, found in parts.items()])
    return "\n\n".join((first, second, third))


def picture(rows: list[Built], times: list[Cost]):
    """Return the figure: size of the scenes, and times where nothing happens."""
    from bifurc.plotting import style
    made, (left, right) = style.figure(6.3, 2.8, columns=2)
    names = [r.scene for r in rows]
    left.barh(names, [r.numbers + r.tables for r in rows], height=0.55,
              color=[style.BLUE if r.laws == 0 else style.ORANGE for r in rows])
    for place, r in enumerate(rows):
        left.text(r.numbers + r.tables, place, f" {r.modes} mode{'s' if r.modes > 1 else ''}", va="center", fontsize=8)
    left.invert_yaxis()
    left.set(xlabel="numbers of the scene", xlim=(0.0, 1.5 * max(r.numbers + r.tables for r in rows)))
    left.tick_params(axis="y", which="both", length=0)
    labels = [f"{r.kernel},\n{r.scene}" for r in times]
    colours = {"plain loop": style.GREY, "period kernel": style.BLUE, "general march": style.SKY}
    right.barh(labels, [1e9 * r.seconds for r in times], height=0.6, color=[colours[r.kernel] for r in times])
    for place, r in enumerate(times):
        right.text(1e9 * r.seconds, place, f" {r.ratio:.1f}", va="center", fontsize=8)
    right.invert_yaxis()
    right.set(xlabel="CPU ns a start and period", xscale="log", xlim=(10.0, 5e9 * max(r.seconds for r in times)))
    right.tick_params(axis="y", which="both", length=0)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    rows, times = built(), costs(given.setting)
    publish(given, "effects_off", report(rows, times, loaded()), lambda: picture(rows, times))
    return 0


if __name__ == "__main__":
    sys.exit(main())
