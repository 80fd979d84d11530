"""Where the published Galerkin-Broyden method for dry friction converges, and Newton against Broyden where both do.

First: Li's method (2019) as published, over harmonics N and samples H, from zero, from the linear response and from a
single-harmonic guess, with the linear part and with differences as the first Jacobian, for alpha = 1.6 (slip only) and 1.4
(stick-slip). It stops on a step below 1e-8, within 400; only a small residual then counts. The publication names neither H
nor start nor first Jacobian. Fourteen pairs (N, H) stand for the grid of an earlier study by another program (9 of 84 and 0
of 84; it names five of its pairs, the others are chosen here), the full setting adds all others up to H = 2048.

Second: the oscillator with an elastic slider (zeta .01, slider stiffness 1 and limit 1, load 1), 160 frequencies from .4 to
2, each started from its neighbour, until the residual is below 1e-10: Newton with the Jacobian from the spectrum of the
stick indicator (structured), Newton with the sensitivities of all samples multiplied out (dense), Broyden from the
structured Jacobian of the neighbour, and Broyden that forms a new one at every frequency.
"""
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit
from bifurc.hbm.balance import Balance as Core
from bifurc.hbm.layout import Layout
from bifurc.hbm.setvalued.equations import Balance, Contact, Linear
from bifurc.hbm.setvalued.li2019 import FirstJacobian, Sampled, galerkin_broyden
from bifurc.solve.broyden import broyden
from bifurc.solve.newton import newton

from .common import Setting, parser, publish, table

ALPHAS = (1.6, 1.4)
PAIRS = ((5, 11), (5, 64), (10, 21), (10, 64), (10, 256), (20, 41), (20, 128), (20, 1024), (40, 81), (40, 82), (40, 128),
         (40, 256), (40, 512), (40, 2048))
MORE = {5: (12, 16, 22, 32, 128, 256, 512, 1024, 2048), 10: (22, 32, 42, 128, 512, 1024, 2048),
        20: (42, 64, 82, 164, 256, 512, 2048), 40: (160, 164, 1024)}
GRID = {Setting.SMALL: ((5, 11), (10, 21), (20, 41), (40, 81), (40, 82)),
        Setting.FULL: (*PAIRS, *((n, h) for n, hs in MORE.items() for h in hs))}
STARTS = ("zero", "linear", "one harmonic")
SIZES = {Setting.SMALL: ((7, 256),), Setting.FULL: ((7, 1024), (21, 1024), (51, 1024))}
FREQUENCIES = {Setting.SMALL: 20, Setting.FULL: 160}
RESIDUAL = 1e-10  # Euclidean, forces of order 1


def one_harmonic(balance: Balance) -> np.ndarray:
    """Return the start of a single-harmonic balance without phase iteration: friction taken from the load's amplitude.

    Each coordinate answers the load reduced by 4/pi times the friction on it; zero where friction is the larger.
    """
    layout = balance.layout
    r, Z = balance.rest(np.zeros(layout.size))
    load = -layout.matrix(r)
    friction = sum(contact.limit * np.abs(contact.row) for contact in balance.contacts)
    slot = layout.slot(layout.periods)
    size = np.hypot(load[slot], load[slot + 1])
    left = np.clip(1.0 - 4.0 / np.pi * friction / np.where(size > 0.0, size, 1.0), 0.0, None)
    reduced = np.zeros_like(load)
    reduced[slot], reduced[slot + 1] = left * load[slot], left * load[slot + 1]
    return np.linalg.solve(Z, reduced.ravel())


@dataclass(frozen=True)
class Run:
    """One run of the published method."""

    alpha: float
    harmonics: int
    samples: int
    start: str
    first: str
    status: str
    success: bool
    iterations: int
    residual: float


@dataclass(frozen=True)
class Traced:
    """One solver over all frequencies: CPU seconds, residuals (and Jacobians) computed, frequencies that failed."""

    harmonics: int
    samples: int
    solver: str
    seconds: float
    residuals: int
    jacobians: int
    failed: int
    amplitude: float


def problem(harmonics: int, samples: int, alpha: float):
    """Return the sampled residual and the starts."""
    layout = Layout(tuple(range(harmonics + 1)), 1)
    load = np.zeros(layout.size)
    load[layout.slot(1) + 1] = alpha
    linear = Linear.of(layout, 1.0, 1.0, 0.2, 1.0, load)
    balance = Balance(layout, 1.0, linear, [Contact(np.ones(1), np.ones(1, complex), -np.ones(1, complex))])
    starts = (np.zeros(layout.size), np.linalg.solve(linear.blocks, load), one_harmonic(balance))
    return Sampled(balance, samples), dict(zip(STARTS, starts, strict=True))


