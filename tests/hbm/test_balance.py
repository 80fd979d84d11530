"""Residuals and derivatives of balances: closed forms, a dense textbook implementation, differences, refusals."""
import math
from dataclasses import dataclass

import numpy as np
import pytest

from bifurc import System, systems
from bifurc.elements import (
    Algebraic,
    AtRow,
    BaseMotion,
    CubicSpring,
    Driven,
    ElasticStop,
    Element,
    EventKind,
    Force,
    Guard,
    HarmonicForce,
    Jenkins,
    LinearSpring,
    Mode,
    RegularizedFriction,
    Rows,
    local,
)
from bifurc.hbm.balance import Balance
from bifurc.hbm.layout import Layout, listed
from bifurc.hbm.parts import split
from bifurc.hbm.status import ContactStatus
from bifurc.solve.newton import newton
from tests.reference import classical_aft


def j1(omega):
    return systems.jenkins_oscillator(zeta=0.01, omega=omega, amplitude=1.0, stiffness=1.0, limit=1.0)


def solved(balance, start=None):
    found = newton(balance.residual, balance.jacobian, balance.linear_response() if start is None else start)
    assert np.abs(found.x).max() > 0.0
    return found.x


# closed forms and anchors

@pytest.mark.parametrize(("omega", "amplitude"), [(1.1, 3.5944724390310), (1.3, 2.2991439552377), (0.8, 0.7352432375226)])
def test_one_harmonic_against_the_closed_form(omega, amplitude):
    balance = Balance(j1(omega), Layout((1,), 1))
    x = newton(balance.residual, balance.jacobian, np.zeros(2)).x
    assert abs(abs(balance.layout.phasor(x, 1)) - amplitude) <= 1e-12


@pytest.mark.parametrize(("H", "amplitude"), [(7, 3.51430705853), (21, 3.51378600266), (51, 3.51379776783)])
def test_exact_events_against_the_anchors(H, amplitude):
    balance = Balance(j1(1.1), Layout(listed(H), 1))
    assert abs(abs(balance.layout.phasor(solved(balance), 1)) - amplitude) <= 1e-9


@pytest.mark.parametrize(("samples", "gap"), [(256, 2e-4), (1024, 2e-5), (4096, 2e-6)])
def test_sampled_amplitude_comes_near_the_exact_one(samples, gap):
    layout = Layout(listed(7), 1)
    exact = solved(Balance(j1(1.1), layout))
    sampled = solved(Balance(j1(1.1), layout, samples), exact)
    assert abs(abs(layout.phasor(sampled, 1)) / abs(layout.phasor(exact, 1)) - 1.0) <= gap


# a second implementation

@pytest.mark.parametrize("samples", [16, 21, 64, 255, 256])
def test_sampled_slider_is_the_textbook_one_with_its_dense_jacobian(samples, rng):
    H = 7
    system = j1(1.1)
    layout = Layout(listed(H), 1)
    balance = Balance(system, layout, samples)
    B, P = classical_aft.basis(H, samples)
    for _ in range(5):
        x = rng.standard_normal(layout.size) / (1.0 + layout.waves**2)
        x[1:3] += 2.0 * rng.standard_normal(2)
        u = B @ x
        f, df = classical_aft.jenkins(u, 1.0, 1.0, periods=3)
        if np.abs(f).max() < 1.0:  # stuck: the memory is arbitrary
            continue
        k, nu = layout.waves, 1.1
        linear = (1.0 - (k * nu)**2) * x + 0.02 * nu * layout.derivative(x)
        linear[1] -= 1.0
        np.testing.assert_allclose(balance.residual(x), linear - P @ f, atol=2e-13)
        dense = np.diag(1.0 - (k * nu)**2) - P @ df @ B
        dense += 0.02 * nu * np.array([layout.derivative(e) for e in np.eye(layout.size)]).T
        np.testing.assert_allclose(balance.jacobian(x), dense, atol=1e-12)


