"""What every element must do, built in or written by a user: one test a promise, over all of them."""
import dataclasses
import json
import re
from dataclasses import dataclass

import numpy as np
import pytest

from bifurc import elements as el
from bifurc.compose import scene_of
from bifurc.elements.local import lam, u, wave
from bifurc.system import System
from tests.reference.written_elements import Slider

OMEGA = 1.3


@dataclass(frozen=True)
class UserStop(el.Element):
    """A rigid stop as a user writes it: nothing is taken from the built-in one."""

    gap: float = 1.0
    r: float = 0.7
    start = ("away", "resting")

    def site(self, n):
        return el.Rows.of(0, n)

    def mode(self, key, core):
        d = u() - self.gap
        if key == "away":
            hit = el.Guard(d, el.EventKind.IMPACT, ("resting", "away"), el.Restitution(self.r),
                           accumulates=(self.r, "resting"))
            return el.Mode(guards=(hit,))
        return el.Mode(hold=(el.Hold(0, (1.0,), d),), guards=(el.Guard(lam(), el.EventKind.RELEASE, ("away",)),))


@dataclass(frozen=True)
class Wedge(el.Element):
    """Two rows: a wall with sliding friction along it, the reaction pushes along (-1, -mu)."""

    mu: float = 0.4
    start = ("away", "sliding")

    def site(self, n):
        return el.Rows.of([[1.0, 0.0], [0.5, 1.0]], n, drift=(0.0, -0.2))

    def mode(self, key, core):
        d = u(0) - 1.0
        if key == "away":
            return el.Mode(guards=(el.Guard(d, el.EventKind.CONTACT, ("sliding",)),))
        return el.Mode(hold=(el.Hold(0, (-1.0, -self.mu), d),),
                       guards=(el.Guard(-lam(), el.EventKind.RELEASE, ("away",)),))


def saturating(u, s, k, c):
    return -k * u / (1.0 + u * u) - c * s * s * s


def twist(u0, u1, s0, s1, k):
    return -k * u0 * u1 * u1, -k * u0 * u0 * u1 - s1 * s1 * s1


def twist_slope(u0, u1, s0, s1, k):
    return -k * u1 * u1, -2 * k * u0 * u1, 0.0, 0.0, -2 * k * u0 * u1, -k * u0 * u0, 0.0, -3 * s1 * s1


ELEMENTS = [
    el.HarmonicForce(0.7, harmonic=1, phase=0.4),
    el.HarmonicForce(-0.3, harmonic=2, row=(1.0, -2.0)),
    el.ConstantForce(0.2, dof=1),
    el.BaseMotion(0.3),
    el.BaseMotion(0.3, harmonic=2, phase=0.1, damper="ground", row=(1.0, 0.5)),
    el.RigidStop(1.0, 0.7),
    el.RigidStop(0.0, 0.0, side=-1, dof=1),
    el.RigidStop(-0.2, 1.0, row=(1.0, -1.0)),
    el.RigidStop(0.4, 0.5, side=-1, amplitude=0.2, phase=0.3, harmonic=1),
    el.RigidStop(0.4, 0.5, amplitude=0.2, harmonic=2),
    el.ElasticStop(0.5, 4.0),
    el.ElasticStop(0.5, -0.5, 0.1, side=-1),
    el.ElasticStop(-0.1, 4.0, 0.3, release="force", row=(0.5, 1.0)),
    el.ElasticStop(0.5, 4.0, 0.3, release="force", amplitude=0.1, harmonic=1),
    el.LinearSpring(2.0, 0.1, row=(1.0, -1.0)),
    el.CubicSpring(0.8, dof=1),
    el.PolynomialSpring(0.1, 0.2, 0.3, 0.4, row=(1.0, 1.0)),
    el.Force(saturating, site=0, k=1.2, c=0.1, odd=True),
    el.Force(twist, twist_slope, site=[[1.0, 0.0], [0.0, 1.0]], k=0.5, odd=True),
    UserStop(0.9, 0.6),
    Slider(),
    Wedge(),
    el.Coulomb(0.5),
    el.Coulomb(0.5, 0.3, static_ratio=1.2, belt_speed=0.2, dof=1),
    el.Coulomb(0.5, load_amplitude=1.5, load_harmonic=2, load_phase=0.3, row=(1.0, -1.0)),
    el.Stribeck(0.5, 0.8, 0.3),
    el.Stribeck(0.5, 0.8, 0.3, "hyperbolic", belt_speed=0.4),
    el.RegularizedFriction(0.5, 0.1, belt_speed=0.1),
    el.Jenkins(2.0, 0.3),
    el.Jenkins(2.0, 0.3, load_amplitude=1.5, row=(1.0, -1.0)),
    el.Iwan((2.0, 1.0), (0.3, 0.4), dof=1),
    el.MicroSlip(3.0, 1.0, (0.3, 0.2, 0.4), row=(1.0, -1.0)),
    el.MicroSlip(3.0, 1.0, (0.3, 0.2, 0.4), closed=True),
    el.Driven(el.Jenkins(2.0, 0.3, load_amplitude=1.5), 0.7, harmonic=2, phase=0.3),
    el.CubicFriction(0.8, 0.3, 0.1, belt_speed=0.4),
    el.SquareForce(0.4, harmonic=2, phase=0.3, duty=0.2, row=(1.0, -1.0)),
    el.SquareSpring(0.4, 1.0, phase=0.3),
    el.ParametricSpring(0.4, 1.0, phase=0.3, row=(1.0, -1.0)),
    el.ParametricStop(0.5, 4.0, 0.1, variation=0.6, variation_harmonic=2, side=-1),
    el.Pulse(0.3, phase=1.0),
    el.PeriodicForce((0.3, 0.0, 0.2), (0.1,), 0.05, phase=0.4),
]
NAMES = [f"{i}-{type(element).__name__}" for i, element in enumerate(ELEMENTS)]
WITH_SLOPES = [ELEMENTS[i] for i in (15, 16, 18)]
each = pytest.mark.parametrize("element", ELEMENTS, ids=NAMES)
MASS = np.array([[2.0, 0.3], [0.3, 1.0]])
DAMPING = np.array([[0.2, -0.1], [0.0, 0.3]])
STIFFNESS = np.array([[3.0, -1.0], [-1.0, 2.0]])


