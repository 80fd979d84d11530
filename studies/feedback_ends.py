"""Stabilising gains of delayed feedback against direct simulation of the delay equation, and the basins under feedback.

Each end of an interval of `feedback_range` is bracketed by simulations alone: motions start 1e-8 to 1e-6 from the orbit, on its
past, at gains a little below and above the end.  Their distances from the orbit at whole periods, as long as they are small,
are a sum of few powers; the largest base is the growth (Prony's method, by singular values).  A third motion, at the gain where
the logarithm of the growth vanishes between the two, corrects that place: it is the end that simulation shows.
Then motions from far away,
without a past, are followed under the best gain: the share that ends on the orbit is what linear theory cannot say.
"""
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.control.linearization import places

from .common import Setting, parser, publish, table

BESIDE = 0.003  # of the gain: simulations below and above an end
PERIODS = {Setting.SMALL: 160, Setting.FULL: 400}
STARTS = {Setting.SMALL: 8, Setting.FULL: 100}
FOLLOWED = {Setting.SMALL: 150, Setting.FULL: 400}  # periods of a motion from far away
SETTLING, LEAST = 40, 40  # periods that are left out, and periods that are needed
SMALL = (1e-13, 1e-5)  # distances of linear motions, of the sizes of the states
BARE = 1e-4  # of the largest singular value: quadratic terms and rounding lie below


@dataclass(frozen=True)
class Case:
    """An unstable orbit and the feedback that is to hold it."""

    system: object
    guess: tuple
    of: str
    bounds: tuple[float, float]
    row: object = 0
    region: tuple = ((-3.0, 1.0), (-4.0, 4.0))
    samples: int = 65
    away: float = 1e-8  # first, of the sizes of the states; events on curves are known to 1e-12


def cases(setting: Setting) -> dict[str, Case]:
    """Return the cases of a setting."""
    impact = bf.systems.impact_oscillator(omega=2.5, amplitude=12.0)
    found = {"impact oscillator, displacement": Case(impact, (-4.0, 8.4), "displacement", (0.0, 0.2))}
    if setting is Setting.SMALL:
        return found
    rotor = bf.systems.jeffcott_rotor(nu=1.28)
    touching = (1.435757840528465, -0.348039325418749, 0.455604609814722, 0.667747833906096)
    return found | {
        "impact oscillator, velocity": Case(impact, (-4.0, 8.4), "velocity", (0.0, 0.8), samples=17),
        "impact oscillator, chaotic": Case(impact.with_parameters(amplitude=9.5), (-5.45, 0.0), "displacement", (0.0, 0.2)),
        "rotor that rubs, both velocities": Case(rotor, touching, "velocity", (0.0, 5.0), ((1.0, 0.0), (0.0, 1.0)),
                                                 ((-0.3, 1.5), (-0.9, 0.9), (-0.5, 0.5), (-0.5, 0.5)), away=1e-6)}


def held(case: Case, gain: float):
    """Return the system of a case with its feedback."""
    system = case.system
    feedback = [bf.elements.DelayedFeedback(gain, of=case.of, **place) for place in places(case.row)]
    return bf.System(system.mass, system.damping, system.stiffness, (*system.elements, *feedback), omega=system.omega)


def growth(case: Case, orbit, gain: float, periods: int) -> float:
    """Return the logarithm of the growth a period of a simulated motion near the orbit."""
    direction = np.random.default_rng(1).normal(size=orbit.state.size)
    motion = bf.simulate(held(case, gain), orbit.state + case.away * orbit.weights * direction, periods=periods, history=orbit)
    if not motion.success:
        raise ArithmeticError(motion.message)
    return leading((motion.sections - orbit.state) / orbit.weights)


