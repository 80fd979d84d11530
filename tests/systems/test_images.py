"""Rotors in other units, turned by a quarter, and seen in a mirror that turns their spin round."""
import dataclasses

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import in_units

ROTORS = {"elastic stator": (bf.systems.jeffcott_rotor(), None),
          "rigid stator": (bf.systems.rigid_stator_rotor(), None),
          "casing": (bf.systems.rotor_in_casing(), None)}
UNITS = {"tiny": (1e-7, 1e5, 1e8), "huge": (1e8, 1e-5, 1e-6)}
START = np.array([0.1, -0.2, 0.05, 0.3])


def motion_of(system, start, periods=12.0, t0=0.0):
    motion = bf.simulate(system, np.resize(start, 2 * system.n), periods=periods, t0=t0)
    assert motion.success and len(motion.events) > 3
    return motion


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", ROTORS)
def test_rubs_and_impacts_in_other_units(name, units):
    system = ROTORS[name][0]
    image = in_units(system, *UNITS[units])
    own = motion_of(system, START)
    found = bf.simulate(image.system, image.state(np.resize(START, 2 * system.n)), periods=12)
    assert [(e.element, e.kind) for e in found.events] == [(e.element, e.kind) for e in own.events]
    assert np.allclose([e.time / image.time for e in found.events], [e.time for e in own.events], rtol=1e-8)
    assert np.abs(np.linalg.solve(image.matrix, found.final) - own.final).max() < 1e-7


def reflected(element):
    """What an element is when y is turned round: spins, surfaces and loads along y change their signs."""
    if isinstance(element, el.AroundPoint):
        return dataclasses.replace(element, centre_y=-element.centre_y, surface_speed=-element.surface_speed,
                                   frame_spin=-element.frame_spin)
    if isinstance(element, el.HarmonicForce) and element.dof % 2:
        return dataclasses.replace(element, amplitude=-element.amplitude)
    if isinstance(element, el.ConstantForce) and element.dof % 2:
        return dataclasses.replace(element, force=-element.force)
    return element


@pytest.mark.parametrize("name", ROTORS)
def test_a_rotor_in_a_mirror_turns_the_other_way(name):
    system = ROTORS[name][0]
    S = np.diag(np.resize([1.0, -1.0], system.n))
    mirror = bf.System(S @ system.mass @ S, S @ system.damping @ S, S @ system.stiffness @ S,
                       [reflected(element) for element in system.elements], omega=system.omega)
    own = motion_of(system, START)
    found = bf.simulate(mirror, np.resize(START, 2 * system.n) * np.tile(np.diag(S), 2), periods=12)
    first = [(e.element, e.kind) for e in own.events]
    first = first[:first.index(("stator", "chatter"))] if ("stator", "chatter") in first else first
    assert [(e.element, e.kind) for e in found.events][:len(first)] == first
    times = np.linspace(0.0, own.stop, 20)
    assert np.abs(found(times) * np.tile(np.diag(S), 2) - own(times)).max() < 1e-8


@pytest.mark.parametrize("name", ["rigid stator"])
def test_a_rotor_turned_by_a_quarter_is_a_quarter_later(name):
    """Without gravity and offset only the unbalance knows a direction."""
    system = ROTORS[name][0].with_parameters(gravity=0.0, offset=0.0)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    turn = np.kron(np.eye(2), quarter)
    own = motion_of(system, START)
    found = motion_of(system, turn @ START, t0=0.25 * system.period)
    times = np.linspace(0.0, own.stop, 20)
    assert np.abs(found(times + 0.25 * system.period) - own(times) @ turn.T).max() < 1e-8
