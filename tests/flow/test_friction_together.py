"""Several dry frictions on one row are one friction with the sum of their limits, static ones and kinetic ones alike."""
import numpy as np
import pytest

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
