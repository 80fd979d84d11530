"""Random scenes of extreme numbers, simulated and compared with a second event-driven integrator: what differs, is slow, raises?

One to four masses, rigid and elastic stops, dry friction (static above kinetic too), elastic sliders; ratios of masses,
stiffnesses, damping and loads over many orders, gaps that are zero, starts that touch, units of any size. Columns: scenes that
agree, that differ, take longer than a minute, raise or end before their end, gain energy where none comes in, pass a stop; and
those that the reference leaves open. States are compared up to where a change of the coefficients by 1e-13 is seen.
"""
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop

from .common import Setting, parser, publish, table
from .event_driven import TOO_MANY, Contact, Integrator, Motion, Scene, Undecided

SCENES = {Setting.SMALL: 12, Setting.FULL: 50}  # from ``--first`` on
PERIODS = 3.0
STEPS = 6000  # of the reference: a stiff scene is followed for less than its periods
TIMES = 30  # at which states are compared
SHAKE = 1e-13  # relative: rounding of an engine that computes in doubles, and its tolerances
UNSURE = 1e-3  # of the largest state: where shaken motions differ by more the comparison ends
FLOOR = 1e-10  # of the largest state: always allowed (half a million steps of a stiff scene round to 1e-11)
FACTOR = 30.0  # times the difference of shaken motions: allowed
SLOW = 60.0  # CPU seconds
VERDICTS = ("agrees", "differs", "slow", "exception", "gains energy", "passes a stop", "open")


def size(rng, decades):
    """Return 1, or a number log-uniform over so many decades both ways."""
    return float(10.0 ** rng.uniform(-decades, decades)) if rng.random() < 0.6 else 1.0


def rows_of(rng, n, count):
    """Return independent rows: coordinates and differences of neighbours, without a loop."""
    found, used = [], list(range(n))
    for k in rng.permutation(n)[:count].tolist():
        row = np.zeros(n)
        row[k] = 1.0
        if k > 0 and rng.random() < 0.35:
            row[k - 1] = -1.0
        found.append(tuple(row.tolist()))
    assert used
    return found


def drawn(seed: int) -> Scene:
    """Return a scene."""
    rng = np.random.default_rng([seed, 43])
    n = int(rng.integers(1, 5))
    spread = float(rng.choice([0.0, 1.0, 3.0, 6.0]))
    m = 10.0 ** rng.uniform(-spread, spread, n) if n > 1 else np.array([size(rng, spread)])
    k = 10.0 ** rng.uniform(-spread * 4 / 3, spread * 4 / 3, n + 1) * (rng.random(n + 1) < 0.85)
    k[-1] *= rng.random() < 0.4
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    M = np.diag(m)
    if n > 1 and rng.random() < 0.3:
        A = 0.4 * rng.normal(size=(n, n))
        M = np.sqrt(np.outer(m, m)) * (np.eye(n) + A @ A.T)
    rate = np.sqrt(max(np.max(np.diag(K) / np.diag(M)), 1e-300))
    zeta = float(rng.choice([0.0, 0.0, 0.02, 0.5, 10.0 ** rng.uniform(-3, 2)]))
    C = 2.0 * zeta * (K / rate if rng.random() < 0.5 else M * rate)
    omega = size(rng, 3) * (rate if rng.random() < 0.5 and rate > 1e-4 else 1.0)
    amplitude = np.zeros(n)
    constant = np.zeros(n)
    if rng.random() < 0.85:
        amplitude[int(rng.integers(n))] = size(rng, 6)
    if rng.random() < 0.4:
        constant[int(rng.integers(n))] = float(rng.choice([-1, 1])) * size(rng, 3)
    load = max(amplitude.max(), np.abs(constant).max(), 1e-6)
    reach = load / max(np.min(m) * omega**2, 1e-300) if amplitude.any() else load / max(np.max(np.diag(K)), 1e-3)
    contacts = []
    for row in rows_of(rng, n, int(rng.integers(1, n + 1))):
        for _ in range(int(rng.integers(1, 3))):
            contacts += contacts_of(rng, row, reach, load, float(np.max(k)) or 1.0)
    q, v = np.zeros(n), np.zeros(n)
    if rng.random() < 0.6:
        v = rng.uniform(-1, 1, n) * reach * omega * (rng.random(n) < 0.7)
    return Scene(M, C, K, omega, amplitude, rng.uniform(-3, 3, n) * (rng.random() < 0.7), constant, tuple(contacts), q, v)


