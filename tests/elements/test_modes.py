"""Every mode of every built-in element, written out once more in plain numbers: forces, guards, followers, memory, holds, bounds.

Values are taken at one state with nothing special about it, so that a sign, a factor or an exchanged term shows.
"""
import dataclasses
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.elements import EventKind as E
from bifurc.elements.feedback import DelayedFeedback
from bifurc.elements.local import Core, Frame, WatchedCore, affine, cos, lam, rate, s, sin, u, wave, z
from bifurc.elements.mode import Law, Restitution
from bifurc.elements.site import Ring, Rows, Surface

OMEGA, PHASE = 1.3, 0.7
U, S, Z, LAM = (0.37, -0.21), (-0.83, 0.59), (0.12, -0.45, 0.28), (0.64, -1.7)
MASS = np.array([[2.0, 0.3], [0.3, 1.0]])
DAMPING = np.array([[0.2, -0.1], [0.05, 0.3]])
CORE = Core(MASS, DAMPING, np.eye(2), OMEGA)
NO = "no guard"


def value(expression):
    """Return the number that an affine expression has at the state of this module."""
    known = {"u": U, "s": S, "z": Z, "lam": LAM, "one": (1.0,)}
    total = 0.0
    for (name, index), weight in affine(expression).terms.items():
        total += weight * (math.cos(index * PHASE) if name == "cos" else math.sin(index * PHASE) if name == "sin"
                           else known[name][index])
    return total


def at(amplitude, harmonic, phase, order=0):
    """Return amplitude cos(harmonic t + phase), or its rate, at the phase of this module."""
    turn = harmonic * PHASE + phase
    return amplitude * math.cos(turn) if order == 0 else -amplitude * harmonic * OMEGA * math.sin(turn)


def content(mode, count=1):
    """Return a mode as numbers: forces, guards (value, kind, then, silent, accumulates), memory, holds, bounds."""
    if mode.law is not None:
        size = 2 * count
        forces = tuple(np.atleast_1d(mode.law.function(*U[:count], *S[:count], *mode.law.values)).tolist())
        assert len(mode.law.jacobian(*U[:count], *S[:count], *mode.law.values)) == size * count
    else:
        forces = tuple(value(entry) for entry in mode.force)
    guards = [(value(guard.value), guard.kind, guard.then, guard.silent, guard.accumulates) for guard in mode.guards]
    memory = tuple(None if item is None else value(item.value) for item in mode.memory)
    holds = [(hold.row, hold.push, None if hold.surface is None else value(hold.surface)) for hold in mode.hold]
    return forces, guards, memory, holds, [tuple(map(value, pair)) for pair in mode.bounds]


def check(element, key, forces=(), guards=(), memory=(), holds=(), bounds=(), count=1):
    found = content(element.mode(key, CORE), count)
    assert found[0] == pytest.approx(forces, rel=1e-13)
    assert [item[1:] for item in found[1]] == [(kind, then, *rest, *(False, None)[len(rest):]) for _, kind, then, *rest in guards]
    assert [item[0] for item in found[1]] == pytest.approx([item[0] for item in guards], rel=1e-13)
    assert [item is None for item in found[2]] == [item is None for item in memory]
    assert [item for item in found[2] if item is not None] == pytest.approx([item for item in memory if item is not None])
    assert [item[:2] for item in found[3]] == [item[:2] for item in holds]
    for (*_, got), (*_, known) in zip(found[3], holds, strict=True):
        assert got is None if known is None else got == pytest.approx(known)
    assert found[4] == pytest.approx([pytest.approx(pair) for pair in bounds])


# ---- loads, springs ------------------------------------------------------------------------------------------------------------


def test_loads():
    check(el.HarmonicForce(0.7, 3, 0.4), "always", (at(0.7, 3, 0.4),))
    check(el.ConstantForce(-0.6), "always", (-0.6,))
    for row, carried in ((None, (1.0, 1.0)), ((0.5, -2.0), (0.5, -2.0))):
        x1, x2 = (at(0.3, 2, 0.4, 1), -4 * OMEGA**2 * at(0.3, 2, 0.4))  # speed and acceleration of the frame
        inertia, drag = MASS @ carried, DAMPING @ carried
        check(el.BaseMotion(0.3, 2, 0.4, row=row), "always", tuple(-inertia * x2), count=2)
        check(el.BaseMotion(0.3, 2, 0.4, "ground", row), "always", tuple(-inertia * x2 - drag * x1), count=2)
    assert el.BaseMotion().site(3).R.tolist() == np.eye(3).tolist()
    with pytest.raises(ValueError, match=r"BaseMotion: row = \(1.0, 2.0\) is not allowed; it must be 3 factors"):
        el.BaseMotion(row=(1.0, 2.0)).site(3)
    assert (el.HarmonicForce(harmonic=3).harmonics, el.BaseMotion(harmonic=2).harmonics) == ((3,), (2,))


def test_springs():
    check(el.LinearSpring(2.0, 0.3), "always", (-2.0 * U[0] - 0.3 * S[0],))
    check(el.CubicSpring(0.8), "always", (-0.8 * U[0]**3,))
    check(el.PolynomialSpring(0.1, -0.2, 0.3, 0.4), "always", (-0.1 * U[0]**2 + 0.2 * U[0]**3 - 0.3 * U[0]**4 - 0.4 * U[0]**5,))
    for of, what in (("displacement", U[0]), ("velocity", S[0])):
        feedback = DelayedFeedback(0.4, 2.0, of=of)
        check(feedback, "always", (-0.4 * what,))
        assert feedback.delayed and feedback.mirrored() is feedback
        assert feedback.delay_of(None) == 2.0 and feedback.delay_of(0.5) == pytest.approx(8.0 * np.pi)
    for repeat in (-0.1, 1.0):
        with pytest.raises(ValueError, match="it must be at least 0 and below 1"):
            DelayedFeedback(repeat=repeat)