def system_of(*elements):
    return System(MASS, DAMPING, STIFFNESS, elements, omega=OMEGA)


@each
def test_record_goes_through_json(element):
    system = system_of(element)
    record = json.loads(json.dumps(system.to_record()))
    again = System.from_record(record, elements=[UserStop, Slider, Wedge, saturating, twist, twist_slope])
    assert again == system
    assert again.elements[0].parameters == element.parameters
    assert hash(again) == hash(system)


@each
def test_is_immutable_and_parameters_change_a_copy(element):
    with pytest.raises((dataclasses.FrozenInstanceError, AttributeError)):
        element.label = "other"
    for name, value in element.parameters.items():
        other = 0.5 * value + 0.01
        if name in ("static", "static_ratio"):  # not below that of slip
            other = 1.5 * value
        changed = element.with_parameters(**{name: other})
        assert changed.parameters[name] == other
        assert element.parameters[name] == value
        assert changed.structure == element.structure
        assert (changed == element) is (changed.parameters == element.parameters)


@each
def test_bad_numbers_are_refused_by_name(element):
    for name in element.parameters:
        for bad in (np.nan, np.inf, "1", None, True, 1j):
            if bad is None and name in ("friction_negative", "load_amplitude"):  # these may be left out
                continue
            with pytest.raises(ValueError, match=f"{re.escape(name)} = .* is not allowed"):
                element.with_parameters(**{name: bad})


@each
def test_every_reached_mode_is_well_formed(element):
    scene = scene_of(system_of(element))
    T = scene.tables
    assert scene.complete and len(scene.keys) <= 7
    assert np.isfinite(T.flat).all()
    for m in range(len(scene.keys)):
        for g in range(T.n_guards[m]):
            then = T.then[m, g][T.then[m, g] >= 0]
            assert then[-1] == m and len(set(then)) == len(then)
            assert scene.event_kind(m, g) in el.EventKind
            assert scene.element_name(m, g) == (element.label or element.default_label())
            assert scene.guard(m, g).element == 0


