"""Whether an atlas holds what brute force finds: six systems, random starts at random values of the parameter.

An atlas of each system is made; then, at values drawn at random, thousands of starts are followed by nothing but the map of one
forcing period, and the motions they settle on are compared with what the atlas knows there: the stable orbits of its branches
(up to phase and symmetry), its bands of chaos, and the long periods that it lists. An attractor counts as missed when its share
of the starts is above half a per cent. Every branch is compared with every other one: none may be there twice.

The atlas is timed twice, and the second time is given: the first one also compiles.
"""
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.atlases.identity import mirrored_points, on_branch
from bifurc.compose.scene import scene_of
from bifurc.ensemble.region import Region

from .common import Setting, parser, publish, table
from .sweep_cost import audit

AUDITS = {Setting.SMALL: 2, Setting.FULL: 20}
STARTS = {Setting.SMALL: 200, Setting.FULL: 4000}
SHARE = 0.005  # of the starts: attractors with less need not be known
CLOSE = 1e-4  # of the sizes of the states: a settled motion and an orbit


@dataclass(frozen=True)
class Case:
    """A system, its parameter and range, the starts, and what the small setting asks of it (None: left out)."""

    system: Callable
    parameter: str
    bounds: tuple[float, float]
    region: dict
    small: tuple[float, float] | None = None


def belt(**changes):
    """Return a mass on a moving belt with dry friction, driven by a load."""
    friction = bf.elements.Coulomb(0.4, belt_speed=0.6)
    return bf.System(1.0, 0.1, 1.0, (bf.elements.HarmonicForce(1.0), friction), **{"omega": 1.0, **changes})


def chain(**changes):
    """Return two masses in a row, the last one with a stop and loaded."""
    return bf.systems.impact_chain(n=2, **changes)


CASES = {
    "impact oscillator": Case(bf.systems.impact_oscillator, "omega", (0.5, 2.0), {"q0": (-3, 1), "v0": (-4, 4)}, (1.2, 1.6)),
    "two stops": Case(bf.systems.two_sided_impact_oscillator, "amplitude", (2.8, 4.2), {"q0": (-1, 1), "v0": (-3, 3)}, (3.0, 3.8)),
    "bilinear": Case(bf.systems.bilinear_oscillator, "omega", (0.5, 2.0), {"q0": (-2, 1), "v0": (-2, 2)}),
    "dry friction on a belt": Case(belt, "omega", (0.4, 2.0), {"q0": (-3, 3), "v0": (-2, 2)}),
    "two masses": Case(chain, "omega", (0.4, 1.2),
                       {"q0": (-2, 1), "q1": (-2, 1), "v0": (-2, 2), "v1": (-2, 2)}),
    "Duffing": Case(bf.systems.duffing_oscillator, "omega", (0.3, 2.0), {"q0": (-2, 2), "v0": (-2, 2)}),
}


@dataclass(frozen=True)
class Audited:
    """One system: its atlas, what it cost, what the audits saw and what of that it lacks."""

    name: str
    atlas: object
    seconds: float
    seen: int
    missed: tuple[str, ...]
    least: float
    twice: tuple[tuple[int, int], ...]


def knows(atlas, value: float, row: np.ndarray, period: int, scale: np.ndarray) -> bool:
    """Return whether an atlas holds a settled motion with the section points ``row`` (keep, ns)."""
    if period == 0:  # aperiodic, or of a period beyond what half the row shows
        return any(low <= value <= high for low, high, _ in atlas.chaos) or any(
            abs(at - value) < 0.01 * (atlas.bounds[1] - atlas.bounds[0]) for at, _ in atlas.untraced)
    for _, orbit in atlas.orbits_at(value):
        if not orbit.stable or orbit.periods != period:
            continue
        points = orbit._states(np.arange(period, dtype=float)) / scale
        image = mirrored_points(orbit)
        sets = [points] if image is None else [points, image * orbit.weights / scale]
        if any(np.linalg.norm(row[-8:, None] / scale - each[None], axis=2).min(axis=1).max() < CLOSE for each in sets):
            return True
    return False


def repeated(atlas) -> tuple[tuple[int, int], ...]:
    """Return pairs of branches of which one lies on the other."""
    middles = [branch.orbits[len(branch) // 2] for branch in atlas.branches]
    return tuple((i, k) for i, orbit in enumerate(middles) for k, other in enumerate(atlas.branches)
                 if i != k and on_branch(orbit, other))


def audited(name: str, setting: Setting, seed: int = 3) -> Audited:
    """Make the atlas of a case and audit it."""
    case = CASES[name]
    full = setting is Setting.FULL
    bounds = case.bounds if full else case.small
    options = {} if full else {"probes": 3, "checks": 2, "samples": 100, "periods": 1}
    if full:
        bf.atlas(case.system(), case.parameter, bounds, case.region, **options)
    start = time.process_time()
    atlas = bf.atlas(case.system(), case.parameter, bounds, case.region, **options)
    seconds = time.process_time() - start
    rng = np.random.default_rng(seed)
    low, high = np.array(list(case.region.values()), float).T
    seen, missed, least = 0, [], 1.0
    for value in np.sort(rng.uniform(*bounds, AUDITS[setting])).tolist():
        system = case.system(**{case.parameter: value})
        scale = Region(case.region).sizes(scene_of(system))
        rows, shares = audit(system, rng.uniform(low, high, (STARTS[setting], len(low))), scale)
        for (row, period), share in zip(rows, shares, strict=True):
            if share <= SHARE:
                continue
            seen, least = seen + 1, min(least, float(share))
            if not knows(atlas, value, row, period, scale):
                missed.append(f"{case.parameter} = {value:.6g}: {f'{period} T' if period else 'aperiodic'}, share {share:.4f}")
    return Audited(name, atlas, seconds, seen, tuple(missed), least, repeated(atlas))


def study(setting: Setting) -> list[Audited]:
    """Return all cases, audited."""
    return [audited(name, setting) for name, case in CASES.items() if setting is Setting.FULL or case.small]


def report(rows: list[Audited]) -> str:
    """Return the table, and what was missed."""
    lines = [[row.name, len(row.atlas.branches), len(row.atlas.chaos), row.seen, row.least, len(row.missed), len(row.twice),
              row.seconds, str(row.atlas.status)] for row in rows]
    text = table("Atlases against random starts", ("system", "branches", "bands of chaos", "attractors seen", "least share",
                                                   "missed", "twice", "CPU s", "status"), lines)
    return "\n".join([text, *(f"missed, {row.name}: {line}" for row in rows for line in row.missed),
                      *(f"twice, {row.name}: branches {i} and {k}" for row in rows for i, k in row.twice)])


def picture(rows: list[Audited]):
    """Draw the atlases one below the other."""
    from bifurc.plotting.style import figure
    made, axes = figure(6.3, 4.0 * len(rows), rows=len(rows))
    for row, ax in zip(rows, np.atleast_1d(axes), strict=True):
        row.atlas.plot(ax)
        ax.text(0.99, 0.98, row.name, transform=ax.transAxes, va="top", ha="right")  # an enlarged stretch stands on the left
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows = study(given.setting)
    publish(given, "atlas_audit", report(rows), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
