"""Systems that follow time or advance, and systems with more elements."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, RigidStop


def test_the_mesh_of_the_ready_system():
    orbit = bf.find_orbit(bf.systems.gear_mesh(), (1.4, -0.28))
    np.testing.assert_allclose(orbit.state, [1.408385547164, -0.277831474394], rtol=0, atol=1e-9)


def test_the_tongue_of_the_ready_system_begins_at_a_quarter_of_the_frequency_squared():
    """With q = 0 the flip is at a = (omega/2)^2; small q open it by +-q."""
    branch = bf.trace(bf.find_orbit(bf.systems.mathieu_oscillator(a=2.2, q=1e-3), (0.0, 0.0)), "a", bounds=(0.5, 2.2))
    flips = [point.parameter for point in branch.special_points if point.kind == "period_doubling"]
    assert flips == pytest.approx([1.0 - 1e-3, 1.0 + 1e-3], abs=1e-6)


def test_parameters_of_a_shifted_system_keep_their_names(tmp_path):
    orbit = bf.find_orbit(bf.systems.vibro_impact_capsule(), shift="q0")
    assert orbit.system.parameter("friction") == 0.25
    branch = bf.trace(orbit, "friction", bounds=(0.24, 0.26))
    assert branch.audit.ok and branch.column("friction")[-1] in (0.24, 0.26)
    branch.save(tmp_path / "branch.npz")
    again = bf.load(tmp_path / "branch.npz").orbits[0]
    assert again.system == branch.orbits[0].system and again.shift == branch.orbits[0].shift


def test_elements_beside_those_of_a_ready_system():
    plain = bf.systems.impact_oscillator(omega=0.6)
    more = plain.with_elements([Coulomb(0.05), RigidStop(1.2, side=-1)])
    hand = bf.System(plain.mass, plain.damping, plain.stiffness, more.elements, omega=0.6)
    assert set(more.parameters) == {*plain.parameters, "coulomb.friction", "coulomb.static_ratio", "coulomb.belt_speed",
                                    "rigid_stop_2.gap", "rigid_stop_2.restitution"}
    changed = more.with_parameters(**{"coulomb.friction": 0.1, "gap": 0.9})
    same = hand.with_parameters(**{"coulomb.friction": 0.1, "rigid_stop.gap": 0.9})
    assert changed.elements == same.elements and changed.parameter("friction") == 0.1
    motions = [bf.simulate(system, (0.3, 0.0), periods=5).final for system in (changed, same)]
    assert np.array_equal(*motions)
    again = bf.System.from_record(changed.to_record())
    assert again == changed and again.parameters == changed.parameters
    twice = more.with_elements([Coulomb(0.01, belt_speed=1.0)])
    assert bf.System.from_record(twice.to_record()) == twice and twice.parameter("coulomb_2.belt_speed") == 1.0


@pytest.mark.parametrize("turns", [1, -1])
def test_a_pendulum_turns_both_ways(turns):
    system = bf.systems.rotating_pendulum(torque=0.4 * turns)
    orbit = bf.find_orbit(system, (-4.7 * turns, 4.0 * turns), shift={"q0": 2.0 * math.pi * turns})
    assert orbit.success and orbit.shift["q0"] == pytest.approx(2.0 * math.pi * turns, abs=1e-12)