def test_sampled_stop_is_the_textbook_one_with_its_dense_jacobian(rng):
    H, N = 9, 128
    system = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(gap=0.3, stiffness=7.0)], omega=0.9)
    layout = Layout(listed(H), 1)
    balance = Balance(system, layout, N)
    B, P = classical_aft.basis(H, N)
    x = rng.standard_normal(layout.size) / (1.0 + layout.waves)
    f, slope = classical_aft.stop(B @ x, None, 0.3, 7.0)
    bare = Balance(System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=0.9), layout)
    np.testing.assert_allclose(balance.residual(x), bare.residual(x) - P @ f, atol=1e-13)
    np.testing.assert_allclose(balance.jacobian(x), bare.jacobian(x) - P @ (slope[:, None] * B), atol=1e-12)


def test_exact_contacts_are_the_limit_of_fine_sampling(rng):
    system = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(gap=0.3, stiffness=7.0), Jenkins(2.0, 0.7)], omega=0.9)
    layout = Layout(listed(5), 1)
    x = rng.standard_normal(layout.size) / (1.0 + layout.waves)
    exact = Balance(system, layout).residual(x)
    gaps = [np.abs(Balance(system, layout, N).residual(x) - exact).max() for N in (256, 4096)]
    assert gaps[1] < 1e-5 and gaps[1] < gaps[0] / 50.0


# derivatives

@dataclass(frozen=True)
class Clutch(AtRow):
    """A user's element with memory and a force that jumps: it grips where it is when u falls, and lets go when u rises."""

    stiffness: float = 0.8
    memory = ("grip",)
    start = ("loose", "gripped")

    def mode(self, key, core):
        if key == "loose":
            return Mode(force=(0.1,), memory=(Algebraic(local.u(0) + 0.2),),
                        guards=(Guard(-local.s(0), EventKind.STICK, ("gripped",)),))
        return Mode(force=(-self.stiffness * (local.u(0) - local.z(0)),), guards=(Guard(local.s(0), EventKind.SLIP, ("loose",)),))


@dataclass(frozen=True)
class Latch(AtRow):
    """A user's element that grips while it moves: where it grips depends on when its guard, of speed and place, is reached."""

    stiffness: float = 0.8
    memory = ("grip",)
    start = ("loose", "gripped")

    def mode(self, key, core):
        way = local.s(0) + 0.4 * local.u(0)
        if key == "loose":
            return Mode(memory=(Algebraic(local.u(0) - 0.3 * local.s(0)),),
                        guards=(Guard(way - 0.5, EventKind.STICK, ("gripped",)),))
        return Mode(force=(-self.stiffness * (local.u(0) - local.z(0)),),
                    guards=(Guard(-0.2 - way, EventKind.SLIP, ("loose",)),))


@dataclass(frozen=True)
class Tilted(Element):
    """Two rows, coupled: a one-sided spring along the first pulls the second."""

    pull: float = 0.4
    start = ("off", "on")

    def site(self, n):
        return Rows.of(np.eye(n)[:2], n, drift=(0.0, -0.1))

    def mode(self, key, core):
        depth = local.u(0) - 0.2 * local.cos(1)
        if key == "off":
            return Mode(guards=(Guard(depth, EventKind.CONTACT, ("on",)),))
        return Mode(force=(-3.0 * depth - 0.2 * local.s(1), self.pull * depth),
                    guards=(Guard(-depth, EventKind.SEPARATION, ("off",)),))

    harmonics = (1,)


def bumps(u, s, a):
    return -a * math.sin(u) - 0.3 * s * abs(s)


def two_rows(u0, u1, s0, s1, a):
    return -a * u0 * u1 * u1, -a * u0 * u0 * u1 - 0.1 * s0 * s1


