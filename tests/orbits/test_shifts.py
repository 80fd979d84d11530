"""Motions that are periodic up to a shift: creeping and turning, against closed forms and another integrator."""
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, Force, HarmonicForce, Jenkins, RigidStop, SquareForce

TURN = 2.0 * math.pi


def pull(u, s):
    """Gravity on a pendulum."""
    return -math.sin(u)


def creeping(force=1.0, up=0.4, down=0.2, omega=1.3):
    """A mass on a rail under a square wave, with friction that is not the same both ways."""
    return bf.System(1.0, 0.0, 0.0, [SquareForce(force), Coulomb(up, friction_negative=down, label="rail")], omega=omega)


def creep(force, up, down, omega):
    """Return fastest speeds both ways, the advance of a period, and the multiplier: speeds are straight lines."""
    half, pushed, braked = math.pi / omega, 1.0 / (force - up), 1.0 / (force + up)
    pulled, caught = 1.0 / (force - down), 1.0 / (force + down)
    forth, back = np.linalg.solve([[pushed, caught], [braked, pulled]], [half, half])
    advance = 0.5 * forth**2 * (pushed + braked) - 0.5 * back**2 * (pulled + caught)
    return advance, (force - up) / (force + down) * (force - down) / (force + up)


@pytest.mark.parametrize("values", [(1.0, 0.4, 0.2, 1.3), (2.0, 0.3, 1.1, 0.7), (0.5, 0.05, 0.02, 2.0)])
def test_a_mass_that_creeps_under_a_square_wave(values):
    orbit = bf.find_orbit(creeping(*values), shift=["q0"])
    advance, multiplier = creep(*values)
    assert orbit.success and orbit.stable
    assert orbit.shift == {"q0": pytest.approx(advance, abs=1e-12)}
    assert orbit.multipliers == pytest.approx([multiplier], abs=1e-12)
    assert orbit.state[0] == 0.0


def test_without_a_shift_the_message_names_what_advances():
    orbit = bf.find_orbit(creeping(), transient=200)
    assert not orbit.success and "q0 advances" in orbit.message and "shift=['q0']" in orbit.message


def test_the_point_where_it_turns_back():
    """With equal friction both ways nothing advances."""
    branch = bf.trace(bf.find_orbit(creeping(), shift="q0"), "rail.friction", bounds=(0.1, 0.6))
    point, = branch.special_points  # and none where it turns just when the square wave does
    assert branch.audit.ok and (point.kind, point.name) == ("user", "reversal_q0")
    assert point.parameter == pytest.approx(0.2, abs=max(1e-12, point.error))


def test_it_comes_back_from_a_file(tmp_path):
    branch = bf.trace(bf.find_orbit(creeping(), shift="q0"), "rail.friction", bounds=(0.1, 0.6))
    branch.save(tmp_path / "branch.npz")
    again = bf.load(tmp_path / "branch.npz")
    assert [orbit.shift for orbit in again.orbits] == [orbit.shift for orbit in branch.orbits]
    assert [point.name for point in again.special_points] == ["reversal_q0"]


def test_a_pendulum_that_turns():
    """Shift 2 pi in a forcing period; the product of the multipliers is exp(-c T), and none is 1."""
    system = bf.System(1.0, 0.1, 0.0, [Force(pull), ConstantForce(0.4), HarmonicForce(0.5)], omega=4.0)
    orbit = bf.find_orbit(system, (-4.7, 4.0), shift={"q0": TURN})
    assert orbit.success and orbit.shift == {"q0": pytest.approx(TURN, abs=1e-12)}
    assert math.remainder(orbit.state[0] + 4.706149565494, TURN) == pytest.approx(0.0, abs=1e-9)
    assert orbit.state[1] == pytest.approx(4.001172921292, abs=1e-9)
    np.testing.assert_allclose(orbit.multipliers, [0.909466358 + 0.165852174j, 0.909466358 - 0.165852174j], rtol=0, atol=1e-8)


@pytest.mark.parametrize(("torque", "damping"), [(0.4, 0.1), (-0.9, 0.3)])
def test_a_wheel_that_turns_without_a_clock(torque, damping):
    """A constant speed: the period is the turn over it, the multiplier that of the speed."""
    way = math.copysign(TURN, torque)
    orbit = bf.find_orbit(bf.System(1.0, damping, 0.0, [ConstantForce(torque)]), (0.0, torque), shift={"q0": way})
    period = TURN * damping / abs(torque)
    assert orbit.success and orbit.period == pytest.approx(period, rel=1e-11)
    assert orbit.multipliers == pytest.approx([math.exp(-damping * period)], abs=1e-10)


