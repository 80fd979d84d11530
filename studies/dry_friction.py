"""Dry friction by harmonic balance: Li's two cases, error against cost for 5 to 640 harmonics, random parameters.

Li (2019) balances x'' + 2 zeta x' + x + Sgn(x') = alpha sin t with N = 40 harmonics for alpha = 1.6 (slip only) and 1.4
(stick-slip) and shows the velocity over an integration. Here the same balance is solved with the set-valued law, from zero
and from the linear response, by every solver; the velocity is compared with the exact orbit (half-period map, Newton,
`tests.reference.fourier_friction`, nothing in common with the package). Truncating the exact velocity is the best N
harmonics could do; Galerkin does worse because the truncated velocity is worst where it vanishes, which is where friction
reverses. Orders are slopes of log error against log N.

The last table draws omega from .05 to 3, zeta from 0 to .2 and alpha/beta from 1.001 to 10 (logarithmically), starts from
random coefficients, and asks whether it converges and whether the error of the first harmonic is below the stated one.
"""
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.orbits.balance.method import HarmonicBalance
from tests.reference.fourier_friction import SteadyFriction

from .common import Setting, interleaved, parser, publish, table

CASES = (1.6, 1.4)
NAMES = {1.6: "slip only", 1.4: "stick-slip"}
HARMONICS = {Setting.SMALL: (5, 7, 10, 14, 20, 28, 40, 57, 80, 113, 160),
             Setting.FULL: (5, 7, 10, 14, 20, 28, 40, 57, 80, 113, 160, 226, 320, 453, 640)}
RANDOM = {Setting.SMALL: 10, Setting.FULL: 500}
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 5}
ASKED = {1.6: 8e-3, 1.4: 7.5e-3}


@dataclass(frozen=True)
class Solved:
    """One case from one start by one solver, N = 40."""

    alpha: float
    start: str
    solver: str
    status: str
    iterations: int
    evaluations: int
    seconds: float
    residual: float
    error: float


@dataclass(frozen=True)
class Cost:
    """One number of harmonics: CPU seconds, relative rms velocity error, the error of the truncated exact velocity."""

    alpha: float
    harmonics: int
    seconds: float
    error: float
    best: float
    reversals: int


@dataclass(frozen=True)
class Drawn:
    """One random case: did it converge, true and stated error of the first harmonic, its size."""

    omega: float
    zeta: float
    alpha: float
    success: bool
    seconds: float
    true: float
    stated: float
    size: float


def velocity(orbit) -> np.ndarray:
    """Return the phasors of the velocity."""
    omega = orbit.system.omega
    return np.array([1j * k * omega * orbit.harmonic(k) for k in range(orbit.layout.top + 1)])


def exact_of(orbit) -> SteadyFriction:
    """Return the exact orbit that a harmonic one leads to."""
    p = orbit.system.parameters
    return SteadyFriction(p["omega"], p["zeta"], p["amplitude"], p["friction"], start=orbit.state)


def published(setting: Setting = Setting.FULL) -> list[Solved]:
    """Return Li's cases from zero and from the linear response."""
    calls = {}
    for alpha in CASES:
        system = bf.systems.dry_friction_oscillator(amplitude=alpha)
        for solver in ("newton", "broyden"):
            method = HarmonicBalance(40, solver=solver)
            linear = method.balance(system, method.layout(1)).linear_response()
            for name, guess in (("zero", np.zeros(81)), ("linear", linear)):
                calls[alpha, name, solver] = lambda a=system, b=guess, c=method: bf.find_orbit(a, guess=b, method=c)
    seconds = interleaved(calls, ROUNDS[setting])
    rows = []
    for (alpha, name, solver), call in calls.items():
        orbit = call()
        error = exact_of(orbit).velocity_error(velocity(orbit))[0] if orbit.success else np.nan
        rows.append(Solved(alpha, name, solver, str(orbit.status), orbit.how["iterations"], orbit.how["evaluations"],
                           seconds[alpha, name, solver], orbit.residual, error))
    return rows


def costs(setting: Setting = Setting.FULL) -> list[Cost]:
    """Return error and CPU time by the number of harmonics (odd ones: the orbit is symmetric)."""
    rows = []
    for alpha in CASES:
        system = bf.systems.dry_friction_oscillator(amplitude=alpha)
        for harmonics in HARMONICS[setting]:
            method = HarmonicBalance(tuple(range(1, harmonics + 1, 2)))
            spent = []
            for _ in range(ROUNDS[setting] if harmonics <= 160 else 1):
                start = time.process_time()
                orbit = bf.find_orbit(system, method=method)
                spent.append(time.process_time() - start)
            error, best = exact_of(orbit).velocity_error(velocity(orbit))
            rows.append(Cost(alpha, harmonics, float(np.median(spent)), error if orbit.success else np.nan, best,
                             sum(map(len, orbit.how["reversals"].values()))))
    return rows


def order(rows: list[Cost], alpha: float, what: str = "error") -> float:
    """Return minus the slope of log error against log N."""
    mine = [row for row in rows if row.alpha == alpha]
    return -float(np.polyfit(np.log([row.harmonics for row in mine]), np.log([getattr(row, what) for row in mine]), 1)[0])