TWO = dict(mass=np.diag([1.0, 0.6]), damping=0.05 * np.eye(2), stiffness=np.array([[2.0, -1.0], [-1.0, 1.5]]))
SCENES = {
    "Jenkins": lambda p: j1(p),
    "Jenkins under varying load": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(1.5, 0.6, load_amplitude=0.5,
                                                   load_phase=0.4)], omega=p),
    "Jenkins that separates": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(1.5, 0.6, load_amplitude=1.6)], omega=p),
    "stop with dashpot": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), ElasticStop(0.4, 5.0, damping=0.5)], omega=p),
    "stop let go by force": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), ElasticStop(0.4, 5.0, damping=0.5,
                                             release="force")], omega=p),
    "moving stop": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), ElasticStop(0.4, p, amplitude=0.3, harmonic=2)], omega=1.3),
    "Jenkins that separates earlier or later": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(
        1.5, 0.6, load_amplitude=1.6, load_phase=p)], omega=1.3),
    "latch": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Latch(p)], omega=1.2),
    "latch over its frequency": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Latch()], omega=p),
    "clutch": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Clutch(p)], omega=1.2),
    "two rows": lambda p: System(**TWO, elements=[HarmonicForce(1.0), Tilted(p)], omega=1.2),
    "between masses": lambda p: System(**TWO, elements=[HarmonicForce(1.0), Jenkins(2.0, 0.3, row=(1.0, -1.0)),
                                       Jenkins(1.0, 0.2, dof=1), LinearSpring(0.4, 0.1, row=(1.0, 1.0)), CubicSpring(p, dof=1)],
                                       omega=1.2),
    "law": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Force(bumps, site=0, a=p)], omega=1.2),
    "law of two rows": lambda p: System(**TWO, elements=[HarmonicForce(1.0), Force(two_rows, site=np.eye(2), a=p)], omega=1.2),
    "regularised": lambda p: System(1.0, 0.1, 1.0, [HarmonicForce(1.5), RegularizedFriction(0.5, p)], omega=1.2),
}


@pytest.mark.parametrize("samples", [0, 256])
@pytest.mark.parametrize("name", SCENES)
def test_derivatives_against_differences(name, samples, rng):
    build, p = SCENES[name], 1.1
    system = build(p)
    layout = Layout(listed(5), system.n)
    balance = Balance(system, layout, samples)
    x = 0.2 * rng.standard_normal(layout.size) / (1.0 + np.repeat(layout.waves, system.n)**2)
    x[system.n:3 * system.n] += 1.0 + rng.random(2 * system.n)
    h = 1e-6
    above, below = (balance.parts.flat_of(build(p + d)) for d in (h, -h))
    status, _, wide = balance.linearised(x, dflat=(above - below) / (2.0 * h))
    assert status is ContactStatus.FOLLOWED
    wide = wide.copy()

    def difference(f):
        return (8.0 * (f(h) - f(-h)) - f(2.0 * h) + f(-2.0 * h)) / (12.0 * h)

    dense = np.array([difference(lambda d, e=e: balance.residual(x + d * e)) for e in np.eye(layout.size)]).T
    size = np.abs(dense).max()
    np.testing.assert_allclose(wide[:, :-1], dense, atol=1e-7 * size)

    def moved(d):
        f = balance.linearised(x, balance.parts.flat_of(build(p + d)), slopes=False)[1]
        return f.copy()

    np.testing.assert_allclose(wide[:, -1], difference(moved), atol=2e-7 * size)


@pytest.mark.parametrize("samples", [0, 48])
@pytest.mark.parametrize("element", [Jenkins(1.5, 0.6), Clutch(), Latch(), ElasticStop(0.4, 5.0, damping=0.5)])
def test_forces_do_not_know_where_the_period_begins(element, samples, rng):
    """A motion that starts by whole samples later has the same forces, so much later: events on both sides of the border count."""
    layout, n = Layout(listed(5), 1), 48
    free, full = (Balance(System(1.0, 0.0, 1.0, elements, omega=1.0), layout, samples)
                  for elements in ([HarmonicForce(0.0)], [HarmonicForce(0.0), element]))

    def later(x, phase):
        c = np.array([layout.phasor(x, k) for k in layout.harmonics]).reshape(-1)
        return c * np.exp(-1j * np.array(layout.harmonics) * phase)

    def force(x):
        return full.residual(x) - free.residual(x)

    def packed(c):
        parts = np.column_stack([c.real, -c.imag]).ravel()
        return np.delete(parts, 1)  # the mean has no sine

    for _ in range(5):
        x = rng.standard_normal(layout.size) / (1.0 + layout.waves**2)
        x[1:3] += 1.5
        true = force(x)
        size = np.abs(true).max()
        assert size > 0.1
        for k in range(1, n):
            phase = 2.0 * np.pi * k / n
            moved = force(packed(later(x, phase)))
            np.testing.assert_allclose(moved, packed(later(true, phase)), atol=1e-12 * size, err_msg=f"{k} samples")


