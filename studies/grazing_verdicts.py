"""Verdicts of grazings against brute force: random systems, each simulated at 1e-4 beyond its grazing for thousands of periods.

The systems: one mass and a rigid stop, underdamped and overdamped; one mass between two stops; two masses with a stop on one of
them; a mass and an elastic stop. Frequency, damping, restitution are drawn at random; the load is raised until the free response
touches. What a motion from the free response does at 1e-4 beyond, relative to the load, is judged by the size of its impacts
alone: small, if no speed exceeds 12 times that of a first touch. Foretold is that a verdict other than a jump stays small, and
that a jump does what the discontinuity map of the touch says of this distance (`Grazing.expected`): the speed to which a motion
is thrown back, 2 |A_g| (1 + r) |s_k|, is a number of its own, and where it is small a motion at 1e-4 has not yet left. The table
compares the speed that the map foretells with the one seen, where both are small. Of chaos both are maxima of finite runs.
"""
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.continuation.grazing.confirm import confirmed

from .common import Setting, parser, publish, table

CASES = {Setting.SMALL: 10, Setting.FULL: 200}
PERIODS = {Setting.SMALL: 1500, Setting.FULL: 3000}
EPS = 1e-4
KINDS = ("underdamped", "overdamped", "two stops", "two masses", "elastic")


@dataclass(frozen=True)
class Judged:
    """One grazing: what was foretold and what was seen."""

    kind: str
    parameters: dict
    verdict: str
    multiplier: float
    foretold: bool | None
    seen: bool | None
    speed: float
    first: float
    expected: float

    @property
    def right(self) -> bool | None:
        """Whether the two agree; None where nothing was foretold or seen."""
        return None if self.foretold is None or self.seen is None else self.foretold == self.seen


def system_of(kind: str, draw: np.random.Generator):
    """Return a system with a small load, drawn at random."""
    omega, restitution = float(draw.uniform(0.6, 3.0)), float(draw.uniform(0.3, 0.95))
    common = {"omega": omega, "restitution": restitution, "gap": 1.0, "amplitude": 0.01}
    if kind == "underdamped":
        return bf.systems.impact_oscillator(zeta=float(draw.uniform(0.02, 0.4)), **common)
    if kind == "overdamped":
        common["omega"] = float(draw.uniform(0.8, 12.0))
        return bf.systems.impact_oscillator(zeta=float(draw.uniform(1.05, 2.0)), **common)
    if kind == "two stops":
        return bf.systems.two_sided_impact_oscillator(zeta=float(draw.uniform(0.03, 1.6)), **common)
    if kind == "two masses":
        return bf.systems.impact_chain(n=2, damping=float(draw.uniform(0.05, 0.4)), **common)
    return bf.systems.bilinear_oscillator(zeta=float(draw.uniform(0.05, 0.4)), omega=omega, gap=1.0, amplitude=0.01,
                                          stiffness_ratio=float(draw.uniform(1.5, 9.0)))


def grazing_of(system):
    """Return the grazing of the free response when the load is raised."""
    rest = bf.find_orbit(system)  # the response is linear up to the touch
    touch = system.parameter("amplitude") / (rest.maximum(system.n - 1) if system.n > 1 else max(rest.maximum(), -rest.minimum()))
    near = system.with_parameters(amplitude=0.9 * touch)
    free = bf.find_orbit(near, guess=0.9 * touch / system.parameter("amplitude") * rest.state)
    branch = bf.trace(free, "amplitude", bounds=(0.8 * touch, 1.02 * touch), max_steps=40)
    return min(branch.special_points.of("grazing"), key=lambda point: abs(point.s))


def judged(kind: str, draw, periods: int) -> Judged:
    """Draw a system and judge the verdict on its grazing."""
    system = system_of(kind, draw)
    grazing = grazing_of(system).grazing
    (seen,) = confirmed(grazing, (EPS,), periods) or (None,)
    foretold, expected = grazing.verdict.small, grazing.expected(EPS)
    if foretold is False and expected is not None:
        foretold = expected.small
    told = (kind, system.parameters, str(grazing.verdict), abs(grazing.multiplier), foretold)
    speed = np.nan if expected is None else expected.speed
    if seen is None or not seen.completed:
        return Judged(*told, None, np.nan, np.nan, speed)
    return Judged(*told, seen.small, seen.speed, seen.first, speed)


def verdicts(setting: Setting, seed: int = 0) -> list[Judged]:
    """Return the judged cases, of all kinds in turn."""
    draw = np.random.default_rng(seed)
    return [judged(KINDS[k % len(KINDS)], draw, PERIODS[setting]) for k in range(CASES[setting])]


def report(rows: list[Judged]) -> str:
    """Return the table; speeds in units of a first touch."""
    lines = []
    for kind in KINDS:
        for verdict in sorted({row.verdict for row in rows if row.kind == kind}):
            found = [row for row in rows if row.kind == kind and row.verdict == verdict]
            right = [row.right for row in found if row.right is not None]
            ratio = [row.speed / row.first for row in found if row.seen is not None]
            off = [abs(row.expected / row.speed - 1.0) for row in found if row.seen and np.isfinite(row.expected)]
            lines.append([kind, verdict, len(found), len(right), sum(right), float(min(ratio, default=np.nan)),
                          float(max(ratio, default=np.nan)), len(off), float(max(off, default=np.nan))])
    title = "Verdicts against simulations 1e-4 beyond the grazing; speeds in those of a first touch"
    header = ("system", "verdict", "cases", "judged", "right", "least speed", "largest", "small", "map off by")
    return table(title, header, lines)


def picture(rows: list[Judged]):
    """Draw largest speed over leading multiplier, by verdict."""
    from bifurc.plotting.style import figure
    fig, (ax,) = figure(6.0, 3.8)
    for verdict in sorted({row.verdict for row in rows}):
        found = [row for row in rows if row.verdict == verdict and row.seen is not None]
        ax.plot([row.multiplier for row in found], [row.speed / row.first for row in found], ".", label=verdict.replace("_", " "))
    ax.axhline(12.0, color="0.5", linewidth=0.8)
    ax.set_yscale("log")
    ax.set_xlabel("modulus of the leading multiplier")
    ax.set_ylabel("impact speed / speed of a first touch")
    ax.legend(frameon=False)
    return fig


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows = verdicts(given.setting)
    publish(given, "grazing_verdicts", report(rows), lambda: picture(rows))
    for row in rows:
        if row.right is False:
            sys.stdout.write(f"wrong: {row}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
