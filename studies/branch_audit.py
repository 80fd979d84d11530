"""Random scenes with stops, friction, sliders, belts and clearances, one parameter of each traced: what of it is no motion?

Every row is simulated again over its period; every branch is traced back from its last rows, and from rows drawn among the others,
also where these lie on a boundary of their event sequence. Columns: rows that simulation does not repeat, rows that are not
admissible, ends that are no bounds, loops or physical ends, special points that are found in one direction of travel only, starts
from which the branch is refused, not the same or not explained.
"""
import time
from dataclasses import dataclass, field

import numpy as np

import bifurc as bf
from bifurc.continuation.kinds import ContinuationError, StopReason
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.repetition import repetition

from .common import Setting, parser, publish, table

SCENES = {Setting.SMALL: 1, Setting.FULL: 56}  # of each kind
STARTS = 2  # rows drawn, from which a branch is traced once more
MAX_STEPS = 250
PHYSICAL = (StopReason.BOUND, StopReason.CLOSED, StopReason.MAX_STEPS, StopReason.MERGED, StopReason.CHATTERING,
            StopReason.JUMP, StopReason.STICKING, StopReason.CYCLE_END, StopReason.SHRUNK)
SAME = 1e-6  # of the width of the bounds: two locations of one special point
ACCUMULATION = 1e-4  # of the width of the bounds: so near to a chattering end nothing is compared, and nothing traced back
BLURRED = (StopReason.CHATTERING, StopReason.STICKING)  # ends towards which digits are lost: a slip that falls to nothing is a root
# of third order in its duration
GEOMETRIC = 0.05  # ratios of successive differences that are one


def between(rng, low, high):
    """Return a number of three digits, log-uniform where both are positive."""
    value = np.exp(rng.uniform(np.log(low), np.log(high))) if low > 0.0 else rng.uniform(low, high)
    return float(f"{value:.3g}")


def one_stop(rng):
    """One mass, a rigid stop with a gap of any sign."""
    stop = RigidStop(between(rng, -0.6, 1.2), between(rng, 0.0, 0.95) if rng.random() < 0.85 else 0.0)
    return bf.System(1.0, between(rng, 0.02, 0.4), 1.0, [HarmonicForce(between(rng, 0.2, 3.0)), stop], omega=between(rng, 0.4, 3.0))


def two_stops(rng):
    """One mass between two rigid stops."""
    r = between(rng, 0.1, 0.95)
    gap = between(rng, 0.2, 1.5)
    other = gap if rng.random() < 0.4 else between(rng, 0.2, 1.5)
    return bf.System(1.0, between(rng, 0.02, 0.4), 1.0, [HarmonicForce(between(rng, 0.3, 3.0)), RigidStop(gap, r),
                                                        RigidStop(other, r, side=-1)], omega=between(rng, 0.4, 3.0))


def elastic_stop(rng):
    """One mass, an elastic stop of ratio 2 to 200."""
    damping = between(rng, 0.0, 0.3) if rng.random() < 0.3 else 0.0
    stop = ElasticStop(between(rng, -0.3, 1.0), between(rng, 2.0, 200.0), damping=damping)
    return bf.System(1.0, between(rng, 0.03, 0.4), 1.0, [HarmonicForce(between(rng, 0.2, 2.0)), stop], omega=between(rng, 0.4, 3.0))


def stop_and_friction(rng):
    """One mass with a rigid stop and dry friction."""
    stop = RigidStop(between(rng, 0.1, 1.0), between(rng, 0.1, 0.95))
    return bf.System(1.0, between(rng, 0.02, 0.2), 1.0, [HarmonicForce(1.0), stop, Coulomb(between(rng, 0.01, 0.4))],
                     omega=between(rng, 0.4, 3.0))


