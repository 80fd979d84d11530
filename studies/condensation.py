"""Time of harmonic balance against degrees of freedom, condensed to the touched row and whole: an evaluation, and a branch.

A chain between walls, n masses and springs of 1, one elastic slider on the first mass, which is pulled; 21 harmonics, exact
events.  An evaluation is residual, derivatives (by the unknowns and by omega) and one linear solution, at a new frequency: with
receptances from modes; with damping that modes do not diagonalise from poles; from blocks of poles where two coincide (the last
mass stands on its own critically damped foot); from factorisations (what a single frequency gets); where a mass changes instead
of the frequency; and where the frequency stays.  A branch is `find_orbit` and `trace` in omega over a resonance, as a user calls
them, without and with the motions of all masses at all its points, and the multipliers of one orbit.  Linear algebra runs in one
thread.
"""
import os
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.continuation.balance.condensed import Along, condensed_along
from bifurc.continuation.balance.problem import path_over
from bifurc.elements import HarmonicForce, Jenkins
from bifurc.hbm.condensation.condensed import Condensed
from bifurc.orbits.balance.harmonic_orbit import relative_residual

from .common import Setting, interleaved, parser, publish, table

MASSES = {Setting.SMALL: (3, 10), Setting.FULL: (3, 10, 30, 100, 300)}
WHOLE = {Setting.SMALL: 3, Setting.FULL: 10}  # most masses for which the whole balance is timed
MULTIPLIERS = {Setting.SMALL: 3, Setting.FULL: 300}  # the same for multipliers
ROUNDS = {Setting.SMALL: 3, Setting.FULL: 51}
BRANCHES = {Setting.SMALL: 1, Setting.FULL: 3}  # times that branches are traced
HARMONICS = 21
OMEGA = 0.3
ASKED = 1.3  # evaluation with 100 masses over that with 3
WAYS = ("modes", "poles", "blocks", "mass moves", "factors")


@dataclass(frozen=True)
class Row:
    """CPU seconds of an evaluation, by way, of the whole one (or None), and of the eigenproblems; relative agreement."""

    masses: int
    seconds: dict[str, float]
    agreement: float | None


@dataclass(frozen=True)
class Course:
    """CPU seconds of a branch: finding its orbit, tracing, motions of all points, multipliers of one (or None); its points."""

    masses: int
    modal: bool
    condensed: bool
    found: float
    traced: float
    motions: float
    multipliers: float | None
    points: int