# what is folded, what is refused

def test_loads_on_any_harmonic_static_and_linear_elements(rng):
    system = System(2.0, 0.3, 1.5, [HarmonicForce(0.7, harmonic=3, phase=0.2), LinearSpring(0.4, 0.1)], omega=0.8)
    layout = Layout((0, 1, 3), 1)
    x = newton((b := Balance(system, layout)).residual, b.jacobian, np.zeros(5)).x
    w = 2.4
    assert layout.phasor(x, 3) == pytest.approx(0.7 * np.exp(0.2j) / (1.9 - 2.0 * w * w + 0.4j * w), abs=1e-14)


def test_orbits_of_several_forcing_periods_share_the_excitation():
    system = j1(1.1)
    one, two = Balance(system, Layout(listed(5), 1)), Balance(system, Layout(listed(5, 2), 1, 2))
    x = solved(one)
    assert np.abs(two.residual(one.layout.moved(x, two.layout))).max() < 1e-12


def test_rigid_stops_are_refused_by_name():
    with pytest.raises(ValueError, match=r"rigid_stop.*ElasticStop"):
        split(systems.impact_oscillator(), Layout((0, 1), 1))


def test_missing_harmonic_of_the_load_is_named():
    with pytest.raises(ValueError, match="harmonic_force excites harmonic 3.*add 3"):
        split(System(1.0, 0.1, 1.0, [HarmonicForce(1.0, harmonic=3)], omega=1.0), Layout((0, 1, 2), 1))


def test_too_few_samples_are_an_error():
    with pytest.raises(ValueError, match="samples = 12 is not enough for harmonic 7; give at least 15"):
        Balance(j1(1.1), Layout(listed(7), 1), 12)


def test_autonomous_systems_are_refused():
    with pytest.raises(ValueError, match="autonomous"):
        split(System(1.0, 0.1, 1.0, [Jenkins()]), Layout((0, 1), 1))


def test_no_contact_where_there_is_no_load():
    system = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Jenkins(1.0, 0.0)], omega=0.8)
    bare = System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=0.8)
    layout = Layout(listed(3), 1)
    x = solved(Balance(bare, layout))
    for samples in (0, 64):
        assert np.abs(Balance(system, layout, samples).residual(x)).max() < 1e-13


def test_a_stuck_slider_relaxes_about_the_mean():
    system = System(1.0, 0.1, 1.0, [HarmonicForce(0.1), Jenkins(1.0, 1.0)], omega=0.8)
    balance = Balance(system, Layout(listed(3), 1))
    x = solved(balance)
    assert abs(x[0]) < 1e-15
    (own,), = (balance.segments(x),)
    assert [segment.guard for segment in own] == [None] and abs(own[0].memory[0]) < 1e-15


def test_nothing_that_is_not_finite_leaves_unnoticed():
    balance = Balance(j1(1.1), Layout(listed(3), 1))
    status, _, _ = balance.linearised(np.full(7, np.nan))
    assert status is ContactStatus.NOT_FINITE and status.sentence


@pytest.mark.parametrize("element", [
    BaseMotion(0.4, harmonic=2, damper="ground"), Jenkins(5.0, 0.4, load_amplitude=0.5), HarmonicForce(0.7, harmonic=3),
    Driven(Jenkins(5.0, 0.4), amplitude=1.0), ElasticStop(0.3, 4.0, damping=0.1)], ids=repr)
def test_numbers_that_follow_the_frequency_are_written_at_every_one(element):
    def made(omega):
        return System(1.0, 0.1, 1.0, [HarmonicForce(0.2), element], omega=omega)

    layout = Layout((0, 1, 2, 3, 4, 5), 1)
    for first in (0.6, 0.85):
        parts = split(made(first), layout)
        for omega in (0.85, 2.5, 0.6):
            assert np.array_equal(parts.flat_of(made(omega)), split(made(omega), layout).flat)
    stiffer = System(1.0, 0.1, 1.3, [HarmonicForce(0.2), element], omega=0.85)
    assert np.array_equal(parts.flat_of(stiffer), split(stiffer, layout).flat)