def leading(distances) -> float:
    """Return the logarithm of the largest base of the powers that ``distances`` (K, ns) are a sum of, where they are small."""
    sizes = np.linalg.norm(distances, axis=1)
    far = np.flatnonzero((sizes > SMALL[1]) | (sizes < SMALL[0]))
    used = distances[SETTLING:far[0] if far.size else None]
    if len(used) < LEAST:
        raise ArithmeticError(f"only {len(used)} periods lie near the orbit; take a gain nearer to the end")
    depth = len(used) // 3
    rows = np.hstack([used[k:len(used) - depth + k] for k in range(depth + 1)])
    u, sizes, vt = np.linalg.svd(rows[:-1].T, full_matrices=False)
    kept = sizes > BARE * sizes[0]
    step = u[:, kept].T @ rows[1:].T @ vt[kept].T / sizes[kept]
    return float(np.log(np.abs(np.linalg.eigvals(step)).max()))


def simulated_end(case: Case, orbit, gain: float, periods: int) -> float:
    """Return the gain near ``gain`` at which simulated motions keep their distance from the orbit; NaN outside the bracket."""
    gains = [gain * (1.0 - BESIDE), gain * (1.0 + BESIDE)]
    rates = [growth(case, orbit, value, periods) for value in gains]
    if rates[0] * rates[1] > 0.0:
        return float("nan")
    gains.append(float(np.interp(0.0, *zip(*sorted(zip(rates, gains, strict=True)), strict=True))))
    rates.append(growth(case, orbit, gains[-1], periods))
    return float(np.polynomial.Polynomial.fit(rates, gains, 2)(0.0))  # the gain as a parabola of the growth


def captured(case: Case, orbit, gain: float, starts: int, periods: int) -> tuple[int, int]:
    """Return how many of some starts without a past end on the orbit under feedback, and how many motions were simulated."""
    low, high = np.array(case.region).T
    system, done, caught = held(case, gain), 0, 0
    for start in np.random.default_rng(2).uniform(low, high, (4 * starts, len(low))):
        if done == starts:
            break
        try:
            motion = bf.simulate(system, start, periods=periods)
        except ValueError:  # a start beyond the stop
            continue
        done += 1
        caught += bool(motion.success and np.abs((motion.sections[-5:] - orbit.state) / orbit.weights).max() < 1e-3)
    return caught, done


def study(setting: Setting) -> list[dict]:
    """Return what was measured, one a case."""
    rows = []
    for name, case in cases(setting).items():
        orbit = bf.find_orbit(case.system, guess=case.guess)
        found = bf.control.feedback_range(orbit, case.of, case.bounds, row=case.row, samples=case.samples)
        ends = [(end.gain, str(end.kind), simulated_end(case, orbit, end.gain, PERIODS[setting])) for end in found.ends]
        caught, done = captured(case, orbit, found.best_gain, STARTS[setting], FOLLOWED[setting])
        rows.append({"name": name, "ends": ends, "best": found.best_gain, "modulus": found.best_modulus, "caught": caught,
                     "starts": done, "found": found})
    return rows


def report(rows: list[dict]) -> str:
    """Return the tables."""
    ends = [[row["name"], kind, f"{gain:.9f}", f"{seen:.6f}", abs(seen / gain - 1.0)] for row in rows
            for gain, kind, seen in row["ends"]]
    basins = [[row["name"], row["best"], row["modulus"], row["starts"], row["caught"]] for row in rows]
    return "\n\n".join([
        table("Ends of stabilising gains", ("feedback", "kind", "feedback_range", "simulated", "relative difference"), ends),
        table("From far away, under the best gain", ("feedback", "gain", "largest modulus", "starts", "held"), basins)])


def picture(rows: list[dict]):
    """Draw growth over the gain, one axes a case."""
    from bifurc.plotting.style import figure
    made, axes = figure(5.2, 3.2 * len(rows), rows=len(rows))
    for row, ax in zip(rows, np.atleast_1d(axes), strict=True):
        row["found"].plot(ax)
        ax.set_title(row["name"])
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows = study(given.setting)
    publish(given, "feedback_ends", report(rows), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
