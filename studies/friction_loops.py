"""Hysteresis of friction contacts: Yang's three cases, rings against the continuum, a strip with its slip map.

Yang, Chu and Menq 1998; Zhao & Lin 2015, Table 2 and examples 1 and 2 (in micrometres, the total load in newtons).
"""
import sys
from typing import NamedTuple

import numpy as np

from bifurc import hysteresis, systems

from .common import Setting, parser, publish, table
from .planar_hysteresis import planar_hysteresis

BLOCKS = {Setting.SMALL: (1, 3, 15), Setting.FULL: (1, 2, 3, 5, 7, 9, 11, 13, 15, 31, 61, 121, 241)}
DRAWN = (1, 3, 5, 15)
STEPS = {Setting.SMALL: (100, 400), Setting.FULL: (40, 100, 400, 1600, 6400)}


class Yang(NamedTuple):
    """One case of Table 2."""

    case: int
    loops: object  # of both contacts
    coupled: object


class Ring(NamedTuple):
    """A ring of n blocks: energy a cycle against its closed form and the continuum."""

    n: int
    loop: object
    closed: float  # relative difference to the closed form, full slip, odd n
    continuum: float  # relative difference to infinitely many blocks
    force: float  # rms difference of the force to that of the continuum over its limit


class March(NamedTuple):
    """The same strip marched in steps: relative errors of the loop area."""

    steps: int
    explicit: float
    implicit: float


def yang() -> list[Yang]:
    """Return the three cases, 1-D contacts and coupled."""
    made = [systems.macro_slip_contact(case=case) for case in (1, 2, 3)]
    return [Yang(i + 1, hysteresis(system), planar_hysteresis(system)) for i, system in enumerate(made)]


def continuum(parameters, drive) -> np.ndarray:
    """Return the virgin force of the ring with infinitely many blocks, two bars of half the length (Menq 1986)."""
    p = parameters
    limit, per_length = p["friction"] * p["load"], p["contact"] * p["width"]
    span = 0.5 * p["length"] * np.sqrt(per_length / (p["modulus"] * p["area"]))
    U = np.asarray(drive, float) / (limit / (per_length * p["length"]))
    # slip length x from U = 1 + span x tanh(span (1 - x)) + (span x)^2 / 2, by bisection
    low, high = np.zeros_like(U), np.ones_like(U)
    for _ in range(60):
        x = 0.5 * (low + high)
        below = 1.0 + span * x * np.tanh(span * (1.0 - x)) + 0.5 * (span * x) ** 2 < U
        low, high = np.where(below, x, low), np.where(below, high, x)
    slipping = x + np.tanh(span * (1.0 - x)) / span
    return limit * np.where(U <= 1.0, U * np.tanh(span) / span, np.where(U >= 1.0 + 0.5 * span**2, 1.0, slipping))


def rings(setting: Setting) -> list[Ring]:
    """Return rings of more and more blocks, driven into full slip."""
    found = []
    for n in BLOCKS[setting]:
        system = systems.micro_slip_ring(n=n)
        p, loop = system.parameters, hysteresis(system)["ring"]
        limit = p["friction"] * p["load"]
        u_s, u_e = limit / (p["contact"] * p["width"] * p["length"]), limit * p["length"] / (8.0 * p["modulus"] * p["area"])
        area = 4.0 * limit * (p["amplitude"] - u_s - 2.0 / 3.0 * u_e * (1.0 - (1.0 / n**2 if n % 2 else 0.0)))
        fine = 4.0 * limit * (p["amplitude"] - u_s - 2.0 / 3.0 * u_e)
        t = np.linspace(0.25, 0.75, 2001) * system.period  # on the way down: Masing's curve
        force = limit - 2.0 * continuum(p, 0.5 * (p["amplitude"] - loop.displacement(t)))
        rms = float(np.sqrt(np.mean((loop.force(t) - force) ** 2))) / limit
        found.append(Ring(n, loop, loop.work / area - 1.0 if n % 2 else np.nan, loop.work / fine - 1.0, rms))
    return found


def marches(setting: Setting) -> list[March]:
    """Return errors of two incremental schemes for the strip: states taken from the step before, and solved with the step."""
    system = systems.micro_slip_strip()
    strip, loop = system.elements[0].element, hysteresis(system)["strip"]
    n, k, limits = strip.count, strip.contact, np.array(strip.limits)
    K = strip.spring * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0] = K[-1, -1] = strip.spring
    found = []
    for steps in STEPS[setting]:
        errors = []
        for implicit in (False, True):
            t = np.linspace(0.0, 2.0 * system.period, 2 * steps + 1)
            u = loop.displacement(t)
            x, w, force = np.zeros(n), np.zeros(n), np.zeros(t.size)
            slips = np.zeros(n, bool)
            for j in range(1, t.size):
                old = x.copy()
                for _ in range(50 if implicit else 1):
                    f = np.clip(k * (x - w), -limits, limits)
                    if implicit:
                        slope = k * (np.abs(k * (x - w)) < limits)
                        x[0] = u[j]
                        step = np.linalg.solve(K[1:, 1:] + np.diag(slope[1:]), K[1:] @ x + f[1:])
                        x[1:] -= step
                        if np.abs(step).max() < 1e-15 * np.abs(u).max():
                            break
                    else:  # who slips is taken from the step before
                        x[0] = u[j]
                        x[1:] = old[1:] - np.linalg.solve(K[1:, 1:] + np.diag(k * ~slips[1:]), K[1:, 0] * (u[j] - old[0]))
                trial = k * (x - w)
                f = np.clip(trial, -limits, limits)
                slips = (np.abs(trial) > limits) & (np.sign(trial) * (x - old) > 0.0)
                w = x - f / k
                force[j] = K[0] @ x + f[0]
            work = (0.5 * (force[steps + 1:] + force[steps:-1]) * np.diff(u[steps:])).sum()
            errors.append(work / loop.work - 1.0)
        found.append(March(steps, *errors))
    return found


