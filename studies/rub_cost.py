"""What a period of elastic rub and a point of its branch cost, beside Runge-Kutta steps written by hand for this rotor alone.

The orbit of the offset rotor touches twice a turn.  Steps of order four know nothing of contacts: their error after one
period falls irregularly, with about the square of the step, for the force has a kink somewhere inside a step.  The package
locates contacts and takes steps of order sixteen between them.
"""
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit

from .common import Setting, interleaved, parser, publish, table

ROUNDS = {Setting.SMALL: 1, Setting.FULL: 9}
PERIODS = {Setting.SMALL: 5, Setting.FULL: 50}
STEPS = {Setting.SMALL: (400, 1600), Setting.FULL: (200, 400, 800, 1600, 6400, 25600, 102400)}
BRANCH, STRETCH = (1.0, 1.12), {Setting.SMALL: 0.02, Setting.FULL: 0.003}  # bounds of nu, and the largest step of a long run


@njit
def runge_kutta(y, duration, steps, zeta, nu, load, stiffness, friction, slip, offset):
    """Integrate the state ``y`` (4,) in place from phase 0 by classical Runge-Kutta steps; ``slip`` is the surface speed."""
    h = duration / steps
    x, z, u, v = y
    for k in range(steps):
        dx = dz = du = dv = sx = sz = su = sv = 0.0
        for stage in range(4):
            c = 0.0 if stage == 0 else h if stage == 3 else 0.5 * h
            w = 1.0 if stage == 0 or stage == 3 else 2.0
            X, Z, U, V, t = x + c * dx, z + c * dz, u + c * du, v + c * dv, k * h + c
            ax, az = load * np.cos(nu * t) - 2.0 * zeta * U - X, load * np.sin(nu * t) - 2.0 * zeta * V - Z
            r = np.sqrt((X - offset)**2 + Z * Z)
            if r > 1.0:
                nx, nz, force = (X - offset) / r, Z / r, stiffness * (r - 1.0)
                rub = friction * force if nx * V - nz * U + slip > 0.0 else -friction * force
                ax, az = ax - force * nx + rub * nz, az - force * nz - rub * nx
            dx, dz, du, dv = U, V, ax, az
            sx, sz, su, sv = sx + w * dx, sz + w * dz, su + w * du, sv + w * dv
        x, z, u, v = x + h / 6.0 * sx, z + h / 6.0 * sz, u + h / 6.0 * su, v + h / 6.0 * sv
    y[0], y[1], y[2], y[3] = x, z, u, v


@dataclass(frozen=True)
class Costs:
    """CPU milliseconds: Runge-Kutta (steps, error after a period, time), a period, its error, branches (points, time)."""

    steps: list[tuple[int, float, float]]
    period: float
    error: float
    branches: list[tuple[int, float]]


def costs(setting: Setting) -> Costs:
    """Measure all."""
    system = bf.systems.jeffcott_rotor()
    orbit = bf.find_orbit(system)
    given = system.parameters
    constants = (given["zeta"], given["nu"], given["eccentricity"] * given["nu"]**2, given["stiffness"], given["friction"],
                 given["disk_radius"] * given["nu"], given["offset"])

    def by_hand(count):
        y = orbit.state.copy()
        runge_kutta(y, orbit.period, count, *constants)
        return y
    many = PERIODS[setting]
    calls = {f"steps {count}": lambda count=count: by_hand(count) for count in STEPS[setting]}
    calls["one"] = lambda: bf.simulate(system, orbit.state, periods=1)
    calls["many"] = lambda: bf.simulate(system, orbit.state, periods=1 + many)
    calls["branch"] = lambda: bf.trace(orbit, "nu", bounds=BRANCH)
    calls["long"] = lambda: bf.trace(orbit, "nu", bounds=BRANCH, ds_max=STRETCH[setting])
    times = interleaved(calls, ROUNDS[setting])
    steps = [(count, float(np.abs(by_hand(count) - orbit.state).max()), 1e3 * times[f"steps {count}"]) for count in STEPS[setting]]
    error = float(np.abs(bf.simulate(system, orbit.state, periods=1).final - orbit.state).max())
    branches = [(len(calls[name]()), 1e3 * times[name]) for name in ("branch", "long")]
    return Costs(steps, 1e3 * (times["many"] - times["one"]) / many, error, branches)


def report(found: Costs) -> str:
    """Return the tables."""
    lines = [[f"Runge-Kutta, {count} steps", time, error] for count, error, time in found.steps]
    (points, time), (more, longer) = found.branches
    branch = [["with set-up and its flip", points, time / points], ["in small steps", more, longer / more],
              ["a further point", more - points, (longer - time) / max(more - points, 1)]]
    return "\n\n".join([
        table("One period of elastic rub, four contacts and separations", ("by", "CPU ms", "error"),
              [*lines, ["bifurc", found.period, found.error]]),
        table("A point of its branch", ("branch", "points", "CPU ms a point"), branch)])


def picture(found: Costs):
    """Draw error over time."""
    from bifurc.plotting.style import figure
    fig, (ax,) = figure(5.2, 3.4)
    _, errors, times = zip(*found.steps, strict=True)
    ax.loglog(times, errors, "o-", label="Runge-Kutta steps by hand")
    ax.loglog([found.period], [max(found.error, 1e-16)], "s", label="bifurc, contacts located")
    ax.set_xlabel("CPU time of a period, ms")
    ax.set_ylabel("error of the state after a period")
    ax.legend(frameon=False)
    return fig


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    found = costs(given.setting)
    publish(given, "rub_cost", report(found), lambda: picture(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