@pytest.mark.parametrize("element, energy", [
    (el.ConstantForce(0.7), lambda x: -0.7 * x), (el.LinearSpring(2.0), lambda x: x * x), (el.LinearSpring(2.0, 0.1), None),
    (el.CubicSpring(0.8), lambda x: 0.2 * x**4), (el.HarmonicForce(), None), (el.Coulomb(), None),
    (el.PolynomialSpring(0.3, 0.4, 0.5, 0.6), lambda x: 0.1 * x**3 + 0.1 * x**4 + 0.1 * x**5 + 0.1 * x**6),
    (el.RigidStop(0.2, 1.0), lambda x: 0.0), (el.RigidStop(0.2, 0.999), None), (el.ElasticStop(0.2, 4.0, 0.1), None),
    (el.ElasticStop(0.2, 4.0), lambda x: 2.0 * max(x - 0.2, 0.0)**2),
    (el.ElasticStop(0.2, 4.0, side=-1), lambda x: 2.0 * max(-x - 0.2, 0.0)**2)])
def test_energies(element, energy):
    for x in (0.9, -0.7, 0.1):
        found = element.stored_energy([x])
        assert found is None if energy is None else found == pytest.approx(energy(x), rel=1e-14)


# ---- stops ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
def test_stops(side):
    depth = side * U[0] - 0.25
    rigid = el.RigidStop(0.25, 0.6, side=side)
    check(rigid, "free", guards=[(depth, E.IMPACT, ("rest", "free"), False, (0.6, "rest"))])
    check(rigid, "rest", guards=[(side * LAM[0], E.RELEASE, ("free",))], holds=[(0, (1.0,), depth)])
    assert rigid.mode("free", CORE).guards[0].kick == Restitution(0.6) and rigid.start == ("free", "rest")
    soft = el.ElasticStop(0.25, 4.0, 0.3, side=side)
    force = 4.0 * depth + 0.3 * side * S[0]
    check(soft, "free", guards=[(depth, E.CONTACT, ("contact",))])
    check(soft, "contact", (-side * force,), [(-depth, E.SEPARATION, ("free",))])
    let = dataclasses.replace(soft, release="force")
    check(let, "free", guards=[(depth, E.CONTACT, ("contact",))])
    check(let, "contact", (-side * force,), [(-force, E.SEPARATION, ("free", "separating"))])
    check(let, "separating", guards=[(-depth, E.SEPARATION, ("free",), True), (force, E.CONTACT, ("contact",))])
    assert soft.start == ("free", "contact") and let.start == ("free", "contact", "separating")


def test_moving_walls_are_seen_from_the_wall():
    wall = el.RigidStop(0.4, side=-1, amplitude=0.2, phase=0.3, harmonic=2, dof=1)
    site = wall.site(2)
    assert site.R.tolist() == [[0.0, 1.0]] and value(site.base[0]) == pytest.approx(-at(0.2, 2, 0.3))
    assert el.RigidStop().site(2).base == ()
    image = wall.mirrored()
    assert (image.side, image.amplitude, image.phase) == (1, -0.2, 0.3)
    assert el.ElasticStop(amplitude=0.2, harmonic=1).mirrored().amplitude == 0.2
    assert wall.surface == Surface(1, -0.4, -1, True, 0.2, 2, 0.3)
    assert el.ElasticStop(0.4, row=(1.0, -1.0)).surface == Surface(None, 0.4, 1, False, 0.0, 0, 0.0)
    assert el.HarmonicForce().surface is None and el.HarmonicForce().ring is None


def test_newtons_law_of_restitution(rng):
    """s+ = -r s- in all rows, whatever the masses, with the impulse's derivative."""
    R = np.array([[1.0, 0.5], [0.2, -1.0]])
    W = R @ np.linalg.inv(MASS) @ R.T
    for rows in (1, 2):
        speed, w = rng.normal(size=rows), W[:rows, :rows]
        impulse, slope = Restitution(0.6).impulse(speed, w)
        assert speed + w @ impulse == pytest.approx(-0.6 * speed) and slope @ speed == pytest.approx(impulse)
    assert Restitution.affine


# ---- friction ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", [{}, {"load_amplitude": 0.4, "load_harmonic": 2, "load_phase": 0.3}])
def test_dry_friction(how):
    load = 1.0 + at(0.4, 2, 0.3) if how else 1.0
    leaves = [(-load, E.SEPARATION, ("apart",))] if how else []
    dry = el.Coulomb(0.5, 0.3, 1.2, belt_speed=0.2, **how)
    up, down = 0.5 * load, 0.3 * load
    check(dry, "stick", holds=[(0, (1.0,), None)], bounds=[(-1.2 * up, 1.2 * down)], guards=[
        (-1.2 * up - LAM[0], E.SLIP, ("slip+",)), (LAM[0] - 1.2 * down, E.SLIP, ("slip-",)), *leaves])
    check(dry, "slip+", (-up,), [(-S[0], E.STICK, ("stick", "slip-")), *leaves])
    check(dry, "slip-", (down,), [(S[0], E.STICK, ("stick", "slip+")), *leaves])
    check(dry, "apart", guards=[(load, E.CONTACT, ("stick", "slip+", "slip-"))])
    assert dry.start == (("stick", "slip+", "slip-", "apart") if how else ("stick", "slip+", "slip-"))
    assert dry.harmonics == ((2,) if how else ()) and dry.limits == (0.5, 0.3) and el.Coulomb(0.5).limits == (0.5, 0.5)
    assert value(dry.load) == pytest.approx(load) and dry.varies is bool(how)
    assert dry.site(1).drift == (-0.2,) and el.Coulomb().site(1).drift == ()
    image = dry.mirrored()
    assert (image.friction, image.friction_negative, image.belt_speed) == (0.3, 0.5, -0.2)
    assert image.load_amplitude == how.get("load_amplitude") and el.Coulomb(load_amplitude=0.4).mirrored().load_amplitude == -0.4
    assert el.Coulomb(0.5).mirrored().friction_negative is None