def contacts_of(rng, row, reach, load, stiff):
    """Return one contact, or the two walls of a clearance."""
    kind = rng.random()
    gap = 0.0 if rng.random() < 0.35 else reach * 10.0 ** rng.uniform(-3.0, 0.3)
    side = int(rng.choice([-1, 1]))
    if kind < 0.45:
        r = float(rng.choice([0.0, 1.0, rng.uniform(0.05, 0.95), rng.uniform(0.05, 0.95)]))
        found = [Contact("rigid", row, side, gap, restitution=r)]
        if rng.random() < 0.3:
            found.append(Contact("rigid", row, -side, max(gap, reach * size(rng, 2)), restitution=float(rng.uniform(0.0, 0.95))))
        return found
    if kind < 0.62:
        k = stiff * 10.0 ** rng.uniform(-3, 5)
        return [Contact("elastic", row, side, gap, stiffness=k, damping=0.0 if rng.random() < 0.5 else 1e-3 * np.sqrt(k))]
    if kind < 0.82:
        return [Contact("dry", row, friction=load * size(rng, 2) * 0.3, static=1.0 if rng.random() < 0.6 else 1.4)]
    return [Contact("slider", row, stiffness=stiff * size(rng, 3), friction=load * size(rng, 2) * 0.3)]


def tidy(scene: Scene) -> Scene:
    """Return the scene with one friction and one slider a row."""
    seen, kept = set(), []
    for c in scene.contacts:
        key = (c.kind, c.row, c.side if c.kind == "rigid" else 0)
        if key not in seen:
            kept.append(c)
            seen.add(key)
    return Scene(**{**vars(scene), "contacts": tuple(kept)})


def scene(seed: int) -> tuple[Scene, tuple[float, float, float]]:
    """Return a scene and the units in which the package is given it: mass, length, time."""
    rng = np.random.default_rng([seed, 44])
    units = tuple(2.0 ** round(np.log2(size(rng, 9))) for _ in range(3)) if rng.random() < 0.4 else (1.0, 1.0, 1.0)
    return tidy(drawn(seed)), units


def system_of(s: Scene, units) -> bf.System:
    """Return the scene as a system of the package."""
    mass, length, span = units
    force, stiff, damp = mass * length / span**2, mass / span**2, mass / span
    parts: list = []
    for dof in range(len(s.M)):
        if s.amplitude[dof]:
            parts.append(HarmonicForce(s.amplitude[dof] * force, phase=s.phase[dof], dof=dof))
        if s.constant[dof]:
            parts.append(ConstantForce(s.constant[dof] * force, dof=dof))
    for c in s.contacts:
        if c.kind == "rigid":
            parts.append(RigidStop(c.gap * length, c.restitution, side=c.side, row=c.row))
        elif c.kind == "elastic":
            parts.append(ElasticStop(c.gap * length, c.stiffness * stiff, c.damping * damp, side=c.side, row=c.row))
        elif c.kind == "dry":
            parts.append(Coulomb(c.friction * force, static_ratio=c.static, row=c.row))
        else:
            parts.append(Jenkins(c.stiffness * stiff, c.friction * force, row=c.row))
    omega = s.omega / span if s.amplitude.any() else None
    return bf.System(s.M * mass, s.C * damp, s.K * stiff, parts, **({} if omega is None else {"omega": omega}))


@dataclass
class Compared:
    """One scene: verdict, and what is behind it."""

    seed: int
    verdict: str = "agrees"
    why: str = ""
    compared: int = 0  # times at which states were compared
    worst: float = 0.0  # difference over what is allowed
    events: int = 0
    seconds: float = 0.0
    contacts: str = ""