def test_a_pendulum_that_turns_under_a_torque():
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 0.0, [Force(pull), ConstantForce(0.4)]), (0.0, 3.0), shift={"q0": TURN})

    def over(t, y):
        return y[0] - TURN

    over.terminal = True
    motion = solve_ivp(lambda t, y: (y[1], 0.4 - 0.1 * y[1] - math.sin(y[0])), (0, 10), (0.0, orbit.state[1]), method="DOP853",
                       rtol=1e-12, atol=1e-13, events=over)
    assert orbit.success and orbit.state[0] == 0.0
    assert motion.t_events[0][0] == pytest.approx(orbit.period, abs=1e-10)
    assert motion.y_events[0][0][1] == pytest.approx(orbit.state[1], abs=1e-10)


def capsule(contact):
    """A capsule on dry ground, moved by a mass inside that strikes it."""
    coupling = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return bf.System(np.diag([1.0, 0.5]), 0.02 * coupling, coupling, [
        HarmonicForce(0.6, row=(-1.0, 1.0)), contact, RigidStop(0.15, 0.5, row=(-1.0, 1.0))], omega=1.1)


@pytest.mark.parametrize("contact", [Coulomb(0.25), Jenkins(2.0, 0.25)])
def test_a_capsule_advances_with_all_that_is_in_it(contact):
    """The direction is found: both masses, and the memory of the contact with the ground.  Simulated, it advances by as much."""
    system = capsule(contact)
    orbit = bf.find_orbit(system, shift="q0")
    assert orbit.success
    motion = bf.simulate(system, orbit.state, periods=4 * orbit.periods)
    moved = np.diff(motion.sections[::orbit.periods], axis=0)
    expected = np.zeros(motion.sections.shape[1])
    expected[[0, 1, *range(4, len(expected))]] = orbit.shift["q0"]
    np.testing.assert_allclose(moved, np.tile(expected, (4, 1)), rtol=0, atol=1e-9)
    assert len(orbit.multipliers) == len(expected) - 1


def test_memory_moves_along_by_what_is_known():
    """The slider of an elastic contact goes where the capsule goes."""
    orbit = bf.find_orbit(capsule(Jenkins(2.0, 0.25)), shift={"q0": -0.2, "q1": -0.2}, transient=40)
    assert orbit.system.elements[-1].direction == pytest.approx((1.0, 1.0, 0.0, 0.0, 1.0), abs=1e-14)


@pytest.mark.parametrize(("system", "shift", "said"), [
    (capsule(Coulomb(0.25)), ["q0", "q1"], "q0, q1 advance together"),
    (bf.System(np.eye(2), np.zeros((2, 2)), [[1.0, -1.0], [-1.0, 1.0]], [RigidStop(1.0, dof=1), HarmonicForce(0.3)], omega=1.0),
     "q1", "rigid_stop depends on it"),
    (bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.3)], omega=1.0), "q0", "cannot advance: the motion of coordinate 0 depends on it"),
    (bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.3)], omega=1.0), {"q0": 1.0}, "the motion of coordinate 0 changes by it"),
    (bf.System(1.0, 0.1, 0.0, [Force(pull), HarmonicForce(0.3)], omega=1.0), {"q0": 3.0}, "force is not periodic in it"),
    (bf.System(1.0, 0.1, 0.0, [Force(pull), HarmonicForce(0.3)], omega=1.0), "q0", "force depends on it"),
    (bf.System(1.0, 0.1, 0.0, [ConstantForce(0.4)]), "q0", "without excitation"),
    (creeping(), {"q0": 0.0}, "not zero"), (creeping(), "v0", "coordinates, q0"), (creeping(), "q3", "unknown to this system"),
    (creeping(), [], "names of different coordinates"), (creeping(), 3, "names of different coordinates"),
    (creeping(), ["q0", "q0"], "names of different coordinates"), (creeping(), {"q0": math.nan}, r"shift\['q0'\] = nan")])
def test_what_cannot_advance_is_refused(system, shift, said):
    with pytest.raises(ValueError, match=said):
        bf.find_orbit(system, shift=shift)