@pytest.mark.parametrize("how", [{}, {"load_amplitude": 1.4, "load_harmonic": 2, "load_phase": 0.3}])
def test_elastic_dry_friction(how):
    load = 1.0 + at(1.4, 2, 0.3) if how else 1.0
    rising = 0.3 * at(1.4, 2, 0.3, 1) / 2.0 if how else 0.0  # rate of the limit over the stiffness
    leaves = [(-load, E.SEPARATION, ("apart",))] if how else []
    slider, force = el.Jenkins(2.0, 0.3, **how), 2.0 * (U[0] - Z[0])
    check(slider, "stick", (-force,), [
        (force - 0.3 * load, E.SLIP, ("slip+",)), (-force - 0.3 * load, E.SLIP, ("slip-",)), *leaves])
    check(slider, "slip+", (-0.3 * load,), [(-(S[0] - rising), E.STICK, ("stick", "slip-")), *leaves],
          memory=(U[0] - 0.15 * load,))
    check(slider, "slip-", (0.3 * load,), [(S[0] + rising, E.STICK, ("stick", "slip+")), *leaves], memory=(U[0] + 0.15 * load,))
    check(slider, "apart", guards=[(load, E.CONTACT, ("stick", "slip+", "slip-"))], memory=(U[0],))
    assert slider.virgin == (u(0),) and slider.memory == ("slider",)


def test_who_is_loaded_and_how_images_are_numbered():
    slider = el.Jenkins(2.0, 0.3, load_amplitude=1.5)
    assert slider.loaded("stick", 0) and not slider.loaded("apart", 0)
    assert [slider.mirrored_key(key) for key in slider.start] == ["stick", "slip-", "slip+", "apart"]
    assert [slider.mirrored_guard("stick", g) for g in (0, 1, 2)] == [1, 0, 2] and slider.mirrored_guard("slip+", 1) == 1
    for falling in (el.Stribeck(), el.CubicFriction()):
        assert [falling.mirrored_key(key) for key in falling.start] == ["stick", "slip-", "slip+"]
        assert [falling.mirrored_guard("stick", g) for g in (0, 1)] == [1, 0] and falling.mirrored_guard("slip-", 0) == 0
    chain = el.LoadedMicroSlip(1.0, 1.0, (1.0, 1.0), (0.5, 0.5))
    assert chain.loaded("sa", 0) and not chain.loaded("sa", 1)


def test_falling_friction():
    for curve, falls in (("exponential", lambda x: math.exp(-x)), ("hyperbolic", lambda x: 1.0 / (1.0 + x))):
        law = el.Stribeck(0.5, 0.8, 0.3, curve, belt_speed=0.4)
        check(law, "slip-", (0.5 + 0.3 * falls(-S[0] / 0.3),), [(S[0], E.STICK, ("stick", "slip+"))])
        check(law, "slip+", (-0.5 - 0.3 * falls(S[0] / 0.3),), [(-S[0], E.STICK, ("stick", "slip-"))])
        check(law, "stick", holds=[(0, (1.0,), None)], bounds=[(-0.8, 0.8)],
              guards=[(-0.8 - LAM[0], E.SLIP, ("slip+",)), (LAM[0] - 0.8, E.SLIP, ("slip-",))])
        assert law.site(1).drift == (-0.4,) and law.mirrored().belt_speed == -0.4
    cubic = el.CubicFriction(0.8, 0.3, 0.1)
    check(cubic, "slip+", (-0.8 + 0.3 * S[0] - 0.1 * S[0]**3,), [(-S[0], E.STICK, ("stick", "slip-"))])
    check(cubic, "slip-", (0.8 + 0.3 * S[0] - 0.1 * S[0]**3,), [(S[0], E.STICK, ("stick", "slip+"))])
    for key in ("slip+", "slip-"):
        law = cubic.mode(key, CORE).law
        assert law.jacobian(U[0], S[0], *law.values) == pytest.approx((0.0, 0.3 - 0.3 * S[0]**2))
    smooth = el.RegularizedFriction(0.5, 0.4)
    check(smooth, "always", (-0.5 * math.tanh(S[0] / 0.4),))
    law = smooth.mode("always", CORE).law
    assert law.jacobian(U[0], S[0], *law.values) == pytest.approx((0.0, -0.5 / 0.4 / math.cosh(S[0] / 0.4)**2))