def followed(s: Scene, times):
    """Return the states of the reference at times, as far as it has an answer, what speeds that it took for rest or rounded, and
    places that it put on a wall, may change in each, why it has no answer, and the number of its events."""
    found: list = []
    ignored: list = []
    motion = None
    try:
        motion = Motion(s)
        reach = np.linalg.norm(motion.I.low, axis=0)
        for t in times:
            motion.to(t)
            found.append(motion.y)
            speeds = (motion.ignored + motion.rounding + motion.moved) * reach
            ignored.append(np.concatenate([speeds * t + motion.moved * reach, speeds / motion.I.unit]))
    except Undecided as error:
        return np.array(found), np.array(ignored, float), str(error), motion.events if motion else 0
    return np.array(found), np.array(ignored, float), "", motion.events


def compared(seed: int) -> Compared:
    """Return the verdict on a scene."""
    s, units = scene(seed)
    row = Compared(seed, contacts=f"{len(s.M)}: " + " ".join(c.kind for c in s.contacts))
    unit = float(Integrator(s).unit)
    duration = min(PERIODS * 2.0 * np.pi / s.omega, STEPS * 0.1 * unit)
    # early ones too, before motions depart; none a part of a period at which a symmetric motion has its events
    times = duration * ((np.arange(1, TIMES + 1) - 1.0 / 3.0) / TIMES) ** 2
    n = len(s.M)
    clock = time.process_time()
    try:
        motion = bf.simulate(system_of(s, units), np.concatenate([s.q * units[1], s.v * units[1] / units[2]]),
                             duration=duration * units[2], max_events=20000)
        many = motion.status == "too_many_events"
        if many:  # as far as it goes: a mass that an elastic wall throws back against a load may have no end of them
            times = min(duration, motion.stop / units[2]) * times / duration * (1.0 - 1e-12)
        if not motion.success and not many:
            row.verdict, row.why = "exception", f"{motion.status.value}: {motion.message}"
        else:
            found = motion(times * units[2])[:, :2 * n] / np.repeat([units[1], units[1] / units[2]], n)
    except Exception as error:  # whatever it raises is told
        row.verdict, row.why = "exception", f"{type(error).__name__}: {error}"
    row.seconds = time.process_time() - clock
    if row.seconds > SLOW:
        row.verdict, row.why = "slow", f"{row.seconds:.0f} s"
    if row.verdict != "agrees":
        return row
    judge_walls(row, s, motion, units, n, unit)
    judge_energy(row, s, found, n)
    true, ignored, why, row.events = followed(s, times)
    if why:
        row.why = f"reference: {why}"
    if many and why != TOO_MANY:
        row.verdict, row.why = "exception", f"{motion.status.value}: {motion.message}"
        return row
    rng = np.random.default_rng([seed, 45])
    shaken = [followed(s.shaken(rng, SHAKE), times)[0] for _ in range(1)]
    judge_states(row, s, found, true, ignored, shaken, n)
    if row.verdict == "agrees" and row.compared == 0:
        row.verdict = "open"
    return row


def judge_states(row, s, found, true, ignored, shaken, n):
    """Compare states up to where shaken motions are no longer the same."""
    many = min(len(true), *(len(other) for other in shaken))
    if not many:
        return
    true = true.astype(float)
    scale = np.abs(true).max(axis=0)
    scale = np.where(scale > 0.0, scale, np.abs(np.concatenate([s.q, s.v])))  # what has stopped before the first time
    heavy = np.sqrt(np.diag(s.M))  # of coordinates with the energy of the largest, a billionth is seen
    for part in (slice(0, n), slice(n, 2 * n)):
        scale[part] = np.maximum(scale[part], 1e-9 * (scale[part] * heavy).max() / heavy)
    if not scale.any():  # nothing moves
        row.compared, row.verdict = many, "differs" if found.any() else row.verdict
        return
    apart = np.max([np.maximum.accumulate(np.abs(other[:many].astype(float) - true[:many]), axis=0) for other in shaken], axis=0)
    for k in range(many):
        if np.any(apart[k] > UNSURE * scale):
            break
        row.compared += 1
        allowed = FACTOR * (apart[k] + ignored[k]) + FLOOR * scale + 1e-300
        off = np.abs(found[k] - true[k]) / allowed
        row.worst = max(row.worst, float(off.max()))
        if off.max() > 1.0:
            row.verdict = "differs"
            row.why = f"at time {k + 1} of {TIMES}, component {int(off.argmax())}: {found[k][off.argmax()]:.9g} for " \
                      f"{true[k][off.argmax()]:.9g}, {off.max():.1g} x allowed {row.why}"
            return