def failures(setting: Setting = Setting.FULL) -> list[Run]:
    """Return all runs of the published method."""
    rows = []
    for alpha in ALPHAS:
        for harmonics, samples in GRID[setting]:
            residual, starts = problem(harmonics, samples, alpha)
            for start, x0 in starts.items():
                for first in FirstJacobian:
                    found = galerkin_broyden(residual, x0, first)
                    rows.append(Run(alpha, harmonics, samples, start, first.value, str(found.status), found.success,
                                    found.iterations, found.residual))
    return rows


@njit
def multiplied_out(basis, analysis, x, stiffness, limit, force, out, sensitivity, samples_out):
    """March one Jenkins slider over two periods of samples with the sensitivities of every sample by all coefficients.

    ``basis`` (N, slots), ``analysis`` (slots, N), ``x`` (slots,); writes the coefficients of the force (slots,) into
    ``force`` and their derivative (slots, slots) into ``out``.
    """
    N, m = basis.shape
    sensitivity[:] = 0.0
    u0, f = x[0], 0.0  # relaxed at the mean
    for lap in range(2):
        for j in range(N):
            u = 0.0
            for i in range(m):
                u += basis[j, i] * x[i]
            f += stiffness * (u - u0)
            if f > limit or f < -limit:
                f = limit if f > 0.0 else -limit
                for i in range(m):
                    sensitivity[j, i] = 0.0
            else:
                for i in range(m):
                    if lap == 0 and j == 0:
                        sensitivity[j, i] = stiffness * (basis[j, i] - (1.0 if i == 0 else 0.0))
                    else:
                        before = N - 1 if j == 0 else j - 1
                        sensitivity[j, i] = sensitivity[before, i] + stiffness * (basis[j, i] - basis[before, i])
            u0 = u
            samples_out[j] = f
    force[:] = analysis @ samples_out
    out[:, :] = analysis @ sensitivity


class Dense:
    """Residual and multiplied-out Jacobian of the oscillator with an elastic slider."""

    def __init__(self, core: Core):
        layout = core.layout
        theta = 2.0 * np.pi * np.arange(core.samples) / core.samples
        self.basis = layout.basis(theta)
        self.analysis = np.ascontiguousarray(self.basis.T) * (2.0 / core.samples)
        self.analysis[0] *= 0.5
        T = core.numbers
        self.linear = Linear.of(layout, float(T.omega[0]), T.M, T.C, T.K, T.E.ravel())
        slots = layout.slots
        self.room = np.zeros(slots), np.zeros((slots, slots)), np.zeros((core.samples, slots)), np.zeros(core.samples)

    def jacobian(self, x):
        """Return the Jacobian."""
        multiplied_out(self.basis, self.analysis, np.asarray(x), 1.0, 1.0, *self.room)
        return self.linear.blocks + self.room[1]


def traced(setting: Setting = Setting.FULL) -> list[Traced]:
    """Return Newton and Broyden over the frequencies."""
    rows = []
    omegas = np.linspace(0.4, 2.0, FREQUENCIES[setting])
    for harmonics, samples in SIZES[setting]:
        layout = Layout(tuple(range(harmonics + 1)), 1)
        first = Core(bf.systems.jenkins_oscillator(omega=float(omegas[0])), layout, samples)
        cores = [first.at(bf.systems.jenkins_oscillator(omega=float(omega))) for omega in omegas]
        dense = [Dense(core) for core in cores]
        cores[0].linearised(np.zeros(layout.size))  # compiled
        dense[0].jacobian(np.zeros(layout.size))
        names = ("Newton, structured", "Newton, dense", "Broyden, neighbour's Jacobian", "Broyden, new Jacobian")
        for name in names:
            x, given = cores[0].linear_response(), None
            counts = {"residual": 0, "jacobian": 0}
            failed, top = 0, 0.0
            start = time.process_time()
            for core, other in zip(cores, dense, strict=True):
                def residual(at, core=core, counts=counts):
                    counts["residual"] += 1
                    return core.residual(at)

                def jacobian(at, core=core, other=other, name=name, counts=counts):
                    counts["jacobian"] += 1
                    return other.jacobian(at) if name.endswith("dense") else core.jacobian(at)

                if name.startswith("Newton"):
                    found = newton(residual, jacobian, x, tolerance=1e-5)  # its square is below the residual asked for
                    good = np.linalg.norm(core.residual(found.x)) <= RESIDUAL
                else:
                    if given is None or name.endswith("new Jacobian"):
                        given = jacobian(x)
                    found = broyden(residual, x, given, size=1.0, tolerance=RESIDUAL)
                    good = found.success
                    if not good:  # as in use: once more with its own Jacobian
                        given = jacobian(x)
                        found = broyden(residual, x, given, size=1.0, tolerance=RESIDUAL)
                        good = found.success
                    if name.endswith("neighbour's Jacobian") and found.iterations > 4:
                        given = jacobian(found.x)  # the chord has aged
                failed += not good
                x = found.x if good else x
                top = max(top, abs(layout.phasor(x, 1)))
            rows.append(Traced(harmonics, samples, name, time.process_time() - start, counts["residual"], counts["jacobian"],
                               failed, top))
    return rows