def chain(n: int, modal: bool = True, omega: float = OMEGA, critical: bool = False):
    """Return the chain; damping is proportional to the stiffness, and one dashpot to the ground more if not modal.

    ``critical``: the last mass is cut off and stands on a critically damped foot; the slider feels it by half.
    """
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.02 * np.eye(n) + 0.01 * K
    slider = Jenkins(1.0, 0.3)
    if not modal:
        C[n // 2, n // 2] += 0.1
    if critical:
        for matrix in (K, C):
            matrix[-1] = matrix[:, -1] = 0.0
            matrix[-1, -1] = 4.0
        slider = Jenkins(1.0, 0.3, row=(1.0, *np.zeros(n - 2), 0.5))
    return bf.System(np.eye(n), C, K, [HarmonicForce(1.0), slider], omega=omega)


def along(n: int, modal: bool, sweep: bool = True, critical: bool = False, name: str = "omega"):
    """Return equations along a parameter at the solution: `Condensed`, its numbers, the unknowns, the orbit, the parameter."""
    orbit = bf.find_orbit(chain(n, modal, critical=critical), method=bf.HarmonicBalance(HARMONICS, condense=True))
    value = orbit.system.parameter(name)
    path = path_over(orbit.balance, name, (0.9 * value, 1.1 * value))
    condensed = condensed_along(orbit.balance, path) if sweep else Condensed(orbit.balance, drives=True)
    return condensed, Along(condensed, path), condensed.restricted(orbit.coefficients), orbit, value


def measured(n: int, rounds: int, whole: bool) -> Row:
    """Return times for one number of masses, at the solution."""
    made = {"modes": along(n, True), "poles": along(n, False), "blocks": along(n, False, critical=True),
            "mass moves": along(n, False, name="mass[1,1]"), "factors": along(n, False, False), "kept": along(n, True)}
    turn = [0]

    def evaluation(name: str, new: bool):
        condensed, numbers, u, _, value = made[name]

        def call():
            turn[0] += new
            _, f, wide = condensed.linearised(u, numbers.at(value * (1.0 + 1e-9 * turn[0]) if new else value))
            return np.linalg.solve(wide[:, :-1], f)
        return call

    orbit = made["modes"][3]

    def full():
        _, f, wide = orbit.balance.linearised(orbit.coefficients)
        return np.linalg.solve(wide[:, :-1], f)

    # in two groups: a factorisation empties the caches that the others live in
    seconds = interleaved({name: evaluation(name, True) for name in WAYS[:-1]} | {"kept": evaluation("kept", False)}, rounds)
    seconds |= interleaved({"factors": evaluation("factors", True), **({"whole": full} if whole else {})}, rounds)
    for name in ("modes", "poles", "blocks"):  # made once
        balance = made[name][0].balance
        seconds[f"made {name}"] = interleaved({"": lambda balance=balance: Condensed(balance, True, True)}, 3)[""]
    return Row(n, seconds, relative_residual(orbit.balance, orbit.coefficients) if whole else None)


def course(n: int, modal: bool, condensed: bool, rounds: int, multipliers: bool) -> Course:
    """Return times of one branch: medians."""
    method, times = bf.HarmonicBalance(HARMONICS, condense=condensed), []
    for _ in range(rounds + 1):
        start = time.process_time()
        orbit = bf.find_orbit(chain(n, modal), method=method)
        found = time.process_time()
        branch = bf.trace(orbit, "omega", bounds=(0.9 * OMEGA, 1.1 * OMEGA))
        traced = time.process_time()
        branch.column("max_0")
        times.append((found - start, traced - found, time.process_time() - traced))
    found, traced, motions = np.median(times[1:], axis=0)
    if multipliers:
        assert branch.orbits[len(branch) // 2].multipliers is not None  # loads what is compiled
    start = time.process_time()
    if multipliers:
        assert orbit.multipliers is not None
    seconds = time.process_time() - start if multipliers else None
    return Course(n, modal, condensed, float(found), float(traced), float(motions), seconds, len(branch))


def study(setting: Setting) -> tuple[list[Row], list[Course]]:
    """Return the rows of both tables."""
    rows = [measured(n, ROUNDS[setting], n <= WHOLE[setting]) for n in MASSES[setting]]
    courses = [course(n, modal, condensed, BRANCHES[setting], condensed and n <= MULTIPLIERS[setting])
               for n in MASSES[setting] for modal in (True, False) for condensed in (True, False)
               if condensed or n <= WHOLE[setting]]
    return rows, courses


def report(found: tuple[list[Row], list[Course]]) -> str:
    """Return the tables, and the ratios that were asked for."""
    rows, courses = found
    names = (*WAYS, "kept", "whole", "made modes", "made poles", "made blocks")
    lines = [(row.masses, *(None if name not in row.seconds else 1e3 * row.seconds[name] for name in names), row.agreement)
             for row in rows]
    text = table(f"One evaluation with its linear solution, {HARMONICS} harmonics, one slider, ms CPU",
                 ("masses", *WAYS, "frequency kept", "whole balance", "modes once", "poles once", "blocks once",
                  "residual of whole, rel."), lines)
    lines = [(c.masses, "modal" if c.modal else "other", "condensed" if c.condensed else "whole", 1e3 * c.found, 1e3 * c.traced,
              c.points, 1e3 * c.traced / c.points, 1e3 * c.motions, None if c.multipliers is None else 1e3 * c.multipliers)
             for c in courses]
    text += "\n\n" + table("A branch in omega, ms CPU", ("masses", "damping", "solved", "find_orbit", "trace", "points", "a point",
                                                        "motions", "multipliers of one"), lines)
    first, last = rows[0], {row.masses: row for row in rows}.get(100, rows[-1])
    ratios = ", ".join(f"{last.seconds[name] / first.seconds[name]:.2f} {label}" for name, label in
                       (("modes", "modes"), ("poles", "poles"), ("blocks", "blocks of poles"),
                        ("mass moves", "where a mass changes"), ("kept", "where the frequency stays"), ("factors", "factorised")))
    return f"{text}\n\n{last.masses} over {first.masses} masses, an evaluation: {ratios} (asked at 100: {ASKED:g})"


def picture(found: tuple[list[Row], list[Course]]):
    """Return a figure: time of an evaluation and of a point of a branch against masses."""
    import matplotlib.pyplot as plt

    rows, courses = found
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), sharey=True)
    for name, label, marker in (("modes", "modes", "o"), ("poles", "poles (damping not modal)", "s"),
                                ("blocks", "blocks of poles (critical damping)", "p"),
                                ("mass moves", "a mass changes", "v"), ("factors", "factorised", "d"),
                                ("kept", "frequency kept", "^"), ("whole", "whole balance", "x")):
        pairs = [(row.masses, 1e3 * row.seconds[name]) for row in rows if name in row.seconds]
        left.loglog(*zip(*pairs, strict=True), marker=marker, label=label)
    for modal, condensed, label, marker in ((True, True, "condensed", "o"), (False, True, "condensed, damping not modal", "s"),
                                            (True, False, "whole balance", "x")):
        pairs = [(c.masses, 1e3 * c.traced / c.points) for c in courses if (c.modal, c.condensed) == (modal, condensed)]
        right.loglog(*zip(*pairs, strict=True), marker=marker, label=label)
    left.set(xlabel="masses", ylabel="ms CPU", title="An evaluation")
    right.set(xlabel="masses", title="A point of a branch")
    for axes in (left, right):
        axes.legend()
    figure.suptitle(f"One slider on a chain, {HARMONICS} harmonics")
    return figure


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    options = parser(__doc__).parse_args(arguments)
    found = study(options.setting)
    publish(options, "condensation", report(found), lambda: picture(found))
    return 0


if __name__ == "__main__":
    if "OPENBLAS_NUM_THREADS" not in os.environ:  # idle threads of the linear algebra would count as CPU time, a hundredfold
        os.execve(sys.executable, [sys.executable, "-m", "studies.condensation", *sys.argv[1:]],
                  {**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    sys.exit(main())