def belt(rng):
    """One mass on a moving belt."""
    return bf.System(1.0, between(rng, 0.02, 0.2), 1.0, [HarmonicForce(between(rng, 0.3, 1.5)), Coulomb(
        between(rng, 0.1, 0.9), belt_speed=between(rng, 0.05, 1.0), static_ratio=1.0 if rng.random() < 0.6 else 1.3)],
        omega=between(rng, 0.4, 3.0))


def two_masses(rng):
    """Two masses; one hits a rigid stop, the other rubs."""
    k = between(rng, 0.3, 2.0)
    K = [[1.0 + k, -k], [-k, 1.0 + k]]
    C = (0.06 * np.array(K)).round(4).tolist()
    return bf.System(np.diag([1.0, between(rng, 0.5, 2.0)]), C, K, [
        HarmonicForce(between(rng, 0.5, 2.0)), RigidStop(between(rng, 0.1, 1.0), between(rng, 0.0, 0.9)),
        Coulomb(between(rng, 0.05, 0.8), dof=1)], omega=between(rng, 0.5, 2.5))


def clearances(rng):
    """Three masses, two elastic clearances between them, dry friction on the last."""
    K = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]
    C = (0.05 * np.array(K)).tolist()
    s = between(rng, 2.0, 50.0)
    return bf.System(np.eye(3), C, K, [
        HarmonicForce(between(rng, 0.3, 1.5)), ElasticStop(between(rng, 0.2, 1.0), s, row=(1.0, -1.0, 0.0)),
        ElasticStop(between(rng, 0.2, 1.0), s, row=(0.0, 1.0, -1.0)), Coulomb(between(rng, 0.02, 0.3), dof=2)],
        omega=between(rng, 0.5, 2.2))


def stop_and_slider(rng):
    """One mass with a rigid stop and an elastic slider."""
    return bf.System(1.0, between(rng, 0.02, 0.2), 1.0, [
        HarmonicForce(between(rng, 0.3, 2.0)), RigidStop(between(rng, 0.2, 1.5), between(rng, 0.1, 0.9)),
        Jenkins(between(rng, 0.3, 3.0), between(rng, 0.05, 0.6))], omega=between(rng, 0.5, 2.8))


def between_masses(rng):
    """Two masses with rigid stops between them, on both sides."""
    k = between(rng, 0.3, 2.0)
    return bf.System(np.diag([1.0, between(rng, 0.3, 2.0)]), [[0.1, -0.03], [-0.03, 0.08]], [[1.0 + k, -k], [-k, 1.0 + k]], [
        HarmonicForce(between(rng, 0.4, 1.5)), RigidStop(between(rng, 0.1, 0.8), between(rng, 0.1, 0.9), row=(1.0, -1.0)),
        RigidStop(between(rng, 0.1, 0.8), between(rng, 0.1, 0.9), row=(-1.0, 1.0))], omega=between(rng, 0.5, 2.5))


def any_contact(rng, n):
    """Contacts of one kind, drawn, on a mass or between two."""
    where: dict = {"dof": int(rng.integers(n))}
    if n > 1 and rng.random() < 0.3:
        row = np.zeros(n)
        row[rng.choice(n, 2, replace=False)] = 1.0, -1.0
        where = {"row": tuple(row.tolist())}
    gap, r, friction = between(rng, 0.1, 1.2), between(rng, 0.05, 0.9), between(rng, 0.02, 0.5)
    drawn = ([RigidStop(gap, r, **where)], [RigidStop(gap, r, **where), RigidStop(between(rng, 0.1, 1.2), r, side=-1, **where)],
             [ElasticStop(gap, between(rng, 2.0, 100.0), **where)], [Coulomb(friction, **where)],
             [Coulomb(friction, static_ratio=1.3, **where)], [Coulomb(friction, belt_speed=between(rng, 0.05, 0.8), **where)],
             [Jenkins(between(rng, 0.3, 3.0), between(rng, 0.05, 0.6), **where)])
    return drawn[int(rng.integers(len(drawn)))]