def converged(rows: list[Run], alpha: float, pairs) -> tuple[int, int]:
    """Return how many runs of these pairs converge, and how many there are."""
    mine = [row for row in rows if row.alpha == alpha and (row.harmonics, row.samples) in pairs]
    return sum(row.success for row in mine), len(mine)


def report(rows: list[Run], solved: list[Traced]) -> str:
    """Return the tables."""
    parts = []
    grid = list(dict.fromkeys((row.harmonics, row.samples) for row in rows))
    known_runs = {(r.alpha, r.harmonics, r.samples, r.start, r.first): r for r in rows}
    for alpha in ALPHAS:
        lines = []
        for pair in sorted(grid):
            cells = []
            for first in FirstJacobian:
                for start in STARTS:
                    row = known_runs[alpha, *pair, start, first]
                    mark = "false" if row.status == "false_convergence" else "."
                    cells.append(str(row.iterations) if row.success else mark)
            lines.append((f"{pair[0]}, {pair[1]}", *cells))
        known, of_known = converged(rows, alpha, PAIRS)
        every, of_every = converged(rows, alpha, grid)
        parts.append(table(f"published method, alpha = {alpha}: steps to convergence (. none, false: step small, residual not); "
                           f"{known} of {of_known} on the grid of fourteen, {every} of {of_every} in all",
                           ("N, H", *(f"{first.value}: {start}" for first in FirstJacobian for start in STARTS)), lines))
    count = FREQUENCIES[Setting.FULL if len(solved) > 4 else Setting.SMALL]
    parts.append(table(f"elastic slider, {count} frequencies",
                       ("H", "samples", "solver", "CPU ms", "residuals", "Jacobians", "failed"),
                       [(r.harmonics, r.samples, r.solver, f"{1e3 * r.seconds:.0f}", r.residuals, r.jacobians, r.failed)
                        for r in solved]))
    return "\n\n".join(parts)


def picture(rows: list[Run]):
    """Return the figure: for each case the part of six runs that converges, by harmonics and samples."""
    from bifurc.plotting import style

    made, axes = style.figure(6.3, 3.0, columns=2)
    levels = sorted({row.harmonics for row in rows})
    for ax, alpha in zip(axes, ALPHAS, strict=True):
        mine = [row for row in rows if row.alpha == alpha]
        for pair in sorted({(row.harmonics, row.samples) for row in mine}):
            good = sum(row.success for row in mine if (row.harmonics, row.samples) == pair)
            place = pair[1], levels.index(pair[0])
            ax.plot(*place, marker="o", ls="none", ms=3.5, mfc="none", mec=style.GREY, mew=0.7)
            if good:
                ax.plot(*place, marker="o", ls="none", ms=8, mew=0.0, color=style.BLUE, zorder=3)
                ax.annotate(str(good), place, color="white", ha="center", va="center", fontsize=6, zorder=4)
        total = sum(row.success for row in mine)
        ax.set_xscale("log", base=2)
        ax.set(xlabel="samples H", title=f"load {alpha} of the limit: {total} of {len(mine)} runs")
        ax.set_yticks(range(len(levels)), [str(n) for n in levels])
        ax.tick_params(axis="y", which="minor", left=False, right=False)
        ax.set_ylim(-0.6, len(levels) - 0.4)
    axes[0].set_ylabel("harmonics N")
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows, solved = failures(given.setting), traced(given.setting)
    publish(given, "broyden_map", report(rows, solved), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