def report(cases: list[Yang], found: list[Ring], steps: list[March]) -> str:
    """Return the tables."""
    strip = hysteresis(systems.micro_slip_strip())["strip"]
    first = table("Yang's contact: work a cycle",
                  ("case", "x", "y", "x and y coupled", "events of x", "of y", "cycles until steady"),
                  [(c.case, f"{c.loops['x'].work:.9f}", f"{abs(c.loops['y'].work):.9f}", f"{c.coupled.work:.5f}",
                    len(c.loops["x"].events), len(c.loops["y"].events),
                    max(loop.periods for loop in c.loops.loops) - 1) for c in cases])
    second = table("ring of n blocks, full slip", ("n", "work, N mm", "over closed form", "over continuum", "rms force"),
                   [(r.n, f"{r.loop.work:.9f}", "-" if np.isnan(r.closed) else f"{r.closed:.1e}", f"{r.continuum:+.2e}",
                     f"{r.force:.1e}") for r in found])
    third = table(f"strip: largest force {strip.force_max:.10f} N, work {1e3 * strip.work:.8f} mN mm",
                  ("contact", "slip, um"), [(i + 1, f"{1e3 * slip:.7f}") for i, slip in enumerate(strip.slip)])
    fourth = table("strip marched in steps: error of the loop area", ("steps a cycle", "explicit", "implicit"),
                   [(m.steps, f"{m.explicit:+.1e}", f"{m.implicit:+.1e}") for m in steps])
    return "\n\n".join((first, second, third, fourth))


def picture(cases: list[Yang], found: list[Ring]):
    """Return the figure: Yang's states and loops, ring loops, strip loop, slip map."""
    from bifurc.plotting import style
    from bifurc.plotting.motions.loops import plot_loop, plot_states
    made, axes = style.figure(7.2, 9.0, columns=3, rows=4)
    for j, case in enumerate(cases):
        for i, name in enumerate("xy"):
            plot_states(case.loops[name], axes[3 * i + j])
            axes[3 * i + j].set_title(f"case {case.case}, {name}", fontsize=8)
            if j:
                axes[3 * i + j].set_ylabel("")
        if j == 1:  # this case has every state
            handles, words = axes[1].get_legend_handles_labels()
            once = dict(zip(words, handles, strict=True))
            made.legend(once.values(), once.keys(), loc="outside upper center", ncols=5, fontsize=7.5, frameon=False)
        plot_loop(case.loops["x"], axes[6 + j], label="x")
        plot_loop(case.loops["y"], axes[6 + j], color=style.VERMILION, label="y")
        axes[6 + j].plot(*np.column_stack((case.coupled.displacement[:, 0], case.coupled.force[:, 0])).T, color=style.GREY,
                         lw=0.9, ls="--", label="x, coupled with y")
        if j == 0:
            axes[6].set_ylim(-12.0, 24.0)
            style.legend(axes[6], loc="upper left", ncols=2, fontsize=6)
    ring, strip, slip = axes[9:]
    looks = dict(zip(DRAWN, ((style.GREY, "-."), (style.ORANGE, "--"), (style.GREEN, "--"), (style.BLUE, "-")), strict=True))
    for r in found:
        if r.n in looks:
            _, u, f = r.loop.sample()
            ring.plot(1e3 * u, f, color=looks[r.n][0], ls=looks[r.n][1], lw=1.1, label=f"n = {r.n}")
    p = systems.micro_slip_ring().parameters
    grid = np.linspace(-p["amplitude"], p["amplitude"], 401)
    down = p["friction"] * p["load"] - 2.0 * continuum(p, 0.5 * (p["amplitude"] - grid))
    ring.plot(np.r_[1e3 * grid, -1e3 * grid], np.r_[down, -down], color=style.BLACK, lw=0.6, label="continuum")
    ring.set(xlabel="displacement, µm", ylabel="force, N", title="ring")
    style.legend(ring, loc="center", fontsize=6)
    loop = hysteresis(systems.micro_slip_strip())["strip"]
    _, u, f = loop.sample()
    strip.plot(1e3 * u, f, color=style.BLUE)
    strip.set(xlabel="displacement, µm", ylabel="force, N", title="strip, n = 15")
    slip.bar(np.arange(1, 16), 1e3 * loop.slip, color=style.BLUE, width=0.8)
    slip.set(xlabel="contact", ylabel="slip, peak to peak, µm", title="where the strip slips")
    for ax in (ring, strip, slip):
        ax.title.set_size(8)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    cases, found, steps = yang(), rings(given.setting), marches(given.setting)
    publish(given, "friction_loops", report(cases, found, steps), lambda: picture(cases, found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