@pytest.mark.parametrize("make, words", [
    (lambda: el.Coulomb(-0.1), "friction = -0.1 .* at least 0"), (lambda: el.Coulomb(0.1, -0.1), "friction_negative = -0.1"),
    (lambda: el.Coulomb(static_ratio=0.99), "static_ratio = 0.99 .* at least 1"), (lambda: el.Stribeck(-1.0), "kinetic = -1"),
    (lambda: el.Stribeck(1.0, 0.9), "static = 0.9 is not allowed; it must be at least kinetic = 1"),
    (lambda: el.Stribeck(speed=0.0), "speed = 0.0 .* above 0"), (lambda: el.Stribeck(curve="linear"), "curve = 'linear'"),
    (lambda: el.CubicFriction(-1.0), "static = -1"), (lambda: el.RegularizedFriction(-1.0), "friction = -1"),
    (lambda: el.RegularizedFriction(width=0.0), "width = 0.0 .* above 0"), (lambda: el.Jenkins(0.0), "stiffness = 0.0 .* above 0"),
    (lambda: el.Jenkins(1.0, -1.0), "limit = -1"), (lambda: el.Jenkins(load_phase=0.1), "load_phase = 0.1 is not allowed with a"),
    (lambda: el.Jenkins(load_harmonic=2), "load_harmonic = 2 is not allowed with a constant load"),
    (lambda: el.Coulomb(load_harmonic=0, load_amplitude=0.1), "load_harmonic = 0"), (lambda: el.OilFilm(size=0.0), "size = 0"),
    (lambda: el.ElasticStator(stiffness=0.0), "stiffness = 0"), (lambda: el.ElasticStator(damping=-1.0), "damping = -1"),
    (lambda: el.ElasticStator(friction=-1.0), "friction = -1"), (lambda: el.ElasticStator(release="x"), "release = 'x'"),
    (lambda: el.ElasticStator(radius=0.0), "radius = 0"), (lambda: el.RigidStator(restitution=1.1), "restitution = 1.1"),
    (lambda: el.RigidStator(restitution=-0.1), "restitution = -0.1"), (lambda: el.RigidStator(friction=-0.1), "friction = -0.1"),
    (lambda: el.ElasticStator(against_x=2), "give both degrees of freedom of the second body, or none"),
    (lambda: el.ElasticStator(against_y=2), "give both degrees of freedom of the second body, or none"),
    (lambda: el.ElasticStator(x=3).site(2), "degree of freedom 3 is not allowed; there are 0 to 1"),
    (lambda: el.ElasticStator(y=-1).site(2), "y = -1 is not allowed"), (lambda: el.RigidStop(dof=1.5), "dof = 1.5"),
    (lambda: DelayedFeedback(delay=0.0), "delay = 0.0"),
    (lambda: el.LoadedMicroSlip(0.0), "spring = 0"), (lambda: el.LoadedMicroSlip(1.0, 0.0), "contact = 0"),
    (lambda: el.LoadedMicroSlip(1.0, 1.0, (1.0, 2.0), (0.5,)), "load_amplitudes = .* one a contact"),
    (lambda: el.LoadedMicroSlip(1.0, 1.0, (1.0,), (0.5,), (0.1, 0.2)), "load_phases = .* one a contact"),
    (lambda: el.LoadedMicroSlip(1.0, 1.0, (-1.0,)), r"limits\[0\] = -1"),
    (lambda: el.LoadedMicroSlip(load_harmonic=0), "harmonic = 0"),
    (lambda: el.Driven(el.Jenkins(), harmonic=0), "harmonic = 0"),
    (lambda: el.Driven(el.BaseMotion()).site(2), "has 2 rows; only elements with one row can be driven"),
    (lambda: el.Driven(el.Coulomb()).mode("stick", CORE), "stops or holds its coordinate"),
    (lambda: el.Driven(el.RigidStop()).mode("free", CORE), "stops or holds its coordinate"),
])
def test_bad_arguments_are_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


# ---- stators -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("release", ["force", "penetration"])
def test_the_elastic_stator(release):
    ring = el.ElasticStator(stiffness=5.0, damping=0.4, friction=0.2, release=release)
    depth, load = U[0], 5.0 * U[0] + 0.4 * S[0]
    leaves = (-load, E.SEPARATION, ("free", "separating")) if release == "force" else (-depth, E.SEPARATION, ("free",))
    check(ring, "free", guards=[(depth, E.CONTACT, ("slip+", "slip-", "roll", "separating"))], count=2)
    check(ring, "separating", guards=[(-depth, E.SEPARATION, ("free",)), (load, E.CONTACT, ("slip+", "slip-", "roll"))], count=2)
    check(ring, "slip+", (-load, -0.2 * load), [leaves, (-S[1], E.STICK, ("roll", "slip-"))], count=2)
    check(ring, "slip-", (-load, 0.2 * load), [leaves, (S[1], E.STICK, ("roll", "slip+"))], count=2)
    check(ring, "roll", (-load, 0.0), [leaves, (LAM[0] - 0.2 * load, E.SLIP, ("slip-", "slip+")),
                                       (-LAM[0] - 0.2 * load, E.SLIP, ("slip+", "slip-"))], holds=[(1, (0.0, 1.0), None)], count=2)
    assert ring.start == ("free", "slip+", "slip-", "roll", "separating") and ring.isotropic and not ring.rigid


def test_the_rigid_stator():
    ring = el.RigidStator(restitution=0.7, friction=0.2)
    core = Core(2.5 * np.eye(2), DAMPING, np.eye(2), None)
    mode = ring.mode("free", core)
    (guard,) = mode.guards
    assert (value(guard.value), guard.kind, guard.accumulates) == (U[0], E.IMPACT, (0.7, "slip+"))
    assert guard.then == ("free", "slip+", "slip-", "roll") and guard.kick.values == (0.7, 0.2, 2.5)
    normal, tangential = guard.kick.function(0.0, 0.0, 0.8, 0.1, 0.7, 0.2, 2.5)
    assert (normal, tangential) == pytest.approx((-1.7 * 0.8 * 2.5, -0.1 * 2.5))  # sliding stops
    for way in (1.0, -1.0):
        assert guard.kick.function(0.0, 0.0, 0.8, way * 3.0, 0.7, 0.2, 2.5) == pytest.approx((-3.4, -way * 0.68))
    cone = 0.2 * LAM[0]
    check(ring, "roll", holds=[(0, (1.0, 0.0), U[0]), (1, (0.0, 1.0), None)], guards=[
        (LAM[0], E.RELEASE, ("free",)), (LAM[1] + cone, E.SLIP, ("slip-", "slip+")), (-LAM[1] + cone, E.SLIP, ("slip+", "slip-"))])
    leaves = (-LAM[0], E.RELEASE, ("free",))
    check(ring, "slip+", holds=[(0, (-1.0, -0.2), U[0])], guards=[leaves, (-S[1], E.STICK, ("roll", "slip-"))])
    check(ring, "slip-", holds=[(0, (-1.0, 0.2), U[0])], guards=[leaves, (S[1], E.STICK, ("roll", "slip+"))])
    for mass, fits in ((np.diag([1.0, 1.0 + 5e-13]), True), (np.diag([1.0, 1.0 + 5e-12]), False),
                       (np.array([[1.0, 5e-13], [5e-13, 1.0]]), True), (np.array([[1.0, 5e-12], [5e-12, 1.0]]), False)):
        other = core._replace(mass=mass)
        if fits:
            ring.mode("free", other)
        else:
            with pytest.raises(ValueError, match="the masses met along x and y are not the same"):
                ring.mode("free", other)


