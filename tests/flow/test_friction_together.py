"""Several dry frictions on one row are one friction with the sum of their limits, static ones and kinetic ones alike."""
import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import Coulomb, CubicFriction, HarmonicForce, RigidStop, Stribeck


def one_mass(*frictions, omega=0.5):
    return bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.5), *frictions], omega=omega)


@pytest.mark.parametrize("limits", [(0.1, 0.1), (0.15, 0.05), (0.05, 0.15), (0.08, 0.05, 0.07)])
@pytest.mark.parametrize("ratio", [1.0, 1.3, 2.0])
def test_they_are_one_with_the_sum_of_the_limits(limits, ratio):
    """Static friction above kinetic: the mass moves off at 1.3 times the whole limit, whichever contact comes first."""
    many = bf.find_orbit(one_mass(*(Coulomb(limit, static_ratio=ratio) for limit in limits)))
    whole = bf.find_orbit(one_mass(Coulomb(0.2, static_ratio=ratio)))
    assert many.success and many.periods == whole.periods
    np.testing.assert_allclose([e.time for e in many.events], [e.time for e in whole.events], rtol=0, atol=1e-12)
    np.testing.assert_allclose(many.multipliers, whole.multipliers, rtol=0, atol=1e-12)


LETS_GO = {  # contacts, and what they hold together upwards, over the phase of the load
    "as one": ((Coulomb(1.0, static_ratio=1.5), Coulomb(2.0, static_ratio=1.3)), lambda a: 4.1 + 0.0 * a),
    "one static": ((Coulomb(1.0), Coulomb(2.0, static_ratio=1.3)), lambda a: 3.6 + 0.0 * a),
    "no slip force": ((Coulomb(0.0, static=1.0), Coulomb(0.0, static=2.0)), lambda a: 3.0 + 0.0 * a),
    "multiple": ((Coulomb(1.0, static_ratio=1.5), Coulomb(1.0, static_ratio=1.3, row=(2.0,))), lambda a: 4.1 + 0.0 * a),
    "backwards": ((Coulomb(1.0, static_ratio=1.2), Coulomb(0.2, friction_negative=0.7, static_ratio=1.1, row=(-2.0,))),
                  lambda a: 1.2 + 2.0 * 1.1 * 0.7 + 0.0 * a),
    "no variation": ((Coulomb(1.0, static_ratio=1.5, load_amplitude=0.0), Coulomb(2.0, static_ratio=1.3)), lambda a: 4.1 + 0.0 * a),
    "load varies": ((Coulomb(1.0, static_ratio=1.5, load_amplitude=0.3), Coulomb(2.0, static_ratio=1.3, load_amplitude=-0.1)),
                    lambda a: 1.5 + 0.45 * np.cos(a) + 2.6 - 0.26 * np.cos(a)),
    "load of a law": ((Stribeck(1.0, 1.5, 0.5), Coulomb(1.0, static_ratio=1.5, load_amplitude=0.9, load_harmonic=2)),
                      lambda a: 3.0 + 1.35 * np.cos(2.0 * a))}


@pytest.mark.parametrize("name", LETS_GO)
@pytest.mark.parametrize("turned", [False, True])
def test_they_let_go_where_their_sum_is_exceeded(name, turned):
    """A free mass under a load that grows slowly moves off when it is beyond all limits of stick together, and not before."""
    contacts, held = LETS_GO[name]
    contacts = contacts[::-1] if turned else contacts
    system = bf.System(1.0, 0.0, 0.0, [HarmonicForce(6.0, phase=-0.5 * np.pi), *contacts], omega=0.01)
    angle = np.linspace(0.0, 0.5 * np.pi, 100001)
    first = np.flatnonzero(6.0 * np.sin(angle) > held(angle))[0]
    when = brentq(lambda a: 6.0 * np.sin(a) - held(a), angle[first - 1], angle[first]) / 0.01
    motion = bf.simulate(system, (0.0, 0.0), duration=when + 1.0)
    assert motion.success and motion.events[0].kind == "slip" and abs(motion.events[0].time - when) < 1e-9
    assert not motion(np.array([when - 1e-6]))[0].any() and motion.final[1] > 0.0


@pytest.mark.parametrize(("ratios", "speeds"), [((1.5, 1.3), (0.1, 0.3)), ((1.5, 1.3), (0.3, 0.1)), ((1.0, 1.3), (0.3, -0.2))])
def test_on_belts_of_two_speeds_one_holds_against_the_slip_of_the_other(ratios, speeds):
    """Held by the faster belt at last; the slower one pulls back with its friction of slip: break-away at Fs + Fk."""
    frictions = (1.0, 2.0)
    fast, slow = int(np.argmax(speeds)), int(np.argmin(speeds))
    limit = frictions[fast] * ratios[fast] + frictions[slow]
    system = bf.System(1.0, 0.0, 0.0, [HarmonicForce(6.0, phase=-0.5 * np.pi), *(
        Coulomb(F, static_ratio=r, belt_speed=s) for F, r, s in zip(frictions, ratios, speeds, strict=True))], omega=0.01)
    when = np.arcsin(limit / 6.0) / 0.01
    motion = bf.simulate(system, (0.0, speeds[slow]), duration=when + 1.0)
    slip = motion.events[-1]
    assert slip.kind == "slip" and slip.element == system.labels[1 + fast] and abs(slip.time - when) < 1e-9
    assert slip.before[1] == pytest.approx(speeds[fast], abs=1e-14)


