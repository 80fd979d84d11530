"""What a proof costs, and how near to a graze and a fold it still succeeds.

Certificates of orbits over degrees of freedom, events and precision; of random motions below a graze and above a fold of the
load, at ever smaller distances, in closed form; of whole branches, row by row and between the rows. Needs the extra `certify`.
"""
import sys
import time
from dataclasses import dataclass

import numpy as np

import bifurc as bf
from bifurc import System
from bifurc.elements import Coulomb, HarmonicForce, Jenkins

from .common import Setting, interleaved, parser, publish, table

MASSES = {Setting.SMALL: (1, 4), Setting.FULL: (1, 2, 4, 8, 16)}
BITS = {Setting.SMALL: (96, 384), Setting.FULL: (64, 96, 192, 384, 768, 1536)}
DISTANCES = {Setting.SMALL: (1e-4, 1e-8), Setting.FULL: tuple(10.0**-k for k in range(2, 16))}
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 9}


@dataclass(frozen=True)
class Cost:
    """CPU time of the certificate of an orbit.

    Attributes
    ----------
    orbit : str
    n, events, bits : int
    seconds : float
    proved : bool
    """

    orbit: str
    n: int
    events: int
    bits: int
    seconds: float
    proved: bool


def motions(setting: Setting) -> dict:
    """Return orbits by name."""
    systems = {f"chain of {n}" if n > 1 else "one impact": bf.systems.impact_chain(n=n) if n > 1 else
               bf.systems.impact_oscillator(omega=0.8) for n in MASSES[setting]}
    systems["stick and slip"] = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.6)], omega=0.4)
    systems["elastic slider"] = System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6)], omega=0.9)
    if setting is Setting.FULL:
        systems["stick and slip, slow"] = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.3)], omega=0.12)
    return {name: bf.find_orbit(system) for name, system in systems.items()}


def costs(setting: Setting = Setting.FULL) -> list[Cost]:
    """Return what orbits cost at the usual precision, and one impact at others."""
    orbits = motions(setting)
    calls = {(name, 96): orbit for name, orbit in orbits.items()}
    calls |= {("one impact", bits): orbits["one impact"] for bits in BITS[setting]}
    used = interleaved({key: (lambda orbit=orbit, key=key: orbit.certify(precision=key[1])) for key, orbit in calls.items()},
                       ROUNDS[setting])
    return [Cost(name, orbit.system.n, len(orbit.events), bits, used[name, bits], orbit.certify(precision=bits).proved)
            for (name, bits), orbit in calls.items()]


@dataclass(frozen=True)
class Near:
    """What is proved at a distance from a special point, relative in the load.

    Attributes
    ----------
    point : str
        ``graze``, ``fold``.
    distance : float
    proved, tried : int
    seconds : float
        CPU, mean.
    """

    point: str
    distance: float
    proved: int
    tried: int
    seconds: float


ZETA, OMEGA, GAP, RESTITUTION = 0.05, 1.4, 1.0, 0.7


def near(setting: Setting = Setting.FULL) -> list[Near]:
    """Return what is proved of free motions just below a graze, and of both impacting motions just above the fold."""
    response = 1.0 / (1.0 - OMEGA**2 + 2j * ZETA * OMEGA)
    graze = GAP / abs(response)
    fold = special_load()[0]
    rows = []
    for distance in DISTANCES[setting]:
        free = bf.find_orbit(bf.systems.impact_oscillator(zeta=ZETA, omega=OMEGA, amplitude=graze * (1.0 - distance), gap=GAP,
                                                          restitution=RESTITUTION))
        rows.append(_judged("graze", distance, [free]))
        rows.append(_judged("fold", distance, impacting(fold * (1.0 + distance))))
    return rows


def special_load() -> tuple[float, float]:
    """Return load and impact speed at the fold of motions with one impact a period, in closed form.

    With the unforced flow E over a period and a = (1 - E)^-1 E (0, 1), the steady response just at the impact is
    P = (gap, v) + (1 + r) v a; it lies on the ellipse P1^2 + (P2/omega)^2 = A^2, a quadratic in v.
    """
    a, b, c = _quadratic(0.0)
    v = -b / (2.0 * a)
    response = abs(1.0 / (1.0 - OMEGA**2 + 2j * ZETA * OMEGA))
    return float(np.sqrt(c - b * b / (4.0 * a)) / response), float(v)


def _quadratic(amplitude: float) -> tuple[float, float, float]:
    damped, span = np.sqrt(1.0 - ZETA**2), 2.0 * np.pi / OMEGA
    e, cosine, sine = np.exp(-ZETA * span), np.cos(damped * span), np.sin(damped * span)
    E = e * np.array([[cosine + ZETA * sine / damped, sine / damped], [-sine / damped, cosine - ZETA * sine / damped]])
    first, second = np.linalg.solve(np.eye(2) - E, E @ [0.0, 1.0])
    p, q = (1.0 + RESTITUTION) * first, (1.0 + (1.0 + RESTITUTION) * second) / OMEGA
    return p * p + q * q, 2.0 * GAP * p, GAP**2 - amplitude**2


def impacting(load: float) -> list:
    """Return both motions with one impact a period at a load, in closed form."""
    response = abs(1.0 / (1.0 - OMEGA**2 + 2j * ZETA * OMEGA))
    a, b, c = _quadratic(load * response)
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    system = bf.systems.impact_oscillator(zeta=ZETA, omega=OMEGA, amplitude=load, gap=GAP, restitution=RESTITUTION)
    return [one_impact(system, (-b + sign * root) / (2.0 * a)) for sign in (1.0, -1.0)]