@each
def test_surfaces_and_kicks_agree_with_the_guards(element, rng):
    """After an event position guards vanish, a kick leaves s+ = -ratio s- along its direction, nothing else moves."""
    scene = scene_of(system_of(element))
    T, n, ns = scene.tables, scene.n, scene.ns
    for m in range(len(scene.keys)):
        for g in range(T.n_guards[m]):
            x = rng.normal(size=ns + scene.nw)
            x[ns] = 1.0
            y = T.R[m, g] @ x
            after = np.concatenate([y, x[ns:]])
            if T.D[m, g].any():
                assert abs(T.G[m, g] @ after) < 1e-14
                assert T.G[m, g, :ns] @ T.D[m, g] == pytest.approx(1.0, abs=1e-14)
                jump = y[:n] - x[:n]
                assert np.allclose(jump, T.D[m, g, :n] * (T.G[m, g, :n] @ jump), atol=1e-14)
            else:
                assert np.array_equal(y[:n], x[:n])
            stops = T.D[m, g, n:].any()
            joined = np.vstack([T.A[m], np.hstack([np.zeros((scene.nw, ns)), scene.frame.W])])
            slope = T.G[m, g] @ joined
            if T.kick[m, g] and not slope[:ns].any():  # a pulse: whatever the speed is
                assert T.R[m, g, n:2 * n, n:2 * n] == pytest.approx(np.eye(n), abs=1e-15) and not T.B[m, g].any()
            elif T.kick[m, g]:
                assert slope[:ns] @ T.B[m, g] == pytest.approx(1.0, abs=1e-14)
                on_surface = x.copy()
                on_surface[:ns] -= T.D[m, g] * (T.G[m, g] @ x)
                before = slope @ on_surface
                on_surface[:ns] = T.R[m, g] @ on_surface
                assert slope @ on_surface == pytest.approx(-T.ratio[m, g] * before, abs=1e-13)
                kick = y[n:2 * n] - x[n:2 * n]
                assert np.allclose(kick, T.B[m, g, n:2 * n] * (slope[n:2 * n] @ kick), atol=1e-14)
            else:
                jump = y[n:2 * n] - x[n:2 * n]
                along = T.D[m, g, n:2 * n] * (T.G[m, g, n:2 * n] @ jump)
                assert not T.B[m, g].any() and (np.allclose(jump, along, atol=1e-14) if stops else not jump.any())


@each
def test_held_rows_stay_held(element):
    """Along the flow of a mode its held speeds and surfaces are constant: their derivatives vanish where held."""
    scene = scene_of(system_of(element))
    T, ns = scene.tables, scene.ns
    for m in range(len(scene.keys)):
        joined = np.vstack([T.A[m], np.hstack([np.zeros((scene.nw, ns)), scene.frame.W])])
        for i in range(T.n_holds[m]):
            assert np.abs(T.H[m, i] @ joined).max() < 1e-14
            if T.S[m, i].any():
                direction = T.S[m, i] @ joined
                scale = direction[scene.n:2 * scene.n] @ T.H[m, i, scene.n:2 * scene.n]
                scale /= T.H[m, i, scene.n:2 * scene.n] @ T.H[m, i, scene.n:2 * scene.n]
                assert np.allclose(direction, scale * T.H[m, i], atol=1e-14)


