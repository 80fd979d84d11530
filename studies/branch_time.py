"""Time and completeness of two branches for every largest step: bilinear (two kinds of motion) and Duffing (a law).

The bilinear branch has two folds, two flips and two grazings, one pair of them next to each other; the Duffing branch
two folds. Every branch is audited inside the measured time. References: event-cut shooting and harmonic balance in 40
digits. AUTO-07p can be run beside: ``--auto SCRIPT`` names a program that is called as ``SCRIPT PROBLEM --ntst N``
and prints one JSON object with ``engine_cpu_s``, ``points``, ``folds`` and ``period_doublings``.
"""
import json
import subprocess
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf

from .common import Setting, interleaved, parser, publish, table

BILINEAR = {"fold": (1.256495097569180395427, 1.317900629495415657784),
            "period_doubling": (0.7294082584161703258244, 0.7927184518181697229612),
            "grazing": (0.63511486615490092382, 1.2596146659947407444)}
DUFFING = {"fold": (1.3242362007705655567, 1.7797195242985731142)}
BOUNDS = (0.5, 2.5)
STEPS = {Setting.SMALL: (0.1, 1.0), Setting.FULL: (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)}
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 9}
WORDS = {"fold": "fold", "period_doubling": "flip", "grazing": "grazing"}


@dataclass(frozen=True)
class Traced:
    """One problem at one largest step.

    Attributes
    ----------
    problem : str
    ds_max : float
        Dimensionless, see `bifurc.trace`.
    seconds : float
        CPU time of trace and audit.
    points : int
    missed, invented : int
        Special points that should be there and are not, or the other way round.
    worst : float
        Largest error of a special point that is there, in units of omega.
    covered : bool
        Each error is at most the one stated at the point (plus rounding of omega).
    audit : bool
        The branch's own verdict.
    """

    problem: str
    ds_max: float
    seconds: float
    points: int
    missed: int
    invented: int
    worst: float
    covered: bool
    audit: bool


def starts():
    """Return the first orbits at omega = 0.5 and the special points of both branches."""
    bilinear = bf.systems.bilinear_oscillator(zeta=0.05, omega=0.5, amplitude=0.3, gap=0.5, stiffness_ratio=5.0)
    duffing = bf.systems.duffing_oscillator(zeta=0.05, omega=0.5, amplitude=0.3)
    return {"bilinear": (bf.find_orbit(bilinear), BILINEAR), "Duffing": (bf.find_orbit(duffing), DUFFING)}


def branch_of(orbit, ds_max: float):
    """Return the branch in omega, audited; the default step is ds_max = 0.2."""
    branch = bf.trace(orbit, "omega", bounds=BOUNDS, ds_max=ds_max, ds=min(0.02, ds_max), audit="fast")
    _ = branch.audit
    return branch


def judged(branch, truth) -> tuple[int, int, float, bool]:
    """Return missed, invented, largest error, and whether the stated errors bound it."""
    missed = invented = 0
    worst, covered = 0.0, True
    found: dict[str, list] = {kind: [] for kind in truth}
    for point in branch.special_points:
        if str(point.kind) in found:
            found[str(point.kind)].append(point)
        elif str(point.kind) != "peak":
            invented += 1
    for kind, values in truth.items():
        points = list(found[kind])
        for value in values:
            near = min(points, key=lambda point: abs(point.parameter - value), default=None)
            if near is None or abs(near.parameter - value) > 1e-4:
                missed += 1
                continue
            points.remove(near)
            error = abs(near.parameter - value)
            worst = max(worst, error)
            covered = covered and error <= near.error + 4.0 * np.finfo(float).eps * value
        invented += len(points)
    return missed, invented, worst, covered


def study(setting: Setting = Setting.FULL) -> list[Traced]:
    """Return one row a problem and largest step."""
    rows = []
    for name, (orbit, truth) in starts().items():
        calls = {str(ds): (lambda ds=ds, orbit=orbit: branch_of(orbit, ds)) for ds in STEPS[setting]}
        seconds = interleaved(calls, ROUNDS[setting])
        for ds in STEPS[setting]:
            branch = branch_of(orbit, ds)
            rows.append(Traced(name, ds, seconds[str(ds)], len(branch), *judged(branch, truth), branch.audit.ok))
    return rows


@dataclass(frozen=True)
class Peer:
    """What AUTO gave for one problem and number of mesh intervals."""

    problem: str
    ntst: int
    seconds: float
    points: int
    missed: int
    invented: int
    worst: float