@pytest.mark.parametrize("factor", [-2.0, 0.5, 3.0])
def test_states_of_rest_lie_within_the_sum(factor):
    """Of a spring, with a second contact on a multiple of the row: x from -(Fs1 + |f| Fs2)/k to (Fs1 + |f| Fs2)/k."""
    system = bf.System(1.0, 0.1, 4.0, [Coulomb(0.2, static_ratio=1.5), Coulomb(0.1, static_ratio=1.2, row=(factor,))])
    edge = (0.3 + abs(factor) * 0.12) / 4.0
    rest = bf.find_equilibrium(system, (0.0,))
    assert rest.success
    ((low, high),) = rest.intervals.values()
    np.testing.assert_allclose([low, high], [-edge, edge], rtol=1e-12)
    moves = [bool(bf.simulate(system, (x, 0.0), duration=1.0).final[1]) for x in (0.999 * edge, 1.001 * edge)]
    assert moves == [False, True]


def test_an_orbit_of_multiples_is_that_of_one():
    """Forced, stick and slip: the second contact on three times the row."""
    two = bf.find_orbit(one_mass(Coulomb(0.1, static_ratio=1.3), Coulomb(0.1 / 3.0, static_ratio=1.3, row=(-3.0,))))
    whole = bf.find_orbit(one_mass(Coulomb(0.2, static_ratio=1.3)))
    assert two.success and len(two.events) == len(whole.events) > 0
    np.testing.assert_allclose([e.time for e in two.events], [e.time for e in whole.events], rtol=0, atol=1e-11)
    np.testing.assert_allclose(two.multipliers, whole.multipliers, rtol=0, atol=1e-11)


def test_limits_that_differ_by_direction_add_up_by_direction():
    many = one_mass(Coulomb(0.2, friction_negative=0.05, static_ratio=1.2), Coulomb(0.03, friction_negative=0.1, static_ratio=1.5))
    # kinetic .23 and .15; static .24 + .045 and .06 + .15: one contact cannot have both ratios, a free body shows them
    F = 0.3
    for sign, kinetic, static in ((1.0, 0.23, 0.285), (-1.0, 0.15, 0.21)):
        system = bf.System(1.0, 0.0, 0.0, [HarmonicForce(sign * F, phase=-0.5 * np.pi), *many.elements[1:]], omega=0.01)
        start = np.arcsin(static / F) / 0.01
        motion = bf.simulate(system, (0.0, 0.0), duration=1.5 * start)
        assert abs(motion.events[0].time - start) < 1e-9
        assert motion.events[0].kind == "slip" and motion.events[0].element == "coulomb"
        t = motion.stop - start
        w = 0.01
        closed = sign * (F / w * (np.cos(w * start) - np.cos(w * (start + t))) - kinetic * t)
        assert abs(motion.final[1] - closed) < 1e-10


def test_rows_that_run_opposite_ways_are_one_row():
    """The relative motion of two masses, seen from either of them; limits that differ by direction change places."""
    def pair(*frictions):
        return bf.System(np.array([[1.2, 0.1], [0.1, 0.9]]), 0.08 * np.eye(2), [[2.0, -1.0], [-1.0, 1.7]],
                         [HarmonicForce(0.8), *frictions], omega=1.1)

    forward, backward = (1.0, -1.0), (-1.0, 1.0)
    whole = bf.simulate(pair(Coulomb(0.25, friction_negative=0.35, static_ratio=1.3, row=forward)), np.zeros(4), periods=20)
    split = bf.simulate(pair(Coulomb(0.1, friction_negative=0.15, static_ratio=1.3, row=forward),
                             Coulomb(0.2, friction_negative=0.15, static_ratio=1.3, row=backward)), np.zeros(4), periods=20)
    assert whole.success and split.success and len(whole.events) == len(split.events) > 20
    np.testing.assert_allclose(split.final, whole.final, rtol=0, atol=1e-11)


KINDS = (Coulomb(0.1, static_ratio=1.4), Stribeck(kinetic=0.1, static=0.14, speed=0.3), CubicFriction(0.12, 0.05, 0.02))


