"""Sliders that never slip stand anywhere in an interval: a continuum of orbits, which is one attractor."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins import Grid
from bifurc.basins.attractors.continuum import Continuum, continuum
from bifurc.elements import ConstantForce, HarmonicForce, Jenkins, RigidStop

STIFF, LIMIT, OMEGA, LOAD, STOP = 0.5, 3.0, 1.4, 0.6, (0.3, 0.6)


def oscillator(*contacts, load=LOAD):
    """A mass on a spring, with contacts."""
    return bf.System(1.0, 0.1, 1.0, [HarmonicForce(load), *contacts], omega=OMEGA)


def standing(place, load=LOAD, stop=True):
    """The orbit where the slider is a spring that is fixed at a place."""
    system = bf.System(1.0, 0.1, 1.0 + STIFF, [HarmonicForce(load), ConstantForce(STIFF * place),
                                               *([RigidStop(*STOP)] if stop else [])], omega=OMEGA)
    orbit = bf.find_orbit(system)
    assert orbit.success
    return orbit


def test_members_are_orbits_of_a_fixed_spring():
    orbit = bf.find_orbit(oscillator(RigidStop(*STOP), Jenkins(STIFF, LIMIT)))
    whole = continuum(orbit)
    labels, _ = whole.nodes
    points, apart = whole.points(1e-3, np.ones(3), 40000)
    assert apart == 1e-3 and np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 1.6e-3
    for place in (-3.1, -0.77, 0.4):
        assert whole.low < place < whole.high
        exact = standing(place)
        np.testing.assert_allclose(whole.member(place).state, [*exact.state, place], rtol=0, atol=1e-12)
        told = [np.interp(place, points[:, 2], points[:, k]) for k in (0, 1)]
        np.testing.assert_allclose(told, exact.state, rtol=0, atol=1e-6)
    assert whole.member(whole.high + 0.1) is None and labels[0] == whole.low and labels[-1] == whole.high


def test_a_continuum_ends_where_its_slider_slips():
    """Without impacts the motion is a cosine of amplitude A about place / 3; the slider slips at A + 2/3 |place| = 6."""
    whole = continuum(bf.find_orbit(oscillator(Jenkins(STIFF, LIMIT), load=0.2), closure=1))
    amplitude = 0.2 / abs(1.0 + STIFF - OMEGA**2 + 0.1j * OMEGA)
    edge = (LIMIT / STIFF - amplitude) * 1.5
    assert (whole.low, whole.high) == pytest.approx((-edge, edge), abs=1e-6)


@pytest.mark.parametrize(("contacts", "load"), [
    ((RigidStop(*STOP), Jenkins(STIFF, LIMIT)), LOAD), ((Jenkins(STIFF, LIMIT),), 0.2)])
def test_every_start_of_a_continuum_has_its_label(contacts, load):
    """Each start stands for another member; 64 starts on the wall and beside it had 72 attractors."""
    found = bf.basins_of_attraction(oscillator(*contacts, load=load), Grid(q0=(-1.0, 0.3, 8), v0=(-1.0, 1.0, 8)))
    assert len(found.attractors) == 1 and np.all(found.labels == 0)
    assert "continuum" in found.report()


def test_continua_of_two_labels_promise_nothing():
    system = oscillator(RigidStop(*STOP), Jenkins(STIFF, LIMIT), Jenkins(0.3, 2.0))
    found = bf.basins_of_attraction(system, Grid(q0=(-1.0, 0.3, 4), v0=(-1.0, 1.0, 4)))
    assert len(found.attractors) == 1 and np.all(found.labels == -1)
    assert found.reliability.statement.startswith("No label is promised")


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("low", "high"), [(-0.9, 0.7), (-0.05, 2.0), (-1.5, 0.02)])
def test_a_continuum_is_followed_to_its_ends_by_steps_that_newton_can_make(monkeypatch, unit, low, high):
    """Each member is solved from the nearest one known: one a tenth of a state's size away is reached, none farther."""
    def orbit_at(value):
        return SimpleNamespace(family=(2,), state=np.array([0.0, 0.0, value]), weights=np.array([1.0, 1.0, unit]))

    def solved(orbit, values):
        (value,) = values
        near = abs(value - orbit.state[2]) <= 0.1 * unit
        return orbit_at(value) if near and low * unit <= value <= high * unit else None
    monkeypatch.setattr("bifurc.basins.attractors.continuum.relabelled", solved)
    found = Continuum(orbit_at(0.0))
    assert found.low == pytest.approx(low * unit, abs=1e-7 * unit) and found.high == pytest.approx(high * unit, abs=1e-7 * unit)
    assert low * unit <= found.low and found.high <= high * unit
    for value in (0.5 * (found.low + found.high), found.low, found.high):
        assert found.value(found.member(value)) == value
    assert found.member((high + 0.01) * unit) is None and found.member((low - 0.01) * unit) is None