def mixed(rng):
    """One to three masses, most with a full mass matrix, one to three contacts of any kind."""
    n = int(rng.integers(1, 4))
    A, k = 0.3 * rng.normal(size=(n, n)), rng.uniform(0.3, 2.0, n + 1)
    M = 1.2 * np.eye(n) + A @ A.T if rng.random() < 0.6 else np.diag(rng.uniform(0.5, 2.0, n))
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    C = rng.uniform(0.03, 0.12) * K + rng.uniform(0.0, 0.05) * M
    contacts = [contact for _ in range(int(rng.integers(1, 4))) for contact in any_contact(rng, n)]
    return bf.System(*(X.round(4).tolist() for X in (M, C, K)), [
        HarmonicForce(between(rng, 0.3, 2.0), dof=int(rng.integers(n))), *contacts], omega=between(rng, 0.4, 2.6))


KINDS = {f.__name__: f for f in (one_stop, two_stops, elastic_stop, stop_and_friction, belt, two_masses, clearances,
                                 stop_and_slider, between_masses, mixed)}
WIDTHS = {"omega": 0.3, "amplitude": 0.5, "gap": 0.4, "restitution": 0.25, "friction": 0.5, "stiffness": 0.5, "limit": 0.5}


def parameter_of(rng, system):
    """Return the name of a parameter and bounds round its value."""
    names = [name for name in system.parameters if name == "omega" or name.rsplit(".", 1)[-1] in WIDTHS]
    name = names[int(rng.integers(len(names)))]
    short = name.rsplit(".", 1)[-1]
    value = system.parameter(name)
    width = WIDTHS[short] * (max(abs(value), 0.2) if short != "restitution" else 1.0)
    low, high = value - width, value + width
    if short == "restitution":
        low, high = max(low, 0.0), min(high, 0.99)
    if short in ("friction", "stiffness", "limit"):
        low = max(low, 1e-3)
    return name, (low, high)


@dataclass
class Audited:
    """One branch of one scene.

    Attributes
    ----------
    kind, number : str, int
        Kind of scene and seed in it.
    parameter : str
    rows : int
    not_repeated, failed : int
        Rows that simulation does not repeat; rows with ``success`` False.
    ends : list of str
        What is said at ends that are no bounds, loops or `max_steps`.
    one_way : list of str
        Special points that are found in one direction only.
    starts : list of str
        What is different from drawn rows of the branch.
    unexplained : bool
        Whether the branch's own audit says so.
    seconds : float
        CPU time.
    """

    kind: str
    number: int
    parameter: str
    rows: int = 0
    not_repeated: int = 0
    failed: int = 0
    ends: list = field(default_factory=list)
    one_way: list = field(default_factory=list)
    starts: list = field(default_factory=list)
    found: bool = True
    ok: bool = True
    seconds: float = 0.0
    bad: list = field(default_factory=list)


def scene(kind: str, number: int):
    """Return the system, the parameter and its bounds of a scene."""
    rng = np.random.default_rng([number, list(KINDS).index(kind)])
    system = KINDS[kind](rng)
    return system, *parameter_of(rng, system)


def audited(kind: str, number: int, back: bool = True, drawn: bool = True) -> Audited:
    """Trace one scene and judge every row, end and special point; also ``back`` from its ends, and from ``drawn`` rows."""
    system, name, bounds = scene(kind, number)
    row = Audited(kind, number, name)
    clock = time.process_time()
    orbit = bf.find_orbit(system)
    row.found = orbit.success
    if orbit.success:
        branch = bf.trace(orbit, name, bounds=bounds, max_steps=MAX_STEPS)
        judge_rows(branch, row)
        row.ends = [repr(end) for end in branch.ends if end.reason not in PHYSICAL]
        row.ok = branch.audit.ok
        if back:
            row.one_way = one_way(branch, name, bounds)
        if back and drawn:
            row.starts = other_starts(branch, name, bounds, np.random.default_rng(number))
    row.seconds = time.process_time() - clock
    return row