def judge_walls(row, s, motion, units, n, unit):
    """See whether a rigid stop is passed."""
    _, y = motion.sample(4000)
    q, v = y[:, :n] / units[1], y[:, n:2 * n] * (units[2] / units[1])
    for c in s.contacts:
        if c.kind == "rigid":
            over = c.side * (q @ np.array(c.row)) - c.gap
            moved = np.abs(np.vstack([s.v, v]) * np.array(c.row)).max() * unit  # what a step adds up to a place rounds, too
            if over.max() > 1e-9 * max(np.abs(q * np.array(c.row)).max(), c.gap, moved):
                row.verdict, row.why = "passes a stop", f"by {over.max():.3g}"


def judge_energy(row, s, found, n):
    """See whether energy grows where no load brings it in."""
    if s.amplitude.any() or row.verdict != "agrees":
        return
    E = np.array([energy(s, y[:n], y[n:]) for y in np.vstack([np.concatenate([s.q, s.v]), found])])
    if any(c.kind in ("slider", "elastic") for c in s.contacts):
        E = E[[0, int(np.argmax(E))]]  # springs of contacts give back what they took
        if s.v.any():
            return
    size_ = np.abs(E).max() + max(0.5 * y[n:] @ s.M @ y[n:] for y in found)
    if np.any(np.diff(E) > 1e-9 * size_):
        row.verdict, row.why = "gains energy", f"{np.diff(E).max() / size_:.3g}"


def energy(s, q, v):
    """Return kinetic and potential energy, constant loads included."""
    return 0.5 * v @ s.M @ v + 0.5 * q @ s.K @ q - s.constant @ q


def study(setting: Setting, first: int = 0) -> list[Compared]:
    """Return the scenes."""
    rows = []
    for seed in range(first, first + SCENES[setting]):
        rows.append(compared(seed))
        print(seed, rows[-1].verdict, rows[-1].compared, f"{rows[-1].worst:.2g}", rows[-1].events, f"{rows[-1].seconds:.2f} s",
              rows[-1].contacts, rows[-1].why, file=sys.stderr, flush=True)
    return rows


def report(rows) -> str:
    """Return the table: how many of each verdict, by the number of masses."""
    lines = []
    for masses in ("1", "2", "3", "4", "all"):
        mine = [row for row in rows if masses in ("all", row.contacts[0])]
        lines.append([masses, len(mine), *(sum(row.verdict == verdict for row in mine) for verdict in VERDICTS)])
    return table("Extreme scenes beside a second integrator", ["masses", "scenes", *VERDICTS], lines)


def picture(rows):
    """Draw differences over what is allowed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.semilogy([row.seed for row in rows], [max(row.worst, 1e-6) for row in rows], ".")
    axes.axhline(1.0, lw=0.8)
    axes.set_xlabel("scene")
    axes.set_ylabel("difference over allowed")
    return figure


def main() -> None:
    """Run the study."""
    made = parser(__doc__)
    made.add_argument("--first", type=int, default=0, help="number of the first scene")
    arguments = made.parse_args()
    rows = study(arguments.setting, arguments.first)
    publish(arguments, "extreme_scenes", report(rows), lambda: picture(rows))


if __name__ == "__main__":
    main()