@pytest.mark.parametrize("kinds", [KINDS[:2], *(pytest.param(kinds, marks=pytest.mark.slow) for kinds in (KINDS[::2], KINDS[1:]))])
def test_laws_of_different_kinds_rest_together(kinds):
    """At rest the reaction is within the sum of the limits, at slip the forces add up: checked on the simulated motion."""
    motion = bf.simulate(one_mass(*kinds), (0.3, 0.0), periods=8)
    assert motion.success, motion.message
    static = sum(getattr(kind, "static", None) or 1.4 * getattr(kind, "friction", 0.0) for kind in kinds)
    slips = [event for event in motion.events if event.kind == "slip"]
    assert slips and all(event.element == motion.system.labels[1] for event in motion.events)
    for event in slips:  # the reaction is what the spring and the force need: at its limit
        load = 0.5 * np.cos(0.5 * event.time) - event.before[0]
        assert abs(abs(load) - static) < 1e-9


def test_a_branch_of_two_frictions_is_that_of_one():
    """Over the amplitude, through the onset of stick: the same points, by the same parameter."""
    def traced(*frictions):
        system = bf.System(1.0, 0.08, 1.0, [HarmonicForce(0.5), RigidStop(2.0, 0.6), *frictions], omega=0.45)
        return bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.3, 1.2))

    one = traced(Coulomb(0.2, static_ratio=1.2))
    two = traced(Coulomb(0.12, static_ratio=1.2), Coulomb(0.08, static_ratio=1.2))
    assert one.audit.ok and two.audit.ok and len(one.special_points) > 0
    assert [point.kind for point in one.special_points] == [point.kind for point in two.special_points]
    np.testing.assert_allclose([point.parameter for point in two.special_points],
                               [point.parameter for point in one.special_points], rtol=0, atol=1e-10)


def test_floor_and_belt_stay_two():
    """On surfaces that move apart one contact sticks at most: a change of the belt speed to zero changes the modes."""
    apart = one_mass(Coulomb(0.1), Coulomb(0.1, belt_speed=0.3))
    assert apart.together == ((0, 1), (1, 1), (2, 1))
    both = one_mass(Coulomb(0.1, belt_speed=0.3), Coulomb(0.1, belt_speed=0.3))
    assert both.together == ((0, 1), (1, 1), (1, 1))
    scene = scene_of(both)
    changed = both.with_parameters(**{"coulomb.belt_speed": 0.0})
    assert not scene.same_structure(changed) and scene_of(changed).keys == scene_of(apart).keys != scene.keys


def test_a_certificate_reads_the_same_rule():
    pytest.importorskip("flint")
    orbit = bf.find_orbit(one_mass(Coulomb(0.1, static_ratio=1.3), Coulomb(0.1, static_ratio=1.3)))
    whole = bf.find_orbit(one_mass(Coulomb(0.2, static_ratio=1.3)))
    assert orbit.certify().proved and whole.certify().proved


def belts(second, ratio=1.0):
    return one_mass(Coulomb(0.1, static_ratio=ratio, belt_speed=0.3), Coulomb(0.15, static_ratio=ratio, belt_speed=second))


def test_a_branch_passes_where_two_belts_are_as_fast():
    """At .3, a sampling node of the branch, two contacts are one: there the mass that rested on the second rests on the first."""
    branch = bf.trace(bf.find_orbit(belts(0.2)), "coulomb_2.belt_speed", bounds=(0.1, 0.5))
    assert branch.stop_reason == ("bound", "bound") and branch.audit.ok
    (change,) = [point for point in branch.special_points if abs(point.parameter - 0.3) < 1e-3]
    assert change.kind == "stick_onset" and abs(change.parameter - 0.3) < 1e-13
    whole = bf.find_orbit(one_mass(Coulomb(0.25, belt_speed=0.3)))
    for end in ((0.2, 0.3), (0.4, 0.3)):  # a last row at just this value, from either side
        orbit = bf.trace(bf.find_orbit(belts(end[0])), "coulomb_2.belt_speed", bounds=end).orbits[-1 if end[0] < 0.3 else 0]
        assert abs(orbit.system.parameter("coulomb_2.belt_speed") - 0.3) < 1e-16 and orbit.success
        np.testing.assert_allclose([e.time for e in orbit.events], [e.time for e in whole.events], rtol=0, atol=1e-11)
        np.testing.assert_allclose(orbit.multipliers, whole.multipliers, rtol=0, atol=1e-11)


def test_static_friction_that_adds_up_at_one_speed_only_is_a_jump():
    """The reaction at break-away, 1.3 times the friction of the contact that holds and once that of the other, leaps at .3."""
    branch = bf.trace(bf.find_orbit(belts(0.25, 1.3)), "coulomb_2.belt_speed", bounds=(0.22, 0.35))
    assert branch.stop_reason == ("bound", "jump") and abs(branch.ends[1].p - 0.3) < 1e-13
    at_start = branch.orbits[0].events[-1]
    load = 0.5 * np.cos(0.5 * at_start.time) - at_start.before[0] - 0.1 * at_start.before[1]
    assert at_start.kind == "slip" and abs(abs(load) - (1.3 * 0.15 + 0.1)) < 1e-12
    with pytest.raises(ValueError, match="coulomb_2: rests together with another friction .* begin beside it"):
        bf.trace(bf.find_orbit(belts(0.3, 1.3)), "coulomb_2.belt_speed", bounds=(0.2, 0.4))