def judge_rows(branch, row: Audited) -> None:
    """Count the rows that are no motions."""
    values = branch.column(branch.parameter)
    row.rows = len(branch)
    edges = {float(point.s) for point in branch.special_points}
    for value, s, orbit in zip(values, branch.column("s"), branch.orbits, strict=True):
        if min((abs(s - edge) for edge in edges), default=1.0) < 1e-9:
            continue  # on a boundary itself both sides are right
        if not orbit.success:
            row.failed += 1
            row.bad.append((float(value), "status", orbit.status.value))
        else:
            again = repetition(orbit)
            if not again.repeated:
                row.not_repeated += 1
                row.bad.append((float(value), again.miss, again.message[:80]))


def one_way(branch, name, bounds) -> list:
    """Return the special points that a trace back from an end does not find, or finds alone."""
    found = []
    for end in (0, -1):
        other = back_from(branch, end, name, bounds)
        if other is None:
            continue
        found += differences(branch, other, bounds, end)
    return found


def back_from(branch, end, name, bounds):
    """Return the branch traced from its own row next to an end, or None if that is no orbit."""
    if len(branch) < 6 or branch.closed:
        return None
    s = branch.column("s")
    periods = branch.orbits[int(np.argmin(np.abs(s)))].periods
    edges = np.array([*(point.s for point in branch.special_points), s[0], s[-1]])
    p, near = branch.column(name), ACCUMULATION * abs(bounds[1] - bounds[0])
    far = np.all([abs(p - e.p) >= near for e in branch.ends if e.reason in BLURRED] or [p == p], axis=0)
    row = next((k for k in (range(2, len(branch)) if end == 0 else range(len(branch) - 3, 0, -1))
                if far[k] and s[k - 1] < s[k] < s[k + 1] and np.abs(edges - s[k]).min() > 1e-6
                and branch.orbits[k].periods == periods), None)
    if row is None:
        return None
    orbit = branch.orbits[row]
    return bf.trace(orbit, name, bounds=bounds, max_steps=2 * MAX_STEPS) if orbit.success else None


def other_starts(branch, name, bounds, rng, count=STARTS) -> list:
    """Return what is different where a branch is traced from drawn rows of its own, with the period of its start."""
    s, p, width = branch.column("s"), branch.column(name), abs(bounds[1] - bounds[0])
    periods = branch.orbits[int(np.argmin(np.abs(s)))].periods
    far = np.all([abs(p - e.p) >= ACCUMULATION * width for e in branch.ends if e.reason in BLURRED] or [p == p], axis=0)
    rows = [k for k in rng.permutation(np.flatnonzero(far)).tolist()
            if branch.orbits[k].success and branch.orbits[k].periods == periods]
    found = []
    for k in rows[:count]:
        try:
            other = bf.trace(branch.orbits[k], name, bounds=bounds, max_steps=2 * MAX_STEPS)
        except ContinuationError as error:
            found.append(f"row {k}: {error}")
            continue
        unlike = differences(branch, other, bounds, 0)
        if unlike or not other.audit.ok:
            found.append(f"row {k}: {unlike[:3]} audit {'ok' if other.audit.ok else other.audit!r}")
    return found


def differences(branch, other, bounds, end) -> list:
    """Return points of one branch that the other lacks."""
    width = abs(bounds[1] - bounds[0])
    short = StopReason.MAX_STEPS in (*branch.stop_reason, *other.stop_reason)
    if short:
        return []
    mine, theirs = listed(branch, other, width), listed(other, branch, width)
    side = "low" if end == 0 else "high"
    return ([f"{kind} {value:.9g} not from {side} s" for kind, value in unmatched(mine, theirs, width)]
            + [f"{kind} {value:.9g} only from {side} s" for kind, value in unmatched(theirs, mine, width)])


