"""What accuracy costs: event times and states after ten periods against CPU time, and grazing humps that are missed.

The impact oscillator (zeta .02, omega 2.6, amplitude 1, gap 0, restitution .8) from three states with 11, 10 and 8
impacts in ten periods, by the exact engine, by the smooth engine (a cubic spring of stiffness zero beside the linear
one makes it a scene under a law, of which nothing is closed form; its accuracy is fixed, there is no tolerance to set),
and by scipy's solve_ivp restarted at every terminal event. Errors are those against 34-digit arithmetic (`reference`).

Second table: free flights that pass the stop by 1e-2 to 1e-8 at one random grazing hump; how many are not noticed.
"""
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc._jit import njit
from bifurc.compose.scene import scene_of
from bifurc.flow.affine.engine import forcing
from bifurc.flow.scan import EVENTS, MODE, STATE, TAU, WHOLE, run, workspace

from .common import Setting, interleaved, parser, publish, table
from .reference import Oscillator

STARTS = ((-1.0, 0.5), (-0.3, 1.2), (-2.0, -1.5))
PERIODS = 10
NUMBERS = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
HUMPS = {"zeta": 0.05, "omega": 1.7, "amplitude": 0.8, "gap": 1.0, "restitution": 0.7}
DEPTHS = tuple(10.0 ** -k for k in range(2, 9))
TOLERANCES = {
    Setting.SMALL: (("RK45", 1e-6), ("DOP853", 1e-6), ("DOP853", 1e-10)),
    Setting.FULL: tuple((method, tolerance) for method, least in (("RK45", -11), ("DOP853", -13), ("LSODA", -12))
                        for tolerance in (10.0 ** k for k in range(-4, least - 1, -1))),
}
PEERS = (("RK45", 1e-6), ("DOP853", 1e-6), ("DOP853", 1e-12), ("LSODA", 1e-8))
FLIGHTS = {Setting.SMALL: (2000, 12), Setting.FULL: (100_000, 100)}  # a depth: exact engine, each integrator
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 5}


@dataclass(frozen=True)
class Cost:
    """One method at one tolerance.

    Attributes
    ----------
    method : str
    tolerance : float or None
        Relative and absolute tolerance of an integrator; the engines of the package have none to set.
    seconds : float
        CPU time of one run of ten periods.
    event_error, state_error : float
        Largest over the three runs; time of natural oscillation over 2 pi, length. NaN: the events differ in number.
    wrong : int
        Runs of the three with another number of impacts than the reference.
    """

    method: str
    tolerance: float | None
    seconds: float
    event_error: float
    state_error: float
    wrong: int


def truth(starts=STARTS):
    """Return final states (N, 2) and lists of impact times."""
    exact = Oscillator(**NUMBERS)
    found = [exact.march(q, v, 0, PERIODS * exact.period) for q, v in starts]
    return np.array([[float(q), float(v)] for q, v, _ in found]), [[float(t) for t, _ in hits] for *_, hits in found]


def systems():
    """Return the same oscillator for the exact and for the smooth engine."""
    z, w, f, gap, r = (NUMBERS[name] for name in ("zeta", "omega", "amplitude", "gap", "restitution"))
    elements = (bf.elements.HarmonicForce(f), bf.elements.RigidStop(gap, r),
                bf.elements.CubicSpring(0.0))
    return bf.systems.impact_oscillator(**NUMBERS), bf.System(1.0, 2.0 * z, 1.0, elements, omega=w)


def by_bifurc(system):
    """Return final states and impact times of the three runs."""
    states, times = [], []
    for start in STARTS:
        motion = bf.simulate(system, start, periods=PERIODS)
        states.append(motion.final)
        times.append([event.time for event in motion.events])
    return np.array(states), times


def by_scipy(method: str, tolerance: float, starts=STARTS, numbers=NUMBERS, length=None, first_only=False, t0=0.0):
    """Return final states and impact times by solve_ivp, restarted after each terminal event."""
    from scipy.integrate import solve_ivp
    z, w, f, gap, r = (numbers[name] for name in ("zeta", "omega", "amplitude", "gap", "restitution"))
    end = PERIODS * 2.0 * np.pi / w if length is None else t0 + length

    def rate(t, y):
        return y[1], f * np.cos(w * t) - y[0] - 2.0 * z * y[1]

    def wall(t, y):
        return y[0] - gap

    wall.terminal, wall.direction = True, 1.0
    states, times = [], []
    for start in starts:
        t, y, hits = t0, np.array(start, float), []
        while True:
            found = solve_ivp(rate, (t, end), y, method=method, rtol=tolerance, atol=tolerance, events=wall)
            t, y = found.t[-1], found.y[:, -1].copy()
            if found.status != 1 or first_only:
                hits += [t] * (found.status == 1)
                break
            hits.append(t)
            y[0], y[1] = gap, -r * y[1]
        states.append(y)
        times.append(hits)
    return np.array(states), times