def test_places_of_stators_and_bearings():
    ring = el.RigidStator(x=2, y=0, against_x=1, against_y=3, centre_x=0.3, centre_y=-0.2, radius=0.7, surface_speed=1.1,
                          frame_spin=0.4)
    site = ring.site(4)
    assert site.R.tolist() == [[0.0, -1.0, 1.0, 0.0], [1.0, 0.0, 0.0, -1.0]]
    assert (site.centre, site.radius, site.surface_speed, site.spin) == ((0.3, -0.2), 0.7, 1.1, 0.4)
    assert ring.ring == Ring((0.3, -0.2), 0.7, (2, 0), (1, 3), True)
    assert el.ElasticStator(x=1, y=0).ring == Ring((0.0, 0.0), 1.0, (1, 0), None, False)
    alone = el.ElasticStator(x=1, y=0).site(2)
    assert alone.R.tolist() == [[0.0, 1.0], [1.0, 0.0]] and (alone.surface_speed, alone.spin, alone.radius) == (0.0, 0.0, 1.0)
    assert type(alone).around([[1, 0], [0, 1]], 2).centre == (0.0, 0.0)
    for rows, words in (([[1.0, 0.0]], "two independent rows"), ([[1.0, 0.0], [2.0, 0.0]], "two independent rows")):
        with pytest.raises(ValueError, match=words):
            type(alone).around(rows, 2)
    with pytest.raises(ValueError, match="Circle: radius = 0.0"):
        type(alone).around([[1, 0], [0, 1]], 2, radius=0.0)
    film = el.OilFilm(x=2, y=0, size=1.5)
    assert film.site(3).R.tolist() == [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]] and film.mode("always", CORE).law.values == (1.5,)


# ---- sets of sliders -----------------------------------------------------------------------------------------------------------


def test_a_parallel_set():
    """Sliders in the order of limit over stiffness: 2, 0, 1; the memory of what sticks holds."""
    k, limits = (1.0, 2.0, 4.0), (0.3, 0.9, 0.8)
    flat = el.Iwan(k, limits)
    assert flat.order == ((2,), (0,), (1,)) and flat.thresholds == pytest.approx([0.2, 0.3, 0.45])
    pulls = [k[i] * (U[0] - Z[i]) for i in range(3)]
    check(flat, "stick", (-sum(pulls),), [(pulls[2] - 0.8, E.SLIP, ("slip+1",)), (-pulls[2] - 0.8, E.SLIP, ("slip-1",))],
          memory=(None, None, None))
    for way, sign in ((1.0, "+"), (-1.0, "-")):
        check(flat, f"slip{sign}1", (-(pulls[0] + pulls[1] + way * 0.8),), [
            (-way * S[0], E.STICK, ("stick",)), (way * pulls[0] - 0.3, E.SLIP, (f"slip{sign}2",))],
            memory=(None, None, U[0] - way * 0.2))
        check(flat, f"slip{sign}3", (-way * 2.0,), [(-way * S[0], E.STICK, ("stick",))],
              memory=(U[0] - way * 0.3, U[0] - way * 0.45, U[0] - way * 0.2))
    assert flat.start == ("stick", "slip+1", "slip-1", "slip+2", "slip-2", "slip+3", "slip-3")
    assert flat.memory == ("slider[0]", "slider[1]", "slider[2]") and flat.virgin == (u(0),) * 3 and flat.count == 3
    assert flat.mirrored() is flat and flat.mirrored_key("slip+2") == "slip-2" and flat.mirrored_key("stick") == "stick"
    assert flat.mirrored_guard("stick", 0) == 1 and flat.mirrored_guard("slip+1", 1) == 1
    assert flat.with_parameters(**{"limits[1]": 0.5, "stiffnesses[0]": 3.0}) == el.Iwan((3.0, 2.0, 4.0), (0.3, 0.5, 0.8))
    assert flat.parameters == {**{f"stiffnesses[{i}]": k[i] for i in range(3)}, **{f"limits[{i}]": limits[i] for i in range(3)}}
    absent = el.Iwan((1.0, 2.0), (0.0, 0.4))
    check(absent, "stick", (-2.0 * (U[0] - Z[1]),), [(2.0 * (U[0] - Z[1]) - 0.4, E.SLIP, ("slip+1",)),
                                                     (-2.0 * (U[0] - Z[1]) - 0.4, E.SLIP, ("slip-1",))], memory=(None, None))
    assert absent.structure != flat.structure and absent.structure == el.Iwan((3.0, 1.0), (0.0, 0.7)).structure


def chain(n, spring, closed):
    """Return the stiffness of blocks in a row or a ring, from its energy."""
    D = np.eye(n) - np.roll(np.eye(n), 1, axis=1) if closed else np.eye(n)[:-1] - np.eye(n)[1:]
    return spring * D.T @ D


@pytest.mark.parametrize("closed", [False, True])
def test_a_bar_of_sliders_is_its_statics(closed):
    """Blocks behind the driven one from K x + contact forces = 0, solved here as one dense system."""
    n, spring, k, limits = 3, 2.0, 1.3, (0.5, 0.2, 0.6)
    bar = el.MicroSlip(spring, k, limits, closed)
    K = chain(n, spring, closed)
    for slips, way in (((), 0.0), (bar.order[0], 1.0), (bar.order[0], -1.0), (bar.order[0] + bar.order[1], -1.0)):
        held = np.array([0.0 if i in slips else k for i in range(n)])
        push = np.array([way * limits[i] if i in slips else 0.0 for i in range(n)])
        A, right = K + np.diag(held), held * np.array(Z) - push
        x = np.concatenate([[U[0]], np.linalg.solve(A[1:, 1:], right[1:] - A[1:, 0] * U[0])])
        force = A[0] @ x - right[0]
        groups = 0 if not slips else 1 if slips == bar.order[0] else 2
        key = "stick" if not slips else f"slip{'+' if way > 0 else '-'}{groups}"
        following = bar.order[groups][0]
        pull = k * (x[following] - Z[following])
        memory = tuple(x[i] - way * limits[i] / k if i in slips else None for i in range(n))
        signs = (1.0, -1.0) if not slips else (way,)
        guards = ([(-way * S[0], E.STICK, ("stick",))] if slips else []) + [
            (sign * pull - limits[following], E.SLIP, (f"slip{'+' if sign > 0 else '-'}{groups + 1}",)) for sign in signs]
        check(bar, key, (-force,), guards, memory)
    assert bar.structure[1:] == (closed, 0, None, (True, True, True), len(bar.order))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("key", ["s+-a", "ssss", "-s+s", "a+s-"])