def peers(script: str, python: str, ntst=(20, 40, 80)) -> list[Peer]:
    """Return AUTO's rows; the program runs in its own Python."""
    rows = []
    for name, truth in (("bilinear", BILINEAR), ("Duffing", DUFFING)):
        for intervals in ntst:
            done = subprocess.run([python, script, name.lower(), "--ntst", str(intervals)], capture_output=True,
                                  text=True, check=True)
            answer = json.loads(done.stdout.strip().splitlines()[-1])
            missed = invented = 0
            worst = 0.0
            for kind, values in (("fold", answer["folds"]), ("period_doubling", answer["period_doublings"])):
                left = list(values)
                for value in truth.get(kind, ()):
                    near = min(left, key=lambda found: abs(found - value), default=None)
                    if near is None or abs(near - value) > 0.02:
                        missed += 1
                        continue
                    left.remove(near)
                    worst = max(worst, abs(near - value))
                invented += len(left)
            rows.append(Peer(name, intervals, answer["engine_cpu_s"], answer["points"], missed, invented, worst))
    return rows


def report(rows: list[Traced], others: list[Peer] | None) -> str:
    """Return the tables."""
    own = table("branches in omega from 0.5 to 2.5, traced and audited",
                ("problem", "ds_max", "CPU ms", "points", "missed", "invented", "largest error", "bounded", "audit"),
                [(r.problem, r.ds_max, f"{1e3 * r.seconds:.2f}", r.points, r.missed, r.invented, f"{r.worst:.1e}",
                  "yes" if r.covered else "NO", "ok" if r.audit else "NOT OK") for r in rows])
    if others is None:
        return own + "\n\nAUTO: not run (give --auto SCRIPT)"
    return own + "\n\n" + table(
        "AUTO-07p, engine alone; grazings are not among its special points",
        ("problem", "NTST", "CPU ms", "points", "missed", "invented", "largest error"),
        [(r.problem, r.ntst, f"{1e3 * r.seconds:.1f}", r.points, r.missed, r.invented, f"{r.worst:.1e}")
         for r in others])


def picture(rows: list[Traced], others: list[Peer] | None):
    """Return the figure: the bilinear branch with its six points, and time against the largest step."""
    from matplotlib.ticker import LogFormatter, NullLocator

    from bifurc.plotting import style
    made, (left, right) = style.figure(6.3, 3.0, columns=2)
    branch = branch_of(starts()["bilinear"][0], 0.02)
    branch.plot(ax=left)
    left.set_title("bilinear oscillator", fontsize=9)
    style.legend(left, loc="upper right")
    for name, colour, marker in (("bilinear", style.BLUE, "o"), ("Duffing", style.VERMILION, "s")):
        mine = [r for r in rows if r.problem == name]
        right.plot([r.ds_max for r in mine], [1e3 * r.seconds for r in mine], color=colour, marker=marker, ms=4.5,
                   label=name)
        for i, r in enumerate(sorted((o for o in others or () if o.problem == name), key=lambda o: o.ntst)):
            right.axhline(1e3 * r.seconds, color=colour, lw=0.8, ls=(0, (2 + 2 * i, 2)),
                          label=f"{name}, AUTO with {r.ntst} intervals")
    right.set(xscale="log", yscale="log", xlabel="largest step, dimensionless", ylabel="CPU time of the branch, ms")
    ticks = sorted({r.ds_max for r in rows})
    right.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    right.xaxis.set_minor_locator(NullLocator())
    for formatter in (right.yaxis.set_major_formatter, right.yaxis.set_minor_formatter):
        formatter(LogFormatter(minor_thresholds=(3, 1), labelOnlyBase=False))
    style.legend(right)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    line = parser(__doc__)
    line.add_argument("--auto", metavar="SCRIPT", help="program that runs AUTO-07p, see the head of this file")
    line.add_argument("--auto-python", default=sys.executable, help="Python that runs it")
    given = line.parse_args(arguments)
    begun = time.process_time()
    rows = study(given.setting)
    others = None if given.auto is None else peers(given.auto, given.auto_python)
    publish(given, "branch_time", f"{report(rows, others)}\n\nstudy: {time.process_time() - begun:.0f} s CPU",
            lambda: picture(rows, others))
    return 0


if __name__ == "__main__":
    sys.exit(main())