def judged(found, right) -> tuple[float, float, int]:
    """Return the largest event error, the largest state error, and the number of runs with other events."""
    states, times = found
    wrong = sum(len(a) != len(b) for a, b in zip(times, right[1], strict=True))
    events = max((abs(a - b) for one, two in zip(times, right[1], strict=True) if len(one) == len(two)
                  for a, b in zip(one, two, strict=True)), default=np.nan)
    return float(events), float(np.abs(states - right[0]).max()), wrong


def costs(setting: Setting = Setting.FULL) -> list[Cost]:
    """Return one row a method and tolerance."""
    exact, smooth = systems()
    calls = {("exact engine", None): lambda: by_bifurc(exact), ("smooth engine", None): lambda: by_bifurc(smooth)}
    for method, tolerance in TOLERANCES[setting]:
        calls[(f"scipy {method}", tolerance)] = lambda a=method, b=tolerance: by_scipy(a, b)
    right = truth()
    seconds = interleaved(calls, ROUNDS[setting])
    return [Cost(*name, seconds[name] / len(STARTS), *judged(call(), right)) for name, call in calls.items()]


def flights(count: int, depth: float, rng: np.random.Generator):
    """Return starts (N, 3) of (time, place, speed), durations (N,) and times to the apex (N,) of flights over one hump.

    The apex lies ``depth`` beyond the stop at a random phase; the flight starts at a random time before it and ends at
    a random time after it, and stays clear of the stop except at the hump.
    """
    z, w, f, gap = (HUMPS[name] for name in ("zeta", "omega", "amplitude", "gap"))
    period, d = 2.0 * np.pi / w, np.sqrt(1.0 - z * z)
    size = (1.0 - w * w) ** 2 + (2.0 * z * w) ** 2
    a, b = f * (1.0 - w * w) / size, f * 2.0 * z * w / size

    def forced(t):
        return a * np.cos(w * t) + b * np.sin(w * t), w * (b * np.cos(w * t) - a * np.sin(w * t))

    def flown(apex, s):
        p, r = forced(apex)
        x, y = gap + depth - p, -r
        e, c, k = np.exp(-z * s), np.cos(d * s), np.sin(d * s) / d
        p, r = forced(apex + s)
        return p + e * ((c + z * k) * x + k * y), r + e * (-k * x + (c - z * k) * y)

    starts, lengths, before = [], [], []
    some = min(count, 2000)
    while len(starts) < count:
        apex = period * (1.0 + rng.random(some))
        back, on = (1.0 + 2.0 * rng.random((2, some))) * np.array([[1.0], [0.5]])
        curve = gap + depth - f * np.cos(w * apex)  # minus the acceleration at the apex
        half = np.sqrt(2.0 * depth / np.maximum(curve, 1e-3))
        grid = np.linspace(-1.0, 1.0, 401)[:, None]
        s = np.where(grid < 0.0, grid * back, grid * on)
        x = flown(apex, s)[0]
        aside = np.abs(s) > np.minimum(3.0 * half, 0.5)
        good = (curve > 0.2) & np.where(aside, x < gap - 0.5 * depth, True).all(axis=0) & (x[0] < gap - 0.02)
        place, speed = flown(apex, -back)
        starts += list(np.column_stack((apex - back, place, speed))[good])
        lengths += list((back + on)[good])
        before += list(back[good])
    return np.array(starts[:count]), np.array(lengths[:count]), np.array(before[:count])


@njit
def meets(T, mode, starts, lengths):
    """Return how many of the flights (N, 3), (N,) of a scene of one degree of freedom meet an event."""
    ints, floats = workspace(T)
    rows, record = np.zeros((0, 5), np.int64), np.zeros((0, STATE + 4))
    x = np.empty(T.A.shape[2])
    period = 2.0 * np.pi / T.flat[0]
    found = 0
    for i in range(lengths.size):
        ints[:] = 0
        floats[:] = np.nan
        ints[MODE], ints[WHOLE] = mode, int(starts[i, 0] / period)
        floats[TAU] = starts[i, 0] - ints[WHOLE] * period
        x[0], x[1] = starts[i, 1], starts[i, 2]
        forcing(T, floats[TAU], x)
        end = starts[i, 0] + lengths[i]
        whole = int(end / period)
        run(T, ints, floats, x, whole, end - whole * period, 2000, rows, record)
        found += 1 if ints[EVENTS] > 0 else 0
    return found


