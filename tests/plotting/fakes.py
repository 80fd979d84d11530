"""Closed-form motions of the impact oscillator with the attributes that the pictures read.

x'' + 2 zeta x' + x = F cos(omega t), x <= 1, v+ = -r v: orbits of one impact in one forcing period exist for
A^2 = (1 - L v)^2 + (G v / omega)^2 with A the amplitude of the free response (Thompson and Ghaffari 1983).
"""
import math
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace

import numpy as np

from bifurc.basins.maps.labelled import LabelledStarts
from bifurc.elements import RigidStop
from bifurc.motion import Motion

ZETA, FORCE, R = 0.05, 0.52, 0.7
WD = math.sqrt(1 - ZETA**2)


def response(omega):
    """Amplitude of the free response."""
    return FORCE / np.sqrt((1 - omega**2) ** 2 + (2 * ZETA * omega) ** 2)


def coefficients(omega):
    """L, G and the propagator's entries e11, e12, e21, e22 over one period."""
    t = 2 * math.pi / omega
    decay, c, s = math.exp(-ZETA * t), math.cos(WD * t), math.sin(WD * t)
    e11, e12, e21, e22 = decay * (c + ZETA * s / WD), decay * s / WD, -decay * s / WD, decay * (c - ZETA * s / WD)
    d, tr = decay**2, e11 + e22
    return (1 + R) * e12 / (tr - 1 - d), 1 - (1 + R) * (e22 - d) / (tr - 1 - d), (e11, e12, e21, e22)


def multiplier_extent(omega, v):
    """Largest modulus of the two multipliers of the orbit with impact speed v."""
    lam, gam, (e11, e12, e21, e22) = coefficients(omega)
    g = -(omega**2) / v - (1 - omega**2) * lam + 2 * ZETA * gam
    d = math.exp(-4 * math.pi * ZETA / omega)
    return max(abs(np.roots([1, -(-R * (e11 + e22) + (1 + R) * e12 * g), R**2 * d])))


def motion(**own):
    """What a picture asks of a motion, of a system with a rigid stop where none is given."""
    return SimpleNamespace(**{"periodic": True, "autonomous": False, "regime": "", "signature": "", "periods": 1, "events": [],
                              "system": SimpleNamespace(elements=(RigidStop(gap=1.0, restitution=R),), omega=1.0), **own})


@dataclass
class FakeBranch:
    columns: dict
    special_points: list
    parameter: str = "omega"
    kind: str = "impact"  # of the events
    certificate: object = None

    @cached_property
    def orbits(self):
        return [motion(events=[SimpleNamespace(kind=self.kind)] * n) for n in self.columns["n_events"]]

    def column(self, name):
        return self.columns[name]


def branch() -> FakeBranch:
    """Free up to the graze at .696191, impacting over flips and fold, back to the graze at 1.226914."""
    free = np.linspace(0.5, 0.69619, 12)
    rows = [(w, response(w), True, 0) for w in free]
    gap = lambda w, v: (1 - coefficients(w)[0] * v) ** 2 + (coefficients(w)[1] * v / w) ** 2 - response(w) ** 2  # noqa: E731
    low, high = [], []
    for w in np.linspace(0.6965, 1.5276, 260):
        lam, gam, _ = coefficients(w)
        a, b, c = lam**2 + (gam / w) ** 2, -2 * lam, 1 - response(w) ** 2
        roots = np.roots([a, b, c])
        for v in sorted(root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 1e-9):
            assert abs(gap(w, v)) < 1e-9
            (low if w > 1.2269 and v == min(r.real for r in roots if r.real > 1e-9) else high).append((w, v))
    for w, v in high + low[::-1]:
        rows.append((w, 1 + 0.08 * v, multiplier_extent(w, v) < 1, 1))  # a measure that grows with the impact speed
    w, y, stable, n = (np.array(c) for c in zip(*rows, strict=True))
    s = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(w), np.diff(y)))))
    known = [("grazing", 0.696191), ("period_doubling", 0.710690), ("period_doubling", 0.824134),
             ("period_doubling", 0.923529), ("fold", 1.527621), ("grazing", 1.226914)]
    turn = int(np.argmax(w))
    points = []
    for kind, at in known:
        half = slice(0, turn + 1) if (kind, at) != known[-1] else slice(turn, None)
        order = np.argsort(w[half])
        points.append(SimpleNamespace(kind=kind, parameter=at, s=float(np.interp(at, w[half][order], s[half][order])),
                                      measures={}))
    points[4].s = (s[turn] + s[turn + 1]) / 2  # the fold lies between the rows on its two sides
    return FakeBranch({"s": s, "omega": w, "rms_0": y, "stable": stable, "n_events": n}, points)


