"""Orbits and branches of masses that rest on stops with static friction: what simulation does, and where its order changes."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, RigidStop


@bf.systems.builder
def one(ratio=1.4, amplitude=2.0, friction=0.3, omega=0.5, restitution=0.0):
    loads = [ConstantForce(-1.0), HarmonicForce(amplitude, phase=math.pi)]
    rough, stop = Coulomb(friction, static_ratio=ratio), RigidStop(0.0, restitution, side=-1)
    return bf.System(1.0, 0.0, 0.0, [*loads, rough, stop], omega=omega)


@bf.systems.builder
def two(ratio=1.0, friction=0.3, omega=0.5, phase=0.5):
    """Two masses on stops, with friction between them, that are lifted one after the other."""
    loads = [ConstantForce(-1.0), ConstantForce(-1.0, dof=1), HarmonicForce(2.0, phase=math.pi),
             HarmonicForce(1.7, phase=phase, dof=1)]
    return bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)),
                     [*loads, RigidStop(0.0, 0.0, side=-1), RigidStop(0.0, 0.0, side=-1, dof=1),
                      Coulomb(friction, static_ratio=ratio, row=(1.0, -1.0))], omega=omega)


@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("ratio", [1.0, 1.4, 2.0])
def test_an_orbit_leaves_its_stop_at_the_static_limit(ratio, restitution):
    orbit = bf.find_orbit(one(ratio=ratio, restitution=restitution))
    (slip,) = [event.time for event in orbit.events if event.kind.value == "slip"]
    assert orbit.success and slip == pytest.approx(math.acos(-(1.0 + 0.3 * ratio) / 2.0) / 0.5, abs=1e-11)
    assert np.abs(bf.simulate(orbit.system, orbit.state, periods=3).final - orbit.state).max() < 1e-12


@pytest.mark.parametrize("parameter", ["ratio", "friction", "omega", "amplitude"])
def test_a_branch_is_what_simulation_repeats(parameter):
    bounds = {"ratio": (1.0, 2.0), "friction": (0.1, 0.5), "omega": (0.2, 1.0), "amplitude": (1.2, 3.0)}[parameter]
    branch = bf.trace(bf.find_orbit(one()), parameter, bounds)
    assert branch.audit.ok
    if parameter == "amplitude":  # below it the mass stays where it is
        assert str(branch.ends[0]).startswith("jump")
        assert branch.special_points[0].parameter == pytest.approx(1.0 + 1.4 * 0.3, abs=1e-11)


@pytest.mark.parametrize("phase", [-2.5, -0.9, 0.5, 1.5, 2.5])
def test_the_order_of_kinetic_release_ends_where_static_friction_begins(phase):
    """With equal limits a stop lets go and its mass slips in one event; above, friction holds it for a while."""
    equal, above = bf.find_orbit(two(phase=phase)), bf.find_orbit(two(phase=phase, ratio=1.2))
    assert equal.success and above.success and len(above.events) == len(equal.events) + 1
    branch = bf.trace(equal, "ratio", (1.0, 1.2))
    assert branch.audit.ok and branch.special_points[0].parameter == pytest.approx(1.0, abs=1e-6)
    assert np.abs(branch.orbits[-1].state - above.state).max() < 1e-10
    assert bf.trace(equal, "omega", (0.48, 0.52)).audit.ok and bf.trace(above, "omega", (0.48, 0.52)).audit.ok