def test_a_chain_under_varying_loads_is_its_statics(key, closed):
    n, spring, k = 4, 2.0, 1.3
    limits, amplitudes, phases = (0.5, 0.2, 0.6, 0.4), (0.3, -0.2, 0.9, 0.5), (0.1, 0.2, 0.3, 0.4)
    bar = el.LoadedMicroSlip(spring, k, limits, amplitudes, phases, 2, closed)
    grips = (*Z, 0.33)
    known = dict(zip((("z", i) for i in range(4)), grips, strict=True))
    most = np.array([m * (1.0 + at(a, 2, p)) for m, a, p in zip(limits, amplitudes, phases, strict=True)])
    rates = np.array([m * at(a, 2, p, 1) for m, a, p in zip(limits, amplitudes, phases, strict=True)])
    sign = np.array([{"+": 1.0, "-": -1.0}.get(letter, 0.0) for letter in key])
    stuck = np.array([letter == "s" for letter in key])

    def blocks(drive, grip, pushed):
        A = chain(n, spring, closed) + np.diag(k * stuck)
        right = np.where(stuck, k * np.array(grip), 0.0) - sign * pushed
        x = np.concatenate([[drive], np.linalg.solve(A[1:, 1:], right[1:] - A[1:, 0] * drive)])
        return x, A[0] @ x - right[0]

    x, force = blocks(U[0], grips, most)
    dx, _ = blocks(S[0], np.zeros(n), rates)
    mode = bar.mode(key, CORE)

    def number(expression):
        return sum(weight * (known[name] if name in known else value(type(expression)({name: 1.0})))
                   for name, weight in expression.terms.items())

    assert number(mode.force[0]) == pytest.approx(-force, rel=1e-12)
    expected, memory = [], []
    for i, letter in enumerate(key):
        if letter == "a":
            expected.append((most[i], E.CONTACT))
            memory.append(x[i])
            continue
        if letter == "s":
            expected += [(k * (x[i] - grips[i]) - most[i], E.SLIP), (-k * (x[i] - grips[i]) - most[i], E.SLIP)]
            memory.append(None)
        else:
            expected.append((rates[i] / k - sign[i] * dx[i], E.STICK))
            memory.append(x[i] - sign[i] * most[i] / k)
        expected.append((-most[i], E.SEPARATION))
    assert [guard.kind for guard in mode.guards] == [kind for _, kind in expected]
    assert [number(guard.value) for guard in mode.guards] == pytest.approx([item for item, _ in expected], rel=1e-12)
    assert [None if item is None else pytest.approx(number(item.value), rel=1e-12) for item in mode.memory] == memory
    turned = key.translate(str.maketrans("+-", "-+"))
    assert bar.mirrored_key(key) == turned and bar.mirrored() is bar
    images, kinds = [bar.mirrored_guard(key, g) for g in range(len(expected))], [kind for _, kind in expected]
    assert sorted(images) == list(range(len(expected))) and [kinds[image] for image in images] == kinds
    assert [images[g] != g for g in range(len(expected))] == [kind is E.SLIP for kind in kinds]
    with pytest.raises(IndexError):
        bar.mirrored_guard(key, len(expected))


def test_loads_of_a_chain():
    bar = el.LoadedMicroSlip(1.0, 2.0, (0.5, 0.0, 0.4), (1.5, 0.2, 0.1), load_harmonic=1)
    assert bar.load_phases == (0.0, 0.0, 0.0) and bar.harmonics == (1,) and bar.mirrored().load_amplitudes == (-1.5, -0.2, -0.1)
    assert bar.start == ("sas", "aas")  # the second has no limit, the first lets go where 1 + 1.5 cos < 0
    assert bar.mode("sas", CORE).memory[1] is None and len(bar.mode("sas", CORE).guards) == 6
    assert bar.structure == (el.LoadedMicroSlip, 0, None, 3, 1, False)
    shifted = el.LoadedMicroSlip(1.0, 2.0, (0.5, 0.4), (1.5, 1.5), (0.0, np.pi))
    assert shifted.start == ("ss", "as", "sa") or set(shifted.start) == {"ss", "as", "sa"}


# ---- what is driven, what is placed --------------------------------------------------------------------------------------------


def test_a_driven_element_feels_the_motion_alone():
    inner = el.Jenkins(2.0, 0.3, load_amplitude=1.4, load_harmonic=3)
    driven = el.Driven(inner, 0.7, 2, 0.4)
    site = driven.site(2)
    assert not site.R.any() and site.R.shape == (1, 2) and value(site.base[0]) == pytest.approx(at(0.7, 2, 0.4))
    moved = el.Driven(el.ElasticStop(0.1, amplitude=0.2, harmonic=1, phase=0.3), 0.7, 2, 0.4).site(1)
    assert value(moved.base[0]) == pytest.approx(at(0.7, 2, 0.4) - at(0.2, 1, 0.3))
    assert el.Driven(el.RegularizedFriction(belt_speed=0.3), 0.7).site(1).drift == (-0.3,)
    for name in ("start", "memory", "virgin", "harmonics"):
        assert getattr(driven, name) == getattr(inner, name)
    assert driven.label == "jenkins" and el.Driven(dataclasses.replace(inner, label="x")).label == "x"
    assert el.Driven(inner, label="own").label == "own" and driven.structure == (el.Driven, 2, inner.structure)
    assert content(driven.mode("slip+", CORE)) == content(inner.mode("slip+", CORE))
    assert driven.loaded("stick", 0) and not driven.loaded("apart", 0)
    image = driven.mirrored()
    assert (image.amplitude, image.element) == (-0.7, inner.mirrored()) and el.Driven(inner, 0.7, 1).mirrored().amplitude == 0.7
    assert el.Driven(el.Force(lambda u, s: -u)).mirrored() is None
    assert driven.mirrored_key("slip+") == "slip-" and driven.mirrored_guard("stick", 0) == 1
    changed = driven.with_parameters(amplitude=0.1, limit=0.5, harmonic=3)
    assert (changed.amplitude, changed.harmonic, changed.element.limit, changed.phase) == (0.1, 3, 0.5, 0.4)
    assert driven.with_parameters(element=el.LinearSpring(1.0), stiffness=3.0).element == el.LinearSpring(3.0)
    assert el.Driven.from_record(driven.to_record()) == driven
    with pytest.raises(ValueError, match="uses the element 'Own'; hand its class over"):
        el.Driven.from_record({**driven.to_record(), "element": {"class": "Own"}})


