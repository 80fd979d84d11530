"""Modes whose own motion takes far longer than a flight: what their steps would add up is no rounding of the state."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, RigidStop


@pytest.mark.parametrize("gap", [1e-3, 1.0, 572.0])
@pytest.mark.parametrize(("damping", "stiffness"), [(1e-152, 0.0), (0.0, 1e-14), (0.0, 1e-20), (1e-9, 0.0), (0.0, 0.0)])
def test_a_load_drives_a_mass_to_its_stop_however_soft_its_spring(damping, stiffness, gap):
    """Uniform acceleration: it falls for sqrt(2 gap), and stays on a plastic stop."""
    system = bf.System(1.0, damping, stiffness, [ConstantForce(-1.0), RigidStop(gap, 0.0, side=-1)])
    time = np.sqrt(2.0 * gap)
    motion = bf.simulate(system, (0.0, 0.0), duration=3.0 * time)
    assert motion.success and [event.element for event in motion.events] == ["rigid_stop"]
    assert motion.events[0].time == pytest.approx(time, rel=1e-7 if damping == 1e-9 else 1e-10)
    np.testing.assert_allclose(motion(np.array([0.5, 2.0]) * time)[:, 0], [-0.25 * gap, -gap], rtol=1e-7)


SLOW = [(1e-152, 0.0), (0.0, 1e-100), (1e-20, 0.0), (0.0, 1e-30), (0.0, 0.0)]


@pytest.mark.parametrize(("damping", "stiffness"), SLOW)
@pytest.mark.parametrize(("force", "speed"), [(1.0, 1.0), (1e-4, 5e-7), (1e-6, 10.0)])
def test_friction_stops_a_mass_where_no_surface_tells_a_length(damping, stiffness, force, speed):
    """Uniform deceleration: it stands still from v m / F on, after the way m v^2 / 2 F."""
    for M, row in ((2.0, None), ([[0.08, 3e-3], [3e-3, 2.0]], (0.0, 1.0))):
        n = 2 if row else 1
        mass = 2.0 if row is None else 2.0 - 9e-6 / 0.08  # that a force on the second one meets
        eye = np.eye(n) if row else 1.0
        system = bf.System(M, damping * eye, stiffness * eye, [Coulomb(force, static_ratio=1.4, row=row)])
        start = np.zeros(2 * n)
        start[-1] = speed
        if row:
            start[n] = 0.25 * speed
        time = speed * mass / force
        motion = bf.simulate(system, start, duration=3.0 * time)
        assert motion.success and [event.kind for event in motion.events] == ["stick"]
        assert motion.events[0].time == pytest.approx(time, rel=1e-12)
        assert motion.final[n - 1] == pytest.approx(0.5 * speed * time, rel=1e-12) and motion.final[-1] == 0.0


@pytest.mark.parametrize(("damping", "stiffness"), SLOW)
@pytest.mark.parametrize("height", [1e-9, 1.0, 300.0])
def test_a_ball_on_a_floor_at_distance_zero(damping, stiffness, height):
    """Elastic impacts every 2 sqrt(2 h / g): the distance of the surface tells nothing of the flights."""
    system = bf.System(1.0, damping, stiffness, [ConstantForce(-9.81), RigidStop(0.0, 1.0, side=-1)])
    fall = np.sqrt(2.0 * height / 9.81)
    motion = bf.simulate(system, (height, 0.0), duration=8.0 * fall)
    assert motion.success
    np.testing.assert_allclose([event.time for event in motion.events], np.array([1.0, 3.0, 5.0, 7.0]) * fall, rtol=1e-12)
    np.testing.assert_allclose(motion.final, [height, 0.0], rtol=1e-10, atol=1e-10 * np.sqrt(height))


@pytest.mark.parametrize(("damping", "stiffness"), SLOW)
@pytest.mark.parametrize("speed", [1.0, 1e-5])
def test_a_mass_between_two_stops_without_a_load(damping, stiffness, speed):
    system = bf.System(1.0, damping, stiffness, [RigidStop(1.0, 1.0), RigidStop(1.0, 1.0, side=-1)])
    motion = bf.simulate(system, (0.0, speed), duration=6.0 / speed)
    assert motion.success
    np.testing.assert_allclose([event.time * speed for event in motion.events], [1.0, 3.0, 5.0], rtol=1e-12)


@pytest.mark.parametrize(("height", "gap"), [(1e-20, 0.0), (1e-100, 0.0), (1.0, 1e-20), (0.0, 1e-30)])
def test_a_small_length_makes_no_small_steps(height, gap):
    """Without rates any step is exact: a ball that rests after 1e-10 is followed for 20 as fast as one that falls from 1."""
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(-1.0), RigidStop(gap, 0.5, side=-1)])
    motion = bf.simulate(system, (height, 0.0), duration=20.0)
    fall = np.sqrt(2.0 * (height + gap))
    assert motion.success and motion.final.tolist() == [-gap, 0.0]
    assert motion.events[0].time == pytest.approx(fall, rel=1e-9)