def missed_by_bifurc(starts, lengths) -> int:
    """Return how many humps the certified march does not notice."""
    scene = scene_of(bf.systems.impact_oscillator(**HUMPS))
    return len(starts) - meets(scene.tables, next(scene.start_modes()), starts, lengths)


def missed_by_scipy(method: str, tolerance: float, starts, lengths) -> int:
    """Return how many humps an integrator does not notice."""
    return sum(not by_scipy(method, tolerance, [start[1:]], HUMPS, length, True, start[0])[1][0]
               for start, length in zip(starts, lengths, strict=True))


@dataclass(frozen=True)
class Missed:
    """Humps of one depth that one method did not notice."""

    method: str
    depth: float
    flights: int
    missed: int


def humps(setting: Setting = Setting.FULL) -> list[Missed]:
    """Return one row a method and depth."""
    many, few = FLIGHTS[setting]
    rows = []
    for k, depth in enumerate(DEPTHS):
        starts, lengths, _ = flights(many, depth, np.random.default_rng(1000 + k))
        rows.append(Missed("exact engine", depth, many, missed_by_bifurc(starts, lengths)))
        for method, tolerance in PEERS:
            rows.append(Missed(f"scipy {method} {tolerance:.0e}", depth, few,
                               missed_by_scipy(method, tolerance, starts[:few], lengths[:few])))
    return rows


def report(rows: list[Cost], found: list[Missed]) -> str:
    """Return the tables."""
    first = table("ten forcing periods, largest error over three starts",
                  ("method", "tolerance", "CPU ms", "event time", "state", "runs with wrong events"),
                  [(r.method, None if r.tolerance is None else f"{r.tolerance:.0e}", f"{1e3 * r.seconds:.3f}",
                    "-" if np.isnan(r.event_error) else f"{r.event_error:.1e}", f"{r.state_error:.1e}", r.wrong)
                   for r in rows])
    methods = list(dict.fromkeys(r.method for r in found))
    at = {(r.method, r.depth): r for r in found}
    second = table("grazing humps missed, of how many, by depth", ("method", *(f"{depth:.0e}" for depth in DEPTHS)),
                   [(m, *(f"{at[m, depth].missed}/{at[m, depth].flights}" for depth in DEPTHS)) for m in methods])
    return f"{first}\n\n{second}"


def picture(rows: list[Cost], found: list[Missed]):
    """Return the figure: error against time, and the missed part against depth."""
    from bifurc.plotting import style
    looks = {"RK45": (style.ORANGE, "s"), "DOP853": (style.BLUE, "o"), "LSODA": (style.GREEN, "^")}
    made, (left, right) = style.figure(6.3, 3.4, columns=2)
    for name, (colour, marker) in looks.items():
        mine = [r for r in rows if r.method == f"scipy {name}"]
        left.plot([1e3 * r.seconds for r in mine], [r.state_error for r in mine], color=colour, marker=marker, ms=4,
                  lw=1.0, label=name if mine else None)
        lost = [r for r in mine if r.wrong]
        left.plot([1e3 * r.seconds for r in lost], [r.state_error for r in lost], ls="none", marker="x",
                  color=style.BLACK, ms=8, label="impact missed")
    for name, colour, marker in (("exact engine", style.VERMILION, "*"), ("smooth engine", style.PURPLE, "D")):
        mine = [r for r in rows if r.method == name]
        left.plot([1e3 * r.seconds for r in mine], [r.state_error for r in mine], lw=1.0, color=colour, marker=marker,
                  ms=9 if marker == "*" else 4, label=name)
    left.set(xscale="log", yscale="log", xlabel="CPU time of ten periods, ms", ylabel="largest error of the state")
    style.legend(left, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    for name in dict.fromkeys(r.method for r in found):
        mine = [r for r in found if r.method == name]
        short = name.removeprefix("scipy ")
        colour, marker = looks.get(short.split()[0], (style.VERMILION, "*"))
        right.plot([r.depth for r in mine], [100.0 * r.missed / r.flights for r in mine], color=colour, marker=marker,
                   ms=8 if marker == "*" else 4, lw=1.0, ls="--" if short.endswith("06") else "-", label=short,
                   clip_on=False, zorder=5)
    right.set(xscale="log", xlabel="depth of the hump, length", ylabel="humps missed, %", ylim=(0.0, 100.0))
    right.invert_xaxis()
    style.legend(right, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    rows, found = costs(given.setting), humps(given.setting)
    publish(given, "what_accuracy_costs", report(rows, found), lambda: picture(rows, found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
