"""What a point of a curve in two parameters costs beside a point of the branch on which it was found.

Branch and curve of every kind are traced in turn, audits left out on both sides, and CPU times divided by their points. A curve
solves one equation more, whose gradient costs Jacobians: that of a fold two along a null vector and two in the second
parameter, that of a flip or a torus four a variable. Each curve is checked at its last point: that of a separate branch at the
same second parameter.
"""
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf

from .common import Setting, interleaved, parser, publish, table

ROUNDS = {Setting.SMALL: 1, Setting.FULL: 5}


@dataclass(frozen=True)
class Case:
    """A system, its branch, the special point and where it is followed."""

    name: str
    kind: str
    second: str
    bounds: tuple[float, float]
    curve: tuple[float, float]
    width: float  # of the separate branch about the last point, in the first parameter


CASES = (Case("impact oscillator", "grazing", "amplitude", (0.5, 0.75), (0.4, 0.6), 0.02),
         Case("impact oscillator", "fold", "amplitude", (0.5, 2.0), (0.45, 0.6), 0.05),
         Case("impact oscillator", "period_doubling", "amplitude", (0.5, 0.75), (0.48, 0.56), 0.02),
         Case("Duffing, 9 harmonics", "fold", "amplitude", (0.5, 2.5), (0.2, 0.35), 0.05),
         Case("Duffing, 9 harmonics", "peak", "amplitude", (0.5, 2.5), (0.2, 0.35), 0.05))


@dataclass(frozen=True)
class Cost:
    """Milliseconds a point, and the distance of the curve's last point to the special point of a separate branch."""

    case: Case
    branch: float
    curve: float
    points: int
    distance: float


def start(case: Case):
    """Return the orbit from which the branch starts."""
    if case.name.startswith("impact"):
        return bf.find_orbit(bf.systems.impact_oscillator())
    system = bf.systems.duffing_oscillator(zeta=0.05, omega=0.6, amplitude=0.3, beta=1.0)
    return bf.find_orbit(system, method=bf.HarmonicBalance(9))


def options(case: Case) -> dict:
    """Return what the branch is traced with."""
    return {"peaks": "max_0"} if case.kind == "peak" else {}


def measured(case: Case, rounds: int) -> Cost:
    """Measure one case."""
    orbit, more = start(case), options(case)

    def branch():
        return bf.trace(orbit, "omega", bounds=case.bounds, audit="fast", **more)
    traced = branch()
    point = traced.special_points.of(case.kind)[-1]

    def curve():
        return bf.trace_curve(point, ("omega", case.second), bounds={"omega": (0.3, 3.0), case.second: case.curve})
    followed = curve()
    times = interleaved({"branch": branch, "curve": curve}, rounds)
    return Cost(case, 1e3 * times["branch"] / len(traced), 1e3 * times["curve"] / len(followed), len(followed),
                distance(case, followed, more))


def distance(case: Case, curve, more) -> float:
    """Return how far the last point of a curve lies from the special point of a branch at that second parameter."""
    omega, at = float(curve.column("omega")[-1]), curve.orbits[len(curve) - 1]
    branch = bf.trace(at, "omega", bounds=(omega - case.width, omega + case.width), audit="fast", **more)
    return min((abs(p.parameter - omega) for p in branch.special_points.of(case.kind)), default=np.nan)


def costs(setting: Setting) -> list[Cost]:
    """Return all cases."""
    return [measured(case, ROUNDS[setting]) for case in CASES]


def report(rows: list[Cost]) -> str:
    """Return the table."""
    lines = [[f"{row.case.name}: {row.case.kind.replace('_', ' ')}", row.points, row.branch, row.curve, row.curve / row.branch,
              row.distance] for row in rows]
    return table("A point of a curve beside a point of a branch, CPU ms", ("followed", "points", "branch", "curve", "ratio",
                                                                           "to separate branch"), lines)


def picture(rows: list[Cost]):
    """Draw both costs side by side."""
    from bifurc.plotting.style import figure
    fig, (ax,) = figure(6.0, 3.4)
    place = np.arange(len(rows))
    ax.barh(place - 0.2, [row.branch for row in rows], 0.38, label="branch")
    ax.barh(place + 0.2, [row.curve for row in rows], 0.38, label="curve in two parameters")
    ax.set_yticks(place, [f"{row.case.name}\n{row.case.kind.replace('_', ' ')}" for row in rows])
    ax.set_xscale("log")
    ax.invert_yaxis()
    ax.set_xlabel("CPU time of a point, ms")
    ax.legend(frameon=False)
    return fig


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows = costs(given.setting)
    publish(given, "curve_cost", report(rows), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
