"""Motions of any size: laws that are as good as linear there, so that all of a motion is in proportion, down to the last float."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, HarmonicForce, Jenkins, RegularizedFriction, RigidStop, Stribeck

SIZES = [1e-120, 1e-156, 1e-170, 1e-250, 1e-306]
QUANTUM = 5e-324


def cubic(damping=0.1, stiffness=1.0):
    return bf.System(1.0, damping, stiffness, [CubicSpring(1.0)])


@pytest.mark.parametrize("size", [*SIZES, 1e-312, 1e-320, -1e-320])
@pytest.mark.parametrize(("damping", "stiffness"), [(0.1, 1.0), (0.0, 1.0), (0.3, 400.0)])
def test_a_cubic_spring_is_a_linear_one_where_its_force_is_nothing(size, damping, stiffness):
    """x exp(-d t) (cos w t + d/w sin w t); squares of numbers below 1e-162 are zero, and floats below 2e-308 lose their digits."""
    motion = bf.simulate(cubic(damping, stiffness), (size, 0.0), duration=20.0)
    d, t = 0.5 * damping, motion.stop
    w = np.sqrt(stiffness - d * d)
    exact = np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))
    assert motion.success
    assert abs(motion.final[0] - size * exact) <= 1e-12 * abs(size) + 500.0 * (1.0 + stiffness) * QUANTUM


def stop(a, law):
    return bf.System(1.0, 0.0, 1.0, [*law, RigidStop(a, 0.5)]), (-2.0 * a, 0.0)


def friction(a, law):
    return bf.System(1.0, 0.0, 1.0, [*law, Coulomb(0.1 * a)]), (-2.0 * a, 0.0)


def load(a, law):
    return bf.System(1.0, 0.1, 1.0, [*law, RigidStop(a, 0.5), HarmonicForce(1.2 * a)], omega=1.1), (0.0, 0.0)


def slider(a, law):
    return bf.System(1.0, 0.1, 1.0, [*law, Jenkins(1.0, 0.1 * a), HarmonicForce(a)], omega=0.7), (0.0, 0.0)


def ball(a, law):
    return bf.System(1.0, 0.0, 0.0, [*law, RigidStop(0.0, 0.5, side=-1), ConstantForce(-a)]), (a, 0.0)


@pytest.mark.parametrize("make", [stop, friction, load, slider, ball])
@pytest.mark.parametrize("law", [(), (CubicSpring(1.0),)], ids=["affine", "law"])
@pytest.mark.parametrize("size", [*SIZES, 1e-312])
def test_events_are_those_of_the_motion_of_size_one(make, law, size):
    """Gaps, limits and loads in proportion: the same events at the same times, without the law beside which it is nothing."""
    (system, start), (whole, begin) = make(size, law), make(1.0, ())
    motion, one = bf.simulate(system, start, duration=28.0), bf.simulate(whole, begin, duration=28.0)
    noise = 1e-11 + 1e5 * QUANTUM / size
    first = min(len(one.events), 6)  # of a chattering roundings decide where it is closed
    assert motion.success and len(motion.events) >= first > 3
    times, exact = ([event.time for event in found.events[:first]] for found in (motion, one))
    np.testing.assert_allclose(times, exact, rtol=0, atol=1e3 * noise)
    np.testing.assert_allclose(motion.final[:2] / size, one.final[:2], rtol=0, atol=1e3 * noise)


@pytest.mark.parametrize("system", [
    bf.System(1.0, 0.1, 1.0, [Stribeck(1e-321, 1.5e-321, 0.5)]), bf.System(1.0, 0.1, 1.0, [RegularizedFriction(0.1, 0.01)]),
    bf.System(1.0, 0.1, 1.0, [Stribeck(1e-321, 1.5e-321, 1e-320, belt_speed=1e-320)]),
    bf.System(1.0, 0.1, 1.0, [CubicSpring(1.0), RigidStop(1e-315, 0.5), HarmonicForce(1e-314)], omega=0.7),
    bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [CubicSpring(1.0, dof=1)]),
    bf.System(1.0, 0.1, 1.0, [RigidStop(1e-315, 0.5), HarmonicForce(1e-314)], omega=0.7)], ids=range(6))
def test_numbers_that_have_lost_their_digits_come_to_an_end(system):
    """What is left of 1e-320 has three digits: the motion stays as small as what drives it."""
    motion = bf.simulate(system, np.eye(2 * system.n)[0] * 1e-320, duration=50.0)
    assert motion.success and np.abs(motion.final).max() < 1e-312
    assert len(motion.events) < 100


def test_a_motion_may_fade_into_nothing():
    motion = bf.simulate(cubic(damping=1.0), (1.0, 0.0), duration=2000.0)
    assert motion.success and np.abs(motion.final).max() < 1e-300
