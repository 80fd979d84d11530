"""Time of one evaluation of harmonic balance against degrees of freedom: condensed to the touched row, and whole.

A chain between walls, n masses and springs of 1, one elastic slider on the first mass, which is pulled; 21 harmonics, exact
events.  An evaluation is residual, derivatives (by the unknowns and by omega) and one linear solution.  Three are timed: at a
new frequency with receptances from modes, the same with damping that modes do not diagonalise, and where the frequency stays
(where nothing depends on the masses but the motion and what the caches still hold).  Linear algebra runs in one thread.
"""
import os
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.elements import HarmonicForce, Jenkins
from bifurc.hbm.balance import Balance
from bifurc.hbm.condense import Condensed
from bifurc.hbm.layout import Layout, listed

from .common import Setting, interleaved, parser, publish, table

MASSES = {Setting.SMALL: (3, 10), Setting.FULL: (3, 10, 30, 100)}
WHOLE = {Setting.SMALL: 3, Setting.FULL: 10}  # most masses for which the whole balance is timed
ROUNDS = {Setting.SMALL: 3, Setting.FULL: 101}
HARMONICS = 21
OMEGA = 0.3
ASKED = 2.0  # evaluation with 100 masses over that with 3


@dataclass(frozen=True)
class Row:
    """CPU seconds of an evaluation: modal, direct, frequency kept, whole (or None); of the eigenproblem; relative agreement."""

    masses: int
    modal: float
    direct: float
    kept: float
    whole: float | None
    made: float
    agreement: float


def chain(n: int, modal: bool = True, omega: float = OMEGA):
    """Return the chain; damping is proportional to the stiffness, and one dashpot to the ground more if not modal."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.02 * np.eye(n) + 0.01 * K
    if not modal:
        C[n // 2, n // 2] += 0.1
    return bf.System(np.eye(n), C, K, [HarmonicForce(1.0), Jenkins(1.0, 0.3)], omega=omega)


def measured(n: int, rounds: int, whole: bool) -> Row:
    """Return times for one number of masses, at the solution."""
    balances = {name: Balance(chain(n, name == "modal"), Layout(listed(HARMONICS), n)) for name in ("modal", "direct")}
    condensed = {name: Condensed(balance) for name, balance in balances.items()}
    found = {name: each.solve() for name, each in condensed.items()}
    assert all(each.success for each in found.values())
    x = condensed["modal"].expand(found["modal"].u)
    load = np.abs(balances["modal"].numbers.E).max()
    turn = [0]

    def evaluation(name: str, new: bool):
        def call():
            turn[0] += new
            _, f, wide = condensed[name].linearised(found[name].u, OMEGA * (1.0 + 1e-9 * turn[0]) if new else OMEGA)
            return np.linalg.solve(wide[:, :-1], f)
        return call

    def full():
        _, f, wide = balances["modal"].linearised(x)
        return np.linalg.solve(wide[:, :-1], f)

    calls = {"modal": evaluation("modal", True), "direct": evaluation("direct", True), "kept": evaluation("modal", False),
             "made": lambda: Condensed(balances["modal"])}
    if whole:
        calls["whole"] = full
    seconds = interleaved(calls, rounds)
    residual = float(np.abs(balances["modal"].residual(x)).max() / load) if whole else float("nan")
    return Row(n, seconds["modal"], seconds["direct"], seconds["kept"], seconds.get("whole"), seconds["made"], residual)


def study(setting: Setting) -> list[Row]:
    """Return the rows of the table."""
    return [measured(n, ROUNDS[setting], n <= WHOLE[setting]) for n in MASSES[setting]]


def report(rows: list[Row]) -> str:
    """Return the table, and the ratio that was asked for."""
    lines = [(row.masses, 1e3 * row.modal, 1e3 * row.direct, 1e3 * row.kept, None if row.whole is None else 1e3 * row.whole,
              1e3 * row.made, None if row.whole is None else row.agreement) for row in rows]
    text = table(f"One evaluation with its linear solution, {HARMONICS} harmonics, one slider, ms CPU",
                 ("masses", "modal", "direct", "frequency kept", "whole balance", "made once", "residual of whole, rel."), lines)
    first, last = rows[0], rows[-1]
    return (f"{text}\n\n{last.masses} over {first.masses} masses: {last.modal / first.modal:.2f} modal (asked at 100: {ASKED:g}), "
            f"{last.kept / first.kept:.2f} where the frequency stays, {last.direct / first.direct:.1f} direct")


def picture(rows: list[Row]):
    """Return a figure: time of an evaluation against masses."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 4.0))
    n = [row.masses for row in rows]
    for name, label, marker in (("modal", "new frequency, modes", "o"), ("direct", "new frequency, factorised", "s"),
                                ("kept", "frequency kept", "^"), ("whole", "whole balance", "x")):
        pairs = [(m, 1e3 * value) for m, row in zip(n, rows, strict=True) if (value := getattr(row, name)) is not None]
        axes.loglog(*zip(*pairs, strict=True), marker=marker, label=label)
    axes.set(xlabel="masses", ylabel="ms CPU an evaluation", title=f"One slider on a chain, {HARMONICS} harmonics")
    axes.legend()
    return figure


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    options = parser(__doc__).parse_args(arguments)
    rows = study(options.setting)
    publish(options, "condensation", report(rows), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    if "OPENBLAS_NUM_THREADS" not in os.environ:  # idle threads of the linear algebra would count as CPU time, a hundredfold
        os.execve(sys.executable, [sys.executable, "-m", "studies.condensation", *sys.argv[1:]],
                  {**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    sys.exit(main())