def test_elements_are_placed_by_name():
    at_name = el.RigidStop(dof="tip")
    assert at_name.placed({"tip": 4}.get).dof == 4
    numbered = el.RigidStop(dof=2)
    assert numbered.placed(None) is numbered and el.ElasticStator().placed(None) == el.ElasticStator()
    force = el.Force(lambda u, s: -u, site="tip")
    assert force.placed({"tip": 3}.get).where == 3 and force.placed({"tip": 3}.get).placed(None).where == 3
    assert type(el.RigidStop(dof=np.int64(1)).dof) is int


def twist(u0, u1, s0, s1, a, b):
    return a * u0, b * s1


def twist_slope(u0, u1, s0, s1, a, b):
    return a, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, b


def test_a_users_law_goes_through_its_record():
    two = el.Force(twist, twist_slope, site=[[1.0, 0.0, 2.0], [0.0, 1.0, 0.0]], odd=True, label="x", b=0.3, a=0.2)
    assert two.parameters == {"a": 0.2, "b": 0.3} and two.where == ((1.0, 0.0, 2.0), (0.0, 1.0, 0.0))
    found = el.Force.from_record(two.to_record(), {"twist": twist, "twist_slope": twist_slope})
    assert found == two and found.odd and found.label == "x" and found.jacobian is twist_slope and hash(found) == hash(two)
    for name in ("twist", "twist_slope"):
        with pytest.raises(ValueError, match=f"the record uses the law '{name}'"):
            el.Force.from_record(two.to_record(), {other: twist for other in ("twist", "twist_slope") if other != name})
    row = el.Force(lambda u, s: -u, site=(0.0, 1.0))
    assert row.where == (0.0, 1.0) and row.seated(1).where == 1 and row.mirrored() is None and two.mirrored() is two
    assert row.site(2).R.tolist() == [[0.0, 1.0]] and two.site(3).count == 2
    assert two.seated(np.eye(3)[:2]).where == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) and two.seated(np.eye(3)[:2]).label == "x"
    assert two != dataclasses and two.with_parameters(a=0.4) != two and two.with_parameters(label="y") != two
    assert two.stored_energy([0.1, 0.2]) is None
    with pytest.raises(ValueError, match="gives NaN wherever it was tried"):
        el.Force(lambda u, s: math.nan)
    assert el.Force(lambda u, s: math.sqrt(u)).parameters == {}  # beyond its domain at some places only
    assert el.Force(lambda u, s, k: math.nan if u > 0.5 else k, k=1.0).values == {"k": 1.0}


# ---- expressions, frames, checks -----------------------------------------------------------------------------------------------


def test_expressions_by_their_names():
    for make, name in ((u, "u"), (s, "s"), (z, "z"), (lam, "lam")):
        assert make().terms == {(name, 0): 1.0} and make(2).terms == {(name, 2): 1.0}
    assert cos().terms == {("cos", 1): 1.0} and sin().terms == {("sin", 1): 1.0}
    assert wave(2.0).terms == {("cos", 1): 2.0, ("sin", 1): 0.0}
    assert rate(3.0 * cos(2) + 5.0 + sin(1), 0.5).terms == {("sin", 2): -3.0, ("cos", 1): 0.5}
    assert (u() + u()).terms == {("u", 0): 2.0} and (4.0 - u()).terms == {("one", 0): 4.0, ("u", 0): -1.0}
    assert (u() / 4.0 - s()).terms == {("u", 0): 0.25, ("s", 0): -1.0} and (u() + cos(3)).harmonics == {3}


def test_frames_count_their_columns_and_note_the_frequency():
    frame = Frame(2, 1, (1, 3), 0.5)
    assert (frame.ns, frame.nx) == (5, 10) and not frame.read
    assert frame.columns == {("one", 0): 5, ("cos", 1): 6, ("sin", 1): 7, ("cos", 3): 8, ("sin", 3): 9}
    other = frame.at(0.7)
    assert not other.read and not frame.read and other.omega == 0.7 and other.read and not frame.read
    assert frame.at(0.5) is frame and frame.at(None) is frame and Frame(1, 0, (), None).at(0.3).omega is None
    for omega in (0.5 * (1.0 + 1e-7), np.nextafter(0.5, 1.0), 0.5 + 1e-9, 1e-9, 2e-9):  # of a difference quotient, and slow ones
        near = frame.at(omega)
        assert near.omega == omega and near.at(0.5).omega == 0.5 and near.columns == frame.columns
        np.testing.assert_allclose(near.W[3:, 3:], [[0.0, -3.0 * omega], [3.0 * omega, 0.0]], rtol=1e-15)
    W = frame.W
    assert frame.read and W[1:3, 1:3].tolist() == [[0.0, -0.5], [0.5, 0.0]] and W[3:, 3:].tolist() == [[0.0, -1.5], [1.5, 0.0]]
    local = {"u": np.eye(10)[:2], "z": np.eye(10)[4:5]}
    assert frame.row(2.0 * u(1) - z(0) + 3.0 + 0.5 * sin(3), local).tolist() == [0, 2, 0, 0, -1, 3, 0, 0, 0, 0.5]
    assert frame.row(4.0).tolist() == [0, 0, 0, 0, 0, 4, 0, 0, 0, 0]
    for expression, known in ((u(2), local), (s(0), local), (cos(2), None)):
        with pytest.raises(ValueError, match="which is not there; harmonics must be listed in `harmonics` of the element"):
            frame.row(expression, known)