def listed(branch, other, width):
    """Return kind and parameter of the special points of a branch, without those so near to a chattering end, or to where
    another event meets the end of a complete chattering: there are infinitely many, and how many of them are resolved is chance;
    and without those that are one with another physical end."""
    ends = [(end.p, ACCUMULATION if end.reason is StopReason.CHATTERING else SAME) for end in (*branch.ends, *other.ends)
            if end.reason is not StopReason.BOUND]
    for one in (branch, other):
        exchanges = [p.parameter for p in one.special_points if "rigid_stop.impact..." in p.after]
        ends += [(limit, ACCUMULATION) for way in (exchanges, exchanges[::-1]) for limit in limits(way)]
    return [(p.kind.value, p.parameter) for p in branch.special_points
            if all(abs(p.parameter - end) >= near * width for end, near in ends)]


def limits(values) -> list[float]:
    """Return where numbers, in their order, accumulate: the limits of geometric sequences of five of them in a row, or of every
    second one: an event that impacts overtake is exchanged with each of them twice, before it and behind.

    Examples
    --------
    >>> [round(limit, 9) for limit in limits([2.0, 0.9, 1.0 + 0.3**2, 1.0 + 0.3**3, 1.0 + 0.3**4, 1.0 + 0.3**5, 1.0 + 0.3**6])]
    [1.0]
    >>> [round(limit, 9) for limit in limits([1.0 + part * 0.3**k for k in range(5) for part in (2.0, 1.7)])]
    [1.0, 1.0]
    """
    found = []
    for numbers in (values, values[::2], values[1::2]):
        steps = np.diff(numbers)
        for i in range(len(steps) - 3):
            ratios = steps[i + 1:i + 4] / steps[i:i + 3]
            if 0.0 < ratios.min() and ratios.max() < min(0.9, (1.0 + GEOMETRIC) * ratios.min()):
                found.append(float(numbers[i + 4] + steps[i + 3] * ratios[2] / (1.0 - ratios[2])))
    return found


def unmatched(points, others, width):
    """Return the points without one of the same kind so near that the two are one."""
    found = [(kind, value) for kind, value in points
             if not any(other == kind and abs(there - value) < SAME * width for other, there in others)]
    return found


def study(setting: Setting) -> list[Audited]:
    """Return the audited scenes."""
    return [audited(kind, number) for kind in KINDS for number in range(SCENES[setting])]


def report(rows) -> str:
    """Return the table by kind of scene."""
    lines = []
    for kind in (*KINDS, "all"):
        mine = [row for row in rows if kind in (row.kind, "all")]
        traced = [row for row in mine if row.found]
        lines.append([kind, len(mine), len(traced), sum(row.rows for row in mine), sum(row.not_repeated for row in mine),
                      sum(row.failed for row in mine), 2 * len(traced), sum(len(row.ends) for row in mine),
                      sum(len(row.one_way) for row in mine), sum(len(row.starts) for row in mine),
                      sum(not row.ok for row in mine)])
    return table("Random scenes, one parameter traced each", ["scene", "scenes", "traced", "rows", "not repeated", "no success",
                                                           "ends", "unexplained", "one way only", "other starts",
                                                           "audit not ok"], lines)


def picture(rows):
    """Draw what is wrong by kind of scene."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes = figure.subplots()
    names = list(KINDS)
    share = [100.0 * sum(row.not_repeated + row.failed for row in rows if row.kind == kind)
             / max(sum(row.rows for row in rows if row.kind == kind), 1) for kind in names]
    axes.bar([name.replace("_", "\n") for name in names], share)
    axes.set_ylabel("rows that are no motion, %")
    return figure


def main() -> None:
    """Run the study."""
    arguments = parser(__doc__).parse_args()
    rows = study(arguments.setting)
    publish(arguments, "branch_audit", report(rows), lambda: picture(rows))


if __name__ == "__main__":
    main()
