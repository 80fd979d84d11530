"""Many degrees of freedom in time: a period of a cantilever with a rigid stop at its tip, from rest, against its elements.

n / 2 Euler-Bernoulli elements of unit length, mass and bending stiffness in all, n degrees of freedom (deflection and
rotation), driven at the tip with the first frequency. The fastest mode is about n**2 times as fast as the first: damping is 1 % of
every mode, or proportional to the stiffness and 1 % of the first, which overdamps the fast ones. Times are CPU, the scene
built before, medians; beside it the steps that the fastest motion would ask of Taylor tables.
"""
import statistics
import sys
import time
from typing import NamedTuple

import numpy as np
import scipy.linalg

import bifurc as bf
from bifurc.compose.scene import scene_of

from .common import Setting, parser, publish, table

ELEMENTS = {Setting.SMALL: (3, 6, 10), Setting.FULL: (3, 5, 7, 10, 14, 20, 28)}
REPEATS = {Setting.SMALL: 1, Setting.FULL: 7}
MANY = 100_000  # events a period that are allowed


class Row(NamedTuple):
    """A period of one beam."""

    n: int
    damping: str
    restitution: float
    events: int
    steps: float  # of Taylor tables
    seconds: float


def matrices(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mass and stiffness (2 elements, 2 elements) of a clamped beam of unit length, mass and bending stiffness."""
    h = 1.0 / elements
    stiffness = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
                          [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    mass = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h],
                     [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420
    M, K = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        here = slice(2 * e, 2 * e + 4)
        K[here, here] += stiffness
        M[here, here] += mass
    return M[2:, 2:], K[2:, 2:]


def beam(elements: int, restitution: float = 0.7, damping: str = "modal", zeta: float = 0.01) -> bf.System:
    """Return the cantilever with a rigid stop at a distance of .1 from its tip."""
    M, K = matrices(elements)
    squares, Phi = scipy.linalg.eigh(K, M)
    w = np.sqrt(squares)
    C = M @ Phi @ np.diag(2.0 * zeta * w) @ Phi.T @ M if damping == "modal" else 2.0 * zeta / w[0] * K
    tip = len(M) - 2
    return bf.System(M, C, K, (bf.elements.HarmonicForce(1.0, dof=tip), bf.elements.RigidStop(0.1, restitution, dof=tip)),
                     omega=float(w[0]))


def measured(elements: int, damping: str, restitution: float, repeats: int) -> Row:
    """Simulate one period from rest some times."""
    system = beam(elements, restitution, damping)
    y = np.zeros(2 * system.n)
    motion = bf.simulate(system, y, periods=1, max_events=MANY)
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        bf.simulate(system, y, periods=1, max_events=MANY)
        taken.append(time.process_time() - start)
    steps = system.period / float(scene_of(system).tables.step[0])
    return Row(system.n, damping, restitution, len(motion.events), steps, statistics.median(taken))


def rows(setting: Setting) -> list[Row]:
    """Measure all beams."""
    return [measured(elements, damping, restitution, REPEATS[setting])
            for damping, restitution in (("modal", 0.7), ("modal", 0.0), ("stiffness", 0.7)) for elements in ELEMENTS[setting]]


def growth(found: list[Row]) -> float:
    """Return the fitted power of n in the time of an event."""
    n, cost = np.array([row.n for row in found]), np.array([row.seconds / max(row.events, 1) for row in found])
    return float(np.polyfit(np.log(n), np.log(cost), 1)[0])


def report(found: list[Row]) -> str:
    """Return the table."""
    lines = [(row.n, row.damping, f"{row.restitution:g}", row.events, f"{row.steps:.1e}", f"{1e3 * row.seconds:.1f}",
              f"{1e6 * row.seconds / max(row.events, 1):.1f}") for row in found]
    kinds = dict.fromkeys((row.damping, row.restitution) for row in found)
    powers = [f"{damping} damping, restitution {r:g}: time of an event grows with n to the "
              f"{growth([row for row in found if row[1:3] == (damping, r)]):.2f}" for damping, r in kinds]
    return "\n".join([table("a period of a beam with a rigid stop at its tip", ("n", "damping", "restitution", "events",
                            "steps of tables", "ms", "us an event"), lines), *powers])


def picture(found: list[Row]):
    """Return the figure: the time of a period against the degrees of freedom."""
    from bifurc.plotting import style
    made, (axes,) = style.figure(4.0, 3.0)
    for damping, r in dict.fromkeys((row.damping, row.restitution) for row in found):
        own = [row for row in found if row[1:3] == (damping, r)]
        axes.loglog([row.n for row in own], [1e3 * row.seconds for row in own], "o-", label=f"{damping}, {r:g}")
    axes.set(xlabel="degrees of freedom", ylabel="CPU time of a period, ms")
    axes.legend(title="damping, restitution")
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    found = rows(given.setting)
    publish(given, "many_degrees", report(found), lambda: picture(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