def test_a_core_notes_whether_more_than_its_matrices_is_read():
    for look, noted in ((lambda core: core.mass, False), (lambda core: core.damping, False), (lambda core: core.omega, True),
                        (lambda core: core[0], True), (lambda core: tuple(core), True)):
        core = WatchedCore(CORE)
        look(core)
        assert core.read is noted
    assert WatchedCore(CORE).omega == OMEGA


def test_limits_of_numbers():
    from bifurc import checks

    assert checks.number("x", "y", 2, least=2.0) == 2.0 and checks.number("x", "y", 3.0, most=3.0) == 3.0
    for limits, words in (({"least": 1.0, "most": 2.0}, "a number from 1 to 2"), ({"least": 1.0}, "a finite number, at least 1"),
                          ({"above": 1.0}, "a finite number above 1"), ({"most": -1.0}, "a number at most -1")):
        with pytest.raises(ValueError, match=f"^x: y = 0.5 is not allowed; it must be {words}$"):
            checks.number("x", "y", 0.5, **limits)
    with pytest.raises(ValueError, match="above 0.5"):
        checks.number("x", "y", 0.5, above=0.5)
    assert checks.whole("x", "y", 3, least=3, most=3) == 3 and type(checks.whole("x", "y", np.int32(3), least=0)) is int
    for bad in (2, 5, 3.0, True, "3"):
        with pytest.raises(ValueError, match="it must be a whole number, at least 3 and at most 4$"):
            checks.whole("x", "y", bad, least=3, most=4)
    with pytest.raises(ValueError, match="whole number, at least 3$"):
        checks.whole("x", "y", 2, least=3)
    assert checks.choice("x", "y", "a", ("a", "b")) == "a"
    assert checks.state("y0", [1, 2], (2, 4)).tolist() == [1.0, 2.0] and checks.state("y0", [1, 2, 3, 4], (2, 4)).size == 4
    for bad, words in (([1.0], "y0 has shape .1,.; a state of this system has shape .4,."), ("ab", "must be a state of 4 numbers"),
                       ([1.0, np.inf], "must be finite"), ([[1.0, 2.0]], "has shape .1, 2.")):
        with pytest.raises(ValueError, match=words):
            checks.state("y0", bad, (2, 4))
    given = np.array([1.0, 2.0])
    checks.state("y0", given, (2,))[0] = 5.0
    assert given[0] == 1.0
    tolerance = checks.KINDS["tolerance"]
    assert tolerance("x", "tolerance", 0.1) == 0.1
    for bad in (0.0, -1e-3, 0.1000001, np.nan, True, "1"):
        with pytest.raises(ValueError, match="tolerance = .* is not allowed; it must be above 0 and at most 0.1"):
            tolerance("x", "tolerance", bad)
    for good in (True, False, None, print):
        assert checks.switch("x", "progress", good) is good
    with pytest.raises(ValueError, match="progress = 1 is not allowed; it must be True, False, or a function"):
        checks.switch("x", "progress", 1)
    assert checks.vector("x", "y", [1, 2]) == (1.0, 2.0)
    for bad in (3.0, [], [[1.0]], ["a"], [np.inf]):
        with pytest.raises(ValueError, match="it must be a list of finite numbers"):
            checks.vector("x", "y", bad)


def test_sites_of_several_rows():
    assert Rows.of(np.int64(1), 3).R.tolist() == [[0.0, 1.0, 0.0]] and Rows.of((1, -1), 2).R.tolist() == [[1.0, -1.0]]
    assert Rows.of(0, 1).harmonics == set() and Rows.of(0, 1, base=(cos(2),), drift=[0.1]).drift == (0.1,)
    with pytest.raises(ValueError, match="base and drift must have one entry a row .1., or none"):
        Rows.of(0, 2, base=(cos(1), cos(2)))
    with pytest.raises(ValueError, match="site: row"):
        Rows.of([[1.0, 0.0], [0.0, 0.0]], 2)


def test_what_an_element_must_define_and_what_it_has_by_itself():
    @dataclasses.dataclass(frozen=True)
    class OwnThing(el.Element):
        pull: float = 0.1
        maybe: float | None = None
        kind: str = "a"

    own = OwnThing(0.3)
    assert OwnThing.default_label() == "own_thing" and own.parameters == {"pull": 0.3} and own.start == ("always",)
    assert own.structure == (OwnThing, True, "a") and OwnThing(0.3, 2).structure == (OwnThing, False, "a")
    assert OwnThing(maybe=2).parameters == {"pull": 0.1, "maybe": 2.0} and type(OwnThing(1).pull) is float
    assert own.mirrored() is None and own.mirrored_key("k") == "k" and own.mirrored_guard("k", 3) == 3
    assert own.stored_energy([0]) is None
    assert own.loaded("stick", 0) and not own.loaded("apart", 0) and own.placed(None) is own
    assert own.to_record() == {"class": "OwnThing", "label": None, "pull": 0.3, "maybe": None, "kind": "a"}
    record = {"class": "OwnThing", "label": "b", "pull": 0.3, "maybe": None, "kind": ["a", ["b"]]}
    assert OwnThing.from_record(record).kind == ("a", ("b",))
    with pytest.raises(NotImplementedError, match=r"OwnThing must define site\(n\)"):
        own.site(1)
    with pytest.raises(NotImplementedError, match=r"OwnThing must define mode\(key, core\)"):
        own.mode("always", CORE)
    assert not el.Element.isotropic and not el.Element.delayed
    for item in (el.Guard(u(), E.STICK, ()), el.Mode(), Law(twist), el.Hold(0, (1.0,)), el.Algebraic(u()), Restitution(0.5)):
        with pytest.raises(dataclasses.FrozenInstanceError):
            item.label = 1
    assert bf.elements.BUILT_IN["RigidStop"] is el.RigidStop
