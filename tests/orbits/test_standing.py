"""Starts at rest between stops whose walls move, and stops that leave no room, against the clearance written out."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import scene_of
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.standing import NoRoom, resting_start, straight_stops


def between_walls(gap, other, amplitude, phase, moves=0.0):
    """Return a mass with -other + amplitude cos(w t + phase) <= q <= gap + moves cos(w t + phase)."""
    upper = {"amplitude": moves, "harmonic": 1, "phase": phase} if moves else {}
    return bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.5), RigidStop(gap, 0.5, **upper), RigidStop(
        other, 0.5, side=-1, amplitude=amplitude, harmonic=1, phase=phase)], omega=1.3)


@pytest.mark.parametrize("seed", range(12))
def test_a_clearance_that_a_wall_closes_for_a_time_is_named(seed):
    """There is room where gap + other - amplitude > 0; the time that is named lies where there is none."""
    rng = np.random.default_rng([seed, 83])
    amplitude, gap = rng.uniform(0.1, 0.6), rng.uniform(-0.3, 0.3)
    room = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.2)
    system = between_walls(gap, amplitude + room - gap, amplitude, rng.uniform(0.0, 6.0))
    wall = system.elements[2]
    least = gap + wall.gap + np.array([1.0, -1.0]) * amplitude
    assert (least.min() > 0.0) == (room > 0.0)
    if room > 0.0:
        assert -(wall.gap - amplitude) <= resting_start(system)[0] <= gap
        bf.find_orbit(system, transient=0)
        return
    with pytest.raises(NoRoom, match="'rigid_stop' and 'rigid_stop_2' leave no room .* of the forcing period") as caught:
        bf.find_orbit(system)
    phase = float(str(caught.value).split("leave no room ")[1].split()[0])
    assert gap + wall.gap - amplitude * np.cos(2.0 * np.pi * phase + wall.phase) < 1e-3
    with pytest.raises(NoRoom):
        bf.lyapunov_exponents(system)


@pytest.mark.parametrize("gaps, side", [((-0.3,), 1), ((-0.3, 0.5), 1), ((0.4, -0.2), -1)])
@pytest.mark.parametrize("friction", [[], [Coulomb(0.2)]])
def test_a_mass_begins_a_tenth_beyond_the_stop_that_it_would_penetrate(gaps, side, friction):
    """Friction may hold it in the mode that is built first: the stops are those of modes in which it slips."""
    stops = [RigidStop(gap, 0.5, side=1 - 2 * k) for k, gap in enumerate(gaps)]
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.5), *friction, *stops], omega=1.3))
    found = straight_stops(scene)
    assert len({scene.element_name(*stop) for stop in found}) == len(stops)
    assert all("stick" not in scene.keys[mode] and "rest" not in scene.keys[mode] for mode, _ in found)
    depth, length = -min(gaps), 0.5 + (0.2 if friction else 0.0)  # how far forces move the spring
    np.testing.assert_allclose(resting_start(scene.system), [-side * (depth + 0.1 * (length + depth)), 0.0], rtol=1e-14)


def test_walls_that_move_together_leave_the_room_between_them():
    """Each of them takes all of the clearance at some time, both together none of it."""
    system = between_walls(0.1, 0.2, 0.5, 0.4, moves=0.5)
    start = resting_start(system)
    upper, lower = 0.1 + 0.5 * np.cos(0.4), -0.2 + 0.5 * np.cos(0.4)
    assert lower < start[0] < upper
    assert bf.simulate(system, start, periods=3).success


def test_stops_that_stand_and_contradict_each_other():
    """Of three stops the two that leave no room are named; of the third there is no word, nor of a phase where nothing moves."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [
        HarmonicForce(0.5), RigidStop(-0.2, 0.5), RigidStop(0.1, 0.5, side=-1), RigidStop(-0.3, 0.5, dof=1)], omega=1.3)
    with pytest.raises(NoRoom, match="'rigid_stop' and 'rigid_stop_2' leave no room; see") as caught:
        bf.find_orbit(system)
    assert "rigid_stop_3" not in str(caught.value).split("has no motion")[1]
    free = bf.System(1.0, 0.1, 1.0, [ConstantForce(0.2), RigidStop(-0.2, 0.5), RigidStop(0.1, 0.5, side=-1)])
    with pytest.raises(NoRoom, match="leave no room; see"):
        bf.find_orbit(free)


def test_a_stop_whose_mass_friction_holds_is_seen_before_any_mode_is_there():
    """The clearance between two masses is negative and friction acts between them: at rest they are apart, and a motion settles."""
    between = (-1.0, 1.0)
    system = bf.System(np.eye(2), 0.2 * np.eye(2), np.eye(2), [
        HarmonicForce(0.8), Jenkins(4.0, 0.1), Coulomb(0.3, load_amplitude=0.4, row=between),
        Coulomb(0.4, load_amplitude=0.1, dof=1), RigidStop(-0.2, 0.3, row=between)], omega=1.3)
    assert resting_start(system)[:2] @ between < -0.2
    orbit = bf.find_orbit(system)
    assert orbit.success
    assert np.allclose(bf.simulate(system, orbit.state, periods=orbit.periods).final, orbit.state, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("harmonic", [1, 3, 40])
def test_a_clearance_that_closes_is_seen_however_fast_the_wall_moves(harmonic):
    """It is closed for a hundredth of the wall's own period only."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.5), RigidStop(0.0, 0.5), RigidStop(
        0.4995, 0.5, side=-1, amplitude=0.5, harmonic=harmonic, phase=np.pi / 8.0)], omega=1.3)
    with pytest.raises(NoRoom, match="leave no room .* of the forcing period"):
        resting_start(system)