def drawn(setting: Setting = Setting.FULL, harmonics: int = 40, seed: int = 20190) -> list[Drawn]:
    """Return random cases."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(RANDOM[setting]):
        omega, zeta, alpha = rng.uniform(0.05, 3.0), rng.uniform(0.0, 0.2), 1.001 * (10.0 / 1.001) ** rng.uniform()
        guess = rng.normal(size=2 * harmonics + 1) * alpha / (1.0 + np.arange(2 * harmonics + 1))
        start = time.process_time()
        orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(zeta=zeta, omega=omega, amplitude=alpha), guess=guess,
                              method=HarmonicBalance(harmonics))
        seconds = time.process_time() - start
        true = stated = size = np.nan
        if orbit.success:
            exact = exact_of(orbit).integrals([1])[0]
            found = orbit.how["error of the first harmonic"]
            true, size, stated = abs(exact - orbit.harmonic(1)), abs(exact), np.inf if found is None else found[0]
        rows.append(Drawn(omega, zeta, alpha, orbit.success, seconds, true, stated, size))
    return rows


def report(solved: list[Solved], cost: list[Cost], cases: list[Drawn]) -> str:
    """Return the tables."""
    first = table("Li's cases, N = 40; velocity error is relative rms against the exact orbit",
                  ("case", "start", "solver", "status", "steps", "residuals", "CPU ms", "residual", "velocity error", "asked"),
                  [(f"{r.alpha} {NAMES[r.alpha]}", r.start, r.solver, r.status, r.iterations, r.evaluations,
                    f"{1e3 * r.seconds:.0f}", f"{r.residual:.0e}", f"{r.error:.2e}", f"{ASKED[r.alpha]:.1e}") for r in solved])
    pairs = {(r.alpha, r.harmonics): r for r in cost}
    second = table("velocity error by number of harmonics", ("N", *(f"{NAMES[a]}: {what}" for a in CASES for what in
                                                                   ("error", "best", "CPU ms", "reversals"))),
                   [(n, *(text for a in CASES for text in (f"{pairs[a, n].error:.2e}", f"{pairs[a, n].best:.2e}",
                                                           f"{1e3 * pairs[a, n].seconds:.0f}", pairs[a, n].reversals)))
                    for n in sorted({r.harmonics for r in cost})])
    orders = table("fitted orders", ("case", "Galerkin", "asked", "truncated exact velocity", "asked"),
                   [(f"{a} {NAMES[a]}", f"{order(cost, a):.2f}", "1.0 +- .1" if a == 1.6 else "1.5 +- .2",
                     f"{order(cost, a, 'best'):.2f}", "1.5 +- .1") for a in CASES])
    good = [r for r in cases if r.success]
    ratio = np.array([r.true / r.stated for r in good])
    third = table(f"{len(cases)} random cases, N = 40, random starts",
                  ("", "value", "asked"),
                  [("converged", f"{len(good)} of {len(cases)}", ">= 99 %"),
                   ("first harmonic outside the stated error", int((ratio > 1.0).sum()), "0"),
                   ("stated error infinite", sum(not np.isfinite(r.stated) for r in good), "-"),
                   ("true over stated error: median, largest", f"{np.median(ratio):.2f}, {ratio.max():.2f}", "<= 1"),
                   ("stated error over amplitude: median", f"{np.median([r.stated / r.size for r in good]):.1e}", "-"),
                   ("CPU ms: median, largest", f"{1e3 * np.median([r.seconds for r in cases]):.0f}, "
                    f"{1e3 * max(r.seconds for r in cases):.0f}", "-")])
    return "\n\n".join((first, second, orders, third))


def picture(cost: list[Cost]):
    """Return the figure: velocities of both cases over the exact ones, error against harmonics and against time."""
    from bifurc.plotting import style

    made, axes = style.figure(6.3, 5.4, columns=2, rows=2)
    for ax, alpha in zip(axes[:2], CASES, strict=True):
        orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(amplitude=alpha), method=HarmonicBalance(40))
        exact = exact_of(orbit)
        t, y = orbit.sample(1001)
        ax.axhline(0.0, color=style.BLACK, lw=0.4)
        ax.plot(t, y[:, 1], color=style.BLUE, lw=1.2, label="balance, N = 40")
        half = np.linspace(0.0, exact.half, 26)[:-1]
        v = np.zeros_like(half)
        for t0, t1, x0, v0, sign in exact.arcs:
            inside = (half >= t0) & (half < t1)
            v[inside] = exact.arc(half[inside], t0, x0, v0, sign)[1]
        ax.plot(np.concatenate([half, half + exact.half]), np.concatenate([v, -v]), ls="none", marker="*", ms=4.5, mew=0.0,
                color=style.ORANGE, label="exact")
        ax.set(xlabel="time", ylabel="velocity", title=f"load {alpha} of the limit, {NAMES[alpha]}")
        ax.set_xlim(0.0, 2.0 * exact.half)
    style.legend(axes[0])
    for alpha, colour, marker in zip(CASES, (style.GREEN, style.BLUE), "os", strict=True):
        mine = [row for row in cost if row.alpha == alpha]
        n, seconds = [row.harmonics for row in mine], [1e3 * row.seconds for row in mine]
        axes[2].loglog(n, [row.error for row in mine], color=colour, marker=marker, ms=3.5, lw=1.0,
                       label=f"{NAMES[alpha]}, order {order(cost, alpha):.2f}")
        axes[2].loglog(n, [row.best for row in mine], color=colour, ls=":", lw=1.0,
                       label=f"its best, order {order(cost, alpha, 'best'):.2f}")
        axes[3].loglog(seconds, [row.error for row in mine], color=colour, marker=marker, ms=3.5, lw=1.0)
    axes[2].set(xlabel="harmonics N", ylabel="relative velocity error")
    axes[3].set(xlabel="CPU time, ms", ylabel="relative velocity error")
    style.legend(axes[2])
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    solved, cost, cases = published(given.setting), costs(given.setting), drawn(given.setting)
    publish(given, "dry_friction", report(solved, cost, cases), lambda: picture(cost))
    return 0


if __name__ == "__main__":
    sys.exit(main())