@pytest.mark.parametrize("element", WITH_SLOPES, ids=lambda element: type(element).__name__)
def test_jacobian_of_a_law(element, rng):
    law = element.mode(element.start[0], None).law
    rows = element.site(2).count
    for _ in range(20):
        at = rng.normal(size=2 * rows)

        def force(x):
            return np.atleast_1d(law.function(*x, *law.values))

        exact = np.reshape(law.jacobian(*at, *law.values), (rows, 2 * rows))
        for j in range(2 * rows):
            step = np.zeros(2 * rows)
            step[j] = 1e-3  # eighth-order central difference: exact but for rounding on these laws
            weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
            slope = sum(w * (force(at + k * step) - force(at - k * step)) for k, w in weights.items()) / 1e-3
            assert np.allclose(exact[:, j], slope, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("element", [element for element in ELEMENTS if element.mirrored() is not None], ids=repr)
def test_mirror_is_the_image_under_reflection_and_half_a_period(element, rng):
    image = element.mirrored()
    assert image.mirrored() == element
    a, b = scene_of(system_of(element)), scene_of(system_of(image))
    ns = a.ns
    flip = -np.ones(ns + a.nw)  # (y, w) at t of the one is (-y, w) at t + half a period of the other
    flip[ns] = 1.0
    for i, k in enumerate(a.harmonics):
        flip[ns + 1 + 2 * i:ns + 3 + 2 * i] = (-1.0) ** k
    for m, (key,) in enumerate(a.keys):
        p = b.index((element.mirrored_key(key),))
        assert np.allclose(b.tables.A[p], -a.tables.A[m] * flip, atol=1e-15)
        for g in range(a.tables.n_guards[m]):
            h = element.mirrored_guard(key, g)
            assert np.allclose(b.tables.G[p, h], a.tables.G[m, g] * flip, atol=1e-15)
            assert np.allclose(b.tables.R[p, h], -a.tables.R[m, g] * flip, atol=1e-15)
            assert a.event_kind(m, g) == b.event_kind(p, h)
    of_key = {key: law for law in b.laws for key in law.keys}
    x = rng.normal(size=ns + a.nw)
    x[ns] = 1.0
    for law in a.laws:
        other = of_key[element.mirrored_key(law.keys[0])]
        forces = [np.array(one.law.function(*seen(scene, one, at), *one.law.values))
                  for scene, one, at in ((a, law, x), (b, other, x * flip))]
        assert np.allclose(-forces[0], forces[1], atol=1e-14)


def seen(scene, law, x):
    """Return coordinates and speeds of the rows of a law of a scene at the joined state ``x`` (nx,)."""
    first = sum(other.rows for other in scene.laws[:scene.laws.index(law)])
    rows = slice(first, first + law.rows)
    return np.concatenate([scene.tables.LU[rows] @ x, scene.tables.LS[rows] @ x])


def test_a_users_stop_is_the_built_in_one():
    def built(stop):
        return scene_of(System(1.7, 0.1, 1.0, [el.HarmonicForce(0.5), stop], omega=0.8))

    own, ours = built(UserStop(0.9, 0.6)), built(el.RigidStop(0.9, 0.6))
    assert np.array_equal(own.tables.flat, ours.tables.flat)
    for name in ("then", "kick", "ends_in", "silent", "element", "kind", "n_guards", "n_holds"):
        assert np.array_equal(getattr(own.tables, name), getattr(ours.tables, name))


def test_a_users_law_is_the_built_in_one():
    def duffing(spring):
        return scene_of(System(1.0, 0.1, 1.0, [el.HarmonicForce(0.5), spring], omega=0.8))

    own, ours = duffing(el.Force(lambda u, s, beta: -beta * u * u * u, site=0, beta=0.8)), duffing(el.CubicSpring(0.8))
    assert np.array_equal(own.tables.flat, ours.tables.flat)
    assert not own.closed_form
    assert own.laws[0].law.function(0.3, 0.1, 0.8) == ours.laws[0].law.function(0.3, 0.1, 0.8)


@pytest.mark.parametrize("mode, words", [
    (el.Mode(force=(u(), u())), "force has 2 entries"),
    (el.Mode(hold=(el.Hold(1, (1.0,)),)), "does not fit a site of 1 rows"),
    (el.Mode(hold=(el.Hold(0, (1.0, 2.0)),)), "does not fit a site of 1 rows"),
    (el.Mode(memory=(None,)), "memory has 1 entries"),
    (el.Mode(force=(u(3),)), r"u\(3\), which is not there"),
    (el.Mode(force=(wave(1.0, 7),)), r"cos\(7\), which is not there"),
    (el.Mode(guards=(el.Guard(lam(), el.EventKind.RELEASE, ()),)), r"lam\(0\), which is not there"),
    ("free", "it must be a Mode"),
])
def test_ill_formed_modes_are_named(mode, words):
    @dataclass(frozen=True)
    class Broken(el.Element):
        def site(self, n):
            return el.Rows.of(0, n)

        def mode(self, key, core):
            return mode

    with pytest.raises(ValueError, match=words):
        scene_of(system_of(Broken()))


def test_a_kick_that_is_not_affine_is_refused_by_name():
    @dataclass(frozen=True)
    class Bent:
        affine = False

        def impulse(self, s, W):
            return -s * np.abs(s), -2.0 * np.diag(np.abs(s))

    @dataclass(frozen=True)
    class Stop(el.Element):
        def site(self, n):
            return el.Rows.of(0, n)

        def mode(self, key, core):
            return el.Mode(guards=(el.Guard(u(), el.EventKind.IMPACT, (), Bent()),))

    with pytest.raises(ValueError, match="stop, mode 'always': the impact law .*Bent.* is not affine"):
        scene_of(system_of(Stop()))