@dataclass
class FakeOrbit(Motion):
    """Orbit of one impact in one forcing period, sampled from the closed form."""

    periodic = True

    omega: float = 1.4
    periods: int = 1
    stable: bool = True
    system: SimpleNamespace = None
    events: list = field(default_factory=list)

    def __post_init__(self):
        lam, gam, _ = coefficients(self.omega)
        a, b, c = lam**2 + (gam / self.omega) ** 2, -2 * lam, 1 - response(self.omega) ** 2
        self.speed = max(np.roots([a, b, c]).real)
        amplitude, lag = response(self.omega), math.atan2(2 * ZETA * self.omega, 1 - self.omega**2)
        psi = math.atan2(-gam * self.speed / self.omega, 1 - lam * self.speed)
        self.hit = ((psi + lag) / self.omega) % self.period
        self.particular = lambda t: (amplitude * np.cos(self.omega * t - lag),
                                     -amplitude * self.omega * np.sin(self.omega * t - lag))
        stop = RigidStop(gap=1.0, restitution=R)
        self.system = SimpleNamespace(omega=self.omega, elements=(stop,))
        self.events = [SimpleNamespace(time=self.hit, kind="impact", speed=self.speed, element="stop")]
        self.state = self.at(np.array([0.0]))[0]

    @property
    def sections(self):
        return self.state[None]

    @property
    def period(self):
        return 2 * math.pi / self.omega

    def at(self, t):
        """State at times within one period."""
        since = (t - self.hit) % self.period
        xp, vp = self.particular(self.hit)
        x0, v0 = 1.0 - xp, -R * self.speed - vp
        decay, c, s = np.exp(-ZETA * since), np.cos(WD * since), np.sin(WD * since)
        x = decay * ((c + ZETA * s / WD) * x0 + s / WD * v0)
        v = decay * (-s / WD * x0 + (c - ZETA * s / WD) * v0)
        xp, vp = self.particular(t)
        return np.column_stack((x + xp, v + vp))

    def sample(self, n):
        t = np.linspace(0, self.period, n)
        return t, self.at(t)


@dataclass
class FakeMap(LabelledStarts):
    """A map of labelled starts of a system with one degree of freedom."""

    labels: np.ndarray
    grid: SimpleNamespace
    attractors: tuple
    fractions: dict
    label_uncertainty: float = 3e-16
    states: np.ndarray | None = None
    system: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(n=1))


def basins() -> FakeMap:
    """A map whose labels are a spiral, with one impacting and one free attractor and a few unresolved cells."""
    impacting = FakeOrbit()
    rest = np.array([-0.5, 0.2])
    free = motion(state=rest, sections=rest[None], stable=True, period=impacting.period,
                  system=SimpleNamespace(omega=impacting.omega, elements=()),
                  sample=lambda n: (np.linspace(0, impacting.period, n), np.tile(rest, (n, 1))))
    q, v = np.meshgrid(np.linspace(-3, 1, 200), np.linspace(-4, 4, 200), indexing="ij")
    labels = (np.sin(3 * np.hypot(q + 1, v) + np.arctan2(v, q + 1)) > 0.6).astype(int)
    labels[:3, :3] = -1
    fractions = {k: float(np.mean(labels == k)) for k in (-1, 0, 1)}
    grid = SimpleNamespace(names=("q0", "v0"), low=(-3.0, -4.0), high=(1.0, 4.0))
    return FakeMap(labels, grid, (impacting, free), fractions)


def branch_without() -> SimpleNamespace:
    """A branch without any column that a diagram of states shows."""
    return SimpleNamespace(column_names=("s", "omega"), parameter="omega", special_points=(), column={}.__getitem__)