def one_impact(system, v: float):
    """Return the motion that hits the stop once a period with the speed v."""
    from bifurc.compose.scene import scene_of
    from bifurc.orbits.orbit import PeriodicOrbit
    from bifurc.orbits.shooting.signature import Signature, divided

    damped, span = np.sqrt(1.0 - ZETA**2), 2.0 * np.pi / OMEGA
    e, cosine, sine = np.exp(-ZETA * span), np.cos(damped * span), np.sin(damped * span)
    E = e * np.array([[cosine + ZETA * sine / damped, sine / damped], [-sine / damped, cosine - ZETA * sine / damped]])
    first, second = np.linalg.solve(np.eye(2) - E, E @ [0.0, 1.0])
    place, speed = GAP + (1.0 + RESTITUTION) * first * v, (1.0 + (1.0 + RESTITUTION) * second) * v
    angle = np.angle(place - 1j * speed / OMEGA) - np.angle(1.0 / (1.0 - OMEGA**2 + 2j * ZETA * OMEGA))
    scene = scene_of(system)
    mode = scene.index(("always", "free"))
    signature = Signature(divided(scene, np.array([[mode, 0, mode, 0, 0]])), np.zeros(1), 1.0)
    unknowns = np.array([float(angle) % (2.0 * np.pi) / (2.0 * np.pi), GAP, v])
    return PeriodicOrbit(system, signature, unknowns, np.full(2, max(1.0, v)))


def _judged(point: str, distance: float, orbits: list) -> Near:
    start = time.process_time()
    proved = sum(orbit.certify().proved for orbit in orbits)
    return Near(point, distance, proved, len(orbits), (time.process_time() - start) / len(orbits))


@dataclass(frozen=True)
class Whole:
    """What is proved of a branch.

    Attributes
    ----------
    branch : str
    rows, points, stretches : tuple of int
        Proved, of how many.
    pieces : int
        Tubes between the rows.
    seconds : float
        CPU of all proofs.
    """

    branch: str
    rows: tuple[int, int]
    points: tuple[int, int]
    stretches: tuple[int, int]
    pieces: int
    seconds: float


def wholes(setting: Setting = Setting.FULL) -> list[Whole]:
    """Return what is proved of whole branches: that of the README, and others."""
    impact = bf.systems.impact_oscillator
    cases = {"README": (impact(), "omega", (0.5, 2.0))}
    if setting is Setting.SMALL:
        cases = {"README, a part": (impact(omega=1.3), "omega", (1.25, 1.4))}
    else:
        cases |= {"elastic stop": (bf.systems.bilinear_oscillator(omega=1.2), "omega", (0.8, 1.6)),
                  "two stops": (bf.systems.two_sided_impact_oscillator(), "amplitude", (3.0, 3.6)),
                  "stick and slip": (System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.6)], omega=0.4), "omega", (0.3, 0.6)),
                  "elastic slider": (System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6)], omega=0.9), "omega",
                                     (0.7, 1.2))}
    rows = []
    for name, (system, parameter, bounds) in cases.items():
        found = bf.trace(bf.find_orbit(system), parameter, bounds=bounds).certify()
        rows.append(Whole(name, (len(found.rows) - len(found.undecided), len(found.rows)),
                          *((sum(part.proved for part in parts), len(parts)) for parts in (found.points, found.stretches)),
                          sum(part.pieces for part in found.stretches), found.seconds))
    return rows


def report(rows: list[Cost], closeness: list[Near], branches: list[Whole]) -> str:
    """Return the tables."""
    first = table("certificate of an orbit", ("orbit", "n", "events", "bits", "ms", "proved"),
                  [(r.orbit, r.n, r.events, r.bits, f"{1e3 * r.seconds:.2f}", "yes" if r.proved else "no") for r in rows])
    second = table("nearness of special points, relative in the load", ("point", "distance", "proved", "of", "ms"),
                   [(r.point, f"{r.distance:.0e}", r.proved, r.tried, f"{1e3 * r.seconds:.1f}") for r in closeness])
    third = table("whole branches: proved, of", ("branch", "rows", "points", "stretches", "tubes", "CPU s"),
                  [(r.branch, *("{} of {}".format(*part) for part in (r.rows, r.points, r.stretches)), r.pieces, f"{r.seconds:.1f}")
                   for r in branches])
    return "\n\n".join((first, second, third))


def picture(rows: list[Cost], closeness: list[Near]):
    """Return the figure: cost over degrees of freedom, and what is proved near special points."""
    from bifurc.plotting import style
    made, (left, right) = style.figure(6.3, 2.8, columns=2)
    sizes = [r for r in rows if r.bits == 96 and (r.orbit.startswith("chain") or r.orbit == "one impact")]
    left.plot([r.n for r in sizes], [1e3 * r.seconds for r in sizes], marker="o", color=style.BLUE, label="96 bits, over n")
    left.set(xlabel="degrees of freedom", ylabel="CPU ms a proof", xscale="log", yscale="log")
    for point, color in (("graze", style.VERMILION), ("fold", style.BLUE)):
        here = [r for r in closeness if r.point == point]
        right.plot([r.distance for r in here], [r.proved / r.tried for r in here], marker="o", color=color, label=point)
    right.set(xlabel="distance, relative in the load", ylabel="share proved", xscale="log", ylim=(-0.05, 1.05))
    style.legend(right)
    return made


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    given = parser(__doc__).parse_args(arguments)
    rows, closeness, branches = costs(given.setting), near(given.setting), wholes(given.setting)
    publish(given, "proof_cost", report(rows, closeness, branches), lambda: picture(rows, closeness))
    return 0


if __name__ == "__main__":
    sys.exit(main())
